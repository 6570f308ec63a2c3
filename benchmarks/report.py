"""Render docs/performance.md and its figures from the results of the other programs; measure nothing.

usage: python benchmarks/report.py [--results FOLDER] [--docs FOLDER] [--keep FOLDER]
"""

import argparse
import ast
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import plots
from program import shown

PROGRAMS = ("start", "sampling", "mpc", "stages", "decision", "walls", "scaling", "fleet_step", "boundaries", "memory")
PICTURES: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "sampling": (plots.decisions, "Time of one decision of nao, of samplers and of a model predictive controller."),
    "stages": (plots.stages, "Time of the stages of one decision."),
    "scaling": (plots.scaling, "Time against number of obstacles, knots and robots; dotted: proportional."),
    "fleet_step": (plots.fleets, "One step of a fleet, per robot."),
    "boundaries": (plots.boundaries, "Time of boundaries against the share of wrong controls."),
    "memory": (plots.memory, "Growth of the resident memory over many calls."),
}
"""Per program the figure of its results, and the caption."""
HERE = Path(__file__).parent


def explanation(name: str) -> tuple[str, str]:
    """The first sentence of a program's docstring, and the paragraphs after its usage."""
    doc = ast.get_docstring(ast.parse((HERE / f"{name}.py").read_text())) or ""
    first, *rest = doc.split("\n\n")
    told = [" ".join(part.split()) for part in rest if not part.startswith("usage:")]
    return " ".join(first.split()), "\n\n".join(told)


def lines_of(heads: list[str], rows: list[list[Any]]) -> Iterator[str]:
    """A table in Markdown."""
    yield "| " + " | ".join(heads) + " |"
    yield "|" + "---|" * len(heads)
    for row in rows:
        yield "| " + " | ".join(shown(cell) for cell in row) + " |"


def goals(results: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Every target, and whether it is met, as decided by the programs."""
    found = [(name, one) for name, result in results.items() for one in result.get("targets", [])]
    met = sum(one["met"] for _, one in found)
    yield f"{met} of {len(found)} targets are met."
    yield ""
    rows = [
        [
            f"`{name}`",
            one["what"],
            one["required"],
            f"{shown(one['value'])} {one['unit'] if one['value'] is not None else ''}".strip(),
            "met" if one["met"] else "**missed**",
        ]
        for name, one in found
    ]
    yield from lines_of(["program", "quantity", "required", "found", ""], rows)


def setting(results: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Machine, versions and dates; equal machines once."""
    machines = {json.dumps(result["machine"], sort_keys=True) for result in results.values()}
    packages = {k: v for result in results.values() for k, v in result.get("packages", {}).items()}
    for text in sorted(machines):
        of = json.loads(text)
        versions = ", ".join(f"{k} {of[k]}" for k in ("python", "slalom", "numpy", "numba", "llvmlite"))
        yield f"Machine: {of['processor']}, {of['cores']} cores, {of['system']} on {of['machine']}; {versions}."
    loops = [result["loop_ms"] for result in results.values()]
    took = f"{min(loops):.0f} to {max(loops):.0f} ms"
    yield f"After each program a million additions in Python took {took}. Times, not ratios, vary accordingly."
    if packages:
        yield "Peers: " + ", ".join(f"{name} {packages[name]}" for name in sorted(packages)) + "."
    days = sorted({result["finished"] for result in results.values()})
    yield f"Measured on {days[0]}." if len(days) == 1 else f"Measured from {days[0]} to {days[-1]}."
    if any(result.get("quick") for result in results.values()):
        yield "**Some of these are quick runs, and their figures mean nothing.**"


def tables(result: dict[str, Any]) -> Iterator[str]:
    """The tables of a result; of the older programs the only one."""
    for one in result.get("tables", []):
        yield f"{one['title']}:"
        yield ""
        yield from lines_of(one["heads"], one["rows"])
        yield ""
    if "tables" not in result:
        rows: dict[str, dict[str, float]] = result["rows"]
        yield from lines_of(["what", *next(iter(rows.values()))], [[what, *row.values()] for what, row in rows.items()])
        yield ""


def section(name: str, results: dict[str, dict[str, Any]], images: Path) -> Iterator[str]:
    """The section of one program."""
    title, told = explanation(name)
    yield f"## {name}: {results[name]['question'][0].lower() + results[name]['question'][1:]}"
    yield ""
    yield title
    yield ""
    if told:
        yield told
        yield ""
    if "parameters" in results[name]:
        given = ", ".join(f"{k} {v}" for k, v in results[name]["parameters"].items())
        yield f"Parameters: {given}."
        yield ""
    if name in PICTURES:
        draw, caption = PICTURES[name]
        draw(results).savefig(images / f"performance-{name}.png", dpi=110)
        yield f"![{caption}](images/performance-{name}.png)"
        yield ""
    yield from tables(results[name])


def page(results: dict[str, dict[str, Any]], images: Path) -> Iterator[str]:
    """The document, line by line."""
    yield "# Speed, measured"
    yield ""
    yield (
        "`make bench` makes this page. It runs the programs below once, one after the other, renders their results "
        "and keeps them in `benchmarks/results/performance`. `python benchmarks/NAME.py` runs one program, and "
        "`python benchmarks/report.py` renders the page again. Peers come from packages "
        "(`pip install 'slalom[peers,bench]'`). They run in the same run on the same scenes; numpy's matrix products "
        "use one thread. Times depend on the machine and on its load, so the ratios are the results. With large "
        "arrays the ratios too are larger on a busy machine. Times are medians, called from Python, without "
        "compilation and imports. The programs decide whether a target is met."
    )
    yield ""
    yield from setting(results)
    yield ""
    missing = [name for name in PROGRAMS if name not in results]
    if missing:
        yield f"Not run: {', '.join(missing)}. Their targets are not in the list."
        yield ""
    yield "## Targets"
    yield ""
    yield from goals(results)
    yield ""
    for name in results:
        yield from section(name, results, images)


def render(folder: Path, docs: Path, keep: Path | None = None) -> Path:
    """Write the page from the JSON files of a folder, and copies of these files to `keep`; return its path."""
    found = {name: folder / f"{name}.json" for name in PROGRAMS}
    results = {name: json.loads(path.read_text()) for name, path in found.items() if path.exists()}
    if not results:
        raise SystemExit(f"{folder}: expected results of {', '.join(PROGRAMS)}, found none; run `make bench`")
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        for name in results:
            shutil.copyfile(found[name], keep / found[name].name)
    images = docs / "images"
    images.mkdir(parents=True, exist_ok=True)
    path = docs / "performance.md"
    path.write_text("\n".join(page(results, images)).rstrip() + "\n")
    return path


def main() -> None:
    """Read, render."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, default=Path("out/benchmarks"))
    parser.add_argument("--docs", type=Path, default=Path("docs"))
    parser.add_argument("--keep", type=Path, help="folder for copies of the results")
    arguments = parser.parse_args()
    print("written:", render(arguments.results, arguments.docs, arguments.keep))


if __name__ == "__main__":
    main()
