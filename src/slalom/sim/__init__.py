"""Scenarios, the loop over time, recordings, metrics and studies."""

from typing import TYPE_CHECKING

from slalom.late import offer

if TYPE_CHECKING:
    from slalom.sim import gallery, metrics
    from slalom.sim.case import load
    from slalom.sim.ending import Ending
    from slalom.sim.recording import Recording
    from slalom.sim.scenario import Robot, Scenario
    from slalom.sim.scenario_file import read_scenario
    from slalom.sim.simulate import decision_at, simulate
    from slalom.sim.study import Row, compare, compare_all
    from slalom.sim.study_file import read_study

__all__ = [
    "Ending",
    "Recording",
    "Robot",
    "Row",
    "Scenario",
    "compare",
    "compare_all",
    "decision_at",
    "gallery",
    "load",
    "metrics",
    "read_scenario",
    "read_study",
    "simulate",
]

offer(
    __name__,
    {
        "case": ("load",),
        "ending": ("Ending",),
        "recording": ("Recording",),
        "scenario": ("Robot", "Scenario"),
        "scenario_file": ("read_scenario",),
        "simulate": ("decision_at", "simulate"),
        "study": ("Row", "compare", "compare_all"),
        "study_file": ("read_study",),
    },
)
