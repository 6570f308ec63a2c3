"""The public names of slalom, each once; they are imported when they are first used."""

__version__: str

from . import io as io, peers as peers, sim as sim, tracking as tracking, vehicle as vehicle, view as view
from .affine import Affine as Affine
from .bounds import (
    Bound as Bound,
    Box as Box,
    ConvexPolygon as ConvexPolygon,
    Friction as Friction,
    HeadingCone as HeadingCone,
    LeastSpeed as LeastSpeed,
    TurningRadius as TurningRadius,
)
from .conformal import (
    Calibration as Calibration,
    Coverage as Coverage,
    enclosing_error as enclosing_error,
)
from .control_obstacle import (
    ControlObstacle as ControlObstacle,
    Element as Element,
    control_obstacle as control_obstacle,
)
from .decision import (
    Decision as Decision,
    Outcome as Outcome,
)
from .decision.futures import Risk as Risk
from .decision.navigator import Navigator as Navigator
from .errors import (
    InvalidFile as InvalidFile,
    InvalidInput as InvalidInput,
    OutsideSpan as OutsideSpan,
    SlalomError as SlalomError,
)
from .fleet.fleet import (
    Fleet as Fleet,
    FleetDecision as FleetDecision,
)
from .forecast import (
    FORESIGHTS as FORESIGHTS,
    AcceleratingBriefly as AcceleratingBriefly,
    AtConstantAcceleration as AtConstantAcceleration,
    AtConstantTurn as AtConstantTurn,
    AtConstantVelocity as AtConstantVelocity,
    Forecast as Forecast,
    FromModels as FromModels,
    FromPast as FromPast,
    Known as Known,
    Present as Present,
)
from .goal import Goal as Goal
from .lag import AccelerationLag as AccelerationLag
from .limits import (
    Admissible as Admissible,
    HalfSpace as HalfSpace,
    Limits as Limits,
    admissible_ball as admissible_ball,
)
from .lookahead.expected_loss import ExpectedLoss as ExpectedLoss
from .lookahead.navigator import (
    LookAhead as LookAhead,
    SequenceDecision as SequenceDecision,
)
from .manoeuvre import Manoeuvre as Manoeuvre
from .methods import (
    METHODS as METHODS,
    Method as Method,
)
from .mutual_avoidance import AvoidingCrowd as AvoidingCrowd
from .objective import (
    Aim as Aim,
    Arrive as Arrive,
    FollowAcceleration as FollowAcceleration,
    FollowVelocity as FollowVelocity,
    KeepAcceleration as KeepAcceleration,
    Mix as Mix,
    MostClearance as MostClearance,
    Objective as Objective,
    preferred_control as preferred_control,
)
from .obstacle import Headings as Headings, Obstacle as Obstacle
from .obstacle.horizon import (
    Horizon as Horizon,
    HorizonByName as HorizonByName,
    SafeTime as SafeTime,
)
from .obstacle.table import ObstacleTable as ObstacleTable
from .obstacle.track_filter import (
    ConstantVelocityFilter as ConstantVelocityFilter,
    Estimate as Estimate,
    Filter as Filter,
    Measurement as Measurement,
)
from .obstacle.tracker import Tracker as Tracker
from .obstacle.tracks import Tracks as Tracks
from .obstacle.window import ObstacleWindow as ObstacleWindow
from .path_goal import PathGoal as PathGoal
from .peers.table import method as method
from .precompile import compile as compile
from .reciprocity import Reciprocity as Reciprocity
from .response import (
    AccelerateThenBrake as AccelerateThenBrake,
    AccelerateThenCoast as AccelerateThenCoast,
    AccelerateThenStop as AccelerateThenStop,
    Acceleration as Acceleration,
    Jerk as Jerk,
    LaggedVelocity as LaggedVelocity,
    Response as Response,
    Velocity as Velocity,
    advance as advance,
)
from .response.sequence import AccelerationSequence as AccelerationSequence
from .selection import (
    Choice as Choice,
    Choices as Choices,
    Status as Status,
    select as select,
    select_clearest as select_clearest,
    select_many as select_many,
)
from .shape import (
    Ball as Ball,
    Capsule as Capsule,
    Disc as Disc,
    Part as Part,
    Polygon as Polygon,
    Polyline as Polyline,
    Rectangle as Rectangle,
    Shape as Shape,
    Union as Union,
)
from .sight import (
    Sight as Sight,
    Visibility as Visibility,
)
from .state import State as State
from .trajectory import (
    Circular as Circular,
    Composite as Composite,
    ConstantAcceleration as ConstantAcceleration,
    ConstantVelocity as ConstantVelocity,
    Function as Function,
    PiecewisePolynomial as PiecewisePolynomial,
    Sampled as Sampled,
    Stationary as Stationary,
    Trajectory as Trajectory,
)
from .uncertainty import (
    BoundedError as BoundedError,
    GaussianError as GaussianError,
    KalmanError as KalmanError,
    Uncertainty as Uncertainty,
)
from .work_rate import work_per_second as work_per_second
