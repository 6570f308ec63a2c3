"""Who can be met: balls that hold what is seen of each robot, and all that one can do, during windows of the horizon.

A row of cubic pieces that no admissible control can collide on changes no choice. What a robot sees of the others is
therefore cut to those whose balls come near its own in some window; nothing else is left out. Robots are sorted into
cells first, so that this costs the same for each however many there are.

Robots that cannot meet decide at the same time, each after all before it that it could meet.
"""

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.decision.tables import WINDOWS, CellList, DecisionSettings, ResponseTable, RobotTable
from slalom.kernels.geometry.cubic import copy_into, restrict
from slalom.kernels.jit import kernel

ROUNDING = 1e-9
"""[1] Balls are larger by this share."""


@kernel
def ball_of(low: Array, high: Array, middle: Array) -> float:
    """The radius of a ball that holds the box from low to high, its middle into `middle`; -inf for an empty box."""
    square = 0.0
    for axis in range(3):
        middle[axis] = 0.5 * (low[axis] + high[axis])
        square += (high[axis] - middle[axis]) ** 2
    return np.sqrt(square) * (1.0 + ROUNDING) + ROUNDING if low[0] <= high[0] else -np.inf


@kernel
def bounding_balls(begin: Array, points: Array, terms: DecisionSettings, middle: Array, spread: Array) -> None:
    """Balls that hold a course, pieces `begin` (n + 1,), `points` (n, 4, 3): middle (w, 3) and spread (w,), its radius.

    Where the course has no piece, -inf.
    """
    low, high = np.empty(3), np.empty(3)
    for w in range(WINDOWS):
        a = terms.now + terms.horizon * w / WINDOWS
        b = terms.now + terms.horizon * (w + 1) / WINDOWS
        for axis in range(3):
            low[axis], high[axis] = np.inf, -np.inf
        for p in range(len(points)):
            first, last = begin[p], begin[p + 1]
            if last <= first or last < a or first > b:
                continue
            e, f = (max(a, first) - first) / (last - first), (min(b, last) - first) / (last - first)
            for axis in range(3):
                p0, p1, p2, p3 = restrict(
                    points[p, 0, axis], points[p, 1, axis], points[p, 2, axis], points[p, 3, axis], e, f
                )
                low[axis] = min(low[axis], min(min(p0, p1), min(p2, p3)))
                high[axis] = max(high[axis], max(max(p0, p1), max(p2, p3)))
        spread[w] = ball_of(low, high, middle[w])


@kernel
def smallest_control_ball(i: int, r: int, fleet: RobotTable, answers: ResponseTable) -> tuple[float, float]:
    """The smallest ball that all admissible controls of response r lie in: -share of the velocity, radius.

    See `limits.Limits.admissible`.
    """
    square = fleet.velocity[i, 0] ** 2 + fleet.velocity[i, 1] ** 2 + fleet.velocity[i, 2] ** 2
    fastest = max(fleet.max_speed[i], np.sqrt(square) - 0.5 * fleet.max_acceleration[i] * answers.settled[r])
    share, radius = 0.0, np.inf
    for p in range(len(answers.peaks)):
        if answers.peaks[p, 0] != r:
            continue
        size = (fastest if answers.peaks[p, 1] == 0.0 else fleet.max_acceleration[i]) / abs(answers.peaks[p, 3])
        if size < radius:
            share, radius = answers.peaks[p, 2] / answers.peaks[p, 3], size
    return share, radius


@kernel
def reachable_balls(
    i: int, fleet: RobotTable, answers: ResponseTable, terms: DecisionSettings, middle: Array, spread: Array
) -> None:
    """Balls that hold all that robot i may do, in middle (w, 3) and spread (w,).

    All admissible controls of all its responses, what is tested in their stead where avoidance is shared, and what it
    is committed to.
    """
    low, high = np.full((WINDOWS, 3), np.inf), np.full((WINDOWS, 3), -np.inf)
    bounding_balls(fleet.committed_times[i], fleet.committed_points[i], terms, middle, spread)
    for w in range(WINDOWS):
        if spread[w] >= 0.0:
            for axis in range(3):
                low[w, axis], high[w, axis] = middle[w, axis] - spread[w], middle[w, axis] + spread[w]
    for r in range(answers.kinds[fleet.kind[i]], answers.kinds[fleet.kind[i] + 1]):
        share, radius = smallest_control_ball(i, r, fleet, answers)
        for part in range(2 if terms.share < 1.0 else 1):
            scale = 1.0 if part == 0 else 1.0 / terms.share
            for axis in range(terms.dimension):
                place, speed = fleet.position[i, axis], fleet.velocity[i, axis]
                # The control that changes nothing now, see `crew.own_control`.
                own = speed if answers.settled_velocity[r, 0] == 0.0 else fleet.acceleration[i, axis]
                control = own * (1.0 - scale) - scale * share * speed
                for c in range(answers.cuts[r], answers.cuts[r + 1]):
                    w = answers.window[c]
                    for j in range(4):
                        gain = answers.cut_gain[c, j]
                        x, wide = (
                            place + answers.cut_velocity_gain[c, j] * speed + gain * control,
                            radius * scale * abs(gain),
                        )
                        low[w, axis], high[w, axis] = min(low[w, axis], x - wide), max(high[w, axis], x + wide)
    for w in range(WINDOWS):
        for axis in range(terms.dimension, 3):
            low[w, axis], high[w, axis] = 0.0, 0.0
        spread[w] = ball_of(low[w], high[w], middle[w])


@kernel
def farthest_distance(place: Array, middle: Array, spread: Array) -> float:
    """How far from `place` (3,) anything in balls (w, 3), (w,) is, at most."""
    far = 0.0
    for w in range(len(spread)):
        square = 0.0
        for axis in range(3):
            square += (middle[w, axis] - place[axis]) ** 2
        far = max(far, np.sqrt(square) + spread[w])
    return far


@kernel
def cell_list(order: Indices, fleet: RobotTable, answers: ResponseTable, terms: DecisionSettings) -> CellList:
    """All robots in cells, so wide that none of those in `order` can meet one that is not in a cell about its own."""
    n, d = len(fleet.radius), terms.dimension
    middle, spread = np.empty((n, WINDOWS, 3)), np.empty((n, WINDOWS))
    own, other, size, speed = 0.0, 0.0, 0.0, 0.0
    low, high = np.full(d, np.inf), np.full(d, -np.inf)
    for k in range(n):
        if not fleet.present[k]:
            continue
        other = max(other, farthest_distance(fleet.position[k], fleet.ball_centers[k], fleet.ball_radii[k]))
        size, speed = max(size, fleet.radius[k]), max(speed, fleet.max_speed[k])
        for axis in range(d):
            low[axis] = min(low[axis], fleet.position[k, axis])
            high[axis] = max(high[axis], fleet.position[k, axis])
    for i in order:
        reachable_balls(i, fleet, answers, terms, middle[i], spread[i])
        own = max(own, farthest_distance(fleet.position[i], middle[i], spread[i]))
    # In shared mode what a robot decides is seen at once: all that it may do counts as seen. Straight ways at top
    # speed count for the costs.
    far = max(own + max(own, other), 2.0 * speed * terms.horizon) + 2.0 * size + terms.margin
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
        if fleet.present[k]:
            cell[k] = cell_at(fleet.position[k], low, width, counts)
            first[cell[k] + 1] += 1
    for c in range(total):
        first[c + 1] += first[c]
    free = first[:-1].copy()
    for k in range(n):
        if fleet.present[k]:
            member[free[cell[k]]] = k
            free[cell[k]] += 1
    return CellList(low, width, counts, first, member, middle, spread)


@kernel
def cell_at(place: Array, low: Array, width: Array, counts: Indices) -> int:
    """The number of the cell that holds a place."""
    c = 0
    for axis in range(len(counts)):
        at = int((place[axis] - low[axis]) / width[axis])
        c = c * counts[axis] + min(max(at, 0), counts[axis] - 1)
    return c


@kernel
def neighbours_in_cells(i: int, fleet: RobotTable, seen: CellList) -> Indices:
    """All robots but i in the cells about it."""
    d = len(seen.counts)
    index, count = np.empty(len(seen.member), np.int64), 0
    at = np.zeros(3, np.int64)
    for axis in range(d):
        at[axis] = min(
            max(int((fleet.position[i, axis] - seen.low[axis]) / seen.width[axis]), 0), seen.counts[axis] - 1
        )
    deep = 1 if d == 3 else 0
    for a in range(max(at[0] - 1, 0), min(at[0] + 2, seen.counts[0])):
        for b in range(max(at[1] - 1, 0), min(at[1] + 2, seen.counts[1])):
            for e in range(max(at[2] - deep, 0), min(at[2] + deep + 1, seen.counts[2] if d == 3 else 1)):
                c = a * seen.counts[1] + b
                if d == 3:
                    c = c * seen.counts[2] + e
                for m in range(seen.first[c], seen.first[c + 1]):
                    if seen.member[m] != i:
                        index[count] = seen.member[m]
                        count += 1
    return index[:count]


@kernel
def reachable_neighbours(
    i: int, near: Indices, middle: Array, spread: Array, fleet: RobotTable, terms: DecisionSettings
) -> Indices:
    """Those of the robots `near` that robot i, whose doings the balls (w, 3), (w,) hold, may come nearer to than the
    margin within the horizon.
    """
    met, count = np.empty(len(near), np.int64), 0
    # Without slices and calls: this is asked of all that are near.
    theirs, wide = fleet.ball_centers, fleet.ball_radii
    for k in near:
        room = fleet.radius[i] + fleet.radius[k] + terms.margin
        for w in range(WINDOWS - 1, -1, -1):
            x, y, z = middle[w, 0] - theirs[k, w, 0], middle[w, 1] - theirs[k, w, 1], middle[w, 2] - theirs[k, w, 2]
            reach = spread[w] + wide[k, w] + room
            if reach >= 0.0 and x * x + y * y + z * z <= reach * reach:
                met[count] = k
                count += 1
                break
    return met[:count]


@kernel
def independent_rounds(order: Indices, seen: CellList, fleet: RobotTable) -> Indices:
    """The round in which each of `order` decides: one more than the last of those before it in the cells about it.

    Two robots of one round are never in neighbouring cells, and so neither knows what the other does in it.
    """
    latest, found = np.full(len(seen.first) - 1, -1), np.empty(len(order), np.int64)
    sides = np.ones(3, np.int64)
    copy_into(sides, seen.counts)
    for n in range(len(order)):
        # Cells are numbered as if there were three axes, the last ones of length 1.
        c = cell_at(fleet.position[order[n]], seen.low, seen.width, seen.counts)
        x, y, z = c // (sides[1] * sides[2]), c // sides[2] % sides[1], c % sides[2]
        last = -1
        for u in range(max(x - 1, 0), min(x + 2, sides[0])):
            for v in range(max(y - 1, 0), min(y + 2, sides[1])):
                for w in range(max(z - 1, 0), min(z + 2, sides[2])):
                    last = max(last, latest[(u * sides[1] + v) * sides[2] + w])
        found[n] = latest[c] = last + 1
    return found
