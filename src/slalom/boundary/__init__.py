"""Boundary of control obstacles in the plane: envelopes of elements, outlines of hulls, and the faces between them."""

from slalom.boundary.envelope import grazing_curves
from slalom.boundary.faces import boundary

__all__ = ["boundary", "grazing_curves"]
