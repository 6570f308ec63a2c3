"""What one robot meets, passive bodies and other robots, as rows of cubic pieces with radii that hold the margin."""

import numpy as np

from slalom.kernels.bezier import restrict
from slalom.kernels.compiled import Array, Indices, MaybeHulls, kernel
from slalom.kernels.copying import fill
from slalom.kernels.hulls import distances
from slalom.kernels.tables import CLOSE, Fleet, Rows, Solid, Terms, World
from slalom.tolerances import CONTACT, TOUCHING


@kernel
def place_at(begin: Array, points: Array, i: int, t: float, place: Array, speed: Array) -> None:
    """Position and velocity at t on course i of a table, cubic pieces; the last one that has a length goes on."""
    k = 0
    while k < points.shape[1] - 1 and begin[i, k + 1] <= t and begin[i, k + 2] > begin[i, k + 1]:
        k += 1
    width = begin[i, k + 1] - begin[i, k]
    x = (t - begin[i, k]) / width
    y = 1.0 - x
    for axis in range(len(place)):
        p0, p1, p2, p3 = points[i, k, 0, axis], points[i, k, 1, axis], points[i, k, 2, axis], points[i, k, 3, axis]
        place[axis] = y * y * y * p0 + 3.0 * x * y * y * p1 + 3.0 * x * x * y * p2 + x * x * x * p3
        speed[axis] = 3.0 * (y * y * (p1 - p0) + 2.0 * x * y * (p2 - p1) + x * x * (p3 - p2)) / width


@kernel
def gather(i: int, near: Indices, fleet: Fleet, world: World, terms: Terms) -> tuple[Rows, bool]:
    """What robot i may meet within the horizon, of robots those in `near`; whether it overlaps something now."""
    d, now = terms.dimension, terms.now
    q = fleet.seen_points.shape[1]
    count = len(near)
    fixed, bodies = len(world.body), len(world.around)
    # A row more for each robot: one is cut where the margin is whole again.
    rows = fixed + count * (q + 1)
    times, points = np.empty((rows, 2)), np.empty((rows, 4, d))
    radius, growth, body, spare = np.empty(rows), np.zeros(rows), np.empty(rows, np.int64), np.zeros((rows, 2))
    turning = len(world.turns) > 0
    turns = np.zeros((rows if turning else 0, 4, 2))
    hull, spread = np.full(bodies + count, -1), np.zeros(bodies + count)
    partner = np.zeros(bodies + count, np.bool_)
    overlaps = False
    if fixed:
        fill(times, world.times)
        fill(points, world.points)
        fill(growth, world.growth)
        fill(body, world.body)
        fill(hull, world.hull)
        fill(spread, world.spread)
        if turning:
            fill(turns, world.turns)
        around = world.around + (fleet.radius[i] - world.grown)
        overlaps = widen(i, fleet, world, terms, around)
        for s in range(fixed):
            b = world.body[s]
            radius[s] = world.radius[s] + around[b]
            spare[s, 0] = max(around[b] - world.around[b] - (fleet.radius[i] - world.grown), 0.0)
    s = fixed
    place, speed = np.empty(d), np.empty(d)
    for j in range(count):
        k = near[j]
        place_at(fleet.seen_begin, fleet.seen_points, k, now, place, speed)
        square = 0.0
        for axis in range(d):
            square += (place[axis] - fleet.position[i, axis]) ** 2
        touch = fleet.radius[i] + fleet.radius[k]
        gap = np.sqrt(square) - touch
        overlaps = overlaps or gap < -CONTACT
        extra = min(max(gap - TOUCHING, 0.0), terms.margin)
        if gap < TOUCHING:
            extra = min(gap, 0.0) - TOUCHING
        # Nobody relies on the other where both are close: there it is too late for mistakes.
        partner[bodies + j] = gap > CLOSE * touch
        end, cut = s, terms.regain if extra < terms.margin else np.inf
        for p in range(q):
            first, last = fleet.seen_begin[k, p], fleet.seen_begin[k, p + 1]
            if last <= now or last <= first or first >= now + terms.horizon:
                continue
            end = cut_rows(first - now, last - now, fleet.seen_points, k, p, cut, end, times, points)
        for row in range(s, end):
            radius[row], body[row], spare[row, 0] = touch + extra, bodies + j, max(extra, 0.0)
            if turning:
                for c in range(4):
                    turns[row, c, 0] = 1.0
        if cut < np.inf:
            regain(terms.margin - max(extra, 0.0), cut, s, end, times, radius, growth, spare)
        s = end
    return (
        Rows(times[:s], points[:s], radius[:s], growth[:s], turns[:s], body[:s], spare[:s], hull, spread, partner),
        overlaps,
    )


@kernel
def cut_rows(
    first: float, last: float, courses: Array, k: int, p: int, cut: float, s: int, times: Array, points: Array
) -> int:
    """Piece p of course k, driven from `first` to `last`, into row s, or into two rows about the time `cut`; the next
    row.
    """
    parts = 2 if first < cut and cut < last else 1
    for part in range(parts):
        times[s, 0], times[s, 1] = first if part == 0 else cut, last if part == parts - 1 else cut
        for axis in range(points.shape[2]):
            p0, p1 = courses[k, p, 0, axis], courses[k, p, 1, axis]
            p2, p3 = courses[k, p, 2, axis], courses[k, p, 3, axis]
            if parts == 2:
                e, f = (times[s, 0] - first) / (last - first), (times[s, 1] - first) / (last - first)
                p0, p1, p2, p3 = restrict(p0, p1, p2, p3, e, f)
            points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis] = p0, p1, p2, p3
        s += 1
    return s


@kernel
def regain(
    lost: float, within: float, begin: int, end: int, times: Array, radius: Array, growth: Array, spare: Array
) -> None:
    """Grow the rows from `begin` to `end`, of one robot, evenly by the margin that is lost, until it is whole `within`
    [s].
    """
    for s in range(begin, end):
        early, late = lost * min(max(times[s, 0] / within, 0.0), 1.0), lost * min(max(times[s, 1] / within, 0.0), 1.0)
        radius[s] += early
        growth[s] = late - early
        spare[s, 0] += early
        spare[s, 1] = late - early


@kernel
def squeeze(share: float, rows: Rows) -> None:
    """Take `share` of the whole margin off."""
    for s in range(len(rows.body)):
        rows.radius[s] -= share * rows.spare[s, 0]
        rows.growth[s] -= share * rows.spare[s, 1]


@kernel
def widen(i: int, fleet: Fleet, world: World, terms: Terms, around: Array) -> bool:
    """Add the margin to the radii of passive bodies, or less where the robot is nearer; whether it overlaps one."""
    d = terms.dimension
    heads = world.heads
    which = world.body[heads]
    places, ahead = np.zeros((len(heads), 3)), np.zeros((len(heads), 2))
    ahead[:, 0] = 1.0
    for h in range(len(heads)):
        s = heads[h]
        x = -world.times[s, 0] / (world.times[s, 1] - world.times[s, 0])
        y = 1.0 - x
        w0, w1, w2, w3 = y * y * y, 3.0 * x * y * y, 3.0 * x * x * y, x * x * x
        for axis in range(d):
            p = world.points[s, :, axis]
            places[h, axis] = w0 * p[0] + w1 * p[1] + w2 * p[2] + w3 * p[3] - fleet.position[i, axis]
        if len(world.turns) > 0:
            for axis in range(2):
                p = world.turns[s, :, axis]
                ahead[h, axis] = w0 * p[0] + w1 * p[1] + w2 * p[2] + w3 * p[3]
    found = distances(places, ahead, world.hull[which], hulls_of(world.solid, world.hull, np.empty((4, 2, 0))))
    overlaps = False
    wide = np.full(len(around), terms.margin)
    for h in range(len(heads)):
        gap = found[h, 0] - around[which[h]]
        overlaps = overlaps or gap < -CONTACT
        wide[which[h]] = min(max(gap - TOUCHING, 0.0), terms.margin)
        if gap < TOUCHING:
            wide[which[h]] = max(min(gap, 0.0) - TOUCHING, -around[which[h]])
    around += wide
    return overlaps


@kernel
def hulls_of(solid: Solid, hull: Indices, turned: Array) -> MaybeHulls:
    """The hulls of rows by numbers (k,), directions (4, 2, k); empty where there are none (`compiled.MaybeHulls`)."""
    if len(solid) > 0:
        return hull, turned, solid[0], solid[1], solid[2]
    return ()
