"""Errata of Stern and Shiller, "From NLVO to NAO", arXiv:2506.06255v1: literal formulas against brute force.

Each test evaluates a formula as printed on a concrete example, shows by simulation that it is wrong, and that slalom's
answer is right. The numbers are those of `docs/theory.md`, section "Errata of the paper"; 7, 8 and 12 are slips of
wording and of citation with nothing to compute.
"""

from collections.abc import Callable

import numpy as np
import pytest

from slalom import (
    AccelerateThenCoast,
    AccelerateThenStop,
    Acceleration,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    Limits,
    Obstacle,
    Response,
    State,
    Stationary,
    Status,
    Trajectory,
    Velocity,
    advance,
    control_obstacle,
    select,
)

ORIGIN = np.zeros(2)
ROBOT, OTHER = Disc(0.4), Disc(0.6)
RADIUS = 1.0
"""[m] Sum of both radii."""

Law = Callable[[np.ndarray, np.ndarray, float], np.ndarray]


def least_distance(
    state: State, track: Trajectory, law: Law, duration: float, start: float = 0.0, most_speed: float = np.inf
) -> tuple[float, float]:
    """Least distance of the centres and its elapsed time, of a robot stepped through time by an acceleration law.

    Steps of a millisecond; `most_speed` clips the velocity as a motor does. Of slalom only the trajectory is used.
    """
    position, velocity, step = state.position.copy(), state.velocity.copy(), 1e-3
    times = np.arange(round(duration / step) + 1) * step
    positions = np.empty((len(times), len(position)))
    for k, t in enumerate(times):
        positions[k] = position
        before = velocity
        velocity = velocity + step * law(position, velocity, t)
        length = np.linalg.norm(velocity)
        if length > most_speed:
            velocity = velocity * (most_speed / length)
        position = position + 0.5 * step * (before + velocity)
    away = np.linalg.norm(positions - track.position(start + times), axis=1)
    k = int(np.argmin(away))
    return float(away[k]), float(times[k])


def keeping(acceleration: np.ndarray) -> Law:
    """The law of a constant acceleration."""
    return lambda position, speed, t: acceleration


STILL: Law = keeping(ORIGIN)


def blocked_by(
    response: Response, state: State, track: Trajectory, horizon: float, start: float = 0.0
) -> ControlObstacle:
    return control_obstacle(response, state, [Obstacle(OTHER, track)], ROBOT, horizon=horizon, start=start)


def in_disc(u: np.ndarray, center: np.ndarray, radius: float) -> bool:
    return bool(np.linalg.norm(u - center) < radius)


def test_erratum_01_nlvo_adds_the_obstacle_position_twice() -> None:
    """1, the equation NLVO(t) = c(t)/(t-t0) (+) B(t)/(t-t0) with B(t) = c(t) (+) B: the centre is off by a factor 2.

    Right: c(t)/(t-t0) (+) B/(t-t0) with the body-fixed B.
    """
    track, t = Circular([6.0, 0.0], 3.0, 1.5, phase=2.0), 2.5
    c = track.position(t)
    hits, misses = c / t, 2.0 * c / t
    for u, expected in ((hits, True), (misses, False)):
        literal = in_disc(u, c / t + c / t, RADIUS / t)
        found, _ = least_distance(State(ORIGIN, u), track, STILL, t)
        assert (found < RADIUS) == expected
        assert literal != expected
        blocked = blocked_by(Velocity(), State(ORIGIN, ORIGIN), track, t)
        assert bool(blocked.contains(u)) == expected
    element = blocked.element(t)
    np.testing.assert_allclose(element.centers[0], c / t)
    assert element.radii[0] == pytest.approx(RADIUS / t)


def test_erratum_02_homothety_ratio_is_inverted() -> None:
    """2, derivation of the NLVO, "Ap = k Ap'" with k = 1/(t-t0) and p' the image of p: right is Ap' = k Ap."""
    t, point = 2.5, np.array([5.0, 1.0])
    k = 1.0 / t
    literal, right = point / k, k * point
    reached = {
        name: advance(Velocity(), State(ORIGIN, ORIGIN), u, t).position
        for name, u in (("literal", literal), ("right", right))
    }
    np.testing.assert_allclose(reached["literal"], t * t * point)
    np.testing.assert_allclose(reached["right"], point)
    np.testing.assert_allclose(Velocity().position(State(ORIGIN, ORIGIN), t).inverse(point), right)


def test_erratum_03_second_homothety_has_the_wrong_centre() -> None:
    """3, derivation of the NLVO, RV(t) = H_{A,k}(c) + H_{c,k}(B): about c it leaves an offset; right is k c + k B."""
    track, t = Circular([6.0, 0.0], 3.0, 1.5, phase=2.0), 2.5
    c, k = track.position(t), 1.0 / t
    body_fixed = k * c + (1.0 - k) * c  # H_{c,k} moves the origin of B to (1 - k) c
    placed = k * c + c  # H_{c,k} leaves a B that stands at c where it is
    for center in (body_fixed, placed):
        found, at = least_distance(State(ORIGIN, center), track, STILL, t)
        meets_then = np.linalg.norm(center * t - track.position(t)) < RADIUS
        assert not meets_then, (found, at)
    np.testing.assert_allclose(
        blocked_by(Velocity(), State(ORIGIN, ORIGIN), track, t).element(t).centers[0], k * c, atol=1e-12
    )
    assert least_distance(State(ORIGIN, k * c), track, STILL, t)[0] < 1e-9


def test_erratum_04_elapsed_time_and_the_empty_set() -> None:
    """4, derivation of the NLVO, (A + v_a t) cap (c(t) + B) = 0: right is (A + v_a (t-t0)) cap (c(t) + B) = {}."""
    now, t = 3.0, 5.0
    track = ConstantVelocity([8.0, 0.0], [-1.0, 0.0])
    u = np.array([1.5, 0.0])
    literal_meets = np.linalg.norm(u * t - track.position(t)) < RADIUS
    right_meets = np.linalg.norm(u * (t - now) - track.position(t)) < RADIUS
    assert not literal_meets
    assert right_meets
    assert least_distance(State(ORIGIN, u), track, STILL, t - now, start=now)[0] < RADIUS
    blocked = blocked_by(Velocity(), State(ORIGIN, ORIGIN), track, t - now, start=now)
    assert bool(blocked.contains(u))
    assert in_disc(u, blocked.element(t - now).centers[0], blocked.element(t - now).radii[0])


def test_erratum_05_absolute_time_in_the_acceleration_obstacles() -> None:
    """5, all equations of AO and NAO: 2B/t^2 (+) (2c(t)/t^2 - 2v_A/t) holds only for t0 = 0; c(t) alone is absolute."""
    now, t = 2.0, 4.0
    velocity, track = np.array([1.0, 0.5]), Circular([7.0, 2.0], 3.0, 2.0)
    state, elapsed = State(ORIGIN, velocity), t - now
    literal = 2.0 * track.position(t) / t**2 - 2.0 * velocity / t
    right = 2.0 * track.position(t) / elapsed**2 - 2.0 * velocity / elapsed
    for u, expected in ((literal, False), (right, True)):
        where = state.position + elapsed * velocity + 0.5 * elapsed**2 * u
        assert (np.linalg.norm(where - track.position(t)) < RADIUS) == expected
        found, at = least_distance(state, track, keeping(u), elapsed, start=now)
        assert (found < RADIUS and abs(at - elapsed) < 0.01) == expected
    blocked = blocked_by(Acceleration(), state, track, elapsed, start=now)
    np.testing.assert_allclose(blocked.element(elapsed).centers[0], right, atol=1e-12)
    assert blocked.element(elapsed).radii[0] == pytest.approx(2.0 * RADIUS / elapsed**2)
    assert bool(blocked.contains(right))


def test_erratum_06_sign_of_the_relative_velocity() -> None:
    """6, derivation of the AO, v_{A/B} has no stated sign and the AO is called tangent to it as t -> inf.

    The derivation forces w = v_A - v_B, and the AO reaches its apex a_B from the side of -w.
    """
    state = State(ORIGIN, [1.0, 0.4])
    track = ConstantAcceleration([6.0, 1.0], [-0.5, 0.2], [0.1, -0.3])
    t, w = 3.0, state.velocity - track.initial_velocity
    right = 2.0 * track.initial_position / t**2 - 2.0 * w / t + track.initial_acceleration
    wrong = 2.0 * track.initial_position / t**2 + 2.0 * w / t + track.initial_acceleration
    for u, expected in ((right, True), (wrong, False)):
        found, at = least_distance(state, track, keeping(u), t)
        assert (found < 1e-2 and abs(at - t) < 0.01) == expected
    np.testing.assert_allclose(blocked_by(Acceleration(), state, track, t).element(t).centers[0], right, atol=1e-12)
    late = blocked_by(Acceleration(), state, track, 5e3).element(5e3).centers[0] - track.initial_acceleration
    cosine = late @ w / np.linalg.norm(late) / np.linalg.norm(w)
    assert cosine == pytest.approx(-1.0, abs=1e-4)


def test_erratum_09_constant_acceleration_ignores_the_speed_limit() -> None:
    """9, Definitions 3 and 4, "for all t > t0": no largest speed. A saturated robot is not where they say.

    An acceleration that is free by the definition collides once the motor clips the speed; one that accelerates up to
    the limit and then coasts is predicted as it moves.
    """
    state, u, most = State(ORIGIN, [1.0, 0.0]), np.array([1.0, 0.0]), 2.0
    track = ConstantVelocity([8.0, -5.0], [0.0, 1.0])  # crosses the robot's lane at t = 5
    literal = blocked_by(Acceleration(), state, track, 6.0)
    assert not bool(literal.contains(u))
    assert least_distance(state, track, keeping(u), 6.0)[0] > RADIUS  # without a limit it is past the crossing by then
    assert least_distance(state, track, keeping(u), 6.0, most_speed=most)[0] < RADIUS
    hold = (most - 1.0) / 1.0
    coasting = blocked_by(AccelerateThenCoast(hold), state, track, 6.0)
    assert bool(coasting.contains(u))
    clipped = least_distance(state, track, keeping(u), 6.0, most_speed=most)[0] - RADIUS
    assert float(coasting.clearance(u)) == pytest.approx(clipped, abs=5e-3)


def test_erratum_09_braking_is_not_a_constant_acceleration() -> None:
    """9, Definitions 3 and 4, "for all t > t0": a robot that brakes by a constant acceleration drives backwards later.

    With an obstacle behind it every braking collides in the end by the definition, though the robot can simply stop.
    """
    state, behind = State(ORIGIN, [2.0, 0.0]), Stationary([-6.0, 0.0])
    ahead = Stationary([12.0, 0.0])
    braking = np.array([-1.0, 0.0])
    for rate in (0.25, 0.5, 1.0, 2.0):
        assert bool(blocked_by(Acceleration(), state, behind, 60.0).contains(rate * braking))
    stopping = AccelerateThenStop(hold=1.0, rate=1.0, period=0.1)

    def stops(position: np.ndarray, speed: np.ndarray, t: float) -> np.ndarray:
        return braking if t < 1.0 else -stopping.rate * speed

    for track in (behind, ahead):
        assert least_distance(state, track, stops, 60.0)[0] > RADIUS
        assert not bool(blocked_by(stopping, state, track, 60.0).contains(braking))


def test_erratum_10_rvo_is_the_vo_translated_not_scaled_down() -> None:
    """10, Introduction, the RVO is "a scaled-down version of the original VO".

    RVO(v_A, v_B) = {v : 2v - v_A in VO} is the same cone with its apex at (v_A + v_B) / 2: a control on its boundary
    is just enough if the other does its half; one on the boundary of a scaled cone is not.
    """
    a, b = State([0.0, 0.0], [1.0, 0.0]), State([6.0, 0.0], [-1.0, 0.0])
    vo = blocked_by(Velocity(), a, ConstantVelocity(b.position, b.velocity), 600.0)
    half_angle = np.arcsin(RADIUS / 6.0)
    middle = 0.5 * (a.velocity + b.velocity)

    def in_rvo(v: np.ndarray) -> bool:
        return bool(vo.contains(2.0 * v - a.velocity))

    def in_cone(v: np.ndarray, apex: np.ndarray) -> bool:
        away = v - apex
        return bool(np.arctan2(abs(away[1]), away[0]) < half_angle)

    def in_scaled(v: np.ndarray) -> bool:
        return bool(vo.contains(2.0 * v))  # VO / 2, scaled about the origin of velocities

    rng = np.random.default_rng(4)
    tried = rng.uniform(-2.0, 2.0, (1500, 2))
    assert all(in_rvo(v) == in_cone(v, middle) for v in tried)  # the same angle: translated
    assert any(in_scaled(v) != in_rvo(v) for v in tried)

    def both_choose(v: np.ndarray) -> float:
        """Least distance when A takes v and B, by symmetry, -v."""
        return least_distance(State(a.position, v), ConstantVelocity(b.position, -v), STILL, 12.0)[0]

    outside = np.array([1.0, np.tan(half_angle) + 0.01])
    assert not in_rvo(outside)
    assert both_choose(outside) > RADIUS
    # Where both readings disagree, the simulation agrees with the translated cone.
    disputed = [v for v in tried if in_scaled(v) != in_rvo(v) and v[0] > 0.5]
    assert len(disputed) > 10
    for v in disputed:
        assert (both_choose(v) < RADIUS) == in_rvo(v)


@pytest.mark.draw(1)
def test_erratum_11_avoiding_until_a_horizon_is_no_guarantee() -> None:
    """11, "guarantees to avoid collision at all times".

    With a receding horizon T an acceleration that is free now can lead into a state from which none is: here the robot
    accelerates towards a wall of 100 m that lies beyond T. From the same state, a manoeuvre that ends at rest and is
    free until then stays free for all time.
    """
    wall = Obstacle(Disc(100.0), Stationary([124.4, 0.0]))
    limits, horizon, period = Limits(max_speed=8.0, max_acceleration=2.0), 1.5, 0.5
    begin, wanted = State(ORIGIN, [6.0, 0.0]), np.array([2.0, 0.0])

    def choice(response: Response, state: State, horizon: float):
        admissible = limits.admissible(response, state, horizon)
        return select(wanted, admissible, control_obstacle(response, state, [wall], ROBOT, horizon=horizon))

    assert choice(Acceleration(), begin, horizon).safe  # free until the horizon, as the definition with t_h asks
    state, statuses = begin, []
    for _ in range(12):
        found = choice(Acceleration(), state, horizon)
        statuses.append(found.status)
        if not found.safe:
            break
        state = advance(Acceleration(), state, found.control, period)
    assert statuses[-1] is Status.BLOCKED
    # Brute force: from here even the hardest braking in any direction reaches the wall.
    for angle in np.linspace(0.0, 2.0 * np.pi, 73):
        acceleration = limits.max_acceleration * np.array([np.cos(angle), np.sin(angle)])
        assert least_distance(state, wall.trajectory, keeping(acceleration), 4.0)[0] < 100.4

    stopping = AccelerateThenStop(hold=1.0, rate=0.25, period=0.1)
    safe = choice(stopping, begin, 60.0)
    assert safe.control is not None

    held = [safe.control]

    def follows(position: np.ndarray, speed: np.ndarray, t: float) -> np.ndarray:
        if t >= 1.0 - 1e-9 and round(1000 * t) % 100 == 0:
            held[0] = -0.25 * speed
        return held[0]

    assert least_distance(begin, wall.trajectory, follows, 120.0)[0] >= 100.4 - 1e-3
    assert float(np.linalg.norm(advance(stopping, begin, safe.control, 60.0).velocity)) < 1e-5


def test_sampled_union_of_discs_calls_colliding_controls_free() -> None:
    """Not printed, but how the maps are usually computed: a union of discs at sampled times approximates from inside.

    Between two samples the obstacle passes; every one of the discs is avoided, and the robot is hit.
    """
    step, horizon = 0.25, 4.0
    state, u = State(ORIGIN, ORIGIN), ORIGIN
    # Passes the robot's place at t = 1.125, midway between two samples, at 12 m/s.
    track = ConstantVelocity([0.5, -12.0 * 1.125], [0.0, 12.0])
    blocked = blocked_by(Acceleration(), state, track, horizon)
    sampled = [blocked.element(t) for t in np.arange(step, horizon + step / 2, step)]
    assert not any(in_disc(u, element.centers[0], element.radii[0]) for element in sampled)
    assert least_distance(state, track, STILL, horizon)[0] == pytest.approx(0.5, abs=1e-2)
    assert bool(blocked.contains(u))
    assert float(blocked.clearance(u)) == pytest.approx(0.5 - RADIUS, abs=1e-6)
    # Refining the samples only shrinks the error: R - sqrt(R^2 - (V D / 2)^2) can always be missed.
    missed = RADIUS - np.sqrt(RADIUS**2 - (12.0 * 0.1 / 2) ** 2)
    graze = ConstantVelocity([RADIUS - 0.9 * missed, -12.0 * 1.15], [0.0, 12.0])
    grazed = blocked_by(Acceleration(), state, graze, horizon)
    assert all(not in_disc(u, grazed.element(t).centers[0], grazed.element(t).radii[0]) for t in np.arange(1, 41) * 0.1)
    assert bool(grazed.contains(u))
