"""Model of a scenario file."""

from typing import Annotated

from pydantic import Field, FiniteFloat, ValidationInfo, field_validator

from slalom.errors import InvalidInput
from slalom.methods import HOLDS
from slalom.sim.files.schema_base import Model, NotNegative, Positive
from slalom.sim.files.schema_group import RobotOrGroup
from slalom.sim.files.schema_recording import RecordingSpec
from slalom.sim.files.schema_robot import ObstacleSpec, RobotSpec


class ScenarioSpec(Model):
    """A scenario file."""

    name: str = ""
    robot: RobotSpec | None = None
    robots: list[RobotOrGroup] | None = Field(default=None, min_length=1, validate_default=True)
    obstacles: list[ObstacleSpec] = Field(default_factory=list)
    recording: RecordingSpec | None = None
    start: FiniteFloat = 0.0
    duration: Positive = 60.0
    dt: Positive = 0.1
    replan: NotNegative = 0.0
    horizon: Positive = 6.0
    margin: NotNegative = 0.05
    patience: NotNegative = 0.01
    guided: bool = True
    holds: list[Positive] = Field(default_factory=lambda: list(HOLDS), min_length=1)
    sight_range: NotNegative = 0.0
    field_of_view: NotNegative = 0.0
    sight_near: NotNegative = 0.0
    occlusion: NotNegative = 0.0
    hidden_speed: NotNegative = 0.0
    passive_safety: NotNegative = 0.0
    period: Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=2, max_length=3)] | None = None

    @field_validator("robots")
    @classmethod
    def _one_of_both(cls, robots: list[Model] | None, info: ValidationInfo) -> list[Model] | None:
        # A robot with mistakes of its own is not in the data.
        if "robot" in info.data and (robots is None) == (info.data["robot"] is None):
            raise InvalidInput(f"expected either this key or robot, found {'neither' if robots is None else 'both'}")
        return robots
