"""Fleets on the move, with the tables from which their kernel decided last."""

import pytest

from slalom import METHODS
from slalom.kernels.arrays import Indices
from slalom.kernels.decision.tables import DecisionTables
from slalom.sim import gallery
from slalom.sim.run.fleet_decider import FleetDecider
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.robot_states import RobotStates


class Watched(FleetDecider):
    """A decider of a fleet that keeps the arguments of its last decision."""

    def _turns(self, due, terms):
        for some, settings in super()._turns(due, terms):
            self.last = some, DecisionTables(self.fleet, self._passive(0.0), self.responses, settings)
            yield some, settings


FLEETS = [
    pytest.param(name, scenario, settings, id=f"{name}-{scenario}")
    for name in ("nao", "nao_shared", "vo", "rvo", "ao")
    for scenario, settings in (("random_goals", {"robots": 40, "side": 90}), ("circle", {"robots": 12}))
]


def last_decision(name: str, scenario: str, settings: dict[str, float]) -> tuple[Indices, DecisionTables]:
    """The robots and the tables of the eighth decision of a fleet."""
    built = gallery.build(scenario, settings, seed=5)
    guidance = Guidance(RobotStates(built))
    fleet = Watched(METHODS[name].among_robots(), guidance, threads=1)
    for step in range(8):
        now = step * built.dt
        guidance.update(now, built.dt)
        fleet.sense(now)
        fleet.decide(range(len(built.robots)), now)
        if step < 7:
            guidance.states.integrate(fleet.accelerations(now, built.dt), built.dt)
    return fleet.last
