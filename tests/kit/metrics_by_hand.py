"""Recordings of which the metrics are computed by hand, and the values of these metrics."""

import math

import numpy as np
from parts import disc_or_ball

from slalom import Acceleration, Goal, Limits, Obstacle, Stationary
from slalom.model.shape import round_shape
from slalom.sim import Recording
from slalom.sim.measure.responses import RecordedResponses


def driven(
    accelerations,
    *,
    position=(0.0, 0.0),
    speed=(0.0, 0.0),
    dt: float = 1.0,
    start: float = 0.0,
    radius: float = 0.5,
    goal: Goal | None = None,
    obstacles: tuple[Obstacle, ...] = (),
    outcomes: list[str] | None = None,
) -> Recording:
    """The run of a robot that applied these accelerations."""
    d = len(position)
    accelerations = np.asarray(accelerations, dtype=float).reshape(-1, d)
    goal = goal or Goal(Stationary(np.full(d, 100.0)), 0.5)
    x, v = [np.array(position, dtype=float)], [np.array(speed, dtype=float)]
    for acceleration in accelerations:
        x.append(x[-1] + dt * (v[-1] + 0.5 * dt * acceleration))
        v.append(v[-1] + dt * acceleration)
    times = start + dt * np.arange(len(x))
    done = goal.reached(x[-1], v[-1], float(times[-1]))
    return Recording(
        scenario="by hand",
        method="nao",
        seed=0,
        dt=dt,
        parameters={},
        times=times,
        positions=np.array(x)[:, None],
        velocities=np.array(v)[:, None],
        accelerations=accelerations[:, None],
        controls=accelerations[:, None],
        responses=RecordedResponses.of([(Acceleration(),)] * len(accelerations), 1),
        outcomes=tuple((name,) for name in outcomes or ["CLEAR"] * len(accelerations)),
        decision_times=np.full((len(accelerations), 1), 1e-3),
        shapes=(round_shape(radius, d),),
        limits=(Limits(10.0, 10.0),),
        goals=(goal,),
        arrived=np.array([times[-1] if done else np.inf]),
        obstacles=obstacles,
    )


def rock(position, radius: float = 1.0) -> Obstacle:
    """An obstacle at rest."""
    return Obstacle(disc_or_ball(radius, len(position)), Stationary(position), "rock")


STRAIGHT = driven(
    [(1, 0), (0, 0), (0, 0), (-1, 0)],
    goal=Goal(Stationary((3.5, 0.0)), 0.5, stop=True),
    obstacles=(rock((1.5, 2.0)),),
    outcomes=["CLEAR", "KEPT", "CONTINUED", "CONSTRAINED"],
)
"""x = 0, 0.5, 1.5, 2.5, 3 m with 0, 1, 1, 1, 0 m/s; a rock 2 m beside the way."""
CORNER = driven([(0, 0), (0, 2), (0, 0)], speed=(2, 0), dt=0.5, start=4.0)
"""2 m/s along x; over the second step 1 m/s upwards is added, over the third nothing."""

BY_HAND = [
    ("success", STRAIGHT, 1.0),
    ("success", CORNER, 0.0),
    ("arrived", STRAIGHT, 1.0),
    ("arrived", CORNER, 0.0),
    ("collisions", STRAIGHT, 0.0),
    ("min_clearance", STRAIGHT, 0.5),
    ("min_clearance", CORNER, math.inf),
    ("time", STRAIGHT, 4.0),
    ("time", CORNER, 1.5),
    ("extra_time", STRAIGHT, 4.0 - 0.35),
    ("extra_time", CORNER, math.inf),
    ("path_length", STRAIGHT, 3.0),
    ("path_length", CORNER, 1.0 + math.hypot(1.0, 0.25) + math.hypot(1.0, 0.5)),
    ("spl", STRAIGHT, 1.0),
    ("spl", CORNER, 0.0),
    ("adjustments", STRAIGHT, 3.0),
    ("adjustments", CORNER, 2.0),
    ("adjustment_rate", STRAIGHT, 0.75),
    ("adjustment_rate", CORNER, 2.0 / 1.5),
    ("sign_reversals", STRAIGHT, 0.0),
    ("max_speed", STRAIGHT, 1.0),
    ("max_speed", CORNER, math.sqrt(5.0)),
    ("mean_speed", STRAIGHT, 0.6),
    ("mean_speed", CORNER, (2.0 + 2.0 + 2.0 * math.sqrt(5.0)) / 4.0),
    ("efficacy", STRAIGHT, 3.0 / (4.0 * 10.0)),
    ("efficacy", CORNER, (math.hypot(100, 100) - math.hypot(97.0, 99.25)) / (1.5 * 10.0)),
    ("max_acceleration", STRAIGHT, 1.0),
    ("max_acceleration", CORNER, 2.0),
    ("mean_acceleration", STRAIGHT, 0.5),
    ("mean_acceleration", CORNER, 2.0 / 3.0),
    ("max_jerk", STRAIGHT, 1.0),
    ("max_jerk", CORNER, 4.0),
    ("mean_jerk", STRAIGHT, 2.0 / 3.0),
    ("mean_jerk", CORNER, 4.0),
    ("heading_change", STRAIGHT, 0.0),
    ("heading_change", CORNER, math.atan2(1.0, 2.0)),
    ("stalled_time", STRAIGHT, 1.0),
    ("stalled_time", CORNER, 0.0),
    ("failures_to_progress", STRAIGHT, 0.0),
    ("clearing_distance", STRAIGHT, (math.hypot(1.5, 2) * 2 + math.hypot(1, 2) + 2 + math.hypot(1, 2)) / 5 - 1.5),
    ("clearing_distance", CORNER, math.inf),
    ("space_compliance", STRAIGHT, 1.0),
    ("space_compliance", CORNER, 1.0),
    ("min_time_to_collision", STRAIGHT, (math.hypot(1.0, 2.0) - 1.5) / (1.0 / math.hypot(1.0, 2.0))),
    ("min_time_to_collision", CORNER, math.inf),
    ("without_safe_choice", STRAIGHT, 0.25),
    ("without_safe_choice", CORNER, 0.0),
    ("side_flips", STRAIGHT, 0.0),
    ("side_flips", CORNER, 0.0),
    ("heading_variation", STRAIGHT, 0.0),
    ("heading_variation", CORNER, math.atan2(1.0, 2.0)),
    ("changed_choices", STRAIGHT, 0.5),
    ("changed_choices", CORNER, 1.0),
]
