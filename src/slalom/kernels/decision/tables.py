"""The tables from which the decisions of many robots are made."""

from typing import Final, NamedTuple

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices, MaybeCorners, MaybeHulls, Pieces, Segments

EVERY_WORLD = -1
"""The world of a body that is in all of them."""


class ResponseTable(NamedTuple):
    """Responses: position = p + velocity_gain v + acceleration_gain a + gain u, cubic between knots.

    p, v and a are the position, velocity and acceleration at the start, u is the control. The unit of u is that of its
    response, and gains are in m, or m and s, per unit.
    """

    kinds: Indices  # (c + 1,) robots of kind c have the responses kinds[c] to kinds[c + 1]
    first: Indices  # (k + 1,) response r has the pieces first[r] to first[r + 1]
    knots: Array  # (m + k,) [s] those of response r begin at first[r] + r
    velocity_gain: Array  # (m, 4) [s] control points
    acceleration_gain: Array  # (m, 4) [s^2] control points
    gain: Array  # (m, 4) control points
    error: Array  # (k,) [m] largest distance of the motion from its cubic pieces
    settled: Array  # (k,) [s] when the control has been carried out
    rest: Array  # (k,) [s] from when on the robot is at rest under every control; inf: never for certain
    settled_velocity: Array  # (k, 3) at that time: velocity = [0] v + [1] a + [2] u
    initial_acceleration: Array  # (k, 3) at the start: acceleration = [0] v + [1] a + [2] u
    first_peak: Indices  # (k + 1,) response r has the peaks first_peak[r] to first_peak[r + 1]
    peaks: Array  # (p, 5) response, 0 for a velocity or 1 for an acceleration, shares of v and a, gain
    window_gains: Array  # (k, w + 1, 3) gains of v, a and u in the position at the ends of w = RESPONSE_WINDOWS windows
    window_bends: Array  # (k, w, 3) largest difference of these gains from their chord in each window
    ball_bends: Array  # (k, 2 * BALL_WINDOWS + 1, 3) the same on either side of the ends of half windows of balls


class RobotTable(NamedTuple):
    """All robots: states, limits, targets; their committed and their observed paths, cubic over absolute time.

    The shape of a robot is a kind of skeleton, see `GrownBodies`, rounded by `rounding`: the skeleton of a disc is its
    centre.
    """

    position: Array  # (n, 3) [m]
    velocity: Array  # (n, 3) [m/s]
    acceleration: Array  # (n, 3) [m/s^2] applied last
    kind: Indices  # (n,) kind of robot by its responses, see `ResponseTable`
    skeleton: Indices  # (n,) kind of skeleton
    rounding: Array  # (n,) [m] by which the skeleton is rounded
    radius: Array  # (n,) [m] of the bounding ball about the position
    margin: Array  # (n,) [m] to keep from all bodies
    priority: Array  # (n,) > 0: of two robots that share the avoidance, the one with more does less of it
    world: Indices  # (n,) number of the world: robots meet only robots and bodies of their own
    max_speed: Array  # (n,) [m/s]
    max_acceleration: Array  # (n,) [m/s^2]
    braking: Array  # (n,) [m/s^2] deceleration that the bounds allow at any velocity
    target: Array  # (n, 3) [m] now
    tolerance: Array  # (n,) [m] of the target
    stop: Flags  # (n,) whether to stop at the target
    moving: Flags  # (n,) whether the target moves, see `TargetPaths`
    final: Flags  # (n,) whether the target is the goal, to be reached exactly, and no waypoint
    objective: Indices  # (n,) 0 arrive at the target, 1 follow a velocity, 2 follow an acceleration
    wanted: Array  # (n, 3) [m/s or m/s^2] velocity or acceleration to follow
    present: Flags  # (n,)
    committed_times: Array  # (n, p + 1) [s]; the last one is far away
    committed_points: Array  # (n, p, 4, 3) [m]
    observed_times: Array  # (n, q + 1) [s] as other robots predict them
    observed_points: Array  # (n, q, 4, 3) [m]
    ball_centers: Array  # (n, BALL_WINDOWS, 3) [m] bounding balls of the observed path in windows of the horizon
    ball_radii: Array  # (n, BALL_WINDOWS) [m]
    end_position: Array  # (n, 3) [m] observed path at the horizon
    regret: Array  # (n,) [s] lost so far by keeping the manoeuvre
    response: Indices  # (n,) of the committed manoeuvre; -1: none of the tables
    control: Array  # (n, 3) of the committed manoeuvre
    preferred: Array  # (n, 3) the control that its response preferred
    work: Array  # (n,) [us] counted for the last decision
    outcome: Indices  # (n,)


class CellList(NamedTuple):
    """Robots sorted into cells: a robot can meet only those in its own and the neighbouring cells of its world."""

    low: Array  # (d,) [m] corner of the first cell
    width: Array  # (d,) [m]
    counts: Indices  # (d,) cells along each axis, in every world
    first: Indices  # (cells + 1,) cell c has the members first[c] to first[c + 1]
    member: Indices  # (n,)


NO_CELLS: Final = CellList(
    low=np.empty(0),
    width=np.empty(0),
    counts=np.empty(0, np.int64),
    first=np.empty(0, np.int64),
    member=np.empty(0, np.int64),
)
"""In place of a cell list that has not been made."""


class TargetPaths(NamedTuple):
    """Motion of the targets that move, cubic over absolute time; before and after it a target rests.

    The path of robot i has the pieces first[i] to first[i + 1]; knots of its pieces begin at first[i] + i.
    """

    first: Indices  # (n + 1,)
    times: Array  # (m + n,) [s]
    points: Array  # (m, 4, 3) [m]


class Bounds(NamedTuple):
    """Half-spaces normal . x <= offset for the velocity or acceleration x of robots, as they stand now.

    Those of robot i are the rows first[i] to first[i + 1].
    """

    first: Indices  # (n + 1,)
    rows: (
        Array  # (m, 6) 0 for a velocity or 1 for an acceleration; whether it turns with the robot; normal (3,); offset
    )


class GrownBodies(NamedTuple):
    """All bodies that robots with one kind of skeleton can meet, grown by it.

    Passive bodies come as pieces, grown by `robot_rounding` too, see `slalom.obstacle.pieces.Bodies`. The bodies of a
    robot with skeleton k are the rows robot_first[k] to robot_first[k + 1], relative to its position.
    """

    pieces: Pieces
    balls: Array  # (n, 4) [m] centre and radius of a ball that holds the origin of the body, and its radius, on a piece
    body_radius: Array  # (b,) [m]
    hull_radius: Array  # (b,) [m]
    hull: Indices  # (b,) number of the hull, -1 for a point
    uncertain: Flags  # (b,) whether the radius of its pieces holds an uncertainty of its position
    at_rest: Flags  # (b,) whether a contact counts while the robot is at rest
    world: Indices  # (b,) in which the body is; EVERY_WORLD for all
    corners: MaybeCorners  # of passive bodies and of robots
    heads: Indices  # rows with which passive bodies begin that exist now
    end_positions: Array  # (e, d) [m] of the passive obstacles of one part, at the horizon
    end_radii: Array  # (e,) [m] their bounding radii
    end_world: Indices  # (e,) as `world`
    reach: float  # [m] passive bodies near paths that lead farther away from the robot may be left out
    robot_rounding: float  # [m]
    robot_first: Indices  # (s + 1,)
    robot_offset: Array  # (r, 3) [m] origin of the body from the position of the robot
    robot_radius: Array  # (r,) [m]
    robot_hull_radius: Array  # (r,) [m]
    robot_hull: Indices  # (r,)


class DecisionSettings(NamedTuple):
    """Settings that all robots have in common."""

    dimension: int
    now: float  # [s]
    period: float  # [s] until the next decision
    horizon: float  # [s]
    regain: float  # [s] within which a lost margin is to be whole again
    patience: float  # [s]
    share: float  # [1] part of the avoidance between two robots of one priority that a robot does itself
    least_share: float  # [1] the smallest part that any robot does, by its priority
    agrees: bool  # whether two robots that share the avoidance agree on a side to pass on
    shared: bool  # whether robots know each other's committed manoeuvres
    detours: Array  # (k,) [rad] angles by which the desired velocity is turned
    budget: float  # [us] of counted work after which a decision ends if a safe manoeuvre is known


class DecisionTables(NamedTuple):
    """All inputs of a decision except the cell list."""

    robots: RobotTable
    bodies: GrownBodies  # grown by the skeleton of the deciding robots
    responses: ResponseTable
    bounds: Bounds
    targets: TargetPaths
    settings: DecisionSettings


class EncounterTables(NamedTuple):
    """Robots and pieces of bodies for encounters: fewer arrays than `DecisionTables`, to pass them in less time."""

    robots: RobotTable
    bodies: GrownBodies
    settings: DecisionSettings


class Paths(NamedTuple):
    """Paths in cubic pieces over absolute time, one in each row."""

    times: Array  # (n, p + 1) [s]
    points: Array  # (n, p, 4, 3) [m] control points


class ObstaclePieces(NamedTuple):
    """Pieces of the bodies that one robot may meet, passive bodies first; times elapsed, radii with the margin."""

    pieces: Pieces
    margin: Array  # (n, 2) [m] how much of radius and growth is margin
    hull: Indices  # (b,)
    hull_radius: Array  # (b,) [m]
    robot: Indices  # (b,) number of the robot, -1 for a passive body
    balls: Array  # (n, 4) [m] centre and radius of a ball that holds the grown body on a piece; inf: not known
    share: Array  # (b,) [1] part of the avoidance that the robot does itself: 1 where the body does none
    at_rest: Flags  # (b,) whether a contact counts while the robot is at rest


class RelativeMotion(NamedTuple):
    """The admissible set of one robot under one response, and the segments on which its controls can collide."""

    limits: Array  # (l, 5) see `geometry.boundaries`
    table: Segments
    hulls: MaybeHulls


class Scratch(NamedTuple):
    """Buffers for a path that is examined, and for the state in which it ends."""

    paths: Paths  # 2 rows: the path, and the one that cooperating robots must avoid
    centers: Array  # (BALL_WINDOWS, 3) [m] its bounding balls
    radii: Array  # (BALL_WINDOWS,) [m]
    stack: Array  # see `geometry.cubic.new_stack`
    control: Array  # (3,)
    position: Array  # (d,) [m]
    velocity: Array  # (d,) [m/s]
    target: Array  # (3,) [m] position of the target at some time
    target_velocity: Array  # (3,) [m/s]
    displacement: Array  # (d,) [m] to the target
    desired_velocity: Array  # (d,) [m/s]


class ResponseSearch(NamedTuple):
    """Costs and controls of the responses of one robot during one decision, and buffers."""

    scratch: Scratch
    excluded: Flags  # (k,) responses that are not considered
    kept_costs: Array  # (k,) [s] cost of keeping the manoeuvre, judged when response k has settled; inf: not known
    costs: Array  # (k * (1 + detours),) [s] optimistic costs; inf: examined or not computed
    preferred: Array  # (k * (1 + detours), 3) controls
    control: Array  # (3,) of the best manoeuvre found


class Controls(NamedTuple):
    """Controls of one response."""

    preferred: Array  # (3,)
    unchanged: Array  # (3,) the control that changes nothing now: the present velocity, or no acceleration
    found: Array  # (3,) the free control nearest to the preferred one
