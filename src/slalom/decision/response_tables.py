"""The responses of robots as tables, from which the compiled policy decides."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.kernels.decision.tables import ResponsePiece, ResponseTable, TabulatedResponse
from slalom.kernels.records import zero_records
from slalom.limits import Limits
from slalom.path import hermite, rest_from, straight_from
from slalom.response import Response
from slalom.state import State
from slalom.tolerances import BALL_WINDOWS, BRAKING_SHARE, LINEAR_RESPONSE, RESPONSE_WINDOWS, TABLE_SPEED


@lru_cache(maxsize=64)
def response_table(
    kinds: tuple[tuple[Response, ...], ...], horizon: float, span: float, dimension: int, period: float
) -> ResponseTable:
    """The responses of each kind of robot as tables over `span` [s].

    The motion under a response is linear in the state and in the control, so two states stand for all. `period` [s]: of
    the decisions.

    Raises:
        InvalidInput: a response that is not linear in the state.
    """
    responses = [response for kind in kinds for response in kind]
    windows = np.linspace(0.0, horizon, RESPONSE_WINDOWS + 1)
    ball_windows = np.linspace(0.0, horizon, 2 * BALL_WINDOWS + 1)
    knots, points, settled_velocity = [], [], []
    for response in responses:
        times = response.knots(span, 2.0 * TABLE_SPEED)
        shares = _shares(response, times, dimension)
        path = hermite(times, shares[0], shares[1])
        then = _shares(response, np.array([step_of(response, horizon, period)]), dimension)
        knots.append(times)
        points.append(path.points)
        settled_velocity.append(then[1, 0])
    whole = np.concatenate(points)
    pieces, each = zero_records(ResponsePiece, len(whole)), zero_records(TabulatedResponse, len(responses))
    pieces["velocity_gain"], pieces["acceleration_gain"], pieces["gain"] = np.moveaxis(whole, 2, 0)
    of_kinds = [[step_of(response, horizon, period) for response in kind] for kind in kinds]
    each["step"] = [time for times in of_kinds for time in times]
    each["shortest"] = [min(times) for times in of_kinds for _ in times]
    peaks = [_peaks(r, response, horizon, dimension) for r, response in enumerate(responses)]
    for r, response in enumerate(responses):
        each["error"][r], each["settled"][r] = response.interpolation_error, response.settled(horizon)
        each["rest"][r], each["settled_velocity"][r] = rest_from(knots[r], points[r]), settled_velocity[r]
        each["straight"][r] = straight_from(points[r])
        each["initial_acceleration"][r] = _initial_acceleration(response, dimension)
        each["window_gains"][r] = _shares(response, windows, dimension)[0]
        each["window_bends"][r] = _bends(response, windows, dimension)
        each["ball_bends"][r] = _on_either_side(_bends(response, ball_windows, dimension))
    return ResponseTable(
        each=each,
        pieces=pieces,
        kinds=np.cumsum([0, *(len(kind) for kind in kinds)]),
        first=np.cumsum([0, *(len(cubics) for cubics in points)]),
        knots=np.concatenate(knots),
        first_peak=np.cumsum([0, *(len(of_one) for of_one in peaks)]),
        peaks=np.array([peak for of_one in peaks for peak in of_one]),
    )


def step_of(response: Response, horizon: float, period: float) -> float:
    """Time [s] after which a control is judged: settled, or after which the next one may replace it without a loss.

    The second for responses whose control, held again, continues the same motion.
    """
    return min(period, horizon) if response.restartable else response.settled(horizon)


def stopping_deceleration(responses: Sequence[Response], limits: Limits, horizon: float, period: float) -> float:
    """The deceleration [m/s^2] with which a robot plans to stop: the share BRAKING_SHARE of what it can reach.

    A control that approaches a velocity with a lag reaches less, on average until it is settled, than at its start.
    """
    state, least = State(np.zeros(2), np.ones(2)), 1.0
    for response in responses:
        time = step_of(response, horizon, period)
        for peak in response.acceleration_peaks(state, horizon)[:1] if time > 0.0 else ():
            least = min(least, float(response.velocity(state, time).gain) / (time * float(peak.gain)))
    return BRAKING_SHARE * limits.braking * least


def _units(dimension: int) -> tuple[State, State]:
    """A state with velocity 1, and one with acceleration 1, along x."""
    nothing, one = np.zeros(dimension), np.eye(dimension)[0]
    return State(nothing, one), State(nothing, nothing, one)


def _shares(response: Response, times: Array, dimension: int) -> Array:
    """Shares (2, n, 3) of velocity, acceleration and control in position and velocity after `times` (n,) [s].

    Raises:
        InvalidInput: a response that is not linear in the state.
    """
    probe = State(np.full(dimension, 0.3), np.linspace(1.1, -0.4, dimension), np.linspace(-0.5, 0.9, dimension))
    shares = np.empty((2, len(times), 3))
    for k, of in enumerate((response.position, response.velocity)):
        with_velocity, with_acceleration = (of(state, times) for state in _units(dimension))
        shares[k, :, 0], shares[k, :, 1] = with_velocity.drift[:, 0], with_acceleration.drift[:, 0]
        shares[k, :, 2] = with_velocity.gain
        expected = shares[k, :, :1] * probe.velocity + shares[k, :, 1:2] * probe.acceleration
        expected = expected + (probe.position if k == 0 else 0.0)
        found = of(probe, times)
        if not (
            np.allclose(found.drift, expected, LINEAR_RESPONSE, LINEAR_RESPONSE)
            and np.allclose(found.gain, shares[k, :, 2], LINEAR_RESPONSE, LINEAR_RESPONSE)
        ):
            raise InvalidInput(f"response: expected a motion that is linear in the state, found that of {response!r}")
    return shares


def _bends(response: Response, windows: Array, dimension: int) -> Array:
    """Rows (w, 3) of `TabulatedResponse.window_bends`, between the times `windows` (w + 1,) [s].

    A chord of length h is missed by at most h^2 / 8 times the largest second derivative.
    """
    times = response.knots(float(windows[-1]), 2.0 * TABLE_SPEED)
    shares = _shares(response, times, dimension)
    parts = hermite(times, shares[0], shares[1]).cut(np.union1d(times, windows))
    second = 6.0 * np.abs(np.diff(parts.points, 2, axis=1)).max(axis=1) / np.diff(parts.times)[:, None] ** 2
    bends = np.zeros((len(windows) - 1, 3))
    window = np.searchsorted(windows, parts.times[:-1], side="right") - 1
    np.maximum.at(bends, np.minimum(window, len(bends) - 1), second)
    return np.asarray(bends * (windows[1] - windows[0]) ** 2 / 8.0)


def _on_either_side(bends: Array) -> Array:
    """The larger of the values of two windows (w, 3) at each of their ends (w + 1, 3)."""
    return np.asarray(np.maximum(np.concatenate([bends[:1], bends]), np.concatenate([bends, bends[-1:]])))


def _initial_acceleration(response: Response, dimension: int) -> tuple[float, float, float]:
    """Shares of velocity, acceleration and control in the acceleration at the start."""
    of_velocity, of_acceleration = (response.acceleration(state, 0.0) for state in _units(dimension))
    return float(of_velocity.drift[0]), float(of_acceleration.drift[0]), float(of_velocity.gain)


def _peaks(r: int, response: Response, horizon: float, dimension: int) -> list[tuple[float, ...]]:
    """Rows of `ResponseTable.peaks` of response number r."""
    rows: list[tuple[float, ...]] = []
    of_velocity, of_acceleration = _units(dimension)
    for which, peaks in enumerate((response.speed_peaks, response.acceleration_peaks)):
        for v, a in zip(peaks(of_velocity, horizon), peaks(of_acceleration, horizon), strict=True):
            if float(v.gain):
                rows.append((r, which, float(v.drift[0]), float(a.drift[0]), float(v.gain)))
    return rows
