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
import numpy.typing as npt

from slalom.base.checks import Array, array, array_of, each_number, has, positive, short, shown, whole
from slalom.base.errors import InvalidFile, InvalidInput, SlalomError
from slalom.base.registry import Kind, Registry, to_plain
from slalom.base.tolerances import WHOLE_COUNT
from slalom.base.writing import write_file
from slalom.decision.document import goal_to_plain
from slalom.decision.settings import NUMBERS
from slalom.io.hdf5 import Group, member, numbers, read_tree, scalar, text
from slalom.io.recorded import SLOWEST
from slalom.io.walls import Walls
from slalom.kernels.arrays import Flags, Indices
from slalom.model.bounds import BOUNDS
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.shape import SHAPES, Shape, round_shape
from slalom.model.trajectory import Sampled, Stationary
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
    load_tasks,
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
        tasks: see `Recording`.
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
    tasks: Array | None = None

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
        more = [*(["appears"] if len(recording.appears) else []), *([] if recording.tasks is None else ["tasks"])]
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


OBSERVED: Final = "observed"
"""Method of agents whose motion was observed."""
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
        tasks: (n, COLUMNS) of each task, see `sim.tasks.COLUMNS`; None: a scenario without. The goals of robots are
            then where they rest without a task, and a robot has arrived that rests there at the end.
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
    tasks: Array | None = None

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
            tasks=log.tasks,
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

    @classmethod
    def from_tracks(
        cls,
        times: npt.ArrayLike,
        positions: npt.ArrayLike,
        radii: npt.ArrayLike,
        *,
        walls: Walls | Sequence[Obstacle] = (),
        velocities: npt.ArrayLike | None = None,
        names: Sequence[str] = (),
        name: str = "tracks",
    ) -> "Recording":
        """Return the recording of N agents that moved by any method, such as persons or vehicles.

        The goal of an agent is where its track ends, and its limits are its largest speed and acceleration. Where times
        are not evenly spaced, the states are those at even times in between.

        Args:
            times: (T + 1,) [s]. positions: (T + 1, N, d) [m], nan before an agent appears and after it has left.
            radii: [m] one, or N. walls: of `read_walls`, or other obstacles. velocities: as positions [m/s]; None: of a
                smooth curve. names: of the agents. name: of the recording.

        Raises:
            InvalidInput: arrays that do not fit together, times that do not increase, an agent with fewer than two
                positions, or with none in between.
        """
        stamps, rows, moves, there = _tracks(times, positions, velocities)
        n, d = rows.shape[1:]
        others = walls.obstacles if isinstance(walls, Walls) else tuple(walls)
        for k, one in enumerate(others):
            has(one, ("of_scenario",), "an Obstacle", f"walls[{k}]")
        if len(names) not in (0, n) or len(set(names)) < len(names):
            raise InvalidInput(f"names: expected {n} that differ, or none, found {shown(names)}")
        (appears, last), size = appearances(there, stamps), each_number(radii, "radii", n)
        begins, ends = stamps[there.argmax(axis=0)], stamps[last]
        even, _, rows, moves = at_even_times(stamps, rows, moves)
        dt, accelerations = float(even[1] - even[0]), np.diff(moves, axis=0) / (even[1] - even[0])
        inside = (even[:-1, None] >= begins - WHOLE_COUNT) & (even[:-1, None] < ends - WHOLE_COUNT)
        accelerations[~inside] = 0.0
        limits = [
            Limits(max(float(np.linalg.norm(moves[:, k], axis=1).max()), SLOWEST), max(float(most), SLOWEST))
            for k, most in enumerate(np.linalg.norm(accelerations, axis=2).max(axis=0))
        ]
        goals = [Goal(Stationary(end), stop=bool(ends[k] == stamps[-1])) for k, end in enumerate(rows[-1])]
        return cls(
            scenario=name,
            method=OBSERVED,
            seed=0,
            dt=dt,
            parameters={},
            times=even,
            positions=rows,
            velocities=moves,
            accelerations=accelerations,
            controls=accelerations,
            responses=RecordedResponses.of([(OBSERVED,) * n] * len(inside), n),
            outcomes=tuple(tuple(row) for row in np.where(inside, CHOSEN, "").tolist()),
            decision_times=np.zeros(inside.shape),
            shapes=tuple(round_shape(radius, d) for radius in size.tolist()),
            limits=tuple(limits),
            goals=tuple(goals),
            arrived=ends,
            obstacles=tuple(one.of_scenario() for one in others),
            names=tuple(names),
            appears=appears,
        )

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
            tasks=None,
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
        if self.tasks is not None:
            arrays.append(self.tasks)
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
            tasks=load_tasks(run, n),
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


def _with_gaps(value: npt.ArrayLike, name: str) -> Array:
    """Return numbers, some of which may be nan, as an array that may be changed."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name}: expected numbers, found {shown(value)}") from None


def _tracks(
    times: npt.ArrayLike, positions: npt.ArrayLike, velocities: npt.ArrayLike | None
) -> tuple[Array, Array, Array, Flags]:
    """Return checked times, motion at rest outside of each track, and whether agents are there, of `from_tracks`."""
    stamps, rows = array(times, "times"), _with_gaps(positions, "positions")
    if stamps.ndim != 1 or len(stamps) < 2 or np.any(np.diff(stamps) <= 0.0):
        raise InvalidInput(f"times: expected two or more that increase, found {short(stamps)}")
    if rows.ndim != 3 or len(rows) != len(stamps) or rows.shape[2] not in (2, 3) or not rows.shape[1]:
        raise InvalidInput(f"positions: expected shape ({len(stamps)}, N, 2 or 3), found {rows.shape}")
    there: Flags = np.asarray(np.isfinite(rows).all(axis=2))
    moves = np.zeros_like(rows) if velocities is None else _with_gaps(velocities, "velocities")
    if moves.shape != rows.shape or not np.isfinite(moves[there]).all():
        raise InvalidInput(f"velocities: expected finite numbers of shape {rows.shape}, found shape {moves.shape}")
    _, last = appearances(there, stamps)
    for k, (begin, end) in enumerate(zip(there.argmax(axis=0).tolist(), last.tolist())):
        own = slice(begin, end + 1)
        if end == begin or not there[own, k].all():
            found = f"{int(there[:, k].sum())} from row {begin} to {end}"
            raise InvalidInput(f"positions[:, {k}]: expected two or more in consecutive rows, found {found}")
        if velocities is None:
            moves[own, k] = Sampled(stamps[own], rows[own, k]).velocity(stamps[own])
        moves[:begin, k] = moves[end + 1 :, k] = 0.0
        rows[:begin, k], rows[end + 1 :, k] = rows[begin, k], rows[end, k]
    return stamps, rows, moves, there


def appearances(there: Flags, times: Array) -> tuple[Array, Indices]:
    """Return the times (N,) [s] of the first row in which robots are there (T, N), as `appears`; and the last rows."""
    first = there.argmax(axis=0)
    return times[first] if first.any() else np.empty(0), len(there) - 1 - there[::-1].argmax(axis=0)


def at_even_times(times: Array, positions: Array, velocities: Array) -> tuple[Array, Indices, Array, Array]:
    """Return even times, the row before or at each but the last, and motion (T + 1, N, d) at them.

    They are the given ones if these are even but for rounding; else the step is their median, and motion is cubic.
    """
    step = np.diff(times)
    if np.ptp(step) <= 1e-6 * step[0]:
        return times, np.arange(len(step)), positions, velocities
    usual = float(np.median(step))
    even = times[0] + usual * np.arange(int((times[-1] - times[0]) / usual + WHOLE_COUNT) + 1)
    rows = np.clip(np.searchsorted(times, even + WHOLE_COUNT * usual, side="right") - 1, 0, len(step) - 1)
    h, way = step[rows][:, None, None], positions[rows + 1] - positions[rows]
    u = (even - times[rows])[:, None, None] / h
    v, w = velocities[rows], velocities[rows + 1]
    places = positions[rows] + h * u * ((1.0 - u) ** 2 * v - u * (1.0 - u) * w) + u * u * (3.0 - 2.0 * u) * way
    return (
        even,
        rows[:-1],
        places,
        v * (1.0 - u) * (1.0 - 3.0 * u) + w * u * (3.0 * u - 2.0) + 6.0 * u * (1.0 - u) * way / h,
    )


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
