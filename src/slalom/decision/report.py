"""Reports of a decision: the expected collision, the obstacles in the way, a line for a log, a dictionary."""

from collections.abc import Sequence
from dataclasses import replace
from logging import DEBUG, getLogger
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import ObstacleWindow
from slalom.path_goal import PathGoal
from slalom.response import Velocity
from slalom.state import State

if TYPE_CHECKING:
    from slalom.decision.decision import Decision, DecisionInputs

LOGGER = getLogger("slalom")
"""Each decision is one line at level DEBUG."""


class Collision(NamedTuple):
    """A predicted collision."""

    time: float  # [s] absolute
    position: Array  # (d,) [m] of the robot
    obstacle: str  # its name, see `Decision.in_the_way`


def collision_of(decision: "Decision") -> Collision | None:
    """The first collision of the manoeuvre of a decision, from the present state on; None if none is predicted."""
    made = decision.inputs
    if made is None:
        return None
    window, motion = _window(made), decision.manoeuvre.continuation(made.state, made.now)
    blocked = ControlObstacle(motion, made.state, window, made.navigator.robot)
    control = np.zeros(made.state.dimension)
    times = blocked.times_to_collision(control)
    times[blocked.overlapping] = 0.0
    first = int(np.argmin(times)) if len(times) else 0
    if not len(times) or not np.isfinite(times[first]):
        return None
    elapsed = float(times[first])
    place = motion.position(made.state, elapsed)(control)
    return Collision(made.now + elapsed, place, window.obstacles[first].name)


def names_in_the_way(decision: "Decision") -> tuple[str, ...]:
    """Names of the obstacles that a robot meets which drives straight to its goal, in the order of time.

    It drives at its maximum speed, up to the horizon; on a path to the point ahead. Empty without a goal.
    """
    made = decision.inputs
    if made is None or made.goal is None:
        return ()
    navigator, state, goal = made.navigator, made.state, made.goal
    speed, target = navigator.limits.max_speed, goal.position(made.now)
    if isinstance(goal, PathGoal) and decision.progress is not None:
        target = goal.point(min(decision.progress + goal.lookahead * speed, goal.length))
    way = target - state.position
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return ()
    window, velocity = _window(made), way * (speed / length)
    horizon = min(window.horizon, length / speed)
    straight = State(state.position, velocity)
    blocked = ControlObstacle(Velocity(), straight, window, navigator.robot, navigator.margin, horizon)
    times = blocked.times_to_collision(velocity)
    times[blocked.overlapping] = 0.0
    return tuple(window.obstacles[k].name for k in np.argsort(times, kind="stable") if np.isfinite(times[k]))


def _window(made: "DecisionInputs") -> ObstacleWindow:
    """The predicted obstacles and other robots, each with a name."""
    robots = [] if made.robots is None else [made.robots.with_forecast(made.navigator.method.robot_forecast)]
    return made.navigator.predict([*_named(made.obstacles), *robots], made.state, made.now)


def _named(
    obstacles: Sequence[Obstacle | ObstacleTable | Tracks],
) -> list[Obstacle | ObstacleTable | Tracks]:
    """The obstacles, those without a name named by their place."""
    found: list[Obstacle | ObstacleTable | Tracks] = []
    for k, one in enumerate(obstacles):
        if isinstance(one, Obstacle):
            found.append(one if one.name else replace(one, name=f"obstacles[{k}]"))
        elif isinstance(one, ObstacleTable):
            found += [o if o.name else replace(o, name=f"obstacles[{k}][{j}]") for j, o in enumerate(one)]
        else:
            found.append(one)
    return found


def as_dict(decision: "Decision") -> dict[str, Any]:
    """The decision as values of JSON, see `Decision.as_dict`."""
    made, manoeuvre, hit = decision.inputs, decision.manoeuvre, decision.collision
    now = decision.decided_at if made is None else made.now
    result: dict[str, Any] = {
        "time": now,
        "outcome": decision.outcome.name,
        "sentence": decision.outcome.value,
        "safe": decision.safe,
        "probability": decision.probability,
        "response": repr(manoeuvre.response),
        "control": manoeuvre.control.tolist(),
        "preferred": np.asarray(decision.preferred).tolist(),
        "progress": decision.progress,
        "work": decision.work,
        "cut": decision.cut,
        "stalled": decision.stalled,
        "stuck": decision.stuck,
        "in_the_way": list(decision.in_the_way) if decision.stuck else [],
        "collision": None,
    }
    if made is not None:
        result["acceleration"] = manoeuvre.mean_acceleration(now, made.navigator.period).tolist()
    if hit is not None:
        result["collision"] = {"time": hit.time, "position": hit.position.tolist(), "obstacle": hit.obstacle}
    return result


def log(decision: "Decision") -> None:
    """Write one line about a decision to the logger `slalom` at level DEBUG, from values that are already computed."""
    if LOGGER.isEnabledFor(DEBUG):
        made, manoeuvre = decision.inputs, decision.manoeuvre
        LOGGER.debug(
            "decision at %g s: %s, %r %s, work %.2g s, stalled %.3g s",
            decision.decided_at if made is None else made.now,
            decision.outcome.name,
            manoeuvre.response,
            np.round(manoeuvre.control, 6).tolist(),
            decision.work,
            decision.stalled,
        )
