"""Appearance of robots during a run: each waits until its place is free.

A robot appears at the first decision, at or after its time, at which it and all others can stop without contact. To
stop, a robot keeps its velocity for one period and then brakes. Robots that share their manoeuvres continue these
instead, and moving obstacles move on until the robot has stopped. All distances are at least the margin. Obstacles at
rest do not count: they never leave. Robots that have waited longest appear first, those of one time by their names.
"""

from collections.abc import Sequence

import numpy as np

from slalom.choice.control_obstacle import ControlObstacle
from slalom.forecast.linear import piecewise_polynomial
from slalom.model.manoeuvre import Manoeuvre, first_manoeuvre
from slalom.model.state import State
from slalom.model.trajectory import PiecewisePolynomial
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.sim.run.deciders import Decider, FleetDecider
from slalom.sim.scenario import Robot, Scenario


def let_appear(decider: Decider, now: float) -> None:
    """Let the robots appear at `now` [s] whose time has come and whose place is free."""
    for k in decider.states.due(now):
        if _is_free(decider, k, now):
            decider.states.appear(k, now)


def _is_free(decider: Decider, k: int, now: float) -> bool:
    """Whether robot k and all others can stop without contact if it appears at `now` [s]."""
    states, scenario = decider.states, decider.states.scenario
    own, place = scenario.robots[k], scenario.robots[k].state.position
    stop, margin = _stop(scenario, own, own.state, now), scenario.margin_of(k)
    lasts = _duration(stop)
    near, margins = list[Obstacle](), list[float]()
    for j in np.flatnonzero(states.present).tolist():
        other, each = scenario.robots[j], max(margin, scenario.margin_of(j))
        reach = own.shape.bounding_radius + other.shape.bounding_radius + each
        reach += scenario.horizon * (own.limits.max_speed + other.limits.max_speed)
        if np.linalg.norm(states.state(j).position - place) > reach:
            continue
        path = None if states.appeared[j] == now else _committed(decider, j)
        if path is None:
            braking = _stop(scenario, other, states.state(j), now)
            lasts = max(lasts, _duration(braking))
            path = _path(braking, now, lasts)
        near.append(Obstacle(other.shape, path, other.name, after_end="continues"))
        margins.append(each)
    moving = [o for o in scenario.obstacles if not o.at_rest and o.exists(now)]
    return _clear(own, stop, near, margins, max(scenario.horizon, lasts)) and _clear(
        own, stop, moving, [margin] * len(moving), _duration(stop)
    )


def _clear(own: Robot, stop: Manoeuvre, others: Sequence[Obstacle], margins: Sequence[float], duration: float) -> bool:
    """Whether a robot that stops keeps its `margins` [m] from others for a duration [s]."""
    if not others:
        return True
    window = ObstacleWindow(others, stop.start, duration)
    blocked = ControlObstacle(stop.response, own.state, window, own.shape, np.array(margins), duration)
    return not blocked.overlaps and not blocked.contains(stop.control)


def _stop(scenario: Scenario, robot: Robot, state: State, now: float) -> Manoeuvre:
    return first_manoeuvre(state, robot.limits, scenario.dt * scenario.steps_per_decision, now)


def _duration(stop: Manoeuvre) -> float:
    """The duration [s] of a manoeuvre that ends at rest."""
    return float(stop.response.knots(np.inf, 1.0)[-2])


def _path(stop: Manoeuvre, now: float, duration: float) -> PiecewisePolynomial:
    path = stop.path(now, now + duration)
    return piecewise_polynomial(path.times, path.points)


def _committed(decider: Decider, k: int) -> PiecewisePolynomial | None:
    """The committed path of a robot that shares its manoeuvres; None for others."""
    if not isinstance(decider, FleetDecider) or not decider.fleet.members.methods[k].shared:
        return None
    committed, d = decider.fleet.table.committed, decider.scenario.dimension
    return piecewise_polynomial(committed.times[k], committed.points[k, ..., :d])
