"""One constant acceleration crosses the roundabout: how often one exists, and how often AO and NAO find one."""

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from joblib import Parallel, delayed

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.limits import admissible_ball
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.paper.controller import RESPONSE, RING, ROBOT, Rules, hits, preferred_acceleration, run
from slalom.selection import select
from slalom.sim.gallery import build
from slalom.state import State
from slalom.tolerances import COLLISION

START: Final = State((-RING, 0.0), (5.0, 0.0))
"""On the rim, on the way to the centre, as in the gallery."""
LIMITS: Final = (2.0, 3.0, 4.0)
"""[m/s^2]."""
SPEEDS: Final = (1.0, 1.5)
"""Of the cars, times the gallery's 5, 6.5 and 8 m/s."""
ENTRY_SPEEDS: Final = (3.0, 5.0, 8.0)
"""[m/s] Of the robot on the rim."""
HORIZON: Final = 12.0
"""[s] Longer than any crossing takes."""
STEP: Final = 0.1
"""[m/s^2] Between the accelerations that are asked about."""
COARSE: Final = 1.0
"""[m/s^2] Between those from which the exact choice is asked where the grid finds none."""
BATCH: Final = 10


def grid(limit: float, step: float = STEP) -> Array:
    """Accelerations (n, 2) within `limit` on a square grid."""
    line = step * np.arange(-round(limit / step), round(limit / step) + 1)
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    return np.asarray(points[np.linalg.norm(points, axis=1) <= limit + 1e-9])


def exits(accelerations: Array, start: State = START) -> Array:
    """Where constant accelerations (n, 2) lead out of the ring, (n, 2) [m]; nan for those that do not go in at once."""
    t = np.arange(0.0, HORIZON + 0.01, 0.02)[:, None]
    found = np.full(accelerations.shape, np.nan)
    for k, u in enumerate(accelerations):
        place = start.position + t * (start.velocity + 0.5 * t * u)
        leaving = np.flatnonzero(np.linalg.norm(place[1:], axis=1) > RING)
        if leaving.size and leaving[0] > 0:
            found[k] = place[1 + leaving[0]]
    return found


def crossing(accelerations: Array, start: State = START) -> npt.NDArray[np.bool_]:
    """Which constant accelerations (n, 2) lead out of the roundabout on the far side, within 45 degrees of +x."""
    ends = exits(accelerations, start)
    return np.asarray(ends[:, 0] >= np.abs(ends[:, 1]))


def clearances(obstacles: Sequence[Obstacle], accelerations: Array, start: State = START) -> Array:
    """Least clearance (n,) [m] to cars on their lanes within HORIZON under constant accelerations (n, 2)."""
    blocked = ControlObstacle(RESPONSE, start, ObstacleTable(obstacles, 0.0, HORIZON), ROBOT)
    return np.asarray(blocked.clearance(accelerations))


class Crossings(NamedTuple):
    """The accelerations (n, 2) that cross from a start if nobody is in the way."""

    start: State
    accelerations: Array

    @property
    def name(self) -> str:
        """The entry speed [m/s]."""
        return f"{self.start.velocity[0]:g}"

    def within(self, limit: float) -> npt.NDArray[np.bool_]:
        """Which of them obey a limit [m/s^2]."""
        return np.asarray(np.linalg.norm(self.accelerations, axis=1) <= limit + 1e-9)


def between(way: Crossings, blocked: ControlObstacle, limit: float) -> bool:
    """Whether a free crossing lies between the points of the grid: the exact choice, asked from some of the crossings.

    What it finds exists; that it finds none proves nothing.
    """
    ball = admissible_ball((0.0, 0.0), limit)
    asked = way.accelerations[way.within(limit)]
    coarse = np.all(np.abs(asked / COARSE - np.round(asked / COARSE)) < 1e-6, axis=1)
    choices = (select(u, ball, blocked).control for u in asked[coarse])
    return any(u is not None and bool(crossing(u[None], way.start)[0]) for u in choices)


def one_seed(seed: int, speed: float, ways: Sequence[Crossings]) -> dict[str, Any]:
    """What exists for the cars of one seed, and whether the first choice by NAO or AO, held, is hit."""
    obstacles = build("roundabout_crossing", {"speed": speed}, seed=seed).obstacles
    traffic = ObstacleTable(obstacles, 0.0, HORIZON)
    result: dict[str, Any] = {"free": {}, "exists": {}}
    for way in ways:
        blocked = ControlObstacle(RESPONSE, way.start, traffic, ROBOT)
        good = blocked.clearance(way.accelerations) >= 0.0
        free = {f"{a:g}": int((good & way.within(a)).sum()) for a in LIMITS}
        result["free"][way.name] = free
        result["exists"][way.name] = {f"{a:g}": free[f"{a:g}"] > 0 or between(way, blocked, a) for a in LIMITS}
    blocked = ControlObstacle(RESPONSE, START, traffic, ROBOT)
    goal = np.array([RING, 0.0])
    wish = preferred_acceleration(START, goal, max(LIMITS))
    result["any"] = {f"{a:g}": select(wish, admissible_ball((0.0, 0.0), a), blocked).safe for a in LIMITS}
    result["held"] = {}
    for method in ("nao", "ao"):
        # One decision with foresight of the whole crossing, held whatever comes.
        done = run(Rules(method, HORIZON, horizon=HORIZON), obstacles, START, goal, longest=HORIZON)
        result["held"][method] = hits(done.recording)[1] < -COLLISION
    return result


def measure(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Counts over the seeds for each lane speed."""
    points = grid(max(LIMITS), 5.0 * STEP if quick else STEP)
    starts = [State(START.position, (v, 0.0)) for v in (ENTRY_SPEEDS[1:2] if quick else ENTRY_SPEEDS)]
    ways = [Crossings(start, points[crossing(points, start)]) for start in starts]
    work = [(speed, seed) for speed in SPEEDS for seed in range(seeds)]
    rows = []
    calls = (delayed(one_seed)(seed, speed, ways) for speed, seed in work)
    for row in Parallel(n_jobs=jobs, return_as="generator", batch_size=BATCH)(calls):
        rows.append(row)
        advance(len(rows) / len(work))
    tables = [
        {"lane_speed": speed, **_counted([row for row, (v, _) in zip(rows, work) if v == speed], ways)}
        for speed in SPEEDS
    ]
    return {"seeds": seeds, "step": 5.0 * STEP if quick else STEP, "horizon": HORIZON, "tables": tables}


def _counted(rows: Sequence[dict[str, Any]], ways: Sequence[Crossings]) -> dict[str, Any]:
    """Seeds with a free crossing, and the mean share of the crossings that is free, by entry speed and limit."""
    exists: dict[str, dict[str, int]] = {}
    share: dict[str, dict[str, float]] = {}
    for way in ways:
        exists[way.name] = {f"{a:g}": sum(row["exists"][way.name][f"{a:g}"] for row in rows) for a in LIMITS}
        share[way.name] = {
            f"{a:g}": float(np.mean([row["free"][way.name][f"{a:g}"] for row in rows]))
            / max(1, int(way.within(a).sum()))
            for a in LIMITS
        }
    return {
        "crossing_exists": exists,
        "share_of_crossings_free": share,
        "anything_is_free": {f"{a:g}": sum(row["any"][f"{a:g}"] for row in rows) for a in LIMITS},
        "held_first_choice_collides": {m: sum(row["held"][m] for row in rows) for m in ("nao", "ao")},
    }
