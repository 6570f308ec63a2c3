"""Four robots on wheels that change places in ir-sim, with the behaviour of slalom."""

from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

if find_spec("irsim") is None:
    print("This example needs ir-sim: pip install 'slalom[irsim]'")
    raise SystemExit

import irsim

import slalom.adapters.irsim  # noqa: F401  # registers the behaviour

ROBOT = """
  - kinematics: {{name: diff}}
    shape: {{name: circle, radius: 0.2}}
    state: [{}, {}, 0]
    goal: [{}, {}, 0]
    vel_max: [1.2, 2.0]
    vel_min: [-1.2, -2.0]
    behavior: {{name: slalom, max_acceleration: 2.0}}
"""
places = [(2.0, 5.1), (5.1, 8.0), (8.0, 4.9), (4.9, 2.0)]
robots = "".join(ROBOT.format(x, y, 10 - x, 10 - y) for x, y in places)
with TemporaryDirectory() as folder:
    world = Path(folder) / "world.yaml"
    world.write_text(f"world: {{height: 10, width: 10, step_time: 0.1}}\nrobot:{robots}")
    env = irsim.make(str(world), display=False, log_level="ERROR")
hit, arrived = set[str](), set[str]()
while len(arrived) < len(env.robot_list) and env.time < 30.0:
    env.step()
    hit |= {robot.name for robot in env.robot_list if robot.collision}
    arrived |= {robot.name for robot in env.robot_list if robot.arrive}
print(f"{len(arrived)} of {len(env.robot_list)} arrived after {env.time:.1f} s, {len(hit)} were hit")
