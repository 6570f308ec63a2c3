"""navground's four experiments by its own runner and measures; writes the tables of docs/navground.md.

.venv/bin/python benchmarks/navground_experiments.py --seeds 10 --page docs/navground_tables.md
"""

import argparse
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np
from navground import sim

import slalom.adapters.navground  # noqa: F401  # registers the behaviours
from slalom.checks import Array


class Setting(NamedTuple):
    """An experiment of navground with the numbers of its published YAML files."""

    scenario: str
    radius: float
    speed: float
    range: float
    margin: float
    steps: int
    time_step: float
    period: str


SETTINGS = {
    "Cross": Setting(
        "agent_margin: 0.1, side: 4, target_margin: 0.1, tolerance: 0.5", 0.08, 0.12, 5.0, 0.02, 1000, 0.1, "[0, 0]"
    ),
    "Antipodal": Setting(
        "position_noise: 0.005, orientation_noise: 0.01, radius: 2, tolerance: 0.2",
        0.1,
        0.08,
        10.0,
        0.01,
        1000,
        0.1,
        "[0, 0]",
    ),
    "Corridor": Setting("length: 8.0, width: 0.6", 0.08, 0.12, 5.0, 0.02, 1000, 0.1, "[8, 0]"),
    "CrossTorus": Setting("agent_margin: 0.1, side: 4", 0.08, 0.12, 5.0, 0.02, 1000, 0.1, "[4, 4]"),
}
KINEMATICS = {
    "omnidirectional": "{type: Omni, max_speed: 0.166}",
    "two wheels": "{type: 2WDiff, wheel_axis: 0.094, max_speed: 0.166}",
}
BEHAVIOURS = ("SlalomFleet", "HL", "ORCA", "HRVO")
COUNT = 20


def experiment(name: str, kinematics: str, behaviours: dict[str, int], steps: int | None = None) -> sim.Experiment:
    """The experiment with so many agents of each behaviour."""
    s = SETTINGS[name]
    groups = [
        f"{{type: thymio, number: {number}, radius: {s.radius}, control_period: 0.1, speed_tolerance: 0.02, "
        f"kinematics: {KINEMATICS[kinematics]}, state_estimation: {{type: Bounded, range: {s.range}}}, "
        f"behavior: {{type: {kind}, optimal_speed: {s.speed}, horizon: {s.range}, safety_margin: {s.margin}"
        f"{', world_period: ' + s.period if kind.startswith('Slalom') else ''}}}}}"
        for kind, number in behaviours.items()
    ]
    scenario = f"{{type: {name}, {s.scenario}, groups: [{', '.join(groups)}]}}"
    made = sim.load_experiment(f"steps: {steps or s.steps}\ntime_step: {s.time_step}\nscenario: {scenario}")
    made.record_config.collisions = made.record_config.efficacy = made.record_config.pose = True
    return made


def moved_into(run: sim.ExperimentalRun, agent: int) -> list[tuple[int, bool]]:
    """The steps at which an agent is in a collision, and whether its own motion since the last step led into it."""
    found = []
    poses: Array = np.asarray(run.poses)[..., :2]
    for step, first, second in np.asarray(run.collisions).tolist():
        if agent in (first, second) and 0 < step < len(poses):
            other = second if agent == first else first
            offset = poses[step - 1, other] - poses[step - 1, agent] if other < poses.shape[1] else np.zeros(2)
            motion = poses[step, agent] - poses[step - 1, agent]
            found.append((step, bool(motion @ offset > 0.0)))
    return found


def fleet_rows(name: str, kinematics: str, seeds: int) -> list[str]:
    """A row of the table for each behaviour."""
    rows = []
    for behaviour in BEHAVIOURS:
        made, begin = experiment(name, kinematics, {behaviour: COUNT}), perf_counter()
        made.run(number_of_runs=seeds)
        runs = list(made.runs.values())
        time = 1e6 * (perf_counter() - begin) / sum(run.recorded_steps for run in runs) / COUNT
        collisions = sum(len(run.collisions) for run in runs)
        efficacy = np.mean([np.mean(run.efficacy) for run in runs])
        rows.append(f"| {name} | {kinematics} | {behaviour} | {collisions} | {efficacy:.3f} | {time:.0f} |")
        print(rows[-1], flush=True)
    return rows


def single_row(name: str, kinematics: str, seeds: int) -> str:
    """A row for one `Slalom` among 19 HL."""
    made = experiment(name, kinematics, {"Slalom": 1, "HL": COUNT - 1})
    made.run(number_of_runs=seeds)
    # The first group is added first: its agent has row 0.
    runs = list(made.runs.values())
    met = [each for run in runs for each in moved_into(run, 0)]
    efficacy = np.mean([np.mean(np.asarray(run.efficacy)[:, 0]) for run in runs])
    row = f"| {name} | {kinematics} | {len(met)} | {sum(own for _, own in met)} | {efficacy:.3f} |"
    print(row, flush=True)
    return row


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--only", choices=list(SETTINGS))
    parser.add_argument("--kinematics", choices=list(KINEMATICS))
    parser.add_argument("--page", type=Path)
    arguments = parser.parse_args()
    pairs = [
        (name, kind)
        for name in ([arguments.only] if arguments.only else SETTINGS)
        for kind in ([arguments.kinematics] if arguments.kinematics else KINEMATICS)
    ]
    fleets = [row for name, kind in pairs for row in fleet_rows(name, kind, arguments.seeds)]
    singles = [single_row(name, kind, arguments.seeds) for name, kind in pairs]
    lines = [
        f"# navground: {arguments.seeds} seeds of each experiment",
        "",
        "Written by `benchmarks/navground_experiments.py`. Collisions are rows of navground's record, of all seeds.",
        "",
        "| experiment | kinematics | behaviour of all 20 | collisions | efficacy | time per agent and step, us |",
        "|---|---|---|---|---|---|",
        *fleets,
        "",
        "| experiment | kinematics | collisions of one `Slalom` among 19 HL | into which it moved | its efficacy |",
        "|---|---|---|---|---|",
        *singles,
    ]
    if arguments.page:
        arguments.page.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
