"""Trajectories: positions of obstacles over absolute time."""

from typing import Final

from slalom.trajectory.circular import Circular as Circular
from slalom.trajectory.composite import Composite as Composite, Function as Function
from slalom.trajectory.piecewise import PiecewisePolynomial as PiecewisePolynomial
from slalom.trajectory.polynomial import (
    ConstantAcceleration as ConstantAcceleration,
    ConstantVelocity as ConstantVelocity,
    Stationary as Stationary,
)
from slalom.trajectory.protocol import Trajectory as Trajectory
from slalom.trajectory.sampled import Sampled as Sampled

TRAJECTORIES: Final[dict[str, type[Trajectory]]] = {
    "stationary": Stationary,
    "constant_velocity": ConstantVelocity,
    "constant_acceleration": ConstantAcceleration,
    "circular": Circular,
    "sampled": Sampled,
    "piecewise_polynomial": PiecewisePolynomial,
}
"""Kinds of trajectories that are plain numbers, by the name that scenario files and recordings use."""
