"""Shared parts of the commands: exit codes, settings, checks of output files, progress bar, printing."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from slalom.errors import InvalidFile, InvalidInput

DONE, FAILED, BAD_INPUT = 0, 1, 2
Settings = Annotated[list[str] | None, Parameter(name="--set", consume_multiple=True, negative=())]
Names = Annotated[list[str] | None, Parameter(consume_multiple=True, negative=())]
Flag = Annotated[bool, Parameter(negative=())]


def parse_settings(settings: Sequence[str] | None) -> dict[str, float]:
    """Parse NAME=VALUE pairs into a mapping. Raises InvalidInput for any other text."""
    parsed: dict[str, float] = {}
    for setting in settings or ():
        name, equals, value = setting.partition("=")
        try:
            parsed[name] = float(value)
        except ValueError:
            equals = ""
        if not name or not equals:
            raise InvalidInput(f"--set: expected NAME=NUMBER, found {setting!r}")
    return parsed


def drawable(figure: Path | None) -> None:
    """Raise InvalidInput for a figure file that cannot be saved; called before the computation."""
    if figure is not None and figure.suffix not in (".svg", ".pdf", ".png"):
        raise InvalidInput(f"--figure: expected a file that ends in .svg, .pdf or .png, found {str(figure)!r}")
    writable(figure)


def writable(path: Path | None) -> None:
    """Raise InvalidInput if the folder of `path` does not exist; called before the computation."""
    if path is not None and not path.parent.is_dir():
        raise InvalidInput(f"{path}: expected a file in a folder that exists, found no folder {str(path.parent)!r}")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Convert an OSError while writing `path` to InvalidFile."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason}"]) from None


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on stderr if it is a terminal; yield a function of the share done."""
    if not sys.stderr.isatty():
        yield lambda share: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=1.0)
        yield lambda share: bar.update(task, completed=share)


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

    print(dumps(result, allow_nan=False) if as_json else text())


def print_line(text: str) -> None:
    """Print a line on stdout at once, for a program that reads it while the command runs."""
    print(text, flush=True)


def print_message(message: str) -> None:
    """Print an error or a note on stderr."""
    print(message, file=sys.stderr)
