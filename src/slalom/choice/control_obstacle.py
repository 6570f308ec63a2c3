"""The control obstacle: all controls that lead to a collision within the horizon."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom import kernels
from slalom.base.checks import Array, each_number, not_negative, number, positive, refuse_kinds, vector, vectors
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import OVERLAP, REST_ROUNDING
from slalom.choice.envelope import RelativeMotion, grazing_curves, in_frame_of_gain
from slalom.kernels.arrays import Bodies, Corners, Hulls, MaybeHulls, PositionMap, Segments
from slalom.model.response import Response
from slalom.model.response.protocol import parts_of_gain, piece_norm, response_pieces, rest_time
from slalom.model.shape import Shape, refuse_turned
from slalom.model.state import State
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import hull_corners, outline_parts
from slalom.obstacle.window import ObstacleWindow

BOUNDARY: Final = 2.5e-5
"""[1] How far the drawn boundary of a control obstacle may be off, as a share of the radius of the window. Smaller by
4: twice as many points. It never decides about collisions."""


class Element(NamedTuple):
    """Temporal elements at one time: a rounded convex hull of controls for each body that exists then."""

    corners: tuple[Array, ...]  # b arrays (n, d): one corner is a ball, two a capsule, more a polygon in the plane
    radii: Array  # (b,)
    owners: npt.NDArray[np.int64]  # (b,) index of the obstacle

    @property
    def centers(self) -> Array:
        """Middles of the hulls (b, d): of balls their centres."""
        return np.array([0.5 * (corners.min(axis=0) + corners.max(axis=0)) for corners in self.corners])


class Boundary(NamedTuple):
    """The control obstacle of each obstacle within a window, as shapely polygons."""

    regions: tuple[Any, ...]  # n, in the order of the obstacles; an empty one where nothing is blocked

    @property
    def region(self) -> Any:
        """All of them together."""
        import shapely

        return shapely.union_all(self.regions)

    @property
    def curves(self) -> list[Array]:
        """The boundary of `region`: closed curves (k, 2), the first point again at the end."""
        import shapely

        polygons = shapely.get_parts(self.region)
        return [shapely.get_coordinates(ring) for polygon in polygons for ring in shapely.get_rings(polygon)]


@lru_cache(maxsize=256)
def _ahead(n: int) -> Array:
    """Directions (4, 2, n) of bodies that do not turn."""
    return np.broadcast_to(np.array([[1.0], [0.0]]), (4, 2, n))


NO_CORNERS: Final = Corners(np.empty((0, 5)), np.zeros(1, np.int64), np.empty(0, np.bool_))


@dataclass(frozen=True, eq=False)
class ControlObstacle:
    """The controls with which the robot collides with an obstacle within (0, horizon].

    The union over time of the temporal elements (B(t) - drift(t)) / gain(t) (Bareiss and van den Berg 2015). B(t) is
    the obstacle grown by the robot's shape and by `margin`. With the Acceleration response it is the AO or NAO of Stern
    and Shiller 2025, with Velocity the VO or NLVO. Whether a control belongs to it is decided in the workspace for all
    times, not at samples.

    Laws: contains(u) = (clearance(u) < 0) = (time_to_collision(u) < inf), up to CERTIFIED of clearance; a longer
    horizon, a larger radius or one more obstacle never frees a control.

    Args:
        response: the motion of the robot under a control. state: its state now.
        obstacles: the obstacles over the window that begins now.
        robot: the robot's shape. margin: [m] >= 0 to keep from every obstacle.
        horizon: [s], at most that of the obstacles, which is the default.
        largest_control: norm up to which the pieces of a response that is not cubic hold, see `for_controls`.

    Raises:
        InvalidInput: different dimensions, a horizon not above 0 or beyond that of the obstacles, tracks with worlds; a
            state with a heading for a robot that is not round: its shape keeps the axes of the world.
    """

    response: Response
    state: State
    obstacles: ObstacleWindow
    robot: Shape
    margin: float | Array = 0.0
    horizon: float = 0.0
    largest_control: float = 0.0
    _finer: dict[float, "ControlObstacle"] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        refuse_kinds(self.response, self.obstacles, self.robot, self.state)
        refuse_turned(self.robot, self.state.heading, "state: heading")
        self.obstacles.refuse_worlds()
        horizon = number(self.horizon, "horizon") or self.obstacles.horizon
        if positive(horizon, "horizon") > (longest := self.obstacles.horizon):
            raise InvalidInput(f"horizon: expected at most {longest:g} s, as of the obstacles, found {horizon:g} s")
        object.__setattr__(self, "horizon", horizon)
        if isinstance(self.margin, float):
            not_negative(self.margin, "margin")
        else:
            each = each_number(self.margin, "margin", len(self.obstacles))
            not_negative(min(float(np.min(each, initial=np.inf)), 0.0), "margin")
        for what, dimension in (("robot", self.robot.dimension), ("obstacles", self.obstacles.dimension)):
            if dimension not in (None, self.dimension):
                raise InvalidInput(f"{what}: expected dimension {self.dimension} as of the state, found {dimension}")

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.state.dimension

    @cached_property
    def _bodies(self) -> Bodies:
        return self.obstacles.bodies(self.robot)

    @cached_property
    def _distances(self) -> Array:
        """Distance (b,) [m] of each body now, its radius not subtracted; inf if it does not exist now."""
        return self.obstacles.distances(self.robot, self.state.position)[0]

    @cached_property
    def _kept(self) -> tuple[Array, bool]:
        """Radius (b,) [m] of each body with the margin, less where the robot touches it; and whether it overlaps one.

        Contact is not overlap: from an obstacle that it is within CONTACT_SLACK of, the robot may still move away.
        """
        margin, around = self.margin, self._bodies.radius
        if not isinstance(margin, float):
            each = np.asarray(margin)
            margin = each[self._bodies.owner] if each.ndim else each
        return kernels.kept_radii(self._distances, around + margin)

    @property
    def _radii(self) -> Array:
        return self._kept[0]

    @cached_property
    def initial_clearances(self) -> Array:
        """Clearance (n,) [m] to each obstacle now, margin and uncertainty subtracted; inf if it does not exist now.

        At least 0 where the robot touches the obstacle, see CONTACT_SLACK.
        """
        clearances = np.full(len(self.obstacles), np.inf)
        np.minimum.at(clearances, self._bodies.owner, self._distances - self._radii)
        return clearances

    @cached_property
    def overlapping(self) -> npt.NDArray[np.int64]:
        """Indices of the obstacles that the robot (with its margin) overlaps now, and whose contact at rest counts."""
        return np.unique(self._bodies.owner[self._bodies.at_rest & (self._distances - self._radii < -OVERLAP)])

    @property
    def overlaps(self) -> bool:
        """Whether the robot (with its margin) overlaps any obstacle now whose contact at rest counts."""
        return self._kept[1] and len(self.overlapping) > 0

    def escape_direction(self, index: int) -> Array:
        """The unit vector (d,) along which the robot leaves the nearest part of an obstacle soonest.

        For a robot inside it, the direction of the least translation that separates them; on top of a point any.
        """
        bodies = np.flatnonzero(self._bodies.owner == index)
        nearest = bodies[int(np.argmin(self._distances[bodies] - self._radii[bodies]))]
        return np.asarray(-self.obstacles.distances(self.robot, self.state.position)[1][nearest])

    def for_controls(self, largest: float) -> "ControlObstacle":
        """The same, with pieces of the response that hold for controls of up to the norm `largest`.

        Itself for usual controls, see `piece_norm`, and for responses whose pieces are exact.
        """
        norm = piece_norm(self.response, self.state, self.horizon, largest)
        if norm > self.largest_control and norm not in self._finer:
            self._finer[norm] = replace(self, largest_control=norm)
        return self._finer.get(norm, self)

    @cached_property
    def segments(self) -> RelativeMotion:
        """The relative motion from which everything else is computed."""
        bodies = self._bodies
        knots, drift, gain = response_pieces(self.response, self.state, self.horizon, self.largest_control)
        motion = PositionMap(knots, drift, *parts_of_gain(gain), straight=len(gain))  # the times of all are needed
        error = self.response.interpolation_error
        cut, bounding_radius, owner, hull = kernels.segments_of(bodies, self._radii, motion, self.horizon, error)
        if not bodies.at_rest.all():
            rest = rest_time(self.response, self.state, self.horizon)
            over = ~bodies.at_rest[cut.body] & (cut.begin >= rest - REST_ROUNDING)
            cut.radius[over] = -np.inf
            cut.growth[over] = 0.0
            bounding_radius[over] = -np.inf
        turns = cut.turns if bodies.turning else _ahead(len(owner))
        turns = np.ascontiguousarray(turns) if bodies.corners else turns
        table = Segments(cut.points, cut.gains, cut.cross, cut.radius, cut.growth, bounding_radius)
        hulls = Hulls(hull, turns, *(bodies.corners or NO_CORNERS))
        return RelativeMotion(cut.begin, cut.end, owner, table, hulls)

    @cached_property
    def table(self) -> tuple[Segments, MaybeHulls]:
        """The segments and their hulls as kernels take them: none where all bodies are points."""
        table, hulls = self.segments.table, self.segments.hulls
        return table, hulls if hulls.hull.max(initial=-1) >= 0 else ()

    def _controls(self, controls: npt.ArrayLike) -> tuple[Array, tuple[int, ...], "ControlObstacle"]:
        """Controls (n, 3), the shape in which they were given, and the control obstacle that holds for them."""
        u = vectors(controls, "controls", self.dimension)
        flat = np.zeros((u.size // self.dimension, 3))
        flat[:, : self.dimension] = u.reshape(-1, self.dimension)
        if self.response.interpolation_error == 0.0:
            return flat, u.shape[:-1], self
        return flat, u.shape[:-1], self.for_controls(float(np.linalg.norm(flat, axis=1).max(initial=0.0)))

    def clearances(self, controls: npt.ArrayLike) -> Array:
        """Least distance between surfaces over (0, horizon] for controls (..., d) and each obstacle: (..., n) [m].

        Negative when overlapping, inf for an obstacle that does not appear. Never above the true minimum by more than
        CLEARANCE, below it by at most CERTIFIED, and by CONTACT_SLACK more where the robot already touches it.
        """
        flat, shape, finer = self._controls(controls)
        count = len(self.obstacles)
        return kernels.least_clearances(*finer.table, finer.segments.owner, count, flat).reshape(*shape, count)

    def clearance(self, controls: npt.ArrayLike) -> Array:
        """The least of `clearances`: (...) [m]; inf without obstacles."""
        return np.asarray(self.clearances(controls).min(axis=-1, initial=np.inf))

    def contains(self, controls: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether controls (..., d) collide within the horizon: (...)."""
        return np.asarray(np.isfinite(self.time_to_collision(controls)))

    def times_to_collision(self, controls: npt.ArrayLike) -> Array:
        """Time of the first contact for controls (..., d) with each obstacle: (..., n) [s], inf if there is none."""
        flat, shape, finer = self._controls(controls)
        s, count = finer.segments, len(self.obstacles)
        return kernels.contact_times(s.begin, s.end, *finer.table, s.owner, count, flat).reshape(*shape, count)

    def time_to_collision(self, controls: npt.ArrayLike) -> Array:
        """The least of `times_to_collision`: (...) [s]."""
        return np.asarray(self.times_to_collision(controls).min(axis=-1, initial=np.inf))

    def element(self, t: float) -> Element:
        """The temporal elements at elapsed time 0 < t <= horizon: the controls that are in an obstacle at t.

        Raises:
            InvalidInput: t outside (0, horizon].
        """
        if not 0.0 < number(t, "t") <= self.horizon:
            raise InvalidInput(f"t: expected a time in (0, {self.horizon:g}] s, found {t:g} s")
        now = self.obstacles.start + t
        image = self.response.position(self.state, t)
        corners = []
        radii = []
        owners = []
        margin = np.broadcast_to(np.asarray(self.margin), (len(self.obstacles),))
        for index, obstacle in enumerate(self.obstacles.obstacles):
            if not obstacle.exists(now):
                continue
            unsure = obstacle.uncertainty
            more = float(unsure.radius(t, self.dimension)) if unsure is not None else 0.0
            for part in outline_parts(obstacle, now):
                for own in self.robot.parts:
                    places = (part.corners[:, None] - own.corners[None]).reshape(-1, self.dimension)
                    corners.append(image.inverse(places if len(places) < 3 else hull_corners(places)))
                    radii.append((part.radius + own.radius + margin[index] + more) / float(abs(image.gain)))
                    owners.append(index)
        return Element(tuple(corners), np.array(radii), np.array(owners, dtype=np.int64))

    def boundary(self, center: npt.ArrayLike, radius: float, *, tolerance: float = 0.0) -> Boundary:
        """The exact boundary in the plane within the disc of controls of `center` (2,) and `radius` > 0.

        A control is in `region` if it collides, except within about `tolerance` of the boundary. The tolerance is in
        units of the control, by default the share BOUNDARY of the radius. The curves are sampled envelopes of elements
        (Stern and Shiller 2025; docs/theory.md, 6); `times_to_collision` decides which side of them is blocked.

        Raises:
            InvalidInput: in space; a radius that is not above 0.
        """
        # Decisions need no polygons: they do not wait for shapely.
        from slalom.choice.outline import boundary

        middle, size, motion = self._window(center, radius)
        regions = boundary(
            motion,
            len(self.obstacles),
            lambda controls: np.isfinite(self.times_to_collision(controls)),
            middle,
            size,
            not_negative(tolerance, "tolerance") or BOUNDARY * size,
        )
        return Boundary(tuple(regions))

    def grazing(
        self, center: npt.ArrayLike, radius: float, *, tolerance: float = 0.0
    ) -> list[tuple[int, Array, Array]]:
        """Controls that graze an obstacle in this disc, curve by curve: (owner, times (k,) [s], controls (k, 2)).

        At that time the robot touches the obstacle and moves along its surface, relative to it. Not all of them bound
        the control obstacle: one may collide at another time. For bodies with corners: of the discs around these.
        Raises InvalidInput as `boundary`.
        """
        middle, size, motion = self._window(center, radius)
        return grazing_curves(motion, middle, size, not_negative(tolerance, "tolerance") or BOUNDARY * size)

    def _window(self, center: npt.ArrayLike, radius: float) -> tuple[Array, float, RelativeMotion]:
        if self.dimension != 2:
            raise InvalidInput("boundary: expected a control obstacle in the plane, found one in space")
        middle, size = vector(center, "center", 2), positive(radius, "radius")
        return middle, size, in_frame_of_gain(self.for_controls(float(np.linalg.norm(middle)) + size).segments)


def control_obstacle(
    response: Response,
    state: State,
    obstacles: Sequence[Obstacle],
    robot: Shape,
    *,
    horizon: float,
    start: float = 0.0,
    margin: float = 0.0,
) -> ControlObstacle:
    """The control obstacle of `obstacles` from absolute time `start` [s], for a single decision."""
    return ControlObstacle(response, state, ObstacleWindow(obstacles, start, horizon), robot, margin)
