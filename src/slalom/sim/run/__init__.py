"""The loop over time and what it consists of: sensing, guidance, decisions, messages."""
