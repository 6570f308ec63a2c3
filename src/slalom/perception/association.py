"""Which measurement of one time belongs to which track."""

from collections.abc import Iterable
from typing import Final

import numpy as np

from slalom.base.checks import Array
from slalom.base.extras import Extra

GATE: Final = 6.0
"""[1] Standard deviations up to which a measured position may be from the predicted one of its track.

People that stop or turn are up to 5.9 of those of a filter with 0.2 m/s^2/sqrt(Hz) away. Larger: an exchange of ids
between people close to each other changes their velocities. Smaller: the track of a person that turns begins anew.
"""

OTHER_ID: Final = 3.0
"""[1] Standard deviations for which a wrong id counts.

Larger: exchanged ids are found only farther apart. Smaller: noise exchanges people that touch.
"""


def nearest_first(pairs: Iterable[tuple[float, int, int]]) -> dict[int, int]:
    """The track of each measurement, from pairs (distance, measurement, track) by increasing distance.

    A pair counts if neither its measurement nor its track is in one before.
    """
    found: dict[int, int] = {}
    for _, measurement, track in sorted(pairs):
        if measurement not in found and track not in found.values():
            found[measurement] = track
    return found


def least_sum(distances: Array) -> dict[int, int]:
    """The track of each measurement, of least sum of squared `distances` (measurements, tracks) [1].

    A pair beyond GATE is none, and counts as one at GATE: as many pairs are made as gates admit.

    Raises:
        MissingExtra: no scipy.
    """
    with Extra("tracks", "measurements without ids"):
        from scipy.optimize import linear_sum_assignment
    rows, columns = linear_sum_assignment(np.minimum(distances, GATE) ** 2)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return {row: column for row, column in pairs if distances[row, column] <= GATE}
