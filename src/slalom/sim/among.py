"""What is common to all ways in which several robots decide."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.response import AccelerateThenBrake
from slalom.sim.scenario import Scenario
from slalom.state import State


class Deciders(Protocol):
    """Those who decide for all robots of a run; `guidance` holds the robots' states and where they head for."""

    def decide(self, order: Sequence[int], now: float) -> tuple[dict[int, str], dict[int, float]]:
        """New manoeuvres for the robots in `order`: the names of the outcomes, and the time [s] that each took."""

    def push(self, now: float, dt: float) -> Array:
        """The accelerations (n, 3) [m/s^2] that carry the robots along what they are committed to, up to now + dt."""

    def chosen(self) -> tuple[Array, tuple[str, ...]]:
        """The controls (n, d) and the responses of all robots."""


def first_manoeuvre(state: State, limits: Limits, period: float, now: float) -> Manoeuvre:
    """What a robot is committed to before its first decision: to go on for one period and to brake evenly then."""
    speed = float(np.linalg.norm(state.velocity))
    brake = max(period, np.ceil(speed / limits.braking / period - 1e-9) * period)
    return Manoeuvre(AccelerateThenBrake(period, brake), state, np.zeros(state.dimension), now)


def margin_among(scenario: Scenario, method: Method) -> float:
    """The margin [m] of robots that meet each other.

    That of the scenario, and where they only see each other also how much two that accelerate at their limits can
    differ from what each expected of the other: a t^2, once for each, over the time t of one period and the delay of
    sight; and three standard deviations of what they see.
    """
    if method.shared:
        return scenario.margin
    time = scenario.dt * scenario.steps_per_decision + scenario.sight_delay
    most = max(robot.limits.max_acceleration for robot in scenario.robots)
    return scenario.margin + 2.0 * most * time * time + 3.0 * scenario.sight_noise


def refuse_small_world(scenario: Scenario, margin: float) -> None:
    """Raises InvalidInput for a world that repeats so soon that robots could meet two images of one robot.

    An image of another robot that is not the nearest is half a period away along some axis. Where no two robots can
    come so far together within the horizon, `margin` [m] between them, the nearest image is all that must be seen.
    A robot's own images go as it goes: they stay a period away.
    """
    if scenario.period is None:
        return
    speeds = [max(r.limits.max_speed, float(np.linalg.norm(r.state.velocity))) for r in scenario.robots]
    time = max(scenario.horizon, scenario.dt * scenario.steps_per_decision)
    reach = sorted(v * time + robot.shape.reach for v, robot in zip(speeds, scenario.robots, strict=True))
    least = 2.0 * (sum(reach[-2:]) + margin) if len(reach) > 1 else 2.0 * scenario.robot.shape.reach + margin
    if min(scenario.period) < least:
        why = (
            "twice as far as two robots can come together within the horizon" if len(reach) > 1 else "the robot's width"
        )
        raise InvalidInput(f"period: expected at least {least:g} m, {why}, found {min(scenario.period):g} m")
