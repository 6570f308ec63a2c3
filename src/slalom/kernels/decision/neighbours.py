"""Broad phase among robots: bounding balls of observed paths and of reachable sets, one per window of the horizon.

A row of cubic pieces that no admissible control can collide on changes no choice. The pieces of other robots are
therefore cut to those whose balls come near a robot's own in some window; nothing else is left out. Before that, a cell
list finds the robots that are near at all, see `cell_list`.
"""

import numpy as np

from slalom.base.tolerances import BALL_ROUNDING
from slalom.kernels.arrays import Array, Indices
from slalom.kernels.by_reference import by_reference
from slalom.kernels.decision.limits import peak_drift, smallest_control_ball
from slalom.kernels.decision.paths import ball_of, bounding_balls, continue_from_state, predict, unchanged_control
from slalom.kernels.decision.tables import (
    BALL_WINDOWS,
    RESPONSE_WINDOWS,
    CellList,
    DecisionSettings,
    ResponseTable,
    Robot,
    RobotTable,
)
from slalom.kernels.geometry.cubic import copy_into
from slalom.kernels.jit import inlined, kernel, squared

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
    low = np.full((BALL_WINDOWS, 3), np.inf)
    high = np.full((BALL_WINDOWS, 3), -np.inf)
    control = np.zeros(3)
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
                gains = response.window_gains[k * STRIDE]
                bend = response.ball_bends[k]
                before = max(k - 1, 0) // 2
                after = min(k, 2 * BALL_WINDOWS - 1) // 2
                wide = radius * (gains[2] + bend[2]) + response.error
                for axis in range(settings.dimension):
                    v = robot.velocity[axis]
                    a = robot.acceleration[axis]
                    u = control[axis]
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
            low[w, axis] = 0.0
            high[w, axis] = 0.0
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
def response_balls(
    robot: Robot, r: int, preferred: Array, within: float, responses: ResponseTable, centers: Array, radii: Array
) -> None:
    """Write balls that hold a robot under the controls of response r: centers (w, 3) [m], radii (w,) [m].

    One for each of w = RESPONSE_WINDOWS windows. Of the controls those `within` a distance of `preferred` (3,).
    """
    control = np.zeros(3)
    response = responses.each[r]
    radius = tested_controls(robot, r, 1.0, responses, control)
    if within < radius:
        radius = within
        copy_into(control, preferred)
    for w in range(RESPONSE_WINDOWS):
        first = response.window_gains[w]
        last = response.window_gains[w + 1]
        bend = response.window_bends[w]
        square = 0.0
        more = 0.0
        for axis in range(3):
            v = robot.velocity[axis]
            a = robot.acceleration[axis]
            u = control[axis]
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
    met = np.empty(len(near), np.int64)
    count = 0
    # Without slices and calls: this runs for every robot that is near.
    for k in near:
        other = robots.each[k]
        touch = robot.radius + other.radius + robot.margin_among
        for w in range(BALL_WINDOWS - 1, -1, -1):
            theirs = other.ball_centers[w]
            x = centers[w, 0] - theirs[0]
            y = centers[w, 1] - theirs[1]
            z = centers[w, 2] - theirs[2]
            reach = radii[w] + other.ball_radii[w] + touch
            if reach >= 0.0 and x * x + y * y + z * z <= reach * reach:
                met[count] = k
                count += 1
                break
    return met[:count]


# Cell list of robots: those that a robot can meet are found in its own and the neighbouring cells.
#
# The cost for each robot then does not grow with their number. Robots that cannot meet decide at the same time, each
# after all before it that it could meet.


@kernel
def build_cell_list(
    order: Indices, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings
) -> CellList:
    """The cell list that the decisions of the robots in `order` (m,) at this time have in common.

    Their committed paths begin where they are, see `continue_from_state`.
    """
    robots = by_reference(robots)
    responses = by_reference(responses)
    settings = by_reference(settings)
    position = np.empty(settings.dimension)
    velocity = np.empty(settings.dimension)
    for i in order:
        continue_from_state(i, robots, settings, position, velocity)
    for k in range(len(robots.each)):
        if robots.each[k].present:
            predict(k, robots, settings)
    return cell_list(order, robots, responses, settings)


@kernel
def largest_approach(order: Indices, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings) -> float:
    """The largest distance [m] that a robot of `order` (m,) and another one close within the horizon.

    The decision of a robot that shares its manoeuvre is observed at once, so its whole reachable set counts for others.
    """
    centers = np.empty((BALL_WINDOWS, 3))
    radii = np.empty(BALL_WINDOWS)
    own = 0.0
    other = 0.0
    for k in range(len(robots.each)):
        one = robots.each[k]
        if one.present:
            other = max(other, farthest_distance(one.position[:], one.ball_centers[:], one.ball_radii[:]))
    for i in order:
        reachable_balls(i, robots, responses, settings, centers, radii)
        own = max(own, farthest_distance(robots.each[i].position[:], centers, radii))
    return own + max(own, other)


@kernel
def cell_list(order: Indices, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings) -> CellList:
    """All robots in cells: none of `order` (m,) can meet a robot outside its own and the neighbouring cells."""
    n = len(robots.each)
    d = settings.dimension
    worlds = 1
    margin = 0.0
    size = 0.0
    speed = 0.0
    low = np.full(d, np.inf)
    high = np.full(d, -np.inf)
    for k in range(n):
        robot = robots.each[k]
        if not robot.present:
            continue
        size = max(size, robot.radius)
        speed = max(speed, robot.max_speed)
        worlds = max(worlds, robot.world + 1)
        margin = max(margin, robot.margin_among)
        for axis in range(d):
            low[axis] = min(low[axis], robot.position[axis])
            high[axis] = max(high[axis], robot.position[axis])
    # Robots meet on straight lines at max speed, see `is_in_reach`.
    far = 2.0 * speed * settings.horizon
    if settings.shared:
        far = max(far, largest_approach(order, robots, responses, settings))
    far += 2.0 * size + margin
    most = int(np.ceil((4.0 * n / worlds + 1.0) ** (1.0 / d)))
    counts = np.ones(d, np.int64)
    width = np.empty(d)
    total = worlds
    for axis in range(d):
        extent = high[axis] - low[axis]
        if extent > far:
            counts[axis] = int(min(extent / far, float(most)))  # far apart, the quotient is no int64
        width[axis] = max(extent / counts[axis], far)
        total *= counts[axis]
    first = np.zeros(total + 1, np.int64)
    member = np.empty(n, np.int64)
    cell = np.zeros(n, np.int64)
    for k in range(n):
        if robots.each[k].present:
            cell[k] = cell_at(robots.each[k], low, width, counts)
            first[cell[k] + 1] += 1
    for c in range(total):
        first[c + 1] += first[c]
    free = first[:-1].copy()
    for k in range(n):
        if robots.each[k].present:
            member[free[cell[k]]] = k
            free[cell[k]] += 1
    return CellList(low, width, counts, first, member)


@kernel
def cell_at(robot: Robot, low: Array, width: Array, counts: Indices) -> int:
    """The number of the cell that holds a robot; the rest as in `CellList`. Those of one world follow each other."""
    c = int(robot.world)
    for axis in range(len(counts)):
        at = int((robot.position[axis] - low[axis]) / width[axis])
        c = c * counts[axis] + min(max(at, 0), counts[axis] - 1)
    return int(c)


@kernel
def robots_in_reach(i: int, cells: CellList, robots: RobotTable, settings: DecisionSettings, found: Indices) -> int:
    """Number of the robots that robot i can meet within the horizon, both straight at max speed.

    They are written into `found` (n,), by number. So their order does not depend on the cells, and sums over them have
    the same bits in every partition.
    """
    robot = robots.each[i]
    d = len(cells.counts)
    count = 0
    at = np.zeros(3, np.int64)
    for axis in range(d):
        at[axis] = min(
            max(int((robot.position[axis] - cells.low[axis]) / cells.width[axis]), 0), cells.counts[axis] - 1
        )
    deep = 1 if d == 3 else 0
    for a in range(max(at[0] - 1, 0), min(at[0] + 2, cells.counts[0])):
        for b in range(max(at[1] - 1, 0), min(at[1] + 2, cells.counts[1])):
            for e in range(max(at[2] - deep, 0), min(at[2] + deep + 1, cells.counts[2] if d == 3 else 1)):
                c = (robot.world * cells.counts[0] + a) * cells.counts[1] + b
                if d == 3:
                    c = c * cells.counts[2] + e
                for m in range(cells.first[c], cells.first[c + 1]):
                    k = cells.member[m]
                    if k != i and is_in_reach(robot, robots.each[k], settings):
                        place = count
                        while place > 0 and found[place - 1] > k:
                            found[place] = found[place - 1]
                            place -= 1
                        found[place] = k
                        count += 1
    return count


@inlined
def is_in_reach(robot: Robot, other: Robot, settings: DecisionSettings) -> bool:
    """Whether two robots can meet within the horizon, both straight at max speed."""
    speeds = robot.max_speed + other.max_speed
    square = 0.0
    reach = speeds * settings.horizon + robot.radius + other.radius + robot.margin_among
    for axis in range(settings.dimension):
        square += squared(other.position[axis] - robot.position[axis])
    return bool(square <= reach * reach)


@kernel
def independent_rounds(order: Indices, cells: CellList, robots: RobotTable) -> Indices:
    """The round (n,) in which each robot of `order` (n,) decides: after all before it in the cells about it.

    Two robots of one round are never in neighbouring cells, so that neither observes the decision of the other.
    """
    latest = np.full(len(cells.first) - 1, -1)
    found = np.empty(len(order), np.int64)
    sides = np.ones(3, np.int64)
    copy_into(sides, cells.counts)
    for n in range(len(order)):
        robot = robots.each[order[n]]
        # Cells are numbered as if there were three axes, the last ones of length 1.
        c = cell_at(robot, cells.low, cells.width, cells.counts)
        x = c // (sides[1] * sides[2]) % sides[0]
        y = c // sides[2] % sides[1]
        z = c % sides[2]
        world = robot.world * sides[0]
        last = -1
        for u in range(max(x - 1, 0), min(x + 2, sides[0])):
            for v in range(max(y - 1, 0), min(y + 2, sides[1])):
                for w in range(max(z - 1, 0), min(z + 2, sides[2])):
                    last = max(last, latest[((world + u) * sides[1] + v) * sides[2] + w])
        found[n] = latest[c] = last + 1
    return found
