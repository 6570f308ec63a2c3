"""The run of one robot of several, with the others as obstacles."""

from dataclasses import replace

from slalom.sim.measure.closest_approach import driven
from slalom.sim.measure.recording import Recording


def single_robot_view(recording: Recording, robot: int) -> Recording:
    """The recording of one robot, in which the others are obstacles on the paths that they drove."""
    steps, one = len(recording.accelerations), slice(robot, robot + 1)
    others = [driven(recording, k) for k in range(len(recording.shapes)) if k != robot and steps]
    return replace(
        recording,
        positions=recording.positions[:, one],
        velocities=recording.velocities[:, one],
        accelerations=recording.accelerations[:, one],
        controls=recording.controls[:, one],
        responses=tuple(row[one] for row in recording.responses),
        outcomes=tuple(row[one] for row in recording.outcomes),
        decision_times=recording.decision_times[:, one],
        shapes=recording.shapes[one],
        limits=recording.limits[one],
        goals=recording.goals[one],
        arrived=recording.arrived[one],
        obstacles=(*recording.obstacles, *others),
    )
