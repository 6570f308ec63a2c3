"""Growth of memory and of the time per step, over many decisions of one robot and many steps of a fleet.

usage: python benchmarks/memory.py [--decisions 20000] [--robots 100] [--seconds 60] [--many 3000] [--steps 60]
                                   [--quick] [--out FOLDER]

One robot decides repeatedly among 30 cars. Nothing is recorded, so memory must not grow. A run of a fleet is recorded
by default, and its growth is compared with the size of the recording. A run of a large fleet without recording must not
grow with time. Growth is the slope of a straight line through the resident memory over the second half of the calls.
Times are processor times.
"""

import resource
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from multiprocessing import get_context
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from pace import DT, fleet
from program import finish, options, table, target

from slalom import ObstacleTable, method
from slalom.model.state import State
from slalom.sim import Recording, gallery, simulate
from slalom.sim.run.states import integrate

ROOM, CARS_TIME = 900.0, 12.0
"""[m^2] per robot: goals are far, so that no robot arrives. [s] after which the crossing starts again."""
STATEMENT = Path("/proc/self/statm")


def resident() -> float:
    """Present resident memory [bytes], or the largest so far where the system reports no present value."""
    if STATEMENT.exists():
        return float(STATEMENT.read_text().split()[1]) * resource.getpagesize()
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * (1.0 if sys.platform == "darwin" else 1024.0)


def watched(count: int, every: Callable[[Callable[[], None]], None]) -> dict[str, Any]:
    """Growth of memory [bytes] and processor time [s] over `count` calls."""
    # Allocated and written before, so that the notes themselves do not grow.
    memory, stamps, done = np.ones(count), np.ones(count), 0

    def note() -> None:
        nonlocal done
        memory[done], stamps[done], done = resident(), process_time(), done + 1

    every(note)
    memory, stamps = memory[:done], stamps[:done]
    half, quarter = len(memory) // 2, max(len(memory) // 4, 2)
    spent = np.diff(stamps)
    growth = float(np.polyfit(np.arange(half, len(memory)), memory[half:], 1)[0]) if len(memory) - half > 1 else 0.0
    picked = np.unique(np.linspace(0, len(memory) - 1, 100).astype(int))
    return {
        "calls": len(memory),
        "growth_bytes": growth,
        "first_quarter_us": 1e6 * float(np.median(spent[:quarter])),
        "last_quarter_us": 1e6 * float(np.median(spent[-quarter:])),
        "at": picked.tolist(),
        "mebibytes": (memory[picked] / 2**20).tolist(),
        "largest_mebibytes": float(memory.max()) / 2**20,
    }


def deciding(count: int) -> dict[str, Any]:
    """One robot in the roundabout, repeatedly, without recording."""
    scenario = gallery.build("roundabout_crossing")
    navigator, robot, dt = scenario.decider(method("nao")), scenario.robot, scenario.dt
    obstacles = ObstacleTable(scenario.obstacles)

    def run(note: Callable[[], None]) -> None:
        state, decision, now = robot.state, None, 0.0
        for _ in range(count):
            decision = navigator.decide(state, obstacles, robot.goal, now=now, previous=decision)
            applied = decision.manoeuvre.mean_acceleration(now, dt)
            state, now = State(*integrate(state.position, state.velocity, applied, dt), applied), now + dt
            if now >= CARS_TIME:
                state, decision, now = robot.state, None, 0.0
            note()

    return watched(count, run)


def held(run: Recording) -> float:
    """Size of a recording per robot and step [bytes]: its arrays, and a reference per text."""
    values = [getattr(run, field.name) for field in fields(run)]
    arrays = sum(value.nbytes for value in values if isinstance(value, np.ndarray))
    cells = run.accelerations.shape[0] * run.accelerations.shape[1]
    return arrays / cells + 2.0 * 8.0


def stepping(name: str, robots: int, seconds: float) -> dict[str, Any]:
    """A recorded run of a fleet over `seconds`."""
    scenario, chosen, runs = fleet(robots, seconds, ROOM), method(name), []

    def run(note: Callable[[], None]) -> None:
        runs.append(simulate(scenario, chosen, progress=lambda _: note()))

    found = watched(round(seconds / DT), run)
    return {**found, "growth_per_robot": found["growth_bytes"] / robots, "held_per_robot": held(runs[0])}


def unrecorded(name: str, robots: int, steps: int) -> dict[str, Any]:
    """A run of a fleet over `steps` of which only the end is kept."""
    scenario, chosen = fleet(robots, steps * DT, ROOM), method(name)
    found = watched(steps, lambda note: simulate(scenario, chosen, progress=lambda _: note(), record=False))
    return {**found, "growth_per_robot": found["growth_bytes"] / robots, "held_per_robot": 0.0}


def apart(call: Callable[..., dict[str, Any]], *arguments: object) -> dict[str, Any]:
    """The result of a call in a new process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(call, *arguments).result()


def measure(decisions: int, robots: int, seconds: float, many: int, steps: int) -> dict[str, Any]:
    """Each in a process of its own, since memory freed by one would serve the next."""
    alone = apart(deciding, decisions)
    fleets = {name: apart(stepping, name, robots, seconds) for name in ("nao", "nao_shared")}
    large = {name: apart(unrecorded, name, many, steps) for name in fleets}
    heads = ["what", "calls", "growth, bytes a call", "first quarter, median us", "last quarter, median us"]
    rows = [
        [what, r["calls"], r["growth_bytes"], r["first_quarter_us"], r["last_quarter_us"], r["largest_mebibytes"]]
        for what, r in (
            ("one robot, decisions", alone),
            *((f"{k}, steps of {robots}", r) for k, r in fleets.items()),
            *((f"{k}, steps of {many}, not recorded", r) for k, r in large.items()),
        )
    ]
    kept = [
        [f"{k}, {what}", r["growth_per_robot"], r["held_per_robot"]]
        for what, runs in ((f"{robots}", fleets), (f"{many}, not recorded", large))
        for k, r in runs.items()
    ]
    slower = max(r["last_quarter_us"] / r["first_quarter_us"] for r in (alone, *fleets.values()))
    excess = max(r["growth_per_robot"] - r["held_per_robot"] for r in fleets.values())
    return {
        "question": "Growth of memory and of the time per step",
        "parameters": {
            "decisions": decisions,
            "robots": robots,
            "seconds": seconds,
            "many": many,
            "steps": steps,
            "room_m2": ROOM,
        },
        "tables": [
            table("Memory and time over many calls", [*heads, "largest resident MiB"], rows),
            table(
                "Growth of a run, per robot and step",
                ["method, robots", "growth of memory, bytes", "size of the recording, bytes"],
                kept,
            ),
        ],
        "targets": [
            target("growth per decision of one robot", alone["growth_bytes"], most=64.0, unit="bytes"),
            target("growth per robot and step beyond the recording", excess, most=256.0, unit="bytes"),
            target(
                "growth per robot and step of a run that is not recorded",
                max(r["growth_per_robot"] for r in large.values()),
                most=8.0,
                unit="bytes",
            ),
            target("the last quarter of calls over the first, median processor time", slower, most=1.5),
        ],
        "results": {"decisions": alone, "fleets": fleets, "unrecorded": large},
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--decisions", type=int, default=20000)
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--many", type=int, default=3000)
    parser.add_argument("--steps", type=int, default=60)
    arguments = parser.parse_args()
    quick = arguments.quick
    a = arguments
    sizes = (40, 5, 1.0, 30, 10) if quick else (a.decisions, a.robots, a.seconds, a.many, a.steps)
    finish("memory", measure(*sizes), arguments)


if __name__ == "__main__":
    main()
