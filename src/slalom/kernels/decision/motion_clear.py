"""What needs no choice: courses that are clear of all for certain, piece by piece.

Most controls that are preferred are free, and most courses that robots are committed to. To find that out takes no
table of segments under all controls.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.decision.encounters import limits_of, response_path
from slalom.kernels.decision.neighbours import bounding_balls, reachable_neighbours
from slalom.kernels.decision.tables import DecisionSettings, ObstaclePieces, ResponseTable, RobotTable, Scratch
from slalom.kernels.geometry.cubic import below, put_gap, restrict
from slalom.kernels.jit import kernel
from slalom.kernels.selection.exchange import nearest_admissible


@kernel
def chord_distance(p: Array) -> float:
    """A lower bound of the distance to the origin along the cubic p (4, 3): that of `segments.chord_gaps`."""
    square, along = 1e-300, 0.0
    for axis in range(3):
        square += (p[3, axis] - p[0, axis]) ** 2
        along -= p[0, axis] * (p[3, axis] - p[0, axis])
    along = min(max(along / square, 0.0), 1.0)
    least, e, f = 0.0, 0.0, 0.0
    for axis in range(3):
        a, b = p[0, axis], p[3, axis]
        least += (a + along * (b - a)) ** 2
        e += (p[1, axis] - (2.0 * a + b) / 3.0) ** 2
        f += (p[2, axis] - (a + 2.0 * b) / 3.0) ** 2
    return float(np.sqrt(least) - 0.75 * np.sqrt(max(e, f)))


@kernel
def keeps_distance(p: Array, radius: float, stack: Array) -> bool:
    """Whether the cubic p (4, 3) stays at least `radius` away from the origin, up to rounding."""
    put_gap(
        stack,
        p[0, 0], p[0, 1], p[0, 2], p[1, 0], p[1, 1], p[1, 2],
        p[2, 0], p[2, 1], p[2, 2], p[3, 0], p[3, 1], p[3, 2],
        radius * radius,
    )  # fmt: skip
    return below(stack) < 0.0


@kernel
def path_is_clear(
    rows: ObstaclePieces,
    unmet: Flags,
    begin: Array,
    points: Array,
    row: int,
    halved: int,
    now: float,
    horizon: float,
    stack: Array,
) -> bool:
    """Whether a course of a table, `row`, is clear of all rows of bodies that are not `unmet`: True is certain.

    Near hulls it is False. `halved`: the course that those must be clear of that avoid the robot too.
    """
    d, n = rows.points.shape[2], points.shape[1]
    p = np.zeros((4, 3))
    for s in range(len(rows.body)):
        body = rows.body[s]
        if unmet[body]:
            continue
        own, first, width = (
            halved if rows.cooperates[body] else row,
            rows.times[s, 0],
            rows.times[s, 1] - rows.times[s, 0],
        )
        t0, t1, k = max(first, 0.0), min(rows.times[s, 1], horizon), 0
        while t0 < t1:
            # As in `gather.place_at`: the last piece that has a length goes on.
            while k < n - 1 and begin[own, k + 1] - now <= t0 and begin[own, k + 2] > begin[own, k + 1]:
                k += 1
            start, end = begin[own, k] - now, begin[own, k + 1] - now
            stop = min(t1, end) if end > t0 else t1
            a, b = (t0 - first) / width, (stop - first) / width
            e, f = (t0 - start) / (end - start), (stop - start) / (end - start)
            for axis in range(d):
                q = rows.points[s, :, axis]
                q0, q1, q2, q3 = restrict(q[0], q[1], q[2], q[3], a, b)
                o = points[own, k, :, axis]
                o0, o1, o2, o3 = restrict(o[0], o[1], o[2], o[3], e, f)
                p[0, axis], p[1, axis], p[2, axis], p[3, axis] = q0 - o0, q1 - o1, q2 - o2, q3 - o3
            radius = rows.radius[s] + rows.growth[s] * a + max(rows.growth[s] * (b - a), 0.0)
            if chord_distance(p) < radius + rows.hull_radius[body] and not (
                rows.hull[body] < 0 and keeps_distance(p, radius, stack)
            ):
                return False
            t0 = stop
    return True


@kernel
def preferred_is_free(
    i: int,
    r: int,
    wanted: Array,
    own: Array,
    met: Indices,
    rows: ObstaclePieces,
    fleet: RobotTable,
    answers: ResponseTable,
    terms: DecisionSettings,
    draft: Scratch,
    u: Array,
) -> bool:
    """Whether the control of response r nearest to `wanted`, that limits allow, is free for certain; it goes into u.

    The course it leads to is the first of the draft then. `own`: the control that changes nothing. `met`: the robots
    whose rows those of `rows` are, after those of passive bodies.
    """
    limits, w = limits_of(i, r, fleet, answers, terms), draft.control
    if not nearest_admissible(wanted, limits, u)[0]:
        return False
    unmet, bodies, halves = np.zeros(len(rows.hull), np.bool_), len(rows.hull) - len(met), terms.share < 1.0
    unmet[bodies:] = True
    for part in range(2 if halves else 1):
        for axis in range(3):
            w[axis] = u[axis] if part == 0 else own[axis] + (u[axis] - own[axis]) / terms.share
        response_path(i, r, w, fleet, answers, terms, draft.times, draft.points, part)
        bounding_balls(draft.times[part], draft.points[part], terms, draft.centers, draft.radii)
        j = 0
        for k in reachable_neighbours(i, met, draft.centers, draft.radii, fleet, terms):
            while met[j] != k:
                j += 1
            unmet[bodies + j] = False
    return path_is_clear(
        rows, unmet, draft.times, draft.points, 0, 1 if halves else 0, terms.now, terms.horizon, draft.stack
    )
