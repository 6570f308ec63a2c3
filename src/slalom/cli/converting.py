"""`slalom convert`."""

from pathlib import Path

from slalom.cli.console import DONE, Flag, print_message, print_result, writable
from slalom.cli.recorded import Reading
from slalom.errors import InvalidInput


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

    Notes on repaired and omitted rows are printed on stderr.

    Parameters
    ----------
    source
        A recording of a format from `slalom list formats`.
    target
        File to write; its suffix selects the format.
    out_frame_rate
        Frame rate [Hz] of a format with frame numbers; by default from the median time between two rows of an agent.
    json
        Print one JSON object.
    """
    import numpy as np

    from slalom.io.formats import format_of_suffix, read_recording, write_recording, writer_settings
    from slalom.sim.files.recorded_traffic import chosen
    from slalom.sim.measure.export_tracks import with_numeric_ids

    if target.suffix not in format_of_suffix():
        raise InvalidInput(f"expected a file that ends in {', '.join(format_of_suffix())}; found {str(target)!r}")
    if source.exists() and target.exists() and target.samefile(source):
        raise InvalidInput(f"{target}: expected a file other than the source, found the same")
    name, read = format_of_suffix()[target.suffix], reading or Reading()
    framed = "frame_rate" in writer_settings(name)
    if out_frame_rate is not None and not framed:
        raise InvalidInput(f"--out-frame-rate: expected only with a format with frame numbers, found it with {name}")
    writable(target)
    tracks = chosen(read_recording(source, **read.settings()), read.agent_selection(), source.name)
    steps = np.concatenate([np.diff(agent.trajectory.times) for agent in tracks.agents.values()])
    rate = out_frame_rate or round(1.0 / float(np.median(steps)), 4)
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
    print_result(result, json, lambda: f"{source} ({tracks.format}), {len(tracks.agents)} agents -> {target} ({name})")
    return DONE
