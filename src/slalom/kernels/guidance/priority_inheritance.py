"""Priority inheritance: blocked robots send requests; robots that receive one move aside temporarily.

The robot that has been blocked for longest has the highest priority. A robot that receives its request and cannot
move aside sends a request with the same priority. The rule follows Okumura, Machida, Defago and Tamura, "Priority
inheritance with backtracking for iterative multi-agent path finding", Artificial Intelligence 310, 2022, without the
graph. It sets targets only: the decision keeps clear of everything.
"""

from typing import Final

import numpy as np

from slalom.base.tolerances import DIVISOR_FLOOR
from slalom.kernels.arrays import Flags
from slalom.kernels.guidance.grid import along_and_across, is_free, offset
from slalom.kernels.guidance.tables import Grid, GuidanceState
from slalom.kernels.jit import kernel, squared

REQUEST_AFTER: Final = 1.5
"""[s] A robot that has been blocked for this long sends a request to the robots ahead of it. Larger: blocked robots
lose time. Smaller: requests that a short stop would make unnecessary."""

REQUEST_BESIDE_AFTER: Final = 10.0
"""[s] A robot that has been blocked for this long also sends requests to robots beside it. It resolves arches of robots
before a door, in which none is ahead of another. Larger: arches last longer. Smaller: robots beside the path move aside
for nothing."""

REQUEST_AHEAD: Final = 0.1
"""[1] Robots ahead by more than this share of the sum of radii get a request. Larger: robots that block by their edge
get none. Smaller: robots beside the path get one."""

REQUEST_BESIDE: Final = 0.5
"""[1] After REQUEST_BESIDE_AFTER, robots behind by less than this share of the sum of radii get a request too. Larger:
robots behind move for nothing. Smaller: arches before a door may last."""

REQUEST_RANGE: Final = 1.5
"""[1] Robots within this many times the sum of radii get a request. Larger: robots that do not block move aside.
Smaller: those that block at some distance do not."""

REQUEST_SPEED: Final = 0.3
"""[1] Robots faster than this share of their maximum speed get no request: they leave without a request. Larger: moving
robots are diverted. Smaller: robots that drift are left in the way."""

YIELD_DIRECTIONS: Final = 16
"""[1] Directions that are compared for moving aside. More: slower. Fewer: gaps between robots are missed."""

YIELD_DURATION: Final = 2.0
"""[s] Time for which a robot moves aside after a request, at least. Larger: it comes back late. Smaller: it comes back
before the blocked robot has moved."""

YIELD_EXTENSION: Final = 0.5
"""[s] Least remaining time of moving aside while the robot that sent the request is within YIELD_DISTANCE. Larger:
robots come back later. Smaller than a decision period: they come back in between."""

YIELD_DISTANCE: Final = 2.5
"""[1] Distance of the point that a robot yields to, and of the space tested for it, in sums of radii. It stays aside
while the sender of the request is nearer. Larger: robots move farther than needed. Smaller: they stay in the way."""

YIELD_SAMPLE: Final = 0.5
"""[cell] Distance of the samples at which the space beside a path is tested for walls. Larger: thin walls are missed.
Smaller: slower."""

YIELD_BACKWARD_COSINE: Final = 0.3
"""[1] Robots do not move aside in directions whose cosine with the opposite of the request exceeds this. Larger: they
approach the robot that they yield to. Smaller: fewer ways aside are found."""

YIELD_ASIDE: Final = 1.2
"""[1] Distance from the path, in sums of radii, beyond which moving farther aside scores no more. Larger: robots move
farther than needed. Below 1: they may stay in the path."""

YIELD_DISTANCE_WEIGHT: Final = 0.3
"""[1] Score of a metre of free space in a direction, relative to a metre off the path. Larger: robots move along the
path. Smaller: they move into narrow niches beside it."""

YIELD_BLOCKED: Final = 0.5
"""[1] A direction with less free space than this share of the sum of radii counts as blocked. Larger: more robots
inherit the request. Smaller: robots move into gaps that are too small."""

YIELD_INHERITANCE: Final = 0.2
"""[1] Score, in sums of radii, of a blocked direction whose blocker can inherit the request. Larger: more robots are
moved. Smaller: robots move into narrow gaps instead."""

YIELD_WALL_PENALTY: Final = 1.0
"""[1] Penalty, in sums of radii, of a direction that is blocked by a wall or by a robot with a request. Larger: such
directions are taken less often. Smaller: robots may try to yield into a wall."""

YIELD_TOLERANCE: Final = 0.1
"""[m] Tolerance of the point that a robot yields to. Larger: it may stay in the path. Smaller: it moves on for
longer."""

BLOCKED_SPEED: Final = 0.15
"""[1] A robot slower than this share of its maximum speed, and not at its goal, counts as blocked. Larger: slow robots
send requests. Smaller: robots that creep in a jam send none."""

BLOCKED_RECOVERY: Final = 2.0
"""[1] A moving robot loses its waiting time so many times faster than it gained it. Larger: a robot in stop and go
never sends requests. Smaller: it sends requests long after it has moved on."""

FIRST_VISIT_PRIORITY: Final = 1e6
"""[s] Added to the waiting time of robots that have never arrived: they go before those that yielded their goals. More
than any duration. Smaller: a robot that has yielded may come back before the other one has passed."""


@kernel
def free_distance(
    k: int, dx: float, dy: float, most: float, robots: GuidanceState, grid: Grid, margin: float
) -> tuple[float, int]:
    """Distance [m], at most `most`, that robot k can move along the unit vector (dx, dy) among robots as they are.

    Also the number of the robot that blocks it; -1: a wall, or no robot.
    """
    px = robots.position[k, 0]
    py = robots.position[k, 1]
    free = most
    blocker = -1
    for m in range(len(robots.present)):
        if m == k or not robots.present[m]:
            continue
        rx, ry = offset(k, m, robots)
        along, across = along_and_across(rx, ry, dx, dy)
        touch = robots.radius[k] + robots.radius[m] + margin
        if along <= 0.0 or abs(across) >= touch:
            continue
        run = max(0.0, along - np.sqrt(touch * touch - across * across))
        if run < free:
            free = run
            blocker = m
    step = YIELD_SAMPLE * grid.width
    radius = robots.radius[k] + margin
    t = step
    while t <= free:
        if not is_free(px + t * dx, py + t * dy, radius, grid):
            return t - step, -1
        t += step
    return free, blocker


@kernel
def yielding_direction(
    k: int,
    blocked: tuple[float, float, float],
    touch: float,
    requested: Flags,
    robots: GuidanceState,
    grid: Grid,
    margin: float,
) -> tuple[float, float, float, int]:
    """Direction (x, y) in which robot k best moves off the path of a blocked robot; free distance [m] and blocker.

    blocked: direction x, y of the blocked robot and how far [m] robot k is to the left of its path. touch: sum of
    their radii [m]. requested (n,): robots that have received a request. The blocker is -1 for a wall or none.
    """
    fx, fy, across = blocked
    most = YIELD_DISTANCE * touch
    best_score = -np.inf
    best = (fx, fy)
    best_run = 0.0
    best_blocker = -1
    for n in range(YIELD_DIRECTIONS):
        angle = 2.0 * np.pi * n / YIELD_DIRECTIONS
        c = np.cos(angle)
        s = np.sin(angle)
        dx = c * fx - s * fy
        dy = c * fy + s * fx
        along, sideways = along_and_across(dx, dy, fx, fy)
        if along < -YIELD_BACKWARD_COSINE:
            continue
        run, blocker = free_distance(k, dx, dy, most, robots, grid, margin)
        aside = abs(across + run * sideways)
        score = min(aside, YIELD_ASIDE * touch) + YIELD_DISTANCE_WEIGHT * run
        if run < YIELD_BLOCKED * touch:
            # A robot in that direction can receive a request in turn; a wall cannot.
            inherits = blocker >= 0 and not requested[blocker]
            score += YIELD_INHERITANCE * touch if inherits else -YIELD_WALL_PENALTY * touch
        if score > best_score:
            best_score = score
            best = (dx, dy)
            best_run = run
            best_blocker = blocker
    return best[0], best[1], best_run, best_blocker


@kernel
def request_space(
    i: int, ex: float, ey: float, requested: Flags, robots: GuidanceState, grid: Grid, margin: float, until: float
) -> None:
    """Send requests of robot i along its direction, the unit vector (ex, ey), and those that inherit its priority.

    Robots that receive a request get a point to yield to, until the time `until` [s]; requested (n,) marks them.
    """
    stack = [(i, ex, ey)]
    ahead = -REQUEST_BESIDE if robots.waiting_time[i] >= REQUEST_BESIDE_AFTER else REQUEST_AHEAD
    while len(stack) > 0:
        j, fx, fy = stack.pop()
        for k in range(len(robots.present)):
            if requested[k] or not robots.present[k]:
                continue
            rx, ry = offset(j, k, robots)
            touch = robots.radius[j] + robots.radius[k]
            along, across = along_and_across(rx, ry, fx, fy)
            if along <= ahead * touch or abs(across) >= touch + margin:
                continue
            if rx * rx + ry * ry > squared(REQUEST_RANGE * touch):
                continue
            speed = np.sqrt(squared(robots.velocity[k, 0]) + squared(robots.velocity[k, 1]))
            if speed > REQUEST_SPEED * robots.max_speed[k]:
                continue
            requested[k] = True
            dx, dy, run, blocker = yielding_direction(k, (fx, fy, across), touch, requested, robots, grid, margin)
            most = YIELD_DISTANCE * touch
            robots.yielding[k, 0] = robots.position[k, 0] + most * dx
            robots.yielding[k, 1] = robots.position[k, 1] + most * dy
            robots.yielding[k, 2] = until
            robots.yielding[k, 3] = i
            if run < YIELD_BLOCKED * touch and blocker >= 0 and not requested[blocker]:
                stack.append((k, dx, dy))
        ahead = REQUEST_AHEAD


@kernel
def update_waiting(robots: GuidanceState, now: float, period: float) -> None:
    """Update the waiting times after one period [s], and extend the yielding of robots that are still in the way."""
    for i in range(len(robots.radius)):
        speed = np.sqrt(squared(robots.velocity[i, 0]) + squared(robots.velocity[i, 1]))
        x = robots.goal[i, 0] - robots.position[i, 0]
        y = robots.goal[i, 1] - robots.position[i, 1]
        if np.sqrt(x * x + y * y) <= robots.goal_tolerance[i] or not robots.present[i]:
            robots.waiting_time[i] = 0.0
        elif speed < BLOCKED_SPEED * robots.max_speed[i]:
            robots.waiting_time[i] += period
        else:
            robots.waiting_time[i] = max(0.0, robots.waiting_time[i] - BLOCKED_RECOVERY * period)
        k = int(robots.yielding[i, 3])
        near = YIELD_DISTANCE * (robots.radius[i] + robots.radius[k])
        x, y = offset(k, i, robots)
        if robots.yielding[i, 2] > now and not robots.arrived[k] and x * x + y * y < near * near:
            # The robot that sent the request has not yet passed.
            robots.yielding[i, 2] = max(robots.yielding[i, 2], now + YIELD_EXTENSION)


@kernel
def give_way(robots: GuidanceState, grid: Grid, margin: float, now: float, period: float) -> None:
    """Send the requests of blocked robots and set target, tolerance and stop of robots that yield.

    margin: kept between bodies [m]; now [s]; period: since the last call [s].
    """
    n = len(robots.radius)
    requested = np.zeros(n, np.bool_)
    update_waiting(robots, now, period)
    # Robots that had arrived and moved off their goals have lower priority than those on their way.
    priority = robots.waiting_time.copy()
    for i in range(n):
        if not robots.visited[i] and priority[i] >= REQUEST_AFTER:
            priority[i] += FIRST_VISIT_PRIORITY
    order = np.argsort(priority)
    for j in range(n - 1, -1, -1):
        i = order[j]
        if robots.waiting_time[i] < REQUEST_AFTER:
            break
        if requested[i]:
            continue
        requested[i] = True
        # It has the right of way: earlier requests to it end.
        robots.yielding[i, 2] = now
        ex = robots.waypoint[i, 0] - robots.position[i, 0]
        ey = robots.waypoint[i, 1] - robots.position[i, 1]
        length = max(np.sqrt(ex * ex + ey * ey), DIVISOR_FLOOR)
        request_space(i, ex / length, ey / length, requested, robots, grid, margin, now + YIELD_DURATION)
    for k in range(n):
        if robots.yielding[k, 2] > now:
            robots.target[k, 0], robots.target[k, 1] = robots.yielding[k, 0], robots.yielding[k, 1]
            robots.tolerance[k] = YIELD_TOLERANCE
            robots.stop[k] = True
