"""Position maps of responses as cubic pieces, fine enough for the controls for which they are used."""

from math import ceil, log2, sqrt

import numpy as np

from slalom.checks import Array
from slalom.path import hermite, rest_from
from slalom.response.protocol import Response
from slalom.response.time_invariant import TimeInvariant
from slalom.state import State


def _usual_bound(state: State) -> float:
    """100 m/s more than twice the speed [m/s]: the speed and the controls of nearly all robots stay below."""
    return 2.0 * sqrt(state.velocity.dot(state.velocity)) + 100.0


def _speed_bound(response: Response, state: State, horizon: float, largest: float) -> float:
    """The speed [m/s] and the velocity that a control of the norm `largest` stands for, together."""
    gain = float(response.velocity(state, horizon).gain)
    return sqrt(state.velocity.dot(state.velocity)) + largest * max(1.0, gain)


def piece_norm(response: Response, state: State, horizon: float, largest: float) -> float:
    """The norm of controls for which pieces are made, so that they hold for controls of up to the norm `largest`.

    0 where the usual pieces hold, else a power of two, so that slightly larger controls do not make other pieces.
    """
    if response.interpolation_error == 0.0 or _speed_bound(response, state, horizon, largest) <= _usual_bound(state):
        return 0.0
    return float(2.0 ** ceil(log2(largest)))


def response_pieces(
    response: Response, state: State, horizon: float, largest: float = 0.0
) -> tuple[Array, Array, Array]:
    """The position map as cubic pieces: knots (m + 1,) [s], control points of drift (m, 4, d) and gain (m, 4).

    largest: norm of controls for which the stated error must hold. It holds for those up to `_usual_bound` anyhow.
    """
    reach = _usual_bound(state)
    if largest > 0.0 and response.interpolation_error > 0.0:
        reach = max(reach, _speed_bound(response, state, horizon, largest))
    if isinstance(response, TimeInvariant):
        return response.pieces(state, horizon, reach)
    knots = response.knots(horizon, reach)
    position, velocity = response.position(state, knots), response.velocity(state, knots)
    drift = hermite(knots, position.drift, velocity.drift).points
    return knots, drift, hermite(knots, position.gain[:, None], velocity.gain[:, None]).points[..., 0]


def rest_time(response: Response, state: State, horizon: float) -> float:
    """Time [s] from which the robot in `state` is at rest under every control up to the horizon [s]; inf: never."""
    knots = response.knots(horizon, _usual_bound(state))
    position = response.position(state, knots)
    velocity = response.velocity(state, knots)
    drift = hermite(knots, position.drift, velocity.drift).points
    gain = hermite(knots, position.gain[:, None], velocity.gain[:, None]).points
    return rest_from(knots, np.concatenate([drift, gain], axis=2))
