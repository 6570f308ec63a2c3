"""Obstacles that serve many decisions, made into tables once by the caller."""

from collections.abc import Hashable, Iterable, Iterator, Sequence
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple, cast

import numpy as np

from slalom import kernels
from slalom.base.checks import Array, has
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import LARGEST
from slalom.kernels.arrays import EVERY_WORLD, Bodies, Flags, Indices, joined_records, zero_records
from slalom.kernels.decision.tables import AtHorizon, ObstacleAtHorizon
from slalom.model.shape import Shape
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.pieces import Reach, joined, minkowski_sum, no_bodies, outline_parts, rotation, rows_of

BALL_FILLED: Final = 0.4
"""[1] Share of its bounding ball that an obstacle fills if the cost of a detour around it counts that ball. A car fills
0.44. Larger: no such costs for more obstacles. Smaller: robots beside walls stay where they are."""

NO_CORNERS: Final = np.empty((0, 4))
NONE_AT_HORIZON: Final = AtHorizon(zero_records(ObstacleAtHorizon, 0), NO_CORNERS)


def represented(obstacles: Sequence[Obstacle]) -> Indices:
    """The obstacles around which detours lead, contacts with which count while the robot is at rest.

    They have one part, which is a ball in space.
    """
    fit = [
        o.contact_at_rest and len(o.shape.parts) == 1 and (o.dimension == 2 or len(o.shape.parts[0].corners) == 1)
        for o in obstacles
    ]
    return np.flatnonzero(np.array(fit, np.bool_))


@lru_cache(maxsize=1024)
def fills_ball(shape: Shape) -> bool:
    """Whether a shape of one part fills at least BALL_FILLED of the ball about its position that contains it.

    That ball is large for a wall whose corners are far from its position. A robot beside the wall is inside of it. It
    would find each way along the wall longer than no motion at all.
    """
    ((corners, radius),) = shape.parts
    if len(corners) == 1:
        area = np.pi * radius**2
    else:
        following = np.roll(corners, -1, axis=0)
        polygon = 0.5 * abs(float(np.sum(corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0])))
        around = float(np.linalg.norm(following - corners, axis=1).sum())
        area = polygon + around * radius + np.pi * radius**2
    return bool(area >= BALL_FILLED * np.pi * shape.bounding_radius**2)


class Outlines(NamedTuple):
    """Obstacles around which detours lead, without the places of those that move."""

    owner: Indices  # (m,) their numbers
    moves: Flags  # (m,)
    at_horizon: AtHorizon  # (m,) those at rest as they are; those that move about their positions, in their body frames


def outlines(obstacles: Sequence[Obstacle]) -> Outlines:
    """The outlines of the obstacles around which detours lead, see `represented`."""
    some = represented(obstacles)
    found, moves = zero_records(ObstacleAtHorizon, len(some)), np.zeros(len(some), np.bool_)
    corners, count = list[Array](), 0
    for row, k in enumerate(some.tolist()):
        obstacle, moves[row] = obstacles[k], not obstacles[k].at_rest
        ((own, radius),) = obstacle.shape.parts
        if not moves[row]:
            position = obstacle.trajectory.position(0.0)
            found["position"][row, : len(position)] = position
        found["radius"][row], found["ball"][row] = radius, obstacle.shape.bounding_radius
        found["filled"][row] = fills_ball(cast(Hashable, obstacle.shape))
        found["first"][row] = count
        if len(own) > 1:
            if not moves[row]:
                own = outline_parts(obstacle, 0.0)[0].corners
            elif obstacle.angle:
                own = own @ rotation(obstacle.angle).T
            corners.append(_outward(own))
            count += len(corners[-1])
        found["last"][row] = count
    found["world"] = EVERY_WORLD
    return Outlines(some, moves, AtHorizon(found, np.concatenate([NO_CORNERS, *corners])))


def _outward(corners: Array) -> Array:
    """Rows (n, 4) of `AtHorizon.corners` of a convex body with corners (m, 2) [m] in order; four for a line."""
    if len(corners) == 2:
        along = (corners[1] - corners[0]) / np.linalg.norm(corners[1] - corners[0])
        side = np.array([-along[1], along[0]])
        ends = corners[[0, 0, 1, 1]]
        return np.hstack([ends, np.sqrt(0.5) * np.array([side - along, -side - along, along - side, along + side])])
    following = np.roll(corners, -1, axis=0)
    if float(np.sum(corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0])) < 0.0:
        corners = corners[::-1]
    away = corners - corners.mean(axis=0)
    return np.hstack([corners, away / np.linalg.norm(away, axis=1)[:, None]])


def joined_outlines(parts: Sequence[Outlines], counts: Sequence[int]) -> Outlines:
    """The outlines of several parts with `counts` obstacles each, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    sizes, corners = [len(part.owner) for part in parts], [len(part.at_horizon.corners) for part in parts]
    each = joined_records([part.at_horizon.each for part in parts])
    by = np.repeat(np.cumsum([0, *corners])[:-1], sizes)
    each["first"] += by
    each["last"] += by
    return Outlines(
        np.concatenate([part.owner for part in parts]) + np.repeat(np.cumsum([0, *counts])[:-1], sizes),
        np.concatenate([part.moves for part in parts]),
        AtHorizon(each, np.concatenate([part.at_horizon.corners for part in parts])),
    )


STRETCH_HORIZONS: Final = 4.0
"""[1] Length of a stretch of time over which the pieces of an `ObstacleTable` are made at once, in horizons. Larger:
pieces take longer to make, more seldom, and more memory. Smaller: more decisions include the time to make them."""


class ObstacleTable:
    """Walls and other obstacles with known trajectories, whose pieces are made once and serve many decisions.

    Pass it in place of obstacles, alone or in a list. Its contents never change. For a map that is updated,
    make one table for each part, and a new table for a part that changes.

    The pieces are made for each shape of a robot, when first needed. Those of a table whose obstacles are all at rest
    serve for all time, others for a stretch of STRETCH_HORIZONS horizons. Stretches begin at multiples of their length,
    so a decision does not depend on earlier ones. Decisions in several threads may share a table.

    Attributes:
        given: the obstacles as they were given. obstacles: the same, continued (see `Obstacle.after_end`).
        is_passive: whether contacts with some of them do not count while the robot is at rest.
        has_futures: whether some are futures with a probability below 1.

    Raises:
        InvalidInput: something else than obstacles, or obstacles of different dimensions.
    """

    def __init__(self, obstacles: Iterable[Obstacle]) -> None:
        has(obstacles, ("__iter__",), "a list of obstacles", "obstacles")
        self.given = tuple(obstacles)
        for k, obstacle in enumerate(self.given):
            has(obstacle, ("shape", "trajectory"), "an obstacle", f"obstacles[{k}]")
        self.obstacles = tuple(obstacle.continued for obstacle in self.given)
        # Those that leave are not among them.
        self._known_until = min((o.trajectory.span[1] for o in self.given if o.continued is not o), default=np.inf)
        self.dimension = one_dimension(obstacle.dimension for obstacle in self.obstacles)
        spans = [obstacle.trajectory.span for obstacle in self.obstacles]
        self._spans = np.array(spans, dtype=np.float64).reshape(-1, 2)
        self._at_rest = all(obstacle.at_rest for obstacle in self.obstacles)
        self._uncertain = any(obstacle.uncertainty is not None for obstacle in self.obstacles)
        self.is_passive = not all(obstacle.contact_at_rest for obstacle in self.obstacles)
        self.has_futures = any(obstacle.probability < 1.0 for obstacle in self.obstacles)
        self._bodies: dict[tuple[Shape, int, float], Bodies] = {}
        self._parts: dict[bool, tuple[ObstacleTable, tuple[Obstacle, ...]]] = {}

    def __repr__(self) -> str:
        return f"<ObstacleTable, obstacles: {len(self)}>"

    def __len__(self) -> int:
        return len(self.obstacles)

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_bodies": {}, "_parts": {}}

    def exist(self, t: float) -> Flags:
        """Whether each obstacle exists at time t [s]: (n,)."""
        return np.asarray((self._spans[:, 0] <= t) & (t <= self._spans[:, 1]))

    def split(self, *, at_rest: bool) -> tuple["ObstacleTable", tuple[Obstacle, ...]]:
        """The obstacles whose pieces serve many decisions, as a table; and the others.

        The others have an uncertainty, which depends on the time of the decision, or no direction at first. With
        `at_rest` all that move are among them as well: every forecast agrees on obstacles at rest.
        """
        if at_rest not in self._parts:
            serves = [o.uncertainty is None and (o.at_rest if at_rest else o.has_first_direction) for o in self.given]
            others = tuple(o for o, yes in zip(self.given, serves) if not yes)
            table = self if not others else ObstacleTable(o for o, yes in zip(self.given, serves) if yes)
            self._parts[at_rest] = table, others
        return self._parts[at_rest]

    def bodies(self, robot: Shape, start: float, until: Array, horizon: float, reach: Reach | None = None) -> Bodies:
        """The pieces of bodies grown by a robot's shape, with times from `start` on.

        Args:
            reach: bodies that are farther away from it are left out; None: none is.
            until: (n,) [s] after the start, up to which each obstacle counts. A body that does not exist then has no
                pieces.
            horizon: [s] the largest value of `until` at this and other decisions.

        Raises:
            InvalidInput: an obstacle with an uncertainty, or whose trajectory ended before the start.
        """
        if not len(self):
            return no_bodies(robot.dimension, 0)
        bodies = self.stretch(robot, start, horizon)
        some = np.arange(len(bodies.each))
        if reach is not None:
            some = kernels.balls_near(bodies.body_balls, reach.position, reach.distance + reach.clearance)
        within = bodies
        if len(some) < len(bodies.each):
            balls = bodies.body_balls[some]
            within = bodies._replace(each=bodies.each[some], hull=bodies.hull[some], body_balls=balls)
        pieces, balls, first = kernels.pieces_within(
            bodies.pieces, bodies.balls, bodies.first_piece, some, start, until[within.each["owner"]]
        )
        return within._replace(pieces=pieces, balls=balls, first_piece=first, now=0.0)

    @cached_property
    def outlines(self) -> Outlines:
        """The outlines of the obstacles around which detours lead."""
        return outlines(self.obstacles)

    def stretch(self, robot: Shape, start: float, horizon: float, until: Array | None = None) -> Bodies:
        """All bodies grown by a robot's shape, from now, the `start` [s], on; times are absolute.

        until: (n,) [s] after the start, up to which each obstacle counts; None: all count at all times.

        Over the stretch of time that contains the start and a horizon [s] after it; over all time if all obstacles are
        at rest.

        Raises:
            InvalidInput: an obstacle with an uncertainty, or whose trajectory ended before the start.
        """
        if self._uncertain:
            raise InvalidInput("obstacles: expected a table of obstacles without uncertainty, found one with it")
        if start > self._known_until:
            for obstacle in self.given:
                obstacle.known_at(start)
        if self._at_rest:
            stretch = 0
            horizon = 0.0
            begin = -LARGEST
            end = LARGEST
        else:
            length = STRETCH_HORIZONS * horizon
            stretch = _stretch(start, horizon)
            begin, end = stretch * length, (stretch + 1) * length + horizon
        key = (robot, stretch, horizon)
        made = self._bodies.get(key)
        if made is None:
            made = self._made(robot, begin, end)
            # Earlier stretches are over. A new dictionary: other threads may go through the former one.
            kept = {k: one for k, one in self._bodies.items() if k[2] != horizon or k[1] == stretch}
            self._bodies = {**kept, key: made}
        return made._replace(now=start, until=made.until if until is None else until)

    def serves_until(self, start: float, horizon: float) -> float:
        """The time [s] from which on `stretch` makes other bodies, or refuses, than at the `start` [s]."""
        end = np.inf if self._at_rest else (_stretch(start, horizon) + 1) * STRETCH_HORIZONS * horizon
        return float(min(end, self._known_until))

    def _made(self, robot: Shape, begin: float, end: float) -> Bodies:
        """All bodies from begin to end [s]."""
        shapes = [minkowski_sum(obstacle, robot) for obstacle in self.obstacles]
        tables = [
            rows_of(obstacle, shape, begin, max(begin, first), min(end, last))
            for obstacle, shape, (first, last) in zip(self.obstacles, shapes, self._spans.tolist())
        ]
        bodies = joined(self.obstacles, range(len(shapes)), shapes, tables, 0.0)
        balls = kernels.body_balls(bodies.balls, bodies.first_piece, bodies.radius + bodies.hull_radius)
        return bodies._replace(body_balls=balls)


def _stretch(start: float, horizon: float) -> int:
    """The number of the stretch of time that contains the start [s]."""
    length = STRETCH_HORIZONS * horizon
    number = int(np.floor(start / length))
    # Rounding of the quotient.
    return number - (number * length > start)


def one_dimension(dimensions: Iterable[int | None]) -> int | None:
    """The dimension of all, None where there is none. Raises InvalidInput for different ones."""
    found = {dimension for dimension in dimensions if dimension is not None}
    if len(found) > 1:
        raise InvalidInput(f"obstacles: expected one dimension, found {sorted(found)}")
    return found.pop() if found else None


def same_dimension(found: int | None, expected: int, name: str, whose: str) -> None:
    """Raise InvalidInput for a dimension that is not the `expected` one, `whose` it is; None fits every one."""
    if found not in (None, expected):
        raise InvalidInput(f"{name}: expected dimension {expected} as of the {whose}, found {found}")
