"""The core of a node: messages in, commands out. It reads no clock and no topic, so that a replay repeats it."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.adapters.ros.messages import SECOND, Frames, Odometry, Placed, Placement, odometry, seconds, xyz
from slalom.adapters.ros.tracked import markers, objects, obstacles, occupancy_grid, placed_in
from slalom.base.checks import GOAL, Array, has, text
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import OCCUPIED
from slalom.decision import Decision
from slalom.decision.navigator import Navigator
from slalom.decision.objective import FollowVelocity
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.occupancy import OccupancyTable
from slalom.perception.tracker import Tracker
from slalom.vehicle.decision import VehicleDecision
from slalom.vehicle.navigator import VehicleNavigator

# ---------------------------------------------------------------------------------------------------------------------
# Commands of a node to a robot, and their messages.


class Command(NamedTuple):
    """Command for a period from the time of an odometry on."""

    stamp: int  # [ns]
    linear: Array  # (2,) [m/s] in the frame of the body, at the end of the period
    angular: float  # [rad/s] at the end of the period
    acceleration: Array  # (2,) [m/s^2] in the frame of the body, mean of the period; of the point ahead of the axle
    decision: Decision

    def twist(self, kinds: Any) -> Any:
        """A geometry_msgs/Twist, made of `kinds.Twist` and `kinds.Vector3`."""
        linear, angular = (*self.linear.tolist(), 0.0), (0.0, 0.0, self.angular)
        return kinds.Twist(linear=_vector3(kinds, linear), angular=_vector3(kinds, angular))

    def accel(self, kinds: Any) -> Any:
        """A geometry_msgs/Accel, made of `kinds.Accel` and `kinds.Vector3`; it does not turn."""
        linear = (*self.acceleration.tolist(), 0.0)
        return kinds.Accel(linear=_vector3(kinds, linear), angular=_vector3(kinds, (0.0, 0.0, 0.0)))


def _vector3(kinds: Any, values: tuple[float, ...]) -> Any:
    return kinds.Vector3(**dict(zip("xyz", values, strict=True)))


# ---------------------------------------------------------------------------------------------------------------------
# The core of a node: messages in, commands out. It reads no clock and no topic, so that a replay repeats it.


EARLY_DECISION: Final = 0.9
"""[1] Least time since the last decision, as a share of the period, after which odometry leads to the next one.

Odometry comes with jitter: at 1, a message that is early by a microsecond costs a whole period. Smaller: decisions come
more often than once a period, if odometry does.
"""


KINDS: Final = {
    "nav_msgs/msg/Odometry": ("pose", "twist", "child_frame_id"),
    "visualization_msgs/msg/MarkerArray": ("markers",),
    "derived_object_msgs/msg/ObjectArray": ("objects",),
    "costmap_converter_msgs/msg/ObstacleArrayMsg": ("obstacles",),
    "nav_msgs/msg/OccupancyGrid": ("info", "data"),
    "nav_msgs/msg/Path": ("poses",),
    "geometry_msgs/msg/PoseStamped": ("header", "pose"),
    "tf2_msgs/msg/TFMessage": ("transforms",),
}
"""Messages that a node takes, and the fields by which it recognises them, in this order."""


@dataclass(eq=False)
class Node:
    """A robot that decides at odometry messages, at most once in each period of `navigator`.

    `receive` takes every message. The time of a decision is the stamp of its odometry. Commands are therefore a
    function of the messages in their order: equal messages give equal bits, live or from a bag.

    Attributes:
        navigator: a `VehicleNavigator` for a robot on wheels, a `Navigator` for one that moves in every direction.
        frame: the fixed frame, in which the odometry is.
        tracker: estimates measured obstacles.
        namespaces: those of markers that are obstacles; None: all.
        occupied: [%] least value of an occupied cell of a map. unknown: whether unknown cells are occupied.
        stop: whether the robot stops at its goal. tolerance: [m] of the goal.
        arrived: whether the robot has stopped at its goal; it then moves only to avoid obstacles, until it is farther
            away than twice the tolerance.
        unused: number of measurements that were too old, or came before.
    """

    navigator: Navigator | VehicleNavigator
    frame: str = "odom"
    tracker: Tracker = field(default_factory=Tracker)
    namespaces: Collection[str] | None = None
    occupied: float = OCCUPIED
    unknown: bool = False
    stop: bool = True
    tolerance: float = 0.2
    unused: int = field(default=0, init=False)
    arrived: bool = field(default=False, init=False)
    _goal: "Placed[Goal] | None" = field(default=None, init=False, repr=False)
    _map: "Placed[OccupancyTable] | None" = field(default=None, init=False, repr=False)
    _grid: tuple[Any, ...] | None = field(default=None, init=False, repr=False)
    _first: int | None = field(default=None, init=False, repr=False)
    _last: Command | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        has(self.navigator, ("decide", "period"), "a Navigator", "navigator")
        self.frames = Frames(text(self.frame, "frame"))

    def receive(self, message: Any) -> Command | None:
        """The command after an odometry, if it is time and there is a goal; None after any other message.

        Raises:
            InvalidInput: a message of another kind (see KINDS) or one that its reader refuses; an odometry in another
                frame, or with a time before the last one; input that `Navigator.decide` refuses.
        """
        kind = next((k for k, names in KINDS.items() if all(hasattr(message, n) for n in names)), None)
        if kind == "nav_msgs/msg/Odometry":
            return self._command(odometry(message))
        if kind == "nav_msgs/msg/OccupancyGrid":
            self._take_map(message)
        elif kind in ("nav_msgs/msg/Path", "geometry_msgs/msg/PoseStamped"):
            self._take_goal(message)
        elif kind == "tf2_msgs/msg/TFMessage":
            self.frames.update(message)
        elif kind is None:
            raise InvalidInput(f"message: expected one of {', '.join(KINDS)}; found {type(message).__name__}")
        else:
            self._take_tracks(message)
        return None

    def head_for(self, goal: Goal) -> None:
        """Take a goal in the fixed frame, in place of the one before."""
        has(goal, *GOAL, "goal")
        self._head_for(Placed(self.frame, lambda _: goal))

    def _head_for(self, goal: "Placed[Goal]") -> None:
        self._goal, self.arrived = goal, False

    def _take_tracks(self, message: Any) -> None:
        if hasattr(message, "markers"):
            seen = list(markers(message, self.frames, self.namespaces))
        else:
            seen = list((objects if hasattr(message, "objects") else obstacles)(message, self.frames))
        for stamp, id, position, velocity, shape, heading in seen:
            t = self._since_first(stamp)
            self.unused += not self.tracker.update(t, id, position, velocity, shape=shape, heading=heading)

    def _since_first(self, stamp: int) -> float:
        """Time [s] since the first stamp: since 1970, the last digits of seconds would be lost."""
        self._first = stamp if self._first is None else self._first
        return seconds(stamp - self._first)

    def _take_map(self, message: Any) -> None:
        """Make obstacles of a map; one that is published again unchanged costs nothing."""
        info, cells = message.info, np.asarray(message.data, dtype=np.int8)
        at = (*xyz(info.origin.position, "grid.info.origin.position"), repr(info.origin.orientation))
        key = (cells.tobytes(), info.width, info.height, info.resolution, at)
        if key != self._grid:
            known = occupancy_grid(message, self.occupied, self.unknown)
            self._grid, self._map = key, Placed(message.header.frame_id, lambda place: placed_in(known, place))

    def _take_goal(self, message: Any) -> None:
        """The goal of a pose or a path."""
        poses = [each.pose for each in message.poses] if hasattr(message, "poses") else [message.pose]
        if not poses:
            raise InvalidInput("path.poses: expected at least one pose, found none")
        points = np.array([xyz(pose.position, "goal.position")[:2] for pose in poses])
        # Planners repeat poses, for example to turn on the spot.
        points = points[[True, *np.any(np.diff(points, axis=0) != 0.0, axis=1).tolist()]]

        def placed(place: Placement) -> Goal:
            if len(points) == 1:
                return Goal(Stationary(place.point(points[0])), self.tolerance, self.stop)
            return PathGoal(place.point(points), None, self.tolerance, self.stop)

        self._head_for(Placed(message.header.frame_id, placed))

    def _command(self, seen: Odometry) -> Command | None:
        if seen.frame != self.frame:
            raise InvalidInput(f"odometry.header.frame_id: expected {self.frame!r}, found {seen.frame!r}")
        last, period = self._last, self.navigator.period
        if self._goal is None or (last and 0 <= seen.stamp - last.stamp < EARLY_DECISION * period * SECOND):
            return None
        now, previous = self._since_first(seen.stamp), None if last is None else last.decision
        goal = self._goal.at(self.frames, "goal")
        self.arrived = self._at_rest_there(seen, goal, now)
        obstacles, wanted = [*self.map, *self.tracker.at(now)], FollowVelocity(np.zeros(2)) if self.arrived else None
        toward = None if self.arrived else goal
        state: Any = seen.pose if isinstance(self.navigator, VehicleNavigator) else State(seen.position, seen.velocity)
        last_one: Any = previous
        decision = self.navigator.decide(state, obstacles, toward, now=now, previous=last_one, objective=wanted)
        self._last = self._following(seen, decision, now)
        return self._last

    def _at_rest_there(self, seen: Odometry, goal: Goal, now: float) -> bool:
        """Whether the robot has stopped at the goal, and since then has not left it by twice the tolerance."""
        if self.arrived:
            return float(np.linalg.norm(goal.position(now) - seen.position)) <= 2.0 * goal.tolerance
        return goal.stop and goal.reached(seen.position, seen.velocity, now)

    @property
    def map(self) -> list[OccupancyTable]:
        """The map as obstacles in the fixed frame; none before a map came, or of an empty one."""
        found = [] if self._map is None else [self._map.at(self.frames, "grid")]
        return [table for table in found if len(table)]

    def _following(self, seen: Odometry, decision: Decision, now: float) -> Command:
        """The command that follows a decision for a period."""
        plan, period = decision.manoeuvre, self.navigator.period
        body = Placement(seen.position, seen.heading).axes
        acceleration = plan.mean_acceleration(now, period) @ body
        if isinstance(decision, VehicleDecision):
            speed, turn = decision.command
            return Command(seen.stamp, np.array([speed, 0.0]), turn, acceleration, decision)
        return Command(seen.stamp, plan.velocity(now + period) @ body, 0.0, acceleration, decision)
