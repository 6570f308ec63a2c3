"""Robots near enough to count in a picture of the control space: the others cannot be met by a drawn control."""

from typing import Any

import numpy as np

from slalom.limits import Admissible, Limits
from slalom.live.others import Other
from slalom.response import Response
from slalom.state import State
from slalom.tolerances import VIEW_PREDICTED, VIEW_SAMPLES
from slalom.view.kinds import kind


def half_side(response: Any, limits: Limits, admissible: Admissible) -> float:
    """Return half of the side of the drawn square around 0, in the unit of the control."""
    known = {"acceleration": 1.25 * limits.max_acceleration, "velocity": 1.12 * limits.max_speed}
    return known.get(kind(response).name, 1.12 * admissible.largest)


def reach(response: Response, state: State, limits: Limits, horizon: float, largest: float) -> float:
    """Return a bound [m] of how far a robot moves within the horizon [s] under controls of this size, or committed."""
    times = np.linspace(0.0, horizon, VIEW_SAMPLES)
    image = response.position(state, times)
    drift = float(np.linalg.norm(image.drift - state.position, axis=1).max())
    between = limits.max_speed * horizon / (VIEW_SAMPLES - 1)
    return max(drift + float(np.abs(image.gain).max()) * largest, limits.max_speed * horizon) + between


def near(others: tuple[Other, ...], state: State, radius: float, own: float, now: float) -> tuple[Other, ...]:
    """Return those others whose predicted motion can come into contact with a robot that moves at most `own` [m].

    All of them where there are few: their predicted paths are drawn as well.
    """
    if len(others) <= VIEW_PREDICTED:
        return others
    kept = []
    for other in others:
        if np.isfinite(other.reach):
            away = float(np.linalg.norm(other.obstacle.trajectory.position(now) - state.position))
            if away > own + other.reach + radius + other.obstacle.shape.bounding_radius + other.margin:
                continue
        kept.append(other)
    return tuple(kept)
