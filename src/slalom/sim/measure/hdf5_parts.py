"""Trajectories, shapes, bounds and limits as groups of an HDF5 file, and back."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any, Final, TypeVar

import numpy as np
import numpy.typing as npt

from slalom.bounds import BOUNDS
from slalom.checks import array, array_of, number, positive, shown
from slalom.errors import InvalidInput
from slalom.goal import Goal
from slalom.limits import HalfSpace, Limits
from slalom.obstacle import Headings, Obstacle
from slalom.path import Path
from slalom.path_goal import PathGoal
from slalom.shape import SHAPES, Shape, Union
from slalom.sim.measure.hdf5_tree import Group, Texts, Value
from slalom.tolerances import SHORTEST_PIECE
from slalom.trajectory import TRAJECTORIES, PiecewisePolynomial, Trajectory
from slalom.uncertainty import UNCERTAINTIES

FORMER_NAMES: Final = {
    "place": "initial_position",
    "speed": "initial_velocity",
    "push": "initial_acceleration",
}
"""Current names of fields of trajectories in format 1, which `load_part` uses if the class lacks the old name."""
HALF_SPACES: Final = ("velocity_bounds", "acceleration_bounds")
T = TypeVar("T")


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


def save_part(group: Any, part: Any, kinds: Mapping[str, type]) -> None:
    """Write the name of the part's class among `kinds`, and its fields."""
    group.attrs["kind"] = next(name for name, cls in kinds.items() if type(part) is cls)
    for item in fields(part):
        value = getattr(part, item.name)
        if isinstance(value, np.ndarray):
            group[item.name] = value
        elif value is not None:
            group.attrs[item.name] = value


def save_shape(group: Any, shape: Shape) -> None:
    """Write a shape, or a union of shapes as numbered groups."""
    if not isinstance(shape, Union):
        save_part(group, shape, SHAPES)
        return
    group.attrs["kind"] = "union"
    for k, part in enumerate(shape.shapes):
        save_shape(group.create_group(str(k)), part)


def as_polynomial(path: Path) -> PiecewisePolynomial:
    """Convert a path to cubic pieces in ascending powers of the time since the start of each piece."""
    p0, p1, p2, p3 = (path.points[:, j] for j in range(4))
    h = np.diff(path.times)
    powers = np.stack([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0], axis=1)
    return PiecewisePolynomial(h, powers / h[:, None, None] ** np.arange(4)[None, :, None], float(path.times[0]))


def member(members: Mapping[str, T], name: str) -> T:
    """Return a member of a group. Raises InvalidInput if there is none."""
    if name not in members:
        raise InvalidInput(f"{name}: expected it in the file, found none")
    return members[name]


def numbers(values: Mapping[str, Value], name: str) -> npt.NDArray[Any]:
    """Return the array of this name. Raises InvalidInput if there is none, or texts."""
    found = member(values, name)
    if isinstance(found, Texts):
        raise InvalidInput(f"{name}: expected numbers, found {shown(found.texts)}")
    return found


def scalar(values: Mapping[str, Value], name: str) -> Any:
    """Return the text or the number of this name. Raises InvalidInput if there is none, or an array."""
    found = member(values, name)
    if found.shape:
        raise InvalidInput(f"{name}: expected one value, found shape {found.shape}")
    return found.texts[0] if isinstance(found, Texts) else found[()]


def text(values: Mapping[str, Value], name: str) -> str:
    """Return the text of this name. Raises InvalidInput if there is none, or a number."""
    found = scalar(values, name)
    if not isinstance(found, str):
        raise InvalidInput(f"{name}: expected text, found {found!r}")
    return found


def listed(group: Group, name: str) -> list[Group]:
    """Return the groups 0, 1, ... of a group in their order; none if there is no such group."""
    found = group.groups.get(name, Group({}, {}, {})).groups
    return [member(found, str(k)) for k in range(len(found))]


def load_obstacle(group: Group) -> Obstacle:
    """Return an obstacle of a scenario."""
    doubt, over_time = group.groups.get("uncertainty"), group.groups.get("headings")
    # Files of older versions do not say it.
    at_rest = scalar(group.attributes, "contact_at_rest") if "contact_at_rest" in group.attributes else True
    return Obstacle(
        load_shape(member(group.groups, "shape")),
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
    lookahead = scalar(path.attributes, "lookahead")
    return PathGoal(numbers(path.datasets, "points"), speeds, tolerance, bool(stop), lookahead=lookahead)


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


def load_shape(group: Group) -> Shape:
    """Return a shape, or a union of shapes."""
    if text(group.attributes, "kind") == "union":
        return Union(tuple(load_shape(member(group.groups, str(k))) for k in range(len(group.groups))))
    shape: Shape = load_part(group, SHAPES)
    return shape


def load_part(group: Group, kinds: Mapping[str, type]) -> Any:
    """Return a part of one of `kinds`, whose constructor checks the values."""
    kind = member(kinds, text(group.attributes, "kind"))
    known = {item.name for item in fields(kind)}
    values: dict[str, Any] = {
        **{name: _value(value) for name, value in group.attributes.items() if name != "kind"},
        **{name: _value(value) for name, value in group.datasets.items()},
    }
    given = {name if name in known else FORMER_NAMES.get(name, name): value for name, value in values.items()}
    needed = {item.name for item in fields(kind) if item.default is MISSING and item.default_factory is MISSING}
    if not needed <= set(given) <= known:
        raise InvalidInput(f"{kind.__name__}: expected {', '.join(sorted(known))}, found {shown(sorted(given))}")
    return kind(**given)


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


def texts(run: Group, name: str, *shape: int) -> tuple[tuple[str, ...], ...]:
    """Return the texts (T, N) of each step and robot."""
    found = member(run.datasets, name)
    if not isinstance(found, Texts) or found.shape != shape:
        raise InvalidInput(f"{name}: expected texts of shape {shape}, found {type(found).__name__} of {found.shape}")
    steps, n = shape
    return tuple(tuple(found.texts[k * n : (k + 1) * n]) for k in range(steps))
