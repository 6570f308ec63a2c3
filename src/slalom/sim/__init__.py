"""Scenarios, the loop over time, recordings, metrics and studies."""

from slalom.sim import gallery, metrics
from slalom.sim.recording import Recording
from slalom.sim.scenario import Robot, Scenario
from slalom.sim.scenario_file import read_scenario
from slalom.sim.simulate import decision_at, simulate
from slalom.sim.study import compare, load

__all__ = [
    "Recording",
    "Robot",
    "Scenario",
    "compare",
    "decision_at",
    "gallery",
    "load",
    "metrics",
    "read_scenario",
    "simulate",
]
