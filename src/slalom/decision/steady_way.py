"""Ways of robots in the plane that must not stop: shortest paths to a place with a turning circle (Dubins)."""

from math import acos, atan2, cos, hypot, pi, sin, sqrt
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.state import State

TURN_SHARE: Final = 0.9
"""[1] Share of its largest rate at which a robot that must not stop plans to turn at its least speed. Larger: shorter
ways; a robot that turns a little more slowly misses its goal, and flies a circle more. Smaller: longer ways."""

BEHIND: Final = 0.5 * pi
"""[rad] A robot that must not stop and has to turn by more than this on its way to a goal follows that way. Larger: it
is misled by costs of motion without turning circles. Smaller: it moves at its least speed for longer."""


class SteadyWay(NamedTuple):
    """The shortest path from a heading to a place, with a least radius and any heading there."""

    first: float  # [rad] angle of the first turn, left positive
    turned: float  # [rad] sum of the angles of all turns
    straight: float  # [m]


def steady_way(x: float, y: float, r: float) -> SteadyWay:
    """The shortest path of least radius r [m] from the origin, along x, to the place (x, y) [m].

    It turns towards the place and goes straight on. To a place inside the turning circle on that side it turns to the
    other side, and then straight on or on a circle back (Dubins, American Journal of Mathematics 79, 1957).
    """
    side = 1.0 if y >= 0.0 else -1.0
    y = abs(y)
    if hypot(x, y - r) >= r:
        turned, straight = _tangent(x, y, r)
        return SteadyWay(side * turned, turned, straight)
    turned, straight = _tangent(x, -y, r)
    ways = [SteadyWay(-side * turned, turned, straight)]
    # The centre of the second circle is 2 r away from that of the first turn, and r away from the place.
    far, bearing = hypot(x, y + r), atan2(y + r, x)
    opening = acos(min((far * far + 3.0 * r * r) / (4.0 * r * far), 1.0))
    for sign in (-1.0, 1.0):
        first = _positive(0.5 * pi - bearing - sign * opening)
        to_end = atan2(y + r - 2.0 * r * cos(first), x - 2.0 * r * sin(first))
        ways.append(SteadyWay(-side * first, first + _positive(to_end + 0.5 * pi + first), 0.0))
    return min(ways, key=lambda way: way.turned * r + way.straight)


def _tangent(x: float, y: float, r: float) -> tuple[float, float]:
    """Angle [rad] of a left turn of radius r [m] after which the way to (x, y) is straight, and the length of that."""
    straight = sqrt(max(x * x + (y - r) ** 2 - r * r, 0.0))
    return _positive(atan2(y - r, x) + atan2(r, straight)), straight


def _positive(angle: float) -> float:
    """The angle [rad] in [0, 2 pi); 0 for one that rounding makes a little negative."""
    angle %= 2.0 * pi
    return angle if angle < 2.0 * pi - 1e-9 else 0.0


def velocity_along(state: State, goal: Goal, limits: Limits, now: float) -> Array | None:
    """Velocity (2,) [m/s] of a robot that must not stop on its steady way to a goal that is not ahead; else None.

    The least speed, along the present heading turned as the way begins, by at most a right angle. A goal is ahead if
    all turns of the way are at most BEHIND.
    """
    least, rate = limits.steady_turn(state.dimension)
    speed = hypot(*state.velocity)
    if goal.stop or rate == 0.0 or speed == 0.0:
        return None
    away, heading = goal.interception_point(state.position, now, limits) - state.position, state.velocity / speed
    left = np.array([-heading[1], heading[0]])
    way = steady_way(float(away @ heading), float(away @ left), least / (TURN_SHARE * rate))
    if way.turned <= BEHIND:
        return None
    turn = min(max(way.first, -BEHIND), BEHIND)
    return np.asarray(least * (cos(turn) * heading + sin(turn) * left))
