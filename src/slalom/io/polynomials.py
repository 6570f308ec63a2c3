"""Reader of polynomial trajectories as written by drone planners: CSV, one row per piece.

Header `duration,x^0,x^1,...,y^0,...[,z^0,...]`; further columns (yaw) are ignored. Coefficients are in ascending
powers of the time since the start of the piece, in m, m/s, m/s^2, ...
"""

import csv
import re
from pathlib import Path

import numpy as np

from slalom.base.errors import InvalidFile, SlalomError
from slalom.io.table import text_of
from slalom.model.trajectory import PiecewisePolynomial

_POWER = re.compile(r"([xyz])\^(\d+)")


def read_polynomials(path: Path | str, *, start: float = 0.0) -> PiecewisePolynomial:
    """Read the trajectory of a file, starting at time `start` [s].

    Raises:
        InvalidFile: no such file, an invalid header or cell, discontinuous pieces; with file and line.
    """
    path = Path(path)
    try:
        rows = list(csv.reader(text_of(path, "CSV file").splitlines()))
    except csv.Error as error:
        raise InvalidFile([f"{path}: expected a readable CSV file, found {error}"]) from None
    header = [cell.strip() for cell in rows[0]] if rows else []
    named = [(m[1], m[2], k) for k, cell in enumerate(header) if (m := _POWER.fullmatch(cell))]
    columns = {(axis, power): k for axis, power, k in named}
    axes = sorted({axis for axis, _ in columns})
    powers = [str(power) for power in range(len(named) // max(1, len(axes)))]
    # Powers are compared as text: a cell of thousands of digits is not a number for Python.
    complete = len(named) == len(columns) and set(columns) == {(axis, power) for axis in axes for power in powers}
    if header[:1] != ["duration"] or axes not in (["x", "y"], ["x", "y", "z"]) or not complete:
        found = ",".join(header) or "nothing"
        raise InvalidFile([f"{path}:1:1: expected a header duration,x^0,...,y^0,...[,z^0,...], found {found!r}"])
    durations, pieces = [], []
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            durations.append(float(row[0]))
            pieces.append([[float(row[columns[axis, power]]) for axis in axes] for power in powers])
        except (ValueError, IndexError):
            raise InvalidFile([f"{path}:{number}:1: expected {len(header)} numbers, found {','.join(row)!r}"]) from None
    if not pieces:
        raise InvalidFile([f"{path}:2:1: expected rows after the header, found none"])
    try:
        return PiecewisePolynomial(durations, np.array(pieces), start)
    except SlalomError as error:
        raise InvalidFile([f"{path}: {error}"]) from None
