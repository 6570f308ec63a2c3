"""Markdown helpers of the claims: paragraphs, tables, counts with shares."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any, Final

WIDTH: Final = 128
"""[characters] Largest length of a line of text."""

Result = Mapping[str, Any]


def paragraph(text: str) -> str:
    """Wrap text to lines of WIDTH."""
    return fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def count_and_share(part: int, whole: int) -> str:
    """Format a count with its share."""
    return f"{part} of {whole} ({100.0 * part / whole:.1f} %)"
