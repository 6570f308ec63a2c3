"""Tables by reference in kernels: the values of the tables themselves, and arrays that stay alive, uncounted."""

import ast
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

import slalom
from slalom.kernels.arrays import Corners, zero_records
from slalom.kernels.by_reference import by_reference
from slalom.kernels.decision.tables import ObstacleAtHorizon
from slalom.kernels.jit import inlined, kernel

KERNELS = sorted((Path(slalom.__file__).parent / "kernels").rglob("*.py"))


class Inner(NamedTuple):
    """Arrays, numbers and corners."""

    values: np.ndarray
    flags: np.ndarray
    corners: Corners | tuple[()]
    scale: float


class Outer(NamedTuple):
    """A table in a table, records, and tables of one type only."""

    count: int
    inner: Inner
    records: np.ndarray
    is_wide: bool
    pair: tuple[float, float]


def table(corners: Corners | tuple[()]) -> Outer:
    """Numbers that all differ."""
    records = zero_records(ObstacleAtHorizon, 3)
    records["radius"] = [0.5, 0.25, 0.125]
    return Outer(3, Inner(np.arange(4.0, 8.0), np.array([True, False]), corners, 2.5), records, True, (11.0, 13.0))


def corner_sum(corners: Corners | tuple[()]) -> float:
    """The sum of the corners, 0 without any."""
    return float(corners.corners.sum()) if len(corners) > 0 else 0.0


def weighted(inner: Inner, k: int) -> float:
    """A number of all fields; the array is changed too."""
    inner.values[k] += 1.0
    return inner.values[k] * inner.scale + (100.0 if inner.flags[k % 2] else 0.0)


def total(outer: Outer) -> float:
    """The sum over all fields, with tables passed on within a loop."""
    outer, result = by_reference(outer), 0.0
    for k in range(outer.count):
        result += weighted(outer.inner, k) + outer.records[k].radius
    inner = by_reference(outer.inner)
    return result + corner_sum(inner.corners) + outer.pair[1] + (1000.0 if outer.is_wide else 0.0)


@pytest.mark.parametrize("part", [kernel, inlined])
@pytest.mark.parametrize(
    "corners", [(), Corners(np.full((2, 5), 3.0), np.array([0, 2]), np.zeros(1, np.bool_))], ids=["points", "hulls"]
)
def test_fields_are_those_of_the_table(monkeypatch, part, corners):
    """Numbers, arrays, records and tables; what is written is seen by all; no reference is kept or lost."""
    given, same = table(corners), table(corners)
    arrays = given.inner.values, given.inner.flags, given.records
    before = [sys.getrefcount(one) for one in arrays]
    compiled = kernel(total)
    expected = [total_of(same) for _ in range(3)]
    monkeypatch.setitem(globals(), "weighted", part(weighted))
    monkeypatch.setitem(globals(), "corner_sum", part(corner_sum))
    assert [compiled(given) for _ in range(3)] == expected
    np.testing.assert_array_equal(given.inner.values, same.inner.values)
    assert [sys.getrefcount(one) for one in arrays] == before


def total_of(outer: Outer) -> float:
    """`total` without kernels, with the fields of records as numpy has them."""
    result = sum(weighted(outer.inner, k) + outer.records["radius"][k] for k in range(outer.count))
    return result + corner_sum(outer.inner.corners) + outer.pair[1] + 1000.0


def made_and_read(n: int) -> float:
    """Tables that a kernel makes and passes on: they live until the kernel that reads them has returned."""
    result = 0.0
    for k in range(n):
        inner = Inner(np.full(1000, float(k)), np.zeros(2, np.bool_), (), 1.0)
        result += read(inner)
    return result


def read(inner: Inner) -> float:
    """The sum of the values, after as much memory was used by others."""
    inner = by_reference(inner)
    other = np.full(1000, -1.0)
    return float(inner.values.sum() + inner.values[3 : 3 + len(inner.flags)].sum() + other[0])


def test_a_table_that_a_kernel_made_lives_as_long_as_the_reference(monkeypatch):
    """The caller holds its arrays; views of them read the same memory."""
    expected = made_and_read(50)
    monkeypatch.setitem(globals(), "read", kernel(read))
    assert kernel(made_and_read)(50) == expected


def test_only_tables_have_references():
    """Anything else is refused when the kernel is compiled; in Python all is returned as it is."""
    values = np.zeros(3)
    assert by_reference(values) is values
    with pytest.raises(TypingError):
        kernel(lambda x: len(by_reference(x)))(values)
    with pytest.raises(TypingError):
        kernel(lambda x: by_reference(x).missing)(table(()))


@pytest.mark.parametrize(
    "path", [path for path in KERNELS if "by_reference(" in path.read_text()], ids=lambda p: p.stem
)
def test_kernels_make_references_of_arguments_only(path):
    """The caller holds arguments until the kernel returns; a local table may be freed before."""
    for function in ast.walk(ast.parse(path.read_text())):
        if isinstance(function, ast.FunctionDef) and function.name != "by_reference":
            arguments = {one.arg for one in function.args.args}
            for call in ast.walk(function):
                if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "by_reference":
                    assert isinstance(call.args[0], ast.Name)
                    assert call.args[0].id in arguments, f"{path}: {function.name}"
