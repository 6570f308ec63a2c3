"""Vehicles with wheels or steering: commands (speed, turn rate) or (speed, steering) that follow decisions.

A vehicle decides for a point of its body ahead of the axle. That point can move in every direction, also from rest. See
docs/vehicles.md. Ways from pose to pose need shapely.
"""

from slalom.vehicle.curves import Arc, dubins, reeds_shepp, to_place, turn_and_drive
from slalom.vehicle.decision import VehicleDecision
from slalom.vehicle.navigator import VehicleNavigator
from slalom.vehicle.sweep import outline
from slalom.vehicle.vehicle import Bicycle, Command, DifferentialDrive, Pose, Vehicle
from slalom.vehicle.ways import WayFound, way_among

__all__ = [
    "Arc",
    "Bicycle",
    "Command",
    "DifferentialDrive",
    "Pose",
    "Vehicle",
    "VehicleDecision",
    "VehicleNavigator",
    "WayFound",
    "dubins",
    "outline",
    "reeds_shepp",
    "to_place",
    "turn_and_drive",
    "way_among",
]
