"""A scene of your own with chance: `slalom compare examples/16_own_scene.py:build` compares methods in it."""

from math import pi
from pathlib import Path

import slalom
from slalom.sim import Robot, Scenario, compare
from slalom.view import save, sets


def build(parameters, random):
    """Two cars on circles, from random angles; a robot crosses."""
    cars = [
        slalom.Obstacle(slalom.Disc(1.0), slalom.Circular((0, 0), radius, speed, random.uniform(0, 2 * pi)), name)
        for name, radius, speed in (("inner", 8, 5), ("outer", 12, -6))
    ]
    start, goal = slalom.State((-20, 0), (4, 0)), slalom.Goal(slalom.Stationary((20, 0)), 1.0)
    return Scenario("circles", (Robot(slalom.Disc(1.0), slalom.Limits(8, 4), start, goal),), cars, duration=30.0)


if __name__ == "__main__":
    from tempfile import mkdtemp

    folder = Path(mkdtemp())
    table = compare(f"{__file__}:build", ["vo", "nlvo", "ao", "nao"], 10, store=folder / "runs")
    table.to_csv(folder / "circles.csv")
    save(table.figure(), folder / "circles.pdf")
    print(table.to_latex(folder / "circles.tex"))
    save(sets(slalom.sim.load(f"{__file__}:build", seed=1), columns=1), folder / "sets.pdf")
