"""How probable a contact is after a decision among obstacles whose forecast has sets."""

from dataclasses import replace
from math import exp
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.forecast.from_models import ERROR_TIMES
from slalom.model.uncertainty import COVERAGES, Covering, Uncertainty
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow

CONTACT_SAMPLES: Final = 41
"""[1] Times at which distances are compared. Fewer: the least distance in between is missed."""

CONTACT_ODDS: Final = (0.033, 4.2)
"""[1] Odds of a contact of a robot that touches a set of 0.5, and the exponent with which they fall with the distance,
as a multiple of max_speed^2 / max_acceleration. Fitted on 22 recordings, each left out in turn in docs/foresight.md."""


class Contact(NamedTuple):
    """The most probable contact of a robot that decides anew in each period."""

    probability: float  # [1]
    seconds: float  # [s] within which, from the decision on
    obstacle: str  # its name, see `Decision.in_the_way`


def contact_of(decision: Any, window: ObstacleWindow) -> Contact | None:
    """The most probable contact within twice the time from rest to the maximum speed; None without sets.

    The least distance of the manoeuvre from a set of 0.5 gives it, see CONTACT_ODDS. Bodies count as round.
    """
    made, sets = decision.inputs, [one for one in window.obstacles if _has_set(one.uncertainty)]
    if not sets:
        return None
    limits, radius = made.navigator.limits, made.navigator.robot.bounding_radius
    seconds = ERROR_TIMES[-1] * limits.max_speed / limits.max_acceleration
    times = np.linspace(0.0, seconds, CONTACT_SAMPLES)
    path = decision.manoeuvre.position(made.now + times)
    left = [_distance(one, path, times, made.now) - radius for one in sets]
    nearest, (begin, power) = int(np.argmin(left)), CONTACT_ODDS
    way = limits.max_speed**2 / limits.max_acceleration
    odds = begin * exp(-power * max(left[nearest] / way, -1.0))
    return Contact(odds / (1.0 + odds), seconds, sets[nearest].name)


def _has_set(error: Uncertainty | None) -> bool:
    return isinstance(error, Covering) and error.sets[0][0] == COVERAGES[0]


def _distance(one: Obstacle, path: Array, times: Array, now: float) -> float:
    """The least distance [m] of a path (n, d) from the set of 0.5 of an obstacle at times (n,) [s] after `now` [s]."""
    error: Any = one.uncertainty
    radii = replace(error, coverage=COVERAGES[0], until=np.inf).radius(times, one.dimension)
    away = np.linalg.norm(path - one.trajectory.position(now + times), axis=1)
    return float((away - radii).min()) - one.shape.bounding_radius
