"""The boundary of control obstacles in the plane against the certified test, and against plain sampling in time."""

import numpy as np
import pytest
import shapely
from draws import draws
from scenes import scene

from slalom import (
    AccelerateThenTurn,
    Acceleration,
    ConstantAcceleration,
    ConstantVelocity,
    Disc,
    InvalidInput,
    Obstacle,
    PiecewisePolynomial,
    State,
    control_obstacle,
)
from slalom.choice.control_obstacle import BOUNDARY
from slalom.choice.envelope import RelativeMotion, Window, grazing_curves
from slalom.choice.outline import boundary, closed_lines
from slalom.kernels.arrays import Hulls, Segments

SHARE = 1e-3  # [1] of the obstacle's area by which regions may differ from it
LEAST = 1e-3  # [1] of the window's area: smaller obstacles are judged as if they had it
OFF = 3.0  # [tolerances] from the boundary within which a control may be on the wrong side

QUICK, ALL = 10, 500
CHUNKS = draws(range(ALL // QUICK))


def regions(blocked, center, radius):
    def inside(controls):
        return np.isfinite(blocked.times_to_collision(controls))

    return list(blocked.boundary(center, radius).regions), inside


def in_disc(rng, center, radius, n):
    """Evenly spread over all but the rim, where the window itself is a polygon."""
    angle = rng.uniform(0, 2 * np.pi, n)
    reach = radius * (1 - BOUNDARY) * np.sqrt(rng.uniform(size=n))
    return center + reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def along(rng, lines, width, n):
    """Points evenly spread along lines and across them by up to `width` to both sides; the area of that strip."""
    pieces = np.array([piece for piece in shapely.get_parts(shapely.get_parts(lines)) if piece.length > 0])
    lengths = shapely.length(pieces)
    which = rng.choice(len(pieces), size=n, p=lengths / lengths.sum())
    positions = rng.uniform(size=n) * lengths[which]
    here, there = (
        shapely.get_coordinates(shapely.line_interpolate_point(pieces[which], positions + step)) for step in (0, 1e-6)
    )
    across = (there - here)[:, ::-1] * [1, -1]
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
    return here + width * rng.uniform(-1, 1, (n, 1)) * across, 2 * width * lengths.sum()


def distances(region, points):
    if region.is_empty:
        return np.full(len(points), np.inf)
    return shapely.distance(region.boundary, shapely.points(points))


def difference(s, rng, n=1000):
    """Area between the regions and the control obstacle, as a share of the latter, and what is on the wrong side.

    Near the boundary, where they differ if at all, samples are dense: the strip is weighed by its area.
    """
    smallest = int(np.argmin(s.admissible.radii))
    center, radius = s.admissible.centers[smallest], float(s.admissible.radii[smallest])
    found, inside = regions(s.blocked, center, radius)
    union, width = shapely.union_all(found), 10 * BOUNDARY * radius
    far = in_disc(rng, center, radius, n)
    near, area = np.empty((0, 2)), 0.0
    if not union.is_empty:
        near, area = along(rng, shapely.boundary(union), width, n)
        near[np.linalg.norm(near - center, axis=1) > radius * (1 - BOUNDARY)] = center
    controls = np.concatenate([far, near])
    truth = inside(controls)
    wrong = shapely.contains_xy(union, controls) != truth.any(axis=1)
    beyond = wrong[:n] & (distances(union, far) > width)
    blocked = max(truth[:n].any(axis=1).mean(), LEAST)
    share = (beyond.mean() + (area * wrong[n:].mean() if len(near) else 0.0) / (np.pi * radius**2)) / blocked
    worst = 0.0
    for index, region in enumerate(found):
        astray = controls[shapely.contains_xy(region, controls) != truth[:, index]]
        worst = max(worst, distances(region, astray).max(initial=0.0) / (BOUNDARY * radius))
    return share, worst


@pytest.mark.parametrize("chunk", CHUNKS)
def test_regions_are_the_controls_that_collide(chunk):
    for number in range(chunk * QUICK, (chunk + 1) * QUICK):
        s = scene(number, 2)
        try:
            share, worst = difference(s, np.random.default_rng(number))
        except InvalidInput:
            # Obstacles and the response turn, and the robot has corners.
            assert isinstance(s.response, AccelerateThenTurn)
            continue
        assert share < SHARE, f"areas differ by {share:g}: {s}"
        assert worst < OFF, f"a control {worst:g} tolerances from the boundary is on the wrong side: {s}"


def test_ao_with_a_gap_is_the_union_of_very_many_discs():
    me, rock = State((0, 0), (2, 0)), Obstacle(Disc(1.0), ConstantVelocity((4, 0.4), (0, 0)))
    blocked = control_obstacle(Acceleration(), me, [rock], Disc(0.5), horizon=20.0)
    (region,), _ = regions(blocked, np.zeros(2), 3.0)
    inverse = np.linspace(1 / 20, 1.6, 2000)[:, None]
    # theory.md section 6: centres on a parabola in 1 / t.
    centers = 2 * np.array([4, 0.4]) * inverse**2 - 2 * np.array([2, 0]) * inverse
    discs = shapely.buffer(shapely.points(centers), 2 * 1.5 * inverse[:, 0] ** 2, quad_segs=64)
    window = shapely.Point(0, 0).buffer(3.0, quad_segs=512)
    expected = shapely.intersection(shapely.union_all(discs), window)
    assert region.symmetric_difference(expected).area < 2e-4 * expected.area
    # The gap: no envelope while q = c - w t / 2 is inside, so two stretches of two branches.
    curves = grazing_curves(blocked.segments, np.zeros(2), 3.0, 3e-4)
    assert len(curves) == 4
    # |c - w t / 2| = R at the ends of the gap.
    gap = np.sort(np.roots([1, -8, 16 + 0.16 - 2.25]).real)
    times = np.unique(np.concatenate([times for _, times, _ in curves]))
    assert not np.any((times > gap[0] + 1e-9) & (times < gap[1] - 1e-9))
    assert times[times < 4].max() == pytest.approx(gap[0], abs=1e-2)
    assert times[times > 4].min() == pytest.approx(gap[1], abs=1e-2)


def test_grazing_controls_touch_and_neither_approach_nor_leave():
    me = State((0, 0), (1.0, 0.5))
    cars = [
        Obstacle(Disc(0.8), ConstantAcceleration((6, 1), (-1, 0.3), (0.2, -0.1))),
        Obstacle(Disc(0.5), ConstantVelocity((3, -4), (0.1, 1.2))),
    ]
    blocked = control_obstacle(Acceleration(), me, cars, Disc(0.4), horizon=6.0)
    curves = grazing_curves(blocked.segments, np.zeros(2), 4.0, 4e-4)
    assert {owner for owner, _, _ in curves} == {0, 1}
    for owner, times, controls in curves:
        assert np.all(np.diff(times) > 0)
        position, velocity = cars[owner].trajectory.position(times), cars[owner].trajectory.velocity(times)
        t = times[:, None]
        away = position - (me.position + me.velocity * t + controls * t**2 / 2)
        relative = velocity - (me.velocity + controls * t)
        touching = cars[owner].shape.radius + 0.4
        assert np.linalg.norm(away, axis=1) == pytest.approx(touching, abs=1e-6)
        scale = touching * np.maximum(np.linalg.norm(relative, axis=1), 1.0)
        assert np.all(abs((away * relative).sum(axis=1)) < 1e-5 * scale)


# Tables made by hand: whatever a part may be.

ANGLES = np.linspace(0, 2 * np.pi, 361)[:-1]
NORMALS = np.stack([np.cos(ANGLES), np.sin(ANGLES)])


def bernstein(control, x):
    """Cubics with control points (4, ...) at x (k,): (k, ...)."""
    weights = np.stack([(1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x**2 * (1 - x), x**3], axis=1)
    return np.tensordot(weights, control, axes=1)


def held(motion, controls, times=1500):
    """Whether controls (n, 2) collide with the one obstacle of a table: outlines at very many times, (n, 1)."""
    x = np.linspace(0, 1, times)
    inside = np.zeros(len(controls), dtype=bool)
    segments, hulls = motion.table, motion.hulls
    for s in range(len(motion.begin)):
        position, gain = bernstein(segments.points[:, :2, s], x), bernstein(segments.gains[:, s], x)
        corners = np.zeros((1, 5))
        if hulls.hull[s] >= 0:
            corners = hulls.corners[hulls.first[hulls.hull[s]] : hulls.first[hulls.hull[s] + 1]]
        (ex, ey), (fx, fy, _, tx, ty) = bernstein(hulls.turns[:, :, s], x).T[..., None], corners.T
        corner = position[:, None] + np.stack([fx + tx * ex - ty * ey, fy + tx * ey + ty * ex], axis=2)
        support = (corner @ NORMALS).max(axis=1) + (segments.radius[s] + segments.growth[s] * x)[:, None]
        for n, control in enumerate(controls):
            inside[n] |= np.any(np.all((gain[:, None] * control) @ NORMALS <= support, axis=1))
    return inside[:, None]


def table(points, gains, *, radius=0.3, growth=0.0, corners=None, turn=0.0):
    """One obstacle of one part, control points points (4, 2), gains (4,), corners (c, 5), turned by `turn` [rad]."""
    position = np.zeros((4, 3, 1))
    position[:, :2, 0] = points
    # A cubic arc of the directions from angle 0 to `turn`.
    arm, ends = 4 / 3 * np.tan(turn / 4), np.array([[1, 0], [np.cos(turn), np.sin(turn)]])
    turns = np.array([ends[0], ends[0] + [0, arm], ends[1] - arm * np.array([-ends[1, 1], ends[1, 0]]), ends[1]])
    corners = np.zeros((0, 5)) if corners is None else np.asarray(corners, dtype=float)
    first = np.array([0, len(corners)][: 1 + (len(corners) > 0)])
    reach = radius + max(growth, 0.0) + np.hypot(corners[:, [0, 3]], corners[:, [1, 4]]).sum(axis=1).max(initial=0.0)
    hull = np.array([0 if len(corners) else -1])
    table = Segments(
        position,
        np.array(gains, dtype=float)[:, None],
        np.empty((4, 0)),
        np.array([radius]),
        np.array([growth]),
        np.array([1.01 * reach]),
    )
    hulls = Hulls(hull, turns[:, :, None], corners, first, np.ones(len(first) - 1, dtype=bool))
    return RelativeMotion(np.zeros(1), np.ones(1), np.zeros(1, dtype=np.int64), table, hulls)


def still(xy):
    return np.pad(np.asarray(xy, dtype=float), ((0, 0), (0, 3)))


def turning(xy):
    return np.pad(np.asarray(xy, dtype=float), ((0, 0), (3, 0)))


BOX = [[-0.9, -0.25], [0.9, -0.25], [0.9, 0.25], [-0.9, 0.25]]
STICK = [[0.0, -0.4], [0.1, 0.5]]
SUM = [[x, y, 0, a, b] for x, y in STICK for a, b in BOX]
AROUND = [[4, 0], [4, 3], [0.5, 4], [-1.5, 1.5]]  # comes around the robot
ACROSS = [[4, -3], [3, -1], [2.5, 1], [2, 4]]
VELOCITY, PUSH, LATE = [0, 1 / 3, 2 / 3, 1], [0, 0, 1 / 6, 1 / 2], [0.4, 0.6, 0.8, 1.0]
CASES = {
    "point": table(AROUND, VELOCITY),
    "point_pushed": table(ACROSS, PUSH),
    "point_late": table(ACROSS, LATE),
    "point_growing": table(AROUND, VELOCITY, growth=0.8),
    "point_shrinking": table(ACROSS, PUSH, radius=0.9, growth=-0.8),
    "box": table(AROUND, VELOCITY, corners=still(BOX)),
    "box_sharp": table(ACROSS, PUSH, radius=0.0, corners=still(BOX)),
    "box_turning": table(AROUND, VELOCITY, corners=turning(BOX), turn=2.2),
    "box_turning_sharp": table(ACROSS, LATE, radius=0.0, corners=turning(BOX), turn=-2.5),
    "box_turning_growing": table(ACROSS, VELOCITY, growth=0.3, corners=turning(BOX), turn=1.5),
    "stick": table(ACROSS, VELOCITY, corners=turning(STICK), turn=1.0),
    "one_corner": table(AROUND, VELOCITY, corners=turning([[0.5, 0.5]]), turn=1.0),
    "sum": table(AROUND, PUSH, corners=SUM, turn=-1.7),
    "sum_sharp": table(ACROSS, LATE, radius=0.0, corners=SUM, turn=1.2),
}


@pytest.mark.parametrize("name", draws(CASES, len(CASES) // 4))
def test_regions_of_every_kind_of_part_are_what_sampling_in_time_finds(name):
    case, center, radius = CASES[name], np.array([1.0, 1.0]), 8.0
    tolerance = 1e-3 * radius
    (region,) = boundary(case, 1, lambda u: held(case, u), center, radius, tolerance)
    rng = np.random.default_rng(7)
    near, _ = along(rng, region.boundary, 10 * tolerance, 50)
    controls = np.concatenate([in_disc(rng, center, radius, 50), near])
    controls = controls[np.linalg.norm(controls - center, axis=1) < radius - 2 * tolerance]
    clear = distances(region, controls) > 2 * tolerance
    wrong = shapely.contains_xy(region, controls) != held(case, controls)[:, 0]
    assert np.count_nonzero(clear) > 50
    assert not np.any(wrong & clear), f"{controls[wrong & clear]} are on the wrong side"


def test_what_does_not_meet_the_window_leaves_nothing():
    case = table(ACROSS, LATE)
    owners = boundary(case, 2, lambda u: np.ones((len(u), 2), dtype=bool), np.array([90.0, 0.0]), 1.0, 1e-3)
    assert [owner.is_empty for owner in owners] == [True, True]


def test_an_obstacle_that_overlaps_the_robot_blocks_the_window():
    case = table([[0.1, 0], [1, 0], [2, 0], [3, 0]], PUSH)
    (region,) = boundary(case, 1, lambda u: np.ones((len(u), 1), dtype=bool), np.zeros(2), 2.0, 1e-3)
    assert region.area == pytest.approx(4 * np.pi, rel=1e-3)


def test_corners_of_hulls_graze_too():
    curves = grazing_curves(CASES["box_turning"], np.array([1.0, 1.0]), 8.0, 8e-3)
    assert len(curves) >= 8  # two branches of four corners


def test_curves_are_closed_and_bound_the_region():
    """Two cars whose obstacles overlap: one region, its rings closed to the bit, its area that of the rings."""
    cars = [Obstacle(Disc(1.0), ConstantVelocity((6.0, y), (-1.0, 0.0))) for y in (-0.5, 0.8)]
    blocked = control_obstacle(Acceleration(), State((0, 0), (1, 0)), cars, Disc(0.5), horizon=5.0)
    found = blocked.boundary((0, 0), 4.0)
    (curve,) = found.curves
    assert np.array_equal(curve[0], curve[-1])
    assert shapely.Polygon(curve).area == pytest.approx(found.region.area)
    assert found.region.area < sum(region.area for region in found.regions)
    coarse = blocked.boundary((0, 0), 4.0, tolerance=0.05)
    assert len(coarse.curves[0]) < 0.4 * len(curve)
    assert coarse.region.symmetric_difference(found.region).area < 0.05 * found.region.length
    assert blocked.boundary((0, 0), 4.0, tolerance=BOUNDARY * 4.0).region.equals(found.region)


# How curves are made.


def stop_and_go(rng):
    """A disc that comes to rest every second, and goes on in another direction."""
    stops = np.concatenate([rng.uniform(-10, 10, (1, 2)), rng.uniform(-6, 6, (4, 2))]).cumsum(axis=0)
    legs = np.zeros((4, 6, 2))
    legs[:, 0] = stops[:-1]
    for power, weight in ((3, 10.0), (4, -15.0), (5, 6.0)):
        legs[:, power] = weight * np.diff(stops, axis=0)
    return Obstacle(Disc(0.6), PiecewisePolynomial(np.ones(4), legs))


def test_an_arc_that_is_run_along_both_ways_is_left_out():
    """Where a body rests its disc stands, and both sides turn about it: no chords twice, no slivers in between."""
    rng, window, opened = np.random.default_rng(4), Window(np.zeros(2), 8.0, 8.0 * BOUNDARY), 0
    for _ in range(20):
        blocked = control_obstacle(Acceleration(), State((0, 0), (1, 0)), [stop_and_go(rng)], Disc(0.4), horizon=4.0)
        lines, _ = closed_lines(blocked.segments, window)
        chords = np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in map(shapely.get_coordinates, lines)])
        chords = chords[(chords[:, 0] != chords[:, 1]).any(axis=1)]
        forth, back = ({chord.tobytes() for chord in some} for some in (chords, chords[:, ::-1]))
        assert not forth & back
        opened += int((~shapely.is_closed(lines)).sum())
        faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.unary_union(lines))))
        assert len(faces) < 30
    assert opened > 5
