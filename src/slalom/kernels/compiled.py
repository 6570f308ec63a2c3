"""The one typed wrapper of numba's njit that all kernels go through.

numba keys its disk cache by the file of a function, so an edit in a callee that lives in another file goes
unnoticed and the old result is returned. Here the key holds a hash of all kernel sources. Where no cache can
be written (a read-only install without a writable home) kernels compile in every process instead of failing.
"""

import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, update_wrapper
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from numba.core import types
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])
Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Plane: TypeAlias = tuple[bool, float, float, float, float]
Direction: TypeAlias = tuple[float, float, float, float]
Hulls: TypeAlias = tuple[Indices, Array, Array, Indices, Flags] | tuple[()]
"""hull, turns, corners, first, mixed: see `slalom.segments`. Empty where all bodies are points: numba drops branches that
the length of an argument decides, so that kernels are compiled without what only hulls need."""


def _digest() -> str:
    folder = Path(__file__).parent
    sources = [*sorted(folder.glob("*.py")), folder.parent / "tolerances.py"]
    return hashlib.sha256(b"\0".join(source.read_bytes() for source in sources)).hexdigest()


SOURCES = _digest()



class _KernelCache(FunctionCache):
    """numba's function cache with the hash of all kernel sources in its key, and the options."""

    def __init__(self, function: Callable[..., Any], options: tuple[str, ...]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._options = options

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (SOURCES, self._options, *super()._index_key(sig, codegen))  # type: ignore[no-untyped-call]


def _compiled(function: F, **options: Any) -> Any:
    compiled = numba.njit(nogil=True, error_model="numpy", **options)(function)
    if not hasattr(compiled, "enable_caching"):  # when NUMBA_DISABLE_JIT is set
        return compiled
    with suppress(RuntimeError):
        compiled._cache = _KernelCache(function, tuple(sorted(options)))
    template = compiled.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        return template(tuple(types.unliteral(arg) for arg in args), kws)

    # Once for all integers that kernels hand to each other, not once more for each constant.
    compiled.get_call_template = get_call_template
    return compiled


def kernel(function: F) -> F:
    """Compile `function` on first use: nogil, IEEE arithmetic, division by zero gives inf or nan."""
    return cast(F, _compiled(function))


def part(function: F) -> F:
    """As `kernel`, for what kernels call: without the wrappers that take Python's objects, which cost as much again.

    Called from Python, as tests do, it is compiled once more with them.
    """
    return cast(F, _Part(function))


class _Part:
    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self._function = function
        self._lean = _compiled(function, no_cpython_wrapper=True, no_cfunc_wrapper=True)
        if hasattr(self._lean, "enable_caching"):
            self._numba_type_ = types.Dispatcher(self._lean)

    @cached_property
    def _full(self) -> Callable[..., Any]:
        return kernel(self._function)

    def __call__(self, *args: Any) -> Any:
        return self._full(*args)


def inlined(function: F) -> F:
    """A part of one other kernel, which is compiled there: each kernel of its own that calls much is compiled with all
    that it calls, once more at every level.
    """
    return cast(F, numba.njit(nogil=True, error_model="numpy", inline="always")(function))
