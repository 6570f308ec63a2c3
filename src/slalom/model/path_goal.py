"""Goals with a path that leads to them: waypoints or a polyline with a speed profile, as planners publish it."""

from collections.abc import Callable
from copy import copy
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array, not_huge, positive, whole
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import SQUARED_LENGTH_FLOOR
from slalom.kernels.arrays import Flags, Indices
from slalom.model.goal import ARRIVAL_ERROR, Goal
from slalom.model.trajectory import Stationary

PATH_SAMPLES: Final = 4
"""[1] Points of a path up to the lookahead that are examined for obstacles at rest. Larger: decisions take longer.
Smaller: thin obstacles across the path are found late."""

PATH_OFFSETS: Final = 20
"""[1] Points on either side of a covered path that are examined until one is free, a radius of the robot apart. Larger:
robots pass wider obstacles on their path. Smaller: decisions take less time."""

PATH_TOLERANCE: Final = 0.25
"""[1] Tolerance of the point ahead on a path, as a share of its distance. Larger: robots aim less exactly. Smaller:
they turn late to pass the point."""


CUT_SHARE: Final = 0.5
"""[1] How far a path is cut by default, as a share of the radius of the robot. Larger: robots leave more of their path
out at corners. Smaller: they are slower there."""

CURVE_SHARE: Final = 1.0 / 32.0
"""[1] Distance of the straight way to the target from the path, as a share of the cut. On a circle a robot is farther
inside than that by four times. Larger: paths are cut on curves, too. Smaller: no change below two periods."""

LEAST_PERIODS: Final = 2.0
"""[1] The target is at least this far ahead, in periods. A robot turns a period late, and so leaves a circle as far as
it cuts it. Larger: it is inside of circles. Smaller: outside."""

HALVINGS: Final = 12
"""[1] Bisections of a length on the path: what is left is below a thousandth of the lookahead."""


class PathStep(NamedTuple):
    """The target of a robot on a path until its next decision."""

    progress: float  # [m] along the path, of the point that the robot has reached
    goal: Goal  # a point ahead on the path, or its end
    max_speed: float  # [m/s]
    final: bool  # whether the target is the end


def _nothing(points: Array) -> Flags:
    return np.zeros(len(points), np.bool_)


class PathGoal(Goal):
    """The end of a polyline that is followed there.

    A robot has a progress: the length [m] along the path of the place that it has reached. It grows with each decision,
    by at most what can be driven since the last one, to the nearest place. The robot has arrived when its progress is
    at the end, and then as at any other goal. So a path may cross itself, turn back, or close.

    At each decision the target is a point ahead: the farthest one, up to `lookahead`, to which the straight way hardly
    leaves the path. Before a corner a robot brakes for a turn that is off the corner by `cut`. If an obstacle at rest
    covers the path, the target is a free point beside it; behind a corner of a wall, the last point that is in sight.
    All else is avoided as on the way to any goal; the path has no part in safety.

    Args:
        points: (n, d) [m], n >= 2. A point at the place of the one before counts once.
        speeds: [m/s] above 0, one for the whole path or (n,) at its points, with constant acceleration in between. The
            last may be 0, with `stop`. None: the maximum speed of the robot.
        tolerance, stop, heading, heading_tolerance: of the end, see `Goal`. lookahead: [s] above 0.
        laps: how often a closed path is driven.
        cut: [m] above 0, by which corners may be cut. None: half the radius of the robot.

    Raises:
        InvalidInput: points or speeds of other shapes or ranges, a tolerance, lookahead or cut that is not above 0,
            several laps of a path that does not end where it begins.
    """

    points: Array
    speeds: Array | None
    lookahead: float
    laps: int
    cut: float | None
    kept: Indices  # of the given points, without repeated ones
    knots: Array  # (m, d) [m] of all laps
    lengths: Array  # (m,) [m] of the knots from the start
    squares: Array | None  # (m,) [m^2/s^2] of the speeds there
    _slow: tuple[Any, Array]  # what the squares of the speeds at corners were made for, and they
    _last: tuple[float, Array, float, float] | None  # the last `note`

    _begin: float | None  # [m] progress of a robot without a decision before; None: see `begun`

    def __init__(
        self,
        points: npt.ArrayLike,
        speeds: npt.ArrayLike | None = None,
        tolerance: float = 0.5,
        stop: bool = True,
        *,
        lookahead: float = 1.0,
        laps: int = 1,
        cut: float | None = None,
        heading: float | None = None,
        heading_tolerance: float = 0.05,
    ) -> None:
        given = not_huge(array(points, "points"), "points")
        if given.ndim != 2 or len(given) < 2 or given.shape[1] not in (2, 3):
            raise InvalidInput(f"points: expected an array (n, 2) or (n, 3) with n >= 2, found shape {given.shape}")
        first = np.flatnonzero(np.append(True, np.linalg.norm(np.diff(given, axis=0), axis=1) > ARRIVAL_ERROR))
        if len(first) < 2:
            raise InvalidInput(f"points: expected different ones, found all at {given[0]}")
        own = given[first]
        super().__init__(Stationary(own[-1]), tolerance, stop, heading, heading_tolerance)
        profile = None if speeds is None else _profile(speeds, len(given), stop, self.tolerance)
        of_points = None if profile is None else np.minimum.reduceat(profile, first)
        closed = float(np.linalg.norm(own[-1] - own[0])) <= ARRIVAL_ERROR
        if whole(laps, "laps", 1) > 1 and not closed:
            raise InvalidInput(f"laps: expected 1 for a path from {own[0]} to {own[-1]}, found {laps}")
        turn = np.tile(np.arange(len(own) - 1), laps)
        knots = np.concatenate([own[turn], own[-1:]])
        for name, value in (
            ("points", own),
            ("speeds", of_points),
            ("lookahead", positive(lookahead, "lookahead")),
            ("laps", laps),
            ("cut", None if cut is None else positive(cut, "cut")),
            ("knots", knots),
            ("lengths", np.append(0.0, np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1)))),
            ("squares", None if of_points is None else np.append(of_points[turn], of_points[-1]) ** 2),
            ("_slow", (None, knots)),
            ("_last", None),
            ("_begin", None),
            ("kept", first),
        ):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<PathGoal to {self.points[-1].tolist()}, points: {len(self.points)}, length: {self.length:g} m>"

    @property
    def length(self) -> float:
        """[m] of the path."""
        return float(self.lengths[-1])

    @property
    def end(self) -> Goal:
        """The end as a goal without a path."""
        return Goal(self.trajectory, self.tolerance, self.stop, self.heading, self.heading_tolerance)

    def is_way_of(self, other: "Goal | None") -> bool:
        """Whether another goal is a path through the same points: lengths along one are lengths along the other."""
        return other is self or (isinstance(other, PathGoal) and np.array_equal(self.knots, other.knots))

    def point(self, progress: float) -> Array:
        """The point (d,) [m] of the path at a length [m] from its start."""
        return np.asarray(self.points_at(np.array([progress]))[0])

    def points_at(self, progress: Array) -> Array:
        """The points (k, d) [m] of the path at lengths (k,) [m] from its start."""
        return np.stack([np.interp(progress, self.lengths, column) for column in self.knots.T], axis=1)

    def between(self, since: float, until: float) -> Array:
        """The part (k, d) [m] of the path from one length [m] from its start to another, or to the end."""
        until = min(until, self.length)
        inner = self.knots[(self.lengths > since) & (self.lengths < until)]
        return np.concatenate([self.point(since)[None], inner, self.point(until)[None]])

    def allowed_speed(self, progress: float, max_speed: float, braking: float, cut: float | None = None) -> float:
        """The speed [m/s] at a length [m] from the start that the profile, corners and `braking` [m/s^2] allow."""
        limits = [max_speed**2]
        ahead = 2.0 * braking * (self.lengths - progress)
        rest = self.lengths >= progress
        if self.squares is not None:
            limits += [float(np.interp(progress, self.lengths, self.squares)), *(self.squares + ahead)[rest].tolist()]
        cut = self.cut if cut is None else cut
        if cut is not None:
            limits.append(float((self._at_corners(cut, max_speed, braking) + ahead)[rest].min(initial=np.inf)))
        return float(np.sqrt(min(limits)))

    def _at_corners(self, cut: float, max_speed: float, braking: float) -> Array:
        """The squares (m,) [m^2/s^2] of the speeds at which a robot turns at each knot; inf: any up to `max_speed`.

        A knot is a corner if the straight way past it is farther off than `cut` before it is as long as a turn at
        `max_speed` has to be. The turn then is a circle through the ends of the longest one that is not.
        """
        key = cut, max_speed, braking
        if self._slow[0] != key:
            low = np.zeros(len(self.lengths))
            ends = np.minimum(self.lengths, self.length - self.lengths)
            high = np.minimum(np.sqrt(2.0 * cut / braking) * max_speed, ends)
            half, free = high, np.ones(len(low), np.bool_)
            for k in range(HALVINGS):
                begin, way = self.points_at(self.lengths - half), self.points_at(self.lengths + half)
                way -= begin
                off = np.linalg.norm(_beside(self.knots - begin, way), axis=1)
                free = (off <= cut) if k == 0 else free
                low, high = np.where(off <= cut, half, low), np.where(off <= cut, high, half)
                half = 0.5 * (low + high)
            chords = ((self.points_at(self.lengths + low) - self.points_at(self.lengths - low)) ** 2).sum(axis=1)
            object.__setattr__(
                self, "_slow", (key, np.where(free, np.inf, braking * (chords / (8.0 * cut) + 0.5 * cut)))
            )
        return self._slow[1]

    def nearest(self, position: Array, since: float, until: float, slack: float = ARRIVAL_ERROR) -> float:
        """The length [m] from the start of the point nearest to a position (d,) [m], from `since` to `until` [m].

        The first one that is at most farther away than the nearest one by `slack` [m].
        """
        first = int(np.clip(np.searchsorted(self.lengths, since, side="right") - 1, 0, len(self.lengths) - 2))
        last = int(np.clip(np.searchsorted(self.lengths, until), first + 1, len(self.lengths) - 1))
        begin, step = self.knots[first:last], np.diff(self.knots[first : last + 1], axis=0)
        length = np.diff(self.lengths[first : last + 1])
        share = np.clip(((position - begin) * step).sum(axis=1) / length**2, 0.0, 1.0)
        at = np.clip(self.lengths[first:last] + share * length, since, until)
        places = begin + ((at - self.lengths[first:last]) / length)[:, None] * step
        distance = np.linalg.norm(places - position, axis=1)
        return float(at[np.argmax(distance <= distance.min() + slack)])

    def begun(self, position: Array, size: float = 0.0) -> float:
        """The progress [m] of a robot of `size` [m] at a position (d,) [m] without a decision before.

        Near the first point, within the size or the tolerance, it begins there; else at the nearest place of the path,
        at the first one of those that are as near up to the cut.
        """
        if self._begin is not None:
            return self._begin
        away = float(np.linalg.norm(position - self.knots[0]))
        if away <= max(self.tolerance, size):
            return self.nearest(position, 0.0, min(2.0 * away, self.length))
        cut = self.cut_of(size)
        first = self.nearest(position, 0.0, self.length, cut)
        return self.nearest(position, first, min(first + 2.0 * cut, self.length))

    def begun_at(self, progress: float) -> "PathGoal":
        """The same path, on which a robot without a decision before has a progress [m]."""
        other = copy(self)
        object.__setattr__(other, "_begin", progress)
        return other

    def advanced(self, position: Array, progress: float, way: float, size: float = 0.0) -> float:
        """The progress [m] of a robot at a position (d,) [m] that can have driven a `way` [m] since its last one.

        It is at most twice as far along the path as straight, but for corners: two places of one that is cut are at
        most twice the cut apart along the path.
        """
        way = min(way, 2.0 * float(np.linalg.norm(position - self.point(progress)))) + 2.0 * self.cut_of(size)
        return self.nearest(position, progress, min(self.length, progress + way))

    def cut_of(self, size: float) -> float:
        """How far [m] a robot of `size` [m] cuts corners."""
        return CUT_SHARE * size if self.cut is None else self.cut

    def note(self, now: float, position: Array, progress: float, max_speed: float) -> None:
        """Remember the last decision for this goal, for `reached` without a progress."""
        object.__setattr__(self, "_last", (now, position, progress, max_speed))

    def reached(
        self, position: Array, velocity: Array, now: float, heading: float | None = None, progress: float | None = None
    ) -> bool:
        """Whether a robot in this state at time `now` [s] has arrived: with its progress at the end, and as `Goal`.

        progress: [m] of its last decision. None: that of the last decision for this object, if the robot can be at this
            position after it; else that of a robot that begins here.
        """
        if progress is None and self._last is not None:
            then, place, known, speed = self._last
            away = float(np.linalg.norm(position - place))
            progress = known if then <= now and away <= speed * (now - then) + self.tolerance else None
        return self._ends(position, progress) and super().reached(position, velocity, now, heading)

    def reached_during(
        self,
        positions: Array,
        velocities: Array,
        accelerations: Array | float,
        times: Array | float,
        duration: float,
        progress: float | None = None,
    ) -> npt.NDArray[np.bool_]:
        """As `Goal.reached_during`, for one robot with the progress [m] of its last decision."""
        found = super().reached_during(positions, velocities, accelerations, times, duration)
        end = positions + duration * (velocities + 0.5 * duration * accelerations)
        return found if found.any() and self._ends(end, progress) else np.zeros_like(found)

    def _ends(self, position: Array, progress: float | None) -> bool:
        """Whether what is left of the path from the last progress is no more than the way since and the tolerance."""
        at = self.begun(position) if progress is None else progress
        return self.length - at <= float(np.linalg.norm(position - self.point(at))) + self.tolerance

    def step(
        self,
        position: Array,
        progress: float | None,
        max_speed: float,
        braking: float,
        period: float,
        size: float = 1.0,
        covered: Callable[[Array], Flags] = _nothing,
        hidden: Callable[[Array], Flags] = _nothing,
        since: float | None = None,
    ) -> PathStep:
        """The target of a robot at a position (d,) [m]: a point ahead on the path, or beside a covered part of it.

        Args:
            progress: [m] at its last decision; None: see `begun`.
            max_speed: [m/s], braking: [m/s^2] of the robot. period: [s] until its next decision.
            size: [m] by which points beside the path differ. covered: whether an obstacle at rest covers each of the
                points (k, d) [m]. The target is then the nearest free one beside the path, on the right where both are
                as near. hidden: the same without a margin, for the straight way to the target.
            since: [s] from the last decision; None: a period.
        """
        if progress is None:
            progress = self.begun(position, size)
        else:
            progress = self.advanced(position, progress, max_speed * (period if since is None else since), size)
        cut = self.cut_of(size)
        speed = self.allowed_speed(progress, max_speed, braking, cut)
        speed = self.allowed_speed(min(progress + period * speed, self.length), max_speed, braking, cut)
        distance = self._straight(progress, self.lookahead * speed, CURVE_SHARE * cut)
        ahead = min(progress + max(distance, LEAST_PERIODS * period * speed), self.length)
        distance = ahead - progress
        shares = np.arange(1, PATH_SAMPLES + 1) / PATH_SAMPLES
        between = progress + shares * distance
        between = between[between < self.length]
        blocked = covered(self.points_at(between)) if len(between) else np.zeros(0, np.bool_)
        if not blocked.any():
            seen = self._last_in_sight(position, ahead, size, hidden)
            if seen >= self.length:
                return PathStep(progress, self.end, speed, True)
            # At the end of the path no distance is left.
            return PathStep(progress, self._pass(self.point(seen), distance or size), speed, False)
        rest = between[int(np.argmax(blocked)) :]
        on_path, left = self.points_at(rest), np.stack([self.left(at) for at in rest])
        for k in range(1, PATH_OFFSETS + 1):
            for offset in (-k * size, k * size):
                points = on_path + offset * left
                if not covered(points).any():
                    return PathStep(progress, self._pass(points[-1], distance), speed, False)
        return PathStep(progress, self._pass(on_path[-1], distance), speed, False)

    def _straight(self, progress: float, distance: float, off: float) -> float:
        """How far ahead [m], up to a distance [m], the straight way leaves the path by at most `off` [m]."""
        low, high = progress, min(progress + distance, self.length)
        knots = (self.lengths > low) & (self.lengths < high)
        at, begin = self.lengths[knots], self.point(progress)
        offsets = self.knots[knots] - begin
        end = high
        for _ in range(HALVINGS if len(at) else 0):
            passed = offsets[at < end]
            if np.all(np.linalg.norm(_beside(passed, self.point(end) - begin), axis=1) <= off):
                low = end
            else:
                high = end
            if low == high:
                break
            end = 0.5 * (low + high)
        return (low if len(at) else high) - progress

    def _last_in_sight(self, position: Array, ahead: float, size: float, hidden: Callable[[Array], Flags]) -> float:
        """The last place [m], up to the one ahead, to which no obstacle at rest covers the straight way; it if none is.

        A corner hides the target, or others have moved the robot of `size` [m] behind an obstacle.
        """
        at = ahead
        while at >= 0.0:
            way = self.point(at) - position
            count = int(np.linalg.norm(way) / size)
            if count < 2 or not hidden(position + np.arange(1, count)[:, None] / count * way).any():
                return at
            at -= size
        return ahead

    def left(self, progress: float) -> Array:
        """The unit vector (d,) to the left of the path at a length [m] from its start, level in space."""
        k = int(np.clip(np.searchsorted(self.lengths, progress) - 1, 0, len(self.lengths) - 2))
        x, y = (self.knots[k + 1] - self.knots[k])[:2]
        length = float(np.hypot(x, y))
        side = np.array([-y / length, x / length]) if length > 0.0 else np.array([1.0, 0.0])
        return np.append(side, np.zeros(self.points.shape[1] - 2))

    def _pass(self, point: Array, distance: float) -> Goal:
        """A goal on the way."""
        return Goal(Stationary(point), min(self.tolerance, PATH_TOLERANCE * distance))


def _beside(offsets: Array, ways: Array) -> Array:
    """The displacements (n, d) [m] of places from the nearest points of straight ways; both (n, d) [m] from begins."""
    square = np.maximum((ways * ways).sum(axis=-1), SQUARED_LENGTH_FLOOR)
    share = np.clip((offsets * ways).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(offsets - share[..., None] * ways)


def _profile(speeds: npt.ArrayLike, n: int, stop: bool, tolerance: float) -> Array:
    """The speeds (n,) [m/s] at the points. At an end at rest it is the largest with which the robot has arrived."""
    given = not_huge(array(speeds, "speeds"), "speeds")
    if given.shape not in ((), (n,)):
        raise InvalidInput(f"speeds: expected one or {n}, found an array of shape {given.shape}")
    profile = np.array(np.broadcast_to(given, (n,)))
    ends_at_rest = given.ndim == 1 and profile[-1] == 0.0
    if np.any(profile[:-1] <= 0.0) or (profile[-1] <= 0.0 and not ends_at_rest):
        raise InvalidInput(f"speeds: expected values above 0, at the end also 0, found {profile.min():g} m/s")
    if ends_at_rest and not stop:
        raise InvalidInput("stop: expected True for speeds that end at 0, found False")
    if ends_at_rest:
        profile[-1] = min(tolerance, profile[-2])
    return profile
