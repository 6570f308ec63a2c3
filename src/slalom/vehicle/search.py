"""The search for ways among obstacles: two trees of poses that are joined by direct curves. See `ways`.

One tree grows from the start, one against the driving direction from the goal. The order of poses is that of hybrid A*:
the cost so far and an estimate of the rest, one pose to a cell. Sources: Dolgov, Thrun, Montemerlo & Diebel 2010;
Kuffner & LaValle 2000 (two trees that are joined); Pohl 1971 (the tree with fewer open poses goes on).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from math import inf, pi
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.kernels.arrays import Indices
from slalom.vehicle.curves import (
    BOTH,
    DUBINS,
    REEDS_SHEPP,
    TO_PLACE,
    TO_PLACE_REVERSING,
    Arc,
    Words,
    moved,
    turning_words,
    words,
)
from slalom.vehicle.sweep import Scene

REVERSAL: Final = 0.5
"""[1] Cost of a change of direction, in distances of the farthest point of the body from the axle. Larger: longer ways
with fewer reversals. Smaller: the reverse."""

ON_THE_SPOT: Final = 0.5
"""[1] Cost of a turn on the spot by 1 rad, in distances of the farthest point of the body from the axle. Larger: fewer
turns on the spot. Smaller: the vehicle turns away and back."""

CLOSENESS: Final = 1.0
"""[1] Cost of a metre without the clearance, in addition to its length. Larger: longer detours with the clearance. 0:
the clearance is not kept."""

RUNS: Final = (1, 2, 4, 8)
"""[1] Numbers of steps after which a new pose is kept, besides that at the last clear step. More, or larger ones: fewer
poses are searched, each with more work."""

PARTS: Final = 4
"""[1] Parts of a step by which the vehicle still approaches an obstacle. More: narrow places are left by fewer
reversals, each pose with more work. Fewer: the reverse."""

BATCH: Final = 16
"""[1] Poses that are continued at the same time. More: less overhead of a pose, poses in a worse order."""

NEIGHBOURS: Final = 3
"""[1] Poses of the other tree, the nearest ones, to which each pose is joined. More: a way is found after fewer poses,
each with more work."""

SPREAD: Final = 2
"""[1] Further poses of the other tree to which each pose is joined, distributed over the tree. See NEIGHBOURS."""

TRIED: Final = 4
"""[1] Direct curves between two poses that are tested, the cheapest first. More: a way is found after fewer poses, each
with more work."""

GREEDY: Final = 1.5
"""[1] Weight of the distance to the other end in the order of poses. Larger: the search goes straight to the other end.
1: it searches all poses with a smaller cost first."""

AFTERWARDS: Final = 0.5
"""[1] Poses that are searched for a cheaper way after the first one, as a share of those before. Larger: cheaper ways,
later. 0: the first one is taken."""


# How a vehicle drives, and what its arcs cost.


@dataclass(frozen=True)
class Driving:
    """Arcs and direct curves of a vehicle, and their costs.

    `radius` [m] is the least of its turns, `scale` [m] the distance of the farthest point of its body from the axle.
    """

    radius: float
    reverse: bool
    turns_on_spot: bool
    scale: float

    @property
    def gears(self) -> tuple[float, ...]:
        """1 for forwards, -1 for backwards."""
        return BOTH if self.reverse else BOTH[:1]

    def words(self, starts: Array, goals: Array, wider: float = 1.0) -> Words:
        """Direct curves from poses (n, 3) to poses (n, 3), with turns of `wider` times the least radius."""
        if self.turns_on_spot:
            return turning_words(starts, goals, self.gears)
        return words(starts, goals, wider * self.radius, REEDS_SHEPP if self.reverse else DUBINS, self.gears)

    def to_place(self, start: Array, place: Array, wider: float) -> Words:
        """Direct curves from a pose (3,) to a place (2,) with any heading there."""
        families = TO_PLACE_REVERSING if self.reverse else TO_PLACE
        return words(start[None], np.append(place[:2], 0.0)[None], wider * self.radius, families, self.gears)

    def moves(self, step: float) -> Array:
        """Arcs (m, 2) of a step [m]: to both sides and straight."""
        if self.turns_on_spot:
            turns = [(0.0, side * step / self.scale) for side in (1.0, -1.0)]
            return np.array([(gear * step, 0.0) for gear in self.gears] + turns)
        curvatures = np.array([1.0, 0.0, -1.0]) / self.radius
        return np.array([(gear * step, gear * step * each) for gear in self.gears for each in curvatures])

    def cost(self, lengths: Array, turns: Array) -> Array:
        """Costs (...) [m] of arcs (...) that keep the clearance."""
        return np.abs(lengths) + np.where(lengths == 0.0, ON_THE_SPOT * self.scale * np.abs(turns), 0.0)

    def reversals(self, lengths: Array, first: Array, last: Array) -> Array:
        """Costs (...) [m] of changes of direction in words (..., w), from directions `first` to `last` (...), or 0."""
        count = np.zeros(np.broadcast_shapes(lengths.shape[:-1], first.shape, last.shape))
        before = np.broadcast_to(first, count.shape)
        for gear in [*np.moveaxis(np.sign(lengths), -1, 0), last]:
            count += gear * before < 0.0
            before = np.where(gear != 0.0, gear, before)
        return REVERSAL * self.scale * count

    def distance(self, a: Array, b: Array) -> Array:
        """Lower bounds (n, m) [m] on the length of ways between poses (n, 3) and (m, 3), or on their cost."""
        x, y, angle = (a[:, None, k] - b[None, :, k] for k in range(3))
        turn = np.abs((angle + pi) % (2.0 * pi) - pi)
        return np.maximum(np.hypot(x, y), turn * (ON_THE_SPOT * self.scale if self.turns_on_spot else self.radius))


class Judge(NamedTuple):
    """What arcs cost among the obstacles of a scene, with a `clearance` [m] that is kept where possible."""

    scene: Scene
    driving: Driving
    clearance: float

    def chains(self, poses: Array, arcs: Array, chain: Indices, place: Indices) -> tuple[Indices, Array]:
        """The place of the first arc of each chain that is not clear, and the costs (n,) [m] of arcs (n,).

        Arguments: see `Scene.until`; arcs (n, 2). Arcs that are not clear, and later ones of their chains, cost inf.
        """
        lengths, turns = arcs[:, 0], arcs[:, 1]
        until = self.scene.until(poses, lengths, turns, chain, place)
        clear = np.flatnonzero(place < until[chain])
        cost = np.full(len(poses), inf)
        cost[clear] = self.driving.cost(lengths[clear], turns[clear])
        if self.clearance > 0.0:
            kept = self.scene.clear(poses[clear], lengths[clear], turns[clear], self.clearance)
            cost[clear] *= np.where(kept, 1.0, 1.0 + CLOSENESS)
        return until, cost

    def costs(self, poses: Array, lengths: Array, turns: Array) -> Array:
        """Costs (n,) [m] of words (n, w) from poses (n, 3); inf if they are not clear.

        Arcs are cut into pieces of at most the size of the body: each costs as much as it is near to obstacles.
        """
        n, w = lengths.shape
        arcs = np.stack([lengths, turns], axis=2)
        ends = [poses]
        for k in range(w):
            ends.append(moved(ends[-1], lengths[:, k], turns[:, k]))
        size = np.abs(lengths) + self.driving.scale * np.abs(turns)
        pieces = np.ceil(size / self.driving.scale).astype(np.int64).ravel()
        owner = np.repeat(np.arange(n * w), pieces)
        part = np.arange(len(owner)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        short = (arcs.reshape(-1, 2) / np.maximum(pieces, 1)[:, None])[owner]
        at = moved(np.stack(ends[:-1], axis=1).reshape(-1, 3)[owner], part * short[:, 0], part * short[:, 1])
        _, cost = self.chains(at, short, owner // w, np.zeros_like(owner))
        return np.bincount(owner // w, cost, minlength=n).astype(np.float64)

    def keeps(self, poses: Array, lengths: Array, turns: Array) -> bool:
        """Whether arcs (n,) from poses (n, 3) keep the clearance."""
        return bool(self.scene.clear(poses, lengths, turns, self.clearance).all())


# Lengths of shortest ways of a disc among obstacles at rest, on a grid: estimates for the search of ways.
#
# The estimates order the poses of a search only. No way is accepted or refused for them.


CELLS: Final = 10000
"""[1] Most cells of a grid. More: larger worlds at full resolution, a later begin of the search."""

CELL: Final = 0.67
"""[1] Width of cells in inner radii of the body, where CELLS suffice. Larger: narrow passages are closed on the grid.
Smaller: more cells."""

BLOCKED: Final = 50.0
"""[1] Cost of a length in cells at obstacles; finite, as a cell at an obstacle may be free. Larger: narrow passages are
tried later than long detours. Smaller: the search pushes against walls."""

AROUND: Final = 6.0
"""[1] Least margin of the grid around start and goal, in distances of the farthest point of the body from the axle.
Larger: longer detours are estimated, in larger cells. Smaller: poses outside count as if nothing were between."""


class Field:
    """Lengths of shortest ways of a disc to the nearest of some places among the obstacles of a scene.

    Args:
        scene: the body and its obstacles. roots: (n, 3) poses at which the way is 0 long. others: (m, 3) further poses
            that the grid contains.
    """

    def __init__(self, scene: Scene, roots: Array, others: Array) -> None:
        self.scene = scene
        places = self._middles(np.concatenate([roots, others]))
        low, high = places.min(axis=0), places.max(axis=0)
        margin = max(float((high - low).max()), AROUND * scene.scale)
        size = high - low + 2.0 * margin
        inner = max(scene.inner, 1e-3 * scene.scale)
        self.width = max(CELL * inner, float(np.sqrt(size.prod() / CELLS)))
        self.origin = low - margin
        self.shape = (np.floor(size / self.width) + 1.0).astype(np.int64)
        grid = np.stack(np.meshgrid(*map(np.arange, self.shape), indexing="ij"), axis=-1)
        near = scene.near(self.origin + self.width * grid.reshape(-1, 2), max(inner - 0.5 * self.width, self.width))
        factor = np.where(near, BLOCKED, 1.0).reshape(self.shape)
        first = np.full(self.shape, np.inf)
        first[*self._cells(places[: len(roots)]).T] = 0.0
        self.lengths = self.width * _spread(first, factor)

    def _middles(self, poses: Array) -> Array:
        """The middles (n, 2) of the body at poses (n, 3)."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x, y = self.scene.bodies[0].middle
        return np.asarray(poses[:, :2] + np.stack([c * x - s * y, s * x + c * y], axis=1))

    def _cells(self, places: Array) -> Indices:
        """The cells (n, 2) that are nearest to places (n, 2)."""
        cells = np.round((places - self.origin) / self.width).astype(np.int64)
        return np.asarray(np.clip(cells, 0, self.shape - 1))

    def __call__(self, poses: Array) -> Array:
        """Lengths (n,) [m] of the shortest ways of the disc from poses (n, 3)."""
        places = self._middles(poses)
        cells = self._cells(places)
        outside = np.abs((places - self.origin) / self.width - cells).max(axis=1) - 0.5
        return np.asarray(self.lengths[cells[:, 0], cells[:, 1]] + self.width * np.maximum(outside, 0.0))


def _spread(lengths: Array, factor: Array) -> Array:
    """Lengths (nx, ny) [cell] of the shortest ways from cells of length 0, moving to the 8 neighbours of cells."""
    moves = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
    padded = np.pad(lengths, 1, constant_values=np.inf)
    inside = padded[1:-1, 1:-1]
    nx, ny = lengths.shape
    while True:
        before = inside.copy()
        for a, b in moves:
            beside = padded[1 + a : 1 + a + nx, 1 + b : 1 + b + ny]
            np.minimum(inside, beside + np.hypot(a, b) * factor, out=inside)
        if np.array_equal(before, inside):
            return before


# A tree of poses.


def _driven(poses: Array, arcs: Array, shares: Array | Indices) -> Array:
    """Poses (n, 3) after shares (n,) of arcs (n, 2) from poses (n, 3)."""
    return moved(poses, shares * arcs[:, 0], shares * arcs[:, 1])


class Tree:
    """Poses with the cheapest known ways to them, or from them, along arcs of one step.

    Args:
        roots: (n, 3) poses. side: 1 for ways from the roots, -1 for ways to them. step: [m]. others: (m, 3) the roots
            of the other tree. field: lengths of ways of a disc to them.
    """

    def __init__(self, judge: Judge, roots: Array, side: float, step: float, others: Array, field: Field) -> None:
        self.judge = judge
        self.side, self.step = side, step
        self.others, self.field = others, field
        self.arcs = side * judge.driving.moves(step)
        self.poses = [*roots]
        self.costs = [0.0] * len(roots)
        self.gears = [0.0] * len(roots)
        self.parents: list[tuple[int, Arc] | None] = [None] * len(roots)
        self.closed: list[int] = []
        self._best: dict[tuple[int, int, int], float] = {}
        self.queue = [(bound, k) for k, bound in enumerate(self._to_go(roots).tolist())]
        heapify(self.queue)

    def _to_go(self, poses: Array) -> Array:
        """Estimates (n,) [m] of the costs from poses (n, 3) to the other tree."""
        least = self.judge.driving.distance(poses, self.others).min(axis=1)
        return np.asarray(GREEDY * np.maximum(least, self.field(poses)))

    def pop(self) -> list[int]:
        """Up to BATCH poses from which the search goes on, the most promising first."""
        found: list[int] = []
        while self.queue and len(found) < BATCH:
            k = heappop(self.queue)[1]
            if self.parents[k] is None or self._best[self._cell(self.poses[k])] == self.costs[k]:
                found.append(k)
        self.closed += found
        return found

    def _cell(self, pose: Array) -> tuple[int, int, int]:
        return self._cells(pose[None])[0]

    def _cells(self, poses: Array) -> list[tuple[int, int, int]]:
        """The cells of poses (n, 3): of each only the cheapest pose is continued."""
        size = 0.5 * self.step
        turn = size / self.judge.driving.scale
        place = np.floor(poses / (size, size, turn))
        place[:, 2] = np.floor(poses[:, 2] % (2.0 * pi) / turn)
        return [(int(x), int(y), int(angle)) for x, y, angle in place]

    def expand(self, nodes: Sequence[int]) -> None:
        """Add the poses after clear arcs from poses of the tree: after RUNS, and at the end of what is clear.

        Each arc consists of steps, and from the last clear one of shorter steps.
        """
        m, most = len(self.arcs), RUNS[-1]
        parent, arc = (each.ravel() for each in np.meshgrid(nodes, np.arange(m), indexing="ij"))
        at = np.stack([self.poses[k] for k in nodes]).repeat(m, axis=0)
        until, cost = self._clear(at, self.arcs[arc], most)
        stopped = np.flatnonzero(until < most)
        short = self.arcs[arc[stopped]] / PARTS
        more, rest = self._clear(_driven(at[stopped], self.arcs[arc[stopped]], until[stopped]), short, PARTS - 1)
        found = []
        for run in RUNS:
            chain = np.flatnonzero(until >= run)
            found.append((chain, np.full(len(chain), float(run)), cost[chain, run]))
        ahead = np.flatnonzero(until[stopped] * PARTS + more > 0)
        chain = stopped[ahead]
        shares = until[chain] + more[ahead] / PARTS
        # Where the last step of a run is the last clear one, the pose is there already.
        found.append((chain, shares, cost[chain, until[chain]] + rest[ahead, more[ahead]]))
        chain, shares, costs = (np.concatenate(each) for each in zip(*found))
        self._add(parent[chain], self.arcs[arc[chain]], shares, costs, at[chain])

    def _clear(self, poses: Array, arcs: Array, most: int) -> tuple[Indices, Array]:
        """The number (n,) of clear arcs in a row from poses (n, 3), up to `most`, and costs (n, most + 1) so far."""
        n = len(poses)
        chain, place = np.divmod(np.arange(n * most), most)
        until, cost = self.judge.chains(_driven(poses[chain], arcs[chain], place), arcs[chain], chain, place)
        return np.minimum(until, most), np.cumsum(np.pad(cost.reshape(n, most), ((0, 0), (1, 0))), axis=1)

    def _add(self, parents: Indices, arcs: Array, shares: Array, costs: Array, at: Array) -> None:
        """Add the poses after `shares` (n,) of arcs (n, 2), with their costs (n,) [m], from poses `at` (n, 3)."""
        driving = self.judge.driving
        ahead = np.sign(self.side * arcs[:, 0])
        gear = np.array([self.gears[k] for k in parents.tolist()])
        costs = costs + np.array([self.costs[k] for k in parents.tolist()])
        costs += REVERSAL * driving.scale * (gear * ahead < 0.0)
        poses = _driven(at, arcs, shares)
        bound = self._to_go(poses)
        gears = np.where(ahead == 0.0, gear, ahead)
        driven = self.side * shares[:, None] * arcs
        rows = zip(self._cells(poses), costs.tolist(), bound.tolist(), gears.tolist(), parents.tolist())
        for k, (cell, g, h, direction, parent) in enumerate(rows):
            if g < self._best.get(cell, inf):
                self._best[cell] = g
                heappush(self.queue, (g + h, len(self.poses)))
                self.poses.append(poses[k])
                self.costs.append(g)
                self.gears.append(direction)
                self.parents.append((parent, Arc(*driven[k].tolist())))

    def branch(self, k: int) -> tuple[int, list[Arc]]:
        """The root of a pose of the tree, and the arcs between both in the order in which they are driven."""
        arcs = []
        while (parent := self.parents[k]) is not None:
            k, arc = parent
            arcs.append(arc)
        return k, arcs[::-1] if self.side > 0.0 else arcs


class Candidate(NamedTuple):
    """A way that was found: its cost [m], its arcs and the index of its goal."""

    cost: float
    arcs: Sequence[Arc]
    goal: int


NONE: Final = Candidate(inf, (), -1)


class Joint(NamedTuple):
    """Direct curves between pairs of poses of two trees, the cheapest without obstacles: lengths and turns (n, w).

    `pair` (n,) is the pair of each, `bound` (n,) its cost [m] without obstacles.
    """

    lengths: Array
    turns: Array
    pair: Indices
    bound: Array


def joints(driving: Driving, found: Words, gears: Array, count: int | None = None) -> Joint:
    """The cheapest `count` words of each of n pairs of poses, with directions (n, 2) before and after."""
    bound = driving.cost(found.lengths, found.turns).sum(axis=2)
    bound += driving.reversals(found.lengths, gears[:, :1], gears[:, 1:])
    bound[~np.isfinite(found.total)] = inf
    order = np.argsort(bound, axis=1, kind="stable")[:, :count]
    pair = np.repeat(np.arange(len(order)), order.shape[1])
    word = order.ravel()
    known = np.isfinite(bound[pair, word])
    pair, word = pair[known], word[known]
    return Joint(found.lengths[pair, word], found.turns[pair, word], pair, bound[pair, word])


def arcs_of(lengths: Array, turns: Array) -> list[Arc]:
    """The arcs of one word (w,)."""
    return [Arc(*arc) for arc in zip(lengths.tolist(), turns.tolist()) if any(arc)]


class Search:
    """The search of one step [m] between `ends`: starts (n, 3) and goals (m, 3), with the `fields` of both."""

    def __init__(self, judge: Judge, ends: tuple[Array, Array], step: float, fields: tuple[Field, Field]) -> None:
        self.judge = judge
        starts, goals = ends
        self.trees = Tree(judge, starts, 1.0, step, goals, fields[1]), Tree(judge, goals, -1.0, step, starts, fields[0])
        self.searched = 0
        self.best = NONE

    def run(self, most: int, best: Candidate) -> bool:
        """Search for a cheaper way than the `best`. Return whether it ended before the largest number of poses."""
        self.best = best
        last = most
        while self.searched < last:
            turn = int(len(self.trees[1].queue) < len(self.trees[0].queue))
            tree = self.trees[turn]
            nodes = tree.pop()
            if not nodes:
                return True
            self.searched += len(nodes)
            if self.join(nodes, turn):
                last = min(last, int((1.0 + AFTERWARDS) * self.searched))
            tree.expand([k for k in nodes if tree.costs[k] < self.best.cost])
        return False

    def join(self, nodes: Sequence[int], side: int) -> bool:
        """Join poses of one tree to the other. Return whether this is the first way, or a cheaper one."""
        one, other = self.trees[side], self.trees[1 - side]
        near = other.closed if other.closed else [k for k, parent in enumerate(other.parents) if parent is None]
        a, b = (np.stack([tree.poses[k] for k in which]) for tree, which in ((one, nodes), (other, near)))
        rest = np.array([other.costs[k] for k in near])
        order = np.argsort(rest + 2.0 * self.judge.driving.distance(a, b), axis=1, kind="stable")[:, :NEIGHBOURS]
        # Nearest poses may all be behind one obstacle: others of the tree follow by turns.
        count = SPREAD * len(nodes)
        spread = (self.searched + np.arange(count) * len(near) // count).reshape(len(nodes), SPREAD) % len(near)
        order = np.concatenate([order, spread], axis=1)
        pairs = [(nodes[i], near[j]) for i in range(len(nodes)) for j in dict.fromkeys(order[i].tolist())]
        ends = [pair if side == 0 else pair[::-1] for pair in pairs]
        first, last = self.trees
        starts = np.stack([first.poses[i] for i, _ in ends])
        goals = np.stack([last.poses[j] for _, j in ends])
        gears = np.array([(first.gears[i], last.gears[j]) for i, j in ends], np.float64)
        known = np.array([first.costs[i] + last.costs[j] for i, j in ends], np.float64)
        driving = self.judge.driving
        found = joints(driving, driving.words(starts, goals), gears, TRIED)
        bound = known[found.pair] + found.bound
        tried = np.flatnonzero(bound < self.best.cost)
        pair = found.pair[tried]
        costs = self.judge.costs(starts[pair], found.lengths[tried], found.turns[tried])
        costs += known[pair] + driving.reversals(found.lengths[tried], gears[pair, 0], gears[pair, 1])
        if not len(costs) or costs.min() >= self.best.cost:
            return False
        k = int(costs.argmin())
        _, before = first.branch(ends[pair[k]][0])
        goal, after = last.branch(ends[pair[k]][1])
        arcs = arcs_of(found.lengths[tried[k]], found.turns[tried[k]])
        self.best = Candidate(float(costs[k]), [*before, *arcs, *after], goal)
        return True


def merged(arcs: Sequence[Arc]) -> list[Arc]:
    """The arcs with successive ones of one curvature and direction as one."""
    found: list[Arc] = []
    for arc in arcs:
        last = found[-1] if found else None
        if (
            last is not None
            and last.length * arc.length + last.turn * arc.turn > 0.0
            and (abs(last.length * arc.turn - arc.length * last.turn) <= 1e-12 * abs(arc.length + arc.turn))
        ):
            found[-1] = Arc(last.length + arc.length, last.turn + arc.turn)
        else:
            found.append(arc)
    return found


def shortened(judge: Judge, start: Array, found: Candidate) -> Candidate:
    """The cheapest way through ends of arcs of a way, along its arcs and direct curves between them."""
    arcs = merged(found.arcs)
    n = len(arcs)
    if n < 2:
        return found
    poses = [start]
    for arc in arcs:
        poses.append(moved(poses[-1], arc.length, arc.turn))
    pairs = np.array([(i, j) for i in range(n) for j in range(i + 2, n + 1)])
    ends = np.stack(poses)
    between = judge.driving.words(ends[pairs[:, 0]], ends[pairs[:, 1]])
    tried = joints(judge.driving, between, np.zeros((len(pairs), 2)), TRIED)
    own = judge.costs(ends[:-1], *(np.array(arcs)[:, k, None] for k in (0, 1)))
    costs = judge.costs(ends[pairs[tried.pair, 0]], tried.lengths, tried.turns)
    edges: list[tuple[int, int, float, list[Arc]]] = [(k, k + 1, float(own[k]), [arcs[k]]) for k in range(n)]
    for k in np.flatnonzero(np.isfinite(costs)).tolist():
        i, j = pairs[tried.pair[k]].tolist()
        edges.append((i, j, float(costs[k]), arcs_of(tried.lengths[k], tried.turns[k])))
    edges.sort(key=lambda edge: edge[:3])
    # The cheapest way to each end by its last direction.
    best: list[dict[float, tuple[float, list[Arc]]]] = [{} for _ in range(n + 1)]
    best[0][0.0] = 0.0, []
    for i, j, cost, part in edges:
        for gear, (before, way) in best[i].items():
            lengths = np.array([arc.length for arc in part])
            total = before + cost + float(judge.driving.reversals(lengths, np.array(gear), np.array(0.0)))
            signs = [np.sign(arc.length) for arc in part if arc.length != 0.0]
            last = float(signs[-1]) if signs else gear
            if total < best[j].get(last, (inf, []))[0]:
                best[j][last] = total, [*way, *part]
    cost, way = min(best[n].values(), key=lambda each: each[0])
    return Candidate(cost, merged(way), found.goal)
