"""The bounds of a robot in all states that a search over sequences predicts, from those in a few states."""

from functools import lru_cache
from typing import Final

import numpy as np

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ADMISSIBLE
from slalom.decision.tables import bounds_of
from slalom.kernels.sequence_search.tables import AT_REST, FIXED, MEASURED, MOVING, BoundTable
from slalom.model.bounds import Bound, axes
from slalom.model.limits import Limits
from slalom.model.state import State

FAST: Final = 1e9
"""[m/s] A speed above every `LeastSpeed`: a bound of the velocity has its least offset there.

Smaller: the least speed of a faster robot is not found. Larger: nothing changes.
"""

PROBES: Final = ((0.6, 0.7, 0.4), (-2.3, 1.1, 3.1))
"""[m/s] Velocities at which a bound is compared with its rows; in the plane without the last coordinate.

More: bounds of further forms are refused, in more time. Along an axis: bounds that do not turn would not differ.
"""


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
