"""Models of trajectories, shapes, bounds and uncertainties, derived from their classes and registries.

The keys of a part are the fields of its dataclass, see `_value_type`; a new part needs no line here.
"""

import inspect
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from datetime import date, datetime
from functools import lru_cache
from types import GenericAlias
from typing import Annotated, Any, ClassVar, Final, Literal, get_args, get_origin, get_type_hints

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    GetCoreSchemaHandler,
    create_model,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticKnownError, core_schema

from slalom.base.checks import Checked, direction, duration, fraction, not_negative, number, positive
from slalom.base.errors import InvalidInput
from slalom.base.registry import file_keys
from slalom.decision.objective import OBJECTIVES, Objective
from slalom.decision.settings import checked_holds, names_of
from slalom.model.bounds import BOUNDS, Bound
from slalom.model.shape import SHAPES, Shape
from slalom.model.trajectory import TRAJECTORIES, Trajectory
from slalom.model.uncertainty import UNCERTAINTIES, Uncertainty

Vector = Annotated[list[FiniteFloat], Field(min_length=2, max_length=3)]
Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]

Place = tuple[str | int, ...]
"""Keys and indices that lead from the top of a file to a value."""


def _as_text(value: object) -> object:
    """The text of a number or a date, which YAML makes of unquoted text; any other value unchanged."""
    if isinstance(value, datetime | date):
        return value.isoformat()
    return str(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


Text = Annotated[str, BeforeValidator(_as_text)]


class Model(BaseModel):
    """A mapping that refuses unknown keys and converts no text to numbers."""

    model_config = ConfigDict(extra="forbid", strict=True)


class Built(Model, ABC):
    """The model of a part. An InvalidInput of the part's constructor becomes a mistake of the file."""

    @abstractmethod
    def build(self) -> object:
        """Return the part. Raises InvalidInput, which pydantic collects with the other mistakes."""

    @model_validator(mode="after")
    def _buildable(self) -> "Built":
        self.build()
        return self


class ModelByContent(ABC):
    """Metadata of a field whose model depends on the content, such as a part of any kind."""

    @abstractmethod
    def model_of(self, content: object) -> type[Model] | None:
        """Return the model of this content; None if the content does not determine one."""

    @abstractmethod
    def validate(self, content: object) -> object:
        """Return the validated content. Raises the errors of pydantic, which collects them with the others."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.validate)


def keys_at(model: type[Model], content: Any, place: Place) -> list[str]:
    """Return the keys that the mapping at `place` may have, in a file of this `model` and `content`."""
    return list(_to_place(model, content, place)[0].model_fields)


def keys_of_value(model: type[Model], content: Any, place: Place) -> list[str]:
    """Return the keys of the mapping that is expected at `place`, which holds something else; `kind` of a part."""
    expected = next(_models_of(_to_place(model, content, place)[1], {}), None)
    return (list(expected.model_fields) if expected is not None else []) or ["kind"]


def _to_place(model: type[Model], content: Any, place: Place) -> tuple[type[Model], FieldInfo]:
    """Return the model of the last mapping on the way to `place`, and the last field."""
    field = FieldInfo()
    for step in place:
        # A mapping by name, such as areas, has the field of its values.
        field = model.model_fields.get(step, field) if isinstance(step, str) else field
        content = content[step]
        if isinstance(content, dict):
            model = next(_models_of(field, content), model)
    return model, field


def _models_of(field: FieldInfo, content: Any) -> Iterator[type[Model]]:
    """Yield the models of a mapping with this content in a field, itself or in a list."""
    found = [field.annotation, *field.metadata]
    while found:
        item = found.pop()
        found += get_args(item)
        if isinstance(item, type) and issubclass(item, Model):
            yield item
        elif isinstance(item, ModelByContent) and (model := item.model_of(content)) is not None:
            yield model


NUMBERS: Final[Mapping[Any, Any]] = {
    number: FiniteFloat,
    positive: Positive,
    not_negative: NotNegative,
    fraction: Positive,
    direction: Vector | None,
    duration: Positive,
    checked_holds: Annotated[list[Positive], Field(min_length=1)],
}
"""Types in files, by the check in the annotation of a field."""


class PartModel(Built):
    """A part. `part` is its class, `names` maps each key to the field of the class, by default of the same name."""

    part: ClassVar[type]
    names: ClassVar[dict[str, str]]

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        if "part" in cls.__dict__:
            cls.names = {key: key for key in cls.model_fields}

    def build(self) -> Any:
        """Return the part. Raises InvalidInput, which names the key of a field in place of the field."""
        try:
            return self.part(**{field: built(getattr(self, key)) for key, field in self.names.items()})
        except InvalidInput as error:
            name, colon, text = str(error).partition(": ")
            key = next((key for key, field in self.names.items() if field == name), name)
            raise InvalidInput(f"{key}{colon}{text}") from None


def built(value: Any) -> Any:
    """Return the value of a field, with parts in place of their models and tuples in place of lists."""
    if isinstance(value, Built):
        return value.build()
    return tuple(built(one) for one in value) if isinstance(value, list | tuple) else value


@dataclass(frozen=True, eq=False)
class OfAnyKind(ModelByContent):
    """Metadata of a field that holds a part of a registry; a kind may be added to the registry at any time."""

    kinds: Mapping[str, type]

    def model_of(self, content: object) -> type[PartModel] | None:
        kind = content.get("kind") if isinstance(content, dict) else None
        return model_of_part(kind, self.kinds[kind]) if isinstance(kind, str) and kind in self.kinds else None

    def validate(self, content: object) -> PartModel:
        if not isinstance(content, dict):
            raise PydanticKnownError("model_attributes_type")
        if "kind" not in content:
            raise PydanticKnownError("union_tag_not_found", {"discriminator": "'kind'"})
        model = self.model_of(content)
        if model is None:
            tags = ", ".join(repr(name) for name in self.kinds)
            context = {"discriminator": "'kind'", "tag": str(content["kind"]), "expected_tags": tags}
            raise PydanticKnownError("union_tag_invalid", context)
        return model.model_validate(content)


TrajectoryModel = Annotated[PartModel, OfAnyKind(TRAJECTORIES)]
ShapeModel = Annotated[PartModel, OfAnyKind(SHAPES)]
BoundModel = Annotated[PartModel, OfAnyKind(BOUNDS)]
UncertaintyModel = Annotated[PartModel, OfAnyKind(UNCERTAINTIES)]
ObjectiveModel = Annotated[PartModel, OfAnyKind(OBJECTIVES)]

PARTS: Final[Mapping[Any, Any]] = {
    Trajectory: TrajectoryModel,
    Shape: ShapeModel,
    Bound: BoundModel,
    Uncertainty: UncertaintyModel,
    Objective: ObjectiveModel,
}
"""Types in files, by the protocol in the annotation of a field."""


@lru_cache(maxsize=256)
def model_of_part(kind: str, part: type) -> type[PartModel]:
    """Return the model of a dataclass: a key for each field, with its default.

    Raises:
        TypeError: a field has an annotation that has no type in files.
    """
    hints = get_type_hints(part, include_extras=True)
    names: dict[str, str] = {}
    keys: dict[str, Any] = {"kind": (Literal[kind], ...)}
    of_field = file_keys(part)
    for field in fields(part):
        held, key = inspect.getattr_static(part, field.name, None), of_field[field.name]
        names[key] = field.name
        in_file = _array_type(held.shape) if isinstance(held, Checked) else _value_type(hints[field.name])
        if in_file is None:
            found = hints[field.name]
            raise TypeError(f"{part.__name__}.{field.name}: expected an annotation that files can hold, found {found}")
        keys[key] = (in_file, ... if field.default is MISSING else field.default)
    model = create_model(f"{part.__name__}Model", __base__=PartModel, __doc__=part.__doc__, **keys)
    model.part, model.names = part, names
    return model


def model_of_settings(name: str, settings: type, base: type[Model]) -> type[Model]:
    """Return a model with the keys of a base, and those of settings that are numbers or lists of them."""
    hints = get_type_hints(settings, include_extras=True)
    keys: dict[str, Any] = {
        each: (_value_type(hints[each]), getattr(settings, each)) for each in names_of(settings, float)
    }
    keys |= {each: (_value_type(hints[each]), list(getattr(settings, each))) for each in names_of(settings, tuple)}
    return create_model(name, __base__=base, __module__=base.__module__, **keys)


def _array_type(shape: str) -> Any:
    """Return nested lists of numbers for the shape of an array, see `checks.Checked`."""
    *outer, last = shape.split()
    found: Any = Vector if last == "d" else _list_of(FiniteFloat, last)
    for size in reversed(outer):
        found = _list_of(found, size)
    return found


def _list_of(item: Any, size: str) -> Any:
    """Return lists of that size, a number or n for any."""
    items: Any = GenericAlias(list, (item,))
    return Annotated[items, Field(min_length=int(size), max_length=int(size))] if size.isdigit() else items


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _value_type(hint: Any) -> Any:
    """Return the type in files of a field with this annotation; None if there is none.

    A number may be annotated with its check (`checks.Positive`), text with the texts that are known, as in
    Annotated[str, ("linear", "smooth")]. Parts and tuples of parts are annotated with their protocol. A tuple of fixed
    length is a list of that length, a mapping from texts a mapping.
    """
    if get_origin(hint) is Annotated:
        value, condition = get_args(hint)[:2]
        return Literal[condition] if value is str else NUMBERS.get(condition)
    if get_origin(hint) is tuple and get_args(hint)[1:] == (...,):
        item = _value_type(get_args(hint)[0])
        return None if item is None else GenericAlias(list, (item,))
    if get_origin(hint) is tuple:
        items = tuple(_value_type(item) for item in get_args(hint))
        return None if None in items else Annotated[GenericAlias(tuple, items), BeforeValidator(_as_tuple)]
    if get_origin(hint) is Mapping and get_args(hint)[0] is str:
        item = _value_type(get_args(hint)[1])
        return None if item is None else GenericAlias(dict, (str, item))
    return FiniteFloat if hint is float else hint if hint in (bool, int, str) else PARTS.get(hint)
