"""Reader of HDF5 files, which runs in the process of `io.limited`: it imports nothing of slalom.

A tree has `attributes`, `groups` and `datasets` by name. A value is the number of its array, or `texts` and `shape`.
An array of records is a group with an array for each field.
"""

from typing import Any

import h5py
import numpy as np

NUMERIC = "biuf"


class Refused(Exception):
    """Content that no recording has; the message states it."""


class Content:
    """The content of a file: a tree, and the arrays to which its values refer.

    Args:
        most: [B] largest size of all values together. depth: largest number of groups within groups.
    """

    def __init__(self, file: Any, most: int, depth: int) -> None:
        self.left, self.depth = most, depth
        self.arrays: list[Any] = []
        self.seen: set[Any] = set()
        self.tree = self.group(file, 0)

    def group(self, group: Any, level: int) -> dict[str, Any]:
        """Return the attributes and the members of a group."""
        self.once(group)
        if level > self.depth:
            raise Refused(f"groups nested more than {self.depth} times")
        attributes = {name: self.attribute(group.attrs, name) for name in group.attrs}
        found: dict[str, Any] = {"attributes": attributes, "groups": {}, "datasets": {}}
        for name in group:
            # Links by name may point to other files, to themselves or to nothing.
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise Refused(f"{name!r} that is a link")
            member = group[name]
            if isinstance(member, h5py.Group):
                found["groups"][name] = self.group(member, level + 1)
            elif isinstance(member, h5py.Dataset) and member.dtype.names:
                found["groups"][name] = self.records(member, name)
            elif isinstance(member, h5py.Dataset):
                found["datasets"][name] = self.dataset(member, name)
            else:
                raise Refused(f"{name!r} that is neither a group nor an array")
        return found

    def once(self, thing: Any) -> None:
        """Refuse an object that has occurred before: a loop never ends, and other repetitions multiply."""
        address = h5py.h5o.get_info(thing.id).addr
        if address in self.seen:
            raise Refused("an object that occurs twice")
        self.seen.add(address)

    def attribute(self, attributes: Any, name: str) -> Any:
        """Return the value of an attribute."""
        handle = attributes.get_id(name)
        self.count(name, handle.dtype, handle.shape)
        value = attributes[name]
        if isinstance(value, str):
            return self.texts([value], ())
        return self.value(name, np.asarray(value), handle.dtype)

    def records(self, dataset: Any, name: str) -> dict[str, Any]:
        """Return the attributes and the fields of an array of records."""
        values = self.values(dataset, name)
        attributes = {key: self.attribute(dataset.attrs, key) for key in dataset.attrs}
        fields = {field: self.value(field, values[field], dataset.dtype[field]) for field in dataset.dtype.names}
        return {"attributes": attributes, "groups": {}, "datasets": fields}

    def dataset(self, dataset: Any, name: str) -> Any:
        """Return the value of an array."""
        return self.value(name, self.values(dataset, name), dataset.dtype)

    def values(self, dataset: Any, name: str) -> Any:
        """Return the elements of an array."""
        self.once(dataset)
        if dataset.external or dataset.is_virtual:
            raise Refused(f"{name!r} whose values are in other files")
        self.count(name, dataset.dtype, dataset.shape)
        return np.asarray(dataset[()])

    def count(self, name: str, dtype: Any, shape: Any) -> None:
        """Subtract the size of a value from the remaining size; it may be much larger than its part of the file."""
        if shape is None:
            raise Refused(f"{name!r} without a value")
        self.left -= int(dtype.itemsize) * int(np.prod(shape, dtype=object))
        if self.left < 0:
            raise Refused("content far larger than the file")

    def value(self, name: str, values: Any, dtype: Any) -> Any:
        """Return the texts, or the number of the array."""
        if h5py.check_string_dtype(dtype) is not None:
            flat = values.ravel().tolist()
            return self.texts([t.decode() if isinstance(t, bytes) else str(t) for t in flat], values.shape)
        if values.dtype.kind not in NUMERIC:
            raise Refused(f"{name!r} with values that are neither numbers nor texts")
        self.arrays.append(np.ascontiguousarray(values).reshape(values.shape))
        return len(self.arrays) - 1

    def texts(self, texts: list[str], shape: Any) -> dict[str, Any]:
        """Return texts; their lengths count, since many may refer to the same one."""
        self.left -= sum(map(len, texts))
        if self.left < 0:
            raise Refused("content far larger than the file")
        return {"texts": texts, "shape": list(shape)}


def read(path: str, most: int, depth: int) -> tuple[dict[str, Any], list[Any]]:
    """Return the tree of a file and its arrays. Raises Refused, and what h5py raises."""
    try:
        with h5py.File(path, "r") as file:
            content = Content(file, most, depth)
    except OSError as error:
        other = "file signature not found" in str(error)
        raise Refused("a file of another kind" if other else str(error)) from None
    return content.tree, content.arrays
