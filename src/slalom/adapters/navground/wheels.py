"""The motion that two driven wheels can give to a point ahead of their axle (input-output linearisation).

The point moves in every direction (Siciliano, Sciavicco, Villani and Oriolo, *Robotics*, Springer 2009, section 11.6).
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, sin
from typing import ClassVar, Literal

import numpy as np

from slalom.adapters.navground.tolerances import ARC_RESERVE, OVERSPEED
from slalom.bounds import HalfSpaces, axes, ball_sides
from slalom.checks import Array, positive
from slalom.state import State


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
