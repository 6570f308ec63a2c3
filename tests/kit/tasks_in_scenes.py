"""Tasks in small scenes, and those that are refused: the message and the call."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from slalom import Ball, Disc, Goal, Limits, Obstacle, Polyline, State, Stationary
from slalom.sim import Drawn, Recording, Robot, Scenario, Station, Task, Tasks, simulate
from slalom.sim.files.scenario_writer import scenario_text

STATIONS = (Station("a", (0, 0), service=3.0), Station("b", (8, 0), 2, Drawn(1.0, 4.0, 7)), Station("c", (4, 7)))


def robots(count: int, **given: Any) -> tuple[Robot, ...]:
    homes = [(-2.0 + 2.0 * k, -4.0) for k in range(count)]
    return tuple(
        Robot(Disc(0.3), Limits(1.5, 2.0), State(at, (0, 0)), Goal(Stationary(at), 0.2, True), f"r{k}", **given)
        for k, at in enumerate(homes)
    )


def scene(tasks: Tasks, count: int = 4, **settings: Any) -> Scenario:
    return Scenario("tasks", robots(count), tasks=tasks, **{"duration": 60.0, "horizon": 6.0, **settings})


def other_robot(folder: Path) -> object:
    """A recording whose task names a robot that it does not have."""
    found = simulate(scene(Tasks(STATIONS, (Task(0.0, "a", "b"),)), 2, duration=0.2), "nao")
    replace(found, tasks=np.full((1, 11), 9.0)).save(folder / "run.h5")
    return Recording.load(folder / "run.h5")


def newest_by_last(now: float, waiting: Any, free: Any) -> list[tuple[Task, str]]:
    return [(waiting[-1], max(free))]


def other_pairs(now: float, waiting: Any, free: Any) -> list[Any]:
    return [(waiting[0], "nobody")]


def with_tasks(*stations: Station, obstacles: Any = (), count: int = 2, **tasks: Any) -> Callable[[Path], object]:
    return lambda _: scene(Tasks(stations or STATIONS, **{"rate": 1.0, **tasks}), count, obstacles=obstacles)


A, B = Station("a", (0, 0)), Station("b", (8, 0))
BOX = Obstacle(Polyline([(-3, -6), (10, -6), (10, 2), (-3, 2), (-3, -6)], 0.1), Stationary((0, 0)), "box")
LOW = replace(BOX, shape=Polyline([(-3, -4.46), (10, -4.46), (10, 0.46), (-3, 0.46), (-3, -4.46)], 0.1))
SHUT = Obstacle(Polyline([(6, -2), (10, -2), (10, 2), (6, 2), (6, -2)], 0.1), Stationary((0, 0)), "shut")
REFUSED_TASKS: dict[str, Callable[[Path], object]] = {
    r"^stations: expected two or more, each of another name, found \['a', 'a'\]": with_tasks(A, A),
    r"^destinations: expected another one than each origin, found 'a'": with_tasks(destinations=("a",)),
    r"^listed\[0\].destination: expected another one than the origin 'a'": with_tasks(listed=(Task(0, "a", "a"),)),
    r"^rate: expected one above 0, or listed tasks; found neither": with_tasks(rate=0.0),
    r"^rate: expected at most one task in dt = 0.1 s, found 700 a minute": with_tasks(rate=700.0),
    r"^tasks.listed\[0\].robot: expected one of r0, r1; found 'r9'": with_tasks(listed=(Task(0, "a", "b", "r9"),)),
    r"^origins: expected one of a, b, c; found 'd'": with_tasks(origins=("d",)),
    r"^a.places: expected a whole number of 1 or more, found 0": lambda _: Station("a", (0, 0), 0),
    r"^a.at: expected 2 numbers": lambda _: Station("a", (0, 0, 0)),
    r"^station 'b': expected one 1.35 m or more from the station 'a', found 1 m": with_tasks(A, Station("b", (1, 0))),
    r"^goal of 'r1': expected one 1.35 m or more from the station 'b'": with_tasks(A, Station("b", (0.5, -4))),
    r"^station 'b': expected a place 0.35 m or more from walls with a way to station 'a'": with_tasks(
        obstacles=(SHUT,)
    ),
    r"^station 'a': expected room for 90 places, 1.35 m apart, found": with_tasks(
        Station("a", (0, 0), 90), B, obstacles=(BOX,)
    ),
    r"^stations: expected room for 6 robots to wait, 1.35 m apart and 1 m from walls, found": with_tasks(
        A, B, count=6, obstacles=(LOW, replace(BOX, shape=Polyline([(-3, -1.8), (8.5, -1.8)], 0.1)))
    ),
    r"^r0.goal: expected a position to stop at, where the robot rests without a task": lambda _: replace(
        scene(Tasks(STATIONS, rate=1.0)), robots=(replace(robots(1)[0], goal=Goal(Stationary((0, -9)))),)
    ),
    r"^tasks: expected none in space, found some": lambda _: Scenario(
        "space",
        (Robot(Ball(0.3), Limits(1, 1), State((0, 0, 0), (0, 0, 0)), Goal(Stationary((9, 0, 0)), 0.2, True)),),
        tasks=Tasks(STATIONS, rate=1.0),
    ),
    r"^assign: expected none in a file": lambda _: scenario_text(
        scene(Tasks(STATIONS, rate=1.0, assign=newest_by_last))
    ),
    r"^assign: expected pairs of a waiting task and the name of a free robot, each once; found": lambda _: simulate(
        scene(Tasks(STATIONS, (Task(0.0, "a", "b"),), assign=other_pairs)), "nao"
    ),
}
