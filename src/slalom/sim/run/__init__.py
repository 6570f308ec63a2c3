"""The loop over time and its parts: sensing, guidance, decisions."""
