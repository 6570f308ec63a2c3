"""Motion of bodies relative to a robot under one response: the segments on which its controls can collide."""

from typing import Final

import numpy as np

from slalom.base.tolerances import CANDIDATES, ELEMENTS, REST_ROUNDING
from slalom.kernels.arrays import Array, Bodies, Indices, MaybeCorners, MaybeHulls, Pieces, PositionMap, Segments
from slalom.kernels.decision.bodies import hulls_of_bodies, meets_balls
from slalom.kernels.decision.limits import admissible_set
from slalom.kernels.decision.motion_clear import is_blocked
from slalom.kernels.decision.neighbours import response_balls
from slalom.kernels.decision.paths import response_path
from slalom.kernels.decision.tables import (
    RESPONSE_WINDOWS,
    Controls,
    DecisionTables,
    ObstaclePieces,
    Scratch,
    SelectionProblem,
)
from slalom.kernels.geometry.cubic import copy_into, image, modulus_at, to_control, value
from slalom.kernels.geometry.hulls import MovingHull, corners_at, load_path
from slalom.kernels.jit import inlined, kernel, squared
from slalom.kernels.relative_motion.clearance import nearest_on_chord, new_workspace
from slalom.kernels.relative_motion.segments import bounding_radii, relative_segments
from slalom.kernels.selection.exchange import SAFE, SMALLEST_GAIN, deepest_violation, nearest_free

WORK_CHOICE: Final = 8.0
"""[us] Counted for an exact selection, and for an attempt to steer to the goal: see WORK_NODE."""

WORK_CONTROL: Final = 1.4
"""[us] Counted for the test of one control by an exact selection among the obstacles of a decision: see WORK_NODE."""

WORK_ELEMENT: Final = 10.0
"""[us] Counted for an element of such a selection where bodies have corners: see WORK_NODE."""


@inlined
def hulls_of_segments(corners: MaybeCorners, rows: ObstaclePieces, body: Indices, turned: Array) -> MaybeHulls:
    """The hulls of segments of those bodies (n,), `turned` (4, 2, n): their directions if any turns."""
    if len(corners) > 0:
        if len(rows.pieces.turns) == 0:
            turned = np.zeros((4, 2, len(body)))
            turned[:, 0] = 1.0
        return hulls_of_bodies(corners, rows.hull[body], turned)
    return ()


@kernel
def relative_table(
    rows: ObstaclePieces, bodies: Bodies, motion: PositionMap, horizon: float, rest: float
) -> tuple[Segments, MaybeHulls, Indices]:
    """The segments, hulls and bodies (n,) of the motion relative to a robot, up to the horizon [s].

    From `rest` [s] on the robot is at rest: segments of bodies that do not count then are never met.
    """
    cut = relative_segments(rows.pieces, motion, horizon)
    for s in range(len(cut.body)):
        if not rows.bodies[cut.body[s]].at_rest and cut.begin[s] >= rest - REST_ROUNDING:
            cut.radius[s] = -np.inf
            cut.growth[s] = 0.0
    hull_radius = np.empty(len(rows.bodies))
    for b in range(len(hull_radius)):
        hull_radius[b] = rows.bodies[b].hull_radius
    table = Segments(cut.points, cut.gains, cut.cross, cut.radius, cut.growth, bounding_radii(cut, hull_radius))
    return table, hulls_of_segments(bodies.corners, rows, cut.body, cut.turns), cut.body


@kernel
def rows_in_reach(
    i: int, r: int, preferred: Array, within: float, rows: ObstaclePieces, tables: DecisionTables, near: Indices
) -> int:
    """The number of the rows of `pieces_in_reach`, which go into `near` (n,).

    A kernel of its own, since it returns no array: a reference to a row would cost as much as its test.
    """
    centers = np.empty((RESPONSE_WINDOWS, 3))
    radii = np.empty(RESPONSE_WINDOWS)
    times = rows.pieces.times
    count = 0
    horizon = tables.settings.horizon
    response_balls(tables.robots.each[i], r, preferred, within, tables.responses, centers, radii)
    for s in range(len(times)):
        known = rows.balls[s, 3] < np.inf
        if not known or meets_balls(rows.balls[s], 0.0, times[s, 0], times[s, 1], horizon, centers, radii):
            near[count] = s
            count += 1
    return count


@kernel
def pieces_in_reach(
    i: int, r: int, preferred: Array, within: float, rows: ObstaclePieces, tables: DecisionTables
) -> ObstaclePieces:
    """The rows that robot i can come near under a control of response r `within` a distance of `preferred` (3,).

    Bodies of robots stay. A row on which no such control can collide changes no choice.
    """
    pieces = rows.pieces
    d = rows.pieces.points.shape[2]
    near = np.empty(len(pieces.body), np.int64)
    count = rows_in_reach(i, r, preferred, within, rows, tables, near)
    if count == len(pieces.body):
        return rows
    turning = len(pieces.turns) > 0
    turns = np.empty((count if turning else 0, 4, 2))
    kept = Pieces(
        np.empty((count, 2)),
        np.empty((count, 4, d)),
        np.empty(count),
        np.empty(count),
        turns,
        np.empty(count, np.int64),
    )
    for k in range(count):
        s = near[k]
        kept.times[k, 0] = pieces.times[s, 0]
        kept.times[k, 1] = pieces.times[s, 1]
        kept.radius[k] = pieces.radius[s]
        kept.growth[k] = pieces.growth[s]
        kept.body[k] = pieces.body[s]
        for c in range(4):
            for axis in range(d):
                kept.points[k, c, axis] = pieces.points[s, c, axis]
            if turning:
                turns[k, c, 0], turns[k, c, 1] = pieces.turns[s, c, 0], pieces.turns[s, c, 1]
    return ObstaclePieces(kept, rows.margin[:count], rows.balls[:count], rows.bodies, rows.hull)


@inlined
def relative_motion(
    i: int,
    r: int,
    rows: ObstaclePieces,
    tables: DecisionTables,
    unchanged: Array,
    horizon: float,
    preferred: Array,
    within: float,
) -> SelectionProblem:
    """The relative motion of robot i under response r up to `horizon` [s], at most that of the settings.

    `unchanged` (3,): the control that changes nothing now. Bodies count that controls `within` a distance of
    `preferred` (3,) can meet, where no body does a part of the avoidance.
    """
    robots = tables.robots
    responses = tables.responses
    settings = tables.settings
    robot = robots.each[i]
    d = settings.dimension
    first = responses.first[r]
    last = responses.first[r + 1]
    m = last - first
    knots = responses.knots[first + r : last + r + 1]
    drift = np.empty((m, 4, d))
    gain = np.empty((m, 4))
    for p in range(m):
        piece = responses.pieces[first + p]
        for c in range(4):
            gain[p, c] = piece.gain[c]
            for axis in range(d):
                own = robot.position[axis] + piece.velocity_gain[c] * robot.velocity[axis]
                drift[p, c, axis] = own + piece.acceleration_gain[c] * robot.acceleration[axis]
    motion = PositionMap(knots, drift, gain, np.empty((0, 4)), responses.each[r].straight)
    near_rows = pieces_in_reach(i, r, preferred, within, rows, tables) if len(tables.bodies.each) else rows
    table, hulls, body = relative_table(near_rows, tables.bodies, motion, horizon, responses.each[r].rest)
    if settings.share < 1.0:
        # A part of the change of the control must do where the other robot avoids too: unchanged + (u - unchanged) /
        # share is tested.
        n = len(body)
        times = np.empty(n)
        for s in range(n):
            times[s] = 1.0 / rows.bodies[body[s]].share
        for c in range(4):
            for axis in range(d):
                by = unchanged[axis]
                for s in range(n):
                    table.points[c, axis, s] += table.gains[c, s] * by * (times[s] - 1.0)
            for s in range(n):
                table.gains[c, s] *= times[s]
    limits = admissible_set(i, r, robots, responses, tables.bounds)
    return SelectionProblem(limits, table, hulls)


@inlined
def choose(m: SelectionProblem, preferred: Array, d: int, most: float, within: float, u: Array) -> tuple[bool, float]:
    """Whether there is a free admissible control `within` a distance of `preferred` (3,), and the counted work [us].

    The one nearest to it goes into u (3,). With `most` [us] of work the answer may be False too early.
    """
    candidates = int(min(max(most, 0.0) / WORK_CONTROL, float(CANDIDATES)))
    code, found, elements, examined = nearest_free(
        preferred, d, m.limits, m.table, m.hulls, ELEMENTS, candidates, within
    )
    if code == SAFE:
        copy_into(u, found)
    per_element = WORK_ELEMENT if len(m.hulls) > 0 else 0.0
    return code == SAFE, WORK_CHOICE + WORK_CONTROL * examined + per_element * elements


@kernel
def other_side(base: Array, table: Segments, hulls: MaybeHulls, preferred: Array, found: Array) -> Array:
    """Limits `base` (l, 5), and that of controls that pass a body on the other side than `found` (3,): (l + 1, 5).

    (0, 5) without a body. It is the body that the `preferred` control (3,) meets, or else the one that this passes
    nearest. Relative to the robot it moves along a line. The added half-space shifts the robot to its other side.
    """
    work = new_workspace(len(table.radius), hulls)
    s = deepest_violation(table, hulls, preferred, work)
    if s == -1:
        least = np.inf
        for b in range(len(work.gaps)):
            if work.gaps[b] - table.bounding_radius[b] < least:
                least, s = work.gaps[b] - table.bounding_radius[b], b
    if s < 0:
        return np.empty((0, 5))
    place = nearest_on_chord(table, s, preferred)
    gain, cross = table.gains[:, s], table.cross[:, s : s + 1]
    center, way = np.zeros(3), np.zeros(3)
    away = np.zeros(3)
    for axis in range(3):
        p = table.points[:, axis, s].copy()
        for c in range(4):
            p[c] -= image(table.gains, table.cross, c, s, preferred, axis)
        center[axis], way[axis] = value(p[0], p[1], p[2], p[3], place), p[3] - p[0]
    if len(hulls) > 0 and hulls.hull[s] >= 0:
        load_path(table, hulls, s, preferred, work.path)
        moving = MovingHull(work.path, hulls, hulls.hull[s], table.radius[s], table.growth[s])
        count = corners_at(moving, place, work.corners)
        for axis in range(3):
            center[axis] = work.corners[:count, axis].sum() / count
    if modulus_at(gain, cross, place) < SMALLEST_GAIN:
        return np.empty((0, 5))
    to_control(gain, cross, place, center)
    along, length = 0.0, 1e-300
    for axis in range(3):
        away[axis] = found[axis] - preferred[axis] - center[axis]
        along += away[axis] * way[axis]
        length += squared(way[axis])
    square = 0.0
    for axis in range(3):
        away[axis] -= along / length * way[axis]
        square += squared(away[axis])
    if square == 0.0:
        return np.empty((0, 5))
    limits = np.zeros((len(base) + 1, 5))
    for b in range(len(base)):
        copy_into(limits[b], base[b])
    for axis in range(3):
        limits[-1, 1 + axis] = away[axis] / np.sqrt(square)
        limits[-1, 4] += limits[-1, 1 + axis] * (preferred[axis] + center[axis])
    return limits


@kernel
def no_motions(i: int, rows: ObstaclePieces, tables: DecisionTables, zero: Array) -> list[SelectionProblem]:
    """An empty list of relative motions. numba needs the call to know their type."""
    motions: list[SelectionProblem] = []
    if len(motions) > 0:
        motions.append(relative_motion(i, 0, rows, tables, zero, 0.0, zero, 0.0))
    return motions


@kernel
def free_control(
    i: int,
    r: int,
    k: int,
    row: int,
    motions: list[SelectionProblem],
    which: Indices,
    rows: ObstaclePieces,
    tables: DecisionTables,
    controls: Controls,
    most: float,
    within: float,
    scratch: Scratch,
) -> bool:
    """Whether response r has a control outside the control obstacles; it goes into `controls`, its path into row 0.

    Args: row: of the bodies that a path of this response meets; below 0: none is known. motions, which: the relative
        motion of response k is at `which[k]` of `motions`; below 0: it is made. most, within: as in `choose`.
    """
    robot = tables.robots.each[i]
    settings = tables.settings
    paths = scratch.paths
    if row >= 0 and is_blocked(robot, r, row, controls.found, rows, tables, paths):
        return False
    if which[k] < 0:
        which[k] = len(motions)
        horizon = settings.horizon
        motion = relative_motion(i, r, rows, tables, controls.unchanged, horizon, controls.preferred, within)
        motions.append(motion)
    free, work = choose(motions[which[k]], controls.preferred, settings.dimension, most, within, controls.found)
    robot.work += work
    if free:
        until = max(settings.period, tables.responses.each[r].step)
        response_path(robot, r, controls.found, tables.responses, settings, until, paths, 0)
    return bool(free)
