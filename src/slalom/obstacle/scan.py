"""Obstacles of a laser scan: a disc at rest about each point."""

from collections import Counter
from functools import cached_property

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array, array, array_of, not_negative, or_infinite, positive
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import EVERY_WORLD, Bodies, Pieces, zero_records
from slalom.kernels.decision.tables import AtHorizon, ObstacleAtHorizon
from slalom.model.shape import Disc, Shape
from slalom.model.trajectory import Stationary
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.pieces import NO_TURNS, bodies_of, sum_of_shapes
from slalom.obstacle.table import NO_CORNERS, ObstacleTable, Outlines


def scan(
    ranges: npt.ArrayLike,
    angles: npt.ArrayLike,
    pose: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    radius: float = 0.03,
    min_range: float = 0.0,
    max_range: float = np.inf,
) -> "Scan":
    """The obstacles of a laser scan, for decisions: a disc at rest about each point.

    A range that is nan or infinite, below `min_range` or above `max_range`, is no point; `Scan.unused` counts them.

    Args:
        ranges: (n,) [m], as in sensor_msgs/LaserScan. angles: (n,) [rad] of the beams from the x axis of the sensor.
        pose: (x, y, heading) [m, m, rad] of the sensor at the time of the scan.
        radius: [m] of the discs: the error of ranges, and half of the distance of neighbouring points that matters.
        min_range: [m] below which the sensor sees the robot itself. max_range: [m] of the sensor.

    Raises:
        InvalidInput: arrays of other shapes; a pose or an angle that is not finite; a radius that is not above 0; a
            range below 0.
    """
    try:
        measured = np.asarray(ranges, np.float64)
    except (OverflowError, TypeError, ValueError):
        raise InvalidInput("ranges: expected numbers, found others") from None
    if measured.ndim != 1:
        raise InvalidInput(f"ranges: expected an array of shape (n,), found shape {measured.shape}")
    directions = array_of(angles, "angles", measured.shape)
    x, y, heading = array_of(pose, "pose", (3,)).tolist()
    near, far = not_negative(min_range, "min_range"), or_infinite(max_range, "max_range", positive)
    known = np.isfinite(measured)
    some = known & (measured >= near) & (measured <= far) & (measured > 0.0)
    unused = Counter(
        nan=int(np.isnan(measured).sum()),
        inf=int(np.isinf(measured).sum()),
        near=int((known & ((measured < near) | (measured <= 0.0))).sum()),
        far=int((known & (measured > far)).sum()),
    )
    turned = directions[some] + heading
    points = np.array((x, y)) + measured[some, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    return Scan(points, positive(radius, "radius"), +unused)


class Scan(ObstacleTable):
    """Obstacles at rest of a laser scan, made by `scan`.

    Attributes:
        points: (n, 2) [m]. radius: [m] of the disc about each.
        unused: numbers of ranges that are no points: `nan`, `inf`, `near` and `far`.
    """

    def __init__(self, points: npt.ArrayLike, radius: float, unused: "Counter[str] | None" = None) -> None:
        self.points, self.radius = array(points, "points"), radius
        self.unused = Counter(unused or {})
        self.dimension = 2 if len(self.points) else None
        self._spans = np.tile((-np.inf, np.inf), (len(self.points), 1))
        self._known_until, self._at_rest = np.inf, True
        self._uncertain = self.is_passive = self.has_futures = False
        self._bodies, self._parts = {}, {}

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        unused = "".join(f", {kind}: {count}" for kind, count in self.unused.items())
        return f"<Scan, points: {len(self)}{unused}>"

    @cached_property
    def given(self) -> tuple[Obstacle, ...]:  # type: ignore[override]  # made when asked for
        """The discs one by one."""
        shape = Disc(self.radius)
        return tuple(Obstacle(shape, Stationary(point), f"scan {k}") for k, point in enumerate(self.points))

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:  # type: ignore[override]  # made when asked for
        """The discs one by one."""
        return self.given

    def split(self, *, at_rest: bool) -> tuple[ObstacleTable, tuple[Obstacle, ...]]:
        """The table itself and no other obstacles, see `ObstacleTable.split`."""
        return self, ()

    @cached_property
    def outlines(self) -> Outlines:
        """The outlines of the discs, see `ObstacleTable.outlines`."""
        n = len(self)
        found = zero_records(ObstacleAtHorizon, n)
        found["position"][:, :2] = self.points
        found["radius"] = found["ball"] = self.radius
        found["filled"], found["world"] = True, EVERY_WORLD
        return Outlines(np.arange(n), np.zeros(n, np.bool_), AtHorizon(found, NO_CORNERS))

    def _made(self, robot: Shape, begin: float, end: float) -> Bodies:
        """All bodies from begin to end [s]: those of `ObstacleTable`, made of arrays."""
        one = sum_of_shapes(Disc(self.radius), robot)
        n, b = len(self), len(one.radius)
        shape = one.repeated(n)
        points: Array = np.repeat(self.points, b, axis=0) + shape.offsets
        times, rows = np.tile(np.array([[begin, end]]), (n * b, 1)), np.repeat(points[:, None], 4, axis=1)
        pieces = Pieces(times, rows, np.zeros(n * b), np.zeros(n * b), NO_TURNS, np.arange(n * b))
        bodies = bodies_of(pieces, shape, np.repeat(np.arange(n), b), np.zeros(n * b, np.bool_), n)
        balls = kernels.body_balls(bodies.balls, bodies.first_piece, bodies.radius + bodies.hull_radius)
        return bodies._replace(body_balls=balls)
