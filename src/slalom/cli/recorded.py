"""The options of commands that read recordings."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from slalom.cli.console import Names, vector_of
from slalom.errors import InvalidInput

if TYPE_CHECKING:
    from slalom.sim import Scenario
    from slalom.sim.files.recorded_traffic import AgentSelection

Place = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
READING = Group("How a recording is read", help="Formats: `slalom list formats`.", sort_key=2)
CROSSING = Group("A robot in a recording", help="Only where SCENARIO is a recording.", sort_key=1)


@Parameter(name="*", group=READING)
@dataclass(frozen=True, kw_only=True)
class Reading:
    """How a recording is read.

    Parameters
    ----------
    format
        Name of the format; by default recognised from the file.
    agents
        Only these ids, with commas between.
    without
        All but these ids, with commas between.
    gap
        Split a track where its agent has no row for longer than this [s]; by default never.
    jump_speed
        An agent that is faster than this [m/s] from one row to the next has jumped: refused; by default none.
    interpolation
        Between rows: linear, or smooth, by default.
    frame_rate
        [Hz] of formats that count frames, where the file does not say.
    unit
        m or cm, of PedPy's text where the file does not say.
    case
        The case_id to read of an INTERACTION file of many.
    columns
        WHAT=COLUMN for ships and aircraft, WHAT one of time, id, latitude, longitude, altitude, length, width, kind;
        WHAT= for one that is not to be read; may be repeated.
    origin
        LATITUDE,LONGITUDE[,ALTITUDE] [degree, m] of x = y = 0; by default the mean place.
    epoch
        Time 0 of ships and aircraft, in seconds or ISO 8601; by default the first.
    altitude_unit
        [m] of the column of altitudes, 0.3048 for feet.
    """

    format: str | None = None
    agents: Place = None
    without: Place = None
    gap: float | None = None
    jump_speed: float | None = None
    interpolation: Literal["linear", "smooth"] | None = None
    frame_rate: float | None = None
    unit: Literal["m", "cm"] | None = None
    case: float | None = None
    columns: Names = None
    origin: Place = None
    epoch: Place = None
    altitude_unit: float | None = None

    def settings(self) -> dict[str, Any]:
        """What `io.formats.read_recording` is to be told besides the path."""
        from slalom.sim.files.schema_recording import number_or_text

        names = ("format", "gap", "interpolation", "frame_rate", "unit", "case", "altitude_unit")
        told: dict[str, Any] = {name: getattr(self, name) for name in names}
        told["max_speed"] = self.jump_speed
        told["columns"] = None if self.columns is None else _columns(self.columns)
        told["origin"] = None if self.origin is None else vector_of(self.origin, "--origin")
        told["epoch"] = None if self.epoch is None else number_or_text(self.epoch)
        return {name: value for name, value in told.items() if value is not None}

    def who(self, radius: float | None = None) -> "AgentSelection":
        """Whom to choose, and how large [m] those are of which the file does not say it."""
        from slalom.sim.files.recorded_traffic import AgentSelection

        return AgentSelection(
            radius, None if self.agents is None else _listed(self.agents), _listed(self.without or "")
        )


@Parameter(name="*", group=CROSSING)
@dataclass(frozen=True, kw_only=True)
class Crossing:
    """One robot in a recording.

    Parameters
    ----------
    start
        X,Y[,Z] where the robot starts [m].
    goal
        X,Y[,Z] where it wants to [m].
    start_velocity
        VX,VY[,VZ] at the start [m/s]; by default 0.
    duration
        [s] after which it has failed; by default until the recording ends, but at most 60.
    tolerance
        [m] How near to the goal it has arrived; by default 0.5.
    robot_radius
        [m] Of the disc or, in space, the ball that it is; by default 0.3.
    speed
        [m/s] Its largest; by default 1.6.
    acceleration
        [m/s^2] Its largest; by default 1.5.
    agent_radius
        [m] Of agents of which the file says none. By default half the diagonal of length and width, else that of
        their kind: 0.25 pedestrians, 0.95 bicycles, 1.2 motorcycles, 2.4 cars, 3 vans, 6.2 trucks and buses, 50 ships,
        30 aircraft, 0.3 drones. Of no known kind they are taken for pedestrians or, in space, for drones.
    """

    start: Place = None
    goal: Place = None
    start_velocity: Place = None
    duration: float | None = None
    tolerance: float | None = None
    robot_radius: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    agent_radius: float | None = None


def is_recording(scenario: str, reading: Reading | None, crossing: Crossing | None) -> bool:
    """Whether what is to be run is a recording: neither a scenario file nor of the gallery, but a file.

    Raises:
        InvalidInput: options of recordings with something else.
    """
    from slalom.sim.gallery import GALLERY
    from slalom.sim.sweep.case import is_file

    given = [*_given(crossing), *_given(reading)]
    if not is_file(scenario) and scenario not in GALLERY:
        return bool(Path(scenario).is_file() or Path(scenario).suffix or given)
    if given:
        raise InvalidInput(f"--{given[0]}: expected only with a recording, found it with {scenario!r}")
    return False


def scenario_of(path: str, reading: Reading | None, crossing: Crossing | None, at: float | None) -> "Scenario":
    """The scenario of a robot in a recording."""
    from slalom.sim.files.recorded_traffic import crossing as crossing_of, read_recorded

    read, asked = reading or Reading(), crossing or Crossing()
    found = read_recorded(path, read.who(asked.agent_radius), **read.settings())
    if asked.start is None or asked.goal is None:
        what = "--start" if asked.start is None else "--goal"
        raise InvalidInput(f"{what}: expected X,Y[,Z] [m] for a robot in {path}, found none")
    velocity = None if asked.start_velocity is None else vector_of(asked.start_velocity, "--start-velocity")
    told = {
        "radius": asked.robot_radius,
        "max_speed": asked.speed,
        "max_acceleration": asked.acceleration,
        "tolerance": asked.tolerance,
        "duration": asked.duration,
    }
    return crossing_of(
        found,
        vector_of(asked.start, "--start"),
        vector_of(asked.goal, "--goal"),
        at=at,
        velocity=velocity,
        **{name: value for name, value in told.items() if value is not None},
    )


def _given(options: Reading | Crossing | None) -> list[str]:
    """The options that were given, as they are written."""
    if options is None:
        return []
    return [item.name.replace("_", "-") for item in fields(options) if getattr(options, item.name) is not None]


def _listed(text: str) -> list[str]:
    return [label.strip() for label in text.split(",") if label.strip()]


def _columns(pairs: list[str]) -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for pair in pairs:
        what, equals, column = pair.partition("=")
        if not what or not equals:
            raise InvalidInput(f"--columns: expected WHAT=COLUMN, found {pair!r}")
        found[what] = column or None
    return found
