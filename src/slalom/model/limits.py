"""The limits of a robot as a set of controls: the admissible set."""

from dataclasses import dataclass, field
from functools import cached_property
from math import sqrt
from typing import Protocol

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import (
    STATE,
    Array,
    Checked,
    CheckedFields,
    Positive,
    check_fields,
    has,
    listing,
    number,
    positive,
    unit,
    vector,
    vectors,
)
from slalom.base.tolerances import ADMISSIBLE
from slalom.model.bounds import Bound, HalfSpaces, LeastSpeed, ball_sides
from slalom.model.state import Affine, State
from slalom.model.uncertainty import Uncertainty


@dataclass(frozen=True, eq=False)
class Admissible:
    """A convex set of controls: the intersection of balls and half-spaces.

    {u: |u - centers[i]| <= radii[i], normals[j] . u <= offsets[j]}, with unit normals. It must be bounded by at
    least one ball when `select` uses it.
    """

    centers: Array
    radii: Array
    normals: Array
    offsets: Array

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.centers.shape[1])

    @property
    def largest(self) -> float:
        """An upper bound of the norms of all controls in the set; inf without a ball."""
        return float((np.linalg.norm(self.centers, axis=1) + self.radii).min(initial=np.inf))

    def excess(self, controls: npt.ArrayLike) -> Array:
        """By how much controls (..., d) leave the set, (...): the largest signed distance to a boundary."""
        u = vectors(controls, "controls", self.dimension)
        outside = np.linalg.norm(u[..., None, :] - self.centers, axis=-1) - self.radii
        beyond = u @ self.normals.T - self.offsets
        return np.asarray(np.concatenate([outside, beyond], axis=-1).max(axis=-1))

    def holds(self, controls: Array) -> npt.NDArray[np.bool_]:
        """Whether controls (n, d), taken as they are, are in the set without any tolerance: (n,)."""
        inside = kernels.in_balls(controls, self.centers, self.radii)
        if len(self.offsets):
            inside &= (controls @ self.normals.T <= self.offsets).all(axis=1)
        return inside

    def contains(self, controls: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether controls (..., d) are in the set, up to the relative tolerance ADMISSIBLE."""
        scale = 1.0 + np.concatenate([self.radii, np.abs(self.offsets)]).max(initial=0.0)
        return np.asarray(self.excess(controls) <= ADMISSIBLE * scale)

    def toward(self, control: Array) -> Array:
        """The point nearest to `control` (d,) of the smallest ball, in which all controls of the set are."""
        k = int(self.radii.argmin())
        away = control - self.centers[k]
        length = sqrt(away.dot(away))
        return control if length <= self.radii[k] else np.asarray(self.centers[k] + away * (self.radii[k] / length))

    def compromise(self, control: Array) -> Array:
        """A control for when no control is in the set: projected on one boundary after the other, the last ball last.

        In the sets that `Limits` makes the last ball is the acceleration limit: that one is obeyed.
        """
        for _ in range(100):
            for normal, offset in zip(self.normals, self.offsets):
                control = control - max(0.0, float(normal @ control) - offset) * normal
            for center, radius in zip(self.centers, self.radii):
                away = control - center
                control = center + away * min(1.0, radius / max(float(np.linalg.norm(away)), 1e-300))
        return control

    @cached_property
    def table(self) -> Array:
        """`rows`, made once and not to be written to."""
        return self.rows()

    def rows(self) -> Array:
        """The boundaries as the kernels take them, (n, 5), see `kernels/geometry/boundaries.py`."""
        balls, flats = len(self.radii), len(self.offsets)
        rows = np.zeros((balls + flats, 5))
        rows[:balls, 0] = -1.0
        rows[:balls, 1 : 1 + self.dimension] = self.centers
        rows[:balls, 4] = self.radii
        if flats:
            rows[balls:, 1 : 1 + self.dimension] = self.normals
            rows[balls:, 4] = self.offsets
        return rows


def admissible_ball(center: npt.ArrayLike, radius: float) -> Admissible:
    """The controls within `radius` > 0 of `center` (d,)."""
    middle = vector(center, "center")
    return Admissible(middle[None], np.array([positive(radius, "radius")]), np.empty((0, middle.size)), np.empty(0))


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """The vectors x with normal . x <= offset; `normal` (d,) of any length but 0."""

    normal: Checked = Checked(vector)
    offset: float  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor

    def __post_init__(self) -> None:
        normal, length = unit(self.normal, "normal")
        object.__setattr__(self, "normal", normal)
        object.__setattr__(self, "offset", number(self.offset, "offset") / length)


class Limited(Protocol):
    """The maps of the control that limits bound for a response, see `response.Response`."""

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps whose norms bound the speed."""

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        """Maps whose norms bound the acceleration."""

    def settled(self, horizon: float) -> float:
        """Time [s] at which the control has had its effect on the velocity."""


@dataclass(frozen=True)
class Limits:
    """Limits of a robot: the maximum speed [m/s] and acceleration [m/s^2], both Euclidean norms, and bounds.

    `velocity_bounds` and `acceleration_bounds` are half-spaces in which the velocity and the acceleration must stay.
    `bounds` are sets that depend on the state (see `slalom.model.bounds`): friction ellipse, box, polygon, heading
    cone, turning radius, least speed.

    Guarantee of bounds in the frame of the body. Acceleration and velocity along the predicted motion are in the set
    *as it is at the decision*. So is the acceleration at the decision. While a control is held the body turns and the
    set with it, so the later motion may leave the set of its own time. A navigator tests `allows` at every decision and
    keeps no manoeuvre that has left it. The applied acceleration is therefore always in the set of that decision,
    unless the outcome states that no control is.

    Raises:
        InvalidInput: a limit that is not above 0.
    """

    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: tuple[HalfSpace, ...] = field(default=())
    acceleration_bounds: tuple[HalfSpace, ...] = field(default=())
    bounds: tuple[Bound, ...] = field(default=())

    def __post_init__(self) -> None:
        check_fields(self)
        for name, members, expected in _BOUNDS:
            given = getattr(self, name)
            listing(given, "a tuple of bounds", name)
            for k, bound in enumerate(given):
                has(bound, members, expected, f"{name}[{k}]")

    @property
    def braking(self) -> float:
        """The deceleration [m/s^2] that the robot can reach at any speed and heading, by its `bounds`."""
        return min([self.max_acceleration, *(bound.braking for bound in self.bounds)])

    def time_to_react(self, error: Uncertainty, period: float, delay: float, dimension: int) -> float:
        """[s] until later decisions can correct an `error` of a forecast made now, in whole periods and a delay [s].

        A robot reacts to what it observes after one period and the delay. It has reacted at the first decision at which
        its largest acceleration has moved it out of the radius of the error, or at which it has stopped.
        """
        since = period * np.arange(1.0, np.ceil(self.max_speed / self.braking / period) + 1.0)
        times = since + period + delay
        out = 0.5 * self.max_acceleration * since**2 >= error.radius(times, dimension)
        return float(times[np.argmax(out)] if out.any() else times[-1])

    @cached_property
    def _fixed(self) -> tuple[bool, ...]:
        """Whether the half-spaces of each of `bounds` in the plane have sides that do not turn with the robot."""
        ahead, left = (State(np.zeros(2), axis) for axis in np.eye(2))
        pairs = [(bound.half_spaces(ahead)[0], bound.half_spaces(left)[0]) for bound in self.bounds]
        return tuple(len(a) > 0 and a.shape == b.shape and np.array_equal(a, b) for a, b in pairs)

    def turn_rate(self, least: float) -> float:
        """Largest rate [rad/s] at which a robot may turn, in the plane, without end at every speed from `least` [m/s].

        The lateral acceleration rate * v is within all limits at each speed v up to `max_speed` and at each heading: as
        `bounds` in the frame of the body turn along, their sides count at one heading. 0 if a half-space of the
        velocity forbids a heading. Exact for bounds whose lateral acceleration grows with at most the square of the
        speed, as those of slalom: the rate is then least at one end of the speeds.
        """
        if any(bound.offset < self.max_speed for bound in self.velocity_bounds):
            return 0.0
        within = min([self.max_acceleration, *(bound.offset for bound in self.acceleration_bounds)])
        rates = []
        for speed in (least, self.max_speed):
            lateral, state = within, State(np.zeros(2), (speed, 0.0))
            for bound, fixed in zip(self.bounds, self._fixed):
                if bound.of == "acceleration":
                    normals, offsets = bound.half_spaces(state)
                    sides = np.ones(len(normals)) if fixed else np.abs(normals[:, 1])
                    lateral = min(lateral, float((offsets[sides > 0.0] / sides[sides > 0.0]).min(initial=np.inf)))
            rates.append(lateral / speed)
        return max(min(rates), 0.0)

    def steady_turn(self, dimension: int) -> tuple[float, float]:
        """Least speed [m/s] and `turn_rate` [rad/s] of a robot in the plane that must not stop; of others 0, 0."""
        return self._steady_turn if dimension == 2 else (0.0, 0.0)

    @cached_property
    def _steady_turn(self) -> tuple[float, float]:
        bound = least_speed(self)
        least = 0.0 if bound is None else min(bound.least, self.max_speed)
        return least, 0.0 if bound is None else self.turn_rate(least)

    def allows(self, state: State, acceleration: Array, period: float) -> bool:
        """Whether a robot in `state` may hold an acceleration (d,) [m/s^2] for `period` [s] by all `bounds`.

        Up to the relative tolerance ADMISSIBLE. The norms and the half-spaces, which do not turn, are not tested.
        """
        for bound in self.bounds:
            normals, offsets = bound.half_spaces(state)
            x = acceleration if bound.of == "acceleration" else state.velocity + period * acceleration
            if np.any(normals @ x > offsets + ADMISSIBLE * (1.0 + np.abs(offsets))):
                return False
        return True

    def admissible(self, response: Limited, state: State, horizon: float) -> Admissible:
        """The controls that keep a robot in `state` within the limits up to `horizon` [s].

        A robot above its speed limit cannot obey it at once: `kernels.allowed_speed` bounds its speed at
        the time at which the control has settled. Of a response that turns the velocity without end, half-spaces of
        the world are obeyed at every heading. Those of the body are obeyed as they turn along.

        Raises:
            InvalidInput: something else than a response or a state, a horizon that is not above 0.
        """
        has(response, ("speed_peaks", "settled"), "a response, such as Acceleration()", "response")
        has(state, *STATE, "state")
        positive(horizon, "horizon")
        speed_peaks = response.speed_peaks(state, horizon)
        acceleration_peaks = response.acceleration_peaks(state, horizon)
        speed = sqrt(state.velocity.dot(state.velocity))
        fastest = kernels.allowed_speed(self.max_speed, speed, self.braking, response.settled(horizon))
        centers = []
        radii = []
        normals = []
        offsets = []
        for peak in speed_peaks:
            centers.append(peak.inverse(np.zeros(state.dimension)))
            radii.append(fastest / float(abs(peak.gain)))
        for peak in acceleration_peaks:
            if peak.gain:
                centers.append(peak.inverse(np.zeros(state.dimension)))
                radii.append(self.max_acceleration / float(abs(peak.gain)))
        turns = getattr(response, "turns", False)
        for bounds, peaks in ((self.velocity_bounds, speed_peaks), (self.acceleration_bounds, acceleration_peaks)):
            for bound in bounds:
                vector(bound.normal, "normal of a bound", state.dimension)
                for peak in peaks:
                    if turns:
                        centers.append(peak.inverse(np.zeros(state.dimension)))
                        radii.append(max(bound.offset, 0.0) / float(abs(peak.gain)))
                    elif peak.gain:
                        normals.append(peak.pulled(bound.normal))
                        offsets.append((bound.offset - float(bound.normal @ peak.drift)) / float(abs(peak.gain)))
        d = state.dimension
        middles, sizes = np.array(centers).reshape(-1, d), np.array(radii)
        flats = [(np.array(normals).reshape(-1, d), np.array(offsets))] if normals else [_NONE[d]]
        for turning, fixed in zip(self.bounds, self._fixed if turns else (False,) * len(self.bounds)):
            half_spaces, smallest = turning.half_spaces(state), int(np.argmin(sizes))
            if fixed:
                half_spaces = ball_sides(float(half_spaces[1].min()), state.dimension)
            for peak in speed_peaks if turning.of == "velocity" else acceleration_peaks:
                if peak.gain:
                    flats.append(_inverse(half_spaces, peak, middles[smallest], sizes[smallest]))
        return Admissible(middles, sizes, *(flats[0] if len(flats) == 1 else map(np.concatenate, zip(*flats))))


_BOUNDS = (
    ("velocity_bounds", ("normal", "offset"), "a HalfSpace"),
    ("acceleration_bounds", ("normal", "offset"), "a HalfSpace"),
    ("bounds", ("of", "half_spaces"), "a bound, such as Friction(...)"),
)
"""The bounds of `Limits`: name, members and meaning of each."""

_NONE = {d: (np.empty((0, d)), np.empty(0)) for d in (2, 3)}
"""No half-spaces, by dimension."""


def _inverse(half_spaces: HalfSpaces, peak: Affine, center: Array, radius: float) -> HalfSpaces:
    """The controls whose image under `peak` is in the half-spaces, without those that hold all of a ball."""
    normals, offsets = half_spaces
    turned, moved = peak.pulled(normals), (offsets - normals @ peak.drift) / float(abs(peak.gain))
    cuts = turned @ center + radius > moved
    return turned[cuts], moved[cuts]


def least_speed(limits: Limits) -> LeastSpeed | None:
    """The bound by which a robot never stops, if its limits have one."""
    return next((bound for bound in limits.bounds if isinstance(bound, LeastSpeed)), None)


# A robot whose acceleration follows the commanded one with a lag.


@dataclass(frozen=True)
class AccelerationLag(CheckedFields):
    """The robot's acceleration approaches the commanded one at the rate 1 / `lag`.

    Of a robot with position p, velocity v and acceleration a the *reference* has the position p + lag v and the
    velocity v + lag a. It is a double integrator that follows the command exactly. The robot follows it later by `lag`,
    with an error of at most A lag^2 / 2, A the largest command (docs/theory.md, section 15). Decide for the reference
    at the time at which the robot follows it, and command the acceleration of the decision:

        navigator = Navigator(..., margin=0.05 + actuator.tracking_error(limits))
        decision = navigator.decide(actuator.reference(state), obstacles, goal, now=now + actuator.lag, ...)
        command = decision.manoeuvre.mean_acceleration(now + actuator.lag, period)

    Attributes:
        lag: [s] > 0, the time constant.
    """

    lag: Positive

    def reference(self, state: State) -> State:
        """The reference of a robot in `state`, whose acceleration is the measured one, not the commanded one."""
        return State(
            state.position + self.lag * state.velocity,
            state.velocity + self.lag * state.acceleration,
            state.acceleration,
        )

    def tracking_error(self, limits: Limits) -> float:
        """Largest distance [m] of the robot from where the reference was `lag` before.

        It holds if no command ever exceeded the limits, and the robot started with its acceleration within them.
        """
        return 0.5 * limits.max_acceleration * self.lag**2
