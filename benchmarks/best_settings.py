"""Best settings of each baseline in a scenario: one published grid, seeds that no table uses, and one rule.

usage: python benchmarks/best_settings.py [--scenario NAME] [--set NAME=VALUE ...] [--methods NAME ...] [--jobs N]
       [--out FILE] [--quick]

Without a scenario the rows of benchmarks/planners.yaml are taken, with their methods that have a grid. Every try has
the seeds 2000 to 2019. No table has them, and nothing was tuned on them. The rule is the same for all methods: of all
tries the best has the fewest collisions, then the most arrivals of robots, then the least mean time of a run. The time
is that of the last arrival, or the duration if a robot did not arrive. Of equal tries the first of the grid is taken;
the present settings come first. A try that cannot run in a scenario is refused, and has no result.

The file has every try, one a line. Lines of other scenarios and methods stay. The program prints the best try of each
method as a row for study files.
"""

import argparse
import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import StringIO
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from joblib import Parallel, delayed
from machine import replace_text

from slalom.errors import InvalidInput
from slalom.sim import read_study
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
QUICK = 2
"""Values of each setting, and seeds, in a quick run."""


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


def tries(method: str, count: int | None = None) -> list[Try]:
    """All tries of a method: every combination of the first `count` values of its settings, the present ones first."""
    of_scenario, of_method = (
        {name: values[:count] for name, values in grid.get(plain(method), {}).items()}
        for grid in (OF_SCENARIO, OF_METHOD)
    )
    found = []
    for chosen in product(*of_scenario.values(), *of_method.values()):
        settings = dict(zip(of_scenario, chosen))
        parameters = [f"{name}={value:g}" for name, value in zip(of_method, chosen[len(of_scenario) :])]
        found.append(Try(settings, ":".join([method, *parameters])))
    return found


def made(scenario: str, settings: Mapping[str, float], one: Try, seed: int) -> dict[str, Any] | str:
    """The result of one run, or the reason why it was refused."""
    try:
        return run_one(scenario, {**settings, **one.settings}, one.method, seed)
    except InvalidInput as error:
        return str(error)


def results(
    scenario: str, settings: Mapping[str, float], every: Sequence[Try], seeds: Sequence[int], jobs: int
) -> list[Result]:
    """The result of each try, from runs in parallel processes."""
    work = [(one, seed) for one in every for seed in seeds]
    runs = Parallel(n_jobs=jobs)(delayed(made)(scenario, settings, one, seed) for one, seed in work)
    return [summed(runs[k * len(seeds) : (k + 1) * len(seeds)]) for k in range(len(every))]


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


def row_text(scenario: str, settings: Mapping[str, float], one: Try) -> str:
    """A row of a study file."""
    text = ", ".join(f"{name}: {value:g}" for name, value in {**settings, **one.settings}.items())
    return f'- {{scenario: {scenario}, settings: {{{text}}}, methods: ["{one.method}"]}}'


def asked(given: argparse.Namespace) -> list[tuple[str, dict[str, float], list[str]]]:
    """Scenarios with settings, and the methods with a grid."""
    if given.scenario is None:
        rows = read_study(FOLDER / "planners.yaml").rows
        found = [(row.name, dict(row.settings), list(map(str, row.methods))) for row in rows]
    else:
        settings = {name: float(value) for name, _, value in (item.partition("=") for item in given.set)}
        found = [(given.scenario, settings, list(OF_SCENARIO))]
    chosen = given.methods
    return [
        (name, settings, [m for m in chosen or methods if plain(m) in OF_SCENARIO]) for name, settings, methods in found
    ]


def main() -> None:
    """Make all tries, write them, and print the best of each method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", help="a name of the gallery or a .yaml file")
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE")
    parser.add_argument("--methods", nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=FOLDER / "results" / "best_settings.csv")
    parser.add_argument("--quick", action="store_true", help="two values of each setting, two seeds: for tests")
    given = parser.parse_args()
    seeds, count = (SEEDS[:QUICK], QUICK) if given.quick else (SEEDS, None)
    for scenario, settings, methods in asked(given):
        text = " ".join([scenario, *(f"{name}={value:g}" for name, value in settings.items())])
        for method in methods:
            every = tries(method, count)
            found = results(scenario, settings, every, seeds, given.jobs)
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
