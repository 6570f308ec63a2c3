"""Claim `crossing`: how often one constant acceleration crosses the roundabout, and how often AO and NAO find one."""

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from joblib import Parallel, delayed

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.model.limits import admissible_ball
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.paper.controller import RESPONSE, RIM_RADIUS, ROBOT_DISC, Rules, hits, preferred_acceleration, run
from slalom.sim.gallery import build
from slalom.sim.measure.metrics import COLLISION

START: Final = State((-RIM_RADIUS, 0.0), (5.0, 0.0))
"""Initial state on the rim, heading for the centre, as in the gallery."""
LIMITS: Final = (2.0, 3.0, 4.0)
"""[m/s^2] Acceleration limits."""
SPEEDS: Final = (1.0, 1.5)
"""[1] Speed factors of the cars, times the gallery's 5, 6.5 and 8 m/s."""
ENTRY_SPEEDS: Final = (3.0, 5.0, 8.0)
"""[m/s] Speeds of the robot on the rim."""
CROSSING_HORIZON: Final = 12.0
"""[s] Longer than the duration of any crossing."""
STEP: Final = 0.1
"""[m/s^2] Spacing of the grid of accelerations."""
COARSE_STEP: Final = 1.0
"""[m/s^2] Spacing of the preferred accelerations of the exact selection, which is used if the grid finds none."""
BATCH: Final = 10


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
    work = [(speed, seed) for speed in SPEEDS for seed in range(seeds)]
    rows = []
    calls = (delayed(one_seed)(seed, speed, entries) for speed, seed in work)
    for row in Parallel(n_jobs=jobs, return_as="generator", batch_size=BATCH)(calls):
        rows.append(row)
        advance(len(rows) / len(work))
    tables = [
        {"lane_speed": speed, **_counted([row for row, (v, _) in zip(rows, work) if v == speed], entries)}
        for speed in SPEEDS
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
