"""Model of the recording in a scenario file, the agents of which are obstacles."""

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat, field_validator

from slalom.checks import did_you_mean
from slalom.errors import InvalidInput
from slalom.io.formats import FORMATS
from slalom.sim.files.schema_base import Model, NotNegative, Positive, Text, Vector

Window = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class RecordingSpec(Model):
    """Recorded agents as obstacles, from a file of any format; its path is relative to the scenario file.

    `radius` [m] is that of agents without one in the file (see `recorded_traffic.read_recorded`). `window` [s] is the
    first and the last time of the used part, in the time of the recording.
    """

    file: str
    format: str | None = None
    radius: NotNegative | None = None
    agents: list[Text] | None = None
    without: list[Text] = Field(default_factory=list)
    window: Window | None = None
    interpolation: Literal["linear", "smooth"] = "smooth"
    gap: Positive | None = None
    jump_speed: Positive | None = None
    frame_rate: Positive | None = None
    unit: Literal["m", "cm"] | None = None
    case: FiniteFloat | None = None
    columns: dict[str, str | None] | None = None
    origin: Vector | None = None
    epoch: Text | None = None
    altitude_unit: Positive | None = None

    @field_validator("format")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        if name is not None and name not in FORMATS:
            hint = did_you_mean(name, list(FORMATS))
            raise InvalidInput(f"expected one of {', '.join(FORMATS)}; found {name!r}{hint}")
        return name

    @field_validator("window")
    @classmethod
    def _forward(cls, window: list[float] | None) -> list[float] | None:
        if window is not None and window[0] >= window[1]:
            raise InvalidInput(f"expected a time and a later one, found {window[0]:g} and {window[1]:g}")
        return window

    def of_format(self) -> dict[str, Any]:
        """Return the given settings of a reader, by name."""
        names = ("frame_rate", "unit", "case", "columns", "origin", "epoch", "altitude_unit")
        given = {name: value for name in names if (value := getattr(self, name)) is not None}
        if self.epoch is not None:
            given["epoch"] = number_or_text(self.epoch)
        return given


def number_or_text(text: str) -> float | str:
    """Return a time as a number of seconds if it is one, else as text."""
    try:
        return float(text)
    except ValueError:
        return text
