"""Tables of cells by column name, with the line number of each row."""

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.checks import Array, shown
from slalom.errors import InvalidFile
from slalom.io.input_file import text_of
from slalom.io.recorded import LINE_LOCATION, Mistake, Rows, refuse
from slalom.kernels.arrays import Indices
from slalom.tolerances import LARGEST, MAX_ROWS, SHOWN

EMPTY: Final = ("", "nan", "na", "null", "none")
"""Lower-case texts of cells without a value."""

_WHOLE = re.compile(r"[+-]?\d{1,18}(\.0*)?")
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
        self.path, self.names, self.rows, self.location, self.underscores = (
            path,
            list(names),
            rows,
            location,
            underscores,
        )
        self.lines = np.fromiter(lines, dtype=np.int64, count=len(rows))
        self.mistakes: list[Mistake] = []
        if not rows:
            raise InvalidFile([f"{path}: expected rows, found none"])
        if len(rows) > MAX_ROWS:
            raise InvalidFile([f"{path}: expected at most {MAX_ROWS} rows, found more"])
        width = len(self.names)
        wrong = [(k, len(row)) for k, row in zip(self.lines.tolist(), rows) if len(row) != width]
        refuse(path, [(line, f"expected {width} cells, found {found}") for line, found in wrong], location)

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

    def extents(self, **columns: str) -> dict[str, Array]:
        """Return columns of lengths (n,) [m] by quantity; missing columns are left out."""
        return {quantity: self.numbers(name, empty=True) for quantity, name in columns.items() if name in self.names}

    def texts(self, name: str) -> list[str]:
        """Return the column as texts, "" for cells without a value; an empty list if there is no such column."""
        if name not in self.names:
            return []
        return ["" if (text := str(cell).strip()).lower() in EMPTY else text for cell in self.cells(name)]

    def ids(self, name: str, *, whole: bool = False, literal: bool = False) -> tuple[list[str], Indices]:
        """Return the labels of a column and the index of each row's label (n,).

        Args:
            whole: accept only whole numbers. literal: use the text unchanged, even if it is a number (0012).
        """
        if whole:
            numbers = self.numbers(name, whole=True)
            distinct, index = np.unique(np.nan_to_num(numbers), return_inverse=True)
            return [str(int(number)) for number in distinct], index.astype(np.int64)
        labels: dict[str, int] = {}
        index = np.empty(len(self.lines), dtype=np.int64)
        label_of = {cell: _label(str(cell), literal) for cell in set(self.cells(name))}
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


def _number(cell: Any) -> float:
    """Return the number in a cell, nan if it holds none."""
    try:
        return float(cell)
    except (TypeError, ValueError, OverflowError):
        return float("nan")


def _label(text: str, literal: bool) -> str:
    text = text.strip()
    return str(int(text.split(".")[0])) if not literal and _WHOLE.fullmatch(text) else text


def comma_table(path: Path, *needed: Sequence[str]) -> Table:
    """Read a table of comma-separated cells (RFC 4180) below a header, with columns in any order.

    Args:
        needed: alternative sets of column names; the header must contain every name of one set exactly once.

    Raises:
        InvalidFile: no such file, a header that lacks a name, rows that do not match the header.
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
    """Read cells separated by white space; return the rows, their line numbers, and the comment lines."""
    rows, lines, comments = [], [], []
    for number, line in enumerate(text_of(path).split("\n"), start=1):
        cells = line.split()
        if cells and cells[0].startswith(comment):
            comments.append(line.strip())
        elif cells:
            rows.append(cells)
            lines.append(number)
    return rows, lines, comments
