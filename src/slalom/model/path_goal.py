"""Goals with a path that leads to them: waypoints or a polyline with a speed profile, as planners publish it."""

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array, not_huge, positive
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import Flags
from slalom.model.goal import Goal
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


class PathStep(NamedTuple):
    """The target of a robot on a path until its next decision."""

    progress: float  # [m] along the path, of the point that the robot has reached
    goal: Goal  # a point ahead on the path, or its end
    max_speed: float  # [m/s]
    final: bool  # whether the target is the end
    ahead: float  # [m] along the path, of the target; of the robot, where an obstacle covers the path


class PathGoal(Goal):
    """The end of a polyline that is followed there.

    At each decision the target is the point that the robot reaches along the path in `lookahead` seconds. With a longer
    one it cuts corners, with a shorter one it returns to the path more directly. If an obstacle at rest covers the path
    up to there, the target is a free point beside it. Points that it has passed are not visited again. All else is
    avoided as on the way to any goal; the path has no part in safety.

    Args:
        points: (n, d) [m], n >= 2, each apart from the one before.
        speeds: [m/s] above 0, one for the whole path or (n,) at its points, with constant acceleration in between. The
            last may be 0, with `stop`. None: the maximum speed of the robot.
        tolerance, stop: of the end, see `Goal`. lookahead: [s] above 0.

    Raises:
        InvalidInput: points or speeds of other shapes or ranges, a tolerance or lookahead that is not above 0.
    """

    points: Array
    speeds: Array | None
    lookahead: float
    _at: Array  # (n,) [m] of the points from the start

    def __init__(
        self,
        points: npt.ArrayLike,
        speeds: npt.ArrayLike | None = None,
        tolerance: float = 0.5,
        stop: bool = True,
        *,
        lookahead: float = 1.0,
    ) -> None:
        knots = not_huge(array(points, "points"), "points")
        if knots.ndim != 2 or len(knots) < 2 or knots.shape[1] not in (2, 3):
            raise InvalidInput(f"points: expected an array (n, 2) or (n, 3) with n >= 2, found shape {knots.shape}")
        lengths = np.linalg.norm(np.diff(knots, axis=0), axis=1)
        if not np.all(lengths > 0.0):
            k = int(np.argmin(lengths))
            raise InvalidInput(f"points: expected different ones, found points {k} and {k + 1} both at {knots[k]}")
        super().__init__(Stationary(knots[-1]), tolerance, stop)
        of_points = None if speeds is None else _profile(speeds, len(knots), stop, self.tolerance)
        for name, value in (
            ("points", knots),
            ("speeds", of_points),
            ("lookahead", positive(lookahead, "lookahead")),
            ("_at", np.concatenate([[0.0], np.cumsum(lengths)])),
        ):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"<PathGoal to {self.points[-1].tolist()}, points: {len(self.points)}, length: {self.length:g} m>"

    @property
    def length(self) -> float:
        """[m] of the path."""
        return float(self._at[-1])

    def is_way_of(self, other: "Goal | None") -> bool:
        """Whether another goal is a path through the same points: lengths along one are lengths along the other."""
        return other is self or (isinstance(other, PathGoal) and np.array_equal(self.points, other.points))

    def point(self, progress: float) -> Array:
        """The point (d,) [m] of the path at a length [m] from its start."""
        return np.asarray(self.points_at(np.array([progress]))[0])

    def points_at(self, progress: Array) -> Array:
        """The points (k, d) [m] of the path at lengths (k,) [m] from its start."""
        return np.stack([np.interp(progress, self._at, column) for column in self.points.T], axis=1)

    def allowed_speed(self, progress: float, max_speed: float, braking: float) -> float:
        """The speed [m/s] at a length [m] from the start that the profile and `braking` [m/s^2] allow."""
        if self.speeds is None:
            return max_speed
        squares = self.speeds**2
        ahead = squares + 2.0 * braking * (self._at - progress)
        here = np.interp(progress, self._at, squares)
        return float(min(max_speed, np.sqrt(min(here, ahead[self._at >= progress].min(initial=np.inf)))))

    def nearest(self, position: Array, since: float, until: float) -> float:
        """The length [m] from the start of the point nearest to a position (d,) [m], from `since` to `until` [m]."""
        first = int(np.clip(np.searchsorted(self._at, since, side="right") - 1, 0, len(self.points) - 2))
        last = int(np.clip(np.searchsorted(self._at, until), first + 1, len(self.points) - 1))
        begin, step = self.points[first:last], np.diff(self.points[first : last + 1], axis=0)
        length = np.diff(self._at[first : last + 1])
        share = np.clip(((position - begin) * step).sum(axis=1) / length**2, 0.0, 1.0)
        at = np.clip(self._at[first:last] + share * length, since, until)
        places = begin + ((at - self._at[first:last]) / length)[:, None] * step
        return float(at[np.argmin(np.linalg.norm(places - position, axis=1))])

    def step(
        self,
        position: Array,
        progress: float | None,
        max_speed: float,
        braking: float,
        period: float,
        size: float = 1.0,
        covered: Callable[[Array], Flags] = lambda points: np.zeros(len(points), np.bool_),
    ) -> PathStep:
        """The target of a robot at a position (d,) [m]: a point ahead on the path, or beside a covered part of it.

        Args:
            progress: [m] at its last decision; None: it is at the nearest point of the whole path.
            max_speed: [m/s], braking: [m/s^2] of the robot. period: [s] until its next decision.
            size: [m] by which points beside the path differ. covered: whether an obstacle at rest covers each of the
                points (k, d) [m]. The target is then the nearest free one beside the path, on the right where both are
                as near.
        """
        reach = self.lookahead * max_speed
        if progress is None:
            progress = self.nearest(position, 0.0, self.length)
        else:
            progress = self.nearest(position, progress, min(self.length, progress + 2.0 * reach))
        speed = self.allowed_speed(progress, max_speed, braking)
        speed = self.allowed_speed(min(progress + period * speed, self.length), max_speed, braking)
        distance = self.lookahead * speed
        ahead = progress + distance
        shares = np.arange(1, PATH_SAMPLES + 1) / PATH_SAMPLES
        between = progress + shares * distance
        between = between[between < self.length]
        blocked = covered(self.points_at(between)) if len(between) else np.zeros(0, np.bool_)
        if not blocked.any():
            if ahead >= self.length:
                return PathStep(progress, Goal(self.trajectory, self.tolerance, self.stop), speed, True, self.length)
            return PathStep(progress, self._pass(self.point(ahead), distance), speed, False, ahead)
        rest = between[int(np.argmax(blocked)) :]
        on_path, left = self.points_at(rest), np.stack([self.left(at) for at in rest])
        for k in range(1, PATH_OFFSETS + 1):
            for offset in (-k * size, k * size):
                points = on_path + offset * left
                if not covered(points).any():
                    return PathStep(progress, self._pass(points[-1], distance), speed, False, progress)
        return PathStep(progress, self._pass(on_path[-1], distance), speed, False, progress)

    def left(self, progress: float) -> Array:
        """The unit vector (d,) to the left of the path at a length [m] from its start, level in space."""
        k = int(np.clip(np.searchsorted(self._at, progress) - 1, 0, len(self.points) - 2))
        x, y = (self.points[k + 1] - self.points[k])[:2]
        length = float(np.hypot(x, y))
        side = np.array([-y / length, x / length]) if length > 0.0 else np.array([1.0, 0.0])
        return np.append(side, np.zeros(self.points.shape[1] - 2))

    def _pass(self, point: Array, distance: float) -> Goal:
        """A goal on the way."""
        return Goal(Stationary(point), min(self.tolerance, PATH_TOLERANCE * distance))


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
