"""A step of a fleet compared with fleets of other projects, and one minute of the scenario `ring` with 50 robots.

usage: python benchmarks/fleet_step.py [--robots 1000] [--steps 200] [--quick] [--out FOLDER]

Robots of 0.5 m have random goals and 100 m^2 each. About 10 others are thus within reach of each robot during the
horizon of 6 s. All programs start from the same positions and run by turns. The start is the first 8
steps; while driving are the steps of the second half, from the positions that the program itself has brought about.
RVO2 (pyrvo) has 10 neighbours within 15 m and a horizon of 5 s. It is timed alone, and with the preferred velocities
that a Python program has to set. ORCA and the human-like behaviour run in navground's own world with the same 15 m. The
peers use single precision and no limits on acceleration. The times of slalom include the exact motion, the guidance and
the recording. Needs the packages pyrvo and navground.
"""

import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
from pace import DT, fleet, steps
from program import finish, options, table, target

from slalom import Method, method
from slalom.sim import Scenario, gallery, simulate

NEIGHBOURS, RANGE, TIME_HORIZON, RADIUS, SPEED = 10, 15.0, 5.0, 0.5, 1.5
MINUTE, ROUNDS, FIRST = 60.0, 3, 8
PEER = "pyrvo, ORCA, set from Python"
MOST = {"nao": 2.5, "nao_shared": 3.0}
"""Largest ratio to PEER."""


def times_of(step: Callable[[], object], count: int) -> np.ndarray:
    """Wall clock of each of `count` steps except the first [s]."""
    stamps = [perf_counter()]
    for _ in range(count):
        step()
        stamps.append(perf_counter())
    return np.diff(stamps)[1:]


def positions_of(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Starts and goals (n, 2) [m]."""
    starts = np.array([robot.state.position for robot in scenario.robots])
    return starts, np.array([robot.goal.position(0.0) for robot in scenario.robots])


def rvo2(scenario: Scenario, count: int) -> tuple[np.ndarray, np.ndarray]:
    """RVO2: its step alone, and with preferred velocities set and positions read [s]."""
    from pyrvo import RVOSimulator

    starts, goals = positions_of(scenario)
    simulator = RVOSimulator(DT, RANGE, NEIGHBOURS, TIME_HORIZON, TIME_HORIZON, RADIUS, SPEED)
    for start in starts:
        simulator.add_agent(tuple(start))
    alone, n = [], len(starts)

    def step() -> None:
        away = goals - np.array([simulator.get_agent_position(k).to_tuple() for k in range(n)])
        far = np.linalg.norm(away, axis=1, keepdims=True)
        preferred = away * np.minimum(SPEED / np.maximum(far, 1e-9), 1.0)
        for k in range(n):
            simulator.set_agent_pref_velocity(k, tuple(preferred[k]))
        before = perf_counter()
        simulator.do_step()
        alone.append(perf_counter() - before)

    return times_of(step, count), np.array(alone[1:])


def navground(scenario: Scenario, kind: str, count: int) -> np.ndarray:
    """A behaviour of navground in its own world [s]."""
    from navground import core, sim

    world = sim.World()
    for start, goal in zip(*positions_of(scenario)):
        behavior = core.Behavior.make_type(kind)
        kinematics = core.kinematics.OmnidirectionalKinematics(SPEED)
        if kind == "ORCA":
            behavior.set("max_neighbors", NEIGHBOURS)
            behavior.set("time_horizon", TIME_HORIZON)
        task = sim.tasks.WaypointsTask([tuple(goal)], loop=False, tolerance=0.3)
        sight = sim.state_estimations.BoundedStateEstimation(range=RANGE)
        agent = sim.Agent(RADIUS, behavior, kinematics, task, [sight], DT)
        behavior.optimal_speed, behavior.horizon = SPEED, RANGE
        agent.position = start
        world.add_agent(agent)
    return times_of(lambda: world.update(DT), count)


def minute(chosen: Method, seconds: float, robots: int) -> dict[str, float]:
    """The scenario `ring`: wall clock [s], simulated time until all arrived [s], and wall clock per minute [s]."""
    scenario = gallery.build("ring", {"robots": robots, "duration": seconds})
    spent = []
    for _ in range(2):
        before = perf_counter()
        run = simulate(scenario, chosen)
        spent.append(perf_counter() - before)
    simulated = float(run.times[-1])
    return {"wall_s": min(spent), "simulated_s": simulated, "wall_s_per_minute": min(spent) * MINUTE / simulated}


def turn(scenario: Scenario, ours: dict[str, Method], count: int) -> dict[str, np.ndarray]:
    """Times of `count` steps of each program [s]."""
    spent = {f"slalom {name}": steps(scenario, chosen)[0] for name, chosen in ours.items()}
    spent[PEER], spent["pyrvo, ORCA, its step alone"] = rvo2(scenario, count)
    spent["navground, ORCA"] = navground(scenario, "ORCA", count)
    spent["navground, human-like"] = navground(scenario, "HL", count)
    return spent


def measure(robots: int, count: int, ring: int, seconds: float) -> dict[str, Any]:
    """All programs on the same robots, one after the other."""
    scenario = fleet(robots, (count + 1) * DT)
    ours = {name: method(name) for name in ("nao", "nao_shared")}
    for chosen in ours.values():
        steps(fleet(5, 3 * DT), chosen)
    # By turns, so that other load of the machine affects all programs.
    rounds = [turn(scenario, ours, count) for _ in range(ROUNDS)]
    parts = {"at the start": slice(FIRST), "while driving": slice(count // 2, None)}
    each = {
        part: {name: 1e6 * float(np.median([r[name][rows] for r in rounds])) / robots for name in rounds[0]}
        for part, rows in parts.items()
    }
    ratios = {part: {name: us / of[PEER] for name, us in of.items()} for part, of in each.items()}
    rings = {name: minute(chosen, seconds, ring) for name, chosen in ours.items()}
    heads = ["method", "wall s", "simulated s until all arrived", "wall s per minute"]
    return {
        "question": "A step of a fleet compared with fleets of other projects",
        "parameters": {
            "robots": robots,
            "steps": count,
            "rounds": ROUNDS,
            "neighbours": NEIGHBOURS,
            "sight_m": RANGE,
            "ring": ring,
        },
        "tables": [
            table(
                "One step, per robot",
                ["what", *(f"{part}, {what}" for part in parts for what in ("median us", "ratio to pyrvo"))],
                [[name, *(of[part][name] for part in parts for of in (each, ratios))] for name in rounds[0]],
            ),
            table(
                f"The scenario ring with {ring} robots, from Python",
                heads,
                [[name, *r.values()] for name, r in rings.items()],
            ),
        ],
        "targets": [
            *(
                target(f"a step of {name} over pyrvo's, set from Python, {part}", of[f"slalom {name}"], most=most)
                for part, of in ratios.items()
                for name, most in MOST.items()
            ),
            *(
                target(
                    f"a minute of the scenario ring with {ring} robots, {name}",
                    r["wall_s_per_minute"],
                    most=0.5,
                    unit="s",
                )
                for name, r in rings.items()
            ),
        ],
        "results": {"us_per_robot": each, "ring": rings},
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--robots", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=200)
    arguments = parser.parse_args()
    try:
        import navground.core  # noqa: F401
        import pyrvo  # noqa: F401
    except ImportError as error:
        sys.exit(f"benchmarks/fleet_step.py needs pyrvo and navground: pip install 'slalom[peers]' ({error})")
    quick = arguments.quick
    result = measure(*((10, 4, 4, 1.0) if quick else (arguments.robots, arguments.steps, 50, MINUTE)))
    finish("fleet_step", result, arguments, ["pyrvo", "navground"])


if __name__ == "__main__":
    main()
