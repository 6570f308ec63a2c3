"""Who may matter to a robot: a sieve in single precision, sixteen robots at a time, before what is asked exactly.

It lets through all that matter, and few others: it errs on their side by more than it rounds.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices, Singles, Words
from slalom.kernels.jit import kernel

WORD = 8
"""Robots whose answers are looked at in one."""
ROUNDING = 1e-6
"""[1] Of places and velocities, as a share of the largest of them; single precision is good to 6e-8 for each number."""
SLOWEST = 1e-9
"""[m/s] The squares of smaller velocities are nothing in single precision: such robots always come through."""
SLACK = 0.01
"""[1] How much wider squares are for what rounding adds to their roots. Larger: more others come through. Smaller:
rounding counts for more, and near the origin of their velocities more others come through."""


@kernel
def structure_of_arrays(position: Array, velocity: Array, radius: Array, present: Flags) -> Array:
    """Places, velocities, speeds and radii of all robots, (6, n); a radius of -inf for those that nobody meets.

    Each in a row of its own, for loops that processors do several at a time.
    """
    n = len(radius)
    rows = np.empty((6, n))
    for k in range(n):
        rows[0, k], rows[1, k] = position[k, 0], position[k, 1]
        rows[2, k], rows[3, k] = velocity[k, 0], velocity[k, 1]
        rows[4, k] = radius[k] if present[k] else -np.inf
        rows[5, k] = np.sqrt(velocity[k, 0] * velocity[k, 0] + velocity[k, 1] * velocity[k, 1])
    return rows


@kernel
def room_for(n: int) -> tuple[Singles, Flags, Words, Indices]:
    """Room for what `coarsen` writes, for answers, for the same as words, and for the numbers of some robots."""
    words = np.zeros((n + WORD - 1) // WORD, np.uint64)
    return np.empty((5, WORD * len(words)), np.float32), words.view(np.bool_), words, np.empty(n, np.int64)


@kernel
def to_single_precision(all_of: Array, x: float, y: float, coarse: Singles) -> tuple[float, float]:
    """Places from (x, y) on, velocities and radii into `coarse`; how much [m], [m/s] they are off by at most.

    Where nobody is who could be met there is no place, and nothing is ever true of it.
    """
    n, far, fast = all_of.shape[1], 0.0, 0.0
    coarse[:] = np.nan
    for k in range(n):
        if all_of[4, k] >= 0.0:
            coarse[0, k], coarse[1, k] = all_of[0, k] - x, all_of[1, k] - y
            coarse[2, k], coarse[3, k] = all_of[2, k], all_of[3, k]
            coarse[4, k] = np.inf if 0.0 < all_of[5, k] < SLOWEST else all_of[4, k]
            far = max(far, max(abs(all_of[0, k] - x), abs(all_of[1, k] - y)) + all_of[4, k])
            fast = max(fast, all_of[5, k])
    return ROUNDING * far, ROUNDING * fast


@kernel
def may_encounter(
    px: float,
    py: float,
    wx: float,
    wy: float,
    reach: float,
    end: float,
    closer: float,
    coarse: Singles,
    off: tuple[float, float],
    maybe: Flags,
) -> None:
    """Whether each may come nearer than `closer` times the sum of the radii to a robot at p with velocity w and
    radius `reach` before `end` [s].

    For the relative place r and velocity m, the least distance is |r x m| / |m|, after -(r m) / m^2. No division, no
    branch.
    """
    x, y, vx, vy, radius = coarse[0], coarse[1], coarse[2], coarse[3], coarse[4]
    far, fast = off[0] / ROUNDING + abs(px) + abs(py), off[1] / ROUNDING + abs(wx) + abs(wy)
    # What a product of a place and a velocity may be off by.
    wrong = 8.0 * ROUNDING * far * fast
    least, most = np.float32(-wrong), np.float32(wrong + 8.0 * ROUNDING * end * fast * fast + 2e-9 * end)
    p, q, u, w = np.float32(px), np.float32(py), np.float32(wx), np.float32(wy)
    scale, room = np.float32(closer), np.float32(closer * reach + 8.0 * ROUNDING * far)
    wide, more, late = np.float32(1.0 + SLACK), np.float32(2.0 / SLACK * wrong * wrong), np.float32(end * (1.0 + SLACK))
    for k in range(len(maybe)):
        rx, ry, mx, my = x[k] - p, y[k] - q, vx[k] - u, vy[k] - w
        square, toward, across = mx * mx + my * my, -(rx * mx + ry * my), rx * my - ry * mx
        touch = scale * radius[k] + room
        near = across * across <= wide * touch * touch * square + more
        maybe[k] = near & (toward > least) & (toward <= late * square + most)


@kernel
def may_enter_circle(ring: Array, x0: float, y0: float, coarse: Singles, off: float, maybe: Flags) -> None:
    """Whether each may be on the ring or on its way into it. No division, no branch."""
    x, y, vx, vy, radius = coarse[0], coarse[1], coarse[2], coarse[3], coarse[4]
    px, py = ring[0] - x0, ring[1] - y0
    # Here all that velocities are off by goes with the velocity.
    wrong = 8.0 * ROUNDING * (off / ROUNDING + abs(px) + abs(py))
    p, q, room, two = np.float32(px), np.float32(py), np.float32(ring[2] + wrong), np.float32(2.0)
    wide, least = np.float32(1.0 + SLACK), np.float32(wrong * wrong)
    for k in range(len(maybe)):
        tx, ty, size = p - x[k], q - y[k], room + two * radius[k]
        along, across = vx[k] * tx + vy[k] * ty, vx[k] * ty - vy[k] * tx
        away, square, most = tx * tx + ty * ty, vx[k] * vx[k] + vy[k] * vy[k], wide * size * size
        towards = (along > np.float32(0.0)) | (along * along < least * square)
        maybe[k] = (towards & (across * across <= most * square)) | (away <= most)


@kernel
def listed(maybe: Flags, words: Words, which: Indices) -> int:
    """How many are true; their numbers go into `which`."""
    count = 0
    for w in range(len(words)):
        if words[w] != 0:
            for k in range(WORD * w, WORD * w + WORD):
                if maybe[k]:
                    which[count] = k
                    count += 1
    return count
