"""The `scene`, `frames` and `series` messages: what does not move, what moves, and measurements over time."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from slalom.base.checks import Array
from slalom.decision.methods import METHODS
from slalom.live.messages import FORMAT, pack, quantised
from slalom.live.seen import has_left
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Shape
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.sim.measure.recording import Step
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import clearances
from slalom.view.workspace import TIMES, drawn_box

MILLIMETRE: Final = 1e-3
"""[m, m/s, m/s^2, rad] Step of numbers in messages, coarser where 16 bits do not suffice."""


class Scene:
    """The drawn parts of a scenario: the box, and the obstacles that move.

    Attributes:
        low, high: (d,) [m] of the box that is drawn. moving: indices of the obstacles that move.
    """

    def __init__(self, scenario: Scenario, steps: Sequence[Step] = (), box: tuple[Array, Array] | None = None) -> None:
        self.scenario = scenario
        self.moving = [k for k, o in enumerate(scenario.obstacles) if not o.at_rest]
        self.low, self.high = box or _box(scenario, steps)

    def message(self, method: str, *, live: bool, notes: Sequence[str] = (), extra: dict[str, Any]) -> bytes:
        """Return the `scene` message. `extra` are further fields, such as the number of undoable changes."""
        scenario, shapes = self.scenario, _Shapes()
        robots = [
            {
                "name": robot.name,
                "shape": shapes.index(robot.shape),
                "radius": robot.shape.bounding_radius,
                "max_speed": robot.limits.max_speed,
                "max_acceleration": robot.limits.max_acceleration,
                "goal": robot.goal.position(scenario.start).tolist(),
                "tolerance": robot.goal.tolerance,
                "stop": robot.goal.stop,
                "path": robot.goal.points.tolist() if isinstance(robot.goal, PathGoal) else None,
                "method": None if robot.method is None else robot.method.name,
            }
            for robot in scenario.robots
        ]
        obstacles = [
            {
                "name": obstacle.name or f"obstacle {k}",
                "shape": shapes.index(obstacle.shape),
                "radius": obstacle.shape.bounding_radius,
                "turns": obstacle.turns,
                "heading": obstacle.angle or 0.0,
                "position": None if k in set(self.moving) else obstacle.trajectory.position(scenario.start).tolist(),
            }
            for k, obstacle in enumerate(scenario.obstacles)
        ]
        fields = {
            "format": FORMAT,
            "title": scenario.name,
            "method": method,
            "methods": {name: method.sentence for name, method in METHODS.items()},
            "dimension": scenario.dimension,
            "start": scenario.start,
            "dt": scenario.dt,
            "duration": scenario.duration,
            "period_steps": scenario.steps_per_decision,
            "horizon": scenario.horizon,
            "margin": scenario.margin,
            "live": live,
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "world": None if scenario.period is None else [x if np.isfinite(x) else None for x in scenario.period],
            "shapes": shapes.listed,
            "robots": robots,
            "obstacles": obstacles,
            "moving": self.moving,
            "notes": [*scenario.notes, *notes],
            **extra,
        }
        return pack("scene", fields, {})

    def frames(self, steps: Sequence[Step], first: int, arrived: Array, *, complete: bool) -> bytes:
        """Return the `frames` message of some steps, of which the first has the number `first`.

        `arrived` (n,) [s] are the times of arrival known so far; `complete` says whether the run has ended.
        """
        scenario = self.scenario
        positions = np.array([step.positions for step in steps])
        times = scenario.start + scenario.dt * (first + np.arange(len(steps), dtype=np.float64))
        obstacles, directions = self._obstacles(times)
        names = [name for step in steps for name in step.outcomes]
        table = sorted(set(names))
        outcomes = np.array([table.index(name) for name in names], dtype=np.uint8).reshape(len(steps), -1)
        speeds = np.array([robot.limits.max_speed for robot in scenario.robots]).max() * np.ones(scenario.dimension)
        velocities = np.array([step.velocities for step in steps])
        fastest = np.maximum(1.1 * speeds, np.abs(velocities).max(axis=(0, 1), initial=0.0))
        accelerations = np.array([step.accelerations for step in steps])
        hardest = np.abs(accelerations).max(axis=(0, 1), initial=1e-3)
        arrays: dict[str, Any] = {
            "positions": quantised(positions, *self._reach(positions), step=MILLIMETRE, order=2),
            "velocities": quantised(velocities, -fastest, fastest, step=MILLIMETRE, order=1),
            "accelerations": quantised(accelerations, -hardest, hardest, step=MILLIMETRE),
            "outcomes": outcomes,
        }
        if self.moving:
            arrays["obstacles"] = quantised(obstacles, *self._reach(obstacles), step=MILLIMETRE, order=2)
            if directions.any():
                arrays["directions"] = quantised(directions[..., None], [-np.pi], [np.pi], step=MILLIMETRE, order=1)
        fields = {
            "first": first,
            "count": len(steps),
            "outcomes_table": table,
            "arrived": [float(t) if np.isfinite(t) else None for t in arrived],
            "complete": complete,
        }
        return pack("frames", fields, arrays)

    def _reach(self, positions: Array) -> tuple[Array, Array]:
        """Lower and upper limits (d,) of positions, nan ignored, at least the box."""
        flat = positions.reshape(-1, self.scenario.dimension)
        flat = flat[np.isfinite(flat).all(axis=1)]
        return flat.min(axis=0, initial=self.low.min()), flat.max(axis=0, initial=self.high.max())

    def _obstacles(self, times: Array) -> tuple[Array, Array]:
        """Positions (t, m, d) [m] of the moving obstacles, nan where they do not exist; and directions (t, m) [rad]."""
        d = self.scenario.dimension
        positions = np.full((len(times), len(self.moving), d), np.nan)
        directions = np.zeros((len(times), len(self.moving)))
        for column, k in enumerate(self.moving):
            obstacle = self.scenario.obstacles[k]
            first, last = obstacle.trajectory.span
            there = (times >= first) & (times <= last)
            if there.any():
                positions[there, column] = obstacle.trajectory.position(times[there])
                if d == 2 and obstacle.turns:
                    directions[there, column] = np.arctan2(*obstacle.direction(times[there]).T[::-1])
        return positions, directions


def series(scenario: Scenario, steps: Sequence[Step], robot: int, first: int = 0) -> bytes:
    """Return the `series` message: clearance (t,) [m] of one robot to all others at some steps, from `first` on."""
    times = scenario.start + scenario.dt * (first + np.arange(len(steps), dtype=np.float64))
    own = np.array([step.positions[robot] for step in steps])
    shape, least = scenario.robots[robot].shape, np.full(len(steps), np.inf)
    for obstacle in scenario.obstacles:
        begin, end = obstacle.trajectory.span
        there = (times >= begin) & (times <= end)
        if there.any():
            least[there] = np.minimum(least[there], clearances(obstacle, shape, times[there], own[there]))
    for k, other in enumerate(scenario.robots):
        if k != robot:
            still = Obstacle(other.shape, Stationary(np.zeros(scenario.dimension)))
            relative = own - np.array([step.positions[k] for step in steps])
            present = np.array([not has_left(scenario, steps, j, k) for j in range(len(steps))])
            found = clearances(still, shape, times, relative)
            least = np.where(present, np.minimum(least, found), least)
    values = np.where(np.isfinite(least), least, 1e6).astype(np.float32)
    return pack("series", {"robot": robot, "first": first}, {"clearance": values})


class _Shapes:
    """Shapes of a scene, each once."""

    def __init__(self) -> None:
        self.listed: list[list[dict[str, Any]]] = []
        self._known: dict[str, int] = {}

    def index(self, shape: Shape) -> int:
        """Return the number of a shape, as parts with corners and radius."""
        parts = [{"corners": part.corners.tolist(), "radius": part.radius} for part in shape.parts]
        key = repr(parts)
        if key not in self._known:
            self._known[key] = len(self.listed)
            self.listed.append(parts)
        return self._known[key]


def _box(scenario: Scenario, steps: Sequence[Step]) -> tuple[Array, Array]:
    """Lower and upper corner (d,) [m] of the box that is drawn: robots, goals, and the obstacles near them."""
    points = [robot.state.position for robot in scenario.robots]
    radius = max(robot.shape.bounding_radius for robot in scenario.robots)
    if scenario.period is None:
        points += [robot.goal.position(scenario.start) for robot in scenario.robots]
    points += [position for step in steps[:: max(1, len(steps) // TIMES)] for position in step.positions]
    end = scenario.start + (scenario.dt * len(steps) if steps else min(scenario.duration, 3.0 * scenario.horizon))
    return drawn_box(np.array(points), radius, scenario.obstacles, scenario.start, end)
