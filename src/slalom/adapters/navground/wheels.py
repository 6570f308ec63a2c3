"""What two driven wheels can do with a point ahead of their axle: its velocities, and the twist of a displacement.

A point `lead` [m] ahead of the axle moves in every direction (input-output linearisation; Siciliano, Sciavicco, Villani
and Oriolo, *Robotics*, Springer 2009, section 11.6).
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, sin
from typing import ClassVar, Literal

import numpy as np

from slalom.adapters.navground.tolerances import WHEEL_RESERVE
from slalom.bounds import HalfSpaces, axes, ball_sides
from slalom.checks import Array
from slalom.state import State


@dataclass(frozen=True)
class PointAhead:
    """Velocities of the point that wheels can keep up while the body turns towards them: a bound of `Limits`.

    Wheels `track` [m] apart with speeds up to `max_wheel_speed` [m/s] permit |v_x| + k |v_y| <= max_wheel_speed, with
    k = track / (2 lead), x ahead. While the point keeps its velocity the body turns until x is along it. On the way the
    left side is largest where tan of the angle between both is k. So all of the disc about 0 with the radius
    max_wheel_speed / hypot(1, k) can be kept up, and of faster velocities those in the hull of this disc and of the
    velocity max_wheel_speed ahead. The disc is replaced by an inscribed polygon.
    """

    of: ClassVar[Literal["velocity"]] = "velocity"
    braking: ClassVar[float] = np.inf
    lead: float
    track: float
    max_wheel_speed: float

    @cached_property
    def _sides(self) -> HalfSpaces:
        """Half-spaces in the body frame."""
        k, fastest = 0.5 * self.track / self.lead, self.max_wheel_speed / WHEEL_RESERVE
        begin, radius = float(np.arctan(k)), fastest / hypot(1.0, k)
        half = 0.5 * (0.5 * np.pi - begin)
        angles = np.array([begin, -begin, begin + half, -begin - half, np.pi])
        offsets = radius * np.array([1.0, 1.0, np.cos(half), np.cos(half), 0.0])
        return np.stack([np.cos(angles), np.sin(angles)], axis=1), offsets

    def half_spaces(self, state: State) -> HalfSpaces:
        normals, offsets = self._sides
        frame = axes(state)
        return ball_sides(float(offsets[2]), 2) if frame is None else (normals @ frame, offsets)


def turn_of(displacement: Array, lead: float) -> tuple[float, float]:
    """Length [m] of the arc of the axle, and its angle [rad], that displace the point by (2,) [m] in the body frame.

    Both the chord of the arc and the change of the direction to the point are symmetric about the mean heading, at half
    the angle. Across it the point moves by 2 lead sin(angle / 2), along it by the chord.
    """
    x, y = displacement.tolist()
    half = atan2(y, 2.0 * lead + x)
    chord = x * cos(half) + y * sin(half)
    return chord / float(np.sinc(half / np.pi)), 2.0 * half
