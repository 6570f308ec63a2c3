"""What works without the packages of extras, and what is said where one is missing."""

import importlib
import pickle
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import slalom
from slalom.base.errors import MODULES, Extra, first_missing, require

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import release_check  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
CORE = ("lazy_loader", "numpy", "numba", "shapely")
HIDE = """
import sys


class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)


sys.meta_path.insert(0, Hidden())
"""
"""A program whose later imports do not find some packages."""
CALLS = """
import contextlib, io
from slalom.cli import call

for words in {calls}:
    with contextlib.redirect_stderr(io.StringIO()) as said:
        code = call(words)
    print(code, said.getvalue().removesuffix("\\n").replace("\\n", "; "), file=sys.stderr)
"""
"""A program that makes several calls of the command line, and writes the code and the errors of each in a line."""


def package_of(requirement: str) -> str:
    """The name of the package that a requirement asks for."""
    return re.split(r"[\[<>=;]", requirement)[0]


def packages(extra: str) -> set[str]:
    """Packages of an extra, and of the extras that it names."""
    found = set()
    for each in EXTRAS[extra]:
        more = re.fullmatch(r"slalom\[([\w,]+)\]", each)
        found |= set().union(*map(packages, more[1].split(","))) if more else {package_of(each)}
    return found


def without(extra: str, program: str) -> subprocess.CompletedProcess[str]:
    """Run a program that finds no package of an extra."""
    names = {name.partition(".")[0] for name in packages(extra)}
    hidden = HIDE.format(names=names) + program
    return subprocess.run([sys.executable, "-c", hidden], capture_output=True, text=True, check=False)


def test_the_core_depends_on_four_packages() -> None:
    assert {package_of(each) for each in PROJECT["dependencies"]} == set(CORE)
    for extra, modules in MODULES.items():
        assert set(modules) <= packages(extra)
    assert packages("all") == set().union(*map(packages, ("view", "video", "data", "tracks", "walls")))
    assert packages("all") < packages("dev")


def test_a_robot_needs_no_extra() -> None:
    """It decides, a fleet moves, all public names are there; simulator and figures name their extras."""
    done = without("all", release_check.CORE)
    assert done.returncode == 0, done.stderr


def test_the_command_without_its_packages_names_the_extra() -> None:
    """In one sentence, without a traceback."""
    assert PROJECT["scripts"] == {"slalom": "slalom.__main__:main"}
    done = without("all", "from slalom.__main__ import main\nmain()")
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(re.escape(release_check.NO_COMMAND) + r"\w+\n", done.stderr)


def test_the_command_works_without_figures() -> None:
    """What needs them says so before it begins."""
    calls = {
        "list": "0 ",
        "run empty --set duration=0.2": "1 .*",
        "run empty --figure a.svg": "2 slalom.view: expected .*slalom\\[view\\]'`, found no contourpy",
        "view empty": "2 view: expected .*slalom\\[view\\]'`, found no starlette",
        "reproduce": "2 reproduce: expected .*slalom\\[view\\]'`, found no (matplotlib|contourpy)",
    }
    names = {name.partition(".")[0] for name in packages("view") - packages("sim")}
    program = HIDE.format(names=names) + CALLS.format(calls=[words.split() for words in calls])
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    for line, expected in zip(done.stderr.splitlines(), calls.values(), strict=True):
        assert re.fullmatch(expected, line)


def test_a_missing_module_is_found_without_an_import(monkeypatch: pytest.MonkeyPatch) -> None:
    assert first_missing("view") is None
    monkeypatch.setitem(sys.modules, "h5py", None)
    assert first_missing("sim") == "h5py"
    with pytest.raises(slalom.MissingExtra, match=r"^here: .*slalom\[view\]'`, found no h5py$") as caught:
        require("view", "here")
    assert caught.value.name == "h5py"
    sent = pickle.loads(pickle.dumps(caught.value))
    assert (type(sent), str(sent), sent.name) == (slalom.MissingExtra, str(caught.value), "h5py")


def test_errors_of_imports_are_those_of_an_extra() -> None:
    """As an InvalidInput that is an ImportError; other errors, and those of slalom itself, pass."""
    with pytest.raises(ImportError, match=r"found a broken library$") as caught, Extra("data", "here"):
        raise ImportError("a broken\nlibrary")
    assert isinstance(caught.value, slalom.InvalidInput)
    with pytest.raises(ModuleNotFoundError, match=r"^No module named 'slalom\.none'$"), Extra("data", "here"):
        importlib.import_module("slalom.none")
    with pytest.raises(KeyError), Extra("data", "here"):
        raise KeyError
    with pytest.raises(slalom.MissingExtra, match=r"^inner:"), Extra("sim", "outer"), Extra("data", "inner"):
        import no_such_module  # noqa: F401
