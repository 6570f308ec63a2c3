"""The tree of a search over sequences: states under constant accelerations, times to go, new nodes."""

from typing import Final

import numpy as np

from slalom.base.tolerances import ADMISSIBLE, BRAKING_SHARE, REST, WHOLE_COUNT
from slalom.kernels.arrays import Array, Indices, MaybeHulls, Pieces, PositionMap, Segments
from slalom.kernels.decision.targets import earliest_arrival, time_to_rest
from slalom.kernels.geometry.boundaries import axes_along
from slalom.kernels.jit import kernel, squared
from slalom.kernels.relative_motion.segments import hulls_at, relative_segments
from slalom.kernels.sequence_search.tables import (
    AT_REST,
    FIXED,
    MEASURED,
    MOVING,
    NODES,
    BoundTable,
    SearchProblem,
    SearchTree,
    SpacetimeIndex,
)

TIME_CELLS_PER_STEP: Final = 2.0
"""[1] Cells of time per step of a search over sequences; the tree keeps one node for each cell. Larger: more nodes that
are nearly the same. Smaller: nodes at different times exclude each other."""

CELLS_PER_STEP: Final = 4.0
"""[1] Cells of position per distance at maximum speed during one step; the tree keeps one node for each cell. Larger:
more nodes that are nearly the same. Smaller: sequences through narrow gaps are missed."""

CELLS_PER_MAX_SPEED: Final = 5.0
"""[1] Cells of velocity per maximum speed; the tree keeps one node for each cell. Larger: more nodes that are nearly
the same. Smaller: nodes with different velocities exclude each other."""


@kernel
def advance(
    position: Array, velocity: Array, acceleration: Array, t: float, next_position: Array, next_velocity: Array
) -> None:
    """Write the state after t [s] under a constant acceleration into next_position and next_velocity.

    All arrays are (3,) [m], [m/s] or [m/s^2].
    """
    for axis in range(3):
        next_position[axis] = position[axis] + t * (velocity[axis] + 0.5 * t * acceleration[axis])
        next_velocity[axis] = velocity[axis] + t * acceleration[axis]


@kernel
def time_to_goal(problem: SearchProblem, position: Array, velocity: Array) -> float:
    """Time [s] to the goal without obstacles from position (3,) [m] with velocity (3,) [m/s].

    Exact for passing the goal, an estimate for stopping there.
    """
    d = problem.dimension
    away = np.empty(d)
    for axis in range(d):
        away[axis] = problem.goal[axis] - position[axis]
    if not problem.stop:
        return float(
            earliest_arrival(away, velocity[:d], problem.max_acceleration, problem.max_speed, problem.tolerance)
        )
    most, braking = problem.max_acceleration, BRAKING_SHARE * problem.braking
    return float(time_to_rest(away, velocity[:d], most, braking, problem.max_speed))


@kernel
def add_node(
    tree: SearchTree,
    parent: int,
    time: float,
    position: Array,
    velocity: Array,
    acceleration: Array,
    cost: float,
    status: int,
) -> int:
    """Number of a new node after `parent`, at `time` [s] with `cost` [s]; see `SearchTree` for the arrays (3,)."""
    i = tree.counts[NODES]
    tree.time[i] = time
    tree.parent[i] = parent
    tree.cost[i] = cost
    tree.status[i] = status
    for axis in range(3):
        tree.position[i, axis] = position[axis]
        tree.velocity[i, axis] = velocity[axis]
        tree.acceleration[i, axis] = acceleration[axis]
    tree.counts[NODES] = i + 1
    return int(i)


@kernel
def is_new(tree: SearchTree, problem: SearchProblem, time: float, position: Array, velocity: Array) -> bool:
    """Whether the cell of time [s], position (3,) [m] and velocity (3,) [m/s] has been free; it is occupied afterwards.

    Cells are identified by hash keys of 64 bits. Among a million cells two keys agree with a probability of 3e-8, and
    then the tree lacks a node.
    """
    key = np.int64(np.round(TIME_CELLS_PER_STEP * (time - tree.time[0]) / problem.step))
    length = problem.max_speed * problem.step / CELLS_PER_STEP
    speed = problem.max_speed / CELLS_PER_MAX_SPEED
    for axis in range(problem.dimension):
        key = key * np.int64(1000003) + np.int64(np.round((position[axis] - problem.goal[axis]) / length))
        key = key * np.int64(1000003) + np.int64(np.round(velocity[axis] / speed))
    # The low bits of the key, which place it in the table, are to depend on all bits.
    key ^= key >> np.int64(29)
    key *= np.int64(0x5851F42D4C957F2D)
    key ^= key >> np.int64(32)
    key = np.int64(1) if key == 0 else key
    size = len(tree.cells)
    at = key & np.int64(size - 1)
    while tree.cells[at] != 0:
        if tree.cells[at] == key:
            return False
        at = (at + 1) & np.int64(size - 1)
    tree.cells[at] = key
    return True


@kernel
def descends(tree: SearchTree, i: int, root: int) -> bool:
    """Whether node i is `root` or a descendant of it; the number of a parent is below those of its children."""
    while i > root:
        i = tree.parent[i]
    return bool(i == root)


# Queries of the space-time index: pieces of bodies near a point during an interval, and their relative motion.


@kernel
def rows_near(
    index: SpacetimeIndex, t: float, duration: float, position: Array, radius: float, now: float, rows: Indices
) -> int:
    """Number of pieces that may come within `radius` [m] of position (3,) [m] from t to t + duration [s].

    Their numbers go into `rows` (n,). Bodies that appear after `now` [s] are not known.
    """
    last = len(index.first) - 2
    count = 0
    k0 = max(0, int(np.floor((t - index.start) / index.width)))
    k1 = min(last, int(np.floor((t + duration - index.start) / index.width)))
    for k in range(k0, k1 + 1):
        for j in range(index.first[k], index.first[k + 1]):
            s = index.row[j]
            # The same differences as in `relative_rows`: no piece may vanish by rounding in between.
            begin = max(index.times[s, 0] - t, 0.0)
            end = min(index.times[s, 1] - t, duration)
            if not begin < end or index.appears[s] > now:
                continue
            # A piece that overlaps several intervals is taken from the first.
            if k > k0 and index.times[s, 0] < index.start + k * index.width:
                continue
            square = 0.0
            for axis in range(index.centers.shape[1]):
                square += squared(index.centers[s, axis] - position[axis])
            far = radius + index.bounding_radius[s]
            if square < far * far:
                rows[count] = s
                count += 1
    return count


@kernel
def relative_rows(
    index: SpacetimeIndex, rows: Indices, t: float, motion: PositionMap, margin: float
) -> tuple[Segments, MaybeHulls]:
    """Motion of the pieces `rows` (n,) relative to a robot with a position map of one piece from time t [s] on.

    The radii include the margin [m].
    """
    n = len(rows)
    d = index.points.shape[2]
    turning = len(index.turns) > 0
    times = np.empty((n, 2))
    points = np.empty((n, 4, d))
    radius = np.empty(n)
    growth = np.empty(n)
    turns = np.empty((n if turning else 0, 4, 2))
    bounding_radius = np.empty(n)
    for i in range(n):
        s = rows[i]
        times[i, 0] = index.times[s, 0] - t
        times[i, 1] = index.times[s, 1] - t
        for c in range(4):
            for axis in range(d):
                points[i, c, axis] = index.points[s, c, axis]
            if turning:
                turns[i, c, 0], turns[i, c, 1] = index.turns[s, c, 0], index.turns[s, c, 1]
        radius[i] = index.radius[s] + margin
        growth[i] = index.growth[s]
    cut = relative_segments(
        Pieces(times, points, radius, growth, turns, np.zeros(n, np.int64)), motion, motion.knots[1]
    )
    for i in range(n):
        bounding_radius[i] = cut.radius[i] + max(cut.growth[i], 0.0) + index.hull_radius[rows[i]]
    table = Segments(cut.points, cut.gains, cut.cross, cut.radius, cut.growth, bounding_radius)
    return table, hulls_at(index.hulls, rows, cut.turns)


# Bounds on velocity and acceleration along a motion with a constant acceleration.


CUT_RESERVE: Final = 0.02
"""[1] Share of the excess over a bound by which a cut is tighter than the bound. The bound turns with the velocity, so
the cut is not exact. Larger: candidates use less of a bound. Smaller: they need more cuts."""

WORK_PERIOD: Final = 0.1
"""[us] Counted for the test of the bounds at the start of one period, see `search.WORK_NODE`."""

WORK_BOUND: Final = 0.004
"""[us] Counted for the test of one half-space there: its share of the time of such a test."""


@kernel
def breach(
    bounds: BoundTable, velocity: Array, acceleration: Array, duration: float, measured: bool, cut: Array, work: Array
) -> bool:
    """Whether a constant acceleration over `duration` [s] from a velocity breaks a bound at the start of some period.

    velocity (3,) [m/s], acceleration (3,) [m/s^2]. The rule is that of `limits.Limits.allows`; fixed half-spaces hold
    at all times. measured: whether the motion begins in the state of the decision. cut (5,): the half-space of
    accelerations that is broken most, see `kernels/geometry/boundaries.py`, goes there; (0,): it is not sought, in less
    time. work: (1,) [us] is increased.
    """
    if len(bounds.rows) == 0:
        return False
    v = velocity.copy()
    start = np.sqrt(squared(v[0]) + squared(v[1]) + squared(v[2]))
    world = np.eye(3)
    most = most_broken(bounds, FIXED, world, v, acceleration, duration, duration, 0.0, 0.0, cut)
    turning = bounds.first[MOVING + 1] - bounds.first[MOVING]
    still = acceleration[0] == 0.0 and acceleration[1] == 0.0 and acceleration[2] == 0.0
    periods = 0 if still or turning == 0 else max(1, int(np.ceil(duration / bounds.period - WHOLE_COUNT)))
    for k in range(periods):
        if most > 0.0 and len(cut) == 0:
            break
        square = 0.0
        for axis in range(3):
            v[axis] = velocity[axis] + k * bounds.period * acceleration[axis]
            square += squared(v[axis])
        speed = np.sqrt(square)
        elapsed = (k + 1) * bounds.period
        state = MEASURED if measured and k == 0 else AT_REST if speed < REST else MOVING
        frame = axes_along(v[: bounds.dimension] / speed) if state == MOVING else world
        most = most_broken(bounds, state, frame, v, acceleration, bounds.period, elapsed, start, most, cut)
        work[0] += WORK_PERIOD + WORK_BOUND * turning
    return bool(most > 0.0)


@kernel
def most_broken(
    bounds: BoundTable,
    state: int,
    frame: Array,
    velocity: Array,
    acceleration: Array,
    time: float,
    elapsed: float,
    speed: float,
    most: float,
    cut: Array,
) -> float:
    """The larger of `most` [m/s^2] and the largest excess over the rows of a state, whose half-space goes into cut.

    frame (d, d): axes of the rows. Velocities count after `time` [s], when the acceleration has lasted for `elapsed`.
    """
    d = len(frame)
    rows = bounds.rows
    now = np.zeros(3)
    change = np.zeros(3)
    square = 0.0
    for k in range(d):
        for axis in range(d):
            now[k] += frame[k, axis] * velocity[axis]
            change[k] += frame[k, axis] * acceleration[axis]
        square += squared(now[k])
    worst = -1
    offset_of_worst = 0.0
    deficit = 0.0
    for b in range(bounds.first[state], bounds.first[state + 1]):
        before = rows[b, 1] * now[0] + rows[b, 2] * now[1] + rows[b, 3] * now[2]
        along = rows[b, 1] * change[0] + rows[b, 2] * change[1] + rows[b, 3] * change[2]
        offset = rows[b, 4] + rows[b, 5] * square
        excess = along - offset
        if rows[b, 0] == 0.0:
            # No bound that turns excludes the present velocity; nor need the robot be faster than at the start.
            least = max(offset, -speed) if state == MOVING else offset
            offset = max(offset, before) if state == MOVING else offset
            excess = before + time * along - offset
            deficit = (before + time * along - min(offset, least)) / elapsed
        if excess <= ADMISSIBLE * (1.0 + abs(offset)):
            continue
        excess = deficit if rows[b, 0] == 0.0 else excess
        if excess > most:
            most = excess
            worst = b
            # At the start the heading does not depend on the acceleration: the cut is exact.
            offset_of_worst = along - (1.0 + CUT_RESERVE if elapsed > time else 1.0) * excess
    if worst >= 0 and len(cut) > 0:
        cut[0] = 0.0
        cut[4] = offset_of_worst
        for axis in range(3):
            cut[1 + axis] = 0.0
            for k in range(d if axis < d else 0):
                cut[1 + axis] += rows[worst, 1 + k] * frame[k, axis]
    return most
