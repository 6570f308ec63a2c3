"""The numbers of a vehicle on wheels. Importing them does not import numba."""

from typing import Final, NamedTuple

REST_WAY: Final = 1e-9
"""[m] A part of a motion in which no point of a body moves farther than this is at rest. Rounding is far smaller."""

CREEPING: Final = 1e-3
"""[m/s] A bicycle that is to be slower than this keeps its steering angle.

Larger: it leaves the place where it stops with the wrong course. Much smaller: rounding of the velocity steers.
"""


class Wheels(NamedTuple):
    """The numbers of a vehicle."""

    steered: bool  # a bicycle; otherwise a differential drive
    period: float  # [s]
    lever: float  # [m] of the point ahead of the axle
    base: float  # [m] the wheelbase of a bicycle, the track of a drive
    max_speed: float  # [m/s] of a bicycle forwards, of each wheel of a drive in both directions
    max_reverse: float  # [m/s] of a bicycle backwards
    max_acceleration: float  # [m/s^2] of a bicycle, of each wheel of a drive
    max_turn: float  # [rad] steering angle, [rad/s] turn rate of a drive
    max_turn_change: float  # [rad/s] steering rate, [rad/s^2] angular acceleration of a drive
    lag: float  # [s] of the speed of a bicycle, of the wheels of a drive
    turn_lag: float  # [s] of the steering; that of the wheels for a drive
