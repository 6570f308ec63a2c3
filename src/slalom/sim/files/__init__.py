"""Scenario files, study files, recorded traffic in scenarios."""
