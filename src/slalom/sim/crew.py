"""How the robots of a scenario decide: all by one kernel where they are discs or balls, else each by its navigator."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Protocol

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.decision import Decision, Outcome
from slalom.forecast import foreseen
from slalom.goal import Goal
from slalom.kernels.tables import FOR_EVER, Answers, Fleet, Terms, World
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.obstacle import Obstacle
from slalom.path import hermite
from slalom.response import AccelerateThenBrake, Response
from slalom.shape import Ball, Disc
from slalom.sim.guidance import Guidance
from slalom.sim.scenario import DETOURS, Scenario
from slalom.state import State
from slalom.traffic import Traffic
from slalom.trajectory import ConstantAcceleration, PiecewisePolynomial, Stationary, Trajectory

OUTCOMES = (Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED, Outcome.SQUEEZED)
"""What the kernel's numbers mean."""
ASK = -1
"""The kernel's number for a robot that must ask its navigator."""
FASTEST = 100.0
"""[m/s] Cubic pieces of responses that are not cubic themselves are fine enough up to this speed."""


class Deciders(Protocol):
    """Those who decide for all robots of a run; `guidance` holds the robots' states and where they head for."""

    def decide(self, order: Sequence[int], now: float) -> tuple[dict[int, str], dict[int, float]]:
        """New manoeuvres for the robots in `order`: the names of the outcomes, and the time [s] that each took."""

    def push(self, now: float, dt: float) -> Array:
        """The accelerations (n, 3) [m/s^2] that carry the robots along what they are committed to, up to now + dt."""

    def chosen(self, k: int) -> tuple[Array, str]:
        """The control and the response of robot k."""


def first_manoeuvre(state: State, limits: Limits, period: float, now: float) -> Manoeuvre:
    """What a robot is committed to before its first decision: to go on for one period and to brake evenly then."""
    speed = float(np.linalg.norm(state.velocity))
    brake = max(period, np.ceil(speed / limits.braking / period - 1e-9) * period)
    return Manoeuvre(AccelerateThenBrake(period, brake), state, np.zeros(state.dimension), now)


def margin_among(scenario: Scenario, method: Method) -> float:
    """The margin [m] of robots that meet each other.

    That of the scenario, and where they only see each other also how much two that accelerate at their limits can
    differ within one period from what each expected of the other: a period^2, once for each.
    """
    period = scenario.dt * scenario.steps_per_decision
    most = 0.0 if method.shared else max(robot.limits.max_acceleration for robot in scenario.robots)
    return scenario.margin + 2.0 * most * period * period


def suits(scenario: Scenario) -> bool:
    """Whether a crew can decide for the robots of a scenario."""
    return all(
        isinstance(robot.shape, (Disc, Ball))
        and isinstance(robot.goal.trajectory, Stationary)
        and not (robot.limits.bounds or robot.limits.velocity_bounds or robot.limits.acceleration_bounds)
        for robot in scenario.robots
    )


def tabulated(kinds: Sequence[Sequence[Response]], horizon: float, span: float, dimension: int) -> Answers:
    """The responses of each kind of robot as tables over `span` [s].

    What a response does to a robot is affine in its velocity as in the control, so one state stands for all.
    """
    unit = State(np.zeros(dimension), np.eye(dimension)[0])
    knots, place, gain, settled, aim, peaks = [], [], [], [], [], []
    for r, response in enumerate(response for kind in kinds for response in kind):
        times = response.knots(span, 2.0 * FASTEST)
        position, velocity = response.position(unit, times), response.velocity(unit, times)
        place.append(hermite(times, position.drift[:, :1], velocity.drift[:, :1]).points[..., 0])
        gain.append(hermite(times, position.gain[:, None], velocity.gain[:, None]).points[..., 0])
        knots.append(times)
        settled.append(response.settled(horizon))
        then = response.velocity(unit, settled[-1])
        aim.append((float(then.drift[0]), float(then.gain)))
        both = (response.speed_peaks(unit, horizon), response.acceleration_peaks(unit, horizon))
        for which, maps in enumerate(both):
            peaks += [(r, which, float(peak.drift[0]), float(peak.gain)) for peak in maps if float(peak.gain)]
    return Answers(
        kinds=np.cumsum([0, *(len(kind) for kind in kinds)]),
        first=np.cumsum([0, *(len(pieces) for pieces in place)]),
        knots=np.concatenate(knots),
        place=np.concatenate(place),
        gain=np.concatenate(gain),
        settled=np.array(settled),
        aim=np.array(aim),
        peaks=np.array(peaks, dtype=np.float64),
    )


class Crew:
    """Discs or balls with goals at rest: one kernel decides for all, the navigator for a robot that has no safe choice.

    What a robot commits to is kept as cubic pieces over two horizons, or for ever where it ends at rest.
    """

    def __init__(self, scenario: Scenario, method: Method, guidance: Guidance) -> None:
        self.scenario, self.method, self.guidance = scenario, method, guidance
        robots, guide = scenario.robots, guidance.guide
        self.period, self.span = scenario.dt * scenario.steps_per_decision, 2.0 * scenario.horizon
        self.margin = margin_among(scenario, method)
        distinct: dict[Limits, int] = {}
        kind = np.array([distinct.setdefault(robot.limits, len(distinct)) for robot in robots])
        kinds = [method.responses(limits, self.period, scenario.holds) for limits in distinct]
        self.answers = tabulated(kinds, scenario.horizon, self.span, scenario.dimension)
        self.texts = [repr(response) for kind_of in kinds for response in kind_of]
        n, pieces = len(robots), max(3, int(np.diff(self.answers.first).max()))
        seen = pieces if method.shared else 2
        self.fleet = Fleet(
            position=guide.position,
            velocity=guide.velocity,
            push=np.zeros((n, 3)),
            kind=kind,
            radius=guide.radius,
            top=guide.top,
            most=np.array([robot.limits.max_acceleration for robot in robots]),
            target=guide.target,
            near=guide.near,
            halt=guide.halt,
            present=guide.present,
            begin=np.zeros((n, pieces + 1)),
            points=np.zeros((n, pieces, 4, 3)),
            seen_begin=np.zeros((n, seen + 1)),
            seen_points=np.zeros((n, seen, 4, 3)),
            # Shared manoeuvres are promises from the begin; seen robots are free to change their first.
            regret=np.zeros(n) if method.shared else np.full(n, np.inf),
            response=np.full(n, -1),
            control=np.zeros((n, 3)),
            outcome=np.zeros(n, np.int64),
        )
        self._others = [""] * n
        for k, robot in enumerate(robots):
            self._commit(k, first_manoeuvre(robot.state, robot.limits, self.period, scenario.start), scenario.start)

    def decide(self, order: Sequence[int], now: float) -> tuple[dict[int, str], dict[int, float]]:
        before = perf_counter()
        s, due = self.scenario, np.array(order, dtype=np.int64)
        terms = Terms(
            s.dimension, now, self.period, s.horizon, self.margin, s.patience, self.method.share, self.method.shared,
            np.array(DETOURS),
        )  # fmt: skip
        self.fleet.push[:] = self.guidance.push
        if not self.method.shared:
            self._look(now)
        world, outcomes, done = self._world(now), {}, 0
        while done < len(due):
            done += kernels.decide_all(due[done:], self.fleet, world, self.answers, terms)
            if done < len(due):
                k = int(due[done])
                outcomes[k] = self._ask(k, now).outcome.name
                done += 1
        for k in order:
            if self.fleet.outcome[k] != ASK:
                outcomes[k] = OUTCOMES[self.fleet.outcome[k]].name
        spent = (perf_counter() - before) / max(len(order), 1)
        return outcomes, dict.fromkeys(order, spent)

    def push(self, now: float, dt: float) -> Array:
        fleet, t = self.fleet, now + dt
        rows = np.arange(len(fleet.begin))
        piece = np.minimum((fleet.begin[:, 1:] < t).sum(axis=1), fleet.points.shape[1] - 1)
        width = (fleet.begin[rows, piece + 1] - fleet.begin[rows, piece])[:, None]
        x = (t - fleet.begin[rows, piece])[:, None] / width
        p = fleet.points[rows, piece]
        bends = (1 - x) ** 2 * (p[:, 1] - p[:, 0]) + 2 * x * (1 - x) * (p[:, 2] - p[:, 1]) + x * x * (p[:, 3] - p[:, 2])
        return np.asarray((3.0 * bends / width - fleet.velocity) / dt)

    def chosen(self, k: int) -> tuple[Array, str]:
        r = self.fleet.response[k]
        text = self.texts[r] if r >= 0 else self._others[k]
        return self.fleet.control[k, : self.scenario.dimension].copy(), text

    def _look(self, now: float) -> None:
        """What the others see of each robot: a forecast from its state."""
        d = self.scenario.dimension
        for k in np.flatnonzero(self.fleet.present):
            self._show(int(k), self.method.of_robots(self._observed(int(k), now, d), now), now)

    def _observed(self, k: int, now: float, d: int) -> Trajectory:
        fleet = self.fleet
        return ConstantAcceleration(fleet.position[k, :d], fleet.velocity[k, :d], fleet.push[k, :d], now)

    def _show(self, k: int, path: Trajectory, now: float) -> None:
        """Robot k is seen to follow a path of at most as many pieces as there is room for."""
        fleet, d = self.fleet, self.scenario.dimension
        pieces = path.path(now, now + self.scenario.horizon)
        count = len(pieces.points)
        fleet.seen_begin[k] = pieces.times[-1]
        fleet.seen_begin[k, : count + 1] = pieces.times
        fleet.seen_points[k, :count, :, :d] = pieces.points

    def _commit(self, k: int, manoeuvre: Manoeuvre, now: float) -> None:
        """Robot k follows a manoeuvre that is none of the tables'."""
        fleet, d = self.fleet, self.scenario.dimension
        path = manoeuvre.path(now, now + self.span)
        count = len(path.points)
        fleet.begin[k] = path.times[-1]
        fleet.begin[k, :count] = path.times[:-1]
        fleet.points[k, :count, :, :d] = path.points
        if isinstance(manoeuvre.response, AccelerateThenBrake):
            fleet.begin[k, count:] = now + FOR_EVER
        if self.method.shared:
            fleet.seen_begin[k], fleet.seen_points[k] = fleet.begin[k], fleet.points[k]
        fleet.response[k], self._others[k] = -1, repr(manoeuvre.response)
        fleet.control[k, :d] = manoeuvre.control

    def _ask(self, k: int, now: float) -> Decision:
        """What the navigator of robot k says, and what it commits to by it."""
        fleet, d, scenario = self.fleet, self.scenario.dimension, self.scenario
        state = State(fleet.position[k, :d], fleet.velocity[k, :d], fleet.push[k, :d])
        others = [
            Obstacle(scenario.robots[j].shape, self._seen(int(j)), scenario.robots[j].name)
            for j in np.flatnonzero(fleet.present)
            if j != k
        ]
        goal = Goal(Stationary(fleet.target[k, :d]), float(fleet.near[k]), bool(fleet.halt[k]))
        navigator = replace(scenario.navigator(self.method, k), margin=self.margin)
        decision = navigator.decide(state, [*scenario.obstacles, *others], goal, now=now)
        self._commit(k, decision.manoeuvre, now)
        fleet.outcome[k], fleet.regret[k] = ASK, 0.0
        return decision

    def _seen(self, k: int) -> Trajectory:
        """The course that the others see of robot k."""
        begin, d = self.fleet.seen_begin[k], self.scenario.dimension
        real = np.flatnonzero(np.diff(begin) > 0.0)
        h = np.diff(begin)[real]
        p = self.fleet.seen_points[k, real, :, :d]
        p0, p1, p2, p3 = (p[:, j] for j in range(4))
        powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
        return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(begin[0]))

    def _world(self, now: float) -> World:
        """The passive obstacles as the method foresees them, grown by the first robot's shape."""
        d, horizon, shape = self.scenario.dimension, self.scenario.horizon, self.scenario.robot.shape
        forecast = self.method.forecast
        there = [o for o in self.scenario.obstacles if forecast.foresees or o.exists(now)]
        seen = [foreseen(obstacle, forecast, now) for obstacle in there]
        bodies = Traffic(seen, now, horizon).bodies(shape)
        stay = [o for o in seen if o.exists(now + horizon) and len(o.shape.parts) == 1]
        return World(
            times=bodies.pieces.times,
            points=bodies.pieces.points,
            radius=bodies.pieces.radius,
            growth=bodies.pieces.growth,
            turns=bodies.pieces.turns if bodies.turning else np.empty((0, 4, 2)),
            body=bodies.pieces.body,
            around=bodies.around,
            spread=bodies.spread,
            hull=bodies.hull,
            corners=bodies.corners,
            first=bodies.first,
            mixed=bodies.mixed,
            heads=bodies.heads,
            ends=np.array([o.trajectory.position(now + horizon) for o in stay]).reshape(-1, d),
            reach=np.array([o.shape.reach for o in stay]),
            grown=shape.reach,
        )
