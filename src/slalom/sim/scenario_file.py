"""Scenario files: YAML 1.2 in, every mistake at once as file:line:column."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.nodes import Node

from slalom.errors import InvalidFile, InvalidInput, SlalomError
from slalom.goal import Goal
from slalom.io.tracks import read_tracks
from slalom.limits import HalfSpace, Limits
from slalom.methods import HOLDS
from slalom.obstacle import Obstacle
from slalom.shape import round_shape
from slalom.sim.file_mistakes import dotted, message, where
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import (
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    PiecewisePolynomial,
    Sampled,
    Stationary,
    Trajectory,
)

Vector = Annotated[list[FiniteFloat], Field(min_length=2, max_length=3)]
Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]
T = TypeVar("T")


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=False)


class StationarySpec(_Model):
    """At rest."""

    kind: Literal["stationary"]
    position: Vector

    def build(self) -> Trajectory:
        return Stationary(self.position)


class ConstantVelocitySpec(_Model):
    """A straight line; position at time `at` [s]."""

    kind: Literal["constant_velocity"]
    position: Vector
    velocity: Vector
    at: FiniteFloat = 0.0

    def build(self) -> Trajectory:
        return ConstantVelocity(self.position, self.velocity, self.at)


class ConstantAccelerationSpec(_Model):
    """A parabola; position and velocity at time `at` [s]."""

    kind: Literal["constant_acceleration"]
    position: Vector
    velocity: Vector
    acceleration: Vector
    at: FiniteFloat = 0.0

    def build(self) -> Trajectory:
        return ConstantAcceleration(self.position, self.velocity, self.acceleration, self.at)


class CircularSpec(_Model):
    """A circle; `speed` > 0 is counter-clockwise, `phase` [rad] the angle at time 0."""

    kind: Literal["circular"]
    center: Vector
    radius: Positive
    speed: FiniteFloat
    phase: FiniteFloat = 0.0
    normal: Vector | None = None

    def build(self) -> Trajectory:
        return Circular(self.center, self.radius, self.speed, self.phase, self.normal)


class SampledSpec(_Model):
    """Time-stamped positions."""

    kind: Literal["sampled"]
    times: list[FiniteFloat]
    positions: list[Vector]
    interpolation: Literal["linear", "smooth"] = "smooth"

    def build(self) -> Trajectory:
        return Sampled(self.times, self.positions, self.interpolation)


class PiecewisePolynomialSpec(_Model):
    """Polynomials in pieces: coefficients[piece][power] is a vector."""

    kind: Literal["piecewise_polynomial"]
    durations: list[FiniteFloat]
    coefficients: list[list[Vector]]
    start: FiniteFloat = 0.0

    def build(self) -> Trajectory:
        return PiecewisePolynomial(self.durations, self.coefficients, self.start)


TrajectorySpec = Annotated[
    StationarySpec
    | ConstantVelocitySpec
    | ConstantAccelerationSpec
    | CircularSpec
    | SampledSpec
    | PiecewisePolynomialSpec,
    Field(discriminator="kind"),
]


class GoalSpec(_Model):
    """Where to be: a place or a moving one."""

    position: Vector | None = None
    trajectory: TrajectorySpec | None = None
    tolerance: Positive = 0.5
    stop: bool = False

    def build(self) -> Goal:
        if self.trajectory is not None and self.position is None:
            return Goal(self.trajectory.build(), self.tolerance, self.stop)
        if self.position is not None and self.trajectory is None:
            return Goal(Stationary(self.position), self.tolerance, self.stop)
        found = "neither" if self.position is None else "both"
        raise InvalidInput(f"expected either position or trajectory, found {found}")


class HalfSpaceSpec(_Model):
    """normal . x <= offset."""

    normal: Vector
    offset: FiniteFloat

    def build(self) -> HalfSpace:
        return HalfSpace(self.normal, self.offset)


class RobotSpec(_Model):
    """The robot: SI units."""

    position: Vector
    velocity: Vector | None = None
    radius: NotNegative
    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: list[HalfSpaceSpec] = []
    acceleration_bounds: list[HalfSpaceSpec] = []
    goal: GoalSpec


class ObstacleSpec(_Model):
    """A disc (in space a ball) on a trajectory."""

    name: str = ""
    radius: NotNegative
    trajectory: TrajectorySpec


class RecordingSpec(_Model):
    """Recorded agents as obstacles: a CSV file with a header t,id,x,y[,z], beside the scenario file."""

    file: str
    radius: NotNegative
    interpolation: Literal["linear", "smooth"] = "smooth"


class ScenarioSpec(_Model):
    """A scenario file."""

    name: str = ""
    robot: RobotSpec
    obstacles: list[ObstacleSpec] = []
    recording: RecordingSpec | None = None
    start: FiniteFloat = 0.0
    duration: Positive = 60.0
    dt: Positive = 0.1
    replan: NotNegative = 0.0
    horizon: Positive = 6.0
    margin: NotNegative = 0.05
    patience: NotNegative = 0.1
    holds: Annotated[list[Positive], Field(min_length=1)] = list(HOLDS)


def read_scenario(path: Path | str) -> Scenario:
    """The scenario of a YAML file.

    Raises:
        InvalidFile: with one `file:line:column: expected, found` for every mistake.
    """
    path = Path(path)
    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile([f"{path}: expected a readable YAML file, found {error}"]) from None
    try:
        root = YAML(typ="safe").compose(text)
        content = YAML(typ="safe").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else str(path)
        raise InvalidFile([f"{where}: expected YAML, found a mistake: {error.problem or error.context}"]) from None
    try:
        spec = ScenarioSpec.model_validate(content)
    except ValidationError as error:
        mistakes = [message(path, root, dict(mistake), _allowed) for mistake in error.errors()]
        raise InvalidFile(mistakes) from None
    return _build(spec, path, root)


def _build(spec: ScenarioSpec, path: Path, root: Node) -> Scenario:
    """The scenario; what the values refuse is reported with the place in the file, all at once."""
    mistakes: list[str] = []

    def at(place: tuple[str | int, ...], make: Callable[[], T]) -> T | None:
        try:
            return make()
        except InvalidFile as error:
            mistakes.extend(error.mistakes)
        except SlalomError as error:
            mistakes.append(f"{where(path, root, place)}: {dotted(place)}{error}")
        return None

    me = spec.robot
    state = at(("robot",), lambda: State(me.position, me.velocity or [0.0] * len(me.position)))
    goal = at(("robot", "goal"), me.goal.build)
    limits = at(
        ("robot",),
        lambda: Limits(
            me.max_speed,
            me.max_acceleration,
            tuple(bound.build() for bound in me.velocity_bounds),
            tuple(bound.build() for bound in me.acceleration_bounds),
        ),
    )
    d = len(me.position)
    obstacles = [
        at(
            ("obstacles", k, "trajectory"),
            lambda o=o, k=k: Obstacle(round_shape(o.radius, d), o.trajectory.build(), o.name or f"obstacle {k}"),  # type: ignore[misc]
        )
        for k, o in enumerate(spec.obstacles)
    ]
    if spec.recording is not None:
        recorded = spec.recording
        tracks = at(
            ("recording",), lambda: read_tracks(path.parent / recorded.file, interpolation=recorded.interpolation)
        )
        shape = round_shape(recorded.radius, d)
        for agent, track in (tracks or {}).items():
            obstacles.append(at(("recording",), lambda t=track, a=agent: Obstacle(shape, t, f"agent {a}")))  # type: ignore[misc]
    if not mistakes:
        assert state is not None
        assert goal is not None
        assert limits is not None
        settings = spec.model_dump(include={"start", "duration", "dt", "replan", "horizon", "margin", "patience"})
        scenario = at(
            ("robot",),
            lambda: Scenario(
                spec.name or path.stem,
                Robot(round_shape(me.radius, d), limits, state, goal),
                tuple(o for o in obstacles if o is not None),
                holds=tuple(spec.holds),
                **settings,
            ),
        )
        if scenario is not None:
            return scenario
    raise InvalidFile(mistakes)


def _allowed(place: tuple[str | int, ...]) -> list[str]:
    """The keys that the model at `place` knows."""
    kinds: dict[str, type[_Model]] = {
        "stationary": StationarySpec,
        "constant_velocity": ConstantVelocitySpec,
        "constant_acceleration": ConstantAccelerationSpec,
        "circular": CircularSpec,
        "sampled": SampledSpec,
        "piecewise_polynomial": PiecewisePolynomialSpec,
        "goal": GoalSpec,
        "robot": RobotSpec,
        "obstacles": ObstacleSpec,
        "recording": RecordingSpec,
        "velocity_bounds": HalfSpaceSpec,
        "acceleration_bounds": HalfSpaceSpec,
    }
    named = [part for part in place if isinstance(part, str) and part in kinds]
    model = kinds[named[-1]] if named else ScenarioSpec
    return list(model.model_fields)
