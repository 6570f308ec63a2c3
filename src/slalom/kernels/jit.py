"""The one typed wrapper of numba's njit for all kernels.

numba keys its disk cache by the file of a function: after an edit of a callee in another file the old code runs. Here
the key holds a hash of the function's file and of all files of the package that it imports. Where no cache can be
written (a read-only installation without a writable home) kernels compile in every process instead of failing.
"""

import ast
import gc
import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import config, types
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
from numba.core.event import Listener, register

from slalom.kernels.compile_notice import when_compiling
from slalom.kernels.numba_extensions import (
    FITS,
    EntryCompiler,
    PartCompiler,
    PartLibrary,
    VectorCompiler,
    VectorPartCompiler,
    remembering,
)

F = TypeVar("F", bound=Callable[..., Any])

ROOT = Path(__file__).parents[__name__.count(".")]
"""The folder of the package `slalom`."""


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


class _KernelFiles(IndexDataCacheFile):
    """numba's index and data files of one function, with data files that are named by their keys.

    numba numbers them. Two processes that compile at the same time then choose the same number for different
    signatures. The index of one then refers to the code of the other. Files of other sources are removed.
    """

    def save(self, key: Any, data: Any) -> None:
        index = self._load_index()  # type: ignore[no-untyped-call]
        for other in [one for one in index if one[0] != key[0]]:
            with suppress(OSError):
                Path(self._cache_path, index.pop(other)).unlink()
        index[key] = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:12], 16))  # type: ignore[no-untyped-call]
        self._save_data(index[key], data)  # type: ignore[no-untyped-call]
        self._save_index(index)  # type: ignore[no-untyped-call]


class _KernelCache(FunctionCache):
    """numba's function cache with the hash of the files of a kernel in its key."""

    def __init__(self, function: Callable[..., Any], what: str) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._what = what
        self._sources = sources_digest(Path(function.__code__.co_filename))
        base = self._impl.filename_base
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _KernelFiles(self._cache_path, base, stamp)  # type: ignore[no-untyped-call]

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (self._sources, self._what, *super()._index_key(sig, codegen))  # type: ignore[no-untyped-call]

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load a part as a part: otherwise it would be translated unoptimised, and entries would call that code."""
        codegen = target_context.codegen()
        usual = codegen._library_class
        if self._what == "part" and FITS:
            codegen._library_class = PartLibrary
        try:
            return super()._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except (AttributeError, ImportError):
            # The index was written by a version with classes that this one does not have.
            self._cache_file.flush()  # type: ignore[no-untyped-call]
            return None
        finally:
            codegen._library_class = usual


def _can_cache() -> bool:
    """Whether there is a folder for the cache that can be written."""
    try:
        _KernelCache(_can_cache, "entry")
    except RuntimeError:
        return False
    return True


CACHED = _can_cache()


class _Announcer(Listener):
    """Calls `when_compiling` once, when the first compilation begins."""

    def on_start(self, event: Any) -> None:
        while when_compiling:
            when_compiling.pop(0)(CACHED)

    def on_end(self, event: Any) -> None:
        pass


register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]


class _CacheOnUse:
    """The cache of one function, made when it is first used: a process that decides once uses 2 of 450."""

    def __init__(self, function: Callable[..., Any], what: str) -> None:
        self._function = function
        self._what = what

    @cached_property
    def _cache(self) -> Any:
        try:
            return _KernelCache(self._function, self._what)
        except RuntimeError:
            return NullCache()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)


def _cached(compiled: Any, function: Callable[..., Any], what: str) -> Any:
    compiled._cache = _CacheOnUse(function, what)
    return compiled


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
    template = _cached(part, function, "part").get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        # Once for all integers that kernels pass to each other, not once more for each constant.
        return template(tuple(types.unliteral(arg) for arg in args), kws)  # type: ignore[no-untyped-call]

    entry = _cached(compiled(**of_entry)(function), function, "entry")
    entry.get_call_template = get_call_template
    entry.get_overload = part.get_overload
    entry.compile = _quickly(entry.compile)
    return cast(F, entry)


def _quickly(compile_one: Callable[..., Any]) -> Callable[..., Any]:
    """Compile without garbage collection: the objects stay in use, and collection takes a tenth of the time."""

    def compile_quickly(*args: Any) -> Any:
        collects = gc.isenabled()
        gc.disable()
        try:
            with remembering():
                return compile_one(*args)
        finally:
            if collects:
                gc.enable()

    return compile_quickly


def threads() -> int:
    """Number of threads for kernels: NUMBA_NUM_THREADS, which joblib sets for its workers, or all cores."""
    return int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


@inlined
def squared(x: float) -> float:
    """The product x * x. numba makes a loop over the bits of the exponent of `x**2`, with the same result."""
    return x * x
