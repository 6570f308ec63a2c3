"""Tracks of moving obstacles from measurements that are late, rare, repeated or missing."""

from bisect import bisect_right
from collections.abc import Hashable
from dataclasses import dataclass, field
from math import sqrt
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
    shown,
    vector,
)
from slalom.base.errors import InvalidInput
from slalom.forecast.forecast import AtConstantVelocity, Forecast
from slalom.model.shape import Disc, Shape, is_round
from slalom.model.trajectory import ConstantAcceleration
from slalom.model.uncertainty import KalmanError, Uncertainty
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.tracks import Tracks

# ---------------------------------------------------------------------------------------------------------------------
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


# ---------------------------------------------------------------------------------------------------------------------
# Tracks of moving obstacles from measurements that are late, rare, repeated or missing.


SYMMETRY: Final = 1e-9
"""[1] Largest difference of a measured covariance from its transpose, as a share of its largest entry.

Larger: matrices that are no covariances are taken. Smaller: rounding of the sender is refused.
"""


class _Step(NamedTuple):
    """A measurement of one obstacle, and the estimate after it."""

    key: tuple[float, ...]  # time, then the numbers: the order does not depend on that of arrival
    seen: Measurement
    given: tuple[Shape | None, float | None]  # shape and heading as they came with the measurement
    belief: Any
    shape: Shape
    heading: float | None


def _checked_braking(braking: float | None, name: str) -> float | None:
    """A deceleration [m/s^2] of 0 or more, or None. Raises InvalidInput for something else."""
    return None if braking is None else not_negative(braking, name)


@dataclass(eq=False)
class Tracker:
    """Obstacles followed by their ids, for decisions in a loop.

    Measurements may come in any order and at any rate. A late one is inserted at its time, and later ones are applied
    again. The result is the same to the bit for every order of arrival.

    One rule bounds the age. An obstacle without a measurement in the last `max_age` seconds is dropped. A measurement
    more than `max_age` before the last call of `at` is not used. Of an obstacle that comes back after a longer gap the
    estimate begins anew. Measurements later than the time of a call of `at` are kept for later calls.

    It is not safe to call a tracker from several threads at once.

    Attributes:
        shape: of obstacles that come without one.
        filter: estimates the motion.
        max_age: [s].
        braking: [m/s^2] deceleration up to which round obstacles ahead of a robot may brake, see `Tracks`. None: as
            hard as the robot; 0: they keep to the prediction, as others than round ones and those in space do.
    """

    shape: Shape = field(default_factory=lambda: Disc(0.3))
    filter: Filter = field(default_factory=ConstantVelocityFilter)
    max_age: Positive = 1.0
    braking: Annotated[float | None, _checked_braking] = None
    _steps: dict[Hashable, list[_Step]] = field(default_factory=dict, init=False, repr=False)
    _now: float = field(default=-np.inf, init=False, repr=False)

    def __post_init__(self) -> None:
        has(self.shape, *SHAPE, "shape")
        has(self.filter, ("begin", "predict", "correct", "estimate"), "a filter", "filter")
        check_fields(self)

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
            position: (d,) [m]. velocity: (d,) [m/s]; None: not measured.
            covariance: of the position (d, d), or of position and velocity (2 d, 2 d); None: that of the filter.
            shape: None: the last one of this obstacle.
            heading: [rad] of the shape's x axis in the plane; None: the last one of this obstacle. A shape that is not
                round counts as the disc about it until a heading is known, and in space as the ball.

        Raises:
            InvalidInput: values that are not finite, a position or shape of another dimension, no covariance.
        """
        seen, given = self._checked(t, id, position, velocity, covariance, shape, heading)
        key = (seen.t, *seen.position.tolist(), *([] if seen.velocity is None else seen.velocity.tolist()))
        steps = self._steps.setdefault(id, [])
        k = bisect_right(steps, key, key=lambda step: step.key)
        too_old, again = seen.t < self._now - self.max_age, k > 0 and steps[k - 1].key == key
        if not (too_old or again):
            steps[k:] = self._replayed(steps[:k], [(key, seen, given), *((s.key, s.seen, s.given) for s in steps[k:])])
        if not steps:
            del self._steps[id]
        return not (too_old or again)

    def at(self, now: float) -> tuple[Tracks | Obstacle, ...]:
        """The obstacles as they are predicted at `now` [s], for the next decision.

        Round ones are one `Tracks`, others are obstacles; each has an uncertainty of its own, which has grown since the
        last measurement.

        Raises:
            InvalidInput: a time before that of the last call.
        """
        self._now = now = not_before(now, self._now, "now", "a call")
        found: list[tuple[Hashable, _Step, Estimate]] = []
        for id in list(self._steps):
            known = self._known(id)
            if known is not None:
                belief = self.filter.predict(known.belief, now - known.seen.t)
                found.append((id, known, self.filter.estimate(belief)))
        round_ones = [one for one in found if one[1].heading is None or is_round(one[1].shape)]
        others = [self._obstacle(id, step, estimate) for id, step, estimate in found if _turned(step)]
        return (*self._tracks(round_ones), *others)

    @property
    def ids(self) -> tuple[Hashable, ...]:
        """The obstacles that are followed."""
        return tuple(self._steps)

    def _known(self, id: Hashable) -> _Step | None:
        """The last step of an obstacle up to now; older steps are dropped. None for one that is not there."""
        steps, oldest = self._steps[id], self._now - self.max_age
        # One step from before is kept as the start of a replay.
        steps[: max(sum(step.seen.t < oldest for step in steps) - 1, 0)] = []
        if steps[-1].seen.t < oldest:
            del self._steps[id]
            return None
        until_now = [step for step in steps if step.seen.t <= self._now]
        return until_now[-1] if until_now and until_now[-1].seen.t >= oldest else None

    def _replayed(
        self,
        before: list[_Step],
        coming: list[tuple[tuple[float, ...], Measurement, tuple[Shape | None, float | None]]],
    ) -> list[_Step]:
        """The steps of `coming` measurements after those `before`."""
        last, made = before[-1] if before else None, []
        for key, seen, given in coming:
            if last is None or seen.t - last.seen.t > self.max_age:
                belief = self.filter.begin(seen)
            else:
                belief = self.filter.correct(self.filter.predict(last.belief, seen.t - last.seen.t), seen)
            shape = given[0] or (self.shape if last is None else last.shape)
            heading = given[1] if given[1] is not None or last is None else last.heading
            last = _Step(key, seen, given, belief, shape, heading)
            made.append(last)
        return made

    def _tracks(self, found: list[tuple[Hashable, _Step, Estimate]]) -> list[Tracks]:
        if not found:
            return []
        states = np.stack([estimate.state for _, _, estimate in found])
        return [
            Tracks(
                states[:, 0],
                states[:, 1],
                np.array([step.shape.bounding_radius for _, step, _ in found]),
                self._now,
                accelerations=states[:, 2],
                ids=tuple(id for id, _, _ in found),
                forecast=self.filter.forecast,
                uncertainty=tuple(estimate.uncertainty for _, _, estimate in found),
                braking=self.braking,
            )
        ]

    def _obstacle(self, id: Hashable, step: _Step, estimate: Estimate) -> Obstacle:
        assert step.heading is not None
        position, velocity, acceleration = estimate.state
        motion = self.filter.forecast(ConstantAcceleration(position, velocity, acceleration, self._now), self._now)
        return Obstacle(step.shape, motion, str(id), step.heading, estimate.uncertainty)

    def _checked(
        self,
        t: float,
        id: Hashable,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike | None,
        covariance: npt.ArrayLike | None,
        shape: Shape | None,
        heading: float | None,
    ) -> tuple[Measurement, tuple[Shape | None, float | None]]:
        """A measurement, and the shape and heading that came with it. Raises InvalidInput."""
        try:
            hash(id)
        except TypeError:
            raise InvalidInput(f"id: expected a hashable name, found {shown(id)}") from None
        prefix = f"obstacle {id!r}: "
        place = vector(position, f"{prefix}position")
        d = place.size
        followed = next((steps[-1].seen.position.size for steps in self._steps.values()), d)
        if d != followed:
            raise InvalidInput(f"{prefix}position: expected dimension {followed} as of the others, found {d}")
        measured_velocity = None if velocity is None else vector(velocity, f"{prefix}velocity", d)
        if shape is not None:
            has(shape, *SHAPE, f"{prefix}shape")
        own = shape or self._last_shape(id)
        if own.dimension != d:
            raise InvalidInput(
                f"{prefix}shape: expected one of dimension {d} as of the position, found {own.dimension}"
            )
        if heading is not None and (number(heading, f"{prefix}heading"), d)[1] == 3:
            raise InvalidInput(f"{prefix}heading: expected none in space, found {heading:g}")
        spread = None if covariance is None else _covariance(covariance, prefix, d, measured_velocity is not None)
        return Measurement(number(t, f"{prefix}t"), place, measured_velocity, spread), (shape, heading)

    def _last_shape(self, id: Hashable) -> Shape:
        return self._steps[id][-1].shape if id in self._steps else self.shape


def _turned(step: _Step) -> bool:
    return step.heading is not None and not is_round(step.shape)


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
