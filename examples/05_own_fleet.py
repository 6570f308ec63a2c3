"""Many robots in an existing simulator, which may be driven by accelerations, velocities or positions."""

import numpy as np

import slalom

COUNT, DT = 8, 0.1
angles = 2.0 * np.pi * (np.arange(COUNT) + 0.03 * np.sin(np.arange(COUNT))) / COUNT
starts = 6.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
pillar = slalom.Obstacle(slalom.Disc(0.8), slalom.Stationary((0.0, 0.0)), "pillar")

for driven_by in ("accelerations", "velocities", "positions"):
    fleet = slalom.Fleet(
        slalom.method("nao"), slalom.Disc(0.3), slalom.Limits(1.5, 2.0), robots=COUNT, obstacles=[pillar], period=DT
    )
    positions, velocities, step = starts.copy(), np.zeros_like(starts), 0
    while step < 400 and np.linalg.norm(positions + starts, axis=1).max() > 0.3:
        decided = fleet.step(step * DT, positions, velocities, targets=-starts)
        # The rest is the step of your simulator.
        if driven_by == "accelerations":
            positions = positions + DT * velocities + 0.5 * DT * DT * decided.accelerations
            velocities = velocities + DT * decided.accelerations
        elif driven_by == "velocities":
            # The command is held: the robot moves by the mean of the old and the new velocity.
            positions = positions + 0.5 * DT * (velocities + decided.velocities)
            velocities = decided.velocities
        else:
            positions, velocities = decided.positions, decided.velocities
        step += 1
    print(f"driven by {driven_by}: all of {COUNT} robots at their targets after {step * DT:.1f} s")
