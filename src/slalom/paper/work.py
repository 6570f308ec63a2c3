"""Production of figures, results of claims, and the page."""

import json
from collections.abc import Callable, Sequence
from os.path import relpath
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from slalom import view
from slalom.base.checks import known
from slalom.base.errors import InvalidInput
from slalom.paper.entries import ENTRIES, Effort
from slalom.paper.page import page

__all__ = ["Effort", "links_from", "make", "names_of", "read_results"]


def names_of(names: Sequence[str]) -> list[str]:
    """Return the names of the entries to produce: the given ones, or all. Raises InvalidInput for an unknown name."""
    return [known(name, "figure or claim", list(ENTRIES)) for name in dict.fromkeys(names)] or list(ENTRIES)


def make(
    names: Sequence[str],
    out: Path,
    effort: Effort,
    *,
    page_path: Path | None = None,
    save: Callable[[Figure, Path], Path] = view.save,
    progress: Callable[[float], None],
    begin: Callable[[str], None] = lambda name: None,
) -> list[Path]:
    """Draw and measure the entries of these names.

    Args:
        names: names in the table of entries. out: folder for NAME.svg and NAME.json, created if needed.
        page_path: file of the page, by default `out` / paper.md. save: writes a figure.
        progress: called with the share done. begin: called with the name of each entry before it is made.

    Returns:
        The written files, the page last.

    Raises:
        InvalidInput: an unknown name, no seed, or no job.
    """
    chosen = [ENTRIES[known(name, "figure or claim", list(ENTRIES))] for name in names]
    if effort.seeds < 1 or effort.jobs == 0:
        raise InvalidInput(
            f"seeds, jobs: expected seeds of 1 or more and jobs not 0, found {effort.seeds} and {effort.jobs}"
        )
    out.mkdir(parents=True, exist_ok=True)
    total, done = sum(entry.weight for entry in chosen), 0.0
    written, results = [], {}
    for entry in chosen:
        begin(entry.name)

        def advance(share: float, done: float = done, weight: float = entry.weight) -> None:
            progress((done + share * weight) / total)

        if entry.draw is not None:
            written.append(save(entry.draw(), out / f"{entry.name}.svg"))
        if entry.measure is not None:
            target = out / f"{entry.name}.json"
            text = json.dumps(entry.measure(effort, advance), indent=1, allow_nan=False)
            target.write_text(text + "\n", encoding="utf-8")
            results[entry.name] = json.loads(text)
            written.append(target)
            if entry.plot is not None:
                written.append(save(entry.plot(results[entry.name]), out / f"{entry.name}.svg"))
        done += entry.weight
        progress(done / total)
    paper = page_path or out / "paper.md"
    paper.write_text(page(names, results, effort.quick, links_from(paper, out)), encoding="utf-8")
    return [*written, paper]


def links_from(paper: Path, out: Path) -> str:
    """Return the prefix of links from the page to files in `out`."""
    folder = relpath(out, paper.parent).replace("\\", "/")
    return "" if folder == "." else f"{folder}/"


def read_results(folder: Path) -> dict[str, Any]:
    """Read the results of an earlier run from a folder, by name."""
    return {name: json.loads(path.read_text()) for name in ENTRIES if (path := folder / f"{name}.json").exists()}
