"""The exact choice: elements, candidates, exchange."""
