"""Responses of the committed manoeuvres of a run: distinct parts, and the number of one per robot and step."""

import ast
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from slalom.base.checks import shown
from slalom.base.errors import InvalidInput
from slalom.base.registry import from_plain, to_plain
from slalom.decision.document import RESPONSE_KINDS
from slalom.kernels.arrays import Indices
from slalom.model.response import Response

ResponseRow = tuple[Response | str, ...]
"""Responses of N robots; texts for names of peers, and for responses of files of which only the text is known."""


@dataclass(frozen=True, eq=False)
class RecordedResponses:
    """Responses of N robots over T steps.

    Attributes:
        parts: distinct responses, or texts, see `ResponseRow`. number: (T, N) of the part of each robot, from 0.
    """

    parts: ResponseRow
    number: Indices

    @classmethod
    def of(cls, rows: Sequence[Sequence[Response | str]], n: int) -> "RecordedResponses":
        """The responses of T rows with n robots each."""
        parts: list[Response | str] = []
        # Most rows hold the same objects: their texts are made once.
        number_of, number_of_id = dict[tuple[str, object], int](), dict[int, int]()
        for row in rows:
            for part in row:
                if id(part) not in number_of_id:
                    number_of_id[id(part)] = number_of.setdefault(_key(part), len(parts))
                    parts += [part] if len(number_of) > len(parts) else []
        numbers = [number_of_id[id(part)] for row in rows for part in row]
        return cls(tuple(parts), np.array(numbers, dtype=np.int64).reshape(-1, n))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RecordedResponses) and self.rows == other.rows and self.texts == other.texts

    __hash__ = None  # type: ignore[assignment]  # as of arrays

    def __repr__(self) -> str:
        steps, n = self.number.shape
        return f"<RecordedResponses: {len(self.parts)} of {n} robots, steps: {steps}>"

    @cached_property
    def rows(self) -> tuple[ResponseRow, ...]:
        """The responses, or texts, of each step."""
        return tuple(tuple(self.parts[k] for k in row) for row in self.number.tolist())

    @cached_property
    def texts(self) -> tuple[tuple[str, ...], ...]:
        """The responses of each step as text."""
        texts = self.text_of_parts
        return tuple(tuple(texts[k] for k in row) for row in self.number.tolist())

    @property
    def text_of_parts(self) -> tuple[str, ...]:
        """The text of each part."""
        return tuple(part if isinstance(part, str) else repr(part) for part in self.parts)

    def only(self, robots: slice, steps: slice) -> "RecordedResponses":
        """The responses of some robots in some steps."""
        return replace(self, number=self.number[steps, robots])

    def to_json(self) -> list[str]:
        """Each part as JSON: its kind and fields, or text for one whose kind no file holds."""
        return [json.dumps(_in_file(part), allow_nan=False) for part in self.parts]

    @classmethod
    def from_json(cls, parts: Iterable[str], number: npt.NDArray[Any], shape: tuple[int, int]) -> "RecordedResponses":
        """The responses of a file. Raises InvalidInput for other content, and for numbers without a part."""
        found = tuple(_from_file(part, f"response_parts[{k}]") for k, part in enumerate(parts))
        if number.shape != shape or number.dtype.kind not in "iu":
            raise InvalidInput(
                f"responses: expected whole numbers of shape {shape}, found {number.dtype} of {number.shape}"
            )
        if number.size and not 0 <= number.min() <= number.max() < len(found):
            least, most = number.min(), number.max()
            raise InvalidInput(
                f"responses: expected numbers of the {len(found)} response_parts, found {least} to {most}"
            )
        return cls(found, number.astype(np.int64))

    @classmethod
    def from_texts(cls, rows: Sequence[Sequence[str]], n: int) -> "RecordedResponses":
        """The responses of texts, as files before format 3 hold them."""
        part_of = {text: part_of_text(text) for row in rows for text in row}
        return cls.of([[part_of[text] for text in row] for row in rows], n)


def _key(part: Response | str) -> tuple[str, object]:
    """Equal for responses that do not differ; texts alone may be rounded."""
    try:
        hash(part)
    except TypeError:
        return repr(part), id(part)
    return repr(part), part


def _in_file(part: Response | str) -> dict[str, Any] | str:
    if isinstance(part, str):
        return part
    return to_plain(part, RESPONSE_KINDS, "response") if type(part) in RESPONSE_KINDS.values() else repr(part)


def _from_file(text: str, where: str) -> Response | str:
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise InvalidInput(f"{where}: expected JSON, found {shown(text)}") from None
    if isinstance(found, str):
        return found
    if not isinstance(found, Mapping):
        raise InvalidInput(f"{where}: expected a mapping or text, found {shown(found)}")
    try:
        part: Response = from_plain(found, RESPONSE_KINDS)
    except InvalidInput as error:
        raise InvalidInput(f"{where}: {error}") from None
    return part


def part_of_text(text: str) -> Response | str:
    """The response whose text this is; the text itself if it determines none."""
    try:
        call = ast.parse(text, mode="eval").body
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.args:
            return text
        fields = {str(item.arg): ast.literal_eval(item.value) for item in call.keywords}
        part: Response = from_plain({"kind": call.func.id, **fields}, RESPONSE_KINDS)
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError, InvalidInput):
        return text
    return part if repr(part) == text else text
