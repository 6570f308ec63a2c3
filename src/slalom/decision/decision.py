"""Decisions and their outcomes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, NamedTuple

from slalom.checks import STATE, Array, has, not_before, not_negative, number
from slalom.control_obstacle import ControlObstacle
from slalom.decision.approach import Approach, approach_of
from slalom.decision.report import Collision, as_dict, collision_of, log, names_in_the_way
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.manoeuvre import Manoeuvre, state_after
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.path import Path
from slalom.state import State

if TYPE_CHECKING:
    from slalom.decision.navigator import Navigator


class Outcome(Enum):
    """Kind of a decision; the value is the sentence for the user. Ordered from best to worst."""

    CLEAR = "The preferred control is collision-free."
    CONSTRAINED = "The nearest safe control to the preferred one was chosen."
    KEPT = "The committed manoeuvre is safe and no alternative improves the arrival time enough to change it."
    CONTINUED = "No new safe manoeuvre exists; the committed one continues and is safe."
    INTERRUPTED = "The budget ended the search; the committed manoeuvre continues and is safe."
    WAITING = "Waiting for messages before changing the manoeuvre; the committed one continues and is safe."
    BEGUN = "No sequence to the goal is known yet; a safe partial sequence that ends at rest was started."
    SQUEEZED = "No manoeuvre keeps the margin; one with a clearance above 0 was chosen."
    LIKELY = "All likely futures of the obstacles are avoided; less likely ones were given up, see the probability."
    DEVIATING = "A short deviation has a lower expected loss than every plan; nothing is promised after it."
    STOPPING = "No manoeuvre is collision-free up to the horizon; this one ends at rest before any contact."
    DELAYED = "Every manoeuvre is predicted to collide; the one with the latest collision was chosen."
    BRAKING = "No manoeuvre ends at rest before a contact; the robot brakes as hard as the limits allow."
    IMPACT = "A collision within this control period is inevitable; the impact speed was minimised."
    INADMISSIBLE = "No control obeys all limits in this state; a compromise between them was chosen."
    ESCAPING = "The robot overlaps an obstacle; it leaves, and gets no deeper into any where possible."

    @property
    def safe(self) -> bool:
        """Whether the robot stays collision-free up to the horizon as long as the forecasts hold."""
        return self in SAFE


SAFE = (
    *(Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED),
    *(Outcome.INTERRUPTED, Outcome.WAITING, Outcome.BEGUN, Outcome.SQUEEZED),
)


class Commitment(NamedTuple):
    """The part of the previous decision on which a decision depends, see `Decision`."""

    manoeuvre: Manoeuvre
    path: Path | None
    progress: float | None
    approach: Approach | None


class DecisionInputs(NamedTuple):
    """All inputs of a decision, see `Navigator.decide`."""

    navigator: "Navigator"
    state: State
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks]
    goal: Goal | None
    robots: Tracks | None
    now: float
    budget: float | None
    previous: Commitment | None
    searched: bool = False  # whether a search over sequences made the decision: the navigator alone does not repeat it


@dataclass(frozen=True, eq=False, repr=False)
class Decision:
    """Manoeuvre that the robot commits to, and its outcome.

    Attributes:
        manoeuvre: the committed future path; apply `manoeuvre.mean_acceleration(now, period)`.
        outcome: kind of the result.
        preferred: the control (d,) that the objective prefers for the manoeuvre's response.
        control_obstacle: makes `blocked`.
        path: the manoeuvre as pieces from where the robot was at its last decision; None: as it was planned.
        progress: [m] along the path of a `PathGoal`; None for other goals.
        work: [s] counted for the decision, see `Navigator.decide`; 0 for objectives written in Python.
        cut: whether the budget ended the search: a better manoeuvre may exist.
        approach: the last progress towards the goal; None for an objective that needs no goal.
        inputs: the inputs of the decision; None for one that no navigator made.
        given_up: [1] sum of the probabilities of the futures of obstacles that the manoeuvre does not avoid.
        earlier: the manoeuvres that the robot was committed to before, for a horizon back.
    """

    manoeuvre: Manoeuvre
    outcome: Outcome
    preferred: Array
    control_obstacle: Callable[[], ControlObstacle]
    path: Path | None = None
    progress: float | None = None
    earlier: tuple[Manoeuvre, ...] = ()
    work: float = 0.0
    cut: bool = False
    approach: Approach | None = None
    inputs: DecisionInputs | None = None
    given_up: float = 0.0

    def __repr__(self) -> str:
        control = ", ".join(f"{x:.4g}" for x in self.manoeuvre.control)
        kind, name, at = self.manoeuvre.response, type(self).__name__, self.decided_at
        return f"<{name} {self.outcome.name} at {at:g} s, {kind!r} with ({control})>"

    @property
    def safe(self) -> bool:
        """Whether the robot stays collision-free up to the horizon as long as the forecasts hold."""
        return self.outcome.safe

    @property
    def probability(self) -> float:
        """Lower bound [1] of the probability that the decision is safe, given those of the futures of the obstacles.

        1 for a safe decision, 0 for one that is predicted to collide.
        """
        return 1.0 - self.given_up if self.outcome is Outcome.LIKELY else float(self.safe)

    @property
    def stalled(self) -> float:
        """Time [s] since the robot last came nearer to its goal; 0 at the goal, and without a goal.

        It begins anew when the goal moves by more than its tolerance.
        """
        return 0.0 if self.approach is None or self.inputs is None else self.inputs.now - self.approach.since

    @property
    def stuck(self) -> bool:
        """Whether `stalled` has reached `Navigator.stuck_after`: it needs another goal or path."""
        return self.inputs is not None and self.stalled >= self.inputs.navigator.stuck_after

    @cached_property
    def in_the_way(self) -> tuple[str, ...]:
        """Names of the obstacles on the straight way to the goal within the horizon, the first one first.

        An obstacle without a name is named as it was passed: obstacles[2], or obstacles[0][7] in a table.
        """
        return names_in_the_way(self)

    @cached_property
    def collision(self) -> Collision | None:
        """The first predicted collision of the manoeuvre; None for a safe decision, or if none is predicted."""
        return None if self.safe else collision_of(self)

    def as_dict(self) -> dict[str, Any]:
        """The decision as texts, finite numbers and lists, for JSON."""
        return as_dict(self)

    def dump(self, file: FilePath | str) -> None:
        """Write all inputs of the decision to a JSON file; `slalom decide FILE` repeats it.

        Raises:
            InvalidInput: parts that no file can hold, such as a trajectory or objective that is a Python function; a
                decision that continues a search.
            InvalidFile: a file that cannot be written.
        """
        from slalom.decision.dump import dump

        dump(self, FilePath(file))

    @property
    def commitment(self) -> Commitment:
        """The part of the decision on which the next one depends."""
        return Commitment(self.manoeuvre, self.path, self.progress, self.approach)

    @property
    def decided_at(self) -> float:
        """Absolute time [s] of the decision, or before it where a kept manoeuvre has no path."""
        if self.inputs is not None:
            return self.inputs.now
        return self.manoeuvre.start if self.path is None else float(self.path.times[0])

    def state_at(self, now: float, state: State, measured: float) -> State:
        """The state at `now` [s] of the robot that was in `state` when it was `measured` [s], see `state_after`."""
        return state_after((*self.earlier, self.manoeuvre), state, measured, now)

    def manoeuvres_before(self, previous: "Decision | None", oldest: float) -> tuple[Manoeuvre, ...]:
        """The manoeuvres to which the robot was committed before, since `oldest` [s]: for `earlier`."""
        if previous is None:
            return ()
        changed = previous.manoeuvre is not self.manoeuvre
        before = (*previous.earlier, previous.manoeuvre) if changed else previous.earlier
        next_ones, first = (*before[1:], self.manoeuvre), 0
        while first < len(before) and next_ones[first].start <= oldest:
            first += 1
        return before[first:]

    @cached_property
    def blocked(self) -> ControlObstacle:
        """The control obstacle of the manoeuvre's response, for figures and queries; computed on demand."""
        return self.control_obstacle()


def state_to_decide_from(state: State, previous: Decision | None, now: float, delay: float, longest: float) -> State:
    """The state at `now` [s] of a robot that was in `state` before a delay [s], see `Navigator.decide`.

    Raises:
        InvalidInput: something else than a state or a decision; a time before that of the previous decision, or the
            same for a robot at another position; a delay above the `longest` [s].
    """
    has(state, *STATE, "state")
    number(now, "now")
    if previous is not None:
        has(previous, ("manoeuvre", "commitment", "decided_at"), "a Decision", "previous")
        if previous.manoeuvre.dimension != state.dimension:
            expected = f"dimension {previous.manoeuvre.dimension} as of the previous decision"
            raise InvalidInput(f"state: expected {expected}, found {state.dimension}")
        not_before(now, previous.decided_at, "now", "a decision")
        last = previous.inputs
        if last is not None and now == last.now and delay == 0.0 and (state.position != last.state.position).any():
            # A loop that does not pass the time predicts all obstacles from their positions at the start.
            raise InvalidInput(
                f"now: expected a time after the previous decision at {now:g} s, found the same for another position"
            )
    if not_negative(delay, "delay") > longest:
        raise InvalidInput(f"delay: expected at most the horizon, {longest:g} s, found {delay:g} s")
    if delay == 0.0:
        return state
    return state_after((), state, now - delay, now) if previous is None else previous.state_at(now, state, now - delay)


def completed(
    decision: Decision, inputs: DecisionInputs, previous: Decision | None, progress: float | None, limit: float
) -> Decision:
    """The decision with its inputs and with the values that the next one needs; write its line of the log.

    progress: [m] along a path. limit: [s] of work.
    """
    before, limits, now = None if previous is None else previous.commitment, inputs.navigator.limits, inputs.now
    last = None if before is None else before.approach
    found = _with(
        decision,
        earlier=decision.manoeuvres_before(previous, now - inputs.navigator.horizon),
        progress=progress,
        cut=decision.cut or decision.work >= limit,
        approach=approach_of(inputs.goal, inputs.state, progress, limits.max_speed, now, last),
        inputs=inputs._replace(previous=before),
    )
    log(found)
    return found


def _with(decision: Decision, **attributes: Any) -> Decision:
    """The same decision with other attributes; `dataclasses.replace` takes six times as long."""
    other = object.__new__(type(decision))
    other.__dict__.update(decision.__dict__, **attributes)
    return other


def made(blocked: ControlObstacle) -> Callable[[], ControlObstacle]:
    """Function for `Decision.control_obstacle` that returns a control obstacle that exists already."""
    return partial(_itself, blocked)


def _itself(blocked: ControlObstacle) -> ControlObstacle:
    return blocked
