"""Trajectories: positions of obstacles over absolute time."""

from typing import Final

from slalom.model.trajectory.composite import Composite as Composite, Function as Function
from slalom.model.trajectory.kinds import (
    Circular as Circular,
    ConstantAcceleration as ConstantAcceleration,
    ConstantVelocity as ConstantVelocity,
    PiecewisePolynomial as PiecewisePolynomial,
    Sampled as Sampled,
    Stationary as Stationary,
)
from slalom.model.trajectory.protocol import Trajectory as Trajectory

TRAJECTORIES: Final[dict[str, type[Trajectory]]] = {
    "stationary": Stationary,
    "constant_velocity": ConstantVelocity,
    "constant_acceleration": ConstantAcceleration,
    "circular": Circular,
    "sampled": Sampled,
    "piecewise_polynomial": PiecewisePolynomial,
}
"""Kinds of trajectories that are plain numbers, by the name that scenario files and recordings use."""
