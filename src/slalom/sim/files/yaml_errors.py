"""Mistakes in a YAML file as `file:line:column: KEY: expected ..., found ...`."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from slalom.base.checks import did_you_mean, shown
from slalom.base.errors import InvalidFile, SlalomError
from slalom.io.yaml_nodes import place_of
from slalom.sim.files.parts import Model, Place, keys_at, keys_of_value

T = TypeVar("T")


def dotted(place: Place) -> str:
    """Return the key path at the head of a message."""
    return ".".join(str(part) for part in place) + ": " if place else ""


def _find(root: Node | None, place: Place) -> tuple[Node | None, Node | None]:
    """Return the key and value nodes at `place`, or the deepest ones on the way to it."""
    key, node = None, root
    for part in place:
        if isinstance(node, MappingNode):
            found = [(k, v) for k, v in node.value if k.value == str(part)]
            if found:
                key, node = found[0]
        elif isinstance(node, SequenceNode) and isinstance(part, int) and part < len(node.value):
            key, node = None, node.value[part]
    return key, node


def where(path: Path, root: Node | None, place: Place, at_key: bool = False) -> str:
    """Return file:line:column of the value at `place`, or of its key."""
    key, node = _find(root, place)
    is_empty = isinstance(node, ScalarNode) and node.value == "" and node.style is None
    marked = key if key is not None and (at_key or is_empty) else node
    if marked is None:
        return f"{path}:1:1"
    return place_of(path, marked)


_EXPECTED = {
    "missing": "expected this key, found none",
    "greater_than": "expected a number above {gt:g}, found {input}",
    "greater_than_equal": "expected {ge:g} or more, found {input}",
    "finite_number": "expected a finite number, found {input}",
    "float_parsing": "expected a number, found {input}",
    "float_type": "expected a number, found {input}",
    "int_type": "expected a whole number, found {input}",
    "too_short": "expected at least {min_length} entries, found {actual_length}",
    "too_long": "expected at most {max_length} entries, found {actual_length}",
    "literal_error": "expected {expected}, found {input}",
    "union_tag_invalid": "expected a kind among {expected_tags}, found {tag!r}{hint}",
    "union_tag_not_found": "expected a key 'kind', found none",
    "list_type": "expected a list, found {input}",
    "string_type": "expected text, found {input}",
    "bool_type": "expected true or false, found {input}",
    "bool_parsing": "expected true or false, found {input}",
    "model_type": "expected a mapping{keys} found {input}",
    "model_attributes_type": "expected a mapping{keys} found {input}",
    "dict_type": "expected a mapping, found {input}",
    "value_error": "{error}",
}


def messages(path: Path, root: Node | None, content: Any, model: type[Model]) -> list[str]:
    """Return one line for each mistake in the content of a file of this model."""
    try:
        model.model_validate(content)
    except ValidationError as error:
        return [_message(path, root, content, model, dict(mistake)) for mistake in error.errors()]
    return []


def _message(path: Path, root: Node | None, content: Any, model: type[Model], mistake: dict[str, Any]) -> str:
    """Return one line for one mistake, as pydantic describes it."""
    kind = mistake["type"]
    found = mistake.get("input")
    place = tuple(mistake["loc"])
    if kind == "extra_forbidden":
        allowed = keys_at(model, content, place[:-1])
        hint = did_you_mean(str(place[-1]), allowed)
        text = f"expected one of {', '.join(allowed)}; found {place[-1]!r}{hint}"
        return f"{where(path, root, place, at_key=True)}: {dotted(place)}{text}"
    template = _EXPECTED.get(kind)
    what = "a mapping" if isinstance(found, dict) else shown(found)
    context = {"input": what, **mistake.get("ctx", {})}
    if kind == "union_tag_invalid":
        context["hint"] = did_you_mean(context["tag"], re.findall(r"'(.*?)'", context["expected_tags"]))
    elif kind in ("model_type", "model_attributes_type"):
        keys = keys_of_value(model, content, place) if place else []
        context["keys"] = f" with the key{'s' if len(keys) > 1 else ''} {', '.join(keys)};" if keys else ","
    text = template.format(**context) if template else f"{mistake['msg']}, found {what}"
    return f"{where(path, root, place)}: {dotted(place)}{text}"


def in_order(path: Path, mistakes: Sequence[str]) -> list[str]:
    """Return the mistakes of a file in the order of their lines and columns, then those of other files."""

    def place(mistake: str) -> tuple[float, float]:
        found = re.match(r":(\d+):(\d+):", mistake[len(str(path)) :]) if mistake.startswith(str(path)) else None
        return (float(found[1]), float(found[2])) if found else (np.inf, np.inf)

    return sorted(mistakes, key=place)


class Mistakes:
    """The mistakes of a file, at most one for each place that is noted."""

    def __init__(self, path: Path, root: Node | None) -> None:
        self.path, self.root = path, root
        self.mistakes: list[str] = []
        self._noted = set[Place]()

    def note(self, place: Place, text: str) -> None:
        """Add a mistake at a place, unless it has one: each robot of a group would repeat those of the group."""
        if place not in self._noted:
            self._noted.add(place)
            self.mistakes.append(f"{where(self.path, self.root, place)}: {dotted(place)}{text}")

    def attempt(self, place: Place, make: Callable[[], T]) -> T | None:
        """Return the value of `make`; None if it raises, with a mistake at `place`."""
        try:
            return make()
        except InvalidFile as error:
            self.mistakes.extend(error.mistakes)
        except SlalomError as error:
            # The message may begin with the name of the value, which the place contains.
            self.note(place, str(error).removeprefix(dotted(place)).removeprefix(f"{place[-1]}: "))
        return None
