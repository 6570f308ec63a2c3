"""Results of comparisons as tables: tidy rows for CSV and pandas, and cells for readers, of which LaTeX is made."""

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any, Final

from slalom.base.errors import Extra, InvalidInput
from slalom.base.writing import write_file

Table = Mapping[str, Any]
"""A result of `study.compare`."""
Row = Mapping[str, Any]
"""The result of a method in it."""

FILE: Final = re.compile(r"\.(csv|ya?ml|py:\w+)$")
"""The end of the name of a scenario that is a file, or in one."""


def scenario_text(name: str, settings: Mapping[str, float]) -> str:
    """Return a scenario with its settings; for a file its name without the folder."""
    listed = ", ".join(f"{name}={value:g}" for name, value in settings.items())
    # The folder differs between machines; a table must not.
    return f"{Path(name).name if FILE.search(name) else name} {listed}".rstrip()


def yes(value: bool) -> str:
    """Return a truth value for readers."""
    return "yes" if value else "no"


def decimal(value: float | None, digits: int) -> str:
    """Return a number with so many digits behind the point; "-" for none."""
    return "-" if value is None else f"{value:.{digits}f}"


def count(row: Row, name: str) -> int:
    """Return a count of runs; equal runs are one."""
    return min(int(row[name]), int(row["distinct_runs"]))


def failures(table: Table, row: Row) -> list[str]:
    """Return one text per reason for which runs have no result, with their seeds."""
    reasons = []
    for failure in row["failures"]:
        seeds, number = failure["seeds"], len(failure["seeds"])
        listed = ", ".join(str(seed) for seed in seeds[:6]) + (", ..." if number > 6 else "")
        lost = "none ran" if number == table["seeds"] else f"{number} did not run (seeds {listed})"
        reasons.append(f"{lost}: {failure['reason']}")
    return reasons


def metric_text(row: Row, name: str) -> str:
    """Return the mean of a metric with its confidence interval and range; "-" where it has no value."""
    found = row.get("metrics", {}).get(name)
    if found is None or found["mean"] is None:
        return "-"
    if found["interval"] is None:
        return f"{found['mean']:.4g}"
    (low, high), (least, most) = found["interval"], found["range"]
    return f"{found['mean']:.4g} ({low:.4g}-{high:.4g}), {least:.4g} to {most:.4g}"


def _runs(table: Table, row: Row) -> str:
    """Return the number of runs of a method, equal runs as one, and the reasons of those without a result."""
    made = f"{row['distinct_runs']}, deterministic" if table["deterministic"] and row["runs"] else str(row["runs"])
    return "; ".join([made, *failures(table, row)])


def _share(table: Table, row: Row, name: str) -> str:
    """Return a count and the confidence interval of its share."""
    if not row["runs"]:
        return "-"
    if table["deterministic"]:
        return str(count(row, name))
    low, high = row[f"{name}_interval"]
    return f"{row[name]} ({100 * low:.0f}-{100 * high:.0f} %)"


def _mean(row: Row) -> str:
    interval = row["time_interval"]
    return decimal(row["time"], 1) + (f" ({interval[0]:.1f}-{interval[1]:.1f})" if interval else "")


CELLS: Final[Mapping[str, tuple[str, Callable[[Table, Row], str]]]] = {
    "foresight": ("foresight", lambda table, row: row["foresight"] or "-"),
    "runs": ("runs", _runs),
    "guided": ("guided", lambda table, row: yes(row["guided"])),
    "runs_with_collision": ("with a collision", lambda table, row: _share(table, row, "runs_with_collision")),
    "runs_all_arrived": ("all arrived", lambda table, row: _share(table, row, "runs_all_arrived")),
    "runs_successful": ("success", lambda table, row: _share(table, row, "runs_successful")),
    "time": ("last arrival s", lambda table, row: _mean(row)),
    "adjustments": ("adjustments", lambda table, row: decimal(row["adjustments"], 1)),
    "jerk": ("jerk m/s^3", lambda table, row: decimal(row["jerk"], 2)),
    "extra_time": ("extra time s", lambda table, row: ", ".join(decimal(x, 2) for x in row["extra_time"] or [None])),
    "efficacy": ("efficacy", lambda table, row: decimal(row["efficacy"], 2)),
    "min_clearance": ("least clearance m", lambda table, row: decimal(row["min_clearance"], 3)),
}
"""Heading and text of the columns behind scenario and method, by name."""


def metrics_of(tables: Sequence[Table]) -> list[str]:
    """Return the names of the further metrics of all rows."""
    return list(dict.fromkeys(name for table in tables for row in table["methods"].values() for name in _named(row)))


def _named(row: Row) -> Sequence[str]:
    return list(row.get("metrics", ()))


def varied(tables: Sequence[Table]) -> list[str]:
    """Return the settings that differ between the tables."""
    names = dict.fromkeys(name for table in tables for name in table["settings"])
    return [name for name in names if len({table["settings"].get(name) for table in tables}) > 1]


def printed(tables: Sequence[Table], *, own: Sequence[str] = ()) -> list[list[str]]:
    """Return headings and rows of cells for readers; the settings `own` have a column each."""
    metrics = metrics_of(tables)
    rows = [["scenario", *own, "method", *(heading for heading, _ in CELLS.values()), *metrics]]
    for table in tables:
        settings = table["settings"]
        others = {name: value for name, value in settings.items() if name not in own}
        first = [scenario_text(str(table["scenario"]), others)]
        first += [f"{settings[name]:g}" if name in settings else "-" for name in own]
        for name, row in table["methods"].items():
            cells = [text(table, row) for _, text in CELLS.values()]
            rows.append([*first, name, *cells, *(metric_text(row, metric) for metric in metrics)])
    return rows


COUNTS: Final = ("runs_with_collision", "runs_all_arrived", "runs_successful")
"""Counts of runs with a confidence interval of their share."""
PERCENTILES: Final = ("extra_time_50", "extra_time_75", "extra_time_90")
"""[s] Columns of the percentiles of the extra time."""
HEADS: Final = (
    *("scenario", "settings", "method", "foresight", "guided", "seeds", "runs", "distinct_runs"),
    *(name for count in COUNTS for name in (count, f"{count}_low", f"{count}_high")),
    *("time", "time_low", "time_high", "adjustments", "jerk", *PERCENTILES, "efficacy", "min_clearance", "failures"),
)
"""Columns before those of further metrics. Times in s, jerk in m/s^3, clearance in m; shares of 95 % intervals."""


def tidy(tables: Sequence[Table]) -> list[dict[str, Any]]:
    """Return a row of values for each scenario and method: HEADS, further metrics, and the settings that differ.

    A metric has three columns: its mean and the ends of its interval. A setting has a column of its name unless that is
    one of HEADS; `settings` has the text of all. None: no value.
    """
    own = [name for name in varied(tables) if name not in HEADS]
    return [
        _tidy(table, method, row) | {name: table["settings"].get(name) for name in own}
        for table in tables
        for method, row in table["methods"].items()
    ]


def _tidy(table: Table, method: str, row: Row) -> dict[str, Any]:
    given = {**table, **row, "method": method}
    cells = {name: given.get(name) for name in HEADS}
    cells["settings"] = " ".join(f"{name}={value!r}" for name, value in table["settings"].items())
    cells["failures"] = "; ".join(f"{len(one['seeds'])}: {one['reason']}" for one in row["failures"])
    for name in (*COUNTS, "time"):
        cells |= _interval(name, row[f"{name}_interval"])
    cells |= zip(PERCENTILES, row["extra_time"] or (None,) * len(PERCENTILES))
    for name, found in row.get("metrics", {}).items():
        cells |= {name: found["mean"]} | _interval(name, found["interval"])
    return cells


def _interval(name: str, interval: list[float] | None) -> dict[str, float | None]:
    low, high = interval or (None, None)
    return {f"{name}_low": low, f"{name}_high": high}


def csv_text(tables: Sequence[Table]) -> str:
    """Return the tidy rows as CSV with a header; empty cells have no value. Numbers are read back to the bit."""
    rows = tidy(tables)
    stream = StringIO()
    writer = csv.DictWriter(stream, list(dict.fromkeys(name for row in rows for name in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(row | {"guided": str(row["guided"]).lower()} for row in rows)
    return stream.getvalue()


def data_frame(tables: Sequence[Table]) -> Any:
    """Return the tables of `compare_all` as one pandas.DataFrame, with the columns of CSV files of `slalom compare`.

    A row for each scenario and method. The settings that differ between the tables have a column each.

    Raises:
        MissingExtra: pandas is not installed.
    """
    with Extra("data", "data_frame"):
        import pandas
    return pandas.DataFrame(tidy(tables))


ESCAPED: Final = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
}
"""Characters with a meaning in LaTeX, and what prints them."""


def escaped(text: str) -> str:
    """Return text as LaTeX: special characters printed, minus signs and ranges of numbers set as such."""
    plain = "".join(ESCAPED.get(sign, sign) for sign in text.replace("\n", " "))
    between = re.sub(r"(?<=\d)-(?=\d)", "--", plain)
    return (
        re.sub(r"(?<![\w-])-(?=\d)", "$-$", between)
        .replace(r"\textasciicircum{}2", "$^2$")
        .replace(r"\textasciicircum{}3", "$^3$")
    )


def latex_text(tables: Sequence[Table], made: str = "") -> str:
    """Return the cells of `printed` as a tabular of LaTeX with rules of booktabs, for `\\input`.

    Settings that differ have a column each. Columns that are the same in several rows are left out and listed in a
    comment at the top, after `made`, the command and the versions.
    """
    heads, *rows = printed(tables, own=varied(tables))
    same = [len(rows) > 1 and len({row[k] for row in rows}) == 1 for k in range(len(heads))]
    told = "; ".join(f"{head}: {rows[0][k]}" for k, head in enumerate(heads) if same[k])
    comments = [f"% {line}" for line in (made, f"The same in all rows: {told}." if told else "", NEEDS) if line]
    shown = [k for k in range(len(heads)) if not same[k]]
    lines = [" & ".join(escaped(row[k]) for k in shown) + r" \\" for row in (heads, *rows)]
    columns = "".join("r" if all(re.match(r"-?\d|-$", row[k]) for row in rows) else "l" for k in shown)
    begin = [rf"\begin{{tabular}}{{{columns}}}", r"\toprule", lines[0], r"\midrule"]
    return "\n".join([*comments, *begin, *lines[1:], r"\bottomrule", r"\end{tabular}"]) + "\n"


NEEDS: Final = r"Needs \usepackage{booktabs}."
NAMES: Final = "surrogateescape"
"""A name of a file that the encoding of the system does not have is written as its bytes."""


class Written:
    """What the command `compare` writes of results. A file that exists is replaced."""

    _tables: Sequence[Table]

    def to_csv(self, path: Path | str | None = None) -> str:
        """Return the tables as CSV, see `csv_text`; write it to a file."""
        return _written(csv_text(self._tables), path)

    def to_latex(self, path: Path | str | None = None) -> str:
        """Return the tables as a tabular of LaTeX, see `latex_text`; write it to a file."""
        return _written(latex_text(self._tables), path)

    def figure(self) -> Any:
        """Return a matplotlib.figure.Figure of success and last arrival, see `slalom.view.study`.

        Raises:
            MissingExtra: matplotlib is not installed.
        """
        # By name, since the layer that draws is above.
        return import_module("slalom.view").study(self._tables)


class Comparison(dict[str, Any], Written):
    """The result of `study.compare`: a table, with methods that write it."""

    _tables = property(lambda self: [self])


class Comparisons(list[Comparison], Written):
    """The result of `study.compare_all`: tables, with methods that write them."""

    _tables = property(lambda self: self)


def _written(text: str, path: Path | str | None) -> str:
    if path is not None:
        write_file(Path(path), text, NAMES)
    return text


WRITERS: Final[Mapping[str, Callable[[Sequence[Table], str], str]]] = {
    ".csv": lambda tables, made: csv_text(tables),
    ".tex": latex_text,
}
"""Texts of files of tables by suffix; their second argument is the command that makes the table."""


def writer_of(path: Path) -> Callable[[Sequence[Table], str], str]:
    """Return the writer of a file. Raises InvalidInput for another suffix than those of WRITERS."""
    if path.suffix not in WRITERS:
        raise InvalidInput(f"--out: expected a file that ends in {' or '.join(WRITERS)}, found {str(path)!r}")
    return WRITERS[path.suffix]
