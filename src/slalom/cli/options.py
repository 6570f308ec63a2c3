"""Options that several commands share: reading of recordings, a robot in a recording, and figures."""

import os
import re
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar

from cyclopts import Group, Parameter

from slalom.base.errors import InvalidInput
from slalom.cli.console import Flag, Names, vector_of

if TYPE_CHECKING:
    from slalom.sim import Scenario
    from slalom.sim.files.recorded_traffic import AgentSelection, Recorded

SignedText = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
READING = Group("Reading a recording", help="Formats: `slalom list formats`.", sort_key=2)
CROSSING = Group("Robot in a recording", help="Only if SCENARIO is a recording.", sort_key=1)


@Parameter(name="*", group=READING)
@dataclass(frozen=True, kw_only=True)
class Reading:
    """Options for reading a recording.

    Parameters
    ----------
    format
        Name of the format; by default recognised from the file.
    agents
        Read only the agents with these ids, separated by commas.
    without
        Leave out the agents with these ids, separated by commas.
    gap
        Split a track where its agent has no row for longer than this [s], inf: never; by default where the motion over
        a gap is not the agent's own, as where ids are used again.
    jump_speed
        Refuse an agent that is faster than this [m/s] between two rows; by default no limit.
    interpolation
        Interpolation between rows: linear, or smooth (by default).
    keep
        Read the first or the last of several rows of an agent at one time; by default they are refused.
    frame_rate
        Frame rate [Hz] of a format with frame numbers, if the file states none.
    unit
        Unit of lengths, m, cm, mm, km, ft or a number [m], such as 0.04 for pixels; by default as the file states.
    time_unit
        Unit of times, s, ms, us, ns, min or h; by default as the file states.
    columns
        FIELD=COLUMN of a table, separated by commas, with FIELD one of t, frame, id, x, y, z, latitude, longitude,
        altitude, radius, length, width, kind. A column is a name, a number from 1, or a sum such as left+0.5*w or -z.
        FIELD= ignores a field; id= is one agent.
    encoding
        Encoding of a table; by default UTF-8 or UTF-16, else Latin-1.
    case
        The case_id to read from an INTERACTION file of several cases.
    origin
        LATITUDE,LONGITUDE[,ALTITUDE] [degree, m] of x = y = 0; by default the mean position.
    epoch
        Time 0 of dates, in seconds or ISO 8601; by default the first time of the file.
    altitude_unit
        Unit [m] of the altitude column, 0.3048 for feet.
    """

    format: str | None = None
    agents: SignedText = None
    without: SignedText = None
    gap: float | None = None
    jump_speed: float | None = None
    interpolation: Literal["linear", "smooth"] | None = None
    keep: Literal["first", "last"] | None = None
    frame_rate: float | None = None
    unit: str | None = None
    time_unit: str | None = None
    columns: Names = None
    encoding: str | None = None
    case: float | None = None
    origin: SignedText = None
    epoch: SignedText = None
    altitude_unit: float | None = None

    def settings(self) -> dict[str, Any]:
        """Return the keyword arguments of `io.formats.read_recording`."""
        from slalom.sim.files.schema import number_or_text

        names = (
            "format",
            "gap",
            "interpolation",
            "keep",
            "frame_rate",
            "time_unit",
            "encoding",
            "case",
            "altitude_unit",
        )
        values: dict[str, Any] = {name: getattr(self, name) for name in names}
        values["unit"] = None if self.unit is None else number_or_text(self.unit)
        values["max_speed"] = self.jump_speed
        values["columns"] = None if self.columns is None else _columns(self.columns)
        values["origin"] = None if self.origin is None else vector_of(self.origin, "--origin")
        values["epoch"] = None if self.epoch is None else number_or_text(self.epoch)
        return {name: value for name, value in values.items() if value is not None}

    def agent_selection(self, radius: float | None = None) -> "AgentSelection":
        """Return the selection of agents, with `radius` [m] for agents without a size in the file."""
        from slalom.sim.files.recorded_traffic import AgentSelection

        return AgentSelection(radius, None if self.agents is None else _ids(self.agents), _ids(self.without or ""))


@Parameter(name="*", group=CROSSING)
@dataclass(frozen=True, kw_only=True)
class Crossing:
    """Options of a robot in a recording.

    Parameters
    ----------
    start
        Initial position X,Y[,Z] [m] of the robot.
    goal
        Goal X,Y[,Z] [m] of the robot.
    start_velocity
        Initial velocity VX,VY[,VZ] [m/s]; by default 0.
    duration
        Time limit [s] of the run; by default until the recording ends, but at most 60.
    tolerance
        Distance [m] to the goal at which the robot has arrived; by default 0.5.
    robot_radius
        Radius [m] of the robot, a disc or, in space, a ball; by default 0.3.
    speed
        Maximum speed [m/s] of the robot; by default 1.6.
    acceleration
        Maximum acceleration [m/s^2] of the robot; by default 1.5.
    agent_radius
        Radius [m] of agents without a radius in the file. By default half the diagonal of length and width, else that
        of their kind: 0.25 pedestrians, 0.95 bicycles, 1.2 motorcycles, 2.4 cars, 3 vans, 6.2 trucks and buses, 50
        ships, 30 aircraft, 0.3 drones. An agent of unknown kind is treated as a pedestrian or, in space, as a drone.
    """

    start: SignedText = None
    goal: SignedText = None
    start_velocity: SignedText = None
    duration: float | None = None
    tolerance: float | None = None
    robot_radius: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    agent_radius: float | None = None


W = TypeVar("W", "Scenario", "Recorded")


@Parameter(name="*", group=Group("Walls", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class WallsFile:
    """Options of walls.

    Parameters
    ----------
    walls
        Add the walls of this .wkt, .geojson, .dxf, .svg, .map (MovingAI), .yaml (nav2) or .sqlite (JuPedSim) file.
    walls_unit
        Unit of the file, m, cm, mm, km, ft or a number [m]; by default as the file states, else m.
    walls_up
        Turn a drawing in SVG, whose y points down, so that it looks as in its viewer.
    """

    walls: Path | None = None
    walls_unit: str | None = None
    walls_up: Flag = False

    def added_to(self, found: W) -> W:
        """Return a scenario or a recording with the walls. Raises as `io.walls.read_walls`."""
        from slalom.io.walls import Walls, read_walls
        from slalom.sim.files.schema import number_or_text

        if self.walls is None:
            for name, given in (("unit", self.walls_unit), ("up", self.walls_up or None)):
                if given is not None:
                    raise InvalidInput(f"--walls-{name}: expected only with --walls, found {given!r}")
            return found
        unit = None if self.walls_unit is None else number_or_text(self.walls_unit)
        try:
            added: Walls = read_walls(self.walls, unit, up=self.walls_up)
        except InvalidInput as error:
            raise InvalidInput(f"--walls-{error}") from None
        changed: Any = {"obstacles": (*found.obstacles, *added.obstacles), "notes": (*found.notes, *added.notes)}
        return replace(found, **changed)


def is_recording(scenario: str, reading: Reading | None, crossing: Crossing | None) -> bool:
    """Return whether `scenario` is a recording: a file that is not a scenario file, and no name of the gallery.

    Raises:
        InvalidInput: options of recordings with a scenario file or a name of the gallery.
    """
    from slalom.sim.gallery import GALLERY
    from slalom.sim.sweep.case import is_file
    from slalom.sim.sweep.script import is_script

    given = [*given_options(crossing), *given_options(reading)]
    if not is_file(scenario) and not is_script(scenario) and scenario not in GALLERY:
        return bool(os.path.isfile(scenario) or Path(scenario).suffix or given)
    if given:
        raise InvalidInput(f"--{given[0]}: expected only with a recording, found it with {scenario!r}")
    return False


def scenario_of(path: str, reading: Reading | None, crossing: Crossing | None, at: float | None) -> "Scenario":
    """Build the scenario of a robot in a recording, which starts at time `at` [s] of the recording."""
    from slalom.sim.files.recorded_traffic import crossing as crossing_of

    options = crossing or Crossing()
    found = tracks_of(path, reading, crossing)
    if options.start is None or options.goal is None:
        option = "--start" if options.start is None else "--goal"
        raise InvalidInput(f"{option}: expected X,Y[,Z] [m] for a robot in {path}, found none")
    velocity = None if options.start_velocity is None else vector_of(options.start_velocity, "--start-velocity")
    parameters = {
        "radius": options.robot_radius,
        "max_speed": options.speed,
        "max_acceleration": options.acceleration,
        "tolerance": options.tolerance,
        "duration": options.duration,
    }
    return crossing_of(
        found,
        vector_of(options.start, "--start"),
        vector_of(options.goal, "--goal"),
        at=at,
        velocity=velocity,
        **{name: value for name, value in parameters.items() if value is not None},
    )


def tracks_of(path: str, reading: Reading | None, crossing: Crossing | None) -> "Recorded":
    """Read the agents of a recording."""
    from slalom.sim.files.recorded_traffic import read_recorded

    read, options = reading or Reading(), crossing or Crossing()
    return read_recorded(path, read.agent_selection(options.agent_radius), **read.settings())


def given_options(options: Reading | Crossing | None) -> list[str]:
    """Return the names of the options that were given, without the leading dashes."""
    if options is None:
        return []
    return [item.name.replace("_", "-") for item in fields(options) if getattr(options, item.name) is not None]


def _ids(text: str) -> list[str]:
    return [label.strip() for label in text.split(",") if label.strip()]


def _columns(pairs: list[str]) -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for pair in re.split(r",(?=\w+=)", ",".join(pairs)):
        field, equals, column = pair.partition("=")
        if not field or not equals:
            raise InvalidInput(f"--columns: expected FIELD=COLUMN, found {pair!r}")
        found[field] = column or None
    return found


GROUP = Group("How figures look", sort_key=2)
FORMATS = (".svg", ".pdf", ".png")
OPTIONS = {"width": "--figure-width", "resolution": "--resolution"}
"""Options of the arguments of the functions that size and write figures, for messages."""


RESOLUTION: Final = 300.0
"""Dots per inch, by default."""


@Parameter(name="*", group=GROUP)
@dataclass(frozen=True, kw_only=True)
class Look:
    """Size and text of figures."""

    figure_width: Annotated[
        float | None,
        Parameter(
            help="Width [inch]; by default that of a page or of a column of a journal. Panels keep their shapes."
        ),
    ] = None
    font_scale: Annotated[float, Parameter(help="Factor of all sizes of text.")] = 1.0
    resolution: Annotated[float, Parameter(help="Dots per inch of .png files.")] = RESOLUTION

    def __post_init__(self) -> None:
        from slalom.base.checks import positive

        for item in fields(self):
            if getattr(self, item.name) is not None:
                positive(getattr(self, item.name), f"--{item.name.replace('_', '-')}")

    def save(self, figure: Any, path: Path) -> Path:
        """Write a figure in this look. Raises InvalidInput for a width without space, InvalidFile as `view.save`."""
        from slalom import view

        try:
            shown = view.resized(figure, width=self.figure_width, font_scale=self.font_scale)
            return view.save(shown, path, resolution=self.resolution)
        except InvalidInput as error:
            name, _, text = str(error).partition(":")
            raise InvalidInput(f"{OPTIONS.get(name, name)}:{text}") from None


def drawable(figure: Path | None, option: str = "--figure") -> None:
    """Raise InvalidInput for a figure file of a format that cannot be drawn."""
    if figure is not None and figure.suffix not in FORMATS:
        raise InvalidInput(f"{option}: expected a file that ends in .svg, .pdf or .png, found {str(figure)!r}")


def refuse_without(figure: Path | None, look: Look | None, **options: object) -> None:
    """Raise InvalidInput for options of a figure that is not drawn: those that are not None or False."""
    if figure is not None:
        return
    looks = [] if look is None else [item.name for item in fields(look) if getattr(look, item.name) != item.default]
    given = [name for name, value in options.items() if value is not None and value is not False]
    for name in [*given, *looks]:
        raise InvalidInput(f"--{name.replace('_', '-')}: expected only with --figure, found it without")
