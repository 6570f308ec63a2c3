"""The search over sequences of accelerations."""
