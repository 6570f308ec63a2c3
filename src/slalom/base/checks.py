"""Checks of all numbers from outside: one message per error, no repairs."""

from collections.abc import Callable, Mapping, Sequence, Set
from functools import lru_cache, partial
from math import isfinite
from typing import Annotated, Any, Final, TypeAlias, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

from slalom.base.errors import InvalidInput
from slalom.base.tolerances import LARGEST

UNIT: Final = 1e-14
"""[1] By how much the length of a unit vector may differ from 1: such a vector is kept to the bit when read back."""

SHOWN: Final = 200
"""[1] Characters of a value that a message about a file shows.

Larger: messages flood the terminal. Smaller: a mistake may lie in the part that is not shown.
"""

MAX_HORIZON: Final = 5000.0
"""[s] Horizons, and durations for which accelerations are held; below LONGEST_FORECAST.

Larger: predicted obstacles vanish within the horizon. Smaller: long horizons are refused.
"""

LONGEST: Final = 1e7
"""[m] Largest extent of a shape, and of a robot with its margin and its way within the horizon.

At that length float64 has a resolution of 2e-9 m, a hundredth of CONTACT. Larger: CONTACT is not resolved, and a
decision may not end. Smaller: scenes of aircraft are refused.
"""


Array: TypeAlias = npt.NDArray[np.float64]

_NOT_NUMBERS = "cSUMmV"
"""Kinds of arrays of complex numbers, bytes, texts, times, durations and records."""


def array(value: npt.ArrayLike, name: str) -> Array:
    """Convert `value` to a read-only float64 array of finite numbers, of any shape."""
    try:
        given = np.asarray(value)
        # Texts, dates and complex numbers would be converted.
        result = None if given.dtype.kind in _NOT_NUMBERS else np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        result = None
    if result is None:
        raise InvalidInput(f"{name}: expected numbers, found {shown(value)}")
    # Of a vector in a third of the time that numpy takes.
    if not (all(map(isfinite, result.ravel().tolist())) if result.size <= 3 else np.isfinite(result).all()):
        raise InvalidInput(f"{name}: expected finite numbers, found {short(result)}")
    result.setflags(write=False)
    return result


def vector(value: npt.ArrayLike, name: str, dimension: int | None = None) -> Array:
    """Convert `value` to a vector (d,) of finite numbers with d = 2 or 3, or d = `dimension` if given."""
    result = array(value, name)
    expected = f"{dimension}" if dimension else "2 or 3"
    if result.ndim != 1 or result.size not in ((dimension,) if dimension else (2, 3)):
        raise InvalidInput(f"{name}: expected {expected} numbers, found {short(result)} of shape {result.shape}")
    return not_huge(result, name)


def not_huge(values: Array, name: str) -> Array:
    """The same array of vectors. Raises InvalidInput for components above LARGEST."""
    if (max(map(abs, values.ravel().tolist()), default=0.0) if values.size <= 3 else np.abs(values).max()) > LARGEST:
        raise InvalidInput(f"{name}: expected numbers of magnitude up to {LARGEST:g}, found {short(values)}")
    return values


def vectors(value: npt.ArrayLike, name: str, dimension: int | None = None) -> Array:
    """Convert `value` to an array (..., d) of finite numbers with d = 2 or 3, or d = `dimension` if given."""
    result = array(value, name)
    allowed = (dimension,) if dimension else (2, 3)
    if result.ndim < 1 or result.shape[-1] not in allowed:
        raise InvalidInput(f"{name}: expected an array (..., {dimension or '2 or 3'}), found shape {result.shape}")
    return not_huge(result, name)


def array_of(value: npt.ArrayLike, name: str, shape: tuple[int, ...]) -> Array:
    """Convert `value` to an array of finite numbers of this shape."""
    result = array(value, name)
    if result.shape != shape:
        raise InvalidInput(f"{name}: expected an array of shape {shape}, found shape {result.shape}")
    return not_huge(result, name)


def number(value: float, name: str) -> float:
    """Convert `value` to a float of magnitude up to LARGEST."""
    if isinstance(value, float) and abs(value) <= LARGEST:
        return float(value)
    result = array(value, name)
    if result.ndim:
        raise InvalidInput(f"{name}: expected one number, found shape {result.shape}")
    return float(not_huge(result, name))


def not_long(length: float, name: str) -> None:
    """Raise InvalidInput for a length above LONGEST [m]."""
    if length > LONGEST:
        raise InvalidInput(f"{name}: expected lengths of at most {LONGEST:g} m, found {length:g} m")


def positive(value: float, name: str) -> float:
    """Convert `value` to a finite float above 0."""
    result = number(value, name)
    if result <= 0:
        raise InvalidInput(f"{name}: expected a number above 0, found {result:g}")
    return result


def duration(value: float, name: str) -> float:
    """Convert `value` to a float above 0 of at most MAX_HORIZON [s]."""
    result = positive(value, name)
    if result > MAX_HORIZON:
        raise InvalidInput(f"{name}: expected at most {MAX_HORIZON:g} s, found {result:g} s")
    return result


def not_negative(value: float, name: str) -> float:
    """Convert `value` to a finite float of 0 or more."""
    result = number(value, name)
    if result < 0:
        raise InvalidInput(f"{name}: expected 0 or more, found {result:g}")
    return result


def flag(value: Any, name: str) -> bool:
    """Convert `value` to True or False; 1 and 0 count as such."""
    if isinstance(value, bool):
        return value
    result = number(value, name)
    if result not in (0.0, 1.0):
        raise InvalidInput(f"{name}: expected True or False, found {result:g}")
    return result == 1.0


def flags(value: npt.ArrayLike, name: str, n: int) -> npt.NDArray[np.bool_]:
    """Convert `value`, one or n of True and False, to an array (n,)."""
    result = each_number(value, name, n)
    if np.any((result != 0.0) & (result != 1.0)):
        raise InvalidInput(f"{name}: expected True or False, found {short(result)}")
    return np.asarray(result == 1.0)


def each_number(value: npt.ArrayLike, name: str, n: int) -> Array:
    """Convert `value`, one number or n of them, to an array (n,)."""
    found = array(value, name)
    if found.shape not in ((), (n,)):
        raise InvalidInput(f"{name}: expected one number or {n}, found an array of shape {found.shape}")
    return not_huge(np.broadcast_to(found, (n,)), name)


def not_before(value: float, last: float, name: str, what: str) -> float:
    """Convert `value` to a time [s] that is not before the `last` one [s], that of `what`."""
    result = number(value, name)
    if result < last:
        raise InvalidInput(
            f"{name}: expected a time that does not run backwards, found {result:g} s after {what} at {last:g} s"
        )
    return result


def or_infinite(value: float, name: str, check: Callable[[float, str], float]) -> float:
    """Infinity if `value` is that, else the number that `check` makes of it."""
    return np.inf if isinstance(value, float) and value == np.inf else check(value, name)


def share(value: float, name: str) -> float:
    """Convert `value` to a float of 0 or more and below 1."""
    result = number(value, name)
    if not 0 <= result < 1:
        raise InvalidInput(f"{name}: expected 0 or more and below 1, found {result:g}")
    return result


def probability(value: float, name: str) -> float:
    """Convert `value` to a float above 0 of at most 1."""
    result = number(value, name)
    if not 0.0 < result <= 1.0:
        raise InvalidInput(f"{name}: expected a number above 0 of at most 1, found {result:g}")
    return result


def fraction(value: float, name: str) -> float:
    """Convert `value` to a float above 0 and below 1."""
    result = number(value, name)
    if not 0.0 < result < 1.0:
        raise InvalidInput(f"{name}: expected a number between 0 and 1, found {result:g}")
    return result


STATE: Final = (("position", "velocity", "acceleration"), "a State")
SHAPE: Final = (("parts", "dimension"), "a shape, such as Disc(radius)")
RESPONSE: Final = (("position", "interpolation_error"), "a response, such as Acceleration()")
LIMITS: Final = (("max_speed", "braking"), "Limits")
GOAL: Final = (("trajectory", "tolerance", "stop"), "a Goal or PathGoal")
METHOD: Final = (("responses", "forecast"), "a method, such as method('nao')")
WINDOW: Final = (("bodies", "horizon"), "an ObstacleWindow")
BLOCKED: Final = (("for_controls", "overlaps"), "a ControlObstacle")
TRAJECTORY: Final = (("position", "span"), "a trajectory, such as Stationary((x, y))")
UNCERTAINTY: Final = (("radius",), "an uncertainty, such as BoundedError(0.1)")
OBJECTIVE: Final = (("aims", "cost", "enough_clearance"), "an objective, such as Arrive()")
TRACKS: Final = (("states", "with_forecast", "with_shares"), "Tracks")
FORECAST: Final = (("includes_future", "__call__"), "a forecast, such as AtConstantVelocity()")
DECISION: Final = (("manoeuvre",), "a Decision")
"""Kinds of parts, as in has(state, *STATE, "state"): their members, and the words of a message."""


def has(value: object, attributes: Sequence[str], expected: str, name: str) -> None:
    """Raise InvalidInput unless `value` has these attributes (for example for a point in place of a trajectory)."""
    found = not isinstance(value, type)
    # A loop takes a third of the time of `all`: there are ten of these checks in a decision.
    for attribute in attributes:
        found = found and hasattr(value, attribute)
    if not found:
        raise InvalidInput(f"{name}: expected {expected}, found {shown(value)}")


def refuse_kinds(response: object, obstacles: object, robot: object, *states: object) -> None:
    """Raise InvalidInput for something else than a response, an ObstacleWindow, a shape and states."""
    has(response, *RESPONSE, "response")
    for state in states:
        has(state, *STATE, "state")
    has(robot, *SHAPE, "robot")
    has(obstacles, *WINDOW, "obstacles")


def listing(value: object, expected: str, name: str) -> None:
    """Raise InvalidInput unless `value` is a list, a tuple or another collection in order, but no text."""
    without_order = isinstance(value, type | str | bytes | Mapping | Set)
    if without_order or not (hasattr(value, "__iter__") and hasattr(value, "__len__")):
        raise InvalidInput(f"{name}: expected {expected}, found {shown(value)}")


def pair(value: Any, expected: str, name: str) -> tuple[Any, Any]:
    """The two members of a `value` in order. Raises InvalidInput for something else."""
    listing(value, expected, name)
    if len(value) != 2:
        raise InvalidInput(f"{name}: expected {expected}, found {shown(value)}")
    first, second = value
    return first, second


def mapping(value: object, expected: str, name: str) -> None:
    """Raise InvalidInput unless `value` is a mapping."""
    if not isinstance(value, Mapping):
        raise InvalidInput(f"{name}: expected {expected}, found {shown(value)}")


def whole(value: Any, name: str, minimum: int = 0) -> int:
    """Convert `value` to an integer of `minimum` or more; no rounding."""
    result = number(value, name)
    if result != round(result) or result < minimum:
        raise InvalidInput(f"{name}: expected a whole number of {minimum} or more, found {result:g}")
    return int(result)


def whole_numbers(value: npt.ArrayLike, name: str, n: int) -> npt.NDArray[np.int64]:
    """Convert `value` to n whole numbers of 0 or more (n,); no rounding."""
    result = array_of(value, name, (n,))
    if np.any((result < 0.0) | (result != np.round(result))):
        raise InvalidInput(f"{name}: expected whole numbers of 0 or more, found {short(result)}")
    return result.astype(np.int64)


def text(value: object, name: str) -> str:
    """The `value`, a text. Raises InvalidInput for something else."""
    if not isinstance(value, str):
        raise InvalidInput(f"{name}: expected text, found {shown(value)}")
    return value


def known(name: str, what: str, names: Sequence[str], others: str = "") -> str:
    """Return `name` if it is one of `names`; otherwise raise InvalidInput with all of them, and the nearest.

    others: what else is accepted, for the message: "a .yaml file or ".
    """
    if not isinstance(name, str) or name not in names:
        hint = did_you_mean(name, names)
        raise InvalidInput(f"{what}: expected {others}one of {', '.join(names)}; found {shown(name)}{hint}")
    return name


def did_you_mean(name: object, names: Sequence[str]) -> str:
    """End of a message about an unknown name: the nearest of `names`, or nothing if none is near."""
    from difflib import get_close_matches

    near = get_close_matches(name.lower(), names, n=1) if isinstance(name, str) else []
    return f"; did you mean {near[0]!r}?" if near else ""


def unit(value: npt.ArrayLike, name: str) -> tuple[Array, float]:
    """Unit vector (d,) along `value` (d,), and its length. A vector of length 1 is returned unchanged, bit for bit."""
    given = vector(value, name)
    length = float(np.linalg.norm(given))
    if length == 0.0:
        raise InvalidInput(f"{name}: expected a direction, found the zero vector")
    if abs(length - 1.0) < UNIT:
        return given, 1.0
    return array(given / length, name), length


def direction(value: npt.ArrayLike, name: str) -> Array:
    """Unit vector (d,) along `value` (d,), see `unit`."""
    return unit(value, name)[0]


def short(values: Array) -> str:
    """At most six of the values as text, for a message."""
    flat = values.ravel()
    return "[" + ", ".join(f"{x:g}" for x in flat[:6]) + (", ...]" if flat.size > 6 else "]")


def shown(value: object) -> str:
    """A value as text for a message, of at most SHOWN characters."""
    text = " ".join(repr(value).split())
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


Number: TypeAlias = Annotated[float, number]
"""A field of a part that holds a finite number; checked by `checks.check_fields` and in files, as the next ones."""
Positive: TypeAlias = Annotated[float, positive]
"""A field of a part that must be above 0."""
NotNegative: TypeAlias = Annotated[float, not_negative]
"""A field of a part that must be 0 or more."""
Fraction: TypeAlias = Annotated[float, fraction]
"""A field of a part that must be above 0 and below 1."""
Direction: TypeAlias = Annotated[npt.ArrayLike | None, direction]
"""A field of a part that holds 2 or 3 numbers along which a unit vector is stored, or None."""


class Checked:
    """Field of a frozen dataclass that accepts any array-like value and stores a checked, read-only array.

    Type checkers use the type of `__set__` for the constructor and the type of `__get__` elsewhere.

    Args:
        check: what makes the array, or raises InvalidInput. shape: of the array, for files; "d" is 2 or 3, "n" any
            length, a digit itself, as in "n d". key: the name in scenario files, that of the field if it is empty.
    """

    def __init__(self, check: Callable[[npt.ArrayLike, str], Array], shape: str = "d", key: str = "") -> None:
        self.check = check
        self.shape = shape
        self.key = key

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Array:
        if instance is None:
            raise AttributeError(self.name)  # makes the field one without a default
        return instance.__dict__[self.name]  # type: ignore[no-any-return]

    def __set__(self, instance: Any, value: npt.ArrayLike) -> None:
        instance.__dict__[self.name] = self.check(value, self.name)


# Checks of the fields of dataclasses by their annotations.


def check_fields(part: Any) -> None:
    """Convert the fields of a dataclass by the checks in their annotations, such as `checks.Positive`.

    Call it in `__post_init__`. Text is checked that is annotated with the texts that are known, as in
    Annotated[str, ("world", "body")].

    Raises:
        InvalidInput: a value that a check refuses. None is taken where the annotation has it.
    """
    cls: type = type(part)
    for name, check, optional in _checks_of(cls):
        value = getattr(part, name)
        if not (optional and value is None):
            object.__setattr__(part, name, check(value, name))


class CheckedFields:
    """Base of dataclasses whose fields are checked by their annotations alone, see `check_fields`."""

    def __post_init__(self) -> None:
        check_fields(self)


@lru_cache(maxsize=256)
def _checks_of(cls: type) -> tuple[tuple[str, Callable[[Any, str], Any], bool], ...]:
    """Name and check of each field with a check, and whether it may be None."""
    found = []
    for name, hint in get_type_hints(cls, include_extras=True).items():
        if get_origin(hint) is Annotated:
            held, condition = get_args(hint)[:2]
            check = condition if callable(condition) else partial(known, names=condition)
            found.append((name, check, type(None) in get_args(held)))
    return tuple(found)
