"""Many robots, discs or balls, as arrays: what each may meet under one response, and what it commits to.

What one robot meets, passive bodies and other robots, as rows of cubic pieces with radii that hold the margin.
"""

import numpy as np

from slalom.kernels.arrays import Array, Indices, MaybeHulls
from slalom.kernels.decision.neighbours import bounding_balls
from slalom.kernels.decision.tables import (
    COOPERATION_RANGE,
    REST_DURATION,
    Corners,
    DecisionSettings,
    ObstaclePieces,
    PassiveObstacles,
    RelativeMotion,
    ResponseTable,
    RobotTable,
)
from slalom.kernels.geometry.cubic import copy_into, restrict
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel
from slalom.kernels.relative_motion.segments import relative_segments
from slalom.kernels.selection.exchange import segments_in_reach
from slalom.tolerances import CONTACT, CONTACT_SLACK


@kernel
def in_reach(i: int, others: Indices, fleet: RobotTable, terms: DecisionSettings) -> Indices:
    """The other robots that robot i could meet within the horizon if both drove straight at top speed."""
    near, count = np.empty(len(others), np.int64), 0
    for k in others:
        reach = (
            (fleet.max_speed[i] + fleet.max_speed[k]) * terms.horizon + fleet.radius[i] + fleet.radius[k] + terms.margin
        )
        square = 0.0
        for axis in range(terms.dimension):
            square += (fleet.position[k, axis] - fleet.position[i, axis]) ** 2
        if square <= reach * reach:
            near[count] = k
            count += 1
    return near[:count]


@kernel
def relative(
    rows: ObstaclePieces, world: PassiveObstacles, knots: Array, drift: Array, gain: Array, horizon: float
) -> tuple[Array, Array, Array, Array, Array, MaybeHulls, Indices]:
    """points, gains, radius, growth, reach, hulls and body of the relative motion."""
    _, _, points, gains, radius, growth, turned, body = relative_segments(
        rows.times, rows.points, rows.radius, rows.growth, rows.turns, rows.body, knots, drift, gain, horizon
    )
    n, solid = len(body), world.corners
    reach = np.empty(n)
    for s in range(n):
        reach[s] = radius[s] + max(growth[s], 0.0) + rows.hull_radius[body[s]]
    return points, gains, radius, growth, reach, hulls_among(solid, rows.hull, rows.turns, body, turned), body


@inlined
def hulls_among(solid: Corners, hull: Indices, turns: Array, body: Indices, turned: Array) -> MaybeHulls:
    """The hulls of segments of bodies, of which `hull` tells the numbers; empty where there are none."""
    if len(solid) > 0:
        if len(turns) == 0:
            turned = np.zeros((4, 2, len(body)))
            turned[:, 0] = 1.0
        return hulls_of(solid, hull[body], turned)
    return ()


@inlined
def limits_of(i: int, r: int, fleet: RobotTable, answers: ResponseTable, terms: DecisionSettings) -> Array:
    """The admissible set of response r, see `limits.Limits.admissible`."""
    count = 0
    for p in range(len(answers.peaks)):
        count += answers.peaks[p, 0] == r
    rows = np.zeros((count, 5))
    square = 0.0
    for axis in range(terms.dimension):
        square += fleet.velocity[i, axis] ** 2
    fastest = max(fleet.max_speed[i], np.sqrt(square) - 0.5 * fleet.max_acceleration[i] * answers.settled[r])
    k = 0
    for p in range(len(answers.peaks)):
        if answers.peaks[p, 0] != r:
            continue
        share, gain = answers.peaks[p, 2], answers.peaks[p, 3]
        rows[k, 0] = -1.0
        for axis in range(terms.dimension):
            rows[k, 1 + axis] = -share * fleet.velocity[i, axis] / gain
        rows[k, 4] = (fastest if answers.peaks[p, 1] == 0.0 else fleet.max_acceleration[i]) / abs(gain)
        k += 1
    return rows


@inlined
def relative_motion(
    i: int,
    r: int,
    rows: ObstaclePieces,
    fleet: RobotTable,
    world: PassiveObstacles,
    answers: ResponseTable,
    terms: DecisionSettings,
    own: Array,
) -> RelativeMotion:
    """What robot i may meet under response r; `own`: the control that changes nothing."""
    d, first, last = terms.dimension, answers.first[r], answers.first[r + 1]
    m = last - first
    knots = answers.knots[first + r : last + r + 1]
    drift = np.empty((m, 4, d))
    for p in range(m):
        for c in range(4):
            for axis in range(d):
                drift[p, c, axis] = (
                    fleet.position[i, axis] + answers.velocity_gain[first + p, c] * fleet.velocity[i, axis]
                )
    points, gains, radius, growth, reach, hulls, body = relative(
        rows, world, knots, drift, answers.gain[first:last], terms.horizon
    )
    if terms.share < 1.0:
        # Where the other avoids too, half the change of the control must do: w = own + (u - own) / share is tested.
        n, rest = len(body), 1.0 / terms.share - 1.0
        partner = np.empty(n, np.bool_)
        for s in range(n):
            partner[s] = rows.cooperates[body[s]]
        for c in range(4):
            for axis in range(d):
                by = own[axis]
                for s in range(n):
                    points[c, axis, s] += gains[c, s] * by * rest if partner[s] else 0.0
            for s in range(n):
                gains[c, s] = gains[c, s] / terms.share if partner[s] else gains[c, s]
    limits = limits_of(i, r, fleet, answers, terms)
    return RelativeMotion(limits, *segments_in_reach(limits, points, gains, radius, growth, reach, hulls))


@kernel
def response_path(
    i: int,
    r: int,
    u: Array,
    fleet: RobotTable,
    answers: ResponseTable,
    terms: DecisionSettings,
    begin: Array,
    points: Array,
    row: int,
) -> None:
    """The course of robot i that answers u by response r from now on, into a row of the tables begin and points."""
    first, last = answers.first[r], answers.first[r + 1]
    end = terms.now + (REST_DURATION if terms.shared else answers.knots[last + r])
    for p in range(begin.shape[1]):
        begin[row, p] = end
    for p in range(last - first):
        begin[row, p] = terms.now + answers.knots[first + r + p]
        for c in range(4):
            for axis in range(3):
                points[row, p, c, axis] = (
                    fleet.position[i, axis]
                    + answers.velocity_gain[first + p, c] * fleet.velocity[i, axis]
                    + answers.gain[first + p, c] * u[axis]
                )


@kernel
def predict(k: int, fleet: RobotTable, terms: DecisionSettings) -> None:
    """Where robot k is seen to be during the horizon and at its end."""
    speed = np.empty(3)
    bounding_balls(fleet.observed_times[k], fleet.observed_points[k], terms, fleet.ball_centers[k], fleet.ball_radii[k])
    state_on_path(
        fleet.observed_times, fleet.observed_points, k, terms.now + terms.horizon, fleet.end_position[k], speed
    )


@kernel
def commit(i: int, r: int, u: Array, fleet: RobotTable, answers: ResponseTable, terms: DecisionSettings) -> None:
    """Robot i follows response r under u from now on; with shared manoeuvres the others see it at once."""
    response_path(i, r, u, fleet, answers, terms, fleet.committed_times, fleet.committed_points, i)
    fleet.response[i] = r
    copy_into(fleet.control[i], u)
    if terms.shared:
        copy_into(fleet.observed_times[i], fleet.committed_times[i])
        copy_into(fleet.observed_points[i], fleet.committed_points[i])
        predict(i, fleet, terms)


@kernel
def state_on_path(begin: Array, points: Array, i: int, t: float, place: Array, speed: Array) -> None:
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
def obstacle_pieces(
    i: int, near: Indices, fleet: RobotTable, world: PassiveObstacles, terms: DecisionSettings
) -> tuple[ObstaclePieces, bool]:
    """What robot i may meet within the horizon, of robots those in `near`; whether it overlaps something now."""
    d, now = terms.dimension, terms.now
    q = fleet.observed_points.shape[1]
    count = len(near)
    fixed, bodies = len(world.body), len(world.body_radius)
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
        copy_into(times, world.times)
        copy_into(points, world.points)
        copy_into(growth, world.growth)
        copy_into(body, world.body)
        copy_into(hull, world.hull)
        copy_into(spread, world.hull_radius)
        if turning:
            copy_into(turns, world.turns)
        around = world.body_radius + (fleet.radius[i] - world.robot_radius)
        overlaps = add_margin(i, fleet, world, terms, around)
        for s in range(fixed):
            b = world.body[s]
            radius[s] = world.radius[s] + around[b]
            spare[s, 0] = max(around[b] - world.body_radius[b] - (fleet.radius[i] - world.robot_radius), 0.0)
    s = fixed
    place, speed = np.empty(d), np.empty(d)
    for j in range(count):
        k = near[j]
        state_on_path(fleet.observed_times, fleet.observed_points, k, now, place, speed)
        square = 0.0
        for axis in range(d):
            square += (place[axis] - fleet.position[i, axis]) ** 2
        touch = fleet.radius[i] + fleet.radius[k]
        gap = np.sqrt(square) - touch
        overlaps = overlaps or gap < -CONTACT
        extra = min(max(gap - CONTACT_SLACK, 0.0), terms.margin)
        if gap < CONTACT_SLACK:
            extra = min(gap, 0.0) - CONTACT_SLACK
        # Nobody relies on the other where both are close: there it is too late for mistakes.
        partner[bodies + j] = gap > COOPERATION_RANGE * touch
        end, cut = s, terms.regain if extra < terms.margin else np.inf
        for p in range(q):
            first, last = fleet.observed_times[k, p], fleet.observed_times[k, p + 1]
            if last <= now or last <= first or first >= now + terms.horizon:
                continue
            end = cut_piece(first - now, last - now, fleet.observed_points, k, p, cut, end, times, points)
        for row in range(s, end):
            radius[row], body[row], spare[row, 0] = touch + extra, bodies + j, max(extra, 0.0)
            if turning:
                for c in range(4):
                    turns[row, c, 0] = 1.0
        if cut < np.inf:
            grow_margin(terms.margin - max(extra, 0.0), cut, s, end, times, radius, growth, spare)
        s = end
    return (
        ObstaclePieces(
            times[:s], points[:s], radius[:s], growth[:s], turns[:s], body[:s], spare[:s], hull, spread, partner
        ),
        overlaps,
    )


@kernel
def cut_piece(
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
def grow_margin(
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
def reduce_margin(share: float, rows: ObstaclePieces) -> None:
    """Take `share` of the whole margin off."""
    for s in range(len(rows.body)):
        rows.radius[s] -= share * rows.margin[s, 0]
        rows.growth[s] -= share * rows.margin[s, 1]


@kernel
def add_margin(i: int, fleet: RobotTable, world: PassiveObstacles, terms: DecisionSettings, around: Array) -> bool:
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
    found = distances(places, ahead, world.hull[which], hulls_of(world.corners, world.hull, np.empty((4, 2, 0))))
    overlaps = False
    wide = np.full(len(around), terms.margin)
    for h in range(len(heads)):
        gap = found[h, 0] - around[which[h]]
        overlaps = overlaps or gap < -CONTACT
        wide[which[h]] = min(max(gap - CONTACT_SLACK, 0.0), terms.margin)
        if gap < CONTACT_SLACK:
            wide[which[h]] = max(min(gap, 0.0) - CONTACT_SLACK, -around[which[h]])
    around += wide
    return overlaps


@kernel
def hulls_of(solid: Corners, hull: Indices, turned: Array) -> MaybeHulls:
    """The hulls of rows by numbers (k,), directions (4, 2, k); empty where there are none (`compiled.MaybeHulls`)."""
    if len(solid) > 0:
        return hull, turned, solid[0], solid[1], solid[2]
    return ()
