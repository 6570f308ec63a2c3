"""Metrics of a recording: those of all robots, the table of all metrics, and the summary of a run.

Metrics of all robots take a recording. Metrics of one robot (`robot_metrics`) take a recording and, in a fleet, the
name or number of the robot. Success is that of Francis et al. 2023 (arXiv:2306.16740, table 1).
"""

from collections import Counter
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from slalom.checks import Array
from slalom.registry import Kind, Registry
from slalom.sim.measure.broad_phase import nearest_clearances
from slalom.sim.measure.closest_approach import between_robots, positions_at
from slalom.sim.measure.oscillation import (
    changed_choices as changed_choices,
    heading_variation as heading_variation,
    side_flips as side_flips,
)
from slalom.sim.measure.recording import Recording, Which
from slalom.sim.measure.robot_metrics import (
    adjustment_rate as adjustment_rate,
    adjustments as adjustments,
    clearing_distance as clearing_distance,
    efficacy as efficacy,
    extra_time as extra_time,
    failures_to_progress as failures_to_progress,
    heading_change as heading_change,
    max_acceleration as max_acceleration,
    max_jerk as max_jerk,
    max_speed as max_speed,
    mean_acceleration as mean_acceleration,
    mean_jerk as mean_jerk,
    mean_speed as mean_speed,
    min_time_to_collision as min_time_to_collision,
    path_length as path_length,
    sign_reversals as sign_reversals,
    space_compliance as space_compliance,
    spl as spl,
    stalled_time as stalled_time,
    without_safe_choice as without_safe_choice,
)
from slalom.sim.measure.run_summary import RunSummary
from slalom.tolerances import COLLISION


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
    """Time until the last robot reached its goal [s]; duration of the run if one did not."""
    return float(recording.times[-1] - recording.times[0])


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
"""Metrics by name; packages add to them by entry points of the group slalom.metrics.

Those of one robot take a parameter `robot`, the others are of all robots."""


def summary(recording: Recording) -> dict[str, Any]:
    """Return the result that the command line prints, ready for JSON: infinite numbers become None.

    Adjustments are the sum of all robots, efficacy and jerk [m/s^3] their mean (see `mean_jerk`).
    """
    decision_times_us = recording.decision_times[recording.decision_times > 0.0] * 1e6
    quantiles = np.quantile(decision_times_us, [0.5, 0.99, 1.0]) if decision_times_us.size else np.zeros(3)
    alone = [recording.only(k) for k in range(len(recording.shapes))]
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
        "efficacy": round(float(np.mean([efficacy(one) for one in alone])), 3),
        "adjustments": int(sum(adjustments(one) for one in alone)),
        "jerk": float(np.mean([mean_jerk(one) for one in alone])),
        "decision_us": dict(zip(("p50", "p99", "max"), (round(float(q), 1) for q in quantiles))),
        "statuses": dict(sorted(Counter(name for row in recording.outcomes for name in row if name).items())),
    }


def finite(value: float) -> float | None:
    """Return the value, or None if it is not finite, which JSON cannot represent."""
    return float(value) if np.isfinite(value) else None


def track(recording: Recording, rate: float, robot: Which = None) -> tuple[Array, Array]:
    """Return times (k,) [s] from the start of the run and positions (k, d) [m] of a robot, at `rate` [1/s] or more."""
    span = float(recording.times[-1] - recording.times[0])
    times = np.linspace(0.0, span, max(2, int(np.ceil(span * rate)) + 1))
    return times, positions_at(recording, recording.row(robot), recording.times[0] + times)
