"""Shared parts of the commands: exit codes, settings, checks of output files, progress bar, printing."""

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Parameter, Token

from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.writing import refuse_unwritable, writing

ESTIMATE_AFTER: Final = 3.0
"""[s] Time after the first report of progress at which the command line estimates the rest.

Larger: a better estimate. Smaller: an earlier one.
"""

LONG_COMMAND: Final = 30.0
"""[s] Least remaining time of a command that the command line prints.

Larger: fewer commands print it. Smaller: short commands print it too.
"""


DONE = 0
FAILED = 1
BAD_INPUT = 2


def whole_number(_: type, tokens: Sequence[Token]) -> int:
    """Return the number of an option. Raises ValueError for any other text, also for 1.5, which cyclopts rounds."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f"expected a whole number, found {tokens[0].value!r}") from None


Whole = Annotated[int, Parameter(converter=whole_number)]
Settings = Annotated[list[str] | None, Parameter(name="--set", consume_multiple=True, negative=())]
Names = Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())]
Flag = Annotated[bool, Parameter(negative=())]
OldForce = Annotated[bool, Parameter(negative=(), show=False)]
"""The option --force of commands that replace files without it: accepted, since earlier versions needed it."""
SAMPLE = "sample:"
"""Beginning of the name of a file that slalom brings, see `resolved`."""


MOST_VALUES: Final = 10_000
"""[1] Values of one setting on the command line. Larger: a slip in a step runs for days. Smaller: fewer values."""


def parse_settings(settings: Sequence[str] | None) -> dict[str, float]:
    """Parse NAME=NUMBER into a mapping. Raises InvalidInput for any other text, and for a list of numbers."""
    parsed = {}
    for name, values in parse_lists(settings).items():
        if len(values) > 1:
            listed = ", ".join(f"{value:g}" for value in values[:4])
            raise InvalidInput(f"--set {name}: expected one number, found {listed}; `slalom compare` takes lists")
        (parsed[name],) = values
    return parsed


def parse_lists(settings: Sequence[str] | None) -> dict[str, list[float]]:
    """Parse NAME=VALUES into a mapping. VALUES are numbers and ranges FROM:TO:STEP, separated by commas.

    Raises:
        InvalidInput: any other text, a name twice, a range without a value or with more than MOST_VALUES.
    """
    parsed: dict[str, list[float]] = {}
    for setting in settings or ():
        name, equals, text = setting.partition("=")
        each = [_values(part) for part in text.split(",")]
        if not name or not equals or not all(each):
            raise InvalidInput(f"--set: expected NAME=NUMBER, found {setting!r}")
        if name in parsed:
            raise InvalidInput(f"--set: expected each name once, found {name!r} twice; a list is {name}=1,2,3")
        parsed[name] = [value for values in each for value in values]
    return parsed


def _values(text: str) -> list[float]:
    """Return a number, or those of a range FROM:TO:STEP with both ends, as decimals: 0:0.3:0.1 ends with 0.3.

    Another text has none. Raises InvalidInput for a range of no value, or of more than MOST_VALUES.
    """
    try:
        if ":" not in text:
            return [float(text)]
        first, last, step = (Decimal(part.strip()) for part in text.split(":"))
        count = int((last - first) // step) + 1 if step and (last - first) / step >= 0 else 0
    except (ValueError, ArithmeticError):
        return []
    if not 1 <= count <= MOST_VALUES:
        raise InvalidInput(f"--set: expected a range of 1 to {MOST_VALUES} values, found {text!r} with {count}")
    return [float(first + k * step) for k in range(count)]


def writable(*paths: Path | None) -> None:
    """Make the folders of the files to write; called after all checks of input and before the computation.

    Raises:
        InvalidFile: a file that cannot be written, before the computation whose result would be lost.
    """
    for path in paths:
        if path is not None:
            with writing(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                refuse_unwritable(path)


def refuse_source(source: Path | str, *targets: Path | None) -> None:
    """Raise InvalidInput for a file to write that is the file to read: it would be lost."""
    for target in targets:
        if target is not None and os.path.exists(source) and os.path.exists(target) and target.samefile(source):
            raise InvalidInput(f"{target}: expected a file other than the source, found the same")


def new_page(page: Path | None, force: bool) -> None:
    """Raise InvalidInput for a Markdown page that exists, which is replaced only with `force`.

    It may hold text that was written by hand. All other files that exist are replaced.
    """
    if page is not None and os.path.exists(page) and not force:
        raise InvalidInput(f"--page: expected a new file, or --force to replace it; found {str(page)!r}, which exists")


def new_markdown(page: Path | None, force: bool) -> None:
    """Raise InvalidInput for a page of --page that exists, as `new_page`, or that is no Markdown file."""
    new_page(page, force)
    if page is not None and page.suffix != ".md":
        raise InvalidInput(f"--page: expected a file that ends in .md, found {str(page)!r}")


def resolved(name: str) -> str:
    """Return the path of the sample file that `name` names as in sample:crossing.yaml, else `name`.

    Raises:
        InvalidInput: an unknown sample; the name of a sample without `sample:`, if neither a file nor a scenario of
            the gallery has it.
    """
    from slalom.base.checks import known
    from slalom.io.table import SAMPLES, sample_data

    if name.startswith(SAMPLE):
        return str(sample_data(known(name.removeprefix(SAMPLE), "sample", list(SAMPLES))))
    meant = next((each for each in (name, f"{name}.yaml") if each in SAMPLES), None)
    if meant is not None and not Path(name).exists():
        from slalom.sim.gallery import GALLERY

        if name not in GALLERY:
            raise InvalidInput(
                f"scenario: expected a file or a name of `slalom list scenarios`, found {name!r}; did you mean "
                f"'{SAMPLE}{meant}'?"
            )
    return name


@contextmanager
def progress(label: str, estimated: bool = True) -> Iterator[Callable[[float], None]]:
    """Show the progress on stderr; yield a function of the share done.

    A terminal shows a bar with the remaining time. Elsewhere one line states the remaining time of a command that takes
    LONG_COMMAND or more, if it is to be `estimated`.
    """
    if not sys.stderr.isatty():
        yield _Estimate(label, estimated).advance
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=1.0)
        yield lambda share: bar.update(task, completed=share)


class _Estimate:
    """Prints the remaining time once, from the pace since the first report: kernels compile before it."""

    def __init__(self, label: str, estimated: bool) -> None:
        self.label = label
        self.begin: tuple[float, float] | None = None
        self.printed = not estimated

    def advance(self, share: float) -> None:
        """Note the share done, and print the estimate if the rest is long."""

        now = time.monotonic()
        if self.begin is None:
            self.begin = now, share
        since, first = self.begin
        if self.printed or share <= first or now - since < ESTIMATE_AFTER:
            return
        self.printed = True
        rest = (now - since) * (1.0 - share) / (share - first)
        if rest >= LONG_COMMAND:
            print_message(f"{self.label}: about {rest / 60.0:.0f} min")


def vector_of(text: str, option: str) -> list[float]:
    """Parse x,y or x,y,z into two or three numbers. Raises InvalidInput for any other text."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3):
        raise InvalidInput(f"{option}: expected two or three numbers separated by commas, found {text!r}")
    return numbers


def print_result(result: dict[str, Any], as_json: bool, text: Callable[[], str]) -> None:
    """Print the result on stdout: one JSON object, or text."""
    from json import dumps

    print_line(dumps(result, allow_nan=False) if as_json else text())


def print_line(text: str) -> None:
    """Print text on stdout at once, for a program that reads it while the command runs.

    Raises:
        InvalidFile: stdout cannot be written, for example on a full disk. BrokenPipeError: its reader has closed it.
    """
    try:
        print(text, flush=True)
    except OSError as error:
        discard_output()
        full = InvalidFile([f"stdout: expected output that can be written, found {reason(error)}"])
        raise error if isinstance(error, BrokenPipeError) else full from None


def discard_output() -> None:
    """Send the rest of stdout to nowhere: what its buffer holds would fail again at exit, with a traceback."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_message(message: str) -> None:
    """Print an error or a note on stderr."""
    print(message, file=sys.stderr)


def print_compiled(count: int) -> None:
    """Show on the terminal how many functions are compiled, in a line that the next one replaces; 0 removes it."""
    text = f"{count} functions compiled, of about 300 for a first decision" if count else ""
    print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
