"""Records: rows of an array whose fields are numbers and small arrays, such as all that is known of one robot.

A kernel takes an array of records as one argument, and one record as a pointer. With one array for each field a
decision had 84 arrays, and a call of a kernel with all tables passed up to 900 numbers.

The length of an array in a record is a part of its type. `robot.position[:]` is of the type of any other array, for
which the callee is compiled once.
"""

from collections.abc import Hashable, Sequence
from functools import cache
from typing import Annotated, Any, Final, Protocol, TypeAlias, TypeVar, cast, get_args, get_type_hints, overload

import numpy as np

from slalom.kernels.arrays import Array, Flags, Indices

R = TypeVar("R")

Vector: TypeAlias = Annotated[Array, (3,)]
ControlPoints: TypeAlias = Annotated[Array, (4,)]

NUMBERS: Final[dict[Any, type[np.generic]]] = {float: np.float64, int: np.int64, bool: np.bool_}


class Records(Protocol[R]):
    """Records (n,): in kernels one of them by its number; elsewhere some of them, or a field of all by its name."""

    @overload
    def __getitem__(self, row: int) -> R: ...

    @overload
    def __getitem__(self, row: str) -> Any: ...

    @overload
    def __getitem__(self, row: slice | Indices | Flags) -> "Records[R]": ...

    def __setitem__(self, row: Any, value: Any) -> None: ...

    def __len__(self) -> int: ...

    def copy(self) -> "Records[R]":
        """The same records in an array of their own."""


@cache
def record_type(fields: Hashable) -> np.dtype[Any]:
    """The type of records with the annotated fields of a class: numbers, flags, and arrays annotated by their shape.

    Always the same object: numba knows the types of arguments by it.
    """
    listed: list[Any] = []
    for name, kind in get_type_hints(fields, include_extras=True).items():
        listed.append((name, NUMBERS[kind]) if kind in NUMBERS else (name, np.float64, get_args(kind)[1]))
    return np.dtype(listed, align=True)


def joined_records(parts: Sequence[Records[R]]) -> Records[R]:
    """The records of all parts, one part after the other."""
    return cast(Records[R], np.concatenate(cast(Sequence[Any], parts)))


def zero_records(fields: type[R], n: int) -> Records[R]:
    """Records (n,) with the annotated fields of a class, all 0."""
    return cast(Records[R], np.zeros(n, record_type(cast(Hashable, fields))))
