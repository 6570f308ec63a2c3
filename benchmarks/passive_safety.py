"""What passive safety costs a robot among agents that do not react: time to arrival, contacts at rest and in motion.

usage: python benchmarks/passive_safety.py DATA_DIR [--foresight recorded] [--seeds 20] [--take N]

DATA_DIR contains tasks.json, see crossings.py; tasks of the plane take part, and scenarios of the gallery. The robot
decides by `nao`; by `nao` with motions that end at rest; and by these with contacts that count only while it moves.
The first contact with each agent counts; it is one at rest if the robot is below SLOW when it begins.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from crossings import crossing

from slalom import FORESIGHTS, method
from slalom.io.formats import read_recording
from slalom.sim import Recording, Scenario, load, simulate

SLOW = 0.01
"""[1] Share of the maximum speed above which a robot moves."""
TOUCH = 1e-3
"""[m] Depth of a contact."""
GALLERY = ("crowdnav", "corridor", "recorded_roundabout")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--foresight", choices=list(FORESIGHTS), default="recorded")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--take", type=int, help="only the first tasks of each recording")
    arguments = parser.parse_args()
    nao = method(f"nao@{arguments.foresight}")
    print("| scenes | robot | arrived | time | contacts at rest | in motion |\n|---|---|---|---|---|---|")
    for name, scenarios in {
        "crossings": list(crossings(arguments.data, arguments.take)),
        **{name: [gallery(name, seed) for seed in range(arguments.seeds)] for name in GALLERY},
    }.items():
        first = [driven(scenario, nao) for scenario in scenarios]
        for robot, runs in {
            "nao": first,
            "ends at rest": [driven(scenario, nao.stopping()) for scenario in scenarios],
            "passively safe": [driven(passive(scenario), nao.stopping()) for scenario in scenarios],
        }.items():
            times = np.array([run[:1] + before[:1] for run, before in zip(runs, first, strict=True)])
            both = np.isfinite(times).all(axis=1)
            resting, moving = (sum(run[k] for run in runs) for k in (1, 2))
            ratio = times[both, 0].mean() / times[both, 1].mean()
            arrived = f"{np.isfinite(times[:, 0]).sum()} of {len(runs)}"
            print(f"| {name} | {robot} | {arrived} | {ratio:.2f} | {resting} | {moving} |", flush=True)


def crossings(folder: Path, take: int | None) -> Iterator[Scenario]:
    for entry in json.loads((folder / "tasks.json").read_text()).values():
        for task in entry["tasks"][:take]:
            if len(task["start"]) == 2:
                tracks = read_recording(folder / entry["file"], interpolation="linear")
                yield crossing(tracks, entry, task, method("nao"))


def gallery(name: str, seed: int) -> Scenario:
    return load(name, {"random": 1} if name == "recorded_roundabout" else {}, seed=seed)


def passive(scenario: Scenario) -> Scenario:
    """The scenario with obstacles whose contacts count only while the robot moves."""
    return replace(scenario, obstacles=tuple(replace(o, contact_at_rest=False) for o in scenario.obstacles))


def driven(scenario: Scenario, chosen: object) -> tuple[float, int, int]:
    """Time to arrival [s], inf without; agents that first touch the robot at rest, and in motion."""
    run: Recording = simulate(scenario, chosen)
    speeds = np.linalg.norm(run.velocities[:, 0], axis=1)
    began = list[float]()
    for other in scenario.obstacles:
        there = np.flatnonzero((run.times >= other.trajectory.span[0]) & (run.times <= other.trajectory.span[1]))
        if len(there) and other.name != "walls":
            away = np.linalg.norm(run.positions[there, 0] - other.trajectory.position(run.times[there]), axis=1)
            touched = away < scenario.robot.shape.bounding_radius + other.shape.bounding_radius - TOUCH
            began += speeds[there[touched][:1]].tolist()
    moving = [speed > SLOW * scenario.robot.limits.max_speed for speed in began]
    arrival = float(run.arrived[0]) - scenario.start if np.isfinite(run.arrived[0]) else np.inf
    return arrival, len(moving) - sum(moving), sum(moving)


if __name__ == "__main__":
    main()
