"""Vehicles that track the chosen accelerations, with a proven bound on how far they are from where they should be.

The reference is the robot that the navigator decides for: its acceleration in the world frame is constant over each
period dt. A vehicle drives along its heading only. It follows with two inputs that are constant over each period, a
rate of speed and one of turning, chosen such that at the end of the period its velocity is exactly

    v + (a + c) dt,    c = -(e / dt^2 + 3 f / (2 dt)),    e, f: its error of position and velocity at the begin.

In between its velocity goes by speed and angle and not along a straight line, which costs a displacement d per period.
With J a bound on the vehicle's jerk, |d| <= J dt^3 / 12 =: D (linear interpolation, integrated). The feedback c is the
deadbeat one: d is forgotten after two periods, and at the share s of a period the error of position is

    (1 - s^2 / 2) d_1 + (1 - s)^2 / 2 d_2 + at most (3 s^2 - 2 s^3) D    <=    (3 / 2 + sqrt(3) / 18) D

at all times; |f| <= D / dt and |c| <= 2 D / dt^2. See docs/theory.md, section 15, for J and the proof. That a robot
which cannot follow exactly is avoided as a larger one is from Alonso-Mora, Breitenmoser, Rufli, Beardsley and Siegwart,
*Optimal reciprocal collision avoidance for multiple non-holonomic robots*, DARS 2010; that a vehicle's inputs follow
from its path (flatness) from Fliess, Levine, Martin and Rouchon, Int. J. Control 61(6), 1995.

Whoever grows the robot's radius by `tracking_error` and starts the vehicle in the state of the reference has the
vehicle's disc, about the point that is tracked, inside the grown disc at all times.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slalom.checks import Array, Checked, not_negative, number, positive, vector
from slalom.errors import InvalidInput
from slalom.limits import Limits
from slalom.state import State
from slalom.tolerances import REST

WORST_CASE_SHARE = 1.5 + np.sqrt(3.0) / 18.0
"""The largest error of position, in units of the displacement D of one period."""

_GAUSS = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True, eq=False)
class Vehicle:
    """Where a vehicle is in the plane: `position` (2,) [m], `heading` [rad] and `speed` [m/s] >= 0 along it."""

    position: Checked = Checked(vector)
    heading: float  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    speed: float  # type: ignore[misc]

    def __post_init__(self) -> None:
        vector(self.position, "position", 2)
        object.__setattr__(self, "heading", number(self.heading, "heading"))
        object.__setattr__(self, "speed", not_negative(self.speed, "speed"))

    @classmethod
    def on(cls, state: State) -> "Vehicle":
        """A vehicle in a state of the reference (2-D); at rest it faces along the x axis."""
        along = vector(state.velocity, "velocity", 2)
        return cls(state.position, float(np.arctan2(along[1], along[0])), float(np.linalg.norm(along)))

    @property
    def velocity(self) -> Array:
        """(2,) [m/s] in the world frame."""
        return self.speed * np.array([np.cos(self.heading), np.sin(self.heading)])


class Command(NamedTuple):
    """What a vehicle does for a period: rate of speed [m/s^2], and steering angle [rad] or turn rate [rad/s]."""

    speed_rate: float
    turn: float


class _Coefficients(NamedTuple):
    """What bounds the motion in one period (docs/theory.md, section 15)."""

    displacement: float  # D [m]
    acceleration: float  # A' [m/s^2], feedback included
    slowest: float  # v_m [m/s], error included
    turning: float  # by how much an angle exceeds its sine

    def feedback(self, dt: float) -> float:
        """The largest |c| [m/s^2]."""
        return 2.0 * self.displacement / dt**2

    def off_speed(self, dt: float) -> float:
        """The largest |f| [m/s] at the begin of a period."""
        return self.displacement / dt


def _shares(limits: Limits, dt: float, min_speed: float, along_arcs: bool) -> _Coefficients:
    """The least D that includes the feedback that D itself causes.

    For each share eta from a fine ladder: if feedback and error of velocity are at most eta of the acceleration limit
    and of `min_speed`, D follows from eta; the smallest eta whose D keeps that promise is taken.
    """
    most, slowest = limits.max_acceleration, positive(min_speed, "min_speed")
    positive(dt, "dt")
    weight = 3.0 if along_arcs else 2.0
    for eta in np.geomspace(1e-4, 0.5, 128):
        push, least = (1.0 + eta) * most, (1.0 - eta) * slowest
        q = push * dt / least
        if q > 0.5:
            break
        turning = np.arcsin(0.5 * q) / (0.5 * q)
        front = turning * ((1.0 + q) / (1.0 + 0.5 * q) if along_arcs else 1.0)
        jerk = front * push**2 / least * weight**2 / (2.0 * np.sqrt(weight**2 - front**2 * (1.0 + q)))
        found = _Coefficients(float(jerk * dt**3 / 12.0), float(push), float(least), float(turning))
        if found.feedback(dt) <= eta * most and found.off_speed(dt) <= eta * slowest:
            return found
    raise InvalidInput(
        f"min_speed: expected a speed that changes by less than about a third in one period of {dt:g} s at "
        f"{most:g} m/s^2, found {min_speed:g}"
    )


def _target(me: Vehicle, reference: State, acceleration: Array, dt: float) -> tuple[float, float]:
    """The speed at the end of the period, and the angle to turn by until then."""
    positive(dt, "dt")
    own = me.velocity
    off_place = me.position - vector(reference.position, "position of the reference", 2)
    off_speed = own - reference.velocity
    wanted = own + dt * vector(acceleration, "acceleration", 2) - off_place / dt - 1.5 * off_speed
    speed = float(np.linalg.norm(wanted))
    angle = float(np.arctan2(wanted[1], wanted[0])) - me.heading if speed > REST else 0.0
    return speed, float(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


@dataclass(frozen=True)
class Bicycle:
    """A kinematic bicycle, the point between whose rear wheels is tracked: heading rate v tan(steering) / wheelbase.

    Also a car. Its path over a period is an arc of a circle. `wheelbase` [m] > 0, 0 < `max_steering` [rad] < pi / 2.
    """

    wheelbase: float
    max_steering: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "wheelbase", positive(self.wheelbase, "wheelbase"))
        object.__setattr__(self, "max_steering", positive(self.max_steering, "max_steering"))
        if self.max_steering >= 0.5 * np.pi:
            raise InvalidInput(f"max_steering: expected less than pi / 2, found {self.max_steering:g}")

    def tracking_error(self, limits: Limits, dt: float, min_speed: float) -> float:
        """The bound [m] on the distance from the reference, at all times.

        Assumes that the vehicle starts in the state of the reference, whose accelerations obey
        `limits.max_acceleration` and whose speed at the ends of the periods of `dt` [s] is at least `min_speed` [m/s].
        That the steering suffices is ensured by `turning_radius`.

        Raises:
            InvalidInput: a speed so low, or a period so long, that the proof does not hold.
        """
        return float(WORST_CASE_SHARE * _shares(limits, dt, min_speed, True).displacement)

    def turning_radius(self, limits: Limits, dt: float, min_speed: float) -> float:
        """The `least` [m] of a `TurningRadius` in the bounds of the reference with which the steering always suffices.

        Larger than wheelbase / tan(max_steering) by what feedback needs and by what the reference, which holds its
        acceleration while it slows down, bends more at the end of a period than at its begin.

        Raises:
            InvalidInput: as `tracking_error`; or feedback alone may need more than `max_steering`.
        """
        shares = _shares(limits, dt, min_speed, True)
        off, least = shares.off_speed(dt), shares.slowest
        first, second = min_speed / least, 1.0 + (off + shares.acceleration * dt) / least
        middle = 2.0 / (1.0 / first + 1.0 / second)
        angle = shares.turning / np.sqrt(1.0 - (0.5 * shares.acceleration * dt / least) ** 2)
        left = np.tan(self.max_steering) / (self.wheelbase * angle)
        left -= off * limits.max_acceleration / least**3 + shares.feedback(dt) / least**2
        if left <= 0.0:
            raise InvalidInput(
                f"max_steering: expected more than feedback needs at {min_speed:g} m/s, found {self.max_steering:g}"
            )
        return float(first * second * middle / left)

    def command(self, me: Vehicle, reference: State, acceleration: Array, dt: float) -> Command:
        """What to do for `dt` [s] while the reference, now in `reference`, has `acceleration` (2,) [m/s^2].

        Raises:
            InvalidInput: a vehicle that neither moves nor shall, or more steering than it has.
        """
        speed, angle = _target(me, reference, acceleration, dt)
        length = 0.5 * (me.speed + speed) * dt
        if length <= REST * dt:
            raise InvalidInput(f"speed: expected a bicycle that moves, found {me.speed:g} now and {speed:g} next")
        steering = float(np.arctan(self.wheelbase * angle / length))
        if abs(steering) > self.max_steering:
            raise InvalidInput(f"steering: expected at most {self.max_steering:g}, found that {steering:g} is needed")
        return Command((speed - me.speed) / dt, steering)

    def drive(self, me: Vehicle, command: Command, duration: float) -> Vehicle:
        """Where the vehicle is after `duration` [s] of a command: exact."""
        speed = me.speed + duration * command.speed_rate
        length = 0.5 * (me.speed + speed) * duration
        turn = length * np.tan(command.turn) / self.wheelbase
        middle = me.heading + 0.5 * turn
        chord = length * np.sinc(turn / (2.0 * np.pi))
        place = me.position + chord * np.array([np.cos(middle), np.sin(middle)])
        return Vehicle(place, me.heading + turn, max(speed, 0.0))

    def step(self, me: Vehicle, reference: State, acceleration: Array, dt: float) -> Vehicle:
        """The vehicle at the end of the period: `command`, driven."""
        return self.drive(me, self.command(me, reference, acceleration, dt), dt)


@dataclass(frozen=True)
class DifferentialDrive:
    """Two driven wheels `track` [m] apart, none faster than `max_wheel_speed` [m/s]; their middle is tracked.

    The turn rate is constant over a period.
    """

    track: float
    max_wheel_speed: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "track", positive(self.track, "track"))
        object.__setattr__(self, "max_wheel_speed", positive(self.max_wheel_speed, "max_wheel_speed"))

    def tracking_error(self, limits: Limits, dt: float, min_speed: float) -> float:
        """The bound [m] on the distance from the reference, at all times; assumptions as of `Bicycle.tracking_error`.

        Raises:
            InvalidInput: a speed so low, or a period so long, that the proof does not hold; wheels that may have to be
                faster than they can to reach `limits.max_speed` or to turn at `min_speed`.
        """
        shares = _shares(limits, dt, min_speed, False)
        ends = np.array([shares.slowest, limits.max_speed + shares.off_speed(dt)])
        # The sum is convex in the speed.
        wheels = ends + shares.acceleration * (dt + 0.5 * self.track * shares.turning / ends)
        if wheels.max() > self.max_wheel_speed:
            raise InvalidInput(
                f"max_wheel_speed: expected at least {wheels.max():g}, which tracking may need, "
                f"found {self.max_wheel_speed:g}"
            )
        return float(WORST_CASE_SHARE * shares.displacement)

    def command(self, me: Vehicle, reference: State, acceleration: Array, dt: float) -> Command:
        """What to do for `dt` [s] while the reference, now in `reference`, has `acceleration` (2,) [m/s^2].

        Raises:
            InvalidInput: a wheel would have to be faster than it can.
        """
        speed, angle = _target(me, reference, acceleration, dt)
        fastest = max(me.speed, speed) + 0.5 * self.track * abs(angle) / dt
        if fastest > self.max_wheel_speed:
            raise InvalidInput(
                f"wheel: expected at most {self.max_wheel_speed:g} m/s, found that {fastest:g} is needed"
            )
        return Command((speed - me.speed) / dt, angle / dt)

    def drive(self, me: Vehicle, command: Command, duration: float) -> Vehicle:
        """Where the vehicle is after `duration` [s] of a command: to rounding as long as it turns by 2 rad at most."""
        places, weights = _GAUSS
        times = 0.5 * duration * (1.0 + places)
        speeds, angles = me.speed + times * command.speed_rate, me.heading + times * command.turn
        moved = 0.5 * duration * (weights * speeds) @ np.stack([np.cos(angles), np.sin(angles)], axis=1)
        speed = me.speed + duration * command.speed_rate
        return Vehicle(me.position + moved, me.heading + duration * command.turn, max(speed, 0.0))

    def step(self, me: Vehicle, reference: State, acceleration: Array, dt: float) -> Vehicle:
        """The vehicle at the end of the period: `command`, driven."""
        return self.drive(me, self.command(me, reference, acceleration, dt), dt)
