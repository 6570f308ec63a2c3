"""Tables of cells by column name with the line of each row, and files that slalom brings."""

import codecs
import gzip
import re
import stat
import zlib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import SHOWN, Array, shown
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.tolerances import LARGEST
from slalom.io.recorded import LINE_LOCATION, Mistake, Rows, refuse
from slalom.kernels.arrays import Indices

GZIP: Final = b"\x1f\x8b"
"""First bytes of a file that gzip packed."""

MAX_FILE_SIZE: Final = 1_000_000_000
"""[B] Size of a file that is read. Texts are read whole, and take up to about ten times as much memory.

Larger: a wrong file takes all memory. Smaller: large recordings are refused.
"""


def file_size(path: Path, kind: str = "text file") -> int:
    """Return the size [B] of a regular file, without opening it: opening a pipe can block without end.

    Raises:
        InvalidFile: no such file; a folder, a pipe or a device; a file above MAX_FILE_SIZE. `kind` is in the message.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        raise InvalidFile([f"{path}: expected a readable {kind}, found {reason(error)}"]) from None
    if not stat.S_ISREG(found.st_mode):
        what = next((name for is_kind, name in _KINDS if is_kind(found.st_mode)), "something else")
        raise InvalidFile([f"{path}: expected a readable {kind}, found {what}"])
    if found.st_size > MAX_FILE_SIZE:
        size = f"{found.st_size / 1e6:.0f} MB"
        raise InvalidFile([f"{path}: expected a {kind} of at most {MAX_FILE_SIZE / 1e6:.0f} MB, found {size}"])
    return found.st_size


_KINDS = ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"))


def beginning_of(path: Path, count: int) -> bytes:
    """Read the first `count` bytes of a file, unpacked by gzip. Raises InvalidFile if that is not possible."""
    file_size(path, "file")
    return _read(path, count, "file", count)


def decoded(path: Path, encoding: str | None = None) -> tuple[str, list[str]]:
    """Return the text of a file, which gzip may have packed, and a note if it is assumed to be in Latin-1.

    Args:
        encoding: by default UTF-16 with a byte order mark, UTF-8, else Latin-1.

    Raises:
        InvalidFile: no such file, another encoding. InvalidInput: an unknown encoding.
    """
    content = _read(path, file_size(path), "text file", MAX_FILE_SIZE + 1)
    if len(content) > MAX_FILE_SIZE:
        raise InvalidFile([f"{path}: expected a text of at most {MAX_FILE_SIZE / 1e6:.0f} MB, found more"])
    if (lines := content.count(b"\n")) > MAX_ROWS + 1:
        raise InvalidFile([f"{path}: expected at most {MAX_ROWS} rows, found {lines} lines"])
    marked = "utf-16" if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
    notes = []
    try:
        text = content.decode(encoding or marked)
    except LookupError:
        raise InvalidInput(f"encoding: expected a name such as latin-1 or utf-16, found {encoding!r}") from None
    except UnicodeDecodeError as error:
        if encoding or marked == "utf-16" or b"\0" in content:
            raise InvalidFile([f"{path}: expected a readable text file, found {error}"]) from None
        text = content.decode("latin-1")
        notes = ["text not in UTF-8: read as Latin-1"]
    return _with_newlines(text), notes


def _with_newlines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def text_of(path: Path, kind: str = "text file") -> str:
    """Read the text of a file in UTF-8. Raises InvalidFile if that is not possible."""
    # At most its size: some files of an operating system have size 0 and no end.
    content = _read(path, file_size(path, kind), kind)
    try:
        return _with_newlines(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InvalidFile([f"{path}: expected a readable {kind}, found {error}"]) from None


def _read(path: Path, count: int, kind: str, unpacked: int = 0) -> bytes:
    """Return the first `count` bytes of a file, or the first `unpacked`, if above 0, of all parts that gzip packed."""
    try:
        with path.open("rb") as file:
            if unpacked and file.peek(len(GZIP)).startswith(GZIP):
                return gzip.GzipFile(fileobj=file).read(unpacked)
            return file.read(count)
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        found = "one that is cut off" if isinstance(error, EOFError) else error
        raise InvalidFile([f"{path}: expected a file that gzip packed, found {found}"]) from None
    except OSError as error:
        raise InvalidFile([f"{path}: expected a readable {kind}, found {reason(error)}"]) from None


MAX_ROWS: Final = 4_000_000
"""[1] Rows of a recording. A row of four cells takes 0.7 kB of memory until it is part of a track.

Larger: reading takes more than 3 GB. Smaller: large recordings are refused.
"""


EMPTY: Final = ("", "nan", "na", "null", "none")
"""Lower-case texts of cells without a value."""

_DECIMAL = re.compile(r"[+-]?\d{1,18}\.\d{0,18}([eE][+-]?\d\d?)?")
_EXACT = 2.0**53  # larger whole numbers are not exact as float


class Table:
    """Rows of cells. Mistakes in cells are collected and raised together by `rows_of`.

    Args:
        names: column names. rows: cells, texts or numbers. lines: line number of each row.
        location: template of a location in the file.
        underscores: whether a cell may contain an underscore, which Python would accept in a number.

    Raises:
        InvalidFile: no rows, a row whose number of cells is not the number of names.
    """

    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        rows: Sequence[Sequence[Any]],
        lines: Iterable[int],
        location: str = LINE_LOCATION,
        underscores: bool = True,
    ) -> None:
        self.path = path
        self.names = list(names)
        self.rows = rows
        self.location = location
        self.underscores = underscores
        self.lines = np.fromiter(lines, dtype=np.int64, count=len(rows))
        self.mistakes: list[Mistake] = []
        if not rows:
            raise InvalidFile([f"{path}: expected rows, found none"])
        if len(rows) > MAX_ROWS:
            raise InvalidFile([f"{path}: expected at most {MAX_ROWS} rows, found more"])
        refuse_widths(path, len(self.names), rows, self.lines.tolist(), location)

    def cells(self, name: str) -> list[Any]:
        """Return the cells of a column."""
        column = self.names.index(name)
        return [row[column] for row in self.rows]

    def numbers(self, name: str, *, whole: bool = False, empty: bool = False) -> Array:
        """Return the column as numbers (n,); invalid cells are noted as mistakes and become nan.

        Args:
            whole: accept only whole numbers. empty: accept cells without a value; they become nan.
        """
        cells = self.cells(name)
        try:
            values = np.array(cells, dtype=np.float64).reshape(len(cells))
        except (TypeError, ValueError, OverflowError):
            values = np.array([_number(cell) for cell in cells])
        wrong = ~np.isfinite(values)
        if empty and np.any(wrong):
            wrong &= [not isinstance(c, str) or c.strip().lower() not in EMPTY for c in cells]
        if self.underscores:
            wrong |= ["_" in str(cell) for cell in cells]  # 1_000 is a number in Python, not in a file
        wrong |= np.abs(values) > LARGEST
        if whole:
            wrong |= ~((values == np.round(values)) & (np.abs(values) <= _EXACT))
        for k in np.flatnonzero(wrong):
            self.wrong(k, name, f"expected a {'whole ' if whole else ''}number, found {shown(cells[k])}")
        values[wrong] = np.nan
        return values

    def positions(self, *names: str) -> Array:
        """Return columns of numbers as an array (n, d)."""
        return np.stack([self.numbers(name) for name in names], axis=1)

    def extents(self, *names: str) -> dict[str, Array]:
        """Return columns of lengths (n,) [m] by name; missing columns are left out."""
        return {name: self.numbers(name, empty=True) for name in names if name in self.names}

    def texts(self, name: str) -> list[str]:
        """Return the column as texts, "" for cells without a value; an empty list if there is no such column."""
        if name not in self.names:
            return []
        return ["" if (text := str(cell).strip()).lower() in EMPTY else text for cell in self.cells(name)]

    def ids(self, name: str, *, whole: bool = False) -> tuple[list[str], Indices]:
        """Return the labels of a column and the index of each row's label (n,).

        A whole number with a decimal point, such as 7.0, is written without it; other texts are kept, such as 007.

        Args:
            whole: accept only whole numbers.
        """
        if whole:
            numbers = self.numbers(name, whole=True)
            distinct, index = np.unique(np.nan_to_num(numbers), return_inverse=True)
            return [str(int(number)) for number in distinct], index.astype(np.int64)
        labels: dict[str, int] = {}
        index = np.empty(len(self.lines), dtype=np.int64)
        label_of = {cell: _label(str(cell)) for cell in set(self.cells(name))}
        for k, cell in enumerate(self.cells(name)):
            label = label_of[cell]
            if not label:
                self.wrong(k, name, "expected an id, found nothing")
            elif len(label) > SHOWN or not label.isprintable():
                self.wrong(k, name, f"expected an id of at most {SHOWN} printable characters, found {shown(cell)}")
            index[k] = labels.setdefault(label, len(labels))
        return list(labels), index

    def wrong(self, row: int | np.int64, name: str, text: str) -> None:
        """Record a mistake in a row of the column `name`."""
        self.mistakes.append((int(self.lines[row]), f"{name}: {text}"))

    def rows_of(
        self,
        ids: tuple[Sequence[str], Indices],
        times: Array,
        positions: Array,
        *,
        extents: Mapping[str, Array] | None = None,
        kinds: Sequence[str] = (),
        notes: Sequence[str] = (),
        keep: npt.NDArray[np.bool_] | None = None,
    ) -> Rows:
        """Return the rows of the file selected by `keep` (n,), all by default.

        Raises:
            InvalidFile: mistakes were recorded.
        """
        refuse(self.path, self.mistakes, self.location)
        kept = np.flatnonzero(np.ones(len(self.lines), dtype=bool) if keep is None else keep)
        labels, agents = ids
        return Rows(
            self.path,
            labels,
            agents[kept],
            times[kept],
            positions[kept],
            self.lines[kept],
            {name: values[kept] for name, values in (extents or {}).items()},
            [kinds[k] for k in kept.tolist()] if kinds else (),
            tuple(notes),
            self.location,
        )


def refuse_widths(path: Path, width: int, rows: Sequence[Sequence[Any]], lines: Sequence[int], location: str) -> None:
    """Raise InvalidFile for rows whose number of cells is not `width`."""
    wrong = [(line, len(row)) for line, row in zip(lines, rows) if len(row) != width]
    refuse(path, [(line, f"expected {width} cells, found {found}") for line, found in wrong], location)


def _number(cell: Any) -> float:
    """Return the number in a cell, nan if it holds none."""
    try:
        return float(cell)
    except (TypeError, ValueError, OverflowError):
        return float("nan")


def _label(text: str) -> str:
    text = text.strip()
    if not _DECIMAL.fullmatch(text):
        return text
    value = _number(text)
    return str(int(value)) if value == round(value) and abs(value) <= _EXACT else text


SAMPLES: Final[Mapping[str, str]] = {
    "crossing.yaml": "A robot crosses a road with three cars and a pedestrian.",
    "mixed.yaml": "Three robots with methods, margins and priorities of their own.",
    "fleet.yaml": "Groups of robots: on a circle, in a grid and at random places.",
    "hall.yaml": "A robot follows a path between walls, a shelf, a trolley and a person.",
    "recorded.yaml": "A robot in a recording, as a scenario file.",
    "imazu.yaml": "Imazu's 22 encounters of ships, as the cases of one file.",
    "daidalus.yaml": "Four encounters of aircraft of NASA's DAIDALUS, as the cases of one file.",
    "study.yaml": "A study: two methods in two scenarios.",
    "roundabout_ring_11.csv": "A recording of 30 cars in a roundabout.",
}
"""Files that slalom brings, for `sample_data` and for the command line as sample:NAME."""


def sample_data(name: str) -> Path:
    """Return the path of a data file of slalom."""
    return Path(str(files("slalom") / "data" / name))
