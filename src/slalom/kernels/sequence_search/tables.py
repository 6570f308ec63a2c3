"""What a search over sequences of accelerations is made from, as arrays."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, Indices, MaybeHulls

OPEN, CLOSED, ARRIVED = 0, 1, 2
"""Marks of nodes: yet to be looked at, looked at, at the goal."""
NODES, BEST = 0, 1
"""Counts of a tree: how many nodes it has, and which of them arrives first, or -1."""
CELLS_PER_STEP, CELLS_PER_SPEED = 4.0, 5.0
"""[1] Cells are top speed times step over PLACES wide, and top speed over SPEEDS fast; one node for each is enough."""


class SpacetimeIndex(NamedTuple):
    """Bodies grown by a robot, see `traffic.Bodies`, with times that are absolute, and what finds them."""

    times: Array  # (n, 2) [s]
    points: Array  # (n, 4, d)
    radius: Array  # (n,) [m] all of it, but the margin
    growth: Array  # (n,)
    turns: Array  # (n, 4, 2), or (0, 4, 2) if nothing turns
    centers: Array  # (n, d) middle of each piece
    bounding_radius: Array  # (n,) [m] how far any point of the body is from there at most, within the piece
    hull_radius: Array  # (n,)
    appears: Array  # (n,) [s] when the body appears
    hulls: MaybeHulls  # the first (n,), the second empty: see `compiled.MaybeHulls`
    start: float  # [s] of the first interval
    width: float  # [s] of all intervals
    first: Indices  # (m + 1,) interval k has the rows row[begin[k]] to row[begin[k + 1]]
    row: Indices


class SearchProblem(NamedTuple):
    """Who wants where, and how it is sought."""

    dimension: int
    goal: Array  # (3,)
    tolerance: float  # [m] how near is enough
    stop: bool  # whether to be at rest there
    max_acceleration: float  # [m/s^2] the largest
    max_speed: float  # [m/s]
    step: float  # [s] between the nodes of a sequence, a multiple of `period`
    period: float  # [s] pushes change at multiples of it only
    deadline: float  # [s] nothing later counts
    margin: float  # [m]
    now: float  # [s] bodies that appear later are not known
    directions: Array  # (k, 3) unit vectors: directions of pushes, the first axis to the goal
    heuristic_weight: float  # [1] how much more the time to go counts than the time gone


class SearchTree(NamedTuple):
    """Sequences of pushes that keep clear: nodes, each after its parent, from which it is reached by one push."""

    time: Array  # (c,) [s]
    position: Array  # (c, 3)
    velocity: Array  # (c, 3)
    acceleration: Array  # (c, 3) that led there
    parent: Indices  # (c,) the root has itself
    cost: Array  # (c,)
    status: Indices  # (c,)
    cells: Indices  # (2^k,) keys of the cells that are taken; 0: free
    counts: Indices  # (2,)
