"""The motion of a vehicle at the time at which a decision acts, from a measured pose and from what was predicted."""

from math import hypot
from typing import Final

import numpy as np

from slalom import kernels
from slalom.base.checks import Array
from slalom.base.tolerances import TIME
from slalom.vehicle.vehicle import Vehicle

CORRECTION_TIMES: Final = np.array([0.4, 0.4, 0.4, 1.2, 1.2])
"""[s] Times in which differences of measured motions from the predicted ones are corrected, by 63 %.

Of x, y, heading, speed and turn, each in addition to the lag. Longer: the vehicle notices slip later. Shorter: noise of
measurements becomes turns of the vehicle, which a lag amplifies.
"""

CORRECTED_WITHIN: Final = (0.05, 0.08, 0.2, 0.5)
"""[m, rad, m/s, rad/s] Differences from the prediction beyond which the measured pose is taken as it is.

Larger: a push is noticed later. Smaller: rare large errors of measurements count in full.
"""

PERSISTS: Final = 1e-9
"""[1] A time that is a whole number of periods up to this share of one counts as that number."""


def motion_at(track: Array, now: float) -> Array:
    """The motion (5,) at `now` [s] of a track (m, 6); before its begin and after its end the first and the last one."""
    return np.array([np.interp(now, track[:, 0], track[:, k]) for k in range(1, 6)])


def estimated(vehicle: Vehicle, motion: Array, measured: float, acts: float, track: Array | None, kept: float) -> Array:
    """The track (m, 6), time [s] and motion, of a vehicle up to the time `acts` [s].

    A predicted track is corrected by a share of the difference of the measured motion from it, and by all of it where
    that is large. Without one the vehicle keeps its speed and turn.

    Args:
        motion: (5,) that was `measured` [s]. track: as it was predicted; None: not at all. kept: [s] of it before.
    """
    if track is None:
        return _kept_on(vehicle, motion, measured, acts)
    predicted = motion_at(track, measured)
    off = motion - predicted
    off[2] = (off[2] + np.pi) % (2.0 * np.pi) - np.pi
    sizes = np.array([hypot(off[0], off[1]), *np.abs(off[2:])])
    if np.all(sizes <= CORRECTED_WITHIN):
        off *= 1.0 - np.exp(-vehicle.period / (CORRECTION_TIMES + max(vehicle.lags)))
    between = track[(track[:, 0] > measured + TIME) & (track[:, 0] < acts - TIME)]
    times = np.array([measured, *between[:, 0], *([acts] if acts > measured else [])])
    rows = np.column_stack([times, np.array([motion_at(track, t) for t in times.tolist()])])
    c, s = np.cos(off[2]), np.sin(off[2])
    rows[:, 1:3] = predicted[:2] + off[:2] + (rows[:, 1:3] - predicted[:2]) @ np.array([[c, s], [-s, c]])
    rows[:, 3:] += off[2:]
    return np.concatenate([track[(track[:, 0] < measured - TIME) & (track[:, 0] > acts - kept)], rows])


def _kept_on(vehicle: Vehicle, motion: Array, measured: float, acts: float) -> Array:
    """The track (m, 6) of a vehicle that keeps its speed and turn."""
    motion, now, rows = motion.copy(), measured, [[measured, *motion]]
    while now < acts - PERSISTS * vehicle.period:
        share = min(1.0, (acts - now) / vehicle.period)
        kernels.drive(vehicle.wheels, motion, motion[3], motion[4], 0.0, share, motion)
        now += share * vehicle.period
        rows.append([now, *motion])
    return np.array(rows)
