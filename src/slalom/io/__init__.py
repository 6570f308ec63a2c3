"""Files of recorded motion in and out."""
