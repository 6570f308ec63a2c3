"""Discs and balls that are observed anew at every decision, as arrays."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import (
    FORECAST,
    UNCERTAINTY,
    Array,
    array,
    array_of,
    each_number,
    flag,
    has,
    listing,
    not_huge,
    not_long,
    number,
    probability,
    whole_numbers,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST
from slalom.forecast.forecast import OBSERVING, AcceleratingBriefly, AtConstantVelocity, Forecast
from slalom.forecast.linear import table_between, table_until
from slalom.kernels.arrays import EVERY_WORLD, Bodies, Indices, Pieces, zero_records
from slalom.kernels.decision.tables import AtHorizon, ObstacleAtHorizon
from slalom.model.limits import Limits
from slalom.model.shape import Shape, is_round, round_shape
from slalom.model.state import State
from slalom.model.trajectory import ConstantAcceleration
from slalom.model.uncertainty import Uncertainty, radii_between, with_share
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.pieces import (
    NO_TURNS,
    UNCERTAINTY_PIECES,
    Reach,
    bodies_of,
    merged,
    no_bodies,
    pieces_of_each,
    sum_of_shapes,
)
from slalom.obstacle.table import NO_CORNERS, Outlines

FOLLOWED: Final = 0.9
"""[1] Cosine of the angle between the velocities of a robot and of those that it follows: 26 degrees. Larger: a robot
is not ready for a leader on a bend that brakes. Smaller: in a crowd it also waits for others that cross its way."""


class Tracks:
    """Discs or balls observed at one time, such as the people that a perception system follows.

    Args:
        positions: (n, d) [m]. velocities: (n, d) [m/s]. radii: (n,) or one for all [m] >= 0.
        t: absolute time of the observation [s], not after the decision; between the two they move as predicted.
        accelerations: (n, d) [m/s^2]; None: 0.
        ids: names, for messages; none: their numbers.
        forecast: predicts their motion where the method takes trajectories as they are given; by default
            AcceleratingBriefly with accelerations and AtConstantVelocity without. Other methods use their own.
        uncertainty: bound on the distance from the prediction as a function of the time since t, one for all or a
            sequence with one for each; None: exact.
        worlds: (n,) numbers of the worlds of a `Fleet` that they are in; None: all of them.
        shares: (n,) or one for all, part [1] of the avoidance that each does itself, from 0 to 0.5, as `Reciprocity`
            estimates it. It counts for `Navigator.decide(robots=)`; None: as the method says.
        braking: (n,) or one for all [m/s^2], deceleration up to which those may brake that the robot follows: those on
            its straight way that move in its direction. Its decisions then avoid all places from the predicted one to
            that of the hardest braking. None: as hard as the robot itself; 0: they keep to the prediction. Discs in
            the plane.
        probabilities: (n,) [1] with which each moves so, above 0 and at most 1. Tracks of one id are then the futures
            of one obstacle, see `Obstacle.probability`; None: all move as predicted.
        contact_at_rest: whether contacts with them count while the robot is at rest, see `Obstacle.contact_at_rest`.

    What was given can be read: the attributes have the names of the arguments, `uncertainties` that of each.

    Raises:
        InvalidInput: arrays whose shapes do not fit, values that are not finite, a negative radius; ids or
            uncertainties of another number; a forecast that needs the past or the future; a probability out of range.
    """

    def __init__(
        self,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike,
        radii: npt.ArrayLike,
        t: float = 0.0,
        *,
        accelerations: npt.ArrayLike | None = None,
        ids: Sequence[object] = (),
        forecast: Forecast | None = None,
        uncertainty: Uncertainty | Sequence[Uncertainty | None] | None = None,
        worlds: npt.ArrayLike | None = None,
        shares: npt.ArrayLike | None = None,
        braking: npt.ArrayLike | None = None,
        probabilities: npt.ArrayLike | None = None,
        contact_at_rest: bool = True,
    ) -> None:
        places = array(positions, "positions")
        if places.ndim != 2 or places.shape[1] not in (2, 3):
            none = "; np.empty((0, 2)) has no track" if places.shape == (0,) else ""
            found = f"found shape {places.shape}{none}"
            raise InvalidInput(f"positions: expected an array of shape (n, 2) or (n, 3), {found}")
        n, self.dimension = places.shape
        given = (places, velocities, np.zeros(places.shape) if accelerations is None else accelerations)
        columns = [array_of(rows, name, places.shape) for rows, name in zip(given, _COLUMNS, strict=True)]
        self.states = np.stack(columns, axis=1)
        radius = not_huge(array(radii, "radii"), "radii")
        if radius.shape not in ((), (n,)) or np.any(radius < 0.0):
            raise InvalidInput(f"radii: expected one or {n} of at least 0 m, found {np.atleast_1d(radius).tolist()}")
        not_long(float(radius.max(initial=0.0)), "radii")
        listing(ids, "names", "ids")
        if len(ids) not in (0, n):
            raise InvalidInput(f"ids: expected {n}, found {len(ids)}")
        self.radii = np.full(n, radius)
        self.t = number(t, "t")
        self.ids = tuple(ids) or tuple(range(n))
        self.uncertainties: tuple[Uncertainty | None, ...]
        if uncertainty is None or isinstance(uncertainty, Uncertainty):
            self.uncertainties = (uncertainty,) * n
        else:
            listing(uncertainty, "an uncertainty, such as BoundedError(0.1), or a list of them", "uncertainty")
            self.uncertainties = tuple(uncertainty)
        for k, one in enumerate(self.uncertainties):
            if one is not None:
                has(one, *UNCERTAINTY, f"uncertainty[{k}]")
        if len(self.uncertainties) != n:
            raise InvalidInput(f"uncertainty: expected one or {n}, found {len(self.uncertainties)}")
        self.worlds = np.full(n, EVERY_WORLD) if worlds is None else whole_numbers(worlds, "worlds", n)
        self.shares = None if shares is None else self._checked(shares)
        self.braking = None if braking is None else self._checked_braking(braking)
        # Of those that a robot follows, see `followed_by`.
        self._braking: Array | None = None
        self.contact_at_rest = flag(contact_at_rest, "contact_at_rest")
        self.probabilities = None if probabilities is None else array_of(probabilities, "probabilities", (n,))
        for k, weight in enumerate(() if self.probabilities is None else self.probabilities.tolist()):
            probability(weight, f"probabilities[{k}]")
        usual = AtConstantVelocity() if accelerations is None else AcceleratingBriefly()
        self.forecast: Forecast = _usable(usual if forecast is None else forecast)

    @property
    def is_passive(self) -> bool:
        """Whether contacts do not count while the robot is at rest."""
        return not self.contact_at_rest

    def passive(self) -> "Tracks":
        """The same tracks, contacts with which do not count while the robot is at rest."""
        return self._changed(contact_at_rest=False)

    @property
    def has_futures(self) -> bool:
        """Whether some tracks are futures with a probability below 1."""
        return self.probabilities is not None

    @property
    def positions(self) -> Array:
        """(n, d) [m] at `t`."""
        return self.states[:, 0]

    @property
    def velocities(self) -> Array:
        """(n, d) [m/s] at `t`."""
        return self.states[:, 1]

    @property
    def accelerations(self) -> Array:
        """(n, d) [m/s^2] at `t`."""
        return self.states[:, 2]

    def __repr__(self) -> str:
        return f"<Tracks at {self.t:g} s, number: {len(self)}, dimension: {self.dimension}>"

    def __len__(self) -> int:
        return len(self.states)

    def _checked(self, shares: npt.ArrayLike) -> Array:
        found = each_number(shares, "shares", len(self))
        if np.any((found < 0.0) | (found > 0.5)):
            raise InvalidInput(f"shares: expected numbers from 0 to 0.5, found {found.tolist()}")
        return found

    def _checked_braking(self, braking: npt.ArrayLike) -> Array:
        found = each_number(braking, "braking", len(self))
        if np.any(found < 0.0):
            raise InvalidInput(f"braking: expected numbers of 0 m/s^2 or more, found {found.tolist()}")
        if self.dimension == 3 and np.any(found > 0.0):
            raise InvalidInput(f"braking: expected 0 m/s^2 in space, found {found.tolist()}")
        return found

    def followed_by(self, robot: Shape, state: State, limits: Limits) -> "Tracks":
        """The same tracks, of which those may brake that a robot in `state` follows: see `braking`.

        It follows those that cover a part of its straight way and move in its direction, to FOLLOWED. A round
        robot follows none that it overlaps, since it leaves it.
        """
        if self.dimension == 3 or not len(self) or (self.braking is not None and not self.braking.any()):
            return self
        speeds = np.linalg.norm(self.states[:, 1], axis=1)
        own, ahead = state.velocity, self.states[:, 0] - state.position
        along = FOLLOWED * np.linalg.norm(own) * speeds
        followed = (self.states[:, 1] @ own >= along) & (speeds > REST) & (ahead @ own > 0.0) & bool(own.any())
        inner = robot.parts[0].radius if is_round(robot) else 0.0
        followed &= np.linalg.norm(ahead, axis=1) > self.radii + inner
        beside = np.abs(ahead[:, 0] * own[1] - ahead[:, 1] * own[0])
        followed &= beside < (self.radii + robot.bounding_radius) * np.linalg.norm(own)
        if not followed.any():
            return self
        hardest = np.full(len(self), limits.braking) if self.braking is None else self.braking
        return self._changed(_braking=np.where(followed, hardest, 0.0))

    @property
    def leads(self) -> bool:
        """Whether a robot follows some of them, which may brake, see `followed_by`."""
        return self._braking is not None and bool(self._braking.any())

    def with_shares(self, shares: npt.ArrayLike) -> "Tracks":
        """The same tracks with other `shares`, (n,) or one. Raises InvalidInput for numbers outside of 0 to 0.5."""
        return self._changed(shares=self._checked(shares))

    def covering(self, share: float) -> "Tracks":
        """The same tracks with sets that hold at most a share of the errors, see `with_share`."""
        return self._changed(uncertainties=tuple(with_share(one, share) for one in self.uncertainties))

    @property
    def yielding(self) -> tuple["Tracks", "Tracks"]:
        """Those that do a part of the avoidance, and those that do none."""
        if self.shares is None:
            return self, self._some(np.empty(0, np.int64))
        return self._some(np.flatnonzero(self.shares > 0.0)), self._some(np.flatnonzero(self.shares == 0.0))

    def with_forecast(self, forecast: Forecast) -> "Tracks":
        """The same tracks with another forecast. Raises InvalidInput for one that needs the past."""
        return self._changed(forecast=_usable(forecast))

    def refuse_later(self, now: float, name: str = "obstacles") -> None:
        """Raise InvalidInput for tracks that are observed after `now` [s]."""
        if self.t > now:
            raise InvalidInput(f"{name}: expected tracks with a time t up to {now:g} s, found {self.t:g} s")

    def refuse_worlds(self, name: str) -> None:
        """Raise InvalidInput for tracks with numbers of worlds, where there is one world."""
        if np.any(self.worlds != EVERY_WORLD):
            raise InvalidInput(f"{name}: expected tracks without worlds, which only a fleet has, found some with")

    def refuse_probabilities(self, name: str) -> None:
        """Raise InvalidInput for tracks with probabilities, where each is an agent with one motion."""
        if self.probabilities is not None:
            raise InvalidInput(f"{name}: expected tracks without probabilities, found some with; they are obstacles")

    def in_world(self, world: int) -> "Tracks":
        """The tracks in a world, without numbers of worlds."""
        some = self._some(np.flatnonzero((self.worlds == world) | (self.worlds == EVERY_WORLD)))
        return some._changed(worlds=np.full(len(some), EVERY_WORLD))

    def _some(self, some: Indices) -> "Tracks":
        """The tracks of some indices."""
        return self._changed(
            states=self.states[some],
            radii=self.radii[some],
            worlds=self.worlds[some],
            ids=tuple(self.ids[k] for k in some),
            uncertainties=tuple(self.uncertainties[k] for k in some),
            shares=None if self.shares is None else self.shares[some],
            braking=None if self.braking is None else self.braking[some],
            _braking=None if self._braking is None else self._braking[some],
            probabilities=None if self.probabilities is None else self.probabilities[some],
        )

    def _changed(self, **attributes: Any) -> "Tracks":
        """The same tracks with other attributes, which are checked already: many times as fast as `copy.copy`."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, **attributes)
        other.__dict__.pop("obstacles", None)
        return other

    @cached_property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The tracks one by one, on their predicted trajectories."""
        return tuple(self.obstacle(k) for k in range(len(self)))

    def obstacle(self, index: int) -> Obstacle:
        """One track, on its predicted trajectory."""
        position, velocity, acceleration = self.states[index]
        return Obstacle(
            round_shape(float(self.radii[index]), self.dimension),
            self.forecast(ConstantAcceleration(position, velocity, acceleration, self.t), self.t),
            str(self.ids[index]),
            uncertainty=self.uncertainties[index],
            probability=1.0 if self.probabilities is None else float(self.probabilities[index]),
            owner=str(self.ids[index]),
            contact_at_rest=self.contact_at_rest,
        )

    def paths(self, end: float) -> tuple[Array, Array]:
        """The predicted motion of each up to `end` [s]: knots (n, q + 1) [s], control points (n, q, 4, d) [m]."""
        rule = table_until(self.forecast, end - self.t)
        if rule is not None:
            knots = np.empty((len(self), len(rule.times)))
            knots[:] = self.t + rule.times
            return knots, rule.points(self.states)
        each = [obstacle.trajectory.path(self.t, end) for obstacle in self.obstacles]
        q = max((len(path.points) for path in each), default=1)
        times, points = np.empty((len(self), q + 1)), np.zeros((len(self), q, 4, self.dimension))
        for k, path in enumerate(each):
            # Pieces without duration fill the rows of shorter paths.
            times[k], points[k] = path.times[-1], path.points[-1, 3]
            times[k, : len(path.times)], points[k, : len(path.points)] = path.times, path.points
        return times, points

    @property
    def outlines(self) -> Outlines:
        """The outlines of all tracks, see `ObstacleTable.outlines`."""
        n = len(self)
        each = zero_records(ObstacleAtHorizon, n)
        each["radius"] = each["ball"] = self.radii
        each["filled"], each["world"] = True, self.worlds
        return Outlines(np.arange(n), np.ones(n, np.bool_), AtHorizon(each, NO_CORNERS))

    def bodies(self, robot: Shape, start: float, until: Array, horizon: float, reach: Reach | None = None) -> Bodies:
        """Bodies of the tracks, see `ObstacleTable.bodies`. Raises InvalidInput for tracks observed after `start`."""
        self.refuse_later(start)
        counts = until > 0.0
        if not counts.any():
            return no_bodies(self.dimension, len(self))
        brakes = counts & (False if self._braking is None else self._braking > 0.0)
        if not counts.all() or brakes.any():
            kept, some = np.flatnonzero(counts & ~brakes), np.flatnonzero(brakes)
            rest, slowing = self._some(kept)._changed(_braking=None), self._some(some)
            parts = [rest.bodies(robot, start, until[kept], horizon)]
            if len(some):
                found = pieces_of_each(slowing.obstacles, robot, start, until[some], self.t, slowing._braking)
                found.each["world"] = slowing.worlds[found.owner]
                parts.append(found)
            together = merged(parts)
            together.each["owner"] = np.append(kept, some)[together.owner]
            return together._replace(until=np.full(len(self), np.inf))
        exact = np.array([uncertainty is None for uncertainty in self.uncertainties])
        cuts = 1 if exact.all() else UNCERTAINTY_PIECES
        rule = table_between(self.forecast, start - self.t, horizon, cuts)
        if rule is None or np.any(until != horizon):
            found = pieces_of_each(self.obstacles, robot, start, until, decided=self.t)
            found.each["world"] = self.worlds[found.each["owner"]]
            return found
        shape = sum_of_shapes(round_shape(0.0, self.dimension), robot)
        n = len(self)
        k = len(rule.shares)
        b, d = len(shape.radius), self.dimension
        points = np.asarray(rule.points(self.states)[:, None] + shape.offsets[:, None, None])
        total = n * b
        widths = np.repeat(self._widths(rule.times + (start - self.t)), b, axis=0)
        pieces = Pieces(
            np.tile(np.stack([rule.times[:-1], rule.times[1:]], axis=1), (total, 1)),
            points.reshape(total * k, 4, d),
            widths[:, :-1].ravel(),
            np.diff(widths, axis=1).ravel(),
            NO_TURNS,
            np.repeat(np.arange(total), k),
        )
        every = shape.repeated(n)
        every = every._replace(radius=every.radius + np.repeat(self.radii, b))
        found = bodies_of(pieces, every, np.repeat(np.arange(n), b), np.repeat(~exact, b), n)
        found.each["world"] = np.repeat(self.worlds, b)
        found.each["at_rest"] = self.contact_at_rest
        return found

    def _widths(self, elapsed: Array) -> Array:
        """The uncertainty (n, k) [m] of each at times (k,) [s] since the observation."""
        different = {id(one): one for one in self.uncertainties if one is not None}
        radii = {key: radii_between(one, elapsed, self.dimension) for key, one in different.items()}
        return np.stack([radii.get(id(one), np.zeros(len(elapsed))) for one in self.uncertainties])


_COLUMNS = ("positions", "velocities", "accelerations")


def _usable(forecast: Forecast) -> Forecast:
    has(forecast, *FORECAST, "forecast")
    if isinstance(forecast, OBSERVING) or forecast.includes_future:
        raise InvalidInput(
            f"tracks: expected a forecast from what is observed at one time, as of nao or nao@present, found {forecast}"
        )
    return forecast


def told_apart(ids: Sequence[object], name: str) -> None:
    """Raise InvalidInput if two of the ids are equal, or are the same text."""
    seen = set[str]()
    for text_of_id in map(str, ids):
        if text_of_id in seen:
            raise InvalidInput(
                f"{name}: expected different ones, by which tracks are told apart; found {text_of_id} twice"
            )
        seen.add(text_of_id)
