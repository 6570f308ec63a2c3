"""Reader of files of decisions, and their repetition."""

import json
import os
from pathlib import Path
from typing import Any, Final, NamedTuple

import slalom.lookahead.expected_loss
import slalom.vehicle.navigator  # noqa: F401  # these add the classes of their decisions
from slalom.base.checks import shown
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.decision import Decision
from slalom.decision.decision import Record
from slalom.decision.document import FORMAT, made, result
from slalom.io.table import text_of
from slalom.sim.scenario import unfit_times

KEYS: Final = ("format", "versions", "inputs", "decision")
"""Keys of the file of a decision."""


class DecisionFile(NamedTuple):
    """The inputs of a decision, and its result as it was written."""

    inputs: Any  # a `Record`: of a navigator its `DecisionInputs`
    written: dict[str, Any]
    versions: str  # of the packages and the machine that wrote it

    @property
    def navigator(self) -> Any:
        """What decided."""
        return self.inputs.navigator

    def repeat(self) -> tuple[Decision, bool]:
        """The decision, made again, and whether its result equals the written one to the bit.

        It may differ on another machine or with another version.
        """
        decision = self.inputs.repeat()
        return decision, result(decision) == self.written


def is_decision(path: Path | str) -> bool:
    """Whether a file is that of a decision, by its first characters or by the suffix .json."""
    # `Path.is_file` raises an error for a name that no file can have.
    if Path(path).suffix == ".json" or not os.path.isfile(path):
        return Path(path).suffix == ".json"
    with Path(path).open("rb") as file:
        return b"".join(file.read(64).split()).startswith(b'{"format":"slalomdecision')


def read_decision(path: Path | str) -> DecisionFile:
    """Return the content of a file that `Decision.dump` wrote.

    Raises:
        InvalidFile: another file, or one with other content, `file: KEY: expected ..., found ...`.
    """
    path = Path(path)
    content = _json(path)
    try:
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            found = shown(content.get("format") if isinstance(content, dict) else content)
            raise InvalidInput(f"format: expected {FORMAT!r}, found {found}")
        if tuple(content) != KEYS or not isinstance(content["versions"], dict):
            raise InvalidInput(f"expected {', '.join(KEYS)}, found {', '.join(content)}")
        inputs = made(content["inputs"], "inputs")
        if not isinstance(inputs, Record):
            raise InvalidInput(f"inputs: expected those of a decision, found {shown(inputs)}")
        one = inputs.navigator
        for name, mistake in unfit_times(one.horizon, one.period, 0.0, one.horizon, one.holds):
            raise InvalidInput(f"inputs.navigator.{'period' if name == 'duration' else name}: {mistake}")
    except InvalidInput as error:
        raise InvalidFile([f"{path}: {error}"]) from None
    versions = ", ".join(f"{name} {number}" for name, number in content["versions"].items())
    return DecisionFile(inputs, content["decision"], versions)


def _json(path: Path) -> Any:
    """The content of a JSON file."""
    text = text_of(path, "JSON file")
    try:
        return json.loads(text)
    except RecursionError:
        raise InvalidFile([f"{path}: expected JSON that can be read, found one nested too deeply"]) from None
    except ValueError as error:
        raise InvalidFile([f"{path}: expected JSON, found a mistake: {error}"]) from None
