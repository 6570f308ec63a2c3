"""Best-first search over sequences of accelerations that are clear of all moving bodies, and steering to the goal."""

import heapq
from typing import Final

import numpy as np

from slalom.base.tolerances import ADMISSIBLE, DIVISOR_FLOOR, WHOLE_COUNT
from slalom.kernels.arrays import Array, MaybeHulls, PositionMap, Segments, Workspace
from slalom.kernels.decision.collision import WORK_ROW
from slalom.kernels.decision.response_motion import WORK_CHOICE
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.relative_motion.clearance import new_workspace
from slalom.kernels.relative_motion.window import allowed_speed
from slalom.kernels.selection.exchange import SAFE, deepest_violation, nearest_free
from slalom.kernels.sequence_search.tables import (
    ARRIVED,
    BEST,
    BRAKE,
    CLOSED,
    COAST,
    FIRST_DIRECTION,
    NODES,
    OPEN,
    TO_GOAL,
    SearchProblem,
    SearchScratch,
    SearchTree,
    SpacetimeIndex,
)
from slalom.kernels.sequence_search.tree import (
    add_node,
    advance,
    breach,
    descends,
    is_new,
    relative_rows,
    rows_near,
    time_to_goal,
)

# Test of a motion against the space-time index, and sequences of two accelerations that end at the goal.


WORK_STRETCH: Final = 3.0
"""[us] Counted for each stretch of a motion that is tested: see WORK_NODE."""

COAST_ATTEMPTS: Final = 100
"""[1] Arrival times that are tried for passing the goal after one acceleration and coasting. More: slower where the
goal is beside the course of a fast robot. Fewer: arrivals that need a later time are missed."""

COAST_STEP: Final = 0.25
"""[1] Share of a period between these arrival times. Larger: later arrivals. Smaller: COAST_ATTEMPTS cover less
time."""

LATER: Final = 1.5
"""[1] Ratio of these shares for one arrival time to that for the last one, where a bound is broken. Larger: later
arrivals. Smaller: more tests where no arrival obeys the bound."""

LONGER: Final = 1.2
"""[1] Ratio of the next number of periods to the last one, where a bound is broken. Larger: smaller accelerations than
the bounds allow. Smaller: more tests."""

BRAKE_STEPS: Final = 2.0
"""[1] Steps that accelerating, and then braking to a stop at the goal, may each take at most. Larger: stops at distant
goals are found at once, in more tests. Smaller: only from nodes near the goal."""

EARLIER_ARRIVAL: Final = 0.5
"""[1] Share of a period by which a new arrival must precede the best one. Arrivals are whole periods apart, but for
rounding. Larger than 1: arrivals one period earlier are missed."""


@kernel
def new_scratch(index: SpacetimeIndex) -> SearchScratch:
    """Workspace of a search among the bodies of an index, without any work done."""
    return SearchScratch(np.empty(len(index.times), np.int64), np.zeros(1))


@kernel
def motion_is_clear(
    index: SpacetimeIndex,
    problem: SearchProblem,
    t: float,
    position: Array,
    velocity: Array,
    acceleration: Array,
    duration: float,
    scratch: SearchScratch,
) -> bool:
    """Whether the motion from time t for `duration` [s] under a constant acceleration is collision-free.

    position (3,) [m], velocity (3,) [m/s], acceleration (3,) [m/s^2]. The motion is cut into stretches of at most one
    step, so that few bodies are near each.
    """
    if duration <= 0.0:
        return True
    d = problem.dimension
    drift = np.empty((1, 4, d))
    gain = np.zeros((1, 4))
    u = np.zeros(3)
    p = np.empty(3)
    v = np.empty(3)
    middle = np.empty(3)
    middle_velocity = np.empty(3)
    stretches = max(1, int(np.ceil(duration / problem.step - WHOLE_COUNT)))
    h = duration / stretches
    for k in range(stretches):
        scratch.work[0] += WORK_STRETCH
        advance(position, velocity, acceleration, h * k, p, v)
        advance(p, v, acceleration, 0.5 * h, middle, middle_velocity)
        square_speed = 0.0
        square_acceleration = 0.0
        for axis in range(d):
            square_speed += squared(middle_velocity[axis])
            square_acceleration += squared(acceleration[axis])
            drift[0, 0, axis] = p[axis]
            drift[0, 1, axis] = p[axis] + h / 3.0 * v[axis]
            drift[0, 2, axis] = p[axis] + 2.0 * h / 3.0 * v[axis] + h * h / 6.0 * acceleration[axis]
            drift[0, 3, axis] = p[axis] + h * v[axis] + 0.5 * h * h * acceleration[axis]
        radius = 0.5 * h * np.sqrt(square_speed) + 0.125 * h * h * np.sqrt(square_acceleration) + problem.margin
        n = rows_near(index, t + h * k, h, middle, radius, problem.now, scratch.rows)
        if n == 0:
            continue
        scratch.work[0] += WORK_ROW * n
        motion = PositionMap(np.array([0.0, h]), drift, gain, np.empty((0, 4)), 1)
        table, hulls = relative_rows(index, scratch.rows[:n], t + h * k, motion, problem.margin)
        if deepest_violation(table, hulls, u, new_workspace(len(table.radius), hulls)) != -1:
            return False
    return True


@inlined
def longer(periods: int) -> int:
    """The next larger number of periods to try where a bound is broken."""
    return max(periods + 1, int(LONGER * periods))


@kernel
def accelerate_and_coast(
    problem: SearchProblem,
    position: Array,
    velocity: Array,
    measured: bool,
    acceleration: Array,
    scratch: SearchScratch,
) -> tuple[float, float]:
    """Time [s] of acceleration, in whole periods, and of the pass of the goal after coasting [s]; -1: never.

    The earliest such arrival from position (3,) [m] with velocity (3,) [m/s]; with bounds an early one. The
    acceleration goes into acceleration (3,) [m/s^2]. measured: see `breach`.
    """
    d = problem.dimension
    none = np.empty(0)
    time = time_to_goal(problem, position, velocity)
    delay = COAST_STEP * problem.period
    acceleration[:] = 0.0
    for _ in range(COAST_ATTEMPTS):
        square = 0.0
        for axis in range(d):
            acceleration[axis] = problem.goal[axis] - position[axis] - velocity[axis] * time
            square += squared(acceleration[axis])
        length = np.sqrt(square)
        if length <= problem.tolerance:
            acceleration[:] = 0.0
            return 0.0, time
        need = length - problem.tolerance
        hold = time - np.sqrt(max(time * time - 2.0 * need / problem.max_acceleration, 0.0))
        hold = np.ceil(hold / problem.period - WHOLE_COUNT) * problem.period
        if hold > time:
            # A later arrival has another displacement.
            time = hold
            continue
        broken = False
        while hold <= time:
            size = need / (hold * (time - 0.5 * hold))
            square_speed = 0.0
            square_now = 0.0
            for axis in range(d):
                acceleration[axis] *= size / length
                square_speed += squared(velocity[axis] + hold * acceleration[axis])
                square_now += squared(velocity[axis])
            length = size
            allowed = max(squared(problem.max_speed), square_now) * (1.0 + ADMISSIBLE)
            # Also of a time of 0, for which no size is a number.
            if not (size <= problem.max_acceleration * (1.0 + ADMISSIBLE) and square_speed <= allowed):
                break
            if not breach(problem.bounds, velocity, acceleration, hold, measured, none, scratch.work):
                return hold, time
            # A smaller acceleration for a longer time.
            broken = True
            hold = longer(int(np.round(hold / problem.period))) * problem.period
        time += delay
        delay *= LATER if broken else 1.0
        if broken and delay > problem.step:
            break
    return -1.0, -1.0


@kernel
def accelerate_and_brake(
    problem: SearchProblem,
    position: Array,
    velocity: Array,
    measured: bool,
    acceleration: Array,
    scratch: SearchScratch,
) -> tuple[float, float]:
    """Times [s] to accelerate and then to brake evenly, in whole periods, to stop at the goal; -1: not possible.

    Of all pairs with at most BRAKE_STEPS steps for each, one that ends first; with bounds an early one. position (3,)
    [m], velocity (3,) [m/s]. The first acceleration goes into acceleration (3,) [m/s^2]. measured: see `breach`.
    """
    d = problem.dimension
    none = np.empty(0)
    end = np.zeros(3)
    braking = np.zeros(3)
    most = int(np.round(BRAKE_STEPS * problem.step / problem.period))
    total = 2
    broken = False
    while total <= 2 * most:
        k = max(1, total - most)
        while k <= min(most, total - 1):
            hold = k * problem.period
            brake = (total - k) * problem.period
            square = 0.0
            square_speed = 0.0
            for axis in range(d):
                away = problem.goal[axis] - position[axis] - (hold + 0.5 * brake) * velocity[axis]
                acceleration[axis] = away / (0.5 * hold * (hold + brake))
                square += squared(acceleration[axis])
                end[axis] = velocity[axis] + hold * acceleration[axis]
                braking[axis] = -end[axis] / brake
                square_speed += squared(end[axis])
            allowed = squared(min(problem.max_speed, problem.braking * brake))
            if square <= squared(problem.max_acceleration) and square_speed <= allowed:
                broken = breach(problem.bounds, velocity, acceleration, hold, measured, none, scratch.work)
                if not broken:
                    broken = breach(problem.bounds, end, braking, brake, False, none, scratch.work)
                    if not broken:
                        return hold, brake
                    # The longer the acceleration, the harder the braking.
                    break
            k = longer(k) if broken else k + 1
        total = longer(total) if broken else total + 1
    return -1.0, -1.0


@kernel
def steer_to_goal(
    tree: SearchTree, i: int, index: SpacetimeIndex, problem: SearchProblem, scratch: SearchScratch
) -> int:
    """Node at the goal, reached from node i by one acceleration and then coasting or braking; -1: none is clear.

    Also -1 if it does not arrive before the best node so far.
    """
    latest = problem.deadline
    if tree.counts[BEST] >= 0:
        latest = min(latest, tree.time[tree.counts[BEST]] - EARLIER_ARRIVAL * problem.period)
    first = np.zeros(3)
    second = np.zeros(3)
    p = np.empty(3)
    v = np.empty(3)
    start = tree.time[i]
    position = tree.position[i]
    velocity = tree.velocity[i]
    if problem.stop:
        hold, rest = accelerate_and_brake(problem, position, velocity, i == 0, first, scratch)
    else:
        hold, time = accelerate_and_coast(problem, position, velocity, i == 0, first, scratch)
        rest = time - hold
    scratch.work[0] += WORK_CHOICE
    if hold < 0.0 or start + hold + rest > latest:
        return -1
    if not motion_is_clear(index, problem, start, position, velocity, first, hold, scratch):
        return -1
    advance(position, velocity, first, hold, p, v)
    if problem.stop:
        for axis in range(3):
            second[axis] = -v[axis] / rest
    # A robot that passes the goal is observed there at the end of a period.
    duration = rest if problem.stop else np.ceil(rest / problem.period) * problem.period
    if not motion_is_clear(index, problem, start + hold, p, v, second, duration, scratch):
        return -1
    j = i
    end = np.empty(3)
    end_velocity = np.empty(3)
    if hold > 0.0:
        j = add_node(tree, i, start + hold, p, v, first, 0.0, CLOSED)
    advance(p, v, second, rest, end, end_velocity)
    return add_node(tree, j, start + hold + rest, end, end_velocity, second, 0.0, ARRIVED)


# From each node the exact selection runs for several candidate accelerations. They are coasting, braking, moving
# towards the goal, and full acceleration in all directions. Each leads to a node one step later. Before that,
# `steer_to_goal` tries to end the sequence. Work is counted in microseconds of a usual machine instead of measured:
# the same search ends in the same way on all machines.


FEW_ELEMENTS: Final = 64
"""[1] Most elements in the working set of a choice in a search over sequences; harder candidates are dropped."""

FEW_CANDIDATES: Final = 5_000
"""[1] Most candidate controls in such a choice. Larger: a search finds more free controls and takes longer."""

WORK_NODE: Final = 8.0
"""[us] Counted for the expansion of a node of a search over sequences, without its bodies and candidates. The counts
stand for times on a usual machine (benchmarks/crossings.py compares them). Larger than the true time: searches end
earlier than their budget. Smaller: they take longer than it."""

WORK_CANDIDATE: Final = 0.6
"""[us] Counted for the test of one candidate acceleration: see WORK_NODE."""

MOST_CUTS: Final = 6
"""[1] Half-spaces of bounds that are added for one candidate, after which it is dropped. Larger: more candidates obey
bounds, for more choices. Smaller: robots with several bounds have fewer sequences."""

SPARE_NODES: Final = 8
"""[1] Nodes that are kept free, besides one for each direction, when a search is cut because its tree is full. One
expansion adds three more nodes than there are directions, and steering to the goal two. Fewer than that: the tree
overflows. More: it is cut earlier."""


@kernel
def candidate_acceleration(tree: SearchTree, i: int, k: int, problem: SearchProblem, u: Array) -> bool:
    """Whether candidate acceleration k of node i exists; it goes into u (3,) [m/s^2].

    It is COAST, BRAKE, TO_GOAL, or one of the directions, scaled to the limits.
    """
    d = problem.dimension
    h = problem.step
    u[:] = 0.0
    distance = 0.0
    speed = 0.0
    for axis in range(d):
        distance += squared(problem.goal[axis] - tree.position[i, axis])
        speed += squared(tree.velocity[i, axis])
    distance = max(np.sqrt(distance), DIVISOR_FLOOR)
    speed = np.sqrt(speed)
    if k == COAST:
        return True
    if k == BRAKE:
        scale = -min(problem.max_acceleration, speed / h) / max(speed, DIVISOR_FLOOR)
        for axis in range(3):
            u[axis] = tree.velocity[i, axis] * scale
        return bool(speed > DIVISOR_FLOOR)
    if k == TO_GOAL:
        for axis in range(d):
            desired = (problem.goal[axis] - tree.position[i, axis]) * problem.max_speed / distance
            u[axis] = (desired - tree.velocity[i, axis]) / h
    else:
        direction = problem.directions[k - FIRST_DIRECTION]
        most = problem.max_acceleration
        x = problem.goal[0] - tree.position[i, 0]
        y = problem.goal[1] - tree.position[i, 1]
        flat = max(np.sqrt(x * x + y * y), DIVISOR_FLOOR)
        x, y = (x / flat, y / flat) if flat > DIVISOR_FLOOR else (1.0, 0.0)
        u[0] = most * (x * direction[0] - y * direction[1])
        u[1] = most * (y * direction[0] + x * direction[1])
        if d == 3:
            u[2] = most * direction[2]
    size = 0.0
    square_speed = 0.0
    for axis in range(d):
        size += squared(u[axis])
    scale = min(1.0, problem.max_acceleration / max(np.sqrt(size), DIVISOR_FLOOR))
    for axis in range(3):
        u[axis] *= scale
    for axis in range(d):
        square_speed += squared(tree.velocity[i, axis] + h * u[axis])
    if square_speed > squared(problem.max_speed):
        # The velocity after the step keeps its direction and gets the maximum speed.
        scale = problem.max_speed / np.sqrt(square_speed)
        size = 0.0
        for axis in range(3):
            u[axis] = (tree.velocity[i, axis] * (scale - 1.0) + h * u[axis] * scale) / h
        for axis in range(d):
            size += squared(u[axis])
        return bool(size <= squared(problem.max_acceleration))
    return True


@kernel
def node_encounters(
    tree: SearchTree, i: int, index: SpacetimeIndex, problem: SearchProblem, scratch: SearchScratch
) -> tuple[Segments, MaybeHulls, Array]:
    """Segments that a robot at node i may collide with within one step, and the limits of its acceleration.

    The segments are those of `relative_rows`. limits (2 + MOST_CUTS, 5) begins with two balls, of the acceleration and
    of the velocity after the step; the rest is for cuts.
    """
    d = problem.dimension
    h = problem.step
    t = tree.time[i]
    drift = np.empty((1, 4, d))
    gain = np.zeros((1, 4))
    middle = np.empty(3)
    limits = np.zeros((2 + MOST_CUTS, 5))
    speed = 0.0
    for axis in range(d):
        p = tree.position[i, axis]
        v = tree.velocity[i, axis]
        middle[axis] = p + 0.5 * h * v
        speed += v * v
        limits[1, 1 + axis] = -v / h
        for c in range(4):
            drift[0, c, axis] = p + c * h / 3.0 * v
    speed = np.sqrt(speed)
    gain[0, 2] = h * h / 6.0
    gain[0, 3] = 0.5 * h * h
    limits[:2, 0] = -1.0
    end_speed = allowed_speed(problem.max_speed, speed, problem.braking, h)
    limits[0, 4] = problem.max_acceleration
    limits[1, 4] = end_speed / h
    radius = 0.5 * h * speed + 0.5 * h * h * problem.max_acceleration + problem.margin
    n = rows_near(index, t, h, middle, radius, problem.now, scratch.rows)
    motion = PositionMap(np.array([0.0, h]), drift, gain, np.empty((0, 4)), 1)
    table, hulls = relative_rows(index, scratch.rows[:n], t, motion, problem.margin)
    return table, hulls, limits


@kernel
def nearest_within_bounds(
    velocity: Array,
    u: Array,
    measured: bool,
    limits: Array,
    table: Segments,
    hulls: MaybeHulls,
    problem: SearchProblem,
    workspace: Workspace,
    scratch: SearchScratch,
) -> bool:
    """Whether a free acceleration near the candidate u (3,) [m/s^2] obeys all bounds over a step; it goes into u.

    A candidate that collides is replaced by the nearest free acceleration. While that breaks a bound, the half-space of
    the one that is broken most is added to `limits`, and the nearest one is chosen again, at most MOST_CUTS times.
    velocity (3,) [m/s]; the other arguments are those of `node_encounters` and `breach`.
    """
    candidate = u.copy()
    for count in range(MOST_CUTS + 1):
        if count > 0 or deepest_violation(table, hulls, u, workspace) != -1:
            scratch.work[0] += WORK_CHOICE
            within = limits[: 2 + count]
            code, safe, _, _ = nearest_free(
                candidate, problem.dimension, within, table, hulls, FEW_ELEMENTS, FEW_CANDIDATES, np.inf
            )
            if code != SAFE:
                return False
            for axis in range(3):
                u[axis] = safe[axis]
        cut = limits[min(2 + count, len(limits) - 1)]
        if not breach(problem.bounds, velocity, u, problem.step, measured, cut, scratch.work):
            return True
    return False


@kernel
def expand(
    tree: SearchTree,
    i: int,
    index: SpacetimeIndex,
    problem: SearchProblem,
    heap: list[tuple[float, int]],
    scratch: SearchScratch,
) -> None:
    """Add to the tree and the heap the nodes reached from node i by the exact selection for each candidate.

    heap: costs [s] and numbers of open nodes.
    """
    h = problem.step
    t = tree.time[i]
    latest = min(problem.deadline, tree.time[tree.counts[BEST]] if tree.counts[BEST] >= 0 else np.inf)
    if t + h > latest:
        return
    table, hulls, limits = node_encounters(tree, i, index, problem, scratch)
    workspace = new_workspace(len(table.radius), hulls)
    u = np.zeros(3)
    p = np.zeros(3)
    v = np.zeros(3)
    scratch.work[0] += WORK_NODE + WORK_ROW * len(table.radius)
    for k in range(len(problem.directions) + FIRST_DIRECTION):
        if not candidate_acceleration(tree, i, k, problem, u):
            continue
        scratch.work[0] += WORK_CANDIDATE
        if not nearest_within_bounds(tree.velocity[i], u, i == 0, limits, table, hulls, problem, workspace, scratch):
            continue
        advance(tree.position[i], tree.velocity[i], u, h, p, v)
        time_to_go = time_to_goal(problem, p, v)
        if t + h + time_to_go > latest or not is_new(tree, problem, t + h, p, v):
            continue
        cost = t + h + problem.heuristic_weight * time_to_go
        heapq.heappush(heap, (cost, add_node(tree, i, t + h, p, v, u, cost, OPEN)))


@kernel
def grow_tree(
    tree: SearchTree, root: int, index: SpacetimeIndex, problem: SearchProblem, budget: float, improving: float
) -> tuple[int, bool, float]:
    """Node that arrives first, or -1, after growing the tree from `root`; whether the search was cut; the work [us].

    The search is cut after `budget` [us], and `improving` [us] after the first arrival. Otherwise it ends when no
    open node could arrive earlier.
    """
    heap = [(0.0, 0)]
    heap.pop()
    for i in range(tree.counts[NODES]):
        if tree.status[i] == OPEN and descends(tree, i, root):
            heap.append((tree.cost[i], i))
    heapq.heapify(heap)
    scratch = new_scratch(index)
    capacity = len(tree.time) - len(problem.directions) - SPARE_NODES
    if tree.counts[BEST] >= 0:
        budget = min(budget, improving)
    while len(heap) > 0:
        if scratch.work[0] > budget or tree.counts[NODES] > capacity:
            return int(tree.counts[BEST]), True, scratch.work[0]
        _, i = heapq.heappop(heap)
        tree.status[i] = CLOSED
        best = tree.counts[BEST]
        if best >= 0 and tree.time[i] + time_to_goal(problem, tree.position[i], tree.velocity[i]) >= tree.time[best]:
            continue
        j = steer_to_goal(tree, i, index, problem, scratch)
        if j >= 0:
            tree.counts[BEST] = j
            budget = min(budget, scratch.work[0] + improving)
        else:
            expand(tree, i, index, problem, heap, scratch)
    return int(tree.counts[BEST]), False, scratch.work[0]


@kernel
def sequence_is_clear(
    times: Array,
    positions: Array,
    velocities: Array,
    accelerations: Array,
    index: SpacetimeIndex,
    problem: SearchProblem,
) -> bool:
    """Whether a sequence of n constant accelerations is collision-free.

    times (n + 1,) [s]; positions (n, 3) [m], velocities (n, 3) [m/s], accelerations (n, 3) [m/s^2]: from times[k] on.
    """
    scratch = new_scratch(index)
    for k in range(len(positions)):
        p = positions[k]
        v = velocities[k]
        duration = times[k + 1] - times[k]
        if not motion_is_clear(index, problem, times[k], p, v, accelerations[k], duration, scratch):
            return False
    return True
