"""Extensions of numba: storage of parts of kernels, reference counts of arrays, and cached type resolution.

It is used with the versions of numba that were tested with it. With others kernels compile and run as numba's usual
functions do. The first compilation then takes nearly four times as long, see docs/design/0006.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from slalom.kernels.by_reference import uncounted

FITS = (0, 61) <= numba.version_info.short <= (0, 68)
"""Whether numba is a version that was tested with these classes: fleets gave the same bits with one of each."""


class PartLibrary(JITCodeLibrary):
    """Code to be linked in, which is optimised and translated with what Python calls only: not once at every level."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    @property
    def codegen(self) -> "PartLibrary":
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing: kernels have no use for one, since they neither print nor raise."""

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode()  # type: ignore[no-untyped-call]


class VectorPartLibrary(PartLibrary):
    """A part that is optimised alone, with loops turned into vector instructions, which entries do not have."""

    def _optimize_final_module(self) -> None:
        _optimize(self._final_module, self._codegen._tm, loops=True)


class EntryLibrary(JITCodeLibrary):
    """Functions that Python calls, with their parts linked in; loops are neither unrolled nor vectorised.

    Most loops have two or three passes. Unrolled and vectorised, the policy has 2.5 times as many instructions, takes
    twice as long to optimise and translate, and is no faster.
    """

    def _optimize_final_module(self) -> None:
        _optimize(self._final_module, self._codegen._tm, loops=False)


def _optimize(module: Any, machine: Any, *, loops: bool) -> None:
    """Optimise the code of a module; with `loops` they are unrolled and turned into vector instructions."""
    tuning = llvm.create_pipeline_tuning_options()
    tuning.speed_level = 3
    tuning.slp_vectorization = False
    tuning.loop_vectorization = tuning.loop_unrolling = loops
    builder = llvm.create_pass_builder(machine, tuning)
    passes = builder.getModulePassManager()
    passes.add_refprune_pass()
    passes.run(module, builder)


class _Lower(Lower):
    """References to arguments are not counted in a function that returns no array.

    Its caller holds the arguments, and nothing that is found from them outlives the call. numba counts a reference to
    each array of each argument when a function begins, and removes it at the end.
    """

    def extract_function_arguments(self) -> Any:
        given = super().extract_function_arguments()  # type: ignore[no-untyped-call]
        if _has_no_array(self.fndesc.restype):
            types_of = self.fndesc.argtypes
            given = [uncounted(self.context, self.builder, ty, value) for ty, value in zip(types_of, given)]
        self.fnargs = given
        return given


def _has_no_array(ty: Any) -> bool:
    """Whether a type is a number, or a tuple of such."""
    return isinstance(ty, types.Number | types.Boolean | types.NoneType) or (
        isinstance(ty, types.BaseTuple) and all(_has_no_array(one) for one in ty)  # type: ignore[attr-defined]
    )


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _Lowering(NativeLowering):
    _name = "lowering_without_counts"
    lowering_class = _Lower


class VectorCompiler(Compiler):
    """numba's compiler, but for the counts of references to arguments."""

    def define_pipelines(self) -> Any:
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for pipeline in pipelines:
            pipeline.passes = [(_Lowering if one is NativeLowering else one, why) for one, why in pipeline.passes]
            pipeline._finalized = False
            pipeline.finalize()
        return pipelines


class EntryCompiler(VectorCompiler):
    """Compiler of entries, see `EntryLibrary`."""

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        if library is None:
            library = EntryLibrary(target.codegen(), "entry")  # type: ignore[no-untyped-call]
            library.enable_object_caching()
        super().__init__(typing, target, library, *others)  # type: ignore[no-untyped-call]


class PartCompiler(VectorCompiler):
    """Compiler of parts, see `PartLibrary`."""

    kept_as: type[PartLibrary] = PartLibrary

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        library = library or self.kept_as(target.codegen(), "part")
        super().__init__(typing, target, library, *others)  # type: ignore[no-untyped-call]


class VectorPartCompiler(PartCompiler):
    """Compiler of parts with long loops, see `VectorPartLibrary`."""

    kept_as = VectorPartLibrary


_ask = types.BaseFunction.get_call_type
_found = dict[Any, Any]()


def _asked_once(function: Any, context: Any, args: Any, named: Any) -> Any:
    question = function, tuple(args), tuple(named.items())
    if question not in _found:
        _found[question] = _ask(function, context, args, named)
    return _found[question]


@contextmanager
def remembering() -> Iterator[None]:
    """While kernels compile: what numba finds of one of its own functions and the types of arguments is kept.

    Numbers that are added and arrays that are indexed are of the same few types in all kernels: 300 of 6700 requests
    differ. numba searches all signatures of a function at each request, which takes a quarter of the time of compiling.
    """
    if not FITS:
        yield
        return
    with global_compiler_lock:
        before = types.BaseFunction.get_call_type
        types.BaseFunction.get_call_type = _asked_once  # type: ignore[method-assign, assignment]
        try:
            yield
        finally:
            types.BaseFunction.get_call_type = before  # type: ignore[method-assign]
