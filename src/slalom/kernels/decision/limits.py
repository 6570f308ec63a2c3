"""The admissible set of one robot under one response, and whether the committed motion obeys turning bounds."""

import numpy as np

from slalom.base.tolerances import ADMISSIBLE
from slalom.kernels.arrays import Array
from slalom.kernels.decision.paths import state_on_path
from slalom.kernels.decision.tables import Bounds, DecisionSettings, ResponseTable, Robot, RobotTable
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.relative_motion.window import allowed_speed


@inlined
def largest_norm(robot: Robot, p: int, responses: ResponseTable) -> float:
    """The largest norm [m/s or m/s^2] of peak p of its response that a robot may reach."""
    if responses.peaks[p, 1] != 0.0:
        return float(robot.max_acceleration)
    square = squared(robot.velocity[0]) + squared(robot.velocity[1]) + squared(robot.velocity[2])
    settled = responses.each[int(responses.peaks[p, 0])].settled
    return float(allowed_speed(robot.max_speed, np.sqrt(square), robot.braking, settled))


@inlined
def peak_drift(robot: Robot, p: int, axis: int, responses: ResponseTable) -> float:
    """The coordinate of peak p of its response for a robot under control 0."""
    return float(responses.peaks[p, 2] * robot.velocity[axis] + responses.peaks[p, 3] * robot.acceleration[axis])


@kernel
def admissible_set(i: int, r: int, robots: RobotTable, responses: ResponseTable, bounds: Bounds) -> Array:
    """The admissible set (l, 5) of response r for robot i, balls first, see `limits.Limits.admissible`.

    Half-spaces that hold all of the smallest ball are left out.
    """
    robot = robots.each[i]
    flats = 0
    own = range(bounds.first[i], bounds.first[i + 1])
    peaks = range(responses.first_peak[r], responses.first_peak[r + 1])
    balls = len(peaks)
    for p in peaks:
        for b in own:
            flats += bounds.rows[b, 0] == responses.peaks[p, 1]
    rows = np.zeros((balls + flats, 5))
    k = 0
    for p in peaks:
        gain = responses.peaks[p, 4]
        rows[k, 0] = -1.0
        for axis in range(3):
            rows[k, 1 + axis] = -peak_drift(robot, p, axis, responses) / gain
        rows[k, 4] = largest_norm(robot, p, responses) / abs(gain)
        k += 1
    smallest = 0
    for b in range(1, balls):
        smallest = b if rows[b, 4] < rows[smallest, 4] else smallest
    for p in peaks:
        gain = responses.peaks[p, 4]
        for b in own:
            if bounds.rows[b, 0] != responses.peaks[p, 1]:
                continue
            along = 0.0
            center = 0.0
            for axis in range(3):
                along += bounds.rows[b, 2 + axis] * peak_drift(robot, p, axis, responses)
                rows[k, 1 + axis] = bounds.rows[b, 2 + axis] * np.sign(gain)
                center += rows[k, 1 + axis] * rows[smallest, 1 + axis]
            rows[k, 4] = (bounds.rows[b, 5] - along) / abs(gain)
            k += center + rows[smallest, 4] > rows[k, 4]
    return rows[:k]


@kernel
def excess(limits: Array, u: Array) -> float:
    """How far control u (3,) is outside of the boundaries of `limits` (l, 5); not above 0 if it is admissible."""
    most = -np.inf
    for b in range(len(limits)):
        if limits[b, 0] < 0.0:
            square = 0.0
            for axis in range(3):
                square += squared(u[axis] - limits[b, 1 + axis])
            most = max(most, np.sqrt(square) - limits[b, 4])
        else:
            along = limits[b, 1] * u[0] + limits[b, 2] * u[1] + limits[b, 3] * u[2]
            most = max(most, along - limits[b, 4])
    return float(most)


@inlined
def smallest_control_ball(robot: Robot, r: int, responses: ResponseTable) -> tuple[int, float]:
    """The smallest ball that holds all admissible controls of response r: its peak, and its radius.

    The centre is -`peak_drift` / gain. See `limits.Limits.admissible`.
    """
    least = -1
    radius = np.inf
    for p in range(responses.first_peak[r], responses.first_peak[r + 1]):
        size = largest_norm(robot, p, responses) / abs(responses.peaks[p, 4])
        if size < radius:
            least = p
            radius = size
    return least, radius


@inlined
def farthest_control(robot: Robot, r: int, u: Array, responses: ResponseTable) -> float:
    """The largest distance of an admissible control of response r from control u (3,)."""
    p, radius = smallest_control_ball(robot, r, responses)
    square = 0.0
    for axis in range(3):
        square += squared(u[axis] + peak_drift(robot, p, axis, responses) / responses.peaks[p, 4])
    return float(np.sqrt(square) + radius)


@kernel
def obeys_turning_bounds(
    i: int, robots: RobotTable, bounds: Bounds, settings: DecisionSettings, position: Array, velocity: Array
) -> bool:
    """Whether the committed motion of robot i until the next decision obeys the bounds that turn with the robot.

    The rule is that of `limits.Limits.allows`. `position` and `velocity` (d,) are buffers.
    """
    for b in range(bounds.first[i], bounds.first[i + 1]):
        if bounds.rows[b, 1] == 0.0:
            continue
        state_on_path(robots.committed, i, settings.now + settings.period, position, velocity)
        along = 0.0
        for axis in range(settings.dimension):
            x = velocity[axis]
            if bounds.rows[b, 0] != 0.0:
                x = (velocity[axis] - robots.each[i].velocity[axis]) / settings.period
            along += bounds.rows[b, 2 + axis] * x
        if along > bounds.rows[b, 5] + ADMISSIBLE * (1.0 + abs(bounds.rows[b, 5])):
            return False
    return True


@inlined
def is_too_fast(robot: Robot) -> bool:
    """Whether a robot exceeds its speed limit by more than rounding."""
    square = squared(robot.velocity[0]) + squared(robot.velocity[1]) + squared(robot.velocity[2])
    return bool(np.sqrt(square) > robot.max_speed * (1.0 + 10.0 * ADMISSIBLE))


@inlined
def is_measured_at_rest(robot: Robot, dimension: int) -> bool:
    """Whether a robot that stops at its target is measured within its tolerance, at up to that tolerance per second."""
    square = 0.0
    speed = 0.0
    for axis in range(dimension):
        square += squared(robot.target[axis] - robot.position[axis])
        speed += squared(robot.velocity[axis])
    most = robot.tolerance * robot.tolerance
    return bool(robot.stop and not robot.moving and square <= most and speed <= most)


@inlined
def largest_error(robot: Robot, responses: ResponseTable) -> float:
    """The largest error [m] of the cubic pieces of the responses of a robot."""
    error = 0.0
    for r in range(responses.kinds[robot.kind], responses.kinds[robot.kind + 1]):
        error = max(error, responses.each[r].error)
    return error
