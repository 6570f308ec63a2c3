"""Model of robots and obstacles: states, paths, shapes, limits, goals, trajectories and responses."""
