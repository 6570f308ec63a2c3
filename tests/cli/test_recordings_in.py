"""A robot in a recording, from the command line: any format in, runs and recordings out, and what is said of them."""

import json
import re
from dataclasses import fields, replace
from inspect import signature
from pathlib import Path

import numpy as np
import pytest
from commands import Say, saying
from draws import draws
from recording_formats import RECORDED, SAMPLES, WALK, recorded, write_hdf5

from slalom import (
    FORESIGHTS,
    METHODS,
    Ball,
    Circular,
    Disc,
    InvalidInput,
    Limits,
    Obstacle,
    Rectangle,
    State,
    Stationary,
    method,
)
from slalom.cli.options import Crossing, Reading
from slalom.cli.running import RECORDING_METHOD
from slalom.io.formats import FORMATS, format_of_suffix, read_recording, write_recording
from slalom.io.recorded import Agent, RecordedTracks
from slalom.io.table import sample_data
from slalom.model.goal import Goal
from slalom.model.trajectory import Sampled
from slalom.sim import Recording, Robot, Scenario, load, simulate
from slalom.sim.files.recorded_traffic import RADII, AgentSelection, crossing, read_recorded
from slalom.sim.files.scenario_yaml import files_of
from slalom.sim.measure.export_tracks import as_tracks
from slalom.sim.measure.metrics import summary
from slalom.sim.scenario import SETTINGS
from slalom.sim.sweep.case import digests_of

PEOPLE = "t,id,x,y\n" + "".join(
    f"{k / 10!r},{agent},{x + k * vx / 10!r},{y + k * vy / 10!r}\n"
    for agent, first, x, y, vx, vy in ((4, 0, 0, 3, 0.2, -1), (5, 10, 3, -6, 0, 1.1), (9, 30, 9, 0.3, -1, 0))
    for k in range(first, 200)
)
"""Three people that walk straight on until 19.9 s, from 0, 1 and 3 s on."""
WAY = ("--start=-4,0", "--goal", "8,0")


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Say:
    """Run a command in a folder with a recording in it."""
    (tmp_path / "people.csv").write_text(PEOPLE)
    monkeypatch.chdir(tmp_path)
    return saying(capsys)


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_run(name: str, say: Say, tmp_path: Path) -> None:
    """The tracks of the file are the obstacles; what is assumed of them is said on stderr, and nothing else."""
    sample = SAMPLES[name]
    sample.write(tmp_path / sample.name, WALK)
    tracks = read_recording(tmp_path / sample.name, **sample.needed)
    axes = next(iter(tracks.agents.values())).trajectory.dimension
    start, goal = (",".join(["-90", "-90", "0"][:axes]), ",".join(["90", "-90", "0"][:axes]))
    said = say(
        "run",
        sample.name,
        f"--start={start}",
        f"--goal={goal}",
        "--duration",
        0.7,
        "--out",
        "run.h5",
        "--json",
        *sample.options,
    )
    assert (said.code, said.noted_json["arrived"], said.noted_json["method"]) == (1, 0, "nao_ahead")
    assert said.noted_json["scenario"] == Path(sample.name).stem
    run = Recording.load("run.h5")
    assert [o.name for o in run.obstacles] == [f"agent {label}" for label in tracks.agents]
    for obstacle, agent in zip(run.obstacles, tracks.agents.values(), strict=True):
        assert obstacle.trajectory.positions.tobytes() == agent.trajectory.positions.tobytes()
        assert obstacle.dimension == axes
    lines = said.err.splitlines()
    assert [line for line in lines if " size of " not in line] == [
        f"{sample.name}: {note}" for note in (tracks.summary(), *tracks.notes)
    ]
    assert run.times[0] == min(agent.trajectory.span[0] for agent in tracks.agents.values())


def test_it_is_the_scenario_that_it_says(say: Say, tmp_path: Path) -> None:
    """With every option: the run is that of a scenario made by hand."""
    tokens = [
        *("--start=-4,0.5", "--goal", "8,-0.25", "--start-velocity", "0.5,-0.125", "--at", 2.5, "--duration", 9),
        *("--robot-radius", 0.4, "--speed", 1.5, "--acceleration", 1.25, "--tolerance", 0.75),
        *("--agent-radius", 0.35, "--without", "4", "--interpolation", "linear"),
        *("--set", "margin=0.1", "replan=0.2", "--foresight", "present", "--method", "nao"),
    ]
    said = say("run", "people.csv", *tokens, "--out", "run.h5", "--json")
    tracks = read_recording("people.csv", interpolation="linear").agents
    state, goal = State((-4.0, 0.5), (0.5, -0.125)), Goal(Stationary((8.0, -0.25)), 0.75)
    by_hand = Scenario(
        "people",
        (Robot(Disc(0.4), Limits(1.5, 1.25), state, goal),),
        tuple(Obstacle(Disc(0.35), tracks[label].trajectory, f"agent {label}") for label in ("5", "9")),
        start=2.5,
        duration=9.0,
        margin=0.1,
        replan=0.2,
    )
    run = simulate(by_hand, method("nao@present"))
    assert Recording.load("run.h5").digest() == run.digest()
    found = said.noted_json
    assert {**found, "decision_us": 0} == {**summary(run), "decision_us": 0}
    assert (found["method"], found["foresight"]) == ("nao@present", "present")
    assert said.code == (0 if found["arrived"] and not found["collisions"] else 1)


def test_what_is_not_said_is_as_the_help_tells(say: Say) -> None:
    """The defaults that `--help` names are those of the function, and the kinds those of the table."""
    text = " ".join(say("run", "--help").out.replace("│", " ").split())
    usual = {p.name: p.default for p in signature(crossing).parameters.values()}
    for option, name in (("tolerance", "tolerance"), ("robot-radius", "radius"), ("speed", "max_speed")):
        assert re.search(rf"--{option} FLOAT [^-]*by default {usual[name]:g}\.", text), option
    assert re.search(rf"--acceleration FLOAT [^-]*by default {usual['max_acceleration']:g}\.", text)
    kinds = text[text.index("--agent-radius") :]
    assert all(re.search(rf"\b{radius:g} [a-z, ]*?{re.escape(kind)[:-1]}", kinds) for kind, radius in RADII.items())
    assert all(name in text for name in FORESIGHTS)
    assert RECORDING_METHOD in text
    run = simulate(crossing(read_recorded("people.csv"), (-4, 0), (8, 0), at=1.0), METHODS[RECORDING_METHOD])
    said = say("run", "people.csv", *WAY, "--at", 1, "--out", "run.h5")
    assert said.code == 0
    assert Recording.load("run.h5").digest() == run.digest()
    assert said.out.startswith("people with nao_ahead, seed 0: arrived, no collision\n  foresight          recorded: ")


def test_a_run_lasts_as_long_as_the_recording(say: Say) -> None:
    """If nothing else is said, but no longer than a minute; a longer one is asked for, and said."""
    found = read_recorded("people.csv")
    assert found.span == (0.0, 19.9)
    assert crossing(found, (0, 0), (9, 9), at=15.0).duration == pytest.approx(4.9)
    long = replace(found, span=(0.0, 600.0))
    assert crossing(long, (0, 0), (9, 9)).duration == 60.0
    far = ("--start", "0,-50", "--goal", "90,-50", "--at", 18)
    said = say("run", "people.csv", *far, "--json")
    assert "ends" not in said.err
    assert said.noted_json["time"] == pytest.approx(1.9)
    said = say("run", "people.csv", *far, "--duration", 4)
    assert "people: the used part of the recording ends at 19.9 s, before the end of the run at 22 s" in said.err


SIZES = """\
t,id,x,y,radius,length,width,kind
0,1,0,0,0.7,4,3,car
1,1,1,0,,,,
0,2,0,1,,4,3,car
1,2,1,1,,4,3,car
0,3,0,2,,,,Truck
1,3,1,2,,,,Truck
0,4,0,3,,,,VEHICLE
1,4,1,3,,,,VEHICLE
0,5,0,4,,30,,van
1,5,1,4,,30,,van
"""


def test_how_large_agents_are(tmp_path: Path) -> None:
    """Its own radius; else the one given; else half the diagonal; else that of its kind, and this is said."""
    path = tmp_path / "sizes.csv"
    path.write_text(SIZES)
    found = read_recorded(path)
    assert [o.shape for o in found.obstacles] == [Disc(r) for r in (0.7, 2.5, RADII["truck"], RADII["car"], 15.0)]
    assert found.notes[1:] == (
        "sizes.csv: size of agent 3 not known: radius 6.2 m, as of a truck",
        "sizes.csv: size of agent 4 not known: radius 2.4 m, as of a car",
        "sizes.csv: size of agent 5 not known: radius 15 m, as of a van",
    )
    given = read_recorded(path, AgentSelection(radius=0.5))
    assert [o.shape for o in given.obstacles] == [Disc(r) for r in (0.7, 0.5, 0.5, 0.5, 0.5)]
    assert given.notes[1:] == ("sizes.csv: radius of agent 1 as in the file, not the 0.5 m given",)
    assert read_recorded(path, AgentSelection(radius=0.7, agents=["1", "2"])).notes[1:] == ()
    path.write_text(SIZES.replace("VEHICLE", "unicorn"))
    with pytest.raises(
        InvalidInput, match=r"agent 4: expected a kind of pedestrian, .*, or --agent-radius; found 'unicorn'"
    ):
        read_recorded(path)
    assert read_recorded(path, AgentSelection(radius=0.5)).obstacles[3].shape == Disc(0.5)
    space = tmp_path / "space.csv"
    space.write_text("t,id,x,y,z\n0,1,0,0,0\n1,1,1,0,0\n")
    (drone,) = read_recorded(space).obstacles
    assert drone.shape == Ball(RADII["drone"])


OF_RECORDINGS_ONLY = [*(item.name for options in (Crossing, Reading) for item in fields(options))]
VALUES = {
    "interpolation": "linear",
    "unit": "cm",
    "columns": "id=a",
    "keep": "last",
    "start": "1,1",
    "goal": "-1,1",
    "origin": "1,1",
}


@pytest.mark.parametrize("name", OF_RECORDINGS_ONLY)
@pytest.mark.parametrize("scenario", ["empty", "scene.yaml"])
def test_options_of_recordings_are_refused_elsewhere(name: str, scenario: str, say: Say) -> None:
    option = f"--{name.replace('_', '-')}"
    said = say("run", scenario, option, VALUES.get(name, "1"))
    assert (said.code, said.out) == (2, "")
    assert said.err == f"{option}: expected only with a recording, found it with {scenario!r}\n"


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        ("", "--start: expected X,Y[,Z] [m] for a robot in people.csv, found none"),
        ("--start 0,0", "--goal: expected X,Y[,Z] [m] for a robot in people.csv, found none"),
        ("--start 0,0,0 --goal 9,9", "start: expected 2 numbers, found [0, 0, 0] of shape (3,)"),
        ("--start 0,0 --goal 9,9 --start-velocity 1,1,1", "start velocity: expected 2 numbers, found [1, 1, 1] "),
        ("--start 0,0 --goal 9,9 --at 19.9", "at: expected a time of people, from 0 to before 19.9 s, found 19.9 s"),
        ("--start 0,0 --goal 9,9 --agents 4,7", "agents: expected ids of people.csv, agents 4, 5, 9; found '7'"),
        ("--start 0,0 --goal 9,9 --set start=3", "--set start: expected --at with a recording, found 3"),
        ("--start 0,0 --goal 9,9 --jump-speed 0.5", "people.csv:3: expected agent 4 no faster than 0.5 m/s, found 1.0"),
        ("--start 0,0 --goal 9,9 --out a.txt", "--out: expected a file that ends in .h5, "),
    ],
)
def test_what_does_not_fit_a_recording(tokens: str, message: str, say: Say) -> None:
    said = say("run", "people.csv", *tokens.split())
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith(message)
    assert len(list(Path().iterdir())) == 1


def test_repairs_are_said_on_stderr(say: Say) -> None:
    """Also of a scenario file that names the recording, by every command, and results stay on stdout."""
    Path("people.csv").write_text(PEOPLE + "0.0,4,0.0,3.0\n5.0,77,0,0\n")
    notes = [
        f"people.csv: {read_recording('people.csv').summary()}",
        "people.csv: 1 duplicate row of agent 4 dropped: identical time and position",
        "people.csv: 1 row of agent 4 out of order: sorted by time",
        "people.csv: 1 track with a single row left out: id 77",
    ]
    said = say("run", "people.csv", *WAY, "--agent-radius", 0.25, "--json")
    assert said.noted_json["arrived"] == 1
    assert sorted(said.err.splitlines()) == sorted(notes)
    Path("scene.yaml").write_text(
        "robot: {position: [-4, 0], radius: 0.3, max_speed: 1.6, max_acceleration: 1.5, goal: {position: [8, 0]}}\n"
        "recording: {file: people.csv, radius: 0.25, window: [0, 19.9]}\n"
    )
    for command in (["run"], ["decide"], ["compare", "--methods", "nao,nao_ahead@observed", "--seeds", "1"]):
        said = say(command[0], "scene.yaml", *command[1:], "--json")
        assert said.code == 0
        assert said.noted_json
        assert sorted(said.err.splitlines()) == sorted(notes)


def test_a_scenario_file_is_the_same_run(say: Say) -> None:
    """As the options of the command, in YAML."""
    Path("scene.yaml").write_text(
        "robot: {position: [-4, 0], radius: 0.3, max_speed: 1.6, max_acceleration: 1.5, goal: {position: [8, 0]}}\n"
        "recording: {file: people.csv, without: [4], window: [2, 19.9]}\n"
    )
    one = say("run", "people.csv", *WAY, "--at", 2, "--without", "4", "--method", "nao@observed", "--out", "one.h5")
    two = say("run", "scene.yaml", "--method", "nao@observed", "--out", "two.h5")
    assert (one.code, one.err) == (two.code, two.err)
    runs = [Recording.load(name) for name in ("one.h5", "two.h5")]
    for name in ("positions", "velocities", "accelerations", "controls", "times", "arrived"):
        assert getattr(runs[0], name).tobytes() == getattr(runs[1], name).tobytes(), name


def test_a_sweep_depends_on_every_file_that_is_read(say: Say, tmp_path: Path) -> None:
    """Drone data sets keep frame rate and classes beside the tracks."""
    sample = SAMPLES["drone"]
    sample.write(tmp_path / sample.name, WALK)
    Path("07_tracksMeta.csv").write_text("trackId,class\n7,pedestrian\n3,bicycle\n12,car\n")
    robot = "robot: {position: [0, -90], radius: 1, max_speed: 2, max_acceleration: 1, goal: {position: [9, -90]}}\n"
    Path("scene.yaml").write_text(robot + f"recording: {{file: {sample.name}}}\n")
    names = [path.name for path in files_of(Path("scene.yaml"))]
    assert names == ["scene.yaml", "07_tracks.csv", "07_recordingMeta.csv", "07_tracksMeta.csv"]
    before = digests_of("scene.yaml")
    Path("07_tracksMeta.csv").write_text("trackId,class\n7,pedestrian\n3,bicycle\n12,bus\n")
    assert [a == b for a, b in zip(before, digests_of("scene.yaml"))] == [True, True, True, False]


@pytest.mark.parametrize("suffix", format_of_suffix())
def test_a_run_is_written_as_a_recording(suffix: str, say: Say) -> None:
    """Positions of the robot and of the people at the steps, to the bit; ids are kept."""
    tokens = ("run", "people.csv", *WAY, "--at", 1.7, "--without", "5")
    assert say(*tokens, "--out", "run.h5").code == 0
    said = say(*tokens, "--out", f"run{suffix}")
    assert f"run{suffix}: ids: robot is 10" in said.err
    run, read = Recording.load("run.h5"), read_recording(f"run{suffix}")
    assert read.format == format_of_suffix()[suffix]
    assert not read.notes
    first = 0.0 if "frame_rate" in signature(FORMATS[read.format].writer).parameters else 1.7
    np.testing.assert_allclose(read.agents["10"].trajectory.times, run.times - 1.7 + first, rtol=0, atol=1e-9)
    assert read.agents["10"].trajectory.positions.tobytes() == run.positions[:, 0].tobytes()
    assert list(read.agents) == ["4", "9", "10"]
    for obstacle in run.obstacles:
        track = read.agents[obstacle.name.removeprefix("agent ")].trajectory
        there = np.array([obstacle.exists(t) for t in run.times])
        assert len(track.times) == there.sum()
        assert track.positions.tobytes() == obstacle.trajectory.position(run.times[there]).tobytes()
    if suffix == ".csv":
        assert {label: (agent.radius, agent.kind) for label, agent in read.agents.items()} == {
            "4": (0.25, ""),
            "9": (0.25, ""),
            "10": (0.3, "robot"),
        }


def test_obstacles_of_any_scenario_as_tracks() -> None:
    """Round ones and rectangles with their sizes; others at rest are walls; those that never exist are left out."""
    robot = Robot(Disc(0.5), Limits(2, 1), State((0, 0), (0, 0)), Goal(Stationary((30, 0)), 0.5))
    obstacles = (
        Obstacle(Disc(1.0), Circular((0, 30), 5.0, 2.0), "car"),
        Obstacle(Rectangle(4.0, 2.0, 0.25), Stationary((9, 9)), "agent 12"),
        Obstacle(Disc(0.2), Sampled([8.0, 9.0], [(9, 9), (9, 8)]), "agent 13"),
        Obstacle(load("corridor").obstacles[0].shape, Stationary((0, 40)), "walls"),
        Obstacle(Disc(0.2), Stationary((-9, 9)), "agent X"),
        Obstacle(Disc(0.2), Sampled([0.0, 0.1], [(9, 20), (9, 21)]), "agent 12"),
    )
    run = simulate(Scenario("test", (robot,), obstacles, duration=2.0), METHODS["nao"])
    tracks = as_tracks(run)
    assert list(tracks.agents) == ["12", "13", "14", "15", "X"]
    assert tracks.notes == ("ids: car is 13, agent 12 is 14, robot is 15",)
    assert tracks.walls
    shown = {label: (a.radius, a.length, a.width, a.kind) for label, a in tracks.agents.items()}
    assert shown["12"] == (None, 4.5, 2.5, "")
    assert shown["13"] == (1.0, None, None, "")
    assert shown["15"] == (0.5, None, None, "robot")
    framed = as_tracks(run, frames=True)
    assert framed.notes[0] == "ids: car is 13, agent X is 14, agent 12 is 15, robot is 16"


def test_robots_that_have_left_are_not_written(say: Say) -> None:
    """Of several robots, each until it has arrived."""
    said = say("run", "circle", "--set", "robots=3", "--method", "nao_shared", "--out", "run.csv")
    assert "run.csv: ids: robot is 0, robot 1 is 1, robot 2 is 2" in said.err
    read = read_recording("run.csv")
    assert {agent.kind for agent in read.agents.values()} == {"robot"}
    assert {agent.radius for agent in read.agents.values()} == {1.5}


def test_runs_and_recordings_in_hdf5(say: Say, tmp_path: Path) -> None:
    """Their content distinguishes them; walls of a recording are written again, and a run is no recording."""
    area = "POLYGON ((-9 -9, 9 -9, 9 9, -9 9, -9 -9), (2 2, 3 2, 3 4, 2 2))"
    write_hdf5(tmp_path / "walk.h5", WALK, area)
    assert say("convert", "walk.h5", "walk.sqlite").code == 0
    (again,) = [wall for wall in read_recording("walk.sqlite").walls if len(wall) == 4]
    assert abs(again - read_recording("walk.h5").walls[1]).max() < 0.1
    said = say("run", "walk.h5", "--start=-5,-5", "--goal=-5,-3", "--out", "run.h5")
    assert said.code == 1  # the recording lasts 0.88 s
    assert "2 walls" in said.err
    assert say("convert", "run.h5", "run.csv").code == 0
    refused = say("run", "run.h5")
    assert "found the run 'run.h5', which is over" in refused.err
    assert say("convert", "walk.h5", "agents.csv", "--per-agent").code == 0


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("suffix", format_of_suffix())
def test_conversion(name: str, suffix: str, say: Say, tmp_path: Path) -> None:
    """Every format to every one that is written: places to the bit, times as near as frames are."""
    sample = SAMPLES[name]
    sample.write(tmp_path / sample.name, WALK)
    source = read_recording(tmp_path / sample.name, **sample.needed)
    said = say("convert", sample.name, f"out{suffix}", "--json", *sample.options)
    if next(iter(source.agents.values())).trajectory.dimension == 3 and suffix != ".csv":
        assert said.code == 2
        assert "expected positions in the plane, found dimension 3" in said.err
        return
    assert said.code == 0
    sized = any(agent.radius or agent.length or agent.kind for agent in source.agents.values())
    lost = ["sizes and kinds left out: files of frames cannot hold them"] if sized and suffix != ".csv" else []
    notes = [*source.notes, *lost]
    assert said.err.splitlines() == [f"{sample.name}: {note}" for note in (source.summary(), *notes)]
    assert said.noted_json == {
        "source": sample.name,
        "target": f"out{suffix}",
        "from": name,
        "to": format_of_suffix()[suffix],
        "agents": 3,
        "frame_rate": None if suffix == ".csv" else pytest.approx(1.0 / sample.tick, abs=1e-4),
        "notes": notes,
        "summary": source.summary(),
    }
    read = read_recording(f"out{suffix}")
    assert list(read.agents) == list(source.agents)
    for label, agent in source.agents.items():
        assert read.agents[label].trajectory.positions.tobytes() == agent.trajectory.positions.tobytes()
        np.testing.assert_allclose(read.agents[label].trajectory.times, agent.trajectory.times, rtol=1e-12, atol=1e-9)


def test_conversion_of_some_agents(say: Say, tmp_path: Path) -> None:
    """Only these, or without those; in parts; with ids that frames can number; as text for people."""
    write_recording(
        "a.csv", RecordedTracks({k: Agent(Sampled([0, 0.1, 5.0, 5.1], np.ones((4, 2)))) for k in "79Z"}), "csv"
    )
    said = say("convert", "a.csv", "b.ndjson", "--without", "9", "--gap", 1, "--out-frame-rate", 10)
    assert said.out == "a.csv (csv), 4 agents -> b.ndjson (trajnet)\n"
    assert "a.csv: ids: agent 7.1 is 8, agent Z is 9, agent Z.1 is 10\n" in said.err
    assert list(read_recording("b.ndjson").agents) == ["7", "8", "9", "10"]
    assert say("convert", "a.csv", "c.csv", "--agents", "Z,7").code == 0
    assert list(read_recording("c.csv").agents) == ["7", "Z"]
    for tokens, message in (
        (["a.csv", "d.xml"], "TARGET: expected a file that ends in .csv, .ndjson, .sqlite; found 'd.xml'"),
        (["none.csv", "d.csv"], "none.csv: expected a readable file"),
        (["a.csv", "d.csv", "--out-frame-rate", 5], "--out-frame-rate: expected only with a format with frame numbers"),
        (["a.csv", "d.ndjson", "--out-frame-rate", 3], "agent 7: expected different multiples of 1 / 3 s, found 0.1 s"),
        (["a.csv", tmp_path / "a.csv"], f"{tmp_path / 'a.csv'}: expected a file other than the source"),
        (["a.csv", "d.csv", "--agents", "8"], "agents: expected ids of a.csv, agents 7, 9, Z; found '8'"),
    ):
        said = say("convert", *tokens)
        assert said.code == 2
        assert said.err.startswith(message)


# Real recordings: the one that is shipped, and others where they are.


def judged(run: Recording, tracks: RecordedTracks, radii: dict[str, float], own: float) -> float:
    """The least clearance at 50 samples a second, agents in between their rows on straight lines: not our code."""
    times = np.arange(run.times[0], run.times[-1], 0.02)
    k = np.minimum(((times - run.times[0]) / run.dt).astype(int), len(run.accelerations) - 1)
    s = (times - run.times[k])[:, None]
    position = run.positions[k, 0] + s * run.velocities[k, 0] + 0.5 * s * s * run.accelerations[k, 0]
    least = np.inf
    for label, agent in tracks.agents.items():
        track = agent.trajectory
        there = (times >= track.times[0]) & (times <= track.times[-1])
        axes = [np.interp(times[there], track.times, track.positions[:, d]) for d in range(position.shape[1])]
        gap = np.linalg.norm(np.stack(axes, axis=1) - position[there], axis=1) - radii[label] - own
        least = min(least, float(gap.min(initial=np.inf)))
    return least


def test_the_recording_that_is_shipped(say: Say) -> None:
    """Thirty cars of 4.5 x 1.8 m, crossed; the same obstacles in a file of the other format."""
    source = sample_data("roundabout_ring_11.csv")
    tokens = ["--start=-58,0", "--goal", "58,0", "--robot-radius", 1, "--speed", 12, "--acceleration", 4]
    said = say("run", source, *tokens, "--at", 6.4, "--out", "run.h5", "--json")
    summary = "30 agents, 119.9 s from 0 to 119.9 s, extent 86.86 x 86.86 m, speed median 7.9 and largest 11.6 m/s"
    assert (said.code, said.err) == (0, f"roundabout_ring_11.csv: {summary}\n")
    assert said.noted_json["scenario"] == "roundabout_ring_11"
    run, tracks = Recording.load("run.h5"), read_recording(source)
    half = float(np.hypot(4.5, 1.8)) / 2
    assert {o.shape.radius for o in run.obstacles} == {half}
    assert judged(run, tracks, dict.fromkeys(tracks.agents, half), 1.0) > 0.0
    assert say("convert", source, "ring.sqlite").code == 0
    again = say("run", "ring.sqlite", *tokens, "--at", 6.4, "--agent-radius", half, "--out", "again.h5")
    assert again.code == 0
    assert Recording.load("again.h5").positions == pytest.approx(run.positions, abs=1e-6)


def test_the_example_of_a_scenario_file(say: Say) -> None:
    """Its window is the run; two cars are left out."""
    path = sample_data("recorded.yaml")
    scenario = load(str(path))
    assert (scenario.start, scenario.duration) == (6.4, pytest.approx(60.0))
    assert len(scenario.obstacles) == 28
    for command in ("run", "decide"):
        said = say(command, path, "--json")
        assert said.code == 0
        assert re.fullmatch(r"roundabout_ring_11\.csv: 30 agents, .*\n", said.err)


@recorded
@pytest.mark.parametrize("name", draws(["ucy_zara02", "crazyswarm_swap6v", "ngsim_us101_4_1", "roundabout_open_26"]))
def test_recorded_crossings(name: str, say: Say) -> None:
    """The first tasks of recordings of people, drones and cars: arrived in time, and clear by a judge of its own."""
    entry = json.loads((RECORDED / "tasks.json").read_text())[name]
    path = RECORDED / entry["file"]
    tracks = read_recording(path)
    size = entry["agent_radius"]
    radii = {
        label: size if isinstance(size, float) else 0.5 * float(np.hypot(agent.length or 0, agent.width or 0))
        for label, agent in tracks.agents.items()
    }
    for task in entry["tasks"][:2]:
        start, speed, goal = (",".join(map(repr, task[what])) for what in ("start", "start_velocity", "goal"))
        said = say(
            *("run", path, f"--start={start}", f"--goal={goal}", f"--start-velocity={speed}", "--at", task["t0"]),
            *("--duration", task["horizon"], "--tolerance", task["goal_tolerance"], "--speed", entry["vmax"]),
            *("--acceleration", entry["amax"], "--robot-radius", entry["robot_radius"], "--out", "run.h5", "--json"),
            *(["--agent-radius", size] if isinstance(size, float) else []),
        )
        assert said.code == 0, said
        run = Recording.load("run.h5")
        assert judged(run, tracks, radii, entry["robot_radius"]) > 0.0
        assert np.linalg.norm(run.positions[-1, 0] - task["goal"]) <= task["goal_tolerance"]
        assert (run.times[0], said.noted_json["foresight"]) == (task["t0"], "recorded")


@recorded
def test_a_commonroad_scenario_beside_its_csv(say: Say) -> None:
    """Cars on a motorway, run from the file as it was published."""
    path = RECORDED / "vehicles" / "USA_US101-4_1_T-1.xml"
    said = say(
        "run", path, "--start", "0,0", "--goal", "30,-28", "--speed", 15, "--acceleration", 5, "--at", 1, "--json"
    )
    assert said.noted_json["scenario"] == "USA_US101-4_1_T-1"
    assert said.noted_json["robots"] == 1


def test_settings_of_scenarios_hold_for_recordings(say: Say) -> None:
    """All of them but when and how long."""
    values = {"dt": 0.05, "replan": 0.1, "horizon": 4.0, "margin": 0.1, "patience": 0.2, "guided": 1.0}
    values |= {name: 0.0 for name in SETTINGS if name not in (*values, "start", "duration")}
    tokens = [f"{name}={value:g}" for name, value in values.items()]
    assert say("run", "people.csv", *WAY, "--set", *tokens, "--out", "run.h5").code == 0
    assert Recording.load("run.h5").dt == 0.05
