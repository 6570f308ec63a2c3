"""Robots that swap places on a circle, all with the same method: does the method make them oscillate or the selection?

Two ways of being consistent are switched on and off: to keep what was chosen (`patience`), and to agree on a side (the
rings of `sim.guidance`). The velocity or acceleration obstacles are the same in all cases.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from slalom.methods import METHODS
from slalom.sim import Recording, simulate
from slalom.sim.gallery import GALLERY, build
from slalom.sim.measure.metrics import summary
from slalom.sim.measure.oscillation import (
    MOVING,
    PASSING,
    Passing,
    changed_choices,
    flips_between,
    heading_variation,
)

NAMES: Final = ("vo", "rvo", "ao", "nao")
ROBOTS: Final = (2, 4, 8, 20)
MANY: Final = 20
"""[robots] From here on a run takes a minute: a third of the runs, and nobody who keeps without agreeing."""
SELECTIONS: Final[dict[str, dict[str, float]]] = {
    "greedy": {"patience": 0.0, "guided": 0.0},
    "kept": {"guided": 0.0},
    "agreed": {"patience": 0.0},
    "both": {},
}
"""Settings of the scenario. Without patience a robot takes at every decision what costs least, what it is committed to
among the rest; unguided it heads straight for its goal. The library's default is `both`."""
OTHERWISE: Final[dict[str, Passing | float]] = {
    "side flips": PASSING,
    "side flips, nearest within 3 s": PASSING._replace(ahead=3.0),
    "side flips, missing by 0.25 radii": PASSING._replace(band=0.25),
    "side flips, approaching at all": PASSING._replace(towards=0.0),
    "heading variation": MOVING,
    "heading variation, down to 0.01 of top speed": 0.01,
}
"""The measures with one of their constants changed."""
DRAWN: Final = 4
"""[robots] Of which the paths are drawn, of seed 0."""


class Cell(NamedTuple):
    """A row: who swaps places, and how they choose."""

    method: str
    selection: str
    robots: int


def cells(quick: bool = False) -> list[Cell]:
    """The rows of the table; a few of them if `quick`."""
    names, counts, selections = (("vo", "nao"), (2, 4), ("greedy", "both")) if quick else (NAMES, ROBOTS, SELECTIONS)
    return [
        Cell(name, selection, count)
        for name in names
        for count in counts
        for selection in selections
        if count < MANY or selection != "kept"
    ]


def run(cell: Cell, seed: int, duration: float) -> Recording:
    """One run; the seed moves the starts by a millimetre, as the gallery does."""
    settings = {"robots": float(cell.robots), "duration": duration, **SELECTIONS[cell.selection]}
    return simulate(build("circle", settings, seed=seed), METHODS[cell.method], seed=seed)


def one(cell: Cell, seed: int, duration: float) -> dict[str, Any]:
    """The measures of one run; flips and headings are means over the robots."""
    recording = run(cell, seed, duration)
    robots, said = range(cell.robots), summary(recording)
    flips, steps = flips_between(recording)

    def measured(rule: Passing | float) -> float:
        if isinstance(rule, Passing):
            return float(flips_between(recording, rule)[0].sum()) / cell.robots
        return float(np.mean([heading_variation(recording, k, rule) for k in robots]))

    return {
        "side_flips": measured(PASSING),
        "pairs_that_pass": int(np.count_nonzero(steps)) // 2,
        "pairs_that_flip": int(np.count_nonzero(flips)) // 2,
        "heading_variation": measured(MOVING),
        "changed": float(np.mean([changed_choices(recording, k) for k in robots])),
        "collisions": said["collisions"],
        "arrived": said["arrived"],
        "time": said["time"],
        "otherwise": [measured(rule) for rule in OTHERWISE.values()],
    }


def aggregate(cell: Cell, runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means and counts over the runs of one cell; the time is that of the last arrival, where all arrive."""
    times = [run["time"] for run in runs if run["arrived"] == cell.robots]
    means = {
        name: float(np.mean([run[name] for run in runs])) for name in ("side_flips", "heading_variation", "changed")
    }
    counts = ("pairs_that_pass", "pairs_that_flip", "collisions", "arrived")
    return {
        **cell._asdict(),
        "runs": len(runs),
        **means,
        **{name: sum(run[name] for run in runs) for name in counts},
        "time": float(np.mean(times)) if times else None,
    }


def measure(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """All rows, and the measures with other constants; the same for any number of jobs.

    Args:
        seeds: runs of each row with fewer than MANY robots; of the others a third.
    """
    rows, duration = cells(quick), 30.0 if quick else 100.0
    fewer = max(1, seeds // 3)
    work = [(cell, seed) for cell in rows for seed in range(fewer if cell.robots >= MANY else seeds)]
    # The longest first, so that no process is left alone with one of them.
    work.sort(key=lambda case: -case[0].robots)
    found: dict[tuple[Cell, int], dict[str, Any]] = {}
    done = Parallel(n_jobs=jobs, return_as="generator")(delayed(one)(cell, seed, duration) for cell, seed in work)
    total = sum(cell.robots**2 for cell, _ in work)
    for case, result in zip(work, done):
        found[case] = result
        advance(sum(cell.robots**2 for cell, _ in found) / total)
    runs = {cell: [result for (other, _), result in sorted(found.items()) if other == cell] for cell in rows}
    defaults = GALLERY["circle"].parameters
    return {
        "seeds": seeds,
        "seeds_of_many": fewer,
        "many": MANY,
        "duration": duration,
        "patience": build("circle").patience,
        "scenario": {
            name: defaults[name] for name in ("radius", "robot_radius", "noise", "max_speed", "max_acceleration")
        },
        "passing": PASSING._asdict(),
        "moving": MOVING,
        "drawn": DRAWN,
        "rows": [aggregate(cell, runs[cell]) for cell in rows],
        "otherwise": _otherwise(runs),
    }


def _otherwise(runs: Mapping[Cell, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """For each measure with other constants its mean over all runs of each selection with fewer than MANY robots."""
    table = []
    for k, name in enumerate(OTHERWISE):
        means = {}
        for selection in dict.fromkeys(cell.selection for cell in runs):
            few = [
                run for cell, mine in runs.items() if cell.selection == selection and cell.robots < MANY for run in mine
            ]
            means[selection] = float(np.mean([run["otherwise"][k] for run in few]))
        table.append({"measure": name, **means})
    return table
