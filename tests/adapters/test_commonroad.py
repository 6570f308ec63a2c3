"""Planning problems of CommonRoad, judged by its drivability checker."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("commonroad", reason="commonroad-io is not installed: pip install 'slalom[commonroad]'")
pytest.importorskip(
    "commonroad_dc", reason="the drivability checker is not installed: pip install 'slalom[commonroad]'"
)

from commonroad.common.file_reader import CommonRoadFileReader
from commonroad.common.solution import CommonRoadSolutionReader
from commonroad.common.util import AngleInterval, Interval
from commonroad.geometry.shape import Circle, Polygon as CommonRoadPolygon, Rectangle, ShapeGroup
from commonroad.planning.goal import GoalRegion
from commonroad.planning.planning_problem import PlanningProblem, PlanningProblemSet
from commonroad.prediction.prediction import TrajectoryPrediction
from commonroad.scenario.lanelet import Lanelet
from commonroad.scenario.obstacle import DynamicObstacle, EnvironmentObstacle, ObstacleType, StaticObstacle
from commonroad.scenario.scenario import Scenario, ScenarioID
from commonroad.scenario.state import CustomState, InitialState
from commonroad.scenario.trajectory import Trajectory
from commonroad_dc.boundary import boundary
from commonroad_dc.collision.collision_detection.pycrcc_collision_dispatch import (
    create_collision_checker,
    create_collision_object,
)
from commonroad_dc.feasibility import solution_checker
from commonroad_dc.feasibility.vehicle_dynamics import VehicleDynamics
from shapely import Point, Polygon, union_all

from slalom.adapters.commonroad import MODELS, area, in_goal, solution, solve, surroundings, write

pytestmark = [pytest.mark.adapters, pytest.mark.filterwarnings("ignore")]
SHARED = Path(__file__).parents[3] / "shared" / "data" / "vehicles"


def judge(scenario: Scenario, problem: PlanningProblem, folder: Path, model: str) -> Any:
    """Solve, write, read again, and ask the checker: start, obstacles, road, feasibility, goal.

    The checker's own test of the road needs a package that is not free; its oriented rectangles on the border do not.
    Its test of the goal takes a wrong orientation of a point mass: each state is judged with its own orientation.
    """
    motion = solve(scenario, problem, model)
    file = write(solution(scenario, problem, motion), folder, "solution.xml")
    made = CommonRoadSolutionReader.open(str(file))
    problems = PlanningProblemSet([problem])
    states = made.planning_problem_solutions[0].trajectory.state_list
    assert solution_checker.solved_all_problems(problems, made)
    assert solution_checker.starts_at_correct_state(made, problems)
    assert solution_checker.obstacle_collision(scenario, problems, made) is False
    assert all(found[0] for found in solution_checker.solution_feasible(made, scenario.dt, problems).values())
    if model == "PM":
        assert any(in_goal(problem, s.position, np.array([s.velocity, s.velocity_y]), s.time_step) for s in states)
    else:
        assert solution_checker.goal_reached(scenario, problems, made)
    car = create_collision_object(TrajectoryPrediction(made.planning_problem_solutions[0].trajectory, shape_of(made)))
    border = boundary.create_road_boundary_obstacle(scenario, "obb_rectangles", return_scenario_obstacle=False)
    assert not border.collide(car)
    return motion


def shape_of(made: Any) -> Any:
    one = made.planning_problem_solutions[0]
    return VehicleDynamics.from_model(one.vehicle_model, one.vehicle_type).shape


def road(left: float, right: float, number: int) -> Lanelet:
    x = np.linspace(-10.0, 120.0, 14)
    lines = [np.stack([x, np.full_like(x, y)], axis=1) for y in (left, 0.5 * (left + right), right)]
    return Lanelet(lines[0], lines[1], lines[2], number)


def overtaking(model: str = "PM") -> tuple[Scenario, PlanningProblem]:
    """Two lanes; in the other one a slow car comes towards the car, whose own has a parked car and a barrel for PM.

    KS has to turn a little only: a barrel at the side of its lane.
    """
    scenario = Scenario(0.1, ScenarioID.from_benchmark_id("ZAM_Slalom-1_1_T-1", "2020a"))
    scenario.add_objects([road(3.5, 0.0, 1), road(0.0, -3.5, 2)])
    parked = InitialState(position=np.array([45.0, -2.0]), orientation=0.0, velocity=0.0, time_step=0)
    barrel = InitialState(position=np.array([70.0, -2.9]), orientation=0.0, velocity=0.0, time_step=0)
    if model == "PM":
        scenario.add_objects(StaticObstacle(11, ObstacleType.PARKED_VEHICLE, Rectangle(4.5, 1.8), parked))
    scenario.add_objects(StaticObstacle(12, ObstacleType.PILLAR, Circle(0.3), barrel))
    slow = [
        CustomState(time_step=k, position=np.array([112.0 - 0.5 * k, 1.9]), orientation=np.pi, velocity=5.0)
        for k in range(121)
    ]
    first = InitialState(position=slow[0].position, orientation=np.pi, velocity=5.0, time_step=0)
    path = TrajectoryPrediction(Trajectory(1, slow[1:]), Rectangle(4.5, 1.8))
    scenario.add_objects(DynamicObstacle(13, ObstacleType.CAR, Rectangle(4.5, 1.8), first, prediction=path))
    start = InitialState(
        position=np.array([0.0, -1.75]), orientation=0.0, velocity=10.0, time_step=0, yaw_rate=0.0, slip_angle=0.0
    )
    goal = CustomState(
        time_step=Interval(80, 120),
        position=Rectangle(6.0, 3.0, np.array([90.0, -1.75])),
        orientation=AngleInterval(-0.2, 0.2),
        velocity=Interval(4.0, 14.0),
    )
    return scenario, PlanningProblem(7, start, GoalRegion([goal]))


@pytest.mark.parametrize("model", MODELS)
def test_a_scenario_of_our_own_is_solved_and_valid(tmp_path: Path, model: str) -> None:
    motion = judge(*overtaking(model), tmp_path, model)
    assert motion.reached
    assert motion.safe


def test_the_checker_rejects_the_straight_way(tmp_path: Path) -> None:
    """Without the obstacles that it has, the same problem is solved by a motion that collides with them."""
    scenario, problem = overtaking()
    empty = Scenario(0.1, scenario.scenario_id)
    empty.add_objects([road(3.5, 0.0, 1), road(0.0, -3.5, 2)])
    straight = solution(scenario, problem, solve(empty, problem))
    checker = create_collision_checker(scenario)
    car = create_collision_object(
        TrajectoryPrediction(straight.planning_problem_solutions[0].trajectory, shape_of(straight))
    )
    assert checker.collide(car)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["USA_US101-3_1_T-1", "USA_US101-4_1_T-1"])
def test_recorded_traffic_of_a_motorway(tmp_path: Path, name: str, model: str) -> None:
    file = SHARED / f"{name}.xml"
    if not file.exists():
        pytest.skip(f"{file} is not there: the scenarios of CommonRoad are not part of slalom")
    scenario, problems = CommonRoadFileReader(str(file)).open()
    (problem,) = problems.planning_problem_dict.values()
    motion = judge(scenario, problem, tmp_path, model)
    assert motion.safe
    assert motion.reached


def with_goal(goal: CustomState) -> PlanningProblem:
    """The start of `overtaking`, with another goal."""
    return PlanningProblem(7, overtaking()[1].initial_state, GoalRegion([goal], {0: [1]}))


def test_a_goal_that_is_a_lanelet_is_reached_in_the_other_lane(tmp_path: Path) -> None:
    """The way changes lanes: both have the same direction."""
    scenario = Scenario(0.1, ScenarioID.from_benchmark_id("ZAM_Slalom-3_1_T-1", "2020a"))
    left, right = road(3.5, 0.0, 1), road(0.0, -3.5, 2)
    left.adj_right, left.adj_right_same_direction = 2, True
    right.adj_left, right.adj_left_same_direction = 1, True
    scenario.add_objects([left, right])
    lane = CustomState(time_step=Interval(60, 60), position=ShapeGroup([left.polygon]))
    motion = judge(scenario, with_goal(lane), tmp_path, "PM")
    assert motion.safe
    assert motion.positions[-1, 1] > 0.0
    assert motion.steps[-1] == 60


def test_a_goal_without_a_position_is_a_time_to_drive(tmp_path: Path) -> None:
    scenario, _ = overtaking()
    motion = judge(scenario, with_goal(CustomState(time_step=Interval(30, 40))), tmp_path, "PM")
    assert motion.safe
    assert motion.steps[-1] == 30
    assert motion.positions[-1, 0] > 20.0


def test_regions_of_an_uncertain_vehicle_are_avoided(tmp_path: Path) -> None:
    """A vehicle whose positions are known as regions only: the car touches none of its occupied regions."""
    scenario, problem = overtaking("KS")
    states = [
        CustomState(
            time_step=k,
            position=Rectangle(2.0 + 0.02 * k, 0.6, np.array([40.0 + 0.2 * k, -1.9])),
            orientation=AngleInterval(-0.02, 0.02),
        )
        for k in range(1, 121)
    ]
    first = InitialState(position=np.array([40.0, -1.9]), orientation=0.0, velocity=2.0, time_step=0)
    path = TrajectoryPrediction(Trajectory(1, states), Rectangle(4.5, 1.8))
    scenario.add_objects(DynamicObstacle(21, ObstacleType.CAR, Rectangle(4.5, 1.8), first, prediction=path))
    motion = judge(scenario, problem, tmp_path, "PM")
    assert motion.safe
    uncertain = scenario.obstacle_by_id(21)
    for step, position in zip(motion.steps.tolist(), motion.positions):
        assert not area(uncertain.occupancy_at_time(int(step)).shape).contains(Point(position))


def test_groups_and_regions_at_rest_are_obstacles() -> None:
    """A static obstacle of two parts, and one of the environment, lie where commonroad-io says."""
    scenario, _ = overtaking()
    at = InitialState(position=np.array([60.0, 1.0]), orientation=0.5, velocity=0.0, time_step=0)
    parts = ShapeGroup([Rectangle(2.0, 1.0, np.array([1.0, 0.0])), Circle(0.5, np.array([-2.0, 0.0]))])
    scenario.add_objects(StaticObstacle(31, ObstacleType.CONSTRUCTION_ZONE, parts, at))
    house = CommonRoadPolygon(np.array([(20.0, 5.0), (30.0, 5.0), (25.0, 9.0)]))
    scenario.add_objects(EnvironmentObstacle(32, ObstacleType.BUILDING, house))
    found = [o for table in surroundings(scenario) for o in table if o.name in ("31", "32")]
    areas = union_all([Polygon(part.corners + o.trajectory.position(0.0)) for o in found for part in o.shape.parts])
    wanted = union_all([area(scenario.obstacle_by_id(k).occupancy_at_time(0).shape) for k in (31, 32)])
    assert areas.symmetric_difference(wanted).area < 1e-6


@pytest.mark.parametrize("name", ["DEU_Gar-1_2_T-1", "USA_Lanker-1_16_T-1", "DEU_Muc-3_1_T-1", "RUS_Bicycle-3_2_T-1"])
def test_problems_of_the_exercises(tmp_path: Path, name: str) -> None:
    """Goals without a position, of lanelets, and of an area: read, solved and valid."""
    file = SHARED.parent / "commonroad" / f"{name}.xml"
    if not file.exists():
        pytest.skip(f"{file} is not there: the scenarios of CommonRoad are not part of slalom")
    scenario, problems = CommonRoadFileReader(str(file)).open()
    (problem,) = problems.planning_problem_dict.values()
    motion = judge(scenario, problem, tmp_path, "PM")
    assert motion.safe
    assert motion.reached
