"""Files of decisions: those of each kind of loop are repeated in another process, and nothing of a class is lost."""

import inspect
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from parts import BOUNDS, FORECASTS, LIMITS, OBJECTIVES, RESPONSES, SHAPES, TRAJECTORIES, UNCERTAINTIES

import slalom
from slalom.decision import Decision
from slalom.decision.document import _Writer, arguments_of, kinds, made
from slalom.model.uncertainty import Adjusted, Covering
from slalom.sim import Robot, Scenario, Station, Tasks, read_scenario
from slalom.sim.files.decision_file import is_decision, read_decision
from slalom.sim.files.scenario_writer import NOT_IN_FILES, ORIGIN, WRITTEN, scenario_text
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, VehicleNavigator

STILL = slalom.Stationary((0.0, 0.0))
WALL = slalom.Obstacle(slalom.Polyline([(3, -2), (3, 1)], 0.05), STILL, "wall")
KNOWN = [WALL, *(slalom.Obstacle(slalom.Disc(0.3), slalom.ConstantVelocity((5, y), (-0.3, -0.5))) for y in (2, 3))]
GOAL = slalom.Goal(slalom.Stationary((8.0, 0.3)), 0.2, stop=True)
DRIVE = DifferentialDrive(
    track=0.4, max_wheel_speed=1.0, max_wheel_acceleration=1.5, lag=0.1, delay=0.1, min_speed=0.02, min_turn_rate=0.03
)
CAR = Bicycle(
    wheelbase=0.6, max_steering=0.6, max_steering_rate=1.5, max_speed=1.5, max_acceleration=1.0, max_reverse_speed=0.5
)

# The loops of the documentation, with defaults.


def navigator(name: str = "nao", **settings) -> slalom.Navigator:
    return slalom.Navigator(slalom.method(name), slalom.Disc(0.3), slalom.Limits(1.5, 1.0), **settings)


def loop(robot, obstacles: Callable, goal=GOAL, steps: int = 14, **further) -> Iterator[Decision]:
    """The decisions of a robot, or of a vehicle, that moves as it decided."""
    wheels, decision = isinstance(robot, VehicleNavigator), None
    state = Pose((0.0, 0.0), 0.0) if wheels else slalom.State((0.0, 0.0), (0.5, 0.0))
    for k in range(steps):
        now = 0.1 * k
        decision = robot.decide(state, obstacles(now, state), goal, now=now, previous=decision, **further)
        yield decision
        state = decision.pose_at(now + 0.1) if wheels else decision.state_at(now + 0.1, state, now)


def driven(robot) -> Iterator[Decision]:
    """The decisions of a driver; after a second no state comes."""
    driver, wheels = slalom.Driver(robot, walls=[WALL]), isinstance(robot, VehicleNavigator)
    driver.head_for(GOAL)
    state = Pose((0.0, 0.0), 0.0) if wheels else slalom.State((0.0, 0.0), (0.0, 0.0))
    for k in range(18):
        now = 0.1 * k
        if k < 10:
            driver.locate(now, state)
            driver.see(now, [("person", (5 - 0.3 * now, 0.3)), ("cart", (4, 2 - now), None, None, slalom.Disc(0.5))])
        decision = driver.command(now).decision
        yield decision
        state = decision.pose_at(now + 0.1) if wheels else decision.state_at(now + 0.1, state, now)


def tracked() -> Callable:
    """Tracked people, and a box with a heading."""
    tracker = slalom.Tracker()

    def seen(now: float, _: object) -> list:
        tracker.update(now, "a", (5 - 0.3 * now, 0.1))
        tracker.update(now, "b", (4, 2 - 0.5 * now), shape=slalom.Rectangle(1.0, 0.5), heading=0.2)
        return [WALL, *tracker.at(now)]

    return seen


def looking() -> Callable:
    """What a robot sees, and what may be hidden."""
    sight, last = slalom.Sight(range=8.0, hidden_speed=1.5, any_motion=True), [None]

    def seen(now: float, state: slalom.State) -> tuple:
        last[0] = sight.look(state, KNOWN, now, last[0])
        return last[0].obstacles

    return seen


def people(now: float, _: object) -> list:
    return [WALL, slalom.Tracks([(5 - 0.3 * now, 0.1)], [(-0.3, 0.0)], 0.3, now)]


def known(*_: object) -> list:
    return KNOWN


def grid(*_: object) -> list:
    return [
        slalom.occupancy(np.array([[0, 0, 100], [0, 100, 100]]), 0.5, (2.0, -0.6, 0.1)),
        slalom.ObstacleTable(KNOWN),
        slalom.scan([6.0, np.inf], [0.4, 0.5]),
    ]


PATH = slalom.PathGoal([(0, 0), (2, 1), (8, 3)], speeds=[1.0, 1.2, 0.0], tolerance=0.2)
PATH_OF_ALL = slalom.PathGoal(
    *([(0, 0), (2, 1), (0, 0)], 1.0, 0.2, False),
    lookahead=2.0,
    laps=2,
    cut=0.1,
    heading=0.4,
    heading_tolerance=0.2,
)
PLANE = slalom.Limits(1.5, 1.0, bounds=(slalom.LeastSpeed(0.3), slalom.TurningRadius(1.0)))
BOX = slalom.Rectangle(0.9, 0.5)
LOOPS: dict[str, Callable[[], Iterator[Decision]]] = {
    "navigator": lambda: loop(navigator(), known, budget=1e-4),
    "observed": lambda: loop(navigator("nao@observed"), known, steps=4),
    "settings": lambda: loop(navigator(early=True, detours=(0.6,), horizons=slalom.SafeTime()), people),
    "aircraft": lambda: loop(replace(navigator(), limits=PLANE), known, replace(GOAL, stop=False)),
    "robots": lambda: loop(navigator(), known, robots=people(0.0, None)[1], objective=slalom.KeepAcceleration()),
    "tracker": lambda: loop(navigator(), tracked()),
    "sight": lambda: loop(navigator(), looking(), steps=8),
    "grid": lambda: loop(navigator(), grid, PATH),
    "ahead": lambda: loop(slalom.LookAhead(navigator("nao_ahead")), known),
    "ahead, prepared": lambda: loop(slalom.LookAhead(navigator()).prepared_for(KNOWN, 0.0), known),
    "ahead, observed": lambda: loop(slalom.LookAhead(navigator("nao@observed")), known, steps=8),
    "ahead, tracker": lambda: loop(slalom.LookAhead(navigator()), tracked(), steps=8),
    "loss": lambda: loop(slalom.ExpectedLoss(slalom.LookAhead(navigator())), known, steps=8, scales={"wall": 0.5}),
    "plans": lambda: loop(slalom.ExpectedLoss(slalom.LookAhead(navigator()), deviates=False), known, steps=8),
    "drive": lambda: loop(VehicleNavigator(DRIVE, slalom.method("nao"), BOX, center=0.1), people),
    "car": lambda: loop(VehicleNavigator(CAR, slalom.method("nao"), BOX), known, replace(GOAL, heading=1.5)),
    "car, path": lambda: loop(VehicleNavigator(CAR, slalom.method("nao"), BOX), tracked(), PATH),
    "driver": lambda: driven(navigator()),
    "driver, wheels": lambda: driven(VehicleNavigator(DRIVE, slalom.method("nao"), slalom.Disc(0.25))),
}
REPEATED = """
import json, sys
from pathlib import Path
from slalom.sim.explanation import explanation
from slalom.sim.files.decision_file import read_decision
found = {}
for path in sorted(Path(sys.argv[1]).iterdir()):
    decision, same = read_decision(path).repeat()
    found[path.name] = same, decision.as_dict(), explanation(decision)["sentences"]
print(json.dumps(found))
"""


def test_decisions_of_each_loop_are_repeated_to_the_bit_and_explained_by_another_process(tmp_path: Path) -> None:
    """Of the first decision, in which a robot has not committed itself, and of the last; files of any name."""
    decisions: dict[str, Decision] = {}
    for name, decided in LOOPS.items():
        every = list(decided())
        for k in (0, len(every) - 1):
            decisions[f"{name} {k}.yaml"] = every[k]
            every[k].dump(tmp_path / f"{name} {k}.yaml")
            assert is_decision(tmp_path / f"{name} {k}.yaml")
    done = subprocess.run([sys.executable, "-c", REPEATED, tmp_path], check=True, capture_output=True, text=True)
    repeated = json.loads(done.stdout)
    assert set(repeated) == set(decisions)
    for name, (same, told, sentences) in repeated.items():
        assert same, name
        assert told == json.loads(json.dumps(decisions[name].as_dict())), name
        assert sentences, name


# Classes in files: every argument of a constructor is written and read.


def others() -> list:
    """Objects of the classes that are no parts, with no argument at its default."""
    state = slalom.State((1.0, 2.0), (0.1, 0.2), (0.3, 0.4), 0.5)
    doubt, risk = slalom.BoundedError(0.1, 0.2, 0.3), slalom.Risk(3.0, 0.2)
    settings = {
        "period": 0.2,
        "horizon": 5.0,
        "margin": 0.1,
        "holds": (0.3,),
        "patience": 0.2,
        "detours": (0.4,),
        "objective": slalom.KeepAcceleration(),
        "horizons": slalom.SafeTime(2.0),
        "early": True,
        "stuck_after": 4.0,
        "risk": risk,
    }
    two = np.ones((1, 2))
    tracks = slalom.Tracks(
        *(two, 2 * two, 0.4, 0.5),
        accelerations=3 * two,
        ids=("a",),
        forecast=slalom.AtConstantTurn(),
        uncertainty=[doubt],
        shares=0.2,
        braking=0.3,
        probabilities=[0.4],
        contact_at_rest=False,
    )
    obstacle = slalom.Obstacle(
        *(slalom.Disc(0.3), slalom.Sampled([0, 1], np.eye(2)), "a", slalom.Headings([0, 1], [2, 3]), doubt),
        *("continues", False, 0.5, "b"),
    )
    goal = slalom.Goal(slalom.Stationary((1, 2)), 0.1, True, 0.2, 0.3)
    body = VehicleNavigator(
        *(CAR, slalom.method("nao"), slalom.Disc(0.4), 0.1),
        limits=slalom.Limits(1.0, 2.0),
        reverse_after=2.0,
        contact_at_rest=True,
        horizon=5.0,
        margin=0.2,
        holds=(0.3,),
        patience=0.1,
    )
    further = {"max_speed": 0.9, "max_acceleration": 0.8, "max_turn_rate": 0.7, "max_turn_acceleration": 0.6}
    further["max_reverse_speed"] = 0.5
    wheels = replace(DRIVE, period=0.2, ahead=0.2, **further)
    passive = replace(navigator(**settings), method=slalom.method("nao").stopping(), contact_at_rest=False)
    changed = replace(slalom.method("nao@observed"), name="nao", share=0.5, regain=1.0, looks_ahead=True)
    return [
        *(state, tracks, obstacle, goal, risk, passive, body, wheels, changed),
        *(slalom.LookAhead(navigator(), 9.0, 8.0, 7.0, 6.0), slalom.ObstacleTable([obstacle])),
        slalom.ExpectedLoss(slalom.LookAhead(navigator()), (0.1,), (0.2,), 3.0, doubt, False),
        PATH_OF_ALL,
        Adjusted(Adjusted(doubt, 0.5), 0.1, 0.3, 2.0),
        Adjusted(Covering(0.8, (0.5, 1.0), ((0.5, (0.1, 0.2)), (0.8, (0.2, 0.5))), 2.0), 0.3, 0.9, 0.4),
    ]


def parts() -> Iterator[object]:
    """The examples of every part."""
    yield from RESPONSES.values()
    yield from (one for one in FORECASTS.values() if type(one).__name__ in kinds())
    yield from UNCERTAINTIES.values()
    for table in (TRAJECTORIES, BOUNDS, OBJECTIVES, LIMITS):
        for example in table.values():
            found = example(2)
            yield from found if isinstance(found, tuple) else (found,)
    yield from (shape(0.5, 2) for shape in SHAPES.values())


def test_objects_are_read_as_they_were_written() -> None:
    """By the plain form of what was read; floats are exact."""
    names = set()
    for one in (*parts(), *others()):
        if type(one).__name__ not in kinds():
            with pytest.raises(slalom.InvalidInput, match="expected a part that files can hold, found"):
                _Writer().plain(one, "part")
            continue
        plain = json.loads(json.dumps(_Writer().plain(one, "part"), allow_nan=False))
        again = made(plain, "part")
        assert type(again) is type(one)
        assert _Writer().plain(again, "part") == plain
        names.add(type(one).__name__)
    assert len(names) > 40


def test_no_argument_of_an_object_is_left_out() -> None:
    """Arguments that are not written would have their defaults: none of these has."""
    for one in others():
        plain, again = _Writer().plain(one, "part"), made(_Writer().plain(one, "part"), "part")
        if isinstance(one, slalom.Method):
            assert again == one
            continue
        assert {"kind", *arguments_of(type(one))} == set(plain)
        for name, each in inspect.signature(type(one)).parameters.items():
            made_anew = each.default is inspect.Parameter.empty or repr(each.default) == "<factory>"
            if not made_anew and name not in ("worlds", "prepared"):
                assert plain[name] != _Writer().plain(each.default, name), name


# Scenario files.


def test_scenario_files_hold_or_refuse_every_field_of_scenarios_robots_and_obstacles(tmp_path: Path) -> None:
    """What differs from its default is read again, or refused; fields that say where it comes from are neither."""
    obstacle = slalom.Obstacle(
        *(slalom.Disc(0.3), slalom.Sampled([0, 1], [(3, 3), (4, 3)]), "a", 0.2, slalom.BoundedError(0.1)),
        *("continues", False, 1.0, "b"),
    )
    bound = slalom.HalfSpace((1.0, 0.0), 1.0)
    limits = slalom.Limits(1.5, 1.0, (bound,), (bound,), (slalom.HeadingCone(1.0),))
    state, goal = slalom.State((0, 0), (0.1, 0)), slalom.Goal(slalom.ConstantVelocity((9, 0), (0.1, 0)), 0.3, True)
    objective, nao = slalom.KeepAcceleration(0.3), slalom.method("nao")
    robot = Robot(slalom.Disc(0.4), limits, state, goal, "r", nao, 0.2, 2.0, objective, 1.5)
    sight = slalom.Sight(5.0, 2.0, 0.3, "all", 1.0, True)
    numbers = {"start": 1.0, "duration": 7.0, "dt": 0.05, "replan": 0.1, "guided": False, "early": True}
    shared = {"horizon": 5.0, "margin": 0.1, "holds": (0.3,), "patience": 0.2}
    scenario = Scenario("s", (robot,), (obstacle,), **numbers, **shared, sight=sight)
    waiting = replace(robot, goal=slalom.Goal(slalom.Stationary((9, 0)), 0.3, True))
    tasks = Tasks((Station("a", (0, 9)), Station("b", (9, 9))), rate=2.0, origins=("a",), destinations=("b",))
    served = replace(scenario, robots=(waiting,), tasks=tasks)
    for one in (scenario, served):
        (tmp_path / "a.yaml").write_text(scenario_text(one))
        again = read_scenario(tmp_path / "a.yaml")
        for each in (*WRITTEN, *ORIGIN):
            if each not in ("robots", "obstacles", "tasks"):
                assert getattr(again, each) == getattr(one, each), each
        assert scenario_text(again) == scenario_text(one)
    for cls, objects in ((Robot, [robot]), (slalom.Obstacle, [obstacle]), (Scenario, [scenario, served])):
        for each in fields(cls):
            if each.name not in (*NOT_IN_FILES.get(cls, ()), *ORIGIN):
                assert {repr(getattr(one, each.name)) for one in objects} - {repr(each.default)}, each.name
    heading = replace(scenario, robots=(replace(robot, state=slalom.State((0, 0), (0, 0), heading=0.3)),))
    for lost, name in ((heading, "r: heading"), (replace(scenario, sight_noise=0.1), "sight_noise")):
        with pytest.raises(slalom.InvalidInput, match=f"{name}: expected .* in a file, found"):
            scenario_text(lost)


def test_unknown_keys_of_a_file_are_refused(tmp_path: Path) -> None:
    next(LOOPS["navigator"]()).dump(tmp_path / "d.json")
    content = json.loads((tmp_path / "d.json").read_text())
    content["inputs"]["obstacles"][0]["colour"] = "red"
    (tmp_path / "d.json").write_text(json.dumps(content))
    with pytest.raises(slalom.InvalidFile, match=r"inputs\.obstacles\.0: expected shape, .*, found .*, colour"):
        read_decision(tmp_path / "d.json")
