"""`slalom reproduce`."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Group, Parameter

from slalom.adapters.ros.settings import NodeSettings
from slalom.base.extras import Extra
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
    writing,
)
from slalom.cli.recorded import Look, SignedText, VectorLook, drawable, refuse_without
from slalom.cli.report import files_text


def reproduce(
    *names: str,
    out: Path = Path("out/paper"),
    page: Path | None = None,
    seeds: Whole = 100,
    jobs: Whole = 2,
    quick: Flag = False,
    force: Flag = False,
    look: VectorLook | None = None,
    json: Flag = False,
) -> int:
    """Draw the figures of the paper and measure its claims; all of them, or those named. All take 6 to 8 minutes.

    Parameters
    ----------
    names
        Figures and claims from `slalom list figures`.
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
        from slalom.paper import work

    chosen, effort = work.names_of(names), work.Effort(seeds, jobs, quick)
    new_markdown(page, force)
    writable(page)
    begun: list[str] = []

    def begin(name: str) -> None:
        begun.append(name)
        if not json:
            print_message(f"{len(begun)} of {len(chosen)}: {name}")

    with progress("reproducing", estimated=False) as advance, writing(out):
        save = (look or VectorLook()).save
        written = work.make(chosen, out, effort, page_path=page, save=save, progress=advance, begin=begin)
    result = {**effort._asdict(), "entries": chosen, "files": [str(path) for path in written]}
    print_result(result, json, lambda: files_text(result))
    return DONE


# ---------------------------------------------------------------------------------------------------------------------
# `slalom compile`.


def compile_(
    *uses: Annotated[str, Parameter(help="robot, polygons, fleets, space, ahead, crowd, figures; all by default.")],
    jobs: Annotated[Whole, Parameter(help="Number of processes.")] = 2,
) -> None:
    """Compile all kernels, once after an installation; decisions after it compile nothing.

    Without it, the first use compiles the kernels that it needs. The result is kept on disk for this user. Each process
    loads kernels when it first uses them; `slalom.compile()` in Python loads all.
    """
    from slalom.base.checks import known, whole
    from slalom.precompile import USES, compile as compile_uses

    for name in uses:
        known(name, "uses", list(USES))
    whole(jobs, "jobs", 1)
    print_message("slalom: compiling, one to two minutes after an installation, seconds later on")
    compile_uses(*uses, jobs=jobs, progress=lambda name, seconds: print_message(f"{name}: {seconds:.1f} s"))


# ---------------------------------------------------------------------------------------------------------------------
# `slalom ros`: a node on recorded messages of ROS 2.


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
    from slalom.adapters.ros import bag as bags

    writable(out, figure)
    with progress("replaying") as advance:
        commands = bags.replay(bags.read_bag(bag, topics, advance), made)
    if out is not None:
        with writing(out):
            if out.suffix == ".csv":
                bags.write_table(commands, out)
            else:
                bags.write_bag(bags.as_sent(commands), out)
    if figure is not None:
        from slalom.adapters.ros.drive import figure as drawn

        (look or Look()).save(drawn(commands, made.navigator.robot), figure)
    result = {
        "bag": str(bag),
        "commands": len(commands),
        "unsafe": sum(not command.decision.safe for command in commands),
        "measurements not used": made.unused,
    }
    if expected is not None:
        twists = [each.message for each in bags.read_bag(bag, [expected])]
        result["commands that differ"] = bags.differences(commands, twists)
    print_result(result, json, lambda: "\n".join(f"{key:22} {value}" for key, value in result.items()))
    return FAILED if result.get("commands that differ") else DONE
