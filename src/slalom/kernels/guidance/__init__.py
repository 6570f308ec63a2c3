"""Targets for robots that share the plane; no part in safety."""
