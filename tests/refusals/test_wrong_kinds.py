"""Arguments of wrong kinds: each public call takes them or refuses them with one line that names the argument.

Each argument of each call is replaced by each wrong value. What is taken must also serve: a robot or fleet that is made
from it decides. Nothing but InvalidInput is raised, and numpy warns of nothing.
"""

import re
import warnings
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import parts
import pytest
from draws import draws

import slalom
from slalom import Disc, Goal, InvalidInput, Limits, Navigator, Obstacle, ObstacleWindow, State, Stationary, vehicle
from slalom.base import checks
from slalom.sim import Robot, Scenario, compare, simulate

NAN, INF = float("nan"), float("inf")
DISC, LIMITS, NAO = Disc(0.4), Limits(2.0, 2.0), slalom.method("nao")
STATE, GOAL = State((0.0, 0.0), (1.0, 0.0)), Goal(Stationary((9.0, 0.0)))
ROCK = Obstacle(Disc(0.5), Stationary((5.0, 0.2)), "rock")
ROBOT, WINDOW = Navigator(NAO, DISC, LIMITS), ObstacleWindow([ROCK], 0.0, 6.0)
TRACKS = slalom.Tracks([(0.0, 4.0)], [(0.0, -0.5)], 0.3)
BEFORE = ROBOT.decide(STATE, [ROCK], GOAL)
PLACES, REST = np.array([(-3.0, 0.0), (3.0, 0.0)]), np.zeros((2, 2))
SEEN = slalom.Sight(9.0, hidden_speed=1.0).look(STATE, [ROCK, TRACKS])
WEIGHING = slalom.ExpectedLoss(slalom.LookAhead(Navigator(slalom.method("nao_ahead"), DISC, LIMITS), budget=100.0))
BLOCKED = slalom.ControlObstacle(slalom.Acceleration(), STATE, WINDOW, DISC)
ADMISSIBLE = LIMITS.admissible(slalom.Acceleration(), STATE, 6.0)
DRIVE = vehicle.DifferentialDrive(0.5, 1.0, 2.0)
POSE = vehicle.Pose((0.0, 0.0), 0.0)


class Odd:
    """An object of another library."""


WRONG: dict[str, Any] = {
    "None": None,
    "no tuple": (),
    "words": ("a", "b"),
    "nested": ((0.0, 1.0), (2.0,)),
    "dictionary": {"x": 1.0},
    "no dictionary": {},
    "text": "text",
    "bytes": b"text",
    "nan": NAN,
    "inf": INF,
    "below zero": -1.0,
    "zero": 0,
    "huge": 1e308,
    "huge whole number": 10**400,
    "complex": 1j,
    "yes": True,
    "object": Odd(),
    "class": Disc,
    "function": lambda *_: 1.0,
    "list of None": [None],
    "list of objects": [Odd(), Odd()],
    "set": {1.0, 2.0},
    "nan vector": (NAN, 0.0),
    "huge vector": (1e308, 1e308),
    "matrix": np.zeros((2, 3)),
    "cube": np.zeros((2, 2, 2)),
    "texts": np.array(["a", "b"]),
    "objects": np.array([None, Odd()], dtype=object),
    "time": np.datetime64("2026-01-01"),
    "iterator": iter(()),
    "space": State((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "obstacle": ROCK,
    "obstacles in space": [Obstacle(slalom.Ball(0.5), Stationary((5.0, 0.2, 0.0)), "balloon")],
    "tracks in space": slalom.Tracks([(0.0, 4.0, 0.0)], [(0.0, -0.5, 0.0)], 0.3),
    "later tracks": slalom.Tracks([(0.0, 4.0)], [(0.0, -0.5)], 0.3, 1.0),
    "tracks with worlds": slalom.Tracks([(0.0, 4.0)], [(0.0, -0.5)], 0.3, worlds=[1]),
}


def decided(**settings: Any) -> object:
    """A decision of a navigator with these settings."""
    return Navigator(**settings).decide(STATE, [ROCK, TRACKS], GOAL, previous=BEFORE)


def looked_ahead(**settings: Any) -> object:
    """A decision of one that looks ahead with these settings."""
    return slalom.LookAhead(**settings).decide(STATE, [ROCK], GOAL)


def among(obstacle: Obstacle) -> object:
    """A decision among an obstacle and others."""
    return ROBOT.decide(STATE, [obstacle, TRACKS], GOAL)


def stepped(**settings: Any) -> object:
    """A step of a fleet with these settings."""
    return slalom.Fleet(**settings).step(0.0, PLACES, REST, -PLACES)


def step(**given: Any) -> object:
    """The second step of a fleet."""
    fleet = slalom.Fleet(NAO, DISC, LIMITS, robots=2)
    fleet.step(0.0, PLACES, REST, -PLACES)
    return fleet.step(**given)


def manoeuvres(robots: Any) -> object:
    """The manoeuvres of some robots of a fleet after its first step."""
    fleet = slalom.Fleet(NAO, DISC, LIMITS, robots=2)
    fleet.step(0.0, PLACES, REST, -PLACES)
    return fleet.manoeuvres(robots)


def tracked(**measured: Any) -> object:
    """A decision among an obstacle that was measured twice."""
    tracker = slalom.Tracker()
    tracker.update(0.0, measured["id"], (4.0, 0.0))
    tracker.update(**measured)
    return ROBOT.decide(STATE, tracker.at(0.2), GOAL, now=0.2)


def tracker(**settings: Any) -> object:
    """A decision among what a tracker with these settings follows."""
    follows = slalom.Tracker(**settings)
    follows.update(0.0, "a", (4.0, 0.0))
    return ROBOT.decide(STATE, follows.at(0.1), GOAL, now=0.1)


def simulated(**settings: Any) -> object:
    """A run of two steps of a scenario with these settings."""
    return simulate(Scenario(**settings), NAO)


def with_robot(**settings: Any) -> object:
    """A run of two steps of a robot with these settings."""
    return simulate(Scenario("one", (Robot(**settings),), (ROCK,), duration=0.2), NAO)


def driven(**settings: Any) -> object:
    """A decision of a vehicle."""
    return vehicle.VehicleNavigator(**settings).decide(POSE, [ROCK], GOAL)


def looped(**settings: Any) -> object:
    """A command of a driver."""
    driver = slalom.Driver(**settings)
    driver.locate(0.0, STATE)
    return driver.command(0.0)


def located() -> slalom.Driver:
    """A driver that knows where it is."""
    driver = slalom.Driver(ROBOT)
    driver.locate(0.0, STATE)
    return driver


SCENE = Scenario("one", (Robot(DISC, LIMITS, STATE, GOAL),), (ROCK,), duration=0.2)
SETTINGS: dict[str, Any] = {"period": 0.1, "horizon": 6.0, "margin": 0.05, "holds": (0.5, 2.0), "patience": 0.1}

CALLS: dict[str, tuple[Callable[..., object], dict[str, Any]]] = {
    "Navigator": (
        decided,
        {
            "method": NAO,
            "robot": DISC,
            "limits": LIMITS,
            **SETTINGS,
            "objective": slalom.Arrive(),
            "horizons": slalom.SafeTime(),
            "detours": (0.5,),
            "stuck_after": 9.0,
        },
    ),
    "Navigator.decide": (
        ROBOT.decide,
        {
            "state": STATE,
            "obstacles": [ROCK],
            "goal": GOAL,
            "robots": TRACKS,
            "now": 0.1,
            "previous": BEFORE,
            "objective": slalom.Arrive(),
            "delay": 0.05,
            "budget": 0.01,
        },
    ),
    "Navigator.fall_back": (ROBOT.fall_back, {"state": STATE, "obstacles": [ROCK], "goal": GOAL, "now": 0.0}),
    "Navigator.predict": (ROBOT.predict, {"obstacles": [ROCK], "state": STATE, "now": 0.0}),
    "LookAhead": (
        looked_ahead,
        {
            "navigator": Navigator(slalom.method("nao_ahead"), DISC, LIMITS),
            "time_horizon": 9.0,
            "deadline": 20.0,
            "budget": 100.0,
            "improvement_budget": 10.0,
            "prepared": None,
        },
    ),
    "LookAhead.decide": (
        slalom.LookAhead(Navigator(slalom.method("nao_ahead"), DISC, LIMITS), budget=100.0).decide,
        {"state": STATE, "obstacles": [ROCK], "goal": GOAL, "now": 0.0, "previous": None, "delay": 0.1},
    ),
    "ExpectedLoss": (
        lambda **settings: slalom.ExpectedLoss(**settings).decide(STATE, [ROCK], GOAL),
        {
            "robot": WEIGHING.robot,
            "margins": (0.1, 0.2),
            "shares": (0.5, 1.0),
            "loss": 9.0,
            "spread": slalom.BoundedError(0.1),
            "deviates": False,
        },
    ),
    "ExpectedLoss.decide": (
        WEIGHING.decide,
        {
            "state": STATE,
            "obstacles": [ROCK],
            "goal": GOAL,
            "now": 0.0,
            "previous": None,
            "delay": 0.1,
            "scales": {"rock": 2.0},
        },
    ),
    "ExpectedLoss.cost": (
        WEIGHING.cost,
        {"decision": BEFORE, "obstacles": [ROCK], "goal": GOAL, "now": 0.0, "scales": {"rock": 2.0}},
    ),
    "ExpectedLoss.contacts": (
        WEIGHING.contacts,
        {"places": PLACES, "obstacles": [ROCK], "times": (0.5, 1.0), "now": 0.0, "scales": {"rock": 2.0}},
    ),
    "Sight": (
        lambda **settings: slalom.Sight(**settings).look(STATE, [ROCK, TRACKS]),
        {"range": 9.0, "field_of_view": 2.0, "near": 0.5, "occlusion": "all", "hidden_speed": 1.0, "any_motion": True},
    ),
    "Sight.look": (
        slalom.Sight(9.0, hidden_speed=1.0).look,
        {"state": STATE, "obstacles": [ROCK, TRACKS], "now": 0.1, "previous": SEEN},
    ),
    "AvoidingCrowd": (
        lambda **settings: slalom.AvoidingCrowd(**settings).predict(TRACKS),
        {
            "period": 0.25,
            "horizon": 5.0,
            "distance": 0.1,
            "reach": 9.0,
            "steps": 4,
            "uncertainty": slalom.BoundedError(0.1),
        },
    ),
    "AvoidingCrowd.predict": (lambda tracks: slalom.AvoidingCrowd(0.25).predict(tracks), {"tracks": TRACKS}),
    "Reciprocity": (
        lambda **settings: slalom.Reciprocity(**settings).update(STATE, TRACKS),
        {"radius": 0.4, "horizon": 4.0, "response": 0.5, "memory": 5.0, "doubt": 0.1},
    ),
    "Reciprocity.update": (lambda **given: slalom.Reciprocity(0.4).update(**given), {"state": STATE, "tracks": TRACKS}),
    "Fleet": (
        stepped,
        {
            "method": NAO,
            "shapes": DISC,
            "limits": LIMITS,
            "robots": 2,
            "names": ("a", "b"),
            "obstacles": [ROCK],
            **SETTINGS,
            "priority": 1.0,
            "worlds": (0, 0),
            "detours": (0.5,),
            "observation_delay": 0.0,
            "observation_noise": 0.0,
            "threads": 1,
            "stuck_after": 9.0,
        },
    ),
    "Fleet.step": (
        step,
        {
            "now": 0.1,
            "positions": PLACES,
            "velocities": REST,
            "targets": -PLACES,
            "accelerations": REST,
            "tolerances": 0.2,
            "stop": True,
            "present": (True, True),
            "others": [ROCK],
        },
    ),
    "Fleet.step to velocities": (
        step,
        {"now": 0.1, "positions": PLACES, "velocities": REST, "desired_velocities": REST},
    ),
    "Fleet.step on paths": (
        step,
        {
            "now": 0.1,
            "positions": PLACES,
            "velocities": REST,
            "paths": [slalom.PathGoal([(-3.0, 0.0), (3.0, 0.0)]), slalom.PathGoal([(3.0, 0.0), (-3.0, 0.0)])],
        },
    ),
    "Fleet.manoeuvres": (manoeuvres, {"robots": (0, 1)}),
    "Tracker": (
        tracker,
        {
            "shape": DISC,
            "filter": slalom.ConstantVelocityFilter(),
            "max_age": 1.0,
            "braking": 1.0,
            "confirmation": 0.3,
            "calibration": slalom.Calibration(),
        },
    ),
    "Tracker.update": (
        tracked,
        {
            "t": 0.1,
            "id": "a",
            "position": (4.0, 0.0),
            "velocity": (0.0, 0.0),
            "covariance": np.eye(4),
            "shape": slalom.Rectangle(1.0, 0.5),
            "heading": 0.0,
        },
    ),
    "Tracker.at": (slalom.Tracker().at, {"now": 0.0}),
    "ConstantVelocityFilter": (
        lambda **settings: tracker(filter=slalom.ConstantVelocityFilter(**settings)),
        {"acceleration": 0.2, "position": 0.1, "velocity": 0.2, "first_velocity": 1.0, "probability": 0.05},
    ),
    "Tracks": (
        lambda **given: among(ROCK) and ROBOT.decide(STATE, [slalom.Tracks(**given)], GOAL),
        {
            "positions": [(4.0, 0.0)],
            "velocities": [(0.0, 0.0)],
            "radii": 0.3,
            "t": 0.0,
            "ids": ("a",),
            "accelerations": [(0.0, 0.0)],
            "forecast": slalom.AtConstantVelocity(),
            "uncertainty": slalom.BoundedError(0.1),
            "worlds": None,
        },
    ),
    "occupancy": (
        lambda **given: ROBOT.decide(STATE, slalom.occupancy(**given), GOAL),
        {
            "grid": np.array([[0, 100, -1]]),
            "resolution": 0.5,
            "origin": (5.0, 0.0, 0.0),
            "occupied": 65,
            "unknown": True,
        },
    ),
    "scan": (
        lambda **given: ROBOT.decide(STATE, slalom.scan(**given), GOAL),
        {
            "ranges": [4.0, 5.0],
            "angles": [0.0, 0.1],
            "pose": (0.0, 0.0, 0.0),
            "radius": 0.1,
            "min_range": 0.1,
            "max_range": 9.0,
        },
    ),
    "OccupancyTable.updated": (
        slalom.occupancy(np.zeros((3, 3), np.int8), 0.5).updated,
        {"part": [[100]], "row": 1, "column": 1},
    ),
    "OccupancyTable.at": (slalom.occupancy([[100]], 0.5).at, {"origin": (1.0, 2.0, 0.0)}),
    "ObstacleTable": (
        lambda obstacles: ROBOT.decide(STATE, slalom.ObstacleTable(obstacles), GOAL),
        {"obstacles": [ROCK]},
    ),
    "Obstacle": (
        lambda **given: among(Obstacle(**given)),
        {
            "shape": slalom.Rectangle(1.0, 0.5),
            "trajectory": Stationary((5.0, 0.0)),
            "name": "a",
            "heading": 0.0,
            "uncertainty": slalom.BoundedError(0.1),
            "after_end": "unknown",
        },
    ),
    "ObstacleWindow": (
        lambda **given: slalom.select(
            (0.0, 0.0), ADMISSIBLE, slalom.ControlObstacle(slalom.Acceleration(), STATE, ObstacleWindow(**given), DISC)
        ),
        {"obstacles": [ROCK], "start": 0.0, "horizon": 6.0, "horizons": (6.0,)},
    ),
    "ControlObstacle": (
        lambda **given: slalom.select((0.0, 0.0), ADMISSIBLE, slalom.ControlObstacle(**given)),
        {
            "response": slalom.Acceleration(),
            "state": STATE,
            "obstacles": WINDOW,
            "robot": DISC,
            "margin": 0.1,
            "horizon": 5.0,
        },
    ),
    "control_obstacle": (
        lambda **given: slalom.select((0.0, 0.0), ADMISSIBLE, slalom.control_obstacle(**given)),
        {
            "response": slalom.Acceleration(),
            "state": STATE,
            "obstacles": [ROCK],
            "robot": DISC,
            "horizon": 5.0,
            "start": 0.0,
            "margin": 0.1,
        },
    ),
    "ControlObstacle.clearances": (BLOCKED.clearances, {"controls": (0.0, 0.0)}),
    "ControlObstacle.contains": (BLOCKED.contains, {"controls": (0.0, 0.0)}),
    "ControlObstacle.time_to_collision": (BLOCKED.time_to_collision, {"controls": (0.0, 0.0)}),
    "ControlObstacle.element": (BLOCKED.element, {"t": 1.0}),
    "ControlObstacle.boundary": (BLOCKED.boundary, {"center": (0.0, 0.0), "radius": 2.0, "tolerance": 0.1}),
    "select": (
        slalom.select,
        {
            "preferred": (0.0, 0.0),
            "admissible": ADMISSIBLE,
            "blocked": BLOCKED,
            "most_elements": 100,
            "most_candidates": 100,
        },
    ),
    "select_clearest": (
        slalom.select_clearest,
        {"preferred": (0.0, 0.0), "admissible": ADMISSIBLE, "blocked": BLOCKED, "enough": 0.1, "accuracy": 0.05},
    ),
    "select_many": (
        slalom.select_many,
        {
            "preferred": [(0.0, 0.0)],
            "states": [STATE],
            "response": slalom.Acceleration(),
            "limits": LIMITS,
            "obstacles": WINDOW,
            "robot": DISC,
            "margin": 0.1,
            "threads": 1,
        },
    ),
    "admissible_ball": (
        lambda **given: slalom.select((0.0, 0.0), slalom.admissible_ball(**given), BLOCKED),
        {"center": (0.0, 0.0), "radius": 2.0},
    ),
    "Limits": (
        lambda **given: Navigator(NAO, DISC, Limits(**given)).decide(STATE, [ROCK], GOAL),
        {
            "max_speed": 2.0,
            "max_acceleration": 2.0,
            "bounds": (slalom.Friction(2.0, 2.0, 2.0),),
            "velocity_bounds": (slalom.HalfSpace((1.0, 0.0), 2.0),),
            "acceleration_bounds": (),
        },
    ),
    "Limits.admissible": (LIMITS.admissible, {"response": slalom.Acceleration(), "state": STATE, "horizon": 6.0}),
    "State": (
        lambda **given: ROBOT.decide(State(**given), [ROCK], GOAL),
        {"position": (0.0, 0.0), "velocity": (1.0, 0.0), "acceleration": (0.0, 0.0), "heading": 0.0},
    ),
    "Goal": (
        lambda **given: ROBOT.decide(STATE, [ROCK], Goal(**given)),
        {"trajectory": Stationary((9.0, 0.0)), "tolerance": 0.5, "stop": True},
    ),
    "PathGoal": (
        lambda **given: ROBOT.decide(STATE, [ROCK], slalom.PathGoal(**given)),
        {"points": [(0.0, 0.0), (9.0, 0.0)], "speeds": (1.0, 1.0), "tolerance": 0.5, "stop": True, "lookahead": 1.0},
    ),
    "method": (slalom.method, {"name": "nao"}),
    "compile": (lambda uses, jobs: slalom.compile(uses, jobs=jobs), {"uses": "figures", "jobs": 1}),
    "Scenario": (
        simulated,
        {
            "name": "one",
            "robots": SCENE.robots,
            "obstacles": (ROCK,),
            "start": 0.0,
            "duration": 0.2,
            "dt": 0.1,
            "replan": 0.0,
            "horizon": 6.0,
            "margin": 0.05,
            "patience": 0.1,
            "holds": (0.5,),
            "guided": True,
            "sight_noise": 0.0,
            "sight_delay": 0.0,
            "sight_loss": 0.0,
            "sight": None,
            "parameters": {},
            "recorded": None,
            "notes": (),
        },
    ),
    "Robot": (
        with_robot,
        {
            "shape": DISC,
            "limits": LIMITS,
            "state": STATE,
            "goal": GOAL,
            "name": "a",
            "method": NAO,
            "margin": 0.05,
            "priority": 1.0,
        },
    ),
    "simulate": (
        simulate,
        {"scenario": SCENE, "method": NAO, "seed": 0, "progress": None, "threads": 1, "record": True},
    ),
    "compare": (
        compare,
        {
            "name": "empty",
            "methods": ["nao"],
            "seeds": 1,
            "settings": {"duration": 0.2},
            "jobs": 1,
            "backend": None,
            "store": None,
            "adopt": False,
            "progress": None,
            "note": None,
        },
    ),
    "DifferentialDrive": (
        lambda **given: driven(vehicle=vehicle.DifferentialDrive(**given), method=NAO, body=DISC),
        {
            "track": 0.5,
            "max_wheel_speed": 1.0,
            "max_wheel_acceleration": 2.0,
            "ahead": 0.3,
            "period": 0.1,
            "max_speed": 1.0,
            "max_acceleration": 1.0,
            "max_turn_rate": 2.0,
            "max_turn_acceleration": 4.0,
            "max_reverse_speed": 0.5,
            "lag": 0.1,
            "delay": 0.1,
        },
    ),
    "Pose": (
        lambda **given: vehicle.VehicleNavigator(DRIVE, NAO, DISC).decide(vehicle.Pose(**given), [ROCK], GOAL),
        {"position": (0.0, 0.0), "heading": 0.0, "speed": 0.0, "turn": 0.0},
    ),
    "VehicleNavigator": (
        driven,
        {
            "vehicle": DRIVE,
            "method": NAO,
            "body": slalom.Rectangle(0.6, 0.4),
            "center": 0.0,
            "horizon": 4.0,
            "margin": 0.05,
            "holds": (0.5,),
            "patience": 0.1,
            "limits": None,
            "reverse_after": 3.0,
        },
    ),
    "Driver": (
        looped,
        {
            "navigator": ROBOT,
            "tracker": slalom.Tracker(),
            "walls": [ROCK],
            "state_timeout": 0.5,
            "detection_timeout": None,
        },
    ),
    "Driver.locate": (lambda **given: slalom.Driver(ROBOT).locate(**given), {"t": 0.0, "state": STATE, "error": 0.0}),
    "Driver.see": (
        lambda **given: slalom.Driver(ROBOT).see(**given),
        {"t": 0.0, "detections": [("person", (1.0, 2.0))]},
    ),
    "Driver.head_for": (lambda **given: located().head_for(**given), {"goal": GOAL}),
    "Driver.command": (lambda **given: located().command(**given), {"now": 0.0, "obstacles": [ROCK]}),
    "VehicleNavigator.decide": (
        vehicle.VehicleNavigator(DRIVE, NAO, DISC).decide,
        {"pose": POSE, "obstacles": [ROCK], "goal": GOAL, "now": 0.0, "previous": None},
    ),
}
"""Public calls with good arguments."""

CHECKS: dict[str, tuple[Callable[[Any], object], tuple[str, ...]]] = {
    "array": (
        lambda value: checks.array(value, "x"),
        ("no tuple", "below zero", "zero", "huge", "yes", "huge vector", "matrix", "cube"),
    ),
    "array_of": (lambda value: checks.array_of(value, "x", (2, 3)), ("matrix",)),
    "vector": (lambda value: checks.vector(value, "x"), ()),
    "vectors": (lambda value: checks.vectors(value, "x"), ("matrix", "cube")),
    "unit": (lambda value: checks.unit(value, "x"), ()),
    "number": (lambda value: checks.number(value, "x"), ("below zero", "zero", "yes")),
    "positive": (lambda value: checks.positive(value, "x"), ("yes",)),
    "duration": (lambda value: checks.duration(value, "x"), ("yes",)),
    "not_negative": (lambda value: checks.not_negative(value, "x"), ("zero", "yes")),
    "not_before": (lambda value: checks.not_before(value, 0.0, "x", "a call"), ("zero", "yes")),
    "share": (lambda value: checks.share(value, "x"), ("zero",)),
    "probability": (lambda value: checks.probability(value, "x"), ("yes",)),
    "fraction": (lambda value: checks.fraction(value, "x"), ()),
    "flag": (lambda value: checks.flag(value, "x"), ("zero", "yes")),
    "flags": (lambda value: checks.flags(value, "x", 2), ("zero", "yes")),
    "each_number": (lambda value: checks.each_number(value, "x", 2), ("below zero", "zero", "yes")),
    "whole": (lambda value: checks.whole(value, "x"), ("zero", "yes")),
    "whole_numbers": (lambda value: checks.whole_numbers(value, "x", 2), ()),
    "text": (lambda value: checks.text(value, "x"), ("text",)),
    "known": (lambda value: checks.known(value, "x", ("text", "a")), ("text",)),
    "mapping": (lambda value: checks.mapping(value, "names", "x"), ("dictionary", "no dictionary")),
}
"""Checks of arguments and fields, and the names of those wrong values that they take."""


@pytest.mark.parametrize("name", CHECKS)
def test_checks_refuse_all_else_by_name(name: str) -> None:
    check, taken = CHECKS[name]
    for what, value in WRONG.items():
        if what in taken:
            check(value)
            continue
        with pytest.raises(InvalidInput, match=r"^x: expected .*[,;] found ") as refused:
            check(value)
        assert "\n" not in str(refused.value), what


FITS_ELSEWHERE = ("matrix", "cube", "space", "yes")
"""Good values, to which the other arguments do not fit: one of these may be named."""

OTHER_NAMES: dict[tuple[str, str], tuple[str, ...]] = {
    ("compare", "name"): ("scenario",),
    ("compare", "methods"): ("method",),
    ("compare", "settings"): ("parameter",),
    ("method", "name"): ("method",),
    ("Scenario", "obstacles"): ("obstacle",),
    ("Sight.look", "state"): ("sight",),
    ("Driver", "walls"): ("obstacles",),
    ("scan", "ranges"): ("angles",),
    ("Driver.see", "detections"): ("obstacle", "id"),
}
"""Further names of what an argument holds."""


BY_CHECK = {
    "positive": """
        Navigator.period, Navigator.horizon, Navigator.stuck_after, LookAhead.time_horizon,
        LookAhead.budget, Sight.field_of_view, AvoidingCrowd.period, AvoidingCrowd.horizon,
        AvoidingCrowd.reach, Reciprocity.horizon, Reciprocity.response, Reciprocity.memory, Fleet.period,
        Fleet.horizon, Fleet.stuck_after, Tracker.max_age, Tracker.confirmation, ConstantVelocityFilter.position,
        ConstantVelocityFilter.velocity, ConstantVelocityFilter.first_velocity, ObstacleWindow.horizon,
        control_obstacle.horizon, ControlObstacle.boundary.radius, select_clearest.accuracy,
        admissible_ball.radius, Limits.max_speed, Limits.max_acceleration, Limits.admissible.horizon,
        Goal.tolerance, PathGoal.tolerance, PathGoal.lookahead, Scenario.duration, Scenario.dt,
        Scenario.horizon, Robot.priority, DifferentialDrive.track, DifferentialDrive.max_wheel_speed,
        DifferentialDrive.max_wheel_acceleration, DifferentialDrive.period, VehicleNavigator.horizon,
        LaggedVelocity.lag, AccelerateThenCoast.hold, AccelerateThenStop.hold, AccelerateThenStop.rate,
        AccelerateThenStop.period, AccelerateThenBrake.hold, AccelerateThenBrake.brake, Circular.radius,
        Function.tolerance, MostClearance.enough, Capsule.radius, Rectangle.length, Rectangle.width,
        Friction.forward, Friction.braking, Friction.lateral, HeadingCone.half_angle, TurningRadius.least,
        LeastSpeed.least, AcceleratingBriefly.seconds, FromPast.seconds, HorizonByName.otherwise,
        Calibration.max_gap, AccelerationLag.lag, AccelerationSequence.hold, Bicycle.wheelbase,
        Bicycle.max_steering, Bicycle.max_steering_rate, Bicycle.max_speed, Bicycle.max_acceleration,
        Bicycle.period, Driver.state_timeout
    """,
    "not_negative": """
        Navigator.margin, Navigator.patience, Navigator.decide.delay, LookAhead.improvement_budget,
        LookAhead.decide.delay, ExpectedLoss.loss, ExpectedLoss.decide.delay, Sight.near,
        AvoidingCrowd.distance, Reciprocity.radius, Reciprocity.doubt, Fleet.patience,
        Fleet.observation_delay, Fleet.observation_noise, ConstantVelocityFilter.acceleration,
        ControlObstacle.boundary.tolerance, select_clearest.enough, select_many.margin, Scenario.replan,
        Scenario.margin, Scenario.patience, Scenario.sight_noise,
        Scenario.sight_delay,
        DifferentialDrive.delay,
        VehicleNavigator.margin, VehicleNavigator.patience, VehicleNavigator.reverse_after,
        Velocity.ramp, Function.max_speed,
        Function.max_acceleration, Arrive.enough_clearance, KeepAcceleration.enough_clearance,
        FollowAcceleration.enough_clearance, FollowVelocity.enough_clearance, Disc.radius, Ball.radius,
        Rectangle.radius, Polygon.radius, Polyline.radius, FromPast.growth,
        BoundedError.position, BoundedError.velocity, BoundedError.acceleration,
        GaussianError.position, GaussianError.velocity, KalmanError.position, KalmanError.velocity,
        KalmanError.correlation, KalmanError.acceleration, Risk.likely, SafeTime.extra, Bicycle.delay,
        Bicycle.max_reverse_speed, Driver.locate.error
    """,
    "number": """
        Navigator.decide.now, Navigator.fall_back.now, Navigator.predict.now, LookAhead.decide.now,
        ExpectedLoss.decide.now, ExpectedLoss.cost.now, ExpectedLoss.contacts.now, Sight.look.now,
        AvoidingCrowd.steps, Fleet.step.now, Fleet.step to velocities.now, Fleet.step on paths.now,
        Tracker.update.t, Tracker.at.now, Tracks.t, ObstacleWindow.start, ControlObstacle.horizon,
        control_obstacle.start, ControlObstacle.element.t, select.most_elements, select.most_candidates,
        select_many.threads, compile.jobs, Scenario.start, compare.seeds, compare.jobs, Pose.heading,
        Pose.speed, Pose.turn, VehicleNavigator.center, VehicleNavigator.decide.now, ConstantVelocity.at,
        ConstantAcceleration.at, Circular.speed, Circular.phase, PiecewisePolynomial.start, Function.first,
        Function.last, Manoeuvre.start, FromModels.futures, HalfSpace.offset, Driver.see.t,
        Driver.command.now, Driver.locate.t
    """,
    "flag": """
        ExpectedLoss.deviates, Sight.any_motion, Goal.stop, PathGoal.stop, simulate.record, compare.adopt,
        Obstacle.contact_at_rest, Scenario.guided
    """,
    "array": """
        ExpectedLoss.contacts.places, ExpectedLoss.contacts.times, Fleet.margin, Fleet.priority,
        Fleet.step.positions, Fleet.step.velocities, Fleet.step.tolerances, Fleet.step.stop, Fleet.step to
        velocities.positions, Fleet.step to velocities.velocities, Fleet.step on paths.positions, Fleet.step
        on paths.velocities, Tracks.positions, Tracks.velocities, Tracks.radii, ControlObstacle.margin,
        control_obstacle.margin, ControlObstacle.clearances.controls, ControlObstacle.contains.controls,
        ControlObstacle.time_to_collision.controls, ControlObstacle.boundary.center, select.preferred,
        select_clearest.preferred, select_many.preferred, select_many.states, State.velocity,
        PathGoal.points, Sampled.times, PiecewisePolynomial.durations, PiecewisePolynomial.coefficients,
        Polygon.corners, Polyline.points
    """,
    "vector": """
        Tracker.update.position, admissible_ball.center, State.position, Pose.position,
        Stationary.initial_position, ConstantVelocity.initial_position, ConstantVelocity.initial_velocity,
        ConstantAcceleration.initial_position, ConstantAcceleration.initial_velocity,
        ConstantAcceleration.initial_acceleration, Circular.center, Manoeuvre.control,
        FollowAcceleration.acceleration, FollowVelocity.velocity, Capsule.start, Capsule.end,
        Box.half_widths, HalfSpace.normal
    """,
    "fraction": """
        ConstantVelocityFilter.probability, GaussianError.probability, KalmanError.probability,
        Calibration.confidence, FromModels.coverage
    """,
    "text": """
        Obstacle.name, method.name, Scenario.name, Robot.name
    """,
    "share": """
        Scenario.sight_loss
    """,
    "whole": """
        simulate.seed, FromModels.similar
    """,
    "vectors": """
        Sampled.positions, ConvexPolygon.corners
    """,
    "probability": """
        Obstacle.probability
    """,
}
"""Arguments and fields by the check that they must pass: what it refuses, they refuse with its message."""
CHECK_OF = {name: check for check, names in BY_CHECK.items() for name in " ".join(names.split()).split(", ")}


def refusal(name: str, value: object) -> str:
    """What the check of an argument or field says of a value; nothing if it takes it, or if there is no check."""
    if name not in CHECK_OF:
        return ""
    try:
        CHECKS[CHECK_OF[name]][0](value)
    except InvalidInput as refused:
        return str(refused).removeprefix("x")
    return ""


def test_checks_are_of_arguments_and_fields() -> None:
    assert set(CHECK_OF) <= {f"{name}.{argument}" for name, (_, good) in CALLS.items() for argument in good} | set(
        FIELDS
    )


@pytest.mark.parametrize("name", CALLS)
def test_good_arguments_are_taken(name: str) -> None:
    call, good = CALLS[name]
    call(**good)


ARGUMENTS = [pytest.param(name, a, id=f"{name}-{a}") for name, (_, good) in CALLS.items() for a in good]


@pytest.mark.parametrize(("name", "argument"), draws(ARGUMENTS, 60))
def test_wrong_arguments_are_taken_or_refused_by_name(
    name: str, argument: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """TypeError is only for a wrong number or name of arguments. Texts that name folders are taken, in an empty one."""
    monkeypatch.chdir(tmp_path)
    call, good = CALLS[name]
    mistakes = []
    for what, value in WRONG.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                call(**{**good, argument: value})
            if refusal(f"{name}.{argument}", value):
                mistakes.append(f"{what}: taken")
        except InvalidInput as refused:
            if refusal(f"{name}.{argument}", value) not in str(refused):
                mistakes.append(f"{what}: {refused}")
            names = [argument, *OTHER_NAMES.get((name, argument), ()), *(good if what in FITS_ELSEWHERE else ())]
            if not re.search(rf"\b({'|'.join(names)})", str(refused)) or "\n" in str(refused):
                mistakes.append(f"{what}: {refused}")
        except Exception as other:
            mistakes.append(f"{what}: {type(other).__name__}: {other}")
    assert not mistakes, "\n".join(mistakes)


PARTS = (
    *(parts.RESPONSES | parts.PLANE_RESPONSES).values(),
    *(
        make(2)
        for kinds in (parts.TRAJECTORIES, parts.MANOEUVRES, parts.OBJECTIVES, parts.LIMITS)
        for make in kinds.values()
    ),
    *(make(0.5, 2) for make in parts.SHAPES.values()),
    *(bound for make in parts.BOUNDS.values() for bound in make(2)),
    *(*parts.FORECASTS.values(), slalom.FromPast(slalom.AtConstantVelocity()), slalom.FromModels()),
    *(*parts.UNCERTAINTIES.values(), slalom.HalfSpace((1.0, 0.0), 1.0), slalom.Risk(), slalom.Sight()),
    *(slalom.SafeTime(), slalom.HorizonByName({"rock": 1.0}, 2.0), slalom.Calibration(), slalom.AccelerationLag(0.3)),
    *(slalom.AccelerationSequence(0.5, ((1.0, (0.0, 1.0)),)), vehicle.Bicycle(1.0, 0.5, 0.5, 2.0, 2.0)),
    *(slalom.LookAhead(ROBOT), ROCK, slalom.Reciprocity(0.5), slalom.AvoidingCrowd(0.25)),
)
"""An example of every part that is a dataclass; of kinds with several, the last one counts."""
FIELDS = {
    f"{kind.__name__}.{field.name}": (part, field.name)
    for kind, part in {type(part): part for part in PARTS if type(part) is not parts.Moved}.items()
    for field in fields(part)
    if field.init
}


@pytest.mark.parametrize("name", FIELDS)
def test_wrong_fields_are_taken_or_refused_by_name(name: str) -> None:
    """The constructor raises nothing but InvalidInput, which names the field or one that does not fit to it."""
    part, field = FIELDS[name]
    names = "|".join(other.name for other in fields(part))
    mistakes = []
    for what, value in WRONG.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                replace(part, **{field: value})
            if refusal(name, value):
                mistakes.append(f"{what}: taken")
        except InvalidInput as refused:
            if refusal(name, value) not in str(refused):
                mistakes.append(f"{what}: {refused}")
            if not re.search(rf"\b({names})", str(refused)) or "\n" in str(refused):
                mistakes.append(f"{what}: {refused}")
        except Exception as other:
            mistakes.append(f"{what}: {type(other).__name__}: {other}")
    assert not mistakes, "\n".join(mistakes)
