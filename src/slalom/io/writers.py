"""Writers of tracks: CSV, JuPedSim database and TrajNet++. Positions keep every bit.

CSV also keeps every bit of a time. The other formats hold frame numbers, so every time must be a multiple of
1 / frame_rate.
"""

import csv
import json
import math
import re
import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from slalom.base.checks import Array, positive
from slalom.base.errors import InvalidFile, InvalidInput, reason
from slalom.base.tolerances import REST
from slalom.io.recorded import Agent, RecordedTracks
from slalom.kernels.arrays import Indices

FRAME_ROUNDING: Final = 1e-6
"""[1] Largest distance of a time from its frame, in frames, for formats that number frames.

Larger: times are changed by up to this when written. Smaller: rounding refuses tracks at whole frames.
"""


MARGIN: Final = 1.0
"""[m] Margin of the walkable area of a database around the bounding box of all positions."""

TABLES: Final = (
    "CREATE TABLE trajectory_data (frame INTEGER NOT NULL, id INTEGER NOT NULL, pos_x REAL NOT NULL, "
    "pos_y REAL NOT NULL, ori_x REAL NOT NULL, ori_y REAL NOT NULL)",
    "CREATE TABLE metadata (key TEXT NOT NULL UNIQUE PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE geometry (hash INTEGER NOT NULL UNIQUE, wkt TEXT NOT NULL)",
    "CREATE TABLE frame_data (frame INTEGER NOT NULL, geometry_hash INTEGER NOT NULL)",
    "CREATE INDEX frame_id_idx ON trajectory_data (frame, id)",
)
"""SQL statements that create the tables of a JuPedSim database, version 2."""


def write_csv(path: Path | str, tracks: RecordedTracks) -> None:
    """Write CSV: t,id,x,y[,z] and, if any agent has them, radius, length, width and kind; by time, then agent.

    Raises:
        InvalidInput: no agents, agents of different dimensions.
        InvalidFile: a file that cannot be written.
    """
    agents = _agents_of(tracks)
    d = {agent.trajectory.dimension for agent in agents.values()}
    if len(d) > 1:
        raise InvalidInput(f"tracks: expected agents of the same dimension, found {sorted(d)}")
    known = [name for name in ("radius", "length", "width") if any(getattr(a, name) for a in agents.values())]
    kinds = ["kind"] if any(agent.kind for agent in agents.values()) else []
    rows = []
    for order, (label, agent) in enumerate(agents.items()):
        own = ["" if (size := getattr(agent, name)) is None else size for name in known] + [agent.kind for _ in kinds]
        track = agent.trajectory
        rows += [(t, order, label, *p, *own) for t, p in zip(track.times.tolist(), track.positions.tolist())]
    with _writing(path), open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t", "id", *"xyz"[: d.pop()], *known, *kinds])
        writer.writerows((t, *rest) for t, _, *rest in sorted(rows, key=lambda row: row[:2]))


def write_jupedsim(path: Path | str, tracks: RecordedTracks, *, frame_rate: float) -> None:
    """Write a JuPedSim SQLite database, version 2, as read by PedPy and JuPedSim.

    The orientation is the direction of the velocity; while an agent rests, the last direction before or, at the start,
    the first one after. The walkable area, which the format requires, is the bounding box of all positions with a
    margin of MARGIN. The format has no extents and kinds.

    Args:
        frame_rate: [Hz] of the frame numbers.

    Raises:
        InvalidInput: agents that are not in the plane, ids that are not whole numbers, times off the frames.
        InvalidFile: a file that cannot be written.
    """
    agents = _frames_of(tracks, frame_rate)
    rows = [
        (frame, label, *position, *direction)
        for label, (agent, frames) in agents.items()
        for frame, position, direction in zip(frames.tolist(), agent.positions.tolist(), _directions(agent).tolist())
    ]
    points = np.concatenate([agent.positions for agent, _ in agents.values()])
    (xmin, ymin), (xmax, ymax) = (points.min(axis=0) - MARGIN).tolist(), (points.max(axis=0) + MARGIN).tolist()
    corners = [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)]
    wkt = f"POLYGON (({', '.join(f'{x!r} {y!r}' for x, y in corners)}))"
    metadata = {"version": 2, "fps": float(frame_rate), "xmin": xmin, "xmax": xmax, "ymin": ymin, "ymax": ymax}
    all_frames = range(min(0, min(row[0] for row in rows)), max(row[0] for row in rows) + 1)
    with _writing(path):
        Path(path).unlink(missing_ok=True)
        with closing(sqlite3.connect(path)) as database, database:
            for table in TABLES:
                database.execute(table)
            geometry_hash = zlib.crc32(wkt.encode())
            database.execute("INSERT INTO geometry VALUES (?, ?)", (geometry_hash, wkt))
            database.executemany("INSERT INTO metadata VALUES (?, ?)", [(key, str(metadata[key])) for key in metadata])
            database.executemany(
                "INSERT INTO frame_data VALUES (?, ?)", [(frame, geometry_hash) for frame in all_frames]
            )
            database.executemany("INSERT INTO trajectory_data VALUES (?, ?, ?, ?, ?, ?)", sorted(rows))


def write_trajnet(path: Path | str, tracks: RecordedTracks, *, frame_rate: float) -> None:
    """Write TrajNet++: one scene over all frames, whose primary pedestrian is the first agent, then the rows by frame.

    The format has no extents and kinds. The fps of the scene is the number of rows per second, as the format defines.

    Args, Raises: as write_jupedsim.
    """
    agents = _frames_of(tracks, frame_rate)
    rows = [
        {"f": frame, "p": label, "x": x, "y": y}
        for label, (agent, frames) in agents.items()
        for frame, (x, y) in zip(frames.tolist(), agent.positions.tolist())
    ]
    rows.sort(key=lambda row: (row["f"], row["p"]))
    first, last = rows[0]["f"], rows[-1]["f"]
    step = math.gcd(*(int(row["f"] - first) for row in rows))
    scene = {"id": 0, "p": next(iter(agents)), "s": first, "e": last, "fps": frame_rate / step, "tag": 0}
    lines = [json.dumps({"scene": scene}), *(json.dumps({"track": row}) for row in rows)]
    with _writing(path):
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


@contextmanager
def _writing(path: Path | str) -> Iterator[None]:
    try:
        yield
    except (OSError, sqlite3.Error) as error:
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason(error)}"]) from None


def _agents_of(tracks: RecordedTracks) -> dict[str, Agent]:
    if not tracks.agents:
        raise InvalidInput("tracks: expected at least one agent, found none")
    return dict(tracks.agents)


def _frames_of(tracks: RecordedTracks, frame_rate: float) -> dict[int, tuple[Any, Indices]]:
    """Return the trajectory and the frame numbers (n,) of each agent, by agent number."""
    rate = positive(frame_rate, "frame_rate")
    found = {}
    for label, agent in _agents_of(tracks).items():
        track = agent.trajectory
        if track.dimension != 2:
            raise InvalidInput(f"agent {label}: expected positions in the plane, found dimension {track.dimension}")
        if not re.fullmatch(r"0|-?[1-9]\d{0,17}", label):
            raise InvalidInput(f"agent {label}: expected a whole number as id, found {label!r}")
        frames = np.round(track.times * rate)
        off = np.abs(track.times * rate - frames)
        if off.max() > FRAME_ROUNDING or np.any(np.diff(frames) == 0):
            worst = track.times[np.argmax(off)]
            raise InvalidInput(f"agent {label}: expected different multiples of 1 / {rate:g} s, found {worst:g} s")
        found[int(label)] = track, frames.astype(np.int64)
    return found


def _directions(track: Any) -> Array:
    """Return the unit direction of motion (n, 2) at each time; of another time while the agent rests."""
    velocity = track.velocity(track.times)
    speed = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speed > REST)
    if not moving.size:
        return np.tile([1.0, 0.0], (len(speed), 1))
    last = moving[np.maximum(np.searchsorted(moving, np.arange(len(speed)), side="right") - 1, 0)]
    return np.asarray(velocity[last] / speed[last, None])
