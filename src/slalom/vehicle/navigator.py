"""Decisions of a vehicle that are judged by the motion of its body, not of the point that it decides for."""

from collections.abc import Iterable, Iterator
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from math import ceil, hypot
from typing import Any, Final

import numpy as np

from slalom import kernels
from slalom.base.checks import GOAL, LIMITS, SHAPE, Array, check_fields, flag, has, not_negative, number
from slalom.base.errors import InvalidInput
from slalom.decision import Decision, Outcome
from slalom.decision.decision import Approach, approach_of
from slalom.decision.document import KINDS
from slalom.decision.fallback import DEEPER_BY, is_moving, stands
from slalom.decision.methods import Method
from slalom.decision.navigator import Navigator
from slalom.decision.objective import Objective
from slalom.decision.settings import SharedSettings
from slalom.kernels.arrays import Bodies, MaybeHulls
from slalom.kernels.vehicle.wheels import CREEPING, Hull
from slalom.model.goal import Goal, refuse_goal
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Disc, Shape
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.table import same_dimension
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, listed, passive
from slalom.vehicle.curves import Arc, Way, ends
from slalom.vehicle.decision import (
    CORRECTED_WITHIN,
    PERSISTS,
    UNMOVED,
    Moment,
    PointMotion,
    Proposal,
    VehicleDecision,
    VehicleInputs,
    estimated,
    manoeuvre_of,
    same_place,
    stood,
)
from slalom.vehicle.sweep import Scene, convex_bodies
from slalom.vehicle.vehicle import POSE, Bicycle, Command, DifferentialDrive, Pose, Vehicle, path_of_point, pose_of
from slalom.vehicle.ways import (
    OFF_WAY,
    Following,
    Outcome as WayOutcome,
    WayFound,
    begun,
    direct_ways,
    followed,
    geometry,
    is_for,
    same_goal,
    search,
)

CONTACT_SHARE: Final = 1e-4
"""[1] Depth of an overlap that counts as contact, as a share of the size of the body: 0.4 mm for a car.

Larger: deeper overlaps count as contact. Smaller: more tests of motions along walls.
"""

ADVANCE_SHARE: Final = 0.2
"""[1] Least way between two tests of a motion, as a share of the depth that counts as contact. As of CONTACT_SHARE."""

KEPT_SHARE: Final = 0.75
"""[1] Share of its clearance that a body keeps at least which is nearer to an obstacle than the margin.

Larger: more tests of motions along walls. Smaller: it comes nearer to them, decision by decision.
"""

PLAN_RESERVE: Final = 0.002
"""[m] What the plans of a vehicle keep beyond its margin.

A plan that keeps exactly the margin is rejected if its vehicle is a little off. 0: most plans are rejected. Larger:
gaps are missed.
"""

PARTS: Final = 2
"""[1] Cubic pieces for the motion of a body in a period. They are exact to a micrometre at usual turn rates.

More: longer decisions. Fewer: 16 times the error for half of the parts.
"""

HELD_FOR: Final = (0.04, 0.1, 0.2, 0.35, 0.5)
"""[1] Shares of the horizon for which a vehicle holds a speed and a turn where no plan is clear.

More and longer ones: ways out of narrower places. Fewer: quicker decisions.
"""

HELD_RESERVE: Final = 0.05
"""[m] What a new held motion keeps beyond the margin from tracks; the last one goes on without it.

Larger: the vehicle stops farther from people. Smaller: each new measurement changes its motion.
"""

CHANGE_TIMES: Final = (0.1, 0.5)
"""[s] A change of the speed, and one of the turn of the point, count as the way that they make in these times.

Longer: smoother motions, and longer ways. Shorter: the vehicle turns to and fro where several motions end alike.
"""

WAY_SPEEDS: Final = (1.0, 0.4, 0.0)
"""[1] Shares of the largest speed at which a motion along a way is tried; 0: it stops on the way.

More: it waits for others less often. Fewer: quicker decisions.
"""

SLOW: Final = 0.5
"""[1] A plan that comes nearer to the goal by less than this share of the free way is compared with held motions.

Larger: more decisions compare them. Smaller: the vehicle creeps where it could turn away.
"""

GAIN: Final = 0.1
"""[1] Share of the free way by which a new held motion must come nearer to the goal than a plan or the last one.

As of SLOW.
"""


@dataclass(frozen=True)
class VehicleNavigator(SharedSettings):
    """Vehicle that decides with `method`, and judges each manoeuvre by the motion of its own body.

    Plans of the point ahead of the axle come from `Navigator`, for a disc as wide as the body. The commands that follow
    a plan, within all limits and with the lag of the vehicle, are integrated up to the horizon. The clearance of the
    body on that motion decides. It is certified in continuous time, for the body as it is and turns. So neither the
    distance of the point from the body nor any tracking error is lost. A plan whose motion is clear, and that comes
    nearer to the goal as it should, is chosen. Otherwise the vehicle drives in its dynamic window (Fox, Burgard and
    Thrun 1997): it holds a speed and a turn for some time, and brakes to rest. Of those that are clear it chooses the
    one that ends nearest to its goal. Without any it brakes, or takes the motion with the latest contact if braking
    hits an obstacle that is known; never one that drives into what stands still, unless each does. A body that overlaps
    an obstacle leaves it, and gets no deeper into any where possible (docs/design/0005).

    What tracked obstacles do later is not known: `Tracks`, and others that move with an uncertainty. So by default
    contacts with them count only while the vehicle moves (passive safety). What comes too near in any case is
    approached no farther than if the vehicle stayed.

    Law: while outcomes are safe, forecasts hold and the vehicle moves as its model, the vehicle touches nothing as long
    as it moves. At rest it is touched only by what is tracked, and not with `contact_at_rest`.

    Attributes:
        vehicle: its limits and its period. method: a row of the table of methods.
        body: a shape whose x axis is along the heading; it turns with the vehicle. Convex.
        center: [m] of the origin of the body ahead of the axle.
        horizon, margin, holds and others: see `Settings`. limits: of the point; None: all that the wheels may do.
        reverse_after: [s] without progress after which it leaves its place, backwards where it must.
        contact_at_rest: whether contacts with what is tracked count while it stands.
    """

    vehicle: Vehicle
    method: Method
    body: Shape
    center: float = 0.0
    _: KW_ONLY
    limits: Limits | None = None
    reverse_after: float = 3.0
    contact_at_rest: bool = False

    def __post_init__(self) -> None:
        has(self.vehicle, ("lever", "wheels"), "a vehicle, such as DifferentialDrive", "vehicle")
        has(self.body, *SHAPE, "body")
        if self.body.dimension != 2 or len(self.body.parts) != 1:
            raise InvalidInput(f"body: expected one convex shape in the plane, found {self.body!r}")
        object.__setattr__(self, "center", number(self.center, "center"))
        if self.limits is not None:
            has(self.limits, *LIMITS, "limits")
        check_fields(self)
        object.__setattr__(self, "reverse_after", not_negative(self.reverse_after, "reverse_after"))
        object.__setattr__(self, "contact_at_rest", flag(self.contact_at_rest, "contact_at_rest"))
        self._navigator  # noqa: B018  # refuses what a navigator refuses

    @property
    def period(self) -> float:
        """[s] between decisions."""
        return self.vehicle.period

    @property
    def robot(self) -> Shape:
        """The body: what `Navigator.robot` is."""
        return self.body

    @cached_property
    def corners(self) -> Array:
        """Corners (c, 2) [m] of the body relative to the middle of the axle, which `rounding` [m] grows."""
        return np.ascontiguousarray(self.body.parts[0].corners + np.array([self.center, 0.0]))

    @property
    def rounding(self) -> float:
        """Radius [m] by which the body is rounded."""
        return self.body.parts[0].radius

    @cached_property
    def _navigator(self) -> Navigator:
        return Navigator(
            self.method,
            Disc(float(np.ptp(self.corners[:, 1])) / 2.0 + self.rounding),
            self.limits or self.vehicle.limits,
            period=self.period,
            **self.shared | {"margin": self.margin + PLAN_RESERVE},
        )

    def decide(
        self,
        pose: Pose,
        obstacles: Obstacles,
        goal: Goal | None = None,
        *,
        robots: Tracks | None = None,
        now: float = 0.0,
        previous: VehicleDecision | None = None,
        objective: Objective | None = None,
        delay: float = 0.0,
        budget: float | None = None,
    ) -> VehicleDecision:
        """Decision at time `now` [s] of the vehicle at `pose`, for a `goal` of the middle of its axle.

        Args:
            robots: others that decide by the same method. Plans of the point share the avoidance with them; the motion
                of the body is judged among obstacles alone.
            delay: [s] age of `pose` at `now`. The vehicle moved as predicted meanwhile.
            See `Navigator.decide` for the others. An objective is that of the point.

        Raises:
            InvalidInput: as `Navigator.decide`.
        """
        has(pose, *POSE, "pose")
        if goal is not None:
            has(goal, *GOAL, "goal")
            refuse_goal(goal, self._navigator.limits, turns=True)
        number(now, "now")
        not_negative(delay, "delay")
        if previous is not None:
            has(previous, ("manoeuvre", "motions", "track"), "a VehicleDecision", "previous")
        before = None if previous is None else previous.remembered
        around = tuple(listed(obstacles))
        record = VehicleInputs(self, pose, around, goal, robots, now, before, objective, delay, budget)
        further = {"robots": robots, "objective": objective, "budget": budget}
        moment = self._moment(pose, around, goal, now, previous, delay, further)
        overlapped = moment.bodies.at_rest & (moment.gaps < -self._contact_depth)
        if overlapped.any():
            found = self._leaving(moment, np.unique(moment.bodies.owner[overlapped]))
        else:
            found = self._chosen(moment)
        return replace(found, record=record)

    def _moment(
        self,
        pose: Pose,
        obstacles: Obstacles,
        goal: Goal | None,
        now: float,
        previous: VehicleDecision | None,
        delay: float,
        further: dict[str, Any],
    ) -> Moment:
        """The inputs at the time at which the decision acts."""
        acts = now + self.vehicle.delay
        obstacles = obstacles if self.contact_at_rest else passive(obstacles)
        before = None if previous is None else previous.track
        rests = stood(pose, goal, now, self.period, previous)
        within = CORRECTED_WITHIN.copy()
        if goal is not None and now - rests[1] > self._reaction:
            within[:2] = np.minimum(within[:2], same_place(goal))
        track = estimated(self.vehicle, pose.motion, now - delay, acts, before, self.horizon, within)
        pose = pose_of(track[-1, 1:])
        state = self.vehicle.state(pose)
        window = self._navigator.predict(obstacles, state, acts)
        same_dimension(window.dimension, 2, "obstacles", "pose")
        bodies = window.bodies(Disc(self.rounding))
        gaps = kernels.pose_gaps(pose.motion[:3], self.corners, bodies, bodies.hulls)
        to, progress = goal, 0.0
        known, lengths = None, np.zeros(1)
        if isinstance(goal, PathGoal):
            if previous is not None and goal.is_way_of(previous.goal):
                known = previous.progress
            progress = goal.begun(pose.position, self._navigator.robot.bounding_radius) if known is None else known
            # Others than drives come to the end along the path, and would drive loops for what is left.
            ends = progress >= goal.length - goal.tolerance
            to = goal.end if ends and (self.vehicle.turns_on_spot or goal.heading is not None) else goal
        aim = None if to is None else self.vehicle.goal(pose, to, acts)
        if isinstance(goal, PathGoal) and isinstance(aim, PathGoal):
            wheels = self.vehicle.wheels
            lengths = path_of_point(goal, wheels.lever, self.vehicle.least_radius, not wheels.steered)[1]
            aim = aim if known is not None else aim.begun_at(float(np.interp(progress, lengths, aim.lengths)))
        commitment = None if previous is None else previous.plan
        plan = self._navigator.decide(state, obstacles, aim, now=acts, previous=commitment, **further)
        if isinstance(aim, PathGoal) and plan.progress is not None:
            progress = float(np.interp(plan.progress, aim.lengths, lengths))
        if isinstance(goal, PathGoal):
            goal.note(now, pose.position, progress, self.vehicle.limits.max_speed)
        way = progress if isinstance(goal, PathGoal) else None
        place = track[:-1], state, plan, window
        return Moment(pose, *place, goal, to, aim, acts, previous, bodies, gaps, rests, way)

    def _chosen(self, moment: Moment) -> VehicleDecision:
        """The decision of a vehicle whose body overlaps nothing."""
        keep = self._kept(moment)
        on_way, no_way = self._on_way(moment, keep)
        if on_way is not None:
            return self._decided(moment, on_way, np.inf, on_way.outcome)
        found, best = self._latest(moment, self._proposals(moment, leaves=False), keep)
        target = self._target(moment)
        held: Proposal | None = None
        if self._stays(moment, keep):
            held = self._held(moment, keep, target, np.inf, moves=True)
        if held is None:
            least = np.inf if found < np.inf else self._improvement(moment, best, target)
            held = self._going_on_or_held(moment, keep, target, least) if least > -np.inf else None
        if held is not None:
            return self._decided(moment, held, np.inf, Outcome.CONSTRAINED, no_way)
        if found < np.inf:
            stop = self._braking(moment)
            known = np.where(moment.bodies.at_rest, keep, -np.inf)
            if not moment.bodies.at_rest.all() and self._contact(moment, stop.motions, known) == np.inf:
                found, best = self._contact(moment, stop.motions, keep), stop
            return self._decided(moment, best, found, best.outcome, no_way)
        safe = best.plan is not None and best.plan.safe and best.manoeuvre is best.plan.manoeuvre
        return self._decided(
            moment, best, found, best.plan.outcome if best.plan and safe else Outcome.CONTINUED, no_way
        )

    def _improvement(self, moment: Moment, plan: Proposal, way: Array) -> float:
        """The cost [m] below which a held motion replaces a clear one; -inf: none does.

        A clear motion is kept that comes nearer to the goal as it should, and every one close to the goal. On a path it
        should as a plan among obstacles at rest does, which leads to a point ahead and is slow before corners, until it
        stalls.
        """
        if self._is_close(moment, way):
            return -np.inf
        now, then = self._cost(plan.motions[:1], way), self._cost(plan.motions, way)
        free = min(self.horizon * self.vehicle.limits.max_speed, now)
        if now - then < SLOW * free and isinstance(moment.to, PathGoal) and moment.plan.stalled < self.reverse_after:
            free = 0.0 if moment.bodies.at_rest.all() else now - self._cost(self._alone(moment), way)
        return then - GAIN * free if now - then < SLOW * free else -np.inf

    def _on_way(self, moment: Moment, keep: Array) -> tuple[Proposal | None, WayFound | None]:
        """The first clear motion along a way to the goal, and why a search found none.

        The way that it is on comes first, also with a stop on it; then direct ones. One that stands searches: to a
        place where it stalls, without a reverse where its plan ends, since it could not leave the place of a stall.
        """
        goal, previous = moment.to, moment.previous
        motion, backs = moment.pose.motion, self.vehicle.backs
        if goal is None or isinstance(goal, PathGoal) or np.any(goal.velocity(moment.now)):
            return None, None
        direct = goal.heading is not None or not self.vehicle.turns_on_spot
        if backs and not direct:
            return None, None
        # Towards a place plans of the point lead around others; a vehicle that parks, or does not back, waits for them.
        waits = not (backs and goal.heading is None) and (previous is None or previous.stalled < self.reverse_after)
        before = None if previous is None else previous.way
        if before is not None and is_for(before, goal, moment.now) and not before.missed(moment.now, moment.pose):
            on_it = before.error(moment.now, motion) <= OFF_WAY * self.vehicle.wheels.base
            found = self._along(moment, before, keep, waits) if on_it else None
            if found is not None:
                return found, None
        for way in direct_ways(self.vehicle, motion, goal, moment.now) if direct else ():
            if self._is_free(moment, way, 0.0):
                careful = not self._is_free(moment, way, self.margin)
                at_begin = begun(self.vehicle, motion, way, goal, moment.now, careful)
                found = self._along(moment, at_begin, keep, waits=False)
                if found is not None:
                    return found, None
        if previous is not None and previous.no_way is not None and same_goal(previous.goal, goal, moment.now):
            return None, previous.no_way
        stalls = previous is not None and previous.stalled >= self.reverse_after
        ends = not backs and goal.heading is None and (stalls or self._ends_early(moment))
        if ends and abs(moment.pose.speed) > CREEPING:
            stop = self._braking(moment)._replace(outcome=Outcome.CONSTRAINED)
            return (stop if self._contact(moment, stop.motions, keep) == np.inf else None), None
        if abs(moment.pose.speed) > CREEPING or not (stalls or ends or goal.heading is not None):
            return None, None
        around = [one for _, one in self._at_rest(moment)]
        searched = search(self.vehicle, motion, goal, moment.now, self.body, self.center, around, self.margin)
        if searched.way is None:
            return None, searched
        at_begin = begun(self.vehicle, motion, searched.way, goal, moment.now, careful=True)
        return self._along(moment, at_begin, keep, waits=True), None

    def _ends_early(self, moment: Moment) -> bool:
        """Whether the plan leads hardly nearer to the goal, and a new one among obstacles at rest alone does not."""
        way = self._target(moment)
        if self._is_close(moment, way) or not self._is_slow(self._following(moment, moment.plan).motions, way):
            return False
        return self._is_slow(self._alone(moment), way)

    def _is_close(self, moment: Moment, way: Array) -> bool:
        """Whether the end of a polyline (m, 2) [m] is so close that the vehicle turns there."""
        left = hypot(*(way[-1] - moment.pose.position))
        return moment.to is None or left <= moment.to.tolerance + 2.0 * self.vehicle.turning_radius

    def _is_slow(self, motions: Array, way: Array) -> bool:
        """Whether motions (k, 5) come nearer to the end of a polyline by less than SLOW of the free way."""
        now = self._cost(motions[:1], way)
        return now - self._cost(motions, way) < SLOW * min(self.horizon * self.vehicle.limits.max_speed, now)

    def _along(self, moment: Moment, way: Following, keep: Array, waits: bool) -> Proposal | None:
        """The fastest clear motion along a way; None if none is. waits: whether to stop on it is one."""
        # Places at rest may be entered as far as the body fits, such as docks.
        rests = np.array([one.at_rest for one in moment.window.obstacles], np.bool_)[moment.bodies.owner]
        least = np.where(rests, np.minimum(keep, ADVANCE_SHARE * self._contact_depth), keep)
        for share in WAY_SPEEDS if waits else WAY_SPEEDS[:1]:
            fastest = share * self._navigator.limits.max_speed
            motions, on = followed(
                self.vehicle, moment.pose.motion, way, moment.now, fastest, self._periods, self.margin
            )
            for outcome, kept in ((Outcome.KEPT, keep), (Outcome.SQUEEZED, least)):
                if self._contact(moment, motions, kept) == np.inf:
                    manoeuvre = manoeuvre_of(self.vehicle, motions, moment.now)
                    return Proposal(motions, manoeuvre, way=on, outcome=outcome)
        return None

    def _is_free(self, moment: Moment, way: Way, clearance: float) -> bool:
        """Whether the body keeps a clearance [m] from all obstacles at rest on a whole way."""
        at_rest = self._at_rest(moment)
        if not at_rest:
            return True
        key = tuple(id(one) for one, _ in at_rest)
        if self._scenes.get("key") != key:
            scene = Scene(convex_bodies(self.body, self.center), [outline for _, outline in at_rest])
            # The obstacles are kept: another one could get the number of one that exists no more.
            self._scenes.update(key=key, scene=scene, obstacles=[one for one, _ in at_rest])
        arcs = np.array(way).reshape(-1, 2)
        poses = ends(moment.pose.motion[:3], way)[:-1]
        return bool(self._scenes["scene"].clear(poses, arcs[:, 0], arcs[:, 1], clearance).all())

    @cached_property
    def _scenes(self) -> dict[str, Any]:
        """The obstacles at rest of the last decision as geometries, which are slow to make."""
        return {}

    def _at_rest(self, moment: Moment) -> list[tuple[Obstacle, Any]]:
        """The obstacles at rest, with their geometries."""
        found = [one for one in moment.window.obstacles if one.at_rest]
        key = tuple(map(id, found))
        if self._scenes.get("listed") != key:
            self._scenes.update(listed=key, at_rest=[(one, geometry(one, moment.now)) for one in found])
        return list(self._scenes["at_rest"])

    def _proposals(self, moment: Moment, leaves: bool) -> Iterator[Proposal]:
        """Motions in the order in which they are tried; `leaves`: of a body that overlaps obstacles."""
        following = self._following(moment, moment.plan)
        goes_on = [] if moment.previous is None else [self._going_on(moment, moment.previous)]
        yield from [following, *goes_on] if moment.plan.safe or leaves else [*goes_on, following]
        yield self._braking(moment)

    def _braking(self, moment: Moment) -> Proposal:
        """The motion that brakes to rest as hard as the limits allow, on its curvature."""
        motions = kernels.held(self.vehicle.wheels, moment.pose.motion, 0.0, 0.0, 0, self._periods)
        return Proposal(motions, manoeuvre_of(self.vehicle, motions, moment.now), outcome=Outcome.BRAKING)

    def _following(self, moment: Moment, plan: Decision) -> Proposal:
        """The motion that follows a plan of the point."""
        return self._planned(moment, plan.manoeuvre)._replace(plan=plan)

    def _planned(self, moment: Moment, manoeuvre: Manoeuvre) -> Proposal:
        """The motion that follows a manoeuvre of the point."""
        times = moment.now + self.period * np.arange(self._periods + 1)
        planned = np.concatenate([manoeuvre.position(times), manoeuvre.velocity(times)], axis=1)
        return Proposal(kernels.follow(self.vehicle.wheels, moment.pose.motion, planned), manoeuvre)

    def _going_on(self, moment: Moment, previous: VehicleDecision) -> Proposal:
        """The motion that follows the previous manoeuvre further: its plan, with what is known now."""
        new = moment.plan
        known = {name: getattr(new, name) for name in ("inputs", "control_obstacle", "approach", "progress")}
        plan = replace(previous.plan, **known)
        return self._planned(moment, previous.manoeuvre)._replace(plan=plan)

    def _going_on_or_held(self, moment: Moment, keep: Array, target: Array, least: float) -> Proposal | None:
        """The held motion that is clear and costs less than `least` [m], the last one if others are hardly better."""
        before = moment.previous
        if before is None or not before.held or moment.plan.stalled >= self.reverse_after:
            return self._held(moment, keep, target, least, moves=False)
        last = self._going_on(moment, before)._replace(plan=None, held=True)
        cost = self._cost(last.motions[-1:], target)
        if cost >= least or self._contact(moment, last.motions, keep) < np.inf:
            return self._held(moment, keep, target, least, moves=False)
        better = cost - GAIN * self.horizon * self.vehicle.limits.max_speed
        return self._held(moment, keep, target, better, moves=False) or last

    @cached_property
    def _window(self) -> Array:
        """What is held (n, 3): speed [m/s], turn, number of periods."""
        periods = [max(1, round(share * self._periods)) for share in HELD_FOR]
        return np.array([(v, turn, n) for n in periods for v, turn in self.vehicle.holds], np.float64)

    def _held(self, moment: Moment, keep: Array, target: Array, least: float, moves: bool) -> Proposal | None:
        """The clear motion that holds a speed and a turn, brakes, and ends nearest to the target; None: there is none.

        least: [m] cost below which it has to be. moves: only motions that lead away from here.
        """
        wheels, start = self.vehicle.wheels, moment.pose.motion
        costs, ways = kernels.window_costs(
            wheels, start, self._window, self._periods, target, self.vehicle.turning_radius
        ).T
        changes = np.abs(self._window[:, :2] - start[3:]) * (1.0, self.vehicle.lever)
        costs = costs + changes @ CHANGE_TIMES
        some = costs < least
        if moves:
            some &= ways >= self.vehicle.lever
        order = np.argsort(costs, kind="stable")
        order = order[some[order]]
        more = np.where(moment.bodies.at_rest, keep, keep + HELD_RESERVE)
        k = kernels.first_clear(wheels, start, self._window, order, self._periods, *self._scene(moment, more))
        if k < 0:
            return None
        speed, turn, periods = self._window[k].tolist()
        motions = kernels.held(wheels, start, speed, turn, int(periods), self._periods)
        return Proposal(motions, manoeuvre_of(self.vehicle, motions, moment.now), held=True)

    def _cost(self, motions: Array, way: Array) -> float:
        """The least way [m] that is left to the end of a polyline (m, 2) [m] on motions (k, 5)."""
        return float(kernels.least_left(motions, way, self.vehicle.turning_radius))

    def _target(self, moment: Moment) -> Array:
        """The polyline (m, 2) [m] to where the middle of the axle heads for; its own place without a goal.

        Of a path what is left of it up to the horizon, of another goal its position.
        """
        goal = moment.to
        if goal is None:
            return np.array([moment.pose.position])
        if moment.progress is None or not isinstance(goal, PathGoal):
            return goal.position(moment.now)[None]
        return goal.between(moment.progress, moment.progress + self.horizon * self.vehicle.limits.max_speed)

    def _leaving(self, moment: Moment, overlapped: Array) -> VehicleDecision:
        """The decision of a vehicle whose body overlaps obstacles: no deeper into any, else by as little as possible.

        Of the motions that are clear so, the first one is taken that ends outside of them, else the one that ends least
        deep. Those that move are left out where it would otherwise hit another obstacle before it can stop.
        """
        moving = [k for k in overlapped.tolist() if is_moving(moment.window.obstacle(k), moment.now)]
        to_stop = self.period + abs(moment.pose.speed) / self._navigator.limits.braking
        proposals = [*self._proposals(moment, leaves=True), *self._every_held(moment)]
        inside = np.flatnonzero(moment.bodies.at_rest & (moment.gaps < -self._contact_depth))
        ends = [float(self._gaps(moment, one.motions[-1])[inside].min()) for one in proposals]
        chosen: Proposal | None = None
        deepest = -np.inf
        for depth in DEEPER_BY:
            keep = self._kept(moment, depth)
            for one, end in zip(proposals, ends):
                if end > deepest and self._contact(moment, one.motions, keep) == np.inf:
                    chosen, deepest = one, min(end, -self._contact_depth)
            if chosen is not None and deepest >= -self._contact_depth:
                break
        if chosen is not None:
            return self._decided(moment, chosen, np.inf, Outcome.ESCAPING)
        found, best = self._latest(moment, proposals, keep)
        if moving:
            without = np.where(np.isin(moment.bodies.owner, moving), -np.inf, keep)
            if self._contact(moment, best.motions, without) <= to_stop:
                found, best = self._latest(moment, proposals, without)
        return self._decided(moment, best, found, Outcome.ESCAPING)

    def _every_held(self, moment: Moment) -> Iterator[Proposal]:
        """All motions that hold a speed and a turn for the shortest time."""
        periods = max(1, round(HELD_FOR[0] * self.horizon / self.period))
        for speed, turn in self.vehicle.holds:
            motions = kernels.held(self.vehicle.wheels, moment.pose.motion, speed, turn, periods, self._periods)
            yield Proposal(motions, manoeuvre_of(self.vehicle, motions, moment.now))

    def _gaps(self, moment: Moment, motion: Array) -> Array:
        """The clearance (b,) [m] of the body at a motion (5,) from each obstacle where that is now."""
        bodies = moment.bodies
        return np.asarray(kernels.pose_gaps(motion[:3].copy(), self.corners, bodies, bodies.hulls))

    def _latest(self, moment: Moment, proposals: Iterable[Proposal], keep: Array) -> tuple[float, Proposal]:
        """The time of the first contact of the first clear motion, else of that with the latest one; and the motion.

        Of motions that drive into nothing that stands still; without any the vehicle brakes.
        """
        judged: list[tuple[float, Proposal]] = []
        for proposal in proposals:
            found = self._contact(moment, proposal.motions, keep)
            if found == np.inf:
                return found, proposal
            judged.append((found, proposal._replace(outcome=Outcome.DELAYED)))
        stand = [k for k, one in enumerate(moment.window.obstacles) if stands(one, moment.now)]
        still = np.where(np.isin(moment.bodies.owner, stand), keep, -np.inf)
        passive = moment.while_moving()
        some = [one for one in judged if self._contact(passive, one[1].motions, still) == np.inf]
        stop = self._braking(moment)
        return max(some or [(self._contact(moment, stop.motions, keep), stop)], key=lambda one: one[0])

    def _kept(self, moment: Moment, deeper: float | None = None) -> Array:
        """The clearance (b,) [m] to keep from each body: the margin, or what the body of the vehicle has of it now.

        deeper: [m] further depth into bodies that it overlaps already; None: those collide at once.
        """
        advance, gaps = ADVANCE_SHARE * self._contact_depth, moment.gaps
        keep = np.where(gaps < self.margin + advance, KEPT_SHARE * gaps, self.margin)
        # A body in contact may come as deep as counts as contact: the depth does not add up over decisions.
        keep = np.where(keep < self._contact_depth, advance - self._contact_depth, keep)
        return keep if deeper is None else np.where(gaps < -self._contact_depth, gaps - deeper, keep)

    @cached_property
    def _size(self) -> float:
        """Radius [m] of the disc about the middle of the axle that contains the body."""
        return float(np.hypot(*self.corners.T).max()) + self.rounding

    @cached_property
    def _contact_depth(self) -> float:
        """Depth [m] of an overlap that counts as contact."""
        return CONTACT_SHARE * self._size

    def _stays(self, moment: Moment, keep: Array) -> bool:
        """Whether a vehicle makes no progress, and would not drive among obstacles at rest alone."""
        if moment.plan.stalled < self.reverse_after or moment.aim is None:
            return False
        motions = self._alone(moment)
        if self.period * float(np.abs(motions[:, 3]).sum()) < self.vehicle.lever:
            return True
        return self._contact(moment, motions, np.where(moment.bodies.at_rest, keep, -np.inf)) < np.inf

    @property
    def _reaction(self) -> float:
        """Time [s] from a decision until a vehicle that follows it moves."""
        return self.vehicle.delay + max(self.vehicle.lags) + self.period

    def _alone(self, moment: Moment) -> Array:
        """The motions (n, 5) that follow a new plan among obstacles at rest alone."""
        lasting, aim = [each for each in moment.window.obstacles if each.at_rest], moment.aim
        if isinstance(aim, PathGoal) and moment.plan.progress is not None:
            aim = aim.begun_at(moment.plan.progress)
        alone = self._navigator.decide(moment.state, lasting, aim, now=moment.now)
        return self._following(moment, alone).motions

    @property
    def _periods(self) -> int:
        """Periods up to the horizon."""
        return ceil(self.horizon / self.period - PERSISTS)

    def _decided(
        self, moment: Moment, proposal: Proposal, first_contact: float, outcome: Outcome, no_way: WayFound | None = None
    ) -> VehicleDecision:
        """The decision for a motion that was judged."""
        plan, motions = proposal.plan or moment.plan, proposal.motions
        previous = moment.previous
        if no_way is None and proposal.way is None and previous is not None and moment.goal is not None:
            no_way = previous.no_way if same_goal(previous.goal, moment.goal, moment.now) else None
        times = moment.now + self.period * np.arange(len(motions))
        track = np.concatenate([moment.track, np.column_stack([times, motions])])
        known = {**plan.__dict__, "manoeuvre": proposal.manoeuvre, "outcome": outcome, "progress": moment.progress}
        known["approach"] = self._approach(moment, plan.approach)
        stands = moment.now - self.vehicle.delay - moment.stood[1]
        return VehicleDecision(
            **{name: known[name] for name in Decision.__dataclass_fields__},
            command=self.vehicle.command(motions[0], motions[1]),
            motions=motions,
            first_contact=first_contact,
            acts_at=moment.now,
            plan=plan,
            track=track,
            goal=moment.goal,
            way=proposal.way,
            no_way=no_way,
            held=proposal.held,
            stood=moment.stood,
            unmoved=UNMOVED if stands > self.reverse_after + self._reaction else "",
        )

    def _approach(self, moment: Moment, plan: Approach | None) -> Approach | None:
        """The last progress towards the goal; to one with a heading what is left to turn counts as a way."""
        goal, pose = moment.goal, moment.pose
        if goal is None or goal.heading is None:
            return plan
        last = None if moment.previous is None else moment.previous.approach
        turn = max(abs(kernels.wrapped(pose.heading - goal.heading)) - goal.heading_tolerance, 0.0)
        state, fastest = State(pose.position, pose.velocity), self.vehicle.limits.max_speed
        return approach_of(goal, state, moment.progress, fastest, moment.now, last, self.vehicle.lever * turn)

    def _contact(self, moment: Moment, motions: Array, keep: Array) -> float:
        """Time [s] of the first contact of the body on motions (k, 5), `keep` (b,) [m] being kept."""
        return float(kernels.contact_of(self.vehicle.wheels, motions, *self._scene(moment, keep)))

    def _scene(self, moment: Moment, keep: Array) -> tuple[Hull, Bodies, MaybeHulls]:
        """The arguments of kernels that look for contacts of the body."""
        hull = Hull(self.corners, self._size, PARTS, keep, ADVANCE_SHARE * self._contact_depth, self.horizon)
        return hull, moment.bodies, moment.bodies.hulls


KINDS.update(
    {
        "WayOutcome": WayOutcome,
        **{cls.__name__: cls for cls in (Arc, Bicycle, Command, DifferentialDrive, Following, PointMotion, Pose)},
        **{cls.__name__: cls for cls in (VehicleDecision, VehicleInputs, VehicleNavigator, WayFound)},
    }
)
