"""Examples of every part of the library: one line for each in the list of its kind.

An entry is an instance, or a function of the dimension that gives one. Laws, recordings, scenario files and random
scenes draw from these lists; `test_enrolment.py` names the line that is missing.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slalom import (
    METHODS,
    AccelerateThenBrake,
    AccelerateThenCoast,
    AccelerateThenStop,
    AccelerateThenTurn,
    AcceleratingBriefly,
    Acceleration,
    AccelerationSequence,
    Arrive,
    AtConstantAcceleration,
    AtConstantTurn,
    AtConstantVelocity,
    Bound,
    BoundedError,
    Box,
    Circular,
    Composite,
    ConstantAcceleration,
    ConstantVelocity,
    ConvexPolygon,
    FollowAcceleration,
    FollowVelocity,
    Forecast,
    Friction,
    Function,
    GaussianError,
    HalfSpace,
    HeadingCone,
    Jerk,
    KalmanError,
    KeepAcceleration,
    Known,
    LaggedVelocity,
    LeastSpeed,
    Limits,
    Manoeuvre,
    Method,
    Mix,
    MostClearance,
    Objective,
    PiecewisePolynomial,
    Present,
    Response,
    Sampled,
    Shape,
    State,
    Stationary,
    Trajectory,
    TurningRadius,
    Uncertainty,
    Velocity,
)
from slalom.model.path import Path
from slalom.model.shape import Ball, Capsule, Disc, Polygon, Polyline, Rectangle, Union, round_shape
from slalom.model.trajectory.protocol import direction_path

PERIOD = 0.1
"""[s] Control period of the simulated robots."""

RESPONSES: dict[str, Response] = {
    "velocity": Velocity(),
    "velocity_ramp": Velocity(ramp=PERIOD),
    "velocity_slow_ramp": Velocity(ramp=0.7),
    "lagged_velocity": LaggedVelocity(lag=0.8),
    "lagged_velocity_quick": LaggedVelocity(lag=0.25),
    "acceleration": Acceleration(),
    "coast": AccelerateThenCoast(hold=0.5),
    "coast_long": AccelerateThenCoast(hold=3.0),
    "stop": AccelerateThenStop(hold=0.5, rate=0.8, period=PERIOD),
    "stop_long": AccelerateThenStop(hold=2.0, rate=0.5, period=PERIOD),
    "brake": AccelerateThenBrake(hold=0.5, brake=1.5),
    "brake_long": AccelerateThenBrake(hold=2.0, brake=0.6),
    "jerk": Jerk(),
}

PLANE_RESPONSES: dict[str, Response] = {
    "turn": AccelerateThenTurn(hold=0.5, rate=0.9),
    "turn_long": AccelerateThenTurn(hold=2.0, rate=-0.4),
}
"""Responses in the plane only, which turn the control: laws of scalar gains do not hold for them."""


@dataclass(frozen=True, eq=False)
class Moved:
    """Another trajectory seen from elsewhere: x(t) = length * turn @ base(t / time) + shift + boost * t.

    Not part of the library: whatever implements the protocol is a trajectory.
    """

    base: Trajectory
    turn: np.ndarray | None = None
    shift: np.ndarray | float = 0.0
    boost: np.ndarray | float = 0.0
    length: float = 1.0
    time: float = 1.0

    @property
    def dimension(self) -> int:
        return self.base.dimension

    @property
    def span(self) -> tuple[float, float]:
        first, last = self.base.span
        return first * self.time, last * self.time

    def _turned(self, vectors: np.ndarray, slowness: int) -> np.ndarray:
        turned = vectors if self.turn is None else vectors @ self.turn.T
        return np.asarray(turned * (self.length / self.time**slowness))

    def _base_time(self, t: npt.ArrayLike) -> np.ndarray:
        # Clipped, since t / time may leave the span by rounding.
        return np.clip(np.asarray(t, dtype=float) / self.time, *self.base.span)

    def position(self, t: npt.ArrayLike) -> np.ndarray:
        time = np.asarray(t, dtype=float)
        return self._turned(self.base.position(self._base_time(t)), 0) + self.shift + time[..., None] * self.boost

    def velocity(self, t: npt.ArrayLike) -> np.ndarray:
        return self._turned(self.base.velocity(self._base_time(t)), 1) + self.boost

    def acceleration(self, t: npt.ArrayLike) -> np.ndarray:
        return self._turned(self.base.acceleration(self._base_time(t)), 2)

    def breaks(self, start: float, end: float) -> np.ndarray:
        return self.base.breaks(start / self.time, end / self.time) * self.time

    def speed_bound(self, start: float, end: float) -> float:
        bound = self.base.speed_bound(start / self.time, end / self.time) * self.length / self.time
        return bound + float(np.linalg.norm(self.boost))

    def acceleration_bound(self, start: float, end: float) -> float:
        return self.base.acceleration_bound(start / self.time, end / self.time) * self.length / self.time**2

    def path(self, start: float, end: float) -> Path:
        base = self.base.path(*(float(self._base_time(t)) for t in (start, end)))
        times = base.times * self.time
        places = times[:-1, None] + np.diff(times)[:, None] * np.arange(4) / 3.0
        points = self._turned(base.points, 0) + self.shift + places[..., None] * self.boost
        return Path(times, points, base.error * self.length)

    def direction(self, start: float, end: float, tolerance: float) -> Path:
        assert not np.any(self.boost), "which way it moves then is not known from the base"
        base = direction_path(self.base, *(float(self._base_time(t)) for t in (start, end)), tolerance)
        points = base.points if self.turn is None else base.points @ self.turn.T
        return Path(base.times * self.time, points, base.error)


_TIMES = np.array([-1.0, -0.2, 0.5, 1.0, 1.3, 2.1, 3.0, 3.2, 4.5, 5.0, 6.1, 7.0])


def _wander(dimension: int) -> np.ndarray:
    """Twelve irregular stamps of a wandering obstacle."""
    rng = np.random.default_rng(5)
    return np.cumsum(rng.normal(0.0, 0.6, (len(_TIMES), dimension)), axis=0)


def _first(dimension: int, *values: float) -> list[float]:
    return list(values[:dimension])


def _polynomial(dimension: int) -> Trajectory:
    """Four pieces of degree 7 that meet, the velocities of which do not."""
    rng = np.random.default_rng(7)
    durations = np.array([2.0, 1.5, 3.0, 2.5])
    pieces = rng.normal(size=(4, 8, dimension)) * (0.3 ** np.arange(8))[:, None]
    for k in range(1, 4):
        pieces[k, 0] = (pieces[k - 1] * durations[k - 1] ** np.arange(8)[:, None]).sum(axis=0)
    return PiecewisePolynomial(durations, pieces, -1.5)


def _leaving_circle(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Where a car on the circle of the composite is at 2.5 s, and how fast."""
    circle = Circular(_first(dimension, 0.0, 0.0, 0.0), 3.0, 2.0)
    return circle.position(2.5), circle.velocity(2.5)


TRAJECTORIES: dict[str, Callable[[int], Trajectory]] = {
    "stationary": lambda d: Stationary(_first(d, 3.0, -1.0, 0.5)),
    "constant_velocity": lambda d: ConstantVelocity(_first(d, 4.0, 1.0, -1.0), _first(d, -1.2, 0.3, 0.4), 0.5),
    "constant_acceleration": lambda d: ConstantAcceleration(
        _first(d, -3.0, 2.0, 1.0), _first(d, 1.0, -0.4, 0.2), _first(d, -0.3, 0.5, 0.1), -0.4
    ),
    "circular": lambda d: Circular(_first(d, 1.0, 2.0, -1.0), 3.0, 2.5, 0.4, normal=None if d == 2 else [1, 2, 2]),
    "circular_clockwise": lambda d: Circular(_first(d, 0.0, 0.0, 0.0), 12.0, -7.0, 2.0),
    "sampled_smooth": lambda d: Sampled(_TIMES, _wander(d), "smooth"),
    "sampled_linear": lambda d: Sampled(_TIMES, _wander(d), "linear"),
    "sampled_pair": lambda d: Sampled([-1.0, 7.0], [_first(d, 0.0, 1.0, 2.0), _first(d, 5.0, -1.0, 0.0)]),
    "piecewise_polynomial": _polynomial,
    "composite": lambda d: Composite(
        (Circular(_first(d, 0.0, 0.0, 0.0), 3.0, 2.0), ConstantVelocity(*_leaving_circle(d), 2.5)), (2.5,)
    ),
    "function": lambda d: Function(
        lambda t: _first(d, 2.0 * np.sin(t), 0.3 * t * t, np.cos(2.0 * t)), 6.0, 5.0, -1.0, 7.5, tolerance=1e-3
    ),
    "moved": lambda d: Moved(
        Circular(_first(d, 1.0, 0.0, 0.0), 2.0, 1.5), -np.eye(d), np.full(d, 0.5), np.full(d, 0.2), 0.7, 1.3
    ),
}
"""Functions of the dimension; all exist at least from -1 to 7 s."""

MANOEUVRES: dict[str, Callable[[int], Trajectory]] = {
    f"manoeuvre_{name}": lambda d, response=response: Manoeuvre(
        response,
        State(_first(d, 1.0, -2.0, 0.3), _first(d, 0.8, 0.5, -0.2), _first(d, 0.1, -0.2, 0.3)),
        _first(d, -0.7, 0.9, 0.4),
        -1.0,
    )
    for name, response in RESPONSES.items()
} | {
    "manoeuvre_in_turn": lambda d: Manoeuvre(
        AccelerationSequence(0.9, ((1.3, _first(d, 0.4, -0.8, 0.2)), (0.6, _first(d, -1.1, 0.2, 0.5)))),
        State(_first(d, 1.0, -2.0, 0.3), _first(d, 0.8, 0.5, -0.2)),
        _first(d, -0.7, 0.9, 0.4),
        -1.0,
    )
}
"""A manoeuvre is a trajectory too: others can avoid it."""

FORECASTS: dict[str, Forecast] = {
    "known": Known(),
    "constant_velocity": AtConstantVelocity(),
    "accelerating_briefly": AcceleratingBriefly(),
    "constant_acceleration": AtConstantAcceleration(),
    "constant_turn": AtConstantTurn(),
    "present": Present(),
}

_DART = np.array([[-1.0, 0.9], [-0.4, 0.1], [-0.8, -1.0], [1.2, -0.1]])

SHAPES: dict[str, Callable[[float, int], Shape]] = {
    "disc": lambda size, d: Disc(size),
    "ball": lambda size, d: Ball(size),
    "capsule": lambda size, d: Capsule(
        _first(d, -size, -0.2 * size, 0.3 * size), _first(d, 0.8 * size, 0.1 * size, -0.2 * size), 0.4 * size
    ),
    "rectangle": lambda size, d: Rectangle(2.0 * size, 0.9 * size, 0.0),
    "rectangle_rounded": lambda size, d: Rectangle(1.2 * size, 0.9 * size, 0.2 * size),
    "polygon": lambda size, d: Polygon(size * np.array([[-0.7, -0.6], [0.9, -0.4], [0.5, 0.7], [-0.3, 0.8]])),
    "polygon_not_convex": lambda size, d: Polygon(size * _DART, 0.1 * size),
    "polyline": lambda size, d: Polyline(size * np.array([[-1.2, 0.3], [-0.1, -0.2], [1.0, 0.1], [0.9, 1.0]])),
    "union": lambda size, d: Union(
        (Rectangle(1.5 * size, 0.7 * size), Capsule(_first(2, 0.2 * size, size), _first(2, 0.0, size), 0.3 * size))
    ),
}
"""Functions of the size [m], about half the length, and the dimension; for that of a disc or ball its radius."""


def served(dimension: int) -> list[str]:
    """Names of the shapes of that dimension, the round one first."""
    return [name for name, shape in SHAPES.items() if shape(1.0, dimension).dimension == dimension]


def mapped(shape: Shape, matrix: np.ndarray, more: float = 0.0) -> Shape:
    """The image of a shape under a matrix that scales, turns or mirrors, rounded by `more` [m] besides.

    Part by part, so that what is not convex is cut at the same places.
    """
    scale, found = float(np.linalg.norm(matrix[:, 0])), []
    for part in shape.parts:
        corners, radius = part.corners @ matrix.T, scale * part.radius + more
        if len(corners) == 1 and not corners.any():
            found.append(round_shape(radius, shape.dimension))
        elif len(corners) <= 2 and radius > 0.0:
            found.append(Capsule(corners[0], corners[-1], radius))
        else:
            found.append(Polyline(corners, radius) if len(corners) == 2 else Polygon(corners, radius))
    return found[0] if len(found) == 1 else Union(tuple(found))


KITE = ((2.0, 0.0), (0.0, 1.5), (-3.0, 0.0), (0.0, -1.0))
"""[m/s^2] Accelerates with 2, brakes with 3, turns left better than right."""

BOUNDS: dict[str, Callable[[int], tuple[Bound, ...]]] = {
    "friction": lambda d: (Friction(forward=2.0, braking=4.0, lateral=3.0),),
    "friction_weak_brakes": lambda d: (Friction(3.0, 1.0, 0.6, heading=_first(d, 1.0, -2.0, 0.5)),),
    "box": lambda d: (Box(_first(d, 1.0, 2.0, 0.7)),),
    "box_body": lambda d: (Box((1.5, 0.5), "body") if d == 2 else Box((0.5, 0.6, 3.0)),),
    "polygon": lambda d: (ConvexPolygon(KITE) if d == 2 else Box((3.0, 2.0, 1.0)),),
    "polygon_body": lambda d: (
        ConvexPolygon(KITE, "body", heading=(0.0, -1.0)) if d == 2 else Friction(1.0, 1.0, 1.0),
    ),
    "cone": lambda d: (HeadingCone(0.6),),
    "half_plane": lambda d: (HeadingCone(np.pi / 2, heading=_first(d, 0.0, 1.0, 0.0)),),
    "turning": lambda d: (TurningRadius(3.0, heading=_first(d, -1.0, 0.2, 0.0)),),
    "moving": lambda d: (LeastSpeed(1.0),),
    "vehicle": lambda d: (Friction(2.5, 3.5, 3.0), TurningRadius(2.0), HeadingCone(1.2), LeastSpeed(0.4)),
}
"""Functions of the dimension: several bounds together, each kind alone at least once."""

UNCERTAINTIES: dict[str, Uncertainty] = {
    "bounded_error": BoundedError(0.1, 0.2, 0.3),
    "bounded_error_velocity": BoundedError(velocity=0.3),
    "gaussian_error": GaussianError(0.1, 0.2),
    "gaussian_error_constant": GaussianError(0.1, 0.0, 0.05),
    "gaussian_error_none": GaussianError(0.0),
    "kalman_error": KalmanError(0.1, 0.2, 0.5, 0.3),
}

OBJECTIVES: dict[str, Callable[[int], Objective]] = {
    "arrive": lambda d: Arrive(),
    "keep_acceleration": lambda d: KeepAcceleration(),
    "follow_acceleration": lambda d: FollowAcceleration(np.eye(d)[0]),
    "follow_velocity": lambda d: FollowVelocity(_first(d, 1.0, -0.5, 0.3)),
    "most_clearance": lambda d: MostClearance(0.5, Arrive()),
    "mix": lambda d: Mix(((2.0, Arrive()), (1.0, KeepAcceleration()))),
}
"""Functions of the dimension."""

LIMITS: dict[str, Callable[[int], Limits]] = {
    "walker": lambda d: Limits(max_speed=1.5, max_acceleration=1.0),
    "car": lambda d: Limits(max_speed=12.0, max_acceleration=4.0),
    "eager": lambda d: Limits(max_speed=2.0, max_acceleration=8.0),
    "one_way": lambda d: Limits(
        max_speed=3.0,
        max_acceleration=2.0,
        velocity_bounds=(HalfSpace(_first(d, -2.0, 0.5, 0.1), 1.0),),
        acceleration_bounds=(HalfSpace(_first(d, 0.0, 1.0, 1.0), 1.5),),
    ),
} | {
    f"bounds_{name}": lambda d, bounds=bounds: Limits(max_speed=5.0, max_acceleration=4.0, bounds=bounds(d))
    for name, bounds in BOUNDS.items()
}
"""Functions of the dimension."""

ENROLLED_METHODS: dict[str, Method] = {
    name: METHODS[name] for name in ("vo", "rvo", "nlvo", "avo", "ao", "nao", "nao_ahead", "nao_shared")
}


def disc_or_ball(radius: float, dimension: int) -> Shape:
    """The round shape of that dimension."""
    return SHAPES["disc" if dimension == 2 else "ball"](radius, dimension)
