"""Units and meanings of the arrays in the HDF5 files of runs."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any, Final

import h5py

ARRAYS: Final[Mapping[str, tuple[str, str]]] = {
    "times": ("s", "(T + 1,) absolute times"),
    "poses": ("m, rad", "(T + 1, N, d + 1) positions and, last, heading of the velocity"),
    "twists": ("m/s, rad/s", "(T + 1, N, d + 1) velocities and, last, 0"),
    "accelerations": ("m/s^2", "(T, N, d), constant over each step"),
    "controls": ("of the response", "(T, N, d) controls of the committed manoeuvres"),
    "responses": ("", "(T, N) responses of the committed manoeuvres as text, names of the methods of peers"),
    "outcomes": ("", "(T, N) outcomes of the decisions, empty where none was due"),
    "decision_times": ("s", "(T, N) wall clock of the decisions"),
    "arrived": ("s", "(N,) absolute times of arrival, inf without one"),
    "holds": ("s", "holds of the methods that hold an acceleration"),
    "robots/*/velocity_bounds": ("1, m/s", "(n, d + 1) normals and, last, offsets of half-spaces"),
    "robots/*/acceleration_bounds": ("1, m/s^2", "(n, d + 1) normals and, last, offsets of half-spaces"),
    "robots/*/bounds/*/half_widths": ("m/s or m/s^2, as what is bounded", "of a box"),
    "robots/*/bounds/*/corners": ("m/s or m/s^2, as what is bounded", "of a polygon"),
    "robots/*/bounds/*/heading": ("1", "direction of the heading"),
    "obstacles/*/headings/times": ("s", "of the angles of a heading"),
    "obstacles/*/headings/angles": ("rad", "of the x axis of the shape"),
    "*/initial_position": ("m", "of a trajectory"),
    "*/initial_velocity": ("m/s", "of a trajectory"),
    "*/initial_acceleration": ("m/s^2", "of a trajectory"),
    "*/center": ("m", "of a circle"),
    "*/normal": ("1", "of the plane of a circle"),
    "*/times": ("s", "of a sampled trajectory"),
    "*/positions": ("m", "of a sampled trajectory"),
    "*/durations": ("s", "of the pieces of a polynomial"),
    "*/coefficients": ("m, m/s, m/s^2, ...", "of the pieces, in ascending powers of the time since their start"),
    "*/corners": ("m", "of a shape"),
    "*/points": ("m", "of a shape"),
    "*/start": ("m", "of a capsule"),
    "*/end": ("m", "of a capsule"),
}
"""Units and meanings by the path of an array in the group of the run. A * stands for any part of a path; the first
that fits counts."""


def units_of(path: str) -> str:
    """Return the unit of the array at a path, "" for texts and for arrays of parts of other packages."""
    return next((unit for pattern, (unit, _) in ARRAYS.items() if fnmatchcase(path, pattern)), "")


def add_units(run: Any) -> None:
    """Give every array in the group of a run the attribute `units`."""

    def add(name: str, member: Any) -> None:
        if isinstance(member, h5py.Dataset):
            member.attrs["units"] = units_of(name)

    run.visititems(add)
