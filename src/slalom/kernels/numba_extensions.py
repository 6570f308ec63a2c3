"""Extensions of numba: storage of parts of kernels, reference counts of arrays, and cached type resolution.

It is used with the versions of numba that were tested with it. With others kernels compile and run as numba's usual
functions do. The first compilation then takes nearly four times as long, see docs/design/0006.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import config, types
from numba.core.codegen import JITCodeLibrary, get_host_cpu_features
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

from slalom.kernels.by_reference import uncounted

FITS = (0, 61) <= numba.version_info.short <= (0, 68)
"""Whether numba is a version that was tested with these classes: fleets gave the same bits with one of each."""

PROCESSORS = {
    "x86_64": ("x86-64-v3", "avx avx2 bmi bmi2 f16c fma lzcnt movbe popcnt sse3 sse4.1 sse4.2 ssse3"),
    "aarch64": ("generic", ""),
    "arm64": ("generic", ""),
}
"""By architecture, the processor that entries are translated for, by LLVM's name, and what a processor must have for
it. x86-64-v3 is AVX2; a decision with AVX-512 takes 2 % less time."""


def _processor() -> tuple[str, str]:
    """Name and features of the processor that entries are made for: of `PROCESSORS`, or, where that does not fit, here.

    NUMBA_CPU_NAME, NUMBA_CPU_FEATURES and NUMBA_ENABLE_AVX are respected.
    """
    name, needed = PROCESSORS.get(llvm.get_process_triple().partition("-")[0], ("", "none"))
    usual = config.CPU_NAME is None and config.CPU_FEATURES is None and config.ENABLE_AVX  # type: ignore[attr-defined]
    if usual and (not needed or all(llvm.get_host_cpu_features().get(one) for one in needed.split())):
        return name, ""
    features = config.CPU_FEATURES  # type: ignore[attr-defined]
    return (
        config.CPU_NAME or llvm.get_host_cpu_name(),  # type: ignore[attr-defined]
        get_host_cpu_features() if features is None else features,  # type: ignore[no-untyped-call]
    )


PROCESSOR, FEATURES = _processor()


@cache
def _machine(codegen: Any) -> Any:
    """LLVM's translator for `PROCESSOR`, otherwise as numba's own for the processor that runs it."""
    options = {"opt": config.OPT}  # type: ignore[attr-defined]
    codegen._customize_tm_options(options)
    options |= {"cpu": PROCESSOR, "features": FEATURES}
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(**options)


def all_parts(library: Any) -> list[Any]:
    """The libraries that a library needs, each once, with those that its parts need."""
    found: dict[Any, None] = {}
    todo = list(library._linking_libraries)
    while todo:
        one = todo.pop()
        if one not in found:
            found[one] = None
            if type(one) is PartLibrary:
                todo += one._linking_libraries
    return list(found)


class PartLibrary(JITCodeLibrary):
    """Code to be linked in, which is optimised and translated with what Python calls only: not once at every level."""

    def finalize(self) -> None:
        """Link nothing: an entry links each part once."""
        self._raise_if_finalized()  # type: ignore[no-untyped-call]
        for library in self._linking_libraries:
            self._reload_init.update(library._reload_init)
        self._finalize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Its code, with functions that callers may define too. numba keeps a copy for that."""
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"
        return self._final_module

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    @property
    def codegen(self) -> "PartLibrary":
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing: kernels have no use for one, since they neither print nor raise."""


class VectorPartLibrary(PartLibrary):
    """A part that is optimised alone, with loops turned into vector instructions, which entries do not have."""

    def finalize(self) -> None:
        """Link what it calls."""
        self._linking_libraries = all_parts(self)
        JITCodeLibrary.finalize(self)  # type: ignore[no-untyped-call]

    def _optimize_final_module(self) -> None:
        _optimize(self._final_module, _machine(self._codegen), loops=True)


class EntryLibrary(JITCodeLibrary):
    """Functions that Python calls, with their parts linked in; loops are neither unrolled nor vectorised.

    Most loops have two or three passes. Unrolled and vectorised, the policy has 2.5 times as many instructions, takes
    twice as long to optimise and translate, and is no faster.
    """

    loops = False

    def finalize(self) -> None:
        self._linking_libraries = all_parts(self)
        super().finalize()  # type: ignore[no-untyped-call]

    def _optimize_final_module(self) -> None:
        machine = _machine(self._codegen)
        _optimize(self._final_module, machine, loops=self.loops)
        self._object = machine.emit_object(self._final_module)
        self._set_compiled_object(self._object)  # type: ignore[no-untyped-call]

    def serialize_using_object_code(self) -> Any:
        """Its name, code and names of symbols; not LLVM's form of the code, since no kernel links an entry."""
        defined = [*self._final_module.functions, *self._final_module.global_variables]
        return self.name, self._object, [one.name for one in defined if not one.is_declaration]

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, code, symbols = state
        self = cls(codegen, name)
        self.enable_object_caching()  # type: ignore[no-untyped-call]
        self._set_compiled_object(code)  # type: ignore[no-untyped-call]
        self._finalize_final_module()  # type: ignore[no-untyped-call]
        codegen._engine._defined_symbols.update(symbols)
        return self


class VectorEntryLibrary(EntryLibrary):
    """Functions with long loops that Python calls, with their parts linked in."""

    loops = True


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
    """numba's compiler, but for the counts of references to arguments, and the library that the code is put into."""

    kept_as: type[JITCodeLibrary] = VectorEntryLibrary

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        if library is None:
            library = self.kept_as(target.codegen(), self.kept_as.__name__)
            library.enable_object_caching()
        super().__init__(typing, target, library, *others)  # type: ignore[no-untyped-call]

    def define_pipelines(self) -> Any:
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for pipeline in pipelines:
            pipeline.passes = [(_Lowering if one is NativeLowering else one, why) for one, why in pipeline.passes]
            pipeline._finalized = False
            pipeline.finalize()
        return pipelines


class EntryCompiler(VectorCompiler):
    """Compiler of entries, see `EntryLibrary`."""

    kept_as = EntryLibrary


class PartCompiler(VectorCompiler):
    """Compiler of parts, see `PartLibrary`."""

    kept_as = PartLibrary


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
