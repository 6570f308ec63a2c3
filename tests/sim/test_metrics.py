"""Metrics on recordings that can be computed by hand, and closest approaches against brute force."""

import inspect
import json
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from draws import draws
from metrics_by_hand import BY_HAND, CORNER, STRAIGHT, driven, rock
from parts import disc_or_ball

from slalom import (
    METHODS,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    Disc,
    Goal,
    Limits,
    Obstacle,
    Polygon,
    Polyline,
    Rectangle,
    Sampled,
    State,
    Stationary,
    Trajectory,
    Union,
)
from slalom.base.errors import InvalidInput
from slalom.sim import Recording, Robot, Scenario, metrics, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import (
    METRIC,
    between_robots,
    closest_approaches,
    nearest_clearances,
    positions_at,
)
from slalom.sim.measure.metrics import ADJUSTMENT, COLLISION, METRICS, STALLED_SPEED
from slalom.sim.measure.responses import RecordedResponses
from slalom.sim.measure.tidy_table import columns_of


def test_every_metric_has_a_docstring() -> None:
    assert all(inspect.getdoc(metric) for metric in METRICS.values())


@pytest.mark.parametrize(("name", "recording", "expected"), BY_HAND, ids=[name for name, _, _ in BY_HAND])
def test_by_hand(name: str, recording: Recording, expected: float) -> None:
    # The clearing distance of STRAIGHT: x = 0, 0.5, 1.5, 2.5, 3 are 1.5, 1, 0, 1, 1.5 m from the rock along x.
    accuracy = {"min_clearance": METRIC, "heading_change": 1e-7}
    assert METRICS[name](recording) == pytest.approx(expected, abs=accuracy.get(name, 1e-12))


def test_adjustments_count_changes_above_the_threshold() -> None:
    """From one step to the next, and from rest to the first."""
    below, above = ADJUSTMENT * 0.99, ADJUSTMENT * 1.01
    assert metrics.adjustments(driven([(below, 0)] * 3)) == 0
    assert metrics.adjustments(driven([(above, 0)] * 3)) == 1
    assert metrics.adjustments(driven([(1, 0), (1 + below, 0), (1 + 2 * below, 0), (1 + 2 * below, above)])) == 2
    assert metrics.adjustments(driven([(0.04, 0), (0, 0.04), (0, 0)])) == 1


def test_sign_reversals() -> None:
    """More than a right angle; a right angle and standing still are none."""
    assert metrics.sign_reversals(driven([(1, 0), (-1, 0), (1, 0), (0, 1), (0, 0), (0, -1), (-0.1, 0.9)])) == 3


def test_heading_change_ignores_standing() -> None:
    """A robot that stops and drives back has turned by half a turn."""
    assert metrics.heading_change(driven([(-1, 0), (-1, 0)], speed=(1, 0))) == pytest.approx(math.pi)
    square = driven([(-1, 1), (-1, -1), (1, -1)], speed=(1, 0))
    assert metrics.heading_change(square) == pytest.approx(1.5 * math.pi)


def test_stalled_time_counts_steps_that_begin_slowly() -> None:
    slow = STALLED_SPEED * 0.99
    assert metrics.stalled_time(driven([(0, 0)] * 4, speed=(slow, 0), dt=0.5)) == 2.0
    assert metrics.stalled_time(driven([(0, 0)] * 4, speed=(1.02 * slow, 0), dt=0.5)) == 0.0


def test_failures_to_progress() -> None:
    """Intervals of five seconds in which the goal comes nearer by less than 10 cm."""
    goal = Goal(Stationary((50.0, 0.0)), 0.5)
    assert metrics.failures_to_progress(driven([(0, 0)] * 10, speed=(0.019, 0), goal=goal)) == 2
    assert metrics.failures_to_progress(driven([(0, 0)] * 10, speed=(0.021, 0), goal=goal)) == 0
    assert metrics.failures_to_progress(driven([(0, 0)] * 10, speed=(-1, 0), goal=goal)) == 2
    assert metrics.failures_to_progress(driven([(0, 0)] * 4, speed=(0, 0), goal=goal)) == 0
    runs_away = Goal(ConstantVelocity((50.0, 0.0), (1.0, 0.0)), 0.5)
    assert metrics.failures_to_progress(driven([(0, 0)] * 10, speed=(1, 0), goal=runs_away)) == 2


def test_space_compliance_and_times_of_existence() -> None:
    """Two of five steps are nearer than half a metre; an obstacle that is gone is no obstacle."""
    passes = (rock((0.0, 1.9)),)
    run = driven([(0, 0)] * 4, position=(-4, 0), speed=(2, 0), obstacles=passes)
    assert metrics.space_compliance(run) == 0.8
    brief = Obstacle(disc_or_ball(1.0, 2), Sampled([1.0, 3.0], [(0.0, 1.9)] * 2), "brief")
    nowhere = Obstacle(disc_or_ball(1.0, 2), Sampled([50.0, 60.0], [(0.0, 0.0)] * 2), "later")
    assert metrics.space_compliance(replace(run, obstacles=(brief, nowhere))) == 0.8
    assert metrics.clearing_distance(replace(run, obstacles=(nowhere,))) == math.inf
    assert metrics.min_clearance(replace(run, obstacles=(nowhere,))) == math.inf
    expected = np.mean([math.hypot(2, 1.9), 1.9, math.hypot(2, 1.9)]) - 1.5
    assert metrics.clearing_distance(replace(run, obstacles=(brief,))) == pytest.approx(expected)


def test_min_time_to_collision_of_a_head_on_approach() -> None:
    """7 m between the surfaces at 2 + 1 m/s, then 4 m, then 1 m."""
    comes = Obstacle(disc_or_ball(1.0, 2), ConstantVelocity((8.5, 0.0), (-1.0, 0.0)), "car")
    run = driven([(0, 0)] * 2, speed=(2, 0), obstacles=(comes,))
    assert metrics.min_time_to_collision(run) == pytest.approx(1 / 3)
    leaves = Obstacle(disc_or_ball(1.0, 2), ConstantVelocity((8.5, 0.0), (3.0, 0.0)), "car")
    assert metrics.min_time_to_collision(replace(run, obstacles=(leaves,))) == math.inf
    inside = rock((0.5, 0.0))
    assert metrics.min_time_to_collision(replace(run, obstacles=(inside,))) == 0.0


def test_spl_of_a_detour() -> None:
    """An arc of two sides of a square for a goal at the opposite corner, less the tolerance."""
    goal = Goal(Stationary((10.0, 10.0)), 0.5)
    run = driven([(-10, 10)], speed=(10, 0), dt=1.0, goal=goal)
    x = np.array([(0, 0), (10, 0), (10, 10)], dtype=float)[:, None]
    run = replace(run, positions=x, velocities=x, times=np.arange(3.0), arrived=np.array([2.0]))
    run = replace(run, accelerations=np.zeros((2, 1, 2)))
    assert metrics.spl(run) == pytest.approx((math.hypot(10, 10) - 0.5) / 20.0)
    assert metrics.spl(replace(run, arrived=np.array([np.inf]))) == 0.0
    assert metrics.spl(replace(run, obstacles=(rock((10.0, 0.0)),))) == 0.0


@pytest.mark.parametrize(("deep", "hit"), [(0.5, 0), (0.999, 0), (1.2, 1), (100.0, 1)])
def test_a_collision_is_an_overlap_of_more_than_a_millimetre(deep: float, hit: int) -> None:
    """Contact is none. `deep` in units of COLLISION."""
    beside = rock((5.0, 1.5 - deep * COLLISION))
    run = driven([(0, 0)] * 10, speed=(1, 0), goal=Goal(Stationary((10.0, 0.0)), 0.5), obstacles=(beside,))
    assert metrics.collisions(run) == hit
    assert metrics.success(run) == 1 - hit
    assert metrics.summary(run)["collisions"] == hit


def test_collisions_count_obstacles() -> None:
    """Not steps: each pair once, however often it meets."""
    twice = Obstacle(disc_or_ball(1.0, 2), Sampled([0, 2, 4, 6], [(0, 0), (9, 9), (4, 0), (9, 9)], "linear"), "twice")
    run = driven([(0, 0)] * 6, speed=(1, 0), obstacles=(twice, rock((3.0, 0.0)), rock((3.0, 5.0))))
    assert metrics.collisions(run) == 2


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("steps", [0, 1])
@pytest.mark.parametrize("among", [False, True])
def test_short_runs_have_metrics(among: bool, steps: int, d: int) -> None:
    """A number, or inf where the docstring says so; never nan, never an error."""
    others = (rock(np.full(d, 2.0)),) if among else ()
    for goal in (np.full(d, 9.0), np.zeros(d)):
        run = driven(
            np.full((steps, d), 0.1),
            position=np.zeros(d),
            speed=np.zeros(d),
            dt=0.1,
            goal=Goal(Stationary(goal), 0.5),
            obstacles=others,
        )
        for name, metric in METRICS.items():
            value = metric(run)
            assert isinstance(value, float), name
            assert math.isfinite(value) or (value == math.inf and "inf" in (inspect.getdoc(metric) or "")), name
        json.dumps(metrics.summary(run), allow_nan=False)


def test_the_robot_that_starts_at_its_goal_is_a_success() -> None:
    run = simulate(build("empty", {"distance": 0.0}), METHODS["nao"])
    assert METRICS["success"](run) == 1.0
    assert METRICS["spl"](run) == 1.0
    assert METRICS["time"](run) == 0.0


def test_summary_agrees_with_the_metrics() -> None:
    """And is plain JSON."""
    run = simulate(build("head_on"), METHODS["nao"], seed=3)
    found = metrics.summary(run)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["min_clearance"] == metrics.min_clearance(run)
    assert found["collisions"] == metrics.collisions(run)
    assert found["adjustments"] == metrics.adjustments(run)
    assert found["jerk"] == metrics.mean_jerk(run)
    assert found["time"] == metrics.time(run)
    assert found["arrived"] == metrics.arrived(run) == found["robots"] == 1
    assert (found["scenario"], found["method"], found["seed"]) == ("head_on", "nao", 3)
    assert sum(found["statuses"].values()) == len(run.outcomes)
    assert 0.0 < found["decision_us"]["p50"] <= found["decision_us"]["p99"] <= found["decision_us"]["max"]
    spent = run.decision_times[:, 0] * 1e6
    assert found["decision_us"]["max"] == pytest.approx(spent.max(), abs=0.06)
    assert found["decision_us"]["p50"] == pytest.approx(np.median(spent), abs=0.06)


def test_track_is_sampled_often_enough_and_exactly() -> None:
    times, positions = metrics.track(CORNER, 8.0)
    assert times[0] == 0.0
    assert times[-1] == 1.5
    assert np.diff(times).max() <= 1 / 8 + 1e-12
    at_one_second_and_a_quarter = (2.5, 0.25 + 0.25)
    np.testing.assert_allclose(positions[np.argmin(np.abs(times - 1.25))], at_one_second_and_a_quarter)


def brute(recording: Recording, obstacle: Obstacle, step: float = 1e-5) -> tuple[float, float]:
    """Least clearance and its time on samples `step` apart, from the definitions alone."""
    first, last = obstacle.trajectory.span
    best, when = np.inf, np.inf
    for k, (x, v, a) in enumerate(
        zip(recording.positions[:-1, 0], recording.velocities[:, 0], recording.accelerations[:, 0])
    ):
        e = np.arange(0.0, recording.dt + step / 2, step)
        t = recording.times[k] + e
        there = (t >= first) & (t <= last)
        if not np.any(there):
            continue
        e, t = e[there, None], t[there]
        distance = np.linalg.norm(obstacle.trajectory.position(t) - (x + v * e + 0.5 * a * e * e), axis=1)
        j = int(np.argmin(distance))
        if distance[j] < best:
            best, when = float(distance[j]), float(t[j])
    return best - obstacle.shape.bounding_radius - recording.shapes[0].bounding_radius, when


def wild(rng: np.random.Generator, d: int) -> tuple[Trajectory, ...]:
    """Fast and crooked trajectories about the origin."""
    stamps = np.cumsum(rng.uniform(0.05, 0.6, size=12)) - 0.5
    walk = np.cumsum(rng.normal(0.0, 1.2, size=(12, d)), axis=0)
    spin = None if d == 2 else rng.normal(size=3)
    return (
        Stationary(rng.normal(0, 2, d)),
        ConstantVelocity(rng.normal(0, 2, d), rng.normal(0, 4, d), 0.3),
        ConstantAcceleration(rng.normal(0, 2, d), rng.normal(0, 4, d), rng.normal(0, 5, d)),
        Circular(rng.normal(0, 2, d), 1.5, 9.0, rng.uniform(0, 6), spin),
        Sampled(stamps, walk, "linear"),
        Sampled(stamps, walk, "smooth"),
        Sampled(stamps[:3] + 0.21, walk[:3], "linear"),
    )


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_closest_approaches_are_those_of_brute_force(seed: int, d: int) -> None:
    rng = np.random.default_rng([seed, d])
    others = tuple(Obstacle(disc_or_ball(0.3, d), t, str(k)) for k, t in enumerate(wild(rng, d)))
    run = driven(
        rng.normal(0, 4, (8, d)),
        position=rng.normal(0, 2, d),
        speed=rng.normal(0, 3, d),
        dt=0.25,
        start=0.1,
        obstacles=others,
    )
    for closest, obstacle in zip(closest_approaches(run), others, strict=True):
        least, _ = brute(run, obstacle)
        # Samples 1e-5 s apart miss at most 1e-5 s times the relative speed, which is below 40 m/s.
        assert -2e-4 <= closest.clearance - least <= METRIC, obstacle.trajectory
        if np.isfinite(least):
            away = obstacle.trajectory.position(closest.time) - positions_at(run, 0, np.array([closest.time]))[0]
            assert np.linalg.norm(away) - 0.8 == pytest.approx(closest.clearance, abs=1e-9)


TEE = Union((Rectangle(0.8, 0.2), Disc(0.3), Polygon([(0.0, 0.0), (2.0, 0.3), (1.5, 1.0)])))
COURTYARD = Polyline([(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (2.0, 9.0), (2.0, 6.0)], 0.1)


@pytest.mark.parametrize("seed", draws(range(13)))
def test_nearest_clearances_are_those_of_all_obstacles(seed: int) -> None:
    """The nearest obstacle of each robot, and all that overlap one, have the clearance of their closest approach."""
    rng = np.random.default_rng(seed)
    others = [Obstacle(disc_or_ball(0.3, 2), t) for t in wild(rng, 2)]
    turning = Obstacle(TEE, ConstantVelocity(rng.normal(0, 5, 2), rng.normal(0, 2, 2)), heading="motion")
    tilted = Obstacle(TEE, Stationary(rng.normal(0, 5, 2)), heading=float(rng.uniform(0, 6)))
    far = [Obstacle(Disc(0.5), Stationary(rng.uniform(-12, 12, 2))) for _ in range(30)]
    obstacles = (*others, turning, tilted, Obstacle(COURTYARD, Stationary(rng.normal(0, 2, 2))), *far)
    a, b = (
        driven(rng.normal(0, 2, (40, 2)), position=rng.normal(0, 4, 2), speed=rng.normal(0, 2, 2), dt=0.1)
        for _ in range(2)
    )
    rows = ("positions", "velocities", "accelerations", "controls", "decision_times")
    run = replace(
        a,
        **{name: np.concatenate([getattr(a, name), getattr(b, name)], axis=1) for name in rows},
        responses=RecordedResponses.of([2 * row for row in a.responses.rows], 2),
        outcomes=tuple(2 * row for row in a.outcomes),
        names=("a", "b"),
        shapes=(Disc(0.2), TEE),
        limits=2 * a.limits,
        goals=2 * a.goals,
        arrived=np.array([np.inf, np.inf]),
        obstacles=obstacles,
    )
    found = nearest_clearances(run)
    every = np.array([[closest.clearance for closest in closest_approaches(run, k)] for k in range(2)])
    counts = every <= np.maximum(every.min(axis=1, keepdims=True), 0.0)
    np.testing.assert_allclose(found[counts], every[counts], atol=METRIC)
    assert np.all(found >= every - METRIC)
    assert np.isinf(found).mean() > 0.3


@pytest.mark.parametrize("graze", [-2e-3, -1e-4, 1e-4, 2e-3])
@pytest.mark.parametrize("dt", [0.1, 1.0, 2.5])
def test_a_pass_between_steps_is_seen(dt: float, graze: float) -> None:
    """At 30 m/s an obstacle crosses within a fraction of a step; at no step it is nearer than a metre."""
    at = 0.43 * dt
    crosses = Obstacle(disc_or_ball(0.2, 2), ConstantVelocity((0.4 + graze, -30.0 * at), (1.0, 30.0)), "crosses")
    run = driven([(0, 0)] * 3, speed=(1, 0), dt=dt, radius=0.2, obstacles=(crosses,))
    (closest,) = closest_approaches(run)
    assert -1e-12 <= closest.clearance - graze <= METRIC
    assert closest.time == pytest.approx(at, abs=1e-3)
    assert metrics.collisions(run) == (graze < -COLLISION)
    distances = np.linalg.norm(crosses.trajectory.position(run.times) - run.positions[:, 0], axis=1)
    assert distances.min() > 1.0


@pytest.mark.parametrize("graze", [-0.01, -2e-4, 2e-4, 0.01])
def test_a_graze_between_steps_has_the_right_sign(graze: float) -> None:
    """Two parabolas that touch in the middle of a step."""
    above = Obstacle(
        disc_or_ball(1.0, 2), ConstantAcceleration((2.0, 1.5 + graze), (0.0, 0.0), (0.0, 4.0), 2.2), "above"
    )
    run = driven([(0, 0)] * 4, position=(2.0, 0.0), obstacles=(above,))
    (closest,) = closest_approaches(run)
    assert graze <= closest.clearance + 1e-12
    assert closest.clearance == pytest.approx(graze, abs=METRIC)
    assert metrics.collisions(run) == (graze < -COLLISION)


def test_corners_of_linear_samples_are_seen() -> None:
    """The closest approach is at a stamp that lies between two steps."""
    zigzag = Obstacle(
        disc_or_ball(0.5, 2), Sampled([0.0, 0.37, 0.61, 2.0], [(0, 9), (0, 1.3), (3, 9), (3, 9)], "linear"), "zigzag"
    )
    run = driven([(0, 0)] * 2, obstacles=(zigzag,))
    (closest,) = closest_approaches(run)
    assert closest.clearance == pytest.approx(0.3, abs=1e-9)
    assert closest.time == pytest.approx(0.37, abs=1e-9)


def test_only_the_time_together_counts() -> None:
    """Before the obstacle exists, after it has gone, and for one that touches the end of the run."""
    run = driven([(0, 0)] * 4, speed=(1, 0), start=10.0)

    def closest(first: float, last: float):
        there = Obstacle(disc_or_ball(0.5, 2), Sampled([first, last], [(0.0, 2.0)] * 2), "there")
        return closest_approaches(replace(run, obstacles=(there,)))[0]

    assert closest(0.0, 9.9) == closest(14.1, 20.0) == (math.inf, math.inf)
    assert closest(0.0, 10.0) == pytest.approx((1.0, 10.0))
    assert closest(14.0, 20.0) == pytest.approx((math.hypot(4.0, 2.0) - 1.0, 14.0))
    assert closest(11.5, 20.0) == pytest.approx((math.hypot(1.5, 2.0) - 1.0, 11.5))
    assert closest(0.0, 20.0) == pytest.approx((1.0, 10.0))


def test_positions_between_steps_are_on_the_parabola() -> None:
    run = driven([(2, 0), (0, -2)], speed=(0, 1), dt=1.0, start=5.0)
    found = positions_at(run, 0, np.array([5.0, 5.5, 6.0, 6.5, 7.0]))
    np.testing.assert_allclose(found, [(0, 0), (0.25, 0.5), (1, 1), (2, 1.25), (3, 1)])


def test_metrics_share_nothing_with_the_deciding_kernels() -> None:
    """Contact and metrics work where no kernel can even be imported."""
    code = (
        "import sys\n"
        "import slalom.kernels\n"
        "sys.modules['slalom.kernels.jit'] = None\n"
        "sys.modules['numba'] = None\n"
        "from slalom.sim import Recording\n"
        "from slalom.sim.measure.metrics import METRICS\n"
        "run = Recording.load(sys.argv[1])\n"
        "print(METRICS['min_clearance'](run), len([metric(run) for metric in METRICS.values()]))\n"
    )
    import tempfile

    with tempfile.NamedTemporaryFile(suffix=".h5") as file:
        STRAIGHT.save(file.name)
        result = subprocess.run([sys.executable, "-c", code, file.name], check=True, capture_output=True, text=True)
    least, count = result.stdout.split()
    assert float(least) == metrics.min_clearance(STRAIGHT)
    assert int(count) == len(METRICS)


def pair(first: Recording, second: Recording, names: tuple[str, ...] = ()) -> Recording:
    """The recording of two robots with equal times."""
    rows = ("positions", "velocities", "accelerations", "controls", "decision_times")
    both = zip(first.outcomes, second.outcomes)
    return replace(
        first,
        **{name: np.concatenate([getattr(first, name), getattr(second, name)], axis=1) for name in rows},
        responses=RecordedResponses.of([2 * row for row in first.responses.rows], 2),
        outcomes=tuple((*a, *b) for a, b in both),
        shapes=first.shapes + second.shapes,
        limits=first.limits + second.limits,
        goals=first.goals + second.goals,
        arrived=np.concatenate([first.arrived, second.arrived]),
        names=names or ("left", "right"),
    )


def test_metrics_of_all_robots_count_every_robot() -> None:
    """A collision between two robots, one that hits an obstacle, and one that does not arrive count in the whole."""
    other = driven([(0, 0)] * 4, position=(1.5, 2.0), radius=0.25, goal=Goal(Stationary((9.0, 2.0)), 0.5))
    run = pair(STRAIGHT, other)
    assert metrics.min_clearance(run) == pytest.approx(-1.25)  # the second robot stands in the rock
    assert metrics.collisions(run) == 1.0
    assert (metrics.arrived(run), metrics.success(run)) == (0.0, 0.0)
    assert metrics.success(run.only("left")) == 1.0
    through = pair(
        STRAIGHT, driven([(0, 0)] * 4, position=(1.5, 0.0), goal=Goal(Stationary((1.5, 0.0)), 0.5, stop=True))
    )
    assert (metrics.collisions(through), metrics.min_clearance(through)) == (1.0, -1.0)
    assert metrics.summary(through)["collisions"] == 1
    assert metrics.spl(through, "left") == 0.0  # it collides with the other robot


OF_OTHERS = ("clearing_distance", "min_time_to_collision")
"""Metrics of one robot that count other robots."""


@pytest.mark.parametrize("name", [name for name, f in METRICS.items() if "robot" in inspect.signature(f).parameters])
def test_a_metric_of_one_robot_of_a_fleet_needs_its_name(name: str) -> None:
    run = pair(STRAIGHT, driven([(0, 0)] * 4, position=(0.0, 50.0), speed=(1.0, 0.0)))
    expected = METRICS[name](STRAIGHT)
    if name not in OF_OTHERS:
        assert METRICS[name](run, "left") == METRICS[name](run, 0) == expected
    with pytest.raises(
        InvalidInput, match=r"robot: expected the name or number of one of 2 robots \('left', 'right'\)"
    ):
        METRICS[name](run)
    for wrong in ("middle", 2, -1):
        with pytest.raises(InvalidInput, match=f"found {wrong!r}"):
            METRICS[name](run, wrong)


def test_recordings_keep_the_names_of_robots(tmp_path) -> None:
    run = pair(STRAIGHT, CORNER if len(CORNER.times) == len(STRAIGHT.times) else STRAIGHT, ("ann", "bob"))
    run.save(tmp_path / "run.h5")
    assert Recording.load(tmp_path / "run.h5").names == ("ann", "bob")
    assert pair(STRAIGHT, STRAIGHT, ()).only("right").names == ("right",)
    assert replace(STRAIGHT, names=()).names == ("robot 0",)


@pytest.mark.parametrize(("name", "settings", "method"), [("ring", {"robots": 8.0, "radius": 4.0}, "vo")])
def test_clearances_between_robots_are_those_of_dense_samples(
    name: str, settings: dict[str, float], method: str
) -> None:
    run = simulate(build(name, {**settings, "duration": 8.0}, seed=3), METHODS[method], seed=3)
    times = np.linspace(run.times[0], run.times[-1], 20001)
    paths = [positions_at(run, k, times) for k in range(8)]
    found = between_robots(run)
    for i in range(8):
        for j in range(i):
            radii = run.shapes[i].bounding_radius + run.shapes[j].bounding_radius
            sampled = float(np.linalg.norm(paths[i] - paths[j], axis=1).min()) - radii
            assert found[i, j] == found[j, i] <= sampled + METRIC
            assert found[i, j] >= sampled - 1e-3


MOTION = (
    *("max_acceleration", "mean_acceleration", "max_speed", "mean_speed", "max_jerk", "mean_jerk", "adjustments"),
    *("adjustment_rate", "stalled_time", "failures_to_progress", "path_length", "sign_reversals"),
    *("heading_change", "heading_variation", "changed_choices", "space_compliance", "efficacy", "extra_time"),
)


@pytest.mark.parametrize("method", ["nao", "nao_shared", "orca_limited"])
def test_metrics_of_a_robot_end_where_it_leaves(method: str) -> None:
    """Beside one that drives on, the first has the metrics that it has alone, and no step exceeds a limit."""
    robots = tuple(
        Robot(Disc(0.3), Limits(2.0, 1.5), State((0.0, y), (0.0, 0.0)), Goal(Stationary((x, y)), 0.3), name)
        for name, x, y in (("short", 5.0, 0.0), ("long", 12.0, 30.0))
    )
    both = simulate(Scenario("leaves", robots, duration=20.0, guided=False), method)
    alone = simulate(Scenario("leaves", robots[:1], duration=20.0, guided=False), method)
    assert both.arrived[0] == alone.arrived[0] == both.only("short").times[-1] < both.arrived[1]
    for name in MOTION:
        assert METRICS[name](both, "short") == pytest.approx(METRICS[name](alone), abs=1e-9), name
    assert np.linalg.norm(both.accelerations, axis=2).max() <= 1.5 + 1e-9
    table = columns_of(both)
    own = table["robot"] == "short"
    assert table["time"][own].tolist() == alone.times.tolist()
    assert np.isnan(table["ax"][own]).tolist() == [False] * len(alone.accelerations) + [True]
