"""Messages to the renderer: a JSON object and arrays in one binary block."""

import base64
import gzip
import html
import json
import struct
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.errors import InvalidInput

FORMAT: Final = "slalom view 1"
"""Name of the format of messages, which a `scene` message states."""
TYPES: Final[dict[str, Any]] = {"f4": np.float32, "i2": np.int16, "u1": np.uint8, "i4": np.int32}
"""Types of arrays by their names in a message, little-endian."""
HEAD: Final = struct.Struct("<I")


class Quantised(NamedTuple):
    """Numbers as 16-bit multiples of `step`: value = origin + step * whole, one origin for each last index.

    `order` says how often differences along the first axis were taken, which makes smooth curves compressible. They are
    taken modulo 2^16, so that sums modulo 2^16 return the numbers.
    """

    whole: npt.NDArray[np.int16]
    step: float
    origin: tuple[float, ...]
    absent: npt.NDArray[np.uint8] | None = None
    order: int = 0


def quantised(
    values: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike, *, step: float = 0.0, order: int = 0
) -> Quantised:
    """Quantise values (..., d) between low (d,) and high (d,); those that are not finite count as absent.

    The error is at most half a step, which is at least the largest range / 65000. Values outside are moved to the
    limits.
    """
    numbers, lower, upper = (np.asarray(x, dtype=np.float64) for x in (values, low, high))
    finest = max(float(np.max(upper - lower)), 1e-6) / 65000.0
    origin, chosen = 0.5 * (lower + upper), max(step, finest)
    known = np.isfinite(numbers)
    scaled = np.clip(np.round((np.where(known, numbers, origin) - origin) / chosen), -32500, 32500)
    whole = scaled.astype(np.int16)
    for _ in range(order):
        whole = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))
    absent = None if known.all() else (~known).astype(np.uint8)
    return Quantised(whole, chosen, tuple(float(x) for x in np.atleast_1d(origin)), absent, order)


def pack(kind: str, fields: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any] | Quantised]) -> bytes:
    """Return a message: the length of the JSON text, the text, padding to 8 bytes, and the arrays.

    The object holds `kind`, the `fields`, and under `arrays` the type, shape and position of each array.

    Raises:
        InvalidInput: numbers in `fields` that JSON cannot hold.
    """
    described: dict[str, dict[str, Any]] = {}
    blocks = _Blocks()
    for name, given in arrays.items():
        values = given.whole if isinstance(given, Quantised) else np.asarray(given)
        described[name] = {"type": blocks.type_of(values), "shape": list(values.shape), "at": blocks.add(values)}
        if isinstance(given, Quantised):
            described[name] |= {"step": given.step, "origin": list(given.origin), "order": given.order}
            if given.absent is not None:
                described[name]["absent"] = blocks.add(given.absent)
    try:
        content = json.dumps({"kind": kind, **fields, "arrays": described}, allow_nan=False, separators=(",", ":"))
    except ValueError as error:
        raise InvalidInput(f"{kind}: expected finite numbers in a message, found others ({error})") from None
    text = content.encode()
    text += b" " * (-(len(text) + HEAD.size) % 8)
    return HEAD.pack(len(text)) + text + b"".join(blocks.blocks)


class _Blocks:
    """Arrays one after the other, each from a multiple of 8 bytes on."""

    def __init__(self) -> None:
        self.blocks: list[bytes] = []
        self._end = 0

    @staticmethod
    def type_of(values: npt.NDArray[Any]) -> str:
        """Return the name of the type of an array."""
        return next(name for name, dtype in TYPES.items() if values.dtype == dtype)

    def add(self, values: npt.NDArray[Any]) -> int:
        """Append an array; return its position."""
        at = self._end
        block = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
        self.blocks.append(block + bytes(-len(block) % 8))
        self._end += len(self.blocks[-1])
        return at


def unpack(message: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Return the object of a message and its arrays, quantised ones as float64 with nan where absent."""
    (length,) = HEAD.unpack_from(message)
    fields = json.loads(message[HEAD.size : HEAD.size + length])
    begin, arrays = HEAD.size + length, {}
    for name, one in fields.pop("arrays").items():
        dtype, count = np.dtype(TYPES[one["type"]]).newbyteorder("<"), int(np.prod(one["shape"]))
        values: npt.NDArray[Any] = np.frombuffer(message, dtype, count, begin + one["at"]).reshape(one["shape"])
        if "step" in one:
            for _ in range(one["order"]):
                values = np.cumsum(values, axis=0, dtype=np.int16)
            values = np.asarray(one["origin"]) + one["step"] * values
            if "absent" in one:
                mask = np.frombuffer(message, np.uint8, count, begin + one["absent"]).reshape(one["shape"])
                values[mask != 0] = np.nan
        arrays[name] = values
    return fields, arrays


# ---------------------------------------------------------------------------------------------------------------------
# Pages with the renderer: one file with its data, and the page of the server.


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>body {{ margin: 0 }}</style>
</head>
<body>
<div id="slalom"{live}></div>
{data}<script type="module">{renderer}</script>
</body>
</html>
"""
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src {to}"


@cache
def renderer() -> str:
    """Return the bundled renderer.

    Raises:
        InvalidInput: a bundle that ends its script element.
    """
    text = Path(__file__).with_name("renderer").joinpath("view.js").read_text(encoding="utf-8")
    if "</script" in text.lower():
        raise InvalidInput("renderer: expected a script without an end tag, found one; build it again from web/")
    return text


def block(messages: Iterable[bytes]) -> bytes:
    """Return messages, each after its length, compressed by gzip; equal messages give equal bytes."""
    whole = b"".join(struct.pack("<I", len(message)) + message for message in messages)
    return gzip.compress(whole, compresslevel=9, mtime=0)


def file_page(title: str, messages: Iterable[bytes]) -> str:
    """Return a page that holds its messages and makes no request."""
    data = base64.b64encode(block(messages)).decode()
    held = f'<script type="application/octet-stream" id="slalom-data">{data}</script>\n'
    policy = _POLICY.format(to="'none'")
    return _PAGE.format(policy=policy, title=html.escape(title), live="", data=held, renderer=renderer())


def live_page(title: str) -> str:
    """Return the page of the server, which receives its messages from there."""
    policy = _POLICY.format(to="'self'")
    return _PAGE.format(policy=policy, title=html.escape(title), live=' data-live="1"', data="", renderer=renderer())
