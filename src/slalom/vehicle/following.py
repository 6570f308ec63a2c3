"""Ways of a vehicle to its goal: which ones it tries, and the motion along one."""

from math import hypot
from typing import Any, Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import Array
from slalom.kernels.arrays import Indices
from slalom.kernels.vehicle.wheels import CREEPING
from slalom.model.goal import Goal
from slalom.model.shape import Shape
from slalom.obstacle import Obstacle
from slalom.vehicle.curves import Way, dubins, ends, reeds_shepp, reversals, to_place, turn_and_drive
from slalom.vehicle.sweep import outline
from slalom.vehicle.vehicle import Vehicle
from slalom.vehicle.ways import WayFound, way_among

RADIUS_SLACK: Final = 1.05
"""[1] Radius of the turns of ways, in least radii of the vehicle. The rest is for the correction of errors.

Larger: longer ways. Smaller: the vehicle does not come back to a way that it left to the outside.
"""

DIRECT_WAYS: Final = 6
"""[1] Most direct ways that are tried, the shortest first. More: longer decisions. Fewer: more searches."""

OFF_WAY: Final = 0.1
"""[1] Distance from a way, in wheelbases or tracks, beyond which it is given up.

Smaller: more new ways. Larger: errors.
"""


MOST_POSES: Final = 2000
"""[1] Poses at which a search for a way ends, after 1 to 3 s. More: ways in narrower places, and longer waiting."""

AS_QUICK: Final = 1.2
"""[1] Ways to a place that take up to this many times as long as the quickest are tried.

Larger: vehicles drive backwards, or around, where others only pass. Smaller: fewer ways.
"""

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


def begun(vehicle: Vehicle, motion: Array, way: Way, goal: Goal, now: float, careful: bool) -> Following:
    """The following of a way that begins at a motion (5,) at `now` [s]."""
    arcs = np.array(way, dtype=np.float64).reshape(-1, 2)
    first = np.zeros(1, np.int64), np.zeros(1)
    return Following(goal, arcs, np.ascontiguousarray(ends(motion[:3], way)), now, vehicle.period, careful, *first)


def followed(
    vehicle: Vehicle, motion: Array, way: Following, now: float, fastest: float, count: int
) -> tuple[Array, Following]:
    """Motions (count + 1, 5) of a vehicle along a way from `now` [s] on, and where it is on it."""
    k, driven = way.place(now)
    wheels, stops = vehicle.wheels, way.goal.stop
    motions, at, there = kernels.along_way(
        wheels, motion, way.arcs, way.poses, k, driven, fastest, stops, way.careful, count
    )
    return motions, way._replace(start=now, at=at, driven=there)


def is_direct(vehicle: Vehicle, goal: Goal, now: float) -> bool:
    """Whether a vehicle drives to a goal along ways: where plans of its point do not lead it there."""
    rests = not np.any(goal.velocity(now))
    return rests and (goal.heading is not None or not vehicle.turns_on_spot)


def direct_ways(vehicle: Vehicle, motion: Array, goal: Goal, now: float) -> list[Way]:
    """Ways from a motion (5,) to a goal at rest, the quickest first, whatever is in the way.

    To a place only those that take about as long as the quickest: plans of the point lead around others.
    """
    pose, place = motion[:3], goal.position(now)
    radius, backs = RADIUS_SLACK * vehicle.least_radius, vehicle.backs
    if goal.heading is None:
        found = to_place(pose, place, radius, backs, vehicle.turns_on_spot)
    else:
        end = np.array([*place, goal.heading])
        if vehicle.turns_on_spot:
            found = turn_and_drive(pose, end)
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
    backwards = forwards if vehicle.turns_on_spot else max(vehicle.wheels.max_reverse, CREEPING)
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
