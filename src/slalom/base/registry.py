"""Tables of parts by name, to which installed packages add by entry points."""

import inspect
from collections import UserDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeAlias, TypeVar, get_args, get_type_hints

from slalom.base.checks import Checked, known, shown
from slalom.base.errors import InvalidInput

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


Part = TypeVar("Part")
NO_NAMES: Final[Mapping[str, str]] = MappingProxyType({})
NO_KINDS: Final[Mapping[str, type]] = MappingProxyType({})
Tables: TypeAlias = Mapping[Any, Mapping[str, type]]
PLAIN: Final = (bool, int, float, str)
NO_TABLES: Final[Tables] = MappingProxyType({})


class Kind(NamedTuple):
    """The kind of the parts of a table: a test of an object, and words for messages."""

    fits: Callable[[object], bool]
    words: str


class Registry(UserDict[str, Part], Generic[Part]):
    """Parts by name: those of slalom, and those of installed packages, by the entry points of a group.

    Packages are searched when the table is listed, or when a name is unknown. A part is also added by
    `TABLE[name] = part`.

    Attributes:
        group: name of the group of entry points. packages: name and version of the package of each part that an entry
            point added.

    Raises:
        InvalidInput: (when packages are searched) an entry point that cannot be imported or is another kind of part;
            one with the name of an existing part, or with another name than its part.
    """

    def __init__(self, group: str, kind: Kind, parts: Mapping[str, Part]) -> None:
        self.group = group
        self.packages = dict[str, str]()
        self._kind = kind
        self._complete = True
        super().__init__(parts)
        self._complete = False

    def find(self, name: str, what: str) -> Part:
        """The part of a name; `what` it is. Raises InvalidInput with all names for one that is unknown."""
        if isinstance(name, str) and name in self.data:
            return self.data[name]
        return self[known(name, what, list(self))]

    def __getitem__(self, name: str) -> Part:
        if name not in self.data:
            self._load()
        return self.data[name]

    def __contains__(self, name: object) -> bool:
        if name not in self.data:
            self._load()
        return name in self.data

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter(self.data)

    def __len__(self) -> int:
        self._load()
        return len(self.data)

    def _load(self) -> None:
        """Add the parts of installed packages, once."""
        if self._complete:
            return
        from importlib.metadata import entry_points

        # While packages are imported they may look into this table.
        self._complete, done = True, False
        try:
            for point in sorted(entry_points(group=self.group)):
                self._add(point)
            done = True
        finally:
            self._complete = done

    def _add(self, point: "EntryPoint") -> None:
        where = f"entry point {point.name!r} of {self.group}"
        package = "" if point.dist is None else f"{point.dist.name} {point.dist.version}"
        if self.packages.get(point.name) == package:
            return
        if point.name in self.data:
            raise InvalidInput(f"{where}: expected a name that is free, found one that is taken: {point.value}")
        try:
            part = point.load()
        except (ImportError, AttributeError) as error:
            raise InvalidInput(f"{where}: expected {point.value} to be importable, found {error}") from error
        if not self._kind.fits(part):
            raise InvalidInput(f"{where}: expected {self._kind.words}, found {shown(part)}")
        if getattr(part, "name", point.name) != point.name:
            raise InvalidInput(f"{where}: expected the name of its part, found {part.name!r}")
        self.data[point.name], self.packages[point.name] = part, package


# The kinds and keys under which files hold parts: trajectories, shapes, bounds, responses and others.


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


# Parts as numbers, texts, lists and mappings, which JSON, YAML and HDF5 hold.


def to_plain(value: Any, kinds: Mapping[str, type] = NO_KINDS, where: str = "", tables: Tables = NO_TABLES) -> Any:
    """A value as numbers, texts, lists and mappings: that of a dataclass has the keys of its fields in files.

    Args:
        kinds: the table of the class of a part, for its `kind`; parts in it are of the same table.
        where: the name of the value in messages.
        tables: the tables of fields by the protocol in their annotation, for dataclasses that hold several sorts.

    Raises:
        InvalidInput: a part of a class that is not in its table.
    """
    if hasattr(value, "tolist"):  # an array, or a number of numpy
        return value.tolist()
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {str(name): to_plain(one, kinds, f"{where}.{name}", tables) for name, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [to_plain(one, kinds, f"{where}[{k}]", tables) for k, one in enumerate(value)]
    cls: Any = type(value)
    if not is_dataclass(value):
        # A part may be of a class that is no dataclass.
        return value if value is None or kinds is NO_KINDS or cls in PLAIN else kind_of(value, kinds, where)
    found: dict[str, Any] = {"kind": kind_of(value, kinds, where)} if kinds is not NO_KINDS else {}
    types = _types_of(cls) if tables else {}
    for name, key in file_keys(cls).items():
        table = next((tables[one] for one in types.get(name, ()) if one in tables), kinds)
        found[key] = to_plain(getattr(value, name), table, f"{where}.{key}".removeprefix("."), tables)
    return found


@lru_cache(maxsize=256)
def _types_of(cls: type) -> dict[str, tuple[Any, ...]]:
    """The types in the annotation of each field of a dataclass."""
    return {name: _types_in(hint) for name, hint in get_type_hints(cls).items()}


def _types_in(hint: Any) -> tuple[Any, ...]:
    """An annotation, and the types in it."""
    return (hint, *(inner for one in get_args(hint) for inner in _types_in(one)))


def from_plain(given: Mapping[str, Any], kinds: Mapping[str, type], former: Mapping[str, str] = NO_NAMES) -> Any:
    """The part that `to_plain` wrote; fields have their keys in files, or their names.

    Args:
        former: names of fields by former keys in files.

    Raises:
        InvalidInput: an unknown kind, a field too many or too few, and what the constructor of the part refuses.
    """
    name = given.get("kind")
    cls = kinds.get(name) if isinstance(name, str) else None
    if cls is None:
        raise InvalidInput(f"kind: expected one of {', '.join(kinds)}, found {shown(name)}")
    names = {key: name for name, key in file_keys(cls).items()}
    names |= {name: name for name in names.values()}
    values = {
        names.get(key) or former.get(key, key): _value(value, kinds) for key, value in given.items() if key != "kind"
    }
    needed = {item.name for item in fields(cls) if item.default is MISSING and item.default_factory is MISSING}
    known_names = {item.name for item in fields(cls)}
    twice = len(values) < len(given) - 1
    if twice or not needed <= set(values) <= known_names:
        expected = ", ".join(sorted(known_names)) or "no field"
        raise InvalidInput(f"{cls.__name__}: expected {expected}, found {shown(sorted(set(given) - {'kind'}))}")
    return cls(**values)


def _value(value: Any, kinds: Mapping[str, type]) -> Any:
    if isinstance(value, Mapping):
        is_part = isinstance(value.get("kind"), str)
        return from_plain(value, kinds) if is_part else {name: _value(one, kinds) for name, one in value.items()}
    return tuple(_value(one, kinds) for one in value) if isinstance(value, list) else value
