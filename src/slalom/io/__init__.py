"""Read and write files of recorded motion."""
