"""What is said when kernels have to be compiled."""

import logging
from collections.abc import Callable


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
