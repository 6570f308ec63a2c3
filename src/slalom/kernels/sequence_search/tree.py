"""The tree of a search over sequences: states under constant accelerations, times to go, new nodes."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.time_to_go import earliest_arrival, time_to_rest
from slalom.kernels.jit import kernel
from slalom.kernels.sequence_search.tables import NODES, SearchProblem, SearchTree
from slalom.tolerances import BRAKING_SHARE, CELLS_PER_MAX_SPEED, CELLS_PER_STEP, TIME_CELLS_PER_STEP


@kernel
def advance(
    position: Array, velocity: Array, acceleration: Array, t: float, next_position: Array, next_velocity: Array
) -> None:
    """Write the state after t [s] under a constant acceleration into next_position and next_velocity.

    All arrays are (3,) [m], [m/s] or [m/s^2].
    """
    for axis in range(3):
        next_position[axis] = position[axis] + t * (velocity[axis] + 0.5 * t * acceleration[axis])
        next_velocity[axis] = velocity[axis] + t * acceleration[axis]


@kernel
def time_to_goal(problem: SearchProblem, position: Array, velocity: Array) -> float:
    """Time [s] to the goal without obstacles from position (3,) [m] with velocity (3,) [m/s].

    Exact for passing the goal, an estimate for stopping there.
    """
    d = problem.dimension
    away = np.empty(d)
    for axis in range(d):
        away[axis] = problem.goal[axis] - position[axis]
    if not problem.stop:
        return float(
            earliest_arrival(away, velocity[:d], problem.max_acceleration, problem.max_speed, problem.tolerance)
        )
    most = problem.max_acceleration
    return float(time_to_rest(away, velocity[:d], most, BRAKING_SHARE * most, problem.max_speed))


@kernel
def add_node(
    tree: SearchTree,
    parent: int,
    time: float,
    position: Array,
    velocity: Array,
    acceleration: Array,
    cost: float,
    status: int,
) -> int:
    """Number of a new node after `parent`, at `time` [s] with `cost` [s]; see `SearchTree` for the arrays (3,)."""
    i = tree.counts[NODES]
    tree.time[i], tree.parent[i], tree.cost[i], tree.status[i] = time, parent, cost, status
    for axis in range(3):
        tree.position[i, axis] = position[axis]
        tree.velocity[i, axis] = velocity[axis]
        tree.acceleration[i, axis] = acceleration[axis]
    tree.counts[NODES] = i + 1
    return int(i)


@kernel
def is_new(tree: SearchTree, problem: SearchProblem, time: float, position: Array, velocity: Array) -> bool:
    """Whether the cell of time [s], position (3,) [m] and velocity (3,) [m/s] has been free; it is occupied afterwards.

    Cells are identified by hash keys of 64 bits. Among a million cells two keys agree with a probability of 3e-8, and
    then the tree lacks a node.
    """
    key = np.int64(np.round(TIME_CELLS_PER_STEP * (time - tree.time[0]) / problem.step))
    length, speed = problem.max_speed * problem.step / CELLS_PER_STEP, problem.max_speed / CELLS_PER_MAX_SPEED
    for axis in range(problem.dimension):
        key = key * np.int64(1000003) + np.int64(np.round((position[axis] - problem.goal[axis]) / length))
        key = key * np.int64(1000003) + np.int64(np.round(velocity[axis] / speed))
    # The low bits of the key, which place it in the table, are to depend on all bits.
    key ^= key >> np.int64(29)
    key *= np.int64(0x5851F42D4C957F2D)
    key ^= key >> np.int64(32)
    key = np.int64(1) if key == 0 else key
    size = len(tree.cells)
    at = key & np.int64(size - 1)
    while tree.cells[at] != 0:
        if tree.cells[at] == key:
            return False
        at = (at + 1) & np.int64(size - 1)
    tree.cells[at] = key
    return True


@kernel
def descends(tree: SearchTree, i: int, root: int) -> bool:
    """Whether node i is `root` or a descendant of it; the number of a parent is below those of its children."""
    while i > root:
        i = tree.parent[i]
    return bool(i == root)
