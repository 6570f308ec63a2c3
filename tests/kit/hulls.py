"""Signed distances of rounded convex hulls: plain formulas for the oracle, one for everything.

The signed distance of two sets is the distance between them where they are apart, else minus the length of the least
translation that separates them. Of convex hulls A and B it is the signed distance of the origin to A - B; with B moved
by q that of q to A - B.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

THIN = 1e-9  # [m] less deep inside nothing is: a hull without interior would else have one by rounding
CHUNK = 1 << 15  # how many signed distances at once, for the sake of the cache


def turned(points, facing):
    """Points (n, 2) of a body that faces along unit vectors (k, 2), (2, n, k)."""
    (x, y), (forward, left) = points.T[:, :, None], facing.T[:, None]
    return np.stack([x * forward - y * left, x * left + y * forward])


class Hull(NamedTuple):
    """A convex set at times k, or at all of them (k = 1): segments in it, which have all its boundary; what bounds it.

    Segments from `starts` (d, s, k) along `sides` (d, s, k). Inside is where `normals` (d, e, k) . q <= `offsets`
    (e, k); where e = 0 there is no inside.
    """

    starts: np.ndarray
    sides: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray

    def signed_distance(self, q):
        """Of points q (d, k), (k,)."""
        away = q[:, None] - self.starts
        square = np.maximum(_dot(self.sides, self.sides), 1e-300)
        share = np.clip(_dot(away, self.sides) / square, 0.0, 1.0)
        away -= share * self.sides
        distance = np.sqrt(_dot(away, away).min(axis=0))
        if not self.offsets.size:
            return distance
        depth = (_dot(q[:, None], self.normals) - self.offsets).max(axis=0)
        return np.where(depth < -THIN, depth, distance)


def _dot(a, b):
    """Products of vectors whose coordinates go along the first axis."""
    return sum(x * y for x, y in zip(a, b))


def _sides(corners):
    """Starts and sides (d, s, k) of the outlines of corners (d, n, k): none of a point, one of a segment."""
    if corners.shape[1] < 3:
        return corners[:, :-1], np.diff(corners, axis=1)
    return corners, np.roll(corners, -1, axis=1) - corners


def _outward(corners):
    """Unit normals (2, e, k) of outlines that go counter-clockwise; of a segment on both sides of it."""
    x, y = _sides(corners)[1]
    normals = np.stack([y, -x]) / np.sqrt(x * x + y * y)
    return np.concatenate([normals, -normals], axis=1) if corners.shape[1] == 2 else normals


def difference(a, b):
    """A - B of the convex hulls of corners a (d, n, k) and b (d, m, 1); in the plane, or one of them a point.

    Its boundary are sides of the one at corners of the other. Its normals are those of A and, turned round, of B.
    """
    d, n, k = a.shape
    (start_a, side_a), (start_b, side_b) = _sides(a), _sides(b)
    starts = [
        (start_a[:, :, None] - b[:, None]).reshape(d, -1, k),
        (a[:, None] - start_b[:, :, None]).reshape(d, -1, k),
    ]
    sides = [np.repeat(side_a, b.shape[1], axis=1), np.repeat(-side_b, n, axis=1)]
    if n == b.shape[1] == 1:
        starts, sides = [a - b], [0.0 * a]
    normals = _joined([_outward(a), -_outward(b)], k) if d == 2 else np.empty((d, 0, k))
    highest = _dot(normals[:, :, None], a[:, None]).max(axis=1)
    lowest = _dot(normals[:, :, None], b[:, None]).min(axis=1)
    return Hull(_joined(starts, k), _joined(sides, k), normals, highest - lowest)


def _joined(parts, k):
    return np.concatenate([np.broadcast_to(part, (*part.shape[:2], k)) for part in parts], axis=1)


def _boundary(hull):
    """The same hull (k = 1) with fewer segments: those that lie on its boundary."""
    if not hull.offsets.size:
        return hull
    middles = hull.starts + 0.5 * hull.sides
    depth = (_dot(middles[:, :, None], hull.normals[:, None]) - hull.offsets).max(axis=1)[:, 0]
    return hull._replace(starts=hull.starts[:, depth > -THIN], sides=hull.sides[:, depth > -THIN])


@dataclass
class Pair:
    """A convex part of an obstacle and one of the robot: corners (n, d) and (m, d), and the sum of their radii.

    `turns`: the corners of the obstacle are to be turned to where it faces; else they stay as they are.
    """

    obstacle: int
    a: np.ndarray
    b: np.ndarray
    radius: float
    turns: bool

    @property
    def is_round(self):
        """Whether it is a ball about its middle."""
        return len(self.a) == len(self.b) == 1

    @property
    def bound(self):
        """Radius of a ball about the middle that holds the rounded difference."""
        return self.radius + sum(np.sqrt(((x - x.mean(axis=0)) ** 2).sum(axis=1)).max() for x in (self.a, self.b))

    def middle(self, facing):
        """A point (n, d) or (1, d) of the difference."""
        middle = self.a.mean(axis=0)[None]
        return (turned(middle, facing)[:, 0].T if self.turns else middle) - self.b.mean(axis=0)

    @cached_property
    def still(self):
        """The difference if nothing turns."""
        return _boundary(difference(self.a.T[:, :, None], self.b.T[:, :, None]))

    def gap(self, q, facing=None):
        """Signed distance (k,) of the robot, at q (k, d) from the obstacle, which faces (k, 2); inf where q is nan."""
        found = np.empty(len(q))
        for k in range(0, len(q), CHUNK):
            part = slice(k, k + CHUNK)
            hull = difference(turned(self.a, facing[part]), self.b.T[:, :, None]) if self.turns else self.still
            found[part] = hull.signed_distance(np.ascontiguousarray(q[part].T)) - self.radius
        return np.where(np.isnan(found), np.inf, found)
