"""The store of runs: what decides a result decides where it is kept, and what is damaged is said and not trusted."""

import hashlib
import json
import re
import shutil
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

import slalom
from slalom import InvalidFile, InvalidInput
from slalom.cli import DONE, call
from slalom.peers import PEERS, contender
from slalom.sim import Row, compare, compare_all
from slalom.sim.sweep.case import (
    ABOVE,
    SOURCES,
    SOURCES_UNGUIDED,
    Case,
    Failure,
    canonical,
    run_case,
    run_one,
    sources_digest,
)
from slalom.sim.sweep.store import Store
from slalom.sim.sweep.study import cases_of

SOURCE = Path(slalom.__file__).parent
SHORT = {"duration": 0.3}
SCENE = """\
robot: {position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [20, 0]}}
recording: {file: tracks.csv, radius: 0.5}
duration: 0.3
"""
TRACKS = "t,id,x,y\n0,1,9,9\n1,1,9,8\n"


def case(name: str = "empty", method: str = "avo", seed: int = 0, **settings: float) -> Case:
    """The case of a run."""
    return cases_of(Row(name, settings or SHORT, [method], seed + 1))[seed]


def of_file(path: Path, **settings: float) -> Case:
    """The case of a run of a scenario file."""
    return cases_of(Row(str(path), settings, ["avo"], 1))[0]


def filled(folder: Path, *cases: Case) -> Store:
    """A store that has these."""
    store = Store.at(folder)
    for one in cases:
        row = run_case(one)
        assert not isinstance(row, Failure)
        store.write(one, row)
    return store


def test_the_content_of_a_run_is_read_by_people() -> None:
    """Scenario with all its parameters, method, seed, versions."""
    content = case("head_on", "nao", 3, speed=4.0).content
    assert content["scenario"] == {"name": "head_on", "parameters": {"speed": 4.0, "offset": 0.0}}
    assert content["method"]["name"] == "nao"
    assert content["method"]["share"] == 0.5
    assert content["seed"] == 3
    assert content["versions"]["slalom"] == slalom.__version__
    assert {"numpy", "numba"} <= set(content["versions"])
    assert json.loads(canonical(content)) == content


def test_the_same_run_has_the_same_key() -> None:
    """However it is asked for."""
    assert case().key == case().key
    assert case("head_on", speed=5.0).key == case("head_on", offset=0.0).key
    assert case("circle", robots=4).key == case("circle", robots=4.0, noise=1e-3).key


def test_whatever_changes_the_run_changes_the_key() -> None:
    one = case()
    others = [
        case(seed=1),
        case(method="vo"),
        case("head_on"),
        case(duration=0.4),
        case(duration=0.3, margin=0.1),
        case(duration=0.3, distance=19.0),
        replace(one, content={**one.content, "sources": "0" * 64}),
        replace(one, content={**one.content, "versions": {**one.content["versions"], "numpy": "0"}}),
    ]
    assert len({other.key for other in (one, *others)}) == len(others) + 1


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_has_its_package_in_the_key(name: str) -> None:
    """And its settings, which are a part of its row."""
    try:
        contender(name)
    except InvalidInput:
        pytest.skip("its package is not installed")
    content = case("circle", name).content
    assert PEERS[name].package in content["versions"]
    assert content["method"]["inflation"] == PEERS[name].inflation
    assert isinstance(content["method"]["settings"], list)
    assert "0x" not in canonical(content)


def test_of_a_file_the_content_counts(tmp_path: Path) -> None:
    """And that of the recording which it names; not where they are."""
    scene, tracks = tmp_path / "scene.yaml", tmp_path / "tracks.csv"
    scene.write_text(SCENE)
    tracks.write_text(TRACKS)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for path in (scene, tracks):
        shutil.copy(path, elsewhere)
    keys = [of_file(scene).key]
    assert of_file(elsewhere / "scene.yaml").key == keys[0]
    tracks.write_text(TRACKS.replace("9,8", "9,7"))
    keys.append(of_file(scene).key)
    scene.write_text(SCENE + "# a remark\n")
    keys += [of_file(scene).key, of_file(scene, margin=0.1).key]
    assert len(set(keys)) == 4


def test_edited_code_has_another_digest(tmp_path: Path) -> None:
    """Of all that a run may use, and only of that."""
    copy = tmp_path / "slalom"
    shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    assert sources_digest(copy) == SOURCES == sources_digest()
    for name in ABOVE:
        place = copy / name if name.endswith(".py") else copy / name / "__init__.py"
        place.write_text("edited = True\n")
    (copy / "sim" / "__pycache__").mkdir()
    (copy / "sim" / "__pycache__" / "a.py").write_text("")
    assert sources_digest(copy) == SOURCES
    seen = {SOURCES}
    for edited in (
        "decision/methods.py",
        "kernels/selection/exchange.py",
        "sim/measure/metrics.py",
        "data/roundabout_ring_11.csv",
    ):
        with (copy / edited).open("a") as file:
            file.write("\n")
        seen.add(sources_digest(copy))
    (copy / "model/goal.py").rename(copy / "model" / "aim.py")
    seen.add(sources_digest(copy))
    assert len(seen) == 6


def test_runs_without_guidance_do_not_depend_on_it(tmp_path: Path) -> None:
    """Their key is that of the code without it."""
    copy = tmp_path / "slalom"
    shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("kernels/guidance/traffic_circle.py", "fleet/guidance.py"):
        with (copy / name).open("a") as file:
            file.write("\n")
    assert sources_digest(copy) != SOURCES
    assert sources_digest(copy, guided=False) == SOURCES_UNGUIDED
    keys = [
        {case.content["sources"] for case in cases_of(Row(name, {"guided": guided}, ["nao"], 1))}
        for name, guided in (("head_on", 1.0), ("circle", 0.0), ("circle", 1.0))
    ]
    assert keys == [{SOURCES_UNGUIDED}, {SOURCES_UNGUIDED}, {SOURCES}]


def test_what_is_left_out_stands_above_the_simulator() -> None:
    """As the layers have it, which are checked: nothing below imports it."""
    project = tomllib.loads((SOURCE.parents[1] / "pyproject.toml").read_text())
    layers = next(c for c in project["tool"]["importlinter"]["contracts"] if c["type"] == "layers")["layers"]
    above = [part.strip() for layer in layers[: layers.index("sim")] for part in re.split("[|:]", layer)]
    assert {name.removesuffix(".py") for name in ABOVE} == set(above)
    assert all((SOURCE / name).exists() for name in ABOVE)


def test_code_that_was_edited_during_a_sweep_is_not_used() -> None:
    """A process that was begun later would run it."""
    one = case()
    with pytest.raises(InvalidFile, match="expected the code that the sweep began with, found other code"):
        run_case(replace(one, content={**one.content, "sources": "0" * 64}))


def test_a_file_that_was_edited_during_a_sweep_is_not_used(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE)
    (tmp_path / "tracks.csv").write_text(TRACKS)
    one = of_file(tmp_path / "scene.yaml")
    (tmp_path / "tracks.csv").write_text(TRACKS.replace("9,8", "9,7"))
    with pytest.raises(InvalidFile, match=r"scene\.yaml: expected the files that the sweep began with, found others"):
        run_case(one)


def test_what_is_kept_is_what_was_measured(tmp_path: Path) -> None:
    """To the bit, under its key, with nothing else in the folder."""
    cases = [case(seed=seed) for seed in range(3)]
    store = filled(tmp_path / "a" / "b", *cases)
    assert store.read([*cases, case(seed=3)]) == {one.key: run_one("empty", SHORT, "avo", one.seed) for one in cases}
    assert {path.name for path in store.folder.iterdir()} == {f"{one.key}.json" for one in cases}
    assert json.loads(store.path(cases[1]).read_text())["case"] == cases[1].content


def test_what_is_left_of_a_killed_process_is_not_read(tmp_path: Path) -> None:
    store = filled(tmp_path, case())
    (tmp_path / f".{case(seed=1).key}-0.part").write_text('{"half')
    assert list(store.read([case(), case(seed=1)])) == [case().key]


def aged(store: Store, *cases: Case, sources: str = "0" * 64, **changes: object) -> None:
    """Make the stored runs those of former code: its sources, its description of methods, its format and digests."""
    for one in cases:
        kept = json.loads(store.path(one).read_text())
        store.path(one).unlink()
        method = {
            "name": one.method,
            "responses": "slalom.decision.methods._velocity",
            "forecast": "Known()",
            "share": 1.0,
        }
        content = {**one.content, "method": method, "sources": sources}
        row = {**kept["row"], "digest": "0" * 64, **changes}
        written = {"format": "slalom run 1", "case": content, "row": row}
        key = hashlib.sha256(canonical(content).encode()).hexdigest()
        digest = hashlib.sha256(canonical(written).encode()).hexdigest()
        (store.folder / f"{key}.json").write_text(json.dumps({**written, "sha256": digest}))


def made_again(store: Store) -> Callable:
    """Runs cases, stores and notes them."""

    def run(cases: Sequence[Case]) -> dict:
        made_again.cases = [*cases]
        filled(store.folder, *cases)
        return store.read(cases)

    return run


def test_a_method_is_described_without_names_of_code() -> None:
    """By its name, what it knows and its numbers: a rename of classes, functions or fields orphans no result."""
    assert case(method="nao").content["method"] == {
        "name": "nao",
        "foresight": "recorded",
        "foresight_among": "observed",
        "share": 0.5,
        "regain": 1.0,
        "shared": False,
        "ahead": False,
        "forecast": [],
        "of_robots": [0.1],
    }
    assert case(method="nao@observed").content["method"]["foresight"] == "observed"


def test_runs_of_former_code_are_adopted(tmp_path: Path) -> None:
    """Of each scenario and method the first seed is made again; the others are taken over, with where they are from."""
    cases = [case(name, method, seed) for name in ("empty", "head_on") for method in ("vo", "avo") for seed in range(3)]
    store = filled(tmp_path, *cases)
    rows = store.read(cases)
    aged(store, *cases)
    assert store.read(cases) == {}
    assert store.adopt([*cases, case(seed=3)], made_again(store)) == (8, 4)
    assert [(one.scenario, one.method, one.seed) for one in made_again.cases] == [
        (name, method, 0) for name in ("empty", "head_on") for method in ("vo", "avo")
    ]
    assert store.read(cases) == {
        one.key: rows[one.key] if one.seed == 0 else {**rows[one.key], "digest": None} for one in cases
    }
    kept = json.loads(store.path(cases[1]).read_text())
    assert kept["adopted_from"] == "0" * 64
    assert store.adopt(cases, lambda some: pytest.fail("it ran")) == (0, 0)


def test_adopted_runs_are_adopted_again(tmp_path: Path) -> None:
    """By code after the present one, with the digests that there are."""
    cases = [case(seed=seed) for seed in range(3)]
    store = filled(tmp_path, *cases)
    aged(store, *cases)
    store.adopt(cases, made_again(store))
    later = [replace(one, content={**one.content, "sources": "1" * 64}) for one in cases]

    def run(some: Sequence[Case]) -> dict:
        row = store.read(cases)[cases[0].key]
        for one in some:
            store.write(one, row)
        return store.read(some)

    assert store.adopt(later, run) == (2, 1)


@pytest.mark.parametrize("change", [{"time": 0.25}, {"adjustments": 7}, {"extra_times": [0.5]}, {"more": 1.0}])
def test_runs_that_are_not_the_same_are_not_adopted(change: dict, tmp_path: Path) -> None:
    """Any number; the message says which run, which numbers and where."""
    cases = [case(seed=seed) for seed in range(3)]
    store = filled(tmp_path, *cases)
    aged(store, *cases, **change)
    with pytest.raises(InvalidFile) as caught:
        store.adopt(cases, made_again(store))
    (mistake,) = caught.value.mistakes
    ((name, value),) = change.items()
    assert "expected the result that the present code gives for empty with avo and seed 0, found another" in mistake
    assert "so no run is adopted" in mistake
    assert f"{name} " in mistake
    assert mistake.endswith(repr(value))
    assert list(store.read(cases)) == [cases[0].key]


def test_runs_of_every_former_code_are_compared(tmp_path: Path) -> None:
    """One that is the same does not vouch for another."""
    cases = [case(seed=seed) for seed in range(4)]
    store = filled(tmp_path, *cases)
    aged(store, *cases[:2], sources="a" * 64)
    aged(store, *cases[2:], sources="b" * 64, time=0.25)
    with pytest.raises(InvalidFile, match="seed 2, found another"):
        store.adopt(cases, made_again(store))
    assert [one.seed for one in made_again.cases] == [0, 2]


def test_what_differs_in_more_than_the_code_is_not_adopted(tmp_path: Path) -> None:
    """Another seed, setting, method or version; a damaged file."""
    one = case()
    store = filled(tmp_path, one)
    aged(store, one)
    others = [case(seed=1), case(duration=0.4), case(method="vo"), case("head_on")]
    versions = {**one.content["versions"], "numpy": "0"}
    others.append(replace(one, content={**one.content, "versions": versions}))
    assert store.adopt(others, lambda some: pytest.fail("it ran")) == (0, 0)
    (path,) = store.folder.glob("*.json")
    path.write_bytes(path.read_bytes()[:-20])
    assert store.adopt([one], lambda some: pytest.fail("it ran")) == (0, 0)


def test_a_study_adopts_what_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same table, and a note; without a store it is refused."""
    cases = [case(seed=seed) for seed in range(3)]
    store = filled(tmp_path, *cases)
    table = compare("empty", ["avo"], 3, settings=SHORT, store=tmp_path)
    aged(store, *cases)
    said: list[str] = []
    assert compare("empty", ["avo"], 3, settings=SHORT, store=tmp_path, adopt=True, note=said.append) == table
    assert said == [f"{tmp_path}: 2 runs of former code adopted; 1 made again, with the same results"]
    with pytest.raises(InvalidInput, match="adopt: expected a store with runs of former code, found no store"):
        compare("empty", ["avo"], 3, settings=SHORT, adopt=True)
    for path in store.folder.glob("*.json"):
        path.unlink()
    filled(tmp_path, *cases)
    aged(store, *cases)
    command = ["compare", "empty", "--set", "duration=0.3", "--methods", "avo", "--seeds", "3", "--json", "--adopt"]
    assert call([*command, "--store", str(tmp_path)]) == DONE
    assert "2 runs of former code adopted" in capsys.readouterr().err


def edited(change: Callable[[dict], object]) -> Callable[[bytes], bytes]:
    """The content of a file with a change in its JSON."""

    def edit(text: bytes) -> bytes:
        kept = json.loads(text)
        change(kept)
        return json.dumps(kept).encode()

    return edit


DAMAGE = {
    "cut off": (lambda text: text[:100], "100 bytes that are not JSON"),
    "empty": (lambda text: b"", "0 bytes that are not JSON"),
    "not text": (lambda text: b"\xff" + text, "bytes that are not JSON"),
    "a list": (lambda text: b"[]", "JSON that is not of format 'slalom run 2'"),
    "another format": (edited(lambda kept: kept.update(format="slalom run 9")), "JSON that is not of format"),
    "without its digest": (edited(lambda kept: kept.pop("sha256")), "JSON that is not of format"),
    "another number": (edited(lambda kept: kept["row"].update(time=0.25)), "content that does not have the digest"),
    "another seed": (edited(lambda kept: kept["case"].update(seed=7)), "content that does not have the digest"),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_file_is_named_and_nothing_is_run(what: str, tmp_path: Path) -> None:
    """The file stays as it is; without it the run is made again."""
    damage, message = DAMAGE[what]
    table = compare("empty", ["avo"], 3, settings=SHORT, store=tmp_path)
    path = Store(tmp_path).path(case(seed=1))
    broken = damage(path.read_bytes())
    path.write_bytes(broken)
    Store(tmp_path).path(case(seed=2)).unlink()
    with pytest.raises(InvalidFile) as caught:
        compare("empty", ["avo"], 3, settings=SHORT, store=tmp_path, progress=lambda k, n: pytest.fail("it ran"))
    (mistake,) = caught.value.mistakes
    assert mistake.startswith(f"{path}: expected the result of a finished run, found ")
    assert message in mistake
    assert mistake.endswith("; delete it, and the run is made again")
    assert path.read_bytes() == broken
    path.unlink()
    assert compare("empty", ["avo"], 3, settings=SHORT, store=tmp_path) == table


def test_every_damaged_file_is_named(tmp_path: Path) -> None:
    """Also one that is the file of another run."""
    cases = [case(seed=seed) for seed in range(3)]
    store = filled(tmp_path, *cases)
    shutil.copy(store.path(cases[0]), store.path(cases[1]))
    store.path(cases[2]).unlink()
    store.path(cases[2]).mkdir()
    with pytest.raises(InvalidFile) as caught:
        store.read(cases)
    assert len(caught.value.mistakes) == 2
    assert "found another run; delete it" in caught.value.mistakes[0]
    assert "expected a readable file, found a folder" in caught.value.mistakes[1]


def test_a_store_that_cannot_be_made_or_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="store: expected a folder that exists or can be made, found "):
        Store.at(tmp_path / "file" / "inner")
    one = case()
    store = filled(tmp_path / "gone", one)
    row = store.read([one])[one.key]
    shutil.rmtree(tmp_path / "gone")
    with pytest.raises(
        InvalidFile, match=r"\.json: expected a file that can be written, found no such file or folder$"
    ):
        store.write(one, row)


def test_mistakes_leave_no_folder_behind(tmp_path: Path) -> None:
    rows = [Row("empty", SHORT, ["avo"], 1), Row("empty", {"wheels": 4.0}, ["avo"], 1)]
    with pytest.raises(InvalidInput, match="found 'wheels'"):
        compare_all(rows, store=tmp_path / "store")
    assert not (tmp_path / "store").exists()


def test_a_function_in_a_file_is_a_scenario_by_name_and_its_source_is_in_the_key(tmp_path: Path) -> None:
    file, name = tmp_path / "scene.py", str(tmp_path / "scene.py:build")
    source = (
        "from slalom.sim import gallery\n"
        "def build(parameters, random):\n"
        "    return gallery.build('head_on', {'offset': random.uniform(0, 1), 'duration': 0.3})\n"
    )
    file.write_text(source)
    first = compare(name, ["avo"], 2, store=tmp_path / "runs")
    assert not first["deterministic"]
    assert compare(name, ["avo"], 2, store=tmp_path / "runs", jobs=2) == first
    key = case(name).key
    assert len(list((tmp_path / "runs").iterdir())) == 2
    file.write_text(source.replace("0.3", "0.4"))
    assert case(name).key != key
    assert call(["run", name, "--seed", "1"]) in (0, 1)
