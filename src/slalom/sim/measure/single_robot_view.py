"""Recording of one robot of a run, with the other robots as obstacles."""

from dataclasses import replace

from slalom.sim.measure.closest_approach import robot_as_obstacle
from slalom.sim.measure.recording import Recording, Which


def single_robot_view(recording: Recording, robot: Which = None) -> Recording:
    """Return the recording of one robot, with the other robots as obstacles on their recorded paths.

    Raises:
        InvalidInput: see `Recording.row`.
    """
    k, n = recording.row(robot), len(recording.shapes)
    others = [robot_as_obstacle(recording, j) for j in range(n) if j != k and len(recording.accelerations)]
    return replace(recording.only(k), obstacles=(*recording.obstacles, *others))
