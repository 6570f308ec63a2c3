"""Classes that extend numba: parts of kernels, arguments without counts of references, remembered resolutions."""

import ast
import operator
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core import types, typing
from numba.core.errors import TypingError

from slalom.kernels import jit, numba_extensions

KERNELS = Path(numba_extensions.__file__).parent
NUMBERS = {"int", "float", "bool"}


def held(x: np.ndarray, y: np.ndarray, many: int) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Arguments that are returned, kept in tuples and lists, and names that are assigned to again."""
    kept, z = [y], x
    for k in range(many):
        kept.append(y if k % 2 else z)
        z = (z, y)[0] + 1.0
        y = y[::-1]
    return x, kept, z


@pytest.mark.parametrize("compile", [jit.kernel, jit.inlined])
def test_arguments_are_neither_freed_nor_kept(compile):
    """The counts of references are the same before and after, and a reference keeps its array alive."""
    hold = compile(held)

    @jit.kernel
    def twice(x: np.ndarray, y: np.ndarray, many: int) -> float:
        total = 0.0
        for _ in range(many):
            first, kept, z = hold(x + 1.0, y, many)
            again = hold(first, y, many)[1]
            total += first[0] + z[0] + kept[0][0] + kept[-1][0] + again[-1][0]
        return total

    x, y = np.arange(3.0), np.arange(3.0, 6.0)
    before = sys.getrefcount(x), sys.getrefcount(y)
    expected = sum(
        first[0] + z[0] + kept[0][0] + kept[-1][0] + again[-1][0]
        for first, kept, z in [held(x + 1.0, y, 4)] * 4
        for again in [held(first, y, 4)[1]]
    )
    assert twice(x, y, 4) == expected
    one, kept, _ = hold(x, y, 3)
    assert one is x
    assert [list(array) for array in kept] == [list(array) for array in held(x, y, 3)[1]]
    del one, kept
    assert (sys.getrefcount(x), sys.getrefcount(y)) == before


class Pair(NamedTuple):
    """Two arrays."""

    first: np.ndarray
    rest: tuple[np.ndarray, np.ndarray]


def chosen(pair: Pair, k: int) -> tuple[np.ndarray, Pair]:
    """Parts of an argument, taken out in a loop, under names that are assigned to once and more often."""
    kept = [pair.first]
    for j in range(k):
        one, (other, third) = pair.first, pair.rest
        same = other if j % 2 else third
        kept.append(one[j % 2 :])
        kept.append(same)
    last = kept[-1]
    return last, Pair(last + 1.0, (pair.first, kept[k // 2]))


def total(pair: Pair, many: int) -> float:
    """A number that parts of parts are needed for."""
    value, again = 0.0, pair
    for k in range(many):
        last, again = chosen(again if k % 3 else pair, k)
        value += last[0] + again.first[-1] + again.rest[1][0]
    return value


def test_parts_of_arguments_are_neither_freed_nor_kept(monkeypatch):
    """No reference is lost or kept where names stand for parts of tuples."""
    x, y, z = np.arange(4.0), np.arange(4.0, 8.0), np.arange(8.0, 12.0)
    expected, before = total(Pair(x, (y, z)), 9), [sys.getrefcount(one) for one in (x, y, z)]
    part, uncounted = jit.kernel(chosen), jit.kernel(total)
    monkeypatch.setitem(globals(), "chosen", part)
    for _ in range(3):
        assert uncounted(Pair(x, (y, z)), 9) == expected
    last, pair = part(Pair(x, (y, z)), 4)
    assert np.shares_memory(last, y)
    assert pair.rest[0] is x
    del last, pair
    assert [sys.getrefcount(one) for one in (x, y, z)] == before


@pytest.mark.skipif(not jit.FITS, reason="nothing is remembered with this numba")
def test_resolved_calls_are_remembered():
    """Also nested, and only while kernels compile; a failed resolution is tried again."""
    ask = types.BaseFunction.get_call_type
    context = typing.Context()
    context.refresh()
    add = context.resolve_value_type(operator.add)
    with numba_extensions.quicker(), numba_extensions.quicker():
        found = [add.get_call_type(context, (types.float64, types.int64), {}) for _ in range(2)]
        assert types.BaseFunction.get_call_type is not ask
        for _ in range(2):
            with pytest.raises(TypingError):
                add.get_call_type(context, (types.float64, types.unicode_type), {})
    assert found[0] is found[1]
    assert found[0] == ask(add, context, (types.float64, types.int64), {})
    assert types.BaseFunction.get_call_type is ask


def names_in_lists(function: ast.FunctionDef) -> list[str]:
    """Parameters that are no numbers and that the function puts into a list, as "name, line"."""
    each = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    held = {one.arg for one in each if one.annotation is None or ast.unparse(one.annotation) not in NUMBERS}
    found = []
    for node in ast.walk(function):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
            continue
        if node.func.attr not in ("append", "insert", "extend") or ast.unparse(node.func.value) == "np":
            continue
        # Elements of arrays are numbers, and results of calls are counted.
        inside = [one for put in node.args for one in ast.walk(put) if isinstance(one, ast.Subscript | ast.Call)]
        read = {id(part) for one in inside for part in ast.walk(one)}
        names = [one for put in node.args for one in ast.walk(put) if isinstance(one, ast.Name) and id(one) not in read]
        found += [f"{one.id}, {node.lineno}" for one in names if one.id in held]
    return found


def test_no_kernel_puts_an_argument_into_a_list():
    """Arguments of functions that return no array are not counted: a list that lasts longer would not hold them."""
    for file in KERNELS.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef) and node.decorator_list:
                assert not names_in_lists(node), f"{file.name}: {names_in_lists(node)}"


PUTS = """
def f(a: Array, n: int, into):
    into.append((a, n))
    into.append(a[n])
    into.append(g(a))
    return np.append(a, a)
"""


def test_arguments_in_lists_are_found():
    assert names_in_lists(ast.parse(PUTS).body[0]) == ["a, 3"]
