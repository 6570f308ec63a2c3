"""`slalom list`, `slalom reproduce`, `slalom compile` and `slalom ros`."""

import inspect
import itertools
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from cyclopts import App, Group, Parameter

from slalom.adapters.ros.shell import NodeSettings
from slalom.base.errors import Extra, InvalidInput
from slalom.base.writing import writing
from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Names,
    Whole,
    new_markdown,
    print_message,
    print_result,
    progress,
    vector_of,
    writable,
)
from slalom.cli.options import Look, SignedText, drawable, refuse_without
from slalom.cli.report import FORESIGHT_SENTENCES, files_text, list_text, with_values

Rows = dict[str, dict[str, Any]]


def list_(
    kind: Literal[
        "scenarios", "methods", "foresights", "metrics", "objectives", "formats", "figures", "samples", "keys"
    ]
    | None = None,
    part: str | None = None,
    /,
    *,
    json: Flag = False,
) -> int:
    """List scenarios, methods, foresights, metrics, objectives, formats of recordings, figures, sample files, and keys.

    Installed packages add scenarios, methods, metrics, objectives and formats by entry points.

    Parameters
    ----------
    kind
        List only entries of this kind. `keys` are those of scenario and study files, which are listed on request only.
    part
        With `keys`: list the keys of this part of a file with their values, as in `slalom list keys goal`.
    json
        Print one JSON object.
    """
    if part is not None and kind != "keys":
        raise InvalidInput(f"part: expected only with keys, found {part!r} with {kind}")
    if kind == "keys":
        from slalom.cli.file_keys import listed

        result = listed(part)
    else:
        result = {each: TABLES[each]() for each in TABLES if kind in (None, each)}
    print_result(result, json, lambda: list_text(result))
    return DONE


def _scenarios() -> Rows:
    from slalom.sim.gallery import GALLERY

    return {name: {"sentence": e.sentence, "parameters": dict(e.parameters)} for name, e in GALLERY.items()}


def _methods() -> Rows:
    from slalom.peers import CONTENDERS, Peer

    return {
        name: {
            "sentence": m.sentence,
            "source": m.source,
            "foresight": m.foresight,
            **({"parameters": m.parameters} if isinstance(m, Peer) else {}),
        }
        for name, m in CONTENDERS.items()
    }


def _foresights() -> Rows:
    from slalom.forecast.forecast import FORESIGHTS, foresight_of

    return {
        name: {"sentence": FORESIGHT_SENTENCES[name], "level": foresight_of(rule)} for name, rule in FORESIGHTS.items()
    }


def _metrics() -> Rows:
    from slalom.sim.measure.metrics import METRICS

    return {name: {"sentence": with_values(_first_line(metric))} for name, metric in METRICS.items()}


def _objectives() -> Rows:
    from slalom.decision.objective import OBJECTIVES

    return {name: {"sentence": _first_line(objective)} for name, objective in OBJECTIVES.items()}


def _formats() -> Rows:
    from slalom.io.formats import FORMATS

    return {name: {"sentence": f.sentence, "mark": f.mark, "suffix": f.suffix} for name, f in FORMATS.items()}


def _figures() -> Rows:
    from slalom.paper import TITLES

    return {name: {"sentence": f"{title}."} for name, title in TITLES.items()}


def _samples() -> Rows:
    from slalom.io.table import SAMPLES

    return {name: {"sentence": sentence} for name, sentence in SAMPLES.items()}


TABLES: Final[dict[str, Callable[[], Rows]]] = {
    "scenarios": _scenarios,
    "methods": _methods,
    "foresights": _foresights,
    "metrics": _metrics,
    "objectives": _objectives,
    "formats": _formats,
    "figures": _figures,
    "samples": _samples,
}
"""The lists, each imported on use."""


def _first_line(part: object) -> str:
    """The first line of the docstring of a function or class."""
    return (inspect.getdoc(part) or "").partition("\n")[0]


def reproduce(
    *names: str,
    out: Path = Path("out/paper"),
    page: Path | None = None,
    seeds: Whole = 100,
    jobs: Whole = 2,
    quick: Flag = False,
    force: Flag = False,
    look: Look | None = None,
    json: Flag = False,
) -> int:
    """Draw the figures of the paper and measure its claims; all of them, or those named. All take 6 to 8 minutes.

    Parameters
    ----------
    names
        Figures and claims from `slalom list figures`; NAME.pdf and NAME.png are the figure in that format.
    out
        Folder for NAME.svg of each figure and NAME.json of each claim; created if needed.
    page
        File for the page with captions and tables; by default paper.md in that folder.
    seeds
        Number of runs in each row of the sweep.
    jobs
        Number of processes; -1 for one per core. With one, all figures and claims take twice as long as with two.
    quick
        Use coarse grids and short runs, as a test of the command.
    force
        Replace a page of --page that exists.
    json
        Print one JSON object.
    """
    with Extra("view", "reproduce"):
        from slalom.paper import entries

    chosen, effort = entries.names_of(names), entries.Effort(seeds, jobs, quick)
    new_markdown(page, force)
    writable(page)
    begun: list[str] = []

    def begin(name: str) -> None:
        begun.append(name)
        if not json:
            print_message(f"{len(begun)} of {len(chosen)}: {name}")

    with progress("reproducing", estimated=False) as advance, writing(out):
        save = (look or Look()).save
        written = entries.make(names, out, effort, page_path=page, save=save, progress=advance, begin=begin)
    result = {**effort._asdict(), "entries": list(chosen), "files": [str(path) for path in written]}
    print_result(result, json, lambda: files_text(result))
    return DONE


def compile_(
    *uses: Annotated[
        str,
        Parameter(help="robot, polygons, fleets, space, vehicles, ahead, crowd, learners, figures; all by default."),
    ],
    jobs: Annotated[Whole | None, Parameter(help="Processes at a time; by default two on two cores.")] = None,
    export: Annotated[Path | None, Parameter(help="Then copy the compiled kernels into this folder.")] = None,
    import_: Annotated[Path | None, Parameter(name="--import", help="First take those of such a folder.")] = None,
) -> None:
    """Compile all kernels, once after an installation; decisions after it compile nothing.

    Without it, the first use compiles the kernels that it needs. The result is kept on disk for this user. Each process
    loads kernels when it first uses them; `slalom.compile()` in Python loads all. Machines with the same sources,
    Python, numba and kind of processor can use an exported folder, also unchanged: SLALOM_ENTRIES names such folders.
    """
    from slalom.base.checks import known, whole
    from slalom.computer import USES, compile_apart, export_entries, import_entries

    for name in uses:
        known(name, "uses", list(USES))
    jobs = min(os.cpu_count() or 1, 2) if jobs is None else whole(jobs, "jobs", 1)
    if import_ is not None:
        taken, damaged = import_entries(import_)
        print_message(f"slalom: {len(taken)} compiled kernels from {import_}")
        for path in damaged:
            print_message(f"slalom: {path} is damaged, it is compiled anew")
    print_message(
        "slalom: compiling, three minutes after an installation, seconds later on. "
        "A wheel with compiled kernels or --import needs none"
    )
    done, count = itertools.count(1), len(uses or USES)
    with progress("compile", estimated=False) as advance:

        def tell(name: str, seconds: float) -> None:
            k = next(done)
            advance(k / count)
            if not sys.stderr.isatty():
                print_message(f"{k} of {count}, {name}: {seconds:.1f} s")

        compile_apart(*uses, jobs=jobs, progress=tell)
    if export is not None:
        print_message(f"slalom: {len(export_entries(export))} compiled kernels in {export}")


ros = App(name="ros", help="Decide from messages of ROS 2, without ROS.", help_format="plaintext")
ROBOT = Parameter(name="*", group=Group("Robot and messages", sort_key=1))


@ros.command(help_format="markdown")
def replay(
    bag: Path,
    /,
    *,
    out: Path | None = None,
    figure: Path | None = None,
    goal: SignedText = None,
    topics: Names = None,
    ignore: Names = None,
    expected: str | None = None,
    look: Look | None = None,
    json: Flag = False,
    node: Annotated[NodeSettings, ROBOT] = NodeSettings(),  # noqa: B008  # it is frozen
) -> int:
    """Decide from the messages of a bag and write the commands; exit code 1 if they differ from the expected ones.

    Parameters
    ----------
    bag
        A bag of ROS 2 with odometry, and with messages that a node uses: obstacles, a map, a goal or a path,
        transforms.
    out
        Write the commands to this .csv file, or as geometry_msgs/Twist on /cmd_vel to a new bag of this name.
    figure
        Draw the drive to this .svg, .pdf or .png file.
    goal
        Goal X,Y [m] in the fixed frame, until the bag has another.
    topics
        Topics to read; by default all of a kind that a node uses.
    ignore
        Topics not to read: a bag with obstacles of another kind is refused without.
    expected
        A topic of the bag with geometry_msgs/Twist, with which the commands are compared to the bit.
    json
        Print one JSON object.
    """
    drawable(figure)
    refuse_without(figure, look)
    made = node.node()
    if goal is not None:
        from slalom import Goal, Stationary

        made.head_for(Goal(Stationary(vector_of(goal, "--goal")), made.tolerance, made.stop))
    with Extra("ros", "ros"):
        import rosbags.highlevel  # noqa: F401
    from slalom.adapters.ros import topics as bags

    writable(out, figure)
    with progress("replaying") as advance:
        commands = bags.replay(bags.read_bag(bag, topics, advance, ignore or ()), made)
    if out is not None:
        if out.suffix == ".csv":
            bags.write_table(commands, out)
        else:
            bags.write_bag(bags.as_sent(commands), out)
    if figure is not None:
        (look or Look()).save(bags.figure(commands, made.driver.navigator.robot), figure)
    result = {
        "bag": str(bag),
        "commands": len(commands),
        "unsafe": sum(not command.decision.safe for command in commands),
        "without messages": sum(command.status.name in ("NO_STATE", "NO_DETECTIONS") for command in commands),
        "inputs not used": made.unused.total(),
    }
    if expected is not None:
        twists = [each.message for each in bags.read_bag(bag, [expected])]
        result["commands that differ"] = bags.differences(commands, twists)
    print_result(result, json, lambda: "\n".join(f"{key:22} {value}" for key, value in result.items()))
    return FAILED if result.get("commands that differ") else DONE
