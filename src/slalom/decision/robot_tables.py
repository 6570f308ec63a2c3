"""The table of robots: states, limits, targets, bounds, committed and observed paths."""

from collections.abc import Sequence

import numpy as np

from slalom.checks import Array, vector
from slalom.goal import Goal
from slalom.kernels.arrays import Flags
from slalom.kernels.decision.tables import Bounds, RobotTable, TargetPaths
from slalom.limits import Limits
from slalom.obstacle.tracks import Tracks
from slalom.path import Path
from slalom.state import State
from slalom.tolerances import BALL_WINDOWS
from slalom.trajectory import Stationary


def target_paths(goals: Sequence[Goal], start: float, end: float) -> tuple[TargetPaths, Flags]:
    """The motion of goals from `start` to `end` [s]; and which of them move then (n,)."""
    first, times, points = [0], [], []
    for goal in goals:
        begin, last = max(start, goal.trajectory.span[0]), min(end, goal.trajectory.span[1])
        if isinstance(goal.trajectory, Stationary) or not begin < last:
            first.append(first[-1])
            times.append(np.zeros(1))
            continue
        path = goal.trajectory.path(begin, last)
        wide = np.zeros((len(path.points), 4, 3))
        wide[..., : path.points.shape[2]] = path.points
        first.append(first[-1] + len(wide))
        times.append(path.times)
        points.append(wide)
    none = np.empty((0, 4, 3))
    paths = TargetPaths(np.array(first), np.concatenate([np.empty(0), *times]), np.concatenate([none, *points]))
    return paths, np.diff(paths.first) > 0


def bounds_of(limits: Sequence[Limits], states: Sequence[State]) -> Bounds:
    """The half-spaces of robots with these limits in these states, as they stand now.

    Raises:
        InvalidInput: a bound of another dimension than the states.
    """
    first, rows = [0], list[Array]()
    for each, state in zip(limits, states, strict=True):
        count = first[-1]
        for of, flats in enumerate((each.velocity_bounds, each.acceleration_bounds)):
            for flat in flats:
                normal = vector(flat.normal, "normal of a bound", state.dimension)
                rows.append(_rows(of, 0, normal[None], np.array([flat.offset])))
                count += 1
        for bound in each.bounds:
            rows.append(_rows(int(bound.of == "acceleration"), 1, *bound.half_spaces(state)))
            count += len(rows[-1])
        first.append(count)
    return Bounds(np.array(first), np.concatenate([np.empty((0, 6)), *rows]))


def _rows(of: int, turns: int, normals: Array, offsets: Array) -> Array:
    rows = np.zeros((len(offsets), 6))
    rows[:, 0], rows[:, 1], rows[:, 5] = of, turns, offsets
    rows[:, 2 : 2 + normals.shape[1]] = normals
    return rows


def robot_table(n: int, committed: int, observed: int) -> RobotTable:
    """A table of n robots whose paths have up to that many pieces; all values 0, no robot committed."""
    return RobotTable(
        position=np.zeros((n, 3)),
        velocity=np.zeros((n, 3)),
        acceleration=np.zeros((n, 3)),
        kind=np.zeros(n, np.int64),
        skeleton=np.zeros(n, np.int64),
        rounding=np.zeros(n),
        radius=np.zeros(n),
        margin=np.zeros(n),
        priority=np.ones(n),
        world=np.zeros(n, np.int64),
        max_speed=np.zeros(n),
        max_acceleration=np.zeros(n),
        braking=np.zeros(n),
        target=np.zeros((n, 3)),
        tolerance=np.zeros(n),
        stop=np.zeros(n, np.bool_),
        moving=np.zeros(n, np.bool_),
        final=np.zeros(n, np.bool_),
        objective=np.zeros(n, np.int64),
        wanted=np.zeros((n, 3)),
        present=np.ones(n, np.bool_),
        committed_times=np.zeros((n, committed + 1)),
        committed_points=np.zeros((n, committed, 4, 3)),
        observed_times=np.zeros((n, observed + 1)),
        observed_points=np.zeros((n, observed, 4, 3)),
        ball_centers=np.zeros((n, BALL_WINDOWS, 3)),
        ball_radii=np.zeros((n, BALL_WINDOWS)),
        end_position=np.zeros((n, 3)),
        regret=np.full(n, np.inf),
        response=np.full(n, -1),
        control=np.zeros((n, 3)),
        preferred=np.zeros((n, 3)),
        work=np.zeros(n),
        outcome=np.zeros(n, np.int64),
    )


def observe(robots: RobotTable, others: Tracks, times: Array, points: Array) -> None:
    """Put others into all rows but the first: on their predicted paths, see `Tracks.paths`.

    Nothing is known of their limits: they are taken to be as fast as any.
    """
    d, states = others.dimension, others.states
    robots.position[1:, :d], robots.velocity[1:, :d], robots.acceleration[1:, :d] = (
        states[:, 0],
        states[:, 1],
        states[:, 2],
    )
    robots.rounding[1:], robots.radius[1:], robots.max_speed[1:] = others.radii, others.radii, np.inf
    robots.observed_times[1:], robots.observed_points[1:, ..., :d], robots.priority[1:] = times, points, 1.0


def commit_to(robots: RobotTable, k: int, path: Path) -> None:
    """Commit the robot in row k to a path that has no more pieces than the table."""
    count, d = path.points.shape[0], path.points.shape[2]
    robots.committed_times[k] = path.times[-1]
    robots.committed_times[k, :count] = path.times[:-1]
    robots.committed_points[k, :count, :, :d] = path.points


def publish(robots: RobotTable, k: int) -> None:
    """Let the others observe the committed path of the robot in row k."""
    p = robots.committed_points.shape[1]
    robots.observed_times[k] = robots.committed_times[k, -1]
    robots.observed_times[k, : p + 1] = robots.committed_times[k]
    robots.observed_points[k, :p] = robots.committed_points[k]


def committed_path(robots: RobotTable, k: int, dimension: int) -> Path:
    """The committed path of the robot in row k, as a copy."""
    times = robots.committed_times[k]
    count = int(np.count_nonzero(times[1:] > times[:-1]))
    points = robots.committed_points[k, :count, :, :dimension]
    return Path(times[: count + 1].copy(), points.copy(), np.zeros(count))
