"""Obstacles from measurements: tracks, limited sight, reciprocity, and radii of prediction errors."""
