"""What a response costs at least (`kernels.costs`): no admissible control costs less, by sampling; and it is no idle
bound: whole decisions are spared by it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_windows import CREWS, crew_state, started

from slalom.kernels.arrival import earliest_arrival, no_sooner
from slalom.kernels.costs import cost_of, least_cost
from slalom.kernels.fleet import course, in_reach
from slalom.kernels.wish import time_to_stop

COORDINATES = st.floats(-40.0, 40.0)


@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize(("name", "scenario", "settings"), CREWS)
def test_nothing_admissible_costs_less(name, scenario, settings, stop):
    """And the control that is farthest towards the goal costs hardly more, where nothing is in the way."""
    crew, rng = started(name, scenario, settings), np.random.default_rng(1)
    some, terms = crew.looked
    fleet, answers, world, d = crew.fleet, crew.answers, crew._world(0.0), crew.scenario.dimension
    fleet.halt[:] = stop
    p, u, spare = fleet.points.shape[1], np.zeros(3), []
    begin, points = np.empty(p + 1), np.empty((p, 4, 3))
    everybody, nobody = np.arange(len(fleet.radius)), np.empty(0, np.int64)
    for i in some[:6]:
        limits, state = crew.scenario.robots[i].limits, crew_state(crew, i)
        near = in_reach(i, np.delete(everybody, i), fleet, terms)
        for r, response in enumerate(crew.method.responses(limits, crew.period, crew.scenario.holds)):
            until = max(terms.period, answers.settled[r])
            least = least_cost(i, r, until, fleet, answers, terms)
            admissible = limits.admissible(response, state, terms.horizon)
            tried = admissible.centers[0] + rng.uniform(-1, 1, (60, d)) * admissible.radii[0]
            ahead = fleet.target[i, :d] - fleet.position[i, :d]
            tried = np.vstack([tried, admissible.centers + np.outer(admissible.radii, ahead / np.linalg.norm(ahead))])
            for control in tried[admissible.contains(tried)]:
                u[:d] = control
                course(i, r, u, fleet, answers, terms, begin, points)
                goal, tolerance = fleet.target[i], fleet.near[i]
                for who in (near, nobody):
                    cost = cost_of(i, until, goal, stop, tolerance, begin, points, who, fleet, world, terms)
                    assert cost >= least
                spare.append(cost / least - 1.0 if least else np.inf)
    assert min(spare) < 0.05


@given(
    away=st.tuples(COORDINATES, COORDINATES),
    velocity=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    push=st.floats(0.2, 5.0),
    top=st.floats(0.5, 5.0),
)
def test_nobody_is_sooner_ahead_than_straight_on(away, velocity, push, top):
    """The earliest arrival in the plane takes no less than the same way along a line."""
    place, v = np.array(away), np.array(velocity)
    distance = float(np.linalg.norm(place))
    if distance <= 0.25:
        return
    fast = max(top, float(np.linalg.norm(v)))
    bound = no_sooner(distance - 0.25, float(v @ place) / distance, push, fast * (1.0 + 1e-9))
    assert bound * (1.0 - 1e-9) <= earliest_arrival(place, v, push, top, 0.25)


@given(distance=st.floats(0.0, 50.0), more=st.floats(0.0, 10.0), push=st.floats(0.2, 5.0), top=st.floats(0.5, 5.0))
def test_stopping_farther_away_takes_longer(distance, more, push, top):
    """What the bound of a robot that stops at its goal relies on."""
    assert time_to_stop(distance + more, 0.0, push, top) >= time_to_stop(distance, 0.0, push, top) * (1.0 - 1e-12)
