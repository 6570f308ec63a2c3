"""Files that hold everything from which a decision was made, as JSON; `slalom.sim.files.decision_file` reads them."""

import json
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path as FilePath
from typing import Any, Final

from slalom.base.errors import InvalidInput
from slalom.base.registry import Tables, to_plain
from slalom.base.writing import write_file
from slalom.decision.decision import Commitment, DecisionInputs
from slalom.decision.methods import variant_of
from slalom.decision.objective import OBJECTIVES
from slalom.decision.settings import HORIZONS, Settings, names_of
from slalom.forecast.forecast import FORECASTS
from slalom.model.bounds import BOUNDS, Bound
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.response import RESPONSES, Response
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.shape import SHAPES, Shape
from slalom.model.trajectory import TRAJECTORIES, Trajectory
from slalom.model.uncertainty import UNCERTAINTIES, Uncertainty
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks

FORMAT: Final = "slalom decision 1"
FORECAST_KINDS: Final = {name: type(forecast) for name, forecast in FORECASTS.items()}
RESPONSE_KINDS: Final = {kind.__name__: kind for kind in (*RESPONSES, AccelerationSequence)}
TABLES: Final[Tables] = {
    Shape: SHAPES,
    Trajectory: TRAJECTORIES,
    Bound: BOUNDS,
    Uncertainty: UNCERTAINTIES,
    Response: RESPONSE_KINDS,
}
"""Tables of parts by their protocol."""
OBSTACLE_KEYS: Final = (
    *("name", "heading", "after_end", "contact_at_rest", "shape", "trajectory", "uncertainty", "probability", "owner"),
)
"""Keys of an obstacle in their order in files."""
TRACK_FIELDS: Final = (
    *("radii", "t", "ids", "forecast", "uncertainties", "worlds", "shares", "braking", "probabilities"),
    "contact_at_rest",
)
"""Attributes of `Tracks` in files, besides the states."""


def dump(made: DecisionInputs | None, outcome: str, manoeuvre: Manoeuvre, file: FilePath) -> None:
    """Write the inputs and the result of a decision as JSON, see `Decision.dump`."""
    write_file(file, json.dumps(document(made, outcome, manoeuvre), indent=1, allow_nan=False) + "\n")


def document(made: DecisionInputs | None, outcome: str, manoeuvre: Manoeuvre) -> dict[str, Any]:
    """The inputs and the result of a decision as texts, finite numbers and lists: floats are exact."""
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
        "state": to_plain(made.state),
        "obstacles": [_source(one, f"obstacles[{k}]") for k, one in enumerate(made.obstacles)],
        "goal": None if made.goal is None else goal_to_plain(made.goal, "goal"),
        "robots": None if made.robots is None else _tracks(made.robots, "robots"),
        "now": float(made.now),
        "budget": made.budget,
        "previous": None if made.previous is None else _commitment(made.previous),
        "decision": result(outcome, manoeuvre),
    }


def result(outcome: str, manoeuvre: Manoeuvre) -> dict[str, Any]:
    """The name of the outcome and the manoeuvre of a decision, to the bit."""
    return {"outcome": outcome, **to_plain(manoeuvre, where="decision", tables=TABLES)}


def _named(value: Any, names: tuple[str, ...]) -> dict[str, Any]:
    """Attributes that are numbers, texts or arrays, by name."""
    return {name: to_plain(getattr(value, name)) for name in names}


def _optional(part: Any, kinds: Mapping[str, type], where: str) -> dict[str, Any] | None:
    return None if part is None else to_plain(part, kinds, where)


def _navigator(navigator: Settings) -> dict[str, Any]:
    loss, likely = navigator.risk.loss, navigator.risk.likely
    return {
        "method": navigator.method.name,
        "variant": variant_of(navigator.method),
        "shape": to_plain(navigator.robot, SHAPES, "robot"),
        "limits": to_plain(navigator.limits, tables=TABLES),
        **_named(navigator, (*names_of(Settings, float), *names_of(Settings, tuple))),
        "objective": to_plain(navigator.objective, OBJECTIVES, "objective"),
        "horizons": _optional(navigator.horizons, HORIZONS, "horizons"),
        "risk": {"loss": None if loss == float("inf") else loss, "likely": likely},
    }


def goal_to_plain(goal: Goal, where: str) -> dict[str, Any]:
    """A goal with the keys of files: its path or its trajectory, and its end."""
    ends = {"tolerance": goal.tolerance, "stop": bool(goal.stop)}
    if isinstance(goal, PathGoal):
        return {"path": _named(goal, ("points", "speeds", "lookahead")), **ends}
    return {"trajectory": to_plain(goal.trajectory, TRAJECTORIES, where), **ends}


def _source(one: Obstacle | ObstacleTable | Tracks, where: str) -> dict[str, Any]:
    if isinstance(one, ObstacleTable):
        return {"table": [_obstacle(each, f"{where}[{k}]") for k, each in enumerate(one.given)]}
    return {"tracks": _tracks(one, where)} if isinstance(one, Tracks) else {"obstacle": _obstacle(one, where)}


def _obstacle(obstacle: Obstacle, where: str) -> dict[str, Any]:
    found = to_plain(obstacle, where=where, tables=TABLES)
    return {key: found[key] for key in OBSTACLE_KEYS}


def _tracks(tracks: Tracks, where: str) -> dict[str, Any]:
    return {
        "dimension": tracks.dimension,
        **{name: tracks.states[:, k].tolist() for k, name in enumerate(("positions", "velocities", "accelerations"))},
        **_named(tracks, ("radii", "t")),
        "ids": [str(name) for name in tracks.ids],
        "forecast": to_plain(tracks.forecast, FORECAST_KINDS, f"{where}.forecast"),
        "uncertainties": [
            _optional(doubt, UNCERTAINTIES, f"{where}.uncertainties[{k}]")
            for k, doubt in enumerate(tracks.uncertainties)
        ],
        **_named(tracks, ("shares", "braking", "probabilities")),
    }


def _commitment(before: Commitment) -> dict[str, Any]:
    return {
        **to_plain(before.manoeuvre, where="previous", tables=TABLES),
        "path": to_plain(before.path),
        "progress": before.progress,
        "approach": to_plain(before.approach),
    }
