"""The table of robots: states, limits, targets, bounds, committed and observed paths."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from slalom import kernels
from slalom.base.checks import Array, vector
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import BRAKING_SHARE
from slalom.forecast.linear import piecewise_polynomial
from slalom.kernels.arrays import Bodies, Flags, Indices, MaybeCorners, Records, joined_corners, zero_records
from slalom.kernels.decision.tables import (
    BALL_WINDOWS,
    RESPONSE_WINDOWS,
    AtHorizon,
    Bounds,
    DecisionSettings,
    Paths,
    ResponsePiece,
    ResponseTable,
    Robot,
    RobotBodies,
    RobotBody,
    RobotTable,
    TabulatedResponse,
    TargetPaths,
)
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path import Path, hermite, rest_from, straight_from
from slalom.model.response import Response
from slalom.model.shape import Shape, is_round, round_shape
from slalom.model.state import State
from slalom.model.trajectory import PiecewisePolynomial, Stationary
from slalom.obstacle.pieces import Reach, no_sum, sum_of_shapes, sums_together
from slalom.obstacle.table import NONE_AT_HORIZON
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import ObstacleWindow

SAME_POSITION: Final = 1e-6
"""[m] Robots that overlap and are nearer to each other than this leave in directions by their numbers. Larger: robots
next to each other leave in directions that have nothing to do with their positions. Smaller than the rounding of
positions: robots that start at one position stay together."""

GOLDEN_ANGLE: Final = 2.399963229728653
"""[rad] Angle between the directions of robots that follow each other by number: no two directions are near."""


def target_paths(goals: Sequence[Goal], start: float, end: float) -> tuple[TargetPaths, Flags]:
    """The motion of goals from `start` to `end` [s]; and which of them move then (n,)."""
    first = [0]
    times = []
    points = []
    for goal in goals:
        begin, last = max(start, goal.trajectory.span[0]), min(end, goal.trajectory.span[1])
        if isinstance(goal.trajectory, Stationary) or not begin < last:
            first.append(first[-1])
            times.append(np.zeros(1))
            continue
        path = goal.trajectory.path(begin, last)
        wide = np.zeros((len(path.points), 4, 3))
        wide[..., : path.points.shape[2]] = path.points
        first.append(first[-1] + len(wide))
        times.append(path.times)
        points.append(wide)
    none = np.empty((0, 4, 3))
    paths = TargetPaths(np.array(first), np.concatenate([np.empty(0), *times]), np.concatenate([none, *points]))
    return paths, np.diff(paths.first) > 0


def bounds_of(limits: Sequence[Limits], states: Sequence[State]) -> Bounds:
    """The half-spaces of robots with these limits in these states, as they stand now.

    Raises:
        InvalidInput: a bound of another dimension than the states.
    """
    first, rows = [0], list[Array]()
    for each, state in zip(limits, states, strict=True):
        count = first[-1]
        for of, flats in enumerate((each.velocity_bounds, each.acceleration_bounds)):
            for flat in flats:
                normal = vector(flat.normal, "normal of a bound", state.dimension)
                rows.append(_rows(of, 0, normal[None], np.array([flat.offset])))
                count += 1
        for bound in each.bounds:
            rows.append(_rows(int(bound.of == "acceleration"), 1, *bound.half_spaces(state)))
            count += len(rows[-1])
        first.append(count)
    return Bounds(np.array(first), np.concatenate([np.empty((0, 6)), *rows]))


def _rows(of: int, turns: int, normals: Array, offsets: Array) -> Array:
    rows = np.zeros((len(offsets), 6))
    rows[:, 0] = of
    rows[:, 1] = turns
    rows[:, 5] = offsets
    rows[:, 2 : 2 + normals.shape[1]] = normals
    return rows


def robot_table(n: int, committed: int, observed: int) -> RobotTable:
    """A table of n robots whose paths have up to that many pieces; all values 0, no robot committed."""
    each = zero_records(Robot, n)
    each["priority"] = 1.0
    each["present"] = True
    each["settled"], each["response"] = np.inf, -1
    return RobotTable(
        each=each,
        committed=Paths(np.zeros((n, committed + 1)), np.zeros((n, committed, 4, 3))),
        observed=Paths(np.zeros((n, observed + 1)), np.zeros((n, observed, 4, 3))),
    )


class RobotRow(NamedTuple):
    """Views of the fields of one robot in a table, of which each decision writes or reads all.

    To find a field of records by its name takes five times as long as to write it.
    """

    position: Array  # (d,), as the next six
    velocity: Array
    acceleration: Array
    target: Array
    wanted: Array
    control: Array
    preferred: Array
    max_speed: Array  # (1,), as the rest
    margin: Array
    margin_among: Array
    enough: Array
    tolerance: Array
    stop: Flags
    moving: Flags
    final: Flags
    objective: Indices
    settled: Array
    resting: Flags
    response: Indices
    outcome: Indices
    work: Array


VECTORS = 7
"""The fields of `RobotRow` that are vectors, which are the first ones."""


def robot_row(each: Records[Robot], k: int, dimension: int) -> RobotRow:
    """The views of the robot in row k of a table."""
    vectors = [each[name][k, :dimension] for name in RobotRow._fields[:VECTORS]]
    return RobotRow(*vectors, *(each[name][k : k + 1] for name in RobotRow._fields[VECTORS:]))


def states_on_paths(paths: Paths, t: float) -> tuple[Array, Array]:
    """Velocities (n, 3) [m/s] and positions (n, 3) [m] at time t [s] on paths."""
    times, rows = paths.times, np.arange(len(paths.times))
    piece = np.minimum((times[:, 1:] < t).sum(axis=1), paths.points.shape[1] - 1)
    begin = times[rows, piece]
    width = (times[rows, piece + 1] - begin)[:, None]
    x, p = (t - begin)[:, None] / np.where(width > 0.0, width, 1.0), paths.points[rows, piece]
    p0 = p[:, 0]
    p1 = p[:, 1]
    p2 = p[:, 2]
    p3 = p[:, 3]
    slope = (1 - x) ** 2 * (p1 - p0) + 2 * x * (1 - x) * (p2 - p1) + x * x * (p3 - p2)
    position = (1 - x) ** 3 * p0 + 3 * x * (1 - x) ** 2 * p1 + 3 * x * x * (1 - x) * p2 + x**3 * p3
    return 3.0 * slope / np.where(width > 0.0, width, 1.0), position


def reaches(each: Records[Robot], horizon: float) -> Array:
    """How far (n,) [m] from its position the body of each robot can be within the horizon [s]."""
    # No response makes a robot faster that exceeds its maximum speed.
    speed = np.maximum(each["max_speed"], np.linalg.norm(each["velocity"], axis=1))
    return np.asarray(speed * horizon + each["radius"])


def observe(robots: RobotTable, others: Tracks, times: Array, points: Array) -> None:
    """Put others into all rows but the first: on their predicted paths, see `Tracks.paths`.

    Pieces without duration fill the rest of the rows.
    """
    d = others.dimension
    states = others.states
    each = robots.each[1:]
    each["position"][:, :d], each["velocity"][:, :d] = states[:, 0], states[:, 1]
    each["acceleration"][:, :d], each["priority"] = states[:, 2], 1.0
    each["rounding"] = each["radius"] = others.radii
    q = points.shape[1]
    robots.observed.times[1:] = times[:, -1:]
    robots.observed.times[1:, : q + 1], robots.observed.points[1:, :q, :, :d] = times, points


def observed_path(robots: RobotTable, j: int, k: int, dimension: int) -> PiecewisePolynomial:
    """The path of the robot in row j as the one in row k predicts it.

    Two robots at the same position have no direction from each other, and would leave in the same one. They count as
    displaced by SAME_POSITION, each in a direction of its own.
    """
    points, each = robots.observed.points[j, ..., :dimension], robots.each["position"]
    if np.linalg.norm(each[j] - each[k]) < SAME_POSITION:
        angles = GOLDEN_ANGLE * np.array([j, k])
        directions = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)[:, :dimension]
        points = points + SAME_POSITION * (directions[0] - directions[1])
    return piecewise_polynomial(robots.observed.times[j], points)


class GrownBodies(NamedTuple):
    """All bodies that robots with one kind of skeleton can meet, grown by it: members of `DecisionTables`."""

    obstacles: Bodies
    robots: RobotBodies
    at_horizon: AtHorizon


def stop_observed(kind: int, robots: RobotTable, bodies: GrownBodies, settings: DecisionSettings) -> None:
    """Let robots with a kind of skeleton, by which `bodies` are grown, stop at obstacles if they are predicted so."""
    if settings.stops_at_obstacles and len(bodies.obstacles.each):
        kernels.stop_at_obstacles(kind, robots, bodies.obstacles, bodies.robots.rounding, settings)


def commit_to(robots: RobotTable, k: int, path: Path) -> None:
    """Commit the robot in row k to a path that has no more pieces than the table."""
    count, d = path.points.shape[0], path.points.shape[2]
    times, points = robots.committed
    times[k] = path.times[-1]
    times[k, :count] = path.times[:-1]
    points[k, :count, :, :d] = path.points


def publish(robots: RobotTable, k: int) -> None:
    """Let the others observe the committed path of the robot in row k."""
    committed, observed = robots.committed, robots.observed
    p = committed.points.shape[1]
    observed.times[k] = committed.times[k, -1]
    observed.times[k, : p + 1] = committed.times[k]
    observed.points[k, :p] = committed.points[k]


def committed_path(robots: RobotTable, k: int, dimension: int) -> Path:
    """The committed path of the robot in row k, as a copy."""
    times, points = robots.committed.times[k], robots.committed.points[k]
    # After the last piece its end is repeated.
    count = int(times.searchsorted(times[-1]))
    # Whole rows are copied three times as fast as their first columns.
    return Path(times[: count + 1].copy(), points[:count].copy()[..., :dimension], np.zeros(count))


# The responses of robots as tables, from which the compiled policy decides.


LINEAR_RESPONSE: Final = 1e-9
"""[1, m] Relative and absolute error up to which the motion under a response counts as linear in the state. Larger: a
response that is not linear is predicted wrongly. Smaller: rounding refuses a linear one."""

TABLE_SPEED: Final = 100.0
"""[m/s] The tables of responses whose motion is not cubic are within INTERPOLATION up to this speed. Larger: more
pieces in every table. Smaller: the motion of faster robots is less exact than the clearance assumes."""


@lru_cache(maxsize=64)
def response_table(
    kinds: tuple[tuple[Response, ...], ...], horizon: float, span: float, dimension: int, period: float
) -> ResponseTable:
    """The responses of each kind of robot as tables over `span` [s].

    The motion under a response is linear in the state and in the control, so two states stand for all. `period` [s]: of
    the decisions.

    Raises:
        InvalidInput: a response that is not linear in the state.
    """
    responses = [response for kind in kinds for response in kind]
    windows = np.linspace(0.0, horizon, RESPONSE_WINDOWS + 1)
    ball_windows = np.linspace(0.0, horizon, 2 * BALL_WINDOWS + 1)
    knots = []
    points = []
    settled_velocity = []
    for response in responses:
        times = response.knots(span, 2.0 * TABLE_SPEED)
        shares = _shares(response, times, dimension)
        path = hermite(times, shares[0], shares[1])
        then = _shares(response, np.array([step_of(response, horizon, period)]), dimension)
        knots.append(times)
        points.append(path.points)
        settled_velocity.append(then[1, 0])
    whole = np.concatenate(points)
    pieces, each = zero_records(ResponsePiece, len(whole)), zero_records(TabulatedResponse, len(responses))
    pieces["velocity_gain"], pieces["acceleration_gain"], pieces["gain"] = np.moveaxis(whole, 2, 0)
    of_kinds = [[step_of(response, horizon, period) for response in kind] for kind in kinds]
    each["step"] = [time for times in of_kinds for time in times]
    each["shortest"] = [min(times) for times in of_kinds for _ in times]
    peaks = [_peaks(r, response, horizon, dimension) for r, response in enumerate(responses)]
    for r, response in enumerate(responses):
        each["error"][r], each["settled"][r] = response.interpolation_error, response.settled(horizon)
        each["rest"][r], each["settled_velocity"][r] = rest_from(knots[r], points[r]), settled_velocity[r]
        each["straight"][r] = straight_from(points[r])
        speeds = _shares(response, np.array([response.settled(span), span]), dimension)[1, :, 0]
        each["brakes"][r] = not response.restartable and speeds[1] < speeds[0]
        each["initial_acceleration"][r] = _initial_acceleration(response, dimension)
        each["window_gains"][r] = _shares(response, windows, dimension)[0]
        each["window_bends"][r] = _bends(response, windows, dimension)
        each["ball_bends"][r] = _on_either_side(_bends(response, ball_windows, dimension))
    return ResponseTable(
        each=each,
        pieces=pieces,
        kinds=np.cumsum([0, *(len(kind) for kind in kinds)]),
        first=np.cumsum([0, *(len(cubics) for cubics in points)]),
        knots=np.concatenate(knots),
        first_peak=np.cumsum([0, *(len(of_one) for of_one in peaks)]),
        peaks=np.array([peak for of_one in peaks for peak in of_one]),
    )


def step_of(response: Response, horizon: float, period: float) -> float:
    """Time [s] after which a control is judged: settled, or after which the next one may replace it without a loss.

    The second for responses whose control, held again, continues the same motion.
    """
    return min(period, horizon) if response.restartable else response.settled(horizon)


def stopping_deceleration(responses: Sequence[Response], limits: Limits, horizon: float, period: float) -> float:
    """The deceleration [m/s^2] with which a robot plans to stop: the share BRAKING_SHARE of what it can reach.

    A control that approaches a velocity with a lag reaches less, on average until it is settled, than at its start.
    """
    state, least = State(np.zeros(2), np.ones(2)), 1.0
    for response in responses:
        time = step_of(response, horizon, period)
        for peak in response.acceleration_peaks(state, horizon)[:1] if time > 0.0 else ():
            least = min(least, float(response.velocity(state, time).gain) / (time * float(peak.gain)))
    return BRAKING_SHARE * limits.braking * least


def _units(dimension: int) -> tuple[State, State]:
    """A state with velocity 1, and one with acceleration 1, along x."""
    nothing, one = np.zeros(dimension), np.eye(dimension)[0]
    return State(nothing, one), State(nothing, nothing, one)


def _shares(response: Response, times: Array, dimension: int) -> Array:
    """Shares (2, n, 3) of velocity, acceleration and control in position and velocity after `times` (n,) [s].

    Raises:
        InvalidInput: a response that is not linear in the state.
    """
    probe = State(np.full(dimension, 0.3), np.linspace(1.1, -0.4, dimension), np.linspace(-0.5, 0.9, dimension))
    shares = np.empty((2, len(times), 3))
    if np.iscomplexobj(response.velocity(probe, 0.0).gain):
        raise InvalidInput(f"response: expected one that does not turn the control, found {response!r}")
    for k, of in enumerate((response.position, response.velocity)):
        with_velocity, with_acceleration = (of(state, times) for state in _units(dimension))
        shares[k, :, 0], shares[k, :, 1] = with_velocity.drift[:, 0], with_acceleration.drift[:, 0]
        shares[k, :, 2] = with_velocity.gain
        expected = shares[k, :, :1] * probe.velocity + shares[k, :, 1:2] * probe.acceleration
        expected = expected + (probe.position if k == 0 else 0.0)
        found = of(probe, times)
        if not (
            np.allclose(found.drift, expected, LINEAR_RESPONSE, LINEAR_RESPONSE)
            and np.allclose(found.gain, shares[k, :, 2], LINEAR_RESPONSE, LINEAR_RESPONSE)
        ):
            raise InvalidInput(f"response: expected a motion that is linear in the state, found that of {response!r}")
    return shares


def _bends(response: Response, windows: Array, dimension: int) -> Array:
    """Rows (w, 3) of `TabulatedResponse.window_bends`, between the times `windows` (w + 1,) [s].

    A chord of length h is missed by at most h^2 / 8 times the largest second derivative.
    """
    times = response.knots(float(windows[-1]), 2.0 * TABLE_SPEED)
    shares = _shares(response, times, dimension)
    parts = hermite(times, shares[0], shares[1]).cut(np.union1d(times, windows))
    second = 6.0 * np.abs(np.diff(parts.points, 2, axis=1)).max(axis=1) / np.diff(parts.times)[:, None] ** 2
    bends = np.zeros((len(windows) - 1, 3))
    window = np.searchsorted(windows, parts.times[:-1], side="right") - 1
    np.maximum.at(bends, np.minimum(window, len(bends) - 1), second)
    return np.asarray(bends * (windows[1] - windows[0]) ** 2 / 8.0)


def _on_either_side(bends: Array) -> Array:
    """The larger of the values of two windows (w, 3) at each of their ends (w + 1, 3)."""
    return np.asarray(np.maximum(np.concatenate([bends[:1], bends]), np.concatenate([bends, bends[-1:]])))


def _initial_acceleration(response: Response, dimension: int) -> tuple[float, float, float]:
    """Shares of velocity, acceleration and control in the acceleration at the start."""
    of_velocity, of_acceleration = (response.acceleration(state, 0.0) for state in _units(dimension))
    return float(of_velocity.drift[0]), float(of_acceleration.drift[0]), float(of_velocity.gain)


def _peaks(r: int, response: Response, horizon: float, dimension: int) -> list[tuple[float, ...]]:
    """Rows of `ResponseTable.peaks` of response number r."""
    rows: list[tuple[float, ...]] = []
    of_velocity, of_acceleration = _units(dimension)
    for which, peaks in enumerate((response.speed_peaks, response.acceleration_peaks)):
        for v, a in zip(peaks(of_velocity, horizon), peaks(of_acceleration, horizon), strict=True):
            if float(v.gain):
                rows.append((r, which, float(v.drift[0]), float(a.drift[0]), float(v.gain)))
    return rows


# The bodies of obstacles and robots, grown by the shapes of robots, from which the compiled policy decides.


class Skeletons:
    """The kinds of skeletons of robots: discs and balls of any radius are of one kind, their centre.

    Attributes:
        kind: (n,) of each robot. rounding: (n,) [m] of each robot; 0 for shapes that are not discs or balls.
        shapes: of each kind, the shape of its first robot. dimension: 2 or 3.
    """

    def __init__(self, shapes: Sequence[Shape]) -> None:
        self.dimension = shapes[0].dimension
        self.shapes: list[Shape] = []
        self.rounding = np.zeros(len(shapes))
        kinds: dict[tuple[object, ...], int] = {}
        kind = []
        for k, shape in enumerate(shapes):
            key: tuple[object, ...] = tuple((part.corners.tobytes(), part.radius) for part in shape.parts)
            if is_round(shape):
                key, self.rounding[k] = (), shape.parts[0].radius
            if key not in kinds:
                kinds[key] = len(kinds)
                self.shapes.append(shape)
            kind.append(kinds[key])
        self.kind: Indices = np.array(kind)
        self._robots: dict[int, tuple[RobotBodies, MaybeCorners]] = {}
        self._alone: dict[int, GrownBodies] = {}

    def grown_bodies(
        self, kind: int, obstacles: ObstacleWindow, *, detours: bool, around: Reach | None = None
    ) -> GrownBodies:
        """Predicted obstacles and robots of all kinds, grown by robots with one kind of skeleton.

        Args:
            detours: whether costs count detours, which need the positions of obstacles at the horizon.
            around: bodies farther away from it may be left out, see `Bodies.reach`; None: none is.

        Raises:
            InvalidInput: see `minkowski_sum`.
        """
        if not len(obstacles.until):
            if kind not in self._alone:
                self._alone[kind] = self._made(kind, obstacles, None, detours=False)
            return self._alone[kind]
        return self._made(kind, obstacles, around, detours=detours)

    def _made(self, kind: int, obstacles: ObstacleWindow, around: Reach | None, *, detours: bool) -> GrownBodies:
        bodies = obstacles.uncut_bodies(self.shapes[kind], around)
        robots, corners = self._robots.get(kind) or self._robot_bodies(kind)
        if corners:
            before = len(bodies.corners.unordered) if bodies.corners else 0
            robots = robots._replace(hull=np.where(robots.hull < 0, -1, before + robots.hull))
            bodies = bodies._replace(corners=joined_corners([bodies.corners, corners]))
        return GrownBodies(bodies, robots, obstacles.at_horizon(bodies) if detours else NONE_AT_HORIZON)

    def _robot_bodies(self, kind: int) -> tuple[RobotBodies, MaybeCorners]:
        """The bodies of robots of all kinds, with hulls numbered from 0, and their corners, made once.

        Raises InvalidInput, see `minkowski_sum`.
        """
        if kind not in self._robots:
            d = self.dimension
            # A robot that is alone meets no robot: two of its shape may have no sum.
            met = [round_shape(0.0, d) if is_round(each) else each for each in self.shapes if len(self.kind) > 1]
            sums = [sum_of_shapes(each, met[kind]) for each in met]
            first, grown = np.cumsum([0, *(len(each.counts) for each in sums)]), sums_together([no_sum(d), *sums])
            bodies = zero_records(RobotBody, len(grown.counts))
            bodies["offset"][:, :d] = grown.offsets
            bodies["radius"], bodies["hull_radius"] = grown.radius, grown.hull_radius
            point = grown.is_point
            hull = np.where(point, -1, np.arange(len(point)))
            shape = self.shapes[kind]
            rounding = float(shape.parts[0].radius if is_round(shape) else 0.0)
            self._robots[kind] = RobotBodies(first, bodies, hull, rounding), () if point.all() else grown.hulls
        return self._robots[kind]
