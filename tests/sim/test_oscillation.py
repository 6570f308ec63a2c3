"""Measures of oscillation against counts by hand, and what must not matter to them."""

from dataclasses import replace

import numpy as np
import pytest
from parts import disc_or_ball

from slalom import METHODS, Goal, Limits, Obstacle, Polyline, Stationary, Velocity
from slalom.sim import Recording, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import single_robot_view
from slalom.sim.measure.metrics import (
    PASSING,
    Passing,
    changed_choices,
    flips_between,
    heading_variation,
    passing_sides,
    side_flips,
)
from slalom.sim.measure.responses import RecordedResponses

DT = 0.1


def drawn(ways, velocities, *, radius: float = 0.5, outcomes=None) -> Recording:
    """A run of robots that are at `ways` (T + 1, N, d) with `velocities`; what they apply is what leads there."""
    ways, velocities = np.asarray(ways, dtype=float), np.asarray(velocities, dtype=float)
    steps, n, d = len(ways) - 1, *ways.shape[1:]
    accelerations = np.diff(velocities, axis=0) / DT
    return Recording(
        scenario="by hand",
        method="vo",
        seed=0,
        dt=DT,
        parameters={},
        times=DT * np.arange(steps + 1),
        positions=ways,
        velocities=velocities,
        accelerations=accelerations,
        controls=accelerations,
        responses=RecordedResponses.of([(Velocity(),) * n] * steps, n),
        outcomes=outcomes or (("CLEAR",) * n,) * steps,
        decision_times=np.zeros((steps, n)),
        shapes=(disc_or_ball(radius, d),) * n,
        limits=(Limits(2.0, 2.0),) * n,
        goals=tuple(Goal(Stationary(position), 0.1) for position in ways[-1]),
        arrived=np.full(n, np.inf),
        obstacles=(),
    )


def meeting(sideways, *, from_x: float = 10.0, forward: float = 1.0, **options) -> Recording:
    """Two robots that come towards each other along x; the first also moves `sideways` (T + 1,) [m/s]."""
    v = np.zeros((len(sideways), 2, 2))
    v[:, 0, 0], v[:, 1, 0], v[:, 0, 1] = forward, -forward, sideways
    starts = np.array([(-from_x, 0.0), (from_x, 0.0)])
    return drawn(starts + np.concatenate([np.zeros((1, 2, 2)), np.cumsum(DT * v[:-1], axis=0)]), v, **options)


def weaving(speed: float) -> np.ndarray:
    """Left for a second, right for a second, up to 9.9 s."""
    return np.where(np.arange(100) // 10 % 2 == 0, speed, -speed)


def turned(recording: Recording, angle: float, shift, mirror: bool = False) -> Recording:
    """The same run elsewhere: turned, moved, in a mirror."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])
    return replace(
        recording,
        positions=recording.positions @ matrix.T + shift,
        velocities=recording.velocities @ matrix.T,
        accelerations=recording.accelerations @ matrix.T,
    )


@pytest.fixture(scope="module")
def swap() -> Recording:
    """Six greedy robots that swap places: they change sides, headings and choices."""
    settings = {"robots": 6, "patience": 0.0, "guided": 0.0, "duration": 25.0}
    recording = simulate(build("circle", settings), METHODS["nao"])
    assert flips_between(recording)[0].sum() > 0
    return recording


class TestSides:
    def test_by_hand(self):
        """One at rest in the origin, another one on a circle of 3 m about it, the robot's velocity along x."""
        angle = np.radians([0, 10, -10, 45, -45, 70, -70, 135, 180])
        position = 3.0 * np.column_stack([np.cos(angle), np.sin(angle)])
        velocity = np.tile([1.0, 0.0], (len(angle), 1))
        # Straight ahead it is on no side, beyond 60 degrees and behind there is no approach.
        assert passing_sides(position, velocity, 1.0).tolist() == [0, 1, -1, 1, -1, 0, 0, 0, 0]
        assert passing_sides(-position, -velocity, 1.0).tolist() == [0, 1, -1, 1, -1, 0, 0, 0, 0]

    def test_reach_and_band(self):
        """At 1 m/s the other one is within reach up to 6 m ahead; aside from a tenth of the sum of the radii on."""
        position = np.array([(5.9, 1.0), (6.1, 1.0), (3.0, 0.21), (3.0, 0.19)])
        velocity = np.tile([1.0, 0.0], (4, 1))
        assert passing_sides(position, velocity, 2.0).tolist() == [1, 0, 1, 0]
        assert passing_sides(position, 2.0 * velocity, 2.0).tolist() == [1, 1, 1, 0]
        assert passing_sides(position, 0.0 * velocity, 2.0).tolist() == [0, 0, 0, 0]
        assert passing_sides(position, velocity, 2.0, Passing(7.0, 0.5, 0.0)).tolist() == [1, 1, 1, 1]


class TestFlips:
    def test_straight_motion_has_no_flips(self):
        """Past each other with an offset, or through each other."""
        for offset in (0.0, 0.3, -2.0):
            run = meeting(np.zeros(101))
            run.positions[:, 0, 1] += offset
            assert flips_between(run)[0].sum() == 0
            assert bool(flips_between(run)[1].any()) == (offset != 0.0)

    def test_weaving_has_as_many_flips_as_counted_by_hand(self):
        """They would meet after 10.5 s; the first changes its side every second, with 0.5 m/s.

        In second s they would miss by (10.5 - s) / 2.06 m on one side or (9.5 - s) / 2.06 m on the other one, more than
        the band of 0.1 m. They are nearest within 6 s from 4.2 s on. So six sides, those of the seconds 4 to 9.
        """
        flips, steps = flips_between(meeting(weaving(0.5), from_x=10.5))
        assert flips.tolist() == [[0, 5], [5, 0]]
        assert steps.tolist() == [[0, 58], [58, 0]]
        # One that wavers by less than the band decides on nothing.
        assert flips_between(meeting(weaving(0.02), from_x=10.5))[0].sum() == 0

    def test_a_pause_in_between_forgets_nothing(self):
        """Left, straight towards each other's centre, right: one flip; left, straight, left: none."""
        for last, expected in ((-1.0, 1), (1.0, 0)):
            position = np.array([(3.0, 1.0), (3.0, 0.0), (3.0, last)])[:, None]
            ways = np.concatenate([np.zeros_like(position), position], axis=1)
            velocities = np.zeros_like(ways)
            velocities[:, 0, 0] = 1.0
            assert flips_between(drawn(ways, velocities))[0][0, 1] == expected

    def test_order_position_and_frame_do_not_matter(self, swap):
        flips, steps = flips_between(swap)
        assert np.array_equal(flips, flips.T)
        assert np.array_equal(steps, steps.T)
        assert not flips.diagonal().any()
        for mirror in (False, True):
            assert np.array_equal(flips_between(turned(swap, 0.7, (3.0, -8.0), mirror))[0], flips)
        order = [2, 0, 3, 1]
        mixed = replace(swap, positions=swap.positions[:, order], velocities=swap.velocities[:, order])
        assert np.array_equal(flips_between(mixed)[0], flips[np.ix_(order, order)])

    def test_the_metric_of_one_robot_is_the_sum_of_its_pairs(self, swap):
        flips, _ = flips_between(swap)
        assert [side_flips(single_robot_view(swap, k)) for k in range(6)] == flips.sum(axis=1).tolist()

    def test_only_what_is_there_and_has_a_side_counts(self):
        """No walls, nothing in space, and no obstacle before it exists."""
        one = single_robot_view(meeting(weaving(0.5), from_x=10.5), 0)
        assert side_flips(one) == 5.0
        wall = Obstacle(Polyline([(0.0, -1.0), (0.0, 1.0), (1.0, 1.0)], 0.1), Stationary((0.0, 0.0)), "wall")
        assert side_flips(replace(one, obstacles=(wall,))) == 0.0
        assert side_flips(replace(one, obstacles=())) == 0.0
        assert side_flips(replace(one, times=one.times + 1000.0)) == 0.0
        deep = np.zeros((5, 2, 3))
        assert flips_between(drawn(deep, deep))[0].tolist() == [[0, 0], [0, 0]]

    def test_a_wider_rule_counts_what_a_narrower_one_does(self, swap):
        """More steps at which a side is decided; with the default rule those of the default."""
        narrow, usual = (flips_between(swap, rule)[1] for rule in (Passing(3.0, 0.7, 0.25), PASSING))
        wide = flips_between(swap, Passing(9.0, 0.0, 0.05))[1]
        assert np.all(narrow <= usual)
        assert np.all(usual <= wide)
        assert np.array_equal(usual, flips_between(swap)[1])


class TestHeadings:
    def test_a_zigzag_turns_as_one_counts(self):
        """Between 30 degrees left and right every second over 10 s: nine turns by 60 degrees."""
        angle = np.radians(weaving(30.0))
        v = np.column_stack([np.cos(angle), np.sin(angle)])[:, None]
        run = drawn(np.cumsum(DT * v, axis=0), v)
        assert heading_variation(run) == pytest.approx(9 * np.pi / 3)
        # Slower than a tenth of the 2 m/s that it can go it has no heading.
        assert heading_variation(replace(run, velocities=0.19 * v)) == 0.0
        assert heading_variation(replace(run, velocities=0.19 * v), moving=0.09) == pytest.approx(9 * np.pi / 3)

    def test_a_stop_and_a_way_back_turn_by_half_a_circle(self):
        speed = np.concatenate([np.linspace(1.0, -1.0, 41), np.full(5, -1.0)])
        v = np.zeros((46, 1, 2))
        v[:, 0, 0] = speed
        assert heading_variation(drawn(np.cumsum(DT * v, axis=0), v)) == pytest.approx(np.pi)

    def test_straight_and_standing_turn_by_nothing_and_a_circle_by_itself(self):
        v = np.zeros((64, 3, 2))
        v[:, 0] = (1.0, 0.5)
        angle = np.linspace(0.0, 2.0 * np.pi, 64)
        v[:, 2] = np.column_stack([np.cos(angle), np.sin(angle)])
        run = drawn(np.cumsum(DT * v, axis=0), v)
        assert [heading_variation(run, k) for k in range(3)] == pytest.approx([0.0, 0.0, 2.0 * np.pi], abs=1e-12)

    def test_where_does_not_matter(self, swap):
        for k in range(4):
            before = heading_variation(swap, k)
            assert heading_variation(turned(swap, -1.1, (5.0, 5.0), True), k) == pytest.approx(before)
            assert before >= 0.0


def test_changed_choices_are_those_that_are_neither_kept_nor_continued() -> None:
    outcomes = (("CLEAR", "KEPT"), ("KEPT", "KEPT"), ("", "CONTINUED"), ("SQUEEZED", "CONTINUED"), ("DELAYED", "KEPT"))
    still = np.zeros((6, 2, 2))
    run = drawn(still, still, outcomes=outcomes)
    assert [changed_choices(run, k) for k in range(2)] == [0.75, 0.0]
    peer = replace(run, outcomes=(("CHOSEN", "UNANSWERED"),) * 5)
    assert changed_choices(peer, 0) == 0.0
