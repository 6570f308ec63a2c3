"""Decisions and their outcomes."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property, partial

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.manoeuvre import Manoeuvre, state_after
from slalom.path import Path
from slalom.state import State


class Outcome(Enum):
    """Kind of a decision; the value is the sentence for the user. Ordered from best to worst."""

    CLEAR = "The preferred control is collision-free."
    CONSTRAINED = "The nearest safe control to the preferred one was chosen."
    KEPT = "The committed manoeuvre is safe and no alternative improves the arrival time enough to change it."
    CONTINUED = "No new safe manoeuvre exists; the committed one continues and is safe."
    WAITING = "Waiting for messages before changing the manoeuvre; the committed one continues and is safe."
    BEGUN = "No sequence to the goal is known yet; a safe partial sequence that ends at rest was started."
    SQUEEZED = "No manoeuvre keeps the margin; one with a clearance above 0 was chosen."
    DELAYED = "Every manoeuvre is predicted to collide; the one with the latest collision was chosen."
    IMPACT = "A collision within this control period is inevitable; the impact speed was minimised."
    INADMISSIBLE = "No control obeys all limits in this state; a compromise between them was chosen."
    ESCAPING = "The robot overlaps an obstacle; it separates as fast as the limits allow."

    @property
    def safe(self) -> bool:
        """Whether the robot stays collision-free up to the horizon as long as the forecasts hold."""
        return self in SAFE


SAFE = (
    *(Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED),
    *(Outcome.WAITING, Outcome.BEGUN, Outcome.SQUEEZED),
)


@dataclass(frozen=True, eq=False)
class Decision:
    """Manoeuvre that the robot commits to, and its outcome.

    Attributes:
        manoeuvre: the committed future path; apply `manoeuvre.mean_acceleration(now, period)`.
        outcome: how the manoeuvre was chosen.
        preferred: the control (d,) that the objective prefers for the manoeuvre's response.
        control_obstacle: makes `blocked`.
        regret: upper bound [s] on the arrival time lost by keeping the manoeuvre; alternatives count at their
            optimistic cost.
        path: the manoeuvre as pieces from where the robot was at its last decision; None: as it was planned.
        progress: [m] along the path of a `PathGoal`; None for other goals.
        earlier: the manoeuvres that the robot was committed to before, for a horizon back.
    """

    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    control_obstacle: Callable[[], ControlObstacle]
    regret: float = 0.0
    path: Path | None = None
    progress: float | None = None
    earlier: tuple[Manoeuvre, ...] = ()

    @property
    def decided_at(self) -> float:
        """Absolute time [s] of the decision, or before it where a kept manoeuvre has no path."""
        return self.manoeuvre.start if self.path is None else float(self.path.times[0])

    def state_at(self, now: float, state: State, measured: float) -> State:
        """The state at `now` [s] of the robot that was in `state` when it was `measured` [s], see `state_after`."""
        return state_after((*self.earlier, self.manoeuvre), state, measured, now)

    def following(self, previous: "Decision | None", oldest: float) -> "Decision":
        """The same decision, with the manoeuvres before it since `oldest` [s]."""
        if previous is None:
            return self
        changed = previous.manoeuvre is not self.manoeuvre
        before = (*previous.earlier, previous.manoeuvre) if changed else previous.earlier
        ends = [manoeuvre.start for manoeuvre in (*before[1:], self.manoeuvre)]
        return replace(self, earlier=tuple(one for one, end in zip(before, ends) if end > oldest))

    @cached_property
    def blocked(self) -> ControlObstacle:
        """The control obstacle of the manoeuvre's response, for figures and queries; computed on demand."""
        return self.control_obstacle()


def made(blocked: ControlObstacle) -> Callable[[], ControlObstacle]:
    """What `Decision.control_obstacle` is where the control obstacle is at hand."""
    return partial(_itself, blocked)


def _itself(blocked: ControlObstacle) -> ControlObstacle:
    return blocked
