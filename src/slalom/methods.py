"""The table of methods: a method is a response and a forecast."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

from slalom.checks import known, positive
from slalom.forecast import (
    FORESIGHTS,
    AcceleratingBriefly,
    AtConstantAcceleration,
    AtConstantVelocity,
    Forecast,
    Known,
    foresight_of,
)
from slalom.limits import Limits
from slalom.response import (
    AccelerateThenBrake,
    AccelerateThenCoast,
    AccelerateThenStop,
    LaggedVelocity,
    Response,
    Velocity,
)

HOLDS: Final = (0.2, 0.5, 1.0, 2.0, 4.0)
"""[s] How long accelerations are held when nothing else is asked for; see docs/design/0004."""

Responses = Callable[[Limits, float, tuple[float, ...]], tuple[Response, ...]]


@dataclass(frozen=True)
class Method:
    """A row of the table: how controls move the robot, and how obstacles are assumed to move.

    Attributes:
        name: what the command line calls it.
        responses: from limits, control period [s] and holds [s] to the responses tried at each decision.
        forecast: from an obstacle's trajectory to the assumed one.
        sentence: what it is. source: where it comes from.
        of_robots: the same for other robots, of which only the state now can be seen.
        among: the responses of robots that meet each other, where they are others.
        share: how much of the avoidance between robots each does itself, above 0 and at most 1: as the others do their
            part, the change of the control u from the present one is tested 1 / share as large (with 1/2 and velocities
            the reciprocal velocity obstacle of van den Berg, Lin and Manocha, ICRA 2008).
        regain: [s] within which robots that only see each other restore what they have lost of the margin between them,
            above 0; None: not to lose more is enough. Discs and balls with goals at rest share and regain; robots of
            other shapes avoid in full.
        ahead: whether a robot alone looks ahead over sequences of accelerations (`lookahead.LookAhead`).
        shared: robots know the manoeuvres that the others are committed to, and decide one after the other.
    """

    name: str
    responses: Responses
    forecast: Forecast
    sentence: str
    source: str
    robot_forecast: Forecast = field(default_factory=AtConstantVelocity)
    responses_among: Responses | None = None
    share: float = 1.0
    regain: float | None = None
    shared: bool = False
    looks_ahead: bool = False

    @property
    def foresight(self) -> str:
        """What it knows of obstacles: recorded, present or observed (see `forecast.FORESIGHTS`)."""
        return foresight_of(self.forecast)

    @property
    def foresight_among(self) -> str:
        """What robots that meet each other know of each other: published manoeuvres, or what is observed."""
        return "published" if self.shared else foresight_of(self.robot_forecast)

    def seeing(self, foresight: str) -> "Method":
        """The method with another level of foresight. Raises InvalidInput for one that there is not."""
        forecast = FORESIGHTS[known(foresight, "foresight", list(FORESIGHTS))]
        return replace(self, name=f"{self.name.partition('@')[0]}@{foresight}", forecast=forecast)

    def among_robots(self) -> "Method":
        """The method of robots that meet each other."""
        return self if self.responses_among is None else replace(self, responses=self.responses_among)


def _velocity(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    return (Velocity(ramp=period),)


def _lagged(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    return (LaggedVelocity(lag=limits.max_speed / limits.max_acceleration),)


def _acceleration(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    rounded = sorted({max(1, round(positive(hold, "hold") / period)) * period for hold in holds})
    rate = min(limits.braking / limits.max_speed, 0.5 / period)
    coasting = [AccelerateThenCoast(hold) for hold in rounded]
    stopping = [AccelerateThenStop(hold, rate, period) for hold in rounded]
    return (*coasting, *stopping)


def _braking(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    """As `_acceleration`, but the stops have an end, and few pieces: there are many robots to be tested against."""
    coasting = [r for r in _acceleration(limits, period, holds) if isinstance(r, AccelerateThenCoast)]
    return (*coasting, *_ending_at_rest(limits, period, holds)[:-1])


def _ending_at_rest(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    """Braking takes a whole number of periods, enough to brake from the largest speed; once also from twice that."""
    brake = math.ceil(limits.max_speed / limits.braking / period - 1e-9) * period
    rounded = sorted({max(1, round(positive(hold, "hold") / period)) * period for hold in holds})
    return (*(AccelerateThenBrake(hold, brake) for hold in rounded), AccelerateThenBrake(rounded[0], 2.0 * brake))


METHODS: Final[dict[str, Method]] = {
    method.name: method
    for method in (
        Method(
            "vo",
            _velocity,
            AtConstantVelocity(),
            "Velocity obstacle: a new velocity; obstacles keep theirs.",
            "Fiorini and Shiller, IJRR 17(7), 1998",
        ),
        Method(
            "rvo",
            _velocity,
            AtConstantVelocity(),
            "Reciprocal velocity obstacle: as vo, and of the change that avoids another robot each makes half.",
            "van den Berg, Lin and Manocha, ICRA 2008",
            share=0.5,
        ),
        Method(
            "nlvo",
            _velocity,
            Known(),
            "Nonlinear velocity obstacle: a new velocity; obstacles follow known trajectories.",
            "Shiller, Large and Sekhavat, ICRA 2001",
        ),
        Method(
            "avo",
            _lagged,
            AtConstantVelocity(),
            "Acceleration-velocity obstacle: a new velocity, approached with a lag; obstacles keep theirs.",
            "van den Berg, Snape, Guy and Manocha, ICRA 2011",
        ),
        Method(
            "ao",
            _acceleration,
            AtConstantAcceleration(),
            "Acceleration obstacle: a new acceleration; obstacles keep theirs.",
            "Stern and Shiller, arXiv:2504.13637 and arXiv:2506.06255, 2025",
            robot_forecast=AtConstantAcceleration(),
            responses_among=_braking,
        ),
        Method(
            "nao",
            _acceleration,
            Known(),
            "Nonlinear acceleration obstacle: a new acceleration; obstacles follow known trajectories.",
            "Stern and Shiller, arXiv:2506.06255, 2025",
            robot_forecast=AcceleratingBriefly(0.1),
            responses_among=_braking,
            share=0.5,
            regain=1.0,
        ),
        Method(
            "nao_ahead",
            _acceleration,
            Known(),
            "As nao, and looks ahead: accelerate now, then otherwise, then otherwise again. One robot among obstacles.",
            "Sequences: docs/theory.md, 18; NAO: Stern and Shiller, arXiv:2506.06255, 2025",
            looks_ahead=True,
        ),
        Method(
            "nao_shared",
            _ending_at_rest,
            Known(),
            "As nao, and robots publish manoeuvres that end at rest, each of which avoids all published before it.",
            "The guarantee: docs/theory.md, 16; NAO: Stern and Shiller, arXiv:2506.06255, 2025",
            robot_forecast=Known(),
            shared=True,
        ),
    )
}
"""Every method by name."""


def method(name: str) -> Method:
    """The method of that name, or with another foresight NAME@FORESIGHT, as in nao@observed.

    Raises:
        InvalidInput: there is no such method or foresight; the names that there are.
    """
    plain, at, foresight = name.partition("@")
    found = METHODS[known(plain, "method", list(METHODS))]
    return found.seeing(foresight) if at else found
