"""Errors of forecasts on recordings, with and without the motions of others.

usage: python benchmarks/forecasts.py DATA_DIR [--moments 40] [--out FOLDER] [--markdown]

DATA_DIR contains tasks.json, which names the recordings and the limits of their robots. At some moments of the first
120 s of a recording, `FromModels` predicts all agents that were observed for at least five samples. The times ahead
are 1, 2 and 3 times that of the robot from rest to its maximum speed. The forecast knows the past of all agents up to
the moment.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from machine import write
from rich.console import Console
from rich.progress import track

from slalom import FromModels
from slalom.io.formats import read_recording

FORECASTS = {"alone": FromModels(similar=0), "similar": FromModels()}
"""Without and with similar motions of others."""
SECONDS, OBSERVED, RISES = 120.0, 5, (1, 2, 3)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--moments", type=int, default=40, help="of each recording")
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"))
    parser.add_argument("--markdown", action="store_true", help="print the table of docs/foresight.md at the end")
    arguments = parser.parse_args()
    recordings = json.loads((arguments.data / "tasks.json").read_text())
    rows: list[dict[str, Any]] = []
    for name, entry in track(recordings.items(), "recordings", console=Console(stderr=True)):
        found = [{"recording": name, **row} for row in errors(arguments.data, entry, arguments.moments)]
        for row in found:
            means = " ".join(f"{key} {row[key]:8.3f} m" for key in FORECASTS)
            print(f"{name:28} {row['time']:7.2f} s {row['errors']:6d} errors  {means}")
        rows += found
    write("forecasts", {"rows": rows}, arguments.out)
    if arguments.markdown:
        print("\n".join(markdown(rows)))


def errors(folder: Path, entry: dict[str, Any], moments: int) -> Iterator[dict[str, Any]]:
    """The mean errors [m] of each forecast, for each time ahead [s], on one recording."""
    tracks = read_recording(folder / entry["file"], interpolation="linear")
    motions = [agent.trajectory for agent in tracks.agents.values()]
    rise, seen = entry["vmax"] / entry["amax"], OBSERVED * entry["dt"]
    begin = min(motion.span[0] for motion in motions)
    end = min(max(motion.span[1] for motion in motions), begin + max(SECONDS, 20.0 * rise))
    # A tenth of the recording is seen before the first forecast.
    found: dict[tuple[str, int], list[float]] = {(key, k): [] for key in FORECASTS for k in RISES}
    for now in np.linspace(begin + 0.1 * (end - begin), end - 1.5 * rise, moments).tolist():
        there = [motion for motion in motions if motion.span[0] + seen < now <= motion.span[1]]
        for key, forecast in FORECASTS.items():
            for motion, ahead in zip(there, forecast.predictions(there, now, rise, motions), strict=True):
                for k in RISES:
                    if now + k * rise <= motion.span[1]:
                        missed = ahead.each[0][1].position(now + k * rise) - motion.position(now + k * rise)
                        found[key, k].append(float(np.linalg.norm(missed)))
    for k in RISES:
        means = {key: float(np.mean(found[key, k])) if found[key, k] else np.nan for key in FORECASTS}
        yield {"time": k * rise, "errors": len(found["alone", k]), **means}


def markdown(rows: list[dict[str, Any]]) -> Iterator[str]:
    """The table with a line for each recording, the errors alone and with similar motions at each time."""
    heads = " | ".join(f"{k} {'rise' if k == 1 else 'rises'}" for k in RISES)
    yield f"| recording | rise | {heads} |"
    yield "|---" * (2 + len(RISES)) + "|"
    for name in dict.fromkeys(row["recording"] for row in rows):
        own = [row for row in rows if row["recording"] == name]
        cells = " | ".join(f"{row['alone']:.3g}, {row['similar']:.3g}" for row in own)
        yield f"| {name} | {own[0]['time']:.2g} s | {cells} |"


if __name__ == "__main__":
    main()
