"""The tables from which the decisions of many robots are made."""

import ctypes
from typing import Annotated, Final, NamedTuple

import numpy as np

from slalom.kernels.arrays import (
    Array,
    Bodies,
    ControlPoints,
    Flags,
    Indices,
    MaybeHulls,
    Pieces,
    Records,
    Segments,
    Vector,
    record_type,
)

RESPONSE_WINDOWS: Final = 48
"""[1] Windows of the horizon in which the motion under one response is bounded; a multiple of 2 BALL_WINDOWS. Larger:
fewer pieces of obstacles are tested for a response, at more cost of the bounds. Smaller: the contrary."""

BALL_WINDOWS: Final = 6
"""[1] Windows of the horizon, each with a bounding ball of every observed path and reachable set. Larger: tighter balls
that cost more to test. Smaller: more robots that cannot be met are examined."""


class TabulatedResponse:
    """One response: position = p + velocity_gain v + acceleration_gain a + gain u, cubic between knots.

    p, v and a are the position, velocity and acceleration at the start, u is the control. The unit of u is that of its
    response, and gains are in m, or m and s, per unit.
    """

    error: float  # [m] largest distance of the motion from its cubic pieces
    settled: float  # [s] when the control has been carried out
    step: float  # [s] when it is judged: settled, or one period if the next control may replace it without a loss
    shortest: float  # [s] the least `step` of the responses of this kind of robot
    rest: float  # [s] from when on the robot is at rest under every control; inf: never for certain
    brakes: bool  # whether the robot brakes once the control has been carried out
    straight: int  # first of its pieces from which on the robot moves along one line, see `PositionMap`
    settled_velocity: Vector  # after that step: velocity = [0] v + [1] a + [2] u
    initial_acceleration: Vector  # at the start: acceleration = [0] v + [1] a + [2] u
    window_gains: Annotated[Array, (RESPONSE_WINDOWS + 1, 3)]  # of v, a, u in the position at ends of windows
    window_bends: Annotated[Array, (RESPONSE_WINDOWS, 3)]  # largest difference from their chord in each window
    ball_bends: Annotated[Array, (2 * BALL_WINDOWS + 1, 3)]  # the same on either side of ends of half windows of balls


class ResponsePiece:
    """Control points of the gains of a response between two knots."""

    velocity_gain: ControlPoints  # [s]
    acceleration_gain: ControlPoints  # [s^2]
    gain: ControlPoints


class ResponseTable(NamedTuple):
    """All responses, their pieces and peaks."""

    each: Records[TabulatedResponse]  # (k,)
    pieces: Records[ResponsePiece]  # (m,)
    kinds: Indices  # (c + 1,) robots of kind c have the responses kinds[c] to kinds[c + 1]
    first: Indices  # (k + 1,) response r has the pieces first[r] to first[r + 1]
    knots: Array  # (m + k,) [s] those of response r begin at first[r] + r
    first_peak: Indices  # (k + 1,) response r has the peaks first_peak[r] to first_peak[r + 1]
    peaks: Array  # (p, 5) response, 0 for a velocity or 1 for an acceleration, shares of v and a, gain


class Robot:
    """One robot: state, limits, target, committed control.

    Its shape is a kind of skeleton, see `RobotBodies`, rounded by `rounding`: the skeleton of a disc is its centre.
    """

    position: Vector  # [m]
    velocity: Vector  # [m/s]
    acceleration: Vector  # [m/s^2] applied last
    kind: int  # kind of robot by its responses, see `ResponseTable`
    skeleton: int  # kind of skeleton
    rounding: float  # [m] by which the skeleton is rounded
    radius: float  # [m] of the bounding ball about the position
    margin: float  # [m] to keep from passive bodies
    margin_among: float  # [m] to keep from other robots
    enough: float  # [m] the last part of both margins: the robot keeps as much of it as it can, without `SQUEEZED`
    priority: float  # > 0: of two robots that share the avoidance, the one with more does less of it
    world: int  # number of the world: robots meet only robots and bodies of their own
    rank: int  # of two robots the one of lower rank has the right of way, see `Claims`
    max_speed: float  # [m/s]
    max_acceleration: float  # [m/s^2]
    braking: float  # [m/s^2] deceleration that the bounds allow at any velocity
    stopping: float  # [m/s^2] with which it plans to stop at its target, see `decision.tables.stopping_deceleration`
    target: Vector  # [m] now
    tolerance: float  # [m] of the target
    stop: bool  # whether to stop at the target
    moving: bool  # whether the target moves, see `TargetPaths`
    final: bool  # whether the target is the goal, to be reached exactly, and no waypoint
    objective: int  # its number, see ARRIVE
    wanted: Vector  # [m/s or m/s^2] velocity or acceleration to follow
    present: bool
    ball_centers: Annotated[
        Array, (BALL_WINDOWS, 3)
    ]  # [m] bounding balls of the observed path in windows of the horizon
    ball_radii: Annotated[Array, (BALL_WINDOWS,)]  # [m]
    end_position: Vector  # [m] observed path at the horizon
    settled: float  # [s] absolute, when the control of the committed manoeuvre is carried out; inf: not committed
    resting: bool  # whether its committed manoeuvre rests: as it was planned, not as the state is measured
    response: int  # of the committed manoeuvre; -1: none of the tables
    control: Vector  # of the committed manoeuvre
    preferred: Vector  # the control that its response preferred
    work: float  # [us] counted for the last decision
    outcome: int


class Paths(NamedTuple):
    """Paths in cubic pieces over absolute time, one in each row."""

    times: Array  # (n, p + 1) [s]
    points: Array  # (n, p, 4, 3) [m] control points


class RobotTable(NamedTuple):
    """All robots, their committed paths, and their paths as other robots predict them."""

    each: Records[Robot]  # (n,)
    committed: Paths  # the last time is far away
    observed: Paths


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


class RobotBody:
    """A part of a robot, grown by the robots with one kind of skeleton."""

    offset: Vector  # [m] origin of the body from the position of the robot
    radius: float  # [m]
    hull_radius: float  # [m]


class ObstacleAtHorizon:
    """An obstacle of one part at the horizon: a ball, or in the plane corners in positive order."""

    position: Vector  # [m] centre of the ball
    moved: Vector  # [m] its displacement since the decision
    radius: float  # [m] of the ball; with corners: by which their hull is rounded
    ball: float  # [m] radius of the bounding ball about the position
    filled: bool  # whether the obstacle fills much of that ball
    first: int  # its corners are the rows first to last of `AtHorizon.corners`; as many as 0 for a ball
    last: int
    world: int  # as of `Body`


class AtHorizon(NamedTuple):
    """Obstacles at the horizon, from which the costs of detours are estimated."""

    each: Records[ObstacleAtHorizon]  # (e,)
    corners: Array  # (c, 4) [m] x, y of each corner and the unit vector from the centre of its hull to it


class RobotBodies(NamedTuple):
    """The bodies of all robots, as robots with one kind of skeleton meet them: grown by it.

    Those of a robot with skeleton k are the rows first[k] to first[k + 1], relative to its position.
    """

    first: Indices  # (s + 1,)
    each: Records[RobotBody]  # (r,)
    hull: Indices  # (r,) number of its hull among those of the obstacles, -1 for a point
    rounding: float  # [m] of the skeleton, by which bodies of obstacles are grown too


class DecisionSettings(NamedTuple):
    """Settings that all robots have in common."""

    dimension: int
    now: float  # [s]
    period: float  # [s] until the next decision
    horizon: float  # [s]
    regain: float  # [s] within which a lost margin is to be whole again
    patience: float  # [1] share of the time until the next change that keeping a manoeuvre may cost
    share: float  # [1] part of the avoidance between two robots of one priority that a robot does itself
    least_share: float  # [1] the smallest part that any robot does, by its priority
    agrees: bool  # whether two robots that share the avoidance agree on a side to pass on
    stops_at_obstacles: bool  # whether observed robots are predicted to stop at passive bodies at rest
    shared: bool  # whether robots know each other's committed manoeuvres
    detours: Array  # (k,) [rad] angles by which the desired velocity is turned
    early: bool  # whether responses that brake count only where no other has a free control
    held_up: bool  # whether costs count the ways around passive obstacles with their bends; if not, around their balls
    budget: float  # [us] of counted work after which a decision ends if a safe manoeuvre is known


ARRIVE = 0
FOLLOW_VELOCITY = 1
FOLLOW_ACCELERATION = 2
MIXED = 3
"""Objectives by number. MIXED has parts of the first three, see `Objectives`."""

CALLBACK: Final = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_int64)
"""The type of a function that kernels call with the number of candidates; its answer means nothing."""


class Objectives(NamedTuple):
    """The parts of a mixed objective, and what kernels exchange with an objective that is written in Python."""

    kind: Indices  # (k,) the number of each part
    weight: Array  # (k,) their sum is 1
    wanted: Array  # (k, 3) [m/s or m/s^2] velocity or acceleration to follow
    address: int  # of the function that writes the `costs` by an objective in Python, see CALLBACK; 0: none
    preferred: Array  # (r, 3) the controls that it prefers, of each response; (0, 3): the parts prefer
    paths: Paths  # (q, ...) the motions of candidates
    until: Array  # (q,) [s] after now, from when on each keeps its velocity
    costs: Array  # (q,) [s] by the parts; as answers by the objective


NO_OBJECTIVES: Final = Objectives(
    kind=np.empty(0, np.int64),
    weight=np.empty(0),
    wanted=np.empty((0, 3)),
    address=0,
    preferred=np.empty((0, 3)),
    paths=Paths(np.empty((0, 0)), np.empty((0, 0, 4, 3))),
    until=np.empty(0),
    costs=np.empty(0),
)
"""For robots whose objectives have no parts."""


ASIDE = np.array(
    [
        *[(1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)],
        *[(-1.0, 1.0, 0.0), (-1.0, -1.0, 0.0), (1.0, 0.0, 1.0), (1.0, 0.0, -1.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)],
        *[(-1.0, 0.0, 1.0), (-1.0, 0.0, -1.0)],
    ]
)
"""Directions of `ways_aside` by their shares of three axes: straight off the way, along it, and the third in space."""


class Claims(NamedTuple):
    """Ways of robots that are held up: each robot of higher rank leaves them."""

    first: Indices  # (w + 1,) those in world w are the rows first[w] to first[w + 1]
    position: Array  # (c, 3) [m] beginning of the way
    way: Array  # (c, 3) [m] from there to its end
    width: Array  # (c,) [m] half of it, without the radius of the robot that leaves it
    rank: Indices  # (c,) of the robot that is held up


NO_CLAIMS: Final = Claims(
    first=np.zeros(1, np.int64),
    position=np.empty((0, 3)),
    way=np.empty((0, 3)),
    width=np.empty(0),
    rank=np.empty(0, np.int64),
)
"""Where no robot has the right of way."""


class DecisionTables(NamedTuple):
    """All inputs of a decision except the cell list."""

    robots: RobotTable
    bodies: Bodies  # of obstacles, grown by the skeleton of the deciding robots; corners of robots follow their own
    robot_bodies: RobotBodies  # grown by the same
    at_horizon: AtHorizon
    responses: ResponseTable
    bounds: Bounds
    targets: TargetPaths
    settings: DecisionSettings
    objectives: Objectives
    claims: Claims


class MetBody:
    """A body that one robot may meet."""

    hull_radius: float  # [m]
    error: float  # [m] of its pieces and of those of the deciding robot
    robot: int  # number of the robot, -1 for a passive body
    share: float  # [1] part of the avoidance that the deciding robot does itself: 1 where the body does none
    at_rest: bool  # whether a contact counts while the deciding robot is at rest


MET_BODY: Final = record_type(MetBody)


class ObstaclePieces(NamedTuple):
    """Pieces of the bodies that one robot may meet, passive bodies first; times elapsed, radii with the margin."""

    pieces: Pieces
    margin: Array  # (n, 2) [m] how much of radius and growth is margin
    balls: Array  # (n, 4) [m] centre and radius of a ball that holds the grown body on a piece; inf: not known
    bodies: Records[MetBody]  # (b,)
    hull: Indices  # (b,) number of the hull, -1 for a point


class SelectionProblem(NamedTuple):
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
    kept_costs: Array  # (k,) [s] cost of keeping the manoeuvre instead of changing to response k; inf: not known
    delays: Array  # (k,) [s] loss by a change to response k after the manoeuvre that is kept; inf: not known
    costs: Array  # (k * (1 + detours + m),) [s] optimistic costs; inf: examined or not computed
    preferred: Array  # (k * (1 + detours + m), 3) controls
    control: Array  # (3,) of the best manoeuvre found
    added: Array  # (2,) [s] by an objective in Python to the cost of the committed manoeuvre, and of the best candidate
    aside: Array  # (m, 3) unit vectors off the way that the robot has to leave; none if it covers none


class Controls(NamedTuple):
    """Controls of one response."""

    preferred: Array  # (3,)
    unchanged: Array  # (3,) the control that changes nothing now: the present velocity, or no acceleration
    found: Array  # (3,) the free control nearest to the preferred one
