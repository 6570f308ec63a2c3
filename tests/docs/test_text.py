"""The sources as text: names, docstrings, lengths."""

import ast
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
import typing
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from galleries import NAMES

import slalom
import slalom.sim
from slalom.base import tolerances
from slalom.sim import gallery
from slalom.sim.shape_distance import clearances

SOURCES = Path(slalom.__file__).parent
FILES = sorted(SOURCES.rglob("*.py"))
LONGEST_MODULE, LONGEST_FUNCTION, SCREEN = 700, 70, 40
VAGUE = {"utils", "util", "helpers", "helper", "common", "core", "misc", "info", "data", "manager", "handler"}


def name_of(path: Path) -> str:
    """How a test shows a file."""
    return str(path.relative_to(SOURCES))


@cache
def modules() -> tuple[ModuleType, ...]:
    """Every module of the library."""
    names = [module.name for module in pkgutil.walk_packages([str(SOURCES)], "slalom.")]
    return (slalom, *(importlib.import_module(name) for name in names if not name.endswith("__main__")))


@cache
def text_of(path: Path) -> str:
    """The text of a module."""
    return path.read_text()


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Every node of a module, the module first."""
    return tuple(ast.walk(ast.parse(text_of(path))))


def functions(path: Path) -> Iterator[ast.FunctionDef]:
    """Every function and method of a module."""
    return (node for node in nodes(path) if isinstance(node, ast.FunctionDef))


def dotted(node: ast.AST) -> str:
    """The name of a function that is called, such as time.sleep; of other expressions only what follows a name."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def length(node: ast.stmt) -> int:
    """Lines, docstring and all."""
    return (node.end_lineno or node.lineno) - node.lineno + 1


def order(name: str) -> tuple[int, str]:
    """Constants, then classes, then functions, each by the alphabet: as the formatter sorts them."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2), name


def with_all() -> list[ModuleType]:
    """The modules that list their public names."""
    return [module for module in modules() if hasattr(module, "__all__")]


@pytest.mark.parametrize("module", with_all(), ids=lambda module: module.__name__)
def test_public_names_resolve_and_are_sorted(module: ModuleType) -> None:
    names = list(module.__all__)
    assert names in (sorted(names, key=order), sorted(names))
    assert len(set(names)) == len(names)
    assert all(getattr(module, name) is not None for name in names)


def in_stub(package: ModuleType) -> dict[str, str]:
    """The names that the stub of a package offers, and from which modules."""
    assert package.__file__
    tree = ast.parse(Path(package.__file__).with_suffix(".pyi").read_text())
    lines = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    home = package.__name__
    return {alias.name: f"{home}.{line.module}" if line.module else home for line in lines for alias in line.names}


@pytest.mark.parametrize("package", [slalom, slalom.sim], ids=lambda package: package.__name__)
def test_public_names_are_those_of_the_stub(package: ModuleType) -> None:
    """From the modules that it says, whatever was imported before."""
    told = in_stub(package)
    assert set(told) == set(package.__all__)
    modules()
    for name, home in told.items():
        module = importlib.import_module(home)
        expected = importlib.import_module(f"{home}.{name}") if module is package else getattr(module, name)
        assert getattr(package, name) is expected
        assert name in dir(package)


def test_what_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="slalom attribute Nothing"):
        slalom.Nothing  # noqa: B018
    with pytest.raises(ImportError, match="cannot import name 'Nothing'"):
        from slalom import Nothing  # noqa: F401


def test_names_are_imported_when_they_are_asked_for() -> None:
    """In a new process. The function, not its module, which Python binds to the package; a module by its name."""
    code = (
        "import slalom, slalom.sim, sys\n"
        "assert not {'numpy', 'slalom.model.shape', 'slalom.sim.measure.recording'} & set(sys.modules)\n"
        "from slalom import Disc\n"
        "assert Disc.__module__ == 'slalom.model.shape' and 'slalom.choice.control_obstacle' not in sys.modules\n"
        "slalom.Navigator(slalom.method('nao'), Disc(0.3), slalom.Limits(1.0, 1.0))\n"
        "assert not {'shapely', 'numba'} & set(sys.modules)\n"
        "import slalom.choice.control_obstacle, slalom.sim.run.simulate\n"
        "assert all(type(f).__name__ == 'function' for f in (slalom.control_obstacle, slalom.sim.simulate))\n"
        "from slalom.choice.control_obstacle import ControlObstacle\n"
        "assert slalom.ControlObstacle is ControlObstacle\n"
        "from slalom import *\n"
        "assert set(slalom.__all__) <= set(globals())\n"
        "assert 'numba' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_version_is_that_of_the_package() -> None:
    from importlib.metadata import version

    assert slalom.__version__ == version("slalom")
    assert re.fullmatch(r"\d+\.\d+\.\d+", slalom.__version__)


def test_the_package_is_typed() -> None:
    assert (SOURCES / "py.typed").is_file()


def test_modules_classes_and_functions_have_docstrings() -> None:
    """Whatever has a public name at the top of a module, and the module itself: a sentence."""
    for path in FILES:
        tree = nodes(path)[0]
        public = [
            node
            for node in tree.body
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
        ]
        public = [node for node in public if "overload" not in map(ast.unparse, node.decorator_list)]
        without = [node.name for node in public if not ast.get_docstring(node)]
        assert not without, name_of(path)
        doc = ast.get_docstring(tree)
        assert doc, name_of(path)
        assert doc[0].isupper() or doc[0] in "`_" or doc.startswith("slalom"), name_of(path)
        firsts = [(ast.get_docstring(node) or "").split("\n\n")[0] for node in public]
        assert all(first.rstrip().endswith((".", ":", "?")) for first in firsts), (name_of(path), firsts)


def protocols() -> list[type]:
    """The protocols of the library."""
    found = {value for module in modules() for value in vars(module).values() if getattr(value, "_is_protocol", False)}
    return [cls for cls in found if cls is not typing.Protocol]


def test_public_methods_have_docstrings() -> None:
    """Of the classes that are offered: their own, or those of the protocol that names them."""
    explained = {name for cls in protocols() for name, value in vars(cls).items() if inspect.getdoc(value)}
    without = []
    for name in slalom.__all__:
        cls = getattr(slalom, name)
        if inspect.isclass(cls) and cls.__module__.startswith("slalom"):
            for what, value in vars(cls).items():
                made_here = inspect.isfunction(value) or isinstance(value, property | classmethod | staticmethod)
                if made_here and not what.startswith("_") and what not in explained and not inspect.getdoc(value):
                    without.append(f"{name}.{what}")
    assert len(protocols()) >= 5
    assert not without


def test_protocols_explain_every_method() -> None:
    without = [
        f"{cls.__name__}.{name}"
        for cls in protocols()
        for name, value in vars(cls).items()
        if not name.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)) and not value.__doc__
    ]
    assert not without


OF_ROBOTS = (
    "base",
    "model",
    "forecast",
    "obstacle",
    "perception",
    "choice",
    "decision",
    "fleet",
    "lookahead",
    "vehicle",
)
"""Packages that a robot needs, besides `kernels`: a number in them decides what it does."""


def constants(path: Path) -> Iterator[tuple[str, ast.expr, str]]:
    """Name, value and text of the public numbers of a file; the text is a string under each."""
    body = nodes(path)[0].body
    for node, after in zip(body, [*body[1:], None]):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value:
            leaves = [leaf for leaf in ast.walk(node.value) if isinstance(leaf, ast.Constant)]
            numbers = all(type(leaf.value) in (int, float) for leaf in leaves)
            plain = not any(isinstance(leaf, ast.Call | ast.Dict) for leaf in ast.walk(node.value))
            if re.fullmatch(r"[A-Z][A-Z0-9_]*", node.target.id) and leaves and numbers and plain:
                under = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
                yield node.target.id, node.value, str(after.value.value) if under else ""


def test_every_tolerance_is_explained() -> None:
    """A constant, its unit in brackets, and why: a string under each."""
    of_robots = [path for path in FILES if name_of(path).split("/")[0] in (*OF_ROBOTS, "kernels")]
    found = [constant for path in of_robots for constant in constants(path)]
    assert len(found) > 50
    for name, value, text in found:
        assert re.match(r"\[[^\]]+\] |.*\(unit", text, re.S), f"{name}: no unit"
        assert len(text) > 60, name
        if isinstance(value, ast.Tuple) and all(isinstance(one, ast.Constant) for one in value.elts):
            # Alternatives in their order, such as directions to both sides.
            numbers = ast.literal_eval(value)
            assert len(set(numbers)) == len(numbers) > 1
            assert np.isfinite(numbers).all()
        elif isinstance(value, ast.Constant):
            assert value.value > 0


def test_constants_stand_where_they_are_used() -> None:
    """Those of `tolerances` are used by several files, and are few."""
    names = [name for name in vars(tolerances) if name.isupper()]
    words = [set(re.findall(r"\w+", text_of(path))) for path in FILES]
    assert 10 < len(names) <= 45
    assert not [name for name in names if sum(name in those for those in words) < 3]


def test_registries_have_sentences() -> None:
    for method in slalom.METHODS.values():
        assert method.sentence.endswith(".")
        assert re.search(r"\b(19|20)\d\d$", method.source)


ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *(page for page in (ROOT / "docs").rglob("*.md") if "generated" not in page.parts)]
PERSONS = re.compile(r"\b(who|whom|nobody|somebody|everybody|for ever|in vain|wish(?:es|ed)?|wants?|sieved?)\b", re.I)
"""Words of the column "instead of" of the style in CONTRIBUTING.md: robots and obstacles are no persons."""


def test_robots_and_obstacles_are_no_persons() -> None:
    """In sources and pages, without quoted names. The page with the rules names these words itself."""
    found = {
        path: sorted({word.lower() for word in PERSONS.findall(re.sub(r"`[^`\n]*`", "", path.read_text()))})
        for path in [*FILES, *PAGES]
    }
    assert found.pop(ROOT / "CONTRIBUTING.md")
    assert not {name_of(path) if path in FILES else path.name: words for path, words in found.items() if words}


def test_modules_and_functions_are_short() -> None:
    assert not [name_of(path) for path in FILES if len(text_of(path).splitlines()) > LONGEST_MODULE]
    long = [
        f"{name_of(path)} {f.name}: {length(f)} lines"
        for path in FILES
        for f in functions(path)
        if length(f) > LONGEST_FUNCTION
    ]
    assert not long


STILL_PACKED: set[tuple[str, str]] = {
    ("kernels/decision/policy.py", "best_response"),
    ("kernels/selection/exchange.py", "exchanged"),
}
"""Functions that would have more than LONGEST_FUNCTION lines with one value to a statement."""


def is_packed(node: ast.AST) -> bool:
    """Whether a node assigns three or more values to as many targets, and could be one statement a line.

    It could not where a later value uses a name of an earlier target.
    """
    if not (
        isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple)
    ):
        return False
    targets, values = node.targets[0].elts, node.value.elts
    names = [{leaf.id for leaf in ast.walk(one) if isinstance(leaf, ast.Name)} for one in (*targets, *values)]
    n = len(targets)
    starred = any(isinstance(one, ast.Starred) for one in (*targets, *values))
    used_later = any(names[k] & names[n + j] for k in range(n) for j in range(k + 1, len(values)))
    return n > 2 and not starred and not used_later


def test_at_most_two_values_are_packed_into_one_assignment() -> None:
    """More only in a swap, from a call, and in functions that have no lines left."""
    found = {(name_of(path), f"line {node.lineno}") for path in FILES for node in nodes(path) if is_packed(node)}
    for path in FILES:
        name = name_of(path)
        for function in functions(path):
            if (name, function.name) in STILL_PACKED:
                inside = {(name, f"line {node.lineno}") for node in ast.walk(function) if is_packed(node)}
                assert inside, f"{name} {function.name}: remove it from STILL_PACKED"
                found -= inside
    assert not found


def test_modules_have_telling_names() -> None:
    assert not [path for path in FILES if {*path.relative_to(SOURCES).with_suffix("").parts} & VAGUE]


def test_nothing_prints_sleeps_or_draws_lots_in_secret() -> None:
    """Only the command line prints; randomness comes from a generator that is passed in; no path of a machine."""
    for path in FILES:
        text, name = text_of(path), name_of(path)
        calls = {dotted(node.func) for node in nodes(path) if isinstance(node, ast.Call)}
        assert "print" not in calls or path == SOURCES / "cli" / "console.py", name
        assert not calls & {"time.sleep", "sleep", "breakpoint", "eval", "exec", "input"}, name
        drawn = {c for c in calls if c.startswith(("np.random.", "random.", "numpy.random."))}
        assert drawn <= {"np.random.default_rng", "np.random.RandomState"}, name
        assert not re.search(r"[\"'](/home|/work|/tmp|/root|/Users|C:\\)", text), name
        assert not re.search(r"\b(TODO|FIXME|XXX|HACK)\b", text), name


@pytest.mark.parametrize("name", NAMES)
def test_gallery_entries_build_and_fit_one_screen(name: str) -> None:
    """A scenario is read at a glance, and is the same for the same seed."""
    entry = gallery.GALLERY[name]
    source = inspect.getsource(entry.build)
    assert len(source.splitlines()) <= SCREEN
    assert entry.sentence.endswith(".")
    assert entry.name == name
    one, two = (gallery.build(name, seed=5) for _ in range(2))
    assert one.name == name
    assert dict(one.parameters) == dict(entry.parameters)
    assert all(
        f'p["{parameter}"]' in inspect.getsource(inspect.getmodule(entry.build)) for parameter in entry.parameters
    )
    for a, b in zip(one.obstacles, two.obstacles, strict=True):
        first = max(one.start, a.trajectory.span[0])
        assert a.trajectory.position(first).tobytes() == b.trajectory.position(first).tobytes()
    now, position = np.array([one.start]), one.robot.state.position[None]
    free = [float(clearances(o, one.robot.shape, now, position)[0]) for o in one.obstacles if o.exists(one.start)]
    assert min(free, default=1.0) > 0.0
