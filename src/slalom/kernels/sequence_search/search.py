"""A search over sequences of pushes, best first, that keep clear of everything that moves.

From each node of a tree the exact choice is made for several wishes: to coast, to brake, to head for the goal, and to
push fully in all directions; each leads to a new node one step later. Before that it is tried to get from the node to
the goal at once. Work is counted in microseconds of a usual machine, not measured: the same search has the same end
everywhere.
"""

import heapq

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls, Segments
from slalom.kernels.geometry.cubic import new_stack
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.clearance import new_workspace
from slalom.kernels.selection.exchange import SAFE, nearest_free
from slalom.kernels.selection.violation import deepest_violation
from slalom.kernels.sequence_search.goal_steering import (
    PER_CHOICE,
    PER_NODE,
    PER_ROW,
    PER_WISH,
    advance,
    motion_is_clear,
    steer_to_goal,
)
from slalom.kernels.sequence_search.spacetime_index import relative_rows, rows_near
from slalom.kernels.sequence_search.tables import BEST, CLOSED, NODES, OPEN, SearchProblem, SearchTree, SpacetimeIndex
from slalom.kernels.sequence_search.tree import add_node, descends, is_new, time_to_goal
from slalom.tolerances import FEW_CANDIDATES, FEW_ELEMENTS


@kernel
def candidate_acceleration(tree: SearchTree, i: int, k: int, quest: SearchProblem, u: Array) -> bool:
    """The push that is wished for next, number k: coasting, braking, to the goal, in all directions; into u.

    False for one that does not exist.
    """
    d, h = quest.dimension, quest.step
    u[:] = 0.0
    away, fast = 0.0, 0.0
    for axis in range(d):
        away += (quest.goal[axis] - tree.position[i, axis]) ** 2
        fast += tree.velocity[i, axis] ** 2
    away, fast = max(np.sqrt(away), 1e-9), np.sqrt(fast)
    if k == 0:
        return True
    if k == 1:
        scale = -min(quest.max_acceleration, fast / h) / max(fast, 1e-9)
        for axis in range(3):
            u[axis] = tree.velocity[i, axis] * scale
        return bool(fast > 1e-9)
    if k == 2:
        for axis in range(d):
            ahead = (quest.goal[axis] - tree.position[i, axis]) * quest.max_speed / away
            u[axis] = (ahead - tree.velocity[i, axis]) / h
    else:
        x, y = quest.goal[0] - tree.position[i, 0], quest.goal[1] - tree.position[i, 1]
        flat = max(np.sqrt(x * x + y * y), 1e-9)
        x, y = (x / flat, y / flat) if flat > 1e-9 else (1.0, 0.0)
        right, left = quest.directions[k - 3, 0], quest.directions[k - 3, 1]
        u[0], u[1] = quest.max_acceleration * (x * right - y * left), quest.max_acceleration * (y * right + x * left)
        if d == 3:
            u[2] = quest.max_acceleration * quest.directions[k - 3, 2]
    size, then = 0.0, 0.0
    for axis in range(d):
        size += u[axis] ** 2
    scale = min(1.0, quest.max_acceleration / max(np.sqrt(size), 1e-9))
    for axis in range(3):
        u[axis] *= scale
    for axis in range(d):
        then += (tree.velocity[i, axis] + h * u[axis]) ** 2
    if then > quest.max_speed**2:
        # No faster than allowed, in the same direction.
        scale, size = quest.max_speed / np.sqrt(then), 0.0
        for axis in range(3):
            u[axis] = (tree.velocity[i, axis] * (scale - 1.0) + h * u[axis] * scale) / h
        for axis in range(d):
            size += u[axis] ** 2
        return bool(size <= quest.max_acceleration**2)
    return True


@kernel
def node_encounters(
    tree: SearchTree, i: int, schedule: SpacetimeIndex, quest: SearchProblem, found: Indices
) -> tuple[Segments, MaybeHulls, Array]:
    """What a robot at node i may meet within one step, whatever its push, and the limits of that push."""
    d, h, t = quest.dimension, quest.step, tree.time[i]
    drift, gain, middle = np.empty((1, 4, d)), np.zeros((1, 4)), np.empty(3)
    limits = np.zeros((2, 5))
    fast = 0.0
    for axis in range(d):
        p, v = tree.position[i, axis], tree.velocity[i, axis]
        middle[axis] = p + 0.5 * h * v
        fast += v * v
        limits[1, 1 + axis] = -v / h
        for c in range(4):
            drift[0, c, axis] = p + c * h / 3.0 * v
    fast = np.sqrt(fast)
    gain[0, 2], gain[0, 3] = h * h / 6.0, 0.5 * h * h
    limits[:, 0] = -1.0
    limits[0, 4], limits[1, 4] = (
        quest.max_acceleration,
        max(quest.max_speed, fast - 0.5 * quest.max_acceleration * h) / h,
    )
    reach = 0.5 * h * fast + 0.5 * h * h * quest.max_acceleration + quest.margin
    n = rows_near(schedule, t, h, middle, reach, quest.now, found)
    table, hulls = relative_rows(schedule, found[:n], t, h, quest.margin, drift, gain)
    return table, hulls, limits


@kernel
def expand(
    tree: SearchTree,
    i: int,
    schedule: SpacetimeIndex,
    quest: SearchProblem,
    heap: list[tuple[float, int]],
    found: Indices,
    stack: Array,
    work: Array,
) -> None:
    """The nodes that are reached from node i by the exact choice for each wish, into the tree and the heap."""
    h, t, d = quest.step, tree.time[i], quest.dimension
    latest = min(quest.deadline, tree.time[tree.counts[BEST]] if tree.counts[BEST] >= 0 else np.inf)
    if t + h > latest:
        return
    table, hulls, limits = node_encounters(tree, i, schedule, quest, found)
    violation = new_workspace(len(table.radius), hulls)
    u, p, v = np.zeros(3), np.zeros(3), np.zeros(3)
    work[0] += PER_NODE + PER_ROW * len(table.radius)
    for k in range(len(quest.directions) + 3):
        if not candidate_acceleration(tree, i, k, quest, u):
            continue
        work[0] += PER_WISH
        if deepest_violation(table, hulls, u, violation) != -1:
            work[0] += PER_CHOICE
            code, w, _, _ = nearest_free(u, d, limits, table, hulls, FEW_ELEMENTS, FEW_CANDIDATES)
            if code != SAFE:
                continue
            for axis in range(3):
                u[axis] = w[axis]
        advance(tree.position[i], tree.velocity[i], u, h, p, v)
        rest = time_to_goal(quest, p, v)
        if t + h + rest > latest or not is_new(tree, quest, t + h, p, v):
            continue
        cost = t + h + quest.heuristic_weight * rest
        heapq.heappush(heap, (cost, add_node(tree, i, t + h, p, v, u, cost, OPEN)))


@kernel
def grow_tree(
    tree: SearchTree, root: int, schedule: SpacetimeIndex, quest: SearchProblem, budget: float, more: float
) -> tuple[int, bool, float]:
    """Grow the tree from `root`: the node that arrives first, or -1; whether the search was cut; the work done [us].

    It is cut after `budget` [us], and `more` [us] after an arrival was found; else it ends when nothing is left that
    could arrive earlier.
    """
    heap = [(0.0, 0)]
    heap.pop()
    for i in range(tree.counts[NODES]):
        if tree.status[i] == OPEN and descends(tree, i, root):
            heap.append((tree.cost[i], i))
    heapq.heapify(heap)
    found, stack, work = np.empty(len(schedule.times), np.int64), new_stack(), np.zeros(1)
    room = len(tree.time) - len(quest.directions) - 8
    if tree.counts[BEST] >= 0:
        budget = min(budget, more)
    while len(heap) > 0:
        if work[0] > budget or tree.counts[NODES] > room:
            return int(tree.counts[BEST]), True, work[0]
        _, i = heapq.heappop(heap)
        tree.status[i] = CLOSED
        best = tree.counts[BEST]
        if best >= 0 and tree.time[i] + time_to_goal(quest, tree.position[i], tree.velocity[i]) >= tree.time[best]:
            continue
        j = steer_to_goal(tree, i, schedule, quest, found, stack, work)
        if j >= 0:
            tree.counts[BEST] = j
            budget = min(budget, work[0] + more)
        else:
            expand(tree, i, schedule, quest, heap, found, stack, work)
    return int(tree.counts[BEST]), False, work[0]


@kernel
def sequence_is_clear(
    times: Array, places: Array, speeds: Array, pushes: Array, schedule: SpacetimeIndex, quest: SearchProblem
) -> bool:
    """Whether a sequence meets nothing: at times (n + 1,) at places and speeds (n, 3), pushed by pushes (n, 3)."""
    found, stack, work = np.empty(len(schedule.times), np.int64), new_stack(), np.zeros(1)
    for k in range(len(places)):
        length = times[k + 1] - times[k]
        if not motion_is_clear(schedule, quest, times[k], places[k], speeds[k], pushes[k], length, found, stack, work):
            return False
    return True
