"""What a release consists of: versions that agree, the contents of the wheel, and the files that state the policy."""

import re
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import slalom

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import release_check  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
METADATA = "Metadata-Version: 2.4\nName: slalom\nSummary: s\nKeywords: k\nRequires-Python: >=3.11\n" + (
    "License-Expression: MIT\nDescription-Content-Type: text/markdown\nProject-URL: Paper, u\n"
)
SHIPPED = ("README.md", "CHANGELOG.md", "SECURITY.md", "LICENSE", "CITATION.cff", "pyproject.toml", "docs/conf.py")


def test_versions_agree() -> None:
    """In the package, the citation, and the changelog, whose first section is that of the version."""
    version = slalom.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", version)
    assert re.search(rf"^version: {re.escape(version)}$", (ROOT / "CITATION.cff").read_text(), re.M)
    assert re.findall(r"^## (\S+)$", (ROOT / "CHANGELOG.md").read_text(), re.M)[0] == version
    for page in ("README.md", "docs/start.md"):
        assert f"slalom-{version}-cp311-none-manylinux_2_17_x86_64.whl" in (ROOT / page).read_text()


def test_the_authors_of_the_paper_are_cited() -> None:
    """With first names, on every page that names authors of the paper."""
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text())
    paper = citation["preferred-citation"]
    assert [(each["given-names"], each["family-names"]) for each in paper["authors"]] == [
        ("Asher", "Stern"),
        ("Zvi", "Shiller"),
    ]
    assert "Asher Stern and Zvi Shiller" in (ROOT / "README.md").read_text()
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "src").rglob("*.py"), ROOT / "CITATION.cff"]
    assert len(pages) > 200
    assert not [path for path in pages if re.search(r"\bU\. ?Stern", path.read_text())]


def test_policy() -> None:
    """Public interface, deprecation, security and support are stated."""
    interface = (ROOT / "docs" / "interface.md").read_text()
    assert all(word in interface for word in ("DeprecationWarning", "slalom.__all__", "Command line", "HDF5"))
    assert len((ROOT / "SECURITY.md").read_text().splitlines()) <= 20


def test_the_workflow_runs_what_people_run() -> None:
    """Lint, tests, documentation and release on three systems, by the names that the Makefile has."""
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text()
    jobs = YAML(typ="safe").load(text)["jobs"]
    assert set(jobs) == {"lint", "test", "docs", "release", "wheels"}
    assert len(jobs["test"]["strategy"]["matrix"]["os"]) == 3
    targets = re.findall(r"run: make ([\w-]+)", text)
    makefile = (ROOT / "Makefile").read_text()
    assert targets
    assert all(re.search(rf"^{target}:", makefile, re.M) for target in targets)
    assert "untested" in text
    # The tests that `make test` selects.
    (selected,) = re.findall(r'pytest .*-m "([^"]+)"', text)
    assert f'$(PYTEST) -m "{selected}" --draws $(DRAWS)' in makefile


def release(folder: Path, change: dict[str, str | None], shipped: tuple[str, ...] = SHIPPED) -> tuple[Path, Path]:
    """An sdist and a wheel with the files of the package, of which some are changed or left out."""
    package = {
        f"slalom/{p.relative_to(ROOT / 'src/slalom')}": "" for p in (ROOT / "src/slalom").rglob("*") if p.is_file()
    }
    files = {name: text for name, text in package.items() if "__pycache__" not in name}
    files |= {"slalom-1.dist-info/METADATA": METADATA} | change  # type: ignore[dict-item]
    with zipfile.ZipFile(folder / "slalom.whl", "w") as wheel:
        for name, text in files.items():
            if text is not None:
                wheel.writestr(name, text)
    (folder / "a").write_text("")
    with tarfile.open(folder / "slalom.tar.gz", "w:gz") as sdist:
        for name in shipped:
            sdist.add(folder / "a", f"slalom-1/{name}")
    return folder / "slalom.tar.gz", folder / "slalom.whl"


CHANGES = {
    "good": ({}, ""),
    "a test": ({"tests/test_a.py": ""}, "unexpected: tests/test_a.py"),
    "a cache": ({"slalom/__pycache__/a.pyc": ""}, "unexpected: slalom/__pycache__/a.pyc"),
    "no module": ({"slalom/model/goal.py": None}, "missing: slalom/model/goal.py"),
    "no sample": ({"slalom/data/crossing.yaml": None}, "missing: slalom/data/crossing.yaml"),
    "no keywords": ({"slalom-1.dist-info/METADATA": METADATA.replace("Keywords", "Words")}, "expected Keywords"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_contents_are_checked(name: str, tmp_path: Path) -> None:
    """The check fails on a file too many, a file too few, and metadata that is not there."""
    change, message = CHANGES[name]
    sdist, wheel = release(tmp_path, change)
    if not message:
        release_check.check_contents(sdist, wheel)
        return
    with pytest.raises(SystemExit, match=re.escape(message)):
        release_check.check_contents(sdist, wheel)


def test_this_python_is_found() -> None:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    assert version not in release_check.PYTHONS or version in release_check.interpreters()


def test_a_read_only_folder_cannot_be_written(tmp_path: Path) -> None:
    """Not by root either; afterwards it can."""
    (tmp_path / "folder").mkdir()
    with release_check.read_only(tmp_path / "folder") as prefix:
        assert release_check.run([*prefix, "touch", tmp_path / "folder" / "a"]).returncode != 0
    (tmp_path / "folder" / "a").touch()
