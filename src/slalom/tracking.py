"""Vehicles that track the chosen accelerations, with a proven bound on the tracking error.

The reference is the robot for which the navigator decides: its acceleration in the world frame is constant over each
period dt. A vehicle moves along its heading only. Its two inputs, the rate of speed and the turn rate (or steering
angle), are constant over each period. They are chosen such that the velocity of the vehicle at the end of the period is
exactly

    v + (a + c) dt,    c = -(e / dt^2 + 3 f / (2 dt)),    e, f: its errors of position and velocity at the start.

Within the period the velocity is linear in speed and angle, not in its components, which displaces the vehicle by d.
With J a bound on the vehicle's jerk, |d| <= J dt^3 / 12 =: D (linear interpolation, integrated). The feedback c is
deadbeat: d has no effect after two periods. At the fraction s of a period the error of position is

    (1 - s^2 / 2) d_1 + (1 - s)^2 / 2 d_2 + at most (3 s^2 - 2 s^3) D    <=    (3 / 2 + sqrt(3) / 18) D

at all times; |f| <= D / dt and |c| <= 2 D / dt^2. See docs/theory.md, section 15, for J and the proof. Sources:
avoidance of inexact tracking by larger radii is from Alonso-Mora, Breitenmoser, Rufli, Beardsley and Siegwart, *Optimal
reciprocal collision avoidance for multiple non-holonomic robots*, DARS 2010. The inputs of a vehicle follow from its
path (flatness): Fliess, Levine, Martin and Rouchon, Int. J. Control 61(6), 1995.

Law: let the vehicle start in the state of the reference. The disc about the reference, grown by `tracking_error`, then
contains the vehicle's disc about the tracked point at all times.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slalom.base.checks import Array, Checked, NotNegative, Number, Positive, check_fields, positive, vector
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST
from slalom.model.limits import Limits
from slalom.model.state import State

WORST_CASE_SHARE = 1.5 + np.sqrt(3.0) / 18.0
"""[1] Largest error of position, in units of the displacement D of one period."""

_GAUSS_RULE = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True, eq=False)
class Vehicle:
    """State of a vehicle in the plane.

    `position` (2,) [m], `heading` [rad], and `speed` [m/s] >= 0 along the heading.
    """

    position: Checked = Checked(vector)
    heading: Number  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    speed: NotNegative  # type: ignore[misc]  # the same

    def __post_init__(self) -> None:
        vector(self.position, "position", 2)
        check_fields(self)

    @classmethod
    def on(cls, state: State) -> "Vehicle":
        """Vehicle in a state of the reference (2-D); a vehicle at rest is headed along the x axis."""
        velocity = vector(state.velocity, "velocity", 2)
        return cls(state.position, float(np.arctan2(velocity[1], velocity[0])), float(np.linalg.norm(velocity)))

    @property
    def velocity(self) -> Array:
        """Velocity (2,) [m/s] in the world frame."""
        return self.speed * np.array([np.cos(self.heading), np.sin(self.heading)])


class Command(NamedTuple):
    """Inputs for one period: rate of speed [m/s^2], and steering angle [rad] or turn rate [rad/s]."""

    speed_rate: float
    turn: float


class _MotionBounds(NamedTuple):
    """Bounds on the motion in one period (docs/theory.md, section 15)."""

    displacement: float  # displacement D [m]
    acceleration: float  # A' [m/s^2], including feedback
    min_speed: float  # v_m [m/s], including the error
    angle_factor: float  # [1] largest ratio of an angle to its sine

    def feedback(self, dt: float) -> float:
        """Largest |c| [m/s^2]."""
        return 2.0 * self.displacement / dt**2

    def velocity_error(self, dt: float) -> float:
        """Largest |f| [m/s] at the start of a period."""
        return self.displacement / dt


def _motion_bounds(limits: Limits, dt: float, min_speed: float, along_arcs: bool) -> _MotionBounds:
    """Bounds with the least D that includes the feedback caused by D itself.

    Candidates for eta are spaced geometrically. D follows from eta if feedback and velocity error are at most eta times
    the acceleration limit and eta times `min_speed`. The result is that of the smallest eta whose D satisfies this
    assumption.

    Raises:
        InvalidInput: no eta satisfies it.
    """
    max_acceleration, min_speed_checked = limits.max_acceleration, positive(min_speed, "min_speed")
    positive(dt, "dt")
    weight = 3.0 if along_arcs else 2.0
    for eta in np.geomspace(1e-4, 0.5, 128):
        acceleration, lowest_speed = (1.0 + eta) * max_acceleration, (1.0 - eta) * min_speed_checked
        q = acceleration * dt / lowest_speed
        if q > 0.5:
            break
        turning = np.arcsin(0.5 * q) / (0.5 * q)
        factor = turning * ((1.0 + q) / (1.0 + 0.5 * q) if along_arcs else 1.0)
        jerk = factor * acceleration**2 / lowest_speed * weight**2 / (2.0 * np.sqrt(weight**2 - factor**2 * (1.0 + q)))
        bounds = _MotionBounds(float(jerk * dt**3 / 12.0), float(acceleration), float(lowest_speed), float(turning))
        if bounds.feedback(dt) <= eta * max_acceleration and bounds.velocity_error(dt) <= eta * min_speed_checked:
            return bounds
    raise InvalidInput(
        f"min_speed: expected a speed that changes by less than about a third in one period of {dt:g} s at "
        f"{max_acceleration:g} m/s^2, found {min_speed:g}"
    )


def _target(vehicle: Vehicle, reference: State, acceleration: Array, dt: float) -> tuple[float, float]:
    """Speed [m/s] at the end of the period, and the angle [rad] to turn by until then."""
    positive(dt, "dt")
    velocity = vehicle.velocity
    position_error = vehicle.position - vector(reference.position, "position of the reference", 2)
    velocity_error = velocity - reference.velocity
    target_velocity = (
        velocity + dt * vector(acceleration, "acceleration", 2) - position_error / dt - 1.5 * velocity_error
    )
    speed = float(np.linalg.norm(target_velocity))
    angle = float(np.arctan2(target_velocity[1], target_velocity[0])) - vehicle.heading if speed > REST else 0.0
    return speed, float(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


@dataclass(frozen=True)
class Bicycle:
    """A kinematic bicycle, the point between whose rear wheels is tracked: heading rate v tan(steering) / wheelbase.

    Also a car. Its path over a period is an arc of a circle. `wheelbase` [m] > 0, 0 < `max_steering` [rad] < pi / 2.
    """

    wheelbase: Positive
    max_steering: Positive

    def __post_init__(self) -> None:
        check_fields(self)
        if self.max_steering >= 0.5 * np.pi:
            raise InvalidInput(f"max_steering: expected less than pi / 2, found {self.max_steering:g}")

    def tracking_error(self, limits: Limits, dt: float, min_speed: float) -> float:
        """Bound [m] on the distance from the reference, at all times.

        Assumes that the vehicle starts in the state of the reference. The accelerations of the reference must obey
        `limits.max_acceleration`, and its speed at the ends of the periods of `dt` [s] must be at least `min_speed`
        [m/s]. `turning_radius` ensures that the steering suffices.

        Raises:
            InvalidInput: a speed so low, or a period so long, that the proof does not hold.
        """
        return float(WORST_CASE_SHARE * _motion_bounds(limits, dt, min_speed, True).displacement)

    def turning_radius(self, limits: Limits, dt: float, min_speed: float) -> float:
        """Radius [m] for a `TurningRadius` bound of the reference with which the steering always suffices.

        Larger than wheelbase / tan(max_steering), for two reasons. One is the feedback. The other is a reference that
        holds its acceleration while it slows down, so that its curvature grows during a period.

        Raises:
            InvalidInput: as `tracking_error`; or the feedback alone may need more than `max_steering`.
        """
        bounds = _motion_bounds(limits, dt, min_speed, True)
        velocity_error, min_reference_speed = bounds.velocity_error(dt), bounds.min_speed
        first, second = (
            min_speed / min_reference_speed,
            1.0 + (velocity_error + bounds.acceleration * dt) / min_reference_speed,
        )
        mean = 2.0 / (1.0 / first + 1.0 / second)
        angle = bounds.angle_factor / np.sqrt(1.0 - (0.5 * bounds.acceleration * dt / min_reference_speed) ** 2)
        max_curvature = np.tan(self.max_steering) / (self.wheelbase * angle)
        max_curvature -= (
            velocity_error * limits.max_acceleration / min_reference_speed**3
            + bounds.feedback(dt) / min_reference_speed**2
        )
        if max_curvature <= 0.0:
            raise InvalidInput(
                f"max_steering: expected more than feedback needs at {min_speed:g} m/s, found {self.max_steering:g}"
            )
        return float(first * second * mean / max_curvature)

    def command(self, vehicle: Vehicle, reference: State, acceleration: Array, dt: float) -> Command:
        """Inputs for `dt` [s] while the reference, now in `reference`, has `acceleration` (2,) [m/s^2].

        Raises:
            InvalidInput: a vehicle at rest that shall stay at rest, or a required steering angle above `max_steering`.
        """
        speed, angle = _target(vehicle, reference, acceleration, dt)
        length = 0.5 * (vehicle.speed + speed) * dt
        if length <= REST * dt:
            raise InvalidInput(f"speed: expected a bicycle that moves, found {vehicle.speed:g} now and {speed:g} next")
        steering = float(np.arctan(self.wheelbase * angle / length))
        if abs(steering) > self.max_steering:
            raise InvalidInput(f"steering: expected at most {self.max_steering:g}, found that {steering:g} is needed")
        return Command((speed - vehicle.speed) / dt, steering)

    def drive(self, vehicle: Vehicle, command: Command, duration: float) -> Vehicle:
        """State of the vehicle after `duration` [s] under a command: exact."""
        speed = vehicle.speed + duration * command.speed_rate
        length = 0.5 * (vehicle.speed + speed) * duration
        turn = length * np.tan(command.turn) / self.wheelbase
        middle = vehicle.heading + 0.5 * turn
        chord = length * np.sinc(turn / (2.0 * np.pi))
        position = vehicle.position + chord * np.array([np.cos(middle), np.sin(middle)])
        return Vehicle(position, vehicle.heading + turn, max(speed, 0.0))

    def step(self, vehicle: Vehicle, reference: State, acceleration: Array, dt: float) -> Vehicle:
        """State of the vehicle at the end of the period under `command`."""
        return self.drive(vehicle, self.command(vehicle, reference, acceleration, dt), dt)


@dataclass(frozen=True)
class DifferentialDrive:
    """Two driven wheels `track` [m] apart, with speeds of at most `max_wheel_speed` [m/s]; their midpoint is tracked.

    The turn rate is constant over a period.
    """

    track: Positive
    max_wheel_speed: Positive

    def __post_init__(self) -> None:
        check_fields(self)

    def tracking_error(self, limits: Limits, dt: float, min_speed: float) -> float:
        """Bound [m] on the distance from the reference, at all times; assumptions as in `Bicycle.tracking_error`.

        Raises:
            InvalidInput: a speed so low, or a period so long, that the proof does not hold; wheels too slow for
                `limits.max_speed` or for turning at `min_speed`.
        """
        bounds = _motion_bounds(limits, dt, min_speed, False)
        ends = np.array([bounds.min_speed, limits.max_speed + bounds.velocity_error(dt)])
        # The sum is convex in the speed: its maximum is at an end.
        wheels = ends + bounds.acceleration * (dt + 0.5 * self.track * bounds.angle_factor / ends)
        if wheels.max() > self.max_wheel_speed:
            raise InvalidInput(
                f"max_wheel_speed: expected at least {wheels.max():g}, which tracking may need, "
                f"found {self.max_wheel_speed:g}"
            )
        return float(WORST_CASE_SHARE * bounds.displacement)

    def command(self, vehicle: Vehicle, reference: State, acceleration: Array, dt: float) -> Command:
        """Inputs for `dt` [s] while the reference, now in `reference`, has `acceleration` (2,) [m/s^2].

        Raises:
            InvalidInput: a required wheel speed above `max_wheel_speed`.
        """
        speed, angle = _target(vehicle, reference, acceleration, dt)
        fastest = max(vehicle.speed, speed) + 0.5 * self.track * abs(angle) / dt
        if fastest > self.max_wheel_speed:
            raise InvalidInput(
                f"wheel: expected at most {self.max_wheel_speed:g} m/s, found that {fastest:g} is needed"
            )
        return Command((speed - vehicle.speed) / dt, angle / dt)

    def drive(self, vehicle: Vehicle, command: Command, duration: float) -> Vehicle:
        """State of the vehicle after `duration` [s] under a command; exact to rounding for turns of at most 2 rad."""
        nodes, weights = _GAUSS_RULE
        times = 0.5 * duration * (1.0 + nodes)
        speeds, angles = vehicle.speed + times * command.speed_rate, vehicle.heading + times * command.turn
        displacement = 0.5 * duration * (weights * speeds) @ np.stack([np.cos(angles), np.sin(angles)], axis=1)
        speed = vehicle.speed + duration * command.speed_rate
        return Vehicle(vehicle.position + displacement, vehicle.heading + duration * command.turn, max(speed, 0.0))

    def step(self, vehicle: Vehicle, reference: State, acceleration: Array, dt: float) -> Vehicle:
        """State of the vehicle at the end of the period under `command`."""
        return self.drive(vehicle, self.command(vehicle, reference, acceleration, dt), dt)
