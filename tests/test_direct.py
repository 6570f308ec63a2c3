"""What is found free without a choice (`kernels.direct`) is free, and the choice would have been the same."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from test_windows import CREWS, started

from slalom import kernels
from slalom.kernels.decision.encounters import limits_of, obstacle_pieces, relative_motion, state_on_path
from slalom.kernels.decision.manoeuvre_cost import new_scratch
from slalom.kernels.decision.motion_clear import chord_distance, path_is_clear, preferred_is_free
from slalom.kernels.decision.neighbours import neighbours_in_cells, reachable_neighbours
from slalom.kernels.decision.policy import unchanged_control
from slalom.kernels.decision.tables import ObstaclePieces
from slalom.kernels.geometry.cubic import new_stack, value
from slalom.kernels.relative_motion.segments import chord_distances
from slalom.kernels.selection.exchange import SAFE, nearest_admissible, nearest_free
from slalom.tolerances import CANDIDATES, ELEMENTS

CONTROL = st.lists(st.floats(-50.0, 50.0), min_size=12, max_size=12)


@given(CONTROL)
def test_the_bound_of_one_piece_is_that_of_many(control):
    p, gaps = np.array(control).reshape(4, 3), np.empty(1)
    chord_distances(p[:, :, None].copy(), np.zeros((4, 1)), 0.0, 0.0, 0.0, gaps)
    assert chord_distance(p) == pytest.approx(gaps[0], abs=1e-9)


def scene(rng: np.random.Generator, d: int) -> tuple[ObstaclePieces, np.ndarray, np.ndarray]:
    """Three bodies of two pieces each, and a table of two courses of three pieces."""
    times = np.repeat([[[-rng.uniform(0.1, 2.0), 2.0], [2.0, 8.0]]], 3, axis=0).reshape(6, 2)
    places = rng.uniform(-6.0, 6.0, (6, 4, d)) + np.repeat(rng.uniform(-3.0, 3.0, (3, 1, d)), 2, axis=0)
    body, partner = np.repeat(np.arange(3), 2), rng.random(3) < 0.5
    rows = ObstaclePieces(
        times, places, rng.uniform(0.2, 1.0, 6), rng.uniform(-0.1, 0.5, 6), np.empty((0, 4, 2)), body,
        np.zeros((6, 2)), np.full(3, -1), np.zeros(3), partner,
    )  # fmt: skip
    begin = 5.0 + np.array([[0.0, 1.5, 4.0, 9.0], [0.0, 0.5, 9.0, 9.0]])
    points = np.zeros((2, 3, 4, 3))
    points[..., :d] = rng.uniform(-3.0, 3.0, (2, 3, 4, d))
    return rows, begin, points


@pytest.mark.parametrize("d", [2, 3])
def test_what_passes_keeps_away(d):
    """From each body at all times, on the course that counts for it; what is not met is not looked at."""
    rng, passed = np.random.default_rng(3), 0
    place, speed, now, horizon = np.zeros(3), np.zeros(3), 5.0, 6.0
    for _ in range(400):
        rows, begin, points = scene(rng, d)
        unmet = rng.random(3) < 0.2
        if not path_is_clear(rows, unmet, begin, points, 0, 1, now, horizon, new_stack()):
            continue
        passed += 1
        for s in np.flatnonzero(~unmet[rows.body]):
            first, last = rows.times[s]
            for t in np.linspace(max(first, 0.0), min(last, horizon), 40):
                x = (t - first) / (last - first)
                body = [value(*rows.points[s, :, axis], x) for axis in range(d)]
                state_on_path(begin, points, int(rows.cooperates[rows.body[s]]), now + t, place, speed)
                assert np.linalg.norm(place[:d] - body) >= rows.radius[s] + x * rows.growth[s] - 1e-9
    assert 100 < passed < 380


@pytest.mark.parametrize(("name", "scenario", "settings"), CREWS)
def test_what_is_chosen_directly_is_the_exact_choice(name, scenario, settings):
    """To the bit; and most choices that turn out to be of the preferred control are found so."""
    crew, rng = started(name, scenario, settings), np.random.default_rng(2)
    some, terms = crew.looked
    fleet, answers, world, d = crew.fleet, crew.responses, crew._passive(0.0), crew.scenario.dimension
    seen, draft = kernels.build_cell_list(some, fleet, answers, terms), new_scratch(fleet.committed_points.shape[1], d)
    found, free = 0, 0
    for i in some:
        met = reachable_neighbours(
            i, neighbours_in_cells(i, fleet, seen), seen.reachable_centers[i], seen.reachable_radii[i], fleet, terms
        )
        rows, overlaps = obstacle_pieces(i, met, fleet, world, terms)
        assert not overlaps
        for r in range(answers.kinds[fleet.kind[i]], answers.kinds[fleet.kind[i] + 1]):
            own, wanted, u = np.zeros(3), np.zeros(3), np.zeros(3)
            unchanged_control(i, r, fleet, answers, terms, own)
            ball = limits_of(i, r, fleet, answers, terms)[0]
            wanted[:d] = ball[1 : 1 + d] + rng.uniform(-1.2, 1.2, d) * ball[4]
            direct = preferred_is_free(i, r, wanted, own, met, rows, fleet, answers, terms, draft, u)
            m = relative_motion(i, r, rows, fleet, world, answers, terms, own)
            code, exact, _, _ = nearest_free(wanted, d, *m, ELEMENTS, CANDIDATES)
            if direct:
                assert code == SAFE
                np.testing.assert_array_equal(u, exact)
            if nearest_admissible(wanted, limits_of(i, r, fleet, answers, terms), u)[0]:
                found, free = found + direct, free + (code == SAFE and np.array_equal(u, exact))
    assert found > 0.95 * free > 0
