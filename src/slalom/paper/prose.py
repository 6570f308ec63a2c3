"""What the texts of all claims share: paragraphs, tables, shares."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any, Final

WIDTH: Final = 128
"""Columns of the text."""

Result = Mapping[str, Any]


def paragraph(text: str) -> str:
    """Text in lines of WIDTH."""
    return fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def of(part: int, whole: int) -> str:
    """A count and its share."""
    return f"{part} of {whole} ({100.0 * part / whole:.1f} %)"
