"""Right of way among robots of fleets: robots that are held up claim the ways to their targets.

Each robot of higher rank leaves these ways, see `kernels.decision.right_of_way`. Claims have no part in safety: with
any claim the decision of a robot keeps clear of all others as they are published or predicted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.decision.right_of_way import claimed
from slalom.kernels.decision.tables import ARRIVE, NO_CLAIMS, Claims, RobotTable
from slalom.obstacle import Obstacle

HELD_UP_SPEED: Final = 0.3
"""[1] A robot that comes nearer to its target at less than this share of its largest speed is held up. Larger: robots
that pass others slowly claim their ways. Smaller: robots that creep claim none."""

CLAIM_RECOVERY: Final = 10.0
"""[1] The time for which a robot has been held up falls so many times faster than it rises. Larger: a robot that starts
loses its right of way at once. With 2, claims of 10 s and more outlast their cause."""


class Standing(NamedTuple):
    """The right of way of one robot, as it publishes it."""

    visited: bool  # whether it has been at its goal
    left: float  # [m] distance to its goal
    position: tuple[float, float, float]  # [m]
    way: tuple[float, float, float]  # [m] from there to the end of the way that it claims
    width: float  # [m] half the width of that way; 0: it claims none


@dataclass(frozen=True, eq=False)
class PublishedManoeuvre(Obstacle):
    """A committed manoeuvre of another fleet, with the right of way of its robot; None: it takes no part in it."""

    standing: Standing | None = field(default=None, kw_only=True)


class RightOfWay:
    """The times for which `n` robots have been held up, and the order of their rights of way.

    Of two robots the one has the right of way that is not at its goal; then the one that has never been there, then
    the one with less distance left to it, then the one with the lesser coordinates.
    """

    def __init__(self, n: int) -> None:
        self.held_up = np.zeros(n)  # [s]
        self._goal = np.full((n, 3), np.nan)
        self._left = np.zeros(n)
        self._visited = np.zeros(n, np.bool_)
        self._others: list[Standing] = []
        self._active = True
        self._other_ranks = np.zeros(0, np.int64)

    def update(
        self,
        table: RobotTable,
        left: Array,
        goals: Array,
        tolerances: Array,
        period: float,
        others: Sequence[object],
        guided: bool,
    ) -> None:
        """Update these times, `period` [s] after the last update, and write the ranks into the table.

        Args:
            left: (n,) [m] to the goals, without their tolerances (n,) [m]. goals: (n, d) [m]; with a new goal a robot
                begins anew. others: among which those published by other fleets claim ways too.
            guided: whether guidance serves in place of claims, where there are no other fleets.
        """
        each, d = table.each, goals.shape[1]
        way = each["target"] - each["position"]
        away = np.linalg.norm(way, axis=1)
        # A robot at the end of its path may have been moved off it.
        left = np.maximum(left, away - each["tolerance"])
        new = ~(np.linalg.norm(goals - self._goal[:, :d], axis=1) <= tolerances) | ~each["present"]
        self._goal[new, :d], self._left = goals[new], left
        self._visited = (self._visited & ~new) | (left <= 0.0)
        nearer = (each["velocity"] * way).sum(axis=1) / np.maximum(away, 1e-12)
        slow = nearer < HELD_UP_SPEED * each["max_speed"]
        times = np.where(slow, self.held_up + period, np.maximum(self.held_up - CLAIM_RECOVERY * period, 0.0))
        claims = each["present"] & (each["objective"] == ARRIVE) & (left > 0.0) & ~new
        self.held_up = np.where(claims, times, 0.0)
        self._others = [one.standing for one in others if isinstance(one, PublishedManoeuvre) and one.standing]
        self._active = not guided or len(self._others) > 0
        if not self._active:
            return
        position = np.concatenate([each["position"], *([one.position] for one in self._others)])
        lefts = np.append(left, [one.left for one in self._others])
        visited = np.append(self._visited, [one.visited for one in self._others])
        ranks = np.empty(len(position), np.int64)
        keys = (*position.T[::-1], lefts, visited, lefts <= 0.0)
        ranks[np.lexsort(keys)] = np.arange(len(position))
        each["rank"], self._other_ranks = ranks[: len(left)], ranks[len(left) :]

    def _ways(self, each: Any, held_up: Array) -> tuple[Array, Array]:
        """The ways (m, 3) [m] that robots `each` (m,) claim, and half their widths (m,) [m]; 0: none is claimed."""
        return claimed(each, each["target"] - each["position"], held_up)

    def claims(self, table: RobotTable) -> Claims:
        """The claims of the robots in a table, and of other fleets in every world."""
        others = [k for k, one in enumerate(self._others) if one.width > 0.0]
        rows = np.flatnonzero(self.held_up > 0.0)
        if not self._active or not (len(rows) or others):
            return NO_CLAIMS
        each, worlds = table.each[rows], int(table.each["world"].max()) + 1
        way, width = self._ways(each, self.held_up[rows])
        some, met = np.flatnonzero(width > 0.0), [self._others[k] for k in others]
        world = np.concatenate([each["world"][some], np.repeat(np.arange(worlds), len(met))])
        order = np.argsort(world, kind="stable")
        columns = (
            (each["position"][some], [one.position for one in met]),
            (way[some], [one.way for one in met]),
            (width[some], [one.width for one in met]),
            (each["rank"][some], self._other_ranks[others]),
        )
        position, ways, widths, ranks = (
            np.concatenate([own, *[np.asarray(theirs, own.dtype)] * worlds] if met else [own])[order]
            for own, theirs in columns
        )
        return Claims(np.searchsorted(world[order], np.arange(worlds + 1)), position, ways, widths, ranks)

    def standings(self, table: RobotTable) -> list[Standing]:
        """The right of way of each robot, to publish."""
        each = table.each
        ways, widths = self._ways(each, self.held_up)
        rows = zip(
            self._visited.tolist(), self._left.tolist(), each["position"].tolist(), ways.tolist(), widths.tolist()
        )
        return [Standing(visited, left, tuple(at), tuple(way), width) for visited, left, at, way, width in rows]
