"""Decisions of a vehicle that are judged by the motion of its body, not of the point that it decides for."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil, hypot

import numpy as np

from slalom.checks import LIMITS, Array, has, not_negative, number, positive, whole
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.navigator import Navigator
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.manoeuvre import Manoeuvre
from slalom.methods import HOLDS, Method
from slalom.obstacle.window import Obstacles, ObstacleWindow
from slalom.response import AccelerateThenBrake
from slalom.shape import Disc, Rectangle
from slalom.state import State
from slalom.tolerances import CONTACT_SLACK, GROWTHS
from slalom.vehicle.motion import BodyMotion, hermite_error
from slalom.vehicle.pose import POSE, Command, Pose
from slalom.vehicle.vehicle import Vehicle


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
        plan: the decision of the point.
    """

    command: Command
    manoeuvre: Manoeuvre
    outcome: Outcome
    motions: Array
    collision: float
    plan: Decision | None


@dataclass(frozen=True)
class VehicleNavigator:
    """Vehicle that decides with `method`, and judges each manoeuvre by the motion of its own body.

    Plans of the point ahead of the axle come from `Navigator`. The commands that follow a plan, within all limits, are
    integrated up to the horizon. The clearance of the body on that motion decides (certified in continuous time). So
    neither the distance of the point from the body nor any tracking error is lost. Plans are computed for a robot that
    grows from the width of the body. The largest one is the disc about the point that contains the body at every
    heading. The first clear one is chosen. Without one, the manoeuvre goes on if it is clear. Otherwise the latest
    collision among all of them, and braking, is chosen.

    Law: while outcomes are safe, forecasts hold and the vehicle moves as its model, no obstacle is touched.

    Attributes:
        vehicle: its limits and its period. method: a row of the table of methods.
        body: a disc, or a rectangle whose x axis is along the heading; it turns with the vehicle. `discs` discs cover
            a rectangle, which adds hypot(width, length / discs) / 2 - width / 2 at its sides.
        center: [m] of the middle of the body ahead of the axle.
        horizon, margin, holds, patience: as of `Navigator`. limits: of the point; None: all that the wheels may do.
    """

    vehicle: Vehicle
    method: Method
    body: Disc | Rectangle
    center: float = 0.0
    discs: int | None = None
    horizon: float = 6.0
    margin: float = 0.05
    holds: tuple[float, ...] = HOLDS
    patience: float = 0.1
    limits: Limits | None = None

    def __post_init__(self) -> None:
        has(self.vehicle, ("lever", "follow"), "a vehicle, such as DifferentialDrive", "vehicle")
        if not isinstance(self.body, Disc | Rectangle):
            raise InvalidInput(f"body: expected a Disc or a Rectangle, found {type(self.body).__name__}")
        object.__setattr__(self, "center", number(self.center, "center"))
        if self.discs is not None:
            object.__setattr__(self, "discs", whole(self.discs, "discs", 1))
        if self.limits is not None:
            has(self.limits, *LIMITS, "limits")
        positive(self.horizon, "horizon")
        not_negative(self.margin, "margin")
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
                horizon=self.horizon,
                margin=self.margin,
                holds=self.holds,
                patience=self.patience,
            )
            for growth in dict.fromkeys(GROWTHS if most > least else (0.0,))
        )

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
        number(now, "now")
        if previous is not None:
            has(previous, ("manoeuvre", "plan"), "a VehicleDecision", "previous")
        state, window = self.vehicle.state(pose), None
        rejected: list[VehicleDecision] = []
        for manoeuvre, plan in self._plans(state, pose, obstacles, goal, now, previous):
            if window is None:
                window = self._navigators[0].predict(obstacles, state, now)
            if any(manoeuvre is other.manoeuvre for other in rejected):
                continue
            found = self._judged(pose, manoeuvre, plan, window, now)
            if found.collision == np.inf:
                return found
            rejected.append(found)
        return max(rejected, key=lambda one: one.collision)

    def _plans(
        self,
        state: State,
        pose: Pose,
        obstacles: Obstacles,
        goal: Goal,
        now: float,
        previous: VehicleDecision | None,
    ) -> Iterator[tuple[Manoeuvre, Decision | None]]:
        """Manoeuvres of the point in the order in which they are tried."""
        aim = self.vehicle.goal(pose, goal, now)
        before = None if previous is None else previous.plan
        for navigator in self._navigators:
            plan = navigator.decide(state, obstacles, aim, now=now, previous=before)
            yield plan.manoeuvre, plan
        if previous is not None:
            yield previous.manoeuvre, previous.plan
        brake = max(self.vehicle.period, hypot(*state.velocity) / self.vehicle.feedback)
        stop = AccelerateThenBrake(self.vehicle.period, brake)
        yield Manoeuvre(stop, state, -state.velocity / (brake + self.vehicle.period), now), None

    def _judged(
        self, pose: Pose, manoeuvre: Manoeuvre, plan: Decision | None, window: ObstacleWindow, now: float
    ) -> VehicleDecision:
        """The decision for a manoeuvre: its command, and the first collision of the body."""
        periods = ceil(self.horizon / self.vehicle.period - 1e-9)
        motions = self.vehicle.follow(pose, manoeuvre, now, periods)
        command = Command(float(motions[1, 3]), float(motions[1, 4]))
        collision = min(self._collision(motions, ahead, disc, window) for ahead, disc in self.discs_of_body)
        outcome = Outcome.DELAYED
        if collision == np.inf:
            outcome = Outcome.CONTINUED if plan is None or not plan.outcome.safe else plan.outcome
        return VehicleDecision(command, manoeuvre, outcome, motions, collision, plan)

    def _collision(self, motions: Array, ahead: float, disc: Disc, window: ObstacleWindow) -> float:
        """Time [s] of the first collision of a disc `ahead` [m] of the axle, with the margin that it can keep."""
        vehicle, h = self.vehicle, self.vehicle.period
        e = np.stack([np.cos(motions[:, 2]), np.sin(motions[:, 2])], axis=1)
        rates = np.array([vehicle.turn_rate(speed, turn) for speed, turn in motions[:, 3:].tolist()])
        path: Array = motions[:, :2] + ahead * e
        velocities: Array = motions[:, 3:4] * e + (ahead * rates)[:, None] * np.stack([-e[:, 1], e[:, 0]], axis=1)
        error = hermite_error(motions[:, 3], vehicle.turning(motions[:, 3], motions[:, 4]), ahead, h)
        motion = BodyMotion(h * np.arange(len(motions), dtype=np.float64), path, velocities, error)
        state = State(path[0], velocities[0])
        clearances = ControlObstacle(motion, state, window, disc).initial_clearances
        kept = np.clip(clearances - CONTACT_SLACK, 0.0, self.margin)
        return float(ControlObstacle(motion, state, window, disc, kept).time_to_collision(np.zeros(2)))
