"""Robots that decide together in a loop that belongs to the caller: arrays in, arrays out."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, array, array_of, number
from slalom.decision import Outcome
from slalom.errors import InvalidInput
from slalom.fleet.committed import CommittedFleet, first_manoeuvre
from slalom.navigator_tables import ARRIVE, FOLLOW_VELOCITY
from slalom.obstacle_window import Obstacles, ObstacleWindow
from slalom.path_goal import PathGoal
from slalom.state import State
from slalom.tracks import Tracks


class FleetDecision(NamedTuple):
    """What n robots do until their next decision; rows of robots that are not present are 0.

    Apply one of the three: accelerations, constant over the period; or the velocities or positions to be reached at its
    end, for robots that are controlled by these.
    """

    accelerations: Array  # (n, d) [m/s^2]
    velocities: Array  # (n, d) [m/s]
    positions: Array  # (n, d) [m]
    outcomes: tuple[Outcome | None, ...]  # n, None for a robot that is not present


class Fleet(CommittedFleet):
    """Robots that decide by one method, each from what it knows of the others.

    With `nao_shared` robots know each other's committed manoeuvres and decide one after the other; with other methods
    each predicts the others from their present states. The result depends neither on threads nor on the hash seed. A
    fleet can be pickled and copied; it goes on equal to the bit.

    Args:
        method: a row of the table of methods.
        shapes, limits: one for all robots, or a sequence with one for each.
        robots: their number n, where neither `shapes` nor `limits` is a sequence. names: for messages; None: numbers.
        obstacles: passive obstacles with their true trajectories; the method's forecast determines what is used.
        period: [s] between decisions. horizon: [s] up to which collisions count.
        margin: [m] to keep from obstacles. Between robots that only observe each other twice a period^2 is added, the
            largest error of a prediction over one period when both accelerate by a at most.
        holds, patience, detours: see `Navigator`. threads: None: one for each core.

    Raises:
        InvalidInput: a method for one robot alone; sequences of different lengths; shapes of different dimensions; with
            shared manoeuvres, a horizon shorter than one of them.
    """

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
        others: Tracks | None = None,
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
            others: robots and people that are observed and are not expected to avoid this fleet.

        Raises:
            InvalidInput: arrays of other shapes, values that are not finite, not one of targets, desired velocities and
                paths, a time before that of the last step.
        """
        if number(now, "now") < self._last:
            raise InvalidInput(
                f"now: expected a time that does not run backwards, found {now:g} s after a step at {self._last:g} s"
            )
        self._last = now
        table, n, d = self.table, len(self.limits), self.dimension
        there = np.ones(n, np.bool_) if present is None else np.asarray(present, dtype=np.bool_)
        if there.shape != (n,):
            raise InvalidInput(f"present: expected {n} flags, found an array of shape {there.shape}")
        table.position[:, :d] = array_of(positions, "positions", (n, d))
        table.velocity[:, :d] = array_of(velocities, "velocities", (n, d))
        if accelerations is not None:
            table.acceleration[:, :d] = array_of(accelerations, "accelerations", (n, d))
        table.tolerance[:], table.stop[:], table.present[:] = array(tolerances, "tolerances"), stop, there
        around: Obstacles = self.obstacles if others is None else [self.obstacles, others]
        window = ObstacleWindow.predicted(around, self.method.forecast, now, self.horizon)
        self._head_for(targets, desired_velocities, paths, window)
        for k in np.flatnonzero(there & ~self._known):
            self._join(int(k), now)
        self._known[:] = there
        self.observe(now)

        def fall_back(k: int) -> Outcome:
            return self.fall_back(k, around, now)

        order = np.roll(np.arange(n), -(self._steps % n))
        self._steps += 1
        outcomes = self.decide(order[there[order]], self.settings(now), self.grown_bodies_of(window), fall_back)
        velocity, position = self.planned(now + self.period)
        acceleration = (velocity - table.velocity) / self.period
        table.acceleration[:] = np.where(there[:, None], acceleration, 0.0)
        acceleration, velocity, position = (
            np.where(there[:, None], each, 0.0)[:, :d] for each in (acceleration, velocity, position)
        )
        return FleetDecision(acceleration, velocity, position, tuple(outcomes.get(k) for k in range(n)))

    def _head_for(
        self,
        targets: npt.ArrayLike | None,
        desired_velocities: npt.ArrayLike | None,
        paths: Sequence[PathGoal] | None,
        window: ObstacleWindow,
    ) -> None:
        """Set what the robots are to do, see `step`."""
        table, n, d = self.table, len(self.limits), self.dimension
        given = {"targets": targets, "desired_velocities": desired_velocities, "paths": paths}
        found = [name for name, value in given.items() if value is not None]
        if len(found) != 1:
            raise InvalidInput(f"targets: expected one of {', '.join(given)}, found {' and '.join(found) or 'none'}")
        table.objective[:] = ARRIVE if desired_velocities is None else FOLLOW_VELOCITY
        table.max_speed[:] = [limits.max_speed for limits in self.limits]
        if targets is not None:
            table.target[:, :d], table.final[:] = array_of(targets, "targets", (n, d)), True
        elif desired_velocities is not None:
            table.wanted[:, :d] = array_of(desired_velocities, "desired_velocities", (n, d))
        elif paths is not None:
            if len(paths) != n:
                raise InvalidInput(f"paths: expected {n}, found {len(paths)}")
            # A robot that comes back begins anew.
            self.progress = [at if there else None for at, there in zip(self.progress, table.present)]
            self.follow(dict(enumerate(paths)), window)

    def _join(self, k: int, now: float) -> None:
        """Commit a robot that comes into the scene to its first manoeuvre."""
        table, d = self.table, self.dimension
        table.acceleration[k] = 0.0
        state = State(table.position[k, :d], table.velocity[k, :d])
        self.commit(k, first_manoeuvre(state, self.limits[k], self.period, now), now)
        # A shared manoeuvre commits a robot from the begin; an observed robot is free to change its first one.
        table.regret[k] = 0.0 if self.method.shared else np.inf
