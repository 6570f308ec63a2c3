"""Tracks of measurements whose ids are exchanged, new or missing, and of false detections."""

from itertools import permutations
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from slalom import (
    Calibration,
    ConstantVelocityFilter,
    Disc,
    Goal,
    KalmanError,
    Limits,
    MissingExtra,
    Navigator,
    State,
    Stationary,
    Tracker,
    Tracks,
    method,
)
from slalom.perception.association import CANDIDATES, GATE, least_sum

NOISE = 0.05


class Counting(ConstantVelocityFilter):
    """A filter that counts the pairs whose distances it computes."""

    compared: ClassVar[list[None]] = []

    def distance(self, belief: Any, seen: Any) -> float:
        self.compared.append(None)
        return super().distance(belief, seen)


def tracker() -> Tracker:
    """A tracker of people that are measured with 5 cm of noise."""
    return Tracker(Disc(0.3), ConstantVelocityFilter(position=NOISE))


def abreast(people: int, seed: int, duration: float = 4.0) -> list[tuple[float, int, np.ndarray]]:
    """Measurements (t, person, position) at 12 Hz of people that walk side by side at 1 m/s, 0.8 m apart."""
    rng = np.random.default_rng(seed)
    return [
        (k / 12, i, np.array((k / 12, 0.8 * i)) + rng.normal(0.0, NOISE, 2))
        for k in range(round(12 * duration))
        for i in range(people)
    ]


def followed(tracker: Tracker, measured: list[tuple], now: float) -> Tracks:
    """The tracks after some measurements."""
    for one in measured:
        assert tracker.update(*one)
    (tracks,) = tracker.at(now)
    assert isinstance(tracks, Tracks)
    return tracks


def exchanged(person: int, t: float) -> int:
    """The id that a perception gives the first two persons from 2 s on: that of the other one."""
    return 1 - person if t >= 2.0 and person < 2 else person


@pytest.mark.parametrize("apart", [0.0, 0.01], ids=["one time", "a time for each"])
@pytest.mark.parametrize(
    "id_at",
    [exchanged, lambda person, t: person + 10 * (t >= 2.0), lambda person, t: (person + 1) % 3 if t >= 2.0 else person],
    ids=["exchanged", "new", "in turn"],
)
def test_other_ids_change_no_track(id_at, apart: float) -> None:
    """At all times the tracks are those of the true ids, to the bit: no velocity comes from an exchange."""
    measured = [(t + apart * person, person, place) for t, person, place in abreast(3, seed=4)]
    right, wrong = tracker(), tracker()
    for now in np.arange(1.9, 3.9, 0.1):
        new = [one for one in measured if now - 0.1 <= one[0] < now]
        if now < 1.95:
            new = [one for one in measured if one[0] < now]
        true = followed(right, new, now)
        found = followed(wrong, [(t, id_at(person, t), place) for t, person, place in new], now)
        assert found.states.tobytes() == true.states.tobytes()
        assert found.ids == true.ids
        assert np.abs(found.velocities - (1.0, 0.0)).max() < 0.35


def test_tracks_without_ids_are_those_with_ids() -> None:
    """To the bit, in any order of arrival, of people that cross each other's ways at different times."""
    rng, places = np.random.default_rng(8), np.array([(0.0, 0.0), (4.0, 4.0), (-3.0, 1.0), (9.0, -2.0)])
    velocities = np.array([(1.0, 0.0), (0.0, -1.0), (0.5, 0.5), (-1.2, 0.3)])
    measured = [
        (0.1 * k, i, places[i] + 0.1 * k * velocities[i] + rng.normal(0.0, NOISE, 2))
        for k in range(30)
        for i in range(4)
        if rng.random() > 0.2
    ]
    with_ids = followed(tracker(), measured, 3.0)
    for order in range(3):
        mixed = [measured[k] for k in np.random.default_rng(order).permutation(len(measured))]
        found = followed(tracker(), [(t, None, place) for t, _, place in mixed], 3.0)
        assert set(found.ids) == {"track 1", "track 2", "track 3", "track 4"}
        assert found.states[np.argsort(found.positions[:, 0])].tobytes() == (
            with_ids.states[np.argsort(with_ids.positions[:, 0])].tobytes()
        )


@pytest.mark.parametrize("seed", range(5))
def test_any_order_gives_the_same_bits_with_wrong_ids(seed: int) -> None:
    """Also with missing ids, jumps and false detections, and calls of `at` in between."""
    rng, measured = np.random.default_rng(seed), []
    for t, person, place in abreast(3, seed):
        id = rng.choice([person, (person + 1) % 3, 7, -1])
        jump = rng.normal(0.0, 2.0, 2) if rng.random() < 0.1 else 0.0
        measured.append((t, None if id < 0 else int(id), place + jump))
    found = []
    for order in range(3):
        one = Tracker(filter=ConstantVelocityFilter(position=NOISE), max_age=2.0)
        # Each measurement comes up to a second late.
        late = [t + np.random.default_rng([order, k]).uniform(0.0, 1.0) for k, (t, _, _) in enumerate(measured)]
        arrivals = sorted(zip(late, range(len(measured))))
        for now in np.arange(0.0, 5.1, (0.1, 0.25, 0.5)[order]):
            while arrivals and arrivals[0][0] <= now:
                assert one.update(*measured[arrivals.pop(0)[1]])
            one.at(now)
        assert not arrivals
        (tracks,) = one.at(5.1)
        found.append((tracks.states.tobytes(), tracks.ids, tracks.uncertainties))
    assert found[0] == found[1] == found[2]


def test_a_jump_is_no_velocity() -> None:
    """One position 1.5 m away changes nothing; from the second one there on the track is there, at its velocity."""
    measured = abreast(1, seed=2)
    aside = np.array((0.0, 1.5))
    jumped = [(t, i, place + aside if t == 3.0 else place) for t, i, place in measured]
    before, after = tracker(), tracker()
    for k, (t, i, place) in enumerate(measured):
        before.update(t, i, place)
        after.update(*jumped[k])
        if t < 3.0:
            continue
        main = dict(zip(after.at(t)[0].ids, after.at(t)[0].velocities))[0]
        assert np.abs(main - before.at(t)[0].velocities[0]).max() < 0.1
    there = tracker()
    for t, i, place in measured:
        there.update(t, i, place + aside * (t >= 3.0))
    (tracks,) = there.at(measured[-1][0])
    assert np.abs(tracks.velocities - (1.0, 0.0)).max() < 0.35
    np.testing.assert_allclose(tracks.positions[0], measured[-1][2] + aside, atol=0.15)


def test_a_detection_counts_for_a_while_until_a_second_one_confirms_it() -> None:
    once, twice = Tracker(confirmation=0.3), Tracker(confirmation=0.3)
    for one in (once, twice):
        one.update(0.0, "a", (3.0, 0.0))
    twice.update(0.1, "a", (3.05, 0.0))
    assert [len(once.at(now)) for now in (0.0, 0.3, 0.31)] == [1, 1, 0]
    assert [len(twice.at(now)) for now in (0.1, 0.6, 1.09, 1.11)] == [1, 1, 1, 0]
    # One that is measured twice a second counts from the second measurement on.
    once.update(0.5, "a", (3.1, 0.0))
    assert len(once.at(0.9)) == 1


def test_a_false_detection_does_not_stop_the_robot() -> None:
    """It is 0.75 m ahead of a robot at 1 m/s, which brakes by 1.5 m/s^2 for the time in which it may be true."""
    goal, robot = Goal(Stationary((10.0, 0.0)), 0.2), Navigator(method("nao"), Disc(0.3), Limits(1.0, 1.5), horizon=3.0)
    seen, state, decision, slowest = tracker(), State((0.0, 0.0), (1.0, 0.0)), None, 1.0
    for k in range(20):
        if k == 2:
            seen.update(0.2, "ghost", state.position + np.array((0.75, 0.0)))
        decision = robot.decide(state, seen.at(0.1 * k), goal, now=0.1 * k, previous=decision)
        state = decision.manoeuvre.advance(0.1 * (k + 1) - decision.manoeuvre.start)
        slowest = min(slowest, float(np.linalg.norm(state.velocity)))
    assert slowest > 1.0 - 1.5 * 0.45
    assert np.linalg.norm(state.velocity) > 0.99


def test_an_id_is_right_until_a_velocity_is_known() -> None:
    """A car at 12 m/s, measured without velocity, is one track from the start."""
    car = Tracker(Disc(1.0), ConstantVelocityFilter(position=NOISE, first_velocity=1.0))
    for k in range(30):
        car.update(0.1 * k, "car", (1.2 * k, 0.0))
        (tracks,) = car.at(0.1 * k)
        assert tracks.ids == ("car",)
    np.testing.assert_allclose(tracks.velocities, [(12.0, 0.0)], atol=0.1)


def test_two_sensors_measure_one_obstacle_at_one_time() -> None:
    one = tracker()
    for k in range(10):
        one.update(0.1 * k, "a", (0.1 * k, 0.02))
        one.update(0.1 * k, "a", (0.1 * k, -0.02))
    (tracks,) = one.at(0.9)
    assert tracks.ids == ("a",)
    np.testing.assert_allclose(tracks.positions, [(0.9, 0.0)], atol=0.03)


def test_a_precise_measurement_has_a_narrow_gate() -> None:
    """The covariance of a measurement decides whether it is of the track 0.5 m beside it."""
    for spread, ids in ((0.01, {"a", "b"}), (0.2, {"a"})):
        one = tracker()
        for k in range(11):
            one.update(0.1 * k, "a", (0.0, 0.0))
        one.update(1.1, "b", (0.0, 0.5), covariance=spread**2 * np.eye(2))
        assert set(one.at(1.1)[0].ids) == ids


def test_names_are_different() -> None:
    """Where an id jumps, the new track has a number, until the old one is gone."""
    one = tracker()
    for k in range(10):
        one.update(0.1 * k, 5, (0.0, 0.0))
    one.update(1.0, 5, (4.0, 0.0))
    assert one.at(1.0)[0].ids == (5, "5 (2)")
    assert one.ids == (5, "5 (2)")
    one.update(1.1, 5, (4.0, 0.0))
    assert one.at(1.1)[0].ids == ("5 (2)",)


@settings(max_examples=30, deadline=None)
@given(
    st.integers(1, 4).flatmap(
        lambda n: st.lists(st.lists(st.floats(0.0, 9.0), min_size=n, max_size=n), min_size=1, max_size=4)
    )
)
def test_pairs_have_the_least_sum(rows: list[list[float]]) -> None:
    """Of all assignments, by trying each."""
    distances = np.array(rows)
    cost = np.minimum(distances, GATE) ** 2
    inside = [(float(distances[row, column]), int(row), int(column)) for row, column in np.argwhere(distances <= GATE)]
    found = least_sum(inside)
    assert all(distances[row, column] <= GATE for row, column in found.items())
    tall = cost if cost.shape[0] <= cost.shape[1] else cost.T
    least = min(sum(tall[i, k] for i, k in enumerate(p)) for p in permutations(range(tall.shape[1]), tall.shape[0]))
    rest = min(cost.shape) - len(found)
    assert sum(cost[row, column] for row, column in found.items()) + rest * GATE**2 == pytest.approx(least)


@pytest.mark.parametrize("id_at", [lambda k, i: None, lambda k, i: (k // 2, i)], ids=["no ids", "new ids"])
def test_each_of_many_measurements_is_compared_with_few_tracks(id_at) -> None:
    """Of a grid of people 1 m apart, measured without ids or with new ones later; not of people at one place."""
    one, crowd = tracker(), tracker()
    compared, rng = [], np.random.default_rng(3)
    places = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0)), axis=-1).reshape(-1, 2)
    one.filter = Counting(position=NOISE)
    one.filter.compared.clear()
    for k in range(4):
        for i, place in enumerate(places):
            one.update(0.1 * k, id_at(k, i), place + rng.normal(0.0, NOISE, 2))
        (tracks,) = one.at(0.1 * k)
        compared.append(len(one.filter.compared))
    assert len(tracks) == len(places)
    assert compared[-1] <= 4 * len(places) * (CANDIDATES[2] + 1)
    assert one.crowded == 0
    for k in range(2):
        for _ in range(20):
            crowd.update(0.1 * k, None, 1e-3 * rng.normal(size=2))
    crowd.at(0.1)
    assert crowd.crowded == 20


def test_detections_without_ids_need_an_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "scipy", None)
    with pytest.raises(MissingExtra, match=r"Tracker.update: a measurement without an id: expected .*slalom\[tracks\]"):
        tracker().update(0.0, None, (0.0, 0.0))
    assert tracker().update(0.0, "a", (0.0, 0.0))


# Radii that hold what they state.


def test_tracks_that_state_a_radius_are_calibrated_beyond_it() -> None:
    """The quantile of the errors beyond the stated radius, below 0 where the tracks state too much."""
    rng, stated = np.random.default_rng(3), KalmanError(0.1, 0.2)
    plain, beyond = Calibration(0.9, (0.25,)), Calibration(0.9, (0.25,))
    assert beyond.calibrated((stated,), (0.0,)) == (stated,)
    velocity, place = rng.normal(size=(20, 2)), rng.normal(size=(20, 2))
    for k in range(200):
        plain.observe(Tracks(place, velocity, 0.3, 0.25 * k))
        beyond.observe(Tracks(place, velocity, 0.3, 0.25 * k, uncertainty=stated))
        velocity = velocity + 0.1 * rng.normal(size=(20, 2))
        place = place + 0.25 * velocity
    radius = float(stated.radius(0.25, 2))
    assert beyond.radii()[0] < 0.0
    assert beyond.radii()[0] + radius == pytest.approx(plain.radii()[0])
    assert beyond.coverage[0].measured == pytest.approx(0.9, abs=0.02)
    (error,) = beyond.calibrated((stated,), (0.0,))
    assert error.radius(0.25, 2) >= plain.radii()[0] - 1e-9
    assert error.radius(0.0, 2) == pytest.approx(stated.radius(0.0, 2))


@pytest.mark.parametrize("calibrated", [True, False])
def test_the_radius_holds_people_that_stop(calibrated: bool) -> None:
    """Eight people stop for 2 s every 4 s: 0.95 within 0.06 from 10 s on; below 0.75 with the radii of the filter."""
    rng, leads, step = np.random.default_rng(12), np.array([0.5, 1.0, 2.0]), 0.1
    starts, phases = rng.uniform(-9.0, 9.0, (8, 2)), rng.uniform(0.0, 6.0, 8)
    angles = rng.uniform(-np.pi, np.pi, 8)
    going = ((step * np.arange(290)[:, None] + phases) % 6.0) < 4.0
    walked = step * np.cumsum(going, axis=0)
    places = starts + walked[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    motion = ConstantVelocityFilter(position=NOISE)
    one = Tracker(filter=motion, growth=np.inf)
    if not calibrated:
        one = Tracker(filter=motion, calibration=None, growth=np.inf)
    held = []
    for k in range(265):
        for id in range(8):
            one.update(step * k, id, places[k, id] + rng.normal(0.0, NOISE, 2))
        (tracks,) = one.at(step * k)
        assert tracks.ids == tuple(range(8))
        if k >= 100:
            ahead = tracks.positions[:, None] + leads[:, None] * tracks.velocities[:, None]
            true = places[k + np.rint(leads / step).astype(int)].swapaxes(0, 1)
            radii = np.array([error.radius(leads, 2) for error in tracks.uncertainties])
            held.append(np.linalg.norm(ahead - true, axis=2) <= radii)
    shares = np.mean(np.concatenate(held), axis=0)
    if calibrated:
        np.testing.assert_allclose(shares, 0.95, atol=0.06)
    else:
        assert shares.max() < 0.75
