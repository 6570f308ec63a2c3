"""Every part of the library is enrolled in the tests, and a part that is not is named with the line to add.

And what an enrolment gives: scenario files and recordings hold every example of `parts`.
"""

import ast
import inspect
from collections.abc import Callable, Collection, Iterable
from dataclasses import fields
from pathlib import Path

import definitions
import numpy as np
import oracle
import parts
import pytest
from metrics_by_hand import BY_HAND
from recorded_runs import same_bits

import slalom
from slalom import METHODS, Goal, Limits, Obstacle, State, Stationary
from slalom.base.checks import Checked
from slalom.base.errors import SlalomError
from slalom.forecast.forecast import FORECASTS
from slalom.model.bounds import BOUNDS
from slalom.model.response import RESPONSES
from slalom.model.shape import SHAPES, Union, round_shape
from slalom.model.trajectory import TRAJECTORIES
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.sim import Recording, Robot, Scenario, metrics, read_scenario, simulate

OBJECTIVES = [
    cls
    for _, cls in inspect.getmembers(slalom.decision.objective, inspect.isclass)
    if isinstance(cls, slalom.Objective) and not getattr(cls, "_is_protocol", False)
]


def refuse_missing(kinds: Iterable[type], examples: Iterable[object], place: str, line: str) -> None:
    """Fail with the line to add at `place` for each class that has no example."""
    there = {type(example) for example in examples}
    missing = [line.format(name=kind.__name__) for kind in kinds if kind not in there]
    assert not missing, f"{place}: expected an example of every kind; add {', '.join(missing)}"


def refuse_unnamed(names: Iterable[str], there: Collection[str], place: str, line: str) -> None:
    """Fail with the line to add at `place` for each name that it lacks."""
    missing = [line.format(name=name) for name in names if name not in there]
    assert not missing, f"{place}: expected an entry for every name; add {', '.join(missing)}"


def of_every_dimension(makes: Iterable[Callable]) -> list[object]:
    """What functions of the dimension make."""
    return [make(d) for make in makes for d in (2, 3)]


def test_every_trajectory_is_enrolled() -> None:
    examples = of_every_dimension(parts.TRAJECTORIES.values())
    refuse_missing(TRAJECTORIES.values(), examples, "tests/kit/parts.py TRAJECTORIES", '"name": lambda d: {name}(...)')


def test_every_shape_is_enrolled() -> None:
    examples = [make(1.0, d) for make in parts.SHAPES.values() for d in (2, 3)]
    refuse_missing(SHAPES.values(), examples, "tests/kit/parts.py SHAPES", '"name": lambda size, d: {name}(...)')


def test_every_response_is_enrolled() -> None:
    examples = (parts.RESPONSES | parts.PLANE_RESPONSES).values()
    refuse_missing(RESPONSES, examples, "tests/kit/parts.py RESPONSES", '"name": {name}(...)')


def test_every_bound_is_enrolled() -> None:
    examples = [bound for bounds in of_every_dimension(parts.BOUNDS.values()) for bound in bounds]
    refuse_missing(BOUNDS.values(), examples, "tests/kit/parts.py BOUNDS", '"name": lambda d: ({name}(...),)')


def test_every_uncertainty_is_enrolled() -> None:
    examples = parts.UNCERTAINTIES.values()
    refuse_missing(UNCERTAINTIES.values(), examples, "tests/kit/parts.py UNCERTAINTIES", '"name": {name}(...)')


def test_every_objective_is_enrolled() -> None:
    examples = of_every_dimension(parts.OBJECTIVES.values())
    refuse_missing(OBJECTIVES, examples, "tests/kit/parts.py OBJECTIVES", '"name": lambda d: {name}(...)')


def test_every_forecast_is_enrolled() -> None:
    kinds = {type(rule) for rule in FORECASTS.values()}
    refuse_missing(kinds, parts.FORECASTS.values(), "tests/kit/parts.py FORECASTS", '"name": {name}()')


def test_every_method_is_enrolled() -> None:
    refuse_unnamed(METHODS, parts.ENROLLED_METHODS, "tests/kit/parts.py ENROLLED_METHODS", '"{name}"')


def test_every_metric_is_computed_by_hand() -> None:
    there = {name for name, _, _ in BY_HAND}
    refuse_unnamed(metrics.METRICS, there, "tests/kit/metrics_by_hand.py BY_HAND", '("{name}", STRAIGHT, value)')


def test_every_trajectory_has_a_second_derivation() -> None:
    refuse_unnamed(TRAJECTORIES, oracle.MOTIONS, "tests/kit/oracle.py MOTIONS", '"{name}": Formula(...)')


def test_every_response_has_a_second_derivation() -> None:
    names = [kind.__name__ for kind in RESPONSES]
    refuse_unnamed(names, oracle.RESPONSES, "tests/kit/oracle.py RESPONSES", '"{name}": formula')


def test_every_bound_has_a_definition() -> None:
    """Without one, `definitions.out_of_bound` has no answer."""
    for kind, cls in BOUNDS.items():
        text = inspect.getsource(definitions.out_of_bound)
        assert cls.__name__ in text or kind == "convex_polygon", (
            f"tests/kit/definitions.py out_of_bound: add {cls.__name__}"
        )


def test_every_part_is_public() -> None:
    """In the stub, which is the list of public names."""
    errors = [cls for _, cls in inspect.getmembers(slalom.base.errors, inspect.isclass) if issubclass(cls, SlalomError)]
    others = [type(rule) for rule in FORECASTS.values()]
    kinds = [*TRAJECTORIES.values(), *SHAPES.values(), *RESPONSES, *BOUNDS.values(), *UNCERTAINTIES.values()]
    for cls in (*kinds, *OBJECTIVES, *others, *errors):
        line = f"from .{cls.__module__.removeprefix('slalom.')} import {cls.__name__} as {cls.__name__}"
        assert cls.__name__ in slalom.__all__, f"slalom/__init__.pyi: expected every part of the library; add {line}"


def test_every_class_of_a_room_is_registered() -> None:
    """A public dataclass of model/trajectory/ and model/response/ that fits the protocol: registered, or known not to
    be.
    """
    known = {"Composite", "Function", "AccelerationSequence", "TimeInvariant"}
    there = {cls.__name__ for cls in (*TRAJECTORIES.values(), *RESPONSES)} | known
    for room, members in (("trajectory", {"path", "speed_bound"}), ("response", {"knots", "settled"})):
        registry = "TRAJECTORIES" if room == "trajectory" else "RESPONSES"
        for path in (Path(slalom.__file__).with_name("model") / room).glob("*.py"):
            for node in ast.parse(path.read_text()).body:
                if isinstance(node, ast.ClassDef) and node.name != "Trajectory" and node.name != "Response":
                    own = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
                    message = f"slalom/model/{room}/__init__.py {registry}: expected every kind; add {node.name}"
                    assert not members <= own or node.name in there, message


def in_a_file(part: object, kinds: dict[str, type]) -> str:
    """What a scenario file says of a part, in YAML's flow style: its kind and its fields."""
    told = {"kind": next(name for name, cls in kinds.items() if cls is type(part))}
    for field in fields(part):
        held, value = inspect.getattr_static(type(part), field.name, None), getattr(part, field.name)
        if value is not None:
            told[(held.key if isinstance(held, Checked) else "") or field.name] = in_yaml(value)
    return "{" + ", ".join(f"{key}: {value}" for key, value in told.items()) + "}"


def in_yaml(value: object) -> str:
    """Numbers as they are, to the bit; parts in a list."""
    if isinstance(value, tuple):
        return "[" + ", ".join(in_a_file(one, SHAPES) for one in value) + "]"
    return str(value.tolist()) if isinstance(value, np.ndarray) else str(value)


def enrolled() -> list[object]:
    """Every example of a kind that files can name, as a parameter."""
    tracks = [(f"{d} {name}", make(d)) for name, make in parts.TRAJECTORIES.items() for d in (2, 3)]
    shapes = [(f"{d} {name}", parts.SHAPES[name](1 / 3, d)) for d in (2, 3) for name in parts.served(d)]
    bounds = [
        (f"{d} {name} {k}", b) for name in parts.BOUNDS for d in (2, 3) for k, b in enumerate(parts.BOUNDS[name](d))
    ]
    kinds = {*TRAJECTORIES.values(), *SHAPES.values(), *BOUNDS.values(), *UNCERTAINTIES.values()}
    every = [*tracks, *shapes, *bounds, *parts.UNCERTAINTIES.items()]
    return [pytest.param(part, id=name.replace(" ", "-")) for name, part in every if type(part) in kinds]


def dimension_of(part: object) -> int:
    """Of the scenario that a part belongs to: its own, else that of its vectors, else the plane."""
    vectors = [getattr(part, field.name) for field in fields(part) if field.name in ("half_widths", "heading")]
    sizes = [len(vector) for vector in vectors if vector is not None]
    return getattr(part, "dimension", sizes[0] if sizes else 2)


OF_OBSTACLES = {"shape": SHAPES, "uncertainty": UNCERTAINTIES, "trajectory": TRAJECTORIES}
"""Registries by the key of an obstacle in a scenario file, which is its attribute too."""


def scene(part: object) -> tuple[str, Callable[[Scenario], object]]:
    """A scenario file with the part, and where the scenario has it."""
    d = dimension_of(part)
    robot = {"position": [0.0] * d, "radius": 1, "max_speed": 2, "max_acceleration": 1}
    robot["goal"] = f"{{position: {[90.0] * d}}}"
    other = {"radius": 1, "trajectory": f"{{kind: stationary, position: {[50.0] * d}}}"}
    key = next((key for key, kinds in OF_OBSTACLES.items() if type(part) in kinds.values()), "")
    if key:
        other[key] = in_a_file(part, OF_OBSTACLES[key])
    else:
        robot["bounds"] = f"[{in_a_file(part, BOUNDS)}]"
    if key == "shape":
        del other["radius"]
    robot_text, other_text = (", ".join(f"{k}: {v}" for k, v in one.items()) for one in (robot, other))
    text = f"robot: {{{robot_text}}}\nobstacles: [{{{other_text}}}]\nduration: 0.2\n"
    return text, lambda s: getattr(s.obstacles[0], key) if key else s.robot.limits.bounds[0]


@pytest.mark.parametrize("part", enrolled())
def test_files_hold_every_example(part: object, tmp_path: Path) -> None:
    """A scenario file that says its kind and its fields gives the part to the bit; so does a recording of the run."""
    text, found = scene(part)
    (tmp_path / "one.yaml").write_text(text)
    scenario = read_scenario(tmp_path / "one.yaml")
    assert same_bits(found(scenario), part)
    robot = Robot(scenario.robot.shape, scenario.robot.limits, scenario.robot.state, scenario.robot.goal)
    empty = Scenario("one", (robot,), scenario.obstacles, duration=0.1)
    run = simulate(empty, METHODS["vo"])
    run.save(tmp_path / "one.h5")
    loaded = Recording.load(tmp_path / "one.h5")
    assert same_bits(loaded.obstacles, run.obstacles)
    assert same_bits(loaded.limits, run.limits)


@pytest.mark.parametrize("name", parts.OBJECTIVES)
@pytest.mark.parametrize("d", [2, 3])
def test_every_objective_decides(name: str, d: int) -> None:
    """Aims of positive weight and gain, a cost that is a finite number of seconds, a clearance of 0 or more."""
    objective = parts.OBJECTIVES[name](d)
    assert isinstance(objective, slalom.Objective)
    assert objective.enough_clearance >= 0.0
    robot = slalom.Navigator(METHODS["ao"], round_shape(0.5, d), Limits(2.0, 1.0), objective=objective)
    rock = Obstacle(round_shape(1.0, d), Stationary(np.full(d, 6.0)))
    decision = robot.decide(State(np.zeros(d), np.full(d, 0.5)), [rock], Goal(Stationary(np.full(d, 12.0)), 0.5))
    assert decision.outcome.safe
    assert np.all(np.isfinite(decision.preferred))


def test_a_union_of_every_shape_is_held(tmp_path: Path) -> None:
    """Also of a union."""
    inner = Union([parts.SHAPES[name](0.5, 2) for name in parts.served(2)])
    text, found = scene(Union([inner, round_shape(0.25, 2)]))
    (tmp_path / "one.yaml").write_text(text)
    assert same_bits(found(read_scenario(tmp_path / "one.yaml")), Union([inner, round_shape(0.25, 2)]))
