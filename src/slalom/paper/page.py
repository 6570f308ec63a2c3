"""The page about what was reproduced: every figure with its caption, every claim beside its numbers."""

from collections.abc import Mapping, Sequence
from typing import Final

from slalom.paper.entries import ENTRIES, Entry
from slalom.paper.prose import Result, paragraph
from slalom.paper.told import CLAIMS

_HEAD: Final = (
    "Every figure of the paper and every claim that can be measured, made by one command:",
    "The paper (Stern and Shiller, *From NLVO to NAO*, arXiv:2506.06255v1, 2025) gives no radii, speeds, limits, "
    "intervals, horizons or counts for its examples; all parameters here are ours and stand beside each number. Seeds "
    "are 0, 1, 2 and so on; the same command gives the same numbers and the same figures for any number of processes. "
    "What the symbols mean, and the errata by number, is in the theory page of the documentation (`docs/theory.md`).",
)
_QUICK: Final = "**Made with `--quick`: coarse grids and short runs, not to be quoted.**"


def page(names: Sequence[str], results: Mapping[str, Result], quick: bool, links: str) -> str:
    """The page for the entries of these names, as markdown.

    Args:
        results: the numbers of the claims among them. links: what links to files begin with.
    """
    chosen = [ENTRIES[name] for name in names]
    parts = ["# The paper, reproduced", paragraph(_HEAD[0]), "```\nslalom reproduce --out out/paper\n```"]
    parts += [paragraph(_HEAD[1])] + ([_QUICK] if quick else [])
    parts += ["## Contents", "\n".join(f"- [{entry.title}](#{entry.name}): `{entry.name}`" for entry in chosen)]
    if any(entry.draw for entry in chosen):
        parts.append("## Figures")
        parts += [text for entry in chosen if entry.draw for text in _figure(entry, links)]
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
        paragraph(f"*{'Shown' if entry.draw else 'Asked'}:* {entry.shown}"),
    ]


def _figure(entry: Entry, links: str) -> list[str]:
    heading, *caption = _heading(entry)
    return [heading, _picture(entry, links), *caption]


def _picture(entry: Entry, links: str) -> str:
    return f"![{entry.title}]({links}{entry.name}.svg)"
