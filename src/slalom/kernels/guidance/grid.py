"""The plane and the grid of the guidance: free places, and grid A*."""

from typing import Final

import numpy as np

from slalom.base.tolerances import SQUARED_LENGTH_FLOOR
from slalom.kernels.arrays import Array, Indices
from slalom.kernels.guidance.tables import Grid, GuidanceState, PathSearch
from slalom.kernels.jit import kernel, squared


@kernel
def along_and_across(x: float, y: float, dx: float, dy: float) -> tuple[float, float]:
    """Components of the vector (x, y) along (dx, dy) and to the left of it, times the length of (dx, dy)."""
    return x * dx + y * dy, dx * y - dy * x


@kernel
def offset(j: int, k: int, robots: GuidanceState) -> tuple[float, float]:
    """Vector [m] from robot j to robot k."""
    x = robots.position[k, 0] - robots.position[j, 0]
    return x, robots.position[k, 1] - robots.position[j, 1]


@kernel
def is_free(x: float, y: float, radius: float, grid: Grid) -> bool:
    """Whether a disc of a radius [m] at (x, y) [m] is on the grid and clear of obstacles at rest."""
    a = int(np.round((x - grid.origin[0]) / grid.width))
    b = int(np.round((y - grid.origin[1]) / grid.width))
    shape = grid.clearance.shape
    return bool(0 <= a < shape[0] and 0 <= b < shape[1] and grid.clearance[a, b] >= radius)


# Grid A*: waypoints of shortest paths around obstacles at rest, which are walls and robots that have arrived.
#
# Path lengths are in cells. Fractional cell coordinates (x, y) [cell] are (a, b) at the centre of cell (a, b).


NARROW_COST: Final = 3.0
"""[1] Cost per length of cells whose clearance is less than the radius by no more than half a diagonal. Such a cell may
or may not be free. Larger: paths avoid passages as wide as the robot. Smaller: paths touch walls."""

PARKED_COST: Final = 8.0
"""[1] Cost per length of cells that are occupied by a robot at rest at its goal; a request may move it aside. Larger:
longer detours around such robots. Smaller: more requests."""

WALL_COST: Final = 1e4
"""[1] Cost per length of cells that are occupied by a wall: more than any detour, but finite. A robot whose own cell
counts as occupied still gets a path. Smaller: on large grids paths may lead through walls."""

LONGEST_MOVE: Final = 5.0**0.5
"""[cell] Length of a knight's move, the longest on the grid: cells within it of the known ones may be unknown."""

BUCKET_WIDTH: Final = 0.1
"""[cell] Estimated lengths of paths that the queue of a search does not distinguish. A path may be longer than the
shortest one by so much. Larger: longer paths. Smaller: more empty buckets."""

MAX_PATH_CELLS: Final = 4096
"""[cell] Cells of a path at most: more than a shortest path has on a grid of 400 by 400 cells without a maze. A longer
path is cut there, which leaves the next waypoint as it is."""

MIN_WAYPOINT_CELLS: Final = 2
"""[1] A waypoint is at least so many cells of the path ahead, even if the line of sight to it is blocked. Larger:
waypoints behind corners. Smaller: a robot in an occupied cell gets its own cell as waypoint."""

SIGHT_SAMPLES: Final = 2.0
"""[1/cell] Samples of a line of sight per cell. Larger: slower. Smaller: corners of walls are missed."""

SIGHT_START: Final = 1.5
"""[cell] Length at the beginning of a line of sight on which occupied cells do not count. The cell of a robot in
contact may be occupied by rounding. Larger: lines through thin walls count as free. Smaller: all lines from robots at
walls are blocked."""

SIGHT_CULL: Final = 1.0
"""[cell] Robots nearer to a line of sight than their radius and this are tested at its cells. The samples are rounded
to cells, at most 0.71 cells away. Larger: more tests; smaller than that: robots are missed."""


DIAGONAL = np.sqrt(2.0)
KNIGHT = np.sqrt(5.0)
"""[cell] Lengths of a diagonal move and of a knight's move."""
MOVES = np.array([(a, b) for a in range(-2, 3) for b in range(-2, 3) if a * a + b * b in (1, 2, 5)])
"""(16, 2) [cell] Moves to neighbours and knight's moves: paths in 16 directions. Of equal paths the first counts."""
MOVE_LENGTHS = np.sqrt((MOVES**2).sum(axis=1))
"""(16,) [cell]"""


@kernel
def new_path_search(cost: Array) -> PathSearch:
    """The memory of searches on a grid of cells with cost (nx, ny) [1]."""
    buckets = int(LONGEST_MOVE * (cost.max() + 1.0) / BUCKET_WIDTH) + 2
    return PathSearch(np.full(cost.size, np.inf), np.empty(cost.size, np.int64), np.full(buckets, -1))


@kernel
def cell_coordinates(grid: Grid, x: float, y: float) -> tuple[float, float]:
    """Fractional cell coordinates [cell] of a point (x, y) [m]."""
    return (x - grid.origin[0]) / grid.width, (y - grid.origin[1]) / grid.width


@kernel
def nearest_cell(shape: tuple[int, int], x: float, y: float) -> tuple[int, int]:
    """Cell of a grid of `shape` that is nearest to the fractional cell coordinates (x, y) [cell]."""
    a = min(max(int(np.round(x)), 0), shape[0] - 1)
    b = min(max(int(np.round(y)), 0), shape[1] - 1)
    return a, b


@kernel
def free_length(a: int, b: int, c: int, d: int) -> float:
    """Length [cell] of the shortest path in 16 directions between the cells (a, b) and (c, d) if all are free."""
    x = abs(a - c)
    y = abs(b - d)
    far = max(x, y)
    near = min(x, y)
    return float(max(far + (KNIGHT - 2.0) * near, (KNIGHT - DIAGONAL) * far + (2.0 * DIAGONAL - KNIGHT) * near))


@kernel
def wall_cost(clearance: float, passage: float, radius: float) -> float:
    """Cost [1] of a cell, per length, from the clearance [m] to walls at its centre; 1 where it is free.

    passage: [m] an upper bound of that on ways across it. radius: of the robot, margin included [m].
    """
    cost = 1.0
    if clearance < radius:
        cost = WALL_COST if passage < radius else NARROW_COST
    return cost


@kernel
def wall_costs(grid: Grid, radius: float) -> Array:
    """Cost (nx, ny) [1] of each cell for a robot of a radius [m], margin included, from walls only."""
    nx, ny = grid.clearance.shape
    cost = np.empty((nx, ny))
    for a in range(nx):
        for b in range(ny):
            cost[a, b] = wall_cost(grid.clearance[a, b], grid.passage[a, b], radius)
    return cost


@kernel
def cell_costs(grid: Grid, radius: float, positions: Array, radii: Array, parked: Indices) -> Array:
    """Cost (nx, ny) [1] of each cell for a robot of a radius [m], margin included, from walls and robots `parked`.

    positions (n, 3) [m] and radii (n,) [m] of all robots.
    """
    cost = wall_costs(grid, radius)
    nx, ny = cost.shape
    for k in parked:
        x, y = cell_coordinates(grid, positions[k, 0], positions[k, 1])
        r = (radii[k] + radius) / grid.width
        for a in range(max(0, int(np.ceil(x - r))), min(nx - 1, int(np.floor(x + r))) + 1):
            for b in range(max(0, int(np.ceil(y - r))), min(ny - 1, int(np.floor(y + r))) + 1):
                if squared(a - x) + squared(b - y) < r * r:
                    cost[a, b] = max(cost[a, b], PARKED_COST)
    return cost


@kernel
def path_lengths(
    cost: Array, goal: tuple[int, int], start: tuple[int, int], search: PathSearch
) -> list[tuple[int, float, int, int]]:
    """Write the lengths [cell] of paths from cells to `goal`, weighted by cost (nx, ny), into `search`.

    Returns the queue: an entry (cell, length, previous entry, bucket) for each time that a cell was reached. A* from
    the goal until `start` is reached: `free_length` is an admissible heuristic since no cell costs less than 1. The
    path from `start` is longer than the shortest one by at most BUCKET_WIDTH, since the order within a bucket does not
    matter. A start outside the grid is never reached: the lengths of all cells are then those of shortest paths.
    """
    (nx, ny) = cost.shape
    flat = cost.ravel()
    (c, d) = start
    lengths = search.lengths
    following = search.following
    latest = search.latest
    bucket = int(free_length(goal[0], goal[1], c, d) / BUCKET_WIDTH)
    queue = [(goal[0] * ny + goal[1], 0.0, -1, bucket % len(latest))]
    waiting = 1
    lengths[queue[0][0]] = 0.0
    latest[queue[0][3]] = 0
    while waiting > 0:
        entry = latest[bucket % len(latest)]
        if entry < 0:
            bucket += 1
            continue
        cell, length, before, _ = queue[entry]
        latest[bucket % len(latest)] = before
        waiting -= 1
        if length > lengths[cell]:
            # The cell has been reached on a shorter path since.
            continue
        a = cell // ny
        b = cell % ny
        if a == c and b == d:
            break
        for k in range(len(MOVES)):
            da = MOVES[k, 0]
            db = MOVES[k, 1]
            u = a + da
            v = b + db
            if u < 0 or v < 0 or u >= nx or v >= ny:
                continue
            to = u * ny + v
            weight = 0.5 * (flat[cell] + flat[to])
            if abs(da) + abs(db) == 3:
                # The cells that a knight's move crosses count too: it must not jump over thin walls.
                beside = da // 2 * ny if abs(da) == 2 else db // 2
                weight = max(weight, max(flat[cell + beside], flat[to - beside]))
            through = length + MOVE_LENGTHS[k] * weight
            if through < lengths[to]:
                lengths[to] = through
                following[to] = cell
                # No estimate falls, but for rounding.
                place = max(int((through + free_length(u, v, c, d)) / BUCKET_WIDTH), bucket) % len(latest)
                queue.append((to, through, latest[place], place))
                latest[place] = len(queue) - 1
                waiting += 1
    # A cell of a wall is so far away that there are many more buckets than entries.
    for _, _, _, place in queue:
        latest[place] = -1
    return queue


@kernel
def path_to_goal(
    cost: Array, goal: tuple[int, int], start: tuple[int, int], search: PathSearch
) -> list[tuple[int, int]]:
    """Cells of a path from `start` to `goal`, see `path_lengths`, given the cost (nx, ny) [1] of each cell."""
    reached = path_lengths(cost, goal, start, search)
    ny = cost.shape[1]
    path = [start]
    cell = start[0] * ny + start[1]
    last = goal[0] * ny + goal[1]
    while cell != last and len(path) < MAX_PATH_CELLS:
        cell = search.following[cell]
        path.append((cell // ny, cell % ny))
    for to, _, _, _ in reached:
        search.lengths[to] = np.inf
    return path


@kernel
def line_of_sight(cost: Array, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether all cells on the line from (x0, y0) to (x1, y1) [cell] are free, given their cost (nx, ny).

    If the line begins in a narrow cell, narrow cells count as free.
    """
    shape = cost.shape
    length = np.sqrt(squared(x1 - x0) + squared(y1 - y0))
    most = min(cost[nearest_cell(shape, x0, y0)], NARROW_COST)
    steps = int(np.ceil(SIGHT_SAMPLES * length)) + 1
    for k in range(steps + 1):
        x = x0 + (x1 - x0) * k / steps
        y = y0 + (y1 - y0) * k / steps
        # The cell of a robot in contact may be occupied by rounding: the first cells do not count.
        if cost[nearest_cell(shape, x, y)] > most and length * k / steps > SIGHT_START:
            return False
    return True


@kernel
def goal_in_sight(
    grid: Grid, radius: float, positions: Array, radii: Array, parked: Indices, i: int, goal: Array
) -> bool:
    """Whether robot i has a `line_of_sight` to its goal (3,) [m], without the costs of all cells.

    That suffices for most robots at most times. The other arguments are those of `cell_costs`.
    """
    width = grid.width
    x0, y0 = cell_coordinates(grid, positions[i, 0], positions[i, 1])
    x1, y1 = cell_coordinates(grid, goal[0], goal[1])
    length = np.sqrt(squared(x1 - x0) + squared(y1 - y0))
    near = np.empty(len(parked), np.int64)
    count = 0
    for k in parked:
        x, y = cell_coordinates(grid, positions[k, 0], positions[k, 1])
        r = (radii[k] + radius) / width + SIGHT_CULL
        along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / max(length * length, SQUARED_LENGTH_FLOOR)
        along = min(1.0, max(0.0, along))
        if k != i and squared(x - x0 - along * (x1 - x0)) + squared(y - y0 - along * (y1 - y0)) <= r * r:
            near[count] = k
            count += 1
    steps = int(np.ceil(SIGHT_SAMPLES * length)) + 1
    most = 0.0
    for n in range(steps + 1):
        x = x0 + (x1 - x0) * n / steps
        y = y0 + (y1 - y0) * n / steps
        a, b = nearest_cell(grid.clearance.shape, x, y)
        cost = wall_cost(grid.clearance[a, b], grid.passage[a, b], radius)
        for m in range(count):
            k = near[m]
            px, py = cell_coordinates(grid, positions[k, 0], positions[k, 1])
            r = (radii[k] + radius) / width
            if squared(a - px) + squared(b - py) < r * r:
                cost = max(cost, PARKED_COST)
        if n == 0:
            most = min(cost, NARROW_COST)
        elif cost > most and length * n / steps > SIGHT_START:
            return False
    return True


@kernel
def farthest_in_sight(
    grid: Grid, cost: Array, position: Array, goal: Array, search: PathSearch, waypoint: Array
) -> None:
    """Write the farthest visible point of the shortest path to a goal into waypoint (3,) [m]: x, y.

    cost (nx, ny) [1] of each cell; position, goal (3,) [m].
    """
    shape = cost.shape
    x0, y0 = cell_coordinates(grid, position[0], position[1])
    x1, y1 = cell_coordinates(grid, goal[0], goal[1])
    path = path_to_goal(cost, nearest_cell(shape, x1, y1), nearest_cell(shape, x0, y0), search)
    chosen = min(len(path) - 1, MIN_WAYPOINT_CELLS)
    for k in range(len(path) - 1, chosen, -1):
        if line_of_sight(cost, x0, y0, float(path[k][0]), float(path[k][1])):
            chosen = k
            break
    waypoint[0] = grid.origin[0] + grid.width * path[chosen][0]
    waypoint[1] = grid.origin[1] + grid.width * path[chosen][1]
