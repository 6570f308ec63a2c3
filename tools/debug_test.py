"""The first steps of golden runs, with kernels compiled and as Python: equal digests, and which lines of kernels ran.

    python tools/debug_test.py                        # every fifth run; exit code 1 and the names of what differs
    python tools/debug_test.py --each 1 --steps 10    # all runs, for longer
    python tools/debug_test.py --entries FOLDER       # also with exported kernels; the others are compiled anew

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
    parser.add_argument("--entries", type=Path, help="a folder of `slalom compile --export`")
    parser.add_argument("--out", type=Path, help="where a process of one mode writes its digests")
    given = parser.parse_args()
    if given.out:
        make = with_lines if os.environ["NUMBA_DISABLE_JIT"] == "1" else digests
        given.out.write_text(json.dumps(make(given.each, given.steps)))
        return 0
    with TemporaryDirectory() as folder:
        modes = {"compiled": {"NUMBA_DISABLE_JIT": "0"}, "as Python": {"NUMBA_DISABLE_JIT": "1"}}
        if given.entries:
            modes["compiled"]["NUMBA_CACHE_DIR"] = str(Path(folder, "anew"))
            shipped = {"SLALOM_ENTRIES": str(given.entries.resolve()), "NUMBA_CACHE_DIR": str(Path(folder, "beside"))}
            modes["shipped"] = modes["compiled"] | shipped
        found: dict[str, dict[str, str]] = {}
        for mode, settings in modes.items():
            out = Path(folder, mode)
            if code := portable.run(Path(__file__), [*sys.argv[1:], "--out", str(out)], **settings):
                return code
            found[mode] = json.loads(out.read_text())
        beside = len(list(Path(folder, "beside").rglob("*.entry")))
    expected = found.pop("compiled")
    differing = [(name, mode) for name in expected for mode, one in found.items() if one[name] != expected[name]]
    for name, mode in differing:
        print(f"{name}: expected {expected[name]} as compiled, found {found[mode][name]} {mode}")
    print(f"{len(expected)} digests, {len(differing)} differ {' or '.join(found)}")
    if given.entries:
        print(f"{beside} kernels were compiled beside the shipped ones")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
