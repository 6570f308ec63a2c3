"""Table of peers: methods of other projects and other authors, and their settings."""

from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, Final, cast

import numpy as np
import numpy.typing as npt

from slalom.base.checks import known, shown, text
from slalom.base.errors import InvalidInput
from slalom.decision.methods import METHODS, Method
from slalom.peers.crowd import Crowd, Team, imported
from slalom.peers.methods import (
    BarrierFilter,
    Behaviours,
    DynamicWindow,
    PathIntegral,
    Rvo2,
    parameters_of,
    parsed,
    with_parameters,
)


@dataclass(frozen=True)
class Peer:
    """Row of the table: a method that is not slalom's and returns new velocities for all robots at every decision.

    Attributes:
        name: the name on the command line.
        crowd: from a team to the object that moves it.
        sentence: the description for users.
        source: the publication.
        package: the package that it needs, of the extra `peers`; slalom: none.
        limited: the simulator applies the robot's acceleration limit; otherwise velocities change at once, as the
            method assumes.
        inflation: fraction by which the method plans with larger radii, besides the margin.
        walls: whether the method accepts obstacles other than discs.
    """

    name: str
    crowd: Callable[[Team], Crowd]
    sentence: str
    source: str
    package: str
    limited: bool = False
    inflation: float = 0.0
    walls: bool = True

    @property
    def parameters(self) -> dict[str, float]:
        """Numbers with which the method is made, by name: those of NAME:PARAMETER=VALUE."""
        return parameters_of(self.crowd)

    def with_parameters(self, values: Mapping[str, float]) -> "Peer":
        """The method with other parameters, which its name then states: NAME:PARAMETER=VALUE.

        Raises:
            InvalidInput: a parameter that it does not have, a value below 0.
        """
        name = ":".join([self.name, *(f"{key}={value:.12g}" for key, value in values.items())])
        return replace(self, name=name, crowd=with_parameters(self.crowd, values, self.name))

    @property
    def foresight(self) -> str:
        """Level of foresight: present positions and velocities of obstacles."""
        return "observed"

    @property
    def foresight_among(self) -> str:
        """Level of foresight of other robots."""
        return "observed"

    def begin(self, team: Team, margins: npt.ArrayLike = 0.0) -> Crowd:
        """Crowd of the robots of a team with their true radii; half of the margins (N,) [m] is added to these.

        Raises:
            InvalidInput: the package is not installed.
        """
        radii = (1.0 + self.inflation) * team.radii + 0.5 * np.asarray(margins, dtype=np.float64)
        return self.crowd(team._replace(radii=radii))


ORCA = "van den Berg, Guy, Lin and Manocha, Robotics Research (STAR 70), 2011"
HRVO = "Snape, van den Berg, Guy and Manocha, IEEE T-RO 27(4), 2011"
HL = "Guzzi, Giusti, Gambardella, Theraulaz and Di Caro, ICRA 2013"
FORCE = "Helbing and Molnar, Physical Review E 51(5), 1995"
WINDOW = "Fox, Burgard and Thrun, IEEE Robotics and Automation Magazine 4(1), 1997"
PATH_INTEGRAL = "Williams, Aldrich and Theodorou, Journal of Guidance, Control, and Dynamics 40(2), 2017"
BARRIER = "Wang, Ames and Egerstedt, IEEE T-RO 33(3), 2017"
MAX_NEIGHBOURS: Final = 30
"""[1] Neighbours that ORCA and HRVO consider."""
TIME_HORIZON: Final = 10.0
"""[s] Time horizon of ORCA, and of the neighbours of the others."""
PLANNED: Final = 4.0
"""[s] Horizon of the planners, which slalom implements."""

_ROWS: Final = (
    Peer(
        "orca",
        partial(Rvo2, neighbours=MAX_NEIGHBOURS, horizon=TIME_HORIZON, wall_horizon=TIME_HORIZON),
        "ORCA (RVO2 in pyrvo): velocities that share the avoidance",
        ORCA,
        "pyrvo",
    ),
    Peer(
        "navground_orca",
        partial(
            Behaviours,
            kind="ORCA",
            time_horizon=TIME_HORIZON,
            settings={
                "max_neighbors": MAX_NEIGHBOURS,
                "time_horizon": TIME_HORIZON,
                "static_time_horizon": TIME_HORIZON,
            },
        ),
        "ORCA (RVO2 in navground), with speeds of at most the preferred one",
        ORCA,
        "navground",
    ),
    Peer(
        "hrvo",
        partial(Behaviours, kind="HRVO", time_horizon=TIME_HORIZON, settings={"max_neighbors": MAX_NEIGHBOURS}),
        "Hybrid reciprocal velocity obstacle (navground); walls are ignored",
        HRVO,
        "navground",
        walls=False,
    ),
    Peer(
        "hl",
        partial(
            Behaviours,
            kind="HL",
            time_horizon=TIME_HORIZON,
            settings={"tau": 0.125, "eta": 0.5, "aperture": 3.1415927410125732, "resolution": 101},
        ),
        "Human-like (navground): the heading that leads nearest to the goal",
        HL,
        "navground",
    ),
    Peer(
        "social_force",
        partial(
            Behaviours,
            kind="SocialForce",
            time_horizon=TIME_HORIZON,
            settings={"tau": 0.5, "v_a": 2.1, "v_r": 0.3, "u_a": 10.0, "u_r": 0.2},
        ),
        "Social force (navground): attraction to the goal, repulsion from others as points",
        FORCE,
        "navground",
    ),
)

_PLANNERS: Final = (
    Peer(
        "dwa",
        partial(DynamicWindow, horizon=PLANNED),
        "Dynamic window approach: the best velocity that one period reaches.",
        WINDOW,
        "slalom",
        limited=True,
    ),
    Peer(
        "mppi",
        partial(PathIntegral, horizon=PLANNED),
        "Model predictive path integral control: 256 sequences of accelerations.",
        PATH_INTEGRAL,
        "slalom",
        limited=True,
    ),
    Peer(
        "cbf",
        partial(BarrierFilter, horizon=TIME_HORIZON),
        "Control barrier functions (quadratic program in daqp): filter of the preferred acceleration.",
        BARRIER,
        "daqp",
        limited=True,
    ),
)


def _variants(row: Peer) -> Iterator[Peer]:
    """The row with unlimited accelerations, with the robot's limit, and (for ORCA) the latter with larger robots."""
    yield replace(row, sentence=f"{row.sentence}.")
    limited = replace(row, name=f"{row.name}_limited", sentence=f"{row.name}, accelerations limited.", limited=True)
    yield limited
    if row.name == "orca":
        sentence = f"{limited.name}, planned with robots 30 % larger than they are."
        yield replace(limited, name="orca_inflated", sentence=sentence, inflation=0.3)


PEERS: Final[dict[str, Peer]] = {
    peer.name: peer for peer in (*(p for row in _ROWS for p in _variants(row)), *_PLANNERS)
}
"""Peers by name."""
CONTENDERS: Final[Mapping[str, Method | Peer]] = ChainMap(cast(Any, PEERS), cast(Any, METHODS))
"""Methods and peers by name."""


def method(name: str) -> Any:
    """Method or peer by any name of `slalom list methods`, or NAME@FORESIGHT, as in nao@observed.

    The result is a `Method`, or a `Peer` for methods that are not slalom's, which only the simulator runs. A peer takes
    parameters as in orca:horizon=5:neighbours=10.

    Raises:
        InvalidInput: an unknown method or foresight; the message lists the known ones.
    """
    return contender(text(name, "name"), installed=False)


def contender(given: str | Method | Peer, *, installed: bool = True) -> Method | Peer:
    """Method or peer by name, or itself.

    For methods also NAME@FORESIGHT, see `decision.methods.method`; for peers NAME:PARAMETER=VALUE:..., see
    `Peer.parameters`.

    Args:
        installed: whether the package of a peer must be installed.

    Raises:
        InvalidInput: an unknown name, with all known ones; a peer with a foresight, a method of slalom with parameters;
            an unknown parameter or a value out of range; a package that is not installed; something else than a method.
    """
    if not isinstance(given, str | Method | Peer):
        raise InvalidInput(f"method: expected a method, such as method('nao'), or its name; found {shown(given)}")
    if not isinstance(given, str):
        return given
    chosen = _named(given)
    if installed and isinstance(chosen, Peer):
        imported(chosen.package)
    return chosen


def _named(name: str) -> Method | Peer:
    plain, at, foresight = name.partition("@")
    plain, colon, parameters = plain.partition(":")
    chosen = CONTENDERS[known(plain, "method", list(CONTENDERS))]
    if isinstance(chosen, Method):
        if colon:
            raise InvalidInput(f"method: expected {plain} alone, whose settings are of the scenario; found {name!r}")
        return chosen.with_foresight(foresight) if at else chosen
    if at:
        raise InvalidInput(f"method: expected {plain} alone, which observes the present only; found {name!r}")
    return _changed(plain, parameters) if colon else chosen


@cache
def _changed(name: str, parameters: str) -> Peer:
    """The peer with parameters as text. The same object every time, because crowds do not compare."""
    return PEERS[name].with_parameters(parsed(parameters, name))
