"""Bounds on what a robot does that are more than a largest norm, as half-spaces from its state.

In the frame of the body x points along the velocity, in the plane y to its left; in space everything else is lateral. A
robot at rest (slower than REST) has the heading that its bound was given. Without one, a bound on the acceleration that
needs a heading is replaced by the ball about 0 that fits into it whatever the heading, and `TurningRadius`,
`HeadingCone` and `LeastSpeed` bound nothing: they say how a robot that moves may go on.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Final, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, Checked, OptionalVector, Positive, known, positive, short, unit, vector, vectors
from slalom.errors import InvalidInput
from slalom.state import State
from slalom.tolerances import REST

HalfSpaces: TypeAlias = tuple[Array, Array]
"""Unit normals (n, d) and offsets (n,): the x with normals @ x <= offsets."""

FRAMES: Final = ("world", "body")  # whose axes a bound is along
SIDES: Final = 32
"""Of the polygon that stands for an ellipse: it lies inside and has at least cos(pi / 32) = 0.9952 of every radius."""

FACES: Final = 8
"""Of the pyramid or prism that stands for a round cone or cylinder in space: cos(pi / 8) = 0.924 of every radius."""


@runtime_checkable
class Bound(Protocol):
    """A convex set of accelerations or of velocities.

    Laws: every vector that obeys `half_spaces` is in the set that the class defines; the acceleration 0, and the
    velocity that the robot has, obey them; so do all accelerations -s v / |v| with 0 <= s <= `braking`.
    """

    @property
    def of(self) -> Literal["velocity", "acceleration"]:
        """What is bounded."""

    @property
    def braking(self) -> float:
        """How hard the robot may brake against its velocity, whatever that is [m/s^2]; inf if not bounded."""

    def half_spaces(self, state: State) -> HalfSpaces:
        """The set for a robot in `state`, in the world frame. Raises InvalidInput for another dimension."""


def _circle(count: int) -> Array:
    """The middles of `count` equal arcs of the unit circle, the first of which begins on the x axis."""
    angles = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _sphere() -> Array:
    """18 directions: six on the equator and, between them, six on each circle whose latitude has the sine sqrt(2 / 3).

    The polyhedron with these normals has corners at the poles and is inscribed when its faces are sqrt(2 / 3) away
    from the middle. More faces would make choices in space slow: their time grows with the third power of the number.
    """
    equator, between = np.pi / 3.0 * np.arange(6), _circle(6) / np.sqrt(3.0)
    upper = np.concatenate([np.full((6, 1), np.sqrt(2.0 / 3.0)), between], axis=1)
    middle = np.stack([np.zeros(6), np.cos(equator), np.sin(equator)], axis=1)
    return np.concatenate([upper, middle, upper * (-1.0, 1.0, 1.0)])


_ROUND: Final[dict[int, tuple[Array, float]]] = {
    2: (_circle(SIDES), float(np.cos(np.pi / SIDES))),
    3: (_sphere(), float(np.sqrt(2.0 / 3.0))),
}
"""By dimension: normals such that {x: normals @ x <= cosine} lies in the unit ball; a mirror image of itself in x."""


def ball_sides(radius: float, dimension: int) -> HalfSpaces:
    """Half-spaces whose intersection lies in the ball of that radius about 0."""
    normals, cosine = _ROUND[dimension]
    return normals, np.full(len(normals), cosine * radius)


def axes(state: State, heading: npt.ArrayLike | None = None) -> Array | None:
    """The axes of the body as rows (d, d), the heading first; None for a robot at rest if no `heading` is given."""
    faced = None if heading is None else vector(heading, "heading", state.dimension)
    speed = float(np.linalg.norm(state.velocity))
    ahead = state.velocity / speed if speed >= REST else faced
    if ahead is None:
        return None
    if ahead.size == 2:
        return np.array([(ahead[0], ahead[1]), (-ahead[1], ahead[0])])
    # Any two directions across; these are made from the axis of the world that is most so.
    x, y, z = ahead.tolist()
    least = min(abs(x), abs(y), abs(z))
    p, q, r = (0.0, z, -y) if abs(x) == least else (-z, 0.0, x) if abs(y) == least else (y, -x, 0.0)
    length = np.sqrt(p * p + q * q + r * r)
    p, q, r = p / length, q / length, r / length
    return np.array([(x, y, z), (p, q, r), (y * r - z * q, z * p - x * r, x * q - y * p)])


def _direction(value: npt.ArrayLike | None) -> Array | None:
    return None if value is None else unit(value, "heading")[0]


@dataclass(frozen=True, eq=False)
class Friction:
    """(a_x / x)^2 + (a_lateral / lateral)^2 <= 1 in the frame of the body; x is `forward` if a_x >= 0, else `braking`.

    Two half ellipses (in space half ellipsoids of revolution): the friction ellipse of a tyre with an engine that is
    weaker, or stronger, than its brakes. All in m/s^2, above 0. Imposed as an inscribed polygon of SIDES sides, which
    loses at most 0.5 % of any acceleration, in space as a polyhedron of 18 faces, which loses at most 18.4 %; neither
    loses anything along the heading.
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    forward: Positive
    braking: Positive
    lateral: Positive
    heading: OptionalVector = None

    def __post_init__(self) -> None:
        for name in ("forward", "braking", "lateral"):
            object.__setattr__(self, name, positive(getattr(self, name), name))
        object.__setattr__(self, "heading", _direction(self.heading))

    @cached_property
    def _sides(self) -> dict[int, HalfSpaces]:
        """By dimension, in the frame of the body."""
        sides = {}
        for dimension, (round_normals, cosine) in _ROUND.items():
            normals = round_normals / self.lateral
            # A half-space of one half bounds the other too, which its mirror image bounds more: nothing is added.
            normals[:, 0] = round_normals[:, 0] / np.where(round_normals[:, 0] >= 0.0, self.forward, self.braking)
            lengths = np.linalg.norm(normals, axis=1)
            sides[dimension] = normals / lengths[:, None], cosine / lengths
        return sides

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return ball_sides(min(self.forward, self.braking, self.lateral), state.dimension)
        normals, offsets = self._sides[state.dimension]
        return normals @ frame, offsets


@dataclass(frozen=True, eq=False)
class Box:
    """|a_i| <= half_widths_i along the axes of the world, or with frame "body", in the plane only, of the body.

    Exact. `half_widths` (d,) [m/s^2], each above 0.
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    half_widths: Checked = Checked(vector)
    frame: Annotated[str, FRAMES] = "world"
    heading: OptionalVector = None

    def __post_init__(self) -> None:
        positive(float(self.half_widths.min()), "least of half_widths")
        known(self.frame, "frame", FRAMES)
        object.__setattr__(self, "heading", _direction(self.heading))

    @property
    def braking(self) -> float:
        return float(self.half_widths[0] if self.frame == "body" else self.half_widths.min())

    def half_spaces(self, state: State) -> HalfSpaces:
        widths = vector(self.half_widths, "half_widths", state.dimension)
        normals, offsets = np.concatenate([np.eye(widths.size), -np.eye(widths.size)]), np.tile(widths, 2)
        if self.frame == "world":
            return normals, offsets
        return _turned(normals, offsets, state, self.heading)


@dataclass(frozen=True, eq=False)
class ConvexPolygon:
    """The accelerations in a convex polygon, in the plane only: any table of what brakes, engine and tyres allow.

    Exact. `corners` (n, 2) [m/s^2], counter-clockwise, n >= 3, with 0 inside; in the frame "world" or "body".
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    corners: Checked = Checked(vectors, "n d")
    frame: Annotated[str, FRAMES] = "world"
    heading: OptionalVector = None

    def __post_init__(self) -> None:
        known(self.frame, "frame", FRAMES)
        object.__setattr__(self, "heading", _direction(self.heading))
        shape = self.corners.shape
        if len(shape) != 2 or shape[0] < 3 or shape[1] != 2:
            raise InvalidInput(f"corners: expected an array (n, 2) with n >= 3, found shape {shape}")
        count, (normals, offsets) = shape[0], self._sides
        # Each corner but the two on the side itself lies strictly within every side, and so does 0.
        inside = normals @ self.corners.T - offsets[:, None] < 0.0
        inside[np.arange(count), np.arange(count)] = inside[np.arange(count), (np.arange(count) + 1) % count] = True
        if not (np.all(inside) and np.all(offsets > 0.0)):
            raise InvalidInput(
                "corners: expected those of a convex polygon around 0, counter-clockwise, none between two others, "
                f"found {short(self.corners)}"
            )

    @cached_property
    def _sides(self) -> HalfSpaces:
        along = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        return normals, np.sum(normals * self.corners, axis=1)

    @property
    def braking(self) -> float:
        normals, offsets = self._sides
        if self.frame == "world":
            return float(offsets.min())
        behind = normals[:, 0] < 0.0
        return float((offsets[behind] / -normals[behind, 0]).min())

    def half_spaces(self, state: State) -> HalfSpaces:
        if state.dimension != 2:
            raise InvalidInput(f"corners: expected a robot in the plane, found one of dimension {state.dimension}")
        normals, offsets = self._sides
        return (normals, offsets) if self.frame == "world" else _turned(normals, offsets, state, self.heading)


def _turned(normals: Array, offsets: Array, state: State, heading: npt.ArrayLike | None) -> HalfSpaces:
    """Half-spaces of the body in the world, in the plane."""
    if state.dimension != 2:
        raise InvalidInput(f"frame: expected 'world' for a robot in space, whose sides are all alike, found {'body'!r}")
    frame = axes(state, heading)
    return ball_sides(float(offsets.min()), 2) if frame is None else (normals @ frame, offsets)


@dataclass(frozen=True, eq=False)
class HeadingCone:
    """The velocity points within `half_angle` [rad] of the present heading, 0 < half_angle <= pi / 2.

    Imposed at the peaks of the speed, hence, the cone being convex, all along. Exact in the plane; in space an
    inscribed pyramid, the tangent of whose half-angle is at least 0.92 of the true one.
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    half_angle: Positive
    heading: OptionalVector = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "half_angle", positive(self.half_angle, "half_angle"))
        if self.half_angle > 0.5 * np.pi:
            raise InvalidInput(f"half_angle: expected at most pi / 2, found {self.half_angle:g}")
        object.__setattr__(self, "heading", _direction(self.heading))

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return _nothing(state.dimension)
        sideways, cosine = _sideways(frame)
        angle = np.arctan2(cosine * np.sin(self.half_angle), np.cos(self.half_angle))
        return np.cos(angle) * sideways - np.sin(angle) * frame[0], np.zeros(len(sideways))


@dataclass(frozen=True, eq=False)
class TurningRadius:
    """|a_lateral| <= v^2 / `least` in the frame of the body: no path is bent more than with the radius `least` [m].

    A vehicle's steering. Exact in the plane, in space an inscribed prism that loses at most 7.6 %.
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    braking: ClassVar[float] = np.inf
    least: Positive
    heading: OptionalVector = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "least", positive(self.least, "least"))
        object.__setattr__(self, "heading", _direction(self.heading))

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return _nothing(state.dimension)
        sideways, cosine = _sideways(frame)
        most = float(state.velocity @ state.velocity) / self.least
        return sideways, np.full(len(sideways), cosine * most)


@dataclass(frozen=True, eq=False)
class LeastSpeed:
    """The velocity along the present heading stays at `least` [m/s] or above: for vehicles that must not stop.

    One that is slower already must not get slower. Only the motion while the control is carried out is bounded, not
    what a response does afterwards (`AccelerateThenStop` stops).
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    least: Positive
    heading: OptionalVector = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "least", positive(self.least, "least"))
        object.__setattr__(self, "heading", _direction(self.heading))

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return _nothing(state.dimension)
        return -frame[:1], np.array([-min(self.least, float(np.linalg.norm(state.velocity)))])


def _sideways(frame: Array) -> tuple[Array, float]:
    """Unit vectors to the sides of the heading; the cosine of half the angle between neighbours, 1 in the plane."""
    if len(frame) == 2:
        return np.array([frame[1], -frame[1]]), 1.0
    return _circle(FACES) @ frame[1:], float(np.cos(np.pi / FACES))


def _nothing(dimension: int) -> HalfSpaces:
    return np.empty((0, dimension)), np.empty(0)


BOUNDS: Final[dict[str, type[Bound]]] = {
    "friction": Friction,
    "box": Box,
    "convex_polygon": ConvexPolygon,
    "heading_cone": HeadingCone,
    "turning_radius": TurningRadius,
    "least_speed": LeastSpeed,
}
"""Every kind of bound by the name that it has in files."""
