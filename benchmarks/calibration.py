"""Calibrated radii on recordings: the promised share of errors within them, and the measured one.

usage: python benchmarks/calibration.py DATA_DIR [--confidence 0.9 0.95 0.99] [--seconds 120] [--out FOLDER]
       [--markdown]

DATA_DIR contains tasks.json, which names the recordings. Agents are observed at the times of the recording, at most ten
times a second. A velocity is the difference of two observed positions. Each agent is predicted at constant velocity
over 1, 2, 4, 8, 16 and 40 observed steps, but at least over 0.25 s. `slalom.Calibration` judges a prediction when its
time has come.

Errors count once the recording has run 5 s longer than the prediction time. Rows with fewer than POOLED errors are
judged together. The last rows have each prediction time of several recordings, over all of their errors. Beside the
radius stands that of a constant velocity with a constant uncertainty of 0.2 m/s times the prediction time.
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

from slalom import Calibration, Tracks
from slalom.io.formats import read_recording
from slalom.io.recorded import RecordedTracks

STEPS, SHORTEST, OFTEN = (1, 2, 4, 8, 16, 40), 0.25, 0.1
WARM, POOLED = 5.0, 500
CONSTANT = 0.2


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--confidence", type=float, nargs="+", default=[0.9, 0.95, 0.99])
    parser.add_argument("--seconds", type=float, default=120.0, help="of each recording, or 400 observations if longer")
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"))
    parser.add_argument("--markdown", action="store_true", help="print the table of docs/foresight.md at the end")
    arguments = parser.parse_args()
    files = sorted({entry["file"] for entry in json.loads((arguments.data / "tasks.json").read_text()).values()})
    rows: list[dict[str, Any]] = []
    print(
        f"{'recording':34} {'lead s':>7} {'promised':>9} {'measured':>9} {'errors':>7} {'radius m':>9} {'constant':>9}"
    )
    for file in track(files, "recordings", console=Console(stderr=True)):
        tracks = read_recording(arguments.data / file, interpolation="linear")
        for confidence in arguments.confidence:
            found = [{"file": file, **row} for row in coverage(tracks, confidence, arguments.seconds)]
            rows += found
            for row in found:
                print(line(row))
    for confidence in arguments.confidence:
        few = [row for row in rows if row["promised"] == confidence and row["errors"] < POOLED]
        count = sum(row["errors"] for row in few)
        if count:
            held = sum(row["held"] for row in few)
            print(f"{f'pooled, of fewer than {POOLED}':42} {'':8} {confidence:8.2f} {held / count:8.3f} {count:8}")
        for lead in sorted({round(row["lead"], 6) for row in rows}):
            same = [row for row in rows if row["promised"] == confidence and abs(row["lead"] - lead) < 1e-6]
            count, held = (sum(row[key] for row in same) for key in ("errors", "held"))
            if count and len(same) > 1:
                name = f"pooled, of {len(same)} recordings"
                print(f"{name:42} {lead:8.2f} {confidence:8.2f} {held / count:8.3f} {count:8}")
    write("calibration", {"rows": rows}, arguments.out)
    if arguments.markdown:
        print("\n".join(markdown(rows, arguments.confidence)))


def markdown(rows: list[dict[str, Any]], promised: list[float]) -> Iterator[str]:
    """The table with one line for each recording and prediction time, and one for all lines of few errors."""
    levels = " | ".join(f"{share:g}" for share in promised)
    radii = " | ".join(f"radius {share:g}" for share in promised)
    yield f"| recording | time | errors | {levels} | {radii} | constant |"
    yield "|---" * (4 + 2 * len(promised)) + "|"
    keys = dict.fromkeys((row["file"], row["lead"]) for row in rows)
    same = {key: [row for row in rows if (row["file"], row["lead"]) == key] for key in keys}
    for (file, lead), found in same.items():
        if found[0]["errors"] >= POOLED:
            shares = " | ".join(f"{row['held'] / row['errors']:.3f}" for row in found)
            sizes = " | ".join(f"{row['radius']:.2f} m" for row in found)
            name = Path(file).stem
            yield f"| {name} | {lead:g} s | {found[0]['errors']} | {shares} | {sizes} | {CONSTANT * lead:.2f} m |"
    few = [found for found in same.values() if found[0]["errors"] < POOLED]
    if few:
        count = sum(found[0]["errors"] for found in few)
        held = [sum(found[k]["held"] for found in few) / count for k in range(len(promised))]
        shares = " | ".join(f"{share:.3f}" for share in held)
        yield f"| {len(few)} rows of fewer than {POOLED} errors | | {count} | {shares} |{' |' * len(promised)} |"


def line(row: dict[str, Any]) -> str:
    """One row of the table."""
    measured = row["held"] / row["errors"] if row["errors"] else np.nan
    constant = CONSTANT * row["lead"]
    return (
        f"{row['file']:42} {row['lead']:8.2f} {row['promised']:8.2f} {measured:8.3f} {row['errors']:8} "
        f"{row['radius']:8.2f} {constant:8.2f}"
    )


def coverage(tracks: RecordedTracks, confidence: float, seconds: float) -> list[dict[str, Any]]:
    """What a calibration promised and held on one recording, for each prediction time."""
    times = [agent.trajectory.times for agent in tracks.agents.values()]
    sampled = float(np.median(np.concatenate([np.diff(some) for some in times])))
    step = sampled * np.ceil(OFTEN / sampled - 1e-9)
    leads = sorted({max(n * step, SHORTEST) for n in STEPS})
    calibration = Calibration(confidence, leads, max_gap=3.0 * step)
    begin, end = min(some[0] for some in times), max(some[-1] for some in times)
    end = min(end, begin + max(seconds, 400.0 * step))
    before = np.zeros((len(leads), 2))
    for now, seen in observed(tracks, begin, end, step):
        calibration.observe(seen)
        for k, lead in enumerate(calibration.coverage):
            if now < begin + lead.lead + WARM:
                before[k] = lead.errors, round(lead.errors * lead.measured) if lead.errors else 0
    return [
        {
            "lead": lead.lead,
            "promised": confidence,
            "errors": int(lead.errors - count),
            "held": int(round(lead.errors * lead.measured) - held) if lead.errors else 0,
            "radius": lead.radius,
        }
        for lead, (count, held) in zip(calibration.coverage, before, strict=True)
    ]


def observed(tracks: RecordedTracks, begin: float, end: float, step: float) -> Iterator[tuple[float, Tracks]]:
    """Agents that are present at a time and were one step before, with the velocity between."""
    for now in np.arange(begin + step, end, step).tolist():
        there = {
            name: agent.trajectory.position(np.array([now - step, now]))
            for name, agent in tracks.agents.items()
            if agent.trajectory.span[0] <= now - step and now <= agent.trajectory.span[1]
        }
        if there:
            places = np.array(list(there.values()))
            velocities = (places[:, 1] - places[:, 0]) / step
            yield now, Tracks(places[:, 1], velocities, 0.0, now, ids=list(there))


if __name__ == "__main__":
    main()
