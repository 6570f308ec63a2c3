"""Copies of arrays, element by element: with numba's own assignment of one array to another come a hundred functions of
its string library, for a message that nobody will read, and each takes a tenth of a second to compile."""

from typing import Any

import numpy as np
import numpy.typing as npt

from slalom.kernels.compiled import kernel


@kernel
def fill(into: npt.NDArray[Any], what: npt.NDArray[Any]) -> None:
    """Put `what` into the first rows of an array, which has as many dimensions."""
    for index in np.ndindex(what.shape):
        into[index] = what[index]
