"""Cells of a table of any separator, with names and units of the columns, below a header or without one."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from slalom.base.errors import Extra, InvalidFile, reason
from slalom.io.recorded import counted
from slalom.io.table import Table, decoded, file_size

LENGTHS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048, "feet": 0.3048, "foot": 0.3048}
"""[m] Units of lengths by name; `unit_name` gives that of other words."""

TIMES: Final = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
"""[s] Units of times by name."""

Sum = list[tuple[float, str]]
"""Factors and columns of a sum."""

_METRES = r"(?:kilo|centi|milli)?met(?:er|re)s?"
_UNIT = re.compile(
    rf"(.*?)(?:\s*[\[(/]\s*([^\])]+?)\s*[\])]?|[ _](ms|us|µs|ns|s|{'|'.join(LENGTHS)}|(?i:{_METRES}))| in (\w+))"
)
_PREFIX = re.compile(r"^[#*\s]*(?:\$\w+:)?|-PID\d+$")  # comments, objects of Viswalk, processors of Vadere
_TERM = re.compile(r"\s*([+-]?)\s*(?:(\d+\.?\d*)\s*\*\s*)?([^+*-]+)")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*")
_COMMENTS = ("#", "*")
_STATED = re.compile(
    r"(?:\b(?:in|units?|are|is)(?:\s+(?:the\s+)?units?(?:\s+of)?)?[\s,]+|[:=/\[(]\s*(?:1\s*)?)[\"']?"
    rf"({'|'.join(LENGTHS)}|{_METRES}|inch(?:es)?|pixels?|px)\b(\s*(?:/|per\b)\s*\w|\^|²)?",
    re.IGNORECASE,
)
_POSITION = re.compile(r"positions?|pos|coord\w*|locations?|points?|markers?|traject\w+|tracks?|xy?|y")
_OTHER = re.compile(
    r"heights?|altitudes?|depths?|z|sizes?|radi\w+|widths?|diameters?|speeds?|velocit\w+|acceler\w+|resolution|accuracy"
    r"|precision|errors?|noise"
)
_NO_NOUN = re.compile(
    r"all|everything|data|values?|measurements?|lengths?|distances?|file|this|the|and|of|in|are|is|given|recorded|measured"
    r"|stored|exported|written|saved|expressed"
)
_RATE = r"(?:frame[ _]?rate|fps)"
_NUMBER = r"(\d+(?:\.\d*)?)"
_RATES = tuple(
    re.compile(text, re.IGNORECASE)
    for text in (
        rf"{_RATE}\s*[:=]\s*{_NUMBER}",
        rf"{_RATE}\s+{_NUMBER}|{_NUMBER}\s*(?:fps|frames per second|frames/s|hz)\b",
    )
)


def key(name: str) -> str:
    """Return the letters and digits of a name in lower case, by which names of columns are compared."""
    return re.sub(r"[\W_]+", "", name.lower())


def is_number(cell: str) -> bool:
    """Return whether a cell holds a number, also one with a decimal comma."""
    try:
        float(cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell)
    except ValueError:
        return False
    return True


def unit_name(text: str) -> str:
    """Return the name of a unit: of centimetres and Centimeters cm; of another one in lower case."""
    name = text.strip().lower()
    return f"{name.partition('met')[0][:1]}m" if re.fullmatch(_METRES, name) else name


def split(name: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the name of the unit, "" if there is none."""
    found = _UNIT.fullmatch(name.strip())
    return (found[1], unit_name(found[2] or found[3] or found[4])) if found else (name, "")


def _of_positions(text: str) -> bool:
    """Return whether a unit after a text is that of positions, as it is not after "height of the persons in".

    The first noun of the last list decides, as in "x, y and heights" and "errors of the positions".
    """
    words, of = re.findall(r"[^\W\d]+", text.lower()), ""
    for word in reversed(words):
        if _POSITION.fullmatch(word) or _OTHER.fullmatch(word):
            of = word
        elif of and word not in ("and", "of", "the"):
            break
    if of:
        return bool(_POSITION.fullmatch(of))
    return bool({*words} & {"unit", "units"}) or all(map(_NO_NOUN.fullmatch, words))


@dataclass(eq=False)
class Sheet:
    """The cells of a table.

    Attributes:
        names: of the columns as written; numbers from 1 without a header. rows: cells, texts or numbers. lines: of the
            rows. units: by column, where stated; in lower case. separator: " " for white space.
        comments: lines that begin with # or *. notes: what was repaired. headless: whether there is no header.
        head: line of the header. location: template of a location in the file. underscores: whether cells
            may have some.
    """

    path: Path
    names: list[str]
    rows: list[list[Any]]
    lines: list[int]
    units: dict[str, str] = field(default_factory=dict)
    separator: str = ","
    comments: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    headless: bool = False
    head: int = 1
    location: str = "{path}:{line}"
    underscores: bool = True

    def __post_init__(self) -> None:
        self.columns = {key(name): name for name in reversed(self.names)}
        for name in self.names:
            base, unit = split(name)
            if unit and key(base) not in self.columns:
                self.columns[key(base)] = name
                self.units.setdefault(name, unit)

    def find(self, column: str) -> Sum | None:
        """Return the sum that a column is: of one by name or number, or several; None if there are no such columns."""
        name = column.strip()
        if key(name) in self.columns:
            return [(-1.0 if name.startswith("-") else 1.0, self.columns[key(name)])]
        if re.fullmatch(r"[1-9]\d{0,8}", name) and int(name) <= len(self.names):
            return [(1.0, self.names[int(name) - 1])]
        terms = [(f"{sign}{factor or 1}", key(of)) for sign, factor, of in _TERM.findall(name)]
        if len(terms) < 2 or not all(of in self.columns for _, of in terms):
            return None
        return [(float(factor), self.columns[of]) for factor, of in terms]

    def pattern(self) -> str:
        """Return # if there are comments, the separator, and h for a header, else n and t for numbers and texts."""
        first = self.rows[0] if self.rows and self.headless else []
        cells = "".join("n" if is_number(str(cell)) else "t" for cell in first)
        return ("#" if self.comments else "") + self.separator + (cells or "h")

    def table(self) -> Table:
        """Return the cells as a table. Raises InvalidFile for no rows, or rows of other lengths than the header."""
        return Table(self.path, self.names, self.rows, self.lines, self.location, self.underscores)

    @cached_property
    def comment_unit(self) -> str:
        """The unit of the positions that comments state, "" if they state none. Raises InvalidFile for two."""
        found = dict[str, None]()
        for line in self.comments:
            begin, line = 0, line.replace("_", " ")
            for match in _STATED.finditer(line):
                about = re.split(r"[.;]\s", line[begin : match.start(1)])[-1]
                begin = match.end()
                if not match[2] and _of_positions(about):
                    found[unit_name(match[1])] = None
        if len({LENGTHS.get(unit) for unit in found}) > 1:
            raise InvalidFile(
                [f"{self.path}: expected one unit of positions in the comments, found {', '.join(found)}"]
            )
        return next(iter(found), "")

    def rate(self) -> float | None:
        """Return the frame rate [Hz] that comments state: one after a name and a colon, else any; None without one.

        Raises InvalidFile for several.
        """
        for pattern in _RATES:
            found = [match[match.lastindex or 0] for line in self.comments for match in pattern.finditer(line)]
            if len(set(map(float, found))) > 1:
                raise InvalidFile([f"{self.path}: expected one frame rate in the comments, found {', '.join(found)}"])
            if found:
                return float(found[0])
        return None


def sheet_of(path: Path, text: str, notes: Sequence[str] = ()) -> Sheet:
    """Return the cells of a text below its header, if there is one.

    Comments begin with # or *. The last one before the cells may be the header; a row of units may follow it. Cells are
    separated by semicolons, tabs, commas or white space, whichever the first row has, in this order.

    Raises:
        InvalidFile: cells that are not closed.
    """
    lines = text.split("\n")
    start = next((k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith(_COMMENTS)), 0)
    comments = [line.strip() for line in lines[:start] if line.strip()]
    separator = _separator(lines[start])
    rows, numbers = _cells(path, lines, start, separator)
    names = [cell.strip() for cell in rows[0]] if rows else []
    head, notes = start + 1, [*notes]
    headless = any(map(is_number, names))
    if not headless:
        rows, numbers = rows[1:], numbers[1:]
    elif (above := _header_in(comments, separator, len(names))) is not None:
        names, headless = above, False
        head = start
    else:
        names = [str(k) for k in range(1, len(names) + 1)]
    names, units = [_PREFIX.sub("", name) for name in names], dict[str, str]()
    if rows and all(len(row) == len(names) + 1 and not row[-1].strip() for row in rows):
        rows = [row[:-1] for row in rows]
        notes.append(f"an empty last cell of {counted(len(rows), 'row')} left out")
    stated = [unit_name(cell.strip(" []()")) for cell in rows[0]] if rows and not headless else []
    if len(stated) == len(names) and any(stated) and all(cell in ("", "-", "1", *LENGTHS, *TIMES) for cell in stated):
        rows, numbers = rows[1:], numbers[1:]
        units = {name: unit for name, unit in zip(names, stated) if unit}
    if separator != "," and any(_DECIMAL_COMMA.fullmatch(cell) for row in rows[:100] for cell in row):
        rows = [[c.replace(",", ".") if "," in c and _DECIMAL_COMMA.fullmatch(c) else c for c in row] for row in rows]
        notes.append("decimal commas read as points")
    underscores = any("_" in line for line in lines[start + 1 :])
    return Sheet(path, names, rows, numbers, units, separator, comments, notes, headless, head, underscores=underscores)


def comma_table(path: Path, names: Sequence[str]) -> Table:
    """Return the cells below a header that has each of the names once. Raises InvalidFile for another header."""
    sheet = sheet_of(path, *decoded(path))
    if sheet.headless or any(sheet.names.count(name) != 1 for name in names):
        found = "none" if sheet.headless else repr(",".join(sheet.names) or "nothing")
        raise InvalidFile([f"{path}:{sheet.head}: expected a header with {','.join(names)}, found {found}"])
    return sheet.table()


def _header_in(comments: Sequence[str], separator: str, width: int) -> list[str] | None:
    """Return the names of the last comment, and numbers of further columns; None unless it names x, y and an id."""
    body = _PREFIX.sub("", comments[-1]) if comments else ""
    names = re.sub(r"\s+(?=[\[(])", "", body).split() if separator == " " else body.split(separator)
    found = {key(split(name)[0]) for name in names}
    place = {"x", "y"} <= found or {"latitude", "longitude"} <= found
    if len(names) > width or not place or not any(re.search("id$|mmsi|icao|agent|track", name) for name in found):
        return None
    return [name.strip() for name in names] + [str(k) for k in range(len(names) + 1, width + 1)]


def _separator(line: str) -> str:
    """Return the separator of the cells of a line, " " for white space."""
    cells = line.split()
    if ";" in line:
        return ";"
    if "\t" in line:
        return " " if all(map(is_number, line.split("\t"))) else "\t"
    return "," if len(cells) < 2 or ("," in line and not all(map(is_number, cells))) else " "


def _cells(path: Path, lines: list[str], start: int, separator: str) -> tuple[list[list[str]], list[int]]:
    """Return the cells of each row that is not blank, and its line number."""
    if separator == " ":
        found = [(k, line) for k, line in enumerate(lines[start:], start + 1) if line.strip()]
        found = [(k, line) for k, line in found if not line.lstrip().startswith("#")]
        return [[cell.strip('"') for cell in line.split()] for _, line in found], [k for k, _ in found]
    rows: list[list[str]] = []
    numbers: list[int] = []
    reader = csv.reader(io.StringIO("\n".join(lines[start:])), delimiter=separator, strict=True)
    line = start + 1
    try:
        for cells in reader:
            if cells and (cells[0].strip() or any(map(str.strip, cells))):
                rows.append(cells)
                numbers.append(line)
            line = start + reader.line_num + 1
    except csv.Error as error:
        at, what = start + reader.line_num, {",": "comma", ";": "semicolon", "\t": "tab"}[separator]
        raise InvalidFile([f"{path}:{at}: expected {what}-separated cells, found {error}"]) from None
    return rows, numbers


def parquet(path: Path, *, names_only: bool = False) -> Sheet:
    """Return the cells of a Parquet file, dates in ISO 8601. Raises MissingExtra without pandas, InvalidFile."""
    file_size(path, "Parquet file")
    with Extra("data", "read_recording"):
        import pandas as pd
        import pyarrow as pa
        import pyarrow.parquet as pq
    try:
        names = [str(name) for name in pq.read_schema(path).names]
        frame = pd.DataFrame() if names_only else pd.read_parquet(path)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise InvalidFile([f"{path}: expected a Parquet file, found {reason(error)}"]) from None
    columns = [
        ["" if v is None else getattr(v, "isoformat", lambda v=v: v)() for v in frame[c].tolist()] for c in frame
    ]
    rows = [list(row) for row in zip(*columns)]
    return Sheet(path, names, rows, list(range(1, len(rows) + 1)), location="{path}: row {line}")


def beginning_sheet(path: Path, text: str) -> Sheet | None:
    """Return the sheet of the beginning of a text, without its last line, which may be cut; None if it is none."""
    for part in (text.rpartition("\n")[0] if text.count("\n") > 1 else text, text.partition("\n")[0]):
        try:
            return sheet_of(path, part)
        except InvalidFile:
            # Cells after the header are not closed: the reader says where.
            continue
    return None
