"""One agent of navground: the point that it controls, the velocity that it desires, and twists that move the point.

An agent of two driven wheels is controlled at a point ahead of the axle, see `wheels`.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from navground import core

from slalom import kernels
from slalom.adapters.navground.tolerances import LEAD_SHARE, RAMP
from slalom.adapters.navground.wheels import PointAhead, arc_of
from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.limits import Limits
from slalom.tolerances import BRAKING_SHARE

TWO_WHEELS = "2WDiff"
"""Type of the kinematics of two driven wheels."""


class Agent(Protocol):
    """The used members of a behaviour of navground with the properties of `SlalomFleet`."""

    method: str
    max_acceleration: float
    time_horizon: float
    keep_right: float
    lead: float
    world_period: Any
    radius: float
    safety_margin: float
    position: Any
    velocity: Any
    orientation: float
    optimal_speed: float
    optimal_angular_speed: float
    target: Any
    kinematics: Any
    values: dict[str, Any]

    def get_environment_state(self) -> Any:
        """The observed surroundings of the agent."""

    def feasible_twist(self, twist: core.Twist2) -> core.Twist2:
        """The twist nearest to `twist` that the kinematics permit."""

    def twist_towards_velocity(self, velocity: Any) -> core.Twist2:
        """The twist that moves the centre at `velocity` (2,) [m/s]."""

    def cmd_twist_towards_orientation(self, orientation: float, speed: float, dt: float) -> core.Twist2:
        """The twist of the next `dt` [s] towards an orientation [rad], at most at `speed` [rad/s]."""

    def cmd_twist_towards_angular_speed(self, speed: float, dt: float) -> core.Twist2:
        """The twist of the next `dt` [s] towards a turn rate `speed` [rad/s]."""


class Motion(NamedTuple):
    """Limits of the motion of an agent, for its centre or for a point ahead, about which it is larger."""

    lead: float  # [m] of the controlled point ahead of the centre
    limits: Limits  # of the point
    growth: float  # [m] of the body about the point


def speed_of(member: Agent) -> float:
    """Desired speed [m/s]: that of the target, or the optimal one."""
    speed = member.optimal_speed if member.target.speed is None else member.target.speed
    return float(min(speed, member.kinematics.max_speed))


def motion_of(member: Agent, period: float) -> Motion:
    """Limits of the motion of an agent, with decisions every `period` [s].

    The body is grown by the lead, by the error of following, and by the error of the motion within a period. That is
    the distance between the plan, with constant acceleration, and the motion by a constant twist.

    Raises:
        InvalidInput: kinematics that are neither omnidirectional nor of two driven wheels.
    """
    kinematics = member.kinematics
    fastest = float(kinematics.max_speed)
    acceleration = float(member.max_acceleration) or min(speed_of(member), fastest) / RAMP
    within = acceleration * period * period / 8.0
    if kinematics.dof() == 3:
        return Motion(0.0, Limits(fastest, acceleration), within)
    if kinematics.type != TWO_WHEELS:
        expected = f"omnidirectional ones or {TWO_WHEELS}"
        raise InvalidInput(f"kinematics: expected {expected}, found {kinematics.type}")
    track = float(kinematics.wheel_axis)
    bound = PointAhead(float(member.lead) or LEAD_SHARE * track, track, fastest)
    limits = Limits(fastest, acceleration, bounds=(bound,))
    return Motion(bound.lead, limits, bound.lead + bound.tracking_error(period) + within)


def point_of(member: Agent, lead: float) -> Array:
    """Controlled point (2,) [m]."""
    return np.asarray(np.asarray(member.position, np.float64) + lead * _axes(member)[0])


def _axes(member: Agent) -> Array:
    """Unit vectors (2, 2) ahead and to the left."""
    cosine, sine = np.cos(member.orientation), np.sin(member.orientation)
    return np.array([[cosine, sine], [-sine, cosine]])


def desired_velocity(member: Agent, velocity: Array, step: float, braking: float) -> Array:
    """Velocity (2,) [m/s] towards the target, turned to the right; 0 for an agent that stops.

    It is longer by as much as the turn takes of its part towards the target. Near a place it is the velocity to have
    after `step` [s], from which the agent comes to rest there, see `slalom.Goal.desired_velocity`.

    Args:
        velocity: (2,) [m/s] of the controlled point. braking: [m/s^2] by which it may stop.
    """
    target, way = member.target, np.zeros(2)
    if target.position is not None:
        offset = np.asarray(target.position, np.float64) - np.asarray(member.position, np.float64)
        left = offset - 0.5 * step * velocity
        distance = float(np.linalg.norm(left))
        speed = float(kernels.stopping_speed(distance, step, BRAKING_SHARE * braking))
        if speed < speed_of(member):
            within = np.linalg.norm(offset) < target.position_tolerance and distance < target.position_tolerance
            return np.zeros(2) if within else left * (speed / distance)
        way = offset if np.linalg.norm(offset) >= target.position_tolerance else way
    elif target.direction is not None:
        way = np.asarray(target.direction, np.float64)
    length, turn = float(np.linalg.norm(way)), np.tan(member.keep_right)
    return speed_of(member) / length * np.array([way[0] + turn * way[1], way[1] - turn * way[0]]) if length else way


def twist(member: Agent, velocity: Array, lead: float, dt: float) -> core.Twist2:
    """Twist of the next `dt` [s] that displaces the controlled point by `dt` times `velocity` (2,) [m/s]."""
    if not lead:
        wanted = member.twist_towards_velocity(velocity)
        # The twist is held in the frame of the body: about the mean heading the displacement is the wanted one.
        half = 0.5 * dt * wanted.angular_speed
        cosine, sine = np.cos(half), np.sin(half)
        x, y = _axes(member) @ velocity / float(np.sinc(half / np.pi))
        turned = (float(cosine * x + sine * y), float(cosine * y - sine * x))
        return member.feasible_twist(core.Twist2(turned, wanted.angular_speed, core.Frame.relative))
    length, angle = arc_of(dt * (_axes(member) @ velocity), lead)
    return member.feasible_twist(core.Twist2((length / dt, 0.0), angle / dt, core.Frame.relative))


def turn(member: Agent, dt: float) -> core.Twist2:
    """Twist of an agent at rest, which may turn to an orientation."""
    target = member.target
    speed = member.optimal_angular_speed if target.angular_speed is None else target.angular_speed
    if target.orientation is not None:
        return member.cmd_twist_towards_orientation(target.orientation, speed, dt)
    if target.orientation is None and target.angular_speed is not None:
        return member.cmd_twist_towards_angular_speed(speed, dt)
    return core.Twist2((0.0, 0.0), 0.0, core.Frame.relative)
