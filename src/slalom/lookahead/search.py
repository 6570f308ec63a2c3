"""Search over sequences of accelerations that continues over several decisions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import is_
from typing import Final

import numpy as np

from slalom import kernels
from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ADMISSIBLE, WHOLE_COUNT
from slalom.decision.tables import bounds_of
from slalom.kernels.arrays import Bodies, Indices
from slalom.kernels.sequence_search.tables import (
    AT_REST,
    BEST,
    CLOSED,
    FIXED,
    MEASURED,
    MOVING,
    NODES,
    OPEN,
    BoundTable,
    SearchProblem,
    SearchTree,
    SpacetimeIndex,
)
from slalom.model.bounds import Bound, axes
from slalom.model.goal import Goal
from slalom.model.limits import Limits, least_speed
from slalom.model.manoeuvre import Manoeuvre
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.shape import Shape
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.window import ObstacleWindow

# Predicted obstacles over a long time, indexed by time for fast queries.


@dataclass(frozen=True, eq=False)
class PredictedObstacles:
    """Pieces of all obstacles, grown by a robot's shape, from `start` to `end`, absolute times [s].

    Attributes:
        obstacles: those that the table was built for, if it serves more than one decision; else None.
        includes_future: whether obstacles that appear later are known now.
        index: the table. owner: (n,) the obstacle of each of its rows, in order.
    """

    obstacles: tuple[Obstacle, ...] | None
    includes_future: bool
    start: float
    end: float
    index: SpacetimeIndex
    owner: Indices

    @classmethod
    def of(
        cls,
        obstacles: Sequence[Obstacle] | None,
        predictions: Sequence[Obstacle],
        robot: Shape,
        start: float,
        end: float,
        width: float,
        *,
        include_future: bool = True,
    ) -> "PredictedObstacles":
        """Table of `predictions`, the obstacles on their predicted trajectories, indexed by intervals of `width` [s].

        Raises:
            InvalidInput: different dimensions, an end that is not after the start.
        """
        bodies = ObstacleWindow(predictions, start, end - start).bodies(robot)
        appearances = np.array([obstacle.trajectory.span[0] for obstacle in predictions], dtype=np.float64)
        index = _spacetime_index(bodies, appearances, start, end, width)
        owner = bodies.each["owner"][bodies.pieces.body]
        return cls(None if obstacles is None else tuple(obstacles), include_future, start, end, index, owner)

    def covers(self, obstacles: Sequence[Obstacle], now: float, until: float) -> bool:
        """Whether the table is still valid from `now` to `until` [s] for these obstacles: for the same objects."""
        if self.obstacles is None or not (self.start <= now and until <= self.end):
            return False
        return len(self.obstacles) == len(obstacles) and all(map(is_, self.obstacles, obstacles))

    def known_at(self, now: float) -> float:
        """Latest time [s] of appearance of the bodies that are known at `now` [s]."""
        return np.inf if self.includes_future else now

    def clearance(self, position: Array, now: float) -> float:
        """Distance [m] of a robot at `position` (d,) [m] from the nearest body at `now` [s]; inf without bodies."""
        s = self.index
        k = min(max(int((now - s.start) / s.width), 0), len(s.first) - 2)
        rows = s.row[s.first[k] : s.first[k + 1]]
        present = (s.times[rows, 0] <= now) & (s.times[rows, 1] >= now) & (s.appears[rows] <= now)
        rows = rows[present]
        if not len(rows):
            return np.inf
        fraction = (now - s.times[rows, 0]) / (s.times[rows, 1] - s.times[rows, 0])
        weights = np.stack(
            [
                (1 - fraction) ** 3,
                3 * fraction * (1 - fraction) ** 2,
                3 * fraction * fraction * (1 - fraction),
                fraction**3,
            ],
            axis=1,
        )
        positions, directions = np.zeros((len(rows), 3)), np.zeros((len(rows), 2))
        positions[:, : len(position)] = np.einsum("nj,njd->nd", weights, s.points[rows]) - position
        directions[:, 0] = 1.0
        if len(s.turns):
            directions = np.einsum("nj,njd->nd", weights, s.turns[rows])
        hull = s.hulls.hull[rows] if s.hulls else np.full(len(rows), -1)
        distances = kernels.distances(positions, directions, hull, s.hulls)
        return float((distances[:, 0] - s.radius[rows] - s.growth[rows] * fraction).min())


def _spacetime_index(bodies: Bodies, appearances: Array, start: float, end: float, width: float) -> SpacetimeIndex:
    rows = bodies.pieces
    times, body = rows.times + start, rows.body
    radius = rows.radius + bodies.radius[body]
    centers = rows.points.mean(axis=1)
    extents = np.linalg.norm(rows.points - centers[:, None], axis=2).max(axis=1, initial=0.0)
    first, row = _rows_by_interval(times, start, end, width)
    return SpacetimeIndex(
        times=times,
        points=np.ascontiguousarray(rows.points),
        radius=radius,
        growth=np.ascontiguousarray(rows.growth),
        turns=np.ascontiguousarray(rows.turns) if bodies.turning else np.empty((0, 4, 2)),
        centers=centers,
        bounding_radius=extents + radius + np.maximum(rows.growth, 0.0) + bodies.hull_radius[body],
        hull_radius=bodies.hull_radius[body],
        appears=appearances[bodies.owner[body]],
        hulls=bodies.hulls_of(body),
        start=float(start),
        width=float(width),
        first=first,
        row=row,
    )


def _rows_by_interval(times: Array, start: float, end: float, width: float) -> tuple[Indices, Indices]:
    """Rows that overlap each interval: those of interval k are row[starts[k]:starts[k + 1]]."""
    count = max(1, int(np.ceil((end - start) / width)))
    first, last = (np.clip(np.floor((t - start) / width).astype(np.int64), 0, count - 1) for t in times.T)
    counts = last - first + 1
    rows = np.repeat(np.arange(len(times)), counts)
    interval = np.repeat(first, counts) + np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    order = np.argsort(interval, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(interval, minlength=count))])
    return starts.astype(np.int64), rows[order]


HEURISTIC_WEIGHT: Final = 2.0
"""[1] Weight of the time to go relative to the elapsed time in a search over sequences. Larger: faster searches that
find later arrivals. Smaller: more nodes; with 1 the first arrival is the earliest."""

SEARCH_DIRECTIONS: Final = 8
"""[1] Directions of the accelerations of a search over sequences in the plane; in space there are 26. Larger: earlier
arrivals, more exact choices per node. Smaller: ways around obstacles are missed."""

GOAL_TOLERANCE_SHARE: Final = 0.8
"""[1] Share of the goal's tolerance within which a sequence must arrive. The deviations of the motion from the sequence
use the rest. Larger: a robot may miss its goal by rounding. Smaller: later arrivals."""

MAX_NODES: Final = 20_000
"""[1] Nodes of the tree of a search over sequences; a full tree ends the search. Larger: a search needs more memory,
about 130 bytes per node. Smaller: long searches end without an arrival."""

END_NODES: Final = 2
"""[1] Nodes that are kept free for the ends of sequences: a tree without more free nodes is full. A stop at the end of
a sequence takes one node. Fewer: the tree overflows. More: it is full earlier."""

MAX_END_TESTS: Final = 30
"""[1] Sequences that are tested for a motion after their end, in the order of their estimated arrival. Larger: more
time where no such motion is safe. Smaller: the navigator decides although a safe sequence is known."""

NODE_TIME_SLACK: Final = 1e-6
"""[1] Share of a period by which a time may precede that of a node and count as equal to it. Times of nodes are sums of
periods and carry rounding. Larger: the end of an acceleration is omitted. Smaller: rounding repeats an acceleration
that has ended."""


@dataclass(frozen=True, eq=False)
class Search:
    """Tree of collision-free sequences, and the selected one.

    The tree is extended in place: searches that continue this one share it.

    Attributes:
        obstacles: the predicted obstacles.
        problem, tree: see `kernels/sequence_search/tables.py`.
        root: the node that all sequences pass.
        node: the last node of the selected sequence; -1: none.
        cut: whether the budget ended the search.
    """

    obstacles: PredictedObstacles
    problem: SearchProblem
    tree: SearchTree
    root: int = 0
    node: int = -1
    cut: bool = False

    @property
    def complete(self) -> bool:
        """Whether the sequence arrives."""
        return self.node >= 0 and self.node == self.tree.counts[BEST]

    @property
    def full(self) -> bool:
        """Whether the tree is full."""
        return bool(self.tree.counts[NODES] >= len(self.tree.time) - END_NODES)

    @property
    def end_time(self) -> float:
        """Time [s] at which the sequence ends."""
        return float(self.tree.time[self.node])

    @property
    def arrival(self) -> float:
        """Time [s] at which the sequence reaches the goal; inf if it does not."""
        return self.end_time if self.complete else np.inf

    @property
    def direct(self) -> bool:
        """Whether the sequence is one acceleration followed by coasting or braking, as without obstacles."""
        return len(self._sequence_nodes()) <= 2

    def extended(self, root: int, budget: float, improvement_budget: float) -> tuple["Search", float]:
        """Search after more work on the descendants of node `root`, and that work [us]."""
        index = self.obstacles.index
        node, cut, spent = kernels.grow_tree(self.tree, root, index, self.problem, budget, improvement_budget)
        return replace(self, root=root, node=node, cut=cut), spent

    def resumed(self, now: float, budget: float, improvement_budget: float) -> "Search":
        """Search continued at a later time `now` [s] with the robot on the sequence.

        Without a node once the tree is full.
        """
        if self.full:
            return replace(self, node=-1, cut=True)
        return self.extended(self._upcoming_nodes(now)[0], budget, improvement_budget)[0]

    def refined(self, state: State, now: float, scale: float, deadline: float) -> "Search":
        """New search with finer steps for sequences that branch off at the next node and arrive before `deadline` [s].

        The robot continues on this sequence until that node, and the search may take as long.
        """
        node = self._upcoming_nodes(now)[0]
        start, acceleration = float(self.tree.time[node]), self.tree.acceleration[node]
        problem = self.problem._replace(
            step=step_of(self.problem.max_speed, self.problem.max_acceleration, self.problem.period, scale),
            deadline=deadline,
        )
        tree = _new_tree(state, now)
        tree.status[0] = CLOSED
        position, velocity = self.tree.position[node], self.tree.velocity[node]
        kernels.add_node(tree, 0, start, position, velocity, acceleration, 0.0, OPEN)
        return Search(self.obstacles, problem, tree, root=1)

    def starts_after(self, now: float) -> bool:
        """Whether the robot has not yet reached the node that all sequences of this search share."""
        return bool(self.tree.time[self.root] >= now)

    def manoeuvre(self, state: State, now: float) -> Manoeuvre:
        """Rest of the sequence at `now` [s], as one response to its first acceleration."""
        durations, accelerations = self._remaining(now)
        d = state.dimension
        later = tuple(
            (float(t), tuple(map(float, u[:d]))) for t, u in zip(durations[1:], accelerations[1:], strict=True)
        )
        return Manoeuvre(AccelerationSequence(float(durations[0]), later), state, accelerations[0, :d], now)

    def is_clear(self, state: State, now: float, prediction: PredictedObstacles, margin: float) -> bool:
        """Whether the rest of the sequence, from `state` on, keeps `margin` [m] from the predicted obstacles."""
        durations, accelerations = self._remaining(now)
        positions, velocities = np.zeros((2, len(durations) + 1, 3))
        positions[0, : state.dimension], velocities[0, : state.dimension] = state.position, state.velocity
        for k, (h, u) in enumerate(zip(durations, accelerations, strict=True)):
            positions[k + 1] = positions[k] + h * (velocities[k] + 0.5 * h * u)
            velocities[k + 1] = velocities[k] + h * u
        times = now + np.concatenate([[0.0], np.cumsum(durations)])
        problem = self.problem._replace(margin=margin, now=prediction.known_at(now))
        return bool(
            kernels.sequence_is_clear(times, positions[:-1], velocities[:-1], accelerations, prediction.index, problem)
        )

    def _sequence_nodes(self) -> list[int]:
        """Nodes of the sequence after the root of the tree."""
        nodes, k = [], self.node
        while k > 0:
            nodes.append(k)
            k = int(self.tree.parent[k])
        return nodes[::-1]

    def _upcoming_nodes(self, now: float) -> list[int]:
        """Nodes of the sequence after `now` [s]; the last node if there is none."""
        nodes = self._sequence_nodes()
        return [k for k in nodes if self.tree.time[k] > now + NODE_TIME_SLACK * self.problem.period] or nodes[-1:]

    def _remaining(self, now: float) -> tuple[Array, Array]:
        """Durations (n,) [s] and accelerations (n, 3) [m/s^2] of the sequence from `now` [s] on."""
        nodes = self._upcoming_nodes(now)
        durations = np.diff(self.tree.time[nodes], prepend=now)
        return np.maximum(durations, NODE_TIME_SLACK * self.problem.period), self.tree.acceleration[nodes]

    def with_end(self, now: float, horizon: float) -> "Search":
        """Search with the open sequence of least cost that the robot can continue without a collision to the horizon.

        It brakes and rests; a robot that must not stop keeps its velocity. Without a node if none of the tested
        sequences qualifies. `horizon` is in [s] from `now`.
        """
        count = self.tree.counts[NODES]
        tree = self.tree
        problem = self.problem
        nodes = np.flatnonzero(tree.status[:count] == OPEN) if not self.full else np.empty(0, np.int64)
        nodes = nodes[np.argsort(tree.cost[nodes], kind="stable")]
        rest = np.zeros(3)
        for node in [int(k) for k in nodes if self._descends(int(k))][:MAX_END_TESTS]:
            position = tree.position[node]
            velocity = tree.velocity[node]
            start = float(tree.time[node])
            if problem.never_stops:
                times = np.array([start, max(start, now + horizon)])
                if kernels.sequence_is_clear(
                    times, position[None], velocity[None], rest[None], self.obstacles.index, problem
                ):
                    return replace(self, node=node)
                continue
            periods = float(np.linalg.norm(velocity)) / problem.braking / problem.period
            brake = max(1, int(np.ceil(periods - WHOLE_COUNT))) * problem.period
            acceleration, end = -velocity / brake, position + 0.5 * brake * velocity
            if kernels.breach(problem.bounds, velocity, acceleration, brake, False, np.empty(0), np.zeros(1)):
                continue
            times = np.array([start, start + brake, max(start + brake, now + horizon)])
            motion = np.stack([position, end]), np.stack([velocity, rest]), np.stack([acceleration, rest])
            if kernels.sequence_is_clear(times, *motion, self.obstacles.index, problem):
                last = kernels.add_node(tree, node, start + brake, end, rest, acceleration, 0.0, CLOSED)
                return replace(self, node=last)
        return replace(self, node=-1)

    def _descends(self, node: int) -> bool:
        """Whether the path to `node` passes the root and does not end there."""
        k = node
        while k > self.root:
            k = int(self.tree.parent[k])
        return k == self.root and node != self.root


@dataclass
class Work:
    """[us] of work left for the searches of a decision, and the least for each."""

    left: float
    least: float


def new_search(
    state: State,
    goal: Goal,
    limits: Limits,
    obstacles: PredictedObstacles,
    *,
    now: float,
    period: float,
    deadline: float,
    margin: float,
    scale: float,
) -> Search:
    """Search from a state, without any work done."""
    d = state.dimension
    problem = SearchProblem(
        dimension=d,
        goal=padded(goal.position(now)),
        tolerance=GOAL_TOLERANCE_SHARE * goal.tolerance,
        stop=goal.stop,
        max_acceleration=limits.max_acceleration,
        braking=limits.braking,
        bounds=bound_table(limits, state, period),
        never_stops=least_speed(limits) is not None,
        max_speed=limits.max_speed,
        step=step_of(limits.max_speed, limits.max_acceleration, period, scale),
        period=period,
        deadline=deadline,
        margin=margin,
        now=obstacles.known_at(now),
        directions=directions(d),
        heuristic_weight=HEURISTIC_WEIGHT,
    )
    return Search(obstacles, problem, _new_tree(state, now))


def step_of(max_speed: float, max_acceleration: float, period: float, scale: float) -> float:
    """`scale` times the time from rest to max_speed, in whole periods [s]."""
    return max(1, round(scale * max_speed / max_acceleration / period)) * period


def _new_tree(state: State, now: float) -> SearchTree:
    """Tree of one open node."""
    cells = 1 << int(np.ceil(np.log2(2.0 * MAX_NODES)))
    tree = SearchTree(
        time=np.empty(MAX_NODES),
        position=np.empty((MAX_NODES, 3)),
        velocity=np.empty((MAX_NODES, 3)),
        acceleration=np.empty((MAX_NODES, 3)),
        parent=np.zeros(MAX_NODES, np.int64),
        cost=np.empty(MAX_NODES),
        status=np.zeros(MAX_NODES, np.int64),
        cells=np.zeros(cells, np.int64),
        counts=np.array([1, -1]),
    )
    tree.time[0] = now
    tree.cost[0] = 0.0
    tree.status[0] = OPEN
    tree.acceleration[0] = 0.0
    tree.position[0], tree.velocity[0] = padded(state.position), padded(state.velocity)
    return tree


def run_searches(searches: Sequence[Search], budget: float, improvement_budget: float) -> tuple[Search, float]:
    """First of several new searches, in order, that arrives or is cut, else the last; and the work done [us].

    `budget` [us] is shared by all of them; `improvement_budget` [us] is for the work after the first arrival.
    """
    remaining = budget
    for search in searches:
        extended, spent = search.extended(0, remaining, improvement_budget)
        remaining -= spent
        if extended.complete or extended.cut or remaining <= 0.0:
            break
    return extended, budget - remaining


def directions(dimension: int) -> Array:
    """Unit vectors (k, 3) of accelerations, the first axis towards the goal: 8 in the plane, 26 in space."""
    if dimension == 2:
        angles = 2.0 * np.pi * np.arange(SEARCH_DIRECTIONS) / SEARCH_DIRECTIONS
        return np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    corners = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = corners[np.abs(corners).sum(axis=1) > 0]
    return np.asarray(corners / np.linalg.norm(corners, axis=1)[:, None])


def padded(vector: Array) -> Array:
    """A vector (d,) with further coordinates 0: (3,)."""
    wide = np.zeros(3)
    wide[: len(vector)] = vector
    return wide


# Bounds of a robot at every state of a search.


FAST: Final = 1e9
"""[m/s] A speed above every `LeastSpeed`: a bound of the velocity has its least offset there. Smaller: the least speed
of a faster robot is not found. Larger: nothing changes."""

PROBES: Final = ((0.6, 0.7, 0.4), (-2.3, 1.1, 3.1))
"""[m/s] Velocities at which a bound is compared with its rows; in the plane without the last coordinate. More: bounds
of further forms are refused, in more time. Along an axis: bounds that do not turn would not differ."""


def bound_table(limits: Limits, state: State, period: float) -> BoundTable:
    """The half-spaces of a robot with these limits that is in `state` when it decides; `period` [s] of its decisions.

    At rest it has the heading of that state.

    Raises:
        InvalidInput: a bound that depends on the velocity in another way than `_in_motion` describes; one of another
            dimension than the state.
    """
    table = _of_any_state(limits, state.dimension, period)
    if table.first[MOVING] == table.first[FIXED]:
        return table
    rest = State(state.position, 0.0 * state.velocity, heading=state.heading)
    now = [_as_they_stand(limits, one, turning=True) for one in (state, rest)]
    first = table.first + sum(map(len, now))
    first[MEASURED], first[AT_REST] = 0, len(now[0])
    return table._replace(rows=np.concatenate([*now, table.rows]), first=first)


def _as_they_stand(limits: Limits, state: State, *, turning: bool) -> Array:
    """Rows (n, 6) of `BoundTable` in this state: of the bounds that may turn with the robot, or of the half-spaces."""
    rows = bounds_of([limits], [state]).rows
    rows = rows[(rows[:, 1] != 0.0) == turning]
    return np.column_stack([rows[:, 0], rows[:, 2:], np.zeros(len(rows))])


@lru_cache(maxsize=64)
def _of_any_state(limits: Limits, dimension: int, period: float) -> BoundTable:
    """The rows in motion, and those that hold in every state."""
    each = [_in_motion(bound, dimension) for bound in limits.bounds]
    moving, fixed = ([rows for turns, rows in each if turns == which] for which in (True, False))
    flats = _as_they_stand(limits, State(np.zeros(dimension), np.zeros(dimension)), turning=False)
    none = np.empty((0, 6))
    parts = none, none, np.concatenate([none, *moving]), np.concatenate([flats, *fixed])
    return BoundTable(np.concatenate(parts), np.cumsum([0, *map(len, parts)]), period, dimension)


def _in_motion(bound: Bound, dimension: int) -> tuple[bool, Array]:
    """Whether a bound turns with the velocity, and its rows (n, 6) of `BoundTable` for a robot in motion.

    The sides of a bound turn with the velocity v or not at all. The offset of one for the acceleration is c + k v^2.
    That of one for the velocity is c, or what the present velocity needs if that is more.

    Raises:
        InvalidInput: a bound of another form.
    """
    of, ahead = float(bound.of == "acceleration"), np.eye(dimension)[0]
    zero = 0.0 * ahead
    slow, fast = (bound.half_spaces(State(zero, speed * ahead)) for speed in ((1.0, 2.0) if of else (FAST, FAST)))
    if slow[0].shape == fast[0].shape:
        squares = (fast[1] - slow[1]) / 3.0
        own = slow[0] @ np.asarray(axes(State(zero, ahead))).T
        probes = [State(zero, velocity[:dimension]) for velocity in PROBES]
        for turns in (True, False):
            found = (own if turns else slow[0]), slow[1] - squares, squares
            if all(_agrees(bound, state, found, turns=turns) for state in probes):
                rows = np.zeros((len(squares), 6))
                rows[:, 0], rows[:, 1 : 1 + dimension], rows[:, 4], rows[:, 5] = of, *found
                return turns, rows
    raise InvalidInput(
        "limits: expected bounds whose sides turn with the velocity v or not at all, with offsets c + k v^2, "
        f"to look ahead, found {bound!r}"
    )


def _agrees(bound: Bound, state: State, rows: tuple[Array, Array, Array], *, turns: bool) -> bool:
    """Whether the half-spaces of a bound in this state are those of normals (n, d), offsets (n,) and squares (n,)."""
    normals, offsets = bound.half_spaces(state)
    sides, offset, squares = rows
    expected = sides @ np.asarray(axes(state)) if turns else sides
    if expected.shape != normals.shape:
        return False
    offset = offset + squares * float(state.velocity @ state.velocity)
    if bound.of == "velocity" and turns:
        offset = np.maximum(offset, expected @ state.velocity)
    near = 10.0 * ADMISSIBLE
    return bool(np.allclose(normals, expected, near, near) and np.allclose(offsets, offset, near, near))
