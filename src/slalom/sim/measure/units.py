"""Units of the keys of parts in files, and units and meanings of the arrays in HDF5 files of runs."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Final

UNITS: Final[Mapping[str, str]] = {
    "acceleration": "m/s^2",
    "at": "s",
    "braking": "m/s^2",
    "by": "m",
    "center": "m",
    "coefficients": "m, m/s, m/s^2, ...",
    "columns": "-",
    "corner": "m",
    "corners": "m",
    "correlation": "1",
    "durations": "s",
    "end": "m",
    "enough": "m",
    "enough_clearance": "m",
    "first": "m",
    "forward": "m/s^2",
    "frame": "-",
    "half_angle": "rad",
    "half_widths": "m/s^2",
    "heading": "1",
    "high": "m",
    "interpolation": "-",
    "last": "m",
    "lateral": "m/s^2",
    "least": "m",
    "length": "m",
    "low": "m",
    "min_distance": "m",
    "normal": "1",
    "parts": "-",
    "phase": "rad",
    "points": "m",
    "position": "m",
    "positions": "m",
    "probability": "1",
    "radius": "m",
    "seed": "-",
    "shapes": "-",
    "spacing": "m",
    "speed": "m/s",
    "start": "m",
    "then": "-",
    "times": "s",
    "velocity": "m/s",
    "width": "m",
}
"""Unit of a key of any kind, SI; 1: a number without a unit, "-": no quantity."""
OWN_UNITS: Final[Mapping[tuple[str, str], str]] = {
    ("piecewise_polynomial", "start"): "s",
    ("convex_polygon", "corners"): "m/s^2",
    ("least_speed", "least"): "m/s",
    ("kalman_error", "acceleration"): "m/s^2/sqrt(Hz)",
}
"""Unit of a key of one kind that differs, by kind and key."""


def unit_of(kind: str, key: str) -> str:
    """Return the unit of a key of a part; "-" for a key of another package."""
    return OWN_UNITS.get((kind, key)) or UNITS.get(key, "-")


ARRAYS: Final[Mapping[str, tuple[str, str]]] = {
    "times": ("s", "(T + 1,) absolute times"),
    "poses": ("m, rad", "(T + 1, N, d + 1) positions and, last, heading of the velocity"),
    "twists": ("m/s, rad/s", "(T + 1, N, d + 1) velocities and, last, 0"),
    "accelerations": ("m/s^2", "(T, N, d), constant over each step"),
    "controls": ("of the response", "(T, N, d) controls of the committed manoeuvres"),
    "responses": ("", "(T, N) numbers of the response_parts of the committed manoeuvres"),
    "response_parts": ("", "responses as JSON: kind and fields, texts for names of the methods of peers"),
    "outcomes": ("", "(T, N) outcomes of the decisions, empty where none was due"),
    "decision_times": ("s", "(T, N) wall clock of the decisions"),
    "arrived": ("s", "(N,) absolute times of arrival, inf without one"),
    "appears": ("s", "(N,) absolute times before which robots are not there; none if all are there from the start"),
    "robots/*/goal_path/points": ("m", "(n, d) points of the path to the goal"),
    "robots/*/goal_path/speeds": ("m/s", "(n,) speeds at these points"),
    "holds": ("s", "holds of the methods that hold an acceleration"),
    "robots/*/velocity_bounds": ("1, m/s", "(n, d + 1) normals and, last, offsets of half-spaces"),
    "robots/*/acceleration_bounds": ("1, m/s^2", "(n, d + 1) normals and, last, offsets of half-spaces"),
    "obstacles/*/headings/times": ("s", "of the angles of a heading"),
    "obstacles/*/headings/angles": ("rad", "of the x axis of the shape"),
}
"""Units and meanings by the path of an array in the group of the run. A * stands for any part of a path.

Arrays of parts have the units of their keys, see `unit_of`.
"""


def units_of(path: str, kind: str | None = None) -> str:
    """Return the unit of the array at a path, "" for texts and for arrays of parts of other packages.

    Args:
        kind: of the part whose array it is; None: of no part.
    """
    if kind is not None:
        return unit_of(kind, path.rpartition("/")[2]).removeprefix("-")
    return next((unit for pattern, (unit, _) in ARRAYS.items() if fnmatchcase(path, pattern)), "")
