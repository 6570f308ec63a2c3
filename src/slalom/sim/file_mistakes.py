"""Mistakes in a YAML file as `file:line:column: key: what was expected, what was found`."""

from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ruamel.yaml.nodes import MappingNode, Node, SequenceNode


def dotted(place: tuple[str | int, ...]) -> str:
    """The key path at the head of a message."""
    return ".".join(str(part) for part in place) + ": " if place else ""


def _find(root: Node | None, place: tuple[str | int, ...]) -> tuple[Node | None, Node | None]:
    """The key and value nodes at `place`, or the deepest ones on the way there."""
    key, node = None, root
    for part in place:
        if isinstance(node, MappingNode):
            found = [(k, v) for k, v in node.value if k.value == str(part)]
            if found:
                key, node = found[0]
        elif isinstance(node, SequenceNode) and isinstance(part, int) and part < len(node.value):
            key, node = None, node.value[part]
    return key, node


def where(path: Path, root: Node | None, place: tuple[str | int, ...], at_key: bool = False) -> str:
    """file:line:column of the value at `place`, or of its key."""
    key, node = _find(root, place)
    marked = key if at_key and key is not None else node
    if marked is None:
        return f"{path}:1:1"
    return f"{path}:{marked.start_mark.line + 1}:{marked.start_mark.column + 1}"


_EXPECTED = {
    "missing": "expected this key, found none",
    "greater_than": "expected a number above {gt:g}, found {input}",
    "greater_than_equal": "expected {ge:g} or more, found {input}",
    "finite_number": "expected a finite number, found {input}",
    "float_parsing": "expected a number, found {input!r}",
    "float_type": "expected a number, found {input!r}",
    "too_short": "expected at least {min_length} entries, found {actual_length}",
    "too_long": "expected at most {max_length} entries, found {actual_length}",
    "literal_error": "expected {expected}, found {input!r}",
    "union_tag_invalid": "expected a kind among {expected_tags}, found {tag!r}",
    "union_tag_not_found": "expected a key 'kind', found none",
    "list_type": "expected a list, found {input!r}",
    "string_type": "expected text, found {input!r}",
    "bool_parsing": "expected true or false, found {input!r}",
    "model_type": "expected a mapping, found {input!r}",
}


def message(
    path: Path, root: Node | None, mistake: dict[str, Any], keys: Callable[[tuple[str | int, ...]], list[str]]
) -> str:
    """One line for one of pydantic's mistakes; `keys` gives the keys that are known at a place."""
    place, kind = tuple(mistake["loc"]), mistake["type"]
    found = mistake.get("input")
    if kind == "extra_forbidden":
        allowed = keys(place[:-1])
        near = get_close_matches(str(place[-1]), allowed, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        text = f"expected one of {', '.join(allowed)}; found {place[-1]!r}{hint}"
        return f"{where(path, root, place, at_key=True)}: {dotted(place)}{text}"
    shown = "a mapping" if isinstance(found, dict) else found
    template = _EXPECTED.get(kind)
    text = template.format(input=shown, **mistake.get("ctx", {})) if template else f"{mistake['msg']}, found {shown!r}"
    return f"{where(path, root, place)}: {dotted(place)}{text}"
