"""Errors of forecasts on recordings, with and without the motions of others, and how many of them its sets hold.

usage: python benchmarks/forecasts.py DATA_DIR [--moments 40] [--out FOLDER] [--markdown]

DATA_DIR contains tasks.json, which names the recordings and the limits of their robots. At some moments of the first
120 s of a recording, `FromModels` predicts all agents that were observed for at least five samples. The times ahead
are 1, 2 and 3 times that of the robot from rest to its maximum speed. The forecast knows the past of all agents up to
the moment. A second table has the share of errors within the sets of each of COVERAGES, at 0.25, 0.5, 1 and 2 such
times, of all agents that were not at rest. The last figures compare discs with ellipses along the heading that hold as
many errors of the second half of a recording in the plane: the ratio of areas. The axes of ellipses are the median
errors of the first half.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from machine import write
from rich.console import Console
from rich.progress import track

from slalom import AtConstantVelocity, FromModels
from slalom.forecast.from_models import ERROR_TIMES
from slalom.io.formats import read_recording
from slalom.model.uncertainty import COVERAGES, Covering

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
    within: dict[str, np.ndarray] = {}
    scores: dict[str, np.ndarray] = {}
    for name, entry in track(recordings.items(), "recordings", console=Console(stderr=True)):
        found = [{"recording": name, **row} for row in errors(arguments.data, entry, arguments.moments)]
        for row in found:
            means = " ".join(f"{key} {row[key]:8.3f} m" for key in FORECASTS)
            print(f"{name:28} {row['time']:7.2f} s {row['errors']:6d} errors  {means}")
        rows += found
        within[name], scores[name] = held(arguments.data, entry, arguments.moments)
        print(f"{name:28} held {' '.join(f'{share:.2f}' for share in shares(within[name]).ravel())}")
    print("held, each recording alike\n", np.nanmean([shares(counts) for counts in within.values()], axis=0).round(3))
    print("held, pooled\n", shares(sum(within.values())).round(3))
    for name, entry in recordings.items():
        if len(entry["tasks"][0]["start"]) == 2:
            print(f"{name:28} area of ellipses {area_of_ellipses(arguments.data, entry, arguments.moments):.2f}")
    relative = np.array([sums[:2] / sums[2] for sums in scores.values()])
    print("interval score over the error of the velocity: sets, velocity\n", np.nanmean(relative, axis=0).round(3))
    sets = {name: shares(counts).tolist() for name, counts in within.items()}
    write("forecasts", {"rows": rows, "held": sets}, arguments.out)
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


def shares(counts: np.ndarray) -> np.ndarray:
    """Shares (3, 4) of the errors within each set, of counts (4, 4): within each of the three, and all."""
    return counts[:-1] / np.where(counts[-1] > 0.0, counts[-1], np.nan)


def pinball(errors: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Interval score (n,) [m] of radii (3, n) [m] for COVERAGES: mean pinball loss of errors (n,)."""
    share, over = np.array(COVERAGES)[:, None], errors - radii
    return np.maximum(share * over, (share - 1.0) * over).mean(axis=0)


def held(folder: Path, entry: dict[str, Any], moments: int) -> tuple[np.ndarray, np.ndarray]:
    """What the sets of `FromModels` hold, and their interval scores beside those of past errors of the velocity.

    Counts (4, 4) of errors within the set of each of COVERAGES, and of all errors, at each of ERROR_TIMES. Sums (3, 4)
    of the scores of the sets, of the velocity with the quantiles of its errors known so far, and of the velocity's
    errors. Before ten of these errors are known, neither counts in the scores.
    """
    motions = [a.trajectory for a in read_recording(folder / entry["file"], interpolation="linear").agents.values()]
    rise = entry["vmax"] / entry["amax"]
    begin, end = min(motion.span[0] for motion in motions), max(motion.span[1] for motion in motions)
    end, times = min(end, begin + max(SECONDS, 20.0 * rise)), rise * np.array(ERROR_TIMES)
    counts, scores, past = np.zeros((4, 4)), np.zeros((3, 4)), [list[tuple[float, float]]() for _ in times]
    for now in np.linspace(begin + 0.1 * (end - begin), end - rise, moments).tolist():
        there = [motion for motion in motions if motion.span[0] < now <= motion.span[1]]
        known = [np.array([error for due, error in errors if due <= now]) for errors in past]
        for motion, ahead in zip(there, FromModels().predictions(there, now, rise, motions), strict=True):
            if not isinstance(ahead.error, Covering):
                continue
            seen = now + times <= motion.span[1]
            truth = motion.position(np.minimum(now + times, motion.span[1]))
            straight = AtConstantVelocity()(motion, now).position(now + times)
            away = np.linalg.norm(ahead.each[0][1].position(now + times) - truth, axis=1)
            plain = np.linalg.norm(straight - truth, axis=1)
            radii = np.array([replace(ahead.error, coverage=share).radius(times, 2) for share in COVERAGES])
            counts += seen * np.array([*(away <= radii), np.ones(len(away))])
            score = pinball(away, radii)
            for j in np.flatnonzero(seen).tolist():
                past[j].append((now + times[j], float(plain[j])))
                if len(known[j]) >= 10:
                    other = pinball(plain[j : j + 1], np.quantile(known[j], COVERAGES)[:, None])[0]
                    scores[:, j] += score[j], other, plain[j]
    return counts, scores


def area_of_ellipses(folder: Path, entry: dict[str, Any], moments: int) -> float:
    """Area [1] of ellipses along the predicted heading over that of discs: geometric mean over times and coverages."""
    motions = [a.trajectory for a in read_recording(folder / entry["file"], interpolation="linear").agents.values()]
    rise = entry["vmax"] / entry["amax"]
    begin, end = min(motion.span[0] for motion in motions), max(motion.span[1] for motion in motions)
    end, times = min(end, begin + max(SECONDS, 20.0 * rise)), rise * np.array(ERROR_TIMES)
    halves: list[tuple[list[np.ndarray], list[np.ndarray]]] = [([], []) for _ in times]
    for k, now in enumerate(np.linspace(begin + 0.1 * (end - begin), end - rise, moments).tolist()):
        there = [motion for motion in motions if motion.span[0] < now <= motion.span[1]]
        for motion, ahead in zip(there, FromModels().predictions(there, now, rise, motions), strict=True):
            path = ahead.each[0][1]
            for each, h in zip(halves, times):
                if isinstance(ahead.error, Covering) and now + h <= motion.span[1]:
                    velocity = path.velocity(now + h)
                    heading = velocity / max(float(np.linalg.norm(velocity)), 1e-9)
                    missed = (motion.position(now + h) - path.position(now + h)) / (ahead.error.scale * h)
                    along = float(missed @ heading)
                    each[2 * k >= moments].append(np.array([along, np.sqrt(max(0.0, missed @ missed - along**2))]))
    ratios = []
    for first, second in halves:
        if min(len(first), len(second)) >= 20:
            axes, errors = np.median(np.abs(first), axis=0), np.array(second)
            longest = np.quantile(np.linalg.norm(errors / axes, axis=1), COVERAGES)
            ratios += list(axes.prod() * (longest / np.quantile(np.linalg.norm(errors, axis=1), COVERAGES)) ** 2)
    return float(np.exp(np.mean(np.log(ratios)))) if ratios else np.nan


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
