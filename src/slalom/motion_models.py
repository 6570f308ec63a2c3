"""Motion models fitted to the past positions of one track, weighted by how well each predicted the track so far.

Time counts in spacings between the positions, so the result follows the sampling of the track. A model is a velocity
fitted to some positions, with an acceleration that lasts a while or a turn rate that lasts. The fits are least-squares
lines and parabolas through the newest position, which are linear in the positions: one table for each number of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, Final, NamedTuple, cast

import numpy as np

from slalom.checks import Array, NotNegative, whole
from slalom.fields import check_fields
from slalom.kernels.arrays import Indices
from slalom.tolerances import (
    FEWEST_PAST,
    LEAST_FUTURE,
    LONGEST_FORECAST,
    MODEL_CHECKS,
    MODEL_KNOTS,
    MODEL_LEAD,
    MODEL_PRIOR,
    MODEL_SHARPNESS,
    NEWEST_SAMPLES,
    PAST_SPACING,
    REST,
    SPACINGS,
    WHOLE_COUNT,
)
from slalom.trajectory import ConstantVelocity, PiecewisePolynomial, Sampled, Trajectory
from slalom.uncertainty import BoundedError


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


@dataclass(frozen=True)
class FromModels:
    """The mean of several motion models, weighted by how well each predicted this obstacle so far.

    The models are constant velocities, accelerations that last a while, and constant turns, fitted to several numbers
    of past positions. Each is tried on the past: it predicts MODEL_LEAD spacings ahead of several earlier moments. Its
    weight is its mean error to the power of -MODEL_SHARPNESS. All times are multiples of the spacing of the track. For
    a `Sampled` trajectory that is the median spacing of the newest samples, else PAST_SPACING.

    An obstacle without an uncertainty of its own gets a radius that grows with time, by `share` of the mean error of
    the best model. That error grows with the square of the time. The line reaches it at the time that the robot takes
    from rest to its maximum speed, or at MODEL_LEAD spacings if that is later.

    An obstacle that appears at this moment is predicted at rest, since only one position is known. So is one that did
    not move for MODEL_LEAD spacings.

    With more than one of `futures` the models form up to so many groups. Each is a future, with the sum of the weights
    as its probability. Groups are apart by more than the error above at that time, and none is less probable than
    LEAST_FUTURE. Models are joined as by Ward (Journal of the American Statistical Association 58, 1963): always the
    two groups whose union adds the least weighted square of distances.
    """

    includes_future: ClassVar[bool] = False
    share: NotNegative = 0.5
    futures: int = 1

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "futures", whole(self.futures, "futures", 1))

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return self.with_error(trajectory, now)[0]

    def with_error(self, trajectory: Trajectory, now: float, rise: float = 0.0) -> tuple[Trajectory, BoundedError]:
        """The mean prediction and its radius; `rise` [s] is the time of the robot from rest to its maximum speed."""
        [([(_, mean)], error)] = replace(self, futures=1).predictions([trajectory], now, rise)
        return mean, error

    def predictions(self, trajectories: Sequence[Trajectory], now: float, rise: float = 0.0) -> "list[Futures]":
        """All futures of each trajectory; together they take less time than one by one. `rise` as in `with_error`."""
        # Trajectories are never changed. A decision may predict them more than once, with another `rise`.
        fixed = all(type(each).__hash__ is object.__hash__ for each in trajectories)
        later = rise if self.futures > 1 else 0.0
        found = (_known if fixed else _ahead)(cast(Any, tuple(trajectories)), now, self.futures, later)
        growths = [self.share * a.error * max(rise, a.lead) / a.lead**2 if a.lead else 0.0 for a in found]
        return [Futures(a.each, BoundedError(velocity=growth)) for a, growth in zip(found, growths)]


class Futures(NamedTuple):
    """Predictions of one obstacle with their probabilities, the most probable one first."""

    each: tuple[tuple[float, Trajectory], ...]  # probabilities [1] of sum 1
    error: BoundedError  # radius of each


class _Ahead(NamedTuple):
    """Predictions of one obstacle, see `Futures`."""

    each: tuple[tuple[float, Trajectory], ...]
    error: float = 0.0  # [m] see `Continuation`
    lead: float = 0.0  # [s] of this error; 0 for an obstacle at rest


def _ahead(trajectories: Sequence[Trajectory], now: float, most: int, rise: float) -> list[_Ahead]:
    """Up to `most` predictions of each trajectory, apart at the time `rise` [s]."""
    found: dict[int, _Ahead] = {}
    alike: dict[tuple[int, ...], list[tuple[int, float, Array]]] = {}
    for k, trajectory in enumerate(trajectories):
        position, first = trajectory.position(now), trajectory.span[0]
        spacing = min(_spacing(trajectory, now), (now - first) / FEWEST_PAST)
        if spacing > 0.0:
            count = int(min(LONGEST_PAST, max(np.floor((now - first) / spacing * (1.0 + WHOLE_COUNT)), FEWEST_PAST)))
            positions = trajectory.position(np.maximum(now - spacing * np.arange(count + 1), first))
            if np.abs(positions[: MODEL_LEAD + 1] - position).max() > REST * MODEL_LEAD * spacing:
                alike.setdefault(positions.shape, []).append((k, spacing, positions))
                continue
        found[k] = _Ahead(((1.0, ConstantVelocity(position, 0.0 * position, now)),))
    for group in alike.values():
        spacings = np.array([spacing for _, spacing, _ in group])
        later = np.maximum(rise / spacings, MODEL_LEAD)
        several = continued(np.stack([positions for _, _, positions in group]), most, later)
        for (k, spacing, positions), ahead in zip(group, several):
            each = tuple((one.probability, _joined(positions[0], one, spacing, now)) for one in ahead)
            found[k] = _Ahead(each, ahead[0].error, MODEL_LEAD * spacing)
    return [found[k] for k in range(len(trajectories))]


_known = lru_cache(maxsize=8)(_ahead)


class _Fits(NamedTuple):
    """Velocity and acceleration of every model from k + 1 positions, as shares of the positions."""

    now: Array  # (m, 2, k + 1)
    then: Array  # (m, c, 2, k + 1) as fitted MODEL_LEAD spacings before each check
    checks: Indices  # (c,) spacings ago


def continued(positions: Array, most: int, later: Array) -> list[list[Continuation]]:
    """Up to `most` continuations of n tracks, each the mean of a group of models, weighted by their past errors.

    Args:
        positions: (n, k + 1, d) [m] at equal spacings, the newest first, k of at least 1.
        later: (n,) [spacings] of at least MODEL_LEAD, at which models are compared to group them.
    """
    fits = _fits(positions.shape[1] - 1)
    errors = _past_errors(positions, fits)
    leasts = errors.min(axis=1)
    # Relative to the least: powers of small distances would underflow.
    tiny = np.finfo(float).tiny
    weights = (np.maximum(errors, tiny) / np.maximum(leasts, tiny)[:, None]) ** -MODEL_SHARPNESS
    weights /= weights.sum(axis=1, keepdims=True)
    fitted = fits.now @ positions[:, None]
    moved, velocities = _moved(fitted[:, :, :1], fitted[:, :, 1:], np.array(MODEL_KNOTS))
    found = []
    for k, least in enumerate(leasts.tolist()):
        groups: list[list[int]] = []
        if most > 1:
            places = _moved(fitted[k][:, :1], fitted[k][:, 1:], later[k : k + 1])[0][:, 0]
            groups = _grouped(places, weights[k], most, least * (later[k] / MODEL_LEAD) ** 2)
        found.append(_means(weights[k], moved[k], velocities[k], least, groups))
    return found


def _means(
    weights: Array, moved: Array, velocities: Array, least: float, groups: list[list[int]]
) -> list[Continuation]:
    """The mean of the models (m,) in each group; of all if there is at most one group."""
    if len(groups) <= 1:
        return [Continuation(np.tensordot(weights, moved, 1), np.tensordot(weights, velocities, 1), least)]
    sums = [float(weights[group].sum()) for group in groups]
    shares = [weights[group] / total for group, total in zip(groups, sums)]
    # All of them, with rounding, are 1 together.
    return [
        Continuation(np.tensordot(share, moved[group], 1), np.tensordot(share, velocities[group], 1), least, p)
        for group, share, p in zip(groups, shares, [1.0 - sum(sums[1:]), *sums[1:]])
    ]


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


def _spacing(trajectory: Trajectory, now: float) -> float:
    """[s] between the positions of the past that are used."""
    if not isinstance(trajectory, Sampled):
        return PAST_SPACING
    stamps = trajectory.breaks(max(trajectory.span[0], now - NEWEST_SAMPLES), now)
    if len(stamps) < FEWEST_PAST:
        return PAST_SPACING
    return float(np.clip(np.median(np.diff(stamps)), *SPACINGS))


def _joined(position: Array, ahead: Continuation, spacing: float, now: float) -> PiecewisePolynomial:
    """Cubic pieces through the knots of a continuation, then a straight line."""
    places, velocities = position + ahead.displacements, ahead.velocities / spacing
    h = spacing * np.diff(MODEL_KNOTS)[:, None]
    chord = np.diff(places, axis=0) / h
    before, after = velocities[:-1], velocities[1:]
    curves = [places[:-1], before, (3.0 * chord - 2.0 * before - after) / h, (before + after - 2.0 * chord) / h**2]
    last = np.stack([places[-1], velocities[-1], 0.0 * position, 0.0 * position])
    return PiecewisePolynomial(
        np.append(h[:, 0], LONGEST_FORECAST), np.concatenate([np.stack(curves, axis=1), last[None]]), now
    )
