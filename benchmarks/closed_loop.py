"""Time of `Navigator.decide` called from Python in closed loop: traffic that is known, robots observed anew, a town.

usage: python benchmarks/closed_loop.py [--quick] [--out FOLDER]

Each row is a robot that carries out its decisions with nao at 10 Hz, over several seeds. Obstacles with known
trajectories come as one table, which is made before. Others come as tracks of the present states at each decision.
Times are processor times of single decisions; the first one of each run is left out, since it makes the pieces of the
table.
"""

import time
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from program import finish, options, table, target
from walls import movers, town

import slalom
from slalom import Disc, Goal, Limits, Navigator, ObstacleTable, State, Stationary, Tracks
from slalom.sim import gallery

DT = 0.1
Around = Callable[[float], tuple[list[Any], Tracks | None]]
"""Obstacles, and other robots if there are any, at a time [s]."""


class Crossing(NamedTuple):
    """A robot before its first decision, and what is around it."""

    robot: Navigator
    state: State
    goal: Goal
    start: float  # [s]
    around: Around


def drive(crossing: Crossing, steps: int) -> list[float]:
    """Processor times [s] of the decisions of one run, which ends at the goal."""
    robot, state, goal, now, around = crossing
    spent: list[float] = []
    decision = None
    for _ in range(steps):
        obstacles, others = around(now)
        before = time.process_time()
        decision = robot.decide(state, obstacles, goal, robots=others, now=now, previous=decision)
        spent.append(time.process_time() - before)
        a = decision.manoeuvre.mean_acceleration(now, DT)
        state = State(state.position + DT * state.velocity + 0.5 * DT**2 * a, state.velocity + DT * a, a)
        now += DT
        if np.linalg.norm(state.position - goal.position(now)) <= goal.tolerance:
            break
    return spent[1:]


def of_gallery(name: str, seeds: int) -> Iterable[Crossing]:
    """Crossings of a scenario of the gallery with one robot."""
    for seed in range(seeds):
        scenario = gallery.build(name, seed=seed)
        one, known = scenario.robot, ObstacleTable(scenario.obstacles)
        robot = Navigator(
            *(slalom.method("nao"), one.shape, one.limits), horizon=scenario.horizon, margin=scenario.margin
        )
        yield Crossing(robot, one.state, one.goal, scenario.start, lambda now, t=known: ([t], None))


def among(count: int, seeds: int) -> Iterable[Crossing]:
    """Crossings among robots that move straight on and are observed anew at each decision."""
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        side = 5.0 * np.sqrt(count)
        places, velocities = rng.uniform(-side, side, (count, 2)), rng.uniform(-1.0, 1.0, (count, 2))
        robot = Navigator(slalom.method("nao"), Disc(0.3), Limits(1.5, 2.0))
        goal = Goal(Stationary((side, 0.0)), 0.3, stop=True)

        def seen(now: float, places: np.ndarray = places, velocities: np.ndarray = velocities) -> tuple[list, Tracks]:
            return [], Tracks(places + now * velocities, velocities, 0.3, now)

        yield Crossing(robot, State((-side, 0.0), (1.0, 0.0)), goal, 0.0, seen)


def of_town(seeds: int) -> Iterable[Crossing]:
    """Crossings of a town of 1000 wall segments and 30 moving bodies."""
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        known = ObstacleTable([town(rng), *movers(rng)])
        robot = Navigator(slalom.method("nao"), Disc(0.3), Limits(3.0, 2.0))
        goal = Goal(Stationary((30.0, 5.0)), 0.5, stop=True)
        yield Crossing(robot, State((0.0, 0.0), (1.0, 0.0)), goal, 0.0, lambda now, t=known: ([t], None))


def main() -> None:
    """Measure, print, write."""
    arguments = options(__doc__).parse_args()
    seeds, steps = (1, 5) if arguments.quick else (8, 300)
    rows, targets = [], []
    for name, crossings, median, late in (
        ("roundabout_crossing", of_gallery("roundabout_crossing", seeds), 170.0, 700.0),
        ("recorded_roundabout", of_gallery("recorded_roundabout", seeds), 100.0, 700.0),
        ("10 robots observed anew", among(10, seeds), 100.0, None),
        ("40 robots observed anew", among(40, seeds), 300.0, None),
        ("town, 1000 walls, 30 moving", of_town(seeds), 350.0, 1000.0),
    ):
        made = 1e6 * np.array([spent for one in crossings for spent in drive(one, steps)])
        middle, most = (float(q) for q in np.quantile(made, [0.5, 0.99]))
        rows.append([name, len(made), middle, most])
        targets += [target(f"{name}, median", middle, most=median, unit="us")] if median else []
        targets += [target(f"{name}, 99 %", most, most=late, unit="us")] if late else []
    result = {
        "question": "Time of Navigator.decide in closed loop, called from Python.",
        "parameters": {"seeds": seeds, "steps": steps},
        "tables": [table("nao, 10 decisions a second:", ["scene", "decisions", "median us", "99 % us"], rows)],
        "targets": targets,
    }
    finish("closed_loop", result, arguments)


if __name__ == "__main__":
    main()
