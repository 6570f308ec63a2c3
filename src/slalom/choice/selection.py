"""The exact choice: the admissible control nearest to the preferred one that collides with nothing; one or many."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from math import sqrt
from typing import NamedTuple, cast

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import (
    BLOCKED,
    LIMITS,
    Array,
    array,
    has,
    not_negative,
    positive,
    refuse_kinds,
    vector,
    vectors,
    whole,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import CANDIDATES, ELEMENTS
from slalom.choice.control_obstacle import ControlObstacle
from slalom.kernels.arrays import Indices, MaybeHulls, Scene, States
from slalom.model.limits import Admissible, Limits
from slalom.model.response import Response
from slalom.model.response.protocol import parts_of_gain, piece_norm, response_pieces
from slalom.model.shape import Shape, refuse_turned
from slalom.model.state import State
from slalom.obstacle.window import ObstacleWindow


class Status(Enum):
    """Kind of the result of a choice. The value is the sentence for the user."""

    CLEAR = "The preferred control is admissible and collides with nothing."
    CONSTRAINED = "The nearest admissible control that collides with nothing was chosen."
    BLOCKED = "Every admissible control collides within the horizon."
    INADMISSIBLE = "No control obeys the limits in this state."
    OVERLAPPING = "The robot overlaps an obstacle already: every control collides at once."
    UNDECIDED = "The work limit was reached before a safe control or the proof that none exists."


STATUSES = (Status.CONSTRAINED, Status.BLOCKED, Status.INADMISSIBLE, Status.OVERLAPPING, Status.UNDECIDED)
"""The statuses by their numbers in kernels."""


@dataclass(frozen=True, eq=False)
class Choice:
    """The result of `select`.

    Attributes:
        control: (d,) or None when there is none.
        status: CLEAR or CONSTRAINED with a control, any other without.
        distance: from the preferred control, in units of the control; inf without a control.
        elements, candidates: the work that it took.
    """

    control: Array | None
    status: Status
    distance: float
    elements: int = 0
    candidates: int = 0

    @property
    def safe(self) -> bool:
        """Whether a control was found."""
        return self.control is not None


def select(
    preferred: npt.ArrayLike,
    admissible: Admissible,
    blocked: ControlObstacle,
    *,
    most_elements: int = ELEMENTS,
    most_candidates: int = CANDIDATES,
) -> Choice:
    """The control in `admissible` nearest to `preferred` (d,) with which `blocked` is avoided for all its horizon.

    Laws: a chosen control is admissible (to the relative tolerance ADMISSIBLE) and its clearance to the true
    trajectories is at least 0. No admissible control with a clearance of CONTACT + CERTIFIED or more is nearer. The
    order of obstacles does not matter. BLOCKED means that no admissible control has that clearance.

    Raises:
        InvalidInput: different dimensions, or an admissible set that is not bounded by a ball.
    """
    has(blocked, *BLOCKED, "blocked")
    has(admissible, ("radii", "largest"), "an Admissible set", "admissible")
    dimension = blocked.dimension
    target = np.zeros(3)
    target[:dimension] = vector(preferred, "preferred", dimension)
    if admissible.dimension != dimension or not len(admissible.radii):
        raise InvalidInput(
            f"admissible: expected a set of dimension {dimension} bounded by a ball, "
            f"found dimension {admissible.dimension} and {len(admissible.radii)} balls"
        )
    blocked = blocked.for_controls(admissible.largest)
    if blocked.overlaps:
        return Choice(None, Status.OVERLAPPING, np.inf)
    code, found, elements, candidates = kernels.nearest_free(
        target,
        dimension,
        admissible.table,
        *blocked.table,
        whole(most_elements, "most_elements", 1),
        whole(most_candidates, "most_candidates", 1),
        np.inf,
    )
    status = STATUSES[code]
    if status is not Status.CONSTRAINED:
        return Choice(None, status, np.inf, elements, candidates)
    control = found[:dimension].copy()
    control.setflags(write=False)
    distance = sqrt(sum((a - b) ** 2 for a, b in zip(found.tolist(), target.tolist())))
    status = Status.CLEAR if candidates == 1 and distance == 0.0 else Status.CONSTRAINED
    return Choice(control, status, distance, elements, candidates)


def select_clearest(
    preferred: npt.ArrayLike, admissible: Admissible, blocked: ControlObstacle, *, enough: float, accuracy: float = 1e-3
) -> tuple[Choice, float]:
    """The control with the largest clearance up to `enough` [m]; among these, the nearest to `preferred`.

    The same choice with growing margins: bisection on the margin down to `accuracy` [m].

    Returns:
        The choice and the margin [m] that it keeps beyond that of `blocked`: within `accuracy` of the largest one.
    """

    def with_margin(extra: float) -> Choice:
        grown = ControlObstacle(
            blocked.response, blocked.state, blocked.obstacles, blocked.robot, blocked.margin + extra, blocked.horizon
        )
        return select(preferred, admissible, grown)

    has(blocked, *BLOCKED, "blocked")
    positive(accuracy, "accuracy")
    low, high = 0.0, not_negative(enough, "enough")
    best = with_margin(high)
    if best.safe or high == 0.0:
        return best, high
    best = with_margin(0.0)
    if not best.safe:
        return best, 0.0
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        trial = with_margin(middle)
        if trial.safe:
            best, low = trial, middle
        else:
            high = middle
    return best, low


class Choices(NamedTuple):
    """The result of `select_many`, one row for each state."""

    controls: Array  # (n, d), nan where there is none
    statuses: npt.NDArray[np.object_]  # (n,) of `Status`

    @property
    def safe(self) -> npt.NDArray[np.bool_]:
        """Whether a control was found: (n,)."""
        return np.isfinite(self.controls[:, 0])


def select_many(
    preferred: npt.ArrayLike,
    states: Sequence[State] | npt.ArrayLike,
    response: Response,
    limits: Limits,
    obstacles: ObstacleWindow,
    robot: Shape,
    *,
    margin: float = 0.0,
    threads: int = 1,
) -> Choices:
    """The exact choices of robots in many states among the same obstacles, in one call of the kernel.

    Args:
        preferred: (n, d) in units of the control. states: n of them, or numbers (n, 2, d) or (n, 3, d): position,
            velocity and perhaps acceleration of each. response, limits, robot: what all have in common.
        obstacles: the obstacles over the window that begins now. margin: [m] >= 0 to keep from every obstacle.
        threads: how many threads share the work, at least 1.

    Law: row i is `select(preferred[i], limits.admissible(response, states[i], obstacles.horizon), blocked)` with
    `ControlObstacle(response, states[i], obstacles, robot, margin)`, to the bit, for any number of threads.

    Raises:
        InvalidInput: numbers of another shape, different dimensions, not one state for each preferred control, fewer
            than one thread; a state with a heading for a robot that is not round.
    """
    refuse_kinds(response, obstacles, robot)
    has(limits, *LIMITS, "limits")
    states = _states(states)
    count, dimension = len(states), states[0].dimension if len(states) else 2
    given = vectors(preferred, "preferred", dimension).reshape(-1, dimension)
    if len(given) != count or any(state.dimension != dimension for state in states):
        raise InvalidInput(
            f"states: expected {len(given)} of dimension {dimension}, one for each preferred control, found {count} "
            f"of dimensions {sorted({state.dimension for state in states})}"
        )
    for what, other in (("robot", robot.dimension), ("obstacles", obstacles.dimension)):
        if other not in (None, dimension):
            raise InvalidInput(f"{what}: expected dimension {dimension} as of the states, found {other}")
    for k, state in enumerate(states):
        refuse_turned(robot, state.heading, f"states[{k}]: heading")
    more, parts = not_negative(margin, "margin"), whole(threads, "threads", 1)
    controls, codes = np.full((count, 3), np.nan), np.zeros(count, np.int64)
    preferred_rows = np.zeros((count, 3))
    preferred_rows[:, :dimension] = given
    with ThreadPoolExecutor(parts) as pool:
        for rows, found, scene, hulls in _alike(states, response, limits, obstacles, robot, more):
            shares = [share for share in np.array_split(np.arange(len(rows)), parts) if len(share)]
            running = [
                pool.submit(_choose, preferred_rows[rows[share]], share, found, scene, hulls) for share in shares
            ]
            for share, done in zip(shares, running):
                controls[rows[share]], codes[rows[share]] = done.result()
    statuses = np.array([STATUSES[code] for code in codes], dtype=object)
    clear = (codes == 0) & (controls == preferred_rows).all(axis=1)
    statuses[clear] = Status.CLEAR
    controls[codes != 0] = np.nan
    return Choices(controls[:, :dimension].copy(), statuses)


def _states(states: Sequence[State] | npt.ArrayLike) -> Sequence[State]:
    if isinstance(states, Sequence) and all(isinstance(state, State) for state in states):
        return cast(Sequence[State], states)
    rows = array(cast(npt.ArrayLike, states), "states")
    if rows.ndim != 3 or rows.shape[1] not in (2, 3) or rows.shape[2] not in (2, 3):
        raise InvalidInput(f"states: expected `State`s, or numbers (n, 2 or 3, d), found shape {rows.shape}")
    return [State(*row) for row in rows]


class _Group(NamedTuple):
    """States whose responses have the same knots."""

    rows: list[int]
    knots: Array
    gain: Array
    drifts: list[Array]
    limits: list[Array]


def _alike(
    states: Sequence[State], response: Response, limits: Limits, obstacles: ObstacleWindow, robot: Shape, margin: float
) -> Iterator[tuple[Indices, States, Scene, MaybeHulls]]:
    """Groups of states whose responses have the same knots: their rows (m,), and the arguments of `_choose`."""
    bodies = obstacles.bodies(robot)
    scene = Scene(bodies, bodies.heads, bodies.radius + margin, response.interpolation_error, obstacles.horizon)
    groups: dict[tuple[bytes, bytes], _Group] = {}
    for k, state in enumerate(states):
        allowed = limits.admissible(response, state, obstacles.horizon)
        norm = piece_norm(response, state, obstacles.horizon, allowed.largest)
        knots, drift, gain = response_pieces(response, state, obstacles.horizon, norm)
        group = groups.setdefault((knots.tobytes(), gain.tobytes()), _Group([], knots, gain, [], []))
        group.rows.append(k)
        group.drifts.append(drift)
        group.limits.append(allowed.rows())
    for group in groups.values():
        counts = np.array([len(rows) for rows in group.limits])
        table = np.zeros((len(counts), counts.max(), 5))
        for row, rows in zip(table, group.limits):
            row[: len(rows)] = rows
        positions = np.array([states[k].position for k in group.rows])
        alike = States(table, counts, positions, group.knots, np.array(group.drifts), *parts_of_gain(group.gain))
        yield np.array(group.rows), alike, scene, bodies.hulls


def _choose(preferred: Array, share: Indices, states: States, scene: Scene, hulls: MaybeHulls) -> tuple[Array, Indices]:
    """The controls and statuses of the states with numbers `share` (m,)."""
    some = states._replace(
        limits=states.limits[share],
        counts=states.counts[share],
        position=states.position[share],
        drift=states.drift[share],
    )
    return kernels.choose_many(preferred, some, scene, hulls, ELEMENTS, CANDIDATES)
