"""What a robot with a goal at rest wishes for: a velocity that leads there, and how long it will take."""

import numpy as np

from slalom.kernels.arrival import earliest_arrival
from slalom.kernels.compiled import Array, kernel


@kernel
def stopping_velocity(away: Array, push: float, top: float, wanted: Array) -> None:
    """Towards `away`, no faster than 0.7 of `push` brakes away nor than `top`, into `wanted`."""
    distance = 1e-12
    square = 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
    distance = max(np.sqrt(square), 1e-12)
    speed = min(top, np.sqrt(1.4 * push * distance))
    for axis in range(len(away)):
        wanted[axis] = away[axis] * speed / distance


@kernel
def passing_velocity(away: Array, velocity: Array, push: float, top: float, wanted: Array) -> None:
    """Towards `away` at `top`, but no faster than lets the robot turn there, into `wanted`.

    The arc from the present heading to the place has the radius distance / (2 sin angle).
    """
    square, speed, along = 0.0, 0.0, 0.0
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        speed += velocity[axis] * velocity[axis]
        along += away[axis] * velocity[axis]
    distance = max(np.sqrt(square), 1e-12)
    cosine = along / (distance * max(np.sqrt(speed), 1e-12))
    sine = np.sqrt(max(1.0 - cosine * cosine, 0.0)) if cosine > 0.0 else 1.0
    slow = min(top, np.sqrt(push * distance / max(2.0 * sine, 1e-6)))
    for axis in range(len(away)):
        wanted[axis] = away[axis] * slow / distance


@kernel
def time_to_stop(distance: float, change: float, push: float, top: float) -> float:
    """An estimate [s] of how long a robot needs to stop after `distance`, if its velocity is off by `change` [m/s] now.

    Exact on a line for a robot that is not faster than its distance allows; what turning the velocity costs is
    change^2 / (2 push top).
    """
    if distance >= top * top / (2.0 * push):
        return float(distance / top + 0.5 * top / push + change * change / (2.0 * push * top))
    return float(np.sqrt(2.0 * distance / push) + change / push)


@kernel
def time_to_go(
    away: Array, velocity: Array, push: float, top: float, tolerance: float, stop: bool, wanted: Array
) -> float:
    """An estimate [s] of how long a robot needs to the goal at `away`, alone in the world. `wanted`: room."""
    if not stop:
        return earliest_arrival(away, velocity, push, top, 0.5 * tolerance)
    square, change = 0.0, 0.0
    stopping_velocity(away, push, top, wanted)
    for axis in range(len(away)):
        square += away[axis] * away[axis]
        change += (wanted[axis] - velocity[axis]) ** 2
    return time_to_stop(max(0.0, np.sqrt(square) - tolerance), np.sqrt(change), push, top)
