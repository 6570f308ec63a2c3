"""Metrics of encounters of ships and aircraft: closest approach, changes of course, sides, and well clear.

The others of a robot are the obstacles that move and the other robots. Distances are between positions, so the shape of
an obstacle may be a domain that others must keep out of. Courses and sides are those of the horizontal motion, x and y.
A turn to starboard is clockwise, to port counter-clockwise, as seen from above.
"""

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.tolerances import REST
from slalom.kernels.arrays import Flags
from slalom.model.shape import round_shape
from slalom.obstacle import Obstacle
from slalom.sim.measure.closest_approach import ClosestApproach, closest_to, positions_at, single_robot_view
from slalom.sim.measure.recording import Recording, Which

COURSE_RATE: Final = float(np.radians(0.05))
"""[rad/s] Rate of turn above which a step counts as a turn: 3 degrees per minute. Larger: slow turns of ships are no
turns. Smaller: corrections of the course of fractions of a degree count."""

COURSE_CHANGE: Final = float(np.radians(5.0))
"""[rad] Change of course that is the action of a stand-on vessel. Larger: late actions. Smaller: corrections count."""

CROSSING_RANGE: Final = 5556.0
"""[m] Distance within which a crossing ahead of another vessel breaks the rules: 3 NM. Larger: crossings far ahead of
it, which do not impede it, count. Smaller: close ones of fast ships do not."""

CLEAR_STEP: Final = 0.1
"""[s] Interval of the samples of well clear; the time without is exact to this for each loss. Smaller: slower."""


class WellClear(NamedTuple):
    """Thresholds of well clear in RTCA DO-365, phase I, as in the configurations DO_365A of NASA's DAIDALUS.

    Attributes:
        distance: [m] of the horizontal distance and of the projected miss distance: 0.66 NM, about 4000 ft.
        time: [s] of the modified tau. height: [m] of the vertical distance: 450 ft.
    """

    distance: float = 1222.32
    time: float = 35.0
    height: float = 137.16


WELL_CLEAR: Final = WellClear()


def closest_approach(recording: Recording, robot: Which = None) -> float:
    """Distance at the closest point of approach (CPA) of all others [m], between positions; inf without others.

    It is min_t |q(t) - p(t)| of the robot's position p and the position q of an obstacle that moves or of a robot, in
    continuous time, at most 0.1 mm above the true one. `min_clearance` is that between the bodies.
    """
    return _nearest(recording, robot).clearance


def time_to_closest_approach(recording: Recording, robot: Which = None) -> float:
    """Time from the start of the run to the closest point of approach of all others [s]; inf without others.

    It is t - t_0 for the time t of `closest_approach`, on the motion that took place; predictions from a state are
    `min_time_to_collision`.
    """
    return _nearest(recording, robot).time - float(recording.times[0])


def course_changes(recording: Recording, robot: Which = None) -> float:
    """Number of times that the robot turns to the other side than before, by turns faster than COURSE_RATE.

    Let w_i be the angle from the horizontal velocity at step i to the one at step i + 1, over dt. It is the number of
    changes of sign in the sequence of those w_i with |w_i| > COURSE_RATE.
    """
    run = recording.only(robot)
    rates = _turns(run) / run.dt
    signs = np.sign(rates[np.abs(rates) > COURSE_RATE])
    return float(np.count_nonzero(np.diff(signs)))


def side(recording: Recording, robot: Which = None) -> float:
    """1 if the robot keeps the sides of rules 13 to 17 of the collision regulations at sea towards all others, else 0.

    The kind of an encounter is that at its start, see `keeps_side`.
    """
    run = single_robot_view(recording, robot)
    others = [one for one in run.obstacles if not one.at_rest]
    return float(all(keeps_side(run, other) for other in others))


def loss_of_well_clear(recording: Recording, robot: Which = None) -> float:
    """Time [s] during which the robot is not well clear of another aircraft (RTCA DO-365), from samples every 0.1 s.

    See `not_well_clear`.
    """
    run = single_robot_view(recording, robot)
    end = float(run.times[run.steps_of(0)][-1])
    times = np.arange(float(run.times[0]), end, CLEAR_STEP)
    lost = np.zeros(len(times), np.bool_)
    for obstacle in [one for one in run.obstacles if not one.at_rest]:
        there = _there(obstacle, times)
        t = times[there]
        path = obstacle.trajectory
        position = path.position(t) - positions_at(run, 0, t)
        lost[there] |= not_well_clear(position, path.velocity(t) - _velocities_at(run, t))
    return CLEAR_STEP * float(np.count_nonzero(lost))


def not_well_clear(position: Array, velocity: Array, limits: WellClear = WELL_CLEAR) -> Flags:
    """Return whether two aircraft are not well clear (n,), from relative positions and velocities (n, 2 or 3).

    With horizontal position s and velocity v: |s| <= distance; or they approach (s . v < 0), pass within `distance` at
    constant velocity (|s x v| / |v|), and the modified tau (distance^2 - s . s) / (s . v) is at most `time`. In space
    also |z| <= height. Law: the same for both aircraft. Source: Munoz et al., DASC 2015; RTCA DO-365.
    """
    s, v = position[:, :2], velocity[:, :2]
    closing = -np.sum(s * v, axis=1)
    square = np.sum(s * s, axis=1) - limits.distance**2
    miss = np.abs(_cross(s, v)) <= limits.distance * np.linalg.norm(v, axis=1)
    lost = (square <= 0.0) | ((closing > 0.0) & miss & (square <= limits.time * closing))
    return np.asarray(lost & (np.abs(position[:, 2:]) <= limits.height).all(axis=1))


# Sides of the International Regulations for Preventing Collisions at Sea (COLREG), rules 13 to 17.


class Sectors(NamedTuple):
    """Angles [rad] that tell the encounters of two vessels apart.

    Attributes:
        ahead: largest bearing of a vessel that is met head-on (rule 14). reciprocal: largest angle between the courses
            of one and the opposite of the other.
        abaft: bearing from which a vessel overtakes another: 22.5 degrees abaft the beam (rule 13).
    """

    ahead: float = float(np.radians(10.0))
    reciprocal: float = float(np.radians(15.0))
    abaft: float = float(np.radians(112.5))


SECTORS: Final = Sectors()


def encounter(position: Array, own: Array, other: Array, sectors: Sectors = SECTORS) -> str:
    """Return the kind of an encounter: head-on, overtaking, overtaken, give-way, stand-on; none without approach.

    Args:
        position: (2,) [m] of the other vessel relative to the own. own, other: (2,) [m/s] velocities, not 0.
    """
    if float(position @ (other - own)) >= 0.0:
        return "none"
    bearing = _angle(own, position)
    faster = float(np.linalg.norm(own)) - float(np.linalg.norm(other))
    if abs(bearing) <= sectors.ahead and abs(_angle(-own, other)) <= sectors.reciprocal:
        return "head-on"
    if abs(_angle(other, -position)) > sectors.abaft and faster > 0.0:
        return "overtaking"
    if abs(bearing) > sectors.abaft and faster < 0.0:
        return "overtaken"
    return "give-way" if bearing < 0.0 else "stand-on"


def keeps_side(run: Recording, other: Obstacle) -> bool:
    """Return whether a single robot keeps the side towards another vessel, by the kind of their encounter at the start.

    - head-on: at the closest approach the other vessel is to port (rule 14).
    - give-way: the robot does not cross ahead of the other vessel within CROSSING_RANGE (rule 15).
    - stand-on: its first change of course by more than COURSE_CHANGE is not to port (rule 17).

    Overtaking vessels may pass on either side (rule 13). A vessel at rest has no course, hence no side.
    """
    steps = run.steps_of(0).stop - 1
    there = _there(other, run.times[: steps + 1])
    times = run.times[: steps + 1][there]
    if not len(times):
        return True
    position = (other.trajectory.position(times) - run.positions[: steps + 1, 0][there])[:, :2]
    velocity = np.asarray(other.trajectory.velocity(times))[:, :2]
    own = run.velocities[: steps + 1, 0, :2][there]
    if min(np.linalg.norm(own[0]), np.linalg.norm(velocity[0])) < REST:
        return True
    kind = encounter(position[0], own[0], velocity[0])
    if kind == "head-on":
        at = np.array([_closest(run, other).time])
        return bool(_cross(_velocities_at(run, at), other.trajectory.position(at) - positions_at(run, 0, at))[0] > 0.0)
    if kind == "give-way":
        # Of the robot, along and across the course of the other vessel, times its speed.
        ahead, across = -np.sum(position * velocity, axis=1), _cross(position, velocity)
        beside = np.flatnonzero(across)
        flips = np.flatnonzero(across[beside[:-1]] * across[beside[1:]] < 0.0)
        k, after = beside[flips], beside[flips + 1]
        share = across[k] / (across[k] - across[after])
        distance = (ahead[k] + share * (ahead[after] - ahead[k])) / np.linalg.norm(velocity[k], axis=1)
        return not np.any((distance > 0.0) & (distance < CROSSING_RANGE))
    if kind == "stand-on":
        course = np.cumsum(_turns(run)[:steps])
        acted = np.flatnonzero(np.abs(course) > COURSE_CHANGE)
        return not len(acted) or bool(course[acted[0]] < 0.0)
    return True


def _nearest(recording: Recording, robot: Which) -> ClosestApproach:
    """Return the closest approach of all others, between positions."""
    run = single_robot_view(recording, robot)
    found = [_closest(run, one) for one in run.obstacles if not one.at_rest]
    return min(found, key=lambda one: one.clearance, default=ClosestApproach(np.inf, np.inf))


def _closest(run: Recording, other: Obstacle) -> ClosestApproach:
    """Return the closest approach of the positions of a single robot and an obstacle."""
    point = round_shape(0.0, run.dimension)
    return closest_to(replace(run, shapes=(point,)), 0, Obstacle(point, other.trajectory, other.name))


def _there(obstacle: Obstacle, times: Array) -> Flags:
    """Return at which of the times (k,) [s] an obstacle exists."""
    first, last = obstacle.trajectory.span
    return np.asarray((times >= first) & (times <= last))


def _velocities_at(run: Recording, times: Array) -> Array:
    """Return the velocities (k, d) [m/s] of a single robot at times (k,) [s] within the run."""
    if not len(run.accelerations):
        return np.asarray(run.velocities[np.zeros(len(times), np.int64), 0])
    k = np.clip(np.searchsorted(run.times, times, side="right") - 1, 0, len(run.accelerations) - 1)
    return np.asarray(run.velocities[k, 0] + (times - run.times[k])[:, None] * run.accelerations[k, 0])


def _turns(run: Recording) -> Array:
    """Return the angle (T,) [rad] by which the course of a single robot turns to port in each step; 0 at rest.

    The acceleration is constant in a step, so the course turns to one side only in it, by less than half a turn.
    """
    v = run.velocities[:, 0, :2]
    moves = np.linalg.norm(v, axis=1) >= REST
    return np.where(moves[:-1] & moves[1:], np.arctan2(_cross(v[:-1], v[1:]), np.sum(v[:-1] * v[1:], axis=1)), 0.0)


def _angle(a: Array, b: Array) -> float:
    """Return the angle (-pi, pi] from vector a (2,) to vector b (2,), positive to port."""
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _cross(a: Array, b: Array) -> Array:
    """Return the third component (k,) of the cross products of the horizontal parts of vectors (k, d)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
