"""Recorded tracks in every format: the same rows give the same tracks, the same repairs and the same refusals.

Each format has a sample that writes rows of (tick, agent, x, y); what must hold of all is tested on all.
"""

import csv
import json
import math
import re
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import h5py
import numpy as np
import pytest
import shapely
import shapely.affinity
from draws import examples
from hypothesis import given, strategies as st
from recording_formats import RECORDED, SAMPLES, WALK, Row, geocentric, recorded

from slalom import ConstantVelocity, InvalidFile, InvalidInput, Sampled
from slalom.io.formats import FORMATS, format_of, read_recording, write_recording
from slalom.io.layout import project
from slalom.io.recorded import Agent, RecordedTracks, tracks_at
from slalom.sim.files.recorded_traffic import read_recorded

ALL = pytest.mark.parametrize("name", FORMATS)


def read(folder: Path, name: str, rows: Sequence[Row], **settings) -> RecordedTracks:
    """The tracks of rows that a sample has written, without naming the format."""
    sample = SAMPLES[name]
    sample.write(folder / sample.name, rows)
    return read_recording(folder / sample.name, **{**sample.settings, **settings})


def mistakes(folder: Path, name: str, rows: Sequence[Row], **settings) -> tuple[list[str], list[str]]:
    """What is wrong with rows, and the places of the rows."""
    sample = SAMPLES[name]
    places = sample.write(folder / sample.name, rows)
    with pytest.raises(InvalidFile) as caught:
        read_recording(folder / sample.name, **{**sample.settings, **settings})
    return caught.value.mistakes, places


def expected(rows: Sequence[Row], tick: float) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Id, times and positions of each agent, ids in increasing order."""
    for agent in sorted({row[1] for row in rows}):
        own = np.array(sorted(row for row in rows if row[1] == agent))
        yield str(agent), own[:, 0] * tick, own[:, 2:]


def check(tracks: RecordedTracks, rows: Sequence[Row], name: str) -> None:
    """The tracks are the rows."""
    sample, wanted = SAMPLES[name], list(expected(rows, SAMPLES[name].tick))
    assert list(tracks.agents) == [label for label, _, _ in wanted]
    for label, times, positions in wanted:
        track = tracks.agents[label].trajectory
        np.testing.assert_allclose(track.times, times, rtol=1e-15, atol=1e-12)
        np.testing.assert_allclose(track.positions[:, :2], positions, rtol=0, atol=sample.exact)


def test_every_format_has_a_sample() -> None:
    assert list(SAMPLES) == list(FORMATS)
    for name, row in FORMATS.items():
        assert row.name == name
        assert row.sentence.endswith(".")


@ALL
def test_rows_are_read(name: str, tmp_path: Path) -> None:
    """Irregular times, agents that appear and vanish; nothing to note but what is assumed."""
    tracks = read(tmp_path, name, WALK)
    check(tracks, WALK, name)
    assert not [note for note in tracks.notes if "dropped" in note or "left out" in note or "split" in note]
    assert all(agent.trajectory.interpolation == "smooth" for agent in tracks.agents.values())
    linear = read_recording(tmp_path / SAMPLES[name].name, name, interpolation="linear", **SAMPLES[name].settings)
    assert {agent.trajectory.interpolation for agent in linear.agents.values()} == {"linear"}


@ALL
def test_one_format_recognises_the_sample(name: str, tmp_path: Path) -> None:
    sample = SAMPLES[name]
    sample.write(tmp_path / sample.name, WALK)
    text = (tmp_path / sample.name).read_bytes().decode(errors="replace")
    found = [row.name for row in FORMATS.values() if row.recognises(Path(sample.name).suffix, text)]
    # Any table with the usual names is one of csv; the first of the others is the format.
    assert ([other for other in found if other != "csv"] or ["csv"])[0] == name
    assert format_of(tmp_path / sample.name) == name


@ALL
@pytest.mark.parametrize("seed", [0, 1])
def test_rows_may_come_in_any_order(name: str, seed: int, tmp_path: Path) -> None:
    """The tracks are the same; how many rows came late is noted."""
    order = np.random.default_rng(seed).permutation(len(WALK))
    shuffled = [WALK[k] for k in order]
    tracks = read(tmp_path, name, shuffled)
    check(tracks, WALK, name)
    late = {a: sum(np.diff([row[0] for row in shuffled if row[1] == a]) < 0) for a in (3, 7, 12)}
    agents = ", ".join(str(agent) for agent in sorted(late) if late[agent])
    assert f"{sum(late.values())} rows of agents {agents} out of order: sorted by time" in tracks.notes


@ALL
def test_identical_rows_are_dropped_and_counted(name: str, tmp_path: Path) -> None:
    tracks = read(tmp_path, name, [*WALK[:4], WALK[2], WALK[2], *WALK[4:], WALK[-1]])
    check(tracks, WALK, name)
    assert "3 duplicate rows of agents 3, 7 dropped: identical time and position" in tracks.notes


@ALL
def test_two_places_at_one_time_are_refused(name: str, tmp_path: Path) -> None:
    rows = [*WALK, (3, 12, 90.0, 90.0), (21, 3, 0.0, 50.0)]
    found, places = mistakes(tmp_path, name, rows)
    tick = SAMPLES[name].tick
    assert len(found) == 2
    by_place = {places[-2]: (12, 3), places[-1]: (3, 21)}
    for place, (agent, k) in by_place.items():
        (line,) = (line for line in found if line.startswith(f"{place}: "))
        assert f": expected one position of agent {agent} at {k * tick:g} s, found (" in line


@ALL
def test_jumps_are_refused_if_a_speed_is_given(name: str, tmp_path: Path) -> None:
    rows = [*WALK[:5], (5, 7, 400.0, 0.0), *WALK[6:]]
    check(read(tmp_path, name, rows), rows, name)
    found, places = mistakes(tmp_path, name, rows, max_speed=20.0 / SAMPLES[name].tick)
    assert [line.split(": expected")[0] for line in found] == places[5:7]
    assert all("expected agent 7 no faster than " in line for line in found)


@ALL
def test_gaps_are_split(name: str, tmp_path: Path) -> None:
    """Into parts whose names say so; a part of a single row is left out. Without `gap`, where agents jump or return."""
    tick = SAMPLES[name].tick
    later = [*((k + 60, 7, x, y) for k, _, x, y in WALK[:5]), (40, 3, 0.0, 0.0)]
    rows = [*WALK, *later]
    whole = read(tmp_path, name, rows, gap=np.inf)
    check(whole, rows, name)
    told = " ".join(read(tmp_path, name, rows).notes)
    assert "2 gaps of agents 3, 7 split, where the way over the gap is no motion of its agent" in told
    parts = read(tmp_path, name, rows, gap=3 * tick)
    assert list(parts.agents) == ["3", "7", "7.1", "12"]
    gap = f"agent 7 split at a gap of {52 * tick:g} s (t = {8 * tick:g} s) into 7 and 7.1"
    assert gap in parts.notes
    assert f"agent 3 split at a gap of {18 * tick:g} s (t = {22 * tick:g} s) into 3 and 3.1" in parts.notes
    assert "1 track with a single row left out: id 3.1" in parts.notes
    assert not any("bridged" in note for note in parts.notes)
    np.testing.assert_allclose(parts.agents["7.1"].trajectory.times, np.arange(60, 65) * tick)
    # A gap is longer than `gap`, not as long.
    assert list(read_recording(tmp_path / SAMPLES[name].name, gap=52 * tick, **SAMPLES[name].settings).agents) == list(
        whole.agents
    )


@pytest.mark.parametrize(
    ("later", "parts"),
    [
        ((1.5, 1.2, 0.0), 1),  # it goes on
        ((1.4, 0.85, 0.85), 1),  # it turns by half a right angle
        ((0.7, 0.6, 0.0), 1),  # slower
        ((0.2, 1.2, 0.0), 2),  # another one where it vanished
        ((-3.0, 1.2, 0.0), 2),  # where it appeared
        ((6.0, 1.2, 0.0), 2),  # too far
        ((0.6, -1.2, 0.0), 2),  # towards it
    ],
)
def test_ids_used_again_are_two_agents(later: tuple[float, float, float], parts: int, tmp_path: Path) -> None:
    """Walkers at 1.2 m/s with noise of 1 cm, at 25 Hz, with a gap of 1.2 s; `later`: way over it, velocity after it."""
    rng, times = np.random.default_rng(3), np.arange(100) / 25.0
    across, velocity = later[0], np.array(later[1:])
    first = times[:, None] * (1.2, 0.0)
    second = first[-1] + (across, 0.0) + times[:, None] * velocity
    rows = np.concatenate([first, second]) + rng.normal(0.0, 0.01, (200, 2))
    stamps = np.concatenate([times, times[-1] + 1.2 + times])
    lines = [f"{t:.2f},7,{x:.4f},{y:.4f}" for t, (x, y) in zip(stamps, rows)]
    found = read_recording(text(tmp_path, "a.csv", "\n".join(["t,id,x,y", *lines]) + "\n"), unit="m")
    assert len(found.agents) == parts
    assert (" of agent 7 split, " in found.notes[0]) == (parts == 2)
    assert "--gap" in found.notes[0]


@ALL
def test_a_single_row_is_left_out_and_counted(name: str, tmp_path: Path) -> None:
    tracks = read(tmp_path, name, [*WALK, (4, 99, 0.0, 0.0), (6, 98, 1.0, 1.0)])
    check(tracks, WALK, name)
    assert "2 tracks with a single row left out: ids 98, 99" in tracks.notes


@ALL
def test_no_track_at_all_is_refused(name: str, tmp_path: Path) -> None:
    found, _ = mistakes(tmp_path, name, [(0, 1, 0.0, 0.0), (1, 2, 0.0, 0.0), (2, 3, 0.0, 0.0)])
    assert found == [f"{tmp_path / SAMPLES[name].name}: expected an agent with two rows or more, found none"]


@ALL
def test_a_bad_cell_is_refused_with_its_place(name: str, tmp_path: Path) -> None:
    rows = [*WALK[:3], SAMPLES[name].bad, *WALK[3:]]
    found, places = mistakes(tmp_path, name, rows)
    assert all(line.startswith(f"{places[3]}: ") for line in found)
    assert ": expected a" in found[0]


@ALL
def test_ten_mistakes_are_shown_and_the_others_counted(name: str, tmp_path: Path) -> None:
    again = [(k, agent, x + 50.0, y) for k, agent, x, y in WALK]
    found, places = mistakes(tmp_path, name, [*WALK, *again])
    assert len(found) == 11
    assert found[-1] == f"{tmp_path / SAMPLES[name].name}: and {len(again) - 10} more"
    assert {line.split(": expected")[0] for line in found[:10]} <= set(places)


@ALL
def test_files_that_cannot_be_read(name: str, tmp_path: Path) -> None:
    for other in ("none.txt", "."):
        for format in (None, name):
            with pytest.raises(InvalidFile, match="expected a") as caught:
                read_recording(tmp_path / other, format)
            assert len(caught.value.mistakes) == 1
    (tmp_path / "empty").write_text("")
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x01" * 50)
    for other in ("empty", "binary"):
        with pytest.raises(InvalidFile, match=": expected "):
            read_recording(tmp_path / other, name)


DAMAGE = (
    b"",
    b",",
    b" ",
    b"nan",
    b"inf",
    b"1e308",
    b'"',
    b"9" * 5000,
    b"null",
    b"[1]",
    b"\n",
    b"\xff",
    b"_",
    b"\0",
    b"#",
    b"<x/>",
)


@ALL
def test_damaged_files_are_read_or_refused(name: str, tmp_path: Path) -> None:
    """Never anything else: one error of the library, no warning."""
    sample, rng, refused = SAMPLES[name], np.random.default_rng(11), 0
    path = tmp_path / sample.name
    sample.write(path, WALK)
    content = path.read_bytes()
    for _ in range(60):
        start, length = rng.integers(len(content)), rng.integers(6)
        path.write_bytes(content[:start] + DAMAGE[rng.integers(len(DAMAGE))] + content[start + length :])
        try:
            read_recording(path, name, max_speed=1e3, **sample.settings)
        except InvalidFile:
            refused += 1
    assert refused > 10


def test_a_file_of_no_format_names_the_nearest(tmp_path: Path) -> None:
    """The two formats that lack the fewest columns, and which."""
    (tmp_path / "a.csv").write_text("when,who,x,y\n1,2,3,4\n")
    with pytest.raises(InvalidFile, match=r"expected a file of a known format.*found 'when,who,x,y'") as caught:
        read_recording(tmp_path / "a.csv")
    first, second = re.findall(r"(\w+) \([^)]*\), without ([^;]*);", str(caught.value))
    assert first == ("csv", "t or frame, id")
    assert second[0] in FORMATS


# Out, and in again.

WRITERS = [name for name, row in FORMATS.items() if row.writer]
OUT = pytest.mark.parametrize("name", WRITERS)


def written(folder: Path, tracks: RecordedTracks, name: str, rate: float) -> RecordedTracks:
    """What is read from the file to which tracks were written."""
    path = folder / SAMPLES[name].name
    write_recording(path, tracks, name, **({} if name == "csv" else {"frame_rate": rate}))
    return read_recording(path, unit="m", gap=np.inf)


@st.composite
def recordings(draw: st.DrawFn) -> tuple[RecordedTracks, float]:
    """Agents of whole ids at frames of some rate, in the plane, and the rate."""
    rate = draw(st.sampled_from([2.5, 10.0, 25.0, 29.97, 1000.0 / 3.0]))
    agents = {}
    for label in draw(st.lists(st.integers(0, 10**6), min_size=1, max_size=4, unique=True)):
        frames = sorted(draw(st.sets(st.integers(-1000, 10_000), min_size=2, max_size=12)))
        number = st.floats(-1e6, 1e6).map(lambda x: x + 0.0)
        positions = draw(st.lists(st.tuples(number, number), min_size=len(frames), max_size=len(frames)))
        agents[str(label)] = Agent(Sampled(np.array(frames) / rate, positions))
    return RecordedTracks(agents), rate


@OUT
@examples(30)
@given(recording=recordings())
def test_what_is_written_is_read(name: str, recording: tuple[RecordedTracks, float], tmp_path_factory) -> None:
    """Positions to the bit; times to rounding, in CSV to the bit."""
    tracks, rate = recording
    again = written(tmp_path_factory.mktemp("out"), tracks, name, rate)
    assert set(again.agents) == set(tracks.agents)
    for label, agent in tracks.agents.items():
        one, two = agent.trajectory, again.agents[label].trajectory
        np.testing.assert_array_equal(two.positions, one.positions)
        np.testing.assert_allclose(two.times, one.times, rtol=0 if name == "csv" else 1e-14, atol=0)


@OUT
def test_the_same_tracks_give_the_same_bytes(name: str, tmp_path: Path) -> None:
    tracks = read(tmp_path, "eth_ucy", WALK)
    one, two = (tmp_path / f"{k}" for k in "ab")
    for path in (one, two, one):
        write_recording(path, tracks, name, **({} if name == "csv" else {"frame_rate": 2.5}))
    assert one.read_bytes() == two.read_bytes()


def test_csv_keeps_space_extents_kinds_and_any_id(tmp_path: Path) -> None:
    agents = {
        "7.1": Agent(Sampled([0.1, 0.3], [(1, 2, 3), (4, 5, 6)]), "car", None, 4.5, 1.8),
        "a, b": Agent(Sampled([0.2, 0.25], [(1, 2, 3), (4, 5, 7)]), "", 0.25, None, None),
    }
    again = written(tmp_path, RecordedTracks(agents), "csv", 1.0)
    assert list(again.agents) == ["7.1", "a, b"]
    assert len(again.notes) == 1  # 71 m/s is warned of
    for label, agent in agents.items():
        two = again.agents[label]
        assert (two.kind, two.radius, two.length, two.width) == (agent.kind, agent.radius, agent.length, agent.width)
        np.testing.assert_array_equal(two.trajectory.positions, agent.trajectory.positions)
    text = (tmp_path / "a.csv").read_text().splitlines()
    assert text[:2] == ["t,id,x,y,z,radius,length,width,kind", "0.1,7.1,1.0,2.0,3.0,,4.5,1.8,car"]


@pytest.mark.parametrize("libver", ["earliest", "latest"])
@pytest.mark.parametrize("kinds", ["i8 i8 f8 f8", ">i4 u2 f4 >f8", "f8 f8 f8 f8"])
def test_records_of_the_archive(libver: str, kinds: str, tmp_path: Path) -> None:
    """Any numbers, compressed or not, in any order of the fields; holes of the area are walls as well."""
    path = tmp_path / "a.hdf5"
    area = "POLYGON ((0 0, 9 0, 9 8, 0 8, 0 0), (2 2, 3 2, 3 4, 2 2))"
    names = ["frame", "id", "y", "x", "z", "note"]
    dtype = list(zip(names, [*kinds.split(), "f4", h5py.string_dtype()]))
    with h5py.File(path, "w", libver=libver) as file:
        file.attrs["wkt_geometry"] = area
        file.attrs["title"] = "a corridor " * 900
        values = np.array([(k, agent, y, x, 1.5, "a") for k, agent, x, y in WALK], dtype)
        file.create_dataset("trajectory", data=values, compression="gzip").attrs["fps"] = 25
    tracks = read_recording(path)
    assert tracks.format == "pedpy_hdf5"
    check(tracks, WALK, "pedpy_hdf5")
    np.testing.assert_array_equal(tracks.walls[0], [(0, 0), (9, 0), (9, 8), (0, 8), (0, 0)])
    np.testing.assert_array_equal(tracks.walls[1], [(2, 2), (3, 2), (3, 4), (2, 2)])


def test_the_database_is_that_of_jupedsim(tmp_path: Path) -> None:
    """Version 2: what its own reader asks for is there, facing follows the motion and stays while an agent rests."""
    path = tmp_path / "a.sqlite"
    still = Agent(Sampled([0.0, 0.1, 0.2, 0.3, 0.4], [(0, 0), (0, 0), (0, 0), (0, 1), (0, 1)], "linear"))
    write_recording(
        path, RecordedTracks({"1": still, "4": Agent(Sampled([0.1, 0.2], [(3, 3), (3, 3)]))}), "jupedsim", frame_rate=10
    )
    with closing(sqlite3.connect(path)) as base:
        said = dict(base.execute("SELECT key, value FROM metadata"))
        ((wkt, shown),) = base.execute("SELECT wkt, hash FROM geometry")
        frames = base.execute("SELECT frame, geometry_hash FROM frame_data").fetchall()
        facing = base.execute("SELECT ori_x, ori_y FROM trajectory_data WHERE id = 1 ORDER BY frame").fetchall()
        asleep = base.execute("SELECT frame, pos_x, ori_x, ori_y FROM trajectory_data WHERE id = 4").fetchall()
    assert said == {"version": "2", "fps": "10.0", "xmin": "-1.0", "xmax": "4.0", "ymin": "-1.0", "ymax": "4.0"} | {
        "geometry": "bounding box of all positions"
    }
    assert wkt == "POLYGON ((-1.0 -1.0, 4.0 -1.0, 4.0 4.0, -1.0 4.0, -1.0 -1.0))"
    assert frames == [(k, shown) for k in range(5)]
    assert facing == [(0.0, 1.0)] * 5
    assert asleep == [(1, 3.0, 1.0, 0.0), (2, 3.0, 1.0, 0.0)]


def test_the_scene_of_trajnet_says_its_frames(tmp_path: Path) -> None:
    tracks = read(tmp_path, "eth_ucy", WALK)
    write_recording(tmp_path / "out.ndjson", tracks, "trajnet", frame_rate=25.0)
    first, second, *_ = (json.loads(line) for line in (tmp_path / "out.ndjson").read_text().splitlines())
    assert first == {"scene": {"id": 0, "p": 3, "s": 0, "e": 220, "fps": 2.5, "tag": 0}}
    assert second == {"track": {"f": 0, "p": 7, "x": 0.0, "y": 1.0}}


def test_agents_of_a_simulated_run() -> None:
    """Robots by their positions, obstacles by their trajectories at the times at which they exist."""
    times = np.arange(6) * 0.5
    robot, late = np.stack([times, -times], axis=1), Sampled([1.1, 9.0], [(0, 0), (7.9, 0)], "linear")
    motions = {"2": ConstantVelocity((0, 1), (1, 0)), "0": robot, "1": late, "9": Sampled([2.2, 4.0], [(0, 0), (1, 1)])}
    tracks = tracks_at(times, motions, {"0": 0.3})
    assert list(tracks.agents) == ["0", "1", "2"]
    assert tracks.notes == ("1 agent at fewer than two of the times left out: id 9",)
    assert [agent.radius for agent in tracks.agents.values()] == [0.3, None, None]
    np.testing.assert_array_equal(tracks.agents["0"].trajectory.positions, robot)
    np.testing.assert_array_equal(tracks.agents["1"].trajectory.times, [1.5, 2.0, 2.5])
    np.testing.assert_allclose(tracks.agents["1"].trajectory.positions[:, 0], [0.4, 0.9, 1.4])
    np.testing.assert_allclose(tracks.agents["2"].trajectory.positions, np.stack([times, np.ones(6)], axis=1))


def text(folder: Path, name: str, content: str) -> Path:
    """A file of this content."""
    path = folder / name
    path.write_text(content)
    return path


def test_properties_of_agents(tmp_path: Path) -> None:
    """0 and nothing are not known; the largest extent and the first kind are kept, and said."""
    content = (
        "t,id,x,y,length,width,kind\n0,1,0,0,4,0,car\n1,1,1,0,4.5,0,car\n0,2,9,9,,1,\n1,2,9,8,,1,van\n2,2,9,7,,1,car\n"
    )
    tracks = read_recording(text(tmp_path, "a.csv", content))
    one, two = tracks.agents.values()
    assert (one.kind, one.radius, one.length, one.width) == ("car", None, 4.5, None)
    assert (two.kind, two.radius, two.length, two.width) == ("van", None, None, 1.0)
    assert tracks.notes == (
        "length of agent 1 varies: the largest is kept",
        "kind of agent 2 varies: the first is kept",
    )
    with pytest.raises(InvalidFile, match=r"a\.csv:2: length: expected 0 or more, found -4"):
        read_recording(text(tmp_path, "a.csv", content.replace(",4,", ",-4,")))


def test_ids(tmp_path: Path) -> None:
    """Numbers first, by value, then texts; 7.0 is 7, 007 is not. A part takes no name that is there."""
    rows = [f"{t},{agent},{t},0" for agent in ("10", "b", "007", "7", "-2", "7.1", "a") for t in (0, 1)]
    content = "\n".join(["t,id,x,y", *rows, "50,7.0,0,0", "51,7,0,0"])
    tracks = read_recording(text(tmp_path, "a.csv", content), gap=9.0)
    assert list(tracks.agents) == ["-2", "007", "7", "7.1", "7.2", "10", "a", "b"]
    assert tracks.notes == ("agent 7 split at a gap of 49 s (t = 1 s) into 7 and 7.2",)


def test_many_agents_in_a_note_are_counted(tmp_path: Path) -> None:
    rows = [(0, k, 0.0, 0.0) for k in range(100, 125)]
    notes = read(tmp_path, "csv", [*WALK, *rows]).notes
    listed = ", ".join(map(str, range(100, 110)))
    assert notes[0] == f"25 tracks with a single row left out: ids {listed} and 15 more"


def test_quoted_cells_may_span_lines(tmp_path: Path) -> None:
    """Lines are counted as an editor counts."""
    content = 't,id,x,y,kind\n0,1,0,0,"a\nb"\n1,1,0,1,"c, d"\n\n2,1,left,0,e\n'
    with pytest.raises(InvalidFile, match=r"a\.csv:6: x: expected a number, found 'left'"):
        read_recording(text(tmp_path, "a.csv", content))


def test_obsmat(tmp_path: Path) -> None:
    """Eight columns, y in the fifth, frames 6 apart at 15 Hz."""
    lines = [f"  {780 + 6 * k:.7e}   1.0000000e+00   {k / 4:.7e}  0.0  {8 - k:.7e}  1.0 0.0 2.0" for k in range(4)]
    track = read_recording(text(tmp_path, "obsmat.txt", "\n".join(lines))).agents["1"].trajectory
    np.testing.assert_allclose(track.times, (780 + 6 * np.arange(4)) / 15)
    np.testing.assert_array_equal(track.positions, [(k / 4, 8 - k) for k in range(4)])


def test_trajnet_rates_and_predictions(tmp_path: Path) -> None:
    rows = [{"track": {"f": 6 * k, "p": 1, "x": float(k), "y": 0.0}} for k in range(4)]
    guess = {"track": {"f": 18, "p": 1, "x": 9.0, "y": 9.0, "prediction_number": 0, "scene_id": 0}}
    scene = {"scene": {"id": 1, "p": 1, "s": 0, "e": 18, "fps": 5.0}}

    def times(*lines: object, **given: float) -> np.ndarray:
        path = text(tmp_path, "a.ndjson", "\n".join(json.dumps(line) for line in lines))
        return read_recording(path, **given).agents["1"].trajectory.times

    np.testing.assert_allclose(times(*rows), np.arange(4) * 0.4)
    np.testing.assert_allclose(times(scene, *rows), np.arange(4) * 0.2)
    np.testing.assert_allclose(times(scene, *rows, frame_rate=6.0), np.arange(4))
    np.testing.assert_allclose(times(scene, *rows, guess), np.arange(4) * 0.2)
    assert read_recording(tmp_path / "a.ndjson").notes[0] == "1 predicted row left out"
    with pytest.raises(InvalidFile) as caught:
        times(scene, *rows, {"scene": {"fps": 2.5}}, {"scene": {"fps": "fast"}}, {"crowd": 1})
    assert [line.split("a.ndjson:")[1] for line in caught.value.mistakes] == [
        "6: fps: expected 5 as in line 1, found 2.5",
        "7: fps: expected a number above 0, found 'fast'",
        "8: expected a scene or a track, found '{\"crowd\": 1}'",
    ]
    with pytest.raises(InvalidFile, match=r"a\.ndjson:3: x: expected a number, found None"):
        times(*rows[:2], {"track": {"f": 1, "p": 1, "y": 0}})


def test_units_and_rates_of_pedpy(tmp_path: Path) -> None:
    def place(head: str, **given: object) -> np.ndarray:
        path = text(tmp_path, "a.txt", f"{head}\n1 0 250 5\n1 8 350 5\n")
        track = read_recording(path, "pedpy", **given).agents["1"].trajectory
        return np.array([*track.positions[0], track.times[1]])

    np.testing.assert_allclose(place("# framerate: 16\n# id frame x/cm y/cm"), [2.5, 0.05, 0.5])
    np.testing.assert_allclose(place("#framerate:16.00\n# x, y in cm"), [2.5, 0.05, 0.5])
    np.testing.assert_allclose(place("# in m", frame_rate=8), [250, 5, 1.0])
    np.testing.assert_allclose(place("# framerate: 8", unit="cm"), [2.5, 0.05, 1.0])
    np.testing.assert_allclose(place("# framerate: 8", unit="m"), [250, 5, 1.0])
    slow = text(tmp_path, "a.txt", "# framerate: 8\n1 0 250 5\n1 8 251 5\n")
    assert read_recording(slow).notes[0] == "unit of the positions not stated: m assumed"
    for head, settings_given, message in (
        ("#", {}, "expected a frame rate above 0, in the file or given, found none"),
        ("# framerate: 0", {}, "expected a frame rate above 0, in the file or given, found 0 Hz"),
        ("# framerate: 25", {"frame_rate": 16}, "expected the frame rate of 16 Hz, found 25 Hz"),
        ("# framerate: 25\n# x/m", {"unit": "cm"}, "expected the given unit cm, found m"),
    ):
        with pytest.raises(InvalidFile, match=message):
            place(head, **settings_given)


def test_reading_makes_no_database(tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match="expected a readable JuPedSim database"):
        read_recording(tmp_path / "none.sqlite", "jupedsim")
    assert not list(tmp_path.iterdir())


def test_kinds_and_extents_of_drone_data(tmp_path: Path) -> None:
    agents = read(tmp_path, "drone", WALK).agents
    assert [(a.kind, a.length, a.width) for a in agents.values()] == [
        ("", 4.5, 1.8),
        ("car", 4.5, 1.8),
        ("pedestrian", None, None),
    ]


def test_highd_gives_the_corner_of_the_box(tmp_path: Path) -> None:
    content = "frame,id,x,y,width,height,xVelocity\n1,4,10,20,5,2,25\n2,4,11,20,5,2,25\n"
    path = text(tmp_path, "01_tracks.csv", content)
    tracks = read_recording(path, frame_rate=25)
    (agent,) = tracks.agents.values()
    np.testing.assert_array_equal(agent.trajectory.positions, [(12.5, 21), (13.5, 21)])
    assert (agent.length, agent.width, tracks.notes) == (5.0, 2.0, ("y points down, as in the file",))
    with pytest.raises(InvalidFile, match=r"01_recordingMeta\.csv: expected one frameRate above 0, found none"):
        read_recording(path)
    text(tmp_path, "01_recordingMeta.csv", "id,frameRate\n1,30\n")
    np.testing.assert_allclose(read_recording(path).agents["4"].trajectory.times, [1 / 30, 2 / 30])
    with pytest.raises(InvalidFile, match=r"expected one frameRate of 25 Hz, as given, found 30"):
        read_recording(path, frame_rate=25)


def test_cases_of_interaction(tmp_path: Path) -> None:
    """Each begins anew: one is read. Pedestrians have ids like P1 and no box."""
    head = "case_id,track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy\n"
    rows = [f"{case}.0,P1,{k},{100 * k},pedestrian/bicycle,{10 * case + k},0,1,0" for case in (1, 2) for k in range(3)]
    path = text(tmp_path, "a.csv", head + "\n".join(rows))
    agent = read_recording(path, case=2).agents["P1"]
    np.testing.assert_array_equal(agent.trajectory.positions[:, 0], [20, 21, 22])
    assert (agent.kind, agent.length) == ("pedestrian/bicycle", None)
    for case, message in (
        (None, "expected one case, or the case to read, found 2 from 1 to 2"),
        (5, "expected case 5, found 2 from 1 to 2"),
    ):
        with pytest.raises(InvalidFile, match=message):
            read_recording(path, case=case)


OBSTACLE = """\
<obstacle id="{id}"><role>{role}</role><type>truck</type><shape>{shape}</shape>
<initialState><position><point><x>{id}</x><y>0</y></point></position><time><exact>0</exact></time></initialState>
{motion}</obstacle>
"""
STATE = "<state><position>{}</position><time><exact>1</exact></time></state>"
MOVED = f"<trajectory>{STATE.format('<point><x>5</x><y>1</y></point>')}</trajectory>"
CIRCLE, BOX = "<circle><radius>2</radius></circle>", "<rectangle><length>8</length><width>2.5</width></rectangle>"


def scenario(folder: Path, *obstacles: tuple[str, str, str]) -> Path:
    """A scenario of version 2018b of obstacles by role, shape and motion."""
    parts = [OBSTACLE.format(id=k, role=r, shape=s, motion=m) for k, (r, s, m) in enumerate(obstacles, start=1)]
    return text(
        folder, "a.xml", f'<commonRoad commonRoadVersion="2018b" timeStepSize="0.5">\n{"".join(parts)}</commonRoad>'
    )


def test_commonroad_2018b(tmp_path: Path) -> None:
    """Circles and rectangles are known, others covered; what does not move or only occupies is left out, and said."""
    path = scenario(
        tmp_path,
        ("dynamic", CIRCLE, MOVED),
        ("dynamic", BOX, MOVED),
        ("dynamic", CIRCLE + BOX, MOVED),
        (
            "dynamic",
            BOX.replace("</r", "<orientation>0.0</orientation><center><x>0</x><y>-0.00</y></center></r"),
            MOVED,
        ),
        ("dynamic", BOX.replace("</r", "<center><x>1.5</x><y>0</y></center></r"), MOVED),
        ("static", BOX, ""),
        ("dynamic", BOX, "<occupancySet></occupancySet>"),
    )
    tracks = read_recording(path)
    assert [(a.kind, a.radius, a.length, a.width) for a in tracks.agents.values()] == [
        ("truck", 2.0, None, None),
        ("truck", None, 8.0, 2.5),
        ("truck", pytest.approx(math.hypot(4.0, 1.25)), None, None),
        ("truck", None, 8.0, 2.5),
        ("truck", pytest.approx(math.hypot(5.5, 1.25)), None, None),
    ]
    np.testing.assert_array_equal(tracks.agents["1"].trajectory.times, [0, 0.5])
    np.testing.assert_array_equal(tracks.agents["2"].trajectory.positions, [(2, 0), (5, 1)])
    assert tracks.notes == (
        "1 obstacle at rest, outlines read as walls: id 6",
        "1 obstacle without a trajectory left out: id 7",
        "shape of obstacles 3, 5 covered by a disc about the position",
    )


def test_static_obstacles_of_commonroad_are_walls(tmp_path: Path) -> None:
    """Turned, moved, round and of several parts; those without an exact place are left out."""
    turned = "<orientation><exact>1.5707963267948966</exact></orientation><time>"
    part = BOX.replace("</r", "<orientation>0.5</orientation><center><x>1</x><y>2</y></center></r")
    still = [("static", shape, "") for shape in (BOX, CIRCLE + part, "")]
    path = scenario(tmp_path, ("dynamic", BOX, MOVED), *still)
    path.write_text(path.read_text().replace("<time>", turned))
    tracks = read_recording(path)
    box, circle, moved = (shapely.Polygon(ring) for ring in tracks.walls)
    assert box.symmetric_difference(shapely.box(2 - 1.25, -4, 2 + 1.25, 4)).area < 1e-9
    disc = shapely.Point(3, 0).buffer(2.0, quad_segs=200)
    assert circle.covers(shapely.Point(3, 0).buffer(1.9999))
    assert circle.hausdorff_distance(disc) < 0.0052
    wanted = shapely.affinity.rotate(shapely.box(-4, -1.25, 4, 1.25), 0.5, (0, 0), use_radians=True)
    wanted = shapely.affinity.translate(wanted, 1, 2)
    wanted = shapely.affinity.translate(shapely.affinity.rotate(wanted, 90, (0, 0)), 3, 0)
    assert moved.symmetric_difference(wanted).area < 1e-6
    assert "2 obstacles at rest, outlines read as walls: ids 2, 3" in tracks.notes
    assert "1 obstacle left out: neither dynamic nor at rest at an exact place: id 4" in tracks.notes
    found = read_recorded(path)
    assert [one.at_rest for one in found.obstacles] == [False, True, True, True]


def test_commonroad_wants_exact_values(tmp_path: Path) -> None:
    vague = f"<trajectory>\n{STATE.format(CIRCLE)}</trajectory>"
    with pytest.raises(InvalidFile) as caught:
        read_recording(scenario(tmp_path, ("dynamic", BOX, MOVED), ("dynamic", BOX, vague)))
    (line,) = caught.value.mistakes
    assert line.endswith(
        "a.xml:8: expected an exact time and a position of obstacle 2, found position by circle, time by exact"
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("2018b", "2017a", "expected a commonRoad of version 2018b or 2020a, found a commonRoad of 2017a"),
        ("commonRoad ", "road ", "found '<road commonRoadVersion"),
        ('"0.5"', '"often"', r"a\.xml:1: timeStepSize: expected a number above 0, found 'often'"),
        ("</commonRoad>", "", r"a\.xml:\d: expected XML, found no element found"),
        ("<x>5</x>", "<x>left</x>", r"a\.xml:4: x: expected a number, found 'left'"),
        ('id="1"', "", r"a\.xml:3: id: expected an id, found nothing"),
    ],
)
def test_other_scenarios_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = scenario(tmp_path, ("dynamic", BOX, MOVED))
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InvalidFile, match=message):
        read_recording(path)


@examples(50)
@given(
    origin=st.tuples(st.floats(-89, 89), st.floats(-180, 180), st.floats(-100, 9000)),
    places=st.lists(
        st.tuples(st.floats(-90, 90), st.floats(-180, 180), st.floats(-100, 12000)), min_size=2, max_size=5
    ),
)
def test_projection_keeps_distances_in_space(origin, places) -> None:
    """Against positions from the axes of the ellipsoid; the origin is at 0, up is away from the middle of the Earth."""
    lat, lon, alt = np.array(places).T
    projected = project(lat, lon, alt, origin)
    space = np.array([geocentric(math.radians(p), math.radians(q), h) for p, q, h in places])
    apart = np.linalg.norm(space[1:] - space[0], axis=1)
    np.testing.assert_allclose(np.linalg.norm(projected[1:] - projected[0], axis=1), apart, rtol=1e-12, atol=1e-7)
    np.testing.assert_allclose(project(*origin, origin), 0, atol=1e-7)
    np.testing.assert_allclose(project(origin[0], origin[1], origin[2] + 100, origin), [0, 0, 100], atol=1e-6)
    east, north = (
        project(origin[0], origin[1] + 1e-4, origin[2], origin),
        project(origin[0] + 1e-4, *origin[1:], origin),
    )
    assert east[0] > 0 > -1e-4 < east[1]
    assert north[1] > 10
    assert abs(north[0]) < 1e-6


def test_a_minute_of_latitude_is_a_nautical_mile() -> None:
    """1852 m at 45 degrees to 1 m; one of longitude, cos 45 of the equator's 1855.3 m and a little more."""
    _, north, _ = project(45 + 0.5 / 60, 0, 0, (45 - 0.5 / 60, 0))
    east, _, _ = project(0, 1 / 60, 0, (0, 0))
    assert north == pytest.approx(1852.2, abs=0.1)
    assert east == pytest.approx(math.radians(1 / 60) * 6378137, abs=1e-4)


def test_ships_by_default(tmp_path: Path) -> None:
    """Time and place count from the first and the mean, as noted; no place is no row; a quoted name is a cell."""
    tracks = read_recording(ships(tmp_path))
    assert list(tracks.agents) == ["003669999"]
    (agent,) = tracks.agents.values()
    assert (agent.kind, agent.length, agent.width) == ("70", 40.0, None)
    np.testing.assert_array_equal(agent.trajectory.times, [0, 60.5, 120])
    np.testing.assert_allclose(agent.trajectory.positions[:, 1], [-111, 0, 111], atol=0.5)
    assert tracks.notes == (
        "2 rows without a position left out",
        "origin at the mean position: latitude 37.801, longitude -122.4",
        "time 0 at the first time: 2022-01-03T00:00:00+00:00",
        "1 track with a single row left out: id 9",
    )


def ships(folder: Path, **changes: str) -> Path:
    """A small AIS table."""
    content = """\
MMSI,BaseDateTime,LAT,LON,VesselName,VesselType,Length,Width
003669999,2022-01-03T00:00:00,37.8,-122.4,"SMITH, JONES",70,40,
003669999,2022-01-03T00:01:00.500,37.801,-122.4,"SMITH, JONES",70,40,
003669999,2022-01-03T01:02:00+01:00,37.802,-122.4,"SMITH, JONES",70,40,
003669999,2022-01-03T00:02:10,91.0,181.0,"SMITH, JONES",70,40,
9,2022-01-03T00:02:20,,,,,,
9,2022-01-03T00:02:30Z,37.801,-122.4,,,,
"""
    for old, new in changes.items():
        content = content.replace(old, new)
    return text(folder, "a.csv", content)


def test_settings_of_ships(tmp_path: Path) -> None:
    """An origin and an epoch of one's own; columns by any name."""
    fixed = {"origin": (37.8, -122.4), "epoch": "2022-01-02T23:59:00Z"}
    (agent,) = read_recording(ships(tmp_path), **fixed).agents.values()
    np.testing.assert_array_equal(agent.trajectory.times, [60, 120.5, 180])
    np.testing.assert_allclose(agent.trajectory.positions[0], [0, 0], atol=1e-9)
    renamed = ships(tmp_path, MMSI="ship", LAT="north", BaseDateTime="clock")
    columns = {"id": "ship", "latitude": "north", "t": "clock", "length": None}
    (again,) = read_recording(renamed, "ais", columns=columns, **fixed).agents.values()
    np.testing.assert_array_equal(again.trajectory.positions, agent.trajectory.positions)
    assert again.length is None
    for changes, message in (
        ({"37.802": "97.8"}, r"a\.csv:4: LAT: expected from -90 to 90 degrees, found 97\.8"),
        (
            {"2022-01-03T00:01:00.500": "01-03-2022"},
            r"a\.csv:3: BaseDateTime: expected a time in ISO 8601 or in seconds",
        ),
        ({"LAT": "north"}, r"a\.csv:1: expected columns of latitude, or their names in columns, found 'MMSI,"),
    ):
        with pytest.raises(InvalidFile, match=message):
            read_recording(ships(tmp_path, **changes), "ais")
    for wrong, message in (
        ({"columns": {"speed": "SOG"}}, "columns: expected one of t, frame, id, .*; found 'speed'"),
        ({"origin": (100, 0)}, "origin: expected a latitude and a longitude in degrees, found"),
        ({"epoch": "noon"}, "epoch: expected seconds or a time in ISO 8601, found 'noon'"),
    ):
        with pytest.raises(InvalidInput, match=message):
            read_recording(ships(tmp_path), **wrong)


def test_the_mean_place_across_the_antimeridian(tmp_path: Path) -> None:
    content = "time,mmsi,lat,lon\n0,1,10,179.99\n60,1,10,-179.99\n"
    tracks = read_recording(text(tmp_path, "a.csv", content))
    assert tracks.notes[0] == "origin at the mean position: latitude 10.0, longitude 180.0"
    assert np.ptp(tracks.agents["1"].trajectory.positions[:, 0]) == pytest.approx(0.02 * 109_639, rel=1e-4)


def test_aircraft_in_space_and_in_the_plane(tmp_path: Path) -> None:
    """Hexadecimal addresses are texts, 4e1234 too; the altitude may be in feet or not be read."""
    head = "time,icao24,lat,lon,geoaltitude\n"
    rows = [f"{1480760792 + k},4e1234,{50 + 0.001 * k},8,{1000 + k}" for k in range(3)]
    path = text(tmp_path, "a.csv", head + "\n".join([*rows, "1480760795,4e1234,50.003,8,NULL"]))
    tracks = read_recording(path, origin=(50, 8))
    assert list(tracks.agents) == ["4e1234"]
    assert tracks.notes == ("1 row without a position left out", "time 0 at the first time: 1480760792.0")
    track = tracks.agents["4e1234"].trajectory
    np.testing.assert_array_equal(track.times, [0, 1, 2])
    np.testing.assert_allclose(track.positions[:, 2], [1000, 1001, 1002], atol=0.01)
    feet = read_recording(path, origin=(50, 8), altitude_unit=0.3048).agents["4e1234"].trajectory
    np.testing.assert_allclose(feet.positions[0, 2], 304.8, atol=1e-6)
    assert read_recording(path, origin=(50, 8), columns={"altitude": None}).agents["4e1234"].trajectory.dimension == 2


@recorded
@pytest.mark.parametrize(
    "file", ["pedestrians/fzj_unidirectional_500_01", "marine/ais_sanfrancisco", "air3d/crazyswarm_swap6v"]
)
def test_recordings_need_no_repair(file: str) -> None:
    """And are the cells of the file, to the bit."""
    path = RECORDED / f"{file}.csv"
    tracks = read_recording(path)
    assert not tracks.notes
    with path.open() as lines:
        rows = sorted((int(row["id"]), *(float(row[c]) for c in "txy")) for row in csv.DictReader(lines))
    found = [
        (int(label), t, *place[:2])
        for label, agent in tracks.agents.items()
        for t, place in zip(agent.trajectory.times.tolist(), agent.trajectory.positions.tolist())
    ]
    assert found == rows
    assert all((agent.radius is not None) == file.startswith("marine") for agent in tracks.agents.values())


@recorded
@OUT
def test_a_recording_goes_through_every_format(name: str, tmp_path: Path) -> None:
    tracks = read_recording(RECORDED / "pedestrians" / "fzj_corner.csv")
    again = written(tmp_path, tracks, name, 10.0)
    assert list(again.agents) == list(tracks.agents)
    assert not again.notes
    for one, two in zip(tracks.agents.values(), again.agents.values()):
        np.testing.assert_array_equal(two.trajectory.positions, one.trajectory.positions)
        np.testing.assert_allclose(two.trajectory.times, one.trajectory.times, rtol=1e-15)


@recorded
@pytest.mark.parametrize(
    ("scenario", "csv", "origin"),
    [("USA_US101-3_1_T-1", "ngsim_us101_3_1", (36, -39)), ("USA_US101-4_1_T-1", "ngsim_us101_4_1", (13, -18))],
)
def test_commonroad_beside_its_conversion(scenario: str, csv: str, origin: tuple[float, float]) -> None:
    """The CSV was smoothed over 1.5 s about its own origin: 0.25 m at most, 2 cm in the middle."""
    one, two = (read_recording(RECORDED / "vehicles" / name) for name in (f"{scenario}.xml", f"{csv}.csv"))
    assert not one.notes
    assert len(one.agents) == len(two.agents) > 20
    off = []
    for a, b in zip(one.agents.values(), two.agents.values()):
        np.testing.assert_allclose(a.trajectory.times, b.trajectory.times, atol=1e-9)
        assert (a.kind, a.length, a.width) == (
            b.kind,
            pytest.approx(b.length, abs=6e-4),
            pytest.approx(b.width, abs=6e-4),
        )
        off.append(np.linalg.norm(a.trajectory.positions - origin - b.trajectory.positions, axis=1))
    assert np.concatenate(off).max() < 0.25
    assert np.median(np.concatenate(off)) < 0.02
