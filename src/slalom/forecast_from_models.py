"""Forecasts of tracks from several motion models, and the radius of their errors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from statistics import median
from typing import ClassVar, NamedTuple

import numpy as np

from slalom.checks import Array, NotNegative, whole
from slalom.fields import check_fields
from slalom.motion_models import LONGEST_PAST, Continuation, FurtherModel, continued
from slalom.similar_motions import SimilarMotions, rounded
from slalom.tolerances import (
    FEWEST_PAST,
    LONGEST_FORECAST,
    MODEL_CHECKS,
    MODEL_KNOTS,
    MODEL_LEAD,
    MODEL_PRIOR,
    NEWEST_SAMPLES,
    PAST_SPACING,
    REST,
    SIMILAR_VELOCITY_SPAN,
    SPACINGS,
    WHOLE_COUNT,
)
from slalom.trajectory import ConstantVelocity, PiecewisePolynomial, Sampled, Stationary, Trajectory
from slalom.uncertainty import BoundedError


@dataclass(frozen=True)
class FromModels:
    """The mean of several motion models, weighted by how well each predicted this obstacle so far.

    The models are constant velocities, accelerations that last a while, and constant turns, fitted to several numbers
    of past positions. Each is tried on the past: it predicts MODEL_LEAD spacings ahead of several earlier moments. Its
    weight is its mean error to the power of -MODEL_SHARPNESS. All times are multiples of the spacing of the track. For
    a `Sampled` trajectory that is the median spacing of the newest samples, else PAST_SPACING.

    One model more repeats what others did: earlier motions of all observed tracks that began at nearly the same place
    with nearly the same velocity, see `similar_motions`.

    An obstacle without an uncertainty of its own gets a radius, from the mean error of the best model over MODEL_LEAD
    spacings: `offset` times that error now, and a growth with time. The error is taken to grow with the square of the
    time. The growth reaches `share` times the error at the time that the robot takes from rest to its maximum speed,
    or at MODEL_LEAD spacings if that is later.

    An obstacle that appears at this moment is predicted at rest, since only one position is known. So is one that did
    not move for MODEL_LEAD spacings.

    With more than one of `futures` the models form up to so many groups. Each is a future, with the sum of the weights
    as its probability. Groups are apart by more than the error above at that time, and none is less probable than
    LEAST_FUTURE. Models are joined as by Ward (Journal of the American Statistical Association 58, 1963): always the
    two groups whose union adds the least weighted square of distances.

    Attributes:
        similar: largest number of earlier motions that count; 0: none does.
    """

    includes_future: ClassVar[bool] = False
    share: NotNegative = 0.1
    futures: int = 1
    offset: NotNegative = 0.5
    similar: int = 20

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "futures", whole(self.futures, "futures", 1))
        object.__setattr__(self, "similar", whole(self.similar, "similar", 0))

    def __call__(self, trajectory: Trajectory, now: float) -> Trajectory:
        return self.with_error(trajectory, now)[0]

    def with_error(self, trajectory: Trajectory, now: float, rise: float = 0.0) -> tuple[Trajectory, BoundedError]:
        """The mean prediction and its radius; `rise` [s] is the time of the robot from rest to its maximum speed."""
        [([(_, mean)], error)] = replace(self, futures=1).predictions([trajectory], now, rise)
        return mean, error

    def predictions(
        self,
        trajectories: Sequence[Trajectory],
        now: float,
        rise: float = 0.0,
        seen: Sequence[Trajectory] | None = None,
    ) -> "list[Futures]":
        """All futures of each trajectory; together they take less time than one by one.

        rise: as in `with_error`. seen: all tracks whose motion up to `now` [s] is known, also of obstacles that have
        left; None: those that are predicted.
        """
        # Trajectories are never changed. A decision may predict them more than once, with another `rise`.
        fixed = all(type(each).__hash__ is object.__hash__ for each in trajectories)
        later, among = rise if self.futures > 1 else 0.0, trajectories if seen is None else seen
        known = tuple(each for each in among if _is_searched(each)) if self.similar else ()
        found = (_known if fixed else _ahead)(tuple(trajectories), now, self.futures, later, known, self.similar)
        growths = [self.share * a.error * max(rise, a.lead) / a.lead**2 if a.lead else 0.0 for a in found]
        errors = [BoundedError(self.offset * a.error, growth) for a, growth in zip(found, growths)]
        return [Futures(a.each, error) for a, error in zip(found, errors)]


def _is_searched(track: Trajectory) -> bool:
    """Whether similar motions are searched in a track: it moves, and it is never changed."""
    return type(track).__hash__ is object.__hash__ and not isinstance(track, Stationary)


class Futures(NamedTuple):
    """Predictions of one obstacle with their probabilities, the most probable one first."""

    each: tuple[tuple[float, Trajectory], ...]  # probabilities [1] of sum 1
    error: BoundedError  # radius of each


class _Ahead(NamedTuple):
    """Predictions of one obstacle, see `Futures`."""

    each: tuple[tuple[float, Trajectory], ...]
    error: float = 0.0  # [m] see `Continuation`
    lead: float = 0.0  # [s] of this error; 0 for an obstacle at rest


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
    found, pasts = dict[int, _Ahead](), list[_Past]()
    for k, trajectory in enumerate(trajectories):
        position, first, usual = trajectory.position(now), trajectory.span[0], _spacing(trajectory, now)
        spacing = min(usual, (now - first) / FEWEST_PAST)
        if spacing > 0.0:
            count = int(min(LONGEST_PAST, max(np.floor((now - first) / spacing * (1.0 + WHOLE_COUNT)), FEWEST_PAST)))
            positions = trajectory.position(np.maximum(now - spacing * np.arange(count + 1), first))
            if np.abs(positions[: MODEL_LEAD + 1] - position).max() > REST * MODEL_LEAD * spacing:
                pasts.append(_Past(k, trajectory, spacing, spacing == usual, positions))
                continue
        found[k] = _Ahead(((1.0, ConstantVelocity(position, 0.0 * position, now)),))
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
            prior = MODEL_PRIOR[2] * MODEL_LEAD * float(np.linalg.norm(velocities[k]))
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
    before, after, still = velocities[:, :-1], velocities[:, 1:], 0.0 * position
    curves = [places[:, :-1], before, (3.0 * chord - 2.0 * before - after) / h, (before + after - 2.0 * chord) / h**2]
    last = np.stack([places[:, -1:], velocities[:, -1:], still, still], axis=2)
    coefficients = np.concatenate([np.stack(curves, axis=2), last], axis=1)
    durations = np.append(h[..., 0], np.full((len(h), 1), LONGEST_FORECAST), axis=1)
    return [PiecewisePolynomial(*row, now) for row in zip(durations, coefficients)]
