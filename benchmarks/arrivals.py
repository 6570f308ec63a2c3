"""Fleets whose robots publish manoeuvres: how many arrive, and how many touch, with and without guidance.

usage: python benchmarks/arrivals.py [--scenes circle sphere crossing doorway building] [--robots 2 ...] [--seeds 20]
       [--first 0] [--guided 0 1] [--quick]

Robots of 0.3 m with at most 1.5 m/s and 2 m/s^2. `circle`: they change sides, with starts displaced by 1 cm. `sphere`:
balls at random places of a sphere change sides, all through its centre. `crossing`: random starts and goals in a square
of which the robots cover 6 %. `doorway`: random starts and goals in two rooms, half of the robots in each direction
through a door of 1.4 m; without guidance they follow paths through it. `building`: agents of 0.2 to 0.3 m and 0.9 to
1.5 m/s in six rooms of 10 x 8 m go to another one, through doors of 1.3 m and a corridor of 4 m; without guidance by
routes through the doors. Clearances are those of the simulator's metrics, in continuous time. Steps per second include
the first step, which loads kernels. Runs of the seeds from --first on are reported.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from building import along_routes, building
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
    "building": building,
}
PATHS = {"doorway": along_paths, "building": along_routes}
"""How robots are led without guidance."""


def measured(name: str, n: int, seeds: range, guided: bool) -> tuple[int, int, int, float, float, float]:
    """Runs, those in which all arrived, contacts, mean last arrival [s] of these, least clearance [m], steps/s."""
    times, rates, contacts, least = [], list[float](), 0, np.inf
    for seed in seeds:
        scenario = replace(SCENES[name](n, np.random.default_rng([seed, n])), guided=guided)
        if name in PATHS and not guided:
            scenario = PATHS[name](scenario)
        before = perf_counter()
        run = simulate(scenario, method("nao_shared"), seed=seed)
        rates.append((len(run.times) - 1) / (perf_counter() - before))
        contacts += int(metrics.collisions(run))
        least = min(least, metrics.min_clearance(run))
        times += [float(metrics.time(run))] if metrics.arrived(run) else []
    return len(seeds), len(times), contacts, float(np.mean(times)) if times else np.nan, float(least), min(rates)


def compare(arguments: argparse.Namespace) -> dict[str, Any]:
    """Tables and targets."""
    seeds = range(arguments.first, arguments.first + (1 if arguments.quick else arguments.seeds))
    rows, lost, contacts, rates = [], 0, 0, list[float]()
    for name in arguments.scenes:
        for n in (2,) if arguments.quick else arguments.robots:
            for guided in arguments.guided:
                if guided and name == "sphere":
                    continue
                runs, arrived, touched, time, least, rate = measured(name, n, seeds, bool(guided))
                rows.append([name, n, "yes" if guided else "no", runs, arrived, touched, time, least, rate])
                print(*rows[-1], flush=True)
                if not guided or name == "building":
                    lost, contacts = lost + runs - arrived, contacts + touched
                if guided and name == "building":
                    rates.append(rate)
    heads = ["scene", "robots", "guided", "runs", "all arrived", "contacts", "last arrival s"]
    heads += ["least clearance m", "least steps/s"]
    return {
        "question": "Do all robots arrive that publish manoeuvres: guided in a building, elsewhere without guidance?",
        "tables": [table("Fleets of nao_shared", heads, rows)],
        "targets": [
            target("runs in which a robot did not arrive", lost, most=0.0),
            target("contacts", contacts, most=0.0),
        ]
        + ([target("steps in the building, guided", min(rates), least=20.0, unit="1/s")] if rates else []),
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
