"""Other projects' methods as rows of one table, to run the same scenarios and be measured in the same way.

They are the optional extra `peers`: `pip install 'slalom[peers]'`. Nothing of it is imported before a peer is asked
for. (The wheel of `pyrvo` declares the simulator that it was made for, ir-sim, and with it scipy, imageio and loguru;
its code imports none of them: `pip install --no-deps pyrvo` is enough to run it.)
"""

from slalom.peers.crowd import Crowd, Discs, Team
from slalom.peers.sight import discs, outlines
from slalom.peers.table import CONTENDERS, PEERS, Peer, contender, contender_named

__all__ = [
    "CONTENDERS",
    "PEERS",
    "Crowd",
    "Discs",
    "Peer",
    "Team",
    "contender",
    "contender_named",
    "discs",
    "outlines",
]
