"""Forecasts: predictions of obstacles from their state, and from models of their motion."""
