"""Compile the kernels that most programs and tests use, in two processes, so that later processes load them.

Compilation takes one to two minutes after an installation or a change of kernels, and a few seconds otherwise.
"""

import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import slalom
from slalom.sim import gallery, simulate

SHORT = {"duration": 0.2}


def single_robot() -> None:
    """Choices among discs, balls and polygons, borders of control obstacles, and sequences."""
    for d in (2, 3):
        blocked = slalom.control_obstacle(
            slalom.Velocity(0.1), slalom.State((4.0,) * d, (0.0,) * d), [rock(d)], disc_or_ball(0.5, d), horizon=5.0
        )
        use(blocked, d)
    shape = slalom.Rectangle(2.0, 1.0)
    turning = slalom.Obstacle(shape, slalom.Circular((0.0, 0.0), 2.0, 1.0), heading="motion")
    state = slalom.State((4.0, 4.0), (0.0, 0.0))
    blocked = slalom.control_obstacle(slalom.Velocity(0.1), state, [turning], shape, horizon=5.0)
    use(blocked, 2)
    blocked.boundary((0.0, 0.0), 3.0)
    for scenario in ("roundabout_crossing", "corridor"):
        for method in ("nao", "nao_ahead"):
            simulate(gallery.build(scenario, SHORT), slalom.METHODS[method])


def fleets() -> None:
    """Decisions and guidance of fleets without and with walls."""
    simulate(gallery.build("circle", {"robots": 4} | SHORT), slalom.METHODS["nao_shared"])
    simulate(gallery.build("doorway", {"robots": 4} | SHORT), slalom.METHODS["nao_shared"])


def rock(d: int) -> slalom.Obstacle:
    """A round obstacle on a circle."""
    return slalom.Obstacle(disc_or_ball(1.0, d), slalom.Circular((0.0,) * d, 2.0, 1.0))


def disc_or_ball(radius: float, d: int) -> slalom.Shape:
    """The round shape of dimension d."""
    return slalom.Disc(radius) if d == 2 else slalom.Ball(radius)


def use(blocked: slalom.ControlObstacle, d: int) -> None:
    """Call what a decision calls."""
    center = (0.0,) * d
    blocked.clearance(center)
    blocked.time_to_collision(center)
    slalom.select((-1.0,) * d, slalom.admissible_ball(center, 3.0), blocked)


def main() -> int:
    """The exit code."""
    jobs: list[Callable[[], None]] = [fleets, single_robot]
    with ProcessPoolExecutor(len(jobs), mp_context=get_context("spawn")) as pool:
        for done in [pool.submit(job) for job in jobs]:
            done.result()
    return 0


if __name__ == "__main__":
    sys.exit(main())
