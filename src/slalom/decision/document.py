"""Files that hold everything from which a decision was made, as JSON; `slalom.sim.files.decision_file` reads them."""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from importlib.metadata import version
from pathlib import Path as FilePath
from typing import Any, Final

import numpy as np

from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.registry import file_keys, kind_of
from slalom.decision.decision import Commitment, Decision
from slalom.decision.methods import method
from slalom.decision.objective import OBJECTIVES
from slalom.decision.settings import Settings, names_of
from slalom.forecast.forecast import FORECASTS
from slalom.model.bounds import BOUNDS
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.response import RESPONSES
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.shape import SHAPES
from slalom.model.state import State
from slalom.model.trajectory import TRAJECTORIES
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.obstacle import Headings, Obstacle
from slalom.obstacle.horizon import HORIZONS
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks

FORMAT: Final = "slalom decision 1"
FORECAST_KINDS: Final = {name: type(forecast) for name, forecast in FORECASTS.items()}
RESPONSE_KINDS: Final = {kind.__name__: kind for kind in (*RESPONSES, AccelerationSequence)}
KINDS: Final[dict[str, Mapping[str, type]]] = {
    "shape": SHAPES,
    "trajectory": TRAJECTORIES,
    "bound": BOUNDS,
    "uncertainty": UNCERTAINTIES,
    "objective": OBJECTIVES,
    "horizons": HORIZONS,
    "forecast": FORECAST_KINDS,
    "response": RESPONSE_KINDS,
}
"""Parts that files hold, by kind and by name."""
TRACK_FIELDS: Final = ("radii", "t", "ids", "forecast", "uncertainties", "worlds", "shares", "probabilities")
"""Attributes of `Tracks` in files, besides the states."""


def dump(decision: Decision, file: FilePath) -> None:
    """Write the inputs and the result of a decision as JSON, see `Decision.dump`."""
    text = json.dumps(document(decision), indent=1, allow_nan=False)
    try:
        file.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidFile([f"{file}: expected a file that can be written, found {reason(error)}"]) from None


def document(decision: Decision) -> dict[str, Any]:
    """The inputs and the result of a decision as texts, finite numbers and lists: floats are exact."""
    made = decision.inputs
    if made is None or made.searched or made.navigator.method.looks_ahead:
        found = (
            "one without inputs"
            if made is None
            else f"one of a search with {made.navigator.method.name}, which goes on"
        )
        raise InvalidInput(f"decision: expected one that a navigator made, found {found}")
    return {
        "format": FORMAT,
        "versions": {
            **{package: version(package) for package in ("slalom", "numpy", "numba")},
            "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}",
        },
        "navigator": _navigator(made.navigator),
        "state": _state(made.state),
        "obstacles": [_source(one, f"obstacles[{k}]") for k, one in enumerate(made.obstacles)],
        "goal": None if made.goal is None else _goal(made.goal),
        "robots": None if made.robots is None else _tracks(made.robots, "robots"),
        "now": float(made.now),
        "budget": made.budget,
        "previous": None if made.previous is None else _commitment(made.previous),
        "decision": result(decision),
    }


def result(decision: Decision) -> dict[str, Any]:
    """The manoeuvre and the outcome of a decision, to the bit."""
    return {
        "outcome": decision.outcome.name,
        "response": part(decision.manoeuvre.response, "response", "response"),
        "state": _state(decision.manoeuvre.state),
        "control": decision.manoeuvre.control.tolist(),
        "start": decision.manoeuvre.start,
    }


def part(value: Any, what: str, where: str) -> dict[str, Any]:
    """The kind of a part and its fields. Raises InvalidInput for a part that no file can hold."""
    found: dict[str, Any] = {"kind": kind_of(value, KINDS[what], where)}
    for name, key in file_keys(type(value)).items():
        found[key] = _plain(getattr(value, name), what, f"{where}.{key}")
    return found


def _plain(value: Any, what: str, where: str) -> Any:
    """A number, text, list or mapping; the parts in it are of the same sort as the part that holds them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(name): _plain(one, what, where) for name, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(one, what, where) for one in value]
    return part(value, what, where) if is_dataclass(value) else value


def _navigator(navigator: Settings) -> dict[str, Any]:
    name = navigator.method.name
    if replace(method(name), shared=False, looks_ahead=False) != navigator.method:
        raise InvalidInput(f"method: expected one of the table of methods, found another one with the name {name!r}")
    horizons = navigator.horizons
    return {
        "method": name,
        "shape": part(navigator.robot, "shape", "robot"),
        "limits": _limits(navigator.limits),
        **{key: getattr(navigator, key) for key in names_of(Settings, float)},
        **{key: list(getattr(navigator, key)) for key in names_of(Settings, tuple)},
        "objective": part(navigator.objective, "objective", "objective"),
        "horizons": None if horizons is None else part(horizons, "horizons", "horizons"),
        "risk": {
            "loss": None if navigator.risk.loss == float("inf") else navigator.risk.loss,
            "likely": navigator.risk.likely,
        },
    }


def _limits(limits: Limits) -> dict[str, Any]:
    return {
        "max_speed": limits.max_speed,
        "max_acceleration": limits.max_acceleration,
        **{
            name: [{"normal": bound.normal.tolist(), "offset": bound.offset} for bound in getattr(limits, name)]
            for name in ("velocity_bounds", "acceleration_bounds")
        },
        "bounds": [part(bound, "bound", f"bounds[{k}]") for k, bound in enumerate(limits.bounds)],
    }


def _state(state: State) -> dict[str, Any]:
    vectors = {name: getattr(state, name).tolist() for name in ("position", "velocity", "acceleration")}
    return {**vectors, "heading": state.heading}


def _source(one: Obstacle | ObstacleTable | Tracks, where: str) -> dict[str, Any]:
    if isinstance(one, ObstacleTable):
        return {"table": [_obstacle(each, f"{where}[{k}]") for k, each in enumerate(one.given)]}
    return {"tracks": _tracks(one, where)} if isinstance(one, Tracks) else {"obstacle": _obstacle(one, where)}


def _obstacle(obstacle: Obstacle, where: str) -> dict[str, Any]:
    doubt = obstacle.uncertainty
    return {
        "name": obstacle.name,
        "heading": obstacle.heading.in_files if isinstance(obstacle.heading, Headings) else obstacle.heading,
        "after_end": obstacle.after_end,
        "contact_at_rest": obstacle.contact_at_rest,
        "shape": part(obstacle.shape, "shape", f"{where}.shape"),
        "trajectory": part(obstacle.trajectory, "trajectory", f"{where}.trajectory"),
        "uncertainty": None if doubt is None else part(doubt, "uncertainty", f"{where}.uncertainty"),
        "probability": obstacle.probability,
        "owner": obstacle.owner,
    }


def _tracks(tracks: Tracks, where: str) -> dict[str, Any]:
    return {
        "dimension": tracks.dimension,
        **{name: tracks.states[:, k].tolist() for k, name in enumerate(("positions", "velocities", "accelerations"))},
        "radii": tracks.radii.tolist(),
        "t": tracks.t,
        "ids": [str(name) for name in tracks.ids],
        "forecast": part(tracks.forecast, "forecast", f"{where}.forecast"),
        "uncertainties": [
            None if doubt is None else part(doubt, "uncertainty", f"{where}.uncertainties[{k}]")
            for k, doubt in enumerate(tracks.uncertainties)
        ],
        "shares": None if tracks.shares is None else tracks.shares.tolist(),
        "probabilities": None if tracks.probabilities is None else tracks.probabilities.tolist(),
    }


def _goal(goal: Goal) -> dict[str, Any]:
    ends = {"tolerance": goal.tolerance, "stop": bool(goal.stop)}
    if not isinstance(goal, PathGoal):
        return {"trajectory": part(goal.trajectory, "trajectory", "goal"), **ends}
    speeds = None if goal.speeds is None else goal.speeds.tolist()
    return {"path": {"points": goal.points.tolist(), "speeds": speeds, "lookahead": goal.lookahead}, **ends}


def _commitment(before: Commitment) -> dict[str, Any]:
    manoeuvre = before.manoeuvre
    path = before.path
    approach = before.approach
    return {
        "response": part(manoeuvre.response, "response", "previous"),
        "state": _state(manoeuvre.state),
        "control": manoeuvre.control.tolist(),
        "start": manoeuvre.start,
        "path": None if path is None else {name: getattr(path, name).tolist() for name in ("times", "points", "error")},
        "progress": before.progress,
        "approach": None if approach is None else {**approach._asdict(), "target": approach.target.tolist()},
    }
