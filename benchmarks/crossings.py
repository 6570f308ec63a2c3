"""Crossing recorded traffic: every task of a tasks.json, at a level of foresight.

usage: python benchmarks/crossings.py DATA_DIR [--foresight recorded] [--out RESULT.json] [--jobs N]
       [--method nao_ahead] [--take 3] [--settings share=0.3 ...] [--outcomes TABLE.csv --column NAME]
       python benchmarks/crossings.py --leave-out TABLE.csv [--among NAME ...]

DATA_DIR contains tasks.json: per recording a file of tracks, the radii and limits of a robot, and tasks. A task has a
start, a goal and a time. Recorded agents do not react.

The program writes {task: {"t": [s from the start of the task], "p": [[x, y(, z)], ...]}} for an independent judge, anew
after every task; an interrupted run leaves a valid file. It has 20 samples a second or more. The program prints per
recording: safe and arrived, collided, limit violations, the least clearance, and decision times [us].

All parameters follow from the limits alone. Let v be the maximum speed and a the largest acceleration. The robot
decides every v / (10 a), a tenth of the time from rest to maximum speed. The simulation takes five steps in that time.
The margin is 5 mm where the future is known and 0.1 m where it is predicted.

`--method` may be one of other authors with its parameters, as `mppi:samples=512:horizon=4r`: a number of rises, the
time from rest to maximum speed. It observes the present positions and velocities. Tasks in space are left out for
methods of the plane. `--settings` are those of `slalom.FromModels`.

`--outcomes` adds a column to a table with a line for each task: safe, collided or late. `--leave-out` chooses among the
columns, for each recording from the tasks of all others: the fewest collided, then the most safe, then the first. It
prints what the choice has on the recordings left out.
"""

import argparse
import csv
import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from machine import describe, replace_text
from rich.console import Console
from rich.progress import track

from slalom import FORESIGHTS, Ball, Disc, FromModels, Goal, Limits, Method, Obstacle, State, Stationary, method
from slalom.io.formats import read_recording
from slalom.io.recorded import Agent, RecordedTracks
from slalom.peers import Peer, contender
from slalom.sim import Recording, Robot, Scenario, simulate
from slalom.sim.measure.metrics import summary

MARGINS = {"recorded": 0.005, "present": 0.005, "observed": 0.1}
"""[m]"""
DECISIONS, STEPS, SAMPLES = 10, 5, 40
"""Decisions from rest to maximum speed, steps of the simulation per decision, samples per second in the result."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="?")
    parser.add_argument("--leave-out", type=Path)
    parser.add_argument("--among", nargs="+", help="the columns to choose from; default: all")
    parser.add_argument("--foresight", choices=list(FORESIGHTS), default="recorded")
    parser.add_argument("--method", default="nao_ahead")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--take", type=int, help="only the first tasks of each recording")
    parser.add_argument("--settings", nargs="*", default=[], help="of FromModels, as share=0.3")
    parser.add_argument("--outcomes", type=Path)
    parser.add_argument("--column", default="default", help="of the table of outcomes")
    arguments = parser.parse_args()
    if arguments.leave_out is not None:
        print("\n".join(left_out(read_outcomes(arguments.leave_out), arguments.among)))
        return
    if arguments.data is None:
        parser.error("expected DATA_DIR or --leave-out TABLE.csv")
    chosen: Method | str = arguments.method
    if isinstance(contender(arguments.method.split(":")[0]), Method):
        chosen = method(arguments.method).with_foresight(arguments.foresight)
    if arguments.settings:
        settings = {key: json.loads(value) for key, value in (one.split("=") for one in arguments.settings)}
        chosen = replace(chosen, forecast=FromModels(**settings))
    recordings = json.loads((arguments.data / "tasks.json").read_text())
    work = [(name, entry, task) for name, entry in recordings.items() for task in entry["tasks"][: arguments.take]]
    if isinstance(chosen, str):
        work = [(name, entry, task) for name, entry, task in work if len(task["start"]) == 2]
    runs = Parallel(n_jobs=arguments.jobs, return_as="generator")(
        delayed(crossed)(arguments.data, entry, task, chosen) for _, entry, task in work
    )
    about = {"method": arguments.method, "margins": MARGINS, "decisions": DECISIONS, "steps": STEPS, **describe()}
    results: dict[str, list[dict[str, Any]]] = {}
    paths: dict[str, Any] = {}
    facts: list[dict[str, Any]] = []
    for (name, _, _), run in track(zip(work, runs, strict=True), "tasks", len(work), console=Console(stderr=True)):
        results.setdefault(name, []).append(run)
        paths[run["task"]] = {"t": run["t"], "p": run["p"]}
        facts.append({k: v for k, v in run.items() if k not in ("t", "p", "times")})
        if arguments.out is not None:
            replace_text(arguments.out, json.dumps(paths))
            replace_text(arguments.out.with_suffix(".runs.json"), json.dumps({"parameters": about, "runs": facts}))
    for line in table(results):
        print(line)
    if arguments.outcomes is not None:
        add_outcomes(arguments.outcomes, arguments.column, results)


def crossed(folder: Path, entry: dict[str, Any], task: dict[str, Any], given: Method | str) -> dict[str, Any]:
    """One task: the samples for the judge, and the result of the run."""
    before = perf_counter()
    chosen = given if isinstance(given, Method) else peer(given, entry["vmax"] / entry["amax"])
    scenario = crossing(read_recording(folder / entry["file"], interpolation="linear"), entry, task, chosen)
    if isinstance(chosen, Peer):
        # Crowds of others hold all agents of a scenario, also those that leave before it or come after it.
        there = [o for o in scenario.obstacles if o.trajectory.span[1] >= scenario.start]
        there = [o for o in there if o.trajectory.span[0] <= scenario.start + scenario.duration]
        scenario = replace(scenario, obstacles=tuple(there))
    loading = perf_counter() - before
    # Compiled code is loaded before decisions are timed.
    simulate(scenario.with_settings({"duration": scenario.dt * STEPS}), chosen)
    run = simulate(scenario, chosen)
    result = summary(run)
    times, positions = samples(run)
    decided = np.array([row[0] != "" for row in run.outcomes])
    acceleration = np.linalg.norm(run.accelerations[:, 0], axis=1)
    speed = np.linalg.norm(run.velocities[:, 0], axis=1)
    over = bool((acceleration > entry["amax"] * (1 + 1e-6)).any() or (speed > entry["vmax"] * (1 + 1e-6)).any())
    return {
        "task": task["id"],
        "arrived": bool(result["arrived"]),
        "collided": bool(result["collisions"]),
        "over": over,
        "clearance": result["min_clearance"],
        "seconds": float(run.arrived[0]) - task["t0"] if result["arrived"] else None,
        "times": run.decision_times[decided, 0].tolist(),
        "loading": loading,
        "t": times.tolist(),
        "p": positions.tolist(),
    }


def peer(spec: str, rise: float) -> Method | Peer:
    """A method of other authors, whose times in rises [s] are written as `4r`."""
    return contender(re.sub(r"=([0-9.]+)r", lambda found: f"={float(found[1]) * rise:.4g}", spec))


def crossing(tracks: RecordedTracks, entry: dict[str, Any], task: dict[str, Any], chosen: Method | Peer) -> Scenario:
    """The scenario of a task."""
    first, flat = task.get("first_agent_id"), len(task["start"]) == 2
    body = Disc if flat else Ball
    obstacles = tuple(
        Obstacle(body(radius_of(agent, entry["agent_radius"])), agent.trajectory, name)
        for name, agent in tracks.agents.items()
        if first is None or int(name) >= first
    )
    state = State(np.array(task["start"], float), np.array(task["start_velocity"], float))
    goal = Goal(Stationary(np.array(task["goal"], float)), task["goal_tolerance"])
    limits = Limits(entry["vmax"], entry["amax"])
    rise = entry["vmax"] / entry["amax"]
    return Scenario(
        name=task["id"],
        robots=(Robot(body(entry["robot_radius"]), limits, state, goal),),
        obstacles=obstacles,
        start=task["t0"],
        duration=task["horizon"],
        dt=rise / DECISIONS / STEPS,
        replan=rise / DECISIONS,
        horizon=min(6.0 * rise, task["horizon"]),
        margin=MARGINS[chosen.foresight if isinstance(chosen, Method) else "observed"],
    )


def radius_of(agent: Agent, rule: float | str) -> float:
    """The radius [m] of an agent: a number for all, its own, or half the diagonal of its length and width."""
    if not isinstance(rule, str):
        return float(rule)
    if rule == "radius":
        assert agent.radius is not None
        return agent.radius
    if agent.kind and agent.kind != "vehicle":
        return 0.25
    assert agent.length is not None and agent.width is not None  # noqa: PT018
    return float(np.hypot(agent.length, agent.width)) / 2.0


def samples(run: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Times from the start (n,) [s] and positions (n, d) [m] on the exact path, at least SAMPLES a second."""
    parts = max(1, int(np.ceil(SAMPLES * run.dt)))
    h = run.dt * np.arange(parts) / parts
    position, velocity, acceleration = run.positions[:-1, 0], run.velocities[:-1, 0], run.accelerations[:, 0]
    path = position[:, None] + h[:, None] * (velocity[:, None] + 0.5 * h[:, None] * acceleration[:, None])
    times = (run.times[:-1, None] + h).ravel()
    path = path.reshape(-1, path.shape[2])
    return np.append(times, run.times[-1]) - run.times[0], np.concatenate([path, run.positions[-1:, 0]])


def table(results: dict[str, list[dict[str, Any]]]) -> Iterator[str]:
    """A line for each recording, and one for all."""
    heads = [("recording", -28), ("safe and arrived", 16), ("collided", 8), ("over limits", 11), ("clearance", 9)]
    heads += [("median us", 9), ("99 %", 7), ("max", 7)]
    yield " ".join(f"{text:<{-width}}" if width < 0 else f"{text:>{width}}" for text, width in heads)
    everything = [run for runs in results.values() for run in runs]
    for name, runs in [*results.items(), ("all", everything)]:
        safe = sum(run["arrived"] and not run["collided"] for run in runs)
        spent = 1e6 * np.concatenate([run["times"] for run in runs])
        clearance = min(run["clearance"] for run in runs)
        yield (
            f"{name:28} {f'{safe} of {len(runs)}':>16} {sum(run['collided'] for run in runs):8d} "
            f"{sum(run['over'] for run in runs):11d} {clearance:9.3f} {np.median(spent):9.0f} "
            f"{np.quantile(spent, 0.99):7.0f} {spent.max():7.0f}"
        )


Outcomes = dict[tuple[str, str], dict[str, str]]
"""Of each recording and task: the outcome in each column."""


def read_outcomes(file: Path) -> Outcomes:
    with file.open(newline="") as rows:
        return {(row.pop("recording"), row.pop("task")): row for row in csv.DictReader(rows)}


def add_outcomes(file: Path, column: str, results: dict[str, list[dict[str, Any]]]) -> None:
    """Write the outcomes of a run into a column of the table; a task without a run has none in it."""
    outcomes = read_outcomes(file) if file.exists() else {}
    for name, runs in results.items():
        for run in runs:
            outcome = "collided" if run["collided"] else "safe" if run["arrived"] else "late"
            outcomes.setdefault((name, run["task"]), {})[column] = outcome
    columns = list(dict.fromkeys(key for row in outcomes.values() for key in row))
    with file.open("w", newline="") as rows:
        writer = csv.writer(rows, lineterminator="\n")
        writer.writerow(["recording", "task", *columns])
        writer.writerows([*key, *(row.get(column, "") for column in columns)] for key, row in outcomes.items())


def left_out(outcomes: Outcomes, among: list[str] | None) -> Iterator[str]:
    """A line for each recording with the column chosen without it, and lines for all and for each column alone.

    Tasks count that have an outcome in every column `among` which one is chosen; None: all columns.
    """
    columns = among or list(next(iter(outcomes.values())))
    outcomes = {key: row for key, row in outcomes.items() if all(row[column] for column in columns)}
    recordings = dict.fromkeys(name for name, _ in outcomes)

    def counted(column: str, names: set[str]) -> Counter[str]:
        return Counter(row[column] for (name, _), row in outcomes.items() if name in names)

    found: Counter[str] = Counter()
    for name in recordings:
        others = {column: counted(column, set(recordings) - {name}) for column in columns}
        best = min(columns, key=lambda column: (others[column]["collided"], -others[column]["safe"]))
        own = counted(best, {name})
        found += own
        yield f"{name:28} {best:30} {verdict(own)}"
    yield f"{'all, left out in turn':59} {verdict(found)}"
    for column in columns:
        yield f"{'all':28} {column:30} {verdict(counted(column, set(recordings)))}"


def verdict(counts: Counter[str]) -> str:
    return (
        f"safe {counts['safe']:4d} of {counts.total():4d}, collided {counts['collided']:3d}, late {counts['late']:3d}"
    )


if __name__ == "__main__":
    main()
