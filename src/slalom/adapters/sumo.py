"""A robot among the cars of SUMO, which react to it: it decides with slalom and is moved by `moveToXY`.

`Robot` takes the module `libsumo`, or a connection of `traci`, so this module imports neither. SUMO gives positions of
the front of a vehicle and angles clockwise from north; here positions are centres and angles are those of slalom.

SUMO reports a collision where vehicles overlap along a lane. It compares positions across the lane only with
`--lateral-resolution`; without it a robot beside a lane counts as one on it.
"""

from typing import Any, cast

import numpy as np

from slalom.base.errors import InvalidInput
from slalom.decision import Decision
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.shape import Disc, Rectangle
from slalom.model.state import State
from slalom.model.trajectory import Sampled, Stationary, Trajectory
from slalom.model.uncertainty import Uncertainty
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable

FREE = 2
"""`keepRoute` of `moveToXY`: the vehicle is placed anywhere, on the lane there if there is one."""
NO_LANE = -1
SAMPLES = 9
LANES = 6
AHEAD = 0.1
"""Samples of a forecast; lanes that it follows; [m] least distance of its next point."""
REST = 1e-3
"""[m/s] A robot slower than this keeps its heading. Larger: it keeps it longer."""


class Robot:
    """Disc that moves exactly as decided, as the vehicle `name` of a running simulation.

    Cars are rectangles that follow their routes at their present speeds. None is expected to avoid the
    robot, although SUMO makes those behind it brake.

    Args:
        sumo: `libsumo`, or a connection of `traci`. navigator: of a disc, with the step of SUMO as its period.
        name: of a vehicle that was added to the simulation; its type has the diameter of the disc as length and width.
        uncertainty: bound on the distance of cars from their prediction; None: they move as predicted.

    Raises:
        InvalidInput: a robot that is no disc; another period than the step of SUMO.
    """

    def __init__(
        self, sumo: Any, navigator: Navigator, name: str = "robot", uncertainty: Uncertainty | None = None
    ) -> None:
        if not isinstance(navigator.robot, Disc):
            raise InvalidInput(f"navigator: expected a disc as its robot, found {type(navigator.robot).__name__}")
        if not np.isclose(navigator.period, sumo.simulation.getDeltaT()):
            found = f"{navigator.period:g} s"
            raise InvalidInput(
                f"navigator: expected the period {sumo.simulation.getDeltaT():g} s of SUMO, found {found}"
            )
        self.sumo = sumo
        self.navigator = navigator
        self.name = name
        self.radius = navigator.robot.radius
        self.state, self.heading = State((0.0, 0.0), (0.0, 0.0)), 0.0
        self.uncertainty, self.previous = uncertainty, cast(Decision | None, None)

    def place(self, position: Any) -> None:
        """Put the robot at a position (2,) [m], at rest."""
        self.state, self.previous = State(position, (0.0, 0.0)), None
        self._move()

    def step(self, goal: Goal, walls: ObstacleTable | list[Obstacle] | None = None) -> Decision:
        """Decide at the present time, and move the robot to where it is after the next `simulationStep`."""
        now, dt = float(self.sumo.simulation.getTime()), self.navigator.period
        around: list[Obstacle | ObstacleTable] = [*self._cars(now)]
        if walls is not None:
            around += [walls] if isinstance(walls, ObstacleTable) else walls
        self.previous = self.navigator.decide(self.state, around, goal, now=now, previous=self.previous)
        a = self.previous.manoeuvre.mean_acceleration(now, dt)
        p, v = self.state.position, self.state.velocity
        self.state = State(p + dt * v + 0.5 * dt * dt * a, v + dt * a, a)
        self._move()
        return self.previous

    def _move(self) -> None:
        velocity, sumo = self.state.velocity, self.sumo
        if np.hypot(*velocity) > REST:
            self.heading = float(np.arctan2(velocity[1], velocity[0]))
        x, y = self.state.position.tolist()
        heading = self._along_lane(x, y)
        front = self.state.position + self.radius * np.array([np.cos(heading), np.sin(heading)])
        angle = (90.0 - np.degrees(heading)) % 360.0
        sumo.vehicle.moveToXY(self.name, "", NO_LANE, float(front[0]), float(front[1]), angle, FREE)

    def _along_lane(self, x: float, y: float) -> float:
        """Direction [rad] of the nearest lane if the disc at (x, y) [m] covers a part of it, else that of its motion.

        A disc may have any. SUMO takes a vehicle on a lane as a rectangle along that lane, behind its front.
        """
        edge, along, number = self.sumo.simulation.convertRoad(x, y)
        lane = f"{edge}_{number}"
        middle = self.sumo.simulation.convert2D(edge, along, number)
        if np.hypot(x - middle[0], y - middle[1]) > self.radius + 0.5 * self.sumo.lane.getWidth(lane):
            return self.heading
        return float(np.radians(90.0 - self.sumo.lane.getAngle(lane, along)))

    def _cars(self, now: float) -> list[Obstacle]:
        """Cars as rectangles that follow their routes at their present speeds."""
        vehicle, horizon = self.sumo.vehicle, self.navigator.horizon
        times, found = now + np.linspace(0.0, horizon, SAMPLES), []
        for name in vehicle.getIDList():
            if name == self.name:
                continue
            x, y, heading, length, width = body(self.sumo, name)
            speed, shape = float(vehicle.getSpeed(name)), Rectangle(length, width)
            trajectory: Trajectory = Stationary((x, y))
            if speed > REST:
                points = np.array([(x, y), vehicle.getPosition(name), *self._route(name)])
                lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
                along = np.minimum(speed * (times - now), lengths[-1])
                # A car that leaves the network goes on: the path ends beyond the horizon.
                places = np.stack([np.interp(along, lengths, column) for column in points.T], axis=1)
                trajectory = Sampled(times, places, "linear")
            turning: Any = "motion" if speed > REST else heading
            found.append(
                Obstacle(shape, trajectory, name, turning, uncertainty=self.uncertainty, after_end="continues")
            )
        return found

    def _route(self, name: str) -> list[tuple[float, float]]:
        """Points [m] of the lanes ahead of a car."""
        vehicle, lane = self.sumo.vehicle, self.sumo.lane
        here = lane.getShape(vehicle.getLaneID(name)) if vehicle.getLaneID(name) else ()
        steps = np.cumsum([0.0, *np.hypot(*np.diff(np.array(here), axis=0).T)]) if here else np.empty(0)
        ahead = [p for p, s in zip(here, steps) if s > vehicle.getLanePosition(name) + AHEAD]
        after = vehicle.getRoute(name)[vehicle.getRouteIndex(name) + 1 :]
        return [*ahead, *(p for edge in after[:LANES] for p in lane.getShape(f"{edge}_0"))]


def body(sumo: Any, name: str) -> tuple[float, float, float, float, float]:
    """Centre x, y [m], heading [rad], length and width [m] of a vehicle."""
    x, y = sumo.vehicle.getPosition(name)
    heading = np.radians(90.0 - sumo.vehicle.getAngle(name))
    length, width = sumo.vehicle.getLength(name), sumo.vehicle.getWidth(name)
    return x - 0.5 * length * np.cos(heading), y - 0.5 * length * np.sin(heading), float(heading), length, width
