"""Finished runs in a folder, one small file each, so that a sweep that was interrupted goes on where it was."""

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

from slalom.errors import InvalidFile, InvalidInput
from slalom.sim.sweep.case import Case, canonical

FORMAT: Final = "slalom run 1"


@dataclass(frozen=True)
class Store:
    """A folder of results: KEY.json holds the run of the case with that key, its content and its own digest.

    A file is written under another name and then renamed, so there is all of it or none, whoever is killed meanwhile;
    a file of such a name, *.part, that is left over is never read. (Should the power fail, a file may be cut off: it is
    then named as damaged.) Several sweeps may use one folder at once. Runs that were refused or killed are not kept.
    """

    folder: Path

    @classmethod
    def at(cls, folder: Path | str) -> "Store":
        """The store in that folder, which is made if need be. Raises InvalidInput if it cannot be."""
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InvalidInput(f"store: expected a folder that is there or can be made, found {error}") from None
        return cls(Path(folder).resolve())

    def path(self, case: Case) -> Path:
        """Where the result of the case is, or will be."""
        return self.folder / f"{case.key}.json"

    def write(self, case: Case, row: dict[str, Any]) -> None:
        """Keep the result of a case. Raises InvalidFile if the file cannot be written."""
        kept = {"format": FORMAT, "case": case.content, "row": row}
        path = self.path(case)
        part = self.folder / f".{path.stem}-{uuid4().hex}.part"
        try:
            part.write_text(json.dumps({**kept, "sha256": _digest(kept)}, allow_nan=False) + "\n")
            os.replace(part, path)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InvalidFile([f"{path}: expected a file that can be written, found {reason}"]) from None

    def read(self, cases: Iterable[Case]) -> dict[str, dict[str, Any]]:
        """The results by key of those of the cases that have one.

        Raises:
            InvalidFile: files that do not hold what was written to them, each with what was found.
        """
        rows: dict[str, dict[str, Any]] = {}
        mistakes: list[str] = []
        for case in cases:
            path = self.path(case)
            try:
                text = path.read_bytes()
            except FileNotFoundError:
                continue
            except OSError as error:
                mistakes.append(f"{path}: expected a readable file, found {error.strerror or error}")
                continue
            row = _row(text, case)
            if isinstance(row, str):
                mistakes.append(
                    f"{path}: expected the result of a finished run, found {row}; delete it, and the run is made again"
                )
            else:
                rows[path.stem] = row
        if mistakes:
            raise InvalidFile(mistakes)
        return rows


def _digest(kept: dict[str, Any]) -> str:
    return hashlib.sha256(canonical(kept).encode()).hexdigest()


def _row(text: bytes, case: Case) -> dict[str, Any] | str:
    """The result in the file of a case, or what is wrong with the file."""
    try:
        kept = json.loads(text)
    except ValueError:
        return f"{len(text)} bytes that are not JSON"
    if not isinstance(kept, dict) or set(kept) != {"format", "case", "row", "sha256"} or kept["format"] != FORMAT:
        return f"JSON that is not of format {FORMAT!r}"
    if kept.pop("sha256") != _digest(kept):
        return "content that does not have the digest that it was written with"
    row: dict[str, Any] = kept["row"]
    return row if kept["case"] == case.content else "another run"
