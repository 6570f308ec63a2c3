"""`slalom reproduce`."""

from pathlib import Path

from slalom.cli.console import DONE, Flag, answer, progress, writable, writing
from slalom.cli.report import files_text


def reproduce(
    name: str | None = None,
    /,
    *,
    out: Path = Path("out/paper"),
    page: Path | None = None,
    seeds: int = 300,
    jobs: int = 2,
    quick: Flag = False,
    json: Flag = False,
) -> int:
    """Make the figures of the paper, and measure its claims; everything, or only what is named.

    Parameters
    ----------
    name
        A figure or claim from `slalom list figures`.
    out
        Folder for NAME.svg of each figure and NAME.json of each claim; it is made if need be.
    page
        File for the page with captions and tables, by default paper.md in that folder.
    seeds
        How many runs are in each row of the sweep.
    jobs
        How many processes; -1 for one per core.
    quick
        Coarse grids and short runs, to see that it works.
    json
        Print one JSON object.
    """
    from slalom.paper import work

    names, effort = work.names_of(name), work.Effort(seeds, jobs, quick)
    writable(page)
    with progress("reproducing") as advance, writing(out):
        written = work.make(names, out, effort, at=page, progress=advance)
    result = {**effort._asdict(), "entries": names, "files": [str(path) for path in written]}
    answer(result, json, lambda: files_text(result))
    return DONE
