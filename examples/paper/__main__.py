"""Draw the figures of the paper and measure its claims: `python -m examples.paper --help`. All take 6 to 8 minutes."""

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from slalom.base.errors import SlalomError
from slalom.cli.console import BAD_INPUT, DONE, print_message, progress, writing

from . import entries


def main(tokens: Sequence[str] | None = None) -> int:
    """Make the figures and claims that are named, print the files, and return the exit code: 0, or 2 for bad input."""
    parser = ArgumentParser("python -m examples.paper", description=__doc__)
    names = f"figures and claims, by default all: {', '.join(entries.ENTRIES)}; NAME.pdf and NAME.png are other formats"
    parser.add_argument("names", nargs="*", help=names)
    parser.add_argument("--out", type=Path, default=Path("out/paper"), help="folder of figures and NAME.json of claims")
    parser.add_argument("--page", type=Path, help="file of the page, by default paper.md in that folder")
    parser.add_argument("--seeds", type=int, default=100, help="number of runs in each row of the sweep")
    parser.add_argument("--jobs", type=int, default=2, help="number of processes; -1 for one per core")
    parser.add_argument("--quick", action="store_true", help="coarse grids and short runs, as a test of the program")
    given = parser.parse_args(tokens)
    effort = entries.Effort(given.seeds, given.jobs, given.quick)
    try:
        with progress("reproducing", estimated=False) as advance, writing(given.out):
            written = entries.make(
                given.names, given.out, effort, page_path=given.page, progress=advance, begin=print_message
            )
    except SlalomError as error:
        print_message(str(error))
        return BAD_INPUT
    print(*written, sep="\n")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
