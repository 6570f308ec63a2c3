"""Obstacles whose trajectory has ended: refused, continued or gone as stated, in every method and foresight."""

from collections.abc import Callable

import numpy as np
import pytest
from draws import draws

from slalom import (
    FORESIGHTS,
    METHODS,
    BoundedError,
    Decision,
    Disc,
    Fleet,
    Function,
    Goal,
    InvalidInput,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    ObstacleTable,
    PiecewisePolynomial,
    Sampled,
    Sight,
    State,
    Stationary,
)
from slalom.sim import Robot, Scenario, simulate

LIMITS = Limits(2.0, 1.5)
PERSON, ROBOT = Disc(0.4), Disc(0.4)
GOAL = Goal(Stationary((12.0, 0.0)), 0.3)
SINGLE = [name for name, method in METHODS.items() if not method.shared]
CASES = [pytest.param(name, foresight) for foresight in ("", *FORESIGHTS) for name in SINGLE]


def person(last: float, after_end: str = "unknown", **settings) -> Obstacle:
    """A person who stands in the way of the robot, observed for half a second up to `last` [s]."""
    stamps = last + np.array([-0.5, -0.4, -0.3, -0.2, -0.1, 0.0])
    positions = np.tile([2.3, 0.05], (6, 1))
    return Obstacle(PERSON, Sampled(stamps, positions), "person", after_end=after_end, **settings)


def decider(name: str, foresight: str) -> Navigator | LookAhead:
    method = METHODS[name] if not foresight else METHODS[name].with_foresight(foresight)
    if not method.looks_ahead:
        return Navigator(method, ROBOT, LIMITS)
    return LookAhead(Navigator(method, ROBOT, LIMITS), time_horizon=20.0, budget=2000.0)


def runs_into(decision: Decision, now: float) -> bool:
    """Whether the committed motion comes closer to the place of the person than both radii, within 4 s."""
    times = now + np.linspace(0.0, 4.0, 401)
    gaps = np.linalg.norm(decision.manoeuvre.position(times) - [2.3, 0.05], axis=1)
    return bool(gaps.min() < 0.8 - 1e-6)


@pytest.mark.parametrize(("name", "foresight"), draws(CASES, len(SINGLE)))
def test_an_ended_track_is_refused_or_avoided(name: str, foresight: str) -> None:
    """The person in the way is 30 ms old: a robot that forgets it drives on as if alone."""
    robot, now, state = decider(name, foresight), 5.03, State((0.0, 0.0), (1.8, 0.0))
    alone = robot.decide(state, [], GOAL, now=now)
    assert runs_into(alone, now)
    sentence = "obstacle 'person': expected a trajectory that is known at 5.03 s, found one that ended at 5 s; "
    for obstacles in ([person(5.0)], ObstacleTable([person(5.0)])):
        with pytest.raises(InvalidInput, match=sentence):
            robot.decide(state, obstacles, GOAL, now=now)
    for obstacle in (person(5.0, "continues"), person(now), person(5.1)):
        for obstacles in ([obstacle], ObstacleTable([obstacle])):
            decision = robot.decide(state, obstacles, GOAL, now=now)
            assert not (decision.outcome.safe and runs_into(decision, now))
            assert np.any(decision.manoeuvre.control != alone.manoeuvre.control)
    gone = robot.decide(state, [person(5.0, "leaves")], GOAL, now=now)
    np.testing.assert_array_equal(gone.manoeuvre.control, alone.manoeuvre.control)


@pytest.mark.parametrize("name", ["nao", "vo", "nao_shared"])
@pytest.mark.parametrize("given", ["obstacles", "others"])
def test_fleets(name: str, given: str) -> None:
    def step(*some: Obstacle) -> np.ndarray:
        """The acceleration of a robot among these."""
        fixed, others = (some, ()) if given == "obstacles" else ((), some)
        fleet = Fleet(METHODS[name], ROBOT, LIMITS, robots=1, obstacles=fixed)
        return fleet.step(5.03, [(0.35, 0.0)], [(1.8, 0.0)], [(12.0, 0.0)], others=others).accelerations[0]

    with pytest.raises(InvalidInput, match=r"obstacle 'person': expected a trajectory that is known at 5.03 s"):
        step(person(5.0))
    assert np.abs(step(person(5.0, "continues")) - step()).max() > 0.1
    np.testing.assert_array_equal(step(person(5.0, "leaves")), step())


MOVING: dict[str, Callable[[], object]] = {
    "sampled": lambda: Sampled([0.0, 1.0, 2.0], [(0.0, 0.0), (1.0, 0.5), (2.0, 1.5)]),
    "piecewise_polynomial": lambda: PiecewisePolynomial([2.0], [[(0.0, 0.0), (1.0, 0.2), (0.1, 0.3)]]),
    "function": lambda: Function(lambda t: (t, 0.25 * t * t), 2.0, 1.0, 0.0, 2.0),
}


@pytest.mark.parametrize("kind", MOVING)
def test_a_continued_obstacle_keeps_its_last_velocity(kind: str) -> None:
    """Before the end the trajectory is the same; after it, a straight line."""
    trajectory = MOVING[kind]()
    obstacle = Obstacle(PERSON, trajectory, after_end="continues")
    continued = obstacle.known_at(3.0).trajectory
    times = np.linspace(0.0, 2.0, 41)
    np.testing.assert_array_equal(continued.position(times[:-1]), trajectory.position(times[:-1]))
    end, velocity = trajectory.position(2.0), trajectory.velocity(2.0)
    np.testing.assert_allclose(continued.position(7.5), end + 5.5 * velocity, atol=1e-12)
    assert obstacle.exists(1e6)
    assert not Obstacle(PERSON, trajectory, after_end="leaves").exists(2.1)


def test_the_uncertainty_of_a_continued_obstacle_grows_from_the_end() -> None:
    """Also under a forecast, in which the trajectory has no end."""
    obstacle = person(5.0, "continues", uncertainty=BoundedError(0.1, 0.5))
    for name in ("nao", "vo"):
        window = Navigator(METHODS[name], ROBOT, LIMITS).predict([obstacle], State((0, 0), (0, 0)), 7.0)
        pieces = window.bodies(ROBOT).pieces
        assert pieces.radius[0] == pytest.approx(0.1 + 0.5 * 2.0, abs=1e-6)
        assert pieces.radius[-1] + pieces.growth[-1] == pytest.approx(0.1 + 0.5 * (2.0 + window.horizon), abs=1e-6)
    same = Navigator(METHODS["nao"], ROBOT, LIMITS).predict([obstacle], State((0, 0), (0, 0)), 4.9)
    assert same.bodies(ROBOT).pieces.radius[0] == pytest.approx(0.1, abs=1e-6)


def test_agents_leave_a_scenario() -> None:
    """In a simulation what is true is known: the robot goes where the agent was, and the run says so."""
    robot = Robot(ROBOT, LIMITS, State((0.0, 0.0), (0.0, 0.0)), GOAL)
    agent = Obstacle(PERSON, Sampled([0.0, 2.0], [(6.0, 0.0)] * 2), "agent")
    scenario = Scenario("leaves", (robot,), (agent,), duration=12.0)
    assert scenario.obstacles[0].after_end == "leaves"
    run = simulate(scenario, METHODS["nao"], record=False)
    assert run.arrived.all()
    still = Obstacle(PERSON, Stationary((0.0, 5.0)))
    assert Scenario("same", (robot,), (still,)).obstacles[0] is still


def test_what_continues_continues_in_a_scenario() -> None:
    robot = Robot(ROBOT, LIMITS, State((0.0, 0.0), (0.0, 0.0)), GOAL)
    agent = Obstacle(PERSON, Sampled([0.0, 2.0], [(6.0, 3.0), (6.0, 2.0)]), "agent", after_end="continues")
    scenario = Scenario("continues", (robot,), (agent,))
    np.testing.assert_allclose(scenario.obstacles[0].trajectory.position(6.0), (6.0, 0.0), atol=1e-12)


@pytest.mark.parametrize("any_motion", [False, True])
def test_sight_sees_what_continues_and_refuses_what_is_unknown(any_motion: bool) -> None:
    """A continued walker is seen where it is by then, and one that left is not."""
    times = np.array([0.0, 0.5, 1.0])
    walk = Sampled(times, [(2.0, t - 3.0) for t in times])
    sight = Sight(range=4.0, hidden_speed=1.0, any_motion=any_motion)
    for after_end, expected in (("continues", True), ("leaves", False)):
        walker = Obstacle(PERSON, walk, "walker", after_end=after_end)
        found = sight.look(State((0.0, 0.0), (1.0, 0.0)), [walker], 3.0)
        assert found.visible.tolist() == [expected]
        assert found.seen == ((walker,) if expected else ())
        places = [np.round(o.trajectory.position(3.0), 9).tolist() for o in found.hidden if o.name == "walker"]
        assert places == ([[2.0, 0.0]] if expected and any_motion else [])
    with pytest.raises(InvalidInput, match="known at 3 s, found one that ended at 1 s"):
        sight.look(State((0.0, 0.0), (1.0, 0.0)), [Obstacle(PERSON, walk, "walker")], 3.0)
