"""Obstacles: shapes on trajectories."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    SHAPE,
    TRAJECTORY,
    UNCERTAINTY,
    Array,
    Checked,
    array,
    check_fields,
    flag,
    has,
    known,
    not_long,
    number,
    probability,
    short,
    text,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import LONGEST_FORECAST, REST
from slalom.model.path import Path, even_knots, hermite, hermite_step
from slalom.model.shape import Disc, Shape
from slalom.model.trajectory import Composite, ConstantVelocity, Stationary, Trajectory
from slalom.model.trajectory.protocol import direction_path
from slalom.model.uncertainty import Adjusted, Uncertainty


@dataclass(frozen=True, eq=False)
class Headings:
    """Heading of a body at time stamps, linear between them; before the first and after the last it stays as it is.

    A step of pi or more between stamps counts as the shorter turn. For one of pi rounding decides.

    Args:
        times: (n,) [s], increasing.
        angles: (n,) [rad], counter-clockwise from the world's x axis.

    Raises:
        InvalidInput: no stamps, values that are not finite, times that do not increase.
    """

    times: Checked = Checked(array, "n")
    angles: Checked = Checked(array, "n")

    def __post_init__(self) -> None:
        check_fields(self)
        times, angles = self.times, self.angles
        if times.ndim != 1 or times.size == 0 or angles.shape != times.shape:
            raise InvalidInput(
                "angles: expected one for each time, and one or more, "
                f"found shape {angles.shape} for times of shape {times.shape}"
            )
        if np.any(np.diff(times) <= 0.0):
            raise InvalidInput(f"times: expected increasing times, found {short(times)}")

    @cached_property
    def _continuous(self) -> Array:
        """The angles (n,) [rad] without jumps. Files hold those that were given: after a half turn these may differ."""
        return np.asarray(np.unwrap(self.angles))

    @property
    def in_files(self) -> dict[str, list[float]]:
        """Times and angles as files hold them."""
        return {"times": self.times.tolist(), "angles": self.angles.tolist()}

    def angle(self, t: npt.ArrayLike) -> Array:
        """Angles (...) [rad] at times t (...) [s]."""
        return np.asarray(np.interp(np.asarray(t, dtype=np.float64), self.times, self._continuous))

    def direction(self, t: npt.ArrayLike) -> Array:
        """Unit vectors (..., 2) at times t (...) [s]."""
        angle = self.angle(t)
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def directions(self, start: float, end: float, tolerance: float) -> Path:
        """Unit vectors from start to end [s] as cubic pieces within `tolerance` [1] or with their own error."""
        inner = self.times[(self.times > start) & (self.times < end)]
        stamps = np.concatenate([[start], inner, [end]])
        rates = np.diff(self.angle(stamps)) / np.diff(stamps)
        parts = [self._turn(a, b, w, tolerance) for a, b, w in zip(stamps[:-1], stamps[1:], rates.tolist())]
        return Path(
            np.concatenate([part.times[:-1] for part in parts] + [[end]]),
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.error for part in parts]),
        )

    def _turn(self, start: float, end: float, rate: float, tolerance: float) -> Path:
        """Unit vectors that turn at one rate [rad/s], from start to end [s]."""
        times = even_knots(start, end, hermite_step(rate**4, tolerance))
        angle = self.angle(start) + rate * (times - start)
        e = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        error = rate**4 * (times[1] - times[0]) ** 4 / 384.0
        return hermite(times, e, rate * np.stack([-e[:, 1], e[:, 0]], axis=-1), error)


LAST_DIRECTION: Final = 1e-3
"""[1] Error of the direction that a body keeps which has come to rest. Larger: it stands at a wrong angle."""

LOOK_BACK: Final = 600.0
"""[s] How long ago an obstacle at rest may have moved last for its heading to be known from that motion."""


MOTION: Final = "motion"
AFTER_END: Final = ("unknown", "continues", "leaves")


@dataclass(frozen=True, eq=False)
class Obstacle:
    """`shape` that moves along `trajectory`; `name` appears in messages and recordings.

    Attributes:
        heading: direction of the shape's x axis in the plane: an angle [rad], counter-clockwise from the world's x
            axis; `Headings`: angles over time; or "motion": along the velocity. At rest the last direction is kept.
        uncertainty: bound on the distance from the trajectory as a function of the time since the decision; None:
            exact.
        after_end: what follows the end of the trajectory. "unknown": a decision before the end takes the obstacle to
            continue at its last velocity, and a decision after the end is refused. "continues": it continues at its
            last velocity at every time, and its uncertainty grows from the end on. "leaves": it exists no more.
        contact_at_rest: whether a contact counts while the robot is at rest. False for what a robot must never run into
            but may be touched by after it has stopped (passive safety, see `Sight`). Such an obstacle may stand for
            another one of its name in any motion: a robot for which nothing is safe relies on it alone.
        probability: [1] with which it moves so, above 0. Below 1 it is one of several futures: pass the others as
            obstacles with the same `owner`. What the sum leaves to 1 is the probability that there is no obstacle.
        owner: text that the futures of one obstacle have in common, and no other obstacle has; "": its name.

    Raises:
        InvalidInput: no shape or trajectory, or two of different dimension; a shape longer than 1e7 m; a heading in
            space, or an invalid one; another word for `after_end`; a probability that is not above 0 and at most 1, or
            below 1 without a name or owner.
    """

    shape: Shape
    trajectory: Trajectory
    name: str = ""
    heading: float | Headings | Literal["motion"] = 0.0
    uncertainty: Uncertainty | None = None
    after_end: Literal["unknown", "continues", "leaves"] = "unknown"
    contact_at_rest: bool = True
    probability: float = 1.0
    owner: str = ""

    def __post_init__(self) -> None:
        text(self.name, "name")
        prefix = f"{self._named}: "
        has(self.shape, *SHAPE, f"{prefix}shape")
        not_long(self.shape.bounding_radius, f"{prefix}shape")
        has(self.trajectory, *TRAJECTORY, f"{prefix}trajectory")
        if self.shape.dimension != self.trajectory.dimension:
            raise InvalidInput(
                f"{prefix}expected shape and trajectory of the same dimension, "
                f"found {self.shape.dimension} and {self.trajectory.dimension}"
            )
        if self.uncertainty is not None:
            has(self.uncertainty, *UNCERTAINTY, f"{prefix}uncertainty")
        if isinstance(self.heading, str):
            if self.heading != MOTION:
                raise InvalidInput(f"heading: expected an angle [rad], Headings or {MOTION!r}, found {self.heading!r}")
        elif not isinstance(self.heading, Headings):
            object.__setattr__(self, "heading", number(self.heading, "heading"))
        known(self.after_end, "after_end", AFTER_END)
        object.__setattr__(self, "contact_at_rest", flag(self.contact_at_rest, "contact_at_rest"))
        object.__setattr__(self, "probability", probability(self.probability, f"{prefix}probability"))
        if self.probability < 1.0 and not text(self.owner, f"{prefix}owner") and not self.name:
            raise InvalidInput(f"{prefix}expected a name or an owner with a probability below 1, found neither")
        if self.dimension == 3 and self.heading != 0.0:
            raise InvalidInput(f"heading: expected 0 in space, where orientation is constant, found {self.heading!r}")

    @property
    def _named(self) -> str:
        """The obstacle with its name, if any, for messages."""
        return f"obstacle {self.name!r}" if self.name else "obstacle"

    @cached_property
    def dimension(self) -> int:
        """2 or 3."""
        return self.shape.dimension

    @property
    def turns(self) -> bool:
        """Whether the covered set turns: always False for a disc."""
        return isinstance(self.heading, str | Headings) and not isinstance(self.shape, Disc)

    @property
    def angle(self) -> float | None:
        """Constant heading [rad] of the covered set; None: it turns."""
        if self.turns:
            return None
        return 0.0 if isinstance(self.heading, str | Headings) else self.heading

    @property
    def at_rest(self) -> bool:
        """Whether the covered set is always the same."""
        return isinstance(self.trajectory, Stationary) and not (self.turns and isinstance(self.heading, Headings))

    @cached_property
    def has_first_direction(self) -> bool:
        """Whether the direction is known from the first: False for a body that turns and is at rest at first."""
        if not self.turns or isinstance(self.heading, Headings):
            return True
        first = self.trajectory.span[0]
        if first == -np.inf:
            first = float(self.trajectory.breaks(-LONGEST_FORECAST, LONGEST_FORECAST).min(initial=1.0)) - 1.0
        return float(np.linalg.norm(self.trajectory.velocity(first))) > REST

    def direction(self, t: npt.ArrayLike) -> Array:
        """Unit vectors (..., 2) of the shape's x axis at times t (...) [s], in the plane.

        Raises:
            InvalidInput: the heading follows the motion, and the obstacle has not moved before t.
        """
        time = np.asarray(t, dtype=np.float64)
        if isinstance(self.heading, Headings):
            return self.heading.direction(time)
        if not isinstance(self.heading, str):
            return np.asarray(np.broadcast_to([np.cos(self.heading), np.sin(self.heading)], (*time.shape, 2)))
        velocity = self.trajectory.velocity(time)
        speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
        result = velocity / np.where(speed > REST, speed, 1.0)
        for index in np.argwhere(speed[..., 0] <= REST):
            result[tuple(index)] = self._last_direction(float(time[tuple(index)]))
        return np.asarray(result)

    def _last_direction(self, t: float) -> Array:
        """Direction (2,) of the last motion before t [s]."""
        earliest = max(self.trajectory.span[0], t - LOOK_BACK)
        if earliest >= t or self.trajectory.speed_bound(earliest, t) <= REST:
            raise InvalidInput(
                f"heading of {self._named}: expected one that moved before {t:g} s, found it at rest since "
                f"{earliest:g} s; give the heading as an angle"
            )
        pieces = direction_path(self.trajectory, earliest, t, LAST_DIRECTION).points[:, 3]
        last = pieces[np.any(pieces != 0.0, axis=1)][-1]
        return np.asarray(last / np.linalg.norm(last))

    def directions(self, start: float, end: float, tolerance: float) -> Path:
        """`direction` from start to end [s] as cubic pieces, within `tolerance` [1] or with their own error."""
        if isinstance(self.heading, Headings):
            return self.heading.directions(start, end, tolerance)
        if self.heading != MOTION or self.trajectory.speed_bound(start, end) <= REST:
            pieces = np.broadcast_to(self.direction(start), (1, 4, 2))
            return Path(np.array([start, end]), pieces, np.zeros(1))
        return direction_path(self.trajectory, start, end, tolerance, lambda: self.direction(start))

    def exists(self, t: float) -> bool:
        """Whether the obstacle exists at time t [s]; after the end of its trajectory, whether it has not left."""
        first, last = self.trajectory.span
        return first <= t and (t <= last or self.after_end != "leaves")

    @cached_property
    def continued(self) -> "Obstacle":
        """The obstacle on a trajectory that continues at its last velocity; the same object if it leaves or has no end.

        Its uncertainty is not changed.
        """
        last = self.trajectory.span[1]
        if self.after_end == "leaves" or last == np.inf:
            return self
        rest = ConstantVelocity(self.trajectory.position(last), self.trajectory.velocity(last), last)
        return replace(self, trajectory=Composite((self.trajectory, rest), (last,)))

    def known_at(self, now: float) -> "Obstacle":
        """The obstacle for a decision at `now` [s], see `after_end`; the same object at most calls.

        Raises:
            InvalidInput: the trajectory ends before `now`, and what follows is unknown.
        """
        last = self.trajectory.span[1]
        if last >= now or self.after_end == "leaves":
            return self.continued
        if self.after_end == "unknown":
            raise InvalidInput(
                f"{self._named}: expected a trajectory that is known at {now:g} s, found one that ended at "
                f"{last:g} s; say after_end='continues' or 'leaves', or give a newer observation"
            )
        if self.uncertainty is None:
            return self.continued
        return replace(self.continued, uncertainty=Adjusted(self.uncertainty, now - last))

    def of_scenario(self) -> "Obstacle":
        """The obstacle in a simulated world, where nothing is unknown: there it leaves unless it continues.

        Raises:
            InvalidInput: one of several futures.
        """
        if self.probability < 1.0:
            raise InvalidInput(
                f"{self._named}: expected a probability of 1 in a scenario, where each has one future, "
                f"found {self.probability:g}"
            )
        if self.after_end == "continues":
            return self.continued
        return self if self.trajectory.span[1] == np.inf else replace(self, after_end="leaves")
