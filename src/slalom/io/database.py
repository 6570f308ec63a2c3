"""Rows of SQLite databases, read within bounds that a malformed file cannot exceed."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from slalom.errors import InvalidFile
from slalom.io.input_file import file_size
from slalom.tolerances import DATABASE_STEPS, DATABASE_VALUE, MAX_ROWS, ROW_BYTES

INTERVAL: Final = 10_000
"""Number of operations of SQLite between two counts of them."""


def rows_of_queries(path: Path, kind: str, queries: Sequence[str]) -> list[list[tuple[Any, ...]]]:
    """Return the rows of each query of a database, which is opened for reading only.

    Views, generated columns and pages that occur many times can stand for rows without end. Hence the number of rows
    is bounded by the size of the file, and so are the operations of SQLite.

    Args:
        kind: of the database, for messages.

    Raises:
        InvalidFile: no such file, no database, a query that does not fit it or exceeds a bound.
    """
    size = file_size(path, kind)
    most = min(size // ROW_BYTES, MAX_ROWS)
    left = [max(most, 10_000) * DATABASE_STEPS // INTERVAL]

    def interrupted() -> bool:
        left[0] -= 1
        return left[0] < 0

    try:
        # sqlite3 would create a file that does not exist, if it were not opened for reading only.
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as database:
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, DATABASE_VALUE)
            database.set_progress_handler(interrupted, INTERVAL)
            found = [database.execute(query).fetchmany(most + 1) for query in queries]
    except (sqlite3.Error, UnicodeDecodeError) as error:
        text = "a query that does not end" if left[0] < 0 else error
        raise InvalidFile([f"{path}: expected a {kind}, found {text}"]) from None
    if any(len(rows) > most for rows in found):
        raise InvalidFile([f"{path}: expected at most {most} rows in a file of {size} bytes, found more"])
    return found
