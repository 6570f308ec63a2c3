"""Obstacles relative to a controlled robot: segments, the broad phase, clearance, time to collision."""
