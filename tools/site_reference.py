"""Reference pages of the documentation site, generated from the program: no list in them is written by hand."""

import inspect
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

import slalom
from slalom import DriveStatus, Outcome, Status
from slalom.cli import app
from slalom.cli.file_keys import FAMILIES, MAPPINGS, Key, kind_keys, mapping_keys, sentence_of
from slalom.cli.report import FORESIGHT_SENTENCES, with_values
from slalom.io.formats import FORMATS
from slalom.io.table import SAMPLES
from slalom.peers import CONTENDERS
from slalom.sim.gallery import GALLERY
from slalom.sim.measure.hdf5 import ARRAYS
from slalom.sim.measure.metrics import METRICS
from slalom.sim.measure.tidy_table import COLUMNS

sys.path.insert(0, str(Path(__file__).parent))

from site_units import meaning_of

SECTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "One decision": (
        *(
            "Navigator",
            "Settings",
            "Decision",
            "Outcome",
            "Risk",
            "LookAhead",
            "SequenceDecision",
            "ExpectedLoss",
            "Manoeuvre",
        ),
        *("State", "Limits"),
        *("Goal", "PathGoal", "METHODS", "Method", "method", "compile", "work_per_second"),
    ),
    "The loop around decisions": ("Driver", "Drive", "DriveStatus"),
    "Many robots": ("Fleet", "FleetDecision", "routes"),
    "Obstacles": (
        *(
            "Obstacle",
            "Headings",
            "ObstacleTable",
            "OccupancyTable",
            "occupancy",
            "Scan",
            "scan",
            "read_map",
            "read_walls",
            "Walls",
        ),
        *("ObstacleWindow", "Tracks", "Tracker"),
        *("Filter", "ConstantVelocityFilter", "Estimate", "Measurement", "Sight", "Visibility", "Reciprocity"),
        "AvoidingCrowd",
    ),
    "Shapes": ("Shape", "Disc", "Ball", "Capsule", "Rectangle", "Polygon", "Polyline", "Union", "Part"),
    "Trajectories": (
        *("Trajectory", "Stationary", "ConstantVelocity", "ConstantAcceleration", "Circular", "Sampled"),
        *("PiecewisePolynomial", "Composite", "Function"),
    ),
    "Forecasts and uncertainty": (
        *("FORESIGHTS", "Forecast", "Known", "Present", "AtConstantVelocity", "AtConstantAcceleration"),
        *("AcceleratingBriefly", "AtConstantTurn", "FromPast", "FromModels", "Uncertainty", "BoundedError"),
        *(
            "GaussianError",
            "KalmanError",
            "Horizon",
            "HorizonByName",
            "SafeTime",
            "Calibration",
            "Coverage",
        ),
    ),
    "Control obstacles and selection": (
        *("control_obstacle", "ControlObstacle", "Element", "select", "select_many", "select_clearest", "Choice"),
        *("Choices", "Status", "Admissible", "admissible_ball", "HalfSpace"),
    ),
    "Responses": (
        *("Response", "Velocity", "LaggedVelocity", "Acceleration", "AccelerateThenBrake", "AccelerateThenCoast"),
        *(
            "AccelerateThenStop",
            "AccelerateThenTurn",
            "AccelerationSequence",
            "Jerk",
            "AccelerationLag",
            "advance",
            "Affine",
        ),
    ),
    "Bounds": (*("Bound", "Box", "ConvexPolygon", "Friction", "HeadingCone", "LeastSpeed", "TurningRadius"),),
    "Objectives": (
        *(
            "Objective",
            "Situation",
            "Candidates",
            "Aim",
            "Arrive",
            "FollowVelocity",
            "FollowAcceleration",
            "KeepAcceleration",
            "Mix",
        ),
        *("MostClearance", "preferred_control"),
    ),
    "Errors": ("SlalomError", "InvalidInput", "InvalidFile", "MissingExtra", "OutsideSpan"),
}
"""Public names of slalom by section; `api` refuses to leave one out."""
MODULES: Final[Mapping[str, tuple[str, ...]]] = {
    "slalom.sim": (
        *("simulate", "record", "decision_at", "load", "read_scenario", "read_study", "compare", "compare_all"),
        *("grid", "data_frame"),
        *("Recording", "RunSummary", "Robot", "Scenario", "Row"),
        *("Tasks", "Station", "Task", "Drawn"),
    ),
    "slalom.view": (
        "decision",
        "workspace",
        "control_space",
        "paths",
        "fleet",
        "study",
        "sets",
        "resized",
        "save",
        "animate",
    ),
    "slalom.live.monitor": ("attach", "Monitor"),
    "slalom.live.notebook": ("widget",),
    "slalom.vehicle": (),
}
"""Public names of modules; all of `__all__` where none are named."""
HOMES: Final = {"METHODS": "slalom.decision.methods", "FORESIGHTS": "slalom.forecast.forecast"}
"""Modules of public names that are neither classes nor functions."""
OWN_PAGES: Final = {"io", "live", "peers", "sim", "vehicle", "view"}
"""Public modules of slalom, which are documented in places of their own."""


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    escaped = "\\|"
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *(f"| {' | '.join(str(c).replace('|', escaped) for c in row)} |" for row in rows)])


def entry(module: str, name: str) -> str:
    """Return the directive that documents a public name."""
    thing = getattr(__import__(module, fromlist=[name]), name)
    home = getattr(thing, "__module__", "")
    if inspect.isclass(thing):
        kind, options = "autoclass", ["   :members:"]
    elif callable(thing):
        kind, options = "autofunction", []
    else:
        kind, options, home = "autodata", ["   :no-value:"], HOMES[name]
    own = home if home.startswith("slalom") else module
    return "\n".join(["```{eval-rst}", f".. {kind}:: {own}.{name}", *options, "```", ""])


def api() -> str:
    """Return the page of the Python interface. Raises ValueError for a public name that no section has."""
    listed = {name for names in SECTIONS.values() for name in names}
    missing = {name for name in slalom.__all__ if not name.startswith("__")} - listed - OWN_PAGES
    if missing:
        raise ValueError(f"SECTIONS: expected every public name of slalom, found none of {sorted(missing)}")
    lines = ["# Python", "", "All quantities are in SI units and radians, arrays are of float64.", ""]
    for title, names in SECTIONS.items():
        lines += [f"## {title}", "", *(entry("slalom", name) for name in names)]
    for module, names in MODULES.items():
        found = __import__(module, fromlist=["__all__"])
        lines += [f"## `{module}`", "", f"{(found.__doc__ or '').splitlines()[0]}", ""]
        lines += [entry(module, name) for name in names or found.__all__]
    return "\n".join(lines)


def command_line() -> str:
    """Return the page of the commands, as cyclopts describes them."""
    text = app.generate_docs(output_format="markdown", include_hidden=False)
    # The usage names the module that runs, here that of the build of the site.
    body = re.sub(r"^(slalom [\w -]+?) -m \S+", r"\1", text[text.index("## slalom run") :], flags=re.MULTILINE)
    head = (
        "# Command line\n\nExit code 0: success. 1: a collision, a robot that did not arrive, no safe manoeuvre, or no "
    )
    return f"{head}result. 2: bad input.\nResults are on stdout, everything else on stderr.\n\n{body}\n"


CHECKED: Final = re.compile(r"~?(?:typing\.)?Annotated\[(.+?), (?:<function \w+ at 0x\w+>|\([^()]*\))\]")
"""A type with a check of a field in the text of a signature."""

ARRAY_LIKE: Final = re.compile(r"~?numpy\._typing\._array_like\._Buffer \| .*?\._NestedSequence\[(?:~?\w+ \| )*~?\w+\]")
"""The members of numpy.typing.ArrayLike in the text of a signature."""


def plain(signature: str) -> str:
    """Return the text of a signature without checks of fields, see `checks.check_fields`, and with names of unions."""
    return CHECKED.sub(r"\1", ARRAY_LIKE.sub("ArrayLike", signature))


def keys(found: Iterable[Key], head: str) -> str:
    """Return the table of keys, with the last column `head`."""
    rows = [
        (f"`{k.name}`", k.value, k.default if k.default in ("-", "required") else f"`{k.default}`", k.meaning)
        for k in found
    ]
    return table(["key", "value", "default", head], rows)


def scenario_files() -> str:
    """Return the page of all keys of scenario files and study files."""
    lines = [
        "# Scenario and study files",
        "",
        "This page lists every key, from the schema that reads the files. Units are SI units and radians.",
        "`slalom list keys` prints the same on the command line.",
        "",
    ]
    for name, mapped in MAPPINGS.items():
        lines += [f"## {mapped.title}", "", keys(mapping_keys(name), "meaning"), ""]
    for title, kinds in FAMILIES.values():
        lines += [f"## {title}", ""]
        for kind, part in kinds.items():
            found = kind_keys(kind, part)
            lines += [f"### `kind: {kind}`", "", sentence_of(part), ""]
            lines += [keys(found, "unit"), ""] if found else []
    return "\n".join(lines)


def run_files() -> str:
    """Return the page of the HDF5 layout and of the tidy table."""
    attributes = [
        ("`scenario`, `method`, `foresight`", "input of the run"),
        ("`seed`", "of random scenarios"),
        ("`time_step`", "[s]"),
        ("`steps`", "T, their number"),
        ("`final_sim_time`", "[s] absolute time of the end"),
        ("`digest`", "equal for equal runs"),
        ("group `parameters`", "parameters of the gallery"),
        ("group `settings`", "settings with which the robots decided"),
        (
            "group `robots/K`",
            "`name`, `max_speed` [m/s], `max_acceleration` [m/s^2], `goal_tolerance` [m], `goal_stop`",
        ),
        ("group `obstacles/K`", "`name`, `heading` [rad or motion], or a group `headings`; `contact_at_rest`"),
        ("groups `shape`, `trajectory`, `goal`, `bounds/J`, `uncertainty`", "`kind` and fields, as in scenario files"),
    ]
    arrays = [(f"`{path}`", unit or "text", sentence) for path, (unit, sentence) in ARRAYS.items()]
    columns = [(f"`{name}`", column.unit or "-", column.sentence) for name, column in COLUMNS.items()]
    return "\n".join(
        [
            "# Files of runs",
            "",
            "`slalom run --out run.h5` writes HDF5, `Recording.load` reads it. N robots, T steps, dimension d.",
            "Names are those of navground where it has them. Files of former versions are still read.",
            "",
            "## Attributes of `run_0`",
            "",
            table(["attribute", "meaning"], attributes),
            "",
            "## Arrays of `run_0`",
            "",
            "Each has its unit as the attribute `units`. A `*` stands for any part of a path. Arrays of parts have the",
            "units of their keys in scenario files.",
            "",
            table(["array", "unit", "meaning"], arrays),
            "",
            "## The tidy table",
            "",
            "`Recording.to_pandas()`, and `slalom convert run.h5 run.csv` or `run.parquet`: one row for each time and",
            "robot. Parquet has the units and the facts of the run as metadata.",
            "",
            table(["column", "unit", "meaning"], columns),
            "",
        ]
    )


FORMULAS: Final[Mapping[str, str]] = {
    "success": "`arrived` and not `collisions`",
    "arrived": "all `t_k < inf`",
    "collisions": "`#{pairs with min_t clearance(t) < -1 mm}`",
    "min_clearance": "`min over pairs and t of clearance(t)`",
    "time": "`max_k t_k - t_0`, or the duration",
    "extra_time": "`t_k - t_0 - |goal - x(t_0)| / max_speed`",
    "path_length": "`sum_i |x_(i+1) - x_i|`",
    "spl": "`success * straight / max(path_length, straight)`",
    "adjustments": "`#{i: |a_i - a_(i-1)| > ADJUSTMENT}`",
    "adjustment_rate": "`adjustments / (t_T - t_0)`",
    "sign_reversals": "`#{i: a_(i+1) . a_i < 0}`",
    "max_speed": "`max_i |v_i|`",
    "mean_speed": "`mean_i |v_i|`",
    "efficacy": "`(|goal - x|(t_0) - |goal - x|(t_e)) / ((t_e - t_0) max_speed)`",
    "max_acceleration": "`max_i |a_i|`",
    "mean_acceleration": "`mean_i |a_i|`",
    "max_jerk": "`max_i |a_(i+1) - a_i| / dt`",
    "mean_jerk": "`mean_i |a_(i+1) - a_i| / dt`",
    "heading_change": "`sum_i angle(v_i, v_(i+1))`",
    "stalled_time": "`dt #{i: |v_i| < STALLED_SPEED}`",
    "failures_to_progress": "`#{intervals with less than PROGRESS_DISTANCE}`",
    "clearing_distance": "`mean_i min_obstacles clearance(t_i)`",
    "space_compliance": "`mean_i [clearance(t_i) >= PERSONAL_SPACE]`",
    "min_time_to_collision": "`min_i clearance(t_i) / closing speed(t_i)`",
    "without_safe_choice": "`#{decisions without a new safe manoeuvre} / #{decisions}`",
    "side_flips": "`sum over obstacles of #{changes of the side}`",
    "heading_variation": "`sum_i angle(v_i, v_(i+1))` where the robot moves",
    "changed_choices": "`#{decisions that changed the manoeuvre} / #{decisions}`",
}
"""Formula of each metric; `metrics` refuses one without. t_k: arrival of robot k; x, v, a: at the steps i."""


def metrics() -> str:
    """Return the page of the metrics."""
    rows = []
    for name, function in METRICS.items():
        of = "one robot" if "robot" in inspect.signature(function).parameters else "all robots"
        sentence = " ".join((inspect.getdoc(function) or "").split("\n\n")[0].split())
        rows.append((f"`{name}`", of, with_values(sentence), with_values(FORMULAS[name])))
    text = (
        "`slalom.sim.metrics` has one function for each, and `METRICS` the table. Those of one robot take the name or\n"
        "number of the robot of a fleet. Clearances are between surfaces and in continuous time, unless they are\n"
        "at the steps `i`. `t_k` is the arrival of robot k; x, v and a are position, velocity and acceleration."
    )
    return "\n".join([*("# Metrics", "", text, "", table(["metric", "of", "meaning", "formula"], rows), "")])


def outcomes() -> str:
    """Return the page of outcomes of decisions and statuses of choices."""
    decided = [(f"`{o.name}`", "yes" if o.safe else "no", o.value) for o in Outcome]
    chosen = [(f"`{s.name}`", s.value) for s in Status]
    return "\n".join(
        [
            "# Outcomes and statuses",
            "",
            "## Outcomes of decisions",
            "",
            "`Decision.outcome`, from best to worst. Safe: collision-free up to the horizon if the forecasts hold.",
            "Recordings of peers have CHOSEN, if the peer returned a velocity, or UNANSWERED.",
            "",
            table(["outcome", "safe", "sentence"], decided),
            "",
            "## Statuses of drivers",
            "",
            "`Drive.status` of `slalom.Driver.command`.",
            "",
            table(["status", "sentence"], [(f"`{s.name}`", s.value) for s in DriveStatus]),
            "",
            "## Statuses of choices",
            "",
            "`Choice.status` of `slalom.select`.",
            "",
            table(["status", "sentence"], chosen),
            "",
        ]
    )


def names() -> str:
    """Return the page of everything that has a name on the command line."""
    scenarios = [(f"`{e.name}`", e.sentence, ", ".join(f"`{k}`" for k in e.parameters)) for e in GALLERY.values()]
    parameters = [
        (f"`{e.name}`", f"`{k}`", f"{v:g}", meaning_of(e.name, k))
        for e in GALLERY.values()
        for k, v in e.parameters.items()
    ]
    methods = [(f"`{m.name}`", m.sentence, m.foresight, m.source) for m in CONTENDERS.values()]
    formats = [(f"`{f.name}`", f.sentence, f.mark, f.suffix or "-") for f in FORMATS.values()]
    parts = {
        "Scenarios": table(["scenario", "description", "parameters"], scenarios),
        "Parameters of scenarios": "Set them by `--set NAME=VALUE`.\n\n"
        + table(["scenario", "parameter", "default", "meaning"], parameters),
        "Methods": table(["method", "description", "foresight", "source"], methods),
        "Levels of foresight": table(
            ["foresight", "information"], [(f"`{name}`", text) for name, text in FORESIGHT_SENTENCES.items()]
        ),
        "Formats of recordings": table(["format", "contents", "recognised by", "written as"], formats),
        "Samples": table(["file", "contents"], [(f"`sample:{name}`", text) for name, text in SAMPLES.items()]),
    }
    lines = ["# Scenarios, methods, formats", "", "`slalom list` prints these names.", ""]
    return "\n".join([*lines, *(f"## {title}\n\n{text}\n" for title, text in parts.items())])


PAGES: Final[Mapping[str, Callable[[], str]]] = {
    "api": api,
    "command_line": command_line,
    "scenario_files": scenario_files,
    "run_files": run_files,
    "metrics": metrics,
    "outcomes": outcomes,
    "names": names,
}
"""Generated pages by name."""
