"""Planning problems of CommonRoad solved by `nao`, judged by the drivability checker: a table of docs/commonroad.md.

usage: python benchmarks/road_problems.py FILE.xml ... [--model PM] [--quick] [--out FOLDER]

A motion is valid if it starts in the initial state, is feasible, meets no obstacle and no border, and reaches the goal.
The goal is judged by `in_goal`, since commonroad-io takes a wrong orientation of states of a point mass.
"""

import time
import warnings
from math import remainder, tau
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from program import finish, options, table, target


def judged(file: Path, model: str) -> list[Any]:
    """The row of a file: its goals, steps, whether the goal is reached, contacts, validity, safety, and seconds."""
    from commonroad.common.file_reader import CommonRoadFileReader
    from commonroad.common.solution import CommonRoadSolutionReader
    from commonroad.prediction.prediction import TrajectoryPrediction
    from commonroad_dc.boundary import boundary
    from commonroad_dc.collision.collision_detection.pycrcc_collision_dispatch import create_collision_object
    from commonroad_dc.feasibility import solution_checker
    from commonroad_dc.feasibility.vehicle_dynamics import VehicleDynamics

    from slalom.adapters.commonroad import in_goal, solution, solve, write

    scenario, problems = CommonRoadFileReader(str(file)).open()
    problem = next(iter(problems.planning_problem_dict.values()))
    # The checker compares the first orientation without regard to full turns, which a point mass cannot have.
    problem.initial_state.orientation = remainder(problem.initial_state.orientation, tau)
    goals = {type(g.position).__name__ if g.has_value("position") else "none" for g in problem.goal.state_list}
    begin = time.process_time()
    motion = solve(scenario, problem, model)
    seconds = time.process_time() - begin
    with TemporaryDirectory() as folder:
        made = CommonRoadSolutionReader.open(str(write(solution(scenario, problem, motion), Path(folder), "s.xml")))
    one = made.planning_problem_solutions[0]
    states = one.trajectory.state_list
    shape = VehicleDynamics.from_model(one.vehicle_model, one.vehicle_type).shape
    car = create_collision_object(TrajectoryPrediction(one.trajectory, shape))
    border = boundary.create_road_boundary_obstacle(scenario, "obb_rectangles", return_scenario_obstacle=False)
    try:
        clear = not solution_checker.obstacle_collision(scenario, problems, made)
    except solution_checker.CollisionException:
        clear = False
    on_road = not border.collide(car)
    feasible = all(found[0] for found in solution_checker.solution_feasible(made, scenario.dt, problems).values())
    if model == "PM":
        goal = any(in_goal(problem, s.position, np.array([s.velocity, s.velocity_y]), s.time_step) for s in states)
    else:
        goal = bool(solution_checker.goal_reached(scenario, problems, made))
    starts = solution_checker.starts_at_correct_state(made, problems)
    valid = clear and on_road and feasible and goal and starts
    name = {"ShapeGroup": "lanelets", "none": "no position"}.get(goals.pop(), "area")
    row = [file.stem, name, len(motion.steps) - 1, goal, clear, on_road, feasible, valid, motion.safe]
    return [*(("no", "yes")[cell] if isinstance(cell, bool) else cell for cell in row), round(seconds, 1)]


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--model", default="PM")
    arguments = parser.parse_args()
    warnings.filterwarnings("ignore")
    rows = [judged(file, arguments.model) for file in sorted(arguments.files)[: 1 if arguments.quick else None]]
    heads = ["problem", "goal", "steps", "reached", "no collision", "on the road", "feasible", "valid", "safe", "CPU s"]
    wrong = sum(row[-2] == "yes" and "no" in row[4:6] for row in rows)
    result = {
        "tables": [table(f"model {arguments.model}", heads, rows)],
        "targets": [
            target("valid motions", sum(row[-3] == "yes" for row in rows), least=14),
            target("safe motions that meet something or leave the road", wrong, most=0),
        ],
    }
    for row in [heads, ["---"] * len(heads), *rows]:
        print("|", " | ".join(map(str, row)), "|")
    finish("road_problems", result, arguments, ["commonroad-io", "commonroad-drivability-checker"])


if __name__ == "__main__":
    main()
