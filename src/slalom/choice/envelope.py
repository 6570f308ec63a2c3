"""Grazing curves of the elements of a control obstacle, in the plane; their faces make up the control obstacle.

At one time the element of a point is a disc of controls, and that of a hull a rounded polygon. A control enters or
leaves the union of elements only across three curves. These are the envelope of their outlines, the back of a first
element, and the front of a last one. Source: theory.md section 6; Stern and Shiller, arXiv:2506.06255. This module
joins these pieces to closed curves. Gaps, caps, swallowtails and jumps of the velocity then need no special treatment:

* The centre C / g of a disc moves along w = g C' - g' C. The disc touches the envelope at the angles +-a from w, where
  |w| cos a = g' R - g R'. The closed curve follows +a forwards in time, the front of the last disc, -a backwards, and
  the back of the first disc. Its winding number about a control is the number of visits of the robot to the obstacle
  under that control. While a disc shrinks inside its predecessors a is 0: the two sides coincide and cancel.
* The outline of a rounded polygon sweeps cells, each outwards or inwards. Three curves together are closed for the same
reason. These are the curve between the two kinds, the first outline where it moves inwards, and the last one where it
moves outwards.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import BALL_ROUNDING, CONTACT, DEPTH, DIVISOR_FLOOR, JUMP, STILL
from slalom.kernels.arrays import Flags, Hulls, Indices, Segments


class RelativeMotion(NamedTuple):
    """One row for each cubic segment of each convex part of an obstacle, grown by a part of the robot.

    Over the elapsed times begin[s] to end[s], with x from 0 to 1, the position of the part's origin relative to the
    robot under control u is the cubic with control points points[j, :, s] - gains[j, s] * u, j = 0..3. A part with
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
    owner: Indices  # (s,) index of the obstacle
    table: Segments
    hulls: Hulls  # of all rows, with directions


def in_frame_of_gain(motion: RelativeMotion) -> RelativeMotion:
    """The same motion seen from a frame that turns with the gain, where the gain is a number: for boundaries only.

    An element is {u: |p - G u| < r} = {u: |p |G| / G - |G| u| < r}. Both factors and the directions of hulls are cubic
    again, through their values and rates at the ends of each segment. The largest error is about the distance of a body
    times the fourth power of the angle of a segment, over 384.

    Raises:
        InvalidInput: bodies with a part that turns with an obstacle and a part that does not.
    """
    table, hulls = motion.table, motion.hulls
    if table.cross.shape[1] == 0:
        return motion
    gain = table.gains + 1j * table.cross
    ends = gain[[0, 3]]
    acts = np.abs(ends) > 0.0
    relative_rate = np.where(acts, 3.0 * (gain[[1, 3]] - gain[[0, 2]]) / np.where(acts, ends, 1.0), 0.0)
    back = np.where(acts, np.conj(ends) / np.where(acts, np.abs(ends), 1.0), 1.0)

    def turned(x: Array, y: Array) -> npt.NDArray[np.complex128]:
        plane = x + 1j * y
        rate = 3.0 * (plane[[1, 3]] - plane[[0, 2]]) - 1j * relative_rate.imag * plane[[0, 3]]
        return _through(back * plane[[0, 3]], back * rate)

    scale = np.abs(ends)
    grows = np.where(acts, relative_rate.real * scale, np.abs(3.0 * (gain[[1, 3]] - gain[[0, 2]])))
    place, direction = turned(table.points[:, 0], table.points[:, 1]), turned(hulls.turns[:, 0], hulls.turns[:, 1])
    corners, fixed = hulls.corners.copy(), hulls.corners[:, :2]
    turning = hulls.hull[(hulls.hull >= 0) & ((hulls.turns[:, 0] != 1.0) | (hulls.turns[:, 1] != 0.0)).any(axis=0)]
    if any(fixed[hulls.first[h] : hulls.first[h + 1]].any() for h in np.unique(turning)):
        raise InvalidInput(
            "boundary: expected a disc as the robot, as obstacles turn and the response does, found another"
        )
    # In this frame what does not turn in the world turns too.
    corners[:, 3:5] += fixed
    corners[:, :2] = 0.0
    points = np.stack([place.real, place.imag, np.zeros_like(place.real)], axis=1)
    frame = table._replace(points=points, gains=_through(scale, grows), cross=np.empty((4, 0)))
    turns = np.ascontiguousarray(np.stack([direction.real, direction.imag], axis=1))
    return motion._replace(table=frame, hulls=hulls._replace(turns=turns, corners=corners))


def _through(values: npt.NDArray[Any], rates: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Control points (4, n) of cubics with values (2, n) and rates (2, n) at 0 and 1."""
    return np.stack([values[0], values[0] + rates[0] / 3.0, values[1] - rates[1] / 3.0, values[1]])


class Window(NamedTuple):
    """Disc of controls to resolve, and the tolerance of the curves in it [unit of the control]."""

    center: Array  # (2,)
    radius: float
    tolerance: float


class Spans(NamedTuple):
    """Parts of rows in which elements may overlap the window, ordered by row and time."""

    row: Indices  # (k,) row of the table
    begin: Array  # (k,) local time from 0 to 1
    end: Array  # (k,)
    control: Array  # (4, c, k) control points: position (2), gain, radius, for hulls direction (2)
    sharp: Flags  # (k,) the element hardly moves, but its normals at contact turn

    def continues(self, linked: Flags) -> tuple[Flags, Flags]:
        """Whether each span continues the previous one: within its row, or from a `linked` row; (k,) each."""
        same_row = np.zeros(len(self.row), dtype=bool)
        same_row[1:] = (self.row[1:] == self.row[:-1]) & (self.begin[1:] == self.end[:-1])
        joined = np.zeros(len(self.row), dtype=bool)
        joined[1:] = (self.row[1:] == self.row[:-1] + 1) & (self.end[:-1] == 1.0) & (self.begin[1:] == 0.0)
        return same_row, joined & linked[self.row]


class GrazingDiscs(NamedTuple):
    """Discs of controls, and their grazing points at the angles heading + opening and heading - opening."""

    center: Array  # (2, k)
    radius: Array  # (k,)
    heading: Array  # (k,) [rad]
    opening: Array  # (k,) [rad], 0 where the disc shrinks inside its predecessors
    shrinking: Array  # (k,) cosine of the opening; 1 or more where the disc has no grazing point

    def at(self, side: float) -> Array:
        """Grazing controls (2, k) of the branch side = 1 or -1."""
        angle = self.heading + side * self.opening
        return np.asarray(self.center + self.radius * np.stack([np.cos(angle), np.sin(angle)]))


def grazing_discs(point: Array, derivative: Array) -> GrazingDiscs:
    """Discs of controls at `point` (4+, k): position, gain > 0 and radius.

    `derivative` (4+, k) is a positive multiple of the derivative of `point`.
    """
    gain, radius = point[2:4]
    w = gain * derivative[:2] - derivative[2] * point[:2]
    cosine = (derivative[2] * radius - gain * derivative[3]) / np.maximum(np.hypot(w[0], w[1]), 1e-300)
    opening = np.arccos(np.clip(cosine, -1.0, 1.0))
    return GrazingDiscs(point[:2] / gain, radius / gain, np.arctan2(w[1], w[0]), opening, cosine)


def discs_at_start(control: Array) -> GrazingDiscs:
    """Discs at the start of spans with control points (4, 4+, k)."""
    return grazing_discs(control[0], control[1] - control[0])


def discs_at_end(control: Array) -> GrazingDiscs:
    """Discs at the end of spans with control points (4, 4+, k)."""
    return grazing_discs(control[3], control[3] - control[2])


def halves(control: Array) -> tuple[Array, Array]:
    """Control points (4, ...) of the two halves of cubics (de Casteljau)."""
    a, b, c = (control[1:] + control[:-1]) / 2.0
    d, e = (a + b) / 2.0, (b + c) / 2.0
    middle = (d + e) / 2.0
    return np.stack([control[0], a, d, middle]), np.stack([middle, e, c, control[3]])


def chord_distance(a: Array, b: Array, c: Array) -> Array:
    """Distance (...) of c from the segment from a to b, (2, ...) each."""
    direction, difference = b - a, c - a
    share = (difference * direction).sum(axis=0) / np.maximum((direction * direction).sum(axis=0), 1e-300)
    difference = difference - np.clip(share, 0.0, 1.0) * direction
    return np.asarray(np.hypot(difference[0], difference[1]))


def length(a: Array) -> Array:
    """Lengths (...) of vectors (2, ...)."""
    return np.asarray(np.hypot(a[0], a[1]))


def wrapped(angle: Array) -> Array:
    """Angles wrapped to -pi to pi."""
    return np.asarray(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi)))


def arc_step(radius: Array, tolerance: float) -> Array:
    """Angle [rad] over which an arc rises by the tolerance above its chord."""
    return np.asarray(2.0 * np.arccos(1.0 - np.minimum(tolerance / np.maximum(radius, 1e-300), 0.1)))


def may_meet(control: Array, bounding_radius: Array, window: Window) -> Flags:
    """Whether the elements of spans (4, 4+, k) may overlap the window: (k,), never False where one does.

    Chord bound of theory.md section 9 for the central control; it allows for gain * radius. `bounding_radius` (k,).
    """
    relative = control[:, :2] - control[:, 2:3] * window.center[:, None]
    third = (relative[3] - relative[0]) / 3.0
    bulge = np.maximum(length(relative[1] - relative[0] - third), length(relative[2] - relative[3] + third))
    distance = chord_distance(relative[0], relative[3], np.zeros_like(third)) - 0.75 * bulge
    return np.asarray(distance <= (bounding_radius + window.radius * control[:, 2].max(axis=0)) * (1.0 + BALL_ROUNDING))


Meets = Callable[[Indices, Array], Flags]
"""(indices of rows, control) -> whether the elements of spans may overlap the window: (k,)."""

Bends = Callable[[Array, Array, Array], tuple[Flags, Flags]]
"""(control, left half, right half) -> two masks (k,): curves leave their chords; the element is nearly static."""


def sample(rows: Indices, control: Array, window: Window, meets: Meets, bends: Bends) -> Spans:
    """Halve rows until the chords of spans stay within tolerance of their curves.

    Spans that cannot overlap the window are dropped.

    Args:
        rows: (n,) of the table.
        control: (4, c, n) control points of these rows.
    """
    which = np.arange(len(rows))
    begin = np.zeros(len(rows))
    end = np.ones(len(rows))
    done = [Spans(which[:0], begin[:0], end[:0], control[:, :, :0], np.empty(0, dtype=bool))]
    for _ in range(DEPTH):
        # While the controls of the window are less than CONTACT apart, only an initial overlap can collide.
        near = meets(which, control) & (control[:, 2].max(axis=0) * window.radius > CONTACT)
        which = which[near]
        begin = begin[near]
        end = end[near]
        control = control[:, :, near]
        if not which.size:
            break
        left, right = halves(control)
        # Without gain there is no element.
        started = control[0, 2] > 0.0
        bent, still = np.ones_like(started), np.zeros_like(started)
        bent[started], still[started] = bends(*(part[:, :, started] for part in (control, left, right)))
        ready = ~bent | still
        done.append(Spans(which[ready], begin[ready], end[ready], control[:, :, ready], bent[ready]))
        middle, which = ((begin + end) / 2.0)[~ready], np.tile(which[~ready], 2)
        begin, end = np.concatenate([begin[~ready], middle]), np.concatenate([middle, end[~ready]])
        control = np.concatenate([left[:, :, ~ready], right[:, :, ~ready]], axis=2)
    which = np.concatenate([part.row for part in done])
    begin = np.concatenate([part.begin for part in done])
    order = np.lexsort((begin, which))
    return Spans(
        rows[which[order]],
        begin[order],
        np.concatenate([part.end for part in done])[order],
        np.concatenate([part.control for part in done], axis=2)[:, :, order],
        np.concatenate([part.sharp for part in done])[order],
    )


def discs_bend(window: Window) -> Bends:
    """Test for `sample`: whether a branch of the envelope leaves its chord near the window."""

    def bends(control: Array, left: Array, right: Array) -> tuple[Flags, Flags]:
        discs = discs_at_start(control), discs_at_start(right), discs_at_end(control)
        a, m, b = discs
        moved = length(m.center - a.center) + length(b.center - m.center)
        still = moved + abs(m.radius - a.radius) + abs(b.radius - m.radius) < STILL * window.tolerance
        bent = np.zeros(control.shape[2], dtype=bool)
        for side in (1.0, -1.0):
            start, middle, end = (disc.at(side) for disc in discs)
            turns = [
                abs(wrapped(after.heading - before.heading) + side * (after.opening - before.opening))
                for before, after in ((a, m), (m, b))
            ]
            # The envelope is tangent to each disc, so its direction is known. An arc over half a chord of length l that
            # turns by d rises l d / 2 over the whole chord.
            rise = np.maximum(length(middle - start) * turns[0], length(end - middle) * turns[1])
            off = np.maximum(rise / 2.0, chord_distance(start, end, middle))
            here = window.center[:, None]
            distance = np.minimum(chord_distance(start, middle, here), chord_distance(middle, end, here))
            far = (distance > window.radius + 2.0 * rise) & (np.maximum(turns[0], turns[1]) < 0.5)
            bent |= (off > window.tolerance) & ~far
        inverse = 1.0 / np.maximum(np.stack([disc.shrinking for disc in discs]), DIVISOR_FLOOR)
        # Valid between the three times too: the reciprocal cosine is below 1 by more than its variation.
        nested = inverse.max(axis=0) * 2.0 - inverse.min(axis=0) < 1.0
        return bent & ~nested, still

    return bends


def linked_rows(motion: RelativeMotion) -> Flags:
    """Whether each row continues where the previous one ends: (s,)."""
    linked = np.zeros(len(motion.begin), dtype=bool)
    points = motion.table.points
    hull, turns = motion.hulls.hull, motion.hulls.turns
    linked[1:] = (
        (motion.owner[1:] == motion.owner[:-1])
        & (hull[1:] == hull[:-1])
        & (motion.begin[1:] == motion.end[:-1])
        & (abs(points[0, :2, 1:] - points[3, :2, :-1]).max(axis=0, initial=0.0) <= JUMP)
        & (abs(turns[0, :, 1:] - turns[3, :, :-1]).max(axis=0, initial=0.0) <= JUMP)
    )
    return linked


class Nodes(NamedTuple):
    """Discs of point parts in order, at the ends of spans and on both sides of joints."""

    discs: GrazingDiscs  # (n,), headings without jumps of 2 pi
    run: Indices  # (n,) run: discs of one run have no gap in time
    arc: Flags  # (n,) the element is static until the next disc while its normals at contact turn
    owner: Indices  # (n,)
    time: Array  # (n,) [s]


def point_nodes(motion: RelativeMotion, window: Window, rows: Indices, control: Array) -> Nodes:
    """Discs of the points in rows (k,) with control points (4, 4, k) that may overlap the window."""
    reach = motion.table.bounding_radius[rows]
    spans = sample(
        rows, control[:, :4], window, lambda which, part: may_meet(part, reach[which], window), discs_bend(window)
    )
    same, joint = spans.continues(linked_rows(motion))
    before, length = motion.begin[spans.row], (motion.end - motion.begin)[spans.row]
    # The start of each span, and its end unless the next span of the row starts there.
    keep = np.stack([np.ones_like(same), ~np.append(same, False)[1:]], axis=1).ravel()

    def both(a: npt.NDArray[Any], b: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.stack([a, b], axis=-1).reshape(*a.shape[:-1], -1)[..., keep]

    discs = GrazingDiscs(*map(both, discs_at_start(spans.control), discs_at_end(spans.control)))
    owner = motion.owner[spans.row]
    return Nodes(
        discs._replace(heading=np.cumsum(wrapped(np.diff(discs.heading, prepend=0.0)))),
        np.cumsum(both(~(same | joint), np.zeros_like(same))) - 1,
        both(spans.sharp, np.ones_like(same)),
        both(owner, owner),
        both(before + spans.begin * length, before + spans.end * length),
    )


def rows_of_hull(motion: RelativeMotion, hull: int) -> tuple[Indices, Array]:
    """Rows (k,) of a hull, -1 for points, and their control points (4, 6, k): position, gain, radius, direction."""
    table, rows = motion.table, np.flatnonzero(motion.hulls.hull == hull)
    radius = table.radius[rows] + table.growth[rows] * np.arange(4)[:, None] / 3.0
    position, gain = table.points[:, :2, rows], table.gains[:, None, rows]
    return rows, np.concatenate([position, gain, radius[:, None], motion.hulls.turns[:, :, rows]], axis=1)


def rows_of_corners(motion: RelativeMotion) -> Iterator[tuple[Indices, Array]]:
    """Rows and control points of all point parts, then of each corner of each hull."""
    yield rows_of_hull(motion, -1)
    hulls = motion.hulls
    for hull in np.unique(hulls.hull[hulls.hull >= 0]):
        rows, control = rows_of_hull(motion, hull)
        ex, ey = control[:, 4], control[:, 5]
        for x, y, _, turning_x, turning_y in hulls.corners[hulls.first[hull] : hulls.first[hull + 1]]:
            corner = control.copy()
            corner[:, 0] += x + turning_x * ex - turning_y * ey
            corner[:, 1] += y + turning_x * ey + turning_y * ex
            yield rows, corner


def grazing_curves(
    motion: RelativeMotion, center: Array, radius: float, tolerance: float
) -> list[tuple[int, Array, Array]]:
    """Controls that graze point parts and corners of hulls, with the times of contact (theory.md section 6).

    Both branches e+- of the envelope of each. Not every grazing control bounds the control obstacle. Another element
    may contain it, and the disc of a corner may touch the inner side of its hull.

    Args:
        center, radius: (2,) and > 0, the disc of controls to resolve.
        tolerance: of the chords.

    Returns:
        owner, increasing times (k,) [s], controls (k, 2): one for each time interval without a gap.
    """
    window, curves = Window(center, radius, tolerance), []
    for rows, control in rows_of_corners(motion):
        nodes = point_nodes(motion, window, rows, control)
        has_envelope = abs(nodes.discs.shrinking) <= 1.0
        # A new curve starts where the run changes or the envelope starts or ends; at joints the normals jump.
        breaks = np.flatnonzero(
            np.diff(nodes.run) | (has_envelope[1:] != has_envelope[:-1]) | (nodes.time[1:] <= nodes.time[:-1])
        )
        for part in np.split(np.arange(len(has_envelope)), breaks + 1):
            if len(part) > 1 and has_envelope[part[0]]:
                for side in (1.0, -1.0):
                    curves.append((int(nodes.owner[part[0]]), nodes.time[part], nodes.discs.at(side).T[part]))
    return curves
