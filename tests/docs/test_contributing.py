"""The recipes of CONTRIBUTING.md, followed to the letter from outside of the package: a class and one line each."""

import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from recorded_runs import same_bits

from slalom import (
    METHODS,
    Aim,
    AtConstantVelocity,
    Bound,
    Disc,
    Goal,
    InvalidFile,
    Known,
    Limits,
    Method,
    Navigator,
    Objective,
    Obstacle,
    ObstacleTable,
    Part,
    Response,
    Shape,
    State,
    Stationary,
    Trajectory,
    Uncertainty,
    Velocity,
    read_walls,
)
from slalom.base.checks import Array, Checked, NotNegative, Positive, positive, vector
from slalom.cli import DONE, FAILED, call
from slalom.io.walls import WALL_FORMATS, Drawn, WallFormat
from slalom.model.bounds import BOUNDS, HalfSpaces, axes
from slalom.model.path import Path as Pieces, hermite_pieces
from slalom.model.response import RESPONSES
from slalom.model.shape import SHAPES
from slalom.model.state import Affine
from slalom.model.trajectory import TRAJECTORIES
from slalom.model.trajectory.protocol import Endless
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.sim import Recording, Robot, Scenario, compare, metrics, read_scenario, simulate
from slalom.sim.gallery import GALLERY, Entry, build

ROOT = Path(__file__).parents[2]
RECIPES = (ROOT / "CONTRIBUTING.md").read_text()
ROBOT = "position: [0, 0], radius: 0.5, max_speed: 2, max_acceleration: 1, goal: {position: [12, 0]}"


@dataclass(frozen=True, eq=False)
class Shuttle(Endless):
    """Moves from `initial_position` (d,) [m] with `initial_velocity` (d,) [m/s] for `duration` [s], then rests."""

    initial_position: Checked = Checked(vector, key="position")
    initial_velocity: Checked = Checked(vector, key="velocity")
    duration: Positive = 3.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", positive(self.duration, "duration"))

    @property
    def dimension(self) -> int:
        return self.initial_position.size

    def position(self, t: npt.ArrayLike) -> Array:
        return (
            self.initial_position + np.minimum(np.asarray(t, float), self.duration)[..., None] * self.initial_velocity
        )

    def velocity(self, t: npt.ArrayLike) -> Array:
        return np.where((np.asarray(t, float) < self.duration)[..., None], self.initial_velocity, 0.0)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return np.zeros((*np.shape(t), self.dimension))

    def breaks(self, start: float, end: float) -> Array:
        return np.array([self.duration] if start < self.duration < end else [])

    def speed_bound(self, start: float, end: float) -> float:
        return float(np.linalg.norm(self.initial_velocity))

    def acceleration_bound(self, start: float, end: float) -> float:
        return 0.0

    def path(self, start: float, end: float) -> Pieces:
        times = np.array([start, *self.breaks(start, end), end])
        slopes = self.velocity(times[:-1])
        return hermite_pieces(times, self.position(times), slopes, slopes, 0.0)


@dataclass(frozen=True)
class Hexagon:
    """A regular hexagon with corners at `size` > 0 [m]."""

    size: Positive
    dimension: ClassVar[int] = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", positive(self.size, "size"))

    @property
    def parts(self) -> tuple[Part, ...]:
        angles = np.pi / 3 * np.arange(6)
        return (Part(self.size * np.column_stack([np.cos(angles), np.sin(angles)]), 0.0),)

    @property
    def bounding_radius(self) -> float:
        return self.size


@dataclass(frozen=True, eq=False)
class HardestBraking:
    """The acceleration along the heading is at least -`most` [m/s^2]."""

    of: ClassVar[str] = "acceleration"
    most: Positive

    @property
    def braking(self) -> float:
        return self.most

    def half_spaces(self, state: State) -> HalfSpaces:
        frame = axes(state)
        return (np.empty((0, state.dimension)), np.empty(0)) if frame is None else (-frame[:1], np.array([self.most]))


@dataclass(frozen=True)
class QuadraticError:
    """The error is at most rate t^2 [m]."""

    rate: NotNegative = 0.1

    def radius(self, t: npt.ArrayLike, dimension: int) -> Array:
        return self.rate * np.asarray(t, float) ** 2


@dataclass(frozen=True)
class Doubled:
    """The control is half an acceleration [m/s^2], held for ever: gain t^2."""

    restartable: bool = True
    interpolation_error: float = 0.0

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        time = np.asarray(t, float)
        return Affine(state.position + time[..., None] * state.velocity, time**2)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        time = np.asarray(t, float)
        return Affine(state.velocity + 0.0 * time[..., None], 2.0 * time)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        time = np.asarray(t, float)
        return Affine(0.0 * time[..., None] * state.velocity, 2.0 + 0.0 * time)

    def knots(self, horizon: float, reach: float) -> Array:
        return np.array([0.0, horizon])

    def settled(self, horizon: float) -> float:
        return min(1.0, horizon)

    def speed_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.velocity(state, horizon),)

    def acceleration_peaks(self, state: State, horizon: float) -> tuple[Affine, ...]:
        return (self.acceleration(state, 0.0),)


@dataclass(frozen=True)
class Drift:
    """Have the velocity (1, 1) m/s, whatever the goal is."""

    enough_clearance: float = 0.0

    def aims(self, situation: object) -> tuple[Aim, ...]:
        s = situation
        return (Aim(s.response.velocity(s.state, max(s.response.settled(s.horizon), 1e-3)), np.ones(2)),)

    def cost(self, motion: Trajectory, situation: object, until: float) -> float:
        return float(np.linalg.norm(motion.velocity(until) - 1.0))


def turns_left(recording: Recording) -> float:
    """Steps at which the velocity turns to the left."""
    v = recording.velocities[:, 0]
    return float((v[:-1, 0] * v[1:, 1] - v[:-1, 1] * v[1:, 0] > 1e-9).sum())


def scene(folder: Path, text: str) -> Scenario:
    """The scenario of a file of this text, with a short run."""
    (folder / "scene.yaml").write_text(text + "\nduration: 1.0\n")
    return read_scenario(folder / "scene.yaml")


def recorded(folder: Path, scenario: Scenario) -> Recording:
    """A run that was saved and loaded, and gave the same parts to the bit."""
    run = simulate(scenario, METHODS["nao"])
    run.save(folder / "run.h5")
    loaded = Recording.load(folder / "run.h5")
    assert same_bits(loaded.obstacles, run.obstacles)
    assert same_bits(loaded.limits, run.limits)
    return loaded


def gap(obstacle: Obstacle, decision: object, state: State) -> float:
    """Least distance [m] of the centres of a manoeuvre and an obstacle over 6 s."""
    t = np.linspace(0.0, 6.0, 2001)
    away = decision.manoeuvre.position(t) - obstacle.trajectory.position(t)
    return float(np.linalg.norm(away, axis=1).min())


def test_a_trajectory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """TRAJECTORIES["shuttle"] = Shuttle."""
    monkeypatch.setitem(TRAJECTORIES, "shuttle", Shuttle)
    assert isinstance(Shuttle((0, 0), (1, 0)), Trajectory)
    obstacle = Obstacle(Disc(1.0), Shuttle((9.0, 0.1), (-1.5, 0.0)))
    robot, state = Navigator(METHODS["nao"], Disc(0.5), Limits(2.0, 1.0)), State((0, 0), (2, 0))
    decision = robot.decide(state, [obstacle], Goal(Stationary((12, 0)), 0.5))
    assert decision.outcome.safe
    assert gap(obstacle, decision, state) >= 1.5
    body = "{radius: 1, trajectory: {kind: shuttle, position: [9, 0.1], velocity: [-1.5, 0]}}"
    scenario = scene(tmp_path, f"robot: {{{ROBOT}}}\nobstacles: [{body}]")
    assert same_bits(scenario.obstacles[0].trajectory, obstacle.trajectory)
    recorded(tmp_path, scenario)
    with pytest.raises(InvalidFile) as caught:
        scene(tmp_path, f"robot: {{{ROBOT}}}\nobstacles: [{body.replace('velocity', 'velocty')}]")
    assert len(caught.value.mistakes) == 2
    assert "expected one of kind, position, velocity, duration; found 'velocty'" in str(caught.value)
    with pytest.raises(InvalidFile, match="duration: expected a number above 0, found 0"):
        scene(tmp_path, f"robot: {{{ROBOT}}}\nobstacles: [{body.replace('velocity', 'duration: 0, velocity')}]")


@pytest.mark.parametrize(("table", "cuts"), [(True, 1), (False, 3)])
def test_a_trajectory_in_a_table_is_cut_once(table: bool, cuts: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of a class that the library does not know."""
    made, path = [], Shuttle.path
    monkeypatch.setattr(Shuttle, "path", lambda self, start, end: made.append(start) or path(self, start, end))
    robot = Navigator(METHODS["nlvo"], Disc(0.5), Limits(2.0, 1.0))
    obstacles: Any = [Obstacle(Disc(1.0), Shuttle((9.0, 0.1), (-1.5, 0.0)))]
    obstacles = ObstacleTable(obstacles) if table else obstacles
    for k in range(3):
        robot.decide(State((0.0, 0.0), (1, 0)), obstacles, Goal(Stationary((12, 0)), 0.5), now=0.1 * k)
    assert len(made) == cuts


def test_a_shape(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SHAPES["hexagon"] = Hexagon."""
    monkeypatch.setitem(SHAPES, "hexagon", Hexagon)
    assert isinstance(Hexagon(1.0), Shape)
    obstacle = Obstacle(Hexagon(1.0), Stationary((6.0, 0.1)))
    robot, state = Navigator(METHODS["nao"], Hexagon(0.5), Limits(2.0, 1.0)), State((0, 0), (2, 0))
    decision = robot.decide(state, [obstacle], Goal(Stationary((12, 0)), 0.5))
    assert decision.outcome.safe
    assert gap(obstacle, decision, state) >= 1.5 * np.sqrt(0.75)
    body = "{shape: {kind: hexagon, size: 0.3}, trajectory: {kind: stationary, position: [5, 3]}}"
    shaped = ROBOT.replace("radius: 0.5", "shape: {kind: union, shapes: [{kind: hexagon, size: 0.25}]}")
    scenario = scene(tmp_path, f"robot: {{{shaped}}}\nobstacles: [{body}]")
    assert scenario.obstacles[0].shape == Hexagon(0.3)
    assert scenario.robot.shape.shapes == (Hexagon(0.25),)
    recorded(tmp_path, scenario)


def test_a_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """BOUNDS["hardest_braking"] = HardestBraking."""
    monkeypatch.setitem(BOUNDS, "hardest_braking", HardestBraking)
    bound, state = HardestBraking(0.4), State((0, 0), (2, 0))
    assert isinstance(bound, Bound)
    limits = Limits(2.0, 1.0, bounds=(bound,))
    assert limits.allows(state, np.array([-0.4, 0.0]), 0.1)
    assert not limits.allows(state, np.array([-0.5, 0.0]), 0.1)
    scenario = scene(tmp_path, f"robot: {{{ROBOT}, velocity: [2, 0], bounds: [{{kind: hardest_braking, most: 0.4}}]}}")
    assert same_bits(scenario.robot.limits.bounds, (bound,))
    run = recorded(tmp_path, scenario)
    assert run.accelerations[..., 0].min() >= -0.4 - 1e-9


def test_an_uncertainty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """UNCERTAINTIES["quadratic_error"] = QuadraticError."""
    monkeypatch.setitem(UNCERTAINTIES, "quadratic_error", QuadraticError)
    unsure = QuadraticError(0.05)
    assert isinstance(unsure, Uncertainty)
    obstacle = Obstacle(Disc(1.0), Stationary((6.0, 0.1)), uncertainty=unsure)
    robot, state = Navigator(METHODS["nao"], Disc(0.5), Limits(2.0, 1.0)), State((0, 0), (1, 0))
    decision = robot.decide(state, [obstacle], Goal(Stationary((12, 0)), 0.5))
    t = np.linspace(0.0, 6.0, 2001)
    away = np.linalg.norm(decision.manoeuvre.position(t) - obstacle.trajectory.position(t), axis=1)
    assert (away - unsure.radius(t, 2)).min() >= 1.5
    body = (
        "radius: 1, uncertainty: {kind: quadratic_error, rate: 0.05}, trajectory: {kind: stationary, position: [6, 3]}"
    )
    scenario = scene(tmp_path, f"robot: {{{ROBOT}}}\nobstacles: [{{{body}}}]")
    assert scenario.obstacles[0].uncertainty == unsure
    recorded(tmp_path, scenario)


def test_a_response_and_a_method(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """METHODS["doubled"] = Method(...): in the simulator, the command line and studies."""
    assert isinstance(Doubled(), Response)
    assert Doubled not in RESPONSES
    row = Method("doubled", lambda limits, period, holds: (Doubled(),), Known(), "A test.", "Nobody, 2025")
    monkeypatch.setitem(METHODS, "doubled", row)
    run = simulate(build("head_on", {"duration": 3.0}), row)
    assert {text for (text,) in run.responses.texts} == {repr(Doubled())}
    assert metrics.summary(run)["collisions"] == 0
    np.testing.assert_allclose(run.accelerations, 2.0 * run.controls, atol=1e-12)
    assert call(["run", "head_on", "--method", "doubled", "--set", "duration=1", "--json"]) == FAILED  # too short
    assert json.loads(capsys.readouterr().out)["method"] == "doubled"
    assert call(["list", "methods", "--json"]) == DONE
    assert "doubled" in json.loads(capsys.readouterr().out)["methods"]
    assert compare("head_on", ["doubled", "vo"], 1, settings={"duration": 1.0})["methods"]["doubled"]["runs"] == 1


def test_a_method_of_responses_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row is all that a method needs."""
    row = Method("slow", lambda limits, period, holds: (Velocity(ramp=1.0),), AtConstantVelocity(), "A test.", "2025")
    monkeypatch.setitem(METHODS, "slow", row)
    table = compare("head_on", ["slow"], 1, settings={"duration": 1.0})
    assert table["methods"]["slow"]["runs"] == 1


def test_a_format_of_walls(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """WALL_FORMATS[".segments"] = WallFormat("...", segments): in `read_walls` and in scenario files."""

    def segments(path: Path, _: float) -> Drawn:
        return Drawn([shapely.LineString(np.loadtxt(path).reshape(-1, 2))], 1.0)

    monkeypatch.setitem(WALL_FORMATS, ".segments", WallFormat("lines of numbers", segments))
    (tmp_path / "a.segments").write_text("0 -2 0 2\n")
    (wall,) = read_walls(tmp_path / "a.segments").obstacles
    low, high = np.array([part.corners for part in wall.shape.parts]).min(axis=(0, 1)), wall.trajectory.position(0.0)
    assert (low + high).tolist() == [0.0, -2.0]


def test_an_objective() -> None:
    """Navigator(objective=Drift()): no registry."""
    assert isinstance(Drift(), Objective)
    robot = Navigator(METHODS["vo"], Disc(0.5), Limits(3.0, 1.0), objective=Drift(), patience=0.0)
    decision = robot.decide(State((0, 0), (0.9, 0.9)), [], Goal(Stationary((-12, 0)), 0.5))
    np.testing.assert_allclose(decision.preferred, (1.0, 1.0), atol=1e-9)


def test_a_metric(monkeypatch: pytest.MonkeyPatch) -> None:
    """METRICS["turns_left"] = turns_left."""
    monkeypatch.setitem(metrics.METRICS, "turns_left", turns_left)
    run = simulate(build("head_on", {"duration": 3.0}), METHODS["nao"])
    found = {name: metric(run) for name, metric in metrics.METRICS.items()}
    assert found["turns_left"] == turns_left(run)
    assert all(isinstance(value, float) for value in found.values())


def crowd(p: dict[str, float], rng: np.random.Generator) -> Scenario:
    """A robot among rocks at random places."""
    robot = Robot(Disc(0.5), Limits(2.0, 1.0), State((0, 0), (0, 0)), Goal(Stationary((20.0, 0.0)), 0.5))
    positions = rng.uniform((5.0, -5.0), (15.0, 5.0), size=(int(p["rocks"]), 2))
    return Scenario("crowd", (robot,), tuple(Obstacle(Disc(0.2), Stationary(position)) for position in positions))


def test_a_scenario(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """GALLERY["crowd"] = Entry("crowd", crowd, {"rocks": 4.0}, "Rocks at random places.")."""
    monkeypatch.setitem(GALLERY, "crowd", Entry("crowd", crowd, {"rocks": 4.0}, "Rocks at random places."))
    assert len(build("crowd", {"rocks": 7.0}, seed=3).obstacles) == 7
    assert call(["run", "crowd", "--set", "duration=1", "--json"]) == FAILED  # too short
    assert json.loads(capsys.readouterr().out)["scenario"] == "crowd"
    assert call(["list", "scenarios", "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["scenarios"]["crowd"]["parameters"] == {"rocks": 4.0}
    assert compare("crowd", ["vo"], 2, settings={"duration": 1.0})["methods"]["vo"]["runs"] == 2


@dataclass(frozen=True)
class Unsaid:
    """A shape with a field whose annotation files cannot hold."""

    dimension: ClassVar[int] = 2
    outline: Callable[[float], float]


def test_a_field_that_no_file_can_hold_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SHAPES, "unsaid", Unsaid)
    body = "{shape: {kind: unsaid}, trajectory: {kind: stationary, position: [5, 3]}}"
    with pytest.raises(TypeError, match=r"Unsaid\.outline: expected an annotation that files can hold, found"):
        scene(tmp_path, f"robot: {{{ROBOT}}}\nobstacles: [{body}]")


@pytest.mark.parametrize(
    "line",
    ["TRAJECTORIES", "SHAPES", "RESPONSES", "BOUNDS", "UNCERTAINTIES", "METHODS", "METRICS", "GALLERY", "__init__.pyi"],
)
def test_the_recipes_name_every_line(line: str) -> None:
    assert f"`{line}`" in RECIPES


def test_the_recipes_name_files_that_are_there() -> None:
    """In the tree, and in the recipes every path."""
    tree = RECIPES[RECIPES.index("    src/slalom/") :].partition("\n\n")[0]
    names, package = [], ""
    for line in tree.splitlines()[1:]:
        found = re.match(r"( {6}| {8})((?:[\w/]+(?:\.py|/) )+)", line)
        if found:
            inner, named = len(found[1]) == 8, found[2].split()
            package = package if inner else named[0]
            names += [package + name if inner else name for name in named]
    assert len(names) > 35
    for name in names:
        assert (ROOT / "src" / "slalom" / name).exists(), name
    found = set(re.findall(r"`((?:tests|tools|benchmarks|docs)/[\w./-]+)`", RECIPES))
    assert len(found) > 6
    for name in found:
        assert (ROOT / name).exists(), name


def test_the_tree_names_every_module_at_the_top() -> None:
    tree = RECIPES[RECIPES.index("    src/slalom/") :].partition("\n\n")[0]
    for path in (ROOT / "src" / "slalom").iterdir():
        if not path.name.startswith("_") and path.name not in ("data", "py.typed"):
            assert f" {path.name}" in tree, path.name


def test_the_page_of_layers_names_those_that_are_checked() -> None:
    """In the same order, with the same modules in each."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = [contract["layers"] for contract in contracts if contract.get("containers") == ["slalom"]]
    checked = [set(re.findall(r"\w+", layer)) for layer in layers]
    page = (ROOT / "docs" / "design" / "0003-layers.md").read_text().partition("Two packages")[0]
    rows = [line.split("|")[2] for line in page.splitlines() if line.startswith("| ")][1:]
    assert [set(re.findall(r"`(\w+)`", row)) for row in rows] == checked
    assert f"The package has {len(checked)} layers" in page
