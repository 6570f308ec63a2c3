"""Files of test cases, of which a study runs one with each seed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from slalom.errors import InvalidInput
from slalom.io.cadrl import Case
from slalom.sim.gallery.open_space import cadrl
from slalom.sim.scenario import SETTINGS, Scenario


def is_cases(name: str) -> bool:
    """Whether the name of a scenario is that of a file of test cases (`io.cadrl`)."""
    return name.endswith(".csv")


def case_of(name: str, cases: Sequence[Case], settings: Mapping[str, float], seed: int) -> Scenario:
    """The case at that place of a file of cases, 0 the one of the least number; see `crowds.cadrl`.

    Args:
        settings: of every scenario, and `max_acceleration`.

    Raises:
        InvalidInput: no such case or setting; robots that overlap at the start.
    """
    unknown = [key for key in settings if key != "max_acceleration" and key not in SETTINGS]
    if unknown:
        names = ", ".join(["max_acceleration", *SETTINGS])
        raise InvalidInput(f"parameter of {Path(name).name}: expected one of {names}; found {unknown[0]!r}")
    if not 0 <= seed < len(cases):
        raise InvalidInput(f"seed: expected 0 to {len(cases) - 1}, the cases of {name}; found {seed}")
    pushes = {key: value for key, value in settings.items() if key == "max_acceleration"}
    scenario = cadrl(cases[seed], **pushes).with_settings({k: v for k, v in settings.items() if k not in pushes})
    return replace(scenario, parameters={**scenario.parameters, **settings})


def refuse_more(name: str, cases: Sequence[Case], seeds: int) -> None:
    """Raises InvalidInput if a study asks for more cases than the file has."""
    if seeds > len(cases):
        raise InvalidInput(f"seeds: expected at most {len(cases)}, the cases of {name}; found {seeds}")
