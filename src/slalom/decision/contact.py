"""How probable a contact is after a decision among obstacles whose errors have sets, see `set_of`."""

from math import exp
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.forecast.from_models import ERROR_TIMES
from slalom.model.uncertainty import COVERAGES, Uncertainty, set_of
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
    made, half = decision.inputs, COVERAGES[0]
    sets = [(one, error) for one in window.obstacles if (error := set_of(one.uncertainty, half)) is not None]
    if not sets:
        return None
    limits, radius = made.navigator.limits, made.navigator.robot.bounding_radius
    seconds = ERROR_TIMES[-1] * limits.max_speed / limits.max_acceleration
    times = np.linspace(0.0, seconds, CONTACT_SAMPLES)
    path = decision.manoeuvre.position(made.now + times)
    left = [_distance(one, error, path, times, made.now) - radius for one, error in sets]
    nearest, (begin, power) = int(np.argmin(left)), CONTACT_ODDS
    way = limits.max_speed**2 / limits.max_acceleration
    odds = begin * exp(-power * max(left[nearest] / way, -1.0))
    return Contact(odds / (1.0 + odds), seconds, sets[nearest][0].name)


def _distance(one: Obstacle, error: Uncertainty, path: Array, times: Array, now: float) -> float:
    """The least distance [m] of a path (n, d) from an obstacle with an error at times (n,) [s] after `now` [s]."""
    away = np.linalg.norm(path - one.trajectory.position(now + times), axis=1)
    return float((away - error.radius(times, one.dimension)).min()) - one.shape.bounding_radius
