"""The size of the project beside the limits of tools/budget.toml.

    python tools/budget.py           # every figure today, its limit, and what breaks a law
    python tools/budget.py --lower   # writes today's figures where they are below their limits

A row of the file is the history of a limit. Its first number is that of the start, its last one the limit. A row of
another count needs a figure in `figures` and nothing else.
"""

import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FILE = ROOT / "tools" / "budget.toml"
PAGES = ("docs/**/*.md", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
BEHAVIOUR = re.compile(
    r"(decision|fleet|forecast|lookahead|perception|vehicle|kernels/(decision|guidance|sequence_search|vehicle|crowd))\b"
)
"""Files whose tuned constants shape what a robot does; those of others are tolerances, limits of files and views."""
TUNED = re.compile(r"\b([Ll]arger|[Ss]maller|More|Fewer|Longer|Shorter|As of)\b")
"""A constant whose text says what happens if it is larger or smaller is tuned by hand."""


def figures(root: Path = ROOT) -> dict[str, int]:
    """Every figure by section and name: lines by room, tuned constants, public names, lines of tests, words."""
    source, found = root / "src" / "slalom", Counter[str]()
    for path in source.rglob("*.py"):
        text, place = path.read_text(), path.relative_to(source)
        room = place.parts[0] if len(place.parts) > 1 else "root"
        found[f"source.{room}"] += text.count("\n")
        found["source.all"] += text.count("\n")
        kind = "behaviour" if BEHAVIOUR.match(place.as_posix()) else "other"
        found[f"constants.{kind}"] += sum(is_tuned(*both) for both in pairwise(ast.parse(text).body))
    names = ast.parse((source / "__init__.pyi").read_text()).body
    found["public.names"] = sum(len(node.names) for node in names if isinstance(node, ast.ImportFrom))
    found["tests.lines"] = sum(path.read_text().count("\n") for path in (root / "tests").rglob("*.py"))
    found["pages.words"] = sum(
        len(path.read_text().split())
        for pattern in PAGES
        for path in root.glob(pattern)
        if "generated" not in path.parts
    )
    return dict(found)


def is_tuned(constant: ast.stmt, text: ast.stmt) -> bool:
    """Whether a statement is a constant of a module, and the next one its text with a direction."""
    if not (
        isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and TUNED.search(str(text.value.value))
    ):
        return False
    targets = [constant.target] if isinstance(constant, ast.AnnAssign) else getattr(constant, "targets", [])
    return any(isinstance(target, ast.Name) and target.id.isupper() for target in targets)


def rows(file: Mapping[str, Any]) -> dict[str, list[int]]:
    """The histories of the limits by section and name."""
    sections = {name: section for name, section in file.items() if isinstance(section, dict)}
    return {f"{name}.{key}": history for name, section in sections.items() for key, history in section.items()}


def breaches(file: Mapping[str, Any], found: Mapping[str, int]) -> Iterator[str]:
    """A sentence for each figure above its limit, limit far above its figure, and rise without a reason."""
    limits, slack = rows(file), float(file["slack"])
    for name in sorted(limits.keys() ^ found.keys()):
        yield f"{name}: expected a figure and a row, found one of them"
    for name in sorted(limits.keys() & found.keys()):
        limit, figure = limits[name][-1], found[name]
        if figure > limit:
            yield f"{name}: expected at most {limit}, found {figure}; remove something, or explain it in [[raised]]"
        if limit > figure + (slack and max(1.0, slack * figure)):
            yield f"{name}: expected a limit near {figure}, found {limit}; write the fall into the file"
    entries = file.get("raised", [])
    explained = Counter((one["what"], one["from"], one["to"]) for one in entries)
    rises = Counter((name, a, b) for name, history in limits.items() for a, b in pairwise(history) if b > a)
    for what, low, high in (rises - explained) + (explained - rises):
        yield f"{what}: expected one entry of [[raised]] for each rise of its row, found {low} to {high} in one of them"
    for one in entries:
        for key in ("bought", "removed"):
            text = one.get(key)
            if not isinstance(text, str) or not text.strip() or "\n" in text:
                yield f"{one['what']}: expected {key} in a line, found {text!r}"


def lowered(history: Iterable[int], figure: int) -> list[int]:
    """The history with a figure below its last number. A fall that follows a fall takes its place."""
    numbers = list(history)
    if figure >= numbers[-1]:
        return numbers
    falls = len(numbers) > 1 and numbers[-1] < numbers[-2]
    return [*(numbers[:-1] if falls else numbers), figure]


def main() -> int:
    """Print every figure with its limit; 1 where a law is broken."""
    found, text = figures(), FILE.read_text()
    if "--lower" in sys.argv[1:]:
        section = ""
        lines = text.splitlines()
        for k, line in enumerate(lines):
            section = line.strip("[]") if line.startswith("[") else section
            key, equals, row = line.partition(" = [")
            if equals and (name := f"{section}.{key}") in found:
                numbers = lowered(map(int, row.rstrip("]").split(",")), found[name])
                lines[k] = f"{key} = [{', '.join(map(str, numbers))}]"
        text = "\n".join(lines) + "\n"
        FILE.write_text(text)
    file = tomllib.loads(text)
    print(f"{'':22}{'start':>8}{'limit':>8}{'today':>8}")
    for name, history in rows(file).items():
        print(f"{name:22}{history[0]:8}{history[-1]:8}{found.get(name, 0):8}")
    mistakes = list(breaches(file, found))
    print(*mistakes, sep="\n")
    return 1 if mistakes else 0


if __name__ == "__main__":
    sys.exit(main())
