"""The ways that robots claim which are held up, and those that a robot alone presumes to be claimed."""

from typing import Any, Final

import numpy as np

from slalom.base.checks import Array
from slalom.kernels.decision.tables import NO_CLAIMS, Claims, RobotTable

CLAIM_AFTER: Final = 1.5
"""[1] A robot that is held up for this many times of those in which it reaches its largest speed claims its way. One
alone takes detours then. Larger: robots that block each other lose time. Smaller: robots leave ways that would soon be
free, and decide among more choices."""

CLAIM_LENGTH: Final = 3.0
"""[1] Length of a claimed way in distances that the robot drives at its largest speed in the time to reach it.

Larger: robots move aside that leave by themselves. Smaller: they move aside late.
"""

CLAIM_GROWTH: Final = 0.03
"""[1] Rate at which the claimed way gets wider on either side, as a share of the largest speed.

With 0, robots enclose each other: 1 of 60 passed a doorway. With 0.07, robots in a room were pushed into its corners.
Larger: more robots move aside. Smaller: outer robots make place later.
"""


def claimed(each: Any, way: Array, held_up: Array) -> tuple[Array, Array]:
    """The ways (m, 3) [m] that robots claim, of those to their targets, and half their widths (m,) [m]; 0: none.

    each: rows (m,) of a table of robots. held_up: (m,) [s] for which they have been.
    """
    fast = each["max_speed"] / each["max_acceleration"]
    longer = held_up - CLAIM_AFTER * fast
    most = CLAIM_LENGTH * fast * each["max_speed"]
    way = way * np.minimum(most / np.maximum(np.linalg.norm(way, axis=1), 1e-12), 1.0)[:, None]
    width = each["radius"] + each["margin_among"] + CLAIM_GROWTH * each["max_speed"] * longer
    return way, np.where(each["present"] & (longer >= 0.0), width, 0.0)


def presumed_claims(table: RobotTable, way: Array, held_up: float) -> Claims:
    """The claims that the robot in row 0, with a `way` (d,) [m] to its target, presumes of the others that it observes.

    One that is held up presumes that the others head the opposite way, and have been held up as long. Of two opposite
    ways the one has the right of way whose coordinates have the larger sum; then the one with the larger first one. So
    two robots that meet presume alike which one of them goes first.
    """
    each, own = table.each[1:].copy(), table.each[:1]
    if not len(each) or (way.sum(), *way) > (0.0,) * (1 + len(way)):
        return NO_CLAIMS
    for name in ("max_speed", "max_acceleration", "margin_among"):
        each[name] = own[name]
    opposite = np.zeros((len(each), 3))
    opposite[:, : len(way)] = -way
    ways, widths = claimed(each, opposite, np.full(len(each), held_up))
    some = np.flatnonzero(widths > 0.0)
    own["rank"] = 1
    ranks, first = np.zeros(len(some), np.int64), np.array([0, len(some)])
    return Claims(first, each["position"][some], ways[some], widths[some], ranks)
