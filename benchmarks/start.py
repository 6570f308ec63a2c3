"""Time until the first result, on a fresh installation and afterwards.

usage: python benchmarks/start.py [--quick] [--out FOLDER]

Each row is a process of its own, from its start to its end. Fresh: with an empty cache, so that kernels are compiled.
Afterwards: with the kernels in the cache. The import times of numpy and numba are given for comparison, as lower
bounds.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from program import finish, options, table, target

from slalom.io.table import sample_data

REPEATS = 3
"""Runs with a full cache."""
SCENE = sample_data("crossing.yaml")
DECIDE = """
import slalom
limits = slalom.Limits(max_speed=10.0, max_acceleration=4.0)
navigator = slalom.Navigator(slalom.method("nao"), slalom.Disc(1.0), limits)
paths = [slalom.Circular((20.0 + k, 5.0 * (k % 6) - 12.0), 12.0, 5.0, phase=0.9 * k) for k in range(30)]
cars = [slalom.Obstacle(slalom.Disc(1.0), path) for path in paths]
navigator.decide(slalom.State((0.0, 0.0), (5.0, 0.0)), cars, slalom.Goal(slalom.Stationary((60.0, 0.0))))
"""
FLEET = """
from slalom import method
from slalom.sim import gallery, simulate
simulate(gallery.build("ring", {"robots": 20, "duration": 0.2}), method("nao"))
"""
PYTHON = [sys.executable, "-c"]
COMMAND = [sys.executable, "-m", "slalom"]
MODULES = "import sys; from slalom.cli import call; call(['--help']); sys.exit('numba' in sys.modules)"


def seconds(words: list[str], cache: Path | None, terminal: bool = False) -> float:
    """Time of a process [s] with its kernels in `cache`; its messages go to a terminal or to a pipe."""
    environment = dict(os.environ) if cache is None else os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    ends = os.openpty() if terminal else ()
    errors = ends[1] if ends else subprocess.PIPE
    before = perf_counter()
    done = subprocess.run(words, env=environment, stdout=subprocess.DEVNULL, stderr=errors, check=False)
    spent = perf_counter() - before
    for end in ends:
        os.close(end)
    if done.returncode:
        raise SystemExit(f"{' '.join(words)[:80]}: expected exit code 0, found {done.returncode}: {done.stderr!r}")
    return spent


def both(words: list[str], quick: bool, terminal: bool = False) -> tuple[float, float]:
    """Time with an empty cache, and the median with the cache it left [s]; quick: with the usual cache."""
    if quick:
        return (seconds(words, None, terminal),) * 2
    with TemporaryDirectory() as folder:
        cache = Path(folder)
        fresh = seconds(words, cache, terminal)
        return fresh, median(seconds(words, cache, terminal) for _ in range(REPEATS))


def measure(quick: bool) -> dict[str, Any]:
    """All rows."""
    repeats = 1 if quick else REPEATS
    again: Callable[[list[str]], float] = lambda words: median(seconds(words, None) for _ in range(repeats))  # noqa: E731
    numpy, numba, help_ = (
        again([*PYTHON, "import numpy"]),
        again([*PYTHON, "import numba"]),
        again([*COMMAND, "--help"]),
    )
    seconds([*PYTHON, MODULES], None)
    rows: dict[str, tuple[float, float]] = {"the first decision, from Python": both([*PYTHON, DECIDE], quick)}
    if hasattr(os, "openpty"):
        rows["slalom decide, at a terminal"] = both([*COMMAND, "decide", str(SCENE)], quick, terminal=True)
    rows["the first step of a fleet"] = both([*PYTHON, FLEET], quick)
    heads = ["what", "fresh s", "afterwards s", "fresh over import numba", "afterwards over import numba"]
    lines = [[what, *pair, *(one / numba for one in pair)] for what, pair in rows.items()]
    first, later = rows["the first decision, from Python"]
    targets = [
        target("slalom --help, without importing numba", help_, most=0.3, unit="s"),
        target("the first decision afterwards", later, most=1.0, unit="s"),
        target("the first decision, fresh, from Python", first, most=32.0, unit="s"),
    ]
    if "slalom decide, at a terminal" in rows:
        fresh = rows["slalom decide, at a terminal"][0]
        targets.append(target("the first decision, fresh, at a terminal", fresh, most=32.0, unit="s"))
    return {
        "question": "Time until the first result",
        "parameters": {"repeats": repeats},
        "tables": [
            table("Time of a process", heads, lines),
            table(
                "For comparison",
                ["what", "s"],
                [["import numpy", numpy], ["import numba", numba], ["slalom --help", help_]],
            ),
        ],
        "targets": targets,
        "results": {"seconds": {"import numba": numba, **{what: list(pair) for what, pair in rows.items()}}},
    }


def main() -> None:
    """Measure, print, write."""
    arguments = options(__doc__).parse_args()
    finish("start", measure(arguments.quick), arguments)


if __name__ == "__main__":
    main()
