"""The pieces of obstacles over a window of time are the obstacles."""

import numpy as np
import pytest
from parts import TRAJECTORIES, disc_or_ball

from slalom import BoundedError, Obstacle, ObstacleTable, Trajectory
from slalom.obstacle_pieces import Bodies
from slalom.tolerances import INTERPOLATION

WINDOWS = ((-0.8, 0.5), (0.0, 4.0), (1.0, 2.0), (3.3, 3.5), (6.5, 4.0), (30.0, 4.0))
"""[s] Start and length; the last but one outlives the obstacles that end at 7 s, the last follows them."""
SHARES = np.linspace(0.0, 1.0, 9)
BERNSTEIN = np.stack([(1 - SHARES) ** 3, 3 * SHARES * (1 - SHARES) ** 2, 3 * SHARES**2 * (1 - SHARES), SHARES**3])
ROUNDING = 1e-9


def assert_pieces_follow(bodies: Bodies, body: int, track: Trajectory, start: float, horizon: float) -> None:
    """The pieces of a body cover the part of the window in which its obstacle exists, and follow its trajectory."""
    rows = np.flatnonzero(bodies.pieces.body == body)
    times = bodies.pieces.times[rows]
    first, last = max(track.span[0], start) - start, min(track.span[1], start + horizon) - start
    assert times[0, 0] <= first + ROUNDING
    assert times[-1, 1] >= last - ROUNDING
    np.testing.assert_allclose(times[1:, 0], times[:-1, 1], atol=ROUNDING)
    for row, (begin, end) in zip(rows, times):
        elapsed = begin + (end - begin) * SHARES
        points = np.einsum("kd,ks->sd", bodies.pieces.points[row], BERNSTEIN)
        expected = track.position(np.clip(start + elapsed, *track.span))
        error = getattr(track, "tolerance", INTERPOLATION) + ROUNDING
        assert np.linalg.norm(points - expected, axis=1).max() <= error


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize(("start", "horizon"), WINDOWS)
def test_pieces_of_a_window_are_the_trajectory(start: float, horizon: float, uncertain: bool, d: int) -> None:
    """Of each obstacle alone and of all together; an obstacle that does not exist within the window has no piece."""
    error = BoundedError(0.1, 0.05) if uncertain else None
    tracks = [track(d) for track in TRAJECTORIES.values()]
    obstacles = [Obstacle(disc_or_ball(0.5, d), track, uncertainty=error) for track in tracks]
    robot = disc_or_ball(0.3, d)
    for some in ([obstacle] for obstacle in obstacles):
        bodies = ObstacleTable(some, start, horizon).bodies(robot)
        track = some[0].trajectory
        if track.span[0] < start + horizon and track.span[1] > start:
            assert_pieces_follow(bodies, 0, track, start, horizon)
        else:
            assert len(bodies.pieces.body) == 0
    bodies = ObstacleTable(obstacles, start, horizon).bodies(robot)
    for body, owner in enumerate(bodies.owner):
        assert_pieces_follow(bodies, body, tracks[owner], start, horizon)
    assert {int(owner) for owner in bodies.owner} == {
        k for k, track in enumerate(tracks) if track.span[0] < start + horizon and track.span[1] > start
    }


@pytest.mark.parametrize("d", [2, 3])
def test_a_window_moved_along_one_stretch_has_the_same_pieces(d: int) -> None:
    """Pieces that are cut once for many decisions are those of the obstacles at each of them."""
    smooth = [Obstacle(disc_or_ball(0.5, d), TRAJECTORIES[name](d)) for name in ("circular", "circular_clockwise")]
    robot = disc_or_ball(0.3, d)
    for start in np.arange(0.0, 20.0, 0.7):
        bodies = ObstacleTable(smooth, start, 4.0).bodies(robot)
        for body in range(2):
            assert_pieces_follow(bodies, body, smooth[body].trajectory, start, 4.0)
        assert np.array_equal(bodies.heads, np.flatnonzero(np.diff(bodies.pieces.body, prepend=-1)))
