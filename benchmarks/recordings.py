"""The cost of a recording: reading it, and decisions of a robot in it at several times.

usage: python benchmarks/recordings.py FILE [--at 12.5 60 300] [--method nao_ahead nao_ahead@observed] [--out FOLDER]

Reading: the best of three, wall clock and processor time. Decisions: the median of the first 50 of a robot that crosses
the middle of the recorded positions. If the cost is the same at every time, it depends only on the agents that are
present. It then depends neither on the length of the recording nor on the number of agents in it.
"""

import argparse
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from machine import write

from slalom import method
from slalom.sim import simulate
from slalom.sim.files.recorded_traffic import crossing, read_recorded

DECISIONS = 50


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--at", type=float, nargs="+", default=[12.5, 60.0, 300.0])
    parser.add_argument("--method", nargs="+", default=["nao_ahead", "nao_ahead@observed", "nao", "nao@observed"])
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"))
    arguments = parser.parse_args()
    spent = []
    for _ in range(3):
        wall, processor = perf_counter(), process_time()
        recorded = read_recorded(arguments.file)
        spent.append((perf_counter() - wall, process_time() - processor))
    reading = {"wall_s": min(wall for wall, _ in spent), "processor_s": min(processor for _, processor in spent)}
    print(f"{arguments.file.name}: {len(recorded.obstacles)} agents, {recorded.span[1] - recorded.span[0]:.0f} s")
    print(f"read in {reading['wall_s']:.3f} s, {reading['processor_s']:.3f} s of processor time")
    positions = np.concatenate([obstacle.trajectory.positions for obstacle in recorded.obstacles])
    start, goal = np.quantile(positions, [0.05, 0.95], axis=0)
    rows = []
    for name in arguments.method:
        chosen = method(name)
        for at in arguments.at:
            spans = [obstacle.trajectory.span for obstacle in recorded.obstacles]
            there = sum(first <= at <= last for first, last in spans)
            scenario = crossing(recorded, start, goal, at=at)
            simulate(scenario.with_settings({"duration": scenario.dt}), chosen)
            spent_us = simulate(scenario, chosen).decision_times[:DECISIONS, 0] * 1e6
            median, most = (float(q) for q in np.quantile(spent_us, [0.5, 1.0]))
            rows.append({"method": name, "at": at, "there": there, "median_us": median, "max_us": most})
            print(f"{name:20} at {at:7.1f} s, {there:3} present: median {median:8.0f} us, largest {most:8.0f} us")
    write("recordings", {"file": arguments.file.name, "reading": reading, "decisions": rows}, arguments.out)


if __name__ == "__main__":
    main()
