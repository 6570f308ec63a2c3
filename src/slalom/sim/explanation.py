"""Why a robot decided as it did: what it knew, the control space of its manoeuvre, and the reasons in words."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple, cast

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.decision import Decision, Outcome
from slalom.decision.decision import collision_of, not_kept
from slalom.decision.navigator import Navigator
from slalom.decision.objective import Arrive, cost_of, preferred_control
from slalom.model.goal import Goal
from slalom.model.limits import Admissible
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.path_goal import PathGoal
from slalom.model.response import (
    AccelerateThenBrake,
    AccelerateThenCoast,
    AccelerateThenStop,
    Acceleration,
    Jerk,
    LaggedVelocity,
    Response,
    Velocity,
)
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.sim.shape_distance import clearances


class Kind(NamedTuple):
    """Kind of a control: name, letter, unit, and description of the response."""

    name: str
    letter: str
    unit: str
    description: str


def kind(response: Response) -> Kind:
    """Return the kind of the controls of `response`."""
    match response:
        case Velocity():
            words = f"reached in {response.ramp:g} s" if response.ramp else "reached at once"
            return Kind("velocity", "v", "m/s", words)
        case LaggedVelocity():
            return Kind("velocity", "v", "m/s", f"approached with lag {response.lag:.3g} s")
        case Acceleration():
            return Kind("acceleration", "a", "m/s²", "held")
        case AccelerateThenCoast():
            return Kind("acceleration", "a", "m/s²", f"held {response.hold:.3g} s, then coasting")
        case AccelerateThenBrake() | AccelerateThenStop():
            return Kind("acceleration", "a", "m/s²", f"held {response.hold:.3g} s, then braking")
        case AccelerationSequence():
            more = f"then {len(response.then)} more" if response.then else "then coasting"
            return Kind("acceleration", "a", "m/s²", f"held {response.hold:.3g} s, {more}")
        case Jerk():
            return Kind("jerk", "j", "m/s³", "held")
        case _:
            return Kind("control", "u", "control", type(response).__name__)


# What is drawn of a decision: for figures and the view alike.


class Known(NamedTuple):
    """What a robot knew at a decision, and what it decided.

    Attributes:
        goal: what it drove to until the next decision, at most at `max_speed` [m/s].
        blocked: the control obstacle of the decision, or of any response to take its obstacles and margins from.
        preferred: (d,) by the decision; None: that of the objective. manoeuvre: the committed one; None if unknown.
    """

    navigator: Navigator
    goal: Goal
    max_speed: float
    blocked: ControlObstacle
    manoeuvre: Manoeuvre | None
    preferred: Array | None

    @property
    def time(self) -> float:
        """The time [s] of the decision."""
        return self.blocked.obstacles.start


class DrawnControls(NamedTuple):
    """Controls in the control space of `blocked`; `chosen` is None where the chosen control has no meaning."""

    blocked: ControlObstacle
    admissible: Admissible
    preferred: Array
    chosen: Array | None


def known_at(decision: Decision) -> Known:
    """Return what the robot knew at the time of a decision.

    Raises:
        InvalidInput: a decision that no navigator made.
    """
    made, blocked = decision.inputs, decision.blocked
    if made is None:
        raise InvalidInput("decision: expected one that a navigator made, found none of its inputs")
    navigator, state = cast(Navigator, made.navigator), made.state
    if blocked.obstacles.start != made.now:
        # A sequence that is kept holds the control obstacle of its start.
        window = navigator.predict(made.obstacles, state, made.now)
        blocked = navigator.control_obstacle(responses_of(navigator)[0], window, state)
    goal = Goal(Stationary(state.position)) if made.goal is None else made.goal
    max_speed = navigator.limits.max_speed
    if isinstance(goal, PathGoal):
        before = None if made.previous is None else made.previous.decision
        step = navigator.step_along(goal, state, blocked.obstacles, made.now, before)
        goal, max_speed = step.goal, step.max_speed
    return Known(navigator, goal, max_speed, blocked, decision.manoeuvre, decision.preferred)


def beginning_of(decision: Decision) -> Known:
    """Return what the robot knew when it began the manoeuvre of a decision; that of now if that decision is unknown."""
    begun = decision.begun
    return known_at(decision if begun is None or begun.inputs is None or begun.control_obstacle is not_kept else begun)


def drawn_controls(known: Known, response: Response | None = None) -> DrawnControls:
    """Return the controls of a decision in the control space of a response; None: of that of its control obstacle.

    The chosen control has a meaning only in the control space from which it was chosen: of its response, at its start.
    """
    navigator, begun = known.navigator, known.manoeuvre
    blocked, state = known.blocked, known.blocked.state
    if response is not None and response != blocked.response:
        blocked = navigator.control_obstacle(response, blocked.obstacles, state, np.asarray(blocked.margin))
    own = begun is not None and begun.start == known.time and begun.response == blocked.response
    preferred = known.preferred if own else None
    if preferred is None:
        situation = navigator.situation(blocked.response, state, known.goal, known.time, blocked.obstacles)
        limits = replace(situation.limits, max_speed=known.max_speed)
        preferred = preferred_control(navigator.objective.aims(replace(situation, limits=limits)))
    admissible = navigator.limits.admissible(blocked.response, state, navigator.horizon)
    return DrawnControls(blocked, admissible, preferred, begun.control if own and begun is not None else None)


def responses_of(navigator: Navigator) -> tuple[Response, ...]:
    """Return the responses that a robot compares."""
    return navigator.method.responses(navigator.limits, navigator.period, navigator.holds)


BINDING: Final = 0.02
"""[m] A chosen manoeuvre is said to pass an obstacle closely up to this clearance beyond the margin. Larger: more
obstacles are named as reasons of a choice. Smaller: one that limits the choice may be left out."""

APPROACH_SAMPLES: Final = 241
"""[1] Times at which the closest approach of a manoeuvre to an obstacle is sought, for a sentence of a view. Larger: a
more exact time in the sentence. Smaller: a less exact one."""


class Meeting(NamedTuple):
    """The closest approach of a manoeuvre to an obstacle."""

    other: int  # row of the others
    time: float  # [s] after the start of the manoeuvre
    clearance: float  # [m] between the surfaces


class Reasons(NamedTuple):
    """Why a robot chose its manoeuvre.

    Attributes:
        sentences: for the user. contact_times: (n,) [s] of contact with each other under the preferred control.
        first: row of the first one that it hits; -1 if it hits none. binding: those that the manoeuvre passes closely.
    """

    sentences: tuple[str, ...]
    contact_times: Array
    first: int
    binding: tuple[Meeting, ...]


class Met(NamedTuple):
    """An obstacle or another robot, and the share [1] of the avoidance that the robot does itself."""

    name: str
    obstacle: Obstacle
    share: float = 1.0


def unchanged(blocked: ControlObstacle) -> Array:
    """Return the control (d,) that changes nothing: of the change from it a robot makes its share of the avoidance."""
    return blocked.state.velocity if isinstance(blocked.response, Velocity) else np.zeros(blocked.dimension)


def whole(blocked: ControlObstacle, controls: Array, share: float) -> Array:
    """Return the controls (..., d) that do all of an avoidance of which `controls` do a share."""
    kept = unchanged(blocked)
    return np.asarray(kept + (controls - kept) / share)


def contact_times(blocked: ControlObstacle, controls: Array, shares: Sequence[float]) -> Array:
    """Return the time of the first contact for controls (..., d) with each other: (..., n) [s], inf if there is none.

    For robots that share the avoidance, of the whole of it.
    """
    times, own = blocked.times_to_collision(controls), np.asarray(shares, dtype=np.float64)
    for share in set(own[own < 1.0].tolist()):
        times[..., own == share] = blocked.times_to_collision(whole(blocked, controls, share))[..., own == share]
    return times


def reasons(drawn: DrawnControls, others: Sequence[Met], outcome: str, age: float) -> Reasons:
    """Return the reasons of a decision whose manoeuvre began `age` [s] before, in the control space that is drawn."""
    blocked, preferred = drawn.blocked, drawn.preferred
    quantity = kind(blocked.response)
    times = contact_times(blocked, preferred, [other.share for other in others])
    first = int(np.argmin(times)) if np.isfinite(times).any() else -1
    binding = tuple(_binding(drawn, others))
    wanted = f"The preferred {quantity.name} {_numbers(preferred)} {quantity.unit}"
    if first >= 0:
        hit = others[first]
        # The robot makes a part of the change that avoids the contact, and the other one the rest.
        unless = f" even if {hit.name} takes its share of the avoidance" if hit.share < 1.0 else ""
        told = f"{wanted} would hit {hit.name} in {times[first]:.1f} s{unless}."
    elif not drawn.admissible.contains(preferred):
        told = f"{wanted} hits nothing, but it is outside the limits."
    else:
        told = f"{wanted} hits nothing within {blocked.horizon:g} s."
    sentences = [told]
    if outcome in Outcome.__members__:
        sentences.insert(0, Outcome[outcome].value)
    if age > 0.0 and drawn.chosen is not None:
        sentences.insert(1, f"It began {age:.1f} s ago, and its control space is that of then.")
    elif age > 0.0:
        sentences.insert(1, f"It began {age:.1f} s ago; its control has no place in this control space.")
    if binding:
        passed = " and ".join(f"{others[m.other].name} in {m.time:.1f} s" for m in binding[:2])
        least = binding[0].clearance
        closest = f"with {least:.2f} m" if least >= 0.0 else f"and overlaps by {-least:.2f} m"
        sentences.append(f"The manoeuvre passes {passed} {closest}.")
    return Reasons(tuple(sentences), times, first, binding)


def _binding(drawn: DrawnControls, others: Sequence[Met]) -> list[Meeting]:
    """The closest approaches of the manoeuvre that leave little beyond the margin, closest first."""
    blocked, chosen = drawn.blocked, drawn.chosen
    found = list[Meeting]()
    if chosen is None:
        return found
    state = blocked.state
    elapsed = np.linspace(0.0, blocked.horizon, APPROACH_SAMPLES)
    times, image = blocked.obstacles.start + elapsed, blocked.response.position(state, elapsed)
    controls = {share: whole(blocked, chosen, share) for share in {other.share for other in others}}
    least = {share: blocked.clearances(control) for share, control in controls.items()}
    for row, other in enumerate(others):
        control, obstacle = controls[other.share], other.obstacle
        if least[other.share][row] > BINDING:
            continue
        positions = image(control)
        moving = np.linalg.norm(np.gradient(positions, axis=0), axis=1) > 1e-9
        begin, end = obstacle.trajectory.span
        there = (times >= begin) & (times <= end) & (moving | obstacle.contact_at_rest)
        if there.any():
            distance = clearances(obstacle, blocked.robot, times[there], positions[there])
            if obstacle.uncertainty is not None:
                d = state.dimension
                distance = distance - [float(obstacle.uncertainty.radius(t, d)) for t in elapsed[there].tolist()]
            k = int(np.argmin(distance))
            found.append(Meeting(row, float(elapsed[there][k]), float(distance[k])))
    return sorted(found, key=lambda meeting: meeting.clearance)


def _numbers(control: Array) -> str:
    return "(" + ", ".join(f"{x:.1f}" for x in np.round(control, 1) + 0.0).replace("-", "−") + ")"


AT_LIMIT: Final = 1e-3
"""[1] Share of a limit up to which a manoeuvre is said to reach it. Larger: more limits are named. Smaller: fewer."""


def reasons_of(decision: Decision) -> tuple[Reasons, list[Met]]:
    """Return the reasons of a decision of one robot, and the obstacles that their rows name.

    Raises:
        InvalidInput: a decision that no navigator made.
    """
    drawn, age = drawn_controls(beginning_of(decision)), known_at(decision).time - decision.manoeuvre.start
    obstacles = drawn.blocked.obstacles.obstacles
    others = [Met(one.name or f"obstacle {k}", one) for k, one in enumerate(obstacles)]
    return reasons(drawn, others, decision.outcome.name, age), others


def explanation(decision: Decision) -> dict[str, Any]:
    """Return why a robot decided as it did, as values of JSON.

    `sentences`; `preferred_hits`: the first obstacle that the preferred control hits, or None; `passes`: the obstacles
    that the manoeuvre passes closely, closest first; `limits` that it reaches; `cost` of the manoeuvre from now on, for
    the default objective the time [s] to the goal; `alternatives`: the best safe control of each response now, with its
    cost. Other times are from the beginning of the manoeuvre on, `began` [s].

    Raises:
        InvalidInput: a decision that no navigator made.
    """
    now, (found, others) = known_at(decision), reasons_of(decision)
    limits, alternatives = _limits_reached(decision, now), _alternatives(now)
    cost, made = _cost(now, decision.manoeuvre, responses_of(now.navigator)[0]), decision.manoeuvre
    sentences = [*found.sentences, *_changed(decision)]
    if limits:
        sentences.append(f"It reaches {' and '.join(limits)}.")
    verb, unit = ("arrives in", " s") if isinstance(now.navigator.objective, Arrive) else ("costs", "")
    own = f"{'Kept' if made.start < now.time else 'Chosen'} {_named(made.response)}"
    each = [(own, cost), *((f"Alternative {one['response']}", one["cost"]) for one in alternatives)]
    for name, value in each:
        sentences.append(f"{name}: {'no safe control' if value is None else f'{verb} {value:.2f}{unit}'}.")
    if decision.contact is not None:
        contact = decision.contact
        sentences.append(
            f"A contact within {contact.seconds:.1f} s has a probability of {100.0 * contact.probability:.1f} %, "
            f"most likely with {contact.obstacle}."
        )
    first = found.first
    hit = {"obstacle": others[first].name, "time": float(found.contact_times[first])} if first >= 0 else None
    return {
        "began": decision.manoeuvre.start,
        "sentences": sentences,
        "preferred_hits": hit,
        "passes": [
            {"obstacle": others[one.other].name, "time": one.time, "clearance": one.clearance} for one in found.binding
        ],
        "limits": limits,
        "cost": cost,
        "alternatives": alternatives,
        "in_the_way": list(decision.in_the_way),
    }


def _changed(decision: Decision) -> list[str]:
    """What became of the manoeuvre before, in a sentence; none for a kept or a first manoeuvre."""
    made = decision.inputs
    before = None if made is None else made.previous
    if made is None or before is None or before.manoeuvre is decision.manoeuvre:
        return []
    hit = collision_of(replace(decision, manoeuvre=before.manoeuvre))
    would = "is still free" if hit is None else f"would hit {hit.obstacle} in {hit.time - made.now:.1f} s"
    return [f"The manoeuvre before, of {made.now - before.manoeuvre.start:.1f} s ago, {would}."]


def _limits_reached(decision: Decision, now: Known) -> list[str]:
    """Names of the limits that the manoeuvre reaches from now on within the horizon."""
    limits = now.navigator.limits
    times = now.time + np.linspace(0.0, now.navigator.horizon, APPROACH_SAMPLES)
    reached = []
    for name, values in (
        ("max_speed", decision.manoeuvre.velocity),
        ("max_acceleration", decision.manoeuvre.acceleration),
    ):
        most = float(np.linalg.norm(values(times), axis=-1).max())
        if most >= (1.0 - AT_LIMIT) * getattr(limits, name):
            reached.append(name)
    return reached


def _alternatives(now: Known) -> list[dict[str, Any]]:
    """The safe control of each response that is nearest to its preferred one, and the cost of its manoeuvre."""
    navigator, found = now.navigator, list[dict[str, Any]]()
    state = now.blocked.state
    for response in responses_of(navigator):
        drawn = drawn_controls(now._replace(manoeuvre=None), response)
        control = select(drawn.preferred, drawn.admissible, drawn.blocked).control
        one: dict[str, Any] = {"response": _named(response), "control": None, "cost": None}
        if control is not None:
            cost = _cost(now, Manoeuvre(response, state, control, now.time), response)
            one |= {"control": control.tolist(), "cost": cost}
        found.append(one)
    return found


def _named(response: Response) -> str:
    words = kind(response)
    return f"{words.name} {words.description}"


def _cost(now: Known, manoeuvre: Manoeuvre, response: Response) -> float:
    """The cost of a manoeuvre from now on, in the situation of a response."""
    navigator = now.navigator
    situation = navigator.situation(response, now.blocked.state, now.goal, now.time, now.blocked.obstacles)
    until = max(manoeuvre.settled_time(navigator.period, navigator.horizon), now.time + navigator.period)
    return cost_of(navigator.objective, manoeuvre, situation, until)
