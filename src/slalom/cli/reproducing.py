"""`slalom reproduce`."""

from pathlib import Path

from slalom.cli.console import (
    DONE,
    Flag,
    Whole,
    new_markdown,
    print_message,
    print_result,
    progress,
    writable,
    writing,
)
from slalom.cli.drawing import VectorLook
from slalom.cli.report import files_text


def reproduce(
    *names: str,
    out: Path = Path("out/paper"),
    page: Path | None = None,
    seeds: Whole = 100,
    jobs: Whole = 2,
    quick: Flag = False,
    force: Flag = False,
    look: VectorLook | None = None,
    json: Flag = False,
) -> int:
    """Draw the figures of the paper and measure its claims; all of them, or those named. All take 6 to 8 minutes.

    Parameters
    ----------
    names
        Figures and claims from `slalom list figures`.
    out
        Folder for NAME.svg of each figure and NAME.json of each claim; created if needed.
    page
        File for the page with captions and tables; by default paper.md in that folder.
    seeds
        Number of runs in each row of the sweep.
    jobs
        Number of processes; -1 for one per core. With one, all figures and claims take twice as long as with two.
    quick
        Use coarse grids and short runs, as a test of the command.
    force
        Replace a page of --page that exists.
    json
        Print one JSON object.
    """
    from slalom.paper import work

    chosen, effort = work.names_of(names), work.Effort(seeds, jobs, quick)
    new_markdown(page, force)
    writable(page)
    begun: list[str] = []

    def begin(name: str) -> None:
        begun.append(name)
        if not json:
            print_message(f"{len(begun)} of {len(chosen)}: {name}")

    with progress("reproducing", estimated=False) as advance, writing(out):
        save = (look or VectorLook()).save
        written = work.make(chosen, out, effort, page_path=page, save=save, progress=advance, begin=begin)
    result = {**effort._asdict(), "entries": chosen, "files": [str(path) for path in written]}
    print_result(result, json, lambda: files_text(result))
    return DONE
