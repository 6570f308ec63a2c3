"""A robot that crosses a straight road of SUMO between its cars; SUMO makes the network and moves the cars."""

from importlib.util import find_spec
from pathlib import Path
from shutil import which
from subprocess import run
from tempfile import TemporaryDirectory

if find_spec("libsumo") is None or which("netconvert") is None:
    print("This example needs libsumo and netconvert: pip install 'slalom[sumo]' eclipse-sumo")
    raise SystemExit

import libsumo

import slalom
from slalom.adapters.sumo import Robot

NODES = '<nodes><node id="a" x="-100" y="0"/><node id="b" x="100" y="0"/></nodes>'
EDGES = '<edges><edge id="road" from="a" to="b" numLanes="1" speed="10"/></edges>'
ROUTES = """<routes><vType id="robot" length="2" width="2"/><route id="r" edges="road"/>
<vehicle id="robot" type="robot" route="r" depart="0"/>
<flow id="cars" route="r" begin="0" end="99" vehsPerHour="900"/></routes>"""

with TemporaryDirectory() as folder:
    files = {"n.nod.xml": NODES, "e.edg.xml": EDGES, "r.rou.xml": ROUTES}
    n, e, r = (Path(folder) / name for name in files)
    for path, text in zip((n, e, r), files.values()):
        path.write_text(text)
    network = Path(folder) / "road.net.xml"
    run(["netconvert", "-n", n, "-e", e, "-o", network], check=True, capture_output=True)
    libsumo.start(["sumo", "-n", str(network), "-r", str(r), "--step-length", "0.1", "--no-step-log"])
    libsumo.simulationStep()
navigator = slalom.Navigator(slalom.method("nao"), slalom.Disc(1.0), slalom.Limits(5.0, 3.0), margin=0.3)
robot = Robot(libsumo, navigator, uncertainty=slalom.BoundedError(0.1, 0.3))
goal, k, arrived = slalom.Goal(slalom.Stationary((0.0, 25.0)), 0.5), 0, False
robot.place((0.0, -25.0))
for _ in range(200):
    libsumo.simulationStep()
while not arrived and k < 600:
    before = robot.state
    robot.step(goal)
    # The goal is passed: it is reached during a step, not only at its end.
    arrived = goal.reached_during(before.position, before.velocity, robot.state.acceleration, 0.1 * k, 0.1)
    libsumo.simulationStep()
    k += 1
libsumo.close()
print(f"across the road after {0.1 * k:.1f} s")
