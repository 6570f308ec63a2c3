"""Answers of an objective that is written in Python to the kernels that decide."""

from ctypes import c_void_p, cast
from typing import TYPE_CHECKING

import numpy as np

from slalom.checks import Array
from slalom.decision.request import Request
from slalom.decision.robot_tables import RobotRow
from slalom.kernels.decision.tables import CALLBACK, PREFERRED, Objectives, Paths
from slalom.linear_forecast import piecewise_polynomial
from slalom.objective import Objective, Situation, preferred_control
from slalom.path import Path
from slalom.response import Response
from slalom.state import State

if TYPE_CHECKING:
    from slalom.decision.navigator import Navigator


class ObjectiveInPython:
    """The preferred controls and costs of one decision, which the kernels ask for.

    Args:
        objective: asked. navigator: with the limits that hold for this decision. request: its input.
        responses: of the robot, in the order of its table. own: its row, with the state from which the kernels ask.
        pieces: of the paths in its tables.
    """

    def __init__(
        self,
        objective: Objective,
        navigator: "Navigator",
        request: Request,
        responses: tuple[Response, ...],
        own: RobotRow,
        pieces: int,
    ) -> None:
        self.objective, self.navigator, self.request = objective, navigator, request
        self.responses, self.own = responses, own
        self.failure: BaseException | None = None
        self._callback = CALLBACK(self._answer)
        self._situations: dict[tuple[int, bytes], Situation] = {}
        self._preferred = np.zeros(3)
        self._path = Paths(np.zeros((1, pieces + 1)), np.zeros((1, pieces, 4, 3)))

    def table(self, none: Objectives) -> Objectives:
        """The table by which kernels ask: `none`, of no objective, with the address and the arrays of this one."""
        address = cast(self._callback, c_void_p).value or 0
        return none._replace(address=address, preferred=self._preferred, path=self._path)

    def raise_failure(self) -> None:
        """Raise what the objective raised when it was asked: a kernel cannot pass it on."""
        if self.failure is not None:
            raise self.failure

    def _answer(self, question: int, response: int, until: float, to: float) -> float:
        if self.failure is None:
            try:
                if question == PREFERRED:
                    control = preferred_control(self.objective.aims(self._situation(response)))
                    self._preferred[: len(control)] = control
                    return 0.0
                until, to = self.request.now + until, self.request.now + max(until, to)
                motion = piecewise_polynomial(*self._motion(until))
                return float(self.objective.cost(motion, self._situation(0), to))
            except BaseException as failure:
                self.failure = failure
        return np.inf

    def _situation(self, k: int) -> Situation:
        """The input of the objective for response k, in the state that the row has now."""
        own = self.own
        key = k, own.position.tobytes() + own.velocity.tobytes() + own.acceleration.tobytes()
        if key not in self._situations:
            state = State(own.position.copy(), own.velocity.copy(), own.acceleration.copy(), self.request.state.heading)
            target, now = self.request.target, self.request.now
            self._situations[key] = self.navigator.situation(self.responses[k], state, target, now)
        return self._situations[key]

    def _motion(self, until: float) -> tuple[Array, Array]:
        """Times (n + 1,) [s] and points (n, 4, d) [m] of the path up to `until` [s], then at constant velocity."""
        times, points = self._path.times[0], self._path.points[0][..., : len(self.own.position)]
        begin = np.flatnonzero((np.diff(times) > 0.0) & (times[:-1] < until))
        knots = np.append(times[begin], times[begin[-1] + 1])
        path = Path(knots, points[begin], np.zeros(len(begin))).cut(np.append(knots[:-1], until))
        last, duration = path.points[-1], path.times[-1] - path.times[-2]
        way = (last[3] - last[2]) * (3.0 * self.navigator.horizon / duration)
        straight = last[3] + way * (np.arange(4.0)[:, None] / 3.0)
        return np.append(path.times, until + self.navigator.horizon), np.concatenate([path.points, straight[None]])
