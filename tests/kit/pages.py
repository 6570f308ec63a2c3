"""Pages of the documentation and the blocks of code in them."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
WRITTEN = [page for page in sorted(DOCS.rglob("*.md")) if DOCS / "generated" not in page.parents]
PAGES = [*(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CHANGELOG", "SECURITY")), *WRITTEN]
TUTORIALS = [DOCS / "start.md", *sorted((DOCS / "tutorials").glob("*.md"))]
"""Pages whose blocks follow each other; everywhere else each block runs alone."""
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(language: str) -> list[tuple[str, str]]:
    """Page name and text of every fenced block of a language."""
    found = []
    for page in PAGES:
        if page in TUTORIALS and language == "python":
            found.append(
                (page.name, "\n".join(text for name, text in BLOCK.findall(page.read_text()) if name == language))
            )
            continue
        found += [(page.name, text) for name, text in BLOCK.findall(page.read_text()) if name == language]
    return found
