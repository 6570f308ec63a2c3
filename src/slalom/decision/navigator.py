"""Decision of one robot at one step: choose, keep or continue a manoeuvre, fall back, or escape.

The stages of one decision, which `slalom explain --stages` counts and times, and where they begin:

    predict  ObstacleWindow.predicted: obstacles on predicted trajectories                    obstacle/window.py
    gather   PolicyTables.decision: all as tables; obstacle_pieces: bodies in reach, grown    kernels/decision/bodies.py
    keep     keep_committed: whether the present manoeuvre is kept                            kernels/decision/policy.py
    propose  optimistic_costs: preferred control and least cost of each response              kernels/decision/costs.py
    certify  met_by_preferred: whether that is free; free_control: the nearest one that is    kernels/selection/
    choose   best_response: the response that costs least                                     kernels/decision/policy.py
    relax    reduce_margin, most_clearance, latest_collision; fall_back where none is safe    decision/fallback.py
    report   completed: a `Decision` with what the next one needs                             decision/decision.py
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import hypot
from typing import Final

import numpy as np

from slalom import kernels
from slalom.base.checks import GOAL, OBJECTIVE, Array, has, not_negative
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import CONTACT_SLACK, PATH_BRAKING, REST
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.decision.decision import Decision, DecisionInputs, Outcome, completed, made, on_way_to, state_to_decide_from
from slalom.decision.fallback import (
    among_sets,
    escape_velocity,
    least_given_up,
    least_impact,
    leave,
    levels,
    stop,
    time_of,
    way_out,
)
from slalom.decision.methods import refuse_alone
from slalom.decision.objective import Arrive, FollowVelocity, Objective, Situation, needs_goal, preferred_control
from slalom.decision.policy_tables import PolicyTables, Request, observed_robots
from slalom.decision.settings import Settings
from slalom.decision.steady_way import velocity_along
from slalom.decision.tables import committed_path
from slalom.forecast.forecast import FromModels
from slalom.kernels.arrays import Flags
from slalom.kernels.decision.tables import NO_CELLS
from slalom.model.goal import Goal, refuse_goal
from slalom.model.limits import Limits
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal, PathStep
from slalom.model.response import Response
from slalom.model.response.protocol import rest_time
from slalom.model.shape import Shape
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.table import same_dimension
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow, listed

# Checks of the input of each decision.


def goal_or_place(goal: Goal | None, state: State, objective: Objective, limits: Limits) -> Goal:
    """The goal; the position of the robot for an objective that needs none.

    Raises:
        InvalidInput: no goal for an objective that needs one, or one to stop at for a robot that never stops; a goal of
            another dimension than the state.
    """
    if goal is None:
        if needs_goal(objective):
            raise InvalidInput(f"goal: expected one for the objective {objective!r}, found none")
        return Goal(Stationary(state.position))
    has(goal, *GOAL, "goal")
    same_dimension(goal.trajectory.dimension, state.dimension, "goal", "state")
    if needs_goal(objective):
        refuse_goal(goal, limits)
    return goal


def check_dimensions(robot: Shape, state: State, obstacles: ObstacleWindow, others: Tracks | None) -> None:
    """Raise InvalidInput for parts that do not fit the state, and for robots observed after the decision."""
    d = state.dimension
    same_dimension(robot.dimension, d, "robot", "state")
    same_dimension(obstacles.dimension, d, "obstacles", "state")
    if others is not None:
        same_dimension(others.dimension, d, "robots", "state")
        others.refuse_later(obstacles.start, "robots")


OUTCOMES = (
    *(Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT, Outcome.CONTINUED),
    *(Outcome.SQUEEZED, Outcome.DELAYED, Outcome.INTERRUPTED),
    *(Outcome.STOPPING, Outcome.BRAKING, Outcome.IMPACT, Outcome.INADMISSIBLE, Outcome.ESCAPING),
)
"""The outcomes of the compiled policy by number, then those of fallbacks alone."""
CONTINUING = (Outcome.KEPT, Outcome.CONTINUED, Outcome.INTERRUPTED)
"""The outcomes with which the committed manoeuvre goes on."""
ROBOT: Final = np.zeros(1, np.int64)
"""The row of the robot that decides, in its tables."""
FALL_BACK = -1
"""The number of a robot for which the compiled policy has no decision."""


@dataclass(frozen=True)
class Navigator(Settings):
    """Robot that decides with `method`.

    At each decision, responses propose their exact choices, and the one with the earliest predicted arrival is taken.
    The committed manoeuvre is kept while it is safe and a change gains at most the share `patience` of the time.
    Responses are tried in order of optimistic cost (their cost without obstacles). The search ends when none can be
    better than the best by the share MIN_IMPROVEMENT of the shortest response. A robot without a safe proposal
    continues the committed manoeuvre, which remains safe as long as the forecasts hold. If they did not hold,
    requirements are dropped in this order: the margin, the latest collision, the least impact speed. See
    docs/design/0005 and 0012.

    A robot with the bound LeastSpeed has no responses that end at rest. Where no constant velocity is free, in the
    plane, it begins a turn that is free up to the horizon, see `Method.turning`.

    Attributes:
        See `Settings`: method, robot, limits, period, horizon and others.
    """

    @cached_property
    def _alone(self) -> PolicyTables:
        return PolicyTables(self, among=False)

    @cached_property
    def _among(self) -> PolicyTables:
        return PolicyTables(self, among=True)

    def decide(
        self,
        state: State,
        obstacles: Obstacles,
        goal: Goal | None = None,
        *,
        robots: Tracks | None = None,
        now: float = 0.0,
        previous: Decision | None = None,
        objective: Objective | None = None,
        delay: float = 0.0,
        budget: float | None = None,
    ) -> Decision:
        """Decision at time `now` [s] of a robot in `state` that is committed to the manoeuvre of `previous`.

        Args:
            obstacles: a list of obstacles, tables and tracks, or one of these. The method's forecast determines which
                part of their trajectories is used. Walls and known trajectories belong into an `ObstacleTable` that
                is made once, others that are observed anew at each step into `Tracks`.
            goal: the place to reach, with a `PathGoal` along a path; not needed to follow a velocity or acceleration.
            robots: others that decide by the same method, as they are observed. The method sets their part of the
                avoidance, unless they have `Tracks.shares`; with a share of 0 they are obstacles. It also sets the time
                to regain a lost part of the margin, and whether they are predicted to stop at obstacles at rest. The
                margin from all of them grows as in a `Fleet`: they are assumed to accelerate no more than this robot.
            objective: the objective of this decision; None: that of the navigator.
            budget: [s] of work, counted and not measured, so that equal inputs give equal bits on every machine. When
                it is used up, the best manoeuvre found so far is taken. Without any, the committed one continues if it
                is safe (INTERRUPTED). It never ends the search for a first safe manoeuvre. None: no bound.
            delay: [s] age of `state` at `now`, the time at which the decision begins to act. The prediction assumes
                that the robot followed its commitments meanwhile, see `Decision.state_at`; without `previous` it keeps
                its velocity.

        Raises:
            InvalidInput: dimensions that differ; a state with a heading for a robot that is not round: its shape keeps
                the axes of the world; no goal for an objective that has one; a goal at rest to stop at with
                the bound LeastSpeed; an acceleration to follow with a response that does not set the acceleration at
                once; a method that needs more than one robot observes; a time before that of the previous decision, or
                the same for a robot at another position; a delay above the horizon; an obstacle whose trajectory ended.
        """
        refuse_alone(self.method)
        state = state_to_decide_from(state, previous, now, delay, self)
        if objective is not None:
            has(objective, *OBJECTIVE, "objective")
        robot = self if objective is None else replace(self, objective=objective)
        limit = np.inf if budget is None else not_negative(budget, "budget")
        given, checked = goal, None if previous is None else previous.inputs
        if goal is None or checked is None or checked.goal is not goal or checked.navigator is not robot:
            goal = goal_or_place(goal, state, robot.objective, self.limits)
        others, unyielding = (None, None) if robots is None else observed_robots(robots, self.method.robot_forecast)
        listed_obstacles = tuple(listed(obstacles))
        around = (*listed_obstacles, unyielding) if unyielding is not None else listed_obstacles
        window = self.predict(around, state, now)
        check_dimensions(self.robot, state, window, others)
        previous = on_way_to(previous, goal)
        step = self.step_along(goal, state, window, now, previous) if isinstance(goal, PathGoal) else None
        request = Request(robot, around, others, state, goal, step, now, previous, limit)
        arrives = bool(self.limits.bounds) and isinstance(robot.objective, Arrive)
        if arrives and (velocity := velocity_along(state, request.target, self.limits, now)) is not None:
            request = request._replace(robot=replace(robot, objective=FollowVelocity(velocity)))
        decide = self._giving_up if window.has_futures else self._among_obstacles
        if isinstance(self.method.forecast, FromModels) or any(isinstance(one, Tracks) for one in listed_obstacles):
            decision = among_sets(window, robot, state, lambda some: decide(some, request))
        else:
            decision = decide(window, request)
        inputs = DecisionInputs(robot, state, listed_obstacles, given, robots, now, budget, None)
        return completed(decision, inputs, previous, None if step is None else step.progress, limit)

    def step_along(
        self, goal: PathGoal, state: State, window: ObstacleWindow, now: float, previous: Decision | None
    ) -> PathStep:
        """The target of a robot on a path `now` [s] after the `previous` decision, and the largest speed allowed."""
        around = self._alone.reach(state)
        step = goal.step(
            state.position,
            None if previous is None else previous.progress,
            self.limits.max_speed,
            PATH_BRAKING * self.limits.braking,
            self.period,
            self.robot.bounding_radius,
            lambda points: window.covered(points, self.robot, self.margin, around),
            lambda points: window.covered(points, self.robot, 0.0, around),
            # As of the commitment: a file has no more of the decision before.
            None if previous is None else now - previous.commitment.decision.decided_at,
        )
        goal.note(now, state.position, step.progress, self.limits.max_speed)
        return step

    def _giving_up(self, window: ObstacleWindow, request: Request) -> Decision:
        """Decision that avoids all obstacles of the window but for the least probable futures."""
        r = request
        return least_given_up(
            levels(window.obstacles),
            lambda level: self._among_obstacles(window, request, level.given_up),
            self.risk,
            lambda one: time_of(one, r.robot, r.state, r.goal, r.now, window),
        )

    def _among_obstacles(self, window: ObstacleWindow, request: Request, given_up: Flags | None = None) -> Decision:
        """Decision that avoids all obstacles of the window without those given up (n,)."""
        others = request.others
        state = request.state
        now = request.now
        window = window if given_up is None else window.without(given_up)
        found = self._decide(window, request)
        turns = bool(self.turning) and (found is None or not found.safe)
        if others is not None and (found is None or turns):
            window = self.predict([*request.around, others], state, now)
            if given_up is not None:
                window = window.without(np.append(given_up, np.zeros(len(others), np.bool_)))
        if turns:
            found = self._turn(window, request) or found
        if window.is_passive and (found is None or not found.safe):
            found = self._stopping(window, request)
        return found or self._fall_back(window, state, request.goal, now)

    def _decide(self, obstacles: ObstacleWindow, request: Request) -> Decision | None:
        """Decision of the compiled policy; None for a robot that overlaps an obstacle or will at once."""
        others = request.others
        state = request.state
        step = request.step
        now = request.now
        previous = request.previous
        # Behind a leader that may brake it brakes evenly, as among robots: to approach rest needs a longer gap.
        policy, path = self._alone if others is None and not obstacles.leads else self._among, None
        if previous is not None:
            path, end = previous.path, now + 2.0 * self.horizon
            if path is None or (path.times[-1] < now + self.horizon and self.turning):
                # A turn goes on without end; the kernels continue only what ends with a constant velocity.
                path = previous.manoeuvre.path(previous.manoeuvre.start, end)
        until = np.inf if previous is None else previous.manoeuvre.settled_time(self.period, self.horizon)
        table = policy.robots(others, path, until, now)
        robots, own = table
        target = request.target
        # Only a robot that is slow at its target may rest there.
        if previous is not None and target.stop and hypot(*state.velocity) <= 2.0 * target.tolerance:
            # As it was planned: its path has been moved by errors of measured velocities.
            planned = previous.manoeuvre.velocity(now), previous.manoeuvre.acceleration(now)
            own.resting[0] = max(np.abs(planned[0]).max(), np.abs(planned[1]).max()) <= REST
        if step is not None:
            own.max_speed[0], own.final[0] = step.max_speed, step.final
        tables, in_python = policy.decision(table, obstacles, request)
        kernels.decide_all(ROBOT, NO_CELLS, tables)
        if in_python is not None:
            in_python.raise_failure()
        number, work = int(own.outcome[0]), 1e-6 * float(own.work[0])
        path, response = committed_path(robots, 0, state.dimension), policy.responses[own.response[0]]
        control, preferred = own.control.copy(), own.preferred.copy()
        policy.give_back(table)
        if number == FALL_BACK:
            return None
        outcome = OUTCOMES[number]
        if previous is not None and outcome in CONTINUING:
            blocked = partial(self.control_obstacle, policy.responses[0], obstacles, state)
            return Decision(previous.manoeuvre, outcome, previous.manoeuvre.control, blocked, path, work=work)
        margin = 0.0 if outcome in (Outcome.SQUEEZED, Outcome.DELAYED) else self.margin
        return Decision(
            Manoeuvre(response, state, control, now),
            outcome,
            preferred,
            partial(self.control_obstacle, response, obstacles, state, margin),
            path=path,
            work=work,
        )

    @cached_property
    def turning(self) -> tuple[Response, ...]:
        """The responses that end in a turn, of a robot in the plane that must not stop."""
        turning = self.method.turning if self.robot.dimension == 2 else None
        return () if turning is None else turning(self.limits, self.period, self.holds)

    def _turn(self, obstacles: ObstacleWindow, request: Request) -> Decision | None:
        """Decision for the turn without end whose control is nearest to the preferred one; None if none is free.

        With the whole margin or, where no turn keeps it, without any. Among equal ones the first response is taken.
        """
        best: Decision | None = None
        state, least = request.state, np.inf
        situations = [self.situation(one, state, request.target, request.now, obstacles) for one in self.turning]
        preferred = [preferred_control(request.robot.objective.aims(s)) for s in situations]
        for outcome, margin in ((Outcome.CONSTRAINED, self.margin), (Outcome.SQUEEZED, 0.0)):
            for s, control in zip(situations, preferred):
                blocked = self.control_obstacle(s.response, obstacles, state, margin)
                choice = select(control, s.admissible, blocked)
                if choice.control is not None and choice.distance < least:
                    manoeuvre = Manoeuvre(s.response, state, choice.control, request.now)
                    best, least = Decision(manoeuvre, outcome, control, made(blocked)), choice.distance
            if best is not None or margin == 0.0:
                break
        return best

    def _stopping(self, obstacles: ObstacleWindow, request: Request) -> Decision:
        """Decision where nothing is safe, of a robot with passive safety: to be at rest before any contact."""
        state = request.state
        found = self._decide(obstacles.while_moving(), request._replace(others=None))
        if found is not None and found.safe:
            return replace(found, outcome=Outcome.STOPPING)
        situations = self.situations(state, request.goal, request.now)
        soonest = min(
            situations, key=lambda one: (rest_time(one.response, state, self.horizon), one.response.settled(1.0))
        )
        return stop(soonest, self.robot, obstacles)

    def fall_back(self, state: State, obstacles: Obstacles, goal: Goal, *, now: float = 0.0) -> Decision:
        """Decision of a robot that overlaps an obstacle or will at once.

        Raises:
            InvalidInput: as `decide`; no obstacles.
        """
        state_to_decide_from(state, None, now, 0.0, self)
        if not len(listed(obstacles)):
            raise InvalidInput("obstacles: expected at least one to fall back from, found none")
        goal = goal_or_place(goal, state, self.objective, self.limits)
        return self._fall_back(self.predict(obstacles, state, now), state, goal, now)

    def _fall_back(self, obstacles: ObstacleWindow, state: State, goal: Goal, now: float) -> Decision:
        situations = self.situations(state, goal, now)
        overlap_test = ControlObstacle(situations[0].response, state, obstacles, self.robot)
        if len(overlap_test.overlapping):
            return self._escape(situations[0], goal, overlap_test)
        return least_impact(situations[0], self.robot, self.period, obstacles)

    def _escape(self, s: Situation, goal: Goal, overlap_test: ControlObstacle) -> Decision:
        """Decision of a robot that overlaps obstacles: leave them, and get no deeper into any of them if possible."""
        velocity = escape_velocity(s, overlap_test)
        robot = replace(self, objective=FollowVelocity(velocity))
        request = Request(robot, (), None, s.state, goal, None, s.now, None, np.inf)
        found = way_out(s, self.period, overlap_test, lambda window: robot._decide(window, request))
        if found is not None:
            blocked = partial(ControlObstacle, found.manoeuvre.response, s.state, overlap_test.obstacles, self.robot)
            return replace(found, outcome=Outcome.ESCAPING, control_obstacle=blocked)
        return leave(s, self.period, velocity, overlap_test)

    def control_obstacle(
        self, response: Response, obstacles: ObstacleWindow, state: State, margin: float | Array | None = None
    ) -> ControlObstacle:
        """The control obstacle of a response with a margin [m], by default the own, as far as the robot can keep it."""
        clearances = ControlObstacle(response, state, obstacles, self.robot).initial_clearances
        kept = np.clip(clearances - CONTACT_SLACK, 0.0, self.margin if margin is None else margin)
        return ControlObstacle(response, state, obstacles, self.robot, kept)
