"""Many robots, discs or balls, as arrays: what each may meet, and its exact choice for one response."""

import numpy as np

from slalom.kernels.compiled import Array, Indices, MaybeHulls, kernel
from slalom.kernels.exchange import within_reach
from slalom.kernels.hulls import distances
from slalom.kernels.segments import relative_segments
from slalom.kernels.tables import CLOSE, FOR_EVER, Answers, Fleet, Meeting, Rows, Solid, Terms, World
from slalom.kernels.windows import whereabouts
from slalom.tolerances import CONTACT, TOUCHING


@kernel
def place_at(begin: Array, points: Array, t: float, place: Array, speed: Array) -> None:
    """Position and velocity at t on cubic pieces; the last one that has a length goes on."""
    k = 0
    while k < len(points) - 1 and begin[k + 1] <= t and begin[k + 2] > begin[k + 1]:
        k += 1
    width = begin[k + 1] - begin[k]
    x = (t - begin[k]) / width
    y = 1.0 - x
    for axis in range(len(place)):
        p0, p1, p2, p3 = points[k, 0, axis], points[k, 1, axis], points[k, 2, axis], points[k, 3, axis]
        place[axis] = y * y * y * p0 + 3.0 * x * y * y * p1 + 3.0 * x * x * y * p2 + x * x * x * p3
        speed[axis] = 3.0 * (y * y * (p1 - p0) + 2.0 * x * y * (p2 - p1) + x * x * (p3 - p2)) / width


@kernel
def in_reach(i: int, others: Indices, fleet: Fleet, terms: Terms) -> Indices:
    """The other robots that robot i could meet within the horizon if both drove straight at top speed."""
    near, count = np.empty(len(others), np.int64), 0
    for k in others:
        reach = (fleet.top[i] + fleet.top[k]) * terms.horizon + fleet.radius[i] + fleet.radius[k] + terms.margin
        square = 0.0
        for axis in range(terms.dimension):
            square += (fleet.position[k, axis] - fleet.position[i, axis]) ** 2
        if square <= reach * reach:
            near[count] = k
            count += 1
    return near[:count]


@kernel
def gather(i: int, near: Indices, fleet: Fleet, world: World, terms: Terms) -> tuple[Rows, bool]:
    """What robot i may meet within the horizon, of robots those in `near`; whether it overlaps something now."""
    d, now = terms.dimension, terms.now
    q = fleet.seen_points.shape[1]
    count = len(near)
    fixed, bodies = len(world.body), len(world.around)
    rows = fixed + count * q
    times, points = np.empty((rows, 2)), np.empty((rows, 4, d))
    radius, growth, body = np.empty(rows), np.zeros(rows), np.empty(rows, np.int64)
    turning = len(world.turns) > 0
    turns = np.zeros((rows if turning else 0, 4, 2))
    hull, spread = np.full(bodies + count, -1), np.zeros(bodies + count)
    partner, extras = np.zeros(bodies + count, np.bool_), np.zeros(bodies + count)
    overlaps = False
    if fixed:
        times[:fixed], points[:fixed], growth[:fixed] = world.times, world.points, world.growth
        body[:fixed] = world.body
        hull[:bodies], spread[:bodies] = world.hull, world.spread
        if turning:
            turns[:fixed] = world.turns
        around = world.around + (fleet.radius[i] - world.grown)
        overlaps = widen(i, fleet, world, terms, around)
        extras[:bodies] = around - world.around - (fleet.radius[i] - world.grown)
        for s in range(fixed):
            radius[s] = world.radius[s] + around[world.body[s]]
    s = fixed
    place, speed = np.empty(d), np.empty(d)
    for j in range(count):
        k = near[j]
        place_at(fleet.seen_begin[k], fleet.seen_points[k], now, place, speed)
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
        partner[bodies + j], extras[bodies + j] = gap > CLOSE * touch, extra
        for p in range(q):
            first, last = fleet.seen_begin[k, p], fleet.seen_begin[k, p + 1]
            if last <= now or last <= first or first >= now + terms.horizon:
                continue
            times[s, 0], times[s, 1] = first - now, last - now
            for c in range(4):
                for axis in range(d):
                    points[s, c, axis] = fleet.seen_points[k, p, c, axis]
            radius[s], body[s] = touch + extra, bodies + j
            if turning:
                turns[s, :, 0] = 1.0
            s += 1
    return (
        Rows(times[:s], points[:s], radius[:s], growth[:s], turns[:s], body[:s], hull, spread, partner, extras),
        overlaps,
    )


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
def relative(
    rows: Rows, world: World, knots: Array, drift: Array, gain: Array, horizon: float
) -> tuple[Array, Array, Array, Array, Array, MaybeHulls, Indices]:
    """points, gains, radius, growth, reach, hulls and body of the relative motion."""
    _, _, points, gains, radius, growth, turned, body = relative_segments(
        rows.times, rows.points, rows.radius, rows.growth, rows.turns, rows.body, knots, drift, gain, horizon
    )
    hull = rows.hull[body]
    reach = radius + np.maximum(growth, 0.0) + rows.spread[body]
    if len(rows.turns) == 0:
        turned = np.zeros((4, 2, len(body)))
        turned[:, 0] = 1.0
    return points, gains, radius, growth, reach, hulls_of(world.solid, hull, turned), body


@kernel
def hulls_of(solid: Solid, hull: Indices, turned: Array) -> MaybeHulls:
    """The hulls of rows by numbers (k,), directions (4, 2, k); empty where there are none (`compiled.MaybeHulls`)."""
    if len(solid) > 0:
        return hull, turned, solid[0], solid[1], solid[2]
    return ()


@kernel
def limits_of(i: int, r: int, fleet: Fleet, answers: Answers, terms: Terms) -> Array:
    """The admissible set of response r, see `limits.Limits.admissible`."""
    count = 0
    for p in range(len(answers.peaks)):
        count += answers.peaks[p, 0] == r
    rows = np.zeros((count, 5))
    square = 0.0
    for axis in range(terms.dimension):
        square += fleet.velocity[i, axis] ** 2
    fastest = max(fleet.top[i], np.sqrt(square) - 0.5 * fleet.most[i] * answers.settled[r])
    k = 0
    for p in range(len(answers.peaks)):
        if answers.peaks[p, 0] != r:
            continue
        share, gain = answers.peaks[p, 2], answers.peaks[p, 3]
        rows[k, 0] = -1.0
        for axis in range(terms.dimension):
            rows[k, 1 + axis] = -share * fleet.velocity[i, axis] / gain
        rows[k, 4] = (fastest if answers.peaks[p, 1] == 0.0 else fleet.most[i]) / abs(gain)
        k += 1
    return rows


@kernel
def meeting(
    i: int, r: int, rows: Rows, fleet: Fleet, world: World, answers: Answers, terms: Terms, own: Array
) -> Meeting:
    """What robot i may meet under response r; `own`: the control that changes nothing."""
    d, first, last = terms.dimension, answers.first[r], answers.first[r + 1]
    m = last - first
    knots = answers.knots[first + r : last + r + 1]
    drift = np.empty((m, 4, d))
    for p in range(m):
        for c in range(4):
            for axis in range(d):
                drift[p, c, axis] = fleet.position[i, axis] + answers.place[first + p, c] * fleet.velocity[i, axis]
    points, gains, radius, growth, reach, hulls, body = relative(
        rows, world, knots, drift, answers.gain[first:last], terms.horizon
    )
    if terms.share < 1.0:
        # Where the other avoids too, half the change of the control must do: w = own + (u - own) / share is tested.
        for s in range(len(body)):
            if rows.partner[body[s]]:
                for c in range(4):
                    for axis in range(d):
                        points[c, axis, s] += gains[c, s] * own[axis] * (1.0 / terms.share - 1.0)
                    gains[c, s] /= terms.share
    limits = limits_of(i, r, fleet, answers, terms)
    return Meeting(limits, *within_reach(limits, points, gains, radius, growth, reach, hulls))


@kernel
def course(i: int, r: int, u: Array, fleet: Fleet, answers: Answers, terms: Terms, begin: Array, points: Array) -> None:
    """The course of robot i that answers u by response r from now on, into begin and points."""
    first, last = answers.first[r], answers.first[r + 1]
    end = terms.now + (FOR_EVER if terms.shared else answers.knots[last + r])
    begin[:] = end
    for p in range(last - first):
        begin[p] = terms.now + answers.knots[first + r + p]
        for c in range(4):
            for axis in range(3):
                points[p, c, axis] = (
                    fleet.position[i, axis]
                    + answers.place[first + p, c] * fleet.velocity[i, axis]
                    + answers.gain[first + p, c] * u[axis]
                )


@kernel
def foresee(k: int, fleet: Fleet, terms: Terms) -> None:
    """Where robot k is seen to be during the horizon and at its end."""
    speed = np.empty(3)
    whereabouts(fleet.seen_begin[k], fleet.seen_points[k], terms, fleet.middle[k], fleet.spread[k])
    place_at(fleet.seen_begin[k], fleet.seen_points[k], terms.now + terms.horizon, fleet.later[k], speed)


@kernel
def commit(i: int, r: int, u: Array, fleet: Fleet, answers: Answers, terms: Terms) -> None:
    """Robot i follows response r under u from now on; with shared manoeuvres the others see it at once."""
    course(i, r, u, fleet, answers, terms, fleet.begin[i], fleet.points[i])
    fleet.response[i] = r
    fleet.control[i] = u
    if terms.shared:
        fleet.seen_begin[i], fleet.seen_points[i] = fleet.begin[i], fleet.points[i]
        foresee(i, fleet, terms)
