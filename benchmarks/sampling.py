"""One certified decision compared with sampling in numpy: time, and quality of the choice.

usage: python benchmarks/sampling.py [--scenes 60] [--quick] [--out FOLDER]

The samplers test 500 controls, spread evenly over the smallest disc of the limits, and take the free one nearest to the
preferred control. The acceleration obstacle is sampled at 60 times, in three implementations. These are one large array
of distances, x and y separately in place, and one matrix product. The velocity obstacle has a closed form in time. All
methods use the same scenes and given future positions of the obstacles, which are timed separately. The time of a scene
is that of the fastest repeated call, since load slows large arrays more than small ones. The tables give medians over
the scenes.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from machine import microseconds
from program import finish, options, table, target
from tasks import HOLD, HORIZON, Task, classical, families

from slalom import ControlObstacle, kernels, select
from slalom.base.tolerances import CANDIDATES, CERTIFIED, CONTACT, ELEMENTS

CONTROLS, TIMES = 500, np.linspace(0.1, HORIZON, 60)
GAIN = np.where(TIMES < HOLD, 0.5 * TIMES**2, HOLD * (TIMES - 0.5 * HOLD))
WHOLE = "sampling, all distances at once"
OFTEN = 40
"""Calls of slalom per scene: together as long as a few calls of a sampler."""


def controls(task: Task) -> np.ndarray:
    """Controls (CONTROLS, 2) spread evenly over the smallest disc of the limits: a sunflower."""
    k = np.arange(CONTROLS) + 0.5
    angle, away = k * np.pi * (3.0 - np.sqrt(5.0)), np.sqrt(k / CONTROLS)
    disc = int(np.argmin(task.situation.admissible.radii))
    spread = away[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return task.situation.admissible.centers[disc] + task.situation.admissible.radii[disc] * spread


def futures(task: Task) -> np.ndarray:
    """Positions of the obstacles at the sampled times, (n, 60, 2) [m]."""
    times = task.situation.now + TIMES
    return np.array([obstacle.trajectory.position(times) for obstacle in task.blocked.obstacles.obstacles])


def all_at_once(task: Task, tried: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Whether controls are free at all sampled times."""
    state = task.situation.state
    paths = state.position + TIMES[:, None] * state.velocity + GAIN[:, None] * tried[:, None]
    gaps = np.linalg.norm(paths[:, None] - positions, axis=-1)
    return (gaps >= task.radii[:, None]).all(axis=(1, 2))


def in_place(task: Task, tried: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """The same with x and y separately and no temporary arrays."""
    p, v = task.situation.state.position, task.situation.state.velocity
    x, y = (p[i] + TIMES * v[i] + GAIN * tried[:, i : i + 1] for i in range(2))
    dx = x[:, None] - np.ascontiguousarray(positions[..., 0])
    dy = y[:, None] - np.ascontiguousarray(positions[..., 1])
    dx *= dx
    dy *= dy
    dx += dy
    return (dx.min(axis=2) >= task.radii**2).all(axis=1)


def one_product(task: Task, tried: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """The same as a product of two matrices: squared distances are bilinear in (u, |u|^2, 1) and the scene."""
    state = task.situation.state
    away = positions - (state.position + TIMES[:, None] * state.velocity)
    spare = (away**2).sum(axis=-1) - (task.radii**2)[:, None]
    square = np.broadcast_to(GAIN**2, spare.shape)
    scene = np.stack([-2.0 * GAIN * away[..., 0], -2.0 * GAIN * away[..., 1], square, spare]).reshape(4, -1)
    rows = np.column_stack([tried, (tried**2).sum(axis=1), np.ones(len(tried))])
    return ((rows @ scene) >= 0.0).all(axis=1)


def velocities(task: Task, tried: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Whether velocities are free up to the horizon; `positions` (n, 2, 2) of the obstacles now and in 1 s."""
    state = task.situation.state
    gap_x, gap_y = (positions[:, 0] - state.position).T
    moving_x, moving_y = (positions[:, 1] - positions[:, 0]).T
    closing_x, closing_y = tried[:, :1] - moving_x, tried[:, 1:] - moving_y
    soonest = closing_x * gap_x + closing_y * gap_y
    soonest /= np.maximum(closing_x * closing_x + closing_y * closing_y, 1e-300)
    np.clip(soonest, 0.0, HORIZON, out=soonest)
    closing_x *= soonest
    closing_y *= soonest
    return ((gap_x - closing_x) ** 2 + (gap_y - closing_y) ** 2 >= task.radii**2).all(axis=1)


Sampler = Callable[[Task, np.ndarray, np.ndarray], np.ndarray]


def best(task: Task, sampler: Sampler, tried: np.ndarray, positions: np.ndarray) -> np.ndarray | None:
    """The free admissible control nearest to the preferred one."""
    free = sampler(task, tried, positions) & (task.situation.admissible.excess(tried) <= 0.0)
    away = np.where(free, ((tried - task.preferred) ** 2).sum(axis=1), np.inf)
    nearest = int(np.argmin(away))
    return tried[nearest] if free[nearest] else None


def kernel(task: Task) -> Callable[[], object]:
    """The kernel of the choice alone."""
    wanted = np.append(task.preferred, 0.0)
    limits, table = task.situation.admissible.table, task.blocked.table
    return lambda: kernels.nearest_free(wanted, 2, limits, *table, ELEMENTS, CANDIDATES, np.inf)


def times(
    tasks: list[Task], samplers: dict[str, Sampler], positions_of: Callable[[Task], np.ndarray]
) -> dict[str, float]:
    """Median time over the scenes of each method [us]."""
    spent: dict[str, list[float]] = {}

    def note(name: str, call: Callable[[], object], repeat: int) -> None:
        spent.setdefault(name, []).append(microseconds(call, repeat, 0.0))

    for task in tasks:
        tried, positions = controls(task), positions_of(task)
        preferred, allowed = task.preferred, task.situation.admissible

        def decided(task: Task = task) -> object:
            return select(task.preferred, task.situation.admissible, task.fresh())

        def whole(task: Task = task) -> object:
            b, obstacles = task.blocked, task.foreseen()
            new = ControlObstacle(b.response, b.state, obstacles, b.robot, b.margin)
            return select(task.preferred, task.situation.admissible, new)

        note("slalom", decided, OFTEN)
        note("slalom, choice alone", lambda: select(preferred, allowed, task.blocked), OFTEN)  # noqa: B023
        note("slalom, kernel of the choice", kernel(task), OFTEN)
        note("slalom, with the pieces of the obstacles", whole, OFTEN)
        for name, sampler in samplers.items():
            note(name, lambda f=sampler: best(task, f, tried, positions), 3)  # type: ignore[misc]  # noqa: B023
        note("future positions for the samplers", lambda: positions_of(task), 3)  # noqa: B023
    return {name: float(np.median(each)) for name, each in spent.items()}


def quality(tasks: list[Task], sampler: Sampler, positions_of: Callable[[Task], np.ndarray]) -> dict[str, Any]:
    """Compare the choices by the certified test: distance from the preferred control, and collisions."""
    found: dict[str, Any] = dict.fromkeys(("scenes", "none_sampled", "none", "collide", "worse", "only_slalom"), 0)
    farther = []
    for task in tasks:
        tried, positions = controls(task), positions_of(task)
        mine, theirs = (
            select(task.preferred, task.situation.admissible, task.blocked),
            best(task, sampler, tried, positions),
        )
        # The reference is the best sampled control that the certified test finds free, at all times.
        free = (task.situation.admissible.excess(tried) <= 0.0) & (task.blocked.clearance(tried) >= CONTACT + CERTIFIED)
        away = np.linalg.norm(tried - task.preferred, axis=1)
        mark = float(away[free].min(initial=np.inf))
        found["scenes"] += 1
        found["none"] += not mine.safe
        found["none_sampled"] += theirs is None
        found["collide"] += theirs is not None and bool(task.blocked.contains(theirs))
        found["worse"] += mine.distance > mark + 1e-9
        found["only_slalom"] += mine.safe and not np.isfinite(mark)
        if mine.safe and np.isfinite(mark):
            farther.append(mark - mine.distance)
    return {**found, "farther": float(np.median(farther)) if farther else None}


def measure(scenes: int) -> dict[str, Any]:
    """Both comparisons on both families of scenes."""
    shapes: dict[str, Sampler] = {WHOLE: all_at_once, "sampling, in place": in_place}
    shapes["sampling, one matrix product"] = one_product
    rows, verdicts, result = [], [], {}
    for family, tasks in families(scenes).items():
        for name, some, samplers, look in (
            ("nao", tasks, shapes, futures),
            ("vo", [classical(task) for task in tasks], {"sampling, closed form in time": velocities}, beginnings),
        ):
            spent, judged = times(some, samplers, look), quality(some, next(iter(samplers.values())), look)
            result[f"{family}, {name}"] = {"us": spent, "quality": judged}
            rows += [[f"{family}, {name}", what, us, us / spent["slalom"]] for what, us in spent.items()]
            verdicts.append([f"{family}, {name}", *judged.values()])
    heads = ["scenes", "number", "sampler finds none", "slalom finds none", "sampler's choice collides"]
    heads += ["slalom farther than the best free sample", "only slalom finds one", "best free sample farther by"]
    fair = min(
        min(us for what, us in r["us"].items() if what in shapes) / r["us"]["slalom"]
        for r in result.values()
        if WHOLE in r["us"]
    )
    return {
        "question": "One certified decision of nao with one response compared with sampling",
        "parameters": {"scenes": scenes, "obstacles": 30, "horizon_s": HORIZON, "controls": CONTROLS, "times": 60},
        "tables": [
            table("Time of one decision", ["scenes", "what", "median us", "ratio to slalom"], rows),
            table("Choices, judged by the certified test", heads, verdicts),
        ],
        "targets": [
            target("the same with the fastest of three implementations", fair, least=1.0),
            target(
                "scenes in which a free sample is nearer to the preferred control than slalom's choice",
                sum(r["quality"]["worse"] for r in result.values()),
                most=0,
            ),
        ],
        "results": result,
    }


def beginnings(task: Task) -> np.ndarray:
    """Positions of the obstacles now and after a second at their present velocity, (n, 2, 2) [m]."""
    now = task.situation.now
    paths = [obstacle.trajectory for obstacle in task.blocked.obstacles.obstacles]
    return np.array([(path.position(now), path.position(now) + path.velocity(now)) for path in paths])


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--scenes", type=int, default=60)
    arguments = parser.parse_args()
    result = measure(3 if arguments.quick else arguments.scenes)
    finish("sampling", result, arguments)


if __name__ == "__main__":
    main()
