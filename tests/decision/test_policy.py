"""The one policy: its choice against a slow search over all responses, and the same for every shape."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws

from slalom import (
    METHODS,
    Arrive,
    Capsule,
    Circular,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    FollowAcceleration,
    FollowVelocity,
    Friction,
    GaussianError,
    Goal,
    HalfSpace,
    KeepAcceleration,
    Limits,
    Mix,
    MostClearance,
    Navigator,
    Objective,
    Obstacle,
    Outcome,
    PathGoal,
    Polygon,
    Polyline,
    Rectangle,
    Shape,
    State,
    Stationary,
    Tracks,
    Union,
    select,
)
from slalom.base.tolerances import CONTACT_SLACK
from slalom.decision.objective import is_compiled, needs_goal, preferred_control
from slalom.kernels.decision.costs import COST_TIE
from slalom.kernels.decision.policy import CLEARANCE_STEPS, MIN_IMPROVEMENT
from slalom.model.manoeuvre import Manoeuvre
from slalom.sim import Scenario, gallery, simulate
from slalom.sim.measure.closest_approach import between_robots


def a_scene(seed: int) -> tuple[Navigator, State, list[Obstacle], Goal]:
    """A robot on the move among discs, walls and turning bodies, some of them uncertain; goals rest, move, or stop."""
    rng = np.random.default_rng([seed, 31])
    name = ("vo", "nlvo", "avo", "ao", "nao", "nao_shared")[seed % 6]
    shape: Shape = (Disc(0.4), Rectangle(1.0, 0.6, 0.1), Union((Disc(0.3), Capsule((0.0, 0.0), (0.4, 0.1), 0.2))))[
        int(rng.integers(3))
    ]
    obstacles = []
    for k in range(int(rng.integers(2, 9))):
        angle, far = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(3.0, 8.0)
        place = far * np.array([np.cos(angle), np.sin(angle)])
        body: Shape = (Disc(0.6), Rectangle(1.6, 0.7), Polyline([(-1.0, 0.0), (1.0, 0.4), (1.5, 1.5)], 0.05))[k % 3]
        if body.bounding_radius + shape.bounding_radius > far - 0.3:
            continue
        path = (ConstantVelocity(place, rng.normal(size=2)), Circular(place, 0.8, 1.0, angle))[int(rng.integers(2))]
        unsure = GaussianError(0.02, 0.05, probability=0.1) if k % 4 == 3 else None
        obstacles.append(Obstacle(body, path, f"{k}", "motion" if k % 2 else 0.3, unsure))
    target = rng.uniform(4.0, 9.0, 2) * np.sign(rng.normal(size=2))
    where = Stationary(target) if rng.random() < 0.7 else ConstantVelocity(target, 0.5 * rng.normal(size=2))
    goal = Goal(where, 0.3, stop=bool(rng.random() < 0.5))
    bounds = (Friction(2.0, 2.5, 1.5),) if rng.random() < 0.3 else ()
    method = replace(METHODS[name], shared=False)
    robot = Navigator(method, shape, Limits(2.0, 2.5, bounds=bounds), horizon=4.0, holds=(0.3, 1.0))
    return robot, State(np.zeros(2), rng.uniform(-0.8, 0.8, 2)), obstacles, goal


def choices_of_all_responses(
    robot: Navigator, state: State, obstacles: list[Obstacle], goal: Goal, objective: Objective
) -> dict[str, tuple[float, np.ndarray]]:
    """Cost and control of the exact choice of every response that has one, in plain Python."""
    table, found = robot.predict(obstacles, state, 0.0), {}
    for response in robot.method.responses(robot.limits, robot.period, robot.holds):
        admissible = robot.limits.admissible(response, state, robot.horizon)
        s = robot.situation(response, state, goal, 0.0)
        near = ControlObstacle(response, state, table, robot.robot).initial_clearances
        margins = np.clip(near - CONTACT_SLACK, 0.0, robot.margin)
        choice = select(
            preferred_control(objective.aims(s)),
            admissible,
            ControlObstacle(response, state, table, robot.robot, margins),
        )
        if choice.control is not None:
            manoeuvre = Manoeuvre(response, state, choice.control, 0.0)
            until = max(robot.period, s.step)
            found[repr(response)] = objective.cost(manoeuvre, s, until), choice.control
    return found


class ArriveInPython(Arrive):
    """`Arrive` as a class of a user, which the kernels call."""


OBJECTIVES = {
    "arrive": Arrive(),
    "follow_velocity": FollowVelocity((0.8, -0.9)),
    "follow_acceleration": FollowAcceleration((1.1, 0.7)),
    "keep_acceleration": KeepAcceleration(),
    "mixed": Mix(((2.0, Arrive()), (0.0, KeepAcceleration()), (1.0, Mix(((1.0, FollowVelocity((0.8, -0.9))),))))),
    "in_python": ArriveInPython(),
    "partly_in_python": Mix(((2.0, ArriveInPython()), (1.0, FollowVelocity((0.8, -0.9))))),
}


@pytest.mark.parametrize("objective", OBJECTIVES.values(), ids=OBJECTIVES)
@pytest.mark.parametrize("seed", draws(range(160), 20))
def test_the_decision_is_the_cheapest_exact_choice(seed: int, objective: Objective) -> None:
    """Its control is that of the exact choice, and no response costs less by more than the stated improvement."""
    robot, state, obstacles, goal = a_scene(seed)
    expected = choices_of_all_responses(robot, state, obstacles, goal, objective)
    decision = robot.decide(state, obstacles, goal if needs_goal(objective) else None, objective=objective)
    if not expected:
        assert decision.outcome not in (Outcome.CLEAR, Outcome.CONSTRAINED)
        return
    assert decision.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED)
    least = min(each for each, _ in expected.values())
    s = robot.situation(decision.manoeuvre.response, state, goal, 0.0)
    if not is_compiled(objective):
        # It is asked for all exact choices, and for more candidates.
        assert objective.cost(decision.manoeuvre, s, max(robot.period, s.step)) <= least + 2.0 * COST_TIE + 1e-4
        return
    cost, control = expected[repr(decision.manoeuvre.response)]
    # The lag of avo and a moving goal are tabulated with other knots.
    assert decision.manoeuvre.control == pytest.approx(control, abs=1e-3 if robot.method.name == "avo" else 2e-4)
    assert cost <= least + MIN_IMPROVEMENT * s.shortest + 2.0 * COST_TIE + 1e-4


@pytest.mark.parametrize("seed", draws(range(24), 8))
def test_most_clearance_is_the_largest_that_a_response_has(seed: int) -> None:
    """Of all controls of all responses none keeps noticeably more of the clearance, which is sought on a grid."""
    robot, state, obstacles, goal = a_scene(seed)
    enough = 1.5
    decision = robot.decide(state, obstacles, goal, objective=MostClearance(enough, Arrive()))
    assert (decision.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED)) == bool(
        choices_of_all_responses(robot, state, obstacles, goal, Arrive())
    )
    if decision.outcome not in (Outcome.CLEAR, Outcome.CONSTRAINED):
        return
    kept = robot.control_obstacle(decision.manoeuvre.response, robot.predict(obstacles, state, 0.0), state)
    assert kept.clearance(decision.manoeuvre.control) >= -CONTACT_SLACK
    step = enough / 2**CLEARANCE_STEPS
    for extra in np.arange(0.1, enough, 0.1):
        wider = replace(robot, margin=robot.margin + float(extra))
        free = choices_of_all_responses(wider, state, obstacles, goal, Arrive())
        around = wider.control_obstacle(decision.manoeuvre.response, wider.predict(obstacles, state, 0.0), state)
        if around.clearance(decision.manoeuvre.control) < -1e-6:
            # A little more than is kept is not free for any response.
            narrower = replace(robot, margin=robot.margin + float(extra) + step)
            assert not choices_of_all_responses(narrower, state, obstacles, goal, Arrive())
            return
        assert free


@pytest.mark.parametrize("objective", [ArriveInPython(), Mix(((1.0, Arrive()), (1.0, KeepAcceleration())))], ids=repr)
def test_every_objective_takes_robots_a_budget_and_a_path(objective: Objective) -> None:
    """And has the outcomes of the policy: a part of the margin, the latest collision, an interruption."""
    robot, state = Navigator(METHODS["nao"], Disc(0.4), Limits(2.0, 2.0)), State((0.0, 0.0), (2.0, 0.0))
    goal, seen = Goal(Stationary((9.0, 0.0)), 0.3), Tracks([(4.0, 0.3)], [(-1.0, 0.0)], 0.4)
    plain = robot.decide(state, [], goal, objective=objective, robots=seen)
    shared = Navigator(METHODS["rvo"], Disc(0.4), Limits(2.0, 2.0)).decide(state, [], goal, robots=seen)
    assert plain.outcome.safe
    assert shared.outcome.safe
    wall = Obstacle(Polyline([(1.2, -9.0), (1.2, 9.0)], 0.1), Stationary((0.0, 0.0)))
    assert robot.decide(state, [wall], goal, objective=objective).outcome is Outcome.DELAYED
    path = PathGoal([(0.0, 0.0), (0.0, 5.0)], stop=False)
    assert robot.decide(State((0.0, 0.0), (0.0, 0.0)), [], path, objective=objective).manoeuvre.control[1] > 1.0
    near = Obstacle(Disc(0.5), ConstantVelocity((3.0, 0.5), (-1.0, 0.0)))
    first = robot.decide(State((0.0, 0.0), (1.0, 0.0)), [near], goal, objective=objective)
    moved = State(first.manoeuvre.position(0.1), first.manoeuvre.velocity(0.1), first.manoeuvre.acceleration(0.1))
    other = robot.decide(
        moved, [near], Goal(Stationary((0.0, 9.0)), 0.3), now=0.1, previous=first, objective=objective, budget=0.0
    )
    assert other.outcome in (Outcome.INTERRUPTED, Outcome.KEPT)


@pytest.mark.parametrize(
    "objective",
    draws([MostClearance(0.5, Arrive()), Mix(((1.0, Arrive()), (0.2, KeepAcceleration()))), ArriveInPython()], 2),
    ids=repr,
)
def test_detours_are_considered_for_every_objective(objective: Objective) -> None:
    """A robot that enters a gap between discs, which is too narrow, goes another way with them."""
    row = [Obstacle(Disc(1.2), Stationary((4.0, y))) for y in (0.0, 2.2, -2.2)]
    goal, ways = Goal(Stationary((8.0, 0.0)), 0.3, stop=True), []
    for detours in ((), (1.0, -1.0, 1.5, -1.5)):
        robot = Navigator(METHODS["nao"], Disc(0.4), Limits(1.5, 1.0), objective=objective, detours=detours)
        place, previous, places = State((0.0, 0.0), (0.0, 0.0)), None, []
        for step in range(100):
            now, then = 0.1 * step, 0.1 * (step + 1)
            previous = robot.decide(place, row, goal, now=now, previous=previous)
            path = previous.manoeuvre
            place = State(path.position(then), path.velocity(then), path.acceleration(then))
            places.append(place.position)
        ways.append(np.array(places))
    assert np.abs(ways[1] - ways[0]).max() > 0.05


def with_shape(scenario: Scenario, shape: Shape) -> Scenario:
    return replace(scenario, robots=tuple(replace(robot, shape=shape) for robot in scenario.robots))


@pytest.mark.parametrize("name", ["nao", "nao_shared", "rvo", "vo", "ao"])
def test_a_disc_and_a_union_of_one_disc_are_one_shape(name: str) -> None:
    scenario = gallery.build("circle", {"robots": 6, "radius": 6.0, "robot_radius": 0.5, "duration": 6.0}, seed=2)
    runs = [simulate(with_shape(scenario, shape), METHODS[name]) for shape in (Disc(0.5), Union((Disc(0.5),)))]
    assert runs[0].outcomes == runs[1].outcomes
    np.testing.assert_array_equal(runs[0].positions, runs[1].positions)
    assert "CONSTRAINED" in {outcome for row in runs[0].outcomes for outcome in row}


def regular(corners: int, radius: float) -> Polygon:
    """The regular polygon in a circle of that radius [m]."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    return Polygon(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))


DRIVEN = [pytest.param(0, "nao", 2), *(pytest.param(seed, name, 3) for seed in range(20) for name in ("nao", "rvo"))]
"""Seeds, methods and numbers of robots."""


@pytest.mark.parametrize(("seed", "name", "robots"), draws(DRIVEN))
def test_a_polygon_of_many_corners_drives_as_the_disc(seed: int, name: str, robots: int) -> None:
    """Equal arrivals and collisions; the first choices are within the polygon's error."""
    settings = {"robots": robots, "radius": 4.0, "robot_radius": 0.5, "duration": 40.0}
    scenario = gallery.build("circle", settings, seed=seed)
    disc, polygon = (simulate(with_shape(scenario, shape), METHODS[name]) for shape in (Disc(0.5), regular(64, 0.5)))
    assert np.isfinite(disc.arrived).sum() == np.isfinite(polygon.arrived).sum()
    for run in (disc, polygon):
        between = between_robots(run)
        assert between[np.isfinite(between)].min() > -1e-3
    error = 2.0 * 0.5 * (1.0 - np.cos(np.pi / 64))
    assert np.abs(disc.positions[5] - polygon.positions[5]).max() <= 5.0 * error


BOUNDED = {
    "none": {},
    "half-planes of the velocity": {"velocity_bounds": (HalfSpace((0.6, 0.8), 0.9), HalfSpace((-1.0, 0.2), 0.7))},
    "half-planes of the acceleration": {"acceleration_bounds": (HalfSpace((0.6, 0.8), 0.5),)},
    "friction": {"bounds": (Friction(0.5, 0.9, 0.6),)},
}
"""Limits beside the largest speed and acceleration."""


@pytest.mark.parametrize("bounds", BOUNDED)
@pytest.mark.parametrize("name", ["nao", "vo", "avo"])
@pytest.mark.parametrize("horizon", draws([0.5, 1.0, 2.0, 4.0]))
def test_limits_hold_at_any_horizon(horizon: float, name: str, bounds: str) -> None:
    """Also while a manoeuvre is kept that lasts longer than the horizon of its decision."""
    limits = Limits(2.0, 1.0, **BOUNDED[bounds])
    navigator = Navigator(METHODS[name], Disc(0.3), limits, horizon=horizon)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        goal, previous = Goal(Stationary(15.0 * rng.normal(size=2)), 0.3), None
        state = State((0.0, 0.0), rng.uniform(-0.4, 0.4, 2))
        for k in range(70):
            now = 0.1 * k
            previous = navigator.decide(state, [], goal, now=now, previous=previous)
            applied = previous.manoeuvre.mean_acceleration(now, 0.1)
            velocity = state.velocity + 0.1 * applied
            assert np.linalg.norm(velocity) <= 2.0 * (1.0 + 1e-6)
            assert np.linalg.norm(applied) <= 1.0 + 1e-6
            for flats, value in ((limits.velocity_bounds, velocity), (limits.acceleration_bounds, applied)):
                assert all(flat.normal @ value <= flat.offset + 1e-6 for flat in flats)
            state = State(state.position + 0.1 * state.velocity + 0.005 * applied, velocity, applied)
