"""Random fleets that only observe each other: how many collide, how deep, and how many robots arrive.

usage: python benchmarks/random_fleets.py [--fleets 500] [--methods nao rvo] [--seconds 60] [--quick] [--out FOLDER]

Each fleet has 3 to 30 robots with radii of 0.2 to 0.8 m, speeds of 0.5 to 2 m/s and accelerations of 1 to 4 m/s^2.
Starts and goals are drawn at least 0.3 m apart, in a square of which the robots cover 12 % or 25 %. Robots that have
arrived stay. Nothing guides them. All fleets are worlds of one `Fleet`. Robots move exactly as decided; the least
distance is that of the straight lines between steps.
"""

import argparse
from typing import Any

import numpy as np
from program import finish, options, table, target

from slalom import Disc, Fleet, Limits, method
from slalom.sim.run.states import integrate

DT, GAP, TOLERANCE, DEEP = 0.1, 0.3, 0.2, 0.02
COVERED = (0.12, 0.25)


class Draw:
    """Random fleets: starts and goals (n, 2), radii, speeds and accelerations (n,), the fleet of each robot (n,)."""

    def __init__(self, fleets: int, covered: float, seed: int) -> None:
        rng, rows = np.random.default_rng(seed), []
        while len(rows) < fleets:
            n = int(rng.integers(3, 31))
            radii, side = rng.uniform(0.2, 0.8, n), 0.0
            side = np.sqrt(np.pi * (radii**2).sum() / covered) + 1.0
            starts, goals = (scattered(rng, radii, side) for _ in range(2))
            if starts is not None and goals is not None:
                speeds, accelerations = rng.uniform(0.5, 2.0, n), rng.uniform(1.0, 4.0, n)
                rows.append((starts, goals, radii, speeds, accelerations, np.full(n, len(rows))))
        columns = (np.concatenate(column) for column in zip(*rows, strict=True))
        self.starts, self.goals, self.radii, self.speeds, self.accelerations, self.fleet = columns


def scattered(rng: np.random.Generator, radii: np.ndarray, side: float) -> np.ndarray | None:
    """Positions (n, 2) [m] of discs in a square, at least GAP apart; None where no place was found."""
    placed = np.empty((0, 2))
    for k, radius in enumerate(radii):
        tried = rng.uniform(-0.5 * side, 0.5 * side, (2000, 2))
        apart = np.linalg.norm(tried[:, None] - placed, axis=2) - radii[:k] - radius - GAP
        free = np.flatnonzero((apart >= 0.0).all(axis=1))
        if not len(free):
            return None
        placed = np.concatenate([placed, tried[free[:1]]])
    return placed


def clearances(before: np.ndarray, after: np.ndarray, drawn: Draw) -> np.ndarray:
    """The least clearance [m] of two robots of each fleet on straight lines between positions (n, 2) [m]."""
    least = np.empty(drawn.fleet[-1] + 1)
    for k, rows in enumerate(np.split(np.arange(len(before)), np.flatnonzero(np.diff(drawn.fleet)) + 1)):
        i, j = (rows[index] for index in np.triu_indices(len(rows), 1))
        begin, end = before[i] - before[j], after[i] - after[j]
        moved = end - begin
        share = np.clip(-(begin * moved).sum(axis=1) / np.maximum((moved**2).sum(axis=1), 1e-12), 0.0, 1.0)
        distance = np.linalg.norm(begin + share[:, None] * moved, axis=1)
        least[k] = (distance - drawn.radii[i] - drawn.radii[j]).min()
    return least


def measured(name: str, drawn: Draw, seconds: float) -> dict[str, float]:
    """What happened to the fleets."""
    limits = [Limits(float(v), float(a)) for v, a in zip(drawn.speeds, drawn.accelerations, strict=True)]
    fleet = Fleet(method(name), [Disc(float(r)) for r in drawn.radii], limits, worlds=drawn.fleet)
    positions, velocities = drawn.starts, np.zeros_like(drawn.starts)
    least, first = np.full(drawn.fleet[-1] + 1, np.inf), np.full(len(positions), np.inf)
    for k in range(round(seconds / DT)):
        decided = fleet.step(k * DT, positions, velocities, drawn.goals, tolerances=TOLERANCE)
        before = positions
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        least = np.minimum(least, clearances(before, positions, drawn))
        there = np.linalg.norm(positions - drawn.goals, axis=1) <= TOLERANCE
        first = np.where(there, np.minimum(first, (k + 1) * DT), first)
    return {
        "fleets": len(least),
        "robots": len(positions),
        "collided": int((least < -1e-6).sum()),
        "deeper than 0.02 m": int((least < -DEEP).sum()),
        "least clearance m": float(least.min()),
        "arrived %": 100.0 * float(np.isfinite(first).mean()),
        "mean time s": float(np.minimum(first, seconds).mean()),
    }


def compare(arguments: argparse.Namespace) -> dict[str, Any]:
    """Tables and targets."""
    fleets, seconds = (2, 1.0) if arguments.quick else (arguments.fleets, arguments.seconds)
    rows, first = [], dict[str, float]()
    for name in arguments.methods:
        for seed, covered in enumerate(COVERED):
            found = measured(name, Draw(fleets // 2, covered, seed), seconds)
            rows.append([f"{name}, {100 * covered:.0f} %", *found.values()])
            for what, value in found.items() if name == arguments.methods[0] else ():
                first[what] = first.get(what, 0.0) + value
    return {
        "question": "Do fleets collide whose robots only observe each other?",
        "tables": [table("Random fleets: method, part of the square that is covered", ["run", *found], rows)],
        "targets": [
            target(f"{arguments.methods[0]}: fleets that collided", first["collided"], most=0.01 * fleets),
            target(f"{arguments.methods[0]}: collisions deeper than 0.02 m", first["deeper than 0.02 m"], most=0.0),
            target(f"{arguments.methods[0]}: robots that arrived", 0.5 * first["arrived %"], least=95.0, unit="%"),
        ],
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--fleets", type=int, default=500)
    parser.add_argument("--methods", nargs="+", default=["nao"])
    parser.add_argument("--seconds", type=float, default=60.0)
    given = parser.parse_args()
    finish("random_fleets", compare(given), given)
