"""One robot alone through each entry point that decides, and the motion that results."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from easy_worlds import RADIUS, Decide, Driven, World, alone, driven
from ros_messages import odom, pose

from slalom import METHODS, Driver, Fleet, Navigator, State
from slalom.adapters.ros.node import Node
from slalom.model.shape import Disc
from slalom.sim import simulate
from slalom.sim.scenario import Robot, Scenario
from slalom.vehicle import Command, DifferentialDrive, Pose, VehicleNavigator

FIRST = 10.0
"""[s] Stamp of the first message: one of 0 is refused."""
NAO = METHODS["nao"]

Steer = Callable[[Pose, float], Command]
"""The command for a vehicle at a pose and a time [s]."""


def of_fleet(world: World) -> Decide:
    """Accelerations of a fleet of one."""
    fleet = Fleet(NAO, Disc(RADIUS), world.limits, robots=1, period=world.period)

    def decide(state: State, now: float) -> np.ndarray:
        settings = {"tolerances": world.tolerance, "stop": world.stop}
        return fleet.step(now, state.position[None], state.velocity[None], [world.place], **settings).accelerations[0]

    return decide


def of_node(world: World) -> Decide:
    """Accelerations of the node, with the heading 0, from messages."""
    node = Node(Driver(Navigator(NAO, Disc(RADIUS), world.limits, period=world.period)))
    node.head_for(world.goal)

    def decide(state: State, now: float) -> np.ndarray:
        return node.receive(odom(FIRST + now, pose(*state.position), (*state.velocity, 0.0))).acceleration

    return decide


def scenario(world: World, duration: float) -> Scenario:
    """The world as a scenario."""
    robot = Robot(Disc(RADIUS), world.limits, world.state, world.goal)
    return Scenario("alone", (robot,), dt=world.period, duration=duration)


def by_decisions(decisions: Callable[[World], Decide]) -> Callable[[World, float, float], Driven]:
    """The motion of a robot that applies the accelerations of an entry point."""
    return lambda world, latest, after: driven(decisions(world), world, latest, after)


def by_simulation(world: World, latest: float, after: float) -> Driven:
    """The run of the simulator, which ends with the arrival."""
    run = simulate(scenario(world, latest), NAO, threads=1)
    arrived = float(run.arrived[0]) if np.isfinite(run.arrived[0]) else None
    return Driven(run.times[:-1], run.positions[:-1, 0], run.velocities[:-1, 0], run.accelerations[:, 0], arrived)


def by_environment(world: World, latest: float, after: float) -> Driven:
    """An episode, which ends with the arrival; its actions are the decisions of a navigator."""
    pytest.importorskip("gymnasium", reason="the package gymnasium is not installed")
    from slalom.adapters.gym import RobotEnv

    env, decide, rows, going = RobotEnv(scenario(world, latest)), alone("nao", world), [], True
    env.reset(seed=0)
    while going:
        now, state = env.worlds.now(), env.worlds.state()
        acceleration = decide(State(state.position.copy(), state.velocity.copy()), now)
        rows.append((now, state.position.copy(), state.velocity.copy(), acceleration))
        _, _, ended, late, info = env.step(acceleration / world.max_acceleration)
        going = not (ended or late)
    columns = (np.array(each) for each in zip(*rows, strict=True))
    return Driven(*columns, info["time"] if info["is_success"] else None)


ENTRIES: dict[str, Callable[[World, float, float], Driven]] = {
    "Navigator": by_decisions(lambda world: alone("nao", world)),
    "LookAhead": by_decisions(lambda world: alone("nao_ahead", world)),
    "Fleet": by_decisions(of_fleet),
    "Node": by_decisions(of_node),
    "simulate": by_simulation,
    "RobotEnv": by_environment,
}
"""Entry points for robots that move in every direction."""
ENDING = ("simulate", "RobotEnv")
"""Those that end with the arrival."""


def drive_of(world: World) -> DifferentialDrive:
    """Wheels with the limits of the world, decided for a point as far ahead as the body."""
    return DifferentialDrive(0.4, world.max_speed, world.max_acceleration, ahead=RADIUS, period=world.period)


def of_vehicle(world: World) -> Steer:
    """Commands of a `VehicleNavigator`."""
    robot, previous = VehicleNavigator(drive_of(world), NAO, Disc(RADIUS)), None

    def steer(at: Pose, now: float) -> Command:
        nonlocal previous
        previous = robot.decide(at, [], world.goal, now=now, previous=previous)
        return previous.command

    return steer


def of_node_with_wheels(world: World) -> Steer:
    """Commands of a node, from messages."""
    node = Node(Driver(VehicleNavigator(drive_of(world), NAO, Disc(RADIUS))))
    node.head_for(world.goal)

    def steer(at: Pose, now: float) -> Command:
        command = node.receive(odom(FIRST + now, pose(*at.position, at.heading), (at.speed, 0.0, at.turn)))
        return Command(float(command.linear[0]), command.angular)

    return steer


WHEELS: dict[str, Callable[[World], Steer]] = {"VehicleNavigator": of_vehicle, "Node": of_node_with_wheels}
"""Entry points for vehicles."""


class Wheeled(NamedTuple):
    """Steps of a vehicle: times (n,) [s], positions (n, 2) [m], commands (n, 2) [m/s, rad/s]; arrival [s] or None."""

    times: np.ndarray
    positions: np.ndarray
    commands: np.ndarray
    arrived: float | None


def distance(begin: np.ndarray, end: np.ndarray, place: np.ndarray) -> float:
    """Distance [m] of a place from the line between two points (2,)."""
    way = end - begin
    share = np.clip((place - begin) @ way / max(way @ way, 1e-300), 0.0, 1.0)
    return float(np.linalg.norm(begin + share * way - place))


def driven_on_wheels(steer: Steer, world: World, heading: float, latest: float, after: float) -> Wheeled:
    """The motion of a differential drive from rest; it passes a goal where the chord of a step does."""
    drive, at, k, arrived, h = drive_of(world), Pose(world.start, heading), 0, None, world.period
    rows: list[tuple[float, np.ndarray, Command]] = []
    while k * h <= (latest if arrived is None else arrived + after):
        if arrived is None and world.is_there(at.position, at.velocity, k * h):
            arrived = k * h
        command = steer(at, k * h)
        rows.append((k * h, at.position, command))
        before, at, k = at.position, drive.drive(at, command), k + 1
        if (
            not world.stop
            and arrived is None
            and distance(before, at.position, np.array(world.place)) <= world.tolerance
        ):
            arrived = k * h
    return Wheeled(*(np.array(each) for each in zip(*rows, strict=True)), arrived)
