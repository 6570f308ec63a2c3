"""Robot that looks ahead with several margins and takes the decision of least expected loss of time."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.checks import UNCERTAINTY, Array, flag, has, listing, not_negative
from slalom.control_obstacle import ControlObstacle
from slalom.decision import Decision, Outcome
from slalom.decision.decision import DecisionInputs, completed, made
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.kernels.arrays import Flags
from slalom.lookahead.deviations import Deviations
from slalom.lookahead.navigator import LookAhead, SequenceDecision
from slalom.lookahead.scene import motions_of, rise_of
from slalom.obstacle import Obstacle
from slalom.obstacle.window import Obstacles, ObstacleWindow, each_of, listed
from slalom.state import State
from slalom.tolerances import DEVIATION_GAIN, LOSS_DISCOUNT, LOSS_STEPS, LOSS_TIMES, WHOLE_COUNT
from slalom.uncertainty import BoundedError, Scaled, Uncertainty


@dataclass(frozen=True)
class ExpectedLoss:
    """Robot that weighs time against closeness: of several plans and deviations it takes that of least expected loss.

    A large margin tolerates errors of the forecast and costs time. No margin suits all scenes, so `robot` plans with
    each, and with a share of the uncertainty of the obstacles. The cost of a plan is its time to arrival, and `loss`
    times the expected number of contacts. Then deviations are tried that take two other velocities, each for one stage.
    A stage is the time from rest to the maximum speed in whole periods. A deviation costs the time of the plan and the
    way back to the plan at the maximum speed. It is taken if its cost is lower by DEVIATION_GAIN.

    Errors of the forecast are small most of the time and large at times. Let c be the distance from an
    obstacle. The probability that the error in its direction exceeds c is taken to be 1 / (2 (1 + c / spread)^2). The
    expected number of contacts is the sum over obstacles and LOSS_TIMES moments, with less weight for later moments.
    A future of an obstacle counts with its probability.

    Law: a plan is a decision of `robot` with one of the margins, so it has the guarantee of `LookAhead` with that
    margin. Without deviations and with one margin the decision is that of `LookAhead`. A deviation has the outcome
    DEVIATING and no guarantee. Shapes count as their bounding balls in the cost.

    Attributes:
        robot: looks ahead; its margin is replaced.
        margins: [m] each of at least 0.
        shares: of the uncertainty of every obstacle, one for each margin, from 0 to 1.
        loss: [s] of time that one expected contact is worth.
        spread: scale of the error of the forecast by prediction time.
        deviates: whether deviations are tried.
    """

    robot: LookAhead
    margins: Sequence[float] = (0.05, 0.1, 0.2, 0.3)
    shares: Sequence[float] = (0.0, 1.0, 1.0, 1.0)
    loss: float = 120.0
    spread: Uncertainty = field(default_factory=lambda: BoundedError(0.005, 0.0, 0.08))
    deviates: bool = True

    def __post_init__(self) -> None:
        has(self.robot, ("navigator", "decide", "time_horizon"), "a LookAhead", "robot")
        listing(self.margins, "margins", "margins")
        margins = tuple(not_negative(margin, f"margins[{k}]") for k, margin in enumerate(self.margins))
        if not margins:
            raise InvalidInput("margins: expected one or more, found none")
        listing(self.shares, "shares of the uncertainty", "shares")
        shares = tuple(not_negative(share, f"shares[{k}]") for k, share in enumerate(self.shares))
        if len(shares) != len(margins) or max(shares) > 1.0:
            raise InvalidInput(f"shares: expected {len(margins)} numbers from 0 to 1, found {list(shares)}")
        has(self.spread, *UNCERTAINTY, "spread")
        flag(self.deviates, "deviates")
        for name, value in (("margins", margins), ("shares", shares), ("loss", not_negative(self.loss, "loss"))):
            object.__setattr__(self, name, value)

    def decide(
        self,
        state: State,
        obstacles: Obstacles,
        goal: Goal,
        *,
        now: float = 0.0,
        previous: Decision | None = None,
        delay: float = 0.0,
    ) -> Decision:
        """As `LookAhead.decide`, with the plan or the deviation of least cost; of equal costs the first plan."""
        one_by_one = each_of(obstacles)
        motions = self._motions(one_by_one, now)
        ahead = self._ahead(motions, self._times(now), now)
        best: tuple[float, Decision] | None = None
        scenes: dict[float, tuple[LookAhead, Sequence[Obstacle]]] = {}
        for margin, share in zip(self.margins, self.shares, strict=True):
            if share not in scenes:
                around = [_with_share(obstacle, share) for obstacle in one_by_one] if share < 1.0 else one_by_one
                scenes[share] = self.robot.prepared_for(around, now), around
            shared, around = scenes[share]
            robot = replace(shared, navigator=replace(shared.navigator, margin=margin))
            decision = robot.decide(state, around, goal, now=now, previous=previous, delay=delay)
            cost = self._cost(decision, ahead, goal, now)
            if best is None or cost < best[0]:
                best = cost, decision
        assert best is not None
        if not self.deviates or delay > 0.0:
            return best[1]
        return self._deviation(best, state, obstacles, motions, ahead, goal, now, previous) or best[1]

    def cost(self, decision: Decision, obstacles: Obstacles, goal: Goal, now: float) -> float:
        """Time [s] from `now` to the arrival, and `loss` for each expected contact.

        Without a known arrival the time is an estimate: three times the span of the moments, and the rest of the way at
        the maximum speed. The rest begins at the position at the last moment. The first term exceeds the span, so that
        a known arrival is preferred.
        """
        motions = self._motions(each_of(obstacles), now)
        return self._cost(decision, self._ahead(motions, self._times(now), now), goal, now)

    def contacts(self, places: Array, obstacles: Obstacles, times: npt.ArrayLike, now: float) -> Array:
        """Expected number of contacts (..., n) of robots at `places` (..., n, d) [m] at `times` (n,) [s]."""
        times = np.asarray(times, dtype=np.float64)
        return _contacts(places, self._ahead(self._motions(each_of(obstacles), now), times, now))

    def _motions(self, obstacles: Sequence[Obstacle], now: float) -> list[Obstacle]:
        return motions_of(self.robot.navigator, [obstacle for obstacle in obstacles if obstacle.exists(now)], now)

    @property
    def _stage(self) -> float:
        """[s] from rest to the maximum speed, in whole periods."""
        period = self.robot.navigator.period
        return period * max(1, int(np.ceil(rise_of(self.robot.navigator) / period - WHOLE_COUNT)))

    def _times(self, now: float) -> Array:
        return now + self._stage * np.arange(1, LOSS_TIMES + 1, dtype=np.float64) / LOSS_STEPS

    def _sum(self, contacts: Array) -> Array:
        """Weighted sum (...) of contacts (..., n) at all moments."""
        stages = np.arange(LOSS_TIMES) // LOSS_STEPS
        return np.asarray(contacts @ (LOSS_DISCOUNT**stages / LOSS_STEPS))

    def _cost(self, decision: Decision, ahead: "_Ahead", goal: Goal, now: float) -> float:
        places = decision.manoeuvre.position(self._times(now))
        contacts = float(self._sum(_contacts(places, ahead)))
        return self._time(decision, goal, now, places[-1]) + self.loss * contacts

    def _time(self, decision: Decision, goal: Goal, now: float, end: Array) -> float:
        if isinstance(decision, SequenceDecision) and np.isfinite(decision.arrival):
            return decision.arrival - now
        left = float(np.linalg.norm(end - goal.trajectory.position(now))) / self.robot.navigator.limits.max_speed
        return 3.0 * float(self._times(0.0)[-1]) + left

    def _ahead(self, motions: Sequence[Obstacle], times: Array, now: float) -> "_Ahead":
        """The obstacles at `times` (m,) [s]."""
        own, d = self.robot.navigator.robot.bounding_radius, self.robot.navigator.robot.dimension
        positions, present = np.zeros((len(motions), len(times), d)), np.ones((len(motions), len(times)), np.bool_)
        for k, motion in enumerate(motions):
            first, last = motion.trajectory.span
            there = present[k] = (first <= times) & (times <= last)
            positions[k, there] = motion.trajectory.position(times[there])
        radii = np.array([own + motion.shape.bounding_radius for motion in motions])
        weights = np.array([motion.probability for motion in motions])
        return _Ahead(positions, present, radii, self.spread.radius(times - now, d).clip(1e-300), weights)

    def _deviation(
        self,
        plan: tuple[float, Decision],
        state: State,
        obstacles: Obstacles,
        motions: Sequence[Obstacle],
        ahead: "_Ahead",
        goal: Goal,
        now: float,
        previous: Decision | None,
    ) -> Decision | None:
        """The deviation of least cost; None if none costs less than the plan by DEVIATION_GAIN."""
        navigator, times, motion = self.robot.navigator, self._times(now), plan[1].manoeuvre
        others = Deviations.of(motion, state, navigator.limits, self._stage, now)
        places = others.positions(times)
        back = np.linalg.norm(places[:, 2 * LOSS_STEPS - 1] - motion.position(times[2 * LOSS_STEPS - 1]), axis=-1)
        contacts = self._sum(_contacts(places, ahead))
        costs = back / navigator.limits.max_speed + self.loss * contacts
        costs += self._time(plan[1], goal, now, motion.position(times[-1]))
        k = int(np.argmin(costs)) if len(costs) else -1
        if k < 0 or costs[k] >= plan[0] - DEVIATION_GAIN:
            return None
        chosen = others.manoeuvre(k)
        table = ObstacleWindow(motions, now, navigator.horizon)
        blocked = ControlObstacle(chosen.response, state, table, navigator.robot, 0.0)
        decision = Decision(chosen, Outcome.DEVIATING, chosen.control, made(blocked))
        inputs = DecisionInputs(navigator, state, tuple(listed(obstacles)), goal, None, now, None, None)
        return completed(decision, inputs, previous, None, np.inf)


class _Ahead(NamedTuple):
    """Obstacles at m moments."""

    positions: Array  # (n, m, d) [m]
    present: Flags  # (n, m) whether they exist
    radii: Array  # (n,) [m] sum of bounding radii with the robot
    spread: Array  # (m,) [m]
    weights: Array  # (n,) [1] probabilities


def _contacts(places: Array, ahead: _Ahead) -> Array:
    """Expected number of contacts (..., m) of robots at `places` (..., m, d) [m]."""
    gaps = np.linalg.norm(ahead.positions - places[..., None, :, :], axis=-1) - ahead.radii[:, None]
    beyond = 0.5 / (1.0 + np.abs(gaps) / ahead.spread) ** 2
    each = np.where(ahead.present, np.where(gaps < 0.0, 1.0 - beyond, beyond), 0.0)
    return np.asarray((ahead.weights[:, None] * each).sum(axis=-2))


def _with_share(obstacle: Obstacle, share: float) -> Obstacle:
    """The obstacle with that share of its uncertainty."""
    if obstacle.uncertainty is None:
        return obstacle
    return replace(obstacle, uncertainty=Scaled(obstacle.uncertainty, share) if share > 0.0 else None)
