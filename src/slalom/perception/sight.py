"""Limited sight: what a robot sees of the plane, and where hidden agents may come from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import expm1, hypot, inf, pi
from typing import Annotated, Any, Final, Literal

import numpy as np
import shapely

from slalom.base.checks import (
    STATE,
    Array,
    NotNegative,
    Positive,
    check_fields,
    flag,
    has,
    known,
    not_before,
    not_negative,
    number,
    or_infinite,
    positive,
)
from slalom.base.errors import InvalidInput
from slalom.base.tolerances import REST
from slalom.kernels.arrays import Flags
from slalom.model.shape import Polyline
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.model.uncertainty import BoundedError
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.obstacle.window import Obstacles, each_for_one

SIGHT_LINES: Final = 16
"""[1] Straight edges in a quarter of a circle: of the range of sight, and of round bodies that hide others. Visible
regions are inside the true ones, by at most 0.5 (pi / 4 / SIGHT_LINES)^2 of the radius. Larger: closer, slower."""

SIGHT_ERROR: Final = 1e-3
"""[m] Tolerance to which the outline of the region that holds nothing hidden is simplified at each decision. Hidden
obstacles are larger by as much. Larger: fewer, coarser edges. Smaller: more edges, slower decisions."""

SIGHT_SEAM: Final = 5e-3
"""[m] Distance from walls within which an edge of that region lies on the wall, so that nothing comes through it.
Larger: gaps of that width next to walls count as closed. Smaller: walls let hidden obstacles through."""

SIGHT_FAR: Final = 1e4
"""[1] Length of the shadows of obstacles, as a multiple of the range of sight. Larger: rounding of their corners.
Smaller: the end of the shadow of a long wall close by lies within the range."""


OCCLUSIONS: Final = ("none", "walls", "all")
FULL_TURN: Final = 2.0 * pi
"""[rad] Field of view of a sensor that observes all directions. Smaller: agents behind the robot are hidden."""
CIRCUMSCRIBED: Final = 1.0 / float(np.cos(pi / (4.0 * SIGHT_LINES)))
"""[1] Radius of a polygon about a circle of radius 1, in which shapely draws it."""


@dataclass(frozen=True, eq=False)
class Visibility:
    """Visible region and obstacles of a robot at `time` [s], see `Sight.look`.

    Attributes:
        position: (2,) [m] of the sensor. heading: [rad] of the field of view.
        visible: (n,) whether each obstacle is seen.
        seen: the obstacles at rest, which are a known map, and those that are seen.
        region: the visible region, a shapely polygon. It is inside the true one.
        bodies: the visible obstacles that move, a shapely geometry.
        clear: the region that holds no hidden agent: what is visible, and what was and cannot have been reached since.
            None without a hidden speed.
        frontier: lines through which hidden agents can enter `clear`. None without a hidden speed.
        hidden: the obstacles that stand for them. Contact with a robot at rest does not count (passive safety).
        entries: number of agents that came into view so far, but for those at the first look.
        watched: [m s] length of the frontier, times the time for which it was one.
        agents: of each that is in view, or was within `Sight.entry_time`: when it was last, and its body.
    """

    time: float
    position: Array
    heading: float
    visible: Flags
    seen: tuple[Obstacle, ...]
    region: Any
    bodies: Any
    clear: Any = None
    frontier: Any = None
    hidden: tuple[Obstacle, ...] = ()
    entries: int = 0
    watched: float = 0.0
    agents: Mapping[str, tuple[float, Any]] = field(default_factory=dict)

    @property
    def entry_rate(self) -> float:
        """Entries [1/(m s)] per length and time of the frontier: one more than there were, so never 0."""
        return (self.entries + 1) / self.watched if self.watched else inf

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles for a decision: `seen` and `hidden`."""
        return (*self.seen, *self.hidden)


@dataclass(frozen=True)
class Sight:
    """Sensor with a limited range, a field of view and occlusion, in the plane.

    Attributes:
        range: [m] up to which the sensor sees.
        field_of_view: [rad] full angle about the heading: that of the state, else the direction of motion, else the
            heading before.
        near: [m] up to which everything around the robot is sensed, outside of the field of view as well. With less
            than its radius a hidden agent may touch the robot already, of which decisions take no account.
        occlusion: what hides what is behind it: "none", "walls" (all obstacles at rest), or "all" obstacles.
        hidden_speed: [m/s] up to which agents may move that are hidden; None: there are none. Then obstacles grow from
            the edge of what is known to be empty: from the range, from shadows and from the sides of the field of view.
            They never pass through obstacles at rest. A contact with a robot at rest does not count: it keeps a
            manoeuvre that ends at rest before anything hidden can reach it (passive safety: Macek, Vasquez, Fraichard
            and Siegwart, 2008; Bouraine, Fraichard and Salhi, Autonomous Robots 32, 2012).
        any_motion: whether seen agents, too, may move in any way at up to the hidden speed. False: as predicted.
        entry_time: [s] Of hidden obstacles: their probability is that of an entry within this time, at the rate of the
            agents that entered so far. `Risk` says which of them a robot passes. One that appears where another was
            lost, not longer ago, is no entry. None: an entry is certain.

    Raises:
        InvalidInput: a value out of its range; a hidden speed with an infinite range; an entry time without one.
    """

    range: float = 10.0
    field_of_view: Positive = FULL_TURN
    near: NotNegative = 0.0
    occlusion: Literal["none", "walls", "all"] = "walls"
    hidden_speed: Annotated[float | None, not_negative] = None
    any_motion: bool = False
    entry_time: Annotated[float | None, positive] = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "range", or_infinite(self.range, "range", positive))
        check_fields(self)
        if self.field_of_view > FULL_TURN:
            raise InvalidInput(f"field_of_view: expected at most 2 pi rad, found {self.field_of_view:g}")
        known(self.occlusion, "occlusion", OCCLUSIONS)
        object.__setattr__(self, "any_motion", flag(self.any_motion, "any_motion"))
        if self.hidden_speed is not None and self.range == inf:
            raise InvalidInput("range: expected a finite one with a hidden speed, found inf")
        if self.entry_time is not None and self.hidden_speed is None:
            raise InvalidInput("hidden_speed: expected a speed [m/s] with an entry time, found None")

    def look(
        self, state: State, obstacles: Obstacles, now: float = 0.0, previous: Visibility | None = None
    ) -> Visibility:
        """The visibility of `obstacles` for a robot in `state` at `now` [s].

        Args:
            previous: the visibility before. Regions that were seen stay known to be empty until a hidden agent can
                have reached them. None: only the visible region is known.

        Raises:
            InvalidInput: a state or obstacles in space; a time before that of `previous`; an obstacle whose trajectory
                ended before, see `Obstacle.after_end`.
        """
        has(state, *STATE, "state")
        now = number(now, "now")
        if previous is not None:
            has(previous, ("clear", "heading"), "what Sight.look returned", "previous")
            not_before(now, previous.time, "now", "a look")
        if state.dimension != 2:
            raise InvalidInput(f"sight: expected a scene in the plane, found dimension {state.dimension}")
        given = each_for_one(obstacles, state.dimension, now)
        sensor, heading = shapely.Point(state.position), _heading(state, previous)
        # After the end of their trajectories.
        known_now = [o.known_at(now) for o in given]
        fixed = tuple(o for o in given if o.at_rest and o.contact_at_rest)
        parts, seam = _walls(fixed)
        numbers = [k for k, o in enumerate(known_now) if not given[k].at_rest and self._is_near(o, state.position, now)]
        bodies = [_body(known_now[k], now) for k in numbers]
        region = self._field(state.position, heading)
        if self.occlusion != "none":
            region = region.difference(self._shadow(state.position, parts))
        shadows = [self._shadow(state.position, [body]) if self.occlusion == "all" else None for body in bodies]
        visible = np.zeros(len(given), np.bool_)
        at_rest = [k for k, o in enumerate(given) if o.at_rest]
        # The surface of a wall bounds the region.
        visible[at_rest] = shapely.distance(_resting(tuple(given[k] for k in at_rest)), region) <= SIGHT_ERROR
        visible[numbers] = [_shows_beside(region, k, bodies, shadows) for k in range(len(bodies))]
        if self.occlusion == "all":
            region = region.difference(shapely.union_all(shadows))
        seen = tuple(o for k, o in enumerate(given) if visible[k] or o.at_rest)
        agents = {given[k].name or f"obstacle {k}": (now, body) for k, body in zip(numbers, bodies) if visible[k]}
        shown = shapely.union_all([body for _, body in agents.values()])
        found = Visibility(now, state.position, heading, visible, seen, region, shown, agents=agents)
        if self.hidden_speed is None:
            return found
        if self.occlusion == "all":
            seam = seam.union(shown.buffer(SIGHT_SEAM, SIGHT_LINES))
        return self._with_hidden(found, seam, sensor, previous)

    def _is_near(self, obstacle: Obstacle, position: Array, now: float) -> bool:
        """Whether an obstacle exists and is within the range, or may be: others are not seen and hide nothing."""
        if not obstacle.exists(now):
            return False
        reach = max(self.range, self.near) + CIRCUMSCRIBED * obstacle.shape.bounding_radius + SIGHT_ERROR
        return hypot(*(obstacle.trajectory.position(now) - position)) <= reach

    def _field(self, position: Array, heading: float) -> Any:
        """The disc or sector that the sensor covers, without occlusion."""
        radius = min(self.range, 1e6)
        turn = min(self.field_of_view, FULL_TURN)
        count = max(int(np.ceil(4 * SIGHT_LINES * turn / FULL_TURN)), 2)
        angles = heading + turn * (np.arange(count + 1) / count - 0.5)
        arc = position + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        if turn == FULL_TURN:
            return shapely.Polygon(arc[:-1])
        sector = shapely.Polygon(np.vstack([position, arc]))
        return sector.union(shapely.Point(position).buffer(self.near, SIGHT_LINES)) if self.near > 0.0 else sector

    def _shadow(self, position: Array, parts: Any) -> Any:
        """The region that convex polygons hide from a sensor at `position` (2,) [m], with themselves.

        With c a point of one of them and s the sensor, all s + m (c - s), m >= 1. One that covers the sensor hides
        nothing.
        """
        near = min(self.range, 1e6)
        hulls, distances = [], shapely.distance(np.array(parts, dtype=object), shapely.Point(position))
        for k in np.flatnonzero((distances > 0.0) & (distances <= near)).tolist():
            corners = shapely.get_coordinates(parts[k])
            away = corners - position
            far = position + away * (SIGHT_FAR * near / np.hypot(*away.T))[:, None]
            hulls.append(shapely.MultiPoint(np.vstack([corners, far])).convex_hull)
        return shapely.union_all(hulls)

    def _with_hidden(self, found: Visibility, seam: Any, sensor: Any, previous: Visibility | None) -> Visibility:
        """The visibility with the region known to be empty, and with hidden agents at its edge outside `seam`."""
        assert self.hidden_speed is not None
        clear = found.region
        if previous is not None and previous.clear is not None:
            found = self._counted(found, previous)
            reach = self.hidden_speed * (found.time - previous.time) * CIRCUMSCRIBED + SIGHT_ERROR
            # What was seen before, and is not now, may be anywhere near; hidden agents have come as far.
            lost = shapely.union_all([previous.frontier, previous.bodies]).buffer(reach, SIGHT_LINES)
            clear = clear.union(previous.clear.difference(lost))
        clear = shapely.simplify(clear, SIGHT_ERROR)
        parts = shapely.get_parts(clear)
        clear = parts[int(np.argmin(shapely.distance(parts, sensor)))] if len(parts) else shapely.Polygon()
        frontier = clear.boundary.difference(seam)
        growth = BoundedError(SIGHT_ERROR, self.hidden_speed)
        rate = inf if self.entry_time is None else self.entry_time * found.entry_rate
        hidden = [_edge(line, growth, rate, k) for k, line in enumerate(_lines(frontier))]
        if self.any_motion:
            hidden += [_anywhere(o.known_at(found.time), found.time, growth) for o in found.seen if not o.at_rest]
        return replace(found, clear=clear, frontier=frontier, hidden=tuple(hidden))

    def _counted(self, found: Visibility, previous: Visibility) -> Visibility:
        """The visibility with the entries since the previous look, and how long its frontier was watched."""
        assert self.hidden_speed is not None
        now, since = found.time, self.entry_time or 0.0
        lost = {
            name: one for name, one in previous.agents.items() if name not in found.agents and one[0] >= now - since
        }
        entries, agents = previous.entries, {**lost, **found.agents}
        for name in (name for name in found.agents if name not in previous.agents):
            body = found.agents[name][1]
            apart = {n: was.distance(body) for n, (t, was) in lost.items()}
            reached = [n for n in lost if apart[n] <= self.hidden_speed * (now - lost[n][0]) + SIGHT_ERROR]
            if not reached:
                entries += 1
            else:
                # One that was lost is found again once.
                nearest = min(reached, key=lambda n: apart[n])
                del lost[nearest], agents[nearest]
        watched = previous.watched + previous.frontier.length * (now - previous.time)
        return replace(found, entries=entries, watched=watched, agents=agents)


def _heading(state: State, previous: Visibility | None) -> float:
    """Direction [rad] of the sensor."""
    if state.heading is not None:
        return state.heading
    if hypot(*state.velocity) > REST or previous is None:
        return float(np.arctan2(state.velocity[1], state.velocity[0]))
    return previous.heading


def _polygons(obstacle: Obstacle, now: float) -> list[Any]:
    """The convex parts of an obstacle, as shapely polygons about its round sides."""
    found = []
    for part in outline_parts(obstacle, now):
        hull = shapely.MultiPoint(part.corners).convex_hull
        found.append(hull.buffer(CIRCUMSCRIBED * part.radius, SIGHT_LINES) if part.radius > 0.0 else hull)
    return found


def _body(obstacle: Obstacle, now: float) -> Any:
    parts = _polygons(obstacle, now)
    return parts[0] if len(parts) == 1 else shapely.union_all(parts)


@lru_cache(maxsize=16)
def _resting(obstacles: tuple[Obstacle, ...]) -> list[Any]:
    """The bodies of obstacles at rest."""
    return [_body(obstacle, 0.0) for obstacle in obstacles]


@lru_cache(maxsize=16)
def _walls(fixed: tuple[Obstacle, ...]) -> tuple[tuple[Any, ...], Any]:
    """The convex parts of obstacles at rest; and what is within SIGHT_SEAM of them."""
    parts = tuple(part for obstacle in fixed for part in _polygons(obstacle, 0.0))
    return parts, shapely.union_all(parts).buffer(SIGHT_SEAM, SIGHT_LINES)


def _shows(region: Any, body: Any) -> bool:
    """Whether a part of a body is in a region, more than its edge."""
    return bool(region.intersection(body).area > 0.0) if body.area > 0.0 else bool(region.intersects(body))


def _shows_beside(region: Any, k: int, bodies: list[Any], shadows: list[Any]) -> bool:
    """Whether body k is seen in a region, in which the shadows of the other bodies hide it."""
    if not _shows(region, bodies[k]):
        return False
    for other, shadow in enumerate(shadows):
        if other != k and shadow is not None and shadow.intersects(bodies[k]):
            region = region.difference(shadow)
    return _shows(region, bodies[k])


def _lines(frontier: Any) -> list[Array]:
    """The points (k, 2) [m] of each line of a frontier."""
    merged = shapely.line_merge(frontier) if frontier.geom_type == "MultiLineString" else frontier
    lines = [shapely.simplify(line, 0.0) for line in shapely.get_parts(merged)]
    return [shapely.get_coordinates(line) for line in lines if line.length > SIGHT_ERROR]


def _edge(points: Array, growth: BoundedError, rate: float, number: int) -> Obstacle:
    """Obstacle for hidden agents that enter through a line (k, 2) [m], of which `rate` [1/m] come within the time."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    line, length = Polyline(points - middle), float(np.hypot(*np.diff(points, axis=0).T).sum())
    entered = Obstacle(line, Stationary(middle), "hidden", uncertainty=growth, contact_at_rest=False)
    return entered if rate == inf else replace(entered, probability=-expm1(-rate * length), owner=f"hidden {number}")


def _anywhere(obstacle: Obstacle, now: float, growth: BoundedError) -> Obstacle:
    """Obstacle for all places that a visible obstacle can reach in any motion."""
    heading = obstacle.angle
    if heading is None:
        heading = float(np.arctan2(*obstacle.direction(now)[::-1]))
    here = Stationary(obstacle.trajectory.position(now))
    more = 0.0 if obstacle.uncertainty is None else float(obstacle.uncertainty.radius(0.0, 2))
    unsure = replace(growth, position=growth.position + more)
    return Obstacle(obstacle.shape, here, obstacle.name, heading, unsure, "continues", False)
