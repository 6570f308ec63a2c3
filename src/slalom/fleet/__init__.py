"""Robots that decide together in a loop that belongs to the caller."""
