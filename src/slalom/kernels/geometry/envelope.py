"""Envelopes of discs of controls: cubic pieces, cut until chords represent the envelope (`choice.envelope`).

A piece is held by its control points (4, 4): place (x, y), gain, radius. Its disc has the centre place / gain and the
size radius / gain.
"""

import numpy as np

from slalom.base.tolerances import CONTACT, DEPTH, STILL
from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.jit import kernel

Disc = tuple[float, float, float, float, float, float]
"""Centre (x, y), size, heading [rad], opening [rad], cosine of the opening, 1 and more where there is none."""


@kernel
def off_chord(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Distance of (x, y) from the segment from a to b."""
    dx = bx - ax
    dy = by - ay
    share = ((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-300)
    share = min(1.0, max(0.0, share))
    return float(np.hypot(x - ax - share * dx, y - ay - share * dy))


@kernel
def may_meet(q: Array, reach: float, window: Array) -> bool:
    """Whether the discs of a piece q (4, 4) may overlap the window (x, y, radius, tolerance); never False if one does.

    The chord bound of theory.md, section 9, for the control in the middle, plus gain * radius.
    """
    x0 = q[0, 0] - q[0, 2] * window[0]
    y0 = q[0, 1] - q[0, 2] * window[1]
    x1 = q[1, 0] - q[1, 2] * window[0]
    y1 = q[1, 1] - q[1, 2] * window[1]
    x2 = q[2, 0] - q[2, 2] * window[0]
    y2 = q[2, 1] - q[2, 2] * window[1]
    x3 = q[3, 0] - q[3, 2] * window[0]
    y3 = q[3, 1] - q[3, 2] * window[1]
    tx = (x3 - x0) / 3.0
    ty = (y3 - y0) / 3.0
    bend = max(np.hypot(x1 - x0 - tx, y1 - y0 - ty), np.hypot(x2 - x3 + tx, y2 - y3 + ty))
    gain = max(max(q[0, 2], q[1, 2]), max(q[2, 2], q[3, 2]))
    # While the controls of the window are less than CONTACT apart, only an overlap at the start can be met.
    if gain * window[2] <= CONTACT:
        return False
    return bool(off_chord(x0, y0, x3, y3, 0.0, 0.0) - 0.75 * bend <= (reach + window[2] * gain) * (1.0 + 1e-9))


@kernel
def disc_at(q: Array, i: int, before: int, after: int) -> Disc:
    """The disc at control point i of a piece whose derivative goes from one control point to another."""
    x = q[i, 0]
    y = q[i, 1]
    gain = q[i, 2]
    radius = q[i, 3]
    growth = q[after, 2] - q[before, 2]
    wx = gain * (q[after, 0] - q[before, 0]) - growth * x
    wy = gain * (q[after, 1] - q[before, 1]) - growth * y
    cosine = (growth * radius - gain * (q[after, 3] - q[before, 3])) / max(np.hypot(wx, wy), 1e-300)
    opening = np.arccos(min(1.0, max(-1.0, cosine)))
    return x / gain, y / gain, radius / gain, np.arctan2(wy, wx), opening, cosine


@kernel
def turn(a: Disc, b: Disc, side: float) -> float:
    """By how much [rad] the normal of a branch turns from one disc to another."""
    angle = b[3] - a[3]
    angle -= 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    return float(abs(angle + side * (b[4] - a[4])))


@kernel
def bends(a: Disc, m: Disc, b: Disc, window: Array) -> bool:
    """Whether a branch of the envelope leaves its chord near the window, from the discs at begin, middle and end."""
    low = 1.0 / max(a[5], 1e-9), 1.0 / max(m[5], 1e-9), 1.0 / max(b[5], 1e-9)
    # Not only at the three times: the reciprocal cosine is below 1 there by more than it varies.
    if max(low) * 2.0 - min(low) < 1.0:
        return False
    for side in (1.0, -1.0):
        ax = a[0] + a[2] * np.cos(a[3] + side * a[4])
        ay = a[1] + a[2] * np.sin(a[3] + side * a[4])
        mx = m[0] + m[2] * np.cos(m[3] + side * m[4])
        my = m[1] + m[2] * np.sin(m[3] + side * m[4])
        bx = b[0] + b[2] * np.cos(b[3] + side * b[4])
        by = b[1] + b[2] * np.sin(b[3] + side * b[4])
        one = turn(a, m, side)
        two = turn(m, b, side)
        # The envelope is tangent to each disc, so its direction is known. An arc over half a chord of length l that
        # turns by d rises l d / 2 over the whole chord.
        rise = max(np.hypot(mx - ax, my - ay) * one, np.hypot(bx - mx, by - my) * two)
        if max(rise / 2.0, off_chord(ax, ay, bx, by, mx, my)) <= window[3]:
            continue
        away = min(off_chord(ax, ay, mx, my, window[0], window[1]), off_chord(mx, my, bx, by, window[0], window[1]))
        if not (away > window[2] + 2.0 * rise and max(one, two) < 0.5):
            return True
    return False


@kernel
def cut(q: Array, left: Array, right: Array) -> None:
    """The two halves of a piece (de Casteljau)."""
    for i in range(4):
        a = (q[0, i] + q[1, i]) / 2.0
        b = (q[1, i] + q[2, i]) / 2.0
        c = (q[2, i] + q[3, i]) / 2.0
        d = (a + b) / 2.0
        e = (b + c) / 2.0
        f = (d + e) / 2.0
        left[0, i] = q[0, i]
        left[1, i] = a
        left[2, i] = d
        left[3, i] = f
        right[0, i], right[1, i], right[2, i], right[3, i] = f, e, c, q[3, i]


@kernel
def grazing_discs(control: Array, reach: Array, window: Array) -> tuple[Indices, Array, Array, Flags]:
    """Cut pieces until the chords of their envelope stay within tolerance; omit pieces that cannot overlap the window.

    Args:
        control: (4, 4 or more, n). reach: (n,) of the elements. window: x, y, radius, tolerance.

    Returns:
        In order of piece and time: the piece (k,), begin and end from 0 to 1 (2, k), control points (k, 4, 4). Then
        flags (k,): the element hardly moves although its touching normals turn.
    """
    piece = np.empty(256, np.int64)
    times = np.empty((2, 256))
    points = np.empty((256, 4, 4))
    sharp = np.empty(256, np.bool_)
    count = 0
    stack = np.empty((DEPTH + 2, 4, 4))
    spans = np.empty((DEPTH + 2, 3))
    q = np.empty((4, 4))
    left = np.empty((4, 4))
    right = np.empty((4, 4))
    for n in range(control.shape[2]):
        stack[0] = control[:, :4, n]
        spans[0] = np.array([0.0, 1.0, 0.0])
        waiting = 1
        while waiting:
            waiting -= 1
            q[:] = stack[waiting]
            begin, end, level = spans[waiting]
            if not may_meet(q, reach[n], window):
                continue
            cut(q, left, right)
            bent = True
            still = False
            # Where the gain is 0 there is no element.
            if q[0, 2] > 0.0:
                a = disc_at(q, 0, 0, 1)
                m = disc_at(right, 0, 0, 1)
                b = disc_at(q, 3, 2, 3)
                moved = np.hypot(m[0] - a[0], m[1] - a[1]) + np.hypot(b[0] - m[0], b[1] - m[1])
                still = moved + abs(m[2] - a[2]) + abs(b[2] - m[2]) < STILL * window[3]
                bent = bends(a, m, b, window)
            if not bent or still:
                if count == len(piece):
                    piece = np.append(piece, piece)
                    sharp = np.append(sharp, sharp)
                    times = np.append(times, times, axis=1)
                    points = np.append(points, points, axis=0)
                piece[count] = n
                times[0, count] = begin
                times[1, count] = end
                sharp[count] = bent
                points[count] = q
                count += 1
            elif level < DEPTH - 1:
                middle = (begin + end) / 2.0
                stack[waiting] = right
                stack[waiting + 1] = left
                spans[waiting, 0] = middle
                spans[waiting, 1] = end
                spans[waiting, 2] = level + 1.0
                spans[waiting + 1, 0] = begin
                spans[waiting + 1, 1] = middle
                spans[waiting + 1, 2] = level + 1.0
                waiting += 2
    return piece[:count], times[:, :count], points[:count], sharp[:count]
