"""Growth of the cost of a decision with the numbers of obstacles, knots and robots: exponents of power laws.

usage: python benchmarks/scaling.py [--robots 10 30 100 ...] [--budget 30] [--quick] [--out FOLDER]

Obstacles: one decision of one response, from obstacles to control, among discs on circles. In the first family the
density is constant, so that most obstacles are out of reach. In the second family all obstacles share one square, and
their size falls with their number. Knots: 30 tracks with a varying number of stamps within the 6 s. Robots: one step of
a fleet with 100 m^2 per robot.

Exponents are slopes of straight lines through the logarithms, by least squares. They are given for all sizes and for
the upper half of the sizes, where constant costs and border effects are smaller. The targets apply to the upper half. A
size is left out, and marked in the table, if its estimated run time exceeds the budget [s]. The time of a scene is that
of the fastest repeated decision. The tables give medians over scenes and over steps.
"""

from typing import Any

import numpy as np
from machine import microseconds
from pace import DT, ROOM, fleet, steps
from program import finish, options, table, target
from tasks import HORIZON, LIMITS, ROBOT, Task, decision, wander

from slalom import Circular, ControlObstacle, Disc, Goal, Obstacle, Sampled, State, Stationary, method, select

OBSTACLES = (10, 30, 100, 300, 1000, 3000)
KNOTS = (20, 50, 100, 200, 500)
ROBOTS = (10, 30, 100, 300, 1000, 3000, 10000)
DENSE, SQUARE = 80.0, 50.0
"""[m^2] per obstacle. [m] side of the fixed square."""
LEAST_STEPS, MOST_STEPS = 3, 11


def exponents(sizes: list[int], times: list[float]) -> dict[str, float | None]:
    """The slopes through all sizes and through the upper half of them."""
    x, y = np.log(sizes), np.log(times)
    half = len(sizes) // 2 if len(sizes) > 2 else 0
    if len(sizes) < 2:
        return {"all": None, "upper": None}
    return {"all": float(np.polyfit(x, y, 1)[0]), "upper": float(np.polyfit(x[half:], y[half:], 1)[0])}


def whole(task: Task) -> None:
    """Decide once, from obstacles to the control."""
    b = task.blocked
    fresh = ControlObstacle(b.response, b.state, b.obstacles.within(b.obstacles.until), b.robot, b.margin)
    select(task.preferred, task.situation.admissible, fresh)


def among(obstacles: list[Obstacle], scene: int) -> Task:
    """A robot in the middle of the obstacles, without those that cover it."""
    state = State((0.0, 0.0), (2.0, 0.0))
    angle = 2.0 * np.pi * scene / 10.0
    goal = Goal(Stationary((40.0 * np.cos(angle), 40.0 * np.sin(angle))), 1.0)
    gaps = [
        np.linalg.norm(o.trajectory.position(0.0)) - o.shape.bounding_radius - ROBOT.bounding_radius for o in obstacles
    ]
    return decision(state, goal, [obstacle for obstacle, gap in zip(obstacles, gaps) if gap > 0.5])


def crowd(count: int, side: float, size: float, rng: np.random.Generator) -> list[Obstacle]:
    """Discs of `size` [m] on circles in a square."""
    return [
        Obstacle(
            Disc(size),
            Circular(
                rng.uniform(-0.5 * side, 0.5 * side, 2),
                rng.uniform(3.0, 8.0),
                rng.uniform(1.0, 4.0),
                rng.uniform(0.0, 2.0 * np.pi),
            ),
        )
        for _ in range(count)
    ]


def tracks(knots: int, rng: np.random.Generator) -> list[Obstacle]:
    """30 tracks with `knots` knots within the horizon."""
    times = np.linspace(0.0, HORIZON, knots)
    return [Obstacle(Disc(1.0), Sampled(times, wander(times, rng.uniform(-20, 20, 2), rng))) for _ in range(30)]


def one_robot(sizes: tuple[int, ...], scenes: int, made: Any) -> dict[str, Any]:
    """Medians over scenes of one decision [us] at each size, and the exponent."""
    times = []
    for size in sizes:
        rng = np.random.default_rng(size)
        tasks = [among(made(size, rng), scene) for scene in range(scenes)]
        times.append(float(np.median([microseconds(lambda t=task: whole(t), 15, 0.0) for task in tasks])))  # type: ignore[misc]
    return {"sizes": list(sizes), "us": times, "exponents": exponents(list(sizes), times)}


def robots(name: str, sizes: list[int], budget: float) -> dict[str, Any]:
    """Median step of a fleet of each size [s]; sizes that would take too long are left out."""
    chosen, done, times = method(name), [], []
    steps(fleet(sizes[0], 3 * DT), chosen)
    for size in sizes:
        guess = 0.0
        if done:
            # The worst case is quadratic: every robot considers all others. The best case is linear.
            rise = exponents(done[-2:], times[-2:])["all"]
            guess = times[-1] * (size / done[-1]) ** (2.0 if rise is None else float(np.clip(rise, 1.0, 2.0)))
        count = MOST_STEPS if guess == 0.0 else int(np.clip(budget / guess, LEAST_STEPS, MOST_STEPS))
        if guess * LEAST_STEPS > budget:
            break
        spent, _ = steps(fleet(size, count * DT), chosen)
        done.append(size)
        times.append(float(np.median(spent)))
    return {"sizes": done, "left_out": sizes[len(done) :], "s": times, "exponents": exponents(done, times)}


def measure(obstacles: tuple[int, ...], knots: tuple[int, ...], fleets: list[int], scenes: int, budget: float) -> Any:
    """All families and methods."""
    curves = {
        "obstacles, constant density": one_robot(
            obstacles, scenes, lambda n, rng: crowd(n, float(np.sqrt(DENSE * n)), 0.5, rng)
        ),
        "obstacles, in one square": one_robot(
            obstacles, scenes, lambda n, rng: crowd(n, SQUARE, float(0.5 * np.sqrt(30.0 / n)), rng)
        ),
        "knots of 30 tracks": one_robot(knots, scenes, tracks),
    }
    steps_of = {name: robots(name, fleets, budget) for name in ("nao", "nao_shared")}
    rows = [[what, n, us] for what, curve in curves.items() for n, us in zip(curve["sizes"], curve["us"])]
    moved: list[list[Any]] = []
    for name, curve in steps_of.items():
        moved += [[name, n, s, 1e6 * s / n] for n, s in zip(curve["sizes"], curve["s"])]
        moved += [[name, n, "not run: longer than the budget", ""] for n in curve["left_out"]]
    everything = {**curves, **{f"robots, {name}": curve for name, curve in steps_of.items()}}
    powers = [[what, *curve["exponents"].values()] for what, curve in everything.items()]
    largest = {name: dict(zip(curve["sizes"], curve["s"])).get(10_000) for name, curve in steps_of.items()}
    return {
        "question": "Growth of the cost of a decision with obstacles, knots and robots",
        "parameters": {
            "scenes": scenes,
            "obstacle_m2": DENSE,
            "square_m": SQUARE,
            "robot_m2": ROOM,
            "dt_s": DT,
            "budget_s": budget,
            "limits": [LIMITS.max_speed, LIMITS.max_acceleration],
        },
        "tables": [
            table("One decision, from obstacles to control", ["varied", "number", "median us"], rows),
            table("One step of a fleet", ["method", "robots", "median s", "us per robot"], moved),
            table("Exponents", ["varied", "all sizes", "upper half of the sizes"], powers),
        ],
        "targets": [
            *(target(f"exponent of {what}", value, most=1.1) for what, _, value in powers),
            *(target(f"a step of 10 000 robots, {name}", value, most=DT, unit="s") for name, value in largest.items()),
        ],
        "results": everything,
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=list(ROBOTS))
    parser.add_argument("--budget", type=float, default=30.0, help="[s] for one size of one method")
    arguments = parser.parse_args()
    if arguments.quick:
        result = measure((10, 30), (20, 50), [5, 10], 1, 10.0)
    else:
        result = measure(OBSTACLES, KNOTS, sorted(arguments.robots), 6, arguments.budget)
    finish("scaling", result, arguments)


if __name__ == "__main__":
    main()
