"""Metrics of one robot of a recording: one pure function per metric, with definitions from the literature.

Francis et al. 2023 (arXiv:2306.16740, table 1) for stalled time, failure to progress, path length, SPL, space
compliance, clearing distance, time to collision; the number of adjustments is the paper's (arXiv:2506.06255).

`robot` is the name or the number of a robot, see `Recording.row`; a recording of one robot needs none. Clearances are
to obstacles and to the other robots.
"""

import numpy as np

from slalom.checks import Array
from slalom.decision import Outcome
from slalom.obstacle import Obstacle
from slalom.sim.measure.broad_phase import nearest_clearances
from slalom.sim.measure.closest_approach import nearest_images, positions_at
from slalom.sim.measure.recording import Recording, Which
from slalom.sim.measure.single_robot_view import single_robot_view
from slalom.sim.shape_distance import clearances
from slalom.tolerances import (
    ADJUSTMENT,
    CLOSING_INTERVAL,
    COLLISION,
    METRIC_SPEED,
    PERSONAL_SPACE,
    PROGRESS_DISTANCE,
    PROGRESS_TIME,
    STALLED_SPEED,
)


def extra_time(recording: Recording, robot: Which = None) -> float:
    """Time to arrival minus the time of the straight path at maximum speed [s]; inf if the robot did not arrive.

    The path leads from the start to the initial position of the goal (gym-collision-avoidance's extra time to goal).
    """
    run = recording.only(robot)
    begin = float(run.times[0])
    distance = float(np.linalg.norm(run.goals[0].position(begin) - run.positions[0, 0]))
    return float(run.arrived[0]) - begin - distance / run.limits[0].max_speed


def path_length(recording: Recording, robot: Which = None) -> float:
    """Sum of the distances between steps [m]."""
    run = recording.only(robot)
    return float(np.linalg.norm(np.diff(run.positions[:, 0], axis=0), axis=1).sum())


def spl(recording: Recording, robot: Which = None) -> float:
    """Success weighted by path length: straight distance over the larger of straight distance and path length.

    The success of a robot that starts at its goal counts in full.
    """
    run = single_robot_view(recording, robot)
    goal = run.goals[0]
    start = run.positions[0, 0]
    straight = float(np.linalg.norm(goal.position(run.times[-1]) - start)) - goal.tolerance
    longer = max(path_length(run), straight)
    collided = bool((nearest_clearances(run) < -COLLISION).any())
    success = float(np.isfinite(run.arrived[0]) and not collided)
    return success * straight / longer if straight > 0.0 else success


def adjustments(recording: Recording, robot: Which = None) -> float:
    """Number of steps at which the applied acceleration changes by more than ADJUSTMENT."""
    run = recording.only(robot)
    change = np.diff(run.accelerations[:, 0], axis=0, prepend=np.zeros((1, run.dimension)))
    return float((np.linalg.norm(change, axis=1) > ADJUSTMENT).sum())


def adjustment_rate(recording: Recording, robot: Which = None) -> float:
    """Adjustments per second."""
    run = recording.only(robot)
    return adjustments(run) / max(float(run.times[-1] - run.times[0]), run.dt)


def sign_reversals(recording: Recording, robot: Which = None) -> float:
    """Number of steps at which the acceleration turns by more than a right angle."""
    run = recording.only(robot)
    a = run.accelerations[:, 0]
    return float((np.sum(a[1:] * a[:-1], axis=1) < 0).sum()) if len(a) > 1 else 0.0


def max_speed(recording: Recording, robot: Which = None) -> float:
    """Largest speed [m/s]; the speed of a parabola is largest at a step."""
    run = recording.only(robot)
    return float(np.linalg.norm(run.velocities[:, 0], axis=1).max())


def mean_speed(recording: Recording, robot: Which = None) -> float:
    """Mean speed over the steps [m/s]."""
    run = recording.only(robot)
    return float(np.linalg.norm(run.velocities[:, 0], axis=1).mean())


def max_acceleration(recording: Recording, robot: Which = None) -> float:
    """Largest applied acceleration [m/s^2]."""
    run = recording.only(robot)
    return float(np.linalg.norm(run.accelerations[:, 0], axis=1).max(initial=0.0))


def mean_acceleration(recording: Recording, robot: Which = None) -> float:
    """Mean applied acceleration [m/s^2]."""
    run = recording.only(robot)
    norms = np.linalg.norm(run.accelerations[:, 0], axis=1)
    return float(norms.mean()) if norms.size else 0.0


def efficacy(recording: Recording, robot: Which = None) -> float:
    """Mean rate of approach to the goal until arrival, as a share of the maximum speed; 1 is ideal.

    It equals the mean projection of the velocity on the desired direction (navground's efficacy).
    """
    run = recording.only(robot)
    end = min(float(run.arrived[0]), float(run.times[-1]))
    duration, goal = end - float(run.times[0]), run.goals[0]
    if duration <= 0.0:
        return 1.0
    robot_positions = positions_at(run, 0, np.array([run.times[0], end]))
    distances = np.linalg.norm(goal.position(np.array([run.times[0], end])) - robot_positions, axis=-1)
    return float((distances[0] - distances[1]) / (duration * run.limits[0].max_speed))


def _jerks(recording: Recording) -> Array:
    return np.asarray(np.linalg.norm(np.diff(recording.accelerations[:, 0], axis=0), axis=1) / recording.dt)


def max_jerk(recording: Recording, robot: Which = None) -> float:
    """Largest change of the acceleration from one step to the next, over dt [m/s^3]."""
    run = recording.only(robot)
    return float(_jerks(run).max(initial=0.0))


def mean_jerk(recording: Recording, robot: Which = None) -> float:
    """Mean change of the acceleration from one step to the next, over dt [m/s^3].

    The acceleration is constant during each of the T steps, so its jerk consists of impulses between them. The mean is
    the sum of |a_(i+1) - a_i| over (T - 1) dt: for the same changes it does not depend on dt, unlike a mean square.
    """
    run = recording.only(robot)
    jerks = _jerks(run)
    return float(jerks.mean()) if jerks.size else 0.0


def heading_change(recording: Recording, robot: Which = None) -> float:
    """Sum of the absolute changes of the direction of the velocity [rad]."""
    run = recording.only(robot)
    v = run.velocities[:, 0]
    v = v[np.linalg.norm(v, axis=1) > METRIC_SPEED]
    unit = v / np.linalg.norm(v, axis=1, keepdims=True)
    return float(np.arccos(np.clip(np.sum(unit[1:] * unit[:-1], axis=1), -1.0, 1.0)).sum())


def stalled_time(recording: Recording, robot: Which = None) -> float:
    """Time [s] with a speed below STALLED_SPEED."""
    run = recording.only(robot)
    return float((np.linalg.norm(run.velocities[:-1, 0], axis=1) < STALLED_SPEED).sum() * run.dt)


def failures_to_progress(recording: Recording, robot: Which = None) -> float:
    """Number of intervals of PROGRESS_TIME in which the robot approaches its goal by less than PROGRESS_DISTANCE."""
    run = recording.only(robot)
    goal = run.goals[0].position(run.times)
    distance = np.linalg.norm(goal - run.positions[:, 0], axis=1)[:: max(1, round(PROGRESS_TIME / run.dt))]
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


def clearing_distance(recording: Recording, robot: Which = None) -> float:
    """Mean over the steps of the clearance to the nearest obstacle [m]; inf without obstacles."""
    run = single_robot_view(recording, robot)
    nearest = _clearances_at_steps(run)
    return float(nearest[np.isfinite(nearest)].mean()) if np.any(np.isfinite(nearest)) else np.inf


def space_compliance(recording: Recording, robot: Which = None) -> float:
    """Share of the steps with a clearance of at least PERSONAL_SPACE."""
    run = single_robot_view(recording, robot)
    return float((_clearances_at_steps(run) >= PERSONAL_SPACE).mean())


def min_time_to_collision(recording: Recording, robot: Which = None) -> float:
    """Least time to collision [s] over the steps: clearance over closing speed of approaching pairs; inf if none."""
    run = single_robot_view(recording, robot)
    least = np.inf
    for obstacle in _bodies(run):
        first, last = obstacle.trajectory.span
        present = (run.times >= first) & (run.times <= last)
        times = run.times[present]
        if not np.any(present):
            continue
        shape, robot_positions = run.shapes[0], run.positions[present, 0]
        relative = obstacle.trajectory.velocity(times) - run.velocities[present, 0]
        clearance = clearances(obstacle, shape, times, robot_positions)
        if len(obstacle.shape.parts) == len(shape.parts) == 1 and len(obstacle.shape.parts[0].corners) == 1:
            offsets = obstacle.trajectory.position(times) - robot_positions
            closing = -np.sum(offsets * relative, axis=1) / np.maximum(np.linalg.norm(offsets, axis=1), 1e-12)
        else:
            # Finite difference of the clearance for straight motion of both.
            closing = (
                clearance - clearances(obstacle, shape, times, robot_positions - CLOSING_INTERVAL * relative)
            ) / CLOSING_INTERVAL
        gap = np.maximum(clearance, 0.0)
        is_closing = closing > METRIC_SPEED
        least = min(least, float((gap[is_closing] / closing[is_closing]).min(initial=np.inf)))
    return least


def without_safe_choice(recording: Recording, robot: Which = None) -> float:
    """Share of the decisions with an outcome for which no new safe manoeuvre existed."""
    run = recording.only(robot)
    made = [row[0] for row in run.outcomes if row[0] in Outcome.__members__]
    return sum(name not in ("CLEAR", "CONSTRAINED", "KEPT") for name in made) / len(made) if made else 0.0
