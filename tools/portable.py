"""Processes in which numpy and BLAS give the same bits on every x86-64 processor of the last fifteen years.

Their sums have other last bits where a processor has wider registers. A run in which a robot collides, or obstacles are
predicted in numpy, is then another one.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from unittest.mock import patch

ARITHMETIC = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}
"""Their environment, which both libraries read when they are imported."""


def is_set() -> bool:
    """Whether this is such a process."""
    return ARITHMETIC.items() <= dict(os.environ).items()


def run(script: Path, words: list[str], **more: str) -> int:
    """The exit code of a script that runs in such a process, with these words, and `more` in its environment."""
    return subprocess.run(
        [sys.executable, str(script), *words], env={**os.environ, **ARITHMETIC, **more}, check=False
    ).returncode


@contextmanager
def processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of so many of these processes."""
    with patch.dict(os.environ, ARITHMETIC), ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        yield pool
