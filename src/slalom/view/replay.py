"""Figure of a recorded run: one decision of a single robot, or tracks for several robots or a peer."""

import re

import numpy as np
from matplotlib.figure import Figure

from slalom.errors import InvalidInput
from slalom.methods import Method
from slalom.peers import Peer, contender_named
from slalom.sim import Recording, Scenario, decision_at
from slalom.sim.measure.closest_approach import closest_approaches
from slalom.view.figure import decision, paths
from slalom.view.fleet import fleet


def replay(
    recording: Recording,
    scenario: Scenario,
    method: str,
    at: float | None = None,
    names: bool = False,
    uncertainty: bool = False,
) -> Figure:
    """Draw the decision at time `at` [s] after the start; by default the longest held one before the closest approach.

    With several robots, draw the tracks of all, and with `names` their names; with one robot of a peer its track.
    With `uncertainty`, the figure of a decision has the regions that hold obstacles with an uncertainty.

    Raises:
        InvalidInput: a run without a step; a time at which it does not run; a time or uncertainty in a figure of
            tracks; names in one of a decision.
    """
    if not len(recording.accelerations):
        raise InvalidInput("--figure: expected a run with at least one step, found a robot that starts at its goal")
    lasts = float(recording.times[-1] - recording.times[0])
    if at is not None and not 0.0 <= at <= lasts:
        raise InvalidInput(f"--figure-at: expected a time of the run, from 0 to {lasts:g} s, found {at:g} s")
    contender = contender_named(method)
    refuse_unfit(len(recording.shapes), contender, at, names, uncertainty)
    if len(recording.shapes) > 1:
        return fleet(recording, names=names)
    if not isinstance(contender, Method):
        goal = recording.goals[0] if recording.period is None else None
        figure = paths(
            recording.times,
            recording.positions[:, 0],
            recording.obstacles,
            robot=recording.shapes[0],
            goal=goal,
            snapshots=6,
        ).get_figure(root=True)
        assert figure is not None
        return figure
    decided = [k for k, row in enumerate(recording.outcomes) if row[0]]
    if at is None:
        closest = min(closest_approaches(recording), default=None)
        approach_time = closest.time if closest is not None else float(recording.times[0])
        early = [k for k in decided if recording.times[k] <= approach_time] or decided
        tight = [k for k in early if recording.outcomes[k][0] == "CONSTRAINED"] or early
        hold_pattern = re.compile(r"hold=([0-9.]+)")
        step = max(tight, key=lambda k: (float((hold_pattern.findall(recording.responses[k][0]) or [0])[0]), k))
    else:
        step = min(decided, key=lambda k: abs(recording.times[k] - recording.times[0] - at))
    replayed = decision_at(recording, scenario, contender, step)
    elapsed = recording.times[step] - recording.times[0]
    return decision(
        replayed,
        scenario.navigator(contender),
        scenario.robot.goal,
        track=np.asarray(recording.positions[: step + 1, 0]),
        uncertainty=uncertainty,
        title=f"{recording.scenario}, {method}, {elapsed:.1f} s after the start: {replayed.outcome.name.lower()}",
    )


def refuse_unfit(robots: int, contender: Method | Peer, at: float | None, names: bool, uncertainty: bool) -> None:
    """Raise InvalidInput for what the figure of a run does not have: a time or uncertainty of tracks, names of one."""
    if names and robots == 1:
        raise InvalidInput("--names: expected a run of several robots, found one")
    given = {"--figure-at": at is not None, "--uncertainty": uncertainty}
    if robots > 1 or not isinstance(contender, Method):
        found = f"{robots} robots" if robots > 1 else f"a robot with {contender.name}"
        for option in (name for name, yes in given.items() if yes):
            raise InvalidInput(f"{option}: expected a figure of a decision, found one of the tracks of {found}")
