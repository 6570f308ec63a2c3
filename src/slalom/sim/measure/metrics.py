"""Metrics of a recording: one pure function per metric, with definitions from the literature.

Francis et al. 2023 (arXiv:2306.16740, table 1) for success, stalled time, failure to progress, path length, SPL, space
compliance, clearing distance, time to collision; the number of adjustments is the paper's (arXiv:2506.06255).
All metrics are of robot 0 of the recording; see `single_robot_view` for other robots. `summary` is of all.
"""

from collections import Counter
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from slalom.checks import Array
from slalom.decision import Outcome
from slalom.obstacle import Obstacle
from slalom.sim.measure.closest_approach import between_robots, closest_approaches, nearest_images, positions_at
from slalom.sim.measure.oscillation import changed_choices, heading_variation, side_flips
from slalom.sim.measure.recording import Recording
from slalom.sim.measure.run_summary import RunSummary
from slalom.sim.shape_distance import clearances
from slalom.tolerances import (
    ADJUSTMENT,
    CLOSING_INTERVAL,
    COLLISION,
    PERSONAL_SPACE,
    PROGRESS_DISTANCE,
    PROGRESS_TIME,
    STALLED_SPEED,
)


def arrived(recording: Recording | RunSummary) -> float:
    """Return 1 if the robot reached its goal within the duration, else 0."""
    return float(np.isfinite(recording.arrived[0]))


def collisions(recording: Recording) -> float:
    """Number of obstacles that the robot overlapped by more than COLLISION at some time of the run."""
    return float(sum(closest.clearance < -COLLISION for closest in closest_approaches(recording)))


def min_clearance(recording: Recording) -> float:
    """Least clearance between surfaces [m], in continuous time; inf without obstacles."""
    return min((closest.clearance for closest in closest_approaches(recording)), default=np.inf)


def success(recording: Recording) -> float:
    """Return 1 if the robot arrived without a collision, else 0."""
    return float(arrived(recording) and not collisions(recording))


def time(recording: Recording | RunSummary) -> float:
    """Time to the goal [s]; duration of the run if the goal was not reached."""
    return float(recording.times[-1] - recording.times[0])


def extra_time(recording: Recording, robot: int = 0) -> float:
    """Time to arrival minus the time of the straight path at maximum speed [s]; inf if the robot did not arrive.

    The path leads from the start to the initial position of the goal (gym-collision-avoidance's extra time to goal).
    """
    begin = float(recording.times[0])
    distance = float(np.linalg.norm(recording.goals[robot].position(begin) - recording.positions[0, robot]))
    return float(recording.arrived[robot]) - begin - distance / recording.limits[robot].max_speed


def path_length(recording: Recording) -> float:
    """Sum of the distances between steps [m]."""
    return float(np.linalg.norm(np.diff(recording.positions[:, 0], axis=0), axis=1).sum())


def spl(recording: Recording) -> float:
    """Success weighted by path length: straight distance over the larger of straight distance and path length.

    The success of a robot that starts at its goal counts in full.
    """
    goal = recording.goals[0]
    start = recording.positions[0, 0]
    straight = float(np.linalg.norm(goal.position(recording.times[-1]) - start)) - goal.tolerance
    longer = max(path_length(recording), straight)
    return success(recording) * straight / longer if straight > 0.0 else success(recording)


def adjustments(recording: Recording, robot: int = 0) -> float:
    """Number of steps at which the applied acceleration changes by more than ADJUSTMENT."""
    change = np.diff(recording.accelerations[:, robot], axis=0, prepend=np.zeros((1, recording.dimension)))
    return float((np.linalg.norm(change, axis=1) > ADJUSTMENT).sum())


def adjustment_rate(recording: Recording) -> float:
    """Adjustments per second."""
    return adjustments(recording) / max(time(recording), recording.dt)


def sign_reversals(recording: Recording) -> float:
    """Number of steps at which the acceleration turns by more than a right angle."""
    a = recording.accelerations[:, 0]
    return float((np.sum(a[1:] * a[:-1], axis=1) < 0).sum()) if len(a) > 1 else 0.0


def max_speed(recording: Recording) -> float:
    """Largest speed [m/s]; the speed of a parabola is largest at a step."""
    return float(np.linalg.norm(recording.velocities[:, 0], axis=1).max())


def mean_speed(recording: Recording) -> float:
    """Mean speed over the steps [m/s]."""
    return float(np.linalg.norm(recording.velocities[:, 0], axis=1).mean())


def max_acceleration(recording: Recording) -> float:
    """Largest applied acceleration [m/s^2]."""
    return float(np.linalg.norm(recording.accelerations[:, 0], axis=1).max(initial=0.0))


def mean_acceleration(recording: Recording) -> float:
    """Mean applied acceleration [m/s^2]."""
    norms = np.linalg.norm(recording.accelerations[:, 0], axis=1)
    return float(norms.mean()) if norms.size else 0.0


def efficacy(recording: Recording, robot: int = 0) -> float:
    """Mean rate of approach to the goal until arrival, as a share of the maximum speed; 1 is ideal.

    It equals the mean projection of the velocity on the desired direction (navground's efficacy).
    """
    end = min(float(recording.arrived[robot]), float(recording.times[-1]))
    duration, goal = end - float(recording.times[0]), recording.goals[robot]
    if duration <= 0.0:
        return 1.0
    robot_positions = positions_at(recording, robot, np.array([recording.times[0], end]))
    distances = np.linalg.norm(goal.position(np.array([recording.times[0], end])) - robot_positions, axis=-1)
    return float((distances[0] - distances[1]) / (duration * recording.limits[robot].max_speed))


def _jerks(recording: Recording) -> Array:
    return np.asarray(np.linalg.norm(np.diff(recording.accelerations[:, 0], axis=0), axis=1) / recording.dt)


def max_jerk(recording: Recording) -> float:
    """Largest change of the acceleration from one step to the next, over dt [m/s^3]."""
    return float(_jerks(recording).max(initial=0.0))


def mean_jerk(recording: Recording) -> float:
    """Mean change of the acceleration from one step to the next, over dt [m/s^3]."""
    jerks = _jerks(recording)
    return float(jerks.mean()) if jerks.size else 0.0


def heading_change(recording: Recording) -> float:
    """Sum of the absolute changes of the direction of the velocity [rad]."""
    v = recording.velocities[:, 0]
    v = v[np.linalg.norm(v, axis=1) > 1e-9]
    unit = v / np.linalg.norm(v, axis=1, keepdims=True)
    return float(np.arccos(np.clip(np.sum(unit[1:] * unit[:-1], axis=1), -1.0, 1.0)).sum())


def stalled_time(recording: Recording) -> float:
    """Time with a speed below STALLED_SPEED [s]."""
    return float((np.linalg.norm(recording.velocities[:-1, 0], axis=1) < STALLED_SPEED).sum() * recording.dt)


def failures_to_progress(recording: Recording) -> float:
    """Number of intervals of PROGRESS_TIME in which the robot approaches its goal by less than PROGRESS_DISTANCE."""
    goal = recording.goals[0].position(recording.times)
    distance = np.linalg.norm(goal - recording.positions[:, 0], axis=1)[:: max(1, round(PROGRESS_TIME / recording.dt))]
    return float((distance[:-1] - distance[1:] < PROGRESS_DISTANCE).sum())


def _bodies(recording: Recording) -> list[Obstacle]:
    """Return all obstacles; in a periodic world, their images that are nearest at some time of the run."""
    return [image for obstacle in recording.obstacles for image in nearest_images(recording, 0, obstacle)]


def _clearances_at_steps(recording: Recording) -> Array:
    """Return the clearance (T + 1,) [m] to the nearest obstacle at each step; inf without obstacles."""
    nearest = np.full(len(recording.times), np.inf)
    for obstacle in _bodies(recording):
        first, last = obstacle.trajectory.span
        present = (recording.times >= first) & (recording.times <= last)
        if np.any(present):
            gap = clearances(obstacle, recording.shapes[0], recording.times[present], recording.positions[present, 0])
            nearest[present] = np.minimum(nearest[present], gap)
    return nearest


def clearing_distance(recording: Recording) -> float:
    """Mean over the steps of the clearance to the nearest obstacle [m]; inf without obstacles."""
    nearest = _clearances_at_steps(recording)
    return float(nearest[np.isfinite(nearest)].mean()) if np.any(np.isfinite(nearest)) else np.inf


def space_compliance(recording: Recording) -> float:
    """Share of the steps with a clearance of at least PERSONAL_SPACE."""
    return float((_clearances_at_steps(recording) >= PERSONAL_SPACE).mean())


def min_time_to_collision(recording: Recording) -> float:
    """Least time to collision [s] over the steps: clearance over closing speed of approaching pairs; inf if none."""
    least = np.inf
    for obstacle in _bodies(recording):
        first, last = obstacle.trajectory.span
        present = (recording.times >= first) & (recording.times <= last)
        times = recording.times[present]
        if not np.any(present):
            continue
        robot, robot_positions = recording.shapes[0], recording.positions[present, 0]
        relative = obstacle.trajectory.velocity(times) - recording.velocities[present, 0]
        clearance = clearances(obstacle, robot, times, robot_positions)
        if len(obstacle.shape.parts) == len(robot.parts) == 1 and len(obstacle.shape.parts[0].corners) == 1:
            offsets = obstacle.trajectory.position(times) - robot_positions
            closing = -np.sum(offsets * relative, axis=1) / np.maximum(np.linalg.norm(offsets, axis=1), 1e-12)
        else:
            # Finite difference of the clearance for straight motion of both.
            closing = (
                clearance - clearances(obstacle, robot, times, robot_positions - CLOSING_INTERVAL * relative)
            ) / CLOSING_INTERVAL
        gap = np.maximum(clearance, 0.0)
        is_closing = closing > 1e-9
        least = min(least, float((gap[is_closing] / closing[is_closing]).min(initial=np.inf)))
    return least


def without_safe_choice(recording: Recording) -> float:
    """Share of the decisions with an outcome for which no new safe manoeuvre existed."""
    made = [row[0] for row in recording.outcomes if row[0] in Outcome.__members__]
    return sum(name not in ("CLEAR", "CONSTRAINED", "KEPT") for name in made) / len(made) if made else 0.0


METRICS: Final[dict[str, Callable[[Recording], float]]] = {
    function.__name__: function
    for function in (
        success,
        arrived,
        collisions,
        min_clearance,
        time,
        extra_time,
        path_length,
        spl,
        adjustments,
        adjustment_rate,
        sign_reversals,
        max_speed,
        mean_speed,
        efficacy,
        max_acceleration,
        mean_acceleration,
        max_jerk,
        mean_jerk,
        heading_change,
        stalled_time,
        failures_to_progress,
        clearing_distance,
        space_compliance,
        min_time_to_collision,
        without_safe_choice,
        side_flips,
        heading_variation,
        changed_choices,
    )
}
"""Metrics by name."""


def summary(recording: Recording) -> dict[str, Any]:
    """Return the result that the command line prints, ready for JSON: infinite numbers become None."""
    decision_times_us = recording.decision_times[recording.decision_times > 0.0] * 1e6
    quantiles = np.quantile(decision_times_us, [0.5, 0.99, 1.0]) if decision_times_us.size else np.zeros(3)
    robots = range(len(recording.shapes))
    passive = np.array([[c.clearance for c in closest_approaches(recording, k)] for k in robots])
    # The matrix is symmetric: each collision of two robots appears twice.
    between = between_robots(recording)
    collided = int((passive < -COLLISION).sum()) + int((between < -COLLISION).sum()) // 2
    return {
        "scenario": recording.scenario,
        "method": recording.method,
        "foresight": recording.foresight,
        "seed": recording.seed,
        "robots": recording.positions.shape[1],
        "arrived": int(np.isfinite(recording.arrived).sum()),
        "collisions": collided,
        "min_clearance": finite(min(passive.min(initial=np.inf), between.min(initial=np.inf))),
        "time": time(recording),
        "efficacy": round(float(np.mean([efficacy(recording, k) for k in robots])), 3),
        "adjustments": int(sum(adjustments(recording, k) for k in robots)),
        "decision_us": dict(zip(("p50", "p99", "max"), (round(float(q), 1) for q in quantiles))),
        "statuses": dict(sorted(Counter(name for row in recording.outcomes for name in row if name).items())),
    }


def finite(value: float) -> float | None:
    """Return the value, or None if it is not finite, which JSON cannot represent."""
    return float(value) if np.isfinite(value) else None


def track(recording: Recording, rate: float, robot: int = 0) -> tuple[Array, Array]:
    """Return times (k,) [s] from the start of the run and positions (k, d) [m] of a robot, at `rate` [1/s] or more."""
    span = float(recording.times[-1] - recording.times[0])
    times = np.linspace(0.0, span, max(2, int(np.ceil(span * rate)) + 1))
    return times, positions_at(recording, robot, recording.times[0] + times)
