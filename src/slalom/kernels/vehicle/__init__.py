"""Motions of vehicles on wheels, and the clearance of their bodies."""
