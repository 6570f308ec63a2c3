"""The modules of slalom.sim.measure that are public."""

from . import metrics as metrics
