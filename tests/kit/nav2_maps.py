"""Maps of nav2 for tests, and what `occupancy` and `read_map` refuse."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from slalom import occupancy, read_map, scan
from slalom.io import walls_child

KEYS = {
    "image": "map.pgm",
    "resolution": "0.05",
    "origin": "[-1.0, 2.0, 0.0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.25",
}


def map_file(folder: Path, pixels: object = ((0, 255), (128, 0)), **changes: str | None) -> Path:
    """A map with some keys changed, or without those that are None, and its image."""
    keys = {name: value for name, value in {**KEYS, **changes}.items() if value is not None}
    path = folder / "map.yaml"
    path.write_text("".join(f"{name}: {value}\n" for name, value in keys.items()))
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(folder / KEYS["image"])
    return path


def text_file(folder: Path, text: str) -> Path:
    """A map file of this text."""
    (folder / "map.yaml").write_text(text)
    return folder / "map.yaml"


def changed(**changes: str | None) -> Callable[[Path], object]:
    """A call that reads a map with other keys."""
    return lambda folder: read_map(map_file(folder, **changes))


def cut_image(folder: Path) -> object:
    """Read a map whose image ends early."""
    path = map_file(folder, np.zeros((50, 50)))
    image = folder / KEYS["image"]
    image.write_bytes(image.read_bytes()[:100])
    return read_map(path)


def not_an_image(folder: Path) -> object:
    """Read a map whose image is a text."""
    path = map_file(folder)
    (folder / KEYS["image"]).write_text("a wall")
    return read_map(path)


def no_image(folder: Path) -> object:
    """Read a map whose image is not there."""
    path = map_file(folder)
    (folder / KEYS["image"]).unlink()
    return read_map(path)


def read_image(pixels: np.ndarray, read: Callable[[Path], object], folder: Path) -> object:
    """Read a map whose image is a small file with many cells."""
    Image.fromarray(pixels).save(folder / "map.png")
    return read(map_file(folder, image="map.png"))


def image_here(path: Path) -> object:
    """Read the image of a map as the process does that reads it."""
    image = path.with_name("map.png")
    return walls_child.image(str(image), image.stat().st_size, "trinary", False, 0.65, 0.25)


REFUSED_IMAGES = {
    "8200 x 8200 cells, more than 67108864": np.zeros((8200, 8200), np.bool_),
    "2998500 changes between cells in .* bytes": np.indices((1500, 2000)).sum(axis=0) % 2 == 0,
}
"""What the process that reads images refuses, and the pixels of one."""

CELLS = np.zeros((3, 4), np.int8)
OF_GRIDS: dict[str, Callable[[Path], object]] = {
    r"grid: expected rows of one length": lambda _: occupancy([[0, 100], [0]], 0.1),
    r"grid: expected an array \(height, width\) of cells, found shape \(12,\)": lambda _: occupancy(CELLS.ravel(), 0.1),
    r"grid: expected whole numbers from -1 to 100, or booleans, found an array of float64": lambda _: occupancy(
        CELLS * 1.0, 0.1
    ),
    r"grid\[2, 1\]: expected a value from -1 to 100, found 254": lambda _: occupancy([[0, 0], [0, 0], [0, 254]], 0.1),
    r"resolution: expected a number above 0": lambda _: occupancy(CELLS, 0.0),
    r"origin: expected \(x, y\) or \(x, y, heading\), found shape \(4,\)": lambda _: occupancy(
        CELLS, 0.1, (0, 0, 0, 1)
    ),
    r"occupied: expected a number from 0 to 100 %, found 101": lambda _: occupancy(CELLS, 0.1, occupied=101),
    r"unknown: expected True or False, found 2": lambda _: occupancy(CELLS, 0.1, unknown=2),
    r"part: expected cells within 4 x 3, found columns 3 to 4 and rows 0 to 1": lambda _: occupancy(CELLS, 0.1).updated(
        np.zeros((2, 2), np.int8), 0, 3
    ),
    r"ranges: expected numbers, found others": lambda _: scan(["far"], [0.0]),
    r"ranges: expected an array of shape \(n,\), found shape \(1, 1\)": lambda _: scan([[1.0]], [0.0]),
    r"part: expected whole numbers": lambda _: occupancy(CELLS, 0.1).updated([[0.5]]),
    r"row: expected a whole number": lambda _: occupancy(CELLS, 0.1).updated([[0]], -1),
    r"origin: expected": lambda _: occupancy(CELLS, 0.1).at((1.0, 2.0)),
}
"""Of occupancy grids."""

OF_MAPS: dict[str, Callable[[Path], object]] = {
    r"map\.yaml: expected a mapping with the keys image, .*; found 'hello'": lambda f: read_map(text_file(f, "hello")),
    r"map\.yaml: resolution: expected this key, found none": changed(resolution=None),
    r"map\.yaml:2:13: resolution: expected a number above 0, found -1": changed(resolution="-1"),
    r"map\.yaml:1:8: image: expected text, found 7": changed(image="7"),
    r"expected a readable image, found a folder": changed(image='""'),
    r"map\.yaml:3:9: origin: expected .*\(3,\), found .*\(2,\)": changed(origin="[1.0, 2.0]"),
    r"map\.yaml:3:9: origin: expected numbers": changed(origin="[1.0, north, 0.0]"),
    r"map\.yaml:4:9: negate: expected True or False, found 2": changed(negate="2"),
    r"map\.yaml:5:18: occupied_thresh: expected": changed(occupied_thresh="65"),
    r"map\.yaml:6:14: free_thresh: expected less than occupied_thresh, found 0\.7": changed(free_thresh="0.7"),
    r"map\.yaml:7:7: mode: expected one of trinary, scale, raw; found 'trinay'.*trinary": changed(mode="trinay"),
    r"map\.yaml:\d+:\d+: expected YAML": lambda f: read_map(text_file(f, "image: [")),
    r"nowhere\.yaml: expected a readable YAML file, found no such file": lambda f: read_map(f / "nowhere.yaml"),
    r"map\.pgm: expected a readable image, found no such file": no_image,
    r"map\.pgm: expected an image that can be read, found another file": not_an_image,
    r"map\.pgm: expected an image that can be read, found": cut_image,
    **{
        rf"map\.png: expected an image that can be read, found {said}": partial(read_image, pixels, read_map)
        for said, pixels in REFUSED_IMAGES.items()
    },
}
"""Of maps in files."""
