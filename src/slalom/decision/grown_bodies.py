"""The bodies of obstacles and robots, grown by the shapes of robots, from which the compiled policy decides."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from slalom.kernels.arrays import Corners, Indices
from slalom.kernels.decision.tables import GrownBodies, ObstacleAtHorizon, RobotBody
from slalom.kernels.records import Records, zero_records
from slalom.obstacle.minkowski import sum_of_shapes
from slalom.obstacle.pieces import Reach
from slalom.obstacle.window import ObstacleWindow
from slalom.shape import Shape, is_round, round_shape

NONE_AT_HORIZON: Final = zero_records(ObstacleAtHorizon, 0)


class Skeletons:
    """The kinds of skeletons of robots: discs and balls of any radius are of one kind, their centre.

    Attributes:
        kind: (n,) of each robot. rounding: (n,) [m] of each robot; 0 for shapes that are not discs or balls.
        shapes: of each kind, the shape of its first robot. dimension: 2 or 3.
    """

    def __init__(self, shapes: Sequence[Shape]) -> None:
        self.dimension = shapes[0].dimension
        self.shapes: list[Shape] = []
        self.rounding = np.zeros(len(shapes))
        kinds: dict[tuple[object, ...], int] = {}
        kind = []
        for k, shape in enumerate(shapes):
            key: tuple[object, ...] = tuple((part.corners.tobytes(), part.radius) for part in shape.parts)
            if is_round(shape):
                key, self.rounding[k] = (), shape.parts[0].radius
            if key not in kinds:
                kinds[key] = len(kinds)
                self.shapes.append(shape)
            kind.append(kinds[key])
        self.kind: Indices = np.array(kind)
        self._bodies: dict[int, _RobotBodies] = {}
        self._alone: dict[int, GrownBodies] = {}

    def grown_bodies(
        self, kind: int, obstacles: ObstacleWindow, *, detours: bool, around: Reach | None = None
    ) -> GrownBodies:
        """Predicted obstacles and robots of all kinds, grown by robots with one kind of skeleton.

        Args:
            detours: whether costs count detours, which need the positions of obstacles at the horizon.
            around: bodies farther away from it may be left out, see `GrownBodies.reach`; None: none is.

        Raises:
            InvalidInput: see `minkowski.minkowski_sum`.
        """
        if not len(obstacles):
            if kind not in self._alone:
                self._alone[kind] = self._made(kind, obstacles, None, detours=False)
            return self._alone[kind]
        return self._made(kind, obstacles, around, detours=detours)

    def _made(self, kind: int, obstacles: ObstacleWindow, around: Reach | None, *, detours: bool) -> GrownBodies:
        shape = self.shapes[kind]
        bodies, body_balls, now, until, reach = obstacles.timed_bodies(shape, around)
        robots, corners = self._robots(kind), Corners(bodies.corners, bodies.first, bodies.unordered)
        hull = robots.hull
        if len(robots.each):
            hull = np.where(hull < 0, -1, len(bodies.unordered) + hull)
            corners = Corners(
                np.concatenate([bodies.corners, robots.corners.corners]),
                np.concatenate([bodies.first, bodies.first[-1] + robots.corners.first[1:]]),
                np.concatenate([bodies.unordered, robots.corners.unordered]),
            )
        return GrownBodies(
            now=now,
            until=until,
            pieces=bodies.pieces,
            first_piece=bodies.first_piece,
            balls=bodies.balls,
            body_balls=body_balls,
            passive=bodies.each,
            hull=bodies.hull,
            corners=corners if bodies.has_hulls or robots.has_hulls else (),
            at_horizon=obstacles.at_horizon() if detours else NONE_AT_HORIZON,
            reach=reach,
            robot_rounding=robots.rounding,
            robot_first=robots.first,
            robot_bodies=robots.each,
            robot_hull=hull,
        )

    def _robots(self, kind: int) -> "_RobotBodies":
        """The bodies of robots of all kinds, made once. Raises InvalidInput, see `minkowski.minkowski_sum`."""
        if kind not in self._bodies:
            d, none = self.dimension, np.empty(0)
            # A robot that is alone meets no robot: two of its shape may have no sum.
            met = [round_shape(0.0, d) if is_round(each) else each for each in self.shapes if len(self.kind) > 1]
            sums = [sum_of_shapes(each, met[kind]) for each in met]
            counts = np.concatenate([np.empty(0, np.int64), *(each.counts for each in sums)])
            bodies = zero_records(RobotBody, len(counts))
            bodies["offset"][:, :d] = np.concatenate([np.empty((0, d)), *(each.offsets for each in sums)])
            bodies["radius"] = np.concatenate([none, *(each.radius for each in sums)])
            bodies["hull_radius"] = np.concatenate([none, *(each.hull_radius for each in sums)])
            corners = Corners(
                np.concatenate([np.empty((0, 5)), *(each.corners for each in sums)]),
                np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)]),
                np.concatenate([np.empty(0, np.bool_), *(each.unordered for each in sums)]),
            )
            first = np.cumsum([0, *(len(each.counts) for each in sums)])
            point = (counts == 1) & (bodies["hull_radius"] == 0.0)
            hull = np.where(point, -1, np.arange(len(point)))
            shape = self.shapes[kind]
            rounding = float(shape.parts[0].radius if is_round(shape) else 0.0)
            has_hulls = not bool(point.all())
            self._bodies[kind] = _RobotBodies(first, bodies, hull, corners, has_hulls, rounding)
        return self._bodies[kind]


class _RobotBodies(NamedTuple):
    """The bodies of robots of all kinds, grown by one kind of skeleton, see `GrownBodies`."""

    first: Indices  # (s + 1,)
    each: Records[RobotBody]  # (r,)
    hull: Indices  # (r,) its own number, or -1 if it is the origin
    corners: Corners
    has_hulls: bool  # whether any of them is more than the origin
    rounding: float  # [m] of the skeleton
