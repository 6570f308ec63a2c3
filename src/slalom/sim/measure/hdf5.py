"""Trajectories, shapes, bounds and limits as groups of an HDF5 file, and back."""

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import h5py
import numpy as np
import numpy.typing as npt

from slalom.base.checks import array, array_of, number, positive, shown
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.registry import from_plain, to_plain
from slalom.io.table import file_size
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
from slalom.sim.measure.units import units_of

# ---------------------------------------------------------------------------------------------------------------------
# Content of HDF5 files, read in another process, which a malformed file can neither hang nor crash for the caller.


HDF5_CONTENT: Final = 50_000_000
"""[B] Content of an HDF5 file that is larger than the file: one that is compressed or has empty parts.

Larger: a file of a few kilobytes takes gigabytes. Smaller: files that other programs compressed are refused.
"""

HDF5_MEMORY: Final = 400_000_000
"""[B] Memory of the process that reads an HDF5 file, in addition to four times the size of the file.

Larger: malformed files take more memory until they are refused. Smaller: valid files are refused.
"""

HDF5_SECONDS: Final = 0.6
"""[s] Processor time to read an HDF5 file, in addition to that of HDF5_RATE.

Larger: a malformed file on which reading does not end is refused later. Smaller: slow computers refuse valid files.
"""

HDF5_RATE: Final = 1e6
"""[B/s] Least speed of reading HDF5, in processor time; many small groups are read at five times as much.

Larger: slow computers refuse valid files. Smaller: large malformed files are refused later.
"""

HDF5_WAIT: Final = 20.0
"""[1] Longest time to read an HDF5 file, as a multiple of the allowed processor time.

Larger: a file on a drive that does not answer is refused later. Smaller: a busy computer refuses valid files.
"""

HDF5_DEPTH: Final = 32
"""[1] Groups within groups of an HDF5 file. Larger: recursion may end in an error. Smaller: unions are refused."""


CHILD: Final = Path(__file__).with_name("hdf5_child.py")
KIND: Final = "HDF5 recording"


class Texts(NamedTuple):
    """Texts of an attribute or a dataset in the order of its elements, and its shape."""

    texts: list[str]
    shape: tuple[int, ...]


Value = npt.NDArray[Any] | Texts


@dataclass(frozen=True)
class Group:
    """Attributes, groups and datasets of a group by name."""

    attributes: dict[str, Value]
    groups: dict[str, "Group"]
    datasets: dict[str, Value]


class Reader:
    """The process that reads HDF5 files for this one, started when it is needed and after a file that it did not read.

    Threads take turns. A process that was forked starts its own.
    """

    def __init__(self, program: Path) -> None:
        self.program = program
        self.forget()

    def forget(self) -> None:
        """Leave the process to the one that started it."""
        self.turn = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def read(self, path: Path, size: int) -> tuple[dict[str, Any], list[npt.NDArray[Any]]]:
        """Return the line and the arrays of the answer for a file of `size` bytes; the line may hold a `mistake`."""
        seconds, memory = HDF5_SECONDS + size / HDF5_RATE, int(HDF5_MEMORY) + 4 * size
        request = [os.path.abspath(path), max(int(HDF5_CONTENT), size), HDF5_DEPTH, seconds, memory]
        with self.turn:
            process, late = self._started(), threading.Event()

            def end() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(HDF5_WAIT * seconds, end)
            timer.start()
            try:
                reply, arrays = self._exchange(process, request)
            except BrokenPipeError:
                reply, arrays = {}, []
            finally:
                timer.cancel()
            if "tree" in reply and len(arrays) == len(reply["arrays"]):
                return reply, arrays
            code = self.close()
        if late.is_set():
            reply = {"mistake": f"one on which reading takes more than {HDF5_WAIT * seconds:.1f} s"}
        elif code < 0 and signal.Signals(-code).name == "SIGPROF":
            reply = {"mistake": f"one on which reading takes more than {seconds:.1f} s of processor time"}
        return reply if "mistake" in reply else {"mistake": "one on which the HDF5 library crashes"}, []

    def _exchange(
        self, process: "subprocess.Popen[bytes]", request: list[Any]
    ) -> tuple[dict[str, Any], list[npt.NDArray[Any]]]:
        """Return the bytes that the process writes; fewer than an answer if it ends before."""
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(request).encode() + b"\n")
        process.stdin.flush()
        line = process.stdout.readline()
        reply = json.loads(line) if line.endswith(b"\n") else {}
        arrays = []
        for name, shape in reply.get("arrays", ()):
            array = np.empty(shape, np.dtype(name))
            body = process.stdout.read(array.nbytes) if array.size else b""
            if len(body) < array.nbytes:
                break
            array[...] = np.frombuffer(body, array.dtype).reshape(shape)
            arrays.append(array)
        return reply, arrays

    def _started(self) -> "subprocess.Popen[bytes]":
        if self.process is None:
            # A thread of OpenBLAS takes address space, which counts as memory.
            self.process = subprocess.Popen(
                [sys.executable, "-P", str(self.program)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )
        return self.process

    def close(self) -> int:
        """End the process and return its exit code; the next file starts another."""
        process, self.process = self.process, None
        if process is None:
            return 0
        for stream in (process.stdin, process.stdout):
            assert stream is not None
            with contextlib.suppress(BrokenPipeError):
                stream.close()
        return process.wait()


READER: Final = Reader(CHILD)
atexit.register(READER.close)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=READER.forget)


def read_tree(path: Path) -> Group:
    """Return the whole content of an HDF5 file that consists of groups, numbers and texts.

    The process that reads it has a limit of processor time and of memory. Its start takes about 0.2 s; it reads
    further files.

    Raises:
        InvalidFile: no such file, no HDF5, links, objects that occur twice, other types, content far larger than the
            file, a file on which reading does not end within its limits.
    """
    reply, arrays = READER.read(path, file_size(path, KIND))
    if "mistake" in reply:
        raise InvalidFile([f"{path}: expected an {KIND}, found {reason(OSError(reply['mistake']))}"])
    return _group(reply["tree"], arrays)


def _group(tree: dict[str, Any], arrays: list[npt.NDArray[Any]]) -> Group:
    """Return a group whose values are arrays and texts."""

    def value(stored: Any) -> Value:
        return arrays[stored] if isinstance(stored, int) else Texts(stored["texts"], tuple(stored["shape"]))

    return Group(
        {name: value(stored) for name, stored in tree["attributes"].items()},
        {name: _group(inner, arrays) for name, inner in tree["groups"].items()},
        {name: value(stored) for name, stored in tree["datasets"].items()},
    )


# ---------------------------------------------------------------------------------------------------------------------
# Trajectories, shapes, bounds and limits as groups of an HDF5 file, and back.


SHORTEST_PIECE: Final = 1e-9
"""[s] Shortest cubic piece that stands in a file for a trajectory of a kind that files do not have.

Larger: a trajectory that ends at once lasts longer. Smaller: rounding of large times leaves no duration.
"""


FORMER_NAMES: Final = {
    "place": "initial_position",
    "speed": "initial_velocity",
    "push": "initial_acceleration",
}
"""Names of fields of trajectories by their names in format 1."""
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
