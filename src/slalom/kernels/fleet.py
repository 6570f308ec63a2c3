"""Many robots, discs or balls, as arrays: what each may meet under one response, and what it commits to."""

import numpy as np

from slalom.kernels.compiled import Array, Indices, MaybeHulls, inlined, kernel
from slalom.kernels.copying import fill
from slalom.kernels.exchange import within_reach
from slalom.kernels.gather import hulls_of, place_at
from slalom.kernels.segments import relative_segments
from slalom.kernels.tables import FOR_EVER, Answers, Fleet, Meeting, Rows, Solid, Terms, World
from slalom.kernels.windows import whereabouts


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
def relative(
    rows: Rows, world: World, knots: Array, drift: Array, gain: Array, horizon: float
) -> tuple[Array, Array, Array, Array, Array, MaybeHulls, Indices]:
    """points, gains, radius, growth, reach, hulls and body of the relative motion."""
    _, _, points, gains, radius, growth, turned, body = relative_segments(
        rows.times, rows.points, rows.radius, rows.growth, rows.turns, rows.body, knots, drift, gain, horizon
    )
    n, solid = len(body), world.solid
    reach = np.empty(n)
    for s in range(n):
        reach[s] = radius[s] + max(growth[s], 0.0) + rows.spread[body[s]]
    return points, gains, radius, growth, reach, hulls_among(solid, rows.hull, rows.turns, body, turned), body


@inlined
def hulls_among(solid: Solid, hull: Indices, turns: Array, body: Indices, turned: Array) -> MaybeHulls:
    """The hulls of segments of bodies, of which `hull` tells the numbers; empty where there are none."""
    if len(solid) > 0:
        if len(turns) == 0:
            turned = np.zeros((4, 2, len(body)))
            turned[:, 0] = 1.0
        return hulls_of(solid, hull[body], turned)
    return ()


@inlined
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


@inlined
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
        n, rest = len(body), 1.0 / terms.share - 1.0
        partner = np.empty(n, np.bool_)
        for s in range(n):
            partner[s] = rows.partner[body[s]]
        for c in range(4):
            for axis in range(d):
                by = own[axis]
                for s in range(n):
                    points[c, axis, s] += gains[c, s] * by * rest if partner[s] else 0.0
            for s in range(n):
                gains[c, s] = gains[c, s] / terms.share if partner[s] else gains[c, s]
    limits = limits_of(i, r, fleet, answers, terms)
    return Meeting(limits, *within_reach(limits, points, gains, radius, growth, reach, hulls))


@kernel
def course(
    i: int, r: int, u: Array, fleet: Fleet, answers: Answers, terms: Terms, begin: Array, points: Array, row: int
) -> None:
    """The course of robot i that answers u by response r from now on, into a row of the tables begin and points."""
    first, last = answers.first[r], answers.first[r + 1]
    end = terms.now + (FOR_EVER if terms.shared else answers.knots[last + r])
    for p in range(begin.shape[1]):
        begin[row, p] = end
    for p in range(last - first):
        begin[row, p] = terms.now + answers.knots[first + r + p]
        for c in range(4):
            for axis in range(3):
                points[row, p, c, axis] = (
                    fleet.position[i, axis]
                    + answers.place[first + p, c] * fleet.velocity[i, axis]
                    + answers.gain[first + p, c] * u[axis]
                )


@kernel
def foresee(k: int, fleet: Fleet, terms: Terms) -> None:
    """Where robot k is seen to be during the horizon and at its end."""
    speed = np.empty(3)
    whereabouts(fleet.seen_begin[k], fleet.seen_points[k], terms, fleet.middle[k], fleet.spread[k])
    place_at(fleet.seen_begin, fleet.seen_points, k, terms.now + terms.horizon, fleet.later[k], speed)


@kernel
def commit(i: int, r: int, u: Array, fleet: Fleet, answers: Answers, terms: Terms) -> None:
    """Robot i follows response r under u from now on; with shared manoeuvres the others see it at once."""
    course(i, r, u, fleet, answers, terms, fleet.begin, fleet.points, i)
    fleet.response[i] = r
    fill(fleet.control[i], u)
    if terms.shared:
        fill(fleet.seen_begin[i], fleet.begin[i])
        fill(fleet.seen_points[i], fleet.points[i])
        foresee(i, fleet, terms)
