"""An objective of your own: pass behind cars. `python examples/20_pass_behind.py FOLDER` draws two runs."""

import sys
from dataclasses import dataclass

import numpy as np

import slalom
from slalom import view
from slalom.sim import Robot, Scenario, metrics, simulate


def in_front(p, cars, moves):
    """How many cars (k, m, d) robots at p (n, m, d) pass in front of, within 6 m at the nearest: (n,)."""
    away = p[:, None] - cars
    distances = np.linalg.norm(away, axis=-1)
    at = distances.argmin(axis=-1)[..., None]
    ahead = np.take_along_axis(np.einsum("nkmd,kmd->nkm", away, moves), at, axis=-1)
    return ((ahead > 0.0) & (np.take_along_axis(distances, at, axis=-1) < 6.0)).sum(axis=(1, 2))


@dataclass(frozen=True)
class PassBehind(slalom.Arrive):
    """Arrive early, but as if each car passed in front of cost `weight` [s] more."""

    weight: float = 10.0

    def costs(self, candidates, situation):
        times, known = situation.now + np.linspace(0.0, situation.horizon, 31), situation.obstacles
        front = in_front(candidates.positions(times), known.positions(times), known.velocities(times))
        return candidates.costs + self.weight * front


def build(start):
    """A car that comes from y = start [m] crosses the way of a robot."""
    car = slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((0, start), (0, 3)), "car")
    state, goal = slalom.State((-10, 0), (4, 0)), slalom.Goal(slalom.Stationary((15, 0)), 1.0)
    return Scenario("crossing", (Robot(slalom.Disc(1.0), slalom.Limits(6, 3), state, goal),), [car], duration=30.0)


def drive(start, objective):
    """A run, and how many cars the robot passes in front of."""
    run = simulate(build(start), "nao", objective=objective)
    car = run.obstacles[0].trajectory
    return run, in_front(run.positions[None, :, 0], car.position(run.times)[None], car.velocity(run.times)[None])[0]


if __name__ == "__main__":
    print("| car from y, m | objective | passes in front | arrival, s | least clearance, m |\n|---|---|---|---|---|")
    for start in (-6, -7, -8, -9, -10):
        for objective in (slalom.Arrive(), PassBehind(weight=10)):
            run, front = drive(start, objective)
            name, found = type(objective).__name__, metrics.summary(run)
            print(f"| {start} | `{name}` | {front} | {found['time']:.1f} | {found['min_clearance']:.2f} |")
    for objective in (slalom.Arrive(), PassBehind(weight=10)) if len(sys.argv) > 1 else ():
        run = drive(-8, objective)[0]
        ax = view.paths(run.times, run.positions[:, 0], run.obstacles, robot=run.shapes[0], goal=run.goals[0])
        view.save(ax, f"{sys.argv[1]}/{type(objective).__name__}.svg")
