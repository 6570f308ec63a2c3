"""The decisions that several programs measure: 30 moving obstacles, a horizon of 6 s, one response of nao.

Two families. `roundabout`: states from crossings of the paper's roundabout by nao; all obstacles move on circles.
`mixed`: random states among ten circles, ten chains of quintic polynomials and ten tracks with 5 stamps a second.
"""

from dataclasses import dataclass, replace

import numpy as np
from decision import situations

from slalom import (
    AccelerateThenCoast,
    Circular,
    ControlObstacle,
    Disc,
    Goal,
    Limits,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    PiecewisePolynomial,
    Sampled,
    State,
    Stationary,
    Velocity,
    method,
)
from slalom.decision.objective import Arrive, Situation, preferred_control
from slalom.obstacle.window import predicted

HORIZON, HOLD, OBSTACLES = 6.0, 1.0, 30
ROBOT, LIMITS, MARGIN = Disc(1.0), Limits(8.0, 4.0), 0.025


@dataclass(frozen=True, eq=False)
class Task:
    """A decision: the situation of the robot, the preferred control, and the control obstacle."""

    situation: Situation
    preferred: np.ndarray
    blocked: ControlObstacle

    def fresh(self) -> ControlObstacle:
        """A new control obstacle, without stored results."""
        b = self.blocked
        return ControlObstacle(b.response, b.state, b.obstacles, b.robot, b.margin)

    def foreseen(self) -> ObstacleWindow:
        """A new window of the obstacles, with its pieces."""
        window = self.blocked.obstacles.within(self.blocked.obstacles.until)
        window.bodies(self.blocked.robot)
        return window

    @property
    def radii(self) -> np.ndarray:
        """Least distances of the centres [m]: (n,)."""
        grown = self.blocked.robot.bounding_radius + float(self.blocked.margin)
        return np.array([obstacle.shape.bounding_radius + grown for obstacle in self.blocked.obstacles.obstacles])


def families(count: int) -> dict[str, list[Task]]:
    """`count` decisions of each family."""
    rows = [Task(situation, preferred, blocked) for blocked, situation, preferred in situations(count)]
    return {"roundabout": rows, "mixed": mixed(count)}


def mixed(count: int) -> list[Task]:
    """Decisions at random positions, without those in which the robot overlaps an obstacle."""
    rng, found = np.random.default_rng(1), []
    while len(found) < count:
        state = State(rng.uniform(-8.0, 8.0, 2), rng.uniform(-4.0, 4.0, 2))
        angle = rng.uniform(0.0, 2.0 * np.pi)
        goal = Goal(Stationary(30.0 * np.array([np.cos(angle), np.sin(angle)])), 1.0)
        task = decision(state, goal, [anything(k, rng) for k in range(OBSTACLES)])
        if not len(task.blocked.overlapping):
            found.append(task)
    return found


def decision(state: State, goal: Goal, obstacles: list[Obstacle]) -> Task:
    """The decision of one response of nao at time 0."""
    response = AccelerateThenCoast(HOLD)
    blocked = ControlObstacle(response, state, ObstacleWindow(ObstacleTable(obstacles), 0.0, HORIZON), ROBOT, MARGIN)
    situation = Situation(response, state, goal, LIMITS, 0.0, HORIZON, 0.1, HOLD)
    return Task(situation, preferred_control(Arrive().aims(situation)), blocked)


def anything(k: int, rng: np.random.Generator) -> Obstacle:
    """A disc of 1 m on a circle, on quintic polynomials from stop to stop, or on a sampled track."""
    body = Disc(1.0)
    if k % 3 == 0:
        center, phase = rng.uniform(-20.0, 20.0, 2), rng.uniform(0.0, 2.0 * np.pi)
        return Obstacle(body, Circular(center, rng.uniform(5.0, 15.0), rng.uniform(2.0, 8.0), phase))
    if k % 3 == 1:
        stops = np.concatenate([rng.uniform(-25.0, 25.0, (1, 2)), rng.uniform(-12.0, 12.0, (5, 2))]).cumsum(axis=0)
        powers = np.zeros((5, 6, 2))
        powers[:, 0] = stops[:-1]
        for power, weight in ((3, 10.0), (4, -15.0), (5, 6.0)):
            powers[:, power] = weight * np.diff(stops, axis=0) / 2.0**power
        return Obstacle(body, PiecewisePolynomial(np.full(5, 2.0), powers, -1.0))
    times = np.arange(-1.0, 9.01, 0.2)
    return Obstacle(body, Sampled(times, wander(times, rng.uniform(-20.0, 20.0, 2), rng), "smooth"))


def wander(times: np.ndarray, middle: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Positions (n, 2) [m] on a curve about `middle` (2,), at about 3 m/s."""
    rates, phases = rng.uniform(0.3, 1.0, (2, 3)), rng.uniform(0.0, 2.0 * np.pi, (2, 3))
    return middle + 3.0 * np.sin(rates * times[:, None, None] + phases).sum(axis=2)


def classical(task: Task) -> Task:
    """The same state with a velocity obstacle: a jump of the velocity, constant velocities of the obstacles."""
    now, response, forecast = task.situation.now, Velocity(), method("vo").forecast
    seen = [predicted(obstacle, forecast, now) for obstacle in task.blocked.obstacles.obstacles]
    blocked = ControlObstacle(
        response, task.blocked.state, ObstacleWindow(seen, now, HORIZON), ROBOT, task.blocked.margin
    )
    situation = replace(task.situation, response=response)
    return Task(situation, preferred_control(Arrive().aims(situation)), blocked)
