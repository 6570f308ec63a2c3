"""Claim `cone`: the AO is a straight cone exactly if the relative velocity is zero."""

from typing import Any, Final

import numpy as np

from slalom.base.checks import Array
from slalom.model.response import Acceleration
from slalom.model.trajectory import ConstantAcceleration
from slalom.paper.obstacles import CONE, CONE_ACCELERATION, CONE_POSITION, RADIUS, obstacle_of

CONE_HORIZON: Final = 50.0
"""[s] Long, so that the horizon cuts only a small tip off the cone."""
SEED: Final = 0


def in_cone(controls: Array, center: Array, radius: float, apex: Array) -> np.ndarray:
    """Return whether `controls` (n, 2) lie in the cone with this `apex` that a disc at `center` subtends at 0."""
    offsets = controls - apex
    distance = np.linalg.norm(center)
    projections = offsets @ center / distance
    cosine = np.sqrt(1.0 - (radius / distance) ** 2)
    return np.asarray(projections > cosine * np.linalg.norm(offsets, axis=1))


def measure_cone(quick: bool) -> dict[str, Any]:
    """Count, for each relative velocity, the random accelerations on which AO and cone disagree.

    Points closer to the apex than 4 times the last element are left out, because the horizon cuts the tip off.
    """
    center, apex = np.array(CONE_POSITION), np.array(CONE_ACCELERATION)
    count = 500 if quick else 20000
    rng = np.random.default_rng(SEED)
    points = rng.uniform((-3.0, -3.0), (8.0, 6.0), (count, 2))
    tip = 4.0 * 2.0 * (float(np.linalg.norm(center)) + RADIUS) / CONE_HORIZON**2
    points = points[np.linalg.norm(points - apex, axis=1) > tip]
    rows = []
    for relative in CONE:
        trajectory = ConstantAcceleration(CONE_POSITION, -np.array(relative), CONE_ACCELERATION)
        inside = obstacle_of(trajectory, Acceleration(), CONE_HORIZON, (0.0, 0.0)).contains(points)
        cone = in_cone(points, center, RADIUS, apex)
        rows.append(
            {
                "relative_velocity": list(relative),
                "points": len(points),
                "in_ao": int(inside.sum()),
                "in_cone": int(cone.sum()),
                "judged_differently": int((inside != cone).sum()),
            }
        )
    return {"seed": SEED, "horizon": CONE_HORIZON, "radius": RADIUS, "rows": rows}
