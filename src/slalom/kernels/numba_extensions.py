"""Extensions of numba: storage of parts of kernels, reference counts of arrays, and cached type resolution.

It is used with the versions of numba that were tested with it. With others kernels compile and run as numba's usual
functions do. The first compilation then takes nearly four times as long, see docs/design/0006.
"""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache
from typing import Any, Final

import llvmlite.binding as llvm
import numba
from numba.core import config, event, ir, types
from numba.core.codegen import JITCodeLibrary, get_host_cpu_features
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.runtime.context import NRTContext
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
        """Keep its code as bytes, which take a fraction of the memory."""
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"
        self._code = self._final_module.as_bitcode()
        self._final_module.close()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Its code, with functions that others may define too."""
        return llvm.parse_bitcode(self._code)

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
        defined = [*self._final_module.functions, *self._final_module.global_variables]
        self._symbols = [one.name for one in defined if not one.is_declaration]
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        # LLVM's form of the code takes a multiple of the memory, and no kernel links an entry.
        self._final_module.close()
        nothing = self._codegen._create_empty_module(self.name)  # type: ignore[no-untyped-call]
        self._final_module = llvm.parse_assembly(str(nothing))
        self._set_compiled_object(self._object)  # type: ignore[no-untyped-call]

    def _finalize_specific(self) -> None:
        self._codegen._engine._defined_symbols.update(self._symbols)
        super()._finalize_specific()  # type: ignore[no-untyped-call]

    def serialize_using_object_code(self) -> Any:
        """Its name, code and names of symbols."""
        return self.name, self._object, self._symbols

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, code, symbols = state
        self = cls(codegen, name)
        self.enable_object_caching()  # type: ignore[no-untyped-call]
        self._symbols = symbols
        self._set_compiled_object(code)  # type: ignore[no-untyped-call]
        self._finalize_final_module()  # type: ignore[no-untyped-call]
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

    def _compile_core(self) -> Any:
        """The result without the types of its variables, which only numba's messages use and which take memory."""
        return super()._compile_core()._replace(type_annotation="")  # type: ignore[no-untyped-call]

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


def _memory_of(self: NRTContext, builder: Any, ty: Any, value: Any) -> list[tuple[Any, Any]]:
    """The memory in a value; of its members only those are read that hold some."""
    models = self._context.data_model_manager
    found = [(ty, models[ty].get_nrt_meminfo(builder, value))] if models[ty].has_nrt_meminfo() else []
    for member, read in models[ty].traverse(builder):
        if models[member].contains_nrt_meminfo():
            found += _memory_of(self, builder, member, read(value))
    return found


def _variables_in(self: ir.Inst, value: Any) -> list[ir.Var]:
    """The variables in what an instruction is made of."""
    if isinstance(value, ir.Inst):
        return list(value.list_vars())  # type: ignore[no-untyped-call]
    found: list[ir.Var] = []
    for one in value.values() if isinstance(value, dict) else value:
        if isinstance(one, ir.Var):
            found.append(one)
        elif isinstance(one, ir.Inst | list | tuple | dict):
            found += _variables_in(self, one)
    return found


QUICKER: Final[tuple[tuple[Any, str, Any], ...]] = (
    (types.BaseFunction, "get_call_type", _asked_once),
    (NRTContext, "get_meminfos", _memory_of),
    (ir.Inst, "_rec_list_vars", _variables_in),
    (event, "install_timer", lambda *_: nullcontext()),
)
"""Parts of numba, and what replaces them while kernels compile."""


@contextmanager
def quicker() -> Iterator[None]:
    """While kernels compile numba does what is in `QUICKER`, with the same result.

    It remembers what it found of one of its own functions and the types of arguments. Numbers that are added and arrays
    that are indexed are of the same few types in all kernels: 300 of 6700 requests differ. numba searches all
    signatures of a function at each request, which takes a quarter of the time of compiling. It does not measure each
    function that it compiles within others.
    """
    if not FITS:
        yield
        return
    with global_compiler_lock:
        before = [getattr(owner, name) for owner, name, _ in QUICKER]
        for owner, name, quick in QUICKER:
            setattr(owner, name, quick)
        try:
            yield
        finally:
            for (owner, name, _), usual in zip(QUICKER, before):
                setattr(owner, name, usual)
