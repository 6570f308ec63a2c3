"""Reference pages of the documentation site, generated from the program: no list in them is written by hand."""

import inspect
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Final, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

import slalom
from slalom import Outcome, Status, tolerances
from slalom.bounds import BOUNDS
from slalom.cli import app
from slalom.cli.report import FORESIGHT_SENTENCES
from slalom.io.formats import FORMATS
from slalom.io.tracks import SAMPLES
from slalom.peers import CONTENDERS
from slalom.shape import SHAPES
from slalom.sim.files.patterns import GOALS, LAYOUTS
from slalom.sim.files.schema import ScenarioSpec
from slalom.sim.files.schema_group import GroupGoalSpec, GroupSpec, NumberOrRange, OverrideSpec, RangeSpec
from slalom.sim.files.schema_parts import OfAnyKind, model_of_part
from slalom.sim.files.schema_recording import RecordingSpec
from slalom.sim.files.schema_robot import GoalSpec, HalfSpaceSpec, ObstacleSpec, PathSpec, RobotSpec
from slalom.sim.gallery import GALLERY
from slalom.sim.measure.hdf5_units import ARRAYS
from slalom.sim.measure.metrics import METRICS
from slalom.sim.measure.tidy_table import COLUMNS
from slalom.sim.sweep.study_yaml import ScenarioRowSpec, StudySpec
from slalom.trajectory import TRAJECTORIES
from slalom.uncertainty import UNCERTAINTIES

sys.path.insert(0, str(Path(__file__).parent))

from site_units import meaning_of, unit_of

SECTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "One decision": (
        *("Navigator", "Decision", "Outcome", "Risk", "LookAhead", "SequenceDecision", "ExpectedLoss", "Manoeuvre"),
        *("State", "Limits"),
        *("Goal", "PathGoal", "METHODS", "Method", "method", "compile", "work_per_second"),
    ),
    "Many robots": ("Fleet", "FleetDecision"),
    "Obstacles": (
        *("Obstacle", "Headings", "ObstacleTable", "ObstacleWindow", "Tracks", "Tracker"),
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
            "enclosing_error",
        ),
    ),
    "Control obstacles and selection": (
        *("control_obstacle", "ControlObstacle", "Element", "select", "select_many", "select_clearest", "Choice"),
        *("Choices", "Status", "Admissible", "admissible_ball", "HalfSpace"),
    ),
    "Responses": (
        *("Response", "Velocity", "LaggedVelocity", "Acceleration", "AccelerateThenBrake", "AccelerateThenCoast"),
        *("AccelerateThenStop", "AccelerationSequence", "Jerk", "AccelerationLag", "advance", "Affine"),
    ),
    "Bounds": (*("Bound", "Box", "ConvexPolygon", "Friction", "HeadingCone", "LeastSpeed", "TurningRadius"),),
    "Objectives": (
        *("Objective", "Aim", "Arrive", "FollowVelocity", "FollowAcceleration", "KeepAcceleration", "Mix"),
        *("MostClearance", "preferred_control"),
    ),
    "Errors": ("SlalomError", "InvalidInput", "InvalidFile", "OutsideSpan"),
}
"""Public names of slalom by section; `api` refuses to leave one out."""
MODULES: Final[Mapping[str, tuple[str, ...]]] = {
    "slalom.sim": (
        *("simulate", "decision_at", "load", "read_scenario", "read_study", "compare", "compare_all"),
        *("Recording", "RunSummary", "Robot", "Scenario", "Row"),
    ),
    "slalom.view": ("decision", "workspace", "control_space", "paths", "fleet", "resized", "save", "animate"),
    "slalom.live.notebook": ("widget",),
    "slalom.vehicle": (),
}
"""Public names of modules; all of `__all__` where none are named."""
HOMES: Final = {"METHODS": "slalom.methods", "FORESIGHTS": "slalom.forecast"}
"""Modules of public names that are neither classes nor functions."""
OWN_PAGES: Final = {"io", "peers", "sim", "tracking", "vehicle", "view"}
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


ROBOT_KEYS: Final[Mapping[str, str]] = {
    "shape": "kinds below; either this key or radius",
    "radius": "[m] of a disc, in space of a ball",
    "name": "in results and files",
    "method": "by which it decides; by default that of the run",
    "objective": "cost that the robot minimises; by default the time of arrival",
    "margin": "[m] its own, by default that of the scenario",
    "priority": "[1] of two robots, the one with the smaller value does more of the avoidance",
    "velocity": "[m/s] at the start; by default 0",
    "max_speed": "[m/s]",
    "max_acceleration": "[m/s^2]",
    "velocity_bounds": "half-spaces of the velocity [m/s]",
    "acceleration_bounds": "half-spaces of the acceleration [m/s^2]",
    "bounds": "bounds that depend on the state: kinds below",
}
"""Meaning of the keys that a robot and a group have in common."""

MEANINGS: Final[Mapping[str, Mapping[str, str]]] = {
    "ScenarioSpec": {
        "name": "by default that of the file",
        "robot": "the only robot: keys below",
        "robots": "several robots or groups of robots, in place of `robot`",
        "obstacles": "keys below",
        "recording": "recorded agents as obstacles: keys below",
        "start": "[s] absolute time of the start",
        "duration": "[s] after which a robot that has not arrived has failed",
        "dt": "[s] between steps",
        "replan": "[s] between decisions, a multiple of dt; 0: dt",
        "horizon": "[s] within which collisions count",
        "margin": "[m] required clearance",
        "patience": "[s] predicted loss of arrival time up to which a safe manoeuvre is kept",
        "holds": "[s] durations for which an acceleration may be held",
        "sight_range": "[m] range of the sensors; 0: not limited",
        "field_of_view": "[rad] full angle about the direction of motion; 0: a full turn",
        "sight_near": "[m] radius that is sensed in all directions",
        "occlusion": "1: obstacles at rest occlude others, 2: all obstacles do, 0: none does",
        "hidden_speed": "[m/s] largest speed of hidden agents, with passive_safety",
        "passive_safety": "1: hidden agents touch the robot at rest only, 2: visible ones as well, 0: neither",
        "period": "[m] after which the world repeats along each axis, .inf where it does not",
    },
    "RobotSpec": {
        **ROBOT_KEYS,
        "position": "[m] at the start",
        "goal": "keys below",
    },
    "GroupSpec": {
        **ROBOT_KEYS,
        "name": "of the group; its robots are NAME 0, NAME 1 and so on",
        "count": "number of robots; this key makes an entry of `robots` a group",
        "positions": "pattern of the starts: kinds below",
        "goals": "pattern of the goals: kinds below",
        "goal": "keys that the goals have in common: below",
        "overrides": "robots that differ: keys below",
    },
    "GroupGoalSpec": {
        "tolerance": "[m] within which a robot has arrived",
        "stop": "whether the robots stop there",
    },
    "RangeSpec": {
        "first": "of the first robot, or one end of random numbers",
        "last": "of the last robot, evenly in between, or the other end",
        "seed": "of random numbers, uniform between both ends",
    },
    "OverrideSpec": {
        **ROBOT_KEYS,
        "robot": "its number in the group, from 0",
        "position": "[m] at the start",
        "goal": "keys of a goal, in place of that of the group",
    },
    "GoalSpec": {
        "position": "[m]; one of position, trajectory and path",
        "trajectory": "of a goal that moves: kinds below",
        "path": "that leads to the goal: keys below",
        "tolerance": "[m] within which the robot has arrived",
        "stop": "whether the robot stops there",
    },
    "PathSpec": {
        "points": "[m] of the polyline",
        "speeds": "[m/s] one, or one for each point",
        "lookahead": "[s] of driving from the robot to its target on the path",
    },
    "HalfSpaceSpec": {"normal": "direction", "offset": "normal . x is at most this"},
    "ObstacleSpec": {
        "shape": "kinds below; either this key or radius",
        "radius": "[m] of a disc, in space of a ball",
        "name": "in results",
        "heading": "[rad] of the shape; motion: along the velocity; or a mapping of times [s] and angles [rad]",
        "uncertainty": "of the position: kinds below",
        "trajectory": "kinds below",
    },
    "RecordingSpec": {
        "file": "relative to the scenario file",
        "format": "by default recognised",
        "radius": "[m] of agents without one in the file",
        "agents": "ids of the only agents to read",
        "without": "ids of agents to leave out",
        "window": "[s] start and end, in the time of the recording",
        "interpolation": "between rows",
        "gap": "[s] above which a track is split",
        "jump_speed": "[m/s] above which an agent is refused",
        "frame_rate": "[Hz] of a format with frame numbers",
        "unit": "of PedPy text",
        "case": "of an INTERACTION file",
        "columns": "names of columns of ships and aircraft",
        "origin": "latitude, longitude [degree] and altitude [m] of 0, 0, 0",
        "epoch": "time 0, in seconds or ISO 8601",
        "altitude_unit": "[m] of the altitude",
    },
    "StudySpec": {
        "title": "of the page",
        "text": "first paragraph of the page",
        "methods": "of rows without their own",
        "seeds": "number of seeds of rows without their own",
        "metrics": "further columns, names of `slalom list metrics`",
        "scenarios": "rows: keys below",
    },
    "ScenarioRowSpec": {
        "scenario": "a name of the gallery, a scenario file, or a file of test cases",
        "settings": "NAME: VALUE of parameters and settings",
        "methods": "of this row",
        "seeds": "number of seeds of this row",
    },
}
"""Meaning of each key of files, by model; `keys` refuses a key without one."""
KINDS: Final[Mapping[str, Mapping[str, type]]] = {
    "Positions and goals of a group": LAYOUTS,
    "Goals of a group alone": {kind: part for kind, part in GOALS.items() if kind not in LAYOUTS},
    "Trajectories": TRAJECTORIES,
    "Shapes": SHAPES,
    "Bounds": BOUNDS,
    "Uncertainties": UNCERTAINTIES,
}
WORDS: Final = {float: "number", int: "whole number", str: "text", bool: "true or false", list: "list"}


CHECKED: Final = re.compile(r"~?(?:typing\.)?Annotated\[(.+?), (?:<function \w+ at 0x\w+>|\([^()]*\))\]")
"""A type with a check of a field in the text of a signature."""

ARRAY_LIKE: Final = re.compile(r"~?numpy\._typing\._array_like\._Buffer \| .*?\._NestedSequence\[(?:~?\w+ \| )*~?\w+\]")
"""The members of numpy.typing.ArrayLike in the text of a signature."""


def plain(signature: str) -> str:
    """Return the text of a signature without checks of fields, see `fields.check_fields`, and with names of unions."""
    return CHECKED.sub(r"\1", ARRAY_LIKE.sub("ArrayLike", signature))


def in_words(hint: Any, metadata: Sequence[Any] = ()) -> str:
    """Return the type of a key in words."""
    metadata = [m for item in metadata for m in (item.metadata if isinstance(item, FieldInfo) else [item])]
    if any(isinstance(item, OfAnyKind) for item in metadata):
        return "part with a `kind`"
    for item in metadata:
        if isinstance(item, NumberOrRange):
            return f"{in_words(item.number)}, or a range"
    if get_origin(hint) is Annotated:
        return in_words(get_args(hint)[0], get_args(hint)[1:])
    if get_origin(hint) is Literal:
        return " or ".join(f"`{value}`" for value in get_args(hint))
    if get_origin(hint) is list:
        (item,) = get_args(hint)
        bounds = {type(m).__name__: m for m in metadata}
        if "MinLen" in bounds and "MaxLen" in bounds and in_words(item) == "number":
            return "2 or 3 numbers" if bounds["MaxLen"].max_length == 3 else "2 numbers"
        inner = in_words(item)
        return f"list of {inner}s" if inner in ("number", "text") else f"list of ({inner})"
    if get_origin(hint) is dict:
        return f"mapping from texts to {in_words(get_args(hint)[1])}s"
    if get_origin(hint) is tuple:
        return f"list of {len(get_args(hint))}: {', '.join(in_words(item) for item in get_args(hint))}"
    if get_args(hint):
        return " or ".join(in_words(item) for item in get_args(hint) if item is not NoneType)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return "mapping"
    words = WORDS.get(hint, "value")
    limits = {type(m).__name__: m for m in metadata}
    if "Gt" in limits:
        return f"{words} above {limits['Gt'].gt:g}"
    return f"{words}, {limits['Ge'].ge:g} or more" if "Ge" in limits else words


def keys(model: type[BaseModel], head: str, of: Callable[[str], str]) -> str:
    """Return the table of the keys of a mapping, with a last column `head` that has the text `of` each key."""
    rows = []
    for name, field in model.model_fields.items():
        if name == "kind":
            continue
        value = field.get_default(call_default_factory=True) if not field.is_required() else None
        default = (
            "required"
            if field.is_required()
            else "-"
            if value in (None, [], "") or isinstance(value, BaseModel)
            else f"`{value}`"
        )
        row = [f"`{name}`", in_words(field.annotation, field.metadata), default]
        rows.append([*row, of(name)])
    return table(["key", "value", "default", head], rows)


def scenario_files() -> str:
    """Return the page of all keys of scenario files and study files."""
    lines = [
        "# Scenario and study files",
        "",
        "This page lists every key, from the schema that reads the files. Units are SI units and radians.",
        "",
    ]
    titled = {
        "A scenario": ScenarioSpec,
        "A robot": RobotSpec,
        "A group of robots": GroupSpec,
        "The goals of a group": GroupGoalSpec,
        "A range of numbers": RangeSpec,
        "A robot of a group that differs": OverrideSpec,
        "A goal": GoalSpec,
        "A path": PathSpec,
        "A half-space": HalfSpaceSpec,
        "An obstacle": ObstacleSpec,
        "A recording": RecordingSpec,
        "A study": StudySpec,
        "A row of a study": ScenarioRowSpec,
    }
    for title, model in titled.items():
        lines += [f"## {title}", "", keys(model, "meaning", MEANINGS[model.__name__].__getitem__), ""]
    for title, kinds in KINDS.items():
        lines += [f"## {title}", ""]
        for kind, part in kinds.items():
            model = model_of_part(kind, part)
            sentence = (part.__doc__ or "").strip().splitlines()[0]
            lines += [f"### `kind: {kind}`", "", sentence, ""]
            lines += [keys(model, "unit", partial(unit_of, kind)), ""] if len(model.model_fields) > 1 else []
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
        ("`period`", "[m] of a periodic world, absent otherwise"),
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
            "Each has its unit as the attribute `units`. A `*` stands for any part of a path.",
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
CONSTANTS: Final = {
    "ADJUSTMENT": "m/s^2",
    "STALLED_SPEED": "m/s",
    "PROGRESS_DISTANCE": "m",
    "PROGRESS_TIME": "s",
    "PERSONAL_SPACE": "m",
}
"""Units of the constants in these formulas and in the docstrings of metrics."""


def metrics() -> str:
    """Return the page of the metrics."""
    rows = []
    for name, function in METRICS.items():
        of = "one robot" if "robot" in inspect.signature(function).parameters else "all robots"
        sentence = " ".join((inspect.getdoc(function) or "").split("\n\n")[0].split())
        rows.append((f"`{name}`", of, sentence, FORMULAS[name]))
    text = (
        "`slalom.sim.metrics` has one function for each, and `METRICS` the table. Those of one robot take the name or\n"
        "number of the robot of a fleet. Clearances are between surfaces and in continuous time, unless they are\n"
        "at the steps `i`. `t_k` is the arrival of robot k; x, v and a are position, velocity and acceleration."
    )
    constants = [(f"`{name}`", f"{getattr(tolerances, name):g} {unit}") for name, unit in CONSTANTS.items()]
    return "\n".join(
        [
            *("# Metrics", "", text, "", table(["metric", "of", "meaning", "formula"], rows), ""),
            *("Constants of the formulas:", "", table(["constant", "value"], constants), ""),
        ]
    )


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
