"""The figure of docs/vehicles.md with ways from pose to pose, made from the cases of benchmarks/parking.py.

usage: python tools/ways_figure.py [docs/images/ways.png]
"""

import sys
from pathlib import Path

import numpy as np
import shapely
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from slalom.vehicle.curves import along, length_of, reversals
from slalom.vehicle.sweep import outline

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))
from parking import Case, changing, dock, parallel  # noqa: E402

CASES = {
    "a gap of 5.5 m for a car of 4.5 m": (parallel(np.random.default_rng(1), (5.5, 5.5)), (-7.5, 7.5), (-2.0, 6.0)),
    "from slot to slot": (changing(np.random.default_rng(7)), (-6.5, 12.5), (-6.0, 7.5)),
    "a dock with 0.1 m at each side": (dock(np.random.default_rng(3)), (-4.2, 4.2), (-1.0, 6.2)),
}


def drawn(axes: Axes, case: Case, title: str) -> None:
    """Draw obstacles, bodies along the way, its start (blue) and its goal (green)."""
    way = case.found().way
    assert way is not None
    for obstacle in case.obstacles:
        axes.fill(*shapely.get_coordinates(obstacle).T, color="0.75", lw=0)
    center, lever = case.options.get("center", 0.0), 0.5 * case.body.length
    total = length_of(way, lever)
    poses = along(case.start, way, np.linspace(0.0, total, 45), lever)
    line = along(case.start, way, np.linspace(0.0, total, 2000), lever)
    for pose, color, width in [*((one, "0.45", 0.4) for one in poses), (poses[0], "C0", 1.8), (poses[-1], "C2", 1.8)]:
        middle = pose[:2] + center * np.array([np.cos(pose[2]), np.sin(pose[2])])
        axes.plot(*shapely.get_coordinates(outline(case.body, middle, pose[2])).T, color=color, lw=width)
    axes.plot(line[:, 0], line[:, 1], color="C3", lw=1.5)
    axes.set_title(f"{title}\nchanges of direction: {reversals(way)}", fontsize=9)


def main() -> None:
    """Write the figure."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images" / "ways.png"
    figure, panels = plt.subplots(1, 3, figsize=(11.0, 3.6), layout="constrained")
    for axes, (title, (case, x, y)) in zip(panels, CASES.items()):
        drawn(axes, case, title)
        axes.set(xlim=x, ylim=y, aspect="equal", xlabel="x [m]")
    panels[0].set_ylabel("y [m]")
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main()
