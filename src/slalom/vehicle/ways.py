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
from math import hypot, inf, pi
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array, array, array_of, flag, not_negative, positive, whole
from slalom.base.errors import InvalidInput
from slalom.kernels.arrays import Indices
from slalom.kernels.vehicle.wheels import CREEPING
from slalom.model.goal import Goal
from slalom.model.shape import Shape
from slalom.obstacle import Obstacle
from slalom.vehicle.curves import Way, dubins, ends, reeds_shepp, reversals, to_place, turn_and_drive
from slalom.vehicle.search import NONE, Candidate, Driving, Field, Judge, Search, arcs_of, joints, shortened
from slalom.vehicle.sweep import Scene, convex_bodies, outline
from slalom.vehicle.vehicle import Pose, Vehicle

WIDER: Final = (1.0, 1.5, 2.5)
"""[1] Radii of direct curves from the start to the goal, in least radii. More: more work for the first way. Fewer:
direct ways are found less often."""

GOOD: Final = 1.3
"""[1] A direct way of up to this many times the cost of the shortest without obstacles ends the search. Larger: longer
ways, sooner. 1: ways that keep the clearance are always searched."""

STEPS: Final = (0.16, 0.06, 0.025, 0.01)
"""[1] Lengths of the steps of successive searches, in distances of the farthest point of the body from the axle.
Larger: quicker searches that miss narrow ways. Smaller: more poses."""

HEADINGS: Final = 16
"""[1] Headings at a place from which ways are searched that end there, besides those along the line to it. More: ways
to places in narrow surroundings are found more often, with more work."""


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


# Ways of a vehicle to its goal: which ones it tries, and the motion along one.


RADIUS_SLACK: Final = 1.05
"""[1] Radius of the turns of ways, in least radii of the vehicle. The rest is for the correction of errors. Larger:
longer ways. Smaller: the vehicle does not come back to a way that it left to the outside."""

DIRECT_WAYS: Final = 6
"""[1] Most direct ways that are tried, the shortest first. More: longer decisions. Fewer: more searches."""

OFF_WAY: Final = 0.1
"""[1] Distance from a way, in wheelbases or tracks, beyond which it is given up. Smaller: more new ways. Larger:
errors."""


OFF_BY: Final = 0.005
"""[1] Error of an arc of a way in a narrow place, in wheelbases or tracks, of turns in rad. Larger: the vehicle touches
what is beside the way. Smaller: slower."""

MOST_POSES: Final = 2000
"""[1] Poses at which a search for a way ends, after 1 to 3 s. More: ways in narrower places, and longer waiting."""

AS_QUICK: Final = 1.2
"""[1] Ways to a place that take up to this many times as long as the quickest are tried. Larger: vehicles drive
backwards, or around, where others only pass. Smaller: fewer ways."""

SAME_PLACE: Final = 0.1
"""[1] Distance, in tolerances of a goal, within which a goal is the same as before. Larger: ways that end beside it."""


class Following(NamedTuple):
    """A way to a goal, and where on it a vehicle is predicted to be.

    Attributes:
        goal: at which it ends. arcs: (n, 2) length [m], turn [rad]. poses: (n + 1, 3) at their begins and at the end.
        start: [s] of the first prediction. period: [s] between them.
        careful: whether the vehicle stands where the curvature changes, and so never leaves the arcs.
        at: (k,) the arc that the vehicle is on, n at the end. driven: (k,) [m] its distance on that arc.
    """

    goal: Goal
    arcs: Array
    poses: Array
    start: float
    period: float
    careful: bool
    at: Indices
    driven: Array

    def place(self, now: float) -> tuple[int, float]:
        """The arc on which the vehicle is predicted to be at `now` [s], and the distance [m] on it."""
        k = min(max(round((now - self.start) / self.period), 0), len(self.at) - 1)
        return int(self.at[k]), float(self.driven[k])

    def error(self, now: float, motion: Array) -> float:
        """Distance [m] of a motion (5,) from the arc on which it is predicted to be at `now` [s]."""
        k, driven = self.place(now)
        if k == len(self.arcs) or self.arcs[k, 0] == 0.0:
            return float(hypot(*(motion[:2] - self.poses[min(k + 1, len(self.arcs)), :2])))
        length, turn = self.arcs[k].tolist()
        return abs(float(kernels.on_arc(motion, self.poses[k], length, turn, driven)[1]))

    def missed(self, now: float, pose: Pose) -> bool:
        """Whether a vehicle at a pose stands at the end of the way, and not at the goal."""
        if self.place(now)[0] < len(self.arcs) or abs(pose.speed) > CREEPING:
            return False
        return not self.goal.reached(pose.position, pose.velocity, now, pose.heading)


def begun(vehicle: Vehicle, motion: Array, way: Way, goal: Goal, now: float, careful: bool) -> Following:
    """The following of a way that begins at a motion (5,) at `now` [s]."""
    arcs = np.array(way, dtype=np.float64).reshape(-1, 2)
    first = np.zeros(1, np.int64), np.zeros(1)
    return Following(goal, arcs, np.ascontiguousarray(ends(motion[:3], way)), now, vehicle.period, careful, *first)


def ends_within(vehicle: Vehicle, way: Following, room: float) -> Array:
    """The distances (n,) from the ends of the arcs of a way within which a vehicle ends them [m], turns in [rad].

    Law: the distances of all arcs together, and one more as large, are within the tolerance of the goal. Headings are
    those of the way again on each arc, so that each one may be off by half of their tolerance. A distance is at most
    the `room` [m] beside the way, OFF_BY on a careful one.
    """
    goal, length, turn = way.goal, *np.abs(way.arcs.T)
    slack = OFF_BY * vehicle.wheels.base
    far = min(goal.tolerance / (len(length) + 1.0), slack if way.careful else max(room, slack))
    faces = inf if goal.heading is None else 0.5 * goal.heading_tolerance
    faces = min(faces, OFF_BY) if way.careful else faces
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(length > 0.0, np.fmin(far, faces * length / turn), faces)


def followed(
    vehicle: Vehicle, motion: Array, way: Following, now: float, fastest: float, count: int, room: float
) -> tuple[Array, Following]:
    """Motions (count + 1, 5) of a vehicle along a way from `now` [s] on, and where it is on it; see `ends_within`."""
    k, driven = way.place(now)
    wheels, stops = vehicle.wheels, way.goal.stop
    within = ends_within(vehicle, way, room)
    motions, at, there = kernels.along_way(
        wheels, motion, way.arcs, way.poses, within, k, driven, fastest, stops, way.careful, count
    )
    return motions, way._replace(start=now, at=at, driven=there)


def direct_ways(vehicle: Vehicle, motion: Array, goal: Goal, now: float) -> list[Way]:
    """Ways from a motion (5,) to a goal at rest, the quickest first, whatever is in the way.

    To a place only those that take about as long as the quickest: plans of the point lead around others.
    """
    pose, place = motion[:3], goal.position(now)
    radius, backs = RADIUS_SLACK * vehicle.least_radius, vehicle.backs
    if goal.heading is None:
        found = to_place(pose, place, radius, backs, vehicle.turns_on_spot)
    else:
        # What is within the tolerance of the place only turns.
        there = vehicle.turns_on_spot and hypot(*(place - pose[:2])) <= goal.tolerance
        end = np.array([*(pose if there else place)[:2], goal.heading])
        if vehicle.turns_on_spot:
            found = turn_and_drive(pose, end, backs)
        else:
            found = reeds_shepp(pose, end, radius) if backs else dubins(pose, end, radius)
    times = [duration(vehicle, way) for way in found]
    order = sorted(range(len(found)), key=lambda k: times[k])
    if goal.heading is None:
        order = [k for k in order if times[k] <= AS_QUICK * times[order[0]]]
    return [found[k] for k in order[:DIRECT_WAYS]]


def duration(vehicle: Vehicle, way: Way) -> float:
    """The time [s] of a way at the largest speeds, with a stop at each change of direction."""
    forwards, fastest = vehicle.limits.max_speed, vehicle.limits.max_acceleration
    backwards = max(vehicle.wheels.max_reverse, CREEPING)
    driven = sum(arc.length / forwards if arc.length > 0.0 else -arc.length / backwards for arc in way)
    turned = sum(abs(arc.turn) / vehicle.wheels.max_turn for arc in way if arc.length == 0.0)
    return driven + turned + reversals(way) * (forwards + backwards) / fastest


def search(
    vehicle: Vehicle,
    motion: Array,
    goal: Goal,
    now: float,
    body: Shape,
    center: float,
    around: list[Any],
    clearance: float,
) -> WayFound:
    """A way from a motion (5,) to a goal among obstacles at rest, geometries of shapely, or why there is none."""
    place = goal.position(now)
    return way_among(
        motion[:3],
        place if goal.heading is None else np.array([*place, goal.heading]),
        body,
        around,
        RADIUS_SLACK * vehicle.least_radius,
        center=center,
        reverse=vehicle.backs,
        turns_on_spot=vehicle.turns_on_spot,
        clearance=clearance,
        most_poses=MOST_POSES,
    )


def geometry(obstacle: Obstacle, now: float) -> Any:
    """The geometry of shapely that contains an obstacle at `now` [s]."""
    e = obstacle.direction(now)
    angle = obstacle.angle if obstacle.angle is not None else float(np.arctan2(e[1], e[0]))
    return outline(obstacle.shape, obstacle.trajectory.position(now), angle)


def same_goal(one: Goal | None, other: Goal, now: float) -> bool:
    """Whether two goals at rest are the same for a vehicle."""
    if one is None or one.heading != other.heading or one.stop != other.stop:
        return False
    return float(np.linalg.norm(one.position(now) - other.position(now))) <= SAME_PLACE * other.tolerance


def is_for(way: Following | None, goal: Goal, now: float) -> bool:
    """Whether a way ends at a goal."""
    return way is not None and same_goal(way.goal, goal, now)
