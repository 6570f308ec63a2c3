"""Parameters of peers: numbers with which a method is made, by name, and their text in NAME:PARAMETER=VALUE."""

from collections.abc import Callable, Mapping
from functools import partial
from inspect import signature
from typing import Any, TypeVar

from slalom.checks import known, not_negative, whole
from slalom.errors import InvalidInput

Made = TypeVar("Made")


def parameters_of(crowd: Callable[..., Any]) -> dict[str, float]:
    """The numbers that `crowd` takes besides a team, with their values: keywords, and entries of `settings`."""
    if not isinstance(crowd, partial):
        return {}
    given = {name: one.default for name, one in signature(crowd.func).parameters.items()} | crowd.keywords
    given |= given.pop("settings", {})
    return {name: value for name, value in given.items() if _is_number(value)}


def with_parameters(crowd: Callable[..., Made], values: Mapping[str, float], name: str) -> Callable[..., Made]:
    """The same crowd with other parameters; `name` is that of the method, for messages.

    Raises:
        InvalidInput: a parameter that the method does not have; a value below 0, or not whole where the present one is.
    """
    present = parameters_of(crowd)
    if values and not present:
        raise InvalidInput(f"method: expected {name} alone, which has no parameters; found {next(iter(values))!r}")
    if not isinstance(crowd, partial):
        return crowd
    keywords, settings = dict(crowd.keywords), dict(crowd.keywords.get("settings", {}))
    for key, value in values.items():
        number: float = not_negative(value, key)
        if isinstance(present[known(key, f"parameter of {name}", list(present))], int):
            number = whole(int(number) if number.is_integer() else number, key)
        if key in settings:
            settings[key] = number
        if key in keywords or key not in settings:
            keywords[key] = number
    return partial(crowd.func, **(keywords | ({"settings": settings} if settings else {})))


def parsed(text: str, name: str) -> dict[str, float]:
    """The parameters of PARAMETER=VALUE:PARAMETER=VALUE after the name of a method.

    Raises:
        InvalidInput: a text of another form.
    """
    found: dict[str, float] = {}
    for item in text.split(":"):
        key, equals, value = item.partition("=")
        try:
            found[key.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise InvalidInput(f"method: expected {name}:PARAMETER=VALUE with a number, found {item!r}")
    return found


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
