"""Scenario files: YAML 1.2 in, every mistake at once as file:line:column."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError
from ruamel.yaml.nodes import Node

from slalom.errors import InvalidFile, InvalidInput, SlalomError
from slalom.io.tracks import read_tracks
from slalom.limits import HalfSpace, Limits
from slalom.obstacle import Obstacle
from slalom.shape import round_shape
from slalom.sim.file_mistakes import compose, dotted, message, where
from slalom.sim.scenario import SETTINGS, Robot, Scenario, whole_periods
from slalom.sim.scenario_spec import HalfSpaceSpec, ObstacleSpec, RecordingSpec, RobotSpec, ScenarioSpec, keys_at
from slalom.state import State

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)


def read_scenario(path: Path | str) -> Scenario:
    """The scenario of a YAML file.

    Raises:
        InvalidFile: with one `file:line:column: expected, found` for every mistake.
    """
    path = Path(path)
    root, content = compose(path)
    mistakes = []
    try:
        ScenarioSpec.model_validate(content)
    except ValidationError as error:
        mistakes = [message(path, root, dict(mistake), keys_at) for mistake in error.errors()]
    parts = _Parts(path, root)
    scenario = parts.assemble(content) if isinstance(content, dict) else None
    mistakes += parts.mistakes
    if mistakes or scenario is None:
        raise InvalidFile(mistakes)
    return scenario


def files_of(path: Path) -> list[Path]:
    """A scenario file that is right, and the recording that it names, if any."""
    recording = compose(path)[1].get("recording")
    return [path] if recording is None else [path, path.parent / recording["file"]]


class _Parts:
    """Puts the parts of a file together that are right by themselves, and notes which do not fit each other.

    Parts are validated one by one, so that a mistake in one does not hide that another does not fit.
    """

    def __init__(self, path: Path, root: Node | None) -> None:
        self.path, self.root = path, root
        self.mistakes: list[str] = []

    def note(self, place: tuple[str | int, ...], text: str) -> None:
        """One more mistake."""
        self.mistakes.append(f"{where(self.path, self.root, place)}: {dotted(place)}{text}")

    def attempt(self, place: tuple[str | int, ...], make: Callable[[], T]) -> T | None:
        """What `make` gives, or None and a mistake at `place`."""
        try:
            return make()
        except InvalidFile as error:
            self.mistakes.extend(error.mistakes)
        except SlalomError as error:
            # The message may begin with the name of the value, which the place says already.
            self.note(place, str(error).removeprefix(dotted(place)).removeprefix(f"{place[-1]}: "))
        return None

    def assemble(self, content: dict[str, Any]) -> Scenario | None:
        """The scenario, if everything is right."""
        given = _valid(RobotSpec, content.get("robot"))
        d = self.dimension(content.get("robot"))
        robot = self.robot(given) if given else None
        listed = content.get("obstacles", [])
        obstacles = [
            self.obstacle(k, one, d)
            for k, raw in enumerate(listed if isinstance(listed, list) else [])
            if (one := _valid(ObstacleSpec, raw)) and d
        ]
        recording = _valid(RecordingSpec, content.get("recording"))
        if recording and d:
            obstacles += self.recorded(recording, d)
        self.periods(content)
        spec = _valid(ScenarioSpec, content)
        if spec is None or robot is None or self.mistakes:
            return None
        settings = spec.model_dump(include=set(SETTINGS))
        there = tuple(obstacle for obstacle in obstacles if obstacle is not None)
        # All that a scenario can still refuse is a goal under an obstacle.
        return self.attempt(
            ("robot", "goal"),
            lambda: Scenario(spec.name or self.path.stem, (robot,), there, holds=tuple(spec.holds), **settings),
        )

    def dimension(self, robot: object) -> int | None:
        """The dimension of the robot's position, even if something else about the robot is wrong."""
        given = robot if isinstance(robot, dict) else {}
        position, velocity = (_valid_vector(given.get(name)) for name in ("position", "velocity"))
        if position and velocity and len(position) != len(velocity):
            shown = "[" + ", ".join(f"{x:g}" for x in velocity) + "]"
            self.note(
                ("robot", "velocity"),
                f"expected {len(position)} numbers, found {shown} of shape ({len(velocity)},)",
            )
        return len(position) if position else None

    def periods(self, content: dict[str, Any]) -> None:
        """The interval of decisions must be a multiple of that of steps."""
        dt, replan = content.get("dt", ScenarioSpec.model_fields["dt"].default), content.get("replan", 0.0)
        if all(isinstance(x, int | float) and np.isfinite(x) for x in (dt, replan)) and dt > 0 and replan > 0:
            try:
                whole_periods(replan, dt)
            except InvalidInput as error:
                self.note(("replan",), str(error).removeprefix("replan: "))

    def robot(self, me: RobotSpec) -> Robot | None:
        """The robot, if its parts are of one dimension."""
        d, before = len(me.position), len(self.mistakes)
        along, pushes = (
            tuple(self.bound((name, k), spec, d) for k, spec in enumerate(getattr(me, name)))
            for name in ("velocity_bounds", "acceleration_bounds")
        )
        velocity = me.velocity or [0.0] * d
        state = State(me.position, velocity) if len(velocity) == d else None
        bounds = tuple(bound.build() for bound in me.bounds)
        for k, bound in enumerate(bounds):
            # Whether it fits the dimension shows in any state.
            self.attempt(("robot", "bounds", k), partial(bound.half_spaces, State([1.0] * d, [1.0] * d)))
        limits = Limits(me.max_speed, me.max_acceleration, along, pushes, bounds)
        goal, shape = me.goal.build(), self.attempt(("robot",), lambda: me.whole_shape(d))
        if state is None or shape is None:
            return None
        robot = self.attempt(("robot", "goal"), lambda: Robot(shape, limits, state, goal))
        return robot if len(self.mistakes) == before else None

    def bound(self, place: tuple[str, int], spec: HalfSpaceSpec, d: int) -> HalfSpace:
        """A half-space of the robot's dimension."""
        if len(spec.normal) != d:
            self.note(("robot", *place, "normal"), f"expected {d} numbers, found {len(spec.normal)}")
        return spec.build()

    def obstacle(self, k: int, spec: ObstacleSpec, d: int) -> Obstacle | None:
        """An obstacle of the robot's dimension."""
        name = spec.name or f"obstacle {k}"
        shape = self.attempt(("obstacles", k), lambda: spec.whole_shape(d))
        if shape is None:
            return None
        unsure = spec.uncertainty.build() if spec.uncertainty is not None else None
        return self.attempt(
            ("obstacles", k, "trajectory"),
            lambda: Obstacle(shape, spec.trajectory.build(), name, spec.heading, unsure),
        )

    def recorded(self, spec: RecordingSpec, d: int) -> list[Obstacle | None]:
        """The agents of a recording as obstacles."""
        file = self.path.parent / spec.file
        tracks = self.attempt(("recording",), lambda: read_tracks(file, interpolation=spec.interpolation)) or {}
        shape = round_shape(spec.radius, d)
        wrong = [agent for agent, track in tracks.items() if track.dimension != d]
        if wrong:
            self.note(
                ("recording",), f"expected tracks of the robot's dimension, found {d} and {tracks[wrong[0]].dimension}"
            )
            return []
        return [Obstacle(shape, track, f"agent {agent}") for agent, track in tracks.items()]


def _valid_vector(raw: object) -> list[float] | None:
    """Two or three numbers, or None."""
    right = isinstance(raw, list) and len(raw) in (2, 3) and all(isinstance(x, int | float) for x in raw)
    return raw if right else None  # type: ignore[return-value]


def _valid(model: type[M], raw: object) -> M | None:
    """The model of a part, or None if it has mistakes of its own, which are reported with those of the whole file."""
    try:
        return model.model_validate(raw)
    except ValidationError:
        return None
