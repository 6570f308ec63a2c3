"""Passive safety of a navigator: nothing touches it as long as it moves, within the stated sets."""

import numpy as np
import pytest
from draws import draws

from slalom import (
    BoundedError,
    Disc,
    Goal,
    Limits,
    Navigator,
    State,
    Stationary,
    Tracks,
    method,
)

RADIUS, FASTER = 0.3, 0.2
PASSIVE = Navigator(
    *(method("nao").stopping(), Disc(RADIUS), Limits(1.2, 1.0)), period=0.2, horizon=4.0, contact_at_rest=False
)
GOAL = Goal(Stationary((9.0, 0.0)), 0.3)


@pytest.mark.parametrize("seed", draws(range(12), 4))
def test_no_person_touches_it_while_it_moves(seed):
    """Whatever people do within the bound of their velocities, once every decision was safe."""
    rng = np.random.default_rng(seed)
    state, decision, safe = State((0.0, 0.0), (0.0, 0.0)), None, True
    places = rng.uniform((2.0, -3.0), (8.0, 3.0), (5, 2))
    velocities = rng.uniform(-0.8, 0.8, (5, 2))
    for k in range(60):
        tracks = Tracks(places, velocities, RADIUS, 0.2 * k, uncertainty=BoundedError(0.0, FASTER))
        decision = PASSIVE.decide(state, [tracks], GOAL, now=0.2 * k, previous=decision)
        safe = safe and decision.safe
        angles, errors = rng.uniform(0.0, 2.0 * np.pi, 5), FASTER * rng.uniform(0.0, 1.0, 5)
        velocities = velocities + errors[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        for since in np.linspace(0.0, 0.2, 5):
            place, speed = decision.manoeuvre.position(0.2 * k + since), decision.manoeuvre.velocity(0.2 * k + since)
            gaps = np.linalg.norm(places + since * velocities - place, axis=1) - 2.0 * RADIUS
            assert gaps.min() > -1e-6 or np.linalg.norm(speed) < 1e-6 or not safe
        state = State(decision.manoeuvre.position(0.2 * k + 0.2), decision.manoeuvre.velocity(0.2 * k + 0.2))
        places = places + 0.2 * velocities
    assert state.position[0] > 2.0


def test_it_may_stay_where_a_person_will_walk_into_it():
    """A robot at rest between walls of people; where contacts at rest count, nothing is safe."""
    angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ring = Tracks(2.0 * ways, -0.8 * ways, RADIUS)
    rest, stay = State((0.0, 0.0), (0.0, 0.0)), Goal(Stationary((0.0, 0.0)), 0.3)
    assert PASSIVE.decide(rest, [ring], stay).safe
    assert not Navigator(PASSIVE.method, Disc(RADIUS), PASSIVE.limits, horizon=4.0).decide(rest, [ring], stay).safe
