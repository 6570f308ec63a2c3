"""Geometry in the plane that the rules of the guidance share."""

from slalom.kernels.jit import kernel


@kernel
def along_and_across(x: float, y: float, dx: float, dy: float) -> tuple[float, float]:
    """Components of the vector (x, y) along (dx, dy) and to the left of it, times the length of (dx, dy)."""
    return x * dx + y * dy, dx * y - dy * x
