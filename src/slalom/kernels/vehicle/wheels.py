"""The numbers of a vehicle on wheels and of its body. Importing them does not import numba."""

from typing import Final, NamedTuple

from slalom.kernels.arrays import Array

REST_WAY: Final = 1e-9
"""[m] A part of a motion in which no point of a body moves farther than this is at rest. Rounding is far smaller."""

CREEPING: Final = 1e-3
"""[m/s] A bicycle that is to be slower than this keeps its steering angle. Larger: it leaves the place where it stops
with the wrong course. Much smaller: rounding of the velocity steers."""


class Wheels(NamedTuple):
    """The numbers of a vehicle."""

    steered: bool  # a bicycle; otherwise a differential drive
    period: float  # [s]
    lever: float  # [m] of the point ahead of the axle
    base: float  # [m] the wheelbase of a bicycle, the track of a drive
    max_speed: float  # [m/s] of a bicycle forwards, of each wheel of a drive in both directions
    max_reverse: float  # [m/s] commanded to the middle of the axle backwards
    max_axle: float  # [m/s] commanded to the middle of the axle forwards
    max_acceleration: float  # [m/s^2] of a bicycle, of each wheel of a drive
    max_turn: float  # [rad] steering angle, [rad/s] turn rate of a drive
    max_turn_change: float  # [rad/s] steering rate, [rad/s^2] angular acceleration of a drive
    lag: float  # [s] of the speed of a bicycle, of the wheels of a drive
    turn_lag: float  # [s] of the steering; that of the wheels for a drive
    min_speed: float  # [m/s] the least one that is executed, besides 0
    min_turn: float  # [rad/s] of a drive; 0 for a bicycle


class Hull(NamedTuple):
    """The body of a vehicle, and how its contacts are sought on a motion."""

    corners: Array  # (c, 2) [m] relative to the middle of the axle
    rounded: float  # [m] radius of the disc about the middle of the axle that contains the rounded body
    parts: int  # cubic pieces of the motion in a period
    keep: Array  # (b,) [m] clearance from each body, with the rounding; below 0 the depth to which it may overlap
    advance: float  # [m] least way between two tests: a body may come nearer by up to half of it in between
    cap: float  # [s] a contact later than this need not be found
