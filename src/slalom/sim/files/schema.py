"""What a scenario file may say, as pydantic models: one for each mapping in it."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import HalfSpace
from slalom.methods import HOLDS
from slalom.sim.files.schema_base import Built as _Built, Model as _Model, NotNegative, Positive, Vector
from slalom.sim.files.schema_bounds import BOUND_SPECS, BoundSpec
from slalom.sim.files.schema_recording import RecordingSpec
from slalom.sim.files.schema_shapes import SHAPE_SPECS, Shaped, UncertaintySpec
from slalom.trajectory import (
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    PiecewisePolynomial,
    Sampled,
    Stationary,
    Trajectory,
)


class StationarySpec(_Built):
    """At rest."""

    kind: Literal["stationary"]
    position: Vector

    def build(self) -> Trajectory:
        return Stationary(self.position)


class ConstantVelocitySpec(_Built):
    """A straight line; position at time `at` [s]."""

    kind: Literal["constant_velocity"]
    position: Vector
    velocity: Vector
    at: FiniteFloat = 0.0

    def build(self) -> Trajectory:
        return ConstantVelocity(self.position, self.velocity, self.at)


class ConstantAccelerationSpec(_Built):
    """A parabola; position and velocity at time `at` [s]."""

    kind: Literal["constant_acceleration"]
    position: Vector
    velocity: Vector
    acceleration: Vector
    at: FiniteFloat = 0.0

    def build(self) -> Trajectory:
        return ConstantAcceleration(self.position, self.velocity, self.acceleration, self.at)


class CircularSpec(_Built):
    """A circle; `speed` > 0 is counter-clockwise, `phase` [rad] the angle at time 0."""

    kind: Literal["circular"]
    center: Vector
    radius: Positive
    speed: FiniteFloat
    phase: FiniteFloat = 0.0
    normal: Vector | None = None

    def build(self) -> Trajectory:
        return Circular(self.center, self.radius, self.speed, self.phase, self.normal)


class SampledSpec(_Built):
    """Time-stamped positions."""

    kind: Literal["sampled"]
    times: list[FiniteFloat]
    positions: list[Vector]
    interpolation: Literal["linear", "smooth"] = "smooth"

    def build(self) -> Trajectory:
        return Sampled(self.times, self.positions, self.interpolation)


class PiecewisePolynomialSpec(_Built):
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


class GoalSpec(_Built):
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


class HalfSpaceSpec(_Built):
    """normal . x <= offset."""

    normal: Vector
    offset: FiniteFloat

    def build(self) -> HalfSpace:
        return HalfSpace(self.normal, self.offset)


class RobotSpec(Shaped):
    """The robot: SI units. It keeps its orientation."""

    position: Vector
    velocity: Vector | None = None
    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: list[HalfSpaceSpec] = Field(default_factory=list)
    acceleration_bounds: list[HalfSpaceSpec] = Field(default_factory=list)
    bounds: list[BoundSpec] = Field(default_factory=list)
    goal: GoalSpec


class ObstacleSpec(Shaped):
    """A shape on a trajectory."""

    name: str = ""
    heading: FiniteFloat | Literal["motion"] = 0.0
    uncertainty: UncertaintySpec | None = None
    trajectory: TrajectorySpec


class ScenarioSpec(_Model):
    """A scenario file."""

    name: str = ""
    robot: RobotSpec
    obstacles: list[ObstacleSpec] = Field(default_factory=list)
    recording: RecordingSpec | None = None
    start: FiniteFloat = 0.0
    duration: Positive = 60.0
    dt: Positive = 0.1
    replan: NotNegative = 0.0
    horizon: Positive = 6.0
    margin: NotNegative = 0.05
    patience: NotNegative = 0.1
    holds: list[Positive] = Field(default_factory=lambda: list(HOLDS), min_length=1)
    period: Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=2, max_length=3)] | None = None


def keys_at(place: tuple[str | int, ...]) -> list[str]:
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
        **BOUND_SPECS,
        **SHAPE_SPECS,
    }
    named = [part for part in place if isinstance(part, str) and part in kinds]
    model = kinds[named[-1]] if named else ScenarioSpec
    return list(model.model_fields)
