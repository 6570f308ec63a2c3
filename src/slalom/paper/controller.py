"""Controller of the paper: at every decision one constant acceleration outside the AO or NAO.

It has one response, no speed limit, and the latest collision as its only fallback, as the paper describes. The motion
is integrated exactly; separate code finds collisions afterwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.tolerances import COMMITTED_SLACK, CONTACT_SLACK
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select
from slalom.decision.methods import METHODS
from slalom.forecast.forecast import Known
from slalom.model.goal import Goal
from slalom.model.limits import Admissible, Limits, admissible_ball
from slalom.model.response import Acceleration
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow
from slalom.paper.car_lanes import CarLanes
from slalom.sim import Recording, Robot, Scenario
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import nearest_clearances
from slalom.sim.measure.metrics import COLLISION, adjustments, mean_acceleration, mean_jerk
from slalom.sim.measure.recording import RunLog, Step
from slalom.sim.run.states import integrate

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
    log.end(state.position[None], state.velocity[None], np.array([arrived]))
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
