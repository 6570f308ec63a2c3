"""Gains: the image of a control u is g u + k J u, where J turns the plane by a right angle to the left.

With k, the cross gain, a control is turned and scaled: (g, k) is the complex number g + i k. Only responses that turn
have cross gains, in the plane. All other tables have no columns of them.
"""

import numpy as np

from slalom.kernels.arrays import Array
from slalom.kernels.geometry.cubic import value
from slalom.kernels.jit import inlined, squared


@inlined
def image(gains: Array, cross: Array, j: int, s: int, u: Array, axis: int) -> float:
    """The coordinate of the image of u (3,) at control point j of segment s; gains (4, n), cross (4, n or 0)."""
    along = gains[j, s] * u[axis]
    if cross.shape[1] == 0 or axis == 2:
        return float(along)
    return float(along - cross[j, s] * u[1] if axis == 0 else along + cross[j, s] * u[0])


@inlined
def modulus_at(gain: Array, cross: Array, x: float) -> float:
    """The scale of the gain at x in [0, 1] of one segment, with control points (4,) and (4, 1 or 0)."""
    g = value(gain[0], gain[1], gain[2], gain[3], x)
    if cross.shape[1] == 0:
        return float(g)
    k = value(cross[0, 0], cross[1, 0], cross[2, 0], cross[3, 0], x)
    return float(np.sqrt(g * g + k * k))


@inlined
def largest_modulus(gains: Array, cross: Array, s: int) -> float:
    """At least the scale of the gain anywhere on segment s."""
    if cross.shape[1] == 0:
        return float(max(max(gains[0, s], gains[1, s]), max(gains[2, s], gains[3, s])))
    square = 0.0
    for j in range(4):
        square = max(square, squared(gains[j, s]) + squared(cross[j, s]))
    return float(np.sqrt(square))


@inlined
def to_control(gain: Array, cross: Array, x: float, place: Array) -> None:
    """Replace the image `place` (3,) at x in [0, 1] of one segment by the control whose image it is."""
    g = value(gain[0], gain[1], gain[2], gain[3], x)
    if cross.shape[1] == 0:
        for axis in range(3):
            place[axis] /= g
        return
    k = value(cross[0, 0], cross[1, 0], cross[2, 0], cross[3, 0], x)
    square = g * g + k * k
    place[0], place[1] = (g * place[0] + k * place[1]) / square, (g * place[1] - k * place[0]) / square
