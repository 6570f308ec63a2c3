"""Controller of the paper, and the claim `sweep`: at every decision one constant acceleration outside the AO or NAO.

It has one response, no speed limit, and the latest collision as its only fallback, as the paper describes. The motion
is integrated exactly; separate code finds collisions afterwards.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from joblib import Parallel, delayed

from slalom.base.checks import Array
from slalom.base.tolerances import COMMITTED_SLACK, CONTACT_SLACK, INTERPOLATION
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.decision.methods import METHODS
from slalom.forecast.forecast import Known
from slalom.model.goal import Goal
from slalom.model.limits import Admissible, Limits, admissible_ball
from slalom.model.path import Path, hermite_step
from slalom.model.response import Acceleration
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Circular, Stationary
from slalom.model.trajectory.protocol import Endless
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.sim import Recording, Robot, Scenario
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import nearest_clearances
from slalom.sim.measure.metrics import COLLISION, adjustments, mean_acceleration, mean_jerk
from slalom.sim.measure.recording import RunLog, Step
from slalom.sim.run.states import integrate

# Predicted paths of many cars on circular lanes, for successive decisions, in a few array operations.
#
# The sweep makes half a million decisions among 30 cars. Evaluating the forecast of each car separately would take
# longer than deciding. The pieces are the same (`test_fleet_sees_what_forecasts_see`).


Indices = npt.NDArray[np.intp]


class PredictedLane(Endless):
    """A car on its lane whose `path`, the only part that a decision uses, is the predicted one."""

    def __init__(self, lane: Circular) -> None:
        self.lane = lane
        self.predicted: Path | None = None

    @property
    def dimension(self) -> int:
        return 2

    def position(self, t: npt.ArrayLike) -> Array:
        return self.lane.position(t)

    def velocity(self, t: npt.ArrayLike) -> Array:
        return self.lane.velocity(t)

    def acceleration(self, t: npt.ArrayLike) -> Array:
        return self.lane.acceleration(t)

    def speed_bound(self, start: float, end: float) -> float:
        return self.lane.speed_bound(start, end)

    def acceleration_bound(self, start: float, end: float) -> float:
        return self.lane.acceleration_bound(start, end)

    def path(self, start: float, end: float) -> Path:
        return self.lane.path(start, end) if self.predicted is None else self.predicted


class CarLanes:
    """Cars on circles about the origin.

    Args:
        cars: obstacles on Circular trajectories.
        known: whether their lanes are known (NAO), or only the present position, velocity and acceleration (AO).
    """

    def __init__(self, cars: Sequence[Obstacle], *, known: bool) -> None:
        lanes = [car.trajectory for car in cars]
        assert all(isinstance(lane, Circular) and not lane.center.any() for lane in lanes)
        self.radius, self.rate, self.phase = (
            np.array([getattr(lane, name) for lane in lanes]) for name in ("radius", "rate", "phase")
        )
        self.cars = [
            Obstacle(car.shape, PredictedLane(lane)) for car, lane in zip(cars, lanes) if isinstance(lane, Circular)
        ]
        self.known = known
        fourth = self.radius * np.abs(self.rate) ** 4
        self.fourth_derivative, self.max_step = (
            fourth,
            min((hermite_step(f, INTERPOLATION) for f in fourth), default=np.inf),
        )

    def traffic(self, now: float, horizon: float, position: Array, neighbours: int = 0) -> ObstacleWindow:
        """Return the cars as predicted at `now` [s] over `horizon` [s].

        Args:
            position: (2,) [m] of the robot. neighbours: number of cars nearest to `position`; 0 for all.
        """
        angle = self.phase + self.rate * now
        chosen = np.arange(len(self.cars))
        if neighbours:
            positions = self.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            chosen = np.argsort(np.linalg.norm(positions - position, axis=1), kind="stable")[:neighbours]
        times, points, error = (self._lanes if self.known else self._parabolas)(angle[chosen], chosen, now, horizon)
        for k, index in enumerate(chosen):
            assumed = self.cars[index].trajectory
            assert isinstance(assumed, PredictedLane)
            assumed.predicted = Path(times, points[k], error[k])
        return ObstacleWindow([self.cars[index] for index in chosen], now, horizon)

    def _lanes(self, angle: Array, chosen: Indices, now: float, horizon: float) -> tuple[Array, Array, Array]:
        """Return common times (n + 1,) [s], cubic pieces of the circles (k, n, 4, 2) [m] and their errors (k, n)."""
        count = max(1, int(np.ceil(horizon / self.max_step)))
        step = horizon / count
        radius, rate = self.radius[chosen][:, None], self.rate[chosen][:, None]
        angles = angle[:, None] + rate * np.linspace(0.0, horizon, count + 1)
        unit = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        positions = radius[..., None] * unit
        control_offset = (radius * rate * step / 3.0)[..., None] * np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
        points = np.empty((len(chosen), count, 4, 2))
        points[:, :, 0], points[:, :, 3] = positions[:, :-1], positions[:, 1:]
        points[:, :, 1], points[:, :, 2] = (
            positions[:, :-1] + control_offset[:, :-1],
            positions[:, 1:] - control_offset[:, 1:],
        )
        error = np.broadcast_to((self.fourth_derivative[chosen] * step**4 / 384.0)[:, None], (len(chosen), count))
        return np.linspace(now, now + horizon, count + 1), points, error

    def _parabolas(self, angle: Array, chosen: Indices, now: float, horizon: float) -> tuple[Array, Array, Array]:
        """Return times (2,) [s], parabolas (k, 1, 4, 2) [m] of the present acceleration, and errors (k, 1) of 0."""
        radius, rate = self.radius[chosen][:, None], self.rate[chosen][:, None]
        unit = np.column_stack([np.cos(angle), np.sin(angle)])
        positions, acceleration = radius * unit, -radius * rate**2 * unit
        velocity = radius * rate * np.column_stack([-unit[:, 1], unit[:, 0]])
        points = np.empty((len(chosen), 1, 4, 2))
        points[:, 0, 0] = positions
        points[:, 0, 1] = positions + horizon * velocity / 3.0
        points[:, 0, 2] = positions + horizon * (2.0 * velocity + 0.5 * horizon * acceleration) / 3.0
        points[:, 0, 3] = positions + horizon * (velocity + 0.5 * horizon * acceleration)
        return np.array([now, now + horizon]), points, np.zeros((len(chosen), 1))


RESPONSE: Final = Acceleration()
ROBOT_DISC: Final = Disc(1.0)
UNREACHED_SPEED: Final = 1e3
"""[m/s] Speed limit that is never reached: the paper's definitions have no speed limit."""
RIM_RADIUS: Final = 26.0
"""[m] Distance from the centre of the roundabout at which a run starts and ends."""
CRUISE_SPEED: Final = 8.0
"""[m/s] Desired speed towards the goal."""
TURN_TIME: Final = 1.0
"""[s] Time in which the preferred acceleration reaches the desired velocity."""
MARGIN: Final = 0.05
"""[m] Desired clearance to every car."""
MAX_DURATION: Final = 20.0
"""[s] Time limit of a run."""


@dataclass(frozen=True)
class Rules:
    """Parameters of the controller, one row of the sweep.

    Attributes:
        method: "ao" or "nao": forecast of the cars. replan: [s] between decisions.
        neighbours: number of nearest cars that are considered; 0 for all.
        keep: whether the current acceleration is kept while it is free; otherwise the free acceleration nearest to the
            preferred one is selected at every decision.
        max_acceleration: [m/s^2]. horizon: [s].
    """

    method: str
    replan: float
    neighbours: int = 0
    keep: bool = True
    max_acceleration: float = 4.0
    horizon: float = 6.0


class Run(NamedTuple):
    """A finished run: recording, status of each decision, and whether the robot has left the roundabout."""

    recording: Recording
    statuses: tuple[str, ...]
    has_left: bool


def preferred_acceleration(state: State, goal: Array, max_acceleration: float) -> Array:
    """Return the acceleration (2,) [m/s^2] that gives CRUISE_SPEED towards `goal` in TURN_TIME, scaled to the limit."""
    to_goal = goal - state.position
    desired = (CRUISE_SPEED * to_goal / max(float(np.linalg.norm(to_goal)), 1e-9) - state.velocity) / TURN_TIME
    return np.asarray(desired * min(1.0, max_acceleration / max(float(np.linalg.norm(desired)), 1e-300)))


def decide(
    state: State, traffic: ObstacleWindow, rules: Rules, preferred: Array, current: Array | None
) -> tuple[Array, str]:
    """Return the acceleration (2,) [m/s^2] of the next interval and its status; `current` is the one applied so far."""
    ball = admissible_ball((0.0, 0.0), rules.max_acceleration)
    without_margin = ControlObstacle(RESPONSE, state, traffic, ROBOT_DISC)
    if len(without_margin.overlapping):
        return (np.zeros(2) if current is None else current), "OVERLAPPING"
    blocked = ControlObstacle(
        RESPONSE, state, traffic, ROBOT_DISC, np.clip(without_margin.initial_clearances - CONTACT_SLACK, 0.0, MARGIN)
    )
    if rules.keep and current is not None and float(blocked.clearance(current)) >= -COMMITTED_SLACK:
        return current, "KEPT"
    choice = select(preferred, ball, blocked)
    if choice.control is None:
        choice = select(preferred, ball, without_margin)
    if choice.control is not None:
        return choice.control, choice.status.name
    return latest_collision(preferred, ball, without_margin), "DELAYED"


def latest_collision(preferred: Array, ball: Admissible, blocked: ControlObstacle, accuracy: float = 0.01) -> Array:
    """Return the acceleration (2,) with the latest collision, to `accuracy` [s], by bisection of the horizon."""
    low = 0.0
    high = blocked.horizon
    best = preferred
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        choice = select(preferred, ball, replace(blocked, horizon=middle))
        if choice.control is None:
            high = middle
        else:
            low, best = middle, choice.control
    return best


def run(
    rules: Rules, obstacles: Sequence[Obstacle], start: State, goal: Array, max_duration: float = MAX_DURATION
) -> Run:
    """Simulate from `start` until the robot is RIM_RADIUS away from the centre again, at most `max_duration` [s]."""
    lanes = CarLanes(obstacles, known=METHODS[rules.method].forecast == Known())
    state = start
    current = None
    has_left = False
    reached = False
    robot = Robot(ROBOT_DISC, Limits(UNREACHED_SPEED, rules.max_acceleration), start, Goal(Stationary(goal), 1.0))
    scenario = Scenario("roundabout_crossing", (robot,), tuple(obstacles), dt=rules.replan, horizon=rules.horizon)
    log = RunLog(scenario, rules.method, 0, METHODS[rules.method].foresight)
    for k in range(round(max_duration / rules.replan)):
        now = k * rules.replan
        traffic = lanes.traffic(now, rules.horizon, state.position, rules.neighbours)
        preferred = preferred_acceleration(state, goal, rules.max_acceleration)
        current, status = decide(state, traffic, rules, preferred, current)
        rows = (state.position[None], state.velocity[None], current[None], current[None])
        reached = bool(robot.goal.reached_during(state.position, state.velocity, current, now, rules.replan))
        log.steps.append(Step(*rows, (repr(RESPONSE),), (status,), np.zeros(1)))
        state = State(*integrate(state.position, state.velocity, current, rules.replan), current)
        has_left = bool(np.linalg.norm(state.position) > RIM_RADIUS)
        if has_left:
            break
    end = rules.replan * len(log.steps)
    arrived = end if reached else np.inf
    log.end(state.position[None], state.velocity[None], np.array([arrived]), np.zeros(1))
    return Run(Recording.of(log), tuple(step.outcomes[0] for step in log.steps), has_left)


def hits(recording: Recording) -> tuple[int, float]:
    """Return the number of obstacles that the robot overlapped by more than COLLISION, and the least clearance [m].

    In continuous time, as of `nearest_clearances`.
    """
    clearances = nearest_clearances(recording)[0]
    return int((clearances < -COLLISION).sum()), float(clearances.min(initial=np.inf))


@lru_cache(maxsize=1024)
def crossing_scenario(seed: int, speed: float) -> Scenario:
    """Build the crossing with the cars of `seed`, their speeds times `speed`; cached: all rows use the same seeds."""
    return build("roundabout_crossing", {"speed": speed}, seed=seed)


def run_metrics(rules: Rules, seed: int, speed: float) -> dict[str, Any]:
    """Run the crossing with the cars of `seed`, their speeds times `speed`; return its metrics as plain numbers."""
    scenario = crossing_scenario(seed, speed)
    done = run(rules, scenario.obstacles, scenario.robot.state, np.array([RIM_RADIUS, 0.0]))
    cars_hit, clearance = hits(done.recording)
    last = done.recording.positions[-1, 0]
    return {
        "hits": cars_hit,
        "clearance": clearance,
        "adjustments": int(adjustments(done.recording)),
        "decisions": len(done.statuses),
        "mean_acceleration": mean_acceleration(done.recording),
        "mean_jerk": mean_jerk(done.recording),
        "delayed": done.statuses.count("DELAYED"),
        "time": float(done.recording.times[-1]),
        "out": done.has_left,
        "far_side": done.has_left and bool(last[0] >= abs(last[1])),
    }


SWEPT_METHODS: Final = ("nao", "ao")
REPLANS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)
"""[s] Intervals between decisions."""
LANE_SPEEDS: Final = (1.0, 1.5)
"""[1] Speed factors of the cars, times the gallery's 5, 6.5 and 8 m/s."""
NEIGHBOURS: Final = (0, 5)
"""Numbers of nearest cars that are considered; 0 for all 30."""
KEEPS: Final = (True, False)
BATCH: Final = 10
"""Number of seeds of one row per task of a process."""


class Cell(NamedTuple):
    """A cell of the sweep: parameters of the controller and lane speed factor."""

    rules: Rules
    speed: float


def cells(quick: bool = False) -> list[Cell]:
    """Return the cells of the sweep; a few of them if `quick`."""
    replans, speeds, counts = (
        (REPLANS[2::2], LANE_SPEEDS[:1], NEIGHBOURS[:1]) if quick else (REPLANS, LANE_SPEEDS, NEIGHBOURS)
    )
    return [
        Cell(Rules(method, replan, neighbours, keep), speed)
        for keep, neighbours, speed, replan, method in product(KEEPS, counts, speeds, replans, SWEPT_METHODS)
    ]


def sensitivity() -> list[Cell]:
    """Return variants of one cell (all cars, kept, replan 0.5 s) with other horizons and acceleration limits."""
    horizons = [Cell(Rules(m, 0.5, horizon=h), 1.0) for h in (2.0, 3.0, 4.0, 8.0) for m in SWEPT_METHODS]
    limits = [Cell(Rules(m, 0.5, max_acceleration=a), 1.0) for a in (2.0, 3.0, 6.0) for m in SWEPT_METHODS]
    return horizons + limits


def metrics_of_seeds(cell: Cell, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Return the metrics of the runs of some seeds."""
    return [run_metrics(cell.rules, seed, cell.speed) for seed in seeds]


def table(rows: Sequence[Cell], seeds: int, jobs: int, advance: Callable[[float], None]) -> list[dict[str, Any]]:
    """Return one aggregate per cell, in the order of the cells; the result does not depend on the number of jobs."""
    parts = [list(range(first, min(first + BATCH, seeds))) for first in range(0, seeds, BATCH)]
    work = [(index, part) for index in range(len(rows)) for part in range(len(parts))]
    found: dict[tuple[int, int], list[dict[str, Any]]] = {}

    def one(index: int, part: int) -> tuple[int, int, list[dict[str, Any]]]:
        return index, part, metrics_of_seeds(rows[index], parts[part])

    for index, part, runs in Parallel(n_jobs=jobs, return_as="generator_unordered")(
        delayed(one)(index, part) for index, part in work
    ):
        found[index, part] = runs
        advance(len(found) / len(work))
    return [
        aggregate(cell, [run for part in range(len(parts)) for run in found[index, part]])
        for index, cell in enumerate(rows)
    ]


def aggregate(cell: Cell, runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return counts and means over the runs of one cell."""
    rules, left = cell.rules, [run for run in runs if run["out"]]
    return {
        "method": rules.method,
        "replan": rules.replan,
        "lane_speed": cell.speed,
        "neighbours": rules.neighbours,
        "keep": rules.keep,
        "max_acceleration": rules.max_acceleration,
        "horizon": rules.horizon,
        "runs": len(runs),
        "runs_with_collision": sum(run["hits"] > 0 for run in runs),
        "cars_hit": sum(run["hits"] for run in runs),
        "adjustments": float(np.mean([run["adjustments"] for run in runs])),
        "adjustments_per_second": sum(run["adjustments"] for run in runs) / sum(run["time"] for run in runs),
        "decisions": float(np.mean([run["decisions"] for run in runs])),
        "mean_acceleration": float(np.mean([run["mean_acceleration"] for run in runs])),
        "mean_jerk": float(np.mean([run["mean_jerk"] for run in runs])),
        "without_free_control": sum(run["delayed"] for run in runs) / sum(run["decisions"] for run in runs),
        "left_the_ring": len(left),
        "far_side": sum(run["far_side"] for run in runs),
        "time": float(np.mean([run["time"] for run in left])) if left else None,
        "least_clearance": min(run["clearance"] for run in runs),
    }


def measure_sweep(seeds: int, jobs: int, quick: bool, advance: Callable[[float], None]) -> dict[str, Any]:
    """Measure the whole sweep and, with a third of the seeds, the variants of one of its cells."""
    grid = cells(quick)
    variants = sensitivity()[: 2 if quick else None]
    variant_seeds = max(1, seeds // 3)
    work = seeds * len(grid), variant_seeds * len(variants)
    share = work[0] / sum(work)
    return {
        "seeds": seeds,
        "start": [-26.0, 0.0],
        "start_speed": 5.0,
        "rows": table(grid, seeds, jobs, lambda done: advance(share * done)),
        "sensitivity_seeds": variant_seeds,
        "sensitivity": table(variants, variant_seeds, jobs, lambda done: advance(share + (1.0 - share) * done)),
    }
