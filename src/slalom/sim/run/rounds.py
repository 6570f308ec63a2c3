"""In which order the robots of a crew decide: all at once where all see the same, in rounds where they see each other
decide. In threads, with the same bits in any number of them."""

from collections.abc import Callable, Iterator
from itertools import chain

import numpy as np

from slalom import kernels
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import CellList, DecisionTables
from slalom.sim.run.threads import map_in_threads

FEWEST = 20
"""Robots that are worth a thread."""


def at_once(some: Indices, tables: DecisionTables, ask: Callable[[int], str], threads: int) -> dict[int, str]:
    """All see the same, whoever decides first. The outcomes of robots that the kernel has no answer for: they `ask`."""
    seen = kernels.build_cell_list(some, tables.robots, tables.responses, tables.settings)
    return {k: ask(k) for k in _asking(some, seen, tables, threads)}


def one_by_one(some: Indices, tables: DecisionTables, ask: Callable[[int], str], threads: int) -> dict[int, str]:
    """Each sees what those before it have decided.

    Of many robots those decide at once that cannot meet, each after all before it that it could meet: nobody sees
    anything else than one after the other. Whoever has to ask is waited for, and what it decides is seen by the rest.
    """
    outcomes: dict[int, str] = {}
    while len(some):
        seen = kernels.build_cell_list(some, tables.robots, tables.responses, tables.settings)
        turn = kernels.independent_rounds(some, seen, tables.robots)
        if len(some) < 2 * FEWEST * (turn.max() + 1):
            done = kernels.decide_all(some, seen, tables)
            asking, some = some[done : done + 1].tolist(), some[done + 1 :]
        else:
            asking, last = _in_rounds(some, turn, seen, tables, threads)
            some = some[turn > last]
        outcomes.update({k: ask(k) for k in asking})
    return outcomes


def _in_rounds(
    some: Indices, turn: Indices, seen: CellList, tables: DecisionTables, threads: int
) -> tuple[list[int], int]:
    """Those of the first round in which any has to ask, and its number; or nobody and the last."""
    rounds = int(turn.max()) + 1
    ends = np.cumsum(np.bincount(turn, minlength=rounds))
    for k, together in enumerate(np.split(some[np.argsort(turn, kind="stable")], ends[:-1])):
        asking = list(_asking(together, seen, tables, threads))
        if asking:
            return asking, k
    return [], rounds - 1


def _asking(some: Indices, seen: CellList, tables: DecisionTables, threads: int) -> Iterator[int]:
    """Robots that decide without waiting for each other, in threads; those that have to ask."""
    return chain.from_iterable(map_in_threads(lambda part: _those_that_ask(part, seen, tables), some, threads, FEWEST))


def _those_that_ask(part: Indices, seen: CellList, tables: DecisionTables) -> list[int]:
    """The decisions of robots one after the other, but of those that the kernel has no answer for."""
    found, done = [], 0
    while done < len(part):
        done += kernels.decide_all(part[done:], seen, tables)
        found += part[done : done + 1].tolist()
        done += 1
    return found
