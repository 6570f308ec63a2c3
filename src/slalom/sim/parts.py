"""Work on many robots in threads: kernels hold no lock."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from slalom.kernels.tables import Indices

T = TypeVar("T")


def parts_of(rows: Indices, threads: int, fewest: int) -> list[Indices]:
    """Equal parts, one for each thread, of at least `fewest` rows."""
    return np.array_split(rows, max(1, min(threads, len(rows) // fewest)))


def in_parts(work: Callable[[Indices], T], rows: Indices, threads: int, fewest: int) -> list[T]:
    """What `work` returns for equal parts of `rows`, in their order: a thread each, of at least `fewest` rows."""
    parts = parts_of(rows, threads, fewest)
    if len(parts) == 1:
        return [work(rows)]
    with ThreadPoolExecutor(len(parts)) as pool:
        return list(pool.map(work, parts))
