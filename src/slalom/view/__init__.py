"""Figures of decisions and runs: the workspace, the control space, both side by side, and videos.

All figures are `matplotlib.figure.Figure` objects, never pyplot figures: no window opens, no global state changes.
"""

from slalom.base.errors import Extra

with Extra("view", __name__):
    from slalom.view.control_space import control_space
    from slalom.view.figure import decision, paths, study
    from slalom.view.film import animate
    from slalom.view.fleet import fleet
    from slalom.view.sets import sets
    from slalom.view.style import resized, save
    from slalom.view.workspace import workspace

__all__ = ["animate", "control_space", "decision", "fleet", "paths", "resized", "save", "sets", "study", "workspace"]
