"""`slalom convert` and `slalom decide`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slalom.base.errors import InvalidInput
from slalom.cli.console import DONE, FAILED, Flag, print_message, print_result, refuse_source, resolved, writable
from slalom.cli.options import Look, Reading, drawable, given_options, refuse_without
from slalom.cli.report import counted, formatted
from slalom.cli.running import DEFAULT_METHOD, RUNS, method_name, print_notes, refuse_run

if TYPE_CHECKING:
    from slalom.decision import Decision
    from slalom.decision.navigator import Navigator
    from slalom.io.recorded import RecordedTracks
    from slalom.model.goal import Goal


def convert(
    source: Path,
    target: Path,
    /,
    *,
    out_frame_rate: float | None = None,
    reading: Reading | None = None,
    json: Flag = False,
) -> int:
    """Read a recording of any format and write it as .csv, .ndjson (TrajNet++) or .sqlite (JuPedSim).

    A run (.h5) is written as a tidy table, .csv or .parquet: one row for each time and robot.

    Notes on repaired and omitted rows are printed on stderr.

    Parameters
    ----------
    source
        A recording of a format from `slalom list formats`, or a file that `slalom run --out run.h5` wrote.
    target
        File to write, also if it exists; its suffix selects the format.
    out_frame_rate
        Frame rate [Hz] of a format with frame numbers; by default from the median time between two rows of an agent.
    json
        Print one JSON object.
    """
    import numpy as np

    from slalom.base.checks import positive
    from slalom.io.formats import format_of_suffix, write_recording, writer_settings
    from slalom.sim.measure.export_tracks import with_numeric_ids

    source = Path(resolved(str(source)))
    if source.suffix in RUNS:
        return _convert_run(source, target, out_frame_rate, reading, json)
    if target.suffix not in format_of_suffix():
        raise InvalidInput(
            f"TARGET: expected a file that ends in {', '.join(format_of_suffix())}; found {str(target)!r}"
        )
    refuse_source(source, target)
    name, read = format_of_suffix()[target.suffix], reading or Reading()
    framed = "frame_rate" in writer_settings(name)
    if out_frame_rate is not None and not framed:
        raise InvalidInput(f"--out-frame-rate: expected only with a format with frame numbers, found it with {name}")
    tracks = _selected(source, read)
    writable(target)
    if out_frame_rate is not None:
        positive(out_frame_rate, "--out-frame-rate")
    steps = np.concatenate([np.diff(agent.trajectory.times) for agent in tracks.agents.values()])
    rate = round(1.0 / float(np.median(steps)), 4) if out_frame_rate is None else out_frame_rate
    if framed:
        tracks = with_numeric_ids(tracks)
    write_recording(target, tracks, name, **({"frame_rate": rate} if framed else {}))
    walls = [f"{len(tracks.walls)} walls left out: {name} has none"] if tracks.walls else []
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
    count = counted(len(tracks.agents), "agent")
    print_result(result, json, lambda: f"{source} ({tracks.format}), {count} -> {target} ({name})")
    return DONE


def _selected(source: Path, reading: Reading) -> "RecordedTracks":
    """Read the selected agents of a recording. Raises InvalidInput for a selection of none."""
    from slalom.io.formats import read_recording
    from slalom.sim.files.recorded_traffic import chosen

    tracks = chosen(read_recording(source, **reading.settings()), reading.agent_selection(), source.name)
    if not tracks.agents:
        raise InvalidInput(f"--agents: expected at least one agent of {source.name} to write, found none")
    return tracks


def _convert_run(source: Path, target: Path, rate: float | None, reading: Reading | None, json: bool) -> int:
    """Write a run as a tidy table; return the exit code."""
    from slalom.sim import Recording
    from slalom.sim.measure.tidy_table import WRITERS, write_table

    options = [*given_options(reading), *(["out-frame-rate"] if rate is not None else [])]
    if options:
        raise InvalidInput(f"--{options[0]}: expected only with recorded tracks, found it with the run {str(source)!r}")
    if target.suffix not in WRITERS:
        raise InvalidInput(
            f"TARGET: expected a file that ends in {', '.join(WRITERS)} for a run; found {str(target)!r}"
        )
    recording = Recording.load(source)
    writable(target)
    write_table(recording, target)
    robots, rows = recording.positions.shape[1], recording.times.size * recording.positions.shape[1]
    result = {"source": str(source), "target": str(target), "robots": robots, "rows": rows}
    text = f"{source} (run), {counted(robots, 'robot')} -> {target}, {rows} rows"
    print_result(result, json, lambda: text)
    return DONE


# ---------------------------------------------------------------------------------------------------------------------
# `slalom decide`.


LABELS = {"time_to_collision": "preferred collides"}
"""Labels for keys of the result that do not name their control."""


@dataclass(frozen=True)
class DecisionFigure:
    """The figure of a decision: file, uncertainty of obstacles, and look."""

    file: Path | None
    uncertainty: bool
    look: Look

    def draw(self, decision: "Decision", navigator: "Navigator", goal: "Goal", title: str) -> None:
        """Draw the figure, if there is a file for it."""
        if self.file is not None:
            from slalom import view

            figure = view.decision(decision, navigator, goal, title=title, uncertainty=self.uncertainty)
            self.look.save(figure, self.file)


def decide(
    scene: str,
    /,
    *,
    method: str | None = None,
    foresight: str | None = None,
    json: Flag = False,
    figure: Path | None = None,
    uncertainty: Flag = False,
    look: Look | None = None,
) -> int:
    """Make one decision at the start of a scenario, or repeat one; exit code 1 if no manoeuvre is safe.

    Parameters
    ----------
    scene
        A .yaml scenario file (also sample:crossing.yaml), a name from `slalom list scenarios`, or a .json file that
        `Decision.dump` wrote. That decision is repeated; exit code 1 also if the result is not the same to the bit.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT; by default nao. Not for a .json file, which has its own.
    foresight
        Knowledge of the method about obstacles, as in `slalom run`.
    json
        Print one JSON object.
    figure
        Draw the decision to this .svg, .pdf or .png file.
    uncertainty
        Draw the regions that hold obstacles with an uncertainty into the figure.
    """
    scene, drawn = resolved(scene), DecisionFigure(figure, uncertainty, look or Look())
    refuse_without(figure, look, uncertainty=uncertainty)
    if scene.endswith(".json"):
        if method or foresight:
            raise InvalidInput(f"--method: expected none with the file of a decision, found {method or foresight!r}")
        return _repeat(scene, json, drawn)
    refuse_run(scene)
    from slalom.decision.methods import method as method_of
    from slalom.sim import load

    chosen, loaded = method_of(method_name(DEFAULT_METHOD if method is None else method, foresight)), load(scene)
    if len(loaded.robots) > 1:
        found = f"{len(loaded.robots)} robots; `slalom run` runs them"
        raise InvalidInput(f"scenario: expected one with one robot to decide for, found {found}")
    drawable(figure)
    print_notes(loaded.notes)
    navigator, robot = loaded.navigator(chosen), loaded.robot
    traffic = loaded.around(robot.state, loaded.start, chosen)
    decision = loaded.decider(chosen).decide(robot.state, traffic, robot.goal, now=loaded.start)
    manoeuvre = decision.manoeuvre
    result = {
        "scenario": loaded.name,
        "method": chosen.name,
        "foresight": chosen.foresight,
        "response": repr(manoeuvre.response),
        "control": [float(x) for x in manoeuvre.control],
        "acceleration": [float(x) for x in manoeuvre.mean_acceleration(loaded.start, navigator.period)],
        "status": decision.outcome.name,
        "sentence": decision.outcome.value,
        **_of_controls(decision, navigator),
    }
    writable(figure)
    drawn.draw(decision, navigator, robot.goal, loaded.name)
    print_result(result, json, lambda: _text(result))
    return DONE if decision.safe else FAILED


def _repeat(file: str, json: bool, drawn: DecisionFigure) -> int:
    """Repeat the decision of a file, draw and print it; return the exit code."""
    from slalom.sim.files.decision_file import read_decision

    drawable(drawn.file)
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
        **_of_controls(decision, navigator),
    }
    writable(drawn.file)
    if not same:
        print_message(f"{file}: the decision differs from the one that was written, with {read.versions}")
    if goal is not None:
        drawn.draw(decision, navigator, goal, file)
    print_result(result, json, lambda: _text(result))
    return DONE if same and decision.safe else FAILED


def _of_controls(decision: "Decision", navigator: "Navigator") -> dict[str, object]:
    """Clearance [m] of the selected control; the preferred one, the time [s] until it collides, and the limits."""
    import numpy as np

    from slalom.choice.control_obstacle import ControlObstacle
    from slalom.sim.measure.metrics import finite

    manoeuvre = decision.manoeuvre
    blocked = decision.blocked
    limits = navigator.limits
    without_margin = ControlObstacle(manoeuvre.response, blocked.state, blocked.obstacles, navigator.robot)
    admissible = limits.admissible(manoeuvre.response, blocked.state, navigator.horizon)
    return {
        "clearance": finite(float(without_margin.clearance(np.array(manoeuvre.control)))),
        "preferred": [float(x) for x in decision.preferred],
        "preferred_admissible": bool(admissible.contains(decision.preferred)),
        "max_speed": limits.max_speed,
        "max_acceleration": limits.max_acceleration,
        "time_to_collision": finite(float(without_margin.time_to_collision(decision.preferred))),
    }


def _text(result: dict[str, Any]) -> str:
    """Format a decision, one line for each value."""
    shown = dict(result)
    admissible = shown.pop("preferred_admissible")
    limits = f"{shown.pop('max_speed'):.4g} m/s, {shown.pop('max_acceleration'):.4g} m/s^2"
    shown["preferred"] = formatted(shown["preferred"]) + ("" if admissible else f", exceeds the limits ({limits})")
    first = shown["time_to_collision"]
    shown["time_to_collision"] = "not within the horizon" if first is None else f"after {formatted(first)} s"
    return "\n".join(f"{LABELS.get(key, key):18} {formatted(value)}" for key, value in shown.items())
