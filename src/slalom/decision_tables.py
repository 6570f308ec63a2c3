"""Tables from which the compiled policy decides: responses, and bodies grown by robots."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.errors import InvalidInput
from slalom.kernels.arrays import Corners, Flags, Indices
from slalom.kernels.decision.tables import EVERY_WORLD, GrownBodies, ResponseTable
from slalom.minkowski import sum_of_shapes
from slalom.obstacle_window import ObstacleWindow
from slalom.path import hermite, rest_from
from slalom.response import Response
from slalom.shape import Shape, round_shape
from slalom.state import State
from slalom.tolerances import BALL_WINDOWS, LINEAR_RESPONSE, RESPONSE_WINDOWS, TABLE_SPEED


@lru_cache(maxsize=64)
def response_table(
    kinds: tuple[tuple[Response, ...], ...], horizon: float, span: float, dimension: int
) -> ResponseTable:
    """The responses of each kind of robot as tables over `span` [s].

    The motion under a response is linear in the state and in the control, so two states stand for all.

    Raises:
        InvalidInput: a response that is not linear in the state.
    """
    responses = [response for kind in kinds for response in kind]
    windows = np.linspace(0.0, horizon, RESPONSE_WINDOWS + 1)
    ball_windows = np.linspace(0.0, horizon, 2 * BALL_WINDOWS + 1)
    knots, points, settled_velocity = [], [], []
    for response in responses:
        times = response.knots(span, 2.0 * TABLE_SPEED)
        shares = _shares(response, times, dimension)
        path = hermite(times, shares[0], shares[1])
        then = _shares(response, np.array([response.settled(horizon)]), dimension)
        knots.append(times)
        points.append(path.points)
        settled_velocity.append(then[1, 0])
    whole = np.concatenate(points)
    peaks = [_peaks(r, each, horizon, dimension) for r, each in enumerate(responses)]
    return ResponseTable(
        kinds=np.cumsum([0, *(len(kind) for kind in kinds)]),
        first=np.cumsum([0, *(len(each) for each in points)]),
        knots=np.concatenate(knots),
        velocity_gain=whole[..., 0].copy(),
        acceleration_gain=whole[..., 1].copy(),
        gain=whole[..., 2].copy(),
        error=np.array([response.interpolation_error for response in responses]),
        settled=np.array([response.settled(horizon) for response in responses]),
        rest=np.array([rest_from(times, each) for times, each in zip(knots, points)]),
        settled_velocity=np.array(settled_velocity),
        initial_acceleration=np.array([_initial_acceleration(response, dimension) for response in responses]),
        first_peak=np.cumsum([0, *(len(each) for each in peaks)]),
        peaks=np.array([peak for each in peaks for peak in each]),
        window_gains=np.array([_shares(response, windows, dimension)[0] for response in responses]),
        window_bends=np.array([_bends(response, windows, dimension) for response in responses]),
        ball_bends=np.array([_on_either_side(_bends(response, ball_windows, dimension)) for response in responses]),
    )


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
    """Rows (w, 3) of `ResponseTable.window_bends`, between the times `windows` (w + 1,) [s].

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
        self._bodies: dict[int, _RobotBodies] = {}

    def grown_bodies(self, kind: int, obstacles: ObstacleWindow, *, detours: bool) -> GrownBodies:
        """Predicted obstacles and robots of all kinds, grown by robots with one kind of skeleton.

        Args:
            detours: whether costs count detours, which need the positions of obstacles at the horizon.

        Raises:
            InvalidInput: see `minkowski.minkowski_sum`.
        """
        shape, d = self.shapes[kind], self.dimension
        bodies, end = obstacles.bodies(shape), obstacles.start + obstacles.horizon
        # Obstacles of several parts, such as walls, are left out: a disc does not represent them.
        staying, worlds = obstacles.staying(end) if detours else ([], np.empty(0, np.int64))
        robots, corners = self._robots(kind), Corners(bodies.corners, bodies.first, bodies.unordered)
        if len(robots.radius):
            corners = Corners(
                np.concatenate([bodies.corners, robots.corners.corners]),
                np.concatenate([bodies.first, bodies.first[-1] + robots.corners.first[1:]]),
                np.concatenate([bodies.unordered, robots.corners.unordered]),
            )
        every = np.full(len(bodies.owner), EVERY_WORLD)
        return GrownBodies(
            pieces=bodies.pieces,
            balls=bodies.balls,
            body_radius=bodies.radius,
            hull_radius=bodies.hull_radius,
            hull=bodies.hull,
            uncertain=bodies.uncertain,
            at_rest=bodies.at_rest,
            world=obstacles.worlds[bodies.owner] if obstacles.has_worlds else every,
            corners=corners if bodies.has_hulls or not robots.point.all() else (),
            heads=bodies.heads,
            end_positions=np.array([o.trajectory.position(end) for o in staying]).reshape(-1, d),
            end_radii=np.array([o.shape.bounding_radius for o in staying]),
            end_world=worlds,
            robot_rounding=float(shape.parts[0].radius if is_round(shape) else 0.0),
            robot_first=robots.first,
            robot_offset=robots.offset,
            robot_radius=robots.radius,
            robot_hull_radius=robots.hull_radius,
            robot_hull=np.where(robots.point, -1, len(bodies.radius) + np.arange(len(robots.radius))),
        )

    def _robots(self, kind: int) -> "_RobotBodies":
        """The bodies of robots of all kinds, made once. Raises InvalidInput, see `minkowski.minkowski_sum`."""
        if kind not in self._bodies:
            d, none = self.dimension, np.empty(0)
            # A robot that is alone meets no robot: two of its shape may have no sum.
            met = [round_shape(0.0, d) if is_round(each) else each for each in self.shapes if len(self.kind) > 1]
            sums = [sum_of_shapes(each, met[kind]) for each in met]
            counts = np.concatenate([np.empty(0, np.int64), *(each.counts for each in sums)])
            hull_radius = np.concatenate([none, *(each.hull_radius for each in sums)])
            offset = np.zeros((len(counts), 3))
            offset[:, :d] = np.concatenate([np.empty((0, d)), *(each.offsets for each in sums)])
            corners = Corners(
                np.concatenate([np.empty((0, 5)), *(each.corners for each in sums)]),
                np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)]),
                np.concatenate([np.empty(0, np.bool_), *(each.unordered for each in sums)]),
            )
            first = np.cumsum([0, *(len(each.counts) for each in sums)])
            radius, point = (
                np.concatenate([none, *(each.radius for each in sums)]),
                (counts == 1) & (hull_radius == 0.0),
            )
            self._bodies[kind] = _RobotBodies(first, offset, radius, hull_radius, point, corners)
        return self._bodies[kind]


class _RobotBodies(NamedTuple):
    """The bodies of robots of all kinds, grown by one kind of skeleton, see `GrownBodies`."""

    first: Indices  # (s + 1,)
    offset: Array  # (r, 3) [m]
    radius: Array  # (r,) [m]
    hull_radius: Array  # (r,) [m]
    point: Flags  # (r,) whether the hull is its origin
    corners: Corners


def moved_bodies(bodies: GrownBodies, by: Array) -> GrownBodies:
    """The same bodies, the passive ones displaced by a vector (d,) [m]."""
    balls = bodies.balls.copy()
    balls[:, : len(by)] += by
    pieces = bodies.pieces._replace(points=bodies.pieces.points + by)
    return bodies._replace(pieces=pieces, balls=balls, end_positions=bodies.end_positions + by)


def is_round(shape: Shape) -> bool:
    """Whether a shape is one disc or ball about its position."""
    return len(shape.parts) == 1 and len(shape.parts[0].corners) == 1 and not shape.parts[0].corners.any()
