"""Paths of robots as cubic pieces: under a control of a response, committed, observed."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.neighbours import bounding_balls
from slalom.kernels.decision.tables import DecisionSettings, Paths, ResponseTable, RobotTable
from slalom.kernels.geometry.cubic import copy_into, slope, value
from slalom.kernels.jit import kernel
from slalom.tolerances import REST_DURATION


@kernel
def response_path(
    i: int,
    r: int,
    u: Array,
    robots: RobotTable,
    responses: ResponseTable,
    settings: DecisionSettings,
    paths: Paths,
    row: int,
) -> None:
    """Write the path of robot i under control u (3,) of response r, from now on, into a row of `paths`."""
    first, last = responses.first[r], responses.first[r + 1]
    end = settings.now + (REST_DURATION if settings.shared else responses.knots[last + r])
    for p in range(paths.times.shape[1]):
        paths.times[row, p] = end
    for p in range(last - first):
        paths.times[row, p] = settings.now + responses.knots[first + r + p]
        for c in range(4):
            for axis in range(3):
                paths.points[row, p, c, axis] = (
                    robots.position[i, axis]
                    + responses.velocity_gain[first + p, c] * robots.velocity[i, axis]
                    + responses.gain[first + p, c] * u[axis]
                )


@kernel
def predict(k: int, robots: RobotTable, settings: DecisionSettings) -> None:
    """Bound the observed path of robot k in windows of the horizon, and note its end position."""
    velocity = np.empty(3)
    bounding_balls(
        robots.observed_times[k], robots.observed_points[k], settings, robots.ball_centers[k], robots.ball_radii[k]
    )
    observed = Paths(robots.observed_times, robots.observed_points)
    state_on_path(observed, k, settings.now + settings.horizon, robots.end_position[k], velocity)


@kernel
def commit(i: int, r: int, u: Array, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings) -> None:
    """Commit robot i to control u (3,) of response r from now on; other robots observe it at once where shared."""
    committed = Paths(robots.committed_times, robots.committed_points)
    response_path(i, r, u, robots, responses, settings, committed, i)
    robots.response[i] = r
    copy_into(robots.control[i], u)
    if settings.shared:
        copy_into(robots.observed_times[i], robots.committed_times[i])
        copy_into(robots.observed_points[i], robots.committed_points[i])
        predict(i, robots, settings)


@kernel
def state_on_path(paths: Paths, i: int, t: float, position: Array, velocity: Array) -> None:
    """Position and velocity (d,) at time t [s] on row i of `paths`; the last piece that has a length goes on."""
    times, points, k = paths.times, paths.points, 0
    while k < points.shape[1] - 1 and times[i, k + 1] <= t and times[i, k + 2] > times[i, k + 1]:
        k += 1
    width = times[i, k + 1] - times[i, k]
    x = (t - times[i, k]) / width
    for axis in range(len(position)):
        p0, p1, p2, p3 = points[i, k, 0, axis], points[i, k, 1, axis], points[i, k, 2, axis], points[i, k, 3, axis]
        position[axis] = value(p0, p1, p2, p3, x)
        velocity[axis] = slope(p0, p1, p2, p3, x) / width
