"""Leaders that may brake: a robot that follows one is ready for the hardest braking."""

import numpy as np
import pytest
from draws import draws

from slalom import Disc, Goal, Limits, Navigator, Obstacle, Polyline, State, Stationary, Tracks, method

LIMITS = Limits(3.0, 2.0)
BEHIND = State((0.0, 0.0), (2.0, 0.3))


def bezier(points: np.ndarray, x: float) -> np.ndarray:
    """The point at share x of a cubic with control points (4, d)."""
    return np.array([(1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x * x * (1 - x), x**3]) @ points


def followed(rng: np.random.Generator) -> Tracks:
    """A leader ahead of the robot, in its direction."""
    speed, angle, course = rng.uniform(0.2, 3.0), rng.uniform(-0.4, 0.4), np.arctan2(0.3, 2.0)
    velocity = speed * np.array([np.cos(course + angle), np.sin(course + angle)])
    ahead, beside = rng.uniform(1.0, 6.0), rng.uniform(-0.39, 0.39)
    place = (ahead * np.cos(course) - beside * np.sin(course), ahead * np.sin(course) + beside * np.cos(course))
    return Tracks([place], [velocity], rng.uniform(0.1, 0.6), 1.0)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("later", [0.0, 0.3])
def test_its_body_covers_all_places_up_to_the_hardest_braking(seed: int, later: float) -> None:
    """At every time, for every deceleration from 0 to the hardest; the window may begin after the observation."""
    rng = np.random.default_rng(seed)
    tracks, start = followed(rng), 1.0 + later
    bodies = tracks.followed_by(Disc(0.3), BEHIND, LIMITS).bodies(Disc(0.3), start, np.array([5.0]), 5.0)
    place, velocity, _ = tracks.states[0]
    speed = float(np.linalg.norm(velocity))
    assert bodies.radius[0] == pytest.approx(tracks.radii[0] + 0.3)
    for t in rng.uniform(0.0, 5.0, 40):
        k = int(np.searchsorted(bodies.pieces.times[:, 1], t))
        begin, end = bodies.pieces.times[k]
        x = (t - begin) / (end - begin)
        origin, course = bezier(bodies.pieces.points[k], x), bezier(bodies.pieces.turns[k], x)
        ends = [
            origin + c[0] * course + c[1] * np.array([-course[1], course[0]]) for c in bodies.corners.corners[:, 3:]
        ]
        for braking in rng.uniform(0.0, LIMITS.braking, 5):
            elapsed = min(t + later, speed / braking)
            at = place + velocity / speed * (speed - 0.5 * braking * elapsed) * elapsed
            way = ends[1] - ends[0]
            share = np.clip((at - ends[0]) @ way / (way @ way), 0.0, 1.0)
            assert np.linalg.norm(ends[0] + share * way - at) <= bodies.pieces.radius[k] + 1e-9


@pytest.mark.parametrize(
    ("place", "velocity"),
    [
        ((3.0, 0.5), (-1.0, 0.0)),
        ((3.0, 0.5), (0.0, 1.0)),
        ((-2.0, -0.3), (2.0, 0.0)),
        ((3.0, 0.5), (0.0, 0.0)),
        ((3.0, 1.1), (1.0, 0.0)),
        ((3.0, 0.5), (1.0, 0.8)),
    ],
)
def test_others_than_leaders_keep_to_the_prediction(place: tuple[float, float], velocity: tuple[float, float]) -> None:
    """Of those that come towards the robot, cross its way, follow it, rest, or move beside it no body is larger."""
    tracks = Tracks([place], [velocity], 0.3)
    assert tracks.followed_by(Disc(0.3), BEHIND, LIMITS) is tracks


def test_without_braking_the_prediction_holds() -> None:
    tracks = Tracks([(3.0, 0.0)], [(1.0, 0.0)], 0.3, braking=0.0)
    assert tracks.followed_by(Disc(0.3), BEHIND, LIMITS) is tracks
    assert Tracks([(3.0, 0.0, 0.0)], [(1.0, 0.0, 0.0)], 0.3).dimension == 3


@pytest.mark.parametrize("seed", draws(range(12), first=3))
def test_a_leader_that_brakes_is_not_hit(seed: int) -> None:
    """It brakes, in parts and up to as hard as the robot, in a lane that leaves no way around it. Before, none lags."""
    rng = np.random.default_rng(seed)
    period, top = 0.1, rng.choice([1.5, 8.0, 20.0])
    limits = Limits(1.1 * top, top * rng.uniform(0.25, 0.8))
    robot = Navigator(method("nao"), Disc(0.5), limits, period=period, margin=0.05)
    lane = [Obstacle(Polyline([(-50, y), (2000, y)]), Stationary((0, 0)), f"border {y}") for y in (-1.0, 1.0)]
    leader, speed = 1.0 + top * rng.uniform(0.4, 2.0), top
    place, velocity, decision = np.zeros(2), np.array([top, 0.0]), None
    for k in range(round(10.0 / period)):
        seen = [*lane, Tracks([(leader, 0.0)], [(speed, 0.0)], 0.5, period * k)]
        state = State(place, velocity)
        decision = robot.decide(state, seen, Goal(Stationary((1900, 0)), 1.0), now=period * k, previous=decision)
        assert decision.safe
        push = decision.manoeuvre.mean_acceleration(period * k, period)
        slower = max(speed - period * (limits.braking * rng.uniform(0.0, 1.0) if 15 < k < 60 else 0.0), 0.0)
        place, velocity = place + period * velocity + 0.5 * period**2 * push, velocity + period * push
        leader, speed = leader + 0.5 * period * (speed + slower), slower
        assert np.hypot(leader - place[0], place[1]) >= 1.0
        assert k > 15 or velocity[0] >= 0.9 * top
