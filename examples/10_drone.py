"""A drone that follows setpoints of MAVLink among moving balls, with an autopilot that follows them exactly."""

import sys
from importlib.util import find_spec
from types import SimpleNamespace

if not find_spec("pymavlink"):
    print("This example needs pymavlink: pip install 'slalom[mavlink]'.")
    sys.exit()

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

import slalom
from slalom.adapters.mavlink import Drone, setpoint

PERIOD = 0.1
DRONE = Drone(radius=0.25, error=0.1)
GOAL = slalom.Goal(slalom.Stationary((8.0, 0.0, 5.0)), 0.3, stop=True)
ROBOT = slalom.Navigator(slalom.method("nao"), DRONE.shape, slalom.Limits(2.0, 1.5), period=PERIOD, horizon=5.0)


class Autopilot:
    """A drone at the position of its last setpoint, which it sends; all messages are bytes."""

    def __init__(self, north: float, east: float, down: float) -> None:
        self.reader, self.setpoint, self.count = mavlink.MAVLink(None), (north, east, down, 0.0, 0.0, 0.0), 0

    def write(self, data: bytes) -> None:
        """Take bytes of setpoints."""
        for message in self.reader.parse_buffer(data) or []:
            self.count += 1
            self.setpoint = (message.x, message.y, message.z, message.vx, message.vy, message.vz)

    def position(self, now: float) -> object:
        """The message with the position."""
        encoded = mavlink.MAVLink(None).local_position_ned_encode(round(1000.0 * now), *self.setpoint)
        (message,) = mavlink.MAVLink(None).parse_buffer(encoded.pack(mavlink.MAVLink(None)))
        return message


def fly(seed: int) -> tuple[float, float, int]:
    """Time of arrival [s], least distance from a ball [m], and number of setpoints."""
    rng = np.random.default_rng(seed)
    velocities = rng.normal(0.0, 0.6, (12, 3))
    crossings = np.column_stack([rng.uniform(-4.0, 7.0, 12), rng.normal((0.0, 5.0), 0.4, (12, 2))])
    places = crossings - 5.0 * velocities
    autopilot, decision, least = Autopilot(0.0, -8.0, -5.0), None, np.inf
    connection = SimpleNamespace(mav=mavlink.MAVLink(autopilot))  # of a real drone: mavutil.mavlink_connection(...)
    for step in range(400):
        now = step * PERIOD
        state = DRONE.state(autopilot.position(now), decision, now)
        if GOAL.reached(state.position, state.velocity, now):
            return now, least, autopilot.count
        balls = slalom.Tracks(places + now * velocities, velocities, 0.5, now)
        decision = ROBOT.decide(state, balls, GOAL, now=now, previous=decision)
        for t in now + np.linspace(0.0, PERIOD, 6)[1:]:
            setpoint(decision, t, heading=0.0).send(connection, t)
            gaps = np.linalg.norm(places + t * velocities - decision.manoeuvre.position(t), axis=1)
            least = min(least, float(gaps.min()) - 0.5 - DRONE.radius)
    return np.inf, least, autopilot.count


if __name__ == "__main__":
    arrived, clearance, setpoints = fly(seed=0)
    print(f"arrived after {arrived:.1f} s and {setpoints} setpoints; at least {clearance:.2f} m from 12 balls")
    assert arrived < np.inf
    assert clearance > 0.0
