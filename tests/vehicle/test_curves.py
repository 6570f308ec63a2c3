"""Ways from pose to pose: exact ends, symmetries, and lengths against independent slow oracles."""

from itertools import product
from math import cos, hypot, pi, sin

import numpy as np
import pytest
from draws import draws, examples
from hypothesis import given, strategies as st

from slalom.vehicle.curves import (
    DUBINS,
    REEDS_SHEPP,
    Arc,
    along,
    dubins,
    ends,
    length_of,
    reeds_shepp,
    reversals,
    to_place,
    turn_and_drive,
    words,
)

COORDINATES = st.floats(-6.0, 6.0)
HEADINGS = st.floats(-7.0, 7.0)
POSES = st.tuples(COORDINATES, COORDINATES, HEADINGS)
RADII = st.floats(0.2, 5.0)
ORIGIN = (0.0, 0.0, 0.0)
EXACT = 1e-9


def off(pose, goal) -> float:
    """Distance of two poses: of their places [m] and of their headings [rad]."""
    return max(hypot(pose[0] - goal[0], pose[1] - goal[1]), abs(np.exp(1j * pose[2]) - np.exp(1j * goal[2])))


def driven(start, arcs) -> tuple[float, float, float]:
    """The end of a sequence of (curvature, length) by plain trigonometry."""
    x, y, heading = start
    for curvature, length in arcs:
        if curvature == 0.0:
            x, y = x + length * cos(heading), y + length * sin(heading)
        else:
            after = heading + curvature * length
            x, y = x + (sin(after) - sin(heading)) / curvature, y - (cos(after) - cos(heading)) / curvature
            heading = after
    return x, y, heading


def shortest(ways) -> float:
    return length_of(ways[0])


# What every way does.


@examples(200)
@given(POSES, POSES, RADII)
def test_ways_end_at_their_goal_and_never_turn_tighter(start, goal, radius) -> None:
    """Every way of every kind, by plain trigonometry."""
    kinds = {
        "dubins": dubins(start, goal, radius),
        "backwards": dubins(start, goal, radius, backwards=True),
        "both": reeds_shepp(start, goal, radius),
    }
    for kind, ways in kinds.items():
        assert 4 <= len(ways) <= (48 if kind == "both" else 6)
        lengths = [length_of(way) for way in ways]
        assert np.all(np.diff(lengths) >= -1e-9 * radius)
        for way in ways:
            signs = {arc.length > 0.0 for arc in way}
            assert kind == "both" or signs <= {kind == "dubins"}
            assert all(abs(arc.turn) <= abs(arc.length) / radius * (1.0 + 1e-12) for arc in way)
            last = driven(start, [(arc.turn / arc.length, arc.length) for arc in way])
            assert off(last, goal) < EXACT * radius * (1.0 + shortest(ways) / radius)
            assert reversals(way) <= 3


@examples(100)
@given(POSES, st.tuples(COORDINATES, COORDINATES), RADII, st.booleans())
def test_ways_to_a_place_end_there(start, place, radius, reverse) -> None:
    ways = to_place(start, place, radius, reverse)
    assert ways
    for way in ways:
        assert reverse or all(arc.length > 0.0 for arc in way)
        assert all(abs(arc.turn) <= abs(arc.length) / radius * (1.0 + 1e-12) for arc in way)
        last = ends(start, way)[-1]
        assert hypot(last[0] - place[0], last[1] - place[1]) < EXACT * (radius + length_of(way))


@examples(100)
@given(POSES, POSES, st.booleans())
def test_turns_and_lines_end_at_their_goal(start, goal, reverse) -> None:
    """All are as long as the line. The first one turns no more than any other."""
    ways = turn_and_drive(start, goal, reverse)
    distance = hypot(goal[0] - start[0], goal[1] - start[1])
    turns = [sum(abs(arc.turn) for arc in way) for way in ways]
    assert turns == sorted(turns)
    assert len(set(ways)) == len(ways) <= 8
    for way in ways:
        assert off(ends(start, way)[-1], goal) < EXACT * (1.0 + distance)
        assert length_of(way) == pytest.approx(distance)
        assert all(arc.length == 0.0 or arc.turn == 0.0 for arc in way)
        assert reverse or all(arc.length >= 0.0 for arc in way)
    place = to_place(start, goal[:2], 0.0, reverse, turns_on_spot=True)[0]
    last = ends(start, place)[-1]
    assert hypot(last[0] - goal[0], last[1] - goal[1]) < EXACT * (1.0 + distance)
    assert sum(abs(arc.turn) for arc in place) <= turns[0] + 1e-9


def test_ways_that_need_no_turn_have_none() -> None:
    """Straight ahead, straight back, on one circle, and nowhere."""
    assert dubins(ORIGIN, (3.0, 0.0, 0.0), 1.0)[0] == (Arc(3.0, 0.0),)
    assert reeds_shepp(ORIGIN, (-3.0, 0.0, 0.0), 1.0)[0] == (Arc(-3.0, 0.0),)
    (arc,) = reeds_shepp(ORIGIN, (1.0, 1.0, 0.5 * pi), 1.0)[0]
    assert arc == pytest.approx((0.5 * pi, 0.5 * pi))
    assert (
        dubins(ORIGIN, ORIGIN, 1.0)[0] == reeds_shepp(ORIGIN, ORIGIN, 1.0)[0] == turn_and_drive(ORIGIN, ORIGIN)[0] == ()
    )
    assert turn_and_drive(ORIGIN, (0.0, 0.0, 1.0))[0] == (Arc(0.0, 1.0),)
    assert turn_and_drive(ORIGIN, (-2.0, 0.0, 0.0))[0] == (Arc(-2.0, 0.0),)
    assert to_place(ORIGIN, (2.0, 0.0), 1.0)[0] == (Arc(2.0, 0.0),)


@examples(100)
@given(POSES, POSES, RADII, st.floats(0.1, 10.0), POSES)
def test_lengths_have_the_symmetries_of_the_plane(start, goal, radius, scale, motion) -> None:
    """Reflection, scaling, motion, time, and front and back."""

    def moved(pose):
        x, y, angle = motion
        c, s = cos(angle), sin(angle)
        return x + c * pose[0] - s * pose[1], y + s * pose[0] + c * pose[1], pose[2] + angle

    def mirrored(pose):
        return pose[0], -pose[1], -pose[2]

    def flipped(pose):
        return pose[0], pose[1], pose[2] + pi

    def scaled(pose):
        return scale * pose[0], scale * pose[1], pose[2]

    def equal(found, length) -> None:
        # A full circle may be added where rounding decides on which side of a line the goal is.
        assert found == pytest.approx(length, rel=1e-7, abs=1e-6 * radius)

    both, forwards = shortest(reeds_shepp(start, goal, radius)), shortest(dubins(start, goal, radius))
    equal(shortest(reeds_shepp(mirrored(start), mirrored(goal), radius)), both)
    equal(shortest(reeds_shepp(moved(start), moved(goal), radius)), both)
    equal(shortest(reeds_shepp(goal, start, radius)), both)
    equal(shortest(reeds_shepp(flipped(start), flipped(goal), radius)), both)
    equal(shortest(reeds_shepp(scaled(start), scaled(goal), scale * radius)) / scale, both)
    equal(shortest(dubins(mirrored(start), mirrored(goal), radius)), forwards)
    equal(shortest(dubins(flipped(goal), flipped(start), radius)), forwards)
    equal(shortest(dubins(goal, start, radius, backwards=True)), forwards)
    assert both <= forwards + 1e-9


@examples(100)
@given(POSES, POSES, POSES, RADII)
def test_lengths_with_reversals_are_a_metric(a, b, c, radius) -> None:
    ab, bc, ac = (shortest(reeds_shepp(p, q, radius)) for p, q in ((a, b), (b, c), (a, c)))
    assert ac <= ab + bc + 1e-7 * (1.0 + radius)
    assert ab >= hypot(a[0] - b[0], a[1] - b[1]) - 1e-9
    forwards = [shortest(dubins(p, q, radius)) for p, q in ((a, b), (b, c), (a, c))]
    assert forwards[2] <= forwards[0] + forwards[1] + 1e-7 * (1.0 + radius)


@examples(100)
@given(POSES, POSES, POSES)
def test_lengths_with_reversals_are_continuous(start, goal, direction) -> None:
    """A small change of the goal by e costs at most of the order of its root: the way sideways by four arcs."""
    size = 1e-8
    near = tuple(p + size * d for p, d in zip(goal, direction))
    change = abs(shortest(reeds_shepp(start, goal, 1.0)) - shortest(reeds_shepp(start, near, 1.0)))
    assert change <= 10.0 * (size * max(1e-3, *map(abs, direction))) ** 0.5


# Lengths against slow oracles.


def concatenations(rng, count: int, arcs: int, forwards: bool) -> list[tuple[tuple[float, float], ...]]:
    """Random sequences of (curvature, length) with turns of at least the radius 1, most of them of radius 1."""
    found = []
    for _ in range(count):
        curvatures = np.where(rng.uniform(size=arcs) < 0.8, rng.integers(-1, 2, arcs), rng.uniform(-1.0, 1.0, arcs))
        lengths = rng.exponential(0.8, arcs) * (1.0 if forwards else rng.choice([-1.0, 1.0], arcs))
        found.append(tuple(zip(curvatures.tolist(), lengths.tolist())))
    return found


@pytest.mark.parametrize("forwards", [True, False], ids=["dubins", "reeds_shepp"])
def test_no_concatenation_of_arcs_is_shorter(forwards: bool) -> None:
    """Neither of 1 to 6 random arcs; and some are as short, so that the test is sharp."""
    rng, sharp = np.random.default_rng(3), 0
    for arcs in range(1, 7):
        tried = concatenations(rng, 500, arcs, forwards)
        goals = np.array([driven(ORIGIN, one) for one in tried])
        lengths = np.array([sum(abs(length) for _, length in one) for one in tried])
        gears = (1.0,) if forwards else (1.0, -1.0)
        found = words(np.zeros((500, 3)), goals, 1.0, DUBINS if forwards else REEDS_SHEPP, gears).total.min(axis=1)
        assert np.all(found <= lengths + 1e-9)
        sharp += np.count_nonzero(found > 0.999 * lengths)
    assert sharp > 300


def newton(kinds, gears, goal, start) -> float:
    """Length of the word of three arcs of these curvatures and directions, solved from a start; inf if it is none."""
    lengths = np.array(start)

    def miss(lengths):
        x, y, heading = driven(ORIGIN, zip(kinds, lengths))
        return np.array([x - goal[0], y - goal[1], (heading - goal[2] + pi) % (2.0 * pi) - pi])

    for _ in range(30):
        here = miss(lengths)
        slopes = np.stack([(miss(lengths + 1e-7 * e) - here) / 1e-7 for e in np.eye(3)], axis=1)
        if abs(np.linalg.det(slopes)) < 1e-9:
            return np.inf
        lengths = lengths - np.clip(np.linalg.solve(slopes, here), -1.0, 1.0)
        if np.abs(lengths).max() > 50.0:
            return np.inf
    good = np.abs(miss(lengths)).max() < 1e-7 and np.all(lengths * gears > -1e-9)
    return float(np.abs(lengths).sum()) if good else np.inf


@pytest.mark.parametrize("seed", draws(range(6), 2))
@pytest.mark.parametrize("reverse", [False, True])
def test_the_shortest_way_is_that_of_three_arcs_found_by_newton(seed: int, reverse: bool) -> None:
    """Words of three arcs from many starts of Newton's method, without a formula; ways may have more arcs."""
    rng = np.random.default_rng(seed)
    goal = (*rng.uniform(-2.0, 2.0, 2), rng.uniform(-pi, pi))
    gears = list(product((-1.0, 1.0), repeat=3)) if reverse else [(1.0, 1.0, 1.0)]
    best = min(
        newton(kinds, gear, goal, start * gear)
        for kinds in product((-1.0, 0.0, 1.0), repeat=3)
        if kinds[0] != kinds[1] != kinds[2]
        for gear in gears
        for start in rng.uniform(0.0, 3.0 if reverse else 6.0, (6 if reverse else 60, 3))
    )
    way = (reeds_shepp if reverse else dubins)(ORIGIN, goal, 1.0)[0]
    assert best >= length_of(way) - 1e-6
    if len(way) <= 3:
        assert best == pytest.approx(length_of(way), abs=1e-6)


def test_every_word_is_the_shortest_somewhere() -> None:
    """All 48 words with reversals and all 6 without."""
    rng = np.random.default_rng(0)
    goals = np.column_stack([rng.uniform(-5.0, 5.0, (6000, 2)), rng.uniform(-pi, pi, 6000)])
    for families, gears, count in ((REEDS_SHEPP, (1.0, -1.0), 48), (DUBINS, (1.0,), 6)):
        best = words(np.zeros_like(goals), goals, 1.0, families, gears).total.argmin(axis=1)
        assert set(best.tolist()) == set(range(count))


@pytest.mark.parametrize("reverse", [False, True])
def test_ways_to_a_place_are_the_shortest_over_all_headings(reverse: bool) -> None:
    rng = np.random.default_rng(8)
    headings = np.linspace(-pi, pi, 1441)
    for place in rng.uniform(-3.0, 3.0, (30, 2)):
        goals = np.column_stack([np.broadcast_to(place, (len(headings), 2)), headings])
        families, gears = (REEDS_SHEPP, (1.0, -1.0)) if reverse else (DUBINS, (1.0,))
        best = words(np.zeros_like(goals), goals, 1.0, families, gears).total.min()
        found = shortest(to_place(ORIGIN, place, 1.0, reverse))
        assert found <= best + 1e-9
        assert found == pytest.approx(best, abs=0.01)


# Poses along a way.


@examples(50)
@given(POSES, POSES, RADII, st.lists(st.floats(0.0, 1.0), min_size=1, max_size=5))
def test_poses_along_a_way_are_those_of_its_parts(start, goal, radius, shares) -> None:
    way = reeds_shepp(start, goal, radius)[0]
    total = length_of(way)
    found = along(start, way, total * np.array(shares))
    for pose, share in zip(found, shares):
        left, parts = share * total, []
        for arc in way:
            part = min(left, abs(arc.length))
            parts.append((arc.turn / arc.length, part if arc.length > 0.0 else -part))
            left -= part
        assert off(pose, driven(start, parts)) < 1e-9 * (1.0 + total + radius)
    assert off(along(start, way, -1.0), start) == 0.0
    assert off(along(start, way, total + 1.0), ends(start, way)[-1]) < 1e-12


def test_turns_on_the_spot_have_poses_if_they_have_a_length() -> None:
    way = (Arc(0.0, 1.0), Arc(2.0, 0.0), Arc(0.0, -2.0))
    assert along(ORIGIN, way, 0.0) == pytest.approx((0.0, 0.0, 1.0))
    assert along(ORIGIN, way, (0.0, 0.25, 1.5), lever=0.5)[:, 2] == pytest.approx((0.0, 0.5, 1.0))
    assert along(ORIGIN, way, 3.0, lever=0.5)[2] == pytest.approx(0.0)
    assert along(ORIGIN, (), [0.0, 1.0]).shape == (2, 3)
    assert length_of(way) == 2.0
    assert length_of(way, lever=0.5) == 3.5
