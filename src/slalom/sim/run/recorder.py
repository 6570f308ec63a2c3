"""Recordings of robots in a loop of the caller."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Any, Final, NamedTuple, overload

import numpy as np

from slalom.base.checks import Array, has, listing, number
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import TIME
from slalom.decision import Decision
from slalom.decision.navigator import Navigator
from slalom.decision.settings import NUMBERS
from slalom.fleet.fleet import Fleet, FleetDecision
from slalom.fleet.guidance import ARRIVAL_LOST
from slalom.kernels.arrays import Indices
from slalom.lookahead.navigator import LookAhead
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Disc, Shape, round_shape
from slalom.model.state import State
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import each_of
from slalom.sim.measure.recording import OBSERVED, Recording, appearances, at_even_times
from slalom.sim.measure.responses import RecordedResponses
from slalom.vehicle.decision import VehicleDecision
from slalom.vehicle.driver import Drive, Driver
from slalom.vehicle.navigator import VehicleNavigator

GOALS: Final = ("goals", "paths", "tolerances", "stop")
"""Arguments of `Fleet.step` about goals."""


class _Call(NamedTuple):
    """A decision of n robots, as it was noted."""

    now: float
    positions: Array
    velocities: Array
    controls: Array
    responses: Sequence[Any]
    outcomes: Sequence[Any]
    seconds: float
    goals: dict[str, Any]  # as arguments of `Fleet.step`
    progress: Sequence[float | None]  # [m] along paths
    decision: Decision | None = None  # of one robot


class _Wrapped:
    """What a caller uses in place of robots or a world: it has their attributes, which can be set, and is pickled."""

    def __init__(self, robots: Any, obstacles: Sequence[Obstacle] | None, path: Path | None) -> None:
        self._robots, self._path = robots, path
        self._calls, self._obstacles = list[Any](), obstacles

    def __getattr__(self, name: str) -> Any:
        # A copy asks for private ones before it has attributes.
        return object.__getattribute__(self, name) if name.startswith("_") else getattr(self._robots, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):
            object.__setattr__(self, name, value)
        else:
            setattr(self._robots, name, value)

    def __enter__(self) -> Any:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._path is not None and (self._calls or error is None):
            self.recording.save(self._path)


class Recorder(_Wrapped):
    """Robots whose decisions are noted. It has all attributes of the robots, and can be pickled.

    Attributes:
        recording: the steps so far. Each call begins a step. After the last one the robots follow their commands for a
            period. Accelerations are the changes of velocity over the steps. Where calls are not evenly spaced, the
            states are those at even times in between.

            A target that changes is a goal in motion. A robot has arrived when it reaches the last one for good. One
            that is taken out of the scene has arrived then. One without a goal does not arrive, and its goal is where
            it ends.

            A vehicle is the disc about the middle of its axle that holds its body at every heading. So its clearance is
            a lower bound, and a collision need not be one. Its motion is as observed: its reasons are in `decision_at`.
    """

    _calls: list[_Call]

    def __init__(self, robots: Any, obstacles: Sequence[Obstacle] | None, path: Path | None) -> None:
        super().__init__(robots, obstacles, path)
        self._seen = dict[int, Any]()
        self._end: tuple[Array, Array] | None = None

    def step(self, now: float, positions: Any, velocities: Any, targets: Any = None, **further: Any) -> FleetDecision:
        """Decide as `Fleet.step`."""
        before, fleet = perf_counter(), self._robots
        decided: FleetDecision = fleet.step(now, positions, velocities, targets, **further)
        seconds = perf_counter() - before
        goals: dict[str, Any] = {name: further[name] for name in GOALS if name in further}
        goals["targets"] = None if targets is None else np.array(targets, dtype=np.float64)
        call = _Call(
            float(now),
            np.array(positions, dtype=np.float64),
            np.array(velocities, dtype=np.float64),
            fleet.table.each["control"][:, : fleet.dimension].copy(),
            fleet.committed_responses(),
            decided.outcomes,
            seconds,
            goals,
            fleet.destinations.progress.copy(),
        )
        self._note(call, decided.positions, decided.velocities)
        return decided

    def decide(self, state: State, obstacles: Any, goal: Goal | None = None, **further: Any) -> Any:
        """Decide as `Navigator.decide` and `LookAhead.decide`."""
        before = perf_counter()
        decision = self._robots.decide(state, obstacles, goal, **further)
        self._note_one(decision, perf_counter() - before, goal)
        return decision

    def command(self, now: float, obstacles: Any = (), **further: Any) -> Drive:
        """Command as `Driver.command`; there is no step before the first state."""
        before = perf_counter()
        drive: Drive = self._robots.command(now, obstacles, **further)
        if drive.decision is not None:
            self._note_one(drive.decision, perf_counter() - before, self._robots.goal)
        return drive

    def _note_one(self, decision: Decision, seconds: float, goal: Goal | None) -> None:
        made, manoeuvre = decision.inputs, decision.manoeuvre
        assert made is not None
        for each in (*made.obstacles, *([] if made.robots is None else [made.robots])):
            self._seen[id(each)] = each
        period = _navigator(self._robots).period
        state: Any = made.state
        response: Any = manoeuvre.response
        if isinstance(decision, VehicleDecision):
            given: Any = decision.record
            now, state = given.now, decision.pose_at(given.now) if given.delay else given.pose
            end: Any = decision.pose_at(now + period)
            control, response = np.array(decision.command), OBSERVED
        else:
            now, control = made.now, manoeuvre.control
            end = State(manoeuvre.position(now + period), manoeuvre.velocity(now + period))
        self._note(
            _Call(
                now,
                state.position[None],
                state.velocity[None],
                control[None],
                (response,),
                (decision.outcome,),
                seconds,
                {"goals": [goal]},
                [decision.progress],
                decision,
            ),
            end.position[None],
            end.velocity[None],
        )

    def decision_at(self, t: float) -> Decision:
        """The decision of a robot in force at `t` [s], as it was made: for `slalom.view.decision` and `Decision.dump`.

        Raises:
            InvalidInput: a time before the first decision; a fleet, whose robots decide together.
        """
        t = number(t, "t")
        found: Decision | None = next((call.decision for call in reversed(self._calls) if call.now <= t + TIME), None)
        if found is None:
            raise InvalidInput(f"t: expected a time from the first decision of one robot on, found {t:g}")
        return found

    def _note(self, call: _Call, positions: Array, velocities: Array) -> None:
        if self._calls and self._calls[-1].now == call.now:
            self._calls.pop()
        self._calls.append(call)
        self._end = positions, velocities

    @property
    def recording(self) -> Recording:
        if self._end is None:
            raise InvalidInput("recording: expected at least one decision, found none")
        calls, navigator = self._calls, _navigator(self._robots)
        fleet = self._robots if isinstance(self._robots, Fleet) else None
        wheels: Any = navigator.vehicle if isinstance(navigator, VehicleNavigator) else None
        times = np.array([*(call.now for call in calls), calls[-1].now + navigator.period])
        positions = np.array([*(call.positions for call in calls), self._end[0]])
        velocities = np.array([*(call.velocities for call in calls), self._end[1]])
        times, rows, positions, velocities = at_even_times(times, positions, velocities)
        dt, n = float(times[1] - times[0]), positions.shape[1]
        made = [calls[k] for k in rows]
        outcomes = [tuple("" if one is None else one.name for one in call.outcomes) for call in made]
        there = np.array(outcomes) != ""
        appears, last = appearances(there, times)
        goals, since = _goals([call.goals for call in made], times, n)
        methods = fleet.members.methods if fleet else [navigator.method]
        found = Recording(
            scenario="own loop",
            method=OBSERVED if wheels else "+".join(dict.fromkeys(method.name for method in methods)),
            seed=0,
            dt=dt,
            parameters={},
            times=times,
            positions=positions,
            velocities=velocities,
            accelerations=np.diff(velocities, axis=0) / dt,
            controls=np.array([call.controls for call in made]),
            responses=RecordedResponses.of([tuple(call.responses) for call in made], n),
            outcomes=tuple(outcomes),
            decision_times=there * np.array([[call.seconds] for call in made]) / np.maximum(1, there.sum(1))[:, None],
            shapes=tuple(fleet.members.shapes if fleet else [_body(navigator)]),
            limits=tuple(fleet.members.limits if fleet else [navigator.limits or wheels.limits]),
            goals=tuple(Goal(Stationary(end)) if goal is None else goal for goal, end in zip(goals, positions[-1])),
            arrived=np.full(n, np.inf),
            obstacles=tuple(one.of_scenario() for one in self._given()),
            foresight=methods[0].foresight_among if fleet else methods[0].foresight,
            settings={
                "dt": dt,
                "replan": 0.0,
                "guided": float(fleet is None or fleet.guidance is not None),
                **{name: getattr(navigator, name) for name in NUMBERS},
            },
            holds=tuple(navigator.holds),
            names=tuple(fleet.members.names) if fleet else (),
            appears=appears,
        )
        progress = [[call.progress[k] for call in made] for k in range(n)]
        arrived = [_arrival(found, k, since[k], progress[k]) if goals[k] else np.inf for k in range(n)]
        return _with_ends(found, arrived, last)

    def _given(self) -> list[Obstacle]:
        """The obstacles that were given, else those among which was decided; tracks of one id are one obstacle."""
        if self._obstacles is not None:
            return list(self._obstacles)
        if isinstance(self._robots, Fleet):
            return list(self._robots.obstacles.given)
        known = [one for one in self._seen.values() if not isinstance(one, Tracks)]
        found, sightings = dict.fromkeys(each_of(known)), dict[object, dict[float, tuple[Array, float]]]()
        for tracks in (one for one in self._seen.values() if isinstance(one, Tracks)):
            for name, position, radius in zip(tracks.ids, tracks.positions, tracks.radii.tolist()):
                sightings.setdefault(name, {})[tracks.t] = (position, radius)
        for name, seen in sightings.items():
            if len(seen) > 1:
                times, rows = sorted(seen), [seen[t][0] for t in sorted(seen)]
                shape = round_shape(max(radius for _, radius in seen.values()), len(rows[0]))
                found[Obstacle(shape, Sampled(times, rows), f"track {name}")] = None
        return list(found)


class Episode(_Wrapped):
    """An environment of `slalom.adapters.gym` with one world, perhaps in wrappers, of which each step is noted.

    Attributes:
        recording: the steps since the last `reset`, as observed. A robot that leaves the world has arrived then.
    """

    _calls: list[tuple[float, Array, Array]]

    def reset(self, *args: Any, **further: Any) -> Any:
        """Begin an episode as the environment does."""
        found = self._robots.reset(*args, **further)
        self._calls, self._there = [], np.ones(len(_worlds(self._robots).there[0]), np.bool_)
        self._look()
        return found

    def step(self, *args: Any, **further: Any) -> Any:
        """Follow an action as the environment does."""
        found = self._robots.step(*args, **further)
        self._look()
        return found

    def _look(self) -> None:
        worlds, there = _worlds(self._robots), self._there[:, None]
        self._calls.append((worlds.now(), np.where(there, worlds.position[0], np.nan), worlds.velocity[0].copy()))
        # A robot that leaves is noted where it does.
        self._there = worlds.there[0].copy()

    @property
    def recording(self) -> Recording:
        if len(self._calls) < 2:
            raise InvalidInput("recording: expected an episode with at least one step, found none")
        scene, (times, positions, velocities) = _worlds(self._robots).scenarios[0], map(np.array, zip(*self._calls))
        found = Recording.from_tracks(
            times,
            positions,
            [robot.shape.bounding_radius for robot in scene.robots],
            velocities=velocities,
            walls=scene.obstacles if self._obstacles is None else self._obstacles,
            names=[robot.name for robot in scene.robots],
            name=scene.name,
        )
        last = appearances(np.isfinite(positions[:, :, 0]), times)[1]
        goals, limits = ([getattr(robot, name) for robot in scene.robots] for name in ("goal", "limits"))
        found = replace(found, goals=tuple(goals), limits=tuple(limits))
        arrived = [_arrival(found, k, times[0], [None] * len(times)) for k in range(len(goals))]
        return _with_ends(found, arrived, last - 1)


@overload
def record(
    robots: Fleet | Navigator | LookAhead | VehicleNavigator | Driver,
    *,
    obstacles: Sequence[Obstacle] | None = None,
    path: Path | str | None = None,
) -> Recorder: ...


@overload
def record(robots: Any, *, obstacles: Sequence[Obstacle] | None = None, path: Path | str | None = None) -> Any: ...


def record(robots: Any, *, obstacles: Sequence[Obstacle] | None = None, path: Path | str | None = None) -> Any:
    """Return robots whose decisions in a loop of the caller are noted, see `Recorder`, or a world, see `Episode`.

    Args:
        robots: a Fleet, Navigator, LookAhead, VehicleNavigator or Driver; an environment of `slalom.adapters.gym`.
        obstacles: as they really move, for metrics and figures; None: those of the fleet or the environment, or those
            in the calls, with tracks of one id as one obstacle.
        path: of the file that is written at the end of a `with` block, also after an error.

    Raises:
        InvalidInput: others, whose motion `Recording.from_tracks` takes; an environment of several worlds.
    """
    if obstacles is not None:
        listing(obstacles, "obstacles", "obstacles")
        for k, one in enumerate(obstacles):
            has(one, ("shape", "trajectory", "of_scenario"), "an Obstacle", f"obstacles[{k}]")
    file, worlds = None if path is None else Path(path), _worlds(robots)
    if worlds is not None and len(worlds.scenarios) == 1:
        return Episode(robots, obstacles, file)
    if not isinstance(robots, Fleet) and not isinstance(_navigator(robots), Navigator | VehicleNavigator):
        expected = "a Fleet, Navigator, LookAhead, VehicleNavigator, Driver or environment of one world"
        raise InvalidInput(f"robots: expected {expected} (else Recording.from_tracks), found {robots!r}")
    return Recorder(robots, obstacles, file)


def _worlds(robots: Any) -> Any:
    """The worlds of an environment, perhaps in wrappers; None of anything else."""
    return getattr(getattr(robots, "unwrapped", robots), "worlds", None)


def _body(navigator: Any) -> Shape:
    """The shape of a robot; of a vehicle the disc about the middle of its axle that holds it."""
    if not isinstance(navigator, VehicleNavigator):
        return navigator.robot  # type: ignore[no-any-return]
    return Disc(float(np.linalg.norm(navigator.corners, axis=1).max()) + navigator.rounding)


def _with_ends(found: Recording, arrived: Sequence[float], last: Indices) -> Recording:
    """A recording with times of arrival [s]; robots whose `last` step is not that of the run left after it."""
    left = (last < len(found.accelerations) - 1).tolist()
    ends = [min(t, float(found.times[k + 1])) if gone else t for t, k, gone in zip(arrived, last.tolist(), left)]
    goals = [replace(goal, stop=goal.stop and not gone) for goal, gone in zip(found.goals, left)]
    return replace(found, arrived=np.array(ends), goals=tuple(goals))


def _navigator(robots: Any) -> Any:
    return getattr(robots, "navigator", robots)


def _goals(given: Sequence[dict[str, Any]], times: Array, n: int) -> tuple[list[Goal | None], Array]:
    """The goal of each of n robots over all steps, None without one, and the time (n,) [s] since which it is the last.

    Between two steps a goal at rest that changes moves in the middle fifth of the time.
    """
    by_robot: list[list[tuple[float, Goal]]] = [[] for _ in range(n)]
    goals: Sequence[Goal | None] = ()
    for k, now in enumerate(times[:-1].tolist()):
        if not k or not _equal(given[k - 1], given[k]):
            goals = _goals_of(given[k], n)
        for own, goal in zip(by_robot, goals):
            if goal is not None:
                own.append((now, goal))
    found, since = list[Goal | None](), np.full(n, times[0])
    for k, own in enumerate(by_robot):
        last = own[-1][1] if own else None
        changes = [j for j in range(1, len(own)) if not _same(own[j - 1][1], own[j][1])]
        if changes:
            since[k] = own[changes[-1]][0]
        if last is not None and changes and all(type(goal.trajectory) is Stationary for _, goal in own):
            stamps, points = [own[0][0]], [own[0][1].position(0.0)]
            for j in changes:
                (before, old), (now, new) = own[j - 1 : j + 1]
                stamps += [0.6 * before + 0.4 * now, 0.4 * before + 0.6 * now]
                points += [old.position(0.0), new.position(0.0)]
            if type(last) is Goal:
                last = replace(last, trajectory=Sampled(stamps, points, "linear"))
        found.append(last)
    return found, since


def _equal(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether the goals of two steps are surely the same."""
    return one.keys() == other.keys() and all(
        one[name] is other[name] or (name == "targets" and np.array_equal(one[name], other[name])) for name in one
    )


def _goals_of(given: dict[str, Any], n: int) -> Sequence[Goal | None]:
    """The goals of n robots from the arguments of one step."""
    if given.get("targets") is None:
        return tuple(given.get("goals") or given.get("paths") or (None,) * n)
    tolerances = np.broadcast_to(given.get("tolerances", 0.2), n).tolist()
    stops = np.broadcast_to(given.get("stop", True), n).tolist()
    return [Goal(Stationary(place), *each) for place, *each in zip(given["targets"], tolerances, stops)]


def _same(one: Goal, other: Goal) -> bool:
    """Whether two goals of consecutive steps are one."""
    if one is other or isinstance(one, PathGoal) or isinstance(other, PathGoal):
        return one is other
    before, now = one.trajectory, other.trajectory
    if isinstance(before, Stationary) and isinstance(now, Stationary):
        return np.array_equal(before.position(0.0), now.position(0.0))
    return before is now


def _arrival(run: Recording, robot: int, since: float, progress: Sequence[float | None]) -> float:
    """The time [s] from which a robot is at its goal, first reached at or after `since` [s]; inf if it is not."""
    goal, times = run.goals[robot], run.times
    positions, velocities = run.positions[:, robot], run.velocities[:, robot]
    made = positions[:-1], velocities[:-1], run.accelerations[:, robot], times[:-1]
    at = goal.reached_at(positions, velocities, times)
    if isinstance(goal, PathGoal):
        known = [progress[0], *progress]
        for k in np.flatnonzero(at).tolist():
            at[k] = goal.reached(positions[k], velocities[k], float(times[k]), progress=known[k])
    elif not goal.stop:
        at[1:] |= goal.reached_during(*made, run.dt)
    if goal.stop:
        away = np.linalg.norm(goal.position(times) - positions, axis=1) > ARRIVAL_LOST * goal.tolerance
        since = max(since, float(times[np.flatnonzero(away)[-1]]) if away.any() else since)
    found = np.flatnonzero(at & (times >= since))
    return float(times[found[0]]) if len(found) else np.inf
