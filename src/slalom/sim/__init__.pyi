"""The public names of slalom.sim, each once."""

from . import gallery as gallery
from .files.scenario_yaml import read_scenario as read_scenario
from .measure import metrics as metrics
from .measure.recording import Recording as Recording, RunSummary as RunSummary
from .run.recorded import decision_at as decision_at
from .run.recorder import record as record
from .run.simulate import simulate as simulate
from .scenario import Robot as Robot, Scenario as Scenario
from .sweep.case import load as load
from .sweep.study import (
    Row as Row,
    compare as compare,
    compare_all as compare_all,
    grid as grid,
    read_study as read_study,
)
from .sweep.tables import data_frame as data_frame
from .tasks import Drawn as Drawn, Station as Station, Task as Task, Tasks as Tasks
