"""Robots with bounds among moving discs and boxes: arrivals with and without looking ahead.

usage: python benchmarks/bounds_ahead.py [--kinds aircraft ship car bicycle free] [--seeds 30] [--first 0] [--quick]

The unit of length is v^2 / a, that of time v / a, with the maximum speed v and the largest acceleration a. A robot
passes a goal 8 units ahead, with a radius of 0.06. A car, a bicycle and a robot without bounds stop at every second
goal. Ten discs cross the way about when the robot is there, three boxes rest near it. Obstacles are known. `nao` and
`nao_ahead` have the same limits, a horizon of 4 v / a and holds up to v / a. Clearances are those of the simulator's
metrics, in continuous time. A mean ratio is over the scenes in which both arrive.
"""

import argparse
from typing import Any, Final

import numpy as np
from program import finish, options, table, target

from slalom import (
    ConstantVelocity,
    Disc,
    Friction,
    Goal,
    HeadingCone,
    LeastSpeed,
    Limits,
    Obstacle,
    Rectangle,
    State,
    Stationary,
    TurningRadius,
    method,
)
from slalom.sim import Recording, Robot, Scenario, metrics, simulate

KINDS: Final = {
    "aircraft": Limits(25.0, 6.0, bounds=(LeastSpeed(18.0), TurningRadius(60.0))),
    "ship": Limits(8.0, 0.5, bounds=(LeastSpeed(3.0), Friction(0.1, 0.1, 0.3))),
    "car": Limits(10.0, 4.0, bounds=(TurningRadius(5.0), Friction(2.0, 4.0, 3.5))),
    "bicycle": Limits(3.0, 1.5, bounds=(TurningRadius(1.5), HeadingCone(1.0))),
    "free": Limits(3.0, 1.5),
}
STOPPING: Final = ("car", "bicycle", "free")
METHODS: Final = ("nao", "nao_ahead")


def scene(kind: str, seed: int) -> Scenario:
    """One robot with the limits of a kind, and what is in its way."""
    limits, rng = KINDS[kind], np.random.default_rng([seed, 77])
    v, rise = limits.max_speed, limits.max_speed / limits.max_acceleration
    unit, way = v * rise, 8.0 * v * rise
    obstacles = []
    for _ in range(10):
        share, angle, speed = rng.uniform(0.15, 0.95), rng.uniform(0.0, 2.0 * np.pi), v * rng.uniform(0.1, 0.6)
        velocity, radius = speed * np.array([np.cos(angle), np.sin(angle)]), unit * rng.uniform(0.05, 0.3)
        place = np.array([share * way, 0.3 * unit * rng.normal()]) - share * way / v * velocity
        if np.linalg.norm(place) > radius + 1.5 * unit:
            obstacles.append(Obstacle(Disc(radius), ConstantVelocity(place, velocity)))
    for _ in range(3):
        place, (width, height) = (rng.uniform(0.2, 0.85) * way, 0.7 * unit * rng.normal()), rng.uniform(0.1, 1.2, 2)
        box = Rectangle(unit * width, unit * height)
        obstacles.append(Obstacle(box, Stationary(place), heading=float(rng.uniform(0.0, 3.0))))
    goal = Goal(Stationary((way, 0.0)), 0.15 * unit, stop=kind in STOPPING and seed % 2 == 1)
    robot = Robot(Disc(0.06 * unit), limits, State((0.0, 0.0), (0.8 * v, 0.0)), goal)
    dt = max(0.1, round(rise / 40.0, 1))
    holds = tuple(max(1, round(share * rise / dt)) * dt for share in (0.05, 0.125, 0.25, 0.5, 1.0))
    settings = {"horizon": 4.0 * rise, "margin": 0.018 * unit, "holds": tuple(sorted(set(holds)))}
    return Scenario(kind, (robot,), tuple(obstacles), dt=dt, duration=round(40.0 * rise / dt) * dt, **settings)


def arrival(run: Recording) -> float:
    """[s] inf for a robot that does not arrive."""
    return float(metrics.time(run)) if metrics.arrived(run) else np.inf


def compare(arguments: argparse.Namespace) -> dict[str, Any]:
    """Tables and targets."""
    seeds = range(arguments.first, arguments.first + (1 if arguments.quick else arguments.seeds))
    rows, contacts, lost = [], 0, 0
    for kind in arguments.kinds:
        runs = {name: [simulate(scene(kind, seed), method(name), seed=seed) for seed in seeds] for name in METHODS}
        plain, ahead = (np.array([arrival(run) for run in runs[name]]) for name in METHODS)
        both = np.isfinite(plain) & np.isfinite(ahead)
        for name, times in (("nao", plain), ("nao_ahead", ahead)):
            took = 1e3 * np.concatenate([run.decision_times[run.decision_times > 0.0] for run in runs[name]])
            touched = sum(int(metrics.collisions(run)) for run in runs[name])
            lost, contacts = lost + int(np.isinf(times).sum() * (name == "nao_ahead")), contacts + touched
            ratio = float(np.mean(times[both] / plain[both])) if both.any() else np.nan
            sooner, later = (int(np.sum(side * (times[both] - plain[both]) < -1e-9)) for side in (1.0, -1.0))
            arrived = int(np.isfinite(times).sum())
            rows.append([kind, name, len(seeds), arrived, touched, ratio, sooner, later, float(np.median(took))])
            rows[-1].append(float(np.quantile(took, 0.99)))
            print(*rows[-1], flush=True)
    heads = [
        "robot",
        "method",
        "runs",
        "arrived",
        "contacts",
        "arrival / nao",
        "sooner",
        "later",
        "median ms",
        "99 % ms",
    ]
    return {
        "question": "Do robots with bounds arrive sooner if they look ahead?",
        "tables": [table("Robots with bounds", heads, rows)],
        "targets": [
            target("contacts", contacts, most=0.0),
            target("runs in which nao_ahead did not arrive", lost, most=0.0),
        ],
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    finish("bounds_ahead", compare(given), given)
