"""Bounds on velocity and acceleration along a motion with a constant acceleration."""

from typing import Final

import numpy as np

from slalom.base.tolerances import ADMISSIBLE, REST, WHOLE_COUNT
from slalom.kernels.arrays import Array
from slalom.kernels.geometry.frames import axes_along
from slalom.kernels.jit import kernel, squared
from slalom.kernels.sequence_search.tables import AT_REST, FIXED, MEASURED, MOVING, BoundTable

CUT_RESERVE: Final = 0.02
"""[1] Share of the excess over a bound by which a cut is tighter than the bound.

The bound turns with the velocity, so the cut is not exact. Larger: candidates use less of a bound. Smaller: they need
more cuts.
"""

WORK_PERIOD: Final = 0.1
"""[us] Counted for the test of the bounds at the start of one period, see `search.WORK_NODE`."""

WORK_BOUND: Final = 0.004
"""[us] Counted for the test of one half-space there: its share of the time of such a test."""


@kernel
def breach(
    bounds: BoundTable,
    velocity: Array,
    acceleration: Array,
    duration: float,
    measured: bool,
    cut: Array,
    work: Array,
) -> bool:
    """Whether a constant acceleration over `duration` [s] from a velocity breaks a bound at the start of some period.

    velocity (3,) [m/s], acceleration (3,) [m/s^2]. The rule is that of `limits.Limits.allows`; fixed half-spaces hold
    at all times. measured: whether the motion begins in the state of the decision. cut (5,): the half-space of
    accelerations that is broken most, see `kernels/geometry/boundaries.py`, goes there; (0,): it is not sought, in less
    time. work: (1,) [us] is increased.
    """
    if len(bounds.rows) == 0:
        return False
    v = velocity.copy()
    start = np.sqrt(squared(v[0]) + squared(v[1]) + squared(v[2]))
    world = np.eye(3)
    most = most_broken(bounds, FIXED, world, v, acceleration, duration, duration, 0.0, 0.0, cut)
    turning = bounds.first[MOVING + 1] - bounds.first[MOVING]
    still = acceleration[0] == 0.0 and acceleration[1] == 0.0 and acceleration[2] == 0.0
    periods = 0 if still or turning == 0 else max(1, int(np.ceil(duration / bounds.period - WHOLE_COUNT)))
    for k in range(periods):
        if most > 0.0 and len(cut) == 0:
            break
        square = 0.0
        for axis in range(3):
            v[axis] = velocity[axis] + k * bounds.period * acceleration[axis]
            square += squared(v[axis])
        speed = np.sqrt(square)
        elapsed = (k + 1) * bounds.period
        state = MEASURED if measured and k == 0 else AT_REST if speed < REST else MOVING
        frame = axes_along(v[: bounds.dimension] / speed) if state == MOVING else world
        most = most_broken(bounds, state, frame, v, acceleration, bounds.period, elapsed, start, most, cut)
        work[0] += WORK_PERIOD + WORK_BOUND * turning
    return bool(most > 0.0)


@kernel
def most_broken(
    bounds: BoundTable,
    state: int,
    frame: Array,
    velocity: Array,
    acceleration: Array,
    time: float,
    elapsed: float,
    speed: float,
    most: float,
    cut: Array,
) -> float:
    """The larger of `most` [m/s^2] and the largest excess over the rows of a state, whose half-space goes into cut.

    frame (d, d): axes of the rows. Velocities count after `time` [s], when the acceleration has lasted for `elapsed`.
    """
    d = len(frame)
    rows = bounds.rows
    now = np.zeros(3)
    change = np.zeros(3)
    square = 0.0
    for k in range(d):
        for axis in range(d):
            now[k] += frame[k, axis] * velocity[axis]
            change[k] += frame[k, axis] * acceleration[axis]
        square += squared(now[k])
    worst = -1
    offset_of_worst = 0.0
    deficit = 0.0
    for b in range(bounds.first[state], bounds.first[state + 1]):
        before = rows[b, 1] * now[0] + rows[b, 2] * now[1] + rows[b, 3] * now[2]
        along = rows[b, 1] * change[0] + rows[b, 2] * change[1] + rows[b, 3] * change[2]
        offset = rows[b, 4] + rows[b, 5] * square
        excess = along - offset
        if rows[b, 0] == 0.0:
            # No bound that turns excludes the present velocity; nor need the robot be faster than at the start.
            least = max(offset, -speed) if state == MOVING else offset
            offset = max(offset, before) if state == MOVING else offset
            excess = before + time * along - offset
            deficit = (before + time * along - min(offset, least)) / elapsed
        if excess <= ADMISSIBLE * (1.0 + abs(offset)):
            continue
        excess = deficit if rows[b, 0] == 0.0 else excess
        if excess > most:
            most = excess
            worst = b
            # At the start the heading does not depend on the acceleration: the cut is exact.
            offset_of_worst = along - (1.0 + CUT_RESERVE if elapsed > time else 1.0) * excess
    if worst >= 0 and len(cut) > 0:
        cut[0] = 0.0
        cut[4] = offset_of_worst
        for axis in range(3):
            cut[1 + axis] = 0.0
            for k in range(d if axis < d else 0):
                cut[1 + axis] += rows[worst, 1 + k] * frame[k, axis]
    return most
