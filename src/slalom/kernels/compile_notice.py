"""The notice that kernels have to be compiled."""

import logging
from collections.abc import Callable


def compiling(kept: bool) -> str:
    """The sentence for the user while kernels compile; `kept`: whether the result is cached on disk."""
    if kept:
        return "slalom: compiling, once after an installation: up to a minute (`slalom compile` does it beforehand)"
    return "slalom: compiling, in every process, since no cache folder can be written: NUMBA_CACHE_DIR names one"


def _log(kept: bool) -> None:
    logging.getLogger("slalom").warning(compiling(kept))


when_compiling: list[Callable[[bool], None]] = [_log]
"""Functions that are called once each when the first kernel is compiled, with whether the result is cached on disk. By
default the logger "slalom" warns."""
