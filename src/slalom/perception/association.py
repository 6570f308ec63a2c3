"""Which measurement of one time belongs to which track."""

from collections.abc import Iterable
from functools import cache
from typing import Any, Final

import numpy as np

from slalom.base.errors import Extra

GATE: Final = 6.0
"""[1] Standard deviations up to which a measured position may be from the predicted one of its track.

People that stop or turn are up to 5.9 of those of a filter with 0.2 m/s^2/sqrt(Hz) away. Larger: an exchange of ids
between people close to each other changes their velocities. Smaller: the track of a person that turns begins anew.
"""

OTHER_ID: Final = 3.0
"""[1] Standard deviations for which a wrong id counts.

Larger: exchanged ids are found only farther apart. Smaller: noise exchanges people that touch.
"""


CANDIDATES: Final = {2: 7, 3: 13}
"""[1] Tracks with which a measurement is compared, by the dimension: one, and the equal balls that can touch it."""


def nearest_first(pairs: Iterable[tuple[float, int, int]]) -> dict[int, int]:
    """The track of each measurement, from pairs (distance, measurement, track) by increasing distance.

    A pair counts if neither its measurement nor its track is in one before.
    """
    found: dict[int, int] = {}
    taken = set[int]()
    for _, measurement, track in sorted(pairs):
        if measurement not in found and track not in taken:
            found[measurement] = track
            taken.add(track)
    return found


def least_sum(pairs: list[tuple[float, int, int]]) -> dict[int, int]:
    """The track of each measurement, of least sum of squared distances, from pairs (distance, measurement, track).

    A measurement without a track counts as one at GATE: as many pairs are made as gates admit.

    Raises:
        MissingExtra: no scipy.
    """
    if not pairs:
        return {}
    csr_array, assigned = assignment()
    apart, rows, tracks = (np.array(each) for each in zip(*pairs))
    measured, row = np.unique(rows, return_inverse=True)
    free = np.arange(len(measured))
    # Beyond the tracks, each measurement has a column of its own, at GATE. A sum of 1 more for each changes nothing,
    # but a cost of 0 would be no pair.
    costs = 1.0 + np.concatenate([apart**2, np.full(len(free), GATE**2)])
    columns = np.concatenate([tracks, tracks.max() + 1 + free])
    found = assigned(csr_array((costs, (np.concatenate([row, free]), columns))))[1].tolist()
    return {i: k for i, k in zip(measured.tolist(), found) if k <= tracks.max()}


@cache
def assignment() -> tuple[Any, Any]:
    """The sparse matrix and the assignment of scipy. Raises MissingExtra."""
    with Extra("tracks", "measurements without ids"):
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import min_weight_full_bipartite_matching
    return csr_array, min_weight_full_bipartite_matching
