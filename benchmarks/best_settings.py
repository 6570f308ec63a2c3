"""Best settings of each baseline in a scenario: one published grid, seeds that no table uses, and one rule.

usage: python benchmarks/best_settings.py [--scenario NAME] [--set NAME=VALUE ...] [--methods NAME ...] [--all]
       [--resume] [--jobs N] [--out FILE] [--quick]

Every try has the seeds 2000 to 2019. No table has them, and nothing was tuned on them. The rule is the same for all
methods: of all tries the best has the fewest collisions, then the most arrivals of robots, then the least mean time of
a run. The time is that of the last arrival, or the duration if a robot did not arrive. Of equal tries the first is
taken; the present settings come first. A try that cannot run in a scenario is refused, and has no result.

With --all every combination of the grid is tried, 27 for a method of slalom, then further values of each setting at
the best of them: vo and nlvo in README are found so. A grid of a peer has up to 48 combinations, which would take a day
in all scenarios. Without --all the settings are therefore searched one after another, in the order of the grid: each
takes the best of its values and of the further ones, while all others stay. With --resume no try of the file is made
again.

Without a scenario the scenarios of benchmarks/planners.yaml are taken, with its baselines; those whose robots are
guided also without guidance. The file has every try, one a line. Lines of other scenarios and methods stay. The program
prints the best try of each method as a row for study files; `tests/docs/test_benchmarks.py` compares the rows of the
study with them.
"""

import argparse
import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from io import StringIO
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from joblib import Parallel, delayed
from machine import replace_text

from slalom.base.errors import InvalidInput
from slalom.sim.sweep.case import run_one

SEEDS = range(2000, 2020)
FOLDER = Path(__file__).parent
FIELDS = ("scenario", "method", "settings", "runs", "collisions", "robots", "arrived", "time", "refused")
"""Columns of the file: sums over the runs, the mean time [s], and the reason of a try that cannot run."""

Values = Mapping[str, Sequence[float]]

OF_METHOD: Mapping[str, Values] = {
    "orca": {"horizon": (10.0, 5.0, 2.0), "wall_horizon": (10.0, 2.0)},
    "navground_orca": {"time_horizon": (10.0, 5.0, 2.0), "static_time_horizon": (10.0, 2.0)},
    "hrvo": {"time_horizon": (10.0, 5.0, 2.0)},
    "hl": {"time_horizon": (10.0, 5.0, 2.0), "tau": (0.125, 0.5), "eta": (0.5, 1.0)},
    "social_force": {"tau": (0.5, 1.0), "v_a": (2.1, 4.2, 8.4), "v_r": (0.3, 0.6)},
    "dwa": {"heading": (2.0, 1.0), "distance": (0.2, 1.0), "speed": (0.2, 0.5), "horizon": (4.0, 2.0)},
    "mppi": {"horizon": (4.0, 2.0), "temperature": (0.5, 0.1), "deviation": (0.7, 0.35)},
    "cbf": {"gain": (1.0, 0.3, 3.0), "horizon": (10.0, 4.0)},
}
"""Parameters of peers, see `Peer.parameters`."""
OWN, OTHERS = ("vo", "rvo", "nlvo", "avo", "ao"), tuple(OF_METHOD)
OF_SCENARIO: Mapping[str, Values] = {
    **{name: {"horizon": (6.0, 3.0, 10.0), "patience": (0.01, 0.0, 0.05), "margin": (0.05, 0.1, 0.2)} for name in OWN},
    **{name: {"margin": (0.05, 0.1, 0.2)} for name in OTHERS},
}
"""Settings of a scenario, by method. The horizon and patience of a scenario have no effect on peers."""
BEYOND: Values = {"horizon": (2.0, 1.0), "patience": (0.2,), "margin": (0.4, 0.8)}
"""Values beyond the grid of settings of a scenario: tried one after another."""
QUICK = 2
"""Values of each setting, and seeds, in a quick run."""

SLOW = ("dwa", "mppi", "cbf", "social_force_limited")
FAST = ("orca_limited", "hrvo_limited", "hl_limited")
PLANNERS = (*SLOW, *FAST)
PAIR, RING, STREAMS = {"robots": 2, "radius": 8, "robot_radius": 0.5}, {"robots": 10, "radius": 10}, {"robots": 10}
ALONE = {"guided": 0}
SCENARIOS: Sequence[tuple[str, Mapping[str, float], Sequence[str]]] = (
    ("crowdnav", {"people": 5}, ("vo", *PLANNERS)),
    ("head_on", {"offset": 0.2}, ("vo", *PLANNERS)),
    ("roundabout_crossing", {}, PLANNERS),
    ("circle", PAIR, ("rvo", *PLANNERS)),
    ("circle", {**PAIR, **ALONE}, ("rvo",)),
    ("ring", RING, ("rvo", *FAST)),
    ("ring", {**RING, **ALONE}, ("rvo",)),
    ("random_goals", {}, ("rvo", *FAST)),
    ("random_goals", ALONE, ("rvo",)),
    ("crossing_streams", STREAMS, ("rvo", *FAST)),
    ("crossing_streams", {**STREAMS, **ALONE}, ("rvo",)),
)
"""Scenarios, settings and baselines of benchmarks/planners.yaml. Peers are never guided.

The settings of vo in roundabout_crossing are those of README, see --all. Among eight or more robots a run of a SLOW
peer takes up to 13 s, and a search 20 minutes. Rows there have the present settings, and those found for two robots on
a circle.
"""


class Try(NamedTuple):
    """A method with settings: the settings of the scenario, and the name of the method with its parameters."""

    settings: Mapping[str, float]
    method: str

    @property
    def text(self) -> str:
        """Settings and parameters, as on the command line."""
        own = " ".join(f"{name}={value:g}" for name, value in self.settings.items())
        return f"{own} {self.method}".strip()


class Result(NamedTuple):
    """The result of a try over all seeds, or the reason why it was refused."""

    runs: int = 0
    collisions: int = 0
    robots: int = 0
    arrived: int = 0
    time: float = 0.0
    refused: str = ""

    @property
    def rank(self) -> tuple[bool, int, int, float]:
        """The rule: the least is the best."""
        return bool(self.refused), self.collisions, -self.arrived, self.time


def plain(method: str) -> str:
    """The name of a method in the grids: variants of a peer have that of their row."""
    return method.removesuffix("_limited").removesuffix("_inflated")


def grids(method: str, count: int | None = None) -> tuple[Values, Values]:
    """The first `count` values of each setting of the scenario, and of each parameter of the method."""
    of_scenario, of_method = (
        {name: values[:count] for name, values in grid.get(plain(method), {}).items()}
        for grid in (OF_SCENARIO, OF_METHOD)
    )
    return of_scenario, of_method


def tried(method: str, values: Mapping[str, float]) -> Try:
    """The method with the chosen values of its settings and parameters."""
    of_scenario, of_method = grids(method)
    parameters = [f"{name}={values[name]:g}" for name in of_method]
    return Try({name: values[name] for name in of_scenario}, ":".join([method, *parameters]))


def chosen(one: Try) -> dict[str, float]:
    """The values of a try by name."""
    parameters = (item.partition("=") for item in one.method.split(":")[1:])
    return {**one.settings, **{name: float(value) for name, _, value in parameters}}


def tries(method: str, count: int | None = None) -> list[Try]:
    """All tries of a method: every combination of the first `count` values of its settings, the present ones first."""
    of_scenario, of_method = grids(method, count)
    values = {**of_scenario, **of_method}
    return [tried(method, dict(zip(values, each))) for each in product(*values.values())]


Results = Callable[[Sequence[Try]], Sequence["Result"]]


def one_after_another(
    method: str, results_of: Results, count: int | None = None, begun: Sequence[Try] = (), of: Sequence["Result"] = ()
) -> tuple[list[Try], list["Result"]]:
    """The tries of a search of one setting after another, each with its result; the present settings first.

    With tries that were made, the search begins at the best of these, and has the values beyond the grid alone.
    """
    values = {name: each for grid in grids(method, count) for name, each in grid.items()}
    every, found = list(begun), list(of)
    if not every:
        every = [tried(method, {name: each[0] for name, each in values.items()})]
        found = list(results_of(every))
    for name, each in values.items():
        start, _ = best(every, found)
        further = () if count or name in OF_METHOD.get(plain(method), {}) else BEYOND[name]
        candidates = (*(() if begun else each[1:]), *further)
        new = [tried(method, chosen(start) | {name: value}) for value in candidates]
        every += new
        found += results_of(new)
    return every, found


def made(scenario: str, settings: Mapping[str, float], one: Try, seed: int) -> dict[str, Any] | str:
    """The result of one run, or the reason why it was refused."""
    try:
        return run_one(scenario, {**settings, **one.settings}, one.method, seed)
    except InvalidInput as error:
        return str(error)


def results(
    scenario: str,
    settings: Mapping[str, float],
    every: Sequence[Try],
    seeds: Sequence[int],
    jobs: int,
    known: Mapping[str, Result] = {},
) -> list[Result]:
    """The result of each try, from runs in parallel processes; of tries in `known` by their text the known result."""
    work = [(one, seed) for one in every if one.text not in known for seed in seeds]
    runs = Parallel(n_jobs=jobs)(delayed(made)(scenario, settings, one, seed) for one, seed in work)
    parts = (runs[first : first + len(seeds)] for first in range(0, len(runs), len(seeds)))
    return [known[one.text] if one.text in known else summed(next(parts)) for one in every]


def summed(runs: Sequence[dict[str, Any] | str]) -> Result:
    """The result of the runs of a try."""
    refused = next((run for run in runs if isinstance(run, str)), "")
    if refused:
        return Result(refused=refused)
    collisions, robots, arrived = (sum(run[name] for run in runs) for name in ("collisions", "robots", "arrived"))
    return Result(len(runs), collisions, robots, arrived, sum(run["time"] for run in runs) / len(runs))


def best(every: Sequence[Try], found: Sequence[Result]) -> tuple[Try, Result]:
    """The best try by the rule, the first of equal ones."""
    k = min(range(len(every)), key=lambda k: found[k].rank)
    return every[k], found[k]


def lines(scenario: str, method: str, every: Iterable[Try], found: Iterable[Result]) -> Iterator[dict[str, str]]:
    """The lines of the file for a scenario and a method."""
    for one, result in zip(every, found, strict=True):
        cells = {"scenario": scenario, "method": method, "settings": one.text, "refused": result.refused}
        if not result.refused:
            cells |= {name: str(getattr(result, name)) for name in ("runs", "collisions", "robots", "arrived")}
            cells["time"] = f"{result.time:.6f}"
        yield cells


def read(file: Path, scenario: str, method: str) -> dict[str, Result]:
    """The results that the file has for a scenario and a method, by the text of the try."""
    if not file.exists():
        return {}
    with file.open(newline="") as text:
        found = [line for line in csv.DictReader(text) if (line["scenario"], line["method"]) == (scenario, method)]
    return {line["settings"]: result_of(line) for line in found}


def result_of(line: Mapping[str, str]) -> Result:
    """The result in a line of the file."""
    if line["refused"]:
        return Result(refused=line["refused"])
    counts = (int(line[name]) for name in ("runs", "collisions", "robots", "arrived"))
    return Result(*counts, float(line["time"]))


def write(file: Path, new: Sequence[Mapping[str, str]]) -> None:
    """Write the lines in place of those of the same scenario and method; all others stay."""
    replaced = {(line["scenario"], line["method"]) for line in new}
    kept: list[Mapping[str, str]] = []
    if file.exists():
        with file.open(newline="") as text:
            kept = [line for line in csv.DictReader(text) if (line["scenario"], line["method"]) not in replaced]
    stream = StringIO()
    writer = csv.DictWriter(stream, FIELDS, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows([*kept, *new])
    file.parent.mkdir(parents=True, exist_ok=True)
    replace_text(file, stream.getvalue())


def scenario_text(scenario: str, settings: Mapping[str, float]) -> str:
    """A scenario with its settings, as on the command line."""
    return " ".join([scenario, *(f"{name}={value:g}" for name, value in settings.items())])


def row_text(scenario: str, settings: Mapping[str, float], one: Try) -> str:
    """A row of a study file."""
    text = ", ".join(f"{name}: {value:g}" for name, value in {**settings, **one.settings}.items())
    return f'- {{scenario: {scenario}, settings: {{{text}}}, methods: ["{one.method}"]}}'


def asked(given: argparse.Namespace) -> list[tuple[str, Mapping[str, float], list[str]]]:
    """Scenarios with settings, and the methods with a grid."""
    if given.scenario is None:
        return [
            (name, settings, [m for m in methods if m in (given.methods or methods)])
            for name, settings, methods in SCENARIOS
        ]
    settings = {name: float(value) for name, _, value in (item.partition("=") for item in given.set)}
    return [(given.scenario, settings, [m for m in given.methods or OF_SCENARIO if plain(m) in OF_SCENARIO])]


def main() -> None:
    """Make all tries, write them, and print the best of each method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", help="a name of the gallery or a .yaml file")
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE")
    parser.add_argument("--methods", nargs="+", default=[])
    parser.add_argument("--all", action="store_true", help="every combination of the grid")
    parser.add_argument("--resume", action="store_true", help="make no try again whose result is in the file")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=FOLDER / "results" / "best_settings.csv")
    parser.add_argument("--quick", action="store_true", help="two values of each setting, two seeds: for tests")
    given = parser.parse_args()
    count = QUICK if given.quick else None
    for scenario, settings, methods in asked(given):
        text = scenario_text(scenario, settings)
        for method in methods:
            known = read(given.out, text, method) if given.resume else {}
            results_of = partial(results, scenario, settings, seeds=SEEDS[:count], jobs=given.jobs, known=known)
            every = tries(method, count) if given.all else []
            every, found = one_after_another(method, results_of, count, every, results_of(every))
            write(given.out, list(lines(text, method, every, found)))
            one, result = best(every, found)
            print(f"# {text}, {method}: {result.refused or about(result)} ({len(every)} tries)")
            print(row_text(scenario, settings, one), flush=True)


def about(result: Result) -> str:
    """The result in words."""
    arrived = f"{result.arrived} of {result.robots} robots arrived"
    return f"{result.collisions} collisions, {arrived}, {result.time:.2f} s"


if __name__ == "__main__":
    main()
