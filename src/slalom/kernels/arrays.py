"""Types of the arrays that kernels take; importing them does not import numba."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.int64]
Flags: TypeAlias = npt.NDArray[np.bool_]
Singles: TypeAlias = npt.NDArray[np.float32]
Words: TypeAlias = npt.NDArray[np.uint64]
Plane: TypeAlias = tuple[bool, float, float, float, float]
Direction: TypeAlias = tuple[float, float, float, float]
Hulls: TypeAlias = tuple[Indices, Array, Array, Indices, Flags]
"""hull, turns, corners, first, mixed: see `slalom.relative_motion`."""
MaybeHulls: TypeAlias = Hulls | tuple[()]
"""Empty where all bodies are points: numba drops branches that the length of an argument decides, so that kernels are
compiled without what only hulls need."""
