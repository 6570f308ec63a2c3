"""Obstacles of a noisy occupancy grid: their number, the time to make them, to update a part, and to decide.

usage: python benchmarks/occupancy_grid.py [--quick] [--repeats 20] [--out FOLDER]

The grid has cells of 0.05 m: four walls around, rooms, two slanted walls and twelve boxes. In a noisy grid 3 % of the
occupied cells are missing, and 5 % of the cells beside them are occupied. Each repeat draws the noise anew, as a mapper
does at 5 Hz. The part is 60 x 60 cells. The first decision with a new table prepares it for the robot. Beside the table
stands an `ObstacleTable` of the same rectangles. Times are medians of processor times.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from program import finish, options, table, target

import slalom

RESOLUTION, MISSING, MORE, PART = 0.05, 0.03, 0.05, 60


def building(size: int, rng: np.random.Generator) -> np.ndarray:
    """The occupied cells (size, size) of walls and boxes."""
    cells = np.zeros((size, size), np.bool_)
    lines = np.array(
        [
            *((5, 5, 395, 5), (395, 5, 395, 395), (395, 395, 5, 395), (5, 395, 5, 5), (5, 150, 180, 150)),
            *((220, 150, 395, 150), (200, 150, 200, 395), (60, 200, 140, 330), (260, 40, 340, 110)),
        ]
    )
    for a, b, c, d in lines * size / 400:
        along = np.linspace(0.0, 1.0, 3 * size)
        cells[(b + along * (d - b)).astype(int), (a + along * (c - a)).astype(int)] = True
    for x, y in rng.integers(size // 10, size - size // 10, (12, 2)):
        cells[y : y + size // 50, x : x + size // 50] = True
    return cells


def noisy(cells: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same cells with some missing, and some beside them."""
    beside = np.zeros_like(cells)
    beside[1:] |= cells[:-1]
    beside[:-1] |= cells[1:]
    beside[:, 1:] |= cells[:, :-1]
    beside[:, :-1] |= cells[:, 1:]
    found = cells & (rng.random(cells.shape) >= MISSING)
    return found | (beside & ~cells & (rng.random(cells.shape) < MORE))


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time [ms] of a call, and its result."""
    before = time.process_time()
    found = call()
    return 1e3 * (time.process_time() - before), found


def measured(cells: np.ndarray) -> list[float]:
    """Obstacles, and times [ms]: of the table, a part, the first decision and the next; of the plain table and its."""
    values = 100 * cells.astype(np.int8)
    robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.3), slalom.Limits(1.0, 1.5), period=0.05, horizon=3.0)
    end = RESOLUTION * len(cells)
    state, goal = (
        slalom.State((0.1 * end, 0.2 * end), (0.5, 0.0)),
        slalom.Goal(slalom.Stationary((0.9 * end, 0.2 * end))),
    )
    whole, grid = timed(lambda: slalom.occupancy(values, RESOLUTION))
    at = len(cells) // 4
    part, _ = timed(lambda: grid.updated(values[at : at + PART, at : at + PART], at, at))
    first, _ = timed(lambda: robot.decide(state, grid, goal, now=0.0))
    later, _ = timed(lambda: robot.decide(state, grid, goal, now=0.05))
    others = [slalom.Obstacle(one.shape, one.trajectory) for one in grid]
    plain, listed = timed(lambda: slalom.ObstacleTable(others))
    plain_first, _ = timed(lambda: robot.decide(state, listed, goal, now=0.0))
    return [len(grid), whole, part, first, later, plain, plain_first]


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    arguments = parser.parse_args()
    sizes, repeats = ((50,), 2) if arguments.quick else ((400, 2000), arguments.repeats)
    rng, rows = np.random.default_rng(0), []
    for size in sizes:
        cells = building(size, rng)
        measured(cells)  # loads what is compiled
        for name in ("exact", "noisy"):
            found = [measured(cells if name == "exact" else noisy(cells, rng)) for _ in range(repeats)]
            rows.append([f"{size} x {size}, {name}", *np.median(found, axis=0).tolist()])
    heads = ["grid", "obstacles", "table ms", "part ms", "first ms", "next ms", "plain table ms", "its first ms"]
    result: dict[str, Any] = {
        "question": "The time of a map that is updated.",
        "parameters": {"repeats": repeats},
        "tables": [table("occupancy grids of 0.05 m:", heads, rows)],
        "targets": [target("table and first decision, noisy", rows[1][2] + rows[1][4], most=20.0, unit="ms")],
    }
    finish("occupancy_grid", result, arguments)


if __name__ == "__main__":
    main()
