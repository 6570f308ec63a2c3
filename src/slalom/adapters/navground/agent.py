"""One agent of navground: the point that it controls, the velocity that it desires, and twists that move the point.

An agent of two driven wheels is controlled at a point ahead of the axle, see `wheels`.
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, sin
from typing import Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np
from navground import core

from slalom import kernels
from slalom.base.checks import Array, positive
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import BRAKING_SHARE
from slalom.model.bounds import HalfSpaces, axes, ball_sides
from slalom.model.limits import Limits
from slalom.model.state import State

# ---------------------------------------------------------------------------------------------------------------------
# Numerical constants of the adapter for navground.


RAMP = 0.3
"""[s] in which an agent reaches its speed, unless its acceleration is given. Larger: slower reactions. Smaller: fleets
that only observe each other keep wider margins."""
LEAD_SHARE = 0.1
"""[1] Distance of the controlled point ahead of the axle as a share of the distance of the wheels. Larger: the point
moves sideways at a larger speed, and the body is grown by more."""
OVERSPEED = 1.1
"""[1] Planned speeds of wheels as a share of those permitted. Larger: plans turn more at once, and the body is grown by
the part that wheels do not follow. 1: they follow all plans."""
ARC_RESERVE = 1.005
"""[1] Speeds of wheels on an arc as a share of those of the straight displacement to the same end. Smaller: wheels
would not follow some displacements exactly. The largest share found is 1.0048, for points 0.1 of the track ahead."""
HOLDS = (0.2, 0.5)
"""[s] Hold times of manoeuvres. Agents of a fleet decide often, so two hold times are sufficient."""
AT_REST = 1e-3
"""[m/s] An agent slower than this turns on the spot. Larger: it turns while it still brakes."""


# ---------------------------------------------------------------------------------------------------------------------
# The motion that two driven wheels can give to a point ahead of their axle (input-output linearisation).
#
# The point moves in every direction (Siciliano, Sciavicco, Villani and Oriolo, *Robotics*, Springer 2009, section
# 11.6).


@dataclass(frozen=True)
class PointAhead:
    """Velocities that the point `lead` [m] ahead can keep while the body turns towards them: a bound of `Limits`.

    Wheels `track` [m] apart that reach `max_wheel_speed` [m/s] permit |v_x| + k |v_y| <= max_wheel_speed, x ahead, with
    k = track / (2 lead). While the point keeps a velocity, the body turns until x is along it. The left side is largest
    where k is the tangent of the angle between both. A velocity can thus be kept if it is in the hull of two sets: the
    right half of the disc about 0 with the radius max_wheel_speed / hypot(1, k), and the largest velocity ahead.
    Backwards there is none. Wheels may be planned OVERSPEED times as fast, see `tracking_error`. Two chords replace the
    arcs.

    Raises:
        InvalidInput: a value that is not above 0.
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    lead: float
    track: float
    max_wheel_speed: float

    def __post_init__(self) -> None:
        for name in ("lead", "track", "max_wheel_speed"):
            positive(getattr(self, name), name)

    @cached_property
    def _sides(self) -> HalfSpaces:
        """Half-spaces in the body frame: the two tangents from the largest velocity, two chords, none backwards."""
        k, fastest = 0.5 * self.track / self.lead, self.max_wheel_speed * OVERSPEED / ARC_RESERVE
        begin, radius = float(np.arctan(k)), fastest / hypot(1.0, k)
        half = 0.5 * (0.5 * np.pi - begin)
        angles = np.array([begin, -begin, begin + half, -begin - half, np.pi])
        offsets = radius * np.array([1.0, 1.0, np.cos(half), np.cos(half), 0.0])
        return np.stack([np.cos(angles), np.sin(angles)], axis=1), offsets

    def half_spaces(self, state: State) -> HalfSpaces:
        normals, offsets = self._sides
        frame = axes(state)
        return ball_sides(float(offsets[2]), 2) if frame is None else (normals @ frame, offsets)

    def tracking_error(self, period: float) -> float:
        """Largest distance [m] of the point from its plan after a `period` [s], with velocities within the bound.

        Where planned wheels are too fast, the kinematics of navground reduce the speed ahead by no more than that.
        """
        return (OVERSPEED - 1.0) * self.max_wheel_speed * period


def arc_of(displacement: Array, lead: float) -> tuple[float, float]:
    """Length [m] of the arc of the axle, and its angle [rad], that displace the point by (2,) [m] in the body frame.

    The change of the direction to the point is across the mean heading, at half the angle: 2 lead sin(angle / 2). The
    chord of the arc is along it. `displacement` is above -2 lead ahead.
    """
    x, y = displacement.tolist()
    half = atan2(y, 2.0 * lead + x)
    chord = x * cos(half) + y * sin(half)
    return chord / float(np.sinc(half / np.pi)), 2.0 * half


# ---------------------------------------------------------------------------------------------------------------------
# One agent of navground: the point that it controls, the velocity that it desires, and twists that move the point.


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
