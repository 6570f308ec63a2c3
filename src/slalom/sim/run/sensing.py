"""Observations of other robots that are late, inexact or lost."""

import numpy as np

from slalom.checks import Array
from slalom.methods import Method
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.scenario import Scenario
from slalom.state import State


class Sensing:
    """The last observation that each of n robots has of each other one.

    At every decision each robot observes the position, velocity and acceleration that each other one had `sight_delay`
    ago. Each coordinate has an independent normal error of standard deviation `sight_noise` [m, m/s, m/s^2]. With
    probability `sight_loss` an observation is lost and the one before it stays. All initial states are known.

    Attributes:
        observed: (n, 3, n, 3) position, velocity and acceleration [m, m/s, m/s^2]; the first axis is the observer, the
            third the observed robot. time: (n, n) [s] absolute, at which they held.
    """

    def __init__(self, scenario: Scenario, states: Array, seed: int) -> None:
        n, period = len(scenario.robots), scenario.dt * scenario.steps_per_decision
        self.dimension = scenario.dimension
        self.noise, self.loss = scenario.sight_noise, scenario.sight_loss
        self.delay, self._delay_steps = scenario.sight_delay, round(scenario.sight_delay / period)
        self.random = np.random.default_rng([seed, n])
        self.observed = np.broadcast_to(states, (n, 3, n, 3)).copy()
        self.time = np.full((n, n), scenario.start)
        self._past: list[Array] = []

    def observe(self, states: Array, now: float) -> None:
        """Observe all robots; `states` (3, n, 3): positions, velocities and accelerations at `now` [s]."""
        n = len(self.time)
        self._past.append(states)
        if len(self._past) > self._delay_steps + 1:
            self._past.pop(0)
        if len(self._past) <= self._delay_steps:
            return
        errors = self.noise * self.random.standard_normal((n, 3, n, 3))
        observed = np.broadcast_to(self._past[0], (n, 3, n, 3)) + errors
        observed[..., self.dimension :] = 0.0
        fresh = self.random.random((n, n)) >= self.loss
        self.observed = np.where(fresh[:, None, :, None], observed, self.observed)
        self.time[fresh] = now - self.delay

    def state(self, i: int, j: int) -> tuple[State, float]:
        """The state of robot j that robot i observed last, and its time [s]."""
        position, velocity, acceleration = self.observed[i, :, j, : self.dimension]
        return State(position, velocity, acceleration), float(self.time[i, j])


def sensing_of(states: RobotStates, method: Method, seed: int) -> Sensing | None:
    """The sensing of a run in which robots observe each other late, inexactly or with losses; else None."""
    scenario = states.scenario
    if method.shared or not (scenario.sight_noise or scenario.sight_delay or scenario.sight_loss):
        return None
    return Sensing(scenario, np.array([states.position, states.velocity, states.acceleration]), seed)
