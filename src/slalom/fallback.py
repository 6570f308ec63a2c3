"""Decisions without a safe manoeuvre: latest collision, least impact speed, or separation from overlapped obstacles."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome, made
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Situation
from slalom.obstacle_window import ObstacleWindow
from slalom.selection import select
from slalom.shape import Shape
from slalom.tolerances import LATEST_COLLISION


def latest_collision(
    situations: Sequence[Situation],
    preferred_controls: Sequence[Array],
    robot: Shape,
    period: float,
    obstacle_window: ObstacleWindow,
) -> Decision:
    """Decision with the latest predicted collision.

    Among collisions within one `period` [s] of the latest, the one with the least impact speed.

    Args:
        situations: one for each response, in the same state.
        preferred_controls: the preferred control (d,) of each situation.
        robot: its shape.
        obstacle_window: the predicted obstacles.
    """
    options = []
    for s, preferred in zip(situations, preferred_controls):
        blocked = ControlObstacle(s.response, s.state, obstacle_window, robot)
        low, high, control = 0.0, s.horizon, None
        while high - low > LATEST_COLLISION * period:
            middle = 0.5 * (low + high)
            choice = select(preferred, s.admissible, replace(blocked, horizon=middle))
            if choice.control is None:
                high = middle
            else:
                low, control = middle, choice.control
        if control is not None:
            speed = impact_speed(blocked, control)
            options.append((low, speed, Manoeuvre(s.response, s.state, control, s.now), preferred, blocked))
    latest = max((option[0] for option in options), default=0.0)
    if latest < period:
        return least_impact(situations[0], robot, period, obstacle_window)
    equal = [option for option in options if option[0] >= latest - period]
    _, _, manoeuvre, preferred, blocked = min(equal, key=lambda option: option[1])
    return Decision(manoeuvre, Outcome.DELAYED, preferred, made(blocked))


def impact_speed(blocked: ControlObstacle, control: Array) -> float:
    """Relative speed [m/s] at the first collision under `control` (d,); 0 without one."""
    times = blocked.times_to_collision(control)
    first = int(np.argmin(times))
    if not np.isfinite(times[first]):
        return 0.0
    own = blocked.response.velocity(blocked.state, times[first])(control)
    other = blocked.obstacles.obstacles[first].trajectory.velocity(blocked.obstacles.start + float(times[first]))
    return float(np.linalg.norm(own - other))


def least_impact(s: Situation, robot: Shape, period: float, obstacle_window: ObstacleWindow) -> Decision:
    """Decision for a collision within this period: match the velocity of the obstacle that is hit first."""
    blocked = ControlObstacle(s.response, s.state, obstacle_window, robot)
    times = blocked.times_to_collision(np.zeros(s.state.dimension))
    preferred, outcome = np.zeros(s.state.dimension), Outcome.INADMISSIBLE
    alone = ControlObstacle(s.response, s.state, ObstacleWindow((), s.now, s.horizon), robot)
    if select(preferred, s.admissible, alone).safe:
        outcome = Outcome.IMPACT
    if np.any(np.isfinite(times)):
        first = int(np.argmin(times))
        other = obstacle_window.obstacles[first].trajectory.velocity(s.now + float(times[first]))
        preferred = s.response.velocity(s.state, period).inverse(other)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, robot, alone.obstacles), s.now)
    return Decision(manoeuvre, outcome, preferred, made(blocked))


def escape(s: Situation, robot: Shape, period: float, blocked: ControlObstacle) -> Decision:
    """Decision of a robot that overlaps obstacles: separate as fast as the limits allow.

    The control is also clear of all other obstacles if possible.
    """
    overlapped = [blocked.obstacles.obstacles[index].trajectory for index in blocked.overlapping]
    directions = [blocked.escape_direction(int(index)) for index in blocked.overlapping]
    direction = np.mean(directions, axis=0)
    if np.linalg.norm(direction) < 1e-6:
        # Overlaps on opposite sides cancel: leave sideways, where both distances grow.
        axis = np.eye(s.state.dimension)[int(np.argmin(np.abs(directions[0])))]
        direction = axis - (axis @ directions[0]) * directions[0]
    obstacle_velocity = np.mean([trajectory.velocity(s.now) for trajectory in overlapped], axis=0)
    desired_velocity = obstacle_velocity + s.limits.max_speed * direction / np.linalg.norm(direction)
    preferred = s.response.velocity(s.state, period).inverse(desired_velocity)
    others = blocked.obstacles.without(blocked.overlapping)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, robot, others), s.now)
    return Decision(manoeuvre, Outcome.ESCAPING, preferred, made(blocked))


def nearest(preferred: Array, s: Situation, robot: Shape, others: ObstacleWindow) -> Array:
    """Admissible control (d,) nearest to `preferred`, clear of `others` if possible.

    If no control is admissible, a compromise between the limits.
    """
    for obstacles in (others, ObstacleWindow((), s.now, s.horizon)):
        blocked = ControlObstacle(s.response, s.state, obstacles, robot)
        choice = select(preferred, s.admissible, blocked)
        if choice.control is not None:
            return choice.control
    return s.admissible.compromise(preferred)
