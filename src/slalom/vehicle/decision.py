"""Decisions of vehicles: their inputs, motions that are proposed, and the result."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision import Decision, Outcome
from slalom.decision.decision import Collision
from slalom.decision.inputs import Commitment
from slalom.kernels.arrays import Bodies
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.state import State
from slalom.obstacle.window import ObstacleWindow
from slalom.vehicle.estimate import motion_at
from slalom.vehicle.following import Following
from slalom.vehicle.vehicle import Command, Pose, pose_of
from slalom.vehicle.ways import WayFound


class Moment(NamedTuple):
    """The inputs of one decision.

    Attributes:
        pose: of the vehicle when the decision acts. track: (m, 6) before that, see `VehicleDecision`.
        state: of the point, at `pose`. plan: its decision there. goal: of the middle of the axle. aim: of the point.
        window: the obstacles on their predicted trajectories.
        now: [s] when the decision acts. previous: the decision before; None at the start.
        bodies: of the window. gaps: (b,) [m] of the body of the vehicle from each of them.
    """

    pose: Pose
    track: Array
    state: State
    plan: Decision
    window: ObstacleWindow
    goal: Goal | None
    aim: Goal | None
    now: float
    previous: "VehicleDecision | None"
    bodies: Bodies
    gaps: Array


class Proposal(NamedTuple):
    """A motion of the vehicle that is not judged yet.

    Attributes:
        motions: (k, 5), see `VehicleDecision`. manoeuvre: of the point. plan: the decision that it follows; None for
            other manoeuvres. way: that it follows. outcome: of a motion on a way. held: whether it holds a speed and a
            turn.
    """

    motions: Array
    manoeuvre: Manoeuvre
    plan: Decision | None = None
    way: Following | None = None
    outcome: Outcome = Outcome.CONTINUED
    held: bool = False


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class VehicleDecision(Decision):
    """The command for a vehicle, and the resulting motion: a `Decision` for the point, judged by the body.

    Attributes:
        command: for the period from now on.
        motions: (k, 5) position [m], heading [rad], speed [m/s] and turn of the vehicle under the commands, at the ends
            of all periods up to the horizon, from `acts_at` on.
        first_contact: [s] from then of the first contact of the body on that motion; inf if there is none.
        acts_at: [s] time at which the command acts.
        plan: the decision of the point, which the motion follows unless the outcome says otherwise.
        track: (m, 6) time [s] and motion of the vehicle as it was and is predicted.
        goal: of the middle of the axle. way: that it follows there; None if it follows none.
        no_way: why a search found no way to the goal among obstacles at rest; None if it found one, or did not search.
        held: whether the vehicle holds a speed and a turn, and then brakes, instead of a plan.
        See `Decision` for the others: the manoeuvre is that of the point.
    """

    command: Command
    motions: Array
    first_contact: float
    acts_at: float
    plan: Decision
    track: Array
    goal: Goal | None
    way: Following | None
    no_way: WayFound | None
    held: bool

    @property
    def commitment(self) -> Commitment:
        """That of the plan of the point."""
        return self.plan.commitment

    @cached_property
    def collision(self) -> Collision | None:
        """The first predicted contact of the body: of the plan, if that has one; None for a safe decision."""
        return None if self.safe else self.plan.collision

    def as_dict(self) -> dict[str, Any]:
        """As `Decision.as_dict`, with the command, the first contact of the body, and why there is no way."""
        contact = None if self.first_contact == np.inf else self.acts_at + self.first_contact
        return super().as_dict() | {
            "command": {"speed": self.command.speed, "turn": self.command.turn},
            "first_contact": contact,
            "no_way": None if self.no_way is None else str(self.no_way),
        }

    def dump(self, file: FilePath | str) -> None:
        """Refused: decision files hold robots that move in every direction; the `plan` of the point can be written.

        Raises:
            InvalidInput: always.
        """
        raise InvalidInput("decision: expected one of a Navigator for a file, found one of a vehicle; dump its plan")

    def pose_at(self, now: float) -> Pose:
        """The predicted pose at `now` [s]: between the ends of periods by interpolation, after the last one that."""
        return pose_of(motion_at(self.track, now))
