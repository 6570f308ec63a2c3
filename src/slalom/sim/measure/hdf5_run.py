"""The HDF5 file of a run, as it is written; `Recording.load` reads it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import h5py
import numpy as np

from slalom.bounds import BOUNDS
from slalom.obstacle import Headings
from slalom.path_goal import PathGoal
from slalom.sim.measure.hdf5_parts import HALF_SPACES, save_part, save_shape, save_trajectory
from slalom.sim.measure.hdf5_units import add_units
from slalom.uncertainty import UNCERTAINTIES

if TYPE_CHECKING:
    from slalom.sim.measure.recording import Recording

FORMAT: Final = "slalom recording 2"
"""Name of the written format."""
READABLE_FORMATS: Final = ("slalom recording 1", FORMAT)
"""Names of the formats that are read."""


def save_run(recording: "Recording", path: Path | str) -> None:
    """Write a run, see `Recording.save`."""
    with h5py.File(path, "w") as file:
        file.attrs["format"] = FORMAT
        run = file.create_group("run_0")
        run.attrs.update(
            scenario=recording.scenario,
            method=recording.method,
            seed=recording.seed,
            time_step=recording.dt,
            steps=len(recording.accelerations),
            final_sim_time=float(recording.times[-1]),
            digest=recording.digest(),
            foresight=recording.foresight,
        )
        if recording.period is not None:
            run.attrs["period"] = recording.period
        run.create_group("parameters").attrs.update(recording.parameters)
        run.create_group("settings").attrs.update(recording.settings)
        run["holds"] = np.array(recording.holds)
        heading = np.arctan2(recording.velocities[..., 1], recording.velocities[..., 0])[..., None]
        run["times"] = recording.times
        run["poses"] = np.concatenate([recording.positions, heading], axis=-1)
        run["twists"] = np.concatenate([recording.velocities, np.zeros_like(heading)], axis=-1)
        for name in ("accelerations", "controls", "decision_times", "arrived"):
            run[name] = getattr(recording, name)
        for name in ("responses", "outcomes"):
            texts = np.array(getattr(recording, name), dtype=h5py.string_dtype())
            run[name] = texts.reshape(recording.decision_times.shape)
        _save_parts(run, recording)
        add_units(run)


def _save_parts(run: Any, recording: "Recording") -> None:
    """Write the robots with their shapes, limits and goals, and the obstacles."""
    span = float(recording.times[0]), float(recording.times[-1])
    for k, (shape, limits, goal) in enumerate(zip(recording.shapes, recording.limits, recording.goals)):
        group = run.create_group(f"robots/{k}")
        save_shape(group.create_group("shape"), shape)
        group.attrs["name"] = recording.names[k]
        group.attrs.update(max_speed=limits.max_speed, max_acceleration=limits.max_acceleration)
        for name in HALF_SPACES:
            bounds = getattr(limits, name)
            rows = np.array([(*bound.normal, bound.offset) for bound in bounds])
            group[name] = rows.reshape(-1, recording.dimension + 1)
        for j, bound in enumerate(limits.bounds):
            save_part(group.create_group(f"bounds/{j}"), bound, BOUNDS)
        group.attrs.update(goal_tolerance=goal.tolerance, goal_stop=goal.stop)
        save_trajectory(group.create_group("goal"), goal.trajectory, *span)
        if isinstance(goal, PathGoal):
            path = group.create_group("goal_path")
            path["points"], path.attrs["lookahead"] = goal.points, goal.lookahead
            if goal.speeds is not None:
                path["speeds"] = goal.speeds
    for k, obstacle in enumerate(recording.obstacles):
        group = run.create_group(f"obstacles/{k}")
        group.attrs.update(name=obstacle.name, contact_at_rest=obstacle.contact_at_rest)
        if isinstance(obstacle.heading, Headings):
            headings = group.create_group("headings")
            headings["times"], headings["angles"] = obstacle.heading.times, obstacle.heading.angles
        else:
            group.attrs["heading"] = obstacle.heading
        save_shape(group.create_group("shape"), obstacle.shape)
        if obstacle.uncertainty is not None:
            save_part(group.create_group("uncertainty"), obstacle.uncertainty, UNCERTAINTIES)
        save_trajectory(group.create_group("trajectory"), obstacle.trajectory, *span)
