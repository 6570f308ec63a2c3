"""Parts of all measuring programs: options, tables, targets, and the written results."""

import argparse
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from machine import write

Row = Sequence[str | int | float]


def options(doc: str | None) -> argparse.ArgumentParser:
    """The options --quick and --out. A quick run executes every line; its figures mean nothing."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="tiny sizes: for tests, not for figures")
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks"))
    return parser


def table(title: str, heads: Sequence[str], rows: Sequence[Row]) -> dict[str, Any]:
    """A table for printing and writing; numbers stay numbers."""
    return {"title": title, "heads": list(heads), "rows": [list(row) for row in rows]}


def target(
    what: str, value: float | None, *, least: float | None = None, most: float | None = None, unit: str = ""
) -> dict[str, Any]:
    """A target: the required value, the found value, and whether it is met; None: not measured."""
    met = value is not None and (least is None or value >= least) and (most is None or value <= most)
    required = f"at least {shown(least)}" if least is not None else f"at most {shown(most)}"
    return {"what": what, "required": f"{required} {unit}".strip(), "value": value, "unit": unit, "met": bool(met)}


def shown(value: Any) -> str:
    """A number with three digits, anything else as it is."""
    if value is None:
        return "not measured"
    if value != value:
        return "-"
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return str(value)
    if isinstance(value, int) or value == 0 or not np.isfinite(value):
        return f"{value:g}" if isinstance(value, float) else str(value)
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def finish(name: str, result: dict[str, Any], arguments: argparse.Namespace, packages: Sequence[str] = ()) -> None:
    """Print tables and targets; write them with the machine, the versions and the parameters."""
    for one in result["tables"]:
        print(f"\n{one['title']}")
        lines = [one["heads"], *([shown(cell) for cell in row] for row in one["rows"])]
        widths = [max(len(line[k]) for line in lines) for k in range(len(one["heads"]))]
        for line in lines:
            print("  ".join(f"{c:<{w}}" if k == 0 else f"{c:>{w}}" for k, (c, w) in enumerate(zip(line, widths))))
    print()
    for one in result["targets"]:
        state = "met" if one["met"] else "MISSED"
        print(f"{state}: {one['what']}: {shown(one['value'])} {one['unit']}".rstrip() + f", required {one['required']}")
    about = {
        "packages": {package: version(package) for package in packages},
        "quick": arguments.quick,
        "finished": time.strftime("%Y-%m-%d"),
    }
    print("written:", write(name, {**about, **result}, arguments.out))
