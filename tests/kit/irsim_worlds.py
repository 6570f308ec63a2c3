"""Worlds of ir-sim, and what its own flags say of a run in one."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class Run(NamedTuple):
    """Robots hit by ir-sim's own flag, robots that arrived, robots in all, and the time [s]."""

    hit: int
    arrived: int
    robots: int
    time: float


SHAPE = {
    "omni": "{name: circle, radius: 0.2}",
    "diff": "{name: circle, radius: 0.2}",
    "acker": "{name: rectangle, length: 0.6, width: 0.3, wheelbase: 0.4}",
}
FASTEST = {"omni": "[1.2, 1.2]", "diff": "[1.2, 2.0]", "acker": "[1.2, 0.6]"}
SLOWEST = {"omni": "[-1.2, -1.2]", "diff": "[-1.2, -2.0]", "acker": "[0, -0.6]"}


def robot(kind: str, behavior: str, start: object, goal: object) -> str:
    return (
        f"  - {{kinematics: {{name: {kind}}}, shape: {SHAPE[kind]}, state: {start}, goal: {goal}, "
        f"goal_threshold: 0.25, vel_max: {FASTEST[kind]}, vel_min: {SLOWEST[kind]}, behavior: {{{behavior}}}}}\n"
    )


def mover(start: object, goal: object, radius: float = 0.3, speed: float = 0.6) -> str:
    return (
        f"  - {{kinematics: {{name: omni}}, shape: {{name: circle, radius: {radius}}}, state: {start}, goal: {goal}, "
        f"vel_max: [{speed}, {speed}], vel_min: [-{speed}, -{speed}], behavior: {{name: dash}}}}\n"
    )


def line(*points: tuple[float, float]) -> str:
    return f"  - {{shape: {{name: linestring, vertices: {[list(p) for p in points]}}}, state: [0, 0, 0]}}\n"


HEAD = "world: {{height: 10, width: 12, step_time: 0.1, collision_mode: stop{more}}}\nrobot:\n{robots}"


def corridor(kind: str, behavior: str) -> str:
    robots = robot(kind, behavior, [1, 5, 0], [11, 5, 0])
    walls = line((0.0, 6.5), (12.0, 6.5)) + line((0.0, 3.5), (12.0, 3.5))
    posts = "  - {shape: {name: rectangle, length: 0.6, width: 1.0}, state: [4, 4.3, 0.3]}\n"
    return HEAD.format(more="", robots=robots) + "obstacle:\n" + walls + posts + mover([11, 5.7, 0], [0.5, 5.7, 0])


def crossing(kind: str, behavior: str) -> str:
    robots = robot(kind, behavior, [1, 5, 0], [11, 5, 0])
    movers = [
        mover([x, y, 0], [x + dx, 10 - y, 0])
        for x, y, dx in [
            (3.5, 9.0, 0.0),
            (5.0, 1.5, 0.5),
            (6.5, 8.0, -1.0),
            (7.5, 0.5, 0.0),
            (9.0, 9.5, 0.0),
            (4.0, 0.5, 1.5),
        ]
    ]
    return HEAD.format(more="", robots=robots) + "obstacle:\n" + "".join(movers)


def swap(kind: str, behavior: str) -> str:
    angles = 2 * np.pi * np.arange(4) / 4 + 0.1
    places = np.round(np.stack([6 + 4 * np.cos(angles), 5 + 4 * np.sin(angles)], 1), 3).tolist()
    robots = "".join(
        robot(kind, behavior, [*p, round(float(a + np.pi), 3)], [round(12 - p[0], 3), round(10 - p[1], 3), 0])
        for p, a in zip(places, angles)
    )
    return HEAD.format(more="", robots=robots)


def grid(kind: str, behavior: str) -> str:
    """Blocks of a map; the places between them to pass come from a planner."""
    robots = robot(kind, behavior, [1, 5, 0], [[[3.4, 4.0, 0], [6.7, 5.3, 0], [11, 4.2, 0]]])
    return (
        HEAD.format(more=", obstacle_map: grid.png", robots=robots) + "obstacle:\n" + mover([10, 5.6, 0], [1, 5.6, 0])
    )


WORLDS = {"corridor": corridor, "crossing": crossing, "swap": swap, "grid": grid}


def write_grid(path: Path) -> None:
    """A map of 60 x 50 cells with five blocks, as a picture of black on white."""
    import matplotlib.image

    cells = np.ones((50, 60))
    for x, y, w, h in [(15, 22, 4, 4), (25, 27, 5, 4), (27, 12, 4, 8), (38, 20, 4, 5), (40, 34, 6, 3)]:
        cells[y : y + h, x : x + w] = 0.0
    matplotlib.image.imsave(path, cells, cmap="gray")


def ran(folder: Path, world: str, kind: str, behavior: str, steps: int = 400) -> Run:
    """A run in one world, in which all robots have one behaviour."""
    write_grid(folder / "grid.png")
    text = WORLDS[world](kind, behavior).replace("grid.png", str(folder / "grid.png"))
    (folder / "world.yaml").write_text(text)
    return ran_file(folder / "world.yaml", steps)


def ran_file(path: Path, steps: int) -> Run:
    """A run in the world of a file."""
    import irsim

    env: Any = irsim.make(str(path), display=False, log_level="ERROR")
    hit, arrived, time = set[int](), set[int](), 0.0
    for _ in range(steps):
        env.step()
        hit |= {r.id for r in env.robot_list if r.collision}
        arrived |= {r.id for r in env.robot_list if r.arrive}
        time = env.time
        if len(hit | arrived) == len(env.robot_list):
            break
    count = len(env.robot_list)
    env.end(0)
    return Run(len(hit), len(arrived - hit), count, time)
