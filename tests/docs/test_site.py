"""The documentation site: it builds without a warning, its links lead somewhere, and its reference is complete."""

import inspect
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import slalom
from slalom.cli import app
from slalom.cli.file_keys import FAMILIES, MAPPINGS, MEANINGS
from slalom.sim.files.parts import model_of_part
from slalom.sim.files.schema import ScenarioSpec
from slalom.sim.gallery import GALLERY
from slalom.sim.measure.hdf5 import OWN_UNITS, UNITS, unit_of
from slalom.sim.measure.metrics import METRICS

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import site_blocks  # noqa: E402
import site_gallery  # noqa: E402
import site_reference  # noqa: E402
import site_units  # noqa: E402


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    """With links that lead somewhere, the output of its blocks, and every public name in the reference."""
    pytest.importorskip("sphinx")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-D", "gallery_pictures=head_on"]
    command += ["-b", "html", "docs", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    links_lead_somewhere(tmp_path)
    start = (tmp_path / "start.html").read_text()
    assert "crossing with nao, seed 0: arrived, no collision" in start
    assert "The nearest safe control to the preferred one was chosen." in start
    assert re.search(r'<img [^>]*src="_images/start_0\.svg"', start)
    text = (tmp_path / "generated" / "api.html").read_text()
    names = {name for name in slalom.__all__ if not name.startswith("__")} - site_reference.OWN_PAGES
    assert not {name for name in names if not re.search(rf'id="slalom[\w.]*\.{name}"', text)}


def links_lead_somewhere(site: Path) -> None:
    """To a file, and to a part of it that exists; no page loads anything from a network."""
    texts = {path: path.read_text() for path in site.rglob("*.html")}
    assert len(texts) > 40
    ids = {path: {*re.findall(r'\bid="([^"]+)"', text)} for path, text in texts.items()}
    for path, text in texts.items():
        assert " at 0x" not in text, path
        assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(?:https?:)?//[^"]*"', text), path
        if path.parent.name == "_modules" or "_modules" in path.parts:
            continue
        for link in re.findall(r'<a [^>]*href="([^"]+)"', text):
            parts = urlsplit(link)
            if parts.scheme:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.exists(), f"{path.relative_to(site)}: {link}"
            assert not parts.fragment or target not in ids or unquote(parts.fragment) in ids[target], f"{path}: {link}"


def test_reference_pages_are_complete() -> None:
    """Commands with their options, keys, metrics: from the program, in the pages."""
    assert set(site_reference.FORMULAS) == set(METRICS)
    assert "autoclass:: slalom.decision.navigator.Navigator" in site_reference.api()
    found = site_reference.metrics().replace("\\", "")
    assert set(re.findall(r"[A-Z]{5,}_?[A-Z]*", found)) == {"METRICS"}
    assert "|a_i - a_(i-1)| > 0.05 m/s^2" in found
    commands = site_reference.command_line()
    names = ("run", "list", "explain", "compare", "convert", "show", "export-scenario", "view", "export", "animate")
    for name in (*names, "compile", "ros"):
        assert app[name] is not None
        assert f"\n## slalom {name}\n" in commands
    assert " -m " not in commands
    assert all(option in commands for option in ("--shard", "--merge", "--force", "--figure-at"))
    keys = site_reference.scenario_files()
    assert all(f"| `{key}` |" in keys for key in ScenarioSpec.model_fields)
    models = {mapped.model.__name__: set(mapped.model.model_fields) for mapped in MAPPINGS.values()}
    assert models == {model: set(meanings) for model, meanings in MEANINGS.items()}


PARTS = {
    "get started": ["start"],
    "tutorials": ["tutorials/one_decision", "tutorials/own_simulator", "tutorials/fleets", "tutorials/own_method"],
    "further tutorials": ["robots", "paper", "recordings"],
    "choice and concepts": ["methods", "concepts", "theory"],
    "reference": [f"generated/{page}" for page in site_reference.PAGES],
    "examples": ["generated/gallery", "generated/[0-9]*"],
    "benchmarks": ["measured", "performance", "crossings"],
    "project": ["interface", "generated/changelog", "generated/contributing", "generated/security", "design/index"],
}
"""Pages of the site by the part that they belong to."""


@pytest.mark.parametrize("part", PARTS)
def test_the_site_has_every_part(part: str) -> None:
    """In the navigation; the build refuses names of pages that do not exist."""
    listed = {
        line for line in (ROOT / "docs" / "index.md").read_text().splitlines() if re.fullmatch(r"[\w/\[\]*-]+", line)
    }
    assert PARTS[part]
    assert not set(PARTS[part]) - listed


def test_the_glossary_defines_the_words_of_the_tables() -> None:
    """Terms of methods, results and figures."""
    text = (ROOT / "docs" / "concepts.md").read_text().partition("## Glossary")[2]
    terms = re.findall(r"^([^\n:]+)\n: (.+)$", text, re.M)
    names = [name for name, _ in terms]
    assert names == sorted(names, key=str.lower)
    assert all(meaning.endswith((".", ")")) for _, meaning in terms)
    needed = {
        "adjustment",
        "clearance",
        "efficacy",
        "extra time",
        "foresight",
        "horizon",
        "manoeuvre",
        "margin",
        "outcome",
        "preferred control",
        "response",
    }
    assert needed <= set(names)


def test_every_quantity_of_a_file_has_its_unit() -> None:
    """Keys of all kinds, and parameters of all scenarios; no unit is left over."""
    keys = {
        (kind, key) for _, kinds in FAMILIES.values() for kind, part in kinds.items() for key in keys_of(kind, part)
    }
    assert set(UNITS) == {key for _, key in keys}
    assert set(OWN_UNITS) <= keys
    assert unit_of("least_speed", "least") == "m/s"
    assert unit_of("of another package", "charm") == "-"
    parameters = {(entry.name, name) for entry in GALLERY.values() for name in entry.parameters}
    assert all(site_units.meaning_of(*each) for each in parameters)
    assert set(site_units.PARAMETERS) == {name for _, name in parameters}
    assert set(site_units.OWN_PARAMETERS) <= parameters
    assert "| `speed` | number | required | m/s |" in site_reference.scenario_files()
    assert "| `merging` | `wait` | 3 | [s] from the start until the gap passes the entry |" in site_reference.names()


def keys_of(kind: str, part: type) -> set[str]:
    """The keys of a part in a file."""
    return {*model_of_part(kind, part).model_fields} - {"kind"}


def test_a_missing_name_stops_the_build(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site_reference, "SECTIONS", {"Errors": site_reference.SECTIONS["Errors"]})
    with pytest.raises(ValueError, match=r"SECTIONS: expected every public name of slalom, found none of \['Acceler"):
        site_reference.api()


def test_blocks_that_fail_stop_the_build(tmp_path: Path) -> None:
    """Blocks of a page share one namespace; a failing one is an error; the real output replaces a stated one."""
    page = "```python\nx = 2\n```\n\n```python\nprint(x + 1)\n```\n\n```yaml\nx: 1\n```\n"
    assert site_blocks.executed(page, tmp_path, str).count("```text\n3\n```") == 1
    stated = "```python\nprint(3)\n```\n\n```text\n4\n```\n"
    assert site_blocks.executed(stated, tmp_path, str) == "```python\nprint(3)\n```\n\n```text\n3\n```\n"
    with pytest.raises(ZeroDivisionError):
        site_blocks.executed("```python\n1 / 0\n```\n", tmp_path, str)
    with pytest.raises(RuntimeError, match="slalom run full: expected a command that works, found scenario: expected"):
        site_blocks.executed("```console\n$ slalom run full\n```\n", tmp_path, str)


def test_the_gallery_has_every_scenario(tmp_path: Path) -> None:
    """With its command, which the command line accepts, its picture, and its player."""
    page = site_gallery.page(lambda name: (f"{name}.png", "It arrived."))
    for name in GALLERY:
        assert f"## {name}\n" in page
        assert f"![A run of {name}]({name}.png)" in page
        assert f'<iframe src="{name}.html" loading="lazy"' in page
    for command in site_blocks.commands_of(page):
        assert app.parse_args(command[1:], exit_on_error=False, print_error=False)[0] is not None
    assert "![" not in site_gallery.page(lambda name: ("", "Not drawn."))


def test_signatures_have_plain_types() -> None:
    """Without the checks of fields, whose addresses in memory differ from build to build."""
    for kind in (slalom.Disc, slalom.KalmanError, slalom.Sampled, slalom.Box, slalom.vehicle.Bicycle):
        text = site_reference.plain(str(inspect.signature(kind)))
        assert "Annotated" not in text
        assert "0x" not in text
    inspection = pytest.importorskip("sphinx.util.inspect")
    text = inspection.stringify_signature(inspection.signature(slalom.Friction), unqualified_typehints=True)
    assert site_reference.plain(text).endswith("lateral: float, heading: ArrayLike | None = None) -> None")
    found = site_reference.plain(str(inspect.signature(slalom.Rectangle)))
    assert found == "(length: float, width: float, radius: float = 0.0) -> None"


def test_pictures_of_the_gallery_are_made_once(tmp_path: Path) -> None:
    """They are made again after a change of the code."""
    target, sentence = site_gallery.drawn("empty", tmp_path)
    assert sentence == "The robot arrived after 11.9 s, without a collision."
    picture = tmp_path / target
    first = picture.read_bytes()
    assert 'id="slalom-data"' in picture.with_suffix(".html").read_text()
    picture.write_bytes(b"")
    assert site_gallery.drawn("empty", tmp_path) == (target, sentence)
    assert picture.read_bytes() == b""
    (tmp_path / "gallery_empty.txt").write_text("another digest\n")
    assert site_gallery.drawn("empty", tmp_path) == (target, sentence)
    assert picture.read_bytes() == first
