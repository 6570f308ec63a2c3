"""A run as tracks, for files of recordings: the robots, and the obstacles that are round or rectangular."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from slalom.errors import InvalidInput
from slalom.io.recorded import SHOWN, Agent, Tracks, tracks_at
from slalom.shape import Ball, Disc, Rectangle, Shape
from slalom.sim.measure.closest_approach import last_step
from slalom.sim.measure.recording import Recording
from slalom.trajectory import Sampled, Trajectory

ROBOT: Final = "robot"
"""The kind of robots, and what the first is called."""

_ID = re.compile(r"agent (.+)")
_WHOLE = re.compile(r"0|-?[1-9]\d{0,17}")


class _Body(NamedTuple):
    name: str
    shape: Shape
    motion: Trajectory
    kind: str


def as_tracks(recording: Recording, *, frames: bool = False) -> Tracks:
    """The robots of a run and who was there during it, at its steps.

    Times are those of the run; for a file of `frames` they count from its begin. A recorded agent keeps its id, which
    in a file of frames must be a whole number; all others, the robots last, are given the numbers after the largest
    id. Obstacles that are neither round nor rectangles are left out. The notes say which.

    Raises:
        InvalidInput: a run without a step.
    """
    if not len(recording.accelerations):
        raise InvalidInput("run: expected at least one step to write, found a robot that starts at its goal")
    here = [_Body(o.name, o.shape, o.trajectory, "") for o in recording.obstacles if _there(o.trajectory, recording)]
    bodies = [body for body in here if _extents(body.shape) is not None]
    left = [body.name for body in here if _extents(body.shape) is None]
    for k, shape in enumerate(recording.shapes):
        steps = slice(0, last_step(recording, k) + 1)
        motion = Sampled(recording.times[steps], recording.positions[steps, k])
        bodies.append(_Body(f"{ROBOT} {k}" if k else ROBOT, shape, motion, ROBOT))
    labels, notes = _labels([body.name for body in bodies], frames)
    found = tracks_at(recording.times, {label: body.motion for label, body in zip(labels, bodies)})
    by_label = dict(zip(labels, bodies))
    first = float(recording.times[0]) if frames else 0.0
    agents = {label: _agent(by_label[label], agent.trajectory, first) for label, agent in found.agents.items()}
    if left:
        notes.append(f"neither round nor a rectangle, left out: {', '.join(left)}")
    return Tracks(agents, (*notes, *found.notes, *(_placeless(agents.values()) if frames else ())))


def _there(motion: Trajectory, recording: Recording) -> bool:
    first, last = motion.span
    return bool(np.any((recording.times >= first) & (recording.times <= last)))


def _extents(shape: Shape) -> dict[str, float] | None:
    """Radius, or length and width [m]; None of a shape that has neither."""
    if isinstance(shape, Disc | Ball):
        return {"radius": shape.radius}
    if isinstance(shape, Rectangle):
        return {"length": shape.length + 2.0 * shape.radius, "width": shape.width + 2.0 * shape.radius}
    return None


def _agent(body: _Body, track: Sampled, first: float) -> Agent:
    return Agent(Sampled(track.times - first, track.positions), body.kind, **(_extents(body.shape) or {}))


def _labels(names: Sequence[str], whole: bool) -> tuple[list[str], list[str]]:
    """An id for each name, and a note on those that are not in the name."""
    labels: list[str] = []
    for name in names:
        own = _ID.fullmatch(name)
        fits = own is not None and own[1] not in labels and (not whole or _WHOLE.fullmatch(own[1]))
        labels.append(own[1] if own and fits else "")
    free = max((int(label) for label in labels if _WHOLE.fullmatch(label)), default=-1) + 1
    said = []
    for k, name in enumerate(names):
        if not labels[k]:
            labels[k] = str(free)
            said.append(f"{name or 'an obstacle'} is {free}")
            free += 1
    more = f" and {len(said) - SHOWN} more" if len(said) > SHOWN else ""
    return labels, [f"ids: {', '.join(said[:SHOWN])}{more}"] if said else []


def numbered(tracks: Tracks) -> Tracks:
    """The same tracks with whole numbers as ids, as files of frames have them, and notes on what is lost in them."""
    labels, notes = _labels([f"agent {label}" for label in tracks.agents], True)
    lost = (*tracks.notes, *notes, *_placeless(tracks.agents.values()))
    return replace(tracks, agents=dict(zip(labels, tracks.agents.values())), notes=lost)


def _placeless(agents: Iterable[Agent]) -> list[str]:
    """A note on what files of frames have no place for, if there is any."""
    sized = any(agent.radius or agent.length or agent.width or agent.kind for agent in agents)
    return ["sizes and kinds left out: files of frames have no place for them"] if sized else []
