"""Guidance of the robots of a run."""

import numpy as np

from slalom.fleet.guidance import Guidance
from slalom.sim.run.robot_states import RobotStates


class GuidedRun(Guidance):
    """The targets of all robots of a run.

    In space, and in a scenario that is not `guided`, the target of a robot is its goal.

    Attributes:
        guided: whether targets differ from goals.
    """

    def __init__(self, states: RobotStates, threads: int | None = None) -> None:
        scenario, robots = states.scenario, states.robots
        super().__init__(
            np.array([robot.shape.bounding_radius for robot in robots]),
            np.array([robot.limits.max_speed for robot in robots]),
            scenario.margin,
            scenario.obstacles if scenario.dimension == 2 else (),
            start=scenario.start,
            world_period=scenario.period,
            threads=threads,
        )
        self.states, self.guided = states, bool(scenario.guided) and scenario.dimension == 2
        goals, guide = states.goals(scenario.start), self.guide
        # The arrays of the states change in place.
        self.guide = guide._replace(
            position=states.position, velocity=states.velocity, present=states.present, goal=goals
        )
        guide.goal_tolerance[:] = [robot.goal.tolerance for robot in robots]
        guide.goal_stop[:] = [robot.goal.stop for robot in robots]
        guide.waypoint[:] = guide.target[:] = goals

    def update(self, now: float, period: float) -> None:
        guide = self.guide
        self.states.goals(now)
        guide.arrived[:] = np.isfinite(self.states.arrived)
        if self.guided:
            super().update(now, period)
            return
        guide.visited[:] |= guide.arrived
        guide.tolerance[:], guide.stop[:], guide.target[:] = guide.goal_tolerance, guide.goal_stop, guide.goal
