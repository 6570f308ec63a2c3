"""`slalom ros`: a node on recorded messages of ROS 2."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Group, Parameter

from slalom.adapters.ros.settings import NodeSettings
from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Names,
    print_result,
    progress,
    vector_of,
    writable,
    writing,
)
from slalom.cli.drawing import Look, drawable, refuse_without
from slalom.cli.recorded import SignedText
from slalom.cli.viewing import NEEDED
from slalom.errors import InvalidInput

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
    try:
        import rosbags.highlevel  # noqa: F401
    except ModuleNotFoundError as error:
        raise InvalidInput(f"ros: {NEEDED.format(extra='ros', name=error.name)}") from None
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
