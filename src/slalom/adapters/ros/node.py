"""The core of a node: messages in, commands out. It reads no clock and no topic, so that a replay repeats it."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from math import ceil
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.adapters.ros.messages import (
    READERS,
    SECOND,
    Frames,
    Odometry,
    Placed,
    Placement,
    grid_cells,
    heading_of,
    markers,
    nanoseconds,
    occupancy_grid,
    odometry,
    placed_in,
    rotation,
    seconds,
    xyz,
)
from slalom.base.checks import GOAL, Array, has, not_negative, shown, text
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import OCCUPIED, REST
from slalom.decision import Decision
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.occupancy import OccupancyTable
from slalom.vehicle.driver import Driver, DriveStatus
from slalom.vehicle.navigator import VehicleNavigator

# Commands of a node to a robot, and their messages.


class Command(NamedTuple):
    """Command for a period from the time of an odometry on, or without one in time to brake."""

    stamp: int  # [ns]
    linear: Array  # (2,) [m/s] in the frame of the body, at the end of the period
    angular: float  # [rad/s] at the end of the period
    acceleration: Array  # (2,) [m/s^2] in the frame of the body, mean of the period; of the point ahead of the axle
    decision: Decision
    status: DriveStatus
    sentence: str  # of the status

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


EARLY_DECISION: Final = 0.9
"""[1] Least time since the last decision, as a share of the period, after which odometry leads to the next one.
Odometry comes with jitter: at 1, a message that is early by a microsecond costs a whole period. Smaller: decisions come
more often than once a period, if odometry does."""


LATE: Final = 1000
"""[ns] after the timeout of odometry at which the first command to brake is made. 0: rounding decides whether it is."""


FOREVER: Final = 1 << 63
"""[ns] A time that does not come."""


KINDS: Final = {
    "nav_msgs/msg/Odometry": ("pose", "twist", "child_frame_id"),
    "visualization_msgs/msg/MarkerArray": ("markers",),
    "derived_object_msgs/msg/ObjectArray": ("objects",),
    "costmap_converter_msgs/msg/ObstacleArrayMsg": ("obstacles",),
    "people_msgs/msg/People": ("people",),
    "people_msgs/msg/PositionMeasurementArray": ("people", "cooccurrence"),
    "vision_msgs/msg/Detection3DArray": ("detections",),
    "nav_msgs/msg/OccupancyGrid": ("info", "data"),
    "map_msgs/msg/OccupancyGridUpdate": ("x", "y", "width", "height", "data"),
    "nav_msgs/msg/Path": ("poses",),
    "geometry_msgs/msg/PoseStamped": ("header", "pose"),
    "tf2_msgs/msg/TFMessage": ("transforms",),
}
"""Messages that a node takes, and the fields by which it recognises them, in this order."""


@dataclass(eq=False)
class Node:
    """A driver that decides at odometry messages, at most once in each period.

    `receive` takes every message. The time of a decision is the stamp of its odometry. Commands are therefore a
    function of the messages in their order: equal messages give equal bits, live or from a bag. `overdue` has the
    commands where no later odometry came: a function of the times of receipt. The clock of the driver is therefore that
    of odometry: one before the last decision is a clock that has jumped back, see `Driver`. Of a message with
    detections only those are left out that its reader refuses.

    Attributes:
        driver: decides, see `Driver`. frame: the fixed frame, in which the odometry is.
        namespaces: those of markers that are obstacles; None: all.
        occupied: [%] least value of an occupied cell of a map. unknown: whether unknown cells are occupied.
        stop: whether the robot stops at its goal. tolerance: [m] of the goal.
        sigmas: standard deviations of the measured position, by its covariance, by which the margin grows.
    """

    driver: Driver
    frame: str = "odom"
    namespaces: Collection[str] | None = None
    occupied: float = OCCUPIED
    unknown: bool = False
    stop: bool = True
    tolerance: float = 0.2
    sigmas: float = 0.0
    _goal: "Placed[Goal] | None" = field(default=None, init=False, repr=False)
    _map: "Placed[OccupancyTable] | None" = field(default=None, init=False, repr=False)
    _known: OccupancyTable | None = field(default=None, init=False, repr=False)
    _grid: tuple[Any, ...] | None = field(default=None, init=False, repr=False)
    _first: int | None = field(default=None, init=False, repr=False)
    _decided: int | None = field(default=None, init=False, repr=False)  # [ns] at odometry, the last time
    _odometry: tuple[int, Odometry] | None = field(default=None, init=False, repr=False)  # [ns] of receipt
    _due: int = field(default=0, init=False, repr=False)  # [ns] of receipt, of the next command without odometry

    def __post_init__(self) -> None:
        has(self.driver, ("locate", "command", "lose"), "a Driver", "driver")
        self.frames = Frames(text(self.frame, "frame"))
        self.sigmas = not_negative(self.sigmas, "sigmas")

    def receive(self, message: Any, at: int | None = None) -> Command | None:
        """The command after an odometry, if it is time and there is a goal; None after any other message.

        at: [ns] time of receipt on any clock, which `overdue` takes too; None: the stamp of the odometry.

        Raises:
            InvalidInput: a message of another kind (see KINDS); another one than of detections that its reader refuses;
                an odometry in another frame; input that `Navigator.decide` refuses.
        """
        kind = next((k for k, names in KINDS.items() if all(hasattr(message, n) for n in names)), None)
        if kind == "nav_msgs/msg/Odometry":
            return self._at_odometry(odometry(message), at)
        if kind == "nav_msgs/msg/OccupancyGrid":
            self._take_map(message)
        elif kind == "map_msgs/msg/OccupancyGridUpdate":
            self._update_map(message)
        elif kind in ("nav_msgs/msg/Path", "geometry_msgs/msg/PoseStamped"):
            self._take_goal(message)
        elif kind == "tf2_msgs/msg/TFMessage":
            self.frames.update(message)
        elif kind is None:
            raise InvalidInput(f"message: expected one of {', '.join(KINDS)}; found {type(message).__name__}")
        else:
            self._take_tracks(message)
        return None

    def overdue(self, at: int) -> list[Command]:
        """The commands up to a time of receipt [ns] at which no odometry had come in time: the robot brakes to rest.

        One a period from `Driver.state_timeout` after the last odometry on, up to the first one at rest.
        """
        made: list[Command] = []
        if self._odometry is None or self._goal is None:
            return made
        received, seen = self._odometry
        while self._due <= at:
            command = self._command(seen, seen.stamp + self._due - received)
            made.append(command)
            rests = max(*np.abs(command.linear), abs(command.angular)) <= REST
            self._due = FOREVER if rests else self._due + round(self.driver.navigator.period * SECOND)
        return made

    def head_for(self, goal: Goal) -> None:
        """Take a goal in the fixed frame, in place of the one before."""
        has(goal, *GOAL, "goal")
        self._head_for(Placed(self.frame, lambda _: goal))

    def _head_for(self, goal: "Placed[Goal]") -> None:
        self._goal = goal

    @property
    def arrived(self) -> bool:
        """Whether the robot has stopped at its goal, see `Driver`."""
        return self.driver.arrived

    def _take_tracks(self, message: Any) -> None:
        field = next(each for each in READERS if hasattr(message, each))
        seen: dict[int, list[tuple[Any, ...]]] = {}
        for each in getattr(message, field):
            alone = SimpleNamespace(**{"header": getattr(message, "header", None), field: [each]})
            try:
                if field == "markers":
                    read = list(markers(alone, self.frames, self.namespaces))
                else:
                    read = list(READERS[field](alone, self.frames))
            except InvalidInput as error:
                self.driver.lose(error)
                continue
            for one in read:
                seen.setdefault(one.stamp, []).append(one[1:])
        if not getattr(message, field) and hasattr(message, "header"):
            seen[nanoseconds(message.header, field)] = []
        for stamp, at_once in sorted(seen.items()):
            self.driver.see(self._since_first(stamp), at_once)

    @property
    def unused(self) -> Counter[str]:
        """Numbers of inputs that were not used, see `Driver.unused`."""
        return self.driver.unused

    def _since_first(self, stamp: int) -> float:
        """Time [s] since the first stamp: since 1970, the last digits of seconds would be lost."""
        self._first = stamp if self._first is None else self._first
        return seconds(stamp - self._first)

    def _take_map(self, message: Any) -> None:
        """Make obstacles of a map; one that is published again unchanged costs nothing."""
        info, cells = message.info, np.asarray(message.data, dtype=np.int8)
        at = (*xyz(info.origin.position, "grid.info.origin.position"), repr(info.origin.orientation))
        key = (cells.tobytes(), info.width, info.height, info.resolution, at, message.header.frame_id)
        if key != self._grid:
            self._grid = key
            self._place(occupancy_grid(message, self.occupied, self.unknown), message.header.frame_id)

    def _update_map(self, message: Any) -> None:
        """Make obstacles of a map with a part that has changed."""
        if self._known is None or self._grid is None:
            raise InvalidInput("grid update: expected a nav_msgs/OccupancyGrid before, found none")
        of_map = self._grid[-1]
        if message.header.frame_id != of_map:
            found = shown(message.header.frame_id)
            raise InvalidInput(f"grid update: header.frame_id: expected {of_map!r}, as of the map, found {found}")
        part = grid_cells(message, message, "grid update")
        # A map that is published again as it was before is then another one.
        self._grid = None, of_map
        self._place(self._known.updated(part, int(message.y), int(message.x)), of_map)

    def _place(self, known: OccupancyTable, frame: str) -> None:
        self._known, self._map = known, Placed(frame, lambda place: placed_in(known, place))

    def _take_goal(self, message: Any) -> None:
        """The goal of a pose or a path; for a vehicle with the heading of the last pose.

        A quaternion of zeros is no heading, nor are those of a path of which none turns: many planners set none.
        """
        is_path = hasattr(message, "poses")
        poses = [each.pose for each in message.poses] if is_path else [message.pose]
        if not poses:
            raise InvalidInput("path.poses: expected at least one pose, found none")
        points = np.array([xyz(pose.position, "goal.position")[:2] for pose in poses])
        set_ones = [each for each in (pose.orientation for pose in poses) if any(getattr(each, k) for k in "xyzw")]
        headings = [heading_of(rotation(each, "goal.orientation")) for each in set_ones]
        wheels = isinstance(self.driver.navigator, VehicleNavigator)
        heads = wheels and len(headings) == len(poses) and (not is_path or any(headings))

        def placed(place: Placement) -> Goal:
            heading = place.heading + headings[-1] if heads else None
            if np.all(points == points[0]):
                return Goal(Stationary(place.point(points[0])), self.tolerance, self.stop, heading)
            return PathGoal(place.point(points), None, self.tolerance, self.stop, heading=heading)

        self._head_for(Placed(message.header.frame_id, placed))

    def _at_odometry(self, seen: Odometry, at: int | None) -> Command | None:
        if seen.frame != self.frame:
            raise InvalidInput(f"odometry.header.frame_id: expected {self.frame!r}, found {seen.frame!r}")
        driver = self.driver
        wheels = isinstance(driver.navigator, VehicleNavigator)
        state = seen.pose if wheels else State(seen.position, seen.velocity)
        driver.locate(self._since_first(seen.stamp), state, self.sigmas * seen.error)
        since = np.inf if self._decided is None else seen.stamp - self._decided
        if self._odometry is None or since < 0 or seen.stamp > self._odometry[1].stamp:
            received = seen.stamp if at is None else at
            self._odometry, self._due = (received, seen), received + ceil(driver.state_timeout * SECOND) + LATE
        if self._goal is None or 0 <= since < EARLY_DECISION * driver.navigator.period * SECOND:
            return None
        self._decided = seen.stamp
        return self._command(seen, seen.stamp)

    def _command(self, seen: Odometry, stamp: int) -> Command:
        """The command at a time [ns] after an odometry."""
        driver, period = self.driver, self.driver.navigator.period
        assert self._goal is not None
        goal = self._goal.at(self.frames, "goal")
        if goal is not driver.goal:
            driver.head_for(goal)
        if self._map is not None:
            driver.walls = self._map.at(self.frames, "grid")
        now = self._since_first(stamp)
        drive = driver.command(now)
        assert drive.decision is not None
        body = Placement(seen.position, seen.heading).axes
        acceleration = drive.decision.manoeuvre.mean_acceleration(now, period) @ body
        if isinstance(drive.command, tuple):
            linear, angular = np.array([drive.command.speed, 0.0]), drive.command.turn
        else:
            linear, angular = drive.command @ body, 0.0
        return Command(stamp, linear, angular, acceleration, drive.decision, drive.status, drive.sentence)
