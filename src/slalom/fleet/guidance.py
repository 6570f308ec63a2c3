"""Guidance of robots that share the plane: waypoints, traffic circles, priority inheritance."""

from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np
import shapely

from slalom import kernels
from slalom.base.checks import Array, flag
from slalom.base.errors import InvalidInput
from slalom.fleet.rounds import ROBOTS_PER_THREAD, map_in_threads
from slalom.fleet.settings import Members
from slalom.kernels.arrays import Flags
from slalom.kernels.guidance.tables import Grid, GuidanceState
from slalom.model.goal import least_distance
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts

HALF_DIAGONAL: Final = 0.7
"""[cell] Half the diagonal of a cell, rounded down: within it the clearance is hardly larger by more. Larger: paths
through cells along walls that are occupied. Smaller: ways just wide enough along a wall count as closed."""

ARRIVAL_LOST: Final = 2.0
"""[1] A robot at its goal no longer counts as arrived beyond this many tolerances from it. Guidance moves robots away
from their goals to let others pass. Nearer to 1: robots that move aside by a little are no longer parked. Larger: a
robot that was moved away stays there and counts as arrived."""

SEARCHES_PER_THREAD: Final = 4
"""[1] Fewest robots whose searches for waypoints are worth a thread: one search takes 3 us to several ms. Smaller:
threads take longer to start than their robots to search. Larger: fewer cores are used. It changes no waypoint."""

WAYPOINT_INTERVAL: Final = 5
"""[decisions] From one search for the waypoint of a robot to the next; each robot searches at another decision. Larger:
cheaper steps, later reactions to robots that have parked in the way. Smaller: more searches per step."""

GRID_CELL: Final = 0.7
"""[1] Width of the cells of the grid of waypoints, as a share of the smallest robot's radius. Larger: passages that a
robot fits through are closed. Smaller: more cells, slower searches."""

GRID_CELLS: Final = 400
"""[1] Most cells along a side of that grid: a larger scene has wider cells. Larger: finer grids of large scenes, with a
memory and a time of search that grow with the square."""

GRID_BORDER: Final = 4.0
"""[1] Width of the border around all robots, goals and obstacles at rest in that grid, in largest radii. Smaller: no
cells for a path around an obstacle at the edge of the scene. Larger: more cells that no path uses."""

PARKED_SPEED: Final = 0.05
"""[m/s] A robot at its goal that is slower than this is parked: waypoints lead around it. Larger: robots that still
brake are obstacles of the search. Smaller: a robot that drifts at its goal blocks others."""


Outlines: TypeAlias = list[tuple[shapely.Geometry, float]]
"""Outlines and the radius [m] by which each is rounded."""


class Guidance:
    """The targets of robots in the plane that avoid each other, in `guide` as arrays.

    Guidance has no part in safety: with any target the decision of a robot avoids all obstacles. Robots go around
    obstacles at rest, pass on traffic circles, and move aside on request.

    Args:
        radii, max_speeds: (n,) [m], [m/s]. margin: [m] between bodies.
        obstacles: those at rest are gone around.

    Attributes:
        guide: the table of `kernels.guidance`. A caller writes states, goals and arrivals into it before `update`.
        grid: the clearance to obstacles at rest; made at the first update, and anew where it does not reach far enough.
    """

    def __init__(
        self,
        radii: Array,
        max_speeds: Array,
        margin: float,
        obstacles: Sequence[Obstacle],
        *,
        threads: int | None = None,
    ) -> None:
        n, self.margin = len(radii), margin
        self.threads = kernels.threads() if threads is None else threads
        self._updates = 0
        self._reach = np.full((2, 2), np.nan)
        self._at_rest = [obstacle for obstacle in obstacles if obstacle.at_rest]
        self._outlines: Outlines | None = None
        self.grid = Grid(np.zeros(2), 1.0, np.full((1, 1), np.inf), np.full((1, 1), np.inf))
        self.guide = GuidanceState(
            position=np.zeros((n, 3)),
            velocity=np.zeros((n, 3)),
            radius=radii,
            max_speed=max_speeds,
            goal=np.zeros((n, 3)),
            goal_tolerance=np.zeros(n),
            goal_stop=np.ones(n, np.bool_),
            present=np.ones(n, np.bool_),
            waypoint=np.zeros((n, 3)),
            target=np.zeros((n, 3)),
            tolerance=np.zeros(n),
            stop=np.ones(n, np.bool_),
            waiting_time=np.zeros(n),
            yielding=np.zeros((n, 4)),
            arrived=np.zeros(n, np.bool_),
            visited=np.zeros(n, np.bool_),
            circle=np.zeros((n, 4)),
        )

    def head_for(self, goals: Array, tolerances: Array, stop: Flags, joined: Flags) -> Flags:
        """Set the goals (n, 3) [m] of the robots; those that `joined` (n,) or have another goal begin anew: (n,)."""
        guide = self.guide
        new = joined | (np.linalg.norm(goals - guide.goal, axis=1) > tolerances)
        guide.goal[:] = goals
        guide.goal_tolerance[:] = tolerances
        guide.goal_stop[:] = stop
        guide.waypoint[new] = guide.target[new] = goals[new]
        guide.waiting_time[new] = 0.0
        guide.yielding[new] = 0.0
        guide.circle[new] = 0.0
        guide.arrived[new] = guide.visited[new] = False
        return np.asarray(new)

    def note_arrivals(self, before: Array) -> None:
        """Update which robots have arrived at goals at rest: the rules of `Goal` and of ARRIVAL_LOST.

        A goal to pass is reached if the straight way from `before` (n, 3) [m], a period ago, touches the tolerance.
        """
        guide = self.guide
        distance, speed = np.linalg.norm(guide.goal - guide.position, axis=1), np.linalg.norm(guide.velocity, axis=1)
        way = guide.position - before
        passed = least_distance(before - guide.goal, way, np.zeros_like(way)) <= guide.goal_tolerance
        stopped = (distance <= guide.goal_tolerance) & (speed <= guide.goal_tolerance)
        there = np.where(guide.goal_stop, stopped, passed | (distance <= guide.goal_tolerance))
        guide.arrived[:] = guide.present & (there | (guide.arrived & (distance <= ARRIVAL_LOST * guide.goal_tolerance)))

    def update(self, now: float, period: float) -> None:
        """Choose the targets for the next `period` [s] from the states of all robots at `now` [s]."""
        guide = self.guide
        guide.visited[:] |= guide.arrived
        guide.tolerance[:], guide.stop[:] = guide.goal_tolerance, guide.goal_stop
        if self._outlines is None:
            parts = [part for obstacle in self._at_rest for part in outline_parts(obstacle, now)]
            self._outlines = [(_outline(part.corners), part.radius) for part in parts]
        self._cover(self._outlines)
        self._search_waypoints()
        update, rows = kernels.update_targets, np.arange(len(guide.radius))
        # A target takes a tenth of the time of a decision.
        map_in_threads(lambda part: update(part, guide), rows, self.threads, 10 * ROBOTS_PER_THREAD)
        kernels.give_way(guide, self.grid, self.margin, now, period)
        self._updates += 1

    def _search_waypoints(self) -> None:
        """Set waypoints around obstacles and robots at rest; each robot searches at its decision of the interval."""
        guide = self.guide
        search = kernels.update_waypoints
        rows = np.arange(len(self.guide.radius))
        still = np.linalg.norm(guide.velocity, axis=1) < PARKED_SPEED
        parked = np.flatnonzero(guide.present & guide.arrived & still)
        due = np.flatnonzero(guide.present & ~guide.arrived & ((rows + self._updates) % WAYPOINT_INTERVAL == 0))
        # The costs of cells are made anew where the radius changes.
        due = due[np.argsort(guide.radius[due], kind="stable")]
        map_in_threads(
            lambda part: search(guide, self.grid, self.margin, parked, part), due, self.threads, SEARCHES_PER_THREAD
        )

    def _cover(self, outlines: Outlines) -> None:
        """Make the grid anew if a goal, or a robot that is present, lies outside it."""
        guide = self.guide
        places = np.concatenate([guide.position[guide.present, :2], guide.goal[:, :2]])
        low, high = self._reach
        if not ((places >= low) & (places <= high)).all():
            self.grid, self._reach = self._made(places, outlines)

    def _made(self, places: Array, outlines: Outlines) -> tuple[Grid, Array]:
        """The clearance to obstacles at rest on a grid over places (m, 2) [m] and obstacles at rest; and its corners.

        Beyond the places the grid has a border, so that the next ones lie within it too.
        """
        guide = self.guide
        corners = [shapely.get_coordinates(outline) for outline, _ in outlines]
        positions = np.concatenate([places, *corners])
        border = GRID_BORDER * float(guide.radius.max())
        low, high = positions.min(axis=0) - border, positions.max(axis=0) + border
        width = max(GRID_CELL * float(guide.radius.min()), float((high - low).max()) / GRID_CELLS)
        counts = np.ceil((high - low) / width).astype(int) + 1
        clearance = _clearance(outlines, np.moveaxis(np.indices(counts), 0, -1) * width + low)
        passage = _passage(outlines, clearance, low, width, float(guide.radius.max()) + self.margin)
        return Grid(low, width, clearance, passage), np.array([low, high])


def _clearance(outlines: Outlines, places: Array) -> Array:
    """The least distance (...) [m] of places (..., 2) [m] to rounded outlines; inf without any."""
    clearance = np.full(places.shape[:-1], np.inf)
    if not outlines:
        # Points take long to make and serve nothing where no obstacle rests.
        return clearance
    points = shapely.points(places).ravel()
    radii = np.array([radius for _, radius in outlines])
    for radius in np.unique(radii):
        tree = shapely.STRtree([outline for outline, own in outlines if own == radius])
        _, distance = tree.query_nearest(points, return_distance=True, all_matches=False)
        clearance = np.minimum(clearance, distance.reshape(clearance.shape) - radius)
    return clearance


def _passage(outlines: Outlines, clearance: Array, low: Array, width: float, most: float) -> Array:
    """An upper bound (nx, ny) [m] of the clearance on ways across each cell, from that at its centre.

    Clearance grows by at most 1 m per metre, so half a diagonal more is a bound. Between two walls it is much too high.
    All ways between them cross the shortest line that joins them, with half its length as the largest clearance. That
    bound holds in the cells on the line. Lines for which it is `most` [m] or more close no passage, and are left out.
    """
    found = clearance + HALF_DIAGONAL * width
    if not outlines:
        return found
    shapes, radii = np.array([outline for outline, _ in outlines]), np.array([radius for _, radius in outlines])
    near = shapely.STRtree(shapes).query(shapes, "dwithin", 2.0 * (most + float(radii.max())))
    one, other = near[:, near[0] < near[1]]
    ends = shapely.get_coordinates(shapely.shortest_line(shapes[one], shapes[other])).reshape(-1, 2, 2)
    half = 0.5 * (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) - radii[one] - radii[other])
    for (begin, end), largest in zip((ends[half < most] - low) / width, half[half < most].tolist()):
        # From one cell of the line to the next along an axis: no diagonal move crosses it in between.
        cells = np.rint(np.linspace(begin, end, int(2.0 * np.abs(end - begin).max()) + 2)).astype(int)
        cells = np.concatenate([cells, np.stack([cells[:-1, 0], cells[1:, 1]], axis=1)])
        cells = cells[((cells >= 0) & (cells < found.shape)).all(axis=1)]
        rows = tuple(cells.T)
        found[rows] = np.minimum(found[rows], largest)
    return found


def guidance_of(guided: bool | None, members: Members, obstacles: Sequence[Obstacle], threads: int) -> Guidance | None:
    """The guidance of a fleet, None for one that is not `guided`; see `Fleet` for a value of None.

    Raises:
        InvalidInput: True for a fleet in space or in several worlds.
    """
    dimension, n = members.shapes[0].dimension, len(members.shapes)
    possible = dimension == 2 and not members.worlds.any()
    if not (possible and n > 1 if guided is None else flag(guided, "guided")):
        return None
    if not possible:
        where = "space" if dimension == 3 else "several worlds"
        raise InvalidInput(f"guided: expected False for a fleet in {where}, found True")
    return Guidance(
        np.array([float(shape.bounding_radius) for shape in members.shapes]),
        np.array([float(limits.max_speed) for limits in members.limits]),
        float(members.margins.max()),
        obstacles,
        threads=threads,
    )


def _outline(corners: Array) -> shapely.Geometry:
    """The polygon of corners (n, 2) [m]; a point or a line for fewer than 3."""
    if len(corners) < 3:
        return shapely.Point(corners[0]) if len(corners) == 1 else shapely.LineString(corners)
    return shapely.Polygon(corners)
