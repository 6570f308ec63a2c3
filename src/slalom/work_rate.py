"""Counted work per second of a computer, which relates the budget of a decision to time."""

from time import process_time
from typing import Final

import numpy as np

from slalom.decision import Decision
from slalom.decision.methods import METHODS
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Disc
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle.tracks import Tracks

WORK_DECISIONS: Final = 300
"""[1] Decisions from which the counted work in a second of a computer is measured.

Larger: a more exact figure that takes longer, about 0.3 ms for each decision. Smaller: a less exact one.
"""


def work_per_second() -> float:
    """Counted work [s] in a second of processor time on this computer, for `Navigator.decide(budget=)`.

    It is measured by decisions among 40 moving discs, with all that Python does around the kernels. For decisions of
    about 5 ms, pass budget = 0.005 * work_per_second(). The figure differs from call to call, and decisions that are to
    be repeated need the same budget: measure once, and keep the number.
    """
    navigator, goal = Navigator(METHODS["nao"], Disc(0.3), Limits(1.5, 1.5)), Goal(Stationary((20.0, 0.0)))
    rng, state = np.random.default_rng(0), State((0.0, 0.0), (1.0, 0.0))
    crowds = [Tracks(rng.uniform((1.5, -6.0), (12.0, 6.0), (40, 2)), rng.normal(size=(40, 2)), 0.25) for _ in range(30)]
    navigator.decide(state, crowds[0], goal)
    work, begin = 0.0, process_time()
    for k in range(WORK_DECISIONS):
        decision: Decision = navigator.decide(state, crowds[k % len(crowds)], goal)
        work += decision.work
    return work / (process_time() - begin)
