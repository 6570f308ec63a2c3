"""Markdown page of the reproduction: every figure with its caption, every claim with its numbers."""

from collections.abc import Mapping, Sequence
from typing import Final

from slalom.paper.entries import ENTRIES, Entry
from slalom.paper.findings import CLAIMS
from slalom.paper.prose import Result, paragraph

_HEAD: Final = (
    "This page is for readers of the paper. It has all figures of the paper and all claims that can be measured, "
    "produced by one command:",
    "The paper (Stern and Shiller, *From NLVO to NAO*, arXiv:2506.06255v1, 2025) gives no radii, speeds, limits, "
    "intervals, horizons or counts for its examples. All parameters are choices of this project and are stated with "
    "each result. Seeds are 0, 1, 2 and so on. The same command gives the same numbers and figures for any number of "
    "processes. Symbols, and the errata by number, are defined on the theory page of the documentation "
    "(`docs/theory.md`).",
)
_QUICK: Final = "**Made with `--quick`: coarse grids and short runs, for tests only.**"


def page(names: Sequence[str], results: Mapping[str, Result], quick: bool, links: str) -> str:
    """Render the page for the entries of these names as Markdown.

    Args:
        results: results of the claims by name. quick: whether they are of a quick run.
        links: prefix of links to files.
    """
    chosen = [ENTRIES[name] for name in names]
    parts = ["# The paper, reproduced", paragraph(_HEAD[0]), "```\nslalom reproduce --out out/paper\n```"]
    parts += [paragraph(_HEAD[1])] + ([_QUICK] if quick else [])
    parts += ["## Contents", "\n".join(f"- [{entry.title}](#{entry.name}): `{entry.name}`" for entry in chosen)]
    if any(entry.draw for entry in chosen):
        parts.append("## Figures")
        parts += [text for entry in chosen if entry.draw for text in _drawn(entry, links)]
    if results:
        parts.append("## Claims")
        for entry in chosen:
            if entry.name in results:
                parts += [*_heading(entry), *([_picture(entry, links)] if entry.plot else [])]
                parts += CLAIMS[entry.name](results[entry.name])
                parts.append(f"All numbers: [{entry.name}.json]({links}{entry.name}.json).")
    return "\n\n".join(parts) + "\n"


def _heading(entry: Entry) -> list[str]:
    return [
        f'### <a id="{entry.name}"></a>{entry.title}',
        paragraph(f"*Paper:* {entry.paper}"),
        paragraph(f"*{'Shown' if entry.draw else 'Measured'}:* {entry.shown}"),
    ]


def _drawn(entry: Entry, links: str) -> list[str]:
    heading, *caption = _heading(entry)
    return [heading, _picture(entry, links), *caption]


def _picture(entry: Entry, links: str) -> str:
    return f"![{entry.title}]({links}{entry.name}.svg)"
