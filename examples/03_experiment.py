"""An experiment: three methods in the paper's roundabout, from the same start."""

from slalom import method
from slalom.sim import gallery, metrics, simulate

scenario = gallery.build("roundabout_crossing", seed=1)
for name in ("nlvo", "ao", "nao"):
    row = metrics.summary(simulate(scenario, method(name), seed=1))
    print(f"{name:5} {row['time']:5.1f} s, {row['adjustments']:3d} adjustments, clearance {row['min_clearance']:.2f} m")
