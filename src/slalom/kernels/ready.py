"""Compiles what almost every decision needs into the cache on disk: `python -m slalom.kernels.ready`.

The search for a control takes as long to compile as everything before it together, so a process of its own that
begins with the search halves the wait of whoever has two cores. Parts that either has finished are there for both.
"""

from typing import Any

from numba.core import types

from slalom.kernels.clearance import contact_times
from slalom.kernels.exchange import nearest_free


def compile_search() -> None:
    """The search and the time to collision among discs and balls, as decisions call them."""
    row, table, cube = (types.Array(types.float64, dimensions, "C") for dimensions in (1, 2, 3))
    segments = (cube, table, row, row, row, types.Tuple(()))  # type: ignore[no-untyped-call]
    called: list[tuple[Any, tuple[Any, ...]]] = [
        (nearest_free, (row, types.int64, table, *segments, types.int64, types.int64)),
        (contact_times, (row, row, *segments, types.Array(types.int64, 1, "C"), types.int64, table)),
    ]
    for function, arguments in called:
        function.compile(arguments)


if __name__ == "__main__":
    compile_search()
