"""Gallery scenarios of one robot among obstacles."""

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from slalom.base.checks import Array, flag, not_negative, positive, whole
from slalom.base.errors import Extra, InvalidInput
from slalom.io.formats import read_recording
from slalom.io.table import sample_data
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Ball, Disc, Polygon, Polyline, Union
from slalom.model.state import State
from slalom.model.trajectory import Circular, Composite, ConstantVelocity, PiecewisePolynomial, Sampled, Stationary
from slalom.obstacle import Obstacle
from slalom.sim.placement import MAX_TRIES, random_angles
from slalom.sim.scenario import Robot, Scenario, from_numbers


def empty(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build a single robot without obstacles."""
    state = State((0.0, 0.0), (0.0, 0.0))
    goal = Goal(Stationary((p["distance"], 0.0)), 0.2, stop=True)
    return Scenario("empty", (Robot(Disc(0.5), Limits(2.0, 1.0), state, goal),))


def head_on(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build one car that drives straight towards the robot."""
    state = State((0.0, 0.0), (p["speed"], 0.0))
    goal = Goal(Stationary((40.0, 0.0)), 1.0)
    car = Obstacle(Disc(1.0), ConstantVelocity((40.0, p["offset"]), (-p["speed"], 0.0)), "car")
    robot = Robot(Disc(1.0), Limits(2 * p["speed"], 3.0), state, goal)
    return Scenario("head_on", (robot,), (car,), duration=30.0)


def curved_road(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build four vehicles on a curved road: the robot on the outer lane, with a goal 15 m ahead, and three cars.

    The paper's example of a false prediction by a velocity obstacle. The fast car on the middle lane would collide with
    the robot if it drove straight on. It follows its lane and never collides.
    """
    inner = p["radius"]
    middle = p["radius"] + 4.0
    outer = p["radius"] + 8.0
    speed = p["speed"]
    lanes = ((middle, 1.3 * speed, -0.22), (middle, 0.9 * speed, 0.7), (inner, speed, 0.1))
    cars = tuple(
        Obstacle(Disc(1.5), Circular((0.0, 0.0), radius, v, phase), f"car {k}")
        for k, (radius, v, phase) in enumerate(lanes)
    )
    goal_trajectory = Circular((0.0, 0.0), outer, speed, 15.0 / outer)
    robot = Robot(
        Disc(1.0), Limits(1.6 * speed, 4.0), State((outer, 0.0), (0.0, speed)), Goal(goal_trajectory, 1.5, stop=True)
    )
    return Scenario("curved_road", (robot,), cars, duration=40.0, horizon=3.0)


def lanes_of_cars(p: Mapping[str, float], rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Build thirty vehicles in three circular lanes, with one speed per lane and random phases at least 4.5 m apart."""
    cars: list[Obstacle] = []
    for lane, (radius, speed) in enumerate(((12.0, 5.0), (16.0, 6.5), (20.0, 8.0))):
        phases = random_angles(10, 4.5 / radius, rng, "cars of a lane")
        for phase in phases:
            path = Circular((0.0, 0.0), radius, speed * p["speed"], phase)
            cars.append(Obstacle(Disc(1.0), path, f"lane {lane + 1} car {len(cars)}"))
    return tuple(cars)


def roundabout_crossing(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the paper's roundabout, which the robot crosses from left to right among 30 vehicles."""
    robot = Robot(
        Disc(1.0),
        Limits(8.0, p["max_acceleration"]),
        State((-26.0, 0.0), (5.0, 0.0)),
        Goal(Stationary((26.0, 0.0)), 1.0),
    )
    return Scenario("roundabout_crossing", (robot,), lanes_of_cars(p, rng), duration=60.0)


def roundabout_exit(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the paper's roundabout, which the robot enters on the left and leaves at the top."""
    crossing = roundabout_crossing(p, rng)
    robot = replace(crossing.robot, goal=Goal(Stationary((0.0, 26.0)), 1.0))
    return replace(crossing, name="roundabout_exit", robots=(robot,))


def merging(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the paper's roundabout with a robot that merges into a gap of the outer lane and leaves at a later exit.

    The gap is a random one of the outer lane with at least `gap` [m] between the cars. Its middle passes the entry
    after `wait` [s]; the exit is `exit` [degrees] after the entry. The goal moves from the middle of the gap along the
    lane and leaves at the exit, where it brakes and stops. The speed of the cars is the robot's maximum, and in the
    lane the goal is 5 % faster. The robot therefore cannot reach it before the exit.
    """
    cars = lanes_of_cars(p, rng)
    lane = [car.trajectory for car in cars if isinstance(car.trajectory, Circular) and car.trajectory.radius == 20.0]
    phases = np.sort([path.phase % (2.0 * np.pi) for path in lane])
    gaps = np.diff(phases, append=phases[0] + 2.0 * np.pi)
    lane_speed = lane[0].speed
    rate = lane[0].rate
    wide_gaps = np.flatnonzero(20.0 * gaps >= p["gap"])
    if not wide_gaps.size:
        raise InvalidInput(f"gap: expected at most {20.0 * gaps.max():g} m, the widest gap, found {p['gap']:g} m")
    k = rng.choice(wide_gaps)
    pass_time = (np.pi - phases[k] - 0.5 * gaps[k]) % (2.0 * np.pi) / rate
    ahead = Circular((0.0, 0.0), 20.0, 1.05 * lane_speed, np.pi - 1.05 * rate * pass_time)
    exit_time = pass_time + np.radians(positive(p["exit"], "exit")) / ahead.rate
    exit_position, velocity = ahead.position(exit_time), ahead.velocity(exit_time)
    exit_velocity = velocity / ahead.speed + 0.5 * exit_position / 20.0
    exit_velocity *= ahead.speed / np.linalg.norm(exit_velocity)
    # The goal brakes at 2 m/s^2.
    exit_path = PiecewisePolynomial(
        [0.5 * ahead.speed], [[exit_position, exit_velocity, -exit_velocity / ahead.speed]], exit_time
    )
    goal = Goal(Composite((ahead, exit_path), (float(exit_time),)), 0.3, stop=True)
    robot = Robot(Disc(1.0), Limits(lane_speed, p["max_acceleration"]), State((-25.0, 0.0), (0.0, 0.0)), goal)
    start = float(pass_time) - not_negative(p["wait"], "wait")
    return Scenario("merging", (robot,), cars, start=start, duration=60.0)


def drones_crossing(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build a drone that crosses a hall among drones on quintic pieces between random waypoints."""
    others = []
    for k in range(whole(p["drones"], "drones")):
        waypoints = np.column_stack([rng.uniform(-4, 4, 9), rng.uniform(-4, 4, 9), rng.uniform(0.5, 3.5, 9)])
        durations = np.maximum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1) / p["speed"], 0.8)
        powers = np.zeros((8, 6, 3))
        powers[:, 0] = waypoints[:-1]
        for power, weight in ((3, 10.0), (4, -15.0), (5, 6.0)):
            powers[:, power] = weight * np.diff(waypoints, axis=0) / durations[:, None] ** power
        others.append(Obstacle(Ball(0.3), PiecewisePolynomial(durations, powers), f"drone {k + 1}"))
    state, goal = State((-7.0, 0.0, 2.0), np.zeros(3)), Goal(Stationary((7.0, 0.0, 2.0)), 0.3, stop=True)
    robot = Robot(Ball(0.3), Limits(3.0, 4.0), state, goal, "drone")
    return Scenario("drones_crossing", (robot,), tuple(others), duration=25.0, horizon=4.0)


def corridor(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build a robot in a corridor with a doorway, among people that walk through it in both directions."""
    half = 2.0
    door = 0.5 * p["door"]
    half_length = 14.0
    walls = Union(
        (
            Polyline([(-half_length, half), (half_length, half)], 0.05),
            Polyline([(-half_length, -half), (half_length, -half)], 0.05),
            Polyline([(0.0, half), (0.0, door)], 0.05),
            Polyline([(0.0, -half), (0.0, -door)], 0.05),
        )
    )
    people = []
    for k in range(whole(p["people"], "people")):
        # People converge on the doorway; every third one walks in the robot's direction.
        direction = 1.0 if k % 3 == 0 else -1.0
        speed, pass_time = rng.uniform(0.9, 1.4), 4.0 + 3.0 * k + rng.uniform(-0.6, 0.6)
        lanes = rng.uniform(-1.4, 1.4, 2)
        x = np.array([-30.0, -8.0, -4.0, -0.6, 0.6, 4.0, 8.0, 30.0])
        y = np.array([lanes[0], lanes[0], 0.6 * lanes[0], 0.0, 0.0, 0.6 * lanes[1], lanes[1], lanes[1]])
        track = Sampled(pass_time + x / speed, np.column_stack([direction * x, y]), "smooth")
        people.append(Obstacle(Disc(0.25), track, f"person {k + 1}"))
    state, goal = State((-9.0, 0.0), (0.0, 0.0)), Goal(Stationary((9.0, 0.0)), 0.3, stop=True)
    robot = Robot(Disc(0.3), Limits(1.5, 1.0), state, goal)
    obstacles = (Obstacle(walls, Stationary((0.0, 0.0)), "walls"), *people)
    return Scenario("corridor", (robot,), obstacles, duration=60.0, horizon=6.0)


def blind_corner(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build a robot in a corridor that passes the end of another one, out of which people come that do not yield.

    The sensor of the robot has a range of 8 m and does not reach around corners. With `passive_safety` 1 or 2 hidden
    agents are as fast as `speed`, see `sight_of`.
    People walk at 0.6 to 1 times `speed`.
    They reach that end about when the robot does, and then turn to either side.
    """
    half, far = 0.5 * positive(p["width"], "width"), 14.0
    speed = positive(p["speed"], "speed")
    corners = {
        "left wall": [(-far, half), (-half, half), (-half, far), (-far, far)],
        "right wall": [(half, half), (far, half), (far, far), (half, far)],
        "lower wall": [(-far, -half - 1.0), (far, -half - 1.0), (far, -half), (-far, -half)],
    }
    walls = tuple(Obstacle(Polygon(points), Stationary((0.0, 0.0)), name) for name, points in corners.items())
    people = []
    for k in range(whole(p["people"], "people")):
        pace, side = speed * rng.uniform(0.6, 1.0), rng.choice([-1.0, 1.0])
        x, y = rng.uniform(0.35 - half, half - 0.35, 2)
        track = np.array([(x, far), (x, half), (x, y), (side * far, y)])
        steps = np.diff(track, axis=0)
        durations = np.linalg.norm(steps, axis=1) / pace
        # At the end of the side corridor at this time.
        start = rng.uniform(3.0, 7.0) + 4.0 * (k // 2) - durations[0]
        moves = np.stack([track[:-1], steps / durations[:, None]], axis=1)
        people.append(Obstacle(Disc(0.25), PiecewisePolynomial(durations, moves, start), f"person {k + 1}"))
    robot = Robot(
        Disc(0.3),
        Limits(p["max_speed"], p["max_acceleration"]),
        State((-9.0, 0.0), (0.0, 0.0)),
        Goal(Stationary((9.0, 0.0)), 0.3, stop=True),
    )
    hidden = {"hidden_speed": speed, "passive_safety": p["passive_safety"]} if p["passive_safety"] else {}
    sight = from_numbers({"sight_range": 8.0, "occlusion": 1.0, **hidden})
    return Scenario("blind_corner", (robot,), (*walls, *people), duration=60.0, **sight)


def recorded_roundabout(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build a recorded roundabout: 30 cars, which yield to each other but not to the robot."""
    agents = read_recording(sample_data("roundabout_ring_11.csv")).agents
    cars = tuple(Obstacle(Disc(2.4), agent.trajectory, f"car {label}") for label, agent in agents.items())
    angle = rng.uniform(0.0, 2.0 * np.pi) if flag(p["random"], "random") else 0.0
    start_position = 58.0 * np.array([np.cos(angle), np.sin(angle)])
    robot = Robot(
        Disc(1.0), Limits(12.0, 4.0), State(start_position, np.zeros(2)), Goal(Stationary(-start_position), 1.5)
    )
    return Scenario("recorded_roundabout", (robot,), cars, start=p["at"], duration=45.0, horizon=8.0)


# Test cases of CrowdNav: a robot crosses a circle among people, which avoid each other but not the robot.
#
# Chen, Liu, Kreiss and Alahi, ICRA 2019 (arXiv:1809.08835); numbers as in the code of the paper (vita-epfl/CrowdNav).
# Test case k is drawn with numpy's legacy generator of seed 1000 + k. People do not react to the robot, so their paths
# are computed once, by ORCA (package pyrvo, in single precision).


RADIUS = 0.3
"""[m] Radius of robot and people."""
DT = 0.25
"""[s] Interval between decisions of robot and people."""
WALK_DURATION = 60.0
"""[s] Duration of the people's paths: longer than a run and a horizon, so that no predicted path ends."""


def crowdnav(p: Mapping[str, float], rng: np.random.Generator) -> Scenario:
    """Build the test case of CrowdNav whose number is the seed; 0 to 499 are the published ones, with five people.

    The known future paths (NLVO, NAO) are the simulated ones. The observed velocity of a person is that of the
    starting step, 0.25 s earlier than in CrowdNav.

    Raises:
        InvalidInput: pyrvo is not installed, or the circle has no space for so many people.
    """
    starts = start_positions(whole(p["people"], "people"), int(p["seed"]))
    times = np.arange(round(WALK_DURATION / DT) + 1) * DT
    paths = np.moveaxis(walking_positions(starts, len(times) - 1), 1, 0)
    crowd = tuple(
        Obstacle(Disc(RADIUS), Sampled(times, path, "linear"), f"person {k + 1}") for k, path in enumerate(paths)
    )
    goal = Goal(Stationary((0.0, 4.0)), RADIUS)
    robot = Robot(Disc(RADIUS), Limits(1.0, p["max_acceleration"]), State((0.0, -4.0), (0.0, 0.0)), goal)
    # A run ends before the step that would start at 24 s.
    return Scenario("crowdnav", (robot,), crowd, duration=24.0, dt=DT)


def start_positions(count: int, case: int) -> Array:
    """Return the start positions (count, 2) [m] of the people of a test case; each goal is the opposite position."""
    try:
        draws = np.random.RandomState(1000 + case)
    except ValueError:
        raise InvalidInput(f"seed: expected less than {2**32 - 1000} for a legacy generator, found {case}") from None
    starts, occupied = np.empty((0, 2)), np.array([(0.0, -4.0), (0.0, 4.0)])
    failures = 0
    while len(starts) < count:
        if failures == MAX_TRIES:
            raise InvalidInput(f"people: expected space for {count} on the circle, found space for {len(starts)}")
        angle, x, y = draws.random_sample(3)
        candidate = 4.0 * np.array([np.cos(angle * 2.0 * np.pi), np.sin(angle * 2.0 * np.pi)]) + (x - 0.5, y - 0.5)
        failures += 1
        if np.linalg.norm(occupied - candidate, axis=1).min() >= 2.0 * RADIUS + 0.2:
            starts = np.vstack([starts, candidate])
            occupied = np.vstack([occupied, candidate, -candidate])
            failures = 0
    return starts


def walking_positions(starts: Array, steps: int) -> Array:
    """Return the positions (steps + 1, n, 2) [m] of people that avoid each other, every DT.

    The preferred speed is up to 1 m/s towards the opposite position, also after arrival. Each person observes the
    position and velocity of the others. ORCA considers up to 10 others within 10 m, has a horizon of 5 s, and enlarges
    radii by 1 cm.
    """
    simulator = _orca()(DT, 10.0, 10, 5.0, 5.0, RADIUS + 0.01, 1.0)
    positions, velocities = starts, np.zeros_like(starts)
    for start in starts:
        simulator.add_agent(tuple(start))
    result = [positions]
    for _ in range(steps):
        preferred = -starts - positions
        preferred = preferred / np.maximum(np.linalg.norm(preferred, axis=1, keepdims=True), 1.0)
        for k in range(len(starts)):
            simulator.set_agent_position(k, tuple(positions[k]))
            simulator.set_agent_velocity(k, tuple(velocities[k]))
            simulator.set_agent_pref_velocity(k, tuple(preferred[k]))
        simulator.do_step()
        chosen = (simulator.get_agent_velocity(k) for k in range(len(starts)))
        velocities = np.array([(v.x, v.y) for v in chosen]).reshape(-1, 2)
        positions = positions + DT * velocities
        result.append(positions)
    return np.array(result)


def _orca() -> Any:
    """Return the simulator class of pyrvo. Raises MissingExtra if pyrvo is not installed."""
    with Extra("peers", "crowdnav"):
        return import_module("pyrvo").RVOSimulator
