"""Reproduction of the paper's figures and measurement of its claims; `slalom reproduce` on the command line.

Heavy modules are imported on use, so that the command line starts fast.
"""

from typing import Final

TITLES: Final = {
    "moving_obstacle": "The moving obstacle",
    "linear_vo": "The linear velocity obstacle",
    "temporal_element": "The temporal element",
    "nlvo_circular": "The NLVO on a circular path",
    "vo_beside_nlvo": "VO beside NLVO",
    "ao_nao": "AO and NAO with their elements",
    "ao_cone": "The AO for three relative velocities",
    "curved_road": "A curved road: VO and NLVO of three cars",
    "roundabout_crossing": "The roundabout, crossed with one constant acceleration",
    "roundabout_exit": "The roundabout, left by the top exit",
    "curves": "VO and AO on a curved road raise alarms that NLVO and NAO do not",
    "crossing": "One constant acceleration crosses the roundabout",
    "sweep": "NAO against AO: collisions and adjustments",
    "smoothness": "Smoothness: acceleration and jerk",
    "cone": "The AO is a straight cone when the relative velocity is zero",
    "oscillation": "Oscillations between robots: the velocity obstacle or the selection",
}
"""Titles by name, in the order of the page."""
