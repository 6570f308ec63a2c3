"""The tracker: laws of its filter, order of arrival, age, and what decisions get of it."""

from dataclasses import dataclass

import numpy as np
import pytest

from slalom import (
    AtConstantVelocity,
    Ball,
    BoundedError,
    ConstantVelocityFilter,
    Disc,
    Estimate,
    Filter,
    Goal,
    InvalidInput,
    KalmanError,
    Limits,
    Measurement,
    Navigator,
    Obstacle,
    Rectangle,
    State,
    Stationary,
    Tracker,
    Tracks,
    method,
)
from slalom.model.uncertainty import COVERAGES, Adjusted, Covering, coverage_of, radii_between, until_of, with_share


def measured(seed: int, n: int = 12, d: int = 2) -> list[tuple]:
    """Measurements (t, id, position, velocity, covariance) of two obstacles within a second."""
    rng = np.random.default_rng([seed, d])
    spread = [np.diag(rng.uniform(0.01, 0.1, d)) for _ in range(n)]
    return [
        (float(t), int(k), rng.normal(size=d), None if k else rng.normal(size=d), cov if rng.random() < 0.5 else None)
        for t, k, cov in zip(rng.uniform(0.0, 1.0, n), rng.integers(2, size=n), spread)
    ]


def states(tracker: Tracker, now: float) -> tuple[np.ndarray, tuple]:
    """States and uncertainties of the round obstacles, ordered by id."""
    (tracks,) = tracker.at(now)
    assert isinstance(tracks, Tracks)
    order = np.argsort(tracks.ids)
    return tracks.states[order], tuple(tracks.uncertainties[k] for k in order)


# The filter.


@pytest.mark.parametrize("d", [2, 3])
def test_the_filter_is_the_least_squares_estimate(d: int) -> None:
    """Without process noise: of a straight line through the measurements and the first guess of the velocity."""
    rng = np.random.default_rng(d)
    filter = ConstantVelocityFilter(acceleration=0.0, position=0.2, velocity=0.3, first_velocity=1.5)
    times, start, moves = np.sort(rng.uniform(0.0, 2.0, 9)), rng.normal(size=d), rng.normal(size=d)
    positions = start + times[:, None] * moves + 0.2 * rng.normal(size=(9, d))
    velocities = [moves + 0.3 * rng.normal(size=d) if k % 2 else None for k in range(9)]
    tracker = Tracker(Disc(0.3) if d == 2 else Ball(0.3), filter, max_age=5.0, growth=np.inf)
    rows, wanted, weights = [], [], []
    for t, p, v in zip(times, positions, velocities):
        tracker.update(t, 1, p, v)
        rows.append([1.0, t])
        wanted.append(p)
        weights.append(1 / 0.2)
        if v is not None:
            rows.append([0.0, 1.0])
            wanted.append(v)
            weights.append(1 / 0.3)
    rows.append([0.0, 1.0])
    wanted.append(np.zeros(d))
    weights.append(1 / 1.5)
    matrix = np.array(rows) * np.array(weights)[:, None]
    line = np.linalg.lstsq(matrix, np.array(wanted) * np.array(weights)[:, None], rcond=None)[0]
    found, (error,) = states(tracker, 2.5)
    np.testing.assert_allclose(found[0, 0], line[0] + 2.5 * line[1], atol=1e-9)
    np.testing.assert_allclose(found[0, 1], line[1], atol=1e-9)
    covariance = np.linalg.inv(matrix.T @ matrix)
    ahead = np.array([1.0, 2.5])
    assert error.position == pytest.approx(np.sqrt(ahead @ covariance @ ahead), rel=1e-9)
    assert error.velocity == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-9)


def test_prediction_is_the_covariance_equation() -> None:
    """P' = F P + P F' + G q G', integrated numerically; and in two steps as in one."""
    filter, f = ConstantVelocityFilter(acceleration=0.7), np.array([[0.0, 1.0], [0.0, 0.0]])
    start = filter.begin(Measurement(0.0, np.array([1.0, 2.0]), np.array([0.5, -0.2]), None))

    def rate(p: np.ndarray) -> np.ndarray:
        return f @ p + p @ f.T + np.diag([0.0, 0.7**2])

    expected, h = start.covariance[np.ix_([0, 2], [0, 2])], 1.3 / 100
    for _ in range(100):
        # Runge and Kutta, exact here: the covariance is a cubic.
        first = rate(expected)
        second = rate(expected + 0.5 * h * first)
        third = rate(expected + 0.5 * h * second)
        expected = expected + h / 6 * (first + 2 * second + 2 * third + rate(expected + h * third))
    once, twice = filter.predict(start, 1.3), filter.predict(filter.predict(start, 0.4), 0.9)
    np.testing.assert_allclose(once.covariance[np.ix_([0, 2], [0, 2])], expected, rtol=1e-7)
    for one, two in zip(once, twice):
        np.testing.assert_allclose(one, two, rtol=1e-12, atol=1e-12)


def test_the_radius_is_that_of_the_predicted_belief() -> None:
    """At every later time: the uncertainty now says what the filter would say then."""
    filter = ConstantVelocityFilter()
    belief = filter.begin(Measurement(0.0, np.zeros(2), np.zeros(2), None))
    belief = filter.predict(belief, 0.5)
    radius = filter.estimate(belief).uncertainty.radius([0.0, 0.7, 3.0], 2)
    later = [filter.estimate(filter.predict(belief, t)).uncertainty.radius(0.0, 2) for t in (0.0, 0.7, 3.0)]
    np.testing.assert_allclose(radius, later, rtol=1e-9)


def test_the_radius_holds_as_often_as_it_says() -> None:
    """Of 1500 obstacles that move as the model says, 5 % are outside, within four standard deviations."""
    rng, n, dt = np.random.default_rng(3), 1500, 0.1
    filter = ConstantVelocityFilter(acceleration=0.5, position=0.1, first_velocity=1.0, probability=0.05)
    position, velocity = np.zeros((n, 2)), rng.normal(0.0, 1.0, (n, 2))
    # All beliefs have one covariance: the means are those of arrays.
    beliefs = [filter.begin(Measurement(0.0, rng.normal(0.0, 0.1, 2), None, None)) for _ in range(n)]
    chol = np.linalg.cholesky(0.5**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
    for step in range(1, 21):
        kicks = rng.normal(size=(n, 2, 2)) @ chol.T
        position, velocity = position + dt * velocity + kicks[..., 0], velocity + kicks[..., 1]
        if step <= 5:
            seen = position + rng.normal(0.0, 0.1, (n, 2))
            beliefs = [
                filter.correct(filter.predict(b, dt), Measurement(step * dt, z, None, None))
                for b, z in zip(beliefs, seen)
            ]
    means = np.array([filter.predict(b, 1.5).mean[:2] for b in beliefs])
    radius = filter.estimate(beliefs[0]).uncertainty.radius(1.5, 2)
    outside = np.mean(np.linalg.norm(means - position, axis=1) > radius)
    assert abs(outside - 0.05) < 4 * np.sqrt(0.05 * 0.95 / n)


def test_a_negative_correlation_counts_as_none() -> None:
    belief = ConstantVelocityFilter().begin(Measurement(0.0, np.zeros(2), np.zeros(2), None))
    mixed = belief.covariance.copy()
    mixed[:2, 2:] = mixed[2:, :2] = -0.01 * np.eye(2)
    error = ConstantVelocityFilter().estimate(belief._replace(covariance=mixed)).uncertainty
    assert error.correlation == 0.0
    exact = ConstantVelocityFilter(velocity=1e-300).begin(Measurement(0.0, np.zeros(2), np.zeros(2), None))
    assert ConstantVelocityFilter().estimate(exact).uncertainty.correlation == 0.0


# Order, age and time.


@pytest.mark.parametrize("d", [2, 3])
def test_any_order_gives_the_same_bits(d: int) -> None:
    for seed in range(10):
        shape, some = Disc(0.3) if d == 2 else Ball(0.3), measured(seed, d=d)
        found = []
        for order in range(4):
            tracker = Tracker(shape)
            for k in np.random.default_rng(order).permutation(len(some)):
                assert tracker.update(*some[k])
                if k % 3 == 0:
                    tracker.at(0.0)
            found.append(states(tracker, 1.2))
        for values, errors in found[1:]:
            assert values.tobytes() == found[0][0].tobytes()
            assert errors == found[0][1]


def test_a_measurement_that_comes_twice_counts_once() -> None:
    once, twice = Tracker(), Tracker()
    for one in measured(1):
        once.update(*one)
        assert twice.update(*one)
        assert not twice.update(*one)
    assert states(once, 1.1)[0].tobytes() == states(twice, 1.1)[0].tobytes()


def test_late_measurements_replay_and_too_late_ones_are_not_used() -> None:
    tracker = Tracker(max_age=1.0)
    for t in (0.0, 0.5, 1.0, 1.5, 2.0):
        assert tracker.update(t, "a", (t, 0.0))
    tracker.at(2.0)
    before = states(tracker, 2.0)[0]
    assert not tracker.update(0.9, "a", (5.0, 5.0))
    assert not tracker.update(0.2, "new", (5.0, 5.0))
    assert tracker.ids == ("a",)
    assert states(tracker, 2.0)[0].tobytes() == before.tobytes()
    assert tracker.update(1.2, "a", (1.2, 0.3))
    late = states(tracker, 2.0)[0]
    ordered = Tracker(max_age=1.0)
    for t in (0.0, 0.5, 1.0, 1.2, 1.5, 2.0):
        ordered.update(t, "a", (t, 0.3 if t == 1.2 else 0.0))
    assert states(ordered, 2.0)[0].tobytes() == late.tobytes()


@pytest.mark.parametrize("braking", [None, 0.0, 1.5])
def test_its_tracks_brake_as_it_states(braking: float | None) -> None:
    tracker = Tracker(braking=braking)
    for id in "ab":
        tracker.update(0.0, id, (4.0, 0.0), (1.0, 0.0))
    (tracks,) = tracker.at(0.1)
    assert isinstance(tracks, Tracks)
    found = None if tracks.braking is None else tracks.braking.tolist()
    assert found == (None if braking is None else [braking, braking])


def test_what_is_not_measured_for_long_is_dropped_and_begins_anew() -> None:
    """Also where time jumps forward; the uncertainty has grown until then."""
    tracker = Tracker(max_age=1.0)
    for t in (-0.1, 0.0):
        tracker.update(t, 7, (t, 0.0), (1.0, 0.0))
    radii = [states(tracker, now)[1][0].radius(0.0, 2) for now in (0.0, 0.5, 1.0)]
    assert radii[0] < radii[1] < radii[2]
    assert tracker.at(1.01) == ()
    assert tracker.ids == ()
    tracker.update(60.0, 7, (9.0, 9.0))
    fresh = Tracker()
    fresh.update(60.0, 7, (9.0, 9.0))
    assert states(tracker, 60.0)[0].tobytes() == states(fresh, 60.0)[0].tobytes()
    gap = Tracker(max_age=1.0)
    gap.update(0.0, 7, (0.0, 0.0), (1.0, 0.0))
    gap.update(5.0, 7, (1.0, 0.0))
    np.testing.assert_array_equal(states(gap, 5.0)[0][0, 1], 0.0)


def test_between_measurements_and_stamps_of_the_future() -> None:
    """A later stamp changes nothing before its time, and a wrong one does not end the track."""
    tracker, plain = Tracker(), Tracker()
    for t in (0.0, 0.4, 0.8):
        for one in (tracker, plain):
            one.update(t, 1, (t, 0.0))
    tracker.update(1e9, 1, (0.0, 0.0))
    assert states(tracker, 0.9)[0].tobytes() == states(plain, 0.9)[0].tobytes()
    tracker.update(1.0, 1, (1.0, 0.0))
    plain.update(1.0, 1, (1.0, 0.0))
    assert states(tracker, 1.9)[0].tobytes() == states(plain, 1.9)[0].tobytes()
    assert tracker.at(3.0) == ()
    early = Tracker()
    early.update(0.5, 1, (0.0, 0.0))
    assert early.at(0.4) == ()


def test_memory_does_not_grow() -> None:
    tracker = Tracker(max_age=0.5)
    for k in range(400):
        tracker.update(0.05 * k, "a", (0.05 * k, 0.0))
        tracker.update(0.05 * k, k, (0.0, 3.0))
        tracker.at(0.05 * k)
    assert len(tracker.ids) <= 12
    assert len(tracker._scans) <= 12


# Shapes and decisions.


def test_shapes_and_headings() -> None:
    """What is not round counts as the disc about it until its heading is known; both stay from then on."""
    tracker, car = Tracker(Disc(0.3), growth=np.inf), Rectangle(4.0, 2.0)
    tracker.update(0.0, "car", (3.0, 0.0), shape=car)
    tracker.update(0.0, "person", (5.0, 5.0))
    (tracks,) = tracker.at(0.0)
    assert dict(zip(tracks.ids, tracks.radii)) == {"car": pytest.approx(np.sqrt(5.0)), "person": 0.3}
    tracker.update(0.1, "car", (3.0, 0.0), heading=0.5)
    tracker.update(0.2, "car", (3.0, 0.0))
    tracks, obstacle = tracker.at(0.2)
    assert tracks.ids == ("person",)
    assert isinstance(obstacle, Obstacle)
    assert (obstacle.shape, obstacle.heading, obstacle.name) == (car, 0.5, "car")
    assert isinstance(obstacle.uncertainty, KalmanError)
    tracker.update(0.25, "disc", (9.0, 0.0), shape=Disc(0.7), heading=1.0)
    tracks, _ = tracker.at(0.3)
    assert set(tracks.ids) == {"person", "disc"}


def test_each_track_has_its_own_uncertainty() -> None:
    """In the pieces as obstacle by obstacle, one by one or all the same."""
    errors = (BoundedError(0.1, 0.5), None, KalmanError(0.2, 0.3, 0.5, 0.1))
    places, moves = [(2.0, 0.0), (4.0, 1.0), (6.0, -1.0)], [(0.1, 0.0), (0.0, 0.2), (-0.3, 0.0)]
    tracks = Tracks(places, moves, 0.3, 1.0, uncertainty=errors)
    robot = Navigator(method("nao"), Disc(0.4), Limits(1.5, 1.0))
    state = State((0.0, 0.0), (0.0, 0.0))
    together = robot.predict(tracks, state, 1.5).bodies(Disc(0.4)).pieces
    for k, obstacle in enumerate(tracks.obstacles):
        rows = together.body == k
        error = obstacle.uncertainty or BoundedError()
        begins, ends = (error.radius(0.5 + together.times[rows][:, j], 2) for j in (0, 1))
        np.testing.assert_allclose(together.radius[rows], begins, atol=1e-12)
        np.testing.assert_allclose(together.radius[rows] + together.growth[rows], ends, atol=1e-12)
    one = Tracks(places, moves, 0.3, 1.0, uncertainty=errors[0])
    assert one.uncertainties == (errors[0],) * 3
    worlds = Tracks(places, moves, 0.3, 1.0, uncertainty=errors, worlds=[0, 1, 0]).in_world(0)
    assert worlds.uncertainties == (errors[0], errors[2])


def test_an_aged_uncertainty_is_the_same_later() -> None:
    error = BoundedError(0.1, 0.2, 0.3)
    times = np.linspace(0.0, 4.0, 9)
    np.testing.assert_array_equal(Adjusted(error, 1.5).radius(times, 2), error.radius(times + 1.5, 2))


@dataclass(frozen=True)
class LastPosition:
    """Another filter: where it was last, which may be wrong by a drift of 0.1 m/s."""

    forecast = AtConstantVelocity()

    def begin(self, seen: Measurement) -> tuple[Measurement, float]:
        return seen, 0.0

    def predict(self, belief: tuple[Measurement, float], duration: float) -> tuple[Measurement, float]:
        return belief[0], belief[1] + duration

    def correct(self, belief: tuple[Measurement, float], seen: Measurement) -> tuple[Measurement, float]:
        return seen, 0.0

    def distance(self, belief: tuple[Measurement, float], seen: Measurement) -> float:
        return float(np.linalg.norm(seen.position - belief[0].position)) / 0.1

    def estimate(self, belief: tuple[Measurement, float]) -> Estimate:
        seen, age = belief
        state = np.stack([seen.position, 0.0 * seen.position, 0.0 * seen.position])
        return Estimate(state, BoundedError(0.1 + 0.1 * age, 0.1))


@pytest.mark.parametrize("filter", [ConstantVelocityFilter(), LastPosition()])
def test_decisions_avoid_what_is_not_seen_for_a_while(filter: Filter) -> None:
    """A person in the way, hidden for 0.6 s: the robot stops before where the person may be."""
    assert isinstance(filter, Filter)
    tracker = Tracker(Disc(0.3), filter)
    for k in range(6):
        tracker.update(0.1 * k, "person", (3.0, 0.0), (0.0, 0.0))
    robot, state, decision = Navigator(method("nao"), Disc(0.4), Limits(1.2, 1.5)), State((0, 0), (1.0, 0)), None
    goal = Goal(Stationary((8.0, 0.0)), 0.3)
    for k in range(6, 12):
        decision = robot.decide(state, tracker.at(0.1 * k), goal, now=0.1 * k, previous=decision)
        assert decision.outcome.safe
        state = (
            decision.manoeuvre.advance(0.1)
            if decision.manoeuvre.start == 0.1 * k
            else decision.state_at(0.1 * (k + 1), state, 0.1 * k)
        )
    times = 1.1 + np.linspace(0.0, 5.0, 200)
    assert np.linalg.norm(decision.manoeuvre.position(times) - (3.0, 0.0), axis=1).min() > 0.7


def test_radii_grow_until_the_robot_decides_anew() -> None:
    """Up to `growth` as those without an end; then not at all, and never less between the times of a decision."""
    plain, tracker = Tracker(growth=np.inf), Tracker(growth=0.5)
    for k in range(10):
        for one in (plain, tracker):
            one.update(0.1 * k, "a", (0.1 * k, 0.0))
    (free,), (bounded,) = plain.at(0.9), tracker.at(0.9)
    early, times = np.linspace(0.0, 0.5, 6), np.linspace(0.0, 3.0, 8)
    radius, grows = bounded.uncertainties[0].radius, free.uncertainties[0].radius
    np.testing.assert_array_equal(radius(early, 2), grows(early, 2))
    assert float(radius(2.0, 2)) == float(grows(0.5, 2))
    dense = np.linspace(0.0, 3.0, 301)
    exact = np.array([float(radius(t, 2)) for t in dense])
    assert np.all(np.interp(dense, times, radii_between(bounded.uncertainties[0], times, 2)) >= exact - 1e-12)
    with pytest.raises(InvalidInput, match="growth: expected a number above 0"):
        Tracker(growth=0.0)


def crossing(growth: float = 0.5) -> tuple[Tracks, float]:
    """Tracks of two people that turn, after 8 s of measurements with 5 cm of noise, and their time [s]."""
    rng, tracker = np.random.default_rng(0), Tracker(Disc(0.3), growth=growth)
    for t in np.arange(0.0, 8.0, 0.1).tolist():
        for name, place in (("a", (t - 4.0, 0.6 * np.sin(t))), ("b", (4.0 - 0.5 * t, 2.0 + 0.5 * np.cos(2.0 * t)))):
            tracker.update(t, name, np.array(place) + rng.normal(0.0, 0.05, 2))
        found = tracker.at(t)
    return found[0], t


@pytest.mark.parametrize("growth", [0.5, np.inf])
def test_sets_of_a_track_are_nested_and_grow_as_long(growth: float) -> None:
    """The smaller set lies in the larger one at each time, and both end to grow at the same time."""
    tracks, _ = crossing(growth)
    times = np.linspace(0.0, 4.0, 81)
    for stated in tracks.uncertainties:
        assert coverage_of(stated) == 0.95
        assert with_share(stated, 0.7) is stated
        sets = [with_share(stated, share) for share in COVERAGES]
        assert [coverage_of(one) for one in sets] == [*COVERAGES]
        assert [until_of(one) for one in sets] == 3 * [growth]
        radii = np.stack([one.radius(times, 2) for one in sets])
        assert (np.diff(radii, axis=0) >= 0.0).all()
        assert (radii[0] < radii[2]).any()
        ended = np.stack([one.radius(np.minimum(times, growth), 2) for one in sets])
        np.testing.assert_array_equal(radii, ended)
    covered = tracks.covering(0.5)
    assert [coverage_of(one) for one in covered.uncertainties] == len(tracks) * [0.5]
    assert covered.states is tracks.states


@pytest.mark.parametrize("aside", [0.1, 2.0])
def test_a_robot_among_tracks_keeps_the_largest_sets_that_it_can(aside: float) -> None:
    """Those of 0.5 of a person that comes towards it, which it can pass; with more place the stated ones."""
    sets = ((0.5, (0.0, 0.05)), (0.8, (0.0, 0.4)), (0.95, (0.0, 0.6)))
    error = Adjusted(Covering(0.95, (0.0, 0.5), sets), until=0.5)
    person = Tracks([(1.3, aside)], [(-0.5, 0.0)], 0.3, uncertainty=error)
    robot = Navigator(method("nao"), Disc(0.3), Limits(1.0, 2.0), period=0.1, horizon=4.0)
    found = robot.decide(State((0.0, 0.0), (1.0, 0.0)), person, Goal(Stationary((5.0, 0.0)), 0.3))
    assert found.probability == (0.5 if aside < 1.0 else 1.0)
    times = np.linspace(0.0, 4.0, 401)
    away = np.linalg.norm(found.manoeuvre.position(times) - (1.3, aside) - times[:, None] * (-0.5, 0.0), axis=1)
    kept = with_share(error, 0.5 if aside < 1.0 else 0.95).radius(times, 2)
    assert (away >= 0.6 + kept - 1e-6).all()
