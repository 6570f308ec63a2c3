"""Traffic circles: robots whose straight paths would meet pass the common point counterclockwise.

`update_targets` keeps one circle for each robot.
"""

from typing import Final

import numpy as np

from slalom.base.tolerances import DIVISOR_FLOOR
from slalom.kernels.arrays import Array, Flags, Indices
from slalom.kernels.geometry.cubic import copy_into
from slalom.kernels.guidance.grid import along_and_across, cell_costs, farthest_in_sight, goal_in_sight, new_path_search
from slalom.kernels.guidance.tables import Grid, GuidanceState, PathSearch, RobotRows
from slalom.kernels.jit import kernel, squared, vectorized

# Filter that discards robots which cannot affect robot i before the exact test. It passes all that matter, few others.


FILTER_SLACK: Final = 1e-6
"""[1] Relative excess of squared distances and of times in the filter, for its rounding. Larger: more robots pass.
Smaller than rounding: robots on the border of the exact test are discarded."""

CIRCLE_ENTRY: Final = 2.0
"""[1] Robots within this many of their radii of a traffic circle, or on their way there, are counted on it. Larger:
robots that only pass enlarge the circle. Smaller: robots that enter are counted late."""

CIRCLE_ARC: Final = 1.57
"""[1] Robots count on a traffic circle if their distances from its centre differ by this many of its radii, or less.
That is a quarter of its circumference. Larger: robots that are there at other times enlarge the circle, in large crowds
without end. Smaller: robots in the same queue have different circles and meet frontally (docs/design/0008)."""


@kernel
def robot_rows(position: Array, velocity: Array, radius: Array, present: Flags) -> RobotRows:
    """Rows of all robots: position (n, 3) [m], velocity (n, 3) [m/s], radius (n,) [m], present (n,)."""
    n = len(radius)
    columns = np.empty((6, n))
    for k in range(n):
        columns[0, k], columns[1, k] = position[k, 0], position[k, 1]
        columns[2, k], columns[3, k] = velocity[k, 0], velocity[k, 1]
        columns[4, k] = radius[k] if present[k] else np.nan
        columns[5, k] = np.sqrt(velocity[k, 0] * velocity[k, 0] + velocity[k, 1] * velocity[k, 1])
    return RobotRows(columns, np.empty(n, np.bool_), np.empty(n, np.int64))


@kernel
def may_encounter(
    position: Array, velocity: tuple[float, float], radius: float, end: float, factor: float, rows: RobotRows
) -> int:
    """Number of robots that may come nearer than `factor` times the sum of radii before `end` [s]; see `candidates`.

    The robot starts at position (2,) or (3,) [m] with a constant velocity [m/s] and a radius [m]. With relative
    position r and relative velocity m, the least distance is |r x m| / |m|, after -(r m) / m^2. The loop has neither
    divisions nor branches, so that it runs on vector registers.
    """
    x = rows.columns[0]
    y = rows.columns[1]
    vx = rows.columns[2]
    vy = rows.columns[3]
    radii = rows.columns[4]
    px = position[0]
    py = position[1]
    wx, wy = velocity
    wide = 1.0 + FILTER_SLACK
    possible = rows.possible
    for k in range(len(possible)):
        rx = x[k] - px
        ry = y[k] - py
        mx = vx[k] - wx
        my = vy[k] - wy
        square = mx * mx + my * my
        toward = -(rx * mx + ry * my)
        across = rx * my - ry * mx
        touch = factor * (radii[k] + radius)
        near = across * across <= wide * touch * touch * square
        possible[k] = near & (toward > 0.0) & (toward <= wide * end * (square + DIVISOR_FLOOR))
    return list_candidates(rows)


@kernel
def may_enter_circle(circle: Array, own: float, rows: RobotRows) -> int:
    """Number of robots that may be on a traffic circle (4,), or on their way into it, at the same time; `candidates`.

    circle: centre x, y [m], radius [m], number of robots. own: distance of a robot from the centre [m]. The distances
    of robots that count differ from it by at most CIRCLE_ARC. The loop has neither divisions nor branches.
    """
    x = rows.columns[0]
    y = rows.columns[1]
    vx = rows.columns[2]
    vy = rows.columns[3]
    radii = rows.columns[4]
    px = circle[0]
    py = circle[1]
    wide = 1.0 + FILTER_SLACK
    possible = rows.possible
    for k in range(len(possible)):
        tx = px - x[k]
        ty = py - y[k]
        size = circle[2] + CIRCLE_ENTRY * radii[k]
        difference = CIRCLE_ARC * circle[2] + CIRCLE_ENTRY * radii[k]
        near = max(own - difference, 0.0)
        far = own + difference
        along = vx[k] * tx + vy[k] * ty
        across = vx[k] * ty - vy[k] * tx
        square_distance = tx * tx + ty * ty
        square_speed = vx[k] * vx[k] + vy[k] * vy[k] + DIVISOR_FLOOR * DIVISOR_FLOOR
        most = wide * size * size
        as_far = (near * near <= wide * square_distance) & (square_distance <= wide * far * far)
        enters = ((along > 0.0) & (across * across <= most * square_speed)) | (square_distance <= most)
        possible[k] = as_far & enters
    return list_candidates(rows)


@kernel
def list_candidates(rows: RobotRows) -> int:
    """Number of the robots that are possible; their numbers go into `candidates`, in ascending order."""
    count = 0
    for k in range(len(rows.possible)):
        if rows.possible[k]:
            rows.candidates[count] = k
            count += 1
    return count


ENCOUNTER_DISTANCE: Final = 1.3
"""[1] Two robots encounter each other if they would come nearer than this many times the sum of their radii. Larger:
robots form traffic circles that they do not need. Smaller: near misses slow robots down (docs/design/0008)."""

ENCOUNTER_SHARE: Final = 0.999
"""[1] Share of the path to the waypoint on which encounters count. At the waypoint itself a robot stops instead.
Larger: above 1 a robot circles around its own goal. Smaller: encounters near the waypoint are noticed later."""

SAME_DIRECTION_COSINE: Final = 0.7
"""[1] Robots whose directions have a larger cosine than this follow or overtake each other: no encounter. Larger:
converging robots form traffic circles. Smaller: crossing robots no longer do."""

CIRCLE_ROOM: Final = 1.2
"""[1] Radius of a traffic circle as a share of the radius on which its robots fit side by side (CIRCLE_SPACING).
Larger: a longer way around it. Smaller: robots block each other on it (docs/design/0008)."""

CIRCLE_SPACING: Final = 2.2
"""[1] Length of a traffic circle per robot, as a multiple of its radius: one diameter and a tenth. Larger: a longer way
around. Below 2: robots on the circle overlap."""

CIRCLE_OWN_RADIUS: Final = 0.5
"""[1] Share of a robot's own radius that is added to the radius of a traffic circle fitted to others. Larger: longer
ways. Smaller: a large robot cuts into the circle of small ones."""

CIRCLE_DRIFT: Final = 0.05
"""[1] Share of the way to the mean position of its robots by which the centre of a traffic circle moves in one step. It
holds while the number of robots does not grow. Larger: the centre follows each robot that joins, and robots leave too
early. Smaller: the centre stays at the first encounter, beside the later ones."""

CIRCLE_SPEED: Final = 0.1
"""[1] Share of its maximum speed above which a robot within a traffic circle is counted even if it moves outwards.
Larger: slow robots on the circle are not counted. Smaller: robots at rest within it are."""

CIRCLE_CENTRE: Final = 1e-6
"""[m] A robot nearer than this to the centre of a traffic circle has no tangent, and moves to its waypoint. Larger:
more robots lose their circle. Smaller: the direction of the tangent is rounding."""

CIRCLE_TOLERANCE: Final = 0.5
"""[m] Tolerance of targets on the tangent of a traffic circle. They move on at each step, so none is driven to. Larger:
a robot may count such a target as reached and slow down. Smaller: nothing changes."""

CIRCLE_PATIENCE: Final = 1.0
"""[s] A robot that has been blocked for longer leaves its traffic circle and moves to its waypoint. Larger: robots
block each other on circles for longer. Smaller: robots leave circles that would have worked."""

TANGENT_DISTANCE: Final = 2.0
"""[1] Least distance of a target on the tangent of a traffic circle, as a multiple of the radius of the circle. Larger:
no gain. Smaller: a robot near the circle brakes for its target."""

WAYPOINT_TOLERANCE: Final = 0.1
"""[1] A waypoint before the goal is reached within this share of the robot's radius. Larger: robots rest beside
waypoints that count as reached, without sight of the next one. Smaller: no gain."""


@kernel
def predicted_encounters(i: int, robots: GuidanceState, rows: RobotRows, found: Array) -> int:
    """Number of encounters of robot i, on its straight path at full speed, with robots at constant velocity.

    found (n, 4) gets a row for each, in the order of time: time [s], midpoint x, y [m], radius of the other [m].
    """
    px = robots.position[i, 0]
    py = robots.position[i, 1]
    dx = robots.waypoint[i, 0] - px
    dy = robots.waypoint[i, 1] - py
    distance = np.sqrt(dx * dx + dy * dy)
    speed = robots.max_speed[i]
    radius = robots.radius[i]
    if distance < radius:
        return 0
    dx = dx / distance
    dy = dy / distance
    count = 0
    end = ENCOUNTER_SHARE * distance / speed
    columns = rows.columns
    candidates = may_encounter(robots.position[i], (speed * dx, speed * dy), radius, end, ENCOUNTER_DISTANCE, rows)
    for j in range(candidates):
        k = rows.candidates[j]
        # Ignore robots that have arrived, even if they still drift.
        if k == i or robots.arrived[k]:
            continue
        rx = columns[0, k] - px
        ry = columns[1, k] - py
        vx = robots.velocity[k, 0]
        vy = robots.velocity[k, 1]
        mx = vx - speed * dx
        my = vy - speed * dy
        square = max(mx * mx + my * my, DIVISOR_FLOOR)
        time = -(rx * mx + ry * my) / square
        # A robot that crosses at the goal itself is not passed: the robot stops for it.
        if time <= 0.0 or time >= end:
            continue
        nx = rx + time * mx
        ny = ry + time * my
        touch = radius + robots.radius[k]
        if nx * nx + ny * ny >= squared(ENCOUNTER_DISTANCE * touch):
            continue
        # A robot in the same direction is followed or overtaken.
        if vx * dx + vy * dy > SAME_DIRECTION_COSINE * np.sqrt(vx * vx + vy * vy):
            continue
        found[count, 0] = time
        found[count, 1] = px + time * speed * dx + 0.5 * nx
        found[count, 2] = py + time * speed * dy + 0.5 * ny
        found[count, 3] = robots.radius[k]
        count += 1
    if count > 1:
        unsorted = found[:count].copy()
        order = np.argsort(unsorted[:, 0].copy())
        for j in range(count):
            copy_into(found[j], unsorted[order[j]])
    return count


@kernel
def circle_around(radius: float, found: Array, count: int, circle: Array) -> None:
    """Write into circle (4,) the traffic circle of the first encounter and of those near it.

    radius: of the robot [m]; found: `count` rows of `predicted_encounters`; circle: see `GuidanceState`.
    """
    x = found[0, 1]
    y = found[0, 2]
    radii = found[0, 3]
    n = 1
    size = max(radius + found[0, 3], CIRCLE_SPACING * (radius + radii) / (2.0 * np.pi))
    for k in range(1, count):
        near = CIRCLE_ROOM * size + radius + found[k, 3]
        if squared(found[k, 1] - x) + squared(found[k, 2] - y) > near * near:
            continue
        n += 1
        x = x + (found[k, 1] - x) / n
        y = y + (found[k, 2] - y) / n
        radii = radii + found[k, 3]
        size = max(size, CIRCLE_SPACING * (radius + radii) / (2.0 * np.pi))
    circle[0] = x
    circle[1] = y
    circle[2] = CIRCLE_ROOM * size
    circle[3] = n


@kernel
def tangent_target(i: int, robots: GuidanceState, circle: Array, target: Array) -> bool:
    """Whether circle (4,) lies between robot i and its waypoint; then a point on the tangent to the right of it.

    The point goes into target (3,) [m]: x, y. A robot within the circle gets a point that leads out of it.
    """
    px = robots.position[i, 0]
    py = robots.position[i, 1]
    gx = robots.waypoint[i, 0]
    gy = robots.waypoint[i, 1]
    x = circle[0]
    y = circle[1]
    radius = circle[2]
    dx = gx - px
    dy = gy - py
    length = max(np.sqrt(dx * dx + dy * dy), DIVISOR_FLOOR)
    tx = x - px
    ty = y - py
    along, across = along_and_across(tx, ty, dx, dy)
    along = along / length
    across = across / length
    distance = np.sqrt(tx * tx + ty * ty)
    if along <= 0.0 or abs(across) >= radius or distance < CIRCLE_CENTRE:
        return False
    if squared(gx - x) + squared(gy - y) <= radius * radius:
        return False
    angle = -np.arcsin(radius / distance) if distance > radius else -np.pi + np.arcsin(distance / radius)
    c = np.cos(angle)
    s = np.sin(angle)
    scale = max(distance, TANGENT_DISTANCE * radius) / distance
    target[0] = px + scale * (c * tx - s * ty)
    target[1] = py + scale * (s * tx + c * ty)
    return True


@kernel
def fit_circle(i: int, robots: GuidanceState, rows: RobotRows, circle: Array) -> int:
    """Number of robots on the traffic circle (4,) of robot i or on their way into it; the circle is fitted to them.

    Robots that are much nearer to its centre than robot i, or much farther away, are there at another time.
    """
    count = 0
    x = 0.0
    y = 0.0
    radii = robots.radius[i]
    largest = 0.0
    columns = rows.columns
    own = np.sqrt(squared(circle[0] - robots.position[i, 0]) + squared(circle[1] - robots.position[i, 1]))
    apart = CIRCLE_ARC * circle[2]
    for j in range(may_enter_circle(circle, own, rows)):
        k = rows.candidates[j]
        # Robots that have arrived are gone around by waypoints.
        if k == i or robots.arrived[k]:
            continue
        tx = circle[0] - columns[0, k]
        ty = circle[1] - columns[1, k]
        if abs(np.sqrt(tx * tx + ty * ty) - own) > apart + CIRCLE_ENTRY * robots.radius[k]:
            continue
        vx = columns[2, k]
        vy = columns[3, k]
        speed = max(columns[5, k], DIVISOR_FLOOR)
        along, across = along_and_across(tx, ty, vx, vy)
        along = along / speed
        across = abs(across) / speed
        size = circle[2] + CIRCLE_ENTRY * robots.radius[k]
        if along > 0.0 and across < size:
            count += 1
            x += columns[0, k] + along * vx / speed
            y += columns[1, k] + along * vy / speed
        elif np.sqrt(tx * tx + ty * ty) < size and speed > CIRCLE_SPEED * robots.max_speed[k]:
            count += 1
            x += columns[0, k]
            y += columns[1, k]
        else:
            continue
        radii += robots.radius[k]
        largest = max(largest, robots.radius[k])
    if count >= circle[3]:
        gain = 1.0 if count > circle[3] else CIRCLE_DRIFT
        circle[0] += gain * (x / count - circle[0])
        circle[1] += gain * (y / count - circle[1])
        least = CIRCLE_ROOM * (robots.radius[i] + largest)
        side_by_side = CIRCLE_ROOM * CIRCLE_SPACING * radii / (2.0 * np.pi)
        circle[2] = max(least, side_by_side + CIRCLE_OWN_RADIUS * robots.radius[i])
        circle[3] = count
    return count


@vectorized
def update_targets(order: Indices, robots: GuidanceState) -> None:
    """Set target, tolerance, stop and circle of the robots `order`: the waypoint, or a point beside their circle."""
    found = np.empty((len(robots.radius), 4))
    fresh = np.zeros(4)
    rows = robot_rows(robots.position, robots.velocity, robots.radius, robots.present)
    for i in order:
        last = robots.waypoint[i, 0] == robots.goal[i, 0] and robots.waypoint[i, 1] == robots.goal[i, 1]
        copy_into(robots.target[i], robots.waypoint[i])
        robots.stop[i] = robots.goal_stop[i] and last
        # Near a waypoint the line to the next one may still be blocked.
        robots.tolerance[i] = robots.goal_tolerance[i] if last else WAYPOINT_TOLERANCE * robots.radius[i]
        circle = robots.circle[i]
        if robots.waiting_time[i] >= CIRCLE_PATIENCE:
            # The robot is blocked on its circle.
            circle[:] = 0.0
            continue
        count = predicted_encounters(i, robots, rows, found)
        if count > 0:
            circle_around(robots.radius[i], found, count, fresh)
            x = fresh[0] - robots.position[i, 0]
            y = fresh[1] - robots.position[i, 1]
            # A robot within a new circle cannot pass it any more.
            if fresh[3] > circle[3] and (circle[2] > 0.0 or x * x + y * y > fresh[2] * fresh[2]):
                copy_into(circle, fresh)
        if circle[2] > 0.0:
            if fit_circle(i, robots, rows, circle) > 0 and tangent_target(i, robots, circle, robots.target[i]):
                robots.tolerance[i] = CIRCLE_TOLERANCE
                robots.stop[i] = False
            else:
                copy_into(robots.target[i], robots.waypoint[i])
                circle[:] = 0.0


@kernel
def update_waypoints(robots: GuidanceState, grid: Grid, margin: float, parked: Indices, due: Indices) -> None:
    """Set the waypoint of each robot in `due`, on the shortest path around walls and the robots in `parked`.

    No robot is in both. margin: kept between bodies [m]. Robots of one radius that follow each other take least time.
    """
    cost = np.empty((0, 0))
    costs_radius = np.nan
    search = PathSearch(np.empty(0), np.empty(0, np.int64), np.empty(0, np.int64))
    for i in due:
        radius = robots.radius[i] + margin
        copy_into(robots.waypoint[i], robots.goal[i])
        if goal_in_sight(grid, radius, robots.position, robots.radius, parked, i, robots.goal[i]):
            continue
        if radius != costs_radius:
            cost = cell_costs(grid, radius, robots.position, robots.radius, parked)
            costs_radius = radius
            search = new_path_search(cost)
        farthest_in_sight(grid, cost, robots.position[i], robots.goal[i], search, robots.waypoint[i])
