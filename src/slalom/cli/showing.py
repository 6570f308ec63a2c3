"""`slalom show` and `slalom export-scenario`."""

import codecs
import sys
from pathlib import Path

from slalom.cli.console import (
    DONE,
    Flag,
    Settings,
    Whole,
    parse_settings,
    print_line,
    print_result,
    resolved,
    writable,
)
from slalom.cli.drawing import Look, drawable, refuse_without
from slalom.cli.report import run_text
from slalom.cli.running import RunFigure, print_notes, refuse_run


def show(
    run: Path,
    /,
    *,
    figure: Path | None = None,
    figure_at: float | None = None,
    names: Flag = False,
    uncertainty: Flag = False,
    look: Look | None = None,
    json: Flag = False,
) -> int:
    """Print the result of a run, as `slalom run` printed it, and draw it if a figure is named.

    Parameters
    ----------
    run
        A file that `slalom run --out run.h5` wrote.
    figure
        Draw a decision of the run to this .svg, .pdf or .png file; with several robots the tracks of all.
    figure_at
        Time [s] after the start of the decision to draw; by default one before the closest approach.
    names
        Write the names of several robots into their figure.
    uncertainty
        Draw the regions that hold obstacles with an uncertainty into the figure of a decision.
    json
        Print one JSON object.
    """
    from slalom.sim import Recording
    from slalom.sim.measure.metrics import summary

    drawable(figure)
    refuse_without(figure, look, figure_at=figure_at, names=names, uncertainty=uncertainty)
    recording = Recording.load(run)
    result = summary(recording)
    if figure is not None:
        from slalom.live.recorded import recorded

        writable(figure)
        found = recorded(recording)
        print_notes(found.notes)
        drawn = RunFigure(figure, figure_at, names, uncertainty, look or Look())
        drawn.draw(recording, found.scenario, recording.method)
    print_result(result, json, lambda: run_text(recording, result))
    return DONE


def export_scenario(scenario: str, /, *, settings: Settings = None, seed: Whole = 0) -> int:
    """Print a scenario as YAML, a scenario file to run or to change: `slalom export-scenario circle > circle.yaml`.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, or a .yaml file.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    seed
        Seed of random scenarios.
    """
    from slalom.sim import load
    from slalom.sim.files.scenario_writer import scenario_text

    refuse_run(scenario)
    loaded = load(resolved(scenario), parse_settings(settings), seed=seed)
    # Files of scenarios are UTF-8: what stdout writes in another encoding would be read as other characters.
    escaped = codecs.lookup(sys.stdout.encoding or "utf-8").name != "utf-8"
    print_line(scenario_text(loaded, ascii_only=escaped).rstrip("\n"))
    return DONE
