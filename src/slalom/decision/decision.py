"""Decisions and their outcomes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property, partial
from logging import DEBUG, getLogger
from math import dist
from pathlib import Path as FilePath
from typing import Any, Final, NamedTuple, Protocol, runtime_checkable

import numpy as np

from slalom.base.checks import STATE, Array, has, not_before, not_negative, number
from slalom.base.errors import InvalidInput
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision.contact import Contact, contact_of
from slalom.decision.settings import Settings
from slalom.decision.stages import Stage, stages_of
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre, state_after
from slalom.model.path import Path
from slalom.model.path_goal import PathGoal
from slalom.model.response import Velocity
from slalom.model.shape import refuse_turned
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import ObstacleWindow


class Approach(NamedTuple):
    """The last progress of a robot towards its goal."""

    distance: float  # [m] that was left, without the tolerance of the goal
    since: float  # [s] absolute time
    target: Array  # (d,) [m] position of the goal then
    pace: float  # [m] the least distance left so far, plus what a robot drives that is not held up, see HELD_UP
    paced: float  # [s] absolute time of that


class Commitment(NamedTuple):
    """The part of the previous decision on which a decision depends, see `Decision`."""

    manoeuvre: Manoeuvre
    path: Path | None
    progress: float | None
    approach: Approach | None

    @property
    def decision(self) -> "Decision":
        """A decision with this commitment."""
        control = self.manoeuvre.control
        return Decision(
            self.manoeuvre, Outcome.KEPT, control, not_kept, self.path, self.progress, approach=self.approach
        )


class DecisionInputs(NamedTuple):
    """All inputs of a decision, see `Navigator.decide`."""

    navigator: Settings
    state: State
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks]
    goal: Goal | None
    robots: Tracks | None
    now: float
    budget: float | None
    previous: Commitment | None

    def repeat(self) -> "Decision":
        """The decision, made again."""
        navigator: Any = self.navigator
        return navigator.decide(  # type: ignore[no-any-return]
            self.state,
            self.obstacles,
            self.goal,
            robots=self.robots,
            now=self.now,
            previous=None if self.previous is None else self.previous.decision,
            budget=self.budget,
        )


@runtime_checkable
class Record(Protocol):
    """All inputs of a decision: what a file of it holds. Objects in it are what `slalom.decision.document` can write.

    Law: `repeat` makes the decision again, to the bit.
    """

    @property
    def navigator(self) -> Any:
        """What decided."""

    @property
    def goal(self) -> Goal | None:
        """The goal of the decision."""

    def repeat(self) -> "Decision":
        """The decision, made again."""


# Reports of a decision: the expected collision, the obstacles in the way, a line for a log, a dictionary.


LOGGER = getLogger("slalom")
"""Each decision is one line at level DEBUG."""


class Collision(NamedTuple):
    """A predicted collision."""

    time: float  # [s] absolute
    position: Array  # (d,) [m] of the robot
    obstacle: str  # its name, see `Decision.in_the_way`


def collision_of(decision: "Decision") -> Collision | None:
    """The first collision of the manoeuvre of a decision, from the present state on; None if none is predicted."""
    made = decision.inputs
    if made is None:
        return None
    window, motion = _window(made), decision.manoeuvre.continuation(made.state, made.now)
    blocked = ControlObstacle(motion, made.state, window, made.navigator.robot)
    control = np.zeros(made.state.dimension)
    times = blocked.times_to_collision(control)
    times[blocked.overlapping] = 0.0
    first = int(np.argmin(times)) if len(times) else 0
    if not len(times) or not np.isfinite(times[first]):
        return None
    elapsed = float(times[first])
    place = motion.position(made.state, elapsed)(control)
    return Collision(made.now + elapsed, place, window.obstacles[first].name)


def names_in_the_way(decision: "Decision") -> tuple[str, ...]:
    """Names of the obstacles that a robot meets which drives straight to its goal, in the order of time.

    It drives at its maximum speed, up to the horizon; on a path to the point ahead. Empty without a goal.
    """
    made = decision.inputs
    if made is None or made.goal is None:
        return ()
    navigator = made.navigator
    state = made.state
    goal = made.goal
    speed, target = navigator.limits.max_speed, goal.position(made.now)
    if isinstance(goal, PathGoal) and decision.progress is not None:
        target = goal.point(min(decision.progress + goal.lookahead * speed, goal.length))
    way = target - state.position
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return ()
    window, velocity = _window(made), way * (speed / length)
    horizon = min(window.horizon, length / speed)
    straight = State(state.position, velocity)
    blocked = ControlObstacle(Velocity(), straight, window, navigator.robot, navigator.margin, horizon)
    times = blocked.times_to_collision(velocity)
    times[blocked.overlapping] = 0.0
    return tuple(window.obstacles[k].name for k in np.argsort(times, kind="stable") if np.isfinite(times[k]))


def _window(made: "DecisionInputs") -> ObstacleWindow:
    """The predicted obstacles and other robots, each with a name."""
    robots = [] if made.robots is None else [made.robots.with_forecast(made.navigator.method.robot_forecast)]
    return made.navigator.predict([*_named(made.obstacles), *robots], made.state, made.now)


def _named(obstacles: Sequence[Obstacle | ObstacleTable | Tracks]) -> list[Obstacle | ObstacleTable | Tracks]:
    """The obstacles, those without a name named by their place."""
    found: list[Obstacle | ObstacleTable | Tracks] = []
    for k, one in enumerate(obstacles):
        if isinstance(one, Obstacle):
            found.append(one if one.name else replace(one, name=f"obstacles[{k}]"))
        elif isinstance(one, ObstacleTable):
            found += [o if o.name else replace(o, name=f"obstacles[{k}][{j}]") for j, o in enumerate(one)]
        else:
            found.append(one)
    return found


def as_dict(decision: "Decision") -> dict[str, Any]:
    """The decision as values of JSON, see `Decision.as_dict`."""
    made = decision.inputs
    manoeuvre = decision.manoeuvre
    hit = decision.collision
    now = decision.decided_at if made is None else made.now
    result: dict[str, Any] = {
        "time": now,
        "outcome": decision.outcome.name,
        "sentence": decision.outcome.value,
        "safe": decision.safe,
        "probability": decision.probability,
        "contact": None if decision.contact is None else decision.contact._asdict(),
        "response": repr(manoeuvre.response),
        "control": manoeuvre.control.tolist(),
        "preferred": np.asarray(decision.preferred).tolist(),
        "progress": decision.progress,
        "work": decision.work,
        "cut": decision.cut,
        "stalled": decision.stalled,
        "stuck": decision.stuck,
        "in_the_way": list(decision.in_the_way),
        "collision": None,
    }
    if made is not None:
        result["acceleration"] = manoeuvre.mean_acceleration(now, made.navigator.period).tolist()
    if hit is not None:
        result["collision"] = {"time": hit.time, "position": hit.position.tolist(), "obstacle": hit.obstacle}
    return result


def log(decision: "Decision") -> None:
    """Write one line about a decision to the logger `slalom` at level DEBUG, from values that are already computed."""
    if LOGGER.isEnabledFor(DEBUG):
        made, manoeuvre = decision.inputs, decision.manoeuvre
        LOGGER.debug(
            "decision at %g s: %s, %r %s, work %.2g s, stalled %.3g s",
            decision.decided_at if made is None else made.now,
            decision.outcome.name,
            manoeuvre.response,
            np.round(manoeuvre.control, 6).tolist(),
            decision.work,
            decision.stalled,
        )


# The progress of a robot towards its goal, by which it is found to be stuck.


APPROACH_TIME: Final = 0.1
"""[s] A robot has made progress when it is nearer to its goal by what it drives in this time at its largest speed.
Larger: slow robots count as stuck. Smaller: a robot that swings behind an obstacle may count as one that gets on."""


HELD_UP: Final = 0.6
"""[1] A robot that comes nearer to its goal at less than this share of its largest speed is held up. Larger: more
choices while it lets others pass. Smaller: it follows others that are slower."""


def approach_of(
    goal: Goal | None,
    state: State,
    progress: float | None,
    max_speed: float,
    now: float,
    last: Approach | None,
    further: float = 0.0,
) -> Approach | None:
    """The last progress of a robot in `state`: `last`, or a new one `now` [s]; None without a goal.

    A new one is noted in three cases. The robot is at the goal, or the goal has moved by more than its tolerance. Or
    the distance to the goal, on a path along it, is less than at the last one by APPROACH_TIME times `max_speed` [m/s].

    Args:
        progress: [m] along the path of a `PathGoal`. further: [m] that is left in addition, such as to turn.
    """
    if goal is None:
        return None
    # Lists take a quarter of the time of arrays of two numbers.
    trajectory = goal.trajectory
    target = trajectory.initial_position if isinstance(trajectory, Stationary) else goal.position(now)
    place = target.tolist()
    left = dist(place, state.position.tolist())
    if progress is not None and isinstance(goal, PathGoal):
        left = max(left, goal.length - progress)
    left = max(left - goal.tolerance, 0.0) + further
    pace = left + HELD_UP * max_speed * now
    if last is None or left == 0.0 or dist(place, last.target.tolist()) > goal.tolerance:
        return Approach(left, now, target, pace, now)
    pace, paced = (pace, now) if pace <= last.pace else (last.pace, last.paced)
    if left <= last.distance - APPROACH_TIME * max_speed:
        return Approach(left, now, target, pace, paced)
    return last if paced == last.paced else last._replace(pace=pace, paced=paced)


class Approaches:
    """The last progress of n robots towards their goals, as arrays: the same rule as `approach_of`."""

    def __init__(self, n: int, d: int) -> None:
        self._distance = np.full(n, np.nan)
        self._since = np.zeros(n)
        self._target = np.full((n, d), np.nan)

    def stalled(self, left: Array, targets: Array, tolerances: Array, speeds: Array, now: float) -> Array:
        """Time [s] since each robot last came nearer to its goal: (n,).

        Args:
            left: (n,) [m] to the goal, without its tolerance; nan for a robot without a goal or that is not present.
            targets: (n, d) [m] positions of the goals. tolerances: (n,) [m]. speeds: (n,) [m/s] largest ones.
        """
        same = np.linalg.norm(targets - self._target, axis=1) <= tolerances
        keeps = (left > 0.0) & (left > self._distance - APPROACH_TIME * speeds) & same
        self._distance, self._since = np.where(keeps, self._distance, left), np.where(keeps, self._since, now)
        self._target = np.where(keeps[:, None], self._target, targets)
        return now - self._since


class Outcome(Enum):
    """Kind of a decision; the value is the sentence for the user. Ordered from best to worst."""

    CLEAR = "The preferred control is collision-free."
    CONSTRAINED = "The nearest safe control to the preferred one was chosen."
    KEPT = "The committed manoeuvre is safe and no alternative improves the arrival time enough to change it."
    CONTINUED = "No new safe manoeuvre exists; the committed one continues and is safe."
    INTERRUPTED = "The budget ended the search; the committed manoeuvre continues and is safe."
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
    *(Outcome.INTERRUPTED, Outcome.BEGUN, Outcome.SQUEEZED),
)


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
        begun: the earlier decision that began the manoeuvre; None: this one did.
        record: what a file holds of a decision that its `inputs` alone do not repeat; None: the inputs.
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
    begun: "Decision | None" = None
    record: Record | None = None

    def __repr__(self) -> str:
        control = ", ".join(f"{x:.4g}" for x in self.manoeuvre.control)
        kind = self.manoeuvre.response
        name = type(self).__name__
        at = self.decided_at
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
    def contact(self) -> Contact | None:
        """The most probable contact, see `slalom.decision.contact`; None without obstacles whose forecast has sets."""
        return None if self.inputs is None else contact_of(self, _window(self.inputs))

    @cached_property
    def collision(self) -> Collision | None:
        """The first predicted collision of the manoeuvre; None for a safe decision, or if none is predicted."""
        return None if self.safe else collision_of(self)

    def as_dict(self) -> dict[str, Any]:
        """The decision as texts, finite numbers and lists, for JSON."""
        return as_dict(self)

    def dump(self, file: FilePath | str) -> None:
        """Write all inputs of the decision to a JSON file of any name; `slalom explain FILE` repeats it.

        Raises:
            InvalidInput: parts that no file can hold, such as a trajectory or objective that is a Python function.
            InvalidFile: a file that cannot be written.
        """
        from slalom.decision.document import dump

        dump(self, FilePath(file))

    def stages(self) -> dict[str, Stage]:
        """Calls of each stage and the time [s] in it when the decision is made again, with all tables at hand.

        Stages within compiled kernels are a part of `policy`; with NUMBA_DISABLE_JIT=1 they count apart.

        Raises:
            InvalidInput: a decision that no navigator made.
        """
        from slalom.decision.document import record_of

        again = record_of(self).repeat
        again()
        return stages_of(again)

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


def state_to_decide_from(state: State, previous: Decision | None, now: float, delay: float, own: Settings) -> State:
    """The state at `now` [s] of a robot that was in `state` before a delay [s], see `Navigator.decide`.

    Raises:
        InvalidInput: something else than a state or a decision; a state with a heading for a shape that would turn by
            it; a time before that of the previous decision, or the same for a robot at another position; a delay above
            the horizon.
    """
    if type(state) is not State:
        has(state, *STATE, "state")
    refuse_turned(own.robot, state.heading, "state: heading")
    number(now, "now")
    if previous is not None:
        if type(previous) is not Decision:
            has(previous, ("manoeuvre", "commitment", "decided_at"), "a Decision", "previous")
        if previous.manoeuvre.state.dimension != state.dimension:
            expected = f"dimension {previous.manoeuvre.dimension} as of the previous decision"
            raise InvalidInput(f"state: expected {expected}, found {state.dimension}")
        last = previous.inputs
        if last is None or now < last.now:
            not_before(now, previous.decided_at, "now", "a decision")
        if last is not None and now == last.now and delay == 0.0 and (state.position != last.state.position).any():
            # A loop that does not pass the time predicts all obstacles from their positions at the start.
            raise InvalidInput(
                f"now: expected a time after the previous decision at {now:g} s, found the same for another position"
            )
    if isinstance(delay, float) and delay == 0.0:
        return state
    if not_negative(delay, "delay") > own.horizon:
        raise InvalidInput(f"delay: expected at most the horizon, {own.horizon:g} s, found {delay:g} s")
    return state_after((), state, now - delay, now) if previous is None else previous.state_at(now, state, now - delay)


def on_way_to(previous: Decision | None, goal: Goal | None) -> Decision | None:
    """The previous decision of a robot with this goal: without a progress if that was along another path."""
    if previous is None or previous.progress is None or previous.inputs is None:
        return previous
    same = isinstance(goal, PathGoal) and goal.is_way_of(previous.inputs.goal)
    return previous if same else _with(previous, progress=None)


def completed(
    decision: Decision, inputs: DecisionInputs, previous: Decision | None, progress: float | None, limit: float
) -> Decision:
    """The decision with its inputs and with the values that the next one needs; write its line of the log.

    progress: [m] along a path. limit: [s] of work.
    """
    before = None if previous is None else previous.commitment
    limits = inputs.navigator.limits
    now = inputs.now
    last = None if before is None else before.approach
    kept = previous is not None and previous.manoeuvre is decision.manoeuvre
    found = _with(
        decision,
        earlier=decision.manoeuvres_before(previous, now - inputs.navigator.horizon),
        progress=progress,
        cut=decision.cut or decision.work >= limit,
        approach=approach_of(inputs.goal, inputs.state, progress, limits.max_speed, now, last),
        inputs=inputs._replace(previous=before),
        begun=(previous.begun or previous) if kept and previous is not None else None,
    )
    log(found)
    return found


def _with(decision: Decision, **attributes: Any) -> Decision:
    """The same decision with other attributes; `dataclasses.replace` takes six times as long."""
    other = object.__new__(type(decision))
    other.__dict__.update(decision.__dict__, **attributes)
    return other


def not_kept() -> ControlObstacle:
    """The control obstacle of a decision that is known from its commitment or its file. Raises InvalidInput."""
    raise InvalidInput("blocked: expected a decision that was made, found one read from a file")


def made(blocked: ControlObstacle) -> Callable[[], ControlObstacle]:
    """Function for `Decision.control_obstacle` that returns a control obstacle that exists already."""
    return partial(_itself, blocked)


def _itself(blocked: ControlObstacle) -> ControlObstacle:
    return blocked
