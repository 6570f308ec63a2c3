"""What a robot does when nothing is safe: collide as late as possible, then as softly; and leave what it overlaps."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Situation
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.selection import select
from slalom.shape import Shape


def latest_collision(
    situations: Sequence[Situation], wishes: Sequence[Array], robot: Shape, period: float, traffic: ObstacleTable
) -> Decision:
    """The latest collision; among equals (within one `period` [s]) the least impact speed.

    `wishes` are the preferred controls, one for each situation.
    """
    options = []
    for s, preferred in zip(situations, wishes):
        blocked = ControlObstacle(s.response, s.state, traffic, robot)
        low, high, control = 0.0, s.horizon, None
        while high - low > 0.1 * period:
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
        return least_impact(situations[0], robot, period, traffic)
    equal = [option for option in options if option[0] >= latest - period]
    _, _, manoeuvre, preferred, blocked = min(equal, key=lambda option: option[1])
    return Decision(manoeuvre, Outcome.DELAYED, preferred, blocked)


def impact_speed(blocked: ControlObstacle, control: Array) -> float:
    """Relative speed [m/s] at the first collision under `control`; 0 without one."""
    times = blocked.times_to_collision(control)
    first = int(np.argmin(times))
    if not np.isfinite(times[first]):
        return 0.0
    own = blocked.response.velocity(blocked.state, times[first])(control)
    other = blocked.obstacles.obstacles[first].trajectory.velocity(blocked.obstacles.start + float(times[first]))
    return float(np.linalg.norm(own - other))


def least_impact(s: Situation, robot: Shape, period: float, traffic: ObstacleTable) -> Decision:
    """A collision within this period: approach the velocity of what will be hit first."""
    blocked = ControlObstacle(s.response, s.state, traffic, robot)
    times = blocked.times_to_collision(np.zeros(s.state.dimension))
    preferred, outcome = np.zeros(s.state.dimension), Outcome.INADMISSIBLE
    alone = ControlObstacle(s.response, s.state, ObstacleTable((), s.now, s.horizon), robot)
    if select(preferred, s.admissible, alone).safe:
        outcome = Outcome.IMPACT
    if np.any(np.isfinite(times)):
        first = int(np.argmin(times))
        other = traffic.obstacles[first].trajectory.velocity(s.now + float(times[first]))
        preferred = s.response.velocity(s.state, period).inverse(other)
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, robot, []), s.now)
    return Decision(manoeuvre, outcome, preferred, blocked)


def escape(s: Situation, robot: Shape, period: float, blocked: ControlObstacle) -> Decision:
    """Apart from what is overlapped, as fast as the limits allow, and clear of everything else if possible."""
    overlapped = [blocked.obstacles.obstacles[index].trajectory for index in blocked.overlapping]
    aways = [blocked.escape_direction(int(index)) for index in blocked.overlapping]
    away = np.mean(aways, axis=0)
    if np.linalg.norm(away) < 1e-6:
        # Squeezed from opposite sides: out sideways, where both grow more distant.
        axis = np.eye(s.state.dimension)[int(np.argmin(np.abs(aways[0])))]
        away = axis - (axis @ aways[0]) * aways[0]
    carried = np.mean([trajectory.velocity(s.now) for trajectory in overlapped], axis=0)
    wanted = carried + s.limits.max_speed * away / np.linalg.norm(away)
    preferred = s.response.velocity(s.state, period).inverse(wanted)
    others = [o for i, o in enumerate(blocked.obstacles.obstacles) if i not in blocked.overlapping]
    manoeuvre = Manoeuvre(s.response, s.state, nearest(preferred, s, robot, others), s.now)
    return Decision(manoeuvre, Outcome.ESCAPING, preferred, blocked)


def nearest(preferred: Array, s: Situation, robot: Shape, others: Sequence[Obstacle]) -> Array:
    """The admissible control nearest to `preferred`, clear of `others` if possible; a compromise if none is."""
    for avoided in (others, ()):
        blocked = ControlObstacle(s.response, s.state, ObstacleTable(avoided, s.now, s.horizon), robot)
        choice = select(preferred, s.admissible, blocked)
        if choice.control is not None:
            return choice.control
    return s.admissible.compromise(preferred)
