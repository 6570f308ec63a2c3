"""Behaviours of navground: `Slalom` for one agent among others, `SlalomFleet` for agents that decide together.

Their properties can be set in YAML. Kinematics are omnidirectional or of two driven wheels. The margin of the disc
about the controlled point is larger by twice `lead`, once for each of two agents. Neighbours that are no members of the
fleet are not expected to avoid it.
"""

from slalom.adapters.navground.behaviours import PROPERTIES, Slalom, SlalomFleet

__all__ = ["PROPERTIES", "Slalom", "SlalomFleet"]
