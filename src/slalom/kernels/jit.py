"""The one typed wrapper of numba's njit for all kernels.

Compiled kernels are kept in files, see `entries`.
"""

import gc
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import config, types
from numba.core.event import Listener, register

from slalom.kernels.compile_notice import compiling, when_compiling, while_compiling
from slalom.kernels.entries import OWN, Entries, why_none_fits
from slalom.kernels.numba_extensions import (
    FITS,
    EntryCompiler,
    PartCompiler,
    VectorCompiler,
    VectorPartCompiler,
    quicker,
)

F = TypeVar("F", bound=Callable[..., Any])


class _Announcer(Listener):
    """Calls `when_compiling` once, when the first compilation begins, and `while_compiling` at each end of one."""

    begun = done = 0

    def on_start(self, event: Any) -> None:
        self.begun += 1
        while when_compiling:
            when_compiling.pop(0)(compiling(OWN is not None, why_none_fits()))

    def on_end(self, event: Any) -> None:
        self.done += 1
        for tell in while_compiling:
            tell(self.done if self.done < self.begun else 0)


register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]


def inlined(function: F) -> F:
    """A `kernel` that is inlined into its callers: worth it for few callers that pass whole tables, or call it often.

    Each array of a table is passed as seven numbers and more, unless the table is passed by reference (`by_reference`).
    Larger functions take longer to compile.
    """
    return kernel(function, forceinline=True)


def vectorized(function: F) -> F:
    """A `kernel` with long loops over plain arrays: they use vector registers, also where other kernels call it."""
    return kernel(function, VectorCompiler, VectorPartCompiler)


def kernel(
    function: F,
    compiler: type[VectorCompiler] = EntryCompiler,
    of_parts: type[PartCompiler] = PartCompiler,
    **options: bool,
) -> F:
    """Compile `function` on first use: nogil, IEEE arithmetic, division by zero gives inf or nan.

    It is compiled as a part of the kernels that call it, and alone only if Python calls it. Wrappers for Python
    objects, optimisation and machine code cost more than the rest; parts have none of them. `compiler`: of the entry,
    `of_parts`: of the part; `options`: of numba, for the part.
    """
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        np.seterr(all="ignore")  # numbers of numpy then divide by zero as compiled ones do
        return function
    compiled: Any = partial(numba.njit, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
    of_part, of_entry = ({"pipeline_class": one} if FITS else {} for one in (of_parts, compiler))
    part = compiled(no_cpython_wrapper=True, **of_part, **options)(function)
    template = part.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        # Once for all integers that kernels pass to each other, not once more for each constant.
        return template(tuple(types.unliteral(arg) for arg in args), kws)  # type: ignore[no-untyped-call]

    entry = compiled(**of_entry)(function)
    entry._cache = Entries(function)
    entry.get_call_template = get_call_template
    entry.get_overload = part.get_overload
    entry.compile = _quickly(entry.compile)
    return cast(F, entry)


def _quickly(compile_one: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with fewer garbage collections: numba's default takes a tenth of the time, none twice the memory."""

    def compile_quickly(*args: Any) -> Any:
        usual = gc.get_threshold()
        gc.set_threshold(30_000, 10, 10)
        try:
            with quicker():
                return compile_one(*args)
        finally:
            gc.set_threshold(*usual)

    return compile_quickly


def threads() -> int:
    """Number of threads for kernels: NUMBA_NUM_THREADS, which joblib sets for its workers, or all cores."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


@inlined
def squared(x: float) -> float:
    """The product x * x. numba makes a loop over the bits of the exponent of `x**2`, with the same result."""
    return x * x
