"""What the decisions of many robots are made from, as arrays."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, Flags, Indices, MaybeHulls

Corners = tuple[Array, Indices, Flags] | tuple[()]
"""corners, first, mixed of hulls: see `slalom.relative_motion`; empty where all bodies are points."""
COOPERATION_RANGE = 0.3
"""[1] Robots nearer to each other than this share of the sum of their radii avoid each other in full, not in part."""
REST_DURATION = 1e6
"""[s] How long a robot at rest is seen to stay."""


WINDOWS = 6
"""[1] Into how many parts the horizon is cut for the balls of `windows`; more are tighter and cost more to test."""


class ResponseTable(NamedTuple):
    """Responses as tables: position = p + place v + gain u, cubic between knots."""

    kinds: Indices  # (c + 1,) robots of kind c have the responses kinds[c] to kinds[c + 1]
    first: Indices  # (k + 1,) response r has the pieces first[r] to first[r + 1]
    knots: Array  # (m + k,) [s] those of response r begin at first[r] + r
    velocity_gain: Array  # (m, 4) [s]
    gain: Array  # (m, 4)
    settled: Array  # (k,) [s]
    settled_velocity: Array  # (k, 2) at that time: velocity = aim[0] v + aim[1] u
    peaks: Array  # (p, 4): response, 0 for a velocity or 1 for an acceleration, share of v, gain
    cuts: Indices  # (k + 1,) response r has the parts of pieces, cut at windows, cuts[r] to cuts[r + 1]
    window: Indices  # (c,)
    cut_velocity_gain: Array  # (c, 4)
    cut_gain: Array  # (c, 4)


class RobotTable(NamedTuple):
    """All robots, and what they are committed to and seen to do: cubic pieces over absolute times."""

    position: Array  # (n, 3)
    velocity: Array  # (n, 3)
    acceleration: Array  # (n, 3) the acceleration applied last
    kind: Indices  # (n,) which responses they have
    radius: Array  # (n,)
    max_speed: Array  # (n,) [m/s]
    max_acceleration: Array  # (n,) [m/s^2]
    target: Array  # (n, 3) where they head for
    tolerance: Array  # (n,) [m] how near is enough
    stop: Flags  # (n,) whether to stop there
    present: Flags  # (n,)
    committed_times: Array  # (n, p + 1) of their own courses; the last time is far away
    committed_points: Array  # (n, p, 4, 3)
    observed_times: Array  # (n, q + 1) as others see them
    observed_points: Array  # (n, q, 4, 3)
    ball_centers: Array  # (n, WINDOWS, 3) balls that hold what is seen of them during windows of the horizon
    ball_radii: Array  # (n, WINDOWS) their radii
    end_position: Array  # (n, 3) where they are seen to be at its end
    regret: Array  # (n,) [s]
    response: Indices  # (n,) -1: none of the tables
    control: Array  # (n, 3)
    outcome: Indices  # (n,)


class CellList(NamedTuple):
    """Robots sorted into cells; who is not in a cell about one's own cannot be met. And what each of them may do."""

    low: Array  # (d,) the corner of the first cell
    width: Array  # (d,)
    counts: Indices  # (d,)
    first: Indices  # (cells + 1,) in cell c are the members first[c] to first[c + 1]
    member: Indices  # (n,)
    reachable_centers: Array  # (n, WINDOWS, 3) balls that hold all that each of those who decide may do during windows
    reachable_radii: Array  # (n, WINDOWS) their radii


class PassiveObstacles(NamedTuple):
    """Passive obstacles grown by a robot of radius `grown`: see `traffic.Bodies`."""

    times: Array
    points: Array
    radius: Array
    growth: Array
    turns: Array
    body: Indices
    body_radius: Array
    hull_radius: Array
    hull: Indices
    corners: Corners
    heads: Indices
    end_positions: Array  # (e, d) where obstacles of one part are in the end
    end_radii: Array  # (e,)
    robot_radius: float


class DecisionSettings(NamedTuple):
    """How all decide."""

    dimension: int
    now: float
    period: float
    horizon: float
    margin: float
    regain: float  # [s] within which a margin that is lost is to be whole again
    patience: float
    share: float  # of the avoidance between two robots that a robot does itself
    shared: bool
    detours: Array  # [rad] detours


class ObstaclePieces(NamedTuple):
    """What one robot meets: pieces of bodies, times elapsed."""

    times: Array
    points: Array
    radius: Array
    growth: Array
    turns: Array
    body: Indices
    margin: Array  # (n, 2) [m] how much of radius and growth is margin
    hull: Indices  # (b,)
    hull_radius: Array  # (b,)
    cooperates: Flags  # (b,) whether it avoids the robot too


class RelativeMotion(NamedTuple):
    """What one robot may meet under one response: the admissible set, and segments as in `slalom.relative_motion`."""

    limits: Array
    points: Array
    gains: Array
    radius: Array
    growth: Array
    bounding_radius: Array
    hulls: MaybeHulls


class Scratch(NamedTuple):
    """Room for a course that is thought of, and for where it leads."""

    times: Array  # (2, p + 1) a table: the course, and what of it those see that avoid the robot too
    points: Array  # (2, p, 4, 3)
    centers: Array  # (WINDOWS, 3) balls that hold it
    radii: Array  # (WINDOWS,)
    stack: Array  # see `bezier.new_stack`
    control: Array  # (3,)
    position: Array  # (d,)
    velocity: Array  # (d,)
    displacement: Array  # (d,)
    desired_velocity: Array  # (d,)
