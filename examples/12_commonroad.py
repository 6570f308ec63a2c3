"""A planning problem of CommonRoad, made with commonroad-io: a car passes one that is parked in its lane."""

from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

if find_spec("commonroad") is None:
    print("This example needs commonroad-io: pip install 'slalom[commonroad]'")
    raise SystemExit

from commonroad.common.util import AngleInterval, Interval
from commonroad.geometry.shape import Rectangle
from commonroad.planning.goal import GoalRegion
from commonroad.planning.planning_problem import PlanningProblem
from commonroad.scenario.lanelet import Lanelet
from commonroad.scenario.obstacle import ObstacleType, StaticObstacle
from commonroad.scenario.scenario import Scenario, ScenarioID
from commonroad.scenario.state import CustomState, InitialState

from slalom.adapters.commonroad import solution, solve, write

scenario = Scenario(0.1, ScenarioID.from_benchmark_id("ZAM_Slalom-2_1_T-1", "2020a"))
x = np.linspace(-10.0, 120.0, 14)
left, middle, right = (np.stack([x, np.full_like(x, y)], axis=1) for y in (3.5, 0.0, -3.5))
scenario.add_objects(Lanelet(left, middle, right, 1))
parked = InitialState(position=np.array([45.0, -2.0]), orientation=0.0, velocity=0.0, time_step=0)
scenario.add_objects(StaticObstacle(11, ObstacleType.PARKED_VEHICLE, Rectangle(4.5, 1.8), parked))
start = InitialState(
    position=np.array([0.0, -1.75]), orientation=0.0, velocity=10.0, time_step=0, yaw_rate=0.0, slip_angle=0.0
)
goal = CustomState(
    time_step=Interval(80, 120),
    position=Rectangle(6.0, 3.0, np.array([90.0, -1.75])),
    orientation=AngleInterval(-0.2, 0.2),
)
problem = PlanningProblem(7, start, GoalRegion([goal]))
motion = solve(scenario, problem)
with TemporaryDirectory() as folder:
    size = write(solution(scenario, problem, motion), Path(folder), "solution.xml").stat().st_size
steps, reached = len(motion.steps) - 1, "reached" if motion.reached else "not reached"
print(f"goal {reached} after {steps} time steps, safe: {motion.safe}, solution file of {size} bytes")
