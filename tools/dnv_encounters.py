"""Write the encounters of DNV's ship traffic generator as a scenario file with cases, for `slalom compare`.

    python tools/dnv_encounters.py dnv_ship_encounters.csv out/dnv.yaml
    slalom compare out/dnv.yaml --methods nao --metrics closest_approach,course_changes,side

The CSV file has a row for each ship of a case, the own ship first: case,title,ship,x,y,speed,course_deg,goal_x,goal_y,
length; metres east and north, m/s, degrees clockwise from north. The other ships keep course and speed. The own ship
has the limits of sample:imazu.yaml and keeps 500 m between the centres. Its time is 2.2 times that of the straight way.
"""

import csv
import sys
from itertools import groupby
from math import cos, hypot, radians, sin
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

DISTANCE = 500.0
"""[m] Least distance to keep between the centres of two ships."""
MARGIN = 20.0
"""[m] Part of it that is the margin of the scenario."""

SHARED: dict[str, Any] = {
    "name": "dnv",
    "dt": 10.0,
    "horizon": 1500.0,
    "holds": [10.0, 30.0, 60.0, 120.0, 240.0],
    "margin": MARGIN,
}
LIMITS: list[dict[str, Any]] = [
    {"kind": "friction", "forward": 0.02, "braking": 0.03, "lateral": 0.08},
    {"kind": "turning_radius", "least": 300.0},
]


def cases(source: Path) -> list[dict[str, Any]]:
    """Return the cases of the CSV file, each with the keys of a scenario file."""
    with source.open(newline="") as file:
        rows = list(csv.DictReader(file))
    found = []
    for number, group in groupby(rows, key=lambda row: row["case"]):
        own, *others = ({k: v if k == "title" else float(v) for k, v in row.items()} for row in group)
        speed, half = own["speed"], 0.5 * own["length"]
        straight = hypot(own["goal_x"] - own["x"], own["goal_y"] - own["y"]) / speed
        robot = {
            "radius": half,
            "position": [own["x"], own["y"]],
            "velocity": velocity(own),
            "max_speed": 1.0001 * speed,
            "max_acceleration": 0.08,
            "bounds": [*LIMITS, {"kind": "least_speed", "least": 0.9 * speed}],
            "goal": {"position": [own["goal_x"], own["goal_y"]], "tolerance": 250.0},
        }
        obstacles = [
            {
                "name": f"ship {k + 1}",
                "radius": DISTANCE - half - MARGIN,
                "trajectory": {
                    "kind": "constant_velocity",
                    "position": [ship["x"], ship["y"]],
                    "velocity": velocity(ship),
                },
            }
            for k, ship in enumerate(others)
        ]
        about = {"name": f"dnv {number} {own['title']}", "duration": 10.0 * round(0.22 * straight)}
        found.append({**about, "robot": robot, "obstacles": obstacles})
    return found


def velocity(ship: dict[str, Any]) -> list[float]:
    """Return the velocity [m/s] of a row."""
    course = radians(ship["course_deg"])
    return [ship["speed"] * sin(course), ship["speed"] * cos(course)]


def write(source: Path, target: Path) -> None:
    """Write the scenario file."""
    target.parent.mkdir(parents=True, exist_ok=True)
    YAML(typ="safe").dump({**SHARED, "cases": cases(source)}, target)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    write(Path(sys.argv[1]), Path(sys.argv[2]))
