"""The loop around a navigator: states, detections, walls and goals in, a command with its status out."""

from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from math import atan2, ceil, dist, pi
from typing import Any, Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import (
    GOAL,
    STATE,
    Array,
    Positive,
    check_fields,
    has,
    listing,
    not_negative,
    number,
    or_infinite,
    positive,
    vector,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import TIME
from slalom.decision import Decision
from slalom.decision.decision import Approach
from slalom.decision.navigator import Navigator
from slalom.decision.objective import FollowVelocity
from slalom.model.goal import Goal
from slalom.model.limits import least_speed
from slalom.model.path_goal import PathGoal
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, listed
from slalom.perception.tracker import Tracker
from slalom.vehicle.decision import VehicleDecision
from slalom.vehicle.navigator import VehicleNavigator
from slalom.vehicle.vehicle import POSE, Command, Pose
from slalom.vehicle.ways import same_goal

RETRY: Final = 3.0
"""[s] without progress after a recovery, or without a way to the goal, after which the next step follows.

Larger: it asks for a path later. Smaller: a robot that waits for people after a recovery counts as stuck.
"""

SLOW: Final = 0.1
"""[1] Share of its largest speed below which a robot rests that may be stuck again. Larger: one that turns away counts.
"""

RECOVERIES: Final = 2
"""[1] Recoveries that are tried: to turn, and to back up. More: it asks for a path later."""

RECOVERY_TIME: Final = 5.0
"""[s] after which a recovery ends at the latest. Larger: it waits longer where it cannot move at all."""

BACK_BY: Final = 2.0
"""[1] Distance by which a robot backs up, in radii of the disc about it. Smaller: it does not leave a narrow place."""

FACES: Final = 0.35
"""[rad] A robot faces what lies within this angle ahead. Larger: it keeps its view. Smaller: turns without effect."""

OTHER_WAY: Final = 1.0
"""[m] A path that is longer than the rest of the one before by more than this is another way: progress begins anew.

Larger: a robot on a detour counts as stuck. Smaller: one whose planner has this noise never does.
"""

ERROR_STEP: Final = 0.02
"""[m] The margin grows with the error of the position in steps. Smaller: more navigators are made."""

BACK_SHARE: Final = 0.25
"""[1] Tolerance of the end of the way back, as a share of it. Larger: it hardly backs up. Smaller: it takes longer."""


ANEW: Final = "none came with a time of this clock"
"""In place of an age."""

DETECTED: Final = 6
"""[1] Values of a detection at most: the arguments of `Tracker.update` after the time, from the id to the heading."""


class DriveStatus(Enum):
    """What a driver does; the value is the sentence for the user."""

    WAITING = "No state has come yet; the command is to stand."
    IDLE = "There is no goal; the robot brakes, and then moves only to avoid obstacles."
    DRIVING = "The robot drives to its goal."
    YIELDING = "The robot waits for what is in its way."
    ARRIVED = "The robot has arrived; at a goal to stop at it rests, and moves only to avoid obstacles."
    NO_STATE = "No state came within `state_timeout`; the robot brakes."
    NO_DETECTIONS = "No detections came within `detection_timeout`; the robot brakes, as without a goal."
    CLOCK_JUMPED = "The clock has jumped back; the robot brakes, and begins anew with what comes from now on."
    TURNING = "The robot is stuck; it turns on the spot towards its goal."
    BACKING = "The robot is stuck; it backs up."
    NEEDS_PATH = "The robot is stuck, also after its recoveries; it needs another path or goal."


class Drive(NamedTuple):
    """The command of a driver, and why.

    Attributes:
        status: what the driver does. sentence: the same with its numbers, and the outcome of an unsafe decision.
        command: of a vehicle its `Command`, else the velocity (d,) [m/s] at the end of the period.
        decision: of the navigator; None before the first state.
        waits_for: ids of tracks, or the name of another obstacle, for which a robot waits that is YIELDING.
        stop: [m] way in which the robot can come to rest; inf: its limits do not let it rest.
    """

    status: DriveStatus
    sentence: str
    command: Command | Array
    decision: Decision | None
    waits_for: tuple[Hashable, ...] = ()
    stop: float = 0.0


class _Given(NamedTuple):
    """A state, or with None the stamp of detections."""

    state: Any
    t: float  # [s]
    error: float = 0.0  # [m]


class _Recovery(NamedTuple):
    """A motion that may free a robot: a decision of its navigator for another goal."""

    status: DriveStatus
    goal: Goal
    until: float  # [s]


@dataclass(eq=False)
class Driver:
    """One robot with all that its loop needs: the last state, tracks, walls, a goal, and the last decision.

    Call `locate` for each state, `see` for each set of detections, `head_for` for each goal or path, and `command` once
    a period. Set `walls` when the map changes. All times are of one clock, that of `command`, which judges all stamps.
    One that is later than `now` by more than a period is not used: it replaces nothing, and renews no timeout. Where
    `now` is before the last one, the robot brakes, and all states, detections and tracks are forgotten.

    Every command is a decision of the navigator, in recoveries too. Without a state for `state_timeout` the robot
    brakes to rest on its predicted motion, as hard as its limits allow. A robot that is stuck turns on the spot, then
    backs up, as far as it can, and then needs another path. Between these steps it tries its goal for 3 s.

    Attributes:
        navigator: decides. tracker: estimates what `see` gets.
        walls: obstacles that are known, as `Navigator.decide` takes them.
        state_timeout: [s] age of a state after which the robot brakes to rest.
        detection_timeout: [s] age of detections after which the robot comes to rest, from the first call of `see` on;
            None: the `max_age` of the tracker, after which it has forgotten all of them.
        goal: the one to head for; None: none. arrived: whether it was reached; a robot that rests there drives on when
            it is farther away than twice the tolerance.

    Raises:
        InvalidInput: parts that do not fit; a timeout that is not above 0, or of states above the horizon.
    """

    navigator: Navigator | VehicleNavigator
    tracker: Tracker = field(default_factory=Tracker)
    walls: Obstacles = ()
    state_timeout: Positive = 0.5
    detection_timeout: float | None = None
    goal: Goal | None = field(default=None, init=False)
    arrived: bool = field(default=False, init=False)
    _given: list[_Given] = field(default_factory=list, init=False, repr=False)  # since the last command
    _state: _Given | None = field(default=None, init=False, repr=False)
    _seen: float | None = field(default=None, init=False, repr=False)  # [s] -inf: not in this clock; None: never
    _now: float = field(default=-np.inf, init=False, repr=False)  # [s] of the last command with a state in time
    _unused: Counter[str] = field(default_factory=Counter, init=False, repr=False)
    _told: Counter[str] = field(default_factory=Counter, init=False, repr=False)  # those that a sentence has told
    _refused: str = field(default="", init=False, repr=False)
    _last: Any = field(default=None, init=False, repr=False)
    _on_way: Any = field(default=None, init=False, repr=False)
    _braking: tuple[float, Any] | None = field(default=None, init=False, repr=False)
    _recovery: _Recovery | None = field(default=None, init=False, repr=False)
    _tried: int = field(default=0, init=False, repr=False)
    _stuck: Approach | None = field(default=None, init=False, repr=False)
    _searched: tuple[Any, float] | None = field(default=None, init=False, repr=False)  # walls without a way, and when
    _wider: tuple[int, Any] = field(default=(0, None), init=False, repr=False)  # steps of its margin, and a navigator
    _yields: bool = field(default=False, init=False, repr=False)

    def __post_init__(self) -> None:
        has(self.navigator, ("decide", "period", "horizon", "margin"), "a Navigator", "navigator")
        has(self.tracker, ("update", "at", "forget", "unused", "max_age"), "a Tracker", "tracker")
        check_fields(self)
        if self.detection_timeout is not None:
            self.detection_timeout = or_infinite(self.detection_timeout, "detection_timeout", positive)
        if self.state_timeout > self.navigator.horizon:
            expected = f"at most the horizon, {self.navigator.horizon:g} s"
            raise InvalidInput(f"state_timeout: expected {expected}, found {self.state_timeout:g} s")

    def locate(self, t: float, state: State | Pose, error: float = 0.0) -> None:
        """Take the state of the robot, of a vehicle its pose, as it was at time `t` [s].

        error: [m] by which its position may be off. The margin grows by it, up to the next 2 cm, or the one after it
            where the error has fallen.

        Raises:
            InvalidInput: a state of another kind, an error below 0.
        """
        members, expected = POSE if isinstance(self.navigator, VehicleNavigator) else STATE
        has(state, members, expected, "state")
        self._given.append(_Given(state, number(t, "t"), not_negative(error, "error")))

    def see(self, t: float, detections: Sequence[Sequence[Any]] = ()) -> int:
        """Take what was detected at time `t` [s]; the number of detections that are not used.

        detections: each (id, position), and further arguments of `Tracker.update` in its order. None of them means that
            nothing is there: obstacles that are known are predicted up to their `max_age`. One that `Tracker.update`
            refuses, or of another dimension than the robot, is left out, see `lose`.

        Raises:
            InvalidInput: a time that is not finite; something else than a list.
        """
        number(t, "t")
        listing(detections, "detections", "detections")
        used = lost = 0
        d = self.navigator.robot.dimension
        for k, each in enumerate(detections):
            try:
                used += self.tracker.update(t, *_detection(each, f"detections[{k}]", d))
            except InvalidInput as error:
                lost += 1
                self.lose(error)
        # Of a robot whose every detection is refused it is not known what it would have seen.
        if lost < max(len(detections), 1):
            self._given.append(_Given(None, t))
        self._seen = -np.inf if self._seen is None else self._seen
        return len(detections) - used

    def lose(self, error: InvalidInput) -> None:
        """Count a detection that was refused with this error; the sentence of the next command has it."""
        self._unused["bad"] += 1
        self._refused = str(error)
        self._seen = -np.inf if self._seen is None else self._seen

    @property
    def unused(self) -> Counter[str]:
        """Numbers of inputs that were not used.

        Of detections `late`, `repeated` and `early` as of `Tracker.unused`, and `bad` ones; of states `late states` and
        `early states`; of calls of `see` `early sets`.
        """
        return self._unused + self.tracker.unused

    def head_for(self, goal: Goal | None) -> None:
        """Take a goal or a path in place of the one before; None: come to rest.

        A path with the same points goes on, and another one begins where the robot is nearest to it. A robot that is
        stuck stays so if the new goal is at the same place, unless its path is longer by more than 1 m.
        """
        if goal is not None:
            has(goal, *GOAL, "goal")
        before, self.goal = self.goal, goal
        self.arrived = False
        if not self._is_same(before, goal):
            self._tried = 0
            self._recovery = self._stuck = self._searched = None
            if self._last is not None:
                self._last = _resumed(self._last, self._last)

    def _is_same(self, before: Goal | None, goal: Goal | None) -> bool:
        """Whether a goal is at the place of the one before, on no longer way."""
        if self._state is None or before is None or goal is None:
            return goal is before
        if isinstance(before, PathGoal) and isinstance(goal, PathGoal):
            place, known = self._state.state.position, self._progress_on(before)
            if goal.is_way_of(before):
                return True
            left = goal.length - goal.begun(place)
            rest = before.length - (before.begun(place) if known is None else known)
            return left <= rest + OTHER_WAY and dist(goal.points[-1], before.points[-1]) <= goal.tolerance
        return type(before) is type(goal) and same_goal(before, goal, self._state.t)

    def _progress_on(self, goal: Goal) -> float | None:
        """The progress [m] of the last decision on the way to a path; None for another one."""
        last = self._on_way
        to = None if last is None else getattr(last, "goal", last.inputs.goal)
        return last.progress if isinstance(goal, PathGoal) and goal.is_way_of(to) else None

    def command(self, now: float, obstacles: Obstacles = (), **further: Any) -> Drive:
        """The command for the period from `now` [s] on.

        Args:
            obstacles: others than walls and tracks. further: arguments of `Navigator.decide`, such as robots or budget.

        Raises:
            InvalidInput: what the navigator refuses.
        """
        number(now, "now")
        if now < self._now:
            return self._jumped(now)
        self._take(now)
        rest = FollowVelocity(np.zeros(self.navigator.robot.dimension))
        if self._state is None:
            still = Command(0.0, 0.0) if isinstance(self.navigator, VehicleNavigator) else rest.velocity
            return Drive(DriveStatus.WAITING, DriveStatus.WAITING.value, still, None)
        state, measured, error = self._state
        age = max(now - measured, 0.0)
        if age > self.state_timeout + TIME:
            if self._braking is not None and now < self._braking[0]:
                return self._jumped(now)
            self._braking = (now, self._last if self._braking is None else self._braking[1])
            decision = self._decided(self._predicted(now), (), None, now=now, objective=rest)
            detail = f"the last one is {age:.2f} s old, {self.state_timeout:g} s are allowed" if age < np.inf else ANEW
            return self._drive(DriveStatus.NO_STATE, decision, now, detail)
        if self._braking is not None and now <= self._braking[0]:
            self._last = self._braking[1]
        if self._last is not None and now - self._now > self.state_timeout:
            self._last = _resumed(self._last, self._last)  # time without commands is not time without progress
        self._braking, self._now = None, now
        known = [each for each in listed(self.walls) if not hasattr(each, "__len__") or len(each)]
        around = [*known, *self.tracker.at(now, self.navigator.period), *listed(obstacles)]
        status, detail = self._situation(now)
        further |= {"now": now, "delay": age, "error": error}
        recovery = self._recovery
        if status in (DriveStatus.IDLE, DriveStatus.NO_DETECTIONS) or (self.arrived and self.goal and self.goal.stop):
            return self._drive(status, self._decided(state, around, None, objective=rest, **further), now, detail)
        if recovery is not None:
            return self._drive(recovery.status, self._decided(state, around, recovery.goal, **further), now, detail)
        changed = self._searched is not None and self.walls is not self._searched[0]
        again = changed and self._searched is not None and now >= self._searched[1] + RETRY
        if self._last is not None and (again or self._last is not self._on_way):
            self._last = _resumed(self._last, self._on_way or self._last)
        self._on_way = self._decided(state, around, self.goal, **further)
        if self._searched is None or again:
            self._searched = None if getattr(self._on_way, "no_way", None) is None else (self.walls, now)
        if status is DriveStatus.DRIVING:
            status = self._progress(self._on_way, now)
        waits_for = self._waits_for(self._on_way, now) if status is DriveStatus.DRIVING else ()
        self._yields = bool(waits_for)
        return self._drive(DriveStatus.YIELDING if waits_for else status, self._on_way, now, detail, waits_for)

    def _take(self, now: float) -> None:
        """Take the states and the stamps of detections up to a period after `now` [s]."""
        latest = now + self.navigator.period + TIME
        # Without a state in time the clock may have been ahead.
        if self._seen is not None and self._seen > latest:
            self._seen = -np.inf
        if self._state is not None and self._state.t > latest:
            self._state = self._state._replace(t=-np.inf)
        for given in self._given:
            kind = "sets" if given.state is None else "states"
            if given.t > latest:
                self._unused[f"early {kind}"] += 1
            elif given.state is None:
                self._seen = max(given.t, -np.inf if self._seen is None else self._seen)
            elif self._state is None or given.t >= self._state.t:
                self._state = given
            else:
                self._unused[f"late {kind}"] += 1
        self._given = []

    def _jumped(self, now: float) -> Drive:
        """Brake, and begin anew at `now` [s], before the time of the last command."""
        last = self._now if self._braking is None else self._braking[0]
        predicted = self._predicted(last + self.navigator.period)
        self.tracker.forget()
        self._state = self._last = self._braking = self._recovery = self._stuck = self._searched = None
        self._tried, self._now = 0, now
        self._take(now)
        # It may have seen its last obstacles at any time, and its state has no time without one of this clock.
        self._seen = None if self._seen is None else -np.inf
        self._state = self._state or _Given(predicted, -np.inf)
        state, measured, error = self._state
        age = now - measured if now - self.state_timeout <= measured <= now else 0.0
        rest = FollowVelocity(np.zeros(self.navigator.robot.dimension))
        decision = self._decided(state, (), None, error, now=now, delay=age, objective=rest)
        return self._drive(DriveStatus.CLOCK_JUMPED, decision, now, f"from {last:g} s to {now:g} s")

    def _decided(self, state: Any, around: Obstacles, goal: Goal | None, error: float = 0.0, **further: Any) -> Any:
        """A decision with a margin that is larger by the error [m] of the position."""
        steps = ceil(error / ERROR_STEP - TIME)
        if steps and not steps <= self._wider[0] <= steps + 1:
            self._wider = steps, replace(self.navigator, margin=self.navigator.margin + steps * ERROR_STEP)
        navigator = self._wider[1] if steps else self.navigator
        self._last = navigator.decide(state, around, goal, previous=self._last, **further)
        return self._last

    def _predicted(self, now: float) -> Any:
        """The state of the robot if it followed its last decision; the last one before any."""
        if self._last is None:
            assert self._state is not None
            return self._state.state
        if isinstance(self._last, VehicleDecision):
            return self._last.pose_at(now)
        return self._last.state_at(now, self._last.inputs.state, self._last.inputs.now)

    def _situation(self, now: float) -> tuple[DriveStatus, str]:
        """The status before a decision, with its numbers; a recovery that is over ends."""
        assert self._state is not None
        state, goal = self._state.state, self.goal
        if goal is None:
            return DriveStatus.IDLE, ""
        limit = self.tracker.max_age if self.detection_timeout is None else self.detection_timeout
        if self._seen is not None and now - self._seen > limit + TIME:
            age = f"the last ones are {now - self._seen:.2f} s old, {limit:g} s are allowed"
            return DriveStatus.NO_DETECTIONS, age if np.isfinite(self._seen) else ANEW
        there = state.position, state.velocity, now, getattr(state, "heading", None)
        if self.arrived and goal.stop:
            self.arrived = float(np.linalg.norm(goal.position(now) - state.position)) <= 2.0 * goal.tolerance
        else:
            self.arrived = self.arrived or goal.reached(*there, self._progress_on(goal))
        if self._recovery and (self.arrived or now >= self._recovery.until or self._recovery.goal.reached(*there)):
            self._recovery = None
        return (DriveStatus.ARRIVED if self.arrived else DriveStatus.DRIVING), ""

    def _progress(self, decision: Any, now: float) -> DriveStatus:
        """The status of a robot after a decision for its goal; one that is stuck begins its next recovery."""
        approach, stuck = decision.approach, self._stuck
        if approach is None:
            return DriveStatus.DRIVING
        if stuck is not None and self.goal is not None:
            # A robot that swings in front of what it is stuck at gains a little each time.
            gained = stuck.distance - approach.distance > self.navigator.robot.bounding_radius
            if gained or dist(approach.target, stuck.target) > self.goal.tolerance:
                self._stuck, self._tried = None, 0
        no_way = getattr(decision, "no_way", None)
        slow = (
            float(np.linalg.norm(decision.manoeuvre.velocity(now))) <= SLOW * decision.inputs.navigator.limits.max_speed
        )
        again = (self._tried > 0 or no_way is not None) and slow and decision.stalled >= RETRY
        if (again or decision.stuck) and self._tried <= RECOVERIES:
            self._stuck = self._stuck or approach
            further = [] if no_way is not None else self._recoveries(decision, now)[self._tried :]
            found = [k for k, one in enumerate(further) if one is not None]
            self._recovery = further[found[0]] if found else None
            self._tried = self._tried + found[0] + 1 if found else RECOVERIES + 1
        return DriveStatus.NEEDS_PATH if self._tried > RECOVERIES else DriveStatus.DRIVING

    def _recoveries(self, decision: Decision, now: float) -> list[_Recovery | None]:
        """The recoveries in their order, from where the robot can come to rest; None for those that it cannot do."""
        assert self._state is not None
        state, goal = self._state.state, self.goal
        until = now + RECOVERY_TIME
        assert goal is not None
        navigator: Any = self.navigator
        vehicle, back = getattr(navigator, "vehicle", None), BACK_BY * navigator.robot.bounding_radius
        limits = (vehicle or navigator).limits
        target = goal.position(now)
        if isinstance(goal, PathGoal) and decision.progress is not None:
            target = goal.point(min(decision.progress + goal.lookahead * limits.max_speed, goal.length))
        ahead = target - state.position
        place = state.position + 0.5 * float(np.linalg.norm(state.velocity)) / limits.braking * state.velocity
        turning = heading = None
        if vehicle is not None:
            bearing, heading = atan2(ahead[1], ahead[0]), state.heading
            if vehicle.turns_on_spot and abs((bearing - heading + pi) % (2.0 * pi) - pi) > FACES:
                facing = Goal(Stationary(place), back, True, bearing, FACES)
                turning = _Recovery(DriveStatus.TURNING, facing, until)
            ahead = state.direction
        behind = Stationary(place - back / max(float(np.linalg.norm(ahead)), TIME) * ahead)
        backing = _Recovery(DriveStatus.BACKING, Goal(behind, BACK_SHARE * back, True, heading, FACES), until)
        return [turning, backing if vehicle is None or vehicle.backs else None]

    def _waits_for(self, decision: Any, now: float) -> tuple[Hashable, ...]:
        """All tracks on the way of a robot that stands, or comes no nearer to its goal; else the first obstacle there.

        A robot that drives around other obstacles waits for none of them.
        """
        speeds = [float(np.linalg.norm(decision.manoeuvre.velocity(t))) for t in (now, now + self.navigator.period)]
        limits = decision.inputs.navigator.limits
        speeds_up = speeds[1] - speeds[0] > 0.5 * self.navigator.period * limits.max_acceleration
        stands = max(speeds) <= SLOW * limits.max_speed and (self._yields or not speeds_up)
        if not stands and decision.stalled < RETRY:
            return ()
        ids = {str(id): id for part in decision.inputs.obstacles if isinstance(part, Tracks) for id in part.ids}
        names = decision.in_the_way
        return tuple(ids[name] for name in names if name in ids) or names[: int(stands)]

    def _drive(
        self, status: DriveStatus, decision: Any, now: float, detail: str, waits_for: tuple[Hashable, ...] = ()
    ) -> Drive:
        """The command of a decision."""
        stop = _stop(self.navigator, decision)
        details = [detail] if detail else []
        if waits_for:
            named, left = ", ".join(map(str, waits_for)), decision.approach.distance
            details = [f"for {named}, {decision.stalled:.1f} s so far, {left:.2f} m before its goal"]
        elif status is DriveStatus.DRIVING and decision.stalled >= RETRY:
            details = [f"no nearer to it for {decision.stalled:.1f} s", *decision.in_the_way[:1]]
        if status in BRAKES:
            details.append(f"it can rest within {stop:.2f} m" if stop < np.inf else "its limits do not let it rest")
        sentence = f"{status.value[:-1]} ({'; '.join(details)})." if details else status.value
        if not decision.safe:
            sentence = f"{sentence} {decision.outcome.value}"
        if status is DriveStatus.NEEDS_PATH and getattr(decision, "no_way", None) is not None:
            sentence = f"{sentence} {decision.no_way}"
        if decision.stuck and getattr(decision, "unmoved", ""):
            sentence = f"{sentence} {decision.unmoved}"
        lost = {kind: count for kind, count in (self.unused - self._told).items() if kind not in USUAL}
        if lost:
            counts = ", ".join(f"{count} {kind}" for kind, count in lost.items())
            sentence = f"{sentence} Not used: {counts}{f' ({self._refused})' if 'bad' in lost else ''}."
        self._told = self.unused
        if isinstance(decision, VehicleDecision):
            return Drive(status, sentence, decision.command, decision, waits_for, stop)
        velocity = decision.manoeuvre.velocity(now + self.navigator.period)
        return Drive(status, sentence, velocity, decision, waits_for, stop)


BRAKES: Final = (
    *(DriveStatus.IDLE, DriveStatus.YIELDING),
    *(DriveStatus.NO_STATE, DriveStatus.NO_DETECTIONS, DriveStatus.CLOCK_JUMPED),
)
"""Statuses whose sentences have the way until the robot rests."""

USUAL: Final = ("late", "repeated", "late states")
"""Inputs that are not used and that no sentence has: every sensor has some."""


def _detection(given: Sequence[Any], name: str, d: int) -> Sequence[Any]:
    """The values of a detection. Raises InvalidInput for another number of them, or of dimensions of its position."""
    listing(given, "(id, position), and arguments of Tracker.update", name)
    if not 2 <= len(given) <= DETECTED:
        raise InvalidInput(f"{name}: expected 2 to {DETECTED} values, found {len(given)}")
    vector(given[1], f"{name}: position", d)
    return given


def _stop(navigator: Any, decision: Any) -> float:
    """The way [m] in which the robot can come to rest from the state that it decided from; inf: it never rests."""
    if isinstance(decision, VehicleDecision):
        motions = kernels.held(navigator.vehicle.wheels, decision.motions[0], 0.0, 0.0, 0, len(decision.motions))
        return float(np.hypot(*np.diff(motions[:, :2], axis=0).T).sum())
    if least_speed(navigator.limits) is not None:
        return np.inf
    velocity = decision.inputs.state.velocity
    return float(velocity @ velocity / (2.0 * navigator.limits.braking))


def _resumed(last: Any, before: Any) -> Any:
    """The last decision as one on the way of a decision before it: with its progress, and its time begins anew."""
    inputs = last.inputs._replace(goal=before.inputs.goal)
    changed: dict[str, Any] = {"progress": before.progress, "approach": None, "inputs": inputs}
    if isinstance(last, VehicleDecision):
        changed |= {"plan": _resumed(last.plan, before.plan), "goal": before.goal, "no_way": None}
        changed |= {"stood": (last.stood[0], np.inf)}
    return replace(last, **changed)
