"""Nodes of YAML files with their positions; files that would take too long to read are refused."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import CollectionEndEvent, CollectionStartEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from slalom.base.checks import shown
from slalom.base.errors import InvalidFile
from slalom.io.recorded import first_of
from slalom.io.table import text_of
from slalom.io.walls_child import expanded

YAML_DEPTH: Final = 100
"""[1] Lists and mappings within each other in a YAML file.

Larger: the parser, whose time grows with the square of the depth, takes seconds until it refuses a file. Smaller:
files with unions of unions of shapes are refused.
"""

YAML_VALUES: Final = 1_000_000
"""[1] Values of a YAML file, those behind aliases counted wherever they stand.

Larger: a file of a few lines can take minutes and gigabytes. Smaller: large scenarios are refused.
"""

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
    if root is not None and expanded(root, lambda node: (1.0, [(one, 1) for one in _inside(node)]))[0] > YAML_VALUES:
        raise InvalidFile([f"{path}: expected at most {YAML_VALUES} values, found more by aliases"])


def _refuse_values(path: Path, root: Node | None) -> None:
    """Raise InvalidFile with all values that are not of the kind of their tag or form, or no text; also keys."""
    constructor, mistakes = YAML(typ="safe").constructor, []
    for node in _nodes(root):
        for key, _ in node.value if isinstance(node, MappingNode) else ():
            if not isinstance(key, ScalarNode):
                found = "a list" if isinstance(key, SequenceNode) else "a mapping"
                mistakes.append(f"{place_of(path, key)}: expected text as a key, found {found}")
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
                f"{place_of(path, node)}: expected a value that can be read, found {shown(node.value)} as {kind}"
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


def place_of(path: Path, node: Node) -> str:
    """file:line:column of a node."""
    return f"{path}:{node.start_mark.line + 1}:{node.start_mark.column + 1}"
