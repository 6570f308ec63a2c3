"""Methods of other projects and authors as rows of one table, to run the same scenarios under the same measurements.

All keep the margin of a scenario: they plan with radii of robots and obstacles that are larger by half of it. Social
force considers robots as points, so their radii and the margin have no effect on it.

They need the optional extra `peers`: `pip install 'slalom[peers]'`. Its packages are imported when a peer is first
used. (The wheel of `pyrvo` declares the simulator that it was made for, ir-sim, and with it scipy, imageio and loguru.
Its code imports none of them: `pip install --no-deps pyrvo` suffices.)
"""

from slalom.peers.crowd import Crowd, Discs, Team, discs, outlines
from slalom.peers.table import CONTENDERS, PEERS, Peer, contender

__all__ = ["CONTENDERS", "PEERS", "Crowd", "Discs", "Peer", "Team", "contender", "discs", "outlines"]
