"""Parts of other packages: by entry points of an installed package, and as objects."""

import importlib
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from joblib.externals.loky import get_reusable_executor

import slalom
from slalom import METHODS, Goal, InvalidInput, Limits, Method, Navigator, State, Stationary
from slalom.base.registry import Kind, Registry
from slalom.cli import DONE, FAILED, call
from slalom.decision.objective import OBJECTIVES
from slalom.io.formats import FORMATS, read_recording
from slalom.model.trajectory import Sampled
from slalom.peers import CONTENDERS, PEERS, Peer
from slalom.sim import compare, compare_all, gallery, load, read_study, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.gallery import GALLERY, Entry
from slalom.sim.measure.metrics import METRICS
from slalom.sim.sweep.study import Row, cases_of

TABLES = (METHODS, GALLERY, METRICS, OBJECTIVES, FORMATS)

MODULE = '''
"""One part of each kind."""

from dataclasses import dataclass

import numpy as np

from slalom import Aim, Known, Method, Velocity
from slalom.io.formats import FORMATS, Format
from slalom.sim import Robot, Scenario
from slalom.sim.gallery import Entry, GALLERY


def slowly(limits, period, holds):
    return (Velocity(ramp=1.0),)


steady = Method("steady", slowly, Known(), "A velocity that is reached in one second.", "A test")


def two_cars(p, rng):
    first = GALLERY["head_on"].build({"speed": 5.0, "offset": 0.0}, rng)
    return Scenario("two_cars", first.robots, first.obstacles, duration=p["seconds"])


scene = Entry("two_cars", two_cars, {"seconds": 20.0}, "As head_on, for as many seconds.")


def steps(recording):
    """Number of steps of the run."""
    return float(len(recording.accelerations))


@dataclass(frozen=True)
class Drift:
    """Move at one velocity along x."""

    speed: float = 1.0
    enough_clearance: float = 0.0

    def aims(self, s):
        return (Aim(s.response.velocity(s.state, 1.0), np.array([self.speed, 0.0])),)

    def cost(self, motion, s, until):
        return float(np.linalg.norm(motion.velocity(until) - (self.speed, 0.0)))


def is_spaced(suffix, line):
    return suffix == ".spaced"


spaced = Format("spaced", "A test.", "car", FORMATS["csv"].reader, "the suffix .spaced", is_spaced)
'''

POINTS = """
[slalom.methods]
steady = a_package_of_parts:steady
[slalom.scenarios]
two_cars = a_package_of_parts:scene
[slalom.metrics]
steps = a_package_of_parts:steps
[slalom.objectives]
drift = a_package_of_parts:Drift
[slalom.formats]
spaced = a_package_of_parts:spaced
"""


def install(folder: Path, points: str) -> None:
    """A package of one module, as an installer writes it."""
    (folder / "a_package_of_parts.py").write_text(MODULE)
    about = folder / "a_package_of_parts-1.2.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: a-package-of-parts\nVersion: 1.2\n")
    (about / "entry_points.txt").write_text(points)


def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all tables look for packages again; give them back their parts afterwards."""
    for table in TABLES:
        monkeypatch.setattr(table, "data", dict(table.data))
        monkeypatch.setattr(table, "packages", dict(table.packages))
        monkeypatch.setattr(table, "_complete", False)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The package, installed."""
    folder = tmp_path / "installed"
    folder.mkdir()
    install(folder, POINTS)
    monkeypatch.syspath_prepend(str(folder))
    importlib.invalidate_caches()
    forget(monkeypatch)
    get_reusable_executor().shutdown()  # processes of earlier tests do not have the package
    yield folder
    sys.modules.pop("a_package_of_parts", None)


@pytest.mark.slow
def test_every_table_has_the_part_of_the_package(package: Path) -> None:
    names = ("steady", "two_cars", "steps", "drift", "spaced")
    for table, name in zip(TABLES, names, strict=True):
        assert name in table
        assert name in list(table)
        assert table.packages == {name: "a-package-of-parts 1.2"}
    assert "steady" in CONTENDERS
    assert slalom.method("steady@observed").foresight == "observed"


@pytest.mark.slow
def test_the_parts_work_by_name(package: Path) -> None:
    run = simulate(gallery.build("two_cars", {"seconds": 1.0}), "steady")
    assert run.method == "steady"
    assert METRICS["steps"](run) == 10.0
    robot = Navigator(METHODS["ao"], slalom.Disc(0.5), Limits(2.0, 1.0), objective=OBJECTIVES["drift"]())
    decision = robot.decide(State((0, 0), (0, 0)), [], Goal(Stationary((0.0, 9.0))))
    assert decision.manoeuvre.velocity(1.0)[1] == pytest.approx(0.0, abs=1e-9)
    table = compare("two_cars", ["steady", "nao"], 2, settings={"seconds": 1.0}, metrics=["steps", "time"], jobs=2)
    assert table["methods"]["steady"]["metrics"]["steps"] == {"mean": 10.0, "interval": None, "range": [10.0, 10.0]}
    assert table["methods"]["nao"]["metrics"]["time"]["mean"] == pytest.approx(1.0)


def test_the_command_line_takes_and_lists_them(
    package: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["run", "two_cars", "--method", "steady", "--set", "seconds=1", "--json"]) == FAILED  # too short
    assert json.loads(capsys.readouterr().out)["method"] == "steady"
    assert call(["list", "--json"]) == DONE
    listed = json.loads(capsys.readouterr().out)
    kinds = {
        "scenarios": "two_cars",
        "methods": "steady",
        "metrics": "steps",
        "objectives": "drift",
        "formats": "spaced",
    }
    assert all(name in listed[kind] for kind, name in kinds.items())
    assert listed["metrics"]["steps"]["sentence"] == "Number of steps of the run."
    arguments = [
        "compare",
        "two_cars",
        "--methods",
        "steady",
        "--seeds",
        "2",
        "--metrics",
        "steps",
        "--set",
        "seconds=1",
    ]
    assert call([*arguments, "--page", str(tmp_path / "page.md")]) == DONE
    assert "steady: steps 10\n" in capsys.readouterr().out
    assert "| steps |" in (tmp_path / "page.md").read_text()


def test_a_study_and_a_scenario_file_name_them(package: Path, tmp_path: Path) -> None:
    robot = "{position: [0, 0], radius: 0.5, max_speed: 2, max_acceleration: 1, objective: {kind: drift, speed: 0.5}"
    (tmp_path / "own.yaml").write_text(f"robot: {robot}, goal: {{position: [0, 9]}}}}\nduration: 3\n")
    run = simulate(load(str(tmp_path / "own.yaml")), "ao")
    np.testing.assert_allclose(run.velocities[-1, 0], (0.5, 0.0), atol=1e-6)
    assert scenario_text(load(str(tmp_path / "own.yaml"))).count("drift") == 1
    (case,) = cases_of(Row(str(tmp_path / "own.yaml"), {}, ["vo"], 1))
    assert case.content["scenario"]["packages"] == ["a-package-of-parts 1.2"]
    rows = "[{scenario: own.yaml}, {scenario: two_cars, settings: {seconds: 1}}]"
    (tmp_path / "study.yaml").write_text(f"methods: [steady]\nseeds: 1\nmetrics: [steps]\nscenarios: {rows}\n")
    tables = compare_all(read_study(tmp_path / "study.yaml").rows)
    assert [table["methods"]["steady"]["metrics"]["steps"]["mean"] for table in tables] == [30.0, 10.0]


def test_a_format_reads_files(package: Path, tmp_path: Path) -> None:
    (tmp_path / "cars.spaced").write_text("id,t,x,y\n1,0,0,0\n1,1,1,0\n1,2,2,0\n")
    read = read_recording(tmp_path / "cars.spaced", "spaced")
    assert read.format == "spaced"
    assert isinstance(next(iter(read.agents.values())).trajectory, Sampled)


def test_a_store_knows_the_version_of_the_package(package: Path, tmp_path: Path) -> None:
    """The same names of another version are other runs."""
    progress: list[tuple[int, int]] = []
    options = {"settings": {"seconds": 0.5}, "store": tmp_path / "kept", "metrics": ["steps"]}
    first = compare("two_cars", ["steady"], 1, **options)
    again = compare("two_cars", ["steady"], 1, **options, progress=lambda done, total: progress.append((done, total)))
    assert first == again
    assert progress == [(1, 1)]
    METHODS.packages["steady"] = "a-package-of-parts 1.3"
    compare("two_cars", ["steady"], 1, **options)
    assert len(list((tmp_path / "kept").rglob("*.json"))) == 2


def mine() -> Method:
    """A method that is in no table."""
    return replace(METHODS["vo"], name="mine", sentence="A test.")


def test_objects_are_compared() -> None:
    table = compare("head_on", ["vo", mine()], 2, settings={"duration": 1.0}, metrics=[METRICS["time"], clearance])
    vo, own = table["methods"]["vo"], table["methods"]["mine"]
    assert own["runs"] == 2
    assert own["min_clearance"] == vo["min_clearance"]
    assert own["metrics"]["clearance"]["mean"] == pytest.approx(own["min_clearance"])
    entry = Entry(
        "short", lambda p, rng: gallery.build("head_on", {"duration": p["seconds"]}), {"seconds": 0.5}, "A test."
    )
    again = Entry(
        "short", lambda p, rng: gallery.build("empty", {"duration": p["seconds"]}), {"seconds": 0.5}, "Another."
    )
    rows = [Row(scene, {}, [mine()], 1) for scene in (entry, again, gallery.build("empty", {"duration": 0.3}))]
    tables = compare_all(rows, jobs=2)
    assert [one["scenario"] for one in tables] == ["short", "short", "empty"]
    assert [one["methods"]["mine"]["min_clearance"] is None for one in tables] == [False, True, True]
    assert [one["methods"]["mine"]["time"] for one in tables] == [None] * 3


def clearance(recording: slalom.sim.Recording) -> float:
    """Least clearance [m], as a metric of one's own."""
    return METRICS["min_clearance"](recording)


def test_an_objective_is_simulated() -> None:
    scene = gallery.build("empty", {"duration": 2.0})
    run = simulate(scene, "ao", objective=slalom.FollowVelocity((0.0, 1.0)))
    np.testing.assert_allclose(run.velocities[-1, 0], (0.0, 1.0), atol=1e-6)
    own = replace(scene, robots=(replace(scene.robot, objective=slalom.FollowVelocity((0.0, -1.0))),))
    kept = simulate(own, METHODS["ao"], objective=slalom.FollowVelocity((0.0, 1.0)))
    np.testing.assert_allclose(kept.velocities[-1, 0], (0.0, -1.0), atol=1e-6)


def test_method_takes_every_name_that_is_listed() -> None:
    for name in CONTENDERS:
        assert slalom.method(name).name == name
    assert isinstance(slalom.method("orca_limited"), Peer)
    assert {name for name in CONTENDERS if isinstance(slalom.method(name), Peer)} == set(PEERS)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (
            "gone = no_such_module:part",
            r"entry point 'gone' of test\.numbers: expected no_such_module:part to be import",
        ),
        (
            "gone = json:no_such_name",
            r"entry point 'gone' of test\.numbers: expected json:no_such_name to be importable",
        ),
        ("text = json:__name__", r"entry point 'text' of test\.numbers: expected a number, found 'json'"),
        ("one = math:pi", r"entry point 'one' of test\.numbers: expected a name that is free, found one that is taken"),
    ],
)
def test_bad_entry_points_are_refused_each_time(
    points: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, f"[test.numbers]\n{points}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    table = Registry[float]("test.numbers", Kind(lambda part: isinstance(part, float), "a number"), {"one": 1.0})
    assert table["one"] == 1.0
    for _ in range(2):
        with pytest.raises(InvalidInput, match=message):
            list(table)
