"""Reader of files of decisions, and their repetition."""

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from slalom.decision import Commitment, Decision, DecisionInputs, Outcome
from slalom.decision.approach import Approach
from slalom.decision.dump import result
from slalom.decision.futures import Risk
from slalom.decision.navigator import Navigator
from slalom.errors import InvalidFile, InvalidInput, SlalomError
from slalom.io.input_file import text_of
from slalom.io.recorded import first_of
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import method
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.path import Path as CubicPath
from slalom.sim.files.schema_decision import (
    CommitmentSpec,
    DecisionSpec,
    ManoeuvreSpec,
    NavigatorSpec,
    ObstacleSpec,
    PathSpec,
    SourceSpec,
    StateSpec,
    TracksSpec,
)
from slalom.sim.files.schema_robot import heading_of
from slalom.sim.files.yaml_errors import MAX_MISTAKES, compose, in_order, messages
from slalom.sim.scenario import unfit_times
from slalom.state import State
from slalom.tolerances import JSON_LINES


class DecisionFile(NamedTuple):
    """The inputs of a decision, and its result as it was written."""

    inputs: DecisionInputs
    written: dict[str, Any]
    versions: str  # of the packages and the machine that wrote it

    def repeat(self) -> tuple[Decision, bool]:
        """The decision, made again, and whether its result equals the written one to the bit.

        It may differ on another machine or with another version.
        """
        made = self.inputs
        before = made.previous and _decision(made.previous)
        decision = made.navigator.decide(
            made.state,
            made.obstacles,
            made.goal,
            robots=made.robots,
            now=made.now,
            previous=before,
            budget=made.budget,
        )
        return decision, result(decision) == self.written


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
        return DecisionFile(_inputs(spec), content["decision"], versions)
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


def _inputs(spec: DecisionSpec) -> DecisionInputs:
    return DecisionInputs(
        navigator=_navigator(spec.navigator),
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
        period=spec.period,
        horizon=spec.horizon,
        margin=spec.margin,
        holds=tuple(spec.holds),
        patience=spec.patience,
        objective=spec.objective.build(),
        horizons=None if spec.horizons is None else spec.horizons.build(),
        detours=tuple(spec.detours),
        stuck_after=spec.stuck_after,
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
    times, points, error = np.array(spec.times), np.array(spec.points), np.array(spec.error)
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
