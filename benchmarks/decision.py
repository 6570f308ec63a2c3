"""The cost of one decision: 30 cars in the paper's roundabout, 6 s horizon, called from Python.

usage: python benchmarks/decision.py [--scenes 300] [--out FOLDER]

Times are the median and the 99th percentile over the scenes. Each is also given as a ratio to one pass of the chord
test over all segments in the same run. The scenes are states from crossings by nao, so they are typical. `select_many`
decides for robots in all these states among the cars of one scene.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from machine import microseconds, write

from slalom import (
    AccelerateThenCoast,
    ControlObstacle,
    ObstacleTable,
    ObstacleWindow,
    State,
    kernels,
    method,
    select,
    select_many,
)
from slalom.decision.objective import Arrive, Situation, preferred_control
from slalom.sim import gallery, simulate

HORIZON = 6.0


def situations(scenes: int) -> list[tuple[ControlObstacle, Situation, np.ndarray]]:
    """Control obstacles, situations and preferred controls at random moments of crossings."""
    rng = np.random.default_rng(0)
    found = []
    response = AccelerateThenCoast(1.0)
    for seed in range((scenes + 29) // 30):
        scenario = gallery.build("roundabout_crossing", seed=seed)
        run, cars = simulate(scenario, method("nao"), seed=seed), ObstacleTable(scenario.obstacles)
        for k in rng.integers(0, len(run.accelerations), 30):
            state = State(run.positions[k, 0], run.velocities[k, 0], run.acceleration_before(int(k)))
            table = ObstacleWindow(cars, float(run.times[k]), HORIZON)
            blocked = ControlObstacle(response, state, table, scenario.robot.shape, scenario.margin * 0.5)
            limits = scenario.robot.limits
            now = float(run.times[k])
            situation = Situation(response, state, scenario.robot.goal, limits, now, HORIZON, 0.1, 0.2)
            found.append((blocked, situation, preferred_control(Arrive().aims(situation))))
    return found[:scenes]


def one_pass(blocked: ControlObstacle) -> float:
    """Time of one pass of the chord test over all segments [us]."""
    from slalom.kernels.relative_motion.segments import chord_distances

    s = blocked.segments.table
    gaps = np.empty(len(s.radius))
    return microseconds(lambda: chord_distances(s.points, s.gains, 1.0, 0.5, 0.0, gaps), 200)


def many(scenes: list[tuple[ControlObstacle, Situation, np.ndarray]], threads: int) -> list[float]:
    """Time of each decision [us] when robots in the states of all scenes decide among the cars of one, of many scenes.

    From states to controls: the pieces of the cars are shared; each robot has its own segments.
    """
    states = [situation.state for _, situation, _ in scenes]
    preferred = np.array([each for _, _, each in scenes])
    spent = []
    for blocked, situation, _ in scenes[::10]:
        common = (blocked.response, situation.limits, blocked.obstacles, blocked.robot)

        def all_at_once(common: tuple = common) -> object:
            return select_many(preferred, states, *common, margin=float(blocked.margin), threads=threads)  # noqa: B023

        spent.append(microseconds(all_at_once, 3) / len(states))
    return spent


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"))
    arguments = parser.parse_args()
    scenes = situations(arguments.scenes)
    passes = float(np.median([one_pass(blocked) for blocked, _, _ in scenes[:20]]))
    rows: dict[str, list[float]] = {"obstacles to pieces": [], "pieces to segments": [], "select": []}
    statuses: dict[str, int] = {}
    for blocked, situation, preferred in scenes:
        obstacles = blocked.obstacles
        rows["obstacles to pieces"].append(
            microseconds(lambda t=obstacles, r=blocked.robot: t.within(t.until).bodies(r), 5)  # type: ignore[misc]
        )

        def fresh(blocked: ControlObstacle = blocked) -> object:
            return ControlObstacle(blocked.response, blocked.state, blocked.obstacles, blocked.robot).segments

        rows["pieces to segments"].append(microseconds(fresh, 5))
        rows["select"].append(microseconds(lambda: select(preferred, situation.admissible, blocked), 15))  # noqa: B023
        name = select(preferred, situation.admissible, blocked).status.name
        statuses[name] = statuses.get(name, 0) + 1
    rows["select_many, states to controls, each"] = many(scenes, 1)
    rows[f"the same in {kernels.threads()} threads"] = many(scenes, kernels.threads())
    segments = float(np.median([len(blocked.segments.begin) for blocked, _, _ in scenes]))
    print(f"{len(scenes)} scenes of 30 cars, {segments:.0f} segments, {statuses}")
    print(f"{'':40}{'median us':>12}{'99 % us':>12}{'median / pass':>16}")
    print(f"{'one pass, chord test':40}{passes:>12.1f}{'':>12}{1.0:>16.1f}")
    table = {}
    for name, spent in rows.items():
        median, late = (float(q) for q in np.quantile(spent, [0.5, 0.99]))
        table[name] = {"median_us": median, "p99_us": late, "median_per_pass": median / passes}
        print(f"{name:40}{median:>12.1f}{late:>12.1f}{median / passes:>16.1f}")
    result = {"question": "one decision, 30 cars, 6 s", "pass_us": passes, "statuses": statuses, "rows": table}
    print("written:", write("decision", {**result, "finished": time.strftime("%Y-%m-%d")}, arguments.out))


if __name__ == "__main__":
    kernels.nearest_free  # noqa: B018  the import of numba is not part of any measurement
    main()
