"""`slalom convert`."""

from pathlib import Path

from slalom.cli.console import DONE, Flag, answer, complain, writable
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

    What was repaired or left out is said on stderr.

    Parameters
    ----------
    source
        A recording of a format from `slalom list formats`.
    target
        The file to write; its suffix says in which format.
    out_frame_rate
        [Hz] of a format that counts frames; by default that of the usual time between two rows of an agent.
    json
        Print one JSON object.
    """
    import numpy as np

    from slalom.io.formats import WRITTEN, read_recording, settings_to_write, write_recording
    from slalom.sim.files.recorded_traffic import chosen
    from slalom.sim.measure.export_tracks import numbered

    if target.suffix not in WRITTEN:
        raise InvalidInput(f"expected a file that ends in {', '.join(WRITTEN)}; found {str(target)!r}")
    if source.exists() and target.exists() and target.samefile(source):
        raise InvalidInput(f"{target}: expected another file than the one that is read, found the same")
    name, read = WRITTEN[target.suffix], reading or Reading()
    framed = "frame_rate" in settings_to_write(name)
    if out_frame_rate is not None and not framed:
        raise InvalidInput(f"--out-frame-rate: expected only with a format that counts frames, found it with {name}")
    writable(target)
    tracks = chosen(read_recording(source, **read.settings()), read.who(), source.name)
    steps = np.concatenate([np.diff(agent.trajectory.times) for agent in tracks.agents.values()])
    rate = out_frame_rate or round(1.0 / float(np.median(steps)), 4)
    if framed:
        tracks = numbered(tracks)
    write_recording(target, tracks, name, **({"frame_rate": rate} if framed else {}))
    for note in tracks.notes:
        complain(f"{source}: {note}")
    result = {
        "source": str(source),
        "target": str(target),
        "from": tracks.format,
        "to": name,
        "agents": len(tracks.agents),
        "frame_rate": rate if framed else None,
        "notes": list(tracks.notes),
    }
    answer(result, json, lambda: f"{source} ({tracks.format}), {len(tracks.agents)} agents -> {target} ({name})")
    return DONE
