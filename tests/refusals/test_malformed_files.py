"""Files that are changed at random, and files made to hang or to flood: a value or one short message, never more."""

import os
import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
import pytest
from draws import commit_number, draws
from hdf5_files import OF_LIBRARY, changed, write_run
from nav2_maps import KEYS, text_file
from PIL import Image
from recording_formats import SAMPLES, WALK, Sample
from scenario_texts import EVERYTHING, GROUP, TASKS
from wall_files import MOVINGAI, SVG, dxf, features

from slalom import InvalidFile, SlalomError, read_map, read_walls
from slalom.base.errors import MESSAGE_LINE
from slalom.cli import call
from slalom.io.formats import read_recording
from slalom.io.pedestrians import read_cases
from slalom.io.yaml_nodes import MAX_MISTAKES
from slalom.sim import Recording
from slalom.sim.files.recorded_traffic import crossing, read_recorded
from slalom.sim.files.scenario_yaml import read_scenario, read_scenarios
from slalom.sim.sweep.study import read_study

STUDY = "title: two\ntext: a text\nseeds: 2\nmethods: [nao, rvo]\nscenarios:\n  - scenario: head_on\n"


class Good(NamedTuple):
    """A kind of files: the name of one, a function that writes a good one, and the functions that read it."""

    name: str
    write: Callable[[Path], object]
    readers: tuple[Callable[[Path], object], ...]


def text(content: str) -> Callable[[Path], object]:
    """A function that writes this text."""
    return lambda path: path.write_text(content)


def write_scenario(path: Path) -> None:
    """A scenario file with every key, and the recording that it names."""
    SAMPLES["csv"].write(path.with_name("tracks.csv"), [(10 * k, a, x, y) for k, a, x, y in WALK])
    path.write_text(EVERYTHING)


def write_image(path: Path) -> None:
    """The image of a map."""
    Image.fromarray(np.eye(9, dtype=np.uint8) * 255).save(path)


def read_image(path: Path) -> object:
    """The map of an image."""
    return read_map(
        text_file(path.parent, "".join(f"{name}: {value}\n" for name, value in {**KEYS, "image": "map.png"}.items()))
    )


def crossed(path: Path, sample: Sample) -> object:
    """The scenario of a robot among the agents of a recording, as of `slalom run FILE --start 0,0 --goal 8,0`."""
    recorded = read_recorded(path, **sample.needed)
    ahead = np.zeros(recorded.dimension)
    ahead[0] = 8.0
    return crossing(recorded, ahead * 0.0, ahead)


def converted(path: Path, sample: Sample) -> None:
    """The recording written as CSV by the command line, and read again."""
    target = path.with_name("target.csv")
    target.unlink(missing_ok=True)
    code = call(["convert", str(path), str(target), *sample.options])
    assert code == (0 if target.exists() else 2)
    if code == 0:
        read_recording(target)


def of_format(name: str) -> Good:
    """Recordings of a format."""
    sample = SAMPLES[name]
    return Good(
        sample.name,
        lambda path: sample.write(path, WALK),
        (partial(crossed, sample=sample), partial(converted, sample=sample)),
    )


KINDS = {
    **{name: of_format(name) for name in SAMPLES},
    "scenario": Good("a.yaml", write_scenario, (read_scenario,)),
    "group": Good("a.yaml", text(GROUP), (read_scenario,)),
    "tasks": Good("a.yaml", text(TASKS), (read_scenario,)),
    "scenarios": Good("a.yaml", text(GROUP + "cases:\n  - {name: a}\n  - {duration: 3}\n"), (read_scenarios,)),
    "study": Good("a.yaml", text(STUDY), (read_study,)),
    "cases": Good(
        "a.csv",
        text("case,agent,x,y,goal_x,goal_y,pref_speed,radius\n0,0,-3,0,3,0,1,0.3\n0,1,3,0,-3,0,1,0.3\n"),
        (read_cases,),
    ),
    **{
        suffix: Good(f"a.{suffix}", text(content), (partial(read_walls, unit=1.0),))
        for suffix, content in (
            ("wkt", "POLYGON ((0 0, 4 0, 4 1, 0 0))"),
            ("geojson", features('{"type": "Polygon", "coordinates": [[[0, 0], [4.5, 0], [4, 1], [0, 0]]]}')),
            ("map", MOVINGAI),
            ("svg", SVG),
            ("dxf", dxf()),
        )
    },
    "image": Good("map.png", write_image, (read_image,)),
    "hdf5": Good("a.h5", write_run, (Recording.load,)),
}
"""Every kind of files that slalom reads."""

CHUNKS, MUTATIONS = 25, 5
"""Runs of the test for each kind, and changed files of each: 4375 of the 35 kinds."""

WORDS = (
    *(b"", b"\0", b"\n", b"\r", b" ", b",", b'"', b"'", b"-", b"#", b":", b"[", b"{", b"}", b"<", b">", b"&a ", b"*a"),
    *(b"nan", b"inf", b"1e308", b"1e999", b"-1", b"0", b"1_0", b"1e-320", b"9" * 30, b"9" * 5000, b"null", b"true"),
    *(b"\xff", b"\xef\xbb\xbf", "\N{RIGHT-TO-LEFT OVERRIDE}\u2028é".encode(), b"[" * 3000, b"x" * 200_000, b"!!int "),
)


def mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with one to four changes: of a byte, a number, a part or a line."""
    for _ in range(int(rng.integers(1, 5))):
        start = int(rng.integers(len(content) + 1))
        end = min(len(content), start + int(rng.integers(1, 40)))
        word = WORDS[rng.integers(len(WORDS))]
        numbers = list(re.finditer(rb"\d+(\.\d+)?", content))
        lines = content.split(b"\n")
        choice = int(rng.integers(7))
        if choice == 0 and content:
            content = content[:start] + bytes([rng.integers(256)]) + content[start + 1 :]
        elif choice == 1:
            content = content[:start] + word + content[start:]
        elif choice == 2:
            content = content[:start] + content[end:]
        elif choice == 3:
            content = content[:end] + content[start:]
        elif choice == 4 and numbers:
            found = numbers[rng.integers(len(numbers))]
            content = content[: found.start()] + word + content[found.end() :]
        elif choice == 5:
            rng.shuffle(lines)
            content = b"\n".join(lines)
        else:
            content = content[:start] if rng.random() < 0.3 else content[:start] + content[start : start + 1] * 9
    return content


def refuses_in_short(read: Callable[[Path], object], path: Path) -> bool:
    """Whether a file is refused. Its message must be short; any other exception, or a warning, is an error."""
    try:
        read(path)
    except SlalomError as error:
        lines = str(error).split("\n")
        assert len(lines) <= MAX_MISTAKES + 1
        assert all(line.isprintable() and len(line) <= MESSAGE_LINE + 50 for line in lines), lines
        return True
    return False


@pytest.mark.parametrize("chunk", draws(range(CHUNKS)))
@pytest.mark.parametrize("name", KINDS)
def test_changed_files_are_read_or_refused(
    name: str, chunk: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first chunk is always the same; the others change with each commit."""
    kind = KINDS[name]
    path = tmp_path / kind.name
    kind.write(path)
    good = path.read_bytes()
    assert not any(refuses_in_short(read, path) for read in kind.readers)
    capsys.readouterr()
    rng = np.random.default_rng([chunk, commit_number() if chunk else 0, list(KINDS).index(name)])
    for _ in range(MUTATIONS):
        path.write_bytes(mutated(good, rng))
        for read in kind.readers:
            refuses_in_short(read, path)
            said = capsys.readouterr().err.splitlines()
            assert len(said) <= 25
            assert all(len(line) <= MESSAGE_LINE + 4000 for line in said)


def test_every_kind_of_file_has_its_mutations() -> None:
    assert CHUNKS * MUTATIONS * len(KINDS) >= 2000


@pytest.mark.parametrize("name", KINDS)
def test_pipes_and_devices_are_refused_without_opening_them(name: str, tmp_path: Path) -> None:
    kind = KINDS[name]
    path = tmp_path / kind.name
    os.mkfifo(path)
    for read in kind.readers:
        if getattr(read, "func", None) is converted:
            assert call(["convert", str(path), str(tmp_path / "target.csv")]) == 2
        else:
            with pytest.raises(InvalidFile, match=r"expected a readable .*, found a pipe"):
                read(path)
    path.unlink()
    path.symlink_to("/dev/zero")
    for read in kind.readers:
        if getattr(read, "func", None) is not converted:
            with pytest.raises(InvalidFile, match=r"expected a readable .*, found a device"):
                read(path)


@pytest.mark.parametrize("command", ["run", "run --start 0,0 --goal 1,1 --speed 1 --acceleration 1", "convert"])
def test_commands_refuse_a_pipe_in_one_line(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.csv"
    os.mkfifo(path)
    verb, *options = command.split()
    targets = [str(tmp_path / "b.csv")] if verb == "convert" else options
    assert call([verb, str(path), *targets]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", f"{path}: expected a readable file, found a pipe\n")


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS rowid, 1 AS id, i AS frame, "
VIEWS = {
    "rows": ENDLESS + "1.0 AS pos_x, 1.0 AS pos_y FROM n",
    "no rows": ENDLESS + "1.0 AS pos_x, 1.0 AS pos_y FROM n WHERE i < 0",
    "long values": ENDLESS + "zeroblob(1000000000) AS pos_x, 1.0 AS pos_y FROM n",
}


@pytest.mark.parametrize("what", VIEWS)
def test_databases_without_end_are_refused(what: str, tmp_path: Path) -> None:
    path = tmp_path / "a.sqlite"
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("CREATE TABLE metadata (key TEXT, value TEXT)")
        base.execute("INSERT INTO metadata VALUES ('fps', '25')")
        base.execute(f"CREATE VIEW trajectory_data AS {VIEWS[what]}")
    found = "a query that does not end|expected at most .* rows in a file of .* bytes, found more|too big"
    with pytest.raises(InvalidFile, match=found):
        read_recording(path)


@pytest.mark.parametrize("fps", [None, b"\x01", "1e999", "nan", ""])
def test_databases_with_other_values(fps: object, tmp_path: Path) -> None:
    path = tmp_path / "a.sqlite"
    for said in ([("fps", fps)], [("fps", 25), ("version", fps)]):
        SAMPLES["jupedsim"].write(path, WALK)
        with closing(sqlite3.connect(path)) as base, base:
            base.execute("DELETE FROM metadata")
            base.executemany("INSERT INTO metadata VALUES (?, ?)", said)
        with pytest.raises(InvalidFile, match="metadata: expected version 1 or 2 and fps above 0, found "):
            read_recording(path)


def test_nested_json_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.ndjson"
    path.write_text('{"scene": {"fps": 2.5}}\n' + '{"track": ' * 100_000 + "\n")
    with pytest.raises(InvalidFile, match=r":2: expected a scene or a track, found ") as caught:
        read_recording(path)
    assert len(str(caught.value)) < 300


def test_ids_are_short_and_printable(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for label in ("x" * 201, '"a\nb"', "a\x1b[2Jb"):
        path.write_text(f"t,id,x,y\n0,{label},0,0\n1,{label},1,1\n")
        with pytest.raises(InvalidFile, match="id: expected an id of at most 200 printable characters") as caught:
            read_recording(path)
        assert all(line.isprintable() for line in str(caught.value).split("\n"))


def test_steps_too_short_for_a_velocity_are_refused_with_their_line(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,id,x,y\n0,1,0,0\n1e-300,1,1e90,0\n")
    with pytest.raises(InvalidFile, match=r"a\.csv:3: expected agent 1 no faster than 1e\+100 m/s, found inf m/s"):
        read_recording(path)


# HDF5. Recordings that a reader of HDF5 takes, but that contradict themselves, are in test_inputs.


@pytest.mark.parametrize("what", OF_LIBRARY)
def test_a_changed_hdf5_file_is_refused(what: str, tmp_path: Path) -> None:
    path = changed(what, tmp_path)
    with pytest.raises(
        InvalidFile, match=rf"a\.h5: expected an HDF5 recording, found .*{OF_LIBRARY[what][1]}"
    ) as caught:
        Recording.load(path)
    assert len(caught.value.mistakes) == 1
    assert len(str(caught.value)) < MESSAGE_LINE


@pytest.mark.parametrize("times", [2000, 50_000])
def test_a_long_text_that_occurs_many_times_is_refused(times: int, tmp_path: Path) -> None:
    """A text of 60 kB, to which many elements refer: 120 MB, and 3 GB."""
    path = tmp_path / "a.h5"
    write_run(path)
    with h5py.File(path, "r+") as file:
        texts = file["run_0"].create_dataset("more", data=["x" * 60_000] + ["y"] * times, dtype=h5py.string_dtype())
        start, size = texts.id.get_offset(), texts.id.get_storage_size()
    content = bytearray(path.read_bytes())
    content[start : start + size] = content[start : start + 16] * (times + 1)
    path.write_bytes(content)
    with pytest.raises(InvalidFile, match=r"a\.h5: expected an HDF5 recording, found .") as caught:
        Recording.load(path)
    assert len(caught.value.mistakes) == 1


@pytest.mark.parametrize("change", [("[0, 0]", "[1e308, 1e308]"), ("empty", "[" * 3000)])
@pytest.mark.filterwarnings("error")
def test_huge_positions_and_deep_lists_are_one_line(change: tuple[str, str], tmp_path: Path, capsys) -> None:
    """Under `slalom run`, without warnings of numpy."""
    path = tmp_path / "a.yaml"
    goal = "goal: {position: [9, 0]}"
    good = f"name: empty\nrobot: {{position: [0, 0], radius: 0.5, max_speed: 2, max_acceleration: 1, {goal}}}\n"
    path.write_text(good)
    read_scenario(path)
    path.write_text(good.replace(*change))
    assert call(["run", str(path)]) == 2
    captured = capsys.readouterr()
    assert len(captured.err.splitlines()) == 1
    assert captured.out == ""
