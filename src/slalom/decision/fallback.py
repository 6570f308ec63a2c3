"""Decisions that the policy leaves open: least impact within a period, or separation from overlapped obstacles."""

import numpy as np

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.decision.decision import Decision, Outcome, made
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Situation
from slalom.obstacle.window import ObstacleWindow
from slalom.selection import select
from slalom.shape import Shape
from slalom.tolerances import AT_REST


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
        other = obstacle_window.obstacle(first).trajectory.velocity(s.now + float(times[first]))
        preferred = s.response.velocity(s.state, period).inverse(other)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, robot, alone.obstacles), s.now)
    return Decision(manoeuvre, outcome, preferred, made(blocked))


def escape(s: Situation, robot: Shape, period: float, blocked: ControlObstacle) -> Decision:
    """Decision of a robot that overlaps obstacles: separate as fast as the limits allow.

    The control is also clear of all other obstacles if possible.
    """
    overlapped = [blocked.obstacles.obstacle(int(index)).trajectory for index in blocked.overlapping]
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


def stop(s: Situation, robot: Shape, obstacle_window: ObstacleWindow) -> Decision:
    """Decision of a robot that may be touched at rest and must not move into contact: rest, or brake hardest."""
    preferred = s.response.velocity(s.state, s.response.settled(s.horizon)).inverse(np.zeros(s.state.dimension))
    outcome = Outcome.STOPPING if float(np.linalg.norm(s.state.velocity)) <= AT_REST else Outcome.BRAKING
    control = nearest(preferred, s, robot, ObstacleWindow((), s.now, s.horizon))
    blocked = ControlObstacle(s.response, s.state, obstacle_window, robot)
    return Decision(Manoeuvre(s.response, s.state, control, s.now), outcome, preferred, made(blocked))


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
