"""Rows of bodies and times that a robot cannot come near are left out: every decision stays the same to the bit."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

import slalom
from slalom import (
    Circular,
    Disc,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    Polyline,
    Rectangle,
    State,
    Stationary,
)
from slalom.decision.grown_bodies import Skeletons
from slalom.kernels.decision.tables import GrownBodies

PERIOD = 0.1


class Scene(NamedTuple):
    """One robot among walls, cars that turn, and people."""

    robot: Navigator
    state: State
    goal: Goal
    obstacles: ObstacleTable


def scene(seed: int, method: str, stop: bool) -> Scene:
    """Walls on 30 m x 30 m around a free place, and bodies on circles."""
    rng = np.random.default_rng(seed)
    walls, movers = [], []
    for _ in range(40):
        middle, along = rng.uniform(-15.0, 15.0, 2), rng.uniform(-3.0, 3.0, 2)
        if np.linalg.norm(middle) > 5.0:
            walls.append(Obstacle(Polyline((middle - along, middle + along), 0.05), Stationary((0.0, 0.0))))
    for k in range(12):
        path = Circular(rng.uniform(-8.0, 8.0, 2), rng.uniform(5.0, 9.0), rng.uniform(1.0, 4.0), rng.uniform(0.0, 6.0))
        if np.linalg.norm(path.position(0.0)) > 3.5:
            movers.append(Obstacle(Rectangle(3.0, 1.6) if k % 2 else Disc(0.4), path, heading="motion"))
    robot = Navigator(slalom.method(method), Disc(0.3), Limits(3.0, 2.0), detours=(0.6, -0.6))
    goal = Goal(Stationary(rng.uniform(-12.0, 12.0, 2)), 0.5, stop=stop)
    return Scene(robot, State((0.0, 0.0), rng.uniform(-1.0, 1.0, 2)), goal, ObstacleTable([*walls, *movers]))


def drive(s: Scene, steps: int) -> Iterator[tuple[object, ...]]:
    """What is decided at each step of a crossing."""
    state, decision = s.state, None
    for k in range(steps):
        now = PERIOD * k
        decision = s.robot.decide(state, s.obstacles, s.goal, now=now, previous=decision)
        a = decision.manoeuvre.mean_acceleration(now, PERIOD)
        state = State(state.position + PERIOD * state.velocity + 0.5 * PERIOD**2 * a, state.velocity + PERIOD * a, a)
        yield decision.outcome, repr(decision.manoeuvre.response), *decision.manoeuvre.control.tolist(), decision.regret


def everywhere(bodies: GrownBodies) -> GrownBodies:
    """The same bodies with balls of which nothing is known: no row and no time is left out."""
    balls = bodies.balls.copy()
    balls[:, 3] = np.inf
    return bodies._replace(balls=balls)


@pytest.mark.parametrize(("method", "stop"), [("nao", False), ("nao", True), ("vo", True)])
@pytest.mark.parametrize("seed", range(3))
def test_decisions_are_those_with_all_rows(seed, method, stop, monkeypatch):
    """In a closed loop among walls and movers, so that kept, constrained and squeezed decisions occur."""
    culled = list(drive(scene(seed, method, stop), 40))
    made = Skeletons.grown_bodies
    monkeypatch.setattr(Skeletons, "grown_bodies", lambda *args, **named: everywhere(made(*args, **named)))
    assert culled == list(drive(scene(seed, method, stop), 40))
    assert len({row[0] for row in culled}) > 1
