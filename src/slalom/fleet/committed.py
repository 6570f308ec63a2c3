"""Robots with committed manoeuvres, their predictions of each other, and the decisions that change the manoeuvres."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from functools import partial

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import Array, duration, not_negative, positive, whole
from slalom.decision import Outcome
from slalom.decision.approach import Approaches
from slalom.decision.grown_bodies import Skeletons
from slalom.decision.navigator import FALL_BACK, OUTCOMES, Navigator
from slalom.decision.navigator_checks import checked_detours, checked_holds, within_horizon
from slalom.decision.response_tables import response_table, stopping_deceleration
from slalom.decision.robot_tables import (
    bounds_of,
    commit_to,
    observed_path,
    publish,
    reaches,
    robot_table,
    states_on_paths,
    stop_observed,
    target_paths,
)
from slalom.errors import InvalidInput
from slalom.fleet.guidance import guidance_of
from slalom.fleet.images import Images
from slalom.fleet.members import members_of
from slalom.fleet.observation import observers_of
from slalom.fleet.policy import Policy
from slalom.fleet.rounds import at_once, of_one_kind, one_by_one
from slalom.goal import Goal
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import (
    ARRIVE,
    NO_OBJECTIVES,
    DecisionSettings,
    DecisionTables,
    GrownBodies,
    RobotTable,
)
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre, first_manoeuvre
from slalom.methods import HOLDS, Method, margin_among
from slalom.obstacle import Obstacle
from slalom.obstacle.periodic import Period
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.window import Obstacles, ObstacleWindow, in_world
from slalom.path_goal import PathGoal
from slalom.response import AccelerateThenBrake, Response
from slalom.shape import Shape
from slalom.sight import Sight
from slalom.state import State
from slalom.tolerances import DETOURS, PATH_BRAKING, REST_DURATION
from slalom.trajectory import Stationary


class CommittedFleet:
    """Robots that decide by methods of one robot each. `fleet.Fleet` has the loop of a caller, the simulator its own.

    Attributes:
        members: settings of each robot. policies: the robots of each method.
        table: the robots, see `kernels.decision.tables.RobotTable`. responses: of all kinds of robots, as tables.
        progress: [m] of each robot along its path; None where it follows none.
        skeletons: kinds of shapes. targets: motion of targets that move.
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
        period: float = 0.1,
        horizon: float = 6.0,
        margin: npt.ArrayLike = 0.05,
        priority: npt.ArrayLike = 1.0,
        worlds: npt.ArrayLike | None = None,
        world_period: Period | None = None,
        holds: tuple[float, ...] = HOLDS,
        patience: float = 0.01,
        detours: tuple[float, ...] = DETOURS,
        observation_delay: float = 0.0,
        observation_noise: float = 0.0,
        threads: int | None = None,
        stuck_after: float = 10.0,
        sight: Sight | None = None,
        guided: bool | None = None,
    ) -> None:
        self.members = members_of(method, shapes, limits, robots, names, margin, priority, worlds)
        self.obstacles = obstacles if isinstance(obstacles, ObstacleTable) else ObstacleTable(obstacles)
        self.period, self.horizon = duration(period, "period"), duration(horizon, "horizon")
        within_horizon(self.period, self.horizon)
        self.holds, self.detours = checked_holds(holds), checked_detours(detours)
        self.patience = not_negative(patience, "patience")
        delay, noise = not_negative(observation_delay, "observation_delay"), observation_noise
        self.threads = kernels.threads() if threads is None else whole(threads, "threads", 1)
        n, dimensions = len(self.members.shapes), {each.dimension for each in (*self.members.shapes, *self.obstacles)}
        if len(dimensions) != 1:
            found = sorted(dimensions)
            raise InvalidInput(f"shapes: expected those of robots and obstacles in one dimension, found {found}")
        self.dimension, self.skeletons = dimensions.pop(), Skeletons(self.members.shapes)
        self.policies = self._policies()
        self.table, self.texts = self._tables(delay, not_negative(noise, "observation_noise"))
        self._bounds = bounds_of(self.members.limits, [State(np.zeros(self.dimension), np.zeros(self.dimension))] * n)
        self._turning = any(each.bounds for each in self.members.limits)
        self.targets, _ = target_paths([], 0.0, 1.0)
        # The response of each robot whose manoeuvre is not in the tables.
        self.other_texts, self._steps, self._last = [""] * n, 0, -np.inf
        self._known = np.zeros(n, np.bool_)
        self.headings: Array | None = None
        self.progress: list[float | None] = [None] * n
        self.stuck_after = positive(stuck_after, "stuck_after")
        self._approaches, self._paths = Approaches(n, self.dimension), tuple[PathGoal, ...]()
        self.images = None if world_period is None else Images(self, world_period)
        self.observers = [] if sight is None else observers_of(self, sight)
        self.guidance, self._targets_only = guidance_of(self, guided), bool(guided)

    def __repr__(self) -> str:
        methods = ", ".join(policy.method.name for policy in self.policies)
        return f"<{type(self).__name__} by {methods}, robots: {len(self.members.shapes)}>"

    def _policies(self) -> list[Policy]:
        rows: dict[Method, list[int]] = {}
        for k, method in enumerate(self.members.methods):
            rows.setdefault(method, []).append(k)
        publishes = np.array([method.shared for method in self.members.methods])
        return [Policy(method, np.array(some), publishes, self.horizon) for method, some in rows.items()]

    def _tables(self, delay: float, noise: float) -> tuple[RobotTable, list[str]]:
        """The table of robots, and the responses as text."""
        robots, distinct = self.members, dict[tuple[int, Limits], int]()
        n, policy_of = len(robots.limits), np.empty(len(robots.limits), np.int64)
        for p, policy in enumerate(self.policies):
            policy_of[policy.rows] = p
        kind = [distinct.setdefault(each, len(distinct)) for each in zip(policy_of.tolist(), robots.limits)]
        kinds = tuple(self.policies[p].method.responses(limits, self.period, self.holds) for p, limits in distinct)
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
        each["kind"], each["skeleton"], each["rounding"] = kind, self.skeletons.kind, self.skeletons.rounding
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
        return table, [repr(response) for each in kinds for response in each]

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

    def follow(self, paths: Mapping[int, PathGoal], window: ObstacleWindow) -> None:
        """Give the robots with paths, by row, the targets and maximum speeds of their next step on them."""
        each, d = self.table.each, self.dimension
        for k, path in paths.items():
            limits, shape = self.members.limits[k], self.members.shapes[k]
            step = path.step(
                each["position"][k, :d],
                self.progress[k],
                limits.max_speed,
                PATH_BRAKING * limits.braking,
                self.period,
                shape.bounding_radius,
                partial(window.covered, robot=shape, margin=float(self.members.margins[k])),
            )
            self.progress[k], each["max_speed"][k], each["final"][k] = step.progress, step.max_speed, step.final
            each["target"][k, :d] = step.goal.position(0.0)
            each["tolerance"][k], each["stop"][k] = step.goal.tolerance, step.goal.stop

    def settings(self, policy: Policy, now: float, period: float | None = None) -> DecisionSettings:
        """The settings of the decisions of a policy at `now` [s], until the next ones after `period` [s]."""
        next_after = self.period if period is None else period
        return policy.settings(now, next_after, self.patience, self.detours, self.table, self.dimension)

    def by_policy(self, order: Indices) -> Iterator[tuple[Policy, Indices]]:
        """The robots in `order` that decide by each policy.

        Those that decide one after the other do so by falling priority.
        """
        for policy in self.policies:
            some = order[np.isin(order, policy.rows)] if len(self.policies) > 1 else order
            if policy.method.shared:
                some = some[np.argsort(-self.table.each["priority"][some], kind="stable")]
            if len(some):
                yield policy, some

    def observe(self, policy: Policy, now: float, states: Array | None = None, times: Array | None = None) -> None:
        """Predict all robots as the robots of a policy do, see `Policy.observe`."""
        policy.observe(self.table, self.dimension, now, states, times)

    def window(self, policy: Policy, obstacles: Obstacles, now: float) -> ObstacleWindow:
        """The obstacles as the robots of a policy predict them; in a periodic world, for the cell about the origin."""
        forecast = policy.method.forecast
        if self.images is not None:
            return self.images.window(self.table, obstacles, forecast, now)
        return ObstacleWindow.predicted(obstacles, forecast, now, self.horizon)

    def grown_bodies(self, window: ObstacleWindow) -> list[GrownBodies]:
        """Passive obstacles on predicted trajectories and the robots, grown by each kind of skeleton."""
        kinds, detours = range(len(self.skeletons.shapes)), bool(self.detours)
        return [self.skeletons.grown_bodies(k, window, detours=detours) for k in kinds]

    def decide(
        self, order: Indices, settings: DecisionSettings, bodies: list[GrownBodies], obstacles: Obstacles
    ) -> dict[int, Outcome]:
        """Commit the robots (rows) in `order`, of one policy, to new manoeuvres; their outcomes by row.

        The table holds the others as observed. With shared manoeuvres each robot avoids the decisions of those before
        it. Where the compiled policy has no decision, a `Navigator` among the `obstacles` falls back.
        """
        if self._turning:
            states = [self._state(k) for k in range(len(self.members.limits))]
            self._bounds = bounds_of(self.members.limits, states)
        with nullcontext() if self.images is None else self.images.around(self, order):
            fallen = self._decide_together(order, settings, bodies, obstacles)
        found = self.table.each["outcome"].tolist()
        return {k: fallen[k] if k in fallen else OUTCOMES[found[k]] for k in order.tolist()}

    def _state(self, k: int) -> State:
        """The state of the robot in row k."""
        each, d, heading = self.table.each, self.dimension, None if self.headings is None else float(self.headings[k])
        return State(each["position"][k, :d], each["velocity"][k, :d], each["acceleration"][k, :d], heading)

    def _decide_together(
        self, order: Indices, settings: DecisionSettings, bodies: list[GrownBodies], obstacles: Obstacles
    ) -> dict[int, Outcome]:
        """The outcomes of the robots in `order` that fell back; the others are in the table."""
        decide_all, fallen = one_by_one if settings.shared else at_once, dict[int, Outcome]()
        for kind, own in enumerate(bodies):
            stop_observed(kind, self.table, own, settings)
        for some in of_one_kind(order, self.table.each["skeleton"], settings.shared):
            own = bodies[self.table.each["skeleton"][some[0]]]
            parts = self.responses, self._bounds, self.targets, settings, NO_OBJECTIVES
            tables = DecisionTables(self.table, own, *parts)
            fall_back = partial(self.fall_back, obstacles=obstacles, now=settings.now)
            fallen |= decide_all(some, tables, fall_back, self.threads)
        return fallen

    def fall_back(self, k: int, obstacles: Obstacles, now: float) -> Outcome:
        """Commit the robot in row k to the decision of a navigator among `obstacles` and the other robots."""
        table, each, d = self.table, self.table.each, self.dimension
        number, method, world = each["number"], self.members.methods[k], int(each["world"][k])
        state = self._state(k)
        passive = in_world(obstacles, world)
        if self.images is not None:
            passive = [*self.images.met(table, k, passive, method.forecast, now, d)]
        reach = reaches(each, self.horizon)
        away = np.linalg.norm(each["position"] - each["position"][k], axis=1)
        met = each["present"] & (each["world"] == world) & (away <= reach + reach[k] + each["margin_among"][k])
        others = []
        for j in np.flatnonzero(met):
            if number[j] != k:
                path = observed_path(table, int(j), k, d)
                # A path that lasts beyond the horizon is not continued, which would take longer than its pieces.
                lasts = path.span[1] > now + self.horizon
                shape = self.members.shapes[number[j]]
                others.append(Obstacle(shape, path, after_end="leaves" if lasts else "unknown"))
        arrives = each["objective"][k] == ARRIVE
        position = each["target"][k, :d] if arrives else state.position + self.horizon * each["wanted"][k, :d]
        goal = Goal(Stationary(position), float(max(each["tolerance"][k], 1e-9)), bool(each["stop"][k]))
        navigator = Navigator(
            method,
            self.members.shapes[k],
            self.members.limits[k],
            period=self.period,
            horizon=self.horizon,
            margin=float(each["margin_among"][k]),
            holds=self.holds,
            patience=self.patience,
            detours=self.detours,
        )
        decision = navigator.fall_back(state, [*passive, *others], goal, now=now)
        self.commit(k, decision.manoeuvre, now)
        each["outcome"][k] = FALL_BACK
        return decision.outcome

    def commit(self, k: int, manoeuvre: Manoeuvre, now: float) -> None:
        """Commit the robot in row k to a manoeuvre that is not in the tables."""
        table, d = self.table, self.dimension
        path = manoeuvre.path(now, now + self.span)
        commit_to(table, k, path)
        if isinstance(manoeuvre.response, AccelerateThenBrake):
            table.committed.times[k, len(path.points) :] = now + REST_DURATION
        if self.members.methods[k].shared:
            publish(table, k)
        table.each["response"][k], self.other_texts[k] = -1, repr(manoeuvre.response)
        table.each["settled"][k] = manoeuvre.settled_time(self.period, self.horizon)
        table.each["resting"][k] = False
        table.each["control"][k, :d] = manoeuvre.control

    def begin(self, k: int, state: State, now: float) -> None:
        """Commit the robot in row k to its first manoeuvre."""
        self.commit(k, first_manoeuvre(state, self.members.limits[k], self.period, now), now)
        # A shared manoeuvre commits a robot from the start; an observed robot is free to change its first one.
        if not self.members.methods[k].shared:
            self.table.each["settled"][k] = np.inf

    def committed_responses(self) -> tuple[str, ...]:
        """The responses of the committed manoeuvres, as text."""
        rows = self.table.each["response"].tolist()
        return tuple(self.texts[r] if r >= 0 else other for r, other in zip(rows, self.other_texts, strict=True))

    def planned(self, t: float) -> tuple[Array, Array]:
        """Velocities (n, 3) [m/s] and positions (n, 3) [m] at time t [s] on the committed paths."""
        return states_on_paths(self.table.committed, t)
