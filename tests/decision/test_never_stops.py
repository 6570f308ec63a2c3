"""Robots that must not stop reach goals of any position, on ways that are about as short as Dubins paths."""

from math import cos, hypot, inf, pi, sin

import numpy as np
import pytest

import slalom

BOUNDS = {
    "least": (slalom.LeastSpeed(18.0),),
    "aircraft": (slalom.LeastSpeed(18.0), slalom.TurningRadius(60.0)),
    "ship": (slalom.LeastSpeed(18.0), slalom.Friction(4.0, 4.0, 6.0)),
    "all": (slalom.LeastSpeed(15.0), slalom.TurningRadius(70.0), slalom.Friction(3.0, 3.0, 6.0)),
}
LIMITS = {name: slalom.Limits(25.0, 6.0, bounds=bounds) for name, bounds in BOUNDS.items()}
TOLERANCE = 5.0
PERIOD = 0.2


def shortest(x: float, y: float, r: float) -> float:
    """Length [m] of the shortest path of least radius r [m] from the origin, along x, to TOLERANCE of (x, y).

    By trial: a turn by each of 20 000 angles, then straight on or on a circle to the other side.
    """
    angle = np.linspace(0.0, 2.0 * pi, 20001)
    best = inf
    for side in (1.0, -1.0):
        heading = np.stack([np.cos(angle), side * np.sin(angle)], axis=1)
        left = np.stack([-heading[:, 1], heading[:, 0]], axis=1)
        away = np.array([x, y]) - r * np.stack([np.sin(angle), side * (1.0 - np.cos(angle))], axis=1)
        ahead, across = (away * heading).sum(axis=1), side * (away * left).sum(axis=1)
        passes = (np.abs(across) <= TOLERANCE) & (ahead >= 0.0)
        best = min(best, (r * angle + ahead)[passes].min(initial=inf))
        # A turn to the other side, about the place r from here: 0 where the goal is beside the robot, at its begin.
        turned = np.arctan2(ahead, across + r) % (2.0 * pi)
        meets = np.abs(np.hypot(ahead, across + r) - r) <= TOLERANCE
        best = min(best, (r * (angle + turned))[meets].min(initial=inf))
    return best


def drive(name: str, kind: str, speed: float, place: tuple[float, float], longest: float) -> float:
    """The length [m] of the way on which a robot passes a goal, from the origin along x; inf if above `longest`."""
    robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(2.0), LIMITS[name], horizon=10.0, period=PERIOD)
    decider = robot if kind == "nao" else slalom.LookAhead(robot)
    goal = slalom.Goal(slalom.Stationary(place), TOLERANCE)
    p, v, previous, way, t = np.zeros(2), np.array([speed, 0.0]), None, 0.0, 0.0
    while way <= longest:
        previous = decider.decide(slalom.State(p, v), [], goal, now=t, previous=previous)
        a = previous.manoeuvre.mean_acceleration(t, PERIOD)
        way += PERIOD * hypot(*(v + 0.5 * PERIOD * a))
        if goal.reached_during(p, v, a, t, PERIOD):
            return way
        p, v, t = p + PERIOD * (v + 0.5 * PERIOD * a), v + PERIOD * a, t + PERIOD
    return inf


def places(seed: int, r: float) -> list[tuple[float, float]]:
    """Goals straight behind, in the middle of and on the turning circle of radius r [m], and of any direction."""
    rng = np.random.default_rng(seed)
    drawn = zip(r * rng.uniform(0.1, 5.0, 5), rng.uniform(-pi, pi, 5))
    fixed = [(-r, 0.0), (-5.0 * r, 0.0), (0.0, r), (0.0, -2.0 * r), (0.2 * r, -0.2 * r)]
    return fixed + [(d * cos(angle), d * sin(angle)) for d, angle in drawn]


@pytest.mark.parametrize("name", BOUNDS)
@pytest.mark.parametrize("kind", ["nao", "nao_ahead"])
@pytest.mark.parametrize("seed", [1000, 1001])
def test_robots_that_must_not_stop_reach_goals_on_short_ways(name, kind, seed) -> None:
    speed = float(np.random.default_rng(seed).uniform(LIMITS[name].bounds[0].least, 25.0))
    r = speed / LIMITS[name].turn_rate(LIMITS[name].bounds[0].least)
    for place in places(seed, r):
        longest = 1.3 * shortest(*place, r) + PERIOD * speed
        assert drive(name, kind, speed, place, longest) < inf, place
