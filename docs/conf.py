"""Configuration of the documentation site: `make docs` builds it, without a network."""

import logging
import re
import sys
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path.insert(0, str(ROOT / "tools"))

import site_gallery  # noqa: E402
from site_blocks import executed  # noqa: E402
from site_reference import PAGES, plain  # noqa: E402

import slalom  # noqa: E402
from slalom.sim.gallery import GALLERY  # noqa: E402

# Fonts that a machine lacks are no warning of the documentation: the style names DejaVu Sans, which matplotlib brings.
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)

project = "slalom"
author = "The slalom developers"
copyright = author
version = release = slalom.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["site"]
html_theme = "furo"
html_title = f"slalom {version}"
html_static_path = ["_static"]
html_css_files = ["wide_tables.css"]
html_show_sourcelink = False
html_copy_source = False
myst_heading_anchors = 4
myst_enable_extensions = ["deflist", "colon_fence"]
default_role = "code"
# Dashes stay: `--option` in the words of a page is no dash.
smartquotes_action = "qe"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"exclude-members": "__init__, __new__"}
napoleon_use_ivar = True
napoleon_use_rtype = False
python_use_unqualified_type_names = True
add_module_names = False
nitpicky = False
highlight_language = "none"
pygments_style = "tango"
pygments_dark_style = "monokai"

EXECUTED = ("start", "tutorials/")
"""Beginnings of the names of pages whose blocks run while the site is built."""
GENERATED = DOCS / "generated"
OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+(tests|tools|benchmarks|src)/[^)]*\)")
"""Links to files of the repository that are not part of the site: their text remains."""
ANCHORS = re.compile(r"^(#+ )<a id=\"(\w+)\"></a>(.*)$", re.MULTILINE)
"""Headings with an anchor in HTML, which becomes a target of the site."""
PROJECTS = {"ros": "ROS 2", "irsim": "ir-sim", "commonroad": "CommonRoad", "sumo": "SUMO"}
"""Titles of examples with programs of other projects."""
AT_ROOT = re.compile(r"\]\((?:\.\./)+(CHANGELOG|CONTRIBUTING|SECURITY)\.md\)")
"""Links to pages at the root of the repository, which are generated pages of the site."""
EXAMPLES = re.compile(r"\]\((?:\.\./)*examples/(\w+)\.py\)")


def write(path: Path, text: str) -> None:
    """Write a generated file if it has changed, so that only changed pages are read again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def generate(app: Any) -> None:
    """Write the reference pages, the gallery, and the pages of the examples and of files at the root."""
    pages = {name: page() for name, page in PAGES.items()}
    shown = app.config.gallery_pictures
    pages["gallery"] = site_gallery.page(lambda name: picture(name) if name in shown else ("", ""))
    for path in sorted((ROOT / "examples").glob("*.py")):
        name = path.stem[3:]
        title = PROJECTS.get(name, name.replace("_", " ").capitalize())
        pages[path.stem] = f"# {title}\n\n```python\n{path.read_text()}```\n"
    for name in ("CHANGELOG", "CONTRIBUTING", "SECURITY"):
        pages[name.lower()] = (ROOT / f"{name}.md").read_text()
    for name, text in pages.items():
        write(GENERATED / f"{name}.md", text)
    for path in GENERATED.glob("*.md"):
        # Pages of examples that were renamed.
        if path.stem not in pages:
            path.unlink()


def picture(name: str) -> tuple[str, str]:
    """Draw a scenario of the gallery; return the address of the picture and a sentence on the run."""
    target, sentence = site_gallery.drawn(name, GENERATED / "figures")
    return f"figures/{target}" if target else "", sentence


def copy_players(app: Any, error: Exception | None) -> None:
    """Copy the players of the gallery into the site, which has other pictures only."""
    if error is None and app.builder.format == "html":
        folder = Path(app.outdir) / "generated/figures"
        folder.mkdir(exist_ok=True)
        for path in GENERATED.glob("figures/gallery_*.html"):
            copyfile(path, folder / path.name)


def prepare(app: Any, docname: str, source: list[str]) -> None:
    """Run the blocks of tutorials, and lead links to where the site has their targets."""
    up = "../" * docname.count("/")
    text = EXAMPLES.sub(rf"]({up}generated/\1.md)", OUTSIDE.sub(r"\1", source[0]))
    text = AT_ROOT.sub(lambda found: f"]({up}generated/{found[1].lower()}.md)", text)
    if docname.startswith("generated/"):
        text = (
            text.replace("](docs/", "](../")
            .replace("](CHANGELOG.md)", "](changelog.md)")
            .replace("](CONTRIBUTING.md)", "](contributing.md)")
        )
    if docname.startswith(EXECUTED):
        drawn: list[Path] = []

        def save(figure: Any) -> str:
            target = GENERATED / "figures" / f"{docname.replace('/', '_')}_{len(drawn)}.svg"
            target.parent.mkdir(parents=True, exist_ok=True)
            slalom.view.save(figure, target)
            drawn.append(target)
            return f"{up}generated/figures/{target.name}"

        with TemporaryDirectory() as folder:
            text = executed(text, Path(folder), save)
    source[0] = ANCHORS.sub(r"(\2)=\n\1\3", text)


def escape(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Escape the norm |x| in docstrings, which reStructuredText takes for a substitution; not within backticks."""
    if what in ("attribute", "data", "property"):
        # napoleon takes the words before a colon in the first line for a type.
        lines.insert(0, "\\")
    for k, line in enumerate(lines):
        parts = line.split("`")
        parts[::2] = [part.replace("|", "\\|") for part in parts[::2]]
        lines[k] = "`".join(parts)


def shorten(
    app: Any, what: str, name: str, thing: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Leave the checks of fields and the members of unions out of a signature."""
    return None if signature is None else plain(signature), returned


def setup(app: Any) -> None:
    """Connect the steps above to the build."""
    # All of them take more than a minute: the test of the site draws one.
    app.add_config_value("gallery_pictures", list(GALLERY), "env")
    app.connect("builder-inited", generate)
    app.connect("source-read", prepare)
    app.connect("build-finished", copy_players)
    app.connect("autodoc-process-signature", shorten)
    app.connect("autodoc-process-docstring", escape, priority=400)
