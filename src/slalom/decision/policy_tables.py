"""The tables from which one robot decides: what all its decisions have in common is made once."""

from ctypes import c_void_p, cast
from dataclasses import replace
from math import hypot
from typing import Any, Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import TRACKS, Array, has, vector
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import AIM_LATEST, CONTACT_SLACK
from slalom.decision.decision import Decision
from slalom.decision.methods import margin_among
from slalom.decision.objective import (
    Arrive,
    Candidates,
    FollowAcceleration,
    FollowVelocity,
    KeepAcceleration,
    Objective,
    Situation,
    aims_are_compiled,
    costs_of,
    is_compiled,
    parts_of,
    preferred_control,
)
from slalom.decision.right_of_way import CLAIM_AFTER, presumed_claims
from slalom.decision.settings import DETOURS, Settings
from slalom.decision.tables import (
    RobotRow,
    Skeletons,
    bounds_of,
    commit_to,
    observe,
    response_table,
    robot_row,
    robot_table,
    stop_observed,
    stopping_deceleration,
    target_paths,
)
from slalom.forecast.forecast import Forecast
from slalom.kernels.decision.tables import (
    ARRIVE,
    ASIDE,
    CALLBACK,
    FOLLOW_ACCELERATION,
    FOLLOW_VELOCITY,
    MIXED,
    NO_CLAIMS,
    NO_OBJECTIVES,
    DecisionTables,
    Objectives,
    Paths,
    ResponseTable,
    RobotTable,
)
from slalom.model.goal import Goal
from slalom.model.path import Path
from slalom.model.path_goal import PathGoal, PathStep
from slalom.model.response import AccelerateThenBrake, AccelerateThenStop
from slalom.model.shape import round_shape
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import Reach
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import ObstacleWindow

# The input of one decision as the policy takes it.


class Request(NamedTuple):
    """The input of one decision, with the obstacles that decide alike apart, see `Navigator.decide`."""

    robot: Settings  # with the objective of the decision
    around: tuple[Obstacle | ObstacleTable | Tracks, ...]
    others: Tracks | None
    state: State
    goal: Goal
    step: PathStep | None
    now: float
    previous: Decision | None
    limit: float  # [s] of work

    @property
    def target(self) -> Goal:
        """The goal, or the next target on the path to it."""
        return self.goal if self.step is None else self.step.goal

    @property
    def place(self) -> Array:
        """The position (d,) [m] from which the way to the target counts: of the robot, or of its progress on a path."""
        if self.step is None or not isinstance(self.goal, PathGoal):
            return self.state.position
        return self.goal.point(self.step.progress)


def detours_of(request: Request, patience: float) -> tuple[float, ...]:
    """The detours [rad] that a decision considers.

    Those of the robot; by default DETOURS where it has been held up for its `patience` [s].
    """
    if request.robot.detours is not None:
        return request.robot.detours
    last = None if request.previous is None else request.previous.approach
    return () if last is None or request.now - last.paced < patience else DETOURS


def observed_robots(robots: Tracks | None, forecast: Forecast) -> tuple[Tracks | None, Tracks | None]:
    """The other robots as a method predicts them, and those that do no part of the avoidance; None for none.

    Raises:
        InvalidInput: something else than tracks, or tracks with probabilities or worlds.
    """
    if robots is None:
        return None, None
    has(robots, *TRACKS, "robots")
    robots.refuse_probabilities("robots")
    robots.refuse_worlds("robots")
    robots = robots.with_forecast(forecast)
    some, rest = (robots, None) if robots.shares is None else robots.yielding
    return some if len(some) else None, rest if rest is not None and len(rest) else None


# Answers of an objective that is written in Python to the kernels that decide.


class ObjectiveInPython:
    """The costs of the candidates of one decision, which the kernels ask for.

    Args:
        objective: asked. situation: of the decision. candidates: the most of them.
        pieces: of the paths in the tables of the robot.
    """

    def __init__(self, objective: Objective, situation: Situation, candidates: int, pieces: int) -> None:
        self.objective, self.situation = objective, situation
        self.failure: BaseException | None = None
        self._callback = CALLBACK(self._answer)
        self._paths = Paths(np.empty((candidates, pieces + 1)), np.empty((candidates, pieces, 4, 3)))
        self._until, self._costs = np.empty(candidates), np.empty(candidates)

    def table(self, base: Objectives, preferred: Array) -> Objectives:
        """The table by which kernels ask: that of the objective that this one extends, and its own controls (r, 3)."""
        address = cast(self._callback, c_void_p).value or 0
        return base._replace(
            address=address, preferred=preferred, paths=self._paths, until=self._until, costs=self._costs
        )

    def raise_failure(self) -> None:
        """Raise what the objective raised when it was asked: a kernel cannot pass it on."""
        if self.failure is not None:
            raise self.failure

    def _answer(self, count: int) -> float:
        costs, s = self._costs[:count], self.situation
        try:
            points = self._paths.points[:count, ..., : s.state.dimension]
            given = Candidates(self._paths.times[:count], points, s.now + self._until[:count], costs.copy())
            costs[:] = np.inf if self.failure is not None else costs_of(self.objective, given, s)
        except BaseException as failure:
            self.failure, costs[:] = failure, np.inf
        return 0.0


REACH_SHARE: Final = 1.25
"""[1] A decision knows passive bodies up to this many times the distance at the largest speed within the horizon.
Larger: more bodies are passed to each decision. Below 1: bodies that the robot can meet are left out. Just above 1: a
committed manoeuvre that disturbances displace may lead to where bodies are left out, and is not kept then."""


class OwnTable(NamedTuple):
    """A table of robots whose row 0 is that of the robot that decides."""

    robots: RobotTable
    own: RobotRow


class PolicyTables:
    """Parts that all decisions of one robot have in common, from which the tables of each decision are made.

    Args:
        among: whether there are other robots that decide by the same method.

    Raises:
        InvalidInput: a response that is not linear in the state.
    """

    def __init__(self, robot: Settings, *, among: bool) -> None:
        method = robot.method
        limits = robot.limits
        d = robot.robot.dimension
        self.robot = robot
        self.among = among
        self.dimension = d
        rules = method.among_robots() if among else method
        self.responses = rules.responses(limits, robot.period, robot.holds)
        self._table = response_table((self.responses,), robot.horizon, 2.0 * robot.horizon, d, robot.period)
        self.pieces = int(np.diff(self._table.first).max())
        self._skeletons = Skeletons([robot.robot, round_shape(0.0, d)] if among else [robot.robot])
        margin = robot.margin
        self._margin = margin_among(method, margin, limits.max_acceleration, robot.period) if among else margin
        self._settings = robot.numbers(among=among)
        self._clearance = robot.margin + CONTACT_SLACK + float(self._table.each["error"].max())
        stops = any(isinstance(one, AccelerateThenStop | AccelerateThenBrake) for one in self.responses)
        self._patience = CLAIM_AFTER * limits.max_speed / limits.max_acceleration if stops else np.inf
        self._spare: dict[tuple[int, int, int], OwnTable] = {}
        self._bounds = None if limits.bounds else bounds_of([limits], [State(np.zeros(d), np.zeros(d))])
        self._at_rest, _ = target_paths([Goal(Stationary(np.zeros(d)))], 0.0, 1.0)

    def filled(self, robots: RobotTable) -> OwnTable:
        """The table with the shape and the limits of the robot in row 0."""
        robot, limits = self.robot, self.robot.limits
        # Nothing is known of the limits of others: they are taken to be as fast as any.
        robots.each["skeleton"][1:], robots.each["max_speed"][1:] = self._skeletons.kind[-1], np.inf
        own = robots.each[:1]
        own["rounding"] = self._skeletons.rounding[0]
        own["radius"], own["braking"] = robot.robot.bounding_radius, limits.braking
        own["max_acceleration"] = limits.max_acceleration
        own["stopping"] = stopping_deceleration(self.responses, limits, robot.horizon, robot.period)
        return OwnTable(robots, robot_row(robots.each, 0, self.dimension))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_spare": {}}

    def robots(self, others: Tracks | None, path: Path | None, settled: float, now: float) -> OwnTable:
        """A table of the robot, committed to a `path` that settles at a time [s], and of others; for `decision`.

        Give it back after the decision, see `give_back`.
        """
        limits, observed = self.robot.limits, None if others is None else others.paths(now + self.robot.horizon)
        pieces = self.pieces if path is None else max(self.pieces, len(path.points))
        n, q = (1, 1) if observed is None else (1 + len(observed[1]), observed[1].shape[1])
        # A path that is cut where it gets into contact with an obstacle rests there for one piece more.
        q += self._settings.stops_at_obstacles
        # What is popped is of no other thread: decisions in several threads never have the same table.
        table = self._spare.pop((n, pieces, q), None) or self.filled(robot_table(n, pieces, q))
        robots, own = table
        if others is not None and observed is not None:
            observe(robots, others, *observed)
        if path is None:
            robots.committed.times[0], robots.committed.points[0] = 0.0, 0.0
        else:
            commit_to(robots, 0, path)
        own.settled[0] = settled
        own.resting[0] = False
        own.max_speed[0] = limits.max_speed
        own.final[0] = True
        return table

    def give_back(self, table: OwnTable) -> None:
        """Keep a table of robots for the next decision: a new one takes 0.13 of a short decision."""
        (n, pieces), q = table.robots.committed.points.shape[:2], table.robots.observed.points.shape[1]
        self._spare = {(n, pieces, q): table}

    def reach(self, state: State, others: Tracks | None = None, enough: float = 0.0) -> Reach:
        """Where bodies count for a robot in this state: also those at which others stop that it may meet.

        enough: [m] clearance beyond the margin.
        """
        fastest, clearance = max(self.robot.limits.max_speed, hypot(*state.velocity)), self._clearance + enough
        if others is not None and self._settings.stops_at_obstacles:
            clearance += self._margin + self.robot.robot.bounding_radius + 2.0 * float(others.radii.max())
        return Reach(state.position, REACH_SHARE * fastest * self.robot.horizon, clearance)

    def decision(
        self, table: OwnTable, obstacles: ObstacleWindow, request: Request
    ) -> tuple[DecisionTables, ObjectiveInPython | None]:
        """The tables of a decision, with the robot in row 0 of a table of robots; its objective if it is in Python.

        Raises:
            InvalidInput: an acceleration to follow with a response that does not set the acceleration at once.
        """
        limits, objective = self.robot.limits, request.robot.objective
        others, state = request.others, request.state
        goal, now = request.target, request.now
        trajectory, (robots, own) = goal.trajectory, table
        target = trajectory.initial_position if isinstance(trajectory, Stationary) else goal.position(now)
        own.position[:] = state.position
        own.velocity[:] = state.velocity
        own.acceleration[:] = state.acceleration
        number, own.wanted[:], objectives = _numbers(objective, self._table, state)
        own.objective[0] = number
        own.enough[0] = enough = float(objective.enough_clearance)
        own.margin[0] = self.robot.margin + enough
        own.margin_among[0] = self._margin + enough
        arrives = number == ARRIVE or bool((objectives.kind == ARRIVE).any())
        own.target[:] = target
        own.tolerance[0] = goal.tolerance
        own.stop[0] = goal.stop and arrives
        targets, own.moving[0] = self._at_rest, False
        if not isinstance(trajectory, Stationary):
            distance = float(np.linalg.norm(target - state.position))
            latest = AIM_LATEST * (distance / limits.max_speed + limits.max_speed / limits.max_acceleration)
            targets, own.moving[:] = target_paths([goal], now, now + self.robot.horizon + latest)
        around = self.reach(state, others, enough)
        # Only costs of arrival count detours; those given by the user count all obstacles, also out of reach.
        given = self.robot.detours is not None
        angles = detours_of(request, self._patience)
        counted = bool(angles) and arrives
        bodies = self._skeletons.grown_bodies(
            0, obstacles, detours=counted, around=None if given and counted else around
        )
        if angles and not given:
            radius = self.robot.robot.bounding_radius + self.robot.margin
            fastest = max(limits.max_speed, hypot(*state.velocity))
            each, reach = bodies.at_horizon.each, fastest * self.robot.horizon
            blocking = kernels.in_the_way(each, own.position, own.target, radius, reach)
            if blocking.any():
                bodies = bodies._replace(at_horizon=bodies.at_horizon._replace(each=each[blocking]))
            else:
                angles = ()
        bounds = bounds_of([limits], [state]) if self._bounds is None else self._bounds
        held_up = bool(angles) and not given
        settings = self._settings._replace(
            now=float(now), budget=1e6 * float(request.limit), detours=np.array(angles), held_up=held_up
        )
        if others is not None and others.shares is not None and settings.share < 1.0:
            # The robot does the rest, see `reciprocity.share_of`.
            rest = (1.0 - others.shares) / others.shares
            robots.each["priority"][1:] = rest * (1.0 - settings.share) / settings.share
            settings = settings._replace(least_share=min(settings.least_share, 0.5))
        if others is not None and settings.stops_at_obstacles:
            kind = int(self._skeletons.kind[-1])
            met = bodies if kind == 0 else self._skeletons.grown_bodies(kind, obstacles, detours=False, around=around)
            stop_observed(kind, robots, met, settings)
        claims = NO_CLAIMS
        if others is not None and number == ARRIVE and request.previous is not None:
            claims = presumed_claims(robots, target - request.place, request.previous.stalled)
        in_python = None
        if not is_compiled(objective):
            in_python, objectives = self._in_python(table, obstacles, request, len(angles), objectives)
        tables = DecisionTables(robots, *bodies, self._table, bounds, targets, settings, objectives, claims)
        return tables, in_python

    def _in_python(
        self, table: OwnTable, obstacles: ObstacleWindow, request: Request, detours: int, base: Objectives
    ) -> tuple[ObjectiveInPython, Objectives]:
        """The objective of the decision, which is in Python, and the table by which it is asked."""
        robot, state = self.robot, request.state
        objective = request.robot.objective
        if request.step is not None:
            robot = replace(robot, limits=replace(robot.limits, max_speed=request.step.max_speed))
        if request.others is not None:
            obstacles = robot.predict([*request.around, request.others], state, request.now)
        own_aims = not aims_are_compiled(objective)
        asked = [
            robot.situation(response, state, request.target, request.now, obstacles)
            for response in (self.responses if own_aims else self.responses[:1])
        ]
        preferred = np.zeros((len(asked) if own_aims else 0, 3))
        for row, situation in zip(preferred, asked):
            row[: state.dimension] = preferred_control(objective.aims(situation))
        ways = 1 + detours + (0 if request.others is None else len(ASIDE))
        # Of each preferred control two, and the present manoeuvre.
        most, pieces = 2 * len(self.responses) * ways + 1, table.robots.committed.points.shape[1]
        in_python = ObjectiveInPython(objective, asked[0], most, pieces)
        return in_python, in_python.table(base, preferred)


def _numbers(objective: Objective, table: ResponseTable, state: State) -> tuple[int, Array, Objectives]:
    """The number of the objective, the velocity or acceleration (d,) to follow, and its parts if it is mixed."""
    if type(objective) is Arrive:
        return ARRIVE, np.zeros(state.dimension), NO_OBJECTIVES
    if not aims_are_compiled(objective):
        # Its costs replace those of any other one.
        return FOLLOW_ACCELERATION, np.zeros(state.dimension), NO_OBJECTIVES
    numbers = [(weight, *_wanted(part, table, state)) for weight, part in parts_of(objective)]
    if len(numbers) == 1:
        return *numbers[0][1:], NO_OBJECTIVES
    wanted = np.zeros((len(numbers), 3))
    wanted[:, : state.dimension] = [one for *_, one in numbers]
    kinds, weights = np.array([kind for _, kind, _ in numbers]), np.array([weight for weight, *_ in numbers])
    return MIXED, np.zeros(state.dimension), NO_OBJECTIVES._replace(kind=kinds, weight=weights, wanted=wanted)


def _wanted(objective: Objective, table: ResponseTable, state: State) -> tuple[int, Array]:
    """The number of an objective without parts, and the velocity or acceleration (d,) to follow."""
    if isinstance(objective, FollowVelocity):
        return FOLLOW_VELOCITY, vector(objective.velocity, "velocity to follow", state.dimension)
    if isinstance(objective, (FollowAcceleration, KeepAcceleration)):
        if not table.each["initial_acceleration"][:, 2].all():
            raise InvalidInput(
                f"objective: expected one for responses that set no acceleration at once, found {objective!r}"
            )
        if isinstance(objective, KeepAcceleration):
            return FOLLOW_ACCELERATION, state.acceleration
        return FOLLOW_ACCELERATION, vector(objective.acceleration, "acceleration to follow", state.dimension)
    return ARRIVE, np.zeros(state.dimension)
