"""slalom: reactive robot navigation with velocity and acceleration obstacles.

One concept: a control moves the robot by an affine map with a scalar gain (`response`); an obstacle (`shape` on a
`trajectory`) blocks the controls that lead into it (`ControlObstacle`); `select` finds the admissible control nearest
to the preferred one that collides with nothing; `Navigator` turns choices into safe motion; `slalom.sim` simulates,
records and measures; `slalom.view` draws.
"""

from slalom.affine import Affine
from slalom.control_obstacle import ControlObstacle, Element, Traffic, control_obstacle
from slalom.errors import InvalidFile, InvalidInput, OutsideSpan, SlalomError
from slalom.forecast import AtConstantAcceleration, AtConstantVelocity, Forecast, Known
from slalom.goal import Goal
from slalom.limits import Admissible, HalfSpace, Limits, admissible_ball
from slalom.manoeuvre import Manoeuvre
from slalom.methods import METHODS, Method, method
from slalom.navigator import Decision, Navigator, Outcome
from slalom.objective import (
    Aim,
    Arrive,
    FollowVelocity,
    KeepAcceleration,
    Mix,
    MostClearance,
    Objective,
    preferred_control,
)
from slalom.obstacle import Obstacle
from slalom.response import (
    AccelerateThenCoast,
    AccelerateThenStop,
    Acceleration,
    Jerk,
    LaggedVelocity,
    Response,
    Velocity,
    advance,
)
from slalom.selection import Choice, Status, select, select_clearest
from slalom.shape import Ball, Disc, Shape
from slalom.state import State
from slalom.trajectory import (
    Circular,
    Composite,
    ConstantAcceleration,
    ConstantVelocity,
    Function,
    PiecewisePolynomial,
    Sampled,
    Stationary,
    Trajectory,
)

__version__ = "0.1.0"

__all__ = [
    "METHODS",
    "AccelerateThenCoast",
    "AccelerateThenStop",
    "Acceleration",
    "Admissible",
    "Affine",
    "Aim",
    "Arrive",
    "AtConstantAcceleration",
    "AtConstantVelocity",
    "Ball",
    "Choice",
    "Circular",
    "Composite",
    "ConstantAcceleration",
    "ConstantVelocity",
    "ControlObstacle",
    "Decision",
    "Disc",
    "Element",
    "FollowVelocity",
    "Forecast",
    "Function",
    "Goal",
    "HalfSpace",
    "InvalidFile",
    "InvalidInput",
    "Jerk",
    "KeepAcceleration",
    "Known",
    "LaggedVelocity",
    "Limits",
    "Manoeuvre",
    "Method",
    "Mix",
    "MostClearance",
    "Navigator",
    "Objective",
    "Obstacle",
    "Outcome",
    "OutsideSpan",
    "PiecewisePolynomial",
    "Response",
    "Sampled",
    "Shape",
    "SlalomError",
    "State",
    "Stationary",
    "Status",
    "Traffic",
    "Trajectory",
    "Velocity",
    "admissible_ball",
    "advance",
    "control_obstacle",
    "method",
    "preferred_control",
    "select",
    "select_clearest",
]
