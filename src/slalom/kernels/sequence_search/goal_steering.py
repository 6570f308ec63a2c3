"""Whether a motion is free, and the ways to a goal at once that end a search."""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.clearance import new_workspace
from slalom.kernels.selection.violation import deepest_violation
from slalom.kernels.sequence_search.spacetime_index import relative_rows, rows_near
from slalom.kernels.sequence_search.tables import ARRIVED, BEST, CLOSED, SearchProblem, SearchTree, SpacetimeIndex
from slalom.kernels.sequence_search.tree import add_node, time_to_goal

PER_NODE, PER_ROW, PER_WISH, PER_CHOICE, PER_STRETCH = 8.0, 0.3, 0.6, 8.0, 3.0
"""[us] What the parts of the work take on a usual machine (benchmarks/crossings.py tells how well that holds)."""


@kernel
def advance(place: Array, speed: Array, push: Array, t: float, then: Array, fast: Array) -> None:
    """Where a robot is after t under a constant push, and how fast, into then and fast."""
    for axis in range(3):
        then[axis] = place[axis] + t * (speed[axis] + 0.5 * t * push[axis])
        fast[axis] = speed[axis] + t * push[axis]


@kernel
def motion_is_clear(
    schedule: SpacetimeIndex,
    quest: SearchProblem,
    t: float,
    place: Array,
    speed: Array,
    push: Array,
    length: float,
    found: Indices,
    stack: Array,
    work: Array,
) -> bool:
    """Whether a robot that is so at time t and is pushed so for `length` seconds meets nothing."""
    if length <= 0.0:
        return True
    d = quest.dimension
    drift, gain, u = np.empty((1, 4, d)), np.zeros((1, 4)), np.zeros(3)
    p, v, middle = np.empty(3), np.empty(3), np.empty(3)
    stretches = max(1, int(np.ceil(length / quest.step - 1e-9)))
    h = length / stretches
    for k in range(stretches):
        work[0] += PER_STRETCH
        advance(place, speed, push, h * k, p, v)
        fast, pushed = 0.0, 0.0
        for axis in range(d):
            middle[axis] = p[axis] + 0.5 * h * (v[axis] + 0.25 * h * push[axis])
            fast += (v[axis] + 0.5 * h * push[axis]) ** 2
            pushed += push[axis] ** 2
            drift[0, 0, axis] = p[axis]
            drift[0, 1, axis] = p[axis] + h / 3.0 * v[axis]
            drift[0, 2, axis] = p[axis] + 2.0 * h / 3.0 * v[axis] + h * h / 6.0 * push[axis]
            drift[0, 3, axis] = p[axis] + h * v[axis] + 0.5 * h * h * push[axis]
        reach = 0.5 * h * np.sqrt(fast) + 0.125 * h * h * np.sqrt(pushed) + quest.margin
        n = rows_near(schedule, t + h * k, h, middle, reach, quest.now, found)
        if n == 0:
            continue
        work[0] += PER_ROW * n
        table, hulls = relative_rows(schedule, found[:n], t + h * k, h, quest.margin, drift, gain)
        if deepest_violation(table, hulls, u, new_workspace(len(table.radius), hulls)) != -1:
            return False
    return True


@kernel
def through(quest: SearchProblem, place: Array, speed: Array, push: Array) -> tuple[float, float]:
    """How long to push (into `push`), and when the robot is then near the goal, which it passes; -1: never.

    The earliest arrival of one push and coasting, with a push of whole periods.
    """
    d, time = quest.dimension, time_to_goal(quest, place, speed)
    push[:] = 0.0
    for _ in range(100):
        square = 0.0
        for axis in range(d):
            push[axis] = quest.goal[axis] - place[axis] - speed[axis] * time
            square += push[axis] ** 2
        length = np.sqrt(square)
        if length <= quest.tolerance:
            push[:] = 0.0
            return 0.0, time
        need = length - quest.tolerance
        hold = time - np.sqrt(max(time * time - 2.0 * need / quest.max_acceleration, 0.0))
        hold = np.ceil(hold / quest.period - 1e-9) * quest.period
        if hold > time:
            # The way to go is another one at a later time.
            time = hold
            continue
        size = need / (hold * (time - 0.5 * hold))
        fast, now = 0.0, 0.0
        for axis in range(d):
            push[axis] *= size / length
            fast += (speed[axis] + hold * push[axis]) ** 2
            now += speed[axis] ** 2
        if size <= quest.max_acceleration * (1.0 + 1e-9) and fast <= max(quest.max_speed**2, now) * (1.0 + 1e-9):
            return hold, time
        time += 0.25 * quest.period
    return -1.0, -1.0


@kernel
def to_rest(quest: SearchProblem, place: Array, speed: Array, push: Array) -> tuple[float, float]:
    """How long to push (into `push`), and how long to brake evenly then, to come to rest at the goal; -1: not so.

    Whole periods both; of all pairs within twice the step for each, one that ends first.
    """
    d, most = quest.dimension, int(np.round(2.0 * quest.step / quest.period))
    for total in range(2, 2 * most + 1):
        for k in range(max(1, total - most), min(most, total - 1) + 1):
            hold, brake = k * quest.period, (total - k) * quest.period
            square, fast = 0.0, 0.0
            for axis in range(d):
                away = quest.goal[axis] - place[axis] - (hold + 0.5 * brake) * speed[axis]
                push[axis] = away / (0.5 * hold * (hold + brake))
                square += push[axis] ** 2
                fast += (speed[axis] + hold * push[axis]) ** 2
            if (
                square <= quest.max_acceleration**2
                and fast <= min(quest.max_speed, quest.max_acceleration * brake) ** 2
            ):
                return hold, brake
    return -1.0, -1.0


@kernel
def steer_to_goal(
    tree: SearchTree, i: int, schedule: SpacetimeIndex, quest: SearchProblem, found: Indices, stack: Array, work: Array
) -> int:
    """To the goal at once by a push and a second part, coasting or braking: the node there, or -1 if it is not free.

    Nor is it looked at if it does not arrive before the best node so far.
    """
    latest = quest.deadline
    if tree.counts[BEST] >= 0:
        latest = min(latest, tree.time[tree.counts[BEST]] - 0.5 * quest.period)
    push, then = np.zeros(3), np.zeros(3)
    p, v = np.empty(3), np.empty(3)
    if quest.stop:
        hold, rest = to_rest(quest, tree.position[i], tree.velocity[i], push)
    else:
        hold, time = through(quest, tree.position[i], tree.velocity[i], push)
        rest = time - hold
    work[0] += PER_CHOICE
    if hold < 0.0 or tree.time[i] + hold + rest > latest:
        return -1
    free = hold == 0.0 or motion_is_clear(
        schedule, quest, tree.time[i], tree.position[i], tree.velocity[i], push, hold, found, stack, work
    )
    if not free:
        return -1
    advance(tree.position[i], tree.velocity[i], push, hold, p, v)
    if quest.stop:
        for axis in range(3):
            then[axis] = -v[axis] / rest
    # A robot that passes the goal is seen there at the end of a period.
    later = rest if quest.stop else np.ceil(rest / quest.period) * quest.period
    if not motion_is_clear(schedule, quest, tree.time[i] + hold, p, v, then, later, found, stack, work):
        return -1
    j, end, fast = i, np.empty(3), np.empty(3)
    if hold > 0.0:
        j = add_node(tree, i, tree.time[i] + hold, p, v, push, 0.0, CLOSED)
    advance(p, v, then, rest, end, fast)
    return add_node(tree, j, tree.time[i] + hold + rest, end, fast, then, 0.0, ARRIVED)
