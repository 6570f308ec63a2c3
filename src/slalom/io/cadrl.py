"""Reader of CADRL test cases (mit-acl/gym-collision-avoidance): CSV, one row per robot of a case.

Header `case,agent,x,y,goal_x,goal_y,pref_speed,radius`; metres and m/s. Robots are discs that start at rest.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.io.recorded import refuse
from slalom.io.table import comma_table

COLUMNS = ("case", "agent", "x", "y", "goal_x", "goal_y", "pref_speed", "radius")


class Case(NamedTuple):
    """A test case: its number, `starts` and `goals` (n, 2) [m], preferred `speeds` (n,) [m/s] and `radii` (n,) [m]."""

    number: int
    starts: Array
    goals: Array
    speeds: Array
    radii: Array


def read_cases(path: Path | str) -> list[Case]:
    """Read the cases of a file, by increasing number; the robots of a case are ordered by `agent`.

    Rows may be in any order.

    Raises:
        InvalidFile: no such file, an invalid header or cell, the same robot twice in a case.
    """
    table = comma_table(Path(path), COLUMNS)
    case, agent = (table.numbers(name, whole=True) for name in COLUMNS[:2])
    starts, goals = table.positions("x", "y"), table.positions("goal_x", "goal_y")
    speeds, radii = table.numbers("pref_speed"), table.numbers("radius")
    for name, values in (("pref_speed", speeds), ("radius", radii)):
        for k in np.flatnonzero(values <= 0.0):
            table.wrong(k, name, f"expected a number above 0, found {values[k]:g}")
    order = np.lexsort((agent, case))
    for k in order[1:][(np.diff(case[order]) == 0.0) & (np.diff(agent[order]) == 0.0)]:
        table.wrong(k, "agent", f"expected each agent once in a case, found {agent[k]:g} again in case {case[k]:g}")
    refuse(table.path, table.mistakes, table.location)
    groups = (order[case[order] == number] for number in np.unique(case))
    return [Case(int(case[rows[0]]), starts[rows], goals[rows], speeds[rows], radii[rows]) for rows in groups]
