"""Solution files of CommonRoad, written by commonroad-io."""

from pathlib import Path
from typing import Any

from slalom.adapters.commonroad.scene import Motion


def solution(scenario: Any, problem: Any, motion: Motion) -> Any:
    """Solution of commonroad-io with the model of the motion, for `CommonRoadSolutionWriter` and the checker."""
    from commonroad.common import solution as kinds
    from commonroad.scenario.trajectory import Trajectory

    one = kinds.PlanningProblemSolution(
        planning_problem_id=problem.planning_problem_id,
        vehicle_type=kinds.VehicleType.BMW_320i,
        vehicle_model=kinds.VehicleModel[motion.model],
        cost_function=kinds.CostFunction.WX1,
        trajectory=Trajectory(int(motion.steps[0]), STATES[motion.model](motion)),
    )
    return kinds.Solution(scenario.scenario_id, [one])


def write(made: Any, folder: Path, name: str) -> Path:
    """Write a solution into `folder`, and return its file."""
    from commonroad.common.solution import CommonRoadSolutionWriter

    CommonRoadSolutionWriter(made).write_to_file(str(folder), name, overwrite=True)
    return folder / name


def _pm_states(motion: Motion) -> list[Any]:
    from commonroad.scenario.state import PMState

    rows = zip(motion.steps.tolist(), motion.positions, motion.velocities.tolist())
    return [PMState(int(k), position=p, velocity=v[0], velocity_y=v[1]) for k, p, v in rows]


def _ks_states(motion: Motion) -> list[Any]:
    from commonroad.scenario.state import KSState

    speeds = (motion.velocities**2).sum(axis=1) ** 0.5
    rows = zip(motion.steps.tolist(), motion.positions, speeds.tolist(), motion.headings, motion.steering)
    return [
        KSState(int(k), position=p, velocity=v, orientation=float(a), steering_angle=float(d)) for k, p, v, a, d in rows
    ]


STATES = {"PM": _pm_states, "KS": _ks_states}
"""States of a motion by the name of its model."""
