"""Content of HDF5 files, read in another process, which a malformed file can neither hang nor crash for the caller."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import numpy.typing as npt

from slalom.base.checks import shown
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.io.limited import READER, Unreadable
from slalom.io.table import file_size

T = TypeVar("T")

HDF5_CONTENT: Final = 50_000_000
"""[B] Content of an HDF5 file that is larger than the file: one that is compressed or has empty parts.

Larger: a file of a few kilobytes takes gigabytes. Smaller: files that other programs compressed are refused.
"""

HDF5_MEMORY: Final = 400_000_000
"""[B] Memory of the process that reads an HDF5 file, in addition to four times the size of the file.

Larger: malformed files take more memory until they are refused. Smaller: valid files are refused.
"""

HDF5_SECONDS: Final = 0.6
"""[s] Processor time to read an HDF5 file, in addition to that of HDF5_RATE.

Larger: a malformed file on which reading does not end is refused later. Smaller: slow computers refuse valid files.
"""

HDF5_RATE: Final = 1e6
"""[B/s] Least speed of reading HDF5, in processor time; many small groups are read at five times as much.

Larger: slow computers refuse valid files. Smaller: large malformed files are refused later.
"""

HDF5_DEPTH: Final = 32
"""[1] Groups within groups of an HDF5 file. Larger: recursion may end in an error. Smaller: unions are refused."""


CHILD: Final = Path(__file__).with_name("hdf5_child.py")
KIND: Final = "HDF5 recording"


class Texts(NamedTuple):
    """Texts of an attribute or a dataset in the order of its elements, and its shape."""

    texts: list[str]
    shape: tuple[int, ...]


Value = npt.NDArray[Any] | Texts


@dataclass(frozen=True)
class Group:
    """Attributes, groups and datasets of a group by name."""

    attributes: dict[str, Value]
    groups: dict[str, "Group"]
    datasets: dict[str, Value]


def read_tree(path: Path) -> Group:
    """Return the whole content of an HDF5 file that consists of groups, numbers and texts.

    The process that reads it has a limit of processor time and of memory. Its start takes about 0.2 s; it reads
    further files.

    Raises:
        InvalidFile: no such file, no HDF5, links, objects that occur twice, other types, content far larger than the
            file, a file on which reading does not end within its limits.
    """
    size = file_size(path, KIND)
    arguments = [os.path.abspath(path), max(int(HDF5_CONTENT), size), HDF5_DEPTH]
    try:
        tree, arrays = READER.read(
            CHILD, "read", arguments, HDF5_SECONDS + size / HDF5_RATE, int(HDF5_MEMORY) + 4 * size
        )
    except Unreadable as error:
        raise InvalidFile([f"{path}: expected an {KIND}, found {reason(error)}"]) from None
    return _group(tree, arrays)


def _group(tree: dict[str, Any], arrays: list[npt.NDArray[Any]]) -> Group:
    """Return a group whose values are arrays and texts."""

    def value(stored: Any) -> Value:
        return arrays[stored] if isinstance(stored, int) else Texts(stored["texts"], tuple(stored["shape"]))

    return Group(
        {name: value(stored) for name, stored in tree["attributes"].items()},
        {name: _group(inner, arrays) for name, inner in tree["groups"].items()},
        {name: value(stored) for name, stored in tree["datasets"].items()},
    )


def member(members: Mapping[str, T], name: str) -> T:
    """Return a member of a group. Raises InvalidInput if there is none."""
    if name not in members:
        raise InvalidInput(f"{name}: expected it in the file, found none")
    return members[name]


def numbers(values: Mapping[str, Value], name: str) -> npt.NDArray[Any]:
    """Return the array of this name. Raises InvalidInput if there is none, or texts."""
    found = member(values, name)
    if isinstance(found, Texts):
        raise InvalidInput(f"{name}: expected numbers, found {shown(found.texts)}")
    return found


def scalar(values: Mapping[str, Value], name: str) -> Any:
    """Return the text or the number of this name. Raises InvalidInput if there is none, or an array."""
    found = member(values, name)
    if found.shape:
        raise InvalidInput(f"{name}: expected one value, found shape {found.shape}")
    return found.texts[0] if isinstance(found, Texts) else found[()]


def text(values: Mapping[str, Value], name: str) -> str:
    """Return the text of this name. Raises InvalidInput if there is none, or a number."""
    found = scalar(values, name)
    if not isinstance(found, str):
        raise InvalidInput(f"{name}: expected text, found {found!r}")
    return found
