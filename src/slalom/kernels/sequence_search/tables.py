"""Tables of the search over sequences of accelerations."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, Indices, MaybeHulls

OPEN = 0
CLOSED = 1
ARRIVED = 2
"""Status of a node: not expanded, expanded, at the goal."""
NODES = 0
BEST = 1
"""Positions in `SearchTree.counts`: the number of nodes, and the node that arrives first (-1: none)."""
COAST = 0
BRAKE = 1
TO_GOAL = 2
FIRST_DIRECTION = 3
"""Numbers of the candidate accelerations of a node; those from FIRST_DIRECTION on are `SearchProblem.directions`."""

MEASURED = 0
AT_REST = 1
MOVING = 2
FIXED = 3
"""States in which rows of `BoundTable` hold: that of the decision, at rest, in motion, all."""


class SpacetimeIndex(NamedTuple):
    """Pieces of bodies grown by a robot (see `kernels.arrays.Bodies`), at absolute times, listed by intervals."""

    times: Array  # (n, 2) [s] begin and end of each piece
    points: Array  # (n, 4, d) [m] control points
    radius: Array  # (n,) [m] at the begin, without the margin
    growth: Array  # (n,) [m] of the radius, from begin to end
    turns: Array  # (n, 4, 2) control points of the direction, or (0, 4, 2) if no body turns
    centers: Array  # (n, d) [m] of the bounding balls
    bounding_radius: Array  # (n,) [m] of the bounding balls: body and motion during the piece
    hull_radius: Array  # (n,) [m] of the hull of the body; 0: a disc or ball
    appears: Array  # (n,) [s] time at which the body appears
    hulls: MaybeHulls  # the first (n,), the second empty: see `kernels.arrays.MaybeHulls`
    start: float  # [s] of the first interval
    width: float  # [s] of each interval
    first: Indices  # (m + 1,) interval k overlaps the pieces row[first[k]:first[k + 1]]
    row: Indices  # numbers of pieces


class BoundTable(NamedTuple):
    """Half-spaces in which velocity or acceleration stay at the start of every period, by the state at that time.

    A row is (1 for an acceleration or 0 for the velocity after the period, unit normal (3,), offset, its factor of the
    squared speed). Normals are in the frame of the body for MOVING, else in that of the world.
    """

    rows: Array  # (n, 6)
    first: Indices  # (5,) rows first[s] to first[s + 1] are of state s
    period: float  # [s]
    dimension: int


class SearchProblem(NamedTuple):
    """Goal and limits of a robot, and the settings of the search."""

    dimension: int
    goal: Array  # (3,) [m]
    tolerance: float  # [m] distance from the goal that counts as reached
    stop: bool  # whether the robot stops at the goal
    max_acceleration: float  # [m/s^2]
    braking: float  # [m/s^2] largest deceleration by all bounds
    bounds: BoundTable
    never_stops: bool  # whether a sequence that does not arrive keeps its last velocity, and otherwise ends at rest
    max_speed: float  # [m/s]
    step: float  # [s] between the nodes of a sequence, a multiple of `period`
    period: float  # [s] accelerations change at multiples of it only
    deadline: float  # [s] later arrivals do not count
    margin: float  # [m] kept between bodies
    now: float  # [s] bodies that appear later are not known
    directions: Array  # (k, 3) unit vectors of candidate accelerations, the first axis towards the goal
    heuristic_weight: float  # [1] weight of the time to go relative to the elapsed time


class SearchTree(NamedTuple):
    """Collision-free sequences: each node is reached from its parent under one constant acceleration."""

    time: Array  # (c,) [s]
    position: Array  # (c, 3) [m]
    velocity: Array  # (c, 3) [m/s]
    acceleration: Array  # (c, 3) [m/s^2] from the parent to the node
    parent: Indices  # (c,) the root is its own parent
    cost: Array  # (c,) [s]
    status: Indices  # (c,) OPEN, CLOSED or ARRIVED
    cells: Indices  # (2^k,) hash table of the keys of occupied cells; 0: free
    counts: Indices  # (2,) see NODES and BEST


class SearchScratch(NamedTuple):
    """Workspace of a search, and its account of work."""

    rows: Indices  # (n,) numbers of pieces near a motion, n as in `SpacetimeIndex`
    work: Array  # (1,) [us] done so far, as counted by WORK_NODE etc.
