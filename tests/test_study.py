"""Studies: the same table to the bit whatever the number of jobs, and the right one."""

import json
from pathlib import Path

import numpy as np
import pytest
from galleries import NAMES, nudged

from slalom import METHODS, InvalidFile, InvalidInput
from slalom.sim import compare, load, metrics, simulate
from slalom.sim.gallery import GALLERY, build
from slalom.sim.study import mean_interval, run_one, wilson

SHORT = {"duration": 3.0}


def test_jobs_do_not_matter() -> None:
    """Not even to the last bit or to the order of the keys."""
    one, two = (compare("roundabout_crossing", ["nlvo", "vo"], 2, settings=SHORT, jobs=jobs) for jobs in (1, 2))
    assert json.dumps(one) == json.dumps(two)


def test_the_table_is_that_of_the_single_runs() -> None:
    """Counts, means and the least clearance, from runs made one by one."""
    settings = {"duration": 9.0, "margin": 0.1}
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
        assert row["time"] == (np.mean([metrics.time(run) for run in done]) if done else None)
        assert row["min_clearance"] == min(metrics.min_clearance(run) for run in runs)
        outcomes = [name for run in runs for (name,) in run.outcomes]
        assert row["outcomes"] == {name: outcomes.count(name) for name in sorted(set(outcomes))}
    assert json.loads(json.dumps(table, allow_nan=False)) == table


def test_nobody_arrives_and_nobody_is_there() -> None:
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


def test_a_method_named_twice_is_one_row() -> None:
    table = compare("empty", ["nao", "nao"], 1, settings={"duration": 0.2})
    assert list(table["methods"]) == ["nao"]
    assert table["methods"]["nao"]["runs"] == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"methods": ["best"]},
            r"method: expected one of vo, rvo, .*, orca, .*; found 'best'",
        ),
        ({"methods": []}, r"methods: expected at least one"),
        ({"name": "full"}, r"scenario: expected a \.yaml file or one of .*; found 'full'"),
        ({"seeds": 0}, r"expected seeds of 1 or more"),
        ({"seeds": -3}, r"found -3"),
        ({"jobs": 0}, r"jobs not 0"),
        ({"settings": {"wheels": 4.0}}, r"parameter of empty: expected one of .*; found 'wheels'"),
        ({"settings": {"duration": -1.0}}, r"duration: expected a number above 0, found -1"),
        ({"settings": {"margin": -1.0}}, r"margin: expected 0 or more, found -1"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict, message: str) -> None:
    given = {"name": "empty", "methods": ["nao"], "seeds": 1, **arguments}
    with pytest.raises(InvalidInput, match=message):
        compare(
            given["name"], given["methods"], given["seeds"], settings=given.get("settings"), jobs=given.get("jobs", 1)
        )


def test_a_file_that_is_wrong_is_refused_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match="expected a readable YAML file"):
        compare(str(tmp_path / "none.yaml"), ["nao"], 100)


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
    assert wilson(81, 263) == pytest.approx([0.2553, 0.3662], abs=1e-4)
    assert mean_interval([]) is None
    assert mean_interval([3.0]) is None
    # t of 4 and of 9 degrees of freedom: 2.776 and 2.262.
    for n, t in ((5, 2.776), (10, 2.262)):
        values = np.arange(n, dtype=float)
        low, high = mean_interval(values)
        assert low + high == pytest.approx(n - 1.0)
        assert high - low == pytest.approx(2 * t * values.std(ddof=1) / np.sqrt(n), rel=4e-3)
