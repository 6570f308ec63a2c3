"""People that a camera saw, crossed by a robot: with and without their future, beside ORCA and social force.

The table has German heads, centimetres, decimal commas, and ids that are used again. ORCA needs `pip install pyrvo`,
social force `pip install 'slalom[navground]'`; without them these methods are left out.
"""

from importlib.util import find_spec
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from slalom.sim import compare, load, simulate
from slalom.view import animate, save

FOLDER = Path(mkdtemp())
SCENE = """
name: passage
recording:
  file: camera.csv
  frame_rate: 25
  columns: {frame: Bildnummer, id: Personen-ID}
robot:
  position: [0, -4]
  radius: 0.3
  max_speed: 1.6
  max_acceleration: 1.5
  goal: {position: [0, 4], tolerance: 0.5}
cases: [{start: 2}, {start: 6}, {start: 10}, {start: 14}]
"""


def walk(person: int, random: np.random.Generator) -> list[str]:
    """The rows of one person that walks to the right or to the left; every eighth person has the same id."""
    begin, way, y = 50 * person, random.choice([-1, 1]), random.uniform(-250, 250)
    x = way * (4.8 * np.arange(250) - 600)
    rows = zip(begin + np.arange(250), x, y + 25 * np.sin(0.03 * x))
    return [f"{frame};{person % 8};{x:.2f};{y:.2f}".replace(".", ",") for frame, x, y in rows]


random = np.random.default_rng(5)
rows = sorted((row for person in range(12) for row in walk(person, random)), key=lambda row: int(row.split(";")[0]))
head = "Bildnummer;Personen-ID;X-Position [cm];Y-Position [cm]"
(FOLDER / "camera.csv").write_text("\n".join([head, *rows]))
scene = FOLDER / "passage.yaml"
scene.write_text(SCENE)

others = {"orca_limited": "pyrvo", "social_force_limited": "navground"}
methods = ["nao_ahead", "nao_ahead@observed", *(name for name, package in others.items() if find_spec(package))]
table = compare(str(scene), methods, 4, store=FOLDER / "runs")
save(table.figure(), FOLDER / "methods.pdf")
table.to_csv(FOLDER / "methods.csv")
for name, row in table["methods"].items():
    print(f"{name}: {row['runs_all_arrived']} of {row['runs']} arrive, {row['runs_with_collision']} collide")
animate(simulate(load(str(scene), seed=1), "nao_ahead@observed"), FOLDER / "passage.gif", width=320, fps=2.0)
