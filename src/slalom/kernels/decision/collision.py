"""The decision of a robot if all its manoeuvres are predicted to collide: the latest collision, then the slowest."""

from typing import Final

import numpy as np

from slalom.kernels.arrays import Array, Flags, Pieces
from slalom.kernels.decision.bodies import hulls_of_bodies, reduce_margin
from slalom.kernels.decision.paths import response_path, state_on_path, unchanged_control
from slalom.kernels.decision.response_motion import choose, relative_motion
from slalom.kernels.decision.tables import DecisionTables, ObstaclePieces, ResponseSearch
from slalom.kernels.geometry.cubic import copy_into, restrict, slope, value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.relative_motion.segments import rows_at_rest

COMPARED_COLLISION: Final = 0.1
"""[1] To this part of a period the times of unavoidable collisions under two responses are compared.

Larger: a robot may choose a response that collides that much sooner. With 0.5, 4 of 1000 crossings of observed crowds
collided that do not with 0.1. Smaller: more choices where nothing is safe.
"""

LATEST_COLLISION: Final = 0.02
"""[1] To this part of a period the time of the unavoidable collision is found under the response that is chosen.

Larger: the robot collides that much sooner than it could. With 0.5, `nlvo` collided in 45 of 200 crossings of the
roundabout, with 0.1 in 21. Smaller: more choices where nothing is safe.
"""

WORK_ROW: Final = 0.3
"""[us] Counted for each piece of a body near a motion: see WORK_NODE."""


@kernel
def free_without_margin(i: int, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch) -> bool:
    """Whether robot i has a response with a control that collides with none of `rows` taken without their margins."""
    first = tables.responses.kinds[tables.robots.each[i].kind]
    free = False
    anywhere = np.zeros(len(rows.pieces.body), np.bool_)
    radius = rows.pieces.radius.copy()
    growth = rows.pieces.growth.copy()
    u = np.zeros(3)
    reduce_margin(1.0, rows)
    for k in range(len(search.excluded)):
        if not search.excluded[k]:
            free = free_until(i, first + k, tables.settings.horizon, rows, anywhere, search.preferred[k], tables, u)
        if free:
            break
    copy_into(rows.pieces.radius, radius)
    copy_into(rows.pieces.growth, growth)
    return free


@kernel
def latest_collision(i: int, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch) -> int:
    """The response with the latest collision among `rows`; its control goes into `search.control`.

    Bodies at rest are avoided up to the horizon if any response can. Of the responses within one period of the latest,
    the one with the least impact speed. -1 if all collide within one period.
    Responses are compared to the part COMPARED_COLLISION of a period; the control of the one that is chosen collides at
    most the part LATEST_COLLISION of a period sooner than necessary.
    """
    settings = tables.settings
    first = tables.responses.kinds[tables.robots.each[i].kind]
    count = len(search.excluded)
    times = np.zeros(count)
    ends = np.zeros(count)
    speeds = np.full(count, np.inf)
    controls = np.zeros((count, 3))
    u = np.zeros(3)
    latest = 0.0
    still = rows_at_rest(rows.pieces)
    for _attempt in range(2):
        for k in range(count if latest == 0.0 else 0):
            low = max(latest - settings.period, 1e-9)
            if search.excluded[k] or not free_until(i, first + k, low, rows, still, search.preferred[k], tables, u):
                continue
            copy_into(search.control, u)
            within = COMPARED_COLLISION * settings.period
            times[k], ends[k] = free_from(i, first + k, low, settings.horizon, within, rows, still, tables, search)
            copy_into(controls[k], search.control)
            latest = max(latest, times[k])
            speeds[k] = impact_speed(i, first + k, ends[k], controls[k], rows, tables, search)
        if latest == 0.0:
            still[:] = False
    best = -1
    for k in range(count):
        if times[k] >= max(latest - settings.period, settings.period) and (best < 0 or speeds[k] < speeds[best]):
            best = k
    if best >= 0:
        copy_into(search.control, controls[best])
        within = LATEST_COLLISION * settings.period
        free_from(i, first + best, times[best], ends[best], within, rows, still, tables, search)
    return best


@kernel
def free_from(
    i: int,
    r: int,
    low: float,
    high: float,
    within: float,
    rows: ObstaclePieces,
    still: Flags,
    tables: DecisionTables,
    search: ResponseSearch,
) -> tuple[float, float]:
    """Times [s] at most `within` apart: up to the first, response r has a free control; up to the second, it has none.

    Both lie between `low` [s], up to which `search.control` is free, and `high` [s]. The control that is free
    longest goes there. The time is bracketed by steps that double, and then found by bisection.
    """
    u = np.zeros(3)
    step = 2.0 * tables.settings.period
    k = r - tables.responses.kinds[tables.robots.each[i].kind]
    while high - low > within:
        middle = min(low + step, 0.5 * (low + high))
        if free_until(i, r, middle, rows, still, search.preferred[k], tables, u):
            low = middle
            step = 2.0 * step
            copy_into(search.control, u)
        else:
            high = middle
    return low, high


@kernel
def free_until(
    i: int, r: int, until: float, rows: ObstaclePieces, still: Flags, preferred: Array, tables: DecisionTables, u: Array
) -> bool:
    """Whether a control of response r collides with nothing up to `until` [s], on rows that are `still` ever.

    The one nearest to `preferred` (3,) goes into u (3,).
    """
    unchanged = np.zeros(3)
    unchanged_control(tables.robots.each[i], r, tables.responses, unchanged)
    end = until
    if still.any():
        rows = cut_rows(rows, still, until)
        end = tables.settings.horizon
    motion = relative_motion(i, r, rows, tables, unchanged, end, preferred, np.inf)
    free, work = choose(motion, preferred, tables.settings.dimension, np.inf, np.inf, u)
    tables.robots.each[i].work += work + WORK_ROW * len(rows.pieces.body)
    return free


@kernel
def cut_rows(rows: ObstaclePieces, still: Flags, until: float) -> ObstaclePieces:
    """The rows, of which those that are not `still` (n,) count up to `until` [s] only."""
    pieces = rows.pieces
    times, points = pieces.times.copy(), pieces.points.copy()
    growth, turns = pieces.growth.copy(), pieces.turns.copy()
    for s in range(len(times)):
        if still[s] or times[s, 1] <= until:
            continue
        share = max(until - times[s, 0], 0.0) / (times[s, 1] - times[s, 0])
        times[s, 1] = max(until, times[s, 0])
        growth[s] *= share
        for axis in range(points.shape[2]):
            cut_piece(points[s, :, axis], share)
        for axis in range(2 if len(turns) > 0 else 0):
            cut_piece(turns[s, :, axis], share)
    cut = Pieces(times, points, pieces.radius, growth, turns, pieces.body)
    return ObstaclePieces(cut, rows.margin, rows.balls, rows.bodies, rows.hull)


@inlined
def cut_piece(p: Array, share: float) -> None:
    """Restrict a cubic piece (4,) to the first `share` [1] of its time."""
    p[0], p[1], p[2], p[3] = restrict(p[0], p[1], p[2], p[3], 0.0, share)


@kernel
def impact_speed(
    i: int, r: int, t: float, u: Array, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch
) -> float:
    """The speed [m/s] relative to the nearest body after t [s], under control u (3,) of response r."""
    robot = tables.robots.each[i]
    settings = tables.settings
    scratch = search.scratch
    pieces = rows.pieces
    hulls = hulls_of_bodies(tables.bodies.corners, rows.hull, np.empty((4, 2, 0)))
    place = np.zeros((1, 3))
    direction = np.array([[1.0, 0.0]])
    nearest = np.inf
    speed = np.inf
    response_path(robot, r, u, tables.responses, settings, t, scratch.paths, 0)
    state_on_path(scratch.paths, 0, settings.now + t, scratch.position, scratch.velocity)
    for s in range(len(pieces.body)):
        if t < pieces.times[s, 0] or t > pieces.times[s, 1]:
            continue
        width = pieces.times[s, 1] - pieces.times[s, 0]
        square = 0.0
        x = (t - pieces.times[s, 0]) / width
        body = pieces.body[s]
        for axis in range(settings.dimension):
            p = pieces.points[s, :, axis]
            place[0, axis] = value(p[0], p[1], p[2], p[3], x) - scratch.position[axis]
            square += squared(slope(p[0], p[1], p[2], p[3], x) / width - scratch.velocity[axis])
        for axis in range(2 if len(pieces.turns) > 0 else 0):
            p = pieces.turns[s, :, axis]
            direction[0, axis] = value(p[0], p[1], p[2], p[3], x)
        gap = distances(place, direction, rows.hull[body : body + 1], hulls)[0, 0]
        gap -= pieces.radius[s] + pieces.growth[s] * x
        if gap < nearest:
            nearest = gap
            speed = np.sqrt(square)
    return float(speed)
