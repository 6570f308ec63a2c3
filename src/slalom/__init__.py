"""slalom: reactive robot navigation with velocity and acceleration obstacles.

One concept: a control moves the robot by an affine map with a scalar gain (`response`); an obstacle (`shape` on a
`trajectory`) blocks the controls that lead into it (`ControlObstacle`); `select` finds the admissible control nearest
to the preferred one that collides with nothing; `Navigator` turns choices into safe motion; `slalom.sim` simulates,
records and measures; `slalom.view` draws.

Names are imported when they are first asked for: the command line answers without numpy, `slalom.Disc` without numba.
"""

from typing import TYPE_CHECKING

from slalom.late import offer

if TYPE_CHECKING:
    from slalom.affine import Affine
    from slalom.batch import Choices, select_many
    from slalom.bounds import Bound, Box, ConvexPolygon, Friction, HeadingCone, LeastSpeed, TurningRadius
    from slalom.control_obstacle import ControlObstacle, Element, control_obstacle
    from slalom.decision import Decision, Outcome
    from slalom.errors import InvalidFile, InvalidInput, OutsideSpan, SlalomError
    from slalom.forecast import (
        FORESIGHTS,
        AcceleratingBriefly,
        AtConstantAcceleration,
        AtConstantTurn,
        AtConstantVelocity,
        Forecast,
        FromPast,
        Known,
        Present,
    )
    from slalom.goal import Goal
    from slalom.horizon import Horizon, HorizonByName, SafeTime
    from slalom.limits import Admissible, HalfSpace, Limits, admissible_ball
    from slalom.lookahead import LookAhead, Planned
    from slalom.manoeuvre import Manoeuvre
    from slalom.methods import METHODS, Method, method
    from slalom.navigator import Navigator
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
    from slalom.plan import AccelerateInTurn
    from slalom.response import (
        AccelerateThenBrake,
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
    from slalom.shape import Ball, Capsule, Disc, Part, Polygon, Polyline, Rectangle, Shape, Union
    from slalom.state import State
    from slalom.traffic import Traffic
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
    from slalom.uncertainty import BoundedError, GaussianError, Uncertainty

__version__ = "0.1.0"

__all__ = [
    "FORESIGHTS",
    "METHODS",
    "AccelerateInTurn",
    "AccelerateThenBrake",
    "AccelerateThenCoast",
    "AccelerateThenStop",
    "AcceleratingBriefly",
    "Acceleration",
    "Admissible",
    "Affine",
    "Aim",
    "Arrive",
    "AtConstantAcceleration",
    "AtConstantTurn",
    "AtConstantVelocity",
    "Ball",
    "Bound",
    "BoundedError",
    "Box",
    "Capsule",
    "Choice",
    "Choices",
    "Circular",
    "Composite",
    "ConstantAcceleration",
    "ConstantVelocity",
    "ControlObstacle",
    "ConvexPolygon",
    "Decision",
    "Disc",
    "Element",
    "FollowVelocity",
    "Forecast",
    "Friction",
    "FromPast",
    "Function",
    "GaussianError",
    "Goal",
    "HalfSpace",
    "HeadingCone",
    "Horizon",
    "HorizonByName",
    "InvalidFile",
    "InvalidInput",
    "Jerk",
    "KeepAcceleration",
    "Known",
    "LaggedVelocity",
    "LeastSpeed",
    "Limits",
    "LookAhead",
    "Manoeuvre",
    "Method",
    "Mix",
    "MostClearance",
    "Navigator",
    "Objective",
    "Obstacle",
    "Outcome",
    "OutsideSpan",
    "Part",
    "PiecewisePolynomial",
    "Planned",
    "Polygon",
    "Polyline",
    "Present",
    "Rectangle",
    "Response",
    "SafeTime",
    "Sampled",
    "Shape",
    "SlalomError",
    "State",
    "Stationary",
    "Status",
    "Traffic",
    "Trajectory",
    "TurningRadius",
    "Uncertainty",
    "Union",
    "Velocity",
    "admissible_ball",
    "advance",
    "control_obstacle",
    "method",
    "preferred_control",
    "select",
    "select_clearest",
    "select_many",
]

offer(
    __name__,
    {
        "affine": ("Affine",),
        "batch": ("Choices", "select_many"),
        "bounds": ("Bound", "Box", "ConvexPolygon", "Friction", "HeadingCone", "LeastSpeed", "TurningRadius"),
        "control_obstacle": ("ControlObstacle", "Element", "control_obstacle"),
        "decision": ("Decision", "Outcome"),
        "errors": ("InvalidFile", "InvalidInput", "OutsideSpan", "SlalomError"),
        "forecast": (
            "FORESIGHTS",
            "AcceleratingBriefly",
            "AtConstantAcceleration",
            "AtConstantTurn",
            "AtConstantVelocity",
            "Forecast",
            "FromPast",
            "Known",
            "Present",
        ),
        "goal": ("Goal",),
        "horizon": ("Horizon", "HorizonByName", "SafeTime"),
        "limits": ("Admissible", "HalfSpace", "Limits", "admissible_ball"),
        "lookahead": ("LookAhead", "Planned"),
        "manoeuvre": ("Manoeuvre",),
        "methods": ("METHODS", "Method", "method"),
        "navigator": ("Navigator",),
        "objective": (
            "Aim",
            "Arrive",
            "FollowVelocity",
            "KeepAcceleration",
            "Mix",
            "MostClearance",
            "Objective",
            "preferred_control",
        ),
        "obstacle": ("Obstacle",),
        "plan": ("AccelerateInTurn",),
        "response": (
            "AccelerateThenBrake",
            "AccelerateThenCoast",
            "AccelerateThenStop",
            "Acceleration",
            "Jerk",
            "LaggedVelocity",
            "Response",
            "Velocity",
            "advance",
        ),
        "selection": ("Choice", "Status", "select", "select_clearest"),
        "shape": ("Ball", "Capsule", "Disc", "Part", "Polygon", "Polyline", "Rectangle", "Shape", "Union"),
        "state": ("State",),
        "traffic": ("Traffic",),
        "trajectory": (
            "Circular",
            "Composite",
            "ConstantAcceleration",
            "ConstantVelocity",
            "Function",
            "PiecewisePolynomial",
            "Sampled",
            "Stationary",
            "Trajectory",
        ),
        "uncertainty": ("BoundedError", "GaussianError", "Uncertainty"),
    },
)
