"""Who is left out by `kernels.windows` could not have been met: against all that robots may do, by sampling."""

import numpy as np
import pytest

from slalom import METHODS, State, kernels
from slalom.kernels.decision.encounters import in_reach, state_on_path
from slalom.kernels.decision.neighbours import neighbours_in_cells, reachable_balls, reachable_neighbours
from slalom.kernels.decision.tables import WINDOWS
from slalom.sim import gallery
from slalom.sim.run.fleet_decider import FleetDecider
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.robot_states import RobotStates


class Watched(FleetDecider):
    """A crew that keeps what it looked at."""

    def _turns(self, due, terms):
        for some, usual in super()._turns(due, terms):
            self.looked = some, usual
            yield some, usual


CREWS = [
    pytest.param(name, scenario, settings, id=f"{name}-{scenario}")
    for name in ("nao", "nao_shared", "vo", "rvo", "ao")
    for scenario, settings in (("random_goals", {"robots": 40, "side": 90}), ("circle", {"robots": 12}))
]


def started(name, scenario, settings):
    """A crew on the move, and what it knew at its last decision, with the robots at the places of that time."""
    built = gallery.build(scenario, settings, seed=5)
    guidance = Guidance(RobotStates(built))
    crew = Watched(METHODS[name].among_robots(), guidance, threads=1)
    for step in range(8):
        now = step * built.dt
        guidance.update(now, built.dt)
        crew.sense(now)
        crew.decide(range(len(built.robots)), now)
        if step < 7:
            guidance.states.integrate(crew.accelerations(now, built.dt), built.dt)
    return crew


@pytest.mark.parametrize(("name", "scenario", "settings"), CREWS)
def test_balls_hold_all_that_a_robot_may_do(name, scenario, settings):
    crew, rng = started(name, scenario, settings), np.random.default_rng(0)
    some, terms = crew.looked
    fleet, answers, d = crew.fleet, crew.responses, crew.scenario.dimension
    middle, spread = np.empty((WINDOWS, 3)), np.empty(WINDOWS)
    navigator = crew.scenario.navigator(crew.method, 0)
    for i in some[:6]:
        reachable_balls(i, fleet, answers, terms, middle, spread)
        state = crew_state(crew, i)
        responses = crew.method.responses(crew.scenario.robots[i].limits, crew.period, crew.scenario.holds)
        for r, response in enumerate(responses):
            admissible = navigator.limits.admissible(response, state, terms.horizon)
            tried = admissible.centers[0] + rng.uniform(-1, 1, (400, d)) * admissible.radii[0]
            tried = tried[admissible.contains(tried)]
            assert len(tried)
            own = state.velocity if answers.settled_velocity[r, 0] == 0.0 else state.acceleration
            for share in {1.0, terms.share}:
                for t in rng.uniform(0.0, terms.horizon, 20):
                    places = response.position(state, t)(own + (tried - own) / share)
                    w = min(int(t / terms.horizon * WINDOWS), WINDOWS - 1)
                    away = np.linalg.norm(places - middle[w, :d], axis=1)
                    assert away.max() <= spread[w] + 1e-9


def crew_state(crew, i):
    d, fleet = crew.scenario.dimension, crew.fleet
    return State(fleet.position[i, :d], fleet.velocity[i, :d], fleet.acceleration[i, :d])


@pytest.mark.parametrize(("name", "scenario", "settings"), CREWS)
def test_who_is_left_out_stays_away(name, scenario, settings):
    """Whoever is not met is out of reach of the robot's ball in every window; and cells leave out nobody else."""
    crew = started(name, scenario, settings)
    some, terms = crew.looked
    fleet, answers = crew.fleet, crew.responses
    seen = kernels.build_cell_list(some, fleet, answers, terms)
    place, speed, left = np.empty(3), np.empty(3), 0
    for i in some:
        everybody = np.delete(np.arange(len(fleet.radius)), i)
        near = in_reach(i, everybody, fleet, terms)
        np.testing.assert_array_equal(np.sort(in_reach(i, neighbours_in_cells(i, fleet, seen), fleet, terms)), near)
        balls = seen.reachable_centers[i], seen.reachable_radii[i]
        met = np.sort(reachable_neighbours(i, neighbours_in_cells(i, fleet, seen), *balls, fleet, terms))
        np.testing.assert_array_equal(reachable_neighbours(i, everybody, *balls, fleet, terms), met)
        middle, spread = seen.reachable_centers[i], seen.reachable_radii[i]
        for k in np.setdiff1d(everybody, met):
            left += 1
            touch = fleet.radius[i] + fleet.radius[k] + terms.margin
            for t in np.linspace(0.0, terms.horizon, 61):
                state_on_path(fleet.observed_times, fleet.observed_points, k, terms.now + t, place, speed)
                for w in range(WINDOWS):
                    if w <= t / terms.horizon * WINDOWS <= w + 1:
                        assert np.linalg.norm(place - middle[w]) > touch + spread[w]
    assert left
