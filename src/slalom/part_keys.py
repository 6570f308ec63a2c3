"""The kinds and keys under which files hold parts: trajectories, shapes, bounds, responses and others."""

import inspect
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from slalom.checks import Checked
from slalom.errors import InvalidInput


def kind_of(part: object, kinds: Mapping[str, type], where: str) -> str:
    """The name of the class of a part in a table. Raises InvalidInput, which names `where`, for another class."""
    kind = next((name for name, cls in kinds.items() if type(part) is cls), None)
    if kind is None:
        raise InvalidInput(f"{where}: expected one of {', '.join(kinds)}, found {type(part).__name__}")
    return kind


def file_keys(part: Any) -> dict[str, str]:
    """The key in files of each field of a dataclass, by the name of the field, see `checks.Checked.key`."""
    held = {field.name: inspect.getattr_static(part, field.name, None) for field in fields(part)}
    return {name: (one.key if isinstance(one, Checked) else "") or name for name, one in held.items()}
