"""Calibrated radii of predictions: which distance from the forecast held a chosen share of the errors so far."""

from collections import deque
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    TRACKS,
    UNCERTAINTY,
    Array,
    Fraction,
    Positive,
    array_of,
    check_fields,
    has,
    listing,
    positive,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import WHOLE_COUNT
from slalom.forecast.forecast import AtConstantVelocity, Forecast
from slalom.kernels.arrays import Flags, Indices
from slalom.model.trajectory import Trajectory
from slalom.model.uncertainty import COVERAGES, BoundedError, Covering, Uncertainty
from slalom.obstacle.tracks import Tracks, told_apart

CONFORMAL_ERRORS: Final = 1000
"""[1] Newest errors of predictions whose quantile is a calibrated radius. Larger: a steadier radius. Smaller: it
follows a change of the motion sooner."""

CONFORMAL_FEW: Final = 10.0
"""[1] Independent errors below which the errors at shorter prediction times bound those at longer ones. Larger: radii
stay too large for longer. Smaller: the first predictions over a long time have too small a radius."""

CONFORMAL_RATE: Final = 0.002
"""[1] Change of the level of that quantile for each error. Larger: the share of errors within the radius returns sooner
to the stated confidence. Smaller: a steadier radius."""


class Coverage(NamedTuple):
    """Measured share of errors within a calibrated radius, at one prediction time."""

    lead: float  # [s] prediction time
    promised: float  # share of the errors that the radius is to hold
    measured: float  # share that it held; nan without an error
    errors: int  # that were judged
    radius: float  # [m] now


class _Prediction(NamedTuple):
    """A predicted position that an observation will judge."""

    due: float  # [s] absolute time
    position: Array  # (d,) [m]
    stated: float  # [m] radius of the uncertainty of the track
    radii: Array  # (s,) [m] promised beyond it, for each of the shares
    weight: float  # [1] of its error, see `Calibration`


@dataclass
class _Lead:
    """Errors at one prediction time."""

    residuals: deque[float]  # [m] the newest CONFORMAL_ERRORS, beyond the stated radii
    weights: deque[float]  # [1] of these
    levels: Array  # (s,) share of the residuals that each radius holds, adapted
    held: Indices  # (s,) number of errors within each radius
    judged: int = 0


@dataclass(eq=False)
class Calibration:
    """Radii that hold a chosen share of the errors of a forecast, from all errors that were observed so far.

    For each prediction time the radius is the conformal quantile of the newest errors of all tracks. If the measured
    share drifts from the confidence, the level of the quantile follows: by CONFORMAL_RATE for each error. Law: in the
    long run the share of errors within the radius is `confidence`, unless errors keep exceeding all earlier ones.
    Sources: Vovk, Gammerman and Shafer, Algorithmic Learning in a Random World, 2005, for the quantile; Gibbs and
    Candes, Adaptive conformal inference under distribution shift, NeurIPS 2021, for the level.

    Predictions of one track over 4 s that are made every 0.1 s overlap: 40 of their errors say as much as one. So an
    error weighs the time since the track was predicted before, divided by the prediction time, at most 1. Weights count
    for the correction of the quantile for few errors. They also count for the level, which would oscillate otherwise:
    it changes with each error, and the effect is observed a prediction time later.

    Tracks may state a radius themselves, by their uncertainty. Errors then count beyond it: a radius here is one to add
    to the stated one, and below 0 if tracks state too much.

    Radii are held for `confidence` and for COVERAGES, the shares of the sets of a forecast; see `Covering`.

    Until there are enough errors for the quantile, the radius is the largest one, at least that of `prior`. While the
    weights are below CONFORMAL_FEW, it is also at least the radius of the prediction time before, extrapolated with the
    square of the time. If tracks state a radius, which grows itself, it is extrapolated in proportion to the time. The
    forecast uses observed positions and velocities only, and an error is computed at its own time: nothing uses the
    future.

    Attributes:
        confidence: share of the errors, between 0 and 1.
        leads: [s] prediction times, increasing.
        forecast: of the obstacles; it needs the present state only. None: that of the tracks.
        prior: of the errors before any is known.
        max_gap: [s] between two observations of a track; a position within a longer gap is not interpolated, and its
            error is not known.
    """

    confidence: Fraction = 0.9
    leads: Sequence[float] = (0.25, 0.5, 1.0, 2.0)
    forecast: Forecast | None = field(default_factory=AtConstantVelocity)
    prior: Uncertainty = field(default_factory=lambda: BoundedError(0.0, 0.2))
    max_gap: Positive = 1.0
    _shares: Array = field(init=False, repr=False)  # (s,)
    _leads: list[_Lead] = field(default_factory=list, init=False, repr=False)
    _last: dict[Hashable, tuple[float, Array]] = field(default_factory=dict, init=False, repr=False)
    _pending: dict[Hashable, list[deque[_Prediction]]] = field(default_factory=dict, init=False, repr=False)
    _dimension: int = field(default=2, init=False, repr=False)
    _stated: bool = field(default=False, init=False, repr=False)  # whether tracks state radii themselves
    _now: float = field(default=-np.inf, init=False, repr=False)

    def __post_init__(self) -> None:
        check_fields(self)
        listing(self.leads, "prediction times", "leads")
        self.leads = tuple(positive(lead, f"leads[{k}]") for k, lead in enumerate(self.leads))
        if not self.leads or any(b <= a for a, b in zip(self.leads, self.leads[1:])):
            raise InvalidInput(f"leads: expected increasing prediction times, found {list(self.leads)}")
        has(self.prior, *UNCERTAINTY, "prior")
        empty = partial(deque[float], maxlen=CONFORMAL_ERRORS)
        self._shares = np.array([self.confidence, *(share for share in COVERAGES if share != self.confidence)])
        none = np.zeros(len(self._shares), np.int64)
        self._leads = [_Lead(empty(), empty(), self._shares.copy(), none.copy()) for _ in self.leads]

    def observe(self, tracks: Tracks, predicted: Sequence[Trajectory] | None = None) -> None:
        """Compare earlier predictions with the present observation, and predict anew.

        Args:
            tracks: the observation of one time, with ids that stay the same.
            predicted: (n,) their trajectories from now on by a predictor of one's own; None: those of `forecast`.

        Raises:
            InvalidInput: a time that is not after that of the last call; two equal ids; predictions of another number.
        """
        has(tracks, *TRACKS, "tracks")
        told_apart(tracks.ids, "tracks.ids")
        if not tracks.t > self._now:
            raise InvalidInput(
                f"tracks.t: expected a time after {self._now:g} s, that of the last call; found {tracks.t:g}"
            )
        if predicted is not None and len(predicted) != len(tracks.ids):
            raise InvalidInput(f"predicted: expected {len(tracks.ids)}, one for each track; found {len(predicted)}")
        self._now, self._dimension = tracks.t, tracks.dimension
        self._stated = any(uncertainty is not None for uncertainty in tracks.uncertainties)
        for id, state in zip(tracks.ids, tracks.states, strict=True):
            self._judge(id, tracks.t, state[0])
        radii = self._radii()
        if predicted is None:
            expected = tracks if self.forecast is None else tracks.with_forecast(self.forecast)
            predicted = [motion.trajectory for motion in expected.obstacles]
        for id, motion, error in zip(tracks.ids, predicted, tracks.uncertainties, strict=True):
            self._predict(id, tracks.t, motion, error, radii)
        self._last = {id: (tracks.t, state[0]) for id, state in zip(tracks.ids, tracks.states, strict=True)}
        self._pending = {id: self._pending[id] for id in tracks.ids}

    def forget(self) -> None:
        """Begin anew, at any time: without predictions that are not judged yet. The errors so far stay."""
        self._last, self._pending = {}, {}
        self._now = -np.inf

    def radii(self) -> Array:
        """Radius (k,) [m] for each of the k prediction times."""
        return self._radii()[:, 0]

    def _radii(self) -> Array:
        """Radius (k, s) [m] for each prediction time and share."""
        found = []
        before, earlier = np.zeros(len(self._shares)), 1.0
        for lead, h in zip(self._leads, self.leads, strict=True):
            known, enough = _quantiles(lead)
            if sum(lead.weights) < CONFORMAL_FEW:
                known = np.where(enough, known, np.maximum(known, before * (h / earlier) ** (1 if self._stated else 2)))
            found.append(np.where(enough, known, np.maximum(known, float(self.prior.radius(h, self._dimension)))))
            before, earlier = known, h
        return np.array(found)

    def _sets(self, radii: Array) -> tuple[tuple[float, ...], Array]:
        """The shares and their radii (s, k) [m] of radii (s, k) for `_shares`, both in order of the share."""
        order = np.argsort(self._shares)
        return tuple(self._shares[order].tolist()), np.maximum.accumulate(np.maximum(radii[order], 0.0), axis=0)

    @property
    def error(self) -> Covering:
        """The uncertainty with these radii, straight between them, or with larger ones where growth would slow down."""
        times, (shares, radii) = np.array(self.leads), self._sets(self._radii().T)
        if len(times) == 1:
            times, radii = np.append(0.0, times), np.hstack([0.0 * radii, radii])
        return Covering.of(self.confidence, shares, times, radii)

    def calibrated(self, stated: Sequence[Uncertainty], ages: npt.ArrayLike) -> tuple[Uncertainty, ...]:
        """The uncertainties (n,) of tracks that state others: `Covering`, as `error` is.

        Each holds the calibrated radius now and at every prediction time. The calibrated radii are those of predictions
        from a measurement; `ages` (n,) [s] are the times since then, and radii between the prediction times, and after
        the last one, are those on the straight line. Before an error is known the uncertainties are the stated ones.
        """
        if not stated or not any(lead.judged for lead in self._leads):
            return tuple(stated)
        known, rows = np.array((0.0, *self.leads)), []
        since = known + array_of(ages, "ages", (len(stated),))[:, None]
        radii = np.stack([one.radius(known, self._dimension) for one in stated])
        for row in self._radii().T:
            extra = np.append(0.0, row)
            slope = (extra[-1] - extra[-2]) / (known[-1] - known[-2])
            rows.append(radii + np.interp(since, known, extra) + slope * np.maximum(since - known[-1], 0.0))
        sets = [self._sets(each) for each in np.stack(rows, axis=1)]
        return tuple(Covering.of(self.confidence, shares, known, each) for shares, each in sets)

    @property
    def coverage(self) -> tuple[Coverage, ...]:
        """Confidence and measured share of errors within the radius, for each prediction time."""
        return tuple(
            Coverage(h, self.confidence, lead.held[0] / lead.judged if lead.judged else np.nan, lead.judged, radius)
            for h, lead, radius in zip(self.leads, self._leads, self.radii().tolist(), strict=True)
        )

    def _judge(self, id: Hashable, t: float, position: Array) -> None:
        """Compare the predictions of a track with its positions between the last observation and this one."""
        if id not in self._last:
            self._pending[id] = [deque() for _ in self.leads]
            return
        before, place = self._last[id]
        for lead, waiting in zip(self._leads, self._pending[id], strict=True):
            while waiting and waiting[0].due <= t:
                prediction = waiting.popleft()
                if t - before > self.max_gap or prediction.due < before:
                    continue
                there = place + (prediction.due - before) / (t - before) * (position - place)
                residual = float(np.linalg.norm(there - prediction.position)) - prediction.stated
                held = residual <= prediction.radii
                lead.residuals.append(residual)
                lead.weights.append(prediction.weight)
                lead.held, lead.judged = lead.held + held, lead.judged + 1
                change = CONFORMAL_RATE * prediction.weight * (self._shares - held)
                lead.levels = np.clip(lead.levels + change, 0.0, 1.0)

    def _predict(self, id: Hashable, t: float, motion: Trajectory, error: Uncertainty | None, radii: Array) -> None:
        """Predict the positions of a track at all prediction times from now."""
        since = t - self._last[id][0] if id in self._last else np.inf
        leads = np.array(self.leads)
        places = motion.position(t + leads)
        stated = np.zeros(len(leads)) if error is None else error.radius(leads, self._dimension)
        weights = np.minimum(1.0, since / leads).tolist()
        for waiting, *row in zip(self._pending[id], (t + leads).tolist(), places, stated.tolist(), radii, weights):
            waiting.append(_Prediction(*row))


def _quantiles(lead: _Lead) -> tuple[Array, Flags]:
    """The conformal quantiles (s,) [m] of the errors, and whether there are enough for each; else the largest error."""
    n, count = len(lead.residuals), sum(lead.weights)
    ranks = (count + 1.0) * lead.levels
    enough = (ranks <= count + WHOLE_COUNT) & (n > 0)
    if not n:
        return np.zeros(len(ranks)), enough
    ranked = np.sort(np.array(lead.residuals))
    rows = np.clip(np.ceil(ranks / count * n - WHOLE_COUNT).astype(np.int64), 1, n) - 1
    return np.where(enough, ranked[rows], ranked[-1]), enough
