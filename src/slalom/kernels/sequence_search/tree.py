"""Nodes of a search over sequences of pushes: how far it is to go, and which are new."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.time_to_go import earliest_arrival, stopping_velocity, time_to_stop
from slalom.kernels.jit import kernel
from slalom.kernels.sequence_search.tables import CELLS_PER_SPEED, CELLS_PER_STEP, NODES, SearchProblem, SearchTree


@kernel
def time_to_goal(quest: SearchProblem, place: Array, speed: Array) -> float:
    """How long [s] a robot alone in the world needs to the goal: to pass it exact, to stop there an estimate."""
    d = quest.dimension
    away = np.empty(d)
    for axis in range(d):
        away[axis] = quest.goal[axis] - place[axis]
    if not quest.stop:
        return float(earliest_arrival(away, speed[:d], quest.max_acceleration, quest.max_speed, quest.tolerance))
    wanted = np.empty(d)
    stopping_velocity(away, quest.max_acceleration, quest.max_speed, wanted)
    square, change = 0.0, 0.0
    for axis in range(d):
        square += away[axis] * away[axis]
        change += (wanted[axis] - speed[axis]) ** 2
    return float(
        time_to_stop(
            max(0.0, np.sqrt(square) - quest.tolerance), np.sqrt(change), quest.max_acceleration, quest.max_speed
        )
    )


@kernel
def add_node(
    tree: SearchTree, parent: int, time: float, place: Array, speed: Array, push: Array, cost: float, mark: int
) -> int:
    """A node after `parent`; its number."""
    i = tree.counts[NODES]
    tree.time[i], tree.parent[i], tree.cost[i], tree.status[i] = time, parent, cost, mark
    for axis in range(3):
        tree.position[i, axis], tree.velocity[i, axis], tree.acceleration[i, axis] = (
            place[axis],
            speed[axis],
            push[axis],
        )
    tree.counts[NODES] = i + 1
    return int(i)


@kernel
def is_new(tree: SearchTree, quest: SearchProblem, time: float, place: Array, speed: Array) -> bool:
    """Whether no other node has been in this cell of time, place and velocity; from now on one has.

    Keys of 64 bits stand for cells: two of a million cells are taken for one with a chance of 3e-8, and then a node is
    missing from the tree.
    """
    key = np.int64(np.round(2.0 * (time - tree.time[0]) / quest.step))
    wide, fast = quest.max_speed * quest.step / CELLS_PER_STEP, quest.max_speed / CELLS_PER_SPEED
    for axis in range(quest.dimension):
        key = key * np.int64(1000003) + np.int64(np.round((place[axis] - quest.goal[axis]) / wide))
        key = key * np.int64(1000003) + np.int64(np.round(speed[axis] / fast))
    key ^= key >> np.int64(29)
    key *= np.int64(0x5851F42D4C957F2D)
    key ^= key >> np.int64(32)
    key = np.int64(1) if key == 0 else key
    room = len(tree.cells)
    at = key & np.int64(room - 1)
    while tree.cells[at] != 0:
        if tree.cells[at] == key:
            return False
        at = (at + 1) & np.int64(room - 1)
    tree.cells[at] = key
    return True


@kernel
def descends(tree: SearchTree, i: int, root: int) -> bool:
    """Whether the way to node i leads over `root`; parents are older than their nodes."""
    while i > root:
        i = tree.parent[i]
    return bool(i == root)
