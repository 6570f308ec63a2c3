"""Controls that are found clear without an exact choice are clear, and the exact choice is the same."""

import numpy as np
import pytest
from draws import draws
from fleets import FLEETS, last_decision
from hypothesis import given, strategies as st

from slalom import kernels
from slalom.base.tolerances import CANDIDATES, ELEMENTS
from slalom.kernels.arrays import Pieces
from slalom.kernels.decision.bodies import new_bodies, obstacle_pieces
from slalom.kernels.decision.costs import new_scratch
from slalom.kernels.decision.limits import admissible_set
from slalom.kernels.decision.motion_clear import chord_distance, first_met, met_by_preferred
from slalom.kernels.decision.neighbours import reachable_balls, reachable_neighbours, robots_in_reach
from slalom.kernels.decision.paths import state_on_path, unchanged_control
from slalom.kernels.decision.response_motion import relative_motion
from slalom.kernels.decision.tables import BALL_WINDOWS, Controls, DecisionSettings, ObstaclePieces, Paths
from slalom.kernels.geometry.cubic import new_stack, value
from slalom.kernels.relative_motion.segments import chord_distances
from slalom.kernels.selection.candidates import nearest_admissible
from slalom.kernels.selection.exchange import SAFE, nearest_free

CONTROL = st.lists(st.floats(-50.0, 50.0), min_size=12, max_size=12)


@given(CONTROL)
def test_the_bound_of_one_piece_is_that_of_many(control):
    p, gaps = np.array(control).reshape(4, 3), np.empty(1)
    chord_distances(p[:, :, None].copy(), np.zeros((4, 1)), 0.0, 0.0, 0.0, gaps)
    assert chord_distance(p) == pytest.approx(gaps[0], abs=1e-9)


def scene(rng: np.random.Generator, d: int) -> tuple[ObstaclePieces, Paths]:
    """Three bodies of two pieces each, and two paths of three pieces."""
    times = np.repeat([[[-rng.uniform(0.1, 2.0), 2.0], [2.0, 8.0]]], 3, axis=0).reshape(6, 2)
    positions = rng.uniform(-6.0, 6.0, (6, 4, d)) + np.repeat(rng.uniform(-3.0, 3.0, (3, 1, d)), 2, axis=0)
    body, share = np.repeat(np.arange(3), 2), np.where(rng.random(3) < 0.5, 0.5, 1.0)
    radius, growth = rng.uniform(0.2, 1.0, 6), rng.uniform(-0.1, 0.5, 6)
    pieces = Pieces(times, positions, radius, growth, np.empty((0, 4, 2)), body)
    begin = 5.0 + np.array([[0.0, 1.5, 4.0, 9.0], [0.0, 0.5, 9.0, 9.0]])
    points = np.zeros((2, 3, 4, 3))
    points[..., :d] = rng.uniform(-3.0, 3.0, (2, 3, 4, d))
    bodies = new_bodies(3)
    bodies["share"] = share
    rows = ObstaclePieces(pieces, np.zeros((6, 2)), np.full((6, 4), np.inf), bodies, np.full(3, -1))
    return rows, Paths(begin, points)


def settings(d: int, now: float, horizon: float) -> DecisionSettings:
    """Settings of which the test of a path needs the time and the horizon."""
    return DecisionSettings(
        dimension=d,
        now=now,
        period=0.1,
        horizon=horizon,
        regain=np.inf,
        patience=0.0,
        share=1.0,
        least_share=1.0,
        agrees=False,
        stops_at_obstacles=False,
        shared=False,
        detours=np.empty(0),
        early=False,
        held_up=False,
        budget=np.inf,
    )


@pytest.mark.parametrize("d", [2, 3])
def test_clear_motions_keep_the_distance(d):
    """From each body at all times, on the path that counts for it; skipped rows are not tested."""
    rng, passed = np.random.default_rng(3), 0
    position, velocity, now, horizon = np.zeros(3), np.zeros(3), 5.0, 6.0
    for _ in range(400):
        rows, paths = scene(rng, d)
        skipped, pieces = rng.random(3) < 0.2, rows.pieces
        none = np.empty((0, 3)), np.empty(0)
        begin = int(rng.integers(6))
        if first_met(rows, skipped, begin, *none, paths, 0, 1, settings(d, now, horizon), new_stack()) >= 0:
            continue
        passed += 1
        for s in np.flatnonzero(~skipped[pieces.body]):
            first, last = pieces.times[s]
            for t in np.linspace(max(first, 0.0), min(last, horizon), 40):
                x = (t - first) / (last - first)
                body = [value(*pieces.points[s, :, axis], x) for axis in range(d)]
                state_on_path(paths, int(rows.bodies["share"][pieces.body[s]] < 1.0), now + t, position, velocity)
                assert np.linalg.norm(position[:d] - body) >= pieces.radius[s] + x * pieces.growth[s] - 1e-9
    assert 100 < passed < 380


@pytest.mark.slow
@pytest.mark.parametrize(("name", "scenario", "parameters"), draws(FLEETS, 2))
def test_the_control_found_without_a_choice_is_the_exact_choice(name, scenario, parameters):
    """To the bit; and most exact choices of the preferred control are found without a choice."""
    rng = np.random.default_rng(2)
    some, tables = last_decision(name, scenario, parameters)
    robots, responses, terms = tables.robots, tables.responses, tables.settings
    d, scratch = terms.dimension, new_scratch(robots.committed.points.shape[1], terms.dimension)
    cells, found, free = kernels.build_cell_list(some, robots, responses, terms), 0, 0
    kinds = robots.each["kind"]
    centers, radii, each = np.empty((BALL_WINDOWS, 3)), np.empty(BALL_WINDOWS), np.empty(len(robots.each), np.int64)
    for i in some:
        near = each[: robots_in_reach(i, cells, robots, terms, each)]
        reachable_balls(i, robots, responses, terms, centers, radii)
        met = reachable_neighbours(i, near, centers, radii, robots)
        rows, overlaps = obstacle_pieces(i, met, 0.0, centers, radii, terms.agrees, tables)
        assert not overlaps
        for r in range(responses.kinds[kinds[i]], responses.kinds[kinds[i] + 1]):
            controls = Controls(np.zeros(3), np.zeros(3), np.zeros(3))
            unchanged_control(robots.each[i], r, responses, controls.unchanged)
            limits = admissible_set(i, r, robots, responses, tables.bounds)
            controls.preferred[:d] = limits[0, 1 : 1 + d] + rng.uniform(-1.2, 1.2, d) * limits[0, 4]
            direct = met_by_preferred(i, r, 0, controls, met, rows, tables, scratch) == -1
            m = relative_motion(i, r, rows, tables, controls.unchanged, terms.horizon, controls.preferred, np.inf)
            code, exact, _, _ = nearest_free(controls.preferred, d, *m, ELEMENTS, CANDIDATES, np.inf)
            if direct:
                assert code == SAFE
                np.testing.assert_array_equal(controls.found, exact)
            if nearest_admissible(controls.preferred, limits, controls.found)[0]:
                found, free = found + direct, free + (code == SAFE and np.array_equal(controls.found, exact))
    assert found > 0.95 * free > 0
