"""Extensions of numba: storage of parts of kernels, reference counts of arrays, and cached type resolution.

It is used with the versions of numba that were tested with it. With others kernels compile and run as numba's usual
functions do, which takes half as long again.
"""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import ir, types
from numba.core.cgutils import get_null_value
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

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
    tuning.speed_level, tuning.slp_vectorization = 3, False
    tuning.loop_vectorization = tuning.loop_unrolling = loops
    builder = llvm.create_pass_builder(machine, tuning)
    passes = builder.getModulePassManager()
    passes.add_refprune_pass()
    passes.run(module, builder)


WHOLE = -1
"""In place of the number of an element."""


class _Lower(Lower):
    """Arguments are lent: whoever calls holds them until the call returns. So are parts of tuples that are lent.

    numba adds a reference to each array of each argument when a function begins, and removes it when the function ends,
    by a call each. It does the same when an array is taken out of a tuple. Of a table of twenty arrays that costs as
    much as a small kernel does otherwise.
    """

    _counts, _lent = True, frozenset[str]()

    def extract_function_arguments(self) -> Any:
        self._lent = self._what_is_lent()
        return super().extract_function_arguments()  # type: ignore[no-untyped-call]

    def _what_is_lent(self) -> frozenset[str]:
        """Names of arguments, and of parts of them. One that something else is assigned to as well is counted."""
        assigned = [one for block in self.blocks.values() for one in block.find_insts(ir.Assign)]
        times = Counter(one.target.name for one in assigned)
        lent, known = frozenset[str](), -1
        while known < len(lent):
            known = len(lent)
            lent |= {
                one.target.name
                for one in assigned
                if times[one.target.name] == 1
                and (isinstance(one.value, ir.Arg) or self._part_of(one, lent) is not None)
            }
        return lent

    def _part_of(self, assigned: Any, lent: frozenset[str]) -> int | None:
        """Which element of a lent tuple is assigned; WHOLE: all that a lent name stands for; None: anything else."""
        value, ty = assigned.value, self.typeof(assigned.target.name)  # type: ignore[no-untyped-call]
        source = value if isinstance(value, ir.Var) else getattr(value, "_kws", {}).get("value")
        if source is None or source.name not in lent:
            return None
        owner = self.typeof(source.name)  # type: ignore[no-untyped-call]
        if value is source or value.op == "exhaust_iter":
            return WHOLE if ty == owner else None
        if value.op not in ("getattr", "static_getitem") or not isinstance(owner, types.BaseTuple):
            return None
        index = value.index if value.op == "static_getitem" else owner.fields.index(value.attr)  # type: ignore[attr-defined]
        return index if isinstance(index, int) and index >= 0 and ty == owner[index] else None  # type: ignore[index]

    def lower_assign(self, ty: Any, inst: Any) -> Any:
        name = inst.target.name
        if name in self._lent and not isinstance(inst.value, ir.Arg):
            source = inst.value if isinstance(inst.value, ir.Var) else inst.value.value
            k, owner = self._part_of(inst, self._lent), self.loadvar(source.name)  # type: ignore[no-untyped-call]
            return owner if k == WHOLE else self.builder.extract_value(owner, k)
        self._counts = name not in self._lent
        try:
            return super().lower_assign(ty, inst)  # type: ignore[no-untyped-call]
        finally:
            self._counts = True

    def incref(self, typ: Any, val: Any) -> None:
        if self._counts:
            super().incref(typ, val)  # type: ignore[no-untyped-call]

    def decref(self, typ: Any, val: Any) -> None:
        if self._counts:
            super().decref(typ, val)  # type: ignore[no-untyped-call]

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        # In a loop, the previous value of the name was borrowed too.
        self._counts = name not in self._lent
        super().storevar(value, name, argidx)  # type: ignore[no-untyped-call]
        self._counts = True

    def delvar(self, name: str) -> None:
        if name not in self._lent:
            super().delvar(name)  # type: ignore[no-untyped-call]


class _EntryLower(_Lower):
    """Lowering of functions that Python calls: if no array is returned, parts do not count references to arguments.

    Python holds the arguments, and nothing that is found from them outlives the call. A reference costs as much as ten
    additions, since threads may count at the same time.
    """

    def extract_function_arguments(self) -> Any:
        given = super().extract_function_arguments()
        if _has_no_array(self.fndesc.restype):
            given = [self._uncounted(ty, value) for ty, value in zip(self.fndesc.argtypes, given)]
        self.fnargs = given
        return given

    def _uncounted(self, ty: Any, value: Any) -> Any:
        """The value, all arrays in it without the counter of references that belongs to them."""
        if isinstance(ty, types.Array):
            array = self.context.make_array(ty)(self.context, self.builder, value=value)
            array.meminfo = get_null_value(array.meminfo.type)  # type: ignore[no-untyped-call]
            return array._getvalue()
        if isinstance(ty, types.BaseTuple):
            for k, one in enumerate(ty):  # type: ignore[arg-type, var-annotated]
                part = self._uncounted(one, self.builder.extract_value(value, k))
                value = self.builder.insert_value(value, part, k)
        return value


def _has_no_array(ty: Any) -> bool:
    """Whether a type is a number, or a tuple of such."""
    return isinstance(ty, types.Number | types.Boolean | types.NoneType) or (
        isinstance(ty, types.BaseTuple) and all(_has_no_array(one) for one in ty)  # type: ignore[attr-defined]
    )


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _EntryLowering(NativeLowering):
    _name, lowering_class = "lowering_of_entries", _EntryLower


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _PartLowering(NativeLowering):
    _name, lowering_class = "lowering_of_parts", _Lower


class VectorCompiler(Compiler):
    """numba's compiler, but for what counts the references to arguments."""

    lowering: type[NativeLowering] = _EntryLowering

    def define_pipelines(self) -> Any:
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for pipeline in pipelines:
            pipeline.passes = [(self.lowering if one is NativeLowering else one, why) for one, why in pipeline.passes]
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

    lowering: type[NativeLowering] = _PartLowering
    kept_as: type[PartLibrary] = PartLibrary

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        library = library or self.kept_as(target.codegen(), "part")
        super().__init__(typing, target, library, *others)  # type: ignore[no-untyped-call]


class VectorPartCompiler(PartCompiler):
    """Compiler of parts with long loops, see `VectorPartLibrary`."""

    kept_as = VectorPartLibrary


_ask, _found = types.BaseFunction.get_call_type, dict[Any, Any]()


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
