"""Time of the stages of one decision: one response of nao, 30 obstacles, 6 s.

usage: python benchmarks/stages.py [--scenes 60] [--quick] [--out FOLDER]

Every stage is timed alone, repeatedly on the same scene, and so is the whole decision. The rest is the part of the
whole that the stages do not explain. A stage that is timed alone finds its data in the processor's cache, and some of
its results are stored.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from machine import microseconds
from program import finish, options, table
from tasks import HORIZON, Task, families

from slalom import ControlObstacle, kernels, select
from slalom.base.tolerances import CANDIDATES, ELEMENTS
from slalom.decision.objective import Arrive, preferred_control
from slalom.kernels.relative_motion.segments import chord_distances

WHOLE = "the whole decision"
ONE_PASS = "of the choice: one pass of the chord test over all segments"
KERNEL = "of the choice: the kernel of the exchange"
REST = "the rest"


def stages(task: Task) -> dict[str, Callable[[], object]]:
    """The call of each stage, with the results of the earlier stages given."""
    b, s = task.blocked, task.situation
    robot = b.robot
    table_of, limits, wanted = b.segments.table, s.admissible.table, np.append(task.preferred, 0.0)
    gaps, columns = np.empty(len(table_of.radius)), (table_of.points, table_of.gains)

    def overlap_test() -> object:
        # Distances are stored per position of the robot; without the store they are computed again.
        b.obstacles._distances = None
        return b.obstacles.distances(robot, s.state.position)

    def whole() -> object:
        admissible = s.limits.admissible(s.response, s.state, HORIZON)
        preferred = preferred_control(Arrive().aims(s))
        fresh = ControlObstacle(b.response, b.state, b.obstacles.within(b.obstacles.until), robot, b.margin)
        return select(preferred, admissible, fresh)

    return {
        "limits to admissible controls": lambda: s.limits.admissible(s.response, s.state, HORIZON),
        "goal to preferred control": lambda: preferred_control(Arrive().aims(s)),
        "obstacles to pieces": lambda: b.obstacles.within(b.obstacles.until).bodies(robot),
        "overlap test": overlap_test,
        "pieces to segments": lambda: task.fresh().segments,
        "the choice": lambda: select(task.preferred, s.admissible, b),
        KERNEL: lambda: kernels.nearest_free(wanted, 2, limits, *b.table, ELEMENTS, CANDIDATES, np.inf),
        ONE_PASS: lambda: chord_distances(*columns, 1.0, 0.5, 0.0, gaps),
        WHOLE: whole,
    }


def measure(scenes: int, repeat: int) -> dict[str, Any]:
    """Median over the scenes of each stage [us], for both families."""
    rows, result = [], {}
    for family, tasks in families(scenes).items():
        spent: dict[str, list[float]] = {}
        for task in tasks:
            for name, call in stages(task).items():
                spent.setdefault(name, []).append(microseconds(call, repeat))
        parts = [each for name, each in spent.items() if name not in (WHOLE, KERNEL, ONE_PASS)]
        spent[REST] = (np.array(spent[WHOLE]) - np.sum(parts, axis=0)).tolist()
        medians = {name: float(np.median(each)) for name, each in spent.items()}
        late = {name: float(np.quantile(each, 0.99)) for name, each in spent.items()}
        segments = float(np.median([len(task.blocked.segments.begin) for task in tasks]))
        result[family] = {"segments": segments, "median_us": medians, "p99_us": late}
        rows += [[family, name, us, late[name], us / medians[WHOLE]] for name, us in medians.items()]
    heads = ["scenes", "stage", "median us", "99 % us", "share of the whole"]
    return {
        "question": "Time of the stages of one decision",
        "parameters": {"scenes": scenes, "obstacles": 30, "horizon_s": HORIZON, "response": "accelerate, then coast"},
        "tables": [table("Stages of one decision", heads, rows)],
        "targets": [],
        "results": result,
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--scenes", type=int, default=60)
    arguments = parser.parse_args()
    quick = arguments.quick
    finish("stages", measure(2 if quick else arguments.scenes, 3 if quick else 15), arguments)


if __name__ == "__main__":
    main()
