"""Files in the shapes of other tools: each is read with the right values, with an option, or refused as what it is."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from recording_formats import RECORDED

from slalom import InvalidFile
from slalom.io.formats import read_recording
from slalom.io.recorded import RecordedTracks

FILES = RECORDED.parent / "cases" / "files"
pytestmark = pytest.mark.skipif(not FILES.is_dir(), reason=f"no files at {FILES}: they are not part of slalom")

T = np.arange(31) / 10
WALK = (np.stack([T, 0 * T], axis=1), np.stack([5 - T, 0 * T + 1], axis=1))
Check = Callable[[RecordedTracks], None]


def walk(
    ids: tuple[str, ...] = ("1", "2"), rows: int = 31, at: tuple[float, float] = (0, 0), near: float = 1e-6
) -> Check:
    """The walk of most files; `rows` of 30 lack t = 1 s."""

    def check(tracks: RecordedTracks) -> None:
        assert tuple(tracks.agents) == ids
        for agent, wanted in zip(tracks.agents.values(), WALK, strict=True):
            track = agent.trajectory
            np.testing.assert_allclose(
                track.positions, (wanted if rows == 31 else np.delete(wanted, 10, 0)) + at, atol=near
            )
            assert track.times[-1] - track.times[0] == pytest.approx(3.0, abs=1e-6)

    return check


def speeds(*wanted: float, seconds: float | None = None, near: float = 2e-2) -> Check:
    """The median speed of each agent, and the duration of its track."""

    def check(tracks: RecordedTracks) -> None:
        found = [agent.trajectory for agent in tracks.agents.values()]
        each = [np.linalg.norm(np.diff(t.positions, axis=0), axis=1) / np.diff(t.times) for t in found]
        assert sorted(map(np.median, each)) == pytest.approx(sorted(wanted), rel=near)
        assert seconds is None or [np.ptp(t.times) for t in found] == pytest.approx([seconds] * len(found))

    return check


def noted(*words: str) -> Check:
    """A note has each of the words."""

    def check(tracks: RecordedTracks) -> None:
        assert all(any(word in note for note in tracks.notes) for word in words), tracks.notes

    return check


def that(holds: Callable[[RecordedTracks], object]) -> Check:
    """Something else that holds."""

    def check(tracks: RecordedTracks) -> None:
        assert holds(tracks)

    return check


def at_1_s(x: float) -> Check:
    """Where agent 1 is at 1 s."""
    return that(lambda tracks: tracks.agents["1"].trajectory.position(1.0)[0] == x)


def inside_the_gap(tracks: RecordedTracks) -> bool:
    """Whether the agent does not leave the way within its gap."""
    track = tracks.agents["1"].trajectory
    k = int(np.argmax(np.diff(track.times)))
    x, y = track.position(np.linspace(track.times[k], track.times[k + 1], 999)).T
    return 0.0 <= x.min() <= x.max() <= 9.9 and abs(y).max() <= 0.2


PX = {"unit": 0.04}
ALONE = {"id": None}
AS_ROWS = ["csv_plain.csv", "csv_bom_crlf.csv", "csv_pandas_index.csv", "csv_trailing_comma.csv", "csv_reversed.csv"]
AS_ROWS += ["csv_epoch_s.csv", "csv_iso.csv", "csv_semicolon.csv", "csv_tab.csv", "csv_upper.csv", "csv_time_name.csv"]
AS_ROWS += ["csv_timestamp_track.csv", "csv_units_in_header.csv", "csv_quoted_units_row.csv", "csv_comment_top.csv"]
AS_ROWS += ["csv_dup_identical.csv", "csv_plain.csv.gz", "csv_kinds.csv", "ped_fps_word.txt", "ped_framerate_words.txt"]
AS_ROWS += ["ped_framerate_of_camera.txt", "ped_height_in_cm.txt", "ped_cm_bracket.txt"]
UUIDS = tuple(f"3f2b8c1e-0000-4000-8000-00000000000{k}" for k in (1, 2))
TENS = ("10", "20")

READ: list[tuple[str, dict[str, Any], tuple[Check, ...]]] = [
    *((name, {}, (walk(),)) for name in AS_ROWS),
    ("csv_uuid.csv", {}, (walk(UUIDS),)),
    ("csv_epoch_ms.csv", {}, (walk(), noted("times in ms since 1970"))),
    ("csv_frame.csv", {"frame_rate": 10}, (walk(),)),
    ("csv_latin1.csv", {}, (walk(), noted("Latin-1"))),
    ("csv_latin1.csv", {"encoding": "latin-1"}, (walk(),)),
    ("csv_rows_trailing_comma.csv", {}, (walk(), noted("an empty last cell"))),
    ("csv_blank_cells.csv", {}, (walk(rows=30), noted("2 rows without a position left out"))),
    ("csv_nan.csv", {}, (walk(rows=30), noted("2 rows without a position left out"))),
    ("csv_dup_conflict.csv", {"keep": "first"}, (at_1_s(1.0),)),
    ("csv_dup_conflict.csv", {"keep": "last"}, (at_1_s(1.02),)),
    ("csv_gap.csv", {}, (speeds(1, 1, seconds=3), noted("the longest 1.5 s"))),
    ("gap_60s_smooth.csv", {}, (that(inside_the_gap),)),
    ("csv_zero_padded_ids.csv", {}, (walk(("01", "1")),)),
    ("csv_mm.csv", {"unit": "mm"}, (walk(),)),
    ("csv_px.csv", PX, (walk(at=(12, 16), near=0.03),)),
    ("csv_latlon.csv", {}, (noted("for degrees, --columns latitude=y,longitude=x"),)),
    ("csv_latlon.csv", {"columns": {"latitude": "y", "longitude": "x"}}, (speeds(1, 1, near=0.1),)),
    ("ped_noheader_4.txt", {"frame_rate": 10}, (walk(),)),
    ("ped_noheader_4_step10.txt", {"frame_rate": 10}, (walk(TENS),)),
    ("ped_noheader_5.txt", {"frame_rate": 10}, (walk(),)),
    ("ped_noheader_4.txt", {"frame_rate": 10, "columns": {"id": "1", "frame": "2"}}, (walk(),)),
    ("ped_header_nohash.txt", {"frame_rate": 10}, (walk(),)),
    ("eth_irregular_frames.txt", {"frame_rate": 15}, (speeds(1.5, 1.5, 1.5, seconds=0.8),)),
    ("biwi_like_10_of_15fps.txt", {}, (noted("check --frame-rate", "biwi_eth.txt"),)),
    ("biwi_like_10_of_15fps.txt", {"frame_rate": 15}, (speeds(1.665, 1.665),)),
    *((f"trajnetpp_{name}.ndjson", {}, (speeds(1, 1, 1, 1, seconds=8),)) for name in ("step1", "step10", "odd_offset")),
    (
        "jps_v1.sqlite",
        {},
        (walk(), that(lambda r: [w.tolist() for w in r.walls] == [[[-1, -1], [6, -1], [6, 2], [-1, 2], [-1, -1]]])),
    ),
    (
        "vadere.traj",
        {},
        (that(lambda r: np.ptp(r.agents["1"].trajectory.times) == pytest.approx(3.1)), noted("agent 2")),
    ),
    ("mot_gt.txt", {**PX, "frame_rate": 10}, (walk(at=(12.4, 17), near=0.03), noted("centre of the box"))),
    ("sdd_annotations.txt", PX, (walk(at=(12, 16), near=0.03),)),
    ("kitti_tracking.txt", {}, (speeds(5, 5), noted("camera", "10 Hz assumed"))),
    ("ucy.vsp", PX, (speeds(0.5, 0.5, near=0.1),)),
    ("01_tracks.csv", {}, (speeds(2.5, 2.5, seconds=1.2),)),
    ("00_tracks.csv", {"frame_rate": 25}, (speeds(2.5, 2.5, seconds=1.2),)),
    ("02_tracks.csv", {"frame_rate": 25}, (speeds(2.5, 2.5, seconds=1.2),)),
    ("highd_tracks.csv", {}, (speeds(1, 1),)),
    ("sind_ped.csv", {}, (walk(("P1", "P2")),)),
    *(
        (name, {}, (speeds(9.144, 9.144), that(lambda r: r.agents["1"].length == pytest.approx(4.36, abs=0.01))))
        for name in ("ngsim.csv", "ngsim_spaces.txt")
    ),
    ("sumo_fcd.xml", {}, (speeds(1, 5), noted("front bumper"))),
    (
        "truck_trailer_2020a.xml",
        {},
        (that(lambda r: [round(a.radius or 0, 1) for a in r.agents.values()] == [15.6, 20.1]), noted("id 3", "id 4")),
    ),
    ("uncertain_2018b.xml", {}, (that(lambda r: list(r.agents) == ["1", "2"]), noted("of obstacle 1 uncertain"))),
    ("ais_marinecadastre.csv", {}, (speeds(1.108, 1.108), that(lambda r: r.agents["100000001"].length == 120))),
    ("ais_pandas_float_ids.csv", {}, (that(lambda r: "100000001" in r.agents),)),
    ("ais_marinecadastre_conflict.csv", {"keep": "first"}, (speeds(1.108, 1.108),)),
    ("ais_dma.csv", {}, (speeds(1.11, 1.11),)),
    ("ais_aisstream_space_tz.csv", {}, (speeds(2.22, 2.22),)),
    (
        "opensky_states.csv",
        {},
        (
            that(lambda r: r.agents["abc002"].trajectory.positions[0, 2] == pytest.approx(3000, abs=2)),
            noted("baroaltitude"),
        ),
    ),
    (
        "traffic_export_feet.csv",
        {},
        (that(lambda r: r.agents["abc001"].trajectory.positions[0, 2] == pytest.approx(9144, abs=2)), noted("in feet")),
    ),
    (
        "px4_log.csv",
        {"columns": {**ALONE, "z": "-z"}, "time_unit": "us"},
        (speeds(1), that(lambda r: r.agents["1"].trajectory.positions[0, 2] == 5)),
    ),
    ("px4_log.csv", {"columns": ALONE, "time_unit": "us"}, (noted("--columns z=-z"),)),
]

REFUSED = {
    "csv_frame.csv": "give --frame-rate",
    "csv_plain.zip": "unpack it",
    **dict.fromkeys(("csv_mm.csv", "csv_px.csv"), "median speed of pedestrian tracks of at most 13 m/s, .*--unit"),
    "csv_dup_conflict.csv": "1 such row; --keep first or --keep last",
    "csv_inf_radius.csv": r":2: radius: expected 0 or more, found -1",
    **{f"ped_{name}.txt": "frame.rate" for name in ("noheader_4", "noheader_4_step10", "noheader_5", "header_nohash")},
    **dict.fromkeys(("mot_gt.txt", "sdd_annotations.txt", "ucy.vsp"), "expected a unit"),
    **{f"01_{name}.csv": r"name .*01_tracks\.csv" for name in ("recordingMeta", "tracksMeta")},
    "highd_recordingMeta.csv": r"name .*highd_tracks\.csv",
    **{f"0{k}_tracks.csv": "the file does not exist" for k in (0, 2)},
    "nuscenes_sample_annotation.json": r"found no sample\.json, instance\.json, category\.json",
    "openscenario.xosc": "OpenSCENARIO",
    "opendrive.xodr": "OpenDRIVE",
    "osm.xml": "OpenStreetMap",
    "via.json": "VIA",
    "ais_marinecadastre_conflict.csv": "--keep first",
    "ais.nmea": "checksums, each of one position",
    "opensky_api.json": "one time of aircraft",
    "bluesky.scn": "BlueSky",
    "px4_log.csv": "without id;",
    "cadrl.csv": "starts and goals",
    **dict.fromkeys(("movingai.map", "nav2_map.yaml", "walls.wkt", "walls.geojson", "walls.dxf"), "walls, not"),
    "movingai.map.scen": "starts and goals, not a recording",
    "nav2_map.pgm": "yaml file",
}
"""What the message of a file says that is refused without an option."""


@pytest.mark.parametrize(("name", "given", "checks"), READ)
def test_files_are_read(name: str, given: dict[str, Any], checks: tuple[Check, ...]) -> None:
    tracks = read_recording(FILES / name, **given)
    for check in checks:
        check(tracks)


@pytest.mark.parametrize("name", REFUSED)
def test_files_are_refused(name: str) -> None:
    with pytest.raises(InvalidFile, match=REFUSED[name]):
        read_recording(FILES / name)


def test_every_file_is_named() -> None:
    others = {"README.md", "make_bags.py"}
    assert {path.name for path in FILES.iterdir()} - others == {name for name, *_ in READ} | set(REFUSED)
