"""Files of test cases; a study runs one case per seed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from slalom.checks import known
from slalom.errors import InvalidInput
from slalom.io.cadrl import Case
from slalom.sim.gallery.open_space import cadrl
from slalom.sim.scenario import SETTINGS, Scenario


def is_cases(name: str) -> bool:
    """Return whether a scenario is named by a file of test cases (`io.cadrl`)."""
    return name.endswith(".csv")


def case_of(name: str, cases: Sequence[Case], settings: Mapping[str, float], seed: int) -> Scenario:
    """Return the scenario of a case of a file, by its rank from 0 in the order of case numbers; see `open_space.cadrl`.

    Args:
        settings: those of every scenario, and `max_acceleration`.

    Raises:
        InvalidInput: no such case or setting; robots that overlap at the start.
    """
    for key in settings:
        known(key, f"parameter of {Path(name).name}", ["max_acceleration", *SETTINGS])
    if not 0 <= seed < len(cases):
        raise InvalidInput(f"seed: expected 0 to {len(cases) - 1}, the cases of {name}; found {seed}")
    limits = {key: value for key, value in settings.items() if key == "max_acceleration"}
    scenario = cadrl(cases[seed], **limits).with_settings({k: v for k, v in settings.items() if k not in limits})
    return replace(scenario, parameters={**scenario.parameters, **settings})


def refuse_more(name: str, cases: Sequence[Case], seeds: int) -> None:
    """Raise InvalidInput if a study has more seeds than the file has cases."""
    if seeds > len(cases):
        raise InvalidInput(f"seeds: expected at most {len(cases)}, the cases of {name}; found {seeds}")
