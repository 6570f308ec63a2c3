"""What the models of all parts of a scenario file share."""

from abc import ABC, abstractmethod
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

Vector = Annotated[list[FiniteFloat], Field(min_length=2, max_length=3)]
Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]


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
