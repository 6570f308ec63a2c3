"""What is common to all ways in which several robots decide."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from slalom.checks import Array
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import Method
from slalom.response import AccelerateThenBrake
from slalom.sim.scenario import Scenario
from slalom.state import State


class Decider(Protocol):
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
