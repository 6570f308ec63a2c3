"""The table of robots: states, limits, targets, bounds, committed and observed paths."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slalom import kernels
from slalom.checks import Array, vector
from slalom.goal import Goal
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import (
    Bounds,
    DecisionSettings,
    GrownBodies,
    Paths,
    Robot,
    RobotTable,
    TargetPaths,
)
from slalom.kernels.records import Records, zero_records
from slalom.limits import Limits
from slalom.linear_forecast import piecewise_polynomial
from slalom.obstacle.tracks import Tracks
from slalom.path import Path
from slalom.state import State
from slalom.tolerances import GOLDEN_ANGLE, SAME_POSITION
from slalom.trajectory import PiecewisePolynomial, Stationary


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
    each = zero_records(Robot, n)
    each["number"], each["next_image"], each["priority"], each["present"] = np.arange(n), -1, 1.0, True
    each["settled"], each["response"] = np.inf, -1
    return RobotTable(
        each=each,
        committed=Paths(np.zeros((n, committed + 1)), np.zeros((n, committed, 4, 3))),
        observed=Paths(np.zeros((n, observed + 1)), np.zeros((n, observed, 4, 3))),
    )


class RobotRow(NamedTuple):
    """Views of the fields of one robot in a table, of which each decision writes or reads all.

    To find a field of records by its name takes five times as long as to write it.
    """

    position: Array  # (d,), as the next six
    velocity: Array
    acceleration: Array
    target: Array
    wanted: Array
    control: Array
    preferred: Array
    max_speed: Array  # (1,), as the rest
    margin: Array
    margin_among: Array
    enough: Array
    tolerance: Array
    stop: Flags
    moving: Flags
    final: Flags
    objective: Indices
    settled: Array
    resting: Flags
    response: Indices
    outcome: Indices
    work: Array


VECTORS = 7
"""The fields of `RobotRow` that are vectors, which are the first ones."""


def robot_row(each: Records[Robot], k: int, dimension: int) -> RobotRow:
    """The views of the robot in row k of a table."""
    vectors = [each[name][k, :dimension] for name in RobotRow._fields[:VECTORS]]
    return RobotRow(*vectors, *(each[name][k : k + 1] for name in RobotRow._fields[VECTORS:]))


def states_on_paths(paths: Paths, t: float) -> tuple[Array, Array]:
    """Velocities (n, 3) [m/s] and positions (n, 3) [m] at time t [s] on paths."""
    times, rows = paths.times, np.arange(len(paths.times))
    piece = np.minimum((times[:, 1:] < t).sum(axis=1), paths.points.shape[1] - 1)
    begin = times[rows, piece]
    width = (times[rows, piece + 1] - begin)[:, None]
    x, p = (t - begin)[:, None] / np.where(width > 0.0, width, 1.0), paths.points[rows, piece]
    p0, p1, p2, p3 = p[:, 0], p[:, 1], p[:, 2], p[:, 3]
    slope = (1 - x) ** 2 * (p1 - p0) + 2 * x * (1 - x) * (p2 - p1) + x * x * (p3 - p2)
    position = (1 - x) ** 3 * p0 + 3 * x * (1 - x) ** 2 * p1 + 3 * x * x * (1 - x) * p2 + x**3 * p3
    return 3.0 * slope / np.where(width > 0.0, width, 1.0), position


def reaches(each: Records[Robot], horizon: float) -> Array:
    """How far (n,) [m] from its position the body of each robot can be within the horizon [s]."""
    # No response makes a robot faster that exceeds its maximum speed.
    speed = np.maximum(each["max_speed"], np.linalg.norm(each["velocity"], axis=1))
    return np.asarray(speed * horizon + each["radius"])


def observe(robots: RobotTable, others: Tracks, times: Array, points: Array) -> None:
    """Put others into all rows but the first: on their predicted paths, see `Tracks.paths`.

    Pieces without duration fill the rest of the rows.
    """
    d, states, each = others.dimension, others.states, robots.each[1:]
    each["position"][:, :d], each["velocity"][:, :d] = states[:, 0], states[:, 1]
    each["acceleration"][:, :d], each["priority"] = states[:, 2], 1.0
    each["rounding"] = each["radius"] = others.radii
    q = points.shape[1]
    robots.observed.times[1:] = times[:, -1:]
    robots.observed.times[1:, : q + 1], robots.observed.points[1:, :q, :, :d] = times, points


def observed_path(robots: RobotTable, j: int, k: int, dimension: int) -> PiecewisePolynomial:
    """The path of the robot in row j as the one in row k predicts it.

    Two robots at the same position have no direction from each other, and would leave in the same one. They count as
    displaced by SAME_POSITION, each in a direction of its own.
    """
    points, each = robots.observed.points[j, ..., :dimension], robots.each["position"]
    if np.linalg.norm(each[j] - each[k]) < SAME_POSITION:
        angles = GOLDEN_ANGLE * np.array([j, k])
        directions = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)[:, :dimension]
        points = points + SAME_POSITION * (directions[0] - directions[1])
    return piecewise_polynomial(robots.observed.times[j], points)


def stop_observed(kind: int, robots: RobotTable, bodies: GrownBodies, settings: DecisionSettings) -> None:
    """Let robots with a kind of skeleton, by which `bodies` are grown, stop at obstacles if they are predicted so."""
    if settings.stops_at_obstacles and len(bodies.passive):
        kernels.stop_at_obstacles(kind, robots, bodies, settings)


def commit_to(robots: RobotTable, k: int, path: Path) -> None:
    """Commit the robot in row k to a path that has no more pieces than the table."""
    count, d = path.points.shape[0], path.points.shape[2]
    times, points = robots.committed
    times[k] = path.times[-1]
    times[k, :count] = path.times[:-1]
    points[k, :count, :, :d] = path.points


def publish(robots: RobotTable, k: int) -> None:
    """Let the others observe the committed path of the robot in row k, and its images on it."""
    committed, observed, each, row = robots.committed, robots.observed, robots.each, k
    p = committed.points.shape[1]
    while row >= 0:
        observed.times[row] = committed.times[k, -1]
        observed.times[row, : p + 1] = committed.times[k]
        observed.points[row, :p] = committed.points[k] + (each["position"][row] - each["position"][k])
        row = int(each["next_image"][row])


def committed_path(robots: RobotTable, k: int, dimension: int) -> Path:
    """The committed path of the robot in row k, as a copy."""
    times, points = robots.committed.times[k], robots.committed.points[k]
    # After the last piece its end is repeated.
    count = int(times.searchsorted(times[-1]))
    # Whole rows are copied three times as fast as their first columns.
    return Path(times[: count + 1].copy(), points[:count].copy()[..., :dimension], np.zeros(count))
