"""The rule of contact, once: when a robot overlaps a body, and how much of a margin it keeps near one.

Contact is not overlap. A robot within CONTACT_SLACK of a body, and at most OVERLAP deep in it, touches the body and may
still move away. The body then counts as smaller by up to that amount. Farther away the robot keeps the margin, or as
much of it as it has now.
"""

from slalom.kernels.jit import kernel
from slalom.tolerances import CONTACT_SLACK, OVERLAP


@kernel
def overlaps(clearance: float) -> bool:
    """Whether a robot with this clearance [m] overlaps a body."""
    return clearance < -OVERLAP


@kernel
def kept_margin(clearance: float, margin: float) -> float:
    """The part [m] of `margin` [m] that a robot with this clearance [m], margin not counted, can keep.

    The whole margin, or the present clearance less CONTACT_SLACK; negative where the robot touches the body.
    """
    if clearance < CONTACT_SLACK:
        return min(clearance, 0.0) - CONTACT_SLACK
    return min(max(clearance - CONTACT_SLACK, 0.0), margin)


@kernel
def kept_radius(distance: float, radius: float) -> float:
    """The radius [m] of a body at `distance` [m]: `radius`, margin included, or less where the robot touches it."""
    if distance - radius >= -OVERLAP and distance - radius < CONTACT_SLACK:
        return max(distance - CONTACT_SLACK, 0.0)
    return radius
