"""Placement of robots at random or in patterns, without overlap."""

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.sim.scenario import Robot

MAX_TRIES: Final = 10_000
"""[1] Rejected positions in a row after which an area of random positions counts as full. Larger: slower refusals.
Smaller: areas are refused with less than about half their area covered."""


def random_positions(
    count: int,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    min_distance: float,
    rng: np.random.Generator,
    noun: str = "robots",
    inside: Callable[[Array], bool] | None = None,
) -> Array:
    """Draw positions (count, d) [m], uniform in the box from `low` to `high` (d,) [m], or in the part of it `inside`.

    Args:
        min_distance: [m] between any two positions. noun: name of the robots in messages.

    Raises:
        InvalidInput: MAX_TRIES consecutive positions were outside or too close to others, or the box is empty.
    """
    first, last = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    positions = np.empty((0, len(first)))
    tries = MAX_TRIES if np.all(first <= last) else 0
    while len(positions) < count:
        if not tries:
            sides = " x ".join(f"{side:g} m" for side in np.maximum(last - first, 0.0))
            raise InvalidInput(
                f"{noun}: expected space for {count}, {min_distance:g} m apart, in {sides}; "
                f"found space for {len(positions)}"
            )
        candidate, tries = rng.uniform(first, last), tries - 1
        if inside is not None and not inside(candidate):
            continue
        if not len(positions) or np.linalg.norm(positions - candidate, axis=1).min() >= min_distance:
            positions, tries = np.vstack([positions, candidate]), MAX_TRIES
    return positions


def random_angles(count: int, min_angle: float, rng: np.random.Generator, noun: str) -> Array:
    """Draw angles (count,) [rad], uniform among those at least `min_angle` [rad] apart on the circle.

    Raises:
        InvalidInput: the circle has no space for so many.
    """
    free_angle = 2.0 * np.pi - count * min_angle
    if free_angle < 0.0:
        raise InvalidInput(
            f"{noun}: expected at most {int(2.0 * np.pi / min_angle)}, which fill the circle; found {count}"
        )
    gaps = min_angle + free_angle * np.diff(np.concatenate([[0.0], np.sort(rng.uniform(size=count - 1)), [1.0]]))
    return np.asarray(rng.uniform(0.0, 2.0 * np.pi) + np.concatenate([[0.0], np.cumsum(gaps[:-1])]))


def on_circle(angles: Array, radius: float) -> Array:
    """Return positions (n, 2) [m] on a circle about the origin, at `angles` (n,) [rad]."""
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def equal_robots(
    starts: npt.ArrayLike, goals: npt.ArrayLike, shape: Disc, limits: Limits, tolerance: float, speed: float = 0.0
) -> tuple[Robot, ...]:
    """Return equal robots that move from `starts` to `goals`, both (n, 2) [m], and stop there.

    The initial velocity is `speed` [m/s] towards the goal.

    Raises:
        InvalidInput: robots overlap at two starts or two goals.
    """
    first, last = np.asarray(starts, dtype=np.float64), np.asarray(goals, dtype=np.float64)
    for noun, positions in (("starts", first), ("goals", last)):
        refuse_overlap(positions, np.full(len(positions), shape.radius), noun)
    displacements = last - first
    # Adding 0.0 turns -0.0 into 0.0.
    velocities = speed * displacements / np.maximum(np.linalg.norm(displacements, axis=1, keepdims=True), 1e-12) + 0.0
    return tuple(
        Robot(shape, limits, State(start, velocity), Goal(Stationary(goal), tolerance, stop=True), f"robot {k:03d}")
        for k, (start, velocity, goal) in enumerate(zip(first, velocities, last))
    )


def refuse_overlap(positions: Array, radii: Array, noun: str) -> None:
    """Raise InvalidInput if two discs with `radii` (n,) [m] at `positions` (n, 2) [m] overlap."""
    for k in range(1, len(positions)):
        gaps = np.linalg.norm(positions[:k] - positions[k], axis=1) - radii[:k] - radii[k]
        if gaps.min() < 0.0:
            raise InvalidInput(
                f"robots: expected {noun} that do not overlap, found robots {int(gaps.argmin())} and {k} "
                f"overlapping by {-gaps.min():g} m"
            )
