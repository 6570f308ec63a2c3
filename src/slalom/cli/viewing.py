"""`slalom view` and `slalom export`."""

from pathlib import Path
from typing import TYPE_CHECKING

from slalom.cli.console import (
    DONE,
    Settings,
    parse_settings,
    print_line,
    print_message,
    progress,
    resolved,
    writable,
    writing,
)
from slalom.cli.recorded import Crossing, Reading, is_recording, scenario_of
from slalom.cli.running import DEFAULT_METHOD, RECORDING_METHOD, RUNS
from slalom.errors import InvalidInput

if TYPE_CHECKING:
    from slalom.sim import Recording, Scenario

NEEDED = "expected the packages of `pip install slalom[{extra}]`, found no {name}"


def view(
    scenario: str = "roundabout_crossing",
    /,
    *,
    settings: Settings = None,
    method: str | None = None,
    seed: int = 0,
    at: float | None = None,
    crossing: Crossing | None = None,
    reading: Reading | None = None,
    browser: bool = True,
) -> int:
    """Show a scenario, a run or a robot in a recording in the browser; everything can be dragged. Ctrl-C stops it.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, a .yaml file, a run that `slalom run --out run.h5` wrote, or a recording
        of a format from `slalom list formats`.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT; by default that of the run, else nao, in recordings
        nao_ahead.
    seed
        Seed of random scenarios.
    at
        In a recording: start time [s] of the robot, in the time of the recording; by default the first time.
    browser
        Whether to open the browser; with --no-browser only the address is printed.
    """
    loaded, name = _loaded(resolved(scenario), parse_settings(settings), method, seed, at, crossing, reading)
    from slalom.methods import method as method_of

    chosen = method_of(name)
    try:
        from slalom.live.server import Server
    except ModuleNotFoundError as error:
        raise InvalidInput(f"view: {NEEDED.format(extra='view', name=error.name)}") from None
    from slalom.live.session import Session

    Session(loaded, chosen)  # refuses what cannot run before the browser opens
    server = Server(lambda: Session(loaded, chosen), loaded.name)

    def started() -> None:
        print_line(server.address)
        print_message("Ctrl-C stops the view.")
        if browser:
            import webbrowser

            webbrowser.open(server.address)

    server.run(started)
    return DONE


def export(run: Path, page: Path, /, *, robot: int = 0, every: float | None = None) -> int:
    """Write a run as one HTML file that shows itself in any browser, without a server and without a network.

    Parameters
    ----------
    run
        A file that `slalom run --out run.h5` wrote.
    page
        The file to write, .html.
    robot
        The robot whose control space is in the file, from 0.
    every
        Time [s] between two control spaces; by default every decision of a short run, and at least two a second.
    """
    from slalom.live.export import export as write

    recording = _recording(run)
    writable(page)
    with progress("exporting") as advance, writing(page):
        write(recording, page, robot=robot, interval=every, progress=advance)
    print_line(str(page))
    return DONE


def _recording(run: Path) -> "Recording":
    from slalom.sim import Recording

    return Recording.load(run)


def _loaded(
    name: str,
    settings: dict[str, float],
    method: str | None,
    seed: int,
    at: float | None,
    crossing: Crossing | None,
    reading: Reading | None,
) -> tuple["Scenario", str]:
    """The scenario of a name or a file, and the name of the method."""
    if Path(name).suffix in RUNS and Path(name).is_file():
        from slalom.live.recorded import recorded
        from slalom.sim import Recording

        found = recorded(Recording.load(name))
        own = DEFAULT_METHOD if found.method is None else found.method.name
        return found.scenario.with_settings(settings), method or own
    if is_recording(name, reading, crossing):
        return scenario_of(name, reading, crossing, at).with_settings(settings), method or RECORDING_METHOD
    from slalom.sim import load

    return load(name, settings, seed=seed), method or DEFAULT_METHOD
