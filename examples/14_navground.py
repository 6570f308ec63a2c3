"""Agents of navground that cross, on two kinds of kinematics: slalom beside two of its behaviours, in one experiment.

Needs `pip install 'slalom[navground]'`.
"""

from importlib.util import find_spec

if find_spec("navground") is None:
    print("This example needs navground: pip install 'slalom[navground]'")
    raise SystemExit

import numpy as np
from navground import core, sim

core.load_plugins()  # finds Slalom and SlalomFleet by their entry points
EXPERIMENT = """
steps: 300
time_step: 0.1
scenario:
  type: Cross
  side: 3
  agent_margin: 0.1
  target_margin: 0.1
  tolerance: 0.5
  groups:
    - type: thymio
      number: 8
      radius: 0.08
      control_period: 0.1
      kinematics: KINEMATICS
      behavior: {type: BEHAVIOUR, optimal_speed: 0.12, horizon: 3.0, safety_margin: 0.02}
      state_estimation: {type: Bounded, range: 3.0}
"""
KINEMATICS = {
    "omnidirectional": "{type: Omni, max_speed: 0.166}",
    "two wheels": "{type: 2WDiff, wheel_axis: 0.094, max_speed: 0.166}",
}
for name, kinematics in KINEMATICS.items():
    for behaviour in ("SlalomFleet", "HL", "ORCA"):
        text = EXPERIMENT.replace("BEHAVIOUR", behaviour).replace("KINEMATICS", kinematics)
        experiment = sim.load_experiment(text)
        experiment.record_config.collisions = experiment.record_config.efficacy = True
        experiment.run(number_of_runs=1)
        run = experiment.runs[0]
        print(f"{name}, {behaviour}: {len(run.collisions)} collisions, efficacy {np.mean(run.efficacy):.3f}")
