"""The public names of slalom, each once; they are imported when they are first used."""

__version__: str

from . import io as io, live as live, peers as peers, sim as sim, vehicle as vehicle, view as view
from .base.errors import (
    InvalidFile as InvalidFile,
    InvalidInput as InvalidInput,
    MissingExtra as MissingExtra,
    OutsideSpan as OutsideSpan,
    SlalomError as SlalomError,
)
from .choice.control_obstacle import (
    ControlObstacle as ControlObstacle,
    Element as Element,
    control_obstacle as control_obstacle,
)
from .choice.selection import (
    Choice as Choice,
    Choices as Choices,
    Status as Status,
    select as select,
    select_clearest as select_clearest,
    select_many as select_many,
)
from .computer import compile as compile, work_per_second as work_per_second
from .decision import Decision as Decision, Outcome as Outcome
from .decision.methods import METHODS as METHODS, Method as Method
from .decision.navigator import Navigator as Navigator
from .decision.objective import (
    Aim as Aim,
    Arrive as Arrive,
    Candidates as Candidates,
    FollowAcceleration as FollowAcceleration,
    FollowVelocity as FollowVelocity,
    KeepAcceleration as KeepAcceleration,
    Mix as Mix,
    MostClearance as MostClearance,
    Objective as Objective,
    Situation as Situation,
    preferred_control as preferred_control,
)
from .decision.settings import (
    Horizon as Horizon,
    HorizonByName as HorizonByName,
    Risk as Risk,
    SafeTime as SafeTime,
    Settings as Settings,
)
from .fleet.fleet import Fleet as Fleet, FleetDecision as FleetDecision
from .fleet.routes import routes as routes
from .forecast.forecast import (
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
from .io.walls import Walls as Walls, read_map as read_map, read_walls as read_walls
from .lookahead.expected_loss import ExpectedLoss as ExpectedLoss
from .lookahead.navigator import LookAhead as LookAhead, SequenceDecision as SequenceDecision
from .model.bounds import (
    Bound as Bound,
    Box as Box,
    ConvexPolygon as ConvexPolygon,
    Friction as Friction,
    HeadingCone as HeadingCone,
    LeastSpeed as LeastSpeed,
    TurningRadius as TurningRadius,
)
from .model.goal import Goal as Goal
from .model.limits import (
    AccelerationLag as AccelerationLag,
    Admissible as Admissible,
    HalfSpace as HalfSpace,
    Limits as Limits,
    admissible_ball as admissible_ball,
)
from .model.manoeuvre import Manoeuvre as Manoeuvre
from .model.path_goal import PathGoal as PathGoal
from .model.response import (
    AccelerateThenBrake as AccelerateThenBrake,
    AccelerateThenCoast as AccelerateThenCoast,
    AccelerateThenStop as AccelerateThenStop,
    AccelerateThenTurn as AccelerateThenTurn,
    Acceleration as Acceleration,
    Jerk as Jerk,
    LaggedVelocity as LaggedVelocity,
    Response as Response,
    Velocity as Velocity,
    advance as advance,
)
from .model.response.kinds import AccelerationSequence as AccelerationSequence
from .model.shape import (
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
from .model.state import Affine as Affine, State as State
from .model.trajectory import (
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
from .model.uncertainty import (
    BoundedError as BoundedError,
    GaussianError as GaussianError,
    KalmanError as KalmanError,
    Uncertainty as Uncertainty,
)
from .obstacle import Headings as Headings, Obstacle as Obstacle
from .obstacle.occupancy import OccupancyTable as OccupancyTable, occupancy as occupancy
from .obstacle.scan import Scan as Scan, scan as scan
from .obstacle.table import ObstacleTable as ObstacleTable
from .obstacle.tracks import Tracks as Tracks
from .obstacle.window import ObstacleWindow as ObstacleWindow
from .peers.table import method as method
from .perception.conformal import Calibration as Calibration, Coverage as Coverage
from .perception.crowd import AvoidingCrowd as AvoidingCrowd
from .perception.reciprocity import Reciprocity as Reciprocity
from .perception.sight import Sight as Sight, Visibility as Visibility
from .perception.tracker import (
    ConstantVelocityFilter as ConstantVelocityFilter,
    Estimate as Estimate,
    Filter as Filter,
    Measurement as Measurement,
    Tracker as Tracker,
)
from .vehicle.driver import Drive as Drive, Driver as Driver, DriveStatus as DriveStatus
