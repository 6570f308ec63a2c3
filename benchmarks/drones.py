"""A quadrotor that is told by MAVLink to fly among moving balls: collisions, arrivals, distance from the plan.

usage: python benchmarks/drones.py [--seeds 20] [--quick]

The quadrotor is the rigid body of rotorpy with its SE(3) controller (pip install rotorpy). It gets nothing but the
bytes of SET_POSITION_TARGET_LOCAL_NED, 50 times a second, and gives nothing but those of LOCAL_POSITION_NED
(pymavlink). Both ends of the wire convert frames by code of their own.
12 balls cross its way at constant velocities, which are observed.
"""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from program import finish, options, table, target
from pymavlink.dialects.v20 import common as mavlink
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.hummingbird_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from slalom import Goal, Limits, Navigator, Stationary, Tracks, method
from slalom.adapters.mavlink import Drone, setpoint

PERIOD, SETPOINT, STEP = 0.1, 0.02, 0.01
START, GOAL = np.array([-8.0, 0.0, 5.0]), np.array([8.0, 0.0, 5.0])
DRONE, LIMITS = Drone(radius=0.25, error=0.25), Limits(2.0, 1.5)
BALLS = 12


class Bytes:
    """One direction of a wire: bytes written at one end, messages read at the other."""

    def __init__(self) -> None:
        self.sender = mavlink.MAVLink(self, srcSystem=1, srcComponent=1)
        self.receiver = mavlink.MAVLink(None)
        self.data, self.count = b"", 0

    def write(self, data: bytes) -> None:
        self.data, self.count = self.data + data, self.count + len(data)

    def messages(self) -> list[Any]:
        data, self.data = self.data, b""
        return self.receiver.parse_buffer(data) or []


@dataclass
class Quadrotor:
    """A rigid body that follows the last setpoint that it got. x, y, z of rotorpy are east, north, up."""

    down: Bytes = field(default_factory=Bytes)
    up: Bytes = field(default_factory=Bytes)

    def __post_init__(self) -> None:
        hover = np.sqrt(quad_params["mass"] * 9.81 / (4.0 * quad_params["k_eta"]))
        self.now = {"x": START.copy(), "v": np.zeros(3), "q": np.array([0.0, 0.0, 0.0, 1.0]), "w": np.zeros(3)}
        self.now |= {"wind": np.zeros(3), "rotor_speeds": np.full(4, hover)}
        self.plant, self.controller = Multirotor(quad_params, self.now), SE3Control(quad_params)
        zeros = ("x_dot", "x_ddot", "x_dddot", "x_ddddot")
        self.wanted = {"x": START.copy(), **{name: np.zeros(3) for name in zeros}, "yaw": 0.0, "yaw_dot": 0.0}

    def tell(self, t: float) -> None:
        """Write where it is."""
        (x, y, z), (u, v, w) = self.now["x"].tolist(), self.now["v"].tolist()
        self.up.sender.local_position_ned_send(round(1000.0 * t), y, x, -z, v, u, -w)

    def fly(self, t: float) -> None:
        """One step of the body, after reading what has come."""
        for told in self.down.messages():
            assert (told.get_type(), told.coordinate_frame) == ("SET_POSITION_TARGET_LOCAL_NED", 1)
            used = ~told.type_mask
            assert used & 0b111_111_111 == 0b111_111_111
            self.wanted["x"] = np.array([told.y, told.x, -told.z])
            self.wanted["x_dot"] = np.array([told.vy, told.vx, -told.vz])
            self.wanted["x_ddot"] = np.array([told.afy, told.afx, -told.afz])
        self.now = self.plant.step(self.now, self.controller.update(t, self.now, self.wanted), STEP)


class Flight(NamedTuple):
    """What happened in one run."""

    arrived: bool
    time: float  # [s]
    clearance: float  # [m] least distance of the drone from a ball
    off: float  # [m] largest distance from the plan
    unsafe: int  # decisions without a safe manoeuvre
    met: int  # balls that a drone on the straight way at the largest speed would touch


def crowd(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (n, 3), velocities (n, 3) and radii (n,) of balls that cross the straight way, none near the start."""
    rng, balls = np.random.default_rng(seed), []
    while len(balls) < BALLS:
        way, radius = rng.normal(size=3), rng.uniform(0.3, 0.8)
        velocity = rng.uniform(0.4, 1.5) * way / np.linalg.norm(way)
        share = rng.uniform(0.15, 0.9)
        place = START + share * (GOAL - START) + rng.normal(0.0, 0.5, 3) - velocity * 8.5 * share
        if np.linalg.norm(place - START) > radius + 3.0:
            balls.append((place, velocity, radius))
    places, velocities, radii = zip(*balls)
    return np.array(places), np.array(velocities), np.array(radii)


def fly(seed: int, seconds: float = 40.0) -> Flight:
    """One flight from START to GOAL."""
    places, velocities, radii = crowd(seed)
    body, decision, least, off, unsafe = Quadrotor(), None, np.inf, 0.0, 0
    navigator = Navigator(method("nao"), DRONE.shape, LIMITS, period=PERIOD, horizon=5.0)
    goal, connection = Goal(Stationary(GOAL), 0.3, stop=True), SimpleNamespace(mav=body.down.sender)
    straight = START + np.linspace(0.0, 1.0, 801)[:, None] * (GOAL - START)
    gaps = [
        np.linalg.norm(straight - p - 8.0 * np.linspace(0, 1, 801)[:, None] * v, axis=1)
        for p, v in zip(places, velocities)
    ]
    met = sum(bool(gap.min() < DRONE.radius + radius) for gap, radius in zip(gaps, radii))
    per_setpoint, per_period = round(SETPOINT / STEP), round(PERIOD / STEP)
    for k in range(round(seconds / STEP)):
        t = k * STEP
        if k % per_period == 0:
            body.tell(t)
            (message,) = body.up.messages()
            state, seen = DRONE.state(message, decision, t), Tracks(places + t * velocities, velocities, radii, t)
            if goal.reached(body.now["x"], body.now["v"], t):
                return Flight(True, t, least, off, unsafe, met)
            decision = navigator.decide(state, seen, goal, now=t, previous=decision)
            unsafe += not decision.safe
        if k % per_setpoint == 0:
            setpoint(decision, t, heading=0.0).send(connection, t)
        body.fly(t)
        off = max(off, float(np.linalg.norm(body.now["x"] - decision.manoeuvre.position(t + STEP))))
        gap = np.linalg.norm(places + (t + STEP) * velocities - body.now["x"], axis=1) - radii
        least = min(least, float(gap.min()) - DRONE.radius)
    return Flight(False, seconds, least, off, unsafe, met)


def measure(seeds: int) -> dict[str, Any]:
    """Table and targets."""
    flights = [fly(seed) for seed in range(seeds)]
    heads = ["seed", "time s", "clearance m", "off plan m", "unsafe decisions", "balls on the straight way"]
    rows = [[k, f.time, f.clearance, f.off, f.unsafe, f.met] for k, f in enumerate(flights)]
    return {
        "question": "Does a quadrotor that is told by MAVLink collide with moving balls?",
        "tables": [table(f"Flights of 16 m among {BALLS} moving balls", heads, rows)],
        "targets": [
            target("flights that collided", float(sum(f.clearance < 0.0 for f in flights)), most=0.0),
            target("flights that did not arrive", float(sum(not f.arrived for f in flights)), most=0.0),
            target("largest distance from the plan, m", max(f.off for f in flights), most=DRONE.error),
        ],
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    given = parser.parse_args()
    finish("drones", measure(2 if given.quick else given.seeds), given)
