"""Trajectories, shapes, bounds and limits as groups of an HDF5 file, and back, with the units of all arrays."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any, Final

import h5py
import numpy as np
import numpy.typing as npt

from slalom.base.checks import array, array_of, number, positive
from slalom.base.errors import InvalidInput
from slalom.base.registry import from_plain, to_plain
from slalom.io.hdf5 import Group, Texts, Value, member, numbers, scalar, text
from slalom.model.bounds import BOUNDS
from slalom.model.goal import Goal
from slalom.model.limits import HalfSpace, Limits
from slalom.model.path import Path as CubicPath
from slalom.model.path_goal import PathGoal
from slalom.model.shape import SHAPES
from slalom.model.trajectory import TRAJECTORIES, PiecewisePolynomial, Trajectory
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.obstacle import Headings, Obstacle
from slalom.sim.measure.responses import RecordedResponses
from slalom.sim.tasks import COLUMNS

UNITS: Final[Mapping[str, str]] = {
    key: unit
    for unit, keys in {
        "m": "by center corner corners end enough enough_clearance first high last least length low "
        "min_distance points position positions radius spacing start width",
        "m/s": "speed velocity",
        "m/s^2": "acceleration braking forward half_widths lateral",
        "m, m/s, m/s^2, ...": "coefficients",
        "s": "at durations times",
        "rad": "half_angle phase",
        "1": "correlation heading normal probability",
        "-": "columns frame interpolation parts seed shapes then",
    }.items()
    for key in keys.split()
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
    "tasks": ("s, m", f"(n, {len(COLUMNS)}) of tasks: {', '.join(COLUMNS)}; inf before a time, -1 without a robot"),
    "robots/*/goal_path/points": ("m", "(n, d) points of the path to the goal"),
    "robots/*/goal_path/speeds": ("m/s", "(n,) speeds at these points"),
    "holds": ("s", "holds of the methods that hold an acceleration"),
    "robots/*/velocity_bounds": ("1, m/s", "(n, d + 1) normals and, last, offsets of half-spaces"),
    "robots/*/acceleration_bounds": ("1, m/s^2", "(n, d + 1) normals and, last, offsets of half-spaces"),
    "obstacles/*/headings/times": ("s", "of the angles of a heading"),
    "obstacles/*/headings/angles": ("rad", "of the x axis of the shape"),
}
"""Units and meanings by the path of an array in the group of the run. A * stands for any part of a path. Arrays of
parts have the units of their keys, see `unit_of`."""


def units_of(path: str, kind: str | None = None) -> str:
    """Return the unit of the array at a path, "" for texts and for arrays of parts of other packages.

    Args:
        kind: of the part whose array it is; None: of no part.
    """
    if kind is not None:
        return unit_of(kind, path.rpartition("/")[2]).removeprefix("-")
    return next((unit for pattern, (unit, _) in ARRAYS.items() if fnmatchcase(path, pattern)), "")


SHORTEST_PIECE: Final = 1e-9
"""[s] Shortest cubic piece that stands in a file for a trajectory of a kind that files do not have. Larger: a
trajectory that ends at once lasts longer. Smaller: rounding of large times leaves no duration."""


FORMER_NAMES: Final = {"place": "initial_position", "speed": "initial_velocity", "push": "initial_acceleration"}
"""Names of fields of trajectories by their names in format 1."""
HALF_SPACES: Final = ("velocity_bounds", "acceleration_bounds")


def save_trajectory(group: Any, trajectory: Trajectory, start: float, end: float) -> None:
    """Write the kind of the trajectory and its fields; reading gives the same curve to the bit.

    A kind that is not in TRAJECTORIES (a composite, a Python function, a user's class) is saved as cubic pieces over
    the run. They are within the error of its path.
    """
    save_part(group, in_files(trajectory, start, end), TRAJECTORIES)


def in_files(trajectory: Trajectory, start: float, end: float) -> Trajectory:
    """The trajectory; its cubic pieces from start to end [s] if it is of a kind that files do not have."""
    if type(trajectory) in TRAJECTORIES.values():
        return trajectory
    first, last = max(start, trajectory.span[0]), min(end, trajectory.span[1])
    return as_polynomial(trajectory.path(first, max(last, first + SHORTEST_PIECE)))


def save_part(group: Any, part: Any, kinds: Mapping[str, type], where: str = "part") -> None:
    """Write the kind of a part and its fields, see `base.registry.to_plain`; parts in it as numbered groups."""
    save_plain(group, to_plain(part, kinds, where))


def save_plain(group: Any, plain: Mapping[str, Any]) -> None:
    """Write a mapping of `to_plain`: lists of numbers as arrays, mappings as groups, all else as attributes."""
    for key, value in plain.items():
        if isinstance(value, Mapping):
            save_plain(group.create_group(key), value)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            for k, one in enumerate(value):
                save_plain(group.create_group(f"{key}/{k}"), one)
        elif isinstance(value, list):
            group[key] = np.array(value, dtype=np.float64)
        elif value is not None:
            group.attrs[key] = value


def as_polynomial(path: CubicPath) -> PiecewisePolynomial:
    """Convert a path to cubic pieces in ascending powers of the time since the start of each piece."""
    p0, p1, p2, p3 = (path.points[:, j] for j in range(4))
    h = np.diff(path.times)
    powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
    return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(path.times[0]))


def listed(group: Group, name: str) -> list[Group]:
    """Return the groups 0, 1, ... of a group in their order; none if there is no such group."""
    return in_order(group.groups.get(name, Group({}, {}, {})))


def in_order(group: Group) -> list[Group]:
    """Return the groups 0, 1, ... in a group."""
    return [member(group.groups, str(k)) for k in range(len(group.groups))]


def load_obstacle(group: Group) -> Obstacle:
    """Return an obstacle of a scenario."""
    doubt, over_time = group.groups.get("uncertainty"), group.groups.get("headings")
    # Files of older versions do not say it.
    at_rest = scalar(group.attributes, "contact_at_rest") if "contact_at_rest" in group.attributes else True
    return Obstacle(
        load_part(member(group.groups, "shape"), SHAPES),
        load_part(member(group.groups, "trajectory"), TRAJECTORIES),
        text(group.attributes, "name"),
        scalar(group.attributes, "heading") if over_time is None else _headings(over_time),
        None if doubt is None else load_part(doubt, UNCERTAINTIES),
        contact_at_rest=at_rest,
    ).of_scenario()


def _headings(group: Group) -> Headings:
    return Headings(numbers(group.datasets, "times"), numbers(group.datasets, "angles"))


def load_goal(group: Group) -> Goal:
    """Return the goal of the group of a robot."""
    trajectory = load_part(member(group.groups, "goal"), TRAJECTORIES)
    tolerance, stop = (scalar(group.attributes, name) for name in ("goal_tolerance", "goal_stop"))
    path = group.groups.get("goal_path")  # files of older versions hold only the end of a path
    if path is None:
        return Goal(trajectory, tolerance, bool(stop))
    speeds = numbers(path.datasets, "speeds") if "speeds" in path.datasets else None
    further: dict[str, Any] = {name: scalar(path.attributes, name) for name in path.attributes}
    further |= {"laps": round(further.get("laps", 1))}  # files of older versions have no laps and no cut
    return PathGoal(numbers(path.datasets, "points"), speeds, tolerance, bool(stop), **further)


def load_limits(group: Group, dimension: int) -> Limits:
    """Return the limits of the group of a robot."""
    velocity_bounds, acceleration_bounds = (_half_spaces(group, name, dimension) for name in HALF_SPACES)
    max_speed, max_acceleration = (scalar(group.attributes, name) for name in ("max_speed", "max_acceleration"))
    bounds = tuple(load_part(bound, BOUNDS) for bound in listed(group, "bounds"))
    return Limits(max_speed, max_acceleration, velocity_bounds, acceleration_bounds, bounds)


def _half_spaces(group: Group, name: str, dimension: int) -> tuple[HalfSpace, ...]:
    stored = numbers(group.datasets, name)
    rows = array_of(stored, name, (len(stored) if stored.ndim else 0, dimension + 1))
    return tuple(HalfSpace(row[:-1], float(row[-1])) for row in rows)


def load_part(group: Group, kinds: Mapping[str, type]) -> Any:
    """Return a part of one of `kinds`, whose constructor checks the values."""
    return from_plain(_plain(group), kinds, FORMER_NAMES)


def _plain(group: Group) -> dict[str, Any]:
    """Return the kind and fields of a part, and of the parts in it."""
    found = {name: _value(value) for name, value in (*group.attributes.items(), *group.datasets.items())}
    # Formats 1 and 2 have the shapes of a union without a group around them.
    inside = {"shapes": Group({}, group.groups, {})} if "0" in group.groups else group.groups
    for name, one in inside.items():
        is_part = "kind" in one.attributes
        found[name] = _plain(one) if is_part else [_plain(each) for each in in_order(one)]
    return found


def _value(value: Value) -> Any:
    """Return a value as the constructor of a part expects it: a text, a number, or an array."""
    if isinstance(value, Texts):
        return value.texts if value.shape else value.texts[0]
    return value if value.shape else value[()]


def named_numbers(group: Group) -> dict[str, float]:
    """Return the attributes of a group, each of which is a number."""
    return {name: number(scalar(group.attributes, name), name) for name in group.attributes}


def load_holds(run: Group) -> tuple[float, ...]:
    """Return the holds [s]; none if the file states none."""
    if "holds" not in run.datasets:
        return ()
    return tuple(positive(hold, "holds") for hold in array(numbers(run.datasets, "holds"), "holds").ravel().tolist())


def unbounded(run: Group, name: str, *shape: int) -> npt.NDArray[np.float64]:
    """Return an array of this shape, whose numbers may be infinite or nan: no arrival, no control of a peer."""
    found = np.asarray(numbers(run.datasets, name), dtype=np.float64)
    if found.shape != shape:
        raise InvalidInput(f"{name}: expected an array of shape {shape}, found shape {found.shape}")
    return found


def load_tasks(run: Group, robots: int) -> npt.NDArray[np.float64] | None:
    """Return the tasks (n, COLUMNS) of a run with that number of robots; None for one without tasks."""
    if "tasks" not in run.datasets:
        return None
    found = unbounded(run, "tasks", len(np.atleast_1d(numbers(run.datasets, "tasks"))), len(COLUMNS))
    served = found[:, 3]
    if np.isnan(found).any() or not np.isin(served, np.arange(-1, robots)).all():
        raise InvalidInput(f"tasks: expected times, and robots from -1 to {robots - 1}, found others")
    return found


def load_responses(run: Group, steps: int, n: int) -> RecordedResponses:
    """Return the responses (steps, n)."""
    parts = member(run.datasets, "response_parts")
    # An array without elements has no texts.
    found = parts.texts if isinstance(parts, Texts) else [] if parts.size == 0 else None
    if found is None or len(parts.shape) != 1:
        raise InvalidInput(f"response_parts: expected a list of texts, found shape {parts.shape}")
    return RecordedResponses.from_json(found, numbers(run.datasets, "responses"), (steps, n))


def texts(run: Group, name: str, *shape: int) -> tuple[tuple[str, ...], ...]:
    """Return the texts (T, N) of each step and robot."""
    found = member(run.datasets, name)
    if not isinstance(found, Texts) or found.shape != shape:
        raise InvalidInput(f"{name}: expected texts of shape {shape}, found {type(found).__name__} of {found.shape}")
    steps, n = shape
    return tuple(tuple(found.texts[k * n : (k + 1) * n]) for k in range(steps))


def add_units(run: Any) -> None:
    """Give every array in the group of a run the attribute `units`."""

    def add(name: str, member: Any) -> None:
        if isinstance(member, h5py.Dataset):
            member.attrs["units"] = units_of(name, member.parent.attrs.get("kind"))

    run.visititems(add)
