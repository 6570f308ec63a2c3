"""Cubic pieces and the squared distance along them, in Bernstein form.

A cubic q(s), s in [0, 1], is given by its control points. |q(s)|^2 is a polynomial of degree 6. Its Bernstein
coefficients bound it from both sides and converge quadratically under bisection. Whether it stays above R^2 is decided
by their signs alone, without sampling and without a root formula that degenerates.

A node of a bisection is a row of nine numbers: seven coefficients, left end, width.
"""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from slalom.base.tolerances import DEPTH, RESOLVED
from slalom.kernels.arrays import Array
from slalom.kernels.jit import inlined, kernel, squared

LEAST_WIDTH: Final = 0.5**DEPTH
"""[1] Width of a cubic piece after that many bisections, as a share of the whole piece."""


NODE = 9


@kernel
def new_stack() -> Array:
    """A buffer (n, NODE) for the nodes of one depth-first bisection: one sibling per level, and the root."""
    return np.empty((DEPTH + 4, NODE))


@kernel
def restrict(p0: float, p1: float, p2: float, p3: float, a: float, b: float) -> tuple[float, float, float, float]:
    """Control values of the cubic with control values p0 to p3, restricted to [a, b]: its blossom at a and b."""
    a01 = p0 + (p1 - p0) * a
    a12 = p1 + (p2 - p1) * a
    a23 = p2 + (p3 - p2) * a
    b01 = p0 + (p1 - p0) * b
    b12 = p1 + (p2 - p1) * b
    b23 = p2 + (p3 - p2) * b
    aa = a01 + (a12 - a01) * a
    aa2 = a12 + (a23 - a12) * a
    ab = a01 + (a12 - a01) * b
    ab2 = a12 + (a23 - a12) * b
    bb = b01 + (b12 - b01) * b
    bb2 = b12 + (b23 - b12) * b
    return aa + (aa2 - aa) * a, aa + (aa2 - aa) * b, ab + (ab2 - ab) * b, bb + (bb2 - bb) * b


@kernel
def value(p0: float, p1: float, p2: float, p3: float, s: float) -> float:
    """The cubic with control values p0 to p3 at s in [0, 1]."""
    r = 1.0 - s
    return r * r * r * p0 + 3.0 * s * r * r * p1 + 3.0 * s * s * r * p2 + s * s * s * p3


@kernel
def slope(p0: float, p1: float, p2: float, p3: float, s: float) -> float:
    """The derivative of that cubic at s."""
    r = 1.0 - s
    return 3.0 * (r * r * (p1 - p0) + 2.0 * s * r * (p2 - p1) + s * s * (p3 - p2))


@kernel
def curvature(p0: float, p1: float, p2: float, p3: float, s: float) -> float:
    """The second derivative of that cubic at s."""
    return 6.0 * ((1.0 - s) * (p2 - 2.0 * p1 + p0) + s * (p3 - 2.0 * p2 + p1))


@kernel
def put_distance(stack: Array, p: Array, floor: float) -> None:
    """Write the coefficients of |q(s)|^2 - floor into the root node of the stack; p (4, 3): control points of q."""
    x0 = p[0, 0]
    y0 = p[0, 1]
    z0 = p[0, 2]
    x1 = p[1, 0]
    y1 = p[1, 1]
    z1 = p[1, 2]
    x2 = p[2, 0]
    y2 = p[2, 1]
    z2 = p[2, 2]
    x3 = p[3, 0]
    y3 = p[3, 1]
    z3 = p[3, 2]
    q00 = x0 * x0 + y0 * y0 + z0 * z0
    q01 = x0 * x1 + y0 * y1 + z0 * z1
    q02 = x0 * x2 + y0 * y2 + z0 * z2
    q03 = x0 * x3 + y0 * y3 + z0 * z3
    q11 = x1 * x1 + y1 * y1 + z1 * z1
    q12 = x1 * x2 + y1 * y2 + z1 * z2
    q13 = x1 * x3 + y1 * y3 + z1 * z3
    q22 = x2 * x2 + y2 * y2 + z2 * z2
    q23 = x2 * x3 + y2 * y3 + z2 * z3
    q33 = x3 * x3 + y3 * y3 + z3 * z3
    node = stack[0]
    node[0] = q00 - floor
    node[1] = q01 - floor
    node[2] = 0.4 * q02 + 0.6 * q11 - floor
    node[3] = 0.1 * q03 + 0.9 * q12 - floor
    node[4] = 0.4 * q13 + 0.6 * q22 - floor
    node[5] = q23 - floor
    node[6] = q33 - floor
    node[7] = 0.0
    node[8] = 1.0


@kernel
def bisect(stack: Array, top: int) -> None:
    """Replace the node at `top` of the stack (n, NODE) by its right half, and put its left half at top + 1."""
    node = stack[top]
    left = stack[top + 1]
    c0 = node[0]
    c1 = node[1]
    c2 = node[2]
    c3 = node[3]
    c4 = node[4]
    c5 = node[5]
    c6 = node[6]
    left[0] = c0
    node[6] = c6
    c0 = 0.5 * (c0 + c1)
    c1 = 0.5 * (c1 + c2)
    c2 = 0.5 * (c2 + c3)
    c3 = 0.5 * (c3 + c4)
    c4 = 0.5 * (c4 + c5)
    c5 = 0.5 * (c5 + c6)
    left[1] = c0
    node[5] = c5
    c0 = 0.5 * (c0 + c1)
    c1 = 0.5 * (c1 + c2)
    c2 = 0.5 * (c2 + c3)
    c3 = 0.5 * (c3 + c4)
    c4 = 0.5 * (c4 + c5)
    left[2] = c0
    node[4] = c4
    c0 = 0.5 * (c0 + c1)
    c1 = 0.5 * (c1 + c2)
    c2 = 0.5 * (c2 + c3)
    c3 = 0.5 * (c3 + c4)
    left[3] = c0
    node[3] = c3
    c0 = 0.5 * (c0 + c1)
    c1 = 0.5 * (c1 + c2)
    c2 = 0.5 * (c2 + c3)
    left[4] = c0
    node[2] = c2
    c0 = 0.5 * (c0 + c1)
    c1 = 0.5 * (c1 + c2)
    left[5] = c0
    node[1] = c1
    c0 = 0.5 * (c0 + c1)
    left[6] = c0
    node[0] = c0
    width = 0.5 * node[8]
    left[7] = node[7]
    left[8] = width
    node[7] = node[7] + width
    node[8] = width


@kernel
def least_coefficient(node: Array) -> float:
    """A lower bound of the polynomial of a node (NODE,)."""
    return float(min(min(min(node[0], node[1]), min(node[2], node[3])), min(min(node[4], node[5]), node[6])))


@kernel
def below(stack: Array) -> float:
    """A place s at which the root node's polynomial is below 0, or -1 if there is none (up to rounding)."""
    top = 0
    while top >= 0:
        node = stack[top]
        if least_coefficient(node) >= 0.0:
            top -= 1
        elif node[0] < 0.0:
            return float(node[7])
        elif node[6] < 0.0:
            return float(node[7] + node[8])
        elif top >= DEPTH or node[8] < LEAST_WIDTH:
            top -= 1
        else:
            bisect(stack, top)
            top += 1
    return -1.0


@kernel
def first_below(stack: Array, width: float) -> float:
    """The first s, up to `width`, at which the polynomial falls below 0, or -1 if it never does."""
    top = 0
    while top >= 0:
        node = stack[top]
        if least_coefficient(node) >= 0.0:
            top -= 1
        elif node[0] < 0.0 or (node[8] < width and node[6] < 0.0):
            return float(node[7])
        elif top >= DEPTH or node[8] < LEAST_WIDTH:
            top -= 1
        else:
            bisect(stack, top)
            top += 1
    return -1.0


@kernel
def least(stack: Array, ceiling: float, accuracy: float) -> tuple[float, float]:
    """Least value of a squared distance where below `ceiling`, and its place (-1: nowhere below).

    The root of the value found exceeds the root of the true minimum by at most `accuracy`, or by the share RESOLVED of
    the largest distance if that is more.
    """
    largest = 0.0
    for k in range(7):
        largest = max(largest, stack[0, k])
    accuracy = max(accuracy, RESOLVED * np.sqrt(largest))
    best = ceiling
    place = -1.0
    top = 0
    while top >= 0:
        node = stack[top]
        if node[0] < best:
            best = node[0]
            place = node[7]
        if node[6] < best:
            best = node[6]
            place = node[7] + node[8]
        root = max(0.0, np.sqrt(max(best, 0.0)) - accuracy)
        if root == 0.0 or least_coefficient(node) >= root * root or top >= DEPTH or node[8] < LEAST_WIDTH:
            top -= 1
        else:
            bisect(stack, top)
            top += 1
    return float(best), float(place)


@kernel
def copy_into(into: npt.NDArray[Any], what: npt.NDArray[Any]) -> None:
    """Copy `what` into the first rows of an array of as many dimensions.

    numba's array assignment compiles about 100 functions of its string library for a shape error, 0.1 s each.
    """
    for index in np.ndindex(what.shape):
        into[index] = what[index]


# Gains: the image of a control u is g u + k J u, where J turns the plane by a right angle to the left.
#
# With k, the cross gain, a control is turned and scaled: (g, k) is the complex number g + i k. Only responses that
# turn have cross gains, in the plane. All other tables have no columns of them.


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
