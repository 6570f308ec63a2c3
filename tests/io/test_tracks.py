"""Recorded tracks from CSV files."""

from pathlib import Path

import numpy as np
import pytest

from slalom.io.formats import read_recording
from slalom.io.table import sample_data

TWO = """\
t,id,x,y
0.0,3,0.0,1.0
0.0,-2,5.0,5.0
0.5,3,0.5,1.5
0.4,-2,5.0,4.0
1.5,3,1.25,2.0
"""


def read(folder: Path, content: str | bytes, **settings):
    """The tracks of a file of this content."""
    path = folder / "tracks.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return {int(label): agent.trajectory for label, agent in read_recording(path, **settings).agents.items()}


def test_tracks_by_id(tmp_path: Path) -> None:
    tracks = read(tmp_path, TWO)
    assert list(tracks) == [-2, 3]
    np.testing.assert_array_equal(tracks[3].times, [0.0, 0.5, 1.5])
    np.testing.assert_array_equal(tracks[3].positions, [[0, 1], [0.5, 1.5], [1.25, 2]])
    np.testing.assert_array_equal(tracks[-2].positions, [[5, 5], [5, 4]])
    assert tracks[3].interpolation == "smooth"
    assert read(tmp_path, TWO, interpolation="linear")[3].interpolation == "linear"


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("last", [True, False])
def test_line_endings(ending: str, last: bool, tmp_path: Path) -> None:
    """Of Windows too, with and without one at the end."""
    content = TWO if last else TWO.rstrip("\n")
    tracks = read(tmp_path, content.replace("\n", ending).encode())
    assert [len(track.times) for track in tracks.values()] == [2, 3]


def test_a_mark_of_the_byte_order_is_no_mistake(tmp_path: Path) -> None:
    """Spreadsheets write one."""
    assert list(read(tmp_path, b"\xef\xbb\xbf" + TWO.encode())) == [-2, 3]


def test_space(tmp_path: Path) -> None:
    """A fifth column z makes tracks in space; any other is ignored."""
    flat = read(tmp_path, "t,id,x,y,heading\n0,1,0,0,left\n1,1,1,0,right\n")
    space = read(tmp_path, "t,id,x,y,z,kind\n0,1,0,0,7,car\n1,1,1,0,8,car\n")
    spaced = read(tmp_path, "t, id, x, y, z\n0, 1, 0, 0, 7\n1, 1, 1, 0, 8\n")
    assert flat[1].dimension == 2
    assert space[1].dimension == spaced[1].dimension == 3
    np.testing.assert_array_equal(space[1].positions, [[0, 0, 7], [1, 0, 8]])


def test_numbers_in_any_notation(tmp_path: Path) -> None:
    tracks = read(tmp_path, "t,id,x,y\n0,1,1e1,-.5\n+1.0,1,1E-3,5.\n")
    np.testing.assert_array_equal(tracks[1].positions, [[10.0, -0.5], [0.001, 5.0]])


def test_blank_lines_are_skipped(tmp_path: Path) -> None:
    assert list(read(tmp_path, TWO.replace("0.5,3", "\n0.5,3") + "\n\n")) == [-2, 3]


def test_sample_data_is_read() -> None:
    agents = read_recording(sample_data("roundabout_ring_11.csv")).agents
    tracks = {int(label): agent.trajectory for label, agent in agents.items()}
    assert list(tracks) == list(range(30))
    assert all(track.span[0] >= 0.0 and track.span[1] <= 120.0 for track in tracks.values())
    text = sample_data("roundabout_ring_11.csv").read_text().splitlines()
    assert sum(len(track.times) for track in tracks.values()) == len(text) - 1
    t, agent, x, y = (float(cell) for cell in text[777].split(",")[:4])
    np.testing.assert_array_equal(tracks[int(agent)].position(t), [x, y])
