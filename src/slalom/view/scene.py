"""Picture of robots and obstacles at one time, for environments that show each step."""

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from slalom.checks import Array
from slalom.kernels.arrays import Flags
from slalom.obstacle.minkowski import outline_parts
from slalom.sim.scenario import Scenario
from slalom.view.bodies import body, box_of, parts_at
from slalom.view.extent import padded_extent
from slalom.view.goals import draw_goal, goal_box
from slalom.view.style import INK, NEUTRAL, ROBOT, style
from slalom.view.workspace import label_axes

SIDE, DOTS = 4.8, 100
"""[inch] Width and height of the picture, and its resolution [dots per inch]."""


class Picture:
    """Picture of a scenario, drawn anew for each time; the axes hold what is there at the start.

    Args:
        window: whether to open a window of matplotlib. A backend without windows draws and shows nothing.
    """

    def __init__(self, scenario: Scenario, *, window: bool = False) -> None:
        self._scenario, self._window = scenario, window
        if window:
            # Only a window needs pyplot, which keeps global state.
            from matplotlib import pyplot

            self.figure: Figure = pyplot.figure(figsize=(SIDE, SIDE), dpi=DOTS)
        else:
            self.figure = Figure(figsize=(SIDE, SIDE), dpi=DOTS)
            FigureCanvasAgg(self.figure)
        with style():
            self._axes = self.figure.add_axes((0.13, 0.11, 0.84, 0.83))
        boxes = [box_of(parts_at(robot.shape, robot.state.position)) for robot in scenario.robots]
        boxes += [goal_box(r.goal, scenario.start) for r in scenario.robots]
        boxes += [box_of(outline_parts(o, scenario.start)) for o in scenario.obstacles if o.exists(scenario.start)]
        self._extent = padded_extent(np.concatenate(boxes), 1.0)

    def draw(self, positions: Array, velocities: Array, there: Flags, now: float) -> None:
        """Draw robots at `positions` (n, d) [m], those that are `there` (n,), and obstacles at `now` [s].

        An arrow shows the displacement in one second.
        """
        ax, scenario = self._axes, self._scenario
        with style():
            ax.clear()
            for k, obstacle in enumerate(scenario.obstacles):
                if obstacle.exists(now):
                    parts = outline_parts(obstacle, now)
                    body(ax, parts, f"obstacle-{k}", facecolor=NEUTRAL, edgecolor=INK, linewidth=0.5, zorder=3)
            for k in np.flatnonzero(there).tolist():
                robot, (x, y), (vx, vy) = scenario.robots[k], positions[k, :2], velocities[k, :2]
                draw_goal(ax, robot.goal, now, now, now)
                parts = parts_at(robot.shape, positions[k])
                body(ax, parts, f"robot-{k}", facecolor=ROBOT, edgecolor=INK, linewidth=0.6, zorder=5)
                if np.hypot(vx, vy) > 0.0:
                    ends = ((x, y), (x + vx, y + vy))
                    arrow = FancyArrowPatch(*ends, arrowstyle="-|>", mutation_scale=6, color=INK, shrinkA=0, shrinkB=0)
                    arrow.set_zorder(6)
                    ax.add_patch(arrow)
            left, right, low, high = self._extent
            ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
            label_axes(ax, "" if scenario.dimension == 2 else "   (seen along z)")
            ax.set_title(f"{scenario.name}, {now - scenario.start:.1f} s", pad=4)

    def pixels(self) -> npt.NDArray[np.uint8]:
        """The picture (height, width, 3) as red, green and blue."""
        canvas: Any = self.figure.canvas
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def show(self) -> None:
        """Show the picture in its window."""
        canvas: Any = self.figure.canvas
        canvas.draw()
        if canvas.manager is not None and canvas.required_interactive_framework is not None:
            canvas.manager.show()
        canvas.flush_events()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window:
            from matplotlib import pyplot

            pyplot.close(self.figure)
