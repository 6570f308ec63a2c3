"""Sentences that say why a robot chose its manoeuvre, and the obstacles that decided it."""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.decision import Outcome
from slalom.live.others import OLD, Other
from slalom.live.seen import Seen
from slalom.sim.shape_distance import clearances
from slalom.tolerances import VIEW_APPROACH_SAMPLES, VIEW_BINDING
from slalom.view.kinds import kind


class Meeting(NamedTuple):
    """The closest approach of a manoeuvre to an obstacle."""

    other: int  # row of `Seen.others`
    time: float  # [s] after the decision
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


def reasons(seen: Seen) -> Reasons:
    """Return the reasons of a decision, in the control space that is drawn."""
    quantity, preferred = kind(seen.response), seen.controls.preferred
    times = seen.blocked.times_to_collision(preferred)
    first = int(np.argmin(times)) if np.isfinite(times).any() else -1
    binding = tuple(_binding(seen))
    wanted = f"The preferred {quantity.name} {_numbers(preferred)} {quantity.unit}"
    if first >= 0:
        hit = seen.others[first]
        shared = hit.kind == "robot" and seen.navigator.method.share < 1.0
        # The picture shows the others as predicted; the decision leaves a part of the avoidance to them.
        unless = f" unless {hit.name} takes its share of the avoidance" if shared else ""
        told = f"{wanted} would hit {hit.name} in {times[first]:.1f} s{unless}."
    elif not seen.admissible.contains(preferred):
        told = f"{wanted} hits nothing, but it is outside the limits."
    else:
        told = f"{wanted} hits nothing within {seen.blocked.horizon:g} s."
    sentences = [told]
    if seen.outcome in OLD and seen.manoeuvre is not None and seen.outcome:
        age = seen.time - seen.manoeuvre.start
        sentences.append(f"{Outcome[seen.outcome].value} It is {age:.1f} s old.")
    elif seen.outcome in Outcome.__members__:
        sentences.append(Outcome[seen.outcome].value)
    if binding:
        passed = " and ".join(f"{seen.others[m.other].name} in {m.time:.1f} s" for m in binding[:2])
        least = binding[0].clearance
        closest = f"with {least:.2f} m" if least >= 0.0 else f"and overlaps by {-least:.2f} m"
        sentences.append(f"The manoeuvre passes {passed} {closest}.")
    return Reasons(tuple(sentences), times, first, binding)


def _binding(seen: Seen) -> list[Meeting]:
    """The closest approaches of the manoeuvre that leave little beyond the margin, closest first."""
    if seen.manoeuvre is None or not seen.others:
        return []
    times = seen.time + np.linspace(0.0, seen.blocked.horizon, VIEW_APPROACH_SAMPLES)
    positions = seen.manoeuvre.position(times)
    found = []
    for row, other in enumerate(seen.others):
        meeting = _closest(seen, other, row, times, positions)
        if meeting is not None and meeting.clearance <= other.margin + VIEW_BINDING:
            found.append(meeting)
    return sorted(found, key=lambda meeting: meeting.clearance)


def _closest(seen: Seen, other: Other, row: int, times: Array, positions: Array) -> Meeting | None:
    begin, end = other.obstacle.trajectory.span
    there = (times >= begin) & (times <= end)
    if not there.any():
        return None
    centres = other.obstacle.trajectory.position(times[there])
    away = np.linalg.norm(centres - positions[there], axis=1)
    reach = other.obstacle.shape.bounding_radius + seen.blocked.robot.bounding_radius + other.margin + VIEW_BINDING
    if away.min() > reach:
        return None
    distance = clearances(other.obstacle, seen.blocked.robot, times[there], positions[there])
    k = int(np.argmin(distance))
    return Meeting(row, float(times[there][k] - seen.time), float(distance[k]))


def _numbers(control: Array) -> str:
    return "(" + ", ".join(f"{x:.1f}" for x in np.round(control, 1) + 0.0).replace("-", "−") + ")"
