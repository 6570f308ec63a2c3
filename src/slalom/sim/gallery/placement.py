"""Robots placed at random or in a pattern, none on top of another."""

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.shape import Disc
from slalom.sim.periodic import Period, to_nearest
from slalom.sim.scenario import Robot
from slalom.state import State
from slalom.trajectory import Stationary

TRIES = 10_000
"""Places drawn in vain before a room counts as full; it is then full to about half of its area."""


def random_positions(
    count: int,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    apart: float,
    rng: np.random.Generator,
    what: str = "robots",
    period: Period = (np.inf, np.inf),
) -> Array:
    """`count` places (count, 2) [m], uniform in the rectangle from `low` to `high` (2,), each `apart` from all others,
    and from all their images in a world that repeats.

    Raises:
        InvalidInput: TRIES places in a row were too near to others, or the rectangle is empty.
    """
    first, last = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    places = np.empty((0, 2))
    tries = TRIES if np.all(first <= last) else 0
    while len(places) < count:
        if not tries:
            width, height = np.maximum(last - first, 0.0)
            raise InvalidInput(
                f"{what}: expected room for {count}, {apart:g} m apart, in {width:g} m x {height:g} m; "
                f"found it for {len(places)}"
            )
        place, tries = rng.uniform(first, last), tries - 1
        away = places - place
        if not len(places) or np.linalg.norm(away + to_nearest(away, period), axis=1).min() >= apart:
            places, tries = np.vstack([places, place]), TRIES
    return places


def random_angles(count: int, least: float, rng: np.random.Generator, what: str) -> Array:
    """`count` angles [rad], uniform among those at least `least` [rad] apart on the whole circle.

    Raises:
        InvalidInput: there is no room for so many.
    """
    spare = 2.0 * np.pi - count * least
    if spare < 0.0:
        raise InvalidInput(f"{what}: expected at most {int(2.0 * np.pi / least)}, the circle's room; found {count}")
    gaps = least + spare * np.diff(np.concatenate([[0.0], np.sort(rng.uniform(size=count - 1)), [1.0]]))
    return np.asarray(rng.uniform(0.0, 2.0 * np.pi) + np.concatenate([[0.0], np.cumsum(gaps[:-1])]))


def on_circle(angles: Array, radius: float) -> Array:
    """Places (n, 2) [m] on a circle about the origin."""
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def team(
    starts: npt.ArrayLike, goals: npt.ArrayLike, shape: Disc, limits: Limits, tolerance: float, speed: float = 0.0
) -> tuple[Robot, ...]:
    """Equal robots from `starts` to stop at `goals`, both (n, 2) [m]; at first at `speed` [m/s] towards the goal.

    Raises:
        InvalidInput: two starts or two goals are so near that the robots overlap.
    """
    first, last = np.asarray(starts, dtype=np.float64), np.asarray(goals, dtype=np.float64)
    for what, places in (("starts", first), ("goals", last)):
        refuse_overlap(places, np.full(len(places), shape.radius), what)
    away = last - first
    # 0.0 is added for zeros to have one sign.
    velocities = speed * away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12) + 0.0
    return tuple(
        Robot(shape, limits, State(start, velocity), Goal(Stationary(goal), tolerance, stop=True), f"robot {k:03d}")
        for k, (start, velocity, goal) in enumerate(zip(first, velocities, last))
    )


def refuse_overlap(places: Array, radii: Array, what: str) -> None:
    """Raises InvalidInput if two discs with `radii` (n,) at `places` (n, 2) [m] overlap."""
    for k in range(1, len(places)):
        gaps = np.linalg.norm(places[:k] - places[k], axis=1) - radii[:k] - radii[k]
        if gaps.min() < 0.0:
            raise InvalidInput(
                f"robots: expected {what} that do not overlap, found robots {int(gaps.argmin())} and {k} "
                f"{-gaps.min():g} m deep in each other"
            )
