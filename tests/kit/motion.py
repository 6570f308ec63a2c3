"""The motion of one robot, for tests that decide step by step."""

import numpy as np

from slalom import State
from slalom.sim.run.states import integrate


def drive(state: State, acceleration: np.ndarray, duration: float) -> State:
    """The exact state after `duration` [s] at a constant acceleration (d,) [m/s^2]."""
    return State(*integrate(state.position, state.velocity, acceleration, duration), acceleration)
