"""Decisions of vehicles: their inputs, motions that are proposed, and the result."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import hypot
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array, array, array_of, short
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST, TIME
from slalom.decision import Decision, Outcome
from slalom.decision.decision import Collision, Commitment
from slalom.decision.objective import Objective
from slalom.kernels.arrays import Bodies
from slalom.model.goal import Goal
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path import Path, hermite
from slalom.model.response.protocol import Unsteered
from slalom.model.state import Affine, State
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import ObstacleWindow
from slalom.vehicle.vehicle import Command, Pose, Vehicle, pose_of
from slalom.vehicle.ways import SAME_PLACE, Following, WayFound


class Moment(NamedTuple):
    """The inputs of one decision.

    Attributes:
        pose: of the vehicle when the decision acts. track: (m, 6) before that, see `VehicleDecision`.
        state: of the point, at `pose`. plan: its decision there. goal: of the middle of the axle. to: it, or the end of
            a path that has been driven. aim: of the point.
        window: the obstacles on their predicted trajectories.
        now: [s] when the decision acts. previous: the decision before; None at the start.
        bodies: of the window. gaps: (b,) [m] of the body of the vehicle from each of them.
        stood: see `VehicleDecision`.
        progress: [m] along a path; None for other goals.
    """

    pose: Pose
    track: Array
    state: State
    plan: Decision
    window: ObstacleWindow
    goal: Goal | None
    to: Goal | None
    aim: Goal | None
    now: float
    previous: "VehicleDecision | None"
    bodies: Bodies
    gaps: Array
    stood: tuple[Array, float]
    progress: float | None

    def while_moving(self) -> "Moment":
        """The same inputs, where no contact counts while the vehicle is at rest."""
        each = self.bodies.each.copy()
        each["at_rest"] = False
        return self._replace(bodies=self.bodies._replace(each=each))


class Proposal(NamedTuple):
    """A motion of the vehicle that is not judged yet.

    Attributes:
        motions: (k, 5), see `VehicleDecision`. manoeuvre: of the point. plan: the decision that it follows; None for
            other manoeuvres. way: that it follows. outcome: of a motion on a way, and of one that collides. held:
            whether it holds a speed and a turn.
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
        stood: the measured motion (5,) at which it stands though it is to move, and since when [s]; else the last one.
        unmoved: why it is `stuck` if it has stood so for `reverse_after` and the time in which commands act; else "".
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
    stood: tuple[Array, float]
    unmoved: str

    @property
    def stuck(self) -> bool:
        """As `Decision.stuck`; also of a vehicle that is `unmoved`."""
        return bool(self.unmoved) or super().stuck

    @property
    def commitment(self) -> Commitment:
        """That of the plan of the point."""
        return self.plan.commitment

    @cached_property
    def in_the_way(self) -> tuple[str, ...]:
        """Those of the plan of the point, see `Decision`."""
        return self.plan.in_the_way

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
            "unmoved": self.unmoved,
        }

    @property
    def remembered(self) -> "VehicleDecision":
        """The decision as far as the next one depends on it, without its inputs and what is only reported."""
        made = self.inputs
        less: dict[str, Any] = {"inputs": made and made._replace(obstacles=(), robots=None, previous=None)}
        less |= {"earlier": (), "begun": None, "record": None}
        return replace(self, **less, plan=replace(self.plan, **less))

    def pose_at(self, now: float) -> Pose:
        """The predicted pose at `now` [s]: between the ends of periods by interpolation, after the last one that."""
        return pose_of(motion_at(self.track, now))


class VehicleInputs(NamedTuple):
    """All inputs of a decision, see `VehicleNavigator.decide`: a `Record`."""

    navigator: Any  # a VehicleNavigator
    pose: Pose
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks]
    goal: Goal | None
    robots: Tracks | None
    now: float
    previous: VehicleDecision | None
    objective: Objective | None
    delay: float
    budget: float | None

    def repeat(self) -> VehicleDecision:
        """The decision, made again."""
        given = self._asdict()
        made: VehicleDecision = self.navigator.decide(**{name: given[name] for name in self._fields[1:]})
        return made


UNMOVED: Final = (
    "The vehicle does not move though it is to: a dead zone or friction is likely, or an obstacle that is not known. "
    "State min_speed and min_turn_rate, or a larger tolerance."
)
"""Why a vehicle is stuck that stands."""


def same_place(goal: Goal) -> Array:
    """Differences (2,) [m, rad] of place and heading that are none for a goal."""
    return SAME_PLACE * np.array([goal.tolerance, goal.heading_tolerance])


def stood(
    pose: Pose, goal: Goal | None, now: float, period: float, last: VehicleDecision | None
) -> tuple[Array, float]:
    """The motion (5,) and since when [s], see `VehicleDecision`, of a vehicle that is measured at a pose `now` [s].

    It is to move if its last manoeuvre does, or its way has ended before its goal.
    """
    here = pose.motion
    if goal is None or last is None or goal.reached(pose.position, pose.velocity, now, pose.heading, last.progress):
        return here, now
    ended = last.way is not None and last.way.at[1] == len(last.way.arcs)
    moves = hypot(*last.manoeuvre.velocity(last.acts_at + period)) > REST
    x, y, turn = (here - last.stood[0])[:3].tolist()
    off = np.array([hypot(x, y), abs(kernels.wrapped(turn))])
    if not (ended or moves) or np.any(off > same_place(goal)):
        return here, now
    return last.stood[0], min(last.stood[1], now)


# The motion of a point of a vehicle as a response: what a robot does that is committed to it.


@dataclass(frozen=True, eq=False)
class PointMotion(Unsteered):
    """Response whose motion is that of a point of a vehicle, whatever the control: gain 0. It ends at rest.

    Args:
        times: (m + 1,) [s] from now. path: (m + 1, 2) [m] of the point, velocities: (m + 1, 2) [m/s].

    Raises:
        InvalidInput: arrays of other shapes; times that do not increase.
    """

    interpolation_error: ClassVar[float] = 0.0
    times: Array
    path: Array
    velocities: Array

    def __post_init__(self) -> None:
        shape = (len(array(self.times, "times")), 2)
        array_of(self.path, "path", shape), array_of(self.velocities, "velocities", shape)
        if shape[0] < 2 or np.any(np.diff(self.times) <= 0.0):
            raise InvalidInput(f"times: expected two or more that increase, found {short(self.times)}")

    @cached_property
    def _pieces(self) -> Path:
        return hermite(self.times, self.path, self.velocities)

    def _affine(self, t: npt.ArrayLike, derivative: int) -> Affine:
        time = np.asarray(t, dtype=np.float64)
        return Affine(self._at(time, derivative), np.zeros_like(time))

    def position(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 0)

    def velocity(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 1)

    def acceleration(self, state: State, t: npt.ArrayLike) -> Affine:
        return self._affine(t, 2)

    def _at(self, t: Array, derivative: int) -> Array:
        """Values (..., 2) of a derivative of the cubic pieces; at rest after the last one."""
        times = self.times
        over = t > times[-1]
        t = np.minimum(t, times[-1])
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        h = np.diff(times)[k]
        s = ((t - times[k]) / h)[..., None]
        p = np.moveaxis(self._pieces.points[k], -2, 0)
        if derivative == 0:
            r = 1.0 - s
            return np.asarray(r**3 * p[0] + 3.0 * r * r * s * p[1] + 3.0 * r * s * s * p[2] + s**3 * p[3])
        d = [3.0 * (b - a) / h[..., None] for a, b in pairwise(p)]
        if derivative == 1:
            found = (1.0 - s) ** 2 * d[0] + 2.0 * s * (1.0 - s) * d[1] + s * s * d[2]
        else:
            found = 2.0 * ((1.0 - s) * (d[1] - d[0]) + s * (d[2] - d[1])) / h[..., None]
        return np.where(over[..., None], 0.0, found)

    def knots(self, horizon: float, speed_bound: float) -> Array:
        inner = self.times[(self.times > 0.0) & (self.times < horizon - 1e-9)]
        return np.concatenate([[0.0], inner, [horizon]])


def manoeuvre_of(vehicle: Vehicle, motions: Array, start: float) -> Manoeuvre:
    """The manoeuvre of the point of a vehicle on its motions (n, 5) at the ends of all periods from `start` [s] on."""
    rates = np.array([vehicle.turn_rate(speed, turn) for speed, turn in motions[:, 3:].tolist()])
    e = np.stack([np.cos(motions[:, 2]), np.sin(motions[:, 2])], axis=1)
    path = motions[:, :2] + vehicle.lever * e
    velocities = motions[:, 3:4] * e + (vehicle.lever * rates)[:, None] * np.stack([-e[:, 1], e[:, 0]], axis=1)
    times = vehicle.period * np.arange(len(motions), dtype=np.float64)
    return Manoeuvre(PointMotion(times, path, velocities), State(path[0], velocities[0]), np.zeros(2), start)


# The motion of a vehicle at the time at which a decision acts, from a measured pose and from what was predicted.


CORRECTION_TIMES: Final = np.array([0.4, 0.4, 0.4, 1.2, 1.2])
"""[s] Times in which differences of measured motions from the predicted ones are corrected, by 63 %. Of x, y, heading,
speed and turn, each in addition to the lag. Longer: the vehicle notices slip later. Shorter: noise of measurements
becomes turns of the vehicle, which a lag amplifies."""

CORRECTED_WITHIN: Final = np.array([0.05, 0.08, 0.2, 0.5])
"""[m, rad, m/s, rad/s] Differences from the prediction beyond which the measured pose is taken as it is. Larger: a push
is noticed later. Smaller: rare large errors of measurements count in full."""

PERSISTS: Final = 1e-9
"""[1] A time that is a whole number of periods up to this share of one counts as that number."""


def motion_at(track: Array, now: float) -> Array:
    """The motion (5,) at `now` [s] of a track (m, 6); before its begin and after its end the first and the last one."""
    return np.array([np.interp(now, track[:, 0], track[:, k]) for k in range(1, 6)])


def estimated(
    vehicle: Vehicle, motion: Array, measured: float, acts: float, track: Array | None, kept: float, within: Array
) -> Array:
    """The track (m, 6), time [s] and motion, of a vehicle up to the time `acts` [s].

    A predicted track is corrected by a share of the difference of the measured motion from it, and by all of it where
    that is large. One that is predicted to rest then has no speed and no turn. Without a track the vehicle keeps both.

    Args:
        motion: (5,) that was `measured` [s]. track: as it was predicted; None: not at all. kept: [s] of it before.
        within: (4,) differences that are not large, see CORRECTED_WITHIN.
    """
    if track is None:
        return _kept_on(vehicle, motion, measured, acts)
    predicted = motion_at(track, measured)
    off = motion - predicted
    off[2] = kernels.wrapped(off[2])
    sizes = np.array([hypot(off[0], off[1]), *np.abs(off[2:])])
    if np.all(sizes <= within):
        off *= 1.0 - np.exp(-vehicle.period / (CORRECTION_TIMES + max(vehicle.lags)))
        if not motion_at(track, acts)[3:].any():
            # Noise of a vehicle at rest is no motion: what counts only while it moves would count at rest.
            off[3:] = 0.0
    between = track[(track[:, 0] > measured + TIME) & (track[:, 0] < acts - TIME)]
    times = np.array([measured, *between[:, 0], *([acts] if acts > measured else [])])
    rows = np.column_stack([times, np.array([motion_at(track, t) for t in times.tolist()])])
    c, s = np.cos(off[2]), np.sin(off[2])
    rows[:, 1:3] = predicted[:2] + off[:2] + (rows[:, 1:3] - predicted[:2]) @ np.array([[c, s], [-s, c]])
    rows[:, 3:] += off[2:]
    return np.concatenate([track[(track[:, 0] < measured - TIME) & (track[:, 0] > acts - kept)], rows])


def _kept_on(vehicle: Vehicle, motion: Array, measured: float, acts: float) -> Array:
    """The track (m, 6) of a vehicle that keeps its speed and turn."""
    motion, now, rows = motion.copy(), measured, [[measured, *motion]]
    while now < acts - PERSISTS * vehicle.period:
        share = min(1.0, (acts - now) / vehicle.period)
        kernels.drive(vehicle.wheels, motion, motion[3], motion[4], 0.0, share, motion)
        now += share * vehicle.period
        rows.append([now, *motion])
    return np.array(rows)
