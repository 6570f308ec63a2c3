"""`Fleet`: robots that decide together in a loop that belongs to the caller."""

import copy
import inspect
import pickle
from dataclasses import replace

import numpy as np
import pytest
from draws import draws_of
from fleets import fleet_of, swap
from parts import disc_or_ball

from slalom import (
    METHODS,
    Acceleration,
    Capsule,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    ExpectedLoss,
    Fleet,
    FleetDecision,
    Goal,
    HeadingCone,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    ObstacleWindow,
    Outcome,
    PathGoal,
    Polyline,
    Rectangle,
    State,
    Stationary,
    Tracks,
    Union,
    method,
    select_many,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ADMISSIBLE
from slalom.decision.settings import FleetSettings
from slalom.sim import Robot, Scenario, gallery, simulate
from slalom.sim.measure.closest_approach import METRIC
from slalom.sim.run.states import integrate

DT = 0.1
ONE = np.array([(0.0, 0.0)]), np.array([(5.0, 1.0)])


def drive(fleet: Fleet, positions: np.ndarray, targets: np.ndarray, steps: int, begin: int = 0, velocities=None):
    """Positions (steps + 1, n, 2) of robots that follow the accelerations exactly, and the last velocities."""
    velocities, path = np.zeros_like(positions) if velocities is None else velocities, [positions]
    for k in range(begin, begin + steps):
        decided = fleet.step(k * DT, positions, velocities, targets)
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        path.append(positions)
    return np.array(path), velocities


def least_distance(path: np.ndarray) -> float:
    """Between the centres of two robots, at the steps."""
    apart = np.linalg.norm(path[:, :, None] - path[:, None], axis=-1)
    return float(apart[:, ~np.eye(path.shape[1], dtype=bool)].min())


CIRCLE = {"robots": 6.0, "radius": 5.0, "robot_radius": 0.5, "duration": 6.0}
LOOPS = [
    *((name, "circle", {**CIRCLE, "guided": guided}) for name in ("nao", "nao_shared", "rvo") for guided in (0.0, 1.0)),
    ("nao_shared", "doorway", {"robots": 4.0, "duration": 12.0}),
    ("nao", "random_goals", {"robots": 20.0, "side": 40.0, "duration": 8.0}),
]


@pytest.mark.parametrize(("name", "place", "settings"), LOOPS)
def test_a_loop_of_the_caller_is_the_run_of_the_simulator(name: str, place: str, settings: dict[str, float]) -> None:
    """With and without guidance, to the bit."""
    scenario = gallery.build(place, settings, seed=4)
    run = simulate(scenario, METHODS[name])
    fleet = fleet_of(scenario, METHODS[name])
    positions = np.array([robot.state.position for robot in scenario.robots])
    velocities = np.array([robot.state.velocity for robot in scenario.robots])
    targets = np.array([robot.goal.position(0.0) for robot in scenario.robots])
    tolerance = scenario.robots[0].goal.tolerance
    for k in range(len(run.times) - 1):
        np.testing.assert_array_equal(positions, run.positions[k])
        decided = fleet.step(float(run.times[k]), positions, velocities, targets, tolerances=tolerance)
        assert [outcome.name for outcome in decided.outcomes] == list(run.outcomes[k])
        positions, velocities = integrate(positions, velocities, decided.accelerations, scenario.dt)


@pytest.mark.parametrize("guided", [False, True])
def test_goals_may_move_and_be_paths(guided: bool) -> None:
    """In a loop of the caller as in the simulator, to the bit; goals that are made anew each time lead as well."""
    limits = Limits(2.0, 2.0)
    goals = (
        Goal(ConstantVelocity((6.0, 0.0), (0.3, 0.1)), 0.3),
        PathGoal([(5.0, 5.0), (0.0, -1.0), (-5.0, -5.0)]),
        Goal(Stationary((0.5, 6.0)), 0.2),
    )
    starts = ((-5.0, 0.0), (5.0, 5.0), (0.0, -6.0))
    robots = tuple(
        Robot(Disc(0.4), limits, State(start, (0.0, 0.0)), goal, str(k))
        for k, (start, goal) in enumerate(zip(starts, goals))
    )
    scenario = Scenario("goals", robots, duration=4.0, guided=guided)
    run = simulate(scenario, "nao")
    for anew in (False, True):
        fleet, positions, velocities = fleet_of(scenario, METHODS["nao"]), np.array(starts), np.zeros((3, 2))
        for k in range(len(run.accelerations)):
            given = [copy.copy(goal) if anew and k % 7 == 3 else goal for goal in goals]
            found = fleet.step(k * scenario.dt, positions, velocities, goals=given)
            positions, velocities = integrate(positions, velocities, found.accelerations, scenario.dt)
            np.testing.assert_allclose(positions, run.positions[k + 1], atol=1e-6 if anew else 0.0)


@pytest.mark.parametrize("name", ["nao", "nao_shared"])
def test_robots_of_several_shapes_swap_places(name: str) -> None:
    """Without a collision; with `nao` all arrive, with shared manoeuvres four need guidance to pass each other."""
    shapes = [Disc(0.4), Rectangle(0.9, 0.5), Disc(0.3), Rectangle(0.9, 0.5)]
    fleet = Fleet(METHODS[name], shapes, Limits(1.5, 2.0))
    path, velocities = drive(fleet, *swap(4), 140)
    assert least_distance(path[:, [0, 2]]) > 0.7 - METRIC
    if name == "nao_shared":
        return
    assert np.linalg.norm(path[-1] - swap(4)[1], axis=1).max() < 0.5
    assert np.linalg.norm(velocities, axis=1).max() < 0.5


COPIES = {"pickled": lambda fleet: pickle.loads(pickle.dumps(fleet)), "copied": copy.copy, "deep": copy.deepcopy}


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("guided", [False, True])
def test_a_copy_of_a_fleet_goes_on_equal_to_the_bit(guided: bool, how: str) -> None:
    fleet = Fleet(METHODS["nao"], Disc(0.5), Limits(1.5, 2.0), robots=6, guided=guided)
    starts, targets = swap(6)
    first, velocities = drive(fleet, starts, targets, 20)
    saved = COPIES[how](fleet)
    one, _ = drive(fleet, first[-1], targets, 20, 20, velocities)
    other, _ = drive(saved, first[-1], targets, 20, 20, velocities)
    np.testing.assert_array_equal(one, other)


def test_a_guided_robot_alone_has_its_target() -> None:
    """The path of an unguided one, to the bit."""
    runs = [
        drive(Fleet(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0), robots=1, guided=guided), *ONE, 60)[0]
        for guided in (False, True)
    ]
    np.testing.assert_array_equal(*runs)


def test_plans_agree() -> None:
    """Velocities and positions at the end of the period are those of the accelerations."""
    fleet = Fleet(METHODS["nao"], Disc(0.5), Limits(1.5, 2.0), robots=4)
    starts, targets = swap(4)
    velocities = np.zeros_like(starts)
    for k in range(20):
        decided = fleet.step(k * DT, starts, velocities, targets)
        assert isinstance(decided, FleetDecision)
        positions, velocities = integrate(starts, velocities, decided.accelerations, DT)
        np.testing.assert_allclose(decided.velocities, velocities, atol=1e-9)
        np.testing.assert_allclose(decided.positions, positions, atol=1e-9)
        starts = positions


def test_robots_follow_velocities_around_each_other_and_an_obstacle() -> None:
    limits = Limits(2.0, 2.0)
    rock = Obstacle(Disc(1.0), Stationary((0.0, 0.3)), "rock")
    fleet = Fleet(METHODS["nao"], Disc(0.4), limits, robots=2, obstacles=[rock])
    positions, velocities = np.array([(-6.0, 0.0), (6.0, -0.2)]), np.zeros((2, 2))
    wanted = np.array([(1.0, 0.0), (-1.0, 0.0)])
    for k in range(150):
        decided = fleet.step(k * DT, positions, velocities, desired_velocities=wanted)
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        assert np.linalg.norm(positions - (0.0, 0.3), axis=1).min() > 1.4 - METRIC
        assert np.linalg.norm(positions[0] - positions[1]) > 0.8 - METRIC
        assert np.linalg.norm(velocities, axis=1).max() <= limits.max_speed * (1.0 + 10.0 * ADMISSIBLE)
    assert positions[0, 0] > 5.0
    assert positions[1, 0] < -5.0
    np.testing.assert_allclose(velocities, wanted, atol=0.05)


def test_bounds_are_along_the_headings() -> None:
    """A robot at rest leaves within its cone of headings; without a heading the cone bounds nothing at rest."""
    limits = Limits(1.0, 2.0, bounds=(HeadingCone(0.3),))
    for heading, least in ((0.5 * np.pi, np.cos(0.3)), (None, -1.0)):
        fleet = Fleet(METHODS["nao"], Disc(0.4), limits, robots=1)
        headings = None if heading is None else [heading]
        decided = fleet.step(0.0, [(0.0, 0.0)], [(0.0, 0.0)], desired_velocities=[(0.5, 0.5)], headings=headings)
        speed = float(np.linalg.norm(decided.velocities[0]))
        assert speed > 0.05
        assert decided.velocities[0, 1] >= (least - ADMISSIBLE) * speed
        assert (decided.velocities[0, 0] < 0.9 * decided.velocities[0, 1]) == (heading is not None)


@pytest.mark.parametrize("shape", [Rectangle(0.8, 0.5), Capsule((0, 0), (1, 0), 0.2)])
def test_no_entry_drops_a_heading_by_which_a_shape_would_turn(shape: object) -> None:
    """Every decision about a shape that is not round refuses it; a disc, and a heading of 0, are taken."""
    robot = Navigator(method("nao"), shape, Limits(1.0, 1.0))
    wall = Obstacle(Polyline([(-3, 0.45), (3, 0.45)]), Stationary((0, 0)))
    goal, window = Goal(Stationary((2, 0)), 0.1, stop=True), ObstacleWindow([wall], 0.0, 4.0)
    fleet = Fleet(method("nao"), shape, Limits(1.0, 1.0), robots=1)

    def entries(state: State) -> list:
        still = np.zeros((1, 2))
        return [
            lambda: robot.decide(state, [wall], goal),
            lambda: LookAhead(robot).decide(state, [wall], goal),
            lambda: ExpectedLoss(LookAhead(robot)).decide(state, [wall], goal),
            lambda: robot.fall_back(state, [wall], goal),
            lambda: ControlObstacle(Acceleration(), state, window, shape),
            lambda: select_many(still, [state], Acceleration(), Limits(1.0, 1.0), window, shape),
            lambda: fleet.step(0.0, still, still, still, headings=[state.heading]),
            lambda: Robot(shape, Limits(1.0, 1.0), state, goal),
        ]

    for entry in entries(State((0, 0), (0, 0), heading=0.785)):
        with pytest.raises(
            InvalidInput, match=r"heading.*: expected none for a \w+, whose axes are those of the world"
        ):
            entry()
    for entry in entries(State((0, 0), (0, 0), heading=0.0)):
        entry()
    assert replace(robot, robot=Disc(0.3)).decide(State((0, -2), (0, 0), heading=0.785), [wall], goal).safe


def test_robots_join_and_leave() -> None:
    """A robot outside the scene is not met, and has no decision; it is met from the step at which it joins."""
    fleet = Fleet(METHODS["nao_shared"], Disc(0.5), Limits(1.5, 2.0), robots=2)
    positions, velocities = np.array([(-4.0, 0.0), (0.0, 0.0)]), np.zeros((2, 2))
    targets = np.array([(4.0, 0.0), (0.0, 0.0)])
    present = np.array([True, False])
    decided = fleet.step(0.0, positions, velocities, targets, present=present)
    assert decided.outcomes[0] in (Outcome.CLEAR, Outcome.CONSTRAINED)
    assert decided.outcomes[1] is None
    assert not decided.accelerations[1].any()
    met = []
    for k in range(1, 120):
        present[1] = k > 10
        decided = fleet.step(k * DT, positions, velocities, targets, present=present)
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        met.append(np.linalg.norm(positions[0] - positions[1]))
    assert min(met) > 1.0 - METRIC
    assert np.linalg.norm(positions[0] - targets[0]) < 0.5


def test_a_robot_among_moving_obstacles_has_the_bits_of_the_navigator() -> None:
    """A fleet of one decides as `Navigator` does."""
    car = Obstacle(Disc(1.0), ConstantVelocity((8.0, 0.4), (-1.0, 0.0)), "car")
    scenario = gallery.build("head_on", {"duration": 3.0})
    robot = scenario.robots[0]
    run = simulate(replace(scenario, obstacles=(car,)), METHODS["ao"])
    chosen = replace(METHODS["ao"], responses_among=None)
    fleet = Fleet(chosen, robot.shape, robot.limits, robots=1, obstacles=[car], horizon=scenario.horizon, detours=())
    fleet.table.each["margin"] = scenario.margin
    positions, velocities = robot.state.position[None], robot.state.velocity[None]
    for k in range(len(run.times) - 1):
        np.testing.assert_allclose(positions, run.positions[k], atol=1e-9)
        target = robot.goal.position(0.0)[None]
        decided = fleet.step(
            float(run.times[k]), positions, velocities, target, tolerances=robot.goal.tolerance, stop=robot.goal.stop
        )
        positions, velocities = integrate(positions, velocities, decided.accelerations, scenario.dt)


@pytest.mark.parametrize("name", ["nao", "rvo", "vo"])
@pytest.mark.parametrize("shape", draws_of({"rectangle": Rectangle(0.7, 0.4), "disc": Disc(0.3)}, "rectangle"))
@pytest.mark.parametrize("walled", [False, True], ids=["open", "walled"])
def test_navigators_that_observe_the_others_are_the_fleet(name: str, shape: Disc | Rectangle, walled: bool) -> None:
    """One policy: each robot decides among observed discs as a fleet does, with share, margin, regain and stops."""
    room = Polyline([(4.8, -4.8), (4.8, 4.8), (-4.8, 4.8), (-4.8, -4.8)], 0.05)
    walls = [Obstacle(room, Stationary((0.0, 0.0)))] if walled else []
    starts, targets = swap(6, 4.0)
    discs, limits = Disc(0.3), Limits(1.5, 2.0)
    fleet = Fleet(METHODS[name], [shape, *[discs] * 5], limits, obstacles=walls, period=DT, detours=(), guided=False)
    navigator, previous, others = Navigator(METHODS[name], shape, limits, period=DT), None, np.arange(1, 6)
    positions, velocities, applied = starts, np.zeros_like(starts), np.zeros_like(starts)
    for k in range(90):
        now = k * DT
        decided = fleet.step(now, positions, velocities, targets)
        tracks = Tracks(positions[others], velocities[others], 0.3, now, accelerations=applied[others])
        state, goal = State(positions[0], velocities[0], applied[0]), Goal(Stationary(targets[0]), 0.2, stop=True)
        previous = navigator.decide(state, walls, goal, robots=tracks, now=now, previous=previous)
        assert previous.outcome is decided.outcomes[0]
        np.testing.assert_allclose(previous.manoeuvre.mean_acceleration(now, DT), decided.accelerations[0], atol=1e-6)
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        applied = decided.accelerations


def test_a_robot_inside_another_leaves_it() -> None:
    """The fall-back knows the other robots too."""
    navigator = Navigator(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0))
    over = Tracks([(0.2, 0.0)], [(0.0, 0.0)], 0.3)
    decision = navigator.decide(State((0.0, 0.0), (0.0, 0.0)), [], Goal(Stationary((9.0, 0.0)), 0.5), robots=over)
    assert decision.outcome is Outcome.ESCAPING
    assert decision.manoeuvre.mean_acceleration(0.0, 0.1)[0] < -1.0


def test_a_fleet_avoids_tracks_that_do_not_avoid_it() -> None:
    """People who walk through it, observed anew at each step."""
    starts, targets = swap(6)
    fleet = Fleet(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0), robots=6, period=DT)
    positions, velocities, nearest = starts, np.zeros_like(starts), np.inf
    people, walks = np.array([(-6.0, 0.6), (6.0, -1.0)]), np.array([(1.0, 0.0), (-1.0, 0.0)])
    for k in range(150):
        seen = people + k * DT * walks
        decided = fleet.step(k * DT, positions, velocities, targets, others=Tracks(seen, walks, 0.4, k * DT))
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        apart = np.linalg.norm(positions[:, None] - (seen + DT * walks)[None], axis=-1)
        nearest = min(nearest, float(apart.min()))
    assert nearest >= 0.7
    assert np.linalg.norm(positions - targets, axis=1).max() < 0.5


def test_walls_one_by_one_and_together_lead_to_the_same_motion() -> None:
    """A ball about each of them, far larger than the wall, once made every motion cost more than none."""
    ends = [
        ((-1.19, -0.28), (-1.19, 4.21)),
        ((2.21, 6.4), (2.21, 9.2)),
        ((-7.9, -7.65), (-3.5, -7.65)),
        ((0.55, -6.81), (0.55, -4.41)),
        ((8.0, -2.76), (13.9, -2.76)),
        ((-11.07, 4.85), (-11.07, 10.4)),
    ]
    lines = [Polyline(end, radius=0.05) for end in ends]
    still, found = Stationary((0.0, 0.0)), []
    for walls in ([Obstacle(line, still) for line in lines], [Obstacle(Union(tuple(lines)), still)]):
        fleet = Fleet(METHODS["nao_shared"], Disc(0.29), Limits(1.31, 2.96), robots=1, period=0.1)
        position, velocity = np.array([[-0.187, 4.855]]), np.zeros((1, 2))
        for k in range(80):
            decided = fleet.step(0.1 * k, position, velocity, np.array([[-0.7, -0.43]]), others=walls)
            position, velocity = integrate(position, velocity, decided.accelerations, 0.1)
        found.append(position[0])
    np.testing.assert_array_equal(*found)
    assert np.linalg.norm(found[0] - (-0.7, -0.43)) < 0.2


# The defaults of a fleet are those of the simulator.


def test_a_fleet_has_the_defaults_of_a_scenario() -> None:
    """Every setting that both have; the period of decisions is dt, and None is the guidance of the simulator."""
    given = {name: one.default for name, one in inspect.signature(Fleet).parameters.items()}
    navigator = Fleet(METHODS["nao"], Disc(0.3), Limits(1.5, 1.0), robots=2).navigator
    given |= {name: getattr(navigator, name) for name in FleetSettings.__annotations__}
    names = {"period": "dt", "observation_delay": "sight_delay"}
    names |= {"observation_noise": "sight_noise"}
    fields = Scenario.__dataclass_fields__
    same = ["horizon", "margin", "holds", "patience", *names]
    assert {name: given[name] for name in same} == {name: fields[names.get(name, name)].default for name in same}
    assert given["guided"] is None
    assert fields["guided"].default is True
    assert given["detours"] == gallery.build("circle").navigator(METHODS["nao"]).detours


BEHIND = Obstacle(Polyline([(0, -3), (0, 3)], 0.05), Stationary((0.0, 0.0)), "wall")
OUT_OF_PLACE = [(-4.0, 0.0), (4.0, 0.5)]


def first_targets(**settings) -> np.ndarray:
    """The targets that two robots have in their first step, with goals behind a wall."""
    fleet = Fleet(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0), robots=2, obstacles=[BEHIND], **settings)
    fleet.step(0.0, OUT_OF_PLACE, np.zeros((2, 2)), -np.array(OUT_OF_PLACE))
    return fleet.table.each["target"][:, :2]


def test_several_robots_in_one_world_are_guided_unless_they_are_not_to_be() -> None:
    plain, targets = -np.array(OUT_OF_PLACE), first_targets()
    np.testing.assert_array_equal(targets, first_targets(guided=True))
    assert np.linalg.norm(targets - plain, axis=1).max() > 1.0
    np.testing.assert_array_equal(first_targets(guided=False), plain)
    np.testing.assert_array_equal(first_targets(worlds=[0, 1]), plain)


def test_without_targets_or_a_plane_a_fleet_is_plain_by_default() -> None:
    """To the bit, as with `guided=False`; a fleet goes on guided where it has targets again."""
    starts, rest, wanted = np.array(OUT_OF_PLACE), np.zeros((2, 2)), -0.2 * np.array(OUT_OF_PLACE)
    routes = [PathGoal([start, (0.0, 5.0), -start], 1.0, 0.3) for start in starts]
    for given in ({"desired_velocities": wanted}, {"paths": routes}):
        fleets = [
            Fleet(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0), robots=2, obstacles=[BEHIND], **settings)
            for settings in ({}, {"guided": False})
        ]
        made = [fleet.step(0.0, starts, rest, **given) for fleet in fleets]
        np.testing.assert_array_equal(made[0].accelerations, made[1].accelerations)
        fleets[0].step(0.1, starts, rest, -starts)
        np.testing.assert_array_equal(fleets[0].table.each["target"][:, :2], first_targets())
    in_space = np.array([(-4.0, 0.0, 0.0), (4.0, 0.1, 0.0)])
    made = [
        Fleet(METHODS["nao"], disc_or_ball(0.3, 3), Limits(1.5, 2.0), robots=2, **settings).step(
            0.0, in_space, 0.0 * in_space, -in_space
        )
        for settings in ({}, {"guided": False})
    ]
    np.testing.assert_array_equal(made[0].accelerations, made[1].accelerations)
