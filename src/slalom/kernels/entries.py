"""Compiled entries in folders: files named by their keys, with contents that are checked before they are used.

An entry is a kernel that Python calls, compiled for one signature. Its key is the hash of its sources, its signature
and `MADE_FOR`. Neither times of files nor paths are part of it, so that the entries of one machine serve others.
"""

import ast
import hashlib
import os
import pickle
import platform
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import llvmlite
import numba
from numba.core import config, types
from numba.core.caching import FunctionCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from slalom.kernels.numba_extensions import FEATURES, FITS, PROCESSOR, EntryLibrary

ROOT: Final = Path(__file__).parents[__name__.count(".")]
"""The folder of the package `slalom`."""
LABEL: Final = "made_for.txt"
"""The file of a folder of exported entries that holds `MADE_FOR`."""


def digest(text: str, length: int = 16) -> str:
    """The first letters of the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:length]


MADE_FOR: Final = (
    f"{sys.implementation.name} {sys.version_info.major}.{sys.version_info.minor}, numba {numba.__version__}, "
    f"llvmlite {llvmlite.__version__}, {platform.system()} {PROCESSOR}"
    f"{FEATURES and f' with features {digest(FEATURES)}'}{' and SVML' * config.USING_SVML}"  # type: ignore[attr-defined]
)
"""Versions and processor that entries are made for; entries for others have other keys."""
MADE_FOR_DIGEST: Final = digest(MADE_FOR)


@cache
def imported(file: Path, root: Path = ROOT) -> tuple[Path, ...]:
    """Return the files of the package in the folder `root` that a file imports at its head, above its first function.

    The head ends at two blank lines. To parse the whole files of all kernels would take a tenth of a second.
    """
    content = file.read_bytes()
    try:
        tree = ast.parse(content.partition(b"\n\n\n")[0])
    except SyntaxError:
        tree = ast.parse(content)
    lines = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    names = {name for line in lines for name in (line.module, *(f"{line.module}.{one.name}" for one in line.names))}
    paths = (
        root.joinpath(*name.split(".")).with_suffix(".py") for name in names if name and name.startswith("slalom.")
    )
    return tuple(path for path in paths if path.is_file())


@cache
def made_from(file: Path, root: Path = ROOT) -> tuple[Path, ...]:
    """Return a file and all files of the package that it imports, directly or not, in the order of their names.

    For a function that no file holds, as in a notebook: all files of kernels, and what they import.
    """
    found: set[Path] = set()
    todo = [file] if file.is_file() else list((root / "slalom" / "kernels").rglob("*.py"))
    while todo:
        path = todo.pop()
        if path not in found:
            found.add(path)
            todo += imported(path, root)
    return tuple(sorted(found))


@cache
def sources_digest(file: Path, root: Path = ROOT) -> str:
    """Return the SHA-256 of the files that kernels of a file are made from."""
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in made_from(file, root))).hexdigest()


def _own_folder() -> Path | None:
    """The folder for entries compiled here, by numba's rules: in NUMBA_CACHE_DIR, beside this file, or of the user."""
    try:
        return Path(FunctionCache(_own_folder).cache_path)  # type: ignore[no-untyped-call]
    except RuntimeError:
        return None


OWN: Final = _own_folder()
"""The folder that is written to; None where none can be: kernels then compile in every process."""
GIVEN: Final = (
    Path(__file__).with_name("compiled"),
    *(Path(name) for name in os.environ.get("SLALOM_ENTRIES", "").split(os.pathsep) if name),
)
"""Folders that are only read: that of a wheel with entries, and exported ones that SLALOM_ENTRIES names."""
refused: list[str] = []
"""Why files of entries were not used."""


def content(name: str, payload: bytes) -> bytes:
    """The content of the file of an entry: the SHA-256 of its name and its payload, then the payload."""
    return hashlib.sha256(name.encode() + payload).digest() + payload


def read(path: Path) -> bytes | None:
    """The payload of the file of an entry; None if there is no file, or if its hash is not that of name and payload."""
    try:
        found = path.read_bytes()
    except OSError:
        return None
    payload = found[hashlib.sha256().digest_size :]
    if found == content(path.name, payload):
        return payload
    refused.append(f"{path} is damaged")
    return None


def write(path: Path, data: bytes) -> None:
    """Write a file; a process that reads it meanwhile finds the old file or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f"{uuid4().hex}.tmp")
    try:
        draft.write_bytes(data)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def fitting(folder: Path) -> list[Path]:
    """The files of entries of slalom in a folder that are made for its sources, these versions and this processor."""
    return [path for path in sorted(folder.glob(f"slalom.*-{MADE_FOR_DIGEST}-*.entry")) if _is_current(path.name)]


def _is_current(name: str) -> bool:
    """Whether the hash of the sources in the name of a file is that of the module in its name."""
    function, sources = name.split("-")[:2]
    parts = function.split(".")
    files = (ROOT.joinpath(*parts[:k]).with_suffix(".py") for k in range(len(parts), 1, -1))
    return any(sources_digest(file)[:16] == sources for file in files if file.is_file())


def why_none_fits() -> str:
    """Why an entry is compiled although there are some, "" if there are none."""
    if refused:
        return refused[-1]
    labels = [(folder / LABEL).read_text().strip() for folder in GIVEN if (folder / LABEL).is_file()]
    if MADE_FOR in labels:
        return "no shipped kernel is of these sources and for these arguments"
    if labels:
        return f"expected kernels for {MADE_FOR}, found those for {'; '.join(labels)}"
    return "SLALOM_ENTRIES: expected folders of exported kernels, found none" if GIVEN[1:] else ""


def tables(ty: Any) -> list[str]:
    """The tables in a type, with their modules and fields, which its text does not hold."""
    if not isinstance(ty, tuple | types.BaseTuple):
        return []
    own = getattr(ty, "instance_class", None)
    named = [f"{own.__module__}.{own.__qualname__}{own._fields}"] if own else []
    return named + [table for one in ty for table in tables(one)]  # type: ignore[union-attr]


class Entries:
    """The compiled entries of one function: what numba calls its cache."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        self.cache_path = str(OWN)

    def _name(self, arguments: Any) -> tuple[str, str]:
        """The name of the file for types of arguments, and how names with these sources begin.

        For a function that no file holds, its code and what it closes over is all that tells it from others.
        """
        code, cells = self._function.__code__, self._function.__closure__ or ()
        closed = dumps(tuple(cell.cell_contents for cell in cells)) if cells else b""  # type: ignore[no-untyped-call]
        function = f"{self._function.__module__}.{self._function.__qualname__}".replace("<", "").replace(">", "")
        sources = sources_digest(Path(code.co_filename))
        key = repr((function, sources, code.co_code, closed, str(arguments), tables(arguments), MADE_FOR))
        beginning = f"{function}-{sources[:16]}-"
        return f"{beginning}{MADE_FOR_DIGEST}-{digest(key, 32)}.entry", beginning

    def load_overload(self, arguments: Any, context: Any) -> Any:
        """The compiled entry for types of arguments, from the first folder that has it, or None."""
        context.refresh()
        name, _ = self._name(arguments)
        for folder in (OWN, *GIVEN):
            if folder and (payload := read(folder / name)) is not None:
                codegen = context.codegen()
                usual, codegen._library_class = codegen._library_class, EntryLibrary if FITS else codegen._library_class
                try:
                    return CompileResult._rebuild(context, *pickle.loads(payload))  # type: ignore[no-untyped-call]
                except (AttributeError, ImportError) as error:
                    refused.append(f"{folder / name} needs what is not there: {error}")
                finally:
                    codegen._library_class = usual
        return None

    def save_overload(self, arguments: Any, result: Any) -> None:
        """Write a compiled entry where there is a folder, and remove those of other sources of this function."""
        if OWN is None or result.lifted or result.library.has_dynamic_globals:
            return
        name, beginning = self._name(arguments)
        # The annotated source, of use for messages of numba alone, is as long as the code.
        parts = [*result._reduce()]
        parts[6] = ""
        # On Windows a file that another process reads cannot be replaced: then it is there.
        with suppress(PermissionError):
            write(OWN / name, content(name, dumps(tuple(parts))))  # type: ignore[no-untyped-call]
            for other in OWN.glob(f"{beginning[:-17]}*.entry"):
                if not other.name.startswith(beginning):
                    other.unlink(missing_ok=True)
