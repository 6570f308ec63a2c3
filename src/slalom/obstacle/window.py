"""Obstacles over a window of time: what all control obstacles of a decision are made of."""

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import groupby
from typing import Any, Final, NamedTuple, Protocol, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array, array, duration, has, number
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import CONTACT_SLACK, OVERLAP, REST
from slalom.forecast.forecast import (
    EXACT,
    AtConstantAcceleration,
    AtConstantVelocity,
    Forecast,
    FromModels,
    FromPast,
    Known,
    Present,
)
from slalom.kernels.arrays import Bodies, Flags, Indices
from slalom.kernels.decision.tables import AtHorizon
from slalom.model.limits import Limits
from slalom.model.shape import Shape
from slalom.model.state import State
from slalom.model.trajectory import Trajectory
from slalom.model.trajectory.kinds import QUADRATIC
from slalom.model.uncertainty import COVERAGES, Adjusted, BoundedError, Uncertainty, coverage_of, until_of, with_share
from slalom.obstacle.obstacle import Headings, Obstacle
from slalom.obstacle.pieces import Reach, merged, no_bodies, pieces_of_each, straight_bodies
from slalom.obstacle.table import (
    NONE_AT_HORIZON,
    ObstacleTable,
    Outlines,
    joined_outlines,
    one_dimension,
    outlines,
    same_dimension,
)
from slalom.obstacle.tracks import Tracks


class Reaction(NamedTuple):
    """What a robot needs to react to errors of a forecast."""

    limits: Limits
    period: float  # [s]
    delay: float = 0.0  # [s]

    @property
    def rise(self) -> float:
        """[s] from rest to the maximum speed."""
        return self.limits.max_speed / self.limits.max_acceleration

    def bounded(self, error: Uncertainty, dimension: int) -> Uncertainty:
        """An error that grows until the robot has reacted, see `Limits.time_to_react`; all sets as that of 0.8."""
        until = self.limits.time_to_react(with_share(error, COVERAGES[1]), self.period, self.delay, dimension)
        return Adjusted(error, until=min(until, until_of(error)))


def predicted(obstacle: Obstacle, forecast: Forecast, now: float, reaction: Reaction | None = None) -> Obstacle:
    """The obstacle on its predicted trajectory from `now` [s] on; the same object if the forecast changes nothing.

    With `FromModels` and the `reaction` of a robot an uncertainty grows until then, and moves on with the motion.
    An obstacle that is predicted to stay at rest keeps its last heading. After the end of its trajectory see
    `Obstacle.after_end`.

    Raises:
        OutsideSpan: the obstacle does not exist at `now`.
        InvalidInput: its trajectory ended before, and what follows is unknown.
    """
    obstacle = obstacle.known_at(now)
    if isinstance(forecast, FromModels):
        ((found,),) = futures([obstacle], replace(forecast, futures=1), now, [0], reaction)
        return found
    trajectory = forecast(obstacle.trajectory, now)
    if trajectory is obstacle.trajectory:
        return obstacle
    if isinstance(forecast, FromPast) and forecast.growth and obstacle.uncertainty is None:
        speed = float(np.linalg.norm(trajectory.velocity(now)))
        obstacle = replace(obstacle, uncertainty=BoundedError(velocity=forecast.growth * speed))
    return _moving(obstacle, trajectory, now)


def futures(
    obstacles: Sequence[Obstacle],
    forecast: Forecast,
    now: float,
    there: Sequence[int],
    reaction: Reaction | None = None,
) -> list[list[Obstacle]]:
    """Obstacles `there`, by number, on each of their predicted trajectories; as `predicted` if there is one.

    With the probabilities of these. `FromModels` uses the past of all obstacles, also of those that have left.
    """
    if not isinstance(forecast, FromModels):
        return [[predicted(obstacles[k], forecast, now)] for k in there]
    known = [obstacles[k].known_at(now) for k in there]
    found: list[list[Obstacle]] = []
    seen = [obstacle.continued.trajectory for obstacle in obstacles]
    rise = 0.0 if reaction is None else reaction.rise
    several = forecast.predictions([one.trajectory for one in known], now, rise, seen)
    for one, k, (each, error) in zip(known, there, several, strict=True):
        own = one.uncertainty or error
        if reaction is not None and own != _NONE:
            own = reaction.bounded(own, one.dimension)
        if len(each) == 1:
            found.append([_moving(one, each[0][1], now, own)])
            continue
        one_of_several = one.probability < 1.0
        owner = one.owner or one.name if one_of_several else f"{one.name} (obstacle {k})"
        found.append(
            [
                replace(_moving(one, trajectory, now, own), probability=one.probability * p, owner=owner)
                for p, trajectory in each
            ]
        )
    return found


_NONE = BoundedError()


def _moving(obstacle: Obstacle, trajectory: Trajectory, now: float, error: Uncertainty = _NONE) -> Obstacle:
    """The obstacle on a predicted trajectory, with this error of it if there is one."""
    changed: dict[str, Any] = {"trajectory": trajectory}
    if error != _NONE:
        changed["uncertainty"] = error
    if isinstance(obstacle.heading, Headings):
        changed["heading"] = float(obstacle.heading.angle(now))
    elif obstacle.turns and _rests(trajectory, now):
        x, y = obstacle.direction(now)
        changed["heading"] = float(np.arctan2(y, x))
    return replace(obstacle, **changed)


def _rests(trajectory: Trajectory, now: float) -> bool:
    """Whether an obstacle is predicted to stay at rest."""
    return bool(np.linalg.norm(trajectory.velocity(now)) <= REST) and not np.any(trajectory.acceleration(now))


def coverages(errors: Iterable[Uncertainty | None]) -> list[float]:
    """Shares of the errors that the sets of obstacles hold, as stated and less, the largest first; [1] without sets."""
    stated = min(map(coverage_of, errors), default=1.0)
    return [stated, *(share for share in COVERAGES[::-1] if share < stated < 1.0)]


def covering(obstacles: Sequence[Obstacle], share: float) -> list[Obstacle]:
    """The obstacles with sets that hold at most a share of the errors; those without such sets as they are."""
    return [replace(o, uncertainty=with_share(o.uncertainty, share)) for o in obstacles]


DERIVATIVES: Final[dict[type, int]] = {Known: 2, Present: 2, AtConstantVelocity: 1, AtConstantAcceleration: 2}
"""Forecasts under which straight obstacles stay so, and how many derivatives of their positions each keeps."""


def are_straight(obstacles: Sequence[Obstacle | ObstacleTable | Tracks], forecast: Forecast) -> list[bool]:
    """Of each whether it is an obstacle whose motion a forecast gives exactly: one quadratic, in a constant heading."""
    # No function is called for each: there are many at every decision.
    return [
        type(forecast) in DERIVATIVES
        and isinstance(one, Obstacle)
        and type(one.trajectory) in QUADRATIC
        and type(one.heading) is float
        and one.uncertainty is None
        for one in obstacles
    ]


class Source(Protocol):
    """Obstacles that come together."""

    @property
    def dimension(self) -> int | None:
        """2 or 3; None if there are none."""

    @property
    def obstacles(self) -> Sequence[Obstacle]:
        """The obstacles of the source, one by one."""

    @property
    def is_passive(self) -> bool:
        """Whether contacts with some of them do not count while the robot is at rest."""

    @property
    def has_futures(self) -> bool:
        """Whether some are futures with a probability below 1."""

    def __len__(self) -> int: ...

    def bodies(self, robot: Shape, start: float, until: Array, horizon: float, reach: Reach | None = None) -> Bodies:
        """Their pieces from `start` on, up to `until` (n,) [s] after it, see `ObstacleTable.bodies`."""

    @property
    def outlines(self) -> Outlines:
        """The outlines of those around which detours lead."""


class _Listed:
    """Obstacles of this decision only, all straight under the `forecast`, or predicted already: None."""

    def __init__(self, given: Sequence[Obstacle], forecast: Forecast | None, now: float) -> None:
        self._given, self._forecast = given, forecast
        self._now, self.dimension = now, one_dimension(obstacle.dimension for obstacle in given)
        self.is_passive = not all(obstacle.contact_at_rest for obstacle in given)
        self.has_futures = any(obstacle.probability < 1.0 for obstacle in given)
        self.uncertainties = [obstacle.uncertainty for obstacle in given]

    def __len__(self) -> int:
        return len(self._given)

    @cached_property
    def obstacles(self) -> Sequence[Obstacle]:
        """The obstacles, one by one."""
        forecast, now = self._forecast, self._now
        return self._given if forecast is None else [predicted(one, forecast, now) for one in self._given]

    def covering(self, share: float) -> "_Listed":
        """The same with sets that hold at most a share of the errors."""
        return _Listed(covering(self._given, share), self._forecast, self._now)

    def bodies(self, robot: Shape, start: float, until: Array, horizon: float, reach: Reach | None = None) -> Bodies:
        """The pieces of all from `start` on, up to `until` (n,) [s] after it; none of those that do not exist then."""
        if self._forecast is None:
            return pieces_of_each(self._given, robot, start, until)
        return straight_bodies(self._given, robot, start, until, DERIVATIVES[type(self._forecast)])

    @cached_property
    def outlines(self) -> Outlines:
        """The outlines of those around which detours lead."""
        return outlines(self.obstacles)


def sources_of(obstacles: Sequence[Obstacle | Source], now: float, end: float) -> list[Source]:
    """Sources as they are, obstacles that follow each other together, as they are known at `now` [s].

    A trajectory that lasts up to the `end` [s] of the window needs no continuation.
    """
    found: list[Source] = []
    plain: list[Obstacle] = []
    for one in obstacles:
        if isinstance(one, Obstacle):
            plain.append(one if one.trajectory.span[1] >= end else one.known_at(now))
            continue
        if plain:
            found.append(_Listed(plain, None, now))
            plain = []
        found.append(one)
    return [*found, _Listed(plain, None, now)] if plain else found


SHALLOW_OVERLAP: Final = 1e-3
"""[m] Depth up to which a robot that overlaps an obstacle may still get deeper while it leaves. Robots that follow
inexactly overlap by less. Larger: others that leave no safe control press a robot deeper into walls. Smaller: robots
that overlap each other on all sides, by micrometres, block each other."""


Obstacles: TypeAlias = Sequence[Obstacle | ObstacleTable | Tracks] | ObstacleTable | Tracks
"""What decisions take as obstacles: obstacles, tables and tracks in any order, or one table or tracks alone."""


class ObstacleWindow:
    """Obstacles over a window of time as cubic pieces.

    Args:
        obstacles: all of one dimension; those that do not exist within the window leave no piece. After the end of
            their trajectories see `Obstacle.after_end`.
        start: absolute time [s] of the decision. horizon: length of the window [s] > 0.
        horizons: (n,) [s] one for each obstacle, from 0 to `horizon`; beyond it that obstacle counts no more.

    Raises:
        InvalidInput: different dimensions, a horizon that is not above 0, something else than obstacles; an obstacle
            whose trajectory ended before the start.
    """

    def __init__(
        self, obstacles: Obstacles, start: float, horizon: float, horizons: npt.ArrayLike | None = None
    ) -> None:
        self._fill(listed(obstacles), number(start, "start"), duration(horizon, "horizon"))
        if horizons is not None:
            self.until = self._each(horizons)

    def _fill(self, given: Sequence[Obstacle | Source], start: float, horizon: float) -> None:
        """Set all attributes, from what is checked."""
        self.start, self.horizon = start, horizon
        self._sources = sources_of(given, start, start + horizon)
        self._counts = [len(source) for source in self._sources]
        self.dimension = one_dimension([source.dimension for source in self._sources])
        # Of some: contacts do not count at rest; their probability is below 1; the robot follows, see `Tracks.braking`.
        self.is_passive = self.has_futures = self.leads = False
        for source in self._sources:
            self.is_passive = self.is_passive or source.is_passive
            self.has_futures = self.has_futures or source.has_futures
            self.leads = self.leads or (isinstance(source, Tracks) and source.leads)
        self.until = np.empty(sum(self._counts))
        self.until.fill(horizon)
        self._at_rest = True
        self._touched_from: tuple[Array, Array, float] | None = None
        self._bodies: dict[Shape, Bodies] = {}
        self._near: tuple[tuple[object, ...], Bodies] | None = None
        self._distances: tuple[tuple[Shape, bytes], Array, Array] | None = None

    @classmethod
    def predicted(
        cls,
        obstacles: Obstacles,
        forecast: Forecast,
        start: float,
        horizon: float,
        reaction: Reaction | None = None,
    ) -> "ObstacleWindow":
        """The obstacles as a forecast predicts them at `start` [s]; later ones only if the forecast contains them.

        reaction: of the robot that predicts them, see `predicted`.
        """
        if not len(all_given := listed(obstacles)):
            return cls(all_given, start, horizon)
        start, horizon = number(start, "start"), duration(horizon, "horizon")
        exact, given = isinstance(forecast, EXACT), list[Obstacle | ObstacleTable | Tracks]()
        for one in all_given:
            if isinstance(one, ObstacleTable):
                table, others = one.split(at_rest=not exact)
                given += [table, *others]
            else:
                given.append(one.with_forecast(forecast) if isinstance(one, Tracks) and not exact else one)
        sources = _foreseen(given, forecast, start, reaction)
        window, first = cls.__new__(cls), 0
        window._fill(sources, start, horizon)
        for source in sources if not forecast.includes_future else ():
            if isinstance(source, ObstacleTable):
                window.until[first : first + len(source)][~source.exist(start)] = 0.0
            first += 1 if isinstance(source, Obstacle) else len(source)
        return window

    def __repr__(self) -> str:
        return f"<ObstacleWindow from {self.start:g} s for {self.horizon:g} s, obstacles: {len(self)}>"

    def __len__(self) -> int:
        return sum(self._counts)

    @cached_property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """All obstacles, one by one."""
        return tuple(obstacle for source in self._sources for obstacle in source.obstacles)

    def obstacle(self, index: int) -> Obstacle:
        """The obstacle of this number, from 0; those of tracks are made one by one."""
        for source, count in zip(self._sources, self._counts):
            if 0 <= index < count:
                return source.obstacle(index) if isinstance(source, Tracks) else source.obstacles[index]
            index -= count
        raise IndexError(f"index: expected a number below {len(self)}")

    def refuse_worlds(self) -> None:
        """Raise InvalidInput for tracks with numbers of worlds: the window is of one world."""
        for source in self._sources:
            if isinstance(source, Tracks):
                source.refuse_worlds("obstacles")

    def at_horizon(self, bodies: Bodies) -> AtHorizon:
        """The obstacles around which detours lead and that are known and exist at the horizon.

        Of those that move the ones among the `bodies`, from whose pieces their places come: those of the window, grown
        by any robot. One that counts for less than the horizon goes on as on average until then.
        """
        if not self._sources:
            return NONE_AT_HORIZON
        found = joined_outlines([source.outlines for source in self._sources], self._counts)
        each, corners = found.at_horizon.each.copy(), found.at_horizon.corners.copy()
        pieces = bodies.pieces
        rows = pieces.times, pieces.points, pieces.turns, bodies.first_piece
        there = kernels.put_at_horizon(
            *(bodies.each, rows, bodies.now, found.owner, found.moves, self.until, self.horizon, each, corners)
        )
        return AtHorizon(each if there.all() else each[there], corners)

    def while_moving(self) -> "ObstacleWindow":
        """The same obstacles, contacts with which count only while the robot moves.

        Without those for which another one of the same name stands, contact with which counts so anyway.
        """
        names = {o.name for o in self.obstacles if not o.contact_at_rest and o.name}
        window = self.without(np.array([o.contact_at_rest and o.name in names for o in self.obstacles], np.bool_))
        window._at_rest = False
        return window

    def positions(self, times: npt.ArrayLike) -> Array:
        """Predicted positions (n, m, d) [m] of the obstacles at times (m,) [s]; nan where they do not exist.

        Of no obstacles (0, m, 1), which fits any dimension.
        """
        return self._over(times, lambda one, t: one.trajectory.position(t))

    def velocities(self, times: npt.ArrayLike) -> Array:
        """Predicted velocities (n, m, d) [m/s] of the obstacles at times (m,) [s], as `positions`."""
        return self._over(times, lambda one, t: one.trajectory.velocity(t))

    def radii(self, times: npt.ArrayLike) -> Array:
        """Radii (n, m) [m] of bounding balls about the positions at times (m,) [s], with their uncertainty."""
        each = np.zeros((len(self), np.size(times)))
        for row, one in zip(each, self.obstacles):
            row[:] = one.shape.bounding_radius
            if one.uncertainty is not None:
                later = np.maximum(np.asarray(times, dtype=np.float64) - self.start, 0.0)
                row += [float(one.uncertainty.radius(t, one.dimension)) for t in later.ravel().tolist()]
        return each

    def _over(self, times: npt.ArrayLike, of: Callable[[Obstacle, Array], Array]) -> Array:
        t = np.asarray(times, dtype=np.float64).reshape(-1)
        found = np.full((len(self), t.size, self.dimension or 1), np.nan)
        for row, one, until in zip(found, self.obstacles, self.until):
            first, last = one.trajectory.span
            there = (t >= first) & (t <= last) & (until > 0.0)
            row[there] = of(one, t[there])
        return found

    def touched_from(self, position: Array, deeper: Array, all_by: float = 0.0) -> "ObstacleWindow":
        """The same obstacles, those that a robot at `position` (d,) [m] overlaps moved away until it touches them.

        They are moved by SHALLOW_OVERLAP or more, and by `deeper` (n,) [m] in addition to the depth; and all obstacles
        by `all_by` [m]. A robot that stays outside of them there gets at most that deep into any of them where they
        are. Obstacles with an infinite value of `deeper` are left out.
        """
        window = self.without(np.isinf(deeper))
        window._touched_from = position.copy(), np.where(np.isinf(deeper), 0.0, deeper), all_by
        return window

    def covered(self, points: Array, robot: Shape, margin: float, around: Reach | None = None) -> Flags:
        """Whether a robot at each of the points (k, d) [m] is closer than the margin [m] to an obstacle at rest: (k,).

        around: of the decision, with a clearance of at least the margin; it saves time where all points are within it.
        """
        if around is not None and float(np.linalg.norm(points - around.position, axis=1).max()) <= around.distance:
            bodies = self.bodies_near(robot, around)
            self._near = _key(robot, around), bodies
        else:
            bodies = self.bodies(robot)
        return kernels.covered_at_rest(bodies, bodies.heads, bodies.hulls, points, margin)

    @property
    def coverages(self) -> list[float]:
        """The shares of the errors that the sets hold, as stated and less; obstacles of tables have none."""
        unsure = [one for one in self._sources if isinstance(one, Tracks | _Listed)]
        return coverages(error for one in unsure for error in one.uncertainties)

    def covering(self, share: float) -> "ObstacleWindow":
        """The same obstacles with sets that hold at most a share of the errors."""
        if share == self.coverages[0]:
            return self
        window = self.within(self.until)
        window._sources = [one.covering(share) if isinstance(one, Tracks | _Listed) else one for one in self._sources]
        window.__dict__.pop("obstacles", None)
        return window

    def within(self, horizons: npt.ArrayLike) -> "ObstacleWindow":
        """The same obstacles with other horizons (n,) [s]; each counts for the shorter of both."""
        window = copy(self)
        window.until, window._distances = np.minimum(self.until, self._each(horizons)), None
        window._bodies, window._near = {}, None
        return window

    def without(self, some: Indices | Flags | slice) -> "ObstacleWindow":
        """The same window without some of the obstacles."""
        until = self.until.copy()
        until[some] = 0.0
        return self.within(until)

    def _each(self, horizons: npt.ArrayLike) -> Array:
        each, n = array(horizons, "horizons").reshape(-1), sum(self._counts)
        if len(each) != n or not np.all((each >= 0.0) & (each <= self.horizon)):
            raise InvalidInput(
                f"horizons: expected {n}, one for each of the obstacles, from 0 to {self.horizon:g} s, "
                f"found {len(each)} from {each.min(initial=np.inf):g} to {each.max(initial=0.0):g} s"
            )
        return each

    def bodies(self, robot: Shape) -> Bodies:
        """The pieces of all obstacles grown by a robot's shape."""
        if robot not in self._bodies:
            self._bodies[robot] = self.bodies_near(robot, None)
        return self._bodies[robot]

    def bodies_near(self, robot: Shape, reach: Reach | None) -> Bodies:
        """As `bodies`, made anew without bodies of tables that are out of reach; None: with all.

        After `covered` they are those that it made. They are not kept, since decisions keep their window.
        """
        if reach is not None and self._near is not None and self._near[0] == _key(robot, reach):
            bodies, self._near = self._near[1], None
            return bodies
        parts, first = list[Bodies](), 0
        for source, count in zip(self._sources, self._counts):
            parts.append(source.bodies(robot, self.start, self.until[first : first + count], self.horizon, reach))
            first += count
        bodies = merged(parts) if parts else no_bodies(robot.dimension, 0)
        if not self._at_rest:
            bodies = bodies._replace(each=bodies.each.copy())
            bodies.each["at_rest"] = False
        if self._touched_from is not None:
            position, deeper, all_by = self._touched_from
            found = _measured(bodies, position)
            # A robot in contact is free to move away where a radius of CONTACT_SLACK can be given up.
            outside = np.maximum(bodies.radius, CONTACT_SLACK) - found[:, 0]
            overlapped = bodies.radius - found[:, 0] > OVERLAP
            moved = np.where(overlapped, np.maximum(outside + deeper[bodies.owner], SHALLOW_OVERLAP), 0.0) + all_by
            moved[~np.isfinite(found[:, 0])] = 0.0
            bodies = bodies.displaced(moved[:, None] * found[:, 1:])
        return bodies if reach is None else bodies._replace(reach=reach.distance)

    @property
    def only_table(self) -> ObstacleTable | None:
        """The table whose pieces, as they are, serve this window; None where pieces are cut to the window."""
        if len(self._sources) != 1 or not self._at_rest or self._touched_from is not None:
            return None
        table = self._sources[0]
        return table if isinstance(table, ObstacleTable) and self._counts[0] else None

    def uncut_bodies(self, robot: Shape, reach: Reach | None) -> Bodies:
        """As `bodies_near`, for kernels that cut pieces to the window: those of a single table as they are."""
        table = self.only_table
        if table is not None:
            return table.stretch(robot, self.start, self.horizon, self.until)
        return self.bodies(robot) if reach is None else self.bodies_near(robot, reach)

    def distances(self, robot: Shape, position: Array) -> tuple[Array, Array]:
        """Distance (b,) [m] of each body from a robot at `position` (d,) [m] now, and the direction of each (b, d).

        The radius is not subtracted, the uncertainty of the position is. Infinite for a body that does not exist now.
        Inside a body the distance is minus the depth. Against the unit vectors a robot leaves a body soonest.
        """
        key = (robot, position.tobytes())
        if self._distances is None or self._distances[0] != key:
            found = _measured(self.bodies(robot), position.copy())
            self._distances = (key, found[:, 0], found[:, 1 : 1 + position.size])
        return self._distances[1:]


def _measured(bodies: Bodies, position: Array) -> Array:
    """Distances [m] and directions of bodies now, see `ObstacleWindow.distances`.

    position: (d,) [m], an array that can be written: for others the kernel would be compiled once more.
    """
    return kernels.distances_now(bodies, bodies.heads, bodies.hulls, position)


def _key(robot: Shape, reach: Reach) -> tuple[object, ...]:
    """What bodies within a reach depend on."""
    return robot, reach.position.tobytes(), reach.distance, reach.clearance


def _foreseen(
    given: list[Obstacle | ObstacleTable | Tracks], forecast: Forecast, start: float, reaction: Reaction | None
) -> Sequence[Obstacle | Source]:
    """The tables and tracks as `given`, and in place of each obstacle what a forecast expects of it at `start` [s]."""
    if not any(isinstance(one, Obstacle) for one in given):
        return given
    straight = are_straight(given, forecast)
    rows = [k for k, one in enumerate(given) if isinstance(one, Obstacle) and not straight[k]]
    single = [cast(Obstacle, given[k]) for k in rows]
    there = [n for n, one in enumerate(single) if forecast.includes_future or one.exists(start)]
    expected: dict[int, Sequence[Obstacle]] = dict.fromkeys(rows, ())
    expected |= {rows[n]: each for n, each in zip(there, futures(single, forecast, start, there, reaction))}
    found: list[Obstacle | Source] = []
    for at_once, some in groupby(range(len(given)), straight.__getitem__):
        if at_once:
            found.append(_Listed([cast(Obstacle, given[k]) for k in some], forecast, start))
        else:
            found += [one for k in some for one in expected.get(k, (cast(Source, given[k]),))]
    return found


def listed(obstacles: Obstacles, name: str = "obstacles") -> Sequence[Obstacle | ObstacleTable | Tracks]:
    """The obstacles, tables and tracks one by one. Raises InvalidInput for anything else."""
    if isinstance(obstacles, ObstacleTable | Tracks):
        return [obstacles]
    if not isinstance(obstacles, list | tuple):
        has(obstacles, ("__iter__", "__len__"), "a list of obstacles, an ObstacleTable or Tracks", name)
    for k, one in enumerate(obstacles):
        if not isinstance(one, Obstacle | ObstacleTable | Tracks):
            raise InvalidInput(
                f"{name}[{k}]: expected an Obstacle, an ObstacleTable or Tracks, found {type(one).__name__}"
            )
    return obstacles


def each_of(obstacles: Obstacles) -> Sequence[Obstacle]:
    """The obstacles one by one, also those of tables and tracks; a list of obstacles alone is returned as it is."""
    if isinstance(obstacles, ObstacleTable):
        return obstacles.given
    given = listed(obstacles)
    if all(isinstance(one, Obstacle) for one in given):
        return cast(Sequence[Obstacle], given)
    return [each for one in given for each in _within(one)]


def fitting(
    obstacles: Obstacles, dimension: int, now: float, name: str = "obstacles", whose: str = "state"
) -> Sequence[Obstacle | ObstacleTable | Tracks]:
    """The obstacles, tables and tracks one by one, for decisions in `dimension`, `whose` it is, at `now` [s].

    Raises:
        InvalidInput: anything else, another dimension, tracks that are observed after `now`.
    """
    given = listed(obstacles, name)
    for one in given:
        same_dimension(one.dimension, dimension, name, whose)
        if isinstance(one, Tracks):
            one.refuse_later(now, name)
    return given


def each_for_one(obstacles: Obstacles, dimension: int, now: float) -> Sequence[Obstacle]:
    """The obstacles one by one, see `each_of`, for a decision of one robot.

    Raises:
        InvalidInput: as `fitting`; tracks with worlds; an obstacle whose trajectory ended before `now` [s].
    """
    for one in fitting(obstacles, dimension, now):
        if isinstance(one, Tracks):
            one.refuse_worlds("obstacles")
    each = each_of(obstacles)
    for obstacle in each:
        obstacle.known_at(now)
    return each


def followed(obstacles: Obstacles, robot: Shape, state: State, limits: Limits) -> Obstacles:
    """The obstacles, of which tracks that a robot in `state` follows may brake, see `Tracks.braking`."""
    return [one.followed_by(robot, state, limits) if isinstance(one, Tracks) else one for one in listed(obstacles)]


def in_world(obstacles: Obstacles, world: int) -> list[Obstacle | ObstacleTable | Tracks]:
    """The obstacles, tables and tracks that are in a world of a fleet."""
    return [one.in_world(world) if isinstance(one, Tracks) else one for one in listed(obstacles)]


def passive(obstacles: Obstacles) -> list[Obstacle | ObstacleTable | Tracks]:
    """The obstacles, contacts with tracked ones of which count only while the robot moves.

    Tracked are `Tracks`, and obstacles of any shape that do not stand still and have an uncertainty.
    """
    found = list[Obstacle | ObstacleTable | Tracks]()
    for one in listed(obstacles):
        table, uncertain = one.split(at_rest=False) if isinstance(one, ObstacleTable) else (one, ())
        found += [table, *uncertain]
    return [_passive(one) for one in found]


def _passive(one: Obstacle | ObstacleTable | Tracks) -> Obstacle | ObstacleTable | Tracks:
    """A table as it is; anything else as of `passive`."""
    if isinstance(one, Tracks):
        return one.passive()
    if isinstance(one, Obstacle) and one.uncertainty is not None and not one.at_rest:
        return replace(one, contact_at_rest=False)
    return one


def _within(source: Obstacle | ObstacleTable | Tracks) -> Sequence[Obstacle]:
    """An obstacle, or those of a table or of tracks."""
    if isinstance(source, Obstacle):
        return (source,)
    return source.given if isinstance(source, ObstacleTable) else source.obstacles
