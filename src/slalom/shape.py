"""What an obstacle or a robot covers around its position."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from slalom.checks import not_negative


@runtime_checkable
class Shape(Protocol):
    """A set around a position: the points within `radius` [m] of it, in `dimension` 2 or 3.

    Law: a robot of shape A at p meets an obstacle of shape B at c exactly if the point p lies in B grown by A at c.
    """

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def radius(self) -> float:
        """[m]"""


@dataclass(frozen=True)
class Disc:
    """A disc of `radius` >= 0 [m] in the plane."""

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", not_negative(self.radius, "radius"))

    @property
    def dimension(self) -> int:
        return 2


@dataclass(frozen=True)
class Ball:
    """A ball of `radius` >= 0 [m] in space."""

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", not_negative(self.radius, "radius"))

    @property
    def dimension(self) -> int:
        return 3


def round_shape(radius: float, dimension: int) -> Shape:
    """The disc or ball of that radius."""
    return Disc(radius) if dimension == 2 else Ball(radius)
