"""Scenarios of several robots that meet each other in the open: they join the gallery."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slalom.checks import Array, not_negative, positive, whole
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.io.cadrl import Case
from slalom.limits import Limits
from slalom.shape import Disc
from slalom.sim.gallery.placement import on_circle, random_angles, random_positions, refuse_overlap, team
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import Stationary

AHEAD = 5.0
"""[1] See `ahead_for_ever`. Smaller: robots return to the lines on which they started."""
HOLDS = (0.5, 1.0, 2.0)
"""[s] A fleet decides often; three holds are enough for it."""


def circle(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Robots on a circle, all of which want to the opposite side; `noise` [m] moves their starts a little."""
    count, radius = whole(p["robots"], "robots", 1), positive(p["radius"], "radius")
    places = on_circle(2.0 * np.pi * np.arange(count) / count, radius)
    starts = places + rng.normal(0.0, 1.0, places.shape) * not_negative(p["noise"], "noise")
    limits = Limits(p["max_speed"], p["max_acceleration"])
    robots = team(starts, -places, Disc(p["robot_radius"]), limits, 0.5)
    return Scenario("circle", robots, duration=_long(2.0 * radius, limits), horizon=6.0, holds=HOLDS)


def _long(distance: float, limits: Limits) -> float:
    """[s] Four times what a robot needs for a distance [m], and 20 s."""
    return 4.0 * distance / limits.max_speed + 20.0


def circle_random(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Robots at random places of a circle, at least 0.2 m between them, all of which want to the opposite side."""
    count, radius = whole(p["robots"], "robots", 1), positive(p["radius"], "radius")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    least = 2.0 * np.arcsin(min(1.0, (shape.radius + 0.1) / radius))
    starts = on_circle(random_angles(count, float(least), rng, "robots"), radius)
    robots = team(starts, -starts, shape, limits, 0.5)
    return Scenario("circle_random", robots, duration=_long(2.0 * radius, limits), horizon=6.0, holds=HOLDS)


def ring(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The rings of comparisons of ORCA and its kin: robots on a circle that start at full speed to the opposite side.

    There robots prefer 1.5 m/s and may go up to 2 m/s; here `max_speed` is both, as limits know no preferred speed.
    `noise` [m] is the standard deviation of the starts.
    """
    count, radius = whole(p["robots"], "robots", 1), positive(p["radius"], "radius")
    places = on_circle(2.0 * np.pi * np.arange(count) / count, radius)
    starts = places + rng.normal(0.0, 1.0, places.shape) * not_negative(p["noise"], "noise")
    limits = Limits(p["max_speed"], p["max_acceleration"])
    robots = team(starts, -places, Disc(p["robot_radius"]), limits, 0.5, limits.max_speed)
    return Scenario("ring", robots, duration=_long(2.0 * radius, limits), horizon=6.0, holds=HOLDS)


def random_goals(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Robots at random places of a square with goals at other random places, none of which overlap."""
    count, half = whole(p["robots"], "robots", 1), 0.5 * positive(p["side"], "side")
    shape = Disc(p["robot_radius"])
    starts, goals = (
        random_positions(count, (-half, -half), (half, half), 2.0 * shape.radius + 0.2, rng) for _ in range(2)
    )
    robots = team(starts, goals, shape, Limits(p["max_speed"], p["max_acceleration"]), 0.3)
    return Scenario("random_goals", robots, duration=120.0, horizon=6.0, holds=HOLDS)


def crossing_streams(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Two streams of robots cross at an angle [degrees] and stop beyond; robots join one and the other by turns.

    Lanes are a diameter and 0.4 m apart; in a lane there is between 0.4 m and 2 m between robots. Before they cross,
    and after, the streams are clear of each other.
    """
    count, lanes = whole(p["robots"], "robots", 2), whole(p["lanes"], "lanes", 1)
    if not 0.0 < p["angle"] <= 180.0:
        raise InvalidInput(f"angle: expected more than 0 and at most 180 degrees, found {p['angle']:g}")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    angle, wide, row = np.radians(p["angle"]), 2.0 * shape.radius + 0.4, 2.0 * shape.radius + 1.2
    near = 4.0 + 0.5 * wide * lanes / np.tan(0.5 * angle)
    k, stream = np.arange(count) // 2, np.arange(count) % 2
    behind = near + row * (k // lanes) + rng.uniform(0.0, 0.8, count)
    across = wide * (k % lanes - 0.5 * (lanes - 1))
    along = on_circle(angle * stream, 1.0)
    lane = across[:, None] * along[:, ::-1] * (-1.0, 1.0)
    way = near + behind.max()
    robots = team(lane - behind[:, None] * along, lane + (way - behind)[:, None] * along, shape, limits, 0.3)
    return Scenario("crossing_streams", robots, duration=_long(way, limits), horizon=6.0, holds=HOLDS)


def navground_antipodal(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The experiment Antipodal of navground: twenty small slow robots change places on a circle of 2 m.

    There they are two-wheeled and without a limit on acceleration. A run is 1000 steps of 0.1 s, as there.
    """
    antipodal = circle(p, rng)
    robots = tuple(replace(robot, goal=replace(robot.goal, tolerance=0.2)) for robot in antipodal.robots)
    return replace(antipodal, name="navground_antipodal", robots=robots, duration=100.0, horizon=10.0, margin=0.02)


def navground_cross(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The experiment Cross of navground, each robot going once: from each side of a square to the opposite side.

    There all robots shuttle between two places, left and right or below and above; here everyone has places of its own
    in zones about those, at least 0.1 m from others. A run is 1000 steps of 0.1 s, as there.
    """
    count, side = whole(p["robots"], "robots", 1), positive(p["side"], "side")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    starts, goals = [], []
    for quarter in range(4):
        low, high = (-0.5 * side, -0.15 * side), (-0.3 * side, 0.15 * side)
        places = random_positions(
            (count + 3 - quarter) // 4, low, high, 2.0 * shape.radius + 0.1, rng, "robots of a side"
        )
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter]
        turn = np.array([[cosine, sine], [-sine, cosine]])
        starts.append(places @ turn)
        goals.append((places + np.array([0.8 * side, 0.0])) @ turn)
    robots = team(np.concatenate(starts), np.concatenate(goals), shape, limits, 0.2)
    return Scenario("navground_cross", robots, duration=100.0, horizon=10.0, margin=0.02, holds=HOLDS)


def navground_cross_torus(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The experiment CrossTorus of navground: robots that go east, north, west and south in a square that repeats.

    The 20 robots of 0.08 m that prefer 0.12 m/s, the side of 4 m, 0.12 m between them at first and the
    1000 steps of 0.1 s are those of navground 0.7.0 (cross_torus.yaml). There they have two wheels, no limit on
    acceleration and a horizon of 5 s; here it is that of the other two experiments. Nobody arrives: see
    `ahead_for_ever`.
    """
    count, side = whole(p["robots"], "robots", 1), positive(p["side"], "side")
    shape, limits = Disc(p["robot_radius"]), Limits(p["max_speed"], p["max_acceleration"])
    period = (side, side)
    starts = random_positions(count, (0.0, 0.0), period, 2.0 * shape.radius + 0.12, rng, period=period)
    along = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])[np.arange(count) % 4]
    robots = ahead_for_ever(starts, along, shape, limits, 100.0)
    return Scenario(
        "navground_cross_torus",
        robots,
        duration=100.0,
        horizon=10.0,
        margin=0.02,
        holds=HOLDS,
        period=period,
    )


def ahead_for_ever(starts: Array, along: Array, shape: Disc, limits: Limits, duration: float) -> tuple[Robot, ...]:
    """Equal robots that go `along` (n, 2) from `starts` (n, 2) [m] all the time.

    Their goals lie AHEAD times as far as they come within the duration [s]: who is half a metre beside its straight way
    heads back to it by half a degree.
    """
    goals = starts + AHEAD * duration * limits.max_speed * along
    return tuple(replace(r, goal=replace(r.goal, stop=False)) for r in team(starts, goals, shape, limits, 0.2))


def cadrl(case: Case, max_acceleration: float = 2.0) -> Scenario:
    """A test case of gym-collision-avoidance (see `io.cadrl`): discs from rest, each no faster than it prefers.

    A run lasts 8 times the longest straight way, as in the evaluation there; to arrive is to stop within 0.2 m. There
    acceleration has no limit; `max_acceleration` is in m/s^2.

    Raises:
        InvalidInput: robots that overlap at the start.
    """
    refuse_overlap(case.starts, case.radii, "starts")
    robots = tuple(
        Robot(
            Disc(float(case.radii[k])),
            Limits(float(case.speeds[k]), max_acceleration),
            State(case.starts[k], (0.0, 0.0)),
            Goal(Stationary(case.goals[k]), 0.2, stop=True),
            f"robot {k}",
        )
        for k in range(len(case.radii))
    )
    straight = np.linalg.norm(case.goals - case.starts, axis=1) / case.speeds
    duration = 0.1 * np.ceil(80.0 * straight.max())
    parameters = {"case": float(case.number), "max_acceleration": max_acceleration}
    return Scenario("cadrl", robots, duration=float(duration), horizon=6.0, holds=HOLDS, parameters=parameters)
