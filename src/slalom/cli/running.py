"""`slalom run`, `slalom show` and `slalom export-scenario`."""

import codecs
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

from slalom.base.errors import InvalidFile, InvalidInput
from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Settings,
    Whole,
    parse_settings,
    print_line,
    print_message,
    print_result,
    progress,
    refuse_source,
    resolved,
    writable,
)
from slalom.cli.options import Crossing, Look, Reading, WallsFile, drawable, is_recording, refuse_without, scenario_of
from slalom.cli.report import counted, run_text

if TYPE_CHECKING:
    from slalom.decision.methods import Method
    from slalom.io.recorded import RecordedTracks
    from slalom.peers import Peer
    from slalom.sim import Recording, Scenario


RUNS = (".h5", ".hdf5")
"""Suffixes of the files of runs; some recordings have the same."""
DEFAULT_METHOD, RECORDING_METHOD = "nao", "nao_ahead"
"""Default methods. The default for recordings can stop for gaps, which one constant acceleration cannot."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RunFigure:
    """Options of the figure of a run.

    Parameters
    ----------
    figure
        Draw a decision of the run to this .svg, .pdf or .png file; with several robots the tracks of all.
    figure_at
        Time [s] after the start of the decision to draw; by default one before the closest approach.
    names
        Write the names of several robots into their figure.
    uncertainty
        Draw the regions that hold obstacles with an uncertainty into the figure of a decision.
    """

    figure: Path | None = None
    figure_at: float | None = None
    names: Flag = False
    uncertainty: Flag = False
    look: Look | None = None

    def check(self, **options: object) -> None:
        """Raise InvalidInput for a format that cannot be drawn, and for options, also `options`, without a figure."""
        drawable(self.figure)
        own = {"figure_at": self.figure_at, "names": self.names, "uncertainty": self.uncertainty}
        refuse_without(self.figure, self.look, **own, **options)

    def refuse(self, scenario: "Scenario", contender: "Method | Peer") -> None:
        """Raise InvalidInput for options that the figure of no run of this scenario has."""
        at = self.figure_at
        if at is not None and not 0.0 <= at <= scenario.duration:
            lasts = f"from 0 to at most {scenario.duration:g} s"
            raise InvalidInput(f"--figure-at: expected a time of the run, {lasts}, found {at:g} s")
        if self.figure is not None:
            from slalom.view.fleet import refuse_unfit

            refuse_unfit(len(scenario.robots), contender, at, self.names, self.uncertainty)

    def draw(self, recording: "Recording", scenario: "Scenario", method: str) -> None:
        """Draw the figure, if there is a file for it."""
        if self.figure is not None:
            from slalom.view.fleet import replay

            drawn = replay(recording, scenario, method, self.figure_at, self.names, self.uncertainty)
            (self.look or Look()).save(drawn, self.figure)


def run(
    scenario: str,
    /,
    *,
    settings: Settings = None,
    method: str | None = None,
    foresight: str | None = None,
    seed: Whole = 0,
    out: Path | None = None,
    drawn: RunFigure | None = None,
    at: float | None = None,
    crossing: Crossing | None = None,
    reading: Reading | None = None,
    walls: WallsFile | None = None,
    json: Flag = False,
) -> int:
    """Run a scenario, or a robot in a recording, and print the result; exit code 1 on a collision or without arrival.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, a .yaml file, or a recording of a format from `slalom list formats`. Files
        that slalom brings are named as in sample:crossing.yaml (`slalom list samples`).
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT; by default nao. In a recording by default nao_ahead, which
        can also stop for gaps: it chooses a sequence of accelerations, nao only one.
    foresight
        Knowledge of the method about obstacles: recorded, present, observed, observed_velocity or observed_turn (see
        `slalom list foresights`); the same as NAME@FORESIGHT. By default that of the method.
    seed
        Seed of random scenarios; the number of the case, from 0, of a file with cases.
    out
        Write the run to this file, also if it exists. A .h5 file holds all data for a replay. A .csv, .ndjson
        (TrajNet++) or .sqlite (JuPedSim) file holds the tracks only; frames of the last two count from the start.
    at
        In a recording: start time [s] of the robot, in the time of the recording; by default the first time.
        Otherwise the same as --figure-at.
    json
        Print one JSON object.
    """
    scenario = resolved(scenario)
    refuse_run(scenario)
    drawn = drawn or RunFigure()
    refuse_source(scenario, out, drawn.figure)
    recorded = is_recording(scenario, reading, crossing)
    name = method_name((RECORDING_METHOD if recorded else DEFAULT_METHOD) if method is None else method, foresight)
    figure_at = drawn.figure_at if recorded else _figure_time(at, drawn.figure_at)
    drawn.check(**({} if recorded else {"at": at}))
    changed = parse_settings(settings)
    if recorded:
        loaded = _with_settings(scenario_of(scenario, reading, crossing, at), changed)
    else:
        from slalom.sim import load

        loaded = load(scenario, changed, seed=seed)
    loaded = (walls or WallsFile()).added_to(loaded)
    return _run(loaded, name, seed, out, replace(drawn, figure_at=figure_at), json)


def _run(loaded: "Scenario", name: str, seed: int, out: Path | None, drawn: RunFigure, json: bool) -> int:
    """Run a scenario with the method `name`; write, draw and print the result; return the exit code."""
    from slalom.peers import contender
    from slalom.sim import simulate
    from slalom.sim.files.recorded_traffic import ends_before
    from slalom.sim.measure.metrics import summary

    chosen = contender(name)
    _output_format(out, loaded.dimension)
    drawn.refuse(loaded, chosen)
    writable(out, drawn.figure)
    print_notes(loaded.notes)
    with progress("running") as advance:
        _load_kernels(loaded, chosen, seed)
        recording = simulate(loaded, chosen, seed=seed, progress=advance)
    result = summary(recording)
    print_notes(ends_before(loaded, float(recording.times[-1])))
    if out is not None:
        write_run(recording, out)
    drawn.draw(recording, loaded, name)
    print_result(result, json, lambda: run_text(recording, result))
    return DONE if result["arrived"] == result["robots"] and not result["collisions"] else FAILED


def _load_kernels(scenario: "Scenario", contender: "Method | Peer", seed: int) -> None:
    """Make the first step of a run that is discarded: the time to load kernels is no part of that of a decision."""
    from slalom.sim.run.simulate import Run

    next(Run(scenario, contender, seed=seed).steps(), None)


def is_run(path: Path | str) -> bool:
    """Return whether a path has the suffix of a run and is no recording of a format of `slalom list formats`."""
    from slalom.io.formats import format_of

    if Path(path).suffix not in RUNS:
        return False
    try:
        return not format_of(Path(path))
    except InvalidFile:
        return True


def refuse_run(scenario: str) -> None:
    """Raise InvalidInput for a run that was recorded, which is not a scenario."""
    if os.path.isfile(scenario) and is_run(scenario):
        raise InvalidInput(
            f"scenario: expected a scenario or recorded tracks, found the run {scenario!r}, which is over; "
            "`slalom show` prints it, `slalom convert` writes it in other formats, `slalom view` replays it"
        )


def method_name(method: str, foresight: str | None) -> str:
    """Return NAME@FORESIGHT. Raises InvalidInput if the method already has another foresight."""
    plain, at, own = method.partition("@")
    if foresight is None or (at and own == foresight):
        return method
    if at:
        raise InvalidInput(f"--foresight: expected none with {method}, or {own}; found {foresight!r}")
    return f"{plain}@{foresight}"


def _figure_time(at: float | None, figure_at: float | None) -> float | None:
    """Return the time of the decision to draw. Raises InvalidInput if both options are given."""
    if at is not None and figure_at is not None:
        raise InvalidInput(f"--at: expected either --at or --figure-at, found {at:g} and {figure_at:g}")
    return figure_at if at is None else at


def _with_settings(loaded: "Scenario", settings: dict[str, float]) -> "Scenario":
    """Return the scenario with other settings. Raises InvalidInput for settings that have their own options."""
    for name, option in (("start", "--at"), ("duration", "--duration")):
        if name in settings:
            raise InvalidInput(f"--set {name}: expected {option} with a recording, found {settings[name]:g}")
    return loaded.with_settings(settings)


def print_notes(notes: Sequence[str]) -> None:
    """Print notes on files that were read or written, a line each."""
    for note in notes:
        print_message(note)


def _output_format(out: Path | None, dimension: int) -> str:
    """Return the format of the output file, "" for HDF5. Raises InvalidInput if it cannot hold the run."""
    from slalom.io.formats import format_of_suffix, writer_settings

    if out is None:
        return ""
    formats = {".h5": "", ".hdf5": "", **format_of_suffix()}
    if out.suffix not in formats:
        raise InvalidInput(f"--out: expected a file that ends in {', '.join(formats)}; found {str(out)!r}")
    name = formats[out.suffix]
    if dimension == 3 and name and writer_settings(name):
        raise InvalidInput(f"--out: expected .h5 or .csv for a run in space, found {str(out)!r}")
    return name


def write_run(recording: "Recording", out: Path) -> None:
    """Write the run to a file; print notes on omitted and renamed agents."""
    name = _output_format(out, recording.dimension)
    if not name:
        recording.save(out)
        return
    from slalom.io.formats import write_recording, writer_settings
    from slalom.sim.measure.export_tracks import as_tracks

    settings = {"frame_rate": 1.0 / recording.dt} if writer_settings(name) else {}
    tracks = as_tracks(recording, frames=bool(settings))
    write_recording(out, tracks, name, **settings)
    print_notes([f"{out}: {note}" for note in (*tracks.notes, *without_walls(tracks, name))])


def without_walls(tracks: "RecordedTracks", name: str) -> list[str]:
    """Return a note if a format cannot hold the walls of tracks."""
    held = name == "jupedsim" or not tracks.walls
    return [] if held else [f"{counted(len(tracks.walls), 'wall')} left out: {name} has none"]


def show(run: Path, /, *, drawn: RunFigure | None = None, json: Flag = False) -> int:
    """Print the result of a run, as `slalom run` printed it, and draw it if a figure is named.

    Parameters
    ----------
    run
        A file that `slalom run --out run.h5` wrote.
    json
        Print one JSON object.
    """
    from slalom.sim import Recording
    from slalom.sim.measure.metrics import summary

    drawn = drawn or RunFigure()
    drawn.check()
    recording = Recording.load(run)
    result = summary(recording)
    if drawn.figure is not None:
        from slalom.sim.run.recorded import recorded

        writable(drawn.figure)
        found = recorded(recording)
        print_notes(found.notes)
        drawn.draw(recording, found.scenario, recording.method)
    print_result(result, json, lambda: run_text(recording, result))
    return DONE


def export_scenario(
    scenario: str, /, *, settings: Settings = None, seed: Whole = 0, walls: WallsFile | None = None
) -> int:
    """Print a scenario as YAML, a scenario file to run or to change: `slalom export-scenario circle > circle.yaml`.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, or a .yaml file.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    seed
        Seed of random scenarios; the number of the case, from 0, of a file with cases.
    """
    from slalom.sim import load
    from slalom.sim.files.scenario_writer import scenario_text

    refuse_run(scenario)
    loaded = load(resolved(scenario), parse_settings(settings), seed=seed)
    loaded = (walls or WallsFile()).added_to(loaded)
    # Files of scenarios are UTF-8: what stdout writes in another encoding would be read as other characters.
    escaped = codecs.lookup(sys.stdout.encoding or "utf-8").name != "utf-8"
    print_line(scenario_text(loaded, ascii_only=escaped).rstrip("\n"))
    return DONE
