"""Ways of vehicles into narrow places: the share that is found, and the time, by kind.

usage: python benchmarks/parking.py [--quick] [--cases 200] [--seed 0] [--kinds parallel dock] [--out FOLDER]

Cases are drawn anew for each seed. A car of 4.5 m by 1.8 m (wheelbase 2.7 m, steering up to 0.6 rad) parks between
cars at a kerb and in slots across an aisle, leaves such a slot, and changes from one slot to another. A differential
drive of 0.6 m by 0.5 m docks with 0.1 m at each side, in a room with columns. A cart that cannot reverse docks with
0.15 m at each side. It starts with 1.5 m of free space ahead; from there need not be a way. Times are processor times.
"""

from collections.abc import Callable
from math import cos, pi, sin, tan
from time import process_time
from typing import Any, Final, NamedTuple

import numpy as np
import shapely
from program import finish, options, table, target

from slalom import Disc, Rectangle
from slalom.vehicle.curves import reversals
from slalom.vehicle.sweep import outline
from slalom.vehicle.ways import WayFound, way_among

CAR: Final = Rectangle(4.5, 1.8)
CAR_CENTER: Final = 1.35
CAR_RADIUS: Final = 2.7 / tan(0.6)


class Case(NamedTuple):
    """Arguments of `way_among`."""

    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    body: Rectangle
    obstacles: list[Any]
    options: dict[str, Any]

    def found(self, **changed: Any) -> WayFound:
        """The way of the case."""
        return way_among(self.start, self.goal, self.body, self.obstacles, **self.options | changed)


def of_car(start: tuple[float, float, float], goal: tuple[float, float, float], obstacles: list[Any]) -> Case:
    """The case of the car."""
    return Case(start, goal, CAR, obstacles, {"radius": CAR_RADIUS, "center": CAR_CENTER, "clearance": 0.2})


def parked(x: float, y: float, heading: float) -> Any:
    """The outline of a car with its middle at a place."""
    return outline(CAR, (x, y), heading)


def parallel(rng: np.random.Generator, gap: tuple[float, float] = (5.5, 7.0)) -> Case:
    """Between two cars at a kerb; other cars are across the lane."""
    room = rng.uniform(*gap)
    cars = [parked(side * (0.5 * room + 2.25), rng.uniform(-0.1, 0.1), rng.uniform(-0.02, 0.02)) for side in (1, -1)]
    across = rng.uniform(5.2, 7.0)
    walls = [shapely.box(-30.0, -2.0, 30.0, -1.1), shapely.box(-30.0, across, 30.0, across + 1.0)]
    start = (rng.uniform(-8.0, 6.0), rng.uniform(2.3, 3.0), rng.uniform(-0.2, 0.2))
    return of_car(start, (-1.35, 0.0, 0.0), cars + walls)


def slots(rng: np.random.Generator) -> tuple[list[Any], list[float], float]:
    """Cars across an aisle with two free slots of 2.6 m to 3 m in a row: obstacles, middles, width of the aisle."""
    aisle, width = rng.uniform(6.0, 7.5), rng.uniform(2.6, 3.0)
    # The axle of a free slot is in the middle of its width.
    free = 0.0, 2.0 * width
    cars = [parked(x, -2.4 + rng.uniform(-0.2, 0.2), 0.5 * pi) for x in width * np.arange(-3.0, 6.0) if x not in free]
    walls = [shapely.box(-30.0, -6.0, 30.0, -5.2), shapely.box(-30.0, aisle, 30.0, aisle + 1.0)]
    return cars + walls, list(free), aisle


def in_slot(x: float, forwards: bool) -> tuple[float, float, float]:
    """The pose of a car in a slot, nose in or tail in."""
    return (x, -2.4 + CAR_CENTER, -0.5 * pi) if forwards else (x, -2.4 - CAR_CENTER, 0.5 * pi)


def in_aisle(rng: np.random.Generator, aisle: float) -> tuple[float, float, float]:
    """A pose of the car in the aisle, along it."""
    return rng.uniform(-9.0, 9.0), rng.uniform(1.6, aisle - 1.6), rng.integers(2) * pi + rng.uniform(-0.1, 0.1)


def perpendicular(rng: np.random.Generator) -> Case:
    """From the aisle into a slot."""
    obstacles, free, aisle = slots(rng)
    return of_car(in_aisle(rng, aisle), in_slot(free[0], bool(rng.integers(2))), obstacles)


def leaving(rng: np.random.Generator) -> Case:
    """From a slot into the aisle."""
    obstacles, free, aisle = slots(rng)
    return of_car(in_slot(free[0], bool(rng.integers(2))), in_aisle(rng, aisle), obstacles)


def changing(rng: np.random.Generator) -> Case:
    """From one slot into another."""
    obstacles, free, _ = slots(rng)
    first, last = (in_slot(x, bool(rng.integers(2))) for x in free)
    return of_car(first, last, obstacles)


def room(rng: np.random.Generator, half: float, apart: float) -> list[Any]:
    """A room of 8 m with a dock of the half width at the origin, and six columns that keep a distance from it."""
    walls = [shapely.box(side * half, -0.8, side * 4.2, 0.0) for side in (1.0, -1.0)]
    walls += [shapely.box(-4.2, -1.0, 4.2, -0.8), shapely.box(-4.2, 6.0, 4.2, 6.2)]
    walls += [shapely.box(side * 4.0, -1.0, side * 4.2, 6.2) for side in (1.0, -1.0)]
    places = rng.uniform((-3.5, 0.8), (3.5, 5.5), (6, 2))
    columns = [outline(Disc(0.2), place) for place in places if np.hypot(*(place - (0.0, 0.5))) > apart]
    return walls + columns


def free_start(
    rng: np.random.Generator, body: Rectangle, obstacles: list[Any], ahead: float = 0.0
) -> tuple[float, float, float]:
    """A pose of the middle of a body in the room, 0.1 m from all obstacles on the first metres `ahead`."""
    longer = Rectangle(body.length + ahead, body.width)
    while True:
        x, y, heading = rng.uniform(-3.2, 3.2), rng.uniform(1.0, 5.2), rng.uniform(-pi, pi)
        middle = x + 0.5 * ahead * cos(heading), y + 0.5 * ahead * sin(heading)
        if shapely.distance(outline(longer, middle, heading), obstacles).min() > 0.1:
            return x, y, heading


def dock(rng: np.random.Generator) -> Case:
    """A differential drive into a dock with 0.1 m at each side."""
    body = Rectangle(0.6, 0.5)
    obstacles = room(rng, 0.35, 0.9)
    start = free_start(rng, body, obstacles)
    return Case(start, (0.0, -0.4, -0.5 * pi), body, obstacles, {"turns_on_spot": True, "clearance": 0.1})


def cart(rng: np.random.Generator) -> Case:
    """A cart that cannot reverse, into a dock with 0.15 m at each side."""
    body = Rectangle(1.0, 0.6)
    obstacles = room(rng, 0.45, 1.5)
    # Nearer to a wall ahead of it, it could only stay there.
    start = free_start(rng, body, obstacles, ahead=1.5)
    # The axle is 0.3 m behind the middle.
    start = (start[0] - 0.3 * cos(start[2]), start[1] - 0.3 * sin(start[2]), start[2])
    options = {"radius": 0.8, "center": 0.3, "reverse": False, "clearance": 0.1}
    return Case(start, (0.0, 0.1, -0.5 * pi), body, obstacles, options)


KINDS: Final[dict[str, Callable[[np.random.Generator], Case]]] = {
    "parallel": parallel,
    "perpendicular": perpendicular,
    "leaving": leaving,
    "changing": changing,
    "dock": dock,
    "cart": cart,
}
"""Kinds of cases by name."""


def drawn(kind: str, seed: int) -> Case:
    """The case of a kind with this seed."""
    return KINDS[kind](np.random.default_rng([seed, list(KINDS).index(kind)]))


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    arguments = parser.parse_args()
    each = 1 if arguments.quick else -(-arguments.cases // len(arguments.kinds))
    rows, slowest = [], 0.0
    for kind in arguments.kinds:
        times, ways = [], []
        for k in range(each):
            case = drawn(kind, arguments.seed + k)
            begin = process_time()
            ways.append(case.found())
            times.append(process_time() - begin)
        found = [one.way for one in ways if one.way is not None]
        slowest = max(slowest, max(times))
        turns = np.mean([reversals(way) for way in found]) if found else np.nan
        searched = float(np.median([one.searched for one in ways]))
        kept = 100.0 * np.mean([one.kept for one in ways])
        late = np.percentile(times, 90)
        unsolved = " ".join(str(arguments.seed + k) for k, one in enumerate(ways) if one.way is None)
        times_s = float(np.median(times)), float(late), max(times)
        rows.append([kind, each, 100.0 * len(found) / each, *times_s, searched, float(turns), kept, unsolved])
    heads = ["kind", "cases", "found %", "median s", "90 % s", "longest s", "poses", "reversals", "kept %", "not found"]
    result = {
        "question": "Ways of vehicles into narrow places.",
        "parameters": {"cases": each * len(arguments.kinds), "seed": arguments.seed},
        "tables": [table("Ways into narrow places:", heads, rows)],
        "targets": [target("longest search", slowest, most=2.0, unit="s")],
    }
    finish("parking", result, arguments)


if __name__ == "__main__":
    main()
