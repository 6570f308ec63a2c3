"""Crossing recorded crowds that do not see the robot: cases in the format of the CrowdNav++ test.

usage: python benchmarks/crowdnavpp.py DATA.npz --foresight observed [--out RESULT.json] [--jobs N] [--cases N]
       [--every N] [--loss 120]

Rules of the test (Liu et al., ICRA 2023): steps of 0.25 s, a disc that takes any velocity up to its maximum speed, a
goal at rest. At each step the robot observes the position and the radius of every person whose surface is within its
sensor range. A velocity is the difference of two observed positions. Later steps of the recording, goals of people and
where they leave are never read.

People are predicted as a crowd whose agents avoid each other (`slalom.AvoidingCrowd`), with a radius that grows by
GROWTH; later errors are corrected by later decisions. A robot that looks ahead (`nao_ahead`) plans with each of MARGINS
and its share of the growth, tries short deviations, and takes what has the least expected loss of time
(`slalom.ExpectedLoss`), where a contact is worth `loss` [s]. The scale of the errors follows those that were observed.
Its acceleration is bounded by ACCELERATION, which the test leaves open.

The program writes {case: {"t": [s], "p": [[x, y], ...]}} for an independent judge, anew after every case. The judge
says what collided; this program prints how many arrive, and times of decisions.
"""

import argparse
import json
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from machine import describe, replace_text
from rich.console import Console
from rich.progress import track

from slalom import (
    AvoidingCrowd,
    BoundedError,
    Disc,
    ExpectedLoss,
    Goal,
    Limits,
    LookAhead,
    Navigator,
    State,
    Stationary,
    Tracks,
    method,
)

ACCELERATION = 16.0
"""[m/s^2] from rest to the maximum speed of 1 m/s in a quarter of a step."""
SAMPLES = 10
"""In one step, in the result."""
INSIDE = 0.98
"""The robot stops to decide at this share of the distance at which it has arrived."""
AIM = 2.0 / 3.0
"""Of that distance is the tolerance of the goal that the robot plans for."""
HORIZON = 1.5
"""[s] of the decisions that take over where the search has no sequence."""
GROWTH = 0.1
"""[m/s] of the radius of a prediction."""
MARGINS = (0.05, 0.1, 0.2, 0.3)
"""[m]"""
SHARES = (0.0, 1.0, 1.0, 1.0)
"""Of the growth, one for each margin."""
SPREAD = BoundedError(0.0075, 0.0, 0.12)
"""[m] Scale of the errors of predictions, which `AvoidingCrowd.scales` adapts to what is observed."""
LOSS = 120.0
"""[s] of time that a contact is worth."""


class Case(NamedTuple):
    """What the robot may know of a case, and nothing else."""

    name: str
    start: np.ndarray  # (2,) [m]
    goal: np.ndarray  # (2,) [m]
    positions: np.ndarray  # (k, n, 2) [m] of n people at k steps, of which the robot sees those up to now
    people: np.ndarray  # (k, n) numbers of the people
    radii: dict[int, float]  # [m] by number


class Setting(NamedTuple):
    """What all cases have in common."""

    step: float  # [s]
    radius: float  # [m] of the robot
    speed: float  # [m/s]
    arrived: float  # [m]
    sight: float  # [m] between surfaces
    loss: float  # [s] of time that a contact is worth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--foresight", choices=["observed"], default="observed")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--cases", type=int, help="only the first cases")
    parser.add_argument("--every", type=int, default=1, help="only every so many cases, from the first")
    parser.add_argument("--loss", type=float, default=LOSS)
    arguments = parser.parse_args()
    setting, cases = read(arguments.data, arguments.loss)
    cases = cases[: arguments.cases : arguments.every]
    runs = Parallel(n_jobs=arguments.jobs, return_as="generator")(delayed(crossed)(case, setting) for case in cases)
    found: dict[str, Any] = {}
    slowest: list[float] = []
    for case, run in track(zip(cases, runs, strict=True), "cases", len(cases), console=Console(stderr=True)):
        found[case.name] = {"t": run["t"], "p": run["p"]}
        slowest += run["times"]
        if arguments.out is not None:
            replace_text(arguments.out, json.dumps(found))
    ends = [np.linalg.norm(np.array(found[case.name]["p"][-1]) - case.goal) for case in cases]
    print(f"{np.count_nonzero(np.array(ends) < setting.arrived)} of {len(cases)} paths end at their goal")
    print(f"decision: median {1e3 * np.median(slowest):.1f} ms, 99 % {1e3 * np.quantile(slowest, 0.99):.1f} ms")
    if arguments.out is not None:
        policy = {"acceleration": ACCELERATION, "growth": GROWTH, "margins": MARGINS, "shares": SHARES}
        policy["spread"] = [SPREAD.position, SPREAD.velocity, SPREAD.acceleration]
        about = {**setting._asdict(), **policy, **describe()}
        arguments.out.with_suffix(".runs.json").write_text(json.dumps(about, indent=1))


def read(file: Path, loss: float) -> tuple[Setting, list[Case]]:
    """The setting and the cases of a file; only what the robot may know."""
    with np.load(file) as data:
        names = ("dt", "robot_radius", "robot_v_max", "goal_radius", "sensor_range")
        setting = Setting(*(float(data[name]) for name in names), loss)
        radii: dict[int, dict[int, float]] = {}
        rows = zip(data["person_case"], data["person_id"], data["person_radius"], strict=True)
        for case, person, radius in rows:
            radii.setdefault(int(case), {})[int(person)] = float(radius)
        starts, goals, positions, people = (data[name] for name in ("robot_start", "robot_goal", "xy", "pid"))
        cases = [
            Case(str(case), start.astype(float), goal.astype(float), places, ids, radii[int(case)])
            for case, start, goal, places, ids in zip(data["case"], starts, goals, positions, people, strict=True)
        ]
    return setting, cases


def crossed(case: Case, setting: Setting) -> dict[str, Any]:
    """The samples of one case for the judge, and the times of its decisions [s]."""
    h, limits = setting.step, Limits(setting.speed, ACCELERATION)
    ahead = LookAhead(Navigator(method("nao_ahead"), Disc(setting.radius), limits, period=h, horizon=HORIZON))
    robot = ExpectedLoss(ahead, MARGINS, SHARES, setting.loss, SPREAD)
    crowd = AvoidingCrowd(h, uncertainty=BoundedError(velocity=GROWTH))
    goal, state, decision = Goal(Stationary(case.goal), AIM * setting.arrived), State(case.start, np.zeros(2)), None
    times, places, spent = [0.0], [case.start.tolist()], []
    for k in range(len(case.positions) - 1):
        now, before = k * h, perf_counter()
        people = crowd.predict(seen(case, k, state.position, setting))
        decision = robot.decide(state, people, goal, now=now, previous=decision, scales=crowd.scales)
        spent.append(perf_counter() - before)
        ends = now + h * np.arange(1, SAMPLES + 1) / SAMPLES
        times += ends.tolist()
        places += decision.manoeuvre.position(ends).tolist()
        state = State(decision.manoeuvre.position(now + h), decision.manoeuvre.velocity(now + h))
        if np.linalg.norm(state.position - case.goal) < INSIDE * setting.arrived:
            break
    return {"t": times, "p": places, "times": spent}


def seen(case: Case, k: int, position: np.ndarray, setting: Setting) -> Tracks:
    """People that a robot at `position` (2,) [m] sees at step k, with the velocities of the step before."""
    places = case.positions[k].astype(float)
    before = case.positions[max(k - 1, 0)].astype(float)
    stayed = case.people[k] == case.people[max(k - 1, 0)]
    velocities = np.where(stayed[:, None], (places - before) / setting.step, 0.0)
    radii = np.array([case.radii[int(person)] for person in case.people[k]])
    near = np.linalg.norm(places - position, axis=1) - radii - setting.radius <= setting.sight
    ids = case.people[k][near].tolist()
    return Tracks(places[near], velocities[near], radii[near], k * setting.step, ids=ids)


if __name__ == "__main__":
    main()
