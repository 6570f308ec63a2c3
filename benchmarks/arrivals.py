"""Fleets whose robots publish manoeuvres: how many arrive, and how many touch, with and without guidance.

usage: python benchmarks/arrivals.py [--scenes circle sphere crossing doorway] [--robots 2 ...] [--seeds 20] [--quick]

Robots of 0.3 m with at most 1.5 m/s and 2 m/s^2. `circle`: they change sides, with starts displaced by 1 cm. `sphere`:
balls at random places of a sphere change sides, all through its centre. `crossing`: random starts and goals in a square
of which the robots cover 6 %. `doorway`: random starts and goals in two rooms, half of the robots in each direction
through a door of 1.4 m; without guidance they follow paths through it. Clearances are those of the simulator's metrics,
in continuous time. Runs of the seeds from --first on are reported.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from program import finish, options, table, target

from slalom import Ball, Disc, Goal, Limits, PathGoal, State, Stationary, method
from slalom.sim import Robot, Scenario, gallery, metrics, simulate
from slalom.sim.placement import equal_robots, on_circle, random_positions

SHAPE, LIMITS, TOLERANCE = Disc(0.3), Limits(1.5, 2.0), 0.3
COVERED, DURATION = 0.06, 240.0
SIZES = (2, 3, 4, 6, 8, 10, 20, 50)


def circle(n: int, rng: np.random.Generator) -> Scenario:
    """Robots on a circle that change sides."""
    places = on_circle(2.0 * np.pi * np.arange(n) / n, max(3.0, 0.3 * n))
    starts = places + rng.normal(0.0, 0.01, places.shape)
    return Scenario("circle", equal_robots(starts, -places, SHAPE, LIMITS, TOLERANCE), duration=DURATION)


def sphere(n: int, rng: np.random.Generator) -> Scenario:
    """Balls on a sphere that change sides, at least 1.2 m apart; two of them one above the other."""
    radius, places = max(3.0, 0.9 * np.sqrt(n)), np.array([(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
    while len(places) < n:
        one = rng.normal(size=3)
        one /= np.linalg.norm(one)
        if radius * np.linalg.norm(places - one, axis=1).min() >= 1.2:
            places = np.vstack([places, one])
    robots = tuple(
        Robot(Ball(0.3), LIMITS, State(p, np.zeros(3)), Goal(Stationary(-p), TOLERANCE, stop=True), f"robot {k}")
        for k, p in enumerate(radius * places)
    )
    return Scenario("sphere", robots, duration=DURATION)


def crossing(n: int, rng: np.random.Generator) -> Scenario:
    """Random starts and goals in a square."""
    half = 0.5 * np.sqrt(n * np.pi * 0.3**2 / COVERED) + 0.5
    starts, goals = (random_positions(n, (-half, -half), (half, half), 0.8, rng) for _ in range(2))
    return Scenario("crossing", equal_robots(starts, goals, SHAPE, LIMITS, TOLERANCE), duration=DURATION)


def doorway(n: int, rng: np.random.Generator) -> Scenario:
    """Two rooms with a door between them."""
    built = gallery.build(
        "doorway", {"robots": n, "both": 1.0, "room": max(8.0, 1.5 * np.sqrt(n))}, seed=int(rng.integers(1 << 30))
    )
    return replace(built, duration=DURATION, holds=Scenario.holds)


def along_paths(scenario: Scenario) -> Scenario:
    """The doorway with paths through the door in place of goals."""
    robots = []
    for robot in scenario.robots:
        begin, end = robot.state.position, robot.goal.position(0.0)
        side = np.sign(begin[0])
        way = [begin, (side, 0.0), (-side, 0.0), end]
        robots.append(replace(robot, goal=PathGoal(way, tolerance=robot.goal.tolerance)))
    return replace(scenario, robots=tuple(robots))


SCENES: dict[str, Callable[[int, np.random.Generator], Scenario]] = {
    "circle": circle,
    "sphere": sphere,
    "crossing": crossing,
    "doorway": doorway,
}


def measured(name: str, n: int, seeds: range, guided: bool) -> tuple[int, int, int, float, float]:
    """Runs, those in which all arrived, contacts, the mean last arrival [s] of these, the least clearance [m]."""
    times, contacts, least = [], 0, np.inf
    for seed in seeds:
        scenario = replace(SCENES[name](n, np.random.default_rng([seed, n])), guided=guided)
        if name == "doorway" and not guided:
            scenario = along_paths(scenario)
        run = simulate(scenario, method("nao_shared"), seed=seed)
        contacts += int(metrics.collisions(run))
        least = min(least, metrics.min_clearance(run))
        times += [float(metrics.time(run))] if metrics.arrived(run) else []
    return len(seeds), len(times), contacts, float(np.mean(times)) if times else np.nan, float(least)


def compare(arguments: argparse.Namespace) -> dict[str, Any]:
    """Tables and targets."""
    seeds = range(arguments.first, arguments.first + (1 if arguments.quick else arguments.seeds))
    rows, lost, contacts = [], 0, 0
    for name in arguments.scenes:
        for n in (2, 3) if arguments.quick else arguments.robots:
            for guided in arguments.guided:
                if guided and name == "sphere":
                    continue
                runs, arrived, touched, time, least = measured(name, n, seeds, bool(guided))
                rows.append([name, n, "yes" if guided else "no", runs, arrived, touched, time, least])
                print(*rows[-1], flush=True)
                if not guided:
                    lost, contacts = lost + runs - arrived, contacts + touched
    heads = ["scene", "robots", "guided", "runs", "all arrived", "contacts", "last arrival s", "least clearance m"]
    return {
        "question": "Do all robots of a fleet arrive that publish manoeuvres, without guidance?",
        "tables": [table("Fleets of nao_shared", heads, rows)],
        "targets": [
            target("runs in which a robot did not arrive", lost, most=0.0),
            target("contacts", contacts, most=0.0),
        ],
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--robots", nargs="+", type=int, default=SIZES)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--guided", nargs="+", type=int, default=(0, 1), choices=(0, 1))
    given = parser.parse_args()
    finish("arrivals", compare(given), given)
