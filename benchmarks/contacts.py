"""How often contacts come that decisions from observation call probable, and how often those that are safe.

usage: python benchmarks/contacts.py DATA_DIR ... [--robot ahead | nao | passive] [--take N] [--jobs N]

DATA_DIR contains tasks.json, see crossings.py; tasks of the plane take part. A robot drives each task and decides as
there, by `nao_ahead@observed`, by `nao@observed`, or by that with passive safety. `Decision.contact` states the
probability of a contact within some seconds. One decision in 3 s is compared with what came. The stated odds are
corrected by two numbers fitted to the other recordings, so that none of the rows knows its recording. Intervals of
90 % are by recordings.

The program also prints the tasks that arrive in time and those with a contact, also with a robot above SLOW. It prints
the share of `safe` decisions 1 s before a contact, and of those without one within 3 s.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from crossings import crossing
from joblib import Parallel, delayed
from rich.console import Console
from rich.progress import track

from slalom import State, method
from slalom.io.formats import read_recording

THINNED, BEFORE = 3.0, 1.0
"""[s] between decisions that count, and after a decision that is judged free of contact; before a contact."""


SLOW = 0.1
"""[1] Share of the maximum speed."""
ROBOTS = {"ahead": method("nao_ahead@observed"), "nao": method("nao@observed")}
ROBOTS["passive"] = ROBOTS["nao"].stopping()


class Decided(NamedTuple):
    """One decision, and what came of it."""

    time: float  # [s] from the start of the task
    safe: bool
    probability: float  # [1]; nan without obstacles whose forecast has sets
    seconds: float  # [s]
    contact: float = np.inf  # [s] from the start of the task to the first contact; inf without


class Driven(NamedTuple):
    """One task."""

    decisions: list[Decided]
    arrival: float = np.inf  # [s] from the start of the task; inf if it did not arrive
    speed: float = np.nan  # [1] at the first contact, of the maximum speed; nan without


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="+")
    parser.add_argument("--robot", choices=list(ROBOTS), default="ahead")
    parser.add_argument("--take", type=int, help="only the first tasks of each recording")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    work = [
        (folder, name, entry, task)
        for folder in arguments.data
        for name, entry in json.loads((folder / "tasks.json").read_text()).items()
        for task in entry["tasks"][: arguments.take]
        if len(task["start"]) == 2
    ]
    runs = Parallel(n_jobs=arguments.jobs, return_as="generator")(
        delayed(driven)(folder, entry, task, arguments.robot) for folder, _, entry, task in work
    )
    shown = track(zip(work, runs, strict=True), "tasks", len(work), console=Console(stderr=True))
    tasks = [(name, run) for (_, name, _, _), run in shown]
    speeds = np.array([run.speed for _, run in tasks])
    arrivals = np.array([run.arrival for _, run in tasks])
    print(f"{np.isfinite(arrivals).sum()} of {len(tasks)} arrive, in {arrivals[np.isfinite(arrivals)].mean():.2f} s")
    print(
        f"{np.isfinite(speeds).sum()} have a contact, {(speeds > SLOW).sum()} with a robot above {SLOW:g} of its speed"
    )
    print("\n".join([*calibrated(tasks), *safety([run.decisions for _, run in tasks])]))


def driven(folder: Path, entry: dict[str, Any], task: dict[str, Any], robot_name: str) -> Driven:
    """The decisions of a task up to its end or the first contact; the robot moves exactly as it decides."""
    chosen = ROBOTS[robot_name]
    scenario = crossing(read_recording(folder / entry["file"], interpolation="linear"), entry, task, chosen)
    robot, body = scenario.decider(chosen), scenario.robots[0]
    if robot_name == "passive":
        robot = replace(robot, contact_at_rest=False)
    period, state, decision, made = scenario.replan, body.state, None, list[Decided]()
    for now in np.arange(scenario.start, scenario.start + scenario.duration, period).tolist():
        if body.goal.reached(state.position, state.velocity, now):
            return Driven(made, now - scenario.start)
        decision = robot.decide(state, scenario.obstacles, body.goal, now=now, previous=decision)
        contact = decision.contact
        stated = (np.nan, 0.0) if contact is None else (contact.probability, contact.seconds)
        made.append(Decided(now - scenario.start, decision.safe, *stated))
        times = now + period * np.linspace(0.0, 1.0, 11)
        path, first = decision.manoeuvre.position(times), np.inf
        for other in scenario.obstacles:
            there = (times >= other.trajectory.span[0]) & (times <= other.trajectory.span[1])
            if there.any():
                away = np.linalg.norm(path[there] - other.trajectory.position(times[there]), axis=1)
                touched = away < body.shape.bounding_radius + other.shape.bounding_radius
                first = min(first, float(times[there][np.argmax(touched)])) if touched.any() else first
        if first < np.inf:
            speed = float(np.linalg.norm(decision.manoeuvre.velocity(first))) / entry["vmax"]
            return Driven([one._replace(contact=first - scenario.start) for one in made], speed=speed)
        end = now + period
        state = State(decision.manoeuvre.position(end), decision.manoeuvre.velocity(end))
    return Driven(made)


def calibrated(tasks: list[tuple[str, Driven]]) -> Iterator[str]:
    """Lines of stated probabilities and shares that came, of recordings left out in turn."""
    names, odds, came = [], [], []
    for name, run in tasks:
        last = -np.inf
        for one in run.decisions:
            if one.time >= last + THINNED - 1e-9 and np.isfinite(one.probability):
                last = one.time
                names.append(name)
                odds.append(np.log(one.probability / (1.0 - one.probability)))
                came.append(one.contact - one.time <= one.seconds)
    recordings, x, y = np.array(names), np.stack([np.ones(len(odds)), odds], axis=1), np.array(came, float)
    stated = np.zeros(len(y))
    for name in np.unique(recordings):
        out = recordings == name
        stated[out] = 1.0 / (1.0 + np.exp(-x[out] @ fitted(x[~out], y[~out])))
    yield f"{len(y)} decisions, {y.mean():.4f} with a contact; correction of the odds {fitted(x, y).round(3)}"
    rng, edges = np.random.default_rng(0), np.quantile(stated, [0.0, 0.25, 0.5, 0.75, 0.9, 1.0])
    for low, high in pairwise(edges):
        rows = (stated >= low) & (stated <= high)
        shares = []
        for _ in range(500):
            drawn = rng.choice(np.unique(recordings), len(np.unique(recordings)))
            some = np.concatenate([y[rows & (recordings == name)] for name in drawn])
            shares.append(some.mean() if len(some) else np.nan)
        least, most = np.nanquantile(shares, [0.05, 0.95])
        yield f"stated {stated[rows].mean():.4f} came {y[rows].mean():.4f} ({least:.4f} to {most:.4f}) of {rows.sum()}"


def fitted(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Coefficients (2,) of a logistic regression, by Newton's method."""
    w = np.array([0.0, 1.0])
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-x @ w))
        w = w + np.clip(np.linalg.solve((x.T * (p * (1.0 - p))) @ x, x.T @ (y - p)), -1.0, 1.0)
    return w


def safety(runs: list[list[Decided]]) -> Iterator[str]:
    """Lines of the shares of safe decisions."""
    free = [one.safe for run in runs for one in run if one.contact - one.time > THINNED]
    yield f"safe without a contact within {THINNED:g} s: {np.mean(free):.3f} of {len(free)}"
    before = [next((one for one in run if one.contact - one.time <= BEFORE), None) for run in runs]
    last = [one.safe for one in before if one is not None and one.contact < np.inf]
    yield f"safe {BEFORE:g} s before a contact: {sum(last)} of {len(last)}"


if __name__ == "__main__":
    main()
