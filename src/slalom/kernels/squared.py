"""The square of a number."""

from slalom.kernels.jit import inlined


@inlined
def squared(x: float) -> float:
    """The product x * x. numba makes a loop over the bits of the exponent of `x**2`, with the same result."""
    return x * x
