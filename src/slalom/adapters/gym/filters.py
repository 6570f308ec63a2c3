"""Nearest certified accelerations of robots, step by step: of one in each of many worlds, and of a fleet."""

from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from pettingzoo.utils import BaseParallelWrapper

from slalom import kernels
from slalom.adapters.gym.environments import FleetEnv, Observation, Observations, RobotEnv, RobotsEnv
from slalom.adapters.gym.worlds import Worlds
from slalom.base.checks import METHOD, Array, array_of, has, mapping
from slalom.base.errors import InvalidInput
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision import Decision
from slalom.decision.methods import Method, method as method_named
from slalom.decision.navigator import CONTINUING, FALL_BACK, OUTCOMES, Navigator
from slalom.decision.objective import FollowAcceleration
from slalom.decision.policy_tables import PolicyTables, Request
from slalom.decision.tables import commit_to, committed_path, robot_table
from slalom.fleet.rounds import map_in_threads
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import DecisionTables, Paths, RobotTable
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.response import Response
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.sim.scenario import Scenario

INTERVENTION: Final = 1e-6
"""[1] A filter has intervened if it changes an acceleration by more than this, in units of the largest one. Larger:
small changes count as none. Smaller: rounding counts as an intervention."""

WORLDS_PER_THREAD: Final = 8
"""[1] Fewest worlds whose decisions are worth a thread. Smaller: threads take longer to start than their robots to
decide. Larger: fewer cores are used. It changes no decision."""

NO_FILTER = ""
"""`info["filter"]` of a world that begins an episode in this step."""


class Rules(NamedTuple):
    """Settings of a filter; `margin` [m] and `horizon` [s] of None are those of the scenario."""

    method: Method
    margin: float | None
    horizon: float | None

    def navigator(self, scenario: Scenario, period: float, robot: int = 0) -> Navigator:
        """The navigator that filters the actions of a robot. Raises InvalidInput for settings that it refuses."""
        usual = scenario.navigator(self.method, robot)
        return replace(
            usual,
            method=self.method,
            holds=tuple(sorted({period, *usual.holds})),
            patience=0.0,
            margin=usual.margin if self.margin is None else self.margin,
            horizon=usual.horizon if self.horizon is None else self.horizon,
        )


def rules_of(method: Method | str, margin: float | None, horizon: float | None) -> Rules:
    """The settings of a filter. Raises InvalidInput for an unknown method."""
    chosen = method_named(method) if isinstance(method, str) else method
    has(chosen, *METHOD, "method")
    return Rules(chosen, margin, horizon)


class Filtered(NamedTuple):
    """Result of a filter for n robots; 0, false, true and NO_FILTER for those that did not act."""

    wanted: Array  # (n, d) [m/s^2]
    applied: Array  # (n, d) [m/s^2]
    intervened: Flags  # (n,)
    certified: Flags  # (n,)
    filter: np.ndarray  # (n,) names of outcomes


def differs(applied: Array, wanted: Array, largest: Array) -> Flags:
    """Whether a filter has intervened: (n,); the `largest` accelerations (n,) [m/s^2]."""
    return np.asarray(np.linalg.norm(applied - wanted, axis=-1) > INTERVENTION * largest)


# One robot in each of many worlds: all decisions of a step in one call of a kernel, in any number of threads.


class _Scene(NamedTuple):
    """What the worlds of one scenario have in common."""

    scenario: Scenario
    navigator: Navigator
    policy: PolicyTables
    obstacles: ObstacleTable
    compiled: bool  # whether the kernel decides; if not, the navigator alone


class Certifiers:
    """The robots of n worlds whose accelerations become the nearest certified ones, each during one episode.

    A robot for which the kernel finds no decision falls back as `Navigator.decide` does.

    Raises:
        InvalidInput: settings that no navigator accepts; a method that does not set the acceleration at once.
    """

    def __init__(self, worlds: Worlds, rules: Rules) -> None:
        self._worlds, self._rules = worlds, rules
        n, d = len(worlds.scenarios), worlds.dimension
        self._scenes: dict[int, _Scene] = {}
        self._of: list[_Scene] = []
        self._rows, self._pieces = robot_table(0, 1, 1), 0
        self._tables: list[DecisionTables | None] = [None] * n
        self._memory, self._places = np.empty((n, 0), np.uint8), np.zeros(n, np.int64)
        # When [s] the tables of a world must be made anew; whether the clock of its pieces is that of the world.
        self._until, self._absolute = np.full(n, -np.inf), np.zeros(n, np.bool_)
        self._start = np.zeros(n)
        self._since, self._state = np.full(n, np.nan), np.zeros((n, 2, d))
        # Of the navigator alone: its last manoeuvre, while the robot is committed to it, and its decision just now.
        self._given: list[Manoeuvre | None] = [None] * n
        self._decided: dict[int, Decision] = {}
        self._of = [self._scene(w) for w in range(n)]
        for w in range(n):
            self.begin(w)

    def begin(self, w: int) -> None:
        """Begin an episode in world w."""
        scene = self._of[w] = self._scene(w)
        self._widen(scene.policy.pieces)
        self._start[w] = scene.scenario.start
        self._until[w], self._since[w] = -np.inf, np.nan
        self._given[w] = self._tables[w] = None
        self._decided.pop(w, None)
        self._rows.each["settled"][w] = np.inf
        self._rows.committed.times[w], self._rows.committed.points[w] = 0.0, 0.0

    def _scene(self, w: int) -> _Scene:
        scenario = self._worlds.scenarios[w]
        found = self._scenes.get(id(scenario))
        if found is None or found.scenario is not scenario:
            # Scenarios that no world has are forgotten.
            used = {id(each) for each in self._worlds.scenarios}
            self._scenes = {k: each for k, each in self._scenes.items() if k in used}
            navigator = self._rules.navigator(scenario, self._worlds.period)
            table = ObstacleTable(scenario.obstacles)
            compiled = not (navigator.turning or table.is_passive or table.has_futures)
            found = _Scene(scenario, navigator, PolicyTables(navigator, among=False), table, compiled)
            self._scenes[id(scenario)] = found
        return found

    def _widen(self, pieces: int) -> None:
        """Let committed paths have that many pieces."""
        if pieces <= self._pieces:
            return
        old, had = self._rows, self._pieces
        n = len(self._of)
        self._rows, self._pieces = robot_table(n, pieces, 1), pieces
        if had:
            self._rows.each[:] = old.each
            self._rows.committed.times[:] = old.committed.times[:, -1:]
            self._rows.committed.times[:, : had + 1] = old.committed.times
            self._rows.committed.points[:, :had] = old.committed.points
        self._until[:] = -np.inf

    def certified(self, wanted: Array, some: Flags) -> Filtered:
        """The accelerations nearest to the wanted ones (n, d) [m/s^2] that are collision-free up to the horizon.

        Of the robots in `some` worlds (n,); the others have 0.
        """
        worlds, d = self._worlds, self._worlds.dimension
        now = self._start + worlds.steps * worlds.period
        wanted = np.where(some[:, None], wanted, 0.0)
        applied, names = np.zeros_like(wanted), np.full(len(wanted), NO_FILTER, dtype="U16")
        safe, rows = np.ones(len(wanted), np.bool_), np.flatnonzero(some)
        for w in rows[now[rows] >= self._until[rows]].tolist():
            if self._of[w].compiled:
                self._refresh(w, float(now[w]))
        each = self._rows.each
        each["position"][rows, :d] = each["target"][rows, :d] = worlds.position[rows, 0]
        each["velocity"][rows, :d], each["wanted"][rows, :d] = worlds.velocity[rows, 0], wanted[rows]
        each["resting"][rows] = False
        compiled = rows[np.array([self._of[w].compiled for w in rows.tolist()], np.bool_)]
        before = {w: self.decision(w) for w in rows.tolist() if not self._of[w].compiled}
        self._decided = {}
        self._decide(compiled, now, applied)
        outcomes = each["outcome"][compiled]
        begun = compiled[~np.isin(outcomes, CONTINUED)]
        self._since[begun] = now[begun]
        self._state[begun, 0], self._state[begun, 1] = worlds.position[begun, 0], worlds.velocity[begun, 0]
        for w in begun.tolist():
            self._given[w] = None
        names[compiled], safe[compiled] = OUTCOME_NAMES[outcomes], OUTCOME_SAFE[outcomes]
        alone = np.concatenate([np.setdiff1d(rows, compiled), compiled[outcomes == FALL_BACK]])
        for w in alone.tolist():
            decision = self._alone(w, wanted[w], float(now[w]), before.get(w) or self.decision(w))
            applied[w] = decision.manoeuvre.mean_acceleration(now[w], worlds.period)
            names[w], safe[w] = decision.outcome.name, decision.outcome.safe
        return Filtered(wanted, applied, differs(applied, wanted, worlds.robots.max_acceleration[:, 0]), safe, names)

    def decision(self, w: int) -> Decision | None:
        """The last decision in world w; None before the first one."""
        if w in self._decided or np.isnan(self._since[w]):
            return self._decided.get(w)
        scene, since = self._of[w], float(self._since[w])
        row = self._rows.each[w : w + 1]
        d, state = self._worlds.dimension, State(*self._state[w].copy())
        response = scene.policy.responses[int(row["response"][0])]
        given = self._given[w] or Manoeuvre(response, state, row["control"][0, :d].copy(), since)
        return Decision(
            given,
            OUTCOMES[int(row["outcome"][0])],
            row["preferred"][0, :d].copy(),
            partial(_blocked, scene, given.response, state, since),
            path=committed_path(self._rows, w, d),
            work=1e-6 * float(row["work"][0]),
        )

    def _decide(self, some: Indices, now: Array, applied: Array) -> None:
        """Decide in `some` worlds (m,) by the kernel; accelerations (n, d) [m/s^2] go into `applied`."""
        begin = np.where(self._absolute, now, 0.0)
        # Tables with corners of hulls are of another type.
        with_corners = np.array([bool(self._tables[w].bodies.corners) for w in some.tolist()], np.bool_)
        # Worlds of one scenario follow each other: their obstacles stay in the processor's cache.
        scenes = np.array([id(self._of[w]) for w in some.tolist()], np.int64)
        order = np.lexsort((now[some], scenes))
        some, with_corners = some[order], with_corners[order]
        for part in (some[with_corners], some[~with_corners]):
            if len(part):
                decide = partial(self._decide_rows, now, begin, self._tables[part[0]], applied)
                map_in_threads(decide, part, kernels.threads(), WORLDS_PER_THREAD)

    def _decide_rows(self, now: Array, begin: Array, like: Any, applied: Array, rows: Indices) -> None:
        kernels.decide_worlds(rows, self._places, now, begin, like, applied)

    def _refresh(self, w: int, now: float) -> None:
        """Make the tables of world w, which serve from now [s] on as long as they do not change."""
        scene, worlds = self._of[w], self._worlds
        navigator, state = scene.navigator, worlds.state(w)
        here = slice(w, w + 1)
        committed, observed = (Paths(p.times[here], p.points[here]) for p in self._rows[1:])
        own = scene.policy.filled(RobotTable(self._rows.each[here], committed, observed))
        robot = replace(navigator, objective=FollowAcceleration(np.zeros(worlds.dimension)))
        window = navigator.predict(scene.obstacles, state, now)
        goal = Goal(Stationary(state.position))
        request = Request(robot, (scene.obstacles,), None, state, goal, None, now, None, np.inf)
        own.own.max_speed[0], own.own.final[0] = navigator.limits.max_speed, True
        tables, _ = scene.policy.decision(own, window, request)
        self._tables[w] = tables
        size = kernels.keep_tables(0, tables)
        if size > self._memory.shape[1]:
            self._memory = np.empty((len(self._of), -(-size // 16) * 16), np.uint8)
            self._places = self._memory.ctypes.data + self._memory.shape[1] * np.arange(len(self._of))
            for k, kept in enumerate(self._tables):
                if kept is not None:
                    kernels.keep_tables(int(self._places[k]), kept)
        kernels.keep_tables(int(self._places[w]), tables)
        table = window.only_table
        self._absolute[w] = table is not None
        lasting = table is not None and table is scene.obstacles and not navigator.limits.bounds
        lasting = lasting and bool((window.until == navigator.horizon).all()) and navigator.horizons is None
        lasting = lasting or (not len(scene.obstacles) and not navigator.limits.bounds)
        self._until[w] = scene.obstacles.serves_until(now, navigator.horizon) if lasting else -np.inf

    def _alone(self, w: int, wanted: Array, now: float, previous: Decision | None) -> Decision:
        """The decision of the navigator in world w, which its row is committed to."""
        scene = self._of[w]
        navigator, objective = scene.navigator, FollowAcceleration(wanted)
        state = self._worlds.state(w)
        decision = navigator.decide(state, scene.obstacles, now=now, previous=previous, objective=objective)
        path = decision.path
        if path is None:
            path = decision.manoeuvre.path(decision.manoeuvre.start, now + 2.0 * navigator.horizon)
        self._widen(len(path.points))
        commit_to(self._rows, w, path)
        self._rows.each["settled"][w] = decision.manoeuvre.settled_time(navigator.period, navigator.horizon)
        self._decided[w], self._given[w] = decision, decision.manoeuvre
        self._since[w] = now
        return decision


def _blocked(scene: _Scene, response: Response, state: State, now: float) -> ControlObstacle:
    """The control obstacle of a decision that the kernel made."""
    navigator = scene.navigator
    return navigator.control_obstacle(response, navigator.predict(scene.obstacles, state, now), state)


CONTINUED = [OUTCOMES.index(one) for one in CONTINUING]
"""Numbers of the outcomes with which the committed manoeuvre goes on."""
OUTCOME_NAMES = np.array([*(one.name for one in OUTCOMES), NO_FILTER])
OUTCOME_SAFE = np.array([*(one.safe for one in OUTCOMES), False])
"""By number; FALL_BACK is the last one."""


class SafetyFilter(gymnasium.Wrapper[Observation, Array, Observation, Array]):
    """A policy of which each action becomes the nearest acceleration that is collision-free up to the horizon.

    A manoeuvre holds that acceleration and then coasts or stops. A step at which no manoeuvre is safe continues the
    last one, which stays safe up to its horizon as long as the forecasts hold. `info` describes the step:
    `intervened`, whether the applied acceleration differs from that of the policy; `wanted` and `applied` (d,) [m/s^2];
    `filter`, the outcome of the decision; and `certified`, whether it is safe.

    Attributes:
        decision: the decision of the last step; None before the first one.

    Args:
        env: a `RobotEnv`, possibly in other wrappers. method: a row of the table of methods or its name. With nao the
            future of obstacles is given, with nao@observed it is predicted from observations.
        margin: [m] to keep from obstacles; None: that of the scenario. horizon: [s]; None: that of the scenario.

    Raises:
        InvalidInput: another environment; a method that does not set the acceleration at once, for example vo.
    """

    def __init__(
        self,
        env: gymnasium.Env[Observation, Array],
        method: Method | str = "nao",
        *,
        margin: float | None = None,
        horizon: float | None = None,
    ) -> None:
        inner = getattr(env, "unwrapped", env)
        if not isinstance(inner, RobotEnv):
            raise InvalidInput(f"env: expected a RobotEnv, possibly wrapped, found {inner}")
        super().__init__(env)
        self._robot = inner
        self._certifiers = Certifiers(inner.worlds, rules_of(method, margin, horizon))

    @property
    def decision(self) -> Decision | None:
        return self._certifiers.decision(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        found = super().reset(seed=seed, options=options)
        self._certifiers.begin(0)
        return found

    def step(self, action: Array) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Follow the nearest certified action for one period."""
        worlds = self._robot.worlds
        given = array_of(action, "action", worlds.action_shape)
        wanted = worlds.accelerations(given[None, None])[0, 0]
        made = self._certifiers.certified(wanted[None], np.ones(1, np.bool_))
        worlds.certified = made.applied[:, None]
        observation, reward, ended, late, info = self.env.step(action)
        about = {"intervened": bool(made.intervened[0]), "wanted": made.wanted[0], "applied": made.applied[0]}
        named = {"filter": str(made.filter[0]), "certified": bool(made.certified[0])}
        return observation, reward, ended, late, {**info, **about, **named}


class VectorSafetyFilter(VectorWrapper):
    """`SafetyFilter` for all robots of a `RobotsEnv`, with its arguments.

    Each robot does what it does in a `SafetyFilter` of its own, to the bit. `info` holds the same entries as arrays:
    `intervened`, `certified` and `filter` (n,), `wanted` and `applied` (n, d) [m/s^2]. In a world that begins an
    episode in this step nothing is applied: `intervened` is false, `certified` is true and `filter` is empty.

    Raises:
        InvalidInput: another environment; a method that does not set the acceleration at once, for example vo.
    """

    def __init__(
        self,
        env: VectorEnv[Any, Any, Any],
        method: Method | str = "nao",
        *,
        margin: float | None = None,
        horizon: float | None = None,
    ) -> None:
        inner = getattr(env, "unwrapped", env)
        if not isinstance(inner, RobotsEnv):
            raise InvalidInput(f"env: expected a RobotsEnv, possibly wrapped, found {inner}")
        super().__init__(env)
        self._robots = inner
        self._certifiers = Certifiers(inner.worlds, rules_of(method, margin, horizon))

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode in every world."""
        found = super().reset(seed=seed, options=options)
        for w in range(self._robots.num_envs):
            self._certifiers.begin(w)
        return found

    def step(self, actions: Array) -> tuple[Observations, Array, Flags, Flags, dict[str, Any]]:
        """Follow the nearest certified actions for one period."""
        worlds = self._robots.worlds
        given = array_of(actions, "actions", (self._robots.num_envs, *worlds.action_shape))
        wanted = worlds.accelerations(given[:, None])[:, 0]
        running = worlds.acting[:, 0].copy()
        made = self._certifiers.certified(wanted, running)
        worlds.certified = made.applied[:, None]
        observations, rewards, ended, late, info = self.env.step(actions)
        for w in np.flatnonzero(~running).tolist():
            self._certifiers.begin(w)
        about = made._asdict()
        return observations, rewards, ended, late, {**info, **about, **{f"_{name}": running for name in about}}


class FleetSafetyFilter(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo has no types
    """`SafetyFilter` for all agents of a `FleetEnv`, with its arguments; `infos` have the same entries.

    Each robot observes the others and assumes that they do their part of the avoidance, as its method says. One that
    has stopped at its goal does none. Certified is what is safe as long as that holds: with `nao` the others accelerate
    no more than the robot itself, see `Navigator.decide`.

    Raises:
        InvalidInput: another environment; a method that does not set the acceleration at once, for example vo.
    """

    def __init__(
        self, env: Any, method: Method | str = "nao", *, margin: float | None = None, horizon: float | None = None
    ) -> None:
        inner = getattr(env, "unwrapped", env)
        if not isinstance(inner, FleetEnv):
            raise InvalidInput(f"env: expected a FleetEnv, possibly wrapped, found {inner}")
        super().__init__(env)
        self._fleet, self._rules = inner, rules_of(method, margin, horizon)
        self._begin()

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode."""
        found = super().reset(seed=seed, options=options)
        self._begin()
        return found

    def step(self, actions: Any) -> Any:
        """Follow the nearest certified actions for one period."""
        worlds, agents = self._fleet.worlds, list(self._fleet.agents)
        mapping(actions, "actions by names of agents", "actions")
        given = np.zeros((*worlds.acting.shape, *worlds.action_shape))
        rows = {name: self._fleet.possible_agents.index(name) for name in agents}
        for name, r in rows.items():
            if name in actions:
                given[0, r] = array_of(actions[name], f"actions[{name!r}]", worlds.action_shape)
        wanted = worlds.accelerations(given)[0]
        applied = np.zeros_like(wanted)
        for r in rows.values():
            applied[r] = self._certified(r, wanted[r])
        changed = differs(applied, wanted, worlds.robots.max_acceleration[0])
        worlds.certified = applied[None]
        observations, rewards, ended, late, infos = self.env.step(actions)
        for name, r in rows.items():
            outcome = self._decisions[r].outcome
            infos[name] |= {"intervened": bool(changed[r]), "wanted": wanted[r], "applied": applied[r]}
            infos[name] |= {"filter": outcome.name, "certified": outcome.safe}
        return observations, rewards, ended, late, infos

    def _begin(self) -> None:
        worlds = self._fleet.worlds
        scenario = worlds.scenarios[0]
        robots = range(len(scenario.robots))
        self._navigators = [self._rules.navigator(scenario, worlds.period, r) for r in robots]
        self._obstacles = ObstacleTable(scenario.obstacles)
        self._decisions: dict[int, Decision] = {}

    def _certified(self, r: int, wanted: Array) -> Array:
        """The acceleration (d,) [m/s^2] nearest to the wanted one that robot r may have."""
        worlds, now = self._fleet.worlds, self._fleet.worlds.now()
        others = np.flatnonzero(worlds.there[0])
        others = others[others != r]
        shares = np.where(worlds.acting[0, others], 0.5, 0.0)
        radii = worlds.robots.radius[0, others]
        tracks = Tracks(worlds.position[0, others], worlds.velocity[0, others], radii, now, shares=shares)
        self._decisions[r] = self._navigators[r].decide(
            worlds.state(0, r),
            self._obstacles,
            now=now,
            previous=self._decisions.get(r),
            objective=FollowAcceleration(wanted),
            robots=tracks if len(others) else None,
        )
        return self._decisions[r].manoeuvre.mean_acceleration(now, worlds.period)
