"""Metrics of a recording: those of all robots, the table of all metrics, and the summary of a run.

Metrics of all robots take a recording. Metrics of one robot take a recording and, in a fleet, the
name or number of the robot. Success is that of Francis et al. 2023 (arXiv:2306.16740, table 1).
"""

from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.registry import Kind, Registry
from slalom.decision import Outcome
from slalom.kernels.arrays import Indices
from slalom.sim.measure.closest_approach import between_robots, nearest_clearances, positions_at, single_robot_view
from slalom.sim.measure.recording import Recording, RunSummary, Which
from slalom.sim.shape_distance import clearances
from slalom.sim.tasks import task_figures

# Metrics of one robot of a recording: one pure function per metric, with definitions from the literature.
#
# Francis et al. 2023 (arXiv:2306.16740, table 1) for stalled time, failure to progress, path length, SPL, space
# compliance, clearing distance, time to collision; the number of adjustments is the paper's (arXiv:2506.06255).
#
# `robot` is the name or the number of a robot, see `Recording.row`; a recording of one robot needs none. Clearances
# are to obstacles and to the other robots.


COLLISION: Final = 1e-3
"""[m] A recorded collision is a clearance below minus this. It separates contact from overlap in metrics."""

ADJUSTMENT: Final = 0.05
"""[m/s^2] Change of the applied acceleration from one step to the next that counts as an adjustment. The paper counts
adjustments without naming a threshold; 0.05 is the value of published comparisons."""

STALLED_SPEED: Final = 0.05
"""[m/s] Speed below which a robot is stalled in metrics, as in Francis et al. (arXiv:2306.16740). Larger: slow robots
count as stalled. Smaller: robots that drift do not."""

PROGRESS_DISTANCE: Final = 0.1
"""[m] A robot that approaches its goal by less than this within PROGRESS_TIME fails to progress (Francis et al.).
Larger: slow approaches are failures. Smaller: a robot that only drifts makes progress."""

PROGRESS_TIME: Final = 5.0
"""[s] Length of the intervals in which progress is measured (Francis et al.). Larger: fewer intervals, short stops are
forgiven. Smaller: each stop is a failure."""

PERSONAL_SPACE: Final = 0.5
"""[m] Clearance required for space compliance (Francis et al.). Larger: a smaller share of the steps complies."""

CLOSING_INTERVAL: Final = 1e-6
"""[s] Time step of the finite difference that gives the closing speed of bodies with corners. Larger: the nearest
corners may change within it. Smaller: rounding of the clearance enters the speed."""

METRIC_SPEED: Final = 1e-9
"""[m/s] Slowest speed with a direction, and slowest approach to an obstacle that counts, in the metrics of a run.
Larger: slow motion counts as rest. Smaller: rounding has a direction."""


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


def _clearances_at_steps(recording: Recording) -> Array:
    """Return the clearance (T + 1,) [m] to the nearest obstacle at each step; inf without obstacles."""
    nearest = np.full(len(recording.times), np.inf)
    for obstacle in recording.obstacles:
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
    for obstacle in run.obstacles:
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


# Measures of oscillation: changes of the passing side, of the heading, and of the committed manoeuvre.
#
# Each measure is a pure function of a recording and one robot; `flips_between` is of all pairs.


MOVING_SHARE: Final = 0.1
"""[1] A robot moves, and has a heading, if it is faster than this share of its maximum speed. Larger: turns at low
speed are omitted. Smaller: robots that oscillate almost at rest accumulate hundreds of radians."""


class Passing(NamedTuple):
    """Conditions under which two robots are about to pass each other on a defined side.

    Attributes:
        ahead: [s] largest time to the closest approach at the present velocities; the horizon of the gallery's robots.
            Smaller: flips of distant robots do not count.
        towards: [1] least cosine between the relative velocity and the line between the robots; 0.5 is 60 degrees.
            0: small motions of robots side by side count as flips.
        band: [1] least distance of the closest approach, as a share of the sum of the radii. 0: rounding flips the side
            of robots on a central collision course.
    """

    ahead: float = 6.0
    towards: float = 0.5
    band: float = 0.1


PASSING: Final = Passing()


def passing_sides(position: Array, velocity: Array, contact_distance: float, rule: Passing = PASSING) -> Indices:
    """Return the side (T,) on which a robot would pass another one at each step, in the plane.

    Args:
        position: (T, 2) [m] of the other robot relative to the robot.
        velocity: (T, 2) [m/s] of the robot relative to the other robot.
        contact_distance: [m] sum of their radii.

    Returns:
        Sign of velocity x position: 1 if the other robot is left of the robot's path, -1 if right of it, 0 if the
        conditions of `rule` do not hold.
        Law: the value is the same for both robots.
    """
    closing = np.sum(velocity * position, axis=1)
    squared_speed = np.sum(velocity * velocity, axis=1)
    cross_product = velocity[:, 0] * position[:, 1] - velocity[:, 1] * position[:, 0]
    speed, distance = np.sqrt(squared_speed), np.linalg.norm(position, axis=1)
    approach = (closing > rule.towards * distance * speed) & (closing <= rule.ahead * squared_speed)
    decided = np.abs(cross_product) >= rule.band * contact_distance * speed
    return np.where(approach & decided, np.sign(cross_product), 0.0).astype(np.int64)


def _flips(sides: Indices) -> int:
    """Count the changes between -1 and 1 in `sides` (T,), ignoring zeros."""
    return int(np.count_nonzero(np.diff(sides[sides != 0])))


def side_flips(recording: Recording, robot: Which = None) -> float:
    """Number of changes of the side on which the robot would pass an obstacle, over all obstacles; 0 in space.

    Walls and other obstacles of several parts have no passing side.
    """
    recording, total = single_robot_view(recording, robot), 0
    for obstacle in recording.obstacles:
        first, last = obstacle.trajectory.span
        present = (recording.times >= first) & (recording.times <= last)
        if recording.dimension == 3 or len(obstacle.shape.parts) > 1 or not np.any(present):
            continue
        times = recording.times[present]
        relative_position = obstacle.trajectory.position(times) - recording.positions[present, 0]
        velocity = recording.velocities[present, 0] - obstacle.trajectory.velocity(times)
        total += _flips(
            passing_sides(
                relative_position, velocity, recording.shapes[0].bounding_radius + obstacle.shape.bounding_radius
            )
        )
    return float(total)


def flips_between(recording: Recording, rule: Passing = PASSING) -> tuple[Indices, Indices]:
    """Return side flips of each pair of robots, and the number of steps before a passing: both (N, N), symmetric."""
    n = recording.positions.shape[1]
    flips, steps = np.zeros((n, n), np.int64), np.zeros((n, n), np.int64)
    there = [recording.steps_of(k) for k in range(n)]
    for i in range(n if recording.dimension == 2 else 0):
        for j in range(i):
            both = slice(max(there[i].start, there[j].start), min(there[i].stop, there[j].stop))
            relative_position = recording.positions[both, j] - recording.positions[both, i]
            velocity = recording.velocities[both, i] - recording.velocities[both, j]
            contact_distance = recording.shapes[i].bounding_radius + recording.shapes[j].bounding_radius
            sides = passing_sides(relative_position, velocity, contact_distance, rule)
            flips[i, j], steps[i, j] = _flips(sides), np.count_nonzero(sides)
            flips[j, i], steps[j, i] = flips[i, j], steps[i, j]
    return flips, steps


def heading_variation(recording: Recording, robot: Which = None, moving: float = MOVING_SHARE) -> float:
    """Sum of the absolute changes of the heading [rad] between consecutive steps at which the robot moves.

    It includes the turns of the path itself. Unlike `heading_change` it omits steps at which the robot is slower than
    `moving` times its maximum speed.
    """
    robot = recording.row(robot)
    v = recording.velocities[:, robot]
    speed = np.linalg.norm(v, axis=1)
    moves = speed > moving * recording.limits[robot].max_speed
    unit = v[moves] / speed[moves, None]
    difference, total = (np.linalg.norm(unit[1:] + sign * unit[:-1], axis=1) for sign in (-1.0, 1.0))
    return float(2.0 * np.arctan2(difference, total).sum())


def changed_choices(recording: Recording, robot: Which = None) -> float:
    """Share of the decisions with an outcome that changed the committed manoeuvre."""
    robot = recording.row(robot)
    made = [row[robot] for row in recording.outcomes if row[robot] in Outcome.__members__]
    return sum(name not in ("KEPT", "CONTINUED") for name in made) / len(made) if made else 0.0


def arrived(recording: Recording | RunSummary) -> float:
    """1 if all robots reached their goals within the duration, else 0."""
    return float(np.all(np.isfinite(recording.arrived)))


def collisions(recording: Recording) -> float:
    """Number of collisions of all robots: pairs of a robot and an obstacle, and pairs of robots.

    A pair counts if it overlapped by more than COLLISION at some time of the run.
    """
    return float(_count(*_clearances(recording)))


def min_clearance(recording: Recording) -> float:
    """Least clearance [m] of all robots to obstacles and to each other, in continuous time; inf without either."""
    passive, between = _clearances(recording)
    return float(min(passive.min(initial=np.inf), between.min(initial=np.inf)))


def success(recording: Recording) -> float:
    """1 if all robots arrived and none collided, else 0."""
    return float(arrived(recording) and not collisions(recording))


def time(recording: Recording | RunSummary) -> float:
    """Time from the first appearance until the last robot reached its goal [s], or to the end if one did not."""
    return float(recording.times[-1]) - min(float(recording.appeared.min()), float(recording.times[-1]))


def _clearances(recording: Recording) -> tuple[Array, Array]:
    """Return the least clearances (n, m) [m] as of `nearest_clearances`, and (n, n) [m] between the robots."""
    return nearest_clearances(recording), between_robots(recording)


def _count(passive: Array, between: Array) -> int:
    """Return the number of overlapping pairs; `between` is symmetric, so each pair of robots is twice in it."""
    return int((passive < -COLLISION).sum()) + int((between < -COLLISION).sum()) // 2


METRICS: Final = Registry[Callable[[Recording], float]](
    "slalom.metrics",
    Kind(callable, "a function of a recording"),
    {
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
    },
)
"""Metrics by name; packages add to them by entry points of the group slalom.metrics. Those of one robot take a
parameter `robot`, the others are of all robots."""


def summary(recording: Recording) -> dict[str, Any]:
    """Return the result that the command line prints, ready for JSON: infinite numbers become None.

    Adjustments are the sum of all robots, efficacy and jerk [m/s^3] their mean (see `mean_jerk`). A run with tasks has
    their figures, see `tasks.task_figures`.
    """
    decision_times_us = recording.decision_times[recording.decision_times > 0.0] * 1e6
    quantiles = np.quantile(decision_times_us, [0.5, 0.99, 1.0]) if decision_times_us.size else np.zeros(3)
    alone = [recording.only(k) for k in np.flatnonzero(np.isfinite(recording.appeared)).tolist()]
    passive, between = _clearances(recording)
    return {
        "scenario": recording.scenario,
        "method": recording.method,
        "foresight": recording.foresight,
        "seed": recording.seed,
        "robots": recording.positions.shape[1],
        "arrived": int(np.isfinite(recording.arrived).sum()),
        "collisions": _count(passive, between),
        "min_clearance": finite(min(passive.min(initial=np.inf), between.min(initial=np.inf))),
        "time": time(recording),
        "efficacy": round(float(np.mean([efficacy(one) for one in alone] or [0.0])), 3),
        "adjustments": int(sum(adjustments(one) for one in alone)),
        "jerk": float(np.mean([mean_jerk(one) for one in alone] or [0.0])),
        "decision_us": dict(zip(("p50", "p99", "max"), (round(float(q), 1) for q in quantiles))),
        "statuses": dict(sorted(Counter(name for row in recording.outcomes for name in row if name).items())),
        **({} if recording.tasks is None else {"tasks": {k: finite(v) for k, v in task_figures(recording).items()}}),
    }


def finite(value: float) -> float | None:
    """Return the value, or None if it is not finite, which JSON cannot represent."""
    return float(value) if np.isfinite(value) else None


def track(recording: Recording, rate: float, robot: Which = None) -> tuple[Array, Array]:
    """Return times (k,) [s] from the start of the run and positions (k, d) [m] of a robot, at `rate` [1/s] or more."""
    span = float(recording.times[-1] - recording.times[0])
    times = np.linspace(0.0, span, max(2, int(np.ceil(span * rate)) + 1))
    return times, positions_at(recording, recording.row(robot), recording.times[0] + times)
