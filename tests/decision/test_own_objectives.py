"""Objectives of users: they are asked once for all candidates, and know the obstacles as they are predicted."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from draws import draws

from slalom import (
    METHODS,
    Arrive,
    Candidates,
    Circular,
    ConstantVelocity,
    Disc,
    GaussianError,
    Goal,
    Limits,
    Mix,
    MostClearance,
    Navigator,
    Obstacle,
    ObstacleWindow,
    Outcome,
    Polyline,
    Sampled,
    Situation,
    State,
    Stationary,
    Tracks,
)
from slalom.sim import Robot, Scenario, metrics, simulate

GOAL = Goal(Stationary((15.0, 0.0)), 1.0)
START = State((-10.0, 0.0), (4.0, 0.0))


@dataclass(frozen=True)
class Asked(Arrive):
    """Arrive, with notes of what it is asked, and `more` costs of those that pass in front of the first obstacle."""

    more: float = 0.0
    notes: list[tuple[Candidates, Situation]] = field(default_factory=list)

    def costs(self, candidates: Candidates, situation: Situation) -> np.ndarray:
        self.notes.append((candidates, situation))
        return candidates.costs + self.more * in_front(candidates, situation)


def in_front(candidates: Candidates, situation: Situation) -> np.ndarray:
    """Whether each candidate (n,) is ahead of the first obstacle when it is nearest."""
    times = situation.now + np.linspace(0.0, situation.horizon, 241)
    away = candidates.positions(times) - situation.obstacles.positions(times)[0]
    at = np.linalg.norm(away, axis=2).argmin(axis=1)
    moves = situation.obstacles.velocities(times)[0]
    return (away[np.arange(len(at)), at] * moves[at]).sum(axis=1) > 0.0


def robot(**settings: object) -> Navigator:
    return Navigator(METHODS["nao"], Disc(1.0), Limits(6.0, 3.0), **settings)  # type: ignore[arg-type]


def crossing(start: float) -> Obstacle:
    return Obstacle(Disc(1.0), ConstantVelocity((0.0, start), (0.0, 3.0)), "car")


@pytest.mark.parametrize("start", draws([-6.0, -7.0, -8.0, -9.0, -10.0, -12.0], 3))
def test_it_is_asked_once_for_both_sides_of_what_is_in_the_way(start: float) -> None:
    """Also where the preferred control is free: each response that is held for a second has one on either side."""
    objective = Asked()
    decision = robot(objective=objective).decide(START, [crossing(start)], GOAL)
    ((candidates, situation),) = objective.notes
    front = in_front(candidates, situation)
    pairs = [set(front[candidates.until == until].tolist()) for until in set(candidates.until.tolist()) if until >= 1.0]
    assert len(pairs) == 3
    assert all(pair == {False, True} for pair in pairs)
    assert decision.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED)
    # All of them are free: each keeps the margin until its control has been carried out.
    for row, until in enumerate(candidates.until):
        times = np.linspace(0.0, until, 101)
        away = candidates.positions(times)[row] - situation.obstacles.positions(times)[0]
        assert np.linalg.norm(away, axis=1).min() >= 2.05 - 1e-4


def test_candidates_move_as_the_manoeuvre_that_is_chosen() -> None:
    """Up to the end of its control, and at constant velocity from then on."""
    objective, navigator = Asked(), robot()
    decision = navigator.decide(START, [crossing(-7.0)], GOAL, objective=objective)
    ((candidates, situation),) = objective.notes
    path, best = decision.manoeuvre, int(candidates.costs.argmin())
    until = float(candidates.until[best])
    assert until == pytest.approx(path.settled_time(navigator.period, navigator.horizon))
    times = np.linspace(0.0, until, 50)
    np.testing.assert_allclose(candidates.positions(times)[best], path.position(times), atol=1e-6)
    np.testing.assert_allclose(candidates.velocities(times[:-1])[best], path.velocity(times[:-1]), atol=1e-5)
    end = path.position(until) + 2.0 * candidates.velocities([until])[best, 0]
    np.testing.assert_allclose(candidates.positions([until + 2.0])[best, 0], end, atol=1e-6)
    assert candidates.costs[best] == pytest.approx(objective.cost(path, situation, until), abs=1e-4)
    # The present manoeuvre is the last candidate of the next decision.
    then = State(path.position(0.1), path.velocity(0.1), path.acceleration(0.1))
    navigator.decide(then, [crossing(-7.0)], GOAL, now=0.1, previous=decision, objective=objective)
    kept = objective.notes[-1][0]
    np.testing.assert_allclose(kept.positions(times[3:])[-1], path.position(times[3:]), atol=1e-6)


@pytest.mark.parametrize("start", draws([-6.0, -7.0, -8.0, -9.0, -10.0], 2))
@pytest.mark.parametrize("wrapped", [False, True])
def test_a_robot_passes_behind_what_crosses(start: float, wrapped: bool) -> None:
    """Also within `MostClearance`, which asks once for each clearance; in no run it comes nearer than the margin."""
    objective: object = Asked(more=10.0)
    objective = MostClearance(0.2, objective) if wrapped else objective  # type: ignore[arg-type]
    body = Robot(Disc(1.0), Limits(6.0, 3.0), START, GOAL)
    run = simulate(Scenario("crossing", (body,), [crossing(start)], duration=30.0), "nao", objective=objective)  # type: ignore[arg-type]
    found = metrics.summary(run)
    away = run.positions[:, 0] - crossing(start).trajectory.position(run.times)
    assert away[np.linalg.norm(away, axis=1).argmin()][1] < 0.0
    assert found["arrived"] == 1
    assert found["min_clearance"] > 0.04


def test_obstacles_are_known_as_they_are_predicted() -> None:
    """Positions, velocities and radii over time: of walls, of tracks, of other robots; nan where there is none."""
    circle = Obstacle(Disc(0.5), Circular((0.0, 30.0), 5.0, 2.0), uncertainty=GaussianError(0.1, 0.2, probability=0.01))
    leaves = Obstacle(Disc(0.5), Sampled([0.0, 1.0], [(30.0, 0.0), (31.0, 0.0)]), after_end="leaves")
    wall = Obstacle(Polyline([(0.0, -9.0), (2.0, -9.0)], 0.1), Stationary((1.0, 0.0)))
    seen, objective = Tracks([(0.0, 9.0)], [(1.0, 0.0)], 0.3), Asked()
    robot(objective=objective).decide(START, [circle, leaves, wall], GOAL, robots=seen)
    known, times = objective.notes[0][1].obstacles, np.array([0.0, 0.5, 2.0])
    positions = known.positions(times)
    np.testing.assert_allclose(positions[0], circle.trajectory.position(times))
    np.testing.assert_allclose(known.velocities(times)[0], circle.trajectory.velocity(times))
    np.testing.assert_allclose(positions[1, :2], leaves.trajectory.position(times[:2]))
    assert np.isnan(positions[1, 2]).all()
    np.testing.assert_allclose(positions[2:, :, 0], [[1.0, 1.0, 1.0], times])
    radii = known.radii(times)
    assert circle.uncertainty is not None
    np.testing.assert_allclose(radii[0], [0.5 + circle.uncertainty.radius(t, 2) for t in times.tolist()])
    np.testing.assert_allclose(radii[1:, 0], [0.5, wall.shape.bounding_radius, 0.3])
    assert ObstacleWindow((), 0.0, 1.0).positions(times).shape == (0, 3, 1)


def test_infinite_costs_exclude_and_mistakes_are_raised() -> None:
    """A part of a `Mix` has its own costs too."""

    class Never(Arrive):
        def costs(self, candidates: Candidates, situation: Situation) -> np.ndarray:
            return np.full(len(candidates.costs), np.inf)

    class Fails(Arrive):
        def costs(self, candidates: Candidates, situation: Situation) -> np.ndarray:
            raise ZeroDivisionError

    assert robot(objective=Never()).decide(START, [crossing(-7.0)], GOAL).outcome not in (
        *(Outcome.CLEAR, Outcome.CONSTRAINED),
    )
    with pytest.raises(ZeroDivisionError):
        robot(objective=Fails()).decide(START, [crossing(-7.0)], GOAL)
    alone = robot(objective=Asked(more=10.0)).decide(START, [crossing(-8.0)], GOAL).manoeuvre
    mixed = robot(objective=Mix(((1.0, Asked(more=10.0)),))).decide(START, [crossing(-8.0)], GOAL).manoeuvre
    np.testing.assert_allclose(alone.control, mixed.control, atol=1e-6)
