"""Decisions of a vehicle that are judged by the motion of its body, not of the point that it decides for."""

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from itertools import chain
from math import ceil, hypot
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import GOAL, LIMITS, Array, check_fields, has, not_negative, number, whole
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import CONTACT_SLACK, TIME
from slalom.choice.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.fallback import DEEPER_BY, is_moving
from slalom.decision.methods import Method
from slalom.decision.navigator import Navigator
from slalom.decision.settings import SharedSettings
from slalom.kernels.arrays import Indices
from slalom.model.goal import Goal, refuse_stop
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.response import AccelerateThenBrake, Velocity
from slalom.model.shape import Capsule, Disc, Rectangle
from slalom.model.state import State
from slalom.obstacle.window import Obstacles, ObstacleWindow
from slalom.vehicle.vehicle import POSE, Command, Pose, Vehicle

GROWTHS: Final = (0.0, 0.5, 1.0)
"""[1] Growths of the robot in the plans of a vehicle, in distances of the point from the axle.

With 0 the body is where the point is, with 1 it is anywhere around it. More: more decisions, better ones in narrow
places. Fewer: the vehicle keeps its plan more often.
"""

TURN_RESERVES: Final = (0.0, 0.01)
"""[rad] Changes of the heading that plans for the body at its present heading allow for.

Larger: gaps are missed. Smaller: plans are rejected because the body turns.
"""

TRACKING_RESERVE: Final = 0.1
"""[1] What the plans of a vehicle keep beyond its margin, in tracking errors.

A plan that keeps exactly the margin is rejected if its vehicle is a little off. 0: most plans are rejected. Larger:
gaps are missed; 1 is the bound of the error within a period.
"""


class Moment(NamedTuple):
    """The inputs of one decision.

    Attributes:
        state: of the point, at `pose`. aim: its goal. window: the `obstacles` on their predicted trajectories.
        now: [s]. previous: the decision before; None at the start.
    """

    pose: Pose
    state: State
    obstacles: Obstacles
    window: ObstacleWindow
    aim: Goal
    now: float
    previous: "VehicleDecision | None"


@dataclass(frozen=True, eq=False)
class VehicleDecision:
    """The command for a vehicle, and the resulting motion.

    Attributes:
        command: for the period from now on.
        manoeuvre: the plan of the point, which the commands follow.
        outcome: how it was chosen.
        motions: (k, 5) position [m], heading [rad], speed [m/s] and turn of the vehicle under the commands, at the ends
            of all periods up to the horizon.
        collision: [s] from now of the first collision of the body on that motion; inf if there is none.
        plan: the decision of the point; None for other manoeuvres.
        reverses_until: [s] end of a reversal; None for other manoeuvres.
    """

    command: Command
    manoeuvre: Manoeuvre
    outcome: Outcome
    motions: Array
    collision: float
    plan: Decision | None
    reverses_until: float | None = None


@dataclass(frozen=True)
class VehicleNavigator(SharedSettings):
    """Vehicle that decides with `method`, and judges each manoeuvre by the motion of its own body.

    Plans of the point ahead of the axle come from `Navigator`. The commands that follow a plan, within all limits, are
    integrated up to the horizon. The clearance of the body on that motion decides (certified in continuous time). So
    neither the distance of the point from the body nor any tracking error is lost. Plans are computed for robots of
    several shapes about the point. The first one is a disc as wide as the body, larger ones follow, and the last disc
    contains the body at every heading. Then comes the body at its present heading. The first plan with a clear motion
    is chosen. Without one, the manoeuvre goes on if it is clear. Otherwise a bicycle that may reverse leaves backwards.
    Without a clear motion, the latest collision among all of them, and braking, is chosen. A body that overlaps an
    obstacle leaves it, and gets no deeper into any where possible (docs/design/0023).

    Law: while outcomes are safe, forecasts hold and the vehicle moves as its model, no obstacle is touched.

    Attributes:
        vehicle: its limits and its period. method: a row of the table of methods.
        body: a disc, or a rectangle whose x axis is along the heading; it turns with the vehicle. `discs` discs cover
            a rectangle, which adds hypot(width, length / discs) / 2 - width / 2 at its sides.
        center: [m] of the middle of the body ahead of the axle.
        horizon, margin, holds and others: see `Settings`. limits: of the point; None: all that the wheels may do.
        reverse_after: [s] without progress after which a bicycle reverses, if it would stay without moving obstacles.
    """

    vehicle: Vehicle
    method: Method
    body: Disc | Rectangle
    center: float = 0.0
    discs: int | None = None
    _: KW_ONLY
    limits: Limits | None = None
    reverse_after: float = 3.0

    def __post_init__(self) -> None:
        has(self.vehicle, ("lever", "follow"), "a vehicle, such as DifferentialDrive", "vehicle")
        if not isinstance(self.body, Disc | Rectangle):
            raise InvalidInput(f"body: expected a Disc or a Rectangle, found {type(self.body).__name__}")
        object.__setattr__(self, "center", number(self.center, "center"))
        if self.discs is not None:
            object.__setattr__(self, "discs", whole(self.discs, "discs", 1))
        if self.limits is not None:
            has(self.limits, *LIMITS, "limits")
        check_fields(self)
        object.__setattr__(self, "reverse_after", not_negative(self.reverse_after, "reverse_after"))
        self._navigators  # noqa: B018  # refuses what a navigator refuses

    @cached_property
    def discs_of_body(self) -> tuple[tuple[float, Disc], ...]:
        """The discs that cover the body: [m] ahead of the axle, and the disc."""
        if isinstance(self.body, Disc):
            return ((self.center, self.body),)
        length, width = self.body.length, self.body.width
        n = self.discs or ceil(length / width)
        disc = Disc(0.5 * hypot(width, length / n) + self.body.radius)
        return tuple((self.center + length * ((k + 0.5) / n - 0.5), disc) for k in range(n))

    @cached_property
    def _navigators(self) -> tuple[Navigator, ...]:
        least = min(disc.radius for _, disc in self.discs_of_body)
        most = max(abs(ahead - self.vehicle.lever) + disc.radius for ahead, disc in self.discs_of_body)
        return tuple(
            Navigator(
                self.method,
                Disc(least + growth * (most - least)),
                self.limits or self.vehicle.free_limits,
                period=self.vehicle.period,
                **self.shared | {"margin": self.margin + TRACKING_RESERVE * self.vehicle.tracking_error},
            )
            for growth in dict.fromkeys(GROWTHS if most > least else (0.0,))
        )

    def _proposing(self, pose: Pose) -> Iterator[Navigator]:
        """The navigators of the point in the order in which their plans are tried."""
        yield from self._navigators
        if len(self._navigators) > 1:
            ahead = [0.0, *(each - self.vehicle.lever for each, _ in self.discs_of_body)]
            first, e = self._navigators[0], pose.direction
            for turn in TURN_RESERVES:
                radius = first.robot.bounding_radius + turn * (max(ahead) - min(ahead))
                yield replace(first, robot=Capsule(min(ahead) * e, max(ahead) * e, radius))

    def decide(
        self,
        pose: Pose,
        obstacles: Obstacles,
        goal: Goal,
        *,
        now: float = 0.0,
        previous: VehicleDecision | None = None,
    ) -> VehicleDecision:
        """Decision at time `now` [s] of the vehicle at `pose`, for a `goal` of the middle of its axle.

        Raises:
            InvalidInput: as `Navigator.decide`.
        """
        has(pose, *POSE, "pose")
        has(goal, *GOAL, "goal")
        refuse_stop(goal, self._navigators[0].limits)
        number(now, "now")
        if previous is not None:
            has(previous, ("manoeuvre", "plan", "reverses_until"), "a VehicleDecision", "previous")
        state = self.vehicle.state(pose)
        window = self._navigators[0].predict(obstacles, state, now)
        moment = Moment(pose, state, obstacles, window, self.vehicle.goal(pose, goal, now), now, previous)
        if previous is not None and previous.reverses_until is not None and now < previous.reverses_until - TIME:
            proposal = self._proposed(moment, previous.manoeuvre, None, previous.reverses_until)
            found = self._judged(proposal, self._as_predicted(moment))
            if found.collision == np.inf:
                return found
        overlapped = self._overlapped(moment)
        if any(len(each) for each in overlapped):
            return self._leaving(moment, overlapped)
        rejected: list[VehicleDecision] = []
        for proposal in self._proposals(moment, leaves=False):
            found = self._judged(proposal, self._as_predicted(moment))
            if found.collision == np.inf:
                stays = found.plan is not None and self._stays(moment, found.plan)
                return (self._reversal(moment) if stays else None) or found
            rejected.append(found)
        return self._reversal(moment) or _latest(rejected)

    def _proposals(self, moment: Moment, leaves: bool) -> Iterator[VehicleDecision]:
        """The decisions for different manoeuvres of the point, not judged, in the order of `_plans`."""
        made: list[Manoeuvre] = []
        for manoeuvre, plan in self._plans(moment, leaves):
            if not any(manoeuvre is other for other in made):
                made.append(manoeuvre)
                yield self._proposed(moment, manoeuvre, plan)

    def _plans(self, moment: Moment, leaves: bool) -> Iterator[tuple[Manoeuvre, Decision | None]]:
        """Manoeuvres of the point in the order in which they are tried; `leaves`: by a body that overlaps obstacles."""
        state = moment.state
        now = moment.now
        previous = moment.previous
        before, unsafe = None if previous is None else previous.plan, list[Decision]()
        for navigator in self._proposing(moment.pose):
            plan = navigator.decide(state, moment.obstacles, moment.aim, now=now, previous=before)
            if plan.safe:
                yield plan.manoeuvre, plan
            else:
                # The shape overlaps an obstacle, which the body need not do.
                unsafe.append(plan)
        goes_on: list[tuple[Manoeuvre, Decision | None]] = []
        if previous is not None:
            goes_on = [(previous.manoeuvre, previous.plan)]
        others: list[tuple[Manoeuvre, Decision | None]] = [(plan.manoeuvre, plan) for plan in unsafe]
        yield from others + goes_on if leaves else goes_on + others
        brake = max(self.vehicle.period, hypot(*state.velocity) / self.vehicle.feedback)
        stop = AccelerateThenBrake(self.vehicle.period, brake)
        yield Manoeuvre(stop, state, -state.velocity / (brake + self.vehicle.period), now), None

    def _overlapped(self, moment: Moment) -> list[Indices]:
        """The obstacles that each disc of the body overlaps."""
        places = [State(place, np.zeros(2)) for place in self._places(moment.pose)]
        return [
            ControlObstacle(Velocity(), place, moment.window, disc).overlapping
            for place, (_, disc) in zip(places, self.discs_of_body)
        ]

    def _places(self, pose: Pose) -> list[Array]:
        """The positions (2,) [m] of the discs of the body."""
        return [pose.position + ahead * pose.direction for ahead, _ in self.discs_of_body]

    def _leaving(self, moment: Moment, overlapped: list[Indices]) -> VehicleDecision:
        """The decision of a vehicle whose body overlaps obstacles: no deeper into any, else by as little as possible.

        Those that move are left out where it would otherwise hit another obstacle before it can stop.
        """
        every = np.unique(np.concatenate(overlapped))
        moving = np.array([k for k in every.tolist() if is_moving(moment.window.obstacle(k), moment.now)], np.int64)
        to_stop = self.vehicle.period + abs(moment.pose.speed) / self._navigators[0].limits.braking
        backwards = (self._backwards(moment, each) for each in self.vehicle.ways_out(moment.pose, self._periods))
        plans, made = self._proposals(moment, leaves=True), list[VehicleDecision]()
        last = None if moment.previous is None else moment.previous.plan
        stays = last is not None and self._stays(moment, last)
        proposals = chain(backwards, plans) if stays else chain(plans, backwards)
        for depth in DEEPER_BY:
            found = self._leaving_among(self._touched(moment, every, moving[:0], depth), made, proposals)
            if found.collision < np.inf and len(moving):
                others = self._touched(moment, every, moving, depth)
                if self._first_collision(found.motions, others) <= to_stop:
                    found = self._leaving_among(others, made, proposals)
            if found.collision == np.inf:
                break
        return found

    def _leaving_among(
        self, windows: list[ObstacleWindow], made: list[VehicleDecision], proposals: Iterator[VehicleDecision]
    ) -> VehicleDecision:
        """The first proposal without a collision among the obstacles, or the one with the latest.

        Those `made` already come first; the list gets the further ones.
        """
        rejected: list[VehicleDecision] = []
        for one in chain(tuple(made), proposals):
            if len(rejected) >= len(made):
                made.append(one)
            found = self._judged(one, windows)
            if found.collision == np.inf:
                return replace(found, outcome=Outcome.ESCAPING)
            rejected.append(found)
        return replace(_latest(rejected), outcome=Outcome.ESCAPING)

    def _touched(self, moment: Moment, overlapped: Indices, left_out: Indices, depth: float) -> list[ObstacleWindow]:
        """The obstacles as each disc of the body meets them that gets up to a depth [m] deeper into overlapped ones."""
        deeper = np.zeros(len(moment.window))
        deeper[overlapped] = depth
        deeper[left_out] = np.inf
        return [moment.window.touched_from(place, deeper) for place in self._places(moment.pose)]

    def _stays(self, moment: Moment, plan: Decision) -> bool:
        """Whether a vehicle that leaves backwards makes no progress, and would not among obstacles at rest alone."""
        if not self.vehicle.leaves_backwards or plan.stalled < self.reverse_after:
            return False
        lasting = [each for each in moment.window.obstacles if each.at_rest]
        plan = self._navigators[0].decide(moment.state, lasting, moment.aim, now=moment.now)
        motions = self.vehicle.follow(moment.pose, plan.manoeuvre, moment.now, self._periods)
        return self.vehicle.period * float(np.abs(motions[:, 3]).sum()) < self.vehicle.lever

    def _reversal(self, moment: Moment) -> VehicleDecision | None:
        """The first way out backwards without a collision; None if there is none."""
        for motions in self.vehicle.ways_out(moment.pose, self._periods):
            if self._first_collision(motions, self._as_predicted(moment)) == np.inf:
                return self._judged(self._backwards(moment, motions), self._as_predicted(moment))
        return None

    def _backwards(self, moment: Moment, motions: Array) -> VehicleDecision:
        """The decision for a way out backwards, not judged."""
        point = self.vehicle.body_motion(motions, self.vehicle.lever)
        until = moment.now + self.vehicle.period * float(np.flatnonzero(motions[:, 3]).max(initial=0) + 1)
        return self._proposed(moment, Manoeuvre(point, point.start, np.zeros(2), moment.now), None, until)

    def _as_predicted(self, moment: Moment) -> list[ObstacleWindow]:
        """The obstacles as each disc of a body meets them that overlaps none."""
        return [moment.window] * len(self.discs_of_body)

    @property
    def _periods(self) -> int:
        """Periods up to the horizon."""
        return ceil(self.horizon / self.vehicle.period - 1e-9)

    def _proposed(
        self, moment: Moment, manoeuvre: Manoeuvre, plan: Decision | None, reverses_until: float | None = None
    ) -> VehicleDecision:
        """The decision for a manoeuvre as long as it is not judged: its command."""
        motions = self.vehicle.follow(moment.pose, manoeuvre, moment.now, self._periods)
        command = Command(float(motions[1, 3]), float(motions[1, 4]))
        return VehicleDecision(command, manoeuvre, Outcome.DELAYED, motions, 0.0, plan, reverses_until)

    def _judged(self, proposal: VehicleDecision, windows: list[ObstacleWindow]) -> VehicleDecision:
        """The decision with the first collision of the body among the obstacles of each disc, and its outcome."""
        collision, plan = self._first_collision(proposal.motions, windows), proposal.plan
        outcome = Outcome.DELAYED
        if collision == np.inf:
            outcome = Outcome.CONTINUED if plan is None or not plan.outcome.safe else plan.outcome
        return replace(proposal, collision=collision, outcome=outcome)

    def _first_collision(self, motions: Array, windows: list[ObstacleWindow]) -> float:
        """Time [s] of the first collision of a disc of the body among its obstacles, with the margin it can keep."""
        discs = zip(self.discs_of_body, windows)
        return min(self._collision(motions, ahead, disc, window) for (ahead, disc), window in discs)

    def _collision(self, motions: Array, ahead: float, disc: Disc, window: ObstacleWindow) -> float:
        """Time [s] of the first collision of a disc `ahead` [m] of the axle, with the margin that it can keep."""
        motion = self.vehicle.body_motion(motions, ahead)
        state = motion.start
        clearances = ControlObstacle(motion, state, window, disc).initial_clearances
        # Bodies are grown by the error of the motion.
        kept = np.clip(clearances - CONTACT_SLACK - motion.interpolation_error, 0.0, self.margin)
        return float(ControlObstacle(motion, state, window, disc, kept).time_to_collision(np.zeros(2)))


def _latest(decisions: list[VehicleDecision]) -> VehicleDecision:
    """The first of the decisions with the latest collision."""
    return max(decisions, key=lambda one: one.collision)
