"""Tables for many choices in one call."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, BodyTable, Indices, Snapshot


class States(NamedTuple):
    """Robots in n states, all with the same gain of the response."""

    limits: Array  # (n, l, 5) admissible sets, see `geometry.boundaries`
    counts: Indices  # (n,) how many rows of the limits are those of each state
    position: Array  # (n, d) [m]
    knots: Array  # (m + 1,) [s], as in `PositionMap`
    drift: Array  # (n, m, 4, d) [m]
    gain: Array  # (m, 4)


class Scene(NamedTuple):
    """Obstacles, the same for all states."""

    bodies: Snapshot
    table: BodyTable  # with the margin
    error: float  # [m] of the response's cubic pieces
    horizon: float  # [s]
