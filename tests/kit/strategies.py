"""What Hypothesis draws: states, controls, obstacles of every kind, whole scenes; d = 2 and 3."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import parts
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy
from parts import SHAPES, Moved, disc_or_ball, served

from slalom import (
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    ControlObstacle,
    Headings,
    Obstacle,
    ObstacleWindow,
    PiecewisePolynomial,
    Response,
    Sampled,
    Shape,
    State,
    Stationary,
    Trajectory,
)
from slalom.model.trajectory import TRAJECTORIES

dimensions = st.sampled_from([2, 3])


def numbers(low: float, high: float) -> SearchStrategy[float]:
    """Numbers with at most six decimals: they shrink well, and rounding is not what these laws are about."""
    return st.floats(low, high).map(lambda x: round(x, 6))


def vectors(dimension: int, bound: float) -> SearchStrategy[np.ndarray]:
    """Vectors with coordinates from -bound to bound."""
    return st.lists(numbers(-bound, bound), min_size=dimension, max_size=dimension).map(np.array)


def directions(dimension: int) -> SearchStrategy[np.ndarray]:
    """Unit vectors."""
    long_enough = vectors(dimension, 1.0).filter(lambda v: np.linalg.norm(v) > 0.1)
    return long_enough.map(lambda v: np.asarray(v / np.linalg.norm(v)))


@st.composite
def turns(draw: DrawFn, dimension: int) -> np.ndarray:
    """Orthogonal matrices: one reflection (a mirror image) or two (a rotation)."""
    turn = np.eye(dimension)
    for _ in range(draw(st.integers(1, 2))):
        normal = draw(directions(dimension))
        turn = turn - 2.0 * np.outer(normal, normal) @ turn
    return turn


def controls(dimension: int, bound: float = 4.0) -> SearchStrategy[np.ndarray]:
    """One control."""
    return vectors(dimension, bound)


def states(dimension: int, speed: float = 3.0) -> SearchStrategy[State]:
    """Near the origin, with at most `speed` along each axis."""
    return st.builds(State, vectors(dimension, 2.0), vectors(dimension, speed), vectors(dimension, 1.0))


@st.composite
def _stationary(draw: DrawFn, d: int) -> Trajectory:
    return Stationary(draw(vectors(d, 8.0)))


@st.composite
def _constant_velocity(draw: DrawFn, d: int) -> Trajectory:
    return ConstantVelocity(draw(vectors(d, 8.0)), draw(vectors(d, 3.0)), draw(numbers(-1.0, 1.0)))


@st.composite
def _constant_acceleration(draw: DrawFn, d: int) -> Trajectory:
    acceleration = draw(vectors(d, 1.0))
    return ConstantAcceleration(draw(vectors(d, 8.0)), draw(vectors(d, 3.0)), acceleration, draw(numbers(-1.0, 1.0)))


@st.composite
def _circular(draw: DrawFn, d: int) -> Trajectory:
    normal = None if d == 2 else draw(directions(3))
    radius, speed, phase = draw(numbers(0.5, 10.0)), draw(numbers(-5.0, 5.0)), draw(numbers(0.0, 6.0))
    return Circular(draw(vectors(d, 6.0)), radius, speed, phase, normal)


@st.composite
def _sampled(draw: DrawFn, d: int) -> Trajectory:
    steps = draw(st.lists(numbers(0.2, 1.5), min_size=1, max_size=8))
    times = draw(numbers(-1.0, 1.0)) + np.cumsum([0.0, *steps])
    moves = np.array([draw(vectors(d, 2.0)) for _ in steps])
    positions = draw(vectors(d, 8.0)) + np.concatenate([np.zeros((1, d)), np.cumsum(moves, axis=0)])
    return Sampled(times, positions, draw(st.sampled_from(["smooth", "linear"])))


@st.composite
def _piecewise_polynomial(draw: DrawFn, d: int) -> Trajectory:
    """Pieces of degree 4 that meet."""
    durations = draw(st.lists(numbers(0.4, 2.5), min_size=1, max_size=4))
    position, pieces = draw(vectors(d, 8.0)), []
    for duration in durations:
        piece = np.array([position, *(draw(vectors(d, size)) for size in (2.0, 1.0, 0.3, 0.1))])
        position = (piece * duration ** np.arange(5)[:, None]).sum(axis=0)
        pieces.append(piece)
    return PiecewisePolynomial(durations, pieces, draw(numbers(-1.0, 1.0)))


def _like_the_example(kind: str) -> Callable[[int], SearchStrategy[Trajectory]]:
    """The example of a kind in `parts`, displaced."""

    @st.composite
    def drawn(draw: DrawFn, d: int) -> Trajectory:
        example = next(one for make in parts.TRAJECTORIES.values() if type(one := make(d)) is TRAJECTORIES[kind])
        return Moved(example, shift=draw(vectors(d, 8.0)))

    return drawn


KINDS: dict[str, Callable[[int], SearchStrategy[Trajectory]]] = {
    "stationary": _stationary,
    "constant_velocity": _constant_velocity,
    "constant_acceleration": _constant_acceleration,
    "circular": _circular,
    "sampled": _sampled,
    "piecewise_polynomial": _piecewise_polynomial,
}
"""One strategy for each kind of trajectory, by the names of `slalom.model.trajectory.TRAJECTORIES`."""
KINDS |= {kind: _like_the_example(kind) for kind in TRAJECTORIES if kind not in KINDS}


def trajectories(dimension: int) -> SearchStrategy[Trajectory]:
    """Of any kind."""
    return st.one_of([kind(dimension) for kind in KINDS.values()])


@st.composite
def shapes(draw: DrawFn, dimension: int, low: float = 0.1, high: float = 2.0, without: tuple[str, ...] = ()) -> Shape:
    """Of any kind but some."""
    name = draw(st.sampled_from([name for name in served(dimension) if name not in without]))
    return SHAPES[name](draw(numbers(low, high)), dimension)


SLOWEST, QUICKEST_TURN = 0.1, 4.0
"""[m/s], [rad/s] Where a body that faces along its motion is slower or turns faster, brute force would miss it."""


def faces_its_motion(track: Trajectory) -> bool:
    """Whether a body that faces along the motion turns slowly, apart from jumps."""
    times = np.linspace(*np.clip(track.span, -2.0, 8.0), 1001)
    v, a = track.velocity(times), track.acceleration(times)
    speed = np.linalg.norm(v, axis=1)
    if speed.min() < SLOWEST:
        return False
    return float(np.max(np.abs(v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0]) / speed**2)) < QUICKEST_TURN


@st.composite
def headings(draw: DrawFn, track: Trajectory) -> float | str | Headings:
    """An angle, angles over time or, of what moves in the plane, where it goes; in space 0."""
    if track.dimension == 3:
        return 0.0
    kind = draw(st.sampled_from(["angle", "motion", "angles"]))
    if kind == "motion" and faces_its_motion(track):
        return "motion"
    if kind == "angles":
        return Headings([-1.0, 1.0, 1.5, 4.0], draw(st.lists(numbers(-1.5, 1.5), min_size=4, max_size=4)))
    return draw(numbers(-4.0, 4.0))


@st.composite
def obstacles(draw: DrawFn, dimension: int, shaped: bool = True) -> Obstacle:
    """Of any shape, or round only, on any kind of trajectory, with any heading."""
    track = draw(trajectories(dimension))
    if not shaped:
        return Obstacle(disc_or_ball(draw(numbers(0.1, 2.0)), dimension), track, after_end="leaves")
    return Obstacle(draw(shapes(dimension)), track, heading=draw(headings(track)), after_end="leaves")


@st.composite
def robots(draw: DrawFn, around: list[Obstacle], dimension: int, shaped: bool = True) -> Shape:
    """Round or not. A wall is no robot; in space a capsule meets balls only, since more is not served."""
    served = dimension == 2 or all(len(part.corners) == 1 for o in around for part in o.shape.parts)
    if not shaped or not served or draw(st.booleans()):
        return disc_or_ball(draw(numbers(0.0, 0.5)), dimension)
    return draw(shapes(dimension, 0.05, 0.5, without=("polyline",)))


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything but the response that a control obstacle needs."""

    state: State
    robot: Shape
    obstacles: tuple[Obstacle, ...]
    start: float
    horizon: float
    margin: float
    controls: np.ndarray

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.state.dimension

    def blocked(
        self,
        response: Response,
        *,
        margin: float | None = None,
        horizon: float | None = None,
        obstacles: tuple[Obstacle, ...] | None = None,
    ) -> ControlObstacle:
        """The control obstacle of this scene, perhaps with another margin or horizon or other obstacles."""
        traffic = ObstacleWindow(
            self.obstacles if obstacles is None else obstacles, self.start, horizon or self.horizon
        )
        return ControlObstacle(response, self.state, traffic, self.robot, self.margin if margin is None else margin)


@st.composite
def scenes(draw: DrawFn, apart: float | None = 1e-3, most: int = 3, shaped: bool = True) -> Scene:
    """A robot, one to `most` obstacles, of any shapes or all round, and four controls.

    With `apart` [m] obstacles are moved along the x axis until they begin at least that far from the robot; with None
    they may overlap it.
    """
    d = draw(dimensions)
    state, start = draw(states(d)), draw(numbers(-0.5, 1.0))
    around, margin = draw(st.lists(obstacles(d, shaped), min_size=1, max_size=most)), draw(st.sampled_from([0.01, 0.2]))
    robot, found = draw(robots(around, d, shaped)), []
    for obstacle in around:
        track = obstacle.trajectory
        if apart is not None and obstacle.exists(start):
            away = track.position(start) - state.position
            room = obstacle.shape.bounding_radius + robot.bounding_radius + margin + apart
            if np.linalg.norm(away) < room:
                track = Moved(track, shift=np.eye(d)[0] * np.copysign(2.0 * room, away[0]))
        found.append(replace(obstacle, trajectory=track))
    horizon = draw(numbers(0.5, 5.0))
    tried = np.array([draw(controls(d)) for _ in range(4)])
    return Scene(state, robot, tuple(found), start, horizon, margin, tried)
