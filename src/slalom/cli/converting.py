"""`slalom convert`."""

from pathlib import Path
from typing import TYPE_CHECKING

from slalom.cli.console import DONE, Flag, print_message, print_result, refuse_source, resolved, writable
from slalom.cli.recorded import Reading, given_options
from slalom.cli.report import counted
from slalom.cli.running import RUNS
from slalom.errors import InvalidInput

if TYPE_CHECKING:
    from slalom.io.recorded import RecordedTracks


def convert(
    source: Path,
    target: Path,
    /,
    *,
    out_frame_rate: float | None = None,
    reading: Reading | None = None,
    json: Flag = False,
) -> int:
    """Read a recording of any format and write it as .csv, .ndjson (TrajNet++) or .sqlite (JuPedSim).

    A run (.h5) is written as a tidy table, .csv or .parquet: one row for each time and robot.

    Notes on repaired and omitted rows are printed on stderr.

    Parameters
    ----------
    source
        A recording of a format from `slalom list formats`, or a file that `slalom run --out run.h5` wrote.
    target
        File to write, also if it exists; its suffix selects the format.
    out_frame_rate
        Frame rate [Hz] of a format with frame numbers; by default from the median time between two rows of an agent.
    json
        Print one JSON object.
    """
    import numpy as np

    from slalom.checks import positive
    from slalom.io.formats import format_of_suffix, write_recording, writer_settings
    from slalom.sim.measure.export_tracks import with_numeric_ids

    source = Path(resolved(str(source)))
    if source.suffix in RUNS:
        return _convert_run(source, target, out_frame_rate, reading, json)
    if target.suffix not in format_of_suffix():
        raise InvalidInput(
            f"TARGET: expected a file that ends in {', '.join(format_of_suffix())}; found {str(target)!r}"
        )
    refuse_source(source, target)
    name, read = format_of_suffix()[target.suffix], reading or Reading()
    framed = "frame_rate" in writer_settings(name)
    if out_frame_rate is not None and not framed:
        raise InvalidInput(f"--out-frame-rate: expected only with a format with frame numbers, found it with {name}")
    tracks = _selected(source, read)
    writable(target)
    if out_frame_rate is not None:
        positive(out_frame_rate, "--out-frame-rate")
    steps = np.concatenate([np.diff(agent.trajectory.times) for agent in tracks.agents.values()])
    rate = round(1.0 / float(np.median(steps)), 4) if out_frame_rate is None else out_frame_rate
    if framed:
        tracks = with_numeric_ids(tracks)
    write_recording(target, tracks, name, **({"frame_rate": rate} if framed else {}))
    for note in tracks.notes:
        print_message(f"{source}: {note}")
    result = {
        "source": str(source),
        "target": str(target),
        "from": tracks.format,
        "to": name,
        "agents": len(tracks.agents),
        "frame_rate": rate if framed else None,
        "notes": list(tracks.notes),
    }
    count = counted(len(tracks.agents), "agent")
    print_result(result, json, lambda: f"{source} ({tracks.format}), {count} -> {target} ({name})")
    return DONE


def _selected(source: Path, reading: Reading) -> "RecordedTracks":
    """Read the selected agents of a recording. Raises InvalidInput for a selection of none."""
    from slalom.io.formats import read_recording
    from slalom.sim.files.recorded_traffic import chosen

    tracks = chosen(read_recording(source, **reading.settings()), reading.agent_selection(), source.name)
    if not tracks.agents:
        raise InvalidInput(f"--agents: expected at least one agent of {source.name} to write, found none")
    return tracks


def _convert_run(source: Path, target: Path, rate: float | None, reading: Reading | None, json: bool) -> int:
    """Write a run as a tidy table; return the exit code."""
    from slalom.sim import Recording
    from slalom.sim.measure.tidy_table import WRITERS, write_table

    options = [*given_options(reading), *(["out-frame-rate"] if rate is not None else [])]
    if options:
        raise InvalidInput(f"--{options[0]}: expected only with recorded tracks, found it with the run {str(source)!r}")
    if target.suffix not in WRITERS:
        raise InvalidInput(
            f"TARGET: expected a file that ends in {', '.join(WRITERS)} for a run; found {str(target)!r}"
        )
    recording = Recording.load(source)
    writable(target)
    write_table(recording, target)
    robots, rows = recording.positions.shape[1], recording.times.size * recording.positions.shape[1]
    result = {"source": str(source), "target": str(target), "robots": robots, "rows": rows}
    text = f"{source} (run), {counted(robots, 'robot')} -> {target}, {rows} rows"
    print_result(result, json, lambda: text)
    return DONE
