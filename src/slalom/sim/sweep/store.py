"""Results of finished runs in a folder, one small file each; an interrupted sweep continues from it."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.writing import write_file
from slalom.sim.sweep.case import Case, Content, Failure, canonical

FORMAT, FORMER = "slalom run 2", ("slalom run 1",)
"""The format that is written, and those that only `Store.adopt` reads: their rows have a `digest` by another rule."""
KEPT: Final = {"format", "case", "row", "sha256"}
"""Keys of a file. An adopted result has `adopted_from`, the digest of the sources that made it, besides."""

Result = dict[str, Any] | Failure


class _Former(NamedTuple):
    """A stored result of other sources."""

    path: Path
    format: str
    content: Content
    row: dict[str, Any]


@dataclass(frozen=True)
class Store:
    """A folder of results: KEY.json holds the content of the case with that key, its result and a digest of both.

    A file is written beside its place and then renamed, so a killed process leaves a whole file or none. (A power
    failure may cut a file off; it is then reported as damaged.) Several sweeps may use one folder at once. Runs that
    were refused or killed are not stored.
    """

    folder: Path

    @classmethod
    def at(cls, folder: Path | str) -> "Store":
        """Return the store in that folder, which is made if it does not exist. Raises InvalidInput if it cannot be."""
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InvalidInput(f"store: expected a folder that exists or can be made, found {reason(error)}") from None
        return cls(Path(folder).resolve())

    def path(self, case: Case) -> Path:
        """Return the path of the result of the case, stored or not."""
        return self.folder / f"{case.key}.json"

    def write(self, case: Case, row: dict[str, Any], adopted_from: str = "") -> None:
        """Store the result of a case. Raises InvalidFile if the file cannot be written.

        Args:
            adopted_from: the digest of the sources that made an adopted result.
        """
        kept = {"format": FORMAT, "case": case.content, "row": row}
        kept |= {"adopted_from": adopted_from} if adopted_from else {}
        write_file(self.path(case), json.dumps({**kept, "sha256": _digest(kept)}, allow_nan=False) + "\n")

    def read(self, cases: Iterable[Case]) -> dict[str, dict[str, Any]]:
        """Return the stored results by key; cases without a result are left out.

        Raises:
            InvalidFile: damaged files, each with its defect.
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
                mistakes.append(f"{path}: expected a readable file, found {reason(error)}")
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

    def adopt(self, cases: Iterable[Case], run: Callable[[Sequence[Case]], Mapping[str, Result]]) -> tuple[int, int]:
        """Store results of former sources as those of the cases, and return how many, and how many runs were compared.

        A former result fits a case without a result if the two differ in the digest of the sources only. The
        description of the method may also differ, apart from its name. Of each scenario, method and former digest of
        the sources the case with the least seed is run again. Every number of the two results must agree to the bit.

        Args:
            run: stores and returns the results of cases by key.

        Raises:
            InvalidFile: a result that is not the same; nothing is adopted then.
        """
        missing = [case for case in cases if not self.path(case).exists()]
        former = {_identity(one.content): one for one in self._former()} if missing else {}
        found = {
            case.key: (case, former[_identity(case.content)]) for case in missing if _identity(case.content) in former
        }
        samples: dict[str, Case] = {}
        for case, one in sorted(found.values(), key=lambda pair: pair[0].seed):
            group = canonical([case.content["scenario"], case.method, one.content["sources"]])
            samples.setdefault(group, case)
        results = run(list(samples.values())) if samples else {}
        for case in samples.values():
            _refuse_another(case, found[case.key][1], results[case.key])
        for key, (case, one) in found.items():
            if key not in results:
                # A digest by a former rule equals no other.
                row = one.row if one.format == FORMAT else {**one.row, "digest": None}
                self.write(case, row, adopted_from=one.content["sources"])
        return len(found) - len(samples), len(samples)

    def _former(self) -> Iterator[_Former]:
        """Yield the results in the folder, the latest of each run last. A damaged file fits no case."""
        for path in sorted(self.folder.glob("*.json"), key=lambda path: path.stat().st_mtime_ns):
            kept = _kept(path.read_bytes(), (FORMAT, *FORMER))
            if not isinstance(kept, str):
                yield _Former(path, kept["format"], kept["case"], kept["row"])


def _identity(content: Content) -> str:
    """Return what two runs share that may differ in the sources and in how the method is described."""
    return canonical({**content, "sources": None, "method": content["method"]["name"]})


def _refuse_another(case: Case, former: _Former, result: Result) -> None:
    """Raises InvalidFile if the former result is not the result of the case to the bit."""
    if isinstance(result, Failure):
        found = result.reason
    else:
        names = [name for name in sorted({*result, *former.row}) if result.get(name) != former.row.get(name)]
        if former.format != FORMAT or former.row.get("digest") is None:
            names = [name for name in names if name != "digest"]
        if not names:
            return
        found = ", ".join(f"{name} {result.get(name)!r} now, in the store {former.row.get(name)!r}" for name in names)
    raise InvalidFile(
        [
            f"{former.path}: expected the result that the present code gives for {case.scenario} with {case.method} "
            f"and seed {case.seed}, found another, so no run is adopted: {found}"
        ]
    )


def _digest(kept: dict[str, Any]) -> str:
    return hashlib.sha256(canonical(kept).encode()).hexdigest()


def _kept(text: bytes, formats: Sequence[str]) -> dict[str, Any] | str:
    """Return the content of a file of one of these formats, or the damage of the file."""
    try:
        kept = json.loads(text)
    except ValueError:
        return f"{len(text)} bytes that are not JSON"
    if not isinstance(kept, dict) or set(kept) - {"adopted_from"} != KEPT or kept["format"] not in formats:
        return f"JSON that is not of format {FORMAT!r}"
    if kept.pop("sha256") != _digest(kept):
        return "content that does not have the digest that it was written with"
    return kept


def _row(text: bytes, case: Case) -> dict[str, Any] | str:
    """Return the result in the file of a case, or the damage of the file."""
    kept = _kept(text, (FORMAT,))
    if isinstance(kept, str):
        return kept
    row: dict[str, Any] = kept["row"]
    return row if kept["case"] == case.content else "another run"


# Shares of a sweep for several machines that write to one store.


Item = TypeVar("Item")

OTHER: Final = Failure("of another shard")
"""Result of a run that a shard leaves to others."""
MISSING: Final = Failure("no result in the store: its shard has not finished, or refused it")
"""Result of a run that a merge does not find."""


class Shard(NamedTuple):
    """Share `number` of `of`, from 1."""

    number: int
    of: int

    @classmethod
    def named(cls, text: str) -> "Shard":
        """Return the shard of a text such as 2/8. Raises InvalidInput for any other text."""
        number, slash, count = text.partition("/")
        if not (slash and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
            raise InvalidInput(f"shard: expected K/N with K from 1 to N, found {text!r}")
        return cls(int(number), int(count))

    def part(self, items: Mapping[str, Item]) -> dict[str, Item]:
        """Return the items of this shard: every `of`-th, so that all shards have as many, up to one.

        Together the shards have every item once, as long as the items and their order are the same.
        """
        return {key: item for k, (key, item) in enumerate(items.items()) if k % self.of == self.number - 1}
