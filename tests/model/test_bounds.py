"""Bounds that depend on the state: against their definitions, at rest, above the speed limit, and in whole runs."""

import numpy as np
import pytest
from definitions import out_of_bound
from draws import draws
from parts import BOUNDS as ENROLLED, PERIOD, disc_or_ball
from scenes import BOUNDS

from slalom import (
    METHODS,
    Box,
    ConvexPolygon,
    Friction,
    Goal,
    HeadingCone,
    LeastSpeed,
    Limits,
    Obstacle,
    State,
    Stationary,
    Status,
    TurningRadius,
    control_obstacle,
    select,
)
from slalom.model.bounds import Bound
from slalom.sim import Robot, Scenario, simulate

ROUND = {
    # What is left of a round set: along any direction, and for a cone of its tangent.
    (Friction, 2): np.cos(np.pi / 32),
    (Friction, 3): np.sqrt(2 / 3),
    (TurningRadius, 3): np.cos(np.pi / 8),
    (HeadingCone, 3): np.cos(np.pi / 8),
}


EVERY = [(kind, d) for kind in BOUNDS for d in (2, 3) if (kind, d) != ("convex_polygon", 3)]
each_kind = pytest.mark.parametrize(("kind", "d"), EVERY)


def drawn(kind: str, d: int, seed: int) -> tuple[Bound, State]:
    """A bound and a robot, random ones."""
    rng = np.random.default_rng([seed, d])
    return BOUNDS[kind](rng, d, rng.uniform(1.0, 5.0)), State(rng.normal(size=d), 2.0 * rng.normal(size=d))


def reach(outside, direction: np.ndarray, start: np.ndarray) -> float:
    """How far a convex set with `start` in it extends in a direction, by bisection; at most 1000."""
    low, high = 0.0, 1000.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if outside(start + middle * direction) > 0.0 else (middle, high)
    return low


def test_enrolled_bounds_fit_their_protocol() -> None:
    assert all(isinstance(bound, Bound) for bounds in ENROLLED.values() for d in (2, 3) for bound in bounds(d))


@pytest.mark.parametrize("seeds", draws([range(3), range(3, 12)]), ids=str)
@each_kind
def test_half_spaces_are_the_definition(kind: str, d: int, seeds: range) -> None:
    """Nowhere outside of it, and no more is lost than is stated; nothing at all for what has flat sides."""
    for seed in seeds:
        bound, state = drawn(kind, d, seed)
        normals, offsets = bound.half_spaces(state)
        assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(normals)), abs=1e-12)
        inside = state.velocity if bound.of == "velocity" else np.zeros(d)
        left = ROUND.get((type(bound), d), 1.0)
        for direction in np.random.default_rng(seed).normal(size=(20, d)):
            direction /= np.linalg.norm(direction)
            true = reach(lambda x: out_of_bound(bound, state.velocity, x[None])[0], direction, inside)  # noqa: B023
            found = reach(lambda x: (normals @ x - offsets).max(), direction, inside)  # noqa: B023
            assert found <= true + 1e-9
            if true < 999.0 and type(bound) is not HeadingCone:
                assert found >= left * true - 1e-9


def test_a_cone_in_space_keeps_its_share_of_the_tangent() -> None:
    state, bound = State((0, 0, 0), (0, 0, 2)), HeadingCone(0.7)
    normals, offsets = bound.half_spaces(state)
    for angle in np.linspace(0.0, 2.0 * np.pi, 50):
        side = np.array([np.cos(angle), np.sin(angle), 0.0])
        wide = reach(lambda x: (normals @ x - offsets).max(), side, np.array([0.0, 0.0, 1.0]))
        assert ROUND[HeadingCone, 3] * np.tan(0.7) - 1e-9 <= wide <= np.tan(0.7) + 1e-9


@each_kind
def test_going_on_and_braking_are_allowed(kind: str, d: int) -> None:
    """No acceleration, the present velocity, and braking as hard as `braking` says: in motion and at rest."""
    for seed in range(50):
        bound, moving = drawn(kind, d, seed)
        limits = Limits(100.0, 100.0, bounds=(bound,))
        for state in (moving, State(moving.position, 0.0 * moving.velocity)):
            assert limits.allows(state, np.zeros(d), PERIOD)
        if bound.of == "acceleration":
            back = -moving.velocity / np.linalg.norm(moving.velocity)
            assert limits.allows(moving, min(bound.braking, 100.0) * back, PERIOD)
            if np.isfinite(bound.braking) and not (isinstance(bound, ConvexPolygon | Box) and bound.frame == "world"):
                assert not limits.allows(moving, 1.3 * bound.braking * back, PERIOD)


@pytest.mark.parametrize("kind", BOUNDS)
def test_a_turned_robot_has_the_turned_set(kind: str) -> None:
    """In the plane; what is in the frame of the world stays."""
    for seed in range(20):
        bound, state = drawn(kind, 2, seed)
        angle = np.random.default_rng(seed).uniform(0.0, 6.0)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        other = State(state.position, turn @ state.velocity)
        moves = np.eye(2) if getattr(bound, "frame", "body") == "world" else turn
        (normals, offsets), (turned, same) = bound.half_spaces(state), bound.half_spaces(other)
        np.testing.assert_allclose(turned, normals @ moves.T, atol=1e-12)
        np.testing.assert_allclose(same, offsets, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_at_rest_without_a_heading_every_heading_counts(d: int) -> None:
    """What is allowed then is allowed for each; with a heading it is as for a robot that faces there."""
    still, bounds = State(np.zeros(d), np.zeros(d)), [Friction(3.0, 1.5, 2.0)]
    if d == 2:
        bounds += [Box((1.0, 2.0), "body"), ConvexPolygon(((2, 0), (0, 1), (-3, 0), (0, -1)), "body")]
    rng = np.random.default_rng(0)
    for bound in bounds:
        normals, offsets = bound.half_spaces(still)
        for _ in range(200):
            facing, acceleration = rng.normal(size=(2, d))
            acceleration *= rng.uniform(0.0, 3.0) / np.linalg.norm(acceleration)
            if np.all(normals @ acceleration <= offsets):
                assert out_of_bound(bound, facing, acceleration[None])[0] <= 1e-12
    for bound in (HeadingCone(0.3), TurningRadius(2.0), LeastSpeed(1.0)):
        assert len(bound.half_spaces(still)[1]) == 0
    facing = rng.normal(size=d)
    parked, rolling = Friction(3.0, 1.5, 2.0, heading=facing), State(np.zeros(d), facing)
    for one, two in zip(parked.half_spaces(still), parked.half_spaces(rolling)):
        np.testing.assert_allclose(one, two, atol=1e-12)
    # A parked car leaves along its heading only.
    limits = Limits(5.0, 3.0, bounds=(TurningRadius(2.0, heading=facing),))
    assert limits.allows(still, facing / np.linalg.norm(facing), PERIOD)
    assert not limits.allows(still, rng.normal(size=d), PERIOD)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("d", [2, 3])
def test_a_robot_that_is_too_fast_for_its_weak_brakes_has_a_choice(name: str, d: int) -> None:
    """The rule above the speed limit asks for half of what the brakes, not of what the largest acceleration sheds."""
    limits = Limits(2.0, 4.0, bounds=(Friction(4.0, 0.5, 3.0), HeadingCone(0.5)))
    assert limits.braking == 0.5
    state, found = State(np.zeros(d), 3.0 * np.eye(d)[0]), []
    for response in METHODS[name].responses(limits, PERIOD, (0.2, 1.0)):
        empty = control_obstacle(response, state, [], disc_or_ball(0.3, d), horizon=6.0)
        found.append(select(np.zeros(d), limits.admissible(response, state, 6.0), empty).status)
    assert found[0] is not Status.INADMISSIBLE or Status.CONSTRAINED in found


ROAD = {
    "tyres": (Friction(2.0, 3.0, 2.5),),
    "car": (TurningRadius(2.0), HeadingCone(1.0)),
    "box": (Box((1.0, 2.0)), LeastSpeed(0.5)),
    "drone": (Box((1.0, 2.0, 1.5)), LeastSpeed(0.5)),
}


@pytest.mark.parametrize(
    ("what", "d"), [(w, d) for w in ROAD for d in (2, 3) if (w, d) not in {("box", 3), ("drone", 2)}]
)
@pytest.mark.parametrize("method", ["vo", "avo", "nao"])
def test_bounds_are_obeyed_at_every_step_of_a_run(method: str, what: str, d: int) -> None:
    """What is applied is in the set of the state in which it is applied, also while a manoeuvre is kept."""
    rng = np.random.default_rng(5)
    rocks = [np.array([x, *rng.uniform(-1.0, 1.0, d - 1) * (2.5 if d == 2 else 0.6)]) for x in range(6, 26, 4)]
    others = tuple(Obstacle(disc_or_ball(0.7, d), Stationary(position)) for position in rocks)
    limits = Limits(4.0, 3.0, bounds=ROAD[what])
    goal = Goal(Stationary(30.0 * np.eye(d)[0]), 1.0)
    robot = Robot(disc_or_ball(0.4, d), limits, State(np.zeros(d), 2.0 * np.eye(d)[0]), goal)
    recording = simulate(Scenario("road", (robot,), others, duration=6.0), METHODS[method])
    turned, sideways, count = recording.velocities[:-1, 0], 0.0, 0
    for k, ((outcome,), acceleration) in enumerate(zip(recording.outcomes, recording.accelerations[:, 0])):
        if outcome in ("IMPACT", "INADMISSIBLE", "ESCAPING"):
            break  # these may be compromises
        count += 1
        for bound in limits.bounds:
            bounded = acceleration if bound.of == "acceleration" else recording.velocities[k + 1, 0]
            assert out_of_bound(bound, turned[k], bounded[None])[0] <= 1e-6, (bound, k)
        sideways = max(sideways, float(np.abs(turned[k][1:]).max()))
    assert count > 20
    assert sideways > 0.05
