"""Tables: cells by the name of their column, each with the line it stands in."""

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.checks import Array
from slalom.errors import InvalidFile
from slalom.io.recorded import IN_LINES, Indices, Mistake, Rows, refuse

EMPTY: Final = ("", "nan", "na", "null", "none")
"""What stands, in small letters, where a value is not known."""

LARGEST: Final = 1e100
"""Beyond it a number is none: the squares that speeds are made of must be numbers too."""

_WHOLE = re.compile(r"[+-]?\d{1,18}(\.0*)?")
_EXACT = 2.0**53  # beyond it different whole numbers are the same float


class Table:
    """Rows of cells. What does not fit is collected and refused together, by `rows_of`.

    Args:
        names: of the columns. rows: cells, texts or numbers. lines: where each row stands. place: how that is written.
        underscores: whether there may be one in a cell.

    Raises:
        InvalidFile: no rows, a row with more or fewer cells than there are names.
    """

    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        rows: Sequence[Sequence[Any]],
        lines: Iterable[int],
        place: str = IN_LINES,
        underscores: bool = True,
    ) -> None:
        self.path, self.names, self.rows, self.place, self.underscores = path, list(names), rows, place, underscores
        self.lines = np.fromiter(lines, dtype=np.int64, count=len(rows))
        self.mistakes: list[Mistake] = []
        if not rows:
            raise InvalidFile([f"{path}: expected rows, found none"])
        width = len(self.names)
        wrong = [(k, len(row)) for k, row in zip(self.lines.tolist(), rows) if len(row) != width]
        refuse(path, [(line, f"expected {width} cells, found {found}") for line, found in wrong], place)

    def cells(self, name: str) -> list[Any]:
        """The column of that name."""
        column = self.names.index(name)
        return [row[column] for row in self.rows]

    def numbers(self, name: str, *, whole: bool = False, empty: bool = False) -> Array:
        """The column as finite numbers (n,), nan where a cell is empty if that is allowed, and where it is wrong."""
        cells = self.cells(name)
        try:
            values = np.array(cells, dtype=np.float64).reshape(len(cells))
        except (TypeError, ValueError, OverflowError):
            values = np.array([_number(cell) for cell in cells])
        wrong = ~np.isfinite(values)
        if empty and np.any(wrong):
            wrong &= [not isinstance(c, str) or c.strip().lower() not in EMPTY for c in cells]
        if self.underscores:
            wrong |= ["_" in str(cell) for cell in cells]  # Python's 1_000 is no number in a file
        wrong |= np.abs(values) > LARGEST
        if whole:
            wrong |= ~((values == np.round(values)) & (np.abs(values) <= _EXACT))
        for k in np.flatnonzero(wrong):
            self.wrong(k, name, f"expected a {'whole ' if whole else ''}number, found {cells[k]!r}")
        values[wrong] = np.nan
        return values

    def positions(self, *names: str) -> Array:
        """Columns of numbers beside each other (n, d)."""
        return np.stack([self.numbers(name) for name in names], axis=1)

    def extents(self, **columns: str) -> dict[str, Array]:
        """Columns of lengths [m] by what they are; a column that the table does not have is left out."""
        return {what: self.numbers(name, empty=True) for what, name in columns.items() if name in self.names}

    def texts(self, name: str) -> list[str]:
        """The column as texts, "" where a cell is empty; none at all where there is no such column."""
        if name not in self.names:
            return []
        return ["" if (text := str(cell).strip()).lower() in EMPTY else text for cell in self.cells(name)]

    def ids(self, name: str, *, whole: bool = False, literal: bool = False) -> tuple[list[str], Indices]:
        """The labels of a column, and for each row the index of its label (n,).

        Args:
            whole: only whole numbers are ids. literal: the text is the id, even where it looks like a number (0012).
        """
        if whole:
            numbers = self.numbers(name, whole=True)
            distinct, index = np.unique(np.nan_to_num(numbers), return_inverse=True)
            return [str(int(number)) for number in distinct], index.astype(np.int64)
        labels: dict[str, int] = {}
        index = np.empty(len(self.lines), dtype=np.int64)
        short = {cell: _label(str(cell), literal) for cell in set(self.cells(name))}
        for k, cell in enumerate(self.cells(name)):
            label = short[cell]
            if not label:
                self.wrong(k, name, "expected an id, found nothing")
            index[k] = labels.setdefault(label, len(labels))
        return list(labels), index

    def wrong(self, row: int | np.int64, name: str, text: str) -> None:
        """Note a mistake in a row of the column `name`."""
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
        """Those rows of the file that are to be kept, from columns of all. Raises InvalidFile if any cell was wrong."""
        refuse(self.path, self.mistakes, self.place)
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
            self.place,
        )


def _number(cell: Any) -> float:
    """The number that a cell holds, nan if none."""
    try:
        return float(cell)
    except (TypeError, ValueError, OverflowError):
        return float("nan")


def _label(text: str, literal: bool) -> str:
    text = text.strip()
    return str(int(text.split(".")[0])) if not literal and _WHOLE.fullmatch(text) else text


def text_of(path: Path) -> str:
    """The text of a file. Raises InvalidFile if there is none."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile([f"{path}: expected a readable text file, found {error}"]) from None


def comma_table(path: Path, *needed: Sequence[str]) -> Table:
    """A file of comma-separated cells (RFC 4180) under a header, whose columns may come in any order.

    Args:
        needed: the names of columns, each once, that a header must have; where there are several such, one of them.

    Raises:
        InvalidFile: no such file, a header that lacks a name, rows that do not fit it.
    """
    text = text_of(path)
    reader = csv.reader(io.StringIO(text), strict=True)
    rows, lines, line = [], [], 1
    try:
        for cells in reader:
            if cells and (cells[0].strip() or any(map(str.strip, cells))):
                rows.append(cells)
                lines.append(line)
            line = reader.line_num + 1
    except csv.Error as error:
        raise InvalidFile([f"{path}:{reader.line_num}: expected comma-separated cells, found {error}"]) from None
    header = [cell.strip() for cell in rows[0]] if rows else []
    if not any(all(header.count(name) == 1 for name in names) for names in needed):
        expected = ", or with ".join(",".join(names) for names in needed)
        raise InvalidFile([f"{path}:1: expected a header with {expected}, found {','.join(header) or 'nothing'!r}"])
    return Table(path, header, rows[1:], lines[1:], underscores="_" in text.partition("\n")[2])


def spaced_rows(path: Path, comment: str = "#") -> tuple[list[list[str]], list[int], list[str]]:
    """Cells between white space, the lines they stand in, and the lines that begin with `comment`."""
    rows, lines, comments = [], [], []
    for number, line in enumerate(text_of(path).split("\n"), start=1):
        cells = line.split()
        if cells and cells[0].startswith(comment):
            comments.append(line.strip())
        elif cells:
            rows.append(cells)
            lines.append(number)
    return rows, lines, comments
