"""Where robots that share the plane head for: around what rests, around each other, aside for those that wait."""

import numpy as np
import shapely
from shapely.affinity import translate

from slalom import kernels
from slalom.checks import Array
from slalom.kernels.guidance.tables import Grid, GuidanceState
from slalom.minkowski import outline_parts
from slalom.sim.periodic import between
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.run.threads import map_in_threads
from slalom.sim.scenario import Scenario
from slalom.trajectory import Stationary

WAYPOINT_INTERVAL = 5
"""[decisions] after which the way around what rests is looked for again; each robot at another one."""
CELL, CELLS = 0.7, 400
"""[1] A cell of the grid is this share of the smallest radius wide, or the side over the largest number of cells."""
FEWEST = 250
"""Robots that are worth a thread."""
PARKED = 0.05
"""[m/s] A robot at its goal that is slower than this rests."""


class Guidance:
    """The state of the robots of a scenario, and where they head for; `guide` holds it as arrays.

    Wishes only: whatever a robot heads for, its decision keeps clear of everything. In space robots head for their
    goals, and so they do in a scenario that is not `guided`. In a world that repeats they only pass those that
    come towards them on the right, and give way.
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
            period=_repeats(scenario),
            circle=np.zeros((n, 4)),
        )
        self._steps = 0
        if self.guided:
            self.grid = _grid(scenario, self.guide)

    def update(self, now: float, period: float) -> None:
        """Where each robot heads for, from what all of them do now."""
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
        rests = guide.arrived & (np.linalg.norm(guide.velocity, axis=1) < PARKED)
        parked = np.flatnonzero(guide.present & rests)
        moves = (guide.waypoint == guide.goal).all(axis=1)
        turn = (np.arange(len(guide.radius)) + self._steps) % WAYPOINT_INTERVAL == 0
        due = np.flatnonzero(guide.present & ~guide.arrived & turn)
        guide.waypoint[moves] = guide.goal[moves]
        kernels.update_waypoints(guide, self.grid, self.margin, parked, due)
        everyone = np.arange(len(guide.radius))
        map_in_threads(lambda part: kernels.update_targets(part, guide), everyone, self.threads, FEWEST)
        kernels.give_way(guide, self.grid, self.margin, now, period)
        self._steps += 1


def _repeats(scenario: Scenario) -> Array:
    """The period along x and y [m], 0 where there is none."""
    period = np.array((scenario.period or ())[:2])
    return np.where(np.isfinite(period), period, 0.0) if len(period) else np.zeros(2)


def _grid(scenario: Scenario, guide: GuidanceState) -> Grid:
    """Grid of the clearance to obstacles at rest, over all positions and goals with a margin."""
    at_rest = [o for o in scenario.obstacles if isinstance(o.trajectory, Stationary)]
    parts = [part for obstacle in at_rest for part in outline_parts(obstacle, scenario.start)]
    outlines = [(_outline(part.corners), part.radius) for part in parts]
    places = [guide.position[:, :2], guide.goal[:, :2], *(shapely.get_coordinates(line) for line, _ in outlines)]
    room = 4.0 * float(guide.radius.max())
    low, high = np.concatenate(places).min(axis=0) - room, np.concatenate(places).max(axis=0) + room
    if scenario.period is not None:
        # One period of the world is enough, with the images of what rests that reach into it.
        high = np.where(guide.period > 0.0, low + guide.period, high)
        outlines = [
            (translate(line, *by), radius)
            for line, radius in outlines
            for by in between(low - room - line.bounds[2:], high + room - line.bounds[:2], scenario.period)
        ]
    width = max(CELL * float(guide.radius.min()), float((high - low).max()) / CELLS)
    counts = np.ceil((high - low) / width).astype(int) + 1
    clearance = np.full(tuple(counts), np.inf)
    # Points are costly to make, and of no use where nothing rests.
    cells = shapely.points(np.moveaxis(np.indices(clearance.shape), 0, -1) * width + low) if outlines else None
    for line, radius in outlines:
        clearance = np.minimum(clearance, shapely.distance(cells, line) - radius)
    return Grid(low, width, clearance)


def _outline(corners: Array) -> shapely.Geometry:
    if len(corners) < 3:
        return shapely.Point(corners[0]) if len(corners) == 1 else shapely.LineString(corners)
    return shapely.Polygon(corners)
