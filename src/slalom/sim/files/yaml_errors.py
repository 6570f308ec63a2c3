"""Mistakes in a YAML file as `file:line:column: KEY: expected ..., found ...`."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from pydantic import ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import CollectionEndEvent, CollectionStartEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from slalom.base.checks import did_you_mean, shown
from slalom.base.errors import InvalidFile, SlalomError
from slalom.io.recorded import first_of
from slalom.io.table import text_of
from slalom.sim.files.parts import Model, Place, keys_at, keys_of_value

YAML_DEPTH: Final = 100
"""[1] Lists and mappings within each other in a YAML file.

Larger: the parser, whose time grows with the square of the depth, takes seconds until it refuses a file. Smaller:
files with unions of unions of shapes are refused.
"""

YAML_VALUES: Final = 1_000_000
"""[1] Values of a YAML file, those behind aliases counted wherever they stand.

Larger: a file of a few lines can take minutes and gigabytes. Smaller: large scenarios are refused.
"""


T = TypeVar("T")

MAX_MISTAKES: Final = 50
"""Largest number of mistakes of a YAML file in one error; the number of further ones is stated."""


def compose(path: Path) -> tuple[Node | None, Any]:
    """Return the nodes of a YAML file with their positions, and its content. Raises InvalidFile if it is not YAML."""
    text = text_of(path, "YAML file")
    try:
        _refuse_depth(path, text)
        root = YAML(typ="safe").compose(text)
        _refuse_size(path, root)
        _refuse_values(path, root)
        return root, content_of(root)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else str(path)
        raise InvalidFile([f"{place}: expected YAML, found a mistake: {error.problem or error.context}"]) from None
    except YAMLError as error:
        raise InvalidFile([f"{path}: expected YAML, found {' '.join(str(error).split())}"]) from None


def content_of(root: Node | None) -> Any:
    """Return the content of the nodes of a YAML file; None without nodes."""
    return None if root is None else YAML(typ="safe").constructor.construct_document(root)


def _refuse_depth(path: Path, text: str) -> None:
    """Raise InvalidFile for lists and mappings deeper than YAML_DEPTH, before the parser needs time for them."""
    depth = 0
    for event in YAML(typ="safe").parse(text):
        depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        if depth > YAML_DEPTH:
            place = f"{path}:{event.start_mark.line + 1}:{event.start_mark.column + 1}"
            raise InvalidFile([f"{place}: expected values at most {YAML_DEPTH} deep in each other, found deeper ones"])


def _refuse_size(path: Path, root: Node | None) -> None:
    """Raise InvalidFile for a file whose aliases make it larger than YAML_VALUES, or contain themselves."""
    sizes: dict[int, float] = {}
    stack = [root] if root is not None else []
    while stack:
        node = stack[-1]
        # Until it is known: that of a node that contains itself stays infinite.
        sizes.setdefault(id(node), np.inf)
        inside = _inside(node)
        unseen = [one for one in inside if id(one) not in sizes]
        if unseen:
            stack += unseen
        else:
            sizes[id(node)] = 1.0 + sum(sizes[id(one)] for one in inside)
            stack.pop()
    if root is not None and sizes[id(root)] > YAML_VALUES:
        raise InvalidFile([f"{path}: expected at most {YAML_VALUES} values, found more by aliases"])


def _refuse_values(path: Path, root: Node | None) -> None:
    """Raise InvalidFile with all values that are not of the kind of their tag or form, or no text; also keys."""
    constructor, mistakes = YAML(typ="safe").constructor, []
    for node in _nodes(root):
        for key, _ in node.value if isinstance(node, MappingNode) else ():
            if not isinstance(key, ScalarNode):
                found = "a list" if isinstance(key, SequenceNode) else "a mapping"
                mistakes.append(f"{_place(path, key)}: expected text as a key, found {found}")
        if not isinstance(node, ScalarNode):
            continue
        try:
            constructor.construct_object(node)
            node.value.encode()
            fits = "\0" not in node.value
        except (ValueError, LookupError, OverflowError, TypeError, AttributeError):
            fits = False
        if not fits:
            kind = str(node.tag).rpartition(":")[2]
            mistakes.append(
                f"{_place(path, node)}: expected a value that can be read, found {shown(node.value)} as {kind}"
            )
    if mistakes:
        raise InvalidFile(first_of(path, mistakes, MAX_MISTAKES))


def _inside(node: Node) -> list[Node]:
    """The nodes of which a node consists."""
    if isinstance(node, MappingNode):
        return [part for pair in node.value for part in pair]
    return list(node.value) if isinstance(node, SequenceNode) else []


def _nodes(root: Node | None) -> Iterator[Node]:
    """The nodes of a file, each once."""
    stack, seen = [root] if root is not None else [], set[int]()
    while stack:
        node = stack.pop()
        if id(node) not in seen:
            seen.add(id(node))
            stack += reversed(_inside(node))
            yield node


def _place(path: Path, node: Node) -> str:
    """file:line:column of a node."""
    return f"{path}:{node.start_mark.line + 1}:{node.start_mark.column + 1}"


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
    return _place(path, marked)


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
