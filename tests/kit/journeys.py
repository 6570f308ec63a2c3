"""Random journeys of one robot that looks ahead, each made from one integer, and what it decides, measured.

Places, distances and clearances come from plain numbers: motions of `oracle.py`, hulls of `hulls.py`, and accelerations
integrated one after the other. Nothing that decides is asked.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from hulls import Pair, turned
from motion import drive
from oracle import MOTIONS, STAMPS, facing, motion
from scenes import FASTEST, HEADED, IN_SPACE, KINDS, ROBOTS, SHAPES

from slalom import (
    METHODS,
    BoundedError,
    Decision,
    Disc,
    Goal,
    Limits,
    LookAhead,
    Manoeuvre,
    Navigator,
    Obstacle,
    Polyline,
    SequenceDecision,
    Shape,
    State,
    Stationary,
)
from slalom.model.shape import round_shape
from slalom.model.trajectory import TRAJECTORIES

COARSE, FINE = 0.02, 5e-4
"""[s] Between samples; where an obstacle is near."""
JUMP = 1e-9
"""[s] Before and after a jump, bodies are looked at too."""
ROUND, SHAPED_ROBOT, UNSURE, WALLED, GATED = 0.4, 0.3, 0.15, 0.2, 0.12
"""How often everything is round; the robot is not; an obstacle is uncertain; there is a wall; a gate."""


@dataclass(frozen=True, eq=False)
class Body:
    """An obstacle in plain numbers, and the library's."""

    kind: str
    parameters: dict[str, object]
    shape: Shape
    heading: float | str = 0.0
    unsure: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @cached_property
    def obstacle(self) -> Obstacle:
        """The library's."""
        error = BoundedError(*self.unsure) if any(self.unsure) else None
        track = TRAJECTORIES[self.kind](**self.parameters)
        return Obstacle(self.shape, track, self.kind, self.heading, error, after_end="leaves")

    def pairs(self, robot: Shape) -> list[Pair]:
        """Each part of it with each part of the robot."""
        turns, found = self.heading == "motion", []
        for corners, radius in self.shape.parts:
            if not turns and self.heading != 0.0:
                corners = turned(corners, np.array([[np.cos(self.heading), np.sin(self.heading)]]))[:, :, 0].T
            found += [Pair(0, corners, part.corners, radius + part.radius, turns) for part in robot.parts]
        return found

    def gaps(self, robot: Shape, positions: np.ndarray, times: np.ndarray, since: float) -> np.ndarray:
        """Signed distance (n,) from the robot at `positions` (n, d) at absolute `times` (n,); inf where nothing is.

        As far as is certain of what was predicted at `since` [s].
        """
        away = positions - motion(self.kind, self.parameters, times)[0]
        ahead = facing(self.kind, self.parameters, times) if self.heading == "motion" else None
        gone = np.maximum(times - since, 0.0)
        position, velocity, acceleration = self.unsure
        off = position + gone * velocity + 0.5 * gone * gone * acceleration
        return np.min([pair.gap(away, ahead) for pair in self.pairs(robot)], axis=0) - off

    def jumps(self, start: float, end: float) -> np.ndarray:
        """Times at which it appears, vanishes or may turn at once, and just before and after."""
        if self.kind not in STAMPS:
            return np.empty(0)
        stamps = STAMPS[self.kind](self.parameters)
        inside = stamps[(stamps >= start) & (stamps <= end)]
        return np.concatenate([inside - JUMP, inside, inside + JUMP])


class Motion(NamedTuple):
    """Accelerations (n, d) [m/s^2], one after the other, each until its end (n,) [s]; then the velocity is constant."""

    state: State
    start: float
    ends: np.ndarray
    accelerations: np.ndarray

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place, velocity and acceleration (k, d) at absolute times (k,)."""
        position, velocity, begin = np.array(self.state.position), np.array(self.state.velocity), self.start
        assert np.all(times >= begin)
        d, k = len(position), len(times)
        found = np.empty((3, k, d))
        for end, acceleration in [*zip(self.ends, self.accelerations), (np.inf, np.zeros(d))]:
            here = times >= begin
            s = (times[here] - begin)[:, None]
            found[:, here] = (
                position + s * velocity + 0.5 * s * s * acceleration,
                velocity + s * acceleration,
                acceleration + 0.0 * s,
            )
            h = end - begin if np.isfinite(end) else 0.0
            position, velocity, begin = (
                position + h * velocity + 0.5 * h * h * acceleration,
                velocity + h * acceleration,
                end,
            )
        return found[0], found[1], found[2]


def motion_of(manoeuvre: Manoeuvre) -> Motion:
    """What a plan is made of."""
    response = manoeuvre.response
    lengths = [response.hold, *(seconds for seconds, _ in response.then)]
    accelerations = np.array([manoeuvre.control, *(acceleration for _, acceleration in response.then)])
    return Motion(manoeuvre.state, manoeuvre.start, manoeuvre.start + np.cumsum(lengths), accelerations)


def least_gap(journey: "Journey", motion: Motion, start: float, end: float, since: float) -> float:
    """The least signed distance over start to end: every COARSE seconds, every FINE where the least could be."""
    least = np.inf
    if end <= start:
        return least
    for body in journey.bodies:
        times = np.linspace(start, end, max(2, int(np.ceil((end - start) / COARSE)) + 1))
        times = np.unique(np.concatenate([times, np.clip(body.jumps(start, end), start, end)]))
        gaps = body.gaps(journey.robot, motion.at(times)[0], times, since)
        least = min(least, float(gaps.min()))
        if not np.isfinite(least):
            continue
        # By how much a gap can fall between two samples.
        near = np.flatnonzero(gaps <= least + 2.0 * COARSE * (FASTEST + journey.limits.max_speed))
        dips = near[np.argsort(gaps[near])][:30]
        fine = [np.arange(max(times[k] - COARSE, start), min(times[k] + COARSE, end), FINE) for k in dips]
        times = np.unique(np.concatenate(fine)) if fine else times[:1]
        least = min(least, float(body.gaps(journey.robot, motion.at(times)[0], times, since).min()))
    return least


@dataclass(frozen=True, eq=False)
class Journey:
    """A robot, its goal, and what is in the way."""

    seed: int
    state: State
    start: float
    goal: Goal
    robot: Shape
    limits: Limits
    period: float
    margin: float
    bodies: tuple[Body, ...]

    @cached_property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The library's."""
        return tuple(body.obstacle for body in self.bodies)

    def decider(self, **settings: float) -> LookAhead:
        """The decider of the journey."""
        method = METHODS["nao_ahead"]
        navigator = Navigator(method, self.robot, self.limits, self.period, 6.0, self.margin)
        return LookAhead(navigator, **{"time_horizon": 25.0, **settings})

    def __str__(self) -> str:
        bodies = [f"{type(body.shape).__name__} {body.kind} {body.heading}" for body in self.bodies]
        return f"journey({self.seed}, {self.state.dimension}): {bodies}"


def journey(seed: int, d: int) -> Journey:
    """The journey of that number."""
    rng = np.random.default_rng([seed, d, 18])
    max_speed, max_acceleration = float(rng.uniform(1.0, 5.0)), float(rng.uniform(0.5, 4.0))
    start = float(rng.choice([0.0, rng.uniform(-5.0, 50.0)]))
    position = rng.uniform(-20.0, 20.0, size=d)
    way = rng.normal(size=d)
    way *= rng.uniform(2.0, 5.0) * max_speed / np.linalg.norm(way)
    pull = rng.normal(size=d)
    state = State(position, pull / np.linalg.norm(pull) * max_speed * rng.uniform(0.0, 1.0))
    goal = Goal(Stationary(position + way), float(rng.choice([0.2, 0.5, 1.0])), stop=bool(rng.random() < 0.5))
    all_round = bool(rng.random() < ROUND)
    size = float(rng.uniform(0.1, 0.6))
    robot = round_shape(size, d)
    if not all_round and rng.random() < SHAPED_ROBOT:
        robot = SHAPES["capsule" if d == 3 else str(rng.choice(ROBOTS))](rng, d, size)
    found = Journey(
        seed,
        state,
        start,
        goal,
        robot,
        Limits(max_speed, max_acceleration),
        float(rng.choice([0.1, 0.2, 0.25])),
        float(rng.choice([0.0, 0.05, 0.3])),
        (),
    )
    # In space a capsule meets balls only.
    plain = all_round or (d == 3 and len(robot.parts[0].corners) > 1)
    bodies: list[Body] = []
    if d == 2 and rng.random() < GATED:
        bodies += _gate(rng, found, way)
    if d == 2 and not all_round and rng.random() < WALLED:
        bodies.append(_wall(rng, found, way))
    for _ in range(int(rng.integers(0, 9))):
        bodies.append(_body(rng, found, way, plain))
    return replace(found, bodies=tuple(body for body in bodies if _fair(found, body)))


def _fair(j: Journey, body: Body) -> bool:
    """Whether it does not begin on the robot, and does not stand on its goal for ever."""
    start, goal = np.array([j.start]), j.goal.trajectory.initial_position[None]
    if body.gaps(j.robot, j.state.position[None], start, j.start)[0] <= 1e-3:
        return False
    return body.kind != "stationary" or bool(body.gaps(j.robot, goal, start, j.start)[0] > j.margin + 0.05)


def _gate(rng: np.random.Generator, j: Journey, way: np.ndarray) -> list[Body]:
    """Two large discs that leave a little less or more than the robot's margin on both sides."""
    along, half = way / np.linalg.norm(way), j.robot.bounding_radius + rng.uniform(0.1, 2.5) * j.margin + 1e-3
    across = np.array([-along[1], along[0]])
    middle = j.state.position + rng.uniform(0.3, 0.7) * way
    sides = [middle + side * (8.0 + half) * across for side in (-1.0, 1.0)]
    return [Body("stationary", {"initial_position": side}, Disc(8.0)) for side in sides]


def _wall(rng: np.random.Generator, j: Journey, way: np.ndarray) -> Body:
    """A bent line across the way."""
    along = way / np.linalg.norm(way)
    across, length = np.array([-along[1], along[0]]), float(np.linalg.norm(way))
    points = np.array([along * rng.uniform(-0.2, 0.2) + side * across for side in (-0.4, 0.0, 0.5)]) * length
    middle = j.state.position + rng.uniform(0.3, 0.7) * way + rng.uniform(-0.4, 0.4) * length * across
    return Body("stationary", {"initial_position": middle}, Polyline(points, float(rng.choice([0.0, 0.1]))))


def _body(rng: np.random.Generator, j: Journey, way: np.ndarray, plain: bool) -> Body:
    """An obstacle that is near the straight way at some time."""
    d, span = j.state.dimension, 3.0 * float(np.linalg.norm(way)) / j.limits.max_speed
    size = float(rng.uniform(0.2, 1.5))
    while True:
        kind, parameters = KINDS[int(rng.integers(len(KINDS)))](rng, d, j.start, span)
        if kind == "constant_acceleration" or _slow(kind, parameters, j.start, span):
            break
    share = rng.uniform(0.1, 1.1)
    near = j.state.position + share * way + rng.normal(size=d) * rng.uniform(0.0, 1.5)
    _shift(kind, parameters, near, j.start + share * span / 3.0)
    shape: Shape = round_shape(size, d)
    heading: float | str = 0.0
    if not plain and rng.random() < 0.8:
        shape = SHAPES[str(rng.choice(IN_SPACE if d == 3 else list(SHAPES)))](rng, d, size)
        if d == 2:
            heading = "motion" if rng.random() < 0.5 and kind in HEADED else float(rng.uniform(-7.0, 7.0))
            if heading == "motion" and not _steady(kind, parameters, j.start, span, shape.bounding_radius):
                heading = 0.0
    unsure = tuple(rng.uniform(0.0, 1.0, size=3) * (0.1, 0.05, 0.01)) if rng.random() < UNSURE else (0.0, 0.0, 0.0)
    return Body(kind, parameters, shape, heading, unsure)


def _fastest(kind: str, parameters: dict[str, object], start: float, span: float) -> np.ndarray:
    return np.linalg.norm(motion(kind, parameters, start + np.arange(0.0, 9.0 * span, 0.01))[1], axis=1)


def _slow(kind: str, parameters: dict[str, object], start: float, span: float) -> bool:
    """Whether it is seldom there, or never faster than FASTEST."""
    speeds = _fastest(kind, parameters, start, span)
    return not np.any(speeds > 0.6 * FASTEST)


def _steady(kind: str, parameters: dict[str, object], start: float, span: float, reach: float) -> bool:
    """Whether a body that faces along the motion turns so slowly that samples see it, and never rests."""
    times = start + np.arange(0.0, 9.0 * span, 2e-3)
    _, velocity, acceleration = motion(kind, parameters, times)
    total = np.linalg.norm(velocity, axis=1)
    there = np.isfinite(total)
    if not np.any(there) or np.any(total[there] < 0.05):
        return False
    across = velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]
    return bool(np.all(reach * np.abs(across[there]) / total[there] ** 2 < 0.4 * FASTEST))


def _shift(kind: str, parameters: dict[str, object], position: np.ndarray, t: float) -> None:
    """Move a motion so that it is at `position` at time t, or at the time of its life that is nearest."""
    if kind in STAMPS:
        t = float(np.clip(t, *STAMPS[kind](parameters)[[0, -1]]))
    here = motion(kind, parameters, np.array([t]))[0][0]
    if np.isnan(here[0]):
        return
    MOTIONS[kind].moved(parameters, position - here)


class Decided(NamedTuple):
    """A decision of a run."""

    now: float
    state: State
    decision: SequenceDecision


def steps_of(journey: Journey, steps: int, robot: LookAhead) -> Iterator[tuple[float, State, Decision]]:
    """What a robot decides at each step, up to its arrival."""
    state, decision = journey.state, None
    for k in range(steps):
        now = journey.start + k * journey.period
        if journey.goal.reached(state.position, state.velocity, now):
            return
        decision = robot.decide(state, journey.obstacles, journey.goal, now=now, previous=decision)
        yield now, state, decision
        state = drive(state, decision.manoeuvre.mean_acceleration(now, journey.period), journey.period)


def driven(journey: Journey, steps: int, robot: LookAhead | None = None) -> Iterator[Decided]:
    """Those of the first decisions of a robot on its way that are sequences."""
    for now, state, decision in steps_of(journey, steps, robot or journey.decider()):
        if isinstance(decision, SequenceDecision):
            yield Decided(now, state, decision)
