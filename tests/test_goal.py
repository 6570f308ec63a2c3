"""Arrival at a goal: estimates against motions that no robot can beat."""

import numpy as np
from hypothesis import given, strategies as st

from slalom import Goal, Limits, Stationary

COORDINATES = st.floats(-40.0, 40.0)


@given(
    place=st.tuples(COORDINATES, COORDINATES),
    velocity=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    max_acceleration=st.floats(0.2, 5.0),
    max_speed=st.floats(0.5, 5.0),
    tolerance=st.floats(0.1, 1.0),
)
def test_no_arrival_is_sooner_than_full_acceleration_along_the_line(
    place: tuple[float, float],
    velocity: tuple[float, float],
    max_acceleration: float,
    max_speed: float,
    tolerance: float,
) -> None:
    """The component of the motion towards the goal is that of a robot on a line."""
    position, v = np.array(place), np.array(velocity)
    distance = float(np.linalg.norm(position)) - tolerance
    if distance <= 0.0:
        return
    towards = -float(v @ position) / float(np.linalg.norm(position))
    fast = max(max_speed, float(np.linalg.norm(v)))
    until_fast = (fast - towards) / max_acceleration
    covered = 0.5 * (fast + towards) * until_fast
    if covered < distance:
        soonest = until_fast + (distance - covered) / fast
    else:
        soonest = (np.sqrt(towards**2 + 2.0 * max_acceleration * distance) - towards) / max_acceleration
    goal = Goal(Stationary((0.0, 0.0)), tolerance)
    assert goal.time_to_go(position, v, 0.0, Limits(max_speed, max_acceleration)) >= soonest * (1.0 - 1e-9)
