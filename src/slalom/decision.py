"""What a decision is: a manoeuvre, how it came about, and what it answers."""

from dataclasses import dataclass
from enum import Enum

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.manoeuvre import Manoeuvre


class Outcome(Enum):
    """What a decision is; the value is the sentence for the user. Ordered from best to worst."""

    CLEAR = "The preferred control collides with nothing."
    CONSTRAINED = "The nearest safe control to the preferred one was chosen."
    KEPT = "The committed manoeuvre is safe and no new one promises enough to change it."
    CONTINUED = "No new safe manoeuvre exists; the committed one is continued and still safe."
    WAITING = "Not before it has heard of others may the robot change its manoeuvre; it goes on, and that is safe."
    BEGUN = "No sequence that arrives is known yet; one that is promising is begun, and ends at rest, clear of all."
    SQUEEZED = "No manoeuvre keeps the margin; this one keeps a clearance above 0."
    DELAYED = "Every manoeuvre collides as predicted; the one that collides last was chosen."
    IMPACT = "A collision within this control period is inevitable; the impact speed was made least."
    INADMISSIBLE = "No control obeys the limits in this state; a compromise between them was made."
    ESCAPING = "The robot overlaps an obstacle; it moves apart as fast as it can."

    @property
    def safe(self) -> bool:
        """Whether nothing is hit as long as the forecasts hold, up to the horizon."""
        return self in SAFE


SAFE = (
    *(Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED),
    *(Outcome.WAITING, Outcome.BEGUN, Outcome.SQUEEZED),
)


@dataclass(frozen=True, eq=False)
class Decision:
    """What the robot does next.

    Attributes:
        manoeuvre: the committed future path; apply `manoeuvre.mean_acceleration(now, period)`.
        outcome: how it came about.
        preferred: the control (d,) that the objective asked of the manoeuvre's response.
        blocked: the control obstacle of that response, for pictures and questions; not asked, not computed.
        regret: [s] of predicted arrival that keeping the manoeuvre has lost since it was chosen, or less: what was
            promised instead counts, which others in the way may not have let it have.
    """

    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    blocked: ControlObstacle
    regret: float = 0.0
