"""A filter by control barrier functions: the acceleration nearest to the preferred one that keeps every barrier."""

import numpy as np

from slalom.checks import Array, not_negative, positive
from slalom.peers.crowd import Discs, Team, imported
from slalom.peers.path_integral import cut
from slalom.peers.surroundings import Surroundings, nearest_point, surroundings

SIDES = 32
"""[1] Sides of the polygons within the discs of accelerations and velocities. More: less is lost (0.5 %), more time."""
SLACK = 1e6
"""[1] Cost of the squared violation [m^2/s^4] of barriers that cannot all be kept, beside that of the difference to
the preferred acceleration. Larger: rounding decides; smaller: barriers are violated that could be kept."""
ROOT = 1e-9
"""[m, m/s] Least distance or speed that is divided by. Larger: barriers of robots in contact are less exact."""


class BarrierFilter:
    """Team in which each robot solves one quadratic program for its acceleration (Wang, Ames and Egerstedt, T-RO 2017).

    A pair at distance d [m] with the relative velocity s [m/s] along the line between the centres has the barrier

        h = sqrt(2 A (d - r)) + s >= 0,

    A: sum of both maximum accelerations, 0 for discs and walls, which do not brake for the robot; r: sum of the radii
    and `margin` [m]. It is kept by h' >= -min(`gain` h^3, h / period). Each robot of a team does the part a / A of it,
    with its own maximum acceleration a. The program is that of Ames, Xu, Grizzle and Tabuada, IEEE TAC 62(8), 2017. The
    second bound is for accelerations that are held over a period. Where not all barriers can be kept the largest
    violation is least. Others are expected to keep their velocity but for their share.

    Raises:
        InvalidInput: a gain not above 0, a margin below 0; daqp is not installed.
    """

    def __init__(self, team: Team, *, margin: float = 0.0, horizon: float, gain: float = 1.0) -> None:
        self._solver = imported("daqp")
        self._team, self._margin = team, not_negative(margin, "margin")
        self._horizon, self._gain = positive(horizon, "horizon"), positive(gain, "gain")
        angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
        self._directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        around = surroundings(self._team, positions, velocities, others, self._horizon)
        return np.array([self._next(k, *row) for k, row in enumerate(zip(positions, velocities, preferred, around))])

    def _next(self, k: int, position: Array, velocity: Array, preferred: Array, around: Surroundings) -> Array:
        period, max_speed = self._team.period, float(self._team.max_speeds[k])
        most, inside = float(self._team.max_accelerations[k]), np.cos(np.pi / SIDES)
        wanted = cut((preferred - velocity) / period, most)
        normals, least = self._barriers(k, position, velocity, around)
        # Variables: acceleration and violation. The last rows are soft by the violation alone.
        none, one = np.zeros((SIDES, 1)), np.ones((len(least), 1))
        rows = np.vstack(
            [
                np.hstack([self._directions, none]),
                np.hstack([self._directions, none]),
                np.hstack([-normals, -one]),
                [[0.0, 0.0, -1.0]],
            ]
        )
        speeds = np.maximum(max_speed * inside - self._directions @ velocity, -most * inside * period) / period
        upper = np.concatenate([np.full(SIDES, most * inside), speeds, -least, [0.0]])
        cost, linear = np.diag([1.0, 1.0, SLACK]), np.array([-wanted[0], -wanted[1], 0.0])
        acceleration, _, found, _ = self._solver.solve(cost, linear, rows, upper, np.full(len(upper), -1e30))
        if found <= 0:
            return np.full(2, np.nan)
        return np.asarray(velocity + period * np.asarray(acceleration)[:2])

    def _barriers(self, k: int, position: Array, velocity: Array, around: Surroundings) -> tuple[Array, Array]:
        """Unit vectors (m, 2), and least accelerations (m,) [m/s^2] along them."""
        own = float(self._team.max_accelerations[k])
        edges = list(zip(around.starts, around.ends))
        points = np.array([nearest_point(position, *edge) for edge in edges]).reshape(-1, 2)
        faces = [not any(np.array_equal(point, end) for end in edge) for point, edge in zip(points, edges)]
        still = np.zeros_like(points)
        offsets = position - np.concatenate([around.positions, points])
        relative = velocity - np.concatenate([around.velocities, still])
        radii = np.concatenate([around.radii, np.zeros(len(points))]) + around.radius + self._margin
        members = np.where(around.members >= 0, self._team.max_accelerations[around.members], 0.0)
        both = own + np.concatenate([members, np.zeros(len(points))])
        distances = np.hypot(*offsets.T)
        normals = offsets / np.maximum(distances, ROOT)[:, None]
        closing = np.einsum("ij,ij->i", normals, relative)
        root = np.sqrt(2.0 * both * np.maximum(distances - radii, 0.0))
        barrier = root + closing
        turning = (np.square(relative).sum(axis=1) - closing**2) / np.maximum(distances, ROOT)
        # The distance to a face does not change with the motion along it.
        turning[len(around.radii) :][np.array(faces, dtype=bool)] = 0.0
        decay = np.minimum(self._gain * barrier**3, barrier / self._team.period)
        # A robot that is too near and comes nearer brakes, and moves away at most twice as hard.
        braking = np.clip(-closing / np.maximum(root, ROOT), -1.0, 2.0) * both
        return normals, (own / both) * np.minimum(braking - turning - decay, 2.0 * both)
