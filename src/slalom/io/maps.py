"""Maps of nav2: a YAML file that names an image of occupied, free and unknown cells."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array_of, flag, known, positive, share, shown, text
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.extras import Extra
from slalom.base.tolerances import OCCUPIED
from slalom.obstacle.occupancy import OccupancyTable, occupancy

if TYPE_CHECKING:
    from PIL.Image import Image
    from ruamel.yaml.nodes import Node

KEYS: Final = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
"""Keys that a map has; `mode` may be among them, and others are not used."""
MODES: Final = ("trinary", "scale", "raw")
"""Values of the key `mode`; the first one is the default."""


class _Reading(NamedTuple):
    """How cells are read from an image."""

    mode: str
    negate: bool  # whether white is occupied
    occupied: float  # [1] occupancy above which a cell is occupied
    free: float  # [1] occupancy below which a cell is free


def read_map(path: Path | str, *, occupied: float = OCCUPIED, unknown: bool = False) -> OccupancyTable:
    """The obstacles of a map of nav2: rectangles that cover exactly the occupied cells.

    The image is in any format that Pillow reads, such as PGM and PNG. Its last row begins at the origin.

    Args:
        path: of the YAML file. Keys and modes are those of nav2_map_server (ROS 2 Jazzy).
        occupied: [%] least value of an occupied cell; it matters in the modes `scale` and `raw` alone.
        unknown: whether unknown cells are occupied.

    Raises:
        InvalidFile: a file that cannot be read; a missing key, or a value that is none.
        InvalidInput: a threshold outside of 0 to 100.
        MissingExtra: no Pillow or no ruamel.yaml.
    """
    file = Path(text(str(path), "path"))
    with Extra("maps", "read_map"):
        import PIL.Image  # noqa: F401  # the extra is missing before a file is read

        from slalom.io.yaml_nodes import compose
    root, content = compose(file)
    image, resolution, origin, reading = _checked(file, root, content)
    return occupancy(_cells(_image(image), reading), resolution, origin, occupied=occupied, unknown=unknown)


def _checked(file: Path, root: "Node | None", content: Any) -> tuple[Path, float, Array, _Reading]:
    """Image, resolution [m], origin [m, m, rad] and reading of a map. Raises InvalidFile with all its mistakes."""
    from slalom.io.yaml_nodes import place_of

    if not isinstance(content, dict):
        raise InvalidFile([f"{file}: expected a mapping with the keys {', '.join(KEYS)}; found {shown(content)}"])
    assert root is not None
    places = {key.value: place_of(file, value) for key, value in root.value}
    mistakes = [f"{file}: {key}: expected this key, found none" for key in KEYS if key not in content]
    found: dict[str, Any] = {}
    for key, check in _CHECKS.items():
        try:
            if key in content:
                found[key] = check(content[key], key)
        except InvalidInput as error:
            # A merged key has no place of its own.
            mistakes.append(f"{places.get(key, file)}: {error}")
    free, occupied = found.get("free_thresh", -np.inf), found.get("occupied_thresh", np.inf)
    if free >= occupied:
        place = places.get("free_thresh", file)
        mistakes.append(f"{place}: free_thresh: expected less than occupied_thresh, found {free:g}")
    if mistakes:
        raise InvalidFile(mistakes)
    reading = _Reading(found.get("mode", MODES[0]), found["negate"], occupied, free)
    return file.parent / found["image"], found["resolution"], found["origin"], reading


def _mode(value: Any, name: str) -> str:
    """One of MODES."""
    return known(text(value, name), name, MODES)


_CHECKS: Final[dict[str, Any]] = {
    "image": text,
    "resolution": positive,
    "origin": partial(array_of, shape=(3,)),
    "negate": flag,
    "occupied_thresh": share,
    "free_thresh": share,
    "mode": _mode,
}


def _image(path: Path) -> "Image":
    """An image with all its pixels. Raises InvalidFile for a file that is none."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            image.load()
            return image.copy()
    except UnidentifiedImageError:
        raise InvalidFile([f"{path}: expected an image that Pillow reads, found another file"]) from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        found = reason(error) if isinstance(error, OSError) and error.errno else " ".join(str(error).split())
        raise InvalidFile([f"{path}: expected an image that can be read, found {found}"]) from None


def _cells(image: "Image", reading: _Reading) -> npt.NDArray[np.int64]:
    """Cells (height, width) from -1 to 100 [%] of an image, from its last row on.

    The brightness of a pixel is the mean of its colours, in the mode trinary with its opacity. A cell is as occupied as
    it is dark, with `negate` as it is bright. Source: loadMapFromFile of nav2_map_server.
    """
    if image.mode.startswith("I"):
        colours, full = np.asarray(image, dtype=np.int64)[::-1, :, None], 65535
        opaque = np.ones(colours.shape[:2], np.bool_)
    else:
        rgba, full = np.asarray(image.convert("RGBA"), dtype=np.int64)[::-1], 255
        has_opacity = "A" in image.getbands() or "transparency" in image.info
        colours = rgba if reading.mode == "trinary" and has_opacity else rgba[..., :3]
        opaque = rgba[..., 3] == full
    bright = colours.sum(axis=-1) / (full * colours.shape[-1])
    cells = np.full(bright.shape, -1, np.int64)
    if reading.mode == "raw":
        values = np.round(bright * 255.0).astype(np.int64)
        return np.where(values <= 100, values, cells)
    share = bright if reading.negate else 1.0 - bright
    if reading.mode == "scale":
        cells = np.rint((share - reading.free) / (reading.occupied - reading.free) * 100.0).astype(np.int64)
    cells[share < reading.free] = 0
    cells[share > reading.occupied] = 100
    if reading.mode == "scale":
        cells[~opaque] = -1
    return cells
