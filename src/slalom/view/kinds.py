"""Words for controls: name, letter, unit, and description of the response."""

from typing import NamedTuple

from slalom.response import (
    AccelerateThenBrake,
    AccelerateThenCoast,
    AccelerateThenStop,
    Acceleration,
    Jerk,
    LaggedVelocity,
    Response,
    Velocity,
)
from slalom.response.sequence import AccelerationSequence


class Kind(NamedTuple):
    """Kind of a control: name, letter, unit, and description of the response."""

    name: str
    letter: str
    unit: str
    description: str


def kind(response: Response) -> Kind:
    """Return the kind of the controls of `response`."""
    match response:
        case Velocity():
            words = f"reached in {response.ramp:g} s" if response.ramp else "reached at once"
            return Kind("velocity", "v", "m/s", words)
        case LaggedVelocity():
            return Kind("velocity", "v", "m/s", f"approached with lag {response.lag:.3g} s")
        case Acceleration():
            return Kind("acceleration", "a", "m/s²", "held")
        case AccelerateThenCoast():
            return Kind("acceleration", "a", "m/s²", f"held {response.hold:.3g} s, then coasting")
        case AccelerateThenBrake() | AccelerateThenStop():
            return Kind("acceleration", "a", "m/s²", f"held {response.hold:.3g} s, then braking")
        case AccelerationSequence():
            more = f"then {len(response.then)} more" if response.then else "then coasting"
            return Kind("acceleration", "a", "m/s²", f"held {response.hold:.3g} s, {more}")
        case Jerk():
            return Kind("jerk", "j", "m/s³", "held")
        case _:
            return Kind("control", "u", "control", type(response).__name__)
