"""Search over sequences of accelerations that continues over several decisions."""

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
from slalom.tolerances import (
    END_NODES,
    GOAL_TOLERANCE_SHARE,
    HEURISTIC_WEIGHT,
    MAX_NODES,
    MAX_STOP_TESTS,
    NODE_TIME_SLACK,
    SEARCH_DIRECTIONS,
    WHOLE_COUNT,
)


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

    def with_stop(self, now: float, horizon: float) -> "Search":
        """Search with the open sequence of least cost after which the robot can brake and rest until the horizon.

        Without a node if none of the tested sequences qualifies. `horizon` is in [s] from `now`.
        """
        count, tree, problem = self.tree.counts[NODES], self.tree, self.problem
        nodes = np.flatnonzero(tree.status[:count] == OPEN) if not self.full else np.empty(0, np.int64)
        nodes = nodes[np.argsort(tree.cost[nodes], kind="stable")]
        for node in [int(k) for k in nodes if self._descends(int(k))][:MAX_STOP_TESTS]:
            position, velocity, start = tree.position[node], tree.velocity[node], float(tree.time[node])
            speed = float(np.linalg.norm(velocity))
            periods = speed / problem.max_acceleration / problem.period
            brake = max(1, int(np.ceil(periods - WHOLE_COUNT))) * problem.period
            acceleration, end = -velocity / brake, position + 0.5 * brake * velocity
            times = np.array([start, start + brake, max(start + brake, now + horizon)])
            motion = (
                np.stack([position, end]),
                np.stack([velocity, 0.0 * velocity]),
                np.stack([acceleration, 0.0 * acceleration]),
            )
            if kernels.sequence_is_clear(times, *motion, self.obstacles.index, problem):
                last = kernels.add_node(tree, node, start + brake, end, 0.0 * velocity, acceleration, 0.0, CLOSED)
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
        goal=_padded(goal.position(now)),
        tolerance=GOAL_TOLERANCE_SHARE * goal.tolerance,
        stop=goal.stop,
        max_acceleration=limits.max_acceleration,
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
    tree.time[0], tree.cost[0], tree.status[0], tree.acceleration[0] = now, 0.0, OPEN, 0.0
    tree.position[0], tree.velocity[0] = _padded(state.position), _padded(state.velocity)
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


def _padded(vector: Array) -> Array:
    padded = np.zeros(3)
    padded[: len(vector)] = vector
    return padded
