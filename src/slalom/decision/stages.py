"""Calls and times of the stages of a decision."""

import sys
from collections import Counter, defaultdict
from collections.abc import Callable
from time import perf_counter
from types import FrameType
from typing import Any, NamedTuple


class Stage(NamedTuple):
    """The work of one stage, without that of stages within it."""

    calls: int
    time: float  # [s]


def _functions() -> dict[str, tuple[Any, ...]]:
    """The functions in which each stage begins; `policy` is all of the compiled policy that no other stage is."""
    from slalom.decision import decision, policy_tables
    from slalom.kernels.decision import bodies, collision, costs, motion_clear, policy, response_motion
    from slalom.obstacle.window import ObstacleWindow

    return {
        "predict": (ObstacleWindow.predicted,),
        "gather": (policy_tables.PolicyTables.decision, bodies.obstacle_pieces),
        "policy": (policy.decide_all,),
        "keep": (policy.keep_committed, policy.committed_is_clear),
        "propose": (costs.optimistic_costs,),
        "certify": (motion_clear.met_by_preferred, response_motion.free_control),
        "choose": (policy.best_response,),
        "relax": (bodies.reduce_margin, policy.most_clearance, collision.latest_collision),
        "report": (decision.completed,),
    }


class _Clock:
    """Calls of each stage, and the time [s] in it: a profiler for `sys.setprofile`."""

    def __init__(self) -> None:
        # A compiled kernel has a code of its own when a profiler sees it.
        codes = {name: [getattr(one, "py_func", one).__code__ for one in some] for name, some in _functions().items()}
        self.names = {(code.co_filename, code.co_firstlineno): name for name, some in codes.items() for code in some}
        self.calls, self.spent = Counter[str](), defaultdict[str, float](float)
        self._inside, self._since = ["rest"], perf_counter()

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        name = self.names.get((frame.f_code.co_filename, frame.f_code.co_firstlineno))
        if name is None or event not in ("call", "return"):
            return
        now = perf_counter()
        self.spent[self._inside[-1]] += now - self._since
        self._since = now
        if event == "call":
            self.calls[name] += 1
            self._inside.append(name)
        else:
            self._inside.pop()


def stages_of(work: Callable[[], object]) -> dict[str, Stage]:
    """The stages of all decisions that `work` makes, alone or in fleets. Those in compiled kernels are in `policy`."""
    clock = _Clock()
    sys.setprofile(clock)
    try:
        work()
    finally:
        sys.setprofile(None)
    return {name: Stage(clock.calls[name], clock.spent[name]) for name in (*_functions(), "rest")}
