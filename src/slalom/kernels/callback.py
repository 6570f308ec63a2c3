"""Calls of Python from kernels, by the address of a function."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import lower_builtin, type_callable

from slalom.kernels.decision.tables import CALLBACK


def call_back(address: int, question: int, response: int, until: float, to: float) -> float:
    """The answer of the function at `address`, one of type CALLBACK.

    It may write into arrays that the kernel reads. Its caller holds the function, and raises what was raised there.
    """
    return float(CALLBACK(address)(question, response, until, to))


@type_callable(call_back)
def _type_of_answer(_context: Any) -> Callable[..., Any]:
    def answer(_address: Any, _question: Any, _response: Any, _until: Any, _to: Any) -> Any:
        return types.float64

    return answer


@lower_builtin(call_back, types.Integer, types.Integer, types.Integer, types.Float, types.Float)  # type: ignore[no-untyped-call, untyped-decorator]
def _call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    wanted = (types.int64, types.int64, types.int64, types.float64, types.float64)
    address, *values = (
        context.cast(builder, value, found, to) for value, found, to in zip(arguments, signature.args, wanted)
    )
    whole = ir.IntType(64)
    real = ir.DoubleType()
    function = ir.FunctionType(real, [whole, whole, real, real]).as_pointer()
    return builder.call(builder.inttoptr(address, function), values)
