"""Compiled functions on plain arrays and floats; no slalom types.

Importing this package does not import numba: the first use of a kernel does. `slalom --help` stays quick.
"""

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slalom.kernels.again import in_balls, kept_radii, pieces_within, segments_of
    from slalom.kernels.ahead import explore, stays_free
    from slalom.kernels.arrival import earliest_arrival
    from slalom.kernels.clearance import contact_times, least_clearances
    from slalom.kernels.compiled import threads
    from slalom.kernels.crew import decide_all, look_around
    from slalom.kernels.exchange import nearest_free
    from slalom.kernels.grazing import grazing_discs
    from slalom.kernels.hulls import distances
    from slalom.kernels.many import choose_many
    from slalom.kernels.meeting import find_corners, head_for, longer_ways, pass_right
    from slalom.kernels.now import distances_now
    from slalom.kernels.rounds import round_of
    from slalom.kernels.wish import passing_velocity, stopping_velocity, time_to_stop
    from slalom.kernels.yielding import give_way

__all__ = [
    "choose_many",
    "compiling",
    "contact_times",
    "decide_all",
    "distances",
    "distances_now",
    "earliest_arrival",
    "explore",
    "find_corners",
    "give_way",
    "grazing_discs",
    "head_for",
    "in_balls",
    "kept_radii",
    "least_clearances",
    "longer_ways",
    "look_around",
    "nearest_free",
    "pass_right",
    "passing_velocity",
    "pieces_within",
    "round_of",
    "segments_of",
    "stays_free",
    "stopping_velocity",
    "threads",
    "time_to_stop",
    "when_compiling",
]


def compiling(kept: bool) -> str:
    """What to tell whoever waits while kernels compile; `kept`: in a cache on disk."""
    if kept:
        return "slalom: compiling, once after an installation: some seconds, for a fleet up to a minute"
    return "slalom: compiling, in every process, for want of a folder that can be written: NUMBA_CACHE_DIR names one"


def _log(kept: bool) -> None:
    logging.getLogger("slalom").warning(compiling(kept))


when_compiling: list[Callable[[bool], None]] = [_log]
"""What is called, once each, when the first kernel has to be compiled because no cache holds it: with whether what is
compiled will be kept. At first the logger "slalom" warns."""

_MODULES = {
    "choose_many": "many",
    "contact_times": "clearance",
    "decide_all": "crew",
    "distances": "hulls",
    "distances_now": "now",
    "earliest_arrival": "arrival",
    "explore": "ahead",
    "find_corners": "meeting",
    "give_way": "yielding",
    "grazing_discs": "grazing",
    "head_for": "meeting",
    "pass_right": "meeting",
    "in_balls": "again",
    "kept_radii": "again",
    "least_clearances": "clearance",
    "longer_ways": "meeting",
    "look_around": "crew",
    "nearest_free": "exchange",
    "passing_velocity": "wish",
    "pieces_within": "again",
    "round_of": "rounds",
    "segments_of": "again",
    "stays_free": "ahead",
    "stopping_velocity": "wish",
    "threads": "compiled",
    "time_to_stop": "wish",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    return found
