"""Where robots that share the plane head for: around what rests, around each other, aside for those that wait."""

import numpy as np
import shapely
from shapely.affinity import translate

from slalom import kernels
from slalom.checks import Array
from slalom.kernels.guidance.tables import Grid, GuidanceState
from slalom.minkowski import outline_parts
from slalom.sim.periodic import between
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

    def __init__(self, scenario: Scenario, threads: int | None = None) -> None:
        self.threads = kernels.threads() if threads is None else threads
        robots, n = scenario.robots, len(scenario.robots)
        self.robots, self.dimension, self.margin = robots, scenario.dimension, scenario.margin
        self.guided = bool(scenario.guided) and scenario.dimension == 2
        self.arrived = np.full(n, np.inf)
        self.push = np.zeros((n, 3))
        goals = self._three(np.array([robot.goal.position(scenario.start) for robot in robots]))
        self.guide = GuidanceState(
            position=self._three(np.array([robot.state.position for robot in robots])),
            velocity=self._three(np.array([robot.state.velocity for robot in robots])),
            radius=np.array([robot.shape.bounding_radius for robot in robots]),
            max_speed=np.array([robot.limits.max_speed for robot in robots]),
            goal=goals,
            goal_tolerance=np.array([robot.goal.tolerance for robot in robots]),
            goal_stop=np.array([robot.goal.stop for robot in robots]),
            present=np.ones(n, np.bool_),
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
        self._moving = [k for k, robot in enumerate(robots) if not isinstance(robot.goal.trajectory, Stationary)]
        if self.guided:
            self.grid = _grid(scenario, self.guide)

    def _three(self, rows: Array) -> Array:
        """Vectors (n, d) with zeros for the third coordinate: (n, 3)."""
        wide = np.zeros((len(rows), 3))
        wide[:, : rows.shape[1]] = rows
        return wide

    def note_arrivals(self, now: float) -> None:
        """Robots that reach their goals; those that pass them leave. Who has been asked away has not arrived."""
        guide, d = self.guide, self.dimension
        away = np.linalg.norm(self.goals(now) - guide.position, axis=1)
        # Whether each is near enough says its goal; here only who is worth asking, or has left.
        for k in np.flatnonzero(guide.present & (away <= 1.1 * guide.goal_tolerance)):
            goal = self.robots[k].goal
            if goal.reached(guide.position[k, :d], guide.velocity[k, :d], now) and not np.isfinite(self.arrived[k]):
                self.arrived[k] = now
                guide.present[k] = goal.stop
        self.arrived[guide.present & (away > 2.0 * guide.goal_tolerance)] = np.inf

    def goals(self, now: float) -> Array:
        """Where the goals are: (n, 3)."""
        for k in self._moving:
            self.guide.goal[k, : self.dimension] = self.robots[k].goal.position(now)
        return self.guide.goal

    def update(self, now: float, period: float) -> None:
        """Where each robot heads for, from what all of them do now."""
        guide = self.guide
        self.goals(now)
        guide.arrived[:] = np.isfinite(self.arrived)
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
        rests = np.isfinite(self.arrived) & (np.linalg.norm(guide.velocity, axis=1) < PARKED)
        parked = np.flatnonzero(guide.present & rests)
        moves = (guide.waypoint == guide.goal).all(axis=1)
        turn = (np.arange(len(self.robots)) + self._steps) % WAYPOINT_INTERVAL == 0
        due = np.flatnonzero(guide.present & ~np.isfinite(self.arrived) & turn)
        guide.waypoint[moves] = guide.goal[moves]
        kernels.update_waypoints(guide, self.grid, self.margin, parked, due)
        everyone = np.arange(len(self.robots))
        map_in_threads(lambda part: kernels.update_targets(part, guide), everyone, self.threads, FEWEST)
        kernels.give_way(guide, self.grid, self.margin, now, period)
        self._steps += 1

    def drive(self, push: Array, dt: float) -> None:
        """The exact states after `dt` [s] under the accelerations `push` (n, 3)."""
        position, velocity = self.guide.position, self.guide.velocity
        position += dt * (velocity + 0.5 * dt * push)
        velocity += dt * push
        self.push = push


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
