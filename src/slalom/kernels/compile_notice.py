"""The notice that kernels have to be compiled."""

import logging
from collections.abc import Callable


def compiling(kept: bool, why: str = "") -> str:
    """The sentence for the user while kernels compile; `kept`: whether the result is kept on disk.

    `why`: why no compiled entry is used, if there are some.
    """
    text = "slalom: compiling, in every process, since no cache folder can be written: NUMBA_CACHE_DIR names one"
    if kept:
        text = (
            "slalom: compiling, once after an installation: up to a minute (`slalom compile` does it beforehand; "
            "a wheel with compiled kernels needs none, nor does `slalom compile --import FOLDER`)"
        )
    return f"{text}; {why}" if why else text


def _log(text: str) -> None:
    logging.getLogger("slalom").warning(text)


when_compiling: list[Callable[[str], None]] = [_log]
"""Functions that are called once each when the first kernel is compiled, with the sentence for the user. By default the
logger "slalom" warns."""
while_compiling: list[Callable[[int], None]] = []
"""Functions that are called with the number of functions that this process has compiled, after each of them, and with 0
when a kernel is complete. The first decision compiles about 300."""
