"""Two experiments of navground by its own runner and measures; writes benchmarks/results/navground_table.csv.

.venv/bin/python benchmarks/navground_experiments.py --seeds 10

Each run is added to benchmarks/results/navground.csv when it ends; runs that are there are not made again (`--again`
forgets those of some agents first).
"""

import argparse
import csv
from itertools import groupby
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from navground import sim

import slalom.adapters.navground  # noqa: F401  # registers the behaviours
from slalom.base.checks import Array

ROOT = Path(__file__).parents[1]
RUNS = ROOT / "benchmarks" / "results" / "navground.csv"
TABLE = ROOT / "benchmarks" / "results" / "navground_table.csv"
FIELDS = ("experiment", "kinematics", "agents", "seed", "steps", "collisions", "own", "efficacy", "time")
"""Columns of the file of runs. own: collisions into which the one agent among others moved; empty for agents that are
all alike. efficacy: of that agent, else of all. time: microseconds of processor time per agent and step."""


class Setting(NamedTuple):
    """An experiment of navground with the numbers of its YAML file in navground_examples_yaml/experiment."""

    scenario: str
    radius: float
    speed: float
    range: float
    margin: float


SETTINGS = {
    "Cross": Setting("agent_margin: 0.1, side: 4, target_margin: 0.1, tolerance: 0.5", 0.08, 0.12, 5.0, 0.02),
    "Antipodal": Setting(
        "position_noise: 0.005, orientation_noise: 0.01, radius: 2, tolerance: 0.2", 0.1, 0.08, 10.0, 0.01
    ),
}
KINEMATICS = {
    "omnidirectional": "{type: Omni, max_speed: 0.166}",
    "two wheels": "{type: 2WDiff, wheel_axis: 0.094, max_speed: 0.166}",
}
COUNT = 20
AGENTS: dict[str, dict[str, int]] = {
    "SlalomFleet": {"SlalomFleet": COUNT},
    "SlalomFleet, nao_shared": {"SlalomFleet, method: nao_shared": COUNT},
    "HL": {"HL": COUNT},
    "ORCA": {"ORCA": COUNT},
    "HRVO": {"HRVO": COUNT},
    "Slalom among HL": {"Slalom": 1, "HL": COUNT - 1},
}
"""The numbers of agents of each behaviour."""


def experiment(
    name: str, kinematics: str, behaviours: dict[str, int], steps: int = 1000, time_step: float = 0.1
) -> sim.Experiment:
    """The experiment with so many agents of each behaviour."""
    s = SETTINGS[name]
    groups = [
        f"{{type: thymio, number: {number}, radius: {s.radius}, control_period: 0.1, speed_tolerance: 0.02, "
        f"kinematics: {KINEMATICS[kinematics]}, state_estimation: {{type: Bounded, range: {s.range}}}, "
        f"behavior: {{type: {kind}, optimal_speed: {s.speed}, horizon: {s.range}, safety_margin: {s.margin}}}}}"
        for kind, number in behaviours.items()
    ]
    scenario = f"{{type: {name}, {s.scenario}, groups: [{', '.join(groups)}]}}"
    made = sim.load_experiment(f"steps: {steps}\ntime_step: {time_step}\nscenario: {scenario}")
    made.record_config.collisions = made.record_config.efficacy = made.record_config.pose = True
    return made


def moved_into(run: sim.ExperimentalRun, agent: int) -> list[tuple[int, bool]]:
    """The steps at which an agent is in a collision, and whether its own motion since the last step led into it.

    Walls do not move: into a wall an agent always moves itself.
    """
    found = []
    poses: Array = np.asarray(run.poses)[..., :2]
    for step, first, second in np.asarray(run.collisions).tolist():
        if agent in (first, second) and 0 < step < len(poses):
            other = second if agent == first else first
            own = other >= poses.shape[1]
            if not own:
                offset = poses[step - 1, other] - poses[step - 1, agent]
                own = bool((poses[step, agent] - poses[step - 1, agent]) @ offset > 0.0)
            found.append((step, own))
    return found


def make(name: str, kinematics: str, agents: str, seed: int) -> dict[str, str]:
    """One run as a row of the file."""
    made, begin = experiment(name, kinematics, AGENTS[agents]), process_time()
    made.run(number_of_runs=1, start_index=seed)
    (run,), time = made.runs.values(), process_time() - begin
    alone = len(AGENTS[agents]) > 1
    # The first group is added first: its agent has row 0.
    met = moved_into(run, 0) if alone else []
    efficacy = np.asarray(run.efficacy)[:, 0] if alone else run.efficacy
    return {
        "experiment": name,
        "kinematics": kinematics,
        "agents": agents,
        "seed": str(seed),
        "steps": str(run.recorded_steps),
        "collisions": str(len(met) if alone else len(run.collisions)),
        "own": str(sum(own for _, own in met)) if alone else "",
        "efficacy": f"{np.mean(efficacy):.6f}",
        "time": f"{1e6 * time / run.recorded_steps / COUNT:.0f}",
    }


def kept() -> list[dict[str, str]]:
    """The runs of the file."""
    if not RUNS.exists():
        return []
    with RUNS.open(newline="") as file:
        return list(csv.DictReader(file))


def keep(rows: list[dict[str, str]]) -> None:
    """Write the runs to the file, in the order of the tables."""
    order = [list(SETTINGS), list(KINEMATICS), list(AGENTS)]
    rows.sort(key=lambda r: (*(each.index(r[key]) for each, key in zip(order, FIELDS)), int(r["seed"])))
    with RUNS.open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def table(rows: list[dict[str, str]]) -> list[tuple[str, ...]]:
    """The rows of the table: sums of collisions and means of the others over the seeds."""
    found: list[tuple[str, ...]] = [(*FIELDS[:3], "seeds", *FIELDS[5:8], "least efficacy", "steps", "time")]
    for key, group in groupby(rows, key=lambda r: (r["experiment"], r["kinematics"], r["agents"])):
        runs = list(group)
        collisions, own = sum(int(r["collisions"]) for r in runs), sum(int(r["own"] or 0) for r in runs)
        efficacies = [float(r["efficacy"]) for r in runs]
        times = [float(r["time"]) for r in runs if r["time"]]
        counts = (len(runs), collisions, own if "among" in key[2] else "")
        means = (
            f"{np.mean(efficacies):.3f}",
            f"{min(efficacies):.3f}",
            f"{np.mean([int(r['steps']) for r in runs]):.0f}",
        )
        found.append((*key, *map(str, counts), *means, f"{np.mean(times):.0f}" if times else ""))
    return found


def main() -> None:
    """Make the runs that are missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--only", choices=list(SETTINGS))
    parser.add_argument("--kinematics", choices=list(KINEMATICS))
    parser.add_argument("--agents", choices=list(AGENTS), action="append")
    parser.add_argument("--again", choices=list(AGENTS), action="append", default=[])
    arguments = parser.parse_args()
    rows = [row for row in kept() if row["agents"] not in arguments.again]
    done = {tuple(row[key] for key in FIELDS[:4]) for row in rows}
    for seed in range(arguments.seeds):
        for name in [arguments.only] if arguments.only else SETTINGS:
            for kind in [arguments.kinematics] if arguments.kinematics else KINEMATICS:
                for agents in arguments.agents or AGENTS:
                    if (name, kind, agents, str(seed)) not in done:
                        rows.append(make(name, kind, agents, seed))
                        print(*rows[-1].values(), flush=True)
                        keep(rows)
    with TABLE.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table(rows))


if __name__ == "__main__":
    main()
