"""The cost of one decision in a town: 1000 wall segments at rest and 30 moving obstacles, half of them turning cars.

usage: python benchmarks/walls.py [--scenes 300] [--out FOLDER]

Times are the median and the 99th percentile over random states. The rows are the bodies, made once per decision, the
segments of one response, the exact choice, and the sum of these. They are given with and without walls.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from machine import microseconds, write

from slalom import (
    AccelerateThenCoast,
    Circular,
    ControlObstacle,
    Disc,
    Limits,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    Polyline,
    Rectangle,
    State,
    Stationary,
    Union,
    kernels,
    select,
)

HORIZON, ROBOT = 6.0, Disc(0.3)
LIMITS, RESPONSE = Limits(3.0, 2.0), AccelerateThenCoast(1.0)


def town(rng: np.random.Generator) -> Obstacle:
    """250 houses of four walls each on 120 m x 120 m, with a free square in the middle."""
    houses = []
    while len(houses) < 250:
        position, angle = rng.uniform(-60.0, 60.0, 2), rng.uniform(0.0, 2.0 * np.pi)
        width, depth = rng.uniform(1.0, 4.0, 2)
        corners = np.array([[-width, -depth], [width, -depth], [width, depth], [-width, depth], [-width, -depth]])
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        if np.linalg.norm(position) > 8.0:
            houses.append(Polyline(corners @ turn + position, 0.05))
    return Obstacle(Union(tuple(houses)), Stationary((0.0, 0.0)), "town")


def movers(rng: np.random.Generator) -> list[Obstacle]:
    """Fifteen people and fifteen cars that turn with their motion, on circles."""
    paths = [
        Circular(rng.uniform(-30, 30, 2), rng.uniform(5, 20), rng.uniform(1, 4), rng.uniform(0, 6)) for _ in range(30)
    ]
    return [
        Obstacle(Rectangle(4.0, 1.8) if k % 2 else Disc(0.3), path, heading="motion") for k, path in enumerate(paths)
    ]


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"))
    arguments = parser.parse_args()
    rng = np.random.default_rng(0)
    walls, others = [town(rng)], movers(rng)
    table = {}
    print(f"{'':44}{'median us':>12}{'99 % us':>12}")
    scenes = {"town and movers": ObstacleTable(walls + others), "movers alone": ObstacleTable(others)}
    for name, obstacles in scenes.items():
        spent: dict[str, list[float]] = {"obstacles to bodies": [], "bodies to segments": [], "select": [], "whole": []}
        statuses: dict[str, int] = {}
        for k in range(arguments.scenes):
            state, now = State(rng.uniform(-1, 1, 2), rng.uniform(-1.5, 1.5, 2)), 0.1 * k
            admissible, wanted = LIMITS.admissible(RESPONSE, state, HORIZON), rng.uniform(-2, 2, 2)

            def bodies(now: float = now, obstacles: ObstacleTable = obstacles) -> ObstacleWindow:
                window = ObstacleWindow(obstacles, now, HORIZON)
                window.bodies(ROBOT)
                return window

            def blocked(table: ObstacleWindow, state: State = state) -> ControlObstacle:
                fresh = ControlObstacle(RESPONSE, state, table, ROBOT)
                fresh.segments  # noqa: B018  computed at first use
                return fresh

            made = bodies()
            found = blocked(made)
            choice = select(wanted, admissible, found)
            statuses[choice.status.name] = statuses.get(choice.status.name, 0) + 1
            spent["obstacles to bodies"].append(microseconds(bodies, 3))
            spent["bodies to segments"].append(microseconds(lambda t=made, f=blocked: f(t), 3))  # type: ignore[misc]
            spent["select"].append(microseconds(lambda f=found, a=admissible, w=wanted: select(w, a, f), 5))  # type: ignore[misc]
            spent["whole"].append(
                spent["obstacles to bodies"][-1] + spent["bodies to segments"][-1] + spent["select"][-1]
            )
        for what, times in spent.items():
            median, late = (float(q) for q in np.quantile(times, [0.5, 0.99]))
            table[f"{name}: {what}"] = {"median_us": median, "p99_us": late}
            print(f"{name + ': ' + what:44}{median:>12.1f}{late:>12.1f}")
        print(f"{'':4}{statuses}")
    result = {"question": "one decision, 1000 static segments and 30 moving obstacles, 6 s", "rows": table}
    print("written:", write("walls", {**result, "finished": time.strftime("%Y-%m-%d")}, arguments.out))


if __name__ == "__main__":
    kernels.nearest_free  # noqa: B018  the import of numba is not part of any measurement
    main()
