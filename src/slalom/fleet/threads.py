"""Work on many robots in threads: kernels release Python's lock."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import lru_cache
from typing import TypeVar

import numpy as np

from slalom.kernels.arrays import Indices

T = TypeVar("T")


def map_in_threads(work: Callable[[Indices], T], rows: Indices, threads: int, fewest: int) -> list[T]:
    """The results of `work` for equal parts of `rows` (n,) of at least `fewest` rows, in their order.

    The first part runs in the calling thread, each other part in a thread of its own.
    """
    count = max(1, min(threads, len(rows) // fewest))
    first, *others = np.array_split(rows, count) if count > 1 else [rows]
    if not others:
        return [work(first)]
    # A thread takes longer to start than many decisions take, so threads are kept. A forked process has none of them.
    waiting = [_pool(len(others), os.getpid()).submit(work, part) for part in others]
    try:
        result = work(first)
    finally:
        wait(waiting)
    return [result, *(future.result() for future in waiting)]


@lru_cache(maxsize=8)
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads)
