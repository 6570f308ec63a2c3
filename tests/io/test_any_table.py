"""Tables as people have them: the walk of two agents is the same in many shapes, or one message says what to do."""

import gzip
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from slalom import METHODS, InvalidFile, Sampled
from slalom.io.formats import read_recording, write_recording
from slalom.io.recorded import Agent, RecordedTracks
from slalom.model.trajectory.kinds import LONG_PIECE
from slalom.sim import simulate
from slalom.sim.files.recorded_traffic import crossing, read_recorded

TIMES = np.arange(31) / 10
WALK = {"1": np.stack([TIMES, 0.0 * TIMES], axis=1), "2": np.stack([5.0 - TIMES, 0.0 * TIMES + 1.0], axis=1)}
"""Two agents that walk at 1 m/s for 3 s."""
ROWS = [(k, label, *WALK[label][k].round(3).tolist()) for k in range(31) for label in WALK]
"""Frame, id, x, y."""


def table(head: str, row: str, of: Callable[[float], object] = lambda t: round(t, 3)) -> str:
    """The walk below a head; `row` is formatted with t, frame k, id a, x and y."""
    lines = [row.format(t=of(k / 10), k=k, a=a, x=x, y=y) for k, a, x, y in ROWS]
    return "\n".join([*([head] if head else []), *lines]) + "\n"


def iso(t: float) -> str:
    """A time of the first of May 2024."""
    return f"2024-05-01T10:00:{t:06.3f}"


PLAIN = table("t,id,x,y", "{t},{a},{x},{y}")
AT_10 = {"frame_rate": 10.0}
WIDE = "t;x1 [cm];y1 [cm];x2 [cm];y2 [cm]\n" + "".join(
    f"{k / 10};{10 * k};0;{500 - 10 * k};100\n".replace(".", ",") for k in range(31)
)
READ: dict[str, tuple[str | bytes, dict[str, object]]] = {
    "plain.csv": (PLAIN, {}),
    "reversed.csv": ("\n".join(["t,id,x,y", *PLAIN.splitlines()[:0:-1]]), {}),
    "bom.csv": ("\N{BYTE ORDER MARK}" + PLAIN.replace("\n", "\r\n"), {}),
    "index.csv": (table(",t,id,x,y", "{k},{t},{a},{x},{y}"), {}),
    "upper.csv": (table("T,ID,X,Y", "{t},{a},{x},{y}"), {}),
    "names.csv": (table("Timestamp,track_id,pos_x,pos_y", "{t},{a},{x},{y}"), {}),
    "given.csv": (
        table("when,who,east_of,up", "{t},{a},{x},{y}"),
        {"columns": {"t": "when", "id": "who", "x": "east_of", "y": "up"}},
    ),
    "numbers.csv": (table("", "{t},{a},{x},{y}"), {"columns": {"t": "1", "id": "2", "x": "3", "y": "4"}}),
    "sum.csv": (table("t,id,a,b,w", "{t},{a},{x},{y},0"), {"columns": {"x": "a + 0.5 * w", "y": "-1 * w + b"}}),
    "units.csv": (table("t [ms],id,x [mm],y/cm", "{t},{a},{x}e3,{y}e2", lambda t: round(1000 * t)), {}),
    "suffixes.csv": (table("time_ms,id,x_m,y_m", "{t},{a},{x},{y}", lambda t: round(1000 * t)), {}),
    "row.csv": (table('"t","id","x","y"\n"s","","m","m"', "{t},{a},{x},{y}"), {}),
    "top.csv": (table("# written by a tracker, in m and s\nt,id,x,y", "{t},{a},{x},{y}"), {}),
    "semicolon.csv": (table("t;id;x;y", "{t};{a};{x};{y}"), {}),
    "decimal.csv": (table("t;id;x;y", "{t};{a};{x};{y}").replace(".", ","), {}),
    "decimal.txt": (table("", "{a} {k} {x} {y}").replace(".", ","), AT_10),
    "tab.tsv": (table("t\tid\tx\ty", "{t}\t{a}\t{x}\t{y}"), {}),
    "utf16.csv": (PLAIN.encode("utf-16"), {}),
    "latin.csv": (table("t,id,x,y,größe", "{t},{a},{x},{y},ß").encode("latin-1"), {"encoding": "latin-1"}),
    "packed.csv.gz": (gzip.compress(PLAIN.encode()), {}),
    "iso.csv": (table("t,id,x,y", "{t}+02:00,{a},{x},{y}", iso), {}),
    "space.csv": (table("t,id,x,y", "{t}000000 +0000 UTC,{a},{x},{y}", lambda t: iso(t).replace("T", " ")), {}),
    "epoch_s.csv": (table("t,id,x,y", "{t},{a},{x},{y}", lambda t: 1.7e9 + t), {}),
    "epoch_us.csv": (table("t,id,x,y", "{t},{a},{x},{y}", lambda t: round(1.7e15 + 1e6 * t)), {}),
    "epoch.csv": (table("t,id,x,y", "{t},{a},{x},{y}", lambda t: 1.7e9 + t), {"epoch": 1.7e9}),
    "ms.csv": (table("t,id,x,y", "{t},{a},{x},{y}", lambda t: round(1000 * t)), {"time_unit": "ms"}),
    "frame.csv": (table("frame,id,x,y", "{k},{a},{x},{y}"), AT_10),
    "pixels.csv": (table("t,id,x,y", "{t},{a},{x}e2,{y}e2"), {"unit": 0.01}),
    "blank.csv": (table("t,id,x,y", "{t},{a},{x},{y}") + "1.05,1,,\n1.05,2,NaN,nan\n", {}),
    "comma.csv": (table("t,id,x,y", "{t},{a},{x},{y},"), {}),
    "twice.csv": (PLAIN + "1.0,1,9,9\n", {"keep": "first"}),
    "wide.csv": (WIDE, {}),
    "wide_names.csv": (
        "frame,1_x,1_y,2_x,2_y\n" + "".join(f"{k},{k / 10},0,{5 - k / 10},1\n" for k in range(31)),
        AT_10,
    ),
    "order.txt": (table("", "{a} {k} {x} {y}"), AT_10),
    "order_z.txt": (table("", "{a} {k} {x} {y} 1.7"), AT_10),
    "header.txt": (table("PersID Frame X Y Z", "{a} {k} {x} {y} 1.7"), AT_10),
    "fps.txt": (table("# fps: 10\n# id frame x/m y/m z/m", "{a} {k} {x} {y} 1.7"), {}),
    "words.txt": (table("# 10 frames per second\n# id frame x/m y/m", "{a} {k} {x} {y}"), {}),
    "camera.txt": (table("# camera frame rate 30 fps, framerate: 10\n# id frame x/m y/m", "{a} {k} {x} {y}"), {}),
    "height.txt": (table("# framerate: 10\n# height in cm\n# id frame x/m y/m z/cm", "{a} {k} {x} {y} 170"), {}),
    "bracket.txt": (table("# framerate: 10\n# id frame x[cm] y[cm]", "{a} {k} {x}e2 {y}e2"), {}),
}
"""Content and settings by the name of the file."""


def write(folder: Path, name: str, content: str | bytes) -> Path:
    """A file of this content."""
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def check(tracks: RecordedTracks) -> None:
    """The tracks are the walk."""
    assert list(tracks.agents) == ["1", "2"]
    for label, agent in tracks.agents.items():
        np.testing.assert_allclose(agent.trajectory.times, TIMES, atol=1e-6)
        np.testing.assert_allclose(agent.trajectory.positions, WALK[label], atol=1e-6)
    assert not any(note.startswith("warning") for note in tracks.notes)


@pytest.mark.parametrize("name", READ)
def test_the_walk_is_read(name: str, tmp_path: Path) -> None:
    content, given = READ[name]
    check(read_recording(write(tmp_path, name, content), **given))


def test_parquet(tmp_path: Path) -> None:
    """Numbers and dates; the names of a format of the field too."""
    pd = pytest.importorskip("pandas")
    frame = pd.DataFrame(ROWS, columns=["k", "id", "x", "y"])
    frame.assign(t=frame["k"] / 10).to_parquet(tmp_path / "a.parquet")
    check(read_recording(tmp_path / "a.parquet"))
    frame.assign(t=pd.Timestamp("2024-05-01") + pd.to_timedelta(frame["k"] / 10, unit="s")).to_parquet(
        tmp_path / "b.parquet"
    )
    check(read_recording(tmp_path / "b.parquet"))
    names = {"k": "timestep", "id": "track_id", "x": "position_x", "y": "position_y"}
    frame.rename(columns=names).assign(object_type="pedestrian").to_parquet(tmp_path / "scenario_1.parquet")
    tracks = read_recording(tmp_path / "scenario_1.parquet")
    check(tracks)
    assert tracks.format == "argoverse"
    assert {agent.kind for agent in tracks.agents.values()} == {"pedestrian"}


@settings(max_examples=30, deadline=None)
@given(
    separator=st.sampled_from([",", ";", "\t"]),
    names=st.sampled_from(["t id x y", "TIME Track_ID pos_x Pos-Y", "y x id timestamp", "x [m] y [m] t [s] agent_id"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    ending=st.sampled_from(["\n", "\r\n"]),
    order=st.randoms(use_true_random=False),
)
def test_shapes_in_any_combination(separator, names, encoding, ending, order, tmp_path_factory) -> None:
    """Separator, names and their order, encoding, ends of lines and order of rows are of no account."""
    heads = names.replace(" [", "[").split()
    cells = {"t": "{t}", "i": "{a}", "x": "{x}", "y": "{y}"}
    field = [("i" if "id" in h.lower() else "t" if h[0] in "tT" else h.lower().strip("[m]")[-1]) for h in heads]
    head, *lines = table(separator.join(heads), separator.join(cells[of] for of in field)).splitlines()
    order.shuffle(lines)
    path = tmp_path_factory.mktemp("t") / "a.csv"
    path.write_bytes(ending.join([head, *lines]).encode(encoding))
    check(read_recording(path))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (table("t,id,x,y", "{t},{a},{x}e1,{y}e1"), "median speed 10 m/s of pedestrian tracks, expected at most 2.5"),
        (table("t,id,x,y", "{t},{a},{x}e-5,{y}e-5"), "largest speed 1e-05 m/s: for degrees, --columns latitude=y,"),
        (table("t,id,x,y,kind", "{t},{a},{x}e2,{y}e2,car"), "median speed 100 m/s of car tracks, expected at most 70"),
        (table("t,id,x [m],y [m]", "{t},{a},{x}e3,{y}e3"), "median speed 1e+03 m/s of pedestrian tracks, expected at"),
        (table("t,id,x,y,z", "{t},{a},{x},{y},-5"), "z from -5 to -5 m: --columns z=-z if z points down"),
        (table("t,id,x,y,z", "{t},{a},{x},{y},30000"), "z from 30000 to 30000 m: --altitude-unit 0.3048 for feet"),
    ],
)
def test_implausible_numbers_are_warned_of(content: str, message: str, tmp_path: Path) -> None:
    tracks = read_recording(write(tmp_path, "a.csv", content))
    assert any(note.startswith(f"warning: {message}") for note in tracks.notes), tracks.notes


def test_the_summary_names_span_extent_and_speeds(tmp_path: Path) -> None:
    tracks = read_recording(write(tmp_path, "a.csv", PLAIN))
    assert tracks.summary() == "2 agents, 3 s from 0 to 3 s, extent 5 x 1 m, speed median 1 and largest 1 m/s"
    assert read_recorded(tmp_path / "a.csv").notes[0] == f"a.csv: {tracks.summary()}"


def test_degrees_under_other_names(tmp_path: Path) -> None:
    """As named by --columns, about the mean."""
    content = "t,id,x,y\n" + "".join(f"{k},1,11.0,{48 + k * 1e-5}\n" for k in range(9))
    path = write(tmp_path, "a.csv", content)
    track = read_recording(path, columns={"latitude": "y", "longitude": "x"}).agents["1"].trajectory
    np.testing.assert_allclose(np.diff(track.positions, axis=0), [(0.0, 1.112)] * 8, atol=1e-3)


def test_one_vehicle_without_an_id_and_z_down(tmp_path: Path) -> None:
    rows = "".join(f"{100000 * k},{k / 10},0,-5,1,0,0\n" for k in range(31))
    path = write(tmp_path, "a.csv", "timestamp,x,y,z,vx,vy,vz\n" + rows)
    with pytest.raises(InvalidFile, match=r"nearest: csv \(.*\), without id; "):
        read_recording(path)
    track = read_recording(path, columns={"id": None, "z": "-z"}, time_unit="us").agents["1"].trajectory
    np.testing.assert_allclose(track.positions, [(k / 10, 0.0, 5.0) for k in range(31)])
    np.testing.assert_allclose(track.times, TIMES)


def test_rows_at_one_time(tmp_path: Path) -> None:
    """Refused with their number, or the first or the last in the file is kept."""
    path = write(tmp_path, "a.csv", PLAIN + "1.0,1,1.02,0\n")
    with pytest.raises(InvalidFile, match=r"\(1 such row; --keep first or --keep last reads one\)"):
        read_recording(path)
    for keep, x in (("first", 1.0), ("last", 1.02)):
        tracks = read_recording(path, keep=keep)
        assert tracks.agents["1"].trajectory.positions[10, 0] == x
        assert tracks.notes[-1].endswith(f"at the time of another row left out: the {keep} is kept")


def test_zero_padded_ids_are_agents_of_their_own(tmp_path: Path) -> None:
    rows = "".join(f"{k},{a},{k},{a}\n" for k in range(3) for a in ("01", "1", "2.0"))
    tracks = read_recording(write(tmp_path, "a.csv", "t,id,x,y\n" + rows))
    assert set(tracks.agents) == {"01", "1", "2"}


@pytest.mark.parametrize("step", [6, 10])
def test_frames_off_the_common_grid(step: int, tmp_path: Path) -> None:
    """The step is the median of the steps of agents, of ETH and of TrajNet++."""
    rows = [
        (f, a, 0.6 * k, a)
        for a, first in ((1, 0), (2, 0), (3, 407))
        for k, f in enumerate(first + step * j for j in range(3))
    ]
    eth = write(tmp_path, "a.txt", "".join(f"{f} {a} {x} {y}\n" for f, a, x, y in rows))
    lines = ['{"scene": {"id": 0, "p": 1, "s": 0, "e": 20, "fps": 2.5}}']
    lines += [f'{{"track": {{"f": {f}, "p": {a}, "x": {x}, "y": {y}}}}}' for f, a, x, y in rows]
    trajnet = write(tmp_path, "a.ndjson", "\n".join(lines))
    for path in (eth, trajnet):
        for agent in read_recording(path).agents.values():
            np.testing.assert_allclose(np.diff(agent.trajectory.times), 0.4)


def test_published_eth_is_too_fast(tmp_path: Path) -> None:
    """Frames 10 apart of a video with 15 Hz: a warning names the option."""
    path = write(tmp_path, "biwi.txt", "".join(f"{780 + 10 * k} 1 {1.11 * k} 0\n" for k in range(5)))
    (warning,) = read_recording(path).notes
    assert "check --frame-rate" in warning
    assert "biwi_eth.txt" in warning
    assert not read_recording(path, frame_rate=15).notes


def test_a_gap_is_crossed_on_a_line(tmp_path: Path) -> None:
    """The velocity before a gap does not carry an agent past its last place."""
    x, y = 1.3 * np.arange(20) * 0.4, 0.1 * (-1.0) ** np.arange(20)
    times = np.arange(20) * 0.4 + 60.0 * (np.arange(20) >= 10)
    track = Sampled(times, np.stack([x, y], axis=1))
    inside = track.position(np.linspace(times[9], times[10], 1001))
    np.testing.assert_allclose(inside, np.linspace(inside[0], inside[-1], 1001), atol=1e-12)
    even = np.arange(6.0)
    even[3:] += LONG_PIECE - 1.0  # as long as a piece that is smooth may be
    parabola = Sampled(even, np.stack([even**2, even], axis=1))
    np.testing.assert_allclose(parabola.position(6.5), (6.5**2, 6.5))


def test_altitude_per_aircraft(tmp_path: Path) -> None:
    """From the column in which most rows of the aircraft have one."""
    rows = "".join(
        f"{k},{a},48.{k},11,{b},{g}\n" for k in range(3) for a, b, g in (("a1", 3000, 3100), ("b2", 2000, ""))
    )
    tracks = read_recording(
        write(tmp_path, "a.csv", "time,icao24,lat,lon,baroaltitude,geoaltitude\n" + rows), origin=(48.1, 11)
    )
    assert [round(agent.trajectory.positions[1, 2]) for agent in tracks.agents.values()] == [3100, 2000]
    assert "altitude of 1 agent from baroaltitude" in tracks.notes


def test_danish_ships(tmp_path: Path) -> None:
    """A header that begins as a comment, and the day before the month."""
    head = "# Timestamp,Type of mobile,MMSI,Latitude,Longitude,Ship type,Width,Length"
    rows = "".join(f"03/05/2024 10:00:{10 * k:02d},Class A,219,{56 + 1e-4 * k},10.0,Cargo,20,120\n" for k in range(4))
    tracks = read_recording(write(tmp_path, "a.csv", f"{head}\n{rows}"))
    assert tracks.format == "ais"
    assert "time 0 at the first time: 2024-05-03T10:00:00+00:00" in tracks.notes
    np.testing.assert_allclose(np.diff(tracks.agents["219"].trajectory.positions[:, 1]), 11.136, atol=2e-3)


def test_vadere(tmp_path: Path) -> None:
    """Steps have an end; an agent whose steps do not follow each other is read by their beginnings."""
    head = "pedestrianId simTime endTime-PID1 startX-PID1 startY-PID1 endX-PID1 endY-PID1"
    rows = "".join(f"1 {k} {k + 1} {k} 0 {k + 1} 0\n2 {k} {k + 1} {-k} 1 {5 - k} 1\n" for k in range(3))
    tracks = read_recording(write(tmp_path, "a.traj", f"{head}\n{rows}"))
    np.testing.assert_array_equal(tracks.agents["1"].trajectory.positions[:, 0], [0, 1, 2, 3])
    np.testing.assert_array_equal(tracks.agents["2"].trajectory.positions[:, 0], [0, -1, -2])
    assert tracks.notes[0].startswith("2 steps of agent 2 end where the next does not begin")


WALKABLE = "POLYGON ((-3 -3, 9 -3, 9 3, -3 3, -3 -3), (2 -1, 3 -1, 3 1, 2 1, 2 -1))"


def test_walls_of_a_database_stop_a_robot(tmp_path: Path) -> None:
    """The borders of the walkable area are obstacles; those of a database that slalom writes are none."""
    path = tmp_path / "a.sqlite"
    agent = Agent(Sampled([0.0, 0.1, 0.2, 12.0], [(8.0, 2.5)] * 4))
    write_recording(path, RecordedTracks({"1": agent}), "jupedsim", frame_rate=10.0)
    assert not read_recording(path).walls
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("DELETE FROM metadata WHERE key = 'geometry'")
        base.execute("UPDATE geometry SET wkt = ?", (WALKABLE,))
    found = read_recorded(path)
    assert [o.name for o in found.obstacles] == ["agent 1", "wall 0", "wall 1"]
    assert "a.sqlite: 2 walls: obstacles at rest" in found.notes
    run = simulate(crossing(found, (0.0, 0.5), (6.0, 0.5), duration=10.0), METHODS["nao"])
    x, y = run.positions[:, 0].T
    assert not np.any(
        (x > 1.7)
        & (x < 3.3)
        & (np.abs(y) < 1.3 - 1e-6)
        & (np.hypot(np.maximum(np.abs(x - 2.5) - 0.5, 0), np.maximum(np.abs(y) - 1, 0)) < 0.3 - 1e-6)
    )


UNITS = {  # what comments say, and the unit [m] of the positions, None for none
    "positions in centimeters": 0.01,
    "Positions are given in millimetres, time in s": 0.001,
    "The coordinates of the persons are in feet.": 0.3048,
    "Length unit: mm": 0.001,
    "unit = cm": 0.01,
    "x and y (cm), height in m": 0.01,
    "speeds in m/s and positions in cm": 0.01,
    "positions_unit: kilometers": 1000.0,
    "all values in meters": 1.0,
    "heights in cm": None,
    "a room of persons with a height in cm": None,
    "errors of the positions in mm": None,
    "trajectories through a 100-cm door at 2 cm": None,
}


@pytest.mark.parametrize("said", UNITS)
def test_a_unit_in_words(said: str, tmp_path: Path) -> None:
    """It is taken and said, also of other columns of lengths; that of something else is not."""
    unit = UNITS[said]
    path = write(tmp_path, "a.csv", f"# {said}\n" + table("t,id,x,y,radius", "{t},{a},{x},{y},0.1"))
    tracks = read_recording(path)
    np.testing.assert_allclose(tracks.agents["1"].trajectory.positions, WALK["1"] * (unit or 1.0))
    assert tracks.agents["1"].radius == pytest.approx(0.1 * (unit or 1.0))
    assert any("as a comment states" in note for note in tracks.notes) == (unit not in (None, 1.0))


FAST = {
    "plain.csv": table("t,id,x,y", "{t},{a},{x}e2,{y}e2"),
    "car.csv": table("t,id,x,y,kind", "{t},{a},{x}e3,{y}e3,car"),
    "capture.csv": "Frame,Time,Head X,Head Y,Head Z,Foot X,Foot Y,Foot Z\n"
    + "".join(f"{k},{k / 100},{13 * k},{k},1700,{13 * k},{k},80\n" for k in range(31)),
    "resting.csv": table("t,id,x,y", "{t},{a},{x}e2,{y}e2") + "".join(f"{k},rests,0,0\n" for k in range(99)),
    "biwi.txt": "".join(f"{780 + 10 * k} 1 {50 * k} 0\n" for k in range(5)),
}
"""Tables of positions in cm and mm that do not state it."""


@pytest.mark.parametrize("name", FAST)
def test_an_assumed_unit_gives_no_impossible_speed(name: str, tmp_path: Path) -> None:
    path = write(tmp_path, name, FAST[name])
    with pytest.raises(InvalidFile, match=r"^\S+: expected a median speed of \w+ tracks of at most .*--unit"):
        read_recording(path)
    tracks = read_recording(path, unit="m")
    assert any(note.startswith("warning: median speed") for note in tracks.notes)
    read_recording(path, unit="mm")


def test_a_unit_of_any_format(tmp_path: Path) -> None:
    lines = ['{"scene": {"id": 0, "p": 1, "s": 0, "e": 20, "fps": 2.5}}']
    lines += [f'{{"track": {{"f": {k}, "p": 1, "x": {60 * k}, "y": 0}}}}' for k in range(3)]
    path = write(tmp_path, "a.ndjson", "\n".join(lines))
    positions = read_recording(path, unit="cm").agents["1"].trajectory.positions
    np.testing.assert_allclose(positions, [(0, 0), (0.6, 0), (1.2, 0)])


def test_packed_parts_are_read_whole_and_cut_ones_refused(tmp_path: Path) -> None:
    head, lines = PLAIN[: len(PLAIN) // 2], PLAIN[len(PLAIN) // 2 :]
    whole = gzip.compress(head.encode()) + gzip.compress(b"") + gzip.compress(lines.encode())
    check(read_recording(write(tmp_path, "a.csv.gz", whole + bytes(8))))
    border = len(gzip.compress(head.encode()))
    for size in range(40, len(whole)):
        if size not in (border, border + len(gzip.compress(b""))):  # there it is a whole file
            with pytest.raises(InvalidFile, match=r"gzip packed, found "):
                read_recording(write(tmp_path, "a.csv.gz", whole[:size]))
