"""One run of a sweep, and everything that its result depends on."""

import hashlib
import json
import os
import pickle
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, cached_property, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NamedTuple

from slalom.base.checks import known, shown
from slalom.base.errors import InvalidFile, InvalidInput
from slalom.decision.methods import METHODS, Method
from slalom.decision.objective import OBJECTIVES
from slalom.io import pedestrians
from slalom.io.pedestrians import Case as CrowdCase
from slalom.model.path_goal import PathGoal
from slalom.peers import Peer, contender
from slalom.sim.files.scenario_yaml import count_of_cases, files_of, is_random, read_scenario, read_scenarios
from slalom.sim.gallery import GALLERY, Entry, build as build_gallery
from slalom.sim.gallery.fleets import cadrl
from slalom.sim.measure.metrics import METRICS, extra_time, finite, summary
from slalom.sim.measure.recording import Recording
from slalom.sim.run.simulate import simulate
from slalom.sim.scenario import SETTINGS, Scenario
from slalom.sim.sweep.script import entry_of, file_of, is_script


def is_cases(name: str) -> bool:
    """Return whether a scenario is named by a file of test cases (`io.pedestrians`)."""
    return name.endswith(".csv")


def case_of(name: str, cases: Sequence[CrowdCase], settings: Mapping[str, float], seed: int) -> Scenario:
    """Return the scenario of a case of a file, by its rank from 0 in the order of case numbers; see `fleets.cadrl`.

    Args:
        settings: those of every scenario, and `max_acceleration`.

    Raises:
        InvalidInput: no such case or setting; robots that overlap at the start.
    """
    for key in settings:
        known(key, f"parameter of {Path(name).name}", ["max_acceleration", *SETTINGS])
    if not 0 <= seed < len(cases):
        raise InvalidInput(f"seed: expected 0 to {len(cases) - 1}, the cases of {name}; found {seed}")
    limits = {key: value for key, value in settings.items() if key == "max_acceleration"}
    scenario = cadrl(cases[seed], **limits).with_settings({k: v for k, v in settings.items() if k not in limits})
    return replace(scenario, parameters={**scenario.parameters, **settings})


def refuse_more(name: str, count: int, seeds: int) -> None:
    """Raise InvalidInput if a study has more seeds than the file has cases."""
    if seeds > count:
        raise InvalidInput(f"seeds: expected at most {count}, the cases of {name}; found {seeds}")


ABOVE: Final = ("__main__.py", "adapters", "cli", "computer.py", "live", "paper", "view")
"""Layers above `sim`. No run uses them, so an edit there changes no result."""

GUIDANCE: Final = ("fleet/guidance.py", "kernels/guidance")
"""Code that chooses the targets of guided robots. An edit there changes no result of other runs."""

OBSERVATIONS: Final = ("sight_noise", "sight_delay", "sight_loss")
"""Settings of observations of robots that do not share their manoeuvres."""

RANDOM: Final = ("sight_noise", "sight_loss")
"""Settings above 0 that make runs of one scenario differ by seed."""

Content = dict[str, Any]
Source = str | Entry | Scenario
"""A scenario by name or file, as an entry of the gallery, or itself."""
Metric = str | Callable[[Recording], float]
"""A metric by name, or a function of a recording."""


def sources_digest(root: Path = Path(__file__).parents[2], *, guided: bool = True) -> str:
    """Return the SHA-256 of code and data of the package in the folder `root` that decide a run.

    Layers ABOVE are left out, and GUIDANCE for runs that are not `guided`. The version alone would return old results
    after an edit. It takes some milliseconds, once per process.
    """
    unused = ABOVE if guided else ABOVE + GUIDANCE
    found = hashlib.sha256()
    for folder, inner, names in os.walk(root):
        inner[:] = sorted(name for name in inner if name != "__pycache__")
        for name in sorted(names):
            path = Path(folder, name)
            inside = path.relative_to(root).as_posix()
            if path.suffix in (".py", ".csv") and not f"{inside}/".startswith(tuple(f"{one}/" for one in unused)):
                content = path.read_bytes()
                found.update(f"{inside} {len(content)}\n".encode() + content)
    return found.hexdigest()


SOURCES, SOURCES_UNGUIDED = sources_digest(), sources_digest(guided=False)
"""Digests of the code that this process has imported, of guided runs and of others, computed at import."""


@dataclass(frozen=True)
class Case:
    """A run that any process can make.

    Attributes:
        scenario: a name of the gallery, the absolute path of a scenario file or of a file of test cases, or a scenario
            or entry of the gallery itself. settings, method, seed: see `run_one`. metrics: see `measured`.
        content: everything that the result depends on, JSON-ready: scenario and method with their parameters, seed,
            versions, digests of the sources and of files. Parameters of the gallery include the defaults.
    """

    scenario: Source
    settings: Mapping[str, float]
    method: str | Method | Peer
    seed: int
    content: Content
    metrics: Sequence[Metric] = ()

    @cached_property
    def key(self) -> str:
        """SHA-256 of the content."""
        return hashlib.sha256(canonical(self.content).encode()).hexdigest()


class Failure(NamedTuple):
    """The reason of a run without a result: it was refused, or its process was `killed`."""

    reason: str
    killed: bool = False


def canonical(content: Any) -> str:
    """Return JSON, the same text for the same content."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)


def load(name: Source, settings: Mapping[str, float] | None = None, *, seed: int = 0) -> Scenario:
    """Return the scenario of a gallery name or entry, of a file.yaml, of a function by FILE.py:FUNCTION, or itself.

    The seed is that of a random scenario, and the number of the case of a file with cases.

    Raises:
        InvalidInput: an unknown name or setting; something else than a scenario. InvalidFile: mistakes in the file.
    """
    if isinstance(name, Scenario):
        return name.with_settings(settings or {})
    if isinstance(name, Entry):
        return build_gallery(name, settings, seed=seed)
    if not isinstance(name, str):
        raise InvalidInput(f"scenario: expected a name, an Entry or a Scenario, found {shown(name)}")
    if is_file(name):
        return read_scenario(name, seed).with_settings(settings or {})
    if is_script(name):
        return build_gallery(entry_of(name), settings, seed=seed)
    if name not in GALLERY and os.path.isfile(name):
        raise InvalidInput(f"scenario: expected a .yaml file or a name of the gallery, found {name!r}, of another kind")
    return build_gallery(known(name, "scenario", list(GALLERY), "a .yaml file or "), settings, seed=seed)


def count_of(name: Source) -> int | None:
    """Return the number of cases of a file of test cases or of a scenario file with cases; None for anything else."""
    if not isinstance(name, str):
        return None
    return len(pedestrians.read_cases(name)) if is_cases(name) else count_of_cases(name) if is_file(name) else None


def drawn(name: Source, settings: Mapping[str, float] | None = None, *, seed: int = 0) -> Scenario:
    """Return the scenario of a study with a seed: as `load`, or the case of that number of a CSV file.

    Raises:
        InvalidInput: as `load`; no such case. InvalidFile: mistakes in the file.
    """
    if isinstance(name, str) and is_cases(name):
        return case_of(name, pedestrians.read_cases(name), settings or {}, seed)
    return load(name, settings, seed=seed)


def is_deterministic(name: Source, settings: Mapping[str, float] | None = None) -> bool:
    """Return whether the runs of all seeds are the same: equal scenarios of two seeds, and no random errors.

    False also for a scenario that cannot be compared, such as one with a Python function.
    """
    if isinstance(name, str) and (is_cases(name) or count_of(name) is not None):
        return False
    one, two = (drawn(name, settings, seed=seed) for seed in (0, 1))
    if any(getattr(one, setting) for setting in RANDOM):
        return False
    try:
        return pickle.dumps(one) == pickle.dumps(two)
    except (pickle.PicklingError, AttributeError, TypeError):
        return False


def is_guided(name: Source, settings: Mapping[str, float], method: str | Method | Peer) -> bool:
    """Return whether guidance chooses the targets of robots: several in the plane that decide by a slalom method.

    Cases of a file, which need not exist, have several robots in the plane.
    """
    if isinstance(contender(method, installed=False), Peer):
        return False
    if isinstance(name, str) and is_cases(name):
        return bool(settings.get("guided", 1.0))
    scenario = drawn(name, settings)
    return scenario.guided and len(scenario.robots) > 1 and scenario.dimension == 2


def without_effect(scenario: Scenario, method: Method | Peer) -> set[str]:
    """Return the settings of scenarios that do not change the runs of a method in this scenario."""
    if isinstance(method, Peer):
        on_paths = any(isinstance(robot.goal, PathGoal) for robot in scenario.robots)
        return {"patience", "guided", "early"} | (set() if on_paths else {"horizon"})
    if len(scenario.robots) == 1:
        return {"guided", *OBSERVATIONS}
    shared = {(robot.method or method).shared for robot in scenario.robots}
    return {*(() if scenario.dimension == 2 else ("guided",)), *(() if False in shared else OBSERVATIONS)}


def is_file(name: str) -> bool:
    """Return whether a scenario is named by a file."""
    return name.endswith((".yaml", ".yml"))


def in_file(name: str) -> bool:
    """Return whether a scenario is named by a file, of cases or of functions too."""
    return is_file(name) or is_cases(name) or is_script(name)


def measured(
    scenario: Scenario, method: str | Method | Peer, seed: int, metrics: Sequence[Metric] = ()
) -> dict[str, Any]:
    """Return the summary of one run and the extra time of each robot, as JSON reads it back; without decision times.

    With `metrics`, also their values by name; a run with tasks has their figures among these.
    """
    recording = simulate(scenario, contender(method), seed=seed)
    row = summary(recording)
    del row["decision_us"]
    values = {n: finite(float(of(recording))) for n, of in named_metrics(metrics).items()} | row.pop("tasks", {})
    extra = [finite(extra_time(recording, k)) for k in range(len(recording.shapes))]
    row |= {"metrics": values} if values else {}
    result: dict[str, Any] = json.loads(canonical({**row, "extra_times": extra, "digest": recording.digest()}))
    return result


def named_metrics(metrics: Sequence[Metric]) -> dict[str, Callable[[Recording], float]]:
    """Return functions by name. Raises InvalidInput for an unknown name, or for an object that is no function."""
    found: dict[str, Callable[[Recording], float]] = {}
    for one in metrics:
        function = METRICS.find(one, "metric") if isinstance(one, str) else one
        if not callable(function):
            raise InvalidInput(f"metric: expected a name or a function of a recording, found {shown(function)}")
        found[one if isinstance(one, str) else getattr(one, "__name__", repr(one))] = function
    return found


def run_one(
    name: str, settings: Mapping[str, float], method: str, seed: int, metrics: Sequence[Metric] = ()
) -> dict[str, Any]:
    """Return the summary of one run, see `measured`."""
    return measured(drawn(name, settings, seed=seed), method, seed, metrics)


def run_case(case: Case) -> dict[str, Any] | Failure:
    """Return the summary of the run, or the reason why the scenario cannot be built or run with seed and method.

    Raises:
        InvalidFile: the sources or files of the scenario differ from those of the case.
    """
    if case.content["sources"] not in (SOURCES, SOURCES_UNGUIDED):
        raise InvalidFile(
            ["slalom: expected the code that the sweep began with, found other code: it was edited since"]
        )
    try:
        files = tuple(case.content["scenario"].get("files", ()))
        name = case.scenario if isinstance(case.scenario, str) else ""
        if is_cases(name):
            scenario = case_of(name, _read_cases(name, files), case.settings, case.seed)
        elif is_script(name):
            _refuse_others(name, files)
            scenario = load(name, case.settings, seed=case.seed)
        elif files:
            scenario = _read(name, files, case.seed).with_settings(case.settings)
        else:
            scenario = load(case.scenario, case.settings, seed=case.seed)
        return measured(scenario, case.method, case.seed, case.metrics)
    except InvalidInput as error:
        return Failure(str(error))


def _read(name: str, digests: tuple[str, ...], seed: int) -> Scenario:
    """Return the scenario of a file with a seed; what does not depend on the seed is read once per process."""
    scenarios = _read_all(name, digests)
    if len(scenarios) > 1:
        return scenarios[seed]
    if not seed or not is_random(name):
        return scenarios[0]
    drawn = read_scenario(name, seed)
    _refuse_others(name, digests)
    return drawn


@cache
def _read_all(name: str, digests: tuple[str, ...]) -> list[Scenario]:
    """Return the scenarios of a file, whose files have these digests, read once per process."""
    scenarios = read_scenarios(name)
    _refuse_others(name, digests)
    return scenarios


@cache
def _read_cases(name: str, digests: tuple[str, ...]) -> list[pedestrians.Case]:
    """Return the cases of a file with this digest, read once per process."""
    cases = pedestrians.read_cases(name)
    _refuse_others(name, digests)
    return cases


def _refuse_others(name: str, digests: tuple[str, ...]) -> None:
    """Raise InvalidFile if a file of a scenario, or of cases, has changed."""
    if digests_of(name) != list(digests):
        raise InvalidFile([f"{name}: expected the files that the sweep began with, found others"])


def digests_of(name: str) -> list[str]:
    """Return the SHA-256 of a Python file, of a file of cases, or of a scenario file and of the files that it names."""
    paths = [file_of(name)] if is_script(name) else [Path(name)] if is_cases(name) else files_of(Path(name))
    return [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]


def scenario_content(name: Source, settings: Mapping[str, float], scenario: Scenario) -> Content:
    """Return the inputs that a result depends on, of a `scenario` that was loaded by that name with those settings.

    The code of a package that adds parts is known by its version, that of an object not at all.
    """
    if not isinstance(name, str):
        return {"name": scenario.name, "settings": dict(settings), "object": id(name)}
    if in_file(name):
        methods = {robot.method.name.partition("@")[0] for robot in scenario.robots if robot.method is not None}
        kinds = {type(robot.objective) for robot in scenario.robots}
        packages = [METHODS.packages[one] for one in sorted(methods) if one in METHODS.packages]
        packages += [package for one, package in OBJECTIVES.packages.items() if OBJECTIVES[one] in kinds]
        added = {"packages": packages} if packages else {}
        return {"name": scenario.name, "settings": dict(settings), "files": digests_of(name), **added}
    package = {"package": GALLERY.packages[name]} if name in GALLERY.packages else {}
    return {"name": name, "parameters": dict(scenario.parameters), **package}


def method_content(method: Method | Peer) -> Content:
    """Return the inputs that a result depends on, of a method: its name, foresight and numeric parameters.

    The code is part of the digest of the sources. The keys are written out here, so that no rename changes them.
    """
    shared = {"name": method.name, "foresight": method.foresight, "foresight_among": method.foresight_among}
    if isinstance(method, Peer):
        own: Content = {"limited": method.limited, "inflation": method.inflation, "walls": method.walls}
        return {**shared, **own, "settings": _values(method.crowd)}
    own = {"share": method.share, "regain": method.regain, "shared": method.shared, "ahead": method.looks_ahead}
    plain = method.name.partition("@")[0]
    if plain in METHODS.packages:
        own["package"] = METHODS.packages[plain]
    return {**shared, **own, "forecast": _values(method.forecast), "of_robots": _values(method.robot_forecast)}


def metrics_content(metrics: Sequence[Metric]) -> Content:
    """Return what results depend on of metrics: the versions of packages that add them, objects as such."""
    return {
        name: METRICS.packages.get(name, "") if METRICS.get(name) is function else id(function)
        for name, function in named_metrics(metrics).items()
    }


def _values(value: Any) -> Any:
    """Return the values of a setting without the names of classes, functions, fields and parameters."""
    if isinstance(value, partial):
        return [_values(item) for item in value.keywords.values()]
    if is_dataclass(value):
        return [_values(getattr(value, item.name)) for item in fields(value)]
    if isinstance(value, Mapping):
        return {name: _values(item) for name, item in value.items()}
    return value if value is None or isinstance(value, str | int | float) else []


def versions(methods: Iterable[Method | Peer] = ()) -> dict[str, str]:
    """Return the versions of slalom, of the computing packages, and of the packages of these methods."""
    packages = ["slalom", "numpy", "numba", "shapely", *(m.package for m in methods if isinstance(m, Peer))]
    return {name: version(name) for name in dict.fromkeys(packages)}
