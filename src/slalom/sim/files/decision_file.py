"""Reader of files of decisions, and their repetition."""

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, FiniteFloat, ValidationError

from slalom.base.errors import InvalidFile, InvalidInput, SlalomError
from slalom.decision import Commitment, Decision, DecisionInputs, Outcome
from slalom.decision.document import FORECAST_KINDS, FORMAT, RESPONSE_KINDS, result
from slalom.decision.inputs import Approach
from slalom.decision.methods import method
from slalom.decision.navigator import Navigator
from slalom.decision.settings import Risk, Settings
from slalom.io.recorded import first_of
from slalom.io.table import text_of
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import Path as CubicPath
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.horizon import HORIZONS
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.sim.files.parts import (
    BoundModel,
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
    model_of_settings,
)
from slalom.sim.files.schema import GoalSpec, HalfSpaceSpec, HeadingModel, heading_of, known_method
from slalom.sim.files.yaml_errors import MAX_MISTAKES, compose, in_order, messages
from slalom.sim.scenario import unfit_times

# ---------------------------------------------------------------------------------------------------------------------
# Models of the files of decisions, see `slalom.decision.document`.


Response = Annotated[PartModel, OfAnyKind(RESPONSE_KINDS)]


class LimitsSpec(Model):
    """Keys of `Limits` in the file of a decision."""

    max_speed: Positive
    max_acceleration: Positive
    velocity_bounds: list[HalfSpaceSpec]
    acceleration_bounds: list[HalfSpaceSpec]
    bounds: list[BoundModel]


_Values: Any = model_of_settings("_Values", Settings, Model, required=True)
"""Keys of `Settings` that are numbers or lists of them."""


class RiskSpec(Model):
    """See `Risk`; the loss is null without bound."""

    loss: NotNegative | None = None
    likely: NotNegative = 0.1


class NavigatorSpec(_Values):  # type: ignore[misc]  # derived
    """Keys of `Navigator` in the file of a decision."""

    method: Annotated[str, AfterValidator(known_method)]
    shape: ShapeModel
    limits: LimitsSpec
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
    """Keys of `slalom.model.path.Path` in the file of a decision."""

    times: Annotated[list[FiniteFloat], Field(min_length=2)]
    points: list[Annotated[list[Vector], Field(min_length=4, max_length=4)]]
    error: list[NotNegative]


class ApproachSpec(Model):
    """Keys of `slalom.decision.decision.Approach` in the file of a decision."""

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


# ---------------------------------------------------------------------------------------------------------------------
# Reader of files of decisions, and their repetition.


JSON_LINES: Final = 200_000
"""[B] Size of the file of a decision up to which a reader of YAML finds the lines of mistakes.

Larger: it takes seconds to refuse a large file. Smaller: messages of more files name line 1.
"""


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
        navigator = _navigator(spec.navigator)
        return DecisionFile(navigator, _inputs(spec, navigator), content["decision"], versions)
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


def _inputs(spec: DecisionSpec, navigator: Navigator) -> DecisionInputs:
    return DecisionInputs(
        navigator=navigator,
        state=_state(spec.state),
        obstacles=tuple(_source(one, f"obstacles[{k}]") for k, one in enumerate(spec.obstacles)),
        goal=None if spec.goal is None else spec.goal.build(),
        robots=None if spec.robots is None else _tracks(spec.robots),
        now=spec.now,
        budget=spec.budget,
        previous=None if spec.previous is None else _commitment(spec.previous),
    )


def _navigator(spec: NavigatorSpec) -> Navigator:
    for name, mistake in unfit_times(spec.horizon, spec.period, 0.0, spec.horizon, spec.holds):
        raise InvalidInput(f"navigator.{'period' if name == 'duration' else name}: {mistake}")
    return Navigator(
        replace(method(spec.method), shared=False, looks_ahead=False),
        spec.shape.build(),
        Limits(
            spec.limits.max_speed,
            spec.limits.max_acceleration,
            tuple(bound.build() for bound in spec.limits.velocity_bounds),
            tuple(bound.build() for bound in spec.limits.acceleration_bounds),
            tuple(bound.build() for bound in spec.limits.bounds),
        ),
        **{name: getattr(spec, name) for name in _Values.model_fields},
        objective=spec.objective.build(),
        horizons=None if spec.horizons is None else spec.horizons.build(),
        risk=Risk(np.inf if spec.risk.loss is None else spec.risk.loss, spec.risk.likely),
    )


def _state(spec: StateSpec) -> State:
    return State(spec.position, spec.velocity, spec.acceleration, spec.heading)


def _source(spec: SourceSpec, where: str) -> Obstacle | ObstacleTable | Tracks:
    given = {name: value for name in ("obstacle", "table", "tracks") if (value := getattr(spec, name)) is not None}
    if len(given) != 1:
        raise InvalidInput(f"{where}: expected one of obstacle, table, tracks; found {' and '.join(given) or 'none'}")
    if spec.table is not None:
        return ObstacleTable([_obstacle(one) for one in spec.table])
    return _tracks(spec.tracks) if spec.tracks is not None else _obstacle(given["obstacle"])


def _obstacle(spec: ObstacleSpec) -> Obstacle:
    doubt = spec.uncertainty
    return Obstacle(
        spec.shape.build(),
        spec.trajectory.build(),
        spec.name,
        heading_of(spec.heading),
        None if doubt is None else doubt.build(),
        spec.after_end,
        spec.contact_at_rest,
        probability=spec.probability,
        owner=spec.owner,
    )


def _tracks(spec: TracksSpec) -> Tracks:
    rows = partial(_rows, dimension=spec.dimension)
    return Tracks(
        rows(spec.positions),
        rows(spec.velocities),
        spec.radii,
        spec.t,
        accelerations=rows(spec.accelerations),
        ids=spec.ids,
        forecast=spec.forecast.build(),
        uncertainty=[None if doubt is None else doubt.build() for doubt in spec.uncertainties],
        shares=spec.shares,
        probabilities=spec.probabilities,
    )


def _rows(rows: Sequence[Sequence[float]], dimension: int) -> Any:
    return np.array(rows) if rows else np.empty((0, dimension))


def _manoeuvre(spec: ManoeuvreSpec) -> Manoeuvre:
    return Manoeuvre(spec.response.build(), _state(spec.state), spec.control, spec.start)


def _commitment(spec: CommitmentSpec) -> Commitment:
    approach = spec.approach
    return Commitment(
        _manoeuvre(spec),
        None if spec.path is None else _path(spec.path, len(spec.control)),
        spec.progress,
        None if approach is None else Approach(approach.distance, approach.since, np.array(approach.target)),
    )


def _path(spec: PathSpec, dimension: int) -> CubicPath:
    times = np.array(spec.times)
    points = np.array(spec.points)
    error = np.array(spec.error)
    n = len(times) - 1
    if points.shape != (n, 4, dimension) or error.shape != (n,) or np.any(np.diff(times) <= 0.0):
        raise InvalidInput(
            f"previous.path: expected increasing times and {n} pieces of dimension {dimension}, "
            f"found shapes {points.shape} and {error.shape}"
        )
    return CubicPath(times, points, error)


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
