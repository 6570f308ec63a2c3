"""What the kernels are made of: the queue of candidates, and the ways in which they are compiled."""

import heapq
import operator
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core import types, typing
from numba.core.errors import TypingError

from slalom import kernels
from slalom.kernels import jit as compiled, numba_extensions as fitted
from slalom.kernels.selection.candidates import new_queue, put, take


@pytest.mark.parametrize("seed", range(5))
def test_the_queue_is_that_of_heapq(seed):
    """Least cost first, of equal costs the one that came first, whatever comes and goes in between."""
    rng, queue, expected, count = np.random.default_rng(seed), new_queue(), [], 0
    for _ in range(2000):
        if rng.random() < 0.6:
            # Few costs: many are equal.
            cost, u, where = float(rng.integers(0, 40)), rng.normal(size=3), rng.integers(-1, 50, 3)
            queue, count = put(queue, cost, u, *where), count + 1
            heapq.heappush(expected, (cost, count, tuple(u), tuple(where)))
        elif expected:
            cost, number, u, where = heapq.heappop(expected)
            n = take(queue)
            assert n == number
            assert tuple(queue[n, :7]) == (cost, *u, *where)
        else:
            assert take(queue) == 0
    while expected:
        assert take(queue) == heapq.heappop(expected)[1]
    assert take(queue) == 0


def test_no_kernel_has_the_name_of_a_module():
    """Whoever imports the module first would find it in place of the kernel."""
    modules = {path.stem for path in Path(kernels.__file__).parent.glob("*.py")}
    assert not modules & set(kernels.__all__)


def halved(x: float) -> float:
    return 0.5 * x


def test_kernels_compile_with_a_numba_that_parts_are_not_known_to_fit(monkeypatch):
    monkeypatch.setattr(compiled, "FITS", False)
    half = compiled.kernel(halved)

    @compiled.kernel
    def twice_halved(x: float) -> float:
        return half(half(x))

    assert twice_halved(3.0) == 0.75


AGAIN = """
import numpy as np
from slalom.kernels.jit import kernel
from slalom.kernels.decision.manoeuvre_cost import detour_length

@kernel
def twice(a, b):
    return 2.0 * detour_length(a, b, 0.0, 0.0, 1.0)

part = detour_length.get_overload.__self__
print(twice(np.array([-3.0, 0.0]), np.array([3.0, 0.1])) > 0.0)
print(sum(part.stats.cache_hits.values()), *{type(one.library).__name__ for one in part.overloads.values()})
"""


@pytest.mark.skipif(not compiled.FITS, reason="parts do not fit this numba")
def test_parts_come_back_from_the_cache_as_parts(tmp_path):
    """They would be translated unoptimised otherwise, and a new entry that they are linked to would call that."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", AGAIN]
    runs = [subprocess.run(command, env=environment, capture_output=True, text=True, check=True) for _ in range(2)]
    said = [run.stdout for run in runs]
    assert said == ["True\n0 PartLibrary\n", "True\n1 PartLibrary\n"]


def held(x: np.ndarray, y: np.ndarray, many: int) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Arguments that are returned, kept in tuples and lists, and names that are assigned to again."""
    kept, z = [y], x
    for k in range(many):
        kept.append(y if k % 2 else z)
        z = (z, y)[0] + 1.0
        y = y[::-1]
    return x, kept, z


@pytest.mark.parametrize("compile", [compiled.kernel, compiled.inlined])
def test_arguments_are_lent_and_neither_lost_nor_kept(compile):
    """As many references to them are left as there were before, and what holds one keeps the array alive."""
    hold = compile(held)

    @compiled.kernel
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


def test_parts_of_arguments_are_lent_too(monkeypatch):
    """No reference is lost where names go on standing for parts of tuples, and none is kept."""
    x, y, z = np.arange(4.0), np.arange(4.0, 8.0), np.arange(8.0, 12.0)
    expected, before = total(Pair(x, (y, z)), 9), [sys.getrefcount(one) for one in (x, y, z)]
    part, uncounted = compiled.kernel(chosen), compiled.kernel(total)
    monkeypatch.setitem(globals(), "chosen", part)
    for _ in range(3):
        assert uncounted(Pair(x, (y, z)), 9) == expected
    last, pair = part(Pair(x, (y, z)), 4)
    assert np.shares_memory(last, y)
    assert pair.rest[0] is x
    del last, pair
    assert [sys.getrefcount(one) for one in (x, y, z)] == before


@pytest.mark.slow
def test_kernels_compile_where_nothing_can_be_written():
    """A read-only installation without a writable home: they compile in every process, and say so."""
    program = """
import numpy as np
from numba.core.caching import FunctionCache

def refuse(locator):
    raise OSError("read-only")

for locator in FunctionCache._impl_class._locator_classes:
    locator.ensure_cache_path = refuse

from slalom.kernels.decision.time_to_go import earliest_arrival
print(earliest_arrival(np.array([3.0, 0.0]), np.zeros(2), 1.0, 1.0, 0.1) > 0.0)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "True\n", done.stderr
    assert done.stderr == kernels.compiling(kept=False) + "\n"


@pytest.mark.skipif(not compiled.FITS, reason="nothing is remembered with this numba")
def test_what_is_asked_once_is_remembered():
    """Also within each other, and only while kernels compile; what fails is asked again."""
    ask = types.BaseFunction.get_call_type
    context = typing.Context()
    context.refresh()
    add = context.resolve_value_type(operator.add)
    with fitted.remembering(), fitted.remembering():
        found = [add.get_call_type(context, (types.float64, types.int64), {}) for _ in range(2)]
        assert types.BaseFunction.get_call_type is not ask
        for _ in range(2):
            with pytest.raises(TypingError):
                add.get_call_type(context, (types.float64, types.unicode_type), {})
    assert found[0] is found[1]
    assert found[0] == ask(add, context, (types.float64, types.int64), {})
    assert types.BaseFunction.get_call_type is ask
