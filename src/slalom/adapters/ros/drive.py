"""Figure of a replay: the commands, and the obstacles at the decisions."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from slalom.adapters.ros.node import Command
from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.model.shape import Disc, Shape
from slalom.model.trajectory import Sampled, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks


def figure(commands: Sequence[Command], robot: Shape) -> Any:
    """Draw the states from which a node decided, its commands, and the obstacles as it estimated them.

    Raises:
        InvalidInput: fewer than two commands.
    """
    from slalom.view.figure import driven

    if len(commands) < 2:
        raise InvalidInput(f"--figure: expected at least 2 commands to draw, found {len(commands)}")
    inputs = [command.decision.inputs for command in commands]
    known = [each for each in inputs if each is not None]
    goal = next((each.goal for each in reversed(known) if each.goal is not None), None)
    # Times since the epoch would hide differences of seconds.
    first = known[0].now
    return driven(
        [each.now - first for each in known],
        np.array([each.state.position for each in known]),
        _estimated(known, first),
        robot=robot,
        goal=goal,
        commands={
            "speed [m/s]": np.array([np.linalg.norm(each.linear) for each in commands]),
            "turn rate [rad/s]": np.array([each.angular for each in commands]),
        },
    )


def _estimated(inputs: Sequence[Any], first: float) -> list[Obstacle]:
    """The map of the last decision, and tracked obstacles where they were estimated at each.

    Times are in seconds since `first`.
    """
    seen: dict[object, list[tuple[float, Array, Shape]]] = {}
    for each in inputs:
        for part in each.obstacles:
            if isinstance(part, Tracks):
                for id, state, radius in zip(part.ids, part.states, part.radii):
                    seen.setdefault(id, []).append((each.now - first, state[0], Disc(float(radius))))
            elif isinstance(part, Obstacle):
                seen.setdefault(part.name, []).append(
                    (each.now - first, part.trajectory.position(each.now), part.shape)
                )
    found = [one for part in inputs[-1].obstacles if isinstance(part, ObstacleTable) for one in part.given]
    for id, rows in seen.items():
        times, places, shapes = zip(*rows)
        motion = Sampled(times, np.array(places)) if len(rows) > 1 else Stationary(places[0])
        found.append(Obstacle(shapes[-1], motion, str(id)))
    return found
