"""A figure of a recorded run: one decision of a robot alone, the tracks of several or of a peer."""

import re

import numpy as np
from matplotlib.figure import Figure

from slalom.errors import InvalidInput
from slalom.methods import Method
from slalom.peers import contender_named
from slalom.sim import Recording, Scenario, decision_at
from slalom.sim.measure.closest_approach import closest_approaches
from slalom.sim.measure.single_robot_view import single_robot_view
from slalom.view.figure import decision, paths


def replay(recording: Recording, scenario: Scenario, method: str, at: float | None = None) -> Figure:
    """The decision at time `at` [s] after the start, or by default one held long, before the closest approach.

    Of several robots, and with a peer, the track of the first one and where the others were.

    Raises:
        InvalidInput: a run without a step.
    """
    if not len(recording.accelerations):
        raise InvalidInput("--figure: expected a run with at least one step, found a robot that starts at its goal")
    chosen = contender_named(method)
    if len(recording.shapes) > 1 or not isinstance(chosen, Method):
        first = single_robot_view(recording, 0)
        # In a world that repeats goals lie far ahead, for robots to go on and on.
        goal = first.goals[0] if first.period is None else None
        drawn = paths(
            first.times, first.positions[:, 0], first.obstacles, robot=first.shapes[0], goal=goal, snapshots=6
        ).get_figure(root=True)
        assert drawn is not None
        return drawn
    decided = [k for k, row in enumerate(recording.outcomes) if row[0]]
    if at is None:
        closest = min(closest_approaches(recording), default=None)
        when = closest.time if closest is not None else float(recording.times[0])
        early = [k for k in decided if recording.times[k] <= when] or decided
        tight = [k for k in early if recording.outcomes[k][0] == "CONSTRAINED"] or early
        held = re.compile(r"hold=([0-9.]+)")
        step = max(tight, key=lambda k: (float((held.findall(recording.responses[k][0]) or [0])[0]), k))
    else:
        step = min(decided, key=lambda k: abs(recording.times[k] - recording.times[0] - at))
    made = decision_at(recording, scenario, chosen, step)
    elapsed = recording.times[step] - recording.times[0]
    return decision(
        made,
        scenario.navigator(chosen),
        scenario.robot.goal,
        track=np.asarray(recording.positions[: step + 1, 0]),
        title=f"{recording.scenario}, {method}, {elapsed:.1f} s after the start: {made.outcome.name.lower()}",
    )
