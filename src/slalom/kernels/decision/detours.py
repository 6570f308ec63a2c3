"""Ways around obstacles at the horizon: their places then, lengths of ways, and estimates of the time along them."""

from typing import Final

import numpy as np

from slalom.kernels.arrays import Array, Body, Flags, Indices, Records
from slalom.kernels.decision.bodies import is_elsewhere
from slalom.kernels.decision.tables import DecisionTables, ObstacleAtHorizon, Scratch
from slalom.kernels.decision.targets import earliest_arrival, target_state
from slalom.kernels.geometry.cubic import copy_into, value
from slalom.kernels.jit import inlined, kernel, squared

SAME_DIRECTION: Final = 0.7
"""[1] Cosine of the angle between the way of a robot and what moves in its direction and holds it up: 45 degrees.
Larger: robots stay behind slower ones that cross their way. Smaller: they take detours around others that come
closer."""

EXISTS: Final = 1e-9
"""[s] An obstacle whose pieces end sooner than this before the horizon exists there. Larger: some that leave count."""


@kernel
def put_at_horizon(
    bodies: Records[Body],
    pieces: tuple[Array, Array, Array, Indices],
    now: float,
    owner: Indices,
    moves: Flags,
    until: Array,
    horizon: float,
    each: Records[ObstacleAtHorizon],
    corners: Array,
) -> Flags:
    """Which of the obstacles exist and are known at the horizon (m,); those that move are put where they are then.

    Their places, displacements and directions come from the pieces of bodies, one of each obstacle.

    Args:
        bodies: (b,), and their times, points, turns and first pieces, with the begin of the window [s], see `Bodies`.
        owner: (m,) numbers of obstacles. moves: (m,) which of them move. until: (o,) [s] see `ObstacleWindow`.
        horizon: [s].
        each: (m,) records, and `corners` (c, 4), of those that move about their positions, in their frames.
    """
    times, points, turns, first_piece = pieces
    d = points.shape[2]
    turning = len(turns) > 0
    body = np.full(len(until), -1)
    for b in range(len(bodies)):
        if first_piece[b] < first_piece[b + 1]:
            body[bodies[b].owner] = b
    there = np.zeros(len(owner), np.bool_)
    for k in range(len(owner)):
        last = until[owner[k]]
        there[k] = last > 0.0
        if not (there[k] and moves[k]):
            continue
        b = body[owner[k]]
        end = now + min(last, horizon)
        if b < 0 or times[first_piece[b + 1] - 1, 1] < end - EXISTS:
            there[k] = False
            continue
        s = piece_at(times, first_piece[b], first_piece[b + 1], now)
        t = piece_at(times, s, first_piece[b + 1], end)
        longer = horizon / min(last, horizon)
        for axis in range(d):
            before = value_at(times, points, s, axis, now)
            moved = longer * (value_at(times, points, t, axis, end) - before)
            each[k].moved[axis] = moved
            each[k].position[axis] = before + moved - bodies[b].offset[axis]
        x = 1.0
        y = 0.0
        if turning:
            x = value_at(times, turns, t, 0, end)
            y = value_at(times, turns, t, 1, end)
            size = np.sqrt(x * x + y * y)
            x /= size
            y /= size
        for c in range(each[k].first, each[k].last):
            for j in (0, 2):
                ahead = corners[c, j]
                aside = corners[c, j + 1]
                corners[c, j] = x * ahead - y * aside
                corners[c, j + 1] = y * ahead + x * aside
            corners[c, 0] += each[k].position[0]
            corners[c, 1] += each[k].position[1]
    return there


@inlined
def piece_at(times: Array, begin: int, end: int, t: float) -> int:
    """The piece from `begin` up to before `end` that holds time t; the first or the last one where none does."""
    last = end - 1
    while begin < last:
        middle = (begin + last) // 2
        if times[middle, 1] <= t:
            begin = middle + 1
        else:
            last = middle
    return begin


@inlined
def value_at(times: Array, points: Array, s: int, axis: int, t: float) -> float:
    """The value of cubic s with control points (n, 4, d) at time t, or at its nearer end."""
    x = min(max((t - times[s, 0]) / (times[s, 1] - times[s, 0]), 0.0), 1.0)
    return float(value(points[s, 0, axis], points[s, 1, axis], points[s, 2, axis], points[s, 3, axis], x))


@kernel
def in_the_way(each: Records[ObstacleAtHorizon], position: Array, target: Array, around: float, reach: float) -> Flags:
    """Which obstacles hold up a robot on its straight way to the target: (m,); none if none covers a part of that way.

    Those at rest that cover a part of a straight way from a place within `reach` [m]. Those that move in the direction
    of the way, and that the robot may meet within its reach.

    Args:
        position, target: (d,) [m]. around: [m] from the position of the robot to its surface, with the margin.
    """
    found = np.zeros(len(each), np.bool_)
    blocked = False
    length = 1e-18
    for axis in range(len(position)):
        length += squared(target[axis] - position[axis])
    length = np.sqrt(length)
    for k in range(len(each)):
        body = each[k]
        along = 0.0
        ahead = 0.0
        moved = 0.0
        away = 0.0
        for axis in range(len(position)):
            way = (target[axis] - position[axis]) / length
            now = body.position[axis] - body.moved[axis] - position[axis]
            along += now * way
            ahead += body.moved[axis] * way
            moved += squared(body.moved[axis])
            away += squared(now)
        if moved > 0.0 and ahead < SAME_DIRECTION * np.sqrt(moved):
            continue
        size = body.ball + around
        nearest = min(max(along, 0.0), length)
        beside = np.sqrt(max(away - along * along, 0.0) + squared(along - nearest))
        found[k] = (np.sqrt(away) if moved > 0.0 else beside) < size + reach
        blocked = blocked or (found[k] and beside < size)
    return found if blocked else np.zeros(len(each), np.bool_)


@inlined
def longer_by_balls(i: int, goal: Array, tables: DecisionTables, scratch: Scratch) -> float:
    """Extra length [m] of the path of robot i from the scratch's position to the goal (3,) [m] around passive balls."""
    robot = tables.robots.each[i]
    longer = 0.0
    for e in range(len(tables.at_horizon.each)):
        body = tables.at_horizon.each[e]
        if body.filled and not is_elsewhere(body.world, robot.world):
            radius = body.ball + robot.radius + robot.margin
            longer += detour_length(scratch.position, goal, body.position, radius)
    return longer


@kernel
def time_around(i: int, t: float, straight: float, tables: DecisionTables, scratch: Scratch) -> float:
    """An estimate [s] of the time of robot i from the scratch's state at t [s] to its target, around passive obstacles.

    Each is where the robot meets it that drives straight to its target at its largest speed, or at the horizon if that
    is sooner. `straight` [s]: without them. In the plane the robot heads for the first point at which its path bends
    around the obstacle with the longest detour; the lengths of all others are added.
    """
    robot = tables.robots.each[i]
    obstacles = tables.at_horizon
    position = scratch.position
    goal = scratch.target
    bend = np.zeros(2)
    first = np.zeros(2)
    longest = 0.0
    longer = 0.0
    top = robot.max_speed
    here = np.zeros(len(position))
    there = np.zeros(len(position))
    target_state(i, t, tables.robots, tables.targets, goal, scratch.target_velocity)
    for e in range(len(obstacles.each)):
        body = obstacles.each[e]
        around = robot.radius + robot.margin
        if is_elsewhere(body.world, robot.world):
            continue
        # In the frame in which the body is where it is at the horizon.
        left = 1.0 - share_met(body, position, goal, top, t - tables.settings.now, around, tables.settings.horizon)
        for axis in range(len(position)):
            here[axis] = position[axis] + left * body.moved[axis]
            there[axis] = goal[axis] + left * body.moved[axis]
        if not may_block(here, there, body.position, body.ball + around):
            continue
        radius = body.radius + around
        if body.last > body.first:
            extra = length_around(here, there, obstacles.corners[body.first : body.last], radius, bend)
        else:
            extra = detour_length(here, there, body.position, radius)
            if extra > longest and len(position) == 2:
                tangent_point(here, there, body.position, radius, bend)
        longer += extra
        if extra > longest:
            longest = extra
            for axis in range(2):
                first[axis] = bend[axis] - left * body.moved[axis]
    if longest == 0.0 or len(position) == 3:
        return float(straight + longer / top)
    square = 0.0
    for axis in range(2):
        square += squared(goal[axis] - position[axis])
        scratch.displacement[axis] = first[axis] - position[axis]
    rest = longer + np.sqrt(square) - np.sqrt(squared(scratch.displacement[0]) + squared(scratch.displacement[1]))
    rest = rest / top + (0.5 * top / robot.stopping if robot.stop else 0.0)
    return float(earliest_arrival(scratch.displacement, scratch.velocity, robot.max_acceleration, top, 0.0) + rest)


@inlined
def share_met(
    body: ObstacleAtHorizon, position: Array, goal: Array, top: float, after: float, around: float, horizon: float
) -> float:
    """The share [1] of the horizon [s] after which a robot meets a body on its way to the goal, at most 1.

    It drives from its position (d,) [m], `after` [s], at speed `top` [m/s], and meets the body's ball at a distance of
    `around` [m].
    """
    square = 1e-300
    ahead = 0.0
    speed = 0.0
    for axis in range(len(position)):
        way = goal[axis] - position[axis]
        square += way * way
        ahead += (body.position[axis] - (1.0 - after / horizon) * body.moved[axis] - position[axis]) * way
        speed += body.moved[axis] / horizon * way
    length = np.sqrt(square)
    gap = max(ahead / length - body.ball - around, 0.0)
    closing = top - speed / length
    if gap >= closing * (horizon - after):
        return 1.0
    return float(min(max(after + gap / closing, 0.0) / horizon, 1.0))


@inlined
def tangent_point(position: Array, goal: Array, center: Array, radius: float, point: Array) -> None:
    """Write the point (2,) [m] at which the shorter path from `position` to `goal` (2,) [m] touches a disc.

    For a position inside the disc: a point beside it.
    """
    x = center[0] - position[0]
    y = center[1] - position[1]
    away = max(np.sqrt(x * x + y * y), 1e-12)
    side = -1.0 if (goal[0] - position[0]) * y - (goal[1] - position[1]) * x > 0.0 else 1.0
    sine = min(radius / away, 1.0)
    cosine = np.sqrt(1.0 - sine * sine)
    length = max(away * cosine, 0.5 * radius)
    point[0] = position[0] + length * (cosine * x - side * sine * y) / away
    point[1] = position[1] + length * (cosine * y + side * sine * x) / away


@kernel
def detour_length(position: Array, goal: Array, center: Array, radius: float) -> float:
    """Extra length [m] of the path from `position` to `goal` (d,) [m] around a ball at `center` (d,) or (3,) [m].

    Two tangents and an arc; 0 for a ball that is not in the way.
    """
    first = 0.0
    second = 0.0
    product = 0.0
    straight = 0.0
    for axis in range(len(position)):
        a = position[axis] - center[axis]
        b = goal[axis] - center[axis]
        first += a * a
        second += b * b
        product += a * b
        straight += squared(goal[axis] - position[axis])
    first = np.sqrt(first)
    second = np.sqrt(second)
    straight = np.sqrt(straight)
    cosine = product / max(first * second, 1e-12)
    first = max(first, radius)
    second = max(second, radius)
    angle = np.arccos(min(1.0, max(-1.0, cosine))) - np.arccos(radius / first) - np.arccos(radius / second)
    if angle <= 0.0:
        return 0.0
    tangents = np.sqrt(first * first - radius * radius) + np.sqrt(second * second - radius * radius)
    return float(max(tangents + radius * angle - straight, 0.0))


@kernel
def may_block(position: Array, goal: Array, center: Array, radius: float) -> bool:
    """Whether a ball at `center` (d,) or (3,) [m] may cover a part of the line from `position` to `goal` (d,) [m].

    If not, `detour_length` around it is 0.
    """
    product = 0.0
    square = 1e-300
    for axis in range(len(position)):
        way = goal[axis] - position[axis]
        product += (center[axis] - position[axis]) * way
        square += way * way
    along = min(1.0, max(0.0, product / square))
    away = 0.0
    for axis in range(len(position)):
        away += squared(center[axis] - position[axis] - along * (goal[axis] - position[axis]))
    return bool(away < (1.0 + 1e-6) * radius * radius)


@kernel
def length_around(position: Array, goal: Array, corners: Array, radius: float, bend: Array) -> float:
    """Extra length [m] of the path from `position` to `goal` (2,) [m] around a convex body, on its shorter side.

    `corners` (n, 4), see `AtHorizon`, in positive order; the path passes each that it touches at a distance of `radius`
    [m]. Its first bend goes into `bend` (2,) [m]. 0 for a body that is not in the way.
    """
    n = len(corners)
    grown = np.empty((n, 2))
    for k in range(n):
        for axis in range(2):
            grown[k, axis] = corners[k, axis] + radius * corners[k, 2 + axis]
    begin = np.array([position[0], position[1]])
    end = np.array([goal[0], goal[1]])
    if not crosses(begin, end, grown):
        return 0.0
    straight = np.sqrt(squared(end[0] - begin[0]) + squared(end[1] - begin[1]))
    other = np.zeros(2)
    left = length_beside(begin, end, grown, 1.0, bend)
    right = length_beside(begin, end, grown, -1.0, other)
    if right < left:
        copy_into(bend, other)
    return float(max(min(left, right) - straight, 0.0))


@kernel
def crosses(begin: Array, end: Array, corners: Array) -> bool:
    """Whether the line from `begin` to `end` (2,) has a part inside a convex polygon with corners (n, 2)."""
    first = 0.0
    last = 1.0
    n = len(corners)
    for k in range(n):
        a = corners[k]
        b = corners[(k + 1) % n]
        inside = (b[0] - a[0]) * (begin[1] - a[1]) - (b[1] - a[1]) * (begin[0] - a[0])
        then = (b[0] - a[0]) * (end[1] - a[1]) - (b[1] - a[1]) * (end[0] - a[0])
        if inside <= 0.0 and then <= 0.0:
            return False
        if inside < 0.0:
            first = max(first, inside / (inside - then))
        elif then < 0.0:
            last = min(last, inside / (inside - then))
    return first < last


@kernel
def length_beside(begin: Array, end: Array, corners: Array, side: float, bend: Array) -> float:
    """Length [m] of the shortest path from `begin` to `end` (2,) around the corners (n, 2) on a `side` of the line.

    side: 1 to the left, -1 to the right. The first corner on the path goes into `bend` (2,); without one it stays.
    """
    n = len(corners)
    open_ = np.zeros(n, np.bool_)
    for k in range(n):
        open_[k] = side * area(begin, end, corners[k]) > 0.0
    here = begin
    length = 0.0
    while True:
        following = -1
        then = end
        for k in range(n):
            if open_[k] and side * area(here, then, corners[k]) > 0.0:
                following = k
                then = corners[k]
        if length == 0.0 and following >= 0:
            copy_into(bend, then)
        length += np.sqrt(squared(then[0] - here[0]) + squared(then[1] - here[1]))
        if following < 0:
            return float(length)
        # A corner before it on the path is not on the rest of it.
        for k in range(n):
            away = (corners[k, 0] - then[0]) * (end[0] - begin[0]) + (corners[k, 1] - then[1]) * (end[1] - begin[1])
            open_[k] = open_[k] and k != following and away > 0.0
        here = then


@kernel
def area(a: Array, b: Array, c: Array) -> float:
    """Twice the area of a triangle (2,), positive if c is to the left of the line from a to b."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


@kernel
def detour_lengths(position: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """`detour_length` around each of the balls with `centers` (n, d) and `radii` (n,) [m]: (n,) [m]."""
    longer = np.empty(len(radii))
    for k in range(len(radii)):
        longer[k] = detour_length(position, goal, centers[k], radii[k])
    return longer
