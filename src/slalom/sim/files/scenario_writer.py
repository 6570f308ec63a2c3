"""Writer of scenario files: the scenario as YAML that `read_scenario` reads back, equal to the bit."""

import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from slalom.base.errors import InvalidInput
from slalom.base.registry import to_plain
from slalom.base.writing import write_file
from slalom.decision.document import TABLES, goal_to_plain
from slalom.decision.objective import OBJECTIVES
from slalom.decision.settings import NUMBERS
from slalom.model.goal import Goal
from slalom.model.path_goal import PathGoal
from slalom.model.shape import SHAPES
from slalom.model.trajectory import TRAJECTORIES
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.obstacle import Obstacle
from slalom.sim.measure.hdf5 import in_files
from slalom.sim.scenario import Robot, Scenario, numbers_of

NOT_IN_FILES = ("message_delay", "message_loss", "sight_noise", "sight_delay", "sight_loss")
"""Settings that scenario files cannot hold."""


def write_scenario(scenario: Scenario, path: Path | str) -> None:
    """Write a scenario file, see `scenario_text`."""
    write_file(path, scenario_text(scenario))


def scenario_text(scenario: Scenario, *, ascii_only: bool = False) -> str:
    """Return a scenario as YAML; with `ascii_only` other characters are escape sequences in double quotes.

    A trajectory that files cannot hold (a composite, a Python function) is written as cubic pieces over the run and one
    horizon. They are within the error of its path.

    Raises:
        InvalidInput: a setting that files cannot hold, a part of a kind that is in no registry.
    """
    default = Scenario.__dataclass_fields__
    for name in NOT_IN_FILES:
        if getattr(scenario, name) != default[name].default:
            raise InvalidInput(
                f"{name}: expected {default[name].default:g} in a file, found {getattr(scenario, name):g}"
            )
    content: dict[str, Any] = {"name": scenario.name}
    numbers = dict.fromkeys(("start", "duration", "dt", "horizon", "margin", "replan", *NUMBERS))
    content |= {name: float(getattr(scenario, name)) for name in numbers}
    content |= {name: value for name, value in numbers_of(scenario.sight).items() if value}
    content |= {} if scenario.guided else {"guided": False}
    content |= {"early": True} if scenario.early else {}
    content["holds"] = [float(hold) for hold in scenario.holds]
    if scenario.period is not None:
        content["period"] = [float(x) for x in scenario.period]
    end = scenario.start + scenario.duration + scenario.horizon
    robots = [_robot(robot, scenario.start, end) for robot in scenario.robots]
    content |= {"robot": robots[0]} if len(robots) == 1 else {"robots": robots}
    if scenario.obstacles:
        content["obstacles"] = [_obstacle(obstacle, scenario.start, end) for obstacle in scenario.obstacles]
    yaml, stream = YAML(), io.StringIO()
    yaml.allow_unicode = not ascii_only
    yaml.default_flow_style = None
    yaml.width = 4096
    yaml.dump(content, stream)
    return stream.getvalue()


def _robot(robot: Robot, start: float, end: float) -> dict[str, Any]:
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
    if not obstacle.contact_at_rest:
        raise InvalidInput(f"obstacle {obstacle.name!r}: expected contact_at_rest True in a file, found False")
    found: dict[str, Any] = {"name": obstacle.name, "shape": _part(obstacle.shape, SHAPES)}
    found["trajectory"] = _part(in_files(obstacle.trajectory, start, end), TRAJECTORIES)
    if obstacle.heading != 0.0:
        found["heading"] = to_plain(obstacle.heading)
    if obstacle.uncertainty is not None:
        found["uncertainty"] = _part(obstacle.uncertainty, UNCERTAINTIES)
    return found


def _part(part: Any, kinds: Mapping[str, type]) -> Any:
    """Return kind and fields of a part, with the keys that files use."""
    return _given(to_plain(part, kinds, "part"))


def _given(value: Any) -> Any:
    """Return a plain value without the keys that hold None."""
    if isinstance(value, Mapping):
        return {key: _given(one) for key, one in value.items() if one is not None}
    return [_given(one) for one in value] if isinstance(value, list) else value
