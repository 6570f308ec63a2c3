"""Files of recorded motion in."""
