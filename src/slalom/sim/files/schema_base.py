"""Types and base classes of the models of scenario and study files."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from datetime import date, datetime
from typing import Annotated, Any, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator
from pydantic.fields import FieldInfo

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
        field = model.model_fields[step] if isinstance(step, str) else field
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
