"""Readers of untrusted files in another process, which a malformed file can neither hang nor crash for the caller."""

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.errors import InvalidFile

PROGRAM: Final = Path(__file__).with_name("limited_child.py")

WAIT: Final = 20.0
"""[1] Longest time to read a file, as a multiple of the allowed processor time.

Larger: a file on a drive that does not answer is refused later. Smaller: a busy computer refuses valid files.
"""

KEPT: Final = 600_000_000
"""[B] Allowed memory up to which a process reads further files: what it keeps must leave enough for the next one."""


WALLS_SECONDS: Final = 5.0
"""[s] Processor time to read a file of walls, in addition to that of WALLS_RATE.

Larger: malformed files on which reading does not end are refused later. Smaller: slow computers refuse valid files.
"""

WALLS_RATE: Final = 2.5e5
"""[B/s] Least speed of reading walls, in processor time: a fifth of that of drawings in DXF on a computer of 2020."""

WALLS_MEMORY: Final = 500_000_000
"""[B] Memory of the process that reads walls, in addition to 64 times the size of the file, which lines of DXF take."""


class Unreadable(Exception):
    """A file cannot be read; the message states what it is, as the end of "expected ..., found"."""


class Reader:
    """The process that reads files for this one, started when it is needed and after a file that it did not read.

    Threads take turns. A process that was forked starts its own.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Leave the process to the one that started it."""
        self.turn = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def read(
        self, program: Path, function: str, arguments: list[Any], seconds: float, memory: int
    ) -> tuple[Any, list[npt.NDArray[Any]]]:
        """Return the tree and the arrays of a file, as a function of a program returns them.

        Args:
            program: a file of Python, which imports nothing of slalom. arguments: of the function, values of JSON.
            seconds: [s] of processor time. memory: [B] of address space.

        Raises:
            Unreadable: the function raised an error, the process crashed or did not end within its limits.
        """
        request = [str(program), function, arguments, seconds, memory]
        with self.turn:
            process, late = self._started(), threading.Event()

            def end() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(WAIT * seconds, end)
            timer.start()
            try:
                reply, arrays = self._exchange(process, request)
            except BrokenPipeError:
                reply, arrays = {}, []
            finally:
                timer.cancel()
            read = "tree" in reply and len(arrays) == len(reply["arrays"])
            code = 0 if read and memory <= KEPT else self.close()
        if read:
            return reply["tree"], arrays
        if late.is_set():
            raise Unreadable(f"one on which reading takes more than {WAIT * seconds:.1f} s")
        if code < 0 and signal.Signals(-code).name == "SIGPROF":
            raise Unreadable(f"one on which reading takes more than {seconds:.1f} s of processor time")
        raise Unreadable(reply.get("mistake", "one on which the library that reads it crashes"))

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
                [sys.executable, "-P", str(PROGRAM)],
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


READER: Final = Reader()
atexit.register(READER.close)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=READER.forget)


def within_limits(
    place: object, size: int, kind: str, function: str, *arguments: Any
) -> tuple[dict[str, Any], list[npt.NDArray[Any]]]:
    """Return what a function of `walls_child` returns for a file of `size` [B], within limits.

    Raises:
        InvalidFile: the function refuses the file or does not end; it begins with `place` and names `kind`.
    """
    seconds, memory = WALLS_SECONDS + size / WALLS_RATE, WALLS_MEMORY + 64 * size
    try:
        return READER.read(PROGRAM.with_name("walls_child.py"), function, list(arguments), seconds, memory)
    except Unreadable as error:
        raise InvalidFile([f"{place}: expected {kind}, found {error}"]) from None
