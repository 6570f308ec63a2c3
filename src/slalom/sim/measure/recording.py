"""Recording of a run: all data for metrics, figures and an exact replay, and its HDF5 file."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path as FilePath
from typing import Any

import h5py
import numpy as np

from slalom.bounds import BOUNDS
from slalom.checks import Array
from slalom.errors import InvalidFile
from slalom.goal import Goal
from slalom.limits import HalfSpace, Limits
from slalom.obstacle import Obstacle
from slalom.path import Path
from slalom.periodic import Period
from slalom.shape import SHAPES, Shape, Union
from slalom.sim.measure.run_log import RunLog
from slalom.trajectory import TRAJECTORIES, PiecewisePolynomial, Trajectory
from slalom.uncertainty import UNCERTAINTIES

FORMAT, READABLE_FORMATS = "slalom recording 2", ("slalom recording 1", "slalom recording 2")
"""Name of the written format, and of the readable ones."""
FORMER_NAMES = {"place": "initial_position", "speed": "initial_velocity", "push": "initial_acceleration"}
"""Current names of fields of trajectories in format 1, which `_load_part` uses if the class lacks the old name."""
CHOSEN, UNANSWERED = "CHOSEN", "UNANSWERED"
"""Outcomes of a peer, which has no `Outcome`: it returned a velocity, or something else."""
NUMBER = re.compile(r"(?<![\w.])-?(?:\d+\.?\d*(?:e[+-]?\d+)?|inf|nan)(?!\w)")
"""A number in the text of a response."""
HALF_SPACES = ("velocity_bounds", "acceleration_bounds")


@dataclass(frozen=True, eq=False)
class Recording:
    """A run of N robots over T steps.

    Attributes:
        scenario, method, seed, parameters: input of the run. dt: [s] length of a step.
        times: (T + 1,) absolute [s]. positions: (T + 1, N, d) [m]. velocities: (T + 1, N, d) [m/s].
        accelerations: (T, N, d) [m/s^2], constant over each step.
        controls: (T, N, d) of the committed manoeuvre, in the unit of its response; velocities for a peer.
        responses: (T, N) texts of the responses; names for a peer.
        outcomes: (T, N) names of `Outcome`, CHOSEN or UNANSWERED; "" if no decision was due.
        decision_times: (T, N) wall clock [s], the only part that differs between equal runs.
        shapes: N. limits: N. goals: N. arrived: (N,) absolute time [s], inf if the robot did not arrive.
        obstacles: obstacles with their true trajectories.
        foresight: knowledge of obstacles: recorded, present or observed (see `forecast.FORESIGHTS`); with several
            robots, knowledge of each other: published or observed. "" if a file states none.
        period: [m] of a periodic world, see `Scenario`; positions are not wrapped.
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
    responses: tuple[tuple[str, ...], ...]
    outcomes: tuple[tuple[str, ...], ...]
    decision_times: Array
    shapes: tuple[Shape, ...]
    limits: tuple[Limits, ...]
    goals: tuple[Goal, ...]
    arrived: Array
    obstacles: tuple[Obstacle, ...]
    foresight: str = ""
    period: Period | None = None

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
            responses=tuple(step.responses for step in steps),
            outcomes=tuple(step.outcomes for step in steps),
            decision_times=np.array([step.decision_times for step in steps]).reshape(-1, n),
            shapes=tuple(robot.shape for robot in scenario.robots),
            limits=tuple(robot.limits for robot in scenario.robots),
            goals=tuple(robot.goal for robot in scenario.robots),
            arrived=log.arrived,
            obstacles=scenario.obstacles,
            foresight=log.foresight,
            period=scenario.period,
        )

    @property
    def dimension(self) -> int:
        """Dimension of the space, 2 or 3."""
        return int(self.positions.shape[2])

    def acceleration_before(self, step: int, robot: int = 0) -> Array:
        """Return the acceleration (d,) [m/s^2] applied before `step`; zero before the first."""
        return np.asarray(self.accelerations[step - 1, robot] if step else np.zeros(self.dimension))

    def digest(self) -> str:
        """Return a hash of all data except the wall clock: equal runs have equal digests.

        For responses it covers the numbers, not the names of classes and fields: a rename changes no digest.
        """
        numbers = [NUMBER.findall(text) for row in self.responses for text in row]
        parts = [self.scenario, self.method, str(self.seed), repr(self.dt), repr(numbers), repr(self.outcomes)]
        if self.period is not None:
            parts.append(repr(self.period))
        arrays = [self.times, self.positions, self.velocities, self.accelerations, self.controls, self.arrived]
        content = b"\0".join([*(p.encode() for p in parts), *(np.ascontiguousarray(a).tobytes() for a in arrays)])
        return hashlib.sha256(content).hexdigest()

    def save(self, path: FilePath | str) -> None:
        """Write an HDF5 file, with navground's group and attribute names if they exist.

        `poses` holds the position and, last, the heading of the velocity [rad]; `twists` the velocity and, last, 0.
        """
        with h5py.File(path, "w") as file:
            file.attrs["format"] = FORMAT
            run = file.create_group("run_0")
            run.attrs.update(
                scenario=self.scenario,
                method=self.method,
                seed=self.seed,
                time_step=self.dt,
                steps=len(self.accelerations),
                final_sim_time=float(self.times[-1]),
                digest=self.digest(),
                foresight=self.foresight,
            )
            if self.period is not None:
                run.attrs["period"] = self.period
            run.create_group("parameters").attrs.update(self.parameters)
            heading = np.arctan2(self.velocities[..., 1], self.velocities[..., 0])[..., None]
            run["times"] = self.times
            run["poses"] = np.concatenate([self.positions, heading], axis=-1)
            run["twists"] = np.concatenate([self.velocities, np.zeros_like(heading)], axis=-1)
            for name in ("accelerations", "controls", "decision_times", "arrived"):
                run[name] = getattr(self, name)
            for name in ("responses", "outcomes"):
                texts = np.array(getattr(self, name), dtype=h5py.string_dtype())
                run[name] = texts.reshape(self.decision_times.shape)
            span = float(self.times[0]), float(self.times[-1])
            for k, (shape, limits, goal) in enumerate(zip(self.shapes, self.limits, self.goals)):
                group = run.create_group(f"robots/{k}")
                _save_shape(group.create_group("shape"), shape)
                group.attrs.update(max_speed=limits.max_speed, max_acceleration=limits.max_acceleration)
                for name in HALF_SPACES:
                    bounds = getattr(limits, name)
                    rows = np.array([(*bound.normal, bound.offset) for bound in bounds])
                    group[name] = rows.reshape(-1, self.dimension + 1)
                for j, bound in enumerate(limits.bounds):
                    _save_part(group.create_group(f"bounds/{j}"), bound, BOUNDS)
                group.attrs.update(goal_tolerance=goal.tolerance, goal_stop=goal.stop)
                _save_trajectory(group.create_group("goal"), goal.trajectory, *span)
            for k, obstacle in enumerate(self.obstacles):
                group = run.create_group(f"obstacles/{k}")
                group.attrs.update(name=obstacle.name, heading=obstacle.heading)
                _save_shape(group.create_group("shape"), obstacle.shape)
                if obstacle.uncertainty is not None:
                    _save_part(group.create_group("uncertainty"), obstacle.uncertainty, UNCERTAINTIES)
                _save_trajectory(group.create_group("trajectory"), obstacle.trajectory, *span)

    @classmethod
    def load(cls, path: FilePath | str) -> "Recording":
        """Read a file written by `save`. Raises InvalidFile for any other file."""
        try:
            with h5py.File(path) as file:
                if file.attrs.get("format") not in READABLE_FORMATS:
                    found = file.attrs.get("format", "no format")
                    raise InvalidFile([f"{path}: expected a file of format {FORMAT!r}, found {found!r}"])
                return cls._from_group(file["run_0"])
        except OSError as error:
            raise InvalidFile([f"{path}: expected an HDF5 recording, found {error}"]) from None
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            # Errors of h5py and of the checks of the parts for files with missing or invalid content.
            raise InvalidFile([f"{path}: expected the content of a recording, found {error}"]) from None

    @classmethod
    def _from_group(cls, run: Any) -> "Recording":
        robots = [run[f"robots/{k}"] for k in range(len(run.get("robots", ())))]
        obstacles = [run[f"obstacles/{k}"] for k in range(len(run.get("obstacles", ())))]
        return cls(
            scenario=str(run.attrs["scenario"]),
            method=str(run.attrs["method"]),
            seed=int(run.attrs["seed"]),
            dt=float(run.attrs["time_step"]),
            parameters={name: float(value) for name, value in run["parameters"].attrs.items()},
            times=run["times"][:],
            positions=run["poses"][..., :-1],
            velocities=run["twists"][..., :-1],
            accelerations=run["accelerations"][:],
            controls=run["controls"][:],
            responses=_texts(run["responses"]),
            outcomes=_texts(run["outcomes"]),
            decision_times=run["decision_times"][:],
            shapes=tuple(_load_shape(robot["shape"]) for robot in robots),
            limits=tuple(_load_limits(robot) for robot in robots),
            goals=tuple(
                Goal(_load_part(r["goal"], TRAJECTORIES), float(r.attrs["goal_tolerance"]), bool(r.attrs["goal_stop"]))
                for r in robots
            ),
            arrived=run["arrived"][:],
            obstacles=tuple(
                Obstacle(
                    _load_shape(o["shape"]),
                    _load_part(o["trajectory"], TRAJECTORIES),
                    str(o.attrs["name"]),
                    o.attrs["heading"],
                    _load_part(o["uncertainty"], UNCERTAINTIES) if "uncertainty" in o else None,
                )
                for o in obstacles
            ),
            foresight=str(run.attrs.get("foresight", "")),
            period=tuple(float(x) for x in run.attrs["period"]) if "period" in run.attrs else None,
        )


def _load_limits(group: Any) -> Limits:
    half_spaces = (tuple(HalfSpace(row[:-1], float(row[-1])) for row in group[name][:]) for name in HALF_SPACES)
    others = tuple(_load_part(group[f"bounds/{k}"], BOUNDS) for k in range(len(group.get("bounds", ()))))
    velocity_bounds, acceleration_bounds = half_spaces
    maxima = float(group.attrs["max_speed"]), float(group.attrs["max_acceleration"])
    return Limits(*maxima, velocity_bounds, acceleration_bounds, others)


def _texts(rows: Any) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(text.decode() for text in row) for row in rows[:])


def _save_trajectory(group: Any, trajectory: Trajectory, start: float, end: float) -> None:
    """Write the kind of the trajectory and its fields; reading gives the same curve to the bit.

    A kind that is not in TRAJECTORIES (a composite, a Python function, a user's class) is saved as its cubic pieces
    over the run, within the error of its path.
    """
    if type(trajectory) not in TRAJECTORIES.values():
        first, last = max(start, trajectory.span[0]), min(end, trajectory.span[1])
        trajectory = _as_polynomial(trajectory.path(first, max(last, first + 1e-9)))
    _save_part(group, trajectory, TRAJECTORIES)


def _save_part(group: Any, part: Any, kinds: Mapping[str, type]) -> None:
    """Write the name of the part's class among `kinds`, and its fields."""
    group.attrs["kind"] = next(name for name, cls in kinds.items() if type(part) is cls)
    for item in fields(part):
        value = getattr(part, item.name)
        if isinstance(value, np.ndarray):
            group[item.name] = value
        elif value is not None:
            group.attrs[item.name] = value


def _save_shape(group: Any, shape: Shape) -> None:
    if not isinstance(shape, Union):
        _save_part(group, shape, SHAPES)
        return
    group.attrs["kind"] = "union"
    for k, part in enumerate(shape.shapes):
        _save_shape(group.create_group(str(k)), part)


def _load_shape(group: Any) -> Shape:
    if group.attrs["kind"] == "union":
        return Union(tuple(_load_shape(group[str(k)]) for k in range(len(group))))
    shape: Shape = _load_part(group, SHAPES)
    return shape


def _as_polynomial(path: Path) -> PiecewisePolynomial:
    """Convert a path to cubic pieces in ascending powers of the time since the start of each piece."""
    p0, p1, p2, p3 = (path.points[:, j] for j in range(4))
    h = np.diff(path.times)
    powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
    return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(path.times[0]))


def _load_part(group: Any, kinds: Mapping[str, type]) -> Any:
    values = {name: value for name, value in group.attrs.items() if name != "kind"}
    values.update({name: group[name][:] for name in group})
    kind = kinds[str(group.attrs["kind"])]
    known = {item.name for item in fields(kind)}
    return kind(**{name if name in known else FORMER_NAMES.get(name, name): value for name, value in values.items()})
