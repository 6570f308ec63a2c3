"""The sets of controls of a scene that different methods avoid, side by side."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from slalom.base.checks import STATE, has, listing
from slalom.base.errors import InvalidInput
from slalom.decision.methods import method
from slalom.model.limits import admissible_ball
from slalom.model.response import Acceleration, Velocity
from slalom.model.state import State
from slalom.sim import Scenario
from slalom.sim.explanation import kind
from slalom.view.control_space import control_space
from slalom.view.style import COLUMN, INK, PAGE, style, time_scale

SETS: Final = ("vo", "nlvo", "ao", "nao")
"""Methods whose sets are drawn by default; `avo` is a fifth one."""

LEFT: Final = 0.56
"""[inch] Space of the labels at the left of a panel."""
BELOW: Final = 0.4
"""[inch] Space of the labels below a panel."""
ABOVE: Final = 0.2
"""[inch] Space of the title above a panel."""
BAR: Final = 0.6
"""[inch] Space of the colour bar."""
FOOT: Final = 0.25
"""[inch] Space of the legend."""


def sets(
    scene: Scenario,
    t: float | None = None,
    *,
    state: State | None = None,
    methods: Sequence[str] = SETS,
    columns: int = 2,
    resolution: int = 201,
) -> Figure:
    """Draw the control obstacles by which methods define VO, NLVO, AO, NAO and AVO, with the limits of the robot.

    The control is reached at once, for AVO with its lag, and kept up to the horizon. Obstacles are grown by the margin,
    and move as the method predicts.

    Args:
        scene: of which the first robot is drawn, among the obstacles. t: [s] absolute; None: the start.
        state: of the robot at `t`; None: its initial one. methods: names.
        columns: of the page, 1 or 2, that the figure is as wide as. resolution: see `control_space`.

    Raises:
        InvalidInput: no methods, or one with other controls than velocities and accelerations; other columns.
    """
    listing(methods, "names of methods", "methods")
    if columns not in (1, 2) or not methods:
        raise InvalidInput(f"columns, methods: expected 1 or 2, and a method; found {columns!r}, {list(methods)}")
    now, own = scene.start if t is None else float(t), scene.robot
    place = own.state if state is None else state
    has(place, *STATE, "state")
    rows = -(-len(methods) // (2 * columns))
    across, width = -(-len(methods) // rows), PAGE if columns == 2 else COLUMN
    side = (width - BAR) / across - LEFT
    height = FOOT + rows * (BELOW + side + ABOVE)
    with style():
        figure = Figure(figsize=(width, height))
        for k, name in enumerate(methods):
            left = LEFT + k % across * (LEFT + side)
            low = FOOT + BELOW + (rows - 1 - k // across) * (BELOW + side + ABOVE)
            ax = figure.add_axes((left / width, low / height, side / width, side / height))
            _set(ax, scene, name, place, now, resolution)
        tall = height - FOOT - BELOW - ABOVE
        right = (width - 0.8 * BAR) / width
        bar = figure.colorbar(
            time_scale(scene.horizon),
            cax=figure.add_axes((right, (FOOT + BELOW) / height, 0.015, tall / height)),
            spacing="proportional",
        )
        bar.set_label("time to collision [s]")
        bar.ax.tick_params(width=0.5, length=2)
        bar.outline.set_linewidth(0.5)
        marks: list[Any] = [Line2D([], [], color=INK, linewidth=1.3, label="limit of the robot")]
        if any(str(patch.get_gid()).startswith("blocked") for ax in figure.axes for patch in ax.patches):
            marks.append(Patch(facecolor="#35b779", edgecolor=INK, linewidth=0.45, label="blocked by an obstacle"))
        figure.legend(handles=marks, loc="lower center", ncols=2)
    return figure


def _set(ax: Any, scene: Scenario, name: str, state: State, now: float, resolution: int) -> None:
    """Draw the set of one method."""
    navigator = scene.navigator(method(name))
    response = navigator.method.responses(navigator.limits, navigator.period, navigator.holds)[0]
    quantity, most = kind(response), navigator.limits.max_speed
    if quantity.name == "acceleration":
        response, most = Acceleration(), navigator.limits.max_acceleration
    elif isinstance(response, Velocity):
        response = Velocity()
    elif quantity.name != "velocity":
        raise InvalidInput(f"methods: expected those of velocities and accelerations, found {name!r}")
    window = navigator.predict(scene.obstacles, state, now)
    blocked = navigator.control_obstacle(response, window, state)
    limit = admissible_ball(np.zeros(state.dimension), most)
    side = 1.1 * most
    control_space(
        ax,
        blocked=blocked,
        admissible=limit,
        extent=(-side, side, -side, side),
        resolution=resolution,
        decorations=False,
    )
    ax.locator_params(nbins=5)
    ax.set_title(name.upper(), pad=3)
    ax.set_xlabel(f"${quantity.letter}_x$ [{quantity.unit}]")
    ax.set_ylabel(f"${quantity.letter}_y$ [{quantity.unit}]", labelpad=1)
