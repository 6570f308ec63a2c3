"""Forecasts: what they make of motions whose future is known, what they ask for, and how methods get another one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, strategies as st
from parts import TRAJECTORIES
from strategies import dimensions, directions, numbers, vectors

import slalom
from slalom import (
    FORESIGHTS,
    METHODS,
    AcceleratingBriefly,
    AtConstantAcceleration,
    AtConstantTurn,
    AtConstantVelocity,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    Disc,
    FromPast,
    Known,
    Limits,
    Navigator,
    Obstacle,
    Present,
    Rectangle,
    Sampled,
    State,
    Stationary,
    Trajectory,
)
from slalom.base.tolerances import REST
from slalom.forecast.forecast import OBSERVING, STRAIGHT_TURN_RATE as STRAIGHT
from slalom.obstacle.window import predicted
from slalom.peers import contender

LATER = np.linspace(0.0, 30.0, 301)
"""[s] After the observation."""
ROUNDING = 1e-9

each_dimension = pytest.mark.parametrize("d", [2, 3])
each_from_past = pytest.mark.parametrize(
    "name", [name for name, forecast in FORESIGHTS.items() if isinstance(forecast, FromPast)]
)
each_observing = pytest.mark.parametrize(
    "name", [name for name, forecast in FORESIGHTS.items() if isinstance(forecast, OBSERVING)]
)


@dataclass(frozen=True, eq=False)
class Seen:
    """What can be known of a trajectory at `now`: it is there, and where it was. All else fails."""

    base: Trajectory
    now: float

    @property
    def dimension(self) -> int:
        return self.base.dimension

    @property
    def span(self) -> tuple[float, float]:
        first, _ = self.base.span
        return first, np.nan

    def _past(self, t: npt.ArrayLike) -> npt.ArrayLike:
        time = np.asarray(t, dtype=float)
        assert np.all(time <= self.now), "asks for the future"
        assert np.all(time >= self.base.span[0]), "asks for what was before it appeared"
        return t

    def position(self, t: npt.ArrayLike) -> np.ndarray:
        return self.base.position(self._past(t))

    def velocity(self, t: npt.ArrayLike) -> np.ndarray:
        assert np.all(np.asarray(t) == self.now)
        return self.base.velocity(t)


# On circles for ever.


@given(data=st.data(), d=dimensions)
def test_motion_on_a_circle_is_predicted_exactly(data: st.DataObject, d: int) -> None:
    """Either way round, of any size, in any plane, and whenever it is looked at."""
    normal = None if d == 2 else data.draw(directions(3))
    radius, speed = data.draw(numbers(0.3, 40.0)), data.draw(numbers(0.2, 10.0)) * data.draw(st.sampled_from([-1, 1]))
    assume(abs(speed) > 2.0 * STRAIGHT * radius)
    truth = Circular(data.draw(vectors(d, 20.0)), radius, speed, data.draw(numbers(0.0, 6.0)), normal)
    now = data.draw(numbers(-5.0, 50.0))
    assumed = AtConstantTurn()(truth, now)
    for what in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(assumed, what)(now + LATER), getattr(truth, what)(now + LATER), atol=1e-6)


@given(data=st.data(), d=dimensions)
def test_the_turn_is_that_of_the_acceleration_across_the_velocity(data: st.DataObject, d: int) -> None:
    """Of any motion: place and velocity now, the speed for ever, turning with |v x a| / v^2 in the plane of both."""
    v, a = data.draw(directions(d)) * data.draw(numbers(0.5, 5.0)), data.draw(vectors(d, 3.0))
    square = float(v @ v)
    across = a - v * (a @ v) / square
    assume(np.linalg.norm(across) > 0.01)
    truth, now = ConstantAcceleration(data.draw(vectors(d, 9.0)), v, a, 3.0), 3.0
    assumed = AtConstantTurn()(truth, now)
    assert isinstance(assumed, Circular)
    np.testing.assert_allclose(assumed.position(now), truth.initial_position, atol=ROUNDING)
    np.testing.assert_allclose(assumed.velocity(now), v, atol=ROUNDING)
    np.testing.assert_allclose(assumed.acceleration(now), across, atol=ROUNDING)
    speeds = assumed.velocity(now + LATER)
    np.testing.assert_allclose(np.linalg.norm(speeds, axis=1), np.sqrt(square), rtol=ROUNDING)
    # By Rodrigues: turned about v x a by the angle that has been gone.
    rate, side = np.linalg.norm(across) / np.sqrt(square), across / np.linalg.norm(across) * np.sqrt(square)
    angle = (rate * LATER)[:, None]
    np.testing.assert_allclose(speeds, np.cos(angle) * v + np.sin(angle) * side, atol=1e-8)


@given(data=st.data(), d=dimensions)
def test_straight_motion_is_predicted_straight(data: st.DataObject, d: int) -> None:
    """What it accelerates along its velocity is dropped."""
    way, position = data.draw(directions(d)), data.draw(vectors(d, 9.0))
    speed, rate, now = data.draw(numbers(0.1, 5.0)), data.draw(numbers(-2.0, 2.0)), data.draw(numbers(-5.0, 5.0))
    for truth in (
        ConstantVelocity(position, speed * way, now),
        ConstantAcceleration(position, speed * way, rate * way, now),
    ):
        positions = AtConstantTurn()(truth, now).position(now + LATER)
        np.testing.assert_allclose(positions, position + speed * LATER[:, None] * way, atol=1e-6)


@each_dimension
def test_small_turn_rates_and_rest_predict_no_turn(d: int) -> None:
    x, y = np.eye(d)[:2]
    for share, kind in ((0.99, ConstantVelocity), (1.01, Circular)):
        slowly = ConstantAcceleration(0.0 * x, 2.0 * x, share * STRAIGHT * 2.0 * y, 0.0)
        assert type(AtConstantTurn()(slowly, 0.0)) is kind
    for truth in (Stationary(3.0 * x), ConstantAcceleration(3.0 * x, 0.0 * x, y, 0.0)):
        positions = AtConstantTurn()(truth, 0.0).position(LATER)
        np.testing.assert_array_equal(positions, np.tile(3.0 * x, (len(LATER), 1)))


# From the past.


@given(data=st.data(), d=dimensions)
def test_quadratic_motion_is_foreseen_exactly_from_its_past(data: st.DataObject, d: int) -> None:
    """However long it was seen, if not too short; nothing but places of the past is asked for.

    What is slower than REST counts as at rest.
    """
    position, velocity, acceleration = (data.draw(vectors(d, bound)) for bound in (9.0, 4.0, 2.0))
    now, seconds = data.draw(numbers(-5.0, 50.0)), data.draw(numbers(0.1, 3.0))
    truth = ConstantAcceleration(position, velocity, acceleration, now - 0.3)
    begin = now - seconds * data.draw(numbers(0.25, 2.0))
    seen = Seen(_since(truth, begin), now)
    assumed = FromPast(AtConstantAcceleration(), seconds)(seen, now)
    np.testing.assert_allclose(assumed.position(now + LATER), truth.position(now + LATER), atol=2.0 * REST * LATER[-1])
    np.testing.assert_allclose(assumed.velocity(now + LATER), truth.velocity(now + LATER), atol=2.0 * REST)


@dataclass(frozen=True, eq=False)
class _since:
    """A motion that is there from `begin` on."""

    base: Trajectory
    begin: float

    @property
    def dimension(self) -> int:
        return self.base.dimension

    @property
    def span(self) -> tuple[float, float]:
        return self.begin, np.inf

    def position(self, t: npt.ArrayLike) -> np.ndarray:
        return self.base.position(t)

    def velocity(self, t: npt.ArrayLike) -> np.ndarray:
        return self.base.velocity(t)


@each_observing
@pytest.mark.parametrize("track", TRAJECTORIES)
@each_dimension
def test_what_is_seen_is_the_past(d: int, track: str, name: str) -> None:
    """Where something is now, to the bit; neither what comes nor what was before it appeared is asked for."""
    base = TRAJECTORIES[track](d)
    for now in (-0.95, 0.0, 1.7, 5.0):
        if base.span[0] <= now:
            assumed = FORESIGHTS[name](Seen(base, now), now)
            np.testing.assert_allclose(assumed.position(now), base.position(now), atol=ROUNDING)


@each_from_past
@each_dimension
def test_an_obstacle_that_has_just_appeared_is_predicted_straight(d: int, name: str) -> None:
    """Its velocity is seen, an acceleration is not."""
    truth = Circular(np.zeros(d), 3.0, 2.0)
    for since in (0.0, 0.04, 0.09):
        now = 7.0 + since
        assumed = FORESIGHTS[name](Seen(_since(truth, 7.0), now), now)
        straight = truth.position(now) + LATER[:, None] * truth.velocity(now)
        np.testing.assert_allclose(assumed.position(now + LATER), straight, atol=1e-9)


@given(data=st.data(), d=dimensions)
def test_the_parabola_is_that_of_least_squares(data: st.DataObject, d: int) -> None:
    """Through the place now; no other velocity and acceleration comes nearer to the places of the past."""
    rng = np.random.default_rng(data.draw(st.integers(0, 10**6)))
    stamps = np.arange(0.0, 4.0, 0.1)
    truth, now = Sampled(stamps, np.cumsum(rng.normal(0.0, 0.1, (len(stamps), d)), axis=0), "linear"), 3.0
    assumed = FromPast(AtConstantAcceleration(), 1.0)(truth, now)
    ago = -np.array([0.2, 0.4, 0.6, 0.8, 1.0])

    def squares(velocity: np.ndarray, acceleration: np.ndarray) -> float:
        fitted = truth.position(now) + ago[:, None] * velocity + 0.5 * ago[:, None] ** 2 * acceleration
        return float(((fitted - truth.position(now + ago)) ** 2).sum())

    velocity, acceleration = assumed.velocity(now), assumed.acceleration(now)
    np.testing.assert_allclose(
        assumed.position(now + ago),
        truth.position(now) + ago[:, None] * velocity + 0.5 * ago[:, None] ** 2 * acceleration,
        atol=ROUNDING,
    )
    least = squares(velocity, acceleration)
    for other in np.concatenate([np.eye(2 * d), -np.eye(2 * d), rng.normal(size=(20, 2 * d))]):
        assert squares(velocity + 1e-3 * other[:d], acceleration + 1e-3 * other[d:]) > least


@each_observing
@each_dimension
def test_what_comes_later_is_not_seen(d: int, name: str) -> None:
    """Two motions that part now are foreseen alike."""
    stamps = np.arange(0.0, 6.0, 0.1)
    positions = np.cumsum(np.random.default_rng(d).normal(0.0, 0.2, (len(stamps), d)), axis=0)
    others = np.where((stamps > 3.0)[:, None], -positions, positions)
    one, other = (FORESIGHTS[name](Sampled(stamps, p, "linear"), 3.0) for p in (positions, others))
    np.testing.assert_array_equal(one.position(3.0 + LATER), other.position(3.0 + LATER))


# Obstacles that forecasts include.


@pytest.mark.parametrize(
    ("forecast", "includes_future"),
    [
        (Known(), True),
        (Present(), False),
        (AtConstantVelocity(), False),
        (AtConstantAcceleration(), False),
        (AcceleratingBriefly(), False),
        (AtConstantTurn(), False),
        (FromPast(AtConstantTurn()), False),
    ],
    ids=lambda x: type(x).__name__,
)
def test_one_forecast_includes_obstacles_that_appear_later(forecast: slalom.Forecast, includes_future: bool) -> None:
    assert forecast.includes_future is includes_future
    here = Obstacle(Disc(1.0), Sampled([0.0, 9.0], [(5.0, 0.0), (6.0, 1.0)]), "here")
    later = Obstacle(Disc(1.0), Sampled([2.0, 9.0], [(7.0, 0.0), (6.0, 1.0)]), "later")
    method = replace(METHODS["nao"], forecast=forecast)
    robot = Navigator(method, Disc(0.5), Limits(2.0, 1.0))
    for now, expected in ((1.0, ["here", "later"] if includes_future else ["here"]), (2.0, ["here", "later"])):
        seen = robot.predict([here, later], State((0.0, 0.0), (1.0, 0.0)), now)
        assert [o.name for o in seen.obstacles] == expected


@each_dimension
def test_futures_of_present_obstacles_are_their_own(d: int) -> None:
    for track in TRAJECTORIES.values():
        obstacle = Obstacle(slalom.model.shape.round_shape(1.0, d), track(d), after_end="leaves")
        for forecast in (Known(), Present()):
            assert forecast(obstacle.trajectory, 1.0) is obstacle.trajectory
            assert predicted(obstacle, forecast, 1.0) is obstacle


@each_observing
def test_a_car_that_waits_is_seen_at_rest(name: str) -> None:
    """Its places differ by their rounding, which is no motion and has no direction: it faces where it stopped."""
    positions = [(0.7, 0.1), *[(2.7, 3.3)] * 5]
    car = Obstacle(Rectangle(4.0, 2.0), Sampled([0, 1, 2, 3, 4, 9], positions), "car", "motion")
    for now in np.linspace(3.1, 8.9, 40):
        waits = predicted(car, FORESIGHTS[name], float(now))
        assert not np.any(waits.trajectory.velocity(now + LATER))
        facing = np.tile(car.direction(float(now)), (len(LATER), 1))
        np.testing.assert_allclose(waits.direction(now + LATER), facing, atol=1e-12)
        np.testing.assert_allclose(waits.trajectory.position(now + LATER), np.tile(positions[-1], (len(LATER), 1)))


# Methods that see more or less.


@pytest.mark.parametrize("make", [slalom.method, contender])
@pytest.mark.parametrize("foresight", FORESIGHTS)
@pytest.mark.parametrize("name", METHODS)
def test_any_method_with_any_foresight(name: str, foresight: str, make: Callable[[str], slalom.Method]) -> None:
    plain, seeing = make(name), make(f"{name}@{foresight}")
    assert plain is METHODS[name]
    assert seeing.name == f"{name}@{foresight}"
    assert seeing.forecast is FORESIGHTS[foresight]
    assert seeing.foresight == foresight.partition("_")[0]
    assert replace(seeing, name=plain.name, forecast=plain.forecast) == plain
    assert seeing.with_foresight("present").name == f"{name}@present"


def test_methods_know_what_they_always_knew() -> None:
    """The foresight that is stated for a method is that of its forecast."""
    stated = {name: method.foresight for name, method in METHODS.items()}
    assert stated == {name: "recorded" if isinstance(m.forecast, Known) else "observed" for name, m in METHODS.items()}
    assert {"nao", "nao_ahead", "nlvo"} <= {name for name, foresight in stated.items() if foresight == "recorded"}
