"""Models of the files of decisions, see `slalom.decision.dump`."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, FiniteFloat

from slalom.decision.dump import FORECAST_KINDS, FORMAT, RESPONSE_KINDS
from slalom.obstacle.horizon import HORIZONS
from slalom.sim.files.schema_base import Model, NotNegative, Positive, Vector
from slalom.sim.files.schema_parts import (
    BoundModel,
    ObjectiveModel,
    OfAnyKind,
    PartModel,
    ShapeModel,
    TrajectoryModel,
    UncertaintyModel,
)
from slalom.sim.files.schema_robot import GoalSpec, HalfSpaceSpec, HeadingModel, known_method

Response = Annotated[PartModel, OfAnyKind(RESPONSE_KINDS)]


class LimitsSpec(Model):
    """Keys of `Limits` in the file of a decision."""

    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: list[HalfSpaceSpec]
    acceleration_bounds: list[HalfSpaceSpec]
    bounds: list[BoundModel]


class RiskSpec(Model):
    """See `Risk`; the loss is null without bound."""

    loss: NotNegative | None = None
    likely: NotNegative = 0.1


class NavigatorSpec(Model):
    """Keys of `Navigator` in the file of a decision."""

    method: Annotated[str, AfterValidator(known_method)]
    shape: ShapeModel
    limits: LimitsSpec
    period: Positive
    horizon: Positive
    margin: NotNegative
    patience: NotNegative
    stuck_after: Positive
    holds: Annotated[list[Positive], Field(min_length=1)]
    detours: list[FiniteFloat]
    objective: ObjectiveModel
    horizons: Annotated[PartModel, OfAnyKind(HORIZONS)] | None
    risk: RiskSpec = Field(default_factory=RiskSpec)


class StateSpec(Model):
    """Keys of `State` in the file of a decision."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    heading: FiniteFloat | None


class ObstacleSpec(Model):
    """Keys of `Obstacle` in the file of a decision."""

    name: str
    heading: HeadingModel
    after_end: Literal["unknown", "continues", "leaves"]
    shape: ShapeModel
    trajectory: TrajectoryModel
    uncertainty: UncertaintyModel | None
    contact_at_rest: bool = True
    probability: Positive = 1.0
    owner: str = ""


class TracksSpec(Model):
    """Keys of `Tracks` in the file of a decision."""

    dimension: Literal[2, 3]
    positions: list[Vector]
    velocities: list[Vector]
    accelerations: list[Vector]
    radii: list[NotNegative]
    t: FiniteFloat
    ids: list[str]
    forecast: Annotated[PartModel, OfAnyKind(FORECAST_KINDS)]
    uncertainties: list[UncertaintyModel | None]
    shares: list[NotNegative] | None = None
    probabilities: list[Positive] | None = None


class SourceSpec(Model):
    """An obstacle, a table of obstacles, or tracks."""

    obstacle: ObstacleSpec | None = None
    table: list[ObstacleSpec] | None = None
    tracks: TracksSpec | None = None


class ManoeuvreSpec(Model):
    """Keys of `Manoeuvre` in the file of a decision."""

    response: Response
    state: StateSpec
    control: Vector
    start: FiniteFloat


class PathSpec(Model):
    """Keys of `slalom.path.Path` in the file of a decision."""

    times: Annotated[list[FiniteFloat], Field(min_length=2)]
    points: list[Annotated[list[Vector], Field(min_length=4, max_length=4)]]
    error: list[NotNegative]


class ApproachSpec(Model):
    """Keys of `slalom.decision.approach.Approach` in the file of a decision."""

    distance: NotNegative
    since: FiniteFloat
    target: Vector


class CommitmentSpec(ManoeuvreSpec):
    """Keys of `slalom.decision.Commitment` in the file of a decision."""

    path: PathSpec | None
    progress: NotNegative | None
    approach: ApproachSpec | None


class ResultSpec(ManoeuvreSpec):
    """The result of the decision that was written."""

    outcome: str


class DecisionSpec(Model):
    """A file of a decision."""

    format: Literal[FORMAT]  # type: ignore[valid-type]  # a constant
    versions: dict[str, str]
    navigator: NavigatorSpec
    state: StateSpec
    obstacles: list[SourceSpec]
    goal: GoalSpec | None
    robots: TracksSpec | None
    now: FiniteFloat
    budget: NotNegative | None
    previous: CommitmentSpec | None
    decision: ResultSpec
