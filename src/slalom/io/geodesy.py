"""Projection of latitude, longitude and altitude to metres in a plane or in space."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array

# Latitude and longitude projected to metres east, north and up.
#
# With WGS 84, a = 6378137 m, f = 1 / 298.257223563, e^2 = f (2 - f), the geocentric position of latitude p, longitude
# l and height h is
#
#     N = a / sqrt(1 - e^2 sin^2 p)
#     X = (N + h) cos p cos l,  Y = (N + h) cos p sin l,  Z = (N (1 - e^2) + h) sin p
#
# and, with the differences D from the geocentric position of the origin (p0, l0, h0),
#
#     east  = -sin l0 DX + cos l0 DY
#     north = -sin p0 (cos l0 DX + sin l0 DY) + cos p0 DZ
#     up    =  cos p0 (cos l0 DX + sin l0 DY) + sin p0 DZ
#
# (NIMA TR8350.2, 3rd edition). Distances in space are preserved. Take a point on the ground at distance d from the
# origin. In the plane it is closer by about (d / R)^2 / 6 of d (4 mm at 10 km). It lies d^2 / 2R below the plane (7.8
# m at 10 km).


AXIS: Final = 6378137.0
ECCENTRICITY_SQUARED: Final = (2.0 - 1.0 / 298.257223563) / 298.257223563


def project(
    latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike, origin: Sequence[float]
) -> Array:
    """Project latitude and longitude [degree] and altitude [m] to east, north and up (..., 3) [m].

    Args:
        origin: latitude, longitude [degree] and, 0 by default, altitude [m].
    """
    lat0, lon0, h0 = (*origin, 0.0)[:3]
    east, north = np.radians(lon0), np.radians(lat0)
    dx, dy, dz = np.moveaxis(_geocentric(latitude, longitude, altitude) - _geocentric(lat0, lon0, h0), -1, 0)
    horizontal = np.cos(east) * dx + np.sin(east) * dy
    return np.stack(
        [
            np.cos(east) * dy - np.sin(east) * dx,
            np.cos(north) * dz - np.sin(north) * horizontal,
            np.cos(north) * horizontal + np.sin(north) * dz,
        ],
        axis=-1,
    )


def _geocentric(latitude: npt.ArrayLike, longitude: npt.ArrayLike, altitude: npt.ArrayLike) -> Array:
    """Return geocentric X, Y, Z (..., 3) [m] of latitude and longitude [degree] and altitude [m]."""
    p = np.radians(latitude)
    q = np.radians(longitude)
    h = np.asarray(altitude, dtype=np.float64)
    normal = AXIS / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(p) ** 2)
    horizontal = (normal + h) * np.cos(p)
    return np.stack(
        [horizontal * np.cos(q), horizontal * np.sin(q), (normal * (1.0 - ECCENTRICITY_SQUARED) + h) * np.sin(p)],
        axis=-1,
    )
