"""Test of a motion against the space-time index, and sequences of two accelerations that end at the goal."""

from typing import Final

import numpy as np

from slalom.base.tolerances import ADMISSIBLE, WHOLE_COUNT
from slalom.kernels.arrays import Array, PositionMap
from slalom.kernels.decision.policy import WORK_ROW
from slalom.kernels.decision.response_motion import WORK_CHOICE
from slalom.kernels.jit import kernel, squared
from slalom.kernels.relative_motion.clearance import new_workspace
from slalom.kernels.selection.exchange import deepest_violation
from slalom.kernels.sequence_search.tables import (
    ARRIVED,
    BEST,
    CLOSED,
    SearchProblem,
    SearchScratch,
    SearchTree,
    SpacetimeIndex,
)
from slalom.kernels.sequence_search.tree import add_node, advance, relative_rows, rows_near, time_to_goal

WORK_STRETCH: Final = 3.0
"""[us] Counted for each stretch of a motion that is tested: see WORK_NODE."""

COAST_ATTEMPTS: Final = 100
"""[1] Arrival times that are tried for passing the goal after one acceleration and coasting.

More: slower where the goal is beside the course of a fast robot. Fewer: arrivals that need a later time are missed.
"""

COAST_STEP: Final = 0.25
"""[1] Share of a period between these arrival times.

Larger: later arrivals. Smaller: COAST_ATTEMPTS cover less time.
"""

BRAKE_STEPS: Final = 2.0
"""[1] Steps that accelerating, and then braking to a stop at the goal, may each take at most.

Larger: stops at distant goals are found at once, in more tests. Smaller: only from nodes near the goal.
"""

EARLIER_ARRIVAL: Final = 0.5
"""[1] Share of a period by which a new arrival must precede the best one.

Arrivals are whole periods apart, but for rounding. Larger than 1: arrivals one period earlier are missed.
"""


@kernel
def new_scratch(index: SpacetimeIndex) -> SearchScratch:
    """Workspace of a search among the bodies of an index, without any work done."""
    return SearchScratch(np.empty(len(index.times), np.int64), np.zeros(1))


@kernel
def motion_is_clear(
    index: SpacetimeIndex,
    problem: SearchProblem,
    t: float,
    position: Array,
    velocity: Array,
    acceleration: Array,
    duration: float,
    scratch: SearchScratch,
) -> bool:
    """Whether the motion from time t for `duration` [s] under a constant acceleration is collision-free.

    position (3,) [m], velocity (3,) [m/s], acceleration (3,) [m/s^2]. The motion is cut into stretches of at most one
    step, so that few bodies are near each.
    """
    if duration <= 0.0:
        return True
    d = problem.dimension
    drift = np.empty((1, 4, d))
    gain = np.zeros((1, 4))
    u = np.zeros(3)
    p = np.empty(3)
    v = np.empty(3)
    middle = np.empty(3)
    middle_velocity = np.empty(3)
    stretches = max(1, int(np.ceil(duration / problem.step - WHOLE_COUNT)))
    h = duration / stretches
    for k in range(stretches):
        scratch.work[0] += WORK_STRETCH
        advance(position, velocity, acceleration, h * k, p, v)
        advance(p, v, acceleration, 0.5 * h, middle, middle_velocity)
        square_speed = 0.0
        square_acceleration = 0.0
        for axis in range(d):
            square_speed += squared(middle_velocity[axis])
            square_acceleration += squared(acceleration[axis])
            drift[0, 0, axis] = p[axis]
            drift[0, 1, axis] = p[axis] + h / 3.0 * v[axis]
            drift[0, 2, axis] = p[axis] + 2.0 * h / 3.0 * v[axis] + h * h / 6.0 * acceleration[axis]
            drift[0, 3, axis] = p[axis] + h * v[axis] + 0.5 * h * h * acceleration[axis]
        radius = 0.5 * h * np.sqrt(square_speed) + 0.125 * h * h * np.sqrt(square_acceleration) + problem.margin
        n = rows_near(index, t + h * k, h, middle, radius, problem.now, scratch.rows)
        if n == 0:
            continue
        scratch.work[0] += WORK_ROW * n
        motion = PositionMap(np.array([0.0, h]), drift, gain, 1)
        table, hulls = relative_rows(index, scratch.rows[:n], t + h * k, motion, problem.margin)
        if deepest_violation(table, hulls, u, new_workspace(len(table.radius), hulls)) != -1:
            return False
    return True


@kernel
def accelerate_and_coast(
    problem: SearchProblem, position: Array, velocity: Array, acceleration: Array
) -> tuple[float, float]:
    """Time [s] of acceleration, in whole periods, and of the pass of the goal after coasting [s]; -1: never.

    The earliest such arrival from position (3,) [m] with velocity (3,) [m/s]. The acceleration goes into
    acceleration (3,) [m/s^2].
    """
    d = problem.dimension
    time = time_to_goal(problem, position, velocity)
    acceleration[:] = 0.0
    for _ in range(COAST_ATTEMPTS):
        square = 0.0
        for axis in range(d):
            acceleration[axis] = problem.goal[axis] - position[axis] - velocity[axis] * time
            square += squared(acceleration[axis])
        length = np.sqrt(square)
        if length <= problem.tolerance:
            acceleration[:] = 0.0
            return 0.0, time
        need = length - problem.tolerance
        hold = time - np.sqrt(max(time * time - 2.0 * need / problem.max_acceleration, 0.0))
        hold = np.ceil(hold / problem.period - WHOLE_COUNT) * problem.period
        if hold > time:
            # A later arrival has another displacement.
            time = hold
            continue
        size = need / (hold * (time - 0.5 * hold))
        square_speed = 0.0
        square_now = 0.0
        for axis in range(d):
            acceleration[axis] *= size / length
            square_speed += squared(velocity[axis] + hold * acceleration[axis])
            square_now += squared(velocity[axis])
        allowed = max(squared(problem.max_speed), square_now) * (1.0 + ADMISSIBLE)
        if size <= problem.max_acceleration * (1.0 + ADMISSIBLE) and square_speed <= allowed:
            return hold, time
        time += COAST_STEP * problem.period
    return -1.0, -1.0


@kernel
def accelerate_and_brake(
    problem: SearchProblem, position: Array, velocity: Array, acceleration: Array
) -> tuple[float, float]:
    """Times [s] to accelerate and then to brake evenly, in whole periods, to stop at the goal; -1: not possible.

    Of all pairs with at most BRAKE_STEPS steps for each, one that ends first. position (3,) [m], velocity (3,) [m/s].
    The first acceleration goes into acceleration (3,) [m/s^2].
    """
    d = problem.dimension
    most = int(np.round(BRAKE_STEPS * problem.step / problem.period))
    for total in range(2, 2 * most + 1):
        for k in range(max(1, total - most), min(most, total - 1) + 1):
            hold = k * problem.period
            brake = (total - k) * problem.period
            square = 0.0
            square_speed = 0.0
            for axis in range(d):
                away = problem.goal[axis] - position[axis] - (hold + 0.5 * brake) * velocity[axis]
                acceleration[axis] = away / (0.5 * hold * (hold + brake))
                square += squared(acceleration[axis])
                square_speed += squared(velocity[axis] + hold * acceleration[axis])
            allowed = squared(min(problem.max_speed, problem.max_acceleration * brake))
            if square <= squared(problem.max_acceleration) and square_speed <= allowed:
                return hold, brake
    return -1.0, -1.0


@kernel
def steer_to_goal(
    tree: SearchTree, i: int, index: SpacetimeIndex, problem: SearchProblem, scratch: SearchScratch
) -> int:
    """Node at the goal, reached from node i by one acceleration and then coasting or braking; -1: none is clear.

    Also -1 if it does not arrive before the best node so far.
    """
    latest = problem.deadline
    if tree.counts[BEST] >= 0:
        latest = min(latest, tree.time[tree.counts[BEST]] - EARLIER_ARRIVAL * problem.period)
    first = np.zeros(3)
    second = np.zeros(3)
    p = np.empty(3)
    v = np.empty(3)
    start = tree.time[i]
    position = tree.position[i]
    velocity = tree.velocity[i]
    if problem.stop:
        hold, rest = accelerate_and_brake(problem, position, velocity, first)
    else:
        hold, time = accelerate_and_coast(problem, position, velocity, first)
        rest = time - hold
    scratch.work[0] += WORK_CHOICE
    if hold < 0.0 or start + hold + rest > latest:
        return -1
    if not motion_is_clear(index, problem, start, position, velocity, first, hold, scratch):
        return -1
    advance(position, velocity, first, hold, p, v)
    if problem.stop:
        for axis in range(3):
            second[axis] = -v[axis] / rest
    # A robot that passes the goal is observed there at the end of a period.
    duration = rest if problem.stop else np.ceil(rest / problem.period) * problem.period
    if not motion_is_clear(index, problem, start + hold, p, v, second, duration, scratch):
        return -1
    j = i
    end = np.empty(3)
    end_velocity = np.empty(3)
    if hold > 0.0:
        j = add_node(tree, i, start + hold, p, v, first, 0.0, CLOSED)
    advance(p, v, second, rest, end, end_velocity)
    return add_node(tree, j, start + hold + rest, end, end_velocity, second, 0.0, ARRIVED)
