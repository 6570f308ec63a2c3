"""A sample of each format of recordings, and three agents that each of them writes."""

import json
import math
import os
import sqlite3
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
import pytest

RECORDED = Path(os.environ.get("SLALOM_DATA", Path(__file__).parents[3] / "shared" / "data"))
recorded = pytest.mark.skipif(not RECORDED.is_dir(), reason=f"no recordings at {RECORDED}: they are not part of slalom")

Row = tuple[int, int, float, float]
"""Tick, agent, x, y."""

WALK: list[Row] = [
    *((k, 7, 0.5 * k, 1.0 + 0.25 * k * k / 16) for k in range(9)),
    *((k, 12, 5.0, 8.0 - 0.5 * k) for k in (2, 3, 5, 6, 8, 11)),
    *((k, 3, -1.0 + 0.125 * k, 2.0) for k in (20, 21, 22)),
]
"""Three agents that appear and vanish, one at irregular times; in the order of the agents."""


class Sample(NamedTuple):
    """How a format writes rows.

    Attributes:
        name: of the file. tick: [s] between ticks. write: a file from rows; what it returns are the places of the rows.
        bad: a row that makes a cell that is no number. settings: of the reader. exact: [m] how well places are kept.
    """

    name: str
    tick: float
    write: Callable[[Path, Sequence[Row]], list[str]]
    bad: Row = (1, 7, math.inf, 0.0)
    settings: dict[str, object] = {}  # noqa: RUF012
    exact: float = 0.0

    @property
    def needed(self) -> dict[str, object]:
        """Settings without which the file cannot be read."""
        return {name: value for name, value in self.settings.items() if name in ("unit", "frame_rate")}

    @property
    def options(self) -> list[str]:
        """The same on the command line."""
        return [text for name, value in self.needed.items() for text in (f"--{name.replace('_', '-')}", str(value))]


def in_lines(path: Path, head: Sequence[str], lines: Sequence[str]) -> list[str]:
    """Write lines under a head."""
    path.write_text("\n".join([*head, *lines]) + "\n")
    return [f"{path}:{k}" for k in range(len(head) + 1, len(head) + len(lines) + 1)]


def write_csv(path: Path, rows: Sequence[Row]) -> list[str]:
    return in_lines(path, ["t,id,x,y"], [f"{0.1 * k!r},{agent},{x!r},{y!r}" for k, agent, x, y in rows])


def write_eth(path: Path, rows: Sequence[Row]) -> list[str]:
    return in_lines(path, [], [f"{10 * k}.0\t{agent}.0\t{x!r}\t{y!r}" for k, agent, x, y in rows])


def write_trajnet(path: Path, rows: Sequence[Row]) -> list[str]:
    scene = {"scene": {"id": 0, "p": 7, "s": 0, "e": 220, "fps": 2.5, "tag": 0}}
    lines = [json.dumps({"track": {"f": 10 * k, "p": agent, "x": x, "y": y}}) for k, agent, x, y in rows]
    return in_lines(path, [json.dumps(scene)], lines)


def write_pedpy(path: Path, rows: Sequence[Row]) -> list[str]:
    head = ["# description: made here", "# framerate: 25.00 fps", "#id frame x/m y/m z/m"]
    return in_lines(path, head, [f"{agent} {k} {x!r} {y!r} 1.75" for k, agent, x, y in rows])


def write_database(path: Path, rows: Sequence[Row], said: Sequence[tuple[str, object]] = (("fps", 25),)) -> list[str]:
    path.unlink(missing_ok=True)
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("CREATE TABLE metadata (key TEXT, value TEXT)")
        base.executemany("INSERT INTO metadata VALUES (?, ?)", said)
        base.execute("CREATE TABLE trajectory_data (frame, id, pos_x, pos_y, ori_x, ori_y)")
        base.executemany("INSERT INTO trajectory_data VALUES (?, ?, ?, ?, 1, 0)", rows)
    return [f"{path}: trajectory_data row {k}" for k in range(1, len(rows) + 1)]


def write_hdf5(
    path: Path, rows: Sequence[Row], wkt: object = None, fps: object = 25.0, fields: str = "id frame x y z"
) -> list[str]:
    """Records of the pedestrian dynamics data archive, with heights of heads."""
    with h5py.File(path, "w") as file:
        dtype = [(name, "i8" if name in ("id", "frame") else "f8") for name in fields.split()]
        told = [(agent, k, x, y, 1.75)[: len(dtype)] for k, agent, x, y in rows]
        file["trajectory"] = np.array(told, dtype)
        for values, name, value in ((file["trajectory"].attrs, "fps", fps), (file.attrs, "wkt_geometry", wkt)):
            if value is not None:
                values[name] = value
    return [f"{path}: trajectory row {k}" for k in range(1, len(rows) + 1)]


def write_drone(path: Path, rows: Sequence[Row]) -> list[str]:
    path.with_name("07_recordingMeta.csv").write_text("recordingId,locationId,frameRate\n7,1,25\n")
    path.with_name("07_tracksMeta.csv").write_text("recordingId,trackId,class\n7,7,car\n7,12,pedestrian\n")
    head = "recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,length,xVelocity"
    lines = [f"7,{a},{k},0,{x!r},{y!r},90.0,{0 if a == 12 else 1.8},{0 if a == 12 else 4.5},0" for k, a, x, y in rows]
    return in_lines(path, [head], lines)


def write_interaction(path: Path, rows: Sequence[Row]) -> list[str]:
    head = "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,psi_rad,length,width"
    return in_lines(path, [head], [f"{a},{k},{100 * k},car,{x!r},{y!r},0,0,,4.5,1.8" for k, a, x, y in rows])


def write_commonroad(path: Path, rows: Sequence[Row]) -> list[str]:
    """Version 2020a; each state stands in one line, obstacle by obstacle, the first before the trajectory."""
    places, lines = {}, ['<?xml version="1.0"?>', '<commonRoad commonRoadVersion="2020a" timeStepSize="0.1">']
    for agent in dict.fromkeys(row[1] for row in rows):
        lines += [f'<dynamicObstacle id="{agent}">', "<type>car</type>", "<shape><rectangle><length>4.5</length>"]
        lines += ["<width>1.8</width></rectangle></shape>"]
        tag = "initialState"
        for j, (k, _, x, y) in ((j, row) for j, row in enumerate(rows) if row[1] == agent):
            point = f"<position><point><x>{x!r}</x><y>{y!r}</y></point></position>"
            lines.append(f"<{tag}>{point}<time><exact>{k}</exact></time></{tag}>")
            places[j] = f"{path}:{len(lines)}"
            lines += ["<trajectory>"] if tag == "initialState" else []
            tag = "state"
        lines += ["</trajectory></dynamicObstacle>"]
    path.write_text("\n".join([*lines, "</commonRoad>"]) + "\n")
    return [places[j] for j in range(len(rows))]


def geocentric(p: float, q: float, h: float) -> np.ndarray:
    """X, Y, Z [m] of a latitude, a longitude [rad] and a height above the WGS 84 ellipsoid, from its two axes."""
    a, b = 6378137.0, 6378137.0 * (1.0 - 1.0 / 298.257223563)
    n = a * a / math.hypot(a * math.cos(p), b * math.sin(p))
    away = (n + h) * math.cos(p)
    return np.array([away * math.cos(q), away * math.sin(q), (b * b / (a * a) * n + h) * math.sin(p)])


ORIGIN = (37.81, -122.4)


def unprojected(x: float, y: float, height: float) -> tuple[float, float]:
    """Latitude and longitude [degree] of the place at this height that lies x east and y north of ORIGIN."""
    p0, q0 = np.radians(ORIGIN)
    east = np.array([-math.sin(q0), math.cos(q0), 0.0])
    north = np.array([-math.sin(p0) * math.cos(q0), -math.sin(p0) * math.sin(q0), math.cos(p0)])
    p, q = p0, q0
    for _ in range(8):
        apart = geocentric(p, q, height) - geocentric(p0, q0, 0.0)
        p, q = p + (y - apart @ north) / 6.36e6, q + (x - apart @ east) / (6.38e6 * math.cos(p0))
    return math.degrees(p), math.degrees(q)


def write_ais(path: Path, rows: Sequence[Row]) -> list[str]:
    head = "MMSI,BaseDateTime,LAT,LON,SOG,VesselName,VesselType,Length,Width"
    lines = []
    for k, agent, x, y in rows:
        lat, lon = (math.nan, 0.0) if math.isnan(x) else unprojected(x, y, 0.0)
        time = f"2022-01-03T00:{10 * k // 60:02}:{10 * k % 60:02}" if not math.isnan(x) else "at noon"
        lines.append(f'{agent},{time},{lat!r},{lon!r},5.9,"SMITH, JONES",70,40,')
    return in_lines(path, [head], lines)


def write_adsb(path: Path, rows: Sequence[Row]) -> list[str]:
    lines = []
    for k, agent, x, y in rows:
        lat, lon = (math.nan, 0.0) if math.isnan(x) else unprojected(x, y, 300.0)
        lines.append(f"{k if lat == lat else 'noon'},{agent},{lat!r},{lon!r},90.0,250,300.0")
    return in_lines(path, ["time,icao24,lat,lon,velocity,baroaltitude,geoaltitude"], lines)


def write_traffic(path: Path, rows: Sequence[Row]) -> list[str]:
    """As `write_adsb`, with the columns of the package traffic and the altitude in feet."""
    lines = []
    for k, agent, x, y in rows:
        lat, lon = (math.nan, 0.0) if math.isnan(x) else unprojected(x, y, 300.0)
        lines.append(f"{k if lat == lat else 'noon'},{agent},{lat!r},{lon!r},9,0,0,X,False,{300.0 / 0.3048!r}")
    head = "timestamp,icao24,latitude,longitude,groundspeed,track,vertical_rate,callsign,onground,altitude"
    return in_lines(path, [head], lines)


def write_vadere(path: Path, rows: Sequence[Row]) -> list[str]:
    """Steps that take no time: the end of the last one is no row of its own."""
    head = ["#IDXCOL=2,DATACOL=6,SEP=' '"]
    head += ["pedestrianId simTime endTime-PID1 startX-PID1 startY-PID1 endX-PID1 endY-PID1 targetId-PID2"]
    return in_lines(path, head, [f"{a} {0.1 * k!r} {0.1 * k!r} {x!r} {y!r} {x!r} {y!r} 1" for k, a, x, y in rows])


def write_viswalk(path: Path, rows: Sequence[Row]) -> list[str]:
    head = ["* File: a.inpx", "* PTV Vissim", "$PEDESTRIAN:SIMSEC;NO;COORDCENTX;COORDCENTY;SPEED"]
    return in_lines(path, head, [f"{0.1 * k!r};{agent};{x!r};{y!r};1.0" for k, agent, x, y in rows])


def write_splines(path: Path, rows: Sequence[Row]) -> list[str]:
    """The points of each agent below their number."""
    places, lines = {}, ["3 - the number of splines"]
    for agent in sorted({row[1] for row in rows}):
        # Splines have no ids: those before the number of an agent are empty.
        lines += ["0 - Num of control points"] * (agent - 1 - sum("Num" in line for line in lines))
        own = [(j, row) for j, row in enumerate(rows) if row[1] == agent]
        lines.append(f"{len(own)} - Num of control points")
        for j, (k, _, x, y) in own:
            lines.append(f"{x!r} {y!r} {k} 90.0 - (2D point, m_id)")
            places[j] = f"{path}:{len(lines)}"
    path.write_text("\n".join(lines) + "\n")
    return [places[j] for j in range(len(rows))]


def write_sdd(path: Path, rows: Sequence[Row]) -> list[str]:
    boxes = [(k, a, x - 1, y - 2, x + 1, y + 2) for k, a, x, y in rows]
    return in_lines(path, [], [f'{a} {b!r} {c!r} {d!r} {e!r} {k} 0 0 1 "Biker"' for k, a, b, c, d, e in boxes])


def write_mot(path: Path, rows: Sequence[Row]) -> list[str]:
    return in_lines(path, [], [f"{k},{a},{x - 1!r},{y - 2!r},2,4,1,-1,-1,-1" for k, a, x, y in rows])


def write_ngsim(path: Path, rows: Sequence[Row]) -> list[str]:
    feet = [(k, a, x / 0.3048, y / 0.3048) for k, a, x, y in rows]
    return in_lines(path, [], [f"{a} {k} 9 0 {x!r} {y!r} 0 0 14.5 6.5 2 0 0 1 0 0 0 0" for k, a, x, y in feet])


def write_kitti(path: Path, rows: Sequence[Row]) -> list[str]:
    return in_lines(path, [], [f"{k} {a} Car 0 0 0 1 2 3 4 1.5 1.8 4.5 {-y!r} 1.7 {x!r} 0" for k, a, x, y in rows])


def write_argoverse(path: Path, rows: Sequence[Row]) -> list[str]:
    head = "track_id,object_type,timestep,position_x,position_y,heading,scenario_id"
    return in_lines(path, [head], [f"{a},vehicle,{k},{x!r},{y!r},0.0,abc" for k, a, x, y in rows])


def write_nuscenes(path: Path, rows: Sequence[Row]) -> list[str]:
    """The annotations, and beside them the tables that they name."""
    ticks, agents = ({row[j] for row in rows} for j in (0, 1))
    others = {
        "sample": [{"token": f"s{k}", "timestamp": 10**15 + 100_000 * k} for k in sorted({0, *ticks})],
        "instance": [{"token": f"{a}", "category_token": "c"} for a in sorted(agents)],
        "category": [{"token": "c", "name": "vehicle.car"}],
    }
    for name, records in others.items():
        path.with_name(f"{name}.json").write_text(json.dumps(records))
    named = [
        {"sample_token": f"s{k}", "instance_token": f"{a}", "translation": [x, y, 1.0], "size": [1.8, 4.5, 1.6]}
        for k, a, x, y in rows
    ]
    path.write_text(json.dumps(named))
    return [f"{path}: record {k}" for k in range(1, len(rows) + 1)]


def write_sumo(path: Path, rows: Sequence[Row]) -> list[str]:
    vehicle = '<timestep time="{!r}"><vehicle id="{}" x="{!r}" y="{!r}" type="passenger"/></timestep>'
    lines = [vehicle.format(0.1 * k, a, x, y) for k, a, x, y in rows]
    path.write_text("\n".join(["<fcd-export>", *lines, "</fcd-export>"]) + "\n")
    return [f"{path}:{k}" for k in range(2, len(lines) + 2)]


NOWHERE: Row = (1, 7, math.nan, 0.0)
"""A row of a geographic format without a position, which its writer gives a time that is none."""

SAMPLES = {
    "csv": Sample("a.csv", 0.1, write_csv),
    "eth_ucy": Sample("a.txt", 0.4, write_eth),
    "trajnet": Sample("a.ndjson", 0.4, write_trajnet),
    "pedpy": Sample("a.txt", 0.04, write_pedpy),
    "jupedsim": Sample("a.sqlite", 0.04, write_database),
    "pedpy_hdf5": Sample("a.h5", 0.04, write_hdf5),
    "vadere": Sample("a.traj", 0.1, write_vadere),
    "viswalk": Sample("a.pp", 0.1, write_viswalk),
    "ucy_splines": Sample("a.vsp", 0.04, write_splines, settings={"unit": 1.0}),
    "sdd": Sample("annotations.txt", 1 / 30, write_sdd, settings={"unit": 1.0}),
    "mot": Sample("gt.txt", 0.1, write_mot, settings={"unit": 1.0, "frame_rate": 10.0}),
    "drone": Sample("07_tracks.csv", 0.04, write_drone),
    "interaction": Sample("a.csv", 0.1, write_interaction),
    "ngsim": Sample("a.txt", 0.1, write_ngsim, exact=1e-12),
    "kitti": Sample("0000.txt", 0.1, write_kitti),
    "argoverse": Sample("a.csv", 0.1, write_argoverse),
    "nuscenes": Sample("sample_annotation.json", 0.1, write_nuscenes),
    "commonroad": Sample("a.xml", 0.1, write_commonroad),
    "sumo": Sample("fcd.xml", 0.1, write_sumo),
    "ais": Sample(
        "a.csv", 10.0, write_ais, settings={"origin": ORIGIN, "epoch": "2022-01-03"}, exact=1e-6, bad=NOWHERE
    ),
    "traffic": Sample("a.csv", 1.0, write_traffic, settings={"origin": ORIGIN, "epoch": 0.0}, exact=1e-6, bad=NOWHERE),
    "adsb": Sample("a.csv", 1.0, write_adsb, settings={"origin": ORIGIN, "epoch": 0.0}, exact=1e-6, bad=NOWHERE),
}
