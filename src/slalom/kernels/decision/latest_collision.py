"""The decision of a robot if all its manoeuvres are predicted to collide: the latest collision, then the slowest."""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.decision.encounters import reduce_margin
from slalom.kernels.decision.passive_bodies import hulls_of_bodies
from slalom.kernels.decision.paths import response_path, state_on_path, unchanged_control
from slalom.kernels.decision.response_motion import choose, relative_motion
from slalom.kernels.decision.tables import DecisionTables, ObstaclePieces, ResponseSearch
from slalom.kernels.geometry.cubic import copy_into, slope, value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared
from slalom.tolerances import COMPARED_COLLISION, LATEST_COLLISION, WORK_ROW


@kernel
def free_without_margin(i: int, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch) -> bool:
    """Whether robot i has a response with a control that collides with none of `rows` taken without their margins."""
    first, free = tables.responses.kinds[tables.robots.each[i].kind], False
    radius, growth, u = rows.pieces.radius.copy(), rows.pieces.growth.copy(), np.zeros(3)
    reduce_margin(1.0, rows)
    for k in range(len(search.excluded)):
        if not search.excluded[k]:
            free = free_until(i, first + k, tables.settings.horizon, rows, search.preferred[k], tables, u)
        if free:
            break
    copy_into(rows.pieces.radius, radius)
    copy_into(rows.pieces.growth, growth)
    return free


@kernel
def latest_collision(i: int, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch) -> int:
    """The response with the latest collision among `rows`; its control goes into `search.control`.

    Of those within one period of the latest, the one with the least impact speed. -1 if all collide within one period.
    Responses are compared to the part COMPARED_COLLISION of a period; the control of the one that is chosen collides at
    most the part LATEST_COLLISION of a period sooner than necessary.
    """
    settings, first, count = tables.settings, tables.responses.kinds[tables.robots.each[i].kind], len(search.excluded)
    times, ends, speeds = np.zeros(count), np.zeros(count), np.full(count, np.inf)
    controls, u, latest = np.zeros((count, 3)), np.zeros(3), 0.0
    for k in range(count):
        low = max(latest - settings.period, 1e-9)
        if search.excluded[k] or not free_until(i, first + k, low, rows, search.preferred[k], tables, u):
            continue
        copy_into(search.control, u)
        within = COMPARED_COLLISION * settings.period
        times[k], ends[k] = free_from(i, first + k, low, settings.horizon, within, rows, tables, search)
        copy_into(controls[k], search.control)
        latest = max(latest, times[k])
        speeds[k] = impact_speed(i, first + k, ends[k], controls[k], rows, tables, search)
    best = -1
    for k in range(count):
        if times[k] >= max(latest - settings.period, settings.period) and (best < 0 or speeds[k] < speeds[best]):
            best = k
    if best >= 0:
        copy_into(search.control, controls[best])
        within = LATEST_COLLISION * settings.period
        free_from(i, first + best, times[best], ends[best], within, rows, tables, search)
    return best


@kernel
def free_from(
    i: int,
    r: int,
    low: float,
    high: float,
    within: float,
    rows: ObstaclePieces,
    tables: DecisionTables,
    search: ResponseSearch,
) -> tuple[float, float]:
    """Times [s] at most `within` apart: up to the first, response r has a free control; up to the second, it has none.

    Both lie between `low` [s], up to which `search.control` is free, and `high` [s]. The control that is free
    longest goes there. The time is bracketed by steps that double, and then found by bisection.
    """
    u, step, k = np.zeros(3), 2.0 * tables.settings.period, r - tables.responses.kinds[tables.robots.each[i].kind]
    while high - low > within:
        middle = min(low + step, 0.5 * (low + high))
        if free_until(i, r, middle, rows, search.preferred[k], tables, u):
            low, step = middle, 2.0 * step
            copy_into(search.control, u)
        else:
            high = middle
    return low, high


@kernel
def free_until(
    i: int, r: int, until: float, rows: ObstaclePieces, preferred: Array, tables: DecisionTables, u: Array
) -> bool:
    """Whether a control of response r collides with nothing up to `until` [s].

    The one nearest to `preferred` (3,) goes into u (3,).
    """
    unchanged = np.zeros(3)
    unchanged_control(tables.robots.each[i], r, tables.responses, unchanged)
    motion = relative_motion(i, r, rows, tables, unchanged, until)
    free, work = choose(motion, preferred, tables.settings.dimension, np.inf, u)
    tables.robots.each[i].work += work + WORK_ROW * len(rows.pieces.body)
    return free


@kernel
def impact_speed(
    i: int, r: int, t: float, u: Array, rows: ObstaclePieces, tables: DecisionTables, search: ResponseSearch
) -> float:
    """The speed [m/s] relative to the nearest body after t [s], under control u (3,) of response r."""
    robot, settings, scratch, pieces = tables.robots.each[i], tables.settings, search.scratch, rows.pieces
    hulls = hulls_of_bodies(tables.bodies.corners, rows.hull, np.empty((4, 2, 0)))
    place, direction, nearest, speed = np.zeros((1, 3)), np.array([[1.0, 0.0]]), np.inf, np.inf
    response_path(robot, r, u, tables.responses, settings, t, scratch.paths, 0)
    state_on_path(scratch.paths, 0, settings.now + t, scratch.position, scratch.velocity)
    for s in range(len(pieces.body)):
        if t < pieces.times[s, 0] or t > pieces.times[s, 1]:
            continue
        width, square = pieces.times[s, 1] - pieces.times[s, 0], 0.0
        x, body = (t - pieces.times[s, 0]) / width, pieces.body[s]
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
            nearest, speed = gap, np.sqrt(square)
    return float(speed)
