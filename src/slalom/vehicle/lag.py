"""A robot whose acceleration follows the commanded one with a lag, and the reference that follows it at once.

Of a robot with position p, velocity v and acceleration a, where da/dt = (u - a) / lag, the *reference* has

    position p + lag v,    velocity v + lag a.

The derivative of its velocity is a + lag da/dt = u: it is a double integrator that follows the command u exactly. The
robot follows the reference later by `lag`. Since p averages the past positions q of the reference with the weights
e^(-s/lag) / lag, whose mean is lag and whose variance is lag^2,

    |p(t + lag) - q(t)| <= A lag^2 / 2,    A: the largest |u|.

A decision for the reference, at the time `lag` later and with this error added to the margin, therefore keeps the robot
clear. See docs/theory.md, section 15.
"""

from dataclasses import dataclass

from slalom.base.checks import Positive, check_fields
from slalom.model.limits import Limits
from slalom.model.state import State


@dataclass(frozen=True)
class AccelerationLag:
    """The robot's acceleration approaches the commanded one at the rate 1 / `lag`.

    Decide for the reference at the time at which the robot follows it, and command the acceleration of the decision:

        navigator = Navigator(..., margin=0.05 + actuator.tracking_error(limits))
        decision = navigator.decide(actuator.reference(state), obstacles, goal, now=now + actuator.lag, ...)
        command = decision.manoeuvre.mean_acceleration(now + actuator.lag, period)

    Attributes:
        lag: [s] > 0, the time constant.
    """

    lag: Positive

    def __post_init__(self) -> None:
        check_fields(self)

    def reference(self, state: State) -> State:
        """The reference of a robot in `state`, whose acceleration is the measured one, not the commanded one."""
        return State(
            state.position + self.lag * state.velocity,
            state.velocity + self.lag * state.acceleration,
            state.acceleration,
        )

    def tracking_error(self, limits: Limits) -> float:
        """Largest distance [m] of the robot from where the reference was `lag` before.

        It holds if no command ever exceeded the limits, and the robot started with its acceleration within them.
        """
        return 0.5 * limits.max_acceleration * self.lag**2
