"""Bounds on velocity and acceleration other than a largest norm, as half-spaces that depend on the state.

In the body frame x points along the heading of the state, or along the velocity if the state has none. In the plane y
points to its left, in space the rest is lateral. A robot slower than REST whose state has no heading takes the one of
its bound. Without a heading, a bound on the acceleration that needs one becomes a ball about 0: the largest that fits
into it under every heading. `TurningRadius`, `HeadingCone` and `LeastSpeed` then bound nothing, because they
restrict a moving robot only.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import Annotated, ClassVar, Final, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import (
    Array,
    Checked,
    CheckedFields,
    Direction,
    Positive,
    check_fields,
    positive,
    short,
    vector,
    vectors,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST
from slalom.model.state import State

ELLIPSE_SIDES: Final = 32
"""[1] Sides of the inscribed polygon that replaces an ellipse; it keeps cos(pi / 32) = 0.9952 of every radius. Larger:
more half-spaces, slower choices. Smaller: the robot uses less of its friction."""

CONE_FACES: Final = 8
"""[1] Sides of the pyramid or prism that replaces a cone or cylinder; it keeps cos(pi / 8) = 0.924 of every radius.
Larger: more half-spaces, slower choices in space. Smaller: less of the bound is used."""


HalfSpaces: TypeAlias = tuple[Array, Array]
"""Unit normals (n, d) and offsets (n,): the x with normals @ x <= offsets."""

FRAMES: Final = ("world", "body")  # whose axes a bound is along


@runtime_checkable
class Bound(Protocol):
    """Convex set of admissible accelerations or velocities.

    Laws: every vector that obeys `half_spaces` lies in the set of the class. The acceleration 0, the present velocity,
    and all accelerations -s v / |v| with 0 <= s <= `braking` obey them. `LookAhead` takes bounds whose sides turn with
    the velocity v or not at all, with offsets c + k v^2 for the acceleration, and c, or what v needs, for the velocity.
    """

    @property
    def of(self) -> Literal["velocity", "acceleration"]:
        """The bounded quantity."""

    @property
    def braking(self) -> float:
        """Largest deceleration [m/s^2] against the velocity, admissible at every velocity; inf if not bounded."""

    def half_spaces(self, state: State) -> HalfSpaces:
        """Half-spaces (n, d), (n,) in the world frame. Raises InvalidInput for a state of another dimension."""


def _circle(count: int) -> Array:
    """Midpoints (count, 2) of `count` equal arcs of the unit circle; the first arc begins on the x axis."""
    angles = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _sphere() -> Array:
    """18 unit vectors (18, 3): normals of a polyhedron with corners at the poles.

    Six lie on the equator and, between them, six on each circle whose latitude has the sine sqrt(2 / 3). The polyhedron
    is inscribed in the unit ball if its faces are sqrt(2 / 3) away from the centre. The time of a choice in space grows
    with the third power of the number of faces.
    """
    equator, between = np.pi / 3.0 * np.arange(6), _circle(6) / np.sqrt(3.0)
    upper = np.concatenate([np.full((6, 1), np.sqrt(2.0 / 3.0)), between], axis=1)
    middle = np.stack([np.zeros(6), np.cos(equator), np.sin(equator)], axis=1)
    return np.concatenate([upper, middle, upper * (-1.0, 1.0, 1.0)])


_ROUND: Final[dict[int, tuple[Array, float]]] = {
    2: (_circle(ELLIPSE_SIDES), float(np.cos(np.pi / ELLIPSE_SIDES))),
    3: (_sphere(), float(np.sqrt(2.0 / 3.0))),
}
"""Normals (n, d) and cosine by dimension: {x: normals @ x <= cosine} lies in the unit ball and is symmetric in x."""


def ball_sides(radius: float, dimension: int) -> HalfSpaces:
    """Half-spaces (n, d), (n,) whose intersection lies in the ball of `radius` about 0."""
    normals, cosine = _ROUND[dimension]
    return normals, np.full(len(normals), cosine * radius)


def axes(state: State, heading: npt.ArrayLike | None = None) -> Array | None:
    """Unit axes (d, d) of the body as rows, heading first; None for a robot at rest without any heading (d,)."""
    if state.heading is not None:
        return np.array([(cos(angle := state.heading), sin(angle)), (-sin(angle), cos(angle))])
    # As a copy: the kernel would be compiled once more for arrays that cannot be written.
    faced = None if heading is None else np.array(vector(heading, "heading", state.dimension))
    speed = float(np.linalg.norm(state.velocity))
    ahead = state.velocity / speed if speed >= REST else faced
    return None if ahead is None else np.asarray(kernels.axes_along(ahead))


@dataclass(frozen=True, eq=False)
class Friction(CheckedFields):
    """(a_x / x)^2 + (a_lateral / lateral)^2 <= 1 in the body frame; x is `forward` if a_x >= 0, else `braking`.

    Two half ellipses (in space half ellipsoids of revolution): the friction ellipse of a tyre with different limits of
    engine and brakes. All are in m/s^2 and above 0. In the plane an inscribed polygon of ELLIPSE_SIDES sides, which
    loses at most 0.5 % of any acceleration. In space a polyhedron of 18 faces, which loses at most 18.4 %. Neither
    loses anything along the heading.
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    forward: Positive
    braking: Positive
    lateral: Positive
    heading: Direction = None

    @cached_property
    def _sides(self) -> dict[int, HalfSpaces]:
        """Half-spaces by dimension, in the body frame."""
        sides = {}
        for dimension, (round_normals, cosine) in _ROUND.items():
            normals = round_normals / self.lateral
            # Each half-space is implied in the other half by its mirror image, which is tighter there: no further ones
            # are needed.
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
    """|a_i| <= half_widths_i along the axes of the world frame or, in the plane only, of the body frame ("body").

    Exact. `half_widths` (d,) [m/s^2], each above 0.
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    half_widths: Checked = Checked(vector)
    frame: Annotated[str, FRAMES] = "world"
    heading: Direction = None

    def __post_init__(self) -> None:
        positive(float(self.half_widths.min()), "least of half_widths")
        check_fields(self)

    @property
    def braking(self) -> float:
        return float(self.half_widths[0] if self.frame == "body" else self.half_widths.min())

    def half_spaces(self, state: State) -> HalfSpaces:
        widths = vector(self.half_widths, "half_widths", state.dimension)
        normals, offsets = np.concatenate([np.eye(widths.size), -np.eye(widths.size)]), np.tile(widths, 2)
        if self.frame == "world":
            return normals, offsets
        return _in_world_frame(normals, offsets, state, self.heading)


@dataclass(frozen=True, eq=False)
class ConvexPolygon:
    """Accelerations in a convex polygon, in the plane only: a table of the limits of brakes, engine and tyres.

    Exact. `corners` (n, 2) [m/s^2], counter-clockwise, n >= 3, with 0 inside; in the frame "world" or "body".
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    corners: Checked = Checked(vectors, "n d")
    frame: Annotated[str, FRAMES] = "world"
    heading: Direction = None

    def __post_init__(self) -> None:
        check_fields(self)
        shape = self.corners.shape
        if len(shape) != 2 or shape[0] < 3 or shape[1] != 2:
            raise InvalidInput(f"corners: expected an array (n, 2) with n >= 3, found shape {shape}")
        count, (normals, offsets) = shape[0], self._sides
        # Every corner except the two of the side itself lies strictly inside every side, and so does 0.
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
        return (normals, offsets) if self.frame == "world" else _in_world_frame(normals, offsets, state, self.heading)


def _in_world_frame(normals: Array, offsets: Array, state: State, heading: npt.ArrayLike | None) -> HalfSpaces:
    """Half-spaces (n, 2), (n,) of the body frame in the world frame; those of a ball if the heading is unknown."""
    if state.dimension != 2:
        raise InvalidInput(f"frame: expected 'world' for a robot in space, whose sides are all alike, found {'body'!r}")
    frame = axes(state, heading)
    return ball_sides(float(offsets.min()), 2) if frame is None else (normals @ frame, offsets)


@dataclass(frozen=True, eq=False)
class HeadingCone:
    """The velocity stays within `half_angle` [rad] of the present heading, 0 < half_angle <= pi / 2.

    Imposed at the peaks of the speed; the cone is convex, so it holds at all times. Exact in the plane; in space an
    inscribed pyramid, the tangent of whose half-angle is at least 0.92 of the true one.
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    half_angle: Positive
    heading: Direction = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.half_angle > 0.5 * np.pi:
            raise InvalidInput(f"half_angle: expected at most pi / 2, found {self.half_angle:g}")

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return _no_half_spaces(state.dimension)
        sideways, cosine = _sideways(frame)
        angle = np.arctan2(cosine * np.sin(self.half_angle), np.cos(self.half_angle))
        return np.cos(angle) * sideways - np.sin(angle) * frame[0], np.zeros(len(sideways))


@dataclass(frozen=True, eq=False)
class TurningRadius(CheckedFields):
    """|a_lateral| <= v^2 / `least` in the body frame: the radius of curvature of a path is at least `least` [m].

    The limit of a vehicle's steering. Exact in the plane; in space an inscribed prism that loses at most 7.6 %.
    """

    of: ClassVar[Literal["acceleration"]] = "acceleration"
    braking: ClassVar[float] = np.inf
    least: Positive
    heading: Direction = None

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return _no_half_spaces(state.dimension)
        sideways, cosine = _sideways(frame)
        max_lateral = float(state.velocity @ state.velocity) / self.least
        return sideways, np.full(len(sideways), cosine * max_lateral)


@dataclass(frozen=True, eq=False)
class LeastSpeed(CheckedFields):
    """The velocity along the present heading stays at or above `least` [m/s]: for vehicles that must not stop.

    A slower vehicle must not become slower still. Only the motion until the control has settled is bounded, not the
    later motion of a response (`AccelerateThenStop` stops). To stop at a goal at rest is refused.
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    least: Positive
    heading: Direction = None

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state, self.heading)
        if frame is None:
            return _no_half_spaces(state.dimension)
        return -frame[:1], np.array([-min(self.least, float(np.linalg.norm(state.velocity)))])


def _sideways(frame: Array) -> tuple[Array, float]:
    """Lateral unit vectors (k, d), and the cosine of half the angle between neighbours (1 in the plane)."""
    if len(frame) == 2:
        return np.array([frame[1], -frame[1]]), 1.0
    return _circle(CONE_FACES) @ frame[1:], float(np.cos(np.pi / CONE_FACES))


def _no_half_spaces(dimension: int) -> HalfSpaces:
    return np.empty((0, dimension)), np.empty(0)


BOUNDS: Final[dict[str, type[Bound]]] = {
    "friction": Friction,
    "box": Box,
    "convex_polygon": ConvexPolygon,
    "heading_cone": HeadingCone,
    "turning_radius": TurningRadius,
    "least_speed": LeastSpeed,
}
"""Kinds of bounds by the name that they have in files."""
