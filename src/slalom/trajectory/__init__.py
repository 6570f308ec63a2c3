"""Trajectories: positions of obstacles over absolute time."""

from typing import Final

from slalom.trajectory.circular import Circular
from slalom.trajectory.composite import Composite, Function
from slalom.trajectory.piecewise import PiecewisePolynomial
from slalom.trajectory.polynomial import ConstantAcceleration, ConstantVelocity, Stationary
from slalom.trajectory.protocol import Trajectory
from slalom.trajectory.sampled import Sampled

__all__ = [
    "TRAJECTORIES",
    "Circular",
    "Composite",
    "ConstantAcceleration",
    "ConstantVelocity",
    "Function",
    "PiecewisePolynomial",
    "Sampled",
    "Stationary",
    "Trajectory",
]

TRAJECTORIES: Final[dict[str, type[Trajectory]]] = {
    "stationary": Stationary,
    "constant_velocity": ConstantVelocity,
    "constant_acceleration": ConstantAcceleration,
    "circular": Circular,
    "sampled": Sampled,
    "piecewise_polynomial": PiecewisePolynomial,
}
"""Kinds of trajectories that are plain numbers, by the name that scenario files and recordings use."""
