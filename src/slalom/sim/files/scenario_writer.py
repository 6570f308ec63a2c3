"""Writer of scenario files: the scenario as YAML that `read_scenario` reads back, equal to the bit."""

import io
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from slalom.base.errors import InvalidInput
from slalom.base.registry import to_plain
from slalom.base.writing import write_file
from slalom.decision.document import TABLES, goal_to_plain
from slalom.decision.methods import method
from slalom.decision.objective import OBJECTIVES
from slalom.decision.settings import NUMBERS, SharedSettings
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.shape import SHAPES
from slalom.model.state import State
from slalom.model.trajectory import TRAJECTORIES, Composite, ConstantVelocity, Trajectory
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.obstacle import Obstacle
from slalom.sim.measure.hdf5 import in_files
from slalom.sim.scenario import Robot, Scenario, numbers_of

WRITTEN = (*(each.name for each in fields(SharedSettings)), "name", "robots", "obstacles", "start", "duration", "dt")
WRITTEN += ("replan", "guided", "early", "sight", "tasks")
"""Fields of scenarios in files."""
ORIGIN = ("parameters", "recorded", "notes")
"""Fields that say where a scenario comes from; no run depends on them, and files do not hold them."""
NOT_IN_FILES: dict[type, dict[str, Any]] = {
    Scenario: {e.name: e.default for e in fields(Scenario) if e.name not in (*WRITTEN, *ORIGIN)},
    State: {"acceleration": 0.0, "heading": None},
    Goal: {"heading": None, "heading_tolerance": Goal.heading_tolerance},
    Obstacle: {"probability": 1.0},
}
"""Fields that scenario files cannot hold, with the values that they have for them."""


def write_scenario(scenario: Scenario, path: Path | str) -> None:
    """Write a scenario file, see `scenario_text`."""
    write_file(path, scenario_text(scenario))


def scenario_text(scenario: Scenario, *, ascii_only: bool = False) -> str:
    """Return a scenario as YAML; with `ascii_only` other characters are escape sequences in double quotes.

    A trajectory that files cannot hold (a composite, a Python function) is written as cubic pieces over the run and one
    horizon. They are within the error of its path.

    Files do not hold the fields ORIGIN.

    Raises:
        InvalidInput: a field with a value that files cannot hold, a part of a kind that is in no registry.
    """
    _refuse_lost(scenario, Scenario)
    content: dict[str, Any] = {"name": scenario.name}
    numbers = dict.fromkeys(("start", "duration", "dt", "horizon", "margin", "replan", *NUMBERS))
    content |= {name: float(getattr(scenario, name)) for name in numbers}
    content |= {name: value for name, value in numbers_of(scenario.sight).items() if value}
    content |= {} if scenario.guided else {"guided": False}
    content |= {"early": True} if scenario.early else {}
    content["holds"] = [float(hold) for hold in scenario.holds]
    end = scenario.start + scenario.duration + scenario.horizon
    robots = [_robot(robot, scenario.start, end) for robot in scenario.robots]
    content |= {"robot": robots[0]} if len(robots) == 1 else {"robots": robots}
    if scenario.obstacles:
        content["obstacles"] = [_obstacle(obstacle, scenario.start, end) for obstacle in scenario.obstacles]
    if scenario.tasks is not None:
        if scenario.tasks.assign is not None:
            raise InvalidInput(f"assign: expected none in a file, found {scenario.tasks.assign}")
        content["tasks"] = _given(to_plain(scenario.tasks))
    yaml, stream = YAML(), io.StringIO()
    yaml.allow_unicode = not ascii_only
    yaml.default_flow_style = None
    yaml.width = 4096
    yaml.dump(content, stream)
    return stream.getvalue()


def _refuse_lost(part: object, cls: type, where: str = "") -> None:
    """Raise InvalidInput for a field that a file cannot hold."""
    for name, value in NOT_IN_FILES[cls].items():
        found = getattr(part, name)
        if np.any(found != value):
            expected = f"{value:g}" if isinstance(value, float) else "none"
            raise InvalidInput(f"{where}{name}: expected {expected} in a file, found {found}")


def _robot(robot: Robot, start: float, end: float) -> dict[str, Any]:
    _refuse_lost(robot.state, State, f"{robot.name}: ")
    _refuse_lost(robot.goal, Goal, f"{robot.name}: goal: ")
    limits = to_plain(robot.limits, tables=TABLES)
    found: dict[str, Any] = {
        "name": robot.name,
        "position": to_plain(robot.state.position),
        "velocity": to_plain(robot.state.velocity),
        "shape": _part(robot.shape, SHAPES),
        "max_speed": limits.pop("max_speed"),
        "max_acceleration": limits.pop("max_acceleration"),
        "priority": float(robot.priority),
        "goal": _goal(robot.goal, start, end),
    }
    if robot.method is not None:
        if method(robot.method.name) != robot.method:
            raise InvalidInput(f"{robot.name}: method: expected one of the table in a file, found another one")
        found["method"] = robot.method.name
    if robot.margin is not None:
        found["margin"] = float(robot.margin)
    if robot.appears is not None:
        found["appears"] = float(robot.appears)
    found |= {name: _given(bounds) for name, bounds in limits.items() if bounds}
    if robot.objective is not None:
        found["objective"] = _part(robot.objective, OBJECTIVES)
    return found


def _goal(goal: Goal, start: float, end: float) -> dict[str, Any]:
    if not isinstance(goal, PathGoal):
        goal = replace(goal, trajectory=in_files(goal.trajectory, start, end))
    found: dict[str, Any] = _given(goal_to_plain(goal, "part"))
    if "speeds" in found.get("path", {}):
        found["path"]["speeds"] = found["path"].pop("speeds")  # the last key, as files of former versions have it
    trajectory = found.get("trajectory", {})
    if trajectory.get("kind") == "stationary":
        return {"position": trajectory["position"]} | {key: found[key] for key in ("tolerance", "stop")}
    return found


def _obstacle(obstacle: Obstacle, start: float, end: float) -> dict[str, Any]:
    _refuse_lost(obstacle, Obstacle, f"{obstacle.name}: ")
    found: dict[str, Any] = {"name": obstacle.name, "shape": _part(obstacle.shape, SHAPES)}
    found["trajectory"] = _part(in_files(_ending(obstacle), start, end), TRAJECTORIES)
    if obstacle.heading != 0.0:
        found["heading"] = to_plain(obstacle.heading)
    if obstacle.uncertainty is not None:
        found["uncertainty"] = _part(obstacle.uncertainty, UNCERTAINTIES)
    if obstacle.after_end != replace(obstacle, after_end="unknown").of_scenario().after_end:
        found["after_end"] = obstacle.after_end
    found |= {} if obstacle.contact_at_rest else {"contact_at_rest": False}
    found |= {"owner": obstacle.owner} if obstacle.owner else {}
    return found


def _ending(obstacle: Obstacle) -> Trajectory:
    """The trajectory of an obstacle without what `Obstacle.continued` added, which the reader adds again."""
    found = obstacle.trajectory
    if obstacle.after_end != "continues" or not isinstance(found, Composite):
        return found
    first, rest = found.parts[0], found.parts[-1]
    end = found.switches[0]
    same = len(found.parts) == 2 and first.span[1] == end and isinstance(rest, ConstantVelocity)
    return first if same and np.array_equal(rest.velocity(end), first.velocity(end)) else found


def _part(part: Any, kinds: Mapping[str, type]) -> Any:
    """Return kind and fields of a part, with the keys that files use."""
    return _given(to_plain(part, kinds, "part"))


def _given(value: Any) -> Any:
    """Return a plain value without the keys that hold None."""
    if isinstance(value, Mapping):
        return {key: _given(one) for key, one in value.items() if one is not None}
    return [_given(one) for one in value] if isinstance(value, list) else value
