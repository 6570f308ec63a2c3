"""Vehicles with wheels or steering: commands (speed, turn rate) or (speed, steering) that follow decisions.

A vehicle decides for a point of its body ahead of the axle. That point can move in every direction, also from rest. See
docs/vehicles.md.
"""

from slalom.vehicle.kinds import Bicycle, DifferentialDrive
from slalom.vehicle.navigator import VehicleDecision, VehicleNavigator
from slalom.vehicle.vehicle import Command, Pose, Vehicle

__all__ = ["Bicycle", "Command", "DifferentialDrive", "Pose", "Vehicle", "VehicleDecision", "VehicleNavigator"]
