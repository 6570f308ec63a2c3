"""What guides robots that share the plane: where each heads for, as arrays over all of them."""

from typing import NamedTuple

from slalom.kernels.arrays import Array, Flags


class GuidanceState(NamedTuple):
    """Robots as discs, what they want, and where they head for. It has no part in safety: a target is a wish."""

    position: Array  # (n, 3)
    velocity: Array  # (n, 3)
    radius: Array  # (n,)
    max_speed: Array  # (n,) [m/s]
    goal: Array  # (n, 3)
    goal_tolerance: Array  # (n,)
    goal_stop: Flags  # (n,)
    present: Flags  # (n,)
    waypoint: Array  # (n, 3) the next place on the way to the goal around what rests; the goal itself
    target: Array  # (n, 3) where they head for now: that, or a place beside the way to it
    tolerance: Array  # (n,) [m] how near is enough
    stop: Flags  # (n,) whether to stop there
    waiting_time: Array  # (n,) [s] how long they have stood in vain
    yielding: Array  # (n, 4) where they give way to, until when, and to whom
    arrived: Flags  # (n,)
    visited: Flags  # (n,) whether they have ever arrived
    period: Array  # (2,) [m] after which the world repeats along x and y; 0: it does not
    circle: Array  # (n, 4) what they go around, keeping it on their left: x, y, radius, robots; radius 0: nothing
