"""The first steps of golden runs, with kernels compiled and as Python: equal digests, and which lines of kernels ran.

    python tools/debug_test.py                        # every fifth run; exit code 1 and the names of what differs
    python tools/debug_test.py --each 1 --steps 10    # all runs, for longer

As Python an index out of range is an error. Compiled it reads other memory.
"""

import argparse
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import portable

KERNELS = Path(__file__).parents[1] / "src" / "slalom" / "kernels"


def digests(each: int, steps: int) -> dict[str, str]:
    """The digests of the first `steps` of every run in `each`, and of some single answers."""
    import counts
    import golden

    from slalom.sim import Recording, Scenario, simulate

    def shortened(scenario: Scenario, method: Any, seed: int) -> Recording:
        return simulate(replace(scenario, duration=steps * scenario.dt), method, seed=seed)

    golden.simulate = shortened
    found: dict[str, str] = {}
    for job in [*list(golden.runs())[::each], (golden.choices, (0, 10)), (golden.boundaries, (0, 2))]:
        found |= golden.one(job)[0]
    (decide, _), (step, _) = counts.vehicle(), counts.filtered()
    command = decide().command
    return found | {"vehicle": golden.digest([command.speed, command.turn]), "filter": golden.digest(step()[0])}


def with_lines(each: int, steps: int) -> dict[str, str]:
    """The same; prints by file of kernels the share of lines that ran, and the numbers of the others."""
    import coverage

    lines = coverage.Coverage(data_file=None, source=[str(KERNELS)])
    with lines.collect():
        found = digests(each, steps)
    lines.report(show_missing=True, skip_covered=True)
    return found


def main() -> int:
    """1 where a digest differs; in the processes that this one starts: write the digests."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--each", type=int, default=5, help="of so many runs, one")
    parser.add_argument("--steps", type=int, default=3)
    parser.add_argument("--out", type=Path, help="where a process of one mode writes its digests")
    given = parser.parse_args()
    if given.out:
        make = with_lines if os.environ["NUMBA_DISABLE_JIT"] == "1" else digests
        given.out.write_text(json.dumps(make(given.each, given.steps)))
        return 0
    found: list[dict[str, str]] = []
    with TemporaryDirectory() as folder:
        for mode in "01":
            out = Path(folder, mode)
            if code := portable.run(Path(__file__), [*sys.argv[1:], "--out", str(out)], NUMBA_DISABLE_JIT=mode):
                return code
            found.append(json.loads(out.read_text()))
    compiled, as_python = found
    differing = [name for name, text in compiled.items() if as_python[name] != text]
    print(*(f"{name}: expected {compiled[name]} as compiled, found {as_python[name]}" for name in differing), sep="\n")
    print(f"{len(compiled)} digests, {len(differing)} differ as Python")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
