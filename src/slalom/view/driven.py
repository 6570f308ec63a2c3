"""Figure of a drive: the path of a robot among obstacles, and the commands that it was given."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from slalom.goal import Goal
from slalom.obstacle import Obstacle
from slalom.shape import Shape
from slalom.view.figure import paths
from slalom.view.style import GOAL, INK, PAGE, ROBOT, style


def driven(
    times: npt.ArrayLike,
    positions: npt.ArrayLike,
    obstacles: Sequence[Obstacle],
    *,
    robot: Shape,
    goal: Goal | None,
    commands: Mapping[str, npt.ArrayLike],
) -> Figure:
    """Draw the path of a robot to the left, and its commands over time to the right.

    Args:
        times: (n,) [s], increasing. positions: (n, 2) [m].
        obstacles: those that it met, on their trajectories.
        commands: values (n,) by label, each in a panel.

    Raises:
        InvalidInput: as `paths`.
    """
    with style():
        figure = Figure(figsize=(PAGE, 0.48 * PAGE), layout="constrained")
        grid = figure.add_gridspec(max(len(commands), 1), 2, width_ratios=(1.5, 1.0))
        left = figure.add_subplot(grid[:, 0])
        paths(times, positions, obstacles, robot=robot, goal=goal, ax=left)
        since = np.asarray(times, dtype=np.float64) - np.asarray(times, dtype=np.float64)[0]
        for k, (label, values) in enumerate(commands.items()):
            ax = figure.add_subplot(grid[k, 1])
            ax.step(since, np.asarray(values, dtype=np.float64), where="post", color=(ROBOT, GOAL, INK)[k % 3], lw=0.9)
            ax.set_ylabel(label)
            ax.margins(x=0.0)
        figure.axes[-1].set_xlabel("time since the first command [s]")
    return figure
