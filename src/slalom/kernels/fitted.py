"""What extends numba's own: how parts of kernels are kept, who counts the references to arrays, and what is remembered.

It is used with versions of numba that it is known to fit. With others kernels compile and run as numba's usual
functions do, which takes half as long again.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numba
from numba.core import ir, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

FITS = (0, 61) <= numba.version_info.short <= (0, 68)
"""Whether numba is a version that these classes are known to fit: fleets ran with one of each, with the same bits."""


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


class _Lower(Lower):
    """Arguments are lent: whoever calls holds them until the call returns.

    numba counts a reference more to each array of each argument when a function begins, and one less when it ends, by
    a call each. Of a table of twenty arrays that costs as much as a small kernel does otherwise.
    """

    _lends, _lent = False, frozenset[str]()

    def lower_assign(self, ty: Any, inst: Any) -> Any:
        # A name that something else is assigned to as well is counted as usual.
        self._lends = isinstance(inst.value, ir.Arg) and self._assigned(inst.target.name) == 1
        if self._lends:
            self._lent |= {inst.target.name}
        try:
            return super().lower_assign(ty, inst)  # type: ignore[no-untyped-call]
        finally:
            self._lends = False

    def _assigned(self, name: str) -> int:
        assignments = (one for block in self.blocks.values() for one in block.find_insts(ir.Assign))
        return sum(one.target.name == name for one in assignments)

    def incref(self, typ: Any, val: Any) -> None:
        if not self._lends:
            super().incref(typ, val)  # type: ignore[no-untyped-call]

    def delvar(self, name: str) -> None:
        if name not in self._lent:
            super().delvar(name)  # type: ignore[no-untyped-call]


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _Lowering(NativeLowering):
    _name = "lowering_with_lent_arguments"

    @property
    def lowering_class(self) -> type[Lower]:
        return _Lower


class EntryCompiler(Compiler):
    """numba's compiler, but for who counts the references to arguments."""

    def define_pipelines(self) -> Any:
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for pipeline in pipelines:
            pipeline.passes = [(_Lowering if one is NativeLowering else one, why) for one, why in pipeline.passes]
            pipeline._finalized = False
            pipeline.finalize()
        return pipelines


class PartCompiler(EntryCompiler):
    """Of parts: see `PartLibrary`."""

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        library = library or PartLibrary(target.codegen(), "part")  # type: ignore[no-untyped-call]
        super().__init__(typing, target, library, *others)  # type: ignore[no-untyped-call]


_ask, _found = types.BaseFunction.get_call_type, dict[Any, Any]()


def _asked_once(function: Any, context: Any, args: Any, named: Any) -> Any:
    question = function, tuple(args), tuple(named.items())
    if question not in _found:
        _found[question] = _ask(function, context, args, named)
    return _found[question]


@contextmanager
def remembering() -> Iterator[None]:
    """While kernels compile: what numba finds of one of its own functions and the types of arguments is kept.

    Numbers that are added and arrays that are indexed are of the same few types in all kernels: 300 of 6700 questions
    are different. numba looks through all that it knows of a function each time, a quarter of the time of compiling.
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
