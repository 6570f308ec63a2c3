"""Settings of each robot of a fleet: method, shape, limits, margin, priority and world."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from slalom.checks import LIMITS, METHOD, SHAPE, Array, each_number, has, listing, text, whole, whole_numbers
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Indices
from slalom.limits import Limits
from slalom.methods import Method
from slalom.shape import Shape
from slalom.tolerances import PRIORITY_RATIO

T = TypeVar("T")


class Members(NamedTuple):
    """The n robots of a fleet."""

    methods: list[Method]  # among robots
    shapes: list[Shape]
    limits: list[Limits]
    names: list[str]
    margins: Array  # (n,) [m] from obstacles
    priorities: Array  # (n,)
    worlds: Indices  # (n,)


def members_of(
    method: Method | Sequence[Method],
    shapes: Shape | Sequence[Shape],
    limits: Limits | Sequence[Limits],
    robots: int | None,
    names: Sequence[str] | None,
    margin: npt.ArrayLike,
    priority: npt.ArrayLike,
    worlds: npt.ArrayLike | None,
) -> Members:
    """The robots of a fleet, see `Fleet`.

    Raises:
        InvalidInput: sequences of different lengths, equal names, a method for one robot alone, values out of range, a
            priority among robots whose method does not share the avoidance.
    """
    n = _count((method, shapes, limits), robots)
    for k, (shape, each) in enumerate(zip(_each(shapes, n), _each(limits, n))):
        has(shape, *SHAPE, f"shapes[{k}]")
        has(each, *LIMITS, f"limits[{k}]")
    if names is not None:
        listing(names, "names", "names")
        if len(names) != n:
            raise InvalidInput(f"names: expected {n}, one for each of the robots, found {len(names)}")
        counts = Counter(text(name, f"names[{k}]") for k, name in enumerate(names))
        twice = [name for name, count in counts.items() if count > 1]
        if twice:
            raise InvalidInput(f"names: expected different ones, found {twice[0]!r} more than once")
    methods = [one.among_robots() for one in _methods(method, n)]
    margins, priorities = each_number(margin, "margin", n), each_number(priority, "priority", n)
    if np.any(margins < 0.0):
        raise InvalidInput(f"margin: expected 0 m or more, found {margins.min():g} m")
    if not (priorities.min() > 0.0 and priorities.max() <= PRIORITY_RATIO * priorities.min()):
        found = f"{priorities.min():g} to {priorities.max():g}"
        raise InvalidInput(
            f"priority: expected numbers above 0 with a ratio of at most {PRIORITY_RATIO:g}, found {found}"
        )
    for one, own in zip(methods, priorities):
        if np.any(priorities != own) and one.share == 1.0 and not one.shared:
            raise InvalidInput(f"priority: expected a method that shares the avoidance, found {one.name}")
    return Members(
        methods,
        _each(shapes, n),
        _each(limits, n),
        [f"robot {k}" for k in range(n)] if names is None else list(names),
        margins,
        priorities,
        np.zeros(n, np.int64) if worlds is None else whole_numbers(worlds, "worlds", n),
    )


def _methods(method: Method | Sequence[Method], n: int) -> list[Method]:
    methods = _each(method, n)
    for one in methods:
        has(one, *METHOD, "method")
        if one.looks_ahead:
            raise InvalidInput(f"method: expected one for several robots, found {one.name}, which is for one")
    return methods


def _count(given: Sequence[object], robots: int | None) -> int:
    """The number of robots. Raises InvalidInput if it is not given, or given twice and differently."""
    counts = {len(each) for each in given if isinstance(each, Sequence)}
    if robots is not None:
        counts.add(whole(robots, "robots", 1))
    if len(counts) != 1 or min(counts) < 1:
        expected = "one number above 0, by methods, shapes, limits or robots"
        raise InvalidInput(f"robots: expected {expected}, found {sorted(counts)}")
    return counts.pop()


def _each(value: T | Sequence[T], n: int) -> list[T]:
    return list(value) if isinstance(value, Sequence) else [value] * n
