"""`slalom reproduce`."""

from pathlib import Path

from slalom.cli.console import DONE, Flag, print_result, progress, writable, writing
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
    """Draw the figures of the paper and measure its claims; all of them, or only the one named.

    Parameters
    ----------
    name
        A figure or claim from `slalom list figures`.
    out
        Folder for NAME.svg of each figure and NAME.json of each claim; created if needed.
    page
        File for the page with captions and tables; by default paper.md in that folder.
    seeds
        Number of runs in each row of the sweep.
    jobs
        Number of processes; -1 for one per core.
    quick
        Use coarse grids and short runs, as a test of the command.
    json
        Print one JSON object.
    """
    from slalom.paper import work

    names, effort = work.names_of(name), work.Effort(seeds, jobs, quick)
    writable(page)
    with progress("reproducing") as advance, writing(out):
        written = work.make(names, out, effort, page_path=page, progress=advance)
    result = {**effort._asdict(), "entries": names, "files": [str(path) for path in written]}
    print_result(result, json, lambda: files_text(result))
    return DONE
