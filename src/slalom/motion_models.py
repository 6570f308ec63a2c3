"""Motion models fitted to the past positions of one track, weighted by how well each predicted the track so far.

Time counts in spacings between the positions, so the result follows the sampling of the track. A model is a velocity
fitted to some positions, with an acceleration that lasts a while or a turn rate that lasts. The fits are least-squares
lines and parabolas through the newest position, which are linear in the positions: one table for each number of them.
"""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.kernels.arrays import Indices
from slalom.tolerances import (
    LEAST_FUTURE,
    MODEL_CHECKS,
    MODEL_KNOTS,
    MODEL_LEAD,
    MODEL_PRIOR,
    MODEL_SHARPNESS,
)


class _Model(NamedTuple):
    """Rule that continues a track."""

    samples: int  # to which it is fitted, before the newest
    hold: float = 0.0  # [spacings] that the fitted acceleration lasts
    turns: bool = False  # whether the speed and the turn rate last instead


_BANK: Final = (
    *(_Model(samples) for samples in (3, 1, 10)),
    *(_Model(5, hold) for hold in (2.5, 5.0, 10.0)),
    *(_Model(samples, turns=True) for samples in (5, 15)),
)
_PRIORS = np.array([MODEL_PRIOR[0]] + [MODEL_PRIOR[1]] * 2 + [MODEL_PRIOR[2]] * 5)
_TURNS = np.array([model.turns for model in _BANK])
_HOLDS = np.array([model.hold for model in _BANK])
_ORDERS = tuple(2 if model.turns or model.hold else 1 for model in _BANK)

LONGEST_PAST: Final = MODEL_CHECKS[-1] + MODEL_LEAD + max(model.samples for model in _BANK)
"""Spacings of the past that count."""


class Continuation(NamedTuple):
    """Predicted displacements from the newest position, and velocities, at MODEL_KNOTS spacings."""

    displacements: Array  # (k, d) [m]
    velocities: Array  # (k, d) [m per spacing]
    error: float  # [m] mean error of the best model over MODEL_LEAD spacings
    probability: float = 1.0  # the sum of the weights of its models


class FurtherModel(NamedTuple):
    """Predictions of n tracks by a model that is not fitted to each track alone."""

    error: Array  # (n,) [m] see `_past_errors`
    moved: Array  # (n, 1, k, d) [m] at MODEL_KNOTS
    velocities: Array  # (n, 1, k, d) [m per spacing]
    variance: Array  # (n, k) [m^2] of the motions that it repeats
    weight: Array  # (n, k) [1] of these motions: 0 where there is none, near 1 where there are many


class _Fits(NamedTuple):
    """Velocity and acceleration of every model from k + 1 positions, as shares of the positions."""

    now: Array  # (m, 2, k + 1)
    then: Array  # (m, c, 2, k + 1) as fitted MODEL_LEAD spacings before each check
    checks: Indices  # (c,) spacings ago


def continued(positions: Array, most: int, later: Array, more: FurtherModel | None = None) -> list[list[Continuation]]:
    """Up to `most` continuations of n tracks, each the mean of a group of models, weighted by their past errors.

    Args:
        positions: (n, k + 1, d) [m] at equal spacings, the newest first, k of at least 1.
        later: (n,) [spacings] of at least MODEL_LEAD, at which models are compared to group them.
        more: a further model.
    """
    fits = _fits(positions.shape[1] - 1)
    errors = _past_errors(positions, fits)
    fitted = fits.now @ positions[:, None]
    moved, velocities = _moved(fitted[:, :, :1], fitted[:, :, 1:], np.array(MODEL_KNOTS))
    if more is not None:
        errors = np.concatenate([errors, more.error[:, None]], axis=1)
        moved, velocities = np.concatenate([moved, more.moved], 1), np.concatenate([velocities, more.velocities], 1)
    leasts = errors.min(axis=1)
    # Relative to the least: powers of small distances would underflow.
    tiny = np.finfo(float).tiny
    weights = (np.maximum(errors, tiny) / np.maximum(leasts, tiny)[:, None]) ** -MODEL_SHARPNESS
    weights /= weights.sum(axis=1, keepdims=True)
    if more is not None:
        # The past of a track shows no bend ahead. The motions of others at this place do, where they agree.
        apart = ((np.einsum("nm,nmkd->nkd", weights, moved) - more.moved[:, 0]) ** 2).sum(axis=2)
        # At 0 nothing has moved; an infinite error makes it not a number.
        unsure = more.variance + (more.error[:, None] / MODEL_LEAD * np.maximum(MODEL_KNOTS, 1)) ** 2
        part = (more.weight * apart / np.maximum(apart + unsure, tiny))[:, None, :, None]
        moved, velocities = moved + part * (more.moved - moved), velocities + part * (more.velocities - velocities)
    found = []
    for k, least in enumerate(leasts.tolist()):
        groups: list[list[int]] = []
        if most > 1:
            places = _moved(fitted[k][:, :1], fitted[k][:, 1:], later[k : k + 1])[0][:, 0]
            if more is not None:
                place = [np.interp(later[k], MODEL_KNOTS, axis) for axis in more.moved[k, 0].T]
                places = np.concatenate([places, [place]])
            groups = _grouped(places, weights[k], most, least * (later[k] / MODEL_LEAD) ** 2)
        found.append(_means(weights[k], moved[k], velocities[k], least, groups))
    return found


def _means(
    weights: Array, moved: Array, velocities: Array, least: float, groups: list[list[int]]
) -> list[Continuation]:
    """The mean of the models (m,) in each group; of all if there is at most one group."""
    if len(groups) <= 1:
        return [Continuation(_mean(weights, moved), _mean(weights, velocities), least)]
    sums = [float(weights[group].sum()) for group in groups]
    shares = [weights[group] / total for group, total in zip(groups, sums)]
    # All of them, with rounding, are 1 together.
    return [
        Continuation(_mean(share, moved[group]), _mean(share, velocities[group]), least, p)
        for group, share, p in zip(groups, shares, [1.0 - sum(sums[1:]), *sums[1:]])
    ]


def _mean(weights: Array, values: Array) -> Array:
    """The mean (k, d) of values (m, k, d) with weights (m,) of sum 1; `numpy.tensordot` takes four times as long."""
    return np.asarray((weights @ values.reshape(len(weights), -1)).reshape(values.shape[1:]))


def _grouped(places: Array, weights: Array, most: int, apart: float) -> list[list[int]]:
    """Up to `most` groups of models, the one of most weight first: apart by more than `apart` [m], none too light."""
    groups = [[k] for k in range(len(weights))]
    while len(groups) > 1:
        sums = np.array([weights[group].sum() for group in groups])
        means = np.array([weights[group] @ places[group] / total for group, total in zip(groups, sums)])
        first, second = np.triu_indices(len(groups), 1)
        far = np.linalg.norm(means[first] - means[second], axis=1)
        if len(groups) <= most and far.min() > apart and sums.min() >= LEAST_FUTURE:
            break
        joined = sums[first] * sums[second] / (sums[first] + sums[second]) * far**2
        k = int(np.argmin(joined))
        groups[first[k]] += groups.pop(second[k])
    return sorted(groups, key=lambda group: -float(weights[group].sum()))


def _past_errors(positions: Array, fits: _Fits) -> Array:
    """Mean error (n, m) [m] over MODEL_LEAD spacings at the checks, with a prior that counts as one check."""
    k = min(positions.shape[1] - 1, 5)
    speeds = np.array([float(np.linalg.norm(track[0] - track[k])) / k for track in positions])
    prior = _PRIORS * speeds[:, None] * MODEL_LEAD
    if not len(fits.checks):
        return np.asarray(prior)
    fitted = fits.then @ positions[:, None, None]
    moved, _ = _moved(fitted[..., 0, :], fitted[..., 1, :], np.array([MODEL_LEAD]))
    then, since = positions[:, None, fits.checks + MODEL_LEAD], positions[:, None, fits.checks]
    errors = np.linalg.norm(then + moved - since, axis=-1)
    return np.asarray((errors.sum(axis=-1) + prior) / (len(fits.checks) + 1))


def _moved(velocity: Array, acceleration: Array, times: Array) -> tuple[Array, Array]:
    """Displacements and velocities (..., m, k, d) of each model.

    Args:
        velocity, acceleration: (..., m, k or 1, d) per spacing. times: (k or 1,) [spacings].
    """
    t, turns = times[None, :, None].astype(np.float64), np.flatnonzero(_TURNS)
    held = np.minimum(_HOLDS[:, None, None], t)
    moved = t * velocity + acceleration * (held * (t - 0.5 * held))
    final = velocity + acceleration * held
    v, a = velocity[..., turns, :, :], acceleration[..., turns, :, :]
    speed = np.linalg.norm(v, axis=-1, keepdims=True)
    along = v / np.maximum(speed, np.finfo(float).tiny)
    across = a - along * (a * along).sum(axis=-1, keepdims=True)
    lateral = np.linalg.norm(across, axis=-1, keepdims=True)
    across = across / np.maximum(lateral, np.finfo(float).tiny)
    angle = np.minimum(lateral / np.maximum(speed, np.finfo(float).tiny), np.pi) * t
    # sin x / x and (1 - cos x) / x, without loss of digits near 0.
    moved[..., turns, :, :] = speed * t * (_sinc(angle) * along + np.sin(0.5 * angle) * _sinc(0.5 * angle) * across)
    final[..., turns, :, :] = speed * (np.cos(angle) * along + np.sin(angle) * across)
    return moved, final


def _sinc(x: Array) -> Array:
    return np.asarray(np.sinc(x / np.pi))


@lru_cache(maxsize=LONGEST_PAST + 1)
def _fits(k: int) -> _Fits:
    """The fits to k + 1 positions. A check needs at least one position before its prediction."""
    checks = np.array([ago for ago in MODEL_CHECKS if ago + MODEL_LEAD < k], dtype=np.int64)
    rows = [(model.samples, order) for model, order in zip(_BANK, _ORDERS, strict=True)]
    now = np.stack([_fit(k, 0, *row) for row in rows])
    then = np.array([[_fit(k, int(ago) + MODEL_LEAD, *row) for ago in checks] for row in rows])
    return _Fits(now, then, checks)


def _fit(k: int, newest: int, samples: int, order: int) -> Array:
    """Velocity and acceleration (2, k + 1) from up to `samples` positions before the one `newest` spacings ago."""
    rows = np.zeros((2, k + 1))
    samples = min(samples, k - newest)
    order = min(order, samples)
    t = -np.arange(1.0, samples + 1.0)
    weights = np.linalg.pinv(np.stack([t, 0.5 * t * t][:order], axis=1))
    rows[:order, newest + 1 : newest + samples + 1] = weights
    rows[:order, newest] = -weights.sum(axis=1)
    return rows
