"""Content of HDF5 files, read in another process, which a malformed file can neither hang nor crash for the caller."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.errors import InvalidFile
from slalom.io.input_file import file_size
from slalom.tolerances import HDF5_CONTENT, HDF5_DEPTH, HDF5_MEMORY, HDF5_RATE, HDF5_SECONDS, HDF5_WAIT

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

    The process that reads it has a limit of processor time and of memory; its start takes about 0.2 s.

    Raises:
        InvalidFile: no such file, no HDF5, links, objects that occur twice, other types, content far larger than the
            file, a file on which reading does not end within its limits.
    """
    size = file_size(path, KIND)
    seconds, memory = HDF5_SECONDS + size / HDF5_RATE, int(HDF5_MEMORY) + 4 * size
    most = max(int(HDF5_CONTENT), size)
    command = [sys.executable, "-P", str(CHILD), str(path), str(most), str(HDF5_DEPTH), str(seconds), str(memory)]
    # A thread of OpenBLAS takes address space, which counts as memory.
    settings = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(command, capture_output=True, env=settings, timeout=HDF5_WAIT * seconds, check=False)
    except subprocess.TimeoutExpired:
        raise _refused(path, f"one on which reading takes more than {HDF5_WAIT * seconds:.1f} s") from None
    if done.returncode < 0 and signal.Signals(-done.returncode).name == "SIGPROF":
        raise _refused(path, f"one on which reading takes more than {seconds:.1f} s of processor time")
    head, _, body = done.stdout.partition(b"\n")
    if done.returncode or not head:
        raise _refused(path, "one on which the HDF5 library crashes")
    said = json.loads(head)
    if "mistake" in said:
        raise _refused(path, said["mistake"])
    return _group(said["tree"], _arrays(said["arrays"], body))


def _refused(path: Path, found: str) -> InvalidFile:
    return InvalidFile([f"{path}: expected an {KIND}, found {found}"])


def _arrays(described: list[tuple[str, list[int]]], body: bytes) -> list[npt.NDArray[Any]]:
    """Return the arrays whose bytes follow each other in `body`, from the type and shape of each."""
    arrays, start = [], 0
    for name, shape in described:
        dtype, count = np.dtype(name), int(np.prod(shape, dtype=object))
        arrays.append(np.frombuffer(body, dtype, count, start).reshape(shape).copy())
        start += count * dtype.itemsize
    return arrays


def _group(tree: dict[str, Any], arrays: list[npt.NDArray[Any]]) -> Group:
    """Return a group whose values are arrays and texts."""

    def value(stored: Any) -> Value:
        return arrays[stored] if isinstance(stored, int) else Texts(stored["texts"], tuple(stored["shape"]))

    return Group(
        {name: value(stored) for name, stored in tree["attributes"].items()},
        {name: _group(inner, arrays) for name, inner in tree["groups"].items()},
        {name: value(stored) for name, stored in tree["datasets"].items()},
    )
