"""Scenarios that functions in Python files build, by the names FILE.py:FUNCTION."""

import re
import sys
from functools import cache
from hashlib import sha256
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, Final

from slalom.base.checks import shown
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.sim.gallery import Entry

NAME: Final = re.compile(r"(.+\.py):(\w+)")


def is_script(name: str) -> bool:
    """Return whether a scenario is named by a function in a Python file."""
    return NAME.fullmatch(name) is not None


def file_of(name: str) -> Path:
    """Return the file of a name for which `is_script` holds."""
    return Path(name.rpartition(":")[0])


def entry_of(name: str) -> Entry:
    """Return the entry that a file holds by this name, or one of the function without parameters.

    Raises:
        InvalidFile: a file that cannot be read or imported. InvalidInput: something else in the file.
    """
    path, attribute = file_of(name), name.rpartition(":")[2]
    try:
        source = path.read_bytes()
    except OSError as error:
        raise InvalidFile([f"{path}: expected a Python file, found {reason(error)}"]) from None
    found = getattr(_module(str(path.resolve()), sha256(source).hexdigest()), attribute, None)
    if isinstance(found, Entry):
        return found
    if isinstance(found, type) or not callable(found):
        expected = "an Entry, or a function of parameters and a random generator"
        raise InvalidInput(f"{path}: {attribute}: expected {expected}, found {shown(found)}")
    return Entry(attribute, found, {}, "")


@cache
def _module(path: str, digest: str) -> Any:
    """Return the module of a file with this digest, imported once per process."""
    spec = spec_from_file_location(f"slalom_scene_{digest[:16]}", path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    # Dataclasses look for their module there.
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InvalidFile(
            [f"{path}: expected a file that can be imported, found {type(error).__name__}: {error}"]
        ) from None
    return module
