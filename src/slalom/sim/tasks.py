"""Tasks over time: stations, the robots' work between them, and where robots wait."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import shapely

from slalom.base.checks import (
    Array,
    Checked,
    NotNegative,
    check_fields,
    flag,
    has,
    known,
    listing,
    not_negative,
    number,
    text,
    vector,
    whole,
)
from slalom.base.errors import InvalidInput
from slalom.fleet.routes import CONTACT, walls_at_rest
from slalom.kernels.arrays import Indices
from slalom.obstacle import Obstacle


@dataclass(frozen=True)
class Drawn:
    """A number for each task, uniform from `first` to `last`; the seed decides."""

    first: NotNegative
    last: NotNegative
    seed: int

    def __post_init__(self) -> None:
        check_fields(self)
        whole(self.seed, "seed")


@dataclass(frozen=True, eq=False)
class Station:
    """A position at which robots serve tasks.

    Attributes:
        at: (2,) [m]. places: number of robots that it serves at once. The first place is `at`; the others are the
            nearest positions around it that keep the distance `Places.apart`.
        service: [s] for which a robot rests there; a number, or drawn for each task.

    Raises:
        InvalidInput: a position in space, a service below 0, no place.
    """

    name: str
    at: Checked = Checked(vector)
    places: int = 1
    service: float | Drawn = 0.0

    def __post_init__(self) -> None:
        text(self.name, "name")
        vector(self.at, f"{self.name}.at", 2)
        whole(self.places, f"{self.name}.places", 1)
        if not isinstance(self.service, Drawn):
            not_negative(self.service, f"{self.name}.service")


@dataclass(frozen=True)
class Task:
    """A ride from a station to another one, known from a `time` [s] on; `robot`: the only one that may serve it."""

    time: float
    origin: str
    destination: str
    robot: str = ""


Assign: TypeAlias = Callable[[float, Sequence[Task], Mapping[str, Array]], Sequence[tuple[Task, str]]]
"""The tasks to begin at a time [s], each with the name of its robot; of waiting tasks, the oldest first, and of the
positions (2,) [m] of free robots by name."""


@dataclass(frozen=True, eq=False)
class Tasks:
    """Tasks that robots serve one after the other: to the origin, its service, to the destination, its service.

    A free robot goes to its goal and rests there. The oldest task is served first, by the nearest free robot.

    Attributes:
        stations: two or more. listed: tasks with their times. rate: tasks a minute that arrive at random (a Poisson
            process from the start on), from one of `origins` to another one of `destinations`; by default all stations.
        seed: of the tasks at random. route: whether shortest paths around obstacles at rest lead to stations and goals.
        assign: function that chooses robots for tasks, see `Assign`; None: the nearest ones.

    Raises:
        InvalidInput: stations of one name, an unknown one, a task to its origin, no tasks.
    """

    stations: tuple[Station, ...]
    listed: tuple[Task, ...] = ()
    rate: float = 0.0
    seed: int = 0
    origins: tuple[str, ...] = ()
    destinations: tuple[str, ...] = ()
    route: bool = False
    assign: Assign | None = None

    def __post_init__(self) -> None:
        listing(self.stations, "stations", "stations")
        for k, station in enumerate(self.stations):
            has(station, ("at", "places", "service"), "a Station", f"stations[{k}]")
        names = [station.name for station in self.stations]
        if len(set(names)) < max(2, len(names)):
            raise InvalidInput(f"stations: expected two or more, each of another name, found {names}")
        not_negative(self.rate, "rate")
        whole(self.seed, "seed")
        object.__setattr__(self, "route", flag(self.route, "route"))
        for key in ("origins", "destinations"):
            listing(getattr(self, key), "names of stations", key)
            for name in getattr(self, key):
                known(name, key, names)
            object.__setattr__(self, key, tuple(getattr(self, key)) or tuple(names))
        if self.rate and len(self.destinations) == 1 and self.destinations[0] in self.origins:
            raise InvalidInput(f"destinations: expected another one than each origin, found {self.destinations[0]!r}")
        listing(self.listed, "tasks", "listed")
        for k, task in enumerate(self.listed):
            has(task, ("time", "origin", "destination", "robot"), "a Task", f"listed[{k}]")
            number(task.time, f"listed[{k}].time")
            for key in ("origin", "destination"):
                known(getattr(task, key), f"listed[{k}].{key}", names)
            if task.origin == task.destination:
                raise InvalidInput(f"listed[{k}].destination: expected another one than the origin {task.origin!r}")
        if not self.rate and not self.listed:
            raise InvalidInput("rate: expected one above 0, or listed tasks; found neither")
        if self.assign is not None:
            has(self.assign, ("__call__",), "a function", "assign")

    def until(self, start: float, end: float) -> list[Task]:
        """The tasks of a run from `start` to `end` [s] in the order of their times."""
        rng = np.random.default_rng([self.seed, len(self.stations)])
        found, now = [task for task in self.listed if task.time <= end], start
        while self.rate:
            now += rng.exponential(60.0 / self.rate)
            if now > end:
                break
            origin = self.origins[rng.integers(len(self.origins))]
            others = tuple(name for name in self.destinations if name != origin)
            found.append(Task(now, origin, others[rng.integers(len(others))]))
        return sorted(found, key=lambda task: task.time)

    def service(self, station: int, task: int) -> float:
        """The time [s] for which a station serves a task; both are numbers from 0."""
        given = self.stations[station].service
        if not isinstance(given, Drawn):
            return given
        return float(np.random.default_rng([given.seed, station, task]).uniform(given.first, given.last))


class Places(NamedTuple):
    """Where robots rest at stations and beside them."""

    apart: float  # [m] between any two of these places, and between them and goals
    at: tuple[Array, ...]  # by station (places, 2) [m]
    waiting: Array  # (w, 2) [m]
    order: Indices  # (stations, w) numbers of waiting places: those in sight of the station first, then by distance


class Body(NamedTuple):
    """A robot as places depend on it."""

    name: str
    radius: float  # [m]
    start: Array  # (2,) [m]
    goal: Array  # (2,) [m] where it rests without a task


def places_of(tasks: Tasks, robots: Sequence[Body], obstacles: Sequence[Obstacle], margin: float) -> Places:
    """The places of stations, and waiting places for all robots.

    Let r be the largest radius and m the `margin` [m]. Places are at least 4 r + 3 m apart: a robot passes between two
    robots at rest, with the margin on either side. So no robot at rest closes the way out of a station. Waiting places
    are at least 3 r + 2 m from walls: a robot passes there, too.

    Raises:
        InvalidInput: a station or goal nearer than r + m to walls, or cut off from the others; stations that are too
            near to each other or to a goal, goals that overlap; no room for the places of a station, or to wait.
    """
    most = max(robot.radius for robot in robots)
    apart, goals = 4.0 * most + 3.0 * margin, np.array([robot.goal for robot in robots])
    first = np.array([station.at for station in tasks.stations])
    ends = np.concatenate([first, goals, [robot.start for robot in robots]])
    around = apart * (2.0 + np.ceil(np.sqrt(len(robots) + sum(station.places for station in tasks.stations))))
    low, high = ends.min(axis=0) - around, ends.max(axis=0) + around
    walls = walls_at_rest(obstacles)
    blocked = shapely.union_all(shapely.buffer(walls.shapes, walls.radii + most + margin))
    parts = shapely.get_parts(shapely.box(*low, *high).difference(blocked))
    away = shapely.distance(parts, shapely.Point(first[0]))
    free = parts[int(np.argmin(away))]
    names = [f"station {station.name!r}" for station in tasks.stations]
    names += [f"goal of {robot.name!r}" for robot in robots]
    for name, place in zip(names, np.concatenate([first, goals])):
        if shapely.distance(free, shapely.Point(place)) > CONTACT:
            expected = f"expected a place {most + margin:g} m or more from walls with a way to {names[0]}"
            raise InvalidInput(f"{name}: {expected}, found {place}")
    _refuse_near(names, first, goals, apart, 2.0 * most + margin)
    shapely.prepare(free)
    at = list[Array]()
    for k, station in enumerate(tasks.stations):
        others = np.concatenate([first[np.arange(len(first)) != k], goals, *at])
        at.append(_side_by_side(station, others, apart, free))
    waiting, order = _waiting(at, goals, apart, free, shapely.buffer(free, -2.0 * most - margin), low, high)
    if len(waiting) < len(robots):
        raise InvalidInput(
            f"stations: expected room for {len(robots)} robots to wait, {apart:g} m apart and "
            f"{3.0 * most + 2.0 * margin:g} m from walls, found {len(waiting)} places"
        )
    return Places(apart, tuple(at), waiting, order)


def _refuse_near(names: Sequence[str], stations: Array, goals: Array, apart: float, touch: float) -> None:
    """Raise InvalidInput for stations nearer than `apart` [m] to others or to goals, and goals nearer than `touch`."""
    places, n = np.concatenate([stations, goals]), len(stations)
    for k, place in enumerate(places):
        least = np.where(np.arange(k) < n, apart, touch)
        short = np.flatnonzero(np.linalg.norm(places[:k] - place, axis=1) < least - CONTACT)
        if short.size:
            j = int(short[0])
            gap = float(np.linalg.norm(places[j] - place))
            raise InvalidInput(f"{names[k]}: expected one {least[j]:g} m or more from the {names[j]}, found {gap:g} m")


def _side_by_side(station: Station, others: Array, apart: float, free: shapely.Geometry) -> Array:
    """The places (n, 2) [m] of a station: its position, and the nearest ones on a square grid around it in sight."""
    reach = int(np.ceil(np.sqrt(station.places))) + 1
    steps = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
    grid = station.at + apart * steps[np.argsort(np.linalg.norm(steps, axis=1), kind="stable")]
    lines = shapely.linestrings(np.stack(np.broadcast_arrays(station.at, grid[1:]), axis=1))
    clear = np.linalg.norm(grid[1:, None] - others, axis=2).min(axis=1) >= apart - CONTACT
    found = np.concatenate([grid[:1], grid[1:][shapely.covers(free, lines) & clear]])[: station.places]
    if len(found) < station.places:
        raise InvalidInput(
            f"station {station.name!r}: expected room for {station.places} places, {apart:g} m apart, "
            f"found {len(found)}"
        )
    return found


def _waiting(
    at: Sequence[Array],
    goals: Array,
    apart: float,
    free: shapely.Geometry,
    wide: shapely.Geometry,
    low: Array,
    high: Array,
) -> tuple[Array, Indices]:
    """The waiting places (w, 2) [m] in a `wide` area, and their order (stations, w).

    Those near to stations are chosen first.
    """
    places, kept = np.concatenate(at), np.empty((0, 2))
    axes = [np.arange(a, b, 0.5 * apart) for a, b in zip(low, high)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[shapely.contains_xy(wide, grid)]
    for others in (places, goals):
        grid = grid[np.linalg.norm(grid[:, None] - others, axis=2).min(axis=1) >= apart] if len(grid) else grid
    away = np.linalg.norm(grid[:, None] - places, axis=2).min(axis=1) if len(grid) else np.empty(0)
    for place in grid[np.argsort(away, kind="stable")]:
        if np.linalg.norm(kept - place, axis=1).min(initial=np.inf) >= apart - CONTACT:
            kept = np.vstack([kept, place])
    order = []
    for own in at:
        lines = shapely.linestrings(np.stack(np.broadcast_arrays(own[0], kept), axis=1)) if len(kept) else np.array([])
        hidden = ~shapely.covers(free, lines)
        order.append(np.lexsort((np.linalg.norm(kept - own[0], axis=1), hidden)))
    return kept, np.array(order, dtype=np.int64)


COLUMNS: Final = (
    *("time", "origin", "destination", "robot", "given", "begun", "left", "reached", "done", "way", "free_way"),
)
"""Columns of the tasks of a run: numbers of stations and of the robot, -1 without one; times [s], inf before them: of
arrival, when a robot got the task, begin and end of the service at the origin, and at the destination; the way [m] that
the robot drove for the task, and the shortest one around obstacles at rest."""


def task_figures(run: Any) -> dict[str, float]:
    """The figures of the tasks of a recording; none without tasks.

    A task waits from its arrival until its service begins at the origin, or to the end of the run. Waiting times [s]
    are of all tasks that have arrived: 50 %, 99 %, the longest. `way_over_free` is the way that robots drove for the
    tasks done over the shortest one. `efficiency` is the time that these take without other robots at maximum speed,
    as a share of the time of all robots.
    """
    if run.tasks is None:
        return {}
    end, elapsed = float(run.times[-1]), float(run.times[-1] - run.times[0])
    column = dict(zip(COLUMNS, run.tasks[run.tasks[:, 0] <= end].T))
    waits = np.minimum(column["begun"], end) - column["time"]
    done = np.isfinite(column["done"])
    each = {name: values[done] for name, values in column.items()}
    fastest = np.array([limits.max_speed for limits in run.limits])[each["robot"].astype(np.int64)]
    services = each["left"] - each["begun"] + each["done"] - each["reached"]
    busy = float((each["free_way"] / fastest + services).sum())
    p50, p99, longest = np.quantile(waits, [0.5, 0.99, 1.0]).tolist() if len(waits) else [0.0] * 3
    return {
        "tasks": float(len(waits)),
        "tasks_done": float(done.sum()),
        "tasks_per_hour": 3600.0 * float(done.sum()) / elapsed if elapsed else 0.0,
        "waiting_50": p50,
        "waiting_99": p99,
        "waiting_longest": longest,
        "way_over_free": float(each["way"].sum() / each["free_way"].sum()) if done.any() else np.inf,
        "efficiency": busy / (elapsed * len(run.limits)) if elapsed else 0.0,
    }
