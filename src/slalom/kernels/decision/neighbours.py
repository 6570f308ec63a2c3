"""Broad phase among robots: bounding balls of observed paths and of reachable sets, one per window of the horizon.

A row of cubic pieces that no admissible control can collide on changes no choice. The pieces of other robots are
therefore cut to those whose balls come near a robot's own in some window; nothing else is left out. Robots are sorted
into cells first, so that the cost for each does not grow with their number. Robots that cannot meet decide at the same
time, each after all before it that it could meet.
"""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.decision.tables import CellList, DecisionSettings, ResponseTable, RobotTable
from slalom.kernels.geometry.cubic import copy_into, restrict
from slalom.kernels.jit import kernel
from slalom.kernels.relative_motion.speed_limit import allowed_speed
from slalom.tolerances import BALL_ROUNDING, BALL_WINDOWS


@kernel
def ball_of(low: Array, high: Array, middle: Array) -> float:
    """The radius [m] of a ball that holds the box from low to high (3,) [m]; -inf for an empty box.

    Its centre goes into `middle` (3,).
    """
    square = 0.0
    for axis in range(3):
        middle[axis] = 0.5 * (low[axis] + high[axis])
        square += (high[axis] - middle[axis]) ** 2
    return np.sqrt(square) * (1.0 + BALL_ROUNDING) + BALL_ROUNDING if low[0] <= high[0] else -np.inf


@kernel
def bounding_balls(times: Array, points: Array, settings: DecisionSettings, centers: Array, radii: Array) -> None:
    """Bounding balls of a path in windows of the horizon: `centers` (w, 3) [m] and `radii` (w,) [m] are written.

    The path has pieces between `times` (n + 1,) [s] with control points (n, 4, 3) [m]. A window without a piece has the
    radius -inf.
    """
    low, high = np.empty(3), np.empty(3)
    for w in range(BALL_WINDOWS):
        a = settings.now + settings.horizon * w / BALL_WINDOWS
        b = settings.now + settings.horizon * (w + 1) / BALL_WINDOWS
        for axis in range(3):
            low[axis], high[axis] = np.inf, -np.inf
        for p in range(len(points)):
            first, last = times[p], times[p + 1]
            if last <= first or last < a or first > b:
                continue
            e, f = (max(a, first) - first) / (last - first), (min(b, last) - first) / (last - first)
            for axis in range(3):
                p0, p1, p2, p3 = restrict(
                    points[p, 0, axis], points[p, 1, axis], points[p, 2, axis], points[p, 3, axis], e, f
                )
                low[axis] = min(low[axis], min(min(p0, p1), min(p2, p3)))
                high[axis] = max(high[axis], max(max(p0, p1), max(p2, p3)))
        radii[w] = ball_of(low, high, centers[w])


@kernel
def smallest_control_ball(i: int, r: int, robots: RobotTable, responses: ResponseTable) -> tuple[float, float]:
    """The smallest ball that holds all admissible controls of response r: -[0] times the velocity, radius [1].

    See `limits.Limits.admissible`.
    """
    square = robots.velocity[i, 0] ** 2 + robots.velocity[i, 1] ** 2 + robots.velocity[i, 2] ** 2
    speed = np.sqrt(square)
    fastest = allowed_speed(robots.max_speed[i], speed, robots.max_acceleration[i], responses.settled[r])
    share, radius = 0.0, np.inf
    for p in range(len(responses.peaks)):
        if responses.peaks[p, 0] != r:
            continue
        size = (fastest if responses.peaks[p, 1] == 0.0 else robots.max_acceleration[i]) / abs(responses.peaks[p, 3])
        if size < radius:
            share, radius = responses.peaks[p, 2] / responses.peaks[p, 3], size
    return share, radius


@kernel
def reachable_balls(
    i: int, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings, centers: Array, radii: Array
) -> None:
    """Bounding balls of the reachable set of robot i: `centers` (w, 3) [m] and `radii` (w,) [m] are written.

    They hold all admissible controls of all its responses, the controls that are tested instead where avoidance is
    shared, and its committed path.
    """
    low, high = np.full((BALL_WINDOWS, 3), np.inf), np.full((BALL_WINDOWS, 3), -np.inf)
    bounding_balls(robots.committed_times[i], robots.committed_points[i], settings, centers, radii)
    for w in range(BALL_WINDOWS):
        if radii[w] >= 0.0:
            for axis in range(3):
                low[w, axis], high[w, axis] = centers[w, axis] - radii[w], centers[w, axis] + radii[w]
    for r in range(responses.kinds[robots.kind[i]], responses.kinds[robots.kind[i] + 1]):
        share, radius = smallest_control_ball(i, r, robots, responses)
        for part in range(2 if settings.share < 1.0 else 1):
            scale = 1.0 if part == 0 else 1.0 / settings.share
            for axis in range(settings.dimension):
                position, velocity = robots.position[i, axis], robots.velocity[i, axis]
                # The control that changes nothing now, see `policy.unchanged_control`.
                own = velocity if responses.settled_velocity[r, 0] == 0.0 else robots.acceleration[i, axis]
                control = own * (1.0 - scale) - scale * share * velocity
                for c in range(responses.cuts[r], responses.cuts[r + 1]):
                    w = responses.window[c]
                    for j in range(4):
                        gain = responses.cut_gain[c, j]
                        x, wide = (
                            position + responses.cut_velocity_gain[c, j] * velocity + gain * control,
                            radius * scale * abs(gain),
                        )
                        low[w, axis], high[w, axis] = min(low[w, axis], x - wide), max(high[w, axis], x + wide)
    for w in range(BALL_WINDOWS):
        for axis in range(settings.dimension, 3):
            low[w, axis], high[w, axis] = 0.0, 0.0
        radii[w] = ball_of(low[w], high[w], centers[w])


@kernel
def farthest_distance(position: Array, centers: Array, radii: Array) -> float:
    """The largest distance [m] from `position` (3,) of any point in balls with centers (w, 3) and radii (w,) [m]."""
    far = 0.0
    for w in range(len(radii)):
        square = 0.0
        for axis in range(3):
            square += (centers[w, axis] - position[axis]) ** 2
        far = max(far, np.sqrt(square) + radii[w])
    return far


@kernel
def cell_list(order: Indices, robots: RobotTable, responses: ResponseTable, settings: DecisionSettings) -> CellList:
    """All robots in cells: none of `order` (m,) can meet a robot outside its own and the neighbouring cells."""
    n, d = len(robots.radius), settings.dimension
    centers, radii = np.empty((n, BALL_WINDOWS, 3)), np.empty((n, BALL_WINDOWS))
    own, other, size, speed = 0.0, 0.0, 0.0, 0.0
    low, high = np.full(d, np.inf), np.full(d, -np.inf)
    for k in range(n):
        if not robots.present[k]:
            continue
        other = max(other, farthest_distance(robots.position[k], robots.ball_centers[k], robots.ball_radii[k]))
        size, speed = max(size, robots.radius[k]), max(speed, robots.max_speed[k])
        for axis in range(d):
            low[axis] = min(low[axis], robots.position[k, axis])
            high[axis] = max(high[axis], robots.position[k, axis])
    for i in order:
        reachable_balls(i, robots, responses, settings, centers[i], radii[i])
        own = max(own, farthest_distance(robots.position[i], centers[i], radii[i]))
    # With shared manoeuvres a decision is observed at once, so the whole reachable set counts as observed. For the
    # costs straight lines at max speed count.
    far = max(own + max(own, other), 2.0 * speed * settings.horizon) + 2.0 * size + settings.margin
    most = int(np.ceil((4.0 * n + 1.0) ** (1.0 / d)))
    counts, width = np.ones(d, np.int64), np.empty(d)
    total = 1
    for axis in range(d):
        extent = high[axis] - low[axis]
        if extent > far:
            counts[axis] = min(int(extent / far), most)
        width[axis] = max(extent / counts[axis], far)
        total *= counts[axis]
    first, member, cell = np.zeros(total + 1, np.int64), np.empty(n, np.int64), np.zeros(n, np.int64)
    for k in range(n):
        if robots.present[k]:
            cell[k] = cell_at(robots.position[k], low, width, counts)
            first[cell[k] + 1] += 1
    for c in range(total):
        first[c + 1] += first[c]
    free = first[:-1].copy()
    for k in range(n):
        if robots.present[k]:
            member[free[cell[k]]] = k
            free[cell[k]] += 1
    return CellList(low, width, counts, first, member, centers, radii)


@kernel
def cell_at(position: Array, low: Array, width: Array, counts: Indices) -> int:
    """The number of the cell that holds a position (d,) [m]; the rest as in `CellList`."""
    c = 0
    for axis in range(len(counts)):
        at = int((position[axis] - low[axis]) / width[axis])
        c = c * counts[axis] + min(max(at, 0), counts[axis] - 1)
    return c


@kernel
def neighbours_in_cells(i: int, robots: RobotTable, cells: CellList) -> Indices:
    """All robots but i in its cell and the neighbouring cells: (m,)."""
    d = len(cells.counts)
    index, count = np.empty(len(cells.member), np.int64), 0
    at = np.zeros(3, np.int64)
    for axis in range(d):
        at[axis] = min(
            max(int((robots.position[i, axis] - cells.low[axis]) / cells.width[axis]), 0), cells.counts[axis] - 1
        )
    deep = 1 if d == 3 else 0
    for a in range(max(at[0] - 1, 0), min(at[0] + 2, cells.counts[0])):
        for b in range(max(at[1] - 1, 0), min(at[1] + 2, cells.counts[1])):
            for e in range(max(at[2] - deep, 0), min(at[2] + deep + 1, cells.counts[2] if d == 3 else 1)):
                c = a * cells.counts[1] + b
                if d == 3:
                    c = c * cells.counts[2] + e
                for m in range(cells.first[c], cells.first[c + 1]):
                    if cells.member[m] != i:
                        index[count] = cells.member[m]
                        count += 1
    return index[:count]


@kernel
def reachable_neighbours(
    i: int, near: Indices, centers: Array, radii: Array, robots: RobotTable, settings: DecisionSettings
) -> Indices:
    """Robots in `near` (m,) that robot i can approach closer than the margin within the horizon.

    `centers` (w, 3) [m] and `radii` (w,) [m] bound its reachable set in each window.
    """
    met, count = np.empty(len(near), np.int64), 0
    # Without slices and calls: this runs for every robot that is near.
    theirs, their_radii = robots.ball_centers, robots.ball_radii
    for k in near:
        touch = robots.radius[i] + robots.radius[k] + settings.margin
        for w in range(BALL_WINDOWS - 1, -1, -1):
            x, y, z = centers[w, 0] - theirs[k, w, 0], centers[w, 1] - theirs[k, w, 1], centers[w, 2] - theirs[k, w, 2]
            reach = radii[w] + their_radii[k, w] + touch
            if reach >= 0.0 and x * x + y * y + z * z <= reach * reach:
                met[count] = k
                count += 1
                break
    return met[:count]


@kernel
def independent_rounds(order: Indices, cells: CellList, robots: RobotTable) -> Indices:
    """The round (n,) in which each robot of `order` (n,) decides: after all before it in the cells about it.

    Two robots of one round are never in neighbouring cells, so that neither observes the decision of the other.
    """
    latest, found = np.full(len(cells.first) - 1, -1), np.empty(len(order), np.int64)
    sides = np.ones(3, np.int64)
    copy_into(sides, cells.counts)
    for n in range(len(order)):
        # Cells are numbered as if there were three axes, the last ones of length 1.
        c = cell_at(robots.position[order[n]], cells.low, cells.width, cells.counts)
        x, y, z = c // (sides[1] * sides[2]), c // sides[2] % sides[1], c % sides[2]
        last = -1
        for u in range(max(x - 1, 0), min(x + 2, sides[0])):
            for v in range(max(y - 1, 0), min(y + 2, sides[1])):
                for w in range(max(z - 1, 0), min(z + 2, sides[2])):
                    last = max(last, latest[(u * sides[1] + v) * sides[2] + w])
        found[n] = latest[c] = last + 1
    return found
