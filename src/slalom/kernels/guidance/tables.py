"""Tables of the guidance of n robots that share the plane."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, Flags, Indices


class GuidanceState(NamedTuple):
    """Robots as discs, their goals and their targets.

    It has no part in safety: the decision keeps clear of all bodies with any target.
    """

    position: Array  # (n, 3) [m]
    velocity: Array  # (n, 3) [m/s]
    radius: Array  # (n,) [m]
    max_speed: Array  # (n,) [m/s]
    goal: Array  # (n, 3) [m]
    goal_tolerance: Array  # (n,) [m]
    goal_stop: Flags  # (n,) whether the robot stops at its goal
    present: Flags  # (n,)
    waypoint: Array  # (n, 3) [m] next waypoint of the path around obstacles at rest; the goal if it is in sight
    target: Array  # (n, 3) [m] the waypoint, a point beside a traffic circle, or a point off another robot's path
    tolerance: Array  # (n,) [m] distance from the target that counts as reached
    stop: Flags  # (n,) whether the robot stops at its target
    waiting_time: Array  # (n,) [s] time for which the robot has been blocked
    yielding: Array  # (n, 4) point to yield to (x, y) [m], end of yielding [s], number of the robot to yield to
    arrived: Flags  # (n,)
    visited: Flags  # (n,) whether the robot has ever arrived
    circle: Array  # (n, 4) traffic circle, passed counterclockwise: centre x, y [m], radius [m], robots; radius 0: none


class Grid(NamedTuple):
    """Clearance to obstacles at rest at the centres of square cells: origin + width (a, b) for cell (a, b)."""

    origin: Array  # (2,) [m]
    width: float  # [m]
    clearance: Array  # (nx, ny) [m]; inf without obstacles
    passage: Array  # (nx, ny) [m] an upper bound of the clearance on ways across each cell


class PathSearch(NamedTuple):
    """Memory of searches on one grid: new memory takes longer than a search.

    The queue is a list per bucket of estimates: `latest` has the last entry of each bucket. Estimates repeat after as
    many buckets as there are, which is more than one move can add.
    """

    lengths: Array  # (nx * ny,) [cell] inf: not reached
    following: Indices  # (nx * ny,) the next cell on the path to the goal, where it is reached
    latest: Indices  # (buckets,) -1: empty


class RobotRows(NamedTuple):
    """Robots as columns, over which loops run on vector registers, with the workspace of the filter."""

    columns: Array  # (6, n) x, y [m], velocity x, y [m/s], radius [m] (NaN: absent), speed [m/s]
    possible: Flags  # (n,) result of the last test
    candidates: Indices  # (n,) numbers of the robots that passed the last test
