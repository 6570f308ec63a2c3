"""Recording of one robot of a run, with the other robots as obstacles."""

from dataclasses import replace

from slalom.sim.measure.closest_approach import robot_as_obstacle
from slalom.sim.measure.recording import Recording


def single_robot_view(recording: Recording, robot: int) -> Recording:
    """Return the recording of one robot, with the other robots as obstacles on their recorded paths."""
    steps, rows = len(recording.accelerations), slice(robot, robot + 1)
    others = [robot_as_obstacle(recording, k) for k in range(len(recording.shapes)) if k != robot and steps]
    return replace(
        recording,
        positions=recording.positions[:, rows],
        velocities=recording.velocities[:, rows],
        accelerations=recording.accelerations[:, rows],
        controls=recording.controls[:, rows],
        responses=tuple(row[rows] for row in recording.responses),
        outcomes=tuple(row[rows] for row in recording.outcomes),
        decision_times=recording.decision_times[:, rows],
        shapes=recording.shapes[rows],
        limits=recording.limits[rows],
        goals=recording.goals[rows],
        arrived=recording.arrived[rows],
        obstacles=(*recording.obstacles, *others),
    )
