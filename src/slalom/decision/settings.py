"""Settings of a decision: what the robot is, and how it decides. Fleets, scenarios and files derive theirs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from math import radians
from typing import Annotated, Any, Final, Protocol, TypeAlias, TypedDict, runtime_checkable

import numpy as np

from slalom.base.checks import (
    LIMITS,
    METHOD,
    OBJECTIVE,
    SHAPE,
    Array,
    CheckedFields,
    NotNegative,
    Positive,
    check_fields,
    duration,
    flag,
    has,
    listing,
    mapping,
    not_long,
    not_negative,
    number,
    or_infinite,
    positive,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import ADMISSIBLE
from slalom.decision.methods import HOLDS, Method
from slalom.decision.objective import NO_OBSTACLES, Arrive, Objective, Situation
from slalom.decision.tables import step_of
from slalom.kernels.decision.tables import DecisionSettings
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.response import AccelerateThenBrake, Response
from slalom.model.shape import Shape
from slalom.model.state import State
from slalom.obstacle.obstacle import Obstacle
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow, Reaction, followed, listed

SHORTEST_HORIZON: Final = 1e-3
"""[s] Least horizon for one obstacle. Larger: obstacles beside a robot at rest count longer. At 0: for no time."""


@runtime_checkable
class Horizon(Protocol):
    """Rule for the horizon of each predicted obstacle.

    Law: every horizon is above 0. The navigator limits them to its own `horizon`.
    """

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        """Horizons (n,) [s] of n predicted obstacles for a robot in `state` at time `now` [s]."""


@dataclass(frozen=True)
class HorizonByName:
    """seconds[name] for named obstacles, `otherwise` [s] for all others."""

    seconds: Mapping[str, float]
    otherwise: Positive

    def __post_init__(self) -> None:
        mapping(self.seconds, "numbers by name", "seconds")
        for name, value in self.seconds.items():
            positive(value, f"seconds[{name!r}]")
        check_fields(self)

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        return np.array([self.seconds.get(obstacle.name, self.otherwise) for obstacle in obstacles])


@dataclass(frozen=True)
class SafeTime(CheckedFields):
    """Safe time horizon: the time that the robot needs to stop relative to the obstacle under full braking.

    |v - v_B| / braking + `extra`; `extra` >= 0 [s] allows for the decision period and the hold of a manoeuvre. v_B is
    the velocity of the obstacle now, or when it appears. A longer horizon forbids controls that can still be corrected.
    With a shorter one the robot may enter states in which braking is too late. Source: Gal, Shiller and Rimon, ICRA
    2009; Shiller, Gal and Raz, IROS 2011. They cut the velocity obstacle where its boundary meets that of the
    inevitable collision states. For a robot that brakes straight this is the time to stop.
    """

    extra: NotNegative = 1.0

    def __call__(self, state: State, obstacles: Sequence[Obstacle], limits: Limits, now: float) -> Array:
        times = []
        for obstacle in obstacles:
            time = min(max(now, obstacle.trajectory.span[0]), obstacle.trajectory.span[1])
            relative = state.velocity - obstacle.trajectory.velocity(time)
            times.append(float(np.linalg.norm(relative)) / limits.braking + self.extra)
        return np.maximum(np.array(times, dtype=np.float64), SHORTEST_HORIZON)


HORIZONS: Final[dict[str, type[Horizon]]] = {"horizon_by_name": HorizonByName, "safe_time": SafeTime}
"""Rules by the name that files of decisions use."""


def within_horizon(period: float, horizon: float) -> None:
    """Raise InvalidInput for a period [s] of decisions above the horizon [s]: a robot may collide between them."""
    if period > horizon:
        raise InvalidInput(f"period: expected at most the horizon, {horizon:g} s, found {period:g} s")


def checked_holds(holds: Sequence[float], name: str) -> tuple[float, ...]:
    """The durations [s] for which accelerations are held. Raises InvalidInput for something else, and for none."""
    listing(holds, "durations", name)
    if not len(holds):
        raise InvalidInput(f"{name}: expected at least one, found none")
    return tuple(duration(hold, f"{name}[{k}]") for k, hold in enumerate(holds))


def checked_detours(detours: Sequence[float] | None, name: str) -> tuple[float, ...] | None:
    """The angles [rad] of detours, or None. Raises InvalidInput for something else."""
    if detours is None:
        return None
    listing(detours, "angles", name)
    return tuple(number(angle, f"{name}[{k}]") for k, angle in enumerate(detours))


Duration: TypeAlias = Annotated[float, duration]
Holds: TypeAlias = Annotated[tuple[float, ...], checked_holds]
Detours: TypeAlias = Annotated[tuple[float, ...] | None, checked_detours]
Flag: TypeAlias = Annotated[bool, flag]

DETOURS: Final = tuple(radians(angle) for angle in (-30.0, -60.0, -90.0, 30.0, 60.0))
"""[rad] Directions of detours, from the direction to the target; first to the right. More values: more choices per
decision. Fewer: robots that block each other stop. Without those to the left: a robot with a wall at its right
stops."""


@dataclass(frozen=True)
class Risk:
    """Limits on the cost of avoiding improbable futures of obstacles, see `Obstacle.probability`.

    Attributes:
        loss: [s] of time that a contact is worth. Futures are given up where that brings the arrival forward by more
            than `loss` times their probability. inf: they are given up only where nothing avoids all of them.
        likely: [1] futures of this probability or more are never given up to save time.
    """

    loss: float = np.inf
    likely: NotNegative = 0.1

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "loss", or_infinite(self.loss, "loss", not_negative))


@dataclass(frozen=True)
class Settings:
    """What a robot is, and how it decides.

    Attributes:
        method: a row of the table of methods.
        robot: its shape. It never turns: its axes are those of the world, and a state with a heading is refused unless
            the shape is round. A robot that keeps its heading has a shape that is turned by it.
        limits: its maximum speed and acceleration, and further bounds.
        period: [s] between decisions.
        horizon: [s] up to which collisions count.
        margin: [m] to keep from every obstacle.
        holds: [s] durations for which accelerations are held.
        patience: [1] share of the time that keeping a manoeuvre may cost.
        objective: the quantity to minimise.
        horizons: a rule for shorter horizons of single obstacles; None: `horizon` for all.
        detours: angles [rad] by which the desired velocity is turned if it is not collision-free; among equal ones the
            first is taken. None: DETOURS for a robot with responses that stop, such as those of nao and ao, if it is
            held up by what rests or moves ahead of it, see CLAIM_AFTER. Without detours, a robot blocked by a
            permanent obstacle never arrives.
        early: whether responses that brake to rest count only where no velocity can be kept. The robot then avoids a
            collision as soon as the horizon shows it, and not when it could hardly stop any more: for robots that
            brake badly, such as ships. With the bound LeastSpeed no response ends at rest.
        stuck_after: [s] without progress towards the goal after which a decision is `stuck`.
        risk: what avoiding improbable futures of obstacles may cost, see `Obstacle.probability`.
        contact_at_rest: whether contacts count while the robot is at rest. False: passive safety, for a method whose
            responses end at rest, see `Method.stopping`.

    Raises:
        InvalidInput: a setting of a wrong kind or out of its range; a period above the horizon; a robot with its
            margin, or its way within the horizon, longer than 1e7 m.
    """

    method: Method
    robot: Shape
    limits: Limits
    period: Duration = 0.1
    horizon: Duration = 6.0
    margin: NotNegative = 0.05
    holds: Holds = HOLDS
    patience: NotNegative = 0.01
    objective: Objective = field(default_factory=Arrive)
    horizons: Horizon | None = None
    detours: Detours = None
    early: Flag = False
    stuck_after: Positive = 10.0
    risk: Risk = field(default_factory=Risk)
    contact_at_rest: Flag = True

    def __post_init__(self) -> None:
        has(self.method, *METHOD, "method")
        has(self.robot, *SHAPE, "robot")
        check_fields(self)
        within_horizon(self.period, self.horizon)
        has(self.limits, *LIMITS, "limits")
        not_long(self.robot.bounding_radius + self.margin, "robot with its margin")
        not_long(self.limits.max_speed * self.horizon, "limits: way at max_speed within the horizon")
        has(self.objective, *OBJECTIVE, "objective")
        has(self.risk, ("loss", "likely"), "a Risk", "risk")
        if self.horizons is not None:
            has(self.horizons, ("__call__",), "a rule for horizons, such as SafeTime(), or None", "horizons")
        if not self.contact_at_rest and not any(isinstance(r, AccelerateThenBrake) for r in self._responses):
            raise InvalidInput(
                f"method: expected one that ends at rest with contact_at_rest=False, such as method('nao').stopping(), "
                f"found {self.method.name}"
            )

    @cached_property
    def _responses(self) -> tuple[Response, ...]:
        return self.method.responses(self.limits, self.period, self.holds)

    @cached_property
    def _shortest(self) -> float:
        return min(step_of(response, self.horizon, self.period) for response in self._responses)

    def numbers(self, *, among: bool) -> DecisionSettings:
        """The settings as kernels take them, at time 0, without shared manoeuvres and without detours by default.

        Args:
            among: whether there are other robots that decide by the same method.
        """
        method = self.method
        share = float(method.share) if among else 1.0
        return DecisionSettings(
            dimension=self.robot.dimension,
            now=0.0,
            period=self.period,
            horizon=self.horizon,
            regain=np.inf if method.regain is None or not among else float(method.regain),
            patience=self.patience,
            share=share,
            least_share=share,
            agrees=method.agrees and among,
            stops_at_obstacles=method.stops_at_obstacles and among,
            shared=False,
            detours=np.array(self.detours or (), dtype=np.float64),
            early=self.early,
            held_up=False,
            budget=np.inf,
        )

    def predict(self, obstacles: Obstacles, state: State, now: float) -> ObstacleWindow:
        """The obstacles on their predicted trajectories from `now` [s] on.

        Obstacles that appear later are included only if the forecast contains them.
        """
        tracked = any(isinstance(one, Tracks) for one in listed(obstacles))
        obstacles = followed(obstacles, self.robot, state, self.limits) if tracked else obstacles
        reaction = Reaction(self.limits, self.period)
        window = ObstacleWindow.predicted(obstacles, self.method.forecast, number(now, "now"), self.horizon, reaction)
        if tracked:
            window.refuse_worlds()
        if not self.contact_at_rest:
            window = window.while_moving()
        if self.horizons is None:
            return window
        return window.within(np.minimum(self.horizons(state, window.obstacles, self.limits, now), self.horizon))

    def situations(self, state: State, goal: Goal, now: float) -> list[Situation]:
        """The input of the objective for each response; for those that slow down soonest if the robot is too fast."""
        responses = self._responses
        if self.is_too_fast(state):
            # A small acceleration held for long would obey the limit only at its end; the speed must fall now.
            shortest = min(response.settled(self.horizon) for response in responses)
            responses = tuple(r for r in responses if r.settled(self.horizon) <= shortest)
        return [self.situation(response, state, goal, now) for response in responses]

    def situation(
        self, response: Response, state: State, goal: Goal, now: float, obstacles: ObstacleWindow = NO_OBSTACLES
    ) -> Situation:
        """The input of the objective for one response."""
        times = now, self.horizon, self.period, self._shortest
        return Situation(response, state, goal, self.limits, *times, obstacles)

    def is_too_fast(self, state: State) -> bool:
        """Whether the robot exceeds its speed limit by more than rounding."""
        return float(np.linalg.norm(state.velocity)) > self.limits.max_speed * (1.0 + 10.0 * ADMISSIBLE)


# Settings that other classes take over: a new one that they shall have is named here too.


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SharedSettings:
    """Settings of decisions that scenarios and vehicles have too.

    Attributes:
        horizon: [s] within which collisions count.
        margin: [m] required clearance.
        holds: [s] durations for which an acceleration may be held.
        patience: [1] share of the time that keeping a safe manoeuvre may cost.
    """

    horizon: Duration = Settings.horizon
    margin: NotNegative = Settings.margin
    holds: Holds = Settings.holds
    patience: NotNegative = Settings.patience

    @property
    def shared(self) -> dict[str, Any]:
        """These settings by name, for `Settings`."""
        return {each.name: getattr(self, each.name) for each in fields(SharedSettings)}


def names_of(settings: type, kind: type) -> tuple[str, ...]:
    """Names of the settings whose defaults are of a kind, such as float or tuple."""
    return tuple(each.name for each in fields(settings) if isinstance(each.default, kind))


NUMBERS: Final = names_of(SharedSettings, float)
"""Names of the shared settings that are numbers: horizon, margin, patience."""


class FleetSettings(TypedDict, total=False):
    """Those of `Settings` that all robots of a fleet have in common."""

    period: float
    horizon: float
    holds: tuple[float, ...]
    patience: float
    detours: tuple[float, ...]
    early: bool
    stuck_after: float
