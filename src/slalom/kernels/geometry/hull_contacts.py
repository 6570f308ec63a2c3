"""Contacts with a rounded convex hull along a segment: whether and when, the least distance, the deepest time.

Spans of time are bisected until a bound or a distance decides. A control that slides along a hull at the distance 0
would be bisected without end: collisions less deep than CLEARANCE are not sought.
"""

import numpy as np

from slalom.kernels.arrays import Array, Direction
from slalom.kernels.geometry.cubic import value
from slalom.kernels.geometry.hull_bounds import distance_bound
from slalom.kernels.geometry.hulls import MovingHull, hull_distance
from slalom.kernels.jit import kernel
from slalom.tolerances import CLEARANCE, DEEPEST_SAMPLES, GOLDEN_STEPS, LEAST_WIDTH


@kernel
def push(stack: Array, top: int, a: float, width: float, early: Direction, late: Direction) -> None:
    """Write the span from a on, of that `width`, with the directions at both ends, into row `top` of a stack."""
    node = stack[top]
    node[0], node[1] = a, width
    node[2], node[3], node[4] = early[1], early[2], early[3]
    node[5], node[6], node[7] = late[1], late[2], late[3]


@kernel
def pop(stack: Array, top: int) -> tuple[float, float, Direction, Direction]:
    """The span in row `top` of a stack, see `push`; the distances of the directions are not kept."""
    node = stack[top]
    return node[0], node[1], (0.0, node[2], node[3], node[4]), (0.0, node[5], node[6], node[7])


@kernel
def hull_below(moving: MovingHull, stack: Array, q: Array) -> float:
    """A place x in [0, 1] at which the origin is inside the rounded hull, or -1 if nowhere by more than CLEARANCE."""
    early, late = hull_distance(moving, 0.0, q), hull_distance(moving, 1.0, q)
    if early[0] < 0.0 or late[0] < 0.0:
        return 0.0 if early[0] < 0.0 else 1.0
    push(stack, 0, 0.0, 1.0, early, late)
    top = 0
    while top >= 0:
        a, width, early, late = pop(stack, top)
        top -= 1
        if width < LEAST_WIDTH or distance_bound(moving, a, a + width, early, late) >= -CLEARANCE:
            continue
        middle = a + 0.5 * width
        there = hull_distance(moving, middle, q)
        if there[0] < 0.0:
            return float(middle)
        push(stack, top + 1, middle, 0.5 * width, there, late)
        push(stack, top + 2, a, 0.5 * width, early, there)
        top += 2
    return -1.0


@kernel
def hull_first_below(moving: MovingHull, stack: Array, q: Array, least: float) -> float:
    """The first x, up to `least`, at which the origin enters the rounded hull, -1 if never by more than CLEARANCE."""
    stack[0, 0], stack[0, 1], top = 0.0, 1.0, 0
    while top >= 0:
        a, width = stack[top, 0], stack[top, 1]
        top -= 1
        early, late = hull_distance(moving, a, q), hull_distance(moving, a + width, q)
        if distance_bound(moving, a, a + width, early, late) >= -CLEARANCE:
            continue
        if early[0] < 0.0 or (width < least and late[0] < 0.0):
            return float(a)
        if width < LEAST_WIDTH:
            continue
        stack[top + 1, 0], stack[top + 1, 1] = a + 0.5 * width, 0.5 * width
        stack[top + 2, 0], stack[top + 2, 1] = a, 0.5 * width
        top += 2
    return -1.0


@kernel
def hull_least(
    moving: MovingHull,
    stack: Array,
    q: Array,
    ceiling: float,
    accuracy: float,
) -> float:
    """Least signed distance to the rounded hull where below `ceiling`, else `ceiling`; too large by at most
    `accuracy`.
    """
    early, late = hull_distance(moving, 0.0, q), hull_distance(moving, 1.0, q)
    best = min(ceiling, min(early[0], late[0]))
    push(stack, 0, 0.0, 1.0, early, late)
    top = 0
    while top >= 0:
        a, width, early, late = pop(stack, top)
        top -= 1
        if width < LEAST_WIDTH or distance_bound(moving, a, a + width, early, late) >= best - accuracy:
            continue
        there = hull_distance(moving, a + 0.5 * width, q)
        best = min(best, there[0])
        push(stack, top + 1, a + 0.5 * width, 0.5 * width, there, late)
        push(stack, top + 2, a, 0.5 * width, early, there)
        top += 2
    return float(best)


@kernel
def deepest_time(
    moving: MovingHull,
    gain: Array,
    q: Array,
    witness: float,
) -> float:
    """A time of collision at which the control is deep inside the element: from samples, then by golden section.

    Depth counts in units of the control: signed distance over gain.
    """
    best, place, step = np.inf, witness, 1.0 / DEEPEST_SAMPLES
    for k in range(DEEPEST_SAMPLES + 2):
        x = witness if k == DEEPEST_SAMPLES + 1 else step * k
        g = value(gain[0], gain[1], gain[2], gain[3], x)
        gap = hull_distance(moving, x, q)[0]
        if gap < 0.0 and gap < best * g:
            best, place = gap / g, x
    low, high = max(0.0, place - step), min(1.0, place + step)
    share = 0.3819660112501051
    for _ in range(GOLDEN_STEPS):
        left, right = low + share * (high - low), high - share * (high - low)
        a = hull_distance(moving, left, q)[0]
        b = hull_distance(moving, right, q)[0]
        a /= value(gain[0], gain[1], gain[2], gain[3], left)
        b /= value(gain[0], gain[1], gain[2], gain[3], right)
        if a < b:
            high = right
        else:
            low = left
        x, least = (left, a) if a < b else (right, b)
        if least < best:
            best, place = least, x
    return float(place)
