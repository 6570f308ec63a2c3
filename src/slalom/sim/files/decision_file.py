"""Reader of files of decisions, and their repetition."""

import json
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, FiniteFloat, ValidationError

from slalom.base.errors import InvalidFile, InvalidInput, SlalomError
from slalom.decision import Commitment, Decision, DecisionInputs, Outcome
from slalom.decision.decision import Approach
from slalom.decision.document import FORECAST_KINDS, FORMAT, RESPONSE_KINDS, result
from slalom.decision.methods import VARIANTS, derived
from slalom.decision.navigator import Navigator
from slalom.decision.settings import HORIZONS, Risk, Settings
from slalom.io.recorded import first_of
from slalom.io.table import text_of
from slalom.io.yaml_nodes import MAX_MISTAKES, compose
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import Path as CubicPath
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.sim.files.parts import (
    BoundModel,
    Built,
    Model,
    NotNegative,
    ObjectiveModel,
    OfAnyKind,
    PartModel,
    Positive,
    ShapeModel,
    TrajectoryModel,
    UncertaintyModel,
    Vector,
    built,
    model_of_settings,
)
from slalom.sim.files.schema import GoalSpec, HalfSpaceSpec, HeadingModel, known_method
from slalom.sim.files.yaml_errors import in_order, messages
from slalom.sim.scenario import unfit_times

# Models of the files of decisions, see `slalom.decision.document`.


Response = Annotated[PartModel, OfAnyKind(RESPONSE_KINDS)]


class LimitsSpec(PartModel):
    """Keys of `Limits` in the file of a decision."""

    part = Limits
    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: list[HalfSpaceSpec]
    acceleration_bounds: list[HalfSpaceSpec]
    bounds: list[BoundModel]


class RiskSpec(Built):
    """See `Risk`; the loss is null without bound."""

    loss: NotNegative | None = None
    likely: NotNegative = 0.1

    def build(self) -> Risk:
        return Risk(np.inf if self.loss is None else self.loss, self.likely)


_Values: Any = model_of_settings("_Values", Settings, Model, required=True)
"""Keys of `Settings` that are numbers or lists of them."""


class NavigatorSpec(_Values):  # type: ignore[misc]  # derived
    """Keys of `Navigator` in the file of a decision."""

    method: Annotated[str, AfterValidator(known_method)]
    variant: Literal[tuple(VARIANTS)] | None = None  # type: ignore[valid-type]  # a constant
    shape: ShapeModel
    limits: LimitsSpec
    objective: ObjectiveModel
    horizons: Annotated[PartModel, OfAnyKind(HORIZONS)] | None
    risk: RiskSpec = Field(default_factory=RiskSpec)

    def navigator(self) -> Navigator:
        """The navigator. Raises InvalidInput for times that do not fit each other."""
        for name, mistake in unfit_times(self.horizon, self.period, 0.0, self.horizon, self.holds):
            raise InvalidInput(f"navigator.{'period' if name == 'duration' else name}: {mistake}")
        values = {key: built(value) for key, value in self if key not in ("method", "variant", "shape")}
        return Navigator(derived(self.method, self.variant), built(self.shape), **values)


class StateSpec(PartModel):
    """Keys of `State` in the file of a decision."""

    part = State
    position: Vector
    velocity: Vector
    acceleration: Vector
    heading: FiniteFloat | None


class ObstacleSpec(PartModel):
    """Keys of `Obstacle` in the file of a decision."""

    part = Obstacle
    name: str
    heading: HeadingModel
    after_end: Literal["unknown", "continues", "leaves"]
    shape: ShapeModel
    trajectory: TrajectoryModel
    uncertainty: UncertaintyModel | None
    contact_at_rest: bool = True
    probability: Positive = 1.0
    owner: str = ""


class TracksSpec(Built):
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
    braking: list[NotNegative] | None = None
    probabilities: list[Positive] | None = None
    contact_at_rest: bool = True

    def build(self) -> Tracks:
        values = {key: built(value) for key, value in self if key not in ("dimension", "uncertainties")}
        for name in ("positions", "velocities", "accelerations"):
            values[name] = values[name] or np.empty((0, self.dimension))
        return Tracks(**values, uncertainty=built(self.uncertainties))


class SourceSpec(Built):
    """An obstacle, a table of obstacles, or tracks."""

    obstacle: ObstacleSpec | None = None
    table: list[ObstacleSpec] | None = None
    tracks: TracksSpec | None = None

    def build(self) -> Obstacle | ObstacleTable | Tracks:
        given = {name: value for name, value in self if value is not None}
        if len(given) != 1:
            found = " and ".join(given) or "none"
            raise InvalidInput(f"expected one of obstacle, table, tracks; found {found}")
        found = built(*given.values())
        return ObstacleTable(found) if self.table is not None else found


class ManoeuvreSpec(PartModel):
    """Keys of `Manoeuvre` in the file of a decision."""

    part = Manoeuvre
    response: Response
    state: StateSpec
    control: Vector
    start: FiniteFloat


class PathSpec(Built):
    """Keys of `slalom.model.path.Path` in the file of a decision."""

    times: Annotated[list[FiniteFloat], Field(min_length=2)]
    points: list[Annotated[list[Vector], Field(min_length=4, max_length=4)]]
    error: list[NotNegative]

    def build(self) -> CubicPath:
        times = np.array(self.times)
        points = np.array(self.points)
        error = np.array(self.error)
        n = len(times) - 1
        if points.shape[:2] != (n, 4) or error.shape != (n,) or np.any(np.diff(times) <= 0.0):
            raise InvalidInput(
                f"expected increasing times and {n} pieces, found shapes {points.shape} and {error.shape}"
            )
        return CubicPath(times, points, error)


class ApproachSpec(Model):
    """Keys of `Approach` in the file of a decision."""

    distance: NotNegative
    since: FiniteFloat
    target: Vector
    pace: FiniteFloat | None = None
    paced: FiniteFloat | None = None

    def build(self) -> Approach:
        """A file without pace is of a robot that is not held up."""
        pace = np.inf if self.pace is None else self.pace
        paced = np.inf if self.paced is None else self.paced
        return Approach(self.distance, self.since, np.array(self.target), pace, paced)


class CommitmentSpec(ManoeuvreSpec):
    """Keys of `Commitment` in the file of a decision."""

    path: PathSpec | None
    progress: NotNegative | None
    approach: ApproachSpec | None

    def build(self) -> Commitment:
        path, approach = built(self.path), self.approach
        if path is not None and path.points.shape[2] != len(self.control):
            raise InvalidInput(f"path: expected dimension {len(self.control)}, found {path.points.shape[2]}")
        return Commitment(super().build(), path, self.progress, None if approach is None else approach.build())


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

    def inputs(self, navigator: Navigator) -> DecisionInputs:
        """The inputs of the decision, with the navigator of the file."""
        values = {key: built(value) for key, value in self if key in DecisionInputs._fields}
        return DecisionInputs(**values | {"navigator": navigator})


JSON_LINES: Final = 200_000
"""[B] Size of the file of a decision up to which a reader of YAML finds the lines of mistakes. Larger: it takes seconds
to refuse a large file. Smaller: messages of more files name line 1."""


class DecisionFile(NamedTuple):
    """The inputs of a decision, and its result as it was written."""

    navigator: Navigator
    inputs: DecisionInputs
    written: dict[str, Any]
    versions: str  # of the packages and the machine that wrote it

    def repeat(self) -> tuple[Decision, bool]:
        """The decision, made again, and whether its result equals the written one to the bit.

        It may differ on another machine or with another version.
        """
        made = self.inputs
        before = made.previous and _decision(made.previous)
        decision = self.navigator.decide(
            made.state,
            made.obstacles,
            made.goal,
            robots=made.robots,
            now=made.now,
            previous=before,
            budget=made.budget,
        )
        return decision, result(decision.outcome.name, decision.manoeuvre) == self.written


def read_decision(path: Path | str) -> DecisionFile:
    """Return the content of a file that `Decision.dump` wrote.

    Raises:
        InvalidFile: one line for each mistake, `file:line:column: KEY: expected ..., found ...`.
    """
    path = Path(path)
    content = _json(path)
    try:
        spec = DecisionSpec.model_validate(content)
    except ValidationError:
        # JSON is YAML: the reader of YAML is slow, and gives the lines of mistakes.
        root = compose(path)[0] if path.stat().st_size < JSON_LINES else None
        mistakes = in_order(path, messages(path, root, content, DecisionSpec))
        raise InvalidFile(first_of(path, mistakes, MAX_MISTAKES)) from None
    try:
        versions = ", ".join(f"{name} {version}" for name, version in spec.versions.items())
        navigator = spec.navigator.navigator()
        return DecisionFile(navigator, spec.inputs(navigator), content["decision"], versions)
    except SlalomError as error:
        raise InvalidFile([f"{path}: {error}"]) from None


def _json(path: Path) -> Any:
    """The content of a JSON file."""
    text = text_of(path, "JSON file")
    try:
        return json.loads(text)
    except RecursionError:
        raise InvalidFile([f"{path}: expected JSON that can be read, found one nested too deeply"]) from None
    except ValueError as error:
        raise InvalidFile([f"{path}: expected JSON, found a mistake: {error}"]) from None


def _decision(before: Commitment) -> Decision:
    """The decision before, as far as the next one depends on it."""
    return Decision(
        before.manoeuvre,
        Outcome.KEPT,
        before.manoeuvre.control,
        _no_control_obstacle,
        before.path,
        before.progress,
        approach=before.approach,
    )


def _no_control_obstacle() -> Any:
    raise InvalidInput("blocked: expected a decision that was made, found one read from a file")
