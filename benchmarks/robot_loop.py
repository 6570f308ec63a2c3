"""The loop of examples/07_tracked_people.py for a minute and many seeds: distances, wheels, longest decision.

usage: python benchmarks/robot_loop.py [--quick] [--seeds 20] [--out FOLDER]

Ten people do not avoid the robot. They are measured with noise, late and with dropouts. The robot is a differential
drive at 20 Hz in a hall of 200 wall segments. Each seed is another crowd. A decision is everything from the tracks to
the command of the wheels. Times are processor times, so that other processes count little.
"""

import gc
import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from program import finish, options, table, target

EXAMPLE = Path(__file__).parents[1] / "examples" / "07_tracked_people.py"


def example() -> ModuleType:
    """The example as a module."""
    spec = importlib.util.spec_from_file_location("tracked_people", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["tracked_people"] = module
    spec.loader.exec_module(module)
    return module


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    arguments = parser.parse_args()
    seeds, duration = (1, 1.0) if arguments.quick else (arguments.seeds, 60.0)
    loop = example()
    loop.run(0, 2.0)  # loads what is compiled
    # As the example does: no full collection examines what was loaded.
    gc.collect()
    gc.freeze()
    runs = [loop.run(seed, duration) for seed in range(seeds)]
    rows = [
        [k, float(r.people), r.walls, 100.0 * r.wheels, r.distance, int(r.unsafe), 1e3 * r.median, 1e3 * r.slowest]
        for k, r in enumerate(runs)
    ]
    result: dict[str, Any] = {
        "question": "A differential drive among tracked people.",
        "parameters": {"seeds": seeds, "duration": duration},
        "tables": [
            table(
                f"{duration:g} s at 20 Hz, ten people, 200 wall segments:",
                ["seed", "people m", "walls m", "wheels %", "driven m", "not safe", "median ms", "longest ms"],
                rows,
            )
        ],
        "targets": [
            target("collisions with people", sum(bool(r.people <= 0.0) for r in runs), most=0),
            target("collisions with walls", sum(bool(r.walls <= 0.0) for r in runs), most=0),
            target("commands, share of the limits of the wheels", float(max(r.wheels for r in runs)), most=1.0 + 1e-9),
            target("longest decision", 1e3 * max(r.slowest for r in runs), most=20.0, unit="ms"),
            target("median decision", 1e3 * float(np.median([r.median for r in runs])), most=20.0, unit="ms"),
        ],
    }
    finish("robot_loop", result, arguments)


if __name__ == "__main__":
    main()
