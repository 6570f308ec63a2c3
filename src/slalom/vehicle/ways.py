"""A way for a body among obstacles at rest: direct curves, then a search over short arcs in the manner of hybrid A*.

Two trees of poses grow, one from the start and one, against the driving direction, from the goal. Both are joined by
direct curves (`curves`). So a vehicle leaves a narrow place, and enters one, by short arcs, and drives between them by
the words of Reeds and Shepp, or those of Dubins if it does not reverse. Every arc of a way is certified (`sweep`).

The cost of a way is its length [m], with additions for changes of direction, turns on the spot and what is nearer to
obstacles than the clearance (`search`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import inf, pi
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array, array_of, flag, not_negative, positive, whole
from slalom.base.errors import InvalidInput
from slalom.model.shape import Shape
from slalom.vehicle.curves import Way, ends
from slalom.vehicle.search import NONE, Candidate, Driving, Field, Judge, Search, arcs_of, joints, shortened
from slalom.vehicle.sweep import Scene, convex_bodies

WIDER: Final = (1.0, 1.5, 2.5)
"""[1] Radii of direct curves from the start to the goal, in least radii.

More: more work for the first way. Fewer: direct ways are found less often.
"""

GOOD: Final = 1.3
"""[1] A direct way of up to this many times the cost of the shortest without obstacles ends the search.

Larger: longer ways, sooner. 1: ways that keep the clearance are always searched.
"""

STEPS: Final = (0.16, 0.06, 0.025, 0.01)
"""[1] Lengths of the steps of successive searches, in distances of the farthest point of the body from the axle.

Larger: quicker searches that miss narrow ways. Smaller: more poses.
"""

HEADINGS: Final = 16
"""[1] Headings at a place from which ways are searched that end there, besides those along the line to it.

More: ways to places in narrow surroundings are found more often, with more work.
"""


class Outcome(Enum):
    """What the search for a way ended with."""

    FOUND = "A way was found."
    OVERLAP_AT_START = "The body at the start is in an obstacle, or nearer to it than the resolution."
    OVERLAP_AT_GOAL = "The body at every pose of the goal is in an obstacle, or nearer to it than the resolution."
    EXHAUSTED = "There is no way along arcs of the finest step."
    UNKNOWN = "The search ended after its largest number of poses."


@dataclass(frozen=True)
class WayFound:
    """A way among obstacles, or why there is none.

    Attributes:
        way: arcs (length [m], turn [rad]) from the start to the goal; None without one.
        outcome: how the search ended. goal: the index of the reached pose of the goal; None without a way, and
            for a place.
        cost: [m] of the way; inf without one. kept: whether the whole way keeps the clearance.
        obstacle: the index of an obstacle in which the body is at the start or the goal; None otherwise.
        searched: the number of poses from which the search was continued.
    """

    way: Way | None
    outcome: Outcome
    goal: int | None = None
    cost: float = inf
    kept: bool = False
    obstacle: int | None = None
    searched: int = 0

    def __str__(self) -> str:
        at = "" if self.obstacle is None else f" Obstacle {self.obstacle}."
        return f"{self.outcome.value}{at} Poses searched: {self.searched}."


def way_among(
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    body: Shape,
    obstacles: Sequence[Any],
    radius: float = 0.0,
    *,
    center: float = 0.0,
    reverse: bool = True,
    turns_on_spot: bool = False,
    clearance: float = 0.0,
    most_poses: int = 4000,
) -> WayFound:
    """A way of a body from a pose to a goal among obstacles at rest, or why none was found.

    Poses are (x, y, heading) [m, rad] of the middle of the (rear) axle. Law: along a way, the body touches no obstacle
    at any time, and ends at the goal exact to rounding. The same input has the same result.

    Args:
        goal: a pose (3,); poses (n, 3), of which any is reached; or a place (2,), with any heading there.
        body: a shape in the plane, its x axis along the heading. Its position is `center` [m] ahead of the axle.
        obstacles: geometries of shapely in the plane, such as those of `outline`.
        radius: [m] least radius of turns. With `turns_on_spot` turns are on the spot, and it is not used.
        reverse: whether the vehicle also drives backwards.
        clearance: [m] to obstacles that is kept where it costs little; less is kept elsewhere. A margin that is always
            kept is a rounding of the body, such as Rectangle(4.5, 1.8, radius=0.05).
        most_poses: at which the search ends (UNKNOWN).

    Raises:
        InvalidInput: values of other kinds, shapes or ranges.
    """
    at, goals = array_of(start, "start", (3,)), np.atleast_2d(array(goal, "goal"))
    place = goals.shape == (1, 2)
    if place:
        goals = _at_place(at, goals[0])
    if goals.ndim != 2 or goals.shape[1] != 3 or not len(goals):
        raise InvalidInput(f"goal: expected poses (x, y, heading) or a place (x, y), found shape {np.shape(goal)}")
    spot = flag(turns_on_spot, "turns_on_spot")
    least = not_negative(radius, "radius") if spot else positive(radius, "radius")
    scene = Scene(convex_bodies(body, center), obstacles)
    driving = Driving(least, flag(reverse, "reverse"), spot, scene.scale)
    judge = Judge(scene, driving, not_negative(clearance, "clearance"))
    most = whole(most_poses, "most_poses", 1)
    blocked = scene.overlapped(at)
    if blocked is not None:
        return WayFound(None, Outcome.OVERLAP_AT_START, obstacle=blocked)
    met = [scene.overlapped(one) for one in goals]
    free = [k for k, one in enumerate(met) if one is None]
    if not free:
        return WayFound(None, Outcome.OVERLAP_AT_GOAL, obstacle=met[0])
    found = _searched(judge, at, goals[free], place, most)
    return found if place or found.goal is None else replace(found, goal=free[found.goal])


def _at_place(start: Array, place: Array) -> Array:
    """Poses (n, 3) with headings in all directions at a place (2,), and along the line to it."""
    x, y = place - start[:2]
    course = float(np.arctan2(y, x)) if x or y else float(start[2])
    headings = np.concatenate([[course, course + pi], 2.0 * pi / HEADINGS * np.arange(HEADINGS)])
    return np.column_stack([np.broadcast_to(place, (len(headings), 2)), headings])


def _searched(judge: Judge, start: Array, goals: Array, place: bool, most: int) -> WayFound:
    """The way to one of the goals (n, 3), which are free; see `_direct`."""
    best, least = _direct(judge, start, goals, place)
    searched, ended = 0, False
    if best.cost > GOOD * least:
        roots = start[None], goals
        fields = Field(judge.scene, *roots), Field(judge.scene, *roots[::-1])
        for k, step in enumerate(STEPS):
            search = Search(judge, roots, step * judge.driving.scale, fields)
            left = most - searched
            # Coarse steps pass large rooms, and end soon in narrow places, where fine ones get the rest.
            ended = search.run(left if k == len(STEPS) - 1 else left // 2, best)
            searched += search.searched
            best = min(best, search.best, key=lambda each: each.cost)
            if best.cost < inf:
                break
    if best.cost == inf:
        return WayFound(None, Outcome.EXHAUSTED if ended else Outcome.UNKNOWN, searched=searched)
    best = shortened(judge, start, best)
    arcs = np.array(best.arcs).reshape(-1, 2)
    kept = judge.keeps(ends(start, best.arcs)[:-1], arcs[:, 0], arcs[:, 1])
    goal = None if place else best.goal
    return WayFound(tuple(best.arcs), Outcome.FOUND, goal, best.cost, kept, searched=searched)


def _direct(judge: Judge, start: Array, goals: Array, place: bool) -> tuple[Candidate, float]:
    """The cheapest direct way to one of the goals (n, 3), and the cost [m] of the cheapest without obstacles.

    With `place` the goals are poses at one place, and every heading there is one.
    """
    best, least = NONE, inf
    driving = judge.driving
    starts = np.broadcast_to(start, goals.shape)
    for wider in WIDER[: 1 if driving.turns_on_spot else None]:
        between = [driving.words(starts, goals, wider)]
        if place and not driving.turns_on_spot:
            between.append(driving.to_place(start, goals[0], wider))
        for each in between:
            found = joints(driving, each, np.zeros((len(each.total), 2)))
            costs = judge.costs(starts[found.pair], found.lengths, found.turns)
            costs += driving.reversals(found.lengths, np.zeros(1), np.zeros(1))
            least = min(least, found.bound.min())
            k = int(costs.argmin())
            if costs[k] < best.cost:
                best = Candidate(float(costs[k]), arcs_of(found.lengths[k], found.turns[k]), int(found.pair[k]))
    return best, least
