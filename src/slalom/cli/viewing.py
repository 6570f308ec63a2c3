"""`slalom view`, `slalom export` and `slalom animate`."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from slalom.base.errors import Extra, InvalidInput
from slalom.cli.console import (
    DONE,
    Flag,
    OldForce,
    Settings,
    Whole,
    parse_settings,
    print_line,
    print_message,
    progress,
    resolved,
    writable,
)
from slalom.cli.options import Crossing, Reading, WallsFile, given_options, is_recording, scenario_of, tracks_of
from slalom.cli.running import DEFAULT_METHOD, RECORDING_METHOD, is_run, print_notes

if TYPE_CHECKING:
    from slalom.decision.methods import Method
    from slalom.live.session import Session
    from slalom.sim import Recording


def view(
    scenario: str = "roundabout_crossing",
    beside: str | None = None,
    /,
    *,
    settings: Settings = None,
    method: str | None = None,
    seed: Whole = 0,
    at: float | None = None,
    agent: str | None = None,
    crossing: Crossing | None = None,
    reading: Reading | None = None,
    walls: WallsFile | None = None,
    port: Whole = 0,
    browser: bool = True,
) -> int:
    """Show a scenario, a run or a recording in the browser; everything can be dragged. Ctrl-C stops it.

    Runs and recordings are replayed; with --start and --goal a robot crosses a recording.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, a .yaml file, a run that `slalom run --out run.h5` wrote, a file that
        `Decision.dump` wrote, or a recording of a format from `slalom list formats`.
    beside
        Another one, which is shown beside the first one, at the same time since its start.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`, or NAME@FORESIGHT; by default nao, in recordings nao_ahead. A run is
        replayed; with a method or settings, its scenario is run again.
    seed
        Seed of random scenarios; the number of the case, from 0, of a file with cases.
    at
        In a recording: start time [s] of the robot or the replay, in the time of the recording; by default the first.
    agent
        In a recording: id of the agent that is replayed with its control space; by default that of the longest track.
    port
        Port of this machine at which the view is served; 0 for any free one.
    browser
        Whether to open the browser; with --no-browser only the address is printed.
    """
    source, given = resolved(scenario), parse_settings(settings)
    with Extra("view", "view"):
        from slalom.live.server import Server
    drawn = walls or WallsFile()
    begin = _sessions(source, given, method, seed, (at, agent), crossing, reading, drawn)
    second = None
    if beside is not None:
        second = _sessions(resolved(beside), given, method, seed, (at, agent), crossing, reading, drawn)
        second()
    server = Server(begin, begin().scenario.name, port, second)  # what cannot run is refused before the browser opens

    def started() -> None:
        print_line(server.address)
        print_message("Ctrl-C stops the view.")
        if not _has_display() or (browser and not _opened(server.address)):
            tunnel = f"ssh -L {server.port}:localhost:{server.port} HOST"
            print_message(f"No browser here. On another computer run `{tunnel}` with the name of this machine as HOST,")
            print_message("and open the address there.")

    server.run(started)
    return DONE


def _has_display() -> bool:
    """Return whether this process can open windows; over SSH it cannot, as a rule."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _opened(address: str) -> bool:
    """Open an address in the browser; return whether there is one."""
    import webbrowser

    return webbrowser.open(address)


def export(
    run: Path,
    page: Path,
    /,
    *,
    robot: Whole = 0,
    every: float | None = None,
    reading: Reading | None = None,
    walls: WallsFile | None = None,
    force: OldForce = False,
) -> int:
    """Write a run as one HTML file with a player, for any browser, without a server and without a network.

    Parameters
    ----------
    run
        A file that `slalom run --out run.h5` wrote, or a recording of a format from `slalom list formats`.
    page
        The file to write, .html; one that exists is replaced.
    robot
        The robot whose control space is in the file, from 0.
    every
        Time [s] between two control spaces; by default every decision of a short run, and at least two a second.
    """
    from slalom.live.recorded import export as write

    recording = _recording(run, reading, walls)
    writable(page)
    with progress("exporting") as advance:
        write(recording, page, robot=robot, interval=every, progress=advance)
    print_line(str(page))
    return DONE


def animate(
    run: Path,
    video: Path,
    /,
    *,
    width: Whole = 720,
    fps: float = 25.0,
    speed: float = 1.0,
    trail: float = 3.0,
    control_space: Flag = False,
    reading: Reading | None = None,
    walls: WallsFile | None = None,
    force: OldForce = False,
) -> int:
    """Write a video of a run: robots, obstacles, goals and trails in the workspace.

    Parameters
    ----------
    run
        A file that `slalom run --out run.h5` wrote, or a recording of a format from `slalom list formats`.
    video
        The file to write, .mp4 or .gif; one that exists is replaced.
    width
        Width [pixel] of the video, an even number from 320 to 3840; the height follows from the run.
    fps
        Pictures in a second of video [Hz].
    speed
        Seconds of the run in a second of video.
    trail
        Time [s] of the run behind each robot that is drawn as a line.
    control_space
        Draw the control space of the only robot beside the workspace, and the reason of each decision.
    """
    from slalom.view import animate as write
    from slalom.view.film import checked

    checked(video)
    recording = _recording(run, reading, walls)
    writable(video)
    with progress("animating") as advance:
        write(
            recording,
            video,
            width=width,
            fps=fps,
            speed=speed,
            trail=trail,
            control_space=control_space,
            progress=advance,
        )
    print_line(str(video))
    return DONE


def _recording(run: Path, reading: Reading | None = None, walls: WallsFile | None = None) -> "Recording":
    """The run of a file, or the agents of a recording as they moved; with walls."""
    from slalom.sim import Recording
    from slalom.sim.files.recorded_traffic import observed

    if run.suffix in (".yaml", ".yml"):
        raise InvalidInput(
            f"{run}: expected a run in an .h5 file, found a scenario; `slalom run {run} --out run.h5` runs it first"
        )
    source, drawn = resolved(str(run)), walls or WallsFile()
    if is_run(source):
        for option in (*given_options(reading), *(["walls"] if drawn.walls else [])):
            raise InvalidInput(f"--{option}: expected only with a recording, found it with the run {str(run)!r}")
        return Recording.load(source)
    found = drawn.added_to(tracks_of(source, reading, None))
    print_notes(found.notes)
    return observed(found)


def _sessions(
    name: str,
    settings: dict[str, float],
    method: str | None,
    seed: int,
    start: tuple[float | None, str | None],
    crossing: Crossing | None,
    reading: Reading | None,
    walls: WallsFile,
) -> Callable[[], "Session"]:
    """The beginning of a session of a name or a file: the replay of a run, or a run of a scenario."""
    from slalom.decision.methods import method as method_of
    from slalom.live.session import Session

    def chosen_or(default: str) -> "Method":
        return method_of(default if method is None else method)

    at, agent = start
    from slalom.sim.files.decision_file import is_decision

    if is_decision(name):
        options = {"--method": method, "--set": settings, "--at": at, "--agent": agent, "--walls": walls.walls}
        for option in (option for option, value in options.items() if value or value == 0.0):
            raise InvalidInput(f"{option}: expected none with the file of a decision, found {options[option]!r}")
        from slalom.live.recorded import of_file

        shown = of_file(name)
        return lambda: Session.of(shown, method_of(DEFAULT_METHOD))
    replayable, tracks = os.path.isfile(name) and is_run(name), False
    if not replayable:
        tracks = is_recording(name, reading, crossing)
    only_recorded = [*(["at"] if at is not None else []), *given_options(crossing), *given_options(reading)]
    if only_recorded and not tracks:
        raise InvalidInput(f"--{only_recorded[0]}: expected only with a recording, found it with {name!r}")
    alone = tracks and not [option for option in given_options(crossing) if option != "agent-radius"]
    if agent is not None and not alone:
        raise InvalidInput(f"--agent: expected only with a recording without --start and --goal, found {agent!r}")
    if alone:
        if settings:
            raise InvalidInput(f"--set: expected --start and --goal with a recording, found {next(iter(settings))!r}")
        from slalom.live.recorded import as_recorded

        replayed = as_recorded(walls.added_to(tracks_of(name, reading, crossing)), chosen_or(DEFAULT_METHOD), agent, at)
        return lambda: Session.of(replayed, method_of(DEFAULT_METHOD))
    if replayable:
        from slalom.sim.run.recorded import recorded

        found = recorded(_recording(Path(name)))
        if method is None and not settings and walls.walls is None:
            return lambda: Session.of(found, method_of(DEFAULT_METHOD))
        own = DEFAULT_METHOD if found.method is None else found.method.name
        loaded, chosen = found.scenario.with_settings(settings), chosen_or(own)
    elif tracks:
        loaded = scenario_of(name, reading, crossing, at).with_settings(settings)
        chosen = chosen_or(RECORDING_METHOD)
    else:
        from slalom.sim import load

        loaded, chosen = load(name, settings, seed=seed), chosen_or(DEFAULT_METHOD)
    loaded = walls.added_to(loaded)
    return lambda: Session(loaded, chosen)
