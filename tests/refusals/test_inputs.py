"""What does not fit is refused, with a message that says what was expected and what was found.

Every `raise` of the library is reached by a case below; `test_every_raise_is_reached` reads the sources to find one
that is not.
"""

import ast
import dataclasses
import json
import os
import pickle
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
import pytest
import shapely
from cyclopts import CoercionError
from hdf5_files import OF_LIBRARY, OF_RECORDING, changed, read_here, read_with, write_run
from matplotlib.figure import Figure
from nav2_maps import OF_GRIDS, OF_MAPS, REFUSED_IMAGES, image_here, read_image
from pydantic_core import PydanticKnownError
from recording_formats import WALK, write_hdf5
from refusals import REFUSALS, SEVERAL, WITHOUT_EXTRAS, scripted
from ros_messages import BAGS
from tasks_in_scenes import REFUSED_TASKS, other_robot
from wall_files import OF_WALL_FILES, OF_WALL_UNITS, REFUSED_WALLS, read_wall_here, with_fewer_points

import slalom
from slalom import (
    METHODS,
    AccelerateThenStop,
    AccelerateThenTurn,
    Acceleration,
    AccelerationSequence,
    Admissible,
    Affine,
    Aim,
    Arrive,
    AvoidingCrowd,
    Ball,
    BoundedError,
    Box,
    Capsule,
    Circular,
    ConstantVelocity,
    ControlObstacle,
    ConvexPolygon,
    Disc,
    FollowAcceleration,
    FromPast,
    Goal,
    HalfSpace,
    HeadingCone,
    Headings,
    InvalidFile,
    InvalidInput,
    Jerk,
    Known,
    LeastSpeed,
    Limits,
    LookAhead,
    Manoeuvre,
    Method,
    MissingExtra,
    Mix,
    Navigator,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    OutsideSpan,
    PathGoal,
    Polygon,
    Polyline,
    Present,
    Rectangle,
    Sampled,
    Shape,
    SlalomError,
    State,
    Stationary,
    Tracks,
    Union,
    Velocity,
    admissible_ball,
    cli,
    control_obstacle,
    peers,
    preferred_control,
    select,
    select_many,
    view,
)
from slalom.base import checks
from slalom.base.errors import require
from slalom.cli import console
from slalom.computer import import_entries
from slalom.io import walls_child
from slalom.io.formats import format_of, read_recording, write_recording
from slalom.io.hdf5_child import Refused, read
from slalom.io.pedestrians import read_cases, rows_of_queries
from slalom.io.recorded import Agent, RecordedTracks
from slalom.kernels import entries
from slalom.model.trajectory import Composite, Function, PiecewisePolynomial
from slalom.model.trajectory.protocol import direction_path
from slalom.peers import PEERS, contender
from slalom.sim import (
    Recording,
    Robot,
    Scenario,
    compare,
    compare_all,
    gallery,
    load,
    read_scenario,
    read_study,
    simulate,
)
from slalom.sim.files.decision_file import read_decision
from slalom.sim.files.parts import OfAnyKind, model_of_part
from slalom.sim.files.recorded_traffic import read_recorded
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.files.scenario_yaml import read_scenarios
from slalom.sim.files.schema import FlowSpec, GoalSpec, HeadingOfContent, RecordingSpec, Shaped, WorldSpec, known_method
from slalom.sim.gallery import build
from slalom.sim.measure.export_tracks import write_agents
from slalom.sim.measure.metrics import path_length
from slalom.sim.measure.tidy_table import _imported, write_table
from slalom.sim.sweep.case import SOURCES as SOURCES_NOW, Case as Run, Failure, drawn, run_case
from slalom.sim.sweep.store import Shard, Store, _Former, _refuse_another
from slalom.sim.sweep.study import grid, named
from slalom.view.control_space import admissible_region
from slalom.view.figure import axis_of

SOURCES = Path(slalom.__file__).parent
NAN, INF = float("nan"), float("inf")
FLAT, SPACE = State((0, 0), (1, 0)), State((0, 0, 0), (1, 0, 0))
ROCK, BALLOON = Obstacle(Disc(1), Stationary((9, 0))), Obstacle(Ball(1), Stationary((9, 0, 0)))
GOAL = Goal(Stationary((20, 0)))
LIMITS = Limits(2.0, 1.0)
DISC = Disc(1)
STILL = Stationary((0, 0))
BUS = Obstacle(Rectangle(4, 2), ConstantVelocity((9, 0), (1, 0)), "bus")
NEVER_BOUNDED = Admissible(np.empty((0, 2)), np.empty(0), np.array([[1.0, 0.0]]), np.array([1.0]))


def blocked(state: State = FLAT, obstacles=(ROCK,), robot: Shape = DISC, **settings) -> ControlObstacle:
    """A control obstacle over five seconds."""
    return control_obstacle(Acceleration(), state, obstacles, robot, horizon=5.0, **settings)


def navigator(method: str = "nao", **settings) -> Navigator:
    """A navigator in the plane."""
    return Navigator(METHODS[method], **{"robot": Disc(1), "limits": LIMITS, **settings})


def decide(state: State = FLAT, obstacles=(ROCK,), goal: Goal = GOAL, **settings):
    """A first decision."""
    return navigator(**settings).decide(state, obstacles, goal)


class Curved(Jerk):
    """A motion that is not linear in the velocity: air brakes it."""

    def position(self, state, t):
        of = super().position(state, t)
        braked = 0.01 * np.linalg.norm(state.velocity) * np.multiply.outer(t, state.velocity)
        return Affine(of.drift - braked, of.gain)


def curved() -> Method:
    """NAO with that motion."""
    return replace(METHODS["nao"], responses=lambda limits, period, holds: (Curved(),))


PLACES = np.array([(0.0, 0.0), (5.0, 0.0)])


def pair(**settings) -> slalom.Fleet:
    """A fleet of two discs."""
    return slalom.Fleet(METHODS["nao"], Disc(0.5), LIMITS, robots=2, **settings)


def robot(**settings) -> Robot:
    """A disc with settings of its own."""
    return Robot(Disc(1), LIMITS, FLAT, GOAL, **settings)


METHOD_OF_JERKS = replace(METHODS["nao"], responses=lambda limits, period, holds: (Jerk(),))


class Rootlike:
    """A bound of the acceleration that grows with the root of the speed."""

    of, braking = "acceleration", 1.0

    def half_spaces(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Along the first axis."""
        return np.eye(state.dimension)[:1], np.array([1.0 + np.linalg.norm(state.velocity) ** 0.5])


def look_ahead(**settings) -> LookAhead:
    """One that looks ahead in the plane."""
    return LookAhead(navigator("nao_ahead", **settings))


def taken(folder: Path, kernel: str = "a.entry") -> object:
    """Compiled kernels that are imported where no folder can be written."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(entries, "fitting", lambda _: [folder / kernel] if kernel else [])
        patch.setattr(entries, "OWN", None)
        return import_entries(folder)


def in_turn(*later: tuple[float, tuple[float, ...]]) -> AccelerationSequence:
    """An acceleration of half a second, and later ones."""
    return AccelerationSequence(0.5, later)


def scenario(**settings) -> Scenario:
    """A scenario in the plane."""
    return Scenario("test", (Robot(Disc(1), LIMITS, FLAT, GOAL),), (ROCK,), **settings)


def backwards(fleet: slalom.Fleet) -> object:
    """A step before the last one."""
    fleet.step(1.0, PLACES, PLACES, PLACES)
    return fleet.step(0.0, PLACES, PLACES, PLACES)


def route(speeds=None, **settings) -> PathGoal:
    """A path of one segment."""
    return PathGoal([(0, 0), (9, 0)], speeds, **settings)


HERE = Robot(Disc(1), LIMITS, FLAT, GOAL)


def late(appears: float) -> Robot:
    """A robot that appears at a time [s]."""
    return replace(HERE, appears=appears)


ROUTE = PathGoal([(0, 0), (9, 0)])


def decision(obstacles=(), **settings) -> object:
    """A decision of a robot that may be among obstacles or robots."""
    return navigator().decide(FLAT, obstacles, GOAL, **settings)


def seen(**changes) -> Tracks:
    """One disc at rest."""
    return Tracks(**{"positions": [(4.0, 0.0)], "velocities": [(0.0, 0.0)], "radii": 0.3, **changes})


def many(preferred, states, robot):
    """Choices among no obstacles."""
    return select_many(preferred, states, Velocity(), Limits(2.0, 2.0), ObstacleWindow([], 0.0, 3.0), robot)


class Case(NamedTuple):
    """A call that must be refused with `error` and a message that matches."""

    error: type[Exception]
    message: str
    call: Callable[[Path], object]

    def __str__(self) -> str:
        return self.message


def written(name: str, content: str | bytes) -> Callable[[Path], Path]:
    """A function that writes a file into a folder."""

    def write(folder: Path) -> Path:
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def reading(reader: Callable, name: str, content: str | bytes) -> Callable[[Path], object]:
    """A call that reads a file of this content."""
    write = written(name, content)
    return lambda folder: reader(write(folder))


def yaml(content: str) -> Callable[[Path], object]:
    """A call that reads a scenario file of this content."""
    return reading(read_scenario, "a.yaml", content)


def aliases(levels: int) -> str:
    """A short text that stands for 9 to the power of `levels` values."""
    first = "l0: &l0 [x,x,x,x,x,x,x,x,x]"
    return "\n".join([first, *(f"l{k}: &l{k} [{','.join([f'*l{k - 1}'] * 9)}]" for k in range(1, levels))])


@dataclasses.dataclass
class SimpleSpan:
    """A part with a field that no file can hold."""

    path: Path


A_RUN = Run("empty", {}, "nao", 0, {"seed": 0})


CADRL = "case,agent,x,y,goal_x,goal_y,pref_speed,radius\n0,0,-3,0,3,0,1,0.5\n0,1,3,0.2,-3,0,1,0.5\n"
"""A file of one test case."""
OTHER_FILES = {"files": ["none"]}
"""What a sweep began with."""


def edited_scene(folder: Path) -> object:
    """A run of a file that is not what it was when the run was asked for."""
    path = written("a.yaml", MINIMAL.replace("GOAL", "position: [9, 0]"))(folder)
    return run_case(Run(str(path), {}, "nao", 0, {"sources": SOURCES_NOW, "scenario": OTHER_FILES}))


def command(*tokens: str) -> Callable[[Path], object]:
    """A call of the command line that lets errors pass; {} stands for the folder."""
    return lambda folder: cli.app([t.format(folder) for t in tokens], exit_on_error=False, print_error=False)


def on_a_full_disk(folder: Path) -> None:
    """A line of output that does not fit."""
    with (
        (folder / "out").open("w") as out,
        patch("sys.stdout", out),
        patch.object(out, "write", side_effect=OSError(28, "")),
    ):
        console.print_line("1")


def without_permission(folder: Path) -> None:
    """A run whose file must not be written."""
    with patch("os.access", return_value=False):
        command("run", "empty", "--out", "{}/a.h5")(folder)


def moved() -> Manoeuvre:
    """A manoeuvre from rest."""
    return Manoeuvre(Acceleration(), State((0, 0), (0, 0)), np.array([1.0, 0.0]), 0.0)


def on_recording(*tokens: str) -> Callable[[Path], object]:
    """The same with a recording a.csv in the folder."""
    write, call = written("a.csv", "t,id,x,y\n2,1,0,0\n3,1,1,0\n"), command(*tokens)
    return lambda folder: (write(folder), call(folder))


CROSS = ("run", "{}/a.csv", "--start", "0,0", "--goal", "9,9")


def behaviour(kind: str, **settings) -> object:
    """A team of one robot in navground."""
    team = peers.Team(np.array([1.0]), np.array([2.0]), np.array([2.0]), 0.1)
    return peers.methods.Behaviours(team, kind, time_horizon=10.0, **settings)


def bounded() -> Scenario:
    """A robot with a limit that has a direction."""
    return Scenario("test", (Robot(DISC, Limits(2, 1, bounds=(Box((1, 1)),)), FLAT, GOAL),))


def foreign_hdf5(folder: Path) -> object:
    """A valid HDF5 file of another kind is not a recording."""
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.attrs["format"] = "something else"
    return Recording.load(folder / "a.h5")


def empty_recording(folder: Path) -> object:
    """A recording in which everything is missing."""
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.attrs["format"] = "slalom recording 1"
    return Recording.load(folder / "a.h5")


def silent_database(folder: Path) -> object:
    """A JuPedSim database that does not say its frame rate."""
    import sqlite3
    from contextlib import closing

    with closing(sqlite3.connect(folder / "silent.sqlite")) as base, base:
        base.execute("CREATE TABLE metadata (key, value)")
        base.execute("INSERT INTO metadata VALUES ('version', 2)")
        base.execute("CREATE TABLE trajectory_data (frame, id, pos_x, pos_y)")
    return read_recording(folder / "silent.sqlite")


def endless_database(folder: Path) -> object:
    """A JuPedSim database of a few kilobytes whose table has rows without end."""
    import sqlite3
    from contextlib import closing

    with closing(sqlite3.connect(folder / "endless.sqlite")) as base, base:
        base.execute("CREATE TABLE metadata (key, value)")
        base.execute(
            "CREATE VIEW trajectory_data AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
            "SELECT i AS rowid, 1 AS id, i AS frame, 1.0 AS pos_x, 1.0 AS pos_y FROM n"
        )
        base.execute("CREATE VIEW more AS SELECT * FROM trajectory_data")
    return rows_of_queries(folder / "endless.sqlite", "database", ("SELECT i FROM (SELECT rowid AS i FROM more)",))


def forbidden_file(folder: Path) -> object:
    """A file that may not be read; the user of the tests may read all."""
    (folder / "a.csv").write_text(ROW)
    with patch.object(Path, "open", side_effect=PermissionError("Permission denied")):
        return read_recording(folder / "a.csv")


def long_table(folder: Path) -> object:
    """A table of more rows than are read."""
    (folder / "a.csv").write_text(ROW)
    with patch("slalom.io.table.MAX_ROWS", 1):
        return read_recording(folder / "a.csv")


def long_scenario(folder: Path) -> object:
    """Steps of SUMO in one line, of more rows than are read."""
    steps = "".join(f'<timestep time="{k}"><vehicle id="1" x="{k}" y="0"/></timestep>' for k in range(3))
    (folder / "a.xml").write_text(f"<fcd-export>{steps}</fcd-export>")
    with patch("slalom.io.table.MAX_ROWS", 1):
        return read_recording(folder / "a.xml")


def without_recordings(_: Path) -> object:
    """The simulator where h5py is not installed."""
    with patch.dict("sys.modules", {"h5py": None}):
        return require("sim", "here")


def without_pyrvo(_: Path) -> object:
    """The people of CrowdNav where the package that moves them is not installed."""
    with patch.dict("sys.modules", {"pyrvo": None}):
        return build("crowdnav")


def paths_of(times, positions) -> object:
    """A drawing of a run."""
    return view.paths(times, positions, [ROCK], robot=Disc(1), goal=GOAL)


def workspace(**settings) -> object:
    """A drawing of a moment."""
    ax = Figure().add_subplot()
    return view.workspace(ax, traffic=ObstacleWindow([ROCK], 0, 5), state=FLAT, robot=Disc(1), **settings)


def control_space(admissible=None, resolution: int = 5) -> object:
    """A drawing of the controls."""
    ax = Figure().add_subplot()
    admissible = admissible or admissible_ball((0, 0), 1)
    return view.control_space(ax, blocked=blocked(), admissible=admissible, resolution=resolution)


MINIMAL = """\
robot: {position: [0, 0], radius: 1, max_speed: 2, max_acceleration: 1, goal: {GOAL}}
"""
ROW = "t,id,x,y\n0,1,0,0\n1,1,1,0\n"
SCENARIO = '<commonRoad commonRoadVersion="2020a" timeStepSize="{}">'

RECORDINGS: dict[str, tuple[str, str | bytes, dict[str, str]]] = {
    # What, the file, its content, settings.
    r"a\.csv:3: x: expected a number, found 'left'": ("a.csv", ROW.replace("1,1,1", "1,1,left"), {}),
    r"a\.csv: expected an agent with two rows or more, found none": ("a.csv", "t,id,x,y\n0,1,0,0\n", {}),
    r"a\.csv: expected rows, found none": ("a.csv", "t,id,x,y\n", {}),
    r"a\.csv: expected a readable text file, found ": ("a.csv", b"\xff\xfea", {"format": "csv"}),
    r"a\.csv: expected a readable text file, found .*0xff": ("a.csv", b"\xff\0" + ROW.encode(), {"format": "csv"}),
    r"a\.csv: expected a file that gzip packed, found ": ("a.csv", b"\x1f\x8b" + ROW.encode(), {"format": "csv"}),
    r"a\.csv: expected one unit of positions in the comments, found cm, mm": (
        "a.csv",
        b"# positions in cm\n# coordinates in millimetres\n" + ROW.encode(),
        {},
    ),
    r"a\.csv: expected a median speed of pedestrian tracks of at most 13 m/s, found 1e\+03 m/s: .*; --unit m reads": (
        "a.csv",
        b"t,id,x,y\n0,1,0,0\n1,1,1000,0\n",
        {},
    ),
    r"a\.csv:2: expected comma-separated cells, found ": ("a.csv", 't,id,x,y\n"0"1,1,0,0\n', {}),
    r"a\.csv:1: expected columns of id, x, y, or their names in columns \(id= for one agent\), found 'time'": (
        "a.csv",
        "time\n0\n",
        {"format": "csv"},
    ),
    r"a\.csv:1: columns: expected x as a column of 't,id,x,y', found 'east'": (
        "a.csv",
        ROW,
        {"columns": {"x": "east"}},
    ),
    r"a\.csv:1: expected each column once, found x twice": ("a.csv", "t,id,x,y,x\n0,1,0,0,0\n", {}),
    r"a\.csv: expected a unit, as in unit=0\.04 for 0\.04 m in a pixel, found px": (
        "a.csv",
        ROW.replace("x", "x [px]"),
        {},
    ),
    r"a\.csv: case_id: expected this column for case 3, found none": ("a.csv", ROW, {"case": 3}),
    r"expected columns id=1 and frame=2, or id=2 and frame=1, .*; found that agents move alike in both orders": (
        "a.txt",
        "1 1 0 0\n1 2 1 0\n2 1 0 1\n2 2 1 1\n",
        {"frame_rate": 1},
    ),
    r"a\.csv:4: expected one position of agent 1 at 1 s, .* \(1 such row; --keep first or --keep last reads one\)": (
        "a.csv",
        ROW + "1,1,2,0\n",
        {},
    ),
    r"a\.txt: expected one frame rate in the comments, found 10, 25": ("a.txt", "# fps: 10\n# fps: 25\n1 0 0 0\n", {}),
    r"a\.txt:1: expected columns of y, .*, found '3 cells without a header'": (
        "a.txt",
        "0 1 2\n",
        {"format": "eth_ucy"},
    ),
    r"a\.txt: expected frames 10 or 6 apart.* found 3 apart": ("a.txt", "0 1 0 0\n3 1 1 0\n", {}),
    r"a\.vsp: expected a unit, as in unit=0\.04 .*, found positions in pixels": (
        "a.vsp",
        "1 - the number of splines\n",
        {},
    ),
    r"a\.vsp:2: expected a number of control points, found 'two'": (
        "a.vsp",
        "1 - the number of splines\ntwo\n",
        {"unit": 1},
    ),
    r"a\.zip: expected a recording, found a zip archive: unpack it": ("a.zip", b"PK\x03\x04", {}),
    r"b_tracksMeta\.csv: .*, found a file about a recording: name b_tracks\.csv": (
        "b_tracksMeta.csv",
        "id,class\n",
        {},
    ),
    r"a\.parquet: expected a Parquet file, found ": ("a.parquet", "PAR1", {}),
    r"expected the given unit cm, found m": ("a.txt", "# x/m\n1 0 0 0\n", {"unit": "cm"}),
    r"a\.txt: expected a frame rate above 0, in the file or given, found none": ("a.txt", "#\n1 0 0 0\n", {}),
    r"a\.sqlite: expected a JuPedSim database, found ": ("a.sqlite", "SQLite format 3", {}),
    r"a_recordingMeta\.csv: expected one frameRate above 0, found none": (
        "a_tracks.csv",
        "trackId,frame,xCenter,yCenter\n1,0,0,0\n",
        {},
    ),
    r"a\.csv: case_id: expected one case, or the case to read, found 2 from 1 to 2": (
        "a.csv",
        "case_id,track_id,timestamp_ms,x,y\n1,1,0,0,0\n2,1,0,0,0\n",
        {},
    ),
    r"a\.xml: expected a commonRoad of version 2018b or 2020a, found a road": (
        "a.xml",
        "<road/>",
        {"format": "commonroad"},
    ),
    r"a\.xml: expected an fcd-export, found road": ("a.xml", "<road/>", {"format": "sumo"}),
    r"a\.xml: expected a file of a known format .*found '<road/>'": ("a.xml", "<road/>", {}),
    r"a\.xml:1: timeStepSize: expected a number above 0, found '0'": (
        "a.xml",
        SCENARIO.format(0) + "</commonRoad>",
        {},
    ),
    r"a\.xml:1: expected XML, found ": ("a.xml", SCENARIO.format(0.1), {}),
    r"a\.csv: expected rows with a position, found none": ("a.csv", "time,mmsi,lat,lon\n0,1,,\n", {}),
    r"a\.csv: expected a file .* nearest: csv .*, without t or frame; ais .*, without t or frame": (
        "a.csv",
        "mmsi,lat,lon\n1,0,0\n",
        {},
    ),
    r"a\.csv: expected a file of a known format.*found 'time'": ("a.csv", "time\n0\n", {}),
}
"""Calls of `read_recording` that are refused."""


def nuscenes(**tables: str) -> Callable[[Path], object]:
    """A call that reads tables of nuScenes, good ones but those given."""
    content = {
        "sample": '[{"token": "s", "timestamp": 0}]',
        "instance": '[{"token": "i", "category_token": "c"}]',
        "category": '[{"token": "c", "name": "vehicle.car"}]',
        "sample_annotation": '[{"sample_token": "s", "instance_token": "i"}]',
    }

    def call(folder: Path) -> object:
        for name, text in {**content, **tables}.items():
            (folder / f"{name}.json").write_text(text)
        return read_recording(folder / "sample_annotation.json", "nuscenes")

    return call


def packed_too_much(folder: Path) -> object:
    """A packed text that is larger than what is read."""
    import gzip

    (folder / "a.csv").write_bytes(gzip.compress(ROW.encode() * 100))
    with patch("slalom.io.table.MAX_FILE_SIZE", 1000):
        return read_recording(folder / "a.csv", "csv")


def database_of_walls(wkt: str | None) -> Callable[[Path], object]:
    """A call that reads a JuPedSim database with this geometry."""

    def call(folder: Path) -> object:
        import sqlite3
        from contextlib import closing

        path = folder / "walls.sqlite"
        path.unlink(missing_ok=True)
        with closing(sqlite3.connect(path)) as base, base:
            base.execute("CREATE TABLE metadata (key, value)")
            base.execute("INSERT INTO metadata VALUES ('fps', 10)")
            base.execute("CREATE TABLE trajectory_data (frame, id, pos_x, pos_y)")
            base.execute("INSERT INTO trajectory_data VALUES (0, 1, 0, 0), (1, 1, 1, 0)")
            base.execute("CREATE TABLE geometry (wkt)")
            base.execute("INSERT INTO geometry VALUES (?)", (wkt,))
        return read_recording(path)

    return call


def archive(**content: object) -> Callable[[Path], object]:
    """A call that reads HDF5 of the pedestrian dynamics data archive with this content."""

    def call(folder: Path) -> object:
        write_hdf5(folder / "archive.h5", WALK, **content)
        return read_recording(folder / "archive.h5")

    return call


def square_archive(folder: Path) -> object:
    """Records of the archive in rows and columns are no list."""
    import h5py

    write_hdf5(folder / "square.h5", WALK)
    with h5py.File(folder / "square.h5", "r+") as file:
        records = file["trajectory"][:16].reshape(4, 4)
        del file["trajectory"]
        file["trajectory"] = records
        file["trajectory"].attrs["fps"] = 25.0
    return read_recording(folder / "square.h5")


def run_as_recording(folder: Path) -> object:
    """A run of slalom is no recording."""
    write_run(folder / "run.h5")
    return read_recording(folder / "run.h5")


def write_tracks(format: str, label: str = "1", times=(0.0, 0.1), positions=((0, 0), (1, 0)), **settings) -> Callable:
    """A call that writes one agent to a file."""
    tracks = RecordedTracks({label: Agent(Sampled(times, positions))})
    return lambda folder: write_recording(folder / "a.out", tracks, format, **settings)


def dumped(change: Callable[[dict], object] = lambda _: None) -> Callable[[Path], Path]:
    """A function that writes the file of a decision, changed by `change`."""

    def write(folder: Path) -> Path:
        path = folder / "d.json"
        first = decision([ROCK])
        decision([ROCK], previous=first, now=0.1).dump(path)
        content = json.loads(path.read_text())
        change(content)
        path.write_text(json.dumps(content))
        return path

    return write


def undumped(change: Callable[[dict], object]) -> Callable[[Path], object]:
    """A call that reads the changed file of a decision."""
    return lambda folder: read_decision(dumped(change)(folder))


class OneCost(slalom.Arrive):
    """An objective in Python that returns one cost for all candidates."""

    def costs(self, candidates: slalom.Candidates, situation: slalom.Situation) -> np.ndarray:
        return np.ones(1)


class Aimless(Arrive):
    """An objective in Python without aims."""

    def aims(self, situation):
        return ()


CURVE = Obstacle(Disc(1), Function(lambda t: (9.0, t), 1.0, 0.0, 0.0, 99.0))
DECISIONS: dict[str, Callable[[Path], object]] = {
    r"holds: expected durations, found 3": lambda _: navigator(holds=3),
    r"costs: expected \d+ numbers, found \[1\]": lambda _: navigator(objective=OneCost()).decide(
        *(FLAT, (), slalom.Goal(slalom.Stationary((9.0, 0.0))))
    ),
    r"aims: expected one with weight and gain above 0, found none": lambda _: navigator(objective=Aimless()).decide(
        FLAT, [], GOAL
    ),
    r"inputs\.obstacles\.0\.trajectory: expected a part that files can hold, found Function": lambda folder: decision(
        [CURVE]
    ).dump(folder / "d.json"),
    r"tracks\.ids: expected different ones, by which tracks are told apart; found a twice": lambda _: (
        slalom.Calibration().observe(Tracks(np.eye(2), np.eye(2), 0.3, ids=("a", "a")))
    ),
    r"decision: expected one that a navigator made, found one without inputs": lambda folder: replace(
        decision(), inputs=None
    ).dump(folder / "d.json"),
    r"method: expected responses of one of the table of methods, found others of 'nao'": lambda folder: (
        Navigator(replace(METHODS["nao"], responses=METHODS["vo"].responses), Disc(1), LIMITS)
        .decide(FLAT, [], GOAL)
        .dump(folder / "d.json")
    ),
    r"blocked: expected a decision that was made": lambda folder: (
        read_decision(dumped()(folder)).inputs.previous.decision.blocked
    ),
    r"--method: expected none with the file of a decision, found 'vo'": lambda folder: command(
        "decide", str(dumped()(folder)), "--method", "vo"
    )(folder),
    r"--at: expected none with the file of a decision, found 3": lambda folder: command(
        "view", str(dumped()(folder)), "--no-browser", "--at", "3"
    )(folder),
    r"decision: expected one that a navigator made, found none of its inputs": lambda _: slalom.view.decision(
        replace(decision(), inputs=None), navigator(), GOAL
    ),
    r"--at: expected a time of the run, which ends after .* s, found 999": command("explain", "empty", "--at", "999"),
    r"run\.h5: expected a run of a method of slalom, found one of social_force": lambda folder: (
        replace(short_run(), method="social_force").save(folder / "run.h5"),
        command("explain", "{}/run.h5")(folder),
    ),
    r"--figure: expected a decision with a goal": lambda folder: command(
        "decide", str(dumped(without_goal)(folder)), "--figure", "{}/a.svg"
    )(folder),
}


def short_run() -> Recording:
    return simulate(gallery.build("empty").with_settings({"duration": 0.3}), METHODS["nao"])


def without_goal(content: dict) -> None:
    """A decision that follows a velocity."""
    wanted = {"kind": "FollowVelocity", "velocity": [1.0, 0.0], "enough_clearance": 0.0}
    content["inputs"]["navigator"].update(objective=wanted)
    content["inputs"].update(goal=None)


REFUSED: dict[str, Callable[[Path], object]] = {
    r"--walls-unit: expected only with --walls, found 'mm'": command("run", "empty", "--walls-unit", "mm"),
    r"--walls-up: expected only with --walls, found True": command("run", "empty", "--walls-up"),
    r"--walls-unit: expected the length of a unit of a\.svg": command("run", "empty", "--walls", "{}/a.svg"),
    r"now: expected a time after the previous decision at 0 s, found the same for another position": lambda _: (
        navigator().decide(State((0.1, 0.0), (1.0, 0.0)), [], GOAL, previous=decision())
    ),
    r"delay: expected at most the horizon, 6 s, found 7 s": lambda _: navigator("nao").decide(
        FLAT, [], GOAL, delay=7.0
    ),
    r"obstacle 'person': expected a trajectory that is known at 1.5 s, found one that ended at 1 s; say": lambda _: (
        navigator("nao").decide(FLAT, [Obstacle(Disc(1.0), Sampled([0, 1], np.zeros((2, 2))), "person")], GOAL, now=1.5)
    ),
    r"uncertainty: expected one or 1, found 2": lambda _: slalom.Tracks(
        [(0, 0)], [(0, 0)], 0.3, uncertainty=[None, None]
    ),
    r"correlation: expected a number from 0 to 1, found 2": lambda _: slalom.KalmanError(0.1, 0.1, 2.0),
    r"probability: expected a number between 0 and 1, found 1": lambda _: slalom.KalmanError(0.1, 0.1, probability=1.0),
    r"now: expected a time that does not run backwards, found 0 s after a call at 1 s": lambda _: [
        tracker.at(t) for tracker in [slalom.Tracker()] for t in (1.0, 0.0)
    ],
    r"obstacle 'b': position: expected dimension 2 as of the others, found 3": lambda _: [
        tracker.update(0.0, name, (0.0,) * d) for tracker in [slalom.Tracker()] for name, d in (("a", 2), ("b", 3))
    ],
    r"robot: method: expected one of the table in a file, found another one": lambda _: scenario_text(
        replace(build("empty"), robots=(replace(build("empty").robots[0], method=replace(METHODS["nao"], share=0.9)),))
    ),
    r"obstacle 'a': shape: expected one of dimension 3 as of the position, found 2": lambda _: slalom.Tracker().update(
        0.0, "a", (0, 0, 0)
    ),
    r"obstacle 'a': heading: expected none in space, found 1": lambda _: slalom.Tracker(slalom.Ball(1.0)).update(
        0.0, "a", (0, 0, 0), heading=1.0
    ),
    r"obstacle 'a': covariance: expected shape \(2, 2\) without a velocity, found \(3, 3\)": lambda _: (
        slalom.Tracker().update(0.0, "a", (0, 0), covariance=np.eye(3))
    ),
    r"obstacle 'a': covariance: expected a symmetric matrix without negative eigenvalues, found another": lambda _: (
        slalom.Tracker().update(0.0, "a", (0, 0), covariance=-np.eye(2))
    ),
    **DECISIONS,
    # Shapes, headings, uncertainty, traffic.
    r"corners: expected 3 or more .* 2 that are": lambda _: Polygon([(0, 0), (1, 0)]),
    r"corners: expected 3 or more of a polygon that does not cross .* found 4 that do": lambda _: Polygon(
        [(0, 0), (1, 1), (1, 0), (0, 1)]
    ),
    r"corners: expected points \(n, 2\) .* found shape \(3, 3\)": lambda _: Polygon(np.eye(3)),
    r"points: expected 2 or more, each diff": lambda _: Polyline([(0, 0), (0, 0)]),
    r"shapes: .* found dimensions \[2, 3\]": lambda _: Union((Disc(1), Ball(1))),
    r"shapes: .* found dimensions \[\]": lambda _: Union(()),
    r"heading: expected an angle \[rad\], Headings or 'motion', found 'north'": lambda _: Obstacle(
        Rectangle(2, 1), STILL, heading="north"
    ),
    r"heading: expected 0 in space, .* found 'motion'": lambda _: Obstacle(
        Ball(1), Stationary((0, 0, 0)), heading="motion"
    ),
    r"heading: expected 0 in space, .* found Headings": lambda _: Obstacle(
        Ball(1), Stationary((0, 0, 0)), heading=Headings([0.0], [0.0])
    ),
    r"angles: expected one for each time, .* found shape \(1,\) for times of shape \(2,\)": lambda _: Headings(
        [0.0, 1.0], [0.3]
    ),
    r"times: expected increasing times, found \[0, 0\]": lambda _: Headings([0.0, 0.0], [0.3, 0.4]),
    r"heading of obstacle 'car': expected one that moved before 0 s, found it at rest since -600 s": lambda _: Obstacle(
        Rectangle(2, 1), STILL, "car", heading="motion"
    ).direction(0.0),
    r"heading: expected a trajectory with a direction of motion, found Function": lambda _: direction_path(
        Function(lambda t: (np.sin(t), t), 2.0, 1.0, 0.0, 9.0), 0.0, 5.0, 1e-6
    ),
    r"heading: expected a trajectory that moves, found one at rest": lambda _: direction_path(STILL, 0.0, 5.0, 1e-6),
    r"heading: expected a trajectory that moves, found a circle at speed 0": lambda _: Circular(
        (0, 0), 1.0, 0.0
    ).direction(0.0, 5.0, 1e-6),
    r"horizons: expected 1, one for each of the obstacles, from 0 to 5 s, found 2 from 4 to 9 s": lambda _: (
        ObstacleWindow([ROCK], 0.0, 5.0, [4.0, 9.0])
    ),
    r"robot: expected a ball, or obstacles that are balls, in space; found parts with 2 and 2 corners": lambda _: (
        ControlObstacle(
            Acceleration(),
            SPACE,
            ObstacleWindow([Obstacle(Capsule((0, 0, 0), (1, 0, 0), 0.1), Stationary((9, 0, 0)))], 0.0, 5.0),
            Capsule((0, 0, 0), (0, 1, 0), 0.1),
        ).segments
    ),
    r"velocity: expected 2 numbers, found": lambda _: (
        model_of_part("constant_velocity", ConstantVelocity)
        .model_construct(position=[0, 0], velocity=[0, 0, 0], at=0.0)
        .build()
    ),
    r"expected either this key or shape, found both": lambda _: Shaped._one_of_them(
        1.0, SimpleNamespace(data={"shape": DISC})
    ),
    r"expected an angle \[rad\], 'motion', or times and angles; found 'north'": lambda _: HeadingOfContent().validate(
        "north"
    ),
    r"expected one of vo, .*; found 'novo'": lambda _: known_method("novo"),
    r"expected either this key or robot, found neither": lambda _: WorldSpec._one_of_both(
        None, SimpleNamespace(data={"robot": None, "flows": []})
    ),
    r"expected either this key or count, found both": lambda _: FlowSpec._one_of_two(
        1.0, SimpleNamespace(data={"count": 3})
    ),
    r"expected a range of appears in which one robot appears at least, found none": lambda _: FlowSpec._one_of_two(
        1.0, SimpleNamespace(data={"count": None, "appears": 3.0})
    ),
    r"robot\.appears: expected at least start = 2 s, found 1 s": lambda _: Scenario("early", (late(1.0),), start=2.0),
    r"sight_delay: expected 0 as 'robot' appears after the start, found 0\.1": lambda _: Scenario(
        "delayed", (late(1.0),), sight_delay=0.1
    ),
    r"--at: expected a time after the appearance of 'robot', found 1": lambda folder: (
        written("a.yaml", MINIMAL.replace("GOAL", "position: [5, 0]").replace("robot: {", "robot: {appears: 3, "))(
            folder
        ),
        command("explain", "{}/a.yaml", "--at", "1")(folder),
    ),
    r"expected a shape of dimension 2 as of the robot, found 3": lambda _: Shaped(
        shape={"kind": "ball", "radius": 1.0}
    ).whole_shape(2),
    r"boundary: expected a control obstacle in the plane, found one in space": lambda _: blocked(
        SPACE, (BALLOON,), Ball(1)
    ).boundary((0, 0), 1.0),
    r"robots: expected one or more of the same dimension, found dimensions \[\]": lambda _: Scenario("none", ()),
    r"sight_loss: expected 0 or more and below 1, found 1": lambda _: Scenario(
        "lost", (Robot(Disc(1), LIMITS, FLAT, GOAL),), sight_loss=1.0
    ),
    r"sight_noise: expected 0 for orca, whose observations are exact; found 0\.1": lambda _: simulate(
        load("circle", {"sight_noise": 0.1}), PEERS["orca"]
    ),
    r"robots: expected a name for each, found \['robot', 'robot'\]": lambda _: simulate(
        Scenario("twins", (Robot(Disc(1), LIMITS, FLAT, GOAL),) * 2), METHODS["nao"]
    ),
    r"robots: expected one number above 0, by methods, shapes, limits or robots, found \[2, 3\]": lambda _: (
        slalom.Fleet(METHODS["nao"], [Disc(1), Disc(1)], LIMITS, robots=3)
    ),
    r"shapes: expected those of robots and obstacles in one dimension, found \[2, 3\]": lambda _: slalom.Fleet(
        METHODS["nao"], [Disc(1), Ball(1)], LIMITS
    ),
    r"guided: expected False for a fleet in several worlds, found True": lambda _: pair(worlds=[0, 1], guided=True),
    r"targets: expected those of a guided fleet, found desired_velocities": lambda _: pair(guided=True).step(
        0.0, PLACES, PLACES, desired_velocities=PLACES
    ),
    r"margin: expected 0 m or more, found -1 m": lambda _: pair(margin=[0.1, -1.0]),
    r"priority: expected numbers above 0 with a ratio of at most 10, found 1 to 11": lambda _: pair(
        priority=[1.0, 11.0]
    ),
    r"priority: expected a method that shares the avoidance, found vo": lambda _: slalom.Fleet(
        METHODS["vo"], Disc(1), LIMITS, priority=[1.0, 2.0], robots=2
    ),
    r"margin: expected one number or 2, found an array of shape \(3,\)": lambda _: pair(margin=[0.1] * 3),
    r"worlds: expected whole numbers of 0 or more, found \[0, 0.5\]": lambda _: pair(worlds=[0, 0.5]),
    r"worlds: expected one world to publish manoeuvres of, found several": lambda _: pair(worlds=[0, 1]).manoeuvres(),
    r"robot.method: expected none of its own among robots that decide by orca, found nao": lambda _: simulate(
        Scenario("own", (robot(method=METHODS["nao"]),)), PEERS["orca"]
    ),
    r"paths: expected 2, found 1": lambda _: pair().step(0.0, PLACES, PLACES, paths=[ROUTE]),
    r"points: expected an array \(n, 2\) or \(n, 3\) with n >= 2, found shape \(1, 2\)": lambda _: PathGoal([(0, 0)]),
    r"laps: expected 1 for a path from \[0. 0.\] to \[1. 0.\], found 2": lambda _: PathGoal([(0, 0), (1, 0)], laps=2),
    r"points: expected different ones, found all at \[1. 1.\]": lambda _: PathGoal([(1, 1), (1, 1)]),
    r"speeds: expected one or 2, found .* \(3,\)": lambda _: route([1, 2, 3]),
    r"speeds: expected values above 0, .* found -1 m/s": lambda _: route([1, -1]),
    r"speeds: expected values above 0, .* found 0 m/s": lambda _: route(0.0),
    r"stop: expected True for speeds .* at 0": lambda _: route([1, 0], stop=False),
    r"import: expected a folder that can be written, found none: NUMBA_CACHE_DIR names one": taken,
    r"expected compiled kernels of these sources for .*, found none": lambda folder: taken(folder, ""),
    r"method: expected one that ends at rest with contact_at_rest=False, such as method\('nao'\).stopping\(\), "
    r"found vo": lambda _: navigator("vo", contact_at_rest=False),
    r"navigator: expected contact_at_rest=True to look ahead, found False": lambda _: LookAhead(
        Navigator(METHODS["nao"].stopping(), Disc(1), LIMITS, contact_at_rest=False)
    ),
    r"goal: expected one without a path to look ahead, found a PathGoal": lambda _: look_ahead().decide(
        FLAT, [], ROUTE
    ),
    r"targets: expected one of targets, desired_velocities, paths, goals, found none": lambda _: pair().step(
        0.0, PLACES, PLACES
    ),
    r"horizon: expected at least 10 s, the longest manoeuvre of 'circle 0', found 6 s": lambda _: simulate(
        Scenario("long", tuple(Robot(Disc(1), LIMITS, FLAT, GOAL, f"circle {k}") for k in range(2)), holds=(6.0,)),
        METHODS["nao_shared"],
    ),
    r"method: expected one for several robots, found nao_ahead, which is for one": lambda _: simulate(
        load("circle"), METHODS["nao_ahead"]
    ),
    r"only: expected a recorded run, found one with record=False": lambda _: path_length(
        simulate(load("empty", {"duration": 0.2}), METHODS["nao"], record=False)
    ),
    # Looking ahead, forecasts, foresight.
    r"limits: expected bounds whose sides turn with the velocity v .* to look ahead, found <.*Rootlike": lambda _: (
        look_ahead(limits=Limits(2, 1, bounds=(Rootlike(),)))
    ),
    r"goal: expected one at rest to look ahead, found one that moves": lambda _: look_ahead().decide(
        FLAT, [ROCK], Goal(ConstantVelocity((20, 0), (1, 0)))
    ),
    r"goal: expected dimension 3 as of the state, found 2": lambda _: look_ahead(robot=Ball(1)).decide(
        SPACE, [BALLOON], GOAL
    ),
    r"then: expected accelerations of the same dimension, found \[2, 3\]": lambda _: in_turn(
        (1.0, (1, 0)), (1.0, (1, 0, 0))
    ),
    r"then: expected dimension 3 as of the state, found 2": lambda _: in_turn((1.0, (1, 0))).position(SPACE, 0.5),
    r"method: expected hl alone, which observes the present only; found 'hl@observed'": lambda _: contender(
        "hl@observed"
    ),
    r"method: expected nao alone, whose settings are of the scenario; found 'nao:horizon=3'": lambda _: slalom.method(
        "nao:horizon=3"
    ),
    r"method: expected hl:PARAMETER=VALUE with a number, found 'tau'": lambda _: slalom.method("hl:tau"),
    r"method: expected plain alone, which has no parameters; found 'tau'": lambda _: peers.methods.with_parameters(
        len, {"tau": 1.0}, "plain"
    ),
    # Numbers.
    r"braking: expected numbers of 0 m/s\^2 or more, found \[-1": lambda _: Tracks([(1, 0)], [(1, 0)], 0.3, braking=-1),
    r"braking: expected 0 m/s\^2 in space, found \[1": lambda _: Tracks([(1, 0, 0)], [(1, 0, 0)], 0.3, braking=1),
    r"controls: expected an array \(\.\.\., 2\), found shape \(3,\)": lambda _: blocked().clearance((0, 0, 0)),
    r"radius: expected one number, found shape \(2,\)": lambda _: Disc((1, 2)),
    r"goal: trajectory: expected a trajectory, such as .*, found \(20, 0\)": lambda _: Goal((20, 0)),
    r"1 - rate \* period: .* found 0": lambda _: AccelerateThenStop(1, 10, 0.1),
    r"weight of parts\[0\]: .* found -1": lambda _: Mix(((-1, Arrive()),)),
    # Shapes, trajectories, obstacles, limits.
    r"obstacle 'rock': expected .* the same dimension, found 2 and 3": lambda _: Obstacle(
        Disc(1), Stationary((0, 0, 0)), "rock"
    ),
    r"normal: expected a direction, found the zero vector": lambda _: HalfSpace((0, 0), 1),
    r"least of half_widths: .* found 0": lambda _: Box((1, 0)),
    r"corners: expected an array \(n, 2\) with n >= 3, found shape \(2, 2\)": lambda _: ConvexPolygon(((1, 0), (0, 1))),
    r"corners: expected a robot in the plane, found one of dimension 3": lambda _: ConvexPolygon(
        ((1, 0), (0, 1), (-1, -1))
    ).half_spaces(SPACE),
    r"frame: expected 'world' for a robot in space, .* found 'body'": lambda _: Box((1, 1, 1), "body").half_spaces(
        SPACE
    ),
    r"half_angle: expected at most pi / 2, found 2": lambda _: HeadingCone(2.0),
    r"normal: expected none .* plane, found one": lambda _: Circular((0, 0), 1, 1, normal=(0, 0, 1)),
    r"positions: expected one for each time, found \(3, 2\) for \(2,\)": lambda _: Sampled([0, 1], np.zeros((3, 2))),
    r"times: expected at least two samples, found 0": lambda _: Sampled([], np.empty((0, 2))),
    r"times: expected at least two samples, found 1": lambda _: Sampled([0], [(0, 0)]),
    r"positions: expected finite velocities between samples, found \[inf, 0, ": lambda _: Sampled(
        [0, 1e-300], [(0, 0), (1e10, 0)]
    ),
    r"increasing times, found 2 followed by 1 at index 2": lambda _: Sampled([0, 2, 1], np.zeros((3, 2))),
    r"increasing times, found 1 followed by 1 at index 2": lambda _: Sampled([0, 1, 1], np.zeros((3, 3))),
    r"coefficients: expected \(n, degree \+ 1, 2 or 3\) for n >= 1 durations, found \(1, 2, 2\) for \(2,\)": lambda _: (
        PiecewisePolynomial([1, 1], np.zeros((1, 2, 2)))
    ),
    r"coefficients: expected .* found \(0, 2, 2\) for \(0,\)": lambda _: PiecewisePolynomial([], np.zeros((0, 2, 2))),
    r"durations: expected times above 0, found -1 at index 1": lambda _: PiecewisePolynomial(
        [1, -1], np.zeros((2, 2, 2))
    ),
    r"coefficients: expected pieces that meet, found a jump of 5 m after piece 0": lambda _: PiecewisePolynomial(
        [1, 1], [[(0, 0)], [(3, 4)]]
    ),
    r"coefficients: expected pieces that meet, found a jump of inf m after piece 0": lambda _: PiecewisePolynomial(
        [1.0, 1.0], np.array([[[1e308, 0.0]], [[-1e308, 0.0]]])
    ),
    r"switches: expected one between two parts each, found 1 for 1 parts": lambda _: Composite((STILL,), (1.0,)),
    r"switches: expected one between two parts each, found 0 for 1 parts": lambda _: Composite((STILL,), ()),
    r"parts: expected one dimension, found \[2, 3\]": lambda _: Composite((STILL, Stationary((0, 0, 0))), (1.0,)),
    r"switches: expected increasing times, found \(2.0, 1.0\)": lambda _: Composite((STILL,) * 3, (2.0, 1.0)),
    r"switches: expected both parts to exist at 5 s, found a span \(0.0, 1.0\)": lambda _: Composite(
        (Sampled([0, 1], np.zeros((2, 2))), STILL), (5.0,)
    ),
    r"parts: expected parts that meet, found a jump of 5 m at 1 s": lambda _: Composite(
        (STILL, Stationary((3, 4))), (1.0,)
    ),
    r"function: expected a position of 2 or 3 finite numbers, found \[0\.\]": lambda _: Function(
        lambda t: [0.0], 1, 1, 0, 1
    ),
    r"function: expected a position of 2 or 3 finite numbers, found \[nan  0\.\]": lambda _: Function(
        lambda t: [NAN, 0.0], 1, 1, 0, 1
    ),
    # Decisions.
    r"obstacles: expected one dimension, found \[2, 3\]": lambda _: ObstacleWindow([ROCK, BALLOON], 0, 1),
    r"^obstacles: expected one dimension, found \[2, 3\]": lambda _: ObstacleWindow(
        [ObstacleTable([ROCK]), seen(positions=[(0, 0, 0)], velocities=[(0, 0, 0)])], 0, 1
    ),
    r"obstacles\[1\]: expected an Obstacle, an ObstacleTable or Tracks, found Disc": lambda _: decision(
        obstacles=[ROCK, Disc(1)]
    ),
    r"obstacles: expected a table of obstacles without uncertainty, found one with it": lambda _: ObstacleWindow(
        ObstacleTable([replace(ROCK, uncertainty=BoundedError(0.1))]), 0, 1
    ).bodies(Disc(1)),
    r"positions: expected an array of shape \(n, 2\) or \(n, 3\), found shape \(2,\)": lambda _: seen(
        positions=[1.0, 2.0]
    ),
    r"obstacle 'moon': shape: expected lengths of at most 1e\+07 m, found 1e\+15 m": lambda _: Obstacle(
        Disc(1e15), STILL, "moon"
    ),
    r"radii: expected lengths of at most 1e\+07 m, found 2e\+07 m": lambda _: seen(radii=2e7),
    r"robot with its margin: expected lengths of at most 1e\+07 m, found": lambda _: navigator(margin=1e7),
    r"limits: way at max_speed within the horizon: expected lengths of at most 1e\+07 m, found 6e\+07 m": lambda _: (
        navigator(limits=Limits(1e7, 1.0))
    ),
    r"radii: expected one or 1 .*, found \[-0.1\]": lambda _: seen(radii=-0.1),
    r"ids: expected 1, found 2": lambda _: seen(ids=["a", "b"]),
    r"tracks: expected a forecast from what is observed at one time, .*, found Known\(\)": lambda _: seen(
        forecast=Known()
    ),
    r"tracks: expected a forecast from what is observed at one time, .* found From(Past|Models)": lambda _: replace(
        navigator(), method=METHODS["nao"].with_foresight("observed")
    ).decide(FLAT, seen(), GOAL),
    r"obstacles: expected tracks with a time t up to 1 s, found 2 s": lambda _: decision(
        obstacles=seen(t=2.0), now=1.0
    ),
    r"robots: expected tracks with a time t up to 1 s, found 2 s": lambda _: decision(robots=seen(t=2.0), now=1.0),
    r"method: expected one without a search, found nao_ahead; use LookAhead": lambda _: navigator("nao_ahead").decide(
        FLAT, [], GOAL
    ),
    r"method: expected one without published manoeuvres, found nao_shared; use Fleet": lambda _: navigator(
        "nao_shared"
    ).decide(FLAT, [], GOAL),
    r"robots: expected dimension 2 as of the state, found 3": lambda _: decision(
        robots=seen(positions=[(4, 0, 0)], velocities=[(0, 0, 0)])
    ),
    r"trajectory: expected at most 1000000 pieces in 30 s, found pieces of .* s": lambda _: Circular(
        (0, 0), 1e-9, 300.0
    ).path(0.0, 30.0),
    r"duration: expected at most 10000000 steps of dt = 1e-09 s, found 60 s": lambda _: Scenario(
        "fine", (HERE,), dt=1e-9
    ),
    r"horizon: expected at most 5000 s, found 1e\+90 s": lambda _: Scenario("far", (HERE,), horizon=1e90),
    r"horizon: expected at least the period of decisions, 7 s, found 6 s": lambda _: Scenario(
        "slow", (HERE,), dt=0.5, replan=7.0
    ),
    r"holds\[1\]: expected at most 5000 s, found 1e\+90 s": lambda _: Scenario("long", (HERE,), holds=(1.0, 1e90)),
    r"now: expected a time that does not run backwards, found 1.9 s after a decision at 2 s": lambda _: decision(
        now=1.9, previous=decision(now=2.0)
    ),
    r"now: expected a time that does not run backwards, found 0 s after a step at 1 s": lambda _: backwards(pair()),
    r"horizon: expected at most 5 s, as of the obstacles, found 6 s": lambda _: replace(blocked(), horizon=6.0),
    r"robot: expected dimension 2 as of the state, found 3": lambda _: blocked(robot=Ball(1)),
    r"obstacles: expected dimension 2 as of the state, found 3": lambda _: blocked(obstacles=[BALLOON]),
    r"obstacles: expected dimension 3 as of the state, found 2": lambda _: decide(
        SPACE, robot=Ball(1), goal=Goal(Stationary((9, 0, 0)))
    ),
    r"goal: expected one for the objective Arrive\(.*\), found none": lambda _: decide(goal=None),
    r"objective: expected one for responses that set no acceleration at once, found FollowAcceleration": lambda _: (
        replace(navigator(), method=METHOD_OF_JERKS, objective=FollowAcceleration((1, 0))).decide(FLAT, ())
    ),
    r"response: expected a motion that is linear in the state, found that of Curved\(\)": lambda _: replace(
        navigator(), method=curved()
    ).decide(FLAT, (ROCK,), GOAL),
    r"t: expected a time in \(0, 5\] s, found 0 s": lambda _: blocked().element(0),
    r"found 5.1 s": lambda _: blocked().element(5.1),
    r"found -1 s": lambda _: blocked().element(-1),
    r"admissible: expected a set of dimension 2 bounded by a ball, found dimension 3 and 1 balls": lambda _: select(
        (0, 0), admissible_ball((0, 0, 0), 1), blocked()
    ),
    r"states: expected 2 of dimension 2, one for each preferred control, found 1 of dimensions \[2\]": lambda _: many(
        np.zeros((2, 2)), [State((0, 0), (0, 0))], Disc(0.5)
    ),
    r"states: expected `State`s, or numbers \(n, 2 or 3, d\), found shape \(1, 4, 2\)": lambda _: many(
        np.zeros((1, 2)), np.zeros((1, 4, 2)), Disc(0.5)
    ),
    r"robot: expected dimension 2 as of the states, found 3": lambda _: many(
        np.zeros((1, 2)), [State((0, 0), (0, 0))], Ball(0.5)
    ),
    r"bounded by a ball, found dimension 2 and 0 balls": lambda _: select((0, 0), NEVER_BOUNDED, blocked()),
    r"^aims: expected one with weight and gain above 0, found none": lambda _: preferred_control(()),
    r"found none": lambda _: preferred_control((Aim(Acceleration().position(FLAT, 0.0), np.zeros(2)),)),
    r"sum of the weights of parts: expected a number above 0": lambda _: Mix(((0, Arrive()),)),
    r"^sum of the weights of parts: expected a number above 0": lambda _: Mix(()),
    r"rate: expected a number other than 0; to keep the velocity use AccelerateThenCoast": lambda _: AccelerateThenTurn(
        1.0, 0.0
    ),
    r"response: expected a robot in the plane, found one of dimension 3": lambda _: AccelerateThenTurn(
        1.0, 0.5
    ).position(State((0, 0, 0), (1, 0, 0)), 1.0),
    r"response: expected one that does not turn the control, found AccelerateThenTurn": lambda _: Navigator(
        replace(METHODS["nao"], responses=lambda limits, period, holds: (AccelerateThenTurn(1.0, 0.5),)), DISC, LIMITS
    ).decide(FLAT, [], GOAL),
    r"limits: expected a robot that may stop, as its manoeuvres end at rest, found LeastSpeed": lambda _: slalom.Fleet(
        METHODS["nao_shared"], DISC, Limits(4.0, 2.0, bounds=(LeastSpeed(1.0),)), robots=2
    ),
    r"limits: expected a robot that may stop, for passive safety, found LeastSpeed": lambda _: (
        METHODS["nao"].stopping().responses(Limits(4.0, 2.0, bounds=(LeastSpeed(1.0),)), 0.1, (0.5,))
    ),
    r"boundary: expected a disc as the robot, as obstacles turn and the response does": lambda _: control_obstacle(
        AccelerateThenTurn(1.0, 0.5),
        State((0, 0), (1, 0)),
        [Obstacle(Rectangle(2, 1), ConstantVelocity((9, 0), (-1, 1)), heading="motion")],
        Rectangle(1, 0.5),
        horizon=5.0,
    ).boundary((0, 0), 2.0),
    r"holds: expected at least one, found none": lambda _: navigator(holds=()),
    r"goal: expected dimension 2 as of the state, found 3": lambda _: decide(goal=Goal(Stationary((0, 0, 0)))),
    # Scenarios and files.
    r"robot\.shape: expected dimension 2 as of the state, found 3": lambda _: Robot(Ball(1), LIMITS, FLAT, GOAL),
    r"robot\.goal: expected dimension 3 as of the state, found 2": lambda _: Robot(Ball(1), LIMITS, SPACE, GOAL),
    r"replan: expected a multiple of dt = 0.1 s, found 0.25 s": lambda _: scenario(replan=0.25),
    r"guided: expected 0 or 1, found 0.5": lambda _: build("circle", {"guided": 0.5}),
    r"obstacle 0: expected dimension 2 as of the robots, found 3": lambda _: replace(scenario(), obstacles=(BALLOON,)),
    r"goal: expected a position that the robot can reach, found one 3.5 m deep in .* 'lid' grown by": lambda _: replace(
        scenario(), obstacles=(Obstacle(Disc(3), Stationary((20, 0.5)), "lid"),)
    ),
    r"methods: expected at least one of .*; found none": lambda _: compare("empty", [], 1),
    r"backend: expected loky, threading or sequential, .*; found 'fast': Invalid backend": lambda _: compare(
        "empty", ["nao"], 1, backend="fast"
    ),
    r"backend: expected one that reports killed processes, found 'multiprocessing'": lambda _: compare(
        "empty", ["nao"], 1, backend="multiprocessing"
    ),
    r"adopt: expected a store with runs of former code, found no store": lambda _: compare(
        "empty", ["nao"], 1, adopt=True
    ),
    r"store: expected a folder that exists or can be made, found ": lambda folder: Store.at(
        written("a", "")(folder) / "b"
    ),
    r"scenario: expected at least one, or a study file, found none": lambda _: named([]),
    r"data: expected only with a study file, found it with empty, ring": lambda folder: named(
        ["empty", "ring"], data=folder
    ),
    r"data: expected the folder of none\.csv; found no such file, and nothing else to run": reading(
        lambda path: named([str(path)]), "a.yaml", "scenarios: [{scenario: none.csv}]"
    ),
    r"data: expected a folder, found none at 'none'": reading(
        lambda path: read_study(path, "none"), "a.yaml", "scenarios: [{scenario: empty}]"
    ),
    r"seeds: expected at most 1, the cases of .*a\.csv; found 2": reading(
        lambda path: compare(str(path), ["nao"], 2), "a.csv", CADRL
    ),
    r"seed: expected 0 to 0, the cases of .*a\.yaml; found 1": reading(
        lambda path: read_scenario(path, 1), "a.yaml", "cases: [{name: a}]"
    ),
    r"seeds: expected at most 1, the cases of .*a\.yaml; found 2": reading(
        lambda path: compare(str(path), ["nao"], 2),
        "a.yaml",
        MINIMAL.replace("GOAL", "position: [9, 0]") + "\ncases: [{name: a}]",
    ),
    r"seed: expected 0 to 0, the cases of .*a\.csv; found 1": reading(
        lambda path: drawn(str(path), seed=1), "a.csv", CADRL
    ),
    r"seed: expected 0 or more, found -1": lambda _: build("empty", seed=-1),
    r"goal: expected a position that the robot can reach, found one 9.5 m deep in obstacle 'hill'": lambda _: Scenario(
        "test",
        (Robot(Disc(1), LIMITS, FLAT, GOAL),),
        (Obstacle(Disc(9), Stationary(GOAL.trajectory.initial_position + np.array([0.5, 0.0])), "hill"),),
    ),
    r"jobs: expected a number of": lambda _: compare("empty", ["nao"], 1, jobs=0),
    r"expected one of position, trajectory, path, found none": lambda _: GoalSpec.model_construct().build(),
    r"expected a position with route, found trajectory": lambda _: GoalSpec.model_construct(
        trajectory=0, route=True
    ).build(),
    r"jupedsim: expected settings frame_rate, with frame_rate, found none": write_tracks("jupedsim"),
    r"encoding: expected a name such as latin-1 or utf-16, found 'klingon'": reading(
        partial(read_recording, encoding="klingon"), "a.csv", ROW
    ),
    r"time_unit: expected none with frames, which have a frame_rate; found one": reading(
        partial(read_recording, time_unit="ms"), "a.csv", ROW.replace("t,", "frame,")
    ),
    r"frame_rate: expected none with times in the column 't', found 9": reading(
        partial(read_recording, frame_rate=9), "a.csv", ROW
    ),
    r"agent 1: expected a kind of pedestrian, .*, or --agent-radius; found 'unicorn'": reading(
        read_recorded, "a.csv", "t,id,x,y,kind\n0,1,0,0,unicorn\n1,1,1,0,unicorn\n"
    ),
    r"epoch: expected seconds or a time in ISO 8601, found 'noon'": reading(
        partial(read_recording, epoch="noon"), "a.csv", "time,mmsi,lat,lon\n0,1,0,0\n"
    ),
    r"origin: expected a latitude and a longitude in degrees, found \(91\.0, 0\.0\)": reading(
        partial(read_recording, origin=(91, 0)), "a.csv", "time,mmsi,lat,lon\n0,1,0,0\n"
    ),
    r"tracks: expected agents of the same dimension, found \[2, 3\]": lambda folder: write_recording(
        folder / "a.csv", RecordedTracks({str(d): Agent(Sampled([0, 1], np.zeros((2, d)))) for d in (2, 3)}), "csv"
    ),
    r"tracks: expected at least one agent, found none": lambda folder: write_recording(
        folder / "a.csv", RecordedTracks({}), "csv"
    ),
    r"agent 1: expected positions in the plane, found dimension 3": write_tracks(
        "trajnet", positions=np.eye(2, 3), frame_rate=10
    ),
    r"agent 7\.1: expected a whole number as id, found '7\.1'": write_tracks("trajnet", "7.1", frame_rate=10),
    r"agent 1: expected different multiples of 1 / 4 s, found 0\.1 s": write_tracks("jupedsim", frame_rate=4),
    # Peers.
    r"setting of ORCA: expected one of .*max_neighbors.*; found 'max_number_of_neighbors'": lambda _: behaviour(
        "ORCA", settings={"max_number_of_neighbors": 10}
    ),
    r"obstacle 'bus': .* avoid \(discs, and other shapes at rest\), found a rectangle that moves": lambda _: simulate(
        replace(scenario(), obstacles=(BUS,)), peers.PEERS["orca"]
    ),
    r"obstacle 'pair': .* found a union that moves": lambda _: peers.outlines(
        [replace(BUS, shape=Union((DISC, DISC)), name="pair", heading="motion")], walls=True
    ),
    r"drone: expected a disc .* as orca requires, found a ball": lambda _: simulate(
        gallery.build("drones_crossing"), peers.PEERS["orca"]
    ),
    r"robot: expected a disc .* as hl requires, found bounds": lambda _: simulate(bounded(), peers.PEERS["hl"]),
    # Scenarios of the gallery.
    r"robots: expected space for 90, 1\.2 m apart, in 5 m x 5 m; found space for \d+": lambda _: build(
        "random_goals", {"robots": 90, "side": 5}
    ),
    r"robots of a group: expected space for 10, 0\.8 m apart, in 6\.66667 m x 0 m; found space for 0": lambda _: build(
        "corridor_swap", {"width": 0.5}
    ),
    r"robots: expected at most 39, which fill the circle; found 60": lambda _: build("circle_random", {"robots": 60}),
    r"robots: expected starts that do not overlap, found robots 0 and 1 overlapping by 0\.08\d+ m": lambda _: build(
        "ring", {"robots": 172, "noise": 0}
    ),
    r"angle: expected more than 0 and at most 180 degrees, found 190": lambda _: build(
        "crossing_streams", {"angle": 190}
    ),
    r"door: expected 0\.8 m to 8 m; found 0\.5 m": lambda _: build("doorway", {"door": 0.5}),
    r"gap: expected at most \d+\.\d+ m, the widest gap, found 90 m": lambda _: build("merging", {"gap": 90}),
    r"seed: expected less than 4294966296 for a legacy generator, found 4294966296": lambda _: build(
        "crowdnav", seed=2**32 - 1000
    ),
    r"people: expected space for 60 on the circle, found space for \d+": lambda _: build("crowdnav", {"people": 60}),
    # Recordings.
    r"start: expected a time of the recording, from 2 to before 3 s, found 0 s": lambda _: scenario(
        recorded=(2.0, 3.0)
    ),
    r"expected one of csv, eth_ucy, .*; found 'gpx'": lambda _: RecordingSpec._known("gpx"),
    r"expected a time and a later one, found 3 and 3": lambda _: RecordingSpec._forward([3.0, 3.0]),
    r"agents: expected ids of a\.csv, agent 1; found '7'": on_recording(*CROSS, "--agents", "7"),
    r"at: expected a time of a, from 2 to before 3 s, found 3 s": on_recording(*CROSS, "--at", "3"),
    r"run: expected at least one step to write, found a robot that starts at its goal": command(
        "run", "empty", "--set", "distance=0", "--out", "{}/a.csv"
    ),
    r"--start: expected only with a recording, found it with 'empty'": command("run", "empty", "--start", "0,0"),
    r"--goal: expected X,Y\[,Z\] \[m\] for a robot in .*a\.csv, found none": on_recording(*CROSS[:4]),
    r"--start: expected two or three numbers separated by commas, found '1'": on_recording(
        *CROSS[:2], "--start", "1", "--goal", "9,9"
    ),
    r"--columns: expected FIELD=COLUMN, found 'time'": on_recording(*CROSS, "--format", "ais", "--columns", "time"),
    r"--foresight: expected none with nao@present, or present; found 'observed'": command(
        "run", "empty", "--method", "nao@present", "--foresight", "observed"
    ),
    r"--at: expected either --at or --figure-at, found 1 and 2": command(
        "run", "empty", "--at", "1", "--figure-at", "2"
    ),
    r"--figure-at: expected a time of the run, from 0 to at most 0\.2 s, found -3 s": command(
        "run", "empty", "--set", "duration=0.2", "--figure", "{}/a.svg", "--figure-at", "-3"
    ),
    r"--figure-at: expected a time of the run, from 0 to \d\.\d s, found 30 s": command(
        "run", "empty", "--set", "distance=2", "--figure", "{}/a.svg", "--figure-at", "30"
    ),
    r"--names: expected only with --figure, found it without": command("run", "empty", "--names"),
    r"--names: expected a run of several robots, found one": command("run", "empty", "--names", "--figure", "{}/a.svg"),
    r"--figure-at: expected a figure of a decision, found one of the tracks of 3 robots": command(
        "run", "circle", "--set", "robots=3", "--figure", "{}/a.svg", "--figure-at", "1"
    ),
    r"--at: expected only with a recording, found it with 'empty'": command(
        "view", "empty", "--no-browser", "--at", "3"
    ),
    r"--page: expected a file that ends in \.md, found .*a\.pdf": command("compare", "empty", "--page", "{}/a.pdf"),
    r"robots: expected at most 100000, found 1e\+09": lambda _: build("ring", {"robots": 1e9}),
    r"scenario: expected a \.yaml file or a name of the gallery, found .*a\.csv', of another kind": reading(
        lambda path: load(str(path)), "a.csv", CADRL
    ),
    r"positions: expected .*, found shape \(0,\); np\.empty\(\(0, 2\)\) has no track": lambda _: seen(
        positions=[], velocities=[]
    ),
    r"--set duration: expected --duration with a recording, found 3": on_recording(*CROSS, "--set", "duration=3"),
    r"--out: expected a file that ends in \.h5, \.hdf5, \.csv, \.ndjson, \.sqlite; found 'a\.txt'": command(
        "run", "empty", "--out", "a.txt"
    ),
    r"--out: expected \.h5 or \.csv for a run in space, found 'a\.sqlite'": command(
        "run", "drones_crossing", "--out", "a.sqlite"
    ),
    r"TARGET: expected a file that ends in \.csv, \.ndjson, \.sqlite; found '.*a\.h5'": on_recording(
        "convert", "{}/a.csv", "{}/a.h5"
    ),
    r"a\.csv: expected a file other than the source, found the same": on_recording("convert", "{}/a.csv", "{}/a.csv"),
    r"a\.csv: expected a file other than the source, found the same$": on_recording(
        "run", "{}/a.csv", "--start=0,0", "--goal", "9,0", "--out", "{}/a.csv"
    ),
    r"--out-frame-rate: expected only with a format with frame numbers, found it with csv": on_recording(
        "convert", "{}/a.csv", "{}/b.csv", "--out-frame-rate", "10"
    ),
    r"--agents: expected at least one agent of a\.csv to write, found none": on_recording(
        "convert", "{}/a.csv", "{}/b.csv", "--agents="
    ),
    # Command line and figures.
    r"--set: expected NAME=NUMBER, found 'speed'": lambda _: console.parse_settings(["speed"]),
    r"--set: expected NAME=NUMBER, found 'speed=fast'": command("run", "empty", "--set", "speed=fast"),
    r"--set: expected NAME=NUMBER, found '=3'": lambda _: console.parse_settings(["=3"]),
    r"scenario: expected one with one robot to decide for, found 4 robots; `slalom run` runs them": command(
        "decide", "circle"
    ),
    r"--figure: expected a file that ends in \.svg, \.pdf or \.png, found 'a\.gif'": command(
        "decide", "empty", "--figure", "a.gif"
    ),
    r"width: expected at least 2\.\d\d inch with text of this size, found 1": command(
        "decide", "empty", "--figure", "{}/a.svg", "--figure-width", "1"
    ),
    r"width: expected a width in which the legends have space with text of this size, found 4 inch": command(
        "decide", "empty", "--figure", "{}/a.svg", "--figure-width", "4"
    ),
    r"--uncertainty: expected a figure of a decision, found one of the tracks of 4 robots": command(
        "run", "circle", "--figure", "{}/a.svg", "--uncertainty"
    ),
    r"--page: expected a new file, or --force to replace it; found .*, which exists": lambda folder: (
        (folder / "a.md").write_text(""),
        command("compare", "empty", "--page", "{}/a.md")(folder),
    ),
    r"found 'mixed'; did you mean 'sample:mixed\.yaml'\?$": command("run", "mixed"),
    r"part: expected only with keys, found 'a' with methods": command("list", "methods", "a"),
    r"mine\.yaml: expected a run in an \.h5 file, found a scenario; `slalom run mine\.yaml --out .*` runs": command(
        "export", "mine.yaml", "{}/page.html"
    ),
    r"scenario: expected a scenario or recorded tracks, found the run .*, which is over": lambda folder: (
        (folder / "a.h5").write_text(""),
        command("run", "{}/a.h5")(folder),
    ),
    r"--gap: expected only with recorded tracks, found it with the run": command(
        "convert", "{}/a.h5", "{}/a.csv", "--gap", "1"
    ),
    r"expected a file that ends in \.csv, \.parquet, \.ndjson, \.sqlite for a run; found": command(
        "convert", "{}/a.h5", "{}/a.xls"
    ),
    r"--out: expected a file that ends in \.csv or \.tex, found .*a\.txt": command(
        "compare", "empty", "--out", "{}/a.txt"
    ),
    r"--figure: expected margin in all rows of the study": lambda _: axis_of([{"margin": 1.0}, {"margin": 2.0}, {}]),
    r"margin: expected at least one number, found none": lambda _: grid({"margin": []}),
    r"--set: expected each name once, found 'margin' twice": command(
        "compare", "empty", "--set", "margin=1", "margin=2"
    ),
    r"--set: expected a range of 1 to 10000 values, found '1:0:1'": command(
        "compare", "empty", "--set", "margin=1:0:1"
    ),
    r"--set margin: expected one number, found 1, 2; `slalom compare`": command("run", "empty", "--set", "margin=1,2"),
    r"--page: expected without --shard, which has a part of the runs; found": command(
        "compare", "empty", "--shard", "1/2", "--store", "{}/runs", "--page", "{}/new.md"
    ),
    r"shard: expected K/N with K from 1 to N, found '3/2'": lambda _: Shard.named("3/2"),
    r"store: expected the folder that all shards share, found none": lambda _: compare_all([], shard=Shard(1, 2)),
    r"merge: expected without shard, found both": lambda folder: compare_all(
        [], store=folder, shard=Shard(1, 2), merge=True
    ),
    r"path: expected a file that ends in \.csv, \.parquet; found 'a\.xls'": lambda _: write_table(
        simulate(load("empty", {"duration": 0.1}), METHODS["nao"]), "a.xls"
    ),
    r"--figure: expected a run with at least one step": command(
        "run", "empty", "--set", "distance=0", "--figure", "{}/a.svg"
    ),
    r"figure or claim: expected cone, or with \.svg, \.pdf, \.png; found 'cone\.eps'": command(
        "reproduce", "cone.eps", "--out", "{}"
    ),
    r"seeds, jobs: expected seeds of 1 or more and jobs not 0, found 0 and 2": command(
        "reproduce", "cone", "--seeds", "0", "--out", "{}"
    ),
    r"admissible: expected dimension 2, found 3": lambda _: control_space(admissible_ball((0, 0, 0), 1)),
    r"resolution: expected at least 2, found 1": lambda _: control_space(resolution=1),
    r"contact_times: expected one for each of 1 obstacles, found shape \(2,\)": lambda _: workspace(
        contact_times=[1, 2]
    ),
    r"times: expected two or more in increasing order.*found shapes \(2,\) and \(3, 2\)": lambda _: paths_of(
        [0, 1], np.zeros((3, 2))
    ),
    r"times: expected two or more in increasing order": lambda _: paths_of([1, 0], np.zeros((2, 2))),
    r"admissible: expected a set bounded by a ball, found none": lambda _: admissible_region(NEVER_BOUNDED),
    r"path: expected a name ending in .*; found '\.jpg'": lambda folder: view.save(Figure(), folder / "a.jpg"),
    r"resolution: expected at most \d+ dots per inch at this size, found 1e\+09": lambda folder: view.save(
        Figure(), folder / "a.png", resolution=1e9
    ),
    r"width: expected at most 200 inch, found 1e\+09": lambda _: view.resized(Figure(), width=1e9),
}
VALUES = (
    ("2001-99-99", "'2001-99-99' as timestamp"),
    ("!!int abc", "'abc' as int"),
    ("!!float abc", "'abc' as float"),
    ("!!bool abc", "'abc' as bool"),
    ("9" * 5000, r"'9{199}\.\.\. as int"),
    (r'"\ud800"', r"'\\ud800' as str"),
    (r'"a\0"', r"'a\\x00' as str"),
)
"""Values that YAML cannot read, and what is found."""
CASES = """\
robot:
  shape: {kind: disc, radius: 0.4}
  position: [0, 0]
  max_speed: 2.5
  max_acceleration: 2
  goal: {position: [5, 0]}
cases:
  - {duration: 3}
  - {duration: -3}
"""
FILES: dict[str, Callable[[Path], object]] = {
    r"b\.py: expected a Python file, found no such file": lambda f: load(f"{f}/b.py:build"),
    r"a\.py: expected a file that can be imported, found ZeroDivisionError": lambda f: scripted(f, "1 / 0"),
    r"none/d\.json: expected a file that can be written": lambda f: decision().dump(f / "none/d.json"),
    r"d\.json: expected JSON, found a mistake": reading(read_decision, "d.json", "[["),
    r"d\.json: expected JSON .* nested too deeply": reading(read_decision, "d.json", "[" * 10**5),
    r"d\.json: format: expected 'slalom decision 2', found 'slalom decision 1'": undumped(
        lambda content: content.update(format="slalom decision 1")
    ),
    r"d\.json: expected format, versions, inputs, decision, found format, versions, inputs$": undumped(
        lambda content: content.pop("decision")
    ),
    r"d\.json: inputs: expected those of a decision, found 3": undumped(lambda content: content.update(inputs=3)),
    r"d\.json: inputs\.state: velocity: expected 2 numbers": undumped(
        lambda content: content["inputs"]["state"].update(velocity={"array": [0.0, 0.0, 0.0]})
    ),
    r"d\.json: inputs\.state: expected position, .*, found position, .*, colour": undumped(
        lambda content: content["inputs"]["state"].update(colour=1)
    ),
    r"d\.json: inputs\.state\.kind: expected a class that files can hold, found 'Exit'": undumped(
        lambda content: content["inputs"]["state"].update(kind="Exit")
    ),
    r"d\.json: inputs\.state\.position: expected an array of numbers, found": undumped(
        lambda content: content["inputs"]["state"].update(position={"array": ["x"]})
    ),
    r"d\.json: inputs\.goal: expected a part, an array or a place before, found keys at": undumped(
        lambda content: content["inputs"].update(goal={"at": 1})
    ),
    r"d\.json: inputs\.now: expected float, found str": undumped(lambda content: content["inputs"].update(now="x")),
    r"d\.json: inputs\.now: name: expected one of CLEAR, .*, found 'FINE'": undumped(
        lambda content: content["inputs"].update(now={"kind": "Outcome", "name": "FINE"})
    ),
    r"d\.json: inputs\.navigator\.period: expected at most": undumped(
        lambda content: content["inputs"]["navigator"].update(period=1e-12)
    ),
    r"d\.json: inputs\.navigator\.method: expected what makes a Method, found": undumped(
        lambda content: content["inputs"]["navigator"]["method"].update(changed={"map": {"colour": 1}})
    ),
    r"d\.json: inputs\.navigator: period: expected a number above 0, found 0": undumped(
        lambda content: content["inputs"]["navigator"].update(period=0.0)
    ),
    r"d\.json: inputs\.previous\.path: path: expected increasing times and 1 pieces": undumped(
        lambda content: content["inputs"]["previous"]["path"].update(times={"array": [1.0, 0.0]})
    ),
    r"a\.yaml:2:3: expected text as a key, found a list": yaml("a: 1\n? [b]\n: 2"),
    r"a\.yaml:1:3: expected text as a key, found a mapping": yaml("? {b: 1}\n: 2"),
    r"a\.yaml:9:16: duration: expected a number above 0, found -3": reading(read_scenarios, "a.yaml", CASES),
    r"a\.yaml: expected at most 1000000 values, found more by aliases": yaml(aliases(8)),
    r"a\.yaml: expected at most 1000000 values, found more by aliases$": yaml("a: &a [*a]"),
    r"slalom: expected the code that the sweep began with, found other code": lambda _: run_case(
        Run("empty", {}, "nao", 0, {"sources": "none"})
    ),
    r"a\.csv: expected the files that the sweep began with, found others": lambda folder: run_case(
        Run(str(written("a.csv", CADRL)(folder)), {}, "nao", 0, {"sources": SOURCES_NOW, "scenario": OTHER_FILES})
    ),
    r"a\.yaml: expected the files that the sweep began with, found others": edited_scene,
    r"expected the result that the present code gives for .*, found another, so no run .*: refused": lambda folder: (
        _refuse_another(A_RUN, _Former(folder, "slalom run 2", {}, {}), Failure("refused"))
    ),
    r"\.json: expected a file that can be written, found no such file or folder$": lambda folder: Store(
        folder / "none"
    ).write(A_RUN, {}),
    r"\.json: expected the result of a finished run, found 1 bytes that are not JSON; delete it": lambda folder: Store(
        written(f"{A_RUN.key}.json", "{")(folder).parent
    ).read([A_RUN]),
    r"a\.yaml:1:\d+: seedz: expected one of title, .*; found 'seedz'; did you mean 'seeds'": reading(
        read_study, "a.yaml", "{scenarios: [{scenario: empty}],    seedz: 3}"
    ),
    r"a\.yaml:1:\d+: scenarios\.0\.scenario: expected a \.yaml file or one of empty, .*; found 'full'": reading(
        read_study, "a.yaml", "scenarios: [{scenario: full}]"
    ),
    r"a\.h5: .*found format: expected 'slalom recording 3', found 'something else'": foreign_hdf5,
    r"a\.h5: expected .*, found ": empty_recording,
    r"a\.h5: expected an HDF5 recording, found ": reading(Recording.load, "a.h5", "text"),
    r"robot\.goal: expected one of position, trajectory, path, found none": reading(
        read_scenario, "a.yaml", MINIMAL.replace("GOAL", "stop: true")
    ),
    r"a\.yaml:.*: robot\.goal: expected one to pass .* found one at rest with stop=True": reading(
        read_scenario,
        "a.yaml",
        MINIMAL.replace("GOAL", "position: [9, 0], stop: true").replace(
            "max_speed", "bounds: [{kind: least_speed, least: 1}], max_speed"
        ),
    ),
    r"a\.yaml: expected a readable YAML file, found ": reading(read_scenario, "a.yaml", b"\xff\xfe\x00"),
    r"a\.yaml:1:\d+: expected YAML, found a mistake": reading(read_scenario, "a.yaml", "a: [1"),
    r"a\.yaml: expected YAML, found .*special characters": reading(read_scenario, "a.yaml", "a: \x07"),
    r"a\.yaml:1:103: expected values at most 100 deep in each other": reading(
        read_scenario, "a.yaml", "a: " + "[" * 3000
    ),
    r"a\.yaml:1:1: robots: expected either this key or robot, found neither": reading(
        read_scenario, "a.yaml", "name: x"
    ),
    r"robot\.goal: expected one of": reading(read_scenario, "a.yaml", MINIMAL.replace("GOAL", "tolerance: 1")),
    r"lone\.json: expected the other tables of nuScenes beside it, found no sample\.json, .*": lambda folder: (
        (folder / "alone").mkdir(exist_ok=True),
        (folder / "alone" / "lone.json").write_text('[{"sample_token": 1, "instance_token": 2}]'),
        read_recording(folder / "alone" / "lone.json"),
    ),
    r"sample_annotation\.json: expected records of nuScenes, found none of 'translation'": nuscenes(),
    r"sample\.json: expected JSON, found ": nuscenes(sample="["),
    r"sample\.json: expected a list of records, found dict": nuscenes(sample="{}"),
    r"sample\.json: expected records with a token, found others": nuscenes(sample="[3]"),
    r"a\.csv: expected a text of at most 0 MB, found more": packed_too_much,
    r"walls\.sqlite: geometry: expected areas in WKT, found ": database_of_walls("POLYGON"),
    r"walls\.sqlite: geometry: expected areas in WKT, found 'POINT \(0 0\)'": database_of_walls("POINT (0 0)"),
    r"a\.csv:1: expected a header with case,agent,.*, found 'case'": reading(read_cases, "a.csv", "case\n0\n"),
    r"archive\.h5: wkt_geometry: expected areas in WKT, found ": archive(wkt="POLYGON"),
    r"archive\.h5: wkt_geometry: expected areas in WKT, found array\(5": archive(wkt=5),
    r"archive\.h5: expected records `trajectory` with .*, found fps: expected it in the file": archive(fps=None),
    r"archive\.h5: expected records `trajectory` with .*, found fps: expected a number above 0": archive(fps=0.0),
    r"archive\.h5: expected records `trajectory` with .*, found y: expected it in the file": archive(
        fields="id frame x"
    ),
    r"square\.h5: expected records .*, found trajectory: expected a list, found shapes \[\(4, 4\)": square_archive,
    r"run\.h5: expected a recording, found a run of slalom, which is over: `slalom show`": run_as_recording,
    r"silent\.sqlite: metadata: expected version 1 or 2 and fps above 0, found 2 and none": silent_database,
    r"none\.csv: expected a readable file, found ": lambda folder: read_recording(folder / "none.csv"),
    r"endless\.sqlite: expected at most .* rows in a file of .* bytes, found more": endless_database,
    r"pipe\.csv: expected a readable file, found a pipe": lambda folder: (
        os.mkfifo(folder / "pipe.csv"),
        format_of(folder / "pipe.csv"),
    ),
    r"a\.csv: expected a file of at most 1000 MB, found 2000 MB": reading(
        lambda path: (os.truncate(path, 2 * 10**9), format_of(path)), "a.csv", ""
    ),
    r"a\.csv: expected a readable file, found Permission denied": forbidden_file,
    r"a\.csv: expected at most 1 rows, found 3 lines": long_table,
    r"a\.xml: expected at most 1 rows, found more": long_scenario,
    r"none.a\.csv: expected a file that can be written, found ": lambda folder: write_recording(
        folder / "none" / "a.csv", RecordedTracks({"1": Agent(Sampled([0, 1], np.eye(2)))}), "csv"
    ),
    r"a\.yaml:1:8: cases: expected at least 1 entries, found 0": reading(read_scenario, "a.yaml", "cases: []"),
    r"a\.yaml:1:9: cases\.0: expected a mapping, found 3": reading(read_scenario, "a.yaml", "cases: [3]"),
    r"a\.yaml:1:9: cases: expected a list, found 3": reading(read_scenario, "a.yaml", "cases:  3"),
    r"a\.yaml: expected a scenario, found a study, which `slalom compare` runs": reading(
        read_scenario, "a.yaml", "scenarios: [{scenario: empty}]\n"
    ),
    r"expected a file that can be written, found ": lambda folder: (
        (folder / "folder.h5").mkdir(exist_ok=True),
        command("run", "empty", "--set", "duration=0.1", "--out", "{}/folder.h5")(folder),
    ),
    r"a\.csv: expected a file that can be written, found ": lambda folder: write_table(
        simulate(load("empty", {"duration": 0.1}), METHODS["nao"]), folder / "none" / "a.csv"
    ),
    r"none.a\.h5: expected a file that can be written, found no such file or folder": lambda folder: simulate(
        build("empty", {"duration": 0.1}), METHODS["nao"]
    ).save(folder / "none" / "a.h5"),
    r"a\.h5: expected a file that can be written, found no permission": without_permission,
    r"stdout: expected output that can be written, found no space left": on_a_full_disk,
    **{
        rf"a\.yaml:1:11: expected a value that can be read, found {found}": yaml(f"duration: {text}")
        for text, found in VALUES
    },
    **{
        rf"a\.h5: expected an HDF5 recording, found {said}": partial(read_with, program)
        for program, said in (
            ("while True: pass", "one on which reading takes more than .* s( of processor time)?$"),
            ("import time; time.sleep(1e3)", "one on which reading takes more than .* s$"),
            ("import os; os.abort()", "one on which the library that reads it crashes"),
        )
    },
    **{
        message: reading(partial(read_recording, **settings), name, content)
        for message, (name, content, settings) in RECORDINGS.items()
    },
}

EXTRAS: dict[str, Callable[[Path], object]] = {
    r"method: expected the packages of `pip install 'slalom\[peers\]'`, found no nowhere$": lambda _: (
        peers.crowd.imported("nowhere")
    ),
    r"crowdnav: expected the packages of `pip install 'slalom\[peers\]'`, found no pyrvo$": without_pyrvo,
    r"numpy\.pandas: expected the packages of `pip install 'slalom\[data\]'`, found no numpy\.pandas": lambda _: (
        _imported("numpy.pandas")
    ),
    r"^here: .*slalom\[sim\]'`, found no h5py$": without_recordings,
    **WITHOUT_EXTRAS,
}
IN_CHILD = (
    *("deep groups", "a loop of links", "a type", "an array twice"),
    *("values of a device", "no value", "empty terabytes", "other values"),
)
"""Changes of a recording that the process which reads it refuses in each of its ways."""
OF_CURVES = NotImplementedError if shapely.geos_version >= (3, 13) else walls_child.Refused
"""What shapely, or the reader, raises for curves in WKT, which GEOS reads since 3.13."""
OTHERS = [
    Case(IndexError, r"index: expected a number below 1", lambda _: ObstacleWindow([ROCK], 0.0, 5.0).obstacle(1)),
    Case(
        PydanticKnownError, r"should be a valid dictionary", lambda _: OfAnyKind(slalom.model.shape.SHAPES).validate(7)
    ),
    Case(
        PydanticKnownError,
        r"Unable to extract tag using discriminator 'kind'",
        lambda _: OfAnyKind(slalom.model.shape.SHAPES).validate({"radius": 1.0}),
    ),
    Case(
        PydanticKnownError,
        r"Input tag 'egg' found using 'kind'",
        lambda _: OfAnyKind(slalom.model.shape.SHAPES).validate({"kind": "egg"}),
    ),
    Case(
        TypeError,
        r"SimpleSpan\.path: expected an annotation that files can hold, found ",
        lambda _: model_of_part("span", SimpleSpan),
    ),
    Case(InvalidFile, r"expected a file that can be written, found a folder", lambda tmp: write_agents([], tmp)),
    Case(AttributeError, r"initial_position", lambda _: Stationary.initial_position),
    Case(
        OutsideSpan,
        "t: expected a time from 0 s on, found -1 s",
        lambda _: AvoidingCrowd(0.25).predict(Tracks([(1, 0)], [(0, 0)], 0.3))[0].trajectory.position(-1.0),
    ),
    Case(
        OutsideSpan,
        r"expected a time from 0 to 1 s, found -0.5 s",
        lambda _: Sampled([0, 1], np.zeros((2, 2))).position(-0.5),
    ),
    Case(
        OutsideSpan,
        r"expected a time from 0 to 1 s, found 1.5 s",
        lambda _: Sampled([0, 1], np.zeros((2, 2))).velocity([0.5, 1.5]),
    ),
    Case(OutsideSpan, r"found 9 s", lambda _: Sampled([0, 1], np.zeros((2, 2))).acceleration(9)),
    Case(
        OutsideSpan,
        r"expected a time from 2 to 3 s, found 3.5 s",
        lambda _: PiecewisePolynomial([1], [[(0, 0)]], 2).velocity(3.5),
    ),
    Case(
        OutsideSpan,
        r"expected a time from 0 to 1 s, found 1.5 s",
        lambda _: Function(lambda t: [t, 0.0], 1, 1, 0, 1).position([0.5, 1.5]),
    ),
    Case(
        AttributeError,
        r"'RunSummary' object has no attribute 'nothing'",
        lambda _: simulate(load("empty", {"duration": 0.2}), METHODS["nao"], record=False).nothing,
    ),
    Case(Refused, "content far larger than the file", lambda folder: read_here(changed("a period", folder), 20)),
    Case(
        CoercionError,
        r"Invalid value for --seed: expected a whole number, found '1\.5'",
        command("run", "empty", "--seed", "1.5"),
    ),
    *(
        Case(InvalidFile, rf"a\.h5: .*{said}", lambda f, what=what: Recording.load(changed(what, f)))
        for what, (_, said) in OF_RECORDING.items()
    ),
    *(
        Case(
            OF_CURVES if "linear" in said else walls_child.Refused,
            said,
            partial(read_wall_here, name=name, content=content),
        )
        for said, (name, content) in REFUSED_WALLS.items()
    ),
    Case(walls_child.Refused, "2 points, more than 1", with_fewer_points),
    Case(walls_child.Refused, "another file", reading(image_here, "map.png", "a wall")),
    Case(Refused, "a file of another kind", reading(partial(read, most=9, depth=9), "a.h5", "a wall")),
    Case(Refused, "No such file", lambda folder: read(folder / "none.h5", 9, 9)),
    *(
        Case(walls_child.Refused, said, partial(read_image, pixels, image_here))
        for said, pixels in REFUSED_IMAGES.items()
    ),
    *(
        Case(Refused, OF_LIBRARY[what][1], lambda folder, what=what: read_here(changed(what, folder)))
        for what in IN_CHILD
    ),
]
OF_SEVERAL_CALLS: dict[str, list[Callable[[Path], object]]] = {
    **SEVERAL,
    r"rule: expected a forecast from the observed state, found (Known|Present)\(\)": [
        lambda _: FromPast(Known()),
        lambda _: FromPast(Present()),
    ],
    r"corners: expected those of a convex polygon around 0, counter-clockwise, .* found": [
        lambda _: ConvexPolygon(((1, 0), (0, -1), (-1, 1))),  # clockwise
        lambda _: ConvexPolygon(((1, 0), (2, 0), (1, 1))),  # 0 outside
        lambda _: ConvexPolygon(((2, 0), (0.1, 0.1), (0, 2), (-1, -1))),  # a dent
        lambda _: ConvexPolygon(((1, 0), (1, 0), (0, 1), (-1, -1))),  # a corner twice
        lambda _: ConvexPolygon([(np.cos(a), np.sin(a)) for a in 0.8 * np.pi * np.arange(5)]),  # a star
    ],
}
"""Several calls with the same message."""
CASES = [
    *(
        Case(error, message, call)
        for error, table in (
            (InvalidInput, REFUSED | REFUSALS | OF_GRIDS | OF_WALL_UNITS | REFUSED_TASKS),
            (InvalidFile, FILES | BAGS | OF_MAPS | OF_WALL_FILES),
            (MissingExtra, EXTRAS),
        )
        for message, call in table.items()
    ),
    Case(InvalidFile, r"tasks: expected times, and robots from -1 to 1, found others", other_robot),
    *(Case(InvalidInput, message, call) for message, calls in OF_SEVERAL_CALLS.items() for call in calls),
    *OTHERS,
]


class Place(NamedTuple):
    """A line of the library."""

    where: str
    file: Path
    line: int


def place_of(error: BaseException) -> Place:
    """The library's innermost frame below the error."""
    found, trace = Place("", SOURCES, 0), error.__traceback__
    while trace is not None:
        file = Path(trace.tb_frame.f_code.co_filename)
        if file.is_relative_to(SOURCES):
            found = Place(trace.tb_frame.f_code.co_qualname, file, trace.tb_lineno)
        trace = trace.tb_next
    return found


def raised_along(error: BaseException | None) -> list[Place]:
    """Where the error was raised, and the errors that led to it."""
    places = []
    while error is not None:
        places.append(place_of(error))
        error = error.__context__
    return places


@pytest.mark.parametrize("case", CASES, ids=str)
def test_refused(case: Case, tmp_path: Path) -> None:
    with pytest.raises(case.error) as caught:
        case.call(tmp_path)
    assert type(caught.value) is case.error
    assert re.search(case.message, str(caught.value)), str(caught.value)
    assert "\n" not in str(caught.value)


class Raise(NamedTuple):
    """A `raise` statement of the library."""

    where: str
    file: Path
    first: int
    last: int

    def __str__(self) -> str:
        return f"{self.file.relative_to(SOURCES)}:{self.first} in {self.where}"

    def holds(self, place: Place) -> bool:
        """Whether a line belongs to the statement."""
        return place.file == self.file and self.first <= place.line <= self.last


@cache
def raises() -> tuple[Raise, ...]:
    """Every `raise` of the sources."""
    found = []

    def visit(node: ast.AST, file: Path, names: tuple[str, ...]) -> None:
        for child in ast.iter_child_nodes(node):
            inner = names
            if isinstance(child, ast.ClassDef | ast.FunctionDef):
                inner = (*names, child.name)
            # A stored error was raised elsewhere first.
            if isinstance(child, ast.Raise) and not isinstance(child.exc, ast.Attribute):
                found.append(Raise(".".join(names), file, child.lineno, child.end_lineno or child.lineno))
            visit(child, file, inner)

    for path in sorted(SOURCES.rglob("*.py")):
        visit(ast.parse(path.read_text()), path, ())
    return tuple(found)


@pytest.mark.slow
def test_every_raise_is_reached(tmp_path: Path) -> None:
    """A new `raise` needs a case above."""
    reached = []
    for case in CASES:
        try:
            case.call(tmp_path)
        except Exception as error:
            reached += raised_along(error)
    assert len(raises()) > 40
    assert [str(r) for r in raises() if not any(r.holds(place) for place in reached)] == []


def test_errors_have_one_base() -> None:
    assert issubclass(InvalidInput, SlalomError)
    assert issubclass(InvalidInput, ValueError)
    assert issubclass(OutsideSpan, SlalomError)
    assert issubclass(InvalidFile, SlalomError)
    error = InvalidFile(["a:1:1: x", "a:2:1: y"])
    sent = pickle.loads(pickle.dumps(error))
    assert str(error).splitlines() == error.mistakes == ["a:1:1: x", "a:2:1: y"]
    assert (type(sent), str(sent), sent.mistakes) == (InvalidFile, str(error), error.mistakes)


def test_inputs_are_copied_and_held_read_only() -> None:
    """What the caller does to an array afterwards changes nothing, and what is held is read-only."""
    mine = np.array([1.0, 2.0])
    state, track = State(mine, mine), ConstantVelocity(mine, mine)
    mine[:] = 9.0
    for held in (state.position, state.velocity, track.initial_position, track.initial_velocity):
        assert held.tolist() == [1.0, 2.0]
        with pytest.raises(ValueError, match="read-only"):
            held[0] = 5.0


def test_short_names_the_first_values() -> None:
    assert checks.short(np.arange(7.0)) == "[0, 1, 2, 3, 4, 5, ...]"
    assert checks.short(np.arange(2.0)) == "[0, 1]"


def test_gallery_checks_names_before_it_builds() -> None:
    """An unknown parameter is refused for every scenario, by its name."""
    for name in gallery.GALLERY:
        with pytest.raises(InvalidInput, match=rf"parameter of {name}: .*found 'nonsense'"):
            partial(build, name)({"nonsense": 1.0})
