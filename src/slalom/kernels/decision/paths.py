"""Paths of robots as cubic pieces: under a control of a response, committed, observed."""

from typing import Final

import numpy as np

from slalom.base.tolerances import BALL_ROUNDING, REST, REST_DURATION
from slalom.kernels.arrays import Array
from slalom.kernels.decision.tables import BALL_WINDOWS, DecisionSettings, Paths, ResponseTable, Robot, RobotTable
from slalom.kernels.geometry.cubic import copy_into, curvature, restrict, slope, value
from slalom.kernels.jit import inlined, kernel, squared

FOLLOWING_ERROR: Final = 1e-9
"""[m, m/s] A robot within this of its committed manoeuvre follows it exactly, up to rounding. Larger: errors of
execution go unnoticed up to it. Smaller: committed paths move by rounding at every decision."""


@kernel
def ball_of(low: Array, high: Array, middle: Array) -> float:
    """The radius [m] of a ball that holds the box from low to high (3,) [m]; -inf for an empty box.

    Its centre goes into `middle` (3,).
    """
    square = 0.0
    for axis in range(3):
        middle[axis] = 0.5 * (low[axis] + high[axis])
        square += squared(high[axis] - middle[axis])
    return np.sqrt(square) * (1.0 + BALL_ROUNDING) + BALL_ROUNDING if low[0] <= high[0] else -np.inf


@kernel
def predicted_points(shares: Array, states: Array) -> Array:
    """The control points (n, q, 4, d) [m] of paths that are linear in the observed `states` (n, 3, d).

    shares: (q, 4, 3) of position, velocity and acceleration in each control point.
    """
    points = np.empty((len(states), len(shares), 4, states.shape[2]))
    for k in range(len(states)):
        for q in range(len(shares)):
            for c in range(4):
                for axis in range(states.shape[2]):
                    first_two = shares[q, c, 0] * states[k, 0, axis] + shares[q, c, 1] * states[k, 1, axis]
                    points[k, q, c, axis] = first_two + shares[q, c, 2] * states[k, 2, axis]
    return points


@kernel
def bounding_balls(times: Array, points: Array, settings: DecisionSettings, centers: Array, radii: Array) -> None:
    """Bounding balls of a path in windows of the horizon: `centers` (w, 3) [m] and `radii` (w,) [m] are written.

    The path has pieces between `times` (n + 1,) [s] with control points (n, 4, 3) [m]. A window without a piece has the
    radius -inf.
    """
    low = np.empty(3)
    high = np.empty(3)
    for w in range(BALL_WINDOWS):
        a = settings.now + settings.horizon * w / BALL_WINDOWS
        b = settings.now + settings.horizon * (w + 1) / BALL_WINDOWS
        for axis in range(3):
            low[axis] = np.inf
            high[axis] = -np.inf
        for p in range(len(points)):
            first = times[p]
            last = times[p + 1]
            if last <= first or last < a or first > b:
                continue
            e = (max(a, first) - first) / (last - first)
            f = (min(b, last) - first) / (last - first)
            for axis in range(3):
                p0, p1, p2, p3 = restrict(
                    points[p, 0, axis], points[p, 1, axis], points[p, 2, axis], points[p, 3, axis], e, f
                )
                low[axis] = min(low[axis], min(min(p0, p1), min(p2, p3)))
                high[axis] = max(high[axis], max(max(p0, p1), max(p2, p3)))
        radii[w] = ball_of(low, high, centers[w])


@inlined
def unchanged_control(robot: Robot, r: int, responses: ResponseTable, u: Array) -> None:
    """Write the control of response r that changes nothing now into u (3,): the present velocity, or no acceleration.

    The share of the avoidance is a share of the change from it. From the present acceleration, the end of a robot's own
    avoidance would count as a part of the other's. Two robots would then avoid and return by turns.
    """
    for axis in range(3):
        u[axis] = robot.velocity[axis] if responses.each[r].settled_velocity[0] == 0.0 else 0.0


@kernel
def response_path(
    robot: Robot,
    r: int,
    u: Array,
    responses: ResponseTable,
    settings: DecisionSettings,
    until: float,
    paths: Paths,
    row: int,
) -> None:
    """Write the path of a robot under control u (3,) of response r, from now on, into a row of `paths`.

    Pieces that begin later than `until` [s] are left out: the path is right up to then.
    """
    first = responses.first[r]
    last = responses.first[r + 1]
    end = settings.now + (REST_DURATION if settings.shared else responses.knots[last + r])
    for p in range(paths.times.shape[1]):
        paths.times[row, p] = end
    for p in range(last - first):
        paths.times[row, p] = settings.now + responses.knots[first + r + p]
        if responses.knots[first + r + p] > until:
            return
        piece = responses.pieces[first + p]
        for c in range(4):
            for axis in range(3):
                drift = robot.position[axis] + piece.velocity_gain[c] * robot.velocity[axis]
                drift += piece.acceleration_gain[c] * robot.acceleration[axis]
                paths.points[row, p, c, axis] = drift + piece.gain[c] * u[axis]


@kernel
def predict(k: int, robots: RobotTable, settings: DecisionSettings) -> None:
    """Bound the observed path of robot k in windows of the horizon, and note its end position."""
    robot = robots.each[k]
    observed = robots.observed
    velocity = np.empty(3)
    bounding_balls(observed.times[k], observed.points[k], settings, robot.ball_centers[:], robot.ball_radii[:])
    state_on_path(observed, k, settings.now + settings.horizon, robot.end_position[:], velocity)


@kernel
def publish(i: int, robots: RobotTable, settings: DecisionSettings) -> None:
    """Let the others observe the committed path of robot i."""
    committed = robots.committed
    observed = robots.observed
    copy_into(observed.times[i], committed.times[i])
    copy_into(observed.points[i], committed.points[i])
    predict(i, robots, settings)


@kernel
def commit(i: int, r: int, u: Array, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings) -> None:
    """Commit robot i to control u (3,) of response r from now on; other robots observe it at once where shared."""
    robot = robots.each[i]
    response_path(robot, r, u, responses, settings, np.inf, robots.committed, i)
    robot.response = r
    robot.resting = False
    robot.settled = settings.now + max(settings.period, responses.each[r].step)
    copy_into(robot.control[:], u)
    if settings.shared:
        publish(i, robots, settings)


@kernel
def extend(paths: Paths, i: int, until: float, to: float) -> None:
    """Let row i of `paths` last up to `to` [s] if it ends before `until` [s] with a constant velocity."""
    times = paths.times[i]
    points = paths.points[i]
    last = -1
    for p in range(len(points)):
        if times[p + 1] > times[p]:
            last = p
    if last < 0 or times[last + 1] >= until:
        return
    bend = 0.0
    for axis in range(points.shape[2]):
        p0 = points[last, 0, axis]
        p1 = points[last, 1, axis]
        p2 = points[last, 2, axis]
        p3 = points[last, 3, axis]
        bend = max(bend, max(abs(p0 - 2.0 * p1 + p2), abs(p1 - 2.0 * p2 + p3)))
    if bend > FOLLOWING_ERROR:
        return
    longer = (to - times[last]) / (times[last + 1] - times[last])
    for axis in range(points.shape[2]):
        way = longer * (points[last, 3, axis] - points[last, 0, axis])
        for c in range(1, 4):
            points[last, c, axis] = points[last, 0, axis] + way * c / 3.0
    for p in range(last + 1, len(times)):
        times[p] = to


@inlined
def continue_from_state(
    i: int, robots: RobotTable, settings: DecisionSettings, position: Array, velocity: Array
) -> None:
    """Move the committed path of robot i to the state that the robot really has.

    A motion that ends with a constant velocity goes on. The robot repeats the accelerations of the manoeuvre, so an
    error of position stays and an error of velocity drifts. Errors up to FOLLOWING_ERROR are rounding. `position` and
    `velocity` (d,) are buffers.
    """
    robot = robots.each[i]
    times = robots.committed.times[i]
    points = robots.committed.points[i]
    extend(robots.committed, i, settings.now + 1.5 * settings.horizon, settings.now + 2.0 * settings.horizon)
    # Before its path is moved by an error of the measured velocity.
    robot.resting = robot.resting or (robot.stop and rest_of_path(robots.committed, i, settings.now) == 0.0)
    state_on_path(robots.committed, i, settings.now, position, velocity)
    largest = 0.0
    for axis in range(settings.dimension):
        position[axis] = robot.position[axis] - position[axis]
        velocity[axis] = robot.velocity[axis] - velocity[axis]
        largest = max(largest, max(abs(position[axis]), abs(velocity[axis])))
    if not largest > FOLLOWING_ERROR:
        return
    for p in range(len(points)):
        for c in range(4):
            elapsed = times[p] + (times[p + 1] - times[p]) * c / 3.0 - settings.now
            for axis in range(settings.dimension):
                points[p, c, axis] += position[axis] + elapsed * velocity[axis]
    if settings.shared:
        publish(i, robots, settings)


@inlined
def place_on_path(paths: Paths, i: int, t: float) -> tuple[int, float, float]:
    """The piece at time t [s] of row i of `paths`, its duration [s], and the place on it; the last one goes on."""
    times = paths.times
    k = 0
    while k < paths.points.shape[1] - 1 and times[i, k + 1] <= t and times[i, k + 2] > times[i, k + 1]:
        k += 1
    width = times[i, k + 1] - times[i, k]
    return k, width, (t - times[i, k]) / width


@kernel
def state_on_path(paths: Paths, i: int, t: float, position: Array, velocity: Array) -> None:
    """Position and velocity (d,) at time t [s] on row i of `paths`; the last piece that has a length goes on."""
    k, width, x = place_on_path(paths, i, t)
    for axis in range(len(position)):
        p = paths.points[i, k, :, axis]
        position[axis] = value(p[0], p[1], p[2], p[3], x)
        velocity[axis] = slope(p[0], p[1], p[2], p[3], x) / width


@kernel
def acceleration_on_path(paths: Paths, i: int, t: float, acceleration: Array) -> None:
    """Write the acceleration (d,) [m/s^2] at time t [s] on row i of `paths`; at a jump, the value that follows it."""
    k, width, x = place_on_path(paths, i, t)
    for axis in range(len(acceleration)):
        p = paths.points[i, k, :, axis]
        acceleration[axis] = curvature(p[0], p[1], p[2], p[3], x) / (width * width)


@kernel
def rest_of_path(paths: Paths, i: int, now: float) -> float:
    """Time [s] after `now` [s], at least 0, from which row i of `paths` stays where it is; inf if it moves at the end.

    Slower than AT_REST is at rest.
    """
    times = paths.times
    points = paths.points
    rest = np.inf
    for p in range(points.shape[1] - 1, -1, -1):
        width = times[i, p + 1] - times[i, p]
        largest = 0.0
        if not width > 0.0:
            continue
        for c in range(3):
            for axis in range(points.shape[3]):
                largest = max(largest, abs(points[i, p, c, axis] - points[i, p, 3, axis]))
        if largest > REST * width:
            return rest
        rest = max(times[i, p] - now, 0.0)
    return rest
