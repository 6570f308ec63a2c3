"""Base of all layers: errors, checks of input, registries of parts, and constants that several packages share."""
