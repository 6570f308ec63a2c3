"""Figure of a run of several robots: all tracks alike, coloured by time."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision.methods import Method
from slalom.kernels.arrays import Flags
from slalom.model.path_goal import PathGoal
from slalom.obstacle.pieces import outline_parts
from slalom.peers import Peer, contender
from slalom.sim import Recording, Scenario, decision_at
from slalom.sim.measure.closest_approach import closest_approaches
from slalom.view.figure import TIMES, column_axes, decision, obstacle_boxes, obstacle_paths, paths
from slalom.view.style import GOAL, INK, NEUTRAL, ROBOT, colour_at, colour_bar, halo, style
from slalom.view.workspace import body, box_of, draw_goal, draw_goal_path, goal_box, label_axes, padded_extent, parts_at

_HEAD: Final = 0.45
"""[inch] Height of the title and the legend of a fleet."""

SIDES: Final = (
    ((0, 1), "center", "bottom"),
    ((0, -1), "center", "top"),
    ((1, 0), "left", "center"),
    ((-1, 0), "right", "center"),
)
"""Sides of a robot for its name, in order: direction, and the alignment of the text."""

_CROSS: Final[dict[str, Any]] = {
    "marker": "x",
    "color": GOAL,
    "linestyle": "none",
    "markersize": 4.5,
    "markeredgewidth": 1.1,
}


def fleet(recording: Recording, *, names: bool = False, title: str | None = None) -> Figure:
    """Draw the tracks of all robots of a run, their bodies at the first and the last time, and their goals.

    The colour is the time, so that robots of one colour were there together; no robot is drawn unlike the others.

    Args:
        names: whether the name of each robot stands beside its start.
        title: by default scenario and method; "" for none.
    """
    times, positions = np.asarray(recording.times), np.asarray(recording.positions)
    scale = ScalarMappable(Normalize(float(times[0]), float(times[-1])), TIMES)
    ends = np.array([times[0], times[-1]])
    goals = recording.goals
    corners = [box_of(parts_at(shape, positions[0, k])) for k, shape in enumerate(recording.shapes)]
    corners += [positions[:, k, :2] for k in range(positions.shape[1])]
    corners += [np.asarray(goal.position(float(times[-1])))[None, :2] for goal in goals]
    corners += [goal.points[:, :2] for goal in goals if isinstance(goal, PathGoal)]
    left, right, low, high = padded_extent(np.concatenate(corners + obstacle_boxes(recording.obstacles, ends)), 0.4)
    with style():
        ax = column_axes((high - low) / (right - left), _HEAD)
        figure = ax.get_figure(root=True)
        assert figure is not None
        obstacle_paths(ax, recording.obstacles, ends, scale)
        for k in range(positions.shape[1]):
            _robot(ax, recording, k, scale)
        for k, goal in enumerate(goals):
            ax.plot(*goal.position(float(times[-1]))[:2], **_CROSS, gid=f"goal-{k}", zorder=4.5)
            draw_goal_path(ax, goal)
        ax.set(xlim=(left, right), ylim=(low, high))
        ax.set_aspect("equal")
        if names:
            _names(ax, recording, positions[0])
        label_axes(ax, "   (seen along z)" if positions.shape[2] == 3 else "")
        colour_bar(scale, ax, "time [s]", MaxNLocator(6, steps=[1, 2, 5, 10]))
        _legend(ax, recording, bool(len(goals)))
        heading = f"{recording.scenario}, {recording.method}" if title is None else title
        figure.text(0.5, 0.985, heading, ha="center", va="top", fontsize=7.5)
    return figure


def _robot(ax: Axes, recording: Recording, k: int, scale: ScalarMappable) -> None:
    """Draw the track of a robot, a ring at its start, which others may end at, and its body at its end."""
    there = recording.steps_of(k)
    times, points = np.asarray(recording.times)[there], np.asarray(recording.positions)[there, k]
    if not len(times):
        return
    pieces = np.stack([points[:-1, :2], points[1:, :2]], axis=1)
    track = LineCollection(list(pieces), array=0.5 * (times[1:] + times[:-1]), linewidths=1.1, zorder=3)
    track.set(cmap=scale.cmap, norm=scale.norm, capstyle="round", gid=f"track-{k}")
    ax.add_collection(track, autolim=False)
    first, last = colour_at(scale, float(times[0])), colour_at(scale, float(times[-1]))
    shape = recording.shapes[k]
    body(ax, parts_at(shape, points[0]), f"start-{k}", zorder=4.4, facecolor="none", edgecolor=first, linewidth=0.9)
    body(ax, parts_at(shape, points[-1]), f"end-{k}", zorder=4.2, facecolor=last, edgecolor=INK, linewidth=0.5)


def _names(ax: Axes, recording: Recording, starts: Array) -> None:
    """Write the name of each robot beside its start: above it, or on the first side where it covers no other name."""
    ax.apply_aspect()
    taken: list[Bbox] = []
    each = enumerate(zip(recording.names, starts, recording.shapes, strict=True))
    for k, (name, start, shape) in [one for one in each if np.isfinite(recording.appeared[one[0]])]:
        text = ax.annotate(name, start[:2], (0, 0), textcoords="offset points", fontsize=5, zorder=8)
        for (x, y), across, up in [*SIDES, SIDES[0]]:
            text.xy = (start[0] + x * shape.bounding_radius, start[1] + y * shape.bounding_radius)
            text.set(position=(x, y), ha=across, va=up)
            box = text.get_window_extent()
            if not box.count_overlaps(taken):
                break
        taken.append(box)
        text.set_path_effects(halo(1.6))
        text.set_gid(f"name-{k}")


def _legend(ax: Axes, recording: Recording, with_goals: bool) -> None:
    """Draw the legend above the axes."""
    middle = TIMES(0.5)
    circle: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 5}
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=middle, linewidth=1.1, label="track"),
        Line2D([], [], **circle, markerfacecolor="white", markeredgecolor=TIMES(0.0), label="start"),
        Line2D([], [], **circle, markerfacecolor=TIMES(1.0), markeredgecolor=INK, label="end"),
    ]
    if with_goals:
        handles.append(Line2D([], [], **_CROSS, label="goal"))
    if any(obstacle.at_rest for obstacle in recording.obstacles):
        handles.append(Patch(facecolor=NEUTRAL, edgecolor=INK, linewidth=0.5, label="obstacle"))
    ax.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.01),
        ncols=len(handles),
        borderaxespad=0.0,
        columnspacing=0.9,
        handlelength=1.2,
        handletextpad=0.4,
    )


def replay(
    recording: Recording,
    scenario: Scenario,
    method: str,
    at: float | None = None,
    names: bool = False,
    uncertainty: bool = False,
) -> Figure:
    """Draw the decision at time `at` [s] after the start; by default the longest held one before the closest approach.

    With several robots, draw the tracks of all, and with `names` their names; with one robot of a peer its track.
    With `uncertainty`, the figure of a decision has the regions that hold obstacles with an uncertainty.

    Raises:
        InvalidInput: a run without a step; a time at which it does not run; a time or uncertainty in a figure of
            tracks; names in one of a decision.
    """
    if len(recording.shapes) == 1:
        recording = recording.only()
    if not len(recording.accelerations):
        raise InvalidInput("--figure: expected a run with at least one step, found a robot that starts at its goal")
    lasts = float(recording.times[-1] - recording.times[0])
    if at is not None and not 0.0 <= at <= lasts:
        raise InvalidInput(f"--figure-at: expected a time of the run, from 0 to {lasts:g} s, found {at:g} s")
    chosen = contender(method, installed=False)
    refuse_unfit(len(recording.shapes), chosen, at, names, uncertainty)
    if len(recording.shapes) > 1:
        return fleet(recording, names=names)
    if not isinstance(chosen, Method):
        goal = recording.goals[0]
        figure = paths(
            recording.times,
            recording.positions[:, 0],
            recording.obstacles,
            robot=recording.shapes[0],
            goal=goal,
            snapshots=6,
        ).get_figure(root=True)
        assert figure is not None
        return figure
    decided = [k for k, row in enumerate(recording.outcomes) if row[0]]
    if at is None:
        closest = min(closest_approaches(recording), default=None)
        approach_time = closest.time if closest is not None else float(recording.times[0])
        early = [k for k in decided if recording.times[k] <= approach_time] or decided
        tight = [k for k in early if recording.outcomes[k][0] == "CONSTRAINED"] or early
        step = max(tight, key=lambda k: (getattr(recording.responses.rows[k][0], "hold", 0.0), k))
    else:
        step = min(decided, key=lambda k: abs(recording.times[k] - recording.times[0] - at))
    replayed = decision_at(recording, scenario, chosen, step)
    elapsed = recording.times[step] - recording.times[0]
    return decision(
        replayed,
        scenario.navigator(chosen),
        scenario.robot.goal,
        track=np.asarray(recording.positions[: step + 1, 0]),
        uncertainty=uncertainty,
        title=f"{recording.scenario}, {method}, {elapsed:.1f} s after the start: {replayed.outcome.name.lower()}",
    )


def refuse_unfit(robots: int, contender: Method | Peer, at: float | None, names: bool, uncertainty: bool) -> None:
    """Raise InvalidInput for what the figure of a run does not have: a time or uncertainty of tracks, names of one."""
    if names and robots == 1:
        raise InvalidInput("--names: expected a run of several robots, found one")
    given = {"--figure-at": at is not None, "--uncertainty": uncertainty}
    if robots > 1 or not isinstance(contender, Method):
        found = f"{robots} robots" if robots > 1 else f"a robot with {contender.name}"
        for option in (name for name, yes in given.items() if yes):
            raise InvalidInput(f"{option}: expected a figure of a decision, found one of the tracks of {found}")


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
                robot = scenario.robots[k]
                (x, y) = positions[k, :2]
                (vx, vy) = velocities[k, :2]
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
