"""Work on many robots in threads: kernels hold no lock."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import lru_cache
from typing import TypeVar

import numpy as np

from slalom.kernels.arrays import Indices

T = TypeVar("T")


def map_in_threads(work: Callable[[Indices], T], rows: Indices, threads: int, fewest: int) -> list[T]:
    """What `work` returns for equal parts of `rows` of at least `fewest`, in their order.

    The first here, a thread for each of the others.
    """
    count = max(1, min(threads, len(rows) // fewest))
    first, *others = np.array_split(rows, count) if count > 1 else [rows]
    if not others:
        return [work(first)]
    # Threads take longer to begin than many decisions do; a process that was forked off has none of them.
    waiting = [_pool(len(others), os.getpid()).submit(work, part) for part in others]
    try:
        mine = work(first)
    finally:
        wait(waiting)
    return [mine, *(one.result() for one in waiting)]


@lru_cache(maxsize=8)
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads)
