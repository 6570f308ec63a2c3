"""The roundabout with 30 cars: the figures of a crossing and an exit, and the claims `crossing` and `smoothness`."""

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.decision.methods import METHODS
from slalom.model.goal import Goal
from slalom.model.limits import admissible_ball
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.paper import drawing
from slalom.paper.controller import (
    BATCH,
    LANE_SPEEDS,
    MARGIN,
    RESPONSE,
    RIM_RADIUS,
    ROBOT_DISC,
    Rules,
    hits,
    preferred_acceleration,
    run,
)
from slalom.sim import Scenario, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import positions_at
from slalom.sim.measure.metrics import COLLISION, METRICS
from slalom.view import control_space, workspace
from slalom.view.style import FAINT, PAGE, ROBOT, style

# Claim `crossing`: how often one constant acceleration crosses the roundabout, and how often AO and NAO find one.


START: Final = State((-RIM_RADIUS, 0.0), (5.0, 0.0))
"""Initial state on the rim, heading for the centre, as in the gallery."""
LIMITS: Final = (2.0, 3.0, 4.0)
"""[m/s^2] Acceleration limits."""
ENTRY_SPEEDS: Final = (3.0, 5.0, 8.0)
"""[m/s] Speeds of the robot on the rim."""
CROSSING_HORIZON: Final = 12.0
"""[s] Longer than the duration of any crossing."""
STEP: Final = 0.1
"""[m/s^2] Spacing of the grid of accelerations."""
COARSE_STEP: Final = 1.0
"""[m/s^2] Spacing of the preferred accelerations of the exact selection, which is used if the grid finds none."""


def grid(limit: float, step: float = STEP) -> Array:
    """Return the accelerations (n, 2) [m/s^2] of norm up to `limit` on a square grid."""
    line = step * np.arange(-round(limit / step), round(limit / step) + 1)
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    return np.asarray(points[np.linalg.norm(points, axis=1) <= limit + 1e-9])


def exits(accelerations: Array, start: State = START) -> Array:
    """Return the points (n, 2) [m] where constant accelerations (n, 2) leave the roundabout.

    Rows are nan for accelerations that do not enter it in the first step or never leave it.
    """
    t = np.arange(0.0, CROSSING_HORIZON + 0.01, 0.02)[:, None]
    found = np.full(accelerations.shape, np.nan)
    for k, u in enumerate(accelerations):
        points = start.position + t * (start.velocity + 0.5 * t * u)
        leaving = np.flatnonzero(np.linalg.norm(points[1:], axis=1) > RIM_RADIUS)
        if leaving.size and leaving[0] > 0:
            found[k] = points[1 + leaving[0]]
    return found


def crossing(accelerations: Array, start: State = START) -> npt.NDArray[np.bool_]:
    """Return whether constant accelerations (n, 2) leave the roundabout on the far side, within 45 degrees of +x."""
    ends = exits(accelerations, start)
    return np.asarray(ends[:, 0] >= np.abs(ends[:, 1]))


def clearances(obstacles: Sequence[Obstacle], accelerations: Array, start: State = START) -> Array:
    """Return the least clearance (n,) [m] to cars on their lanes within CROSSING_HORIZON, for accelerations (n, 2)."""
    blocked = ControlObstacle(RESPONSE, start, ObstacleWindow(obstacles, 0.0, CROSSING_HORIZON), ROBOT_DISC)
    return np.asarray(blocked.clearance(accelerations))


class Crossings(NamedTuple):
    """Accelerations (n, 2) that cross an empty roundabout from a start."""

    start: State
    accelerations: Array

    @property
    def name(self) -> str:
        """Entry speed [m/s] as text."""
        return f"{self.start.velocity[0]:g}"

    def within(self, limit: float) -> npt.NDArray[np.bool_]:
        """Return which accelerations obey a limit [m/s^2]."""
        return np.asarray(np.linalg.norm(self.accelerations, axis=1) <= limit + 1e-9)


def exists_between_grid_points(crossings: Crossings, blocked: ControlObstacle, limit: float) -> bool:
    """Return whether exact selection finds a free crossing, with some of the crossings as preferred accelerations.

    True proves that a free crossing exists; False proves nothing.
    """
    ball = admissible_ball((0.0, 0.0), limit)
    candidates = crossings.accelerations[crossings.within(limit)]
    coarse = np.all(np.abs(candidates / COARSE_STEP - np.round(candidates / COARSE_STEP)) < 1e-6, axis=1)
    choices = (select(u, ball, blocked).control for u in candidates[coarse])
    return any(u is not None and bool(crossing(u[None], crossings.start)[0]) for u in choices)


def one_seed(seed: int, speed: float, entries: Sequence[Crossings]) -> dict[str, Any]:
    """Return counts of free crossings for the cars of one seed, and whether a held first choice collides (AO, NAO)."""
    obstacles = build("roundabout_crossing", {"speed": speed}, seed=seed).obstacles
    traffic = ObstacleWindow(obstacles, 0.0, CROSSING_HORIZON)
    result: dict[str, Any] = {"free": {}, "exists": {}}
    for entry in entries:
        blocked = ControlObstacle(RESPONSE, entry.start, traffic, ROBOT_DISC)
        collision_free = blocked.clearance(entry.accelerations) >= 0.0
        free = {f"{a:g}": int((collision_free & entry.within(a)).sum()) for a in LIMITS}
        result["free"][entry.name] = free
        result["exists"][entry.name] = {
            f"{a:g}": free[f"{a:g}"] > 0 or exists_between_grid_points(entry, blocked, a) for a in LIMITS
        }
    blocked = ControlObstacle(RESPONSE, START, traffic, ROBOT_DISC)
    goal = np.array([RIM_RADIUS, 0.0])
    preferred = preferred_acceleration(START, goal, max(LIMITS))
    result["any"] = {f"{a:g}": select(preferred, admissible_ball((0.0, 0.0), a), blocked).safe for a in LIMITS}
    result["held"] = {}
    for method in ("nao", "ao"):
        # One decision with a horizon of the whole crossing, held to the end.
        done = run(
            Rules(method, CROSSING_HORIZON, horizon=CROSSING_HORIZON),
            obstacles,
            START,
            goal,
            max_duration=CROSSING_HORIZON,
        )
        result["held"][method] = hits(done.recording)[1] < -COLLISION
    return result


def measure_crossing(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure the counts over the seeds for each lane speed; `advance` receives the share done."""
    points = grid(max(LIMITS), 5.0 * STEP if quick else STEP)
    starts = [State(START.position, (v, 0.0)) for v in (ENTRY_SPEEDS[1:2] if quick else ENTRY_SPEEDS)]
    entries = [Crossings(start, points[crossing(points, start)]) for start in starts]
    work = [(speed, seed) for speed in LANE_SPEEDS for seed in range(seeds)]
    rows = []
    calls = (delayed(one_seed)(seed, speed, entries) for speed, seed in work)
    for row in Parallel(n_jobs=jobs, return_as="generator", batch_size=BATCH)(calls):
        rows.append(row)
        advance(len(rows) / len(work))
    tables = [
        {"lane_speed": speed, **_counted([row for row, (v, _) in zip(rows, work) if v == speed], entries)}
        for speed in LANE_SPEEDS
    ]
    return {"seeds": seeds, "step": 5.0 * STEP if quick else STEP, "horizon": CROSSING_HORIZON, "tables": tables}


def _counted(rows: Sequence[dict[str, Any]], entries: Sequence[Crossings]) -> dict[str, Any]:
    """Return the seeds with a free crossing and the mean share of free crossings, by entry speed and limit."""
    exists: dict[str, dict[str, int]] = {}
    share: dict[str, dict[str, float]] = {}
    for entry in entries:
        exists[entry.name] = {f"{a:g}": sum(row["exists"][entry.name][f"{a:g}"] for row in rows) for a in LIMITS}
        share[entry.name] = {
            f"{a:g}": float(np.mean([row["free"][entry.name][f"{a:g}"] for row in rows]))
            / max(1, int(entry.within(a).sum()))
            for a in LIMITS
        }
    return {
        "crossing_exists": exists,
        "share_of_crossings_free": share,
        "anything_is_free": {f"{a:g}": sum(row["any"][f"{a:g}"] for row in rows) for a in LIMITS},
        "held_first_choice_collides": {m: sum(row["held"][m] for row in rows) for m in ("nao", "ao")},
    }


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


class Setting(NamedTuple):
    """A row of the table: method and replan interval [s]."""

    method: str
    replan: float


SETTINGS: Final = tuple(Setting(method, replan) for replan in (0.1, 1.0) for method in ("vo", "nlvo", "ao", "nao"))
NAMES: Final = (
    "collisions",
    "arrived",
    "time",
    "adjustments",
    "mean_acceleration",
    "max_acceleration",
    "mean_jerk",
    "max_jerk",
    "heading_change",
)


def run_metrics(setting: Setting, seed: int, duration: float) -> dict[str, float]:
    """Return the metrics of one run."""
    scenario = build("roundabout_crossing", {"replan": setting.replan, "duration": duration}, seed=seed)
    recording = simulate(scenario, METHODS[setting.method], seed=seed)
    return {name: METRICS[name](recording) for name in NAMES}


def measure_smoothness(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure means over the seeds, and count runs with a collision and runs that arrived."""
    settings, duration = (SETTINGS[-1:], 3.0) if quick else (SETTINGS, 60.0)
    work = [(setting, seed) for setting in settings for seed in range(seeds)]
    rows = []
    for row in Parallel(n_jobs=jobs, return_as="generator")(
        delayed(run_metrics)(s, seed, duration) for s, seed in work
    ):
        rows.append(row)
        advance(len(rows) / len(work))
    table = []
    for setting in settings:
        selected = [row for row, (s, _) in zip(rows, work) if s == setting]
        means = {name: float(np.mean([row[name] for row in selected])) for name in NAMES if name not in ("collisions",)}
        table.append(
            {
                **setting._asdict(),
                "runs": len(selected),
                "runs_with_collision": sum(row["collisions"] > 0 for row in selected),
                "runs_that_arrived": sum(row["arrived"] > 0 for row in selected),
                **{name: value for name, value in means.items() if name != "arrived"},
            }
        )
    return {"seeds": seeds, "duration": duration, "max_acceleration_limit": 4.0, "rows": table}
