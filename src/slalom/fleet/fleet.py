"""Robots that decide together in a loop that belongs to the caller: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, array_of, each_number, flags, has, listing, not_before, whole_numbers
from slalom.decision import Outcome
from slalom.errors import InvalidInput
from slalom.fleet.committed import CommittedFleet
from slalom.fleet.guidance import Guidance
from slalom.fleet.observation import decide_by_sight
from slalom.goal import least_speed, refuse_stop
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import ARRIVE, FOLLOW_VELOCITY
from slalom.linear_forecast import piecewise_polynomial
from slalom.obstacle import Obstacle
from slalom.obstacle.window import Obstacles, fitting
from slalom.path_goal import PathGoal
from slalom.state import State


class FleetDecision(NamedTuple):
    """Commands for n robots until their next decision; rows of robots that are not present are 0.

    Apply one of the three: accelerations, constant over the period; or the velocities or positions to be reached at its
    end, for robots that are controlled by these.
    """

    accelerations: Array  # (n, d) [m/s^2]
    velocities: Array  # (n, d) [m/s]
    positions: Array  # (n, d) [m]
    outcomes: tuple[Outcome | None, ...]  # n, None for a robot that is not present
    stalled: Array  # (n,) [s] since each robot last came nearer to its target, see `Decision.stalled`
    stuck: Flags  # (n,) whether that is at least `stuck_after`: it needs another target

    @property
    def safe(self) -> Flags:
        """Whether each robot stays collision-free up to the horizon as long as the forecasts hold: (n,).

        True for a robot that is not present.
        """
        return np.array([outcome is None or outcome.safe for outcome in self.outcomes], dtype=np.bool_)


class Fleet(CommittedFleet):
    """Robots that decide together, each from its information about the others.

    With `nao_shared` robots receive each other's committed manoeuvres and decide one after the other. With other
    methods each predicts the others from their present states. In a fleet of several methods a robot receives the
    manoeuvre of another only if both have the method `nao_shared`. The result depends neither on threads nor on the
    hash seed. A fleet can be pickled and copied; the copy goes on equal to the bit.

    Args:
        method: a row of the table of methods. shapes, limits, margin, priority: see below.
            Each is one for all robots, or a sequence with one for each.
        robots: their number n, where no sequence is given. names: for messages and manoeuvres; None: numbers.
        obstacles: passive obstacles with their true trajectories, in every world; the method's forecast determines what
            is used.
        period: [s] between decisions. horizon: [s] up to which collisions count.
        margin: [m] to keep from obstacles. Between robots that only observe each other it is larger, by twice
            a (period + delay)^2 and three times the noise. The first is the largest error of a prediction when both
            accelerate by a at most.
        priority: above 0. Of two robots that share the avoidance, robot i does the part s q / (s q + (1 - s) p). Here s
            is the share of its method, p its priority and q that of the other. With published manoeuvres robots decide
            by falling priority, so that one avoids those before it.
        worlds: (n,) whole numbers from 0. Robots of different worlds do not meet: one step serves many environments.
        world_period: (d,) [m] after which the world repeats along each axis, inf where it does not; None: nowhere.
            Robots meet all images of robots and obstacles. Positions are not wrapped.
        holds, patience, detours, stuck_after: see `Navigator`.
        observation_delay: [s] largest age of the observed states of the others. observation_noise: [m] standard
            deviation of that. Both enter the margin.
        sight: what each robot sees of obstacles and, unless it shares its manoeuvres, of other robots; obstacles at
            rest are a known map. None: everything.
        threads: None: one for each core.
        guided: whether each robot heads for a place that guidance chooses on the way to its target. Guided robots go
            around obstacles at rest, pass on traffic circles, and move aside on request, also from their targets.
            Guidance has no part in safety: it is for robots that would block each other. In the plane, in one world;
            for targets only. None: as in the simulator, where that is possible. Several robots in the plane in one
            world are guided at each step with targets, and all others are not.

    Raises:
        InvalidInput: a method for one robot alone; sequences of different lengths; shapes of different dimensions;
            equal names; a period above the horizon; with shared manoeuvres, a horizon shorter than one of them;
            priorities where a method does not share the avoidance, or with a ratio above PRIORITY_RATIO; a period of
            the world below the width of a robot; a sight in space, in several worlds, in a world that repeats, or with
            a hidden speed; guidance in space or in several worlds.
    """

    def __copy__(self) -> Fleet:
        return deepcopy(self)  # a step changes the tables in place

    def step(
        self,
        now: float,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike,
        targets: npt.ArrayLike | None = None,
        *,
        desired_velocities: npt.ArrayLike | None = None,
        accelerations: npt.ArrayLike | None = None,
        tolerances: npt.ArrayLike = 0.2,
        stop: npt.ArrayLike = True,
        paths: Sequence[PathGoal] | None = None,
        present: npt.ArrayLike | None = None,
        headings: npt.ArrayLike | None = None,
        others: Obstacles = (),
    ) -> FleetDecision:
        """Decide for all robots at `now` [s], one period after the last step.

        Args:
            positions, velocities: (n, d) [m], [m/s] as they are now.
            targets: (n, d) [m], positions to be at.
            desired_velocities: (n, d) [m/s], velocities to have, in place of targets.
            paths: n paths to follow, in place of targets. Tolerances and stops are theirs.
            accelerations: (n, d) [m/s^2] applied up to now; None: those of the last decision.
            tolerances: (n,) or one number [m], see `Goal`. stop: (n,) or one, whether to stop at the target.
            present: (n,) whether a robot is in the scene; None: all. A robot joins at its first step in the scene.
            headings: (n,) [rad] of the bodies, for bounds in their frames and the field of view; None: along the
                velocities.
            others: bodies that do not avoid this fleet: observed `Tracks`, or the `manoeuvres` of another fleet.

        Raises:
            InvalidInput: arrays of other shapes, values that are not finite, a tolerance of 0, not one of targets,
                desired velocities and paths, a time before that of the last step, headings in space; no targets for a
                fleet with `guided=True`; a target or a path to stop at for a robot with the bound LeastSpeed.
        """
        # As a float: kernels would be compiled once more for whole numbers.
        self._last = now = not_before(now, self._last, "now", "a step")
        each, n, d = self.table.each, len(self.members.shapes), self.dimension
        there = np.ones(n, np.bool_) if present is None else flags(present, "present", n)
        each["position"][:, :d] = array_of(positions, "positions", (n, d))
        each["velocity"][:, :d] = array_of(velocities, "velocities", (n, d))
        if accelerations is not None:
            each["acceleration"][:, :d] = array_of(accelerations, "accelerations", (n, d))
        each["tolerance"], each["stop"] = each_number(tolerances, "tolerances", n), flags(stop, "stop", n)
        if not np.all(each["tolerance"] > 0.0):
            raise InvalidInput(f"tolerances: expected numbers above 0 m, found {each['tolerance'].min():g} m")
        each["present"] = there
        self.headings = None if headings is None else array_of(headings, "headings", (n,))
        around = [self.obstacles, *fitting(others, self.dimension, now, "others", "fleet")]
        self._head_for(targets, desired_velocities, paths, around, now)
        self._guided = self.guidance is not None and targets is not None
        if self.guidance is not None and self._guided:
            self._guide(self.guidance, now)
        for k in np.flatnonzero(there & ~self._known):
            each["acceleration"][k] = 0.0
            self.begin(int(k), State(each["position"][k, :d], each["velocity"][k, :d]), now)
        self._known[:] = there
        order = _in_turn(self.members.worlds, self._steps)
        self._steps += 1
        outcomes: dict[int, Outcome] = {}
        for policy, some in self.by_policy(order[there[order]]):
            self.observe(policy, now)
            if self.observers:
                outcomes |= decide_by_sight(self, policy, some, self.settings(policy, now), around)
                continue
            bodies = self.grown_bodies(self.window(policy, around, now))
            outcomes |= self.decide(some, self.settings(policy, now), bodies, around)
        return self._decision(there, outcomes, now)

    def _decision(self, there: Flags, outcomes: dict[int, Outcome], now: float) -> FleetDecision:
        """Commands for the robots until the next step."""
        each, d = self.table.each, self.dimension
        velocity, position = self.planned(now + self.period)
        acceleration = (velocity - each["velocity"]) / self.period
        each["acceleration"] = np.where(there[:, None], acceleration, 0.0)
        acceleration, velocity, position = (
            np.where(there[:, None], one, 0.0)[:, :d] for one in (acceleration, velocity, position)
        )
        stalled = self._stalled(there, now)
        found = tuple(outcomes.get(k) for k in range(len(there)))
        return FleetDecision(acceleration, velocity, position, found, stalled, stalled >= self.stuck_after)

    def _stalled(self, there: Flags, now: float) -> Array:
        """Time [s] since each robot last came nearer to its target, or on along its path: (n,)."""
        each, d = self.table.each, self.dimension
        targets, tolerances = each["target"][:, :d].copy(), each["tolerance"]
        if self.guidance is not None and self._guided:
            targets, tolerances = self.guidance.guide.goal[:, :d].copy(), self.guidance.guide.goal_tolerance
        left = np.maximum(np.linalg.norm(targets - each["position"][:, :d], axis=1) - tolerances, 0.0)
        for k, path in enumerate(self._paths):
            targets[k], at = path.points[-1], self.progress[k]
            left[k] = max(path.length - (at or 0.0) - path.tolerance, 0.0)
        left[~there | (each["objective"] != ARRIVE)] = np.nan
        fastest = np.array([limits.max_speed for limits in self.members.limits])
        return self._approaches.stalled(left, targets, tolerances, fastest, now)

    def manoeuvres(self, robots: Sequence[int] | None = None) -> tuple[Obstacle, ...]:
        """The committed manoeuvres of the robots that are present, or of some of them (rows), as obstacles.

        They can be pickled, and passed to another fleet as `others`. Fleets in several processes then take turns. Each
        decides with the manoeuvres of all others that were published before. With `nao_shared` in all of them each
        robot avoids all published manoeuvres, as in one fleet.

        Raises:
            InvalidInput: a fleet with worlds; a robot that was not present in the last step.
        """
        if self.table.each["world"].any():
            raise InvalidInput("worlds: expected one world to publish manoeuvres of, found several")
        committed, d, n = self.table.committed, self.dimension, len(self.members.shapes)
        if robots is None:
            rows = np.flatnonzero(self._known)
        else:
            listing(robots, "numbers of robots", "robots")
            rows = whole_numbers(robots, "robots", len(robots))
        if np.any(rows >= n):
            raise InvalidInput(f"robots: expected numbers below {n}, found {int(np.max(rows))}")
        if not self._known[rows].all():
            absent = int(rows[np.argmin(self._known[rows])])
            raise InvalidInput(f"robots: expected those that were present in the last step, found {absent}")
        return tuple(
            Obstacle(
                self.members.shapes[k],
                piecewise_polynomial(committed.times[k], committed.points[k, ..., :d]),
                self.members.names[k],
            )
            for k in rows
        )

    def _head_for(
        self,
        targets: npt.ArrayLike | None,
        desired_velocities: npt.ArrayLike | None,
        paths: Sequence[PathGoal] | None,
        around: Obstacles,
        now: float,
    ) -> None:
        """Set targets, desired velocities or paths of the robots, see `step`."""
        each, n, d = self.table.each, len(self.members.shapes), self.dimension
        given = {"targets": targets, "desired_velocities": desired_velocities, "paths": paths}
        found = [name for name, value in given.items() if value is not None]
        if len(found) != 1:
            raise InvalidInput(f"targets: expected one of {', '.join(given)}, found {' and '.join(found) or 'none'}")
        if self._targets_only and targets is None:
            raise InvalidInput(f"targets: expected those of a guided fleet, found {found[0]}")
        self._paths = ()
        each["objective"] = ARRIVE if desired_velocities is None else FOLLOW_VELOCITY
        each["max_speed"] = [limits.max_speed for limits in self.members.limits]
        if targets is not None:
            each["target"][:, :d], each["final"] = array_of(targets, "targets", (n, d)), True
            for k in np.flatnonzero(each["stop"]).tolist():
                bound = least_speed(self.members.limits[k])
                if bound is not None:
                    raise InvalidInput(
                        f"stop: expected False for robot {k} with {bound!r}, by which it never stops; found True"
                    )
        elif desired_velocities is not None:
            each["wanted"][:, :d] = array_of(desired_velocities, "desired_velocities", (n, d))
        elif paths is not None:
            listing(paths, f"{n} paths", "paths")
            if len(paths) != n:
                raise InvalidInput(f"paths: expected {n}, found {len(paths)}")
            for k, path in enumerate(paths):
                has(path, ("lookahead", "step"), "a PathGoal", f"paths[{k}]")
                refuse_stop(path, self.members.limits[k], f"paths[{k}]")
            self._paths = tuple(paths)
            # A robot that comes back begins anew.
            self.progress = [at if there else None for at, there in zip(self.progress, each["present"])]
            for policy in self.policies:
                self.follow({k: paths[k] for k in policy.rows.tolist()}, self.window(policy, around, now))

    def _guide(self, guidance: Guidance, now: float) -> None:
        """Replace the targets in the table by those of guidance."""
        each, guide = self.table.each, guidance.guide
        before, joined = guide.position.copy(), each["present"] & ~self._known
        guide.position[:], guide.velocity[:], guide.present[:] = each["position"], each["velocity"], each["present"]
        new = guidance.head_for(each["target"], each["tolerance"], each["stop"], joined)
        guidance.note_arrivals(np.where(new[:, None], guide.position, before))
        guidance.update(now, self.period)
        each["target"], each["tolerance"], each["stop"] = guide.target, guide.tolerance, guide.stop
        each["final"] = (guide.target == guide.goal).all(axis=1)


def _in_turn(worlds: Indices, steps: int) -> Indices:
    """All robots in the order of a step: in each world (n,) another one is the first, as in a fleet of that world."""
    by_world = np.argsort(worlds, kind="stable")
    _, first, counts = np.unique(worlds[by_world], return_index=True, return_counts=True)
    turn = (np.arange(len(worlds)) - np.repeat(first, counts) - steps) % np.repeat(counts, counts)
    return np.asarray(by_world[np.lexsort((turn, worlds[by_world]))])
