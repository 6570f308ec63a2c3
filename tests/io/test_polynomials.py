"""Polynomial trajectories from files."""

import os
from pathlib import Path

import numpy as np
import pytest

from slalom import InvalidFile
from slalom.io.table import read_polynomials

TWO = """\
duration,x^0,x^1,x^2,x^3,y^0,y^1,y^2,y^3,yaw^0,yaw^1,
2.0,0,1,0,0,5,0,0.5,0,0,0,
1.0,2,1,0,-0.1,7,2,0,0,0,0,
"""
RECORDED = Path(os.environ.get("SLALOM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "air3d" / "polynomials"


def write(folder: Path, content: str) -> Path:
    path = folder / "pieces.csv"
    path.write_text(content)
    return path


def test_pieces_are_read(tmp_path: Path) -> None:
    path = read_polynomials(write(tmp_path, TWO), start=10.0)
    assert path.span == (10.0, 13.0)
    assert path.dimension == 2
    np.testing.assert_allclose(path.position([10.0, 11.0, 12.0, 13.0]), [[0, 5], [1, 5.5], [2, 7], [2.9, 9]])
    np.testing.assert_allclose(path.velocity(12.5), [1 - 0.3 * 0.25, 2])


def test_three_axes(tmp_path: Path) -> None:
    path = read_polynomials(write(tmp_path, "duration,x^0,x^1,y^0,y^1,z^0,z^1\n1,0,1,0,2,0,3\n"))
    np.testing.assert_allclose(path.position(1.0), [1, 2, 3])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", r"pieces\.csv:1:1: expected a header .* found 'nothing'"),
        ("t,x^0\n", r":1:1: expected a header"),
        ("duration,x^0,x^1,y^0\n", r":1:1: expected a header"),
        (TWO.splitlines()[0] + "\n", r":2:1: expected rows after the header, found none"),
        (TWO.replace("-0.1", "left"), r":3:1: expected 12 numbers, found '1\.0,2,1,0,left"),
        (TWO + "1.0,2\n", r":4:1: expected 12 numbers"),
        (TWO.replace("1.0,2,1", "1.0,3,1"), r"pieces that meet, found a jump of 1 m after piece 0"),
        (TWO.replace("2.0,0", "-2.0,0"), r"durations: expected times above 0"),
    ],
)
def test_mistakes_are_named(content: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match=message):
        read_polynomials(write(tmp_path, content))


def test_planned_drone_flights() -> None:
    """Real planner output of degree 7, where it is at hand."""
    files = sorted(RECORDED.glob("*/pp*.csv"))
    if not files:
        pytest.skip(f"no recorded polynomials at {RECORDED.name}")
    for file in files:
        path = read_polynomials(file)
        times = np.linspace(*path.span, 500)
        pieces = path.path(*path.span)
        assert path.dimension == 3
        assert np.all(pieces.error <= 1e-6)
        assert np.linalg.norm(path.velocity(times), axis=-1).max() <= path.speed_bound(*path.span)
