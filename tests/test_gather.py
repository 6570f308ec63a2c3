"""What a robot meets as rows: pieces that are cut stay what they are, and a lost margin is whole again in time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from slalom import Disc, Limits, State, Stationary
from slalom.goal import Goal
from slalom.kernels.decision.encounters import cut_piece, grow_margin
from slalom.kernels.geometry.cubic import value
from slalom.methods import METHODS
from slalom.sim import Robot, Scenario, simulate
from slalom.sim.run.deciders import margin_among

times = st.floats(-1.0, 8.0)
widths = st.floats(0.1, 60.0)
points = st.lists(st.floats(-50.0, 50.0), min_size=12, max_size=12)


def value_at(row: int, t: float, when: np.ndarray, where: np.ndarray) -> np.ndarray:
    share = (t - when[row, 0]) / (when[row, 1] - when[row, 0])
    return np.array([value(*where[row, :, axis], share) for axis in range(where.shape[2])])


@settings(max_examples=50, deadline=None)
@given(times, widths, points, st.floats(0.1, 5.0))
def test_rows_that_are_cut_are_the_piece(first, width, control, cut):
    piece, when, where = np.array(control).reshape(4, 3), np.empty((2, 2)), np.empty((2, 4, 2))
    count = cut_piece(first, first + width, piece[None, None], 0, 0, cut, 0, when, where)
    assert count == (2 if first < cut < first + width else 1)
    assert when[0, 0] == first
    assert when[count - 1, 1] == first + width
    whole = np.array([[first, first + width]])
    for row in range(count):
        for t in np.linspace(*when[row], 5):
            expected = value_at(0, t, whole, piece[None])[:2]
            assert value_at(row, t, when, where) == pytest.approx(expected, abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.floats(0.0, 0.5), st.floats(0.1, 5.0), widths)
def test_a_lost_margin_is_whole_again_in_time(lost, within, width):
    """In rows that are cut there, at all times: what is known of it at their ends and between."""
    when = np.array([[0.0, within], [within, within + width]])
    radius, growth, spare = np.full(2, 1.0), np.zeros(2), np.zeros((2, 2))
    grow_margin(lost, within, 0, 2, when, radius, growth, spare)
    assert radius + growth == pytest.approx([1.0 + lost, 1.0 + lost])
    assert radius == pytest.approx([1.0, 1.0 + lost])
    assert spare[:, 0] == pytest.approx(radius - 1.0)
    assert spare[:, 1] == pytest.approx(growth)


def gap_after(seconds: float, within: float | None) -> tuple[float, float]:
    """Between two robots that drive side by side, nearer to each other than the margin; and the margin."""
    limits = Limits(2.0, 2.0)
    robots = tuple(
        Robot(Disc(0.5), limits, State((0.0, y), (1.0, 0.0)), Goal(Stationary((50.0, y)), 0.2, True), str(k))
        for k, y in enumerate((0.0, 1.01))
    )
    scenario = Scenario("side_by_side", robots, duration=seconds)
    method = replace(METHODS["nao"], regain=within)
    run = simulate(scenario, method)
    apart = run.positions[-1, 0] - run.positions[-1, 1]
    return float(np.linalg.norm(apart)) - 1.0, margin_among(scenario, method)


def test_robots_side_by_side_restore_the_margin_between_them():
    found, margin = gap_after(2.0, 1.0)
    assert found >= margin - 1e-3
    without, _ = gap_after(2.0, None)
    assert without < 0.5 * margin
