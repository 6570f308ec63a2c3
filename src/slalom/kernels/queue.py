"""Candidates for a choice, taken in the order of their cost: a binary heap in one array.

Row 0 holds how many candidates there are and how many of them wait. Candidate number n >= 1 is row n: cost, control
(x, y, z), the boundaries i, j, k that generated it. Column 7 of the rows from 1 on is the heap: the numbers of those
that wait. Of candidates of equal cost the one that came first is taken first.

One array and plain loops, since lists of tuples and `heapq` take several seconds to compile.
"""

import numpy as np

from slalom.kernels.compiled import Array, inlined, kernel


@kernel
def new_queue() -> Array:
    """No candidates."""
    queue = np.empty((128, 8))
    queue[0, 0], queue[0, 1] = 0.0, 0.0
    return queue


@kernel
def before(queue: Array, a: float, b: float) -> bool:
    """Whether candidate a is taken before candidate b."""
    first, second = queue[int(a), 0], queue[int(b), 0]
    return bool(first < second or (first == second and a < b))


@kernel
def put(queue: Array, cost: float, u: Array, i: int, j: int, k: int) -> Array:
    """The queue with one more candidate; a larger array if it was full."""
    n = int(queue[0, 0]) + 1
    if n >= len(queue):
        larger = np.empty((2 * len(queue), 8))
        for row in range(len(queue)):
            for column in range(8):
                larger[row, column] = queue[row, column]
        queue = larger
    queue[n, 0], queue[n, 1], queue[n, 2], queue[n, 3] = cost, u[0], u[1], u[2]
    queue[n, 4], queue[n, 5], queue[n, 6] = i, j, k
    slot = int(queue[0, 1]) + 1
    queue[0, 0], queue[0, 1] = n, slot
    while slot > 1 and before(queue, n, queue[slot // 2, 7]):
        queue[slot, 7] = queue[slot // 2, 7]
        slot //= 2
    queue[slot, 7] = n
    return queue


@inlined
def take(queue: Array) -> int:
    """The number of the candidate of least cost, which waits no longer; 0 if none waits."""
    size = int(queue[0, 1])
    if size == 0:
        return 0
    first, moved, slot = int(queue[1, 7]), queue[size, 7], 1
    size -= 1
    queue[0, 1] = size
    while 2 * slot <= size:
        child = 2 * slot
        if child < size and before(queue, queue[child + 1, 7], queue[child, 7]):
            child += 1
        if before(queue, moved, queue[child, 7]):
            break
        queue[slot, 7] = queue[child, 7]
        slot = child
    queue[slot, 7] = moved
    return first
