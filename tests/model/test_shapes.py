"""What shapes need beside the oracle: headings, growing radii, traffic that is cut once for many decisions."""

import numpy as np
import pytest
from draws import draws
from hypothesis import given, strategies as st
from parts import TRAJECTORIES, UNCERTAINTIES, served

from slalom import (
    METHODS,
    Acceleration,
    Ball,
    BoundedError,
    Capsule,
    Circular,
    Composite,
    ConstantAcceleration,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    GaussianError,
    Goal,
    InvalidInput,
    Limits,
    Navigator,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    PiecewisePolynomial,
    Polygon,
    Polyline,
    Rectangle,
    Sampled,
    State,
    Stationary,
    Union,
    Velocity,
    control_obstacle,
    select,
)
from slalom.forecast.forecast import AtConstantVelocity
from slalom.model.trajectory.protocol import direction_path
from slalom.model.uncertainty import chi_quantile
from slalom.obstacle.window import predicted

MOVING = [name for name in TRAJECTORIES if name not in ("stationary", "function", "moved")]
TIMES = np.linspace(0.0, 6.0, 4001)


def along(path, t):
    """A path's curve and error at times t."""
    k = np.clip(np.searchsorted(path.times, t, side="right") - 1, 0, len(path.points) - 1)
    x = ((t - path.times[k]) / np.diff(path.times)[k])[:, None]
    weights = np.stack([(1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x * x * (1 - x), x**3], axis=1)
    return (weights * path.points[k]).sum(axis=1), path.error[k]


@pytest.mark.parametrize("name", MOVING)
def test_directions_stay_within_their_error(name):
    trajectory = TRAJECTORIES[name](2)
    path = direction_path(trajectory, 0.0, 6.0, 1e-6)
    assert path.times[0] == 0.0
    assert path.times[-1] == 6.0
    assert np.all(np.diff(path.times) > 0.0)
    velocity = trajectory.velocity(TIMES)
    curve, error = along(path, TIMES)
    off = np.linalg.norm(curve - velocity / np.linalg.norm(velocity, axis=1)[:, None], axis=1)
    # At a break the velocity jumps, and the next piece begins.
    breaks = trajectory.breaks(0.0, 6.0)
    near = np.abs(TIMES[:, None] - breaks).min(axis=1, initial=np.inf) < 1e-6
    assert np.all((off <= error + 1e-9) | near)
    assert (error > 0.5).mean() < 0.05


def test_a_body_that_turns_on_the_spot_counts_as_its_disc():
    """Straight up and down again: at the top it turns by half a turn in no time."""
    path = direction_path(ConstantAcceleration((0, 0), (0, 1), (0, -1)), 0.0, 2.0, 1e-6)
    at = (path.times[:-1] < 1.0) & (path.times[1:] > 1.0)
    assert np.all(path.points[at] == 0.0)
    assert np.all(path.error[at] == 1.0)
    assert np.diff(path.times)[at].sum() < 4e-3
    bar = Obstacle(Rectangle(4.0, 0.2), ConstantAcceleration((0, 0), (0, 1), (0, -1)), heading="motion")
    beside = State((1.5, 0.5), (0, 0))
    blocked = control_obstacle(Velocity(), beside, [bar], Disc(0.1), horizon=2.0)
    # Its end, 2 m from the middle, sweeps over the robot beside it.
    assert float(blocked.time_to_collision((0, 0))) == pytest.approx(1.0, abs=2e-3)


def test_the_heading_stays_where_a_car_stops():
    times = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    positions = np.array([(0, 0), (1, 1), (2, 2), (2, 2), (2, 2)], float)
    car = Obstacle(Rectangle(4, 2), Sampled(times, positions, "linear"), heading="motion")
    diagonal = np.full(2, np.sqrt(0.5))
    for t in (0.5, 1.5, 2.5, 3.5, 4.0):
        np.testing.assert_allclose(car.direction(t), diagonal, atol=1e-12)
    np.testing.assert_allclose(car.direction(np.array([0.5, 3.0])), [diagonal, diagonal], atol=1e-12)
    for start, end in ((0.0, 4.0), (1.5, 3.5), (2.5, 4.0), (3.2, 3.3)):
        path = car.directions(start, end, 1e-6)
        np.testing.assert_allclose(along(path, np.linspace(start, end, 50))[0], np.tile(diagonal, (50, 1)), atol=1e-9)
    seen = predicted(car, AtConstantVelocity(), 3.5)
    assert seen.heading == pytest.approx(np.pi / 4)
    assert predicted(car, AtConstantVelocity(), 1.5).heading == "motion"


def stops(seed):
    """A car that drives along a bent line, stands from 3 s on and drives elsewhere from 8 s on, and the same by kinds.

    The trajectories have the rounding of random positions.
    """
    rng = np.random.default_rng(seed)
    begin, step, away = rng.uniform(-10.0, 10.0, 2), rng.normal(size=2), rng.normal(size=2)
    corner = begin + 3.0 * step
    end = corner + rng.normal(size=2)
    stamps = np.arange(0.0, 13.0)
    places = np.array([begin, begin + step, corner] + [end] * 6 + [end + k * away for k in range(1, 5)])
    share, bend = end - begin, np.array([-step[1], step[0]])
    quintic = [begin, (0, 0), (0, 0), 10 * share / 27, -15 * share / 81, 6 * share / 243, (0, 0), (0, 0)]
    # Another term with a zero of third order at 0 and 3 s bends the line.
    for power, weight in ((4, 27.0), (5, -27.0), (6, 9.0), (7, -1.0)):
        quintic[power] = quintic[power] + 0.01 * weight * bend
    planned = PiecewisePolynomial([3.0], [quintic])
    return {
        "linear": Sampled(stamps, places, "linear"),
        "smooth": Sampled(stamps, places, "smooth"),
        "planned": planned,
        "composed": Composite((planned, Stationary(end), ConstantVelocity(end, away, 8.0)), (3.0, 8.0)),
    }


@pytest.mark.parametrize("kind", stops(0))
@pytest.mark.parametrize("seed", draws(range(4)))
def test_the_heading_at_rest_is_the_last_one(seed, kind):
    """However a trajectory comes to rest, and wherever a decision begins: no body shrinks or turns while it stands."""
    car = Obstacle(Rectangle(4, 2), stops(seed)[kind], heading="motion", after_end="continues").continued
    times = np.linspace(0.0, 12.0, 12001)
    velocity = car.trajectory.velocity(times)
    moves = np.linalg.norm(velocity, axis=1) > 1e-5
    last = np.maximum.accumulate(np.where(moves, np.arange(len(times)), 1 + np.argmax(moves[1:])))
    expected = velocity[last] / np.linalg.norm(velocity[last], axis=1)[:, None]
    rests = (times > 4.001) & (times < 6.999) & ~moves
    assert rests.sum() > 2900
    np.testing.assert_allclose(car.direction(times[rests][::500]), expected[rests][::500], atol=0.01)
    for start, end in ((0.3, 6.0), (2.7, 12.0), (4.5, 6.5), (5.1, 11.0)):
        inside = (times > start) & (times < end)
        path = car.directions(start, end, 1e-6)
        curve, error = along(path, times[inside])
        jumps = np.abs(times[inside][:, None] - car.trajectory.breaks(start, end)).min(axis=1, initial=np.inf) < 2e-3
        off = np.linalg.norm(curve - expected[inside], axis=1)
        assert np.all((off <= error + 0.01) | jumps)
        assert np.all(error[rests[inside]] == 0.0)


@pytest.mark.parametrize("kind", stops(0))
def test_a_car_that_stands_blocks_with_its_whole_length(kind):
    """A robot drives at the tail of a car that stops before: it meets the side, not the position of the car."""
    for seed in range(4):
        car = Obstacle(Rectangle(4, 1), stops(seed)[kind], heading="motion", after_end="continues")
        along_car = car.continued.direction(5.0)
        across = np.array([-along_car[1], along_car[0]])
        tail = car.continued.trajectory.position(5.0) - 1.8 * along_car
        for start in (0.0, 2.5, 5.0):
            # At 6.5 s it would be on the axis of the car, and half of the widths before that at its side.
            state = State(tail + 2.0 * (6.5 - start) * across, -2.0 * across)
            blocked = control_obstacle(Velocity(), state, [car], Disc(0.25), horizon=7.0, start=start)
            hit = blocked.time_to_collision(-2.0 * across)
            assert float(hit) == pytest.approx(6.5 - start - 0.375, abs=1e-3)


def test_a_car_at_rest_that_never_moved_has_no_heading():
    """Whether its samples are joined by lines or smoothly."""
    for interpolation in ("linear", "smooth"):
        waits = Sampled([0.0, 1.0, 2.0, 3.0, 4.0], [(0.1, 0.7)] * 3 + [(1, 1), (2, 1)], interpolation)
        car = Obstacle(Rectangle(4, 2), waits, heading="motion")
        with pytest.raises(InvalidInput, match=r"expected one that moved before 0\.5 s"):
            car.directions(0.5, 4.0, 1e-6)
        assert along(car.directions(2.5, 4.0, 1e-6), np.array([3.0]))[0][0, 0] > 0.5


@pytest.mark.parametrize("first", [0.0, -np.inf])
def test_a_table_decides_about_a_car_that_waited_at_first_as_a_list(first):
    """Although the pieces of the table begin before the first motion, where its direction is not known."""
    waits, stands = Sampled([0.0, 1.0, 2.0, 3.0, 20.0], [(9, -6)] * 3 + [(9, -5), (9, 14)]), Stationary((9, -6))
    if first == -np.inf:
        waits = Composite((stands, ConstantVelocity((9, -6), (0, 1), 2.0)), (2.0,))
    car = Obstacle(Rectangle(4, 2), waits, "car", heading="motion")
    robot = Navigator(METHODS["nao"], Disc(0.4), Limits(2.0, 1.5))
    for now in (2.5, 5.0, 8.0):
        alone, table = (
            robot.decide(State((0, 0), (2, 0)), obstacles, Goal(Stationary((20, 0))), now=now)
            for obstacles in ([car], ObstacleTable([car]))
        )
        assert alone.outcome is table.outcome
        assert alone.manoeuvre.control.tobytes() == table.manoeuvre.control.tobytes()


@pytest.mark.parametrize("name", served(2))
def test_bodies_do_not_depend_on_how_traffic_was_asked_for(name):
    """A circle is cut once for many decisions; where it is cut is not felt."""
    from parts import SHAPES

    shape, path = SHAPES[name](1.0, 2), Circular((6, 0), 3.0, 2.0, 0.3)
    state, u = State((0, 0), (1, 0)), np.array([0.4, 0.1])
    for start in (0.0, 3.99, 4.01, 17.3):
        again = Obstacle(shape, path, heading="motion")
        first = ControlObstacle(Acceleration(), state, ObstacleWindow([again], start, 4.0), Disc(0.3))
        for before in (start - 7.0, start + 3.0, start):
            ObstacleWindow([again], before, 4.0).bodies(Disc(0.3))
        second = ControlObstacle(Acceleration(), state, ObstacleWindow([again], start, 4.0), Disc(0.3))
        assert first.clearance(u) == second.clearance(u)
        fresh = Obstacle(shape, path, heading="motion")
        third = ControlObstacle(Acceleration(), state, ObstacleWindow([fresh], start, 4.0), Disc(0.3))
        assert first.clearance(u) == third.clearance(u)


def test_each_obstacle_may_have_its_own_horizon():
    near, far = (Obstacle(Disc(0.5), ConstantVelocity((x, 0), (-1, 0))) for x in (5.0, 9.0))
    state = State((0, 0), (1, 0))
    for until, blocked in (((6.0, 6.0), [True, True]), ((2.0, 6.0), [False, True]), ((6.0, 3.0), [True, False])):
        traffic = ObstacleWindow([near, far], 0.0, 6.0, until)
        times = ControlObstacle(Velocity(), state, traffic, Disc(0.5)).times_to_collision((1.0, 0.0))
        assert list(np.isfinite(times)) == blocked


class TestUncertainty:
    @pytest.mark.parametrize(
        "shape", draws([Disc(0.4), Ball(0.4), Rectangle(1.0, 0.6), Capsule((0, 0, 0), (1, 0, 0), 0.2)], 2)
    )
    @pytest.mark.parametrize("unsure", UNCERTAINTIES.values(), ids=UNCERTAINTIES)
    def test_a_growing_radius_is_felt_when_it_has_grown(self, shape, unsure):
        """The clearance of a passer, found by samples of its true growth; a little less is allowed, never more."""
        d = shape.dimension
        position, velocity = np.zeros(d), np.zeros(d)
        position[:2], velocity[:2] = (4.0, 1.8), (-1.0, 0.1)
        sure = Obstacle(shape, ConstantVelocity(position, velocity))
        grown = Obstacle(shape, ConstantVelocity(position, velocity), uncertainty=unsure)
        robot = Disc(0.2) if d == 2 else Ball(0.2)
        state = State(np.zeros(d), velocity * 0.0)
        clearances = []
        for t in np.linspace(1e-3, 6.0, 150):
            # The gap at one moment: an obstacle that is there for that moment only.
            moment = Obstacle(
                shape, Sampled([t - 1e-4, t], sure.trajectory.position(np.array([t - 1e-4, t])), "linear")
            )
            blocked = control_obstacle(Velocity(), state, [moment], robot, horizon=6.0)
            clearances.append(float(blocked.clearance(np.zeros(d))) - float(unsure.radius(t, d)))
        blocked = control_obstacle(Velocity(), state, [grown], robot, horizon=6.0)
        found = float(blocked.clearance(np.zeros(d)))
        assert min(clearances) - 0.02 <= found <= min(clearances) + 1e-4

    @pytest.mark.parametrize("d", [2, 3])
    @pytest.mark.parametrize("velocity", [0.0, 0.15])
    @pytest.mark.parametrize("probability", draws([0.05, 0.3, 0.01]))
    def test_gaussian_errors_leave_the_radius_as_often_as_stated(self, d, velocity, probability):
        """Measured coverage of 200 000 errors over all times at once; exact where the error does not grow."""
        rng = np.random.default_rng([d, int(100 * velocity), int(1000 * probability)])
        n, times = 200_000, np.linspace(0.0, 8.0, 41)
        unsure = GaussianError(0.2, velocity, probability)
        position, speed = rng.normal(0.0, 0.2, (n, d)), rng.normal(0.0, velocity, (n, d))
        left = np.zeros(n, bool)
        for t, radius in zip(times, unsure.radius(times, d)):
            left |= np.linalg.norm(position + t * speed, axis=1) > radius
        share, spread = left.mean(), 4.0 * np.sqrt(probability * (1.0 - probability) / n)
        assert share <= probability + spread
        if velocity == 0.0:
            assert share >= probability - spread

    @pytest.mark.parametrize("freedoms", [2, 3, 4, 6])
    def test_quantiles(self, freedoms):
        rng = np.random.default_rng(freedoms)
        lengths = np.linalg.norm(rng.normal(size=(400_000, freedoms)), axis=1)
        for probability in (0.5, 0.1, 0.01):
            spread = 4.0 * np.sqrt(probability / len(lengths))
            assert (lengths > chi_quantile(probability, freedoms)).mean() == pytest.approx(probability, abs=spread)

    @given(t=st.floats(0.0, 20.0), s=st.floats(0.0, 20.0), share=st.floats(0.0, 1.0))
    @pytest.mark.parametrize("unsure", UNCERTAINTIES.values(), ids=UNCERTAINTIES)
    def test_radii_are_convex_and_never_fall(self, unsure, t, s, share):
        between = share * t + (1.0 - share) * s
        chord = share * unsure.radius(t, 2) + (1.0 - share) * unsure.radius(s, 2)
        assert unsure.radius(between, 2) <= chord + 1e-12
        assert unsure.radius(max(s, t), 2) >= unsure.radius(min(s, t), 2) >= 0.0

    def test_it_is_avoided(self):
        """The choice keeps the whole grown obstacle clear."""
        other = ConstantVelocity((6, 0.1), (-1, 0))
        unsure = Obstacle(Disc(0.5), other, uncertainty=BoundedError(0.1, 0.1))
        state, limits = State((0, 0), (1, 0)), Limits(2.0, 1.0)
        blocked = control_obstacle(Acceleration(), state, [unsure], Disc(0.3), horizon=5.0)
        choice = select((0.0, 0.0), limits.admissible(Acceleration(), state, 5.0), blocked)
        assert choice.safe
        t = np.linspace(0.0, 5.0, 5001)
        gap = np.linalg.norm(other.position(t) - Acceleration().position(state, t)(choice.control), axis=1)
        least = (gap - 0.8 - unsure.uncertainty.radius(t, 2)).min()
        assert -1e-6 <= least <= 0.02


def test_a_thin_wall_holds_a_point_robot():
    """Neither has a width, yet their meeting is a collision once they have a margin."""
    wall = Obstacle(Polyline([(2, -3), (2, 3)]), Stationary((0, 0)))
    blocked = control_obstacle(Velocity(), State((0, 0), (0, 0)), [wall], Disc(0.0), horizon=4.0, margin=1e-3)
    assert float(blocked.time_to_collision((1, 0))) == pytest.approx(1.999, abs=1e-6)
    choice = select((1.0, 0.0), Limits(1.0, 1.0).admissible(Velocity(), State((0, 0), (0, 0)), 4.0), blocked)
    assert choice.control[0] <= 0.49976 or abs(choice.control[1]) > 0.75


@pytest.mark.parametrize("radius", [0.0, 0.2])
def test_sharp_corners_end_the_exchange(radius):
    """A corner that sweeps over a curve needs few cuts, though at every time it is a point."""
    wedge = Polygon([(0, 0), (3, 0), (3, 2), (1.5, 0.5)], radius)
    rng = np.random.default_rng(0)
    for _ in range(60):
        state = State((0, 0), rng.uniform(-2, 2, 2))
        moving = Obstacle(wedge, ConstantVelocity(rng.uniform(-6, 6, 2), rng.uniform(-2, 2, 2)), heading=0.7)
        robot = Union((Disc(0.3), Rectangle(2.0, 0.5)))
        blocked = control_obstacle(Acceleration(), state, [moving], robot, horizon=5.0)
        if len(blocked.overlapping):
            continue
        choice = select(rng.uniform(-2, 2, 2), Limits(4.0, 3.0).admissible(Acceleration(), state, 5.0), blocked)
        assert choice.elements < 60
