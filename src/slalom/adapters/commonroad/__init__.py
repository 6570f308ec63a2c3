"""CommonRoad: planning problems solved among recorded traffic, and their solution files.

`solve` needs commonroad-io. The car moves as a point mass, or by the kinematic single-track model. Borders of the road
are walls. Recorded vehicles are rectangles with their recorded orientation, and their future is known (`nao`). The
target moves on the cubic that leaves the initial state and meets the goal at the middle of its time, with its speed and
orientation.
"""

from typing import Any, Final

from slalom.adapters.commonroad.point_mass import drive_point_mass
from slalom.adapters.commonroad.scene import Motion, in_goal
from slalom.adapters.commonroad.single_track import drive_single_track
from slalom.adapters.commonroad.solution import solution, write
from slalom.base.checks import known

__all__ = ["MODELS", "Motion", "in_goal", "solution", "solve", "write"]

MODELS: Final = {"PM": drive_point_mass, "KS": drive_single_track}
"""Models of the car by their names in CommonRoad."""


def solve(
    scenario: Any, problem: Any, model: str = "PM", *, max_acceleration: float = 8.0, margin: float = 0.3
) -> Motion:
    """Motion of a car from the initial state of a planning problem to its goal, decided by `nao` at each time step.

    Raises:
        InvalidInput: a goal without a position; obstacles that are neither rectangles, discs nor polygons; a model that
            is not in MODELS; a largest acceleration [m/s^2] or a margin [m] that no navigator accepts.
    """
    return MODELS[known(model, "model", tuple(MODELS))](scenario, problem, max_acceleration, margin)
