"""Content of HDF5 files, read in another process, which a malformed file can neither hang nor crash for the caller."""

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from slalom.base.checks import shown
from slalom.base.errors import InvalidFile, InvalidInput, reason
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

HDF5_WAIT: Final = 20.0
"""[1] Longest time to read an HDF5 file, as a multiple of the allowed processor time.

Larger: a file on a drive that does not answer is refused later. Smaller: a busy computer refuses valid files.
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


class Reader:
    """The process that reads HDF5 files for this one, started when it is needed and after a file that it did not read.

    Threads take turns. A process that was forked starts its own.
    """

    def __init__(self, program: Path) -> None:
        self.program = program
        self.forget()

    def forget(self) -> None:
        """Leave the process to the one that started it."""
        self.turn = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def read(self, path: Path, size: int) -> tuple[dict[str, Any], list[npt.NDArray[Any]]]:
        """Return the line and the arrays of the answer for a file of `size` bytes; the line may hold a `mistake`."""
        seconds, memory = HDF5_SECONDS + size / HDF5_RATE, int(HDF5_MEMORY) + 4 * size
        request = [os.path.abspath(path), max(int(HDF5_CONTENT), size), HDF5_DEPTH, seconds, memory]
        with self.turn:
            process, late = self._started(), threading.Event()

            def end() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(HDF5_WAIT * seconds, end)
            timer.start()
            try:
                reply, arrays = self._exchange(process, request)
            except BrokenPipeError:
                reply, arrays = {}, []
            finally:
                timer.cancel()
            if "tree" in reply and len(arrays) == len(reply["arrays"]):
                return reply, arrays
            code = self.close()
        if late.is_set():
            reply = {"mistake": f"one on which reading takes more than {HDF5_WAIT * seconds:.1f} s"}
        elif code < 0 and signal.Signals(-code).name == "SIGPROF":
            reply = {"mistake": f"one on which reading takes more than {seconds:.1f} s of processor time"}
        return reply if "mistake" in reply else {"mistake": "one on which the HDF5 library crashes"}, []

    def _exchange(
        self, process: "subprocess.Popen[bytes]", request: list[Any]
    ) -> tuple[dict[str, Any], list[npt.NDArray[Any]]]:
        """Return the bytes that the process writes; fewer than an answer if it ends before."""
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(request).encode() + b"\n")
        process.stdin.flush()
        line = process.stdout.readline()
        reply = json.loads(line) if line.endswith(b"\n") else {}
        arrays = []
        for name, shape in reply.get("arrays", ()):
            array = np.empty(shape, np.dtype(name))
            body = process.stdout.read(array.nbytes) if array.size else b""
            if len(body) < array.nbytes:
                break
            array[...] = np.frombuffer(body, array.dtype).reshape(shape)
            arrays.append(array)
        return reply, arrays

    def _started(self) -> "subprocess.Popen[bytes]":
        if self.process is None:
            # A thread of OpenBLAS takes address space, which counts as memory.
            self.process = subprocess.Popen(
                [sys.executable, "-P", str(self.program)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )
        return self.process

    def close(self) -> int:
        """End the process and return its exit code; the next file starts another."""
        process, self.process = self.process, None
        if process is None:
            return 0
        for stream in (process.stdin, process.stdout):
            assert stream is not None
            with contextlib.suppress(BrokenPipeError):
                stream.close()
        return process.wait()


READER: Final = Reader(CHILD)
atexit.register(READER.close)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=READER.forget)


def read_tree(path: Path) -> Group:
    """Return the whole content of an HDF5 file that consists of groups, numbers and texts.

    The process that reads it has a limit of processor time and of memory. Its start takes about 0.2 s; it reads
    further files.

    Raises:
        InvalidFile: no such file, no HDF5, links, objects that occur twice, other types, content far larger than the
            file, a file on which reading does not end within its limits.
    """
    reply, arrays = READER.read(path, file_size(path, KIND))
    if "mistake" in reply:
        raise InvalidFile([f"{path}: expected an {KIND}, found {reason(OSError(reply['mistake']))}"])
    return _group(reply["tree"], arrays)


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
