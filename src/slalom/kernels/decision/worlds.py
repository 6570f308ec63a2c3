"""Decisions of many robots, each alone in a world with a time and with obstacles of its own, in one call."""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.by_reference import at_times, put_table, size_of, table_at
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.policy import decide_all
from slalom.kernels.decision.tables import CellList, DecisionTables
from slalom.kernels.jit import kernel


@kernel
def keep_tables(address: int, tables: DecisionTables) -> int:
    """The bytes that tables take, which are written to an `address` unless that is 0."""
    if address != 0:
        put_table(address, tables)
    return int(size_of(tables))


@kernel
def decide_worlds(
    some: Indices, places: Indices, now: Array, begin: Array, like: DecisionTables, accelerations: Array
) -> None:
    """Decide for the only robot in each of the worlds `some` (m,), whose tables are at `places` (n,).

    Outcomes go into the tables of the robots, the mean accelerations until the next decision into `accelerations`
    (n, d) [m/s^2].

    Args:
        now: (n,) [s] in each world. begin: (n,) [s] of the window on the clock of the pieces, see `Bodies`.
        like: tables of the same type as all of these.
    """
    robot = np.zeros(1, np.int64)
    none = np.empty(0, np.int64)
    cells = CellList(np.empty(0), np.empty(0), none, none, none)
    d = accelerations.shape[1]
    position = np.empty(d)
    before = np.empty(d)
    after = np.empty(d)
    for w in some:
        tables: DecisionTables = at_times(table_at(places[w], like), now[w], begin[w])
        settings = tables.settings
        decide_all(robot, cells, tables)
        committed = tables.robots.committed
        state_on_path(committed, 0, now[w], position, before)
        state_on_path(committed, 0, now[w] + settings.period, position, after)
        for axis in range(d):
            accelerations[w, axis] = (after[axis] - before[axis]) / settings.period
