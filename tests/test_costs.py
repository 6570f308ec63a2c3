"""What a response promises (`kernels.costs`): what its preferred control costs where nothing is in the way, or less."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from test_windows import CREWS, crew_state, started

from slalom.kernels.decision.encounters import response_path
from slalom.kernels.decision.manoeuvre_cost import manoeuvre_cost, new_scratch, optimistic_cost
from slalom.kernels.decision.time_to_go import earliest_arrival, earliest_on_line
from slalom.tolerances import COST_TIE

COORDINATES = st.floats(-40.0, 40.0)


@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize(("name", "scenario", "settings"), CREWS)
def test_a_promise_is_what_the_preferred_control_costs_alone(name, scenario, settings, stop):
    """Or the one nearest to it of the smallest ball. To pass through a goal no more is promised than that."""
    crew, rng = started(name, scenario, settings), np.random.default_rng(1)
    some, terms = crew.looked
    fleet, answers, world, d = crew.fleet, crew.responses, crew._passive(0.0), crew.scenario.dimension
    world = world._replace(end_positions=world.end_positions[:0], end_radii=world.end_radii[:0])
    fleet.stop[:] = stop
    nobody, draft = np.empty(0, np.int64), new_scratch(fleet.committed_points.shape[1], d)
    begin, points = draft.times.copy(), draft.points.copy()
    for i in some[:6]:
        limits, state = crew.scenario.robots[i].limits, crew_state(crew, i)
        for r, response in enumerate(crew.method.responses(limits, crew.period, crew.scenario.holds)):
            admissible, until = limits.admissible(response, state, terms.horizon), max(terms.period, answers.settled[r])
            for far in (0.5, 1.0, 3.0):
                u, inside = np.zeros(3), np.zeros(3)
                u[:d] = admissible.centers[0] + rng.uniform(-far, far, d) * admissible.radii[0]
                inside[:d] = admissible.toward(u[:d])
                response_path(i, r, inside, fleet, answers, terms, begin, points, 0)
                cost = manoeuvre_cost(i, until, begin, points, 0, nobody, fleet, world, terms, draft)
                promised = optimistic_cost(i, r, until, u, fleet, answers, terms, draft)
                # The estimate of an arrival may exceed the speed limit by half of that share.
                assert promised <= cost * (1.0 + 1e-9)
                assert not stop or promised >= cost - COST_TIE


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
    bound = earliest_on_line(distance - 0.25, float(v @ place) / distance, push, fast * (1.0 + 1e-9))
    assert bound * (1.0 - 1e-9) <= earliest_arrival(place, v, push, top, 0.25)
