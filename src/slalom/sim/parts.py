"""Work on many robots in threads: kernels hold no lock."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
import numpy.typing as npt

T = TypeVar("T")
Indices = npt.NDArray[np.int64]


def in_parts(work: Callable[[Indices], T], rows: Indices, threads: int, fewest: int) -> list[T]:
    """What `work` returns for equal parts of `rows`, in their order: a thread each, of at least `fewest` rows."""
    parts = np.array_split(rows, max(1, min(threads, len(rows) // fewest)))
    if len(parts) == 1:
        return [work(rows)]
    with ThreadPoolExecutor(len(parts)) as pool:
        return list(pool.map(work, parts))
