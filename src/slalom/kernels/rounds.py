"""Robots that cannot meet decide at the same time, each after all before it that it could meet."""

import numpy as np

from slalom.kernels.compiled import Indices, kernel
from slalom.kernels.copying import fill
from slalom.kernels.tables import Fleet, Survey
from slalom.kernels.windows import cell_at


@kernel
def round_of(order: Indices, seen: Survey, fleet: Fleet) -> Indices:
    """The round in which each of `order` decides: one more than the last of those before it in the cells about it.

    Two robots of one round are never in neighbouring cells, and so neither knows what the other does in it.
    """
    latest, found = np.full(len(seen.first) - 1, -1), np.empty(len(order), np.int64)
    sides = np.ones(3, np.int64)
    fill(sides, seen.counts)
    for n in range(len(order)):
        # Cells are numbered as if there were three axes, the last ones of length 1.
        c = cell_at(fleet.position[order[n]], seen.low, seen.width, seen.counts)
        x, y, z = c // (sides[1] * sides[2]), c // sides[2] % sides[1], c % sides[2]
        last = -1
        for u in range(max(x - 1, 0), min(x + 2, sides[0])):
            for v in range(max(y - 1, 0), min(y + 2, sides[1])):
                for w in range(max(z - 1, 0), min(z + 2, sides[2])):
                    last = max(last, latest[(u * sides[1] + v) * sides[2] + w])
        found[n] = latest[c] = last + 1
    return found
