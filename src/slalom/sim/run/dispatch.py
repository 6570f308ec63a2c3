"""The robots of the tasks in a run, and the goals that follow: places of stations, waiting places beside them."""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from slalom.base.checks import Array, listing, shown
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.fleet.routes import CONTACT, RouteMap
from slalom.kernels.arrays import Flags, Indices
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.trajectory import Stationary
from slalom.sim.run.states import RobotStates
from slalom.sim.tasks import COLUMNS

Place = tuple[int, int]
"""A station and one of its places."""


@dataclass
class _Work:
    """What a robot does. It has a task or none, and on the way to a station no place, or one that it has claimed."""

    task: int = -1
    leg: int = 0  # 0 to the origin, 1 to the destination
    queued: bool = False  # it is near the station, in its queue
    spot: int = -1  # its waiting place
    place: Place | None = None  # that it has claimed
    until: float = np.inf  # [s] end of the service; inf before


class Dispatcher:
    """The tasks of a run.

    A robot claims a place of its station when it is nearer than a braking way and the distance of places. If all are
    claimed it rests at the nearest free waiting place. Claims are granted in their order, so every robot has its turn.
    A place is claimed for the way from a waiting place, the service, and the way out, until the next robot fits there.

    Attributes:
        log: (n, COLUMNS) of the tasks of the run in the order of their times; see `tasks.COLUMNS`.
        free: (robots,) whether a robot has no task. Rows are those of `states`.

    Raises:
        InvalidInput: (in `update`) a function `assign` that returns something else than waiting tasks and free robots.
    """

    def __init__(self, states: RobotStates) -> None:
        scenario = states.scenario
        assert scenario.tasks is not None
        self.scenario, self.states = scenario, states
        self.tasks = scenario.tasks
        self.places = scenario.places()
        self._made = self.tasks.until(scenario.start, scenario.start + scenario.duration)
        self._station = {station.name: k for k, station in enumerate(self.tasks.stations)}
        self._row = {robot.name: k for k, robot in enumerate(scenario.robots)}
        self.log = np.full((len(self._made), len(COLUMNS)), np.inf)
        for row, task in zip(self.log, self._made):
            row[:4] = task.time, self._station[task.origin], self._station[task.destination], -1.0
        self.log[:, COLUMNS.index("way") :] = 0.0
        n = len(scenario.robots)
        self._arrived_tasks, self._waiting = 0, deque[int]()
        self._work = [_Work() for _ in range(n)]
        self._holder: dict[Place, int] = {}
        self._queue: list[list[int]] = [[] for _ in self.tasks.stations]
        self._spots: dict[int, int] = {}
        self._last = states.position[:, :2].copy()
        self._radii = np.array([robot.shape.bounding_radius for robot in scenario.robots])
        most, margin = float(self._radii.max()), scenario.largest_margin
        self._touch = 2.0 * most + margin
        limits = [robot.limits for robot in scenario.robots]
        self._reach = np.array([0.5 * one.max_speed**2 / one.braking for one in limits]) + self.places.apart
        self._map = RouteMap(scenario.obstacles, most, margin)
        for k in range(n) if self.tasks.route else ():
            self._head_home(k)

    @property
    def free(self) -> Flags:
        return np.array([work.task < 0 for work in self._work], dtype=np.bool_)

    @property
    def finished(self) -> bool:
        """Whether all tasks of the run are done."""
        return self._arrived_tasks == len(self._made) and not self._waiting and bool(self.free.all())

    def log_of(self, numbers: Indices) -> Array:
        """The log with the `numbers` (robots,) of the rows in place of rows."""
        found, given = self.log.copy(), self.log[:, 3] >= 0.0
        found[given, 3] = numbers[self.log[given, 3].astype(np.int64)]
        return found

    def update(self, now: float) -> None:
        """Set the goals of all robots for the decisions at `now` [s]."""
        position = self.states.position[:, :2]
        for k, driven in enumerate(np.linalg.norm(position - self._last, axis=1).tolist()):
            if self._work[k].task >= 0:
                self.log[self._work[k].task, -2] += driven
        self._last = position.copy()
        self._release()
        for k in range(len(self._work)):
            self._serve(k, now + WHOLE_COUNT * max(1.0, abs(now)))
        while self._arrived_tasks < len(self._made) and self._made[self._arrived_tasks].time <= now:
            self._waiting.append(self._arrived_tasks)
            self._arrived_tasks += 1
        self._assign(now)
        self._claim()

    def _release(self) -> None:
        """Give up the places that robots have left so far that another one fits there."""
        for place, k in list(self._holder.items()):
            away = float(np.linalg.norm(self.states.position[k, :2] - self.places.at[place[0]][place[1]]))
            if self._work[k].place != place and away >= self._touch:
                del self._holder[place]

    def _serve(self, k: int, now: float) -> None:
        """Begin and end the service of a robot."""
        work, arrived = self._work[k], float(self.states.arrived[k])
        if work.place is None:
            return
        begun = COLUMNS.index("begun") + 2 * work.leg
        if work.until == np.inf and np.isfinite(arrived):
            work.until = arrived + self.tasks.service(work.place[0], work.task)
            self.log[work.task, begun] = arrived
        if now < work.until:
            return
        self.log[work.task, begun + 1] = work.until
        work.until, work.place = np.inf, None
        if work.leg == 0:
            self._begin(k, work.task, 1)
        else:
            work.task = -1
            self._head_home(k)

    def _begin(self, k: int, task: int, leg: int) -> None:
        """Send a robot to the origin (leg 0) or the destination (leg 1) of a task."""
        work = self._work[k]
        work.task, work.leg = task, leg
        place = self.places.at[self._to(k)][0]
        self.log[task, -1] += self._length(self._head(k, place), place, k)

    def _to(self, k: int) -> int:
        """The station that a robot with a task heads for."""
        work = self._work[k]
        return int(self.log[work.task, 1 + work.leg])

    def _assign(self, now: float) -> None:
        """Give waiting tasks to free robots."""
        free: list[int] = np.flatnonzero(self.free & self.states.present).tolist()
        if not free or not self._waiting:
            return
        for task, k in self._chosen(free, now):
            self.log[task, 3:5] = k, now
            self._begin(k, task, 0)
            self._waiting.remove(task)

    def _chosen(self, free: list[int], now: float) -> list[tuple[int, int]]:
        """Waiting tasks and the free robots that get them."""
        if self.tasks.assign is not None:
            return self._by_function(free, now)
        found, position = [], self.states.position[:, :2]
        for task in self._waiting:
            only = self._made[task].robot
            able = [k for k in free if not only or self._row[only] == k]
            if able:
                origin = self.places.at[int(self.log[task, 1])][0]
                away = np.linalg.norm(position[able] - origin, axis=1)
                found.append((task, able[int(np.argmin(away))]))
                free.remove(found[-1][1])
        return found

    def _by_function(self, free: list[int], now: float) -> list[tuple[int, int]]:
        assert self.tasks.assign is not None
        names = [self.scenario.robots[k].name for k in free]
        rows = {id(self._made[task]): task for task in self._waiting}
        positions = {name: self.states.position[k, :2].copy() for name, k in zip(names, free)}
        given = self.tasks.assign(now, [self._made[task] for task in self._waiting], positions)
        listing(given, "pairs of a waiting task and the name of a free robot", "assign")
        found = list[tuple[int, int]]()
        for pair in given:
            fits = isinstance(pair, tuple) and len(pair) == 2 and id(pair[0]) in rows and pair[1] in names
            if not fits:
                raise InvalidInput(
                    f"assign: expected pairs of a waiting task and the name of a free robot, each once; "
                    f"found {shown(pair)}"
                )
            names.remove(pair[1])
            found.append((rows.pop(id(pair[0])), self._row[pair[1]]))
        return found

    def _claim(self) -> None:
        """Let robots near their stations claim a place or queue, and grant places in the order of claims."""
        near = []
        for k, work in enumerate(self._work):
            if work.task >= 0 and work.place is None and not work.queued:
                away = float(np.linalg.norm(self.states.position[k, :2] - self.places.at[self._to(k)][0]))
                if away <= self._reach[k]:
                    near.append((away, k))
        for _, k in sorted(near):
            self._work[k].queued = True
            self._queue[self._to(k)].append(k)
        for station, queue in enumerate(self._queue):
            for j in range(len(self.places.at[station])):
                if queue and (station, j) not in self._holder:
                    self._grant(queue.pop(0), (station, j))
            for k in queue:
                if self._work[k].spot < 0:
                    spot = next(one for one in self.places.order[station].tolist() if one not in self._spots)
                    self._spots[spot], self._work[k].spot = k, spot
                    self._head(k, self.places.waiting[spot])

    def _grant(self, k: int, place: Place) -> None:
        work = self._work[k]
        self._holder[place], work.place, work.queued = k, place, False
        self._spots.pop(work.spot, None)
        work.spot = -1
        self._head(k, self.places.at[place[0]][place[1]])

    def _head(self, k: int, place: Array) -> Goal:
        """Send a robot to a place (2,) [m]; it keeps its goal if it heads there already."""
        own = self.states.goal[k]
        if np.array_equal(own.position(0.0), place):
            self.states.head_for(k, own)
        else:
            end = replace(self.scenario.robots[k].goal, trajectory=Stationary(place))
            self.states.head_for(k, self._goal(k, end))
        return self.states.goal[k]

    def _head_home(self, k: int) -> None:
        self.states.head_for(k, self._goal(k, self.scenario.robots[k].goal))

    def _goal(self, k: int, end: Goal) -> Goal:
        """The goal, with a path that leads there if tasks have routes."""
        here, there = self.states.position[k, :2], end.position(0.0)
        if not self.tasks.route or np.linalg.norm(there - here) <= end.tolerance:
            return end
        (path,) = self._map.routes(here[None], there[None], self._radii[k : k + 1])
        return PathGoal(path, None, end.tolerance, True)

    def _length(self, goal: Goal, place: Array, k: int) -> float:
        """The length [m] of the shortest way of a robot to a place (2,) [m]."""
        here = self.states.position[k, :2]
        straight = float(np.linalg.norm(place - here))
        if isinstance(goal, PathGoal):
            return goal.length
        if straight <= CONTACT or not len(self._map.walls.shapes):
            return straight
        (path,) = self._map.routes(here[None], place[None], self._radii[k : k + 1])
        return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
