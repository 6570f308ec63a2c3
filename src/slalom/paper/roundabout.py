"""The roundabout with 30 cars: crossed with one constant acceleration, and left by the top exit."""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.goal import Goal
from slalom.limits import admissible_ball
from slalom.manoeuvre import Manoeuvre
from slalom.obstacle_table import ObstacleTable
from slalom.paper import drawing
from slalom.paper.claims_crossing import START, clearances, crossing, exits, grid
from slalom.paper.controller import MARGIN, RESPONSE, RING, Rules, preferred_acceleration, run
from slalom.shape import Disc
from slalom.sim import Scenario
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import positions_at
from slalom.state import State
from slalom.trajectory import Stationary
from slalom.view import control_space, workspace
from slalom.view.style import FAINT, PAGE, style

HORIZON: Final = 6.0
LIMIT: Final = 4.0
"""[m/s^2]."""
VIEW: Final = (-29.0, 29.0, -29.0, 29.0)
SPAN: Final = (-4.8, 4.8, -4.8, 4.8)
CROSSED: Final = 39
"""Seed of the crossing that is drawn."""
LEFT: Final = 26
"""Seed of the exit that is drawn."""
CLEAR: Final = 0.25
"""[m] Clearance of the crossing that is drawn."""
SHOWN: Final = (0, 2, 4)
"""Which decisions on the way to the exit."""
REPLAN: Final = 1.0
"""[s] Between decisions on the way to the exit."""


class Moment(NamedTuple):
    """What is drawn of one moment: when, the robot's state, what it wishes, what it does."""

    now: float
    state: State
    preferred: Array | None
    chosen: Array


def one_acceleration(scenario: Scenario) -> Array:
    """The constant acceleration (2,) that keeps CLEAR of everybody and leaves nearest to the goal, on a grid."""
    candidates = grid(LIMIT)
    candidates = candidates[crossing(candidates)]
    candidates = candidates[clearances(scenario.obstacles, candidates) >= CLEAR]
    return np.asarray(candidates[np.argmin(np.abs(exits(candidates)[:, 1]))])


def roundabout_crossing() -> Figure:
    """One acceleration, chosen at the beginning, held until the other side: the free set then and later."""
    scenario = build("roundabout_crossing", seed=CROSSED)
    goal = np.array([RING, 0.0])
    chosen = one_acceleration(scenario)
    moments = []
    for now in (0.0, 2.0):
        place = START.position + now * (START.velocity + 0.5 * now * chosen)
        state = State(place, START.velocity + now * chosen, chosen)
        moments.append(Moment(now, state, None, chosen))
    return _drawn(scenario, moments, goal)


def roundabout_exit() -> Figure:
    """Entered on the left, left at the top; the acceleration is chosen again every second."""
    scenario = build("roundabout_exit", seed=LEFT)
    goal = np.array([0.0, RING])
    done = run(
        Rules("nao", REPLAN, keep=False, max_acceleration=LIMIT, horizon=HORIZON), scenario.obstacles, START, goal
    )
    record = done.recording
    moments = []
    for k in SHOWN:
        state = State(record.positions[k, 0], record.velocities[k, 0])
        wish = preferred_acceleration(state, goal, LIMIT)
        moments.append(Moment(float(record.times[k]), state, wish, record.accelerations[k, 0]))

    def track(until: float) -> Array:
        return positions_at(record, 0, np.linspace(0.0, until, 81))

    return _drawn(scenario, moments, goal, track)


def _drawn(
    scenario: Scenario, moments: Sequence[Moment], goal: Array, track: Callable[[float], Array] | None = None
) -> Figure:
    """A column for each moment: everybody above, the accelerations below."""
    with style():
        figure, above, below = _columns(len(moments))
        for upper, lower, moment in zip(above, below, moments):
            traffic = ObstacleTable(scenario.obstacles, moment.now, HORIZON)
            blocked = ControlObstacle(RESPONSE, moment.state, traffic, Disc(1.0), MARGIN)
            past = None if track is None else track(moment.now)
            _everybody(upper, blocked, moment, goal, past)
            control_space(
                lower,
                blocked=blocked,
                admissible=admissible_ball((0.0, 0.0), LIMIT),
                preferred=moment.preferred,
                chosen=moment.chosen,
                extent=SPAN,
                resolution=201,
                decorations=False,
            )
            drawing.name_axes(lower, "a", "m/s²")
            for outline in lower.collections:
                # The outlines of 30 cars would hide what the figure is about.
                outline.remove()
        drawing.time_bar(below[-1], HORIZON, "time to collision [s]")
        if moments[0].preferred is not None:
            drawing.time_bar(above[-1], HORIZON, "time to collision [s]")
    return figure


def _columns(count: int) -> tuple[Figure, list[Axes], list[Axes]]:
    """Two rows of square panels, across a page if there are three."""
    gap, base, middle, top, right = 0.47, 0.4, 0.46, 0.24, 0.55
    width = PAGE if count > 2 else 0.75 * PAGE
    side = (width - 0.44 - right - gap * (count - 1)) / count
    tall = base + side + middle + side + top
    figure = Figure(figsize=(width, tall))
    rows: list[list[Axes]] = []
    for y in (base + side + middle, base):
        lefts = (0.44 + k * (side + gap) for k in range(count))
        rows.append([figure.add_axes((x / width, y / tall, side / width, side / tall)) for x in lefts])
    return figure, rows[0], rows[1]


def _everybody(ax: Axes, blocked: ControlObstacle, moment: Moment, goal: Array, track: Array | None) -> None:
    """The workspace at one moment, without a legend."""
    traffic, state = blocked.obstacles, moment.state
    workspace(
        ax,
        traffic=traffic,
        state=state,
        robot=blocked.robot,
        goal=Goal(Stationary(goal), 1.0),
        manoeuvre=Manoeuvre(RESPONSE, state, moment.chosen, moment.now),
        contact_times=None if moment.preferred is None else blocked.times_to_collision(moment.preferred),
        track=track,
        extent=VIEW,
    )
    for line in ax.collections:
        # Thirty fading paths on three circles: the circles say the same.
        line.remove()
    for radius in sorted({round(float(np.linalg.norm(o.trajectory.position(0.0))), 6) for o in traffic.obstacles}):
        ax.add_patch(Circle((0.0, 0.0), radius, fill=False, edgecolor=FAINT, linewidth=0.5, zorder=1))
    legend = ax.get_legend()
    if legend is not None:
        legend.remove()
    ax.set_title(f"t = {moment.now:g} s", pad=4)
