"""Times of this state over those of another commit, by turns on this machine, beside the noise of equal states.

    python tools/speed.py BASE                           # closed_loop, fleet_step and start of both, twice
    python tools/speed.py BASE --programs closed_loop --turns 3

The base is a clone in out/speed, which keeps its compiled kernels. Each state runs its own programs; a figure is
compared if both have it. Ratios are those of medians. The noise is the largest ratio of two turns of one state: a ratio
nearer to 1 says nothing.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

ROOT = Path(__file__).parents[1]
PROGRAMS = ("closed_loop", "fleet_step", "start")
TIME = re.compile(r"\b(us|ms|s)\b")
"""In the head of a column of times; others hold counts and ratios."""
Times = dict[str, float]


def git(*words: str, folder: Path = ROOT) -> str:
    """What git prints. Raises CalledProcessError."""
    return subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


def cloned(base: str) -> Path:
    """The folder of a commit, cloned if it is not there."""
    commit = git("rev-parse", "--verify", f"{base}^{{commit}}")
    folder = ROOT / "out" / "speed" / commit[:12]
    if not folder.exists():
        git("clone", "--quiet", "--shared", "--no-checkout", str(ROOT), str(folder))
    git("checkout", "--quiet", "--detach", commit, folder=folder)
    return folder


def times_in(result: Mapping[str, Any]) -> Times:
    """The times of the tables of a program by row and column."""
    return {
        f"{row[0]}, {head}": float(cell)
        for table in result["tables"]
        for row in table["rows"]
        for head, cell in zip(table["heads"][1:], row[1:])
        if TIME.search(head) and isinstance(cell, int | float)
    }


def measured(folder: Path, program: str, words: Sequence[str]) -> Times:
    """The times that a program of the state in a folder finds."""
    out = folder / "out" / "benchmarks"
    command = [sys.executable, str(folder / "benchmarks" / f"{program}.py"), *words, "--out", str(out)]
    environment = {**os.environ, "PYTHONPATH": str(folder / "src")}
    subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    return times_in(json.loads((out / f"{program}.json").read_text()))


def ratios(base: Sequence[Times], now: Sequence[Times]) -> Iterator[tuple[str, float, float, float, float]]:
    """For each time that all turns have: its name, base, now, their ratio, and the noise, a ratio of at least 1."""
    for name in base[0]:
        if all(name in turn for turn in (*base, *now)):
            before, after = ([turn[name] for turn in turns] for turns in (base, now))
            noise = max(max(times) / min(times) for times in (before, after))
            yield name, median(before), median(after), median(after) / median(before), noise


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", help="a commit")
    parser.add_argument("--programs", nargs="+", choices=PROGRAMS, default=PROGRAMS)
    parser.add_argument("--turns", type=int, choices=range(2, 10), default=2)
    parser.add_argument("--quick", action="store_true", help="tiny sizes: the figures mean nothing")
    given = parser.parse_args()
    base = cloned(given.base)
    for folder in (base, ROOT):
        subprocess.run(
            [sys.executable, "-m", "slalom", "compile"],
            env={**os.environ, "PYTHONPATH": str(folder / "src")},
            check=True,
        )
    print(f"{'':60}{'base':>10}{'now':>10}{'ratio':>8}{'noise':>8}")
    for program in given.programs:
        turns = [[measured(f, program, ["--quick"] * given.quick) for f in (base, ROOT)] for _ in range(given.turns)]
        for name, before, after, ratio, noise in ratios([t[0] for t in turns], [t[1] for t in turns]):
            told = "" if max(ratio, 1.0 / ratio) > noise else "  within the noise"
            print(f"{f'{program}: {name}':60}{before:10.4g}{after:10.4g}{ratio:8.2f}{noise:8.2f}{told}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
