"""Recorded tracks from CSV files."""

from pathlib import Path

import numpy as np
import pytest

from slalom import InvalidFile, InvalidInput
from slalom.io.table import read_tracks, sample_data, window

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
    return read_tracks(path, **settings)


def mistakes(folder: Path, content: str | bytes) -> list[str]:
    """What is wrong with a file of this content, without its folder."""
    with pytest.raises(InvalidFile) as caught:
        read(folder, content)
    prefix = f"{folder / 'tracks.csv'}:"
    assert caught.value.mistakes
    assert all(line.startswith(prefix) for line in caught.value.mistakes), caught.value.mistakes
    return [line[len(prefix) :] for line in caught.value.mistakes]


def test_tracks_by_id(tmp_path: Path) -> None:
    tracks = read(tmp_path, TWO)
    assert list(tracks) == [-2, 3]
    np.testing.assert_array_equal(tracks[3].times, [0.0, 0.5, 1.5])
    np.testing.assert_array_equal(tracks[3].positions, [[0, 1], [0.5, 1.5], [1.25, 2]])
    np.testing.assert_array_equal(tracks[-2].positions, [[5, 5], [5, 4]])
    assert tracks[3].interpolation == "smooth"
    assert read(tmp_path, TWO, interpolation="linear")[3].interpolation == "linear"


def test_rows_may_come_in_any_order(tmp_path: Path) -> None:
    head, *rows = TWO.splitlines()
    ordered = read(tmp_path, TWO)
    for seed in range(5):
        shuffled = np.random.default_rng(seed).permutation(rows)
        tracks = read(tmp_path, "\n".join([head, *shuffled]))
        assert list(tracks) == list(ordered)
        for agent, track in tracks.items():
            assert track.times.tobytes() == ordered[agent].times.tobytes()
            assert track.positions.tobytes() == ordered[agent].positions.tobytes()


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
    tracks = read(tmp_path, "t,id,x,y\n0,1,1e3,-.5\n+1.0,1,1E-3,5.\n")
    np.testing.assert_array_equal(tracks[1].positions, [[1000.0, -0.5], [0.001, 5.0]])


def test_blank_lines_are_skipped(tmp_path: Path) -> None:
    assert list(read(tmp_path, TWO.replace("0.5,3", "\n0.5,3") + "\n\n")) == [-2, 3]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("1.0,3,left,0", "4:7: expected a number, found 'left'"),
        ("1.0,3,0,", "4:9: expected a number, found ''"),
        ("late,3,0,0", "4:1: expected a number, found 'late'"),
        ("1.0,car,0,0", "4:5: expected a number, found 'car'"),
        ("1.0,3", "4:1: expected at least 4 columns, found 2"),
        ("1.0;3;0;0", "4:1: expected at least 4 columns, found 1"),
        ("1.0,3,inf,0", "4:7: expected a finite number, found 'inf'"),
        ("nan,3,0,0", "4:1: expected a finite number, found 'nan'"),
        ("1.0,3,1_0,0", "4:7: expected a number, found '1_0'"),
        ('1.0,3,"1",0', "4:7: expected a number, found '\"1\"'"),
    ],
)
def test_a_bad_cell_is_named_with_its_place(line: str, expected: str, tmp_path: Path) -> None:
    content = f"t,id,x,y\n0.0,3,0,0\n0.5,3,1,0\n{line}\n"
    assert mistakes(tmp_path, content) == [expected]


def test_every_bad_cell_is_named(tmp_path: Path) -> None:
    content = "t,id,x,y\n0,1,a,b\n1,1,0,0\n2,1,c,0\n"
    assert mistakes(tmp_path, content) == [
        "2:5: expected a number, found 'a'",
        "2:7: expected a number, found 'b'",
        "4:5: expected a number, found 'c'",
    ]


def test_many_mistakes_are_counted(tmp_path: Path) -> None:
    """Ten are shown."""
    found = mistakes(tmp_path, "t,id,x,y\n" + "0,1,?,0\n" * 25)
    assert len(found) == 11
    assert found[-1] == " and 15 more"


def test_places_are_right_after_blank_lines(tmp_path: Path) -> None:
    """Whatever is wrong, its line is counted as an editor counts."""
    head = "t,id,x,y\n\n0,1,0,0\n\n"
    assert mistakes(tmp_path, head + "1,1,nan,0\n") == ["5:5: expected a finite number, found 'nan'"]
    assert mistakes(tmp_path, head + "1,1,?,0\n") == ["5:5: expected a number, found '?'"]
    assert mistakes(tmp_path, head + "1,1,0,0\n2,9,0,0\n") == ["6:1: expected at least two rows of agent 9, found one"]
    assert mistakes(tmp_path, head + "0,1,5,5\n") == ["5:1: expected one row of agent 1 at 0 s, found two"]


def test_rows_that_do_not_make_a_track(tmp_path: Path) -> None:
    """All of them at once."""
    content = TWO + "7.0,8,0,0\n0.5,3,9,9\n7.0,9,0,0\n"
    assert sorted(mistakes(tmp_path, content)) == [
        "7:1: expected at least two rows of agent 8, found one",
        "8:1: expected one row of agent 3 at 0.5 s, found two",
        "9:1: expected at least two rows of agent 9, found one",
    ]


def test_an_id_is_a_whole_number(tmp_path: Path) -> None:
    """1.5 and 1.7 are not agent 1."""
    content = "t,id,x,y\n0,1.5,0,0\n1,1.5,0,0\n0,1.7,5,5\n1,1.7,5,5\n"
    assert any("2:3: expected a whole number, found '1.5'" in line for line in mistakes(tmp_path, content))
    assert list(read(tmp_path, "t,id,x,y\n0,1.0,0,0\n1,1.0,0,0\n")) == [1]


@pytest.mark.parametrize(
    ("content", "found"),
    [
        ("", "nothing"),
        ("\n\n", ""),
        ("0,1,0,0\n1,1,1,0\n", "'0,1,0,0'"),
        ("id,t,x,y\n1,0,0,0\n", "'id,t,x,y'"),
        ("t;id;x;y\n", "'t;id;x;y'"),
        ("T,ID,X,Y\n", "'T,ID,X,Y'"),
        ("t,id,x\n", "'t,id,x'"),
    ],
)
def test_a_header_that_does_not_fit(content: str, found: str, tmp_path: Path) -> None:
    (line,) = mistakes(tmp_path, content)
    assert line.startswith("1:1: expected a header t,id,x,y[,z], found ")
    assert found in line


@pytest.mark.parametrize("content", ["t,id,x,y\n", "t,id,x,y", "t,id,x,y,z\n\n"])
def test_a_header_alone(content: str, tmp_path: Path) -> None:
    """No rows are no tracks: a mistake, not an empty world."""
    (line,) = mistakes(tmp_path, content)
    assert "expected" in line
    assert "found" in line


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01" * 50)
    for name in ("none.csv", "binary.csv", "."):
        with pytest.raises(InvalidFile, match="expected a readable CSV file, found ") as caught:
            read_tracks(tmp_path / name)
        assert len(caught.value.mistakes) == 1


def test_an_unknown_interpolation(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="interpolation: expected one of linear, smooth; found 'cubic'"):
        read(tmp_path, TWO, interpolation="cubic")


def test_sample_data_is_read() -> None:
    tracks = read_tracks(sample_data("roundabout_ring_11.csv"))
    assert list(tracks) == list(range(30))
    assert all(track.span[0] >= 0.0 and track.span[1] <= 120.0 for track in tracks.values())
    text = sample_data("roundabout_ring_11.csv").read_text().splitlines()
    assert sum(len(track.times) for track in tracks.values()) == len(text) - 1
    t, agent, x, y = (float(cell) for cell in text[777].split(",")[:4])
    np.testing.assert_array_equal(tracks[int(agent)].position(t), [x, y])


def test_window(tmp_path: Path) -> None:
    """Tracks that exist at some time in between; one that only touches an end does not."""
    tracks = read(tmp_path, TWO)
    assert window(tracks.values(), 0.0, 2.0) == [tracks[-2], tracks[3]]
    assert window(tracks.values(), 0.45, 0.5) == [tracks[3]]
    assert window(tracks.values(), 0.4, 0.45) == [tracks[3]]
    assert window(tracks.values(), -1.0, 0.0) == window(tracks.values(), 1.5, 9.0) == []
