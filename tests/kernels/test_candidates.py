"""The queue of candidates of an exact choice, against the standard library."""

import heapq

import numpy as np
import pytest

from slalom.kernels.selection import candidates

new_queue, with_room, put, take = (
    kernel.py_func for kernel in (candidates.new_queue, candidates.with_room, candidates.put, candidates.take)
)


@pytest.mark.parametrize("seed", range(5))
def test_candidates_are_taken_in_the_order_of_heapq(seed: int) -> None:
    """Least cost first, of equal costs the first that was put, in any sequence of both operations."""
    rng, queue, expected, count, room = np.random.default_rng(seed), new_queue(), [], 0, 0
    for _ in range(2000):
        if rng.random() < 0.6:
            if room == 0:
                # Room is made for several, and only if it is missing.
                room, before = int(rng.integers(1, 200)), queue
                queue = with_room(queue, room)
                assert count + room < len(queue)
                assert (queue is before) == (count + room < len(before))
            # Few costs: many are equal.
            cost, u, where = float(rng.integers(0, 40)), rng.normal(size=3), rng.integers(-1, 50, 3)
            put(queue, cost, u, *where)
            count, room = count + 1, room - 1
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
