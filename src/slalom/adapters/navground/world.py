"""A world that repeats."""

import numpy as np

from slalom.checks import Array


def periods(offsets: Array, period: Array) -> Array:
    """Multiples of the period nearest to offsets (n, 2) [m]; 0 along axes without a period."""
    repeats = period > 0.0
    return np.where(repeats, period * np.round(offsets / np.where(repeats, period, 1.0)), 0.0)
