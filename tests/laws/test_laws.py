"""Laws that every part obeys, over all parts enrolled in `parts.py`.

Distances in metres. "Away from the boundary" means a clearance of more than BOUNDARY from 0, since cubic pieces stand
for curves to INTERPOLATION.
"""

from dataclasses import fields, replace
from functools import cache
from itertools import pairwise
from random import Random

import mpmath
import numpy as np
import pytest
from definitions import out_of_bound
from draws import draws_of
from hulls import Pair, turned
from hypothesis import assume, given, strategies as st
from parts import (
    ENROLLED_METHODS,
    FORECASTS,
    LIMITS,
    MANOEUVRES,
    PERIOD,
    RESPONSES,
    SHAPES,
    TRAJECTORIES,
    Moved,
    disc_or_ball,
    mapped,
    served,
)
from strategies import (
    KINDS,
    Scene,
    controls,
    dimensions,
    directions,
    numbers,
    scenes,
    states,
    trajectories,
    turns,
    vectors,
)

import slalom
from slalom import (
    METHODS,
    AccelerateThenCoast,
    AccelerateThenStop,
    Acceleration,
    Aim,
    AtConstantAcceleration,
    AtConstantVelocity,
    ControlObstacle,
    Disc,
    Headings,
    Jerk,
    LaggedVelocity,
    LeastSpeed,
    Limits,
    Manoeuvre,
    Obstacle,
    ObstacleWindow,
    OutsideSpan,
    Response,
    Sampled,
    State,
    Status,
    Trajectory,
    Velocity,
    admissible_ball,
    advance,
    control_obstacle,
    preferred_control,
    select,
    select_clearest,
)
from slalom.base.tolerances import ADMISSIBLE, CERTIFIED, CLEARANCE, CONTACT, INTERPOLATION, TIME
from slalom.model.path import hermite
from slalom.model.trajectory.kinds import positions_of

BOUNDARY = 5e-6
"""[m] Nearer to contact than this, laws that ask yes or no are not asked."""

SLACK = 1e-5
"""[m] A margin larger or smaller by this brackets what tolerances may change in a choice."""

ROUNDING = 1e-9

FIRST = ("velocity", "stop", "jerk")
each_response = pytest.mark.parametrize("response", RESPONSES.values(), ids=RESPONSES)
drawn_response = pytest.mark.parametrize("response", draws_of(RESPONSES, *FIRST))
"""For laws of everything but the response: a velocity, an acceleration with braking, a motion that is not cubic."""
each_limits = pytest.mark.parametrize("limits", LIMITS.values(), ids=LIMITS)
drawn_limits = pytest.mark.parametrize("limits", draws_of(LIMITS, "walker", "one_way", "bounds_vehicle"))
each_track = pytest.mark.parametrize("track", (TRAJECTORIES | MANOEUVRES).values(), ids=TRAJECTORIES | MANOEUVRES)
each_dimension = pytest.mark.parametrize("d", [2, 3])


# Enrolment


@each_dimension
def test_enrolled_parts_fit_their_protocols(d: int) -> None:
    """Protocols are checked by name here and by law below."""
    assert all(isinstance(response, Response) for response in RESPONSES.values())
    for track in (TRAJECTORIES | MANOEUVRES).values():
        assert isinstance(track(d), Trajectory)
        assert track(d).dimension == d
    assert all(isinstance(forecast, slalom.Forecast) for forecast in FORECASTS.values())
    for name in served(d):
        shape = SHAPES[name](0.5, d)
        assert isinstance(shape, slalom.Shape)
        assert shape.dimension == d


GAUSS_PLACES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


def integrals(function, cuts: np.ndarray) -> np.ndarray:
    """Integral of `function` over each interval between the cuts, exact for polynomials of degree 15."""
    half, middle = 0.5 * np.diff(cuts), 0.5 * (cuts[1:] + cuts[:-1])
    values = function(middle[:, None] + half[:, None] * GAUSS_PLACES)
    return np.einsum("ij...,j->i...", values, GAUSS_WEIGHTS) * half.reshape(-1, *[1] * (values.ndim - 2))


def refined(cuts: np.ndarray, longest: float = 0.2) -> np.ndarray:
    """The same cuts and more, none farther apart than `longest`."""
    fine = [np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1)[:-1] for a, b in pairwise(cuts)]
    return np.concatenate([*fine, cuts[-1:]])


@each_response
@given(data=st.data())
def test_each_rate_of_a_response_is_a_derivative(response: Response, data: st.DataObject) -> None:
    """Position changes by the integral of velocity, velocity by that of acceleration, for drift and for gain."""
    state = data.draw(states(data.draw(dimensions)))
    cuts = refined(response.knots(6.0, 10.0))
    pairs = [(response.position, response.velocity)]
    if response != Velocity():  # its velocity jumps at 0: there is no acceleration to integrate
        pairs.append((response.velocity, response.acceleration))
    for map_of, rate_of in pairs:
        for part in ("drift", "gain"):
            change = np.diff(getattr(map_of(state, cuts), part), axis=0)
            summed = integrals(lambda t, f=rate_of, p=part: getattr(f(state, t), p), cuts)
            np.testing.assert_allclose(summed, change, rtol=0, atol=1e-10)


@each_response
def test_acceleration_at_a_knot_is_the_one_that_follows(response: Response) -> None:
    state = State([0.0, 0.0], [1.0, -2.0], [0.3, 0.1])
    knots = response.knots(3.05, 10.0)[:-1]
    here, after = response.acceleration(state, knots), response.acceleration(state, knots + 1e-8)
    np.testing.assert_allclose(here.gain, after.gain, atol=1e-6)
    np.testing.assert_allclose(here.drift, after.drift, atol=1e-6)


@each_response
@given(data=st.data())
def test_response_begins_at_the_state(response: Response, data: st.DataObject) -> None:
    """At t = 0 every control is at the present position; velocity too, where it does not jump."""
    state = data.draw(states(data.draw(dimensions)))
    u = data.draw(controls(state.dimension))
    np.testing.assert_array_equal(response.position(state, 0.0)(u), state.position)
    if response != Velocity():
        np.testing.assert_array_equal(response.velocity(state, 0.0)(u), state.velocity)


@each_response
def test_gain_increases_strictly_from_zero(response: Response) -> None:
    state = State([0.0, 0.0], [1.0, 0.0])
    times = np.concatenate([[0.0], np.geomspace(1e-5, 10.0, 500)])
    gain = response.position(state, times).gain
    assert gain[0] == 0.0
    assert np.all(np.diff(gain) >= 0.0)
    # Up to rest, for the responses that come to rest.
    moving = times[1:] <= getattr(response, "hold", np.inf) + getattr(response, "brake", np.inf)
    assert np.all(np.diff(gain)[moving] > 0.0)


@each_response
def test_maps_have_the_shape_of_the_times(response: Response) -> None:
    state = State([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    for map_of in (response.position, response.velocity, response.acceleration):
        for shape in ((), (4,), (2, 3)):
            image = map_of(state, np.full(shape, 0.3))
            assert image.drift.shape == (*shape, 3)
            assert image.gain.shape == shape


@each_response
@given(data=st.data())
def test_position_map_is_cubic_between_knots(response: Response, data: st.DataObject) -> None:
    """Cubic Hermite pieces on the knots are within INTERPOLATION, up to the stated reach."""
    state = data.draw(states(data.draw(dimensions)))
    u = data.draw(controls(state.dimension))
    horizon = data.draw(numbers(0.05, 8.0))
    reach = float(np.linalg.norm(state.velocity) + np.linalg.norm(u)) + 1e-3
    knots = response.knots(horizon, reach)
    assert knots[0] == 0.0
    assert knots[-1] == horizon
    assert np.all(np.diff(knots) > 0.0)
    path = hermite(knots, response.position(state, knots)(u), response.velocity(state, knots)(u))
    if response == Velocity():
        path = hermite(knots, response.position(state, knots)(u), np.broadcast_to(u, (len(knots), len(u))))
    assert np.abs(along(path) - response.position(state, along_times(path))(u)).max() <= INTERPOLATION + ROUNDING


PLACES = np.linspace(0.0, 1.0, 21)
BERNSTEIN = np.stack([(1 - PLACES) ** 3, 3 * PLACES * (1 - PLACES) ** 2, 3 * PLACES**2 * (1 - PLACES), PLACES**3])


def along(path) -> np.ndarray:
    """Points of a path at 21 places of each piece, (n, 21, d)."""
    return np.einsum("kjd,js->ksd", path.points, BERNSTEIN)


def along_times(path) -> np.ndarray:
    """The times of these points, (n, 21)."""
    return path.times[:-1, None] + np.diff(path.times)[:, None] * PLACES


@pytest.mark.parametrize("name", [name for name, response in RESPONSES.items() if response.restartable])
@given(data=st.data())
def test_advancing_twice_is_advancing_once(name: str, data: st.DataObject) -> None:
    """Semigroup: holding u from a later state of the motion continues the motion, for restartable responses."""
    response = RESPONSES[name]
    state = data.draw(states(data.draw(dimensions)))
    u, first, second = data.draw(controls(state.dimension)), data.draw(numbers(0.0, 3.0)), data.draw(numbers(0.0, 3.0))
    twice = advance(response, advance(response, state, u, first), u, second)
    once = advance(response, state, u, first + second)
    for part in ("position", "velocity") if response == Velocity() else ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(twice, part), getattr(once, part), atol=1e-11)


def test_restartable_is_stated_where_it_holds() -> None:
    """A response that claims not to be restartable indeed is not."""
    state, u = State([0.0, 0.0], [1.0, 0.0]), np.array([0.5, 1.0])
    for response in RESPONSES.values():
        twice = advance(response, advance(response, state, u, 0.05), u, 4.0)
        same = np.allclose(twice.position, advance(response, state, u, 4.05).position, atol=1e-9)
        assert same == response.restartable, response


@given(t=st.floats(1e-9, 1.0), lag=st.floats(0.01, 10.0))
def test_lagged_velocity_is_accurate_for_small_times(t: float, lag: float) -> None:
    """The gain t - lag (1 - exp(-t / lag)) loses no digits where it is a small difference of large numbers."""
    with mpmath.workdps(60):
        x = mpmath.mpf(t) / mpmath.mpf(lag)
        exact = mpmath.mpf(t) - mpmath.mpf(lag) * (1 - mpmath.exp(-x))
        spent = mpmath.mpf(lag) * (1 - mpmath.exp(-x))
        image = LaggedVelocity(lag).position(State([0.0, 0.0], [1.0, 0.0]), t)
        assert abs(mpmath.mpf(float(image.gain)) / exact - 1) < 1e-12
        assert abs(mpmath.mpf(float(image.drift[0])) / spent - 1) < 1e-14


@each_response
@given(data=st.data())
def test_simulated_steps_follow_the_prediction(response: Response, data: st.DataObject) -> None:
    """A robot driven by the mean acceleration of each period is where the manoeuvre says.

    To rounding where the acceleration is constant over periods. Otherwise velocities still agree and positions
    differ by the trapezium rule's error: |u - v| period^2 / (12 lag) for a lag, |u| t period^2 / 12 for a jerk.
    """
    if isinstance(response, Velocity):
        response = Velocity(ramp=PERIOD)
    state = data.draw(states(data.draw(dimensions)))
    manoeuvre = Manoeuvre(response, state, data.draw(controls(state.dimension)), data.draw(numbers(-1.0, 3.0)))
    position, velocity = state.position, state.velocity
    for k in range(60):
        acceleration = manoeuvre.mean_acceleration(manoeuvre.start + k * PERIOD, PERIOD)
        position = position + PERIOD * velocity + 0.5 * PERIOD**2 * acceleration
        velocity = velocity + PERIOD * acceleration
        now = manoeuvre.start + (k + 1) * PERIOD
        allowed = 0.0
        if isinstance(response, LaggedVelocity):
            allowed = np.linalg.norm(manoeuvre.control - state.velocity) * PERIOD**2 / (12 * response.lag)
        if isinstance(response, Jerk):
            allowed = np.linalg.norm(manoeuvre.control) * (now - manoeuvre.start) * PERIOD**2 / 12
        assert np.linalg.norm(position - manoeuvre.position(now)) <= allowed + 1e-10
        np.testing.assert_allclose(velocity, manoeuvre.velocity(now), atol=1e-10)


@drawn_response
@given(data=st.data())
def test_continuation_is_the_rest_of_the_manoeuvre(response: Response, data: st.DataObject) -> None:
    """Whatever the control, the clearance of a continuation is that of the manoeuvre from then on."""
    scene = data.draw(scenes(apart=None))
    manoeuvre = Manoeuvre(response, scene.state, scene.controls[0], scene.start)
    later = scene.start + 0.37
    reached = State(manoeuvre.position(later), manoeuvre.velocity(later))
    rest = replace(scene, state=reached, start=later).blocked(manoeuvre.continuation(reached, later))
    expected = brute_clearance(rest, np.zeros(scene.dimension))
    assert rest.clearance(scene.controls[1]) == pytest.approx(expected, abs=CERTIFIED + ROUNDING)


WINDOWS = ((-0.87, 6.9), (0.1, 0.4), (0.5, 1.0), (2.0, 5.3))
"""[s] From and to; the third begins and ends with a stamp of the sampled trajectories."""


@each_dimension
@each_track
def test_each_rate_of_a_trajectory_is_a_derivative(track, d: int) -> None:
    """Position changes by the integral of velocity everywhere, velocity by that of acceleration between jumps."""
    track, start, end = track(d), -0.9, 6.9
    cuts = refined(np.concatenate([[start], track.breaks(start, end), [end]]))
    np.testing.assert_allclose(integrals(track.velocity, cuts), np.diff(track.position(cuts), axis=0), atol=1e-9)
    inner = cuts[:-1] + 1e-9, cuts[1:] - 1e-9
    change = track.velocity(inner[1]) - track.velocity(inner[0])
    np.testing.assert_allclose(integrals(track.acceleration, cuts), change, atol=1e-6)


@each_dimension
@each_track
def test_bounds_of_a_trajectory_hold(track, d: int) -> None:
    track = track(d)
    for start, end in WINDOWS:
        times = np.linspace(start, end, 2001)[:-1]  # at the end there may be a jump
        assert np.linalg.norm(track.velocity(times), axis=-1).max() <= track.speed_bound(start, end) + ROUNDING
        bound = track.acceleration_bound(start, end)
        assert np.linalg.norm(track.acceleration(times), axis=-1).max() <= bound + ROUNDING
        breaks = track.breaks(start, end)
        assert np.all((breaks > start) & (breaks < end))
        assert np.all(np.diff(breaks) > 0.0)


@each_dimension
@each_track
def test_path_stays_within_its_error(track, d: int) -> None:
    """Pieces cover the window without holes, and the curve lies within the stated error of them."""
    track = track(d)
    for start, end in WINDOWS:
        path = track.path(start, end)
        assert path.times[0] == start
        assert path.times[-1] == end
        assert np.all(np.diff(path.times) > 0.0)
        assert np.all(path.error <= getattr(track, "tolerance", INTERPOLATION * getattr(track, "length", 1.0)))
        np.testing.assert_allclose(path.points[1:, 0], path.points[:-1, 3], atol=1e-12)
        off = np.linalg.norm(along(path) - track.position(along_times(path)), axis=-1).max(axis=1)
        assert np.all(off <= path.error + ROUNDING)


@each_dimension
@each_track
def test_trajectory_has_the_shape_of_the_times(track, d: int) -> None:
    track = track(d)
    for shape in ((), (4,), (2, 3)):
        for function in (track.position, track.velocity, track.acceleration):
            assert function(np.full(shape, 0.3)).shape == (*shape, d)


@given(
    dimensions.flatmap(lambda d: st.lists(trajectories(d), min_size=1, max_size=5)), st.randoms(use_true_random=False)
)
def test_positions_of_several_tracks_are_those_of_each(tracks: list[Trajectory], rng: Random) -> None:
    """To the bit."""
    spans = [np.clip(track.span, -50.0, 50.0) for track in tracks]
    times = np.array([[rng.uniform(*span) for _ in range(6)] for span in spans])
    expected = [track.position(own) for track, own in zip(tracks, times, strict=True)]
    np.testing.assert_array_equal(positions_of(tracks, times), expected)


def test_sampled_raises_outside_its_span() -> None:
    track = TRAJECTORIES["sampled_smooth"](2)
    for t in (track.span[0] - 1e-6, track.span[1] + 1e-6):
        with pytest.raises(OutsideSpan):
            track.position(t)


@given(data=st.data())
def test_smooth_samples_of_quadratic_motion_are_exact(data: st.DataObject) -> None:
    d = data.draw(dimensions)
    truth = data.draw(KINDS["constant_acceleration"](d))
    times = np.cumsum(data.draw(st.lists(numbers(0.1, 1.0), min_size=3, max_size=8)))
    fine = np.linspace(times[0], times[-1], 101)
    np.testing.assert_allclose(Sampled(times, truth.position(times)).position(fine), truth.position(fine), atol=1e-9)


@pytest.mark.parametrize("name", FORECASTS)
@each_dimension
def test_forecast_agrees_with_the_truth_now(name: str, d: int) -> None:
    """Position and velocity of this moment are always those observed."""
    for track in TRAJECTORIES.values():
        assumed = FORECASTS[name](track(d), 1.7)
        np.testing.assert_allclose(assumed.position(1.7), track(d).position(1.7), atol=1e-12)
        np.testing.assert_allclose(assumed.velocity(1.7), track(d).velocity(1.7), atol=1e-12)
        if name not in ("constant_velocity", "constant_turn"):
            np.testing.assert_allclose(assumed.acceleration(1.7), track(d).acceleration(1.7), atol=1e-12)


# Definition of the control obstacle, against brute force


def gaps_along(blocked: ControlObstacle, index: int, u: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Signed distance of the surfaces of robot and obstacle at elapsed times, by its parts; no kernel is used."""
    obstacle = blocked.obstacles.obstacles[index]
    track = obstacle.trajectory
    absolute = np.clip(blocked.obstacles.start + times, *track.span)  # not outside by rounding
    away = blocked.response.position(blocked.state, times)(u) - track.position(absolute)
    ahead = facing(obstacle, absolute)
    gaps = [
        Pair(index, a, b, rounding + radius, track.dimension == 2).gap(away, ahead)
        for a, rounding in obstacle.shape.parts
        for b, radius in blocked.robot.parts
    ]
    return np.min(gaps, axis=0) - blocked.margin


def facing(obstacle: Obstacle, times: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 2) along the x axis of a body in the plane."""
    if obstacle.heading == "motion":
        velocity = obstacle.trajectory.velocity(times)[:, :2]
        return velocity / np.linalg.norm(velocity, axis=1)[:, None]
    if isinstance(obstacle.heading, Headings):
        angles = np.interp(times, obstacle.heading.times, obstacle.heading.angles)
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.tile([np.cos(obstacle.heading), np.sin(obstacle.heading)], (len(times), 1))


def brute_clearance(blocked: ControlObstacle, u: np.ndarray, horizon: float | None = None) -> float:
    """Least gap over (0, horizon] by sampling, each of the lowest dips refined. Never below the truth."""
    least = np.inf
    for index, obstacle in enumerate(blocked.obstacles.obstacles):
        start = blocked.obstacles.start
        begin = max(0.0, obstacle.trajectory.span[0] - start)
        end = min(horizon or blocked.horizon, obstacle.trajectory.span[1] - start)
        if begin >= end:
            continue
        # Where a body may turn at once, just before and after it too.
        jumps = (obstacle.trajectory.breaks(start + begin, start + end) - start)[:, None] + (-1e-9, 1e-9)
        times = np.unique(np.clip(np.append(np.linspace(begin, end, 601), jumps), begin, end))
        gaps = gaps_along(blocked, index, u, times)
        # Cells that may go lowest if gaps change at most half as fast again as they were seen to: bodies with corners
        # have dips far narrower than a cell.
        for _ in range(6):
            lengths = np.diff(times)
            rates = np.abs(np.diff(gaps)) / np.maximum(lengths, 1e-12)
            ordered = np.sort(rates[lengths > 1e-6])
            if not len(ordered):  # the whole span is shorter than any dip
                break
            steepest = 1.5 * ordered[max(0, len(ordered) - 1 - len(jumps))]
            bounds = 0.5 * (gaps[1:] + gaps[:-1] - steepest * lengths)
            cells = np.argsort(bounds)[:40]
            cells = cells[(bounds[cells] < gaps.min()) & (lengths[cells] > 1e-8)]
            if not cells.size:
                break
            fine = times[cells, None] + np.linspace(0.0, 1.0, 14)[1:-1] * lengths[cells, None]
            times, order = np.unique(np.append(times, fine), return_index=True)
            gaps = np.append(gaps, gaps_along(blocked, index, u, fine.ravel()))[order]
        least = min(least, float(gaps.min()))
    return least


def telling_controls(blocked: ControlObstacle, drawn: np.ndarray) -> np.ndarray:
    """The drawn controls and others in, on the rim of and beside temporal elements, or the least balls about them."""
    found, traffic = [drawn], blocked.obstacles
    direction = (drawn[0] + 1e-3) / np.linalg.norm(drawn[0] + 1e-3)
    for share in (0.3, 0.6, 1.0):
        image, now = blocked.response.position(blocked.state, share * blocked.horizon), share * blocked.horizon
        for obstacle in traffic.obstacles:
            if obstacle.exists(traffic.start + now):
                center = obstacle.trajectory.position(traffic.start + now)
                room = obstacle.shape.bounding_radius + blocked.robot.bounding_radius + blocked.margin
                found += [image.inverse(center + r * room * direction)[None] for r in (0.0, 0.8, 1.0, 1.05)]
    every = np.concatenate(found)
    return every[np.linalg.norm(every, axis=1) < 40.0]


@drawn_response
@given(data=st.data())
def test_control_is_in_an_element_exactly_if_it_meets_the_obstacle_then(
    response: Response, data: st.DataObject
) -> None:
    """The temporal element is the inverse image of the grown obstacle: depth in it times gain is depth in the other.

    Of discs and balls, of which the elements are balls.
    """
    scene = data.draw(scenes(shaped=False))
    blocked = scene.blocked(response)
    t = data.draw(st.floats(0.05, 1.0)) * scene.horizon
    element = blocked.element(t)
    there = [i for i, obstacle in enumerate(scene.obstacles) if obstacle.exists(scene.start + t)]
    assert element.owners.tolist() == there
    gain = float(response.position(scene.state, t).gain)
    for center, radius, owner in zip(*element):
        for u in telling_controls(blocked, scene.controls):
            depth = float(np.linalg.norm(u - center)) - radius
            assert gain * depth == pytest.approx(gaps_along(blocked, owner, u, np.array([t]))[0], abs=1e-9)


@drawn_response
@given(data=st.data())
def test_clearance_is_the_least_distance(response: Response, data: st.DataObject) -> None:
    """Never above the true minimum by more than CLEARANCE, below it by at most CERTIFIED."""
    scene = data.draw(scenes())
    blocked = scene.blocked(response)
    tried = telling_controls(blocked, scene.controls)
    for u, found in zip(tried, blocked.clearance(tried)):
        truth = brute_clearance(blocked, u)
        if not np.isfinite(truth):
            assert found == truth
            continue
        # Where centres or centre lines meet, squared distances show their rounding: sqrt(1e-16) of the scene's size.
        deep = truth < -0.99 * least_rounding(blocked)
        assert found <= truth + CLEARANCE + (1e-6 if deep else ROUNDING)
        assert found >= truth - CERTIFIED - 1e-7


def least_rounding(blocked: ControlObstacle) -> float:
    """The least sum of radii of a part of an obstacle and one of the robot, and the margin."""
    of_obstacles = [part.radius for obstacle in blocked.obstacles.obstacles for part in obstacle.shape.parts]
    return min(of_obstacles) + min(part.radius for part in blocked.robot.parts) + blocked.margin


@drawn_response
@given(data=st.data())
def test_contains_clearance_and_time_to_collision_agree(response: Response, data: st.DataObject) -> None:
    """contains(u) = (clearance(u) < 0) = (time_to_collision(u) < inf), which is the first contact."""
    scene = data.draw(scenes())
    blocked = scene.blocked(response)
    tried = telling_controls(blocked, scene.controls)
    clearance, inside, times = blocked.clearance(tried), blocked.contains(tried), blocked.time_to_collision(tried)
    np.testing.assert_array_equal(inside, np.isfinite(times))
    clear = np.abs(clearance) > BOUNDARY
    np.testing.assert_array_equal(inside[clear], (clearance < 0.0)[clear])
    for u, t in zip(tried[inside], times[inside]):
        assert 0.0 < t <= scene.horizon
        owner = int(np.argmin(blocked.times_to_collision(u)))
        # The body may turn at once at the contact, and t lie before that by rounding.
        assert gaps_along(blocked, owner, u, t + np.array([0.0, 1e-9])).min() <= BOUNDARY
        assert brute_clearance(blocked, u, horizon=t - 1e-9) >= -BOUNDARY
    for index in range(len(scene.obstacles)):
        alone = scene.blocked(response, obstacles=(scene.obstacles[index],))
        np.testing.assert_allclose(blocked.clearances(tried)[:, index], alone.clearance(tried), atol=ROUNDING)


@drawn_response
@given(data=st.data())
def test_overlap_now_means_every_control_collides(response: Response, data: st.DataObject) -> None:
    scene = data.draw(scenes())
    there = [o for o in scene.obstacles if o.exists(scene.start)]
    assume(there)
    # The middle of a part on the middle of a part of the robot, up to the sum of their radii beside it.
    (a, rounding), (b, radius) = there[0].shape.parts[-1], scene.robot.parts[-1]
    middle = a.mean(axis=0)
    if scene.dimension == 2:
        middle = turned(middle[None], facing(there[0], np.array([scene.start])))[:, 0, 0]
    onto = scene.state.position + b.mean(axis=0) - middle - there[0].trajectory.position(scene.start)
    beside = data.draw(st.floats(0.0, 0.95)) * (rounding + radius + scene.margin)
    onto = onto + beside * data.draw(directions(len(onto)))
    scene = replace(scene, obstacles=(replace(there[0], trajectory=Moved(there[0].trajectory, shift=onto)),))
    blocked = scene.blocked(response)
    assert blocked.contains(scene.controls).all()
    assert len(blocked.overlapping)
    u = scene.controls[0]
    assert select(u, admissible_ball(u, 1.0), blocked).status is Status.OVERLAPPING


# Monotonicity


@drawn_response
@given(data=st.data())
def test_nothing_added_frees_a_control(response: Response, data: st.DataObject) -> None:
    """A longer horizon, a larger radius or margin, one more obstacle: clearance never grows."""
    scene = data.draw(scenes(most=2))
    blocked = scene.blocked(response)
    tried = telling_controls(blocked, scene.controls)
    before = blocked.clearance(tried)
    share, extra = data.draw(numbers(0.1, 0.9)), data.draw(numbers(0.0, 0.5))
    shorter = ControlObstacle(
        response, scene.state, blocked.obstacles, scene.robot, scene.margin, share * scene.horizon
    )
    assert np.all(shorter.clearance(tried) >= before - CERTIFIED)
    assert np.all(shorter.time_to_collision(tried) >= blocked.time_to_collision(tried) - 1e-6)
    wider = scene.blocked(response, margin=scene.margin + extra)
    assert np.all(wider.clearance(tried) <= before + ROUNDING)
    assert np.all(wider.time_to_collision(tried) <= blocked.time_to_collision(tried) + 1e-6)
    grown = tuple(replace(o, shape=mapped(o.shape, np.eye(scene.dimension), extra)) for o in scene.obstacles)
    np.testing.assert_allclose(scene.blocked(response, obstacles=grown).clearance(tried), wider.clearance(tried))
    other = Obstacle(disc_or_ball(0.5, scene.dimension), data.draw(KINDS["circular"](scene.dimension)))
    more = scene.blocked(response, obstacles=(*scene.obstacles, other))
    assert np.all(more.clearance(tried) <= before + ROUNDING)
    assert np.all(more.contains(tried) | ~blocked.contains(tried))


# Equivariance


def same_collisions(a: ControlObstacle, b: ControlObstacle, u: np.ndarray, v: np.ndarray, length=1.0, time=1.0):
    """Controls u in `a` and v in `b` have the same clearances and times, up to units of `b`."""
    tolerance = CERTIFIED * max(length, 1.0)
    of_a, of_b = a.clearance(u) * length, b.clearance(v)
    finite = np.isfinite(of_a)
    np.testing.assert_array_equal(finite, np.isfinite(of_b))
    np.testing.assert_allclose(of_a[finite], of_b[finite], atol=tolerance)
    times_a, times_b = a.time_to_collision(u) * time, b.time_to_collision(v)
    for k in np.flatnonzero(~np.isclose(times_a, times_b, atol=1e-5 * time)):
        # Allowed only where one of them grazes at the earlier time.
        later = max(times_a[k], times_b[k]) / time
        earlier = min(times_a[k], times_b[k]) / time
        assert brute_clearance(a, u[k], min(later - 1e-9, a.horizon)) * length > -10 * tolerance, (earlier, later)


def same_choice(at_margin, other, preferred: np.ndarray, length: float = 1.0) -> None:
    """`other` = (preferred, admissible, blocked) has the choice that `at_margin` has, up to SLACK of margin.

    Tolerances can tip a choice from one side of an obstacle to another that is as near; what must hold is that the
    distance lies between those for a slightly smaller and a slightly larger margin.
    """
    choice = select(*other)
    assert choice.status is not Status.UNDECIDED
    for sign in (-1, 1):
        admissible, blocked = at_margin(sign * SLACK)
        bracket = select(preferred, admissible, blocked)
        assert bracket.status is not Status.UNDECIDED
        assert sign * choice.distance <= sign * bracket.distance * length + 1e-6 * length or np.isclose(
            choice.distance, bracket.distance * length, rtol=1e-6
        )


def box(response: Response, state: State, limits: Limits, horizon: float):
    """The admissible controls of a response."""
    return limits.admissible(response, state, horizon)


def moved_heading(heading: float | str | Headings, turn: np.ndarray) -> float | str | Headings:
    """The heading of a turned or mirrored body; that along its motion turns with the motion."""
    if heading == "motion" or len(turn) == 3:
        return heading
    if isinstance(heading, Headings):
        ahead = turn @ np.stack([np.cos(heading.angles), np.sin(heading.angles)])
        return Headings(heading.times, np.arctan2(ahead[1], ahead[0]))
    x, y = turn @ (np.cos(heading), np.sin(heading))
    return float(np.arctan2(y, x))


def slowed_heading(heading: float | str | Headings, time: float) -> float | str | Headings:
    """The heading of a body in a world whose times are `time` as long."""
    return Headings(heading.times * time, heading.angles) if isinstance(heading, Headings) else heading


def moved_scene(scene: Scene, turn: np.ndarray, shift: np.ndarray) -> Scene:
    """The scene turned or mirrored by `turn`, then shifted.

    The robot's shape is given along the axes of the world: it turns. Those of obstacles in the plane are given along
    their headings, which turn; in a mirror image left and right of them change places.
    """
    s, body = scene.state, turn
    if scene.dimension == 2:
        body = np.diag([1.0, np.linalg.det(turn)])
    state = State(turn @ s.position + shift, turn @ s.velocity, turn @ s.acceleration)
    return replace(
        scene,
        state=state,
        robot=mapped(scene.robot, turn),
        obstacles=tuple(
            replace(
                o,
                shape=mapped(o.shape, body),
                trajectory=Moved(o.trajectory, turn, shift),
                heading=moved_heading(o.heading, turn),
            )
            for o in scene.obstacles
        ),
        controls=scene.controls @ turn.T,
    )


@drawn_response
@given(data=st.data())
def test_turned_mirrored_and_shifted_world_has_the_turned_answers(response: Response, data: st.DataObject) -> None:
    scene = data.draw(scenes())
    turn = data.draw(turns(scene.dimension))
    other = moved_scene(scene, turn, data.draw(vectors(scene.dimension, 20.0)))
    here, there = scene.blocked(response), other.blocked(response)
    tried = telling_controls(here, scene.controls)
    same_collisions(here, there, tried, tried @ turn.T)
    limits = Limits(4.0, 3.0)
    same_choice(
        lambda more: (
            box(response, scene.state, limits, scene.horizon),
            scene.blocked(response, margin=scene.margin + more),
        ),
        (other.controls[0], box(response, other.state, limits, scene.horizon), there),
        scene.controls[0],
    )


def in_other_units(response: Response, time: float) -> Response:
    """The same response in another unit of time; every parameter of a response is a time or a rate."""
    values = {f.name: getattr(response, f.name) for f in fields(response)}
    return replace(response, **{name: v / time if name == "rate" else v * time for name, v in values.items()})


@drawn_response
@given(data=st.data())
def test_change_of_units_changes_nothing(response: Response, data: st.DataObject) -> None:
    """Lengths in other units and times in other units: the same collisions and the same choice."""
    scene = data.draw(scenes())
    length, time = data.draw(st.sampled_from([0.1, 0.5, 3.0, 10.0])), data.draw(st.sampled_from([0.2, 0.5, 2.0, 5.0]))
    slower, s, scaling = in_other_units(response, time), scene.state, length * np.eye(scene.dimension)
    state = State(length * s.position, length / time * s.velocity, length / time**2 * s.acceleration)
    unit = length * float(response.position(s, 0.9).gain / slower.position(state, 0.9 * time).gain)
    other = Scene(
        state,
        mapped(scene.robot, scaling),
        tuple(
            replace(
                o,
                shape=mapped(o.shape, scaling),
                trajectory=Moved(o.trajectory, length=length, time=time),
                heading=slowed_heading(o.heading, time),
            )
            for o in scene.obstacles
        ),
        scene.start * time,
        scene.horizon * time,
        scene.margin * length,
        scene.controls * unit,
    )
    here, there = scene.blocked(response), other.blocked(slower)
    tried = telling_controls(here, scene.controls)
    same_collisions(here, there, tried, tried * unit, length, time)
    limits, scaled = Limits(4.0, 3.0), Limits(4.0 * length / time, 3.0 * length / time**2)
    assume(np.linalg.norm(s.velocity) <= limits.max_speed)
    same_choice(
        lambda more: (
            box(response, scene.state, limits, scene.horizon),
            scene.blocked(response, margin=scene.margin + more / min(length, 1.0)),
        ),
        (other.controls[0], box(slower, state, scaled, other.horizon), there),
        scene.controls[0],
        unit,
    )


@given(data=st.data())
def test_only_relative_velocity_matters_to_velocity_obstacles(data: st.DataObject) -> None:
    """Galilean shift: all bodies faster by the same velocity, seen from a frame that moves with it.

    Not of bodies that face along their motion: which way that is depends on the frame. They keep a heading here.
    """
    scene = data.draw(scenes())
    steady = tuple(replace(o, heading=0.3) if o.heading == "motion" else o for o in scene.obstacles)
    scene = replace(scene, obstacles=steady)
    boost = data.draw(vectors(scene.dimension, 5.0))
    other = replace(
        scene,
        obstacles=tuple(
            replace(o, trajectory=Moved(o.trajectory, boost=boost, shift=-scene.start * boost)) for o in scene.obstacles
        ),
    )
    here, there = scene.blocked(Velocity()), other.blocked(Velocity())
    tried = telling_controls(here, scene.controls)
    same_collisions(here, there, tried, tried + boost)
    center = scene.controls[1]
    same_choice(
        lambda more: (admissible_ball(center, 5.0), scene.blocked(Velocity(), margin=scene.margin + more)),
        (scene.controls[0] + boost, admissible_ball(center + boost, 5.0), there),
        scene.controls[0],
    )


# Limits of the theory: one construction holds the others


@given(data=st.data())
def test_ao_of_quadratic_motion_is_its_nao(data: st.DataObject) -> None:
    """NAO with c(t) = c + v t + a t^2 / 2 is AO: forecasting constant acceleration loses nothing."""
    scene = data.draw(scenes(shaped=False))  # the elements of which are balls
    now = scene.start
    quadratic = tuple(
        replace(o, trajectory=AtConstantAcceleration()(o.trajectory, now)) for o in scene.obstacles if o.exists(now)
    )
    assume(quadratic)
    forecast = tuple(replace(o, trajectory=AtConstantAcceleration()(o.trajectory, now)) for o in quadratic)
    nao, ao = (scene.blocked(Acceleration(), obstacles=seen) for seen in (quadratic, forecast))
    tried = telling_controls(nao, scene.controls)
    same_collisions(nao, ao, tried, tried)
    element, s = ao.element(scene.horizon), scene.state
    for center, radius, o in zip(element.centers, element.radii, quadratic):
        # AO(t) = 2 B / t^2 + (2 c / t^2 - 2 w / t) + a_B with w = v_A - v_B.
        t, track = scene.horizon, o.trajectory
        c, w = track.position(now) - s.position, s.velocity - track.velocity(now)
        np.testing.assert_allclose(center, 2 * c / t**2 - 2 * w / t + track.acceleration(now), atol=1e-8)
        total = o.shape.radius + scene.robot.radius + scene.margin
        assert radius == pytest.approx(2 * total / t**2)


@given(data=st.data())
def test_ao_contains_what_the_collision_quartic_says(data: st.DataObject) -> None:
    """(|c|^2 - R^2) s^4 - 2 (c.w) s^3 + (|w|^2 - c.u) s^2 + (w.u) s + |u|^2 / 4 = 0, first contact at t = 1 / s."""
    d = data.draw(dimensions)
    state, track = data.draw(states(d)), data.draw(KINDS["constant_acceleration"](d))
    radius = 1.3
    c = track.position(0.0) - state.position
    assume(np.linalg.norm(c) > radius + 0.01)
    w = state.velocity - track.velocity(0.0)
    blocked = control_obstacle(
        Acceleration(),
        state,
        [Obstacle(disc_or_ball(1.0, d), track, after_end="leaves")],
        disc_or_ball(0.3, d),
        horizon=6.0,
    )
    for a in telling_controls(blocked, np.array([data.draw(controls(d)) for _ in range(3)])):
        u = a - track.acceleration(0.0)
        roots = np.roots([c @ c - radius**2, -2 * c @ w, w @ w - c @ u, w @ u, u @ u / 4])
        real = roots[(np.abs(roots.imag) < 1e-7 * (1 + np.abs(roots.real))) & (roots.real > 1 / 6.0)].real
        assume(abs(float(blocked.clearance(a))) > 1e-3)
        assert bool(blocked.contains(a)) == bool(len(real))
        if len(real):
            assert float(blocked.time_to_collision(a)) == pytest.approx(1 / real.max(), rel=1e-5)


@given(data=st.data())
def test_nlvo_of_a_line_is_the_classical_cone(data: st.DataObject) -> None:
    """Apex at the obstacle's velocity, axis along c, half-angle asin(R / |c|); a horizon of 5000 s for infinity."""
    d = data.draw(dimensions)
    state, track, radius = data.draw(states(d)), data.draw(KINDS["constant_velocity"](d)), 1.3
    c = track.position(0.0) - state.position
    assume(np.linalg.norm(c) > radius + 0.1)
    obstacle = [Obstacle(disc_or_ball(1.0, d), track, after_end="leaves")]
    nlvo = control_obstacle(Velocity(), state, obstacle, disc_or_ball(0.3, d), horizon=5000.0)
    vo = replace(
        nlvo, obstacles=ObstacleWindow([replace(obstacle[0], trajectory=AtConstantVelocity()(track, 0.0))], 0, 5000.0)
    )
    half_angle, apex = np.arcsin(radius / np.linalg.norm(c)), track.initial_velocity
    axis = c / np.linalg.norm(c)
    side = data.draw(directions(d))
    side = side - (side @ axis) * axis
    assume(np.linalg.norm(side) > 0.1)
    side /= np.linalg.norm(side)
    for angle in np.append(half_angle * np.array([0.0, 0.5, 0.99, 1.01, 1.5]), [np.pi / 2, 3.0]):
        for length in (0.1, 1.0, 6.0):
            u = apex + length * (np.cos(angle) * axis + np.sin(angle) * side)
            expected = angle < half_angle
            assert bool(nlvo.contains(u)) == bool(vo.contains(u)) == expected
            if expected:
                w = u - apex
                b, e = c @ w, (w @ w) * (c @ c - radius**2)
                first = (b - np.sqrt(b * b - e)) / (w @ w)
                assert float(nlvo.time_to_collision(u)) == pytest.approx(first, abs=2 * TIME * 5000.0)


@given(data=st.data())
def test_vanishing_lag_gives_velocity(data: st.DataObject) -> None:
    scene = data.draw(scenes())
    lag = data.draw(st.sampled_from([0.003, 0.01]))
    here, there = scene.blocked(Velocity()), scene.blocked(LaggedVelocity(lag))
    tried = telling_controls(here, scene.controls)
    allowed = lag * np.linalg.norm(tried - scene.state.velocity, axis=1) + CERTIFIED
    a, b = here.clearance(tried), there.clearance(tried)
    finite = np.isfinite(a)
    assert np.all(np.abs(a[finite] - b[finite]) <= allowed[finite])
    np.testing.assert_array_equal(finite, np.isfinite(b))


@given(data=st.data())
def test_longest_hold_gives_acceleration(data: st.DataObject) -> None:
    scene = data.draw(scenes())
    plain, tried = scene.blocked(Acceleration()), scene.controls
    for response in (AccelerateThenCoast(scene.horizon), AccelerateThenStop(scene.horizon, 0.5, 0.1)):
        held = scene.blocked(response)
        same_collisions(plain, held, tried, tried)


@given(data=st.data())
def test_avo_is_that_of_van_den_berg_et_al(data: st.DataObject) -> None:
    """With E = exp(-t / lag) - 1: centre (lag E v - p) / (t + lag E), radius r / (t + lag E).

    van den Berg, Snape, Guy and Manocha, ICRA 2011: the relative target velocities that collide at t, with
    p = p_A - p_B and v = v_A - v_B.
    """
    d = data.draw(dimensions)
    state, track = data.draw(states(d)), data.draw(KINDS["constant_velocity"](d))
    lag, t = data.draw(numbers(0.1, 3.0)), data.draw(numbers(0.2, 5.0))
    assume(np.linalg.norm(track.position(0.0) - state.position) > 1.31)
    obstacle = Obstacle(disc_or_ball(1.0, d), track, after_end="leaves")
    element = control_obstacle(LaggedVelocity(lag), state, [obstacle], disc_or_ball(0.3, d), horizon=5.0).element(t)
    e, p, v = np.expm1(-t / lag), state.position - track.position(0.0), state.velocity - track.initial_velocity
    np.testing.assert_allclose(
        element.centers[0] - track.initial_velocity, (lag * e * v - p) / (t + lag * e), atol=1e-7
    )
    assert element.radii[0] == pytest.approx(1.3 / (t + lag * e), rel=1e-9)


GRAZING = {
    "nlvo": (Velocity(), lambda q, v, t: q - t * v),
    "nao": (Acceleration(), None),
    "avo": (LaggedVelocity(0.8), None),
    "jerk": (Jerk(), None),
}


@pytest.mark.parametrize("name", GRAZING)
@given(data=st.data())
def test_envelope_formula_gives_grazing_controls(name: str, data: st.DataObject) -> None:
    """e = (c - p0 - R n) / g with n from q = (c - p0) - (g / g') (c' - p0'): contact with no closing speed."""
    response = GRAZING[name][0]
    state, track, radius = data.draw(states(2)), data.draw(KINDS["circular"](2)), 1.3
    t = data.draw(numbers(0.3, 4.0))
    position, velocity = response.position(state, t), response.velocity(state, t)
    c, g, rate = track.position(t) - position.drift, float(position.gain), float(velocity.gain)
    q = c - g / rate * (track.velocity(t) - velocity.drift)
    length = np.linalg.norm(q)
    assume(length > radius)
    for side in (1.0, -1.0):
        across = side * np.array([-q[1], q[0]]) / length
        n = radius / length * q / length + np.sqrt(1.0 - (radius / length) ** 2) * across
        graze = (c - radius * n) / g
        relative = track.position(t) - position(graze)
        closing = track.velocity(t) - velocity(graze)
        assert np.linalg.norm(relative) == pytest.approx(radius, abs=1e-9)
        assert relative @ closing == pytest.approx(0.0, abs=1e-8 * (1 + np.linalg.norm(closing)))


@given(data=st.data())
def test_gap_of_the_envelope_lies_in_the_element_where_it_begins(data: st.DataObject) -> None:
    """AO: if the straight relative motion is inside from t_in to t_out, E(t) is in E(2 t_in) from 2 t_in to 2 t_out."""
    state, track = data.draw(states(2)), data.draw(KINDS["constant_acceleration"](2))
    c, w, radius = track.position(0.0) - state.position, state.velocity - track.velocity(0.0), 1.3
    assume(np.linalg.norm(c) > radius + 0.1)
    w = np.linalg.norm(w) * (c / np.linalg.norm(c) + data.draw(st.floats(-0.1, 0.1)) * np.array([-c[1], c[0]]))
    b, e = c @ w, (w @ w) * (c @ c - radius**2)
    assume(w @ w > 0.01 and b > 0.0 and b * b > e)
    enter, leave = (b - np.sqrt(b * b - e)) / (w @ w), (b + np.sqrt(b * b - e)) / (w @ w)
    start = State(state.position, track.velocity(0.0) + w)
    blocked = control_obstacle(
        Acceleration(),
        start,
        [Obstacle(Disc(1.0), track, after_end="leaves")],
        Disc(0.3),
        horizon=2.0 * float(leave) + 1.0,
    )
    first = blocked.element(2.0 * float(enter))
    for t in np.linspace(2.0 * enter, 2.0 * leave, 20)[1:]:
        later = blocked.element(float(t))
        apart = float(np.linalg.norm(later.centers[0] - first.centers[0]))
        assert apart + later.radii[0] <= first.radii[0] * (1 + 1e-9) + ROUNDING


@given(data=st.data())
def test_no_collision_before_the_first_possible_time(data: st.DataObject) -> None:
    """t >= 2 (|c| - R) / (|w| + sqrt(|w|^2 + 2 U (|c| - R))) for accelerations within U of the obstacle's."""
    d = data.draw(dimensions)
    state, track, radius = data.draw(states(d)), data.draw(KINDS["constant_acceleration"](d)), 1.3
    c, w = track.position(0.0) - state.position, state.velocity - track.velocity(0.0)
    room = float(np.linalg.norm(c)) - radius
    assume(room > 0.01)
    blocked = control_obstacle(
        Acceleration(),
        state,
        [Obstacle(disc_or_ball(1.0, d), track, after_end="leaves")],
        disc_or_ball(0.3, d),
        horizon=6.0,
    )
    speed = float(np.linalg.norm(w))
    tried = telling_controls(blocked, data.draw(controls(d))[None])
    for u in np.append(tried, (track.initial_acceleration + 3.0 * c / np.linalg.norm(c))[None], axis=0):
        most = float(np.linalg.norm(u - track.initial_acceleration))
        earliest = 2 * room / (speed + np.sqrt(speed**2 + 2 * most * room) + 1e-300)
        assert float(blocked.time_to_collision(u)) >= earliest * (1 - 1e-6)


# Selection


@cache
def many_directions(d: int, count: int = 400) -> np.ndarray:
    """Points of the unit ball, fixed."""
    rng = np.random.default_rng(7)
    points = rng.normal(size=(count, d))
    return points / np.linalg.norm(points, axis=1, keepdims=True) * rng.random((count, 1)) ** (1 / d)


def draw_problem(data: st.DataObject, response: Response, most: int = 3):
    """A scene, its admissible set and a preferred control."""
    scene = data.draw(scenes(most=most))
    limits = Limits(6.0, 3.0)
    return scene, box(response, scene.state, limits, scene.horizon), scene.controls[0], scene.blocked(response)


@drawn_response
@given(data=st.data())
def test_choice_is_admissible_safe_and_nearest(response: Response, data: st.DataObject) -> None:
    """Against brute force: the choice collides with nothing, and no safe admissible control is nearer."""
    scene, admissible, preferred, blocked = draw_problem(data, response)
    choice = select(preferred, admissible, blocked)
    assert choice.status not in (Status.UNDECIDED, Status.OVERLAPPING)
    assert choice.safe == (choice.status in (Status.CLEAR, Status.CONSTRAINED))
    if choice.control is not None:
        assert admissible.contains(choice.control)
        assert brute_clearance(blocked, choice.control) >= 0.0
        assert choice.distance == pytest.approx(np.linalg.norm(choice.control - preferred), abs=1e-12)
        assert (choice.status is Status.CLEAR) == (choice.distance == 0.0)
    ball = int(np.argmin(admissible.radii))
    reach = min(choice.distance, float(admissible.radii[ball] + np.linalg.norm(admissible.centers[ball] - preferred)))
    rivals = [preferred + reach * many_directions(scene.dimension)]
    rivals.append(admissible.centers[ball] + admissible.radii[ball] * many_directions(scene.dimension))
    for tried in rivals:
        tried = tried[admissible.excess(tried) <= 0.0]
        tried = tried[np.linalg.norm(tried - preferred, axis=1) < choice.distance - 1e-9]
        if len(tried):
            assert blocked.clearance(tried).max() < CONTACT + CERTIFIED


@drawn_response
@given(data=st.data())
def test_toward_is_the_nearest_point_of_the_smallest_ball(response: Response, data: st.DataObject) -> None:
    """And what is in that ball is its own."""
    _, admissible, control, _ = draw_problem(data, response)
    k = int(np.argmin(admissible.radii))
    found, center, radius = admissible.toward(control), admissible.centers[k], float(admissible.radii[k])
    away = float(np.linalg.norm(control - center))
    near = pytest.approx(max(away - radius, 0.0), rel=1e-9, abs=1e-9 * (1.0 + away))
    assert np.linalg.norm(found - center) <= radius * (1.0 + 1e-9)
    assert np.linalg.norm(found - control) == near
    inside = center + (control - center) * min(1.0, 0.99 * radius / max(away, 1e-9))
    assert np.array_equal(admissible.toward(inside), inside)


@drawn_response
@given(data=st.data())
def test_order_of_obstacles_does_not_matter(response: Response, data: st.DataObject) -> None:
    scene, admissible, preferred, _ = draw_problem(data, response, most=4)
    shuffled = tuple(data.draw(st.permutations(scene.obstacles)))
    same_choice(
        lambda more: (admissible, scene.blocked(response, margin=scene.margin + more)),
        (preferred, admissible, scene.blocked(response, obstacles=shuffled)),
        preferred,
    )


@drawn_response
@given(data=st.data())
def test_one_more_obstacle_never_brings_the_choice_nearer(response: Response, data: st.DataObject) -> None:
    scene, admissible, preferred, blocked = draw_problem(data, response)
    fewer = scene.blocked(response, obstacles=scene.obstacles[:-1], margin=scene.margin - SLACK)
    assert select(preferred, admissible, blocked).distance >= select(preferred, admissible, fewer).distance - 1e-9


@given(data=st.data())
def test_preferred_control_minimises_the_sum_of_aims(data: st.DataObject) -> None:
    """Against a least-squares solver that knows nothing of scalar gains."""
    d = data.draw(dimensions)
    state = data.draw(states(d))
    names = data.draw(st.lists(st.sampled_from(sorted(RESPONSES)), min_size=1, max_size=4))
    aims = []
    for name in names:
        t = data.draw(numbers(0.1, 4.0))
        image = data.draw(st.sampled_from([RESPONSES[name].position, RESPONSES[name].velocity]))(state, t)
        aims.append(Aim(image, data.draw(vectors(d, 5.0)), data.draw(numbers(0.1, 3.0))))
    rows = np.concatenate([np.sqrt(aim.weight) * float(aim.map.gain) * np.eye(d) for aim in aims])
    right = np.concatenate([np.sqrt(aim.weight) * (aim.target - aim.map.drift) for aim in aims])
    expected = np.linalg.lstsq(rows, right, rcond=None)[0]
    found = preferred_control(tuple(aims))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)

    def cost(u: np.ndarray) -> float:
        return sum(aim.weight * float(np.sum((aim.map(u) - aim.target) ** 2)) for aim in aims)

    # The sum is (sum w g^2) |u - preferred|^2 + constant: the nearest control to it is the best one in any set.
    u = data.draw(controls(d))
    curvature = sum(aim.weight * float(aim.map.gain) ** 2 for aim in aims)
    expected_cost = cost(found) + curvature * float(np.sum((u - found) ** 2))
    assert cost(u) == pytest.approx(expected_cost, rel=1e-9, abs=1e-9)


@given(data=st.data())
def test_clearest_choice_keeps_its_margin_which_is_the_largest(data: st.DataObject) -> None:
    """Brute force over the admissible set finds none with more clearance than the margin kept and its accuracy."""
    response = data.draw(st.sampled_from([RESPONSES["velocity_ramp"], RESPONSES["coast"], RESPONSES["stop_long"]]))
    scene, admissible, preferred, blocked = draw_problem(data, response)
    enough, accuracy = 2.0, 1e-2
    choice, kept = select_clearest(preferred, admissible, blocked, enough=enough, accuracy=accuracy)
    ball = int(np.argmin(admissible.radii))
    tried = admissible.centers[ball] + admissible.radii[ball] * many_directions(scene.dimension)
    tried = tried[admissible.excess(tried) <= 0.0]
    best = blocked.clearance(tried).max(initial=-np.inf)
    if choice.control is None:
        assert kept == 0.0
        assert best < CONTACT + CERTIFIED
        return
    assert 0.0 <= kept <= enough
    assert admissible.contains(choice.control)
    assert brute_clearance(blocked, choice.control) >= kept
    # No control keeps a margin beyond the present gap.
    assert kept >= min(enough, best) - accuracy - CONTACT - CERTIFIED
    nearest = select(preferred, admissible, scene.blocked(response, margin=scene.margin + kept))
    assert nearest.distance == pytest.approx(choice.distance, abs=1e-12)


def within(state: State, limits: Limits) -> State:
    """The state, slowed and turned until it obeys the limits now."""

    def obeying(x: np.ndarray, most: float, bounds) -> np.ndarray:
        x = x * min(1.0, 0.95 * most / (np.linalg.norm(x) + 1e-12))
        for bound in bounds:
            if bound.normal @ x > bound.offset:
                x = -x
        return x

    velocity = obeying(state.velocity, limits.max_speed, limits.velocity_bounds)
    acceleration = obeying(state.acceleration, limits.max_acceleration, limits.acceleration_bounds)
    while not limits.allows(State(state.position, velocity), acceleration, 0.0):
        acceleration = 0.9 * acceleration if np.linalg.norm(acceleration) > 1e-9 else 0.0 * acceleration
    return State(state.position, velocity, acceleration)


def nothing_around(response: Response, state: State, horizon: float) -> ControlObstacle:
    """A control obstacle without obstacles."""
    return control_obstacle(response, state, [], disc_or_ball(0.3, state.dimension), horizon=horizon)


def extreme_controls(response: Response, state: State, admissible, horizon: float, drawn: np.ndarray) -> list:
    """Admissible controls on the boundary of the set: nearest to far away ones."""
    empty = nothing_around(response, state, horizon)
    found = [select(scale * u, admissible, empty).control for u in drawn for scale in (1.0, 30.0)]
    return [u for u in found if u is not None]


@drawn_limits
@drawn_response
@given(data=st.data())
def test_admissible_controls_obey_the_limits_all_along(response: Response, limits, data: st.DataObject) -> None:
    """Speed and acceleration of the whole predicted motion stay below the limits."""
    d = data.draw(dimensions)
    limits = limits(d)
    state, horizon = within(data.draw(states(d)), limits), data.draw(numbers(0.2, 6.0))
    admissible = box(response, state, limits, horizon)
    drawn = np.array([data.draw(controls(d)) for _ in range(3)])
    times = np.unique(np.concatenate([np.linspace(0.0, horizon, 800), response.knots(horizon, 20.0)]))
    for u in extreme_controls(response, state, admissible, horizon, drawn):
        # At the horizon itself a braking that lies beyond it may begin.
        velocities, accelerations = response.velocity(state, times)(u), response.acceleration(state, times[:-1])(u)
        assert np.linalg.norm(velocities, axis=1).max() <= limits.max_speed * (1 + 10 * ADMISSIBLE) + ROUNDING
        assert np.linalg.norm(accelerations, axis=1).max() <= limits.max_acceleration * (1 + 10 * ADMISSIBLE) + ROUNDING
        for bound in limits.velocity_bounds:
            assert (velocities @ bound.normal).max() <= bound.offset + 1e-7
        for bound in limits.acceleration_bounds:
            assert (accelerations @ bound.normal).max() <= bound.offset + 1e-7
        for bound in limits.bounds:
            # As it stands at the decision: later the body has turned. Braking to rest ends a least speed.
            bounded = velocities if bound.of == "velocity" else accelerations
            if isinstance(bound, LeastSpeed):
                bounded = velocities[times <= getattr(response, "hold", horizon)]
            assert out_of_bound(bound, state.velocity, bounded).max() <= 1e-7, bound


def test_choice_without_obstacles_is_the_nearest_admissible_control() -> None:
    """The projection on an intersection of balls and half-spaces, against Dykstra's algorithm."""
    for d in (2, 3):
        limits, state = LIMITS["one_way"](d), State(np.zeros(d), np.full(d, 0.4))
        response = Velocity(ramp=0.7)
        admissible = box(response, state, limits, 5.0)
        for wanted in np.random.default_rng(3).normal(0.0, 3.0, (40, d)):
            found = select(wanted, admissible, nothing_around(response, state, 5.0)).control
            np.testing.assert_allclose(found, dykstra(wanted, admissible), atol=1e-6)


def dykstra(wanted: np.ndarray, admissible) -> np.ndarray:
    """Projection on the intersection of convex sets by Dykstra's alternating projections."""
    x = wanted.copy()
    left = np.zeros((len(admissible.radii) + len(admissible.offsets), len(x)))
    for _ in range(20000):
        before = x
        for i in range(len(left)):
            y = x + left[i]
            if i < len(admissible.radii):
                away = y - admissible.centers[i]
                x = admissible.centers[i] + away * min(1.0, admissible.radii[i] / (np.linalg.norm(away) + 1e-300))
            else:
                j = i - len(admissible.radii)
                x = y - max(0.0, admissible.normals[j] @ y - admissible.offsets[j]) * admissible.normals[j]
            left[i] = y - x
        if np.abs(x - before).max() < 1e-13:
            break
    return x


def shedding_time(response: Response) -> float:
    """Time in which braking is asked for: the ramp or the hold; a lag has neither, there it is one second."""
    return getattr(response, "hold", 0.0) or getattr(response, "ramp", 0.0) or 1.0


@pytest.mark.parametrize("name", ENROLLED_METHODS)
@drawn_limits
@given(data=st.data())
def test_every_response_of_a_method_has_an_admissible_control(name: str, limits, data: st.DataObject) -> None:
    """In any state within the limits, so that "no safe control" never means "no control"."""
    d = data.draw(dimensions)
    limits = replace(limits(d), acceleration_bounds=())
    if ENROLLED_METHODS[name].shared:
        # Its manoeuvres end at rest.
        limits = replace(limits, bounds=tuple(b for b in limits.bounds if not isinstance(b, LeastSpeed)))
    state = within(data.draw(states(d)), limits)
    for response in ENROLLED_METHODS[name].responses(limits, PERIOD, slalom.decision.methods.HOLDS):
        admissible = box(response, state, limits, 6.0)
        status = select(np.zeros(d), admissible, nothing_around(response, state, 6.0)).status
        assert status is not Status.INADMISSIBLE, response


@pytest.mark.parametrize("name", ENROLLED_METHODS)
@each_dimension
@pytest.mark.parametrize("excess", [0.05, 0.5, 2.0])
def test_too_fast_robot_sheds_at_least_half_of_what_braking_would(name: str, d: int, excess: float) -> None:
    """The stated rule above the speed limit; some control must obey it, and the acceleration limit holds as ever."""
    limits = Limits(max_speed=2.0, max_acceleration=1.5)
    speed = limits.max_speed + excess
    state = State(np.zeros(d), speed * np.eye(d)[0])
    obeyed = []
    for response in ENROLLED_METHODS[name].responses(limits, PERIOD, slalom.decision.methods.HOLDS):
        admissible = box(response, state, limits, 6.0)
        drawn = np.concatenate([np.eye(d), -np.eye(d)]) * 3.0
        found = extreme_controls(response, state, admissible, 6.0, drawn)
        obeyed.append(bool(found))
        times = np.linspace(0.0, 30.0, 3001)
        shed = 0.5 * limits.max_acceleration * shedding_time(response)
        settled = 20.0 if isinstance(response, LaggedVelocity) else shedding_time(response)
        for u in found:
            accelerations = np.linalg.norm(response.acceleration(state, times)(u), axis=1)
            assert accelerations.max() <= limits.max_acceleration * (1 + 1e-8)
            speeds = np.linalg.norm(response.velocity(state, times)(u), axis=1)
            assert speeds.max() <= speed + ROUNDING
            assert speeds[times >= settled - ROUNDING].max() <= max(limits.max_speed, speed - shed) + 1e-5
    assert any(obeyed), "no response of the method has an admissible control"


@each_limits
@each_dimension
def test_methods_keep_brakes_admissible(limits, d: int) -> None:
    """A stopping response never brakes harder than allowed from within the speed limit."""
    limits = limits(d)
    for response in METHODS["nao"].responses(limits, PERIOD, (0.2, 1.0)):
        if isinstance(response, AccelerateThenStop):
            assert response.rate * limits.max_speed <= limits.max_acceleration * (1 + 1e-12)
            assert response.rate * response.period < 1.0
