"""Predictions of observed robots that end at obstacles at rest, which robots avoid and do not drive into.

A robot is predicted to stop where it would get into contact with a body that does not move within the horizon.
"""

from typing import Final

import numpy as np

from slalom.kernels.arrays import Array, Bodies, Indices
from slalom.kernels.decision.bodies import hulls_of_bodies, is_elsewhere, is_near
from slalom.kernels.decision.tables import DecisionSettings, Paths, RobotTable
from slalom.kernels.geometry.cubic import copy_into, restrict, value
from slalom.kernels.geometry.hulls import distances
from slalom.kernels.jit import kernel, squared
from slalom.kernels.relative_motion.window import rows_within

STOP_DEPTH: Final = 1e-3
"""[m] How deep in an obstacle an observed robot is predicted to stop, at most; deeper if it gets there in one period.
Larger: stops are predicted later. Smaller: a robot that moves along a wall may be predicted to stop by rounding."""


@kernel
def pieces_at_rest(bodies: Bodies, horizon: float) -> tuple[Indices, Indices, Array]:
    """Numbers (n,) of bodies that exist now and do not move up to the horizon [s], a piece of each, and their ends.

    A body may end before the horizon, and counts for so long [s].
    """
    pieces = bodies.pieces
    now = bodies.now
    count = 0
    most = len(bodies.each)
    body = np.empty(most, np.int64)
    piece = np.empty(most, np.int64)
    ends = np.empty(most)
    for b in range(most):
        end = now + min(bodies.until[bodies.each[b].owner], horizon)
        first, last = rows_within(pieces.times, bodies.first_piece[b], bodies.first_piece[b + 1], now, end)
        still = first < last and pieces.times[first, 0] <= now
        for s in range(first, last):
            for c in range(4):
                for axis in range(pieces.points.shape[2]):
                    still = still and pieces.points[s, c, axis] == pieces.points[first, 0, axis]
                for axis in range(2 if len(pieces.turns) > 0 else 0):
                    still = still and pieces.turns[s, c, axis] == pieces.turns[first, 0, axis]
        if still:
            body[count] = b
            piece[count] = first
            ends[count] = min(end, pieces.times[last - 1, 1]) - now
            count += 1
    return body[:count], piece[:count], ends[:count]


@kernel
def farthest_point(k: int, paths: Paths, settings: DecisionSettings, start: Array) -> float:
    """How far [m] from where it is now the path in row k leads within the horizon; that position goes into `start`."""
    far = 0.0
    times = paths.times[k]
    points = paths.points[k]
    now = settings.now
    end = settings.now + settings.horizon
    begun = False
    for p in range(len(points)):
        first = times[p]
        last = times[p + 1]
        if last <= max(first, now) or first >= end:
            continue
        e = max(now - first, 0.0) / (last - first)
        f = min(end - first, last - first) / (last - first)
        corners = np.zeros((4, 3))
        for axis in range(3):
            p0 = points[p, 0, axis]
            p1 = points[p, 1, axis]
            p2 = points[p, 2, axis]
            p3 = points[p, 3, axis]
            corners[0, axis], corners[1, axis], corners[2, axis], corners[3, axis] = restrict(p0, p1, p2, p3, e, f)
        if not begun:
            copy_into(start, corners[0])
            begun = True
        for c in range(4):
            square = 0.0
            for axis in range(3):
                square += squared(corners[c, axis] - start[axis])
            far = max(far, np.sqrt(square))
    return far


@kernel
def contact_on_path(
    times: Array, points: Array, b: int, s: int, radius: float, until: float, bodies: Bodies, now: float
) -> float:
    """The time [s] at which a path is STOP_DEPTH / 2 to STOP_DEPTH deep in body b, at rest on piece s; inf: never.

    A path that is in contact `now` [s] must get deeper by that. The path has cubic pieces between `times` (n + 1,) [s]
    with control points (n, 4, 3) [m], and is examined up to the time `until` [s].

    The body is convex. It lies beyond the plane through its nearest point, at right angles to the direction of that
    point, so the clearance falls no faster than the path moves along the direction.

    Args: radius: [m] of the body, with that of the robot.
    """
    level = np.inf
    place = np.zeros((1, 3))
    direction = np.array([[1.0, 0.0]])
    hulls = hulls_of_bodies(bodies.corners, bodies.hull[b : b + 1], np.empty((4, 2, 0)))
    if len(bodies.pieces.turns) > 0:
        direction[0, 0] = bodies.pieces.turns[s, 0, 0]
        direction[0, 1] = bodies.pieces.turns[s, 0, 1]
    for p in range(len(points)):
        begin = times[p]
        end = min(times[p + 1], until)
        t = max(begin, now)
        width = times[p + 1] - begin
        while t < end:
            for axis in range(bodies.pieces.points.shape[2]):
                p0 = points[p, 0, axis]
                p1 = points[p, 1, axis]
                p2 = points[p, 2, axis]
                p3 = points[p, 3, axis]
                place[0, axis] = bodies.pieces.points[s, 0, axis] - value(p0, p1, p2, p3, (t - begin) / width)
            found = distances(place, direction, bodies.hull[b : b + 1], hulls)
            clearance = found[0, 0] - radius
            if level == np.inf:
                level = min(clearance, 0.0) - STOP_DEPTH
            if clearance - level <= 0.5 * STOP_DEPTH:
                return float(t)
            approach = 0.0
            for c in range(3):
                leg = 0.0
                for axis in range(3):
                    leg += (points[p, c + 1, axis] - points[p, c, axis]) * found[0, 1 + axis]
                approach = max(approach, 3.0 * leg / width)
            t = t + (clearance - level) / approach if approach > 0.0 else np.inf
    return np.inf


@kernel
def stop_path(k: int, paths: Paths, t: float) -> None:
    """Let the path in row k rest from a time t [s] on, up to its last time."""
    times = paths.times[k]
    points = paths.points[k]
    last = len(points)
    for p in range(last - 1):
        if times[p] <= t < times[p + 1]:
            share = (t - times[p]) / (times[p + 1] - times[p])
            for axis in range(3):
                p0 = points[p, 0, axis]
                p1 = points[p, 1, axis]
                p2 = points[p, 2, axis]
                p3 = points[p, 3, axis]
                p0, p1, p2, p3 = restrict(p0, p1, p2, p3, 0.0, share)
                points[p, 0, axis] = p0
                points[p, 1, axis] = p1
                points[p, 2, axis] = p2
                points[p, 3, axis] = p3
                for c in range(4):
                    points[p + 1, c, axis] = p3
            times[p + 1] = t
            for q in range(p + 2, last):
                times[q] = times[last]
            return


@kernel
def stop_at_obstacles(
    kind: int, robots: RobotTable, bodies: Bodies, rounding: float, settings: DecisionSettings
) -> None:
    """Let robots with a `kind` of skeleton rest, on their observed paths, from a contact with a body at rest on.

    At the earliest after one period. `bodies` are grown by that skeleton and its `rounding` [m]. The table has room for
    one piece more than each path needs.
    """
    observed = robots.observed
    now = settings.now
    start = np.zeros(3)
    body, piece, ends = pieces_at_rest(bodies, settings.horizon)
    for k in range(len(robots.each)):
        robot = robots.each[k]
        if robot.skeleton != kind or not robot.present:
            continue
        far = farthest_point(k, observed, settings, start)
        more = robot.rounding - rounding
        stop = now + settings.horizon
        for n in range(len(body) if far > 0.0 else 0):
            passive = bodies.each[body[n]]
            ball = bodies.balls[piece[n]]
            radius = passive.radius + more
            near = is_near(ball, start, far + radius + passive.hull_radius)
            if near and not is_elsewhere(passive.world, robot.world):
                until = min(stop, now + ends[n])
                times = observed.times[k]
                points = observed.points[k]
                stop = min(stop, contact_on_path(times, points, body[n], piece[n], radius, until, bodies, now))
        if stop < now + settings.horizon:
            # What is guaranteed for one period counts on the free motion: a robot may slide along a wall.
            stop_path(k, observed, max(stop, now + settings.period))
