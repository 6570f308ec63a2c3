"""What the commands share: exit codes, settings, files to be written, progress, printing."""

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
    """NAME=VALUE pairs as a mapping. Raises InvalidInput for anything else."""
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
    """Refuse a figure that could not be saved before the work is done, not after."""
    if figure is not None and figure.suffix not in (".svg", ".pdf", ".png"):
        raise InvalidInput(f"--figure: expected a file that ends in .svg, .pdf or .png, found {str(figure)!r}")
    writable(figure)


def writable(path: Path | None) -> None:
    """Refuse a folder that is not there before the work is done."""
    if path is not None and not path.parent.is_dir():
        raise InvalidInput(f"{path}: expected a file in a folder that exists, found no folder {str(path.parent)!r}")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """What the system says when a file cannot be written, as one message of ours."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason}"]) from None


@contextmanager
def progress(what: str) -> Iterator[Callable[[float], None]]:
    """A progress bar on stderr when that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda share: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def vector_of(text: str, option: str) -> list[float]:
    """The two or three numbers of x,y or x,y,z. Raises InvalidInput for anything else."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) not in (2, 3):
        raise InvalidInput(f"{option}: expected two or three numbers with commas between, found {text!r}")
    return found


def answer(result: dict[str, Any], as_json: bool, text: Callable[[], str]) -> None:
    """The result on stdout: one JSON object, or text."""
    from json import dumps

    print(dumps(result, allow_nan=False) if as_json else text())


def complain(message: str) -> None:
    """What went wrong, or what should be known, on stderr."""
    print(message, file=sys.stderr)
