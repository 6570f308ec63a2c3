"""The table of peers: which method of which project, and how it is set."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from slalom.checks import Array, known
from slalom.errors import InvalidInput
from slalom.methods import METHODS, Method
from slalom.peers.behaviours import Behaviours
from slalom.peers.crowd import Crowd, Team, imported
from slalom.peers.rvo2 import Rvo2


@dataclass(frozen=True)
class Peer:
    """A row of the table: a method of another project that gives all robots a new velocity at every decision.

    Attributes:
        name: what the command line calls it.
        crowd: from a team to the object that moves it.
        sentence: what it is. source: where it comes from.
        package: what it runs in, of the extra `peers`.
        limited: the simulator holds accelerations to the robot's limit; otherwise velocities change at once, as the
            method assumes.
        inflation: share by which the robots are larger for the method than they are.
        walls: whether it sees anything but discs.
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
    def foresight(self) -> str:
        """It sees where obstacles are now, and how fast."""
        return "observed"

    @property
    def foresight_among(self) -> str:
        """The same of other robots."""
        return "observed"

    def begin(self, radii: Array, max_speeds: Array, period: float, walls: tuple[Array, ...] = ()) -> Crowd:
        """The crowd of robots of those radii (N,) [m] and largest speeds (N,) [m/s], see `Team`.

        Raises:
            InvalidInput: the package is not installed.
        """
        return self.crowd(Team((1.0 + self.inflation) * radii, max_speeds, period, walls))


ORCA, HRVO, HL, FORCE = (
    "van den Berg, Guy, Lin and Manocha, Robotics Research (STAR 70), 2011",
    "Snape, van den Berg, Guy and Manocha, IEEE T-RO 27(4), 2011",
    "Guzzi, Giusti, Gambardella, Theraulaz and Di Caro, ICRA 2013",
    "Helbing and Molnar, Physical Review E 51(5), 1995",
)
MAX_NEIGHBOURS: Final = 30
"""[1] Neighbours that ORCA and HRVO look at."""
TIME_HORIZON: Final = 10.0
"""[s] The time horizon of ORCA, and how far the others look."""
MARGIN: Final = 0.1
"""[m] That HRVO and the human-like behaviour keep; with none, their default, they graze each other."""

_ROWS: Final = (
    Peer(
        "orca",
        partial(Rvo2, neighbours=MAX_NEIGHBOURS, horizon=TIME_HORIZON),
        "ORCA (RVO2 in pyrvo): velocities that share the work of avoiding",
        ORCA,
        "pyrvo",
    ),
    Peer(
        "navground_orca",
        partial(
            Behaviours,
            kind="ORCA",
            horizon=TIME_HORIZON,
            settings={
                "max_neighbors": MAX_NEIGHBOURS,
                "time_horizon": TIME_HORIZON,
                "static_time_horizon": TIME_HORIZON,
            },
        ),
        "ORCA (RVO2 in navground), in which no robot is faster than it prefers to be",
        ORCA,
        "navground",
    ),
    Peer(
        "hrvo",
        partial(
            Behaviours, kind="HRVO", horizon=TIME_HORIZON, margin=MARGIN, settings={"max_neighbors": MAX_NEIGHBOURS}
        ),
        "Hybrid reciprocal velocity obstacle (navground), margin 0.1 m; walls are not seen",
        HRVO,
        "navground",
        walls=False,
    ),
    Peer(
        "hl",
        partial(Behaviours, kind="HL", horizon=TIME_HORIZON, margin=MARGIN),
        "Human-like (navground), margin 0.1 m: the heading that leads nearest to the goal",
        HL,
        "navground",
    ),
    Peer(
        "social_force",
        partial(Behaviours, kind="SocialForce", horizon=TIME_HORIZON),
        "Social force (navground): drawn to the goal, pushed by others, all of them points",
        FORCE,
        "navground",
    ),
)


def _variants(row: Peer) -> Iterator[Peer]:
    """The row as its project has it, within the robot's acceleration, and the latter with larger robots."""
    yield replace(row, sentence=f"{row.sentence}.")
    limited = replace(row, name=f"{row.name}_limited", sentence=f"{row.name}, accelerations limited.", limited=True)
    yield limited
    if row.name == "orca":
        sentence = f"{limited.name}, planned with robots 30 % larger than they are."
        yield replace(limited, name="orca_inflated", sentence=sentence, inflation=0.3)


PEERS: Final[dict[str, Peer]] = {peer.name: peer for row in _ROWS for peer in _variants(row)}
"""Every peer by name."""
CONTENDERS: Final[dict[str, Method | Peer]] = {**METHODS, **PEERS}
"""Every method and every peer by name."""


def contender(name: str) -> Method | Peer:
    """The method or the peer of that name, see `contender_named`, of which the package is installed.

    Raises:
        InvalidInput: there is none, or its package is not installed.
    """
    chosen = contender_named(name)
    if isinstance(chosen, Peer):
        imported(chosen.package)
    return chosen


def contender_named(name: str) -> Method | Peer:
    """The method or the peer of that name, installed or not; of methods also NAME@FORESIGHT, see `methods.method`.

    Raises:
        InvalidInput: there is none, with all names; or it is a peer with a foresight.
    """
    plain, at, foresight = name.partition("@")
    chosen = CONTENDERS[known(plain, "method", list(CONTENDERS))]
    if isinstance(chosen, Method):
        return chosen.with_foresight(foresight) if at else chosen
    if at:
        raise InvalidInput(f"method: expected {plain} alone, which sees what is there now; found {name!r}")
    return chosen
