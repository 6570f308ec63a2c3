"""The one typed wrapper of numba's njit that all kernels go through.

numba keys its disk cache by the file of a function, so an edit in a callee that lives in another file goes
unnoticed and the old result is returned. Here the key holds a hash of all kernel sources. Where no cache can
be written (a read-only install without a writable home) kernels compile in every process instead of failing.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])
Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Plane: TypeAlias = tuple[bool, float, float, float, float]
Candidate: TypeAlias = tuple[float, float, float, int, int, int]
Direction: TypeAlias = tuple[float, float, float, float]
Hulls: TypeAlias = tuple[Indices, Array, Array, Indices, npt.NDArray[np.bool_]]
"""hull, turns, corners, first, mixed: see `slalom.segments`."""


def _digest() -> str:
    folder = Path(__file__).parent
    sources = [*sorted(folder.glob("*.py")), folder.parent / "tolerances.py"]
    return hashlib.sha256(b"\0".join(source.read_bytes() for source in sources)).hexdigest()


SOURCES = _digest()


class _KernelCache(FunctionCache):
    """numba's function cache with the hash of all kernel sources in its key."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (SOURCES, *super()._index_key(sig, codegen))  # type: ignore[no-untyped-call]


def kernel(function: F) -> F:
    """Compile `function` on first use: nogil, IEEE arithmetic, division by zero gives inf or nan."""
    compiled = numba.njit(nogil=True, error_model="numpy")(function)
    if hasattr(compiled, "enable_caching"):  # absent when NUMBA_DISABLE_JIT is set
        try:
            compiled._cache = _KernelCache(function)  # type: ignore[attr-defined, no-untyped-call]
        except RuntimeError:
            return cast(F, compiled)
    return cast(F, compiled)


def inlined(function: F) -> F:
    """A part of one other kernel, which is compiled there: each kernel of its own that calls much is compiled with all
    that it calls, once more at every level.
    """
    return cast(F, numba.njit(nogil=True, error_model="numpy", inline="always")(function))


def threads() -> int:
    """How many threads kernels may run in: NUMBA_NUM_THREADS, which joblib sets for its workers, or all cores."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
