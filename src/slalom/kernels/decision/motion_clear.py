"""Whether a given path is certainly collision-free, piece by piece: sufficient for most choices.

Most preferred controls are free, and most committed paths are clear. This test needs no table of segments under all
controls.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.decision.bodies import meets_balls
from slalom.kernels.decision.limits import admissible_set
from slalom.kernels.decision.neighbours import reachable_neighbours
from slalom.kernels.decision.paths import bounding_balls, response_path, rest_of_path
from slalom.kernels.decision.tables import Controls, DecisionSettings, DecisionTables, ObstaclePieces, Paths, Scratch
from slalom.kernels.geometry.cubic import below, put_distance, restrict
from slalom.kernels.jit import kernel, squared
from slalom.kernels.selection.candidates import nearest_admissible


@kernel
def chord_distance(p: Array) -> float:
    """A lower bound [m] of the distance to the origin along the cubic p (4, 3) [m]: that of `chord_distances`."""
    square = 1e-300
    along = 0.0
    for axis in range(3):
        square += squared(p[3, axis] - p[0, axis])
        along -= p[0, axis] * (p[3, axis] - p[0, axis])
    along = min(max(along / square, 0.0), 1.0)
    least = 0.0
    e = 0.0
    f = 0.0
    for axis in range(3):
        a = p[0, axis]
        b = p[3, axis]
        least += squared(a + along * (b - a))
        e += squared(p[1, axis] - (2.0 * a + b) / 3.0)
        f += squared(p[2, axis] - (a + 2.0 * b) / 3.0)
    return float(np.sqrt(least) - 0.75 * np.sqrt(max(e, f)))


@kernel
def keeps_distance(p: Array, radius: float, stack: Array) -> bool:
    """Whether the cubic p (4, 3) [m] stays at least `radius` [m] away from the origin, up to rounding."""
    put_distance(stack, p, radius * radius)
    return below(stack) < 0.0


@kernel
def path_is_clear(
    rows: ObstaclePieces,
    skipped: Flags,
    paths: Paths,
    row: int,
    shared_row: int,
    settings: DecisionSettings,
    stack: Array,
) -> bool:
    """Whether row `row` of `paths` is clear of all rows that are not `skipped` (n,): True is certain.

    Near hulls it is False. `shared_row`: the path that must be clear of the bodies that avoid the robot too.
    """
    pieces = rows.pieces
    now = settings.now
    horizon = settings.horizon
    times = paths.times
    points = paths.points
    d = pieces.points.shape[2]
    n = points.shape[1]
    p = np.zeros((4, 3))
    resting = -1.0
    for s in range(len(pieces.body)):
        body = pieces.body[s]
        if skipped[s]:
            continue
        own = shared_row if rows.bodies[body].share < 1.0 else row
        first = pieces.times[s, 0]
        if not rows.bodies[body].at_rest and resting < 0.0:
            resting = rest_of_path(paths, row, now)
        until = horizon if rows.bodies[body].at_rest else min(horizon, resting)
        width = pieces.times[s, 1] - pieces.times[s, 0]
        t0 = max(first, 0.0)
        t1 = min(pieces.times[s, 1], until)
        k = 0
        while t0 < t1:
            # As in `encounters.state_on_path`: the last piece that has a length goes on.
            while k < n - 1 and times[own, k + 1] - now <= t0 and times[own, k + 2] > times[own, k + 1]:
                k += 1
            start = times[own, k] - now
            end = times[own, k + 1] - now
            stop = min(t1, end) if end > t0 else t1
            a = (t0 - first) / width
            b = (stop - first) / width
            e = (t0 - start) / (end - start)
            f = (stop - start) / (end - start)
            for axis in range(d):
                q = pieces.points[s, :, axis]
                q0, q1, q2, q3 = restrict(q[0], q[1], q[2], q[3], a, b)
                o = points[own, k, :, axis]
                o0, o1, o2, o3 = restrict(o[0], o[1], o[2], o[3], e, f)
                p[0, axis] = q0 - o0
                p[1, axis] = q1 - o1
                p[2, axis] = q2 - o2
                p[3, axis] = q3 - o3
            radius = pieces.radius[s] + pieces.growth[s] * a + max(pieces.growth[s] * (b - a), 0.0)
            if chord_distance(p) < radius + rows.bodies[body].hull_radius and not (
                rows.hull[body] < 0 and keeps_distance(p, radius, stack)
            ):
                return False
            t0 = stop
    return True


@kernel
def common_share(rows: ObstaclePieces) -> float:
    """The share [1] of the avoidance of all bodies that do the rest of it; 1 if none does any, 0 if shares differ."""
    common = 1.0
    for b in range(len(rows.bodies)):
        share = rows.bodies[b].share
        if share < 1.0:
            if common < 1.0 and share != common:
                return 0.0
            common = share
    return common


@kernel
def preferred_is_free(
    i: int, r: int, controls: Controls, met: Indices, rows: ObstaclePieces, tables: DecisionTables, scratch: Scratch
) -> bool:
    """Whether the admissible control of response r nearest to the preferred one is free for certain.

    That control goes into `controls.found`, its path into the first row of the scratch. `met` (m,): the robots whose
    bodies follow the passive ones in `rows`.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    u = controls.found
    tested = scratch.control
    unchanged = controls.unchanged
    if not nearest_admissible(controls.preferred, admissible_set(i, r, robots, responses, tables.bounds), u)[0]:
        return False
    share = common_share(rows)
    if share == 0.0:
        return False
    halves = share < 1.0
    pieces = rows.pieces
    ignored = np.zeros(len(rows.bodies), np.bool_)
    for b in range(len(ignored)):
        ignored[b] = rows.bodies[b].robot >= 0
    skipped = np.zeros(len(pieces.body), np.bool_)
    for part in range(2 if halves else 1):
        for axis in range(3):
            tested[axis] = u[axis] if part == 0 else unchanged[axis] + (u[axis] - unchanged[axis]) / share
        response_path(robots.each[i], r, tested, responses, settings, np.inf, scratch.paths, part)
        bounding_balls(scratch.paths.times[part], scratch.paths.points[part], settings, scratch.centers, scratch.radii)
        if part == 0:
            for s in range(len(skipped)):
                skipped[s] = rows.balls[s, 3] < np.inf and not meets_balls(
                    rows.balls[s],
                    0.0,
                    pieces.times[s, 0],
                    pieces.times[s, 1],
                    settings.horizon,
                    scratch.centers,
                    scratch.radii,
                )
        b = 0
        for k in reachable_neighbours(i, met, scratch.centers, scratch.radii, robots):
            while rows.bodies[b].robot != k:
                b += 1
            while b < len(ignored) and rows.bodies[b].robot == k:
                ignored[b] = False
                b += 1
    for s in range(len(skipped)):
        skipped[s] = skipped[s] or ignored[pieces.body[s]]
    return path_is_clear(rows, skipped, scratch.paths, 0, 1 if halves else 0, settings, scratch.stack)
