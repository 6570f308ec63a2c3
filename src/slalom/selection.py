"""The choice: the admissible control nearest to the preferred one that collides with nothing."""

from dataclasses import dataclass
from enum import Enum
from math import sqrt

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.checks import Array, not_negative, vector
from slalom.control_obstacle import ControlObstacle
from slalom.errors import InvalidInput
from slalom.limits import Admissible
from slalom.tolerances import CANDIDATES, ELEMENTS


class Status(Enum):
    """How a choice ended; the value is the sentence for the user."""

    CLEAR = "The preferred control is admissible and collides with nothing."
    CONSTRAINED = "The nearest admissible control that collides with nothing was chosen."
    BLOCKED = "Every admissible control collides within the horizon."
    INADMISSIBLE = "No control obeys the limits in this state."
    OVERLAPPING = "The robot overlaps an obstacle already: every control collides at once."
    UNDECIDED = "The work limit was reached before a safe control or the proof that none exists."


STATUSES = (Status.CONSTRAINED, Status.BLOCKED, Status.INADMISSIBLE, Status.OVERLAPPING, Status.UNDECIDED)
"""By the number that kernels give them."""


@dataclass(frozen=True, eq=False)
class Choice:
    """What `select` found.

    Attributes:
        control: (d,) or None when there is none.
        status: CLEAR or CONSTRAINED with a control, any other without.
        distance: from the preferred control, in units of the control; inf without a control.
        elements, candidates: how much work it was.
    """

    control: Array | None
    status: Status
    distance: float
    elements: int = 0
    candidates: int = 0

    @property
    def safe(self) -> bool:
        """Whether a control was found."""
        return self.control is not None


def select(
    preferred: npt.ArrayLike,
    admissible: Admissible,
    blocked: ControlObstacle,
    *,
    most_elements: int = ELEMENTS,
    most_candidates: int = CANDIDATES,
) -> Choice:
    """The control in `admissible` nearest to `preferred` (d,) with which `blocked` is avoided for all its horizon.

    Laws: a chosen control is admissible (to the relative tolerance ADMISSIBLE) and its clearance to the true
    trajectories is at least 0; no admissible control with a clearance of CONTACT + CERTIFIED or
    more is nearer; the order of obstacles does not matter. BLOCKED means that no admissible control has that
    clearance.

    Raises:
        InvalidInput: different dimensions, or an admissible set that is not bounded by a ball.
    """
    dimension = blocked.dimension
    wanted = np.zeros(3)
    wanted[:dimension] = vector(preferred, "preferred", dimension)
    if admissible.dimension != dimension or not len(admissible.radii):
        raise InvalidInput(
            f"admissible: expected a set of dimension {dimension} bounded by a ball, "
            f"found dimension {admissible.dimension} and {len(admissible.radii)} balls"
        )
    if blocked.overlaps:
        return Choice(None, Status.OVERLAPPING, np.inf)
    code, found, elements, candidates = kernels.nearest_free(
        wanted, dimension, admissible.table, *blocked.table, most_elements, most_candidates
    )
    status = STATUSES[code]
    if status is not Status.CONSTRAINED:
        return Choice(None, status, np.inf, elements, candidates)
    control = found[:dimension].copy()
    control.setflags(write=False)
    distance = sqrt(sum((a - b) ** 2 for a, b in zip(found.tolist(), wanted.tolist())))
    status = Status.CLEAR if candidates == 1 and distance == 0.0 else Status.CONSTRAINED
    return Choice(control, status, distance, elements, candidates)


def select_clearest(
    preferred: npt.ArrayLike, admissible: Admissible, blocked: ControlObstacle, *, enough: float, accuracy: float = 1e-3
) -> tuple[Choice, float]:
    """The control with the largest clearance up to `enough` [m]; among these, the nearest to `preferred`.

    The same choice with growing margins: bisection on the margin down to `accuracy` [m].

    Returns:
        The choice and the margin [m] that it keeps beyond that of `blocked`: within `accuracy` of the largest one.
    """

    def with_margin(extra: float) -> Choice:
        grown = ControlObstacle(
            blocked.response, blocked.state, blocked.traffic, blocked.robot, blocked.margin + extra, blocked.horizon
        )
        return select(preferred, admissible, grown)

    low, high = 0.0, not_negative(enough, "enough")
    best = with_margin(high)
    if best.safe or high == 0.0:
        return best, high
    best = with_margin(0.0)
    if not best.safe:
        return best, 0.0
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        trial = with_margin(middle)
        if trial.safe:
            best, low = trial, middle
        else:
            high = middle
    return best, low
