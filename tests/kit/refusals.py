"""Calls that views, adapters, vehicles and writers of files must refuse: where, the message, and the call."""

import socket
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
from ros_messages import OF_ADAPTERS, without_rosbags

from slalom import (
    METHODS,
    Acceleration,
    AccelerationSequence,
    AvoidingCrowd,
    Ball,
    Calibration,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    Driver,
    ExpectedLoss,
    Fleet,
    FollowVelocity,
    FromModels,
    Goal,
    Jerk,
    LeastSpeed,
    Limits,
    LookAhead,
    Navigator,
    Obstacle,
    ObstacleWindow,
    PathGoal,
    Reciprocity,
    Rectangle,
    Sight,
    State,
    Stationary,
    Tracker,
    Tracks,
    method,
)
from slalom.base.registry import Kind, Registry
from slalom.cli.options import WallsFile
from slalom.cli.viewing import animate, view
from slalom.io.table import sample_data
from slalom.live import session as edits
from slalom.live.messages import pack, renderer
from slalom.live.monitor import Monitor
from slalom.live.notebook import widget
from slalom.live.recorded import as_recorded, export, robot_of
from slalom.live.session import Session
from slalom.model.bounds import BOUNDS
from slalom.model.trajectory import Sampled
from slalom.peers import contender
from slalom.sim import Recording, compare, gallery, load, record, simulate
from slalom.sim.files.patterns import SwapGoals
from slalom.sim.files.recorded_traffic import Recorded as Agents, read_recorded
from slalom.sim.files.scenario_writer import _part, scenario_text
from slalom.sim.run.recorded import recorded
from slalom.sim.scenario import Robot, Scenario
from slalom.vehicle import Bicycle, Command, DifferentialDrive, Pose, VehicleNavigator
from slalom.vehicle.decision import PointMotion
from slalom.vehicle.driver import _detection
from slalom.vehicle.ways import way_among
from slalom.view.film import DecisionFilm, Film, checked
from slalom.view.sets import sets

NAO = method("nao")
ROBOT = Robot(Disc(0.5), Limits(4.0, 3.0), State((0, 0), (3, 0)), Goal(Stationary((20, 0)), 0.5))
SCENE = Scenario(
    "scene",
    (ROBOT,),
    (
        Obstacle(Disc(0.5), ConstantVelocity((12, 4), (-2, -1)), "b"),
        Obstacle(Disc(0.5), Sampled([5.0, 6.0], [(9.0, 9.0), (9.0, 8.0)]), "later"),
    ),
    duration=0.3,
)
PAIR = (ROBOT, replace(ROBOT, name="other", state=State((0, 5), (3, 0))))
DRIVE = DifferentialDrive(0.5, 2.0, 2.0)
TO_HEADING = Goal(Stationary((1.0, 0.0)), heading=1.0)
DISC, LIMITS, STATE, GOAL = ROBOT.shape, ROBOT.limits, ROBOT.state, ROBOT.goal
NAVIGATOR = Navigator(NAO, DISC, LIMITS)
ROWS = [[(0, 0)], [(1, 0)]]
AHEAD = LookAhead(Navigator(method("nao_ahead"), DISC, LIMITS))
NEVER_STOPS, TO_STOP = Limits(4.0, 2.0, bounds=(LeastSpeed(1.0),)), Goal(Stationary((9.0, 0.0)), stop=True)
IN_WORLD = Tracks([(9, 0)], [(0, 0)], 1, worlds=[0])
PASSIVE = {"sight_range": 3.0, "passive_safety": 1.0, "hidden_speed": 1.0}


def future(probability: float, x: float = 12.0) -> Obstacle:
    """One of several futures of an obstacle."""
    return Obstacle(Disc(0.5), Stationary((x, 4.0)), "a", probability=probability)


def run(robots: int = 1) -> Recording:
    """A short run of one robot, or of several."""
    if robots == 1:
        return simulate(SCENE, NAO)
    return simulate(gallery.build("circle", {"robots": float(robots), "duration": 0.2}), method("nao_shared"))


def fleet(**settings: object) -> Fleet:
    """A fleet of two robots of which the first is present."""
    made = Fleet(NAO, DISC, LIMITS, robots=2, **settings)
    fleet_step(made)
    return made


def fleet_step(made: Fleet | None = None, present: object = (1, 0), **settings: object) -> object:
    """A step of this fleet, or of a new one."""
    places, moves = np.array([(-3.0, 0.0), (3.0, 0.0)]), made or Fleet(NAO, DISC, LIMITS, robots=2)
    return moves.step(0.0, places, 0.0 * places, -places, present=present, **settings)


def no_steps() -> Recording:
    """The run of a robot that starts at its goal."""
    at_goal = replace(ROBOT, goal=Goal(Stationary((0.0, 0.0)), 0.5))
    return simulate(replace(SCENE, robots=(at_goal,)), NAO)


def scripted(folder: Path, source: str) -> object:
    """The scenario of a Python file."""
    (folder / "a.py").write_text(source)
    return load(f"{folder}/a.py:build")


def other_controls(_: Path) -> object:
    """The sets of a method whose control is a jerk."""
    with patch.dict(METHODS, {"jerky": replace(NAO, name="jerky", responses=lambda *_: (Jerk(),))}):
        return sets(SCENE, methods=["jerky"])


def bad_bundle(_: Path) -> object:
    """A bundled renderer that ends its script element."""
    with patch.object(Path, "read_text", return_value="x</script>y"):
        return renderer.__wrapped__()


def without_server(_: Path) -> object:
    """The command where a package of the server is not installed."""
    with patch.dict(sys.modules, {"starlette.applications": None}):
        sys.modules.pop("slalom.live.server", None)
        return view("head_on", browser=False)


def port_in_use(_: Path) -> object:
    """The command with a port at which another program listens."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        return view("head_on", port=other.getsockname()[1], browser=False)


def closed_monitor(_: Path) -> object:
    """The next decision of a monitor that is closed."""
    with Monitor() as monitor:
        pass
    return monitor.newest(0, 0.0)


def without_video(tmp: Path) -> object:
    """A video where PyAV is not installed."""
    with patch.dict(sys.modules, {"av": None}):
        return checked(tmp / "run.mp4")


def without_widgets(_: Path) -> object:
    """A widget where anywidget is not installed."""
    with patch.dict(sys.modules, {"anywidget": None}):
        return widget(run())


def recorded_agents() -> Agents:
    """The agents of a recording that slalom brings."""
    return read_recorded(sample_data("roundabout_ring_11.csv"))


def late_replay(_: Path) -> object:
    """A replay that begins after the recording ends."""
    return as_recorded(recorded_agents(), NAO, at=1e6)


def replay_with_settings(_: Path) -> object:
    """A replay with another horizon."""
    return view(str(sample_data("roundabout_ring_11.csv")), settings=["horizon=3"], browser=False)


def reciprocity_backwards(folder: Path) -> object:
    estimate = Reciprocity(0.3)
    estimate.update(ROBOT.state, Tracks([(1, 0)], [(0, 0)], 0.3, 1.0))
    return estimate.update(ROBOT.state, Tracks([(1, 0)], [(0, 0)], 0.3, 0.0))


def short_horizon(_: Path) -> object:
    """A horizon in which robots that share their manoeuvres cannot come to rest."""
    session = Session(replace(SCENE, robots=PAIR), method("nao_shared"))
    return session._set({"name": "horizon", "value": 0.5}, 0)


def agents(kind: str, count: int, kinematics: Callable[[object], object]) -> list[object]:
    """Agents of navground, ready to decide."""
    from navground import core

    import slalom.adapters.navground  # noqa: F401  # registers the behaviours

    made = [core.Behavior.make_type(kind) for _ in range(count)]
    for k, agent in enumerate(made):
        agent.kinematics = kinematics(core.kinematics)
        agent.radius, agent.optimal_speed, agent.position = 0.1, 0.1, (float(k), 0.0)
        agent.prepare()
    return made


def moved_at_once(_: Path) -> object:
    """A fleet of navground of which one agent jumps."""
    pair = agents("SlalomFleet", 2, lambda kinds: kinds.OmnidirectionalKinematics(0.2, 1.0))
    try:
        for agent in pair:
            agent.compute_cmd_internal(0.1)
        pair[1].position = (5.0, 0.0)
        return pair[0].compute_cmd_internal(0.1)
    finally:
        for agent in pair:
            agent.close()


def other_kinematics(_: Path) -> object:
    """An agent of navground that is neither omnidirectional nor on two wheels."""
    (agent,) = agents("Slalom", 1, lambda kinds: kinds.AheadKinematics(0.2))
    return agent.compute_cmd_internal(0.1)


def observed_again(_: Path) -> object:
    """A second observation at the time of the first."""
    calibration, seen = Calibration(), Tracks([(0.0, 0.0)], [(1.0, 0.0)], 0.3, 2.0)
    calibration.observe(seen)
    return calibration.observe(seen)


def unknown_setting(_: Path) -> object:
    """A behaviour of ir-sim with a setting that it does not have."""
    import slalom.adapters.irsim as adapter

    return adapter._settings({"name": "slalom", "amax": 2.0})


def stepped(env: Any, action: object) -> object:
    """A step of an environment that has begun."""
    env.reset(seed=0)
    return env.step(action)


def goal_out_of_reach(_: Path) -> object:
    """A planning problem of CommonRoad without a target."""
    from slalom.adapters import commonroad

    with patch.object(commonroad, "targets", return_value=[]):
        return commonroad.solve(None, SimpleNamespace(planning_problem_id=7))


def unpredicted(_: Path) -> object:
    """A dynamic obstacle of CommonRoad without a prediction."""
    from slalom.adapters.commonroad import _obstacles

    role = SimpleNamespace(value="dynamic")
    return _obstacles(SimpleNamespace(obstacle_id=3, obstacle_role=role, prediction=None), SimpleNamespace(dt=0.1), 0.0)


def crowd_again(_: Path) -> object:
    """The same observation twice."""
    crowd, tracks = AvoidingCrowd(0.25), Tracks([(1.0, 0.0)], [(0.0, 0.0)], 0.3, 2.0)
    crowd.predict(tracks)
    return crowd.predict(tracks)


def in_sumo(robot: object, period: float) -> Callable[[Path], object]:
    """A robot in SUMO, whose step is 0.1 s."""

    def made(_: Path) -> object:
        from slalom.adapters.sumo import Robot as InSumo

        sumo = SimpleNamespace(simulation=SimpleNamespace(getDeltaT=lambda: 0.1))
        return InSumo(sumo, Navigator(NAO, robot, Limits(4.0, 3.0), period=period))

    return made


OF_CALIBRATION: dict[str, Callable[[Path], object]] = {
    "margins: expected one or more, found none": lambda _: ExpectedLoss(
        LookAhead(Navigator(method("nao_ahead"), Disc(1.0), Limits(1.0, 1.0))), ()
    ),
    r"shares: expected 1 numbers from 0 to 1, found \[2.0\]": lambda _: ExpectedLoss(
        LookAhead(Navigator(method("nao_ahead"), Disc(1.0), Limits(1.0, 1.0))), (0.1,), (2.0,)
    ),
    "tracks: expected them in the plane, found dimension 3": lambda _: AvoidingCrowd(0.25).predict(
        Tracks([(1, 0, 0)], [(0, 0, 0)], 0.3)
    ),
    "predicted: expected 1, .*; found 0": lambda _: Calibration().observe(Tracks([(0, 0)], [(1, 0)], 0.3), []),
    r"coverage: expected one of \(0.5, 0.8, 0.95\), found 0.7": lambda _: FromModels(0.7),
    r"leads: expected increasing prediction times, found \[1.0, 0.5\]": lambda _: Calibration(0.9, (1.0, 0.5)),
}
"""Of calibrated radii."""


def gym(call: Callable[[SimpleNamespace], object]) -> Callable[[Path], object]:
    """A call with the environments of gymnasium and PettingZoo, which are imported when it is made."""

    def made(_: Path) -> object:
        import gymnasium

        from slalom.adapters import gym as kinds

        names = {name: getattr(kinds, name) for name in kinds.__all__}
        return call(SimpleNamespace(**names, gymnasium=gymnasium))

    return made


def renamed(seed: int) -> Scenario:
    """Two robots, one of which is named by the seed."""
    return replace(SCENE, robots=(PAIR[0], replace(PAIR[1], name=f"robot {seed}")))


def in_a_box(kinds: SimpleNamespace) -> object:
    """A robot that is no disc, in an environment."""
    return kinds.RobotEnv(replace(SCENE, robots=(replace(ROBOT, shape=Rectangle(1.0, 1.0)),)))


OF_GYM: dict[str, Callable[[Path], object]] = {
    r"obstacle 'b': expected a disc, a ball or walls at rest .*, found Rectangle on Stationary": gym(
        lambda g: g.RobotEnv(replace(SCENE, obstacles=(Obstacle(Rectangle(1, 1), Stationary((9, 9)), "b"),)))
    ),
    r"scenario: expected .* \(1, 2, 0\.1\) in every world, found \(2, 2, 0\.1\)": gym(
        lambda g: g.RobotEnv(lambda seed: replace(SCENE, robots=PAIR) if seed else SCENE).reset()
    ),
    r"robot\.shape: expected a disc or a ball, found Rectangle": gym(in_a_box),
    r"robot\.appears: expected none in an environment, found 3 s": gym(
        lambda g: g.RobotEnv(replace(SCENE, robots=(replace(ROBOT, appears=3.0),)))
    ),
    r"scenario: expected one without limited sight, found blind_corner": gym(lambda g: g.RobotEnv("blind_corner")),
    r"recording: expected an episode with at least one step, found none": gym(
        lambda g: record(g.RobotEnv(SCENE)).recording
    ),
    r"settings: expected none": gym(lambda g: g.RobotEnv(SCENE, settings={"dt": 0.2})),
    r"scenario: expected a name, .* found 3": gym(lambda g: g.RobotEnv(3)),
    r"options: expected 'scenario_seed' or an option of a wrapper, found 'scenrio_seed'; did you mean": gym(
        lambda g: g.RobotEnv(SCENE).reset(options={"scenrio_seed": 1})
    ),
    r"options\['scenario_seed'\]: expected a whole number, found 0\.5": gym(
        lambda g: g.RobotEnv(SCENE).reset(options={"scenario_seed": 0.5})
    ),
    r"step: expected a running episode": gym(lambda g: g.RobotEnv(SCENE).step(np.zeros(2))),
    r"render_mode: expected none": gym(lambda g: g.RobotsEnv(2, SCENE, render_mode="human")),
    r"seed: expected one or 2, found 3": gym(lambda g: g.RobotsEnv(2, SCENE).reset(seed=[1, 2, 3])),
    r"step: expected running episodes": gym(lambda g: g.RobotsEnv(2, SCENE).step(np.zeros((2, 2)))),
    r"scenario: expected the robots \['robot', 'robot 0'\], found": gym(
        lambda g: g.FleetEnv(renamed).reset(options={"scenario_seed": 5})
    ),
    r"actions: expected one of each of \[\], found \['x'\]": gym(lambda g: g.FleetEnv().step({"x": 0})),
    r"env: expected a RobotEnv, possibly wrapped, found": gym(
        lambda g: g.SafetyFilter(g.gymnasium.make("CartPole-v1"))
    ),
    r"env: expected a FleetEnv, possibly wrapped, found": gym(lambda g: g.FleetSafetyFilter(g.RobotEnv(SCENE))),
    r"command: expected 'acceleration' or 'velocity' in space": gym(
        lambda g: g.RobotEnv("drones_crossing", command="unicycle")
    ),
    r"action: expected whole numbers from 0 to 8, found \[9\.\]": gym(
        lambda g: stepped(g.RobotEnv(SCENE, command="discrete"), 9)
    ),
    r"observations: expected shape \(1, 1\) and one more, found": gym(
        lambda g: g.RobotEnv(SCENE, observe=lambda worlds: np.zeros(3)).reset()
    ),
    r"env: expected a RobotsEnv, possibly wrapped, found": gym(
        lambda g: g.VectorSafetyFilter(g.gymnasium.make_vec("CartPole-v1", num_envs=2))
    ),
}
"""Of environments."""


def entry_point(point: str) -> Callable[[Path], object]:
    """A table that is asked for the parts of packages, of which one has an entry point."""

    def made(folder: Path) -> object:
        place = Path(mkdtemp(dir=folder))
        about = place / "bad-1.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: bad\nVersion: 1\n")
        (about / "entry_points.txt").write_text(f"[test.refused]\n{point}\n")
        table = Registry("test.refused", Kind(lambda part: not isinstance(part, str), "no text"), {"one": 1.0})
        with patch.object(sys, "path", [str(place), *sys.path]):
            return len(table)

    return made


AIMED = replace(ROBOT, objective=FollowVelocity((0.0, 1.0)))
OF_PARTS: dict[str, Callable[[Path], object]] = {
    r"entry point 'a' of test\.refused: expected no_such:x to be .*": entry_point("a = no_such:x"),
    r"entry point 'a' .*: expected no text, found 'json'": entry_point("a = json:__name__"),
    r"entry point 'one' .*: expected a name that is free": entry_point("one = math:pi"),
    r"entry point 'a' .*: expected the name of its part, .*'nao'": entry_point("a = refusals:NAO"),
    r"method: expected a method, such as method\('nao'\), or its name; found 3": lambda _: contender(3),
    r"robot\.objective: expected none for nao with 2 robots, found": lambda _: simulate(
        replace(SCENE, robots=(AIMED, PAIR[1])), NAO
    ),
    r"objective: expected none for nao_ahead, found": lambda _: simulate(replace(SCENE, robots=(AIMED,)), "nao_ahead"),
    r"scenario: expected a name, an Entry or a Scenario, found 3": lambda _: compare(3, ["vo"], 1),
    r"metric: expected .*, found 3": lambda _: compare(SCENE, [NAO], 1, metrics=[3]),
    r"store: expected scenarios, methods and metrics by name, found": lambda tmp: compare(
        "head_on", [NAO], 1, store=tmp / "kept"
    ),
    r"methods: expected different names, found two methods named 'nao'": lambda _: compare(
        "head_on", ["nao", replace(method("vo"), name="nao")], 1
    ),
}
"""Of parts of other packages, and of objects in their place."""

REFUSALS: dict[str, Callable[[Path], object]] = {
    **OF_ADAPTERS,
    **OF_CALIBRATION,
    **OF_GYM,
    **OF_PARTS,
    r"SlalomFleet: expected a world that does not repeat": moved_at_once,
    r"robots: expected a Fleet, Navigator, LookAhead, VehicleNavigator, Driver or environment": lambda _: record(DRIVE),
    r"t: expected a time from the first decision of one robot on, found 0": lambda _: record(NAVIGATOR).decision_at(0),
    r"columns, methods: expected 1 or 2, and a method; found 3": lambda _: sets(SCENE, columns=3),
    r"methods: expected those of velocities and accelerations, found 'jerky'": other_controls,
    r"a\.py: build: expected an Entry, or a function of parameters and a random generator": lambda f: scripted(f, ""),
    r"build: expected a function that returns a Scenario, found 3": lambda f: scripted(f, "build = lambda p, rng: 3"),
    r"recording: expected at least one decision, found none": lambda _: record(NAVIGATOR).recording,
    r"times: expected two or more that increase, found \[1": lambda _: Recording.from_tracks([1, 1], ROWS, 1),
    r"positions: expected numbers, found 'x'": lambda _: Recording.from_tracks([0, 1], "x", 1),
    r"names: expected 1 that differ, or none, found": lambda _: Recording.from_tracks([0, 1], ROWS, 1, names="ab"),
    r"walls\[0\]: expected an Obstacle, found 3": lambda _: Recording.from_tracks([0, 1], ROWS, 1, walls=[3]),
    r"positions: expected shape \(3, N, 2 or 3\), found \(2, 1, 2\)": lambda _: Recording.from_tracks(
        [0, 1, 2], ROWS, 1
    ),
    r"velocities: expected finite numbers of shape \(2, 1, 2\)": lambda _: Recording.from_tracks(
        [0, 1], ROWS, 1, velocities=[0]
    ),
    r"positions\[:, 0\]: expected two or more in consecutive rows, found 1 from row 0 to 0": lambda _: (
        Recording.from_tracks([0, 1], [[(0, 0)], [(np.nan, 0)]], 1)
    ),
    r"--walls: expected only with a recording, found it with the run": lambda f: (
        run().save(f / "run.h5"),
        animate(f / "run.h5", f / "run.gif", walls=WallsFile(walls=Path("hall.dxf"))),
    ),
    r"kinematics: expected omnidirectional ones": other_kinematics,
    r"behavior: expected settings of horizon, .*, found amax": unknown_setting,
    r"planning problem 7: expected a goal in reach, found none": goal_out_of_reach,
    r"obstacle 3: expected a trajectory or occupied regions, found neither": unpredicted,
    r"navigator: expected a disc as its robot, found Rectangle": in_sumo(Rectangle(1.0, 1.0), 0.1),
    r"navigator: expected the period 0\.1 s of SUMO, found 0\.2 s": in_sumo(Disc(1.0), 0.2),
    r"what: expected one of robot, .*; found 'wall'": lambda _: edits.dragged(SCENE, "wall", 0, (0, 0)),
    r"index: expected a number below 1, found 1": lambda _: edits.dragged(SCENE, "robot", 1, (0, 0)),
    r"obstacle 'later': expected one that exists": lambda _: edits.dragged(SCENE, "obstacle", 1, (0, 0)),
    r"index: expected a number below 2, found 2": lambda _: edits.without(SCENE, "obstacle", 2),
    r"index: expected a number below 2, found 3": lambda _: edits.led(SCENE, 3, [(0, 0), (1, 0)], 1.0),
    r"what: expected obstacle or robot; found 'wall'": lambda _: edits.without(SCENE, "wall", 0),
    r"robot: expected one that remains in the scene": lambda _: edits.without(SCENE, "robot", 0),
    r"what: expected one of obstacle, wall, robot; found 'tree'": lambda _: edits.drawn(SCENE, "tree", [(0, 0)], 1.0),
    r"points: expected \(2 or more, 2\) numbers, found": lambda _: edits.drawn(SCENE, "wall", [(0, 0)], 1.0),
    r"points: expected \(n, 2\) numbers, found \(1, 3\)": lambda _: edits.led(SCENE, 0, [(0, 0, 0)], 1.0),
    r"'later': expected one that exists at 0 s": lambda _: edits.led(SCENE, 1, [(0, 0), (1, 0)], 1.0),
    r"points: expected a line with a length above 0": lambda _: edits.led(SCENE, 0, [(12, 4)], 1.0),
    r"name: expected one of horizon, .*'dt'": lambda _: edits.with_setting(SCENE, "dt", 1.0),
    "expected an even count of robots that exchange places, found 3": lambda _: SwapGoals().goals(np.ones((3, 2))),
    r"share: expected at most 1, found 2": lambda _: Monitor(share=2.0),
    r"monitor: expected an open one, found a closed one": closed_monitor,
    r"path: expected a name ending in \.html": lambda tmp: export(run(), tmp / "run.txt"),
    r"width: expected an even number from 320": lambda _: Film(run(), width=321),
    r"fps: expected at most 60, found 100": lambda _: Film(run(), fps=100.0),
    r"fps: expected at least 0\.1, found 0\.001": lambda _: Film(run(), fps=0.001),
    r"speed: expected at least .* 1000000 pictures, found 1e-09": lambda _: Film(run(), speed=1e-9),
    r"control_space: expected a run of one robot by a method of slalom, found 2 robots": lambda _: DecisionFilm(run(2)),
    r"path: expected a name ending in \.mp4 or \.gif": lambda tmp: checked(tmp / "run.avi"),
    r"method: expected one with a scenario": lambda _: widget(SCENE),
    r"--agent: expected the id of an agent of roundabout_ring_11": lambda _: as_recorded(
        recorded_agents(), NAO, "none"
    ),
    r"expected a track of at least 0.1 s, found one after 1e\+06 s": late_replay,
    r"--port: expected 0 to 65535, found 65536": lambda _: view("head_on", port=65536),
    r"--port: expected a free port, or 0 for any; found \d+: address already in use": port_in_use,
    r"--agent: expected only with a recording": lambda _: view("head_on", agent="1", browser=False),
    r"--set: expected --start and --goal": replay_with_settings,
    r"scene: expected finite numbers": lambda _: pack("scene", {"x": float("nan")}, {}),
    r"renderer: expected a script without an end tag": bad_bundle,
    r"do: expected one of look": lambda _: Session(SCENE, NAO).answer({"do": "fly"}),
    r"robot: expected a number below 1": lambda _: Session(SCENE, NAO)._select({"robot": 1}, 0),
    r"horizon: expected at least": short_horizon,
    r"method: expected": lambda _: Session(replace(SCENE, robots=PAIR), NAO)._method({"name": "nao_ahead"}, 0),
    r"undo: expected a change before": lambda _: Session(SCENE, NAO)._take_back({}, 0),
    r"robot: expected a value in the command": lambda _: Session(SCENE, NAO)._select({}, 0),
    r"sight_noise: expected 0": lambda _: scenario_text(replace(SCENE, sight_noise=0.1)),
    r"part: expected one of friction, .*, found SimpleNamespace": lambda _: _part(SimpleNamespace(), BOUNDS),
    r"field_of_view: expected at most 2 pi rad": lambda _: Sight(field_of_view=7.0),
    r"range: expected a finite one": lambda _: Sight(float("inf"), hidden_speed=1.0),
    r"now: expected a time that does not run backwards, found 0 s after a look at 1 s": lambda _: Sight().look(
        ROBOT.state, [], 0.0, Sight().look(ROBOT.state, [], 1.0)
    ),
    r"sight: expected a scene in the plane, found dimension 3": lambda _: Sight().look(State((0, 0, 0), (0, 0, 0)), []),
    r"passive_safety: expected a method with manoeuvres that end": lambda _: method("vo").stopping(),
    r"shares: expected numbers from 0 to 0.5, found \[0.7\]": lambda _: Tracks([(1, 0)], [(0, 0)], 0.3, shares=[0.7]),
    r"tracks: expected dimension 2 as of the state, found 3": lambda _: Reciprocity(0.3).update(
        ROBOT.state, Tracks([(1, 0, 0)], [(0, 0, 0)], 0.3)
    ),
    r"tracks.t: .* found 0 s after an update at 1 s": reciprocity_backwards,
    r"sight: expected none in space or in several worlds": lambda _: Fleet(
        NAO, DISC, LIMITS, robots=2, worlds=[0, 1], sight=Sight()
    ),
    r"sight: expected no hidden speed in a fleet, found 1 m/s": lambda _: Fleet(
        NAO, DISC, LIMITS, robots=2, sight=Sight(hidden_speed=1.0)
    ),
    r"occlusion: expected 0, 1 or 2, found 3": lambda _: SCENE.with_settings({"occlusion": 3.0}),
    r"sight_range: expected one above 0": lambda _: SCENE.with_settings(PASSIVE | {"sight_range": 0.0}),
    r"hidden_speed: expected a speed \[m/s\] with an entry time, found None": lambda _: Sight(entry_time=2.0),
    r"passive_safety: expected 1 or 2 with": lambda _: SCENE.with_settings({"hidden_speed": 1.0}),
    r"hidden_speed: expected a speed \[m/s\] with passive_safety, found none": lambda _: SCENE.with_settings(
        {"sight_range": 5.0, "passive_safety": 1.0}
    ),
    r"sight: expected limited sight in the plane only, found dimension 3": lambda _: replace(
        gallery.build("drones_crossing"), sight=Sight(3.0)
    ),
    r"sight: expected no hidden speed for several robots, found 1 m/s": lambda _: replace(
        SCENE, robots=PAIR
    ).with_settings(PASSIVE),
    r"passive_safety: expected a method with .* such as nao, found nao_ahead": lambda _: simulate(
        SCENE.with_settings(PASSIVE), "nao_ahead"
    ),
    r"robot: expected the name or number of one of 2": lambda _: run(2).row(),
    r"position: expected numbers of magnitude up to 1e\+100": lambda _: State((1e308, 0), (0, 0)),
    r"horizon: expected at most 5000 s": lambda _: Navigator(NAO, DISC, LIMITS, horizon=1e90),
    r"present: expected True or False": lambda _: fleet_step(present=(0.5, 1)),
    r"name: expected text, found 1": lambda _: method(1),
    r"robots: expected numbers below 2, found 2": lambda _: fleet().manoeuvres([2]),
    r"robots: expected those that were present": lambda _: fleet().manoeuvres([1]),
    r"names: expected 2, one for each of the robots, found 1": lambda _: fleet(names=("a",)),
    r"names: expected different ones, found 'a' more than once": lambda _: fleet(names=("a", "a")),
    r"period: expected at most the horizon, 6 s, found 7 s": lambda _: fleet(period=7.0),
    r"period: expected at most the horizon, 2 s, found 4 s": lambda _: Navigator(
        NAO, DISC, LIMITS, period=4.0, horizon=2.0
    ),
    r"tolerances: expected numbers above 0 m, found 0 m": lambda _: fleet_step(tolerances=(0.0, 1.0)),
    r"^goal: expected one to pass \(stop=False\) with LeastSpeed\(least=1\.0, .* with stop=True": lambda _: Navigator(
        NAO, DISC, NEVER_STOPS
    ).decide(STATE, [], TO_STOP),
    r"^robot\.goal: expected one to pass .* found one at rest with stop=True": lambda _: replace(
        ROBOT, name="robot", limits=NEVER_STOPS, goal=TO_STOP
    ),
    r"^stop: expected False for robot 1 with LeastSpeed\(least=1\.0, .*, by which .*; found True": lambda _: fleet_step(
        Fleet(NAO, DISC, [LIMITS, NEVER_STOPS])
    ),
    r"^paths\[1\]: expected one to pass .* found one at rest with stop=True": lambda _: Fleet(
        NAO, DISC, [LIMITS, NEVER_STOPS]
    ).step(0.0, [(0, 0), (0, 5)], np.zeros((2, 2)), paths=[PathGoal([(0, y), (9, y)]) for y in (0, 5)]),
    r"obstacles: expected at least one": lambda _: NAVIGATOR.fall_back(STATE, [], GOAL),
    r"state: expected dimension 2 as of the previous decision, found 3": lambda _: NAVIGATOR.decide(
        State((0, 0, 0), (0, 0, 0)), [], GOAL, previous=NAVIGATOR.decide(STATE, [], GOAL)
    ),
    r"then\[0\]: expected a duration and an acceleration, found \(1\.0,\)": lambda _: AccelerationSequence(
        0.5, ((1.0,),)
    ),
    r"parameters: expected numbers by name, found 1": lambda _: Scenario("one", (ROBOT,), parameters=1),
    r"store: expected a folder, found 1": lambda _: compare("empty", ["nao"], 1, store=1),
    r"id: expected a hashable name, found \[\]": lambda _: Tracker().update(0, [], (0, 0)),
    r"heading: expected that of the robot for a goal with 1, found none": lambda _: TO_HEADING.reached(
        (0, 0), (0, 0), 0.0
    ),
    r"goal: expected one without a heading .* found 1 rad; a VehicleNavigator takes it": lambda _: NAVIGATOR.decide(
        STATE, [], TO_HEADING
    ),
    r"lag: expected one lag, or those of speed and turn, found 3": lambda _: DifferentialDrive(
        0.5, 1, 2, lag=(0.1, 0.2, 0.3)
    ),
    r"duration: expected at most the period, 0\.1 s, found 0\.2 s": lambda _: DRIVE.drive(
        Pose((0, 0), 0.0), Command(0.0, 0.0), 0.2
    ),
    r"heading: expected none in space": lambda _: State((0, 0, 0), (0, 0, 0), heading=1.0),
    r"goal: expected poses .* or a place .*, found shape \(4,\)": lambda _: way_among(
        (0, 0, 0), np.ones(4), DISC, [], 1.0
    ),
    r"body: expected a shape in the plane, found Ball in space": lambda _: way_among(
        (0, 0, 0), (1, 1), Ball(1.0), [], 1
    ),
    r"obstacles\[0\]: expected a valid geometry of shapely": lambda _: way_among((0, 0, 0), (1, 1), DISC, [DISC], 1.0),
    r"max_steering: expected less than pi / 2": lambda _: Bicycle(1.0, 0.5 * np.pi, 1.0, 2.0, 2.0),
    r"min_speed: expected at most the largest one, 1, found 1\.5": lambda _: Bicycle(
        1.0, 0.5, 1.0, 2.0, 2.0, max_reverse_speed=1.0, min_speed=1.5
    ),
    r"min_speed: expected at most the largest one, 0\.1, found 0\.2": lambda _: DifferentialDrive(
        0.4, 1.0, 2.0, max_reverse_speed=0.1, min_speed=0.2
    ),
    r"min_turn_rate: expected at most the largest one, 5, found 6": lambda _: DifferentialDrive(
        0.4, 1.0, 2.0, min_turn_rate=6.0
    ),
    r"lag: expected one lag, that of both wheels, found 0\.1 and 0\.2 s": lambda _: DifferentialDrive(
        0.4, 1.0, 2.0, lag=(0.1, 0.2)
    ),
    r"times: expected two or more that increase, found \[0, 0\]": lambda _: PointMotion(
        np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2))
    ),
    r"state: heading: expected none for a Rectangle, whose axes are those of the world, found 0.5 rad": lambda _: (
        Navigator(NAO, Rectangle(1.0, 0.5), LIMITS).decide(State((0, 0), (0, 0), heading=0.5), [], TO_STOP)
    ),
    r"state_timeout: expected at most the horizon, 6 s, found 7 s": lambda _: Driver(NAVIGATOR, state_timeout=7.0),
    r"detections\[0\]: expected 2 to 6 values, found 1": lambda _: _detection(("person",), "detections[0]", 2),
    r"body: expected one convex shape in the plane, found Ball": lambda _: VehicleNavigator(DRIVE, NAO, Ball(1.0)),
    r"probability: expected a number above 0 of at most 1, found 1\.1": lambda _: Obstacle(
        Disc(1), Stationary((9, 0)), "a", probability=1.1
    ),
    r"expected a name or an owner with a probability below 1, found neither": lambda _: Obstacle(
        Disc(1), Stationary((9, 0)), probability=0.5
    ),
    r"obstacle 'a': expected a probability of 1 in a scenario, .* found 0\.5": lambda _: Scenario(
        "one", (ROBOT,), obstacles=(future(0.5),)
    ),
    r"obstacle 'a': expected futures with probabilities of at most 1 together, found 1\.2": lambda _: NAVIGATOR.decide(
        STATE, [future(0.6), future(0.6, 9.0)], GOAL
    ),
    r"robots: expected tracks without probabilities, found some with; they are obstacles": lambda _: NAVIGATOR.decide(
        STATE, [], GOAL, robots=Tracks([(9, 0)], [(0, 0)], 1, probabilities=[0.5])
    ),
    r"robots: expected tracks without worlds, which only a fleet has, found some with": lambda _: NAVIGATOR.decide(
        STATE, [], GOAL, robots=IN_WORLD
    ),
    r"places: expected an array of shape \(\.\.\., n, 2\), found shape \(2, 3\)": lambda _: ExpectedLoss(
        AHEAD
    ).contacts(np.zeros((2, 3)), [], [0.1, 0.2], 0.0),
}
WITHOUT_EXTRAS: dict[str, Callable[[Path], object]] = {
    r"ros: .*slalom\[ros\]": without_rosbags,
    r"view: .*slalom\[view\]": without_server,
    r"animate: .*slalom\[video\]": without_video,
    r"widget: .*slalom\[notebook\]": without_widgets,
}
"""Where packages are not installed."""
SEVERAL: dict[str, list[Callable[[Path], object]]] = {
    r"obstacles: expected tracks without worlds, which only a fleet has, found some with": [
        lambda _: AHEAD.decide(STATE, IN_WORLD, GOAL),
        lambda _: ControlObstacle(Acceleration(), STATE, ObstacleWindow(IN_WORLD, 0, 1), DISC),
        lambda _: ExpectedLoss(AHEAD).decide(STATE, IN_WORLD, GOAL),
        lambda _: Sight().look(STATE, IN_WORLD),
        lambda _: NAVIGATOR.decide(STATE, IN_WORLD, GOAL),
    ],
    r"^goal: expected one to pass .* found one at rest with stop=True": [
        lambda _: Navigator(NAO, DISC, NEVER_STOPS).decide(STATE, [], PathGoal([(0, 0), (9, 0)])),
        lambda _: VehicleNavigator(DRIVE, NAO, DISC, limits=NEVER_STOPS).decide(Pose((0, 0), 0.0), [], TO_STOP),
    ],
    r"tracks.t: expected a time after 2 s": [crowd_again, observed_again],
    r"scenario: expected one robot, found 2": [
        gym(lambda g: g.RobotEnv(renamed)),
        gym(lambda g: g.RobotsEnv(2, renamed)),
    ],
    r"recording: expected a run with at least one step": [lambda _: recorded(no_steps()), lambda _: Film(no_steps())],
    r"robot: expected one of 0 to 0, found 1": [
        lambda _: widget(SCENE, NAO, robot=1, live=True),
        lambda _: robot_of(recorded(run()), 1),
    ],
}
"""Several calls with the same message."""
