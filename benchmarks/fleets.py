"""Many robots, the same algorithm in each: do all arrive, does nobody collide, how long does it take, beside ORCA and
its kin in the same simulator?

    python benchmarks/fleets.py [--seeds 5] [--jobs 2] [--only circle ring] [--out fleets.json] [--page docs/fleets.md]
"""

import argparse
import json
from pathlib import Path
from typing import Any

from machine import describe

from slalom.sim.study import compare

OURS = ("nao_shared", "nao", "vo", "rvo")
PEERS = ("orca", "orca_limited", "orca_inflated", "hrvo_limited", "hl_limited")
WALLS = tuple(name for name in PEERS if not name.startswith("hrvo"))
FEW = ("nao_shared", "nao", "orca", "orca_inflated")

ROWS: tuple[tuple[str, dict[str, float], tuple[str, ...]], ...] = (
    ("circle", {"robots": 2, "radius": 20}, (*OURS, *PEERS)),
    ("circle", {"robots": 4, "radius": 20}, (*OURS, *PEERS)),
    ("circle", {"robots": 10, "radius": 20}, (*OURS, *PEERS)),
    ("circle", {"robots": 40, "radius": 40}, FEW),
    ("circle", {"robots": 100, "radius": 100}, FEW[:1]),
    ("ring", {"robots": 10}, (*OURS, *PEERS)),
    ("ring", {"robots": 20}, (*OURS, *PEERS)),
    ("ring", {"robots": 50}, FEW),
    ("ring", {"robots": 50, "max_acceleration": 1.0}, FEW),
    ("random_goals", {"robots": 20, "side": 20}, (*OURS, *PEERS)),
    ("random_goals", {"robots": 50, "side": 25}, FEW),
    ("crossing_streams", {"robots": 20}, (*OURS, *PEERS)),
    ("corridor_swap", {"robots": 20}, (*OURS[:2], *WALLS)),
    ("doorway", {"robots": 20}, (*OURS[:2], *WALLS)),
    ("navground_antipodal", {}, (*OURS[:2], "navground_orca", "hrvo", "hl")),
    ("navground_cross", {}, (*OURS[:2], "navground_orca", "hrvo", "hl")),
)
"""Scenario, parameters, methods. As an acceleration limit is a part of ours, those of the peers that obey one are to be
compared; `orca` itself does not."""


def table(results: list[dict[str, Any]]) -> str:
    """Markdown."""
    lines = [
        "| scenario | method | runs | with a collision | all arrived | last arrival s | least clearance m |",
        "|---|---|---|---|---|---|---|",
    ]
    for result in results:
        settings = ", ".join(f"{k}={v:g}" for k, v in result["settings"].items())
        for name, row in result["methods"].items():
            spread = row["time_interval"]
            time = "-" if row["time"] is None else f"{row['time']:.1f}"
            time += f" ({spread[0]:.1f}-{spread[1]:.1f})" if spread else ""
            clearance = "-" if row["min_clearance"] is None else f"{row['min_clearance']:.3f}"
            lines.append(
                f"| {result['scenario']} {settings} | {name} | {row['runs']} | {share(row, 'runs_with_collision')} "
                f"| {share(row, 'runs_all_arrived')} | {time} | {clearance} |"
            )
    return "\n".join(lines)


def share(row: dict[str, Any], what: str) -> str:
    """A count and the interval of its share."""
    low, high = row[f"{what}_interval"]
    return f"{row[what]} ({100 * low:.0f}-{100 * high:.0f} %)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=None)
    parser.add_argument("--out", type=Path, default=Path("out/fleets.json"))
    parser.add_argument("--page", type=Path, default=None)
    arguments = parser.parse_args()
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    results = []
    for name, settings, methods in ROWS:
        if arguments.only is None or name in arguments.only:
            results.append(compare(name, methods, arguments.seeds, settings=settings, jobs=arguments.jobs))
            print(table(results[-1:]).split("\n", 2)[2], flush=True)
            arguments.out.write_text(json.dumps({"machine": describe(), "results": results}, indent=1))
    if arguments.page is not None:
        text = arguments.page.read_text()
        head = text[: text.index("| scenario |")] if "| scenario |" in text else text
        arguments.page.write_text(head + table(results) + "\n")


if __name__ == "__main__":
    main()
