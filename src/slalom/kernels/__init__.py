"""Compiled functions on plain arrays and floats; no slalom types.

Importing this package does not import numba: the first use of a kernel does. `slalom --help` stays quick.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slalom.kernels.arrival import earliest_arrival
    from slalom.kernels.clearance import contact_times, least_clearances
    from slalom.kernels.exchange import nearest_free
    from slalom.kernels.hulls import distances
    from slalom.kernels.segments import relative_segments

__all__ = ["contact_times", "distances", "earliest_arrival", "least_clearances", "nearest_free", "relative_segments"]

_MODULES = {
    "contact_times": "clearance",
    "distances": "hulls",
    "earliest_arrival": "arrival",
    "least_clearances": "clearance",
    "nearest_free": "exchange",
    "relative_segments": "segments",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
