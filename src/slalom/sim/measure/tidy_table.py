"""A run as a tidy table, one row for each time and robot: columns, pandas, CSV and Parquet."""

import csv
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.errors import Extra, InvalidInput
from slalom.base.writing import replacing

if TYPE_CHECKING:
    from slalom.sim.measure.recording import Recording


class Column(NamedTuple):
    """A column, or one column for each axis: its unit, "" for texts and truth values, and its meaning."""

    unit: str
    sentence: str


COLUMNS: Final[Mapping[str, Column]] = {
    "time": Column("s", "absolute time"),
    "robot": Column("", "name of the robot"),
    "x y z": Column("m", "position"),
    "vx vy vz": Column("m/s", "velocity"),
    "ax ay az": Column("m/s^2", "acceleration, constant until the next row of the robot; empty in the last row"),
    "control_x control_y control_z": Column("of the response", "control of the committed manoeuvre; empty likewise"),
    "response": Column("", "response of the committed manoeuvre, name of the method of a peer; empty likewise"),
    "outcome": Column("", "outcome of the decision, empty where no decision was due"),
    "decision_time": Column("s", "wall clock of the decision; empty in the last row"),
    "arrived": Column("", "whether the robot has arrived by that time"),
}
"""Columns of a run in the plane; columns of z are those of runs in space only."""


def columns_of(recording: "Recording") -> dict[str, npt.NDArray[Any]]:
    """Return the columns by name: the rows are sorted by time, then by robot, each while it is in the world."""
    count, n, d = recording.positions.shape
    there, last = np.zeros((2, count, n), dtype=np.bool_)
    for k in range(n):
        rows = recording.steps_of(k)
        there[rows, k] = True
        last[rows.stop - 1, k] = True

    def ended(rows: npt.NDArray[Any], value: object) -> npt.NDArray[Any]:
        """Append a row for the end of the run, and empty the last row of each robot: then it decides no more."""
        found = np.concatenate([rows, np.full((1, *rows.shape[1:]), value, dtype=rows.dtype)])
        found[last] = value
        return found

    filled = {
        "time": np.repeat(recording.times, n),
        "robot": np.array(list(recording.names) * count, dtype=object),
        "x y z": recording.positions,
        "vx vy vz": recording.velocities,
        "ax ay az": ended(recording.accelerations, np.nan),
        "control_x control_y control_z": ended(recording.controls, np.nan),
        "response": ended(np.array(recording.responses.texts, dtype=object).reshape(-1, n), "").ravel(),
        "outcome": ended(np.array(recording.outcomes, dtype=object).reshape(-1, n), "").ravel(),
        "decision_time": ended(recording.decision_times, np.nan).ravel(),
        "arrived": (recording.times[:, None] >= recording.arrived).ravel(),
    }
    found: dict[str, npt.NDArray[Any]] = {}
    for names in COLUMNS:
        axes, values = names.split(), filled[names]
        if len(axes) == 1:
            found[names] = values[there.ravel()]
        else:
            found.update(zip(axes, values.reshape(-1, d)[there.ravel()].T))
    return found


def facts_of(recording: "Recording") -> dict[str, str]:
    """Return scenario, method, foresight, seed, time step and digest of a run as texts."""
    names = ("scenario", "method", "foresight", "seed", "dt")
    return {**{name: str(getattr(recording, name)) for name in names}, "digest": recording.digest()}


def to_pandas(recording: "Recording") -> Any:
    """Return the columns as a pandas.DataFrame, whose `attrs` are the facts of the run.

    Raises:
        InvalidInput: pandas is not installed.
    """
    frame = _imported("pandas").DataFrame(columns_of(recording))
    frame.attrs.update(facts_of(recording))
    return frame


def write_csv(recording: "Recording", path: Path) -> None:
    """Write the columns as CSV with a header; numbers are read back to the bit, nan is an empty cell."""
    table = columns_of(recording)
    rows = zip(*(column.tolist() for column in table.values()))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        writer.writerows([["" if cell != cell else cell for cell in row] for row in rows])


def write_parquet(recording: "Recording", path: Path) -> None:
    """Write the columns as Parquet, with units and facts of the run as metadata.

    Raises:
        InvalidInput: pyarrow is not installed.
    """
    arrow, parquet = _imported("pyarrow"), _imported("pyarrow.parquet")
    table = columns_of(recording)
    units = {axis: column.unit for names, column in COLUMNS.items() for axis in names.split()}
    arrays = [arrow.array(column.tolist(), from_pandas=True) for column in table.values()]
    fields = [
        arrow.field(name, array.type, metadata={"unit": units[name]}) for name, array in zip(table, arrays, strict=True)
    ]
    schema = arrow.schema(fields, metadata=facts_of(recording))
    parquet.write_table(arrow.table(arrays, schema=schema), path)


def _imported(name: str) -> Any:
    with Extra("data", name):
        return import_module(name)


WRITERS: Final[Mapping[str, Callable[["Recording", Path], None]]] = {".csv": write_csv, ".parquet": write_parquet}
"""Writers by suffix."""


def write_table(recording: "Recording", path: Path | str) -> None:
    """Write the run as a tidy table, .csv or .parquet.

    Raises:
        InvalidInput: another suffix, a package that is not installed. InvalidFile: a file that cannot be written.
    """
    path = Path(path)
    if path.suffix not in WRITERS:
        raise InvalidInput(f"path: expected a file that ends in {', '.join(WRITERS)}; found {str(path)!r}")
    with replacing(path) as part:
        WRITERS[path.suffix](recording, part)
