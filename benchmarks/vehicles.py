"""Vehicles and a quadrotor that follow decisions inexactly: collisions, arrivals and times against exact execution.

usage: python benchmarks/vehicles.py [--seeds 20] [--scenarios corridor crowdnav] [--plants drive bicycle] [--quick]

`exact` is a disc that moves exactly as decided, under the limits of the row below it. `judged` is a vehicle on wheels
that decides by the motion of its body (`VehicleNavigator`). The wheels are integrated here by Runge-Kutta, apart from
the library. `followed` is the rigid body of the quadrotor of rotorpy (pip install rotorpy) with its controller, the
robot grown by its error, which is stated below. Obstacles follow their known trajectories; the body is looked at 10
times in each period.
"""

import argparse
from math import cos, sin, tan
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from program import finish, options, table, target

from slalom import ConstantVelocity, Decision, Limits, Navigator, ObstacleTable, State, method
from slalom.model.shape import Disc
from slalom.sim import gallery
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import clearances
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, Vehicle, VehicleNavigator

SAMPLES, PERIOD = 10, 0.1
SCENARIOS = ("roundabout_crossing", "corridor", "crowdnav")
DRIVES = {
    "roundabout_crossing": DifferentialDrive(1.2, 10.0, 12.0, max_speed=8.0, max_acceleration=4.0),
    "corridor": DifferentialDrive(0.4, 2.0, 6.0, max_speed=1.5, max_acceleration=1.5),
    "crowdnav": DifferentialDrive(0.4, 2.0, 6.0, max_speed=1.0, max_acceleration=1.5),
}
BICYCLES = {
    "roundabout_crossing": Bicycle(1.0, 0.6, 20.0, 8.0, 4.0, max_reverse_speed=0.5),
    "corridor": Bicycle(0.3, 0.7, 8.0, 1.5, 1.0, max_reverse_speed=0.5),
    "crowdnav": Bicycle(0.3, 0.7, 8.0, 1.0, 1.0, max_reverse_speed=0.5),
}
QUADROTOR_ERROR = {"roundabout_crossing": 0.12, "corridor": 0.015, "crowdnav": 0.015}
"""[m] Stated largest distance of the quadrotor from its plan, measured on the same scenarios and rounded up."""
LAG, SMOOTHING = 0.08, 0.05
"""[s] The quadrotor tilts by its acceleration this long ago; setpoints are means over twice the smoothing time."""


class Run(NamedTuple):
    """What happened in one run."""

    arrived: bool
    time: float  # [s]
    clearance: float  # [m]
    off: float  # [m], largest distance of the controlled point from its plan
    slowest: float  # [s] of a decision


class Exact:
    """A disc that moves exactly as decided."""

    error = delay = 0.0

    def __init__(self, scenario: Scenario, limits: Limits) -> None:
        self.scenario, self.limits, self.body = scenario, limits, scenario.robot.shape
        self.now = scenario.robot.state

    def state(self, decision: Decision | None, t: float) -> State:
        return self.now

    def goal(self, t: float) -> Any:
        return self.scenario.robot.goal

    def place(self) -> tuple[np.ndarray, np.ndarray]:
        """The position [m] and velocity [m/s] that arrive."""
        return self.now.position, self.now.velocity

    def advance(self, decision: Decision, t: float) -> tuple[np.ndarray, float]:
        """Positions (SAMPLES, 2) [m] of the body, and the largest distance from the plan."""
        a, now = decision.manoeuvre.mean_acceleration(t, PERIOD), self.now
        s = PERIOD * np.arange(1, SAMPLES + 1)[:, None] / SAMPLES
        self.now = State(now.position + PERIOD * now.velocity + 0.5 * PERIOD**2 * a, now.velocity + PERIOD * a, a)
        return now.position + s * now.velocity + 0.5 * s * s * a, 0.0


class Wheeled:
    """A vehicle on wheels, integrated by Runge-Kutta."""

    def __init__(self, scenario: Scenario, vehicle: Vehicle) -> None:
        robot = scenario.robot
        self.scenario, self.vehicle, self.limits = scenario, vehicle, vehicle.limits
        self.center = vehicle.lever if isinstance(vehicle, Bicycle) else 0.0
        way, v = robot.goal.position(scenario.start) - robot.state.position, robot.state.velocity
        ahead = v if v.any() else way
        heading = float(np.arctan2(ahead[1], ahead[0]))
        e = np.array([cos(heading), sin(heading)])
        speed = min(float(np.linalg.norm(v)), vehicle.limits.max_speed)
        self.pose = Pose(robot.state.position - self.center * e, heading, speed)

    def place(self) -> tuple[np.ndarray, np.ndarray]:
        return self.pose.position, self.pose.velocity

    def rates(self, y: np.ndarray, s: float, begin: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
        v, turn = (b + s / PERIOD * (e - b) for b, e in zip(begin, end))
        rate = v * tan(turn) / self.vehicle.wheelbase if isinstance(self.vehicle, Bicycle) else turn
        return np.array([v * cos(y[2]), v * sin(y[2]), rate])

    def advance(self, decision: Any, t: float) -> tuple[np.ndarray, float]:
        command = decision.command
        begin, y = (self.pose.speed, self.pose.turn), np.array([*self.pose.position, self.pose.heading])
        h, path, off = PERIOD / SAMPLES, [], 0.0
        for k in range(SAMPLES):
            s = k * h
            k1 = self.rates(y, s, begin, command)
            k2 = self.rates(y + 0.5 * h * k1, s + 0.5 * h, begin, command)
            k3 = self.rates(y + 0.5 * h * k2, s + 0.5 * h, begin, command)
            y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + self.rates(y + h * k3, s + h, begin, command))
            e = np.array([cos(y[2]), sin(y[2])])
            point = y[:2] + self.vehicle.lever * e
            off = max(off, float(np.linalg.norm(point - decision.manoeuvre.position(t + s + h))))
            path.append(y[:2] + self.center * e)
        self.pose = Pose(y[:2], y[2], *command)
        return np.array(path), off


class Quadrotor:
    """The rigid body of rotorpy, whose controller follows setpoints of the plan.

    Decisions begin to act `delay` later, so that the plan is known as far ahead as setpoints need it. Position and
    velocity are those of the plan, the acceleration is that of the plan LAG later, with the drag at that velocity.
    """

    delay = LAG + SMOOTHING

    def __init__(self, scenario: Scenario) -> None:
        from rotorpy.controllers.quadrotor_control import SE3Control
        from rotorpy.vehicles.hummingbird_params import quad_params as params
        from rotorpy.vehicles.multirotor import Multirotor

        robot, name = scenario.robot, scenario.name
        self.scenario, self.error = scenario, QUADROTOR_ERROR[name]
        self.limits, self.body = robot.limits, Disc(robot.shape.bounding_radius + self.error)
        hover = np.sqrt(params["mass"] * 9.81 / (4.0 * params["k_eta"]))
        # Fitted to runs of these scenarios: rotors turn faster in flight than in hover, which adds drag.
        self.drag = 4.4 * hover * params["k_d"] / params["mass"], 1.65 * params["c_Dx"] / params["mass"]
        self.now = {"x": np.append(robot.state.position, 0.0), "v": np.append(robot.state.velocity, 0.0)}
        self.now |= {"q": np.array([0.0, 0.0, 0.0, 1.0]), "w": np.zeros(3), "wind": np.zeros(3)}
        self.now |= {"rotor_speeds": np.full(4, hover)}
        self.plant, self.controller = Multirotor(params, self.now), SE3Control(params)
        self.before = ConstantVelocity(
            robot.state.position - scenario.start * robot.state.velocity, robot.state.velocity
        )

    def plan(self, decision: Decision, t: float) -> Any:
        """The motion to which the robot is committed at time t [s]."""
        begun = [plan for plan in (*decision.earlier, decision.manoeuvre) if plan.start <= t + 1e-9]
        return begun[-1] if begun else self.before

    def state(self, decision: Decision | None, t: float) -> State:
        x, v = self.now["x"][:2], self.now["v"][:2]
        if decision is not None:
            plan = self.plan(decision, t)
            planned = State(plan.position(t), plan.velocity(t), plan.acceleration(t))
            if np.linalg.norm(x - planned.position) <= self.error:
                return planned
        return State(x, v)

    def goal(self, t: float) -> Any:
        return self.scenario.robot.goal

    def place(self) -> tuple[np.ndarray, np.ndarray]:
        return self.now["x"][:2], self.now["v"][:2]

    def mean(self, decision: Decision, name: str, t: float) -> np.ndarray:
        """Mean (2,) of a derivative of the plan around time t [s]."""
        times = t + SMOOTHING * np.linspace(-0.875, 0.875, 8)
        return np.mean([getattr(self.plan(decision, s), name)(s) for s in times], axis=0)

    def advance(self, decision: Decision, t: float) -> tuple[np.ndarray, float]:
        h, path, off, (linear, quadratic) = PERIOD / SAMPLES, [], 0.0, self.drag
        flat = {name: np.zeros(3) for name in ("x_dddot", "x_ddddot")} | {"yaw": 0.0, "yaw_dot": 0.0}
        for k in range(SAMPLES):
            s = t + k * h
            v = self.mean(decision, "velocity", s + LAG)
            a = self.mean(decision, "acceleration", s + LAG) + (linear + quadratic * np.linalg.norm(v)) * v
            flat |= {"x": np.append(self.mean(decision, "position", s), 0.0), "x_ddot": np.append(a, 0.0)}
            flat |= {"x_dot": np.append(self.mean(decision, "velocity", s), 0.0)}
            self.now = self.plant.step(self.now, self.controller.update(s, self.now, flat), h)
            path.append(self.now["x"][:2])
            off = max(off, float(np.linalg.norm(path[-1] - self.plan(decision, s + h).position(s + h))))
        return np.array(path), off


def run(scenario: Scenario, plant: Any, navigator: Any, judged: bool = False) -> Run:
    """One run; the largest decision time leaves out the first two decisions."""
    obstacles, goal, decision, robot = ObstacleTable(scenario.obstacles), scenario.robot.goal, None, scenario.robot
    least, off, took, t, before = np.inf, 0.0, [0.0], scenario.start, plant.place()[0]
    for k in range(round(scenario.duration / PERIOD)):
        t, (position, velocity) = scenario.start + k * PERIOD, plant.place()
        # A goal to pass may lie on the way since the last decision.
        passed = not goal.stop and goal.reached_during(before, (position - before) / PERIOD, 0.0, t - PERIOD, PERIOD)
        before = position
        if passed or goal.reached(position, velocity, t):
            return Run(True, t - scenario.start, least, off, max(took[2:], default=0.0))
        begin = perf_counter()
        if judged:
            decision = navigator.decide(plant.pose, obstacles, goal, now=t, previous=decision)
        else:
            state, late = plant.state(decision, t), plant.delay
            decision = navigator.decide(state, obstacles, plant.goal(t), now=t + late, previous=decision, delay=late)
        took.append(perf_counter() - begin)
        path, away = plant.advance(decision, t)
        times, off = t + PERIOD * np.arange(1, SAMPLES + 1) / SAMPLES, max(off, away)
        for obstacle in scenario.obstacles:
            exists = np.array([obstacle.exists(time) for time in times])
            if exists.any():
                least = min(least, float(clearances(obstacle, robot.shape, times[exists], path[exists]).min()))
    return Run(False, t - scenario.start, least, off, max(took[2:], default=0.0))


def navigator_of(scenario: Scenario, shape: Any, limits: Limits) -> Navigator:
    """The navigator of a point with a round robot."""
    settings = {"period": PERIOD, "horizon": scenario.horizon, "margin": scenario.margin}
    return Navigator(method("nao"), shape, limits, **settings, patience=scenario.patience)


def runs(name: str, plant: str, seeds: int, seconds: float | None) -> dict[str, list[Run]]:
    """All runs of a plant in a scenario, by the way of execution."""
    found: dict[str, list[Run]] = {}
    for seed in range(seeds):
        scenario = gallery.build(name, seed=seed)
        if seconds is not None:
            scenario = scenario.with_settings({"duration": seconds})
        if plant == "quadrotor":
            made: dict[str, Any] = {"followed": Quadrotor(scenario)}
        else:
            vehicle = (DRIVES if plant == "drive" else BICYCLES)[name]
            made = {"judged": Wheeled(scenario, vehicle)}
        for way, body in made.items():
            exact = Exact(scenario, body.limits)
            before = run(scenario, exact, navigator_of(scenario, exact.body, body.limits))
            found.setdefault(f"exact, limits of {way}", []).append(before)
            if way == "followed":
                navigator: Any = navigator_of(scenario, body.body, body.limits)
            else:
                navigator = VehicleNavigator(
                    body.vehicle,
                    method("nao"),
                    scenario.robot.shape,
                    body.center,
                    horizon=scenario.horizon,
                    margin=scenario.margin,
                    patience=scenario.patience,
                )
            found.setdefault(way, []).append(run(scenario, body, navigator, way == "judged"))
    return found


def summary(name: str, plant: str, found: dict[str, list[Run]]) -> list[list[Any]]:
    """Rows of the table."""
    rows = []
    for way, each in found.items():
        exact = found[way if way.startswith("exact") else f"exact, limits of {way}"]
        both = [(a.time, b.time) for a, b in zip(each, exact, strict=True) if a.arrived and b.arrived]
        times = np.array(both or [(np.nan, np.nan)])
        rows.append(
            [
                f"{name}, {plant}, {way}",
                len(each),
                sum(one.clearance < -1e-6 for one in each),
                sum(one.arrived for one in each),
                float(times[:, 0].mean()),
                float(times[:, 0].mean() / times[:, 1].mean()),
                min(one.clearance for one in each),
                1e3 * max(one.off for one in each),
                1e3 * max(one.slowest for one in each),
            ]
        )
    return rows


HEADS = ["run", "runs", "collided", "arrived", "time s", "of exact", "clearance m", "off plan mm", "decision ms"]


def compare(arguments: argparse.Namespace) -> dict[str, Any]:
    """Tables and targets."""
    seeds, seconds = (1, 1.0) if arguments.quick else (arguments.seeds, None)
    rows = []
    for name in arguments.scenarios:
        for plant in arguments.plants:
            new = summary(name, plant, runs(name, plant, seeds, seconds))
            rows += new
    inexact = [row for row in rows if row[0].endswith(("judged", "followed"))]
    return {
        "question": "Do vehicles that follow their plans inexactly collide, and what do they lose?",
        "tables": [table("Vehicles against exact execution under the same limits", HEADS, rows)],
        "targets": [
            target("runs that collided", float(sum(row[2] for row in inexact)), most=0.0),
            target("runs that did not arrive", float(sum(row[1] - row[3] for row in inexact)), most=0.0),
            target("largest mean time, exact execution = 1", max(row[5] for row in inexact), most=1.1),
        ],
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--scenarios", nargs="+", default=list(SCENARIOS), choices=SCENARIOS)
    parser.add_argument("--plants", nargs="+", default=["drive", "bicycle"], choices=["drive", "bicycle", "quadrotor"])
    given = parser.parse_args()
    finish("vehicles", compare(given), given)
