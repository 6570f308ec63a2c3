"""The motion of obstacles relative to a controlled robot, as one table for kernels and boundaries."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.kernels.arrays import Hulls, MaybeHulls, Segments as Table


class RelativeMotion(NamedTuple):
    """One row for each cubic segment of each convex part of an obstacle, grown by a part of the robot.

    Over the elapsed times begin[s] to end[s], with x from 0 to 1, the position of the part's origin relative to
    the robot under control u is the cubic with control points points[j, :, s] - gains[j, s] * u, j = 0..3. A part with
    hull[s] = -1 is that point; any other is the convex hull of its corners, which lie at

        origin + (x + X e_x - Y e_y, y + X e_y + Y e_x, z)    for (x, y, z, X, Y) in corners[first[h] : first[h + 1]],

    h = hull[s]: x, y, z do not turn, X, Y turn with the direction e, the cubic with control points turns[j, :, s],
    which stays (1, 0) unless the obstacle turns.
    In the plane three or more corners go counter-clockwise around the hull unless unordered[h].
    The robot collides while the distance from (0, 0, 0) to the part is below radius[s] + growth[s] * x. The part,
    rounded so, stays within bounding_radius[s] of its origin. In the plane third coordinates are 0.
    """

    begin: Array  # (s,) [s]
    end: Array  # (s,) [s]
    points: Array  # (4, 3, s) [m]
    gains: Array  # (4, s)
    radius: Array  # (s,) [m]
    bounding_radius: Array  # (s,) [m]
    owner: npt.NDArray[np.int64]  # (s,) index of the obstacle
    hull: npt.NDArray[np.int64]  # (s,) index of the hull, -1 for a point
    turns: Array  # (4, 2, s)
    corners: Array  # (c, 5) [m]
    first: npt.NDArray[np.int64]  # (h + 1,)
    growth: Array  # (s,) [m] change of the radius from begin to end
    unordered: npt.NDArray[np.bool_]  # (h,) whether the corners lie in no order, some inside the hull

    @property
    def hulls(self) -> MaybeHulls:
        """The hulls as kernels take them; empty where all bodies are points."""
        if self.hull.max(initial=-1) < 0:
            return ()
        return Hulls(self.hull, self.turns, self.corners, self.first, self.unordered)

    @property
    def table(self) -> Table:
        """The segments as kernels take them."""
        return Table(self.points, self.gains, self.radius, self.growth, self.bounding_radius)
