"""Time of a decision by objectives in Python, as the processor time of `decide`, beside that of `Arrive`.

`python benchmarks/own_objectives.py` drives a robot across the roundabout (30 cars) and past one car.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np

import slalom
from slalom import Candidates, Situation
from slalom.sim import Scenario, gallery, simulate

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
pass_behind = import_module("20_pass_behind")


class Forwarding(slalom.Arrive):
    """`Arrive`, asked in Python."""

    def costs(self, candidates: Candidates, situation: Situation) -> Any:
        return candidates.costs


def times(scene: Scenario, objective: slalom.Objective) -> list[float]:
    """Processor times [s] of the decisions of a run."""
    found, decide = list[float](), slalom.Navigator.decide

    def timed(*args: Any, **options: Any) -> slalom.Decision:
        begin = thread_time()
        decision = decide(*args, **options)
        found.append(thread_time() - begin)
        return decision

    setattr(slalom.Navigator, "decide", timed)  # noqa: B010  # mypy refuses an assignment
    try:
        simulate(scene, "nao", objective=objective, seed=3)
    finally:
        setattr(slalom.Navigator, "decide", decide)  # noqa: B010
    return found


if __name__ == "__main__":
    scenes = {"30 cars": gallery.build("roundabout_crossing", seed=3), "one car": pass_behind.build(-8.0)}
    makers: dict[str, Callable[[], slalom.Objective]] = {
        "Arrive": slalom.Arrive,
        "one that forwards": Forwarding,
        "PassBehind": pass_behind.PassBehind,
    }
    print("| scene | objective | a decision, median, ms | of `Arrive` |\n|---|---|---|---|")
    for name, scene in scenes.items():
        medians = dict.fromkeys(makers, np.inf)
        for _ in range(5):
            for label, make in makers.items():
                medians[label] = min(medians[label], 1e3 * float(np.median(times(scene, make()))))
        for label, median in medians.items():
            print(f"| {name} | {label} | {median:.2f} | {median / medians['Arrive']:.1f} |")
