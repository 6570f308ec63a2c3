"""Figures of the roundabout with 30 cars: crossed with one constant acceleration, and left by the top exit."""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.model.goal import Goal
from slalom.model.limits import admissible_ball
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.window import ObstacleWindow
from slalom.paper import drawing
from slalom.paper.claims_crossing import START, clearances, crossing, exits, grid
from slalom.paper.controller import MARGIN, RESPONSE, RIM_RADIUS, Rules, preferred_acceleration, run
from slalom.sim import Scenario
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import positions_at
from slalom.view import control_space, workspace
from slalom.view.style import FAINT, PAGE, ROBOT, style

HORIZON: Final = 6.0
LIMIT: Final = 4.0
"""[m/s^2] Acceleration limit."""
VIEW: Final = (-29.0, 29.0, -29.0, 29.0)
SPAN: Final = (-4.8, 4.8, -4.8, 4.8)
CROSSING_SEED: Final = 39
"""Seed of the drawn crossing."""
EXIT_SEED: Final = 26
"""Seed of the drawn exit."""
DRAWN_CLEARANCE: Final = 0.25
"""[m] Minimum clearance of the drawn crossing."""
DRAWN_DECISIONS: Final = (0, 2, 4)
"""Indices of the drawn decisions of the run to the exit."""
CROSSING_LABELS: Final = ((-14.0, 22.0), (-14.0, 22.0))
EXIT_LABELS: Final = ((18.0, 13.0), (18.0, 13.0), (34.0, -30.0))
"""[pt] Labels of the chosen accelerations from them: the free set there may be narrower than a marker."""
PREFERRED_LABELS: Final = ((0.0, -11.0), (10.0, -11.0), (27.0, 1.0))
"""[pt] Labels of the preferred accelerations from them, within the circle of the limit."""
REPLAN: Final = 1.0
"""[s] Interval between decisions of the run to the exit."""


class Snapshot(NamedTuple):
    """Content of one column: time [s], state of the robot, preferred and chosen acceleration (2,) [m/s^2].

    `label` and `preferred_label` are the offsets [pt] of their labels.
    """

    now: float
    state: State
    preferred: Array | None
    chosen: Array
    label: tuple[float, float]
    preferred_label: tuple[float, float] = (0.0, 0.0)


def one_acceleration(scenario: Scenario) -> Array:
    """Return the acceleration (2,) of a grid with clearance DRAWN_CLEARANCE whose exit is nearest to the goal."""
    candidates = grid(LIMIT)
    candidates = candidates[crossing(candidates)]
    candidates = candidates[clearances(scenario.obstacles, candidates) >= DRAWN_CLEARANCE]
    return np.asarray(candidates[np.argmin(np.abs(exits(candidates)[:, 1]))])


def roundabout_crossing() -> Figure:
    """Draw the free set at two times of a crossing with one acceleration, chosen at the start and held."""
    scenario = build("roundabout_crossing", seed=CROSSING_SEED)
    goal = np.array([RIM_RADIUS, 0.0])
    chosen = one_acceleration(scenario)
    snapshots = []
    for now, label in zip((0.0, 2.0), CROSSING_LABELS):
        position_now = START.position + now * (START.velocity + 0.5 * now * chosen)
        state = State(position_now, START.velocity + now * chosen, chosen)
        snapshots.append(Snapshot(now, state, None, chosen, label))
    return _figure(scenario, snapshots, goal)


def roundabout_exit() -> Figure:
    """Draw three decisions of a run that enters on the left and leaves at the top, with a decision every second."""
    scenario = build("roundabout_exit", seed=EXIT_SEED)
    goal = np.array([0.0, RIM_RADIUS])
    done = run(
        Rules("nao", REPLAN, keep=False, max_acceleration=LIMIT, horizon=HORIZON), scenario.obstacles, START, goal
    )
    record = done.recording
    snapshots = []
    for k, *labels in zip(DRAWN_DECISIONS, EXIT_LABELS, PREFERRED_LABELS):
        state = State(record.positions[k, 0], record.velocities[k, 0])
        preferred = preferred_acceleration(state, goal, LIMIT)
        snapshots.append(Snapshot(float(record.times[k]), state, preferred, record.accelerations[k, 0], *labels))

    def track(until: float) -> Array:
        return positions_at(record, 0, np.linspace(0.0, until, 81))

    return _figure(scenario, snapshots, goal, track)


def _figure(
    scenario: Scenario, snapshots: Sequence[Snapshot], goal: Array, track: Callable[[float], Array] | None = None
) -> Figure:
    """Draw a column for each snapshot: workspace above, accelerations below."""
    with style():
        figure, above, below = _columns(len(snapshots))
        for upper, lower, snapshot in zip(above, below, snapshots):
            traffic = ObstacleWindow(scenario.obstacles, snapshot.now, HORIZON)
            blocked = ControlObstacle(RESPONSE, snapshot.state, traffic, Disc(1.0), MARGIN)
            past = None if track is None else track(snapshot.now)
            _workspace(upper, blocked, snapshot, goal, past)
            control_space(
                lower,
                blocked=blocked,
                admissible=admissible_ball((0.0, 0.0), LIMIT),
                preferred=snapshot.preferred,
                extent=SPAN,
                resolution=201,
                decorations=False,
            )
            drawing.pointed_control(lower, snapshot.chosen, "chosen", offset=snapshot.label)
            if snapshot.preferred is not None:
                drawing.label(lower, snapshot.preferred, "preferred", offset=snapshot.preferred_label, color=ROBOT)
            drawing.name_axes(lower, "a", "m/s²")
            for outline in lower.collections:
                # The outlines of 30 cars would hide the free set.
                outline.remove()
        # The cars above have times to collision only where there is a preferred acceleration.
        first, last = below[-1], (below if snapshots[0].preferred is None else above)[-1]
        height = (last.get_position().y1 - first.get_position().y0) / first.get_position().height
        drawing.time_bar(first, HORIZON, "time to collision [s]", height=height)
    return figure


def _columns(count: int) -> tuple[Figure, list[Axes], list[Axes]]:
    """Return a figure with two rows of `count` square panels, across a page from three columns on."""
    gap = 0.47
    base = 0.4
    middle = 0.46
    top = 0.24
    right = 0.55
    width = PAGE if count > 2 else 0.75 * PAGE
    side = (width - 0.44 - right - gap * (count - 1)) / count
    total_height = base + side + middle + side + top
    figure = Figure(figsize=(width, total_height))
    rows: list[list[Axes]] = []
    for y in (base + side + middle, base):
        lefts = (0.44 + k * (side + gap) for k in range(count))
        rows.append([figure.add_axes((x / width, y / total_height, side / width, side / total_height)) for x in lefts])
    return figure, rows[0], rows[1]


def _workspace(ax: Axes, blocked: ControlObstacle, snapshot: Snapshot, goal: Array, track: Array | None) -> None:
    """Draw the workspace of one snapshot, without a legend."""
    traffic, state = blocked.obstacles, snapshot.state
    workspace(
        ax,
        traffic=traffic,
        state=state,
        robot=blocked.robot,
        goal=Goal(Stationary(goal), 1.0),
        manoeuvre=Manoeuvre(RESPONSE, state, snapshot.chosen, snapshot.now),
        contact_times=None if snapshot.preferred is None else blocked.times_to_collision(snapshot.preferred),
        track=track,
        extent=VIEW,
    )
    for drawn in ax.lines:
        if drawn.get_gid() == "manoeuvre-path":
            # The path passes cars that are elsewhere when the robot is there; its white border would hide them.
            drawn.set(path_effects=[], zorder=2)
    for line in ax.collections:
        # Thirty fading paths on three circles: the circles show the same.
        line.remove()
    for radius in sorted({round(float(np.linalg.norm(o.trajectory.position(0.0))), 6) for o in traffic.obstacles}):
        ax.add_patch(Circle((0.0, 0.0), radius, fill=False, edgecolor=FAINT, linewidth=0.5, zorder=1))
    legend = ax.get_legend()
    if legend is not None:
        legend.remove()
    ax.set_title(f"t = {snapshot.now:g} s", pad=4)
