"""The rule of the road for robots that will meet: see `detour`."""

from typing import NamedTuple

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices, Singles, Words
from slalom.kernels.geometry.cubic import copy_into
from slalom.kernels.guidance.early_rejection import (
    listed,
    may_encounter,
    may_enter_circle,
    room_for,
    structure_of_arrays,
    to_single_precision,
)
from slalom.kernels.guidance.grid_astar import cell_costs, goal_in_sight, next_waypoint, wall_costs
from slalom.kernels.guidance.periodic_images import apart
from slalom.kernels.guidance.tables import GuidanceState
from slalom.kernels.jit import kernel

CLOSE = 1.3
"""[1] Robots meet if they would come nearer to each other than this many times the sum of their radii."""
ROOM = 1.2
"""[1] How long a ring is, as a share of 1.1 times the length of its robots side by side.

Longer: a longer way around it. Shorter: robots get in each other's way on it (docs/design/0008).
"""
DRIFT = 0.05
"""[1] The middle of a ring moves by this share of the way, at each step at which no more robots are on it than before.

Larger: it follows who happens to be counted, and robots leave the ring too early. Smaller: it stays where it was seen
first, beside where they meet.
"""
CORNER = 0.1
"""[1] A corner of a way is reached within this share of the robot's radius.

Larger: robots that need not stop there rest beside corners that they take for reached. Smaller: nothing is gained.
"""
SOON = 8.0
"""[s] Where the world repeats, who comes towards a robot and is met within this time is passed on the right."""
FRONTAL = 0.8
"""[1] The cosine of the angle from which they seem to come, at least. Smaller: also those that cross are passed."""
PATIENCE = 1.0
"""[s] Who has waited for longer gives up going around."""


class RobotRows(NamedTuple):
    """All robots as the sieve needs them, and room for its answers: see `sieve`."""

    all_of: Array  # (6, n)
    coarse: Singles  # (5, m)
    origin: Array  # (3,) of the coarse places
    off: tuple[float, float]
    maybe: Flags  # (m,)
    words: Words
    which: Indices  # (n,)


@kernel
def robot_rows(guide: GuidanceState) -> RobotRows:
    """All robots, those that are not present as nobody who could be met."""
    all_of = structure_of_arrays(guide.position, guide.velocity, guide.radius, guide.present)
    coarse, maybe, words, which = room_for(len(guide.radius))
    origin = guide.position[0]
    return RobotRows(
        all_of, coarse, origin, to_single_precision(all_of, origin[0], origin[1], coarse), maybe, words, which
    )


@kernel
def nearest_image_rows(i: int, guide: GuidanceState, others: RobotRows) -> RobotRows:
    """All robots at those of their images that are nearest to robot i."""
    all_of, origin = others.all_of, guide.position[i]
    for k in range(len(guide.radius)):
        x, y = apart(i, k, guide)
        all_of[0, k], all_of[1, k] = origin[0] + x, origin[1] + y
    off = to_single_precision(all_of, origin[0], origin[1], others.coarse)
    return RobotRows(all_of, others.coarse, origin, off, others.maybe, others.words, others.which)


@kernel
def predicted_encounters(i: int, frontal: float, guide: GuidanceState, others: RobotRows, found: Array) -> int:
    """When and where robot i, straight to its goal at top speed, meets others at their present velocities.

    Rows (when, x, y, radius of the other) in the order of time into found; their number. Only those that it sees
    come from ahead, the cosine of the angle at least `frontal`.
    """
    px, py = guide.position[i, 0], guide.position[i, 1]
    dx, dy = guide.waypoint[i, 0] - px, guide.waypoint[i, 1] - py
    distance, speed, reach = np.sqrt(dx * dx + dy * dy), guide.max_speed[i], guide.radius[i]
    if distance < reach:
        return 0
    dx, dy = dx / distance, dy / distance
    count, end, all_of, at = 0, 0.999 * distance / speed, others.all_of, others.origin
    vx, vy = speed * dx, speed * dy
    may_encounter(px - at[0], py - at[1], vx, vy, reach, end, CLOSE, others.coarse, others.off, others.maybe)
    for j in range(listed(others.maybe, others.words, others.which)):
        k = others.which[j]
        # Who has arrived is no meeting, however it moves about its place.
        if k == i or guide.arrived[k]:
            continue
        rx, ry = all_of[0, k] - px, all_of[1, k] - py
        vx, vy = guide.velocity[k, 0], guide.velocity[k, 1]
        mx, my = vx - speed * dx, vy - speed * dy
        square = max(mx * mx + my * my, 1e-9)
        when = -(rx * mx + ry * my) / square
        # Who comes by at the goal itself is waited for, not gone around.
        if when <= 0.0 or when >= end:
            continue
        nx, ny = rx + when * mx, ry + when * my
        touch = reach + guide.radius[k]
        if nx * nx + ny * ny >= (CLOSE * touch) ** 2:
            continue
        # Who goes the same way is followed or passed, not gone around.
        if vx * dx + vy * dy > 0.7 * np.sqrt(vx * vx + vy * vy) or -(mx * dx + my * dy) < frontal * np.sqrt(square):
            continue
        found[count, 0] = when
        found[count, 1] = px + when * speed * dx + 0.5 * nx
        found[count, 2] = py + when * speed * dy + 0.5 * ny
        found[count, 3] = guide.radius[k]
        count += 1
    if count > 1:
        rows = found[:count].copy()
        order = np.argsort(rows[:, 0].copy())
        for j in range(count):
            copy_into(found[j], rows[order[j]])
    return count


@kernel
def circle_around(radius: float, found: Array, count: int, ring: Array) -> None:
    """The ring around the first meeting and all that are near it, into `ring`."""
    x, y, reaches, n = found[0, 1], found[0, 2], found[0, 3], 1
    size = max(radius + found[0, 3], 2.2 * (radius + reaches) / (2.0 * np.pi))
    for k in range(1, count):
        if (found[k, 1] - x) ** 2 + (found[k, 2] - y) ** 2 > (ROOM * size + radius + found[k, 3]) ** 2:
            continue
        n += 1
        x, y, reaches = x + (found[k, 1] - x) / n, y + (found[k, 2] - y) / n, reaches + found[k, 3]
        size = max(size, 2.2 * (radius + reaches) / (2.0 * np.pi))
    ring[0], ring[1], ring[2], ring[3] = x, y, ROOM * size, n


@kernel
def tangent_target(i: int, guide: GuidanceState, ring: Array, place: Array) -> bool:
    """Whether the ring lies between robot i and its goal; then a place on the tangent to its right, into `place`."""
    px, py, gx, gy = guide.position[i, 0], guide.position[i, 1], guide.waypoint[i, 0], guide.waypoint[i, 1]
    x, y, size = ring[0], ring[1], ring[2]
    dx, dy = gx - px, gy - py
    distance = max(np.sqrt(dx * dx + dy * dy), 1e-9)
    tx, ty = x - px, y - py
    along, across = (tx * dx + ty * dy) / distance, (dx * ty - dy * tx) / distance
    far = np.sqrt(tx * tx + ty * ty)
    if along <= 0.0 or abs(across) >= size or far < 1e-6:
        return False
    if (gx - x) ** 2 + (gy - y) ** 2 <= size * size:
        return False
    angle = -np.arcsin(size / far) if far > size else -np.pi + np.arcsin(far / size)
    c, s = np.cos(angle), np.sin(angle)
    scale = max(far, 2.0 * size) / far
    place[0] = px + scale * (c * tx - s * ty)
    place[1] = py + scale * (s * tx + c * ty)
    return True


@kernel
def fit_circle(i: int, guide: GuidanceState, others: RobotRows, ring: Array) -> int:
    """Fit the ring to robot i and the robots that are on it or on their way into it: middle, radius, number."""
    count, x, y, reaches = 0, 0.0, 0.0, guide.radius[i]
    largest, all_of, at = 0.0, others.all_of, others.origin
    may_enter_circle(ring, at[0], at[1], others.coarse, others.off[0], others.maybe)
    for j in range(listed(others.maybe, others.words, others.which)):
        k = others.which[j]
        if k == i:
            continue
        tx, ty = ring[0] - all_of[0, k], ring[1] - all_of[1, k]
        vx, vy, speed = all_of[2, k], all_of[3, k], max(all_of[5, k], 1e-9)
        along, across = (tx * vx + ty * vy) / speed, abs(vx * ty - vy * tx) / speed
        size = ring[2] + 2.0 * guide.radius[k]
        if along > 0.0 and across < size:
            count += 1
            x += all_of[0, k] + along * vx / speed
            y += all_of[1, k] + along * vy / speed
        elif np.sqrt(tx * tx + ty * ty) < size and speed > 0.1 * guide.max_speed[k]:
            count += 1
            x += all_of[0, k]
            y += all_of[1, k]
        else:
            continue
        reaches += guide.radius[k]
        largest = max(largest, guide.radius[k])
    if count >= ring[3]:
        gain = 1.0 if count > ring[3] else DRIFT
        ring[0] += gain * (x / count - ring[0])
        ring[1] += gain * (y / count - ring[1])
        ring[2] = max(1.2 * (guide.radius[i] + largest), ROOM * 2.2 * reaches / (2.0 * np.pi) + 0.5 * guide.radius[i])
        ring[3] = count
    return count


@kernel
def update_targets(order: Indices, guide: GuidanceState) -> None:
    """Where robots `order` head for: the next place on their way, or one beside the meetings that they are in for."""
    found, fresh = np.empty((len(guide.radius), 4)), np.zeros(4)
    others = robot_rows(guide)
    for i in order:
        last = guide.waypoint[i, 0] == guide.goal[i, 0] and guide.waypoint[i, 1] == guide.goal[i, 1]
        copy_into(guide.target[i], guide.waypoint[i])
        guide.stop[i] = guide.goal_stop[i] and last
        # A corner is driven to, not only seen near: there it goes on to the next one.
        guide.tolerance[i] = guide.goal_tolerance[i] if last else CORNER * guide.radius[i]
        ring = guide.circle[i]
        if guide.waiting_time[i] >= PATIENCE:
            # Going around has led nowhere.
            ring[:] = 0.0
            continue
        count = predicted_encounters(i, -1.0, guide, others, found)
        if count > 0:
            circle_around(guide.radius[i], found, count, fresh)
            x, y = fresh[0] - guide.position[i, 0], fresh[1] - guide.position[i, 1]
            # Who is inside is too late to go around.
            if fresh[3] > ring[3] and (ring[2] > 0.0 or x * x + y * y > fresh[2] * fresh[2]):
                copy_into(ring, fresh)
        if ring[2] > 0.0:
            if fit_circle(i, guide, others, ring) > 0 and tangent_target(i, guide, ring, guide.target[i]):
                guide.tolerance[i], guide.stop[i] = 0.5, False
            else:
                copy_into(guide.target[i], guide.waypoint[i])
                ring[:] = 0.0


@kernel
def keep_right(guide: GuidanceState) -> None:
    """Where the world repeats there are always more to come: all pass those that come towards them on the right."""
    n = len(guide.radius)
    found, ring, others = np.empty((n, 4)), np.zeros(4), robot_rows(guide)
    for i in range(n):
        copy_into(guide.target[i], guide.goal[i])
        others = nearest_image_rows(i, guide, others)
        if predicted_encounters(i, FRONTAL, guide, others, found) > 0 and found[0, 0] < SOON:
            circle_around(guide.radius[i], found, 1, ring)
            tangent_target(i, guide, ring, guide.target[i])


@kernel
def update_waypoints(
    guide: GuidanceState, grid: Array, clearance: Array, margin: float, parked: Indices, due: Indices
) -> None:
    """The next place on the way of each robot in `due`."""
    walls, of = np.empty((0, 0)), np.nan
    for i in due:
        reach = guide.radius[i] + margin
        if goal_in_sight(grid, clearance, reach, guide.position, guide.radius, parked, i, guide.goal[i]):
            copy_into(guide.waypoint[i], guide.goal[i])
            continue
        if reach != of:
            # One for all robots of a size.
            walls, of = wall_costs(grid, clearance, reach), reach
        cost = cell_costs(grid, walls, reach, guide.position, guide.radius, parked, i)
        copy_into(guide.waypoint[i], guide.goal[i])
        next_waypoint(
            grid,
            cost,
            guide.position[i, 0],
            guide.position[i, 1],
            guide.goal[i, 0],
            guide.goal[i, 1],
            guide.waypoint[i],
        )
