"""The control obstacle: all controls that lead to a collision within the horizon."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import Array, array, not_negative, number, positive, vectors
from slalom.errors import InvalidInput
from slalom.obstacle import Obstacle
from slalom.path import hermite
from slalom.response import Response
from slalom.shape import Shape
from slalom.state import State
from slalom.tolerances import CONTACT, TOUCHING


class Element(NamedTuple):
    """Temporal elements at one time: a ball of controls for each obstacle that is there."""

    centers: Array  # (n, d)
    radii: Array  # (n,)
    owners: npt.NDArray[np.int64]  # (n,) index of the obstacle


class Traffic:
    """Obstacles over a window of time as cubic pieces: made once, used by every control obstacle of a decision.

    Args:
        obstacles: all of one dimension; those that do not exist within the window leave no piece.
        start: absolute time [s] of the decision. horizon: length of the window [s] > 0.
    """

    def __init__(self, obstacles: Sequence[Obstacle], start: float, horizon: float) -> None:
        self.obstacles = tuple(obstacles)
        self.start = number(start, "start")
        self.horizon = positive(horizon, "horizon")
        dimensions = {obstacle.dimension for obstacle in self.obstacles}
        if len(dimensions) > 1:
            raise InvalidInput(f"obstacles: expected one dimension, found {sorted(dimensions)}")
        self.dimension = dimensions.pop() if dimensions else None
        times, points, error, owner = [], [], [], []
        for index, obstacle in enumerate(self.obstacles):
            first, last = obstacle.trajectory.span
            begin, end = max(self.start, first), min(self.start + self.horizon, last)
            if begin < end:
                path = obstacle.trajectory.path(begin, end)
                times.append(np.column_stack([path.times[:-1], path.times[1:]]) - self.start)
                points.append(path.points)
                error.append(path.error)
                owner.append(np.full(len(path.points), index, dtype=np.int64))
        d = self.dimension or 2
        self.times = np.concatenate(times) if times else np.empty((0, 2))
        self.points = np.concatenate(points) if points else np.empty((0, 4, d))
        self.error = np.concatenate(error) if error else np.empty(0)
        self.owner = np.concatenate(owner) if owner else np.empty(0, dtype=np.int64)
        # The first piece of each obstacle that is there when the window begins.
        heads = np.flatnonzero(np.diff(self.owner, prepend=-1))
        self.present = heads[self.times[heads, 0] <= 0.0]
        self.radii = np.array([obstacle.shape.radius for obstacle in self.obstacles], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class ControlObstacle:
    """The controls with which the robot meets one of the obstacles within (0, horizon].

    The union over time of the temporal elements (B(t) - drift(t)) / gain(t), where B(t) is the obstacle grown by the
    robot's shape and by `margin` (Bareiss and van den Berg 2015; with the Acceleration response it is the AO or
    NAO of Stern and Shiller 2025, with Velocity the VO or NLVO). Whether a control belongs to it is decided in
    the workspace for all times, not at samples.

    Laws: contains(u) = (clearance(u) < 0) = (time_to_collision(u) < inf), up to CERTIFIED of clearance; a longer
    horizon, a larger radius or one more obstacle never frees a control.

    Args:
        response: how the robot answers a control. state: its state now.
        traffic: the obstacles over the window that begins now.
        robot: the robot's shape. margin: [m] >= 0 to keep from every obstacle.
        horizon: [s], at most that of the traffic, which is the default.

    Raises:
        InvalidInput: different dimensions, a horizon that is not above 0 or beyond the traffic's.
    """

    response: Response
    state: State
    traffic: Traffic
    robot: Shape
    margin: float | Array = 0.0
    horizon: float = 0.0

    def __post_init__(self) -> None:
        horizon = self.horizon or self.traffic.horizon
        if positive(horizon, "horizon") > self.traffic.horizon:
            raise InvalidInput(
                f"horizon: expected at most the traffic's {self.traffic.horizon:g} s, found {horizon:g} s"
            )
        object.__setattr__(self, "horizon", horizon)
        least = float(np.min(array(self.margin, "margin"), initial=np.inf))
        not_negative(min(least, 0.0), "margin")
        for what, dimension in (("robot", self.robot.dimension), ("obstacles", self.traffic.dimension)):
            if dimension not in (None, self.dimension):
                raise InvalidInput(f"{what}: expected dimension {self.dimension} as of the state, found {dimension}")

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.state.dimension

    @cached_property
    def radii(self) -> Array:
        """Sum of radii and margin for each obstacle [m], less where the robot touches the obstacle already.

        Contact is not overlap: from an obstacle that it is within TOUCHING of, the robot may still move away.
        """
        radii = np.asarray(self.traffic.radii + self.robot.radius + self.margin, dtype=np.float64)
        distance = self.initial_distances
        touching = (distance - radii >= -CONTACT) & (distance - radii < TOUCHING)
        return np.where(touching, np.maximum(distance - TOUCHING, 0.0), radii)

    @cached_property
    def initial_distances(self) -> Array:
        """Distance between the centres now [m], (n,); inf for an obstacle that is not there."""
        distance = np.full(len(self.traffic.obstacles), np.inf)
        here = self.traffic.present
        if not here.size:
            return distance
        away = self.traffic.points[here, 0] - self.state.position
        distance[self.traffic.owner[here]] = np.sqrt((away * away).sum(axis=1))
        return distance

    @cached_property
    def overlapping(self) -> npt.NDArray[np.int64]:
        """Indices of the obstacles that the robot (with its margin) overlaps now."""
        return np.flatnonzero(self.initial_distances < self.radii - CONTACT)

    @cached_property
    def segments(self) -> tuple[Array, Array, Array, Array, Array, npt.NDArray[np.int64]]:
        """begin, end, points, gains, radius, owner: the table of `kernels/segments.py`."""
        state = self.state
        # No control that stands for a velocity beyond this is asked about: 100 m/s more than twice the speed.
        reach = 2.0 * float(np.linalg.norm(state.velocity)) + 100.0
        knots = self.response.knots(self.horizon, reach)
        position, velocity = self.response.position(state, knots), self.response.velocity(state, knots)
        drift = hermite(knots, position.drift, velocity.drift).points
        gain = hermite(knots, position.gain[:, None], velocity.gain[:, None]).points[..., 0]
        return kernels.relative_segments(
            self.traffic.times,
            self.traffic.points,
            self.traffic.error + self.response.interpolation_error,
            self.radii[self.traffic.owner],
            self.traffic.owner,
            knots,
            drift,
            gain,
            self.horizon,
        )

    def _controls(self, controls: npt.ArrayLike) -> tuple[Array, tuple[int, ...]]:
        u = vectors(controls, "controls", self.dimension)
        flat = np.zeros((u.size // self.dimension, 3))
        flat[:, : self.dimension] = u.reshape(-1, self.dimension)
        return flat, u.shape[:-1]

    def clearances(self, controls: npt.ArrayLike) -> Array:
        """Least distance between surfaces over (0, horizon] for controls (..., d) and each obstacle: (..., n) [m].

        Negative when overlapping, inf for an obstacle that does not appear. Never above the true minimum by more than
        CLEARANCE, below it by at most CERTIFIED, and by TOUCHING more where the robot touches the obstacle already.
        """
        flat, shape = self._controls(controls)
        _, _, points, gains, radius, owner = self.segments
        found = kernels.least_clearances(points, gains, radius, owner, len(self.traffic.obstacles), flat)
        return found.reshape(*shape, len(self.traffic.obstacles))

    def clearance(self, controls: npt.ArrayLike) -> Array:
        """The least of `clearances`: (...) [m]; inf without obstacles."""
        return np.asarray(self.clearances(controls).min(axis=-1, initial=np.inf))

    def contains(self, controls: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether controls (..., d) collide within the horizon: (...)."""
        return np.asarray(np.isfinite(self.time_to_collision(controls)))

    def times_to_collision(self, controls: npt.ArrayLike) -> Array:
        """Time of the first contact for controls (..., d) with each obstacle: (..., n) [s], inf if there is none."""
        flat, shape = self._controls(controls)
        begin, end, points, gains, radius, owner = self.segments
        found = kernels.contact_times(begin, end, points, gains, radius, owner, len(self.traffic.obstacles), flat)
        return found.reshape(*shape, len(self.traffic.obstacles))

    def time_to_collision(self, controls: npt.ArrayLike) -> Array:
        """The least of `times_to_collision`: (...) [s]."""
        return np.asarray(self.times_to_collision(controls).min(axis=-1, initial=np.inf))

    def element(self, t: float) -> Element:
        """The temporal elements at elapsed time 0 < t <= horizon: the controls that are in an obstacle at t.

        Raises:
            InvalidInput: t outside (0, horizon].
        """
        if not 0.0 < number(t, "t") <= self.horizon:
            raise InvalidInput(f"t: expected a time in (0, {self.horizon:g}] s, found {t:g} s")
        now = self.traffic.start + t
        there = np.array([i for i, o in enumerate(self.traffic.obstacles) if o.exists(now)], dtype=np.int64)
        places = [self.traffic.obstacles[i].trajectory.position(now) for i in there]
        image = self.response.position(self.state, t)
        centers = image.inverse(np.array(places).reshape(-1, self.dimension))
        return Element(centers, self.radii[there] / float(image.gain), there)


def control_obstacle(
    response: Response,
    state: State,
    obstacles: Sequence[Obstacle],
    robot: Shape,
    *,
    horizon: float,
    start: float = 0.0,
    margin: float = 0.0,
) -> ControlObstacle:
    """The control obstacle of `obstacles` from absolute time `start` [s], for a single decision."""
    return ControlObstacle(response, state, Traffic(obstacles, start, horizon), robot, margin)
