"""Drawing of uncertainty: where an obstacle can be, at times of its prediction."""

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from slalom.obstacle.minkowski import outline_parts
from slalom.obstacle.window import ObstacleWindow
from slalom.shape import Part
from slalom.view.bodies import body
from slalom.view.style import INK

STEPS: Final = 3
"""Predicted times of each obstacle beside the present one; more hide each other."""


def uncertain_regions(ax: Axes, traffic: ObstacleWindow) -> list[Line2D]:
    """Draw the region that holds each obstacle with an uncertainty, now and at STEPS predicted times.

    A region is the body of the obstacle, grown by the radius of its uncertainty.

    Returns:
        The legend entry, which states if no obstacle has an uncertainty.
    """
    known = [(i, one) for i, one in enumerate(traffic.obstacles) if one.uncertainty is not None]
    if not known:
        return [Line2D([], [], linestyle="none", label="no obstacle has an uncertainty")]
    times = np.linspace(0.0, traffic.horizon, STEPS + 1)
    for index, obstacle in known:
        assert obstacle.uncertainty is not None
        for t, radius in zip(times.tolist(), obstacle.uncertainty.radius(times, obstacle.dimension).tolist()):
            if not obstacle.exists(traffic.start + t):
                continue
            grown = [Part(part.corners, part.radius + radius) for part in outline_parts(obstacle, traffic.start + t)]
            opacity = 1.0 - 0.75 * t / traffic.horizon
            properties = {"fill": False, "edgecolor": INK, "linewidth": 0.7, "linestyle": (0, (1, 1.5))}
            body(ax, grown, f"uncertainty-{index}-{t:g}", zorder=2.6, alpha=opacity, **properties)
    shown = ", ".join(f"{t:.3g}" for t in times)
    return [Line2D([], [], color=INK, linewidth=0.7, linestyle=(0, (1, 1.5)), label=f"uncertainty, {shown} s")]
