"""Behaviours of navground: `Slalom` for one agent among others, `SlalomFleet` for agents that decide together.

Their properties can be set in YAML. Kinematics are omnidirectional or of two driven wheels. The disc about the
controlled point is larger than the agent by the distance of the point from the centre and by the error of following.
Neighbours that are no members of the fleet are not expected to avoid it.
"""

from slalom.base.extras import Extra

with Extra("navground", __name__):
    from slalom.adapters.navground.behaviours import PROPERTIES, Slalom, SlalomFleet

__all__ = ["PROPERTIES", "Slalom", "SlalomFleet"]
