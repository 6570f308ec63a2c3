"""Reader of any table of recorded agents: a layout names the columns of a format, and what its files do not state."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, known, number, positive, vector
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.io.recorded import Rows, counted, refuse
from slalom.io.sheet import LENGTHS, TIMES, Sheet, Sum, is_number, key, parquet, sheet_of, split, unit_name
from slalom.io.table import Table, decoded, refuse_widths
from slalom.kernels.arrays import Indices

EPOCHS: Final = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"), (1e8, "s"))
"""Least number of units since 1970, all in 1973, of each unit in which dates are written."""

FIELDS: Final[Mapping[str, str]] = {
    "t": "t|time|timestamp|times|seconds|datetime|time_utc|base_date_time|date_time_utc|simtime|simsec|elapsed|date",
    "frame": "frame|frame_id|frame_number|frame_no|frame_index|frame_idx|timestep",
    "id": "id|track_id|agent_id|agent|person_id|pers_id|ped_id|pedestrian_id|vehicle_id|object_id|obj_id|actor_id|pid|"
    "uuid|mmsi|icao24|icao|hex|track",
    **{
        axis: f"{axis}|pos_{axis}|{axis}_pos|position_{axis}|{axis}_position|center_{axis}|{axis}_center"
        for axis in "xyz"
    },
    "latitude": "latitude|lat",
    "longitude": "longitude|lon|lng|long",
    "altitude": "geo_altitude|altitude|baro_altitude|alt",
    **{name: name for name in ("radius", "length", "width")},
    "kind": "kind|type|class|agent_type|object_type|vessel_type|ship_type|category",
}
"""Usual columns of each field, compared by letters and digits without case; the first one present is used."""

EXTENTS: Final = ("radius", "length", "width")

UNKNOWN_POSITION: Final = (91.0, 181.0)
"""[degree] Latitude and longitude that AIS transmits for an unknown position (ITU-R M.1371)."""

ORDER_RATIO: Final = 1.5
"""[1] How many times as far agents move per row in the wrong order of the columns frame and id, at least.

Larger: more files without a header are refused. Smaller: an order is taken that is hardly better than the other.
"""


@dataclass(frozen=True)
class Layout:
    """The columns of a format, and what its files do not state.

    Attributes:
        fields: FIELD=COLUMN of each field, separated by spaces, beside those of FIELDS, if `named`. Columns in order of
            preference are separated by |; a column is a name or a sum such as left+0.5*width. FIELD= is no field.
        marks: names that a header must have. cells: regular expression of `Sheet.pattern`.
        names: of the columns of files without a header, in one text for each number of columns, the last for others.
        either: whether the first two of them may be in the other order.
        rate: [Hz] of frames. rates: [Hz] by the number of frames between two rows of an agent.
        unit: [m] of lengths; None if a unit must be given. assumed: whether it is noted. altitude_unit: [m].
        from_first: whether time 0 is the first time of the file. day_first: whether dates may be day/month/year.
        kinds: kind by code. left_out: value of a column in rows that are not read, and what such rows are.
        notes: assumptions, a sentence each.
    """

    fields: str = ""
    marks: str = ""
    named: bool = True
    cells: str = "#?.h"
    names: tuple[str, ...] = ()
    either: bool = False
    rate: float | None = None
    rates: Mapping[int, float] = field(default_factory=dict)
    unit: float | None = 1.0
    assumed: bool = False
    altitude_unit: float = 1.0
    from_first: bool = False
    day_first: bool = False
    kinds: Mapping[str, str] = field(default_factory=dict)
    left_out: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def found(self, sheet: Sheet) -> dict[str, list[Sum]]:
        """Return the columns of each field that a sheet has, in order of preference."""
        columns = {**(FIELDS if self.named else {}), **dict(part.split("=") for part in self.fields.split())}
        sums = {
            name: [s for text in texts.split("|") if text and (s := sheet.find(text))]
            for name, texts in columns.items()
        }
        return {name: found for name, found in sums.items() if found}

    def named_columns(self, sheet: Sheet) -> Sheet:
        """Return a sheet without a header with the names of its columns."""
        count = len(sheet.names)
        names = next((n for n in map(str.split, self.names) if len(n) == count), " ".join(self.names[-1:]).split())
        return replace(sheet, names=[*names, *sheet.names[len(names) :]][:count])

    def missing(self, sheet: Sheet) -> list[str]:
        """Return the marks and the fields that the header of a sheet lacks."""
        sheet = sheet if self.marks or not self.named else _long(sheet)
        return [mark for mark in self.marks.split() if not sheet.find(mark)] + _missing(self.found(sheet))

    def fits(self, sheet: Sheet) -> bool:
        """Return whether the beginning of a file has this layout."""
        return bool(re.fullmatch(self.cells, sheet.pattern())) and (sheet.headless or not self.missing(sheet))


def _missing(found: Mapping[str, list[Sum]]) -> list[str]:
    """Return the fields that a recording needs beside those that were found."""
    degrees = ("latitude", "longitude")
    axes = degrees if found.keys() & {*degrees} and not found.keys() & {"x", "y"} else ("x", "y")
    time = [] if found.keys() & {"t", "frame"} else ["t or frame"]
    return [*time, *([] if "id" in found else ["id"]), *(axis for axis in axes if axis not in found)]


def length_unit(unit: float | str | None) -> float | None:
    """Return a unit of lengths [m], by name or as a number; None for None. Raises InvalidInput for another one."""
    if unit is None or isinstance(unit, int | float):
        return None if unit is None else positive(unit, "unit")
    return LENGTHS[known(unit_name(unit), "unit", list(LENGTHS))]


@dataclass(frozen=True, kw_only=True)
class _Reading:
    """A sheet, its columns by field, notes, and settings of `read_layout`."""

    sheet: Sheet
    table: Table
    layout: Layout
    columns: Mapping[str, list[Sum]]
    notes: list[str]
    unit: float | None

    def name(self, of: str) -> str:
        """Return the column of a field."""
        return self.columns[of][0][0][1]

    def numbers(self, of: str, *, empty: bool = True) -> Array:
        """Return a field as numbers (n,) in the unit of the file."""
        return np.asarray(sum(f * self.table.numbers(name, empty=empty) for f, name in self.columns[of][0]))

    def lengths(self, of: str) -> Array:
        """Return a field as lengths (n,) [m]. Raises InvalidFile for a stated unit that is unknown or not the given."""
        terms = self.columns[of][0]
        return np.asarray(sum(f * self._scale(name) * self.table.numbers(name, empty=True) for f, name in terms))

    def stated(self, name: str) -> str:
        """Return the unit of lengths in a column that the file states, "" if it states none."""
        return self.sheet.units.get(name) or self.sheet.comment_unit

    @property
    def assumes(self) -> bool:
        """Whether m is assumed for positions."""
        assumed = self.unit is None and self.layout.unit == 1.0 and "latitude" not in self.columns
        return assumed and not all(self.stated(self.name(axis)) for axis in "xy")

    def _scale(self, name: str) -> float:
        path, stated = self.sheet.path, self.stated(name)
        if stated in LENGTHS and self.unit in (None, LENGTHS[stated]):
            note = f"lengths in {stated}, as a comment states"
            told = name in self.sheet.units or self.unit is not None or LENGTHS[stated] == 1.0 or note in self.notes
            self.notes.extend([] if told else [note])
            return LENGTHS[stated]
        if stated in LENGTHS:
            given = next((name for name, metres in LENGTHS.items() if metres == self.unit), f"{self.unit:g} m")
            raise InvalidFile([f"{path}: expected the given unit {given}, found {stated}"])
        unit = self.layout.unit if self.unit is None else self.unit
        if unit is None or (stated and self.unit is None):
            found = stated or "positions in pixels"
            raise InvalidFile([f"{path}: expected a unit, as in unit=0.04 for 0.04 m in a pixel, found {found}"])
        if (
            self.layout.assumed
            and self.unit is None
            and (note := "unit of the positions not stated: m assumed") not in self.notes
        ):
            self.notes.append(note)
        return unit


def read_layout(
    layout: Layout,
    path: Path,
    *,
    columns: Mapping[str, str | None] | None = None,
    frame_rate: float | None = None,
    unit: float | str | None = None,
    time_unit: str | None = None,
    encoding: str | None = None,
    case: float | None = None,
    origin: Sequence[float] | None = None,
    epoch: float | str | None = None,
    altitude_unit: float | None = None,
) -> Rows:
    """Read a table: time or frame, id, and x and y or latitude and longitude, below a header or by a layout.

    Rows without a position are left out, with a note. Latitude and longitude [degree] are projected to metres.

    Args:
        columns: by field, a column or a sum of columns, by name or number; None to ignore a field. Without an id, all
            rows are of one agent.
        frame_rate: [Hz] of frames. unit: of lengths, a name of LENGTHS or a number [m]. time_unit: a name of TIMES.
        encoding: of the text; UTF-8 or UTF-16, else Latin-1 with a note, if None.
        case: value of the column case_id of the rows to read.
        origin: latitude, longitude [degree] and, 0 by default, altitude [m]; the mean position if None, with a note.
        epoch: time 0, in seconds or in ISO 8601; of dates the first one if None, with a note. Dates are in ISO 8601, or
            numbers of seconds, ms, us or ns since 1970; without a zone they are UTC.
        altitude_unit: [m] unit of the altitude column, 0.3048 for feet.

    Raises:
        InvalidFile: no such columns, invalid cells, no frame rate or unit; a stated one that differs from a given one.
        InvalidInput: invalid settings.
    """
    for name in columns or {}:
        known(name, "columns", [*FIELDS])
    metres, seconds = length_unit(unit), None if time_unit is None else TIMES[known(time_unit, "time_unit", [*TIMES])]
    zero, start = None if epoch is None else _epoch(epoch), None if origin is None else _origin(origin)
    sheet = parquet(path) if path.suffix.lower() == ".parquet" else sheet_of(path, *decoded(path, encoding))
    sheet = layout.named_columns(sheet) if sheet.headless else sheet if "id" in (columns or {}) else _long(sheet)
    found = _resolved(layout, sheet, columns or {})
    table, notes = sheet.table(), [*layout.notes, *sheet.notes]
    reading = _Reading(sheet=sheet, table=table, layout=layout, columns=found, notes=notes, unit=metres)
    geographic = "latitude" in found
    axes = ("latitude", "longitude") if geographic else [axis for axis in "xyz" if axis in found]
    positions = np.stack([reading.numbers(axis) if geographic else reading.lengths(axis) for axis in axes], axis=1)
    if layout.either and sheet.headless and not columns:
        reading = _ordered(reading, positions)
    labels, agents = table.ids(reading.name("id")) if "id" in found else (["1"], np.zeros(len(positions), np.int64))
    left = _left_out(reading, case)
    if geographic:
        positions = _degrees(reading, positions, agents, altitude_unit)
    times, dates = _times(reading, agents, frame_rate, seconds)
    refuse(path, table.mistakes, sheet.location)
    keep = ~left & ~np.isnan(positions).any(axis=1)
    if not keep.any():
        raise InvalidFile([f"{path}: expected rows with a position, found none"])
    if blank := int(np.sum(~left & ~keep)):
        notes.append(f"{counted(blank, 'row')} without a position left out")
    if geographic:
        positions = _projected(positions, keep, start, notes)
    if zero is None and (dates or layout.from_first):
        zero = float(times[keep].min())
        stamp = datetime.fromtimestamp(zero, UTC).isoformat() if dates == "ISO" else zero
        notes.append(f"time 0 at the first time: {stamp}")
    extents: dict[str, Array] = {name: reading.lengths(name) for name in EXTENTS if name in found}
    texts = table.texts(reading.name("kind")) if "kind" in found else []
    kinds = [layout.kinds.get(text.removesuffix(".0"), text) for text in texts]
    times -= zero or 0.0
    rows = table.rows_of((labels, agents), times, positions, extents=extents, kinds=kinds, notes=notes, keep=keep)
    return replace(_with_ends(rows, reading, keep) if "t_end" in found else rows, assumed=reading.assumes)


def _long(sheet: Sheet) -> Sheet:
    """Return a sheet with one row for each agent and time: columns x1, y1, x2, y2 or 1_x, 1_y become id, x and y."""
    axes = {axis: _of_agents(sheet, axis) for axis in "xyz"}
    agents = [agent for agent in axes["x"] if agent in axes["y"]]
    found = Layout().found(sheet)
    clock = next((found[name][0][0][1] for name in ("t", "frame") if name in found), None)
    if not agents or clock is None or found.keys() & {"id", "x"}:
        return sheet
    refuse_widths(sheet.path, len(sheet.names), sheet.rows, sheet.lines, sheet.location)
    used = [axis for axis in "xyz" if all(agent in axes[axis] for agent in agents)]
    at = {name: k for k, name in enumerate(sheet.names)}
    cells = [[at[axes[axis][agent]] for axis in used] for agent in agents]
    rows = [[row[at[clock]], a, *(row[k] for k in own)] for a, own in zip(agents, cells) for row in sheet.rows]
    first = {clock: clock, **{axis: axes[axis][agents[0]] for axis in used}}
    units = {name: unit for name, of in first.items() if (unit := sheet.units.get(of) or split(of)[1])}
    return replace(sheet, names=[clock, "id", *used], units=units, rows=rows, lines=sheet.lines * len(agents))


def _of_agents(sheet: Sheet, axis: str) -> dict[str, str]:
    """Return the column of each agent that gives this axis."""
    pattern = re.compile(rf"{axis}(\d+)|{axis}[ _.](.+)|(.+)[ _.]{axis}", re.IGNORECASE)
    found = [(pattern.fullmatch(split(name)[0].strip()), name) for name in sheet.names]
    return {match[match.lastindex or 0]: name for match, name in found if match}


def _resolved(layout: Layout, sheet: Sheet, given: Mapping[str, str | None]) -> dict[str, list[Sum]]:
    """Return the columns of each field that the sheet has, in order of preference.

    Given columns come first; those of t before those of frames, and x and y before latitude and longitude.

    Raises:
        InvalidFile: a field without a column, a given or an ambiguous name of a column.
    """
    place, fields = f"{sheet.path}:{sheet.head}", layout.found(sheet)
    header = ",".join(sheet.names) if not sheet.headless else f"{len(sheet.names)} cells without a header"
    for name, column in given.items():
        fields.pop(name, None)
        if column is not None:
            terms = sheet.find(column)
            if terms is None:
                raise InvalidFile([f"{place}: columns: expected {name} as a column of {header!r}, found {column!r}"])
            fields[name] = [terms]
    if "frame" in given and "t" not in given:
        fields.pop("t", None)
    degrees, plane = {"latitude", "longitude"}, {"x", "y", "z"}
    if {"x", "y"} <= fields.keys():
        unwanted = plane if degrees <= given.keys() else {*degrees, "altitude"}
        fields = {name: found for name, found in fields.items() if name not in unwanted}
    missing = _missing({**fields, **({"id": []} if "id" in given else {})})
    if missing:
        alone = " (id= for one agent)" if "id" in missing else ""
        raise InvalidFile(
            [f"{place}: expected columns of {', '.join(missing)}, or their names in columns{alone}, found {header!r}"]
        )
    names = [key(name) for name in sheet.names]
    twice = {name for found in fields.values() for terms in found for _, name in terms if names.count(key(name)) > 1}
    if twice:
        raise InvalidFile([f"{place}: expected each column once, found {', '.join(sorted(twice))} twice"])
    return fields


def _ordered(reading: _Reading, positions: Array) -> _Reading:
    """Return the reading with the columns frame and id in the order in which agents move less from row to row.

    Raises:
        InvalidFile: in neither order the distance is ORDER_RATIO times that of the other.
    """
    columns, table = reading.columns, reading.table
    steps = []
    swapped = {**columns, "id": columns["frame"], "frame": columns["id"]}
    for fields in (columns, swapped):
        pairs = np.stack([table.numbers(fields[name][0][0][1]) for name in ("id", "frame")])
        (ids, _), order = np.unique(pairs, axis=1, return_index=True)
        same = np.diff(ids) == 0
        moved = np.linalg.norm(np.diff(positions[order], axis=0)[same], axis=1)
        steps.append(float(np.nanmedian(moved)) if np.isfinite(moved).any() else np.inf)
    usual, other = steps
    first, second = (of for of in reading.sheet.names[:2])
    if usual * ORDER_RATIO <= other:
        return reading
    if usual < other * ORDER_RATIO:
        expected = "columns id=1 and frame=2, or id=2 and frame=1, without a header"
        raise InvalidFile([f"{table.path}: expected {expected}; found that agents move alike in both orders"])
    reading.notes.append(f"columns without a header: {second} before {first}, in which order agents move less")
    return replace(reading, columns=swapped)


def _left_out(reading: _Reading, case: float | None) -> npt.NDArray[np.bool_]:
    """Return which rows are not read (n,): values of `Layout.left_out`, and of other cases."""
    table, sheet = reading.table, reading.sheet
    left = np.zeros(len(table.lines), dtype=np.bool_)
    for column, (value, what) in reading.layout.left_out.items():
        if terms := sheet.find(column):
            rows = table.numbers(terms[0][1], empty=True) == value
            left |= rows
            reading.notes.extend([f"{counted(int(rows.sum()), 'row')} left out: {what}"] * bool(rows.any()))
    terms = sheet.find("case_id")
    if terms is None and case is not None:
        raise InvalidFile([f"{sheet.path}: case_id: expected this column for case {case:g}, found none"])
    if terms is None or ("case=" not in reading.layout.fields and case is None):
        return left
    cases = table.numbers(terms[0][1])
    refuse(sheet.path, table.mistakes, sheet.location)
    chosen = cases == (cases[0] if case is None else case)
    if not chosen.any() or (case is None and not chosen.all()):
        expected = "one case, or the case to read" if case is None else f"case {case:g}"
        found = f"{np.unique(cases).size} from {cases.min():g} to {cases.max():g}"
        raise InvalidFile([f"{sheet.path}: case_id: expected {expected}, found {found}"])
    return np.asarray(left | ~chosen)


def _with_ends(rows: Rows, reading: _Reading, keep: npt.NDArray[np.bool_]) -> Rows:
    """Return the rows, which begin steps, with the end of the last step of each agent whose steps follow each other."""
    times = reading.numbers("t_end")[keep]
    places = np.stack([reading.lengths(name)[keep] for name in ("x_end", "y_end")], axis=1)
    refuse(reading.sheet.path, reading.table.mistakes, reading.sheet.location)
    order = np.lexsort((rows.times, rows.agents))
    same = np.diff(rows.agents[order]) == 0
    # Rounded to 1e-6 m and s.
    off = np.abs(places[order][:-1] - rows.positions[order][1:]).max(axis=1) > 1e-6
    off &= np.abs(times[order][:-1] - rows.times[order][1:]) <= 1e-6
    wrong = np.bincount(rows.agents[order][:-1], weights=same & off, minlength=len(rows.labels))
    notes = [
        f"{counted(int(count), 'step')} of agent {label} end where the next does not begin: only beginnings are read"
        for label, count in zip(rows.labels, wrong)
        if count
    ]
    last = order[np.append(~same, True) & (wrong[rows.agents[order]] == 0) & (times > rows.times)[order]]
    return replace(
        rows,
        agents=np.append(rows.agents, rows.agents[last]),
        times=np.append(rows.times, times[last]),
        positions=np.concatenate([rows.positions, places[last]]),
        lines=np.append(rows.lines, rows.lines[last]),
        extents={name: np.append(values, values[last]) for name, values in rows.extents.items()},
        notes=(*rows.notes, *notes),
    )


def _degrees(reading: _Reading, positions: Array, agents: Indices, unit: float | None) -> Array:
    """Return latitude, longitude [degree] and, if there is such a column, altitude [m]; nan for unknown positions.

    The altitude of an agent is that of the column in which most of its rows have one.
    """
    table, columns = reading.table, reading.columns
    positions[(positions == UNKNOWN_POSITION).any(axis=1)] = np.nan
    for axis, limit, values in (("latitude", 90.0, positions[:, 0]), ("longitude", 180.0, positions[:, 1])):
        for row in np.flatnonzero(np.abs(values) > limit):
            expected = f"expected from -{limit:g} to {limit:g} degrees, found {values[row]:g}"
            table.wrong(row, reading.name(axis), expected)
    if "altitude" not in columns:
        return positions
    metres, found = None if unit is None else positive(unit, "altitude_unit"), []
    for (factor, name), *_ in columns["altitude"]:
        scale = metres or LENGTHS.get(reading.sheet.units.get(name, "")) or reading.layout.altitude_unit
        found.append(table.numbers(name, empty=True) * scale * factor)
    best = np.argmax([np.bincount(agents, weights=~np.isnan(values)) for values in found], axis=0)
    for k in np.unique(best[best > 0]):
        count, name = counted(int(np.sum(best == k)), "agent"), columns["altitude"][k][0][1]
        reading.notes.append(f"altitude of {count} from {name}")
    return np.column_stack([positions, np.choose(best[agents], found)])


def _projected(
    positions: Array, keep: npt.NDArray[np.bool_], origin: tuple[float, ...] | None, notes: list[str]
) -> Array:
    """Return positions (n, d) [m] of latitude, longitude [degree] and altitude [m], about the mean of those to keep.

    Longitudes are averaged as offsets within +-180 degrees of the first.
    """
    if origin is None:
        latitude, longitude = positions[keep, 0], positions[keep, 1]
        offset = (longitude - longitude[0] + 180.0) % 360.0 - 180.0
        origin = (float(np.mean(latitude)), float(longitude[0] + np.mean(offset)))
        notes.append(f"origin at the mean position: latitude {origin[0]!r}, longitude {origin[1]!r}")
    height = positions[:, 2] if positions.shape[1] > 2 else 0.0
    return project(positions[:, 0], positions[:, 1], height, origin)[:, : positions.shape[1]]


def _origin(value: Sequence[float]) -> tuple[float, ...]:
    origin = tuple(vector(value, "origin").tolist())
    if abs(origin[0]) > 90.0 or abs(origin[1]) > 180.0:
        raise InvalidInput(f"origin: expected a latitude and a longitude in degrees, found {origin}")
    return origin


def _times(reading: _Reading, agents: Indices, frame_rate: float | None, unit: float | None) -> tuple[Array, str]:
    """Return the times (n,) [s], and ISO or the unit of dates; "" for other times."""
    table, sheet = reading.table, reading.sheet
    if "t" not in reading.columns:
        if unit is not None:
            raise InvalidInput("time_unit: expected none with frames, which have a frame_rate; found one")
        frames = table.numbers(reading.name("frame"), whole=True)
        refuse(sheet.path, table.mistakes, sheet.location)
        return frames / _frame_rate(reading, frames, agents, frame_rate), ""
    name = reading.name("t")
    if frame_rate is not None:
        raise InvalidInput(f"frame_rate: expected none with times in the column {name!r}, found {frame_rate:g}")
    cells = table.texts(name)
    if not is_number(next(filter(None, cells), "0")):
        return _dates(table, name, cells, reading.layout.day_first), "ISO"
    values = reading.numbers("t", empty=False)
    stated = unit or TIMES.get(sheet.units.get(name, ""))
    least = float(np.nanmin(np.abs(values))) if np.isfinite(values).any() else 0.0
    if stated is not None:
        return values * stated, "s" if least * stated >= EPOCHS[-1][0] else ""
    found = next((name for bound, name in EPOCHS if least >= bound), "")
    reading.notes.extend([f"times in {found} since 1970"] * (found not in ("", "s")))
    return values * TIMES.get(found, 1.0), found


def _frame_rate(reading: _Reading, frames: Array, agents: Indices, given: float | None) -> float:
    """Return the frame rate [Hz] that the file states or the caller gives, else that of the layout."""
    path, layout = reading.sheet.path, reading.layout
    stated = reading.sheet.rate()
    given = None if given is None else positive(given, "frame_rate")
    rate = given if stated is None else stated
    if rate is None and layout.rates:
        # Without two rows of an agent, no rate matters.
        step = frame_step(frames, agents) or next(iter(layout.rates))
        if step not in layout.rates:
            steps = " or ".join(map(str, layout.rates))
            raise InvalidFile(
                [f"{path}: expected frames {steps} apart, or a frame_rate, found {step:g} apart and none"]
            )
        return layout.rates[step]
    if rate is None and layout.rate is not None:
        reading.notes.append(f"frame rate of {layout.rate:g} Hz assumed")
        return layout.rate
    if rate is None or rate <= 0.0 or given not in (None, rate):
        expected = "a frame rate above 0, in the file or given" if given is None else f"the frame rate of {given:g} Hz"
        raise InvalidFile(
            [f"{path}: expected {expected}, found {'none: give --frame-rate' if rate is None else f'{rate:g} Hz'}"]
        )
    return rate


def frame_step(frames: Array, agents: Indices) -> int:
    """Return the median number of frames between consecutive rows of an agent; 0 if all rows are alone."""
    order = np.lexsort((frames, agents))
    steps = np.diff(frames[order])
    steps = steps[(np.diff(agents[order]) == 0) & (steps > 0)]
    return int(np.median(steps)) if steps.size else 0


def _dates(table: Table, name: str, cells: Sequence[str], day_first: bool) -> Array:
    """Return the column in seconds since 1970."""
    stamps = {}
    for k, cell in enumerate(cells):
        if cell not in stamps:
            try:
                stamps[cell] = _unix(cell, day_first)
            except (ValueError, OverflowError):
                table.wrong(k, name, f"expected a time in ISO 8601 or in seconds, found {cell!r}")
    return np.array([stamps.get(cell, np.nan) for cell in cells])


_DAY_FIRST = re.compile(r"(\d\d)/(\d\d)/(\d{4})(.*)")
_ZONE = re.compile(r"\s*([+-]\d\d):?(\d\d)(?:\s+[A-Z]{1,5})?$|\s*(?:UTC|Z)$")
_FRACTION = re.compile(r"([.,]\d{6})\d+")


def _unix(text: str, day_first: bool = False) -> float:
    """Convert a time in ISO 8601, or as day/month/year, to seconds since 1970. Raises ValueError for any other text."""
    if day_first and (match := _DAY_FIRST.fullmatch(text)):
        text = f"{match[3]}-{match[2]}-{match[1]}{match[4]}"
    text = _ZONE.sub(lambda zone: f"{zone[1]}:{zone[2]}" if zone[1] else "+00:00", _FRACTION.sub(r"\1", text))
    time = datetime.fromisoformat(text)
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()


def _epoch(value: float | str) -> float:
    try:
        return _unix(value) if isinstance(value, str) else number(value, "epoch")
    except ValueError as error:
        raise InvalidInput(f"epoch: expected seconds or a time in ISO 8601, found {value!r}") from error


# Projection of latitude, longitude and altitude to metres in a plane or in space.


# Latitude and longitude projected to metres east, north and up.
#
# With WGS 84, a = 6378137 m, f = 1 / 298.257223563, e^2 = f (2 - f), the geocentric position of latitude p, longitude
# l and height h is
#
#     N = a / sqrt(1 - e^2 sin^2 p)
#     X = (N + h) cos p cos l,  Y = (N + h) cos p sin l,  Z = (N (1 - e^2) + h) sin p
#
# and, with the differences D from the geocentric position of the origin (p0, l0, h0),
#
#     east  = -sin l0 DX + cos l0 DY
#     north = -sin p0 (cos l0 DX + sin l0 DY) + cos p0 DZ
#     up    =  cos p0 (cos l0 DX + sin l0 DY) + sin p0 DZ
#
# (NIMA TR8350.2, 3rd edition). Distances in space are preserved. Take a point on the ground at distance d from the
# origin. In the plane it is closer by about (d / R)^2 / 6 of d (4 mm at 10 km). It lies d^2 / 2R below the plane (7.8
# m at 10 km).


AXIS: Final = 6378137.0
ECCENTRICITY_SQUARED: Final = (2.0 - 1.0 / 298.257223563) / 298.257223563


def project(
    latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike, origin: Sequence[float]
) -> Array:
    """Project latitude and longitude [degree] and altitude [m] to east, north and up (..., 3) [m].

    Args:
        origin: latitude, longitude [degree] and, 0 by default, altitude [m].
    """
    lat0, lon0, h0 = (*origin, 0.0)[:3]
    east, north = np.radians(lon0), np.radians(lat0)
    dx, dy, dz = np.moveaxis(_geocentric(latitude, longitude, altitude) - _geocentric(lat0, lon0, h0), -1, 0)
    horizontal = np.cos(east) * dx + np.sin(east) * dy
    return np.stack(
        [
            np.cos(east) * dy - np.sin(east) * dx,
            np.cos(north) * dz - np.sin(north) * horizontal,
            np.cos(north) * horizontal + np.sin(north) * dz,
        ],
        axis=-1,
    )


def _geocentric(latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike) -> Array:
    """Return geocentric X, Y, Z (..., 3) [m] of latitude and longitude [degree] and altitude [m]."""
    p = np.radians(latitude)
    q = np.radians(longitude)
    h = np.asarray(altitude, dtype=np.float64)
    normal = AXIS / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(p) ** 2)
    horizontal = (normal + h) * np.cos(p)
    return np.stack(
        [horizontal * np.cos(q), horizontal * np.sin(q), (normal * (1.0 - ECCENTRICITY_SQUARED) + h) * np.sin(p)],
        axis=-1,
    )
