"""HDF5 files made to hang, to crash or to mislead, and programs in place of the HDF5 library."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import h5py
import numpy as np

from slalom import METHODS
from slalom.io import hdf5
from slalom.io.hdf5 import HDF5_CONTENT, HDF5_DEPTH
from slalom.io.hdf5_child import Content
from slalom.sim import Recording, simulate
from slalom.sim.gallery import build


def write_run(path: Path) -> None:
    """A recording of a short run."""
    path.write_bytes(good_run())


@cache
def good_run() -> bytes:
    """The file of a short run."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        simulate(build("head_on", {"duration": 0.3}), METHODS["nao"]).save(path)
        return path.read_bytes()


def replaced(run: h5py.Group, name: str, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Replace an array by what `change` makes of it."""
    values = run[name][:]
    del run[name]
    run[name] = change(values)


def nested(group: h5py.Group, depth: int) -> None:
    """Make groups within groups."""
    for _ in range(depth):
        group = group.create_group("0")


def with_hole(values: np.ndarray) -> np.ndarray:
    """The same with one nan."""
    values.flat[-1] = np.nan
    return values


def outside(group: h5py.Group, name: str) -> None:
    """Replace an array by one whose values are in a device without end."""
    del group[name]
    group.create_dataset(name, (10**6,), "f8", external=[("/dev/zero", 0, h5py.h5f.UNLIMITED)])


def virtual(group: h5py.Group, name: str) -> None:
    """Replace an array by one that is made of another file."""
    layout = h5py.VirtualLayout(shape=(10,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "times", shape=(10,))
    del group[name]
    group.create_virtual_dataset(name, layout)


def again(group: h5py.Group, name: str, link: object) -> None:
    """Replace a member by a link."""
    del group[name]
    group[name] = link


OF_LIBRARY = {
    "a group that contains itself": (lambda r: again(r, "robots", r), "an object that occurs twice"),
    "a shape that contains itself": (
        lambda r: r["robots/0/shape"].__setitem__("0", r["robots/0/shape"]),
        "an object that occurs twice",
    ),
    "an array twice": (lambda r: again(r, "twists", r["poses"]), "an object that occurs twice"),
    "a loop of links": (lambda r: again(r, "times", h5py.SoftLink("/run_0/times")), "'times' that is a link"),
    "a link to a file": (lambda r: again(r, "times", h5py.ExternalLink("/dev/zero", "/")), "'times' that is a link"),
    "values of a device": (lambda r: outside(r, "times"), "'times' whose values are in other files"),
    "values of another file": (lambda r: virtual(r, "times"), "'times' whose values are in other files"),
    "empty terabytes": (
        lambda r: r.create_dataset("more", (10**6, 10**6), "f8", chunks=(100, 100)),
        "content far larger than the file",
    ),
    "two empty gigabytes": (
        lambda r: r.create_dataset("more", (10**8, 3), "f8", chunks=(1000, 3)),
        "content far larger than the file",
    ),
    "deep groups": (lambda r: nested(r, 100), "groups nested more than 32 times"),
    "other values": (lambda r: r.create_dataset("more", data=np.zeros(3, "c16")), "neither numbers nor texts"),
    "no value": (lambda r: r.attrs.create("seed", h5py.Empty("f8")), "'seed' without a value"),
    "a type": (lambda r: r.__setitem__("more", np.dtype("f8")), "'more' that is neither a group nor an array"),
}
"""Changes of a good run that the process which reads it refuses, and what it says."""

OF_RECORDING = {
    "an infinite seed": (lambda r: r.attrs.create("seed", np.inf), "seed: expected finite numbers, found"),
    "half a seed": (lambda r: r.attrs.create("seed", 0.5), "seed: expected a whole number of 0 or more, found 0.5"),
    "several seeds": (lambda r: r.attrs.create("seed", [1, 2]), r"seed: expected one value, found shape \(2,\)"),
    "a seed in words": (lambda r: r.attrs.create("seed", "one"), "seed: expected numbers, found 'one'"),
    "a name that is a number": (lambda r: r.attrs.create("method", 5), "method: expected text, found"),
    "no time step": (lambda r: r.attrs.create("time_step", 0.0), "time_step: expected a number above 0, found 0"),
    "poses that are no numbers": (lambda r: replaced(r, "poses", with_hole), "poses: expected finite numbers"),
    "times that stand": (lambda r: replaced(r, "times", np.zeros_like), "times: expected increasing times"),
    "texts for times": (lambda r: again(r, "times", "noon"), "times: expected numbers, found"),
    "numbers for texts": (lambda r: again(r, "outcomes", 1.0), "outcomes: expected texts of shape"),
    "fewer times": (lambda r: replaced(r, "times", lambda v: v[1:]), "poses: expected an array of shape"),
    "fewer poses": (lambda r: replaced(r, "poses", lambda v: v[1:]), "poses: expected an array of shape"),
    "flat poses": (lambda r: replaced(r, "poses", lambda v: v[0, 0]), "poses: expected an array .*, found shape"),
    "poses on a line": (lambda r: replaced(r, "poses", lambda v: v[..., :2]), "poses: expected an array .*, found"),
    "fewer responses": (lambda r: replaced(r, "outcomes", lambda v: v[1:]), "outcomes: expected texts of shape"),
    "responses without a part": (
        lambda r: replaced(r, "responses", lambda v: v + 5),
        "responses: expected numbers of the . response_parts, found 5 to ",
    ),
    "numbers with fractions": (
        lambda r: replaced(r, "responses", lambda v: v + 0.5),
        "responses: expected whole numbers of shape .*, found float64",
    ),
    "no response parts": (lambda r: r.__delitem__("response_parts"), "response_parts: expected it in the file"),
    "numbers for response parts": (lambda r: again(r, "response_parts", [1.0]), "response_parts: expected a list of"),
    "no JSON": (lambda r: again(r, "response_parts", ["{"]), r"response_parts\[0\]: expected JSON, found '{'"),
    "a list for a part": (lambda r: again(r, "response_parts", ["[]"]), r"response_parts\[0\]: expected a mapping or"),
    "an unknown response": (
        lambda r: again(r, "response_parts", ['{"kind": "Jump"}']),
        r"response_parts\[0\]: kind: expected one of Velocity, .*, found 'Jump'",
    ),
    "a negative hold": (
        lambda r: again(r, "response_parts", ['{"kind": "AccelerateThenCoast", "hold": -1}']),
        r"response_parts\[0\]: hold: expected a number above 0, found -1",
    ),
    "more arrivals": (lambda r: replaced(r, "arrived", lambda v: np.zeros(9)), "arrived: expected an array of shape"),
    "another dimension": (
        lambda r: replaced(r["robots/0/goal"], "position", lambda v: np.zeros(3)),
        r"goals: expected 2 dimensions, found \[3\]",
    ),
    "an unknown field": (lambda r: r["robots/0/shape"].attrs.create("colour", 1.0), "Disc: expected radius, found"),
    "a field twice": (
        lambda r: r["robots/0/goal"].attrs.create("initial_position", [0.0, 0.0]),
        r"Stationary: expected initial_position, found \['initial_position', 'position'\]",
    ),
    "a period": (lambda r: r.attrs.create("period", [9.0, 9.0]), "period: expected none, found one of a world"),
}
"""Changes of a good run that are no recording, and what is said of them."""


def changed(what: str, folder: Path) -> Path:
    """A good run with one of the changes."""
    path = folder / "a.h5"
    write_run(path)
    change, _ = {**OF_LIBRARY, **OF_RECORDING}[what]
    with h5py.File(path, "r+") as file:
        change(file["run_0"])
    return path


def read_here(path: Path, most: int = int(HDF5_CONTENT)) -> Content:
    """Read a file as the process does that reads it."""
    with h5py.File(path) as file:
        return Content(file, most, HDF5_DEPTH)


def read_with(program: str, folder: Path) -> Recording:
    """Read a good run with a program in place of the HDF5 library, and little time."""
    child = hdf5.CHILD.read_text()
    place = "    try:\n        with h5py"
    assert child.count(place) == 1
    (folder / "child.py").write_text(child.replace(place, f"    {program}\n{place}"))
    write_run(folder / "a.h5")
    with patch.object(hdf5, "CHILD", folder / "child.py"), patch.object(hdf5, "HDF5_SECONDS", 0.05):
        return Recording.load(folder / "a.h5")
