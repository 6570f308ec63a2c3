"""The order in which the robots of a fleet decide.

Robots that only observe each other decide at once. Robots that share manoeuvres decide one after the other, in rounds
of robots that cannot meet. The number of threads changes no bit.
"""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from functools import lru_cache
from itertools import chain
from typing import Final, TypeVar

import numpy as np

from slalom import kernels
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import CellList, DecisionTables

# Work on many robots in threads: kernels release Python's lock.


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


ROBOTS_PER_THREAD: Final = 20
"""[1] Fewest robots whose decisions are worth a thread, and half the fewest per round that are worth rounds. Smaller:
threads take longer to start than their robots to decide. Larger: fewer cores are used. It changes no decision."""


FallBack = Callable[[int], None]
"""Decides for a robot (its row) for which the kernel found no decision."""


def of_one_kind(some: Indices, kinds: Indices, in_order: bool) -> list[Indices]:
    """The robots `some` (m,) in parts of one kind each; in their order where each avoids the decisions before its own.

    kinds: (n,) the kind of each robot.
    """
    own = kinds[some]
    if (own == own[:1]).all():
        # Most fleets: sorting would take as long as some decisions.
        return [some] if len(some) else []
    order = np.arange(len(some)) if in_order else np.argsort(own, kind="stable")
    return np.split(some[order], np.flatnonzero(np.diff(own[order])) + 1)


def at_once(some: Indices, tables: DecisionTables, fall_back: FallBack, threads: int) -> None:
    """Decide for the robots `some` (m,), independently of each other."""
    cells = kernels.build_cell_list(some, tables.robots, tables.responses, tables.settings)
    for k in _undecided(some, cells, tables, threads):
        fall_back(k)


def one_by_one(some: Indices, tables: DecisionTables, fall_back: FallBack, threads: int) -> None:
    """Decide for the robots `some` (m,) in their order, each after those before it that it can meet.

    A round holds robots that cannot meet, so the decisions are those of one robot after the other. Robots after a robot
    with a fallback decide after it.
    """
    while len(some):
        cells = kernels.build_cell_list(some, tables.robots, tables.responses, tables.settings)
        rounds = kernels.independent_rounds(some, cells, tables.robots)
        if len(some) < 2 * ROBOTS_PER_THREAD * (rounds.max() + 1):
            done = kernels.decide_all(some, cells, tables)
            undecided, some = some[done : done + 1].tolist(), some[done + 1 :]
        else:
            undecided, last = _in_rounds(some, rounds, cells, tables, threads)
            some = some[rounds > last]
        for k in undecided:
            fall_back(k)


def _in_rounds(
    some: Indices, rounds: Indices, cells: CellList, tables: DecisionTables, threads: int
) -> tuple[list[int], int]:
    """The undecided robots of the first round that has any, and its number; or no robot and the last number."""
    count = int(rounds.max()) + 1
    ends = np.cumsum(np.bincount(rounds, minlength=count))
    for k, together in enumerate(np.split(some[np.argsort(rounds, kind="stable")], ends[:-1])):
        undecided = list(_undecided(together, cells, tables, threads))
        if undecided:
            return undecided, k
    return [], count - 1


def _undecided(some: Indices, cells: CellList, tables: DecisionTables, threads: int) -> Iterator[int]:
    """Decide for independent robots in threads; the robots for which the kernel found no decision."""
    return chain.from_iterable(
        map_in_threads(lambda part: _undecided_of(part, cells, tables), some, threads, ROBOTS_PER_THREAD)
    )


def _undecided_of(part: Indices, cells: CellList, tables: DecisionTables) -> list[int]:
    """Decide for robots in their order; those for which the kernel found no decision."""
    found, done = [], 0
    while done < len(part):
        done += kernels.decide_all(part[done:], cells, tables)
        found += part[done : done + 1].tolist()
        done += 1
    return found
