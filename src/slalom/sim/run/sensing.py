"""Robots that see each other late, inexactly or not at every look."""

import numpy as np

from slalom.checks import Array
from slalom.methods import Method
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.scenario import Scenario
from slalom.state import State


class Sensing:
    """What each robot has last seen of each other one.

    At every decision each robot looks at each other one: at its position, velocity and acceleration of `sight_delay`
    ago, each with independent normal errors of `sight_noise` [m, m/s, m/s^2] along each axis. With probability
    `sight_loss` it sees nothing and keeps what it saw before. At the start all know where all are.
    """

    def __init__(self, scenario: Scenario, states: Array, seed: int) -> None:
        n, period = len(scenario.robots), scenario.dt * scenario.steps_per_decision
        self.dimension = scenario.dimension
        self.noise, self.loss = scenario.sight_noise, scenario.sight_loss
        self.late, self.delay = round(scenario.sight_delay / period), scenario.sight_delay
        self.random = np.random.default_rng([seed, n])
        self.past: list[Array] = []
        self.seen = np.broadcast_to(states, (n, 3, n, 3)).copy()
        self.when = np.full((n, n), scenario.start)

    def observe(self, states: Array, now: float) -> None:
        """All look around; `states` (3, n, 3): positions, velocities and accelerations at `now` [s]."""
        n = len(self.when)
        self.past.append(states)
        if len(self.past) > self.late + 1:
            self.past.pop(0)
        if len(self.past) <= self.late:
            return
        seen = np.broadcast_to(self.past[0], (n, 3, n, 3)) + self.noise * self.random.standard_normal((n, 3, n, 3))
        seen[..., self.dimension :] = 0.0
        fresh = self.random.random((n, n)) >= self.loss
        self.seen = np.where(fresh[:, None, :, None], seen, self.seen)
        self.when[fresh] = now - self.delay

    def state(self, i: int, j: int) -> tuple[State, float]:
        """The state of robot j as robot i saw it last, and when that was [s]."""
        d = self.dimension
        place, speed, push = self.seen[i, :, j, :d]
        return State(place, speed, push), float(self.when[i, j])


def sensing_of(states: RobotStates, method: Method, seed: int) -> Sensing | None:
    """The watch of a run, if there is one: of a method that observes, where sight is late, inexact or lost."""
    scenario = states.scenario
    if method.shared or not (scenario.sight_noise or scenario.sight_delay or scenario.sight_loss):
        return None
    return Sensing(scenario, np.array([states.position, states.velocity, states.acceleration]), seed)
