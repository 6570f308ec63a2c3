"""Where the robots of a fleet head: positions, goals that may move, paths or velocities, and guidance on the way."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import GOAL, Array, array_of, has, listing
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import PATH_BRAKING
from slalom.decision.tables import target_paths
from slalom.fleet.guidance import Guidance
from slalom.fleet.settings import Members, Policy
from slalom.kernels.arrays import Flags
from slalom.kernels.decision.tables import ARRIVE, FOLLOW_VELOCITY, RobotTable, TargetPaths
from slalom.model.goal import Goal, refuse_goal
from slalom.model.limits import least_speed
from slalom.model.path_goal import PathGoal
from slalom.model.shape import is_round
from slalom.obstacle.window import ObstacleWindow

GOAL_HORIZONS: Final = 100.0
"""[1] Duration of the tables of goals that move, in horizons; later the tables are made anew. Larger: more pieces of
goals that move on curves. Smaller: the tables are made more often. It changes a curve's pieces."""


class Destinations:
    """Where the n robots of a fleet head.

    Attributes:
        guidance: replaces the positions to be at by places on the way; None: none does.
        motion: of goals that move. progress: [m] of each robot along its path; None where it follows none.
    """

    def __init__(self, members: Members, period: float, horizon: float, guidance: Guidance | None, only: bool) -> None:
        self.members, self.guidance = members, guidance
        self.progress: list[float | None] = [None] * len(members.shapes)
        self.motion: TargetPaths
        self._period, self._horizon = period, horizon
        self._guided_only = only
        self._fastest = np.array([limits.max_speed for limits in members.limits])
        self._never_stops = np.array([least_speed(limits) is not None for limits in members.limits])
        # Obstacles are grown once for all round robots, which differ by the margin alone.
        first = next((shape for shape in members.shapes if is_round(shape)), None)
        self._grown_by = [
            (first, shape.bounding_radius - first.bounding_radius) if first and is_round(shape) else (shape, 0.0)
            for shape in members.shapes
        ]
        self._forget()

    def _forget(self) -> None:
        """Have no goals and no paths."""
        self._goals: tuple[Goal, ...] = ()
        self._paths = dict[int, PathGoal]()
        self.guided, self._until = False, -np.inf
        self._before = -np.inf  # [s] of the last step
        self._same = self._moving = np.zeros(len(self.progress), np.bool_)
        self.motion, _ = target_paths([], 0.0, 1.0)

    def set(
        self,
        table: RobotTable,
        now: float,
        *,
        targets: npt.ArrayLike | None = None,
        desired_velocities: npt.ArrayLike | None = None,
        paths: Sequence[PathGoal] | None = None,
        goals: Sequence[Goal] | None = None,
    ) -> None:
        """Write positions, goals or velocities into the table. Guidance leads there by `guide`, paths by `follow`."""
        each, n = table.each, len(self.progress)
        d = self.members.shapes[0].dimension
        given = {"targets": targets, "desired_velocities": desired_velocities, "paths": paths, "goals": goals}
        found = [name for name, value in given.items() if value is not None]
        if len(found) != 1:
            raise InvalidInput(f"targets: expected one of {', '.join(given)}, found {' and '.join(found) or 'none'}")
        if self._guided_only and targets is None and goals is None:
            raise InvalidInput(f"targets: expected those of a guided fleet, found {found[0]}")
        each["objective"] = ARRIVE if desired_velocities is None else FOLLOW_VELOCITY
        each["max_speed"], each["moving"] = self._fastest, False
        goals = goals if paths is None else _checked_paths(paths)
        if goals is not None:
            listing(goals, f"{n} {found[0]}", found[0])
            if len(goals) != n:
                raise InvalidInput(f"{found[0]}: expected {n}, found {len(goals)}")
            self._head_for_goals(table, goals, now, found[0])
            self.guided = self.guidance is not None and len(self._paths) < n
            return
        self._forget()
        if desired_velocities is not None:
            each["wanted"][:, :d] = array_of(desired_velocities, "desired_velocities", (n, d))
            return
        assert targets is not None
        each["target"][:, :d], each["final"] = array_of(targets, "targets", (n, d)), True
        self.guided = self.guidance is not None
        for k in np.flatnonzero(each["stop"] & self._never_stops).tolist():
            bound = least_speed(self.members.limits[k])
            raise InvalidInput(
                f"stop: expected False for robot {k} with {bound!r}, by which it never stops; found True"
            )

    def _head_for_goals(self, table: RobotTable, goals: Sequence[Goal], now: float, name: str) -> None:
        """Head for n goals, of which some may move and some be paths."""
        each, d = table.each, self.members.shapes[0].dimension
        before = self._goals or (None,) * len(goals)
        self._same = np.array([goal is earlier for goal, earlier in zip(goals, before)])
        if not self._same.all():
            for k, (goal, limits) in enumerate(zip(goals, self.members.limits)):
                has(goal, *GOAL, f"{name}[{k}]")
                refuse_goal(goal, limits, f"{name}[{k}]")
            for k, (goal, earlier) in enumerate(zip(goals, before)):
                # Lengths along a path mean nothing on another one.
                if not (isinstance(goal, PathGoal) and goal.is_way_of(earlier)):
                    self.progress[k] = None
            self._goals, self._until = tuple(goals), -np.inf
            self._paths = {k: goal for k, goal in enumerate(goals) if isinstance(goal, PathGoal)}
            self._position = np.array([goal.position(now) for goal in goals])
            self._tolerance = np.array([goal.tolerance for goal in goals])
            self._stop = np.array([goal.stop for goal in goals])
        if now + 2.0 * self._horizon > self._until:
            self._until = now + GOAL_HORIZONS * self._horizon
            self.motion, self._moving = target_paths(goals, now, self._until)
        for k in np.flatnonzero(self._moving).tolist():
            self._position[k] = goals[k].position(now)
        each["target"][:, :d], each["final"] = self._position, True
        each["moving"] = self._moving
        each["tolerance"], each["stop"] = self._tolerance, self._stop

    def guide(self, table: RobotTable, now: float, joined: Flags) -> None:
        """Replace positions to be at by those of guidance; robots that `joined` (n,) or have new goals begin anew."""
        guidance, each = self.guidance, table.each
        if guidance is None or not self.guided:
            return
        guide = guidance.guide
        before = guide.position.copy()
        guide.position[:], guide.velocity[:] = each["position"], each["velocity"]
        guide.present[:] = each["present"]
        away = np.linalg.norm(each["target"] - guide.goal, axis=1)
        new = joined | (~self._same & (away > each["tolerance"]))
        guidance.head_for(each["target"], each["tolerance"], each["stop"], new)
        guidance.note_arrivals(np.where(new[:, None], guide.position, before))
        guidance.update(now, self._period)
        each["target"], each["tolerance"] = guide.target, guide.tolerance
        each["stop"] = guide.stop
        each["final"] = (guide.target == guide.goal).all(axis=1)
        each["moving"] &= each["final"]

    def follow(
        self, table: RobotTable, now: float, policies: Sequence[Policy], window: Callable[[Policy], ObstacleWindow]
    ) -> None:
        """Give robots with paths the targets and maximum speeds of their step `now` [s] among obstacles, by policy."""
        if not self._paths:
            return
        each = table.each
        # A robot that comes back begins anew.
        self.progress = [at if there else None for at, there in zip(self.progress, each["present"])]
        for policy in policies:
            around = None
            for k in [k for k in policy.rows.tolist() if k in self._paths]:
                around = window(policy) if around is None else around
                self._follow(table, now, k, self._paths[k], around)
        self._before = now

    def _follow(self, table: RobotTable, now: float, k: int, path: PathGoal, around: ObstacleWindow) -> None:
        each, d = table.each, self.members.shapes[k].dimension
        limits, shape = self.members.limits[k], self.members.shapes[k]
        grown_by, larger = self._grown_by[k]
        step = path.step(
            each["position"][k, :d],
            self.progress[k],
            limits.max_speed,
            PATH_BRAKING * limits.braking,
            self._period,
            shape.bounding_radius,
            partial(around.covered, robot=grown_by, margin=larger + float(self.members.margins[k])),
            partial(around.covered, robot=grown_by, margin=larger),
            now - self._before,
        )
        path.note(now, each["position"][k, :d].copy(), step.progress, limits.max_speed)
        self.progress[k], each["max_speed"][k] = step.progress, step.max_speed
        each["final"][k] = step.final
        each["target"][k, :d] = step.goal.position(0.0)
        each["tolerance"][k], each["stop"][k] = step.goal.tolerance, step.goal.stop

    def distances(self, table: RobotTable) -> tuple[Array, Array, Array]:
        """Distances (n,) [m] left to the goals or along the paths, the goals (n, d) [m], and their tolerances."""
        each, d = table.each, self.members.shapes[0].dimension
        targets, tolerances = each["target"][:, :d].copy(), each["tolerance"]
        if self.guidance is not None and self.guided:
            targets, tolerances = self.guidance.guide.goal[:, :d].copy(), self.guidance.guide.goal_tolerance
        left = np.maximum(np.linalg.norm(targets - each["position"][:, :d], axis=1) - tolerances, 0.0)
        for k, path in self._paths.items():
            targets[k], at = path.points[-1], self.progress[k]
            left[k] = max(path.length - (at or 0.0) - path.tolerance, 0.0)
        return left, targets, tolerances


def _checked_paths(paths: Sequence[PathGoal]) -> Sequence[PathGoal]:
    listing(paths, "paths", "paths")
    for k, path in enumerate(paths):
        has(path, ("lookahead", "step"), "a PathGoal", f"paths[{k}]")
    return paths
