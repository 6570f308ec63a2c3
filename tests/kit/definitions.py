"""Bounds on what a robot does, by definition: an independent answer to what `slalom.model.bounds` states in
half-spaces.
"""

import math

import numpy as np

AT_REST = 1e-6  # [m/s]


def out_of_bound(bound, velocity, x):
    """By how much vectors x (n, d) leave a bound of a robot with `velocity`, from its definition; 0 or less is within.

    In the unit of x; without half-spaces: lengths, angles and cross products in the frame of the body.
    """
    name, heading = type(bound).__name__, getattr(bound, "heading", None)
    speed = math.sqrt(sum(float(c) ** 2 for c in velocity))
    ahead = velocity / speed if speed >= AT_REST else heading
    if ahead is not None:
        along = sum(x[:, k] * ahead[k] for k in range(len(ahead)))
        across = np.sqrt(sum((x[:, k] - along * ahead[k]) ** 2 for k in range(len(ahead))))
    elif name in ("HeadingCone", "TurningRadius", "LeastSpeed"):
        return np.full(len(x), -np.inf)
    if name == "Friction":
        if ahead is None:
            return np.sqrt((x**2).sum(axis=1)) - min(bound.forward, bound.braking, bound.lateral)
        share = np.hypot(along / np.where(along >= 0, bound.forward, bound.braking), across / bound.lateral)
        return (share - 1.0) * min(bound.forward, bound.braking, bound.lateral)
    if name == "HeadingCone":
        return across * math.cos(bound.half_angle) - along * math.sin(bound.half_angle)
    if name == "TurningRadius":
        return across - speed**2 / bound.least
    if name == "LeastSpeed":
        return min(bound.least, speed) - along
    if bound.frame == "body" and ahead is None:
        # Every heading is possible: the inscribed circle.
        sides = -bound.half_widths if name == "Box" else _across_sides(bound.corners, np.zeros((1, 2)))
        return np.sqrt((x**2).sum(axis=1)) + sides.max()
    if bound.frame == "body":
        x = np.stack([along, ahead[0] * x[:, 1] - ahead[1] * x[:, 0]], axis=1)
    if name == "Box":
        return (np.abs(x) - bound.half_widths).max(axis=1)
    return _across_sides(bound.corners, x).max(axis=1)


def _across_sides(corners, x):
    """Signed distances of points (n, 2) from the sides of a counter-clockwise polygon, positive outside."""
    sides = np.roll(corners, -1, axis=0) - corners
    away = x[:, None, :] - corners
    return -(sides[:, 0] * away[..., 1] - sides[:, 1] * away[..., 0]) / np.hypot(sides[:, 0], sides[:, 1])
