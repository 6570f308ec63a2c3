"""Obstacles with headings of their own: recorded cars, doors, bodies that slide or turn on the spot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import example, given, strategies as st

from slalom import (
    METHODS,
    AtConstantVelocity,
    ConstantVelocity,
    Disc,
    Goal,
    Headings,
    InvalidFile,
    Known,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    Rectangle,
    State,
    Stationary,
    Velocity,
    control_obstacle,
)
from slalom.obstacle.window import predicted
from slalom.sim import Recording, Robot, Scenario, simulate
from slalom.sim.files.decision_file import read_decision
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.scenario_yaml import read_scenario

DOOR = Obstacle(
    Rectangle(4.0, 0.2), Stationary((4.0, 0.5)), "door", Headings([0.0, 2.0, 3.0, 5.0], [0.0, 1.2, 1.2, -1.9])
)
GOAL = Goal(Stationary((9.0, 0.0)))
LIMITS = Limits(1.5, 1.0)


def turned(angles: list[float], share: float) -> float:
    """Angle at a share of the way through the angles, each step the shorter way round: by complex numbers."""
    whole = min(int(share), len(angles) - 2)
    step = np.angle(np.exp(1j * (angles[whole + 1] - angles[whole])))
    first = angles[0] + sum(np.angle(np.exp(1j * np.diff(angles[: whole + 1]))))
    return float(first + (share - whole) * step)


@given(
    angles=st.lists(st.floats(-7.0, 7.0).map(lambda x: round(x, 6)), min_size=2, max_size=5).filter(
        lambda a: np.all(np.abs(np.abs(np.angle(np.exp(1j * np.diff(a)))) - np.pi) > 1e-3)
    ),
    where=st.floats(0.0, 1.0),
    tolerance=st.sampled_from([1e-2, 1e-6]),
)
def test_headings_turn_the_shorter_way_and_their_pieces_are_as_accurate_as_they_state(
    angles: list[float], where: float, tolerance: float
) -> None:
    headings = Headings(np.arange(len(angles)), angles)
    share = where * (len(angles) - 1)
    expected = np.exp(1j * turned(angles, share))
    np.testing.assert_allclose(headings.direction(share), [expected.real, expected.imag], atol=1e-9)
    path = headings.directions(-1.5, len(angles) + 0.5, tolerance)
    assert (path.times[0], path.times[-1]) == (-1.5, len(angles) + 0.5)
    assert path.error.max() <= tolerance
    for k in range(len(path.points)):
        s = np.linspace(0.0, 1.0, 9)[:, None]
        p = path.points[k]
        curve = (1 - s) ** 3 * p[0] + 3 * s * (1 - s) ** 2 * p[1] + 3 * s**2 * (1 - s) * p[2] + s**3 * p[3]
        truth = headings.direction(path.times[k] + s[:, 0] * (path.times[k + 1] - path.times[k]))
        assert np.linalg.norm(curve - truth, axis=1).max() <= path.error[k] + 1e-12


def test_a_body_that_turns_on_the_spot_hits_when_its_outline_does() -> None:
    """Against polygons at 5000 times; before the first and after the last stamp the heading stays."""
    rng = np.random.default_rng(5)
    angles = np.unwrap(DOOR.heading.angles)
    hits = 0
    for _ in range(60):
        state = State(rng.uniform((0.0, -3.0), (8.0, 3.0)), rng.uniform(-1.0, 1.0, 2))
        start, u = rng.uniform(-1.0, 4.0), rng.uniform(-1.5, 1.5, 2)
        blocked = control_obstacle(Velocity(), state, [DOOR], Disc(0.3), horizon=4.0, start=start)
        times = np.linspace(0.0, 4.0, 5001)
        a = np.interp(start + times, DOOR.heading.times, angles)
        axis = 2.0 * np.stack([np.cos(a), np.sin(a)], axis=1)
        side = 0.1 / 2.0 * np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        rings = np.array([4.0, 0.5]) + np.stack([axis + side, side - axis, -axis - side, axis - side], axis=1)
        robot = shapely.points(state.position + times[:, None] * u)
        touches = shapely.distance(shapely.polygons(rings), robot) < 0.3
        expected = times[np.argmax(touches)] if touches.any() else np.inf
        hits += touches.any()
        assert float(blocked.time_to_collision(u)) == pytest.approx(expected, abs=1e-3)
    assert hits > 10


def test_a_car_that_slides_keeps_the_heading_that_it_has() -> None:
    slides = Obstacle(Rectangle(4.0, 2.0), ConstantVelocity((0.0, 5.0), (0.0, -1.0)), heading=Headings([0.0], [0.3]))
    fixed = replace(slides, heading=0.3)
    state, controls = State((0.0, 0.0), (0.0, 0.0)), np.random.default_rng(0).uniform(-1.0, 1.0, (20, 2))
    one, other = (control_obstacle(Velocity(), state, [o], Disc(0.3), horizon=6.0) for o in (slides, fixed))
    np.testing.assert_allclose(one.clearance(controls), other.clearance(controls), atol=1e-6)


def test_a_forecast_from_the_present_does_not_see_later_headings() -> None:
    seen = predicted(DOOR, AtConstantVelocity(), 1.0)
    assert seen.heading == pytest.approx(0.6)
    assert predicted(DOOR, Known(), 1.0) is DOOR
    # A table shares the bodies at rest between all forecasts: a body that turns is none of them.
    others = ObstacleTable([DOOR, replace(DOOR, heading=0.3)]).split(at_rest=True)[1]
    assert others == (DOOR,)


def test_files_hold_headings(tmp_path: Path) -> None:
    robot = Robot(Disc(0.3), LIMITS, State((0.0, 0.0), (0.0, 0.0)), GOAL)
    scenario = Scenario("door", (robot,), (DOOR,), duration=3.0)
    (tmp_path / "door.yaml").write_text(scenario_text(scenario))
    read = read_scenario(tmp_path / "door.yaml")
    recording = simulate(read, METHODS["nao"])
    recording.save(tmp_path / "door.h5")
    made = Navigator(METHODS["nao"], Disc(0.3), LIMITS).decide(robot.state, [DOOR], GOAL)
    made.dump(tmp_path / "door.json")
    again, same = read_decision(tmp_path / "door.json").repeat()
    assert same
    for found in (read.obstacles[0], Recording.load(tmp_path / "door.h5").obstacles[0], again.inputs.obstacles[0]):
        np.testing.assert_array_equal(found.heading.times, DOOR.heading.times)
        np.testing.assert_array_equal(found.heading.angles, DOOR.heading.angles)
    assert Recording.load(tmp_path / "door.h5").digest() == recording.digest()


@given(st.floats(-1e4, 1e4), st.lists(st.integers(-3, 3), min_size=2, max_size=6))
@example(-82.21287195074561, [0, 3, -3, 0])
def test_headings_from_the_angles_of_others_are_the_same(first: float, halves: list[int]) -> None:
    """To the bit, as files need it, also after half turns, for which rounding decides."""
    angles = first + np.pi * np.array(halves)
    headings = Headings(np.arange(len(angles)), angles)
    again = Headings(headings.in_files["times"], headings.in_files["angles"])
    times = np.linspace(-0.5, len(angles), 40)
    np.testing.assert_array_equal(again.angle(times), headings.angle(times))
    np.testing.assert_array_equal(headings.angles, angles)


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        ("north", r"heading: expected an angle \[rad\], 'motion', or times and angles; found 'north'"),
        ("[1, 2]", r"heading: expected an angle \[rad\], 'motion', or times and angles; found \[1, 2\]"),
        ("{times: [0, 1], angles: [0]}", r"heading: angles: expected one for each time, .* shape \(1,\) for times"),
        ("{times: [0], angle: [1]}", r"heading\.angle: expected one of times, angles; .* did you mean 'angles'\?"),
        ("{times: [0, x], angles: [0, 1]}", r"heading\.times\.1: expected a number, found 'x'"),
    ],
)
def test_a_wrong_heading_in_a_file_has_one_message(heading: str, said: str, tmp_path: Path) -> None:
    robot = Robot(Disc(0.3), LIMITS, State((0.0, 0.0), (0.0, 0.0)), GOAL)
    text = scenario_text(Scenario("door", (robot,), (replace(DOOR, heading=0.3),), duration=3.0))
    assert text.count("heading: 0.3") == 1
    (tmp_path / "door.yaml").write_text(text.replace("heading: 0.3", f"heading: {heading}"))
    with pytest.raises(InvalidFile, match=said):
        read_scenario(tmp_path / "door.yaml")
