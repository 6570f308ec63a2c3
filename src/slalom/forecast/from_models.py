"""Forecasts of tracks from several motion models, and the radius of their errors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import isnan, sqrt
from statistics import median
from typing import ClassVar, Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import Array, Fraction, check_fields, whole
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import LONGEST_FORECAST, REST, SIMILAR_MEMORY, SIMILAR_VELOCITY_SPAN, WHOLE_COUNT
from slalom.kernels.arrays import Indices, TrackSamples
from slalom.model.trajectory import ConstantVelocity, PiecewisePolynomial, Sampled, Stationary, Trajectory
from slalom.model.trajectory.composite import part_until
from slalom.model.trajectory.kinds import positions_of
from slalom.model.uncertainty import COVERAGES, BoundedError, Covering, Uncertainty

# Motion models fitted to the past positions of one track, weighted by how well each predicted the track so far.
#
# Time counts in spacings between the positions, so the result follows the sampling of the track. A model is a velocity
# fitted to some positions, with an acceleration that lasts a while or a turn rate that lasts. The fits are
# least-squares lines and parabolas through the newest position, which are linear in the positions: one table for each
# number of them.


MODEL_LEAD: Final = 8
"""[spacings] Over which motion models are compared with the past. Larger: less of the past is left to compare with, and
models that last longer weigh more. Smaller: noise counts more."""

MODEL_CHECKS: Final = (0, 2, 4, 6, 8, 10, 14, 18, 24)
"""[spacings] Before now, at which predictions of motion models are compared with the track. Earlier ones: a model that
was good once stays longer. Fewer: weights jump with single errors."""

MODEL_SHARPNESS: Final = 6.0
"""[1] Power of the past error in the weight of a motion model. Larger: the best model alone counts. Smaller: bad models
pull the mean."""

LEAST_FUTURE: Final = 0.02
"""[1] Least probability of a future of its own; less probable motions join the nearest one. Larger: rare motions bend
the likely ones. Smaller: more futures that hardly ever happen."""

MODEL_PRIOR: Final = 0.12
"""[1] Error of a motion model before any is known, as a share of the way. Larger: tracks that have just appeared get
larger radii, and their models equal weights. Smaller: the reverse."""

MODEL_KNOTS: Final = (0, 4, 8, 14, 22, 32, 45, 60)
"""[spacings] Knots of the predicted curve, after which it is straight. Later ones: turns are predicted further, for
more pieces. Fewer: the curve leaves the mean of the models."""


class _Model(NamedTuple):
    """Rule that continues a track."""

    samples: int  # to which it is fitted, before the newest
    hold: float = 0.0  # [spacings] that the fitted acceleration lasts
    turns: bool = False  # whether the speed and the turn rate last instead


_BANK: Final = (_Model(3), _Model(5, hold=5.0), _Model(5, turns=True))
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
    means = [np.einsum("nm,nmkd->nkd", weights, values) for values in (moved, velocities)]
    found = []
    for k, (least, place, velocity) in enumerate(zip(leasts.tolist(), *means, strict=True)):
        groups: list[list[int]] = []
        if most > 1:
            places = _moved(fitted[k][:, :1], fitted[k][:, 1:], later[k : k + 1])[0][:, 0]
            if more is not None:
                there = [np.interp(later[k], MODEL_KNOTS, axis) for axis in more.moved[k, 0].T]
                places = np.concatenate([places, [there]])
            groups = _grouped(places, weights[k], most, least * (later[k] / MODEL_LEAD) ** 2)
        if len(groups) > 1:
            found.append(_means(weights[k], moved[k], velocities[k], least, groups))
        else:
            found.append([Continuation(place, velocity, least)])
    return found


def _means(
    weights: Array, moved: Array, velocities: Array, least: float, groups: list[list[int]]
) -> list[Continuation]:
    """The mean of the models (m,) in each of several groups."""
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
    speeds = np.linalg.norm(positions[:, 0] - positions[:, k], axis=1) / k
    prior = np.repeat(MODEL_PRIOR * MODEL_LEAD * speeds[:, None], len(_BANK), axis=1)
    if not len(fits.checks):
        return prior
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


# What tracks that were similar before did next: a model of the motion at a place, learned from the observed past.
#
# People follow each other around a corner, and cars follow the lanes of a roundabout. Positions of all tracks, at
# multiples of one spacing, are searched for motions that began near the present one with nearly its velocity.


Trajectories = tuple[Trajectory, ...]


class SimilarMotions:
    """The motions of `tracks` up to a time, sampled at multiples of `spacing` [s].

    Nothing that comes later has an effect, and the same time always gives the same result.

    Attributes:
        tracks: at least one, all of one dimension. count: largest number of similar motions that count.
        step: number of the last sample.
    """

    def __init__(self, tracks: Sequence[Trajectory], spacing: float, now: float, count: int) -> None:
        self.tracks: Trajectories = tuple(tracks)
        self.spacing, self.count = spacing, count
        self.step = int(np.floor(now / spacing))
        self.step -= self.step * spacing > now

    def displacements(self, places: Array, velocities: Array, times: Indices) -> Array:
        """Displacements (n, k, d + 2) from `places` (n, d) [m] after `times` (k,), see `similar_displacements`.

        velocities: (n, d) [m per spacing]. times: [spacings] whole, from 0 on.
        """
        samples = _samples(self.tracks, self.spacing).until(self.step)
        return kernels.similar_displacements(places, velocities, times, samples, self.count)

    def past_errors(self, tracks: Sequence[Trajectory], lead: int, checks: Sequence[int]) -> list[list[float]]:
        """Errors [m] of predictions over `lead` spacings of each track, that were due `checks` [spacings] ago.

        The predictions are those of that time. A track that did not exist then has fewer errors.
        """
        numbers = {id(track): k for k, track in enumerate(self.tracks)}
        some = [numbers[id(track)] for track in tracks if id(track) in numbers]
        samples, errors = _samples(self.tracks, self.spacing), []
        for ago in checks:
            moment = _Moment(self.tracks, self.spacing, self.step - ago - lead)
            expected = _expected(moment, lead, self.count)
            errors.append(np.linalg.norm(expected[some] - samples.at(self.step - ago)[some], axis=1))
        each = dict(zip(some, np.array(errors).T.tolist()))
        return [[e for e in each.get(numbers.get(id(track), -1), []) if not isnan(e)] for track in tracks]


def rounded(spacing: float) -> float:
    """A spacing [s] with three digits: that of a sensor varies, and other multiples need other samples."""
    return round(spacing, 2 - int(np.floor(np.log10(spacing))))


class _Samples:
    """Positions of tracks at the steps so far, which grow with every decision and are sampled once each."""

    def __init__(self, tracks: Trajectories, spacing: float) -> None:
        self._tracks, self._spacing = tracks, spacing
        self._spans = np.array([track.span for track in tracks])
        self._begin = self._end = 0  # the steps that are sampled
        self._positions = np.empty((len(tracks), 0, tracks[0].dimension))  # nan where a track does not exist
        self._first = np.zeros(len(tracks), np.int64)  # the first column of each track
        self._last = np.full(len(tracks), -1)  # its last column
        self._longest = np.zeros(len(tracks))  # [m] its longest way in one spacing

    def until(self, step: int) -> TrackSamples:
        """The samples of the last SIMILAR_MEMORY steps up to `step`."""
        self._reach(step)
        column = step - self._begin
        first, last = np.maximum(self._first, column - SIMILAR_MEMORY), np.minimum(self._last, column)
        return TrackSamples(self._positions, first, last, self._longest)

    def at(self, step: int) -> Array:
        """Positions (n, d) [m] at a step; nan where a track does not exist."""
        self._reach(step)
        return self._positions[:, step - self._begin]

    def _reach(self, step: int) -> None:
        """Sample up to `step`; anew from SIMILAR_MEMORY before where it is earlier, or where there are many columns."""
        oldest = step - 2 * SIMILAR_MEMORY
        if not self._begin + SIMILAR_MEMORY <= step <= max(self._end, self._begin + 4 * SIMILAR_MEMORY) - 1:
            self._begin = self._end = oldest
            self._positions = np.full((len(self._tracks), 0, self._positions.shape[2]), np.nan)
            self._first[:] = 0
            self._last[:] = -1
            self._longest[:] = 0.0
        if step < self._end:
            return
        room = step + 1 - self._begin - self._positions.shape[1]
        if room > 0:
            more = np.full((len(self._tracks), room + SIMILAR_MEMORY // 4, self._positions.shape[2]), np.nan)
            self._positions = np.concatenate([self._positions, more], axis=1)
        steps = np.arange(self._end, step + 1)
        times = self._spacing * steps
        firsts, lasts = np.searchsorted(times, self._spans[:, 0]), np.searchsorted(times, self._spans[:, 1], "right")
        parts: dict[tuple[int, int], list[int]] = {}
        for k in np.flatnonzero(firsts < lasts).tolist():
            parts.setdefault((int(firsts[k]), int(lasts[k])), []).append(k)
        offset = self._end - self._begin
        for (first, last), some in parts.items():
            each = np.broadcast_to(times[first:last], (len(some), last - first))
            tracks = [part_until(self._tracks[k], float(times[last - 1])) for k in some]
            self._positions[some, offset + first : offset + last] = positions_of(tracks, each)
            fresh = [k for k in some if self._last[k] < self._first[k]]
            self._first[fresh], self._last[some] = offset + first, offset + last - 1
        ways = np.linalg.norm(np.diff(self._positions[:, max(offset - 1, 0) : offset + len(steps)], axis=1), axis=2)
        self._longest = np.maximum(self._longest, np.nan_to_num(ways).max(axis=1, initial=0.0))
        self._end = step + 1


@lru_cache(maxsize=4)
def _samples(tracks: Trajectories, spacing: float) -> _Samples:
    return _Samples(tracks, spacing)


class _Moment(NamedTuple):
    """A step of tracks. What is known at it does not depend on how much later the samples end."""

    tracks: Trajectories
    spacing: float
    step: int


@lru_cache(maxsize=64)
def _expected(at: _Moment, lead: int, count: int) -> Array:
    """Positions (n, d) [m] that were expected at a step for `lead` spacings later; nan for tracks that were not."""
    span, samples = SIMILAR_VELOCITY_SPAN, _samples(at.tracks, at.spacing).until(at.step)
    found = np.full((len(at.tracks), at.tracks[0].dimension), np.nan)
    newest = int(samples.last.max(initial=-1))
    places = _samples(at.tracks, at.spacing).at(at.step)
    before = _samples(at.tracks, at.spacing).at(at.step - span)
    there = np.flatnonzero(~np.isnan(places[:, 0]) & ~np.isnan(before[:, 0]) & (samples.last == newest))
    velocities = (places[there] - before[there]) / span
    moved = kernels.similar_displacements(places[there], velocities, np.array([lead]), samples, count)
    found[there] = places[there] + moved[:, 0, :-2]
    return found


PAST_SPACING: Final = 0.1
"""[s] Spacing of the past positions of an obstacle that is not a `Sampled` trajectory, or has few samples. Larger:
short motions are smoothed. Smaller: the models see less of the past, and more rounding."""

SPACINGS: Final = (0.05, 10.0)
"""[s] Least and largest spacing of the past positions that motion models use. A smaller least: the noise of fast
sensors enters. A larger greatest: the models of rare samples reach further back."""

NEWEST_SAMPLES: Final = 30.0
"""[s] Past in which the spacing of a sampled track is measured. Smaller: slow sensors have too few samples in it."""

FEWEST_PAST: Final = 3
"""[1] Spacings of the past that motion models have at least; of a shorter past they are parts. Larger: noise of the
first positions enters. Smaller: no acceleration is fitted at first."""


@dataclass(frozen=True)
class FromModels:
    """The mean of several motion models, weighted by how well each predicted this obstacle so far.

    The models are a constant velocity, an acceleration that lasts a while, and a constant turn, fitted to the newest
    positions. Each is tried on the past: it predicts MODEL_LEAD spacings ahead of several earlier moments. Its
    weight is its mean error to the power of -MODEL_SHARPNESS. All times are multiples of the spacing of the track. For
    a `Sampled` trajectory that is the median spacing of the newest samples, else PAST_SPACING.

    One model more repeats what others did: earlier motions of all observed tracks that began at nearly the same place
    with nearly the same velocity, see `similar_displacements`.

    An obstacle without an uncertainty of its own gets a set: a radius that held the share `coverage` of the errors of
    this forecast so far, see `_Errors`.

    An obstacle that appears at this moment is predicted at rest, since only one position is known. So is one that did
    not move for MODEL_LEAD spacings.

    With more than one of `futures` the models form up to so many groups. Each is a future, with the sum of the weights
    as its probability. Groups are apart by more than the error above at that time, and none is less probable than
    LEAST_FUTURE. Models are joined as by Ward (Journal of the American Statistical Association 58, 1963): always the
    two groups whose union adds the least weighted square of distances.

    Attributes:
        coverage: one of COVERAGES. A robot that looks ahead has smaller sets too, see `LookAhead`.
        similar: largest number of earlier motions that count; 0: none does.

    Raises:
        InvalidInput: a value out of its range.
    """

    includes_future: ClassVar[bool] = False
    coverage: Fraction = COVERAGES[-1]
    futures: int = 1
    similar: int = 20

    def __post_init__(self) -> None:
        check_fields(self)
        if self.coverage not in COVERAGES:
            raise InvalidInput(f"coverage: expected one of {COVERAGES}, found {self.coverage:g}")
        object.__setattr__(self, "futures", whole(self.futures, "futures", 1))
        object.__setattr__(self, "similar", whole(self.similar, "similar", 0))

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        ((_, mean),), _ = replace(self, futures=1).predictions([trajectory], now)[0]
        return mean

    def predictions(
        self,
        trajectories: Sequence[Trajectory],
        now: float,
        rise: float = 0.0,
        seen: Sequence[Trajectory] | None = None,
    ) -> "list[Futures]":
        """All futures of each trajectory; together they take less time than one by one.

        rise: [s] time of the robot from rest to its maximum speed; 0: MODEL_LEAD spacings. seen: all tracks whose
        motion up to `now` [s] is known, also of obstacles that have left; None: those that are predicted.
        """
        # Trajectories are never changed. A decision may predict them more than once, with another `rise`.
        fixed = all(type(each).__hash__ is object.__hash__ for each in trajectories)
        later, among = rise if self.futures > 1 else 0.0, trajectories if seen is None else seen
        known = tuple(each for each in among if _is_searched(each))
        found = (_known if fixed else _ahead)(tuple(trajectories), now, self.futures, later, known, self.similar)
        if not any(each.lead for each in found):
            return [Futures(each.each, BoundedError()) for each in found]
        rise = rise or median(each.lead for each in found if each.lead)
        times, (shares, typical) = rise * np.array(ERROR_TIMES), _errors(known, rise, self.similar).quantiles(now)
        radii = Covering.of(self.coverage, COVERAGES, times, shares * times)
        sizes = [each.size * (typical or each.size) for each in found]
        errors = [replace(radii, scale=size) if size else BoundedError() for size in sizes]
        return [Futures(a.each, error) for a, error in zip(found, errors)]


def _is_searched(track: Trajectory) -> bool:
    """Whether similar motions are searched in a track: it moves, and it is never changed."""
    return type(track).__hash__ is object.__hash__ and not isinstance(track, Stationary)


class Futures(NamedTuple):
    """Predictions of one obstacle with their probabilities, the most probable one first."""

    each: tuple[tuple[float, Trajectory], ...]  # probabilities [1] of sum 1
    error: Uncertainty  # radius of each


class _Ahead(NamedTuple):
    """Predictions of one obstacle, see `Futures`."""

    each: tuple[tuple[float, Trajectory], ...]
    error: float = 0.0  # [m] see `Continuation`
    lead: float = 0.0  # [s] of this error; 0 for an obstacle at rest

    @property
    def size(self) -> float:
        """Size of its errors [sqrt(m/s)], see `_Errors`; 0 for an obstacle at rest."""
        return sqrt(self.error / self.lead) if self.lead else 0.0


def _ahead(
    trajectories: tuple[Trajectory, ...],
    now: float,
    most: int,
    rise: float,
    known: tuple[Trajectory, ...],
    similar: int,
) -> list[_Ahead]:
    """Up to `most` predictions of each trajectory, apart at the time `rise` [s].

    known: tracks, of whose motions up to `similar` count.
    """
    found = dict[int, _Ahead]()
    pasts = list[_Past]()
    counts = dict[int, list[tuple[int, float, float]]]()
    for k, trajectory in enumerate(trajectories):
        first = trajectory.span[0]
        usual = _spacing(trajectory, now)
        spacing = min(usual, (now - first) / FEWEST_PAST)
        count = 0
        if spacing > 0.0:
            count = int(min(LONGEST_PAST, max(np.floor((now - first) / spacing * (1.0 + WHOLE_COUNT)), FEWEST_PAST)))
        counts.setdefault(count, []).append((k, spacing, usual))
    for count, some in counts.items():
        spacings = np.array([spacing for _, spacing, _ in some])
        tracks = [trajectories[k] for k, _, _ in some]
        firsts = np.array([track.span[0] for track in tracks])
        times = np.maximum(now - spacings[:, None] * np.arange(count + 1), firsts[:, None])
        positions = positions_of([part_until(track, now) for track in tracks], times)
        ways = np.abs(positions[:, : MODEL_LEAD + 1] - positions[:, :1]).max(axis=(1, 2))
        for (k, spacing, usual), track, own, way in zip(some, tracks, positions, ways.tolist(), strict=True):
            if way > REST * MODEL_LEAD * spacing:
                pasts.append(_Past(k, track, spacing, spacing == usual, own))
            else:
                found[k] = _Ahead(((1.0, ConstantVelocity(own[0], 0.0 * own[0], now)),))
    pasts.sort(key=lambda past: past.number)
    more = _similar(pasts, now, known, similar) if similar and known and pasts else None
    alike: dict[tuple[int, ...], list[int]] = {}
    for row, past in enumerate(pasts):
        alike.setdefault(past.positions.shape, []).append(row)
    for rows in alike.values():
        group = [pasts[row] for row in rows]
        later = np.array([max(rise / past.spacing, MODEL_LEAD) for past in group])
        further = None if more is None else FurtherModel(*(each[rows] for each in more))
        several = continued(np.stack([past.positions for past in group]), most, later, further)
        curves = iter(_joined([(past, one) for past, ahead in zip(group, several) for one in ahead], now))
        for past, ahead in zip(group, several):
            each = tuple((one.probability, next(curves)) for one in ahead)
            found[past.number] = _Ahead(each, ahead[0].error, MODEL_LEAD * past.spacing)
    return [found[k] for k in range(len(trajectories))]


_known = lru_cache(maxsize=8)(_ahead)


# The radii of predictions: which share of the errors of earlier predictions, of all tracks, they held.


ERROR_TIMES: Final = (0.25, 0.5, 1.0, 2.0)
"""[1] Prediction times, as multiples of the time of the robot from rest to its maximum speed, at which errors count."""

ERROR_MEMORY: Final = 16
"""[1] Such times in the past, at each of which predictions are made and later compared with the tracks. More: steadier
radii, slower first decisions."""

ERROR_PRIOR: Final = (10, 0.75, 1.35)
"""[1] Number of the errors that count before any is known, their median in the unit of `_Errors`, and the power of the
odds with which they spread: the median ones of 19 recordings. More: radii follow a scene later."""


class _Said(NamedTuple):
    """Predictions of one moment."""

    rows: Indices  # (n,) of the tracks
    places: Array  # (n, k, d) [m] at the k ERROR_TIMES
    sizes: Array  # (n,) [sqrt(m/s)]
    found: list[Array]  # errors at each of ERROR_TIMES that has passed, divided by w h


class _Errors:
    """Errors of the mean predictions of tracks that never change, each made before it was known.

    A track whose best model had the mean error e over the lead t has the size w = sqrt(e / t), and those of a scene
    have the median size W. An error at the time h is divided by w W h, which makes errors of different tracks and
    times alike. So half of the spread between tracks is taken to last, and the other half to be chance.
    """

    def __init__(self, tracks: Trajectories, rise: float, similar: int) -> None:
        self._tracks, self._rise = tracks, rise
        self._similar = similar
        self._spans = np.array([track.span for track in tracks]).reshape(len(tracks), 2)
        self._said: dict[int, _Said] = {}

    def quantiles(self, now: float) -> tuple[Array, float]:
        """Normalised errors (3, k) [1] of each of COVERAGES at ERROR_TIMES, and W [sqrt(m/s)]; 0 without a past."""
        newest = int(np.floor(now / self._rise))
        numbers = range(newest - ERROR_MEMORY + 1, newest + 1)
        self._said = {k: self._said.get(k) or self._predict(k) for k in numbers}
        count, middle, power = ERROR_PRIOR
        shares = (np.arange(count) + 0.5) / count
        sizes = np.concatenate([said.sizes for said in self._said.values()])
        typical = float(np.median(sizes)) if len(sizes) else 0.0
        prior = middle * (shares / (1.0 - shares)) ** (1.0 / power)
        known: list[list[Array]] = [[prior] for _ in ERROR_TIMES]
        for number, said in self._said.items():
            for j, h in enumerate(ERROR_TIMES):
                due = (number + h) * self._rise
                if due > now:
                    break
                if j == len(said.found):
                    said.found.append(self._judged(said, j, due))
                known[j].append(said.found[j] / (typical or 1.0))
        each = [np.quantile(np.concatenate(some), COVERAGES, method="higher") for some in known]
        return np.stack(each, axis=1), typical

    def _predict(self, number: int) -> _Said:
        now = number * self._rise
        rows = np.flatnonzero((self._spans[:, 0] < now) & (now <= self._spans[:, 1]))
        tracks = tuple(self._tracks[k] for k in rows.tolist())
        found = _ahead(tracks, now, 1, 0.0, self._tracks, self._similar)
        moves = [k for k, one in enumerate(found) if one.error]
        times = now + self._rise * np.array(ERROR_TIMES)
        places = [found[k].each[0][1].position(times) for k in moves]
        return _Said(rows[moves], np.array(places), np.array([found[k].size for k in moves]), [])

    def _judged(self, said: _Said, j: int, due: float) -> Array:
        there = np.flatnonzero(due <= self._spans[said.rows, 1])
        if not len(there):
            return np.empty(0)
        tracks = [part_until(self._tracks[k], due) for k in said.rows[there].tolist()]
        away = positions_of(tracks, np.full((len(there), 1), due))[:, 0] - said.places[there, j]
        return np.asarray(np.linalg.norm(away, axis=1) / (said.sizes[there] * ERROR_TIMES[j] * self._rise))


@lru_cache(maxsize=4)
def _errors(tracks: Trajectories, rise: float, similar: int) -> _Errors:
    return _Errors(tracks, rise, similar)


class _Past(NamedTuple):
    """What is known of a track that moves."""

    number: int  # among those that are predicted
    track: Trajectory
    spacing: float  # [s]
    usual: bool  # whether it is that of the sensor; of a track that has just appeared it is shorter
    positions: Array  # (k + 1, d) [m] the newest first


def _similar(pasts: Sequence[_Past], now: float, known: tuple[Trajectory, ...], count: int) -> FurtherModel:
    """Predictions of tracks from up to `count` similar motions of the `known` tracks.

    The error is infinite for tracks that have just appeared.
    """
    places, knots = np.array([past.positions[0] for past in pasts]), np.array(MODEL_KNOTS)
    spans = [min(SIMILAR_VELOCITY_SPAN, len(past.positions) - 1) for past in pasts]
    velocities = np.array([(past.positions[0] - past.positions[k]) / k for past, k in zip(pasts, spans)])
    n, d = places.shape
    error, found = np.full(n, np.inf), np.zeros((n, len(knots), d + 2))
    spacings = np.array([rounded(past.spacing) if past.usual else np.nan for past in pasts])
    for spacing in np.unique(spacings[spacings > 0.0]).tolist():
        rows = np.flatnonzero(spacings == spacing)
        motions = SimilarMotions(known, spacing, now, count)
        found[rows] = motions.displacements(places[rows], velocities[rows], knots)
        each = motions.past_errors([pasts[k].track for k in rows.tolist()], MODEL_LEAD, MODEL_CHECKS)
        for k, errors in zip(rows, each):
            prior = MODEL_PRIOR * MODEL_LEAD * float(np.linalg.norm(velocities[k]))
            error[k] = (sum(errors) + prior) / (len(errors) + 1)
    moved = found[:, None, :, :d]
    return FurtherModel(
        error, moved, np.gradient(moved, knots.astype(np.float64), axis=2), found[..., d], found[..., -1]
    )


def _spacing(trajectory: Trajectory, now: float) -> float:
    """[s] between the positions of the past that are used."""
    if not isinstance(trajectory, Sampled):
        return PAST_SPACING
    stamps = trajectory.breaks(max(trajectory.span[0], now - NEWEST_SAMPLES), now)
    if len(stamps) < FEWEST_PAST:
        return PAST_SPACING
    # numpy's median of so few takes five times as long.
    return float(min(max(median(np.diff(stamps).tolist()), SPACINGS[0]), SPACINGS[1]))


def _joined(ahead: "Sequence[tuple[_Past, Continuation]]", now: float) -> list[PiecewisePolynomial]:
    """Trajectories from `now` [s]: cubic pieces through the knots of each continuation, then a straight line."""
    position = np.stack([past.positions[0] for past, _ in ahead])[:, None]
    spacing = np.array([past.spacing for past, _ in ahead])[:, None, None]
    places = position + np.stack([one.displacements for _, one in ahead])
    velocities = np.stack([one.velocities for _, one in ahead]) / spacing
    h = spacing * np.diff(MODEL_KNOTS)[:, None]
    chord = np.diff(places, axis=1) / h
    before = velocities[:, :-1]
    after = velocities[:, 1:]
    still = 0.0 * position
    curves = [places[:, :-1], before, (3.0 * chord - 2.0 * before - after) / h, (before + after - 2.0 * chord) / h**2]
    last = np.stack([places[:, -1:], velocities[:, -1:], still, still], axis=2)
    coefficients = np.concatenate([np.stack(curves, axis=2), last], axis=1)
    durations = np.append(h[..., 0], np.full((len(h), 1), LONGEST_FORECAST), axis=1)
    return [PiecewisePolynomial(*row, now) for row in zip(durations, coefficients)]
