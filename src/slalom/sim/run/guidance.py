"""Guidance of robots that share the plane: waypoints, traffic circles, priority inheritance."""

import numpy as np
import shapely
from shapely.affinity import translate

from slalom import kernels
from slalom.checks import Array
from slalom.fleet.threads import map_in_threads
from slalom.kernels.guidance.tables import Grid, GuidanceState
from slalom.obstacle.minkowski import outline_parts
from slalom.obstacle.periodic import between
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.scenario import Scenario
from slalom.tolerances import (
    GRID_BORDER,
    GRID_CELL,
    GRID_CELLS,
    GUIDED_ROBOTS_PER_THREAD,
    PARKED_SPEED,
    WAYPOINT_INTERVAL,
)


class Guidance:
    """The targets of all robots of a run, in `guide` as arrays.

    Guidance has no part in safety: with any target the decision of a robot avoids all obstacles. In space, and
    in a scenario that is not `guided`, the target of a robot is its goal. In a periodic world robots only keep right of
    frontal robots, and move aside on request.

    Attributes:
        guide: the table of `kernels.guidance`; it shares the arrays of `states`.
        grid: the clearance to obstacles at rest; only if robots are guided.
    """

    def __init__(self, states: RobotStates, threads: int | None = None) -> None:
        self.states, self.threads = states, kernels.threads() if threads is None else threads
        scenario, robots, n = states.scenario, states.robots, len(states.robots)
        self.margin = scenario.margin
        self.guided = bool(scenario.guided) and scenario.dimension == 2
        goals = states.goals(scenario.start)
        self.guide = GuidanceState(
            position=states.position,
            velocity=states.velocity,
            radius=np.array([robot.shape.bounding_radius for robot in robots]),
            max_speed=np.array([robot.limits.max_speed for robot in robots]),
            goal=goals,
            goal_tolerance=np.array([robot.goal.tolerance for robot in robots]),
            goal_stop=np.array([robot.goal.stop for robot in robots]),
            present=states.present,
            waypoint=goals.copy(),
            target=goals.copy(),
            tolerance=np.array([robot.goal.tolerance for robot in robots]),
            stop=np.array([robot.goal.stop for robot in robots]),
            waiting_time=np.zeros(n),
            yielding=np.zeros((n, 4)),
            arrived=np.zeros(n, np.bool_),
            visited=np.zeros(n, np.bool_),
            period=_plane_period(scenario),
            circle=np.zeros((n, 4)),
        )
        self._updates = 0
        if self.guided:
            self.grid = _grid(scenario, self.guide)

    def update(self, now: float, period: float) -> None:
        """Choose the targets for the next `period` [s] from the states of all robots at `now` [s]."""
        guide = self.guide
        self.states.goals(now)
        guide.arrived[:] = np.isfinite(self.states.arrived)
        guide.visited[:] |= guide.arrived
        guide.tolerance[:], guide.stop[:] = guide.goal_tolerance, guide.goal_stop
        if not self.guided:
            guide.target[:] = guide.goal
            return
        if guide.period.any():
            guide.waypoint[:] = guide.goal
            kernels.keep_right(guide)
            kernels.give_way(guide, self.grid, self.margin, now, period)
            return
        rows = np.arange(len(guide.radius))
        parked = guide.present & guide.arrived & (np.linalg.norm(guide.velocity, axis=1) < PARKED_SPEED)
        # Each robot searches anew at another decision of the interval.
        due = guide.present & ~guide.arrived & ((rows + self._updates) % WAYPOINT_INTERVAL == 0)
        at_goal = (guide.waypoint == guide.goal).all(axis=1)
        guide.waypoint[at_goal] = guide.goal[at_goal]
        kernels.update_waypoints(guide, self.grid, self.margin, np.flatnonzero(parked), np.flatnonzero(due))
        map_in_threads(lambda part: kernels.update_targets(part, guide), rows, self.threads, GUIDED_ROBOTS_PER_THREAD)
        kernels.give_way(guide, self.grid, self.margin, now, period)
        self._updates += 1


def _plane_period(scenario: Scenario) -> Array:
    """The period (2,) [m] along x and y, 0 where the world does not repeat."""
    period = np.array((scenario.period or ())[:2])
    return np.where(np.isfinite(period), period, 0.0) if len(period) else np.zeros(2)


def _grid(scenario: Scenario, guide: GuidanceState) -> Grid:
    """The clearance to obstacles at rest on a grid over all positions, goals and obstacles at rest."""
    at_rest = [o for o in scenario.obstacles if o.at_rest]
    parts = [part for obstacle in at_rest for part in outline_parts(obstacle, scenario.start)]
    outlines = [(_outline(part.corners), part.radius) for part in parts]
    corners = [shapely.get_coordinates(outline) for outline, _ in outlines]
    positions = np.concatenate([guide.position[:, :2], guide.goal[:, :2], *corners])
    border = GRID_BORDER * float(guide.radius.max())
    low, high = positions.min(axis=0) - border, positions.max(axis=0) + border
    if scenario.period is not None:
        # The grid covers one period, with the images of obstacles at rest that reach into it.
        high = np.where(guide.period > 0.0, low + guide.period, high)
        outlines = [
            (translate(outline, *by), radius)
            for outline, radius in outlines
            for by in between(low - border - outline.bounds[2:], high + border - outline.bounds[:2], scenario.period)
        ]
    width = max(GRID_CELL * float(guide.radius.min()), float((high - low).max()) / GRID_CELLS)
    counts = np.ceil((high - low) / width).astype(int) + 1
    clearance = np.full(tuple(counts), np.inf)
    # Points take long to make and serve nothing where no obstacle rests.
    cells = shapely.points(np.moveaxis(np.indices(clearance.shape), 0, -1) * width + low) if outlines else None
    for outline, radius in outlines:
        clearance = np.minimum(clearance, shapely.distance(cells, outline) - radius)
    return Grid(low, width, clearance)


def _outline(corners: Array) -> shapely.Geometry:
    """The polygon of corners (n, 2) [m]; a point or a line for fewer than 3."""
    if len(corners) < 3:
        return shapely.Point(corners[0]) if len(corners) == 1 else shapely.LineString(corners)
    return shapely.Polygon(corners)
