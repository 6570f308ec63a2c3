"""Interface of the command line (design, section 6): commands, outputs, exit codes, one clear line per mistake."""

import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from commands import Said, Say, but_notice, saying
from draws import draws
from galleries import FLEETS, NAMES

import slalom
from slalom import FORESIGHTS, METHODS, InvalidInput, Outcome, kernels
from slalom.cli import call
from slalom.cli.console import progress
from slalom.cli.file_keys import FAMILIES, MAPPINGS
from slalom.decision.objective import OBJECTIVES
from slalom.forecast.forecast import foresight_of
from slalom.io.formats import FORMATS
from slalom.io.table import SAMPLES, sample_data
from slalom.paper import TITLES
from slalom.peers import CONTENDERS, PEERS, contender
from slalom.sim import Recording, load, simulate
from slalom.sim.gallery import GALLERY
from slalom.sim.measure.metrics import METRICS, summary
from slalom.sim.run.simulate import Run
from slalom.sim.sweep.case import Failure

SCENE = """\
robot: {position: [0, 0], velocity: [1, 0], radius: 0.5, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}}
obstacles:
  - {name: rock, radius: 1, trajectory: {kind: stationary, position: [8, 0.2]}}
"""
CADRL = "case,agent,x,y,goal_x,goal_y,pref_speed,radius\n0,0,-3,0,3,0,1,0.5\n0,1,3,0.2,-3,0,1,0.5\n"
MAGIC = {".svg": b"<?xml", ".pdf": b"%PDF", ".png": b"\x89PNG"}
OF_RUN = {
    "scenario",
    "method",
    "foresight",
    "seed",
    "robots",
    "arrived",
    "collisions",
    "min_clearance",
    "time",
    "adjustments",
    "jerk",
    "decision_us",
    "statuses",
}
OF_DECIDE = {"control", "foresight", "status", "clearance", "time_to_collision"}
OF_COMPARE = {"foresight", "runs", "runs_with_collision", "runs_all_arrived", "adjustments", "time", "min_clearance"}
OF_COMPARE |= {"jerk", "guided"}


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Say:
    """Run a command in an empty folder with a scene in it."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return saying(capsys)


def process(*tokens: str, module: bool = False, **settings) -> Said:
    """Run a command in a process of its own."""
    program = [sys.executable, "-m", "slalom"] if module else [str(Path(sys.executable).with_name("slalom"))]
    done = subprocess.run([*program, *tokens], capture_output=True, text=True, check=False, **settings)
    return Said(done.returncode, done.stdout, but_notice(done.stderr))


@pytest.mark.parametrize(
    "scenario", draws(["scene.yaml", *(name for name in NAMES if name != "recorded_roundabout")], 8)
)
def test_run_says_what_happened_in_json(scenario: str, say: Say) -> None:
    """The numbers are those of the library."""
    settings = {"duration": 2.0} | ({"robots": 4.0} if scenario in FLEETS else {})
    changed = [token for name, value in settings.items() for token in ("--set", f"{name}={value:g}")]
    said = say("run", scenario, *changed, "--seed", "2", "--method", "nlvo", "--json")
    found = said.json
    assert set(found) >= OF_RUN
    assert set(found["decision_us"]) == {"p50", "p99", "max"}
    run = simulate(load(scenario, settings, seed=2), METHODS["nlvo"], seed=2)
    assert found["scenario"] == run.scenario
    assert (found["method"], found["seed"], found["robots"]) == ("nlvo", 2, len(run.shapes))
    assert found["time"] == run.times[-1] - run.times[0]
    assert found["arrived"] == int(np.isfinite(run.arrived).sum())
    assert sum(found["statuses"].values()) == len(run.outcomes) * len(run.shapes)
    assert set(found["statuses"]) <= {outcome.name for outcome in Outcome}
    assert isinstance(found["collisions"], int)
    assert said.code == (0 if found["arrived"] == found["robots"] and not found["collisions"] else 1)


def test_run_without_json_is_for_people(say: Say) -> None:
    said = say("run", "scene.yaml")
    assert said.code == 0
    assert said.err == ""
    assert said.out.startswith("scene with nao, seed 0: arrived, no collision\n")
    assert re.search(r"least clearance +0\.0\d+ m", said.out)
    assert max(len(line) for line in said.out.splitlines()) <= 120


def test_run_fails_when_the_robot_does_not_arrive(say: Say) -> None:
    said = say("run", "scene.yaml", "--set", "duration=2")
    assert said.code == 1
    assert "did not arrive" in said.out
    assert say("run", "scene.yaml", "--set", "duration=2", "--json").json["arrived"] == 0


def test_a_fleet_of_which_some_arrive_says_how_many(say: Say) -> None:
    robot = "- {radius: 0.2, max_speed: 1, max_acceleration: 1, position: [0, %d], goal: {position: [%d, %d]}}\n"
    Path("two.yaml").write_text(f"duration: 4\nrobots:\n{robot % (0, 2, 0)}{robot % (5, 20, 5)}")
    said = say("run", "two.yaml")
    assert said.code == 1
    assert said.out.startswith("two with nao, seed 0: 1 of 2 arrived, no collision\n")


def test_run_fails_when_something_is_hit(say: Say) -> None:
    """A wall too near to stop."""
    Path("wall.yaml").write_text(SCENE.replace("velocity: [1, 0]", "velocity: [2, 0]").replace("[8, 0.2]", "[2, 0]"))
    said = say("run", "wall.yaml", "--json")
    assert said.code == 1
    assert said.json["collisions"] == 1
    assert said.json["min_clearance"] < -0.001
    assert ", 1 collision\n" in say("run", "wall.yaml").out


def test_settings_may_be_repeated(say: Say) -> None:
    for tokens in (["--set", "distance=5", "--set", "duration=0.5"], ["--set", "distance=5", "duration=0.5"]):
        found = say("run", "empty", *tokens, "--out", "run.h5", "--json").json
        assert found["time"] == 0.5
        assert Recording.load("run.h5").parameters == {"distance": 5.0, "duration": 0.5}
        assert Recording.load("run.h5").goals[0].trajectory.initial_position.tolist() == [5.0, 0.0]


@pytest.mark.parametrize("foresight", draws(FORESIGHTS, 2))
def test_the_foresight_is_named_in_every_result(foresight: str, say: Say) -> None:
    """In what is printed, in the recording, in the picture, in a decision; with either way to ask for it."""
    level, settings = foresight_of(FORESIGHTS[foresight]), ["--set", "duration=0.5"]
    files = ["--out", "run.h5", "--figure", "run.svg", "--figure-at", "0.2"]
    found = say("run", "head_on", *settings, "--method", f"nao@{foresight}", "--json", *files).json
    assert (found["method"], found["foresight"]) == (f"nao@{foresight}", level)
    assert f"head_on, nao@{foresight}, 0.2 s after the start" in Path("run.svg").read_text()
    loaded = Recording.load("run.h5")
    assert (loaded.method, loaded.foresight) == (f"nao@{foresight}", level)
    assert summary(loaded) == found
    same = say("run", "head_on", *settings, "--foresight", foresight)
    assert same.out.startswith(f"head_on with nao@{foresight}, seed 0: ")
    assert f"\n  foresight          {level}: " in same.out
    decided = say("decide", "head_on", "--foresight", foresight, "--json").json
    assert (decided["method"], decided["foresight"]) == (f"nao@{foresight}", level)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "nao_ahead"])
def test_foresight_among_robots_is_of_each_other(method: str, say: Say) -> None:
    found = say("run", "circle", "--set", "robots=2", "duration=0.2", "--method", method, "--json").json
    assert found["foresight"] == ("published" if method == "nao_shared" else "observed")


def test_out_is_the_recording(say: Say) -> None:
    said = say("run", "scene.yaml", "--out", "run.h5", "--json")
    loaded = Recording.load("run.h5")
    assert loaded.digest() == simulate(load("scene.yaml"), METHODS["nao"]).digest()
    assert said.json["time"] == loaded.times[-1]


@pytest.mark.parametrize("suffix", draws(MAGIC))
def test_figures_of_runs_and_decisions(suffix: str, say: Say) -> None:
    assert say("run", "scene.yaml", "--set", "duration=2", "--figure", f"run{suffix}", "--json").json
    status = say("decide", "scene.yaml", "--figure", f"scene{suffix}", "--json").json["status"]
    for name in ("run", "scene"):
        assert Path(name + suffix).read_bytes().startswith(MAGIC[suffix])
    if suffix == ".svg":
        assert f"scene, nao: {status.lower()}" in Path("scene.svg").read_text()


def test_at_chooses_the_decision_that_is_drawn(say: Say) -> None:
    for at, shown in (("0", "0.0 s after the start"), ("1.04", "1.0 s after the start")):
        assert say("run", "scene.yaml", "--set", "duration=2", "--figure", "a.svg", "--at", at).code == 1
        assert shown in Path("a.svg").read_text()


def test_list(say: Say) -> None:
    kinds = ("scenarios", "methods", "foresights", "metrics", "objectives", "formats", "figures", "samples")
    every, *parts = (say("list", *what) for what in ([], *([kind] for kind in kinds)))
    assert {said.code for said in (every, *parts)} == {0}
    assert every.out == "".join(said.out for said in parts)
    scenarios, methods, foresights, metrics, objectives, formats, figures, samples = parts
    assert all(f"  {name} " in metrics.out for name in METRICS)
    assert all(f"  {name} " in objectives.out for name in OBJECTIVES)
    for entry in GALLERY.values():
        assert entry.name in scenarios.out
        assert entry.sentence in scenarios.out
        assert all(f"{name}=" in scenarios.out for name in entry.parameters)
    for method in (*METHODS.values(), *PEERS.values()):
        assert method.name in methods.out
        assert method.sentence in methods.out
        assert method.source in methods.out
    assert all(name in figures.out and title in figures.out for name, title in TITLES.items())
    assert all(re.search(rf"^  {name} +[A-Z].*\.$", foresights.out, re.M) for name in FORESIGHTS)
    assert all(f"{name} " in samples.out and sentence in samples.out for name, sentence in SAMPLES.items())
    assert all(row.name in formats.out and row.sentence in formats.out for row in FORMATS.values())


def test_list_json(say: Say) -> None:
    both = say("list", "--json").json
    kinds = {"scenarios", "methods", "foresights", "metrics", "objectives", "formats", "figures", "samples"}
    assert set(both) == kinds
    assert {name: row["level"] for name, row in both["foresights"].items()} == {
        name: foresight_of(rule) for name, rule in FORESIGHTS.items()
    }
    assert {name: row["foresight"] for name, row in both["methods"].items()} == {
        name: row.foresight for name, row in CONTENDERS.items()
    }
    assert {name for name, row in both["formats"].items() if row["suffix"]} == {"csv", "trajnet", "jupedsim"}
    assert set(both["figures"]) == set(TITLES)
    assert set(both["scenarios"]) == set(GALLERY)
    assert set(both["methods"]) == {*METHODS, *PEERS}
    assert both["scenarios"]["head_on"]["parameters"] == {"speed": 5.0, "offset": 0.0}
    assert say("list", "scenarios", "--json").json == {"scenarios": both["scenarios"]}
    assert say("list", "methods", "--json").json == {"methods": both["methods"]}


def test_list_keys(say: Say) -> None:
    """Of all parts, of one mapping, of a family of parts, and of the kinds of one name; as in the reference."""
    every = say("list", "keys")
    assert every.code == 0
    for name, mapped in MAPPINGS.items():
        found = say("list", "keys", name, "--json").json[name]
        assert list(found) == list(mapped.model.model_fields)
        assert f"  {name:22} {', '.join(found)}\n" in every.out
    for name, family in FAMILIES.items():
        assert len(say("list", "keys", name, "--json").json) == len(family.kinds)
    assert "  stop                   true or false, by default false: whether" in say("list", "keys", "goal").out
    assert "  max_speed              number above 0, required: [m/s]" in say("list", "keys", "robot").out
    assert "  phase                  number, by default 0.0: [rad]" in say("list", "keys", "circular").out
    assert set(say("list", "keys", "box", "--json").json) == {
        "kind: box (positions and goals of a group)",
        "kind: box (bounds)",
    }


@pytest.mark.parametrize("method", METHODS)
def test_decide(method: str, say: Say) -> None:
    said = say("decide", "scene.yaml", "--method", method, "--json")
    found = said.json
    assert set(found) >= OF_DECIDE
    assert said.code == 0
    assert found["status"] in ("CLEAR", "CONSTRAINED")
    assert len(found["control"]) == 2
    assert found["clearance"] >= 0.05 - 1e-6
    assert found["time_to_collision"] is None or 0.0 < found["time_to_collision"] <= 6.0
    text = say("decide", "scene.yaml", "--method", method)
    assert text.code == 0
    assert f"status             {found['status']}" in text.out


def test_decide_time_to_collision_is_that_of_the_preferred_control(say: Say) -> None:
    """The robot would drive straight into the rock, and first touch it half a metre and a metre before its centre."""
    scene = SCENE.replace("velocity: [1, 0]", "velocity: [2, 0]").replace("0.2", "0")
    Path("ahead.yaml").write_text(scene)
    found = say("decide", "ahead.yaml", "--method", "nlvo", "--json").json
    assert found["preferred"] == pytest.approx([2.0, 0.0])
    assert found["time_to_collision"] == pytest.approx(6.5 / 2.0, abs=1e-6)
    assert found["preferred_admissible"]
    said = say("decide", "ahead.yaml", "--method", "nlvo")
    assert "\npreferred collides after 3.25 s" in said.out
    assert "exceeds" not in said.out
    assert "\npreferred collides with nothing within the horizon\n" in say("explain", "empty").out
    assert "\npolicy             1 calls, " in say("explain", "empty", "--stages").out


def test_decide_shows_the_limits_that_the_preferred_control_exceeds(say: Say) -> None:
    """To stop at its goal, the robot would have to accelerate more than it may."""
    Path("stop.yaml").write_text(SCENE.replace("[20, 0]}", "[20, 0], stop: true}"))
    found = say("decide", "stop.yaml", "--json").json
    assert np.linalg.norm(found["preferred"]) > 1.0
    assert (found["preferred_admissible"], found["max_speed"], found["max_acceleration"]) == (False, 2.0, 1.0)
    assert "exceeds the limits (2 m/s, 1 m/s^2)" in say("decide", "stop.yaml").out


def test_decide_fails_when_nothing_is_safe(say: Say) -> None:
    fast = SCENE.replace("velocity: [1, 0]", "velocity: [2, 0]")
    for name, place, status in (
        ("near", "[2, 0]", "DELAYED"),
        ("touch", "[1.6, 0]", "IMPACT"),
        ("in", "[1, 0]", "ESCAPING"),
    ):
        Path(f"{name}.yaml").write_text(fast.replace("[8, 0.2]", place))
        said = say("decide", f"{name}.yaml", "--json")
        assert said.code == 1
        assert said.json["status"] == status
        assert set(said.json) >= OF_DECIDE
    assert say("decide", "in.yaml").code == 1


def test_compare(say: Say) -> None:
    tokens = ["compare", "roundabout_crossing", "--set", "duration=1", "--methods", "vo, nlvo", "--seeds", "2"]
    said = say(*tokens, "--json")
    assert said.code == 0
    found = said.json
    assert set(found) >= {"scenario", "seeds", "methods"}
    assert (found["scenario"], found["seeds"]) == ("roundabout_crossing", 2)
    assert list(found["methods"]) == ["vo", "nlvo"]
    for row in found["methods"].values():
        assert set(row) >= OF_COMPARE
        assert row["runs"] == 2
    text = say(*tokens)
    assert text.code == 0
    assert text.err == ""
    assert [line.split()[0] for line in text.out.splitlines()[2:]] == ["vo", "nlvo"]


def test_compare_and_studies_take_levels_of_foresight(say: Say) -> None:
    """A row for each, with its level, in text and on the page; the rows are those of the runs."""
    names = ["nao@recorded", "nao@observed_turn", "avo"]
    tokens = ["roundabout_crossing", "--set", "duration=1", "--methods", ",".join(names), "--seeds", "1"]
    rows = say("compare", *tokens, "--json").json["methods"]
    assert {name: row["foresight"] for name, row in rows.items()} == dict(
        zip(names, ("recorded", "observed", "observed"))
    )
    text = say("compare", *tokens).out.splitlines()
    assert [line.split()[:2] for line in text[1:]] == [
        ["method", "foresight"],
        *([name, rows[name]["foresight"]] for name in names),
    ]
    Path("study.yaml").write_text("methods: [nao@present]\nseeds: 1\nscenarios: [{scenario: scene.yaml}]\n")
    (row,) = say("compare", "study.yaml", "--set", "duration=0.3", "--page", "page.md", "--json").json["rows"]
    assert (row["method"], row["foresight"]) == ("nao@present", "present")
    assert "| nao@present | present | 1, deterministic |" in Path("page.md").read_text()
    Path("study.yaml").write_text("methods: [nao@seen, orca@observed]\nscenarios: [{scenario: scene.yaml}]\n")
    said = say("compare", "study.yaml")
    assert said.code == 2
    one, two = said.err.splitlines()
    assert re.match(r"study\.yaml:1:11: methods\.0: foresight: expected one of recorded, .*; found 'seen'", one)
    assert re.match(r"study\.yaml:1:21: methods\.1: expected orca alone, .*; found 'orca@observed'", two)


STUDY = """\
title: Two scenarios
text: Of which one is drawn.
methods: [avo]
seeds: 2
scenarios:
  - {scenario: head_on, settings: {duration: 0.5}}
  - {scenario: scene.yaml, settings: {duration: 0.3}, methods: [vo, ao]}
"""


def test_compare_a_study(say: Say) -> None:
    """As its file says, or otherwise if it is told so."""
    Path("study.yaml").write_text(STUDY)
    keys = ("scenario", "method", "seeds", "settings")

    def rows(*tokens: str) -> list[tuple]:
        return [tuple(row[key] for key in keys) for row in say("compare", "study.yaml", *tokens, "--json").json["rows"]]

    head_on, scene = {"duration": 0.5}, {"duration": 0.3}
    assert rows() == [("head_on", "avo", 2, head_on), ("scene.yaml", "vo", 2, scene), ("scene.yaml", "ao", 2, scene)]
    assert rows("--only", "head_on", "--seeds", "1", "--methods", "vo") == [("head_on", "vo", 1, head_on)]
    assert rows("--only", "head_on", "--set", "margin=0.1") == [("head_on", "avo", 2, head_on | {"margin": 0.1})]


def test_compare_writes_a_page(say: Say) -> None:
    """With the command that makes it again, and intervals."""
    Path("study.yaml").write_text(STUDY)
    tokens = ["compare", "study.yaml", "--seeds", "3", "--page", "a b.md"]
    assert say(*tokens, "--jobs", "1", "--store", "kept").code == 0
    page = Path("a b.md").read_text()
    assert page.startswith("# Two scenarios\n\nOf which one is drawn.\n\nMade by `slalom ")
    (command,) = re.findall(r"^Made by `(.*)` with slalom .*, numpy ", page, re.M)
    assert shlex.split(command) == ["slalom", *tokens]
    lines = [line for line in page.splitlines() if line.startswith("|")]
    assert [line.split(" | ")[:4] for line in lines[2:]] == [
        ["| head_on duration=0.5", "avo", "observed", "1, deterministic"],
        ["| scene.yaml duration=0.3", "vo", "observed", "1, deterministic"],
        ["| scene.yaml duration=0.3", "ao", "observed", "1, deterministic"],
    ]
    assert {line.count("|") for line in lines} == {15}
    assert "| 1, deterministic | no | 0 | 0 | 0 | - |" in lines[2]
    Path("a b.md").unlink()
    assert say(*shlex.split(command)[1:]).code == 0
    assert Path("a b.md").read_text() == page


def test_compare_writes_a_csv_file(say: Say) -> None:
    """A row for each scenario and method, with the numbers of the JSON object to the bit."""
    Path("study.yaml").write_text(
        "methods: [nao, vo]\nseeds: 2\nmetrics: [success]\nscenarios:\n"
        "- {scenario: circle, settings: {robots: 2, radius: 3}}\n"
        "- {scenario: circle, settings: {robots: 2, radius: 3, guided: 0}, methods: [nao]}\n"
    )
    found = say("compare", "study.yaml", "--out", "new/table.csv", "--json").json["rows"]
    with open("new/table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["guided"], row["settings"]) for row in rows] == [
        ("nao", "true", "robots=2.0 radius=3.0"),
        ("vo", "true", "robots=2.0 radius=3.0"),
        ("nao", "false", "robots=2.0 radius=3.0 guided=0.0"),
    ]
    for row, expected in zip(rows, found, strict=True):
        for name in ("runs", "runs_all_arrived", "time", "adjustments", "jerk", "efficacy", "min_clearance"):
            assert float(row[name]) == expected[name]
        low, high = expected["runs_successful_interval"]
        assert (float(row["runs_successful_low"]), float(row["runs_successful_high"])) == (low, high)
        assert float(row["extra_time_90"]) == expected["extra_time"][2]
        assert float(row["success"]) == expected["metrics"]["success"]["mean"]
        assert row["failures"] == ""
    said = say("compare", "study.yaml", "--csv", "table.txt")  # the former name of the option
    assert said.err == "--out: expected a file that ends in .csv or .tex, found 'table.txt'\n"
    tokens = ["compare", "study.yaml", "--csv", "a.csv", "--shard", "1/2", "--store", "kept"]
    assert "--out: expected without --shard" in say(*tokens).err
    Path("two.csv").write_text(CADRL)
    said = say("compare", "two.csv", "--methods", "nao", "--seeds", "1", "--csv", "two.csv")
    assert said.err == "two.csv: expected a file other than the source, found the same\n"


def test_a_study_of_lists_is_a_table_and_a_figure(say: Say) -> None:
    """Every combination once; a file of each kind by its name."""
    tokens = ["compare", "head_on", "--methods", "nao", "--set", "offset=0,1.5", "margin=0.05:0.25:0.1", "duration=0.5"]
    rows = say(*tokens, "--out", "a.csv", "b.tex", "--figure", "c.svg", "--json").json["rows"]
    expected = [(offset, margin) for offset in (0.0, 1.5) for margin in (0.05, 0.15, 0.25)]
    assert [(row["settings"]["offset"], row["settings"]["margin"]) for row in rows] == expected
    with open("a.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert [(float(row["offset"]), float(row["margin"])) for row in table] == expected
    assert "duration" not in table[0]
    lines = Path("b.tex").read_text().splitlines()
    assert lines[0].startswith("% Made by slalom compare head_on --set offset=0,1.5 --set margin=0.05:0.25:0.1 --set")
    assert lines[0].split(" with ")[0].endswith(" --methods nao --out b.tex")
    body = lines[lines.index(r"\midrule") + 1 : lines.index(r"\bottomrule")]
    assert [tuple(map(float, line.split(" & ")[:2])) for line in body] == expected
    assert Path("c.svg").read_text().count("margin") >= 1


def test_settings_without_effect_are_named_once(say: Say) -> None:
    said = say("compare", "head_on", "--methods", "nao,vo", "--set", "duration=0.2", "guided=0,1", "margin=0.1,0.2")
    assert said.err == "guided: no effect on nao in head_on, vo in head_on\n"


def test_compare_says_what_it_keeps_when_it_is_stopped(say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the same command makes the rest."""
    tokens = ["compare", "roundabout_crossing", "--set", "duration=0.3", "margin=0.1,0.2", "--methods", "vo"]
    tokens += ["--seeds", "2", "--json"]
    whole = say(*tokens).out

    def stopped(work: Callable, items: dict, **_: object) -> Iterator[tuple]:
        for k, (key, case) in enumerate(items.items()):
            if k == 3:
                raise KeyboardInterrupt
            yield key, work(case)

    with monkeypatch.context() as patched:
        patched.setattr("slalom.sim.sweep.study.map_surviving_kills", stopped)
        said = say(*tokens, "--store", "kept")
        assert (said.code, said.out) == (130, "")
        assert said.err == (
            "slalom: stopped after 3 of 4 runs. kept keeps the finished ones; the same command makes the others.\n"
        )
        assert "None is kept; with --store FOLDER each finished run is." in say(*tokens).err
    assert len(list(Path("kept").iterdir())) == 3
    assert say(*tokens, "--store", "kept").out == whole


def test_compare_says_which_files_of_cases_are_not_there(say: Say) -> None:
    """On stderr, in JSON and on the page; where they are is told by --data, and does not get onto the page."""
    Path("study.yaml").write_text(
        "methods: [nao_shared]\nseeds: 1\nscenarios: [{scenario: two.csv}, {scenario: three.csv}]\n"
    )
    Path("folder").mkdir()
    Path("folder/two.csv").write_text(CADRL)
    tokens = ["compare", "study.yaml", "--data", "folder"]
    said = say(*tokens, "--page", "page.md", "--json")
    assert said.code == 0
    assert said.err == ("three.csv: left out, no such file; --data gives the folder of the test cases\n")
    found = json.loads(said.out)
    assert found["left_out"] == ["three.csv"]
    (row,) = found["rows"]
    assert (row["scenario"], row["runs"], row["runs_successful"]) == ("folder/two.csv", 1, 1)
    page = Path("page.md").read_text()
    assert "`slalom compare study.yaml --data DATA_DIR --page page.md`" in page
    assert (
        "\nLeft out, because the files of test cases were missing when this page was made: the rows of "
        "`three.csv`.\n" in page
    )
    (line,) = [line for line in page.splitlines() if line.startswith("| two.csv | nao_shared | published | 1 |")]
    extra = ", ".join(f"{x:.2f}" for x in row["extra_time"])
    assert line.endswith(f"| {extra} | {row['efficacy']:.2f} | {row['min_clearance']:.3f} |")
    shutil.copy("folder/two.csv", "folder/three.csv")
    said = say(*tokens, "--page", "page.md", "--force", "--json")
    assert (said.err, said.json["left_out"]) == ("", [])
    assert "eft out" not in Path("page.md").read_text()
    alone = say("compare", "folder/two.csv", "--methods", "nao_shared", "--seeds", "1", "--json").json
    assert alone["methods"]["nao_shared"].items() <= row.items()


def test_compare_says_what_cannot_run(say: Say) -> None:
    """In the row, with the reason; it fails if there is nothing else."""
    try:
        contender("orca")
    except InvalidInput:
        pytest.skip("its package is not installed")
    tokens = ["compare", "drones_crossing", "--set", "duration=0.2", "--seeds", "2", "--page", "page.md"]
    said = say(*tokens, "--methods", "orca,avo")
    assert said.code == 0
    reason = "orca: none ran: drone: expected a disc in the plane with max_speed and max_acceleration alone"
    assert reason in said.out
    (line,) = [line for line in Path("page.md").read_text().splitlines() if " | orca | " in line]
    assert "0; none ran: drone: expected a disc" in line
    assert line.endswith("| no | - | - | - | - | - | - | - | - | - |")
    assert say(*tokens, "--force", "--methods", "orca").code == 1


def test_compare_fails_when_runs_were_killed(say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    """It says which, and the table of the others."""

    def survive(work: Callable, items: dict, **_: object) -> Iterator[tuple]:
        for key, case in items.items():
            yield key, Failure("its process was killed", True) if case.seed % 2 else work(case)

    monkeypatch.setattr("slalom.sim.sweep.study.map_surviving_kills", survive)
    said = say("compare", "empty", "--set", "duration=0.2", "--methods", "avo", "--seeds", "5", "--page", "page.md")
    assert said.code == 1
    assert "avo: 2 did not run (seeds 1, 3): its process was killed" in said.out
    assert (
        "| avo | observed | 1, deterministic; 2 did not run (seeds 1, 3): its process was killed | no | 0 |"
        in Path("page.md").read_text()
    )


def test_show_says_what_run_said(say: Say) -> None:
    """Of the file alone, with the same figure; folders are made."""
    said = say("run", "scene.yaml", "--out", "a/b/run.h5", "--figure", "c/run.svg", "--json")
    shown = say("show", "a/b/run.h5", "--figure", "d/e/run.svg", "--json")
    assert (shown.code, shown.json) == (0, said.json)
    drawn = [
        re.sub(r"id=\"[^\"]*\"|#[a-z]\w+|<dc:date>.*", "", Path(f).read_text()) for f in ("c/run.svg", "d/e/run.svg")
    ]
    assert drawn[0] == drawn[1]
    assert say("show", "a/b/run.h5").out.startswith("scene with nao, seed 0: arrived, no collision\n")
    said = say("run", "a/b/run.h5")
    assert said.code == 2
    assert said.err.startswith("scenario: expected a scenario or recorded tracks, found the run 'a/b/run.h5', which ")


@pytest.mark.parametrize("name", draws(sorted(NAMES, key=lambda name: name == "recorded_roundabout"), 8))
def test_every_scenario_of_the_gallery_can_be_exported(name: str, say: Say) -> None:
    """The file is the same scenario: written again, it is the same text, and its robots move the same."""
    said = say("export-scenario", name, "--seed", "3")
    assert (said.code, said.err) == (0, "")
    Path("again.yaml").write_text(said.out)
    assert say("export-scenario", "again.yaml").out == said.out
    one, two = load(name, seed=3), load("again.yaml")
    assert [(r.name, r.limits.max_speed) for r in one.robots] == [(r.name, r.limits.max_speed) for r in two.robots]
    for a, b in zip((*one.robots, *one.obstacles), (*two.robots, *two.obstacles), strict=True):
        a, b = (part.goal.trajectory if hasattr(part, "goal") else part.trajectory for part in (a, b))
        t = max(one.start, a.span[0])
        assert b.position(t) == pytest.approx(a.position(t), abs=1e-6)


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_are_named_from_anywhere(name: str, say: Say) -> None:
    """Each is a file that its command reads."""
    tokens = {"study.yaml": ["compare", "--set", "duration=0.3"], "roundabout_ring_11.csv": ["convert", "ring.sqlite"]}
    command, *rest = tokens.get(name, ["run", "--set", "duration=0.3"])
    said = say(command, f"sample:{name}", *rest)
    assert said.code in (0, 1), said.err
    assert said.out


def test_every_file_that_slalom_brings_is_a_sample() -> None:
    assert {path.name for path in sample_data("").iterdir()} - {"README.md"} == set(SAMPLES)


def test_a_page_is_replaced_only_if_told(say: Say) -> None:
    tokens = ["compare", "head_on", "--set", "duration=0.3", "--methods", "vo", "--seeds", "1", "--page", "new/page.md"]
    assert say(*tokens).code == 0
    page = Path("new/page.md").read_text()
    Path("new/page.md").write_text("mine")
    said = say(*tokens)
    assert (said.code, said.out) == (2, "")
    assert Path("new/page.md").read_text() == "mine"
    assert say(*tokens, "--force").code == 0
    assert Path("new/page.md").read_text() == page


@pytest.mark.parametrize(
    ("command", "files"),
    [
        ("run head_on --set duration=0.3 --out a.h5 --figure a.svg", ["a.h5", "a.svg"]),
        ("show run.h5 --figure a.svg", ["a.svg"]),
        ("decide empty --figure a.svg", ["a.svg"]),
        ("convert run.h5 a.csv", ["a.csv"]),
        ("export run.h5 a.html", ["a.html"]),
        ("export run.h5 a.html --force", ["a.html"]),
        ("reproduce moving_obstacle --quick --out .", ["moving_obstacle.svg", "paper.md"]),
    ],
)
def test_all_other_files_are_replaced(command: str, files: list[str], say: Say) -> None:
    """Also with the option that earlier versions needed."""
    say("run", "head_on", "--set", "duration=0.3", "--out", "run.h5")
    for file in files:
        Path(file).write_text("mine")
    assert say(*command.split()).code in (0, 1)
    for file in files:
        assert Path(file).read_bytes() != b"mine"


def test_a_run_loads_its_kernels_before_its_first_decision(say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    """By one step of a run that is discarded; the result is that of a run without it."""
    made, steps = list[list[float]](), Run.steps

    def noted(run: Run) -> Iterator[float]:
        made.append([])
        for share in steps(run):
            made[-1].append(share)
            yield share

    monkeypatch.setattr(Run, "steps", noted)
    assert say("run", "head_on", "--set", "duration=0.5", "--out", "run.h5").code == 1
    assert [len(each) for each in made] == [1, 5]
    scenario = load("head_on", {"duration": 0.5})
    np.testing.assert_array_equal(Recording.load("run.h5").positions, simulate(scenario, "nao").positions)


def test_reproduce_writes_figures_in_the_format_of_their_names(say: Say) -> None:
    """With the resolution of a picture; a page shows pictures, and links to a PDF."""
    said = say("reproduce", "moving_obstacle.png", "linear_vo.pdf", "--quick", "--out", "x", "--resolution", "50")
    assert said.code == 0
    assert Path("x/linear_vo.pdf").read_bytes().startswith(b"%PDF")
    assert Path("x/moving_obstacle.png").read_bytes().startswith(b"\x89PNG")
    assert Path("x/moving_obstacle.png").stat().st_size < 40_000
    page = Path("x/paper.md").read_text()
    assert re.search(r"!\[.*\]\(moving_obstacle\.png\)", page)
    assert re.search(r"(?<!!)\[.*\]\(linear_vo\.pdf\)", page)


def test_long_commands_say_how_long_they_take(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    """Once, from the pace after the first report; short ones say nothing."""
    for pace, said in ((1.0, "running: about 2 min\n"), (0.1, "")):
        clock = iter(range(1000))
        monkeypatch.setattr("slalom.cli.console.time.monotonic", lambda: pace * next(clock))  # noqa: B023
        with progress("running") as advance:
            for k in range(100):
                advance(k / 100)
        assert capsys.readouterr().err == said
    monkeypatch.setattr("slalom.cli.console.time.monotonic", iter(range(1000)).__next__)
    with progress("running", estimated=False) as advance:
        for k in range(100):
            advance(k / 100)
    assert capsys.readouterr().err == ""


LONG = 300 * "a"
"""A name that no file can have."""

BAD = [
    ("run full", r"scenario: expected a \.yaml file or one of empty, .*; found 'full'"),
    ("run none.yaml", r"none\.yaml: expected a readable YAML file, found no such file or folder$"),
    ("run .", r"scenario: expected a \.yaml file or one of .*; found '\.'"),
    ("run data.csv", r"data\.csv: expected a readable file, found no such file or folder$"),
    ("run empty --method best", r"method: expected one of vo, rvo, nlvo, avo, ao, nao, .*, orca, .*; found 'best'"),
    ("run empty --set distance", r"--set: expected NAME=NUMBER, found 'distance'"),
    ("run empty --set distance=1,2", r"--set distance: expected one number, found 1, 2; `slalom compare` takes lists"),
    ("compare empty --set margin=1 --set margin=2", r"--set: expected each name once, found 'margin' twice; a list"),
    ("compare empty --set margin=1:0:0.5", r"--set: expected a range of 1 to 10000 values, found '1:0:0.5' with 0"),
    ("compare empty --set margin=0:1:1e-9", r"--set: expected a range of 1 to 10000 values, found '0:1:1e-9' with "),
    ("run empty --set wheels=4", r"parameter of empty: expected one of distance, start, .*; found 'wheels'"),
    ("run scene.yaml --set distance=4", r"setting: expected one of start, .*; found 'distance'"),
    ("run roundabout_crossing --seed -1", r"seed: expected 0 or more, found -1"),
    ("run empty --seed one", r"slalom: Invalid value for --seed: expected a whole number, found 'one'$"),
    ("run empty circle", r"slalom: expected no further words, found 'circle'$"),
    ("run empty --set duration=0.1 --figure a.svg --figure-at -1", r"--figure-at: .*, from 0 to .*0\.1 s, found -1 s$"),
    ("run empty --method nao@seen", r"foresight: expected one of recorded, present, .*; found 'seen'"),
    ("run empty --method nao@present --foresight observed", r"--foresight: .* with nao@present, .*; found 'observed'"),
    ("run empty --method orca --foresight observed", r"method: expected orca alone, .*; found 'orca@observed'"),
    ("run empty --at 1 --figure-at 2", r"--at: expected either --at or --figure-at, found 1 and 2"),
    ("run empty --out run.txt", r"--out: expected a file that ends in .*, .csv, .*; found 'run.txt'"),
    ("run empty --set distance=0 --out run.csv", r"run: expected at least one step to write, found a robot "),
    ("run drones_crossing --out run.ndjson", r"--out: expected \.h5 or \.csv for a run in space, found 'run\.ndjson'"),
    ("run empty --figure a.gif", r"--figure: expected a file that ends in \.svg, \.pdf or \.png, found 'a\.gif'"),
    ("run empty --figure scene.yaml/a.svg", r"scene\.yaml/a\.svg: expected a file that can be written, found a "),
    ("run sample:none.yaml", r"sample: expected one of crossing\.yaml, .*; found 'none\.yaml'"),
    ("run run.h5", r"run\.h5: expected a readable file, found "),
    ("show run.h5", r"run\.h5: expected a readable HDF5 recording, found no such file or folder$"),
    ("show scene.yaml", r"scene\.yaml: expected an HDF5 recording, found a file of another kind$"),
    ("convert run.h5 run.csv --gap 1", r"--gap: expected only with recorded tracks, found it with the run 'run\.h5'"),
    ("convert run.h5 run.csv --out-frame-rate 1", r"--out-frame-rate: expected only with recorded tracks, found it "),
    ("convert run.h5 run.txt", r"TARGET: expected a file that ends in .*, \.sqlite for a run; found 'run\.txt'"),
    ("export-scenario circle --set sight_noise=1", r"sight_noise: expected 0 in a file, found 1"),
    ("compare empty --shard 3/2 --store kept", r"shard: expected K/N with K from 1 to N, found '3/2'"),
    ("compare empty --shard 1/2", r"store: expected the folder that all shards share, found none"),
    ("compare empty --shard 1/2 --merge --store kept", r"merge: expected without shard, found both"),
    ("compare empty --shard 1/2 --page a.md --store kept", r"--page: expected without --shard, .*; found 'a\.md'"),
    ("reproduce cone.eps", r"figure or claim: expected cone, or with \.svg, \.pdf, \.png; found 'cone\.eps'"),
    ("compare empty --page scene.yaml", r"--page: expected a new file, or --force .*; found 'scene\.yaml', "),
    ("run empty --set duration=0.1 --out folder.h5", r"folder\.h5: expected .*, found "),
    ("run empty --set distance=0 --figure a.svg", r"--figure: expected a run with at least one step"),
    ("run empty --at soon", r"soon"),
    ("run", r"(?i)scenario"),
    ("run empty --speed 3", r"--speed"),
    ("decide full", r"scenario: expected"),
    ("decide empty --figure a", r"--figure: expected a file that ends in .*, found 'a'"),
    ("list everything", r"everything"),
    ("list methods nao", r"part: expected only with keys, found 'nao' with methods"),
    ("list keys gaol", r"keys: expected one of scenario, .*; found 'gaol'; did you mean 'goal'\?"),
    ("compare full", r"scenario: expected"),
    ("compare empty --methods ,", r"methods: expected at least one"),
    ("compare empty --seeds 0", r"seeds: expected a whole number of 1 or more, found 0"),
    ("compare empty --jobs 0 --seeds 1", r"jobs: expected a number of processes, or -1 for one per core, found 0"),
    ("compare", r"(?i)scenarios"),
    ("compare head_on empty --set speed=4 --store kept", r"parameter of empty: .*found 'speed'"),
    ("compare empty --only ring", r"only: expected one of empty; found 'ring'"),
    ("compare empty --data folder", r"data: expected only with a study file, found it with empty"),
    ("compare empty --seeds 1 --store scene.yaml", r"store: expected a folder that exists or can be made, found "),
    ("run crossing", r"found 'crossing'; did you mean 'sample:crossing\.yaml'\?$"),
    ("export scene.yaml new.html", r"found a scenario; `slalom run scene\.yaml --out run\.h5` runs it first$"),
    ("animate scene.yaml new.mp4", r"scene\.yaml: expected a run in an \.h5 file, found a scenario"),
    ("run empyt", r"found 'empyt'; did you mean 'empty'\?$"),
    ("run Roundabout-crossing", r"; did you mean 'roundabout_crossing'\?$"),
    ("run empty --method noa", r"found 'noa'; did you mean 'nao'\?$"),
    ("run empty --method nao@observd", r"found 'observd'; did you mean 'observed'\?$"),
    ("run empty --set distence=3", r"found 'distence'; did you mean 'distance'\?$"),
    ("run scene.yaml --set dulation=3", r"found 'dulation'; did you mean 'duration'\?$"),
    ("run sample:crosing.yaml", r"found 'crosing\.yaml'; did you mean 'crossing\.yaml'\?$"),
    ("compare empty --metrics sucess", r"found 'sucess'; did you mean 'success'\?$"),
    ("run empty --method=", r"method: expected one of .*; found ''$"),
    ("decide empty --method=", r"method: expected one of .*; found ''$"),
    ("view empty --no-browser --at 3", r"--at: expected only with a recording, found it with 'empty'$"),
    ("view empty --no-browser --method=", r"method: expected one of .*; found ''$"),
    ("run circle --set robots=1e9", r"robots: expected at most 100000, found 1e\+09$"),
    ("run corridor --set people=1e9", r"people: expected at most 100000, found 1e\+09$"),
    ("run doorway --set both=2", r"both: expected True or False, found 2$"),
    ("run recorded_roundabout --set random=2", r"random: expected True or False, found 2$"),
    ("run empty --figure a.svg --figure-at nan", r"--figure-at: expected a time of the run, from 0 .*, found nan s$"),
    ("run empty --figure-at 1", r"--figure-at: expected only with --figure, found it without$"),
    ("run empty --at 1", r"--at: expected only with --figure, found it without$"),
    ("run empty --names", r"--names: expected only with --figure, found it without$"),
    ("run empty --resolution 50", r"--resolution: expected only with --figure, found it without$"),
    ("show run.h5 --uncertainty", r"--uncertainty: expected only with --figure, found it without$"),
    ("ros replay none --resolution 9", r"--resolution: expected only with --figure, found it without$"),
    ("decide empty --font-scale 2", r"--font-scale: expected only with --figure, found it without$"),
    ("decide empty --figure a.png --resolution 1e9", r"--resolution: expected at most \d+ dots .*, found 1e\+09$"),
    ("decide empty --figure a.svg --figure-width 1e9", r"--figure-width: expected at most 200 inch, found 1e\+09$"),
    ("decide empty --figure a.svg --figure-width 0.1", r"--figure-width: expected at least .* inch .*, found 0\.1$"),
    ("compare empty --page a.pdf", r"--page: expected a file that ends in \.md, found 'a\.pdf'$"),
    ("reproduce moving_obstacle --page a.html", r"--page: expected a file that ends in \.md, found 'a\.html'$"),
    ("run sample:study.yaml", r"study\.yaml: expected a scenario, found a study, which `slalom compare` runs$"),
    ("decide sample:roundabout_ring_11.csv", r"expected .* or a name of the gallery, found .*, of another kind$"),
    ("convert sample:roundabout_ring_11.csv a.ndjson --out-frame-rate 0", r"--out-frame-rate: .* above 0, found 0$"),
    (f"run {LONG}", r"scenario: expected a \.yaml file or one of .*; found 'aaa"),
    (f"decide {LONG}", r"scenario: expected a \.yaml file or one of .*; found 'aaa"),
    (f"compare {LONG}", r"scenario: expected a \.yaml file or one of .*; found 'aaa"),
    (f"view {LONG} --no-browser", r"scenario: expected a \.yaml file or one of .*; found 'aaa"),
    (f"compare sample:study.yaml --data {LONG}", r"data: expected a folder, found none at 'aaa"),
    (f"compare empty --page {LONG}.md", r"\.md: expected a file that can be written, found a name that is too long$"),
    (f"run {LONG}.h5", r"expected a readable file, found a name that is too long$"),
    (f"convert {LONG}.csv a.csv", r"expected a readable file, found a name that is too long$"),
    ("convert sample:roundabout_ring_11.csv a.csv --agents=", r"--agents: expected at least one agent .*, found none$"),
    ("fly empty", r"fly"),
    ("--fly", r"--fly"),
]  # fmt: skip


@pytest.mark.parametrize(("tokens", "message"), BAD, ids=[tokens.replace(LONG, "LONG") for tokens, _ in BAD])
def test_bad_input_is_one_clear_line(tokens: str, message: str, say: Say) -> None:
    """Exit code 2, nothing on stdout, no traceback, no file left behind."""
    for name in ("folder.h5", "folder.svg"):
        Path(name).mkdir()
    before = sorted(Path().iterdir())
    said = say(*tokens.split())
    assert said.code == 2
    assert said.out == ""
    assert len(said.err.splitlines()) == 1, said.err
    assert re.search(message, said.err), said.err
    assert sorted(Path().iterdir()) == before


@pytest.mark.parametrize("command", ["run", "decide", "compare"])
def test_every_mistake_of_a_file_is_a_line(command: str, say: Say) -> None:
    """file:line:column: what was expected, what was found."""
    Path("bad.yaml").write_text(SCENE.replace("radius: 0.5", "radius: -1").replace("max_speed", "max_sped"))
    said = say(command, "bad.yaml")
    assert said.code == 2
    assert said.out == ""
    lines = said.err.splitlines()
    assert len(lines) == 3
    assert all(re.match(r"bad\.yaml:1:\d+: robot\.\w+: expected .*found ", line) for line in lines)
    assert any("did you mean 'max_speed'?" in line for line in lines)


@pytest.mark.parametrize("option", ["--out", "--figure"])
def test_files_that_cannot_be_written_are_refused_before_the_run(
    option: str, say: Say, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A long run would be lost."""
    monkeypatch.setattr("slalom.sim.simulate", lambda *_, **__: pytest.fail("it ran"))
    name = {"--out": "a.h5", "--figure": "a.svg"}[option]
    Path(name).mkdir()
    assert say("run", "empty", option, name).err == f"{name}: expected a file that can be written, found a folder\n"
    monkeypatch.setattr("os.access", lambda *_: False)
    said = say("run", "empty", option, f"new/{name}")
    assert (said.code, said.out) == (2, "")
    assert said.err == f"new/{name}: expected a file that can be written, found no permission\n"


def test_a_folder_that_cannot_be_written_to(say: Say) -> None:
    said = say("run", "empty", "--set", "duration=0.1", "--out", "/proc/slalom.h5")
    assert said.code == 2
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert "/proc/slalom.h5: expected " in said.err


# The program itself.


@pytest.mark.parametrize(
    "command", ["run", "list", "decide", "compare", "convert", "reproduce", "show", "export-scenario"]
)
def test_every_command_has_help(command: str, say: Say) -> None:
    said = say(command, "--help")
    assert said.code == 0
    assert said.err == ""
    assert f"slalom {command}" in said.out
    options = {"run": ("--set", "--method", "--foresight", "--seed", "--out", "--figure", "--json")}
    options["run"] += ("--figure-at", "--names", "--at", "--start", "--goal", "--agents", "--frame-rate")
    options |= {"list": ("--json",), "convert": ("--out-frame-rate", "--format", "--without", "--gap", "--json")}
    options |= {"decide": ("--method", "--json", "--figure"), "compare": ("--set", "--methods", "--seeds", "--jobs")}
    options["compare"] += ("--only", "--backend", "--store", "--data", "--page", "--json")
    options |= {"reproduce": ("--out", "--page", "--seeds", "--jobs", "--quick", "--json")}
    options |= {"show": ("--figure", "--figure-at", "--names", "--json"), "export-scenario": ("--set", "--seed")}
    for option in options[command]:
        assert option in said.out


def test_help_names_the_commands(say: Say) -> None:
    """Also when nothing is asked for."""
    for tokens in (["--help"], []):
        said = say(*tokens)
        assert said.code == 0
        assert all(command in said.out for command in ("run", "list", "decide", "compare", "convert", "reproduce"))


def test_version(say: Say) -> None:
    said = say("--version")
    assert (said.code, said.out.strip()) == (0, slalom.__version__)


def imported(*commands: list[str]) -> set[str]:
    """The packages that are imported for commands, in a process of their own."""
    code = f"import sys\nfrom slalom.cli import call\nfor c in {commands}: assert call(c) == 0\n"
    code += "print(*(name for name in sys.modules if '.' not in name), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


HEAVY = {"numpy", "numba", "shapely", "matplotlib", "h5py", "joblib", "pydantic"}


def test_help_is_quick() -> None:
    """Nothing that computes, reads or draws is imported for it."""
    assert not HEAVY & imported(["--help"], ["--version"], ["run", "--help"])


def test_lists_are_quick() -> None:
    """Nothing that compiles, reads or draws is imported for them; metrics need what reads recordings."""
    assert not HEAVY - {"numpy", "shapely", "h5py"} & imported(["list"])
    assert not HEAVY - {"numpy", "shapely"} & imported(["list", "methods"])


def test_the_program_and_the_module_are_the_command_line() -> None:
    """The same words on stdout, and exit codes that a shell sees."""
    one, two = (process("list", "--json", module=module) for module in (False, True))
    assert one == two
    assert one.code == 0
    assert one.json
    failed = process("run", "empty", "--set", "duration=0.2", "--json", module=True)
    assert failed.code == 1
    assert failed.json["arrived"] == 0


@pytest.mark.parametrize("terminal", [True, False])
def test_users_are_told_that_kernels_compile(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also where the output goes into a file; on a terminal with the number of functions compiled."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    assert call(["list"]) == 0
    (tell,) = kernels.when_compiling
    capsys.readouterr()
    tell(kernels.compiling(True))
    assert capsys.readouterr().err == kernels.compiling(True) + "\n"
    for count in kernels.while_compiling:
        count(3)
        count(0)
    shown = capsys.readouterr().err.split("\r\033[K")[1:]
    assert shown == ["3 functions compiled, of about 300 for a first decision", ""] * terminal


def test_compile_says_what_it_has_done(say: Say) -> None:
    """One line for each use; the second time it takes seconds."""
    said = say("compile", "figures", "space", "--jobs", "1")
    assert said.code == 0
    assert said.out == ""
    first, *lines = said.err.splitlines()
    assert first.startswith("slalom: compiling")
    assert [line.partition(":")[0] for line in lines] == ["1 of 2, figures", "2 of 2, space"]
    said = say("compile", "everything")
    assert said.code == 2
    assert (
        said.err == "uses: expected one of robot, polygons, fleets, space, vehicles, ahead, crowd, "
        "learners, figures; found 'everything'\n"
    )


def test_a_reader_that_goes_away_is_no_error() -> None:
    """slalom list | head -1"""
    program = [sys.executable, "-m", "slalom", "list"]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        running.stdout.close()
        assert "Traceback" not in running.stderr.read()


def test_a_full_disk_is_one_clear_line() -> None:
    """The result goes to stdout, which cannot be written: no traceback, also not at exit."""
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("no device that is always full")
    with full.open("w") as target:
        program = [sys.executable, "-m", "slalom", "list", "--json"]
        done = subprocess.run(program, stdout=target, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "stdout: expected output that can be written, found no space left\n"


def test_the_decisions_of_a_run_and_of_its_scenario_are_explained_alike(say: Say) -> None:
    """At the time that is given; the alternatives are those of that time, the reasons name obstacles."""
    assert say("run", "roundabout_crossing", "--seed", "3", "--out", "run.h5").code == 0
    run, kept = Recording.load("run.h5"), 0
    for step in range(2, 60, 19):
        at = str(run.dt * step)
        found = json.loads(say("explain", "run.h5", "--at", at, "--json").out)
        again = json.loads(say("explain", "roundabout_crossing", "--seed", "3", "--at", at, "--json").out)
        assert found == again
        assert (found["status"], found["time"]) == (run.outcomes[step][0], pytest.approx(float(at)))
        np.testing.assert_array_equal(found["control"], run.controls[step, 0])
        names = {obstacle.name for obstacle in run.obstacles}
        assert names >= {one["obstacle"] for one in (*found["passes"], found["preferred_hits"]) if one}
        costs = [one["cost"] for one in found["alternatives"] if one["cost"] is not None]
        assert costs
        # The manoeuvre in force is compared with them: a new one is the best, a kept one at most by the patience worse.
        is_kept = found["began"] < found["time"]
        assert found["cost"] <= (1.01 * min(costs) if is_kept else min(costs)) + 1e-9
        told_of = next(one for one in found["sentences"] if one.startswith("Kept " if is_kept else "Chosen "))
        assert told_of.endswith(f": arrives in {found['cost']:.2f} s.")
        kept += is_kept
        told = say("decide", "run.h5", "--at", at).out
        assert told.endswith("\n".join(found["sentences"]) + "\n")
    assert kept > 0
    for wrong in ("99", "-1"):
        assert say("explain", "run.h5", "--at", wrong).code == 2


@pytest.mark.parametrize("options", ["--at 3", "--start 0,0 --goal 1,1", "--agents a"])
def test_the_view_of_a_run_has_no_options_of_recordings(options: str, say: Say) -> None:
    """They would change nothing."""
    assert say("run", "empty", "--set", "duration=0.1", "--out", "run.h5").code == 1
    said = say("view", "run.h5", "--no-browser", *options.split())
    assert said.code == 2
    assert said.err == f"{options.split()[0]}: expected only with a recording, found it with 'run.h5'\n"


@pytest.mark.parametrize("command", ["show", "export-scenario", "compare", "run"])
def test_a_run_in_the_wrong_place_says_what_it_is(command: str, say: Say) -> None:
    """Also for commands that take scenarios; `show` prints it, without a unit for the clearance that it has not."""
    assert say("run", "empty", "--set", "duration=0.1", "--out", "run.h5").code == 1
    said = say(command, "run.h5")
    if command == "show":
        assert "least clearance    none\n" in said.out
    else:
        assert said.code == 2
        assert said.err.startswith("scenario: expected a scenario or recorded tracks, found the run 'run.h5'")


def test_a_scenario_is_exported_with_its_name_in_any_encoding(say: Say) -> None:
    """Stdout may be ASCII; the file is read as UTF-8."""
    Path("own.yaml").write_text(f"name: Käfig ↔\n{SCENE}", encoding="utf-8")
    said = process("export-scenario", "own.yaml", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (said.code, said.err) == (0, "")
    assert said.out.isascii()
    Path("again.yaml").write_text(said.out)
    assert load("again.yaml").name == load("own.yaml").name == "Käfig ↔"
    assert say("export-scenario", "own.yaml").out.startswith("name: Käfig ↔\n")


def test_names_of_files_may_be_no_text(say: Say) -> None:
    """Bytes that are no UTF-8, as of a file from another system, end no command."""
    name = os.fsdecode(b"\xfc.yaml")
    try:
        Path(name).write_text(SCENE)
    except OSError:
        pytest.skip("the file system takes no such name")
    assert say("run", name, "--set", "duration=0.2", "--out", "run.h5").code == 1
    assert Recording.load(Path("run.h5")).scenario == "\ufffd"
    said = say("compare", name, "--methods", "nao", "--seeds", "1", "--store", "kept", "--page", "page.md")
    assert said.code == 0
    assert b"\xfc.yaml" in Path("page.md").read_bytes()


def test_options_of_figures_say_how_they_look(say: Say) -> None:
    """Width times resolution are the points of a bitmap; every command that draws has these options."""
    tokens = ["--figure-width", "8", "--font-scale", "1.2", "--resolution", "50"]
    assert say("decide", "empty", "--figure", "a.png", *tokens, "--uncertainty").code == 0
    run = ["run", "empty", "--set", "duration=0.3", "--out", "run.h5"]
    assert say(*run, "--figure", "b.png", *tokens).code == 1
    assert say("show", "run.h5", "--figure", "c.png", *tokens).code == 0
    for name in "abc":
        # The width of a PNG is in bytes 16 to 19.
        assert int.from_bytes(Path(f"{name}.png").read_bytes()[16:20], "big") == 400
    assert say("reproduce", "moving_obstacle", "--quick", "--out", "paper", "--figure-width", "5").code == 0
    assert re.search(r'<svg [^>]*width="360pt"', Path("paper/moving_obstacle.svg").read_text())
