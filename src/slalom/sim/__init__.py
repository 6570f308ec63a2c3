"""Scenarios, the loop over time, recordings, metrics and studies."""

import lazy_loader

from slalom.base.errors import require

require("sim", __name__)

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
