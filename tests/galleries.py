"""The gallery's scenarios as parameters of tests."""

from importlib.util import find_spec

import pytest

from slalom.sim.gallery import GALLERY

WITH_PYRVO = pytest.mark.skipif(find_spec("pyrvo") is None, reason="pyrvo, which moves the people, is not installed")
NAMES = [pytest.param(name, marks=WITH_PYRVO) if name == "crowdnav" else name for name in GALLERY]
FLEETS = [name for name, entry in GALLERY.items() if "robots" in entry.parameters]
"""Scenarios of several robots."""


def nudged(name: str) -> dict[str, float]:
    """Every parameter of a scenario a little larger: counts by one, and what is no whole number by 0.01."""
    return {k: v + (1.0 if v.is_integer() else 0.01) for k, v in GALLERY[name].parameters.items()}
