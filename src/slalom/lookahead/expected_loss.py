"""Robot that looks ahead with several margins and takes the decision of least expected loss of time."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, has, listing, not_negative
from slalom.decision import Decision
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.lookahead.navigator import LookAhead, SequenceDecision
from slalom.lookahead.scene import motions_of
from slalom.obstacle import Obstacle
from slalom.obstacle.window import Obstacles, each_of
from slalom.state import State
from slalom.tolerances import LOSS_DISCOUNT, LOSS_STEP, LOSS_TIMES
from slalom.uncertainty import BoundedError, Uncertainty


@dataclass(frozen=True)
class ExpectedLoss:
    """Robot that weighs time against closeness: of several margins it takes the one of least expected loss.

    A large margin tolerates errors of the forecast and costs time. No margin suits all scenes, so `robot` decides once
    with each. The cost of a decision is its time to arrival, and `loss` times the expected number of contacts. The size
    of an error is assumed to be exponentially distributed. At a distance c from an obstacle, the probability of a
    contact is exp(-c / spread). The expected number is the sum over obstacles, averaged over LOSS_TIMES moments. Later
    moments have less weight.

    Law: the decision is one of `robot` with one of the margins, so it has the guarantee of `LookAhead` with that
    margin. With one margin it is the decision of `LookAhead`. Shapes count as their bounding balls in the cost.

    Attributes:
        robot: looks ahead; its margin is replaced.
        margins: [m] each of at least 0.
        loss: [s] of time that one expected contact is worth.
        spread: mean error of the forecast by prediction time.
    """

    robot: LookAhead
    margins: Sequence[float] = (0.05, 0.1, 0.2, 0.3)
    loss: float = 5.0
    spread: Uncertainty = field(default_factory=lambda: BoundedError(0.1, 0.1))

    def __post_init__(self) -> None:
        has(self.robot, ("navigator", "decide", "time_horizon"), "a LookAhead", "robot")
        listing(self.margins, "margins", "margins")
        margins = tuple(not_negative(margin, f"margins[{k}]") for k, margin in enumerate(self.margins))
        if not margins:
            raise InvalidInput("margins: expected one or more, found none")
        has(self.spread, ("radius",), "an uncertainty, such as BoundedError(0.1)", "spread")
        object.__setattr__(self, "margins", margins)
        object.__setattr__(self, "loss", not_negative(self.loss, "loss"))

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
        """As `LookAhead.decide`, with the margin of least cost; of equal costs the first."""
        one_by_one = each_of(obstacles)
        shared = self.robot.prepared_for(one_by_one, now)
        motions = self._motions(one_by_one, now)
        best: tuple[float, Decision] | None = None
        for margin in self.margins:
            robot = replace(shared, navigator=replace(shared.navigator, margin=margin))
            decision = robot.decide(state, one_by_one, goal, now=now, previous=previous, delay=delay)
            cost = self._cost(decision, motions, goal, now)
            if best is None or cost < best[0]:
                best = cost, decision
        assert best is not None
        return best[1]

    def cost(self, decision: Decision, obstacles: Obstacles, goal: Goal, now: float) -> float:
        """Time [s] from `now` to the arrival, and `loss` for each expected contact.

        Without a known arrival the time is an estimate: three times the span of the moments, and the rest of the way at
        the maximum speed. The rest begins at the position at the last moment. The first term exceeds the span, so that
        a known arrival is preferred.
        """
        return self._cost(decision, self._motions(each_of(obstacles), now), goal, now)

    def contacts(self, places: Array, obstacles: Obstacles, times: npt.ArrayLike, now: float) -> Array:
        """Expected number of contacts (n,) of a robot at `places` (n, d) [m] at `times` (n,) [s]."""
        times = np.asarray(times, dtype=np.float64)
        return self._contacts(places, self._motions(each_of(obstacles), now), times, now)

    def _motions(self, obstacles: Sequence[Obstacle], now: float) -> list[Obstacle]:
        return motions_of(self.robot.navigator, [obstacle for obstacle in obstacles if obstacle.exists(now)], now)

    def _cost(self, decision: Decision, motions: Sequence[Obstacle], goal: Goal, now: float) -> float:
        times = now + self._step * np.arange(1, LOSS_TIMES + 1, dtype=np.float64)
        places = decision.manoeuvre.position(times)
        weights = LOSS_DISCOUNT ** np.arange(LOSS_TIMES)
        contacts = float(self._contacts(places, motions, times, now) @ weights / weights.sum())
        return self._time(decision, goal, now, places[-1]) + self.loss * contacts

    @property
    def _step(self) -> float:
        """[s] between the moments: the robot reacts after a period, and stops in the time of `max_speed`."""
        navigator = self.robot.navigator
        return LOSS_STEP * (navigator.period + navigator.limits.max_speed / navigator.limits.max_acceleration)

    def _time(self, decision: Decision, goal: Goal, now: float, end: Array) -> float:
        if isinstance(decision, SequenceDecision) and np.isfinite(decision.arrival):
            return decision.arrival - now
        left = float(np.linalg.norm(end - goal.trajectory.position(now))) / self.robot.navigator.limits.max_speed
        return 3.0 * self._step * LOSS_TIMES + left

    def _contacts(self, places: Array, motions: Sequence[Obstacle], times: Array, now: float) -> Array:
        own = self.robot.navigator.robot.bounding_radius
        spread = self.spread.radius(times - now, places.shape[-1])
        found = np.zeros(len(times))
        for obstacle in motions:
            ahead = obstacle.trajectory
            there = (ahead.span[0] <= times) & (times <= ahead.span[1])
            gaps = np.linalg.norm(ahead.position(times[there]) - places[there], axis=-1)
            gaps -= own + obstacle.shape.bounding_radius
            found[there] += np.exp(-np.maximum(gaps, 0.0) / spread[there])
        return found
