"""Tracks of moving obstacles from measurements that are late, rare, repeated, missing or wrong."""

from bisect import bisect_left, bisect_right, insort
from collections import Counter, defaultdict
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from itertools import chain, count
from math import hypot, sqrt
from typing import Annotated, Any, Final, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    SHAPE,
    Array,
    Fraction,
    NotNegative,
    Positive,
    array,
    check_fields,
    has,
    not_before,
    not_negative,
    number,
    or_infinite,
    positive,
    shown,
    vector,
)
from slalom.base.errors import InvalidInput, first_missing, require
from slalom.forecast.forecast import AtConstantVelocity, Forecast
from slalom.model.shape import Disc, Shape, is_round
from slalom.model.trajectory import ConstantAcceleration
from slalom.model.uncertainty import Adjusted, BoundedError, KalmanError, Uncertainty
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.tracks import Tracks
from slalom.perception.association import CANDIDATES, GATE, OTHER_ID, assignment, least_sum, nearest_first
from slalom.perception.conformal import Calibration

# Filters: estimates of an obstacle's motion, with their uncertainty, from measurements that are not exact.


class Measurement(NamedTuple):
    """A measurement of one obstacle by a perception system."""

    t: float  # [s] absolute time
    position: Array  # (d,) [m]
    velocity: Array | None  # (d,) [m/s]
    covariance: Array | None  # of the position (d, d) [m^2], or of position and velocity (2 d, 2 d)


class Estimate(NamedTuple):
    """The state of an obstacle, and the uncertainty of its prediction."""

    state: Array  # (3, d): position [m], velocity [m/s] and acceleration [m/s^2]
    uncertainty: Uncertainty  # of the prediction, as a function of the time since the estimate


@runtime_checkable
class Filter(Protocol):
    """Estimate of motion from measurements in the order of time.

    A belief is a value of any type that no method changes: the tracker keeps beliefs, to replay late measurements.

    Laws: predicting over s and then over t is predicting over s + t. The radius of the uncertainty obeys the laws of
    `Uncertainty` and does not shrink while a belief is predicted.
    """

    @property
    def forecast(self) -> Forecast:
        """The forecast from an estimate, for methods that use trajectories as given."""

    def begin(self, seen: Measurement) -> Any:
        """The belief after the first measurement."""

    def predict(self, belief: Any, duration: float) -> Any:
        """The belief `duration` [s] >= 0 later, without a measurement."""

    def correct(self, belief: Any, seen: Measurement) -> Any:
        """The belief after a measurement at its time."""

    def distance(self, belief: Any, seen: Measurement) -> float:
        """Distance [1] of a measured position from the belief at its time, in standard deviations of both."""

    def estimate(self, belief: Any) -> Estimate:
        """The estimate as position, velocity and uncertainty."""


class Gaussian(NamedTuple):
    """Belief of a Kalman filter: position and velocity with their covariance."""

    mean: Array  # (2 d,)
    covariance: Array  # (2 d, 2 d)


@dataclass(frozen=True)
class ConstantVelocityFilter:
    """Kalman filter for motion at constant velocity, disturbed by accelerations that are white noise.

    Prediction, correction and process noise: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking
    and Navigation, 2001, sections 5.2 and 6.2; the correction in Joseph's form.

    Attributes:
        acceleration: [m/s^2/sqrt(Hz)] root of the spectral density of the accelerations. The larger, the faster the
            filter follows a turn, and the faster its uncertainty grows.
        position: [m] standard deviation per axis of a position that comes without a covariance.
        velocity: [m/s] the same of a velocity.
        first_velocity: [m/s] the same of the velocity of an obstacle that is measured the first time, without velocity.
        probability: with which an obstacle is outside the radius at any one time.
    """

    acceleration: NotNegative = 0.2
    position: Positive = 0.1
    velocity: Positive = 0.2
    first_velocity: Positive = 1.0
    probability: Fraction = 0.05
    forecast: Forecast = field(default=AtConstantVelocity(), init=False)

    def __post_init__(self) -> None:
        check_fields(self)

    def begin(self, seen: Measurement) -> Gaussian:
        values, covariance = self._measured(seen)
        d = seen.position.size
        mean, first = np.zeros(2 * d), np.diag(np.repeat([0.0, self.first_velocity**2], d))
        mean[: values.size], first[: values.size, : values.size] = values, covariance
        return Gaussian(mean, first)

    def predict(self, belief: Gaussian, duration: float) -> Gaussian:
        d = belief.mean.size // 2
        t = duration
        noise = self.acceleration**2 * np.eye(belief.mean.size // 2)
        place, velocity = belief.mean[:d], belief.mean[d:]
        # In blocks of position and velocity: products with the sparse matrix of the step take four times as long.
        of_place = belief.covariance[:d, :d]
        mixed = belief.covariance[:d, d:]
        of_velocity = belief.covariance[d:, d:]
        along = mixed + t * of_velocity
        mean, covariance = np.concatenate([place + t * velocity, velocity]), np.empty((2 * d, 2 * d))
        covariance[:d, :d] = of_place + t * (mixed.T + along) + t**3 / 3.0 * noise
        covariance[:d, d:] = along + t**2 / 2.0 * noise
        covariance[d:, :d] = covariance[:d, d:].T
        covariance[d:, d:] = of_velocity + t * noise
        return Gaussian(mean, covariance)

    def correct(self, belief: Gaussian, seen: Measurement) -> Gaussian:
        values, noise = self._measured(seen)
        m, covariance = values.size, belief.covariance
        gain = np.linalg.solve(covariance[:m, :m] + noise, covariance[:m]).T
        keep = np.eye(belief.mean.size)
        keep[:, :m] -= gain
        corrected = keep @ covariance @ keep.T + gain @ noise @ gain.T
        return Gaussian(belief.mean + gain @ (values - belief.mean[:m]), 0.5 * (corrected + corrected.T))

    def distance(self, belief: Gaussian, seen: Measurement) -> float:
        d = seen.position.size
        noise = self.position**2 * np.eye(d) if seen.covariance is None else seen.covariance[:d, :d]
        error = seen.position - belief.mean[:d]
        return sqrt(max(float(error @ np.linalg.solve(belief.covariance[:d, :d] + noise, error)), 0.0))

    def estimate(self, belief: Gaussian) -> Estimate:
        d = belief.mean.size // 2
        of_place = belief.covariance[:d, :d]
        mixed = belief.covariance[:d, d:]
        of_velocity = belief.covariance[d:, d:]
        blocks = np.stack([of_place, of_velocity, 0.5 * (mixed + mixed.T)])
        largest = np.maximum(np.linalg.eigvalsh(blocks)[:, -1], 0.0).tolist()
        position, velocity = sqrt(largest[0]), sqrt(largest[1])
        correlation = min(largest[2] / (position * velocity), 1.0) if position * velocity > 0.0 else 0.0
        state = np.stack([belief.mean[:d], belief.mean[d:], np.zeros(d)])
        return Estimate(state, KalmanError(position, velocity, correlation, self.acceleration, self.probability))

    def _measured(self, seen: Measurement) -> tuple[Array, Array]:
        """The measured numbers (m,), m = d or 2 d, and their covariance (m, m)."""
        d = seen.position.size
        values = seen.position if seen.velocity is None else np.concatenate([seen.position, seen.velocity])
        covariance = np.diag(np.repeat([self.position**2, self.velocity**2], d)[: values.size])
        if seen.covariance is not None:
            given = len(seen.covariance)
            covariance[:given, :given] = seen.covariance
        return values, covariance


# Tracks of moving obstacles from measurements that are late, rare, repeated, missing or wrong.


SYMMETRY: Final = 1e-9
"""[1] Largest difference of a measured covariance from its transpose, as a share of its largest entry.

Larger: matrices that are no covariances are taken. Smaller: rounding of the sender is refused.
"""

CALIBRATED_EVERY: Final = 0.1
"""[s] Least time between two observations that calibrate the radii.

Larger: fewer errors are known, later. Smaller: the same errors cost more time.
"""


class _Seen(NamedTuple):
    """A measurement as it came."""

    id: Hashable  # None: not known
    of: Measurement
    shape: Shape | None
    heading: float | None
    key: tuple[str, list[float], list[float]]  # id and numbers: the order at one time does not depend on the arrival


class _Track(NamedTuple):
    """An obstacle after its last measurement."""

    name: Hashable
    id: Hashable  # of the last measurement with one
    t: float  # [s] of the last measurement
    belief: Any  # at that time
    shape: Shape
    heading: float | None
    confirmed: bool  # whether a second measurement was inside its gate


class _State(NamedTuple):
    """All tracks at one time."""

    tracks: tuple[_Track, ...]
    unnamed: int  # tracks that began without an id so far
    crowded: int  # measurements with more tracks inside the gate than were compared, so far


@dataclass
class _Scan:
    """All measurements of one time, and the tracks after them."""

    t: float
    seen: list[_Seen]  # by their keys
    after: _State


NOTHING: Final = _State((), 0, 0)
"""No tracks."""


def _checked_growth(growth: float, name: str) -> float:
    """A time [s] above 0, or inf. Raises InvalidInput for something else."""
    return or_infinite(growth, name, positive)


def _checked_braking(braking: float | None, name: str) -> float | None:
    """A deceleration [m/s^2] of 0 or more, or None. Raises InvalidInput for something else."""
    return None if braking is None else not_negative(braking, name)


def _own_calibration() -> Calibration:
    """The calibration of a tracker: the radii of its filter, until errors are known."""
    return Calibration(0.95, forecast=None, prior=BoundedError())


@dataclass(eq=False)
class Tracker:
    """Obstacles followed from measurements, for decisions in a loop.

    Measurements may come in any order and at any rate. A late one is inserted at its time, and later ones are applied
    again. The result is the same to the bit for every order of arrival. What is not used is counted in `unused`.

    One rule says which track a measurement belongs to. It belongs to the nearest one that its gate admits, counted in
    standard deviations, where another id counts as OTHER_ID more; a measurement of no track begins one. So tracks
    follow obstacles with exchanged, new or missing ids, and a position that jumps gives no velocity. Beside the track
    of its id, a measurement is compared with the CANDIDATES tracks whose positions are nearest to it.

    One rule says what is there. An obstacle counts from its first measurement on, and is left out after
    `confirmation` seconds until a second measurement is near it.

    One rule bounds the age. An obstacle without a measurement in the last `max_age` seconds is dropped. A measurement
    more than `max_age` before or after the last call of `at` is not used. Of an obstacle that comes back after a longer
    gap the estimate begins anew. Other measurements later than the time of a call of `at` are kept for later calls.

    One rule gives the radii. They are those of the filter until errors of its predictions are known, then those that
    held the share `calibration.confidence` of the errors so far. Errors are known when measurements are too old to
    change, so that radii do not depend on the order of arrival.

    A track has the id of its first measurement as its name, with a number if another track has that name. Without
    an id the names are "track 1" and so on.

    It is not safe to call a tracker from several threads at once.

    Attributes:
        shape: of obstacles that come without one.
        filter: estimates the motion.
        max_age: [s].
        braking: [m/s^2] deceleration up to which round obstacles ahead of a robot may brake, see `Tracks`. None: as
            hard as the robot; 0: they keep to the prediction, as others than round ones and those in space do.
        confirmation: [s] for which an obstacle counts after a measurement that no second one confirms. Larger: a robot
            brakes longer for a false detection. Smaller: an obstacle that is measured more rarely counts late.
        calibration: of the radii; None: those of the filter.
        growth: [s] ahead up to which radii grow; inf: always. By then the robot has new measurements and decides anew.
            Larger: it keeps farther away, and waits more often. Smaller: it has to brake harder for those that stop or
            turn; less than the time in which it stops is not advised.
        unused: numbers of measurements that were not used: `late` were too old, `repeated` came before, `early` are
            later than `at` takes.
        crowded: measurements with further tracks inside the gate than those that were compared.
    """

    shape: Shape = field(default_factory=lambda: Disc(0.3))
    filter: Filter = field(default_factory=ConstantVelocityFilter)
    max_age: Positive = 1.0
    braking: Annotated[float | None, _checked_braking] = None
    confirmation: Positive = 0.3
    calibration: Calibration | None = field(default_factory=_own_calibration)
    growth: Annotated[float, _checked_growth] = 0.5
    unused: Counter[str] = field(default_factory=Counter, init=False, repr=False)
    crowded: int = field(default=0, init=False, repr=False)
    _scans: list[_Scan] = field(default_factory=list, init=False, repr=False)
    _known: int = field(default=0, init=False, repr=False)  # scans whose tracks are up to date
    _before: _State = field(default=NOTHING, init=False, repr=False)  # tracks before the first scan
    _judged: float = field(default=-np.inf, init=False, repr=False)  # time of the last observation of `calibration`
    _now: float = field(default=-np.inf, init=False, repr=False)

    def __post_init__(self) -> None:
        has(self.shape, *SHAPE, "shape")
        has(self.filter, ("begin", "predict", "correct", "distance", "estimate"), "a filter", "filter")
        if self.calibration is not None:
            has(self.calibration, ("observe", "calibrated", "forget"), "a Calibration", "calibration")
        check_fields(self)
        if first_missing("tracks") is None:
            assignment()  # an import within the loop would take as long as a decision may

    def update(
        self,
        t: float,
        id: Hashable,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike | None = None,
        covariance: npt.ArrayLike | None = None,
        shape: Shape | None = None,
        heading: float | None = None,
    ) -> bool:
        """Whether a measurement of obstacle `id` at `t` [s] is used: not if it is too old, or came before.

        Args:
            id: None: not known; scipy, of the extra `tracks`, then finds the track.
            position: (d,) [m]. velocity: (d,) [m/s]; None: not measured.
            covariance: of the position (d, d), or of position and velocity (2 d, 2 d); None: that of the filter.
            shape: None: the last one of this obstacle.
            heading: [rad] of the shape's x axis in the plane; None: the last one of this obstacle. A shape that is not
                round counts as the disc about it until a heading is known, and in space as the ball.

        Raises:
            InvalidInput: values that are not finite, a position or shape of another dimension, no covariance.
            MissingExtra: no id, and no scipy.
        """
        seen = self._checked(t, id, position, velocity, covariance, shape, heading)
        if id is None:
            require("tracks", "Tracker.update: a measurement without an id")
        if seen.of.t < self._now - self.max_age:
            self.unused["late"] += 1
            return False
        k = bisect_left(self._scans, seen.of.t, key=lambda scan: scan.t)
        if k == len(self._scans) or self._scans[k].t != seen.of.t:
            self._scans.insert(k, _Scan(seen.of.t, [], NOTHING))
        together = self._scans[k].seen
        place = bisect_left(together, seen.key, key=lambda one: one.key)
        if place < len(together) and together[place].key == seen.key:
            self.unused["repeated"] += 1
            return False
        together.insert(place, seen)
        self._known = min(self._known, k)
        return True

    def at(self, now: float, ahead: float | None = None) -> tuple[Tracks | Obstacle, ...]:
        """The obstacles as they are predicted at `now` [s], for the next decision.

        Round ones are one `Tracks`, others are obstacles; each has an uncertainty of its own, which has grown since the
        last measurement.

        ahead: [s] after `now` up to which stamps of measurements count; None: `max_age`.

        Raises:
            InvalidInput: a time before that of the last call, see `forget`; an `ahead` below 0.
        """
        self._now = now = not_before(now, self._now, "now", "a call")
        latest = now + (self.max_age if ahead is None else not_negative(ahead, "ahead"))
        counted = bisect_right(self._scans, latest, key=lambda scan: scan.t)
        self.unused["early"] += sum(len(scan.seen) for scan in self._scans[counted:])
        del self._scans[counted:]
        self._known = min(self._known, counted)
        self._replay()
        self._forget()
        until_now = bisect_right(self._scans, now, key=lambda scan: scan.t)
        state = self._scans[until_now - 1].after if until_now else self._before
        self.crowded = state.crowded
        oldest, unconfirmed = now - self.max_age, now - min(self.confirmation, self.max_age)
        there = [track for track in state.tracks if track.t >= (oldest if track.confirmed else unconfirmed)]
        found = self._estimates(there, now)
        round_ones = [one for one in found if not _turned(one[0])]
        turned = [one for one in found if _turned(one[0])]
        others = [self._obstacle(*one, radius) for one, radius in zip(turned, self._radii(turned))]
        return (*self._tracks(round_ones, now, self._radii(round_ones)), *others)

    def forget(self) -> None:
        """Begin anew, at any time: without measurements and tracks. What is known of errors, and `unused`, stay."""
        self._scans, self._known, self._before = [], 0, NOTHING._replace(crowded=self.crowded)
        self._judged = self._now = -np.inf
        if self.calibration is not None:
            self.calibration.forget()

    @property
    def ids(self) -> tuple[Hashable, ...]:
        """The names of the obstacles that are followed."""
        self._replay()
        state = self._scans[-1].after if self._scans else self._before
        return tuple(track.name for track in state.tracks if track.t >= self._now - self.max_age)

    def _replay(self) -> None:
        """Apply the measurements of all scans from the first one that changed."""
        before = self._scans[self._known - 1].after if self._known else self._before
        for scan in self._scans[self._known :]:
            before = scan.after = _after(self, before, scan)
        self._known = len(self._scans)

    def _forget(self) -> None:
        """Drop scans that no measurement may change any more, after the calibration has observed their tracks."""
        oldest = self._now - self.max_age
        count = bisect_left(self._scans, oldest, key=lambda scan: scan.t)
        for scan in self._scans[:count]:
            self._observe(scan)
        if count:
            # Tracks from before are kept as the start of a replay.
            last = self._scans[count - 1].after
            self._before = last
        kept = tuple(track for track in self._before.tracks if track.t >= oldest - self.max_age)
        self._before = self._before._replace(tracks=kept)
        del self._scans[:count]
        self._known -= count

    def _observe(self, scan: _Scan) -> None:
        """Let the calibration observe the tracks after a scan."""
        if self.calibration is None or scan.t < self._judged + CALIBRATED_EVERY:
            return
        self._judged = scan.t
        there = [one for one in scan.after.tracks if one.confirmed]
        found = self._estimates(there, scan.t)
        for tracks in self._tracks(found, scan.t, tuple(estimate.uncertainty for _, estimate in found)):
            self.calibration.observe(tracks)

    def _estimates(self, tracks: list[_Track], t: float) -> list[tuple[_Track, Estimate]]:
        """Each track with its estimate at a time."""
        return [(one, self.filter.estimate(self.filter.predict(one.belief, t - one.t))) for one in tracks]

    def _radii(self, found: list[tuple[_Track, Estimate]]) -> tuple[Uncertainty, ...]:
        """The calibrated uncertainties of estimates now, as they count for decisions."""
        stated = tuple(estimate.uncertainty for _, estimate in found)
        if self.calibration is not None and stated:
            stated = self.calibration.calibrated(stated, np.array([self._now - track.t for track, _ in found]))
        return stated if self.growth == np.inf else tuple(Adjusted(one, until=self.growth) for one in stated)

    def _tracks(self, found: list[tuple[_Track, Estimate]], t: float, radii: tuple[Uncertainty, ...]) -> list[Tracks]:
        """The estimates at a time as one Tracks with these radii; nothing if there are none."""
        if not found:
            return []
        states = np.stack([estimate.state for _, estimate in found])
        return [
            Tracks(
                states[:, 0],
                states[:, 1],
                np.array([track.shape.bounding_radius for track, _ in found]),
                t,
                accelerations=states[:, 2],
                ids=tuple(track.name for track, _ in found),
                forecast=self.filter.forecast,
                uncertainty=radii,
                braking=self.braking,
            )
        ]

    def _obstacle(self, track: _Track, estimate: Estimate, radius: Uncertainty) -> Obstacle:
        assert track.heading is not None
        position, velocity, acceleration = estimate.state
        motion = self.filter.forecast(ConstantAcceleration(position, velocity, acceleration, self._now), self._now)
        return Obstacle(track.shape, motion, str(track.name), track.heading, radius)

    def _checked(
        self,
        t: float,
        id: Hashable,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike | None,
        covariance: npt.ArrayLike | None,
        shape: Shape | None,
        heading: float | None,
    ) -> _Seen:
        """A measurement as it came. Raises InvalidInput."""
        try:
            hash(id)
        except TypeError:
            raise InvalidInput(f"id: expected a hashable name, found {shown(id)}") from None
        prefix = "detection: " if id is None else f"obstacle {id!r}: "
        place = vector(position, f"{prefix}position")
        d = place.size
        followed = self._scans[0].seen[0].of.position.size if self._scans else self._dimension_before(d)
        if d != followed:
            raise InvalidInput(f"{prefix}position: expected dimension {followed} as of the others, found {d}")
        measured_velocity = None if velocity is None else vector(velocity, f"{prefix}velocity", d)
        if shape is not None:
            has(shape, *SHAPE, f"{prefix}shape")
        own = shape or self._last_shape(id, d)
        if own.dimension != d:
            raise InvalidInput(
                f"{prefix}shape: expected one of dimension {d} as of the position, found {own.dimension}"
            )
        if heading is not None and (number(heading, f"{prefix}heading"), d)[1] == 3:
            raise InvalidInput(f"{prefix}heading: expected none in space, found {heading:g}")
        spread = None if covariance is None else _covariance(covariance, prefix, d, measured_velocity is not None)
        key = repr(id), place.tolist(), [] if measured_velocity is None else measured_velocity.tolist()
        return _Seen(id, Measurement(number(t, f"{prefix}t"), place, measured_velocity, spread), shape, heading, key)

    def _dimension_before(self, otherwise: int) -> int:
        """The dimension of the tracks before the first scan that may go on; `otherwise` without any."""
        there = (one.shape.dimension for one in self._before.tracks if one.t >= self._now - self.max_age)
        return next(there, otherwise)

    def _last_shape(self, id: Hashable, d: int) -> Shape:
        """The shape of the tracker, or one that this obstacle came with, if only that has dimension `d`."""
        came = (seen.shape for scan in self._scans for seen in scan.seen if seen.id == id and seen.shape is not None)
        kept = (track.shape for track in self._before.tracks if track.id == id)
        return self.shape if self.shape.dimension == d else next(chain(came, kept), self.shape)


class _Joining:
    """The tracks of a tracker while the measurements of one time are joined to them."""

    def __init__(self, tracker: Tracker, before: _State, t: float) -> None:
        self.tracker, self.t = tracker, t
        self.unnamed, self.crowded = before.unnamed, before.crowded
        self.tracks = [track for track in before.tracks if t - track.t <= tracker.max_age]
        self.dropped = set[int]()
        self.taken = set[int]()
        self._ahead: dict[int, Any] = {}
        self._of_id = defaultdict[Hashable, list[int]](list)
        for k, track in enumerate(self.tracks):
            self._of_id[track.id].append(k)

    def predicted(self, k: int) -> Any:
        """The belief of a track now."""
        if k not in self._ahead:
            self._ahead[k] = self.tracker.filter.predict(self.tracks[k].belief, self.t - self.tracks[k].t)
        return self._ahead[k]

    def distance(self, seen: _Seen, k: int) -> float:
        """Distance [1] of a measurement from a track."""
        return self.tracker.filter.distance(self.predicted(k), seen.of)

    def of_id(self, id: Hashable) -> list[int]:
        """The tracks that had an id last; none of an unknown id."""
        return [] if id is None else [k for k in self._of_id[id] if k not in self.dropped]

    def near(self, seen: dict[int, _Seen], among: list[int]) -> Iterator[tuple[float, int, int]]:
        """Pairs (distance [1], measurement, track) inside the gates, of the nearest CANDIDATES `among` the tracks."""
        most, places = len(among), np.empty(0)
        if seen and most > (most := min(most, CANDIDATES[next(iter(seen.values())).of.position.size])):
            places = np.array([self.tracker.filter.estimate(self.predicted(k)).state[0] for k in among])
        for i, one in seen.items():
            tracks = among
            if len(places):
                apart = ((places - one.of.position) ** 2).sum(axis=1)
                tracks = [among[rank] for rank in np.argpartition(apart, most)[:most].tolist()]
            inside = [(distance, i, k) for k in tracks if (distance := self.distance(one, k)) <= GATE]
            self.crowded += len(inside) == most < len(among)
            yield from inside

    def join(self, seen: _Seen, k: int, distance: float) -> None:
        """Correct a track by a measurement; the second one inside its gate confirms it in place of others of its id."""
        track = self.tracks[k]
        near = distance <= GATE
        if near and not track.confirmed:
            self.dropped |= set(self.of_id(track.id)) - {k}
        self._ahead[k] = belief = self.tracker.filter.correct(self.predicted(k), seen.of)
        if seen.id not in (None, track.id):
            self._of_id[track.id].remove(k)
            insort(self._of_id[seen.id], k)
        self.tracks[k] = track._replace(
            id=track.id if seen.id is None else seen.id,
            t=self.t,
            belief=belief,
            shape=seen.shape or track.shape,
            heading=track.heading if seen.heading is None else seen.heading,
            confirmed=track.confirmed or near,
        )
        self.taken.add(k)

    def begin(self, seen: _Seen) -> None:
        """Begin a track, in place of one of its id that is not confirmed."""
        own = self.of_id(seen.id)
        self.dropped |= {k for k in own if not self.tracks[k].confirmed}
        known = [self.tracks[k].shape for k in own]
        names = {str(one.name) for one in self.tracks}
        name = seen.id
        if name is None:
            self.unnamed += 1
            name = f"track {self.unnamed}"
        if str(name) in names:
            name = next(text for n in count(2) if (text := f"{seen.id} ({n})") not in names)
        shape, belief = seen.shape or next(iter(known), self.tracker.shape), self.tracker.filter.begin(seen.of)
        self._of_id[seen.id].append(len(self.tracks))
        self.tracks.append(_Track(name, seen.id, self.t, belief, shape, seen.heading, False))

    def state(self) -> _State:
        """The tracks that are there afterwards."""
        there = tuple(one for k, one in enumerate(self.tracks) if k not in self.dropped)
        return _State(there, self.unnamed, self.crowded)


def _after(tracker: Tracker, before: _State, scan: _Scan) -> _State:
    """The tracks after the measurements of one time."""
    here = _Joining(tracker, before, scan.t)
    # The pair of a track and its own id within OTHER_ID is the nearest of all pairs with either.
    waiting = [seen for seen in scan.seen if not _joined_by_id(here, seen)]
    named = {i: seen for i, seen in enumerate(waiting) if seen.id is not None}
    found = nearest_first(_costs(here, named))
    taken = here.taken | here.dropped | set(found.values())
    unknown = {i: seen for i, seen in enumerate(waiting) if seen.id is None}
    found |= least_sum(list(here.near(unknown, [k for k in range(len(here.tracks)) if k not in taken])))
    old = len(here.tracks)
    for i, k in found.items():
        here.join(waiting[i], k, here.distance(waiting[i], k))
    for i, seen in enumerate(waiting):
        if i not in found:
            # Another sensor may have measured the same obstacle at the same time.
            begun = [k for k in here.of_id(seen.id) if k >= old]
            if begun:
                here.join(seen, begun[0], here.distance(seen, begun[0]))
            else:
                here.begin(seen)
    return here.state()


def _joined_by_id(here: _Joining, seen: _Seen) -> bool:
    """Join a measurement to the track of its id, if it is near; also from afar to the only one if it is not confirmed.

    Whether the first step of an obstacle is a jump or its motion is not known before its velocity is.
    """
    own = here.of_id(seen.id)
    if not own:
        return False
    distance, k = min((here.distance(seen, k), k) for k in own)
    if distance > OTHER_ID and (len(own) > 1 or here.tracks[k].confirmed):
        return False
    here.join(seen, k, distance)
    return True


def _costs(here: _Joining, seen: dict[int, _Seen]) -> Iterator[tuple[float, int, int]]:
    """Pairs of measurements with ids and tracks they may belong to, by distances [1] where another id counts too."""
    others = [k for k, one in enumerate(here.tracks) if one.confirmed and k not in here.taken | here.dropped]
    own = {i: here.of_id(one.id) for i, one in seen.items()}
    yield from ((d, i, k) for i, one in seen.items() for k in own[i] if (d := here.distance(one, k)) <= GATE)
    yield from ((hypot(d, OTHER_ID), i, k) for d, i, k in here.near(seen, others) if k not in own[i])


def _turned(track: _Track) -> bool:
    return track.heading is not None and not is_round(track.shape)


def _covariance(given: npt.ArrayLike, prefix: str, d: int, with_velocity: bool) -> Array:
    """A covariance (d, d) or (2 d, 2 d). Raises InvalidInput for a matrix that is none."""
    found = array(given, f"{prefix}covariance")
    shapes, without = (((d, d), (2 * d, 2 * d)), "") if with_velocity else (((d, d),), " without a velocity")
    if found.shape not in shapes:
        raise InvalidInput(
            f"{prefix}covariance: expected shape {' or '.join(map(str, shapes))}{without}, found {found.shape}"
        )
    size = float(np.abs(found).max())
    if np.abs(found - found.T).max() > SYMMETRY * size or np.linalg.eigvalsh(found)[0] < -SYMMETRY * size:
        raise InvalidInput(
            f"{prefix}covariance: expected a symmetric matrix without negative eigenvalues, found another"
        )
    return found
