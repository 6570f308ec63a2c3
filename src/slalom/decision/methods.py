"""Table of methods: a method combines responses with a forecast."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from slalom.base.checks import known, positive, text
from slalom.base.errors import InvalidInput
from slalom.base.registry import Kind, Registry
from slalom.forecast.forecast import (
    FORESIGHTS,
    AcceleratingBriefly,
    AtConstantAcceleration,
    AtConstantVelocity,
    Forecast,
    Known,
    foresight_of,
)
from slalom.model.limits import Limits, least_speed
from slalom.model.response import (
    AccelerateThenBrake,
    AccelerateThenCoast,
    AccelerateThenStop,
    AccelerateThenTurn,
    LaggedVelocity,
    Response,
    Velocity,
)

HOLDS: Final = (0.2, 0.5, 1.0, 2.0, 4.0)
"""[s] Default durations for which accelerations are held; see docs/design/0001."""

Responses = Callable[[Limits, float, tuple[float, ...]], tuple[Response, ...]]


@dataclass(frozen=True, repr=False)
class Method:
    """Row of the table: how controls move the robot, and how obstacles are predicted to move.

    Attributes:
        name: the name on the command line.
        responses: from limits, control period [s] and holds [s] to the responses that a decision compares.
        forecast: from an obstacle's trajectory to the predicted one.
        sentence: the description for users.
        source: the publication.
        robot_forecast: the forecast for other robots, of which only the present state is observed.
        responses_among: the responses among other robots, where they differ; None: `responses`.
        share: fraction of the avoidance between robots that each contributes, above 0 and at most 1. The others
            contribute the rest, so the change from a constant velocity is tested 1 / share as large. With 1/2 and
            velocities this is the reciprocal velocity obstacle (van den Berg, Lin and Manocha, ICRA 2008).
        regain: [s] above 0 within which robots that only observe each other restore a lost part of the margin between
            them; None: the margin must only not shrink further. `Navigator` uses share and regain only for
            `robots=`: its obstacles do not avoid it.
        agrees: whether two robots that share the avoidance agree, from what both observe, on the side to pass on.
        stops_at_obstacles: whether other robots that are only observed are predicted to stop where they would get into
            contact with an obstacle at rest.
        shared: robots receive the committed manoeuvres of the others, and decide one after the other. Without
            guidance they leave the ways of robots that are held up.
        looks_ahead: whether a single robot searches over sequences of accelerations (`lookahead.LookAhead`).
        turning: the responses of a single robot with the bound LeastSpeed that end in a turn, see `Navigator`; None:
            none.
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
    agrees: bool = False
    stops_at_obstacles: bool = False
    shared: bool = False
    looks_ahead: bool = False
    turning: Responses | None = None

    def __repr__(self) -> str:
        return f"<Method {self.name}>"

    @property
    def foresight(self) -> str:
        """Level of foresight of obstacles: recorded, present or observed (see `forecast.FORESIGHTS`)."""
        return foresight_of(self.forecast)

    @property
    def foresight_among(self) -> str:
        """Knowledge of other robots: published manoeuvres, or the level of foresight."""
        return "published" if self.shared else foresight_of(self.robot_forecast)

    def with_foresight(self, foresight: str) -> "Method":
        """The method with another level of foresight.

        Raises:
            InvalidInput: an unknown level.
        """
        forecast = FORESIGHTS[known(foresight, "foresight", list(FORESIGHTS))]
        return replace(self, name=f"{self.name.partition('@')[0]}@{foresight}", forecast=forecast)

    def among_robots(self) -> "Method":
        """The method for robots among other robots."""
        return self if self.responses_among is None else replace(self, responses=self.responses_among)

    def stopping(self) -> "Method":
        """The method for a robot that must be able to stop, see `Sight`.

        It has its responses among robots, and further ones that brake in less time, which only slow robots can.

        Raises:
            InvalidInput: a method without a response that ends at rest.
        """
        found = self.among_robots()
        limits = Limits(1.0, 1.0)
        if not any(isinstance(r, AccelerateThenBrake) for r in found.responses(limits, 0.1, HOLDS)):
            raise InvalidInput(
                f"passive_safety: expected a method with manoeuvres that end at rest, such as nao, found {self.name}"
            )
        return replace(found, responses=_Stopping(found.responses))


def _velocity(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    return (Velocity(ramp=period),)


def _lagged(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    return (LaggedVelocity(lag=limits.max_speed / limits.max_acceleration),)


def _whole_periods(holds: tuple[float, ...], period: float) -> list[float]:
    """The holds [s] as whole numbers of periods, at least one, each once in increasing order."""
    return sorted({max(1, round(positive(hold, "hold") / period)) * period for hold in holds})


def _acceleration(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    """Holds followed by constant velocity and, for a robot that may stop, by braking to rest."""
    rounded_holds = _whole_periods(holds, period)
    coasting = [AccelerateThenCoast(hold) for hold in rounded_holds]
    if least_speed(limits) is not None:
        return tuple(coasting)
    rate = min(limits.braking / limits.max_speed, 0.5 / period)
    stopping = [AccelerateThenStop(hold, rate, period) for hold in rounded_holds]
    return (*coasting, *stopping)


def _braking(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    """As `_acceleration`, but stops have an end and few pieces, because there are many robots to test against."""
    coasting = [r for r in _acceleration(limits, period, holds) if isinstance(r, AccelerateThenCoast)]
    if least_speed(limits) is not None:
        return tuple(coasting)
    return (*coasting, *_ending_at_rest(limits, period, holds)[:-1])


def _ending_at_rest(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    """Holds followed by braking over a whole number of periods, enough from max_speed.

    One further response brakes twice as long, for higher speeds. Raises InvalidInput for a robot that must not stop.
    """
    if (bound := least_speed(limits)) is not None:
        raise InvalidInput(f"limits: expected a robot that may stop, as its manoeuvres end at rest, found {bound!r}")
    brake = math.ceil(limits.max_speed / limits.braking / period - 1e-9) * period
    rounded_holds = _whole_periods(holds, period)
    return (
        *(AccelerateThenBrake(hold, brake) for hold in rounded_holds),
        AccelerateThenBrake(rounded_holds[0], 2.0 * brake),
    )


TURN_SHARES: Final = (1.0, 0.5)
"""[1] Shares of the largest admissible rate at which turns without end are considered: a tight and a wide circle. More:
more choices where no constant velocity is free. Fewer: less room in which a robot can go on."""


def _turning(limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
    """Holds followed by a turn without end, for a robot that must not stop: shorter holds first, and right turns."""
    _, rate = limits.steady_turn(2)
    if rate == 0.0:
        return ()
    sides = [sign * share * rate for share in TURN_SHARES for sign in (-1.0, 1.0)]
    return tuple(AccelerateThenTurn(hold, side) for hold in _whole_periods(holds, period) for side in sides)


@dataclass(frozen=True)
class _Stopping:
    """The responses `of` a method, and the shortest hold followed by a half, a quarter, ... of the time to brake."""

    of: Responses

    def __call__(self, limits: Limits, period: float, holds: tuple[float, ...]) -> tuple[Response, ...]:
        given = self.of(limits, period, holds)
        braking = [response for response in given if isinstance(response, AccelerateThenBrake)]
        if not braking:
            found = f"{least_speed(limits)!r}"
            raise InvalidInput(f"limits: expected a robot that may stop, for passive safety, found {found}")
        hold, steps = min(one.hold for one in braking), round(min(one.brake for one in braking) / period)
        shorter = []
        while steps > 1:
            steps = (steps + 1) // 2
            shorter.append(AccelerateThenBrake(hold, steps * period))
        return (*given, *shorter)


VARIANTS: Final[Mapping[str, Callable[[Method], Method]]] = {
    "among_robots": Method.among_robots,
    "stopping": Method.stopping,
}
"""Operations that make a method of one in the table and keep its name, by their names."""


_ROWS: Final = (
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
        "Reciprocal velocity obstacle: as vo, but each robot makes half of the change that avoids another.",
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
        robot_forecast=AcceleratingBriefly(0.1),
        responses_among=_braking,
        turning=_turning,
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
        agrees=True,
        stops_at_obstacles=True,
        turning=_turning,
    ),
    Method(
        "nao_ahead",
        _acceleration,
        Known(),
        "As nao, with a search over sequences of accelerations. One robot among obstacles.",
        "Sequences: docs/theory.md, 18; NAO: Stern and Shiller, arXiv:2506.06255, 2025",
        looks_ahead=True,
        turning=_turning,
    ),
    Method(
        "nao_shared",
        _ending_at_rest,
        Known(),
        "As nao, and robots publish manoeuvres that end at rest; each avoids all published before it.",
        "The guarantee: docs/theory.md, 16; NAO: Stern and Shiller, arXiv:2506.06255, 2025",
        robot_forecast=Known(),
        shared=True,
    ),
)

METHODS: Final = Registry[Method](
    "slalom.methods", Kind(lambda part: isinstance(part, Method), "a Method"), {method.name: method for method in _ROWS}
)
"""Methods by name; packages add to them by entry points of the group slalom.methods."""


def method(name: str) -> Method:
    """Method by name, or with another foresight by NAME@FORESIGHT, as in nao@observed.

    Raises:
        InvalidInput: an unknown method or foresight; the message lists the known ones.
    """
    plain, at, foresight = text(name, "name").partition("@")
    found = METHODS.find(plain, "method")
    return found.with_foresight(foresight) if at else found


def derived(name: str, variant: str | None) -> Method:
    """The method of this name, or what the operation `variant` of VARIANTS makes of it.

    Raises:
        InvalidInput: an unknown method or variant, or a method that the operation does not take.
    """
    found = method(name)
    return found if variant is None else VARIANTS[known(variant, "variant", list(VARIANTS))](found)


def variant_of(found: Method) -> str | None:
    """The name of the operation with which `derived` makes the responses of a method; None: those of the table.

    Raises:
        InvalidInput: responses that none of them makes.
    """
    if isinstance(found.responses, _Stopping):
        return "stopping"
    for variant in (None, "among_robots"):
        if derived(found.name, variant).responses == found.responses:
            return variant
    raise InvalidInput(f"method: expected responses of one of the table of methods, found others of {found.name!r}")


def margin_among(method: Method, margin: float, max_acceleration: float, time: float, noise: float = 0.0) -> float:
    """The margin [m] of robots that meet each other.

    With a shared method it is `margin` [m]. Robots that only observe each other add twice a t^2, the largest error of a
    prediction when both accelerate by a at most. The time t is one period and the delay of observation together. They
    also add three standard deviations, `noise` [m], of the observed positions.
    """
    return margin if method.shared else margin + 2.0 * max_acceleration * time * time + 3.0 * noise


def refuse_alone(method: Method) -> None:
    """Raise InvalidInput for a method that needs more than the observations of one robot."""
    if method.looks_ahead:
        raise InvalidInput(f"method: expected one without a search, found {method.name}; use LookAhead")
    if method.shared:
        raise InvalidInput(f"method: expected one without published manoeuvres, found {method.name}; use Fleet")
