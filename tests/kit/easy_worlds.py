"""Worlds of one robot and its goal: drawn limits, the least times in closed form, and the motion by decisions.

Nothing here comes from the policy: a robot is a double integrator, and times follow from its limits alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from slalom import METHODS, ConstantVelocity, Decision, Goal, Limits, LookAhead, Navigator, Obstacle, State, Stationary
from slalom.model.shape import round_shape

PERIODS = (0.05, 0.1, 0.2)
"""[s]"""
RADIUS = 0.3
"""[m] of the robot."""
NO_CHANGE = 0.02
"""[1] A smaller change of the acceleration, as a share of the largest one, is none."""
AT_TOP_SPEED = 0.995
"""[1] From this share of the largest speed on, the acceleration must not change."""
SECONDS_AT_REST = 20.0
REST = 1e-3
"""[1] Largest speed and acceleration at rest, as shares of the limits."""

Decide = Callable[[State, float], np.ndarray]
"""The acceleration (d,) [m/s^2] of a robot in a measured state at a time [s]."""


@dataclass(frozen=True)
class World:
    """A robot and its goal, in numbers that a failure prints."""

    max_speed: float
    max_acceleration: float
    period: float
    tolerance: float
    start: tuple[float, ...]
    velocity: tuple[float, ...]
    place: tuple[float, ...]
    drift: tuple[float, ...]  # velocity [m/s] of the goal
    stop: bool = True

    @property
    def limits(self) -> Limits:
        return Limits(self.max_speed, self.max_acceleration)

    @property
    def state(self) -> State:
        return State(self.start, self.velocity)

    @property
    def goal(self) -> Goal:
        moves = ConstantVelocity(self.place, self.drift) if any(self.drift) else Stationary(self.place)
        return Goal(moves, self.tolerance, self.stop)

    @property
    def way(self) -> np.ndarray:
        """Displacement (d,) [m] from the start to the first place of the goal."""
        return np.subtract(self.place, self.start)

    @property
    def length(self) -> float:
        """[m]"""
        return float(np.linalg.norm(self.way))

    @property
    def speed(self) -> float:
        """[m/s] at the start."""
        return float(np.linalg.norm(self.velocity))

    def is_there(self, position: np.ndarray, velocity: np.ndarray, now: float) -> bool:
        """Whether the robot is within the tolerance; to stop, also at a relative speed of at most that per second."""
        away = position - np.add(self.place, now * np.array(self.drift))
        speed = float(np.linalg.norm(velocity - self.drift)) if self.stop else 0.0
        return max(float(np.linalg.norm(away)), speed) <= self.tolerance


def direction(rng: np.random.Generator, d: int) -> np.ndarray:
    """Random unit vector (d,)."""
    found = rng.normal(size=d)
    return np.asarray(found / np.linalg.norm(found))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Random number between two, evenly on a logarithmic scale, with three digits."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.3g}")


def world(rng: np.random.Generator, d: int, *, stop: bool = True, fastest: float = 25.0) -> World:
    """A robot that heads for its goal at rest, at half, full or no speed.

    The way takes 6 to 12 s at the largest speed, besides the ramps.
    """
    v = log_uniform(rng, 0.3, fastest)
    a, period = round(v * log_uniform(rng, 0.3, 4.0), 4), float(rng.choice(PERIODS))
    start, length = rng.uniform(-5.0, 5.0, d).round(2), v * rng.uniform(6.0, 12.0) + v * v / a
    place, speed = (start + length * direction(rng, d)).round(3), v * float(rng.choice([0.0, 0.5, 1.0]))
    velocity = speed * (place - start) / np.linalg.norm(place - start)
    vectors = (tuple(each.tolist()) for each in (start, velocity, place, np.zeros(d)))
    return World(v, a, period, log_uniform(rng, 1e-3, 0.3), *vectors, stop)


def passing_time(length: float, speed: float, v: float, a: float) -> float:
    """Least time [s] to pass a point `length` [m] ahead from `speed` [m/s], with limits v [m/s] and a [m/s^2]."""
    ramp = (v * v - speed * speed) / (2.0 * a)
    if ramp >= length:
        return (sqrt(speed * speed + 2.0 * a * length) - speed) / a
    return (v - speed) / a + (length - ramp) / v


def stopping_time(length: float, speed: float, v: float, a: float) -> float:
    """Least time [s] to come to rest `length` [m] ahead from `speed` [m/s], from which the robot can stop in time."""
    top = min(v, sqrt(max(a * length + 0.5 * speed * speed, 0.0)))
    ramps = (2.0 * top * top - speed * speed) / (2.0 * a)
    return (2.0 * top - speed) / a + max(length - ramps, 0.0) / v


def braking_first(world: World) -> float:
    """Time [s] to come to rest relative to the goal first, and to drive from there.

    In the frame of the goal the robot has at least the speed v - w in every direction, where w is that of the goal.
    """
    relative = np.subtract(world.velocity, world.drift)
    speed, a = float(np.linalg.norm(relative)), world.max_acceleration
    rest = relative * speed / (2.0 * a)
    left = float(np.linalg.norm(world.way - rest))
    return speed / a + stopping_time(left, 0.0, world.max_speed - float(np.linalg.norm(world.drift)), a)


class Driven(NamedTuple):
    """Steps of a robot: times (n,) [s], and what holds at the begin of each (n, d).

    Attributes:
        arrived: [s] arrival; None without one.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    arrived: float | None

    def since(self, time: float) -> "Driven":
        """The steps from `time` [s] on."""
        k = int(np.searchsorted(self.times, time - 1e-9))
        return Driven(*(each[k:] for each in self[:4]), self.arrived)

    @property
    def changes(self) -> np.ndarray:
        """Size (n - 1,) [m/s^2] of the changes of the acceleration."""
        return np.asarray(np.linalg.norm(np.diff(self.accelerations, axis=0), axis=1))

    def dense(self, period: float, samples: int = 8) -> np.ndarray:
        """Positions (n, samples, d) [m] during all steps."""
        s = np.linspace(0.0, period, samples)[:, None]
        p, u, a = (each[:, None] for each in self[1:4])
        return np.asarray(p + s * (u + 0.5 * s * a))


def entry(world: World, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> float | None:
    """Time [s] from the begin of a step to the first moment within the tolerance of a goal at rest; None without one.

    The squared distance is a polynomial of degree 4.
    """
    r, u, a = position - world.place, velocity, acceleration
    h = world.period
    if np.linalg.norm(r) > world.tolerance + h * (np.linalg.norm(u) + h * np.linalg.norm(a)):
        return None
    roots = np.roots([0.25 * (a @ a), a @ u, u @ u + a @ r, 2.0 * (u @ r), r @ r - world.tolerance**2])
    real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real >= 0.0) & (roots.real <= h)]
    return float(real.min()) if len(real) else None


def driven(decide: Decide, world: World, latest: float, after: float = 0.0) -> Driven:
    """The motion until the arrival, at the latest until `latest` [s], and then for `after` [s]."""
    p, u = np.array(world.start, dtype=float), np.array(world.velocity, dtype=float)
    rows: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
    arrived, k, h = None, 0, world.period
    while k * h <= (latest if arrived is None else arrived + after):
        now = k * h
        if arrived is None and world.stop and world.is_there(p, u, now):
            arrived = now
        a = decide(State(p, u), now)
        rows.append((now, p, u, a))
        if not world.stop:
            passed = entry(world, p, u, a)
            if passed is not None:
                arrived = now + passed
                break
        p, u, k = p + h * (u + 0.5 * h * a), u + h * a, k + 1
    return Driven(*(np.array(each) for each in zip(*rows, strict=True)), arrived)


def alone(name: str, world: World, obstacles: list[Obstacle] | None = None) -> Decide:
    """Decisions by a method, each with the one before."""
    method, shape = METHODS[name], round_shape(RADIUS, len(world.start))
    navigator = Navigator(method, shape, world.limits, period=world.period)
    robot = LookAhead(navigator) if method.looks_ahead else navigator
    around, goal = obstacles or [], world.goal
    decision: Decision | None = None

    def decide(state: State, now: float) -> np.ndarray:
        nonlocal decision
        decision = robot.decide(state, around, goal, now=now, previous=decision)
        return decision.manoeuvre.mean_acceleration(now, world.period)

    return decide


def lag(name: str, world: World, speed: float = 0.0) -> float:
    """Time [s] that avo loses because it approaches its velocity from `speed` [m/s] on with the lag v / a; else 0.

    At the largest speed from the begin, the robot would be farther: than the time-optimal run by
    (v - speed)^2 / (2 a), than the run with the lag by (v - speed) v / a.
    """
    v, a = world.max_speed, world.max_acceleration
    return (v * v - speed * speed) / (2.0 * a * v) if name == "avo" else 0.0


def straight(world: World, positions: np.ndarray) -> float:
    """Largest distance [m] of positions (n, d) from the line through the start and the goal."""
    along = world.way / world.length
    offsets = positions - np.array(world.start)
    return float(np.linalg.norm(offsets - np.outer(offsets @ along, along), axis=1).max())


def assert_rests(world: World, driven: Driven, since: float) -> None:
    """The robot stays within the tolerance from `since` [s] on, in the second half at rest relative to the goal."""
    there = driven.since(since)
    places = np.add(world.place, there.times[:, None] * np.array(world.drift))
    away = float(np.linalg.norm(there.positions - places, axis=1).max())
    assert away <= world.tolerance * (1.0 + 1e-9) + 1e-9, world
    half = len(there.times) // 2
    speed = float(np.linalg.norm(there.velocities - world.drift, axis=1)[half:].max())
    acceleration = float(np.linalg.norm(there.accelerations, axis=1)[half:].max())
    assert speed <= REST * world.max_speed, world
    assert acceleration <= REST * world.max_acceleration, world
