"""The paper's own way of driving: at every decision one constant acceleration outside the AO or NAO.

No other response, no speed limit, no fallback but the latest collision: what the paper describes and nothing that
`Navigator` adds. The robot moves exactly; collisions are judged afterwards, by other code.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.control_obstacle import ControlObstacle
from slalom.forecast import Known
from slalom.goal import Goal
from slalom.limits import Admissible, Limits, admissible_ball
from slalom.methods import METHODS
from slalom.obstacle import Obstacle
from slalom.obstacle_table import ObstacleTable
from slalom.paper.fleet import CarLanes
from slalom.response import Acceleration
from slalom.selection import select
from slalom.shape import Disc
from slalom.sim import Recording, Robot, Scenario
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import closest_approaches, positions_at
from slalom.sim.measure.metrics import adjustments, mean_acceleration, mean_jerk
from slalom.sim.measure.run_log import RunLog, Step
from slalom.sim.run.robot_states import integrate
from slalom.state import State
from slalom.tolerances import COLLISION, COMMITTED_SLACK, CONTACT_SLACK
from slalom.trajectory import Stationary

RESPONSE: Final = Acceleration()
ROBOT: Final = Disc(1.0)
NO_LIMIT: Final = 1e3
"""[m/s] A speed that is never reached: the paper's definitions know no limit."""
RING: Final = 26.0
"""[m] The robot starts and ends its run at this distance from the centre of the roundabout."""
CRUISE: Final = 8.0
"""[m/s] Speed at which it wants to go to its goal."""
SOON: Final = 1.0
"""[s] Time in which it wants to have that velocity."""
MARGIN: Final = 0.05
"""[m] What it wants to keep from every car."""
LONGEST: Final = 20.0
"""[s] A run that has not left the roundabout by then is over."""


@dataclass(frozen=True)
class Rules:
    """How to decide: the rows of the sweep.

    Attributes:
        method: "ao" or "nao": what is assumed of the cars. replan: [s] between decisions.
        neighbours: how many cars are looked at, the nearest first; 0 for all.
        keep: whether a present acceleration that is still free is kept, else the one nearest to the preferred is
            chosen again at every decision.
        max_acceleration: [m/s^2]. horizon: [s].
    """

    method: str
    replan: float
    neighbours: int = 0
    keep: bool = True
    max_acceleration: float = 4.0
    horizon: float = 6.0


class Run(NamedTuple):
    """A finished run: the recording, the status of each decision, and whether the robot left the ring."""

    recording: Recording
    statuses: tuple[str, ...]
    out: bool


def preferred_acceleration(state: State, goal: Array, most: float) -> Array:
    """The acceleration (2,) that gives the velocity CRUISE towards `goal` within SOON, or as much of it as allowed."""
    away = goal - state.position
    wish = (CRUISE * away / max(float(np.linalg.norm(away)), 1e-9) - state.velocity) / SOON
    return np.asarray(wish * min(1.0, most / max(float(np.linalg.norm(wish)), 1e-300)))


def decide(
    state: State, traffic: ObstacleTable, rules: Rules, preferred: Array, present: Array | None
) -> tuple[Array, str]:
    """The acceleration (2,) for the next interval and how it came about; `present` is the one in force."""
    ball = admissible_ball((0.0, 0.0), rules.max_acceleration)
    bare = ControlObstacle(RESPONSE, state, traffic, ROBOT)
    if len(bare.overlapping):
        return (np.zeros(2) if present is None else present), "OVERLAPPING"
    blocked = ControlObstacle(
        RESPONSE, state, traffic, ROBOT, np.clip(bare.initial_clearances - CONTACT_SLACK, 0.0, MARGIN)
    )
    if rules.keep and present is not None and float(blocked.clearance(present)) >= -COMMITTED_SLACK:
        return present, "KEPT"
    choice = select(preferred, ball, blocked)
    if choice.control is None:
        choice = select(preferred, ball, bare)
    if choice.control is not None:
        return choice.control, choice.status.name
    return latest_collision(preferred, ball, bare), "DELAYED"


def latest_collision(preferred: Array, ball: Admissible, blocked: ControlObstacle, accuracy: float = 0.01) -> Array:
    """The acceleration (2,) whose collision is latest, to `accuracy` [s]: bisection on the horizon."""
    low, high, best = 0.0, blocked.horizon, preferred
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        choice = select(preferred, ball, replace(blocked, horizon=middle))
        if choice.control is None:
            high = middle
        else:
            low, best = middle, choice.control
    return best


def run(rules: Rules, obstacles: Sequence[Obstacle], start: State, goal: Array, longest: float = LONGEST) -> Run:
    """Drive from `start` until the robot is RING away from the centre again, or `longest` [s] is over."""
    fleet = CarLanes(obstacles, known=METHODS[rules.method].forecast == Known())
    state, present, out = start, None, False
    robot = Robot(ROBOT, Limits(NO_LIMIT, rules.max_acceleration), start, Goal(Stationary(goal), 1.0))
    scenario = Scenario("roundabout_crossing", (robot,), tuple(obstacles), dt=rules.replan)
    log = RunLog(scenario, rules.method, 0, METHODS[rules.method].foresight)
    for k in range(round(longest / rules.replan)):
        now = k * rules.replan
        traffic = fleet.traffic(now, rules.horizon, state.position, rules.neighbours)
        preferred = preferred_acceleration(state, goal, rules.max_acceleration)
        present, status = decide(state, traffic, rules, preferred, present)
        rows = (state.position[None], state.velocity[None], present[None], present[None])
        log.steps.append(Step(*rows, (repr(RESPONSE),), (status,), np.zeros(1)))
        state = State(*integrate(state.position, state.velocity, present, rules.replan), present)
        out = bool(np.linalg.norm(state.position) > RING)
        if out:
            break
    end = rules.replan * len(log.steps)
    arrived = end if robot.goal.reached(state.position, state.velocity, end) else np.inf
    log.end(state.position[None], state.velocity[None], np.array([arrived]))
    return Run(Recording.of(log), tuple(step.outcomes[0] for step in log.steps), out)


def hits(recording: Recording) -> tuple[int, float]:
    """How many obstacles the robot overlapped by more than COLLISION, and the least clearance [m].

    In continuous time, by `sim/contact.py`; obstacles that `_bounds` show to be neither hit nor the nearest are not
    asked about.
    """
    low, high = _bounds(recording)
    near = [o for o, least in zip(recording.obstacles, low) if least < max(0.0, high.min(initial=np.inf))]
    clearances = [closest.clearance for closest in closest_approaches(replace(recording, obstacles=tuple(near)))]
    return sum(c < -COLLISION for c in clearances), min(clearances, default=np.inf)


def _bounds(recording: Recording, longest: float = 0.1) -> tuple[Array, Array]:
    """Lower and upper bounds (n,) [m] of the least clearance to each obstacle, all round.

    From one sample to the next the relative position stays within M h^2 / 8 of the chord, M a bound of the relative
    acceleration; steps h are at most `longest` [s].
    """
    end = float(recording.times[-1])
    times = np.linspace(0.0, end, max(2, int(np.ceil(end / longest)) + 1))
    own = positions_at(recording, 0, times)
    push = float(np.linalg.norm(recording.accelerations[:, 0], axis=1).max())
    low, high = np.empty(len(recording.obstacles)), np.empty(len(recording.obstacles))
    for k, obstacle in enumerate(recording.obstacles):
        away = obstacle.trajectory.position(times) - own
        along, here = np.diff(away, axis=0), away[:-1]
        share = -np.einsum("kd,kd->k", here, along) / np.maximum(np.einsum("kd,kd->k", along, along), 1e-300)
        chord = here + np.clip(share, 0.0, 1.0)[:, None] * along
        bend = (push + obstacle.trajectory.acceleration_bound(0.0, end)) * (times[1] - times[0]) ** 2 / 8.0
        touch = obstacle.shape.bounding_radius + ROBOT.bounding_radius
        low[k] = np.sqrt(np.einsum("kd,kd->k", chord, chord).min()) - bend - touch
        high[k] = np.sqrt(np.einsum("kd,kd->k", away, away).min()) - touch
    return low, high


@lru_cache(maxsize=1024)
def crossing_scenario(seed: int, speed: float) -> Scenario:
    """The crossing with the cars of `seed`, their speeds times `speed`; kept, since every row uses the same seeds."""
    return build("roundabout_crossing", {"speed": speed}, seed=seed)


def row(rules: Rules, seed: int, speed: float) -> dict[str, Any]:
    """One run of the crossing with the cars of `seed`, their speeds times `speed`, as plain numbers."""
    scenario = crossing_scenario(seed, speed)
    done = run(rules, scenario.obstacles, scenario.robot.state, np.array([RING, 0.0]))
    hit, clearance = hits(done.recording)
    last = done.recording.positions[-1, 0]
    return {
        "hits": hit,
        "clearance": clearance,
        "adjustments": int(adjustments(done.recording)),
        "decisions": len(done.statuses),
        "mean_acceleration": mean_acceleration(done.recording),
        "mean_jerk": mean_jerk(done.recording),
        "delayed": done.statuses.count("DELAYED"),
        "time": float(done.recording.times[-1]),
        "out": done.out,
        "far_side": done.out and bool(last[0] >= abs(last[1])),
    }
