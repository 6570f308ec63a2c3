"""Draw the control obstacle of one obstacle under six responses into docs/images/control_obstacles.svg."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

import slalom

mpl.use("Agg")
mpl.rcParams["svg.hashsalt"] = "control_obstacles"

import matplotlib.pyplot as plt  # noqa: E402

HORIZON = 8.0  # [s]
ROBOT = slalom.State((0.0, 0.0), (2.0, 0.0))
RADIUS = slalom.Disc(0.5)
LINE = slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((6.0, 3.0), (0.0, -1.2)))
BENT = slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantAcceleration((6.0, 3.0), (0.0, -1.2), (-0.24, 0.0)))
ARC = slalom.Obstacle(slalom.Disc(1.0), slalom.Circular((3.0, 3.0), 3.0, 0.0, -0.4))
"""One obstacle as it is known: by its velocity, by its acceleration too, by its circle."""

PANELS = (
    ("VO", slalom.Velocity(), LINE, (2.0, 0.0), 4.0),
    ("NLVO", slalom.Velocity(), ARC, (2.0, 0.0), 4.0),
    ("AO", slalom.Acceleration(), BENT, (0.0, 0.0), 3.0),
    ("NAO", slalom.Acceleration(), ARC, (0.0, 0.0), 3.0),
    ("NAO, coast after 1 s", slalom.AccelerateThenCoast(1.0), ARC, (0.0, 0.0), 5.0),
    ("NAO, turn after 1 s", slalom.AccelerateThenTurn(1.0, 0.5), ARC, (0.0, 0.0), 5.0),
)
"""Title, response, obstacle, the control that changes nothing, and the half width of the panel."""


def draw(path: Path) -> None:
    """Write the figure as an SVG file."""
    figure, axes = plt.subplots(2, 3, figsize=(9.0, 6.0), layout="constrained")
    for ax, (title, response, obstacle, unchanged, width) in zip(axes.flat, PANELS):
        blocked = slalom.control_obstacle(response, ROBOT, [obstacle], RADIUS, horizon=HORIZON)
        for part in blocked.boundary(unchanged, 2.0 * width).curves:
            ax.fill(*part.T, facecolor="#d9603b", alpha=0.35, edgecolor="none")
            ax.plot(*part.T, color="#a03418", linewidth=1.2)
        ax.plot(*unchanged, "o", color="#1f4e79", markersize=4)
        unit = "m/s" if isinstance(response, slalom.Velocity) else "m/s$^2$"
        ax.set(title=title, xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", aspect="equal")
        middle = np.array(unchanged)
        ax.set(xlim=middle[0] + np.array([-width, width]), ylim=middle[1] + np.array([-width, width]))
    figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    draw(Path(__file__).parents[1] / "docs/images/control_obstacles.svg")
