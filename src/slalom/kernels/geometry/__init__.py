"""Shapes in arrays: cubics, convex hulls, boundaries of controls, polygons, envelopes."""
