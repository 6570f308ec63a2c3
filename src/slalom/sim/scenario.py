"""A scenario: robots, obstacles and the settings of a run."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any, Final

import numpy as np

from slalom.base.checks import (
    GOAL,
    LIMITS,
    MAX_HORIZON,
    METHOD,
    OBJECTIVE,
    SHAPE,
    STATE,
    Array,
    array_of,
    check_fields,
    flag,
    has,
    known,
    listing,
    mapping,
    not_negative,
    number,
    positive,
    share,
    text,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.decision.methods import Method
from slalom.decision.navigator import Navigator
from slalom.decision.objective import Arrive, Objective, needs_goal
from slalom.decision.settings import DETOURS, NUMBERS, SharedSettings
from slalom.lookahead.navigator import LookAhead
from slalom.model.goal import Goal, refuse_goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Shape, refuse_turned
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.perception.sight import FULL_TURN, OCCLUSIONS, Sight
from slalom.sim.shape_distance import clearances
from slalom.sim.tasks import Body, Places, Tasks, places_of

# Settings as numbers, for `--set`, studies and files: limited sight and flags in a scenario stand for some of them.


SIGHT: Final = (
    *("sight_range", "field_of_view", "sight_near", "occlusion", "hidden_speed", "passive_safety", "entry_time"),
)
"""Settings of scenarios that limit sight."""
SETTINGS: Final = (
    *("start", "duration", "dt", "replan", *NUMBERS, "guided", "early"),
    *("sight_noise", "sight_delay", "sight_loss"),
    *SIGHT,
)
"""Settings that every scenario has and that `--set` may change, see `Scenario.settings`."""


def sight_of(settings: Mapping[str, float]) -> Sight | None:
    """The sight of the settings SIGHT; None where nothing is limited. 0 stands for no limit.

    `occlusion` is a number of OCCLUSIONS. `passive_safety` is 1 for a hidden speed, 2 for any motion of seen agents.

    Raises:
        InvalidInput: a setting out of its range; passive safety without a range; a hidden speed without passive safety.
    """
    for name in SIGHT:
        not_negative(settings[name], name)
    for name in ("occlusion", "passive_safety"):
        if settings[name] not in (0.0, 1.0, 2.0):
            raise InvalidInput(f"{name}: expected 0, 1 or 2, found {settings[name]:g}")
    passive = settings["passive_safety"]
    if passive and not settings["sight_range"]:
        raise InvalidInput("sight_range: expected one above 0 with passive_safety, found 0")
    for name in ("hidden_speed", "entry_time"):
        if settings[name] and not passive:
            raise InvalidInput(f"passive_safety: expected 1 or 2 with {name}, found 0")
    if not any(settings[name] for name in ("sight_range", "field_of_view", "occlusion")):
        return None
    return Sight(
        settings["sight_range"] or float("inf"),
        settings["field_of_view"] or FULL_TURN,
        settings["sight_near"],
        OCCLUSIONS[int(settings["occlusion"])],
        settings["hidden_speed"] if passive else None,
        passive == 2.0,
        settings["entry_time"] or None,
    )


def numbers_of(sight: Sight | None) -> dict[str, float]:
    """The settings SIGHT of a sight, of which `sight_of` makes it."""
    if sight is None:
        return dict.fromkeys(SIGHT, 0.0)
    passive = 0.0 if sight.hidden_speed is None else 1.0 + sight.any_motion
    values = (
        0.0 if sight.range == float("inf") else sight.range,
        0.0 if sight.field_of_view == FULL_TURN else sight.field_of_view,
        sight.near,
        float(OCCLUSIONS.index(sight.occlusion)),
        sight.hidden_speed or 0.0,
        passive,
        sight.entry_time or 0.0,
    )
    return dict(zip(SIGHT, values, strict=True))


def from_numbers(settings: Mapping[str, float], sight: Sight | None = None) -> dict[str, Any]:
    """The arguments of `Scenario` for settings as numbers; those SIGHT that are not among them are of `sight`.

    Raises:
        InvalidInput: `guided` or `early` other than 0 or 1; see `sight_of`; passive safety without a hidden speed.
    """
    found: dict[str, Any] = {name: value for name, value in settings.items() if name not in SIGHT}
    for name in {"guided", "early"} & found.keys():
        if found[name] not in (0.0, 1.0):
            raise InvalidInput(f"{name}: expected 0 or 1, found {found[name]:g}")
        found[name] = bool(found[name])
    limits = {name: value for name, value in settings.items() if name in SIGHT}
    if limits:
        known_speed = "hidden_speed" in limits or (sight is not None and sight.hidden_speed is not None)
        if limits.get("passive_safety") and not known_speed:
            raise InvalidInput("hidden_speed: expected a speed [m/s] with passive_safety, found none")
        if limits.get("passive_safety") == 0.0:
            limits = {"hidden_speed": 0.0, "entry_time": 0.0, **limits}
        found["sight"] = sight_of(numbers_of(sight) | limits)
    return found


def refuse_sight(sight: Sight | None, dimension: int, robots: int) -> None:
    """Raise InvalidInput for limited sight in space, and a hidden speed with several robots."""
    if sight is None:
        return
    if dimension != 2:
        raise InvalidInput(f"sight: expected limited sight in the plane only, found dimension {dimension}")
    if sight.hidden_speed is not None and robots > 1:
        raise InvalidInput(f"sight: expected no hidden speed for several robots, found {sight.hidden_speed:g} m/s")


def refuse_hidden_goals(
    goals: Sequence[Goal], shapes: Sequence[Shape], obstacles: Sequence[Obstacle], start: float
) -> None:
    """Raise InvalidInput for a goal at rest that an obstacle at rest covers.

    Args:
        shapes: of the robots with these goals. start: [s] see `Scenario`.
    """
    still = [k for k, goal in enumerate(goals) if isinstance(goal.trajectory, Stationary)]
    positions = {k: goals[k].position(start) for k in still}
    for obstacle in obstacles:
        if not obstacle.at_rest:
            continue
        for k in _near(obstacle, start, positions, shapes):
            clearance = float(clearances(obstacle, shapes[k], np.zeros(1), positions[k][None])[0])
            if clearance + goals[k].tolerance < 0.0:
                raise InvalidInput(
                    f"goal: expected a position that the robot can reach, found one {-clearance:g} m deep in obstacle "
                    f"{obstacle.name!r} grown by the robot's shape"
                )


def _near(obstacle: Obstacle, t: float, positions: dict[int, Array], shapes: Sequence[Shape]) -> list[int]:
    """The positions (d,) [m], by number, at which a robot touches the bounding box of an obstacle at time t [s]."""
    if not positions:
        return []
    parts = outline_parts(obstacle, t)
    low = np.min([part.corners.min(axis=0) - part.radius for part in parts], axis=0)
    high = np.max([part.corners.max(axis=0) + part.radius for part in parts], axis=0)
    places = np.array(list(positions.values()))
    away = np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0.0), axis=1)
    return [k for k, distance in zip(positions, away.tolist()) if distance <= shapes[k].bounding_radius]


MAX_STEPS: Final = 10_000_000
"""[1] Steps of a scenario. Larger: a slip in dt runs for days. Smaller: long studies are refused."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot: its shape, limits, initial state, goal and name.

    Attributes:
        method: by which it decides; None: that of the run. margin: [m]; None: that of the scenario.
        priority: above 0, of a robot among others, see `Fleet`.
        objective: what a single robot minimises; None: to arrive.
        appears: [s] absolute time before which the robot is not in the world; None: it is there from the start. It
            waits until its place is free, see `appearance`.

    Raises:
        InvalidInput: a shape or a goal of another dimension than the state, a negative margin or priority, a goal at
            rest to stop at with the bound LeastSpeed; a heading of the state for a shape that is not round.
    """

    shape: Shape
    limits: Limits
    state: State
    goal: Goal
    name: str = "robot"
    method: Method | None = None
    margin: float | None = None
    priority: float = 1.0
    objective: Objective | None = None
    appears: float | None = None

    def __post_init__(self) -> None:
        text(self.name, "name")
        has(self.shape, *SHAPE, f"{self.name}.shape")
        has(self.limits, *LIMITS, f"{self.name}.limits")
        has(self.state, *STATE, f"{self.name}.state")
        has(self.goal, *GOAL, f"{self.name}.goal")
        if self.method is not None:
            has(self.method, *METHOD, f"{self.name}.method")
        positive(self.priority, f"{self.name}.priority")
        if self.objective is not None:
            has(self.objective, *OBJECTIVE, f"{self.name}.objective")
        refuse_turned(self.shape, self.state.heading, f"{self.name}.state: heading")
        if self.margin is not None:
            not_negative(self.margin, f"{self.name}.margin")
        if self.appears is not None:
            number(self.appears, f"{self.name}.appears")
        for part, dimension in (("shape", self.shape.dimension), ("goal", self.goal.trajectory.dimension)):
            if dimension != self.state.dimension:
                raise InvalidInput(
                    f"{self.name}.{part}: expected dimension {self.state.dimension} as of the state, found {dimension}"
                )
        if self.objective is None or needs_goal(self.objective):
            refuse_goal(self.goal, self.limits, f"{self.name}.goal")


@dataclass(frozen=True, eq=False, repr=False)
class Scenario(SharedSettings):
    """Robots among obstacles, and the settings of their navigators.

    Attributes:
        name: of the gallery or the file. robots: one robot, or several that meet each other.
        obstacles: each exists as long as its trajectory lasts, except those that continue (see `Obstacle.after_end`).
        start: [s] absolute time of the start. duration: [s] after which a robot that has not arrived has failed.
        dt: [s] between steps; the applied acceleration is constant in between. replan: [s] between decisions, a
            multiple of dt. horizon, margin, holds and others: see `Settings`.
        guided: False for robots whose targets are their goals (see `Fleet`), to measure the effect of guidance. A
            single robot is never guided.
        early: whether robots avoid a collision as soon as the horizon shows it, see `Settings`.
        sight_noise: [m, m/s, m/s^2] standard deviation of observations of other robots. sight_delay: [s] their age, a
            multiple of replan or dt. sight_loss: share of observations that are lost (see `Sensing`).
        sight: limited sight of every robot; None: not limited. Obstacles at rest are known everywhere.
        tasks: stations and tasks over time, in the plane; a robot rests at its goal without a task. None: no tasks.
        parameters: the parameters of the gallery; recordings contain them.
        recorded: [s] begin and end of the recording of obstacles, if there is one; `start` lies within.
        notes: repairs, omissions and assumptions of the files that were read, a sentence each.

    Raises:
        InvalidInput: a setting outside its range, parts of different dimensions, a goal that an obstacle at rest
            covers, or a robot that appears before the start; one that appears later with observations that are late or
            lost; with tasks, a robot in space or with a goal that moves, to pass or with a path; see `places_of`.
    """

    name: str
    robots: tuple[Robot, ...]
    obstacles: tuple[Obstacle, ...] = ()
    start: float = 0.0
    duration: float = 60.0
    dt: float = 0.1
    replan: float = 0.0
    _: KW_ONLY
    guided: bool = True
    early: bool = False
    sight_noise: float = 0.0
    sight_delay: float = 0.0
    sight_loss: float = 0.0
    sight: Sight | None = None
    tasks: Tasks | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    recorded: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        text(self.name, "name")
        for name, members, expected in _PARTS:
            listing(getattr(self, name), expected, name)
            for k, one in enumerate(getattr(self, name)):
                has(one, members, expected, f"{name}[{k}]")
        mapping(self.parameters, "numbers by name", "parameters")
        dimensions = sorted({robot.state.dimension for robot in self.robots})
        if len(dimensions) != 1:
            raise InvalidInput(f"robots: expected one or more of the same dimension, found dimensions {dimensions}")
        number(self.start, "start")
        check_fields(self)
        for name in ("duration", "dt"):
            positive(getattr(self, name), name)
        not_negative(self.replan, "replan")
        object.__setattr__(self, "guided", flag(self.guided, "guided"))
        object.__setattr__(self, "early", flag(self.early, "early"))
        if self.sight is not None:
            has(self.sight, ("look", "occlusion"), "a Sight, or None", "sight")
        for name, mistake in unfit_times(self.duration, self.dt, self.replan, self.horizon, self.holds):
            raise InvalidInput(f"{name}: {mistake}")
        whole_periods(self.replan, self.dt)
        for name in ("sight_noise", "sight_delay"):
            not_negative(getattr(self, name), name)
        share(self.sight_loss, "sight_loss")
        whole_periods(self.sight_delay, self.dt * self.steps_per_decision, "sight_delay")
        refuse_sight(self.sight, self.dimension, len(self.robots))
        if self.recorded is not None:
            array_of(self.recorded, "recorded", (2,))
        if self.recorded is not None and not self.recorded[0] <= self.start < self.recorded[1]:
            first, last = self.recorded
            raise InvalidInput(
                f"start: expected a time of the recording, from {first:g} to before {last:g} s, found {self.start:g} s"
            )
        self._refuse_appearances()
        object.__setattr__(self, "obstacles", tuple(obstacle.of_scenario() for obstacle in self.obstacles))
        for k, obstacle in enumerate(self.obstacles):
            if obstacle.dimension != self.dimension:
                raise InvalidInput(
                    f"obstacle {obstacle.name or k!r}: expected dimension {self.dimension} as of the robots, "
                    f"found {obstacle.dimension}"
                )
        goals, shapes = [robot.goal for robot in self.robots], [robot.shape for robot in self.robots]
        refuse_hidden_goals(goals, shapes, self.obstacles, self.start)
        if self.tasks is not None:
            self._refuse_tasks(self.tasks)

    def _refuse_tasks(self, tasks: Tasks) -> None:
        """Raise InvalidInput for tasks that the robots cannot serve."""
        has(tasks, ("stations", "listed"), "Tasks, or None", "tasks")
        if self.dimension != 2:
            raise InvalidInput("tasks: expected none in space, found some")
        for robot in self.robots:
            goal = robot.goal
            if isinstance(goal, PathGoal) or not goal.stop or not isinstance(goal.trajectory, Stationary):
                raise InvalidInput(
                    f"{robot.name}.goal: expected a position to stop at, where the robot rests without a task, found "
                    f"{goal!r}"
                )
        names = [robot.name for robot in self.robots]
        for k, task in enumerate(tasks.listed):
            if task.robot:
                known(task.robot, f"tasks.listed[{k}].robot", names)
        if tasks.rate * self.dt > 60.0:
            raise InvalidInput(f"rate: expected at most one task in dt = {self.dt:g} s, found {tasks.rate:g} a minute")
        self.places()

    def places(self) -> Places:
        """The places of the stations of the tasks, and the waiting places. Raises InvalidInput as `places_of`."""
        assert self.tasks is not None
        bodies = [
            Body(robot.name, robot.shape.bounding_radius, robot.state.position, robot.goal.position(self.start))
            for robot in self.robots
        ]
        return places_of(self.tasks, bodies, self.obstacles, self.largest_margin)

    @property
    def largest_margin(self) -> float:
        """The largest margin [m] of the robots."""
        return max(map(self.margin_of, range(len(self.robots))))

    def _refuse_appearances(self) -> None:
        """Raise InvalidInput for robots that appear before the start, or later where that is not possible."""
        for robot in self.robots:
            if robot.appears is not None and robot.appears < self.start:
                raise InvalidInput(
                    f"{robot.name}.appears: expected at least start = {self.start:g} s, found {robot.appears:g} s"
                )
        if len(self.appearances):
            name = self.robots[int(np.argmax(self.appearances))].name
            for setting in ("sight_delay", "sight_loss"):
                if found := getattr(self, setting):
                    raise InvalidInput(f"{setting}: expected 0 as {name!r} appears after the start, found {found:g}")

    def __repr__(self) -> str:
        return f"<Scenario {self.name}, robots: {len(self.robots)}, obstacles: {len(self.obstacles)}>"

    @property
    def settings(self) -> dict[str, float]:
        """The settings SETTINGS as numbers, which `with_settings` takes."""
        limits = numbers_of(self.sight)
        return {name: limits[name] if name in limits else float(getattr(self, name)) for name in SETTINGS}

    def margin_of(self, robot: int) -> float:
        """The margin [m] of a robot: its own, or that of the scenario."""
        own = self.robots[robot].margin
        return self.margin if own is None else own

    @property
    def appearances(self) -> Array:
        """The times (N,) [s] from which the robots may be in the world; empty if all are there from the start."""
        times = [self.start if robot.appears is None else robot.appears for robot in self.robots]
        return np.array(times if max(times) > self.start else (), dtype=np.float64)

    @property
    def robot(self) -> Robot:
        """The first robot; in most scenarios the only one."""
        return self.robots[0]

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.robot.state.dimension

    @property
    def steps_per_decision(self) -> int:
        """Steps of dt between decisions."""
        return whole_periods(self.replan, self.dt)

    def with_settings(self, settings: Mapping[str, float]) -> "Scenario":
        """The scenario with other settings, see `settings`.

        Raises:
            InvalidInput: a name that is not a setting; see `from_numbers`.
        """
        for name in settings:
            known(name, "setting", SETTINGS)
        return replace(self, **from_numbers(settings, self.sight))

    def decider(self, method: Method) -> Navigator | LookAhead:
        """The `Navigator` of the only robot, or its `LookAhead`.

        Raises:
            InvalidInput: a method that looks ahead, with an objective.
        """
        navigator = self.navigator(method)
        if not method.looks_ahead:
            return navigator
        if self.robot.objective is not None:
            raise InvalidInput(f"objective: expected none for {method.name}, found {self.robot.objective!r}")
        ahead = LookAhead(navigator, time_horizon=self.duration, deadline=self.start + self.duration)
        return ahead if self.sight else ahead.prepared_for(self.obstacles, self.start)

    def navigator(self, method: Method, robot: int = 0) -> Navigator:
        """The navigator of a robot among obstacles, which publishes nothing and does not look ahead."""
        own, period = self.robots[robot], self.dt * self.steps_per_decision
        if self.sight is not None and self.sight.hidden_speed is not None:
            method = method.stopping()
        return Navigator(
            replace(method, shared=False, looks_ahead=False),
            own.shape,
            own.limits,
            period=period,
            detours=DETOURS if len(self.robots) > 1 else None,
            objective=Arrive() if own.objective is None else own.objective,
            early=self.early,
            **self.shared | {"margin": self.margin_of(robot)},
        )


def unfit_times(
    duration: float, dt: float, replan: float, horizon: float, holds: Sequence[float]
) -> Iterator[tuple[str, str]]:
    """The names of times [s] that do not fit a run or each other, each with the expected and the found value."""
    if duration > MAX_STEPS * dt:
        yield "duration", f"expected at most {MAX_STEPS} steps of dt = {dt:g} s, found {duration:g} s"
    for name, value in (("horizon", horizon), ("holds", max(holds, default=0.0))):
        if value > MAX_HORIZON:
            yield name, f"expected at most {MAX_HORIZON:g} s, found {value:g} s"
    if horizon < max(dt, replan):
        yield "horizon", f"expected at least the period of decisions, {max(dt, replan):g} s, found {horizon:g} s"


def whole_periods(interval: float, dt: float, name: str = "replan") -> int:
    """Steps of dt [s] in an interval [s], at least 1. Raises InvalidInput if that is not a multiple."""
    steps = max(1, round(interval / dt))
    if interval and abs(steps * dt - interval) > WHOLE_COUNT * interval:
        raise InvalidInput(f"{name}: expected a multiple of dt = {dt:g} s, found {interval:g} s")
    return steps


_PARTS = (
    ("robots", ("shape", "limits", "state", "goal"), "robots"),
    ("obstacles", ("shape", "trajectory", "of_scenario"), "obstacles"),
    ("notes", ("splitlines",), "sentences"),
)
