"""Recording of a run: all data for metrics, figures and an exact replay, and its HDF5 file."""

import hashlib
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path, Path as FilePath
from typing import Any, Final, NamedTuple

import h5py
import numpy as np

from slalom.base.checks import Array, array, array_of, positive, short, shown, whole
from slalom.base.errors import InvalidFile, InvalidInput, SlalomError
from slalom.base.registry import Kind, Registry, to_plain
from slalom.base.writing import write_file
from slalom.decision.document import goal_to_plain
from slalom.decision.settings import NUMBERS
from slalom.io.hdf5 import Group, member, numbers, read_tree, scalar, text
from slalom.model.bounds import BOUNDS
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.shape import SHAPES, Shape
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.obstacle import Headings, Obstacle
from slalom.sim.measure.hdf5 import (
    HALF_SPACES,
    add_units,
    listed,
    load_goal,
    load_holds,
    load_limits,
    load_obstacle,
    load_part,
    load_responses,
    named_numbers,
    save_part,
    save_plain,
    save_trajectory,
    texts,
    unbounded,
)
from slalom.sim.measure.responses import RecordedResponses, ResponseRow
from slalom.sim.measure.tidy_table import to_pandas
from slalom.sim.scenario import Scenario


class Step(NamedTuple):
    """One step of N robots: states at its start, and accelerations applied during it.

    Attributes:
        positions, velocities, accelerations: (N, d) [m, m/s, m/s^2].
        controls: (N, d) of the committed manoeuvres. responses: their responses, names of methods for peers.
        outcomes: names of the outcomes of decisions, "" without a decision. decision_times: (N,) [s] wall clock.
    """

    positions: Array
    velocities: Array
    accelerations: Array
    controls: Array
    responses: ResponseRow
    outcomes: tuple[str, ...]
    decision_times: Array


@dataclass(eq=False)
class RunLog:
    """Log of one run, from which `Recording.of` and `RunSummary.of` are built.

    Attributes:
        scenario, method, seed, foresight: see `Recording`.
        steps: steps of a recorded run. count: number of steps, recorded or not.
        statuses: number of decisions by name of the outcome.
        positions, velocities: (N, d) [m, m/s] at the end. arrived, appeared: (N,) [s] absolute, inf if not.
    """

    scenario: Scenario
    method: str
    seed: int
    foresight: str
    steps: list[Step] = field(default_factory=list)
    count: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    positions: Array = field(default_factory=lambda: np.empty((0, 2)))
    velocities: Array = field(default_factory=lambda: np.empty((0, 2)))
    arrived: Array = field(default_factory=lambda: np.empty(0))
    appeared: Array = field(default_factory=lambda: np.empty(0))

    def end(self, positions: Array, velocities: Array, arrived: Array, appeared: Array) -> None:
        """Store the final positions (N, d) [m] and velocities (N, d) [m/s], and times of arrival and appearance [s]."""
        self.positions = positions
        self.velocities = velocities
        self.arrived = arrived
        self.appeared = appeared


FORMAT: Final = "slalom recording 3"
"""Name of the written format."""
FORMATS_WITH_TEXTS: Final = ("slalom recording 1", "slalom recording 2")
"""Names of the former formats, which hold responses as text. They are read."""


def save_run(recording: "Recording", path: Path | str) -> None:
    """Write a run, see `Recording.save`.

    On a full disk the HDF5 library crashes. Hence it writes to memory.
    """
    with h5py.File("run", "w", driver="core", backing_store=False) as file:
        file.attrs["format"] = FORMAT
        run = file.create_group("run_0")
        run.attrs.update(
            scenario=recording.scenario,
            method=recording.method,
            seed=recording.seed,
            time_step=recording.dt,
            steps=len(recording.accelerations),
            final_sim_time=float(recording.times[-1]),
            digest=recording.digest(),
            foresight=recording.foresight,
        )
        run.create_group("parameters").attrs.update(recording.parameters)
        run.create_group("settings").attrs.update(recording.settings)
        run["holds"] = np.array(recording.holds)
        heading = np.arctan2(recording.velocities[..., 1], recording.velocities[..., 0])[..., None]
        run["times"] = recording.times
        run["poses"] = np.concatenate([recording.positions, heading], axis=-1)
        run["twists"] = np.concatenate([recording.velocities, np.zeros_like(heading)], axis=-1)
        more = ("appears",) if len(recording.appears) else ()
        for name in ("accelerations", "controls", "decision_times", "arrived", *more):
            run[name] = getattr(recording, name)
        run["responses"] = recording.responses.number
        run["response_parts"] = np.array(recording.responses.to_json(), dtype=h5py.string_dtype())
        outcomes = np.array(recording.outcomes, dtype=h5py.string_dtype())
        run["outcomes"] = outcomes.reshape(recording.decision_times.shape)
        _save_parts(run, recording)
        add_units(run)
        file.flush()
        write_file(path, file.id.get_file_image())


def _save_parts(run: Any, recording: "Recording") -> None:
    """Write the robots with their shapes, limits and goals, and the obstacles."""
    span = float(recording.times[0]), float(recording.times[-1])
    for k, (shape, limits, goal) in enumerate(zip(recording.shapes, recording.limits, recording.goals)):
        group = run.create_group(f"robots/{k}")
        save_part(group.create_group("shape"), shape, SHAPES)
        group.attrs["name"] = recording.names[k]
        group.attrs.update(max_speed=limits.max_speed, max_acceleration=limits.max_acceleration)
        for name in HALF_SPACES:
            bounds = getattr(limits, name)
            rows = np.array([(*bound.normal, bound.offset) for bound in bounds])
            group[name] = rows.reshape(-1, recording.dimension + 1)
        for j, bound in enumerate(limits.bounds):
            save_part(group.create_group(f"bounds/{j}"), bound, BOUNDS)
        group.attrs.update(goal_tolerance=goal.tolerance, goal_stop=goal.stop)
        save_trajectory(group.create_group("goal"), goal.trajectory, *span)
        if isinstance(goal, PathGoal):
            save_plain(group.create_group("goal_path"), goal_to_plain(goal, "goal")["path"])
    for k, obstacle in enumerate(recording.obstacles):
        group = run.create_group(f"obstacles/{k}")
        group.attrs.update(name=obstacle.name, contact_at_rest=obstacle.contact_at_rest)
        if isinstance(obstacle.heading, Headings):
            save_plain(group.create_group("headings"), to_plain(obstacle.heading))
        else:
            group.attrs["heading"] = obstacle.heading
        save_part(group.create_group("shape"), obstacle.shape, SHAPES)
        if obstacle.uncertainty is not None:
            save_part(group.create_group("uncertainty"), obstacle.uncertainty, UNCERTAINTIES)
        save_trajectory(group.create_group("trajectory"), obstacle.trajectory, *span)


CHOSEN, UNANSWERED = "CHOSEN", "UNANSWERED"
"""Outcomes of a peer, which has no `Outcome`: it returned a velocity, or something else."""
Which = int | str | None
"""A robot of a recording: its number, its name, or None for the only one."""
DECIDING = ("dt", "replan", *NUMBERS, "guided")
"""Names of the settings of a scenario on which decisions depend."""
NUMBER = re.compile(r"(?<![\w.])-?(?:\d+\.?\d*(?:e[+-]?\d+)?|inf|nan)(?!\w)")
"""A number in the text of a response."""


VIEWS: Final = Registry[Callable[[Any], str]](
    "slalom.views", Kind(callable, "a function from a recording to a page of HTML"), {}
)
"""What notebooks show of a recording, under the name `recording`."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A run of N robots over T steps.

    Attributes:
        scenario, method, seed, parameters: input of the run. dt: [s] length of a step.
        times: (T + 1,) absolute [s]. positions: (T + 1, N, d) [m]. velocities: (T + 1, N, d) [m/s].
        accelerations: (T, N, d) [m/s^2], constant over each step.
        controls: (T, N, d) of the committed manoeuvre, in the unit of its response; velocities for a peer.
        responses: of the committed manoeuvres, see `RecordedResponses`; names for a peer.
        outcomes: (T, N) names of `Outcome`, CHOSEN or UNANSWERED; "" if no decision was due.
        decision_times: (T, N) wall clock [s], the only part that differs between equal runs.
        shapes: N. limits: N. goals: N. arrived: (N,) absolute time [s], inf if the robot did not arrive.
        obstacles: obstacles with their true trajectories.
        foresight: knowledge of obstacles: recorded, present or observed (see `forecast.FORESIGHTS`); with several
            robots, knowledge of each other: published or observed. "" if a file states none.
        names: N, all different; by default "robot 0", "robot 1", ...
        appears: (N,) absolute times [s] from which robots may be in the world, see `appeared`; empty if all are there
            from the start.
        settings: the settings of `Scenario` with which the robots decided; empty if a file states none. holds: [s].
    """

    scenario: str
    method: str
    seed: int
    dt: float
    parameters: dict[str, float]
    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    controls: Array
    responses: RecordedResponses
    outcomes: tuple[tuple[str, ...], ...]
    decision_times: Array
    shapes: tuple[Shape, ...]
    limits: tuple[Limits, ...]
    goals: tuple[Goal, ...]
    arrived: Array
    obstacles: tuple[Obstacle, ...]
    foresight: str = ""
    settings: Mapping[str, float] = field(default_factory=dict)
    holds: tuple[float, ...] = ()
    names: tuple[str, ...] = ()
    appears: Array = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        if not self.names:
            object.__setattr__(self, "names", tuple(f"robot {k}" for k in range(len(self.shapes))))

    def __repr__(self) -> str:
        size = f"robots: {len(self.names)}, steps: {len(self.accelerations)}"
        return f"<Recording of {self.scenario} by {self.method}, seed: {self.seed}, {size}>"

    @classmethod
    def of(cls, log: RunLog) -> "Recording":
        """Return the recording of a run whose log holds every step."""
        scenario, steps = log.scenario, log.steps
        n, d = log.positions.shape
        return cls(
            scenario=scenario.name,
            method=log.method,
            seed=log.seed,
            dt=scenario.dt,
            parameters=dict(scenario.parameters),
            times=scenario.start + scenario.dt * np.arange(len(steps) + 1, dtype=np.float64),
            positions=np.array([*(step.positions for step in steps), log.positions]),
            velocities=np.array([*(step.velocities for step in steps), log.velocities]),
            accelerations=np.array([step.accelerations for step in steps]).reshape(-1, n, d),
            controls=np.array([step.controls for step in steps]).reshape(-1, n, d),
            responses=RecordedResponses.of([step.responses for step in steps], n),
            outcomes=tuple(step.outcomes for step in steps),
            decision_times=np.array([step.decision_times for step in steps]).reshape(-1, n),
            shapes=tuple(robot.shape for robot in scenario.robots),
            limits=tuple(robot.limits for robot in scenario.robots),
            goals=tuple(robot.goal for robot in scenario.robots),
            arrived=log.arrived,
            obstacles=scenario.obstacles,
            foresight=log.foresight,
            names=_distinct([robot.name for robot in scenario.robots]),
            settings={name: scenario.settings[name] for name in DECIDING},
            holds=tuple(scenario.holds),
            appears=scenario.appearances,
        )

    @cached_property
    def appeared(self) -> Array:
        """The absolute times (N,) [s] of appearance, inf for robots that did not appear.

        A robot appears with its first decision. Until then it rests at its place, and is not in the world.
        """
        found = np.full(len(self.shapes), self.times[0])
        for k in np.flatnonzero(self.appears > self.times[0]).tolist():
            first = (t for t, outcomes in zip(self.times.tolist(), self.outcomes) if outcomes[k])
            found[k] = next(first, np.inf)
        return found

    def steps_of(self, robot: int) -> slice:
        """The numbers of the states at which a robot is in the world; it leaves at a goal at which it need not stop."""
        first, last = 0, len(self.accelerations)
        if self.appeared[robot] > self.times[0]:
            first = int(np.searchsorted(self.times, self.appeared[robot]))
        if np.isfinite(self.arrived[robot]) and not self.goals[robot].stop:
            reached = round(float(self.arrived[robot] - self.times[0]) / self.dt)
            last = min(last, max(first + 1, reached))
        return slice(first, last + 1)

    @property
    def dimension(self) -> int:
        """Dimension of the space, 2 or 3."""
        return int(self.positions.shape[2])

    def row(self, robot: Which = None) -> int:
        """Return the number of a robot.

        Raises:
            InvalidInput: an unknown name or number; None, if there are several robots.
        """
        n = len(self.names)
        if robot is None and n == 1:
            return 0
        if isinstance(robot, str) and robot in self.names:
            return self.names.index(robot)
        if isinstance(robot, int | np.integer) and 0 <= robot < n:
            return int(robot)
        some = ", ".join(repr(name) for name in self.names[:3]) + (", ..." if n > 3 else "")
        found = "none" if robot is None else repr(robot)
        raise InvalidInput(f"robot: expected the name or number of one of {n} robots ({some}), found {found}")

    def only(self, robot: Which = None) -> "Recording":
        """Return the recording of one robot while it is in the world, without the other robots, see `row`.

        `single_robot_view` keeps the others.
        """
        k, steps = self.row(robot), len(self.accelerations)
        first, last = min(self.steps_of(k).start, steps), self.steps_of(k).stop - 1
        if len(self.names) == 1 and (first, last) == (0, steps):
            return self
        one = slice(k, k + 1)
        made, states = slice(first, last), slice(first, last + 1)
        return replace(
            self,
            times=self.times[states],
            positions=self.positions[states, one],
            velocities=self.velocities[states, one],
            accelerations=self.accelerations[made, one],
            controls=self.controls[made, one],
            responses=self.responses.only(one, made),
            outcomes=tuple(row[one] for row in self.outcomes[made]),
            decision_times=self.decision_times[made, one],
            shapes=self.shapes[one],
            limits=self.limits[one],
            goals=self.goals[one],
            arrived=self.arrived[one],
            names=self.names[one],
            appears=self.appeared[one] if len(self.appears) else self.appears,
        )

    def acceleration_before(self, step: int, robot: int = 0) -> Array:
        """Return the acceleration (d,) [m/s^2] applied before `step`; zero before the first."""
        return np.asarray(self.accelerations[step - 1, robot] if step else np.zeros(self.dimension))

    def digest(self) -> str:
        """Return a hash of all data except the wall clock: equal runs have equal digests.

        For responses it covers the numbers, not the names of classes and fields: a rename changes no digest.
        """
        of_part = [NUMBER.findall(text) for text in self.responses.text_of_parts]
        numbers = [of_part[k] for k in self.responses.number.ravel().tolist()]
        parts = [self.scenario, self.method, str(self.seed), repr(self.dt), repr(numbers), repr(self.outcomes)]
        arrays = [self.times, self.positions, self.velocities, self.accelerations, self.controls, self.arrived]
        if np.any(self.appeared > self.times[0]):
            arrays.append(self.appeared)
        content = b"\0".join([*(p.encode() for p in parts), *(np.ascontiguousarray(a).tobytes() for a in arrays)])
        return hashlib.sha256(content).hexdigest()

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame with one row for each time and robot, see `tidy_table.COLUMNS`.

        Raises:
            InvalidInput: pandas is not installed (`pip install 'slalom[data]'`).
        """
        return to_pandas(self)

    def _repr_html_(self) -> str | None:
        """Return the view of the run for notebooks, at most about 1.5 MB; None if no installed package has one."""
        return VIEWS["recording"](self) if "recording" in VIEWS else None

    def save(self, path: FilePath | str) -> None:
        """Write an HDF5 file, with navground's group and attribute names if they exist.

        `poses` holds the position and, last, the heading of the velocity [rad]; `twists` the velocity and, last, 0.
        Every array has the attribute `units`.

        Raises:
            InvalidFile: a file that cannot be written.
        """
        save_run(self, path)

    @classmethod
    def load(cls, path: FilePath | str) -> "Recording":
        """Read a file written by `save`; the first takes about 0.2 s more than its content: see `read_tree`.

        Raises:
            InvalidFile: another file; arrays whose lengths do not fit together; positions that are not finite.
        """
        path = FilePath(path)
        file = read_tree(path)
        try:
            found = text(file.attributes, "format") if "format" in file.attributes else "no format"
            if found not in (FORMAT, *FORMATS_WITH_TEXTS):
                raise InvalidInput(f"format: expected {FORMAT!r}, found {shown(found)}")
            return cls._from_group(member(file.groups, "run_0"), found)
        except (SlalomError, ArithmeticError, TypeError, ValueError) as error:
            # Errors of the checks of the parts, and of numpy for values without a check.
            raise InvalidFile([f"{path}: expected the content of a recording, found {error}"]) from None

    @classmethod
    def _from_group(cls, run: Group, written_as: str) -> "Recording":
        attributes, robots = run.attributes, listed(run, "robots")
        if "period" in attributes:
            raise InvalidInput("period: expected none, found one of a world that repeats")
        times = array(numbers(run.datasets, "times"), "times")
        poses = numbers(run.datasets, "poses")
        steps = times.size - 1
        n = len(robots)
        d = poses.shape[-1] - 1 if poses.ndim else 0
        if d not in (2, 3) or steps < 0:
            raise InvalidInput(f"poses: expected an array (steps, robots, 3 or 4), found shape {poses.shape}")

        def stored(name: str, *shape: int) -> Array:
            return array_of(numbers(run.datasets, name), name, shape)

        recording = cls(
            scenario=text(attributes, "scenario"),
            method=text(attributes, "method"),
            seed=whole(scalar(attributes, "seed"), "seed"),
            dt=positive(scalar(attributes, "time_step"), "time_step"),
            parameters=named_numbers(member(run.groups, "parameters")),
            times=stored("times", steps + 1),
            positions=stored("poses", steps + 1, n, d + 1)[..., :-1],
            velocities=stored("twists", steps + 1, n, d + 1)[..., :-1],
            accelerations=stored("accelerations", steps, n, d),
            controls=unbounded(run, "controls", steps, n, d),
            responses=load_responses(run, steps, n)
            if written_as == FORMAT
            else RecordedResponses.from_texts(texts(run, "responses", steps, n), n),
            outcomes=texts(run, "outcomes", steps, n),
            decision_times=stored("decision_times", steps, n),
            shapes=tuple(load_part(member(robot.groups, "shape"), SHAPES) for robot in robots),
            limits=tuple(load_limits(robot, d) for robot in robots),
            goals=tuple(load_goal(robot) for robot in robots),
            arrived=unbounded(run, "arrived", n),
            obstacles=tuple(load_obstacle(obstacle) for obstacle in listed(run, "obstacles")),
            foresight=text(attributes, "foresight") if "foresight" in attributes else "",
            names=_distinct([text(r.attributes, "name") for r in robots if "name" in r.attributes])[: len(robots)],
            settings=named_numbers(run.groups["settings"]) if "settings" in run.groups else {},
            holds=load_holds(run),
            appears=unbounded(run, "appears", n) if "appears" in run.datasets else np.empty(0),
        )
        recording._refuse_contradictions()
        return recording

    def _refuse_contradictions(self) -> None:
        """Raise InvalidInput for times that do not increase, and for parts of another dimension."""
        d = self.dimension
        if np.any(np.diff(self.times) <= 0.0):
            raise InvalidInput(f"times: expected increasing times, found {short(self.times)}")
        found = {
            "shapes": [shape.dimension for shape in self.shapes],
            "goals": [goal.trajectory.dimension for goal in self.goals],
            "obstacles": [obstacle.dimension for obstacle in self.obstacles],
        }
        for name, dimensions in found.items():
            if set(dimensions) - {d}:
                raise InvalidInput(f"{name}: expected {d} dimensions, found {short(np.array(dimensions))}")


def _distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of robots if all differ, else none."""
    return tuple(names) if len(set(names)) == len(names) else ()


@dataclass(frozen=True, eq=False)
class RunSummary:
    """Final state of a run of N robots; its size does not depend on the duration.

    Only the metrics `arrived` and `time` accept it. The others, including collisions, need the whole run: an attribute
    that only a `Recording` has raises InvalidInput.

    Attributes:
        scenario, method, seed, dt, parameters, foresight: as in `Recording`.
        times: (2,) absolute start and end [s]. steps: number of steps.
        position: (N, d) [m] at the end. velocity: (N, d) [m/s] at the end.
        arrived, appeared: (N,) absolute times [s], inf if the robot did not.
        statuses: number of decisions by name of the outcome.
    """

    scenario: str
    method: str
    seed: int
    dt: float
    parameters: dict[str, float]
    times: Array
    steps: int
    position: Array
    velocity: Array
    arrived: Array
    statuses: dict[str, int]
    appeared: Array
    foresight: str = ""

    @classmethod
    def of(cls, log: RunLog) -> "RunSummary":
        """Return the summary of a run from its log."""
        scenario = log.scenario
        return cls(
            scenario=scenario.name,
            method=log.method,
            seed=log.seed,
            dt=scenario.dt,
            parameters=dict(scenario.parameters),
            times=scenario.start + scenario.dt * np.array([0.0, log.count]),
            steps=log.count,
            position=log.positions,
            velocity=log.velocities,
            arrived=log.arrived,
            statuses=dict(sorted(log.statuses.items())),
            appeared=log.appeared,
            foresight=log.foresight,
        )

    def __getattr__(self, name: str) -> Any:
        if name in RECORDING_ATTRIBUTES:
            raise InvalidInput(f"{name}: expected a recorded run, found one with record=False")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


RECORDING_ATTRIBUTES = {
    name for name in (*dir(Recording), *(f.name for f in fields(Recording))) if not name.startswith("_")
}
"""Names of the public attributes of recordings."""
