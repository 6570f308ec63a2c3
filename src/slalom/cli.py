"""The command line: run, list, decide, compare, reproduce. Results on stdout, everything else on stderr.

Heavy imports happen inside the commands, so that `slalom --help` answers at once.
"""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter

from slalom.errors import InvalidFile, InvalidInput, SlalomError
from slalom.report import files_text, list_text, run_text, shown, table_text

DONE, FAILED, BAD_INPUT = 0, 1, 2
METHOD = "nao"

app = App(
    name="slalom",
    help="Reactive robot navigation with velocity and acceleration obstacles.",
    version_flags=["--version"],
    result_action="return_value",
)
Settings = Annotated[list[str] | None, Parameter(name="--set", consume_multiple=True, negative=())]
Flag = Annotated[bool, Parameter(negative=())]


def main(tokens: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 the run failed to do what was asked, 2 bad input."""
    sys.exit(call(tokens))


def call(tokens: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code."""
    try:
        code = app(tokens, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        print(f"slalom: {error}", file=sys.stderr)
        return BAD_INPUT
    except SlalomError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except BrokenPipeError:
        # The reader of stdout (head, less) has closed it: nothing more to say, and no traceback at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    return code if isinstance(code, int) else DONE


@app.command
def run(
    scenario: str,
    /,
    *,
    settings: Settings = None,
    method: str = METHOD,
    seed: int = 0,
    out: Path | None = None,
    figure: Path | None = None,
    at: float | None = None,
    json: Flag = False,
) -> int:
    """Run a scenario and say how it went; exit code 1 if the robot collided or did not arrive.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, or a .yaml file.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`.
    seed
        What random scenarios are drawn with.
    out
        Write the recording to this HDF5 file.
    figure
        Draw a decision of the run to this .svg, .pdf or .png file.
    at
        Time [s] of the decision that is drawn; by default a tight one.
    json
        Print one JSON object.
    """
    from slalom.peers import contender
    from slalom.sim import load, simulate
    from slalom.sim.metrics import summary

    chosen, loaded = contender(method), load(scenario, parse_settings(settings), seed=seed)
    _check_suffix(figure)
    _writable(out)
    with _progress("running") as advance:
        recording = simulate(loaded, chosen, seed=seed, progress=advance)
    result = summary(recording)
    if out is not None:
        with _writing(out):
            recording.save(out)
    if figure is not None:
        from slalom import view
        from slalom.view.replay import replay

        with _writing(figure):
            view.save(replay(recording, loaded, method, at), figure)
    _print(result, json, lambda: run_text(recording, result))
    return DONE if result["arrived"] == result["robots"] and not result["collisions"] else FAILED


@app.command(name="list")
def list_(what: Literal["scenarios", "methods", "figures"] | None = None, /, *, json: Flag = False) -> int:
    """List the scenarios of the gallery, the methods, and the paper's figures and claims.

    Parameters
    ----------
    what
        Only these.
    json
        Print one JSON object.
    """
    from slalom.peers import CONTENDERS
    from slalom.reproduce.titles import TITLES
    from slalom.sim.gallery import GALLERY

    scenarios = {e.name: {"sentence": e.sentence, "parameters": dict(e.parameters)} for e in GALLERY.values()}
    methods = {m.name: {"sentence": m.sentence, "source": m.source} for m in CONTENDERS.values()}
    figures = {name: {"sentence": f"{title}."} for name, title in TITLES.items()}
    every = (("scenarios", scenarios), ("methods", methods), ("figures", figures))
    result = {k: v for k, v in every if what in (None, k)}
    _print(result, json, lambda: list_text(result))
    return DONE


@app.command
def decide(
    scene: str,
    /,
    *,
    method: str = METHOD,
    json: Flag = False,
    figure: Path | None = None,
) -> int:
    """One decision at the beginning of a scenario; exit code 1 if no manoeuvre is safe.

    Parameters
    ----------
    scene
        A .yaml scenario file, or a name from `slalom list scenarios`.
    method
        A name from `slalom list methods`.
    json
        Print one JSON object.
    figure
        Draw the decision to this .svg, .pdf or .png file.
    """
    import numpy as np

    from slalom.control_obstacle import ControlObstacle
    from slalom.methods import method as method_of
    from slalom.sim import load
    from slalom.sim.metrics import finite

    loaded = load(scene)
    _check_suffix(figure)
    navigator, robot = loaded.navigator(method_of(method)), loaded.robot
    decision = navigator.decide(robot.state, loaded.obstacles, robot.goal, now=loaded.start)
    manoeuvre, blocked = decision.manoeuvre, decision.blocked
    bare = ControlObstacle(manoeuvre.response, robot.state, blocked.traffic, robot.shape)
    result = {
        "scenario": loaded.name,
        "method": method,
        "response": repr(manoeuvre.response),
        "control": [float(x) for x in manoeuvre.control],
        "acceleration": [float(x) for x in manoeuvre.mean_acceleration(loaded.start, navigator.period)],
        "status": decision.outcome.name,
        "sentence": decision.outcome.value,
        "clearance": finite(float(bare.clearance(np.array(manoeuvre.control)))),
        "preferred": [float(x) for x in decision.preferred],
        "time_to_collision": finite(float(bare.time_to_collision(decision.preferred))),
    }
    if figure is not None:
        from slalom import view

        with _writing(figure):
            view.save(view.decision(decision, navigator, robot.goal, title=loaded.name), figure)
    _print(result, json, lambda: "\n".join(f"{k:18} {shown(v)}" for k, v in result.items()))
    return DONE if decision.outcome.safe else FAILED


@app.command
def compare(
    scenario: str,
    /,
    *,
    settings: Settings = None,
    methods: str = "vo,nlvo,avo,ao,nao",
    seeds: int = 100,
    jobs: int = 1,
    json: Flag = False,
) -> int:
    """Every method on the same scenarios, seeds 0, 1, ...; the same table to the bit for any number of jobs.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, or a .yaml file.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    methods
        Names from `slalom list methods`, with commas between.
    seeds
        How many scenarios.
    jobs
        How many processes; -1 for one per core.
    json
        Print one JSON object.
    """
    from slalom.sim.study import compare as study

    names = [name.strip() for name in methods.split(",") if name.strip()]
    with _progress("comparing") as advance:
        result = study(
            scenario,
            names,
            seeds,
            settings=parse_settings(settings),
            jobs=jobs,
            progress=lambda done, total: advance(done / total),
        )
    _print(result, json, lambda: table_text(result))
    return DONE


@app.command
def reproduce(
    name: str | None = None,
    /,
    *,
    out: Path = Path("out/paper"),
    page: Path | None = None,
    seeds: int = 300,
    jobs: int = 2,
    quick: Flag = False,
    json: Flag = False,
) -> int:
    """Make the figures of the paper, and measure its claims; everything, or only what is named.

    Parameters
    ----------
    name
        A figure or claim from `slalom list figures`.
    out
        Folder for NAME.svg of each figure and NAME.json of each claim; it is made if need be.
    page
        File for the page with captions and tables, by default paper.md in that folder.
    seeds
        How many runs are in each row of the sweep.
    jobs
        How many processes; -1 for one per core.
    quick
        Coarse grids and short runs, to see that it works.
    json
        Print one JSON object.
    """
    from slalom.reproduce import work

    names, effort = work.names_of(name), work.Effort(seeds, jobs, quick)
    _writable(page)
    with _progress("reproducing") as advance, _writing(out):
        written = work.make(names, out, effort, at=page, progress=advance)
    result = {**effort._asdict(), "entries": names, "files": [str(path) for path in written]}
    _print(result, json, lambda: files_text(result))
    return DONE


def parse_settings(settings: Sequence[str] | None) -> dict[str, float]:
    """NAME=VALUE pairs as a mapping. Raises InvalidInput for anything else."""
    parsed: dict[str, float] = {}
    for setting in settings or ():
        name, equals, value = setting.partition("=")
        try:
            parsed[name] = float(value)
        except ValueError:
            equals = ""
        if not name or not equals:
            raise InvalidInput(f"--set: expected NAME=NUMBER, found {setting!r}")
    return parsed


def _check_suffix(figure: Path | None) -> None:
    """Refuse a figure that could not be saved before the work is done, not after."""
    if figure is not None and figure.suffix not in (".svg", ".pdf", ".png"):
        raise InvalidInput(f"--figure: expected a file that ends in .svg, .pdf or .png, found {str(figure)!r}")
    _writable(figure)


def _writable(path: Path | None) -> None:
    """Refuse a folder that is not there before the work is done."""
    if path is not None and not path.parent.is_dir():
        raise InvalidInput(f"{path}: expected a file in a folder that exists, found no folder {str(path.parent)!r}")


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """What the system says when a file cannot be written, as one message of ours."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise InvalidFile([f"{path}: expected a file that can be written, found {reason}"]) from None


@contextmanager
def _progress(what: str) -> Iterator[Callable[[float], None]]:
    """A progress bar on stderr when that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda share: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def _print(result: dict[str, Any], as_json: bool, text: Callable[[], str]) -> None:
    from json import dumps

    print(dumps(result, allow_nan=False) if as_json else text())
