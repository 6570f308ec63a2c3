"""Checks of the fields of dataclasses by their annotations."""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from slalom.checks import known


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
