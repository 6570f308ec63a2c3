"""Videos of runs, read back."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from draws import draws

from slalom import Disc, Limits, Obstacle, PathGoal, Polyline, Rectangle, State, method
from slalom.cli import DONE, call
from slalom.model.goal import Goal
from slalom.model.trajectory import Circular, ConstantVelocity, Stationary
from slalom.sim import Recording, decision_at, gallery, simulate
from slalom.sim.explanation import explanation, reasons_of
from slalom.sim.run.recorded import recorded
from slalom.sim.scenario import Robot, Scenario
from slalom.view import animate, decision
from slalom.view.film import GRID, DecisionFilm, Film

av = pytest.importorskip("av", reason="slalom[video] is not installed: videos are not written")
ROBOT = np.array([213, 94, 0])
"""Vermilion, the colour of a single robot and of the first of several."""
GOAL = np.array([0, 114, 178])
"""Blue, the colour of the goal of a single robot."""


@pytest.fixture(scope="module")
def run() -> Recording:
    """A robot that passes a wall, a truck that turns, and a car that appears later."""
    obstacles = (
        Obstacle(Rectangle(4.0, 1.5), Circular((6, 4), 3.0, 2.0), heading="motion"),
        Obstacle(Disc(0.5), Stationary((5, -3))),
        Obstacle(Disc(0.4), ConstantVelocity((8, -4), (0, 1))),
    )
    robot = Robot(Disc(0.6), Limits(3.0, 3.0), State((0, 0), (2, 0)), Goal(Stationary((14, 0)), 0.5))
    return simulate(Scenario("passing", (robot,), obstacles, duration=1.0), method("nao"))


def pictures(path: Path) -> tuple[list[np.ndarray], list[float]]:
    """The pictures of a video, and their times [s]."""
    with av.open(str(path)) as file:
        frames = list(file.decode(video=0))
    return [frame.to_ndarray(format="rgb24") for frame in frames], [float(frame.time) for frame in frames]


def centre(picture: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Middle (column, row) of the pixels of about a colour."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - colour).max(axis=2) < 40)
    return np.array([0.5 * (columns.min() + columns.max()), 0.5 * (rows.min() + rows.max())])


def pixel(film: Film, position: np.ndarray, panel: int = 0) -> np.ndarray:
    """Column and row of a position in a panel."""
    x, y = film.axes[panel].transData.transform(position)
    return np.array([x, film.height - y])


@pytest.mark.parametrize("suffix", draws([".mp4", ".gif"]))
def test_a_video_shows_the_run(run: Recording, tmp_path: Path, suffix: str) -> None:
    """Number and size of its pictures, its duration, and the robot where it was."""
    path = animate(run, tmp_path / f"run{suffix}", width=480, fps=20.0, speed=0.5, trail=0.0)
    film = Film(run, width=480, fps=20.0, speed=0.5)
    found, times = pictures(path)
    assert len(found) == len(film) == 41
    assert {picture.shape for picture in found} == {(film.height, 480, 3)}
    np.testing.assert_allclose(times, 0.05 * np.arange(41), atol=0.006)
    for k in (0, 13, 40):
        position = film.states(float(film.times[k]))[0][0]
        assert np.abs(centre(found[k], ROBOT) - pixel(film, position)).max() < 2.5


def test_between_steps_robots_move_with_the_acceleration_of_the_step(run: Recording) -> None:
    film = Film(run)
    for k in range(len(run.accelerations)):
        half = run.times[k] + 0.5 * run.dt
        expected = run.positions[k] + 0.5 * run.dt * run.velocities[k] + 0.125 * run.dt**2 * run.accelerations[k]
        np.testing.assert_allclose(film.states(half)[0], expected, atol=1e-12)
        np.testing.assert_allclose(film.states(float(run.times[k]))[0], run.positions[k], atol=1e-9)


def test_obstacles_have_paths_behind_them(run: Recording) -> None:
    """As long as those of robots: none without a trail, and none before an obstacle exists."""
    car = run.obstacles[2]
    for trail, drawn in ((0.0, False), (1.0, True)):
        film = Film(run, trail=trail)
        there, before = (pixel(film, car.trajectory.position(t)).round().astype(int) for t in (0.3, -0.3))
        for (column, row), expected in ((there, drawn), (before, False)):
            around = film.at(1.0)[row - 2 : row + 3, column - 2 : column + 3].astype(int)
            assert (around.max(axis=2).min() < 210) == expected


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_video_that_is_stopped_leaves_no_file(name: str, run: Recording, tmp_path: Path) -> None:
    run.save(tmp_path / "run.h5")
    command = [sys.executable, "-m", "slalom", "animate", "run.h5", "run.mp4", "--speed", "0.0004"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while not list(tmp_path.glob(".slalom-*/run.mp4")):
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(getattr(signal, name))
        with suppress(subprocess.TimeoutExpired):
            process.wait(60)
        process.kill()
    assert process.returncode == 128 + getattr(signal, name)
    assert os.listdir(tmp_path) == ["run.h5"]


def test_in_space_a_run_is_seen_from_above_and_from_the_side(tmp_path: Path) -> None:
    run = simulate(gallery.build("drones_crossing").with_settings({"duration": 0.5}), method("nao"))
    film = Film(run, width=640, trail=0.0)
    picture = film[5]
    position = film.states(float(film.times[5]))[0][0]
    for panel, axes in enumerate(((0, 1), (0, 2))):
        column, row = pixel(film, position[list(axes)], panel).round().astype(int)
        assert np.abs(picture[row - 2 : row + 3, column - 2 : column + 3].astype(int) - ROBOT).max(axis=2).min() < 40


@pytest.mark.parametrize(("x", "y", "width"), [(0.0, 0.0, 720), (1e5, 0.2, 720), (-1e3, -1e4, 320)])
def test_a_long_flat_run_fills_the_picture_and_its_labels_lie_inside(x: float, y: float, width: int) -> None:
    """The panel is as flat as the run, up to a share of its width that the label needs."""
    robot = Robot(Disc(1.0), Limits(9.0, 3.0), State((x, y), (9, 0)), Goal(Stationary((x + 60, y)), 0.5))
    film = Film(simulate(Scenario("road", (robot,), (), duration=0.5), method("nao")), width=width)
    (ax,) = film.axes
    assert ax.bbox.height <= 0.15 * ax.bbox.width
    for axis in (ax.yaxis, ax.xaxis):
        box = axis.get_tightbbox()
        assert box is not None
        assert box.x0 >= 0.0
        assert box.y0 >= 0.0
        assert box.y1 <= film.height


def test_the_path_to_a_goal_is_in_the_picture() -> None:
    goal = PathGoal([(0, 0), (0, 9), (14, 9)])
    robot = Robot(Disc(0.6), Limits(3.0, 3.0), State((0, 0), (2, 0)), goal)
    film = Film(simulate(Scenario("path", (robot,), (), duration=0.5), method("nao")))
    column, row = pixel(film, np.array([0.0, 9.0])).round().astype(int)
    around = film[0][row - 4 : row + 5, column - 4 : column + 5].astype(int)
    assert np.abs(around - GOAL).max(axis=2).min() < 40


def test_a_wall_is_in_the_frame_wherever_its_points_are_counted_from() -> None:
    """As far as it is near; the same wall from a near point gives the same frame."""
    robot = Robot(Disc(0.5), Limits(3.0, 3.0), State((0, 0), (2, 0)), Goal(Stationary((20, 0)), 0.5))
    boxes = []
    for at in ((4.0, 6.0), (4.0, 900.0)):
        points = np.array([(0.0, 6.0), (8.0, 9.0), (8.0, 700.0)]) - (at[0] - 4.0, at[1])
        wall = Obstacle(Polyline(points, radius=0.1), Stationary(at))
        (axes,) = Film(simulate(Scenario("wall", (robot,), (wall,), duration=0.2), method("nao"))).axes
        boxes.append((axes.get_xlim(), axes.get_ylim()))
    np.testing.assert_allclose(*boxes)
    assert boxes[0][1][1] > 9.0
    assert boxes[0][1][1] < 30.0


def test_a_video_of_decisions_shows_each_of_them(run: Recording, tmp_path: Path) -> None:
    """As the figure of the decision that was in force, with the sentences that explain it; also read from the file."""
    film = DecisionFilm(run, width=640, fps=20.0)
    known = recorded(run)
    for t in (0.0, 0.57):
        made = decision_at(run, known.scenario, known.method, int(t / 0.1 + 1e-9))
        track = run.positions[: int(t / 0.1 + 1e-9) + 1, 0]
        extent = film._extent
        goal = known.scenario.robot.goal
        figure = decision(made, film._navigator, goal, track=track, title="", extent=extent, resolution=GRID)
        expected = film._rendered(figure)
        found = film.at(t)
        assert found.shape == (film.height, 640, 3)
        # An odd number of rows loses its last one.
        ends = [expected[-300 - odd : len(expected) - odd] for odd in (0, 1)]
        assert any(np.array_equal(found[-300:], end) for end in ends)
        np.testing.assert_array_equal(found, film.at(t + 0.02))
        assert explanation(made)["sentences"][: len(reasons_of(made)[0].sentences)] == [*reasons_of(made)[0].sentences]
    assert (film.at(0.0) != film.at(0.57)).any()
    path = animate(run, tmp_path / "run.mp4", width=640, fps=4.0, control_space=True)
    frames, times = pictures(path)
    assert times == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    assert frames[2].shape == film.at(0.5).shape
    assert np.abs(frames[2].astype(int) - film.at(0.5)).mean() < 4.0


def test_a_robot_that_has_left_is_not_drawn() -> None:
    """Of two robots, the one that need not stop is in the picture until it arrives."""
    goal = Goal(Stationary((2, 0)), 0.5)
    first = Robot(Disc(0.4), Limits(3.0, 3.0), State((0, 0), (2, 0)), goal)
    second = Robot(Disc(0.4), Limits(3.0, 3.0), State((0, 5), (0, 0)), Goal(Stationary((9, 5)), 0.5), "second")
    run = simulate(Scenario("two", (first, second), (), duration=3.0), method("nao"))
    film = Film(run, trail=0.0)
    shown = [(np.abs(film[k].astype(int) - ROBOT).max(axis=2) < 40).sum() for k in (0, -1)]
    assert np.isfinite(run.arrived[0])
    assert shown[0] > 4 * shown[1]


def test_the_command_writes_and_replaces_videos(run: Recording, tmp_path: Path, capsys) -> None:  # type: ignore[no-untyped-def]
    file, video = tmp_path / "run.h5", tmp_path / "videos" / "run.mp4"
    run.save(file)
    command = ["animate", str(file), str(video), "--width", "320", "--fps", "5"]
    assert call(command) == DONE
    assert capsys.readouterr().out.strip() == str(video)
    assert len(pictures(video)[0]) == 6
    video.write_text("mine")
    assert call(command) == DONE
    assert len(pictures(video)[0]) == 6
    assert call([*command, "--force"]) == DONE  # which earlier versions needed
