"""Shortest ways from pose to pose of vehicles whose turns have a least radius, or that turn on the spot.

A pose is (x, y, heading) of the middle of the (rear) axle. A way is a sequence of arcs. Positions and directions are
complex numbers here, in radii and with the start at 0 along 1. A vehicle with the direction u turns to the left about
the centre u i beside it, and to the right about -u i. On an arc the centre stays. Where a left turn changes to a right
one with the direction u, it moves by -2 i u, where a right one changes to a left one by 2 i u, and along a straight
line of the length s by s u. So each word, such as left, straight, left, is one equation for the vector D between the
centres at the start and at the goal. docs/vehicles.md has all of them.

Sources: Dubins 1957; Reeds & Shepp 1990; Bui, Boissonnat, Soueres & Laumond 1994 (free heading at the goal); Soueres,
Fourquet & Laumond 1994 (the same with reversals).
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from math import pi
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array, array_of, flag, listing, not_negative, number, pair, positive, vectors

Complex: TypeAlias = npt.NDArray[np.complexfloating[Any, Any]]


class Arc(NamedTuple):
    """Part of a way with one curvature.

    `length` [m] is driven by the middle of the axle, negative if backwards. `turn` [rad] is the change of the heading.
    A length of 0 with a turn is a turn on the spot.
    """

    length: float
    turn: float


Way: TypeAlias = tuple[Arc, ...]


ROUNDING: Final = 1e-12
"""[1] Turns (in radians) and lengths (in radii, per 1 + the distance in radii) below this are none. Smaller: rounding
adds full circles to ways that start in the direction of their straight part. Larger: ways miss their goal by as
much."""

LONGEST_WORD: Final = 5
"""[1] Most arcs in a word: those of Reeds and Shepp have up to 5. Smaller: words are lost. Larger: longer arrays of
zeros."""


# Words: solutions of the equations for D. Each function takes goals (m,) and directions (m,) there, in radii, and
# returns the turn of each arc and the length of the straight line (m,), NaN where the word has no solution.


def _left(u: Complex, rounding: Array) -> Array:
    """The angles (m,) of directions, from 0 to 2 pi."""
    angle = np.angle(u) % (2.0 * pi)
    return np.where(angle > 2.0 * pi - rounding, 0.0, angle)


class Problem(NamedTuple):
    """Goals `q` (m,) [radii], directions `v` (m,) there, and the angles `rounding` (m,) [rad] that are none."""

    q: Complex
    v: Complex
    rounding: Array

    def left(self, u: Complex) -> Array:
        """The turns (m,) to the left from the direction 1 to `u`, from 0 to 2 pi."""
        return _left(u, self.rounding)

    def right(self, u: Complex) -> Array:
        """The turns (m,) to the right from the direction 1 to `u`, from -2 pi to 0."""
        return -_left(np.conj(u), self.rounding)

    def centres(self, right: bool) -> Complex:
        """The vectors D (m,) from the left centre at the start to the left or right one at the goal."""
        return self.q + (-1j if right else 1j) * self.v - 1j

    def solved(self, d: Complex, share: Complex | Array, otherwise: Complex | complex = 1.0) -> Complex:
        """Unit vectors u (m,) with u share = d; `otherwise` where d is 0 and every direction solves this."""
        known = (np.abs(d) > self.rounding) & (share != 0.0)
        u = np.where(known, np.where(known, d, 1.0) / np.where(known, share, 1.0), otherwise)
        return np.asarray(u / np.abs(u))


def _root(square: Array) -> Array:
    """Square roots (m,); NaN below 0, but for rounding."""
    return np.sqrt(np.where(square < 0.0, np.where(square > -ROUNDING, 0.0, np.nan), square))


def _arc_cosine(share: Array) -> Array:
    """Arc cosines (m,) of shares; NaN above 1, but for rounding, and below 0."""
    known = (share <= 1.0 + ROUNDING) & (share >= -ROUNDING)
    return np.where(known, np.arccos(np.clip(share, 0.0, 1.0)), np.nan)


def _lsl(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=False)
    s = np.abs(d)
    u = p.solved(d, s)
    return p.left(u), s, p.left(p.v / u)


def _lsr(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=True)
    s = _root(np.abs(d) ** 2 - 4.0)
    u = p.solved(d, s - 2j)
    return p.left(u), s, p.right(p.v / u)


def _three(p: Problem, middle: Callable[[Array], Array]) -> tuple[Array, Complex, Complex]:
    """Turn of the middle arc of LRL, and the directions at its ends; `middle` makes it of the angle in [0, pi]."""
    d = p.centres(right=False)
    share = np.abs(d) / 4.0
    turn = middle(2.0 * np.where(share <= 1.0, np.arcsin(np.minimum(share, 1.0)), np.nan))
    u1 = p.solved(d, -2j * (1.0 - np.exp(1j * turn)))
    return turn, u1, u1 * np.exp(1j * turn)


def _lrl(p: Problem) -> tuple[Array, ...]:
    turn, u1, u2 = _three(p, lambda angle: angle - 2.0 * pi)
    return p.left(u1), turn, p.left(p.v / u2)


def _l_r_back_l(p: Problem) -> tuple[Array, ...]:
    turn, u1, u2 = _three(p, np.positive)
    return p.left(u1), turn, p.left(p.v / u2)


def _l_r_back_l_back(p: Problem) -> tuple[Array, ...]:
    turn, u1, u2 = _three(p, np.positive)
    return p.left(u1), turn, p.right(p.v / u2)


def _l_r_l_back(p: Problem) -> tuple[Array, ...]:
    turn, u1, u2 = _three(p, np.negative)
    return p.left(u1), turn, p.right(p.v / u2)


def _l_r_l_back_r_back(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=True)
    angle = _arc_cosine(0.5 + np.abs(d) / 4.0)
    u2 = p.solved(d, -1j * np.abs(d), np.exp(-1j * angle))
    return p.left(u2 * np.exp(1j * angle)), -angle, -angle, p.left(p.v / u2 * np.exp(1j * angle))


def _l_r_back_l_back_r(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=True)
    angle = _arc_cosine((5.0 - np.abs(d) ** 2 / 4.0) / 4.0)
    u1 = p.solved(d, -2j * (2.0 - np.exp(1j * angle)))
    return p.left(u1), angle, -angle, p.right(p.v / u1)


def _backwards(s: Array) -> Array:
    """Straight lines (m,) where they are driven backwards, NaN elsewhere."""
    return np.where(s <= 0.0, s, np.nan)


def _l_quarter_s_l(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=False)
    s = _backwards(2.0 - _root(np.abs(d) ** 2 - 4.0))
    u = p.solved(d, s - 2.0 + 2j)
    return p.left(-1j * u), np.full_like(s, 0.5 * pi), s, p.right(p.v / u)


def _l_quarter_s_r(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=True)
    s = _backwards(2.0 - np.abs(d))
    u = p.solved(d, s - 2.0)
    return p.left(-1j * u), np.full_like(s, 0.5 * pi), s, p.left(p.v / u)


def _l_quarter_s_quarter_r(p: Problem) -> tuple[Array, ...]:
    d = p.centres(right=True)
    s = _backwards(4.0 - _root(np.abs(d) ** 2 - 4.0))
    u = p.solved(d, s - 4.0 + 2j)
    quarter = np.full_like(s, 0.5 * pi)
    return p.left(-1j * u), quarter, s, -quarter, p.right(p.v / u * 1j)


# Ways to a place: D is the vector from the left centre at the start to the place.


def _ls(p: Problem) -> tuple[Array, ...]:
    d = p.q - 1j
    s = _root(np.abs(d) ** 2 - 1.0)
    return p.left(p.solved(d, s - 1j)), s


def _two(p: Problem, middle: Callable[[Array], Array]) -> tuple[Array, ...]:
    """LR to a place; `middle` makes the second turn of the angle in [0, pi]."""
    d = p.q - 1j
    share = (5.0 - np.abs(d) ** 2) / 4.0
    turn = middle(np.where(np.abs(share) <= 1.0, np.arccos(np.clip(share, -1.0, 1.0)), np.nan))
    return p.left(p.solved(d, -1j * (2.0 - np.exp(1j * turn)))), turn


def _lr(p: Problem) -> tuple[Array, ...]:
    return _two(p, np.negative)


def _lr_long(p: Problem) -> tuple[Array, ...]:
    return _two(p, lambda angle: angle - 2.0 * pi)


def _l_r_back(p: Problem) -> tuple[Array, ...]:
    return _two(p, np.positive)


def _l_quarter_s(p: Problem) -> tuple[Array, ...]:
    d = p.q - 1j
    s = _backwards(2.0 - _root(np.abs(d) ** 2 - 1.0))
    u = p.solved(d, s - 2.0 + 1j)
    return p.left(-1j * u), np.full_like(s, 0.5 * pi), s


Solver: TypeAlias = Callable[[Problem], tuple[Array, ...]]


class Family(NamedTuple):
    """Words that are images of one: its arcs, left, right or straight, their solver, and whether to solve it reversed.

    Images of a word are itself, its reflection, it driven backwards, and both.
    """

    sides: str
    solver: Solver
    reversed: bool = False


FORWARDS: Final = (Family("LSL", _lsl), Family("LSR", _lsr))
DUBINS: Final = (*FORWARDS, Family("LRL", _lrl))
REEDS_SHEPP: Final = (
    *FORWARDS,
    Family("LRL", _l_r_back_l),
    Family("LRL", _l_r_back_l_back),
    Family("LRL", _l_r_l_back),
    Family("LRLR", _l_r_l_back_r_back),
    Family("LRLR", _l_r_back_l_back_r),
    Family("LRSL", _l_quarter_s_l),
    Family("LRSR", _l_quarter_s_r),
    Family("LRSL", _l_quarter_s_l, reversed=True),
    Family("LRSR", _l_quarter_s_r, reversed=True),
    Family("LRSLR", _l_quarter_s_quarter_r),
)
TO_PLACE: Final = (Family("LS", _ls), Family("LR", _lr), Family("LR", _lr_long))
TO_PLACE_REVERSING: Final = (*TO_PLACE, Family("LR", _l_r_back), Family("LRS", _l_quarter_s))

BOTH: Final = (1.0, -1.0)
"""[1] Directions of driving: forwards, and backwards. Fewer: fewer words."""


class Words(NamedTuple):
    """Arcs (n, w, 5) of w words between n pairs of poses, and their lengths `total` (n, w) [m]; inf: no such word.

    `lengths` [m] and `turns` [rad] are those of `Arc`; words with fewer arcs end with zeros.
    """

    lengths: Array
    turns: Array
    total: Array


def words(
    starts: Array, goals: Array, radius: float, families: Sequence[Family], gears: Sequence[float] = BOTH
) -> Words:
    """All words of these families from poses (n, 3) to poses (n, 3), for turns of one `radius` [m]."""
    ahead = np.exp(1j * starts[:, 2])
    q = ((goals[:, 0] - starts[:, 0]) + 1j * (goals[:, 1] - starts[:, 1])) / (radius * ahead)
    v = np.exp(1j * (goals[:, 2] - starts[:, 2]))
    rounding = np.tile(ROUNDING * (1.0 + np.abs(q)), 2 * len(gears))
    images = [(gear, side) for gear in gears for side in (1.0, -1.0)]
    n = len(q)

    def imaged(q: Complex, v: Complex) -> Problem:
        places = [gear * q if side > 0.0 else gear * np.conj(q) for gear, side in images]
        ways = [v if side > 0.0 else np.conj(v) for _, side in images]
        return Problem(np.concatenate(places), np.concatenate(ways), rounding)

    problems = imaged(q, v), imaged(-q * np.conj(v), np.conj(v))
    gear, side = (np.repeat([image[k] for image in images], n) for k in (0, 1))
    lengths = np.zeros((len(families), len(images) * n, LONGEST_WORD))
    turns = np.zeros_like(lengths)
    with np.errstate(invalid="ignore", divide="ignore"):
        for k, family in enumerate(families):
            parts = family.solver(problems[family.reversed])
            order = reversed(range(len(parts))) if family.reversed else range(len(parts))
            sign = -1.0 if family.reversed else 1.0
            for j, part in enumerate(order):
                letter = family.sides[part]
                if letter != "S":
                    turns[k, :, j] = sign * side * parts[part]
                lengths[k, :, j] = sign * gear * (-parts[part] if letter == "R" else parts[part])
    lengths, turns = (
        each.reshape(len(families), len(images), n, LONGEST_WORD)
        .transpose(2, 0, 1, 3)
        .reshape(n, len(families) * len(images), LONGEST_WORD)
        for each in (radius * lengths, turns)
    )
    total = np.abs(lengths).sum(axis=2)
    # No word has an arc beyond a full circle, and rounding may make one of a solution that hardly exists.
    return Words(lengths, turns, np.where(np.isfinite(total), total, np.inf))


def _sorted(found: Words, radius: float, distance: float) -> list[Way]:
    """The words of one pair of poses as ways, the shortest first; arcs without length are left out."""
    least = ROUNDING * (radius + distance)
    order = np.argsort(found.total[0], kind="stable")
    ways = []
    for k in order[: np.isfinite(found.total[0]).sum()].tolist():
        arcs = zip(found.lengths[0, k].tolist(), found.turns[0, k].tolist())
        ways.append(tuple(Arc(length, turn) for length, turn in arcs if abs(length) > least))
    return ways


# Ways between two poses.


def _between(
    start: npt.ArrayLike, goal: npt.ArrayLike, radius: float, families: Sequence[Family], gears: Sequence[float]
) -> list[Way]:
    a, b = array_of(start, "start", (3,)), array_of(goal, "goal", (3,))
    radius = positive(radius, "radius")
    return _sorted(words(a[None], b[None], radius, families, gears), radius, float(np.hypot(*(b - a)[:2])))


def dubins(start: npt.ArrayLike, goal: npt.ArrayLike, radius: float, backwards: bool = False) -> list[Way]:
    """Ways from pose to pose, all forwards, or all backwards, the shortest first.

    Poses are (x, y, heading) [m, rad]. Law: no way with turns of at least `radius` [m] and without a reversal is
    shorter than the first one. Source: Dubins 1957.

    Raises:
        InvalidInput: something else than three numbers for a pose; a radius that is not above 0.
    """
    return _between(start, goal, radius, DUBINS, (-1.0,) if flag(backwards, "backwards") else (1.0,))


def reeds_shepp(start: npt.ArrayLike, goal: npt.ArrayLike, radius: float) -> list[Way]:
    """Ways from pose to pose, forwards and backwards, the shortest first: all of the 48 words that exist.

    Poses are (x, y, heading) [m, rad]. Law: no way with turns of at least `radius` [m] is shorter than the first one.
    Its length is a metric. Source: Reeds & Shepp 1990.

    Raises:
        InvalidInput: something else than three numbers for a pose; a radius that is not above 0.
    """
    return _between(start, goal, radius, REEDS_SHEPP, BOTH)


def to_place(
    start: npt.ArrayLike, place: npt.ArrayLike, radius: float, reverse: bool = False, turns_on_spot: bool = False
) -> list[Way]:
    """Ways from a pose (x, y, heading) to a place (x, y) [m] with any heading there, the shortest first.

    Args:
        radius: [m] of turns; 0 only with `turns_on_spot`, which ignores it.
        reverse: whether the vehicle also drives backwards.
        turns_on_spot: whether it turns on the spot, and then drives straight.

    Raises:
        InvalidInput: something else than three numbers for a pose and two for a place; a radius that is not above 0.
    """
    a, p = array_of(start, "start", (3,)), array_of(place, "place", (2,))
    gears = BOTH if flag(reverse, "reverse") else (1.0,)
    distance = float(np.hypot(*(p - a[:2])))
    if flag(turns_on_spot, "turns_on_spot"):
        course = float(np.arctan2(p[1] - a[1], p[0] - a[0])) if distance > 0.0 else float(a[2])
        goals = np.array([(p[0], p[1], course if gear > 0.0 else course + pi) for gear in gears])
        ways = {way for goal in goals for way in turn_and_drive(a, goal, reverse) if len(way) < 3}
        return sorted(ways, key=lambda way: (sum(abs(arc.turn) for arc in way), way))
    families = TO_PLACE_REVERSING if reverse else TO_PLACE
    radius = positive(radius, "radius")
    return _sorted(words(a[None], np.append(p, 0.0)[None], radius, families, gears), radius, distance)


def turn_and_drive(start: npt.ArrayLike, goal: npt.ArrayLike, reverse: bool = True) -> list[Way]:
    """Ways from pose to pose that turn on the spot, drive straight and turn again, those that turn least first.

    Poses are (x, y, heading) [m, rad]. All ways have the same length. Each turn is to either side. With `reverse` the
    straight line is also driven backwards.

    Raises:
        InvalidInput: something else than three numbers for a pose.
    """
    a, b = array_of(start, "start", (3,)), array_of(goal, "goal", (3,))
    gears = BOTH if flag(reverse, "reverse") else (1.0,)
    return _by_turns(turning_words(a[None], b[None], gears))


def turning_words(starts: Array, goals: Array, gears: Sequence[float]) -> Words:
    """The words of turns on the spot about straight lines, from poses (n, 3) to poses (n, 3)."""
    step = goals[:, :2] - starts[:, :2]
    distance = np.hypot(step[:, 0], step[:, 1])
    course = np.where(distance > 0.0, np.arctan2(step[:, 1], step[:, 0]), starts[:, 2])
    lengths = np.zeros((len(starts), 4 * len(gears), LONGEST_WORD))
    turns = np.zeros_like(lengths)
    for k, gear in enumerate(gears):
        ahead = course if gear > 0.0 else course + pi
        first, last = turned(ahead - starts[:, 2]), turned(goals[:, 2] - ahead)
        lengths[:, 4 * k : 4 * k + 4, 1] = gear * distance[:, None]
        turns[:, 4 * k : 4 * k + 4, 0] = np.stack([first, first, _other(first), _other(first)], axis=1)
        turns[:, 4 * k : 4 * k + 4, 2] = np.stack([last, _other(last), last, _other(last)], axis=1)
    total = np.repeat(distance[:, None], lengths.shape[1], axis=1)
    # Without a distance, to drive backwards is the same as forwards.
    total[distance == 0.0, 4:] = np.inf
    return Words(lengths, turns, total)


def turned(angle: Array) -> Array:
    """The angles [rad] in [-pi, pi] of turns that end at the same headings."""
    turn: Array = (angle + pi) % (2.0 * pi) - pi
    return np.where(np.abs(turn) < ROUNDING, 0.0, turn)


def _other(turn: Array) -> Array:
    """The turns [rad] to the other side with the same heading at the end; 0 remains 0."""
    return turn - 2.0 * pi * np.sign(turn)


def _by_turns(found: Words) -> list[Way]:
    """The words of one pair of poses as different ways, those that turn least first."""
    known = np.isfinite(found.total[0])
    pairs = zip(found.lengths[0, known].tolist(), found.turns[0, known].tolist())
    ways = {tuple(Arc(*arc) for arc in zip(*one) if any(arc)) for one in pairs}
    return sorted(ways, key=lambda way: (sum(abs(arc.turn) for arc in way), way))


# Poses along a way.


def length_of(way: Sequence[Arc], lever: float = 0.0) -> float:
    """Length [m] of a way: what the middle of the axle drives, forwards or backwards.

    A turn on the spot by an angle is `lever` [m] times the angle long.

    Raises:
        InvalidInput: something else than pairs of numbers for the arcs, a lever below 0.
    """
    return float(_lengths(_arcs(way), not_negative(lever, "lever")).sum())


def _lengths(arcs: Array, lever: float) -> Array:
    """Lengths (k,) [m] of arcs (k, 2)."""
    return np.where(arcs[:, 0] == 0.0, lever * np.abs(arcs[:, 1]), np.abs(arcs[:, 0]))


def reversals(way: Iterable[Arc]) -> int:
    """The number of changes between forwards and backwards on a way."""
    signs = [arc.length > 0.0 for arc in way if arc.length != 0.0]
    return sum(a != b for a, b in pairwise(signs))


def moved(poses: Array, lengths: Array | float, turns: Array | float) -> Array:
    """Poses (..., 3) after arcs of these lengths and turns (...) from poses (..., 3): exact to rounding."""
    chord = lengths * np.sinc(0.5 / pi * np.asarray(turns))
    middle = poses[..., 2] + 0.5 * turns
    moved = poses[..., 0] + chord * np.cos(middle), poses[..., 1] + chord * np.sin(middle), poses[..., 2] + turns
    return np.stack(moved, axis=-1)


def ends(start: npt.ArrayLike, way: Sequence[Arc]) -> Array:
    """Poses (k + 1, 3) [m, rad] at the start of a way of k arcs and at the end of each.

    Raises:
        InvalidInput: something else than three numbers for the start, and pairs of numbers for the arcs.
    """
    poses = [array_of(start, "start", (3,))]
    for length, turn in _arcs(way).tolist():
        poses.append(moved(poses[-1], length, turn))
    return np.stack(poses)


def _arcs(way: Sequence[Arc]) -> Array:
    """The arcs (k, 2) of a way, checked."""
    listing(way, "arcs (length, turn)", "way")
    arcs = [pair(arc, "an arc (length, turn)", f"way[{k}]") for k, arc in enumerate(way)]
    return vectors(arcs, "way", 2) if arcs else np.zeros((0, 2))


def along(start: npt.ArrayLike, way: Sequence[Arc], distances: npt.ArrayLike, lever: float = 0.0) -> Array:
    """Poses (..., 3) [m, rad] at `distances` (...) [m] along a way from `start`: exact to rounding.

    A turn on the spot by an angle is `lever` [m] times the angle long, as in `length_of`. With 0 its poses are left
    out: at its place the pose is that after the turn. Before the start the pose is that at the start, beyond the end
    that at the end.

    Raises:
        InvalidInput: something else than three numbers for the start, pairs of numbers for the arcs, and numbers.
    """
    arcs, poses = _arcs(way), ends(start, way)
    lever = not_negative(lever, "lever")
    at = np.asarray([number(one, "distances") for one in np.ravel(distances).tolist()], np.float64)
    long = _lengths(arcs, lever)
    passed = np.concatenate([[0.0], np.cumsum(long)])
    at = np.clip(at, 0.0, passed[-1])
    k = np.searchsorted(passed, at, side="right") - 1
    shares = np.concatenate([arcs, np.zeros((1, 2))])[k]
    long = np.append(long, 0.0)[k]
    share = np.where(long > 0.0, (at - passed[k]) / np.where(long > 0.0, long, 1.0), 0.0)
    return moved(poses[k], share * shares[:, 0], share * shares[:, 1]).reshape(*np.shape(distances), 3)
