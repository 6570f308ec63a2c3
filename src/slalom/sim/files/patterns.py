"""Patterns of scenario files: where the robots of a group start, and where their goals are."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from slalom.base.checks import Array, Checked, NotNegative, Number, Positive, check_fields, vector, vectors, whole
from slalom.base.errors import InvalidInput
from slalom.model.shape import Polygon
from slalom.sim.placement import on_circle, random_positions


def generator(seed: int, key: str) -> np.random.Generator:
    """Return a generator for a key of a group; keys with the same seed draw independently of each other."""
    return np.random.default_rng([seed, *key.encode()])


class Goals(ABC):
    """A pattern of goals."""

    @abstractmethod
    def goals(self, positions: Array) -> Array:
        """Return the goals (n, d) [m] of robots that start at `positions` (n, d) [m]."""


class Layout(Goals):
    """A pattern of positions, for starts and for goals."""

    @abstractmethod
    def points(self, count: int, key: str) -> Array:
        """Return `count` positions (count, d) [m] for a key of a group."""

    def goals(self, positions: Array) -> Array:
        return self.points(len(positions), "goals")


@dataclass(frozen=True, eq=False)
class CircleLayout(Layout):
    """Evenly on a circle in the first two axes, counter-clockwise from the angle `phase` [rad]."""

    center: Checked = Checked(vector)
    radius: Positive  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    phase: Number = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def points(self, count: int, key: str) -> Array:
        found = np.tile(self.center, (count, 1))
        found[:, :2] += on_circle(self.phase + 2.0 * np.pi * np.arange(count) / count, self.radius)
        return found


@dataclass(frozen=True, eq=False)
class LineLayout(Layout):
    """Evenly from `first` to `last` [m], both included; a single robot is at `first`."""

    first: Checked = Checked(vector)
    last: Checked = Checked(vector)

    def __post_init__(self) -> None:
        vector(self.last, "last", len(self.first))

    def points(self, count: int, key: str) -> Array:
        return np.linspace(self.first, self.last, count)


@dataclass(frozen=True, eq=False)
class GridLayout(Layout):
    """Rows of `columns` robots along x, upwards along y from `corner` [m], `spacing` [m] apart."""

    corner: Checked = Checked(vector)
    spacing: Positive  # type: ignore[misc]  # the field before it has no default: Checked is a descriptor
    columns: int  # type: ignore[misc]  # the same

    def __post_init__(self) -> None:
        check_fields(self)
        whole(self.columns, "columns", 1)

    def points(self, count: int, key: str) -> Array:
        found = np.tile(self.corner, (count, 1))
        row, column = np.divmod(np.arange(count), self.columns)
        found[:, :2] += self.spacing * np.column_stack([column, row])
        return found


@dataclass(frozen=True, eq=False)
class BoxLayout(Layout):
    """At random, uniform in the box from `low` to `high` [m], at least `min_distance` [m] apart; the seed decides."""

    low: Checked = Checked(vector)
    high: Checked = Checked(vector)
    min_distance: NotNegative = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        vector(self.high, "high", len(self.low))
        check_fields(self)
        whole(self.seed, "seed")

    def points(self, count: int, key: str) -> Array:
        return random_positions(count, self.low, self.high, self.min_distance, generator(self.seed, key), key)


@dataclass(frozen=True, eq=False)
class PolygonLayout(Layout):
    """At random, uniform in the polygon with 3 or more `corners` [m], at least `min_distance` [m] apart."""

    corners: Checked = Checked(vectors, "n d")
    min_distance: NotNegative = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        Polygon(self.corners)
        check_fields(self)
        whole(self.seed, "seed")

    def points(self, count: int, key: str) -> Array:
        low, high = self.corners.min(axis=0), self.corners.max(axis=0)
        area = shapely.Polygon(self.corners)
        return random_positions(
            *(count, low, high, self.min_distance, generator(self.seed, key), key),
            inside=lambda point: bool(shapely.contains_xy(area, *point)),
        )


@dataclass(frozen=True, eq=False)
class OppositeGoals(Goals):
    """The start, mirrored at `center` [m]: antipodal on a circle about it."""

    center: Checked = Checked(vector)

    def goals(self, positions: Array) -> Array:
        return 2.0 * vector(self.center, "center", positions.shape[1]) - positions


@dataclass(frozen=True)
class SwapGoals(Goals):
    """The starts in reverse order: the first robot and the last exchange places, and so on."""

    def goals(self, positions: Array) -> Array:
        if len(positions) % 2:
            raise InvalidInput(f"expected an even count of robots that exchange places, found {len(positions)}")
        return positions[::-1].copy()


@dataclass(frozen=True, eq=False)
class DisplacedGoals(Goals):
    """The start, displaced by the vector `by` [m]: all robots drive in one direction."""

    by: Checked = Checked(vector)

    def goals(self, positions: Array) -> Array:
        return positions + vector(self.by, "by", positions.shape[1])


LAYOUTS: Final[Mapping[str, type[Layout]]] = {
    "circle": CircleLayout,
    "line": LineLayout,
    "grid": GridLayout,
    "box": BoxLayout,
    "polygon": PolygonLayout,
}
"""Patterns of positions by kind."""

GOALS: Final[Mapping[str, type[Goals]]] = {
    **LAYOUTS,
    "opposite": OppositeGoals,
    "swap": SwapGoals,
    "displaced": DisplacedGoals,
}
"""Patterns of goals by kind."""
