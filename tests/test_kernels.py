"""What the kernels are made of: the queue of candidates, and the ways in which they are compiled."""

import heapq
import os
import subprocess
import sys

import numpy as np
import pytest

from slalom.kernels import compiled
from slalom.kernels.queue import new_queue, put, take


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


def halved(x: float) -> float:
    return 0.5 * x


def test_kernels_compile_with_a_numba_that_parts_are_not_known_to_fit(monkeypatch):
    monkeypatch.setattr(compiled, "FITTING", set())
    half = compiled.kernel(halved)

    @compiled.kernel
    def twice_halved(x: float) -> float:
        return half(half(x))

    assert twice_halved(3.0) == 0.75


@pytest.mark.slow
def test_kernels_compile_where_nothing_can_be_written(tmp_path):
    """A read-only installation without a writable home: they compile in every process."""
    program = (
        "from slalom.kernels.arrival import earliest_arrival as f; import numpy as np; "
        "print(f(np.array([3.0, 0.0]), np.zeros(2), 1.0, 1.0, 0.1) > 0.0)"
    )
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    environment = os.environ | {"NUMBA_CACHE_DIR": str(blocked / "cache"), "HOME": str(blocked)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert done.stdout == "True\n", done.stderr
