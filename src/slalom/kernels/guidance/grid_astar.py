"""Ways in the plane around what rests: walls, and robots that have arrived."""

import heapq

import numpy as np

from slalom.kernels.arrays import Array, Indices
from slalom.kernels.jit import kernel

NARROW, THROUGH, WALL = 3.0, 8.0, 1e4
"""How many times longer a cell counts that may or may not be free for its width, where a robot stands, which may be
asked aside, or at a wall."""
KNIGHT, AROUND = 5.0**0.5, 6.0
"""[cells] The longest move; and how much longer than the shortest way those are whose cells are looked at. More: more
cells. Less: more often all cells are looked at."""


@kernel
def wall_costs(grid: Array, clearance: Array, reach: float) -> Array:
    """What one metre costs in each cell for a robot of radius `reach` (margin included): 1 where it is free of walls.

    grid: x, y of cell (0, 0), and the width of a cell. clearance (nx, ny) to walls.
    """
    nx, ny = clearance.shape
    cost = np.empty((nx, ny))
    for a in range(nx):
        for b in range(ny):
            gap = clearance[a, b]
            cost[a, b] = (WALL if gap < reach - 0.7 * grid[2] else NARROW) if gap < reach else 1.0
    return cost


@kernel
def cell_costs(grid: Array, walls: Array, reach: float, places: Array, radii: Array, parked: Indices, i: int) -> Array:
    """The same for robot i, off those that are parked too; walls: of `off_walls`."""
    cost = walls.copy()
    nx, ny = cost.shape
    for k in parked:
        if k == i:
            continue
        x, y, r = (places[k, 0] - grid[0]) / grid[2], (places[k, 1] - grid[1]) / grid[2], (radii[k] + reach) / grid[2]
        for a in range(max(0, int(np.ceil(x - r))), min(nx - 1, int(np.floor(x + r))) + 1):
            for b in range(max(0, int(np.ceil(y - r))), min(ny - 1, int(np.floor(y + r))) + 1):
                if (a - x) ** 2 + (b - y) ** 2 < r * r:
                    cost[a, b] = max(cost[a, b], THROUGH)
    return cost


@kernel
def cell_of(grid: Array, shape: tuple[int, int], x: float, y: float) -> tuple[int, int]:
    """The cell that holds a place, or the nearest one."""
    a = min(max(int(np.round((x - grid[0]) / grid[2])), 0), shape[0] - 1)
    b = min(max(int(np.round((y - grid[1]) / grid[2])), 0), shape[1] - 1)
    return a, b


@kernel
def apart(x: int, y: int, c: int, d: int) -> float:
    """Between two cells, in cells."""
    return float(np.sqrt((x - c) * (x - c) + (y - d) * (y - d)))


@kernel
def path_lengths(cost: Array, a: int, b: int, c: int, d: int, around: float) -> tuple[Array, float]:
    """Lengths of the ways from each cell to (a, b), in cells; and how long the way from (c, d) by way of a cell may be
    at most for its length to be known: as long as the shortest one and `around` more.

    A* from (a, b), since no cell costs less than 1.
    """
    nx, ny = cost.shape
    length, most = np.full((nx, ny), np.inf), np.inf
    length[a, b] = 0.0
    heap = [(apart(a, b, c, d), a * ny + b)]
    while len(heap) > 0:
        through, code = heapq.heappop(heap)
        x, y = code // ny, code % ny
        here = length[x, y]
        if through > most:
            break
        if through > here + apart(x, y, c, d):
            continue
        if x == c and y == d:
            most = here + around
        for ex in range(-2, 3):
            for ey in range(-2, 3):
                # Moves of a knight too: ways in 16 directions.
                if (ex == 0 and ey == 0) or (abs(ex) == 2 and abs(ey) != 1) or (abs(ey) == 2 and abs(ex) != 1):
                    continue
                u, v = x + ex, y + ey
                if u < 0 or v < 0 or u >= nx or v >= ny:
                    continue
                each = 0.5 * (cost[x, y] + cost[u, v])
                if abs(ex) + abs(ey) == 3:
                    # What such a move passes over counts too, or thin walls would be jumped.
                    a1, b1 = x + ex // 2 if abs(ex) == 2 else x, y + ey // 2 if abs(ey) == 2 else y
                    each = max(each, max(cost[a1, b1], cost[u - (a1 - x), v - (b1 - y)]))
                step = np.sqrt(ex * ex + ey * ey) * each
                if here + step < length[u, v]:
                    length[u, v] = here + step
                    heapq.heappush(heap, (here + step + apart(u, v, c, d), u * ny + v))
    return length, most


@kernel
def shortest_path(length: Array, c: int, d: int, most: float) -> list[tuple[int, int]]:
    """The cells on the way from (c, d) to where the length is 0; none if it comes to where lengths are not known."""
    at, path = (c, d), [(c, d)]
    while length[c, d] > 0.0 and len(path) < 4096:
        if length[c, d] + apart(c, d, at[0], at[1]) + KNIGHT > most:
            path.clear()
            break
        best, e, f = length[c, d], c, d
        for ex in range(-2, 3):
            for ey in range(-2, 3):
                if (abs(ex) == 2 and abs(ey) != 1) or (abs(ey) == 2 and abs(ex) != 1):
                    continue
                u, v = c + ex, d + ey
                if u >= 0 and v >= 0 and u < length.shape[0] and v < length.shape[1] and length[u, v] < best:
                    best, e, f = length[u, v], u, v
        if e == c and f == d:
            break
        c, d = e, f
        path.append((c, d))
    return path


@kernel
def line_of_sight(cost: Array, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether all cells on the line between two places, in cells, are free but for the first ones.

    Where it begins in a narrow one, others will do.
    """
    length = np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
    here = cost[min(max(int(np.round(x0)), 0), cost.shape[0] - 1), min(max(int(np.round(y0)), 0), cost.shape[1] - 1)]
    most = min(here, NARROW)
    steps = int(np.ceil(2.0 * length)) + 1
    for k in range(steps + 1):
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
        a = min(max(int(np.round(x)), 0), cost.shape[0] - 1)
        b = min(max(int(np.round(y)), 0), cost.shape[1] - 1)
        # A robot that touches something stands in a cell that rounding may call taken.
        if cost[a, b] > most and length * k / steps > 1.5:
            return False
    return True


@kernel
def goal_in_sight(
    grid: Array, clearance: Array, reach: float, places: Array, radii: Array, parked: Indices, i: int, goal: Array
) -> bool:
    """Whether robot i `sees` its goal, without the map of all cells: for most robots at most times that is enough."""
    width = grid[2]
    x0, y0 = (places[i, 0] - grid[0]) / width, (places[i, 1] - grid[1]) / width
    x1, y1 = (goal[0] - grid[0]) / width, (goal[1] - grid[1]) / width
    length = np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
    near, count = np.empty(len(parked), np.int64), 0
    for k in parked:
        # On the line rounded to cells, and with one cell to spare.
        x, y, r = (places[k, 0] - grid[0]) / width, (places[k, 1] - grid[1]) / width, (radii[k] + reach) / width + 1.0
        along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / max(length * length, 1e-300)
        along = min(1.0, max(0.0, along))
        if k != i and (x - x0 - along * (x1 - x0)) ** 2 + (y - y0 - along * (y1 - y0)) ** 2 <= r * r:
            near[count] = k
            count += 1
    nx, ny = clearance.shape
    steps, most = int(np.ceil(2.0 * length)) + 1, 0.0
    for n in range(steps + 1):
        x, y = x0 + (x1 - x0) * n / steps, y0 + (y1 - y0) * n / steps
        a, b = min(max(int(np.round(x)), 0), nx - 1), min(max(int(np.round(y)), 0), ny - 1)
        cost = 1.0
        if clearance[a, b] < reach:
            cost = WALL if clearance[a, b] < reach - 0.7 * width else NARROW
        for m in range(count):
            k = near[m]
            px, py, r = (places[k, 0] - grid[0]) / width, (places[k, 1] - grid[1]) / width, (radii[k] + reach) / width
            if (a - px) ** 2 + (b - py) ** 2 < r * r:
                cost = max(cost, THROUGH)
        if n == 0:
            most = min(cost, NARROW)
        elif cost > most and length * n / steps > 1.5:
            return False
    return True


@kernel
def next_waypoint(grid: Array, cost: Array, px: float, py: float, gx: float, gy: float, corner: Array) -> bool:
    """Whether the straight way to a goal is not free; then the farthest place on the shortest way that is seen."""
    shape = cost.shape
    x0, y0, x1, y1 = (
        (px - grid[0]) / grid[2],
        (py - grid[1]) / grid[2],
        (gx - grid[0]) / grid[2],
        (gy - grid[1]) / grid[2],
    )
    if line_of_sight(cost, x0, y0, x1, y1):
        return False
    a, b = cell_of(grid, shape, gx, gy)
    c, d = cell_of(grid, shape, px, py)
    # Few cells besides those on the way are needed; all of them where that was too few.
    length, most = path_lengths(cost, a, b, c, d, AROUND)
    path = shortest_path(length, c, d, most)
    if len(path) == 0:
        length, most = path_lengths(cost, a, b, c, d, np.inf)
        path = shortest_path(length, c, d, most)
    chosen = min(len(path) - 1, 2)
    for k in range(len(path) - 1, chosen, -1):
        if line_of_sight(cost, x0, y0, float(path[k][0]), float(path[k][1])):
            chosen = k
            break
    corner[0], corner[1] = grid[0] + grid[2] * path[chosen][0], grid[1] + grid[2] * path[chosen][1]
    return True
