"""Giving way: robots that wait in vain ask those in their way, the one that has waited longest first.

Who is asked heads for a free place beside the way; if there is none, it asks whoever stands in its own way in turn
(priority inheritance, as in Okumura, Machida, Defago and Tamura, "Priority inheritance with backtracking for iterative
multi-agent path finding", Artificial Intelligence 310, 2022, here without its graph). It is a wish like any other: the
choice that follows keeps clear of everything.
"""

import numpy as np

from slalom.kernels.arrays import Array, Flags
from slalom.kernels.guidance.periodic_images import apart, is_free
from slalom.kernels.guidance.tables import GuidanceState
from slalom.kernels.jit import kernel

DIRECTIONS = 16
"""Ways aside that are looked at."""
REQUEST_AFTER, YIELD_DURATION = 1.5, 2.0
"""[s] after which a robot that stands in vain asks; for which who is asked heads aside, at least."""
REQUEST_BESIDE_AFTER = 10.0
"""[s] after which a robot also asks those beside it: an arch before a door has nobody ahead of those who carry it."""
YIELD_RANGE = 2.5
"""[1] and for as long as the one that asked is nearer than this many times the sum of their radii."""


@kernel
def free_distance(
    k: int, dx: float, dy: float, far: float, guide: GuidanceState, grid: Array, clearance: Array, margin: float
) -> tuple[float, int]:
    """How far robot k could go along (dx, dy), up to `far`, before it meets a robot as it stands, or a wall; whom."""
    px, py, free, who = guide.position[k, 0], guide.position[k, 1], far, -1
    for m in range(len(guide.present)):
        if m == k or not guide.present[m]:
            continue
        rx, ry = apart(k, m, guide)
        along, across = rx * dx + ry * dy, abs(dx * ry - dy * rx)
        touch = guide.radius[k] + guide.radius[m] + margin
        if along <= 0.0 or across >= touch:
            continue
        run = max(0.0, along - np.sqrt(touch * touch - across * across))
        if run < free:
            free, who = run, m
    step = 0.5 * grid[2]
    reach = guide.radius[k] + margin
    t = step
    while t <= free:
        if not is_free(px + t * dx, py + t * dy, reach, guide, grid, clearance):
            return t - step, -1
        t += step
    return free, who


@kernel
def request_space(
    i: int,
    ex: float,
    ey: float,
    asked: Flags,
    guide: GuidanceState,
    grid: Array,
    clearance: Array,
    margin: float,
    until: float,
) -> None:
    """Robot i, which wants to go along (ex, ey), asks who stands there; these ask on."""
    stack = [(i, ex, ey)]
    ahead = -0.5 if guide.waiting_time[i] >= REQUEST_BESIDE_AFTER else 0.1
    while len(stack) > 0:
        j, fx, fy = stack.pop()
        for k in range(len(guide.present)):
            if asked[k] or not guide.present[k]:
                continue
            rx, ry = apart(j, k, guide)
            touch = guide.radius[j] + guide.radius[k]
            along, across = rx * fx + ry * fy, fx * ry - fy * rx
            if along <= ahead * touch or rx * rx + ry * ry > (1.5 * touch) ** 2 or abs(across) >= touch + margin:
                continue
            if np.sqrt(guide.velocity[k, 0] ** 2 + guide.velocity[k, 1] ** 2) > 0.3 * guide.max_speed[k]:
                continue
            asked[k] = True
            far = 2.5 * touch
            best, bx, by, block = -np.inf, fx, fy, -1
            for n in range(DIRECTIONS):
                angle = 2.0 * np.pi * n / DIRECTIONS
                dx, dy = np.cos(angle), np.sin(angle)
                dx, dy = dx * fx - dy * fy, dx * fy + dy * fx
                run, who = free_distance(k, dx, dy, far, guide, grid, clearance, margin)
                # How far aside of the way it gets; not towards the one that asks.
                sideways = dx * -fy + dy * fx
                if dx * fx + dy * fy < -0.3:
                    continue
                aside = abs(across + run * sideways)
                score = min(aside, 1.2 * touch) + 0.3 * run
                if run < 0.5 * touch:
                    # Who stands there may be asked in turn, a wall may not.
                    score += 0.2 * touch if who >= 0 and not asked[who] else -touch
                if score > best:
                    best, bx, by, block = score, dx, dy, who
            run, _ = free_distance(k, bx, by, far, guide, grid, clearance, margin)
            guide.yielding[k, 0], guide.yielding[k, 1] = (
                guide.position[k, 0] + far * bx,
                guide.position[k, 1] + far * by,
            )
            guide.yielding[k, 2], guide.yielding[k, 3] = until, i
            if run < 0.5 * touch and block >= 0 and not asked[block]:
                stack.append((k, bx, by))
        ahead = 0.1


@kernel
def give_way(guide: GuidanceState, grid: Array, clearance: Array, margin: float, now: float, period: float) -> None:
    """Who waits in vain asks; who was asked heads aside for a while."""
    n = len(guide.radius)
    asked = np.zeros(n, np.bool_)
    for i in range(n):
        speed = np.sqrt(guide.velocity[i, 0] ** 2 + guide.velocity[i, 1] ** 2)
        wants = np.sqrt((guide.goal[i, 0] - guide.position[i, 0]) ** 2 + (guide.goal[i, 1] - guide.position[i, 1]) ** 2)
        if wants <= guide.goal_tolerance[i] or not guide.present[i]:
            guide.waiting_time[i] = 0.0
        elif speed < 0.15 * guide.max_speed[i]:
            guide.waiting_time[i] += period
        else:
            guide.waiting_time[i] = max(0.0, guide.waiting_time[i] - 2.0 * period)
        k = int(guide.yielding[i, 3])
        touch = guide.radius[i] + guide.radius[k]
        x, y = apart(k, i, guide)
        square = x**2 + y**2
        if guide.yielding[i, 2] > now and not guide.arrived[k] and square < (YIELD_RANGE * touch) ** 2:
            # Who asked is still near: back to one's own way only behind it.
            guide.yielding[i, 2] = max(guide.yielding[i, 2], now + 0.5)
    # Robots that have been at their goals and were asked away wait behind those that have not.
    patience = guide.waiting_time.copy()
    for i in range(n):
        if not guide.visited[i] and patience[i] >= REQUEST_AFTER:
            patience[i] += 1e6
    order = np.argsort(patience)
    for j in range(n - 1, -1, -1):
        i = order[j]
        if guide.waiting_time[i] < REQUEST_AFTER:
            break
        if asked[i]:
            continue
        asked[i] = True
        # The right of way: it heads on although it was asked before.
        guide.yielding[i, 2] = now
        ex, ey = guide.waypoint[i, 0] - guide.position[i, 0], guide.waypoint[i, 1] - guide.position[i, 1]
        far = max(np.sqrt(ex * ex + ey * ey), 1e-9)
        request_space(i, ex / far, ey / far, asked, guide, grid, clearance, margin, now + YIELD_DURATION)
    for k in range(n):
        if guide.yielding[k, 2] > now:
            guide.target[k, 0], guide.target[k, 1] = guide.yielding[k, 0], guide.yielding[k, 1]
            guide.tolerance[k], guide.stop[k] = 0.1, True
