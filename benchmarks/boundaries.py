"""The exact boundary of 30 obstacles compared with unions of discs in shapely: time and accuracy.

usage: python benchmarks/boundaries.py [--scenes 8] [--points 50000] [--quick] [--out FOLDER]

The usual method takes the temporal elements of each obstacle at 200 times as polygons with 64 corners (shapely's
default for discs). It forms their union. slalom uses `ControlObstacle.boundary`. Both compute the boundary of each
obstacle alone and of all together, over the disc of controls within 4 m/s^2. The certified test decides at random
controls whether they collide. A control is wrong if it lies on the wrong side of a boundary.
"""

from time import perf_counter
from typing import Any

import numpy as np
import shapely
from program import finish, options, table, target
from tasks import HORIZON, LIMITS, OBSTACLES, Task, families

TIMES, CENTER, RADIUS = 200, np.zeros(2), LIMITS.max_acceleration


def discs(task: Task, times: int) -> np.ndarray:
    """The union of each obstacle's elements at `times` times: shapely polygons (n,)."""
    after = HORIZON * np.arange(1, times + 1) / times
    own = task.situation.response.position(task.situation.state, after)
    found = []
    for obstacle, radius in zip(task.blocked.obstacles.obstacles, task.radii):
        centers = own.inverse(obstacle.trajectory.position(task.situation.now + after))
        found.append(shapely.union_all(shapely.buffer(shapely.points(centers), radius / own.gain)))
    return np.array(found)


def wrong(region: Any, controls: np.ndarray, collide: np.ndarray) -> float:
    """The share of controls on the wrong side of the boundary."""
    shapely.prepare(region)
    return float(np.mean(shapely.contains_xy(region, controls[:, 0], controls[:, 1]) != collide))


def seconds(call: Any) -> tuple[float, Any]:
    """The least of three times [s], and the result."""
    spent = []
    for _ in range(3):
        before = perf_counter()
        result = call()
        spent.append(perf_counter() - before)
    return min(spent), result


def measure(scenes: int, points: int) -> dict[str, Any]:
    """Time and accuracy on both families of scenes."""
    rng = np.random.default_rng(2)
    window = shapely.buffer(shapely.Point(CENTER), RADIUS, quad_segs=256)
    result, rows = {}, []
    for family, tasks in families(scenes).items():
        columns: dict[str, list[float]] = {}
        for task in tasks:
            angle, away = rng.uniform(0.0, 2.0 * np.pi, points), RADIUS * np.sqrt(rng.uniform(0.0, 1.0, points))
            controls = CENTER + 0.999 * away[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            collide = task.blocked.contains(controls)
            each, ours = seconds(lambda: task.fresh().boundary(CENTER, RADIUS))  # noqa: B023
            merging, region = seconds(lambda: ours.region)  # noqa: B023
            each_discs, theirs = seconds(lambda: discs(task, TIMES))  # noqa: B023
            clipping, union = seconds(lambda: shapely.intersection(shapely.union_all(theirs), window))  # noqa: B023
            row = {
                "slalom_each_ms": 1e3 * each,
                "discs_each_ms": 1e3 * each_discs,
                "slalom_all_ms": 1e3 * (each + merging),
                "discs_all_ms": 1e3 * (each_discs + clipping),
                "blocked": float(np.mean(collide)),
                "slalom_wrong": wrong(region, controls, collide),
                "discs_wrong": wrong(union, controls, collide),
            }
            for name, value in row.items():
                columns.setdefault(name, []).append(value)
        found = {name: float(np.median(each)) for name, each in columns.items() if not name.endswith("wrong")}
        found |= {name: float(np.mean(each)) for name, each in columns.items() if name.endswith("wrong")}
        found["ratio_each"] = found["slalom_each_ms"] / found["discs_each_ms"]
        found["ratio_all"] = found["slalom_all_ms"] / found["discs_all_ms"]
        result[family] = found
        for kind in ("slalom", "discs"):
            more = [found[f"{kind}_each_ms"], found[f"{kind}_all_ms"], found[f"{kind}_wrong"], found["blocked"]]
            rows.append([family, "slalom" if kind == "slalom" else f"{TIMES} discs for each, shapely", *more])
    worst = {name: max(r[name] for r in result.values()) for name in ("ratio_each", "ratio_all")}
    shares = [r["slalom_wrong"] / r["discs_wrong"] for r in result.values() if r["discs_wrong"]]
    farther = max(shares) if len(shares) == len(result) else None
    heads = ["scenes", "what", "each, median ms", "each and all, median ms", "share of wrong controls", "blocked"]
    return {
        "question": "The boundary of the control obstacle against unions of discs",
        "parameters": {"scenes": scenes, "points": points, "obstacles": OBSTACLES, "times": TIMES, "radius": RADIUS},
        "tables": [table("Boundaries of 30 obstacles", heads, rows)],
        "targets": [
            target("boundaries of each obstacle, slalom over shapely", worst["ratio_each"], most=1.0),
            target("boundaries of each and of all together, slalom over shapely", worst["ratio_all"], most=1.0),
            target("share of wrong controls, slalom over shapely", farther, most=1.0),
        ],
        "results": result,
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--scenes", type=int, default=8)
    parser.add_argument("--points", type=int, default=50_000)
    arguments = parser.parse_args()
    quick = arguments.quick
    result = measure(1 if quick else arguments.scenes, 500 if quick else arguments.points)
    finish("boundaries", result, arguments, ["shapely"])


if __name__ == "__main__":
    main()
