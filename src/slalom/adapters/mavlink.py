"""Drones that follow decisions by MAVLink: setpoints with position, velocity and acceleration, and states.

slalom's frame has x to the east, y to the north and z up. MAVLink's local frame has north, east and down, from the same
origin. Yaw is clockwise from north there, and a heading counter-clockwise from east here.

The connection is one of pymavlink (`mavutil.mavlink_connection`): any object whose `mav` can send. Message, frame and
mask are those of SET_POSITION_TARGET_LOCAL_NED in MAVLink's common message set (mavlink.io).
"""

from dataclasses import dataclass
from math import pi, remainder
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import DECISION, Array, CheckedFields, Positive, has, not_negative, number, vector, vectors
from slalom.base.errors import InvalidInput
from slalom.decision import Decision
from slalom.model.shape import Ball
from slalom.model.state import State

LOCAL_NED: Final = 1
"""MAV_FRAME_LOCAL_NED."""
YAW_IGNORED, YAW_RATE_IGNORED = 1024, 2048
"""Bits of the type mask. Position, velocity and acceleration have none set: they are all used."""
CLOCK: Final = 2**32
"""[ms] after which time_boot_ms begins anew."""


def ned(vectors_up: Any) -> Array:
    """Vectors (..., 3) north, east, down of vectors east, north, up. It is its own inverse."""
    given = vectors(vectors_up, "vectors", 3)
    return np.stack([given[..., 1], given[..., 0], -given[..., 2]], axis=-1)


class Setpoint(NamedTuple):
    """Target of a drone at one time, in MAVLink's local frame."""

    position: Array  # (3,) [m] north, east, down
    velocity: Array  # (3,) [m/s]
    acceleration: Array  # (3,) [m/s^2], without gravity
    yaw: float | None  # [rad] clockwise from north; None: as it is

    @property
    def type_mask(self) -> int:
        """Fields that the autopilot ignores: the rate of yaw, and yaw if there is none."""
        return YAW_RATE_IGNORED | (YAW_IGNORED if self.yaw is None else 0)

    def send(self, connection: Any, now: float, system: int = 1, component: int = 1) -> None:
        """Send SET_POSITION_TARGET_LOCAL_NED at `now` [s] since the autopilot's boot."""
        clock = round(1000.0 * not_negative(now, "now")) % CLOCK
        vectors_down = (*self.position.tolist(), *self.velocity.tolist(), *self.acceleration.tolist())
        yaw = 0.0 if self.yaw is None else self.yaw
        connection.mav.set_position_target_local_ned_send(
            clock, system, component, LOCAL_NED, self.type_mask, *vectors_down, yaw, 0.0
        )


def setpoint(decision: Decision, t: float, heading: float | None = None) -> Setpoint:
    """The manoeuvre of a decision at time t [s]; `heading` [rad] counter-clockwise from east.

    Raises:
        InvalidInput: a decision in the plane.
    """
    has(decision, *DECISION, "decision")
    plan, time = decision.manoeuvre, number(t, "t")
    position = plan.position(time)
    if position.shape != (3,):
        raise InvalidInput(f"decision: expected one in space, found dimension {position.size}")
    yaw = None if heading is None else remainder(0.5 * pi - number(heading, "heading"), 2.0 * pi)
    return Setpoint(ned(position), ned(plan.velocity(time)), ned(plan.acceleration(time)), yaw)


@dataclass(frozen=True)
class Drone(CheckedFields):
    """A drone within `radius` [m] of its centre that is at most `error` [m] off its setpoints.

    Decide for `shape` from `state`. While the drone is within its error of the plan, the plan is that of a drone that
    follows it exactly. `shape` about it contains the drone.

    Raises:
        InvalidInput: a value that is not above 0.
    """

    radius: Positive
    error: Positive

    @property
    def shape(self) -> Ball:
        """Robot of the navigator."""
        return Ball(self.radius + self.error)

    def off(self, message: Any, decision: Decision, now: float) -> float:
        """Distance [m] of the drone from the plan of a decision at `now` [s]."""
        return float(np.linalg.norm(measured(message).position - decision.manoeuvre.position(now)))

    def state(self, message: Any, decision: Decision | None, now: float) -> State:
        """State from which to decide at `now` [s]: of the plan if the drone is on it, else of a message.

        Args:
            message: LOCAL_POSITION_NED. decision: the last one; None at the start.
        """
        if decision is not None and self.off(message, decision, now) <= self.error:
            plan = decision.manoeuvre
            return State(plan.position(now), plan.velocity(now), plan.acceleration(now))
        return measured(message)


def measured(message: Any) -> State:
    """State east, north, up of a LOCAL_POSITION_NED. Raises InvalidInput for another message."""
    has(message, ("x", "y", "z", "vx", "vy", "vz"), "LOCAL_POSITION_NED", "message")
    position = vector((message.x, message.y, message.z), "LOCAL_POSITION_NED: position", 3)
    velocity = vector((message.vx, message.vy, message.vz), "LOCAL_POSITION_NED: velocity", 3)
    return State(ned(position), ned(velocity))
