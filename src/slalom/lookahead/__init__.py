"""Decisions by a search over sequences of accelerations."""
