"""The robot that is simulated: a double integrator, exact between steps."""

import numpy as np

from slalom.state import State


def drive(state: State, push: np.ndarray, duration: float) -> State:
    """The exact state after `duration` [s] under the acceleration `push` [m/s^2]."""
    return State(
        state.position + duration * (state.velocity + 0.5 * duration * push), state.velocity + duration * push, push
    )
