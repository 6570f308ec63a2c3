"""`slalom convert` and `slalom explain`."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slalom.base.errors import InvalidInput
from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Settings,
    Whole,
    parse_settings,
    print_message,
    print_result,
    refuse_source,
    resolved,
    writable,
)
from slalom.cli.options import Look, Reading, drawable, given_options, refuse_without
from slalom.cli.report import counted, formatted
from slalom.cli.running import DEFAULT_METHOD, is_run, method_name, print_notes, without_walls, write_run

if TYPE_CHECKING:
    from slalom.decision import Decision
    from slalom.decision.methods import Method
    from slalom.decision.navigator import Navigator
    from slalom.io.recorded import RecordedTracks
    from slalom.model.goal import Goal
    from slalom.sim import Scenario


def convert(
    source: Path,
    target: Path,
    /,
    *,
    out_frame_rate: float | None = None,
    per_agent: Flag = False,
    reading: Reading | None = None,
    json: Flag = False,
) -> int:
    """Read a recording of any format and write it as .csv, .ndjson (TrajNet++) or .sqlite (JuPedSim, with walls).

    A run (.h5) is written as a tidy table, .csv or .parquet, one row for each time and robot; or as tracks of robots
    and obstacles, .ndjson or .sqlite.

    Notes on repaired and omitted rows are printed on stderr.

    Parameters
    ----------
    source
        A recording of a format from `slalom list formats`, or a file that `slalom run --out run.h5` wrote.
    target
        File to write, also if it exists; its suffix selects the format.
    out_frame_rate
        Frame rate [Hz] of a format with frame numbers; by default from the median time between two rows of an agent.
    per_agent
        Write a table (.csv) with a row for each agent: start, arrival, path length, delay and least clearance.
    json
        Print one JSON object.
    """
    import numpy as np

    from slalom.base.checks import positive
    from slalom.io.formats import format_of_suffix, write_recording, writer_settings
    from slalom.sim.measure.export_tracks import with_numeric_ids

    source = Path(resolved(str(source)))
    if per_agent:
        return _convert_agents(source, target, out_frame_rate, reading or Reading(), json)
    if is_run(source):
        return _convert_run(source, target, out_frame_rate, reading, json)
    _refuse_suffix(target, format_of_suffix())
    refuse_source(source, target)
    name, read = format_of_suffix()[target.suffix], reading or Reading()
    framed = "frame_rate" in writer_settings(name)
    if out_frame_rate is not None and not framed:
        raise InvalidInput(f"--out-frame-rate: expected only with a format with frame numbers, found it with {name}")
    tracks = _selected(source, read)
    writable(target)
    steps = np.concatenate([np.diff(agent.trajectory.times) for agent in tracks.agents.values()])
    usual = round(1.0 / float(np.median(steps)), 4)
    rate = usual if out_frame_rate is None else positive(out_frame_rate, "--out-frame-rate")
    tracks = with_numeric_ids(tracks) if framed else tracks
    write_recording(target, tracks, name, **({"frame_rate": rate} if framed else {}))
    walls = without_walls(tracks, name)
    for note in (tracks.summary(), *tracks.notes, *walls):
        print_message(f"{source}: {note}")
    result = {
        "source": str(source),
        "target": str(target),
        "from": tracks.format,
        "to": name,
        "agents": len(tracks.agents),
        "frame_rate": rate if framed else None,
        "notes": [*tracks.notes, *walls],
        "summary": tracks.summary(),
    }
    text = f"{source} ({tracks.format}), {counted(len(tracks.agents), 'agent')} -> {target} ({name})"
    print_result(result, json, lambda: text)
    return DONE


def _selected(source: Path, reading: Reading) -> "RecordedTracks":
    """Read the selected agents of a recording. Raises InvalidInput for a selection of none."""
    from slalom.io.formats import read_recording
    from slalom.sim.files.recorded_traffic import chosen

    tracks = chosen(read_recording(source, **reading.settings()), reading.agent_selection(), source.name)
    if not tracks.agents:
        raise InvalidInput(f"--agents: expected at least one agent of {source.name} to write, found none")
    return tracks


def _convert_agents(source: Path, target: Path, rate: float | None, reading: Reading, json: bool) -> int:
    """Write a row for each agent of a run or a recording; return the exit code."""
    from slalom.io.formats import FORMATS
    from slalom.sim import Recording
    from slalom.sim.files.recorded_traffic import radii_of
    from slalom.sim.measure.export_tracks import rows_of_run, rows_of_tracks, write_agents

    from_run = is_run(source)
    _refuse_options(source, reading if from_run else None, rate)
    _refuse_suffix(target, [".csv"], " with --per-agent")
    refuse_source(source, target)
    notes = list[str]()
    if from_run:
        rows = rows_of_run(Recording.load(source))
    else:
        tracks = _selected(source, reading)
        radii, assumed = radii_of(tracks.agents, FORMATS[tracks.format].agents, None)
        rows, notes = rows_of_tracks(tracks, radii), [tracks.summary(), *tracks.notes, *assumed]
    writable(target)
    write_agents(rows, target)
    for note in notes:
        print_message(f"{source}: {note}")
    result = {"source": str(source), "target": str(target), "agents": [row._asdict() for row in rows], "notes": notes}
    print_result(result, json, lambda: f"{source}, {counted(len(rows), 'agent')} -> {target}")
    return DONE


def _refuse_suffix(target: Path, suffixes: Iterable[str], where: str = "") -> None:
    """Raise InvalidInput for a file to write with another suffix."""
    if target.suffix not in suffixes:
        raise InvalidInput(f"TARGET: expected a file that ends in {', '.join(suffixes)}{where}; found {str(target)!r}")


def _refuse_options(source: Path, reading: Reading | None, rate: float | None) -> None:
    """Raise InvalidInput for options of recordings with a run, and for a frame rate of a file without frames."""
    options = [*given_options(reading), *(["out-frame-rate"] if rate is not None else [])]
    if options:
        raise InvalidInput(f"--{options[0]}: expected only with recorded tracks, found it with the run {str(source)!r}")


def _convert_run(source: Path, target: Path, rate: float | None, reading: Reading | None, json: bool) -> int:
    """Write a run as a tidy table or as tracks; return the exit code."""
    from slalom.io.formats import format_of_suffix
    from slalom.sim import Recording
    from slalom.sim.measure.tidy_table import WRITERS, write_table

    _refuse_options(source, reading, rate)
    _refuse_suffix(target, dict.fromkeys((*WRITERS, *format_of_suffix())), " for a run")
    recording = Recording.load(source)
    writable(target)
    robots, rows = recording.positions.shape[1], recording.times.size * recording.positions.shape[1]
    if target.suffix in WRITERS:
        write_table(recording, target)
    else:
        write_run(recording, target)
    result = {"source": str(source), "target": str(target), "robots": robots, "rows": rows}
    text = f"{source} (run), {counted(robots, 'robot')} -> {target}, {rows} rows"
    print_result(result, json, lambda: text)
    return DONE


LABELS = {"time_to_collision": "preferred collides"}
"""Labels for keys of the result that do not name their control."""
EXPLAINED = ("stages", "sentences", "preferred_hits", "passes", "limits", "cost", "alternatives")
"""Keys of an explanation that its sentences say."""


ONE_COLUMN = 5.0
"""[inch] Largest width of a figure of sets for one column."""


@dataclass(frozen=True)
class DecisionFigure:
    """Figures of a decision and of its sets: files, uncertainty of obstacles, and look."""

    file: Path | None
    sets: Path | None
    uncertainty: bool
    look: Look

    def __post_init__(self) -> None:
        refuse_without(self.file or self.sets, self.look)
        refuse_without(self.file, None, uncertainty=self.uncertainty)
        drawable(self.file)
        drawable(self.sets, "--sets")

    def draw(self, decision: "Decision", navigator: "Navigator", goal: "Goal", title: str) -> None:
        """Draw the figure, if there is a file for it."""
        if self.file is not None:
            from slalom import view

            title = f"{title}, {navigator.method.name}: {decision.outcome.name.lower()}"
            figure = view.decision(decision, navigator, goal, title=title, uncertainty=self.uncertainty)
            self.look.save(figure, self.file)

    def draw_sets(self, scene: "Scenario", decision: "Decision") -> None:
        """Draw the sets of different methods where the robot was at a decision, if there is a file for them."""
        if self.sets is None:
            return
        from slalom import view

        made, width = decision.inputs, self.look.figure_width
        state = scene.robot.state if made is None else made.state
        columns = 1 if width is not None and width <= ONE_COLUMN else 2
        writable(self.sets)
        self.look.save(view.sets(scene, decision.decided_at, state=state, columns=columns), self.sets)


def explain(
    scene: str,
    /,
    *,
    settings: Settings = None,
    method: str | None = None,
    foresight: str | None = None,
    seed: Whole = 0,
    at: float | None = None,
    json: Flag = False,
    figure: Path | None = None,
    sets: Path | None = None,
    uncertainty: Flag = False,
    stages: Flag = False,
    look: Look | None = None,
) -> int:
    """Explain one decision: what the robot preferred, why it did not take it, and what else it could do.

    Exit code 1 if no manoeuvre is safe. `slalom decide` is the same command.

    Parameters
    ----------
    scene
        A .yaml scenario file (also sample:crossing.yaml), a name from `slalom list scenarios`, a run of one robot that
        `slalom run --out run.h5` wrote, or a file that `Decision.dump` wrote. The decision of a run or a file is
        repeated; exit code 1 also if that of a file is not the same to the bit.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT; by default nao. Not for runs and files of decisions.
    foresight
        Knowledge of the method about obstacles, as in `slalom run`.
    seed
        Seed of random scenarios; the number of the case, from 0, of a file with cases.
    at
        Time [s] after the start of the scenario or the run; by default its start.
    json
        Print one JSON object.
    figure
        Draw the decision to this .svg, .pdf or .png file.
    sets
        Draw VO, NLVO, AO and NAO to this file, for a page; with --figure-width of at most 5 for one column.
    uncertainty
        Draw the regions that hold obstacles with an uncertainty into the figure.
    stages
        Make the decision again, and print calls and microseconds of its stages. Those within compiled kernels are a
        part of `policy`; NUMBA_DISABLE_JIT=1 shows each.
    """
    from slalom.sim.files.decision_file import is_decision

    scene, drawn = resolved(scene), DecisionFigure(figure, sets, uncertainty, look or Look())
    is_file, from_run = is_decision(scene), is_run(scene)
    given: dict[str, object] = {"--method": method or foresight, "--set": settings, "--seed": seed}
    if is_file or from_run:
        _refuse_given(given | ({"--at": at, "--sets": sets} if is_file else {}), "decision" if is_file else "run")
    if is_file:
        return _repeat(scene, json, stages, drawn)
    loaded, chosen, decision = (
        _of_run(Path(scene), at)
        if from_run
        else _of_scene(scene, parse_settings(settings), seed, at, method, foresight)
    )
    navigator, result = loaded.navigator(chosen), _result(loaded, chosen, decision) | _stages(decision, stages)
    writable(figure)
    drawn.draw(decision, navigator, loaded.robot.goal, loaded.name)
    drawn.draw_sets(loaded, decision)
    print_result(result, json, lambda: _text(result))
    return DONE if decision.safe else FAILED


def _result(loaded: "Scenario", chosen: "Method", decision: "Decision") -> dict[str, Any]:
    """The decision of a scenario and its explanation, as values of JSON."""
    from slalom.sim.explanation import explanation

    manoeuvre, period = decision.manoeuvre, loaded.navigator(chosen).period
    return {
        "scenario": loaded.name,
        "method": chosen.name,
        "foresight": chosen.foresight,
        "response": repr(manoeuvre.response),
        "control": [float(x) for x in manoeuvre.control],
        "acceleration": [float(x) for x in manoeuvre.mean_acceleration(decision.decided_at, period)],
        "status": decision.outcome.name,
        "sentence": decision.outcome.value,
        **_of_controls(decision),
        "time": decision.decided_at,
        **explanation(decision),
    }


def _refuse_given(given: dict[str, object], kind: str) -> None:
    """Raise InvalidInput for options that a file of this kind determines."""
    for option, value in given.items():
        if value not in (None, 0, []):
            raise InvalidInput(f"{option}: expected none with the file of a {kind}, found {value!r}")


Found = tuple["Scenario", "Method", "Decision"]


def _of_scene(
    scene: str, settings: dict[str, float], seed: int, at: float | None, method: str | None, foresight: str | None
) -> Found:
    """The decision in force at a time [s] after the start of a scenario, and its method."""
    from slalom.decision.methods import method as method_of
    from slalom.sim import load
    from slalom.sim.run.deciders import SingleRobotDecider
    from slalom.sim.run.simulate import Run

    chosen = method_of(method_name(DEFAULT_METHOD if method is None else method, foresight))
    loaded = load(scene, settings, seed=seed)
    _refuse_several(len(loaded.robots))
    print_notes(loaded.notes)
    if not at:
        first = SingleRobotDecider(loaded, chosen)
        start = loaded.start if loaded.robot.appears is None else loaded.robot.appears
        return loaded, first.method, first.decide_in(loaded.robot.state, start)
    run = Run(loaded, chosen, seed=seed)
    for _ in run.steps():
        if run.log.count * loaded.dt > at + 1e-9:
            break
    _step_at(at, loaded.dt, run.log.count)
    decider = run.decider
    assert isinstance(decider, SingleRobotDecider)
    if decider.decision is None:
        raise InvalidInput(f"--at: expected a time after the appearance of {loaded.robot.name!r}, found {at:g}")
    return loaded, decider.method, decider.decision


def _step_at(at: float, dt: float, count: int) -> int:
    """The step at a time [s] after the start of a run. Raises InvalidInput for a time outside of it."""
    from slalom.base.checks import not_negative

    step = int(not_negative(at, "--at") / dt + 1e-9)
    if step >= count:
        raise InvalidInput(f"--at: expected a time of the run, which ends after {dt * count:g} s, found {at:g}")
    return step


def _of_run(file: Path, at: float | None) -> Found:
    """The decision in force at a time [s] after the start of a recorded run, made again, and its method."""
    from slalom.sim import Recording, decision_at
    from slalom.sim.run.recorded import recorded

    recording = Recording.load(file)
    _refuse_several(len(recording.shapes))
    recording = recording.only()
    found = recorded(recording)
    if found.method is None:
        raise InvalidInput(f"{file}: expected a run of a method of slalom, found one of {found.name}")
    step = _step_at(at or 0.0, recording.dt, len(found.steps))
    return found.scenario, found.method, decision_at(recording, found.scenario, found.method, step)


def _refuse_several(count: int) -> None:
    """Raise InvalidInput for several robots."""
    if count > 1:
        found = f"{count} robots; `slalom run` runs them"
        raise InvalidInput(f"scenario: expected one with one robot to decide for, found {found}")


def _repeat(file: str, json: bool, stages: bool, drawn: DecisionFigure) -> int:
    """Repeat the decision of a file, draw and print it; return the exit code."""
    from slalom.sim.explanation import explanation
    from slalom.sim.files.decision_file import read_decision

    read = read_decision(file)
    decision, same = read.repeat()
    navigator, goal = read.navigator, read.inputs.goal
    if drawn.file is not None and goal is None:
        raise InvalidInput("--figure: expected a decision with a goal to draw, found one without")
    result = {
        "file": file,
        "method": navigator.method.name,
        "repeated": same,
        **decision.as_dict(),
        **_of_controls(decision),
        **explanation(decision),
        **_stages(decision, stages),
    }
    writable(drawn.file)
    if not same:
        print_message(f"{file}: the decision differs from the one that was written, with {read.versions}")
    if goal is not None:
        drawn.draw(decision, navigator, goal, file)
    print_result(result, json, lambda: _text(result))
    return DONE if same and decision.safe else FAILED


def _stages(decision: "Decision", wanted: bool) -> dict[str, object]:
    """Calls and microseconds of each stage of a decision, if they are wanted."""
    found = decision.stages() if wanted else {}
    return {"stages": {name: [one.calls, round(1e6 * one.time, 1)] for name, one in found.items()}} if wanted else {}


def _of_controls(decision: "Decision") -> dict[str, object]:
    """Clearance [m] of the selected control; the preferred one, the time [s] until it collides, and the limits.

    Of a kept manoeuvre at its beginning.
    """
    from slalom.choice.control_obstacle import ControlObstacle
    from slalom.sim.explanation import beginning_of, drawn_controls
    from slalom.sim.measure.metrics import finite

    known = beginning_of(decision)
    blocked, admissible, preferred, chosen = drawn_controls(known)
    limits = known.navigator.limits
    without_margin = ControlObstacle(blocked.response, blocked.state, blocked.obstacles, blocked.robot)
    return {
        "clearance": None if chosen is None else finite(float(without_margin.clearance(chosen))),
        "preferred": [float(x) for x in preferred],
        "preferred_admissible": bool(admissible.contains(preferred)),
        "max_speed": limits.max_speed,
        "max_acceleration": limits.max_acceleration,
        "time_to_collision": finite(float(without_margin.time_to_collision(preferred))),
    }


def _text(result: dict[str, Any]) -> str:
    """Format a decision, one line for each value."""
    shown = {key: value for key, value in result.items() if key not in EXPLAINED}
    admissible = shown.pop("preferred_admissible")
    limits = f"{shown.pop('max_speed'):.4g} m/s, {shown.pop('max_acceleration'):.4g} m/s^2"
    shown["preferred"] = formatted(shown["preferred"]) + ("" if admissible else f", exceeds the limits ({limits})")
    first = shown["time_to_collision"]
    shown["time_to_collision"] = "with nothing within the horizon" if first is None else f"after {formatted(first)} s"
    lines = [f"{LABELS.get(key, key):18} {formatted(value)}" for key, value in shown.items()]
    stages = [f"{name:18} {calls} calls, {time:g} us" for name, (calls, time) in result.get("stages", {}).items()]
    return "\n".join([*lines, "", *result["sentences"], *stages])
