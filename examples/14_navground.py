"""Agents of navground that cross: slalom's behaviour in a YAML experiment of navground, beside one of its own.

Needs `pip install slalom[navground]`.
"""

from importlib.util import find_spec

if find_spec("navground") is None:
    print("This example needs navground: pip install slalom[navground]")
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
      kinematics: {type: Omni, max_speed: 0.166}
      behavior: {type: BEHAVIOUR, optimal_speed: 0.12, horizon: 3.0, safety_margin: 0.02}
      state_estimation: {type: Bounded, range: 3.0}
"""
for behaviour in ("SlalomFleet", "ORCA"):
    experiment = sim.load_experiment(EXPERIMENT.replace("BEHAVIOUR", behaviour))
    experiment.record_config.collisions = experiment.record_config.efficacy = True
    experiment.run(number_of_runs=1)
    run = experiment.runs[0]
    print(f"{behaviour}: {len(run.collisions)} collisions, efficacy {np.mean(run.efficacy):.3f}")
