"""Admissible set, preferred and chosen control of a decision, in the control space that is drawn."""

from dataclasses import replace
from typing import NamedTuple

from slalom.checks import Array
from slalom.decision import Decision, Outcome
from slalom.decision.navigator import Navigator
from slalom.goal import Goal
from slalom.limits import Admissible
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Situation, preferred_control
from slalom.obstacle.window import ObstacleWindow
from slalom.path_goal import PathGoal
from slalom.response import Response
from slalom.state import State
from slalom.view.kinds import kind


class DrawnControls(NamedTuple):
    """Controls in the control space that is drawn; `label` describes the chosen one."""

    admissible: Admissible
    preferred: Array
    chosen: Array | None
    label: str

    @classmethod
    def of(
        cls,
        response: Response,
        state: State,
        admissible: Admissible,
        preferred: Array,
        manoeuvre: Manoeuvre | None,
        now: float,
        period: float,
    ) -> "DrawnControls":
        """Return the controls of a robot that is committed to a manoeuvre, in the control space of a response.

        A manoeuvre may belong to another response or an earlier time, where its control has no meaning. The chosen
        control then is the one applied over this period [s].
        """
        if manoeuvre is None:
            return cls(admissible, preferred, None, "")
        if manoeuvre.response == response and (manoeuvre.start == now or response.restartable):
            return cls(admissible, preferred, manoeuvre.control, "chosen")
        applied, quantity = manoeuvre.mean_acceleration(now, period), kind(response).name
        if quantity == "velocity":
            return cls(admissible, preferred, state.velocity + period * applied, "next velocity (manoeuvre kept)")
        if quantity == "acceleration":
            return cls(admissible, preferred, applied, "applied now (manoeuvre kept)")
        return cls(admissible, preferred, None, "")


def target_of(
    goal: Goal, navigator: Navigator, state: State, window: ObstacleWindow, progress: float | None
) -> tuple[Goal, float]:
    """Return what a robot drives to until its next decision, and the largest speed [m/s] there.

    On a path this is a point ahead, as `Navigator.decide` takes it; `progress` [m] is that of the decision, or None.
    """
    limits = navigator.limits
    if not isinstance(goal, PathGoal):
        return goal, limits.max_speed
    step = navigator.step_along(goal, state, window, progress)
    return step.goal, step.max_speed


def preferred_of(navigator: Navigator, situation: Situation, max_speed: float) -> Array:
    """Return the control (d,) that the objective prefers with this largest speed [m/s]."""
    limits = replace(situation.limits, max_speed=max_speed)
    return preferred_control(navigator.objective.aims(replace(situation, limits=limits)))


def drawn_controls(decision: Decision, navigator: Navigator, goal: Goal) -> DrawnControls:
    """Return the controls of a decision, in the control space of `decision.blocked`."""
    blocked = decision.blocked
    response, state, now = blocked.response, blocked.state, blocked.obstacles.start
    admissible = navigator.limits.admissible(response, state, navigator.horizon)
    preferred = decision.preferred
    if decision.outcome in (Outcome.KEPT, Outcome.CONTINUED, Outcome.INTERRUPTED):
        target, max_speed = target_of(goal, navigator, state, blocked.obstacles, decision.progress)
        situation = navigator.situation(response, state, target, now)
        preferred = preferred_of(navigator, situation, max_speed)
    return DrawnControls.of(response, state, admissible, preferred, decision.manoeuvre, now, navigator.period)
