"""The gallery's scenarios as parameters of tests."""

from functools import cache
from importlib.util import find_spec

import pytest

from slalom import METHODS, InvalidInput
from slalom.peers import contender
from slalom.sim import Recording, simulate
from slalom.sim.gallery import GALLERY, build

WITH_PYRVO = pytest.mark.skipif(find_spec("pyrvo") is None, reason="pyrvo, which moves the people, is not installed")
NAMES = [pytest.param(name, marks=WITH_PYRVO) if name == "crowdnav" else name for name in GALLERY]
FLEETS = [name for name, entry in GALLERY.items() if "robots" in entry.parameters]
"""Scenarios of several robots."""


def installed(name: str) -> None:
    """Skip the test without the package of a peer."""
    try:
        contender(name)
    except InvalidInput:
        pytest.skip("its package is not installed")


@cache
def gallery_run(name: str, method: str, seed: int = 0) -> Recording:
    """A run of a scenario as it is in the gallery, made once for all tests of a process that only read it."""
    return simulate(build(name, seed=seed), METHODS[method], seed=seed)


def nudged(name: str) -> dict[str, float]:
    """Every parameter of a scenario a little larger: counts by one, and what is no whole number by 0.01."""
    return {k: v + (1.0 if v.is_integer() else 0.01) for k, v in GALLERY[name].parameters.items()}
