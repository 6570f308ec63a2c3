"""Behaviour `slalom` of ir-sim, for the kinematics `omni`, `diff` and `acker`; importing this module registers it.

ir-sim holds a commanded velocity for one step and moves by it from the heading at the start of the step. Robots that
move in every direction therefore get the mean velocity of the decision over the step. Robots on wheels decide with
`VehicleNavigator`, from their measured poses. ir-sim bounds the speed and the turn rate of a differential drive
separately. The drive decides with wheels so far apart that both bounds hold.
"""

from math import cos, hypot, isfinite, sin
from typing import Any, Final

import numpy as np
import shapely

from slalom.base.checks import Array, not_negative, positive
from slalom.base.errors import Extra, InvalidInput
from slalom.decision import Decision
from slalom.decision.methods import method
from slalom.decision.navigator import Navigator
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.shape import Disc, Polygon, Polyline, Rectangle
from slalom.model.state import State
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, VehicleNavigator
from slalom.vehicle.decision import VehicleDecision

with Extra("irsim", __name__):
    from irsim.lib import register_behavior_class
    from irsim.world.map.obstacle_map import OCCUPANCY_THRESHOLD

NAME: Final = "slalom"
"""Name of the behaviour in YAML files of ir-sim."""
DEFAULTS: Final = {"method": "nao", "max_acceleration": 2.0, "horizon": 5.0, "margin": 0.05, "steering_rate": 2.0}
"""Settings of the behaviour with their default values."""
OF_IRSIM: Final = {"name", "target_roles", "wander", "range_low", "range_high", "loop"}
"""Keys of a behaviour that ir-sim itself reads."""


class Slalom:
    """Velocities of one robot, which decides anew at each step of ir-sim.

    Robots of this behaviour that move in every direction share the avoidance; all others are not expected to avoid.
    """

    def __init__(self, info: Any, **settings: Any) -> None:
        # ir-sim catches what a constructor raises: the first decision checks.
        self._kind, self._given = info.kinematics, settings
        self._navigator: Navigator | VehicleNavigator | None = None
        self._fixed: tuple[tuple[int, ...], ObstacleTable] = ((), ObstacleTable([]))
        self._previous: Decision | VehicleDecision | None = None
        self._velocity = np.zeros(2)
        self._turn = 0.0
        self._now = 0.0

    def __call__(self, ego_object: Any, external_objects: list[Any], **_: Any) -> Array:
        """Velocity (2, 1) that ir-sim applies: in the frame of the body, or speed and turn rate or steering angle."""
        dt = float(ego_object._world_param.step_time)
        now = ego_object._world_param.count * dt
        if self._navigator is None:
            self._navigator = _navigator(self._kind, ego_object, _settings(self._given), dt)
        if now <= self._now:
            # ir-sim began anew.
            self._previous = None
            self._velocity = np.zeros(2)
            self._turn = 0.0
        self._now = now
        if ego_object.goal is None:
            return np.zeros((2, 1))
        if isinstance(self._navigator, VehicleNavigator):
            return self._drive(self._navigator, ego_object, external_objects, now)
        return self._move(self._navigator, ego_object, external_objects, now)

    def _move(self, navigator: Navigator, ego: Any, others: list[Any], now: float) -> Array:
        position = ego.state[:2, 0].astype(np.float64)
        dt = navigator.period
        heading = float(ego.state[2, 0])
        same = [o for o in others if o.kinematics == self._kind and o.beh_config.get("name") == NAME]
        around: list[Obstacle | ObstacleTable | Tracks] = [self._map(others)]
        around.append(_tracks([o for o in others if o not in same], ego, now, dt))
        decision = navigator.decide(
            State(position, self._velocity),
            around,
            _goal(ego),
            robots=_tracks(same, ego, now, dt),
            now=now,
            previous=self._previous if isinstance(self._previous, Decision) else None,
        )
        acceleration = decision.manoeuvre.mean_acceleration(now, dt)
        self._previous = decision
        mean, self._velocity = self._velocity + 0.5 * dt * acceleration, self._velocity + dt * acceleration
        c, s = cos(heading), sin(heading)
        return np.array([[c, s], [-s, c]]) @ mean[:, None]

    def _drive(self, navigator: VehicleNavigator, ego: Any, others: list[Any], now: float) -> Array:
        x, y, heading = (float(value) for value in ego.state[:3, 0])
        dt, steered = navigator.period, self._kind == "acker"
        pose = Pose((x, y), heading, float(self._velocity[0]), self._turn)
        decision = navigator.decide(
            pose,
            [self._map(others), _tracks(others, ego, now, dt)],
            _goal(ego),
            now=now,
            previous=self._previous if isinstance(self._previous, VehicleDecision) else None,
        )
        command, self._previous = decision.command, decision
        mean = 0.5 * (pose.speed + command.speed), command.turn if steered else 0.5 * (pose.turn + command.turn)
        self._velocity, self._turn = np.array([command.speed, 0.0]), command.turn
        return np.array(mean)[:, None]

    def _map(self, others: list[Any]) -> ObstacleTable:
        """Objects at rest, made again only if others are."""
        still = [o for o in others if o.static and not o.unobstructed]
        ids = tuple(o.id for o in still)
        if ids != self._fixed[0]:
            self._fixed = ids, ObstacleTable([part for each in still for part in _at_rest(each)])
        return self._fixed[1]


def _settings(given: dict[str, Any]) -> dict[str, Any]:
    unknown = sorted(set(given) - set(DEFAULTS) - OF_IRSIM)
    if unknown:
        raise InvalidInput(f"behavior: expected settings of {', '.join(sorted(DEFAULTS))}, found {', '.join(unknown)}")
    made: dict[str, Any] = {**DEFAULTS, **{name: value for name, value in given.items() if name in DEFAULTS}}
    for name in ("max_acceleration", "horizon", "steering_rate"):
        positive(made[name], name)
    not_negative(made["margin"], "margin")
    return made


def _navigator(kind: str, ego: Any, settings: dict[str, Any], dt: float) -> Navigator | VehicleNavigator:
    """The navigator for the kinematics, shape and limits of a robot."""
    fastest, most = ego.vel_max[:, 0].astype(np.float64), np.asarray(ego.info.acce, np.float64).reshape(-1)
    chosen, acceleration = method(settings["method"]), min(settings["max_acceleration"], float(most[0]))
    radius = float(np.linalg.norm(ego.original_vertices.T, axis=1).max())
    backwards = max(0.0, -float(ego.vel_min[0, 0]))
    keywords = {"horizon": settings["horizon"], "margin": settings["margin"]}
    if ego.shape == "circle":
        radius = float(ego.radius) + hypot(*ego.original_centroid[:2, 0])
    if kind == "omni":
        limits = Limits(float(fastest.min()), min(acceleration, float(most.min())))
        return Navigator(chosen, Disc(radius), limits, period=dt, **keywords)
    if kind == "diff":
        ratio = fastest[0] / fastest[1]
        wheels = min(acceleration, float(most[1]) * ratio if isfinite(most[1]) else acceleration)
        drive = DifferentialDrive(2.0 * ratio, fastest[0], wheels, ahead=radius, period=dt, max_reverse_speed=backwards)
        return VehicleNavigator(drive, chosen, Disc(radius), **keywords)
    rate = min(settings["steering_rate"], float(most[1]))
    car = Bicycle(
        *(float(ego.wheelbase), float(fastest[1]), rate, float(fastest[0]), acceleration),
        period=dt,
        max_reverse_speed=backwards,
    )
    low_x, low_y, high_x, high_y = ego.original_geometry.bounds
    body = Rectangle(high_x - low_x, 2.0 * max(high_y, -low_y))
    return VehicleNavigator(car, chosen, body, 0.5 * (low_x + high_x), **keywords)


def _goal(ego: Any) -> Goal:
    return Goal(Stationary(ego.goal[:2, 0].astype(np.float64)), 0.5 * float(ego.goal_threshold), stop=True)


def _tracks(others: list[Any], ego: Any, now: float, dt: float) -> Tracks:
    """Objects that move, as discs. ir-sim moves them in turn: those before the robot have made this step already."""
    moving = [o for o in others if not o.static and not o.unobstructed]
    order = {o.id: k for k, o in enumerate(ego._env_param.objects)}
    velocities = np.array([o.velocity_xy[:2, 0] for o in moving], np.float64).reshape(-1, 2)
    ahead = np.array([dt * (order[o.id] < order[ego.id]) for o in moving])
    positions = np.array([o.centroid[:2, 0] for o in moving], np.float64).reshape(-1, 2)
    return Tracks(positions - ahead[:, None] * velocities, velocities, [float(o.radius_extend) for o in moving], now)


def _at_rest(other: Any) -> list[Obstacle]:
    """Obstacles of an object at rest: discs, polygons, lines, and the outlines of occupied cells of maps."""
    geometry = other.geometry
    if other.shape == "circle":
        return [Obstacle(Disc(float(other.radius)), Stationary(other.centroid[:2, 0]), other.name)]
    if other.shape == "map" and other.grid_map is not None:
        geometry = geometry.union(occupied(other.grid_map, other.grid_reso[:, 0], other.world_offset))
    found: list[Obstacle] = []
    for part in shapely.get_parts(geometry):
        if part.geom_type == "Polygon" and not part.interiors:
            found.append(Obstacle(Polygon(part.exterior.coords[:-1]), Stationary((0, 0)), other.name))
        else:
            rings = [part.exterior, *part.interiors] if part.geom_type == "Polygon" else [part]
            found += [Obstacle(Polyline(ring.coords), Stationary((0, 0)), other.name) for ring in rings]
    return found


def occupied(cells: Array, size: Array, corner: Any) -> Any:
    """Polygons [m] of all cells of a map (n, m) that are occupied, from 0 to 100, with the cells' `size` (2,) [m].

    ir-sim takes each as a disc of half the longer side about its middle; a square contains it.
    """
    # In cells, so that squares that touch share their corners to the bit.
    middles, half = np.argwhere(cells > OCCUPANCY_THRESHOLD) + 0.5, 0.5 * np.max(size) / size
    area = shapely.union_all(shapely.box(*(middles - half).T, *(middles + half).T)).simplify(0.0)
    return shapely.transform(area, lambda points: points * size + np.asarray(corner, np.float64)[:2])


for _kind in ("omni", "diff", "acker"):
    register_behavior_class(_kind, NAME)(Slalom)
