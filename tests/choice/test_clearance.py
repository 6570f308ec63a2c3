"""Clearances of what is fast: controls far beyond the speed of a robot, bodies that turn fast, contact on a circle."""

import numpy as np
import pytest
from oracle import RESPONSES

from slalom import (
    Acceleration,
    Capsule,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    LaggedVelocity,
    Limits,
    Obstacle,
    ObstacleTable,
    ObstacleWindow,
    Polygon,
    Rectangle,
    Shape,
    State,
    Status,
    select,
    select_many,
)
from slalom.base.tolerances import CERTIFIED, CLEARANCE, INTERPOLATION, OVERLAP

LAG, HORIZON = 0.8, 4.0


def true_clearance(state: State, u: np.ndarray, rock: Obstacle, radius: float) -> float:
    """Least gap [m] to a disc by the closed form of the lag, on times refined around the least."""

    def gaps(times: np.ndarray) -> np.ndarray:
        return np.linalg.norm(lagged(state, u, times)[0] - rock.trajectory.position(times), axis=1) - radius

    low, high = 0.0, HORIZON
    for _ in range(12):
        times = np.linspace(low, high, 2001)
        k = int(np.argmin(gaps(times)))
        low, high = times[max(k - 1, 0)], times[min(k + 1, 2000)]
    return float(gaps(times).min())


def lagged(state: State, u: np.ndarray, times: np.ndarray) -> list[np.ndarray]:
    """Position, velocity and acceleration (n, 2) after `times` (n,)."""
    shares = RESPONSES["LaggedVelocity"](times, lag=LAG)
    start = (state.position, np.zeros(2), np.zeros(2))
    return [p + of_v[:, None] * state.velocity + of_u[:, None] * u for p, (of_v, _, of_u) in zip(start, shares)]


@pytest.mark.parametrize("speed", [30.0, 300.0, 5000.0])
def test_clearance_of_large_controls_is_never_above_the_true_one(speed: float) -> None:
    """Of a disc ahead that the robot nearly reaches: pieces for usual controls lie up to 5e-5 m behind at 5000 m/s."""
    rng = np.random.default_rng(3)
    state, response = State((0.0, 0.0), (2.0, -1.0)), LaggedVelocity(lag=LAG)
    differences = []
    for when in np.linspace(0.004, 0.12, 60):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        u = speed * np.array([np.cos(angle), np.sin(angle)])
        place, velocity, acceleration = (value[0] for value in lagged(state, u, np.array([when])))
        # The disc is as fast as the robot at that time, and gains speed twice as fast.
        center = place + 0.7 * u / speed
        rock = Obstacle(Disc(0.4), ConstantAcceleration(center, velocity, 2.0 * acceleration, when))
        blocked = ControlObstacle(response, state, ObstacleWindow([rock], 0.0, HORIZON), Disc(0.1))
        differences.append(float(blocked.clearance(u)) - true_clearance(state, u, rock, 0.5))
    assert max(differences) <= CLEARANCE
    assert min(differences) >= -CERTIFIED


@pytest.mark.slow
def test_large_controls_that_are_chosen_are_clear_of_the_true_motion() -> None:
    """One by one and many at once, to the bit."""
    state, response = State((0.0, 0.0), (2.0, -1.0)), LaggedVelocity(lag=LAG)
    limits, rng = Limits(4000.0, 1e5), np.random.default_rng(5)
    centers = rng.uniform(200.0, 6000.0, size=(30, 2))
    rocks = [Obstacle(Disc(40.0), ConstantVelocity(center, (0.0, 0.0))) for center in centers]
    window, preferred = ObstacleWindow(rocks, 0.0, HORIZON), rng.uniform(500.0, 2500.0, size=(20, 2))
    many = select_many(preferred, [state] * 20, response, limits, window, Disc(0.5))
    constrained = 0
    for row, target in enumerate(preferred):
        blocked = ControlObstacle(response, state, window, Disc(0.5))
        choice = select(target, limits.admissible(response, state, HORIZON), blocked)
        constrained += choice.status is Status.CONSTRAINED
        assert choice.control is not None
        assert many.controls[row].tolist() == choice.control.tolist()
        least = min(true_clearance(state, choice.control, rock, 40.5) for rock in rocks)
        assert least >= -1e-9
    assert constrained > 3


def touching(gap: float, now: float, table: bool, side: float) -> ControlObstacle:
    """A robot at a true clearance of `gap` [m] to an obstacle on a circle at time `now` [s]; side 1: inside of it."""
    circle = Circular((0.0, 0.0), 5.0, 2.0, phase=0.3)
    rock = Obstacle(Disc(0.4), circle)
    place = circle.position(now) * (1.0 - side * (0.5 + gap) / 5.0)
    window = ObstacleWindow([ObstacleTable([rock])] if table else [rock], now, HORIZON)
    return ControlObstacle(Acceleration(), State(place, (0.0, 0.0)), window, Disc(0.1))


@pytest.mark.parametrize("table", [False, True], ids=["list", "table"])
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["inside", "outside"])
def test_contact_with_an_obstacle_on_a_circle_is_no_overlap(table: bool, side: float) -> None:
    """Up to OVERLAP deep. The pieces lie up to INTERPOLATION beside the circle; a table is cut in the middle of one."""
    for now in np.linspace(0.0, 3.0, 61):
        assert not touching(2.0 * INTERPOLATION - OVERLAP, float(now), table, side).overlaps
        deeper = touching(-2.0 * INTERPOLATION - OVERLAP, float(now), table, side)
        assert deeper.overlaps
        assert deeper.overlapping.tolist() == [0]


@pytest.mark.parametrize(
    ("shape", "nearest"),
    [
        (Rectangle(2.0, 1.0), 2.5),
        (Polygon(np.array([(-0.5, -0.5), (0.5, -0.5), (0.2, 0.5)])), float(np.hypot(0.2, 2.5))),
        (Capsule((-0.5, 0.0), (0.5, 0.0), 0.2), 2.8),
    ],
    ids=["side", "corner", "round"],
)
@pytest.mark.parametrize("gap", [0.1, 1e-3, 1e-5])
def test_a_body_that_turns_about_a_robot_at_rest_keeps_its_clearance(shape: Shape, nearest: float, gap: float) -> None:
    """On a circle of 3 m about the robot, one side or corner is always the nearest part, and as near."""
    car = Obstacle(shape, Circular((0.0, 0.0), 3.0, 0.8, 0.3), heading="motion")
    window = ObstacleWindow([car], 0.0, HORIZON)
    blocked = ControlObstacle(Acceleration(), State((0.0, 0.0), (0.0, 0.0)), window, Disc(nearest - gap))
    assert gap - CERTIFIED <= blocked.clearance((0.0, 0.0)) <= gap + CLEARANCE
