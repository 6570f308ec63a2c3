"""Obstacles with several futures: which are avoided, which are given up, and what is stated."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from slalom import (
    ConstantVelocity,
    Decision,
    Disc,
    Goal,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    Outcome,
    Polyline,
    Risk,
    State,
    Stationary,
    Tracks,
    control_obstacle,
    method,
)
from slalom.decision.fallback import least_given_up, levels
from slalom.forecast.forecast import FromModels
from slalom.forecast.from_models import LEAST_FUTURE
from slalom.model.trajectory import Sampled
from slalom.model.uncertainty import with_share
from slalom.obstacle.window import Obstacles, ObstacleWindow, Reaction, covering, futures, predicted

ROBOT, LIMITS, HORIZON = Disc(0.3), Limits(1.5, 2.0), 4.0
REACTION = Reaction(LIMITS, 0.1)
STATE, GOAL = State((0.0, 0.0), (1.0, 0.0)), Goal(Stationary((8.0, 0.0)), 0.3)
WALLS = tuple(Obstacle(Polyline(((-1.0, y), (9.0, y))), Stationary((0.0, 0.0))) for y in (-1.2, 1.2))


def navigator(name: str = "nao", **settings: object) -> Navigator:
    return Navigator(method(name), ROBOT, LIMITS, period=0.25, horizon=HORIZON, margin=0.0, **settings)  # type: ignore[arg-type]


def robots() -> list[Navigator | LookAhead]:
    return [navigator(), LookAhead(navigator("nao_ahead"))]


def future(position: Sequence[float], velocity: Sequence[float], p: float, owner: str, radius: float = 0.4) -> Obstacle:
    return Obstacle(Disc(radius), ConstantVelocity(position, velocity), probability=p, owner=owner)


def scene(seed: int, agents: int = 4) -> list[Obstacle]:
    """Agents with three futures each around a robot, which often cannot avoid all of them."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(agents):
        angle = rng.uniform(-np.pi, np.pi)
        place = rng.uniform(1.6, 3.0) * np.array([np.cos(angle), np.sin(angle)])
        for p in rng.dirichlet((4.0, 2.0, 1.0)):
            course = angle + np.pi + rng.normal(0.0, 0.4)
            velocity = rng.uniform(0.8, 1.6) * np.array([np.cos(course), np.sin(course)])
            found.append(future(place, velocity, max(float(p) - 1e-12, 1e-6), f"agent {k}", 0.6))
    return found


def certain(obstacles: Sequence[Obstacle]) -> list[Obstacle]:
    return [replace(one, probability=1.0) for one in obstacles]


def prefixes(obstacles: Sequence[Obstacle]) -> list[list[int]]:
    """The futures that may be given up, least probable first: none, the first, the first two, and so on."""
    likeliest = {
        max((k for k, o in enumerate(obstacles) if o.owner == one.owner), key=lambda k: obstacles[k].probability)
        for one in obstacles
    }
    order = sorted(set(range(len(obstacles))) - likeliest, key=lambda k: obstacles[k].probability)
    return [order[:n] for n in range(len(order) + 1)]


def decided(robot: Navigator | LookAhead, obstacles: Obstacles, **settings: object) -> Decision:
    return robot.decide(STATE, obstacles, GOAL, **settings)  # type: ignore[arg-type]


def same(a: Decision, b: Decision) -> bool:
    times = np.linspace(0.0, HORIZON, 9)
    return a.outcome is b.outcome and np.array_equal(a.manoeuvre.position(times), b.manoeuvre.position(times))


@pytest.mark.parametrize("robot", robots(), ids=["navigator", "ahead"])
def test_one_future_of_probability_1_decides_as_without(robot: Navigator | LookAhead) -> None:
    plain = certain(scene(3))
    plain = [replace(one, owner="") for one in plain]
    named = [replace(one, probability=1.0, owner="agent") for one in plain]
    a, b = decided(robot, plain), decided(robot, named)
    assert same(a, b)
    assert b.probability == float(b.safe)


def test_safe_where_the_union_of_all_futures_can_be_avoided_else_the_least_probable_are_given_up() -> None:
    robot, kinds = navigator(), set()
    for seed in range(25):
        around = scene(seed)
        found = decided(robot, around)
        tried = prefixes(around)
        safe = [
            decided(robot, certain([o for k, o in enumerate(around) if k not in gone])).outcome.safe for gone in tried
        ]
        kinds.add(found.outcome)
        if not any(safe):
            assert not found.outcome.safe
            assert found.outcome is not Outcome.LIKELY
            assert found.probability == 0.0
            continue
        gone = tried[safe.index(True)]
        lost = sum(around[k].probability for k in gone)
        assert found.probability == pytest.approx(max(0.0, 1.0 - lost), abs=1e-12)
        assert (found.outcome is Outcome.LIKELY) == bool(gone)
        assert found.safe == (not gone)
        kept = [o for k, o in enumerate(around) if k not in gone]
        blocked = control_obstacle(found.manoeuvre.response, STATE, kept, ROBOT, horizon=HORIZON)
        assert not blocked.contains(found.manoeuvre.control)
    assert Outcome.LIKELY in kinds
    assert any(kind.safe for kind in kinds)


@pytest.mark.parametrize("robot", robots(), ids=["navigator", "ahead"])
def test_the_order_of_futures_does_not_matter(robot: Navigator | LookAhead) -> None:
    around = [
        future((3.0, 0.0), (-1.0, 0.0), 0.05, "a", 0.9),
        future((3.0, 0.0), (0.0, 3.0), 0.9, "a", 0.9),
        future((3.0, 0.0), (-1.0, 0.1), 0.05, "a", 0.9),
    ]
    behind = future((-1.4, 0.0), (1.4, 0.0), 1.0, "", 0.9)
    found = [decided(robot, [*WALLS, behind, *order]) for order in permutations(around)]
    assert found[0].outcome is Outcome.LIKELY
    assert found[0].probability == pytest.approx(0.9, abs=1e-15)
    assert all(same(found[0], one) and one.probability == found[0].probability for one in found)


def test_a_robot_that_looks_ahead_gives_up_the_least_probable_future() -> None:
    robot = LookAhead(navigator("nao_ahead"))
    behind = future((-1.4, 0.0), (1.4, 0.0), 1.0, "", 0.9)
    ahead = future((3.0, 0.0), (-1.0, 0.0), 0.1, "a", 0.9), future((3.0, 0.0), (0.0, 3.0), 0.9, "a", 0.9)
    found = decided(robot, [*WALLS, behind, *ahead])
    assert found.outcome is Outcome.LIKELY
    assert found.probability == pytest.approx(0.9)
    alone = decided(robot, [*WALLS, behind, certain(ahead)[1]])
    assert alone.outcome.safe
    assert np.array_equal(alone.manoeuvre.control, found.manoeuvre.control)
    # Once the future did not come true, the sequence that goes on avoids all.
    later = 0.25
    state = State(found.manoeuvre.position(later), found.manoeuvre.velocity(later))
    known = [*WALLS, behind, certain(ahead)[1]]
    after = robot.decide(state, known, GOAL, now=later, previous=found)
    assert after.outcome.safe
    assert after.probability == 1.0
    still = robot.decide(state, [*WALLS, behind, *ahead], GOAL, now=later, previous=found)
    assert still.outcome is Outcome.LIKELY


def test_probabilities_of_several_obstacles_add_up() -> None:
    behind = future((-1.4, 0.0), (1.4, 0.0), 1.0, "", 0.9)
    one = future((3.0, 0.0), (-1.0, 0.0), 0.1, "a", 0.9), future((3.0, 0.0), (0.0, 3.0), 0.9, "a", 0.9)
    two = future((3.5, 0.0), (-1.0, 0.0), 0.2, "b", 0.9), future((3.5, 0.0), (0.0, 3.0), 0.8, "b", 0.9)
    found = decided(navigator(), [*WALLS, behind, *one, *two])
    assert found.outcome is Outcome.LIKELY
    assert found.probability == pytest.approx(0.7)
    assert found.as_dict()["probability"] == found.probability


def test_the_most_probable_future_is_kept_and_a_doubtful_obstacle_may_be_given_up() -> None:
    behind = future((-1.4, 0.0), (1.4, 0.0), 1.0, "", 0.9)
    likely, other = future((3.0, 0.0), (-1.0, 0.0), 0.6, "a", 0.9), future((3.0, 0.0), (0.0, 3.0), 0.4, "a", 0.9)
    assert not decided(navigator(), [*WALLS, behind, likely, other]).outcome.safe
    assert decided(navigator(), [*WALLS, behind, likely, other]).probability == 0.0
    # With 0.4 it is there at all: that there is nothing is the most probable.
    doubtful = decided(navigator(), [*WALLS, behind, replace(likely, probability=0.4)])
    assert doubtful.outcome is Outcome.LIKELY
    assert doubtful.probability == pytest.approx(0.6)
    kept = [level.given_up.tolist() for level in levels([future((3.0, 0.0), (0.0, 0.0), 1.0 / 3.0, "a")] * 3)]
    assert kept == [[False] * 3], "of equal futures all are the most probable"


def test_tracks_of_one_id_are_the_futures_of_one_obstacle() -> None:
    rows = [((3.0, 0.0), (-1.0, 0.0), 0.1), ((3.0, 0.0), (0.0, 3.0), 0.9)]
    behind = future((-1.4, 0.0), (1.4, 0.0), 1.0, "", 0.9)
    tracks = Tracks(
        [row[0] for row in rows], [row[1] for row in rows], 0.9, ids=["a", "a"], probabilities=[row[2] for row in rows]
    )
    one_by_one = [future(place, velocity, p, "a", 0.9) for place, velocity, p in rows]
    for robot in (navigator("avo"), LookAhead(navigator("nao_ahead"))):
        a, b = (decided(robot, [*WALLS, behind, *some]) for some in ([tracks], one_by_one))
        assert a.outcome is b.outcome is Outcome.LIKELY
        assert a.probability == b.probability
        assert np.allclose(a.manoeuvre.control, b.manoeuvre.control, atol=1e-9)


@pytest.mark.parametrize("robot", robots(), ids=["navigator", "ahead"])
def test_an_improbable_future_costs_its_expected_loss(robot: Navigator | LookAhead) -> None:
    """Avoiding it costs some seconds: it is given up if the loss times its probability is less."""
    wall = future((2.3, 0.0), (0.0, 0.0), 0.05, "a", 1.4)
    elsewhere = future((2.3, 0.0), (0.0, 5.0), 0.95, "a", 0.1)
    taken = []
    for loss in (0.0, 1.0, 1e4, np.inf):
        risk = Risk(loss)
        if isinstance(robot, LookAhead):
            robot = replace(robot, navigator=replace(robot.navigator, risk=risk))
        else:
            robot = replace(robot, risk=risk)
        taken.append(decided(robot, [wall, elsewhere]))
    avoiding = decided(robot, certain([wall, elsewhere]))
    assert [one.outcome is Outcome.LIKELY for one in taken] == [True, True, False, False]
    assert [one.probability for one in taken] == pytest.approx([0.95, 0.95, 1.0, 1.0])
    assert same(taken[3], avoiding)
    likely = [replace(wall, probability=0.3), replace(elsewhere, probability=0.7)]
    free = replace(robot, navigator=replace(robot.navigator, risk=Risk(0.0))) if isinstance(robot, LookAhead) else None
    assert decided(free or replace(robot, risk=Risk(0.0)), likely).outcome.safe, "likely ones are always avoided"


def test_the_chosen_level_has_the_least_cost() -> None:
    """Against all levels, with times that never grow from one level to the next."""
    rng = np.random.default_rng(5)
    made = decided(navigator(), [])
    for _ in range(200):
        weights = rng.uniform(0.001, 0.09, int(rng.integers(1, 7)))
        given = levels([future((9.0, 0.0), (0.0, 0.0), float(p), f"{k}") for k, p in enumerate(weights)])
        times = np.sort(rng.uniform(1.0, 2.0, len(given)))[::-1]
        unsafe = int(rng.integers(0, len(given)))
        risk = Risk(float(rng.uniform(0.0, 20.0)))
        decisions = {
            id(level): replace(made, work=t, outcome=Outcome.CLEAR if k >= unsafe else Outcome.DELAYED)
            for k, (level, t) in enumerate(zip(given, times.tolist()))
        }
        found = least_given_up(given, lambda one: decisions[id(one)], risk, lambda one: one.work)  # noqa: B023
        costs = [t + risk.loss * level.probability for t, level in zip(times.tolist(), given)]
        best = min(range(unsafe, len(given)), key=lambda k: costs[k])
        assert found.given_up == given[best].probability
        exact = least_given_up(given, lambda one: decisions[id(one)], Risk(), lambda one: one.work)  # noqa: B023
        assert exact.given_up == given[unsafe].probability


def track(turn: float) -> Sampled:
    """A person who walked straight, and turned during the last 0.5 s."""
    times = np.arange(0.0, 6.01, 0.1)
    courses = np.where(times > 5.5, turn * (times - 5.5), 0.0)
    steps = 0.13 * np.stack([np.cos(courses), np.sin(courses)], axis=1)
    noise = np.random.default_rng(2).normal(0.0, 0.002, (len(times), 2))
    return Sampled(times, np.cumsum(steps, axis=0) + noise, interpolation="linear")


def test_futures_of_models_are_groups_whose_probabilities_are_1_together() -> None:
    person = Obstacle(Disc(0.3), track(1.5), "person")
    (found,) = futures([person], FromModels(futures=3), 6.0, [0])
    assert 1 < len(found) <= 3
    weights = [one.probability for one in found]
    assert sum(weights) == pytest.approx(1.0, abs=1e-12)
    assert weights == sorted(weights, reverse=True)
    assert min(weights) >= LEAST_FUTURE
    assert len({one.owner for one in found}) == 1
    ends = np.array([one.trajectory.position(7.5) for one in found])
    mean = FromModels()(person.trajectory, 6.0).position(7.5)
    knot = 6.0 + 0.1 * 14
    places = np.array([one.trajectory.position(knot) for one in found])
    assert np.allclose(weights @ places, FromModels()(person.trajectory, 6.0).position(knot), atol=1e-12)
    assert np.linalg.norm(ends - mean, axis=1).max() > 0.1
    (doubtful,) = futures([replace(person, probability=0.5)], FromModels(futures=3), 6.0, [0])
    assert sum(one.probability for one in doubtful) == pytest.approx(0.5)
    assert {one.owner for one in doubtful} == {"person"}


def test_a_track_with_one_future_is_predicted_as_by_the_mean() -> None:
    times = np.arange(0.0, 6.01, 0.1)
    straight = Obstacle(Disc(0.3), Sampled(times, np.outer(times, (1.3, 0.0)), interpolation="linear"), "person")
    ((found,),) = futures([straight], FromModels(futures=3), 6.0, [0])
    ((mean,),) = futures([straight], FromModels(), 6.0, [0])
    ahead = np.linspace(6.0, 9.0, 7)
    assert found.probability == 1.0
    assert np.array_equal(found.trajectory.position(ahead), mean.trajectory.position(ahead))


@pytest.mark.parametrize("most", [1, 3])
def test_obstacles_are_predicted_together_as_alone(most: int) -> None:
    """To the bit: some are at rest, some appeared later, and one has another spacing of its samples."""
    rng = np.random.default_rng(most)
    rule = FromModels(futures=most)
    walks = [track(turn) for turn in (0.0, 0.4, 1.5, -0.8)]
    walks += [Stationary((3.0, 1.0)), ConstantVelocity((0.0, 0.0), (0.5, 0.2))]
    walks += [
        Sampled(t, rng.normal(0.0, 0.3, (len(t), 2)).cumsum(axis=0))
        for t in (np.arange(5.0, 9.0, 0.4), np.arange(0.0, 9.0, 0.1))
    ]
    people = [Obstacle(Disc(0.3), walk, "one" if k % 2 else "") for k, walk in enumerate(walks)]
    together = futures(people, rule, 6.0, range(len(people)), REACTION)
    times = np.linspace(6.0, 12.0, 25)
    for number, found in enumerate(together):
        (alone,) = futures(people, rule, 6.0, [number], REACTION)
        assert [one.probability for one in found] == [one.probability for one in alone]
        assert [one.owner for one in found] == [one.owner for one in alone]
        for one, other in zip(found, alone, strict=True):
            np.testing.assert_array_equal(one.trajectory.position(times), other.trajectory.position(times))
            assert one.uncertainty == other.uncertainty


def test_robots_avoid_all_futures_of_a_turning_person() -> None:
    """With `FromModels` in the method: the decision avoids what the expanded list says, with the sets of 0.8."""
    person = Obstacle(Disc(0.3), track(1.5), "person")
    place = person.trajectory.position(6.0) + np.array([2.0, 0.6])
    state, goal = State(place, (-1.0, 0.0)), Goal(Stationary(place - np.array([6.0, 0.0])), 0.3)
    rule = FromModels(futures=3)
    robot = replace(navigator(), method=replace(method("nao"), forecast=rule))
    found = robot.decide(state, [person], goal, now=6.0)
    blocked = control_obstacle(
        found.manoeuvre.response,
        state,
        covering(futures([person], rule, 6.0, [0], Reaction(LIMITS, robot.period))[0], 0.8),
        ROBOT,
        horizon=HORIZON,
        start=6.0,
    )
    assert found.safe
    assert not blocked.contains(found.manoeuvre.control)
    ahead = LookAhead(replace(robot, method=replace(method("nao_ahead"), forecast=rule)))
    sequence = ahead.decide(state, [person], goal, now=6.0)
    assert sequence.safe
    times = np.linspace(6.0, 10.0, 81)
    (each,) = futures([person], rule, 6.0, [0], Reaction(LIMITS, ahead.navigator.period))
    for one in each:
        gaps = np.linalg.norm(sequence.manoeuvre.position(times) - one.trajectory.position(times), axis=1)
        radii = with_share(one.uncertainty, 0.8).radius(times - 6.0, 2)
        assert (gaps >= 0.6 + radii - 1e-6).all()


def test_pieces_of_many_predictions_are_those_of_each() -> None:
    """Predictions of one moment are made into pieces at once, to the bit as one by one; so with and without radii."""
    rng, moments = np.random.default_rng(1), np.arange(0.0, 6.01, 0.1)
    people = [
        Obstacle(Disc(0.3), Sampled(moments, np.cumsum(rng.normal(0.1, 0.02, (61, 2)), axis=0), interpolation="linear"))
        for _ in range(6)
    ]
    ahead = [predicted(one, FromModels(), 5.95, REACTION if k % 2 else None) for k, one in enumerate(people)]
    ahead[0] = replace(ahead[0], uncertainty=None)
    together = ObstacleWindow(ahead, 6.0, 5.0).bodies(ROBOT).pieces
    alone = [ObstacleWindow([one], 6.0, 5.0).bodies(ROBOT).pieces for one in ahead]
    for name in ("times", "points", "radius", "growth"):
        assert np.array_equal(getattr(together, name), np.concatenate([getattr(one, name) for one in alone]))
    for one, pieces in zip(ahead, alone, strict=True):
        middle = pieces.times.mean(axis=1)
        value = pieces.points.transpose(0, 2, 1) @ (0.125 * np.array([1.0, 3.0, 3.0, 1.0]))
        assert np.allclose(value, one.trajectory.position(6.0 + middle), atol=1e-9)
