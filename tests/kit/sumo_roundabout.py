"""A roundabout of SUMO with live traffic, and robots that cross it one after the other."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from slalom import BoundedError, Disc, Goal, Limits, Navigator, Stationary, method

NET = Path(__file__).parents[1] / "data" / "sumo" / "roundabout.net.xml"
ARMS = (0, 2, 4, 6)


class Crossings(NamedTuple):
    """Crossings that arrived, steps with an overlap of bodies, steps in which SUMO reports a collision with the robot,

    times [s] of crossings, decisions that were not safe, and the least distance [m] of the bodies.
    """

    arrived: int
    overlaps: int
    reported: int
    times: list[float]
    unsafe: int
    near: float


def routes(flow: int) -> str:
    """Cars from each arm to each other one, `flow` an hour and pair, and the vehicle that is the robot."""
    rows = ['<routes><vType id="car" length="4.5" width="1.8" accel="2" decel="4.5" sigma="0.3"/>']
    rows.append('<vType id="robot" length="2" width="2"/><route id="start" edges="in0"/>')
    rows.append('<vehicle id="robot" type="robot" route="start" depart="0"/>')
    rows += [
        f'<flow id="f{a}{b}" type="car" from="in{a}" to="out{b}" begin="0" end="99999" vehsPerHour="{flow}"/>'
        for a in ARMS
        for b in ARMS
        if a != b
    ]
    return "\n".join([*rows, "</routes>"])


def cross(
    folder: Path,
    crossings: int,
    seed: int,
    straight: bool = False,
    error: float = 0.3,
    flow: int = 150,
    margin: float = 1.2,
) -> Crossings:
    """Cross the roundabout; `straight` is a robot that sees no cars."""
    import libsumo

    from slalom.adapters.sumo import Robot, body

    (folder / "routes.xml").write_text(routes(flow))
    options = ["-n", str(NET), "-r", str(folder / "routes.xml"), "--step-length", "0.1", "--seed", str(seed)]
    options += [
        "--collision.action",
        "warn",
        "--collision.mingap-factor",
        "0",
        "--lateral-resolution",
        "0.4",
        "--no-step-log",
        "--no-warnings",
        "--time-to-teleport",
        "-1",
    ]
    libsumo.start(["sumo", *options])
    rng, dt = np.random.default_rng(seed), 0.1
    navigator = Navigator(method("nao"), Disc(1.0), Limits(8.0, 4.0), period=dt, horizon=4.0, margin=margin)
    robot, arrived, overlaps, reported, unsafe, times = (
        Robot(libsumo, navigator, uncertainty=BoundedError(0.1, error)),
        0,
        0,
        0,
        0,
        [],
    )
    near = np.inf
    if straight:
        robot._cars = lambda now: []
    libsumo.simulationStep()
    robot.place((45.0, 20.0))
    for _ in range(300):
        robot.place((45.0, 20.0))
        libsumo.simulationStep()
    for _ in range(crossings):
        angle = 0.5 * np.pi * rng.integers(4) + np.radians(22.5 + rng.uniform(-8.0, 8.0))
        place = 40.0 * np.array([np.cos(angle), np.sin(angle)])
        robot.place(place)
        goal = Goal(Stationary(-place), 1.0)
        for k in range(1200):
            unsafe += not robot.step(goal).safe
            libsumo.simulationStep()
            disc = shapely.Point(robot.state.position).buffer(1.0)
            cars = []
            for name in libsumo.vehicle.getIDList():
                if name != "robot":
                    x, y, heading, length, width = body(libsumo, name)
                    c, s = np.cos(heading), np.sin(heading)
                    corners = 0.5 * np.array([(-length, -width), (length, -width), (length, width), (-length, width)])
                    cars.append(corners @ np.array([[c, s], [-s, c]]) + (x, y))
            gap = min((disc.distance(shapely.Polygon(car)) for car in cars), default=np.inf)
            near = min(near, gap)
            if gap == 0.0:
                overlaps += 1
            reported += sum("robot" in (c.collider, c.victim) for c in libsumo.simulation.getCollisions())
            if goal.reached(robot.state.position, robot.state.velocity, 0.0):
                arrived += 1
                times.append((k + 1) * dt)
                break
    libsumo.close()
    return Crossings(arrived, overlaps, reported, times, unsafe, float(near))
