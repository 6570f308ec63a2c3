"""The limited sight of the robots of a scenario, from its settings."""

from collections.abc import Mapping
from typing import Final

from slalom.checks import not_negative
from slalom.errors import InvalidInput
from slalom.obstacle.periodic import Period
from slalom.sight import FULL_TURN, OCCLUSIONS, Sight

SIGHT: Final = ("sight_range", "field_of_view", "sight_near", "occlusion", "hidden_speed", "passive_safety")
"""Settings of scenarios that limit sight."""


def sight_of(settings: Mapping[str, float]) -> Sight | None:
    """The sight of the settings SIGHT; None where nothing is limited.

    Raises:
        InvalidInput: a setting out of its range; passive safety without a range.
    """
    for name in SIGHT:
        not_negative(settings[name], name)
    for name in ("occlusion", "passive_safety"):
        if settings[name] not in (0.0, 1.0, 2.0):
            raise InvalidInput(f"{name}: expected 0, 1 or 2, found {settings[name]:g}")
    passive = settings["passive_safety"]
    if passive and not settings["sight_range"]:
        raise InvalidInput("sight_range: expected one above 0 with passive_safety, found 0")
    if not any(settings[name] for name in ("sight_range", "field_of_view", "occlusion")):
        return None
    return Sight(
        settings["sight_range"] or float("inf"),
        settings["field_of_view"] or FULL_TURN,
        settings["sight_near"],
        OCCLUSIONS[int(settings["occlusion"])],
        settings["hidden_speed"] if passive else None,
        passive == 2.0,
    )


def refuse_sight(sight: Sight | None, dimension: int, robots: int, period: Period | None) -> None:
    """Raise InvalidInput for limited sight in space or in a periodic world, and passive safety of several robots."""
    if sight is None:
        return
    if dimension != 2:
        raise InvalidInput(f"sight_range: expected limited sight in the plane only, found dimension {dimension}")
    if period is not None:
        raise InvalidInput(f"period: expected none with limited sight, found {period}")
    if sight.hidden_speed is not None and robots > 1:
        raise InvalidInput(f"passive_safety: expected 0 for several robots, found it for {robots}")
