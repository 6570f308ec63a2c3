"""`slalom run` and `slalom decide`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Settings,
    answer,
    complain,
    drawable,
    parse_settings,
    progress,
    writable,
    writing,
)
from slalom.cli.recorded import Crossing, Reading, is_recording, scenario_of
from slalom.cli.report import run_text, shown
from slalom.errors import InvalidInput

if TYPE_CHECKING:
    from slalom.sim import Recording, Scenario

METHOD, OF_RECORDINGS = "nao", "nao_ahead"
"""The methods if nothing else is said; that of recordings waits for gaps, which one acceleration does not."""


def run(
    scenario: str,
    /,
    *,
    settings: Settings = None,
    method: str | None = None,
    foresight: str | None = None,
    seed: int = 0,
    out: Path | None = None,
    figure: Path | None = None,
    figure_at: float | None = None,
    at: float | None = None,
    crossing: Crossing | None = None,
    reading: Reading | None = None,
    json: Flag = False,
) -> int:
    """Run a scenario, or a robot in a recording, and say how it went; exit code 1 if it collided or did not arrive.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, a .yaml file, or a recording of a format from `slalom list formats`.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT; by default nao. In a recording by default nao_ahead,
        which also waits for gaps: it looks ahead over several accelerations, where nao chooses one.
    foresight
        What the method knows of obstacles: recorded, present, observed, observed_velocity or observed_turn (see
        `slalom list foresights`); the same as NAME@FORESIGHT. By default that of the method.
    seed
        What random scenarios are drawn with.
    out
        Write the run to this file: .h5 with all that a replay needs, or only the tracks as .csv, .ndjson
        (TrajNet++) or .sqlite (JuPedSim), whose frames count from the begin of the run.
    figure
        Draw a decision of the run to this .svg, .pdf or .png file.
    figure_at
        Time [s] after the start of the decision that is drawn; by default a tight one.
    at
        In a recording: when the robot starts [s], in the time of the recording; by default its first. Otherwise the
        same as --figure-at.
    json
        Print one JSON object.
    """
    recorded = is_recording(scenario, reading, crossing)
    name = _method_name(method or (OF_RECORDINGS if recorded else METHOD), foresight)
    drawn = figure_at if recorded else _one_of(at, figure_at)
    drawable(figure)
    writable(out)
    changed = parse_settings(settings)
    if recorded:
        loaded = _changed(scenario_of(scenario, reading, crossing, at), changed)
    else:
        from slalom.sim import load

        loaded = load(scenario, changed, seed=seed)
    return _run(loaded, name, seed, out, figure, drawn, json)


def _run(
    loaded: "Scenario", name: str, seed: int, out: Path | None, figure: Path | None, drawn: float | None, json: bool
) -> int:
    """Run what was loaded with the method of that name, and write, draw and say how it went."""
    from slalom.peers import contender
    from slalom.sim import simulate
    from slalom.sim.files.recorded_traffic import ends_before
    from slalom.sim.measure.metrics import summary

    chosen = contender(name)
    _format(out, loaded.dimension)
    _say(loaded.notes)
    with progress("running") as advance:
        recording = simulate(loaded, chosen, seed=seed, progress=advance)
    result = summary(recording)
    _say(ends_before(loaded, float(recording.times[-1])))
    if out is not None:
        _write(recording, out)
    if figure is not None:
        _draw(recording, loaded, name, drawn, figure)
    answer(result, json, lambda: run_text(recording, result))
    return DONE if result["arrived"] == result["robots"] and not result["collisions"] else FAILED


def decide(
    scene: str,
    /,
    *,
    method: str = METHOD,
    foresight: str | None = None,
    json: Flag = False,
    figure: Path | None = None,
) -> int:
    """One decision at the beginning of a scenario; exit code 1 if no manoeuvre is safe.

    Parameters
    ----------
    scene
        A .yaml scenario file, or a name from `slalom list scenarios`.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT.
    foresight
        What the method knows of obstacles, as in `slalom run`.
    json
        Print one JSON object.
    figure
        Draw the decision to this .svg, .pdf or .png file.
    """
    import numpy as np

    from slalom.control_obstacle import ControlObstacle
    from slalom.methods import method as method_of
    from slalom.sim import load
    from slalom.sim.measure.metrics import finite

    chosen, loaded = method_of(_method_name(method, foresight)), load(scene)
    drawable(figure)
    _say(loaded.notes)
    navigator, robot = loaded.navigator(chosen), loaded.robot
    around = loaded.around(robot.state, loaded.start, chosen)
    decision = loaded.decider(chosen).decide(robot.state, around, robot.goal, now=loaded.start)
    manoeuvre, blocked = decision.manoeuvre, decision.blocked
    bare = ControlObstacle(manoeuvre.response, robot.state, blocked.obstacles, robot.shape)
    result = {
        "scenario": loaded.name,
        "method": chosen.name,
        "foresight": chosen.foresight,
        "response": repr(manoeuvre.response),
        "control": [float(x) for x in manoeuvre.control],
        "acceleration": [float(x) for x in manoeuvre.mean_acceleration(loaded.start, navigator.period)],
        "status": decision.outcome.name,
        "sentence": decision.outcome.value,
        "clearance": finite(float(bare.clearance(np.array(manoeuvre.control)))),
        "preferred": [float(x) for x in decision.preferred],
        "time_to_collision": finite(float(bare.time_to_collision(decision.preferred))),
    }
    if figure is not None:
        from slalom import view

        with writing(figure):
            view.save(view.decision(decision, navigator, robot.goal, title=loaded.name), figure)
    answer(result, json, lambda: "\n".join(f"{k:18} {shown(v)}" for k, v in result.items()))
    return DONE if decision.outcome.safe else FAILED


def _method_name(method: str, foresight: str | None) -> str:
    """NAME@FORESIGHT of both. Raises InvalidInput if the method has one already that is another."""
    plain, at, own = method.partition("@")
    if foresight is None or (at and own == foresight):
        return method
    if at:
        raise InvalidInput(f"--foresight: expected none with {method}, or {own}; found {foresight!r}")
    return f"{plain}@{foresight}"


def _one_of(at: float | None, figure_at: float | None) -> float | None:
    """The time of the decision that is drawn. Raises InvalidInput for two."""
    if at is not None and figure_at is not None:
        raise InvalidInput(f"--at: expected it once, as --figure-at or as --at, found {at:g} and {figure_at:g}")
    return figure_at if at is None else at


def _changed(loaded: "Scenario", settings: dict[str, float]) -> "Scenario":
    """With other settings. Raises InvalidInput for those that a robot in a recording has options for."""
    for name, option in (("start", "--at"), ("duration", "--duration")):
        if name in settings:
            raise InvalidInput(f"--set {name}: expected {option} with a recording, found {settings[name]:g}")
    return loaded.with_settings(settings)


def _say(notes: Sequence[str]) -> None:
    for note in notes:
        complain(note)


def _format(out: Path | None, dimension: int) -> str:
    """The format that a run is written in, "" for HDF5. Raises InvalidInput for one that cannot hold it."""
    from slalom.io.formats import WRITTEN, settings_to_write

    if out is None:
        return ""
    formats = {".h5": "", ".hdf5": "", **WRITTEN}
    if out.suffix not in formats:
        raise InvalidInput(f"--out: expected a file that ends in {', '.join(formats)}; found {str(out)!r}")
    name = formats[out.suffix]
    if dimension == 3 and name and settings_to_write(name):
        raise InvalidInput(f"--out: expected .h5 or .csv for a run in space, found {str(out)!r}")
    return name


def _draw(recording: "Recording", loaded: "Scenario", method: str, at: float | None, figure: Path) -> None:
    from slalom import view
    from slalom.view.replay import replay

    with writing(figure):
        view.save(replay(recording, loaded, method, at), figure)


def _write(recording: "Recording", out: Path) -> None:
    """The run as a file, and what was left out of it or renamed on stderr."""
    name = _format(out, recording.dimension)
    if not name:
        with writing(out):
            recording.save(out)
        return
    from slalom.io.formats import settings_to_write, write_recording
    from slalom.sim.measure.export_tracks import as_tracks

    settings = {"frame_rate": 1.0 / recording.dt} if settings_to_write(name) else {}
    tracks = as_tracks(recording, frames=bool(settings))
    write_recording(out, tracks, name, **settings)
    _say([f"{out}: {note}" for note in tracks.notes])
