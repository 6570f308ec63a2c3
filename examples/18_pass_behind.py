"""An objective of your own: the robot passes behind cars that cross its way, where `Arrive` passes in front."""

from dataclasses import dataclass

import numpy as np

import slalom
from slalom.base.checks import Positive
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

    weight: Positive = 10.0

    def costs(self, candidates, situation):
        times, known = situation.now + np.linspace(0.0, situation.horizon, 31), situation.obstacles
        front = in_front(candidates.positions(times), known.positions(times), known.velocities(times))
        return candidates.costs + self.weight * front


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
            (front,) = in_front(run.positions[:, 0][None], cars, moves)
            name = f"{type(objective).__name__} {getattr(objective, 'weight', '')}"
            print(f"{start:14g}  {name:16}  {front}  {found['time']:.1f}  {found['min_clearance']:.2f}")
