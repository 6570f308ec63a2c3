"""An agent of a recording of tracks as a robot that moves as recorded, among the other agents."""

from typing import Final

import numpy as np

from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import Limits
from slalom.live.recorded import Recorded, last_state
from slalom.methods import Method
from slalom.sim.files.recorded_traffic import MAX_DURATION, Recorded as Tracks
from slalom.sim.measure.run_log import Step
from slalom.sim.scenario import Robot, Scenario
from slalom.state import State
from slalom.trajectory import Stationary

STEP: Final = 0.1
"""[s] Between two states of the replay."""


def as_recorded(tracks: Tracks, method: Method, agent: str | None = None, at: float | None = None) -> Recorded:
    """Return the motion of one agent as a run whose decisions `method` makes in its recorded states.

    Its limits are the largest speed and acceleration of this motion, its goal is where it ends.

    Args:
        agent: id of the agent; by default that of the longest track. at: [s] start of the replay; by default that of
            the track. At most MAX_DURATION is replayed.

    Raises:
        InvalidInput: an unknown id, or a track without a step after `at`.
    """
    names = [obstacle.name for obstacle in tracks.obstacles]
    spans = np.array([obstacle.trajectory.span for obstacle in tracks.obstacles])
    k = int(np.argmax(spans[:, 1] - spans[:, 0]))
    if agent is not None:
        if f"agent {agent}" not in names:
            raise InvalidInput(f"--agent: expected the id of an agent of {tracks.name}, found {agent!r}")
        k = names.index(f"agent {agent}")
    own, others = tracks.obstacles[k], (*tracks.obstacles[:k], *tracks.obstacles[k + 1 :])
    first, last = max(spans[k, 0], -np.inf if at is None else at), spans[k, 1]
    count = int((min(last - first, MAX_DURATION)) / STEP + 1e-9)
    if count < 1:
        where = f"from {spans[k, 0]:g} to {last:g} s" if at is None else f"after {at:g} s"
        raise InvalidInput(f"{own.name}: expected a track of at least {STEP:g} s, found one {where}")
    times = np.minimum(first + STEP * np.arange(count + 1), last)
    positions, velocities = own.trajectory.position(times), own.trajectory.velocity(times)
    accelerations = np.diff(velocities, axis=0) / STEP
    fastest = float(np.linalg.norm(velocities, axis=1).max())
    hardest = float(np.linalg.norm(accelerations, axis=1).max())
    robot = Robot(
        own.shape,
        Limits(max(fastest, 0.1), max(hardest, 0.1)),
        State(positions[0], velocities[0]),
        Goal(Stationary(positions[-1]), 0.5),
        own.name,
    )
    told = f"{own.name} moves as recorded. The control space shows what {method.name} would decide in its place."
    scenario = Scenario(
        tracks.name, (robot,), others, dt=STEP, start=first, duration=count * STEP, notes=(*tracks.notes, told)
    )
    zero = np.zeros((1, tracks.dimension))
    blank = Step(zero, zero, zero, zero, ("",), ("",), np.zeros(1))
    moved = zip(positions[:-1, None], velocities[:-1, None], accelerations[:, None])
    steps = [blank._replace(positions=p, velocities=v, accelerations=a) for p, v, a in moved]
    end = last_state(positions[-1:], velocities[-1:])
    return Recorded(scenario, method, method.name, steps, end, np.full(1, np.inf), ())
