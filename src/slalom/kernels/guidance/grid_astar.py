"""Grid A*: waypoints of shortest paths around obstacles at rest, which are walls and robots that have arrived.

Path lengths are in cells. Fractional cell coordinates (x, y) [cell] are (a, b) at the centre of cell (a, b).
"""

import heapq

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.guidance.tables import Grid
from slalom.kernels.jit import kernel
from slalom.kernels.squared import squared
from slalom.tolerances import (
    HALF_DIAGONAL,
    LONGEST_MOVE,
    MAX_PATH_CELLS,
    MIN_WAYPOINT_CELLS,
    NARROW_COST,
    PARKED_COST,
    SEARCH_MARGIN,
    SIGHT_CULL,
    SIGHT_SAMPLES,
    SIGHT_START,
    SQUARED_LENGTH_FLOOR,
    WALL_COST,
)


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
def cell_distance(a: int, b: int, c: int, d: int) -> float:
    """Distance [cell] of the cells (a, b) and (c, d)."""
    return float(np.sqrt((a - c) * (a - c) + (b - d) * (b - d)))


@kernel
def is_move(da: int, db: int) -> bool:
    """Whether (da, db), at most 2 each, is a step to a neighbour, a knight's move, or none: paths in 16 directions."""
    return (abs(da) != 2 or abs(db) == 1) and (abs(db) != 2 or abs(da) == 1)


@kernel
def wall_cost(clearance: float, radius: float, width: float) -> float:
    """Cost [1] of a cell, per length, from its clearance [m] to walls and its width [m]; 1 where it is free.

    radius: of the robot, margin included [m].
    """
    cost = 1.0
    if clearance < radius:
        cost = WALL_COST if clearance < radius - HALF_DIAGONAL * width else NARROW_COST
    return cost


@kernel
def wall_costs(grid: Grid, radius: float) -> Array:
    """Cost (nx, ny) [1] of each cell for a robot of a radius [m], margin included, from walls only."""
    nx, ny = grid.clearance.shape
    cost = np.empty((nx, ny))
    for a in range(nx):
        for b in range(ny):
            cost[a, b] = wall_cost(grid.clearance[a, b], radius, grid.width)
    return cost


@kernel
def cell_costs(
    grid: Grid, walls: Array, radius: float, positions: Array, radii: Array, parked: Indices, i: int
) -> Array:
    """Cost (nx, ny) [1] of each cell for robot i, from `wall_costs` walls (nx, ny) and the robots `parked`.

    radius: of robot i, margin included [m]. positions (n, 3) [m] and radii (n,) [m] of all robots.
    """
    cost = walls.copy()
    nx, ny = cost.shape
    for k in parked:
        if k == i:
            continue
        x, y = cell_coordinates(grid, positions[k, 0], positions[k, 1])
        r = (radii[k] + radius) / grid.width
        for a in range(max(0, int(np.ceil(x - r))), min(nx - 1, int(np.floor(x + r))) + 1):
            for b in range(max(0, int(np.ceil(y - r))), min(ny - 1, int(np.floor(y + r))) + 1):
                if squared(a - x) + squared(b - y) < r * r:
                    cost[a, b] = max(cost[a, b], PARKED_COST)
    return cost


@kernel
def path_lengths(cost: Array, goal: tuple[int, int], start: tuple[int, int], margin: float) -> tuple[Array, float]:
    """Lengths (nx, ny) [cell] of the shortest paths from each cell to `goal`, weighted by cost (nx, ny); and a limit.

    The limit [cell] is the length of the shortest path from `start` plus `margin` [cell]. The length of a cell is
    exact if the path from `start` through that cell is at most that long. A* from the goal: the straight distance is
    an admissible heuristic since no cell costs less than 1.
    """
    nx, ny = cost.shape
    lengths, limit = np.full((nx, ny), np.inf), np.inf
    c, d = start
    lengths[goal] = 0.0
    heap = [(cell_distance(goal[0], goal[1], c, d), goal[0] * ny + goal[1])]
    while len(heap) > 0:
        estimate, code = heapq.heappop(heap)
        a, b = code // ny, code % ny
        length = lengths[a, b]
        if estimate > limit:
            break
        if estimate > length + cell_distance(a, b, c, d):
            # The cell has been reached on a shorter path since.
            continue
        if a == c and b == d:
            limit = length + margin
        for da in range(-2, 3):
            for db in range(-2, 3):
                u, v = a + da, b + db
                if (da == 0 and db == 0) or not is_move(da, db) or u < 0 or v < 0 or u >= nx or v >= ny:
                    continue
                weight = 0.5 * (cost[a, b] + cost[u, v])
                if abs(da) + abs(db) == 3:
                    # The cells that a knight's move crosses count too: it must not jump over thin walls.
                    e, f = a + da // 2 if abs(da) == 2 else a, b + db // 2 if abs(db) == 2 else b
                    weight = max(weight, max(cost[e, f], cost[u - (e - a), v - (f - b)]))
                step = np.sqrt(da * da + db * db) * weight
                if length + step < lengths[u, v]:
                    lengths[u, v] = length + step
                    heapq.heappush(heap, (length + step + cell_distance(u, v, c, d), u * ny + v))
    return lengths, limit


@kernel
def shortest_path(lengths: Array, start: tuple[int, int], limit: float) -> list[tuple[int, int]]:
    """Cells of the path from `start` down the lengths (nx, ny) [cell] to 0; empty if it leaves the exact lengths.

    lengths and limit [cell] are those of `path_lengths`.
    """
    c, d = start
    path = [start]
    while lengths[c, d] > 0.0 and len(path) < MAX_PATH_CELLS:
        if lengths[c, d] + cell_distance(c, d, start[0], start[1]) + LONGEST_MOVE > limit:
            path.clear()
            break
        least, e, f = lengths[c, d], c, d
        for da in range(-2, 3):
            for db in range(-2, 3):
                u, v = c + da, d + db
                if not is_move(da, db) or u < 0 or v < 0 or u >= lengths.shape[0] or v >= lengths.shape[1]:
                    continue
                if lengths[u, v] < least:
                    least, e, f = lengths[u, v], u, v
        if e == c and f == d:
            break
        c, d = e, f
        path.append((c, d))
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
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
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
    near, count = np.empty(len(parked), np.int64), 0
    for k in parked:
        x, y = cell_coordinates(grid, positions[k, 0], positions[k, 1])
        r = (radii[k] + radius) / width + SIGHT_CULL
        along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / max(length * length, SQUARED_LENGTH_FLOOR)
        along = min(1.0, max(0.0, along))
        if k != i and squared(x - x0 - along * (x1 - x0)) + squared(y - y0 - along * (y1 - y0)) <= r * r:
            near[count] = k
            count += 1
    steps, most = int(np.ceil(SIGHT_SAMPLES * length)) + 1, 0.0
    for n in range(steps + 1):
        x, y = x0 + (x1 - x0) * n / steps, y0 + (y1 - y0) * n / steps
        a, b = nearest_cell(grid.clearance.shape, x, y)
        cost = wall_cost(grid.clearance[a, b], radius, width)
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
def next_waypoint(grid: Grid, cost: Array, position: Array, goal: Array, waypoint: Array) -> bool:
    """Whether the straight line to a goal is blocked; then the farthest visible point of the shortest path.

    cost (nx, ny) [1] of each cell; position, goal (3,) [m]. The point goes into waypoint (3,) [m]: x, y.
    """
    shape = cost.shape
    x0, y0 = cell_coordinates(grid, position[0], position[1])
    x1, y1 = cell_coordinates(grid, goal[0], goal[1])
    if line_of_sight(cost, x0, y0, x1, y1):
        return False
    end, start = nearest_cell(shape, x1, y1), nearest_cell(shape, x0, y0)
    # Few cells off the shortest path are needed; where they do not suffice, all cells are searched.
    lengths, limit = path_lengths(cost, end, start, SEARCH_MARGIN)
    path = shortest_path(lengths, start, limit)
    if len(path) == 0:
        lengths, limit = path_lengths(cost, end, start, np.inf)
        path = shortest_path(lengths, start, limit)
    chosen = min(len(path) - 1, MIN_WAYPOINT_CELLS)
    for k in range(len(path) - 1, chosen, -1):
        if line_of_sight(cost, x0, y0, float(path[k][0]), float(path[k][1])):
            chosen = k
            break
    waypoint[0], waypoint[1] = (
        grid.origin[0] + grid.width * path[chosen][0],
        grid.origin[1] + grid.width * path[chosen][1],
    )
    return True
