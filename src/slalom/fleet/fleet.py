"""Robots that decide together in a loop that belongs to the caller: arrays in, arrays out.

A step has the stages of a decision, see `slalom.decision.navigator`, for many robots at once:

    predict           _window: once for all robots of a method
    gather            _grown_bodies: once for each kind of skeleton; obstacle_pieces: for each robot
    keep ... relax    decide_all: the same kernels on a table of n rows; _fall_back where they have no decision
    report            _decision: arrays, no `Decision`

It differs from `Navigator.decide` in three ways. Guidance may set targets (destinations.py). The table holds the other
robots, as observed or published (observation.py). Robots decide in threads, or in rounds after those whose decisions
they avoid (rounds.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import partial
from typing import NamedTuple, Unpack

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import (
    Array,
    array_of,
    each_number,
    flags,
    known,
    listing,
    not_before,
    not_negative,
    whole,
    whole_numbers,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST_DURATION
from slalom.decision import Outcome
from slalom.decision.decision import Approaches
from slalom.decision.methods import Method, margin_among
from slalom.decision.navigator import OUTCOMES, Navigator
from slalom.decision.settings import DETOURS, FleetSettings, Settings
from slalom.decision.tables import (
    GrownBodies,
    Skeletons,
    bounds_of,
    commit_to,
    observed_path,
    publish,
    reaches,
    response_table,
    robot_table,
    states_on_paths,
    stop_observed,
    stopping_deceleration,
)
from slalom.fleet.destinations import Destinations
from slalom.fleet.guidance import guidance_of
from slalom.fleet.observation import Information, observers_of
from slalom.fleet.right_of_way import PublishedManoeuvre, RightOfWay
from slalom.fleet.rounds import at_once, of_one_kind, one_by_one
from slalom.fleet.settings import Policy, members_of
from slalom.forecast.linear import piecewise_polynomial
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import ARRIVE, NO_OBJECTIVES, DecisionSettings, DecisionTables, RobotTable
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre, first_manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.response import AccelerateThenBrake, Response
from slalom.model.shape import Shape, refuse_turned
from slalom.model.state import State
from slalom.model.trajectory import ConstantVelocity, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow, each_of, fitting, in_world
from slalom.perception.sight import Sight

BY_NUMBER: npt.NDArray[np.object_] = np.array(OUTCOMES, object)


class FleetDecision(NamedTuple):
    """Commands for n robots until their next decision; rows of robots that are not present are 0.

    Apply one of the three: accelerations, constant over the period; or the velocities or positions to be reached at its
    end, for robots that are controlled by these.
    """

    accelerations: Array  # (n, d) [m/s^2]
    velocities: Array  # (n, d) [m/s]
    positions: Array  # (n, d) [m]
    outcomes: tuple[Outcome | None, ...]  # n, None for a robot that is not present
    stalled: Array  # (n,) [s] since each robot last came nearer to its target, see `Decision.stalled`
    stuck: Flags  # (n,) whether that is at least `stuck_after`: it needs another target

    @property
    def safe(self) -> Flags:
        """Whether each robot stays collision-free up to the horizon as long as the forecasts hold: (n,).

        True for a robot that is not present.
        """
        return np.array([outcome is None or outcome.safe for outcome in self.outcomes], dtype=np.bool_)


class Fleet:
    """Robots that decide together, each from its information about the others.

    `watch`, if any, is called after each group of robots (rows) has decided, with the table of the robots and the
    obstacles among which they decided. It must not change them, and copies what it keeps.

    With `nao_shared` robots receive each other's committed manoeuvres and decide one after the other. With others each
    predicts the others from their present states. Without guidance each leaves the ways of robots that are held up, see
    `RightOfWay`. In a fleet of several methods a robot receives the manoeuvre of another only if both have the
    method `nao_shared`; a robot that only observes may press one that shares, which ends its guarantee. The result
    depends neither on threads nor on the hash seed. A fleet can be pickled and copied; the copy goes on equal to the
    bit.

    Args:
        method: a row of the table of methods. shapes, limits, margin, priority: see below.
            Each is one for all robots, or a sequence with one for each.
        robots: their number n, where no sequence is given. names: for messages and manoeuvres; None: numbers.
        obstacles: passive obstacles with their true trajectories, in every world; the method's forecast determines what
            is used.
        margin: [m] to keep from obstacles. Between robots that only observe each other it is larger, by twice
            a (period + delay)^2 and three times the noise. The first is the largest error of a prediction when both
            accelerate by a at most.
        priority: above 0. Of two robots that share the avoidance, robot i does the part s q / (s q + (1 - s) p). Here s
            is the share of its method, p its priority and q that of the other. With published manoeuvres robots decide
            by falling priority, so that one avoids those before it.
        worlds: (n,) whole numbers from 0. Robots of different worlds do not meet: one step serves many environments.
        settings: period, horizon, holds, patience, detours and stuck_after, see `Settings`.
        observation_delay: [s] largest age of the observed states of the others. observation_noise: [m] standard
            deviation of that. Both enter the margin.
        sight: what each robot sees of obstacles and, unless it shares its manoeuvres, of other robots; obstacles at
            rest are a known map. None: everything.
        threads: None: one for each core.
        guided: whether each robot heads for a place that guidance chooses on the way to its target. Guided robots go
            around obstacles at rest, pass on traffic circles, and move aside on request, also from their targets.
            Guidance has no part in safety: it is for robots that would block each other. In the plane, in one world;
            for targets only. None: as in the simulator, where that is possible. Several robots in the plane in one
            world are guided at each step with targets, and all others are not.

    Raises:
        InvalidInput: a method for one robot alone; sequences of different lengths; shapes of different dimensions;
            equal names; a period above the horizon; with shared manoeuvres, a horizon shorter than one of them;
            priorities where a method does not share the avoidance, or with a ratio above PRIORITY_RATIO; a sight
            in space, in several worlds, or with a hidden speed; guidance in space or in several worlds.
    """

    def __init__(
        self,
        method: Method | Sequence[Method],
        shapes: Shape | Sequence[Shape],
        limits: Limits | Sequence[Limits],
        *,
        robots: int | None = None,
        names: Sequence[str] | None = None,
        obstacles: Sequence[Obstacle] | ObstacleTable = (),
        margin: npt.ArrayLike = Settings.margin,
        priority: npt.ArrayLike = 1.0,
        worlds: npt.ArrayLike | None = None,
        observation_delay: float = 0.0,
        observation_noise: float = 0.0,
        threads: int | None = None,
        sight: Sight | None = None,
        guided: bool | None = None,
        **settings: Unpack[FleetSettings],
    ) -> None:
        self.members = members_of(method, shapes, limits, robots, names, margin, priority, worlds)
        self.obstacles = obstacles if isinstance(obstacles, ObstacleTable) else ObstacleTable(obstacles)
        for name in settings:
            known(name, "setting", tuple(FleetSettings.__annotations__))
        settings.setdefault("detours", DETOURS)
        first = self.members.methods[0], self.members.shapes[0], self.members.limits[0]
        self.navigator = Navigator(*first, margin=float(self.members.margins[0]), **settings)
        self.period, self.horizon = self.navigator.period, self.navigator.horizon
        delay, noise = not_negative(observation_delay, "observation_delay"), observation_noise
        self.threads = kernels.threads() if threads is None else whole(threads, "threads", 1)
        n, dimensions = len(self.members.shapes), {each.dimension for each in (*self.members.shapes, *self.obstacles)}
        if len(dimensions) != 1:
            found = sorted(dimensions)
            raise InvalidInput(f"shapes: expected those of robots and obstacles in one dimension, found {found}")
        self.dimension, self.skeletons = dimensions.pop(), Skeletons(self.members.shapes)
        self.policies = self._policies()
        self.table, self.response_parts = self._tables(delay, not_negative(noise, "observation_noise"))
        self._bounds = bounds_of(self.members.limits, [State(np.zeros(self.dimension), np.zeros(self.dimension))] * n)
        self._turning = any(each.bounds for each in self.members.limits)
        # The response of each robot whose manoeuvre is not in the tables.
        self.other_responses, self._steps = np.full(n, "", object), 0
        self._last = -np.inf
        self._known = np.zeros(n, np.bool_)
        self.headings: Array | None = None
        self._approaches = Approaches(n, self.dimension)
        self._fastest = np.array([limits.max_speed for limits in self.members.limits])
        given = self.obstacles.given
        self.observers = [] if sight is None else observers_of(sight, self.members, given)
        self.guidance = guidance_of(guided, self.members, given, self.threads)
        self.destinations = Destinations(self.members, self.period, self.horizon, self.guidance, bool(guided))
        self.right_of_way = RightOfWay(n)
        self.targets, self.information = self.destinations.motion, Information()
        self.watch: Callable[[Indices, RobotTable, Obstacles], None] | None = None

    def __repr__(self) -> str:
        methods = ", ".join(policy.method.name for policy in self.policies)
        return f"<{type(self).__name__} by {methods}, robots: {len(self.members.shapes)}>"

    def _policies(self) -> list[Policy]:
        rows: dict[Method, list[int]] = {}
        for k, method in enumerate(self.members.methods):
            rows.setdefault(method, []).append(k)
        publishes = np.array([method.shared for method in self.members.methods])
        return [
            Policy(replace(self.navigator, method=method), np.array(some), publishes) for method, some in rows.items()
        ]

    def _tables(self, delay: float, noise: float) -> tuple[RobotTable, npt.NDArray[np.object_]]:
        """The table of robots, and the responses of its rows."""
        robots, distinct = self.members, dict[tuple[int, Limits], int]()
        n, policy_of = len(robots.limits), np.empty(len(robots.limits), np.int64)
        for p, policy in enumerate(self.policies):
            policy_of[policy.rows] = p
        kind = [distinct.setdefault(each, len(distinct)) for each in zip(policy_of.tolist(), robots.limits)]
        kinds = tuple(
            self.policies[p].method.responses(limits, self.period, self.navigator.holds) for p, limits in distinct
        )
        for (p, _), responses, k in zip(distinct, kinds, (kind.index(which) for which in range(len(kinds)))):
            if self.policies[p].method.shared:
                self._refuse_short_horizon(responses, robots.names[k])
        self.responses = response_table(kinds, self.horizon, self.span, self.dimension, self.period)
        committed = max(3, int(np.diff(self.responses.first).max()))
        predicted = max(policy.pieces for policy in self.policies)
        published = any(policy.published.any() for policy in self.policies)
        few = all(policy.tabulated for policy in self.policies) and not published
        # A path that is cut where it gets into contact with an obstacle rests there for one piece more.
        stops = any(policy.method.stops_at_obstacles for policy in self.policies)
        table = robot_table(n, committed, (predicted if few else max(predicted, committed)) + stops)
        each = table.each
        each["kind"], each["skeleton"] = kind, self.skeletons.kind
        each["rounding"] = self.skeletons.rounding
        each["radius"] = [shape.bounding_radius for shape in robots.shapes]
        each["max_speed"] = [limits.max_speed for limits in robots.limits]
        each["max_acceleration"] = [limits.max_acceleration for limits in robots.limits]
        each["braking"] = [limits.braking for limits in robots.limits]
        decelerations = [
            stopping_deceleration(responses, limits, self.horizon, self.period)
            for (_, limits), responses in zip(distinct, kinds)
        ]
        each["stopping"] = [decelerations[k] for k in kind]
        each["priority"], each["world"] = robots.priorities, robots.worlds
        most, time = max(each.max_acceleration for each in robots.limits), self.period + delay
        each["margin"] = robots.margins
        each["margin_among"] = [
            margin_among(method, margin, most, time, noise)
            for method, margin in zip(robots.methods, robots.margins.tolist())
        ]
        return table, np.array([response for each in kinds for response in each], object)

    @property
    def span(self) -> float:
        """Duration [s] of the committed paths; a path that ends at rest continues at rest."""
        return 2.0 * self.horizon

    def _refuse_short_horizon(self, responses: Sequence[Response], name: str) -> None:
        """Raise InvalidInput for a manoeuvre that lasts longer than the horizon.

        Robots can avoid a robot at rest for all time, but not one that still moves after the horizon.
        """
        end = max(response.knots(1e6, 1.0)[-2] for response in responses)
        if end > self.horizon:
            raise InvalidInput(
                f"horizon: expected at least {end:g} s, the longest manoeuvre of {name!r}, found {self.horizon:g} s"
            )

    def _by_policy(self, order: Indices) -> Iterator[tuple[Policy, Indices]]:
        """The robots in `order` that decide by each policy.

        Those that decide one after the other do so by falling priority.
        """
        for policy in self.policies:
            some = order[np.isin(order, policy.rows)] if len(self.policies) > 1 else order
            if policy.method.shared:
                some = some[np.argsort(-self.table.each["priority"][some], kind="stable")]
            if len(some):
                yield policy, some

    def _window(self, policy: Policy, obstacles: Obstacles, now: float) -> ObstacleWindow:
        """The obstacles as the robots of a policy predict them."""
        return ObstacleWindow.predicted(obstacles, policy.method.forecast, now, self.horizon, policy.reaction)

    def _grown_bodies(self, window: ObstacleWindow) -> list[GrownBodies]:
        """Passive obstacles on predicted trajectories and the robots, grown by each kind of skeleton."""
        kinds, detours = range(len(self.skeletons.shapes)), bool(self.navigator.detours)
        return [self.skeletons.grown_bodies(k, window, detours=detours) for k in kinds]

    def _decide(
        self, order: Indices, settings: DecisionSettings, bodies: list[GrownBodies], obstacles: Obstacles
    ) -> None:
        """Commit the robots (rows) in `order`, of one policy, to new manoeuvres; their outcomes are in the table.

        The table holds the others as observed. With shared manoeuvres each robot avoids the decisions of those before
        it. Where the compiled policy has no decision, a `Navigator` among the `obstacles` falls back.
        """
        if self._turning:
            states = [self._state(k) for k in range(len(self.members.limits))]
            self._bounds = bounds_of(self.members.limits, states)
        decide_all = one_by_one if settings.shared else at_once
        claims = self.right_of_way.claims(self.table)
        for kind, own in enumerate(bodies):
            stop_observed(kind, self.table, own, settings)
        for some in of_one_kind(order, self.table.each["skeleton"], settings.shared):
            own = bodies[int(self.table.each["skeleton"][some[0]])]
            tables = DecisionTables(
                self.table, *own, self.responses, self._bounds, self.targets, settings, NO_OBJECTIVES, claims
            )
            decide_all(some, tables, partial(self._fall_back, obstacles=obstacles, now=settings.now), self.threads)
        if self.watch is not None:
            self.watch(order, self.table, obstacles)

    def _decide_by_sight(self, policy: Policy, some: Indices, settings: DecisionSettings, around: Obstacles) -> None:
        """Decide for robots (rows), each among the obstacles and the robots that it sees.

        Robots that share their manoeuvres know them of all robots.
        """
        each, observed = self.table.each, self.table.observed
        d = self.dimension
        times, points = observed.times.copy(), observed.points.copy()
        now = settings.now
        # There is one world, number 0.
        obstacles, present = each_of(in_world(around, 0)), each["present"].copy()
        robots = [
            Obstacle(shape, ConstantVelocity(position, velocity, now))
            for shape, position, velocity in zip(self.members.shapes, each["position"][:, :d], each["velocity"][:, :d])
        ]
        for k in some.tolist():
            others = [j for j in range(len(robots)) if j != k and each["present"][j]]
            observer, ahead = self.observers[k], each["target"][k, :d]
            seen = observer.look(self._state(k), obstacles, now, ahead, [robots[j] for j in others])
            if not policy.method.shared:
                each["present"] = False
                each["present"][others], each["present"][k] = observer.robots_seen, True
            bodies = self._grown_bodies(self._window(policy, seen, now))
            self._decide(some[some == k], settings, bodies, seen)
            each["present"] = present
            if not settings.shared:
                # The next robot may not see the obstacles at which the others were predicted to stop.
                observed.times[:], observed.points[:] = times, points

    def _state(self, k: int) -> State:
        """The state of the robot in row k."""
        each, d = self.table.each, self.dimension
        heading = None if self.headings is None else float(self.headings[k])
        return State(each["position"][k, :d], each["velocity"][k, :d], each["acceleration"][k, :d], heading)

    def known_to(
        self, k: int, table: RobotTable, obstacles: Obstacles, now: float
    ) -> tuple[list[Obstacle | ObstacleTable | Tracks], dict[int, Obstacle]]:
        """The obstacles that the robot in row k can meet, and the other robots as it predicts them, by their rows."""
        each, d = table.each, self.dimension
        world = int(each["world"][k])
        passive = in_world(obstacles, world)
        reach = reaches(each, self.horizon)
        away = np.linalg.norm(each["position"] - each["position"][k], axis=1)
        met = each["present"] & (each["world"] == world) & (away <= reach + reach[k] + each["margin_among"][k])
        others = {}
        for j in np.flatnonzero(met & (np.arange(len(met)) != k)).tolist():
            path = observed_path(table, j, k, d)
            # A path that lasts beyond the horizon is not continued, which would take longer than its pieces.
            lasts = path.span[1] > now + self.horizon
            shape, name = self.members.shapes[j], self.members.names[j]
            others[j] = Obstacle(shape, path, name, after_end="leaves" if lasts else "unknown")
        return passive, others

    def _fall_back(self, k: int, obstacles: Obstacles, now: float) -> None:
        """Commit the robot in row k to the decision of a navigator among `obstacles` and the other robots."""
        each, d = self.table.each, self.dimension
        state = self._state(k)
        passive, others = self.known_to(k, self.table, obstacles, now)
        arrives = each["objective"][k] == ARRIVE
        position = each["target"][k, :d] if arrives else state.position + self.horizon * each["wanted"][k, :d]
        goal = Goal(Stationary(position), float(max(each["tolerance"][k], 1e-9)), bool(each["stop"][k]))
        navigator = replace(
            self.navigator,
            method=self.members.methods[k],
            robot=self.members.shapes[k],
            limits=self.members.limits[k],
            margin=float(each["margin_among"][k]),
        )
        decision = navigator.fall_back(state, [*passive, *others.values()], goal, now=now)
        self._commit(k, decision.manoeuvre, now)
        each["outcome"][k] = OUTCOMES.index(decision.outcome)

    def _commit(self, k: int, manoeuvre: Manoeuvre, now: float) -> None:
        """Commit the robot in row k to a manoeuvre that is not in the tables."""
        table, d = self.table, self.dimension
        path = manoeuvre.path(now, now + self.span)
        commit_to(table, k, path)
        if isinstance(manoeuvre.response, AccelerateThenBrake):
            table.committed.times[k, len(path.points) :] = now + REST_DURATION
        if self.members.methods[k].shared:
            publish(table, k)
        table.each["response"][k], self.other_responses[k] = -1, manoeuvre.response
        table.each["settled"][k] = manoeuvre.settled_time(self.period, self.horizon)
        table.each["resting"][k] = False
        table.each["control"][k, :d] = manoeuvre.control

    def _begin(self, k: int, state: State, now: float) -> None:
        """Commit the robot in row k to its first manoeuvre."""
        self._commit(k, first_manoeuvre(state, self.members.limits[k], self.period, now), now)
        # A shared manoeuvre commits a robot from the start; an observed robot is free to change its first one.
        if not self.members.methods[k].shared:
            self.table.each["settled"][k] = np.inf

    def committed_responses(self) -> npt.NDArray[np.object_]:
        """The responses (n,) of the committed manoeuvres, "" without one."""
        rows = self.table.each["response"]
        return np.where(rows >= 0, self.response_parts[rows], self.other_responses)

    def planned(self, t: float) -> tuple[Array, Array]:
        """Velocities (n, 3) [m/s] and positions (n, 3) [m] at time t [s] on the committed paths."""
        return states_on_paths(self.table.committed, t)

    def __copy__(self) -> Fleet:
        return deepcopy(self)  # a step changes the tables in place

    def step(
        self,
        now: float,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike,
        targets: npt.ArrayLike | None = None,
        *,
        desired_velocities: npt.ArrayLike | None = None,
        accelerations: npt.ArrayLike | None = None,
        tolerances: npt.ArrayLike = 0.2,
        stop: npt.ArrayLike = True,
        paths: Sequence[PathGoal] | None = None,
        goals: Sequence[Goal] | None = None,
        present: npt.ArrayLike | None = None,
        headings: npt.ArrayLike | None = None,
        others: Obstacles = (),
    ) -> FleetDecision:
        """Decide for all robots at `now` [s], one period after the last step.

        Args:
            positions, velocities: (n, d) [m], [m/s] as they are now.
            targets: (n, d) [m], positions to be at.
            desired_velocities: (n, d) [m/s], velocities to have, in place of targets.
            paths: n paths to follow, in place of targets. Tolerances and stops are theirs.
            goals: n goals in place of targets, of which some may move and some be paths. Guidance leads there, too.
            accelerations: (n, d) [m/s^2] applied up to now; None: those of the last decision, 0 for robots that join.
            tolerances: (n,) or one number [m], see `Goal`. stop: (n,) or one, whether to stop at the target.
            present: (n,) whether a robot is in the scene; None: all. A robot joins at its first step in the scene.
            headings: (n,) [rad] of the bodies, for bounds in their frames and the field of view; None: along the
                velocities.
            others: bodies that do not avoid this fleet: observed `Tracks`, or the `manoeuvres` of another fleet.

        Raises:
            InvalidInput: arrays of other shapes, values that are not finite, a tolerance of 0, not one of targets,
                desired velocities, paths and goals, a time before that of the last step, headings in space or of
                robots that are not round; no targets or goals for a fleet with `guided=True`; a target, goal or path to
                stop at for a robot with the bound LeastSpeed.
        """
        # As a float: kernels would be compiled once more for whole numbers.
        self._last = now = not_before(now, self._last, "now", "a step")
        each, n = self.table.each, len(self.members.shapes)
        d = self.dimension
        there = np.ones(n, np.bool_) if present is None else flags(present, "present", n)
        each["position"][:, :d] = array_of(positions, "positions", (n, d))
        each["velocity"][:, :d] = array_of(velocities, "velocities", (n, d))
        joined = there & ~self._known
        each["acceleration"][joined] = 0.0
        if accelerations is not None:
            each["acceleration"][:, :d] = array_of(accelerations, "accelerations", (n, d))
        each["tolerance"], each["stop"] = each_number(tolerances, "tolerances", n), flags(stop, "stop", n)
        if not np.all(each["tolerance"] > 0.0):
            raise InvalidInput(f"tolerances: expected numbers above 0 m, found {each['tolerance'].min():g} m")
        each["present"] = there
        self.headings = None if headings is None else array_of(headings, "headings", (n,))
        for k, heading in enumerate(() if self.headings is None else self.headings.tolist()):
            refuse_turned(self.members.shapes[k], heading, f"headings[{k}]")
        around = [self.obstacles, *fitting(others, self.dimension, now, "others", "fleet")]
        to = self.destinations
        to.set(self.table, now, targets=targets, desired_velocities=desired_velocities, paths=paths, goals=goals)
        to.guide(self.table, now, joined)
        to.follow(self.table, now, self.policies, lambda policy: self._window(policy, around, now))
        self.targets = to.motion
        for k in np.flatnonzero(joined).tolist():
            self._begin(k, State(each["position"][k, :d], each["velocity"][k, :d], each["acceleration"][k, :d]), now)
        self._known[:] = there
        self.right_of_way.update(self.table, *to.distances(self.table), self.period, around, to.guided)
        order = _in_turn(self.members.worlds, self._steps)
        self._steps += 1
        self._decide_by_policy(order[there[order]], around, now)
        return self._decision(there, now)

    def _decide_by_policy(self, order: Indices, around: Obstacles, now: float) -> None:
        """Commit the robots (rows) in `order`, which decide now among the obstacles `around`."""
        information = self.information
        information.receive(self.table, now)
        for policy, due in self._by_policy(order):
            bodies = [] if self.observers else self._grown_bodies(self._window(policy, around, now))
            for some, period in information.groups(self.table, self.dimension, policy, due, now):
                settings = policy.settings(now, max(self.period, period), self.table)
                if self.observers:
                    self._decide_by_sight(policy, some, settings, around)
                else:
                    self._decide(some, settings, bodies, around)

    def _decision(self, there: Flags, now: float) -> FleetDecision:
        """Commands for the robots until the next step."""
        each, d = self.table.each, self.dimension
        velocity, position = self.planned(now + self.period)
        acceleration = (velocity - each["velocity"]) / self.period
        each["acceleration"] = np.where(there[:, None], acceleration, 0.0)
        acceleration, velocity, position = (
            np.where(there[:, None], one, 0.0)[:, :d] for one in (acceleration, velocity, position)
        )
        left, targets, tolerances = self.destinations.distances(self.table)
        left[~there | (each["objective"] != ARRIVE)] = np.nan
        stalled = self._approaches.stalled(left, targets, tolerances, self._fastest, now)
        outcomes = BY_NUMBER[each["outcome"]]
        outcomes[~there] = None
        stuck = stalled >= self.navigator.stuck_after
        return FleetDecision(acceleration, velocity, position, tuple(outcomes), stalled, stuck)

    def manoeuvres(self, robots: Sequence[int] | None = None) -> tuple[Obstacle, ...]:
        """The committed manoeuvres of the robots that are present, or of some of them (rows), as obstacles.

        They can be pickled, and passed to another fleet as `others`. Fleets in several processes then take turns. Each
        decides with the manoeuvres of all others that were published before. With `nao_shared` in all of them each
        robot avoids all published manoeuvres, as in one fleet.

        Raises:
            InvalidInput: a fleet with worlds; a robot that was not present in the last step.
        """
        if self.table.each["world"].any():
            raise InvalidInput("worlds: expected one world to publish manoeuvres of, found several")
        committed, d = self.table.committed, self.dimension
        n = len(self.members.shapes)
        if robots is None:
            rows = np.flatnonzero(self._known)
        else:
            listing(robots, "numbers of robots", "robots")
            rows = whole_numbers(robots, "robots", len(robots))
        if np.any(rows >= n):
            raise InvalidInput(f"robots: expected numbers below {n}, found {int(np.max(rows))}")
        if not self._known[rows].all():
            absent = int(rows[np.argmin(self._known[rows])])
            raise InvalidInput(f"robots: expected those that were present in the last step, found {absent}")
        standings = self.right_of_way.standings(self.table)
        return tuple(
            PublishedManoeuvre(
                self.members.shapes[k],
                piecewise_polynomial(committed.times[k], committed.points[k, ..., :d]),
                self.members.names[k],
                standing=standings[k],
            )
            for k in rows.tolist()
        )


def _in_turn(worlds: Indices, steps: int) -> Indices:
    """All robots in the order of a step: in each world (n,) another one is the first, as in a fleet of that world."""
    by_world = np.argsort(worlds, kind="stable")
    _, first, counts = np.unique(worlds[by_world], return_index=True, return_counts=True)
    turn = (np.arange(len(worlds)) - np.repeat(first, counts) - steps) % np.repeat(counts, counts)
    return np.asarray(by_world[np.lexsort((turn, worlds[by_world]))])
