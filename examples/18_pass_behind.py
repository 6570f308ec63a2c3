"""An objective of your own: the robot passes behind cars that cross its way, where `Arrive` passes in front."""

from dataclasses import dataclass

import numpy as np

import slalom
from slalom.base.checks import Positive
from slalom.sim import Robot, Scenario, metrics, simulate


def in_front(p, c, v):
    """How many obstacles a robot passes in front of, within 6 m: positions (m, d), those and velocities (n, m, d)."""
    away = p - c
    at = np.linalg.norm(away, axis=-1).argmin(axis=-1)[:, None, None]
    away, v = (np.take_along_axis(each, at, axis=-2)[..., 0, :] for each in (away, v))
    return ((np.linalg.norm(away, axis=-1) < 6.0) & ((away * v).sum(axis=-1) > 0.0)).sum(axis=-1)


@dataclass(frozen=True)
class PassBehind(slalom.Arrive):
    """Arrive early, but as if each obstacle passed in front of cost `weight` [s] more."""

    weight: Positive = 10.0

    def costs(self, candidates, situation):
        times = situation.now + np.linspace(0.0, situation.horizon, 61)
        cars, moves = situation.obstacles.positions(times), situation.obstacles.velocities(times)
        return candidates.costs + self.weight * np.array([in_front(p, cars, moves) for p in candidates.positions(times)])


def build(start):
    """A car that comes from y = start [m] crosses the way of a robot."""
    car = slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((0, start), (0, 3)), "car")
    state, goal = slalom.State((-10, 0), (4, 0)), slalom.Goal(slalom.Stationary((15, 0)), 1.0)
    return Scenario("crossing", (Robot(slalom.Disc(1.0), slalom.Limits(6, 3), state, goal),), [car], duration=30.0)


if __name__ == "__main__":
    print("car from y [m]  objective  passed in front  time [s]  least clearance [m]")
    for start in (-6.0, -7.0, -8.0, -9.0, -10.0):
        for objective in (slalom.Arrive(), PassBehind(weight=10), PassBehind(weight=100)):
            scene = build(start)
            run = simulate(scene, "nao", objective=objective)
            (car,), found = scene.obstacles, metrics.summary(run)
            cars, moves = car.trajectory.position(run.times)[None], car.trajectory.velocity(run.times)[None]
            front = in_front(run.positions[:, 0], cars, moves)
            name = f"{type(objective).__name__} {getattr(objective, 'weight', '')}"
            print(f"{start:14g}  {name:16}  {front}  {found['time']:.1f}  {found['min_clearance']:.2f}")
