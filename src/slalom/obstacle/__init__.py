"""Obstacles: a shape on a trajectory; many of them as tables and tracks; all of them over the window of a decision."""

from slalom.obstacle.obstacle import Headings, Obstacle

__all__ = ["Headings", "Obstacle"]
