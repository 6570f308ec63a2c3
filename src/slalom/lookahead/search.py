"""A search over sequences of accelerations, begun at one decision and gone on with at the next."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.goal import Goal
from slalom.kernels.sequence_search.tables import BEST, CLOSED, NODES, OPEN, SearchProblem, SearchTree
from slalom.limits import Limits
from slalom.lookahead.spacetime_index import PredictedObstacles
from slalom.manoeuvre import Manoeuvre
from slalom.response.sequence import AccelerationSequence
from slalom.state import State

SCALES = (1.0, 0.5)
"""[1] Steps, in times from rest to top speed; the finer one is tried where the coarser finds nothing."""
HEURISTIC_WEIGHT = 2.0
"""[1] How much more the time to go counts than the time gone: larger is quicker and finds later arrivals."""
DIRECTIONS = 8
"""[1] Directions of pushes in the plane; in space there are 26."""
TOLERANCE_SHARE = 0.8
"""[1] Which share of the goal's tolerance is near enough for a plan."""
MAX_NODES, SPARE_NODES = 20_000, 2
"""[1] Nodes of a tree, and those that are kept free for what ends a sequence. A search that has filled it is cut."""
MAX_STOP_TESTS = 30
"""[1] Sequences that are tried, the most promising first, for one after which the robot can stop."""


@dataclass(frozen=True, eq=False)
class Search:
    """A tree of sequences that keep clear, and the one that is gone on with.

    The tree is grown in place: searches that go on from this one share it.

    Attributes:
        timetable: what is kept clear of. quest: who wants where. tree: see `kernels/quest.py`.
        root: the node that all sequences go over. node: the last one of the sequence; -1: there is none.
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
        """Whether the tree has no room for more."""
        return bool(self.tree.counts[NODES] >= len(self.tree.time) - SPARE_NODES)

    @property
    def end_time(self) -> float:
        """When the sequence ends [s]."""
        return float(self.tree.time[self.node])

    @property
    def arrival(self) -> float:
        """When the sequence is at the goal [s]; inf if it does not get there."""
        return self.end_time if self.complete else np.inf

    @property
    def direct(self) -> bool:
        """Whether the sequence is one push and coasting or braking, as the robot would drive alone in the world."""
        return len(self._sequence_nodes()) <= 2

    def extended(self, root: int, budget: float, improving: float) -> tuple["Search", float]:
        """After more work on what descends from node `root`, and how much work that was [us]."""
        schedule = self.obstacles.index
        node, cut, spent = kernels.grow_tree(self.tree, root, schedule, self.problem, budget, improving)
        return replace(self, root=root, node=node, cut=cut), spent

    def resumed(self, now: float, budget: float, improving: float) -> "Search":
        """The search at a later time, at which the robot is on the sequence; without a node once the tree is full."""
        if self.full:
            return replace(self, node=-1, cut=True)
        return self.extended(self._upcoming_nodes(now)[0], budget, improving)[0]

    def refined(self, state: State, now: float, scale: float, before: float) -> "Search":
        """A new search, in finer steps, for sequences that leave this one at its next node and arrive by `before` [s].

        The robot can go on until then, and so can the search.
        """
        node = self._upcoming_nodes(now)[0]
        start, push = float(self.tree.time[node]), self.tree.acceleration[node]
        quest = self.problem._replace(
            step=_step(self.problem.max_speed, self.problem.max_acceleration, self.problem.period, scale),
            deadline=before,
        )
        tree = _new_tree(state, now)
        tree.status[0] = CLOSED
        place, speed = self.tree.position[node], self.tree.velocity[node]
        _append_node(tree, 0, start, place, speed, push, OPEN)
        return Search(self.obstacles, quest, tree, root=1)

    def starts_after(self, now: float) -> bool:
        """Whether the robot has not yet come to the node that all sequences of this search have in common."""
        return bool(self.tree.time[self.root] >= now)

    def manoeuvre(self, state: State, now: float) -> Manoeuvre:
        """What is left of the sequence at `now`, as one response to the acceleration that comes first."""
        lengths, pushes = self._remaining(now)
        d = state.dimension
        later = tuple((float(t), tuple(map(float, u[:d]))) for t, u in zip(lengths[1:], pushes[1:], strict=True))
        return Manoeuvre(AccelerationSequence(float(lengths[0]), later), state, pushes[0, :d], now)

    def is_clear(self, state: State, now: float, timetable: PredictedObstacles, margin: float) -> bool:
        """Whether a robot that goes on from `state` with what is left meets nothing of a timetable."""
        lengths, pushes = self._remaining(now)
        places, speeds = np.zeros((2, len(lengths) + 1, 3))
        places[0, : state.dimension], speeds[0, : state.dimension] = state.position, state.velocity
        for k, (h, u) in enumerate(zip(lengths, pushes, strict=True)):
            places[k + 1] = places[k] + h * (speeds[k] + 0.5 * h * u)
            speeds[k + 1] = speeds[k] + h * u
        times = now + np.concatenate([[0.0], np.cumsum(lengths)])
        quest = self.problem._replace(margin=margin, now=timetable.known_at(now))
        return bool(kernels.sequence_is_clear(times, places[:-1], speeds[:-1], pushes, timetable.index, quest))

    def _sequence_nodes(self) -> list[int]:
        """The nodes of the sequence after the root of the tree."""
        way, k = [], self.node
        while k > 0:
            way.append(k)
            k = int(self.tree.parent[k])
        return way[::-1]

    def _upcoming_nodes(self, now: float) -> list[int]:
        """The nodes of the sequence that are yet to come; the last one if none is."""
        way = self._sequence_nodes()
        return [k for k in way if self.tree.time[k] > now + 1e-6 * self.problem.period] or way[-1:]

    def _remaining(self, now: float) -> tuple[Array, Array]:
        """How long (n,) [s] and with which accelerations (n, 3) [m/s^2] the sequence goes on from `now`."""
        after = self._upcoming_nodes(now)
        times = self.tree.time[after]
        return np.maximum(np.diff(times, prepend=now), 1e-6 * self.problem.period), self.tree.acceleration[after]

    def with_stop(self, now: float, horizon: float) -> "Search":
        """The search with the most promising open sequence after which the robot can brake and rest until the horizon.

        No node if none of the best does. `horizon`: [s] from `now`.
        """
        count, tree, quest = self.tree.counts[NODES], self.tree, self.problem
        nodes = np.flatnonzero(tree.status[:count] == OPEN) if not self.full else np.empty(0, np.int64)
        nodes = nodes[np.argsort(tree.cost[nodes], kind="stable")]
        for node in [int(k) for k in nodes if self._descends(int(k))][:MAX_STOP_TESTS]:
            place, speed, start = tree.position[node], tree.velocity[node], float(tree.time[node])
            fast = float(np.linalg.norm(speed))
            brake = max(1, int(np.ceil(fast / quest.max_acceleration / quest.period - 1e-9))) * quest.period
            push, end = -speed / brake, place + 0.5 * brake * speed
            times = np.array([start, start + brake, max(start + brake, now + horizon)])
            ways = np.stack([place, end]), np.stack([speed, 0.0 * speed]), np.stack([push, 0.0 * push])
            if kernels.sequence_is_clear(times, *ways, self.obstacles.index, quest):
                last = _append_node(tree, node, start + brake, end, 0.0 * speed, push, CLOSED)
                return replace(self, node=last)
        return replace(self, node=-1)

    def _descends(self, node: int) -> bool:
        """Whether the way to `node` leads over the root, and on."""
        k = node
        while k > self.root:
            k = int(self.tree.parent[k])
        return k == self.root and node != self.root


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
    """A search from a state that has not looked at anything yet."""
    d = state.dimension
    quest = SearchProblem(
        dimension=d,
        goal=_padded(goal.position(now)),
        tolerance=TOLERANCE_SHARE * goal.tolerance,
        stop=goal.stop,
        max_acceleration=limits.max_acceleration,
        max_speed=limits.max_speed,
        step=_step(limits.max_speed, limits.max_acceleration, period, scale),
        period=period,
        deadline=deadline,
        margin=margin,
        now=obstacles.known_at(now),
        directions=directions(d),
        heuristic_weight=HEURISTIC_WEIGHT,
    )
    return Search(obstacles, quest, _new_tree(state, now))


def _step(top: float, push: float, period: float, scale: float) -> float:
    """`scale` times from rest to top speed, in whole periods [s]."""
    return max(1, round(scale * top / push / period)) * period


def _new_tree(state: State, now: float) -> SearchTree:
    """A tree of one open node."""
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
    tree.time[0], tree.cost[0], tree.status[0], tree.acceleration[0] = now, 0.0, OPEN, 0.0
    tree.position[0], tree.velocity[0] = _padded(state.position), _padded(state.velocity)
    return tree


def _append_node(tree: SearchTree, parent: int, time: float, place: Array, speed: Array, push: Array, mark: int) -> int:
    """A node after `parent`; its number."""
    k = int(tree.counts[NODES])
    tree.time[k], tree.parent[k], tree.cost[k], tree.status[k] = time, parent, 0.0, mark
    tree.position[k], tree.velocity[k], tree.acceleration[k] = place, speed, push
    tree.counts[NODES] = k + 1
    return k


def run_searches(searches: Sequence[Search], budget: float, improving: float) -> tuple[Search, float]:
    """The first of several new searches, tried in turn, that finds an arrival or is cut; else the last. What it took.

    `budget` is for all of them together, `improving` for what comes after the first arrival, both in [us].
    """
    left = budget
    for search in searches:
        found, spent = search.extended(0, left, improving)
        left -= spent
        if found.complete or found.cut or left <= 0.0:
            break
    return found, budget - left


def directions(dimension: int) -> Array:
    """Unit vectors (k, 3) of pushes, the first axis to the goal: 8 in the plane, 26 in space."""
    if dimension == 2:
        angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        return np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    corners = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = corners[np.abs(corners).sum(axis=1) > 0]
    return np.asarray(corners / np.linalg.norm(corners, axis=1)[:, None])


def _padded(vector: Array) -> Array:
    wide = np.zeros(3)
    wide[: len(vector)] = vector
    return wide
