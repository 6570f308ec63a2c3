"""The tables from which the decisions of many robots are made."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, Flags, Indices, MaybeCorners, MaybeHulls, Pieces, Segments


class ResponseTable(NamedTuple):
    """Responses: position = p + velocity_gain v + gain u, cubic between knots, for p, v at the start and control u."""

    kinds: Indices  # (c + 1,) robots of kind c have the responses kinds[c] to kinds[c + 1]
    first: Indices  # (k + 1,) response r has the pieces first[r] to first[r + 1]
    knots: Array  # (m + k,) [s] those of response r begin at first[r] + r
    velocity_gain: Array  # (m, 4) [s] control points
    gain: Array  # (m, 4) control points
    settled: Array  # (k,) [s] when the control has been carried out
    settled_velocity: Array  # (k, 2) at that time: velocity = [0] v + [1] u
    peaks: Array  # (p, 4) response, 0 for a velocity or 1 for an acceleration, share of v, gain
    cuts: Indices  # (k + 1,) response r has the parts of pieces, cut at windows, cuts[r] to cuts[r + 1]
    window: Indices  # (c,) window of each part
    cut_velocity_gain: Array  # (c, 4) [s]
    cut_gain: Array  # (c, 4)


class RobotTable(NamedTuple):
    """All robots: states, limits, targets; their committed and their observed paths, cubic over absolute time."""

    position: Array  # (n, 3) [m]
    velocity: Array  # (n, 3) [m/s]
    acceleration: Array  # (n, 3) [m/s^2] applied last
    kind: Indices  # (n,) which responses they have
    radius: Array  # (n,) [m]
    max_speed: Array  # (n,) [m/s]
    max_acceleration: Array  # (n,) [m/s^2]
    target: Array  # (n, 3) [m]
    tolerance: Array  # (n,) [m] of the target
    stop: Flags  # (n,) whether to stop at the target
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
    outcome: Indices  # (n,)


class CellList(NamedTuple):
    """Robots sorted into cells: a robot can meet only those in its own and the neighbouring cells."""

    low: Array  # (d,) [m] corner of the first cell
    width: Array  # (d,) [m]
    counts: Indices  # (d,) cells along each axis
    first: Indices  # (cells + 1,) cell c has the members first[c] to first[c + 1]
    member: Indices  # (n,)
    reachable_centers: Array  # (n, BALL_WINDOWS, 3) [m] bounding balls of the reachable set of each deciding robot
    reachable_radii: Array  # (n, BALL_WINDOWS) [m]


class PassiveObstacles(NamedTuple):
    """Passive obstacles grown by a robot of radius `robot_radius`, see `slalom.obstacle_pieces.Bodies`."""

    pieces: Pieces
    body_radius: Array  # (b,) [m]
    hull_radius: Array  # (b,) [m]
    hull: Indices  # (b,) number of the hull, -1 for a point
    corners: MaybeCorners
    heads: Indices  # rows with which bodies begin that exist now
    end_positions: Array  # (e, d) [m] of the obstacles of one part, at the horizon
    end_radii: Array  # (e,) [m] their bounding radii
    robot_radius: float  # [m]


class DecisionSettings(NamedTuple):
    """Settings that all robots have in common."""

    dimension: int
    now: float  # [s]
    period: float  # [s] until the next decision
    horizon: float  # [s]
    margin: float  # [m]
    regain: float  # [s] within which a lost margin is to be whole again
    patience: float  # [s]
    share: float  # [1] part of the avoidance between two robots that a robot does itself
    shared: bool  # whether robots know each other's committed manoeuvres
    detours: Array  # (k,) [rad] angles by which the desired velocity is turned


class DecisionTables(NamedTuple):
    """Everything from which a decision is made but the cell list."""

    robots: RobotTable
    passive: PassiveObstacles
    responses: ResponseTable
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
    cooperates: Flags  # (b,) whether the body is a robot that does its share of the avoidance


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
    displacement: Array  # (d,) [m] to the target
    desired_velocity: Array  # (d,) [m/s]


class ResponseSearch(NamedTuple):
    """What is known of the responses of one robot during one decision, and buffers."""

    scratch: Scratch
    kept_costs: Array  # (k,) [s] cost of keeping the manoeuvre, judged when response k has settled; inf: not known
    costs: Array  # (k * (1 + detours),) [s] optimistic costs; inf: examined or not computed
    control: Array  # (3,) of the best manoeuvre found


class Controls(NamedTuple):
    """Controls of one response."""

    preferred: Array  # (3,)
    unchanged: Array  # (3,) the control that changes nothing now: the present velocity or acceleration
    found: Array  # (3,) the free control nearest to the preferred one
