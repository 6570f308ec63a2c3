"""Studies: the same table to the bit whatever the number of jobs, and the right one."""

import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from galleries import NAMES, installed, nudged

from slalom import METHODS, InvalidFile, SlalomError
from slalom.io.pedestrians import read_cases
from slalom.sim import Row, compare, compare_all, data_frame, grid, load, metrics, read_scenario, read_study, simulate
from slalom.sim.gallery import GALLERY, build
from slalom.sim.gallery.fleets import cadrl
from slalom.sim.sweep.case import drawn, is_deterministic, run_case, run_one, without_effect
from slalom.sim.sweep.study import cases_of, flat, is_study, mean_interval, named, wilson
from slalom.sim.sweep.tables import csv_text, latex_text, printed

SHORT = {"duration": 3.0}
FLEETS = Path(__file__).parents[2] / "benchmarks" / "fleets.yaml"


def test_the_table_is_that_of_the_single_runs() -> None:
    """Counts, means and the least clearance, from runs made one by one."""
    settings = {"duration": 5.0, "margin": 0.1}
    table = compare("roundabout_exit", ["vo", "nlvo"], 2, settings=settings)
    assert table["scenario"] == "roundabout_exit"
    assert table["seeds"] == 2
    assert table["settings"] == settings
    assert list(table["methods"]) == ["vo", "nlvo"]
    for name, row in table["methods"].items():
        runs = [simulate(build("roundabout_exit", settings, seed=s), METHODS[name], seed=s) for s in range(2)]
        done = [run for run in runs if np.isfinite(run.arrived[0])]
        assert row["runs"] == 2
        assert row["runs_with_collision"] == sum(metrics.collisions(run) > 0 for run in runs)
        assert row["runs_all_arrived"] == len(done)
        assert row["adjustments"] == np.mean([metrics.adjustments(run) for run in runs])
        assert row["jerk"] == np.mean([metrics.mean_jerk(run) for run in runs])
        assert row["time"] == (np.mean([metrics.time(run) for run in done]) if done else None)
        assert row["runs_successful"] == sum(metrics.success(run) for run in runs)
        assert row["efficacy"] == pytest.approx(np.mean([metrics.efficacy(run) for run in runs]), abs=5e-4)
        extra = [metrics.extra_time(run) for run in done]
        assert row["extra_time"] == (list(np.percentile(extra, (50, 75, 90))) if done else None)
        assert row["min_clearance"] == min(metrics.min_clearance(run) for run in runs)
        outcomes = [name for run in runs for (name,) in run.outcomes]
        assert row["outcomes"] == {name: outcomes.count(name) for name in sorted(set(outcomes))}
    assert json.loads(json.dumps(table, allow_nan=False)) == table


def test_no_arrival_and_no_robot() -> None:
    """No time, no clearance: None, which JSON can say."""
    row = compare("empty", ["nao"], 2, settings={"duration": 0.5})["methods"]["nao"]
    assert row["runs"] == 2
    assert row["runs_all_arrived"] == 0
    assert row["time"] is None
    assert row["min_clearance"] is None
    assert row["runs_with_collision"] == 0


def test_seeds_are_0_1_2() -> None:
    """More seeds leave the first ones as they are; the seed reaches the scenario and the recording."""
    rows = [run_one("roundabout_crossing", SHORT, "nlvo", seed) for seed in range(3)]
    assert [row["seed"] for row in rows] == [0, 1, 2]
    assert len({row["digest"] for row in rows}) == 3
    assert "decision_us" not in rows[0]
    assert rows[1] == run_one("roundabout_crossing", SHORT, "nlvo", 1)


def test_progress_counts_runs() -> None:
    seen: list[tuple[int, int]] = []
    compare("empty", ["vo", "nao"], 2, settings={"duration": 0.2}, progress=lambda k, n: seen.append((k, n)))
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_a_file_is_a_scenario_too(tmp_path: Path) -> None:
    path = tmp_path / "plain.yaml"
    path.write_text(
        "robot: {position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}}\n"
    )
    table = compare(str(path), ["nao"], 2, settings={"duration": 0.3})
    assert table["scenario"] == str(path)
    assert table["methods"]["nao"]["runs"] == 2
    cases = cases_of(Row(str(path), {"duration": 0.3}, ["nao"], 2))
    assert [run_case(case) for case in cases] == [run_one(str(path), {"duration": 0.3}, "nao", k) for k in range(2)]


def test_a_method_named_twice_is_one_row() -> None:
    table = compare("empty", ["nao", "nao"], 1, settings={"duration": 0.2})
    assert list(table["methods"]) == ["nao"]
    assert table["methods"]["nao"]["runs"] == 1


@pytest.mark.parametrize("name", NAMES)
def test_load_gives_the_gallery(name: str) -> None:
    """With its parameters and with the settings of every scenario, which are recorded."""
    entry = GALLERY[name]
    changed = nudged(name) | {"duration": 7.0}
    scenario = load(name, changed, seed=1)
    assert scenario.name == name
    assert scenario.duration == 7.0
    assert dict(scenario.parameters) == changed
    assert dict(load(name).parameters) == dict(entry.parameters)


def test_intervals_are_those_of_the_literature():
    """Student's t; Wilson's of 0 of 20 and 81 of 263 (Newcombe, Statistics in Medicine 17, 1998, table I)."""
    assert wilson(0, 20) == pytest.approx([0.0, 0.1611], abs=1e-4)
    assert wilson(0, 0) is None
    assert wilson(81, 263) == pytest.approx([0.2553, 0.3662], abs=1e-4)
    assert mean_interval([]) is None
    assert mean_interval([3.0]) is None
    # t of 4 and of 9 degrees of freedom: 2.776 and 2.262.
    for n, t in ((5, 2.776), (10, 2.262)):
        values = np.arange(n, dtype=float)
        low, high = mean_interval(values)
        assert low + high == pytest.approx(n - 1.0)
        assert high - low == pytest.approx(2 * t * values.std(ddof=1) / np.sqrt(n), rel=4e-3)


def test_several_scenarios_are_those_one_by_one() -> None:
    """Also the same one twice, and with other methods and seeds."""
    rows = [
        Row("empty", {"duration": 0.5}, ["vo", "ao"], 2),
        Row("head_on", {"duration": 0.5}, ["avo"], 3),
        Row("empty", {"duration": 0.5}, ["ao"], 3),
    ]
    tables = compare_all(rows)
    for row, table in zip(rows, tables, strict=True):
        assert table == compare(row.scenario, row.methods, row.seeds, settings=row.settings)
    lines = flat(tables)
    assert [(line["scenario"], line["method"], line["runs"]) for line in lines] == [
        ("empty", "vo", 2),
        ("empty", "ao", 2),
        ("head_on", "avo", 3),
        ("empty", "ao", 3),
    ]
    shared = {"scenario": "empty", "seeds": 2, "settings": rows[0].settings, "deterministic": True}
    assert lines[0] == shared | {"method": "vo"} | tables[0]["methods"]["vo"]


def test_runs_that_are_the_same_are_made_once() -> None:
    seen: list[int] = []
    rows = [Row("empty", {"duration": 0.2}, ["vo"], seeds) for seeds in (1, 3, 2)]
    compare_all(rows, progress=lambda k, n: seen.append(n))
    assert seen == [3, 3, 3]


def test_a_method_that_cannot_run_a_scenario_is_a_row_that_says_so() -> None:
    """The rest goes on."""
    installed("orca")
    rows = [Row(name, {"duration": 0.3}, ["orca", "avo"], 2) for name in ("drones_crossing", "head_on")]
    space, plane = compare_all(rows)
    row = space["methods"]["orca"]
    (failure,) = row.pop("failures")
    assert failure["reason"].startswith("drone: expected a disc in the plane with ")
    assert (failure["seeds"], failure["killed"]) == ([0, 1], False)
    counts = ("runs", "distinct_runs", "runs_with_collision", "runs_all_arrived", "runs_successful")
    assert {row[name] for name in counts} == {0}
    assert {value for name, value in row.items() if name not in (*counts, "outcomes", "guided")} == {None}
    assert space["methods"]["avo"]["runs"] == plane["methods"]["orca"]["runs"] == 2
    assert plane["methods"]["orca"]["failures"] == []
    assert json.loads(json.dumps(space, allow_nan=False)) == space


@pytest.mark.parametrize(
    "wrong",
    [
        Row("full", {}, ["vo"], 1),
        Row("empty", {"offset": 1.0}, ["vo"], 1),
        Row("empty", {"margin": -1.0}, ["vo"], 1),
        Row("empty", {"distance": np.nan}, ["vo"], 1),
        Row("empty", {}, ["best"], 1),
        Row("empty", {}, [], 1),
        Row("empty", {}, ["vo"], 0),
        Row("none.yaml", {}, ["vo"], 1),
    ],
    ids=str,
)
def test_a_mistake_in_any_row_is_refused_before_anything_runs(wrong: Row) -> None:
    with pytest.raises(SlalomError, match="expected"):
        compare_all([Row("empty", {"duration": 0.2}, ["vo"], 1), wrong], progress=lambda k, n: pytest.fail("it ran"))


def test_a_grid_has_each_combination_once() -> None:
    assert grid({}) == [{}]
    assert grid({"margin": [0.1, 0.2], "patience": 0.5, "horizon": (1, 2, 3)}) == [
        {"margin": margin, "patience": 0.5, "horizon": horizon} for margin in (0.1, 0.2) for horizon in (1.0, 2.0, 3.0)
    ]


def test_lists_of_a_study_file_are_rows(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text("scenarios:\n- {scenario: empty, settings: {margin: [0.1, 0.2], dt: 0.1, horizon: [2, 3]}}\n")
    expected = grid({"margin": [0.1, 0.2], "dt": 0.1, "horizon": [2, 3]})
    assert [row.settings for row in read_study(path).rows] == expected
    added = named([str(path), "empty"], settings={"patience": [0.0, 1.0]}).rows
    assert [row.settings for row in added] == [
        *({**one, "patience": patience} for one in expected for patience in (0.0, 1.0)),
        {"patience": 0.0},
        {"patience": 1.0},
    ]
    path.write_text("scenarios:\n- {scenario: empty, settings: {margin: [], dt: [-1, x]}}\n")
    with pytest.raises(InvalidFile, match=r":2:53: scenarios\.0\.settings\.dt\.1: expected a number, found 'x'"):
        read_study(path)
    path.write_text("scenarios:\n- {scenario: empty, settings: {margin: []}}\n")
    with pytest.raises(InvalidFile, match=r"scenarios\.0\.settings: margin: expected at least one number, found none"):
        read_study(path)


RANDOM_FILE = """
duration: 0.4
robots:
  - name: guard
    count: 2
    radius: 0.3
    max_speed: {first: 1, last: 2, seed: SPEED}
    max_acceleration: 2
    positions: {kind: box, low: [-3, -12], high: [3, -9], min_distance: 1.5, seed: PLACE}
    goals: {kind: displaced, by: [0, 20]}
"""


def test_the_seed_of_a_run_is_added_to_the_seeds_of_its_file(tmp_path: Path) -> None:
    """A run of seed 2 is that of a file with seeds that are larger by 2; runs of a study are those one by one."""
    files = [tmp_path / f"{k}.yaml" for k in (0, 2)]
    for k, path in zip((0, 2), files, strict=True):
        path.write_text(RANDOM_FILE.replace("SPEED", str(3 + k)).replace("PLACE", str(5 + k)))
    runs = [simulate(read_scenario(files[0], seed), METHODS["nao"]).positions for seed in range(3)]
    assert len({run.tobytes() for run in runs}) == 3
    np.testing.assert_array_equal(runs[2], simulate(read_scenario(files[1]), METHODS["nao"]).positions)
    assert not is_deterministic(str(files[0]))
    made = [run_case(case)["digest"] for case in cases_of(Row(str(files[0]), {}, ["nao"], 3))]
    assert made == [simulate(read_scenario(files[0], seed), METHODS["nao"], seed=seed).digest() for seed in range(3)]


@pytest.mark.parametrize(("name", "method"), [("head_on", "nao"), ("circle", "nao"), ("circle", "nao_shared")])
def test_settings_without_effect_change_no_run(name: str, method: str) -> None:
    """To the bit; the observations of robots that do not share have an effect."""
    given = {"duration": 1.0, **({"robots": 4.0, "radius": 4.0} if name == "circle" else {})}
    other = {"guided": 0.0, "sight_noise": 0.1, "sight_delay": 0.1, "sight_loss": 0.5}
    whole = drawn(name, given)
    runs = {key: simulate(drawn(name, given | {key: value}), method) for key, value in other.items()}
    same = {key for key, run in runs.items() if np.array_equal(run.positions, simulate(whole, method).positions)}
    assert without_effect(whole, METHODS[method]) & other.keys() <= same
    if name == "circle":
        assert ("sight_noise" in same) == (method == "nao_shared")


def test_tables_are_the_same_as_csv_data_frame_and_latex() -> None:
    """The frame to the bit; LaTeX cell by cell, except for columns that are the same in all rows."""
    pandas = pytest.importorskip("pandas", reason="slalom[data] is not installed: no data frame is made")
    rows = [Row("head_on", each, ["vo", "nao_ahead"], 1) for each in grid({"offset": [0.0, 1.0], "duration": 0.3})]
    tables = compare_all(rows)
    frame = data_frame(tables)
    assert frame["offset"].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert frame["min_clearance"].tolist() == [row["min_clearance"] for row in flat(tables)]
    assert "duration" not in frame
    read = pandas.read_csv(io.StringIO(csv_text(tables)))
    pandas.testing.assert_frame_equal(read, pandas.read_csv(io.StringIO(frame.to_csv(index=False))), check_exact=True)
    lines = latex_text(tables).splitlines()
    begin, end = lines.index(r"\midrule"), lines.index(r"\bottomrule")
    found = [line.removesuffix(r" \\").split(" & ") for line in (lines[begin - 1], *lines[begin + 1 : end])]
    plain = [
        [re.sub(r"\$\^?(-|\d)\$", lambda m: ("^" if "^" in m[0] else "") + m[1], cell) for cell in row] for row in found
    ]
    plain = [[cell.replace("--", "-").replace("\\", "") for cell in row] for row in plain]
    whole = printed(tables, own=["offset"])
    shown = [k for k in range(len(whole[0])) if len({row[k] for row in whole[1:]}) > 1]
    assert plain == [[row[k] for k in shown] for row in whole]
    assert "nao_ahead" in {cell for row in plain for cell in row}
    (told,) = [line for line in lines if line.startswith("% The same in all rows: ")]
    assert "scenario: head_on duration=0.3; " in told


def test_a_comparison_writes_its_files_and_its_figure(tmp_path: Path) -> None:
    """As the command does. Without a setting of several values the methods are on the axis; a store changes nothing."""
    methods = ["vo", "nao"]
    table = compare("head_on", methods, 2, settings={"duration": 0.3}, store=tmp_path / "runs")
    assert compare_all([Row("head_on", {"duration": 0.3}, methods, 2)]) == [table]
    assert table.to_csv(tmp_path / "a.csv") == csv_text([table]) == (tmp_path / "a.csv").read_text()
    assert table.to_latex(tmp_path / "a.tex") == latex_text([table]) == (tmp_path / "a.tex").read_text()
    axes = table.figure().axes
    assert [[tick.get_text() for tick in ax.get_xticklabels()] for ax in axes] == [methods, methods]
    tables = compare_all([Row("empty", each, methods, 1) for each in grid({"margin": [0.1, 0.2], "duration": 12.0})])
    assert [ax.get_xlabel() for ax in tables.figure().axes] == ["margin", "margin"]
    bars = tables.figure().axes[1].containers[-1]
    assert bars[0].get_ydata() == pytest.approx([row["time"] for row in flat(tables) if row["method"] == "nao"])
    assert tables.to_csv().count("\n") == 5


class Interrupted(Exception):
    """What stops a sweep in a test."""


def stopping(at: int) -> Callable[[int, int], None]:
    """A progress that stops the sweep after so many runs, or at once where more are stored already."""

    def progress(done: int, total: int) -> None:
        if done >= at:
            raise Interrupted

    return progress


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_sweep_that_is_interrupted_goes_on(jobs: int, tmp_path: Path) -> None:
    """Twice: the same bits as at one go, and what was there is not made again.

    Processes finish and store the batch they are at, so more runs than those counted may be there.
    """
    seeds = 10 if jobs == 1 else 30
    rows, total = [Row(name, {"duration": 0.3}, ["avo", "vo"], seeds) for name in ("empty", "head_on")], 4 * seeds
    whole = json.dumps(compare_all(rows))
    for stop in (7, 19):
        with pytest.raises(Interrupted):
            compare_all(rows, jobs=jobs, store=tmp_path, progress=stopping(stop))
        assert stop <= len(list(tmp_path.glob("*.json"))) < total
    there = len(list(tmp_path.glob("*.json")))
    times = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
    seen: list[tuple[int, int]] = []
    assert json.dumps(compare_all(rows, jobs=jobs, store=tmp_path, progress=lambda k, n: seen.append((k, n)))) == whole
    assert seen == [(k, total) for k in range(there, total + 1)]
    assert all(path.stat().st_mtime_ns == before for path, before in times.items())
    assert json.dumps(compare_all(rows, store=tmp_path, progress=lambda k, n: seen.append((k, n)))) == whole
    assert seen[-1] == (total, total)
    assert len(seen) == total + 2 - there


STUDY = """\
title: Two
text: What is seen.
methods: [avo]
seeds: 2
scenarios:
  - {scenario: empty, settings: {duration: 1}}
  - {scenario: scene.yaml, methods: [vo, ao], seeds: 1}
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study of a scenario of the gallery and one of a file beside it."""
    (tmp_path / "scene.yaml").write_text(
        "robot: {position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}}\n"
    )
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return path


def test_a_study_is_what_its_file_says(study: Path) -> None:
    found = read_study(study)
    assert (found.title, found.text) == ("Two", "What is seen.")
    assert found.rows == [
        Row("empty", {"duration": 1.0}, ["avo"], 2),
        Row(str(study.with_name("scene.yaml")), {}, ["vo", "ao"], 1),
    ]
    assert is_study(str(study))
    assert not is_study(str(study.with_name("scene.yaml")))
    assert not is_study("empty")


CADRL = """\
case,agent,x,y,goal_x,goal_y,pref_speed,radius
7,0,-3,0,3,0,1,0.3
7,1,3,0.1,-3,0,1.2,0.3
9,0,-2,0,2,0,1,0.3
9,1,0,-2,0,2,1,0.3
"""
WITH_CASES = """\
methods: [nao]
seeds: 2
scenarios:
  - {scenario: empty}
  - {scenario: two.csv, settings: {max_acceleration: 3}, methods: [nao_shared]}
  - {scenario: three.csv, seeds: 500}
"""


def test_a_study_takes_files_of_cases(study: Path) -> None:
    """From beside it or from a folder of data; what is not there is left out, and is said to be."""
    study.write_text(WITH_CASES)
    empty, three = Row("empty", {}, ["nao"], 2), Row("three.csv", {}, ["nao"], 500)
    two = Row("two.csv", {"max_acceleration": 3.0}, ["nao_shared"], 2)
    assert read_study(study) == ("", "", [empty], (two, three))
    folder = study.parent / "data"
    folder.mkdir()
    (folder / "two.csv").write_text(CADRL)
    found = Row(str(folder / "two.csv"), {"max_acceleration": 3.0}, ["nao_shared"], 2)
    assert read_study(study, folder) == ("", "", [empty, found], (three,))
    assert read_study(study).left_out == (two, three)
    study.with_name("two.csv").write_text(CADRL)
    assert read_study(study).rows == [empty, found._replace(scenario=str(study.with_name("two.csv")))]
    assert named([str(study)], only=["two.csv"], data=folder) == ("", "", [found], ())
    assert named([str(study)], seeds=1, data=folder).left_out == (three._replace(seeds=1),)


def test_seeds_of_a_file_are_its_cases(tmp_path: Path) -> None:
    """By increasing number; the same from a process that reads the file itself, and kept apart from other settings."""
    path = tmp_path / "two.csv"
    path.write_text(CADRL)
    row = Row(str(path), {"max_acceleration": 3.0, "margin": 0.05}, ["nao_shared"], 2)
    made = cases_of(row)
    assert len({case.key for case in [*made, *cases_of(row._replace(settings={}))]}) == 4
    runs = [simulate(replace(cadrl(case, 3.0), margin=0.05), METHODS["nao_shared"]) for case in read_cases(path)]
    assert [drawn(str(path), row.settings, seed=k).parameters["case"] for k in range(2)] == [7.0, 9.0]
    assert [run_case(case)["digest"] for case in made] == [
        simulate(drawn(str(path), row.settings, seed=k), METHODS["nao_shared"], seed=k).digest() for k in range(2)
    ]
    table = compare_all([row])[0]["methods"]["nao_shared"]
    assert table["runs_successful"] == 2
    assert table["time"] == pytest.approx(np.mean([metrics.time(run) for run in runs]), rel=1e-15)
    extra = [metrics.extra_time(run, k) for run in runs for k in range(2)]
    assert table["extra_time"] == pytest.approx(list(np.percentile(extra, (50, 75, 90))), rel=1e-15)


def test_names_become_rows(study: Path) -> None:
    """Studies and scenarios together; settings are added, methods and seeds stand in, rows are chosen."""
    scene = str(study.with_name("scene.yaml"))
    assert named([str(study)]) == read_study(study)
    assert named(["ring", str(study)]) == ("", "", [Row("ring"), *read_study(study).rows], ())
    changed = named([str(study)], settings={"margin": 0.1}, methods=["nao"], seeds=7, only=[scene]).rows
    assert changed == [Row(scene, {"margin": 0.1}, ["nao"], 7)]
    assert named([str(study)], settings={"duration": 9.0}).rows[0].settings == {"duration": 9.0}


def test_every_name_in_a_study_that_is_not_known_is_a_line(study: Path) -> None:
    study.with_name("scene.yaml").write_text("robot: 3\n")
    study.write_text(
        "methods: [avo, best]\nscenarios:\n  - {scenario: empty, settings: {wheels: 4}, methods: [vo, worst]}\n"
        "  - {scenario: full}\n  - {scenario: none.yaml}\n  - {scenario: scene.yaml}\n"
    )
    with pytest.raises(InvalidFile) as caught:
        read_study(study)
    patterns = [
        r"study\.yaml:1:16: methods\.1: expected one of vo, .*; found 'best'",
        r"study\.yaml:3:33: scenarios\.0\.settings: parameter of empty: expected one of .*; found 'wheels'",
        r"study\.yaml:3:60: scenarios\.0\.methods\.1: expected one of vo, .*; found 'worst'",
        r"study\.yaml:4:16: scenarios\.1\.scenario: expected a \.yaml file or one of .*; found 'full'",
        r"none\.yaml: expected a readable YAML file, found ",
        r"scene\.yaml:1:8: robot: expected a mapping with the keys shape, .*; found 3",
    ]
    assert len(caught.value.mistakes) == len(patterns)
    for mistake, pattern in zip(caught.value.mistakes, patterns, strict=True):
        assert re.search(pattern, mistake), mistake


def test_the_study_of_fleets_is_complete() -> None:
    """Scenarios of several robots and the test cases of others, each with ours and with those of others beside them.

    Starts that are exactly symmetric and the largest circle are ours alone.
    """
    found = read_study(FLEETS)
    assert found.title
    assert found.text
    rows = [*found.rows, *found.left_out]
    assert len(rows) == 70
    assert {row.scenario for row in rows} >= {"circle", "ring", "doorway", "navground_cross", "crowdnav"}
    assert [row.seeds for row in rows if "cadrl_" in row.scenario] == [50, 50, 50, 50]
    beside: dict[str, set[str]] = {}
    for row in rows:
        settings = {name: value for name, value in row.settings.items() if name not in ("margin", "guided")}
        alone = settings.get("noise") == 0 or settings.get("robots") == 250
        beside.setdefault(f"{row.scenario} {settings}", {"orca"} if alone else set()).update(row.methods)
    for where, methods in beside.items():
        assert {"nao_shared", "nao_ahead"} & methods, where
        assert {"orca", "navground_orca"} & methods, where


@pytest.mark.parametrize("name", ["fleets", "planners"])
def test_a_row_without_guidance_is_beside_one_with_it(name: str) -> None:
    """With the same settings but those that were searched, and the same methods."""
    study = read_study(FLEETS.with_name(f"{name}.yaml"))
    searched = ("guided", "horizon", "patience", "margin") if name == "planners" else ("guided",)
    rows = [*study.rows, *study.left_out]

    def found(guided: bool) -> set[tuple[str, frozenset[tuple[str, float]], str]]:
        return {
            (row.name, frozenset((key, row.settings[key]) for key in row.settings.keys() - {*searched}), str(method))
            for row in rows
            for method in row.methods
            if (row.settings.get("guided", 1.0) > 0.0) == guided
        }

    assert found(guided=False)
    assert found(guided=False) <= found(guided=True)


def test_a_row_names_methods_with_their_own_parameters(tmp_path: Path) -> None:
    """Parameters belong to the names of peers, settings of slalom's methods to rows."""
    installed("orca")
    file = tmp_path / "study.yaml"
    file.write_text(
        "seeds: 1\nscenarios:\n"
        "- {scenario: circle, settings: {robots: 2, radius: 3}, methods: [orca, 'orca:horizon=1:neighbours=1']}\n"
        "- {scenario: circle, settings: {robots: 2, radius: 3, horizon: 3, guided: 0}, methods: [vo]}\n"
    )
    first, second = compare_all(read_study(file).rows)
    assert list(first["methods"]) == ["orca", "orca:horizon=1:neighbours=1"]
    plain, other = first["methods"].values()
    assert plain["time"] != other["time"]
    assert second["settings"] == {"robots": 2, "radius": 3, "horizon": 3, "guided": 0}
    keys = {case.key for case in cases_of(read_study(file).rows[0])}
    assert len(keys) == 2
    file.write_text("seeds: 1\nscenarios: [{scenario: circle, methods: ['orca:speed=1']}]\n")
    with pytest.raises(InvalidFile, match=r"scenarios\.0\.methods\.0: .*expected one of neighbours, horizon"):
        read_study(file)
