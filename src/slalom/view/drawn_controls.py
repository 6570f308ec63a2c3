"""Admissible set, preferred and chosen control of a decision, in the control space that is drawn."""

from typing import NamedTuple

from slalom.checks import Array
from slalom.decision import Decision, Outcome
from slalom.decision.navigator import Navigator
from slalom.goal import Goal
from slalom.limits import Admissible
from slalom.manoeuvre import Manoeuvre
from slalom.objective import Situation, preferred_control
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


def drawn_controls(decision: Decision, navigator: Navigator, goal: Goal) -> DrawnControls:
    """Return the controls of a decision, in the control space of `decision.blocked`."""
    blocked = decision.blocked
    response, state, now = blocked.response, blocked.state, blocked.obstacles.start
    admissible = navigator.limits.admissible(response, state, navigator.horizon)
    preferred = decision.preferred
    if decision.outcome in (Outcome.KEPT, Outcome.CONTINUED, Outcome.INTERRUPTED):
        situation = Situation(response, state, goal, navigator.limits, admissible, now, navigator.horizon)
        preferred = preferred_control(navigator.objective.aims(situation))
    return DrawnControls.of(response, state, admissible, preferred, decision.manoeuvre, now, navigator.period)
