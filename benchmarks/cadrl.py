"""The 1000 test cases of gym-collision-avoidance with two and three robots.

usage: python benchmarks/cadrl.py CASES.csv [CASES.csv ...] [--methods nao_shared,nao,orca] [--out RESULT.json]
       [--cases N] [--jobs N]

Prints for each file and method how many cases ended with all arrived and no collision, and the 50th, 75th and 90th
percentile of the extra time to goal: of each robot that arrived, its time less distance over preferred speed [s].
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from machine import describe

from slalom.io.cadrl import Case, read_cases
from slalom.peers import contender
from slalom.sim import simulate
from slalom.sim.crowds import cadrl
from slalom.sim.metrics import summary

PERCENTILES = (50, 75, 90)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--methods", default="nao_shared,nao,orca,orca_limited")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--cases", type=int, help="only the first so many of each file")
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    rows = []
    print(
        f"{'file':28} {'method':14} {'all arrived, none hit':>22} {'collided':>8} {'extra time [s] 50, 75, 90 %':>28}"
    )
    for path in asked.files:
        cases = read_cases(path)[: asked.cases]
        for name in asked.methods.split(","):
            runs = Parallel(n_jobs=asked.jobs)(delayed(run)(case, name) for case in cases)
            extra = np.concatenate([r["extra"] for r in runs])
            found = np.percentile(extra[np.isfinite(extra)], PERCENTILES)
            good = sum(r["arrived"] and not r["collisions"] for r in runs)
            hit = sum(r["collisions"] > 0 for r in runs)
            rows.append(
                {
                    "file": path.name,
                    "method": name,
                    "cases": len(cases),
                    "good": good,
                    "collided": hit,
                    "extra": list(found),
                }
            )
            times = "  ".join(f"{x:6.2f}" for x in found)
            print(f"{path.name:28} {name:14} {f'{good} of {len(cases)}':>22} {hit:8d} {times:>28}", flush=True)
    if asked.out is not None:
        asked.out.write_text(json.dumps({"machine": describe(), "rows": rows}, indent=1))


def run(case: Case, name: str) -> dict[str, Any]:
    """One case: whether all arrived, how many collisions, and the extra time of each robot [s]."""
    recording = simulate(cadrl(case), contender(name))
    result = summary(recording)
    ideal = np.linalg.norm(case.goals - case.starts, axis=1) / case.speeds
    return {
        "arrived": result["arrived"] == result["robots"],
        "collisions": int(result["collisions"]),
        "extra": np.asarray(recording.arrived) - ideal,
    }


if __name__ == "__main__":
    main()
