"""Recordings of robots in a loop of the caller."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array, has, listing
from slalom.base.errors import InvalidInput
from slalom.decision import Decision
from slalom.decision.navigator import Navigator
from slalom.decision.settings import NUMBERS
from slalom.fleet.fleet import Fleet, FleetDecision
from slalom.fleet.guidance import ARRIVAL_LOST
from slalom.lookahead.navigator import LookAhead
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.shape import round_shape
from slalom.model.state import State
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import each_of
from slalom.sim.measure.recording import Recording, appearances, at_even_times
from slalom.sim.measure.responses import RecordedResponses
from slalom.vehicle.driver import Drive, Driver

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


class Recorder:
    """Robots whose decisions are noted. It has all attributes of the robots, and can be pickled.

    Attributes:
        recording: the steps so far. Each call begins a step. After the last one the robots follow their commands for a
            period. Accelerations are the changes of velocity over the steps. Where calls are not evenly spaced, the
            states are those at even times in between.

            A target that changes is a goal in motion. A robot has arrived when it reaches the last one for good. One
            that is taken out of the scene has arrived then. One without a goal does not arrive, and its goal is where
            it ends.
    """

    def __init__(self, robots: Any, obstacles: Sequence[Obstacle] | None, path: Path | None) -> None:
        self._robots, self._path = robots, path
        self._obstacles = obstacles
        self._calls, self._seen = list[_Call](), dict[int, Any]()
        self._end: tuple[Array, Array] | None = None

    def __getattr__(self, name: str) -> Any:
        # A copy asks for private ones before it has attributes.
        return object.__getattribute__(self, name) if name.startswith("_") else getattr(self._robots, name)

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._path is not None and (self._calls or error is None):
            self.recording.save(self._path)

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
        call = _Call(
            made.now,
            made.state.position[None],
            made.state.velocity[None],
            manoeuvre.control[None],
            (manoeuvre.response,),
            (decision.outcome,),
            seconds,
            {"goals": [goal]},
            [decision.progress],
        )
        then = made.now + _navigator(self._robots).period
        self._note(call, manoeuvre.position(then)[None], manoeuvre.velocity(then)[None])

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
            method="+".join(dict.fromkeys(method.name for method in methods)),
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
            shapes=tuple(fleet.members.shapes if fleet else [navigator.robot]),
            limits=tuple(fleet.members.limits if fleet else [navigator.limits]),
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
        for k in np.flatnonzero(last < len(made) - 1).tolist():
            arrived[k] = min(arrived[k], float(times[last[k] + 1]))
        left = last < len(made) - 1
        ended = [replace(goal, stop=goal.stop and not gone) for goal, gone in zip(found.goals, left.tolist())]
        return replace(found, arrived=np.array(arrived), goals=tuple(ended))

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


def record(
    robots: Fleet | Navigator | LookAhead | Driver,
    *,
    obstacles: Sequence[Obstacle] | None = None,
    path: Path | str | None = None,
) -> Recorder:
    """Return robots whose decisions in a loop of the caller are noted, see `Recorder`.

    Args:
        robots: a fleet, a robot, or a driver of a robot that moves in every direction.
        obstacles: as they really move, for metrics and figures; None: those of the fleet, or those in the calls, with
            tracks of one id as one obstacle.
        path: of the file that is written at the end of a `with` block, also after an error.

    Raises:
        InvalidInput: other robots, such as vehicles: `Recording.from_tracks` takes their motion.
    """
    if not isinstance(robots, Fleet) and not isinstance(_navigator(robots), Navigator):
        expected = "a Fleet, Navigator, LookAhead or Driver without wheels (else Recording.from_tracks)"
        raise InvalidInput(f"robots: expected {expected}, found {robots!r}")
    if obstacles is not None:
        listing(obstacles, "obstacles", "obstacles")
        for k, one in enumerate(obstacles):
            has(one, ("shape", "trajectory", "of_scenario"), "an Obstacle", f"obstacles[{k}]")
    return Recorder(robots, obstacles, None if path is None else Path(path))


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
