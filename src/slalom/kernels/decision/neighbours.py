"""Broad phase among robots: bounding balls of observed paths and of reachable sets, one per window of the horizon.

A row of cubic pieces that no admissible control can collide on changes no choice. The pieces of other robots are
therefore cut to those whose balls come near a robot's own in some window; nothing else is left out. Before that, a cell
list finds the robots that are near at all, see `cell_list`.
"""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.decision.limits import peak_drift, smallest_control_ball
from slalom.kernels.decision.paths import ball_of, bounding_balls, unchanged_control
from slalom.kernels.decision.tables import DecisionSettings, ResponseTable, Robot, RobotTable
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.squared import squared
from slalom.tolerances import BALL_ROUNDING, BALL_WINDOWS, RESPONSE_WINDOWS

STRIDE = RESPONSE_WINDOWS // (2 * BALL_WINDOWS)
"""Windows of responses in half a window of the horizon."""


@kernel
def reachable_balls(
    i: int, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings, centers: Array, radii: Array
) -> None:
    """Bounding balls of the reachable set of robot i: `centers` (w, 3) [m] and `radii` (w,) [m] are written.

    They hold all admissible controls of all its responses, the controls that are tested instead where avoidance is
    shared, and its committed path.
    """
    robot = robots.each[i]
    low, high, control = np.full((BALL_WINDOWS, 3), np.inf), np.full((BALL_WINDOWS, 3), -np.inf), np.zeros(3)
    bounding_balls(robots.committed.times[i], robots.committed.points[i], settings, centers, radii)
    for w in range(BALL_WINDOWS):
        if radii[w] >= 0.0:
            for axis in range(3):
                low[w, axis], high[w, axis] = centers[w, axis] - radii[w], centers[w, axis] + radii[w]
    for r in range(responses.kinds[robot.kind], responses.kinds[robot.kind + 1]):
        response = responses.each[r]
        for part in range(2 if settings.share < 1.0 else 1):
            radius = tested_controls(robot, r, 1.0 if part == 0 else 1.0 / settings.least_share, responses, control)
            for k in range(2 * BALL_WINDOWS + 1):
                gains, bend = response.window_gains[k * STRIDE], response.ball_bends[k]
                before, after = max(k - 1, 0) // 2, min(k, 2 * BALL_WINDOWS - 1) // 2
                wide = radius * (gains[2] + bend[2]) + response.error
                for axis in range(settings.dimension):
                    v, a, u = robot.velocity[axis], robot.acceleration[axis], control[axis]
                    x = robot.position[axis] + gains[0] * v + gains[1] * a + gains[2] * u
                    more = wide + bend[0] * abs(v) + bend[1] * abs(a) + bend[2] * abs(u)
                    low[before, axis], high[before, axis] = (
                        min(low[before, axis], x - more),
                        max(high[before, axis], x + more),
                    )
                    if after != before:
                        low[after, axis], high[after, axis] = (
                            min(low[after, axis], x - more),
                            max(high[after, axis], x + more),
                        )
    for w in range(BALL_WINDOWS):
        for axis in range(settings.dimension, 3):
            low[w, axis], high[w, axis] = 0.0, 0.0
        radii[w] = ball_of(low[w], high[w], centers[w])


@inlined
def tested_controls(robot: Robot, r: int, scale: float, responses: ResponseTable, center: Array) -> float:
    """The ball that holds all controls of response r that are tested: its radius; its centre goes into `center` (3,).

    It holds the admissible controls, about the control that changes nothing now scaled by `scale` [1].
    """
    peak, radius = smallest_control_ball(robot, r, responses)
    unchanged_control(robot, r, responses, center)
    for axis in range(3):
        middle = -peak_drift(robot, peak, axis, responses) / responses.peaks[peak, 4]
        center[axis] += (middle - center[axis]) * scale
    return radius * scale


@kernel
def response_balls(robot: Robot, r: int, responses: ResponseTable, centers: Array, radii: Array) -> None:
    """Write balls that hold a robot under every control of response r: centers (w, 3) [m], radii (w,) [m].

    One for each of w = RESPONSE_WINDOWS windows.
    """
    control, response = np.zeros(3), responses.each[r]
    radius = tested_controls(robot, r, 1.0, responses, control)
    for w in range(RESPONSE_WINDOWS):
        first, last, bend = response.window_gains[w], response.window_gains[w + 1], response.window_bends[w]
        square, more = 0.0, 0.0
        for axis in range(3):
            v, a, u = robot.velocity[axis], robot.acceleration[axis], control[axis]
            begin = robot.position[axis] + first[0] * v + first[1] * a + first[2] * u
            end = robot.position[axis] + last[0] * v + last[1] * a + last[2] * u
            centers[w, axis] = 0.5 * (begin + end)
            square += squared(0.5 * (end - begin))
            more += bend[0] * abs(v) + bend[1] * abs(a) + bend[2] * abs(u)
        size = np.sqrt(square) + more + radius * (max(first[2], last[2]) + bend[2]) + response.error
        radii[w] = size * (1.0 + BALL_ROUNDING) + BALL_ROUNDING


@kernel
def farthest_distance(position: Array, centers: Array, radii: Array) -> float:
    """The largest distance [m] from `position` (3,) of any point in balls with centers (w, 3) and radii (w,) [m]."""
    far = 0.0
    for w in range(len(radii)):
        square = 0.0
        for axis in range(3):
            square += squared(centers[w, axis] - position[axis])
        far = max(far, np.sqrt(square) + radii[w])
    return far


@kernel
def reachable_neighbours(i: int, near: Indices, centers: Array, radii: Array, robots: RobotTable) -> Indices:
    """Robots in `near` (m,) that robot i can approach closer than the margin within the horizon.

    `centers` (w, 3) [m] and `radii` (w,) [m] bound its reachable set in each window.
    """
    robot = robots.each[i]
    met, count = np.empty(len(near), np.int64), 0
    # Without slices and calls: this runs for every robot that is near.
    for k in near:
        other = robots.each[k]
        touch = robot.radius + other.radius + robot.margin_among
        for w in range(BALL_WINDOWS - 1, -1, -1):
            theirs = other.ball_centers[w]
            x, y, z = centers[w, 0] - theirs[0], centers[w, 1] - theirs[1], centers[w, 2] - theirs[2]
            reach = radii[w] + other.ball_radii[w] + touch
            if reach >= 0.0 and x * x + y * y + z * z <= reach * reach:
                met[count] = k
                count += 1
                break
    return met[:count]
