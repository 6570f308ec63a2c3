"""Which motions of a body along arcs are clear of obstacles at rest, certified in continuous time.

An arc is clear if the body in the middle of it, grown by the longest motion of its points from there, is clear.
Otherwise its parts are tested in the same way, down to a motion of RESOLUTION. An arc is not clear if the body overlaps
an obstacle at one of these poses, or if it is not decided by then. So what is clear is so at all times.
Motions that keep more than RESOLUTION are clear.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from slalom.base.checks import SHAPE, Array, has, listing, number, vector
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import Indices
from slalom.model.shape import Shape
from slalom.vehicle.curves import moved

Flags: TypeAlias = npt.NDArray[np.bool_]

RESOLUTION: Final = 1e-3
"""[m] Motions that come nearer to an obstacle than this are not clear. Larger: narrow gaps are missed. Half of it: one
more halving of arcs along obstacles, which doubles their work."""

PARTS: Final = 4
"""[1] Parts into which an undecided arc is cut. More: fewer passes, each over more arcs."""

NORMALS: Final = 24
"""[1] Normals of the polygon that contains a rounded body. More: slower tests. Fewer: a larger body; a disc of 1 m
grows by up to 1 / cos(pi / 24) - 1 m, 9 mm."""

BEVEL: Final = 0.25 * np.pi
"""[rad] Largest angle between normals of the polygon of a body with corners, by which it is grown. Larger: quicker
tests. Smaller: near corners a clearance counts as less reduced, with pi / 4 by up to 8 %."""

ROUNDED: Final = 2e-3
"""[m] By how much the polygons of round obstacles are larger at most, see `outline`. Larger: quicker tests. Smaller:
more sides, 23 for a disc of 0.2 m and 50 for one of 1 m with 2 mm."""


@dataclass(frozen=True)
class ConvexBody:
    """Convex part of a body in the frame of its axle: all x with normals (k, 2) @ x <= offsets (k,) [m].

    `corners` (c, 2) and `rounding` [m] are those of its shape, `middle` (2,) and `reach` [m] those of a disc around it.
    """

    normals: Array
    offsets: Array
    corners: Array
    rounding: float

    @cached_property
    def middle(self) -> Array:
        return np.asarray(0.5 * (self.corners.min(axis=0) + self.corners.max(axis=0)))

    @cached_property
    def reach(self) -> float:
        return float(np.linalg.norm(self.corners - self.middle, axis=1).max()) + self.rounding

    def motion(self, lengths: Array, turns: Array) -> Array:
        """Longest paths (n,) [m] of points of the body along arcs (n,)."""
        x, y = self.corners[:, 0], self.corners[:, 1]
        longest = np.hypot(lengths[:, None] - turns[:, None] * y, turns[:, None] * x).max(axis=1)
        return np.asarray(longest + self.rounding * np.abs(turns))


def convex_bodies(body: Shape, center: float = 0.0) -> tuple[ConvexBody, ...]:
    """The convex parts of a body whose position is `center` [m] ahead of its axle, its x axis along the heading.

    Raises:
        InvalidInput: something else than a shape in the plane.
    """
    has(body, *SHAPE, "body")
    if body.dimension != 2:
        raise InvalidInput(f"body: expected a shape in the plane, found {type(body).__name__} in space")
    center = number(center, "center")
    return tuple(_convex_body(part.corners + np.array([center, 0.0]), part.radius) for part in body.parts)


def _convex_body(corners: Array, rounding: float) -> ConvexBody:
    if len(corners) < 3:
        angles = 2.0 * np.pi / NORMALS * np.arange(NORMALS)
        if len(corners) == 2:
            angles = angles + np.arctan2(*(corners[1] - corners[0])[::-1])
    else:
        sides = np.roll(corners, -1, axis=0) - corners
        at = np.arctan2(-sides[:, 0], sides[:, 1])
        between = (np.roll(at, -1) - at) % (2.0 * np.pi)
        parts = np.ceil(between / BEVEL - 1e-9).astype(np.int64)
        part = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        angles = np.repeat(at, parts) + part * np.repeat(between / parts, parts)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return ConvexBody(normals, (normals @ corners.T).max(axis=1) + rounding, corners, rounding)


def outline(shape: Shape, position: Sequence[float] | Array, heading: float = 0.0) -> Any:
    """Geometry of shapely that contains a shape at a position (2,) [m] with a heading [rad]; exact without rounding.

    Raises:
        InvalidInput: something else than a shape in the plane, two numbers and one.
    """
    has(shape, *SHAPE, "shape")
    place, angle = vector(position, "position", shape.dimension), number(heading, "heading")
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    found = []
    for part in shape.parts:
        corners = part.corners @ turn + place
        if part.radius > 0.0:
            sides = int(np.ceil(np.pi / np.arccos(part.radius / (part.radius + ROUNDED))))
            angles = 2.0 * np.pi / sides * np.arange(sides)
            rim = np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.cos(np.pi / sides)
            corners = (corners[:, None] + part.radius * rim).reshape(-1, 2)
        found.append(shapely.convex_hull(shapely.multipoints(corners)))
    return found[0] if len(found) == 1 else shapely.union_all(found)


class Scene:
    """A body among obstacles at rest.

    Args:
        bodies: the convex parts of the body. obstacles: geometries of shapely in the plane; contact is not overlap.

    Raises:
        InvalidInput: something else than a list of geometries that are not empty.
    """

    def __init__(self, bodies: tuple[ConvexBody, ...], obstacles: Sequence[Any]) -> None:
        listing(obstacles, "a list of geometries of shapely", "obstacles")
        for k, obstacle in enumerate(obstacles):
            if not isinstance(obstacle, shapely.Geometry) or obstacle.is_empty or not obstacle.is_valid:
                raise InvalidInput(f"obstacles[{k}]: expected a valid geometry of shapely, found {obstacle!r}")
        self.bodies = bodies
        self.obstacles = np.array(list(obstacles), dtype=object)
        self.starts, self.ends = _segments(self.obstacles)
        boxes = shapely.box(*np.minimum(self.starts, self.ends), *np.maximum(self.starts, self.ends))
        self._tree = shapely.STRtree(boxes)
        self._lines = shapely.STRtree(shapely.linestrings(np.stack([self.starts.T, self.ends.T], axis=1)))

    @property
    def scale(self) -> float:
        """Largest distance [m] of a point of the body from its axle."""
        return max(float(np.linalg.norm(body.corners, axis=1).max()) + body.rounding for body in self.bodies)

    @property
    def inner(self) -> float:
        """Radius [m] of the largest disc about the middle of the first part of the body within it."""
        body = self.bodies[0]
        return float((body.offsets - body.normals @ body.middle).min())

    def near(self, places: Array, distance: float) -> Flags:
        """Whether places (n, 2) are nearer than a `distance` [m] to a boundary of an obstacle."""
        found = np.zeros(len(places), dtype=bool)
        found[self._lines.query(shapely.points(places), predicate="dwithin", distance=distance)[0]] = True
        return found

    def overlapped(self, pose: Array, growth: float = RESOLUTION) -> int | None:
        """The first obstacle that is nearer than `growth` [m] to the body at a pose (3,); None if there is none."""
        turn = np.array([[np.cos(pose[2]), np.sin(pose[2])], [-np.sin(pose[2]), np.cos(pose[2])]])
        for body in self.bodies:
            hull = shapely.convex_hull(shapely.multipoints(body.corners @ turn + pose[:2]))
            near = np.flatnonzero(shapely.distance(hull, self.obstacles) < body.rounding + growth)
            if len(near):
                return int(near[0])
        return None

    def clear(self, poses: Array, lengths: Array, turns: Array, clearance: float = 0.0) -> Flags:
        """Whether the body keeps a clearance [m] along arcs (n,) from poses (n, 3), (n,).

        It must not lie within an obstacle at the poses, without touching its boundary: see `overlapped`.
        """
        each = np.arange(len(poses))
        return self.until(poses, lengths, turns, each, np.zeros_like(each), clearance) > 0

    def until(
        self, poses: Array, lengths: Array, turns: Array, chain: Indices, place: Indices, clearance: float = 0.0
    ) -> Indices:
        """The place of the first arc in each chain along which the body does not keep a clearance [m].

        Where all arcs keep it, the number of the arcs in all chains. Arcs after the first one need no tests.

        Args:
            poses: (n, 3), lengths, turns: (n,), of arcs as of `clear`. chain: (n,) of each arc, from 0 on. place: (n,)
                of each arc in its chain.
        """
        first = np.full(int(chain.max(initial=-1)) + 1, len(poses))
        for body in self.bodies:
            which = np.flatnonzero(place < first[chain])
            at = poses[which]
            length, turn = lengths[which], turns[which]
            while len(which):
                middle = moved(at, 0.5 * length, 0.5 * turn)
                blocked = which[self._near(body, middle, np.full(len(which), clearance))]
                np.minimum.at(first, chain[blocked], place[blocked])
                # Most tests are of arcs that are blocked: what is left of their chains needs no further one.
                rest = np.flatnonzero(place[which] < first[chain[which]])
                growth = 0.5 * body.motion(length[rest], turn[rest])
                near = self._near(body, middle[rest], clearance + growth)
                blocked = which[rest[near & (growth <= RESOLUTION)]]
                np.minimum.at(first, chain[blocked], place[blocked])
                rest = rest[near]
                rest = rest[place[which[rest]] < first[chain[which[rest]]]]
                which = np.repeat(which[rest], PARTS)
                length, turn = np.repeat(length[rest], PARTS) / PARTS, np.repeat(turn[rest], PARTS) / PARTS
                part = np.tile(np.arange(PARTS), len(rest))
                at = moved(np.repeat(at[rest], PARTS, axis=0), part * length, part * turn)
        return first

    def _near(self, body: ConvexBody, poses: Array, growth: Array) -> Flags:
        """Whether a segment is nearer to the body at poses (n, 3) than a `growth` (n,) [m]."""
        near = np.zeros(len(poses), dtype=bool)
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x = poses[:, 0] + body.middle[0] * c - body.middle[1] * s
        y = poses[:, 1] + body.middle[0] * s + body.middle[1] * c
        reach = body.reach + growth
        k, j = self._tree.query(shapely.box(x - reach, y - reach, x + reach, y + reach))
        if not len(k):
            return near
        c, s = c[k], s[k]
        heights = []
        for ends in (self.starts, self.ends):
            dx, dy = ends[0, j] - poses[k, 0], ends[1, j] - poses[k, 1]
            heights.append(body.normals @ np.stack([c * dx + s * dy, c * dy - s * dx]) - body.offsets[:, None])
        near[k[_cut(heights[0], heights[1], growth[k])]] = True
        return near


def _cut(a: Array, b: Array, growth: Array) -> Flags:
    """Whether segments (n,) cut polygons, from the heights (k, n) of their ends above the sides, less a growth (n,)."""
    room, rise = growth - a, b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        share = room / rise
    enters = np.where(rise < 0.0, share, 0.0).max(axis=0)
    leaves = np.where(rise > 0.0, share, 1.0).min(axis=0)
    outside = ((room < 0.0) & (rise >= room)).any(axis=0)
    return np.asarray(~outside & (np.maximum(enters, 0.0) <= np.minimum(leaves, 1.0)))


def _segments(obstacles: np.ndarray) -> tuple[Array, Array]:
    """Ends (2, m) of all segments of the boundaries of obstacles; those of points are equal."""
    parts = shapely.get_parts(obstacles) if len(obstacles) else obstacles
    while np.any(shapely.get_num_geometries(parts) > 1):
        parts = shapely.get_parts(parts)
    plane = shapely.get_type_id(parts) == 3 if len(parts) else np.zeros(0, dtype=bool)
    rings = shapely.get_rings(parts[plane]) if plane.any() else np.zeros(0, dtype=object)
    starts, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for line in [*rings, *parts[~plane]]:
        points = shapely.get_coordinates(line)
        starts.append(points[:-1] if len(points) > 1 else points)
        ends.append(points[1:] if len(points) > 1 else points)
    return np.concatenate(starts).T.copy(), np.concatenate(ends).T.copy()
