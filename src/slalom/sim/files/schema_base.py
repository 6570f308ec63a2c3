"""What the models of all parts of a scenario file share."""

from abc import ABC, abstractmethod
from datetime import date, datetime
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

Vector = Annotated[list[FiniteFloat], Field(min_length=2, max_length=3)]
Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]


def _as_text(value: object) -> object:
    """Numbers and dates, which YAML makes of what looks like one, as the text that they are meant to be."""
    if isinstance(value, datetime | date):
        return value.isoformat()
    return str(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


Text = Annotated[str, BeforeValidator(_as_text)]


class Model(BaseModel):
    """A mapping that knows its keys and takes a number for a number only."""

    model_config = ConfigDict(extra="forbid", strict=True)


class Built(Model, ABC):
    """A model of a part: what the part itself refuses is a mistake like any other."""

    @abstractmethod
    def build(self) -> object:
        """The part. Raises InvalidInput, which pydantic collects with the other mistakes."""

    @model_validator(mode="after")
    def _buildable(self) -> "Built":
        self.build()
        return self
