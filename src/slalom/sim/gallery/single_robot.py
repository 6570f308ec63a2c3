"""Scenarios of one robot among obstacles: they join the gallery."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slalom.checks import not_negative, positive, whole
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.io.tracks import read_tracks, sample_data
from slalom.limits import Limits
from slalom.obstacle import Obstacle
from slalom.shape import Ball, Disc, Polyline, Union
from slalom.sim.gallery.placement import random_angles
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import Circular, Composite, ConstantVelocity, PiecewisePolynomial, Sampled, Stationary


def empty(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """A robot alone."""
    state = State((0.0, 0.0), (0.0, 0.0))
    goal = Goal(Stationary((p["distance"], 0.0)), 0.2, stop=True)
    return Scenario("empty", (Robot(Disc(0.5), Limits(2.0, 1.0), state, goal),))


def head_on(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """One car comes straight towards the robot."""
    state = State((0.0, 0.0), (p["speed"], 0.0))
    goal = Goal(Stationary((40.0, 0.0)), 1.0)
    car = Obstacle(Disc(1.0), ConstantVelocity((40.0, p["offset"]), (-p["speed"], 0.0)), "car")
    robot = Robot(Disc(1.0), Limits(2 * p["speed"], 3.0), state, goal)
    return Scenario("head_on", (robot,), (car,), duration=30.0)


def curved_road(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Four vehicles on a road that bends: the robot on the outer lane, which shall gain 15 m, and three others.

    The paper's example of what a velocity obstacle gets wrong: the fast car that comes up on the middle lane would, if
    it went straight on, run into the robot; it follows its lane and never does.
    """
    inner, middle, outer = p["radius"], p["radius"] + 4.0, p["radius"] + 8.0
    speed = p["speed"]
    lanes = ((middle, 1.3 * speed, -0.22), (middle, 0.9 * speed, 0.7), (inner, speed, 0.1))
    cars = tuple(
        Obstacle(Disc(1.5), Circular((0.0, 0.0), radius, v, phase), f"car {k}")
        for k, (radius, v, phase) in enumerate(lanes)
    )
    place = Circular((0.0, 0.0), outer, speed, 15.0 / outer)
    robot = Robot(Disc(1.0), Limits(1.6 * speed, 4.0), State((outer, 0.0), (0.0, speed)), Goal(place, 1.5, stop=True))
    return Scenario("curved_road", (robot,), cars, duration=40.0, horizon=3.0)


def lanes_of_cars(p: Mapping[str, float], rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Thirty vehicles in three circular lanes, one speed per lane, random phases at least 4.5 m apart."""
    cars: list[Obstacle] = []
    for lane, (radius, speed) in enumerate(((12.0, 5.0), (16.0, 6.5), (20.0, 8.0))):
        phases = random_angles(10, 4.5 / radius, rng, "cars of a lane")
        for phase in phases:
            path = Circular((0.0, 0.0), radius, speed * p["speed"], phase)
            cars.append(Obstacle(Disc(1.0), path, f"lane {lane + 1} car {len(cars)}"))
    return tuple(cars)


def roundabout_crossing(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The paper's roundabout, crossed from left to right among 30 vehicles."""
    robot = Robot(
        Disc(1.0),
        Limits(8.0, p["max_acceleration"]),
        State((-26.0, 0.0), (5.0, 0.0)),
        Goal(Stationary((26.0, 0.0)), 1.0),
    )
    return Scenario("roundabout_crossing", (robot,), lanes_of_cars(p, rng), duration=60.0)


def roundabout_exit(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """The paper's roundabout, entered on the left and left at the top."""
    crossing = roundabout_crossing(p, rng)
    robot = replace(crossing.robot, goal=Goal(Stationary((0.0, 26.0)), 1.0))
    return replace(crossing, name="roundabout_exit", robots=(robot,))


def merging(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """A robot at the entry of the paper's roundabout sees a gap come, joins the flow there, and leaves further round.

    The gap is a random one of the outer lane of at least `gap` [m] from car to car; its middle passes the entry after
    `wait` [s]; the exit is `exit` [degrees] further round. The goal runs ahead, from the middle of the gap along the
    lane and out at the exit, where it slows down and waits. In the lane it is 5 % faster than the cars, which are as
    fast as the robot can be: so it is not reached before the exit.
    """
    cars = lanes_of_cars(p, rng)
    lane = [car.trajectory for car in cars if isinstance(car.trajectory, Circular) and car.trajectory.radius == 20.0]
    phases = np.sort([path.phase % (2.0 * np.pi) for path in lane])
    gaps, top, rate = np.diff(phases, append=phases[0] + 2.0 * np.pi), lane[0].speed, lane[0].rate
    wide = np.flatnonzero(20.0 * gaps >= p["gap"])
    if not wide.size:
        raise InvalidInput(f"gap: expected at most {20.0 * gaps.max():g} m, the widest, found {p['gap']:g} m")
    k = rng.choice(wide)
    passes = (np.pi - phases[k] - 0.5 * gaps[k]) % (2.0 * np.pi) / rate
    ahead = Circular((0.0, 0.0), 20.0, 1.05 * top, np.pi - 1.05 * rate * passes)
    leaves = passes + np.radians(positive(p["exit"], "exit")) / ahead.rate
    place, velocity = ahead.position(leaves), ahead.velocity(leaves)
    out = velocity / ahead.speed + 0.5 * place / 20.0
    out *= ahead.speed / np.linalg.norm(out)
    # It brakes evenly, with 2 m/s^2.
    road = PiecewisePolynomial([0.5 * ahead.speed], [[place, out, -out / ahead.speed]], leaves)
    goal = Goal(Composite((ahead, road), (float(leaves),)), 0.3, stop=True)
    robot = Robot(Disc(1.0), Limits(top, p["max_acceleration"]), State((-25.0, 0.0), (0.0, 0.0)), goal)
    start = float(passes) - not_negative(p["wait"], "wait")
    return Scenario("merging", (robot,), cars, start=start, duration=60.0)


def drones_crossing(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """A drone crosses a hall in which others fly back and forth on quintic pieces from waypoint to waypoint."""
    others = []
    for k in range(whole(p["drones"], "drones")):
        stops = np.column_stack([rng.uniform(-4, 4, 9), rng.uniform(-4, 4, 9), rng.uniform(0.5, 3.5, 9)])
        durations = np.maximum(np.linalg.norm(np.diff(stops, axis=0), axis=1) / p["speed"], 0.8)
        powers = np.zeros((8, 6, 3))
        powers[:, 0] = stops[:-1]
        for power, weight in ((3, 10.0), (4, -15.0), (5, 6.0)):
            powers[:, power] = weight * np.diff(stops, axis=0) / durations[:, None] ** power
        others.append(Obstacle(Ball(0.3), PiecewisePolynomial(durations, powers), f"drone {k + 1}"))
    state, goal = State((-7.0, 0.0, 2.0), np.zeros(3)), Goal(Stationary((7.0, 0.0, 2.0)), 0.3, stop=True)
    robot = Robot(Ball(0.3), Limits(3.0, 4.0), state, goal, "drone")
    return Scenario("drones_crossing", (robot,), tuple(others), duration=25.0, horizon=4.0)


def corridor(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """A robot goes along a corridor and through a doorway in it, against and among people who walk through it."""
    half, door, reach = 2.0, 0.5 * p["door"], 14.0
    walls = Union(
        (
            Polyline([(-reach, half), (reach, half)], 0.05),
            Polyline([(-reach, -half), (reach, -half)], 0.05),
            Polyline([(0.0, half), (0.0, door)], 0.05),
            Polyline([(0.0, -half), (0.0, -door)], 0.05),
        )
    )
    people = []
    for k in range(whole(p["people"], "people")):
        # They line up for the doorway; every third goes the robot's way.
        way = 1.0 if k % 3 == 0 else -1.0
        pace, through = rng.uniform(0.9, 1.4), 4.0 + 3.0 * k + rng.uniform(-0.6, 0.6)
        lanes = rng.uniform(-1.4, 1.4, 2)
        x = np.array([-30.0, -8.0, -4.0, -0.6, 0.6, 4.0, 8.0, 30.0])
        y = np.array([lanes[0], lanes[0], 0.6 * lanes[0], 0.0, 0.0, 0.6 * lanes[1], lanes[1], lanes[1]])
        track = Sampled(through + x / pace, np.column_stack([way * x, y]), "smooth")
        people.append(Obstacle(Disc(0.25), track, f"person {k + 1}"))
    state, goal = State((-9.0, 0.0), (0.0, 0.0)), Goal(Stationary((9.0, 0.0)), 0.3, stop=True)
    robot = Robot(Disc(0.3), Limits(1.5, 1.0), state, goal)
    around = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"), *people)
    return Scenario("corridor", (robot,), around, duration=60.0, horizon=6.0)


def recorded_roundabout(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """A recorded roundabout: 30 cars that yield to each other but not to the robot."""
    tracks = read_tracks(sample_data("roundabout_ring_11.csv"))
    cars = tuple(Obstacle(Disc(2.4), track, f"car {agent}") for agent, track in tracks.items())
    angle = rng.uniform(0.0, 2.0 * np.pi) if p["random"] else 0.0
    place = 58.0 * np.array([np.cos(angle), np.sin(angle)])
    robot = Robot(Disc(1.0), Limits(12.0, 4.0), State(place, np.zeros(2)), Goal(Stationary(-place), 1.5))
    return Scenario("recorded_roundabout", (robot,), cars, start=p["at"], duration=45.0, horizon=8.0)
